"""Sweeps on stand-in maps whose motions are known: diagrams, charts, ramps and attractor sweeps against loops written out."""
import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc.basins.attractors import matching, records
from bifurc.basins.sweeps import attractor_sweep as sweeps
from bifurc.basins.sweeps import chart as charts
from bifurc.basins.sweeps import diagram as diagrams
from bifurc.basins.sweeps import points as one_value
from bifurc.basins.sweeps import ramp as ramps
from bifurc.basins.sweeps.diagram import RESTARTED
from bifurc.basins.sweeps.ramp import Ramp, jumps_of
from bifurc.basins.sweeps.sections import groups, period_of, settled
from bifurc.continuation.branches.branch import Branch
from bifurc.continuation.branches.special import SpecialPoint
from bifurc.continuation.kinds import SpecialPointKind
from bifurc.ensemble.outcomes import CellState
from bifurc.ensemble.period_map import MAPPED

STORY = bf.systems.impact_oscillator()
LOST = CellState.DIVERGED.code


class StandIn:
    """A period map given as a function ``step(system, x) -> (image, impacts, outcome)`` of one state."""

    step = None

    def __init__(self, system, max_events=None, work=None):
        self.system = system

    def apply(self, X, periods):
        ends, outcomes, impacts = X.copy(), np.full(len(X), MAPPED), np.zeros(len(X), np.int64)
        for i in range(len(X)):
            for _ in range(periods):
                if outcomes[i] != MAPPED:
                    break
                ends[i], hits, outcomes[i] = type(self).step(self.system, ends[i])
                impacts[i] += hits
        return SimpleNamespace(ends=ends, outcomes=outcomes, impacts=impacts)


def stand_in(step):
    return type("Map", (StandIn,), {"step": staticmethod(step)})


# section points

@pytest.mark.parametrize("transient", [0, 1, 5])
def test_points_after_a_transient_are_the_next_images(transient):
    def step(_, x):
        return x * [0.5, -1.0] + [1.0, 0.0], 1 + (x[1] > 0.0), LOST if x[0] > 9.0 else MAPPED
    X = np.array([[0.0, 1.0], [4.0, -2.0], [10.0, 0.0], [2.0, 3.0]])
    first = X.copy()
    points, outcomes, impacts = settled(stand_in(step)(STORY), X, transient, 4)
    np.testing.assert_array_equal(X, first)
    for k, x in enumerate(first):
        if x[0] > 9.0:
            assert outcomes[k] == LOST and np.isnan(points[k]).all()
            continue
        want, hits = [], 0
        for n in range(transient + 4):
            x, more, _ = step(None, x)
            if n >= transient:
                want.append(x)
                hits += more
        np.testing.assert_array_equal(points[k], want)
        assert outcomes[k] == MAPPED and impacts[k] == hits


def test_a_motion_that_ends_while_it_is_recorded_has_no_points_and_the_others_keep_theirs():
    def step(_, x):
        return x + [1.0, 0.0], 1, LOST if x[0] >= 3.0 else MAPPED
    points, outcomes, impacts = settled(stand_in(step)(STORY), np.array([[1.0, 0.0], [-9.0, 5.0]]), 1, 4)
    assert outcomes.tolist() == [LOST, MAPPED] and np.isnan(points[0]).all()
    assert points[1, :, 0].tolist() == [-7.0, -6.0, -5.0, -4.0] and (points[1, :, 1] == 5.0).all() and impacts[1] == 4


