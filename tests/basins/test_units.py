"""Parts of the attractors, cells and boundaries of basins on stand-ins with known answers: maps of the plane, lists, numbers."""
import dataclasses
import math
from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc.basins.attractors import attractors as parts
from bifurc.basins.attractors import matching, records
from bifurc.basins.attractors.clockless import members, required
from bifurc.basins.boundaries.search import PARTS, TIGHT, EdgeStatus, Search
from bifurc.basins.boundaries.time_reversal import UNDONE, Backwards, reversed_system
from bifurc.basins.boundaries.unstable import Side, UnstableSet, both_sides, direction_of, joined
from bifurc.basins.cells.confirmation import MapCycle, MapJudge, SystemJudge, cells_around
from bifurc.basins.cells.images import Carrier, _completed, map_cells, offsets_of, spread
from bifurc.basins.maps import compute as mapping
from bifurc.basins.maps.compute import scale_of
from bifurc.compose.scene import scene_of
from bifurc.elements import BaseMotion, Coulomb, CubicSpring, ElasticStop, HarmonicForce, LinearSpring, RigidStop
from bifurc.ensemble.outcomes import INFINITY, REACHED, UNSETTLED, Cells, CellState
from bifurc.orbits.shooting.labels import Labels

SCALE = np.array([2.0, 0.5])
LOST = CellState.DIVERGED.code


def images(ends, outcomes=None, impacts=None, speeds=None):
    n = len(ends)
    return SimpleNamespace(ends=ends, outcomes=np.zeros(n, int) if outcomes is None else outcomes,
                           impacts=np.zeros(n, int) if impacts is None else impacts,
                           speeds=np.full(n, np.inf) if speeds is None else speeds)


class Carries:
    """Carries states by a function, a period at a time."""

    def __init__(self, step, period=1.0, fails=lambda X: np.zeros(len(X), bool)):
        self.step, self.fails, self.scene = step, fails, SimpleNamespace(period=period, ns=2)

    def propagate(self, X, periods):
        out = np.zeros(len(X), int)
        for _ in range(periods):
            out = np.maximum(out, np.where(self.fails(X), LOST, 0))
            X = self.step(X)
        return images(X, out)


# attractors

def test_distance_is_that_of_the_nearest_point(rng):
    points, y = rng.normal(size=(7, 3)), rng.normal(size=3)
    assert parts.distance(points, y) == pytest.approx(min(math.dist(p, y) for p in points))


def cat(X):
    """Arnold's map on scaled states: stretches by (3 + sqrt 5)/2 everywhere."""
    u = X / SCALE
    return np.column_stack([np.mod(2.0 * u[:, 0] + u[:, 1], 1.0), np.mod(u[:, 0] + u[:, 1], 1.0)]) * SCALE


def linear(X):
    return X @ np.array([[0.5, 0.2 * SCALE[1] / SCALE[0]], [0.0, -0.25]])


@pytest.mark.parametrize("period", [1.0, 2.5])
def test_the_largest_exponent_is_the_rate_of_neighbours_per_time(period):
    """A turn by 1 with a stretch: all neighbours part at one rate; of a contraction the slowest direction is left."""
    turn = np.array([[np.cos(1.0), -np.sin(1.0)], [np.sin(1.0), np.cos(1.0)]])
    grow = Carries(lambda X: 1.0 + 1.001 * ((X - 1.0) / SCALE) @ turn * SCALE, period)
    value, error = parts.largest_exponent(grow, np.array([1.0, 1.0]), SCALE)
    assert value == pytest.approx(math.log(1.001) / period, rel=1e-3) and error < 1e-5
    value, error = parts.largest_exponent(Carries(linear, period), np.zeros(2), SCALE)
    assert value == pytest.approx(math.log(0.5) / period, rel=1e-4) and error < 1e-4


def test_an_exponent_is_not_told_where_motions_end_or_merge():
    assert parts.largest_exponent(Carries(lambda X: 0.0 * X), np.zeros(2), SCALE) == (0.0, np.inf)
    assert parts.largest_exponent(Carries(linear, fails=lambda X: X[:, 0] > 0.0), np.zeros(2), SCALE) == (0.0, np.inf)


def test_sections_of_long_motions_are_side_by_side():
    found = parts.settled(Carries(cat), np.array([0.3, 0.1]), SCALE)
    assert found.shape[1] == 2 and len(found) >= parts.SAMPLE + parts.PROBE
    u = found / SCALE
    assert (u >= 0.0).all() and (u < 1.0).all() and np.abs(u.mean(axis=0) - 0.5).max() < 0.02
    known = {tuple(row) for row in np.round(u, 9)}
    assert sum(tuple(row) in known for row in np.round(cat(found[:200]) / SCALE, 9)) > 150  # the image of a point is the next
    assert parts.settled(Carries(cat, fails=lambda X: X[:, 0] > 1.9), np.array([0.3, 0.1]), SCALE) is None


def test_boxes_that_hold_a_sample(rng):
    """Uniform on the unit square: boxes of width w are all met by N points when N w^2 is some; on a line when N w is."""
    count = parts.SAMPLE
    square, line = rng.random((count + parts.PROBE, 2)), np.zeros((count + parts.PROBE, 2))
    line[:, 0] = rng.random(count + parts.PROBE)
    wide, narrow = parts.box_width(square), parts.box_width(line)
    for width, points in ((wide, square), (narrow, line)):
        assert math.log2(width) == round(math.log2(width))

        def missed(w, points=points):
            known = {tuple(row) for row in np.floor(points[:-parts.PROBE] / w)}
            return np.mean([tuple(row) not in known for row in np.floor(points[-parts.PROBE:] / w)])
        assert missed(width) <= 1.0 - parts.COVERED
        assert width == 2.0**-12 or missed(0.5 * width) > 1.0 - parts.COVERED
    assert narrow < wide <= 0.25


