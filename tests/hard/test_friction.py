"""Hard cases of dry friction: hardly any motion, stiff contacts that ring, loads that touch zero, hardly any friction."""
import numpy as np
import pytest

import bifurc as bf
from bifurc import elements as el
from bifurc.system import System
from tests.reference.coulomb import EventDriven, SlipOnly


@pytest.mark.parametrize("excess", [1e-3, 1e-4, 1e-5])
def test_hardly_any_motion(excess):
    """alpha -> beta: X -> (9/4) (alpha - beta)^2 / alpha, slips of 3 sqrt(2 (alpha - beta) / alpha); transients would take ages."""
    alpha = 1.0 + excess
    orbit = bf.find_orbit(bf.systems.dry_friction_oscillator(amplitude=alpha), (0.0, 0.0))
    assert orbit.success and orbit.closure == -1
    asymptote = 2.25 * excess**2 / alpha
    assert orbit.maximum() == pytest.approx(asymptote, rel=100 * np.sqrt(excess) * np.sqrt(excess) + 0.2 * np.sqrt(excess))
    times = [event.time for event in orbit.events]
    slip = min((b - a) % orbit.period for a, b in zip(times, times[1:], strict=False))
    assert slip == pytest.approx(3.0 * np.sqrt(2.0 * excess / alpha), rel=3.0 * np.sqrt(excess))
    motion = bf.simulate(orbit.system, orbit.state, periods=1)
    assert np.abs(motion.final - orbit.state).max() < 1e-9 * orbit.maximum()


@pytest.mark.parametrize("stiffness, error, count", [(1e2, -1.0e-3, None), (1e3, -9.71499e-3, 8), (1e4, -1.1454e-3, 20),
                                                     (1e5, -9.43e-5, 68)])
def test_stiff_contact_in_place_of_a_rigid_one_rings(stiffness, error, count):
    """The contact spring rings in the stick phase with forces of the size of the limit and slips a little in every swing.

    Errors of x_max by a midpoint march of the law with 2e6 steps a period; they are largest near 1e3 and fall again as the
    micro-slips take the energy of the ringing.
    """
    elements = [el.HarmonicForce(1.4, phase=-np.pi / 2), el.Jenkins(stiffness, 1.0)]
    orbit = bf.find_orbit(System(1.0, 0.2, 1.0, elements, omega=1.0), (-0.6, 0.0))
    assert orbit.success and orbit.stable and count in (None, len(orbit.events))
    assert orbit.maximum() / 0.644462527619 - 1.0 == pytest.approx(error, abs=6e-5 if count is None else 2e-6)
    assert np.abs(bf.simulate(orbit.system, orbit.state, periods=1).final - orbit.state).max() < 1e-9


@pytest.mark.parametrize("omega", [pytest.param(0.7, marks=pytest.mark.slow), 1.0, pytest.param(1.4, marks=pytest.mark.slow)])
def test_load_that_touches_zero(omega):
    """rho = 1: the contact is left at one instant without a separation; the reference marches the same law."""
    orbit = bf.find_orbit(bf.systems.dry_friction_oscillator(omega=omega, load_amplitude=1.0, load_phase=0.4), (0.0, 0.0))
    assert orbit.success
    _, state = EventDriven(omega, 0.1, 1.4, load=(1.0, 0.4)).orbit()
    assert orbit.state[0] == pytest.approx(state[0], abs=1e-9) and orbit.state[1] / omega == pytest.approx(state[1], abs=1e-9)


@pytest.mark.parametrize("friction", [1e-3, 1e-6, 1e-12, 0.0])
def test_hardly_any_friction(friction):
    orbit = bf.find_orbit(bf.systems.dry_friction_oscillator(amplitude=1.6, friction=friction), (0.0, 0.0))
    assert orbit.success
    want = float(SlipOnly(1, 0.1, 1.6, friction).x_max) if friction else 8.0
    assert orbit.maximum() == pytest.approx(want, rel=1e-13)


def test_no_damping_between_the_bounds_of_resonance():
    """Om = 1, xi = 0: bounded stick-slip for 1 < alpha < 4 / pi, nothing bounded above."""
    for alpha in (1.05, 1.2, 1.27):
        assert bf.find_orbit(bf.systems.dry_friction_oscillator(zeta=0.0, amplitude=alpha), (0.0, 0.0)).success
    assert not bf.find_orbit(bf.systems.dry_friction_oscillator(zeta=0.0, amplitude=1.3), (0.0, 0.0), transient=40).success


def test_static_friction_above_kinetic_on_two_masses():
    """Two masses, each with its own contact: the orbit is confirmed by a motion from its state."""
    M, K = np.eye(2), np.array([[2.0, -1.0], [-1.0, 1.5]])
    contacts = [el.Coulomb(0.3, static_ratio=1.2, dof=0), el.Coulomb(0.2, dof=1)]
    system = System(M, 0.1 * K, K, [el.HarmonicForce(1.0, dof=1), *contacts], omega=0.7)
    orbit = bf.find_orbit(system)
    assert orbit.success and {event.element for event in orbit.events} == {"coulomb", "coulomb_2"}
    motion = bf.simulate(system, orbit.state, periods=1)
    assert motion.final == pytest.approx(orbit.state, abs=1e-10)
    assert len(motion.events) == len(orbit.events)