@pytest.mark.parametrize("n", [1, 2, 3, 5, 8])
def test_the_least_period_is_found_whatever_its_phase_and_the_units(n, rng):
    cycle = rng.normal(size=(n, 2))
    for unit in (1.0, 1e3):
        row = np.tile(cycle, (2 * 16 // n + 2, 1))[3:3 + 16] * unit
        scale = np.full(2, unit)
        assert period_of(row, scale, 1e-6) == n
        near = row + 0.3e-6 * unit * rng.uniform(-1.0, 1.0, row.shape)
        assert period_of(near, scale, 1e-6) == n
        assert period_of(row[:2 * n], scale, 1e-6) == n and period_of(row[:2 * n - 1], scale, 1e-6) == 0  # to be seen twice
        moved = row.copy()
        moved[0, 1] += 3e-6 * unit  # the last ones repeat, the first not yet
        assert period_of(moved, scale, 1e-6) == 0


def test_rows_through_the_same_points_are_one_motion(rng):
    cycles = {1: rng.normal(size=(3, 2)), 2: rng.normal(size=(3, 2)), 3: rng.normal(size=(2, 2))}
    order = [1, 2, 1, 3, 2, 0, 3, 0]
    rows = np.array([rng.normal(size=(8, 2)) if k == 0 else np.tile(np.roll(cycles[k], i, axis=0), (5, 1))[:8]
                     for i, k in enumerate(order)])
    periods = np.array([0 if k == 0 else len(cycles[k]) for k in order])
    assert groups(rows, periods, np.ones(2), 1e-5).tolist() == [0, 1, 0, 2, 1, 3, 2, 3]
    thin = np.array([1.0, 1e-9])  # a component whose size is nothing tells them all apart
    moved = rows + np.arange(8)[:, None, None] * np.array([0.0, 1e-9])
    assert groups(moved[[0, 2]], periods[[0, 2]], thin, 1e-5).tolist() == [0, 1]
    assert groups(moved[[0, 2]], periods[[0, 2]], np.ones(2), 1e-5).tolist() == [0, 0]


# diagrams

def carried(values, start, first, transient, keep, step):
    """Return (points, outcomes, impacts) along values, written out."""
    rows, codes, hits = [], [], []
    for value in values:
        for restarted, begin in enumerate((start, first)):
            x, kept, count, outcome = begin, [], 0, MAPPED
            for n in range(transient + keep):
                x, more, outcome = step(STORY.with_parameters(gap=value), x)
                if outcome != MAPPED:
                    break
                if n >= transient:
                    kept.append(x)
                    count += more
            code = outcome + RESTARTED * restarted
            if outcome == MAPPED:
                break
        rows.append(kept if outcome == MAPPED else np.full((keep, 2), np.nan))
        codes.append(code)
        hits.append(count / keep)
        start = kept[-1] if outcome == MAPPED else first
    return np.array(rows), codes, hits


@pytest.mark.parametrize("chunk", [1, 2, 9])
def test_a_diagram_carries_each_start_from_value_to_value_both_ways(chunk, monkeypatch):
    """x -> 0.6 x + gap remembers the value before; a motion above 1.9 ends, and at 0.5 one that begins above 1."""
    def step(system, x):
        gap = system.parameter("gap")
        y = np.array([0.1 * x[0] if gap == 0.5 else 0.6 * x[0] + gap, -x[1]])
        return y, int(x[0] > 0.02), LOST if y[0] > 1.9 or (gap == 0.5 and x[0] > 1.0) else MAPPED
    monkeypatch.setattr(diagrams, "PeriodMap", stand_in(step))
    values, starts = np.array([-0.4, 0.1, 0.5, 0.8, 0.85]), np.array([[0.3, 1.0], [-0.6, 0.0]])
    found = bf.bifurcation_diagram(STORY, "gap", values[::-1], starts, transient=2, keep=4, chunk=chunk, workers=1)
    np.testing.assert_array_equal(found.values, values)
    assert found.directions == ("up", "down")
    for d, order in enumerate((values, values[::-1])):
        back = slice(None, None, 1 if d == 0 else -1)
        for k, start in enumerate(starts):
            points, codes, hits = carried(order, start, start, 2, 4, step)
            np.testing.assert_allclose(found.points[d, back, k], points, rtol=1e-14)
            assert found.outcomes[d, back, k].tolist() == codes
            alive = np.array(codes) % RESTARTED == MAPPED
            np.testing.assert_allclose(found.impacts[d, back, k][alive], np.array(hits)[alive])
            assert not found.periods[d, back, k][~alive].any()
    assert (found.outcomes > RESTARTED).any() and (found.outcomes == RESTARTED).any() and (found.outcomes == 0).any()
    lost = int(np.count_nonzero(found.outcomes % RESTARTED))
    assert f"{lost} motions ended" in repr(found)


def test_a_diagram_tells_the_period_of_every_value(monkeypatch):
    """A turn by 2 pi / amplitude."""
    def step(system, x):
        a = 2.0 * np.pi / system.parameter("amplitude")
        return np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) @ x, 0, MAPPED
    monkeypatch.setattr(diagrams, "PeriodMap", stand_in(step))
    found = bf.bifurcation_diagram(STORY, "amplitude", [2.0, 3.0, 4.0, np.pi, 5.0], [1.0, 0.0], transient=3, keep=9, workers=1)
    assert found.periods[0, :, 0].tolist() == [2, 3, 0, 4, 0] and (found.periods[0] == found.periods[1]).all()
    several = bf.bifurcation_diagram(STORY, "amplitude", [2.0], [[1.0, 0.0], [0.0, 0.0]], transient=3, keep=9, workers=1)
    assert several.periods[:, 0].tolist() == [[2, 1], [2, 1]]


# charts

def turning(system, x):
    """Starts within a radius of 1.5 go to one of 1, the others to one of 2; a period is amplitude turns, twice that outside; an
    impact is made right of the axis."""
    r = np.hypot(*x)
    n = int(system.parameter("amplitude")) * (1 if r < 1.5 else 2)
    a = 2.0 * np.pi / n
    x = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) @ x / r * (1.0 if r < 1.5 else 2.0)
    angle = np.round(np.arctan2(x[1], x[0]) / a) * a
    ends = system.parameter("gap") < 0.0
    return np.hypot(*x) * np.array([np.cos(angle), np.sin(angle)]), int(x[0] > 1e-6), LOST if ends else MAPPED


