"""The search of an atlas with plain objects in the place of branches and orbits; orbits looked up on branches that are curves."""
from types import SimpleNamespace

import networkx as nx
import numpy as np
import pytest

from bifurc.atlases import identity, jobs, search
from bifurc.atlases.graph import graph_of
from bifurc.atlases.search import Probe, Search
from bifurc.continuation.kinds import ContinuationError, SpecialPointKind
from bifurc.orbits.orbit import PeriodicOrbit


class Curve:
    """A branch u = f(p), traced in p from the left, of orbits that are one point each."""

    parameter, problems = "p", ()

    def __init__(self, value, low=0.0, high=1.0, stable=lambda p: True, rows=9, periods=1, points=(), reasons=("bound", "bound")):
        self.value, self.low, self.high, self.is_stable, self.periods = value, low, high, stable, periods
        self.p = np.linspace(low, high, rows)
        self.special_points, self.closed, self.ends = points, False, [SimpleNamespace(reason=reason) for reason in reasons]

    def __len__(self):
        return len(self.p)

    def column(self, name):
        return {"parameter": self.p, "s": self.p, "stable": np.array([float(self.is_stable(p)) for p in self.p])}[name]

    @property
    def orbits(self):
        return [self.at(p) for p in self.p]

    def at(self, p):
        return orbit(self.value(p), p, self.periods, self.is_stable(p))


def orbit(u, p, periods=1, stable=True):
    return SimpleNamespace(u=u, p=p, periods=periods, stable=stable, success=True, weights=np.ones(1), intervals={},
                           scene=SimpleNamespace(ns=1), system=SimpleNamespace(symmetry=None, parameter=lambda name: p),
                           _states=lambda times: np.full((len(times), 1), float(u)))


@pytest.fixture
def found(monkeypatch):
    """A search whose orbits are looked up on curves."""
    monkeypatch.setattr(search, "nodes_of", lambda branch: branch)
    monkeypatch.setattr(search, "periods_of", lambda branch: branch.periods)
    monkeypatch.setattr(search, "orbits_at", lambda branch, value, nodes: iter(
        [branch.at(value)] if branch.low <= value <= branch.high else []))
    monkeypatch.setattr(search, "on_branch", lambda o, branch, nodes: branch.periods == o.periods
                        and branch.low <= o.p <= branch.high and abs(branch.value(o.p) - o.u) < 1e-9)
    options = {"probes": 4, "seed": 0, "checks": 3, "longest": 4, "most_branches": 3, "periods": 4, "trace": {}}
    return Search(SimpleNamespace(), "p", (0.0, 1.0), {"elements": (), "system": "s"}, options, None, {"workers": 1})


def probe(value, exponents=(), why="first"):
    return Probe(value, [], [], list(exponents), [], 8, 0, 0, why)


def test_edges_of_chaos_lie_half_way_between_probes_that_differ(found):
    found.probes = [probe(0.5, [None, 0.3]), probe(0.1), probe(0.3, [None]), probe(0.9, [0.1]), probe(0.7, [0.2, 0.5])]
    assert found.edges() == [pytest.approx(0.4)]
    assert found.probes[-1].chaos == 0.5 and probe(0.1, [None]).chaos is None
    found.probes.append(probe(0.95))
    assert found.edges() == [pytest.approx(0.4), pytest.approx(0.925)]


def test_branches_are_admitted_replaced_by_longer_ones_and_limited(found):
    short, whole = Curve(lambda p: p, 0.2, 0.6, rows=5), Curve(lambda p: p, rows=9)
    found.admit(short, "a")
    assert found.branch_of(orbit(0.4, 0.4)) == 0 and found.branch_of(orbit(0.9, 0.9)) is None
    found.admit(whole, "b")
    assert found.branches == [whole] and found.origins == ["a"] and found._stable == [[(0.0, 1.0)]]
    found.admit(Curve(lambda p: p, 0.2, 0.6, rows=9), "of as many rows")
    assert len(found.branches) == 2 and not found.full
    found.admit(Curve(lambda p: p, periods=2, rows=20), "c")
    assert len(found.branches) == 3 and found.full and found.origins == ["a", "of as many rows", "c"]
    assert found.branch_of(orbit(0.3, 0.3, 2)) == 2


