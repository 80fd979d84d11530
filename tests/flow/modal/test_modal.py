"""Many degrees of freedom: flights in modal coordinates against the tables, against sums over modes, and what they cost."""
import numpy as np
import pytest
import scipy.linalg
from scipy.optimize import brentq, minimize_scalar

import bifurc as bf
from bifurc.compose import modal
from bifurc.compose.scene import scene_of
from bifurc.elements import Coulomb, ElasticStop, HarmonicForce, Jenkins, RigidStop
from studies.many_degrees import beam

FORCE = HarmonicForce(1.0, dof=0)


def chain(n, *elements, damping=0.01, omega=1.3):
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    return bf.System(np.eye(n), damping * K, K, [FORCE, *elements], omega=omega)


def rest(system):
    return np.zeros(2 * system.n + sum(len(element.memory) for element in system.elements))


def by_tables(monkeypatch, system, **length):
    """Simulate without modal coordinates."""
    with monkeypatch.context() as patch:
        patch.setattr("bifurc.flow.simulate.give_modal", lambda tables: None)
        scene_of(system).tables.blocks[:] = 0
        motion = bf.simulate(system, rest(system), **length)
        assert not scene_of(system).tables.blocks[:, 3].any()
    return motion


CHAINS = {
    "stop": chain(5, RigidStop(0.6, 0.7, dof=4)),
    "stop, slider, friction": chain(8, RigidStop(0.6, 0.5, dof=7), Jenkins(2.0, 0.3, dof=1), Coulomb(0.05, dof=2)),
    "plastic and elastic stop": chain(10, RigidStop(0.3, 0.0, dof=9), ElasticStop(0.4, 5.0, dof=1)),
    "undamped at resonance": chain(6, RigidStop(1.5, 0.8, dof=5), damping=0.0, omega=2.0 * np.sin(np.pi / 14.0)),
    "critically damped": chain(5, RigidStop(0.005, 0.6, dof=4), damping=2.0),
}


@pytest.mark.parametrize("name", CHAINS)
def test_motions_are_those_of_the_tables(name, monkeypatch):
    system = CHAINS[name]
    old = by_tables(monkeypatch, system, periods=10)
    new = bf.simulate(system, rest(system), periods=10)
    assert (scene_of(system).tables.blocks[:, 3] > 0).all()
    assert len(new.events) > 5
    assert [(e.kind, e.element) for e in new.events] == [(e.kind, e.element) for e in old.events]
    np.testing.assert_allclose([e.time for e in new.events], [e.time for e in old.events], rtol=0.0, atol=1e-11)
    times = np.linspace(0.0, new.stop, 101)
    np.testing.assert_allclose(new(times), old(times), rtol=0.0, atol=1e-10)


def test_free_masses_and_constant_forces():
    """A free chain that drifts: the slow block holds positions, speeds and the constant together."""
    n = 6
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    K[0, 0] = K[-1, -1] = 1.0
    system = bf.System(np.eye(n), 0.02 * K, K, [FORCE, bf.elements.ConstantForce(0.3, dof=3)], omega=0.7)
    y = np.concatenate([np.linspace(0.0, 1.0, n), np.full(n, 0.25)])
    motion = bf.simulate(system, y, periods=3)
    T, t = scene_of(system).tables, motion.stop
    assert T.blocks[0, 2] == 3 and T.blocks[0, 3] > 0
    centre = y[:n].mean() + 0.25 * t + 0.5 * 0.3 / n * t**2 + (1.0 - np.cos(0.7 * t)) / (n * 0.7**2)
    assert motion.final[:n].mean() == pytest.approx(centre, rel=1e-12)
    generator = np.zeros((2 * n + 3, 2 * n + 3))
    generator[:2 * n] = T.A[0]
    generator[-1, -2], generator[-2, -1] = 0.7, -0.7
    np.testing.assert_allclose(motion.final, (scipy.linalg.expm(generator * t) @ np.concatenate([y, [1.0, 1.0, 0.0]]))[:2 * n],
                               rtol=0.0, atol=1e-10)


