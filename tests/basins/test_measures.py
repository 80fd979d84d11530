"""Numbers of a basin map against their definitions written out: entropies, label noise, errors of fractions, exponents, periods."""
import itertools
import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import minimize

import bifurc as bf
from bifurc.basins.maps import label_noise
from bifurc.basins.maps import uncertainty_exponent as uncertainty
from bifurc.basins.maps.entropy import basin_entropy
from bifurc.basins.maps.label_noise import EXTRA, FEWEST, LADDER, LabelNoise, extrapolated, measure
from bifurc.basins.maps.refinement import mixed, prediction
from bifurc.basins.maps.reliability import Reliability, ReliabilityKind, fraction_errors, reliability
from bifurc.basins.maps.uncertainty_exponent import fitted
from bifurc.basins.sweeps.sections import groups, period_of, settled
from bifurc.ensemble.outcomes import NO_START, CellState
from bifurc.ensemble.period_map import Kernel

# entropy

@pytest.mark.parametrize(("shape", "side"), [((17,), 4), ((11, 7), 3), ((5, 9, 4), 2), ((6, 6), 1)])
@pytest.mark.parametrize("some", [False, True])
def test_entropy_is_that_of_the_boxes(shape, side, some, rng):
    labels = rng.integers(-1, 3, shape)
    labels[:side] = 1  # some boxes hold one label
    starts = rng.random(shape) < 0.4 if some else None
    total, filled, several = 0.0, 0, 0
    for corner in itertools.product(*(range(0, n - side + 1, side) for n in shape)):
        place = tuple(slice(c, c + side) for c in corner)
        values = labels[place].ravel() if starts is None else labels[place][starts[place]]
        if values.size:
            shares = np.unique(values, return_counts=True)[1] / values.size
            total -= float((shares * np.log(shares)).sum())
            filled, several = filled + 1, several + (len(shares) > 1)
    found = basin_entropy(labels, side, starts)
    assert (found.boxes, found.mixed, found.side) == (filled, several, side)
    assert found.basin == pytest.approx(total / max(filled, 1), abs=1e-13)
    assert found.boundary == pytest.approx(total / max(several, 1), abs=1e-13)


def test_a_boundary_of_three_labels_that_mix_is_fractal_and_a_line_is_not():
    three = np.tile([[0, 1, 2], [1, 2, 0], [2, 0, 1]], (3, 3))
    assert basin_entropy(three, 3).boundary == pytest.approx(math.log(3.0)) and basin_entropy(three, 3).fractal is True
    two = np.zeros((6, 6), int)
    two[:, 3:] = 1
    assert basin_entropy(two, 2).boundary == pytest.approx(math.log(2.0)) and basin_entropy(two, 2).fractal is None
    assert basin_entropy(two, 2).basin == pytest.approx(math.log(2.0) / 3.0)
    for side, said in ((7, "not one box fits"), (0, "at least 1"), (True, "whole number"), (2.0, "whole number")):
        with pytest.raises(ValueError, match=said):
            basin_entropy(two, side)


# label noise

def test_noise_is_extrapolated_by_a_weighted_line():
    """Through counts of changed labels, in logarithms; weights of counting and of the law itself."""
    n = 4000
    e = np.array(LADDER[:9])
    counts = np.round(n * 0.4 * e**0.3)
    found = extrapolated(e, counts, n, 1e-15)
    good = (counts >= FEWEST) & (counts / n <= label_noise.SMALL)
    good &= np.cumsum((counts >= FEWEST)[::-1])[::-1] <= label_noise.RUNGS
    x, y = np.log(e[good]), np.log(counts[good] / n)
    w = 1.0 / ((1.0 - counts[good] / n) / counts[good] + EXTRA**2)
    slope, level = np.polyfit(x, y, 1, w=np.sqrt(w))
    assert found.exponent == pytest.approx(slope, rel=1e-10) and 0.25 < slope < 0.35
    assert found.at_error == pytest.approx(math.exp(level + slope * math.log(1e-15)), rel=1e-9)
    spread = w @ (x - (w @ x) / w.sum())**2
    assert found.exponent_error == pytest.approx(spread**-0.5, rel=1e-10)
    np.testing.assert_array_equal(found.changed, counts / n)
    assert (found.samples, found.size) == (n, 1e-15)
    np.testing.assert_array_equal(found.perturbations, e)


