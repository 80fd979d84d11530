"""Pieces of branches on plain numbers: tests of multipliers, lists of special points, parity, distances."""
import copy
import math
import pickle
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.branches.audit import Audit, parity_violations, told_slopes
from bifurc.continuation.branches.branch import Branch
from bifurc.continuation.branches.records import to_arrays
from bifurc.continuation.branches.special import Measures, SpecialPoint, SpecialPoints, special_point, unique
from bifurc.continuation.branches.stability_changes import circling, confirmed, enclosed, passing
from bifurc.continuation.kinds import LocationStatus, SpecialPointKind
from bifurc.continuation.monitors import value_of, with_monitors
from bifurc.continuation.peaks import with_peaks
from bifurc.continuation.switched import Switched
from bifurc.continuation.switching import leads_away
from bifurc.lazy import Later
from bifurc.solve.steplaw import BOUNDARY_BAND
from tests.continuation.problems import Free, Scalar, circle, pitchfork

K = SpecialPointKind


# tests of multipliers

@pytest.mark.parametrize("place", [1.0, -1.0])
def test_a_test_changes_its_sign_where_a_real_multiplier_passes(place):
    others = [0.3, 0.8 * np.exp(1j), 0.8 * np.exp(-1j)]

    def at(*moving):
        return passing(np.array([*moving, *others], complex), place)
    assert at(place - 1e-3) * at(place + 1e-3) < 0.0
    assert abs(at(place + 1e-3)) == pytest.approx(1e-3)
    assert at(place - 1e-3, place - 2e-3) * at(place - 1e-3, place + 2e-3) < 0.0
    assert at(place - 1e-3, place - 2e-3) * at(place + 1e-3, place + 2e-3) > 0.0  # both
    assert passing(np.array([0.5 + 0.5j, 0.5 - 0.5j]), place) == 1.0
    close = np.array([place + 0.1j, place - 0.1j, place + 0.5])  # a pair that is not real is near, but has no sign
    assert abs(passing(close, place)) == pytest.approx(0.1)


def test_a_test_changes_its_sign_where_a_pair_passes():
    def at(size, *others):
        return circling(np.array([size * np.exp(2j), size * np.exp(-2j), *others], complex))
    assert at(0.99, 0.3) * at(1.01, 0.3) < 0.0 and abs(at(0.99, 0.3)) == pytest.approx(1.0 - 0.99**2)
    assert at(0.99, 2.0, 0.4) * at(0.99, 2.0, 0.6) < 0.0  # two real ones that become each other's inverse
    assert circling(np.array([0.5 + 0j])) == 1.0 and circling(np.array([0.5, -0.2], complex)) > 0.0


def test_multipliers_at_a_point_are_what_its_kind_says():
    near = 0.5e-6
    for kind, place in ((K.PERIOD_DOUBLING, -1.0), (K.BRANCH_POINT, 1.0)):
        assert confirmed(kind, np.array([place + near, 0.3])) and not confirmed(kind, np.array([place + 4.0 * near, 0.3]))
        assert not confirmed(kind, np.array([-place, 0.3]))
    pair = np.exp(1j * np.array([1.0, -1.0]))
    assert confirmed(K.NEIMARK_SACKER, (1.0 + near) * pair) and not confirmed(K.NEIMARK_SACKER, (1.0 + 4.0 * near) * pair)
    assert not confirmed(K.NEIMARK_SACKER, np.array([1.0 + 0j, -1.0]))


class Line:
    """Points of a branch x = (t, 3 + 2 t) with multipliers that are functions of t."""

    def __init__(self, mu):
        self.mu, self.scale, self.length = mu, np.array([1.0, 4.0]), 0.5

    def at(self, t):
        return SimpleNamespace(x=np.array([t, 3.0 + 2.0 * t]), tangent=np.array([0.6, 0.8]))

    def multipliers_of_rows(self, xs):
        return np.array([self.mu(x[0]) for x in xs], complex)


