"""Hard and bad cases of systems without excitation: each ends in the right motion, a named status, or one clear sentence."""
import numpy as np
import pytest

import bifurc as bf
from bifurc import System
from bifurc import elements as el
from tests.reference import rub


def van_der_pol(u, s, mu):
    """Damping that is negative inside the unit circle."""
    return mu * (1.0 - u * u) * s


def van_der_pol_slope(u, s, mu):
    """Derivatives of `van_der_pol`."""
    return -2.0 * mu * u * s, mu * (1.0 - u * u)


@pytest.mark.parametrize("mu, period", [(1.0, 6.66328685932313), (5.0, 11.61223066771956)])
def test_van_der_pol_from_its_unstable_state_of_rest(mu, period):
    system = System(1.0, 0.0, 1.0, [el.Force(van_der_pol, van_der_pol_slope, mu=mu, odd=True)])
    orbit = bf.find_orbit(system)
    assert orbit.success and orbit.stable and orbit.closure == -1
    assert orbit.period == pytest.approx(period, abs=1e-11)
    whole = bf.find_orbit(system, closure=1)
    assert whole.closure == 1 and whole.period == pytest.approx(period, abs=1e-11)
    assert whole.multipliers == pytest.approx(orbit.multipliers, abs=1e-9)


def test_motions_that_come_to_rest():
    for system in (System(1.0, 0.1, 1.0), System(1.0, 0.1, 1.0, [el.Coulomb(0.5)]), bf.systems.belt_oscillator(belt_speed=0.8),
                   System(1.0, 0.1, 1.0, [el.RigidStop(-0.5)])):
        orbit = bf.find_orbit(system)
        assert orbit.status == "at_rest" and not orbit.success and "find_equilibrium" in orbit.message
        assert bf.find_equilibrium(system).success


def test_a_guess_far_from_the_orbit_is_followed_to_it():
    given = {"zeta": 0.06, "nu": 1.83, "eccentricity": 0.34, "stiffness": 42.3, "friction": 0.04}
    orbit = bf.find_orbit(bf.systems.rotating_frame_rotor(**given), guess=(0.7, 0.71, 0.6, -0.36))
    assert orbit.success and orbit.stable and orbit.sequence.events == 2 and orbit.how["transient"] > 10.0 * orbit.period
    # in coordinates that do not turn the motion comes back turned by the angle of the spin
    x, y, u, v = orbit.state
    start = np.array([x, y, u - 1.83 * y, v + 1.83 * x])
    end = rub.elastic_rotor(start, orbit.period, disk_radius=20.0, **given)
    c, s = np.cos(1.83 * orbit.period), np.sin(1.83 * orbit.period)
    turned = [c * start[0] - s * start[1], s * start[0] + c * start[1], c * start[2] - s * start[3], s * start[2] + c * start[3]]
    assert np.abs(end - turned).max() < 1e-10


def test_a_motion_that_dies_out_slowly_comes_to_rest():
    given = {"zeta": 0.08, "nu": 1.69, "eccentricity": 0.32, "stiffness": 15.0, "friction": 0.05}
    system = bf.systems.rotating_frame_rotor(**given)
    assert bf.find_orbit(system, guess=(0.8, 0.6, 1.88, -1.12)).status == "at_rest"
    late = bf.simulate(system, (0.8, 0.6, 1.88, -1.12), duration=1500.0).final
    radii = rub.synchronous_rub(0.08, 1.69, 0.32, 15.0, 0.05)
    assert np.abs(np.hypot(*late[:2]) - radii).min() < 1e-6  # synchronous rub, in closed form


def test_a_conservative_centre_has_every_energy():
    system = System(1.0, 0.0, 1.0, [el.RigidStop(1.0, 1.0)])
    assert bf.find_orbit(system).status == "at_rest"
    orbit = bf.find_orbit(system, guess=(0.5, 0.0))
    assert orbit.energy == pytest.approx(0.125) and orbit.omega == pytest.approx(1.0, abs=1e-13) and orbit.stable is None
    with pytest.raises(ValueError, match="keeps its energy"):
        bf.trace(orbit, "gap", bounds=(0.6, 2.0))
    rest = bf.find_equilibrium(system)
    assert rest.success and rest.stable is None and rest.eigenvalues == pytest.approx([1j, -1j])