def test_stretches_without_a_stable_motion_and_without_a_probe_are_missing(found):
    found.admit(Curve(lambda p: p, stable=lambda p: 0.3 < p < 0.6), "a")
    (low, high), = found._stable[0]
    assert found.missing() == [pytest.approx(0.5 * low), pytest.approx(0.5 * (1.0 + high))]
    found.probes = [probe(0.05)]
    assert found.missing() == [pytest.approx(0.5 * (1.0 + high))]
    found._stable = [[(0.0, 0.9995)]]
    assert found.missing() == []  # shorter than is looked into
    found._stable, found.probes = [[(0.0, 0.9985)]], []
    assert len(found.missing()) == 1


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_stretches_are_looked_into_by_their_part_of_the_range(found, unit):
    """Whatever the unit of the parameter."""
    found.bounds = (2.0 * unit, 3.0 * unit)
    found._stable = [[(2.0 * unit, 2.9985 * unit)]]
    assert found.missing() == [pytest.approx(2.99925 * unit)]
    found._stable = [[(2.0 * unit, 2.9995 * unit)]]
    assert found.missing() == []


def test_stable_orbits_at_a_value_are_those_of_stable_intervals(found):
    found.admit(Curve(lambda p: p, stable=lambda p: p < 0.5), "a")
    found.admit(Curve(lambda p: -p), "b")
    at = found.stable_at(0.25)
    assert [(number, o.u) for number, o in at] == [(0, 0.25), (1, -0.25)]
    assert [number for number, _ in found.stable_at(0.9)] == [1]
    assert found.stable_at(2.0) == []


def test_new_attractors_are_placed_queued_or_too_long(found):
    found.admit(Curve(lambda p: p), "a")
    assert found.place(orbit(0.3, 0.3), 0.3) == 0 and not found._queue
    assert found.place(orbit(0.7, 0.3), 0.3) == -1 and found._queue[0][1] == "starts at p = 0.3"
    assert found.place(orbit(0.7, 0.3, 5), 0.3) == -1 and len(found._queue) == 1
    assert found.untraced == [(0.3, "attractor of 5 forcing periods: longer than longest = 4")]
    assert found.place(orbit(0.7, 0.3, 4), 0.3) == -1 and len(found._queue) == 2


@pytest.fixture
def traced(found, monkeypatch):
    """The same, with curves in the place of what is traced, and what each offers."""
    curves, asked = {}, []
    monkeypatch.setattr(search, "packed", lambda orbits: (orbits, {}))
    monkeypatch.setattr(search, "packed_points", lambda orbits: (orbits, {}))
    monkeypatch.setattr(search, "unpacked_branches", lambda headers, arrays, elements: headers)
    monkeypatch.setattr(search, "unpacked_points", lambda headers, arrays, elements: headers)

    def run(store, work, payloads, **more):
        asked.append((work, payloads))
        results, failures = [], {}
        for n, payload in enumerate(payloads):
            if work is search.trace_orbits:
                [o] = payload["orbits"]
                curve, offers, why = curves.get(o.u, (None, [], "refused"))
                if curve == "fails":
                    results.append(None)
                    failures[n] = "a reason"
                    continue
                results.append(({"branches": [{"header": curve, "why": why, "offers": offers, "at": [x.p for x in offers]}]}, {}))
            else:
                value = payload["points"][0]["p"]
                items = payload["known"][0] + found.attractors(value)
                results.append(({"points": [{"attractors": items, "counts": [1] * len(items), "starts": 8, "unresolved": 1,
                                             "outside": 2}]}, {}))
        return SimpleNamespace(results=results, failures=failures)
    monkeypatch.setattr(search, "run_chunks", run)
    found.attractors = lambda value: []
    return found, curves, asked


