"""Hard cases of friction dampers: tangential limits, loads that touch zero or separate, the edge of full stick."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import Driven, Jenkins, LoadedMicroSlip
from tests.reference import microslip as reference


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_yang_case_1_y_touches_both_limits_and_stays_stuck(angle):
    """The force of y touches both limits with zero rate once a period: degenerate, the answer is stick with work 0."""
    system = bf.systems.macro_slip_contact(case=1)
    loop = bf.hysteresis(system)["y"]
    assert loop.success and loop.events == ()
    assert abs(loop.work) < 1e-13
    contact = system.elements[1].element
    t = np.linspace(0.0, system.period, 1001)
    limit = contact.limit * (1.0 + contact.load_amplitude * np.cos(t))
    assert np.abs(loop.force(t)).max() == pytest.approx(12.5, rel=1e-13)
    assert (limit - np.abs(loop.force(t))).min() == pytest.approx(0.0, abs=1e-12)  # both limits are met, none is crossed
    motion = bf.simulate(system, (0.0, 0.0), periods=4, t0=angle)
    assert motion.success
    late = [e for e in motion.events if e.element == "y" and e.time > angle + system.period]
    assert all(e.speed < 1e-6 for e in late)  # rounding may take a touch for a slip as deep as rounding, not more
    where = motion(np.linspace(angle + system.period, motion.stop, 2001))[:, 3]
    assert np.ptp(where) < 1e-13


@pytest.mark.parametrize("shift", [-1e-6, -1e-9, 1e-9, 1e-6])
def test_a_limit_just_beside_the_touch(shift):
    """y with a limit larger or smaller by a hair: no event, or slip over sqrt(shift)."""
    system = bf.systems.macro_slip_contact(case=1)
    contact = system.elements[1].element
    moved = contact.with_parameters(limit=10.0 * (1.0 + shift))
    loop = bf.hysteresis(bf.System(1.0, 0.0, 1.0, [Driven(moved, 2.0)], omega=1.0)).loops[0]
    assert loop.success
    assert bool(loop.events) is (shift < 0.0)
    assert loop.work >= -1e-14
    if shift < 0.0:
        assert loop.work < 100.0 * abs(shift)


@pytest.mark.parametrize("rho", [1.0, 1.0 + 1e-4,
                                 *(pytest.param(rho, marks=pytest.mark.slow) for rho in (1.0 - 1e-9, 1.0 + 1e-9, 3.0))])
def test_strip_with_a_load_that_touches_zero_or_separates(rho):
    """Each contact at its own phase; force and sliders of an implicit march."""
    n = 6
    strip = LoadedMicroSlip(2.0, 1.0, (0.5, 0.3, 0.4, 0.6, 0.2, 0.3), (rho,) * n, tuple(np.linspace(0.0, 2.0, n)))
    system = bf.System(1.0, 0.0, 1.0, [Driven(strip, 1.5)], omega=1.0)
    loop = bf.hysteresis(system).loops[0]
    assert loop.success and loop.work > 0.0
    assert any("a" in e.after for e in loop.events) is (rho > 1.0)
    turn = np.unique(np.concatenate((np.linspace(0.0, 2.0 * np.pi, 4001), [e.angle for e in loop.events])))
    t = np.concatenate((turn, turn[1:] + 2.0 * np.pi, turn[1:] + 4.0 * np.pi))
    limits = np.array(strip.limits) * (1.0 + rho * np.cos(np.add.outer(t, strip.load_phases)))
    force, _ = reference.chain(loop.displacement(t), limits, strip.spring, strip.contact)
    last = t >= 4.0 * np.pi
    assert np.abs(force - loop.force(t))[last].max() < 5e-7


@pytest.mark.parametrize("load, slips", [(1000.0, True), (1006.0, True), (1006.9, True), (1007.1, False), (1008.0, False),
                                         (1100.0, False)])
def test_the_edge_of_full_stick(load, slips):
    """At the stuck resonance 97.15848 rad/s the first block slips up to 1007 N."""
    omega = float(np.sqrt((1e4 + 100.7024565) / 1.07 - 0.5 * (0.562 / 1.07) ** 2))
    orbit = bf.find_orbit(bf.systems.friction_damped_oscillator(damper="micro", normal_load=load, omega=omega), transient=3000)
    assert orbit.success
    assert bool(orbit.events) is slips
    assert (orbit.maximum(0) < 1.8313922) is slips


def test_a_contact_that_is_always_apart_is_absent():
    contact = Jenkins(1.0, 1.0, load_amplitude=0.0)
    assert bf.hysteresis(bf.System(1.0, 0.0, 1.0, [Driven(contact, 3.0)], omega=1.0)).work > 0.0
    gone = LoadedMicroSlip(1.0, 1.0, (0.0, 0.0), (0.5, 0.5))
    loop = bf.hysteresis(bf.System(1.0, 0.0, 1.0, [Driven(gone, 3.0)], omega=1.0)).loops[0]
    assert loop.success and loop.work == 0.0 and loop.force_max == 0.0
