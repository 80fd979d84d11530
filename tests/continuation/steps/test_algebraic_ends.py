"""How branches end, are interrupted, recorded, saved, loaded and extended."""
import math

import numpy as np
import pytest

from bifurc.continuation import (
    Branch,
    ContinuationError,
    Corrected,
    CorrectorStatus,
    Monitor,
    Problem,
    SpecialPointKind,
    StopReason,
    switch_branch,
    trace,
)
from tests.continuation.problems import Free, Scalar, circle, hysteresis, parabola, pitchfork


def line(function=lambda u, p: u - p, u0=0.0, p0=0.0, cls=Scalar):
    return cls(function, lambda u, p: (1.0, -1.0), u0, p0)


def same(a: Branch, b: Branch):
    """Bit for bit."""
    header, arrays = a.to_record()
    other, others = b.to_record()
    assert header == other
    assert arrays.keys() == others.keys()
    for name in arrays:
        assert arrays[name].dtype == others[name].dtype
        assert arrays[name].tobytes() == others[name].tobytes(), name


@pytest.mark.parametrize("bounds", [(0.2, -0.7), (-0.7, 0.2), (-1e-3, 1.0), (-0.5, 0.3849), (-0.38490017945975, 2.0)])
def test_each_half_ends_exactly_on_its_bound(bounds):
    u0 = 0.0
    branch = trace(hysteresis().restarted([u0, 0.0]), bounds=bounds, ds_max=0.3)
    p = branch.column("p")
    assert {p[0], p[-1]} <= {min(bounds), max(bounds)}
    u = branch.column("u_0")
    assert np.abs(u**3 - u - p).max() < 1e-14
    assert branch.stop_reason == (StopReason.BOUND, StopReason.BOUND)
    assert (p >= min(bounds)).all() and (p <= max(bounds)).all()


def test_a_bound_between_two_folds_is_met_before_the_fold_behind_it():
    """p rises to the fold at .3849 and comes back within one long step: the branch ends on its way up."""
    branch = trace(hysteresis(), bounds=(-1.0, 0.3845), ds=0.3, ds_max=0.5)
    assert branch.special_points == ()
    assert branch.column("p")[-1] == 0.3845
    assert branch.column("u_0")[-1] < -1.0 / math.sqrt(3.0)


def test_start_on_a_bound():
    outside = trace(line(p0=1.0, u0=1.0), bounds=(-1, 1))
    assert outside.column("p")[[0, -1]].tolist() == [-1.0, 1.0]
    assert outside.ends[1].reason is StopReason.BOUND
    fold = trace(parabola(), bounds=(-1, 0))
    assert [point.kind for point in fold.special_points] == [SpecialPointKind.FOLD]
    assert fold.column("p")[[0, -1]].tolist() == [-1.0, -1.0]


def test_direction():
    up, down = (trace(line(), bounds=(-1, 1), direction=d) for d in (1, -1))
    assert up.column("p")[[0, -1]].tolist() == [0.0, 1.0]
    assert down.column("p")[[0, -1]].tolist() == [-1.0, 0.0]
    assert up.stop_reason == (StopReason.NOT_STARTED, StopReason.BOUND)
    assert down.stop_reason == (StopReason.BOUND, StopReason.NOT_STARTED)


def test_bad_arguments():
    start = line()
    for words, arguments in (
            ("outside the bounds", {"bounds": (1, 2)}), ("two different", {"bounds": (1, 1)}),
            ("two different numbers", {"bounds": 3}),
            ("two different", {"bounds": (math.nan, 1)}), ("direction", {"direction": 2}), ("ds = 0 .* above 0", {"ds": 0}),
            ("ds_max = -1 .* above 0", {"ds_max": -1}), ("ds_min", {"ds_min": 1.0}), ("max_steps", {"max_steps": -1}),
            ("unknown parameter 'q'", {"parameter": "q"})):
        with pytest.raises(ValueError, match=words):
            trace(start, **arguments)
    with pytest.raises(TypeError, match="an Equilibrium or a Problem"):
        trace(3, bounds=(0, 1))
    with pytest.raises(ValueError, match="stop = 3 is not allowed; it must be a function"):
        trace(start, stop=3)
    with pytest.raises(ValueError, match="u0"):
        parabola(math.nan, 0.0)
    with pytest.raises(ValueError, match="scale_p"):
        parabola(0.0, 0.0, scale_p=-1.0)
    with pytest.raises(NotImplementedError, match="residual"):
        trace(Problem(0.0, 0.0))


def test_no_solution_near_the_start():
    with pytest.raises(ContinuationError, match="no solution was found"):
        trace(Scalar(lambda u, p: u * u + 1.0 + p * p, lambda u, p: (2 * u, 2 * p), 0.3, 0.0), bounds=(-1, 1))
    with pytest.raises(ContinuationError, match="not finite"):
        trace(Scalar(lambda u, p: math.nan, lambda u, p: (math.nan, 1.0), 0.0, 0.0))


