"""Hard and bad questions about curves, atlases and feedback: each has a status, a class or an error that names it.

Others stand beside what they are about: grazings on a stick interval, with a multiplier at 1 or near the unit circle, flat and
double ones in ``continuation/grazing/test_classify.py``; atlases that diverge, hold a continuum or are interrupted in
``atlases/test_atlas.py``; maps under feedback in ``control/test_feedback_basins.py``.
"""
import numpy as np
import pytest

import bifurc as bf


@pytest.fixture(scope="module")
def folds():
    """Return a curve of folds of the Duffing oscillator, through its cusp."""
    branch = bf.trace(bf.find_orbit(bf.systems.duffing_oscillator()), "omega", bounds=(0.5, 2.5))
    return bf.trace_curve(branch.special_points.of("fold")[0], ("omega", "zeta"), bounds=((0.5, 2.5), (0.01, 0.4)))


def test_a_curve_goes_through_its_cusp_and_both_parts_are_folds(folds):
    (cusp,) = folds.special_points.of("cusp")
    s = folds.column("s")
    assert s.min() < cusp.s < s.max()
    for side in (np.flatnonzero(s < cusp.s)[-3], np.flatnonzero(s > cusp.s)[2]):
        multipliers = folds.orbits[int(side)].multipliers
        assert np.abs(multipliers - 1.0).min() < 1e-5


@pytest.mark.parametrize("names", [("omega", "zeta"), ("omega", "amplitude")])
def test_a_point_of_codimension_two_is_no_start_of_a_curve(folds, names):
    (cusp,) = folds.special_points.of("cusp")
    with pytest.raises(ValueError, match="a point of a curve in two parameters already; .* switch_branch"):
        bf.trace_curve(cusp, names, bounds={"omega": (0.5, 2.5), names[1]: (0.01, 0.4)})
    assert "no other curve" in bf.switch_branch(cusp).status


def with_feedback(system, **how):
    """Return a system with a feedback of displacement."""
    feedback = bf.elements.DelayedFeedback(0.04, **how)
    return bf.System(system.mass, system.damping, system.stiffness, (*system.elements, feedback), omega=system.omega)


def test_a_delay_that_is_no_multiple_of_the_period_of_the_orbit():
    """One period for an orbit of one impact in three: the feedback does not vanish on it."""
    system = bf.systems.impact_oscillator(zeta=1.25, omega=2.0, amplitude=5.8309519 * 1.0001, restitution=0.7)
    orbit = bf.find_orbit(system, transient=400)
    assert orbit.success and orbit.periods > 1
    for delay in (None, 0.7):
        with pytest.raises(ValueError, match="whole number"):
            bf.control.feedback_basins(with_feedback(system, **({} if delay is None else {"delay": delay})), orbit,
                                       bf.Grid(q0=(-1, 0, 2), v0=(-1, 1, 2)))
    with pytest.raises(ValueError, match="periods"):
        bf.control.feedback_range(orbit, "displacement", (0.0, 0.1), delay=orbit.periods + 0.5)


@pytest.mark.parametrize("bounds", [(-3.0, -1.0), (20.0, 30.0)])
def test_gains_that_destabilise_a_stable_orbit(bounds):
    orbit = bf.find_orbit(bf.systems.impact_oscillator(omega=2.0, amplitude=6.0, zeta=0.1))
    assert orbit.success and orbit.stable
    found = bf.control.feedback_range(orbit, "displacement", bounds, samples=9)
    assert found.status == "never_stable" and found.best_gain is None and found.intervals == ()