def test_a_chart_tells_the_motion_that_most_starts_reach(monkeypatch):
    monkeypatch.setattr(charts, "PeriodMap", stand_in(turning))
    for low, high, outer in ((0.4, 1.2, False), (1.7, 2.3, True)):
        found = bf.parameter_chart(STORY, {"amplitude": [1.0, 2.0, 3.0], "gap": [-1.0, 1.0]},
                                   {"q0": (low, high), "v0": (-0.1, 0.1)}, starts=5, longest=6, transient=3, chunk=2, workers=1)
        assert found.periods.tolist() == [[-1, 2 if outer else 1], [-1, 4 if outer else 2], [-1, 6 if outer else 3]]
        assert found.settled.tolist() == [[0, 5]] * 3 and found.attractors.tolist() == [[0, 1]] * 3
        right = [sum(np.cos(2.0 * np.pi * np.arange(n) / n) > 1e-6) / n for n in found.periods[:, 1]]
        np.testing.assert_allclose(found.impacts[:, 1], right)
        assert (found.impacts[:, 0] == 0.0).all()
    mixed = bf.parameter_chart(STORY, {"gap": [1.0], "amplitude": [2.0, 3.0]}, {"q0": (0.6, 2.0), "v0": (-0.01, 0.01)}, starts=15,
                               longest=6, transient=3, workers=1)
    assert mixed.periods.shape == (1, 2) and mixed.attractors.tolist() == [[2, 2]]
    assert mixed.periods.tolist() == [[2, 3]]  # nine of fourteen parts of the range lie within
    assert "several attractors in 100.0 % of them" in repr(mixed)


