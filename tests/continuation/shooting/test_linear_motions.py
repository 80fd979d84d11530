"""Linear motions, whose multipliers exp(lambda T) turn many times between two rows: what is hidden there, in closed form."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.shooting.linear import LinearMotion
from bifurc.continuation.shooting.problem import orbit_problem
from bifurc.elements import HarmonicForce
from bifurc.system import builder


def chain(n):
    """Return the stiffness of a chain between two walls, its modes (columns) and their frequencies."""
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    squares, modes = np.linalg.eigh(K)
    return K, modes, np.sqrt(squares)


@builder
def softened(*, p=0.0, n=4, omega=0.05, place=0.5, window=1e-4, damping=0.02):
    """Chain of which the first mode has the stiffness (p - place)^2 - window."""
    K, modes, w = chain(n)
    K = K + ((p - place)**2 - window - w[0]**2) * np.outer(modes[:, 0], modes[:, 0])
    return bf.System(np.eye(n), damping * np.eye(n), K, load(modes), omega=omega)


def load(modes):
    """Return a load on the second mode alone, row of forces."""
    return [HarmonicForce(1.0, row=tuple(modes[:, 1]))]


@builder
def undamped_mode(*, p=0.0, n=4, omega=0.05, place=0.5, window=1e-4, damping=0.02, mode=0):
    """Chain of which one mode has the damping (p - place)^2 - window."""
    K, modes, _ = chain(n)
    C = damping * np.eye(n) + ((p - place)**2 - window - damping) * np.outer(modes[:, mode], modes[:, mode])
    return bf.System(np.eye(n), C, K, load(modes), omega=omega)


def traced(system, bounds=(0.0, 1.0)):
    orbit = bf.find_orbit(system, np.zeros(2 * system.n))
    assert orbit.success
    branch = bf.trace(orbit, "p", bounds=bounds)
    assert branch.stop_reason == ("bound", "bound")
    return branch


@pytest.mark.parametrize("build, kind", [(softened, "branch_point"), (undamped_mode, "neimark_sacker")])
@pytest.mark.parametrize("n, omega, place, window", [(2, 0.31, 0.52, 1e-4), (4, 0.05, 0.5, 1e-4), (12, 0.02, 0.383, 4e-4),
                                                     (4, 0.05, 0.61, 1e-6)])
def test_two_points_between_two_rows_are_found(build, kind, n, omega, place, window):
    """A number of the structure is (p - place)^2 - window: it is negative for a few hundredths of the way and less."""
    branch = traced(build(n=n, omega=omega, place=place, window=window))
    points = branch.special_points
    assert {point.kind.value for point in points} == {kind}
    expected = place + np.sqrt(window) * np.array([-1.0, 1.0])
    np.testing.assert_allclose([point.parameter for point in points], expected, atol=1e-7)
    assert all(abs(point.parameter - p) <= point.error for point, p in zip(points, expected, strict=True))
    assert not branch.unresolved


@pytest.mark.parametrize("build", [softened, undamped_mode])
@pytest.mark.parametrize("n, omega, place, window", [(2, 0.31, 0.52, -1e-4), (4, 0.05, 0.5, -1e-4), (12, 0.02, 0.37, -1e-6)])
def test_nothing_is_found_where_a_number_only_comes_near_to_zero(build, n, omega, place, window):
    branch = traced(build(n=n, omega=omega, place=place, window=window))
    assert not branch.special_points and not branch.unresolved


def test_tests_of_determinants_have_the_signs_of_their_products_of_multipliers():
    """Against det(1 - M) and prod(1 - mu_i mu_j) themselves, M = exp(A T), for matrices without any structure."""
    random = np.random.default_rng(4)
    for _ in range(20):
        n, omega = int(random.integers(2, 5)), float(random.uniform(0.3, 3.0))
        K, C = random.normal(size=(n, n)), 0.5 * random.normal(size=(n, n))
        A = np.block([[np.zeros((n, n)), np.eye(n)], [-K, -C]])
        system = bf.System(np.eye(n), C, K, [HarmonicForce(1.0)], omega=omega)
        problem = problem_of(system)
        made = LinearMotion(problem.equations, problem.sequence, omega)
        mu = np.exp(np.linalg.eigvals(A) * 2.0 * np.pi / omega)
        i, j = np.triu_indices(2 * n, 1)
        test, pairs = made.tests(omega)
        assert np.sign(pairs) == np.sign(np.prod(1.0 - mu[i] * mu[j]).real)
        assert test == 0.5 if problem.sequence.closure > 0 else np.sign(test) == np.sign(np.linalg.det(K))
        np.testing.assert_allclose(np.sort(np.abs(made.without_angles(omega))), np.sort(np.abs(mu)), rtol=1e-9)


def problem_of(system):
    """Return the continuation problem in omega of the response of a linear system, stable or not, from its closed form."""
    n, omega = system.n, system.omega
    q = np.linalg.solve(system.stiffness - omega**2 * np.eye(n) + 1j * omega * system.damping, np.eye(n)[0])
    orbit = bf.find_orbit(system, np.append(q.real, (1j * omega * q).real))
    assert orbit.success
    return orbit_problem(orbit, "omega", (0.9 * omega, 1.1 * omega))


def test_an_orbit_found_from_rest_has_the_size_of_its_motion():
    """Rounding is left of a start at rest in modal coordinates: its size says nothing of the orbit."""
    n, omega = 8, 0.02
    system = bf.System(np.eye(n), 0.02 * np.eye(n), chain(n)[0], [HarmonicForce(1e-9)], omega=omega)
    orbit = bf.find_orbit(system, np.zeros(2 * n))
    q = np.linalg.solve(chain(n)[0] + (0.02j * omega - omega**2) * np.eye(n), 1e-9 * np.eye(n)[0])
    assert 0.1 < orbit.weights[0] / np.abs(q).max() < 10.0
    np.testing.assert_allclose(orbit.state, np.append(q.real, (1j * omega * q).real), rtol=0.0, atol=1e-21)


@pytest.mark.parametrize("n, omega, high", [(3, 0.05, 0.1), (6, 0.02, 0.05)])
def test_free_vibrations_that_the_load_does_not_excite_are_no_special_points(n, omega, high):
    """Without damping det(1 - M) touches zero wherever a frequency is a multiple of omega, dozens of times between two rows, and
    changes its sign nowhere."""
    system = bf.System(np.eye(n), np.zeros((n, n)), chain(n)[0], [HarmonicForce(1.0)], omega=omega)
    orbit = bf.find_orbit(system, np.zeros(2 * n))
    branch = bf.trace(orbit, "omega", bounds=(omega, high), max_steps=40)
    assert len(branch) > 5 and not branch.special_points and not branch.unresolved
    for x in (branch.x(i) for i in range(0, len(branch), 4)):
        q = np.linalg.solve(chain(n)[0] - x[-1]**2 * np.eye(n), np.eye(n)[0])
        np.testing.assert_allclose(x[1:1 + n], q, atol=1e-8)
