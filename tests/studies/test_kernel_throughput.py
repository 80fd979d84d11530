"""Accuracy of the period kernel against 34 digits, and its agreement with the general march."""
import json
import sys

import numpy as np
import pytest

from studies import kernel_throughput as study
from studies.common import Setting


@pytest.fixture(scope="module")
def result():
    """Return the result of the small setting."""
    return study.study(Setting.SMALL)


def test_accuracy(result):
    """One period: 1e-14 in the median, 1e-13 at most; ten periods, with grown differences: 1e-12."""
    assert np.median(result.errors[1]) <= 1e-14 and result.errors[1].max() <= 1e-13
    assert result.errors[10].max() <= 1e-12


def test_nothing_is_set_aside(result):
    """Both kernels carry every start through; rates are positive numbers."""
    assert set(result.aside.values()) == {0}
    assert all(rate > 0.0 for rates in result.rates.values() for rate in rates)


def test_kernels_agree():
    """The lean kernel and the general march give the same states, through impacts and sticking."""
    X = study.grid(24)
    T, packed, modes = study.prepared(X)
    one, two = X.copy(), X.copy()
    study.lean(*packed, modes, one, 2, 2000)
    study.general(T, modes, two, 2, 2000)
    assert np.abs(one - two).max() <= 1e-12


def test_peer_is_optional(result, tmp_path):
    """Without the peer the table says so; with one its rate is taken from the JSON it prints."""
    assert "not run" in study.report(result)
    script = tmp_path / "peer.py"
    script.write_text(f"print({json.dumps(json.dumps({'impact_f64': 12.5}))})", encoding="utf-8")
    assert study.limit_of(str(script), sys.executable) == 12.5
