"""Branches of the random systems of `test_settled_motions`: every row is a motion, every end is one, from either end the same."""
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import fsolve

import bifurc as bf
from studies import branch_audit as audits
from tests.continuation.shooting.test_flat_boundaries import rounded_otherwise

from .test_settled_motions import drawn


def slow(*scene, id):
    """Return a scene for the slow suite: the default one keeps those that are done in a second or two."""
    return pytest.param(*scene, id=id, marks=pytest.mark.slow)


def audited(seed):
    """Return what the study `branch_audit` says of one branch."""
    system = drawn(seed)
    name, bounds = audits.parameter_of(np.random.default_rng([seed, 31]), system)
    row = audits.Audited("wide", seed, name)
    branch = bf.trace(bf.find_orbit(system), name, bounds=bounds, max_steps=audits.MAX_STEPS)
    audits.judge_rows(branch, row)
    row.ends = [repr(end) for end in branch.ends if end.reason not in audits.PHYSICAL]
    row.ok = branch.audit.ok
    row.one_way = audits.one_way(branch, name, bounds)
    row.starts = audits.other_starts(branch, name, bounds, np.random.default_rng(seed))
    return row


@pytest.mark.parametrize("seed", [
    slow(5025, id="a slider begins to slip both ways, where the equations lose two ranks"),
    pytest.param(5044, id="a slider that slipped until a mass comes to rest, with no restitution and hardly any"),
    slow(5045, id="masses that stick to each other all the time"),
    slow(6008, id="equations that are singular where a step ends on their boundary"),
    slow(7003, id="two slips that are born at once, beside a guard that is zero by itself"),
    slow(7006, id="a last slip that vanishes: rows held by tolerance alone would go on"),
    pytest.param(7017, id="a plastic stop under a full mass matrix"),
    slow(7055, id="memory that is never written keeps its value along a branch"),
    slow(7056, id="memory that a simulated period begins with is stale"),
    pytest.param(9013, id="a boundary that is zero with some power of the way, beside which a flip was noise"),
    slow(9021, id="nothing is left of the speed behind a plastic impact"),
    slow(9030, id="a slider that an impact stopped at its limit"),
    pytest.param(9060, id="events of one instant in one order: a fold of the motion of one period"),
    slow(10041, id="two sliders at their limits, where nothing moves one of them: its guard is zero by itself"),
    slow(10050, id="a stop that comes to where a mass stands"),
    slow(12038, id="a stop that moves what stands on it as far as a slider holds, begun where an impact stopped that"),
    slow(10028, id="a slider that stops just before an impact drives it on: the second time is the square of the first"),
    slow(12025, id="equations that are singular on the boundary where a slip begins: no branch point is beside it"),
    slow(14019, id="half a period whose equations begin a little farther beyond than those of the whole one"),
    pytest.param(8036, id="a fold that is the rounding of the birth of a release"),
])
def test_branches_are_the_same_from_everywhere(seed):
    row = audited(seed)
    assert row.rows > 1 and (row.not_repeated, row.failed, row.ends, row.one_way, row.starts, row.ok) == (0, 0, [], [], [], True)


@pytest.mark.slow
def test_half_a_period_is_followed_however_states_are_rounded(monkeypatch):
    """Where rounding puts the beginning of its equations beyond that of the same motions listed over the whole period."""
    system = drawn(14019)
    name, bounds = audits.parameter_of(np.random.default_rng([14019, 31]), system)
    branch = bf.trace(bf.find_orbit(system), name, bounds=bounds, max_steps=audits.MAX_STEPS)
    for _ in rounded_otherwise(monkeypatch, 8):
        other = audits.back_from(branch, 0, name, bounds)
        assert audits.differences(branch, other, bounds, 0) == []
        assert [end.p for end in other.ends] == [end.p for end in branch.ends]


