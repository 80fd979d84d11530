"""What `trace` makes of its options: bounds, lengths of steps, the size of a parameter; and the direction of a first row."""
import math

import numpy as np
import pytest

from bifurc.continuation import Problem, trace
from bifurc.continuation import tracing as module
from bifurc.continuation.tracing import ordered_bounds, oriented, step_options, with_scale


@pytest.mark.parametrize("given, found", [(None, (-math.inf, math.inf)), ((1, 2), (1.0, 2.0)), ((2, 1), (1.0, 2.0)),
                                          ([-math.inf, 3], (-math.inf, 3.0)), ((math.inf, 0.0), (0.0, math.inf))])
def test_bounds_are_an_unordered_pair(given, found):
    assert ordered_bounds(given) == found


@pytest.mark.parametrize("given", [(1.0, 1.0), (math.nan, 1.0), (0.0, math.nan), (1.0,), (1.0, 2.0, 3.0), "ab", 3.0, (True, 2.0)])
def test_bounds_that_are_none_are_named(given):
    with pytest.raises(ValueError, match="bounds = .* must be two different numbers"):
        ordered_bounds(given)


def options(ds=0.1, ds_max=None, ds_min=1e-9, max_steps=10, stop=None, record=None):
    return step_options(-1.0, 2.0, ds, ds_max, ds_min, max_steps, stop, record, False)


def test_the_longest_step_follows_the_first_where_none_is_given():
    assert (options().ds, options().ds_max) == (0.1, max(module.DS_MAX, 0.1))
    large = options(ds=10.0 * module.DS_MAX)
    assert large.ds == large.ds_max == 10.0 * module.DS_MAX
    assert (options(ds=0.3, ds_max=0.2).ds, options(ds=0.3, ds_max=0.2).ds_max) == (0.2, 0.2)  # no step is longer than that
    same = options(ds_min=0.2, ds_max=0.2)
    assert same.ds_min == same.ds_max == 0.2 and (same.low, same.high, same.max_steps) == (-1.0, 2.0, 10)


@pytest.mark.parametrize("wrong, words", [
    ({"ds": 0.0}, "ds = 0.0 is not allowed; it must be"), ({"ds": math.inf}, "ds = "), ({"ds": True}, "ds = "),
    ({"ds_max": -1.0}, "ds_max = -1.0 is not allowed"), ({"ds_min": math.nan}, "ds_min = "), ({"ds_min": "a"}, "ds_min = "),
    ({"ds_min": 0.3, "ds_max": 0.2}, "ds_min = 0.3 must not exceed ds_max = 0.2"), ({"max_steps": -1}, "max_steps = .*a whole"),
    ({"max_steps": 1.0}, "max_steps = .*a whole"), ({"max_steps": True}, "max_steps = .*a whole")])
def test_lengths_that_are_none_are_named(wrong, words):
    with pytest.raises(ValueError, match=words):
        options(**wrong)


@pytest.mark.parametrize("name", ["stop", "record"])
def test_what_is_called_must_be_callable(name):
    with pytest.raises(ValueError, match=f"{name} = 3 is not allowed; it must be a function"):
        options(**{name: 3})
    assert getattr(options(**{name: len}), name) is len


class Line(Problem):
    """u = 2 p."""

    def residual(self, u, p):
        return u - 2.0 * p


@pytest.mark.parametrize("bounds, size", [((1.0, 4.0), 1.5), ((-math.inf, 4.0), 5.0), ((0.0, math.inf), 5.0)])
def test_the_size_of_a_parameter_is_half_the_way_between_its_bounds_or_its_own(bounds, size):
    problem = Line(-10.0, -5.0, scale_u=1.0)
    assert not math.isfinite(problem.scale[-1])
    found = with_scale(problem, *bounds)
    assert found.scale.tolist() == [1.0, size] and not math.isfinite(problem.scale[-1])
    near = with_scale(Line(0.0, 0.25, scale_u=1.0), -math.inf, math.inf)
    assert near.scale[-1] == 1.0
    given = Line(0.0, 0.0, scale_u=1.0, scale_p=7.0)
    assert with_scale(given, 0.0, 1.0) is given


def test_a_first_row_looks_along_a_growing_parameter_or_its_largest_unknown():
    for tangent, sign in (([0.1, -0.2, 0.9], 1.0), ([0.1, 0.2, -0.9], -1.0), ([0.6, -0.8, 0.0], -1.0), ([0.8, -0.6, 0.0], 1.0),
                          ([-0.8, 0.6, 0.1 * module.SLOPE], -1.0), ([0.8, -0.6, -0.1 * module.SLOPE], 1.0),
                          ([0.6, -0.8, 10.0 * module.SLOPE], 1.0)):
        assert np.array_equal(oriented(np.array(tangent)), sign * np.array(tangent))


@pytest.mark.parametrize("direction, ends", [(1, (0.5, 2.0)), (-1, (-1.0, 0.5)), (None, (-1.0, 2.0))])
def test_a_direction_is_that_of_the_parameter(direction, ends):
    branch = trace(Line(1.0, 0.5, scale_u=1.0, scale_p=1.0), bounds=(2.0, -1.0), direction=direction)
    p = branch.column("p")
    assert (p.min(), p.max()) == pytest.approx(ends, abs=1e-12) and np.all(np.diff(p) > 0.0)
    assert 0.5 in p  # the start is a row
    steps = np.diff(branch.column("s"))
    assert steps == pytest.approx(np.hypot(1.0, 2.0) * np.diff(p), rel=1e-9)
    few = trace(Line(1.0, 0.5, scale_u=1.0, scale_p=1.0), bounds=(-1.0, 2.0), direction=direction, max_steps=0)
    assert len(few) == 1 and few.column("p")[0] == 0.5


@pytest.mark.parametrize("audit", ["full", "fast"])
@pytest.mark.parametrize("lengths", [{}, {"ds": 0.02, "ds_min": 1e-7, "ds_max": 0.05}])
def test_a_branch_goes_on_with_the_options_it_was_traced_with(audit, lengths):
    """On a line of slope 2: the rows there were stay, and those behind them follow the same rules unless told otherwise."""
    class Line(Problem):
        def residual(self, u, p):
            return u - 2.0 * p
    branch = trace(Line([0.0], 0.0, scale_u=1.0, scale_p=1.0), bounds=(-0.5, 0.5), audit=audit, **lengths)
    longer = branch.extend(bounds=(-1.0, 2.0))
    names = ("ds", "ds_min", "ds_max", "audit")
    assert [longer.options[name] for name in names] == [branch.options[name] for name in names]
    assert longer.options["audit"] == audit and [longer.options[name] for name in lengths] == list(lengths.values())
    p = longer.column("p")
    assert {p[0], p[-1]} == {-1.0, 2.0} and set(branch.column("p")) <= set(p)
    np.testing.assert_allclose(longer.column("u_0"), 2.0 * p, atol=1e-12)
    chords = np.hypot(np.diff(p), 2.0 * np.diff(p))
    assert chords.max() <= branch.options["ds_max"] * (1.0 + 1e-9)
    shorter = branch.extend(bounds=(-1.0, 2.0), ds_max=0.01)
    assert shorter.options["ds_max"] == 0.01 and len(shorter) > len(longer)
    with pytest.raises(ValueError, match="outside the bounds"):
        branch.extend(bounds=(-0.2, 2.0))
