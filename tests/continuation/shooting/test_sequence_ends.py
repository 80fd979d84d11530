"""Where event sequences can only end: static friction that refuses a reversal, rests of no duration, trains of impacts without
end, doubled motions at a graze, slips in one direction only, bounds that an element sets."""
import dataclasses

import numpy as np
import pytest

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.continuation.branches.audit import told_slopes
from bifurc.continuation.kinds import StopReason
from bifurc.continuation.tracing import beside
from bifurc.elements import ConstantForce, Coulomb, ElasticStop, HarmonicForce, Jenkins, RigidStop
from bifurc.orbits.repetition import repetition
from bifurc.orbits.shooting.equations import Equations
from bifurc.orbits.shooting.path import constant_path
from bifurc.orbits.shooting.refused import Refusal, earlier_modes, proportional
from bifurc.orbits.shooting.signature import Signature, divided


def belt(amplitude, ratio=1.3):
    """Return a mass on a belt whose friction turns round once a period."""
    return bf.System(1.0, 0.0248, 1.0, [HarmonicForce(amplitude), Coulomb(0.204, belt_speed=0.195, static_ratio=ratio)], omega=2.39)


@pytest.fixture(scope="module")
def refused():
    """Return the branch of the belt, which ends where stick holds what would have turned round."""
    return bf.trace(bf.find_orbit(belt(0.585)), "harmonic_force.amplitude", bounds=(0.2925, 0.8775))


def test_stick_within_its_static_limit_refuses_a_reversal(refused):
    """At the end the force that holds the mass at the reversal is the static limit: K x + c v - F cos, with v that of the belt."""
    assert refused.stop_reason == (StopReason.JUMP, StopReason.BOUND)
    end = refused.orbits[0]
    turn = next(event for event in end.events if "stick" not in (event.mode_before[-1], event.mode_after[-1]))
    x, v = turn.before
    force = x + 0.0248 * v - end.parameters["harmonic_force.amplitude"] * np.cos(2.39 * turn.time)
    assert v == pytest.approx(0.195, abs=1e-12)
    assert abs(force) == pytest.approx(1.3 * 0.204, abs=1e-10)


def test_beyond_a_refused_reversal_the_motion_differs_by_a_finite_amount(refused):
    """Hysteresis: the motion that sticks there exists up to a little less than where the reversing one ends."""
    end = refused.ends[0].p
    other = bf.find_orbit(belt(0.39))
    found = bf.trace(other, "harmonic_force.amplitude", bounds=(0.2925, 0.8775))
    assert found.stop_reason == (StopReason.CYCLE_END, StopReason.JUMP)
    assert end - 1e-4 < found.ends[1].p < end
    phases = np.linspace(0.0, 1.0, 200, endpoint=False)
    assert np.abs(found.orbits[-1]._states(phases) - refused.orbits[0]._states(phases)).max() > 1e-3


def test_a_reversal_that_stick_would_hold_is_no_motion(refused):
    """The equations of the reversing motion go on below the end: what they give there is told apart."""
    problem = refused.problems[0]
    x = refused.x(0)
    x[-1] -= 2e-3
    c = problem.correct(x, np.eye(1, x.size, x.size - 1)[0], True)
    orbit = problem.solution(c.x)
    assert c.converged and orbit.residual < 1e-11
    assert not orbit.success and not repetition(orbit).repeated


def test_without_more_static_friction_the_reversal_itself_tells():
    """Stick refused and slip leaving are one condition: none is added."""
    for ratio, more in ((1.0, 0), (1.3, 1)):
        orbit = bf.find_orbit(belt(0.8, ratio))
        earlier = earlier_modes(orbit.scene, orbit.sequence)
        equations = Equations(orbit.scene, constant_path(orbit.scene, orbit.system), orbit.sequence, orbit.weights)
        refusal = Refusal(equations, earlier, 0.0)
        assert earlier and bool(refusal) is bool(more)
        worst = refusal.worst(np.append(orbit.unknowns, 0.0))
        assert worst < 0.0 and (worst > -np.inf) == more
    a = np.array([1.0, 2.0])
    assert proportional(a, -2.0 * a) and not proportional(a, np.array([1.0, 2.1]))