def test_a_rough_start_is_corrected_at_its_parameter():
    branch = trace(hysteresis().restarted([-3.0, -1.0]), bounds=(-1, 1))
    assert branch.column("u_0")[0] == pytest.approx(-1.3247179572447460, abs=1e-14)
    assert branch.column("p")[0] == -1.0


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_the_edge_of_definition_is_approached_and_named(value):
    branch = trace(line(lambda u, p: u - p if p <= 0.5 else value), bounds=(-1, 1))
    assert branch.stop_reason == (StopReason.BOUND, StopReason.NOT_FINITE)
    assert 0.5 - 1e-6 < branch.column("p")[-1] <= 0.5
    assert "NaN" in branch.ends[1].sentence


def until_half(text):
    """The residual u - p, which raises an error of its own beyond p = .5."""
    def residual(u, p):
        if p > 0.5:
            raise RuntimeError(text)
        return u - p
    return residual


def test_an_exception_of_the_problem_is_approached_and_named():
    branch = trace(line(until_half("the pump is off")), bounds=(-1, 1))
    assert branch.stop_reason == (StopReason.BOUND, StopReason.EXCEPTION)
    assert "the pump is off" in branch.ends[1].sentence
    assert 0.5 - 1e-6 < branch.column("p")[-1] <= 0.5


def test_a_bound_at_the_edge_of_definition_is_reached():
    branch = trace(line(until_half("never asked for")), bounds=(-1, 0.5))
    assert branch.stop_reason == (StopReason.BOUND, StopReason.BOUND)
    assert branch.column("p")[-1] == 0.5


def test_zero_jacobian():
    branch = trace(Scalar(lambda u, p: u * u + p * p, lambda u, p: (2 * u, 2 * p), 0.0, 0.0), bounds=(-1, 1))
    assert branch.stop_reason == (StopReason.SINGULAR, StopReason.SINGULAR)
    assert len(branch) == 1
    double = trace(Scalar(lambda u, p: (u - p)**2, lambda u, p: (2 * (u - p), -2 * (u - p)), 0.0, 0.0), bounds=(-1, 1))
    assert double.stop_reason == (StopReason.SINGULAR, StopReason.SINGULAR)


def test_a_corner_ends_at_the_smallest_step():
    start = Scalar(lambda u, p: u - 3 * abs(p), lambda u, p: (1.0, -3.0 if p > 0 else 3.0), 1.5, -0.5)
    corner = trace(start, bounds=(-1, 1))
    assert corner.stop_reason == (StopReason.BOUND, StopReason.DS_MIN)
    assert abs(corner.column("p")[-1]) < 1e-6
    assert "in every step" in corner.ends[1].message


def test_max_steps_stop_and_record():
    branch = trace(line(), max_steps=7)
    assert branch.stop_reason == (StopReason.MAX_STEPS, StopReason.MAX_STEPS)
    assert len(branch) == 15
    stopped = trace(line(), bounds=(-1, 1), stop=lambda point: point.parameter > 0.3,
                    record=lambda point: {"twice": 2.0 * point.solution.p, "s_there": point.s})
    assert stopped.stop_reason == (StopReason.BOUND, StopReason.STOPPED)
    p = stopped.column("p")
    assert (p[:-1] <= 0.3).all() and p[-1] > 0.3
    assert (stopped.column("twice") == 2.0 * p).all()

    def broken(point):
        raise KeyError("nothing")
    ended = trace(line(), bounds=(-1, 1), record=lambda point: broken(point) if point.parameter > 0.5 else {"a": 1.0})
    assert ended.ends[1].reason is StopReason.CALLBACK_FAILED
    assert "KeyError" in ended.ends[1].message


def test_special_points_have_recorded_values_of_their_own():
    """What is recorded bends between rows: at a fold it is asked for, not interpolated; errors there end the branch."""
    branch = trace(hysteresis(), bounds=(-1, 1), ds=0.2,
                   record=lambda point: {"high": math.exp(5.0 * point.u[0]), "there": point.s})
    fold = branch.special_points[0]
    assert fold.measures["high"] == math.exp(5.0 * fold.u[0])
    assert {"u_0", "high", "there"} == set(fold.measures)
    assert abs(fold.measures["there"]) == abs(fold.s)
    at = fold.s

    def failing(point):
        if abs(abs(point.s) - abs(at)) < 1e-9:
            raise KeyError("no value here")
        return {"a": 1.0}
    ended = trace(hysteresis(), bounds=(-1, 1), ds=0.2, record=failing)
    assert "at a special point: record= raised KeyError" in ended.ends[1].message


