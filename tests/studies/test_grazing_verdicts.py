"""Verdicts of random grazings against simulations, on the small setting."""
from studies import grazing_verdicts as study
from studies.common import Setting


def test_all_verdicts_are_right():
    rows = study.verdicts(Setting.SMALL)
    assert {row.kind for row in rows} == set(study.KINDS)
    assert all(row.right is not False for row in rows)
    assert sum(row.right is True for row in rows) >= 0.6 * len(rows)
    text = study.report(rows)
    assert "elastic" in text and "persistence" in text
