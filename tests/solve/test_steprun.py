"""Where the next point of a branch is foretold, and the blocks of the LU that runs of steps call."""
import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import brentq

from bifurc.continuation.steps.rows import Curve
from bifurc.solve import steplaw, steprun
from bifurc.solve.dense import BLOCKED, lu, lu_solve
from bifurc.solve.steprun import aside, beside, between, foretold, remembered


def on_curve(s, scales):
    """Return a point of a clothoid-like curve in the plane, in its own units, and the unit tangent in scaled ones."""
    turn = 0.8 * s + 0.3 * s**2
    t, weights = np.polynomial.legendre.leggauss(40)
    angles = 0.8 * (t + 1.0) * s / 2.0 + 0.3 * ((t + 1.0) * s / 2.0)**2
    x = 0.5 * s * np.array([weights @ np.cos(angles), weights @ np.sin(angles)])
    return scales * x, np.array([np.cos(turn), np.sin(turn)])


def out_of_plane(s, scales, at, normal):
    return (on_curve(s, scales)[0] - at) / scales @ normal


@pytest.mark.parametrize(("ratio", "known", "order", "bound"), [
    (0.7, 2, 3.0, 2e-5), (1.0, 2, 3.0, 2e-5), (2.0, 2, 3.0, 1e-4), (0.7, 3, 5.0, 1e-7), (1.0, 3, 5.0, 1e-7), (2.0, 3, 5.0, 2e-6)])
def test_guess_lies_on_the_curve_to_its_order_and_in_the_plane(ratio, known, order, bound):
    """Two rows give the fourth order, three the sixth."""
    scales, errors = np.array([3.0, 0.2]), []
    for h in (0.1, 0.05):
        past, lengths = np.zeros((4, 2)), np.zeros(2)
        for s, length in ((0.5 - 2.2 * h, 0.0), (0.5 - h, 1.2 * h))[3 - known:]:
            remembered(past, lengths, *on_curve(s, scales), length)
        lengths[:] = h, 1.2 * h if known == 3 else 0.0
        last, old = on_curve(0.5, scales)
        predicted, guess = np.empty(2), np.empty(2)
        foretold(past, last, old, scales, lengths, ratio * h, predicted, guess)
        np.testing.assert_allclose(predicted, last + ratio * h * scales * old, rtol=1e-14)
        assert abs((guess - predicted) / scales @ old) <= 1e-14
        s = brentq(out_of_plane, 0.5, 1.5, (scales, predicted, old), xtol=1e-15)
        errors.append(np.linalg.norm((on_curve(s, scales)[0] - guess) / scales))
    assert errors[1] < bound and np.log2(errors[0] / errors[1]) > order


def test_of_one_row_the_end_of_its_tangent_is_foretold():
    scales = np.array([3.0, 0.2])
    last, old = on_curve(0.5, scales)
    predicted, guess = np.empty(2), np.empty(2)
    foretold(np.full((4, 2), 7.0), last, old, scales, np.zeros(2), 0.1, predicted, guess)
    np.testing.assert_allclose(predicted, last + 0.1 * scales * old, rtol=1e-15)
    np.testing.assert_array_equal(guess, predicted)


def test_rows_before_are_remembered_in_their_order():
    past, lengths = np.zeros((4, 2)), np.zeros(2)
    rows = [(np.array([k, 2.0]), np.array([0.6, -k])) for k in (1.0, 3.0, 7.0)]
    for (x, tangent), length in zip(rows, (0.1, 0.2, 0.3), strict=True):
        remembered(past, lengths, x, tangent, length)
    assert past.tolist() == [[7.0, 2.0], [0.6, -7.0], [3.0, 2.0], [0.6, -3.0]] and lengths.tolist() == [0.3, 0.2]


def test_places_on_a_cubic_are_those_of_the_curve_between_two_rows():
    """The same cubic in Python: `continuation.steps.rows.Curve`."""
    scales, length = np.array([3.0, 0.2]), 0.4
    (x, old), (y, new) = on_curve(0.3, scales), on_curve(0.7, scales)
    curve = Curve.__new__(Curve)
    curve.scale, curve.length, curve.xa, curve.chord = scales, length, x, y - x
    curve.da, curve.db = length * scales * old, length * scales * new
    middle, direction = np.empty(2), np.empty(2)
    between(x, old, y, new, scales, length, middle, direction)
    np.testing.assert_allclose(middle, curve.place(0.5), rtol=1e-14)
    np.testing.assert_allclose(direction, curve.tangent(0.5), rtol=1e-14)
    hermite, miss = np.array([curve.xa, curve.chord, curve.da, curve.db]), np.array([0.01, -0.02])
    place, guess, tangent = np.empty((3, 2))
    for t in (0.0, 0.3, 1.0):
        beside(hermite, t, miss, scales, place, guess, tangent)
        np.testing.assert_allclose(place, curve.place(t), rtol=1e-14)
        np.testing.assert_allclose(tangent, curve.tangent(t), rtol=1e-13)
        away = (guess - place) / scales
        assert abs(away @ tangent) <= 1e-15 and away == pytest.approx(miss - (miss @ tangent) * tangent, abs=1e-15)


