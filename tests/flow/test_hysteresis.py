"""Loops of prescribed motions against closed forms, tables of the literature derived again, and incremental solves."""
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import Driven, HarmonicForce, Iwan, Jenkins, MicroSlip
from bifurc.flow import periodic
from bifurc.flow.hysteresis import LoopStatus, _Integration
from tests.reference import microslip as reference

# specs: works a cycle of Yang's three cases, 1-D contacts under a shared load
WORKS = {1: (40.529433022, 0.0), 2: (31.579636645, 5.192307692), 3: (53.142857143, 157.418896819)}


@pytest.mark.parametrize("case", [1, 2, 3])
def test_yang_work_a_cycle(case):
    loops = bf.hysteresis(bf.systems.macro_slip_contact(case=case))
    assert loops.success
    assert [loop.work for loop in loops.loops] == pytest.approx(WORKS[case], abs=1e-9)
    assert all(loop.periods <= 3 for loop in loops.loops)  # steady after two cycles; one more to see it


def test_yang_transitions():
    x = bf.hysteresis(bf.systems.macro_slip_contact(case=1))["x"]
    keys = [("stick", "slip+"), ("slip+", "stick"), ("stick", "slip-"), ("slip-", "stick")]
    assert [(e.before, e.after) for e in x.events] == keys
    assert [e.angle for e in x.events] == pytest.approx([.4858075299, 1.7359450042, 3.2971028287, 4.5472403030], abs=1e-10)
    x = bf.hysteresis(bf.systems.macro_slip_contact(case=2, omega=3.0))["x"]
    assert [(e.before, e.after) for e in x.events] == [("slip+", "stick"), ("stick", "slip-"), ("slip-", "apart"),
                                                       ("apart", "slip-"), ("slip-", "stick"), ("stick", "slip+")]
    assert [3.0 * e.time for e in x.events] == pytest.approx(
        [1.9655874465, 2.0839277102, 2 * np.pi / 3, 4 * np.pi / 3, 4.3175978607, 6.0151026032], abs=1e-10)


@pytest.mark.parametrize("case", [1, 2, 3])
def test_yang_forces_are_those_of_return_mapping(case):
    system = bf.systems.macro_slip_contact(case=case)
    t = np.linspace(0.0, 3.0 * system.period, 60001)
    for loop in bf.hysteresis(system).loops:
        driven = next(e for e in system.elements if e.label == loop.label)
        contact = driven.element
        limit = contact.limit * (1.0 + contact.load_amplitude * np.cos(t + contact.load_phase))
        force = reference.slider(loop.displacement(t), limit, contact.stiffness)
        last = t >= 2.0 * system.period
        assert np.abs(force - loop.force(t))[last].max() < 3e-7 * contact.stiffness


@pytest.mark.parametrize("system", [bf.systems.macro_slip_contact(case=2), bf.systems.macro_slip_contact(case=3),
                                    bf.systems.micro_slip_strip(n=7), bf.systems.micro_slip_ring(n=4)], ids=repr)
def test_loops_and_the_exact_flow_have_the_same_events(system):
    motion = bf.simulate(system, (0.0, 0.0), periods=3)
    assert motion.success
    for loop in bf.hysteresis(system).loops:
        events = [e for e in motion.events if e.element == loop.label and e.time > 2.0 * system.period - 1e-9]
        assert [e.kind for e in events] == [e.kind for e in loop.events]
        assert np.allclose([e.time - 2.0 * system.period for e in events], [e.time for e in loop.events], rtol=0.0, atol=1e-13)


@pytest.mark.parametrize("n", [1, 3, 5, 15, 41, *(pytest.param(n, marks=pytest.mark.slow) for n in (121, 241))])
def test_ring_area_in_full_slip(n):
    system = bf.systems.micro_slip_ring(n=n)
    p = system.parameters
    area = reference.ring_work(n, p["amplitude"], p["friction"] * p["load"], p["length"], p["modulus"] * p["area"],
                               p["contact"] * p["width"] * p["length"])
    loop = bf.hysteresis(system)["ring"]
    assert loop.work == pytest.approx(area, rel=1e-12)
    assert loop.force_max == pytest.approx(68.5, rel=1e-12)


@pytest.mark.parametrize("contact, work", [(500.0, 24139.7986), (2000.0, 49789.3790)])
def test_ring_of_the_first_example(contact, work):
    """In N/mm and mm, the continuum and its error at n = 15 (3.5e-3 and 1.7e-3)."""
    length, EA, friction = 911.0619, 6.21e7, 68.5
    u_s = friction / contact
    amplitude, span = 0.31, 0.5 * length * np.sqrt(contact / EA)
    def virgin(drive):
        return friction * length * reference.bar_force(drive / u_s, span)

    grid = np.linspace(-amplitude, amplitude, 10001)
    down, up = reference.masing(virgin, grid, amplitude)
    fine = np.trapezoid(up - down, grid)
    assert fine == pytest.approx(work, rel=1e-6)
    block = length / 15
    ring = MicroSlip(EA / block, contact * block, (friction * block,) * 15, closed=True)
    loop = bf.hysteresis(bf.System(1.0, 0.0, 1.0, [Driven(ring, amplitude)], omega=1.0))["micro_slip"]
    assert abs(loop.work / work - 1.0) == pytest.approx({500.0: 3.5e-3, 2000.0: 1.7e-3}[contact], rel=0.05)


