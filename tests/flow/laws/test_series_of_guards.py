"""Polynomials of guards along a step, as the Python that is compiled: on motions whose accelerations are known polynomials."""
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.polynomial import polynomial as P
from scipy.linalg import expm

from bifurc.compose.tables import ORDER
from bifurc.flow.affine import engine as affine
from bifurc.flow.laws import collocation, guards
from bifurc.flow.laws.gauss import NODES, C
from tests.reference.plain import plain

H, W, HARMONICS = 0.2, 1.3, np.array([1, 3])
POINTS = np.concatenate(([0.0], H * C, [H]))
TIMES = np.linspace(0.0, H, 7)
N, NS = 2, 5  # two coordinates, their speeds, one memory


def tables(rng, rows=1):
    G = rng.normal(size=(1, 1, NS + 1 + 2 * HARMONICS.size))
    LG = rng.normal(size=(1, 1, rows))
    return SimpleNamespace(G=G, LG=LG, harmonics=HARMONICS, flat=np.array([W]), A=np.zeros((1, NS, G.shape[2])),
                           LP=np.zeros((1, rows, N)), LU=np.zeros((rows, 0)))


def state(rng, phase=0.7):
    return np.concatenate([rng.normal(size=NS), [1.0], *[(np.cos(k * phase), np.sin(k * phase)) for k in HARMONICS]])


def moved(x, acc, t):
    """Return the joined state a time after ``x`` under accelerations (polynomials) and the turning of the load."""
    out = x.copy()
    for i, a in enumerate(acc):
        out[N + i] = x[N + i] + P.polyval(t, P.polyint(a))
        out[i] = x[i] + x[N + i] * t + P.polyval(t, P.polyint(a, 2))
    if x.size > NS:
        for q, k in enumerate(HARMONICS):
            c, s = x[NS + 1 + 2 * q], x[NS + 2 + 2 * q]
            turn = k * W * t
            out[NS + 1 + 2 * q], out[NS + 2 + 2 * q] = c * np.cos(turn) - s * np.sin(turn), s * np.cos(turn) + c * np.sin(turn)
    return out


def sampled(acc):
    return np.array([P.polyval(POINTS, a) for a in acc])


@pytest.mark.parametrize("times", [0, 1, 2])
def test_values_at_the_points_of_a_step_are_integrated(times, rng):
    known = rng.normal(size=NODES + 2) / H ** np.arange(NODES + 2)
    a = rng.normal(size=ORDER + 1)
    want = a.copy()
    want[:NODES + 2 + times] += P.polyint(known, times) if times else known
    plain(guards.integrated)(P.polyval(POINTS, known), H, times, a)
    np.testing.assert_allclose(a * H ** np.arange(ORDER + 1), want * H ** np.arange(ORDER + 1), atol=1e-8)


def test_positions_and_speeds_at_the_points_of_a_step(rng):
    acc, x = rng.normal(size=(N, NODES)), state(rng)
    out = np.full(NS, np.nan)
    for j, t in enumerate(POINTS):
        for i in range(N):
            plain(guards.at)(x, sampled(acc)[i], i, N, H, j, out)
        np.testing.assert_allclose(out[:2 * N], moved(x, acc, t)[:2 * N], atol=1e-13)


def test_the_series_of_a_guard_is_its_value_along_the_motion(rng):
    """Positions, speeds, memory, the constant, two harmonics of the load, and what a law gives."""
    T, x, acc, force = tables(rng), state(rng), rng.normal(size=(N, NODES)), rng.normal(size=(1, NODES))
    a = np.full(ORDER + 1, np.nan)
    plain(guards.series)(T, 0, 0, x, N, H, sampled(acc), sampled(force), 1, a)
    want = [T.G[0, 0] @ moved(x, acc, t) + T.LG[0, 0, 0] * P.polyval(t, force[0]) for t in TIMES]
    np.testing.assert_allclose(P.polyval(TIMES, a), want, atol=1e-12)
    plain(guards.series)(T, 0, 0, x[:NS], N, H, sampled(acc), sampled(force), 0, a)  # a variation of the state
    np.testing.assert_allclose(P.polyval(TIMES, a), [T.G[0, 0, :NS] @ moved(x[:NS], acc, t) for t in TIMES], atol=1e-12)
    for column in (slice(0, N), slice(N, 2 * N)):  # of positions alone, of speeds alone
        T.G[:] = 0.0
        T.G[0, 0, column], T.LG[:] = 1.0, 0.0
        plain(guards.series)(T, 0, 0, x, N, H, sampled(acc), sampled(force), 1, a)
        np.testing.assert_allclose(P.polyval(TIMES, a), [moved(x, acc, t)[column].sum() for t in TIMES], atol=1e-13)