def test_saturated_fractions_are_left_out_only_where_three_are_left():
    e, n = np.array([1e-2, 1e-3, 1e-4, 1e-5]), 1000
    steep = extrapolated(e, np.array([480.0, 140.0, 42.0, 12.0]), n)  # three below .15
    assert steep.exponent == pytest.approx(math.log10(140.0 / 12.0) / 2.0, abs=0.03)
    counts = np.array([480.0, 400.0, 42.0, 12.0])  # two below: all are fitted
    w = 1.0 / ((1.0 - counts / n) / counts + EXTRA**2)
    assert extrapolated(e, counts, n).exponent == pytest.approx(np.polyfit(np.log(e), np.log(counts / n), 1, w=np.sqrt(w))[0])


def test_an_exponent_lies_between_zero_and_one():
    e, n = np.array([1e-2, 1e-3, 1e-4]), 10**6
    above = extrapolated(e, np.array([1e5, 1e3, 10.0]), n, 1e-16)
    assert above.exponent == 1.0
    below = extrapolated(e, np.array([100.0, 200.0, 400.0]), n, 1e-16)
    assert below.exponent == 0.0 and 1e-4 < below.at_error < 4e-4
    sure = extrapolated(e, np.array([9e5, 9e5, 9e5]), n, 1e-16)
    assert sure.at_error == pytest.approx(0.9, rel=1e-3) and sure.exponent == pytest.approx(0.0, abs=1e-9)


def test_where_few_labels_change_a_smooth_boundary_is_assumed():
    """None: at most 3 of n at the largest, 95 % sure; one or two rungs with enough: the lower; else the lowest with any."""
    e, n, error = np.array([1e-2, 1e-3, 1e-4]), 1000, 1e-15
    for counts, want in (((0, 0, 0), 3.0 / n * error / 1e-2), ((40, 4, 0), 40.0 / n * error / 1e-2),
                         ((3, 2, 0), 2.0 / n * error / 1e-3), ((300, 30, 0), 30.0 / n * error / 1e-3),
                         ((300, 30, 9), 30.0 / n * error / 1e-3)):
        found = extrapolated(e, np.array(counts, float), n, error)
        assert (found.exponent, found.exponent_error, found.size) == (1.0, 0.0, error)
        np.testing.assert_allclose(found.at_error, want, rtol=1e-12)
    assert extrapolated(e, np.array([300.0, 30.0, 10.0]), n, error).exponent_error > 0.0  # ten are enough


def test_starts_are_perturbed_by_the_sizes_of_the_ladder_in_random_directions(rng):
    """A straight boundary in the second component; the first is not perturbed, starts beyond a stop say nothing."""
    starts = rng.uniform(-1.0, 1.0, (40000, 2))
    steps, seen = np.array([0.0, 2.0]), []

    def relabel(moved):
        away = (moved - starts) / np.array([1.0, 2.0])
        assert not away[:, 0].any()
        seen.append(np.linalg.norm(away, axis=1))
        return np.where(moved[:, 0] > 0.5, -2, (moved[:, 1] > 0.0).astype(int))

    labels = (starts[:, 1] > 0.0).astype(int)
    found = measure(relabel, starts, labels, steps, np.random.default_rng(0), 1e-10)
    assert len(seen) == len(found.perturbations) >= 4
    for size, step in zip(LADDER, seen, strict=False):
        np.testing.assert_allclose(step, size, rtol=1e-10)
    # 3/4 of the starts are seen; the boundary has a density of 1/2 per length and is met from both sides by half of the steps
    np.testing.assert_allclose(found.changed[:3], 0.75 * np.array(LADDER[:3]) * 2.0 / 2.0, rtol=0.25)
    assert found.exponent == pytest.approx(1.0, abs=0.1) and 0.3e-10 < found.at_error < 1.5e-10
    assert found.changed[-1] * 40000 < FEWEST <= found.changed[-2] * 40000
    again = LabelNoise.from_record(found.to_record())
    assert repr(again) == repr(found)
    np.testing.assert_array_equal(again.changed, found.changed)


