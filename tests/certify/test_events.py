"""What vanishes behind an event, on small matrices of rationals: spans, orders of guards, candidates that are ruled out."""
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc.certify.arithmetic.balls import working
from bifurc.certify.candidate import candidate_of
from bifurc.certify.events import (
    FOREVER,
    ROUNDING,
    Rule,
    Span,
    as_float,
    balls_of,
    behind,
    dot,
    held_rows,
    kept_exactly,
    order_of,
    structure,
    times,
)
from bifurc.orbits.shooting.labels import Labels

flint = pytest.importorskip("flint")
arb, q, mat = flint.arb, flint.fmpq, flint.fmpq_mat


@pytest.fixture(autouse=True)
def bits():
    with working(128):
        yield


def row(*values):
    return [v if isinstance(v, q) else q(*v) if isinstance(v, tuple) else q(v) for v in values]


def matrix(rows):
    return mat(len(rows), len(rows[0]), [v for r in rows for v in row(*r)])


def model(nx=3, modes=None):
    return SimpleNamespace(nx=nx, field=SimpleNamespace(matrix=mat), mode=lambda keys: modes[keys])


FALL = matrix([[0, 1, 0], [0, 0, -2], [0, 0, 0]])  # q' = v, v' = -2, of the joined state (q, v, 1)
ONE = matrix([[1, 0, 0], [0, 1, 0], [0, 0, 1]])


def test_rows_are_combinations_exactly_or_up_to_their_rounding():
    span = Span(model(), [row(1, 2, 3), row(0, 0, 0), row(0, (1, 3), 1)])
    assert span.rank == 2 and len(span.rows) == 2 and not span.rounded
    assert span.holds(row(0, 0, 0)) and span.holds(row(2, 5, 9)) and not span.rounded  # twice the first and three times the other
    assert not span.holds(row(1, 2, 4)) and not span.holds(row(0, 0, 1)) and not span.rounded
    near = q(9) + q(1, 10**15)
    assert span.holds(row(2, 5, near)) and span.rounded
    other = Span(model(), [row(1, 2, 3), row(0, (1, 3), 1)])
    assert not other.holds(row(2, 5, q(9) + q(1, 10**9))) and not other.rounded
    none = Span(model(), [])
    assert none.rank == 0 and none.holds(row(0, 0, 0)) and not none.holds(row(0, q(1, 10**20), 0))
    # a sum of terms that cancel: as small as their rounding
    large = lambda: np.array([1.0, 1.0, 1.0]) / ROUNDING  # noqa: E731
    assert none.holds(row(0, (1, 2), 0), large) and none.rounded


def test_numbers_rows_and_products():
    assert as_float(q(0)) == 0.0 and as_float(q(1, 3)) == 1.0 / 3.0 and as_float(q(-7, 2)) == -3.5
    assert times(model(), row(1, 2, 3), FALL) == row(0, 1, -4)
    x = flint.arb_mat(3, 1, [2, 3, 5])
    assert dot(row(1, 0, (1, 2)), x) == arb(4.5) and dot(row(0, 0, 0), x) == arb(0)
    assert balls_of(FALL)[1, 2] == arb(-2)


@pytest.mark.parametrize("zero, order", [((), 0), (((1, 0, 0),), 1), (((1, 0, 0), (0, 1, 0)), 2),
                                         (((1, 0, 0), (0, 1, 0), (0, 0, 1)), FOREVER), (((0, 1, 0),), 0)])
def test_the_order_of_a_height_behind_an_event_is_that_of_the_first_derivative_that_may_not_vanish(zero, order):
    span = Span(model(), [row(*z) for z in zero])
    assert order_of(model(), SimpleNamespace(row=row(1, 0, 0)), FALL, ONE, span) == order


def test_a_reset_is_pulled_back():
    """A plastic impact: behind it the speed is zero whatever arrives."""
    plastic = matrix([[1, 0, 0], [0, 0, 0], [0, 0, 1]])
    none = Span(model(), [])
    assert behind(model(), row(0, 1, 0), plastic, none) and not behind(model(), row(0, 1, 0), ONE, none)
    assert not behind(model(), row(1, 0, 0), plastic, none)
    on = Span(model(), [row(1, 0, 0)])
    assert order_of(model(), SimpleNamespace(row=row(1, 0, 0)), FALL, plastic, on) == 2
    assert order_of(model(), SimpleNamespace(row=row(1, 0, 0)), FALL, ONE, on) == 1


