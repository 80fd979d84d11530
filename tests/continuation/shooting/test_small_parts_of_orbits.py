"""Small choices of problems of orbits, one by one, on stand-ins: times, orders, signs, and what is tried before what."""
import collections
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.continuation.kinds import SpecialPointKind as Kind
from bifurc.continuation.shooting import (
    appearing,
    autonomous,
    completion,
    extremes,
    signature_change,
)
from bifurc.continuation.shooting import problem as problems
from bifurc.continuation.shooting.problem import OrbitProblem
from bifurc.elements import EventKind
from bifurc.orbits.shooting.signature import Signature

I, R, S, C = EventKind.IMPACT, EventKind.RELEASE, EventKind.SLIP, EventKind.STICK


def test_the_time_of_a_node_by_its_unknowns():
    """Of a forced orbit its own; of one with a clock the period, as often as it went round, and its own but for the first node."""
    problem = SimpleNamespace(sequence=SimpleNamespace(nodes=[0, 0, 0], clock=0.0), scene=SimpleNamespace(ns=4))
    assert [completion.slope_of_time(problem, k) for k in (0, 2, 4)] == [[(0, 1.0)], [(10, 1.0)], [(5, 1.0)]]
    problem.sequence.clock = 2.0
    assert completion.slope_of_time(problem, 0) == [(0, 0.0)] and completion.slope_of_time(problem, 6) == [(0, 2.0)]
    assert completion.slope_of_time(problem, 2) == [(0, 0.0), (10, 1.0)]
    assert completion.slope_of_time(problem, 4) == [(0, 1.0), (5, 1.0)]


def test_the_rate_at_which_an_orbit_crosses_its_section():
    """A section row . f in a time of one radian of the clock; the field is that of the mode and state at the start, at phase 0."""
    def forcing(T, t, start):
        assert t == 0.0
        start[2:] = [1.0, 1.0, 0.0]

    def field(T, mode, start, f):
        assert (T, mode) == (6.0, 3)
        f[:] = [2.0 * start[0] + start[3], -start[1] + 10.0 * start[4]]

    e = SimpleNamespace(numbers_at=lambda p: p, path=SimpleNamespace(tables=SimpleNamespace(A=np.zeros((1, 2, 5)))),
                        kernel=SimpleNamespace(forcing=forcing, field=field))
    s = SimpleNamespace(nodes=np.array([[0, -1, 3, 0, 0]]), fixed=np.array([0.5, -3.0, 99.0]), clock=4.0 * np.pi)
    problem = SimpleNamespace(equations=e, sequence=s, scene=SimpleNamespace(ns=2))
    assert autonomous.extent(problem, np.array([1.0, 0.7, 0.2, 6.0])) == pytest.approx((0.5 * 2.4 - 3.0 * -0.2) * 2.0)


def test_a_joined_row_has_the_forcing_of_its_time():
    seen = []
    e = SimpleNamespace(path=SimpleNamespace(tables=SimpleNamespace(A=np.zeros((1, 2, 5)), flat=np.array([0.5]))),
                        kernel=SimpleNamespace(forcing=lambda T, t, z: (seen.append(t), z.__setitem__(slice(2, None), [7, 8, 9]))))
    joined = OrbitProblem._joined(SimpleNamespace(equations=e, scene=SimpleNamespace(ns=2)), np.array([0.25, 3.0, 4.0]))
    assert joined.tolist() == [3.0, 4.0, 7.0, 8.0, 9.0] and seen == [pytest.approx(0.25 * 4.0 * np.pi)]


def test_the_top_of_an_arc_moves_with_the_time_and_state_of_its_node():
    """A jump by a matrix on states and forcing, then a linear arc: the derivative is that of differences."""
    rng = np.random.default_rng(3)
    P, A, W = rng.normal(size=(2, 5)), rng.normal(size=(2, 2)), 1.3
    flow = np.array([[0.4, 0.7], [-0.2, 0.9]])  # of the arc, whatever its length
    T = SimpleNamespace(A=np.zeros((1, 2, 5)), flat=np.array([W]))
    whole = SimpleNamespace(nodes=np.array([[0, -1, 0, 0, 0], [4, 2, 1, 0, 1]]))

    def forcing(T_, t, x):
        x[2:] = [1.0, np.cos(W * t), np.sin(W * t)]

    def forcing_rate(T_, x, dw):
        dw[:] = [0.0, -W * x[4], W * x[3]]

    def reset(T_, mode, guard, closes, before, after, out):
        assert (mode, guard, closes) == (4, 2, 3)  # it closes, and rests in mode 1
        after[:2], after[2:], out[:] = P @ before, before[2:], P

    def field(T_, mode, x, f):
        assert mode == 1
        f[:] = A @ x[:2]

    def arc(T_, mode, x, t, y, Phi):
        assert (mode, t) == (1, 0.6)
        Phi[:] = flow

    e = SimpleNamespace(kernel=SimpleNamespace(forcing=forcing, forcing_rate=forcing_rate, reset=reset, field=field, arc=arc))
    U = np.array([9.0, 9.0, 9.0, 0.3, 0.5, -0.8])
    row = extremes.arc_row(e, T, whole, U, 1, 0.6, 1)
    period = 2.0 * np.pi / W

    def top(z):  # at a fixed time: where the node is later the arc is shorter
        x = np.empty(5)
        x[:2] = z[1:]
        forcing(None, z[0] * period, x)
        after = P @ x
        return (flow @ (after - (z[0] - 0.3) * period * (A @ (P @ known))))[1]

    known = np.empty(5)
    known[:2] = U[4:]
    forcing(None, 0.3 * period, known)
    z = U[3:]
    slopes = [(top(z + h) - top(z - h)) / 2e-6 for h in 1e-6 * np.eye(3)]
    assert row == pytest.approx(slopes, abs=1e-6)