def test_a_change_of_stability_is_enclosed_in_a_step():
    for curved in (lambda t: t, lambda t: t**3 - 0.4**3 + 0.4):
        line = Line(lambda t, f=curved: [-1.2 + 0.5 * f(t), 0.1])
        a, b = (passing(line.multipliers_of_rows([[t]])[0], -1.0) for t in (0.0, 1.0))
        c, t, width, error = enclosed(line, line, lambda mu: passing(mu, -1.0), a, b, K.PERIOD_DOUBLING)
        assert t == pytest.approx(0.4, abs=1e-12) and c.x[1] == pytest.approx(3.8)
        assert width <= 1e-6 and 1e-13 * 7.8 <= error < 1e-5
    jump = Line(lambda t: [-0.9 if t > 0.4 else -1.1, 0.1])
    assert enclosed(jump, jump, lambda mu: passing(mu, -1.0), -0.1, 0.1, K.PERIOD_DOUBLING) is None
    broken = Line(lambda t: [np.nan, 0.1])
    assert enclosed(broken, broken, lambda mu: passing(mu, -1.0), -0.1, 0.1, K.PERIOD_DOUBLING) is None
    broken.at = lambda t: None
    assert enclosed(broken, broken, lambda mu: passing(mu, -1.0), -0.1, 0.1, K.PERIOD_DOUBLING) is None


# special points

PROBLEM = SimpleNamespace(scale=np.array([1.0, 2.0]), signature="a", measure_names=("m", "n"), parameters=lambda x: {"p": x[-1]},
                          measure=lambda name, xs: np.array([{"m": 1.0, "n": 2.0}[name] * x[0] for x in xs]))


def point(kind=K.FOLD, s=1.0, p=2.0, error=1e-9, name="", problem=PROBLEM, **more):
    return SpecialPoint(kind, p, error, s, (s, s), np.array([0.5, p]), np.array([0.6, 0.8]), name=name, problem=problem, **more)


def test_points_found_from_both_sides_are_one():
    a, b = point(s=1.0), point(s=1.0 + 0.9e-6, p=2.0 + 1.9e-9)
    assert unique([b, a]) == [a]
    assert len(unique([a, point(s=1.0 + 1.1e-6)])) == 2
    assert len(unique([a, point(s=1.0 + 1e-7, p=2.0 + 3e-9)])) == 2  # farther apart than both errors
    assert len(unique([a, point(kind=K.PEAK)])) == 2 and len(unique([a, point(name="other")])) == 2
    between = [point(kind=kind, s=1.0 + 1e-7) for kind in (K.PEAK, K.GRAZING, K.USER)]
    assert len(unique([a, *between, b])) == 4
    assert [item.s for item in unique([point(s=3.0), point(s=-1.0), point(s=2.0)])] == [-1.0, 2.0, 3.0]
    sure = point(error=0.0), point(s=1.0 + 1e-8, p=2.0 + 1e-12, error=0.0)
    assert len(unique(sure)) == 1  # rounding of the parameter's scale


def test_the_error_of_a_point_is_found_once_and_travels_as_a_number():
    asked = []
    found = point(error=Later(lambda: asked.append(1) or 3e-9), problem=None)
    assert not asked
    for read in (lambda: found.error, lambda: copy.copy(found).error, lambda: pickle.loads(pickle.dumps(found)).error):
        assert read() == 3e-9 and type(read()) is float
    assert repr(found).startswith("SpecialPoint(fold at 2 +- 3.0e-09") and len(asked) == 1
    branch = bf.trace(circle(), bounds=(-2.0, 2.0))
    stored = branch.to_record()[1]["special"][:, -1]  # before any error was asked for
    assert stored.tolist() == [p.error for p in branch.special_points] and stored.all() and len(stored) == 2


