"""Branches for every largest step: nothing missed, nothing invented, errors as asked."""
import pytest

from studies import branch_time
from studies.common import Setting


@pytest.fixture(scope="module")
def rows():
    """Return the rows of the small setting."""
    return branch_time.study(Setting.SMALL)


def test_all_special_points_at_every_step(rows):
    """Six on the bilinear branch, two on the Duffing branch."""
    assert {(row.problem, row.ds_max) for row in rows} == {(name, ds) for name in ("bilinear", "Duffing")
                                                           for ds in branch_time.STEPS[Setting.SMALL]}
    for row in rows:
        assert (row.missed, row.invented) == (0, 0), row
        assert row.audit, row


def test_errors(rows):
    """The bilinear points to 1e-11, the Duffing folds to 5e-9, all within their stated errors."""
    for row in rows:
        assert row.worst <= (1e-11 if row.problem == "bilinear" else 5e-9), row
        assert row.covered, row


def test_judgement_sees_what_is_missing_and_what_is_new():
    """A list of points against others: missed and invented are counted apart."""
    orbit, truth = branch_time.starts()["bilinear"]
    branch = branch_time.branch_of(orbit, 0.5)
    assert branch_time.judged(branch, truth)[:2] == (0, 0)
    assert branch_time.judged(branch, {**truth, "fold": (*truth["fold"], 2.0)})[:2] == (1, 0)
    assert branch_time.judged(branch, {**truth, "fold": truth["fold"][:1]})[:2] == (0, 1)


def test_report_says_that_the_peer_was_not_run(rows):
    """The table has a line a row, and AUTO's absence is said."""
    text = branch_time.report(rows, None)
    assert text.count("\n") >= len(rows) and "AUTO: not run" in text
