"""Peaks of the damped oscillator: the table that the study prints."""
from studies import friction_damper as study
from studies.common import Setting


def test_peaks_are_those_of_the_reference():
    found = study.peaks(Setting.SMALL)
    assert [p.damper for p in found] == ["macro", "micro"]
    for p, known in zip(found, study.KNOWN[100], strict=True):
        assert abs(p.amplitude / known - 1.0) < 1e-6
    assert found[0].slips == 4 and found[1].slips == 32
    assert "1.165604" in study.report(found)
