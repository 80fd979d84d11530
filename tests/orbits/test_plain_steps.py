"""Which steps of a compiled run need a look: every reason alone stops it, and what is kept of a step is that of the step."""
import math

import numpy as np
import pytest

from bifurc.orbits.shooting import sequence as sq
from bifurc.orbits.shooting.equations import Data
from bifurc.solve import steprun as sr
from bifurc.solve.steplaw import next_length

FLIP, LISTED, PEAK = 0, 1, 2  # tests behind dp/ds


def step():
    """Return the arguments of `plain` for a step of length .1 straight along the parameter, and its row."""
    ds, scales = 0.1, np.array([2.0, 3.0])
    last, tangent = np.array([1.0, 1.0]), np.array([0.6, 0.8])
    predicted = last + ds * scales * tangent
    info = np.zeros(sq.INFO)
    info[sq.ITERATIONS], info[sq.DET_SIGN], info[sq.DET_LOG], info[sq.RESIDUAL] = 3, 1.0, 0.3, 1e-15
    info[sq.FLIP], info[sq.LISTED], info[sq.PEAK] = 0.5, 0.4, -0.3
    run = np.zeros(sr.RUN)
    run[sr.LENGTH], run[sr.MOST], run[sr.LOW], run[sr.HIGH], run[sr.ORIGIN] = ds, 1.0, 0.0, 9.0, math.nan
    run[sr.BEND], run[sr.BACK], run[sr.LOG_BEFORE], run[sr.SIGN_BEFORE], run[sr.LOG], run[sr.SIGN] = 0.0, 0.08, 0.3, 1.0, 0.3, 1.0
    tests = np.empty((sr.TESTS, 4))
    tests[sr.EARLIER] = tests[sr.LATEST] = 0.8, 0.5, -0.4, -0.3
    tests[sr.CLEARLY], tests[sr.SIZE], tests[sr.TOUCHED] = (1, 1, -1, -1), 1.0, (-1.0, -1.0, 1e-13, 1e-13)
    reads = np.array([sq.FLIP, sq.LISTED, sq.PEAK])
    row = np.zeros(2 * 2 + 4 + sr.TOLD)
    data = Data(np.empty(0, np.int64), np.empty((0, 0)), 0.0, 9.0, np.array([[0, -1, 0, 0, 0, -1]]), np.zeros(1), 1.0, np.ones(1),
                scales, np.ones(1))
    kick = np.zeros((1, 1), np.int64)
    return [kick, data, last, tangent.copy(), predicted.copy(), predicted, tangent, info, reads, run, tests, row]


_, DATA, LAST, OLD, U, PREDICTED, TANGENT, INFO, READS, RUN, TESTS, ROW = range(12)


def taken(a):
    """Take a step as `sequence.follow` does, where nothing in it needs a look; return whether."""
    values, info = a[ROW][4:8], a[INFO]
    length, angle, misfit = sq.plain(*a[:ROW], values)
    if length <= 0.0:
        return False
    sr.taken(a[U], a[TANGENT], values, (length, angle, misfit),
             (int(info[sq.ITERATIONS]), info[sq.RESIDUAL], info[sq.DET_SIGN], info[sq.DET_LOG]), a[RUN], a[TESTS], a[ROW])
    return True


def test_a_plain_step_is_taken_and_kept():
    a = step()
    assert taken(a)
    run, tests, row = a[RUN], a[TESTS], a[ROW]
    assert row[:2] == pytest.approx(a[U]) and row[2:4] == pytest.approx(a[TANGENT])
    assert row[4:8] == pytest.approx([0.8, 0.5, -0.4, -0.3])
    length, angle, misfit, after, iterations, residual, sign, log = row[8:]
    assert (length, misfit, iterations, residual, sign, log) == pytest.approx((0.1, 0.0, 3, 1e-15, 1.0, 0.3))
    assert angle == pytest.approx(0.0, abs=1e-7) and after == next_length.py_func(0.1, angle / length, 0.0, 3, 1.0)
    assert run[sr.LENGTH] == after and run[sr.BACK] == pytest.approx(0.1)
    assert tests[sr.LATEST] == pytest.approx([0.8, 0.5, -0.4, -0.3])


def test_the_next_step_sees_what_this_one_found():
    a = step()
    a[INFO][[sq.FLIP, sq.DET_LOG]] = 0.7, 0.2
    assert taken(a)
    run, tests = a[RUN], a[TESTS]
    assert (tests[sr.EARLIER, 1 + FLIP], tests[sr.LATEST, 1 + FLIP]) == (0.5, 0.7)
    assert tests[sr.SIZE, 1 + FLIP] == 1.0
    assert (run[sr.LOG_BEFORE], run[sr.LOG], run[sr.SIGN_BEFORE], run[sr.SIGN]) == (0.3, 0.2, 1.0, 1.0)
    a[INFO][sq.FLIP] = 1.5
    a[LAST][:] = a[U]
    a[PREDICTED][:] = a[U][:] = a[LAST] + run[sr.LENGTH] * a[DATA].scales * a[TANGENT]
    assert taken(a)
    assert tests[sr.EARLIER, 1 + FLIP] == 0.7 and tests[sr.SIZE, 1 + FLIP] == 1.5


