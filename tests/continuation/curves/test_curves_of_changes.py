"""Curves in two parameters of what changes the sequence of events, of peaks of orbits, of Hopf points and boundary equilibria."""
import math
from dataclasses import replace

import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.curves.problem import CurveProblem
from bifurc.continuation.families import family_of
from bifurc.elements import ConstantForce, Coulomb, ElasticStop, HarmonicForce
from bifurc.systems import belt_oscillator, bilinear_oscillator, impact_oscillator


def rubbing():
    """One mass with dry friction: it stops once a half-period, longer, and twice."""
    return bf.System(1.0, 0.05, 1.0, [HarmonicForce(1.0), Coulomb(0.4)], omega=0.9)


def rubbing_neighbour():
    """Two masses, the second rubs."""
    return bf.System(np.eye(2), [[0.1, -0.05], [-0.05, 0.1]], [[2.0, -1.0], [-1.0, 2.0]], [
        HarmonicForce(0.5), Coulomb(0.3, dof=1)], omega=0.8)


def plastic():
    """A plastic impact that begins to rest."""
    return impact_oscillator(zeta=0.01737, omega=2.1, amplitude=6.268, gap=0.0, restitution=0.0)


def narrow():
    """As `rubbing`, damped little: it rests twice in a window of frequencies that closes at a friction of .28597."""
    return bf.System(1.0, 0.054338123106597732, 1.0, [HarmonicForce(1.0), Coulomb(0.2737362155577171)], omega=0.9)


def test_a_stick_onset_is_followed_under_either_name_that_rounding_gives_it():
    """Rate and maximum behind the reversal are zero together; only the rate has a derivative there."""
    system = rubbing_neighbour().with_parameters(**{"coulomb.friction": 0.2})
    point = bf.trace(bf.find_orbit(system), "omega", bounds=(0.5, 1.2)).special_points.of("stick_onset")[-1]
    assert point.name in ("leaving", "unlisted")
    ends = []
    for name in ("leaving", "unlisted"):
        curve = bf.trace_curve(replace(point, name=name), ("omega", "coulomb.friction"), bounds={"coulomb.friction": (0.185, 0.22)})
        assert [end.reason.value for end in curve.ends] == ["bound", "bound"]
        ends.append(curve.column("omega")[[0, -1]])
    assert ends[0] == pytest.approx(ends[1], abs=1e-12)
    other = bf.trace(bf.find_orbit(rubbing_neighbour().with_parameters(**{"coulomb.friction": 0.185})), "omega", bounds=(0.5, 1.2))
    assert ends[0][0] == pytest.approx(other.special_points.of("stick_onset")[-1].parameter, abs=1e-10)


@pytest.mark.slow
def test_a_curve_of_stick_onsets_ends_where_a_touch_begins():
    """Below a friction of .178 the mass rests twice, as separate branches say; the window of that opens like a cube."""
    system = rubbing_neighbour().with_parameters(**{"coulomb.friction": 0.2})
    point = bf.trace(bf.find_orbit(system), "omega", bounds=(0.5, 1.2)).special_points.of("stick_onset")[-1]
    curve = bf.trace_curve(point, ("omega", "coulomb.friction"), bounds={"coulomb.friction": (0.177, 0.2)}, direction=-1)
    assert curve.ends[0].reason == "no_successor" and "meets a grazing here" in curve.ends[0].message
    assert curve.column("coulomb.friction")[0] == pytest.approx(0.178047, abs=1e-6)
    counts = [len(bf.trace(bf.find_orbit(system.with_parameters(**{"coulomb.friction": mu})), "omega",
                           bounds=(0.6, 0.9)).special_points) for mu in (0.173, 0.183)]
    assert counts == [2, 1]


