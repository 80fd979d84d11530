"""Ends of stabilising gains against simulations of the delay equation, on the small setting."""
import pytest

from studies import feedback_ends as study
from studies.common import Setting


@pytest.mark.slow
def test_simulation_shows_the_same_ends():
    (row,) = study.study(Setting.SMALL)
    assert len(row["ends"]) == 2
    for gain, _, seen in row["ends"]:
        assert seen == pytest.approx(gain, rel=1e-3)
    assert row["starts"] == 8
    assert "impact oscillator" in study.report([row])
