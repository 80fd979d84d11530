"""Friction dampers and contacts: stated stiffness, thresholds, bad input."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import MicroSlip


def test_both_dampers_have_the_stated_stuck_stiffness():
    macro, micro = (bf.systems.friction_damped_oscillator(damper=damper).elements[1] for damper in ("macro", "micro"))
    assert macro.stiffness == pytest.approx(100.702454, abs=5e-6)
    assert micro.loading(())[2][0] == pytest.approx(macro.stiffness, rel=1e-14)
    assert MicroSlip(25.0 * 18.328497, 18.328497, (50.0 / 15,) * 15).thresholds == pytest.approx(micro.thresholds, rel=1e-12)
    assert sum(micro.limits) == pytest.approx(macro.limit, rel=1e-14) == pytest.approx(50.0)


def test_full_stick_thresholds():
    """The stuck oscillator is linear: its resonance decides. 1007 N (micro, block 1) and 368.851 N (macro)."""
    K = 1e4 + 100.702454
    omega = np.sqrt(K / 1.07 - 0.5 * (0.562 / 1.07) ** 2)
    amplitude = 100.0 / np.hypot(K - 1.07 * omega**2, 0.562 * omega)
    assert amplitude == pytest.approx(1.831392, abs=1e-6)
    for damper, load, rel in (("micro", 1007.0, 1.5e-6), ("macro", 368.851, 1.5e-6)):
        system = bf.systems.friction_damped_oscillator(damper=damper, normal_load=load)
        slider = system.elements[1]
        reach = slider.thresholds[0] if damper == "micro" else slider.limit / slider.stiffness
        assert reach == pytest.approx(amplitude, rel=rel)


@pytest.mark.parametrize("n", [1, 2, 5])
def test_loads_of_the_strip_are_a_parabola_over_its_blocks(n):
    """The end blocks carry load_end, the middle one load_middle, and the strip is the same from both ends."""
    (driven,) = bf.systems.micro_slip_strip(n=n, load_end=30.0, load_middle=6.0, friction=0.5).elements
    limits = driven.element.limits
    assert limits == pytest.approx(limits[::-1], rel=1e-14)
    assert limits == pytest.approx({1: [3.0], 2: [15.0, 15.0], 5: [15.0, 6.0, 3.0, 6.0, 15.0]}[n], rel=1e-14)


@pytest.mark.parametrize("damper", ["macro", "micro"])
def test_the_threshold_of_full_stick_from_both_sides(damper):
    """At the stuck resonance the relaxed oscillator slips just below the threshold, and never above it."""
    threshold = {"macro": 368.851, "micro": 1007.0}[damper]
    K = 1e4 + 100.702454
    omega = float(np.sqrt(K / 1.07 - 0.5 * (0.562 / 1.07) ** 2))
    for factor in (0.999, 1.001):
        system = bf.systems.friction_damped_oscillator(omega=omega, damper=damper, normal_load=factor * threshold)
        linear = bf.System(1.07, 0.562, 1e4 + system.elements[1].loading(())[2][0] if damper == "micro"
                           else 1e4 + system.elements[1].stiffness, system.elements[:1], omega=omega)
        state = bf.find_orbit(linear).state  # the stuck motion: sliders relaxed at rest
        sliders = np.zeros(15 if damper == "micro" else 1)
        motion = bf.simulate(system, np.concatenate((state, sliders)), periods=2)
        assert bool([e for e in motion.events if e.kind == "slip"]) is (factor < 1.0)


@pytest.mark.parametrize("make, words", [
    (lambda: bf.systems.friction_damped_oscillator(damper="none"),
     "damper = 'none' is not allowed; it must be one of 'macro', 'micro'"),
    (lambda: bf.systems.friction_damped_oscillator(n=0), "n = 0 is not allowed; it must be a whole number, at least 1"),
    (lambda: bf.systems.friction_damped_oscillator(normal_load=-1.0), "normal_load = -1.0 is not allowed"),
    (lambda: bf.systems.friction_damped_oscillator(span=0.0), "span = 0.0 is not allowed"),
    (lambda: bf.systems.micro_slip_ring(n=0), "micro_slip_ring: n = 0 is not allowed"),
    (lambda: bf.systems.micro_slip_strip(n=3, loads=(1.0, 2.0)), "loads has 2 numbers; it must be n = 3"),
    (lambda: bf.systems.micro_slip_strip(load_phase=0.2), "load_phase = 0.2 is not allowed with a constant load"),
    (lambda: bf.systems.macro_slip_contact(case=4), "case = 4 is not allowed; it must be one of 1, 2, 3"),
    (lambda: bf.systems.macro_slip_contact(stiffness=0.0), "stiffness = 0.0 is not allowed"),
    (lambda: bf.systems.macro_slip_contact(load=-1.0), "load = -1.0 is not allowed"),
])
def test_bad_input_is_named(make, words):
    with pytest.raises(ValueError, match=words):
        make()


@pytest.mark.parametrize("damper", ["macro", "micro"])
def test_no_load_is_no_damper(damper):
    system = bf.systems.friction_damped_oscillator(omega=96.7, normal_load=0.0, damper=damper)
    orbit = bf.find_orbit(system)
    bare = bf.find_orbit(bf.System(1.07, 0.562, 1e4, system.elements[:1], omega=96.7))
    assert orbit.success and orbit.maximum(0) == pytest.approx(bare.maximum(0), rel=1e-9)