@pytest.mark.parametrize("kinds, times, found", [
    ([R, S], [0.2, 0.3], Kind.STICK_ONSET), ([R, S], [0.2, 0.9], Kind.SLIP_ONSET), ([S, R], [0.2, 0.3], Kind.SLIP_ONSET),
    ([R, I, S, I], [0.1, 0.2, 0.35, 0.7], Kind.STICK_ONSET), ([R, S, R, S], [0.0, 0.3, 0.5, 0.9], Kind.SLIP_ONSET),
    ([R, I], [0.2, 0.3], None), ([R, R], [0.2, 0.3], None)])
def test_the_shorter_of_two_turns(kinds, times, found, monkeypatch):
    """From the release to the slip it sticks, from the slip to the release it is at the limit; also round the period."""
    spans = np.diff(times, prepend=times[-1] - 1.0)
    monkeypatch.setattr(signature_change, "intervals", lambda problem, x: spans)
    nodes = np.array([[k, 0, 0, 0, 0] for k in range(len(kinds))])
    problem = SimpleNamespace(sequence=SimpleNamespace(nodes=nodes), scene=SimpleNamespace(event_kind=lambda m, g: kinds[m]))
    assert signature_change.by_turns(problem, None) is found


def test_sections_between_turns_take_no_time(monkeypatch):
    monkeypatch.setattr(signature_change, "intervals", lambda problem, x: np.array([np.inf, 0.4, 0.6]))
    nodes = np.array([[0, -1, 0, 0, 0], [1, 0, 0, 0, 0], [2, 0, 0, 0, 0]])
    scene = SimpleNamespace(event_kind=lambda m, g: [None, R, S][m])
    problem = SimpleNamespace(sequence=SimpleNamespace(nodes=nodes), scene=scene)
    assert signature_change.by_turns(problem, None) is Kind.SLIP_ONSET  # .4 of the period of 1


A_, B_, C_ = ("a", I), ("b", S), ("c", C)
QUICK = 0.5 * signature_change.AT_ONCE


@pytest.mark.parametrize("one, spans, two, halves, found", [
    ([A_, B_], [0.9, QUICK], [A_, B_], (0, 0), None), ([A_, B_], [0.9, QUICK], [B_, A_], (0, 0), None),  # the same round
    ([A_, B_, C_], [0.9, QUICK, 0.4], [B_, A_, C_], (0, 0), "first"), ([A_, B_, C_], [0.9, 0.2, 0.4], [B_, A_, C_], (0, 0), None),
    ([A_, B_, C_], [0.9, QUICK, 0.4], [B_, A_, A_], (0, 0), None),
    ([A_, B_, C_], [0.9, 0.4, QUICK], [A_, C_, B_], (0, 0), "last"),
    ([A_, B_, C_] * 2, [0.9, QUICK, 0.4] * 2, [B_, A_, C_], (False, True), "first"),
    ([A_, B_, C_], [0.9, QUICK, 0.4], [B_, A_, C_] * 2, (True, False), "first")])
def test_events_that_change_places(one, spans, two, halves, found):
    """Two at once, in a round of three; named by the one whose kind comes first."""
    kind = signature_change.changes_places(one, np.array(spans), two, halves)
    order, kinds = signature_change.ORDER, signature_change.KINDS
    ours = {"first": (A_, B_), "last": (B_, C_)}
    want = None if found is None else min((kinds.get(EventKind(e[1]), Kind.GRAZING) for e in ours[found]), key=order.index)
    assert kind is want


@pytest.mark.parametrize("values, halves, flipped, place", [
    ((1.0, -3.0), True, False, 0.25), ((-3.0, 1.0), True, False, 0.75), ((1.0, 0.0), True, False, 1.0),
    ((1.0, 3.0), True, False, None),
    ((1.0, -3.0), False, False, None), ((1.0, -3.0), True, True, None)])
