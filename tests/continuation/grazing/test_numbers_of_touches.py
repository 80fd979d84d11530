"""What is read of a touch: sizes, series, kicks of slow impacts, shallow contacts, maps and mirror images; on stand-ins."""
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.continuation.grazing import confirm, discontinuity, guards, sliding, touch
from bifurc.continuation.grazing.sliding import SlidingClass
from bifurc.continuation.kinds import SpecialPointKind as Kind
from bifurc.orbits.shooting import sequence

ROW = np.array([0.6, -1.5, 0.0, 0.0, 0.4, 0.25, -0.7])  # of a guard of places, a wall that moves; two coordinates, nw = 3
WEIGHTS = np.array([2.0, 2.0, 3.0, 3.0])
DW = np.array([0.0, 0.9, -0.3])


def tables(law):
    T = SimpleNamespace(A=np.zeros((3, 4, 7)), LP=np.zeros((3, 1, 2)), LU=np.zeros((0, 7)), G=np.zeros((3, 2, 7)),
                        LG=np.zeros((3, 2, 1)), GT=np.zeros((3, 2, 7, 5)), flat=np.array([2.0]), harmonics=np.array([1, 3]))
    T.LG[1, 1] = law
    T.G[1, 1] = ROW
    return T


def gradient(T, mode, guard, joined, row):
    assert (mode, guard) == (1, 1)
    row[:] = 2.0 * ROW


def rates(T, joined, out):
    out[:] = DW


@pytest.mark.parametrize("law", [0.0, 1.0])
def test_sizes_and_series_of_guards_that_are_laws_and_that_are_not(law, rng):
    T, joined = tables(law), rng.normal(size=7)
    T.GT[1, 1] = rng.normal(size=(7, 5))

    def series(T_, mode, guard, x, a):
        assert x is joined
        a[:] = np.arange(a.size)

    e = SimpleNamespace(weights=WEIGHTS, kernel=SimpleNamespace(guard_gradient=gradient, guard_series=series,
                                                                scale_of=lambda row, weights: row @ row + weights[2]))
    assert guards.guard_size(e, T, 1, 1, joined) == pytest.approx((4.0 if law else 1.0) * ROW @ ROW + 3.0)
    assert np.array_equal(T.G[1, 1], ROW)
    found = guards.guard_series(e, T, 1, 1, joined)
    if law:
        assert found.tolist() == list(range(len(found)))
    else:
        assert found == pytest.approx([joined @ T.GT[1, 1, :, k] for k in range(5)], abs=1e-13)


def test_a_kick_that_is_a_law_is_read_from_a_slow_impact(rng):
    """Impacts on a wall that moves, with friction: the state jumps along a direction by the speed that arrives, 1.37 times."""
    T, joined, along = tables(1.0), rng.normal(size=7), np.array([0.0, 0.0, 0.8, 0.5])
    along /= ROW[:2] @ along[2:]
    arrived = []

    def reset(T_, mode, guard, closes, before, after, P):
        assert (mode, guard, closes) == (1, 1, 0)
        speed = ROW[:2] @ before[2:4] + ROW[4:] @ DW
        arrived.append(speed)
        after[:] = before
        after[:4] -= 1.37 * speed * along
        after[:2] += 9.0  # onto the surface

    e = SimpleNamespace(weights=WEIGHTS, kernel=SimpleNamespace(forcing_rate=rates, reset=reset))
    direction, restitution = touch._kicked(e, T, 1, 1, joined, ROW)
    assert direction == pytest.approx(along, abs=1e-11) and restitution == pytest.approx(0.37, abs=1e-11)
    push = ROW[:2] / (ROW[:2] @ ROW[:2])
    assert arrived == [pytest.approx(touch.SLOW * 3.0 / np.abs(push).max(), rel=1e-9)]


def test_forcing_states_at_a_time():
    T = SimpleNamespace(A=np.zeros((1, 4, 9)), flat=np.array([2.0, 7.0]), harmonics=np.array([1, 3]))
    assert touch._forcing(T, 4, 0.3) == pytest.approx([1.0, np.cos(0.6), np.sin(0.6), np.cos(1.8), np.sin(1.8)], rel=1e-14)


def contact(by_depth, by_rate, curve=0.0, cube=0.0, jump=0.0):
    """Return equations whose contact (mode 2) changes the field by its depth and rate, beside that of the free mode 1."""
    row = 2.0 * ROW

    def field(T, which, x, f):
        f[:] = np.sin(np.arange(4.0)) * x[:4].sum()
        if which == 2:
            d, s = row[:2] @ x[:2] + row[4:] @ x[4:], row[:2] @ x[2:4]
            f += by_depth * d + by_rate * s + (curve * d * d + cube * d**3 + curve * s * s + jump) * np.array([0.0, 0.0, 1.0, -1.0])

    return SimpleNamespace(weights=1e4 * WEIGHTS, kernel=SimpleNamespace(guard_gradient=gradient, field=field))


