"""Li's two cases, orders of the error, random parameters: what the study claims, on its small setting."""
import numpy as np
import pytest

from studies import dry_friction as study
from studies.common import Setting


@pytest.fixture(scope="module")
def cost():
    """Return errors by the number of harmonics, 5 .. 160."""
    return study.costs(Setting.SMALL)


def test_published_cases():
    """Every solver from both starts ends on the same orbit, at Galerkin's own floor."""
    rows = study.published(Setting.SMALL)
    assert len(rows) == 8
    for row in rows:
        assert row.status == "converged" and row.residual <= 1e-11
        assert row.error <= study.ASKED[row.alpha]


def test_orders(cost):
    """Slip only: first order. Stick-slip: 3/2 once the stick phase is resolved (from N = 20). Best: 3/2."""
    assert study.order(cost, 1.6) == pytest.approx(1.0, abs=0.1)
    assert study.order([row for row in cost if row.harmonics >= 20], 1.4) == pytest.approx(1.5, abs=0.2)
    for alpha in study.CASES:
        assert study.order(cost, alpha, "best") == pytest.approx(1.5, abs=0.1)


def test_floors(cost):
    """Errors of specs/friction.md C, columns "best possible" and "Galerkin", where they were converged."""
    found = {(row.alpha, row.harmonics): row for row in cost}
    for n, best, galerkin in ((5, (2.10e-2, 4.00e-2), (5.50e-2, 8.1e-2)), (10, (9.8e-3, 1.70e-2), (3.21e-2, 3.0e-2)),
                              (20, (3.48e-3, 6.3e-3), (1.57e-2, 2.01e-2)), (40, (1.23e-3, 2.2e-3), (7.74e-3, 6.8e-3))):
        for i, alpha in enumerate(study.CASES):
            assert found[alpha, n].best == pytest.approx(best[i], rel=0.01)
            assert found[alpha, n].error == pytest.approx(galerkin[i], rel=0.035)


def test_random_cases_and_report(cost):
    """All converge, none is further off than stated; the tables have their lines."""
    rows = study.drawn(Setting.SMALL)
    assert all(row.success and row.true <= row.stated for row in rows)
    assert np.isfinite([row.stated for row in rows]).all()
    text = study.report(study.published(Setting.SMALL), cost, rows)
    assert "10 of 10" in text and text.count("stick-slip") >= 5
