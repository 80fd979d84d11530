"""Orbits with an elastic stop that lets go at zero force: the mass comes back behind the gap as an event of the orbit."""
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import bifurc as bf
from bifurc import elements as el


def end_of_period(y0, omega, damping, force, gap, stiffness, dashpot, start):
    """Return the state (2,) a forcing period after `start`, by DOP853 and its root finder."""
    t, y, touching, end = start, np.array(y0, float), False, start + 2.0 * np.pi / omega
    assert y[0] < gap

    def push(y):
        return stiffness * (y[0] - gap) + dashpot * y[1]

    while t < end:
        def event(t, y, touching=touching):
            return push(y) if touching else y[0] - gap
        event.terminal, event.direction = True, -1 if touching else 1
        part = solve_ivp(lambda t, y, on=touching: [y[1], force * np.cos(omega * t) - damping * y[1] - y[0] - on * push(y)],
                         (t, end), y, method="DOP853", rtol=3e-14, atol=1e-14, events=event)
        t, y, touching = part.t[-1], part.y[:, -1], not touching
    return y


@pytest.mark.parametrize(("omega", "gap", "dashpot"), [(0.8, 0.5, 0.4), (0.9, 0.5, 0.4), (0.8, 0.5, 2.0)])
def test_orbits_that_part_at_zero_force(omega, gap, dashpot):
    system = bf.System(1.0, 0.05, 1.0, [el.HarmonicForce(0.5), el.ElasticStop(gap, 10.0, damping=dashpot, release="force")],
                       omega=omega)
    orbit = bf.find_orbit(system)
    assert orbit.success and orbit.stable and orbit.sequence.events == 3
    t, y = orbit.sample(400)
    k = int(np.argmin(y[:, 0]))  # far from the stop
    end = end_of_period(y[k], omega, 0.05, 0.5, gap, 10.0, dashpot, t[k])
    assert np.abs(end - y[k]).max() < 1e-11


def test_a_branch_of_them():
    system = bf.System(1.0, 0.05, 1.0, [el.HarmonicForce(0.5), el.ElasticStop(0.5, 10.0, damping=0.4, release="force")], omega=0.8)
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(0.6, 1.1))
    assert [end.reason.value for end in branch.ends] == ["bound", "bound"]
    assert [str(point.kind) for point in branch.special_points].count("fold") == 2