SPRING, DASHPOT = np.array([0.0, 0.0, -3.0, 7.0]), np.array([0.0, 0.0, 0.4, -0.9])
TOUCHING = np.array([0.5, 0.2, 0.6, 0.24, 0.0, 0.0, 0.0])


def test_how_a_contact_begins_is_read_from_shallow_ones():
    """Linear in depth and rate; what is square or cubic in them is taken away, what is more than that, or jumps, is not known."""
    T = tables(1.0)
    for curve, cube in ((0.0, 0.0), (0.3, 0.0), (0.3, 1e-5)):
        found = touch._begins(contact(SPRING, DASHPOT, curve, cube), T, 1, 1, 2, TOUCHING)
        assert found[0] == pytest.approx(SPRING, abs=1e-8) and found[1] == pytest.approx(DASHPOT, abs=1e-8)
    for e in (contact(SPRING, DASHPOT, 0.0, 0.1), contact(SPRING, DASHPOT, jump=0.1),
              contact(0.0 * SPRING, 0.0 * DASHPOT, 0.0, 1.0)):
        assert np.isnan(touch._begins(e, T, 1, 1, 2, TOUCHING)).all()
    assert not np.isnan(touch._begins(contact(SPRING, DASHPOT, jump=1e-5), T, 1, 1, 2, TOUCHING)).any()


@pytest.mark.parametrize("law", [0.0, 1.0])
def test_a_soft_contact_changes_the_state_by_its_depth(law, rng, monkeypatch):
    """Minus (k b + c A b): the field's slope turns what the rate does into what the depth does."""
    T, slope = tables(law), rng.normal(size=(4, 7))
    monkeypatch.setattr(touch, "field_slope", lambda e, T_, mode, joined: slope)
    if law:
        found = touch._compliance(contact(SPRING, DASHPOT), T, 1, 1, 2, TOUCHING)
        assert found == pytest.approx(-(SPRING + slope[:, :4] @ DASHPOT), abs=1e-7)
        return
    T.GT[1, 1] = rng.normal(size=(7, 5))
    T.A[1] = slope
    T.A[2] = slope + np.outer(SPRING, T.GT[1, 1, :, 0]) + np.outer(DASHPOT, T.GT[1, 1, :, 1])
    assert touch._compliance(None, T, 1, 1, 2, None) == pytest.approx(-(SPRING + slope[:, :4] @ DASHPOT), abs=1e-12)
    T.LU = np.zeros((1, 7))
    assert np.isfinite(touch._compliance(None, T, 1, 1, 2, None)).all()
    T.LP[2, 0, 1] = 0.5  # laws act in one of the modes
    assert np.isnan(touch._compliance(None, T, 1, 1, 2, None)).all()
    T.LP[2, 0, 1] = 0.0
    T.A[2, 3, 2] += 1e-6
    assert np.isnan(touch._compliance(None, T, 1, 1, 2, None)).all()


def test_an_apex_beyond_the_stop_and_what_is_none(monkeypatch):
    """Depth h under an acceleration -a: the speed that reaches it is sqrt(2 h / a) times a; the field's own rate by its slope."""
    F = np.array([[0.0, 1.0, 0.0, 0.0], [-2.0, -0.3, 0.5, 0.7]])
    depth, apex = 0.08, -4.0

    def field(T, mode, x, f):
        f[:] = F @ x

    def forcing_rate(T, x, dw):
        dw[:] = [0.0, 3.0]

    kernel = SimpleNamespace(guard_value=lambda T, mode, guard, x: depth, field=field, forcing_rate=forcing_rate)
    stop = SimpleNamespace(problem=SimpleNamespace(equations=SimpleNamespace(kernel=kernel)),
                           tables=SimpleNamespace(A=np.zeros((1, 2, 4))), mode=0, guard=0,
                           joined=lambda y, t: np.array([*y, 1.0, t]))
    monkeypatch.setattr(discontinuity, "rates", lambda e, T, mode, guard, x: (apex, 1.7))
    monkeypatch.setattr(discontinuity, "field_slope", lambda e, T, mode, x: F)
    y = np.array([0.4, 0.9])
    u, a, jerk, f, f2, slope = discontinuity._local(stop, y, 0.2)
    speed = -0.8 - 0.27 + 0.5 + 0.14
    assert (u, a, jerk) == (pytest.approx(0.2), -4.0, 1.7) and f == pytest.approx([0.9, speed])
    assert f2 == pytest.approx([speed, -2.0 * 0.9 - 0.3 * speed + 0.7 * 3.0]) and np.array_equal(slope, F[:, :2])
    apex = 0.0
    with pytest.raises(ValueError, match="no maximum"):
        discontinuity._local(stop, y, 0.2)
    depth = 0.0
    assert discontinuity._local(stop, y, 0.2) is None
    for bad in (np.zeros(3), np.array([np.nan, 0.0])):
        with pytest.raises(ValueError, match="finite state of shape"):
            discontinuity._local(stop, bad, 0.2)