def test_a_rest_after_one_plastic_impact_ends_where_it_has_no_duration():
    """The impact falls on the release: beyond, the mass leaves at once, and every row is a motion."""
    system = bf.System(1.0, 0.0267, 1.0, [HarmonicForce(0.789), RigidStop(0.549, 0.0)], omega=0.889)
    branch = bf.trace(bf.find_orbit(system), "harmonic_force.amplitude", bounds=(0.3945, 1.1835))
    assert branch.audit.ok and branch.stop_reason[1] is StopReason.BOUND
    changes = np.array([point.s for point in branch.special_points])
    for s, orbit in zip(branch.column("s"), branch.orbits, strict=True):
        assert np.abs(changes - s).min() < 1e-9 or orbit.success and repetition(orbit).repeated, orbit


def test_a_chattering_that_no_longer_completes_ends_the_branch_from_both_sides():
    """Grazings accumulate; a branch does not step over infinitely many of them."""
    system = bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.0), RigidStop(0.0, 0.3)], omega=0.6)
    orbit = bf.find_orbit(system)
    branch = bf.trace(orbit, "rigid_stop.restitution", bounds=(0.0, 0.95))
    assert StopReason.CHATTERING in branch.stop_reason
    assert all(end.reason is not StopReason.NO_SUCCESSOR for end in branch.ends)


def test_a_doubled_motion_ends_on_its_parent_where_its_only_impact_grazes():
    """The mass that just misses its stop moves with the period of the force: beyond the graze of every second period nothing new
    goes on. Its single period, run through without impact, touches the stop at the same amplitude."""
    def system(amplitude):
        return bf.System(1.0, 0.0245, 1.0, [HarmonicForce(amplitude), RigidStop(0.203, 0.23), Coulomb(0.175)], omega=2.36)

    branch = bf.trace(bf.find_orbit(system(1.0)), "harmonic_force.amplitude", bounds=(0.5, 1.5))
    assert branch.stop_reason == (StopReason.MERGED, StopReason.MERGED)
    single = bf.trace(bf.find_orbit(system(0.8)), "harmonic_force.amplitude", bounds=(0.7, 1.0))
    graze = single.special_points.of("grazing")[0].parameter
    assert min(end.p for end in branch.ends) == pytest.approx(graze, abs=1e-9)


def test_a_contact_that_would_slip_one_way_only_ends_the_branch_of_stick():
    """Two masses, the second held: its slip begins where the force that holds it, linear in the motion of the first, meets mu."""
    K, C, m2, F, w = 1.542, 0.0925, 1.67, 0.629, 0.622
    system = bf.System(np.diag([1.0, m2]), [[C, -0.0325], [-0.0325, C]], [[K, -0.542], [-0.542, K]],
                       [HarmonicForce(F), RigidStop(0.95, 0.0701), Coulomb(0.521, dof=1)], omega=w)
    orbit = bf.find_orbit(system)
    branch = bf.trace(orbit, "coulomb.friction", bounds=(0.2605, 0.7815))
    assert branch.stop_reason == (StopReason.STICKING, StopReason.BOUND)
    u = orbit.state[1]
    x = F / (K - w**2 + 1j * w * C)
    limit = abs((0.542 + 0.0325j * w) * x) + abs(0.542 * (0.542 * u / K) - K * u)
    assert branch.ends[0].p == pytest.approx(limit, abs=1e-9)