def test_lists_of_points_select_by_kind():
    points = SpecialPoints([point(), point(kind=K.PEAK, s=2.0), point(s=3.0)])
    assert [item.s for item in points.of("fold")] == [1.0, 3.0] and isinstance(points.of(K.PEAK), SpecialPoints)
    assert repr(points).count("SpecialPoint(") == 3
    with pytest.raises(ValueError):
        points.of("nothing")
    assert "fold at 2 +- 1.0e-09, s = 1)" in repr(points[0])
    doubtful = point(name="gap", status=LocationStatus.GUESS, reverses=True)
    assert "fold gap at 2 +-" in repr(doubtful) and repr(doubtful).endswith("s = 1, reverses, guess)")
    assert points[0].u.tolist() == [0.5] and points[0].parameters == {"p": 2.0}


def test_points_of_the_other_half_are_turned():
    successor = SimpleNamespace(signature="b")
    found = SimpleNamespace(part=SimpleNamespace(problem=PROBLEM), successor=successor, low=1.0, high=1.5, s=1.25, kind=K.GRAZING,
                            tangent=np.array([0.6, -0.8]), x=np.array([0.5, 2.0]), error=1e-8, status=LocationStatus.LOCATED,
                            reverses=True, name="n", directions=None, recorded={"r": 4.0})
    there, back = special_point(found, 1), special_point(found, -1)
    assert (there.s, there.bracket, there.before, there.after) == (1.25, (1.0, 1.5), "a", "b")
    assert (back.s, back.bracket, back.before, back.after) == (-1.25, (-1.5, -1.0), "b", "a")
    np.testing.assert_array_equal(there.tangent, [0.6, -0.8])
    np.testing.assert_array_equal(back.tangent, [-0.6, 0.8])
    assert there.recorded == {"r": 4.0} and there.parameter == 2.0 and there.reverses and there.problem is PROBLEM
    found.successor, found.s, found.low, found.high, found.recorded = None, 0.0, 0.0, 0.0, None
    start = special_point(found, -1)
    assert math.copysign(1.0, start.s) == 1.0 and start.bracket == (0.0, 0.0) and (start.before, start.after) == ("a", "a")


def test_measures_of_a_point_are_its_problems_and_what_was_recorded():
    measures = point(recorded={"r": 4.0, "m": 9.0}).measures
    assert list(measures) == ["m", "n", "r"] and len(measures) == 3 and "n" in measures and "z" not in measures
    assert measures["m"] == 9.0 and measures["n"] == 1.0 and measures["r"] == 4.0
    with pytest.raises(KeyError, match="no measure 'z'; there are m, n, r"):
        measures["z"]
    assert isinstance(measures, Measures)


# parity

def test_changes_of_direction_are_counted_against_reversing_points():
    s, slope = np.arange(6.0), np.array([1.0, 0.5, -0.3, -1.0, 0.4, 1.0])
    part, problems = np.zeros(6, int), [PROBLEM]

    def at(where, reverses=True, **more):
        return SimpleNamespace(s=where, reverses=reverses, problem=PROBLEM, successor=None, **more)
    assert parity_violations(s, slope, part, [at(1.5), at(3.5)], problems) == ()
    assert parity_violations(s, slope, part, [at(1.5)], problems) == ((3.0, 4.0),)
    assert parity_violations(s, slope, part, [at(1.5), at(3.5), at(4.5)], problems) == ((4.0, 5.0),)
    assert parity_violations(s, slope, part, [at(1.5), at(3.5), at(4.5), at(4.6)], problems) == ()
    assert parity_violations(s, slope, part, [at(1.5), at(3.5, reverses=False)], problems) == ((3.0, 4.0),)
    assert parity_violations(s, slope, part, [at(1.5), at(3.5), at(-1.0), at(9.0)], problems) == ()
    unclear = slope.copy()
    unclear[2] = 0.5 * BOUNDARY_BAND  # passed over: the interval is (1, 3)
    assert parity_violations(s, unclear, part, [], problems) == ((1.0, 3.0), (3.0, 4.0))
    assert parity_violations(s, 0.0 * slope, part, [at(1.5)], problems) == ()
    # on a boundary two rows stand at one arclength: the point lies between them, from whichever side it was found
    other = SimpleNamespace()
    double_s, parts = np.array([0.0, 1.0, 1.0, 2.0]), np.array([0, 0, 1, 1])
    for one, two in ((PROBLEM, other), (other, PROBLEM)):
        border = SimpleNamespace(s=1.0, reverses=True, problem=one, successor=two)
        assert parity_violations(double_s, np.array([1.0, 0.5, -0.5, -1.0]), parts, [border], [PROBLEM, other]) == ()