PERIOD = 2.0  # periods of the forcing that an orbit spans


def orbit(monkeypatch, module, closure=1):
    """Return an orbit of three nodes at the times .25 (a section), .5 and 1.75, on which the state at a time is that time."""
    nodes = np.array([[0, -1, 0, 0, 0], [0, 1, 1, 0, 0], [1, 0, 0, 1, 0]])
    whole, U = SimpleNamespace(nodes=nodes, span=PERIOD), np.array([0.25, 10.0, 0.5, 20.0, 1.75, 30.0])
    monkeypatch.setattr(module, "repeated", lambda scene, s, u: (whole, U))
    asked = []

    def states(T, n, span, u, times, out):
        assert n is nodes and span == PERIOD and u is U
        asked.append(float(times[0]))
        out[0, :] = times[0]

    def monodromy(T, listed, span, u, M):
        asked.append((listed.tolist(), span, u.tolist()))
        M[:] = 7.0

    T = SimpleNamespace(A=np.zeros((2, 1, 4)), flat=np.array([np.pi]))
    kernel = SimpleNamespace(forcing=lambda T_, t, joined: joined.__setitem__(slice(1, None), [1.0, t, 0.0]),
                             guard_value=lambda T_, mode, guard, joined: (mode, guard) == (3, 2) and joined[0] + 100.0 * joined[2])
    e = SimpleNamespace(numbers_at=lambda p: T, motion=SimpleNamespace(states=states, monodromy=monodromy), kernel=kernel)
    scene = SimpleNamespace(ns=1, forcing=lambda t: np.zeros((1, 3)))
    return SimpleNamespace(scene=scene, equations=e, sequence=SimpleNamespace(closure=closure), weights=np.ones(1)), asked


@pytest.mark.parametrize("tau, begins", [(0.3, 0.3), (0.2, 2.2), (2.25, 0.25), (4.0, 2.0)])
def test_a_guard_at_a_time_of_any_period(tau, begins, monkeypatch):
    problem, asked = orbit(monkeypatch, confirm)
    value = confirm.guard_at(problem, np.array([0.0, 5.0]), tau, SimpleNamespace(mode=3, guard=2))
    assert asked == [pytest.approx(begins)] and value == pytest.approx(begins + 100.0 * 2.0 * tau)  # a forcing period is 2


@pytest.mark.parametrize("tau, half, mode, order", [
    (0.6, False, 1, [2, 0, 1]), (0.6, True, 1, []), (0.75, True, 1, []),
    (1.75, False, 1, [2, 0, 1]), (1.8, True, 0, [0, 1]), (0.25, False, 0, [1, 2]),
    (0.25, True, 0, [1]), (0.5, True, 0, [1])])
def test_the_map_of_an_orbit_from_any_time(tau, half, mode, order, monkeypatch):
    """The node at that time comes first, then the events in their order until the (half) period is over; a section there
    is not told again, an event is."""
    problem, asked = orbit(monkeypatch, touch)
    M = touch._map_from(problem, np.array([0.0, 5.0]), tau, half)
    begin, (nodes, span, u) = asked
    every = np.array([0.25, 0.5, 1.75])
    assert M == (-7.0 if half else 7.0) and span == (1.0 if half else 2.0) and begin == pytest.approx(0.25 + (tau - 0.25) % 2.0)
    assert nodes[0] == [mode, -1, mode, 0, 0] and u[:2] == pytest.approx([tau, begin])
    assert nodes[1:] == [[[0, -1, 0, 0, 0], [0, 1, 1, 0, 0], [1, 0, 0, 1, 0]][k] for k in order]
    assert u[2::2] == pytest.approx(tau + (every[order] - tau) % 2.0) and u[3::2] == [10.0 * (k + 1) for k in order]


@dataclass
class Top:
    mode: int
    guard: int
    time: float
    state: np.ndarray
    E: object = None
    symmetric: bool = False