def test_perturbations_in_several_components_have_the_size_of_the_ladder(rng):
    starts, steps = rng.normal(size=(50, 3)), np.array([0.5, 0.0, 4.0])

    def relabel(moved):
        away = (moved - starts)[:, [0, 2]] / steps[[0, 2]]
        np.testing.assert_allclose(np.linalg.norm(away, axis=1), LADDER[relabel.calls], rtol=1e-9)
        assert np.ptp(away[:, 0]) > 0.0 and np.ptp(away[:, 1]) > 0.0
        relabel.calls += 1
        return np.zeros(50, int)
    relabel.calls = 0
    found = measure(relabel, starts, np.zeros(50, int), steps, rng)
    assert relabel.calls == 3
    np.testing.assert_allclose(found.at_error, 3.0 / 50 * label_noise.ROUNDING / LADDER[0], rtol=1e-12)


# reliability

def test_errors_of_fractions_are_those_of_draws_beside_a_boundary(rng):
    labels, starts = rng.integers(0, 3, (7, 9)), rng.random((7, 9)) < 0.8
    found = fraction_errors(labels, starts)
    for label in range(3):
        variance = 0.0
        for i, j in np.argwhere(starts):
            rows, columns = (np.clip(np.arange(k - 1, k + 2), 0, n - 1) for k, n in ((i, 7), (j, 9)))
            around = np.ix_(rows, columns)
            p = ((labels == label) & starts)[around].sum() / starts[around].sum()
            variance += p * (1.0 - p)
        assert found[label] == pytest.approx(math.sqrt(variance) / starts.sum(), rel=1e-9)


def judged(wrong=0.0, size=1e-12, unresolved=0, cells=100, outside=0, lost=0):
    """A map of so many cells of which the last ones have no label, diverged, or are no starts."""
    labels, states = np.zeros(cells, int), np.zeros(cells, int)
    labels[:unresolved], states[:unresolved] = -1, CellState.UNSETTLED.code
    labels[unresolved:unresolved + lost], states[unresolved:unresolved + lost] = -1, CellState.DIVERGED.code
    if outside:
        labels[-outside:], states[-outside:] = -1, CellState.OUTSIDE.code
    starts = states != CellState.OUTSIDE.code
    total = max(int(starts.sum()), 1)
    return reliability(SimpleNamespace(
        labels=labels, states=states, starts=starts, label_uncertainty=wrong / total,
        noise=SimpleNamespace(exponent=0.25, size=size),
        fractions={0: float((labels == 0).sum() / total), 7: 0.0, -1: unresolved / total, CellState.DIVERGED: 0.0}))