def test_slopes_on_boundaries_count_where_the_chord_agrees():
    arrays = {"slope": np.array([0.5, -0.2, -0.3, 0.4, 0.6]), "part": np.array([0, 0, 1, 1, 1]),
              "s": np.array([0.0, 1.0, 1.0, 2.0, 3.0]), "parameter": np.array([0.0, 1.0, 1.0, 2.0, 1.5])}
    before = arrays["slope"].copy()
    assert told_slopes(arrays, []).tolist() == [0.5, 0.0, 0.0, 0.4, 0.6]  # only rows on the boundary
    np.testing.assert_array_equal(arrays["slope"], before)
    arrays["parameter"] = np.array([2.0, 1.0, 1.0, 0.5, 1.5])
    assert told_slopes(arrays, []).tolist() == [0.5, -0.2, -0.3, 0.4, 0.6]


def test_at_an_end_on_a_boundary_the_slope_counts_where_the_chord_agrees():
    """A parabola whose least value lies on the boundary at which a branch ends: the slope there is rounding.  At any other end,
    as on a bound, the slope is known: a fold in the first or last step shows."""
    s, part = np.array([0.0, 1.0, 2.0, 3.0]), np.zeros(4, int)
    for way in (1, -1):
        arrays = {"slope": way * np.array([-1e-5, 2.0, 4.0, 6.0])[::way], "part": part, "s": s, "parameter": (s**2)[::way]}
        end = SimpleNamespace(s=(s[0], s[-1])[way < 0], reverses=False, problem=PROBLEM, successor=None)
        assert told_slopes(arrays, [end]).tolist() == (way * np.array([0.0, 2.0, 4.0, 6.0])[::way]).tolist()
        assert parity_violations(s, told_slopes(arrays, [end]), part, [end], [PROBLEM]) == ()
        assert len(parity_violations(s, told_slopes(arrays, []), part, [end], [PROBLEM])) == 1


def test_a_row_alone_in_its_equations_has_no_slope_for_the_parity():
    """A parabola whose least value lies on a boundary: of the row beside it there the tangent is rounding, of either sign."""
    s = np.array([0.0, 0.0, 1.0, 2.0])
    for rounded in (-5e-6, 5e-6):
        arrays = {"slope": np.array([rounded, *(2.0 * s[1:] + 0.1)]), "part": np.array([0, 1, 1, 1]), "s": s,
                  "parameter": s**2 + 0.1 * s}
        slopes = told_slopes(arrays, [])
        assert slopes.tolist() == [0.0, 0.1, 2.1, 4.1]
        assert parity_violations(s, slopes, arrays["part"], [], [PROBLEM, SimpleNamespace()]) == ()


