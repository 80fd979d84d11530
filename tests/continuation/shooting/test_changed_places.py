"""Events that change places along a branch, and starts whose listed sequence is not the one that branches list."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.shooting import signature_change
from bifurc.continuation.shooting.completion import begun_at
from bifurc.continuation.shooting.train_length import longer
from bifurc.elements import Coulomb, ElasticStop, HarmonicForce, Jenkins, RigidStop
from bifurc.orbits.shooting.sequence import CLOSES
from tests.reference.time_stepping import stepped


def points(branch):
    return sorted((p.kind.value, round(p.parameter, 9)) for p in branch.special_points)


def slider_between_stops(amplitude=0.539):
    """Two masses that strike each other; an elastic slider holds the second."""
    between = (-1.0, 1.0)
    return bf.System([[1.2165, -0.0212], [-0.0212, 1.2349]], [[0.1009, -0.0404], [-0.0404, 0.089]],
                     [[2.0482, -1.2892], [-1.2892, 1.6432]], [
        HarmonicForce(amplitude, dof=1), Jenkins(1.53, 0.18, dof=1), RigidStop(0.17, 0.095, row=between),
        RigidStop(0.34, 0.095, side=-1, row=between)], omega=0.455)


def test_an_impact_overtakes_a_stick():
    """The slider sticks where the second mass stops, before an impact or with it: at the change the speed before that impact is
    zero in simulations, to both sides linear in the amplitude.  The guard of the stick, zero where it begins, told of it with the
    square of the time between them: the place was known to 5e-6, and from above no branch went on."""
    bounds = (0.7, 0.8085)
    starts = [bf.find_orbit(slider_between_stops(amplitude)) for amplitude in (0.75, 0.805)]
    branches = [bf.trace(start, "amplitude", bounds=bounds, max_steps=250) for start in starts]
    assert all(branch.audit.ok and branch.stop_reason == ("bound", "bound") for branch in branches)
    assert points(branches[0]) == points(branches[1])
    (change,) = [p for p in branches[0].special_points if p.parameter > 0.79]
    assert change.kind == "stick_onset" and change.error < 1e-12

    def speed(amplitude):
        system = slider_between_stops(amplitude)
        motion = bf.simulate(system, bf.find_orbit(system).state, periods=300)
        motion = bf.simulate(system, motion.final, periods=1)
        return next(event.before[3] for event in motion.events[::-1] if event.element == "rigid_stop_2")

    place, way = change.parameter, 1e-4
    assert abs(speed(place + 1e-9)) < 1e-8 and speed(place - way) > 1e-4 and speed(place + way) < -1e-4


def test_beside_an_onset_of_slip_rounding_is_no_branch_point():
    """Two of three masses rest against each other; the third is excited.  They slip beyond the amplitude at which the reaction of
    the locked masses is the friction.  Beside it a slip is so short that the determinant of the half period is rounding."""
    M = np.diag([1.6663, 0.8626, 1.1258])
    C = np.array([[0.3431, -0.119, 0.0], [-0.119, 0.353, -0.2012], [0.0, -0.2012, 0.4362]])
    K = np.array([[2.3865, -1.0154, 0.0], [-1.0154, 2.7323, -1.717], [0.0, -1.717, 3.3569]])
    w, mu = 1.16, 0.206
    locked = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 0.0]])
    Z = K - w**2 * M + 1j * w * C
    q = locked @ np.linalg.solve(locked.T @ Z @ locked, locked.T @ [0.0, 1.0, 0.0])
    onset = mu / abs((Z @ q)[0])
    system = bf.System(M, C, K, [HarmonicForce(0.488, dof=1), Coulomb(mu, row=(-1.0, 0.0, 1.0))], omega=w)
    branch = bf.trace(bf.find_orbit(system), "amplitude", bounds=(0.244, 0.732))
    for row in np.flatnonzero(branch.column("harmonic_force.amplitude") > onset + 1e-3)[::2]:
        other = bf.trace(branch.orbits[row], "amplitude", bounds=(0.244, 0.732))
        (point,) = other.special_points
        assert point.kind == "slip_onset" and abs(point.parameter - onset) < 1e-12


def test_a_start_that_lists_an_impact_too_many_is_traced_both_ways():
    """Of a complete chattering one listed impact less is as good: other equations go on from such a start at once, also towards
    smaller restitution, where branches ended at the start."""
    apart = (0.0, 1.0, -1.0)
    system = bf.System([[1.2458, -0.0539, -0.0118], [-0.0539, 1.3757, -0.1039], [-0.0118, -0.1039, 1.4596]],
                       [[0.2413, -0.0776, -0.0005], [-0.0776, 0.2786, -0.152], [-0.0005, -0.152, 0.2887]],
                       [[2.4681, -0.9742, 0.0], [-0.9742, 2.8823, -1.9081], [0.0, -1.9081, 2.9685]], [
        HarmonicForce(1.46), RigidStop(0.109, 0.123, row=apart), RigidStop(0.177, 0.123, side=-1, row=apart)], omega=1.14)
    bounds = (0.08, 0.2)
    branch = bf.trace(bf.find_orbit(system), "rigid_stop_2.restitution", bounds=bounds)
    assert branch.stop_reason == ("bound", "bound") and branch.audit.ok
    (torus, graze) = branch.special_points
    assert (torus.kind, graze.kind) == ("neimark_sacker", "grazing")
    for side, hits in ((1e-3, 1), (-1e-3, 2)):  # what simulations settle on: how often the second stop is struck in a period
        changed = system.with_parameters(**{"rigid_stop_2.restitution": graze.parameter + side})
        motion = bf.simulate(changed, branch.orbits[0].state, periods=400)
        motion = bf.simulate(changed, motion.final, periods=1)
        assert sum(event.element == "rigid_stop_2" for event in motion.events) == hits
    other = bf.trace(branch.orbits[len(branch) - 2], "rigid_stop_2.restitution", bounds=bounds)
    assert points(other) == points(branch)


@pytest.mark.slow
def test_events_that_change_places_have_one_name_from_both_sides():
    """Two sliders on one mass stick in one instant, which the slip of a dry friction overtakes: in both halves of the period, which
    are listed once or twice.  None of that tells what begins there."""
    system = bf.System(np.diag([0.8397, 0.7748]), [[0.1864, -0.1055], [-0.1055, 0.2855]], [[1.2379, -0.8878], [-0.8878, 2.0979]], [
        HarmonicForce(0.331), Coulomb(0.0232, row=(-1.0, 1.0)), Jenkins(2.63, 0.206), Jenkins(0.568, 0.091)], omega=0.647)
    bounds = (0.001, 0.191)
    branch = bf.trace(bf.find_orbit(system), "jenkins_2.limit", bounds=bounds)
    assert branch.audit.ok and len(branch.special_points) == 9
    for row in (2, len(branch) // 2, len(branch) - 3):
        assert points(bf.trace(branch.orbits[row], "jenkins_2.limit", bounds=bounds)) == points(branch)


def test_a_mass_that_comes_to_rest_on_a_surface_grazes_it_from_both_sides():
    """Where a mass stops just as it leaves an elastic stop it parts before that rest, or behind it: the separation leaps over the
    rest, and of the intervals one that ends in slip vanishes from one side, one that ends in separation from the other.  Time
    stepping says where the mass stands."""
    def chain(friction=0.151, turn=0.0):
        return bf.System(np.diag([1.9251, 1.1984, 0.8363]),
                         [[0.3731, -0.1959, 0.0], [-0.1959, 0.2551, -0.0358], [0.0, -0.0358, 0.1544]],
                         [[2.9882, -1.7451, 0.0], [-1.7451, 2.064, -0.3189], [0.0, -0.3189, 1.2297]], [
            HarmonicForce(0.439, phase=2.0 * np.pi * turn), Coulomb(friction, dof=1, static_ratio=1.3),
            ElasticStop(0.224, 96.8, dof=1)], omega=0.429)

    bounds = (0.12, 0.1632)
    branches = [bf.trace(bf.find_orbit(chain(0.15)), "coulomb.friction", bounds=bounds)]
    branches += [bf.trace(branches[0].orbits[row], "coulomb.friction", bounds=bounds) for row in (2, len(branches[0]) - 3)]
    assert len({tuple(points(branch)) for branch in branches}) == 1
    assert [p.kind for p in branches[0].special_points] == ["grazing", "stick_onset", "grazing"]
    for point, turn, way in ((branches[0].special_points[0], 0.149, 1.0), (branches[0].special_points[2], 0.193, -1.0)):
        stands = {}
        for aside in (-1e-3, 0.0, 1e-3):
            system = chain(point.parameter + aside, turn)
            stands[aside] = way * (stepped(system, bf.find_orbit(system).state, 4, 32000)[1] - 0.224)
        assert stands[-1e-3] < -1e-4 and abs(stands[0.0]) < 3e-6 and stands[1e-3] > 1e-4


def test_a_mass_that_rests_beside_its_stop_does_not_hide_what_its_friction_does():
    """Between two amplitudes a mass that impacts have stopped 1e-7 beside its stop is pushed back before it rests.  The step of the
    branch over both saw the nearness of the stop alone, which is next to zero all the while.  Simulations of single amplitudes
    tell how many events a period has, and where that changes."""
    system = bf.System(1.0, 0.0494, 1.0, [HarmonicForce(1.0), RigidStop(0.447, 0.662), Coulomb(0.0603)], omega=0.461)
    branch = bf.trace(bf.find_orbit(system), "amplitude", bounds=(0.5, 1.5), max_steps=250)
    window = [p for p in branch.special_points if 0.6175 < p.parameter < 0.6255]
    assert branch.audit.ok and [p.kind for p in window] == ["slip_onset"] * 2

    def events(amplitude):
        here = system.with_parameters(amplitude=amplitude)
        return len(bf.simulate(here, bf.simulate(here, (0.0, 0.0), periods=60).final, periods=1).events)

    assert [events(amplitude) for amplitude in (0.6178, 0.6213, 0.6248)] == [14, 15, 14]
    for point in window:
        assert {events(point.parameter + aside) for aside in (-1e-7, 1e-7)} == {14, 15}


def test_friction_beside_a_stiff_contact_is_traced():
    """A branch over a friction of .001 and more, while two masses stick within a stiff contact of their distance."""
    row = (1.0, -1.0)
    system = bf.System([[1.3436, 0.0098], [0.0098, 1.2283]], [[0.23, -0.1261], [-0.1261, 0.1895]],
                       [[1.9792, -1.1746], [-1.1746, 1.6159]], [
        HarmonicForce(0.591, dof=1), Coulomb(0.0267, row=row, belt_speed=0.637), ElasticStop(0.891, 37.1, row=row),
        Coulomb(0.0221, dof=1, belt_speed=0.0836)], omega=0.821)
    branch = bf.trace(bf.find_orbit(system), "coulomb_2.friction", bounds=(0.001, 0.122))
    assert branch.stop_reason == ("bound", "bound") and branch.audit.ok


def test_a_friction_that_an_impact_of_a_train_turns_round_does_so_behind_it():
    """The second of three masses, coupled by inertia, rubs on a belt and turns round within the impacts of the first that lead to
    its rest: between an impact and the reversal that follows it the time is never negative.  From a row on such a change a branch
    went on with equations that solved for one that was, off the motion by 2e-3, and another ended where it vanished."""
    system = bf.System([[1.244, 0.0433, -0.007], [0.0433, 1.3175, -0.1195], [-0.007, -0.1195, 1.3881]],
                       [[0.2412, -0.089, -0.0001], [-0.089, 0.2796, -0.1755], [-0.0001, -0.1755, 0.2723]],
                       [[2.4279, -0.9618, 0.0], [-0.9618, 2.8318, -1.8699], [0.0, -1.8699, 2.7433]], [
        HarmonicForce(0.421), RigidStop(0.146, 0.0777), Coulomb(0.036, dof=1, belt_speed=0.115)], omega=0.508)
    bounds = (0.40, 0.43)
    branch = bf.trace(bf.find_orbit(system), "amplitude", bounds=bounds, max_steps=250)
    assert branch.stop_reason == ("bound", "bound")
    values = branch.column("harmonic_force.amplitude")
    (row,) = np.flatnonzero(np.abs(values - 0.421831461363) < 1e-10)[:1]
    for one in (branch, bf.trace(branch.orbits[row], "amplitude", bounds=bounds, max_steps=250)):
        for orbit in one.orbits:
            motion = bf.simulate(orbit.system, orbit.state, periods=1)
            assert np.abs((motion.final - orbit.state) / orbit.weights).max() < 1e-8
            assert (np.diff([event.time for event in orbit.events]) >= -1e-12).all()


def test_an_impact_and_one_of_two_reversals_change_places():
    """The events of a period, impact, reversal, reversal, are the same round in both orders: what tells them apart is from which
    side a reversal comes.  The mass that rubs stands still, unmoved by the impact of the other one, at the instant of that."""
    K = [[1.73, -0.73], [-0.73, 1.73]]
    system = bf.System(np.diag([1.0, 0.918]), (0.06 * np.array(K)).tolist(), K,
                       [HarmonicForce(1.73), RigidStop(0.296, 0.401), Coulomb(0.15, dof=1)], omega=1.55)
    bounds = (0.077, 0.16)
    starts = [bf.find_orbit(system.with_parameters(friction=friction)) for friction in (0.08, 0.15)]
    branches = [bf.trace(start, "friction", bounds=bounds) for start in starts]
    assert all(branch.stop_reason == ("bound", "bound") and branch.audit.ok for branch in branches)
    (one,), (two,) = (branch.special_points for branch in branches)
    assert one.kind == two.kind == "stick_onset" and abs(one.parameter - two.parameter) < 1e-8
    for aside in (-1e-4, 1e-4):
        motion = bf.simulate(system.with_parameters(friction=one.parameter + aside), one.solution.state, periods=200)
        hit = next(event for event in motion.events[::-1] if event.element == "rigid_stop")
        assert 0.0 < abs(hit.before[3]) < 1e-3 and np.sign(hit.before[3]) == np.sign(aside)


def test_how_many_flights_with_slips_are_listed_is_no_change():
    """Three masses coupled by inertia: below .4436184864 the second sticks just before an impact lets it slip the other way.  That
    is all that differs, also where one of the two sequences lists three flights more of the chattering that follows."""
    system = bf.System([[1.0271, -0.0488, 0.0801], [-0.0488, 1.1297, -0.1149], [0.0801, -0.1149, 1.5544]],
                       [[0.1672, -0.1095, 0.0007], [-0.1095, 0.1498, -0.0323], [0.0007, -0.0323, 0.0769]],
                       [[2.8872, -1.9852, 0.0], [-1.9852, 2.5552, -0.57], [0.0, -0.57, 1.1639]],
                       [HarmonicForce(1.53), RigidStop(0.239, 0.72), Coulomb(0.5355, dof=1)], omega=0.4432)
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(0.443, 0.444))
    (point,) = branch.special_points
    assert point.kind == "stick_onset" and abs(point.parameter - 0.4436184864) < 1e-10
    rows = [branch.rows()[int(np.flatnonzero(branch.column("omega") > at)[0])] for at in (0.4432, 0.4437)]
    ends = [(row.part.problem, row.x) for row in rows]
    for k in (0, 1):
        problem, x = ends[k]
        at, x = begun_at(problem, x, int(np.flatnonzero(problem.sequence.nodes[:, CLOSES] == 1)[0]) + 1)
        for more in (0, 1, 3):
            new = longer(at, x, more)[0] if more else at
            pair = (new, ends[1][0]) if k == 0 else (ends[0][0], new)
            masks = signature_change.as_long(*pair)
            assert signature_change.differ(*pair, masks)[2] == [(2, "stick")]
