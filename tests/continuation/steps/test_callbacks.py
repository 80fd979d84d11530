"""Functions of the caller along a branch: one that fails ends it under its name, and no row is lost."""
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.branches.branch import Branch
from bifurc.continuation.kinds import StopReason
from tests.continuation.problems import Scalar


class Mine(Exception):
    """A class of errors that no library knows."""


def line(watched=None):
    return Scalar(lambda u, p: u - 2.0 * p, lambda u, p: (1.0, -2.0), -2.0, -1.0)


def raises(error):
    def function(*_):
        raise error
    return function


def from_half(function, before=None):
    """Return what answers ``before`` up to p = .5, and what ``function`` does beyond."""
    def asked(point, *_):
        p = point if isinstance(point, float) else point.parameter if hasattr(point, "parameter") else point.p
        return function(point) if p > 0.5 else before
    return asked


FAILING = {
    "stop raises": ("stop", raises(ZeroDivisionError("no")), False, "stop= raised ZeroDivisionError: no"),
    "stop raises its own": ("stop", raises(Mine("deep")), False, "stop= raised Mine: deep"),
    "stop is NaN": ("stop", lambda point: math.nan, False, "stop= returned nan"),
    "stop is a word": ("stop", lambda point: "yes", False, "stop= returned 'yes'"),
    "stop is an array": ("stop", lambda point: np.zeros(2), False, "stop= returned array"),
    "record raises": ("record", raises(KeyError("a")), {"a": 1.0}, "record= raised KeyError: 'a'"),
    "record raises its own": ("record", raises(Mine("deep")), {"a": 1.0}, "record= raised Mine: deep"),
    "record is a number": ("record", lambda point: 3.0, {"a": 1.0}, "record= returned 3.0"),
    "record holds a word": ("record", lambda point: {"a": "x"}, {"a": 1.0}, "record= returned 'a': 'x'"),
    "record holds an array": ("record", lambda point: {"a": np.ones(3)}, {"a": 1.0}, "record= returned 'a': array"),
    "progress raises": ("progress", raises(Mine("deep")), None, "progress= raised Mine: deep"),
}


@pytest.mark.parametrize("name", FAILING)
def test_a_function_that_fails_is_named_and_the_rows_are_kept(name, tmp_path):
    kind, function, before, text = FAILING[name]
    branch = bf.trace(line(), bounds=(-1.0, 1.0), direction=1, **{kind: from_half(function, before)})
    whole = bf.trace(line(), bounds=(-1.0, 1.0), direction=1)
    assert branch.stop_reason[1] is StopReason.CALLBACK_FAILED and text in branch.ends[1].message
    assert "mend the function" in branch.ends[1].sentence.lower()
    p = branch.column("p")
    assert (p[:-1] <= 0.5).all() and p[-1] > 0.5  # the row at which it failed is one of them
    assert p.tolist() == whole.column("p")[:len(p)].tolist() and np.allclose(branch.column("u_0"), 2.0 * p, atol=1e-14)
    assert not branch.audit.ok and branch.audit.failed == (branch.ends[1].message,) and text in repr(branch.audit)
    branch.save(tmp_path / "branch.npz")
    assert Branch.load(tmp_path / "branch.npz", problem=line()).stop_reason[1] is StopReason.CALLBACK_FAILED
    assert branch.extend().stop_reason[1] is StopReason.BOUND  # the function mended, or left out


@pytest.mark.parametrize(("function", "text"), [
    (raises(Mine("deep")), "monitor 'level' raised Mine: deep"), (raises(TypeError("no")), "monitor 'level' raised TypeError: no"),
    (lambda solution: "5", "monitor 'level' must return a number, got '5'"),
    (lambda solution: None, "monitor 'level' must return a number, got None"),
    (lambda solution: np.zeros(2), "monitor 'level' must return a number, got array"),
    (lambda solution: 1j, "monitor 'level' must return a number, got 1j")])
def test_a_monitor_that_fails_is_named_and_the_rows_are_kept(function, text):
    branch = bf.trace(line(), bounds=(-1.0, 1.0), direction=1,
                      monitors={"level": from_half(function, 1.0), "zero": lambda solution: solution.p + 0.25})
    p = branch.column("p")
    assert branch.stop_reason[1] is StopReason.CALLBACK_FAILED and text in branch.ends[1].message
    assert 0.5 - 1e-6 < p[-1] <= 0.5 and not branch.audit.ok
    assert [point.parameter for point in branch.special_points.of("user")] == [pytest.approx(-0.25, abs=1e-12)]
    with pytest.raises(ValueError, match=r"monitor 'level'"):  # at the start there is no row yet
        bf.trace(line(), bounds=(-1.0, 1.0), monitors={"level": function})


@pytest.mark.parametrize("told", [None, False, np.False_, 0, 0.0])
def test_what_means_no_goes_on(told):
    assert bf.trace(line(), bounds=(-1.0, 1.0), stop=lambda point: told).stop_reason == (StopReason.BOUND, StopReason.BOUND)


@pytest.mark.parametrize("told", [True, np.True_, 1])
def test_what_means_yes_stops(told):
    branch = bf.trace(line(), bounds=(-1.0, 1.0), direction=1, stop=from_half(lambda point: told))
    assert branch.stop_reason[1] is StopReason.STOPPED and branch.audit.ok


def test_what_is_not_defined_is_recorded_as_nan():
    branch = bf.trace(line(), bounds=(-1.0, 1.0), record=from_half(lambda point: {"a": math.nan, "b": 2}, {"a": 1.0}))
    p, a = branch.column("p"), branch.column("a")
    assert branch.audit.ok and (np.isnan(a) == (p > 0.5)).all() and np.isnan(branch.column("b")[p <= 0.5]).all()


def test_a_first_row_is_kept_too():
    branch = bf.trace(line(), bounds=(-1.0, 1.0), record=raises(Mine("deep")))
    assert len(branch) == 1 and set(branch.stop_reason) == {StopReason.CALLBACK_FAILED}


def test_orbits_are_kept_as_well():
    seen = []

    def stop(point):
        seen.append(point.parameter)
        return math.nan if len(seen) == 4 else False
    branch = bf.trace(bf.find_orbit(bf.systems.impact_oscillator()), "omega", bounds=(0.4, 1.2), direction=1, stop=stop)
    assert branch.stop_reason[1] is StopReason.CALLBACK_FAILED and branch.column("omega").tolist() == seen
    assert all(orbit.success for orbit in branch.orbits)


@pytest.mark.parametrize("error", [TimeoutError("enough"), MemoryError("full")])
@pytest.mark.parametrize("kind", ["record", "stop", "progress"])
def test_limits_of_the_caller_pass_through(kind, error):
    with pytest.raises(type(error)):
        bf.trace(line(), bounds=(-1.0, 1.0), **{kind: raises(error)})
