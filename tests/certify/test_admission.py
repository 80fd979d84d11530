"""What a proof must not let pass: events that are left, of no speed or out of order, guards that are passed, false sequences."""
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc.certify.arithmetic.balls import Rationals, working
from bifurc.certify.arithmetic.forms import Reach
from bifurc.certify.arithmetic.jets import Jet
from bifurc.certify.candidate import Event, candidate_of
from bifurc.certify.events import transition
from bifurc.certify.model import Model
from bifurc.certify.orbit import admit, prepare, solve
from bifurc.certify.parameter import tube
from bifurc.elements import Coulomb, HarmonicForce, Jenkins, RigidStop

flint = pytest.importorskip("flint")
arb, mat = flint.arb, flint.arb_mat


@pytest.fixture(autouse=True)
def bits():
    with working(96):
        yield


@pytest.fixture(scope="module")
def proved():
    """Return model and proof of a motion with two impacts, one at each of two stops."""
    with working(96):
        system = bf.System(1.0, 0.3, 1.0, (HarmonicForce(2.0), RigidStop(0.5, 0.6), RigidStop(0.7, 0.5, side=-1)), omega=2.0)
        orbit = bf.find_orbit(system)
        assert orbit.success and {event.element for event in orbit.events} == {"rigid_stop", "rigid_stop_2"}
        prepared = prepare(candidate_of(orbit))
        proof, why, _ = solve(prepared)
        assert proof is not None, why
        return prepared.model, proof


def with_guard(proof, place, factor):
    G = list(proof.pieces.G)
    G[place] = Jet(G[place].value * arb(factor))
    return proof._replace(pieces=proof.pieces._replace(G=G))


def with_span(proof, place, value):
    span = list(proof.solved.span)
    span[place] = Jet(value)
    return proof._replace(solved=proof.solved._replace(span=span))


def with_transition(proof, place, **changes):
    items = list(proof.transitions)
    items[place] = SimpleNamespace(**{**vars(items[place]), **changes})
    return proof._replace(transitions=items)


def test_a_motion_is_admitted_with_the_least_speed_and_every_speed(proved):
    model, proof = proved
    found = admit(model, proof)
    speeds = [float(speed.mid()) for speed in found.speeds]
    omega = 2.0
    orbit = bf.find_orbit(proof.candidate.system)
    assert found.verdict is True and len(speeds) == len(proof.transitions)
    assert sorted(s * omega for s in speeds) == pytest.approx(sorted(event.speed for event in orbit.events), rel=1e-9)
    assert found.speed == pytest.approx(min(speeds), rel=1e-6) and found.speed <= min(speeds)
    assert 0.0 < found.distance


@pytest.mark.parametrize("place", [0, 1])
def test_an_event_that_is_left_or_of_no_speed_is_none(proved, place):
    model, proof = proved
    left = admit(model, with_guard(proof, place, -1))
    assert left.verdict is False and f"event {place} " in left.message and "left, not reached" in left.message
    still = admit(model, with_guard(proof, place, 0))
    assert still.verdict is None and "may be a graze" in still.message
    some = admit(model, with_guard(proof, place, arb(0.5, 0.6)))
    assert some.verdict is None and "may be a graze" in some.message


@pytest.mark.parametrize("place", [0, 1])
def test_events_are_in_the_order_of_time(proved, place):
    model, proof = proved
    back = admit(model, with_span(proof, place, arb(-1, 0.5)))
    assert back.verdict is False and f"event {place + 1} comes before event {place}" in back.message
    none = admit(model, with_span(proof, place, arb(0, 0.1)))
    assert none.verdict is None and "encloses zero" in none.message


def test_a_mode_that_is_tried_first_must_be_ruled_out(proved):
    model, proof = proved
    for decides, verdict in ((True, True), (False, None)):
        rule = SimpleNamespace(key="stick", decides=lambda model, resets, x, decides=decides: decides)
        found = admit(model, with_transition(proof, 1, rules=[SimpleNamespace(key="a", decides=lambda *a: True), rule]))
        assert found.verdict is verdict and ("'stick', tried first" in found.message) == (verdict is None)


