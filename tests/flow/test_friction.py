"""Dry friction in motion, against the event-driven reference and against scipy's integration of each phase."""
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import bifurc as bf
from bifurc import elements as el
from bifurc.system import System
from tests.reference.coulomb import EventDriven

CASES = {
    "slip": dict(omega=1.0, zeta=0.1, amplitude=1.6),
    "stick": dict(omega=1.0, zeta=0.1, amplitude=1.4),
    "nearly at rest": dict(omega=1.0, zeta=0.1, amplitude=1.001),
    "six sticks": dict(omega=0.06, zeta=0.02, amplitude=2.0),
    "no damping": dict(omega=0.8, zeta=0.0, amplitude=1.2),
    "asymmetric": dict(omega=1.0, zeta=0.1, amplitude=1.4, friction_negative=0.5),
    "load separates": dict(omega=1.0, zeta=0.1, amplitude=1.4, load_amplitude=1.5, load_phase=0.7),
    "load touches zero": dict(omega=1.0, zeta=0.1, amplitude=1.4, load_amplitude=1.0),
}


def reference(case):
    load = (case.get("load_amplitude", 0.0), case.get("load_phase", 0.0))
    return EventDriven(case["omega"], case["zeta"], case["amplitude"], down=case.get("friction_negative"), load=load)


@pytest.mark.parametrize("name", CASES)
def test_coulomb_against_the_event_driven_reference(name):
    """Times, positions and the state after some periods from rest, and from a speed."""
    case = CASES[name]
    system = bf.systems.dry_friction_oscillator(**case)
    omega = case["omega"]
    for x, v in ((0.0, 0.0), (0.3, 1.0)):
        motion = bf.simulate(system, (x, v), periods=4)
        events, (x1, v1) = reference(case).march(0.0, x, v / omega, 8 * np.pi)
        ours = [event for event in motion.events if event.kind != "graze"]
        if v == 0.0 and len(ours) < len(events):
            events = events[len(events) - len(ours):]
        assert len(ours) == len(events)
        for event, (tau, at, speed, _) in zip(ours, events, strict=True):
            assert event.time * omega == pytest.approx(tau, abs=2e-9)
            assert event.before[0] == pytest.approx(at, abs=1e-11)
            assert event.after[1] / omega == pytest.approx(speed, abs=1e-9)
        assert motion.final == pytest.approx([x1, v1 * omega], abs=1e-10)


def test_static_friction_above_kinetic():
    """Stick lasts up to the static limit, slip starts with a jump of the force."""
    system = System(1.0, 0.2, 1.0, [el.HarmonicForce(1.8, phase=-np.pi / 2), el.Coulomb(1.0, static_ratio=1.3)], omega=1.0)
    motion = bf.simulate(system, (0.0, 0.0), periods=6)
    events, last = EventDriven(1.0, 0.1, 1.8, static=1.3).march(0.0, 0.0, 0.0, 12 * np.pi)
    assert [event.time for event in motion.events] == pytest.approx([event[0] for event in events], abs=1e-9)
    assert motion.final == pytest.approx(last, abs=1e-10)
    for event in motion.events:
        if event.kind == "slip":
            demand = 1.8 * np.sin(event.time) - event.before[0]
            assert abs(demand) == pytest.approx(1.3, abs=1e-12)


def test_a_belt_carries_the_mass_while_it_sticks():
    V = 0.4
    system = System(1.0, 0.2, 1.0, [el.HarmonicForce(0.3), el.Coulomb(1.0, belt_speed=V)], omega=0.7)
    motion = bf.simulate(system, (0.0, 0.0), duration=30.0)
    kinds = [event.kind for event in motion.events]
    assert kinds[:2] == ["stick", "slip"]
    stuck = motion(np.linspace(motion.events[0].time + 1e-9, motion.events[1].time - 1e-9, 7))
    assert stuck[:, 1] == pytest.approx(V, abs=1e-14)
    at = motion.events[1]
    assert 0.3 * np.cos(0.7 * at.time) - at.before[0] - 0.2 * V == pytest.approx(-1.0, abs=1e-12)  # held by friction up to 1

    def slip(t, y):
        return [y[1], 0.3 * np.cos(0.7 * t) - 0.2 * y[1] - y[0] + 1.0]  # the belt is faster: it pulls, also where it would not

    y0 = [0.0, 0.0]
    first = brentq(lambda t: solve_ivp(slip, (0.0, t), y0, method="DOP853", rtol=1e-12, atol=1e-13).y[1, -1] - V, 0.01, 0.5)
    assert motion.events[0].time == pytest.approx(first, abs=1e-9)