def test_a_curve_is_filled_until_its_last_points_are_near():
    """A turn by nearly 2 pi / 3 fills three short arcs that creep round the circle."""
    step = 2.0 * np.pi / 3.0 + 2e-4
    calls = []

    def follow(y, count):
        calls.append(count)
        start = np.arctan2(y[1] / SCALE[1], y[0] / SCALE[0])
        angle = start + step * np.arange(1, count + 1)
        return np.column_stack([np.cos(angle), np.sin(angle)]) * SCALE
    first = follow(np.array([SCALE[0], 0.0]), parts.ON_CURVE + parts.PROBE)
    calls.clear()
    found = parts.filled(first, SCALE, follow)
    assert calls == [len(first) * 2**k for k in range(len(calls))] and calls and len(found) == len(first) * 2**len(calls)
    angle = np.sort(np.arctan2(found[:, 1] / SCALE[1], found[:, 0] / SCALE[0]))
    assert np.diff(angle).max() < 0.05
    golden = 2.0 * np.pi * 0.6180339887498949
    even = golden * np.arange(parts.ON_CURVE + parts.PROBE)
    even = np.column_stack([np.cos(even), np.sin(even)]) * SCALE
    calls.clear()
    assert parts.filled(even, SCALE, follow) is even and not calls
    assert parts.filled(first, SCALE, lambda y, count: None) is None


def rest(q, mode=0, continuum=(), intervals=None):
    return SimpleNamespace(state=np.array(q, float), mode=mode, continuum=np.array(continuum), intervals=intervals or {})


def test_a_motion_that_never_comes_back_is_asked_for_no_orbit(monkeypatch, rng):
    """Its nearest return is half a natural size away."""
    steps = np.arange(parts.BLOCK + 1.0)
    motion = SimpleNamespace(success=True, sections=np.column_stack((0.5 * steps, 0.0 * steps)) * SCALE, final=np.zeros(2))
    monkeypatch.setattr(parts, "simulate", lambda system, y, periods: motion)
    monkeypatch.setattr(parts, "concentric", lambda system: False)
    monkeypatch.setattr(parts, "from_motion", lambda *asked: pytest.fail(f"asked for {asked}"))
    monkeypatch.setattr(parts, "sampled", lambda system, y, scale: "a sample")
    assert parts.examine(None, np.zeros(2), SCALE) == "a sample"


@pytest.mark.parametrize(("circle", "periods"), [(False, parts.LONGEST), (True, 1)])
def test_the_longest_return_is_looked_for(monkeypatch, circle, periods):
    """Sections on a circle that close after so many periods; where no direction is special an orbit closes after one."""
    class Asked(Exception):
        pass

    def from_motion(system, motion, begin, k):
        raise Asked(begin, k)
    angle = 2.0 * np.pi * np.arange(parts.BLOCK + 1) / periods
    motion = SimpleNamespace(success=True, sections=np.column_stack((np.cos(angle), np.sin(angle))) * SCALE, final=np.zeros(2))
    monkeypatch.setattr(parts, "simulate", lambda system, y, periods: motion)
    monkeypatch.setattr(parts, "concentric", lambda system: circle)
    monkeypatch.setattr(parts, "from_motion", from_motion)
    with pytest.raises(Asked) as asked:
        parts.examine(None, np.zeros(2), SCALE)
    assert asked.value.args == (parts.BLOCK - 2 * periods, periods)


def test_states_of_a_continuum_of_rest():
    single = rest([1.0, 0.0])
    np.testing.assert_array_equal(members(single, 1e-3, SCALE), [[1.0, 0.0]])
    line = rest([1.0, 0.0], continuum=[[2.0, -1.0]], intervals={0: (0.5, 2.5)})
    found = members(line, 0.1, SCALE)  # 2 long, spaced by no more than .1 of the scale 2
    assert len(found) == 11
    np.testing.assert_allclose(found[:, 0], np.linspace(0.5, 2.5, 11))
    np.testing.assert_allclose(found[:, 1], -0.5 * (found[:, 0] - 1.0), atol=1e-15)
    np.testing.assert_array_equal(members(rest([1.0, 0.0], intervals={0: (-np.inf, 1.0)}), 0.1, SCALE), [[1.0, 0.0]])
    short = members(rest([1.0, 0.0], continuum=[[1.0, 0.0]], intervals={0: (1.0, 1.0 + 1e-9)}), 0.1, SCALE)
    assert len(short) == 2


def test_sections_are_asked_for_without_a_clock_and_refused_with_one():
    free, forced = bf.System(1.0, 0.1, 1.0), bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.0)], omega=1.0)
    section = bf.Section("v0", direction=-1)
    assert required(forced, None, "a map") is None and required(free, section, "a map") is section
    with pytest.raises(ValueError, match="its section is phase 0"):
        required(forced, section, "a map")
    for wrong in (None, "v0"):
        with pytest.raises(ValueError, match="a diagram needs a section on which"):
            required(free, wrong, "a diagram")
    with pytest.raises(ValueError, match="v7"):
        required(free, bf.Section("v7"), "a map")


def orbit(*points, periods=None, family=(), intervals=None):
    points = np.array(points, float)
    labels = Labels.of(np.eye(points.shape[1])[list(family)])
    return SimpleNamespace(state=points[0], sections=points, periods=periods or len(points), periodic=True, family=list(family),
                           intervals=intervals or {}, labels=labels, scene=SimpleNamespace(closed_form=True))


def sample(points, width=0.05):
    return parts.ChaoticAttractor(None, np.asarray(points, float), 0.1, 0.01, width)


def test_orbits_are_one_up_to_a_shift():
    a = orbit([0.0, 0.0], [1.0, 0.3])
    assert parts.same(a, orbit([1.0, 0.3], [0.0, 0.0]), SCALE)
    near = parts.SAME * 0.9
    assert parts.same(a, orbit([near * 2.0, 0.0], [1.0, 0.3]), SCALE)  # in units of the scale
    assert not parts.same(a, orbit([parts.SAME * 1.2 * 2.0, 0.0], [1.0, 0.3]), SCALE)
    assert not parts.same(a, orbit([0.0, near], [1.0, 0.5]), SCALE) or near * 2.0 <= parts.SAME
    assert not parts.same(a, orbit([0.0, 0.0]), SCALE)
    chaos = sample(np.random.default_rng(1).random((400, 2)) * SCALE)
    assert not parts.same(a, chaos, SCALE) and not parts.same(chaos, a, SCALE)