def test_a_zero_at_the_start_or_end_counts_only_where_the_event_explains_it(proved):
    model, proof = proved
    count = len(proof.transitions)
    for place in range(count):
        unexplained = with_transition(proof, (place + 1) % count, ending=frozenset())
        assert admit(model, unexplained).verdict is not True
        orders = tuple(0 for _ in proof.transitions[place].orders)
        assert admit(model, with_transition(proof, place, orders=orders)).verdict is not True


def test_a_guard_that_the_motion_passes_is_named(proved):
    """Of the same stops with smaller gaps, which the motion goes through."""
    model, proof = proved

    def narrower(keys):
        mode, guards = model.mode(keys), []
        for guard in mode.guards:
            row = list(guard.row)
            row[model.ns] = row[model.ns] * flint.fmpq(4, 5)  # the gap, of opposite sign
            guards.append(SimpleNamespace(element=guard.element, number=guard.number, guard=guard.guard, row=row))
        return SimpleNamespace(guards=guards, holds=mode.holds, B=mode.B)
    changed = SimpleNamespace(mode=narrower, guard=model.guard, reset=model.reset)
    count = len(proof.transitions)
    for place in range(count):
        proof = with_transition(proof, place, orders=tuple(0 for _ in proof.transitions[place].orders), ending=frozenset())
    found = admit(changed, proof)
    assert found.verdict is False and "without noticing it" in found.message


# events as they are claimed

def judged(elements, before, after, guards, middle=()):
    """Return what is found wrong with an event, decided exactly."""
    system = bf.System(1.0, 0.1, 1.0, (HarmonicForce(1.0), *elements), omega=1.3)
    event = Event(("always", *before), ("always", *after), guards, tuple(("always", *keys) for keys in middle))
    candidate = SimpleNamespace(system=system)
    places = [(e, key) for keys in (event.before, event.after, *event.middle) for e, key in enumerate(keys)]
    more = [(e, key) for e, element in enumerate(system.elements) if not isinstance(element, HarmonicForce)
            for key in (("free", "rest") if isinstance(element, RigidStop) else ("stick", "slip+", "slip-"))]
    return transition(Model(system, Rationals(), list(dict.fromkeys([*places, *more]))), candidate, event)


def test_what_is_held_behind_an_event_is_at_rest_there_by_it():
    bounce = judged((RigidStop(0.5, 0.7),), ("free",), ("free",), ((1, 0),))
    assert bounce.breaks == ""
    rebound = judged((RigidStop(0.5, 0.7),), ("free",), ("rest",), ((1, 0),))
    assert "held behind an event that does not bring it to rest" in rebound.breaks
    assert judged((RigidStop(0.5, 0.0),), ("free",), ("rest",), ((1, 0),)).breaks == ""
    two = (RigidStop(0.5, 0.0), RigidStop(0.6, 0.0))  # at rest, but not on the surface of the second
    assert "'rigid_stop_2' is held" in judged(two, ("free", "free"), ("free", "rest"), ((1, 0),)).breaks
    end = judged((Coulomb(0.3),), ("slip+",), ("stick",), ((1, 0),))
    assert end.breaks == "" and end.rules == []  # stick is the first that is tried
    other = judged((RigidStop(0.5, 0.7), Coulomb(0.3)), ("free", "slip+"), ("free", "stick"), ((1, 0),))
    assert "does not bring it to rest" in other.breaks


def test_events_of_several_elements_coincide_by_their_rows():
    both = (Jenkins(2.0, 0.4), Jenkins(3.0, 0.7))
    turned = judged(both, ("slip+", "slip+"), ("stick", "stick"), ((1, 0), (2, 0)), (("stick", "slip+"),))
    assert turned.breaks == ""
    apart = judged((Jenkins(2.0, 0.4), Jenkins(3.0, 0.7)), ("slip+", "stick"), ("stick", "slip+"), ((1, 0), (2, 0)),
                   (("stick", "stick"),))
    assert "do not coincide identically" in apart.breaks
    silent = judged(both, ("slip+", "slip+"), ("stick", "stick"), ((1, 0),))
    assert "'jenkins_2' leaves a mode with memory to write" in silent.breaks


def test_a_reversal_is_judged_against_stick():
    turn = judged((Coulomb(0.3),), ("slip+",), ("slip-",), ((1, 0),))
    assert {rule.key for rule in turn.rules} == {"stick"} and turn.rules[0].keys == ("always", "stick")
    assert turn.rules[0].held == [] and [order for _, order in turn.rules[0].guards] == [0, 0]  # its force is what decides