def test_strip_of_the_second_example():
    loop = bf.hysteresis(bf.systems.micro_slip_strip())["strip"]
    assert loop.force_max == pytest.approx(69.7764279926, rel=1e-11)
    assert loop.force_min == pytest.approx(-69.7764279926, rel=1e-11)
    assert loop.work == pytest.approx(6.12233955e-3, rel=1e-9)
    slip = np.zeros(15)
    slip[4:10] = 0.0561986e-3, 0.1682211e-3, 0.2288496e-3, 0.2375671e-3, 0.1942013e-3, 0.0989244e-3
    assert np.allclose(loop.slip, slip, rtol=0.0, atol=6e-11)
    element = bf.systems.micro_slip_strip().elements[0].element
    assert [group[0] + 1 for group in element.order[:6]] == [8, 7, 9, 6, 10, 5]


def test_strip_by_its_parallel_set():
    """Force and area a second way: every slider of the equivalent set goes round its own parallelogram."""
    system = bf.systems.micro_slip_strip()
    flat, top = system.elements[0].element.iwan(), system.parameters["amplitude"]
    limits = np.array(flat.limits)
    reach = limits / np.array(flat.stiffnesses)
    loop = bf.hysteresis(system)["strip"]
    assert loop.work == pytest.approx(4.0 * (limits * np.maximum(top - reach, 0.0)).sum(), rel=1e-12)
    assert loop.force_max == pytest.approx(np.minimum(limits, top * np.array(flat.stiffnesses)).sum(), rel=1e-12)


def test_sliders_are_those_of_an_implicit_march(rng):
    """Force and where every contact grips, against a march that solves every step."""
    bar = MicroSlip(3.0, 1.0, tuple(rng.uniform(0.2, 0.6, 6)))
    system = bf.System(1.0, 0.0, 1.0, [Driven(bar, 2.0)], omega=1.0)
    loop = bf.hysteresis(system)["micro_slip"]
    t = np.linspace(0.0, 4.0 * np.pi, 4001)  # holds every reversal: loading in between is path independent
    force, sliders = reference.chain(2.0 * np.cos(t), np.tile(bar.limits, (t.size, 1)), bar.spring, bar.contact)
    assert np.allclose(loop.force(t[2000:]), force[2000:], rtol=0.0, atol=1e-12 * force.max())
    assert np.allclose(loop.sliders(t[2000:]), sliders[2000:], rtol=0.0, atol=1e-11)


@pytest.mark.parametrize("amplitude", [0.1, 0.9, 3.0])
def test_parallel_set_against_return_mapping(amplitude):
    flat = Iwan((1.0, 2.0, 0.5), (0.5, 0.4, 0.9))
    loop = bf.hysteresis(bf.System(1.0, 0.0, 1.0, [Driven(flat, amplitude)], omega=2.0))["iwan"]
    t = np.linspace(0.0, 2.0 * np.pi, 4001)
    u = amplitude * np.cos(2.0 * t)
    force = sum(reference.slider(u, np.full(t.size, most), k) for k, most in zip(flat.stiffnesses, flat.limits, strict=True))
    assert np.allclose(loop.force(t[2000:]), force[2000:], rtol=0.0, atol=1e-12)
    limits, reach = np.array(flat.limits), np.array(flat.limits) / np.array(flat.stiffnesses)
    assert loop.work == pytest.approx(4.0 * (limits * np.maximum(amplitude - reach, 0.0)).sum(), rel=1e-12, abs=1e-14)


def test_what_cannot_be_driven_is_named():
    with pytest.raises(ValueError, match=r"jenkins_oscillator\(.*\) has no element that is driven by a displacement"):
        bf.hysteresis(bf.systems.jenkins_oscillator())
    with pytest.raises(ValueError, match="element = 'z' is not allowed; driven elements of .*: x, y"):
        bf.hysteresis(bf.systems.macro_slip_contact(), "z")
    with pytest.raises(ValueError, match="max_periods = 0"):
        bf.hysteresis(bf.systems.micro_slip_ring(n=2), max_periods=0)
    with pytest.raises(KeyError, match="there are x, y"):
        bf.hysteresis(bf.systems.macro_slip_contact())["z"]
    system = bf.System(1.0, 0.0, 1.0, [HarmonicForce(), Driven(Jenkins())], omega=1.0)
    assert len(bf.hysteresis(system).loops) == 1