def test_a_slow_motion_is_given_more_time_and_one_that_ends_is_no_motion(monkeypatch):
    """0.97^k: 300 periods leave it creeping, five times as many do not; growth by 1.01 ends beyond 50."""
    def step(system, x):
        y = x * (1.0 if system.parameter("gap") == 3.0 else system.parameter("gap"))
        if system.parameter("gap") == 3.0:
            y = np.array([np.mod(x[0] + 0.1234567, 1.0), x[1]])
        return y, 2, LOST if abs(y[0]) > 50.0 else MAPPED
    monkeypatch.setattr(charts, "PeriodMap", stand_in(step))
    found = bf.parameter_chart(STORY, {"gap": [0.97, 1.01, 3.0], "amplitude": [1.0]}, {"q0": (1.0, 2.0), "v0": (0.1, 0.2)},
                               starts=3, longest=3, transient=100, workers=1)
    assert found.periods[:, 0].tolist() == [1, -1, 0] and found.settled[:, 0].tolist() == [3, 0, 3]
    assert found.attractors[:, 0].tolist() == [1, 0, 1] and found.impacts[:, 0].tolist() == [2.0, 0.0, 2.0]


def test_the_exponent_of_a_cell_is_that_of_the_motion_it_names(monkeypatch):
    asked = []

    def grown(system, start, **more):
        asked.append((system.parameter("amplitude"), np.hypot(*start)))
        if system.parameter("amplitude") == 3.0:
            raise ArithmeticError("no")
        return SimpleNamespace(values=np.array([-0.2, -0.7]), errors=np.array([0.01, 0.02]))
    monkeypatch.setattr(charts, "PeriodMap", stand_in(turning))
    monkeypatch.setattr(charts, "lyapunov_exponents", grown)
    for seed in range(4):  # whichever comes first
        found = bf.parameter_chart(STORY, {"amplitude": [2.0, 3.0], "gap": [1.0]}, {"q0": (0.5, 4.0), "v0": (-0.01, 0.01)},
                                   starts=9, longest=6, transient=3, workers=1, exponents=True, seed=seed)
        assert found.periods[:, 0].tolist() == [4, 6] and found.attractors[:, 0].tolist() == [2, 2]
    np.testing.assert_allclose(asked, [(2.0, 2.0), (3.0, 2.0)] * 4)
    np.testing.assert_array_equal(found.exponents[:, 0], [-0.2, np.nan])
    np.testing.assert_array_equal(found.errors[:, 0], [0.01, np.nan])


# ramps

def curve(m, *jumps):
    """Amplitudes along m values that change a little all the time, and by ``size`` behind the place ``at`` in ``steps`` values."""
    found = 10.0 + 0.001 * np.arange(m)
    for at, size, steps in jumps:
        found += size * np.clip((np.arange(m) - at) / steps, 0.0, 1.0)
    return found


@pytest.mark.parametrize("steps", [1, 2, 3])
@pytest.mark.parametrize("size", [3.0, -3.0])
def test_a_jump_begins_at_the_last_value_before_and_ends_at_the_first_behind_it(steps, size):
    values = np.linspace(2.0, 4.0, 201)
    amplitudes = curve(201, (80, size, steps))
    (jump,) = jumps_of("down", values, amplitudes)
    assert (jump.direction, jump.value, jump.settled) == ("down", values[80], values[80 + steps])
    assert (jump.before, jump.after) == (amplitudes[80], amplitudes[80 + steps])
    (scaled,) = jumps_of("down", values, 1e-4 * amplitudes)
    assert (scaled.value, scaled.settled) == (jump.value, jump.settled)
    ended = np.append(amplitudes, [np.nan, np.nan])
    assert jumps_of("down", np.linspace(2.0, 4.02, 203), ended)[0].value == pytest.approx(jump.value)


def test_jumps_apart_are_two_and_a_small_one_is_none():
    values = np.arange(200.0)
    two = jumps_of("up", values, curve(200, (60, 2.0, 1), (120, -1.0, 2)))
    assert [(jump.value, jump.settled) for jump in two] == [(60.0, 61.0), (120.0, 122.0)]
    assert two[0].after - two[0].before == pytest.approx(2.0, abs=0.01)
    assert two[1].after - two[1].before == pytest.approx(-1.0, abs=0.01)
    top = 10.2
    assert len(jumps_of("up", values, curve(200, (60, top / 25.0, 1)))) == 1  # more than a thirtieth
    assert jumps_of("up", values, curve(200, (60, top / 40.0, 1))) == []
    (one,) = jumps_of("up", values, curve(200, (60, 2.0, 1), (62, 1.0, 1)))  # with a rest of one value
    assert (one.value, one.settled) == (60.0, 63.0)
    assert jumps_of("up", values[:2], np.array([1.0, 5.0])) == []


