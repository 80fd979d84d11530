"""Responses of an oscillator with fifteen sliders: every one that begins to slip is a point of the branch, and so is the peak."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import HarmonicForce, MicroSlip


@pytest.fixture(scope="module")
def branch():
    """Return the response of the damped oscillator of Zhao & Lin 2015 at 100 N, up to past its peak."""
    strip = MicroSlip(25.0 * 18.328497, 18.328497, (50.0 / 15,) * 15).iwan()
    system = bf.System(1.07, 0.562, 1e4, [HarmonicForce(100.0), strip], omega=93.0)
    orbit = bf.find_orbit(system, method=bf.HarmonicBalance((1, 3, 5, 7, 9, 11, 13)))
    return bf.trace(orbit, "omega", bounds=(93.0, 97.0), peaks="max_0")


def test_every_slider_begins_to_slip_at_its_own_amplitude(branch):
    """The drive turns where the next slider would begin: a near miss at the very end of a mode."""
    begun = branch.special_points.of("slip_onset")
    sizes = np.interp([point.parameter for point in begun], branch.column("omega"), branch.column("max_0"))
    thresholds = branch.orbits[0].system.elements[1].thresholds
    assert len(begun) == 15
    assert np.allclose(sizes, thresholds, rtol=1e-9)


def test_peak(branch):
    """96.852204 rad/s and 1.282417 m by a half-period map that marches no slider."""
    (peak,) = branch.special_points.of("peak")
    assert peak.parameter == pytest.approx(96.852204, abs=2e-6)
    system = branch.orbits[0].system.with_parameters(omega=float(peak.parameter))
    orbit = bf.find_orbit(system, guess=branch.orbits[-1], method=branch.orbits[0].method)
    assert orbit.maximum(0) == pytest.approx(1.282417, abs=1e-6)