def test_a_middle_far_from_the_solution_beside_it_is_a_jump():
    scales, middle = np.array([3.0, 0.2]), np.array([1.0, 1.0])
    off = np.array([0.0, 0.2])  # a scaled distance of 1
    assert not aside(middle, middle + 1.9e-4 * off, scales, 0.1, 0.0) and aside(middle, middle + 2.1e-4 * off, scales, 0.1, 0.0)
    assert not aside(middle, middle + 2.1e-4 * off, scales, 0.1, 0.01)  # where branches have corners
    assert aside(middle, np.full(2, np.nan), scales, 0.1, 0.0)


@pytest.mark.parametrize("n", [1, 5, BLOCKED - 1, BLOCKED, BLOCKED + 1, 37, 104])
def test_factors_solve_and_tell_the_determinant(n):
    rng = np.random.default_rng(n)
    A, b = rng.standard_normal((n, n)) * 10.0 ** rng.integers(-6, 6, (n, 1)), rng.standard_normal(n)
    factors, pivot, x = A.copy(), np.empty(n, np.int64), b.copy()
    sign, log = lu(factors, pivot)
    lu_solve(factors, pivot, x)
    assert np.abs((A @ x - b) / (np.abs(A) @ np.abs(x))).max() <= 1e-14
    true = np.linalg.slogdet(A)
    assert sign == true[0] and log == pytest.approx(true[1], abs=1e-9)


def chain(rng, blocks, size):
    """Return rows that know their own and the last block, a full column and a full row: of events one after the other."""
    whole = np.kron(np.eye(blocks) + np.roll(np.eye(blocks), -1, 1), np.ones((size, size)))
    A = np.ones((blocks * size + 1,) * 2)
    A[:-1, :-1] = whole
    return A * rng.standard_normal(A.shape) * 10.0 ** rng.integers(-3, 3, (len(A), 1))


@pytest.mark.parametrize("made", [lambda rng: rng.standard_normal((4, 4)), lambda rng: rng.standard_normal((40, 40)),
                                  lambda rng: chain(rng, 12, 3), lambda rng: chain(rng, 17, 5),
                                  lambda rng: chain(rng, 12, 4) * (rng.random((49, 49)) < 0.9)])
