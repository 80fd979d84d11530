"""Random parameters and starts: the set-valued balance converges by itself, and its stated error holds."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.orbits.balance.method import HarmonicBalance
from tests.reference.fourier_friction import SteadyFriction


def drawn(rng, count):
    """Yield omega, xi and alpha/beta as the issue draws them."""
    for _ in range(count):
        yield rng.uniform(0.05, 3.0), rng.uniform(0.0, 0.2), 1.001 * (10.0 / 1.001) ** rng.uniform()


def sweep(cases, rng, harmonics=40):
    """Return (success, true error, stated error, status) of each case, started from random coefficients."""
    rows = []
    for omega, xi, ratio in cases:
        system = bf.systems.dry_friction_oscillator(zeta=xi, omega=omega, amplitude=ratio)
        size = 2 * harmonics + 1
        guess = rng.normal(size=size) * ratio / (1.0 + np.arange(size))
        orbit = bf.find_orbit(system, guess=guess, method=HarmonicBalance(harmonics))
        if not orbit.success:
            rows.append((False, np.nan, np.nan, orbit.message))
            continue
        exact = SteadyFriction(omega, xi, ratio, start=orbit.state)
        assert exact.closure < 1e-9, (omega, xi, ratio)
        stated = orbit.how["error of the first harmonic"]
        rows.append((True, abs(exact.integrals([1])[0] - orbit.harmonic(1)), np.inf if stated is None else stated[0],
                     (omega, xi, ratio)))
    return rows


def judged(rows):
    """Return the fraction that converged and the cases whose stated error is exceeded."""
    false = [row for row in rows if row[0] and row[1] > row[2]]
    return np.mean([row[0] for row in rows]), false


def test_random_cases(rng):
    """Four of them; a hundred are below."""
    rows = sweep(drawn(rng, 4), rng)
    converged, false = judged(rows)
    assert converged == 1.0
    assert not false


@pytest.mark.slow
def test_a_hundred_random_cases(rng):
    """At least 99 % converge without help, none states a smaller error of the first harmonic than it has."""
    rows = sweep(drawn(rng, 100), rng)
    converged, false = judged(rows)
    assert converged >= 0.99
    assert not false, false
    assert all(np.isfinite(row[2]) for row in rows)


@pytest.mark.parametrize("count", [2, pytest.param(8, marks=pytest.mark.slow)])
def test_just_above_the_limit(count, rng):
    """alpha - beta of 3e-4 to .05: held within few harmonics or barely moving, the stated error covers the true slip."""
    for _ in range(count):
        omega, xi, excess = rng.uniform(0.05, 3.0), rng.uniform(0.01, 0.2), 10.0 ** rng.uniform(-3.5, -1.3)
        system = bf.systems.dry_friction_oscillator(zeta=xi, omega=omega, amplitude=1.0 + excess)
        orbit = bf.find_orbit(system, method=HarmonicBalance(int(rng.choice([5, 10, 20]))))
        exact = SteadyFriction(omega, xi, 1.0 + excess, start=(-2.25 * excess**2 / (1.0 + excess) / omega**2, 0.0))
        assert orbit.success and exact.closure <= 1e-10
        assert 0.0 < abs(exact.integrals([1])[0] - orbit.harmonic(1)) <= orbit.how["error of the first harmonic"][0]