def test_samples_are_one_where_half_of_their_boxes_agree(rng):
    base = rng.random((4000, 2)) * SCALE
    assert parts.same(sample(base[:2000]), sample(base[2000:]), SCALE)
    assert parts.same(sample(base), sample(base[base[:, 0] < 0.5]), SCALE)  # of the smaller one
    shifted = base + np.array([0.6, 0.0]) * SCALE
    assert not parts.same(sample(base), sample(shifted), SCALE)
    assert parts.same(sample(base), sample(base + np.array([0.4, 0.0]) * SCALE), SCALE)
    assert matching.alike(sample(base), sample(base + np.array([0.6, 0.0]) * SCALE), SCALE)  # of neighbours three tenths are enough
    assert not matching.alike(sample(base), sample(base + np.array([0.75, 0.0]) * SCALE), SCALE)
    fifth = base[base[:, 0] < np.quantile(base[:, 0], 0.2)]  # an attractor that has grown at once holds the one that it was
    assert matching.alike(sample(base), sample(fifth), SCALE) and matching.alike(sample(fifth), sample(base), SCALE)


def test_members_of_one_family(monkeypatch):
    """A slider that stands anywhere between 1 and 3: another member, the edge without a family of its own, and what is none."""
    monkeypatch.setattr(parts, "line_of_members", lambda a, values: a.labels.moved(np.tile(a.state, (len(values), 1)), values))
    whole = orbit([0.5, 2.0], family=[1], intervals={1: (1.0, 3.0)})
    assert parts.one_family(whole, orbit([0.5, 2.9], family=[1], intervals={1: (1.0, 3.0)}), SCALE)
    assert not parts.one_family(whole, orbit([0.5, 3.1], family=[1], intervals={1: (1.0, 3.0)}), SCALE)
    assert not parts.one_family(whole, orbit([0.5, 2.5], family=[0], intervals={0: (0.0, 1.0)}), SCALE)
    edge = orbit([0.5, 3.0])
    assert parts.one_family(whole, edge, SCALE) and parts.one_family(edge, whole, SCALE)
    assert not parts.one_family(whole, orbit([0.6, 3.0]), SCALE)  # another motion
    assert not parts.one_family(edge, orbit([0.5, 3.0]), SCALE)
    assert parts.one_family(whole, orbit([0.5, 1.0 - 0.9 * parts.SAME * SCALE[1]]), SCALE)
    assert not parts.one_family(whole, orbit([0.5, 1.0 - 1.5 * parts.SAME * SCALE[1]]), SCALE)


def test_mirror_images_are_half_a_period_away():
    def made(points, halves):
        item = orbit(*points)
        item.sample = lambda count: (None, np.array(halves)) if count == 2 * item.periods + 1 else None
        return item
    one = made([[1.0, 0.2]], [[0, 0], [-3.0, 0.1], [0, 0]])  # -y(T/2) = (3, -.1)
    two = made([[3.0, -0.1]], [[0, 0], [-1.0, -0.2], [0, 0]])
    own = made([[0.4, 0.4]], [[0, 0], [-0.4, -0.4], [0, 0]])
    alone = made([[9.0, 9.0]], [[0, 0], [5.0, 5.0], [0, 0]])
    system = SimpleNamespace(symmetry=-1, period=1.0)
    found = parts.partners(system, [one, sample(np.zeros((3, 2))), own, two, alone], SCALE)
    assert found == {0: 3, 3: 0, 2: 2}
    assert parts.partners(SimpleNamespace(symmetry=0, period=1.0), [own], SCALE) == {}
    assert parts.partners(SimpleNamespace(symmetry=-1, period=None), [own], SCALE) == {}


# following

def test_orbits_of_neighbours_are_alike_where_they_are_near():
    a = orbit([0.0, 0.0], [1.0, 0.3])
    moved = matching.CLOSE * SCALE[0]
    assert matching.alike(a, orbit([0.99 * moved, 0.0], [5.0, 5.0]), SCALE)
    assert not matching.alike(a, orbit([1.01 * moved, 0.0], [5.0, 5.0]), SCALE)
    assert not matching.alike(a, orbit([0.0, 0.0]), SCALE)
    chaos = sample(np.random.default_rng(1).random((400, 2)))
    assert not matching.alike(a, chaos, SCALE) and not matching.alike(chaos, a, SCALE)
    known = [orbit([9.0, 0.0], [8.0, 0.0]), a, sample(np.random.default_rng(1).random((400, 2)))]
    assert matching.place_of(orbit([1.0, 0.3], [0.0, 0.0]), known, SCALE) == 1
    assert matching.place_of(chaos, known, SCALE) == 2
    assert matching.place_of(orbit([4.0, 0.3], [3.0, 0.0]), known, SCALE) is None


@pytest.fixture
def numbers(monkeypatch):
    """Attractors are numbers: each goes on as itself while the parameter allows it, and becomes another where it is lost."""
    def follow(system, item, scale):
        low, high, other = TABLE[item]
        if low <= system <= high:
            return item, True
        return (other, False) if other is not None else (None, False)
    monkeypatch.setattr(matching, "follow", follow)
    monkeypatch.setattr(matching, "place_of", lambda item, known, scale: known.index(item) if item in known else None)


TABLE = {"a": (0, 2, "b"), "b": (0, 4, None), "c": (3, 4, "b"), "d": (2, 4, None)}  # name: from, to, what it becomes


def made(*rows):
    systems = list(range(len(rows)))
    return matching.Links(systems, [SCALE] * len(rows), [list(row) for row in rows])


def test_attractors_are_spread_to_all_systems_in_which_they_live(numbers):
    links = made(["a", "b"], [], ["d"], ["c"], [])
    links.spread()
    assert [sorted(row) for row in links.attractors] == [["a", "b"], ["a", "b"], ["a", "b", "d"], ["b", "c", "d"], ["b", "c", "d"]]
    assert links.grown == {1, 2, 3, 4}
    tracks, parents = links.tracks()
    named = [{name: number for name, number in zip(row, mine, strict=True)} for row, mine in zip(links.attractors, tracks,
                                                                                                       strict=True)]
    for name in TABLE:
        assert len({row[name] for row in named if name in row}) == 1  # one number all along
    assert len({number for row in named for number in row.values()}) == 4
    assert parents == {}
    assert links.link(2, links.attractors[2].index("a"), 1) == (links.attractors[3].index("b"), False)
    assert links.link(2, links.attractors[2].index("d"), -1) is None