def test_where_a_doubled_orbit_merges(values, halves, flipped, place, monkeypatch):
    """The difference of its halves, linear between two rows, is zero there."""
    monkeypatch.setattr(problems.branching, "merging", lambda problem, a, b, part: part)
    monkeypatch.setattr(problems.branching, "turned", lambda problem, a, b: flipped)
    monkeypatch.setattr(problems.autonomous, "shrunk", lambda problem, a, b: "shrunk")
    rows = [SimpleNamespace(x=np.array([2.0, value])) for value in values]
    problem = SimpleNamespace(_halves=(np.array([0.5, 1.0]), -1.0) if halves else None)
    assert OrbitProblem.locate(problem, Kind.PERIOD_DOUBLING, *rows) == place
    assert OrbitProblem.locate(problem, Kind.HOPF, *rows) == "shrunk" and OrbitProblem.locate(problem, Kind.FOLD, *rows) is None


def test_orders_of_a_plastic_impact_whose_restitution_varies_are_those_along_the_path(monkeypatch):
    T = SimpleNamespace(ratio=np.array([[0.0, 0.5], [0.3, 0.4]]))
    nodes, later = np.array([[0, -1, 0, 0, 0], [0, 0, 1, 0, 0], [1, 0, 0, 0, 0]]), []

    def put(T_, index, series, low, high, value):
        later.append(value)
        T_.ratio[0, 0] = becomes

    monkeypatch.setattr(problems.sequence, "set_parameter", put)
    monkeypatch.setattr(problems, "divided", lambda scene, nodes, T_, closure: nodes + 1)
    becomes, path = 0.2, SimpleNamespace(tables=T, name="restitution", index=0, series=None, low=1.0, high=4.0)
    signature = Signature(nodes, np.zeros(3), 1.0, 1, 0.0)
    assert (problems.generic(None, path, signature).nodes == nodes + 1).all() and later == [2.5]
    assert problems.generic(None, path, signature) is signature  # the first value is not special now
    T.ratio[0, 0] = 0.0
    assert problems.generic(None, SimpleNamespace(**{**vars(path), "name": None}), signature) is signature
    T.ratio[1, 0] = becomes = 0.0
    assert problems.generic(None, path, signature) is signature  # plastic at any value


def test_what_is_touched_all_along_changes_its_mode_as_a_whole():
    """Two guards: the first is small all along the period, the second at all times but one."""
    count, off = appearing.ALL_ALONG, {}
    phases, forced = [], []
    T = SimpleNamespace(A=np.zeros((1, 2, 4)), flat=np.array([np.pi]), n_guards=np.array([0, 2]))

    def states(T_, nodes, span, U, times, out):
        phases.append(times.tolist())
        out[:, 0], out[:, 1] = times, 0.0

    def value(T_, m, g, joined):
        return -1.9 * appearing.NEAR + off.get((g, round(joined[0] * count / 2.0)), 0.0)

    kernel = SimpleNamespace(guard_gradient=lambda T_, m, g, joined, row: None, scale_of=lambda row, w: 2.0, guard_value=value)
    then = np.full((2, 2, 4), -1)
    then[1] = [[1, 5, 3, 5], [1, 2, -1, -1]]
    scene = SimpleNamespace(ns=2, expand=lambda m, g: SimpleNamespace(then=then))
    s = Signature(np.array([[0, -1, 1, 0, 0]]), np.zeros(1), 2.0, 1, 0.0)
    motion = SimpleNamespace(states=states, forcing=lambda T_, t, joined: forced.append((joined[0], t)))
    whole = SimpleNamespace(span=2.0, nodes=s.nodes)
    problem = SimpleNamespace(equations=SimpleNamespace(numbers_at=lambda p: T, motion=motion, kernel=kernel, weights=None),
                              sequence=s,
                              scene=scene, _whole=lambda x: (whole, None))

    def found():
        return [(new.nodes.tolist(), x) for new, x in appearing.passed_whole(problem, "x1")]

    problem.sequence = collections.namedtuple("S", "events nodes")(1, s.nodes)
    assert found() == []
    problem.sequence = s
    off[1, 3] = -0.3 * appearing.NEAR
    assert found() == [([[m, -1, m, 0, 0]], "x1") for m in (3, 5)]
    assert phases[0] == pytest.approx(np.linspace(0.0, 2.0, count, endpoint=False))
    assert all(t == pytest.approx(2.0 * time) for time, t in forced) and len(forced) == 2 * count  # a forcing period is 2
    off[1, 3] = 0.0
    assert [new[0][0] for new, _ in found()] == [3, 5, 2]
    off[0, count - 1] = 4.0 * appearing.NEAR
    assert [new[0][0] for new, _ in found()] == [2]