def test_what_a_law_adds_to_variations_is_its_gradient_along_the_motion(rng):
    """A guard with q0^2/2 + .3 v1 cos(k w t) beyond its affine part: two variations with accelerations of their own."""
    T, x, acc = tables(rng), state(rng), rng.normal(size=(N, NODES)) * 0.3
    X, accs = rng.normal(size=(2, NS)), rng.normal(size=(2, N, NODES)) * 0.3

    def gradient(now):
        row = T.G[0, 0].copy()
        row[0] += now[0]
        row[N + 1] += 0.3 * now[NS + 3]
        return row

    def asked(T, m, g, now, row):
        row[:] = gradient(now)
    before = rng.normal(size=(2, ORDER + 1))
    a = before.copy()
    plain(guards.moved_series, guard_and_gradient=asked)(T, 0, 0, x, X, H, sampled(acc), np.array([sampled(v) for v in accs]), a)
    for k in range(2):
        want = [(gradient(moved(x, acc, t)) - T.G[0, 0])[:NS] @ moved(X[k], accs[k], t) for t in TIMES]
        np.testing.assert_allclose(P.polyval(TIMES, a[k] - before[k]), want, atol=1e-9)


def test_the_series_of_a_state_is_its_motion(rng):
    T, x, acc = tables(rng), state(rng), rng.normal(size=(N, NODES))

    def fitted(T, m, x, limit, out, force, x1, X, accs, scratch):
        out[:] = sampled(acc)
        return H
    a = np.empty(ORDER + 1)
    for i in range(NS):
        plain(guards.state_series, fitted=fitted, scratch_of=lambda T, n: None)(T, 0, i, x, a)
        np.testing.assert_allclose(P.polyval(TIMES, a), [moved(x, acc, t)[i] for t in TIMES], atol=1e-13)


# guards over powers of the time, of a linear motion

A = np.array([[0.0, 0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0, 0.0], [-2.0, 0.5, -0.3, 0.1, 0.4], [0.7, -1.0, 0.0, -0.2, 0.0],
              [0.0] * 5])
B = np.zeros((NS, 1 + 2 * HARMONICS.size))
B[2, 1], B[3, 4], B[2, 0] = 0.8, -0.5, 0.2
WHOLE = np.zeros((NS + B.shape[1],) * 2)
WHOLE[:NS, :NS], WHOLE[:NS, NS:] = A, B
for _q, _k in enumerate(HARMONICS):
    WHOLE[NS + 1 + 2 * _q, NS + 2 + 2 * _q], WHOLE[NS + 2 + 2 * _q, NS + 1 + 2 * _q] = -_k * W, _k * W


