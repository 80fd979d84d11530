"""Natural length, rate and time of a scene in other units, and Taylor terms of forced rows against the exponential of a matrix."""
import math

import numpy as np
import pytest
from scipy.linalg import expm

import bifurc as bf
from bifurc.compose.natural import natural_length, natural_rate
from bifurc.compose.scene import scene_of
from bifurc.compose.tables import forced_terms, next_term, rate, unit_of_time
from bifurc.elements import Coulomb, HarmonicForce, RigidStop
from tests.reference.images import in_units


def systems():
    return {
        "stop": bf.System(2.0, 0.1, 3.0, (HarmonicForce(0.7), RigidStop(0.4, 0.8)), omega=1.3),
        "two stops": bf.System(np.diag([2.0, 1.0]), 0.1 * np.eye(2), np.array([[3.0, -1.0], [-1.0, 2.0]]),
                               (RigidStop(0.4, 0.8, dof=0), RigidStop(0.9, 0.7, dof=1), HarmonicForce(0.2, dof=1)), omega=0.7),
        "rubbing": bf.System(2.0, 0.1, 3.0, (HarmonicForce(0.7), Coulomb(0.2)), omega=1.3),
    }


@pytest.mark.parametrize("name", systems())
@pytest.mark.parametrize("units", [{"length": 1e-6}, {"time": 1e3}, {"mass": 1e5}, {"length": 30.0, "time": 0.02, "mass": 1e-3}])
def test_length_and_rate_have_their_units(name, units):
    system = systems()[name]
    scene, other = scene_of(system), scene_of(in_units(system, **units).system)
    length, time = units.get("length", 1.0), units.get("time", 1.0)
    ratio = natural_length(other.tables) / natural_length(scene.tables)
    assert min(abs(ratio / length - 1.0), abs(ratio * length - 1.0)) < 1e-12
    ratio = natural_rate(other.tables) / natural_rate(scene.tables)
    assert min(abs(ratio / time - 1.0), abs(ratio * time - 1.0)) < 1e-12


def test_the_largest_length_counts():
    """A clearance, or what a load moves at the rate of the excitation."""
    def length(*elements, omega=2.0):
        return natural_length(scene_of(bf.System(1.0, 0.0, 0.0, elements, omega=omega)).tables)

    assert length(RigidStop(0.4, 0.8)) == pytest.approx(0.4)
    assert length(RigidStop(0.4, 0.8), RigidStop(0.9, 0.8, side=-1)) == pytest.approx(0.9)
    assert length(HarmonicForce(20.0), RigidStop(0.4, 0.8)) > length(HarmonicForce(2.0), RigidStop(0.4, 0.8)) >= 0.4


@pytest.mark.parametrize("gap, load", [(0.3, 2.0), (5.0, 1e-4)])
def test_a_load_passes_the_clearance_in_the_unit_of_time(gap, load):
    """Without springs, dampers and excitation: t = sqrt(gap / (load / mass))."""
    mass = 4.0
    T = scene_of(bf.System(mass, 0.0, 0.0, (bf.elements.ConstantForce(load), RigidStop(gap, 0.5)))).tables
    assert unit_of_time(T) == pytest.approx(math.sqrt(gap * mass / load), rel=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_taylor_terms_are_those_of_the_exponential(seed):
    """Rows of exp(J t) with J = (A; W), harmonics turning as cos' = -k omega sin, sin' = k omega cos."""
    rng = np.random.default_rng(seed)
    ns, harmonics, omega, order = 4, np.array([1.0, 3.0]), 0.7, 9
    nx = ns + 1 + 2 * len(harmonics)
    A = rng.normal(size=(2, ns, nx))
    J = np.zeros((nx, nx))
    J[:ns] = A[1]
    for k, h in enumerate(harmonics):
        c = ns + 1 + 2 * k
        J[c, c + 1], J[c + 1, c] = -h * omega, h * omega
    rows = np.zeros((2, 3, nx, order + 1))
    rows[1, 2, :, 0] = rng.normal(size=nx)
    start = rows[1, 2, :, 0].copy()
    for j in range(1, order + 1):
        next_term(A, harmonics, omega, 1, rows, 2, j, np.empty(nx))
    wanted = np.array([start @ np.linalg.matrix_power(J, j) / math.factorial(j) for j in range(order + 1)]).T
    np.testing.assert_allclose(rows[1, 2], wanted, rtol=1e-12, atol=1e-12)
    t = 0.05
    np.testing.assert_allclose(rows[1, 2] @ t**np.arange(order + 1), start @ expm(J * t), rtol=1e-9)
    for k, h in enumerate(harmonics):
        c = ns + 1 + 2 * k
        row = wanted.copy()
        row[c:c + 2, 1:] = np.nan
        forced_terms(A[1], h * omega, c, row, order + 1)
        np.testing.assert_allclose(row[c:c + 2], wanted[c:c + 2], rtol=1e-12, atol=1e-12)


def test_the_rate_of_a_mode_bounds_its_eigenvalues():
    for name, system in systems().items():
        scene = scene_of(system)
        T = scene.tables
        for m in range(T.n_guards.size):
            fastest = np.abs(np.linalg.eigvals(T.A[m, :, :scene.ns])).max()
            assert fastest * (1.0 - 1e-12) <= rate(T, m) and rate(T, m) >= system.omega, name
