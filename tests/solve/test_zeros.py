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


CURVES = {"cubic": lambda t: t**3 + 2.0 * t - 1.0, "steep": lambda t: math.tanh(300.0 * (t - 0.83)),
          "flat": lambda t: (t - 0.37)**5, "corner": lambda t: (t - 0.61) * (1.0 if t > 0.61 else 1e-3),
          "falls": lambda t: 0.1 - t * math.exp(t)}


def searched(f, low, high, guess=math.nan):
    """Return the box that enclosing a zero leaves, and the places asked."""
    box, places = [0.0] * zeros.BOX, []
    for t in roots.enclosing(box, low, f(low), high, f(high), guess):
        places.append(t)
        box[VALUE], box[PARAMETER] = f(t), 1.0 + t * t
    return box, places


@pytest.mark.parametrize("name", CURVES)
def test_what_is_told_of_the_best_place_is_what_was_answered_there(name):
    """And no place asked has a smaller value on its side of the zero; all lie inside."""
    f = CURVES[name]
    for guess in (math.nan, 0.02, 0.5, 0.999):
        box, places = searched(f, 0.0, 1.0, guess)
        assert box[zeros.LEAST] == f(box[AT]) and all(0.0 < t < 1.0 for t in places)
        if box[zeros.ASKED]:
            assert box[AT] in places and box[zeros.THERE] == 1.0 + box[AT]**2
        assert abs(box[zeros.LEAST]) == min(abs(f(t)) for t in (0.0, 1.0, *places))


@pytest.mark.parametrize("guess", [math.nan, 1e-7, 0.3, 1.0 - 1e-7])
@pytest.mark.parametrize("name", CURVES)
def test_the_search_from_the_other_end_is_the_mirror_image(name, guess):
    f = CURVES[name]
    _, places = searched(f, 0.0, 1.0, guess)
    _, mirrored = searched(lambda t: f(1.0 - t), 0.0, 1.0, 1.0 - guess)
    count = min(4, len(places))  # rounding decides in the end
    assert len(mirrored) >= count and places[:count] == pytest.approx([1.0 - t for t in mirrored[:count]], abs=1e-9)


@pytest.mark.parametrize("bend", [1.0, -20.0, 0.0])
def test_second_differences_of_the_parameter_are_those_of_its_parabola(bend):
    """Beside the zero of a straight test: at its places the parabola leaves what the best line cannot."""
    box, count = [0.0] * zeros.BOX, 0
    box[AT] = 0.0
    for t in roots.polishing(box):
        box[VALUE], box[PARAMETER], count = 3.0 * t, bend * t * t, count + 1
    places = np.array([-1.0, 0.0, 0.0, zeros.UNEVEN])
    left = np.abs(places**2 - np.polyval(np.polyfit(places, places**2, 1), places)).max()
    assert box[DONE] == box[zeros.SETTLED] == 1.0 and box[zeros.SLOPE] == pytest.approx(3.0) and count == 4
    assert box[zeros.P_CURVE] == pytest.approx(abs(bend) * left, rel=1e-10)
    assert box[zeros.P_NOISE] == pytest.approx(zeros.SAFETY * abs(bend) * left * zeros.PROBE**2, rel=1e-10)


@pytest.mark.parametrize("away", [3e-7, 1e-5, -1e-4])
def test_one_newton_step_is_enough_for_a_straight_test(away):
    """What it leads to is polished beside itself, with the finest probes."""
    box, places = [0.0] * zeros.BOX, []
    box[AT] = 0.25 + away
    for t in roots.polishing(box):
        places.append(t)
        box[VALUE], box[PARAMETER] = 2.0 * (t - 0.25), t
    assert box[DONE] == 1.0 and box[AT] == pytest.approx(0.25, abs=1e-15) and box[zeros.HIGH] - box[zeros.LOW] < 3.0 * zeros.PROBE
    assert len(places) == 1 + 2 + 1 + 2 + 1  # itself, beside it, the step, beside that, the zero
