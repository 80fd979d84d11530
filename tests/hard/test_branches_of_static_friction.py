"""Branches of two masses with friction between them and static friction above kinetic on a floor: which mode is tried first tells.

At a stop several modes may follow: the mass may stick while the other one is let go, or both turn round.  Simulation tries what
sticks first; the equations of a branch must know where that ends them.
"""
import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.kinds import SpecialPointKind
from bifurc.elements import Coulomb, HarmonicForce
from studies import branch_audit as audits
from tests.reference.time_stepping import stepped


def drawn(seed):
    """Return two masses on springs, to the walls and between them, a parameter and bounds: the second mass is driven, the first
    rubs on the floor."""
    rng = np.random.default_rng([seed, 77])
    between = round(rng.uniform(0.2, 0.5), 3)
    floor, static = round(between * rng.uniform(0.5, 1.0), 3), round(rng.uniform(1.1, 1.8), 2)
    k = rng.uniform(0.3, 2.0, 3)
    K = np.array([[k[0] + k[1], -k[1]], [-k[1], k[1] + k[2]]]).round(3)
    elements = [HarmonicForce(round(rng.uniform(0.5, 1.5), 3), dof=1), Coulomb(between, row=(1.0, -1.0)),
                Coulomb(floor, static_ratio=static)]
    system = bf.System(np.diag([round(rng.uniform(0.5, 2.0), 2), 1.0]), (0.05 * K).tolist(), K.tolist(), elements,
                       omega=round(rng.uniform(0.5, 2.8), 3))
    name = ("omega", "coulomb.friction", "coulomb_2.friction", "harmonic_force.amplitude")[rng.integers(4)]
    value = system.parameter(name)
    return system, name, (0.5 * value, 1.5 * value)


@pytest.mark.parametrize("seed", [22, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (2, 11, 35, 38))])
def test_every_row_is_a_motion_and_the_branch_the_same_from_everywhere(seed):
    system, name, bounds = drawn(seed)
    row = audits.Audited("static", seed, name)
    branch = bf.trace(bf.find_orbit(system), name, bounds=bounds, max_steps=audits.MAX_STEPS)
    audits.judge_rows(branch, row)
    row.one_way = audits.one_way(branch, name, bounds)
    row.starts = audits.other_starts(branch, name, bounds, np.random.default_rng(seed))
    assert row.rows > 20 and (row.not_repeated, row.failed, row.one_way, row.starts, branch.audit.ok) == (0, 0, [], [], True)
    assert all(end.reason in audits.PHYSICAL for end in branch.ends)


def test_a_reversal_ends_where_the_floor_could_hold_what_is_left_by_the_friction_between():
    """There the force on the mass that has just stopped, of the springs and of the sliding between the masses, is the static limit;
    before it the masses turn round together, behind it the first one stays for a moment."""
    system, name, bounds = drawn(11)
    branch = bf.trace(bf.find_orbit(system), name, bounds=bounds)
    point = next(point for point in branch.special_points if abs(point.parameter - 0.3215306) < 1e-6)
    assert point.kind is SpecialPointKind.STICK_ONSET
    orbit = branch.orbits[int(np.argmin(np.abs(branch.column("s") - point.s)))]
    motion = bf.simulate(orbit.system, orbit.state, periods=1)
    stop = next(event for event in motion.events if event.element == "coulomb_2" and event.kind == "stick")
    (x1, x2, v1, v2), K = motion(stop.time), np.array(system.stiffness)
    assert abs(v1) + abs(v2) < 1e-9
    pulled = -K[0] @ [x1, x2]  # and the other mass, on which the load acts, slides on
    drives = -K[1] @ [x1, x2] + system.parameter("harmonic_force.amplitude") * np.cos(orbit.system.parameter("omega") * stop.time)
    left = pulled + np.sign(drives) * system.parameter("coulomb.friction")
    assert abs(left) == pytest.approx(1.34 * point.parameter, rel=0, abs=1e-9)
    assert abs(pulled + drives) > 1.34 * point.parameter > abs(left) - 1e-8  # together they are more than it holds


@pytest.mark.parametrize(("kind", "number"), [("mixed", 61000), ("mixed", 61009)])
def test_rows_are_those_of_time_stepping(kind, number):
    """The last row, which nothing but the rule at a stop with static friction decides."""
    system, name, bounds = audits.scene(kind, number)
    orbit = bf.trace(bf.find_orbit(system), name, bounds=bounds, max_steps=audits.MAX_STEPS).orbits[-1]
    start = orbit._states(np.array([0.0]))[0]
    n = len(system.mass)
    apart = [float(np.abs(stepped(orbit.system, start, int(orbit.periods), steps) - start)[:n].max()) for steps in (4000, 64000)]
    assert apart[1] < 5e-6 and apart[1] < 0.2 * apart[0]
