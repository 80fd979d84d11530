"""Condensation of a chain: the condensed solution solves the whole balance, and the table says how time grows."""
from studies import condensation
from studies.common import Setting


def test_rows_solve_the_whole_balance_and_the_report_has_the_ratio():
    """Small setting, 3 and 10 masses; no timings are asserted."""
    rows = condensation.study(Setting.SMALL)
    assert [row.masses for row in rows] == [3, 10]
    assert rows[0].agreement <= 1e-12
    assert rows[0].whole is not None and rows[1].whole is None
    assert "10 over 3 masses" in condensation.report(rows)
