"""Numbers of multipliers beyond +1, beyond -1 and outside the unit circle are balanced with the special points between."""
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.kinds import SpecialPointKind
from bifurc.continuation.resimulation import counted, mismatch, unexplained
from bifurc.continuation.shooting.signature_change import admissible_side
from bifurc.continuation.shooting.successor import index

K = SpecialPointKind


def between(*points):
    """Return a branch with special points (kind, whether the parameter turns back) at s = .5."""
    return SimpleNamespace(special_points=[SimpleNamespace(kind=kind, reverses=turns, s=0.5) for kind, turns in points])


def test_counts():
    """Real ones by their side; none where one lies on the circle or is not finite."""
    assert counted(np.array([2.0, -3.0, 0.5, -0.2, 1.5 + 1j, 1.5 - 1j])) == (1, 1, 4)
    assert counted(np.array([0.3, 1.0 + 1e-9])) is None
    assert counted(np.array([-1e17, 40.0])) is None is counted(np.array([-1e17, 0.1]))  # what the other is, rounding decides
    assert counted(np.array([-1e10, 40.0])) == (1, 1, 2) and counted(np.array([-1e10, 0.1])) == (0, 1, 1)
    assert counted(np.array([np.inf, 0.1])) is None
    assert counted(None) is None


@pytest.mark.parametrize(("points", "before", "after", "word"), [
    ([], (0, 0, 0), (0, 0, 0), ""),
    ([], (0, 0, 0), (1, 0, 1), "beyond +1"),
    ([], (0, 0, 0), (0, 1, 1), "beyond -1"),
    ([(K.FOLD, True)], (0, 0, 0), (1, 0, 1), ""),
    ([(K.FOLD, True)], (0, 0, 0), (0, 1, 1), "beyond +1"),  # the sum alone would be explained
    ([(K.PERIOD_DOUBLING, False)], (0, 0, 0), (0, 1, 1), ""),
    ([(K.PERIOD_DOUBLING, False)], (1, 0, 1), (0, 0, 0), "beyond +1"),
    ([(K.PERIOD_DOUBLING, False), (K.FOLD, True)], (0, 0, 0), (1, 1, 2), ""),
    ([], (0, 0, 2), (2, 0, 2), ""),  # a pair reaches the real axis
    ([], (0, 0, 0), (0, 0, 2), "outside the unit circle"),
    ([(K.NEIMARK_SACKER, False)], (0, 0, 0), (0, 0, 2), ""),
])
def test_what_special_points_of_one_sequence_explain(points, before, after, word):
    """Each side of the real axis has kinds of its own."""
    text = mismatch(between(*points), (0.0, 0, (*before, None)), (1.0, 0, (*after, None)))
    assert (word in text) if word else text == ""


@pytest.mark.parametrize(("points", "before", "after", "good"), [
    ([(K.GRAZING, False)], (0, 0, 0), (0, 1, 1), True),  # multipliers jump
    ([(K.GRAZING, True)], (0, 0, 0), (1, 0, 1), True),
    ([(K.GRAZING, False)], (0, 0, 0), (1, 0, 1), False),
    ([(K.GRAZING, True)], (0, 0, 0), (0, 1, 1), False),
    ([(K.GRAZING, True), (K.FOLD, True)], (0, 0, 0), (0, 0, 0), True),
])
def test_index_through_a_change_of_the_sequence(points, before, after, good):
    """The parameter turns back where the number beyond +1 changes by an odd number, and only there."""
    assert (mismatch(between(*points), (0.0, 0, (*before, None)), (1.0, 1, (*after, None))) == "") is good


@pytest.fixture(scope="module")
def branch():
    """Return a branch with grazes, a fold and a flip."""
    return bf.trace(bf.find_orbit(bf.systems.impact_oscillator()), "omega", bounds=(0.4, 1.0))


def test_a_point_that_is_not_listed_is_missed(branch):
    """All is explained; without one of its points the branch says where something is missing."""
    assert unexplained(branch, branch._arrays) == ()
    kinds = {K.FOLD, K.PERIOD_DOUBLING} & {point.kind for point in branch.special_points}
    assert kinds
    for kind in kinds:
        gone = branch.special_points.of(kind)[0]
        fewer = bf.trace(branch.orbits[len(branch) // 2], "omega", bounds=(0.4, 1.0), max_steps=0)
        fewer.__dict__.update(branch.__dict__)
        fewer.__dict__["special_points"] = [point for point in branch.special_points if point is not gone]
        (low, high, text), *_ = unexplained(fewer, fewer._arrays)
        assert low <= gone.s <= high
        assert ("beyond +1" if kind is K.FOLD else "beyond -1") in text


def test_the_index_is_kept_through_every_graze(branch):
    """What Feigin's classification says of continuous maps, on orbits solved by different equations on the two sides."""
    changes = [point for point in branch.special_points if point.successor is not None]
    assert changes
    for point in changes:
        into, out = admissible_side(point.problem, point.x), admissible_side(point.successor, point.successor.x0)
        before, after = index(point.problem, point.x, -into, -1.0), index(point.successor, point.successor.x0, out, 1.0)
        assert before * after == 1.0
