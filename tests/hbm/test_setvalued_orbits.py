"""find_orbit(method=HarmonicBalance(...)) with Coulomb friction: statuses, interval of rest, error estimates, refusals."""
import numpy as np
import pytest

import bifurc as bf
from bifurc import System, elements
from bifurc.hbm.status import BalanceStatus
from bifurc.orbits.balance.method import HarmonicBalance
from tests.reference.fourier_friction import SteadyFriction


@pytest.mark.parametrize("solver", ["newton", "broyden"])
@pytest.mark.parametrize("amplitude", [1.6, 1.4])
def test_li(amplitude, solver):
    """Converged, with an estimate of the first harmonic that holds and is of the right size."""
    system = bf.systems.dry_friction_oscillator(amplitude=amplitude)
    orbit = bf.find_orbit(system, method=HarmonicBalance(20, solver=solver))
    assert orbit.success and orbit.status is BalanceStatus.CONVERGED and orbit.residual <= 1e-11
    exact = SteadyFriction(1.0, 0.1, amplitude, start=orbit.state)
    error = abs(exact.integrals([1])[0] - orbit.harmonic(1))
    stated = orbit.how["error of the first harmonic"][0]
    assert error <= stated <= 30.0 * error
    t, y = orbit.sample(801)
    largest = 0.0
    for t0, t1, x0, v0, sign in exact.arcs:  # first half of the period
        inside = (t >= t0) & (t < t1)
        largest = max(largest, np.abs(exact.arc(t[inside], t0, x0, v0, sign)[0] - y[inside, 0]).max(initial=0.0))
    assert largest <= orbit.how["error"][0]
    assert orbit.stable is None


@pytest.mark.parametrize(("omega", "xi"), [pytest.param(0.06, 0.02, marks=pytest.mark.slow), (1.0 / 3.0, 0.1), (0.8, 0.0),
                                           (1.0, 0.0), (2.5, 0.2)])
def test_stated_error_holds(omega, xi):
    """Six sticks a period, superharmonics, no damping: the first harmonic is within the stated error."""
    for amplitude in (1.2, 2.0):
        if xi == 0.0 and omega == 1.0 and amplitude > 4.0 / np.pi:
            continue  # unbounded
        system = bf.systems.dry_friction_oscillator(zeta=xi, omega=omega, amplitude=amplitude)
        orbit = bf.find_orbit(system, method=HarmonicBalance(40))
        exact = SteadyFriction(omega, xi, amplitude, start=orbit.state)
        assert orbit.success and exact.closure <= 1e-9
        assert abs(exact.integrals([1])[0] - orbit.harmonic(1)) <= orbit.how["error of the first harmonic"][0]


def test_rest_and_its_interval():
    """|x| <= beta - alpha; with asymmetric limits the middle is shifted; at the limit it is one point."""
    for amplitude, negative, low, high in ((0.8, None, -0.2, 0.2), (0.7, 0.5, -0.3, 0.2), (1.0, None, 0.0, 0.0)):
        system = bf.systems.dry_friction_oscillator(amplitude=amplitude, friction_negative=negative)
        orbit = bf.find_orbit(system, method=HarmonicBalance(5))
        assert orbit.status is BalanceStatus.AT_REST and orbit.success
        if negative is None:
            assert orbit.how["interval"][0] == pytest.approx([low, high], abs=1e-12)
        else:  # alpha sin t - x in [-1, .5] or [-.5, 1]: |x| up to the limit less the amplitude
            assert orbit.how["interval"][0] == pytest.approx([-0.3, -0.2], abs=1e-12) or \
                orbit.how["interval"][0] == pytest.approx([-0.5 + 0.7, 1.0 - 0.7], abs=1e-12)
        assert orbit.how["error"] == [0.0]


def test_rest_of_asymmetric_friction_by_hand():
    """At rest friction is alpha sin t - x, between -.5 (what resists x' < 0) and 1: x in [-(1 - .7), .5 - .7]."""
    system = bf.systems.dry_friction_oscillator(amplitude=0.7, friction_negative=0.5)
    assert bf.find_orbit(system, method=HarmonicBalance(3)).how["interval"][0] == pytest.approx([-0.3, -0.2], abs=1e-12)


def test_two_bodies_with_two_contacts():
    """A hand-made system against a long exact simulation."""
    load = [elements.HarmonicForce(1.5, phase=-0.5 * np.pi, dof=1)]
    contacts = [elements.Coulomb(0.3, dof=0), elements.Coulomb(0.4, row=(-1.0, 1.0))]
    damping, stiffness = [[0.3, -0.15], [-0.15, 0.15]], [[3.0, -1.0], [-1.0, 1.0]]
    system = System(np.eye(2), damping, stiffness, [*load, *contacts], omega=1.1)
    orbit = bf.find_orbit(system, method=HarmonicBalance(30))
    assert orbit.success and set(orbit.how["reversals"]) == {"coulomb", "coulomb_2"}
    motion = bf.simulate(system, orbit.state, periods=40)
    period = 2.0 * np.pi / 1.1
    t = 39.0 * period + np.arange(256) * period / 256.0
    exact = motion(t)[:, :2]
    assert np.abs(motion(t - period)[:, :2] - exact).max() <= 1e-8  # settled
    phase = np.exp(-1j * 1.1 * t)
    for dof in (0, 1):
        first = 2.0 * np.mean(exact[:, dof] * phase)
        assert abs(orbit.harmonic(1, dof) - first) <= orbit.how["error of the first harmonic"][dof] + 1e-6
        assert abs(orbit.harmonic(1, dof) - first) <= 0.02 * abs(first)


