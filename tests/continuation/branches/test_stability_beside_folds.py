"""Which change of stability is that of a fold, and how far back rows beside a boundary are not resolved, on rows written out."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.continuation.branches.stability_changes import STAYS, of_a_fold
from bifurc.continuation.steps.detect import BLURRED, EQUAL, RESOLVED, SHORT, blurred


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("unit", [1.0, 1e-6])
def test_the_nearest_change_is_that_of_the_fold(unit, mirrored):
    """Rows 2 to 7 stay near +1; a multiplier passes it between 2 and 3 and between 6 and 7."""
    values = np.array([0.9, 0.5, 0.1, 0.05, 0.1, 0.15, 0.1, 0.05, 0.6, 0.9])
    s, changes, last = np.arange(10.0), [(2, 3), (6, 7)], 9.0
    if mirrored:
        values, changes, last = values[::-1], [(2, 3), (6, 7)], 9.0

    def of(places):
        known = np.array([last - place if mirrored else place for place in places], float) * unit
        found = [of_a_fold(values, s * unit, changes, change, known) for change in changes]
        return found[::-1] if mirrored else found

    assert of([]) == [False, False]
    assert of([3.0]) == [True, False] and of([6.0]) == [False, True]
    assert of([4.4]) == [True, False] and of([4.6]) == [False, True] and of([3.0, 5.5]) == [True, True]
    assert of([2.0]) == [True, False] and of([1.9]) == [False, False] and of([7.0]) == [False, True] and of([7.1]) == [False, False]
    assert of([0.5]) == of([8.5]) == [False, False]


def test_a_stay_ends_where_the_multiplier_is_as_far_as_that():
    values, s = np.array([0.0, STAYS, 0.1, 0.1, 0.9 * STAYS]), np.arange(5.0)
    assert not of_a_fold(values, s, [(2, 3)], (2, 3), np.array([1.0]))
    assert of_a_fold(values, s, [(2, 3)], (2, 3), np.array([4.0]))


def rows_at(lengths, blurs, p=None, scale=1.0):
    part = SimpleNamespace(scale=np.array([1.0, scale]), problem=SimpleNamespace(blur=lambda row: row.own))
    p = np.zeros(len(lengths)) if p is None else p
    return [SimpleNamespace(s=5.0 - length, p=float(value), own=blur, part=part)
            for length, blur, value in zip(lengths, blurs, p, strict=True)]


def test_rows_are_blurred_as_far_as_rounding_moves_them():
    wide = [0.1, 1e-3, 1e-4, 1e-5, 0.0]
    far = [1.0, 2.0, 3.0, 4.0, 5.0]
    assert blurred(rows_at(wide, [0.0, 0.0, 0.0, 0.0, 0.0], far)) == 0.0
    assert blurred(rows_at(wide, [0.0, 0.0, 0.0, 0.0, 1e-6], far)) == 1e-6
    assert blurred(rows_at(wide, [0.0, 0.0, 0.0, 0.0, 1.0], far)) == RESOLVED[-1]
    assert blurred(rows_at(wide, [0.0, 0.0, 0.0, 2.0 * BLURRED * 1e-5, 0.0], far)) == pytest.approx(1e-5, rel=1e-9)
    assert blurred(rows_at(wide, [0.0, 0.0, 0.0, 0.5 * BLURRED * 1e-5, 0.0], far)) == 0.0
    assert blurred(rows_at(wide, [0.0, 1.0, 0.0, 1.0, 0.0], far)) == pytest.approx(1e-5, rel=1e-9)  # a resolved one ends it
    other = rows_at(wide, [0.0, 0.0, 1.0, 1.0, 0.0], far)
    other[2].part = SimpleNamespace(problem=other[2].part.problem)
    assert blurred(other) == pytest.approx(1e-5, rel=1e-9)


@pytest.mark.parametrize("scale", [1.0, 1e-9, 1e9])
def test_rows_of_one_value_next_to_a_boundary_are_not_told_apart(scale):
    near, noise = [4.0 * SHORT, 0.5 * SHORT, 0.2 * SHORT, 0.0], 0.5 * EQUAL * scale
    assert blurred(rows_at(near, [0.0] * 4, [0.0, noise, -noise, 0.0], scale)) == pytest.approx(0.5 * SHORT, rel=1e-6)
    assert blurred(rows_at(near, [0.0] * 4, [0.0, 4.0 * noise, noise, 0.0], scale)) == pytest.approx(0.2 * SHORT, rel=1e-6)
