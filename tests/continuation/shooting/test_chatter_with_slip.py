"""Branches of two masses coupled by inertia: in every impact of a complete chattering the mass that friction holds slips."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.shooting.completion import begun_at
from bifurc.continuation.shooting.train_length import longer, shorter
from bifurc.continuation.tracing import problem_of
from bifurc.elements import Coulomb, HarmonicForce, RigidStop
from bifurc.orbits.shooting.sequence import CLOSES
from studies import branch_audit

LOAD, GAP = 2.1, 0.12


def masses(friction=0.8, omega=0.55, restitution=0.3):
    """Two masses with full matrices; the first hits a stop, the second rubs."""
    return bf.System([[1.0, 0.25], [0.25, 1.44]], [[0.11, -0.019], [-0.019, 0.11]], [[1.38, -0.38], [-0.38, 1.38]],
                     [HarmonicForce(LOAD), RigidStop(gap=GAP, restitution=restitution), Coulomb(friction, dof=1)], omega=omega)


def check(orbit):
    """Check the releases from the stop while friction holds the other mass, LOAD cos(omega t) = k11 GAP + k12 q2; return their
    number."""
    assert orbit.success
    releases = [event for event in orbit.events if event.kind == "release" and abs(event.before[3]) < 1e-15]
    for event in releases:
        force = LOAD * np.cos(orbit.system.omega * event.time) - 1.38 * GAP + 0.38 * event.before[1]
        assert abs(force) < 1e-12
    return len(releases)


@pytest.mark.parametrize("friction", [0.4, 0.8, 1.2])
@pytest.mark.parametrize("restitution", [0.3, 0.6, 0.8])
def test_settled_motions_are_found(friction, restitution):
    assert check(bf.find_orbit(masses(friction, 0.4, restitution))) == 1


def test_a_branch_over_friction_passes_from_slips_that_stick_to_slips_that_last():
    """With less friction the slips last longer than flights, first in the last impacts: the number of sticks falls one by one,
    in a sequence that accumulates where the first-order ratio says so."""
    branch = bf.trace(bf.find_orbit(masses()), "coulomb.friction", bounds=(0.3, 1.3))
    assert branch.audit.ok and [end.reason for end in branch.ends] == ["bound", "bound"]
    assert [check(orbit) for orbit in branch.orbits if orbit.system.parameter("coulomb.friction") > 0.75].count(1) > 10
    assert all(orbit.success for orbit in branch.orbits)
    last = [point.parameter for point in branch.special_points.of("stick_onset") if point.parameter > 0.77]
    falls = np.diff(last)
    assert len(last) >= 5 and np.all(falls > 0.0)
    ratios = falls[1:] / falls[:-1]
    assert ratios[-2:] == pytest.approx(0.3, abs=0.01)  # r, where a slip lasts a flight


@pytest.mark.parametrize(("system", "parameter", "bounds"), [
    (masses(0.8, 0.4, 0.6), "omega", (0.38, 0.44)), (masses(1.2, 0.4, 0.3), "rigid_stop.restitution", (0.2, 0.6))])
def test_branches_reach_their_bounds(system, parameter, bounds):
    branch = bf.trace(bf.find_orbit(system), parameter, bounds=bounds)
    assert branch.audit.ok and [end.reason for end in branch.ends] == ["bound", "bound"]
    assert all(check(orbit) for orbit in branch.orbits)


def test_impacts_are_added_and_left_out_with_the_slips_between_them():
    """The closed form stands for what is no longer listed, and speeds fall by its ratio from impact to impact."""
    problem = problem_of(bf.find_orbit(masses(0.8, 0.4, 0.6)), "omega", (0.39, 0.41))
    c = problem.correct(problem.x0, np.eye(1, problem.x0.size, problem.x0.size - 1)[0], True)
    i = int(np.flatnonzero(problem.sequence.nodes[:, CLOSES] == 1)[0])
    at, x = begun_at(problem, c.x, i + 1)
    closes = at._excess(at.sequence.nodes[-1], x[:-1].reshape(len(at.sequence.nodes), -1)[-1])
    for change, impacts in ((longer, 2), (shorter, -2)):
        new, guess = change(at, x, 2)
        assert len(new.sequence.nodes) == len(at.sequence.nodes) + 2 * impacts
        found = new.correct(guess, np.eye(1, guess.size, guess.size - 1)[0], True)
        assert found.converged
        nodes, rows = new.sequence.nodes, found.x[:-1].reshape(len(new.sequence.nodes), -1)
        assert np.all(np.diff(rows[:, 0]) > 0.0)
        assert np.abs(found.x[:-1] - guess[:-1]).max() < 1e-8
        first = min(len(rows), len(at.sequence.nodes)) - 1 - 2 * (impacts < 0)
        np.testing.assert_allclose(rows[:first], x[:-1].reshape(len(at.sequence.nodes), -1)[:first], rtol=0, atol=1e-12)
        speeds = [new.arriving(nodes[k], rows[k]) for k in (-3, -1)]
        assert new._excess(nodes[-1], rows[-1]) == pytest.approx(closes * (speeds[1] / speeds[0])**impacts, rel=1e-3)


# Flights in closed form, impact by impact, with 90 digits: the restitution above which some impact of the train is the last one,
# because the push falls to friction in the flight behind it.  That flight is the 9th at .36213653027, the 12th at .362136489228.
COMPLETES_AT = 0.362136489226832


@pytest.mark.slow
def test_a_mass_whose_own_friction_turns_in_every_flight_completes_where_closed_forms_say():
    """The push no longer overcomes friction on the way back: no ratio of times is that of the boundary, and what is extrapolated
    with one is none.  How far it is known depends on how many impacts are listed: the bound says it, from every row."""
    system, name, bounds = branch_audit.scene("stop_and_friction", 53010)
    branch = bf.trace(bf.find_orbit(system), name, bounds=bounds)
    for other in (branch, *(bf.trace(branch.orbits[row], name, bounds=bounds) for row in (5, 20, 44, 60))):
        assert other.stop_reason == branch.stop_reason and other.column(name)[-1] == pytest.approx(COMPLETES_AT, abs=3e-7)
        for point in other.special_points:
            assert point.kind == "chatter_completion" and abs(point.parameter - COMPLETES_AT) <= point.error < 5e-7
    [point] = branch.special_points
    assert point.error < 5e-9


def test_a_branch_does_not_turn_back_where_flights_become_rounding():
    """Impacts are born on the way to the completion, and the times left to it fall to their power 4/3 where friction of the mass
    itself turns in every flight; beside the last birth flights rise less than rounding, and the way back to it is not ahead."""
    system, name, bounds = branch_audit.scene("stop_and_friction", 52024)
    branch = bf.trace(bf.find_orbit(system), name, bounds=bounds)
    assert branch.audit.ok and branch.stop_reason == ("chattering", "bound")
    limit = float(branch.column(name)[0])
    found = [point.parameter for point in branch.special_points]
    assert min(abs(a - b) for k, a in enumerate(found) for b in found[:k]) > 1e-9  # no point is met twice
    births = np.array([point.parameter for point in branch.special_points.of("grazing")])
    births = births[(births - limit > 1e-8) & (births < 0.92)]
    falls = np.diff(np.log(births - limit))
    assert len(births) == 4 and falls[:-1] / falls[1:] == pytest.approx([4.0 / 3.0, 4.0 / 3.0], rel=0.08)
    for value, completes in ((limit - 1e-7, True), (limit + 1e-7, False)):
        motion = bf.simulate(system.with_parameters(**{name: value}), branch.orbits[0].state, periods=8)
        assert any(event.kind == "chatter" for event in motion.events) == completes
