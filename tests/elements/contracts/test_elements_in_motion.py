"""Elements in motion, against scipy's integration of the force laws written out here: no table, no mode, no guard."""
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import bifurc as bf
from bifurc import elements as el
from bifurc.system import System

from .test_elements import UserStop

OMEGA, PERIODS = 1.1, 6
PERIOD = 2 * np.pi / OMEGA


def integrate(force, y0, duration):
    """Return the state after ``duration`` of x'' + 0.1 x' + x = 1.5 cos(omega t) + force(t, x, v)."""
    def field(t, y):
        return [y[1], 1.5 * np.cos(OMEGA * t) - 0.1 * y[1] - y[0] + force(t, y[0], y[1])]

    return solve_ivp(field, (0.0, duration), y0, method="DOP853", rtol=1e-11, atol=1e-12, max_step=0.01).y[:, -1]


def final(element, y0):
    """Return the motion with an element added, and its last state."""
    system = System(1.0, 0.1, 1.0, [el.HarmonicForce(1.5), element], omega=OMEGA)
    motion = bf.simulate(system, y0, periods=PERIODS)
    assert motion.success
    return motion, motion.y[-1]


def clipped(k, c, gap, side=1, amplitude=0.0, pulls=True):
    """Force of an elastic stop; `pulls`: acts in the whole penetration, otherwise only while it pushes."""
    def force(t, x, v):
        wall, wall_speed = amplitude * np.cos(OMEGA * t), -amplitude * OMEGA * np.sin(OMEGA * t)
        d, rate = side * (x - wall) - gap, side * (v - wall_speed)
        if d <= 0.0:
            return 0.0
        f = k * d + c * rate
        return -side * (f if pulls else max(f, 0.0))

    return force


@pytest.mark.parametrize("stop, law", [
    (el.ElasticStop(0.5, 4.0), clipped(4.0, 0.0, 0.5)),
    (el.ElasticStop(0.5, 4.0, 0.6), clipped(4.0, 0.6, 0.5)),
    (el.ElasticStop(0.5, 4.0, 0.6, release="force"), clipped(4.0, 0.6, 0.5, pulls=False)),
    (el.ElasticStop(-0.2, 9.0, 3.0, release="force", side=-1), clipped(9.0, 3.0, -0.2, -1, pulls=False)),
    (el.ElasticStop(0.4, 5.0, 2.0, release="force", amplitude=0.3, harmonic=1),
     clipped(5.0, 2.0, 0.4, 1, 0.3, pulls=False)),
    (el.ElasticStop(0.5, -0.4), clipped(-0.4, 0.0, 0.5)),
], ids=["spring", "pulling", "released", "preloaded", "moving", "taken away"])
def test_elastic_stops_are_their_force_law(stop, law):
    motion, state = final(stop, (0.0, 0.3))
    assert sum(event.kind == "contact" for event in motion.events) >= 3
    assert state == pytest.approx(integrate(law, (0.0, 0.3), PERIODS * PERIOD), abs=2e-6)


def test_linear_springs_are_their_force_law():
    _, state = final(el.LinearSpring(2.0, 0.3), (0.1, 0.3))
    assert state == pytest.approx(integrate(lambda t, x, v: -2.0 * x - 0.3 * v, (0.1, 0.3), PERIODS * PERIOD), abs=1e-9)


def test_a_users_stop_moves_as_the_built_in_one():
    own, ours = final(UserStop(0.4, 0.6), (0.0, 0.3))[0], final(el.RigidStop(0.4, 0.6), (0.0, 0.3))[0]
    assert len(own.events) == len(ours.events) >= 6
    assert [event.time for event in own.events] == [event.time for event in ours.events]
    assert np.array_equal(own.y, ours.y)


def test_stops_on_several_masses_bounce_as_written_out():
    """Three masses in a row, each with its own stop, r = 0.6 ... 0.8; impacts by scipy's events, jumps by hand."""
    base = bf.systems.impact_chain(n=3)
    gaps, ratios = np.array([0.1, 0.15, 0.3]), np.array([0.6, 0.7, 0.8])
    stops = [el.RigidStop(gap, r, dof=i) for i, (gap, r) in enumerate(zip(gaps, ratios, strict=True))]
    system = System(base.mass, base.damping, base.stiffness, [el.HarmonicForce(0.9, dof=2), *stops], omega=OMEGA)
    duration = 4 * PERIOD
    motion = bf.simulate(system, np.zeros(6), duration=duration)

    def field(t, y):
        force = np.array([0.0, 0.0, 0.9 * np.cos(OMEGA * t)])
        return np.concatenate([y[3:], force - base.damping @ y[3:] - base.stiffness @ y[:3]])

    def surface(i):
        def value(t, y):
            return y[i] - gaps[i]
        value.terminal, value.direction = True, 1.0
        return value

    t, y, times, hit = 0.0, np.zeros(6), [], []
    while t < duration:
        leg = solve_ivp(field, (t, duration), y, method="DOP853", rtol=1e-12, atol=1e-13, max_step=0.05,
                        events=[surface(i) for i in range(3)])
        t, y = leg.t[-1], leg.y[:, -1].copy()
        if leg.status == 1:
            i = next(i for i in range(3) if leg.t_events[i].size)
            y[i], y[3 + i] = gaps[i] - 1e-15, -ratios[i] * y[3 + i]
            times.append(t)
            hit.append(f"rigid_stop_{i + 1}" if i else "rigid_stop")
    impacts = [event for event in motion.events if event.kind == "impact"]
    assert [event.element for event in impacts] == hit and len(set(hit)) >= 2
    assert [event.time for event in impacts] == pytest.approx(times, abs=1e-9)
    assert motion.y[-1] == pytest.approx(y, abs=1e-9)