@pytest.mark.parametrize(("kind", "number"), [
    slow("mixed", 39001, id="zero at the birth of a stick with the square of the way is no boundary"),
    slow("stop_and_friction", 41002, id="a bound on which flights last no time is met before rounding"),
    slow("mixed", 41005, id="a step that begins 2e-8 before a grazing whose contact ends in three events"),
    slow("mixed", 43002, id="a friction that the stick of another one lets slip, with static friction above kinetic"),
    pytest.param("stop_and_slider", 43038, id="a slider that comes back to the stop at its limit begins no slip"),
    slow("mixed", 43027, id="a row beside the birth of two slips, where Newton finds no equations nearer than 1e-3"),
    slow("stop_and_friction", 45017, id="a stick at a reversal beside a train of which one more impact is listed"),
    slow("stop_and_friction", 52024, id="a birth beside which flights rise less than rounding: the way back to it"),
    slow("mixed", 61012, id="a slip born before another stick, beside which its end is rounding"),
    slow("mixed", 60038, id="impacts that overtake a stick one after the other, each of them twice"),
    pytest.param("between_masses", 62026, id="one row beside the birth of an impact: its tangent is rounding"),
    pytest.param("mixed", 61000, id="a stick that another friction's letting go relieves"),
    slow("mixed", 61009, id="a reversal at the instant in which a slider stops"),
    slow("stop_and_friction", 62045, id="a rest beside a stop, within a step a slip there for a moment"),
    slow("two_masses", 70006, id="both slips of a mass that stands: steps end 5e-6 before the place that is left to it"),
    pytest.param("stop_and_friction", 62030, id="a sequence valid over 3e-9 of the parameter and 2e-3 of the way, its fold inside"),
    pytest.param("mixed", 62005, id="equations that are valid over less than the length at which they are begun",
                 marks=pytest.mark.slow),
    slow("mixed", 70018, id="a guard that is zero by itself is no beginning where the way from there was begun"),
    slow("mixed", 70013, id="a start that rounding leaves outside of the boundary on which it lies"),
    pytest.param("mixed", 43011, id="a multiplier -1 of half the period beside a birth, where determinants are rounding"),
])
def test_branches_of_the_audited_kinds_are_the_same_from_everywhere(kind, number):
    row = audits.audited(kind, number)
    assert row.rows > 20 and (row.not_repeated, row.failed, row.ends, row.one_way, row.starts, row.ok) == (0, 0, [], [], [], True)


def traced_with_others(kind, number, rows):
    """Return the branch of a scene, and those from some of its rows."""
    system, name, bounds = audits.scene(kind, number)
    branch = bf.trace(bf.find_orbit(system), name, bounds=bounds, max_steps=audits.MAX_STEPS)
    return branch, [bf.trace(branch.orbits[k], name, bounds=bounds, max_steps=2 * audits.MAX_STEPS) for k in rows]


@pytest.mark.slow
def test_folds_beside_grazings_are_found_until_rounding_from_both_ends():
    """Impacts of a chattering appear one after the other: what happens there repeats itself in ever smaller size.  The parameter of
    a fold and that of its grazing differ by a part that falls geometrically, and errors that both share say nothing of it."""
    branch, others = traced_with_others("between_masses", 70017, (-3,))
    for other in (branch, *others):
        points = [point for point in other.special_points if point.kind in ("grazing", "fold") and point.parameter > 0.6692]
        apart = [abs(one.parameter - two.parameter) for one, two in pairwise(sorted(points, key=lambda point: abs(point.s)))
                 if one.kind != two.kind and abs(one.s - two.s) < 2e-6]
        apart = sorted(apart)[-8:]
        assert len(apart) == 8 and apart[0] < 5e-13
        assert np.allclose(np.divide(apart[:-1], apart[1:]), 0.46, atol=0.03)
    assert not audits.differences(branch, others[0], (0.3085, 0.9255), -1)


# of the scene `two_masses` 61034: frequency, damping, stiffness, spring and dashpot between the masses, gap, restitution, friction
OMEGA, DAMPING, SPRING, JOINT, DASHPOT, ROOM, BOUNCE, HOLDING = 0.538, 0.168, 2.8, 1.8, 0.108, 0.1, 0.786, 0.192


