"""Condensation of a chain: the condensed solution solves the whole balance, and the tables say how time grows."""
from studies import condensation
from studies.common import Setting


def test_rows_solve_the_whole_balance_and_the_report_has_the_ratio():
    """Small setting, 3 and 10 masses; no timings are asserted."""
    found = condensation.study(Setting.SMALL)
    rows, courses = found
    assert [row.masses for row in rows] == [3, 10]
    assert rows[0].agreement is not None and rows[0].agreement <= 1e-14
    assert "whole" in rows[0].seconds and "whole" not in rows[1].seconds
    assert [(c.masses, c.condensed) for c in courses] == [(3, True), (3, False)] * 2 + [(10, True)] * 2
    text = condensation.report(found)
    assert "10 over 3 masses" in text and "A branch in omega" in text
