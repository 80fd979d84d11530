"""Attractors found and followed on stand-ins: basins that are half planes, systems that are numbers; sets that know no units."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.basins.attractors import discovery as looking
from bifurc.basins.attractors import matching
from bifurc.basins.attractors.attractors import ChaoticAttractor, targets_of
from bifurc.basins.boundaries.unstable import Side, both_sides, direction_of
from bifurc.ensemble.outcomes import REACHED, UNSETTLED, CellState
from bifurc.ensemble.period_map import MAPPED
from bifurc.orbits.orbit import PeriodicOrbit

SCALE = np.array([4.0, 0.5])
LOST = CellState.DIVERGED.code


def orbit(*points, periods=None, events=0, success=True, stable=True):
    """Return a periodic orbit that is only its section points."""
    points = np.array(points, float)
    made = SimpleNamespace(sections=points, state=points[0], periods=periods or len(points), periodic=True, family=[], intervals={},
                           events=[None] * events, success=success, stable=stable, system=SimpleNamespace(n=1))
    return made


def chaos(points, width=0.05):
    return ChaoticAttractor(None, np.asarray(points, float), 0.1, 0.01, width)


# following

class Followed(PeriodicOrbit):
    """A periodic orbit that is only its section points, of the class that is solved for."""

    def __init__(self, points, periods=None, success=True, stable=True):
        self._points, self._about = np.array(points, float), (periods or len(points), success, stable)

    sections = property(lambda self: self._points)
    state = property(lambda self: self._points[0])
    periods = property(lambda self: self._about[0])
    success = property(lambda self: self._about[1])
    stable = property(lambda self: self._about[2])
    family, intervals = (), {}


@pytest.fixture
def world(monkeypatch):
    """What Newton and a simulation answer, and what they were asked."""
    made = SimpleNamespace(newton=None, motion=None, asked=[])

    def find_orbit(system, guess, periods):
        made.asked.append(("newton", guess, periods))
        if isinstance(made.newton, Exception):
            raise made.newton
        return made.newton

    def examine(system, y, scale):
        made.asked.append(("motion", np.array(y)))
        return made.motion
    monkeypatch.setattr(matching, "find_orbit", find_orbit)
    monkeypatch.setattr(matching, "examine", examine)
    return made


def test_an_orbit_is_followed_by_newton_and_where_that_fails_by_its_motion(world):
    old = Followed([[8.0, -3.0], [1.0, 0.3]])
    near = 0.9 * matching.CLOSE
    for shift, continued in ((near, True), (2.5 * near, False)):
        for k in (0, 1):  # in units of each component; the second section point counts too
            moved = old.state.copy()
            moved[k] += shift * SCALE[k]
            world.newton = Followed([[50.0, 50.0], moved])
            found, same = matching.follow(None, old, SCALE)
            assert found is world.newton and same is continued
    world.newton = Followed([[0.0, 0.0]])
    assert matching.follow(None, old, SCALE) == (world.newton, False)  # of another period
    assert {item[0] for item in world.asked} == {"newton"} and world.asked[-1][1:] == (old, 2)
    for lost in (Followed(old.sections, success=False), Followed(old.sections, stable=False)):
        lost._points = old.sections + 5.0
        world.newton, world.motion, world.asked = lost, Followed([[1.0, 0.3], [8.0, -3.0]]), []
        assert matching.follow(None, old, SCALE) == (world.motion, True)
        assert world.asked[1][0] == "motion" and world.asked[1][1].tolist() == [8.0, -3.0]
        world.motion = Followed([[19.0, 0.0], [28.0, 0.0]])
        assert matching.follow(None, old, SCALE) == (world.motion, False)
        world.motion = None
        assert matching.follow(None, old, SCALE) == (None, False)
    world.newton = ValueError("beyond a stop")
    assert matching.follow(None, old, SCALE) == (None, False)


def test_a_sample_is_followed_by_the_motion_from_its_last_point(world, rng):
    old = chaos(rng.random((500, 2)))
    world.motion = chaos(rng.random((500, 2)))
    assert matching.follow(None, old, SCALE) == (world.motion, True)
    assert len(world.asked) == 1 and world.asked[0][1].tolist() == old.points[-1].tolist()
    world.motion = Followed([[0.0, 0.0]])
    assert matching.follow(None, old, SCALE) == (world.motion, False)


def test_a_sample_that_is_known_next_door_is_not_followed(monkeypatch, rng):
    points = rng.random((2000, 2)) * SCALE
    mine, other, apart = chaos(points), chaos(points[::2]), chaos(points + 3.0 * SCALE)
    followed = []

    def follow(system, item, scale):
        followed.append((system, item))
        return other, True
    monkeypatch.setattr(matching, "follow", follow)
    links = matching.Links(["here", "there"], [np.full(2, np.nan), SCALE], [[mine], [apart, other]])
    assert links.link(0, 0, 1) == (1, True) and not followed
    lonely = matching.Links(["here", "there"], [np.full(2, np.nan), SCALE], [[mine], [apart]])
    assert lonely.link(0, 0, 1) == (1, True) and followed == [("there", mine)] and lonely.attractors[1] == [apart, other]
    assert lonely.grown == {1}
    assert lonely.link(0, 0, 1) == (1, True) and len(followed) == 1  # asked once


def test_links_up_and_down_are_those_of_the_neighbour_they_lead_to(monkeypatch):
    """Attractors are pairs (name, system); what is followed carries the system to which it was followed."""
    monkeypatch.setattr(matching, "follow", lambda system, item, scale: ((item[0], system), scale == system))
    monkeypatch.setattr(matching, "place_of",
                        lambda item, known, scale: known.index(item) if item in known and scale == item[1] else None)
    rows = [[("a", 0)], [("b", 1), ("a", 1)], [("a", 2)], []]
    links = matching.Links(range(4), range(4), [list(row) for row in rows])
    assert links.among() == {(0, 0, 1): (1, True), (1, 1, -1): (0, True), (1, 1, 1): (0, True), (2, 0, -1): (1, True)}
    links.spread()
    assert [sorted(row) for row in links.attractors] == [[(name, i) for name in "ab"] for i in range(4)]
    assert [row[:len(first)] for row, first in zip(links.attractors, rows, strict=True)] == rows  # those known keep their numbers
    numbers, parents = links.tracks()
    named = {(name, number) for row, mine in zip(links.attractors, numbers, strict=True)
             for (name, _), number in zip(row, mine, strict=True)}
    assert named == {("a", 0), ("b", 1)} and parents == {}


def test_the_parent_of_a_track_is_the_first_that_is_lost_to_it():
    links = matching.Links(range(3), range(3), [["a", "b", "c"], ["d", "c"], ["d"]])
    links._done = {(0, 0, 1): (0, False), (0, 1, 1): (0, False), (0, 2, 1): (1, True), (1, 0, -1): None, (1, 1, -1): (2, True),
                   (1, 0, 1): (0, True), (1, 1, 1): (0, False), (2, 0, -1): (0, True)}
    assert links.tracks() == ([[0, 1, 2], [3, 2], [3]], {3: 0})
    fresh = matching.Links(range(2), range(2), [["a"], ["a", "b"]])
    fresh._done = {(0, 0, 1): (0, True), (1, 0, -1): (0, True), (1, 1, -1): None}
    assert fresh.tracks() == ([[0], [0, 1]], {})  # nothing became it


# discovery

class Strips:
    """Motions of a plane of strips: from a start they go to the centre of its strip; ``slow`` of them do not arrive in time."""

    section = None

    def __init__(self, centres, edges, slow=()):
        self.centres, self.edges, self.slow, self.asked = np.array(centres, float), np.array(edges, float), slow, []

    def of(self, x):
        return int(np.searchsorted(self.edges, x))

    def label(self, X, targets, most):
        self.asked.append((len(X), most))
        labels, states = np.full(len(X), -1), np.full(len(X), UNSETTLED)
        for i, x in enumerate(X):
            k = self.of(x[0])
            end = self.centres[k]
            away = np.linalg.norm(targets.points - end / SCALE, axis=1) if len(targets.points) else np.array([np.inf])
            if k not in self.slow and away.min() <= 1e-12:
                labels[i], states[i] = targets.owner[np.argmin(away)], REACHED
            X[i] = end if k not in self.slow else end + 0.5 * (x - end)
        return SimpleNamespace(labels=labels, states=states)


@pytest.fixture
def found(monkeypatch):
    def begin(strips, known=(), tolerance=1e-2, nothing=()):
        def examine(system, y, scale, section):
            k = strips.of(y[0])
            return None if k in nothing else orbit(strips.centres[k], events=k)
        monkeypatch.setattr(looking, "examine", examine)
        monkeypatch.setattr(looking, "targets_of", lambda items, radii, scale, section: SimpleNamespace(
            points=np.array([point for item in items for point in item.sections / scale]).reshape(-1, 2),
            owner=np.array([k for k, item in enumerate(items) for _ in item.sections], int), radii=list(radii)))
        options = {"seed": 0, "tolerance": tolerance, "max_periods": 500}
        return looking.Discovery(None, strips, SCALE, options, list(known))
    return begin


def test_every_strip_that_holds_a_start_is_found_once(found, rng):
    strips = Strips([[0.0, 1.0], [4.0, -1.0], [8.0, 0.0], [12.0, 2.0]], [2.0, 6.0, 10.0])
    looked = found(strips)
    starts = np.column_stack([rng.uniform(-1.0, 9.9, 60), rng.normal(size=60)])
    looked.search(starts)
    assert sorted(item.state[0] for item in looked.attractors) == [0.0, 4.0, 8.0]
    assert [seed.tolist() for seed in looked.seeds] == [item.state.tolist() for item in looked.attractors]
    assert looked.radii == [1e-2] * 3
    looked.search(starts)
    assert len(looked.attractors) == 3  # nothing new
    again = found(strips)
    again.repeat(np.array(looked.seeds))
    assert [item.state.tolist() for item in again.attractors] == [item.state.tolist() for item in looked.attractors]
    last = found(strips)
    last.search(np.column_stack([np.r_[np.zeros(10), 4.0, 8.0], np.zeros(12)]))
    assert [item.state[0] for item in last.attractors] == [0.0, 4.0, 8.0]  # those that are left are looked at, in their order
    given = found(strips, known=[orbit([12.0, 2.0], events=9)])
    given.search(starts)
    assert given.attractors[0].state[0] == 12.0 and len(given.attractors) == 4 and len(given.seeds) == 3
    order = given.order()
    assert order[0] == 0 and [given.attractors[k].state[0] for k in order] == [12.0, 0.0, 4.0, 8.0]  # by impacts


def test_ends_that_are_no_attractor_are_looked_at_a_few_times(found):
    strips = Strips([[0.0, 0.0], [4.0, 0.0]], [2.0])
    looked = found(strips, nothing=(0,))
    looked.search(np.column_stack([np.r_[np.zeros(3), 3.0, np.zeros(3)], np.zeros(7)]))
    assert [item.state[0] for item in looked.attractors] == [4.0]
    tired = found(strips, nothing=(0,))
    tired.search(np.column_stack([np.r_[np.zeros(40), 3.0], np.zeros(41)]))
    assert tired.attractors == []


@pytest.mark.parametrize("edge", [3e-3, 4e-4, 1e-6])
@pytest.mark.parametrize("away", [1, -1])
def test_a_radius_shrinks_until_its_surroundings_come_back(found, edge, away):
    """The boundary of a strip passes ``edge`` scales beside the orbit: a shell of that radius or less lies within."""
    strips = Strips([[0.0, 0.0], [8.0, 0.0]], [edge * SCALE[0]]) if away > 0 else Strips([[-8.0, 0.0], [0.0, 0.0]],
                                                                                         [-edge * SCALE[0]])
    looked = found(strips, known=[orbit([8.0 * away, 0.0]), orbit([0.0, 0.0])])
    assert looked.radii[0] == 1e-2 and 0.1 * edge < looked.radii[1] <= 1.3 * edge  # a shell of eight seldom points at it
    slow = found(Strips(strips.centres, [99.0 if away > 0 else -99.0], slow=(0, 1)), known=[orbit([0.0, 0.0])])
    assert slow.radii == [1e-2]  # slow is allowed, while it does not go away


class Leaving:
    """Motions that double their distance from the origin every period; what has left ends at another attractor."""

    section = None

    def label(self, X, targets, most):
        away = np.linalg.norm(X / SCALE, axis=1)
        near = away <= 1.01 * targets.radii[-1]
        return SimpleNamespace(labels=np.where(near, len(targets.radii) - 1, 0), states=np.full(len(X), REACHED))


def test_a_shell_that_only_leaves_has_not_come_back_where_it_starts(found):
    looked = found(Leaving(), known=[orbit([8.0, 0.0]), orbit([0.0, 0.0])])
    assert looked.radii[1] <= looking.LEAST


def test_orders_of_attractors(found):
    looked = found(Strips([[0.0, 0.0]], []))
    sample = chaos(np.zeros((4, 2)))
    looked.attractors = [sample, orbit([1.0, 0.0], [2.0, 0.0]), orbit([5.0, 0.0], events=3), orbit([2.0, 9.0], events=1),
                         orbit([-3.0, 0.0], events=1)]
    looked.given = 0
    assert looked.order() == [4, 3, 2, 1, 0]
    looked.given = 2
    assert looked.order() == [0, 1, 4, 3, 2]


def test_targets_hold_every_section_point_with_the_radius_of_its_attractor():
    made = targets_of([orbit([4.0, 1.0], [8.0, -1.0]), orbit([0.0, 0.5])], [0.1, 0.2], SCALE)
    np.testing.assert_allclose(made[1], [[1.0, 2.0], [2.0, -2.0], [0.0, 1.0]])
    np.testing.assert_allclose(made[2], [0.01, 0.01, 0.04])
    assert made[3].tolist() == [0, 0, 1]


# sets of a saddle in other units

GROWN = np.array([[1.7, 0.5], [0.6, 0.9]])


def bent(scale, tear=np.inf, end=np.inf):
    """A saddle with a bend in scaled states, torn where its first component passes ``tear``, where motions from beyond ``end`` are
    lost; more impacts beyond 0.05."""
    def apply(X, periods=1):
        u, hits, lost = X / scale, np.zeros(len(X), np.int64), np.zeros(len(X), bool)
        for _ in range(periods):
            lost |= u[:, 0] > end
            hits = (np.abs(u[:, 0]) > 0.05).astype(int)
            jump = np.where(u[:, 0] > tear, 0.25, 0.0)
            u = u @ GROWN.T + 0.3 * np.column_stack([np.zeros(len(u)), u[:, 0]**2]) + jump[:, None]
        return SimpleNamespace(ends=u * scale, outcomes=np.where(lost, LOST, MAPPED), impacts=hits, speeds=np.ones(len(X)))
    return apply


@pytest.mark.parametrize("scale", [[1024.0, 0.125], [0.0625, 256.0], [64.0, 64.0]])
@pytest.mark.parametrize("tear", [np.inf, 0.07])
@pytest.mark.parametrize("strict", [True, False])
def test_a_set_does_not_depend_on_the_units(scale, tear, strict):
    """Scales are powers of two: not a bit may change."""
    def grown(scale, gap):
        scale = np.array(scale)
        direction, multiplier = direction_of(bent(scale), scale, np.zeros(2), 1)
        sides = both_sides(bent(scale, tear), scale, np.zeros(2), direction, multiplier, strict)
        return multiplier, sides, [side.propagate(15, gap, 3000) for side in sides], [[piece / scale for piece in side.pieces]
                                                                               for side in sides]
    multiplier, sides, whole, pieces = grown([1.0, 1.0], 0.02)
    again = grown(scale, 0.02)
    assert multiplier == again[0] == pytest.approx(np.linalg.eigvals(GROWN).max(), rel=1e-8) and whole == again[2]
    for side, other, mine, theirs in zip(sides, again[1], pieces, again[3], strict=True):
        assert (side.corners, side.merging, side.breaks) == (other.corners, other.merging, other.breaks)
        assert len(mine) == len(theirs)
        for a, b in zip(mine, theirs, strict=True):
            np.testing.assert_array_equal(a, b)
            assert np.linalg.norm(np.diff(a, axis=0), axis=1).max(initial=0.0) <= 0.02
    if tear < np.inf:  # its images are torn as well, and not by the last period
        assert any(side.breaks for side in sides) and not all(whole)
        return
    assert not any(side.breaks for side in sides) and all(whole) and any(side.corners for side in sides)
    count, finer = (sum(len(piece) for mine in found for piece in mine) for found in (pieces, grown([1.0, 1.0], 0.005)[3]))
    assert count < finer < 4.5 * count  # no more points than the gap asks for


def test_where_motions_end_the_set_is_carried_up_to_the_end():
    known = []
    for scale in np.array([[1.0, 1.0], [1024.0, 0.125], [0.0625, 256.0]]):
        direction, multiplier = direction_of(bent(scale), scale, np.zeros(2), 1)
        ended = []
        for side in both_sides(bent(scale, end=0.06), scale, np.zeros(2), direction, multiplier):
            side.propagate(15, 0.02, 3000)
            ended.append((dict(side.ended), [len(piece) for piece in side.pieces], side.breaks, side.corners))
            if side.ended:  # the piece before the last ends where the next would be lost
                top = max((piece / scale)[:, 0].max() for piece in side.pieces)
                image = bent(np.ones(2))(np.array([[0.06, 0.06 * direction[1] / direction[0]]])).ends[0, 0]
                assert image - 0.01 < top < image + 0.02
        known.append(ended)
    assert known[0] == known[1] == known[2] and any(item[0] for item in known[0])


def test_lost_digits_are_told_from_a_jump():
    """Starts 1e-9 apart whose images lie apart: a jump of the last period; starts that are themselves far apart: not."""
    scale = np.array([8.0, 0.25])

    def apply(X, periods=1):
        return SimpleNamespace(ends=X * 10.0**periods, outcomes=np.zeros(len(X), int))
    side = Side(apply, scale, np.zeros(2), np.array([8.0, 0.0]), 10.0)
    s = np.array([0.0, 1e-12, 2e-12, 0.5])
    assert side.jumps(s, np.array([], int), 3) and side.jumps(s, np.array([0, 1]), 1)
    assert not side.jumps(s, np.array([0, 2]), 1)
    assert side.jumps(s, np.array([0]), 2) and not side.jumps(s, np.array([0]), 8)  # grown ten times a period before the last
    close = np.array([0.0, 0.5e-9 / np.log(10.0)])  # half of a billionth of the scale, which the first start is away
    assert side.jumps(close, np.array([0]), 1) and not side.jumps(4.0 * close, np.array([0]), 1)
    thin = Side(apply, scale, np.zeros(2), np.array([0.0, 0.25]), 10.0)
    assert thin.jumps(close, np.array([0]), 1) and not thin.jumps(4.0 * close, np.array([0]), 1)
    assert thin.jumps(s, np.array([0]), 2) and not thin.jumps(s, np.array([0]), 8)