def test_impacts_beside_a_mass_that_sticks_all_the_time():
    """What is held through all impacts labels a family: the equations are regular, and the motion goes on past its grazing."""
    system = bf.System(np.diag([1.0, 1.55]), [[0.1296, -0.0696], [-0.0696, 0.1296]], [[2.16, -1.16], [-1.16, 2.16]],
                       [HarmonicForce(0.653), RigidStop(0.244, 0.298), Coulomb(0.361, dof=1)], omega=2.42)
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(1.694, 3.146))
    hits = [orbit for orbit in branch.orbits if orbit.sequence.events == 1]
    assert hits and all(orbit.family == [1] for orbit in hits)
    for orbit in hits:  # nothing but the rounding of the eigenvalues, which is that of the largest (infinite at the grazing)
        sizes = np.abs(orbit.multipliers)
        assert sizes[-1] <= 2.2e-16 * sizes[0]
    assert branch.audit.ok and branch.stop_reason[0] is StopReason.STICKING


def test_a_branch_that_starts_on_the_end_of_a_range_stays_there():
    """A plastic impact, traced in its restitution from 0: the half that would leave the range ends on its bound."""
    system = bf.System(1.0, 0.141, 1.0, [HarmonicForce(2.99), RigidStop(-0.0697, 0.0)], omega=2.89)
    branch = bf.trace(bf.find_orbit(system), "rigid_stop.restitution", bounds=(0.0, 0.25))
    assert branch.stop_reason == (StopReason.BOUND, StopReason.BOUND)
    assert len(branch.special_points) == 0 and branch.ends[0].p == 0.0


@dataclasses.dataclass
class Short:
    """A row whose boundary monitor is -s (1 - s/1e-6): valid for a stretch of 1e-6 only."""

    part: object = None
    x: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(2))
    direction: np.ndarray = dataclasses.field(default_factory=lambda: np.array([1.0, 0.0]))
    tangent: np.ndarray = dataclasses.field(default_factory=lambda: np.array([1.0, 0.0]))
    tests: tuple = (1.0, 0.0)


def test_the_side_of_a_boundary_is_looked_up_where_it_is_told(monkeypatch):
    """A fixed step off the boundary would lie beyond the other end of a short stretch."""
    class Equations:
        def correct(self, x, tangent):
            return dataclasses.make_dataclass("C", ["converged", "s"])(True, float(x[0]))

    row = Short(part=dataclasses.make_dataclass("P", ["problem"])(Equations()))
    monkeypatch.setattr("bifurc.continuation.tracing.tests_of", lambda c: (1.0, -c.s * (1.0 - c.s / 1e-6)))
    length, (change,) = beside(row, [1])
    assert length == 1e-7 and change < 0.0


def test_an_asymmetric_motion_ends_on_the_symmetric_one_where_both_graze():
    """Between two equal stops: motions that are not their own mirror image become so at a graze, on both sides of a pitchfork."""
    stops = RigidStop(0.319, 0.711), RigidStop(0.319, 0.711, side=-1)
    system = bf.System(1.0, 0.183, 1.0, [HarmonicForce(1.05), *stops], omega=0.655)
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(0.4585, 0.8515))
    assert branch.stop_reason == (StopReason.MERGED, StopReason.MERGED)
    low, high = branch.ends[0].p, branch.ends[1].p
    assert low == pytest.approx(high, abs=1e-11)
    for point in (branch.special_points[0], branch.special_points[-1]):
        y0, y1 = point.solution._states(np.array([0.0, 0.5]))
        assert np.abs(y0 + y1).max() < 1e-9


def test_halves_that_differ_in_another_way_than_at_the_start_have_not_merged():
    """Along a branch of four periods the difference of its halves turns by more than a right angle; it ends where it vanishes, on
    the flip of the motion of two periods."""
    system = bf.System(1.0, 0.0451, 1.0, [HarmonicForce(0.826), ElasticStop(0.449, 51.3)], omega=0.449)
    branch = bf.trace(bf.find_orbit(system), "elastic_stop.gap", bounds=(0.2694, 0.6286))
    assert branch.stop_reason == (StopReason.MERGED, StopReason.MERGED)
    for end, solution in zip(branch.ends, (branch.special_points[0].solution, branch.special_points[-1].solution), strict=True):
        y = solution._states(np.array([0.1, 2.1]))
        assert np.abs(y[0] - y[1]).max() < 1e-9
        parent = bf.find_orbit(system.with_parameters(**{"elastic_stop.gap": end.p}), guess=solution.state, periods=2)
        assert np.abs(parent.multipliers + 1.0).min() < 1e-6


