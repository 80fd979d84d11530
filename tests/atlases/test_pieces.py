"""Pieces of an atlas on stand-ins: orbits as points, places on branches, stable stretches, bands of chaos, what is said."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.atlases import identity
from bifurc.atlases import result as results
from bifurc.atlases.graph import graph_of
from bifurc.atlases.identity import (
    SAME,
    Node,
    _guesses,
    apart,
    mirrored_points,
    nodes_of,
    periods_of,
    points_of,
    same_orbit,
    same_points,
    symmetric,
    trimmed,
)
from bifurc.atlases.result import Atlas, AtlasStatus
from bifurc.atlases.search import Probe, Search
from bifurc.atlases.stability import stable_intervals
from bifurc.continuation import StopReason, trace
from bifurc.continuation.branches.special import SpecialPoints
from tests.continuation.problems import circle, hysteresis

WEIGHTS = np.array([2.0, 0.5])


def orbit(*points, symmetry=0, halves=None, periods=None):
    points = np.array(points, float)

    def states(times):
        whole = np.asarray(times)
        if (whole % 1.0 == 0.0).all():
            return points[whole.astype(int) % len(points)]
        return np.array(halves, float)[(whole - 0.5).astype(int) % len(halves)]

    return SimpleNamespace(
        _states=states,
        periods=periods or len(points),
        weights=WEIGHTS,
        scene=SimpleNamespace(ns=2),
        system=SimpleNamespace(symmetry=symmetry),
    )


# identity


def test_sets_of_points_are_compared_both_ways(rng):
    a, b = rng.normal(size=(3, 2)), rng.normal(size=(5, 2))
    distances = np.array([[np.linalg.norm(p - q) for q in b] for p in a])
    assert apart(a, b) == pytest.approx(max(distances.min(axis=0).max(), distances.min(axis=1).max()))
    assert apart(a, np.vstack([a, a])) == 0.0 and apart(a, a[:2]) > 0.0


def test_orbits_are_one_up_to_phase_and_symmetry():
    a = orbit([0.0, 0.0], [1.0, 0.3])
    assert same_orbit(a, orbit([1.0, 0.3], [0.0, 0.0])) and not same_orbit(a, orbit([1.0, 0.3], [0.0, 1e-3]))
    assert same_orbit(a, orbit([0.9 * SAME * 2.0, 0.0], [1.0, 0.3])) and not same_orbit(
        a, orbit([1.2 * SAME * 2.0, 0.0], [1.0, 0.3])
    )
    assert not same_orbit(a, orbit([0.0, 0.0])) and same_points(orbit([0.0, 0.0]), orbit([0.0, 1e-5], [0.0, -1e-5]), 1e-4)
    mirror = orbit([3.0, 1.0], [5.0, 2.0], symmetry=-1, halves=[[-1.0, 0.2], [-4.0, 0.4]])
    np.testing.assert_allclose(mirrored_points(mirror), [[0.5, -0.4], [2.0, -0.8]])
    np.testing.assert_allclose(points_of(mirror), [[1.5, 2.0], [2.5, 4.0]])
    image = orbit([4.0, -0.4], [1.0, -0.2])
    assert same_orbit(mirror, image) and not symmetric(mirror) and mirrored_points(a) is None and not symmetric(a)
    assert symmetric(orbit([1.0, -0.2], symmetry=-1, halves=[[-1.0, 0.2]]))
    other = orbit([0.0, 0.0], [1.0, 0.3])
    other.scene = SimpleNamespace(ns=3)
    assert not same_orbit(a, other)


def test_guesses_where_a_cubic_between_two_nodes_passes_a_value():
    """x(s) = (2 + s^3, s - s^2 + .4 s^3) between s = 1 and 3, in own units; the last is the parameter."""

    def place(s):
        return np.array([2.0 + s**3, s - s * s + 0.4 * s**3])

    def slope(s):
        return np.array([3.0 * s * s, 1.0 - 2.0 * s + 1.2 * s * s])

    first, last = (Node(s, float(place(s)[-1]), place(s), slope(s), 4) for s in (1.0, 3.0))
    for s in (1.0, 1.7, 2.6, 3.0):
        found = list(_guesses(first, last, float(place(s)[-1])))
        assert all(part == 4 and x[-1] == place(s)[-1] for part, x in found)
        assert any(np.allclose(x, place(s), atol=1e-9) for _, x in found)
    assert list(_guesses(first, last, 9.0)) == [] and list(_guesses(first, last, 0.0)) == []
    fold = [Node(s, 1.0 - s * s, np.array([s, 1.0 - s * s]), np.array([1.0, -2.0 * s]), 0) for s in (-1.0, 1.0)]
    assert sorted(round(float(x[0]), 9) for _, x in _guesses(*fold, 0.75)) == [-0.5, 0.5]
    assert list(_guesses(*fold, 1.1)) == []
    jump = Node(3.0, 5.0, np.array([7.0, 5.0]), slope(3.0), 5)
    assert [(part, x.tolist()) for part, x in _guesses(last, jump, 5.0)] == [(4, [29.0, 5.0]), (5, [7.0, 5.0])]
    assert list(_guesses(last, jump, 5.1)) == [] and last.x.tolist() == place(3.0).tolist()


def test_nodes_carry_derivatives_along_the_branch():
    """Rows and special points of a circle in order: tangents in own units are at right angles to it, and of unit length when
    scaled."""
    scale = np.array([3.0, 0.5])
    branch = trace(circle(scale_u=scale[0], scale_p=scale[1]), bounds=(-2.0, 2.0), peaks="u_0")
    nodes = nodes_of(branch)
    assert len(nodes) == len(branch) + len(branch.special_points) and len(branch.special_points) >= 3
    assert [node.s for node in nodes] == sorted(node.s for node in nodes)
    for node in nodes:
        assert node.parameter == node.x[-1] and node.part == 0 and node.x @ node.x == pytest.approx(1.0, abs=1e-12)
        assert node.tangent @ node.x == pytest.approx(0.0, abs=1e-9)
        assert np.linalg.norm(node.tangent / scale) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("low, high", [(0, 0), (3, 0), (0, 4), (3, 4), (36, 0), (0, 36), (41, 0), (20, 21)])
@pytest.mark.parametrize("place", ["elsewhere", "between", "on the row"])
def test_a_branch_ends_where_it_joins_one_of_shorter_period(low, high, place, monkeypatch):
    """Rows go from either end while their orbits repeat or have another period; a special point on the last of them is the end, and
    one behind it stays.  Such a row between others stays."""
    problem = hysteresis()
    branch = trace(problem, bounds=(-1.0, 1.0))
    s, p, count = branch.column("s"), branch.column("parameter"), len(branch)
    assert count == 41 and len(branch.special_points) == 2
    row_of = {float(branch.x(i)[0]): i for i in range(count)}

    def solution(x):
        i = row_of[float(x[0])]
        own = low <= i < count - high and i != 38
        return SimpleNamespace(periods=2 if own or i % 2 else 1, again=not own)

    monkeypatch.setattr(type(problem), "solution", lambda self, x: solution(x))
    monkeypatch.setattr(identity, "repeats", lambda orbit: orbit.again)
    if place != "elsewhere":  # beside the rows that stay, or on the last one that is taken away
        share = 0.5 if place == "between" else 1.0
        rows = np.interp((max(low - share, 0.0), min(count - high - 1.0 + share, count - 1.0)), np.arange(count), s)
        moved = [replace(point, s=float(at)) for point, at in zip(branch.special_points, rows, strict=True)]
        monkeypatch.setattr(branch, "special_points", SpecialPoints(moved))
    found = trimmed(branch, 2)
    if low + high == count:
        assert found is None
        return
    first, last = low, count - high - 1
    if place == "on the row":
        first, last = max(first - 1, 0), min(last + 1, count - 1)
    assert found.column("parameter").tolist() == p[first:last + 1].tolist()
    kept = [point.s for point in branch.special_points if place != "elsewhere" or s[first] <= point.s <= s[last]]
    assert [point.s for point in found.special_points] == kept
    for end, old, i, untouched in zip(found.ends, branch.ends, (first, last), (first == 0, last == count - 1), strict=True):
        assert end == old if untouched else (end.reason, end.message, end.p) == (StopReason.STOPPED, identity.JOINED, p[i])


# stable stretches and the graph


def branch_of(s, p, stable, points=(), closed=False, ends=("bound", "bound"), number=0):
    columns = {"s": np.array(s, float), "parameter": np.array(p, float), "stable": np.array(stable, float)}
    sequence = SimpleNamespace(span=2.0, closure=1)
    return _Branch(
        column=lambda name: columns[name],
        special_points=[point_of(*point) for point in points],
        closed=closed,
        ends=tuple(SimpleNamespace(reason=reason) for reason in ends),
        stop_reason=ends,
        orbits=[orbit([float(x) + 10.0 * number, 0.0]) for x in s],
        problems=[SimpleNamespace(sequence=sequence)],
        _arrays={"part": np.zeros(len(s), int)},
    )


class _Branch(SimpleNamespace):
    def __len__(self):
        return len(self.column("s"))


def point_of(s, p, kind="fold", place=None):
    return SimpleNamespace(
        s=s, parameter=p, kind=kind, solution=orbit([place if place is not None else s, 0.0]), measures={"max_0": 3.0, "x": 1.0}
    )


def test_stable_stretches_end_at_special_points():
    made = branch_of(
        range(8), [0, 1, 2, 3, 2.5, 1.5, 1, 0.5], [1, 1, 1, 0, 0, 1, 1, 0], [(2.6, 3.2), (4.4, 2.0), (6.5, 0.8), (9.0, 9.0)]
    )
    assert stable_intervals(made) == [(0.0, 3.2), (0.8, 2.0)]
    assert stable_intervals(branch_of(range(3), [0, 1, 2], [0, 0, 0])) == []
    assert stable_intervals(branch_of(range(3), [0, 1, 2], [1, 1, 1])) == [(0.0, 2.0)]
    turned = branch_of(range(4), [0, 1, 1, 0], [1, 1, 1, 1], [(1.5, 1.4)])
    assert stable_intervals(turned) == [(0.0, 1.4)]
    far = branch_of(range(4), [0, 1, 2, 3], [0, 1, 1, 0], [(0.2, 0.2), (0.7, 0.7), (2.3, 2.3), (2.8, 2.8)])
    assert stable_intervals(far) == [(0.7, 2.3)]  # those beside it


def test_pieces_of_branches_between_their_points():
    one = branch_of(range(5), [0, 1, 2, 3, 4], [1, 1, 0, 0, 0], [(1.5, 1.5)])
    doubled = branch_of([0.0, 1.0, 2.0], [1.5, 2.0, 2.5], [1, 1, 1], [(0.0, 1.5, "merged", 1.5)], number=1)
    graph = graph_of([one, doubled], (0.0, 4.0))
    data = {n: (d["kind"], d["parameter"], d["branches"]) for n, d in graph.nodes(data=True)}
    assert data[0] == ("bound", 0.0, [0]) and data[2] == ("bound", 4.0, [0])
    assert data[1] == ("fold + merged", 1.5, [0, 1])  # the same orbit at the same parameter
    assert graph.nodes[1]["measures"] == {"max_0": 3.0}
    edges = [(a, b, d["branch"], d["stable"], d["low"], d["high"], d["points"], d["periods"]) for a, b, d in graph.edges(data=True)]
    assert edges[0] == (0, 1, 0, True, 0.0, 1.5, 2, 2) and edges[1] == (1, 2, 0, False, 1.5, 4.0, 3, 2)
    assert {edge[2] for edge in edges[2:]} == {1} and all(edge[3] for edge in edges[2:])
    apart_ = graph_of([one, branch_of([0.0, 1.0], [1.5, 2.0], [1, 1], [(0.0, 1.5, "merged", 7.0)], number=1)], (0.0, 4.0))
    assert [d["kind"] for _, d in apart_.nodes(data=True)].count("merged") == 1  # another orbit there
    loop = graph_of([branch_of(range(4), [1, 2, 1, 0.5], [1, 1, 1, 0], [(1.0, 2.0), (3.0, 0.5)], closed=True)], (0.0, 4.0))
    assert loop.number_of_nodes() == 2 and loop.number_of_edges() == 2
    bare = graph_of([branch_of(range(3), [1, 2, 1], [1, 1, 1], closed=True)], (0.0, 4.0))
    assert [d["kind"] for _, d in bare.nodes(data=True)] == ["closed"] and bare.number_of_edges() == 1
    for kind, count in (("branch_point", 1), ("fold", 2)):  # a branch that crosses itself passes that point twice
        eight = branch_of(range(5), [0, 1, 2, 1, 3], [1] * 5, [(1.0, 1.0, "branch_point", 5.0), (3.0, 1.0, kind, 5.0)])
        crossed = graph_of([eight], (0.0, 4.0))
        assert [d["kind"] for _, d in crossed.nodes(data=True)].count("bound") == 2 and len(crossed) == 2 + count
        assert crossed.number_of_edges() == 3
    ended = branch_of(range(5), [0, 1, 2, 3, 4], [1] * 5, [(3.999, 4.0, "chatter_completion")], ends=("bound", "no_successor"))
    assert [d["kind"] for _, d in graph_of([ended], (0.0, 4.0)).nodes(data=True)] == ["bound", "chatter_completion"]


# what an atlas says


def probe(value, exponents=(None,), why="check", counts=(3,), **more):
    return Probe(
        value, [0], [1], list(exponents), list(counts), **{"starts": 100, "unresolved": 0, "outside": 0, "why": why, **more}
    )


def atlas(probes=(), status=AtlasStatus.NOTHING_NEW, branches=(), **more):
    return Atlas(
        SimpleNamespace(n=1, symmetry=0),
        "p",
        (0.0, 10.0),
        "REGION",
        tuple(branches),
        ("x",) * len(branches),
        tuple(probes),
        more.pop("untraced", ()),
        more.pop("failures", ()),
        {"checks": 20, "periods": 4},
        status,
        "key",
    )


def test_the_rows_of_a_closed_branch_lie_in_one_piece_each_wherever_it_was_begun():
    """Those on a point in the two that meet there; one piece leads across the place where the trace began and ended."""
    p = [1.0, 1.4, 2.0, 1.6, 1.2, 0.7, 0.5, 0.8]
    for first in range(len(p)):
        marks = sorted([((2 - first) % 8, 2.0), ((6 - first) % 8, 0.5)])
        points = [(float(s), value, "fold", value) for s, value in marks]
        loop = branch_of(range(8), np.roll(p, -first), [1] * 8, points, closed=True)
        edges = [d for *_, d in graph_of([loop], (0.0, 4.0)).edges(data=True)]
        assert [(d["low"], d["high"]) for d in edges] == [(0.5, 2.0)] * 2
        assert sorted(d["points"] for d in edges) == [5, 5]  # three rows between the points, and these


def test_bands_of_chaos_end_half_way_to_a_probe_without_it():
    made = atlas([probe(4.0, (None, 0.3)), probe(1.0), probe(5.0, (0.5,)), probe(8.0), probe(9.0, (0.1,)), probe(2.0)])
    assert made.chaos == ((3.0, 6.5, 0.5), (8.5, 10.0, 0.1))
    assert atlas([probe(2.0, (0.2,))]).chaos == ((0.0, 10.0, 0.2),) and atlas([probe(2.0)]).chaos == ()
    assert probe(1.0, (None, 0.3, 0.1)).chaos == 0.3 and probe(1.0).chaos is None
    search = SimpleNamespace(probes=made.probes)
    assert Search.edges(search) == [3.0, 6.5, 8.5]


def test_stable_bands_and_what_is_unknown():
    branches = [
        branch_of(range(3), [1, 2, 3], [1, 1, 1]),
        branch_of(range(3), [2, 4, 6], [1, 1, 1]),
        branch_of(range(3), [8, 9, 9.5], [0, 0, 0]),
    ]
    made = atlas(branches=branches)
    assert made.stable == ((1.0, 3.0, 0), (2.0, 6.0, 1))
    assert made.coexistence == ((0.0, 1.0, ()), (1.0, 2.0, (0,)), (2.0, 3.0, (0, 1)), (3.0, 6.0, (1,)), (6.0, 10.0, ()))
    assert made.unknown == [(0.0, 1.0), (6.0, 10.0)]
    assert repr(made) == "Atlas(p from 0 to 10, 3 branches, 0 bands of chaos, 0 probes, nothing_new)"
    assert made.message == AtlasStatus.NOTHING_NEW.sentence


def test_statements_tell_what_was_missed_with_which_chance():
    """(1 - f)^100 = .05 and (1 - w)^20 = .05."""
    text = atlas([probe(float(k), unresolved=1, outside=2) for k in range(25)]).statement
    assert text.startswith("2500 starts at 25 values of p in 'REGION'; 0 branches (orbits from switching up to 4 forcing periods).")
    assert f"draws {100 * (1 - 0.05**0.01):.2g} % of the region or more was missed with a probability below 5 %." in text
    assert "The last 20 values, drawn at random, showed nothing new: with 95 % confidence" in text
    assert f"less than {100 * (1 - 0.05**0.05):.0f} % of the range." in text
    assert "25 starts did not settle, 50 diverged or began beyond a stop." in text and text.endswith(
        AtlasStatus.NOTHING_NEW.sentence
    )
    few = atlas([probe(1.0), probe(2.0, why="first")], failures=("a", "b")).statement
    assert "The last 1 values" in few and "did not settle" not in few and "2 parts of the work failed." in few
    still = atlas([probe(1.0)], AtlasStatus.STILL_FINDING).statement
    assert "drawn at random" not in still and still.endswith(AtlasStatus.STILL_FINDING.sentence)
    assert "was missed" not in atlas().statement
    where = {"0": (-0.5, 0.25)}
    with_rest = atlas([probe(3.0, continua=[where]), probe(1.0, continua=[{"1": (0.0, 1.0)}]), probe(2.0)]).statement
    assert (
        "At 2 of 3 values, from 1 to 3, motions form a continuum" in with_rest and "at 3 q0 anywhere in [-0.5, 0.25]." in with_rest
    )
    assert "state 1 anywhere in [0, 1]" in atlas([probe(1.0, continua=[{"1": (0.0, 1.0)}])])._continua()
    assert atlas([probe(1.0)])._continua() == ""


def test_the_status_of_a_search(monkeypatch):
    def of(**more):
        search = SimpleNamespace(
            **{
                "finished": True,
                "full": False,
                "branches": ["b"],
                "probes": [probe(1.0)],
                "options": {"checks": 3},
                "job": {"samples": 7, "options": {"seed": 1}},
                "system": "S",
                "parameter": "p",
                "bounds": (0.0, 1.0),
                "origins": ["o"],
                "untraced": [],
                "failures": [],
                "store": SimpleNamespace(key="k"),
                **more,
            }
        )
        return Atlas.of(search, "R")

    made = of()
    assert made.status is AtlasStatus.NOTHING_NEW and made.options == {"checks": 3, "samples": 7, "seed": 1} and made.key == "k"
    assert of(finished=False).status is AtlasStatus.STILL_FINDING and of(full=True).status is AtlasStatus.MOST_BRANCHES
    assert of(branches=[], probes=[probe(1.0, counts=(0,))]).status is AtlasStatus.NO_MOTION
    assert of(branches=[]).status is AtlasStatus.NOTHING_NEW and of(probes=[]).status is AtlasStatus.NOTHING_NEW
    assert results.SURE == 0.95


@pytest.mark.parametrize("spans, closure, periods", [((1.0, 3.0, 1.0), 1, 3), ((0.5, 1.5, 0.5), -1, 3), ((2.0, 2.0, 4.0), 1, 2)])
def test_periods_of_a_branch_are_those_of_its_middle_row_half_orbits_counted_twice(spans, closure, periods):
    problems = [SimpleNamespace(sequence=SimpleNamespace(span=span, closure=closure)) for span in spans]

    class Branch(SimpleNamespace):
        def __len__(self):
            return 5

    branch = Branch(problems=problems, _arrays={"part": np.array([0, 0, 1, 2, 2])})
    assert periods_of(branch) == periods