def run_of(maximum, minimum, values, directions=("up",), states=None):
    maximum, minimum = np.asarray(maximum, float), np.asarray(minimum, float)
    states = np.zeros((*maximum.shape[:2], 2)) if states is None else states
    return Ramp(STORY, "omega", directions, np.asarray(values, float), maximum, minimum, np.zeros(maximum.shape[:2], int), states)


def test_amplitudes_are_half_ways_and_jumps_are_those_of_each_direction():
    one = run_of([[[3.0, 5.0]]], [[[-3.0, -3.0]]], [[1.0]])
    assert one.amplitudes.tolist() == [[5.0]] and one.success
    top = np.array([curve(200, (60, 2.0, 1)), curve(200, (30, 4.0, 1))])[:, :, None]
    both = run_of(top, -top, np.array([np.arange(200.0), np.arange(200.0)[::-1]]), ("up", "down"))
    assert [(jump.direction, jump.value, jump.settled) for jump in both.jumps] == [("up", 60.0, 61.0), ("down", 169.0, 168.0)]
    rows = {"part": np.empty(0, np.int64), "s": np.empty(0)}
    branches = [Branch("omega", [], rows, [SpecialPoint(SpecialPointKind.FOLD, p, 0.0, s, (s, s), np.array([0.0, p]), np.ones(2))
                                           for s, p in enumerate(folds)], (), (0.0, 200.0), {})
                for folds in ([10.0, 64.0], [171.5, 59.0])]
    assert [(point.parameter, away) for _, point, away in both.nearest(branches)] == [(59.0, 1.0), (171.5, 2.5)]
    assert both.nearest([]) == []
    states = np.zeros((1, 1, 2))
    states[0, 0, 1] = np.nan
    assert not run_of([[[1.0]]], [[[0.0]]], [[1.0]], states=states).success


class Motion:
    """A stand-in for a simulated motion: q = value + slope t over some periods, with events at given times."""

    def __init__(self, system, start, periods):
        self.value, self.begin = system.parameter("gap"), np.array(start)
        self.stop, self.final = periods * system.period, self.begin + [1.0, 0.5]
        self.success, self.message = not 3.0 < self.value < 3.5, "it failed"
        at = np.array([0.3, periods - 1.5, periods - 0.75, periods - 0.25]) * system.period
        self.events = [SimpleNamespace(time=t, before=np.array([-5.0 if k == 1 else 7.0 + t / self.stop, 0.0]))
                       for k, t in enumerate(at)]

    def __call__(self, t):
        q = self.value + t / self.stop
        return np.column_stack([q, np.full(len(t), 100.0)])


def test_a_ramp_takes_the_last_period_of_every_value_and_goes_on_from_its_end(monkeypatch):
    starts = []

    def simulate(system, start, periods, max_events):
        starts.append(np.array(start))
        return Motion(system, start, periods)
    monkeypatch.setattr(ramps, "simulate", simulate)
    run = bf.ramp(STORY, "gap", (1.0, 2.0), steps=3, periods=5, start=(0.0, 0.0))
    assert run.values.tolist() == [[1.0, 1.5, 2.0], [2.0, 1.5, 1.0]] and run.success
    np.testing.assert_allclose(starts, np.arange(6)[:, None] * [1.0, 0.5])
    np.testing.assert_allclose(run.states.reshape(-1, 2), np.arange(1, 7)[:, None] * [1.0, 0.5])
    assert (run.events == 2).all() and run.maximum.shape == (2, 3, 1)
    np.testing.assert_allclose(run.minimum[..., 0], run.values + 0.8)  # where the last of five periods begins
    np.testing.assert_allclose(run.maximum[..., 0], 7.0 + (5 - 0.25) / 5)  # at an event
    down = bf.ramp(STORY, "gap", (1.0, 2.0), steps=2, periods=5, start=(0.0, 0.0), directions="down")
    assert down.values.tolist() == [[2.0, 1.0]] and down.directions == ("down",)
    cut = bf.ramp(STORY, "gap", (2.0, 4.0), steps=5, periods=5, start=(0.0, 0.0), directions=("down", "up"))
    assert cut.values[0].tolist() == [4.0, 3.5, 3.0, 2.5, 2.0] and cut.success
    cut = bf.ramp(STORY, "gap", (2.2, 3.4), steps=4, periods=5, start=(0.0, 0.0))
    assert not cut.success and cut.message == "gap = 3.4: it failed"
    assert np.isfinite(cut.states[0, :3]).all() and np.isnan(cut.states[0, 3:]).all() and np.isnan(cut.states[1]).all()