@pytest.mark.parametrize(("options", "kind", "words"), [
    ({}, "CELLS", ["Every label can be trusted: an error of 1e-12 a period is expected to change 0e+00 of 100.",
                   "Fractions: 1.0000 +- 0, 0.0000 +- 0."]),
    ({"wrong": 0.49, "size": 5e-16}, "CELLS", ["rounding is expected to change 5e-01 of 100"]),
    ({"wrong": 0.51, "cells": 1000}, "MOST_CELLS", ["but for about 1 of 1000 beside boundaries"]),
    ({"wrong": 0.99, "cells": 1000, "unresolved": 10}, "MOST_CELLS", ["about 1 of 1000", "10 of 1000 starts (1 %) have no"]),
    ({"wrong": 1.01, "cells": 1000}, "FRACTIONS", ["No single label is promised", "0.1 % of 1000 (uncertainty exponent 0.25)",
                                                   "Fractions hold: 1.0000"]),
    ({"wrong": 40.0}, "FRACTIONS", ["change 40 % of 100"]),
    ({"unresolved": 1}, "CELLS", ["Every label that is there can be trusted", "1 of 100 starts (1 %) have no label."]),
    ({"unresolved": 2, "wrong": 0.2}, "UNRESOLVED", ["No label is promised. 2 of 100 starts (2 %) have no label.",
                                                     "Of the others an error of 1e-12 a period is expected to change 0.2.",
                                                     "Fractions, lower bounds: 0.9800"]),
    ({"lost": 30}, "CELLS", ["Every label can be trusted"]),
    ({"outside": 100}, "NO_STARTS", ["No cell of the grid is a start"]),
    ({"outside": 99, "unresolved": 1}, "UNRESOLVED", ["1 of 1 starts (1e+02 %)"]),
])
def test_kinds_and_statements_of_reliability(options, kind, words):
    found = judged(**options)
    assert found.kind is ReliabilityKind[kind]
    assert found.wrong == pytest.approx(options.get("wrong", 0.0)) and found.unresolved == options.get("unresolved", 0)
    assert found.cells == options.get("cells", 100) - options.get("outside", 0)
    assert found.exponent == 0.25 and found.size == options.get("size", 1e-12)
    for text in words:
        assert text in found.statement
    assert ("have no label" in found.statement) == (found.unresolved > 0)
    assert CellState.DIVERGED not in found.fractions and set(found.fractions) == {0, 7, -1}
    assert found.fractions[7] == (0.0, 0.0)  # an attractor that no cell leads to


def test_a_statement_of_no_fractions():
    assert Reliability(ReliabilityKind.CELLS, 0.0, 5, 1.0, 1e-16, {-1: (1.0, 0.0)}).statement.endswith("Fractions: none.")


# uncertainty exponent

def test_the_exponent_is_that_of_the_likeliest_power_law(rng):
    sizes, totals = np.geomspace(1e-4, 1e-1, 8), np.full(8, 20000.0)
    counts = rng.binomial(20000, np.minimum(0.9 * sizes**0.35, 0.999)).astype(float)

    def against(p):
        law = np.exp(p[1] + p[0] * np.log(sizes))
        return -(counts * np.log(law) + (totals - counts) * np.log1p(-law)).sum()
    best = minimize(against, [0.35, math.log(0.9)], method="Nelder-Mead", options={"xatol": 1e-10, "fatol": 1e-10, "maxiter": 4000})
    exponent, error, misfit = fitted(sizes, counts, totals)
    assert exponent == pytest.approx(best.x[0], abs=1e-5)
    law = np.exp(best.x[1] + best.x[0] * np.log(sizes))
    chi = math.sqrt((totals * (counts / totals - law)**2 / (law * (1.0 - law))).sum() / 6.0)
    assert misfit == pytest.approx(chi, rel=1e-4)
    w = totals * law / (1.0 - law)
    x = np.log(sizes)
    assert error == pytest.approx((w @ (x - w @ x / w.sum())**2)**-0.5 * max(chi, 1.0), rel=1e-4)
    assert abs(exponent - 0.35) < 4.0 * error
    assert fitted(sizes, np.array([0, 0, 0, 0, 0, 3, 200, 300.0]), totals) == (1.0, 0.0, 0.0)
    few = uncertainty.FEWEST
    assert fitted(sizes, np.array([0, 0, 0, 0, 0, few - 1, 200, 300.0]), totals) == (1.0, 0.0, 0.0)
    assert fitted(sizes, np.array([0, 0, 0, 0, 0, few, 200, 300.0]), totals)[1] > 0.0