def test_blocks_give_the_same_numbers_as_one_column_at_a_time(made):
    """Elimination by the textbook, in Python: each entry of the factors is the same to the last bit, of full matrices by four
    columns and of those that are mostly zero."""
    A = made(np.random.default_rng(3))
    n = len(A)
    factors, pivot, own = A.copy(), np.empty(n, np.int64), A.copy()
    lu(factors, pivot)
    for k in range(n):
        own[[k, pivot[k]]] = own[[pivot[k], k]]
        own[k + 1:, k] /= own[k, k]
        for i in range(k + 1, n):
            own[i, k + 1:] -= own[i, k] * own[k, k + 1:]
    assert np.array_equal(factors, own)
    singular = A.copy()
    singular[n // 2] = singular[0]
    sign, log = lu(singular, pivot)
    assert sign == 0.0 or log < np.linalg.slogdet(A)[1] - 20.0


# what a step is looked at for: (u, p) along an arc that turns by TURN, three tests, of which the last is a boundary

SCALES, OLD, STEP, TURN = np.array([2.0, 0.5]), np.array([0.8, 0.6]), 0.1, 0.05
LAST = np.array([3.0, -1.0])
ASIDE = math.tan(0.5 * TURN)  # an arc leaves its tangent at half the turn


def step(turn=TURN, sideways=ASIDE, run=(), tests=(), values=(), **more):
    """Look at a step in which nothing lies, but for what is changed."""
    across = np.array([-OLD[1], OLD[0]])
    given = {"last": LAST, "old": OLD, "predicted": LAST + STEP * SCALES * OLD,
             "point": LAST + STEP * SCALES * (OLD + sideways * across),
             "tangent": math.cos(turn) * OLD + math.sin(turn) * across, "scales": SCALES, "iterations": 4, "sign": 1.0, "log": 0.3}
    state = np.zeros(steprun.RUN)
    table = np.zeros((steprun.TESTS, 3))
    for name, value in {"LENGTH": STEP, "MOST": 0.5, "LOW": -9.0, "HIGH": 9.0, "ORIGIN": np.nan, "TURN": 9.0, "BACK": STEP,
                        "SIGN_BEFORE": 1.0, "LOG": 0.2, "LOG_BEFORE": 0.1, "SIGN": 1.0, "BEND": 0.5, **dict(run)}.items():
        state[getattr(steprun, name)] = value
    for name, row in {"EARLIER": (0.6, 1.2, -0.8), "LATEST": (0.6, 1.1, -0.9), "CLEARLY": (1.0, 1.0, -1.0),
                      "SIZE": (0.6, 1.2, 0.9), "TOUCHED": (-1.0, -1.0, 1e-9), **dict(tests)}.items():
        table[getattr(steprun, name)] = row
    seen = np.array([0.6, 1.0, -1.0])
    for j, value in dict(values).items():
        seen[j] = value
    return steprun.looked_at.py_func(**(given | more), values=seen, run=state, tests=table)


def test_a_step_in_which_nothing_lies_has_the_length_of_its_arc():
    length, angle, misfit = step()
    assert angle == pytest.approx(TURN) and misfit == pytest.approx(0.0, abs=1e-12)
    chord = STEP / math.cos(0.5 * TURN)
    assert length == pytest.approx(chord * 0.5 * TURN / math.sin(0.5 * TURN), rel=1e-9)
    assert step(sideways=ASIDE + 0.005)[2] == pytest.approx(0.005)


@pytest.mark.parametrize("kept, looked", [
    ({"iterations": 6}, {"iterations": 7}),
    ({"run": {"HIGH": -0.96}}, {"run": {"HIGH": -0.98}}), ({"run": {"LOW": -0.98}}, {"run": {"LOW": -0.96}}),  # p is at -0.969
    ({}, {"sign": -1.0}), ({}, {"log": -20.0}),
    ({"turn": 0.34, "sideways": math.tan(0.17)}, {"turn": 0.36, "sideways": math.tan(0.18)}),
    ({"run": {"ORIGIN": -0.944}}, {"run": {"ORIGIN": -0.946}}), ({"run": {"ORIGIN": -1.056}}, {"run": {"ORIGIN": -1.054}}),
    ({"run": {"ORIGIN": -1.0, "TURN": 0.99}}, {"run": {"ORIGIN": -1.0, "TURN": 1.0}}),  # less leads away from there yet
    ({"values": {0: -1e-12}}, {"values": {0: -1e-10}}), ({"values": {1: -1e-12}}, {"values": {1: -2e-12}}),
    ({}, {"values": {1: np.nan}}), ({}, {"values": {2: np.inf}}),
    ({"values": {2: 0.8e-12}}, {"values": {2: 1e-11}}), ({"values": {2: -1.05}}, {"values": {2: 0.1}}),
    ({"tests": {"TOUCHED": (-1.0, -1.0, 0.0)}, "values": {2: -1e-14}},
     {"tests": {"TOUCHED": (-1.0, -1.0, 0.0)}, "values": {2: 1e-14}}),
    ({"tests": {"EARLIER": (0.6, 1.2, -0.8), "LATEST": (0.6, 0.7, -0.9)}}, {"tests": {"LATEST": (0.6, 0.05, -0.9)}}),  # a dip
    ({"tests": {"LATEST": (0.6, 1.1, -0.5)}}, {"tests": {"LATEST": (0.6, 1.1, -0.01)}}),
    ({"values": {0: 0.9}}, {"values": {0: 5.0}, "tests": {"LATEST": (5.0, 1.1, -0.9)}}),  # dp/ds is 5 at both ends, .6 between
    ({"run": {"LOG": 0.0, "LOG_BEFORE": 0.1}}, {"run": {"LOG": -1.4, "LOG_BEFORE": 0.1}}),  # the determinant dips
    ({"log": -0.3}, {"run": {"LOG": -1.0, "LOG_BEFORE": 0.1}, "log": -2.5})])
def test_what_lies_in_a_step_is_left_to_the_look_at_it(kept, looked):
    assert step(**kept)[0] > 0.0
    assert step(**looked) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("kept, looked", [
    ({"log": 0.6}, {"log": -0.7}), ({"sideways": ASIDE - 0.009}, {"sideways": ASIDE - 0.011}),
    ({"sideways": ASIDE + 0.03, "run": {"CORNER": 0.05}}, {"sideways": ASIDE + 0.03})])
def test_a_doubtful_step_is_taken_if_its_middle_lies_beside_it(kept, looked):
    """Its length is given below zero: whoever made the step corrects its middle."""
    assert step(**kept)[0] > 0.0
    length, angle, misfit = step(**looked)
    given = step(**{name: value for name, value in looked.items() if name != "log"} | {"run": {"CORNER": 0.05}})
    assert length < 0.0 and (-length, angle, misfit) == pytest.approx(given)


def test_a_step_that_is_taken_is_written_and_is_the_last_one_from_then_on():
    run, tests = np.arange(1.0, 1.0 + steprun.RUN), np.zeros((steprun.TESTS, 3))
    run[steprun.LENGTH], run[steprun.MOST], run[steprun.BEND], run[steprun.LOG], run[steprun.SIGN] = 0.1, 0.5, 0.4, 1.7, -1.0
    run[steprun.TURN] = 0.7
    tests[steprun.LATEST], tests[steprun.EARLIER], tests[steprun.CLEARLY] = (0.3, -2.0, 7.0), (9.0, 9.0, 9.0), (1.0, 1.0, 1.0)
    tests[steprun.SIZE] = 0.3, 2.0, 7.0
    point, tangent, values = np.array([1.0, 2.0]), np.array([0.6, -0.8]), np.array([-1e-12, -3.0, 1e-13])
    row = np.empty(2 * 2 + 3 + steprun.TOLD)
    steprun.taken.py_func(point, tangent, values, (0.2, 0.05, 0.001), (5, 1e-14, 1.0, 2.5), run, tests, row)
    new = steplaw.next_length(0.1, 0.25, 0.4, 5, 0.5)
    assert row.tolist() == [1.0, 2.0, 0.6, -0.8, -1e-12, -3.0, 1e-13, 0.2, 0.05, 0.001, new, 5, 1e-14, 1.0, 2.5]
    assert tests.tolist()[:4] == [[0.3, -2.0, 7.0], values.tolist(), [1.0, -1.0, 1.0], [0.3, 3.0, 7.0]]  # rounding sets no sign
    named = {name: run[getattr(steprun, name)] for name in ("LENGTH", "BEND", "BACK", "LOG_BEFORE", "SIGN_BEFORE", "LOG", "SIGN")}
    assert named == {"LENGTH": new, "BEND": pytest.approx(0.25), "BACK": 0.2, "LOG_BEFORE": 1.7, "SIGN_BEFORE": -1.0, "LOG": 2.5,
                     "SIGN": 1.0}
    assert run[steprun.TURN] == pytest.approx(0.75)


def test_what_a_run_begins_with_is_written_where_it_is_read():
    before = SimpleNamespace(s=1.5, det_log=0.3, det_sign=-1.0)
    part = SimpleNamespace(scale=np.array([3.0, 0.5]))
    row = SimpleNamespace(s=1.7, det_log=0.9, det_sign=1.0, turn=0.2, bend=0.05, part=part)
    run = steprun.run_of(before, row, 0.11, SimpleNamespace(ds_max=0.4, low=-2.0, high=3.0), 0.6, 0.7)
    room = 8.0 * np.finfo(float).eps * 2.7 * 0.5  # of the arclength, in the parameter: so near to a bound it lies on it
    places = {"LENGTH": 0.11, "MOST": 0.4, "LOW": -2.0 + room, "HIGH": 3.0 - room, "ORIGIN": 0.6, "TURN": 0.2, "CORNER": 0.7,
              "BEND": 0.05, "LOG_BEFORE": 0.3, "SIGN_BEFORE": -1.0, "LOG": 0.9, "SIGN": 1.0, "MADE": 0.0}
    assert len(run) == steprun.RUN == len(places) + 1
    assert {name: run[getattr(steprun, name)] for name in places} == places and run[steprun.BACK] == pytest.approx(0.2)


@pytest.mark.parametrize("value", [1e-9, 0.2, 1.0, 30.0])
def test_a_first_row_is_infinitely_far_behind_itself(value):
    """Three rows tell nothing there: no parabola has zeros, and the determinant heads for none."""
    row = SimpleNamespace(s=0.0, det_log=0.9, det_sign=1.0, turn=0.0, bend=0.0, part=SimpleNamespace(scale=np.array([3.0, 0.5])))
    run = steprun.run_of(row, row, 0.11, SimpleNamespace(ds_max=0.4, low=-2.0, high=3.0), np.nan, 0.0)
    back = run[steprun.BACK]
    assert back == np.inf and run[steprun.LOG_BEFORE] == run[steprun.LOG] and run[steprun.SIGN_BEFORE] == run[steprun.SIGN]
    assert steplaw.two_zeros.py_func(1.0, 1.0, value, back, 0.1) == steplaw.two_zeros.py_func(-1.0, -1.0, -value, back, 0.1) == 2.0
    seen = steplaw.doubtful.py_func(0.001, 0.0, 1.0, value, back, 0.1, True)
    assert seen == (steplaw.CLEAR if value > 0.5 else steplaw.UNCLEAR)  # it may be on its way there
