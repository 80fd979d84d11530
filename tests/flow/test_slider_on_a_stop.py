"""A slider beside a rigid stop: after an impact in which it slipped it reaches its limit at the stop again, in every further one.

Which of the two zeros comes first is rounding; a slip that the impact turns round in the same instant is no event.
"""
import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.shooting.completion import growth
from bifurc.elements import HarmonicForce, Jenkins, RigidStop

# damping, amplitude, frequency, gap, restitution, stiffness and limit of the slider
CHATTERING = (0.0416, 0.945, 0.5, 0.3, 0.2, 1.5, 0.2)
CASCADE = (0.0352, 1.39, 1.01, 0.565, 0.187, 0.34, 0.13)


def system(damping, amplitude, omega, gap, restitution, stiffness, limit):
    return bf.System(1.0, damping, 1.0, [HarmonicForce(amplitude), RigidStop(gap, restitution), Jenkins(stiffness, limit)],
                     omega=omega)


@pytest.mark.parametrize("gap", [0.2, 0.3, 0.35, 0.45, 0.7])
def test_no_slip_is_told_at_the_instant_of_an_impact(gap):
    """The slider holds its place from the first impact to the release: what a slip would write is what stands there."""
    case = system(*CHATTERING[:3], gap, *CHATTERING[4:])
    motion = bf.simulate(case, y0=np.zeros(3), periods=40)
    times = np.array([event.time for event in motion.events])
    kinds = [(event.element, event.kind.value) for event in motion.events]
    struck = ("rigid_stop", "impact"), ("rigid_stop", "chatter")
    hits = {round(t, 9) for t, kind in zip(times, kinds, strict=True) if kind in struck}
    slips = {round(t, 9) for t, kind in zip(times, kinds, strict=True) if kind == ("jenkins", "slip")}
    assert len(hits) > 40 and slips and not hits & slips


def test_the_slider_stands_where_it_slipped_to_at_the_stop():
    """w = gap - limit / stiffness at every impact that follows another, to rounding."""
    motion = bf.simulate(system(*CHATTERING), y0=np.zeros(3), periods=40)
    hits = [event.element == "rigid_stop" and event.kind.value in ("impact", "chatter") for event in motion.events]
    times = [event.time for one, two, event in zip(hits, hits[1:], motion.events[1:], strict=False) if one and two]
    assert len(times) > 40
    np.testing.assert_allclose([motion(time)[2] for time in times], 0.3 - 0.2 / 1.5, rtol=0, atol=1e-13)


@pytest.mark.parametrize("factor", [-3.0, 0.25])
def test_the_coordinate_of_the_slider_may_be_any_multiple_of_that_of_the_stop(factor):
    """Of factor q it has the stiffness k / factor^2 and the limit R / |factor|: impacts turn it round with the speed they have."""
    damping, amplitude, omega, gap, restitution, stiffness, limit = CHATTERING
    other = bf.System(1.0, damping, 1.0, [HarmonicForce(amplitude), RigidStop(gap, restitution),
                                          Jenkins(stiffness / factor**2, limit / abs(factor), row=(factor,))], omega=omega)
    motion, found = (bf.simulate(case, y0=np.zeros(3), periods=12) for case in (system(*CHATTERING), other))
    assert [str(event.kind) for event in found.events] == [str(event.kind) for event in motion.events] and len(found.events) > 40
    for a, b in zip(found.events, motion.events, strict=True):
        assert a.time == pytest.approx(b.time, abs=1e-9) and a.after / [1.0, 1.0, factor] == pytest.approx(b.after, abs=1e-9)
        if b.element == "rigid_stop":
            assert a.speed == pytest.approx(b.speed, abs=1e-9)


@pytest.mark.parametrize("omega", [0.42, 0.5, 0.58, 0.63])
def test_a_chattering_beside_a_slider_is_found(omega):
    """Which impacts had a slip beside them was chance, and no two periods had the same events."""
    orbit = bf.find_orbit(system(*CHATTERING).with_parameters(omega=omega))
    assert orbit.success and "impact..." in str(orbit) and np.abs(orbit.multipliers).max() < 1.0


def test_impacts_are_born_up_to_a_complete_chattering():
    """Beyond each birth a graze and a fold; their distances to the completion fall by the factor that the closed form of chattering
    says, impact by impact."""
    branch = bf.trace(bf.find_orbit(system(*CASCADE)), "omega", bounds=(0.707, 1.313))
    assert branch.audit.ok and {end.reason.value for end in branch.ends} == {"bound", "chattering"}
    folds = np.array([point.parameter for point in branch.special_points if point.kind.value == "fold"])
    end = next(point.parameter for point in branch.special_points if point.kind.value == "chatter_completion")
    distances = np.sort(folds - end)[:6]
    assert np.all(distances > 0.0)
    np.testing.assert_allclose(distances[1:] / distances[:-1], growth(CASCADE[4]), rtol=0.01)
    row = int(np.flatnonzero(branch.column("omega") > end + 1e-7)[0])  # nearer to the completion rounding decides what is listed
    back = bf.trace(branch.orbits[row], "omega", bounds=(0.707, 1.313))
    kinds = [(point.kind.value, round(point.parameter, 10)) for point in branch.special_points]
    assert sorted(kinds) == sorted((point.kind.value, round(point.parameter, 10)) for point in back.special_points)
