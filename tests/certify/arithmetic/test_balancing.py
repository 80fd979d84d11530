"""Exponentials of matrices in mixed units, against the same in many more bits."""
import numpy as np
import pytest

flint = pytest.importorskip("flint")

from bifurc.certify.arithmetic.forms import Form, Reach, hull  # noqa: E402
from bifurc.certify.arithmetic.jets import Jet, balancing, driven  # noqa: E402


def matrices(seed):
    """Two random matrices with entries of size d_i / d_j, the units of the states, some of them zero."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 6))
    d = 10.0**rng.uniform(-6.0, 6.0, n)
    return [np.where(rng.random((n, n)) < share, rng.uniform(-1.0, 1.0, (n, n)), 0.0) * d[:, None] / d for share in (0.6, 0.4)], d


def exact(A, B, t):
    """exp(A + t B) and its derivative by t, with 400 bits."""
    n, arb = len(A), flint.arb
    Z = flint.arb_mat(2 * n, 2 * n)
    for i in range(n):
        for j in range(n):
            Z[i, j] = Z[n + i, n + j] = arb(A[i, j]) + arb(B[i, j]) * arb(t)
            Z[i, n + j] = arb(B[i, j])
    return Z.exp()


@pytest.mark.parametrize("seed", range(40))
def test_exponentials_hold_the_exact_ones(seed):
    (A, B), d = matrices(seed)
    n, h = len(A), 1e-3
    a, b = flint.arb_mat(A.tolist()), flint.arb_mat(B.tolist())
    kept = flint.ctx.prec
    try:
        flint.ctx.prec = 64
        jet, form = Jet(a, b).exp(), Jet(Form(Reach(h, 1), a, b), Form(Reach(h, 1), b)).exp()
        curve = Jet(Form(Reach(h, 2), a, b)).exp().parts[0].parts
        flint.ctx.prec = 400
        for t in (0.0, -h, 0.6 * h, h):
            whole = exact(A, B, t)
            for i in range(n):
                for j in range(n):
                    if t == 0.0:
                        assert jet.parts[0][i, j].overlaps(whole[i, j]) and jet.parts[1][i, j].overlaps(whole[i, n + j])
                    assert hull(form.parts[0])[i, j].overlaps(whole[i, j]) and hull(form.parts[1])[i, j].overlaps(whole[i, n + j])
                    along = curve[0][i, j] + curve[1][i, j] * flint.arb(t) + curve[2][i, j] * flint.arb(t)**2
                    assert along.overlaps(whole[i, j])
    finally:
        flint.ctx.prec = kept
    assert max(float(jet.parts[0][i, j].rad()) * d[j] / d[i] for i in range(n) for j in range(n)) < 1e-4


def test_an_oscillator_in_slow_time_is_balanced():
    """x' = 1e6 v, v' = -1e-6 x: 20 powers of two between position and velocity; a load has the unit in which it counts as much."""
    B = flint.arb_mat(4, 4, [0, 1e6, 0, 0, -1e-6, 0, 0, 1024.0, 0, 0, 0, 0, 0, 0, 0, 0])
    drives = driven([B])
    assert drives == [{0, 1}, {0, 1}, {2}, {0, 1, 3}]
    k = balancing(B, drives)
    assert k[0] - k[1] == 20 and k[3] - k[1] == -10