def disturbed(what):
    """Return a step with one thing wrong."""
    a = step()
    info, run, tests = a[INFO], a[RUN], a[TESTS]
    if what == "iterations":
        info[sq.ITERATIONS] = 7
    elif what == "low":
        run[sr.LOW] = a[U][1] + 1e-9
    elif what == "high":
        run[sr.HIGH] = a[U][1] - 1e-9
    elif what == "on the bound":
        run[sr.HIGH] = a[U][1]
    elif what == "sign of the determinant":
        info[sq.DET_SIGN] = -1.0
    elif what == "nearly singular":
        info[sq.DET_LOG] = 0.3 - 16.1
    elif what == "turns":
        a[TANGENT][:] = math.cos(math.atan2(0.8, 0.6) + 0.4), math.sin(math.atan2(0.8, 0.6) + 0.4)
    elif what == "leads aside":
        a[U][:] += 0.02 * a[DATA].scales * np.array([-0.8, 0.6])
    elif what == "start of a closed branch":
        run[sr.ORIGIN], run[sr.TURN] = 1.2, 9.0
    elif what == "not known":
        info[sq.FLIP] = math.nan
    elif what == "flip":
        info[sq.FLIP] = -0.01
    elif what == "graze":
        info[sq.PEAK] = 1e-12
    elif what == "slow impact":
        info[sq.LISTED] = -1e-12
    elif what == "two zeros of a test":
        tests[sr.EARLIER, 1 + FLIP], tests[sr.LATEST, 1 + FLIP], info[sq.FLIP] = 0.4, 0.05, 0.1
    elif what == "two folds":
        a[LAST][1] = a[U][1] - 1e-3  # dp/ds .8 at both ends, next to no way between: it turned twice
    elif what == "two changes of the determinant":
        run[sr.LOG_BEFORE], run[sr.LOG], info[sq.DET_LOG] = 0.3, 0.3 - 0.5, 0.3 - 0.3
    elif what == "the determinant heads for zero":
        run[sr.LOG_BEFORE], run[sr.LOG], info[sq.DET_LOG] = 0.3, 0.3 - 0.2, 0.3 - 1.2
    return a


@pytest.mark.parametrize("what", [
    "iterations", "low", "high", "on the bound", "sign of the determinant", "nearly singular", "turns", "leads aside",
    "start of a closed branch", "not known", "flip", "graze", "slow impact", "two zeros of a test", "two folds",
    "two changes of the determinant", "the determinant heads for zero"])
def test_every_reason_stops_the_run(what):
    a = disturbed(what)
    before = a[RUN].copy(), a[TESTS].copy()
    assert not taken(a)
    assert np.array_equal(a[RUN], before[0], equal_nan=True) and np.array_equal(a[TESTS], before[1])


@pytest.mark.parametrize("what", ["the determinant heads for zero", "some misfit"])
def test_where_a_jump_is_possible_the_middle_of_the_step_is_looked_at(what):
    a = disturbed(what)
    if what == "some misfit":
        a[U][:] += 0.005 * a[DATA].scales * np.array([-0.8, 0.6])
    length, angle, _ = sq.plain(*a[:ROW], a[ROW][4:8])
    assert length == pytest.approx(-math.hypot(0.1, 0.005 if what == "some misfit" else 0.0))
    assert angle == pytest.approx(0.0, abs=1e-7)


def test_a_value_within_rounding_of_zero_does_not_stop_it():
    a = step()
    a[INFO][sq.PEAK] = 0.5e-13
    assert taken(a)
    a = step()
    a[INFO][sq.FLIP] = -0.5e-12
    a[TESTS][sr.EARLIER, 1 + FLIP] = a[TESTS][sr.LATEST, 1 + FLIP] = 1e-3
    assert taken(a)
    assert a[TESTS][sr.CLEARLY, 1 + FLIP] == 1  # the old sign stays


@pytest.mark.parametrize(("node", "depth"), [(1, 0.02), (1, 0.2), (0, 0.02), (0, 0.2)])
def test_an_interval_that_lasts_no_time_inside_a_step_is_seen(node, depth):
    """Two events at times apart by d(t) = .1 - 4 (depth + .1) t (1 - t) of a step, or as far from the end of the period."""
    nodes = np.array([[0, 0, 0, 0, 0, -1], [0, 0, 0, 0, 0, -1]])
    kick, scales, length, span = np.zeros((1, 1), np.int64), np.array([0.5, 0.5, 3.0]), 0.3, 2.0
    rate = 4.0 * (depth + 0.1) / length
    at = span - 0.1 if node == 0 else 0.1
    x = np.array([0.0, at, 1.0])
    old, new = np.array([0.0, -rate / 0.5, 0.1]), np.array([0.0, rate / 0.5, 0.1])
    if node == 0:
        old, new = new, old
    assert sq.emptied(kick, nodes, span, x, old, x, new, scales, length) == pytest.approx(0.5, abs=1e-12)
    assert sq.emptied(kick, nodes, span, x, 0.1 * old, x, 0.1 * new, scales, length) == -1.0  # stays far from zero
    assert sq.emptied(np.ones((1, 1), np.int64), nodes, span, x, old, x, new, scales, length) == -1.0  # of impacts: their speed