@pytest.mark.parametrize("curve, shape", [("exponential", lambda x: np.exp(-x)), ("hyperbolic", lambda x: 1.0 / (1.0 + x))])
def test_stribeck_friction_slips_by_its_curve(curve, shape):
    system = System(1.0, 0.1, 1.0, [el.HarmonicForce(2.0, phase=-np.pi / 2), el.Stribeck(0.8, 1.2, 0.5, curve)], omega=1.0)
    motion = bf.simulate(system, (0.0, 0.0), periods=3)
    assert motion.success and {event.kind for event in motion.events} >= {"stick", "slip"}
    events = [event for event in motion.events if event.kind != "graze"]
    for one, other in zip(events, events[1:], strict=False):
        t = np.linspace(one.time, other.time, 5)[1:-1]
        v = motion(t)[:, 1]
        if np.abs(v).max() == 0.0:
            demand = 2.0 * np.sin(t) - motion(t)[:, 0]
            assert np.abs(demand).max() <= 1.2
            continue
        way = np.sign(v[1])

        def field(t, y, way=way):
            return [y[1], 2.0 * np.sin(t) - 0.1 * y[1] - y[0] - way * (0.8 + 0.4 * shape(abs(y[1]) / 0.5))]

        leg = solve_ivp(field, (one.time, other.time), one.after, method="DOP853", rtol=1e-12, atol=1e-13)
        assert leg.y[:, -1] == pytest.approx(other.before, abs=1e-9)
        if other.kind == "slip":
            assert abs(2.0 * np.sin(other.time) - other.before[0]) == pytest.approx(1.2, abs=1e-9)


def test_regularised_friction_comes_near_dry_friction():
    dry = bf.simulate(bf.systems.dry_friction_oscillator(amplitude=1.6), (0.0, 0.0), periods=3).final
    gaps = []
    for width in (1e-1, 1e-2):
        system = System(1.0, 0.2, 1.0, [el.HarmonicForce(1.6, phase=-np.pi / 2), el.RegularizedFriction(1.0, width)], omega=1.0)
        gaps.append(np.abs(bf.simulate(system, (0.0, 0.0), periods=3).final - dry).max())
    assert gaps[1] < 0.2 * gaps[0] < 0.02


def marched(stiffness, limit, amplitude, omega, zeta, t_end, load=lambda t: 1.0, steps=200_000):
    """Return the state after a march of x'' + 2 zeta x' + x + f = amplitude cos with a slider, by Heun steps and projection."""
    h = t_end / steps
    x = v = w = 0.0
    for i in range(steps):
        t = i * h

        def force(x, w, t):
            f = stiffness * (x - w)
            top = max(limit * load(t), 0.0)
            f = min(max(f, -top), top)
            return f, x - f / stiffness

        f0, w = force(x, w, t)
        a0 = amplitude * np.cos(omega * t) - 2 * zeta * v - x - f0
        x1, v1 = x + h * v + 0.5 * h * h * a0, v + h * a0
        f1, _ = force(x1, w, t + h)
        a1 = amplitude * np.cos(omega * (t + h)) - 2 * zeta * v1 - x1 - f1
        x, v = x + 0.5 * h * (v + v1), v + 0.5 * h * (a0 + a1)
    f, w = force(x, w, t_end)
    return np.array([x, v, w])


@pytest.mark.parametrize("load", [None, (0.5, 0.3), (1.0, 0.0), (1.6, 0.9)], ids=["constant", "varies", "touches", "separates"])
def test_jenkins_against_a_march_with_projection(load):
    omega, t_end = 0.8, 12.0
    extra = {} if load is None else dict(load_amplitude=load[0], load_phase=load[1])
    system = System(1.0, 0.1, 1.0, [el.HarmonicForce(1.5), el.Jenkins(2.0, 0.6, **extra)], omega=omega)
    motion = bf.simulate(system, (0.0, 0.0), duration=t_end)
    kinds = {event.kind for event in motion.events}
    assert kinds >= {"slip", "stick"} | ({"separation", "contact"} if load and load[0] > 1.0 else set())
    level = (lambda t: 1.0) if load is None else (lambda t: 1.0 + load[0] * np.cos(omega * t + load[1]))
    gaps = [np.abs(marched(2.0, 0.6, 1.5, omega, 0.05, t_end, level, steps) - motion.final).max() for steps in (10_000, 40_000)]
    assert gaps[1] < 2e-6 and gaps[1] < 0.5 * gaps[0]


