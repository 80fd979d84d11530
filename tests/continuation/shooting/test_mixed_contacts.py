"""Scenes of several masses with contacts of several kinds: the same special points from whichever row a branch is traced."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.shooting.completion import completion_near
from bifurc.elements import Coulomb, ElasticStop, HarmonicForce, Jenkins, RigidStop


def chain():
    """Four masses, a rigid stop at the last, an elastic one at the second."""
    K = 2.0 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1)
    return bf.System(np.eye(4), 0.06 * K, K, [HarmonicForce(0.682), RigidStop(0.232, 0.295, dof=3),
                                              ElasticStop(0.516, 4.57, dof=1, side=-1)], omega=0.578)


def coupled(inertia, other, omega, amplitude, gap, restitution, friction, elastic):
    """Two masses coupled by inertia: the first hits, the second rubs and meets an elastic stop."""
    return bf.System([[1.0, inertia], [inertia, other]], [[0.11, -0.02], [-0.02, 0.11]], [[1.4, -0.4], [-0.4, 1.4]], [
        HarmonicForce(amplitude), RigidStop(gap, restitution), Coulomb(friction, dof=1), ElasticStop(*elastic, dof=1)], omega=omega)


COUPLED = 0.0657, 1.76, 1.48, 1.82, 0.256, 0.656, 0.0913, (0.202, 23.5)
RESTING = 0.271, 0.804, 1.04, 0.995, 0.384, 0.527, 0.562, (0.385, 5.72)


def points(branch):
    return sorted((p.kind.value, round(p.parameter, 8)) for p in branch.special_points)


def test_an_impact_before_a_train_may_become_a_graze():
    """At omega = .5783 thirteen impacts lead to rest, each slower than the one before it; the first of them, out of the geometric
    sequence, is a graze at .532697261172: there it is born from the other side too, where nothing of it is listed."""
    orbit = bf.find_orbit(chain())
    branch = bf.trace(orbit, "omega", bounds=(0.4046, 0.7514), max_steps=250)
    assert [end.reason.value for end in branch.ends] == ["chattering"] * 2 and branch.audit.ok
    grazings = [p for p in branch.special_points if p.kind.value == "grazing"]
    np.testing.assert_allclose([p.parameter for p in grazings], [0.479201499335, 0.511106378371, 0.532697261172, 0.562041743103],
                               rtol=0, atol=1e-11)
    assert max(p.error for p in grazings) < 1e-12
    below = branch.orbits[int(np.argmin(np.abs(branch.column("omega") - 0.52)))]
    back = bf.trace(below, "omega", bounds=(0.4046, 0.7514), max_steps=250)
    assert points(back) == points(branch)


def test_a_contact_within_which_the_mass_comes_to_rest_grazes():
    """The second mass stops short of its elastic stop on one side, and within it on the other: one boundary, one name."""
    system = coupled(*COUPLED)
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(1.036, 1.924))
    named = [p.kind.value for p in branch.special_points if abs(p.parameter - 1.09704463272) < 1e-9]
    back = bf.trace(branch.orbits[2], "omega", bounds=(1.036, 1.924))
    assert named == ["grazing"] == [p.kind.value for p in back.special_points if abs(p.parameter - 1.09704463272) < 1e-9]
    assert points(back) == points(branch)


@pytest.mark.parametrize("name", ["harmonic_force.amplitude", "mass[0,1]", "rigid_stop.gap"])
def test_what_holds_cancel_is_zero(name):
    """While the first mass rests, the force on it moves nothing: a branch over its amplitude was refused, since rounding of that
    zero is no smooth function of anything."""
    system = coupled(*RESTING)
    value = system.parameter(name)
    branch = bf.trace(bf.find_orbit(system), name, bounds=(0.95 * value, 1.05 * value))
    assert [end.reason.value for end in branch.ends] == ["bound"] * 2 and branch.audit.ok


def test_what_rounding_leaves_of_a_flight_has_no_maximum():
    """A disk that strikes its stator once a turn goes on to two impacts at .809374449316, also where it is traced from below: the
    end of the flight counted as an unlisted touch wherever its steps did not add up to it to the last digit."""
    stator = bf.systems.rigid_stator_rotor(zeta=0.207, nu=0.7, eccentricity=0.503, restitution=0.511)
    branch = bf.trace(bf.find_orbit(stator), "nu", bounds=(0.65, 0.83))
    assert branch.audit.ok and [end.reason.value for end in branch.ends] == ["bound"] * 2
    assert [p.kind.value for p in branch.special_points] == ["grazing", "period_doubling"] * 2
    np.testing.assert_allclose([p.parameter for p in branch.special_points],
                               [0.73818077666, 0.74150432919, 0.809374449316, 0.812711381983], rtol=0, atol=1e-10)


def test_a_reversal_that_releases_another_mass_is_refused_by_nothing():
    """Beyond .804244241184 the friction that turns round releases the first mass in the same instant: the reversed slip of a mass
    that stays is none of the modes tried before, and the branch goes on to where its chattering completes no more."""
    system = coupled(0.225, 1.22, 0.777, 0.504, 0.271, 0.0793, 0.166, (0.437, 8.77))
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(0.5439, 1.0101))
    assert branch.audit.ok and [end.reason.value for end in branch.ends] == ["bound", "chattering"]
    kinds = {p.kind.value: p.parameter for p in branch.special_points if p.parameter > 0.8}
    assert list(kinds) == ["separation", "chatter_completion"]
    assert abs(kinds["chatter_completion"] - 0.883123902099) < 1e-10
    beyond = branch.orbits[int(np.flatnonzero(branch.column("omega") > 0.805)[0])]
    motion = bf.simulate(beyond.system, y0=beyond.state, periods=2)
    hits = [sum(event.element == "rigid_stop" for event in one.events) for one in (motion, beyond)]
    assert hits[0] == 2 * hits[1] > 0


def test_a_slider_at_its_limit_while_the_mass_rests_hides_no_slip():
    """It slipped up to the stop: through the rest behind the impacts it is at its limit, to rounding of either sign.  Elsewhere in
    the period it begins to slip, and with that once more before the first of these impacts."""
    system = bf.System(1.0, 0.0279, 1.0, [HarmonicForce(1.94), RigidStop(0.205, 0.382), Jenkins(2.6, 0.134)], omega=0.604)
    branch = bf.trace(bf.find_orbit(system), "jenkins.stiffness", bounds=(1.3, 3.9))
    assert branch.stop_reason == ("bound", "bound") and branch.audit.ok
    (onset,) = branch.special_points
    assert onset.kind == "slip_onset"
    for aside in (-1e-5, 1e-5):  # what simulation settles on
        settled = bf.find_orbit(system.with_parameters(**{"jenkins.stiffness": onset.parameter + aside}))
        assert settled.signature.count("jenkins.slip") == (6 if aside > 0.0 else 4)
    row = branch.rows()[0]
    assert completion_near(row.part.problem, row.x) is None  # Newton's method leads away there
