"""Cost of a curve point on the small setting: every curve ends in the special point of a separate branch."""
from studies import curve_cost as study
from studies.common import Setting


def test_curves_end_in_points_of_separate_branches():
    rows = study.costs(Setting.SMALL)
    assert [row.case for row in rows] == list(study.CASES)
    assert all(row.distance < 1e-10 and row.points > 5 for row in rows), [(row.case.name, row.distance) for row in rows]
    assert "period doubling" in study.report(rows)