@pytest.mark.parametrize("after", [1, 5, 40])
def test_interrupting_keeps_what_is_there(after):
    whole = trace(hysteresis(), bounds=(-1, 1), ds_max=0.05)
    calls = 0

    class Interrupted(Scalar):
        def residual(self, u, p):
            nonlocal calls
            calls += 1
            if calls == limit:
                raise KeyboardInterrupt
            return super().residual(u, p)

    start = hysteresis()
    limit = 10 + 7 * after
    branch = trace(Interrupted(start.f, start.df, start.x0[0], start.x0[1]), bounds=(-1, 1), ds_max=0.05)
    assert branch.stop_reason[1] is StopReason.INTERRUPTED
    n = len(branch)
    assert n > 1
    assert branch.column("p").tolist() == whole.column("p")[:n].tolist()
    finished = branch.extend()
    assert finished.stop_reason == (StopReason.BOUND, StopReason.BOUND)
    assert [point.parameter for point in finished.special_points] == pytest.approx(
        [point.parameter for point in whole.special_points], abs=1e-14)
    assert finished.column("p").tolist() == whole.column("p").tolist()


def make(name):
    if name == "signature":
        return Free(0.0, 0.0, (0.0, -1.0, 4.0))
    return {"pitchfork": pitchfork(), "hysteresis": hysteresis(), "parabola": parabola()}[name]


@pytest.mark.parametrize("name", ["pitchfork", "hysteresis", "parabola"])
def test_saved_loaded_extended_bit_for_bit(tmp_path, name):
    problem = make(name)
    bounds, wider = {"pitchfork": ((-1, 0), (-2, 1)), "hysteresis": ((-1, 0.2), (-2, 2)),
                     "parabola": ((-1, 1), (-3, 1))}[name]
    branch = trace(problem, bounds=bounds, ds_max=0.1, record=lambda point: {"mine": point.parameter})
    path = tmp_path / "branch.npz"
    branch.save(path)
    loaded = Branch.load(path, problem=make(name))
    same(branch, loaded)
    longer = branch.extend(bounds=wider)
    assert len(longer) > len(branch)
    same(longer, loaded.extend(bounds=wider))
    same(branch, loaded)
    assert longer.audit.ok
    kinds = [point.kind.value for point in longer.special_points]
    assert kinds == {"pitchfork": ["branch_point"], "hysteresis": ["fold", "fold"], "parabola": ["fold"]}[name]
    p = longer.column("p")
    assert {p[0], p[-1]} <= set(map(float, wider))
    assert [point.parameter for point in longer.special_points] == pytest.approx(
        [point.parameter for point in trace(make(name), bounds=wider, ds_max=0.1).special_points], abs=1e-14)
    longer.save(path)
    read = Branch.load(path, problem=make(name))
    same(longer, read)
    for point, other in zip(longer.special_points, read.special_points, strict=True):  # what was extended records nothing more
        assert point.recorded == other.recorded
        assert point.recorded.get("mine", point.parameter) == point.parameter


def test_a_file_without_the_code_can_be_read(tmp_path):
    branch = trace(pitchfork(), bounds=(-1, 1))
    branch.save(tmp_path / "b.npz")
    loaded = Branch.load(tmp_path / "b.npz")
    assert loaded.column("u_0").tolist() == branch.column("u_0").tolist()
    assert repr(loaded) == repr(branch)
    with pytest.raises(ValueError, match=r"holds no code.*Scalar"):
        loaded.extend(bounds=(-2, 2))
    with pytest.raises(ValueError, match="class 'Scalar'"):
        Branch.load(tmp_path / "b.npz", problem=Free(0.0, 0.0, (0, 1, 0)))


def test_a_closed_branch_is_not_extended():
    branch = trace(circle(), bounds=(-2, 2))
    longer = branch.extend(bounds=(-3, 3))
    assert longer.closed and len(longer) == len(branch)


def test_an_open_branch_may_close_when_extended():
    branch = trace(circle(1.0, 0.0, scale_u=1.0, scale_p=1.0), bounds=(-0.5, 0.5))
    assert branch.special_points == ()
    longer = branch.extend(bounds=(-2, 2))
    assert longer.closed
    assert sorted(point.parameter for point in longer.special_points) == pytest.approx([-1.0, 1.0], abs=1e-14)
    assert longer.column("s")[-1] - longer.column("s")[0] == pytest.approx(2.0 * math.pi, abs=1e-3)


def test_bounds_that_cut_a_branch_cannot_extend_it():
    with pytest.raises(ValueError, match="outside the bounds"):
        trace(line(), bounds=(-1, 1)).extend(bounds=(-0.5, 2))