# attractors over a parameter

class Named:
    """An attractor that is a name, in files too."""

    periods = 1

    def __init__(self, name, system):
        self.name, self.system = name, system

    def to_record(self):
        return {"kind": "named", "name": self.name}, {"gap": np.array(self.system.parameter("gap"))}

    @classmethod
    def from_record(cls, header, arrays, elements=()):
        return cls(header["name"], STORY.with_parameters(gap=float(arrays["gap"])))

    def __repr__(self):
        return self.name


ALIVE = {"a": (0.0, 2.0), "b": (1.0, 4.0), "c": (3.0, 5.0), "d": (2.0, 3.0)}  # a becomes b, others nothing
SEEN = {"a": (0.0, 0.0), "b": (4.0, 4.0), "c": (3.0, 5.0)}  # where the sample hits it
SHARE = {"a": 5, "b": 3, "c": 2, "d": 1}


@pytest.fixture
def named(monkeypatch):
    def follow(system, item, scale):
        gap = system.parameter("gap")
        if ALIVE[item.name][0] <= gap <= ALIVE[item.name][1]:
            return Named(item.name, system), True
        return (Named("b", system), False) if item.name == "a" else (None, False)

    def place_of(item, known, scale):
        return next((k for k, other in enumerate(known) if other.name == item.name), None)

    def point(system, region, samples, options, known):
        gap = system.parameter("gap")
        if gap in (0.5, 4.5):
            raise RuntimeError("no motion")
        found = list(known)
        for name, (low, high) in SEEN.items():
            if low <= gap <= high and name not in {item.name for item in known}:
                found.append(Named(name, system))
        if gap == 2.0 and "b" in {item.name for item in known} and len(known) == len(found) and "d" not in {k.name for k in known}:
            found.append(Named("d", system))  # met when the others are known
        counts = [SHARE[item.name] for item in found]
        return found, {"counts": counts, "outside": 4, "unresolved": samples - 4 - sum(counts), "starts": samples}
    monkeypatch.setitem(records.READERS, "named", Named)
    monkeypatch.setattr(matching, "follow", follow)
    monkeypatch.setattr(matching, "place_of", place_of)
    monkeypatch.setattr(one_value, "point", point)


@pytest.mark.parametrize("chunk", [1, 2, 3, 6])
@pytest.mark.parametrize("rising", [True, False])
def test_a_sweep_follows_what_the_sample_misses_and_counts_again(named, chunk, rising):
    values = np.arange(6.0)[::1 if rising else -1]
    found = bf.sweep(STORY, "gap", values, {"q0": (-3, 1)}, samples=20, chunk=chunk, workers=1)
    names = [sorted(item.name for item in row) for row in found.attractors]
    for value, row, items in zip(values, names, found.attractors, strict=True):
        assert all(item.system.parameter("gap") == value for item in items)
        assert row == [name for name, (low, high) in ALIVE.items() if low <= value <= high]
    for row, counts in zip(found.attractors, found.counts, strict=True):
        assert list(counts) == [SHARE[item.name] for item in row]
    assert found.unresolved.tolist() == [16 - sum(counts) for counts in found.counts] and (found.outside == 4).all()
    assert len(found.tracks) == 4
    for track in found.tracks:
        (name,) = {item.name for item in track.attractors}
        assert sorted(track.values) == [v for v in np.arange(6.0) if ALIVE[name][0] <= v <= ALIVE[name][1]]
        np.testing.assert_allclose(track.fractions, SHARE[name] / 16.0)
    assert found.parents == {}