def test_links_among_a_part_of_a_row_leave_out_what_is_new(numbers):
    links = made(["a", "b"], ["b"], ["d"])
    found = links.among()
    assert found == {(0, 1, 1): (0, True), (1, 0, -1): (1, True), (2, 0, -1): None}
    assert links.attractors == [["a", "b"], ["b"], ["d"]] and links.grown == set()


def test_a_track_that_begins_where_another_is_lost_has_a_parent(numbers):
    links = made(["a"], ["a"], ["a"], ["c"])
    links._done = {(0, 0, 1): (0, True), (1, 0, 1): (0, True), (2, 0, 1): (0, False), (1, 0, -1): (0, True), (2, 0, -1): (0, True),
                   (3, 0, -1): None}
    assert links.tracks() == ([[0], [0], [0], [1]], {1: 0})
    crossed = made(["a", "b"], ["b", "a"])
    crossed._done = {(0, 0, 1): (1, True), (0, 1, 1): (0, True), (1, 0, -1): (1, True), (1, 1, -1): (0, True)}
    assert crossed.tracks() == ([[0, 1], [1, 0]], {})
    both = made(["a", "b"], ["b"])  # both are continued to one: the one that comes back keeps its number
    both._done = {(0, 0, 1): (0, True), (0, 1, 1): (0, True), (1, 0, -1): (1, True)}
    assert both.tracks() == ([[0, 1], [1]], {})
    oneway = made(["a", "b"], ["b"])  # nothing comes back: the first
    oneway._done = {(0, 0, 1): (0, True), (0, 1, 1): (0, True), (1, 0, -1): None}
    assert oneway.tracks() == ([[0, 1], [0]], {})
    assert matching.Links([], [], []).tracks() == ([], {})


# records

@dataclasses.dataclass
class Stored:
    """What attractors in files look like."""

    name: str
    values: np.ndarray

    def to_record(self):
        return {"kind": "stored", "name": self.name}, {"values": self.values, "values_more": 2 * self.values}

    @classmethod
    def from_record(cls, header, arrays, elements=()):
        assert set(arrays) == {"values", "values_more"} and (arrays["values_more"] == 2 * arrays["values"]).all()
        return cls(header["name"] + "".join(elements), arrays["values"])


def test_attractors_of_many_points_are_read_as_they_were_written(monkeypatch):
    """Numbers of more than one digit: those of the second do not read what the twelfth wrote."""
    monkeypatch.setitem(records.READERS, "stored", Stored)
    points = [[Stored(f"{i}.{k}", np.arange(i * 100 + k, i * 100 + k + 3)) for k in range(12 if i == 1 else i % 3)]
              for i in range(13)]
    headers, arrays = records.packed_points(points)
    again = records.unpacked_points(headers, arrays, ("!",))
    assert [[item.name for item in row] for row in again] == [[item.name + "!" for item in row] for row in points]
    for mine, other in zip(points, again, strict=True):
        for a, b in zip(mine, other, strict=True):
            np.testing.assert_array_equal(a.values, b.values)
    headers, arrays = records.packed(points[1])
    assert [item.name for item in records.unpacked(headers, arrays)] == [item.name for item in points[1]]
    assert records.unpacked([], {}) == [] and records.unpacked_points([[], []], {}) == [[], []]


# cells

def test_samples_of_cells_fill_them_evenly():
    grid = bf.Grid(q0=(-1.0, 2.0, 3), v0=(5.0, 6.0, 4))
    offsets = offsets_of(grid, 3)
    assert offsets.shape == (9, 2)
    np.testing.assert_allclose(offsets, [[(i + 0.5) / 3, (j + 0.5) / 3] for i in range(3) for j in range(3)])
    found = spread(grid, np.array([7, 2]), offsets).reshape(2, 9, 2)
    for cell, points in zip((7, 2), found, strict=True):
        low = np.array([-1.0, 5.0]) + np.array(divmod(cell, 4)) * [1.0, 0.25]
        np.testing.assert_allclose(points, low + offsets * [1.0, 0.25])
    np.testing.assert_allclose(spread(grid, np.array([7]), offsets_of(grid, 1)), grid.points(np.array([7])))


def test_a_map_given_as_a_function_is_iterated_and_its_losses_are_told():
    grid = bf.Grid(q0=(0.0, 4.0, 4))
    carrier = Carrier(lambda x: np.where(x > 3.0, np.inf, 2.0 * x), grid, 2, 10)
    assert carrier.lean and carrier.map is None
    ends, outcomes, cells = carrier.images(np.array([[0.3], [0.9], [1.9], [3.5]]))
    np.testing.assert_allclose(ends[:2, 0], [1.2, 3.6])
    assert outcomes.tolist() == [0, 0, 3, 3] and cells.tolist() == [1, 3, -1, -1]
    ends, outcomes, cells = carrier.images(np.array([[1.2]]))
    assert outcomes.tolist() == [0] and cells.tolist() == [-1]  # outside the grid
    meta, arrays = map_cells({"key": "", "grid": grid.to_record(), "periods": 2, "max_events": 10, "samples": 2, "cells": (1, 4)},
                             carrier.system)
    assert arrays["rows"].tolist() == [1, 1, 2, 2, 3, 3] and meta == {"lost": 5}
    assert arrays["columns"].tolist() == [-1, -1, -1, -1, -1, -1]
    first = map_cells({"key": "", "grid": grid.to_record(), "periods": 1, "max_events": 10, "samples": 2, "cells": (0, 2)},
                      carrier.system)
    assert first[0] == {"lost": 0} and first[1]["columns"].tolist() == [0, 1, 2, 3] and first[1]["rows"].tolist() == [0, 0, 1, 1]
    with pytest.raises(ValueError, match=r"shape \(1, 2\); it must return states \(k, 1\)"):
        Carrier(lambda x: np.hstack([x, x]), grid, 1, 10).images(np.array([[1.0]]))


