"""What a problem of an event sequence makes of numbers: tests of multipliers, trains of impacts, rests, slips; on stand-ins."""
import math
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.continuation.kinds import CorrectorStatus, StopReason
from bifurc.continuation.kinds import SpecialPointKind as Kind
from bifurc.continuation.shooting import problem as problems
from bifurc.continuation.shooting.problem import OrbitProblem
from bifurc.elements import EventKind
from bifurc.orbits.shooting import sequence
from bifurc.orbits.shooting.signature import Signature


def made(nodes=(), times=(), span=1.0, closure=1, clock=0.0, mu=None, **attributes):
    """Return a problem without equations, and its unknowns (one coordinate, one speed)."""
    problem = object.__new__(OrbitProblem)
    nodes = np.array(nodes, np.int64).reshape(-1, 5)
    problem.sequence = Signature(nodes, np.zeros(len(nodes)), span, closure, clock)
    kick = np.zeros((4, 4), int)
    kick[:, :2] = 1  # guards 0 and 1 are stops, 2 and 3 those of friction
    problem.scene = SimpleNamespace(ns=2, n=1, nw=1, tables=SimpleNamespace(kick=kick), keys=[
        ("free", "slip+"), ("rest", "slip+"), ("free", "stick"), ("free", "slip-")],
        guard=lambda m, g: SimpleNamespace(element=g), event_kind=lambda m, g: EventKind.RELEASE if m == 1 else EventKind.IMPACT)
    problem._chatters = bool((nodes[:, 4] == 1).any())
    problem._clear = None
    problem.parameter_scale = 1.0
    for name, value in attributes.items():
        setattr(problem, name, value)
    if mu is not None:
        problem._multipliers = mu if callable(mu) else lambda x: np.array(mu, complex)
    x = np.append(np.array([[t, 0.1, 0.2] for t in times]).ravel(), 3.0)
    return problem, x


# multipliers

def test_the_test_of_a_torus_changes_its_sign_with_a_pair_on_the_circle():
    pair = np.exp(1j)
    for size, others, sign in ((0.9, (), 1.0), (1.1, (), -1.0), (0.9, (0.3, -0.2), 1.0), (1.1, (0.3, -0.2), -1.0)):
        mu = [size * pair, size * pair.conjugate(), *others]
        problem, x = made(mu=mu)
        want = 1.0
        for i in range(len(mu)):
            for j in range(i):
                f = 1.0 - mu[i] * mu[j]
                want *= f / (1.0 + abs(f))
        assert problem._torus(x) == pytest.approx(want.real) and np.sign(problem._torus(x)) == sign
    assert math.isnan(made(mu=[np.inf, 0.5])[0]._torus(None))


@pytest.mark.parametrize("mu, kind, closure, yes", [
    ([np.exp(1j), np.exp(-1j)], Kind.NEIMARK_SACKER, 1, True), ([2.0, 0.5], Kind.NEIMARK_SACKER, 1, False),
    ([0.99 * np.exp(1j), 0.99 * np.exp(-1j)], Kind.NEIMARK_SACKER, 1, False), ([-1.0, -1.0], Kind.NEIMARK_SACKER, 1, False),
    ([-1.01, 0.3], Kind.PERIOD_DOUBLING, 1, True), ([-1.03, 0.3], Kind.PERIOD_DOUBLING, 1, False),
    ([-1.03, 1e6], Kind.PERIOD_DOUBLING, 1, True), ([-1.3, 1e6], Kind.PERIOD_DOUBLING, 1, False),
    ([-1.03, 0.3], Kind.PERIOD_DOUBLING, -1, True), ([np.inf, 0.3], Kind.PERIOD_DOUBLING, 1, True), ([7.0], Kind.GRAZING, 1, True)])
def test_what_a_zero_is_is_confirmed_by_the_multipliers(mu, kind, closure, yes):
    assert made(mu=mu, closure=closure)[0].confirm(kind, None) is yes