def test_a_value_that_fails_leaves_its_neighbours(named):
    found = bf.sweep(STORY, "gap", [3.0, 4.0, 4.5, 5.0], {"q0": (-3, 1)}, samples=20, chunk=4, workers=1)
    assert list(found.failures) == [2] and "no motion" in found.failures[2] and found.attractors[2] == ()
    assert [len(row) for row in found.attractors] == [2, 2, 0, 1] and found.starts.tolist() == [20, 20, 0, 20]
    (b, c) = sorted(found.tracks, key=lambda track: track.attractors[0].name)
    assert b.values.tolist() == [3.0, 4.0] and c.values.tolist() == [3.0, 4.0, 5.0]
    assert f"not computed: gap = 4.5: {found.failures[2]}" in found.report() and "1 values failed" in repr(found)


@pytest.mark.parametrize("chunk", [1, 2, 5])
def test_a_value_that_fails_before_the_others_shifts_nothing(named, chunk):
    found = bf.sweep(STORY, "gap", [0.5, 1.0, 2.0, 3.0, 4.0], {"q0": (-3, 1)}, samples=20, chunk=chunk, workers=1)
    assert [sorted(item.name for item in row) for row in found.attractors] == [[], ["b"], ["b", "d"], ["b", "c", "d"], ["b", "c"]]
    for row, counts, value in zip(found.attractors, found.counts, found.values, strict=True):
        assert list(counts) == [SHARE[item.name] for item in row] and all(item.system.parameter("gap") == value for item in row)
    assert sorted(track.values.tolist() for track in found.tracks) == [[1.0, 2.0, 3.0, 4.0], [2.0, 3.0], [3.0, 4.0]]
    assert found.parents == {}


def made(numbers, counts, outside, unresolved, parents):
    values = np.arange(len(numbers)) + 0.5
    items = tuple(tuple(SimpleNamespace(periods=n + 1 if n < 2 else None) for n in row) for row in numbers)
    return sweeps.Sweep(STORY, "omega", values, items, numbers, counts, np.array(unresolved), np.array(outside),
                        np.full(len(numbers), 50), parents, None, {})


def test_shares_errors_and_families_of_a_sweep():
    found = made(((0,), (1, 0), (2, 1)), ((30,), (5, 25), (40, 8)), (10, 20, 0), (10, 0, 2), {1: 0, 2: 1})
    np.testing.assert_allclose(found.fractions, [[0.75, 0, 0], [25 / 30, 5 / 30, 0], [0, 8 / 50, 40 / 50]])
    for i, n in enumerate((40, 30, 50)):
        for k, p in enumerate(found.fractions[i]):
            assert found.errors[i, k] == pytest.approx(max(np.sqrt(p * (1.0 - p) / n), 0.5 / n))
    assert [track.values.tolist() for track in found.tracks] == [[0.5, 1.5], [1.5, 2.5], [2.5]]
    assert [track.attractors[0].periods for track in found.tracks] == [1, 2, None]
    assert [track.parent for track in found.tracks] == [None, 0, 1] and found.families == ((0, 1, 2),)
    assert made(((0, 1, 2),), ((1, 2, 3),), (0,), (0,), {2: 0}).families == ((0, 2), (1,))
    assert made(((0, 1, 2),), ((1, 2, 3),), (0,), (0,), {}).families == ((0,), (1,), (2,))
    lines = found.report().splitlines()
    assert lines[0] == repr(found) and "3 tracks, 50 starts each" in lines[0]
    assert lines[1].strip().startswith("Track(0: period 1, 2 values from 0.5 to 1.5, share up to 0.8333)")
    assert lines[2].endswith("from track 0") and "chaotic" in lines[3]
    assert lines[4].strip() == "unresolved starts at 2 values, at most 10 of 50 (at 0.5)"
    for worst in range(3):  # the value at which most are left, out of as many as start there
        left, starts = [1, 1, 1], np.array([20, 30, 40])
        left[worst] = 7
        one = dataclasses.replace(made(((0,),) * 3, ((9,), (9,), (9,)), (0, 0, 0), left, {}), starts=starts)
        said = f"unresolved starts at 3 values, at most 7 of {starts[worst]} (at {worst + 0.5:g})"
        assert one.report().splitlines()[-1].strip() == said
    empty = made(((), ()), ((), ()), (50, 0), (0, 50), {})
    assert empty.fractions.shape == (2, 0) and empty.tracks == ()