def test_what_is_queued_is_traced_once_with_what_it_offers(traced):
    found, curves, asked = traced
    found.options["most_branches"] = 10
    curves[0.5] = Curve(lambda p: 0.5), [orbit(2.0, 0.75)], None
    curves[2.0] = Curve(lambda p: 2.0), [], None
    curves[9.0] = "fails", [], None
    found._queue = [(orbit(0.5, 0.1), "first"), (orbit(0.5, 0.2), "the same"), (orbit(7.0, 0.3), "x"), (orbit(9.0, 0.4), "y")]
    found.drain()
    assert [b.value(0.0) for b in found.branches] == [0.5, 2.0] and not found._queue
    assert found.origins == ["first", "p = 0.75 on branch 0"]
    assert found.untraced == [(0.3, "refused")] and found.failures == ["y: a reason"]
    (work, payloads), (_, again) = asked
    assert work is search.trace_orbits and len(payloads) == 4 and len(again) == 1
    assert payloads[0]["bounds"] == [0.0, 1.0] and payloads[0]["parameter"] == "p" and payloads[0]["periods"] == 4
    found._queue = [(orbit(0.5, 0.1), "known")]
    found.drain()
    assert len(asked) == 2 and not found._queue


def test_probes_record_what_starts_led_to(traced):
    found, _, asked = traced
    found.admit(Curve(lambda p: p), "a")
    rest = orbit(5.0, 0.2)
    rest.intervals = {0: (1, 2)}
    found.attractors = lambda value: [rest]
    found.probe([0.2, 0.4], "check")
    first = found.probes[0]
    assert (first.value, first.why, first.branches, first.periods) == (0.2, "check", [0, -1], [1, 1])
    assert first.exponents == [None, None] and (first.starts, first.unresolved, first.outside) == (8, 1, 2)
    assert first.continua == [{"0": [1.0, 2.0]}] and first.counts == [1, 1]
    assert asked[0][1][1]["points"] == [{"p": 0.4}] and asked[0][1][1]["system"] == "s"
    assert len(found._queue) == 2 and found.probes[1].value == 0.4


def test_a_search_ends_when_a_check_finds_nothing_new(traced):
    found, curves, asked = traced
    curves[0.5] = Curve(lambda p: 0.5), [], None
    found.attractors = lambda value: [orbit(0.5, value)] if not found.branches else []
    found.go()
    assert found.finished and len(found.branches) == 1
    whys = [p.why for p in found.probes]
    assert whys == ["first"] * 4 + ["check"] * 3
    np.testing.assert_allclose([p.value for p in found.probes[:4]], [0.125, 0.375, 0.625, 0.875])
    assert sorted(p.value for p in found.probes[4:]) == [p.value for p in found.probes[4:]]


def test_a_search_that_is_full_stops(traced):
    found, curves, _ = traced
    found.options["most_branches"] = 1
    curves[0.5] = Curve(lambda p: 0.5), [], None
    found.attractors = lambda value: [orbit(0.5, value)]
    found.go()
    assert found.full and not found.finished and len(found.branches) == 1 and {p.why for p in found.probes} == {"first"}


# orbits on branches

class Problem:
    """u = p^2, corrected at a given parameter."""

    index, scale, sequence = 0, np.ones(2), SimpleNamespace(span=1.0, closure=1.0)

    def correct(self, x, tangent, fixed):
        assert fixed and tangent.tolist() == [0.0, 1.0]
        return SimpleNamespace(converged=x[-1] < 1.8, x=np.array([x[-1]**2, x[-1]]))

    def solution(self, x):
        return orbit(x[0], x[1])