def test_sliding_circles_of_an_undamped_belt_are_a_continuum():
    system = bf.systems.belt_oscillator(zeta=0.0, belt_speed=0.3)
    rest = bf.find_equilibrium(system)
    assert rest.stable is None and rest.state[0] == pytest.approx(0.6)
    assert bf.find_orbit(system).period == pytest.approx(4.42859487117636 + 2.0 / 0.75, abs=1e-12)  # every speed has its stick-slip


def test_wrong_questions_are_told():
    belt, forced = bf.systems.belt_oscillator(), bf.systems.impact_oscillator()
    with pytest.raises(ValueError, match="has no excitation"):
        bf.find_orbit(belt, periods=2)
    with pytest.raises(ValueError, match="the excitation of"):
        bf.find_orbit(forced, period=3.0)
    with pytest.raises(ValueError, match="guess"):
        bf.find_orbit(belt, guess=(1.0, 2.0, 3.0))
    with pytest.raises(ValueError, match="not symmetric"):
        bf.find_orbit(belt, closure=-1)
    with pytest.raises(ValueError, match="autonomous"):
        bf.basins_of_attraction(belt, bf.Grid(q0=(-1, 1, 4), v0=(-1, 1, 4)))
    with pytest.raises(ValueError, match="has no forcing period"):
        bf.simulate(belt, (0.0, 0.0), periods=3)
    with pytest.raises(ValueError, match="the excitation of"):
        bf.lyapunov_exponents(forced, (0.0, 0.0), period=3.0)


def test_a_belt_at_rest_is_dry_friction():
    rest = bf.find_equilibrium(bf.systems.belt_oscillator(belt_speed=0.0))
    assert rest.status == "continuum" and rest.intervals[0] == pytest.approx((-1.0, 1.0))


def test_one_exponent_is_zero():
    system = bf.systems.belt_oscillator(law="cubic", belt_speed=0.948369)
    orbit = bf.find_orbit(system)
    found = bf.lyapunov_exponents(system, orbit.state, periods=200, transient=0, batches=4, period=orbit.period)
    decay = np.log(orbit.multipliers[0].real) / orbit.period
    assert found.values == pytest.approx([0.0, decay], abs=1.1 / (200 * orbit.period)) and not found.chaotic
    sticking = bf.lyapunov_exponents(bf.systems.belt_oscillator(), (0.0, 0.0), periods=60, transient=5, batches=4)
    assert abs(sticking.values[0]) < 4.0 * sticking.errors[0] + 1e-3 and sticking.values[1] == -np.inf == sticking.sum_rule


def test_orbits_without_a_clock_are_stored(tmp_path):
    orbit = bf.find_orbit(bf.systems.belt_oscillator())
    orbit.save(tmp_path / "orbit.npz")
    again = bf.load(tmp_path / "orbit.npz")
    assert again.success and again.period == orbit.period and again.autonomous
    branch = bf.trace(orbit, "belt_speed", bounds=(0.2, 0.4))
    branch.save(tmp_path / "branch.npz")
    again = bf.load(tmp_path / "branch.npz")
    assert again.column("period") == pytest.approx(branch.column("period"), abs=1e-13)
    rest = bf.trace(bf.find_equilibrium(orbit.system), "belt_speed", bounds=(0.2, 0.4))
    rest.save(tmp_path / "rest.npz")
    assert bf.load(tmp_path / "rest.npz").orbits[0].success
    assert orbit.harmonic(0).real == pytest.approx(np.trapezoid(orbit.sample(4001)[1][:, 0], dx=1.0) / 4000, abs=1e-4)