class Stripes:
    """A map of stripes of width 1/4 along q0 in a region [0, 2] x [0, 1], in which starts beyond q0 = 1.5 are none."""

    def __init__(self, attractors=("one", "two")):
        self.attractors, self.system = attractors, None
        self.grid = SimpleNamespace(low=np.array([0.0, 0.0]), high=np.array([2.0, 1.0]), names=("q0", "v0"))
        self.asked = []

    def labeller(self, workers, executor):
        self.given = workers, executor

        def label(points):
            self.asked.append(points.copy())
            return np.where(points[:, 0] > 1.5, NO_START, np.floor(4.0 * points[:, 0]).astype(int) % 2)
        return label


def test_starts_and_partners_of_an_uncertainty_exponent():
    """Straight boundaries, of density 4 a length: a step of size e passes one with the mean chance 4 e 2/pi."""
    stripes = Stripes()
    found = uncertainty.uncertainty_exponent(stripes, 1e-3, 1e-1, rungs=5, samples=20000, seed=3, workers=2, executor="here")
    assert stripes.given == (2, "here") and len(stripes.asked) == 6
    first = stripes.asked[0]
    assert first.shape == (20000, 2) and (first.min(axis=0) >= 0.0).all() and (first.max(axis=0) <= [2.0, 1.0]).all()
    assert first[:, 0].max() > 1.99 and first[:, 1].max() > 0.99
    starts = first[first[:, 0] <= 1.5]
    sizes = np.geomspace(1e-3, 1e-1, 5)
    np.testing.assert_allclose(found.perturbations, sizes)
    own = np.floor(4.0 * starts[:, 0]).astype(int) % 2
    for size, partners, share in zip(sizes, stripes.asked[1:], found.changed, strict=True):
        np.testing.assert_allclose(np.linalg.norm(partners - starts, axis=1), size, rtol=1e-8)
        seen = partners[:, 0] <= 1.5
        theirs = np.floor(4.0 * partners[:, 0]).astype(int) % 2
        assert share == pytest.approx(np.mean((theirs != own)[seen]), abs=1e-15)
    assert found.samples == len(starts) and found.exponent == pytest.approx(1.0, abs=0.05)
    again = uncertainty.uncertainty_exponent(Stripes(), 1e-3, 1e-1, rungs=5, samples=20000, seed=3)
    np.testing.assert_array_equal(again.changed, found.changed)
    assert found.dimensions == 2
    other = uncertainty.uncertainty_exponent(Stripes(), 1e-3, 1e-1, rungs=5, samples=20000, seed=4)
    assert (other.changed != found.changed).any()


def test_one_attractor_beside_starts_that_reach_none_has_a_boundary_too():
    """The same stripes, every second of them without a label: the same pairs differ."""
    class Lonely(Stripes):
        def labeller(self, workers, executor):
            label = super().labeller(workers, executor)
            return lambda points: np.where(points[:, 0] > 1.5, NO_START, label(points) - 1)
    numbers = [uncertainty.uncertainty_exponent(stripes, 1e-3, 1e-1, rungs=5, samples=2000, seed=3)
               for stripes in (Stripes(), Lonely(("one",)))]
    np.testing.assert_array_equal(numbers[0].changed, numbers[1].changed)
    assert numbers[0].samples == numbers[1].samples and numbers[0].exponent == numbers[1].exponent
    with pytest.raises(ValueError, match="no attractor"):
        uncertainty.uncertainty_exponent(Lonely(()), samples=100)