@pytest.mark.parametrize("aside", [-1e-13, -1e-15, 1e-15, 1e-13])
def test_a_curve_of_stick_onsets_sees_the_touch_before_them_from_whichever_side_it_starts(aside):
    """The maximum behind the reversal is zero on one side of its onset, and none on the other.  Below a friction of .178 motions
    rest twice a half-period just before they come to the frequency at which the rate of the reversal says that they begin to."""
    second = "coulomb.friction"
    system = rubbing_neighbour().with_parameters(**{second: 0.18, "omega": 0.74})
    point = bf.trace(bf.find_orbit(system), "omega", bounds=(0.7, 0.75)).special_points.of("stick_onset")[-1]
    x = point.x + aside * point.problem.scale * point.problem.null_tangent(point.x)
    for name in ("leaving", "unlisted"):
        start = CurveProblem(family_of(point.problem, second, (0.17, 0.19)), point.kind, name, (0.6, 0.9), np.append(x, 0.18))
        touch = [monitor.name for monitor in start.monitors].index("unlisted")
        for friction, rests in ((0.175, 4), (0.182, 2)):
            c = start.correct(np.append(x, friction), np.eye(1, x.size + 1, x.size)[0], True)
            beside = system.with_parameters(**{second: friction, "omega": float(c.x[-2]) + 5e-6})
            counted = sum(event.kind.value == "stick" for event in bf.find_orbit(beside).events)
            assert c.converged and (c.monitors[touch] > 1e-9, counted) == (rests == 4, rests)


@pytest.mark.slow
def test_a_curve_forgets_the_steps_that_failed():
    """Where the window closes, one way, steps fail; the other way the curve goes on to the points of separate branches."""
    kind = "stick_onset"
    system = narrow()
    value = system.parameter("coulomb.friction")
    point = bf.trace(bf.find_orbit(system), "omega", bounds=(0.4, 0.9)).special_points.of(kind)[-1]
    curve = bf.trace_curve(point, ("omega", "coulomb.friction"), bounds={"coulomb.friction": (value - 0.02, value + 0.02)})
    assert [end.reason.value for end in curve.ends] == ["bound", "no_successor"]
    assert "a point of codimension two" in curve.ends[1].message
    assert curve.column("coulomb.friction")[[0, -1]] == pytest.approx([value - 0.02, 0.28597], abs=2e-5)
    beside = system.with_parameters(**{"coulomb.friction": value - 0.02})
    other = bf.trace(bf.find_orbit(beside), "omega", bounds=(0.4, 0.9)).special_points.of(kind)[-1]
    assert curve.column("omega")[0] == pytest.approx(other.parameter, abs=1e-10)


@pytest.mark.parametrize(("make", "bounds", "kind", "second", "width"), [
    (rubbing, (0.2, 1.3), "stick_onset", "coulomb.friction", 0.1),
    (rubbing, (0.2, 1.3), "slip_onset", "coulomb.friction", 0.1),
    (rubbing_neighbour, (0.5, 1.3), "stick_onset", "coulomb.friction", 0.05),
    (rubbing_neighbour, (0.5, 1.3), "slip_onset", "coulomb.friction", 0.03),
    (plastic, (1.9, 2.2), "separation", "zeta", 0.007)])
def test_changes_of_the_sequence_are_followed_under_every_name(make, bounds, kind, second, width):
    """The last point of the curve is the special point of a separate branch."""
    system = make()
    (point,) = bf.trace(bf.find_orbit(system), "omega", bounds=bounds).special_points.of(kind)
    value = system.parameter(second)
    curve = bf.trace_curve(point, ("omega", second), bounds={second: (value - width, value + width), "omega": (0.15, 2.5)})
    assert [end.reason.value for end in curve.ends] == ["bound", "bound"]
    for k in (0, -1):
        omega, at = float(curve.column("omega")[k]), float(curve.column(second)[k])
        beside = system.with_parameters(**{second: at, "omega": 1.01 * omega})
        branch = bf.trace(bf.find_orbit(beside), "omega", bounds=(0.9 * omega, 1.1 * omega))
        assert min(abs(p.parameter - omega) for p in branch.special_points.of(kind)) < 1e-10


def test_peaks_of_orbits_against_the_linear_oscillator():
    """Below its stop the oscillator is linear: omega^2 = 1 - 2 zeta^2 where the amplitude is largest."""
    branch = bf.trace(bf.find_orbit(impact_oscillator(zeta=0.05, omega=0.9, amplitude=0.05, gap=1.0, restitution=0.7)), "omega",
                      bounds=(0.5, 1.5), peaks="max_0")
    (peak,) = branch.special_points.of("peak")
    assert peak.parameter == pytest.approx(math.sqrt(1.0 - 2.0 * 0.05**2), abs=1e-11) and peak.error < 1e-10
    curve = bf.trace_curve(peak, ("omega", "zeta"), bounds={"zeta": (0.03, 0.1), "omega": (0.5, 1.5)})
    assert [end.reason.value for end in curve.ends] == ["bound", "bound"]
    assert np.abs(curve.column("omega") - np.sqrt(1.0 - 2.0 * curve.column("zeta")**2)).max() < 1e-11