@pytest.mark.parametrize("dets, apart", [((1.0, 1.0), True), ((2.0, 0.5), True), ((1.5, 2.0), True), ((4.0, 1.0), True),
                                         ((2.0, 2.718281828459045 / 2.0), False)])
def test_two_multipliers_are_no_pair_on_the_circle_where_their_product_is_not_one(dets, apart, monkeypatch):
    """Flights of damping .5 over 1.2 and .8 shrink areas by e^-1 in all; events change them by their determinants."""
    S = [mat(2, 2, [d, 0.0, 7.0, 1.0]) for d in dets]
    monkeypatch.setattr(tube, "saltations", lambda pieces, solved: S)

    def jet(value):
        return SimpleNamespace(parts=[value])
    pieces = SimpleNamespace(kept=(), ns=2, B=[jet(mat(2, 2, [0.0, 1.0, -1.0, -0.5])) for _ in S])
    made = SimpleNamespace(pieces=pieces, solved=SimpleNamespace(span=[jet(arb(1.2, 1e-12)), jet(arb(0.8, 1e-12))]))
    said = tube.Tube.torusless(made)
    assert said == ("" if apart else "a pair of multipliers may lie on the unit circle")
    monkeypatch.setattr(tube, "saltations", lambda pieces, solved: None)
    assert tube.Tube.torusless(made) == "an event arrives with no speed"
    pieces.kept = (1,)
    assert tube.Tube.torusless(made) == ""  # one multiplier is no pair


@pytest.mark.parametrize("one, said", [(-0.4, ""), (-0.55, "a fold or branch point is near"), (0.55, "")])
def test_the_parameter_moves_along_a_piece_where_its_rate_is_not_zero_with_all_that_is_left_out(one, said):
    """The rate is 1 + one, and of the geometric series that follows, of ratio .5, no more than the size of ``one`` is left."""
    class Times:
        def __mul__(self, first):
            return SimpleNamespace(value=mat(2, 1, [0.0, one]))
    half = mat(2, 2, [0.5, 0.0, 0.0, 0.5])
    made = SimpleNamespace(N=2, Y=mat(2, 2, [1.0, 0.0, 0.0, 1.0]), path=SimpleNamespace(scale=[3.0, 1.0]), C=Times(), over=half)
    made.norm = lambda C: tube.Tube.norm(made, C)
    assert made.norm(mat(2, 2, [0.1, 0.6, 0.0, 0.5])) == pytest.approx(0.5) and made.norm(half) == pytest.approx(0.5)
    assert tube.Tube.regular(made) == said
    made.over = mat(2, 2, [1.0, 0.0, 0.0, 0.2])
    assert tube.Tube.regular(made) == "a fold or branch point is near"


@pytest.mark.parametrize("closure", [1, -1])
@pytest.mark.parametrize("kept", [(), (0,)])
@pytest.mark.parametrize("rows, single", [
    (lambda c: [[1.0, 0.0], [3.0, -2.0 * c]], True), (lambda c: [[0.0, 1.0], [1.4, 0.3]], True),
    (lambda c: [[1.0, 0.0], [3.0, -c]], False), (lambda c: [[0.0, 1.0], [-1.4, 0.3]], False)])
def test_a_multiplier_minus_one_makes_the_matrix_of_the_sequence_singular(rows, single, closure, kept):
    """One event (phase, state): the closing entry -c becomes c, and its rate .7 changes sign."""
    class Times:
        def __mul__(self, end):
            return SimpleNamespace(parts=[mat(1, 1, [0.7])])
    made = SimpleNamespace(N=3, path=SimpleNamespace(length=1, scale=np.ones(3)), coarse=Reach(1e-6, 1),
                           solved=SimpleNamespace(end=[None]),
                           pieces=SimpleNamespace(ns=1, B=[Times()], kept=kept, closure=closure),
                           J=[[*(arb(v) for v in row), arb(9)] for row in rows(closure)])
    made.norm = lambda C: tube.Tube.norm(made, C)
    if kept:  # a state that nothing changes has no multiplier: the matrix is as it is
        single = False
    assert tube.Tube.flipless(made) == ("a period doubling is near" if single else "")
