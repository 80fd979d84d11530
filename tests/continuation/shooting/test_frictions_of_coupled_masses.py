"""Masses coupled by inertia and relative rows, with static friction above kinetic: one diagram from whichever end it is traced."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import Coulomb, HarmonicForce, Jenkins, RigidStop
from bifurc.orbits.repetition import repetition


def pair(friction=0.13):
    """Static friction between two masses of a full mass matrix; the stop is not reached."""
    return bf.System([[1.5936, 0.1218], [0.1218, 1.4145]], [[0.062, -0.0234], [-0.0234, 0.0485]],
                     [[1.1148, -0.4591], [-0.4591, 0.8619]],
                     [HarmonicForce(0.76), Coulomb(friction, static_ratio=1.3, row=(1.0, -1.0)), RigidStop(5.0, 0.1)], omega=2.42)


def relative(friction=0.13):
    """The same system in the coordinates u = q0 - q1 and q1: the friction acts on a coordinate."""
    B = np.array([[1.0, 1.0], [0.0, 1.0]])  # q = B (u, q1)
    M, C, K = (B.T @ np.array(X) @ B for X in pair().core[:3])
    return bf.System(M, C, K, [HarmonicForce(0.76, row=(1.0, 1.0)), Coulomb(friction, static_ratio=1.3),
                               RigidStop(5.0, 0.1, row=(1.0, 1.0))], omega=2.42)


def three():
    return bf.System([[1.4098, -0.2231, 0.1843], [-0.2231, 1.4926, -0.177], [0.1843, -0.177, 1.4206]],
                     [[0.1314, -0.082, 0.0027], [-0.082, 0.2043, -0.1066], [0.0027, -0.1066, 0.198]],
                     [[1.8498, -1.3114, 0.0], [-1.3114, 3.0438, -1.7324], [0.0, -1.7324, 2.9558]],
                     [HarmonicForce(0.818, dof=2), Coulomb(0.364, dof=1), Coulomb(0.317), Coulomb(0.132, static_ratio=1.3, dof=2)],
                     omega=1.85)


def points(branch):
    return sorted((p.kind.value, round(p.parameter, 7)) for p in branch.special_points)


def traced(system, name, bounds, inward=3):
    """Return a branch, and those from a row near either end of it, each with all rows repeated by simulation."""
    whole = bf.trace(bf.find_orbit(system), name, bounds=bounds, max_steps=300)
    found = [whole, *(bf.trace(whole.orbits[k], name, bounds=bounds, max_steps=300) for k in (inward, -1 - inward))]
    for branch in found:
        assert branch.audit.ok, branch.audit
    return found


def test_a_reversal_between_masses_has_its_condition_in_any_coordinates():
    """At a reversal the contact holds up to 1.3 mu: in the row q0 - q1 the speed behind the event is zero to rounding only, and the
    condition was taken for none.  Motions from both sides of .1928766, in both coordinates, are simulated."""
    found = [traced(make(), "coulomb.friction", (0.1, 0.28)) for make in (pair, relative)]
    onset = 0.192876591128
    for branch in (branch for three_ in found for branch in three_):
        assert min(abs(p.parameter - onset) for p in branch.special_points) < 1e-10
    for make in (pair, relative):
        for friction, sticks in ((onset - 1e-3, False), (onset + 1e-3, True)):
            motion = bf.simulate(make(friction), np.zeros(4), periods=400)
            late = [event for event in motion.events if event.time > motion.stop - motion.system.period]
            assert any(event.kind == "slip" for event in late) is sticks


@pytest.mark.slow
def test_a_reaction_that_a_reversal_moves_is_looked_at_behind_it():
    """Friction that turns round on the last mass moves, through inertia, the reaction that holds the others: they slip at once from
    .6555518 on, not from where the largest reaction between the reversals is at its limit (.69325)."""
    found = traced(three(), "amplitude", (0.409, 1.227), inward=2)
    assert points(found[0]) == points(found[1])
    assert min(abs(p.parameter - 0.655551777576) for p in found[1].special_points) < 1e-10
    # the reaction that holds the second mass just behind the reversal, from the equations of motion alone
    M, C, K = (np.array(X) for X in three().core[:3])
    amplitudes = found[1].column("harmonic_force.amplitude")
    row = int(np.argmin(np.abs(amplitudes - 0.655551777576)))
    event = next(event for event in found[1].orbits[row].events if event.element == "coulomb_3")
    y = event.after
    assert np.abs(y[[0, 1, 3, 4, 5]]).max() < 1e-9
    reactions = []
    for way in (1.0, -1.0):
        load = np.array([0.0, 0.0, amplitudes[row] * np.cos(1.85 * event.time) + 0.132 * way]) - K @ y[:3]
        reactions.append(abs(M[1, 2] * load[2] / M[2, 2] - load[1]))
    assert abs(max(reactions) - 0.364) < 1e-9 < 0.364 - min(reactions)


@pytest.mark.slow
def test_durations_that_vanish_together_are_located_in_their_line():
    """Towards .9726292907 a slip begins before the friction beside it turns, and ends behind that after a time of the order of the
    square of the first: from that side, too, the end is located, and the branch goes on."""
    found = traced(three().with_parameters(**{"harmonic_force.amplitude": 1.0}), "amplitude", (0.9, 1.1), inward=2)
    for branch in found:
        nearest = min(branch.special_points, key=lambda p: abs(p.parameter - 0.972629290691))
        assert abs(nearest.parameter - 0.972629290691) < min(1e-8, max(1e-10, 2.0 * nearest.error))
        assert nearest.kind == "slip_onset"


CHAIN = ([0.7792, 0.9495, 0.8603], [[0.2335, -0.0722, 0.0], [-0.0722, 0.1751, -0.0809], [0.0, -0.0809, 0.2818]],
         [[2.2953, -0.7696, 0.0], [-0.7696, 1.6312, -0.8616], [0.0, -0.8616, 2.7903]])


def test_an_orbit_is_no_successor_of_itself():
    """Behind the end at .7410872338, close to a fold, a jump: the orbit of half a period, listed over the whole one, is no motion
    beyond it, along which the branch would run back."""
    system = bf.System(np.diag(CHAIN[0]), CHAIN[1], CHAIN[2], [HarmonicForce(1.25), Coulomb(0.089, static_ratio=1.3, dof=2),
                                                              Coulomb(0.0219, dof=1)], omega=0.589)
    for branch in traced(system, "omega", (0.4123, 0.7657)):
        assert sorted(end.reason.value for end in branch.ends) == ["bound", "jump"]
        assert len({orbit.closure for orbit in branch.orbits}) == 1


@pytest.mark.slow
def test_an_orbit_is_no_successor_of_itself_where_the_parameter_turns():
    """Where a stick is reached tangentially the branch ends, with dp/ds = 0: the whole period is no way on there either."""
    cycle = bf.System(np.diag([1.1628, 0.5014]), [[0.1282, -0.0664], [-0.0664, 0.1041]], [[1.7563, -0.9666], [-0.9666, 1.4676]], [
        HarmonicForce(1.56), Coulomb(0.327, dof=1), Jenkins(0.48, 0.313, row=(1.0, -1.0)),
        Coulomb(0.156, static_ratio=1.3, row=(1.0, -1.0))], omega=0.448)
    for branch in traced(cycle, "coulomb_2.friction", (0.056, 0.256)):
        assert sorted(end.reason.value for end in branch.ends) == ["cycle_end", "jump"]


def test_a_mirror_image_beside_a_stop_that_is_not_reached():
    """Where stick of no duration begins at both reversals the multiplier over half a period passes -1 in a leap: that of the whole
    passes +1 without a fold, as in the system without the stop, which is symmetric."""
    def system(*stops):
        return bf.System(np.diag([1.8524, 0.5699]), [[0.1998, -0.0383], [-0.0383, 0.1139]], [[2.3547, -0.5515], [-0.5515, 1.4794]],
                         [HarmonicForce(0.544, dof=1), Coulomb(0.0587, static_ratio=1.3), *stops], omega=0.596)

    beside, alone = (traced(s, "coulomb.friction", (0.02, 0.1))[0] for s in (system(RigidStop(0.923, 0.05)), system()))
    assert points(beside) == points(alone) and len(points(alone)) == 2
    row = int(np.argmin(np.abs(beside.column("coulomb.friction") - 0.068)))
    assert alone.orbits[0].closure == -1 and beside.orbits[row].closure == 1
    whole = bf.find_orbit(system().with_parameters(**{"coulomb.friction": beside.column("coulomb.friction")[row]}))
    np.testing.assert_allclose(np.abs(beside.orbits[row].multipliers), np.abs(whole.multipliers), rtol=0, atol=1e-9)


@pytest.mark.parametrize("start", [2, -3])
def test_sliders_that_stop_at_one_instant_name_no_change(start):
    """Two sliders of one mass always stop together where it turns: what begins at .8494961 is a stick of the second one."""
    system = bf.System(1.0, 0.06, 1.0, [HarmonicForce(0.959), Jenkins(0.319, 0.0688), RigidStop(0.673, 0.453),
                                        Jenkins(0.838, 0.0565)], omega=0.593)
    whole = bf.trace(bf.find_orbit(system), "amplitude", bounds=(0.7, 1.1), max_steps=300)
    other = bf.trace(whole.orbits[start], "amplitude", bounds=(0.7, 1.1), max_steps=300)
    assert whole.audit.ok and other.audit.ok
    assert {p for p in points(whole) if p[0] != "grazing"} == {p for p in points(other) if p[0] != "grazing"}
    assert all(repetition(orbit).repeated for orbit in whole.orbits[2:-2:5])


def test_a_friction_that_the_stick_of_another_lets_slip_is_beyond_its_static_limit():
    """Mass 1 sticks to its belt, and the force that holds mass 0 jumps past 1.3 mu: both change at one instant.  Where it does not
    reach that any more, mass 0 slips later; that kinetic friction would let it go as well is not asked.  At the point found the
    force that holds it, from the equations of motion at that instant, is the limit; beyond it the events are those of simulation.
    """
    M, C, K = [np.array(X) for X in (
        [[1.3875, 0.0831, -0.2234], [0.0831, 1.2729, -0.0204], [-0.2234, -0.0204, 1.7453]],
        [[0.1666, -0.0196, -0.0089], [-0.0196, 0.1527, -0.08], [-0.0089, -0.08, 0.2071]],
        [[1.7106, -0.3521, 0.0], [-0.3521, 1.5677, -1.2157], [0.0, -1.2157, 2.1147]])]

    def driven(amplitude):
        return bf.System(M, C, K, [HarmonicForce(amplitude, dof=2), Coulomb(0.276, dof=1, belt_speed=0.344),
                                   Coulomb(0.0852, static_ratio=1.3)], omega=0.483)

    name, bounds = "harmonic_force.amplitude", (0.42, 0.474)
    whole = bf.trace(bf.find_orbit(driven(0.43)), name, bounds=bounds)
    back = bf.trace(whole.orbits[-2], name, bounds=bounds)
    for branch in (whole, back):
        assert branch.audit.ok and [end.reason for end in branch.ends] == ["bound", "bound"]
    point, = (p for p in whole.special_points if p.name == "refused")
    assert min(abs(p.parameter - point.parameter) for p in back.special_points) < 1e-11
    time = next(e.time for e in point.solution.events if e.element == "coulomb" and e.kind == "stick")
    x = bf.simulate(driven(point.parameter), point.solution.state, periods=1)(time)
    q, v = x[:3], np.array([0.0, 0.344, x[5]])
    force = point.parameter * np.array([0.0, 0.0, np.cos(0.483 * time)]) - C @ v - K @ q
    assert abs(M[0, 2] * force[2] / M[2, 2] - force[0]) == pytest.approx(1.3 * 0.0852, abs=1e-11)
    beyond = whole.orbits[-1]
    motion = bf.simulate(beyond.system, beyond.state, periods=1)
    assert len(motion.events) == len(beyond.events) == 6
    np.testing.assert_allclose(motion.final, beyond.state, atol=1e-12)
