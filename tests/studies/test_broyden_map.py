"""The failure map of the published method, and Newton against Broyden, on the small setting."""
import pytest

from studies import broyden_map as study
from studies.common import Setting


@pytest.fixture(scope="module")
def runs():
    """Return the runs of five pairs of harmonics and samples."""
    return study.failures(Setting.SMALL)


def test_failure_map(runs):
    """alpha = 1.6: with the linear part at (20, 41) and (40, 82) only; alpha = 1.4: nowhere."""
    good = {(row.harmonics, row.samples, row.start, row.first): row.iterations for row in runs if row.success and row.alpha == 1.6}
    assert good == {(n, h, start, "linear"): count for (n, h), counts in (((20, 41), (17, 11, 12)), ((40, 82), (16, 12, 13)))
                    for start, count in zip(study.STARTS, counts, strict=True)}
    assert study.converged(runs, 1.4, study.PAIRS) == (0, 30)


@pytest.mark.slow
def test_nine_of_eighty_four():
    """The grid of fourteen pairs."""
    found = {alpha: 0 for alpha in study.ALPHAS}
    for alpha in study.ALPHAS:
        for pair in study.PAIRS:
            residual, starts = study.problem(*pair, alpha)
            for x0 in starts.values():
                for first in study.FirstJacobian:
                    found[alpha] += study.galerkin_broyden(residual, x0, first).success
    assert found == {1.6: 9, 1.4: 0}


def test_newton_and_broyden_agree(runs):
    """All solve every frequency to the same peak; Broyden computes fewer Jacobians, Newton fewer residuals."""
    rows = study.traced(Setting.SMALL)
    assert all(row.failed == 0 for row in rows)
    assert max(row.amplitude for row in rows) - min(row.amplitude for row in rows) <= 1e-8
    newton, broyden = rows[0], rows[2]
    assert broyden.jacobians < newton.jacobians and newton.residuals < broyden.residuals
    assert "elastic slider, 20" in study.report(runs, rows)
