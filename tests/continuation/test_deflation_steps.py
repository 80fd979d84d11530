"""Deflated Newton steps: their length, what they find, and where they give up."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.deflation import APART, Deflation, deflated_orbits, newton, rings

SCALE = np.array([2.0, 0.25])


def product(u, known):
    return np.prod([1.0 + 1.0 / (((u - r) / SCALE)**2).sum() for r in known])


def test_a_step_is_that_of_the_deflated_equations(rng):
    """Newton's step of M F, its Jacobian by differences, is tau times that of F."""
    A, c = np.array([[1.0, 0.4], [-0.3, 2.0]]), np.array([0.3, -0.7])

    def F(u):
        return A @ u + c + np.array([0.2 * u[0] * u[1], u[0]**2])

    def J(u):
        return A + np.array([[0.2 * u[1], 0.2 * u[0]], [2.0 * u[0], 0.0]])
    known = [np.array([1.0, 0.2]), np.array([-0.5, 0.1])]
    deflation = Deflation(SCALE, known)
    for _ in range(10):
        u = rng.normal(size=2)
        step = -np.linalg.solve(J(u), F(u))
        h = 1e-6
        whole = np.column_stack([(product(u + h * e, known) * F(u + h * e) - product(u - h * e, known) * F(u - h * e)) / (2.0 * h)
                                 for e in np.eye(2)])
        deflated = -np.linalg.solve(whole, product(u, known) * F(u))
        np.testing.assert_allclose(deflation.length(u, step) * step, deflated, rtol=1e-5)
    assert Deflation(SCALE).length(u, step) == 1.0
    assert deflation.length(known[0], step) == 1.0


def test_solutions_are_known_within_their_scale():
    deflation = Deflation(SCALE)
    assert not deflation.has(np.zeros(2))
    u = np.array([1.0, 1.0])
    deflation.add(u)
    u[0] = 9.0  # what was added is a copy
    assert deflation.has(np.array([1.0 + 0.9 * APART * 2.0, 1.0])) and not deflation.has(np.array([1.0 + 1.1 * APART * 2.0, 1.0]))
    assert deflation.has(np.array([1.0, 1.0 + 0.9 * APART * 0.25])) and not deflation.has(np.array([1.0, 1.0 + 1.1 * APART * 0.25]))


def test_all_roots_of_a_quintic_are_found_one_after_the_other():
    roots = np.array([-1.7, -0.4, 0.2, 1.1, 2.3])
    poly = np.poly(roots)

    def equations(u):
        return -np.polyval(poly, u) / np.polyval(np.polyder(poly), u)
    deflation = Deflation(np.ones(1))
    found = []
    for _ in roots:
        u = newton(equations, np.array([0.31]), deflation)
        found.append(float(u[0]))
        deflation.add(u)
    np.testing.assert_allclose(np.sort(found), roots, atol=1e-8)
    assert newton(lambda u: None, np.zeros(1), deflation) is None
    assert newton(lambda u: np.array([np.nan]), np.zeros(1), deflation) is None
    assert newton(lambda u: np.ones(1), np.zeros(1), Deflation(np.ones(1))) is None  # never arrives


def test_long_steps_are_cut_to_one_size_of_the_unknowns():
    seen = []

    def equations(u):
        seen.append(u.copy())
        return np.array([8.0, 0.0]) - u if len(seen) < 9 else None
    newton(equations, np.zeros(2), Deflation(SCALE))
    np.testing.assert_allclose([u[0] for u in seen[:5]], [0.0, 2.0, 4.0, 6.0, 8.0])


def test_guesses_lie_on_rings_in_the_plane_of_the_first_coordinate():
    points, weights = [np.array([1.0, 2.0, 3.0, 4.0]), np.array([5.0, 6.0, 7.0, 8.0])], np.array([2.0, 9.0, 0.5, 9.0])
    found = np.array(list(rings(points, weights)))
    assert found.shape == (3 * 2 * 8, 4)
    away = (found.reshape(3, 2, 8, 4) - np.array(points)[None, :, None]) / weights
    np.testing.assert_allclose(away[..., [1, 3]], 0.0)
    np.testing.assert_allclose(np.hypot(away[..., 0], away[..., 2]), np.array([0.3, 1.0, 2.0])[:, None, None] * np.ones((3, 2, 8)))
    angle = np.arctan2(away[..., 2], away[..., 0])
    np.testing.assert_allclose(np.mod(angle, 2.0 * np.pi), np.broadcast_to(np.pi / 4.0 * np.arange(8), (3, 2, 8)), atol=1e-12)
    assert points[0].tolist() == [1.0, 2.0, 3.0, 4.0]


ROOTS = (-1.7, -0.4, 0.2, 1.1)


def quartic(u, s):
    return -(u + 1.7) * (u + 0.4) * (u - 0.2) * (u - 1.1)


@pytest.mark.parametrize("known", [[], [0.2], [-1.7, 1.1]])
@pytest.mark.parametrize("most", [1, 2, 8])
def test_orbits_of_a_map_are_found_once_each_and_no_more_than_are_wanted(most, known):
    """Damping lets x'' + 3 x' = p(x) repeat itself at rest alone, at the roots of p; those that are known stay away."""
    system = bf.System(1.0, 3.0, 0.0, [bf.elements.Force(quartic)], omega=20.0)
    found = deflated_orbits(system, [bf.find_orbit(system, (q, 0.0)) for q in known], 3,
                            starts=[(q, 0.2) for q in np.linspace(-2.0, 1.5, 15)], most=most)
    places = sorted(orbit.state[0] for orbit in found)
    left = sorted(set(ROOTS) - set(known))
    assert len(places) == min(most, len(left))
    assert all(min(abs(place - root) for root in left) < 1e-8 for place in places)
    assert all(b - a > 0.5 for a, b in zip(places, places[1:], strict=False))