def test_samples_that_are_no_starts_are_not_lost_motions(monkeypatch):
    """Of the four samples of two cells one lies beyond a stop, one leaves all bounds."""
    grid = bf.Grid(q0=(0.0, 2.0, 2))
    outcomes = np.array([0, CellState.OUTSIDE.code, LOST, 0])
    carrier = SimpleNamespace(grid=grid, states=lambda points: points, images=lambda X: (X, outcomes, np.array([1, -1, -1, 0])))
    monkeypatch.setattr("bifurc.basins.cells.images._carriers", SimpleNamespace(get=lambda key: carrier))
    meta, arrays = map_cells({"key": "a", "samples": 2, "cells": (0, 2)})
    assert meta == {"lost": 1} and arrays["rows"].tolist() == [0, 1, 1] and arrays["columns"].tolist() == [1, -1, 0]


def test_a_cell_that_is_reached_but_holds_no_start_is_stood_for_by_what_arrives():
    """x -> x + 1.25 on [0, 5); the cells [2, 3) and [3, 4) hold no samples that are starts."""
    grid = bf.Grid(q0=(0.0, 5.0, 5))
    carrier = Carrier(lambda x: x + 1.25, grid, 1, 10)
    offsets = offsets_of(grid, 2)  # at 1/4 and 3/4
    cells = np.array([0, 0, 1, 1, 4, 4])
    _, _, columns = carrier.images(spread(grid, np.array([0, 1, 4]), offsets))
    assert columns.tolist() == [1, 2, 2, 3, -1, -1]
    found = _completed(carrier, cells, columns, offsets, 7)
    assert found.starts.all() and found.lost == 7
    assert sorted(found.special) == [2, 3]
    np.testing.assert_allclose(found.special[2], [2.0])  # of the first that arrives: .75 + 1.25
    np.testing.assert_allclose(found.special[3], [3.0])  # 1.75 + 1.25
    assert found.rows.tolist() == [0, 0, 1, 1, 2, 3, 4, 4]
    assert found.columns.tolist() == [1, 2, 2, 3, 3, 4, -1, -1]


def test_cells_around_points():
    grid = bf.Grid(q0=(0.0, 5.0, 5), v0=(0.0, 4.0, 4), periodic=("q0",))
    found = cells_around(grid, np.array([[0.5, 1.5]]))
    assert sorted(found.tolist()) == sorted(i * 4 + j for i in (4, 0, 1) for j in (0, 1, 2))
    assert -1 in cells_around(grid, np.array([[2.5, 0.5]])).tolist()  # beyond a side that is none


def judge(function, periodic=(), **grid):
    made = bf.Grid(periodic=periodic, **grid)
    return MapJudge(function, made, {"max_periods": 200, "tolerance": 1e-6})


def test_cycles_of_a_map_are_solved_to_their_least_period():
    """The logistic map at 3.3 has a stable cycle of two; its fixed point is not stable."""
    a = 3.3
    own = judge(lambda x: a * x * (1.0 - x), q0=(-0.5, 1.5, 10))
    own.search(np.array([[0.2], [0.7], [1.4]]))
    (cycle,) = own.attractors
    root = math.sqrt((a - 3.0) * (a + 1.0))
    np.testing.assert_allclose(np.sort(cycle.points[:, 0]), (a + 1.0 - root) / (2 * a) + np.array([0.0, root / a]), atol=1e-12)
    np.testing.assert_allclose(cycle.multipliers, [4.0 + 2.0 * a - a * a], atol=1e-6)
    assert cycle.periods == 2 and cycle.stable and cycle.regime == "cycle of 2" and cycle.residual <= 1e-12
    fixed = own.solve(np.array([0.69]), 1)
    np.testing.assert_allclose(fixed.points, [[1.0 - 1.0 / a]], atol=1e-12)
    assert not fixed.stable and fixed.multipliers[0] == pytest.approx(2.0 - a, abs=1e-6)
    twice = own.solve(np.array([1.0 - 1.0 / a + 1e-9]), 2)
    assert twice.periods == 1  # the least
    labels = own.label(np.array([[0.3], [1.45], [cycle.points[0, 0]], [0.0]]))
    assert labels.tolist() == [0, INFINITY, 0, -1]
    assert own.contraction(0, 6) == pytest.approx(abs(4.0 + 2.0 * a - a * a)**3, rel=1e-5)
    assert own.points(0) is own.attractors[0].points


def test_the_cycle_of_a_linear_map_is_found_in_one_step_of_newton():
    """A map that turns and contracts: its derivative is that matrix, no other, and from anywhere near the first step ends there."""
    matrix, centre = np.array([[0.1, -0.9], [0.8, 0.2]]), np.array([0.3, -0.2])
    calls = []

    def turned(x):
        calls.append(len(x))
        return centre + (x - centre) @ matrix.T
    own = judge(turned, q0=(-1.0, 1.0, 10), v0=(-1.0, 1.0, 10))
    found = own.solve(np.array([0.35, -0.1]), 1)
    np.testing.assert_allclose(found.points, [centre], atol=1e-9)
    np.testing.assert_allclose(found.multipliers, np.linalg.eigvals(matrix), atol=1e-8)
    assert len(calls) <= 3


def test_an_orbit_contracts_by_its_multiplier_once_in_its_own_period():
    own = object.__new__(SystemJudge)
    orbit = SimpleNamespace(multipliers=np.array([0.2, -0.5]), periods=3)
    still = SimpleNamespace(multipliers=np.array([]), periods=1)
    own.found = SimpleNamespace(attractors=[orbit, still])
    assert own.contraction(0, 12) == pytest.approx(0.5**4) and own.contraction(1, 12) == 0.0