def limits_of_standing(unknowns):
    """Return what is zero where the second mass begins to slip both ways: it stands at ``y``, the first is an oscillator with two
    impacts a period, of which the motion is known.  What it pulls has its least value at ``t`` between the two, and its greatest
    just before the second."""
    amplitude, y, first, v1, second, v2, t = unknowns
    wave = amplitude / (SPRING - OMEGA**2 + 1j * DAMPING * OMEGA)
    free = complex(-0.5 * DAMPING, np.sqrt(SPRING - 0.25 * DAMPING**2))

    def behind(begin, speed):
        swing = ROOM - JOINT * y / SPRING - (wave * np.exp(1j * OMEGA * begin)).real
        leaves = -BOUNCE * speed - (1j * OMEGA * wave * np.exp(1j * OMEGA * begin)).real
        size = complex(swing, (swing * free.real - leaves) / free.imag)

        def moved(t, order):
            rates = (1j * OMEGA)**order * wave * np.exp(1j * OMEGA * t) + free**order * size * np.exp(free * (t - begin))
            return rates.real + (JOINT * y / SPRING if order == 0 else 0.0)
        return moved
    one, two, end = behind(first, v1), behind(second, v2), first + 2.0 * np.pi / OMEGA

    def pull(t, order):
        return JOINT * one(t, order) + DASHPOT * one(t, order + 1) - (SPRING * y if order == 0 else 0.0)
    return [one(second, 0) - ROOM, one(second, 1) - v2, two(end, 0) - ROOM, two(end, 1) - v1,
            pull(second, 0) - HOLDING, pull(t, 0) + HOLDING, pull(t, 1)]


@pytest.mark.slow
def test_slips_both_ways_are_born_at_one_place_from_either_side():
    """One is born at an instant of greatest pull and lasts as the power 3/4 of the distance, the other before an impact."""
    onset = fsolve(limits_of_standing, [0.2963, -0.0035, 0.98, 0.0083, 10.92, 0.0203, 6.19], xtol=1e-14)[0]
    branch, others = traced_with_others("two_masses", 61034, (2, 60, 120, 184))
    for other in (branch, *others):
        assert [end.reason.value for end in other.ends] == ["bound", "bound"] and other.audit.ok
        point = min(other.special_points.of("slip_onset"), key=lambda point: abs(point.parameter - onset))
        assert abs(point.parameter - onset) <= point.error + 1e-14 and point.error < 1e-9
        assert not audits.differences(branch, other, (0.288, 0.864), 0)


@pytest.mark.slow
def test_an_event_that_meets_the_end_of_a_chattering_is_known_to_what_is_not_listed():
    """A stick is overtaken by one impact after the other: where, falls to the end of them by the restitution."""
    branch, others = traced_with_others("mixed", 60038, (2,))
    far = [point.parameter for point in branch.special_points if 0.17602650 < point.parameter < 0.1763][::2]
    for other in (branch, *others):
        values = [point.parameter for point in other.special_points if 0.1760 < point.parameter < 0.1790]
        assert len(values) > 5 and len(far) >= 3
        a, b, c = far[0], far[1], far[2]
        limit = a - (b - a)**2 / (c - 2.0 * b + a)
        meets = min(other.special_points, key=lambda point: abs(point.parameter - limit))
        assert abs(meets.parameter - limit) <= meets.error < 1e-5


EXACT = 0.45995676454  # +- 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("rows", [(2, 103, 105), (-3,)])
def test_the_last_change_before_an_accumulation_is_within_its_stated_error(rows):
    """Period map of the mass in closed form from event to event, with 30 digits: its events are one more below this gap."""
    branch, others = traced_with_others("stop_and_friction", 61016, rows)
    for other in (branch, *others):
        point = min(other.special_points, key=lambda point: abs(point.parameter - EXACT))  # one branch finds a further one
        assert abs(point.parameter - EXACT) <= point.error < 1e-7  # so near to the accumulation numbers move it by 6e5 times theirs
        assert min(end.p for end in other.ends) > EXACT - 1e-7 and other.audit.ok
