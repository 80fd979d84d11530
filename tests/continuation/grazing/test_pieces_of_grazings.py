"""Numbers of a grazing from linear maps that are given: powers, births, leading multiplier, verdicts."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.continuation.grazing.classify import MOST, born, classified, leading_multiplier, powers
from bifurc.continuation.grazing.verdicts import GrazingVerdict
from bifurc.orbits.shooting.labels import Labels


def contraction(rng, n=3):
    E = rng.normal(size=(n, n))
    return 0.8 * E / np.abs(np.linalg.eigvals(E)).max(), rng.normal(size=n), rng.normal(size=n)


def test_impacts_in_powers_of_the_linear_map(rng):
    E, h, B = contraction(rng)
    s, sizes = powers(E, h, B)
    want = [h @ np.linalg.matrix_power(E, k) @ B for k in range(1, len(s) + 1)]
    norms = [np.linalg.norm(np.linalg.matrix_power(E, k), 2) for k in range(1, len(s) + 1)]
    np.testing.assert_allclose(s, want, atol=1e-12)
    np.testing.assert_allclose(sizes, np.linalg.norm(h) * np.linalg.norm(B) * np.array(norms), rtol=1e-9)
    assert norms[-1] < 1e-8 <= norms[-2]
    assert len(powers(E, h, B, 5)[0]) == 5 and len(powers(3.0 * E / 0.8, h, B)[0]) < MOST  # growing powers end at 1e8
    assert len(powers(np.zeros((2, 2)), np.ones(2), np.ones(2))[0]) == 1


def test_sides_of_birth_and_admissibility(rng):
    E, h, B = contraction(rng)
    births, good = born(E, h, B, 40)
    assert len(births) == len(good) == 24  # at most
    for n in range(1, 25):
        left = np.linalg.solve(np.eye(3) - np.linalg.matrix_power(E, n).T, h)
        passes = [left @ np.linalg.matrix_power(E, k) @ B for k in range(1, n + 1)]
        assert births[n - 1] == pytest.approx(passes[-1], rel=1e-9, abs=1e-12)
        assert good[n - 1] == all(p > passes[-1] for p in passes[:-1])
    assert good[0] and len(born(E, h, B, 0)[0]) == 1
    flip = np.diag([-1.0, 0.3])
    births, good = born(flip, np.ones(2), np.ones(2), 4)
    assert np.isfinite(births[[0, 2]]).all() and np.isnan(births[[1, 3]]).all() and not good[[1, 3]].any()


def test_the_leading_multiplier_is_the_largest_that_is_excited_and_seen():
    P = np.array([[1.0, 0.3, -0.2], [0.0, 1.0, 0.5], [0.4, 0.0, 1.0]])
    E = P @ np.diag([0.9, -0.5, 0.2]) @ np.linalg.inv(P)
    left, right = np.linalg.inv(P), P.T
    every = leading_multiplier(E, left.sum(axis=0), right.sum(axis=0))
    assert every[0] == pytest.approx(0.9) and every[1] == pytest.approx(1.0) and isinstance(every[0], float)
    assert leading_multiplier(E, left[1] + left[2], right.sum(axis=0))[0] == pytest.approx(-0.5)  # .9 is not seen
    assert leading_multiplier(E, left.sum(axis=0), 2.0 * right[2]) == (pytest.approx(0.2), pytest.approx(2.0))  # alone excited
    assert leading_multiplier(E, left[0], right[1]) == (0.0, 0.0)
    turn = 0.7 * np.array([[np.cos(1), -np.sin(1)], [np.sin(1), np.cos(1)]])
    value, _ = leading_multiplier(turn, np.ones(2), np.ones(2))
    assert isinstance(value, complex) and abs(value) == pytest.approx(0.7)


def touch(E, h, B, apex=-2.0, restitution=0.5, size=1.0):
    n = len(h)
    scene = SimpleNamespace()
    T = SimpleNamespace(GT=np.full((1, 1, n, 3), size / (2.0 * n)))
    sequence = SimpleNamespace(labels=lambda s: Labels.of(np.empty((0, n))))
    problem = SimpleNamespace(sequence=sequence, scene=scene, weights=np.ones(n))
    return SimpleNamespace(problem=problem, E=np.array(E, float), h=np.array(h, float), B=np.array(B, float), apex=apex,
                           restitution=restitution, tables=T, mode=0, guard=0, state=np.ones(n), time=0.0,
                           joined=lambda state, time: np.ones(n))


@pytest.mark.parametrize(("multipliers", "h", "verdict", "words"), [
    ((0.2, 0.1), (1.0, 1.0), "PERIOD_ADDING", "leading multiplier is 0.2"),
    ((0.2499999, 0.1), (1.0, 1.0), "PERIOD_ADDING", ""), ((0.25, 0.1), (1.0, 1.0), "WINDOWS_AND_CHAOS", "is 0.25"),
    ((0.66, 0.1), (1.0, 1.0), "WINDOWS_AND_CHAOS", ""), ((0.67, 0.1), (1.0, 1.0), "IMMEDIATE_CHAOS", "is 0.67"),
    ((-0.3, 0.1), (1.0, 1.0), "JUMP", "s_1 = -0.2 is the first below 0"),
    ((0.3, 0.6), (1.0, -0.2), "JUMP", "s_3 = -0.0162 is the first"),
    ((0.2, -0.4), (1.0, 0.5), "DEGENERATE", "s_1 = 0: a resonant grazing"),
    ((1.2, 0.1), (1.0, 1.0), "UNSTABLE", "has the modulus 1.2"), ((-1.2, 0.1), (1.0, 1.0), "UNSTABLE", "1.2"),
    ((1.0, 0.1), (1.0, 1.0), "DEGENERATE", "grazing meets a fold"), ((-1.0, 0.1), (1.0, 1.0), "DEGENERATE", "on the unit circle"),
    ((1.0 + 1e-6, 0.1), (1.0, 1.0), "UNSTABLE", ""),
])
def test_verdicts(multipliers, h, verdict, words):
    found = classified(touch(np.diag(multipliers), h, (1.0, 1.0)))
    assert found.verdict is GrazingVerdict[verdict] and words in found.sentence
    assert found.sentence.startswith(found.verdict.sentence)
    if verdict not in ("UNSTABLE", "DEGENERATE"):
        np.testing.assert_allclose(found.s[:2], [np.dot(h, np.array(multipliers)**k) for k in (1, 2)])
    assert found.hysteresis == (verdict == "JUMP" and bool(found.births[0] < 0.0))


def test_elastic_and_flat_touches():
    elastic = classified(touch(np.diag([0.2, 0.1]), (1.0, 1.0), (1.0, 1.0), restitution=None))
    assert elastic.verdict is GrazingVerdict.PERSISTENCE and len(elastic.births) == 1
    flat = classified(touch(np.diag([0.2, 0.1]), (1.0, 1.0), (1.0, 1.0), apex=-1e-8))
    assert flat.verdict is GrazingVerdict.DEGENERATE and "A_g = -1e-08 is zero: a flat touch" in flat.sentence
    small = classified(touch(np.diag([0.2, 0.1]), (1.0, 1.0), (1.0, 1.0), apex=-1e-8, size=1e-3))
    assert small.verdict is GrazingVerdict.PERIOD_ADDING
    odd = classified(touch(np.diag([0.2, np.nan]), (1.0, 1.0), (1.0, 1.0)))
    assert "another event at the same instant" in odd.sentence
    assert "does not begin as that of a spring" in classified(touch(np.diag([0.2, 0.1]), (1.0, 1.0), (1.0, np.inf))).sentence
    assert flat.expected(1e-6) is None