def test_the_test_of_a_flip_is_that_of_the_kernel_or_of_the_multipliers():
    train = [[0, 0, 0, 0, 2], [0, 0, 1, 0, 1], [1, 0, 0, 0, 0]]
    chatter, x = made(train, (0.1, 0.3, 0.6), mu=[-3.0, 0.5])
    assert chatter._flip(x, 7.0) == pytest.approx(-3.0 / 4.0)  # (1 - 3)(1 + .5) = -3
    assert made(train, (0.1, 0.3, 0.6), closure=-1, mu=[-3.0, 0.5])[0]._flip(x, 7.0) == 7.0
    assert made(train, (0.1, 0.3, 0.6), mu=[np.inf])[0]._flip(x, 7.0) == 7.0
    hit = [[0, 0, 0, 0, 0], [0, 2, 0, 0, 0]]
    known = {3.0: [-3.0, 0.5], 2.0: [0.2, 0.1]}
    problem, x = made(hit, (0.1, 0.3), mu=lambda x: np.array(known[float(x[-1])], complex))
    assert problem._flip(x, 0.4) == 0.4 and problem._clear[1] == 0.4
    for there, sign in ((0.4, -1.0), (-0.4, 1.0)):  # where both are known both are positive, or the kernel's is of the other sign
        problem._clear = np.append(x[:-1], 2.0), there
        assert problem._flip(x, math.nan) == pytest.approx(sign * 0.75)
    problem._clear = None
    assert math.isnan(problem._flip(x, math.nan))
    problem._clear = np.append(x[:-1], 2.0), 0.4
    short = x.copy()
    short[3] = short[0] + 1e-10
    assert math.isnan(problem._flip(short, math.nan))  # rounding alone
    known[2.0] = [np.inf, 0.1]
    assert math.isnan(problem._flip(x, math.nan))


def test_determinants_of_doubled_orbits_are_odd_in_the_difference_of_the_halves():
    """The monitor is minus that difference: the sign turns with it, and its size is taken out of the determinant."""
    info = np.zeros(sequence.INFO)
    info[[sequence.DET_SIGN, sequence.DET_LOG, sequence.ITERATIONS]] = 1.0, 2.0, 3
    for odd, apart, sign in ((-0.5, 0.25, 1.0), (0.5, 0.25, -1.0)):
        problem, _ = made(_halves=("row", 0.0), _merges=1, _born=False, scale=np.array([2.0, 1.0]), _bounds=np.array([False, True]),
                          _values=lambda U, told, odd=odd: np.array([0.1, odd]), _apart=lambda x, apart=apart: apart)
        c = problem._corrected(np.zeros(2), np.array([0.0, 1.0]), 1, np.array([0.6, 0.8]), "tangent", info)
        assert c.det_sign == sign and c.det_log == pytest.approx(2.0 - math.log(0.25 / 1.25)) and c.iterations == 3
        assert c.distance == pytest.approx(math.hypot(0.3, 0.8)) and c.converged
    born, _ = made(_halves=None, _born=True, _shrinks=0, scale=np.ones(2), _bounds=np.array([True]),
                   _values=lambda U, told: np.array([-0.25]))
    c = born._corrected(np.zeros(2), np.array([0.0, 1.0]), 1, np.ones(2), "tangent", info)
    assert c.det_sign == 1.0 and c.det_log == pytest.approx(2.0 - math.log(0.25 / 1.25))
    merged, _ = made(_halves=("row", 0.0), scale=np.ones(2), _apart=lambda x: 0.0 if x[0] else 1.0)
    c = merged._corrected(np.zeros(2), np.array([0.0, 1.0]), 1, np.ones(2), "tangent", info)
    assert not c.converged and c.status is CorrectorStatus.NOT_CONVERGED  # it is the orbit of half the period, run through twice
    failed = merged._corrected(np.zeros(2), np.array([0.0, 1.0]), -1, np.ones(2), "tangent", info)
    assert not failed.converged and failed.status is CorrectorStatus.SINGULAR


# times

def test_the_shortest_time_between_two_events_goes_round_the_period(monkeypatch):
    monkeypatch.setattr(problems, "repeated", lambda scene, s, U: (s, U))
    problem, x = made([[0, 0, 0, 0, 0]] * 3, (0.02, 0.3, 0.9))
    assert problem._shortest(x) == pytest.approx(0.12)
    assert made([[0, 0, 0, 0, 0]] * 2, (0.2, 0.25), 2.0)[0]._shortest(made([[0, 0, 0, 0, 0]] * 2, (0.2, 0.25), 2.0)[1]) \
        == pytest.approx(0.05)


@pytest.mark.parametrize("span, closure", [(1.0, 1), (2.0, 1), (1.0, -1)])
def test_the_shortest_rest_behind_a_chattering_and_what_ends_it(span, closure):
    """Rests of .3 and .2, the second round the end of the period."""
    nodes = [[1, 0, 0, 0, 0], [0, 0, 1, 0, 1], [1, 0, 0, 0, 0], [0, 0, 1, 0, 1]]
    problem, x = made(nodes, (0.1, 0.3, 0.6, span - 0.1), span, closure)
    assert problem._shortest_rest(x) == (3, pytest.approx(0.2 / span))
    assert problem._released(x) is True
    other = [*nodes[:3], [0, 1, 1, 0, 1]]  # of another stop than that which lets go
    if closure > 0:
        assert made(other, (0.1, 0.3, 0.6, span - 0.1), span)[0]._released(x) is False
    slip = [[1, 2, 0, 0, 0], [0, 0, 1, 0, 1]]
    slip[0][0] = 2
    assert made(slip, (0.1, 0.3))[0]._released(made(slip, (0.1, 0.3))[1]) is False  # another event comes first