def test_an_audit_is_well_where_nothing_speaks_against_it():
    def audit(**more):
        return Audit(**{"parity": True, "violations": (), "angles": np.zeros(7), "n_points": 9, "n_rejected": 2,
                        "worst_residual": 1e-13, "unresolved": (), **more})
    again = SimpleNamespace(not_repeated=(), unexplained=(), rows=0, seconds=0.0)
    assert audit().ok and audit(resimulated=again).ok and "Audit(ok, 9 points, 2 rejected, worst residual 1.0e-13)" == repr(audit())
    for wrong in ({"parity": False, "violations": ((0.0, 1.0),)}, {"unresolved": (("fold", 1.0, 2.0),)},
                  {"resimulated": SimpleNamespace(not_repeated=(1,), unexplained=(), rows=3, seconds=0.5)},
                  {"resimulated": SimpleNamespace(not_repeated=(), unexplained=(1, 2), rows=3, seconds=0.5)}):
        assert not audit(**wrong).ok
    assert "0 parity violations, 0 unresolved, 1 rows not repeated, 0 changes" in repr(audit(
        resimulated=SimpleNamespace(not_repeated=(1,), unexplained=(), rows=3, seconds=0.5)))


# branches

def drawn(p, y):
    problem = SimpleNamespace(measure_names=("m",), measure=lambda name, xs: xs[:, 0], scale=np.ones(2), signature="-")
    p, y = np.array(p, float), np.array(y, float)
    arrays = {"parameter": p, "s": np.arange(p.size, dtype=float), "x": np.column_stack([y, p]).ravel(),
              "part": np.zeros(p.size, int), "offsets": 2 * np.arange(p.size + 1), "iterations": np.arange(p.size),
              "residual": np.zeros(p.size), "angle": np.zeros(p.size), "recorded/r": 10.0 + y}
    return Branch("p", [problem], arrays, [], (), (0.0, 9.0), {})


def test_distances_of_points_from_a_branch():
    """A branch that turns back: the nearest of its parts counts; between rows it is a line."""
    branch = drawn([0.0, 2.0, 2.0, 1.0], [0.0, 4.0, 6.0, 10.0])
    found = branch.distance([(1.0, 2.5), (1.5, 8.0), (2.0, 5.0), (0.5, 0.0), (3.0, 1.0), (-0.1, 0.0)], "m")
    np.testing.assert_allclose(found, [0.5, 0.0, 1.0, 1.0, np.inf, np.inf])
    for wrong in ([1.0, 2.0], [[1.0, 2.0, 3.0]], [[np.nan, 1.0]]):
        with pytest.raises(ValueError, match="finite pairs"):
            branch.distance(wrong, "m")


def test_a_branch_that_reaches_further_has_its_points_on_its_own_problems(monkeypatch):
    """Rows, ends and points are the same; the problems of points and those behind them are the new ones."""
    def bounded(self, low, high, made):
        other = made.setdefault(id(self), copy.copy(self))
        other.interval = (low, high)
        return other
    branch = bf.continuation.trace(Free(-0.9 + 0.3 * 0.81, -0.9, (0.5, 0.0, 1.0)), bounds=(-1, 1))
    assert branch.reaching(-2.0, 2.0) is branch  # problems that are defined everywhere
    monkeypatch.setattr(bf.continuation.Problem, "bounded", bounded)
    wide = branch.reaching(-2.0, 2.0)
    place = {id(problem): k for k, problem in enumerate(wide.problems)}
    old = {id(problem): k for k, problem in enumerate(branch.problems)}
    assert len(place) == 2 and not place.keys() & old.keys()
    assert all(problem.interval == (-2.0, 2.0) for problem in wide.problems)
    assert any(point.successor is not None for point in branch.special_points)
    for new, point in zip(wide.special_points, branch.special_points, strict=True):
        assert place[id(new.problem)] == old[id(point.problem)] and new == point
        assert (None if new.successor is None else place[id(new.successor)]) == (
            None if point.successor is None else old[id(point.successor)])
    assert np.array_equal(wide.column("s"), branch.column("s")) and wide.ends == branch.ends and wide.audit.ok