def arc(values):
    problem = Problem()
    nodes = [identity.Node(float(k), float(p), np.array([p * p, p]), np.array([2.0 * p, 1.0]), 0) for k, p in enumerate(values)]
    return SimpleNamespace(problems=[problem], parameter="p", _arrays={"part": np.zeros(len(values), int)}, nodes=nodes,
                           __len__=lambda: len(values)), nodes


def test_orbits_of_a_branch_at_a_value():
    branch, nodes = arc(np.linspace(0.0, 2.0, 9))
    for value in (0.0, 0.3, 1.0, 1.7):
        [only] = identity.orbits_at(branch, value, nodes)
        assert only.u == pytest.approx(value**2, abs=1e-15) and only.p == value
    assert list(identity.orbits_at(branch, 2.5, nodes)) == [] and list(identity.orbits_at(branch, 1.9, nodes)) == []


def test_an_orbit_run_through_twice_repeats_and_mirror_images_are_one():
    def of(states, symmetry=None):
        states = np.array(states, float)
        return SimpleNamespace(periods=len(states) // 2, weights=np.ones(1), scene=SimpleNamespace(ns=1), system=SimpleNamespace(
            symmetry=symmetry), _states=lambda times: states[np.round(2.0 * np.asarray(times)).astype(int), None])
    assert identity.repeats(of([1, 0, 2, 0, 1, 0, 2, 0])) and not identity.repeats(of([1, 0, 2, 0, 1, 0, 3, 0]))
    assert not identity.repeats(of([1, 0])) and identity.repeats(of([1, 0, 1, 5]))
    a, image = of([1, 3], -1), of([-3, -1], -1)
    assert identity.same_orbit(a, image) and not identity.same_orbit(of([1, 3]), of([-3, -1]))
    assert identity.same_orbit(of([1, 0, 2, 0]), of([2, 0, 1, 0])) and not identity.same_orbit(of([1, 0]), of([1, 0, 1, 0]))
    assert identity.same_points(of([1, 0]), of([1, 0, 1, 0]), 1e-9)
    assert identity.symmetric(of([1, -1], -1)) and not identity.symmetric(of([1, 1], -1)) and not identity.symmetric(of([1, -1]))


# graph

def point(s, kind, u):
    return SimpleNamespace(s=s, kind=kind, parameter=s, solution=orbit(u, s), measures={"max_0": u, "other": 1.0})


def test_branches_that_meet_at_a_point_share_its_node(monkeypatch):
    monkeypatch.setattr("bifurc.atlases.graph.periods_of", lambda branch: branch.periods)
    first = Curve(lambda p: p, points=[point(0.5, "period_doubling", 0.5)], stable=lambda p: p < 0.5)
    second = Curve(lambda p: 1.5 * p - 0.25, 0.5, 1.0, periods=2, reasons=("no_successor", "bound"))
    graph = graph_of([first, second], (0.0, 1.0))
    assert isinstance(graph, nx.MultiGraph) and graph.number_of_nodes() == 4
    shared = [n for n, data in graph.nodes(data=True) if data["branches"] == [0, 1]]
    kinds = {graph.nodes[n]["kind"] for n in shared}
    assert "period_doubling + no_successor" in kinds
    edges = {(d["branch"], d["stable"], d["periods"]): d for _, _, d in graph.edges(data=True)}
    assert set(edges) == {(0, True, 1), (0, False, 1), (1, True, 2)}
    assert (edges[0, True, 1]["low"], edges[0, True, 1]["high"]) == (0.0, 0.5) and edges[0, True, 1]["points"] == 5
    node = next(d for _, d in graph.nodes(data=True) if d["kind"].startswith("period_doubling"))
    assert node["measures"] == {"max_0": 0.5} and node["parameter"] == 0.5