def test_the_share_of_slip_of_what_also_sticks():
    """Element 1 slips for .1 and .05 of a period of 2 and sticks otherwise."""
    nodes = [[2, 2, 0, 0, 0], [0, 2, 2, 0, 0], [2, 3, 3, 0, 0], [3, 3, 2, 0, 0]]
    problem, x = made(nodes, (0.2, 0.3, 1.0, 1.05), 2.0)
    assert problem._slip(x) == pytest.approx(0.15 / 2.0)
    assert made([[0, 0, 0, 0, 0]], (0.2,))[0]._slip(made([[0, 0, 0, 0, 0]], (0.2,))[1]) == 1.0


@pytest.mark.parametrize("speeds, guards, found", [
    ([1.0, 0.1, 0.0009], [0, 0, 0], True), ([1.0, 0.1, 0.0011], [0, 0, 0], False), ([0.1, 0.0009, 1.0], [0, 0, 0], True),
    ([1.0, 0.0009], [0, 0], False), ([1.0, 0.1, 0.0009], [0, 1, 0], False), ([1.0, 0.1, 0.098, 0.0009], [0, 0, 0, 0], False),
    ([1.0, 9.0, 0.1, 9.0, 0.0009], [0, 2, 0, 2, 0], True), ([math.inf, 1.0, 0.1, 0.0009], [0, 0, 0, 0], True)])
def test_a_train_of_impacts_that_become_ever_slower(speeds, guards, found, monkeypatch):
    """At least three of one stop in a row, each clearly slower than the one before; friction may turn between them."""
    problem, x = made([[0, g, 0, 0, 0] for g in guards], np.linspace(0.1, 0.9, len(guards)))
    monkeypatch.setattr(problems, "listed_speeds", lambda problem, x: speeds)
    assert problem._train(x) is found


def test_ends_are_named_by_what_lies_near(monkeypatch):
    problem, x = made([[0, 0, 0, 0, 0]], (0.1,), _train=lambda x: False, _completing=lambda x: False, _slip=lambda x: 1.0,
                      _stands_in_the_way=lambda x: False)
    assert problem.named_end(x, StopReason.DS_MIN, "m") == (StopReason.DS_MIN, "m")
    problem._stands_in_the_way = lambda x: True
    assert problem.named_end(x, StopReason.NO_SUCCESSOR, "m") == (StopReason.STICKING, "m")
    problem._stands_in_the_way = lambda x: False
    problem._slip = lambda x: 1e-4
    assert problem.named_end(x, StopReason.DS_MIN, "m") == (StopReason.STICKING, "m")
    problem._completing = lambda x: True
    assert problem.named_end(x, StopReason.NO_SUCCESSOR, "m") == (StopReason.CHATTERING, "m")
    assert problem.named_end(x, StopReason.BOUND, "m") == (StopReason.BOUND, "m")
    free, x = made([[0, 0, 0, 0, 0]], (0.1,), 0.0, clock=1.0, _train=lambda x: True)
    monkeypatch.setattr(problems.autonomous, "small", lambda problem, x, size: size == problems.autonomous.SHRINKING)
    assert free.named_end(x, StopReason.INADMISSIBLE, "m") == (StopReason.SHRUNK, "")


# flights of a train

def flights(last, turned, second=0):
    """Return a problem of three impacts of a train at .2, .5 and .5 + ``last``; the third moves away where ``turned``."""
    nodes = [[0, 0, 0, 0, 2], [0, second, 0, 0, 2], [0, 0, 1, 0, 1], [1, 0, 0, 0, 0]]
    speeds = {0: 1.0, 1: 0.5, 2: -0.5 if turned else 0.2}
    problem, x = made(nodes, (0.2, 0.5, 0.5 + last, 0.9), equations=SimpleNamespace(path=SimpleNamespace(tables=SimpleNamespace(
        ratio=np.full((4, 4), 0.6)))))
    order = [0.2, 0.5, 0.5 + last]
    problem.arriving = lambda node, row: speeds[int(np.argmin(np.abs(np.array(order) - row[0])))]
    return problem, x


