"""Branches of the random systems of `test_settled_motions`: every row is a motion, every end is one, from either end the same."""
import numpy as np
import pytest

import bifurc as bf
from studies import branch_audit as audits

from .test_settled_motions import drawn


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
    pytest.param(5025, id="a slider begins to slip both ways, where the equations lose two ranks"),
    pytest.param(5044, id="a slider that slipped until a mass comes to rest, with no restitution and hardly any"),
    pytest.param(5045, id="masses that stick to each other all the time"),
    pytest.param(6008, id="equations that are singular where a step ends on their boundary"),
    pytest.param(7003, id="two slips that are born at once, beside a guard that is zero by itself", marks=pytest.mark.slow),
    pytest.param(7006, id="a last slip that vanishes: rows held by tolerance alone would go on"),
    pytest.param(7017, id="a plastic stop under a full mass matrix"),
    pytest.param(7055, id="memory that is never written keeps its value along a branch"),
    pytest.param(7056, id="memory that a simulated period begins with is stale"),
    pytest.param(9013, id="a boundary that is zero with some power of the way, beside which a flip was noise"),
    pytest.param(9021, id="nothing is left of the speed behind a plastic impact"),
    pytest.param(9030, id="a slider that an impact stopped at its limit"),
    pytest.param(9060, id="events of one instant in one order: a fold of the motion of one period"),
    pytest.param(10041, id="two sliders at their limits, where nothing moves one of them: its guard is zero by itself"),
    pytest.param(10050, id="a stop that comes to where a mass stands"),
    pytest.param(12038, id="a stop that moves what stands on it as far as a slider holds, begun where an impact stopped that"),
    pytest.param(10028, id="a slider that stops just before an impact drives it on: the second time is the square of the first",
                 marks=pytest.mark.slow),
    pytest.param(12025, id="equations that are singular on the boundary where a slip begins: no branch point is beside it"),
    pytest.param(14019, id="half a period whose equations begin a little farther beyond than those of the whole one"),
    pytest.param(8036, id="a fold that is the rounding of the birth of a release"),
])
def test_branches_are_the_same_from_everywhere(seed):
    row = audited(seed)
    assert row.rows > 2 and (row.not_repeated, row.failed, row.ends, row.one_way, row.starts, row.ok) == (0, 0, [], [], [], True)


@pytest.mark.parametrize(("kind", "number"), [
    pytest.param("mixed", 39001, id="zero at the birth of a stick with the square of the way is no boundary"),
    pytest.param("stop_and_friction", 41002, id="a bound on which flights last no time is met before rounding"),
    pytest.param("mixed", 41005, id="a step that begins 2e-8 before a grazing whose contact ends in three events"),
    pytest.param("mixed", 43002, id="a friction that the stick of another one lets slip, with static friction above kinetic"),
    pytest.param("stop_and_slider", 43038, id="a slider that comes back to the stop at its limit begins no slip"),
    pytest.param("mixed", 43027, id="a row beside the birth of two slips, where Newton finds no equations nearer than 1e-3"),
    pytest.param("stop_and_friction", 45017, id="a stick at a reversal beside a train of which one more impact is listed"),
    pytest.param("stop_and_friction", 52024, id="a birth beside which flights rise less than rounding: the way back to it"),
    pytest.param("mixed", 61012, id="a slip born before another stick, beside which its end is rounding"),
    pytest.param("mixed", 60038, id="impacts that overtake a stick one after the other, each of them twice"),
    pytest.param("mixed", 61000, id="a stick that another friction's letting go relieves"),
    pytest.param("mixed", 61009, id="a reversal at the instant in which a slider stops"),
    pytest.param("mixed", 62042, id="a separation that leaps over a rest on the surface of a stop"),
    pytest.param("stop_and_friction", 62045, id="a rest beside a stop, within a step a slip there for a moment"),
    pytest.param("mixed", 62005, id="equations that are valid over less than the length at which they are begun",
                 marks=pytest.mark.slow),
    pytest.param("mixed", 43011, id="a multiplier -1 of half the period beside a birth, where determinants are rounding"),
])
def test_branches_of_the_audited_kinds_are_the_same_from_everywhere(kind, number):
    row = audits.audited(kind, number)
    assert row.rows > 20 and (row.not_repeated, row.failed, row.ends, row.one_way, row.starts, row.ok) == (0, 0, [], [], [], True)
