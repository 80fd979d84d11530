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


def test_a_curve_of_peaks_goes_on_where_the_contact_sticks_for_good():
    system = bf.systems.friction_damped_oscillator(omega=90.0, normal_load=100.0, damper="macro")
    start = bf.find_orbit(system, method=bf.HarmonicBalance(harmonics=7))
    peak = bf.trace(start, "omega", bounds=(90.0, 104.0), peaks="max_0").special_points.of("peak")[0]
    curve = bf.trace_curve(peak, ("normal_load", "omega"), bounds={"normal_load": (10.0, 1100.0), "omega": (90.0, 104.0)})
    assert [end.reason for end in curve.ends] == ["bound", "bound"]
    best, stuck = curve.special_points
    assert best.kind == "extremum" and abs(best.parameters["normal_load"] - 116.71) < 0.01
    assert stuck.kind == "slip_onset" and abs(stuck.parameters["normal_load"] - 368.851) < 1e-3  # limit of the stuck resonance
    beyond = curve.column("normal_load") > 368.9
    assert beyond.any() and np.ptp(curve.column("max_0")[beyond]) < 1e-9  # the load does not matter any more
    assert abs(curve.column("max_0")[beyond][0] - 1.831392) < 1e-6


@pytest.fixture(scope="module")
def micro():
    """Return the response with the micro-slip damper of the ready system at 100 N, up its peak and down again."""
    system = bf.systems.friction_damped_oscillator(omega=94.0, normal_load=100.0, damper="micro")
    orbit = bf.find_orbit(system, method=bf.HarmonicBalance((1, 3, 5, 7)))
    return bf.trace(orbit, "omega", bounds=(94.0, 100.0), peaks="max_0")


def test_every_slider_sticks_again_at_the_amplitude_at_which_it_began_to_slip(micro):
    assert [str(reason) for reason in micro.stop_reason] == ["bound", "bound"]
    onsets = micro.special_points.of("slip_onset")
    (peak,) = micro.special_points.of("peak")
    thresholds = micro.orbits[0].system.elements[-1].thresholds
    for name, there in (("birth", [p for p in onsets if p.parameter < peak.parameter]),
                        ("death", [p for p in onsets if p.parameter > peak.parameter])):
        assert {point.name for point in there} == {name} and len(there) == 15
        assert np.allclose(np.sort([point.measures["max_0"] for point in there]), thresholds, rtol=1e-8)


@pytest.mark.slow
def test_peaks_of_the_micro_slip_damper_from_10_to_1100_newton(micro):
    """Zhao & Lin 2015, figure 12: optimum, the load of full stick, and heights by a half-period map that marches no slider."""
    (peak,) = micro.special_points.of("peak")

    def peaks(low, high):
        return bf.trace_curve(peak, ("normal_load", "omega"), bounds={"normal_load": (low, high), "omega": (90.0, 104.0)})

    curve, ends = peaks(10.0, 1100.0), {100.0: peak.measures["max_0"]}
    assert [str(end.reason) for end in curve.ends] == ["bound", "bound"]
    best, *onsets = curve.special_points
    assert best.kind == "extremum" and best.measures["max_0"] == pytest.approx(1.281491, abs=1e-6)
    assert best.parameters["normal_load"] == pytest.approx(95.3, abs=0.05)
    assert len(onsets) == 15 and onsets[-1].parameters["normal_load"] == pytest.approx(1007.0, abs=1e-3)
    for part, bounds in ((curve, (10.0, 1100.0)), (peaks(99.0, 150.0), (150.0,)), (peaks(99.0, 600.0), (600.0,)),
                         (peaks(99.0, 1000.0), (1000.0,))):  # a curve ends on its bounds
        load, height = part.column("normal_load"), part.column("max_0")
        ends |= {bound: float(height[load == bound].item()) for bound in bounds}
    for load, known in ((10.0, 1.727928), (100.0, 1.282417), (150.0, 1.362148), (600.0, 1.611970), (1000.0, 1.827594),
                        (1100.0, 1.831392)):
        assert ends[load] == pytest.approx(known, abs=1e-6)
