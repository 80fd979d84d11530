"""Stated errors of stick-slip balances against exact orbits: never too small, and not far too large."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import Coulomb, ElasticStop, Force, HarmonicForce, Jenkins
from bifurc.hbm.balance import Balance
from bifurc.hbm.errors import SAFETY, truncation
from bifurc.hbm.layout import Layout
from bifurc.solve.newton import newton

PHASES = np.linspace(0.0, 1.0, 400, endpoint=False)
# frequency, damping, friction and speed of the belt
ONE = ((0.5, 0.1, 0.4, 0.0), (0.8, 0.05, 0.7, 0.0), (1.7, 0.2, 0.3, 0.0), (0.7, 0.1, 0.3, 0.4), (1.4, 0.06, 0.5, 0.3),
       (0.3, 0.05, 0.5, 0.0))
# frequency, coupling, second mass, friction on it
TWO = ((0.75, 0.8, 1.2, 0.4), (1.6, 0.5, 0.7, 0.3))


def one(omega, damping, mu, speed):
    """Return a mass that rubs on a floor or a belt."""
    return bf.System(1.0, damping, 1.0, [HarmonicForce(1.0), Coulomb(mu, belt_speed=speed)], omega=omega)


def two(omega, k, m, mu):
    """Return two masses, the second rubs."""
    K = np.array([[1.0 + k, -k], [-k, 1.0 + k]])
    return bf.System(np.diag([1.0, m]), (0.1 * K).tolist(), K.tolist(), [HarmonicForce(1.0), Coulomb(mu, dof=1)], omega=omega)


def ratios(system, harmonics):
    """Return stated over true error (n,): the largest distance over a period from the event-exact orbit."""
    exact, found = bf.find_orbit(system), bf.find_orbit(system, method=bf.HarmonicBalance(harmonics=harmonics))
    assert exact.success and exact.periods == 1 and found.success
    values = found.layout.values(found._x, 2.0 * np.pi * PHASES)
    away = np.abs(values - exact._states(PHASES)[:, :system.n]).max(axis=0)
    return (np.asarray(found.how["error"]) / away)[away > 1e-9]


@pytest.mark.parametrize("harmonics", [7, 15, 31])
def test_the_stated_error_holds_and_is_of_the_right_size(harmonics):
    """At least the true one, at most thirty times, in the median three times."""
    found = np.concatenate([ratios(system, harmonics) for system in (*(one(*case) for case in ONE), *(two(*case) for case in TWO))])
    assert len(found) >= 7
    assert found.min() >= 1.0 and np.median(found) <= 3.0 and found.max() <= 30.0, found


def test_harmonics_are_added_until_the_error_is_below_the_tolerance_and_no_longer():
    """The truth is below the tolerance too; half the harmonics would not do."""
    system, tolerance = one(0.5, 0.1, 0.4, 0.0), 0.02
    found = bf.find_orbit(system, method=bf.HarmonicBalance(harmonics="auto", tolerance=tolerance))
    amplitude = np.abs(found.layout.matrix(found._x)).max()
    values = found.layout.values(found._x, 2.0 * np.pi * PHASES)[:, 0]
    away = np.abs(values - bf.find_orbit(system)._states(PHASES)[:, 0]).max()
    assert found.how["error"][0] <= tolerance * amplitude and away <= tolerance * amplitude
    tried = found.how["harmonics tried"]
    less = bf.find_orbit(system, method=bf.HarmonicBalance(harmonics=tried[-2]))
    assert less.how["error"][0] > tolerance * amplitude
    assert 8.0 * away > tolerance * amplitude / 2.0


def test_an_error_that_hides_in_a_held_contact_is_stated():
    """With few harmonics friction holds a contact that slips in truth: the larger balance shows the slip."""
    rng = np.random.default_rng([109, 2])
    omega, z, mu, k = (float(rng.uniform(*ends)) for ends in ((0.25, 2.5), (0.02, 0.25), (0.05, 0.75), (0.3, 1.5)))
    K = np.array([[1.0 + k, -k], [-k, 1.0 + k]])
    system = bf.System(np.diag([1.0, float(rng.uniform(0.5, 2.0))]), (z * K).tolist(), K.tolist(),
                       [HarmonicForce(1.0), Coulomb(mu, dof=1)], omega=omega)
    found = bf.find_orbit(system, method=bf.HarmonicBalance(harmonics=7))
    assert "held contacts" in found.how
    assert ratios(system, 7).min() >= 1.0


def kernel(u0, u1, s0, s1, a):
    """Return forces on two coordinates: none, and 1 + 2 (a cos + a^2 cos 2 + ...) of the angle whose cosine is the first."""
    return 0.0, (1.0 - a * a) / (1.0 - 2.0 * a * u0 + a * a)


@pytest.mark.parametrize("a", [0.4, 0.7])
def test_what_lies_beyond_the_doubled_set_is_stated_too(a):
    """A coordinate without inertia follows a force whose harmonics fall like powers and peak at once: 2 (a^5 + a^6 + ...) is
    missed by four."""
    top = 4
    system = bf.System(np.diag([1.0, 1e-12]), np.zeros((2, 2)), np.eye(2),
                       [HarmonicForce(0.64), Force(kernel, site=((1.0, 0.0), (0.0, 1.0)), a=a)], omega=0.6)
    balance = Balance(system, Layout(tuple(range(top + 1)), 2), 128)
    found = newton(balance.residual, balance.jacobian, balance.linear_response())
    missed = 2.0 * a**(top + 1) / (1.0 - a)
    np.testing.assert_allclose(truncation(balance, found.x), [0.0, SAFETY * missed], rtol=1e-6, atol=1e-12)


def chain(seed, kinds, harmonics, aft):
    """Return a random chain of up to three masses with contacts, and how it is balanced."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 4))
    k = rng.uniform(0.5, 2.0, n + 1)
    M, K = np.diag(rng.uniform(0.5, 2.0, n)), np.diag(k[:n] + k[1:]) - np.diag(k[1:n], 1) - np.diag(k[1:n], -1)
    rates = np.sqrt(np.linalg.eigvals(np.linalg.solve(M, K)).real)
    load, omega = rng.uniform(0.3, 2.0), float(rates[rng.integers(n)] * rng.uniform(0.3, 1.8))
    elements = [HarmonicForce(load, dof=int(rng.integers(n)))]
    for kind in kinds:
        dof = int(rng.integers(n))
        if kind == "slider":
            elements.append(Jenkins(rng.uniform(0.3, 5.0), load * rng.uniform(0.05, 0.6), dof=dof))
        else:
            elements.append(ElasticStop(rng.uniform(-0.2, 1.0), 10.0 ** rng.uniform(-0.5, 1.7), dof=dof))
    return bf.System(M, 0.03 * (M + K), K, elements, omega=omega), bf.HarmonicBalance(harmonics=harmonics, aft=aft)


@pytest.mark.parametrize("kinds", [("slider",), ("stop",), ("slider", "stop")])
@pytest.mark.parametrize("harmonics, aft", [(5, "exact"), (7, "exact"), (21, "sampled"), ("auto", "sampled")])
def test_stated_errors_of_random_chains_hold(kinds, harmonics, aft):
    """With few harmonics, and with contacts taken at samples, which miss their events by as much as harmonics that are left out."""
    for seed in range(12):
        system, method = chain(seed, kinds, harmonics, aft)
        found = bf.find_orbit(system, method=method)
        exact = bf.find_orbit(system, guess=found) if found.success else found
        if not exact.success or exact.periods != 1 or found.periods != 1:
            continue
        away = np.abs(found.sample(801)[1] - exact.sample(801)[1])[:, :system.n].max(axis=0)
        size = np.abs(exact.sample(801)[1][:, :system.n]).max()
        if away.max() < 0.1 * size:  # else it may be another motion
            assert np.all(away <= np.array(found.how["error"]) + 1e-9 * size), (seed, away, found.how["error"])