def test_friction_beside_a_cubic_spring():
    """Laws and set-valued contacts in one balance: the residual is zero and simulation agrees."""
    parts = [elements.HarmonicForce(1.6, phase=-0.5 * np.pi), elements.CubicSpring(0.2), elements.Coulomb(0.6)]
    system = System(1.0, 0.3, 1.0, parts, omega=0.9)
    orbit = bf.find_orbit(system, method=HarmonicBalance(30))
    assert orbit.success and orbit.residual <= 1e-10
    motion = bf.simulate(system, orbit.state, periods=30)
    _, y = orbit.sample(257)
    period = 2.0 * np.pi / 0.9
    exact = motion(29.0 * period + np.linspace(0.0, period, 257))
    assert np.abs(exact[:, 0] - y[:, 0]).max() <= min(0.02, orbit.how["error"][0])


def test_what_is_refused_and_why():
    """Friction larger at rest than in motion; the message names the element and the way out."""
    for contact in (elements.Coulomb(1.0, static_ratio=1.5), elements.Stribeck()):
        system = System(1.0, 0.2, 1.0, [elements.HarmonicForce(2.0), contact], omega=1.0)
        with pytest.raises(ValueError, match="larger at rest than in motion.*without method="):
            bf.find_orbit(system, method=HarmonicBalance(5))
    with pytest.raises(ValueError, match="excites harmonic 1"):
        bf.find_orbit(bf.systems.dry_friction_oscillator(), method=HarmonicBalance((0, 3, 5)))


def test_saved_and_loaded(tmp_path):
    """The record keeps what the orbit says of itself."""
    orbit = bf.find_orbit(bf.systems.dry_friction_oscillator(), method=HarmonicBalance(10))
    orbit.save(tmp_path / "orbit.npz")
    again = bf.load(tmp_path / "orbit.npz")
    assert (again.coefficients == orbit.coefficients).all() and again.how == orbit.how and again.success


def test_neighbouring_orbit_as_guess():
    """Fewer steps than from nothing, the same answer."""
    method = HarmonicBalance(30)
    near = bf.find_orbit(bf.systems.dry_friction_oscillator(amplitude=1.41), method=method)
    system = bf.systems.dry_friction_oscillator(amplitude=1.4)
    warm, cold = bf.find_orbit(system, guess=near, method=method), bf.find_orbit(system, method=method)
    assert warm.success and np.abs(warm.coefficients - cold.coefficients).max() <= 1e-9
    assert warm.how["evaluations"] < cold.how["evaluations"]


def chain(n, omega=0.7):
    """Masses in a row between walls, friction on the third from the end, load on the last."""
    stiffness = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    parts = [elements.HarmonicForce(1.0, phase=-0.5 * np.pi, dof=n - 1), elements.Coulomb(0.2, dof=n - 3)]
    return System(np.eye(n), 0.1 * np.eye(n) + 0.02 * stiffness, stiffness, parts, omega=omega)


def test_condensed_to_the_touched_coordinates():
    """Three masses, one contact: the condensed solution solves the whole balance."""
    from bifurc.hbm.setvalued.solution import solve
    from bifurc.hbm.setvalued.system_contacts import contacts_of, rest_of

    orbit = bf.find_orbit(chain(3), method=HarmonicBalance(15))
    assert orbit.success and orbit.how["condensed to coordinates"] == [0]
    whole = solve(orbit.layout, 0.7, rest_of(orbit.balance), contacts_of(orbit.balance))
    assert whole.success and np.abs(whole.x - orbit.coefficients).max() <= 1e-10
    assert all(np.isfinite(orbit.how["error"])) and len(orbit.how["error"]) == 3


def test_cost_does_not_grow_with_coordinates_that_friction_does_not_touch():
    """Sixty masses, forty harmonics: 4860 unknowns are 81."""
    orbit = bf.find_orbit(chain(60), method=HarmonicBalance(40))
    assert orbit.success and orbit.layout.size == 60 * 81
    assert orbit.status is BalanceStatus.CONVERGED and max(abs(orbit.harmonic(1, 57)), 0.0) > 0.05
    whole = orbit.balance.residual(orbit.coefficients).reshape(81, 60)  # all but friction
    assert np.abs(np.delete(whole, 57, axis=1)).max() <= 1e-10