@pytest.mark.parametrize(("slow", "count"), [(True, uncertainty.SOME), (False, uncertainty.MANY)])
def test_the_number_of_starts_follows_the_speed_of_the_map(slow, count, monkeypatch):
    kernel = Kernel.SIMULATION if slow else Kernel.BATCH
    monkeypatch.setattr(uncertainty, "PeriodMap", lambda system: SimpleNamespace(kernel=kernel))
    stripes = Stripes()
    found = uncertainty.uncertainty_exponent(stripes)
    assert len(stripes.asked[0]) == count and len(found.perturbations) == uncertainty.RUNGS
    assert (found.perturbations[0], found.perturbations[-1]) == pytest.approx(uncertainty.RANGE)


@pytest.mark.parametrize(("options", "said"), [
    ({"low": 0.0}, "0 < low < high"), ({"low": 0.1, "high": 0.1}, "0 < low < high"), ({"high": np.inf}, "0 < low < high"),
    ({"rungs": 2}, "rungs = 2 .* at least 3"), ({"samples": 0}, "samples = 0 .* at least 1"), ({"rungs": True}, "rungs = True"),
    ({"samples": 10.0}, "samples = 10.0"),
])
def test_bad_requests_of_an_exponent_are_named(options, said):
    with pytest.raises(ValueError, match=said):
        uncertainty.uncertainty_exponent(Stripes(), **{"samples": 10, **options})
    with pytest.raises(ValueError, match="has no attractor"):
        uncertainty.uncertainty_exponent(Stripes(()), samples=10)


def test_a_bad_law_has_a_larger_error():
    sizes, totals = np.geomspace(1e-4, 1e-1, 6), np.full(6, 20000.0)
    counts = 20000.0 * 0.9 * sizes**0.35 * np.array([1.5, 0.7, 1.4, 0.7, 1.4, 0.7])
    _, error, misfit = fitted(sizes, counts, totals)
    _, best, fine = fitted(sizes, 20000.0 * 0.9 * sizes**0.35, totals)
    assert misfit > 5.0 and error > 5.0 * best and fine < 1e-6


# rows of section points

class Shifts:
    """A period map that turns the first component round a circle and lets a start end when it is asked to."""

    def __init__(self, steps, ends=()):
        self.steps, self.ends, self.done = steps, dict(ends), 0

    def apply(self, X, periods):
        self.done += periods
        last = np.array([self.ends.get(round(float(x)), 10**9) for x in X[:, 1]])
        outcomes = np.where(last <= self.done, CellState.DIVERGED.code, 0)
        ends = X.copy()
        ends[:, 0] = (X[:, 0] + periods) % self.steps
        return SimpleNamespace(ends=ends, outcomes=outcomes, impacts=np.full(len(X), 2 * periods))


def test_rows_of_section_points_behind_a_transient():
    X = np.array([[0.0, 0.0], [1.0, 1.0], [0.0, 2.0], [2.0, 3.0]])
    start = X.copy()
    points, outcomes, impacts = settled(Shifts(5, {1: 4, 2: 7}), X, 4, 6)
    np.testing.assert_array_equal(X, start)
    np.testing.assert_array_equal(points[0, :, 0], (4 + np.arange(1, 7)) % 5)
    np.testing.assert_array_equal(points[3, :, 0], (6 + np.arange(1, 7)) % 5)
    assert np.isnan(points[1:3]).all()
    assert outcomes.tolist() == [0, CellState.DIVERGED.code, CellState.DIVERGED.code, 0]
    assert impacts.tolist() == [12, 0, 6, 12]
    points, _, impacts = settled(Shifts(5), X, 0, 2)
    np.testing.assert_array_equal(points[:, :, 0], [[1, 2], [2, 3], [1, 2], [3, 4]])
    assert impacts.tolist() == [4, 4, 4, 4]
    assert settled(Shifts(5, {0: 1, 1: 1, 2: 1, 3: 1}), X, 0, 3)[1].all()


