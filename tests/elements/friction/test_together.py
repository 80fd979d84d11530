"""Dry frictions on one row: which rest together and which way round, their common limits, keys that change with each other."""
from types import SimpleNamespace

import pytest

from bifurc.elements import Coulomb, ElasticStop, HarmonicForce, Stribeck
from bifurc.elements.friction import together as rules
from bifurc.elements.friction.dry import SLIP_DOWN, SLIP_UP, STICK

ELEMENTS = (
    HarmonicForce(1.0), Coulomb(0.5, 0.2, row=(1.0, -1.0)), Coulomb(0.3, dof=0),
    Coulomb(0.7, 0.1, static_ratio=2.0, row=(-1.0, 1.0)),
    Stribeck(kinetic=0.2, static=0.6, speed=0.4, row=(1.0, -1.0)),
    ElasticStop(0.4, 2.0, row=(1.0, -1.0)), Coulomb(0.4, dof=0))
ONE, LAM = ("one", 0), ("lam", 0)
TOGETHER = ((0, 1), (1, 1), (2, 1), (1, -1), (1, 1), (5, 1), (2, 1))


def test_the_first_on_a_row_leads_those_that_rest_with_it():
    assert rules.leaders(ELEMENTS, 2) == TOGETHER
    belts = (Coulomb(0.5, belt_speed=0.3, row=(1.0, -1.0)), Coulomb(0.5, belt_speed=-0.3, row=(-1.0, 1.0)),
             Coulomb(0.5, belt_speed=0.3, row=(-1.0, 1.0)), Coulomb(0.5, row=(1.0, -1.0)),
             Coulomb(0.5, belt_speed=0.3, row=(2.0, -2.0)))
    assert rules.leaders(belts, 2) == ((0, 1), (0, -1), (2, 1), (3, 1), (4, 1))  # only surfaces that move alike
    loaded = (Coulomb(0.5, load_amplitude=1.4, load_harmonic=1, load_phase=0.0), Coulomb(0.5), Coulomb(0.2))
    assert rules.leaders(loaded, 1) == ((0, 1), (1, 1), (1, 1))  # a load that vanishes lets go by itself
    loaded = (Coulomb(0.5, load_amplitude=0.4), Coulomb(0.5), Coulomb(0.2, load_amplitude=-0.9))
    assert rules.leaders(loaded, 1) == ((0, 1), (0, 1), (0, 1))


@pytest.mark.parametrize(("first", "second", "ratio"), [
    ((1.0, -1.0), (2.0, -2.0), 2.0), ((1.0, -1.0), (-0.5, 0.5), -0.5), ((0.1, 0.3), (0.3, 0.9), 3.0),
    ((0.1, 0.3), (-1.0 / 30.0, -0.1), -1.0 / 3.0)])
def test_multiples_of_a_row_are_one_row(first, second, ratio):
    """On belts whose speeds have the same ratio; a row that is another by more than rounding, or a belt, is none."""
    one, other = Coulomb(0.5, row=first, belt_speed=0.3), Coulomb(0.2, row=second, belt_speed=0.3 * ratio)
    (_, (leader, found)) = rules.leaders((one, other), 2)
    assert leader == 0 and found == pytest.approx(ratio, rel=1e-15)
    turned = Coulomb(0.2, row=(second[0], second[1] * (1.0 + 1e-14)), belt_speed=0.3 * ratio)
    assert rules.leaders((one, turned), 2) == rules.leaders((one, Coulomb(0.2, row=second, belt_speed=0.31 * ratio)), 2) \
        == ((0, 1), (1, 1))


def test_two_that_drop_are_refused_where_one_separates():
    """What both hold has no rule in the modes of one of them; where the force of one is that of slip they need none."""
    for one, other in ((Coulomb(1.0, static_ratio=1.2, load_amplitude=1.0), Coulomb(1.0, static=1.1)),
                       (Coulomb(1.0, static=2.0), Coulomb(1.0, static=1.1, load_amplitude=-3.0))):
        with pytest.raises(ValueError, match="elements 0 and 1 .Coulomb, Coulomb. are on one row .* load_amplitude below 1"):
            rules.leaders((one, other), 1)
    kept = (Coulomb(1.0, static_ratio=1.2, load_amplitude=1.0), Coulomb(1.0), Stribeck(static=2.0),
            Coulomb(1.0, static=1.1, row=(0, 1)))
    assert rules.leaders(kept, 2) == ((0, 1), (1, 1), (1, 1), (3, 1))


def test_keys_change_together_and_run_with_the_rows():
    for element, key, want in ((1, SLIP_UP, {1: SLIP_UP, 3: SLIP_DOWN, 4: SLIP_UP}),
                               (3, SLIP_UP, {1: SLIP_DOWN, 3: SLIP_UP, 4: SLIP_DOWN}),
                               (4, STICK, {1: STICK, 3: STICK, 4: STICK}), (6, SLIP_DOWN, {2: SLIP_DOWN, 6: SLIP_DOWN}),
                               (0, "always", {0: "always"})):
        assert rules.key_of(ELEMENTS, TOGETHER, element, key) == want


def test_contacts_that_rest_together_may_be_more_but_not_others():
    all_, two, none = ((0, 1), (0, -1), (0, 1)), ((0, 1), (0, -1), (2, 1)), ((0, 1), (1, 1), (2, 1))
    turned, other = ((0, 1), (0, 1), (2, 1)), ((0, 1), (1, 1), (1, -1))
    for one, parts in ((all_, (two, none, other)), (two, (none,)), (none, ()), (other, (none,))):
        for item in (all_, two, none, turned, other):
            assert rules.includes(one, item) is (item in (one, *parts))


def modes(element, key):
    return rules.mode_of(SimpleNamespace(elements=ELEMENTS), TOGETHER, element, key, SimpleNamespace(omega=1.0))


def test_limits_of_stick_are_the_sums_and_others_have_neither_rows_nor_events():
    """The leader takes [-.5, .2] itself, [-.2, 1.4] of the one that runs the other way, [-.6, .6] of the third."""
    stick = modes(1, STICK)
    ((least, most),) = stick.bounds
    assert (least.terms[ONE], most.terms[ONE]) == pytest.approx((-0.5 - 0.2 - 0.6, 0.2 + 1.4 + 0.6))
    up, down = (guard.value for guard in stick.guards)  # they let go where the reaction leaves the sums
    assert up.terms == {LAM: -1.0, ONE: pytest.approx(-1.3)} and down.terms == {LAM: 1.0, ONE: pytest.approx(-2.2)}
    assert len(stick.hold) == 1
    for follower in (3, 4):
        own = modes(follower, STICK)
        assert own.hold == () and own.guards == () and own.bounds == ()
    slip = modes(3, SLIP_UP)
    assert slip.guards == () and slip.force == ELEMENTS[3].mode(SLIP_UP, None).force
    assert modes(1, SLIP_UP) == ELEMENTS[1].mode(SLIP_UP, None)  # the leader has the events of slip
    alone = rules.mode_of(SimpleNamespace(elements=ELEMENTS[:2]), TOGETHER[:2], 1, STICK, None)
    assert alone == ELEMENTS[1].mode(STICK, None)
