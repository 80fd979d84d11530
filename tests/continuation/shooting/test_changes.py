"""Events put into and taken out of the motion that just touches its stop, and what such changes are called."""
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.kinds import SpecialPointKind
from bifurc.continuation.shooting import signature_change as changes
from bifurc.continuation.shooting.appearing import inserted, touches
from bifurc.continuation.shooting.problem import orbit_problem
from bifurc.continuation.shooting.vanishing import dropped, listed_speeds
from bifurc.elements import ElasticStop, HarmonicForce, RigidStop
from bifurc.orbits.shooting.sequence import GUARD
from bifurc.system import System

ZETA, W, F = 0.07, 1.3, 0.8


def phasor(harmonic):
    w = harmonic * W
    return F / (1.0 - w * w + 2j * ZETA * w)


STOPS = {"rigid": lambda gap: RigidStop(gap, 0.6), "elastic": lambda gap: ElasticStop(gap, 3.0, 0.2)}


def touching(kind, harmonic=1, above=1e-10):
    P = phasor(harmonic)
    gap = abs(P) * (1.0 + above)
    system = System(1.0, 2.0 * ZETA, 1.0, (HarmonicForce(F, harmonic=harmonic), STOPS[kind](gap)), omega=W)
    orbit = bf.find_orbit(system, guess=(P.real, -harmonic * W * P.imag), periods=1)
    assert orbit.success and not orbit.sequence.events
    problem = orbit_problem(orbit, "harmonic_force.amplitude", (0.5 * F, 2.0 * F))
    return problem, problem.x0, P


@pytest.mark.parametrize("kind", STOPS)
@pytest.mark.parametrize("harmonic", [1, 2])
def test_touches_are_at_the_tops_of_the_motion(kind, harmonic):
    problem, x, P = touching(kind, harmonic)
    found = touches(problem, x)
    tops = np.sort(np.mod((-np.angle(P) + 2.0 * np.pi * np.arange(harmonic)) / (2.0 * np.pi * harmonic), 1.0))
    times = np.array([item[0] for item in found])
    assert len(found) == harmonic and (np.diff(times) > 0.0).all()
    np.testing.assert_allclose(np.sort(times % 1.0), tops, atol=1e-7)
    for _, mode, guard, y in found:
        np.testing.assert_allclose(y, [abs(P), 0.0], atol=1e-7)
        assert problem.scene.guard(mode, guard).element == 1
    assert touches(*touching(kind, harmonic, above=1e-5)[:2]) == []


@pytest.mark.parametrize("kind", STOPS)
@pytest.mark.parametrize("harmonic", [1, 2])
def test_an_event_that_is_put_in_and_taken_out_leaves_the_motion(kind, harmonic):
    problem, x, P = touching(kind, harmonic)
    made = inserted(problem, x)
    new = problem.with_sequence(*made)
    each = 1 if kind == "rigid" else 2  # contact and separation
    events = new.sequence.nodes[:, GUARD] >= 0
    assert events.sum() == each * harmonic and new.x0[-1] == x[-1]
    assert np.abs(new.residual(new.x0[:-1], new.x0[-1])).max() < 1e-6
    speeds = np.array(listed_speeds(new, new.x0))  # of an elastic stop durations: that of the flight, and none
    want = np.zeros(harmonic) if kind == "rigid" else np.tile([1.0 / harmonic, 0.0], harmonic)
    np.testing.assert_allclose(np.abs(speeds), want, atol=1e-6)
    signature, at = dropped(new, new.x0, 1e-5)
    assert not (signature.nodes[:, GUARD] >= 0).any() and signature.span == problem.sequence.span
    back = problem.with_sequence(signature, at)
    c = back.correct(back.x0, np.eye(1, back.x0.size, back.x0.size - 1)[0], True)
    assert c.converged
    motion, old = back.motion(c.x), problem.motion(x)
    t = np.linspace(0.0, 1.0, 7)
    np.testing.assert_allclose(motion._states(t), old._states(t), atol=1e-9)
    want = abs(P) * np.cos(harmonic * 2.0 * np.pi * t + np.angle(P))
    np.testing.assert_allclose(old._states(t)[:, 0], want, atol=1e-9)
    assert dropped(problem, x) is None  # there is nothing to take out


@pytest.mark.parametrize("kind", STOPS)
def test_the_side_with_impacts_is_that_of_larger_loads_for_a_soft_stop_and_what_begins_is_a_graze(kind):
    problem, x, _ = touching(kind)
    new = problem.with_sequence(*inserted(problem, x))
    side = changes.admissible_side(new, new.x0)
    assert side is not None and np.linalg.norm(side) == pytest.approx(1.0)
    c = new.correct(new.x0 + 1e-4 * new.scale * side, side)
    assert c.converged and (c.monitors[[k for k, m in enumerate(new.monitors) if m.boundary]] < 0.0).all()
    if kind == "elastic":
        assert side[-1] > -1e-6  # it is met harder by larger loads
    assert changes.kind_of(problem, changes.UNLISTED, x) is SpecialPointKind.GRAZING
    assert changes.kind_of(new, changes.LISTED, new.x0) is SpecialPointKind.GRAZING
    assert changes.kind_of(problem, changes.LEAVING, x) is SpecialPointKind.STICK_ONSET
    constructed = list(changes.constructed(problem, x, changes.UNLISTED))
    assert constructed and all(len(s.nodes) == len(new.sequence.nodes) for s, _ in constructed)
    assert list(changes.constructed(problem, x, changes.MERGES)) == []


@pytest.mark.parametrize("kind", STOPS)
def test_what_differs_between_two_sequences_names_the_change(kind):
    problem, x, _ = touching(kind)
    new = problem.with_sequence(*inserted(problem, x))
    names = changes.named_events(new)
    assert names == [(1, "impact")] if kind == "rigid" else names == [(1, "contact"), (1, "separation")]
    assert changes.named_events(problem) == []
    told = changes.changed(problem, x, new)
    assert told is SpecialPointKind.GRAZING
    assert changes.changed(problem, x, problem) is None
    assert changes.listed(new).sum() == len(names) and not changes.listed(problem).any()
    spans = changes.intervals(new, new.x0)
    assert spans.sum() == pytest.approx(1.0) and (spans > -1e-7).all()
    one, two, apart = changes.differ(problem, new, [changes.listed(problem), changes.listed(new)])
    assert not one and dict(two) == {name: 1 for name in names} and set(apart) == set(names)


def test_a_motion_of_two_periods_that_repeats_is_told_and_so_is_its_mirror_image():
    problem, x, _ = touching("rigid", 2)
    new = problem.with_sequence(*inserted(problem, x))
    tangent = changes.admissible_side(new, new.x0)
    assert changes.unlike(problem, x, 1) < 1e-13 and not changes.merges(problem, x, np.eye(1, x.size, x.size - 1)[0])
    assert not changes.mirrors(problem, x, np.eye(1, x.size, x.size - 1)[0])  # the stop breaks the symmetry
    if tangent is not None:
        assert not changes.merges(new, new.x0, -tangent)  # it repeats all along: an impact in both periods
    size = changes.nothing(new, new.x0, new.x0)
    assert size == changes.ONE
    ahead = new.x0 + np.append(0.1 * new.scale[:-1], 5.0)
    assert changes.nothing(new, new.x0, ahead) == pytest.approx(0.1 * changes.ALIKE) and math.isfinite(size)