def test_columns_are_copies_in_the_order_of_arclength():
    branch = drawn([0.0, 2.0, 1.0], [3.0, 4.0, 6.0])
    assert branch.column_names == ("step", "s", "p", "m", "r", "iterations", "residual", "angle") and len(branch) == 3
    for name, want in (("step", [0, 1, 2]), ("p", [0, 2, 1]), ("parameter", [0, 2, 1]), ("m", [3, 4, 6]), ("r", [13, 14, 16]),
                       ("iterations", [0, 1, 2])):
        column = branch.column(name)
        assert column.tolist() == want
        column[:] = -1
        assert branch.column(name).tolist() == want
    x = branch.x(-1)
    assert x.tolist() == [6.0, 1.0]
    x[:] = 0.0
    assert branch.x(2).tolist() == [6.0, 1.0]
    with pytest.raises(KeyError, match="no column 'z'; there are step, s, p, m, r"):
        branch.column("z")
    with pytest.raises(ValueError, match="i = 3 is not allowed; it must be a whole number, at least -3 and at most 2"):
        branch.x(3)


@pytest.mark.parametrize("problem, bounds, count", [
    (pitchfork(p0=-1.0, u0=0.0), (-1.0, 1.0), 1),
    (Scalar(lambda u, p: u * (p**3 - p - u), lambda u, p: (p**3 - p - 2.0 * u, u * (3.0 * p * p - 1.0)), 0.0, -2.0),
     (-2.0, 2.0), 3)])
def test_a_branch_that_is_read_is_the_branch_that_was_written(problem, bounds, count, tmp_path):
    branch = bf.trace(problem, bounds=bounds, record=lambda row: {"twice": 2.0 * row.parameter})
    assert sum(point.directions is not None for point in branch.special_points) == count
    branch.save(tmp_path / "b.npz")
    again = Branch.load(tmp_path / "b.npz", problem=problem)
    for name in branch.column_names:
        np.testing.assert_array_equal(again.column(name), branch.column(name))
    np.testing.assert_array_equal(branch.column("twice"), 2.0 * branch.column("parameter"))
    assert repr(again) == repr(branch) and again.ends == branch.ends and again.bounds == branch.bounds
    for a, b in zip(again.special_points, branch.special_points, strict=True):
        assert repr(a) == repr(b) and a.bracket == b.bracket and a.recorded == b.recorded
        np.testing.assert_array_equal(a.tangent, b.tangent)
        np.testing.assert_array_equal(a.directions, b.directions)
    for a, b in zip(again.rows(), branch.rows(), strict=True):
        for name in ("tests", "det_sign", "det_log", "ds", "angle", "iterations", "s", "p", "singular"):
            assert getattr(a, name) == getattr(b, name)
    with pytest.raises(ValueError, match="class 'Scalar', got"):
        Branch.load(tmp_path / "b.npz", problem=_Other())
    missing = Branch.load(tmp_path / "b.npz")
    np.testing.assert_array_equal(missing.column("parameter"), branch.column("parameter"))
    with pytest.raises(ValueError, match="holds no code"):
        missing.extend(bounds=(bounds[0], 3.0))


def test_what_only_some_rows_recorded_is_kept_and_missing_elsewhere():
    branch = bf.trace(pitchfork(p0=-1.0, u0=0.0), bounds=(-1.0, -0.5))
    rows = list(branch.rows())
    for i, row in enumerate(rows):
        row.recorded = {0: None, 1: {"a": 1.5}}.get(i, {"b": float(i)})
    arrays = to_arrays(rows, [0] * len(rows))
    assert arrays["recorded/a"][1] == 1.5 and np.isnan(np.delete(arrays["recorded/a"], 1)).all()
    assert np.isnan(arrays["recorded/b"][:2]).all() and arrays["recorded/b"][2:].tolist() == list(range(2, len(rows)))


class _Other(Scalar):
    def __init__(self):
        super().__init__(lambda u, p: u, None, 0.0, 0.0)


# what is watched