def test_gaps_go_the_short_way_round_a_periodic_component():
    own = judge(lambda x: x, ("q0",), q0=(0.0, 10.0, 5), v0=(0.0, 4.0, 4))
    np.testing.assert_allclose(own._gap(np.array([[9.5, 3.0]]), np.array([0.5, 1.0])), [[-0.1, 0.5]])
    turn = judge(lambda x: np.column_stack([np.mod(x[:, 0] + 2.5, 10.0), 0.5 * x[:, 1] + 1.0]), ("q0",), q0=(0.0, 10.0, 5),
                 v0=(0.0, 4.0, 4))
    assert turn.solve(np.array([1.0, 2.0]), 3) is None  # it does not close
    assert turn.solve(np.array([1.0, 2.0]), 4) is None or turn.solve(np.array([1.0, 2.0]), 4).periods == 4


def test_cycles_are_numbered_by_period_and_place():
    own = judge(lambda x: x, q0=(0.0, 1.0, 4), v0=(0.0, 1.0, 4))

    def cycle(*points):
        return MapCycle(np.array(points, float), np.array([0.5 + 0j]), 0.0)
    own.attractors = [cycle([0.5, 0.1], [0.2, 0.9]), cycle([0.9, 0.1]), cycle([0.1, 0.9]),
                      cycle([0.3, 0.2], [0.4, 0.1], [0.1, 0.7])]
    own.sort()
    assert [item.points.tolist() for item in own.attractors] == [[[0.1, 0.9]], [[0.9, 0.1]], [[0.2, 0.9], [0.5, 0.1]],
                                                                 [[0.1, 0.7], [0.3, 0.2], [0.4, 0.1]]]


# sizes

def test_sizes_of_states_are_one_length_and_its_velocity():
    forced = scene_of(bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.0)], omega=4.0))
    np.testing.assert_allclose(scale_of(forced, np.array([[0.5, -1.0], [-2.0, 3.0]])), [2.0, 8.0])
    np.testing.assert_allclose(scale_of(forced, np.array([[0.5, -12.0], [-2.0, 3.0]])), [3.0, 12.0])
    free = scene_of(bf.System(4.0, 0.0, 9.0))
    np.testing.assert_allclose(scale_of(free, np.array([[2.0, 0.0]])), [2.0, 3.0])  # the slowest oscillation: sqrt(9/4)


# boundaries

class Line:
    """Labels along a line by a list of (end, label)."""

    def __init__(self, *parts):
        self.parts, self.asked = parts, 0

    def label(self, X, targets, most):
        self.asked += len(X)
        return SimpleNamespace(labels=np.array([next(label for end, label in self.parts if x <= end) for x in X[:, 0]]))


def searching(line, pair=(0, 1)):
    search = object.__new__(Search)
    search.pair, search.scale, search.targets, search.integrator = pair, SCALE, None, line
    search.basins, search.third = SimpleNamespace(options={"max_periods": 5}), {}
    return search


@pytest.mark.parametrize("ends", [((0.0, 0.1), (3.0, 0.4)), ((3.0, 0.4), (0.0, 0.1))])
def test_two_starts_are_brought_together_at_the_boundary(ends):
    x = 1.2345678901
    line = Line((x, 0), (99.0, 1)) if ends[0][0] == 0.0 else Line((x, 1), (99.0, 0))
    search = searching(line)
    found = search.squeeze(np.array(ends))
    assert np.linalg.norm((found[1] - found[0]) / SCALE) <= TIGHT and search.third == {}
    assert line.label(found, None, 0).labels.tolist() == [0, 1]
    np.testing.assert_allclose(found[:, 0], x, atol=1e-10)
    np.testing.assert_allclose(found[:, 1], 0.1 + 0.1 * x, atol=1e-10)  # on the segment


def test_the_narrowest_of_several_boundaries_is_taken_and_third_basins_are_counted():
    search = searching(Line((1.0, 0), (1.7, 7), (2.0, 1), (2.25, 0), (99.0, 1)))
    found = search.squeeze(np.array([[0.0, 0.0], [3.0, 0.0]]))
    assert min(abs(found[0, 0] - 2.0), abs(found[0, 0] - 2.25)) < 1e-10
    assert search.third == {7: sum(1.0 < 3.0 * k / PARTS <= 1.7 for k in range(1, PARTS))}
    between = searching(Line((1e-3, 0), (2.999, 5), (99.0, 1)))
    assert between.squeeze(np.array([[0.0, 0.0], [3.0, 0.0]])) is None and between.third == {5: PARTS - 1}
    thin = searching(Line((1.0, 0), (1.0 + 1e-6, 5), (99.0, 1)))
    assert thin.squeeze(np.array([[0.0, 0.0], [3.0, 0.0]])) is None and thin.third[5] >= PARTS - 1


def test_following_a_boundary_ends_where_it_must():
    def tracked(images_of, most=6, **more):
        search = searching(Line((0.0, 0), (99.0, 1)))
        search.points, search.gap, search.jumps, search.map = [], 0.0, 0, SimpleNamespace(apply=images_of)
        search.returned = more.get("returned", lambda: None)
        return search, search.track(np.array([[-1.0, 0.0], [1.0, 0.0]]), most)
    search, answer = tracked(lambda X: images(X * [3.0, 1.0]))
    assert answer == (None, EdgeStatus.NO_RETURN) and len(search.points) == 6 and search.jumps == 0
    search, answer = tracked(lambda X: images(X * [1e12, 1.0]))  # the map jumps at the boundary
    assert answer == (None, EdgeStatus.BROKEN) and search.jumps == 4 and search.gap > 0.05
    _, answer = tracked(lambda X: images(X, np.array([0, LOST])))
    assert answer == (None, EdgeStatus.NO_RETURN)
    saddle = object()
    _, answer = tracked(lambda X: images(X * [1e7, 1.0]), returned=lambda: saddle)
    assert answer == (saddle, EdgeStatus.SADDLE)
    search = searching(Line((-0.5, 0), (0.5, 4), (99.0, 1)))
    search.points, search.gap, search.jumps = [], 0.0, 0
    assert search.track(np.array([[-1.0, 0.0], [1.0, 0.0]]), 4) == (None, EdgeStatus.THIRD_BASIN)