def test_a_slider_shown_while_it_slips_is_where_it_is():
    motion = bf.simulate(bf.systems.jenkins_oscillator(), (0.3, 0.0), periods=5)
    y = motion(np.linspace(0.0, motion.stop, 997))
    assert np.abs(y[:, 0] - y[:, 2]).max() <= 1.0 + 1e-12  # stiffness 1, limit 1
    slips = [k for k, event in enumerate(motion.events) if event.kind == "slip"]
    k = slips[-2]
    at = motion(0.5 * (motion.events[k].time + motion.events[k + 1].time))
    assert abs(at[0] - at[2]) == pytest.approx(1.0, abs=1e-13)


def test_sliders_start_relaxed_and_an_overloaded_one_has_slipped():
    system = bf.systems.jenkins_oscillator()
    assert bf.simulate(system, (0.7, 0.0), duration=0.0).final == pytest.approx([0.7, 0.0, 0.7])
    assert bf.simulate(system, (0.7, 0.0, 0.2), duration=0.0).final == pytest.approx([0.7, 0.0, 0.2])
    assert bf.simulate(system, (3.0, 0.0, 0.2), duration=0.0).final == pytest.approx([3.0, 0.0, 2.0])
    assert bf.simulate(system, (3.0, -1.0, 7.0), duration=0.0).final == pytest.approx([3.0, -1.0, 4.0])


@pytest.mark.parametrize("friction", [1e-12, 0.0])
def test_friction_of_nothing_is_no_friction(friction):
    system = bf.systems.dry_friction_oscillator(friction=friction)
    free = System(1.0, 0.2, 1.0, [el.HarmonicForce(1.4, phase=-np.pi / 2)], omega=1.0)
    a, b = (bf.simulate(s, (0.2, 0.1), periods=10).final for s in (system, free))
    assert a == pytest.approx(b, abs=1e-10)
    system = bf.systems.jenkins_oscillator(limit=friction)
    free = System(1.0, 0.02, 1.0, [el.HarmonicForce(1.0)], omega=1.1)
    a, b = (bf.simulate(s, (0.2, 0.1), periods=10).final[:2] for s in (system, free))
    assert a == pytest.approx(b, abs=1e-9)


def test_lengths_scale():
    """(s alpha, s beta) -> s x, to rounding."""
    one = bf.simulate(bf.systems.dry_friction_oscillator(amplitude=1.4), (0.1, 0.2), periods=5)
    for scale in (1e-9, 7.0, 1e6):
        other = bf.simulate(bf.systems.dry_friction_oscillator(amplitude=1.4 * scale, friction=scale),
                            (0.1 * scale, 0.2 * scale), periods=5)
        assert other.final / scale == pytest.approx(one.final, abs=1e-13)


@pytest.mark.parametrize("call, words", [
    (lambda: el.Jenkins(stiffness=0.0), "Jenkins: stiffness = 0.0 is not allowed"),
    (lambda: el.Jenkins(stiffness=-1.0), "Jenkins: stiffness = -1.0 is not allowed"),
    (lambda: el.Jenkins(limit=-1.0), "Jenkins: limit = -1.0 is not allowed"),
    (lambda: el.Coulomb(-0.1), "Coulomb: friction = -0.1 is not allowed"),
    (lambda: el.Coulomb(0.1, static_ratio=0.9), "static_ratio = 0.9 is not allowed"),
    (lambda: el.Coulomb(0.1, load_phase=0.9), "load_phase = 0.9 is not allowed with a constant load"),
    (lambda: el.Stribeck(1.0, 0.5), "static = 0.5 is not allowed"),
    (lambda: el.Stribeck(1.0, 1.5, curve="linear"), "curve = 'linear' is not allowed"),
    (lambda: el.RegularizedFriction(1.0, 0.0), "width = 0.0 is not allowed"),
    (lambda: bf.systems.dry_friction_oscillator(friction=-1.0), "friction = -1.0 is not allowed"),
])
def test_bad_numbers_are_named(call, words):
    with pytest.raises(ValueError, match=words):
        call()