@pytest.mark.parametrize("far", [False, True])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_a_guard_over_a_power_of_the_time_and_its_derivatives(order, far, rng):
    """Terms below the order vanish at the start; near it the quotient is a series, far from it a quotient.

    The derivative in the start time, by the motion of the load, is that of a start that is later, with the state as it is.
    """
    T, x, s = tables(rng), state(rng), 0.15
    T.LG[:] = 0.0
    T.stages, T.step = np.zeros(9, np.int64), np.array([1.0])
    T.G[0, 0, NS:] = 0.0
    g = T.G[0, 0]
    if order:
        g[NS] = -g[:NS] @ x[:NS]  # zero at the start
    if order == 2:
        g[N:2 * N] = 0.0
        g[NS] = -g[:NS] @ x[:NS]
        x[1] += 0.0
        x[N + 1] = -g[0] * x[N] / g[1]  # and so is its rate

    def fitted(T, m, x, limit, acc, force, x1, X, accs, scratch):
        for j, t in enumerate(POINTS):
            acc[:, j] = (WHOLE @ expm(WHOLE * t) @ x)[N:2 * N]
            for c in range(NS):
                accs[c, :, j] = (A @ expm(A * t) @ X[c])[N:2 * N]
        for c in range(NS):
            X[c] = expm(A * H) @ X[c]
        return H

    def integrate(T, m, x, s, x1, X):
        x1[:] = expm(WHOLE * s) @ x
        for c in range(NS):
            X[c] = expm(A * s) @ X[c]

    def field(T, m, x, f):
        f[:] = (WHOLE @ x)[:NS]

    def value_of(T, m, g_, x, row):
        row[:] = T.G[0, 0]
        return float(T.G[0, 0] @ x)
    row, given = np.full(x.size, np.nan), x.copy()
    divided = plain(guards.guard_divided, fitted=fitted, integrate=integrate, field=field, guard_and_gradient=value_of,
                    forcing_rate=affine.forcing_rate.py_func, longest_fit=lambda T, m: 0.01 if far else np.inf,
                    scratch_of=lambda T, n: None)
    value, slope = divided(T, 0, 0, x, s, order, row)
    assert np.array_equal(x, given)

    def exact(y, t):
        return float(g @ expm(WHOLE * t) @ y) / t**order
    assert value == pytest.approx(exact(x, s), rel=1e-9)
    assert slope == pytest.approx((exact(x, s + 1e-5) - exact(x, s - 1e-5)) / 2e-5, rel=1e-6)
    low = [g @ np.linalg.matrix_power(WHOLE, j) / max(1, j) for j in range(order)]  # terms that are left out near the start
    for c in range(NS):
        e = np.eye(x.size)[c]
        want = float(g @ expm(WHOLE * s) @ e) / s**order
        if not far:
            want -= sum(float(term @ e) * s**(j - order) for j, term in enumerate(low))
        assert row[c] == pytest.approx(want, rel=1e-8, abs=1e-8)
    dw = (WHOLE @ x)[NS:]
    later = float(row[NS:] @ dw)  # the load a little later, the state as it is
    shifted = x.copy()
    along = []
    for h in (1e-6, -1e-6):
        shifted[NS:] = (expm(WHOLE * h) @ x)[NS:]
        full = float(g @ expm(WHOLE * s) @ shifted)
        along.append((full - (0.0 if far else sum(float(term @ shifted) * s**j for j, term in enumerate(low)))) / s**order)
    assert later == pytest.approx((along[0] - along[1]) / 2e-6, rel=1e-5, abs=1e-6)


# landing

@pytest.mark.parametrize("unit", [1e-12, 1.0, 1e12])
@pytest.mark.parametrize("off", [3e-7, -3e-7])
def test_a_zero_on_a_polynomial_is_taken_to_that_of_the_law(off, unit):
    """x = .2 + 1.5 t, the guard is exp(x) - e, in any unit: zero at t = 8/15; a step of the tables is 1 long, what is far off is
    left."""
    T = SimpleNamespace(A=np.zeros((1, 2, 3)), LP=np.zeros((0, 0, 1)), step=np.array([1.0]))
    asked = []

    def propagate(T, m, x, s, out):
        out[:] = x
        out[0] = x[0] + 1.5 * s

    def gradient_sizes(T, m, g, x, f, scale, pull, size):
        asked.append(x[0])
        size[0] = unit * (np.exp(x[0]) + np.e)
        return unit * (np.exp(x[0]) - np.e), unit * np.exp(x[0]) * 1.5
    land = plain(guards.land, propagate=propagate, field=lambda T, m, x, f: None, gradient_sizes=gradient_sizes,
                 weighed=lambda T, m, g: g == 1)
    x, out, zero = np.array([0.2, 1.5, 1.0]), np.empty(3), 8.0 / 15.0
    assert land(T, 0, 1, x, zero + off, out) == pytest.approx(zero, abs=1e-15) and out[0] == pytest.approx(1.0, abs=1e-15)
    assert 1 < len(asked) < 4 and x[0] == 0.2  # at the rounding of its terms it stops
    assert land(T, 0, 0, x, zero + off, out) == zero + off and out[0] == pytest.approx(1.0 + 1.5 * off, abs=1e-15)  # affine
    assert land(T, 0, -1, x, zero + off, out) == zero + off
    assert land(T, 0, 1, x, zero + 1e-3, out) == zero + 1e-3  # too far for rounding of an interpolation


def test_accelerations_by_memory_are_those_of_all_of_it(rng):
    matrix, x = rng.normal(size=(1, 7, 9)), rng.normal(size=7)
    for i in range(2):
        want = matrix[0, 2 + i, 4:7] @ x[4:7]
        assert plain(collocation.remembered)(matrix, 0, i, 2, x) == pytest.approx(want)
