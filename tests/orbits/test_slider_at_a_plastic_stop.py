"""A slider beside a stop without restitution slips until the mass is at rest, and sticks in the instant at which that leaves."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import HarmonicForce, Jenkins, RigidStop

MASS, DAMPING, STIFFNESS, FORCE, GAP, SPRING, LIMIT, OMEGA = 1.5, 0.02, 1.0, 1.5, 0.257, 2.71, 0.687, 0.945
M, K = np.diag([1.5, 1.0]), np.array([[2.0, -1.0], [-1.0, 2.0]])


def one_mass():
    return bf.System(MASS, DAMPING, STIFFNESS, [HarmonicForce(FORCE), RigidStop(GAP, 0.0, side=-1), Jenkins(SPRING, LIMIT)],
                     omega=OMEGA)


def followed(periods, steps=20000):
    """Times of impacts and releases, forcing periods, by short steps: the slider's force follows the way, up to its limit."""
    h = 2.0 * np.pi / OMEGA / steps
    load = FORCE * np.cos(2.0 * np.pi * (np.arange(periods * steps) + 0.5) / steps)
    u, v, force, rests, found = 0.0, 0.0, 0.0, False, []
    for k in range(load.size):
        v += h * (load[k] - DAMPING * v - STIFFNESS * u - force) / MASS
        if rests and v <= 0.0:
            v = 0.0
        elif rests:
            rests = False
            found.append(k / steps)
        way = h * v
        force = min(max(force + SPRING * way, -LIMIT), LIMIT)
        u += way
        if u < -GAP:
            u, v, rests = -GAP, 0.0, True
            found.append(k / steps)
    return np.array(found)


def test_the_slider_sticks_where_the_mass_leaves_its_stop():
    """The instants of impact and release, and of the stick with it; a rest remembers nothing, so that all multipliers are 0."""
    orbit = bf.find_orbit(one_mass())
    assert orbit.success and orbit.stable and np.abs(orbit.multipliers).max() < 1e-12
    impact, release = followed(9)[-2:]
    times = {(event.element, event.kind.value): event.time * OMEGA / (2.0 * np.pi) for event in orbit.events}
    for kind, at in (("impact", impact), ("release", release)):
        assert abs((times["rigid_stop", kind] - at + 0.5) % 1.0 - 0.5) < 3e-4
    sticks = [event for event in orbit.events if event.kind == "stick"]
    assert min(abs(event.time * OMEGA / (2.0 * np.pi) - times["rigid_stop", "release"]) for event in sticks) < 1e-13


COUPLED = {
    "at the stop": [RigidStop(GAP, 0.0, side=-1), Jenkins(SPRING, LIMIT)],
    "three sliders": [RigidStop(GAP, 0.0, side=-1), Jenkins(SPRING, LIMIT), Jenkins(1.0, 0.3), Jenkins(1.0, 0.2, dof=1)],
    "between the masses": [RigidStop(GAP, 0.0, row=(1.0, -1.0)), Jenkins(SPRING, 0.287, row=(1.0, -1.0))],
}


@pytest.mark.parametrize("name", COUPLED)
def test_multipliers_and_exponents_are_those_of_simulations(name):
    """Through the instant of two events, the second of which begins with zero speed: differences of simulated motions."""
    system = bf.System(M, 0.05 * K, K, [HarmonicForce(1.5), *COUPLED[name]], omega=0.645 if name == "three sliders" else 0.845)
    orbit = bf.find_orbit(system)
    assert orbit.success and orbit.stable
    begin, h = 0.37 * system.period, 1e-6
    y = orbit._states(np.array([0.37]))[0]
    columns = [(bf.simulate(system, y + e, periods=orbit.periods, t0=begin).final
                - bf.simulate(system, y - e, periods=orbit.periods, t0=begin).final) / (2.0 * h) for e in h * np.eye(y.size)]
    seen = np.sort(np.abs(np.linalg.eigvals(np.array(columns).T)))[::-1]
    own = np.sort(np.abs(orbit.multipliers))[::-1]
    seen = seen[seen.size - own.size:]  # a slider that never slips keeps where it stands
    np.testing.assert_allclose(own, seen, atol=1e-7)
    exponents = bf.lyapunov_exponents(system, orbit.state, periods=400, transient=40)
    told = np.exp(exponents.per_period * orbit.periods)
    np.testing.assert_allclose(told[told.size - own.size:], own, atol=2e-3)


def test_a_slider_at_its_limit_under_a_mass_at_rest_makes_no_event():
    """It is at its limit all the time, to rounding: between an impact and the release nothing happens."""
    system = bf.System(M, 0.05 * K, K, [HarmonicForce(1.5), *COUPLED["between the masses"]], omega=0.845)
    motion = bf.simulate(system, np.zeros(4), periods=100)
    kinds = [(event.element, event.kind.value) for event in motion.events if event.time > 50 * system.period]
    assert kinds.count(("rigid_stop", "release")) >= 49
    for before, after in zip(kinds[:-1], kinds[1:], strict=True):
        if before == ("rigid_stop", "impact"):
            assert after[0] == "rigid_stop"
