"""First zeros, maxima and samples of guards, as the Python that is compiled: against dense samples and rules written out."""
import numpy as np
import pytest
from scipy.optimize import brentq

from bifurc.hbm.contacts import event_driven, sampled
from bifurc.hbm.tables import ALGEBRAIC, GUARDS, MEMORY, PAIRS, SILENT, THEN, TRIAL, WRITES
from tests.reference.plain import plain

WAVES = np.array([0, 1, 1, 2, 2, 3, 3, 5, 5])
CELL = 2.0 * np.pi / 64.0  # finer than an eighth of the shortest wave


def guard(a, t):
    k = WAVES[1::2]
    return a[0] + np.cos(np.multiply.outer(t, k)) @ a[1::2] + np.sin(np.multiply.outer(t, k)) @ a[2::2]


def rate(a, t):
    k = WAVES[1::2]
    return np.cos(np.multiply.outer(t, k)) @ (k * a[2::2]) - np.sin(np.multiply.outer(t, k)) @ (k * a[1::2])


def zeros_of(f, a, low, high, count=4000):
    t = np.linspace(low, high, count)
    v = f(a, t)
    return [brentq(lambda s: float(f(a, s)), t[i], t[i + 1], xtol=1e-15) for i in np.flatnonzero(v[:-1] * v[1:] < 0.0)]


def first(a, t0, t1, fresh):
    return plain(event_driven.first_zero)(WAVES, a, t0, t1, float(guard(a, t0)), float(rate(a, t0)), float(guard(a, t1)),
                                          float(rate(a, t1)), fresh)


def test_the_first_zero_of_a_cell_is_that_of_dense_samples(rng):
    """Cells that begin below zero: with a crossing, with two of them about a maximum, with none."""
    kinds = {"crosses": 0, "twice": 0, "none": 0}
    for _ in range(40):
        a = rng.normal(size=WAVES.size)
        for t0 in rng.uniform(0.0, 6.0, 6):
            t1 = t0 + CELL
            top = max([float(guard(a, t)) for t in zeros_of(rate, a, t0, t1, 60)], default=-np.inf)
            if rng.random() < 0.5 and top > max(guard(a, t0), guard(a, t1)):
                a[0] -= top - 1e-3 * rng.random() * (top - max(guard(a, t0), guard(a, t1)))  # a maximum just above zero
            if guard(a, t0) >= 0.0:
                continue
            known = zeros_of(guard, a, t0, t1)
            found = first(a, t0, t1, False)
            assert found == pytest.approx(known[0], abs=1e-9) if known else found == np.inf
            kinds["none" if not known else "twice" if len(known) == 2 else "crosses"] += 1
    assert kinds["none"] > 30 and kinds["crosses"] > 5 and kinds["twice"] > 3, kinds


@pytest.mark.parametrize("place", [0.3, 0.9, 1e-4])
def test_behind_its_own_zero_a_guard_dips_and_comes_back_or_rises_at_once(place):
    """1 - cos(t - c) - const: zero at t0 with a falling rate, and again ``place`` of a cell later; turned round it rises."""
    t0 = 1.1
    middle = t0 + 0.5 * place * CELL
    a = np.zeros(WAVES.size)
    a[0], a[1], a[2] = np.cos(0.5 * place * CELL), -np.cos(middle), -np.sin(middle)
    assert guard(a, t0) == pytest.approx(0.0, abs=1e-15)
    found = first(a, t0, t0 + CELL, True)
    assert found == pytest.approx(t0 + place * CELL, abs=1e-9)
    assert first(-a, t0, t0 + place * CELL * 0.5, True) <= t0 + 1e-6  # it rises from its zero
    down = np.zeros(WAVES.size)
    down[0], down[1], down[2] = -1.0, np.cos(t0), np.sin(t0)
    assert first(down, t0, t0 + CELL, True) == np.inf  # a top of no height: it falls for good