@pytest.mark.parametrize(("value", "bounds"), [(np.nextafter(0.5, 0.0), (0.5, 1.0)), (np.nextafter(0.5, 1.0), (0.5, -1.0))])
def test_a_start_beside_its_bound_by_rounding_lies_on_it(value, bounds):
    start = line()
    start.x0[-1] = value
    branch = trace(start, bounds=bounds)
    assert sorted(branch.column("p")[[0, -1]].tolist()) == sorted(bounds)
    start.x0[-1] = 0.5 - 1e-9 * np.sign(bounds[1])
    with pytest.raises(ValueError, match="outside the bounds"):
        trace(start, bounds=bounds)


def test_columns_and_solutions():
    branch = trace(parabola(), bounds=(-1, 1))
    assert branch.column_names == ("step", "s", "p", "u_0", "iterations", "residual", "angle")
    assert branch.parameter == "p"
    with pytest.raises(KeyError, match="no column 'rms'; there are step"):
        branch.column("rms")
    assert branch.orbits[-1].p == branch.column("p")[-1]
    assert len(branch.orbits) == len(branch) == len(branch.orbits[:])
    frame = branch.to_pandas()
    assert list(frame.columns) == list(branch.column_names)
    (fold,) = branch.special_points.of("fold")
    assert branch.special_points.of("grazing") == ()
    assert fold.solution.p == fold.parameter
    assert fold.measures["u_0"] == fold.u[0]
    assert "\n" not in repr(branch) and "1 fold" in repr(branch)
    assert repr(fold).startswith("SpecialPoint(fold at ")
    assert branch.audit.angles.sum() == len(branch)


def test_progress():
    seen = []
    branch = trace(parabola(), bounds=(-1, 1), progress=lambda p, count: seen.append(p))
    assert sorted(set(seen)) == sorted(set(branch.column("p").tolist()))
    trace(parabola(), bounds=(-1, 1), progress=True)


def test_switching_at_a_pitchfork_leads_to_both_sides():
    branch = trace(pitchfork(), bounds=(-1, 1))
    starts = switch_branch(branch.special_points[0])
    assert len(starts) == 2
    sides = sorted(math.copysign(1.0, start.x0[0]) for start in starts)
    assert sides == [-1.0, 1.0]
    for start in starts:
        side = trace(start, bounds=(-1, 1))
        assert np.abs(side.column("u_0")**2 - side.column("p")).max() < 1e-13
        assert [point.kind.value for point in side.special_points] == ["branch_point"]
    fold = trace(hysteresis(), bounds=(-1, 1)).special_points[0]
    nothing = switch_branch(fold)
    assert nothing == () and "no other branch" in nothing.status


class Watched(Scalar):
    """p = size u^2, valid for u < 0; watched by a function of u and p."""

    monitors = (Monitor("grazing", boundary=True),)

    def __init__(self, u0, size=1.0, value=lambda u, p: u):
        super().__init__(lambda u, p: p - size * u * u, lambda u, p: (-2.0 * size * u, 1.0), u0, size * u0 * u0, scale_u=1.0,
                         scale_p=1.0)
        self.value = value

    def monitor_values(self, u, p, tangent):
        return np.array([self.value(float(u[0]), p)])


def test_a_bound_comes_before_the_boundary_behind_it():
    """p falls to the bound, and behind it to the boundary at u = 0, within one step whose end lies within the bounds."""
    branch = trace(Watched(-0.05), bounds=(1e-4, 1.0), ds=0.07)
    assert branch.stop_reason == (StopReason.BOUND, StopReason.BOUND) and branch.special_points == ()
    assert branch.column("p").min() == 1e-4 and branch.column("u_0").max() == pytest.approx(-0.01, abs=1e-9)


def test_a_boundary_that_is_zero_to_rounding_everywhere_ends_nothing():
    branch = trace(Watched(-0.5, value=lambda u, p: 1e-17 * math.sin(1e6 * p)), bounds=(0.1, 1.0))
    assert branch.stop_reason == (StopReason.BOUND, StopReason.BOUND) and branch.special_points == ()


class Stalls(Watched):
    """Where dp/ds falls to nothing on the bound points are rounding, and Newton's method stalls unless it begins next to them."""

    def correct(self, x, tangent, fixed=False):
        made = super().correct(x, tangent, fixed)
        lost = abs(float(x[0])) > 1e-6 if fixed and x[-1] == 0.0 else float(x[0]) > -7e-5
        return Corrected(made.x, made.tangent, False, CorrectorStatus.NOT_CONVERGED, 1, 1e-12, math.inf, math.inf, 0.0, -math.inf,
                         made.monitors) if lost else made


def test_a_bound_that_is_met_at_no_angle_lies_where_the_slope_tells():
    branch = trace(Stalls(-0.02, size=100.0), bounds=(0.0, 1.0))
    assert branch.stop_reason == (StopReason.BOUND, StopReason.BOUND)
    end = int(np.argmin(branch.column("p")))
    assert branch.column("p")[end] == 0.0 and abs(branch.column("u_0")[end]) < 1e-6