def test_starts_of_one_value_are_labelled_until_nothing_new_is_found(monkeypatch):
    """Starts are numbers 0 .. 99 of which every tenth lies beyond a stop; each third belongs to one attractor, and a look at
    starts that are left finds one more, the last of which is none."""
    class Integrator:
        def __init__(self, scene, limit):
            assert limit == 77

        def label(self, X, targets, most):
            assert most == 5
            kind = (X[:, 0] // 25).astype(int)
            place = np.array([targets.index(k) if k in targets else -1 for k in kind])
            states = np.where(place >= 0, one_value.REACHED, one_value.UNSETTLED)
            states[X[:, 0] % 10 == 0] = one_value.OUTSIDE
            return SimpleNamespace(labels=place, states=states)

    class Discovery:
        def __init__(self, system, integrator, scale, options, known):
            self.attractors, self.looks = list(known), 0

        def targets(self):
            return list(self.attractors)

        def search(self, starts):
            self.looks += 1
            assert self.looks == 1 or (starts[:, 0] % 10 != 0).all()  # where motions are left, not beyond a stop
            kinds = [int(x // 25) for x in starts[:, 0] if x % 10]
            new = [k for k in kinds if k not in self.attractors and k != 3]
            self.attractors += new[:1]
    monkeypatch.setattr(one_value, "Integrator", Integrator)
    monkeypatch.setattr(one_value, "Discovery", Discovery)
    rows = np.column_stack([np.arange(100.0), np.zeros(100)])
    region = SimpleNamespace(starts=lambda scene, samples, seed: rows[:samples], sizes=lambda scene: np.ones(2))
    options = {"seed": 0, "tolerance": 1e-4, "max_periods": 5, "max_events": 77}
    found, counts = one_value.point(STORY, region, 100, options, [1])
    assert found[0] == 1 and sorted(found) == [0, 1, 2]
    per = {k: sum(1 for x in range(100) if x // 25 == k and x % 10) for k in range(4)}
    assert counts == {"counts": [per[k] for k in found], "outside": 10, "unresolved": per[3], "starts": 100}


def test_a_sweep_that_is_read_has_numbers_for_the_names_of_its_tracks(monkeypatch):
    """JSON knows keys of text only: parents and failures are looked up by numbers."""
    module = sweeps.Sweep.from_record.__func__.__globals__
    monkeypatch.setitem(module, "unpacked_points", lambda header, arrays, elements: [["a"], ["b", "c"]])
    for name in ("System", "Region"):
        monkeypatch.setitem(module, name, type(name, (), {"from_record": staticmethod(lambda record, *more: record)}))
    header = {"attractors": None, "system": "system", "parameter": "p", "numbers": [[0], [0, 1]], "counts": [[5], [3, 2]],
              "parents": {"1": 0, "12": 1}, "region": "region", "options": {}, "failures": {"3": "why"}, "key": "key"}
    arrays = {"values": np.array([0.5, 1.0]), **{name: np.arange(2) for name in ("unresolved", "outside", "starts")}}
    read = sweeps.Sweep.from_record(header, arrays)
    assert read.parents == {1: 0, 12: 1} and read.failures == {3: "why"}
    assert read.numbers == ((0,), (0, 1)) and read.counts == ((5,), (3, 2)) and read.attractors == (("a",), ("b", "c"))