def test_a_special_point_at_the_very_end_is_the_end():
    ended = Curve(lambda p: p, points=[point(1.0, "grazing", 1.0)], reasons=("bound", "no_successor"))
    ended.problems, ended._arrays = [Problem()], {"part": np.zeros(9, int)}
    graph = graph_of([ended], (0.0, 1.0))
    assert sorted(d["kind"] for _, d in graph.nodes(data=True)) == ["bound", "grazing"] and graph.number_of_edges() == 1
    bound = Curve(lambda p: p, points=[point(0.9, "grazing", 0.9)])
    bound.problems, bound._arrays = ended.problems, ended._arrays
    assert graph_of([bound], (0.0, 1.0)).number_of_nodes() == 3
    round_ = Curve(lambda p: p)
    round_.problems, round_._arrays, round_.closed = ended.problems, ended._arrays, True
    loop = graph_of([round_], (0.0, 1.0))
    assert [d["kind"] for _, d in loop.nodes(data=True)] == ["closed"] and list(loop.edges()) == [(0, 0)]


# tracing

def test_branches_are_traced_as_far_as_their_least_period_and_offer_what_leaves_them(monkeypatch):
    class Orbit(PeriodicOrbit):
        def __init__(self, periods, success=True, again=False):
            self.__dict__.update(n=periods, good=success, again=again)
        periods = property(lambda self: self.n)
        success = property(lambda self: self.good)
    asked = {}

    def trace(orbit, parameter, bounds, stop=None, **options):
        asked.update(parameter=parameter, bounds=bounds, stop=stop, options=options)
        if orbit.periods == 3:
            raise ContinuationError("it does not start")
        return SimpleNamespace(periods=orbit.periods, special_points=points, ends=())
    monkeypatch.setattr(jobs, "trace", trace)
    monkeypatch.setattr(jobs, "trimmed", lambda branch, periods: branch)
    monkeypatch.setattr(jobs, "periods_of", lambda branch: branch.periods)
    monkeypatch.setattr(jobs, "repeats", lambda orbit: orbit.again)
    others = [Orbit(4), Orbit(8), Orbit(2, success=False), "no orbit"]
    monkeypatch.setattr(jobs, "switch_branch", lambda point, n_max: asked.update(n_max=n_max) or others)
    points = [SimpleNamespace(kind=kind, parameter=0.1 * k) for k, kind in enumerate(
        [SpecialPointKind.FOLD, SpecialPointKind.PERIOD_DOUBLING, SpecialPointKind.GRAZING])]
    payload = {"parameter": "p", "bounds": [0.0, 1.0], "periods": 4, "options": {"ds": 0.1}, "orbits": [], "arrays": {}}
    branch = jobs._traced(Orbit(2), payload)
    assert asked["parameter"] == "p" and asked["bounds"] == (0.0, 1.0) and asked["options"] == {"ds": 0.1}
    stops = [asked["stop"](SimpleNamespace(solution=Orbit(n, again=again))) for n, again in ((2, False), (1, False), (2, True))]
    assert stops == [False, True, True]
    offers, at = jobs._offers(branch, 4)
    assert offers == [others[0]] * 2 and at == [pytest.approx(0.1), pytest.approx(0.2)] and asked["n_max"] == 2
    assert jobs._offers(branch, 1) == ([], []) and asked["n_max"] == 1  # none is short enough, and one at least is asked for
    monkeypatch.setattr(jobs, "unpacked", lambda orbits, arrays, elements: [Orbit(2), Orbit(3)])
    monkeypatch.setattr(jobs, "packed_branches", lambda made: (["header" if b is not None else None for b in made], {"a": 1}))
    monkeypatch.setattr(jobs, "packed_points", lambda offered: ([len(mine) for mine in offered], {"b": 2}))
    meta, arrays = jobs.trace_orbits(payload)
    assert arrays == {"a": 1, "b": 2}
    assert meta["branches"] == [{"header": "header", "offers": 2, "why": "", "at": at, "failed": []},
                                {"header": None, "offers": 0, "why": "it does not start", "at": [], "failed": []}]