def test_monitors_and_peaks_are_named_or_refused():
    problem = pitchfork()
    assert with_monitors(problem, None) is problem and with_monitors(problem, {}) is problem
    for bad, said in (({"": abs}, "no free name"), ({"bound": abs}, "no free name"), ({3: abs}, "a mapping of names"),
                      ({"a": 4}, "must be a function")):
        with pytest.raises(ValueError, match=said):
            with_monitors(problem, bad)
    assert value_of("a", lambda s: s + 1, 2) == 3.0 and math.isnan(value_of("a", lambda s: math.nan, 2))
    with pytest.raises(ValueError, match="monitor 'a' must return a number, got 'x'"):
        value_of("a", lambda s: "x", 2)
    made = SimpleNamespace(measure_names=("h1_0", "stable", "period", "multiplier_1", "n_events"), monitors=())
    assert with_peaks(made, None) is made and with_peaks(made, ()) is made
    assert with_peaks(made, "h1_0").peaks == ("h1_0",)
    for bad in ("stable", "multiplier_1", "period", "n_events", "h1_9", ["h1_0", "stable"]):
        with pytest.raises(ValueError, match="is no amplitude measure of this branch; there are h1_0$"):
            with_peaks(made, bad)
    with pytest.raises(ValueError, match="must be the name of a measure"):
        with_peaks(made, 3)


@pytest.mark.parametrize("angle", [0.3, 1.2, 2.5, 4.0, 5.5])
def test_slopes_of_measures_turn_with_the_direction(angle):
    """On a circle u = cos, p = sin, u changes along the branch by its part of the tangent, one way and the other."""
    scale = np.array([3.0, 0.5])
    watched = with_peaks(circle(scale_u=scale[0], scale_p=scale[1]), "u_0")
    tangent = np.array([-np.sin(angle), np.cos(angle)]) / scale
    tangent /= np.linalg.norm(tangent)
    for way in (tangent, -tangent):
        c = watched.correct(np.array([np.cos(angle), np.sin(angle)]), way)
        assert c.monitors[-1] == pytest.approx(scale[0] * way[0], rel=1e-9)


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("start", [0.7, 2.2, 3.9, 5.4])
def test_the_peak_of_a_loop_is_its_top_wherever_it_starts(start, direction):
    branch = bf.continuation.trace(circle(u0=math.cos(start), p0=math.sin(start)), bounds=(-2.0, 2.0), peaks="u_0",
                                   direction=direction)
    (peak,) = branch.special_points.of("peak")
    assert branch.closed and peak.u[0] == pytest.approx(1.0, abs=1e-12) and abs(peak.parameter) <= max(peak.error, 1e-9)


def test_a_start_on_another_branch_leads_away_from_the_known_one():
    problem = SimpleNamespace(scale=np.array([2.0, 0.5]))
    here = SimpleNamespace(x=np.array([1.0, 1.0]), tangent=np.array([0.0, 1.0]))

    def leads(move, tangent, distance=0.1):
        c = SimpleNamespace(x=here.x + problem.scale * np.array(move), tangent=np.array(tangent))
        return leads_away(problem, here, c, distance)
    assert leads([0.1, 0.0], [1.0, 0.0]) and leads([0.19, 0.0], [1.0, 0.0]) and leads([0.06, 0.0], [1.0, 0.0])
    assert not leads([0.21, 0.0], [1.0, 0.0]) and not leads([0.04, 0.0], [1.0, 0.0])
    assert not leads([0.0, 0.1], [0.0, 1.0]) and not leads([0.07, 0.07], [0.6, -0.8])


def test_starts_of_other_branches_keep_their_own_sentence():
    some, none = Switched((1.5, "b"), "two branches leave"), Switched([], "none leaves")
    for starts, content, status in ((some, (1.5, "b"), "two branches leave"), (none, (), "none leaves")):
        for same in (starts, copy.copy(starts), copy.deepcopy(starts), pickle.loads(pickle.dumps(starts))):
            assert type(same) is Switched and same == content and same.status == status
            assert repr(same) == f"Switched({len(content)} starts: {status})"
