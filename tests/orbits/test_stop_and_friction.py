"""A rigid stop and dry friction on one mass: an impact that turns the speed round turns the friction in the same instant."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import Coulomb, HarmonicForce, RigidStop
from bifurc.orbits.orbit import PeriodicOrbit


def system(friction=0.05, restitution=0.8, omega=2.6, gap=0.5, amplitude=1.0, damping=0.04):
    return bf.System(1.0, damping, 1.0, (HarmonicForce(amplitude), RigidStop(gap, restitution), Coulomb(friction)), omega=omega)


def test_period_two_motion():
    """Newton converges on the settled motion; its multipliers are those of differences of the simulated map."""
    settled = bf.simulate(system(), (-0.53, -0.31), periods=300).final
    orbit = bf.find_orbit(system(), settled, periods=2)
    assert orbit.success and orbit.residual < 1e-14 and orbit.stable and orbit.periods == 2
    assert np.abs(orbit.state - settled).max() < 1e-9
    (impact,) = [event for event in orbit.events if event.kind == "impact"]
    assert impact.mode_before[1:] == ("free", "slip+") and impact.mode_after[1:] == ("free", "slip-")
    np.testing.assert_allclose(impact.after[1], -0.8 * impact.before[1], rtol=1e-14)
    step, slope = 1e-6, np.empty((2, 2))
    for i in range(2):
        ends = [bf.simulate(system(), orbit.state + sign * step * np.eye(2)[i], periods=2).final for sign in (1.0, -1.0)]
        slope[:, i] = (ends[0] - ends[1]) / (2.0 * step)
    np.testing.assert_allclose(np.sort(np.linalg.eigvals(slope)), np.sort(orbit.multipliers), rtol=0, atol=1e-7)


@pytest.mark.parametrize(("friction", "restitution", "gap", "amplitude", "omega"), [
    (0.175, 0.0, -0.027, 1.916, 2.57), (0.294, 0.0, 0.777, 0.807, 0.97), (0.351, 0.0, 0.731, 1.825, 0.513),
    (0.0184, 0.0, -0.087, 1.032, 2.687), (0.1, 0.5, 0.2, 1.0, 1.3)])
def test_settled_motion_is_found_from_rest(friction, restitution, gap, amplitude, omega):
    """Plastic impacts that slide off, stick at the wall or rest on it: the orbit is the motion on which the simulation settles."""
    scene = system(friction, restitution, omega, gap, amplitude, 0.08)
    orbit = bf.find_orbit(scene)
    assert orbit.success, orbit.message
    back = bf.simulate(scene, orbit.state, periods=orbit.periods)
    assert np.abs(back.final - orbit.state).max() < 1e-9


@pytest.mark.parametrize(("friction", "restitution"), [(0.05, 0.8), (0.01, 0.8), (0.3, 0.8), (0.05, 0.3), (0.05, 0.95)])
def test_every_start_is_resolved(friction, restitution):
    """At most .5 % of the starts stay without a label."""
    found = bf.basins_of_attraction(system(friction, restitution), bf.Grid(q0=(-2.0, 0.5, 24), v0=(-3.0, 3.0, 24)))
    assert (found.labels < 0).mean() <= 0.005


def test_rows_that_are_held_must_be_at_rest_where_they_are():
    """The equations of "impact, release" have roots at restitution above 0, which are no motions: the audit says why."""
    plastic = bf.systems.impact_oscillator(zeta=0.05, omega=0.7, amplitude=0.6, gap=0.0, restitution=0.0)
    orbit = bf.find_orbit(plastic)
    assert orbit.success and "release" in orbit.signature and orbit.closing_excess == 0.0
    from bifurc.orbits.solving import solve

    other = solve(plastic.with_parameters(restitution=0.1), orbit.sequence, orbit.unknowns, orbit.weights, {})
    assert isinstance(other, PeriodicOrbit) and other.residual < 1e-11
    assert not other.success and other.status == "inadmissible" and "not at rest" in other.message


def test_no_impact_of_a_train_that_still_settles_is_lost():
    """The train comes a little later in every period: its orbit lists as many impacts as simulation from its own state does."""
    K = np.array([[1.823, -0.823], [-0.823, 1.823]])
    C = np.array([[0.1094, -0.0494], [-0.0494, 0.1094]])
    elements = HarmonicForce(1.5), RigidStop(0.202, 0.598), Coulomb(0.653, dof=1)
    system = bf.System(np.diag([1.0, 0.576]), C, K, elements, omega=0.532)
    orbit = bf.find_orbit(system)
    assert orbit.success
    motion = bf.simulate(system, orbit._states(np.array([0.5]))[0], periods=2, t0=0.5 * orbit.forcing_period)
    later = [event for event in motion.events if 0.5 <= event.time / orbit.forcing_period - 0.5 < 1.5]
    impacts = [sum(event.kind == "impact" for event in events) for events in (orbit.events, later)]
    assert impacts[0] == impacts[1] > 20
    branch = bf.trace(orbit, "rigid_stop.gap", bounds=(0.2, 0.204))
    assert len(branch) > 3
