"""Verdicts of random grazings against simulations, on the small setting."""
from studies import grazing_verdicts as study
from studies.common import Setting


def test_all_verdicts_are_right():
    rows = study.verdicts(Setting.SMALL)
    assert {row.kind for row in rows} == set(study.KINDS)
    assert all(row.right for row in rows)
    text = study.report(rows)
    assert "elastic" in text and "persistence" in text
