"""Accuracy of the batch against 34 digits, agreement of all kernels, and what the peer's rates become."""
import dataclasses
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
    one, ten = result.errors["batch, 1 period"], result.errors["batch, 10 periods"]
    assert np.median(one) <= 1e-14 and one.max() <= 1e-13
    assert ten.max() <= 1e-12


def test_the_smooth_kernels_err_as_they_are_known_to(result):
    """100 classical steps leave 1.3e-5 in the median; the steps of order 8 were chosen for 1e-9 of the region."""
    four, eight = (found for name, found in result.errors.items() if "batch" not in name)
    assert 5e-6 <= np.median(four) <= 3e-5
    assert np.quantile(eight, 0.99) <= 3e-8


def test_nothing_is_set_aside(result):
    """Both kernels carry every start through; rates are positive numbers."""
    assert set(result.aside.values()) == {0}
    assert all(rate > 0.0 for rates in result.rates.values() for rate in rates)


def test_kernels_agree():
    """The scalar kernel and the general march give the same states, through impacts and sticking."""
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
    script.write_text(f"print({json.dumps(json.dumps({'impact_f64': 12.5, 'duffing_f64': 8}))})", encoding="utf-8")
    found = study.limit_of(str(script), sys.executable)
    assert found == {"impact_f64": 12.5, "duffing_f64": 8.0}
    measured = dataclasses.replace(result, limits={name: [value] for name, value in found.items()})
    assert measured.share("batch") == measured.rate("batch") / 12.5 and "C: impacts" in study.report(measured)