def test_an_impact_turns_sliding_round():
    """Friction and a stop on one coordinate: the rebound keeps its speed; arcs about the two shifted centres in closed form."""
    f, gap, r = 0.1, 0.5, 0.8
    system = bf.System(1.0, 0.0, 1.0, (bf.elements.Coulomb(f), bf.elements.RigidStop(gap=gap, restitution=r)))
    hit = brentq(lambda t: -f + f * np.cos(t) + np.sin(t) - gap, 0.1, 1.0, xtol=1e-15)
    speed = -f * np.sin(hit) + np.cos(hit)
    motion = bf.simulate(system, [0.0, 1.0], duration=1.5)
    rest = 1.5 - hit
    expected = [f + (gap - f) * np.cos(rest) - r * speed * np.sin(rest), -(gap - f) * np.sin(rest) - r * speed * np.cos(rest)]
    np.testing.assert_allclose(motion.final, expected, rtol=0, atol=1e-13)
    (event,) = motion.events  # the friction turns in the instant of the impact
    assert event.element == "rigid_stop"
    assert event.mode_before == ("slip+", "free") and event.mode_after == ("slip-", "free")


def test_rest_on_a_stop_with_friction_ends_where_the_load_exceeds_it():
    """Rebounds die out at a stop 0.2 away; the load cos 2t - 0.2 pulls the mass off where it is -0.1: cos 2t = 0.1."""
    system = bf.System(1.0, 0.1, 1.0, (el.HarmonicForce(1.0), el.Coulomb(0.1), el.RigidStop(gap=0.2, restitution=0.7)),
                       omega=2.0)
    for start in ([-1.31897916, -0.31222741], [-1.26933654, -0.27262667], [-1.21655753, -0.22877002]):
        motion = bf.simulate(system, start, periods=3)
        kinds = [event.kind for event in motion.events]
        assert motion.success and len(kinds) < 100
        rest = kinds.index("chatter")
        assert kinds[rest + 1:rest + 3] == ["release", "slip"]
        assert "stick" in motion.events[rest + 1].mode_after  # first off the stop, still stuck
        times = [event.time for event in motion.events[rest + 1:rest + 3]]
        leaves = np.arccos(0.1) / 2.0 + np.pi
        assert times[0] < times[1] and abs(times[1] - leaves) <= 1e-14 * leaves
        np.testing.assert_allclose(motion.events[rest + 2].after, [0.2, 0.0], rtol=0, atol=1e-15)
        after = bf.simulate(system, [0.2, 0.0], t0=leaves, duration=3.0 * np.pi - leaves).final
        np.testing.assert_allclose(motion.final, after, rtol=0, atol=1e-12)
        np.testing.assert_allclose(motion.final, [-1.162259, 0.661421], rtol=0, atol=2e-5)  # time stepping of Moreau, h = 2e-5


def test_a_slider_that_stops_with_another_friction_does_not_leap_to_its_other_limit():
    """Two masses that stick to each other come to rest on the floor, and with them the slider on one of them.

    Which of the two zeros of one speed comes first is rounding.  From there the slider unloads: the force k (q - w) is within its
    limit, and it never goes from one slip to the other without sticking between.  The motion settles, so that every period is the
    same, whichever zero came first in it.
    """
    between, limit, stiffness = (-1.0, 1.0), 0.1, 4.0
    system = bf.System(np.eye(2), 0.2 * np.eye(2), np.eye(2), [
        el.HarmonicForce(0.8), el.Jenkins(stiffness, limit), el.Coulomb(0.3, load_amplitude=0.4, row=between),
        el.Coulomb(0.4, load_amplitude=0.1, dof=1), el.RigidStop(-0.2, 0.3, row=between)], omega=1.3)
    motion = bf.simulate(system, (0.2, -0.2, 0.0, 0.0, 0.0), periods=80)
    slips = [(event.mode_before[1], event.mode_after[1]) for event in motion.events]
    assert motion.success and len(slips) > 1000
    assert not {("slip+", "slip-"), ("slip-", "slip+")} & set(slips)
    together = [(one, other) for one, other in zip(motion.events, motion.events[1:], strict=False)
                if {one.element, other.element} == {"jenkins", "coulomb_2"} and other.time - one.time < 1e-9]
    assert len(together) > 50
    sections = motion.sections
    np.testing.assert_allclose(sections[-1], sections[-2], rtol=0.0, atol=1e-12)
    _, states = motion.sample(40000)
    force = stiffness * (states[:, 0] - states[:, 4])
    assert 0.999 * limit < np.abs(force).max() <= limit * (1.0 + 1e-9)