def test_a_doubled_branch_does_not_go_on_along_its_parent():
    """The single motion, run through twice, solves the equations of the doubled one: a step that falls on it is none, and the
    branch ends on the flip that the branch of the single motion has."""
    stop = ElasticStop(0.103, 152.0, damping=0.0934)
    system = bf.System(1.0, 0.034, 1.0, [HarmonicForce(0.635), stop], omega=0.66)
    orbit = bf.find_orbit(system)
    assert orbit.periods == 2
    branch = bf.trace(orbit, "elastic_stop.stiffness", bounds=(76.0, 228.0))
    assert branch.stop_reason == (StopReason.BOUND, StopReason.MERGED) and branch.audit.ok
    for row in branch.orbits[:-1]:
        y = row._states(np.array([0.1, 1.1]))
        assert np.abs(y[0] - y[1]).max() > 1e-6
    parent = bf.find_orbit(system.with_parameters(**{"elastic_stop.stiffness": 200.0}), periods=1)
    single = bf.trace(parent, "elastic_stop.stiffness", bounds=(150.0, 228.0))
    flips = [point.parameter for point in single.special_points.of("period_doubling")]
    assert flips == pytest.approx([branch.ends[1].p], abs=1e-7)


def test_a_release_seen_from_above_is_no_reversal():
    """Where the mass comes to rest on its preloaded stop the equations of its leaps are singular: what rounding makes of the slope
    there is no sign change of it."""
    system = bf.System(1.0, 0.163, 1.0, [HarmonicForce(0.41), RigidStop(-0.326, 0.194)], omega=2.43)
    branch = bf.trace(bf.find_orbit(system), "harmonic_force.amplitude", bounds=(0.205, 0.615))
    assert branch.stop_reason == (StopReason.BOUND, StopReason.BOUND)
    (point,) = branch.special_points
    assert point.parameter == pytest.approx(0.326, abs=point.error) and not point.reverses
    assert branch.audit.parity, branch.audit


def test_slopes_on_a_boundary_count_where_the_chord_agrees():
    """Two parts of three rows: at their common boundary rounding makes slopes of a wrong sign, inside it does not."""
    arrays = {"s": np.array([0.0, 1.0, 2.0, 2.0, 3.0, 4.0]), "parameter": np.array([0.0, 1.0, 2.0, 2.0, 3.0, 2.5]),
              "slope": np.array([1.0, 1.0, -1e-6, -1e-3, 1.0, -1.0]), "part": np.array([0, 0, 0, 1, 1, 1])}
    assert told_slopes(arrays, []).tolist() == [1.0, 1.0, 0.0, 0.0, 1.0, -1.0]


def test_flights_under_friction_are_not_taken_for_grazes():
    """In a chattering with dry friction each flight turns where friction does: the margin to an impact more does not jump."""
    system = bf.System(1.0, 0.0724, 1.0, [HarmonicForce(1.0), RigidStop(0.483, 0.122), Coulomb(0.239)], omega=0.698)
    branch = bf.trace(bf.find_orbit(system), "rigid_stop.gap", bounds=(0.2898, 0.6762))
    assert branch.audit.ok, branch.unresolved
    assert len(branch.special_points) == 0