def test_touches_that_are_mirror_images_are_one(monkeypatch):
    """Half a period (of 6, in a unit where the forcing's is 2) apart, on mirrored guards, with the opposite state."""
    monkeypatch.setattr(touch, "_map_from", lambda problem, x, tau, half: (tau, half))
    scene = SimpleNamespace(mirror=lambda m: 1 - m, mirror_guard=lambda m, g: 5 - g, system=SimpleNamespace(mirror_order=(0,)))
    problem = SimpleNamespace(sequence=SimpleNamespace(closure=1, span=3.0), scene=scene, weights=np.array([1.0, 10.0]),
                              equations=SimpleNamespace(numbers_at=lambda p: SimpleNamespace(flat=np.array([np.pi]))))

    def merged(mode=1, guard=3, time=4.0, off=(0.0, 0.0), count=2):
        a = Top(0, 2, 1.0, np.array([0.3, -7.0]))
        b = Top(mode, guard, time, np.array([-0.3, 7.0]) + off)
        found = touch._mirrored(problem, np.zeros(3), [a, b, b][:count])
        if len(found) == count:
            return False
        assert len(found) == 1 and found[0].symmetric and found[0].E == (0.5, True) and found[0].time == 1.0
        return True

    assert merged() and merged(off=(0.9e-6, 0.9e-5)) and merged(off=(-0.9e-6, -0.9e-5)) and merged(time=4.0 + 2.9e-6)
    assert not merged(mode=0) and not merged(guard=2) and not merged(time=4.0 + 3.1e-6) and not merged(time=4.0 - 3.1e-6)
    assert not merged(off=(1.1e-6, 0.0)) and not merged(off=(0.0, -1.1e-5)) and not merged(count=3) and not merged(count=1)
    for closure, span, order in ((-1, 3.0, (0,)), (1, 2.0, (0,)), (1, 3.5, (0,)), (1, 3.0, None)):
        problem.sequence, scene.system.mirror_order = SimpleNamespace(closure=closure, span=span), order
        assert not merged()


def test_classes_of_onsets(monkeypatch):
    kinds = [kind for kind in Kind if kind not in sliding.KINDS]
    problem = SimpleNamespace(sequence=object())

    def found(kind, name="", **more):
        orbit_ = SimpleNamespace(**{**vars(problem), **more})
        return sliding.sliding_class(SimpleNamespace(kind=kind, name=name, problem=orbit_, x="x"))

    monkeypatch.setattr(sliding, "_of_vanishing", lambda p, x: ("vanishing", x))
    monkeypatch.setattr(sliding, "_of_touch", lambda p, x: ("touch", x))
    for kind in sliding.KINDS:
        assert found(kind, "leaving") is SlidingClass.CROSSING and found(kind, "listed") == ("vanishing", "x")
        assert found(kind) == ("touch", "x") and found(kind, sequence=None) is None
    assert all(found(kind, "leaving") is None for kind in kinds)


@pytest.mark.parametrize("segment, time, guard, known", [
    (1, 0.5, 0, SlidingClass.SWITCHING), (1, 0.7, 0, SlidingClass.ADDING), (0, 0.5, 1, SlidingClass.GRAZING), (0, 0.5, 2, None),
    (-1, 0.5, 0, None)])
def test_an_onset_is_named_by_the_mode_that_is_touched(segment, time, guard, known):
    """Mode 1 sticks, mode 0 slips: behind its guard 1 is a stick, behind 2 none."""
    def monitor(T, nodes, fixed, span, closure, u, weights, info):
        info[sequence.PEAK_SEGMENT], info[sequence.PEAK_GUARD], info[sequence.PEAK_TIME] = segment, guard, time

    then = np.full((2, 3, 2), -1)
    then[0, 1] = [0, 1]
    then[0, 2] = [0, 2]
    scene = SimpleNamespace(ns=1, guard=lambda m, g: SimpleNamespace(element=0), expand=lambda m, g: SimpleNamespace(then=then),
                            hold_element=lambda m, k: 0, tables=SimpleNamespace(n_holds=np.array([0, 1, 0])))
    orbit_ = SimpleNamespace(nodes=np.array([[0, -1, 0, 0, 0], [0, 1, 1, 0, 0]]), fixed=None, span=1.0)
    e = SimpleNamespace(kernel=SimpleNamespace(monitor=monitor), numbers_at=lambda p: None, closure=1, weights=None)
    found = sliding._of_touch(SimpleNamespace(scene=scene, sequence=orbit_, equations=e), np.array([0.0, 9.0, 0.5, 9.0, 3.0]))
    assert found is known
