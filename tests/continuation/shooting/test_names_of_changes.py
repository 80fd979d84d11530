"""What a change of the sequence is called, on sequences written by hand: durations, order, counts; sizes that count as none."""
import math
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.continuation.kinds import SpecialPointKind as Kind
from bifurc.continuation.shooting import autonomous
from bifurc.continuation.shooting import signature_change as changes
from bifurc.continuation.shooting.completion import ratio
from bifurc.elements import EventKind
from bifurc.elements.friction.dry import SLIP_DOWN, SLIP_UP, STICK
from bifurc.orbits.shooting.sequence import TOGETHER
from bifurc.orbits.shooting.signature import Signature

IMPACT, SLIP, STICKS, CONTACT, PARTS, RELEASE = (EventKind.IMPACT, EventKind.SLIP, EventKind.STICK, EventKind.CONTACT,
                                                 EventKind.SEPARATION, EventKind.RELEASE)


class Scene:
    """Guard 10 e + k belongs to element e, its event is the k-th of a list; the keys of a mode are given."""

    n, ns = 1, 2
    events = [IMPACT, SLIP, STICKS, CONTACT, PARTS, RELEASE]

    def __init__(self, keys=()):
        self.keys = keys or ((None,) * 9,) * 9
        self.tables = SimpleNamespace(kick=np.zeros((9, 40), int))
        self.tables.kick[:, 0::10] = 1

    def guard(self, mode, guard):
        return SimpleNamespace(element=guard // 10)

    def event_kind(self, mode, guard):
        return self.events[guard % 10]


def at(*events, span=1.0, closure=1, clock=0.0, keys=(), modes=None):
    """Return a problem with (time, guard[, order, closes]) and its unknowns; modes: before and after, 0 unless given."""
    modes = modes or [(0, 0)] * len(events)
    nodes = np.array([[m, e[1], k, *(list(e[2:]) + [0, 0])[:2]] for e, (m, k) in zip(events, modes, strict=True)], np.int64)
    x = np.append(np.array([[e[0], 0.5, 0.5] for e in events]).ravel(), 2.0)
    return SimpleNamespace(sequence=Signature(nodes, np.zeros(len(nodes)), span, closure, clock), scene=Scene(keys), x0=x), x


def g(element, kind):
    return 10 * element + Scene.events.index(kind)


def test_durations_since_the_event_before():
    problem, x = at((0.2, 0), (0.5, 1), (0.9, 2), span=2.0)
    assert changes.intervals(problem, x) == pytest.approx([1.3, 0.3, 0.4])
    problem, x = at((0.2, 0), (0.5, 1, TOGETHER), (0.9, 2))
    assert changes.intervals(problem, x).tolist() == pytest.approx([0.3, math.inf, 0.4])
    free, x = at((7.0, 0), (2.5, 1), (6.0, 2), span=0.0, clock=1.0)  # the first unknown is the period
    assert changes.intervals(free, x) == pytest.approx([1.0, 2.5, 3.5])


def test_a_slip_more_is_named_after_the_shorter_of_its_stick_and_itself():
    """Stick ends (slip) .1 behind the end of a slip, and slips .3; the other way round."""
    slip, stick = g(0, SLIP), g(0, STICKS)
    assert changes.cut_short(*at((0.5, slip), (0.51, stick), (0.9, slip), (0.97, stick))) is Kind.SLIP_ONSET
    assert changes.cut_short(*at((0.5, slip), (0.6, stick), (0.62, slip), (0.97, stick))) is Kind.STICK_ONSET
    assert changes.cut_short(*at((0.5, slip), (0.9, stick), (0.97, g(1, IMPACT)))) is Kind.SLIP_ONSET  # .4 behind it, .53 before
    assert changes.cut_short(*at((0.1, slip), (0.9, stick), (0.97, g(1, IMPACT)))) is Kind.STICK_ONSET  # .8 behind it, .13 before


@pytest.mark.parametrize("before, behind, want", [
    (0.01, 0.3, Kind.SLIP_ONSET),  # the slip before the end of slip is short
    (0.2, 0.01, Kind.STICK_ONSET),  # the stick behind it is; .33 before both it sticks
])
def test_one_more_end_of_slip_is_named_after_the_shortest_interval_beside_it(before, behind, want):
    """Element 1 slips (mode 0), sticks (mode 1); another contact has an interval that is shorter still."""
    keys = [("free", SLIP_UP), ("free", STICK), ("rest", SLIP_UP)]
    end = 0.5
    events = [(end - before, g(1, SLIP)), (end, g(1, STICKS)), (end + behind, g(1, SLIP)), (0.97, g(0, IMPACT)),
              (0.971, g(0, RELEASE))]
    problem, x = at(*events, keys=keys, modes=[(1, 0), (0, 1), (1, 0), (0, 2), (2, 0)])
    assert changes.beside_stick(problem, x, {1}) is want
    turned = [events[-1], *events[:-1]]  # listed from another event on
    problem, x = at((events[-1][0] - 1.0, events[-1][1]), *turned[1:], keys=keys, modes=[(2, 0), (1, 0), (0, 1), (1, 0), (0, 2)])
    assert changes.beside_stick(problem, x, {1}) is want


def test_the_last_event_is_followed_by_the_first():
    keys = [(SLIP_UP,), (STICK,), (SLIP_DOWN,)]
    slip, stick = g(0, SLIP), g(0, STICKS)
    problem, x = at((0.0, slip), (0.5, stick), (0.6, slip), (0.995, stick), keys=keys, modes=[(1, 0), (0, 1), (1, 2), (2, 1)])
    assert changes.beside_stick(problem, x, {0}) is Kind.STICK_ONSET  # .005 of stick round the end of the period


def test_of_sticks_and_slips_the_shortest_interval_says_what_begins():
    slip, stick = g(0, SLIP), g(0, STICKS)
    assert changes.shortest(*at((0.1, stick), (0.12, slip), (0.5, stick), (0.9, slip)), {0}) is Kind.STICK_ONSET
    assert changes.shortest(*at((0.1, stick), (0.4, slip), (0.42, stick), (0.9, slip)), {0}) is Kind.SLIP_ONSET
    assert changes.shortest(*at((0.1, stick), (0.4, slip), (0.41, g(1, IMPACT))), {0}) is Kind.STICK_ONSET
    assert changes.shortest(*at((0.1, g(1, IMPACT)), (0.4, g(1, IMPACT))), {0}) is None


@pytest.mark.parametrize("parts", [(2e-9, 5e-9), (5e-9, 2e-9)])
def test_a_moment_in_which_another_contact_begins_to_slip_is_one_slip(parts):
    """Element 0 sticks, slips for a moment and sticks again; element 1 begins to slip in this moment, early or late."""
    slip, stick, other = g(0, SLIP), g(0, STICKS), g(1, SLIP)
    events = ((0.3, slip), (0.3 + parts[0], other), (0.3 + sum(parts), stick), (0.8, g(1, STICKS)))
    keys = ((STICK, STICK), (SLIP_UP, STICK), (SLIP_UP, SLIP_UP), (STICK, SLIP_UP))
    problem, x = at(*events, keys=keys, modes=[(0, 1), (1, 2), (2, 3), (3, 0)])
    assert changes.shortest(problem, x, {0}) is Kind.SLIP_ONSET
    spans = changes.intervals(problem, x)
    assert changes.stay(problem.scene, problem.sequence.nodes.tolist(), spans, 2, 0) == (pytest.approx(sum(parts)), 2)
    assert changes.stay(problem.scene, problem.sequence.nodes.tolist(), spans, 0, 0) == (pytest.approx(1.0 - sum(parts)), 2)


@pytest.mark.parametrize("parts", [(0.0, 0.0), (1e-16, -1e-16), (-1e-16, 2e-16), (3e-16, 1e-16)])
def test_of_two_stays_that_last_no_time_the_one_within_the_other_is_told(parts):
    """Element 0 sticks while element 1 begins to slip; it lets go, and element 1 sticks again: the stick lies within that slip."""
    events = ((0.3, g(0, STICKS)), (0.3 + parts[0], g(0, SLIP)), (0.3 + sum(parts), g(1, STICKS)), (0.8, g(1, SLIP)))
    keys = ((SLIP_UP, STICK), (STICK, SLIP_UP), (SLIP_UP, SLIP_UP), (SLIP_UP, STICK), (SLIP_UP, SLIP_UP))
    problem, x = at(*events, keys=keys, modes=[(0, 1), (1, 2), (2, 3), (3, 0)])
    assert changes.shortest(problem, x, {0, 1}) is Kind.STICK_ONSET


# what changes places

def test_two_neighbours_that_change_places_name_the_change():
    hit, slip, parts = g(0, IMPACT), g(1, SLIP), g(2, PARTS)
    one, x = at((0.3, hit), (0.3001, slip), (0.8, parts))
    other, _ = at((0.3, slip), (0.3001, hit), (0.8, parts))
    assert changes.exchanged(one, x, other) is Kind.SLIP_ONSET
    assert changes.exchanged(one, x, at((0.7, parts), (0.8, slip), (0.9, hit))[0]) is Kind.SLIP_ONSET  # listed from another one on
    assert changes.exchanged(one, x, at((0.7, parts), (0.8, hit), (0.9, slip))[0]) is None  # nothing changes
    assert changes.exchanged(one, x, at((0.7, hit), (0.8, slip))[0]) is None  # other events
    far, x = at((0.3, hit), (0.5, slip), (0.8, parts))
    assert changes.exchanged(far, x, other) is None  # not at one instant
    # a pair changes places in each half: both must be of one instant
    back = g(3, CONTACT)
    four = [(0.1, hit), (0.1001, slip), (0.6, back), (0.6001, parts)]
    both, x = at(*four)
    turned, _ = at((0.1, slip), (0.1001, hit), (0.6, parts), (0.6001, back))
    assert changes.exchanged(both, x, turned) is Kind.SLIP_ONSET
    late, x = at(*four[:3], (0.7, parts))
    assert changes.exchanged(late, x, turned) is None
    half, x = at((0.1, hit), (0.1001, slip), (0.4, parts), span=0.5, closure=-1)
    whole, _ = at(*[(0.5 * k + t, e) for k in (0, 1) for t, e in ((0.1, slip), (0.1001, hit), (0.4, parts))])
    assert changes.exchanged(half, x, whole) is Kind.SLIP_ONSET


def test_an_event_that_leaps_over_a_stay_names_the_change():
    """A separation before a stick and the slip behind it, or after them; a stick that leaps; nothing where two have moved."""
    part, touch, stick, slip, other = g(0, PARTS), g(0, CONTACT), g(1, STICKS), g(1, SLIP), g(2, SLIP)

    def made(*guards, surface=1.0):
        problem, x = at(*((0.1 + 0.1 * k, guard) for k, guard in enumerate(guards)))
        T = SimpleNamespace(D=np.zeros((1, 40, 2)), LG=np.zeros((1, 40, 1)))
        T.D[0, part, 0] = surface
        problem.equations = SimpleNamespace(numbers_at=lambda p: T)
        return problem, x

    early, late = (touch, part, stick, slip, other), (slip, part, other, touch, stick)  # begun anywhere
    for one, two in ((early, late), (late, early)):
        assert changes.leapt(*made(*one), made(*two)[0]) is Kind.GRAZING
        assert changes.leapt(*made(*one, surface=0.0), made(*two)[0]) is Kind.SEPARATION
    assert changes.leapt(*made(touch, part, other, stick, slip), made(stick, touch, part, other, slip)[0]) is Kind.STICK_ONSET
    assert changes.leapt(*made(*early), made(other, slip, stick, part, touch)[0]) is None
    assert changes.leapt(*made(*early), made(*early[2:], *early[:2])[0]) is None


def test_events_of_one_instant_stand_in_one_order():
    a, b, c = g(2, SLIP), g(1, SLIP), g(0, IMPACT)
    one, x = at((0.3, a), (0.3, b, TOGETHER), (0.6, c))
    other, y = at((0.3, b), (0.3, a, TOGETHER), (0.6, c))
    mask = np.ones(3, bool)
    names, spans = changes.by_instant(one, x, mask)
    assert names == [(1, "slip"), (2, "slip"), (0, "impact")] == changes.by_instant(other, y, mask)[0]
    assert spans.tolist() == pytest.approx([0.7, math.inf, 0.3])
    round_, z = at((0.3, b, TOGETHER), (0.6, c), (1.3, a))  # the instant is that of the last and the first
    assert changes.by_instant(round_, z, mask)[0] == [(0, "impact"), (1, "slip"), (2, "slip")]
    assert changes.by_instant(round_, z, mask)[1].tolist() == pytest.approx([0.3, 0.7, math.inf])
    few = np.array([True, False, True])
    assert changes.by_instant(one, x, few)[0] == [(2, "slip"), (0, "impact")]


def test_impacts_that_one_of_two_chatterings_lists_more_are_left_out():
    hit, slip = g(0, IMPACT), g(1, SLIP)
    short, _ = at((0.1, slip), (0.2, hit, 0, 2), (0.3, hit, 0, 1))
    long, _ = at((0.1, slip), (0.15, hit), (0.2, hit, 0, 2), (0.25, hit, 0, 2), (0.3, hit, 0, 1))
    masks = changes.as_long(short, long)
    assert masks[0].tolist() == [True] * 3 and masks[1].tolist() == [True, True, False, False, True]
    assert [mask.tolist() for mask in changes.as_long(long, short)] == [masks[1].tolist(), masks[0].tolist()]
    broken, _ = at((0.1, slip), (0.2, hit, 0, 2), (0.22, slip), (0.25, hit, 0, 2), (0.3, hit, 0, 1))
    assert changes.as_long(short, broken)[1].tolist() == [True, True, True, False, True]  # up to another event
    assert [mask.all() for mask in changes.as_long(short, short)] == [True, True]


def test_a_contact_more_is_a_graze_where_it_begins_on_a_surface():
    def problem(D, LG):
        made, x = at((0.2, g(1, CONTACT)), (0.4, g(0, CONTACT)), (0.5, g(0, PARTS)))
        T = SimpleNamespace(D=np.zeros((1, 40, 2)), LG=np.zeros((1, 40, 1)))
        T.D[0, g(0, CONTACT), 0], T.LG[0, g(0, CONTACT)] = D, LG
        made.equations = SimpleNamespace(numbers_at=lambda p: T)
        return made, x
    assert changes.brief_contact(*problem(1.0, 0.0), {0}) is Kind.GRAZING
    assert changes.brief_contact(*problem(0.0, 0.0), {0}) is Kind.SEPARATION
    assert changes.brief_contact(*problem(1.0, 0.0), {1}) is Kind.SEPARATION  # that of the other one is none


def test_a_guard_that_is_a_law_is_a_surface_where_positions_alone_change_it(monkeypatch):
    def gradient(T, mode, guard, x, row):
        row[:] = T.row
    monkeypatch.setattr(changes, "kernels", lambda scene: SimpleNamespace(guard_gradient=gradient))
    for row, surface in (([2.0, 0.0, 5.0], True), ([2.0, 0.1, 5.0], False), ([0.0, 1.0, 5.0], False), ([0.0, 0.0, 5.0], False)):
        T = SimpleNamespace(D=np.zeros((1, 1, 2)), LG=np.ones((1, 1, 1)), A=np.zeros((1, 2, 3)), row=np.array(row))
        assert changes.is_surface(Scene(), T, 0, 0, np.zeros(2)) is surface


# sizes

@pytest.mark.parametrize("restitution, want", [(0.05, math.log(changes.LEFT) / math.log(ratio(0.05))), (0.9, changes.TRAIN)])
def test_how_many_impacts_may_be_those_of_a_sequence(restitution, want):
    problem, _ = at((0.2, 0))
    problem.equations = SimpleNamespace(numbers_at=lambda p: SimpleNamespace(ratio=np.full((1, 40), restitution)))
    signature = at((0.1, g(0, IMPACT), 0, 2), (0.3, g(0, IMPACT), 0, 1))[0].sequence
    assert changes.resolved(problem, signature) == pytest.approx(want)
    assert changes.resolved(problem, at((0.1, g(0, IMPACT)))[0].sequence) == changes.TRAIN


@pytest.mark.parametrize(("at_the_end", "behind", "span", "closure", "told"), [
    (1e-9, 1e-3, 2.0, 1, True), (1e-4, 1e-3, 2.0, 1, False), (1e-9, 1e-3, 1.0, 1, False), (1e-9, 1e-3, 1.0, -1, True),
    (0.0, 0.0, 2.0, 1, False), (1e-14, 1e-10, 2.0, 1, False)])
def test_a_motion_of_two_periods_merges_where_its_halves_come_together(monkeypatch, at_the_end, behind, span, closure, told):
    """At the boundary the halves differ by much less than a step behind it, and there by more than rounding."""
    def apart(problem, x, part):
        assert part == 1
        return at_the_end if x[0] == 0.0 else behind
    monkeypatch.setattr(changes, "unlike", apart)
    problem = SimpleNamespace(sequence=SimpleNamespace(span=span, closure=closure, clock=0.0), scale=np.ones(3),
                              correct=lambda guess, tangent: SimpleNamespace(x=guess, converged=True))
    assert changes.merges(problem, np.zeros(3), np.ones(3)) is told


# orbits of unknown period

def test_an_orbit_without_events_begins_at_the_maximum_of_its_widest_coordinate():
    """Two harmonic coordinates of one frequency, the second wider; its first maximum behind the start."""
    def advance(T, mode, start, t, y):
        y[:] = np.cos(t + 0.4), 3.0 * np.cos(t + 1.1), -np.sin(t + 0.4), -3.0 * np.sin(t + 1.1)
    e = SimpleNamespace(numbers_at=lambda p: SimpleNamespace(A=np.zeros((1, 4, 5)), flat=np.array([2.0 * np.pi])),
                        motion=SimpleNamespace(forcing=lambda T, t, x: None, advance=advance))
    signature = Signature(np.array([[0, -1, 0, 0, 0]]), np.zeros(1), 2.0 * np.pi, 1, 1.3)
    scene, weights = SimpleNamespace(ns=4, n=2), np.array([1.0, 1.0, 2.0, 4.0])
    plain = SimpleNamespace(equations=e, scene=scene, sequence=signature, weights=weights)
    made, U = autonomous.free(plain, signature, np.append([0.0, np.cos(0.4), 3.0 * np.cos(1.1), 0.0, 0.0], 5.0))
    top = 2.0 * np.pi - 1.1
    np.testing.assert_allclose(U, [2.0 * np.pi, np.cos(top + 0.4), 3.0, -np.sin(top + 0.4), 0.0], atol=1e-12)
    assert made.span == 0.0 and made.clock == 1.3 and made.fixed.tolist() == [0.0, 0.0, 0.0, 0.25, 0.0]


@pytest.mark.parametrize("closure", [1, -1])
@pytest.mark.parametrize("off", [0.0, 0.3])
def test_a_cycle_shrinks_onto_the_equilibrium_whose_eigenvalues_turn_imaginary(closure, off, monkeypatch):
    """x = p / 2 with a real part (p - 2) (p + 9), of frequency 3: half a turn for half a period; ``off``: another period."""
    class Rest:
        scale, x0 = np.ones(3), np.array([0.9, 0.0, 1.9])

        def __init__(self, *given):
            self.given = given

        def correct(self, x, tangent, fixed):
            p = float(x[-1])
            monitors = np.array([7.0, (p - 2.0) * (p + 9.0)])
            return SimpleNamespace(x=np.array([0.5 * p, 0.0, p]), p=p, converged=True, monitors=monitors)

        def confirm(self, kind, x):
            return kind is Kind.HOPF

        def frequency(self, x):
            return 3.0

        def state(self, u):
            return u
    made = []
    monkeypatch.setattr(autonomous, "named", lambda name: lambda *given: made.append(given) or Rest(*given))
    monkeypatch.setattr(autonomous, "at_end", lambda problem, a, which: "monitors")
    period = 2.0 * np.pi / 3.0 / 1.3 * (0.5 if closure < 0 else 1.0)
    sequence = Signature(np.array([[4, -1, 4, 0, 0]]), np.zeros(3), 0.0, closure, 1.3)
    problem = SimpleNamespace(scene=SimpleNamespace(ns=2, n=1), sequence=sequence, system=None, path=None, parameter_scale=1.0,
                              weights=np.ones(2), scale=np.ones(4), _shrinks="w", _measured=lambda x, i: (0.98, 0.9, 0.0))
    rows = [SimpleNamespace(x=np.array([period * (1.01 + off), 0.9 + d, d, p]), p=p, det_sign=1.0)
            for d, p in ((0.02, 1.9), (0.01, 1.95))]
    found = autonomous.shrunk(problem, *rows)
    if off:
        assert found is None
        return
    np.testing.assert_allclose(found.x, [period, 1.0, 0.0, 2.0], atol=1e-12)
    assert made[0][2] == 4 and made[0][3].tolist() == pytest.approx([0.94, 0.0])  # the middle between top and bottom
    assert np.linalg.norm(found.tangent) == pytest.approx(1.0) and found.tangent[-1] == 0.0 and found.tangent[1] < 0.0