def test_how_far_two_starts_came_apart_is_the_most_of_all_steps():
    """The first image is far beyond what is still together, those that follow are just so."""
    factors = iter([1e10, 1e7, 1e7, 1e7, 1e7, 1e7, 1e7])
    search = searching(Line((0.0, 0), (99.0, 1)))
    search.points, search.gap, search.jumps, gaps = [], 0.0, 0, []

    def apply(X):
        ends = X * [next(factors), 1.0]
        gaps.append(np.linalg.norm((ends[1] - ends[0]) / SCALE))
        return images(ends)
    search.map, search.returned = SimpleNamespace(apply=apply), lambda: None
    search.track(np.array([[-1.0, 0.0], [1.0, 0.0]]), 4)
    assert len(gaps) > 1 and gaps[-1] < max(gaps) and search.gap == max(gaps)


def test_the_closest_cells_of_two_basins_are_so_in_natural_sizes():
    """A step of 1 in q0 is half a natural size, one of 0.75 in v0 is one and a half."""
    grid = bf.Grid(q0=(0.0, 5.0, 5), v0=(0.0, 3.75, 5))
    labels = np.full(grid.shape, -1)
    labels[2, 2], labels[3, 2], labels[2, 3] = 0, 1, 1
    search = searching(None)
    search.basins = SimpleNamespace(labels=labels, grid=grid)
    search.map = SimpleNamespace(scene=scene_of(bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.0)], omega=1.0)))
    np.testing.assert_allclose(search.closest_cells(), [[2.5, 1.875], [3.5, 1.875]])
    labels[2, 2] = -1
    assert search.closest_cells() is None


# sets of a saddle

MATRIX = np.array([[2.0, 0.3], [0.1, 0.4]])  # on scaled states


def saddle_map(X, periods=1):
    u = X / SCALE
    for _ in range(periods):
        u = u @ MATRIX.T
    return images(u * SCALE)


@pytest.mark.parametrize("k", [1, 2])
def test_the_unstable_direction_and_its_multiplier(k):
    values, vectors = np.linalg.eig(np.linalg.matrix_power(MATRIX, k))
    direction, multiplier = direction_of(saddle_map, SCALE, np.zeros(2), k)
    assert multiplier == pytest.approx(values.max(), rel=1e-8)
    assert abs(direction @ vectors[:, np.argmax(values)]) == pytest.approx(1.0, abs=1e-9)
    assert np.linalg.norm(direction) == pytest.approx(1.0)


def test_both_sides_of_an_unstable_set_grow_along_its_direction():
    direction, multiplier = direction_of(saddle_map, SCALE, np.zeros(2), 1)
    sides = both_sides(saddle_map, SCALE, np.zeros(2), direction, multiplier)
    for sign, side in zip((1.0, -1.0), sides, strict=True):
        start = side.start(np.array([0.0, 0.5, 1.0])) / SCALE
        size = sign * (start @ direction)
        np.testing.assert_allclose(size, 1e-5 * multiplier**np.array([0.0, 0.5, 1.0]), rtol=1e-6)
        assert side.propagate(16, 0.01, 5000)
        points = np.concatenate(side.pieces) / SCALE
        along = sign * (points @ direction)
        np.testing.assert_allclose(points - sign * along[:, None] * direction, 0.0, atol=1e-6 * along.max())
        assert along.max() == pytest.approx(1e-5 * multiplier**17, rel=1e-5)
        assert len(side.pieces) == 17 and side.corners == side.merging == side.breaks == 0
        for piece in side.pieces:
            assert np.linalg.norm(np.diff(piece / SCALE, axis=0), axis=1).max() <= 0.01
    points, owner, number = joined(sides)
    assert len(points) == len(owner) == len(number) and set(owner) == {0, 1} and number.max() == 33
    assert [owner[number == k][0] for k in range(34)] == [0] * 17 + [1] * 17
    assert not Side(saddle_map, SCALE, np.zeros(2), 1e-5 * direction * SCALE, multiplier).propagate(16, 0.01, 40)  # too many points
    least = both_sides(saddle_map, SCALE, np.zeros(2), direction, 1e3)[0].start(np.array([0.0])) / SCALE
    assert np.linalg.norm(least) == pytest.approx(1e-7, rel=1e-6)  # its first piece ends at 1e-4


def test_what_a_set_meets_on_its_way_is_counted():
    """Motions beyond x = .01 hit once more, those beyond .02 rest, those beyond .04 end."""
    def apply(X, periods=1):
        found = saddle_map(X, periods)
        x = found.ends[:, 0]
        return images(found.ends, np.where(x > 0.04, LOST, 0), (x > 0.01).astype(int), np.where((x > 0.02) & (x < 0.022), 0.0, 1.0))
    direction, multiplier = direction_of(saddle_map, SCALE, np.zeros(2), 1)
    direction = direction * np.sign(direction[0])
    side, other = both_sides(apply, SCALE, np.zeros(2), direction, multiplier)
    assert side.propagate(16, 0.002, 5000) and other.propagate(16, 0.02, 5000)
    assert side.corners == 1 and side.merging > 0 and side.breaks == 1 and set(side.ended) == {LOST}
    assert max(piece[:, 0].max() for piece in side.pieces) == pytest.approx(0.04, abs=0.002 * 0.2)
    assert other.corners == other.merging == other.breaks == 0 and isinstance(other.ended, Counter)
    points, sides, curves = joined((side, other))
    met = UnstableSet(points, sides, curves, ((0,), (0, 1)), multiplier, 1, 3, 2, False)
    assert met.message.startswith("The set has corners where motions graze (1 met), passes motions that come to rest on a stop")
    assert "(3 points)" in met.message and met.message.endswith("is torn at 2 places where the map jumps: a piecewise smooth set, "
                                                                "not a manifold.")
    assert dataclasses.replace(met, merging=0, breaks=0).message.endswith("(1 met): a piecewise smooth curve, not a manifold.")
    assert dataclasses.replace(met, corners=0, merging=0, breaks=0).message == UnstableSet.smooth
    assert "cut short, sides lead to 0 | 0 and 1, multiplier 2.0" in repr(met)


# backwards in time