def test_a_cubic_is_zero_about_where_it_is(rng):
    for _ in range(200):
        v0, v1, d0, d1 = -rng.uniform(0.05, 1.0), rng.uniform(0.0, 1.0), *rng.uniform(0.2, 3.0, 2)
        t = plain(event_driven.zero_of_cubic)(v0, d0, v1, d1)
        h = np.array([2.0 * t**3 - 3.0 * t**2 + 1.0, t**3 - 2.0 * t**2 + t, -2.0 * t**3 + 3.0 * t**2, t**3 - t**2])
        assert 0.0 <= t <= 1.0
        if d0 < 2.9 * (v1 - v0) and d1 < 2.9 * (v1 - v0):  # monotone: Newton stays on its way
            assert abs(h @ [v0, d0, v1, d1]) < 0.05


@pytest.mark.parametrize("nodes", [64, 96])
def test_the_crest_behind_a_zero_is_the_first_maximum(nodes, rng):
    grid = np.linspace(0.0, 2.0 * np.pi, nodes + 1)
    k = WAVES[1::2]
    cosines, sines, slopes = np.cos(np.multiply.outer(k, grid)), np.sin(np.multiply.outer(k, grid)), np.empty(nodes + 1)
    for _ in range(25):
        a = rng.normal(size=WAVES.size)
        plain(event_driven.slopes_on)(WAVES, a, cosines, sines, 3, 9, slopes)
        np.testing.assert_allclose(slopes[3:9], rate(a, grid[3:9]), atol=1e-12)
        start = rng.uniform(0.0, 2.0 * np.pi)
        while rate(a, start) <= 0.05:
            start = rng.uniform(0.0, 2.0 * np.pi)
        known = next(t for t in zeros_of(rate, a, start, start + 2.0 * np.pi))
        assert plain(event_driven.crest)(WAVES, a, start) == pytest.approx(known, abs=3e-9)
        assert plain(event_driven.crest_on)(WAVES, a, start, rate(a, grid)) == pytest.approx(known, abs=3e-9)
        high = plain(event_driven.overshoot)(WAVES, a, start, rate(a, grid))
        bound = abs(a[0]) + np.hypot(a[1::2], a[2::2]).sum()
        assert high == pytest.approx(float(guard(a, known)) / bound, abs=1e-9)


# contacts at samples

N, MODES, MOST, Z, NX, Q = 12, 3, 2, 2, 1, 1


def drawn(rng):
    """Return tables of a contact of three modes with two guards each, drawn at random."""
    A = np.full((MODES + 1, MOST + 1, THEN + 3), -1, np.int64)
    A[:, 0] = 0
    A[MODES, 0, [MEMORY, PAIRS]] = Z, Q
    for m in range(MODES):
        A[m, 0, GUARDS] = MOST
        A[m, 0, WRITES] = int(rng.random() < 0.6)
        A[m, 0, ALGEBRAIC:ALGEBRAIC + Z] = rng.integers(0, 2, Z) if A[m, 0, WRITES] else 0
        for g in range(MOST):
            A[m, 1 + g, SILENT] = 0
            if A[m, 0, WRITES] and rng.random() < 0.7:
                A[m, 1 + g, TRIAL] = (m + 1) % MODES
            A[m, 1 + g, THEN:] = [*rng.permutation(MODES)[:2], -1]
    X = rng.normal(size=(MODES, Q + MOST + Z, NX + 2 * Q + Z))
    values = rng.normal(size=(MODES, MOST, N + 1)) - 1.2
    algebraic = rng.normal(size=(MODES, Z, N + 1))
    return A, X, values, algebraic, 0.3 * rng.normal(size=Z)


def at_sample(X, values, m, g, z, j):
    return values[m, g, j] + X[m, Q + g, NX + 2 * Q:] @ z


def stays(A, X, values, m, g, z, j):
    """Whether a guard lets its mode go on at a sample: the mode tried instead is broken, and it is not above zero itself."""
    tried = A[m, 1 + g, TRIAL]
    broken = tried < 0 or any(at_sample(X, values, tried, h, z, j) > 0.0 for h in range(MOST))
    return broken and at_sample(X, values, m, g, z, j) <= 0.0


