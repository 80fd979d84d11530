"""Chains and planar contacts under loads that vary: against implicit marches, the exact flow, constant loads, tables."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import Driven, HarmonicForce, LoadedMicroSlip, MicroSlip
from studies.planar_hysteresis import planar_hysteresis
from tests.reference import microslip as reference

LIMITS = (0.3, 0.2, 0.5, 0.1, 0.4)
CASES = {
    "common": LoadedMicroSlip(3.0, 1.0, LIMITS, (0.5,) * 5),
    "waves along the bar": LoadedMicroSlip(3.0, 1.0, LIMITS, (0.5, 0.3, 0.8, 0.1, 0.9), (0.0, 1.0, 2.0, 3.0, 4.0)),
    "separation of all": LoadedMicroSlip(3.0, 1.0, LIMITS, (1.5,) * 5, (0.7,) * 5),
    "separation one by one": LoadedMicroSlip(3.0, 1.0, LIMITS, (1.5, 0.3, 1.8, 0.1, 0.9), (0.0, 1.0, 2.0, 3.0, 4.0)),
    "ring, twice a period": LoadedMicroSlip(3.0, 1.0, LIMITS, (1.5, 0.3, 1.8, 1.0, 0.9), (0.0, 1.0, 2.0, 3.0, 4.0), 2, True),
    "one block": LoadedMicroSlip(3.0, 1.0, (0.3,), (1.2,)),
}
each = pytest.mark.parametrize("chain", CASES.values(), ids=CASES.keys())


def bench(element, amplitude=2.0):
    return bf.System(1.0, 0.0, 1.0, [Driven(element, amplitude, phase=-0.5 * np.pi)], omega=1.0)


@each
def test_loop_is_the_limit_of_implicit_steps(chain):
    """Second order in the step when the grid holds all events; the loop has none."""
    loop = bf.hysteresis(bench(chain)).loops[0]
    assert loop.success
    errors = []
    for steps in (500, 1000, 2000):
        turn = np.unique(np.concatenate((np.linspace(0.0, 2.0 * np.pi, steps + 1), [e.angle for e in loop.events])))
        t = np.concatenate((turn, turn[1:] + 2.0 * np.pi, turn[1:] + 4.0 * np.pi))
        waves = np.cos(np.add.outer(chain.load_harmonic * t, chain.load_phases))
        limits = np.array(chain.limits) * (1.0 + np.array(chain.load_amplitudes) * waves)
        force, _ = reference.chain(loop.displacement(t), limits, chain.spring, chain.contact, chain.closed)
        last = t >= 4.0 * np.pi
        errors.append(np.abs(force - loop.force(t))[last].max())
    assert errors[-1] < 2e-6
    assert np.log2(errors[0] / errors[-1]) / 2.0 > 1.5 or errors[0] < 1e-13


@each
def test_the_exact_flow_has_the_same_events(chain):
    system = bench(chain)
    motion = bf.simulate(system, (0.0, 0.0), periods=3)
    assert motion.success
    loop = bf.hysteresis(system).loops[0]
    events = [e for e in motion.events if e.time > 2.0 * system.period - 1e-9 and e.kind != "graze"]
    assert [e.kind for e in events] == [e.kind for e in loop.events]
    assert np.allclose([e.time - 2.0 * system.period for e in events], [e.time for e in loop.events], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("closed", [False, True])
def test_a_variation_that_vanishes_is_a_constant_load(closed):
    """Two ways to the same motion: an order of slip for the whole set, and every contact on its own."""
    found = []
    for chain in (MicroSlip(3.0, 1.0, LIMITS, closed), LoadedMicroSlip(3.0, 1.0, LIMITS, (0.0,) * 5, closed=closed)):
        system = bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.0), chain], omega=1.2)
        motion = bf.simulate(system, (0.3, -0.1), periods=20)
        assert motion.success
        found.append(motion.final)
    assert np.allclose(*found, rtol=0.0, atol=1e-12)


def test_momentum_of_a_mass_on_a_loaded_chain():
    """The exact flow against the force that an implicit march gives for its displacements: second order in the step."""
    chain = CASES["separation one by one"]
    system = bf.System(1.0, 0.2, 1.0, [HarmonicForce(1.0), chain], omega=0.9)
    motion = bf.simulate(system, (0.0, 0.0), periods=3)
    assert motion.success
    misses = []
    for steps in (500, 1000, 2000):
        t = np.unique(np.concatenate((np.linspace(0.0, motion.stop, 3 * steps + 1), [e.time for e in motion.events])))
        y = motion(t)
        waves = np.cos(np.add.outer(0.9 * t, chain.load_phases))
        limits = np.array(chain.limits) * (1.0 + np.array(chain.load_amplitudes) * waves)
        force, _ = reference.chain(y[:, 0], limits, chain.spring, chain.contact)
        total = np.cos(0.9 * t) - 0.2 * y[:, 1] - y[:, 0] - force
        impulse = np.concatenate(([0.0], np.cumsum(0.5 * (total[1:] + total[:-1]) * np.diff(t))))
        misses.append(np.abs(impulse - (y[:, 1] - y[0, 1])).max())
    assert misses[-1] < 1e-5
    assert np.log2(misses[0] / misses[-1]) / 2.0 > 1.5


@pytest.mark.parametrize("rho", [0.5, 1.0, 1.0 + 1e-9, 2.0])
def test_strip_under_a_load_that_touches_zero_or_separates(rho):
    system = bf.systems.micro_slip_strip(n=5, load_amplitude=rho, load_phase=0.4)
    loop = bf.hysteresis(system)["strip"]
    assert loop.success and loop.work > 0.0
    apart = {e.after for e in loop.events} & {"aaaaa"}
    assert bool(apart) is (rho > 1.0)
    if rho > 1.0:
        off = [e.angle for e in loop.events if e.kind == "separation"]
        on = [e.angle for e in loop.events if e.kind == "contact"]
        turn = np.arccos(-1.0 / rho)
        assert off == pytest.approx([turn - 0.4], abs=1e-12 if rho == 2.0 else 1e-6)
        assert on == pytest.approx([2.0 * np.pi - turn - 0.4], abs=1e-12 if rho == 2.0 else 1e-6)
    motion = bf.simulate(system, (0.0, 0.0), periods=3)
    assert motion.success


@pytest.mark.parametrize("case, works", [(1, 90.12018), (2, 43.2691), (3, 212.196)])
def test_planar_contact(case, works):
    loop = planar_hysteresis(bf.systems.macro_slip_contact(case=case))
    assert loop.settled
    assert loop.work == pytest.approx(works, abs=6e-5 if case == 2 else 5e-4 if case == 3 else 1e-5)
    system = bf.systems.macro_slip_contact(case=case)
    contact = system.elements[0].element
    limit = contact.limit * (1.0 + contact.load_amplitude * np.cos(loop.angle + contact.load_phase))
    assert (np.hypot(*loop.force.T) <= np.maximum(limit, 0.0) + 1e-9).all()


@pytest.mark.parametrize("case", [1, 2, 3])
def test_planar_contact_is_the_limit_of_radial_return(case):
    """First order in the step, by halving; extrapolated it agrees."""
    system = bf.systems.macro_slip_contact(case=case)
    contact = system.elements[0].element
    exact = planar_hysteresis(system).work
    x, y = (bf.flow.hysteresis._Integration(system, i) for i in (0, 1))
    works = []
    for steps in (4000, 8000):
        t = np.linspace(0.0, 12.0 * np.pi, 6 * steps + 1)
        u = np.stack([bf.flow.periodic.states(m.harmonics, t) @ m.sums(m.U[0], np.zeros(1))[0] for m in (x, y)], axis=1)
        limit = contact.limit * (1.0 + contact.load_amplitude * np.cos(t + contact.load_phase))
        w, force = u[0], np.zeros_like(u)
        for i in range(t.size):
            f = contact.stiffness * (u[i] - w)
            size = np.hypot(*f)
            f = f * (max(limit[i], 0.0) / size) if size > max(limit[i], 0.0) else f
            w, force[i] = u[i] - f / contact.stiffness, f
        last = slice(5 * steps, None)
        works.append((0.5 * (force[last][1:] + force[last][:-1]) * np.diff(u[last], axis=0)).sum())
    assert 2.0 * works[1] - works[0] == pytest.approx(exact, rel=1e-4)


def test_a_coupled_contact_needs_two_equal_ones():
    with pytest.raises(ValueError, match="no driven Jenkins element 'x'"):
        planar_hysteresis(bf.systems.micro_slip_ring(n=3))


@pytest.mark.parametrize("make, words", [
    (lambda: LoadedMicroSlip(1.0, 1.0, (1.0, 1.0), (0.5,)), r"load_amplitudes = \(0.5,\) is not allowed; .* one a contact"),
    (lambda: LoadedMicroSlip(1.0, 1.0, (), ()), r"limits = \(\) is not allowed"),
    (lambda: LoadedMicroSlip(1.0, 0.0, (1.0,), (0.5,)), "contact = 0.0 is not allowed"),
    (lambda: LoadedMicroSlip(load_harmonic=0), "load_harmonic = 0 is not allowed"),
])
def test_bad_input_is_named(make, words):
    with pytest.raises(ValueError, match=words):
        make()