def test_a_mass_that_nothing_pushes_harder_does_not_break_loose():
    """Two masses at rest, each held: the force on the second one stands still, and if that is its static limit it may break loose
    at any time or never.  Such solutions, with a free instant and multipliers that are infinite, led from one branch to the next;
    the branch ends where the force is the limit, 1.3 mu2 less the friction of the belt that pulls."""
    kx, kxx = -1.709, 2.8673
    system = bf.System(np.diag([1.3935, 1.1027]), [[0.3647, -0.1759], [-0.1759, 0.3245]], [[3.182, kx], [kx, kxx]], [
        HarmonicForce(0.482), Coulomb(0.045, dof=1, belt_speed=0.0518), Coulomb(0.09, dof=1, static_ratio=1.3), Coulomb(0.254)],
        omega=0.603)
    branch = bf.trace(bf.find_orbit(system), "coulomb_2.friction", bounds=(0.08, 0.1))
    assert branch.stop_reason == ("jump", "bound") and branch.audit.ok
    assert all(np.abs(orbit.multipliers).max() < 2.0 for orbit in branch.orbits[1:])
    end = branch.orbits[0]
    stick = [event for event in end.events if event.element == "coulomb_2" and event.kind == "stick"][-1]
    force = abs(kx * stick.before[0] + kxx * stick.before[1])
    assert abs(force - (1.3 * end.system.parameter("coulomb_2.friction") - 0.045)) < 1e-12
    assert all(not problem.sequence.unmoved(problem.scene) for problem in branch.problems)


def test_an_event_is_led_to_by_what_is_not_held():
    """Of two masses at rest the force on the excited one changes, that on the other does not; it does while the first one moves."""
    contacts = [HarmonicForce(1.0), Coulomb(0.2), Coulomb(0.2, dof=1)]
    system = bf.System(np.eye(2), 0.1 * np.eye(2), [[2.0, -1.0], [-1.0, 2.0]], contacts, omega=1.0)
    scene = scene_of(system)
    for mode, unmoved in (("stick", [False, True]), ("slip+", [False, False])):
        before = scene.index(("always", mode, "stick"))
        for element, stands in zip((1, 2), unmoved, strict=True):
            for guard in scene.guards_of(before, element):
                after = int(scene.expand(before, guard).then[before, guard].max())
                nodes = divided(scene, np.array([[before, guard, after, 0, 0]]))
                assert bool(Signature(nodes, np.zeros(1), 1.0).unmoved(scene)) is stands


@pytest.mark.parametrize("place", [0.05, -0.2, 0.13])
def test_a_stop_that_comes_to_where_a_mass_stands(place):
    """Friction 2 holds the second mass where it was put, against .2 times the other's motion: a stop can be moved up to there."""
    system = bf.System(np.eye(2), 0.1 * np.eye(2), [[1.2, -0.2], [-0.2, 1.2]], [
        HarmonicForce(0.5), Coulomb(2.0, dof=1), RigidStop(0.4, 0.5, dof=1)], omega=1.4)
    branch = bf.trace(bf.find_orbit(system, (0.0, place, 0.0, 0.0)), "rigid_stop.gap", bounds=(-0.4, 0.6))
    low, high = branch.ends
    assert (low.reason, high.reason) == (StopReason.STICKING, StopReason.BOUND) and low.p == pytest.approx(place, abs=1e-12)
    assert branch.special_points[0].parameter == pytest.approx(place, abs=1e-12) and branch.audit.ok


@pytest.mark.parametrize("part", [0.0, 1.0, -0.4])
def test_a_stop_that_moves_what_stands_as_far_as_a_slider_holds(part):
    """A load of 3 presses the second mass on its stop; a slider (stiffness 5, limit 1) holds it with ``part`` of it.  The stop
    moves it by the rest over the stiffness either way; farther the slider slips along, another motion at each place."""
    system = bf.System(np.eye(2), 0.1 * np.eye(2), [[1.2, -0.2], [-0.2, 1.2]], [
        HarmonicForce(0.5), ConstantForce(3.0, dof=1), Jenkins(5.0, 1.0, dof=1), RigidStop(0.1, 0.5, dof=1)], omega=1.4)
    orbit = bf.find_orbit(system, (0.0, 0.1, 0.0, 0.0, 0.1 - 0.2 * part))
    branch = bf.trace(orbit, "rigid_stop.gap", bounds=(-0.4, 0.5))
    for end, sign in zip(branch.ends, (-1.0, 1.0), strict=True):
        assert end.reason is StopReason.STICKING and end.p == pytest.approx(0.1 + 0.2 * (sign - part), abs=1e-12)
    assert branch.audit.ok