def test_a_mode_is_quiet_up_to_the_first_sample_at_which_it_may_be_left(rng):
    seen = set()
    quiet, next_of = plain(sampled.quiet), plain(sampled.next_of)
    for _ in range(150):
        A, X, values, algebraic, z = drawn(rng)
        for m in range(MODES):
            for start in (0, 5):
                def memory(j, m=m, algebraic=algebraic, z=z, A=A):
                    before = j - 1 if j else N - 1
                    return np.where(A[m, 0, ALGEBRAIC:ALGEBRAIC + Z] > 0, algebraic[m, :, before], z)
                want = next((j for j in range(start, N)
                             if not all(stays(A, X, values, m, g, memory(j), j) for g in range(MOST))), N)
                found = quiet(values, algebraic, X, A, NX, m, z, start)
                assert found == want
                seen.add(found)
                for j in range(start, found):
                    assert next_of(values, X, A, NX, m, memory(j), j)[0] == -1
    assert len(seen) > 6


def test_what_follows_a_mode_is_the_first_candidate_that_is_not_broken(rng):
    """A mode tried first counts as soon as it holds; else the list of its own broken guard is asked, trials set aside."""
    next_of, counted = plain(sampled.next_of), set()
    for _ in range(300):
        A, X, values, _, z = drawn(rng)
        values += 1.0
        m, j = int(rng.integers(MODES)), int(rng.integers(N))
        want = (-1, m)
        for g in range(MOST):
            b, h = m, g
            if A[m, 1 + g, TRIAL] >= 0:
                b = A[m, 1 + g, TRIAL]
                above = [q for q in range(MOST) if at_sample(X, values, b, q, z, j) > 0.0]
                if not above:
                    want = (g, b)
                    break
                h = above[0]
            if at_sample(X, values, m, g, z, j) <= 0.0:
                continue
            chosen = -1
            for d in A[b, 1 + h, THEN:]:
                if d == m:
                    break
                if d >= 0 and not any(at_sample(X, values, d, q, z, j) > 0.0 for q in range(MOST) if A[d, 1 + q, TRIAL] < 0):
                    chosen = int(d)
                    break
            if chosen >= 0:
                want = (g, chosen)
                break
        found = next_of(values, X, A, NX, m, z, j)
        assert tuple(int(v) for v in found) == want
        counted.add(want[0] >= 0)
    assert counted == {True, False}


def test_how_high_a_guard_rises_and_where_it_nearly_touches(rng):
    """Over the samples of a period: a hill that begins at sample 9 and is highest at sample 1 of the next."""
    A, X, values, _, _ = drawn(rng)
    z = np.array([0.5, -1.0])
    X[0, Q, NX + 2 * Q:] = 0.2, 0.1  # nothing in all, .2 in size
    values[0, 0, :N] = [-0.3, -0.1, -0.4, -0.9, -1.0, -1.2, -1.5, -1.4, -1.3, -1.0, -0.8, -0.5]
    values[0, 0, N] = values[0, 0, 0]
    assert plain(sampled.spread)(values, X, A, NX, 0, 0, z) == pytest.approx(1.5 + 0.2)
    for j, top in ((9, -0.1), (0, -0.1), (1, -0.1), (3, -0.9), (6, -0.1)):
        assert plain(sampled.rise)(values, X, A, NX, 0, 0, z, j) == pytest.approx(top / 1.7)
    assert plain(sampled.round_at)(values, X, A, NX, 0, 0, z, 13) == pytest.approx(-0.1)
    A[0, 1 + 1, SILENT] = 1
    asked = []

    def missed(height, touch, writes, source):
        asked.append(height)
        return touch > abs(height)
    near = plain(sampled.near, missed=missed, writer=lambda A, m, g: -1)
    for j in range(N):
        assert near(values, X, A, NX, 0, z, j, 0.1, None) == (0 if j == 1 else -1)
    assert asked == [pytest.approx(-0.1 / 1.7)] and near(values, X, A, NX, 0, z, 1, 0.05, None) == -1