def test_a_load_that_never_comes_gives_no_force():
    contact = Jenkins(1.0, 0.0, load_amplitude=0.5)
    loop = bf.hysteresis(bf.System(1.0, 0.0, 1.0, [Driven(contact)], omega=1.0))["jenkins"]
    assert loop.status == LoopStatus.PERIODIC and loop.work == pytest.approx(0.0, abs=1e-14)


@pytest.mark.parametrize("phase", [0.7, 1.2, 2.0])
def test_a_slider_slides_only_while_it_is_loaded(phase):
    """Under the load 1 + 1.5 cos(t + phase) the contact opens, and its slider goes with the mass: that is no slip."""
    contact = Jenkins(2.0, 0.3, load_amplitude=1.5, load_phase=phase)
    loop = bf.hysteresis(bf.System(1.0, 0.0, 1.0, [Driven(contact, 1.0)], omega=1.0))["jenkins"]
    t = np.linspace(0.0, 2.0 * np.pi, 20001)
    where, loaded = loop.sliders(t)[:, 0], 1.0 + 1.5 * np.cos(t + phase) > 0.0
    assert loop.slip == pytest.approx([np.ptp(where[loaded])], abs=1e-3) and loop.slip[0] <= np.ptp(where)
    assert phase != 0.7 or loop.slip[0] < np.ptp(where) - 5e-3


@pytest.mark.parametrize("depth", [0.3, 1e-6, 1e-9])
def test_zeros_that_lie_close_together_are_known_to_rounding(depth):
    """cos k x = 1 - depth: of the companion matrix alone they have half the digits where two are nearly one."""
    for k, harmonics in ((1, (1,)), (3, (2, 3))):
        c = np.zeros(1 + 2 * len(harmonics))
        c[0], c[-2] = depth - 1.0, 1.0
        apart = 2.0 * np.arcsin(np.sqrt(0.5 * depth))
        found = periodic.zeros(harmonics, c)
        for turn in range(k):
            for sign in (-1.0, 1.0):
                away = (found - (2.0 * np.pi * turn + sign * apart) / k + np.pi) % (2.0 * np.pi) - np.pi
                assert np.abs(away).min() < 1e-14 + 4e-16 / apart


@pytest.mark.parametrize("k", [3, 17, 31, 71, 101])
def test_a_high_harmonic_that_touches_zero_is_told_by_its_curvature(k):
    """cos kx - cos x at pi, k odd: value and slope are zero there but for rounding, which grows with the harmonic."""
    for sign in (1, -1):
        assert periodic.sign_after((1, k), sign * np.array([0.0, -1.0, 0.0, 1.0, 0.0]), 0.0, np.pi) == sign


@pytest.mark.parametrize("harmonics", [(1,), (1, 2), (1, 3, 7)])
def test_first_zero_and_integrals_of_sums(rng, harmonics):
    for _ in range(50):
        a, b = rng.normal(size=(2, 1 + 2 * len(harmonics)))
        start = rng.uniform(0.0, 6.0)
        grid = np.linspace(start, start + 2.0 * np.pi, 10001)
        values = periodic.states(harmonics, grid) @ a
        if values[0] < 0.0:
            hit = periodic.first_zero(harmonics, a, abs(a[0]), start, start + 2.0 * np.pi)
            above = np.flatnonzero(values > 0.0)
            assert (hit is None) == (above.size == 0)
            if hit is not None:
                assert grid[above[0] - 1] <= hit <= grid[above[0]]
                assert abs(periodic.states(harmonics, hit) @ a) < 1e-13 * np.abs(a).sum()
        x, weights = np.polynomial.legendre.leggauss(60)
        end = start + 3.0
        at = start + 1.5 * (1.0 + x)
        exact = 1.5 * weights @ ((periodic.states(harmonics, at) @ a) * (periodic.states(harmonics, at) @ b))
        assert periodic.product_integral(harmonics, a, b, start, end) == pytest.approx(exact, abs=1e-12)


def test_sizes_of_constants_are_those_of_the_terms_that_make_them():
    """Of a slider far away the force that is left says nothing of the rounding."""
    rows = np.array([[2.0, -3.0, 5.0, 0.5, 0.25], [1.0, 1.0, -7.0, 0.0, 1.0]])  # two of memory, then the constant and a harmonic
    made = SimpleNamespace(frame=SimpleNamespace(ns=2), z=slice(0, 2))
    c, size = _Integration.sums(made, rows, np.array([10.0, -4.0]))
    np.testing.assert_allclose(c, [[37.0, 0.5, 0.25], [-1.0, 0.0, 1.0]])
    np.testing.assert_allclose(size, [37.0, 21.0])