@pytest.mark.parametrize("last, turned, outside, backwards", [
    (0.1, True, False, False),  # long flights are roots of their own
    (1e-8, True, False, True), (1e-8, False, False, False), (-1e-3, False, False, True), (-1e-3, False, True, False),
    (1e-8, True, True, False)])
def test_an_impact_at_the_instant_of_the_one_before_is_the_other_root(last, turned, outside, backwards):
    problem, x = flights(last, turned)
    problem.arriving = lambda node, row, turned=turned: 1.0 if node[4] == 2 else (-0.5 if turned else 0.2)
    assert problem._backwards(x, outside) is backwards


def test_the_speed_that_turns_back_is_that_of_the_rebound():
    """A flight of restitution .6 begins with .6 of the speed that arrived: half of that, upwards, is the limit."""
    for speed, back in ((-0.31, True), (-0.29, False)):
        problem, x = flights(1e-8, False)
        problem.arriving = lambda node, row, speed=speed: 1.0 if node[4] == 2 else speed
        assert problem._backwards(x) is back


@pytest.mark.parametrize("here, before, want", [(0.8, 3.0, None), (1.4, 3.0, None), (0.01, 0.2, None), (0.5, None, None)])
def test_a_closing_comes_too_early_or_lists_too_many(here, before, want):
    """Excess of the last impact, and of the one before where that would close as well; both as a logarithm."""
    nodes = [[0, 0, 0, 0, 2], [0, 0, 1, 0, 1], [1, 0, 0, 0, 0]] if before else [[0, 0, 1, 0, 1], [1, 0, 0, 0, 0]]
    problem, x = made(nodes, np.linspace(0.1, 0.9, len(nodes)))
    problem._excess = lambda node, row: here if node[4] == 1 else before
    worst = max(here, math.exp(problems.SLACK - problems.SPARE) / before if before else 0.0)
    assert problem._closure(x) == pytest.approx(math.log(worst) - problems.SLACK)


# several periods

def test_an_orbit_is_moved_by_whole_periods_next_to_another():
    problem, x = made([[0, 0, 0, 0, 0]] * 2, (0.3, 0.8), 2.0, system=SimpleNamespace(period=1.5))
    near = x.copy()
    near[[0, 3]] += 0.9
    found = problem.alike(x, near)
    assert found[[0, 3]].tolist() == pytest.approx([1.3, 1.8])
    assert np.delete(found, [0, 3]).tolist() == np.delete(x, [0, 3]).tolist()
    assert problem.alike(x, x) is x
    for changed in (made([[0, 0, 0, 0, 0]] * 2, (0.3, 0.8), 0.5, -1, system=SimpleNamespace(period=1.5)),
                    made([[0, -1, 0, 0, 0]] * 2, (0.3, 0.8), system=SimpleNamespace(period=1.5)),
                    made([[0, 0, 0, 0, 0]] * 2, (0.3, 0.8), system=SimpleNamespace(period=None))):
        assert changed[0].alike(changed[1], near) is changed[1]


@pytest.mark.parametrize("times", [2, 3])
def test_an_orbit_run_through_several_times_is_listed_a_span_later_each_time(times):
    problem, x = made([[0, 0, 0, 0, 0], [0, -1, 0, 0, 0]], (0.3, 1.0), 2.0)
    problem.sequence.fixed[1] = 1.0
    problem.with_sequence = lambda signature, start: signature
    signature, start = problem.repeated(x, times)
    assert signature.span == 2.0 * times and signature.fixed.tolist() == [v for k in range(times) for v in (2.0 * k, 1.0 + 2.0 * k)]
    rows = start[:-1].reshape(-1, 3)
    assert rows[:, 0].tolist() == pytest.approx([t + 2.0 * k for k in range(times) for t in (0.3, 1.0)]) and start[-1] == 3.0
    assert (rows[:, 1:] == [0.1, 0.2]).all() and len(signature.nodes) == 2 * times


@pytest.mark.parametrize("times, guards, together", [
    ((0.1, 0.1), (0, 1), True), ((0.1, 0.2), (0, 1), False), ((0.1, 0.1), (0, 2), False), ((0.0, 1.0), (0, 1), True),
    ((0.1,), (0,), False)])
def test_two_impacts_of_one_instant(times, guards, together, monkeypatch):
    monkeypatch.setattr(problems, "repeated", lambda scene, s, U: (s, U))
    problem, x = made([[0, g, 0, 0, 0] for g in guards], times)
    assert problem._together(x) is together