def test_peaks_on_a_contact_are_followed():
    """On an elastic stop, against a branch at the other load."""
    system = bilinear_oscillator(zeta=0.05, omega=0.9, amplitude=0.3, gap=0.5, stiffness_ratio=4)
    (peak,) = bf.trace(bf.find_orbit(system), "omega", bounds=(0.9, 1.7), peaks="max_0").special_points.of("peak")
    curve = bf.trace_curve(peak, ("omega", "amplitude"), bounds={"amplitude": (0.25, 0.4), "omega": (0.5, 1.9)})
    other = system.with_parameters(amplitude=float(curve.column("amplitude")[-1]))
    (there,) = bf.trace(bf.find_orbit(other), "omega", bounds=(0.9, 1.8), peaks="max_0").special_points.of("peak")
    assert there.parameter == pytest.approx(float(curve.column("omega")[-1]), abs=1e-10)


def test_a_height_that_the_stop_holds_has_no_peak():
    """With an impact the largest displacement is the gap, at every frequency."""
    orbit = bf.find_orbit(impact_oscillator(zeta=0.05, omega=1.0, amplitude=0.52, gap=0.5, restitution=0.7))
    assert "impact" in orbit.signature
    branch = bf.trace(orbit, "omega", bounds=(0.9, 1.1), peaks="max_0")
    assert not branch.special_points.of("peak")


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_slope_of_a_top_is_that_of_the_branch(sign):
    """The gradient along the tangent against heights of neighbouring solutions; half-period orbits too."""
    branch = bf.trace(bf.find_orbit(rubbing_neighbour()), "omega", bounds=(0.7, 0.85))
    name = "max_0" if sign > 0.0 else "min_0"
    problem, x = branch.problems[0], branch.x(3)
    tangent = problem.null_tangent(x)
    slope = problem.measure_gradient(name, x) * problem.scale @ tangent
    ends = [problem.correct(x + step * problem.scale * tangent, tangent).x for step in (-1e-4, 1e-4)]
    heights = [problem.measure(name, end[None])[0] for end in ends]
    assert slope == pytest.approx((heights[1] - heights[0]) / 2e-4, rel=1e-6)


def test_hopf_points_against_the_closed_form():
    """Exponential friction on a belt: 2 zeta = (static - kinetic) / decay exp(-V / decay)."""
    system = belt_oscillator(law="exponential")
    (point,) = bf.trace(bf.find_equilibrium(system), "belt_speed", bounds=(0.1, 2.5)).special_points.of("hopf")
    curve = bf.trace_curve(point, ("belt_speed", "zeta"), bounds={"zeta": (0.03, 0.1), "belt_speed": (0.05, 4.0)})
    assert [end.reason.value for end in curve.ends] == ["bound", "bound"]
    exact = 0.5 * np.log(0.4 / (0.5 * 2.0 * curve.column("zeta")))
    assert np.abs(curve.column("belt_speed") - exact).max() < 1e-10


def test_boundary_equilibria_are_followed():
    """A load presses a mass against an elastic stop: it touches where the load over the stiffness is the gap."""
    system = bf.System(1.0, 0.1, 2.0, [ElasticStop(0.5, 4.0), ConstantForce(0.1)])
    (point,) = bf.trace(bf.find_equilibrium(system), "force", bounds=(0.0, 2.0)).special_points.of("boundary_equilibrium")
    curve = bf.trace_curve(point, ("force", "gap"), bounds={"gap": (0.2, 0.9), "force": (0.0, 2.0)})
    assert np.abs(curve.column("constant_force.force") - 2.0 * curve.column("elastic_stop.gap")).max() < 1e-12
    assert [end.reason.value for end in curve.ends] == ["bound", "bound"]


@pytest.mark.slow  # compiles the law
def test_a_curve_that_cannot_move_says_what_to_follow():
    """Where an orbit shrinks onto an equilibrium its own equations are singular."""
    system = belt_oscillator(law="exponential")
    (point,) = bf.trace(bf.find_equilibrium(system), "belt_speed", bounds=(0.1, 2.5)).special_points.of("hopf")
    (orbit, *_) = bf.switch_branch(point)
    branch = bf.trace(orbit, "belt_speed", bounds=(1.0, 1.1))
    (end,) = branch.special_points.of("hopf")
    with pytest.raises(ValueError, match="find_equilibrium"):
        bf.trace_curve(end, ("belt_speed", "zeta"), bounds={"zeta": (0.03, 0.1)})