def test_candidates_are_ruled_out_by_rows_that_move_and_by_guards_beyond():
    held = SimpleNamespace(speed=row(0, 1, 0), surface=None)
    modes = {"free": SimpleNamespace(holds=[], guards=[SimpleNamespace(row=row(1, 0, 0))], B=FALL),
             "rest": SimpleNamespace(holds=[held, SimpleNamespace(speed=None, surface=row(1, 0, 0))], guards=[], B=FALL)}
    of = model(modes=modes)
    assert held_rows(of, "rest") == [row(0, 1, 0), row(1, 0, 0)] and held_rows(of, "free") == []

    def decides(keys, x, held=(), guards=(), resets=(ONE,), after=0):
        rule = Rule(keys, keys, after, list(held), list(guards))
        return rule.decides(of, [balls_of(r) for r in resets], flint.arb_mat(3, 1, [arb(v) for v in x]))
    assert decides("rest", (0, 1, 1), held=[0]) and not decides("rest", (0, 0, 1), held=[0])
    assert not decides("rest", (0, 1, 1)) and decides("rest", (3, 0, 1), held=[1]) and not decides("rest", (0, 1, 1), held=[1])
    for order, x, want in ((0, (1, 0, 1), True), (0, (-1, 0, 1), False), (1, (0, 1, 1), True), (1, (0, -1, 1), False),
                           (2, (0, 0, 1), False), (2, (0, 0, -1), True), (0, (0, 1, 1), False)):
        assert decides("free", x, guards=[(0, order)]) == want
    turn = matrix([[1, 0, 0], [0, -1, 0], [0, 0, 1]])
    assert decides("free", (0, -1, 1), guards=[(0, 1)], resets=(turn,))
    assert not decides("free", (0, -1, 1), guards=[(0, 1)], resets=(turn, turn), after=1)
    assert decides("free", (0, -1, 1), guards=[(0, 1)], resets=(turn, turn), after=0)  # the second has not acted yet


def claim(kept, modes, *resets, guards=((1, 0),), holds=()):
    """Return whether states are seen to be kept in a sequence of events with these resets, each into the mode of its number."""
    events = [SimpleNamespace(after=i, guards=guards) for i in range(len(resets))]
    transitions = [SimpleNamespace(event=event, reset=reset) for event, reset in zip(events, resets, strict=True)]
    there = SimpleNamespace(n=1, nx=4, mode=lambda i: SimpleNamespace(B=modes[i], holds=holds))
    return kept_exactly(there, SimpleNamespace(labels=Labels(kept, np.eye(3)[list(kept)]), events=events), transitions)


def test_memory_is_kept_where_neither_a_mode_nor_an_event_writes_it():
    """Of the joined state (q, v, z, 1): the row of z is zero in every mode, and that of the identity in every reset."""
    still = matrix([[0, 1, 0, 0], [-1, 0, 1, 0], [0, 0, 0, 0], [0, 0, 0, 0]])
    same = matrix([[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    assert claim((2,), [still], same) and claim((2,), [still, still], same, same) and claim((), [still], same)
    for rate in ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, -1, 0), (0, 0, 0, (1, 7))):
        moves = matrix([[0, 1, 0, 0], [-1, 0, 1, 0], rate, [0, 0, 0, 0]])
        assert not claim((2,), [moves], same) and not claim((2,), [still, moves], same, same)
    for written in ((1, 0, 0, 0), (1, 0, 1, 0), (0, 0, 2, 0), (0, 0, 0, 0), (0, 0, 1, (1, 10**20))):
        writes = matrix([[1, 0, 0, 0], [0, -1, 0, 0], written, [0, 0, 0, 1]])
        assert not claim((2,), [still], writes) and not claim((2,), [still, still], same, writes)
    assert not claim((1,), [still], same) and not claim((1, 2), [still], same)  # no speed is kept


def test_a_coordinate_is_kept_where_it_is_held_all_the_time():
    """On no surface, which would say where, and not carried along; without an event."""
    still = matrix([[0, 0, 0, 0]] * 4)
    same = matrix([[1, 0, 0, 0], [0, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])

    def hold(slope, surface=None, driven=False):
        return SimpleNamespace(J=row(slope), surface=surface, driven=driven)
    held = {"guards": (), "holds": (hold(2),)}
    assert claim((0,), [still], same, **held) and claim((0, 2), [still], same, **held)
    assert not claim((0,), [still, still], same, same, **held)
    assert not claim((0,), [still], same, guards=((1, 0),), holds=(hold(2),))
    for others in ((), (hold(0),), (hold(2, surface=row(1)),), (hold(2, driven=True),)):
        assert not claim((0,), [still], same, guards=(), holds=others)


def test_all_sliders_that_stick_in_one_instant_remember_where_they_stood():
    """Three in parallel on one mass: each holds its limit where the mass turns, whatever their memory was while they slipped."""
    springs = ((2.0, 0.6), (1.0, 0.2), (0.5, 0.3))
    elements = [bf.elements.HarmonicForce(2.5), *(bf.elements.Jenkins(*spring) for spring in springs)]
    candidate = candidate_of(bf.find_orbit(bf.System(1.0, 0.1, 1.0, elements, omega=0.9)))
    _, transitions = structure(candidate)
    turns = 0
    for event, item in zip(candidate.events, transitions, strict=True):
        if len(event.guards) < 3:
            continue
        turns += 1
        side = 1.0 if event.before[1] == "slip+" else -1.0
        R = np.array([[as_float(item.reset[i, j]) for j in range(item.reset.ncols())] for i in range(item.reset.nrows())])
        behind_it = R @ [0.7 * side, 0.0, 9.0, 9.0, 9.0, 1.0, 0.3, 0.4]
        assert behind_it == pytest.approx([0.7 * side, 0.0, *(side * (0.7 - limit / k) for k, limit in springs), 1.0, 0.3, 0.4])
    assert turns == 2
