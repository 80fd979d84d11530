"""What orbits are made of, piece by piece: energy, first Lyapunov coefficient, multipliers without the trivial one, trains."""
import dataclasses

import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import ElasticStop
from bifurc.orbits.equilibria.hopf import Forms, _coefficient, critical_pair
from bifurc.orbits.least import mark_trains
from bifurc.orbits.multipliers import without
from bifurc.orbits.orbit import PeriodicOrbit
from bifurc.orbits.shooting.signature import divided


def test_a_free_motion_of_coupled_masses_keeps_its_energy():
    """Two masses with a coupling spring and an elastic stop, no damping."""
    system = bf.System(np.diag([1.0, 1.7]), np.zeros((2, 2)), [[2.0, -0.9], [-0.9, 1.4]], [ElasticStop(0.3, 6.0)])
    motion = bf.simulate(system, (0.1, -0.4, 0.5, 0.2), duration=20.0)
    assert any(event.kind == "contact" for event in motion.events)
    energies = [bf.energy(system, y) for y in motion(np.linspace(0.0, 20.0, 41))]
    np.testing.assert_allclose(energies, energies[0], rtol=1e-11)


def test_the_gradient_of_the_energy_counts_gyroscopic_terms():
    """Against differences of the energy; the multipliers left without the two trivial ones have the trace of the matrix less 2."""
    system = bf.System(np.diag([1.0, 1.7]), [[0.0, -0.6], [0.6, 0.0]], [[1.0, -0.2], [-0.2, 2.0]], [ElasticStop(0.3, 4.0)])
    orbit = bf.nonlinear_mode(system, 0, energy=0.8)
    assert orbit.success and orbit.energy == pytest.approx(0.8, rel=1e-12)
    y = orbit._unknowns[1:5]  # just before the first event, where the gradient is asked for
    differences = [(bf.energy(system, y + 1e-6 * e) - bf.energy(system, y - 1e-6 * e)) / 2e-6 for e in np.eye(4)]
    np.testing.assert_allclose(orbit._energy_gradient, differences, atol=5e-6)  # the spring's energy has a kink in its slope here
    assert orbit.multipliers.size == 2
    np.testing.assert_allclose(np.abs(orbit.multipliers), 1.0, atol=1e-9)
    assert orbit.multipliers.sum() == pytest.approx(np.trace(orbit.monodromy) - 2.0, abs=1e-9)


def test_first_lyapunov_coefficient_of_a_plane_field_with_quadratic_terms(rng):
    """Against the formula for x' = -w y + f, y' = w x + g (Guckenheimer & Holmes 1983, eq. 3.4.11)."""
    w = 1.3
    fxx, fxy, fyy, gxx, gxy, gyy, fxxx, fxyy, gxxy, gyyy = rng.normal(size=10)

    def field(c):
        x, y = c
        f = fxx * x * x / 2.0 + fxy * x * y + fyy * y * y / 2.0 + fxxx * x**3 / 6.0 + fxyy * x * y * y / 2.0
        g = gxx * x * x / 2.0 + gxy * x * y + gyy * y * y / 2.0 + gxxy * x * x * y / 2.0 + gyyy * y**3 / 6.0
        return np.array([-w * y + f, w * x + g])

    A = np.array([[0.0, -w], [w, 0.0]])
    omega, q, p = critical_pair(A)
    found = _coefficient(Forms(field, 2, 0.5), A, omega, q, p) / (4.0 * abs(q[0])**2)
    exact = (fxxx + fxyy + gxxy + gyyy) / 16.0 + (fxy * (fxx + fyy) - gxy * (gxx + gyy) - fxx * gxx + fyy * gyy) / (16.0 * w)
    assert found == pytest.approx(exact, rel=1e-9)


def test_multipliers_without_the_trivial_one_depend_on_no_weights(rng):
    """M f = f: the other eigenvalues are left, however the states are measured."""
    basis = rng.normal(size=(4, 4))
    M = basis @ np.diag([1.0, 0.7, -0.4, 0.2]) @ np.linalg.inv(basis)
    for weights in (np.ones(4), np.array([1e-2, 1.0, 30.0, 5.0])):
        found = np.sort(np.linalg.eigvals(without(M, basis[:, 0], weights)).real)
        np.testing.assert_allclose(found, [-0.4, 0.2, 0.7], rtol=0, atol=1e-10)


def test_a_train_is_of_falling_speeds():
    """Impacts that lead to the end of a complete chattering become slower; a slower one before a faster one is no part of it."""
    nodes = np.array([[0, 0, 0, 0, 0]] * 4 + [[0, 0, 1, 0, 1], [1, 0, 0, 0, 0]])
    mark_trains(nodes, np.array([0.1, 0.8, 0.4, 0.2, 0.1, 0.0]))
    assert nodes[:, 4].tolist() == [0, 2, 2, 2, 1, 0]


def test_a_train_falls_by_one_factor():
    """An impact that is faster than the next, but not by the factor of those behind it, may still become a graze: it is watched."""
    nodes = np.array([[0, 0, 0, 0, 0]] * 4 + [[0, 0, 1, 0, 1], [1, 0, 0, 0, 0]])
    mark_trains(nodes, np.array([0.9, 0.8, 0.4, 0.21, 0.1, 0.0]))
    assert nodes[:, 4].tolist() == [0, 2, 2, 2, 1, 0]


@pytest.mark.parametrize("late", [-1e-17, 0.0, 1e-17, 1.0 - 1e-16, -1.0])
def test_an_event_at_phase_zero_is_the_first_of_the_period(late):
    """Whole periods and rounding do not make it the last."""
    system = bf.systems.impact_oscillator(omega=1.5, amplitude=0.9)
    orbit = bf.find_orbit(system, guess=(1.0, 0.2))
    tau = orbit.unknowns[0]
    shifted = bf.System(system.mass, system.damping, system.stiffness, [
        dataclasses.replace(e, phase=e.phase + 2.0 * np.pi * tau) if isinstance(e, bf.elements.HarmonicForce) else e
        for e in system.elements], omega=system.omega)
    moved = bf.find_orbit(shifted, guess=orbit._states(np.array([tau + 1e-3]))[0])
    assert moved.success and len(moved.events) == len(orbit.events) == 1
    unknowns = moved.unknowns
    unknowns[0] = late
    made = PeriodicOrbit(shifted, moved.sequence, unknowns, moved.weights)
    assert 0.0 <= made.events[0].time < 1e-15 and made.events[0].speed == pytest.approx(orbit.events[0].speed, rel=1e-10)


def test_what_is_kept_of_sequences_is_that_of_their_scene():
    """Of another scene, and after modes were met, it is found anew; what was given is not changed by who got it."""
    system = bf.systems.jenkins_oscillator()
    orbit = bf.find_orbit(system)
    scene, nodes, closure = orbit.scene, orbit.sequence.nodes, orbit.closure
    anew = divided(scene, nodes, scene.tables, closure)
    first = divided(scene, nodes, closure=closure)
    assert np.array_equal(first, anew)
    first[:] = -7
    assert np.array_equal(divided(scene, nodes, closure=closure), anew)
    assert scene.divisions and not scene.at(system.with_parameters(limit=0.5)).divisions