def test_periods_of_rows():
    scale, far = np.array([1.0, 100.0]), np.arange(12.0)
    row = np.column_stack([np.tile([0.0, 1.0, 5.0], 4), np.zeros(12)])
    assert period_of(row, scale, 1e-6) == 3
    assert period_of(np.column_stack([np.zeros(12), far * 1e-9]), scale, 1e-6) == 1
    assert period_of(np.column_stack([far, far]), scale, 1e-6) == 0
    assert period_of(np.column_stack([np.tile(np.arange(6.0), 2), np.zeros(12)]), scale, 1e-6) == 6
    assert period_of(np.column_stack([np.tile(np.arange(7.0), 2)[:12], np.zeros(12)]), scale, 1e-6) == 0  # not seen twice
    late = row.copy()
    late[0, 0] = 9.0  # it was not there yet
    assert period_of(late, scale, 1e-6) == 0
    assert period_of(np.column_stack([np.zeros(12), np.tile([0.0, 5e-5], 6)]), scale, 1e-6) == 1  # in units of the scale
    assert period_of(np.column_stack([np.tile([0.0, 5e-5], 6), np.zeros(12)]), scale, 1e-6) == 2


def test_rows_are_grouped_by_the_points_they_pass():
    scale, tolerance = np.array([2.0, 1.0]), 1e-3
    cycles = {"a": [[0, 0], [1, 0]], "shifted": [[1, 0.005], [0, 0.005]], "b": [[0, 0], [3, 0]], "one": [[0, 0], [0, 0]],
              "chaos": [[0.3, 0.2], [0.1, 7.0]], "far": [[0, 0.02], [1, 0.02]], "other chaos": [[9, 9], [8, 8]]}
    periods = {"one": 1, "chaos": 0, "other chaos": 0}
    names = ["a", "chaos", "shifted", "b", "one", "far", "other chaos"]
    points = np.array([np.tile(cycles[name], (3, 1)) for name in names], float)
    found = groups(points, np.array([periods.get(name, 2) for name in names]), scale, tolerance)
    assert found.tolist() == [0, 1, 0, 2, 3, 4, 1]  # the last point decides: (3, 0) is none of the first row's
    assert groups(np.empty((0, 4, 2)), np.empty(0, int), scale, tolerance).tolist() == []


# neighbours

def test_lattice_points_beside_another_label(rng):
    codes = rng.integers(0, 2, (5, 8))
    for periodic in ((), ("q0",), ("q0", "v0")):
        grid = bf.Grid(q0=(0.0, 1.0, 5), v0=(0.0, 1.0, 8), periodic=periodic)
        found = mixed(codes, grid)
        for i, j in np.ndindex(5, 8):
            near = set()
            for a, b in itertools.product((-1, 0, 1), repeat=2):
                place = [i + a, j + b]
                for axis, name in enumerate(("q0", "v0")):
                    n = codes.shape[axis]
                    place[axis] = place[axis] % n if name in periodic else min(max(place[axis], 0), n - 1)
                near.add(int(codes[tuple(place)]))
            assert found[i, j] == (len(near) > 1)


def test_the_predicted_share_is_that_of_halving_the_step():
    """A share p of lattice points beside a boundary that falls like step^alpha: 1/64 of the cells first, then of each halved
    lattice the new points where the one before is mixed."""
    grid = bf.Grid(q0=(0, 1, 320), v0=(0, 1, 320))
    codes = np.zeros((40, 40), int)
    codes[::4, ::4] = 1  # every point but those in the middle of four
    share, exponent = prediction(codes, grid, 8)
    fine, coarse = (mixed(codes[::k, ::k], grid).mean() for k in (1, 2))
    alpha = min(max(math.log2(coarse / fine), 0.0), 1.0)
    assert exponent == pytest.approx(alpha) and 0.0 < alpha < 1.0
    total, p = 1.0 / 64.0, fine
    for step in (4, 2, 1):
        total += p * (step**-2.0 - (2 * step)**-2.0)
        p *= 2.0**-alpha
    assert share == pytest.approx(min(total, 1.0))