def test_a_system_backwards():
    elements = (HarmonicForce(1.5, phase=0.3), BaseMotion(0.2, phase=-0.4), LinearSpring(0.7, 0.25), CubicSpring(0.4),
                RigidStop(gap=1.0, restitution=0.8, amplitude=0.1, phase=0.6, harmonic=1), ElasticStop(0.4, 5.0, damping=0.5))
    system = bf.System(2.0, 0.3, 1.5, elements, omega=1.2)
    back = reversed_system(system)
    assert float(back.damping.item()) == -0.3 and float(back.mass.item()) == 2.0 and float(back.stiffness.item()) == 1.5
    assert back.omega == 1.2
    load, base, spring, cubic, stop, elastic = back.elements
    assert (load.phase, load.amplitude) == (-0.3, 1.5) and base.phase == 0.4
    assert (spring.stiffness, spring.damping) == (0.7, -0.25) and cubic == elements[3]
    assert stop.restitution == pytest.approx(1.25) and (stop.gap, stop.phase, stop.amplitude) == (1.0, -0.6, 0.1)
    assert (elastic.damping, elastic.stiffness, elastic.gap) == (-0.5, 5.0, 0.4)
    for merging in (RigidStop(1.0, 0.0), Coulomb(0.3)):
        with pytest.raises(ValueError, match="has no motion backwards"):
            reversed_system(bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.0), merging], omega=1.0))


def test_points_backwards_are_checked_by_carrying_them_forward():
    """Stand-ins for both maps: what does not come back is told apart from what left the region."""
    back = object.__new__(Backwards)
    back.scale, back.turn = SCALE, np.array([1.0, -1.0])
    back.low, back.high = np.array([-1.0, -np.inf]), np.array([4.0, np.inf])
    seen = []

    def reverse(X, periods):
        seen.append((X.copy(), periods))
        return images(X + [1.0, 0.0], np.array([0, 0, LOST, 0, 0, 0]), np.arange(6), np.arange(6.0))

    def forward(X, periods):
        ends = X - [1.0, 0.0]
        ends[1, 0] += 1e-5  # comes back somewhere else
        ends[2, 0] += np.nan
        return images(ends, np.array([0, 0, 0, LOST]), speeds=np.array([1.0, 0.0, 1.0, 1.0]))
    back.map, back.forward = SimpleNamespace(apply=reverse), SimpleNamespace(apply=forward)
    X = np.column_stack([[0.0, 1.0, 2.0, 2.5, 9.0, 2.8], [0.5, -0.5, 1.0, 2.0, 0.0, 3.0]])
    found = back.apply(X, 3)
    np.testing.assert_array_equal(seen[0][0], X * [1.0, -1.0])
    assert seen[0][1] == 3
    np.testing.assert_allclose(found.ends[:, 1], X[:, 1])
    np.testing.assert_allclose(found.ends[:, 0], X[:, 0] + 1.0)
    state = CellState
    assert found.outcomes.tolist() == [0, state.INCONSISTENT.code, LOST, state.UNSETTLED.code, state.OUTSIDE.code,
                                       state.UNSETTLED.code]
    assert found.impacts.tolist() == list(range(6)) and found.speeds.tolist() == list(range(6))


@pytest.mark.parametrize("unit", [1e-9, 1.0, 1e9])
def test_a_motion_comes_back_within_a_distance_in_the_units_of_the_map(unit):
    """Half of it off, and twice, in either component: the scales of position and velocity are their own."""
    back = object.__new__(Backwards)
    back.scale, back.turn = unit * np.array([2.0, 0.5]), np.ones(2)
    back.low, back.high = np.full(2, -np.inf), np.full(2, np.inf)
    X, codes = np.zeros((4, 2)), np.zeros(4, int)
    off = UNDONE * back.scale * [[0.5, 0.0], [2.0, 0.0], [0.0, 0.5], [0.0, 2.0]]
    back.map = SimpleNamespace(apply=lambda X, periods: images(X, codes, codes, np.ones(4)))
    back.forward = SimpleNamespace(apply=lambda X, periods: images(X + off, codes, codes, np.ones(4)))
    assert back.apply(X).outcomes.tolist() == [0, CellState.UNSETTLED.code] * 2


def test_cells_are_labelled_again_for_every_attractor_that_is_new(monkeypatch):
    """Of the cells that settled on none, once for each new attractor; of six starts two go to each of three attractors."""
    asked = []

    def label_starts(labeller, starts, targets, most, store, run, bar, fresh, words):
        asked.append((starts[:, 0].tolist(), fresh.tolist()))
        goal = starts[:, 0].astype(int) // 2
        made = Cells.blank(len(starts), -1, UNSETTLED)
        made.labels[goal < targets], made.states[goal < targets] = goal[goal < targets], REACHED
        return made
    monkeypatch.setattr(mapping, "label_starts", label_starts)
    known = []
    work = object.__new__(mapping._Work)
    work.__dict__.update(starts=np.arange(6.0)[:, None], most=9, labeller=None, store=None, run=None, bar=None,
                         found=SimpleNamespace(targets=lambda: len(known), attractors=known))
    cells, seen = Cells.blank(6, mapping.NEW, UNSETTLED), np.full(6, -1)
    for item in (None, "a", None, "b", "c", None):
        known += [item] if item else []
        work._label(cells, seen)
    # without any, with the first, nothing new, with the second, the third, and all are done
    assert [starts for starts, _ in asked] == [[0, 1, 2, 3, 4, 5], [0, 1, 2, 3, 4, 5], [], [2, 3, 4, 5], [4, 5], []]
    assert [sum(fresh) for _, fresh in asked] == [6, 0, 0, 0, 0, 0]
    assert cells.labels.tolist() == [0, 0, 1, 1, 2, 2] and (cells.states == REACHED).all()


def test_whether_two_samples_are_one_does_not_depend_on_their_order(rng):
    """The wider boxes count: a finer sample of the same motion is none of its own."""
    points = rng.random((4000, 2)) * SCALE
    fine, coarse = sample(points[:2000], width=2.0**-9), sample(points[2000:], width=2.0**-4)
    assert parts.same(fine, coarse, SCALE) and parts.same(coarse, fine, SCALE)
    away = sample(points[2000:] + SCALE, width=2.0**-4)
    assert not parts.same(fine, away, SCALE) and not parts.same(away, fine, SCALE)
