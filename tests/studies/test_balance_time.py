"""Harmonic balance of the slider: both ways give the same response, sampled gaps and stated errors as asked."""
import math

import pytest

from studies import balance_time
from studies.common import Setting

ONSETS = (1.0001000250095, 1.7318775764978)  # where the stuck amplitude is 1


@pytest.fixture(scope="module")
def made():
    """Return the small setting."""
    return balance_time.study(Setting.SMALL)


def test_responses_are_whole_and_alike(made):
    """Seven harmonics, exact and sampled: both onsets, the same largest point but for the step."""
    exact, sampled = made.responses
    for response, error in ((exact, 1e-10), (sampled, 1e-4)):
        assert all(math.isclose(a, b, abs_tol=error) for a, b in zip(response.onsets, ONSETS, strict=True))
        assert response.largest == pytest.approx(3.5366, rel=2e-3)


def test_gaps_of_sampling(made):
    """2e-4 and 2e-5 at 256 and 1024 samples."""
    limits = {256: 2e-4, 1024: 2e-5}
    assert all(abs(gap) <= limits[count] for _, count, gap in made.gaps)


def test_stated_errors_are_honest(made):
    """Between half of the true distance and five times it."""
    assert all(0.5 * away <= stated <= 5.0 * away for _, away, stated in made.errors)


def test_report_says_that_the_peer_was_not_run(made):
    """And has a line a response."""
    text = balance_time.report(made, None)
    assert "pyHarm: not run" in text and text.count("exact") >= 1
