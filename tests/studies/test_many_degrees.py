"""Beams with many degrees of freedom: the table that the study prints."""
from studies import many_degrees as study
from studies.common import Setting


def test_steps_of_tables_grow_and_events_are_found():
    found = study.rows(Setting.SMALL)
    assert [row.n for row in found[:3]] == [6, 12, 20]
    assert all(row.events > 10 for row in found)
    assert all(a.steps < b.steps for a, b in zip(found[:2], found[1:3], strict=True))
    text = study.report(found)
    assert "us an event" in text and text.count("grows with n") == 3