def modal_impacts(system, gap, restitution, count):
    """Return the times of the first impacts of a beam from rest: sums over its modes, sampled, roots by Brent's method."""
    w2, Phi = scipy.linalg.eigh(system.stiffness, system.mass)
    w, omega = np.sqrt(w2), system.omega
    zeta = np.diagonal(Phi.T @ system.damping @ Phi) / (2.0 * w)
    tip = Phi[system.n - 2]
    steady = tip / (w2 - omega**2 + 2j * zeta * w * omega)
    rate = w * (-zeta + 1j * np.sqrt(1.0 - zeta**2))
    eta, speed, now, found = np.zeros(system.n), np.zeros(system.n), 0.0, []
    while len(found) < count:
        turned = steady * np.exp(1j * omega * now)
        q, v = eta - turned.real, speed - (1j * omega * turned).real
        c = q - 1j * (v - rate.real * q) / rate.imag  # q(t) = Re(c exp(rate t))

        def place(t, c=c, now=now, order=0):
            return ((rate**order * c * np.exp(np.multiply.outer(t, rate))).real
                    + ((1j * omega)**order * steady * np.exp(1j * omega * (now + np.asarray(t)))[..., None]).real)

        begin, step = 0.0 if not found else 1e-9, 4e-6 if found else 1e-4
        while True:
            times = begin + step * np.arange(1001)
            above = np.flatnonzero(place(times) @ tip > gap)
            if above.size:
                break
            begin = times[-1]
        t = brentq(lambda s, place=place: place(s) @ tip - gap, times[above[0] - 1], times[above[0]], xtol=1e-15, rtol=1e-14)
        eta, speed = place(t), place(t, order=1)
        speed = speed - (1.0 + restitution) * (speed @ tip) * tip / (tip @ tip)
        now += t
        found.append(now)
    return np.array(found)


def test_impacts_of_a_beam_against_sums_over_its_modes():
    system = beam(20)
    motion = bf.simulate(system, rest(system), duration=0.236)
    times = modal_impacts(system, 0.1, 0.7, 20)
    assert len(motion.events) >= 20
    np.testing.assert_allclose([e.time for e in motion.events[:20]], times, rtol=0.0, atol=2e-9)


def test_overdamped_modes_cost_nothing():
    """Stiffness-proportional damping: the fastest mode decays a million times a period, 4e8 steps of the tables."""
    system = beam(20, damping="stiffness")
    motion = bf.simulate(system, rest(system), periods=1)
    T = scene_of(system).tables
    assert motion.success and system.period / T.step[0] > 1e8 and len(motion.events) > 50
    later = bf.simulate(system, motion.final, duration=0.01, t0=system.period)
    assert later.success


@pytest.mark.parametrize("m", [0, 1])
def test_coordinates_turn_with_the_eigenvalues(m):
    system = beam(4)
    T = scene_of(system).tables
    V, pairs, decays, block, _ = modal.separated(T, m)
    blocks = [np.array([[z.real, -z.imag], [z.imag, z.real]]) for z in pairs]
    turning = scipy.linalg.block_diag(*blocks, *decays, block)
    generator = np.zeros_like(turning)
    generator[:T.A.shape[1]] = T.A[m]
    generator[-1, -2], generator[-2, -1] = system.omega, -system.omega
    sizes = np.abs(generator) @ np.abs(V) + np.abs(V) @ np.abs(turning)
    assert np.all(np.abs(generator @ V - V @ turning).max(axis=1) <= 1e-11 * sizes.max(axis=1))


@pytest.mark.parametrize("depth", [1e-2, 1e-4, 1e-6])
def test_no_peak_that_reaches_a_stop_is_passed_over(depth):
    """Undamped chains from random states, sums over their modes: the stop lies a little below the highest of their peaks."""
    n, times, rng = 6, np.linspace(0.0, 30.0, 6001), np.random.default_rng(8)
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    w2, Phi = scipy.linalg.eigh(K)
    w = np.sqrt(w2)
    for _ in range(12):
        q, v = rng.normal(size=n), rng.normal(size=n)
        a, b = Phi[2] * (Phi.T @ q), Phi[2] * (Phi.T @ v) / w

        def place(t, a=a, b=b):
            angle = np.multiply.outer(t, w)
            return np.cos(angle) @ a + np.sin(angle) @ b
        found = place(times)
        k = int(np.argmax(found))
        top = minimize_scalar(lambda t, place=place: -place(t), bounds=times[[max(k - 1, 0), min(k + 1, 6000)]],
                              options={"xatol": 1e-12}, method="bounded")
        gap = -top.fun - depth
        if found[0] > gap - 0.1 or not 0 < k < 6000:
            continue
        above = np.flatnonzero(found > gap)  # none where the peak is narrower than the samples
        low, high = times[[above[0] - 1, above[0]]] if above.size else (top.x - 0.1, top.x)
        near = brentq(lambda t, place=place, gap=gap: place(t) - gap, low, high, xtol=1e-14)
        system = bf.System(np.eye(n), np.zeros((n, n)), K, [RigidStop(gap, 0.5, dof=2)])
        motion = bf.simulate(system, np.concatenate([q, v]), duration=30.0, max_events=1000)
        assert motion.events and motion.events[0].time == pytest.approx(near, abs=1e-9 / depth**0.5)
