"""Li's method as published: where it stops, where it does not, and what it may not call convergence."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.hbm.layout import Layout
from bifurc.hbm.setvalued.equations import Balance, Contact, Linear
from bifurc.hbm.setvalued.li2019 import Sampled, galerkin_broyden
from bifurc.hbm.status import BalanceStatus
from bifurc.orbits.balance.method import HarmonicBalance
from bifurc.solve.broyden import BroydenStatus
from studies.broyden_map import one_harmonic


def published(harmonics, samples, alpha):
    """Return the residual and the three starts."""
    layout = Layout(tuple(range(harmonics + 1)), 1)
    load = np.zeros(layout.size)
    load[layout.slot(1) + 1] = alpha
    linear = Linear.of(layout, 1.0, 1.0, 0.2, 1.0, load)
    balance = Balance(layout, 1.0, linear, [Contact(np.ones(1), np.ones(1, complex), -np.ones(1, complex))])
    return Sampled(balance, samples), {"zero": np.zeros(layout.size), "linear": np.linalg.solve(linear.blocks, load),
                                       "one": one_harmonic(balance)}


@pytest.mark.parametrize(("harmonics", "samples", "counts"),
                         [(20, 41, (17, 11, 12)), (40, 82, (16, 12, 13)), (40, 256, (41, 11, 17))])
def test_iteration_counts_where_it_works(harmonics, samples, counts):
    """alpha = 1.6 with the linear part as first Jacobian: the counts of specs/friction.md B, an independent program."""
    residual, starts = published(harmonics, samples, 1.6)
    for count, x0 in zip(counts, starts.values(), strict=True):
        found = galerkin_broyden(residual, x0)
        assert found.success and found.iterations == count
        assert found.residual <= 1e-10


def test_published_headline_case_fails():
    """alpha = 1.4 (stick-slip): no root exists, so nothing converges."""
    for harmonics, samples in ((20, 41), (40, 82), (40, 256)):
        residual, starts = published(harmonics, samples, 1.4)
        for x0 in starts.values():
            found = galerkin_broyden(residual, x0)
            assert not found.success and found.residual >= 1e-3


def test_false_convergence_is_named():
    """alpha = 1.4, H = 256, zero start, differences of 1e-8: a step below 1e-8 after 18 iterations, far from any solution."""
    residual, starts = published(40, 256, 1.4)
    found = galerkin_broyden(residual, starts["zero"], "differences", step=1e-8)
    assert found.status is BroydenStatus.FALSE_CONVERGENCE and found.iterations == 18
    assert found.residual == pytest.approx(2.0 * 0.58, rel=0.01)  # the published residual is half of this one
    assert "not" in found.status.sentence


def test_differences_as_first_jacobian_never_work():
    """A small step sees one sign pattern only."""
    for harmonics, samples in ((20, 41), (40, 82)):
        residual, starts = published(harmonics, samples, 1.6)
        assert not galerkin_broyden(residual, starts["linear"], "differences").success


def test_one_harmonic_start():
    """Load reduced by 4/pi of the limit: amplitude (alpha - 4/pi)/(2 xi) at resonance; zero below."""
    _, starts = published(5, 11, 1.6)
    assert np.hypot(*starts["one"][1:3]) == pytest.approx((1.6 - 4.0 / np.pi) / 0.2, rel=1e-14)
    _, starts = published(5, 11, 1.0)
    assert not starts["one"].any()


def test_through_find_orbit():
    """Samples default to 2 N + 2; the orbit says what happened, and its residual is the sampled one."""
    system = bf.systems.dry_friction_oscillator(amplitude=1.6)
    orbit = bf.find_orbit(system, method=HarmonicBalance(40, solver="galerkin-broyden"))
    assert orbit.success and orbit.how["samples"] == 82 and orbit.how["iterations"] in (12, 16)
    assert abs(orbit.harmonic(1)) == pytest.approx(abs(bf.find_orbit(system, method=HarmonicBalance(40)).harmonic(1)), rel=0.02)
    failed = bf.find_orbit(bf.systems.dry_friction_oscillator(), method=HarmonicBalance(40, solver="galerkin-broyden"))
    assert not failed.success and failed.status in (BalanceStatus.NOT_CONVERGED, BalanceStatus.FALSE_CONVERGENCE)
    with pytest.raises(ValueError, match="at least 81"):
        bf.find_orbit(system, method=HarmonicBalance(40, samples=80, solver="galerkin-broyden"))
