"""Searches for the zero of a test: compiled callers and Python go through the same places and end with the same numbers."""
import math

import numpy as np
import pytest

from bifurc._jit import both
from bifurc.continuation.steps import roots
from bifurc.solve import zeros
from bifurc.solve.zeros import AT, DONE, PARAMETER, VALUE, enclosing, polishing


@both
def compiled(box, asked, guess):
    """Enclose and polish the zero of ``t**3 + 2 t - 1`` in [0, 1]; the places go into ``asked``, their number is returned."""
    count = 0
    for t in enclosing(box, 0.0, -1.0, 1.0, 2.0, guess):
        asked[count], count = t, count + 1
        box[VALUE], box[PARAMETER] = t * t * t + 2.0 * t - 1.0, 1.0 + t * t
    for t in polishing(box):
        asked[count], count = t, count + 1
        box[VALUE], box[PARAMETER] = t * t * t + 2.0 * t - 1.0, 1.0 + t * t
    return count


@pytest.mark.parametrize("guess", (math.nan, 0.4, 7.0))
def test_compiled_callers_go_where_python_goes(guess):
    box, other, asked = np.zeros(zeros.BOX), [0.0] * zeros.BOX, np.zeros(90)
    count = compiled(box, asked, guess)
    places = []
    for search in (roots.enclosing(other, 0.0, -1.0, 1.0, 2.0, guess), roots.polishing(other)):
        for t in search:
            places.append(t)
            other[VALUE], other[PARAMETER] = t * t * t + 2.0 * t - 1.0, 1.0 + t * t
    assert places == pytest.approx(asked[:count], abs=1e-15)
    assert box[DONE] == other[DONE] == 1.0
    root = np.roots([1.0, 0.0, 2.0, -1.0])
    assert box[AT] == pytest.approx(float(root[np.abs(root.imag) < 1e-9].real[0]), abs=1e-15)
    assert box[AT] == places[-1]  # the last place is the zero


def test_a_test_that_is_zero_at_an_end_is_not_asked():
    box = [0.0] * zeros.BOX
    assert list(roots.enclosing(box, 0.0, 0.0, 1.0, 2.0, math.nan)) == []
    assert (box[AT], box[DONE], box[zeros.ASKED]) == (0.0, 1.0, 0.0)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("far, steps", [(0.5 * zeros.FLAT, True), (20.0 * zeros.FLAT, False)])
def test_a_zero_near_by_is_stepped_to_and_one_far_away_is_looked_for_with_a_wider_probe(side, far, steps):
    """Of a straight test beside its zero, on either side of it: Newton, or ten times the distance of the places asked."""
    box, start = [0.0] * zeros.BOX, 0.3 + side * far
    box[AT], asked = start, []
    for t in roots.polishing(box):
        asked.append(t)
        box[VALUE], box[PARAMETER] = 2.0 * (t - 0.3), t
        if len(asked) == 4:
            break
    assert asked[:3] == [start, start - zeros.PROBE, start + zeros.UNEVEN * zeros.PROBE]
    assert asked[3] == pytest.approx(0.3 if steps else start - 10.0 * zeros.PROBE, abs=0.1 * zeros.PROBE)
