"""What a piece of a period does under feedback of the values on it, against exponentials of matrices."""
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.linalg import expm

from bifurc.control.impact_order import _responses
from bifurc.control.linearization import NODES, gauss


@pytest.mark.parametrize("gain", [0.0, -0.4, 0.7])
@pytest.mark.parametrize("scale", [1.0, 1e-6, 1e6])
def test_a_piece_with_feedback_of_its_own_and_of_earlier_values(gain, scale, rng):
    """y' = (A + gain b c) y + b p with p = 1, t and a sine: values c y at the nodes and the end, ``b`` in any unit."""
    ns, span = 4, 0.3
    A, b, c = rng.normal(size=(ns, ns)), rng.normal(size=(ns, 1)) * scale, rng.normal(size=ns)
    piece = SimpleNamespace(A=np.repeat(A[None], NODES, axis=0), b=b, span=span)
    by_start, by_past, end, end_by_past = _responses(piece, c, gain / scale)
    t, _, _ = gauss()
    t = span * t
    F = A + gain / scale * np.outer(b[:, 0], c)
    wanted = np.array([c @ expm(F * at) for at in t])
    np.testing.assert_allclose(by_start, wanted, rtol=0, atol=1e-5)
    np.testing.assert_allclose(end, expm(F * span), rtol=0, atol=1e-7)
    joined = np.zeros((ns + 2, ns + 2))  # (y, p, 1) with p' = 1
    joined[:ns, :ns], joined[:ns, ns], joined[ns, ns + 1] = F, b[:, 0], 1.0
    start = np.append(np.zeros(ns + 1), 1.0)
    np.testing.assert_allclose(by_past @ t / scale, [c @ (expm(joined * at) @ start)[:ns] / scale for at in t], rtol=0, atol=1e-5)
    np.testing.assert_allclose(end_by_past @ t / scale, (expm(joined * span) @ start)[:ns] / scale, rtol=0, atol=1e-7)


def test_equations_that_change_along_a_piece():
    """y' = cos(t) y: exp(sin t), from values of the coefficient at the nodes of the piece in their order."""
    t, _, _ = gauss()
    span = 0.2
    piece = SimpleNamespace(A=np.cos(span * t)[:, None, None], b=np.ones((1, 1)), span=span)
    by_start, _, end, _ = _responses(piece, np.array([2.0]), 0.0)
    np.testing.assert_allclose(by_start[:, 0], 2.0 * np.exp(np.sin(span * t)), rtol=1e-6)
    assert end[0, 0] == pytest.approx(np.exp(np.sin(span)), rel=1e-9)
