"""Extended systems of special points: Jacobians against differences, and zeros that are those of multipliers in closed form."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.certify.arithmetic.balls import middle
from bifurc.certify.arithmetic.forms import Form, Reach
from bifurc.certify.parameter.sequence import along, point_of
from bifurc.certify.parameter.sheet import Sheet
from bifurc.certify.parameter.stretch import between, joined, kind_of
from bifurc.certify.parameter.tube import apart, eye, form_matrix
from bifurc.certify.special import Singular, Torus, Touch
from bifurc.continuation.shooting.problem import orbit_problem

flint = pytest.importorskip("flint")
arb = flint.arb
pytestmark = pytest.mark.usefixtures("bits")


def made(system, name="omega", whole=False):
    value = system.parameter(system.parameter_name(name))
    problem = orbit_problem(bf.find_orbit(system), name, (0.9 * value, 1.1 * value))
    path = along(problem, problem.x0, 0.99 * value, 1.01 * value, whole=whole)
    return problem, path, point_of(path, path.candidate, value)


SYSTEMS = {  # and their damping and load
    "one stop": (lambda: bf.systems.impact_oscillator(omega=0.8), 0.05, 0.52),
    "two stops": (lambda: bf.systems.two_sided_impact_oscillator(zeta=0.1, omega=1.2, amplitude=2.0, restitution=0.7), 0.1, 2.0)}


def floats(F):
    return np.array([middle(v) for v in F])


def differences(evaluate, z, scale, rng):
    """Assert that the Jacobian times a direction is the difference of residuals along it."""
    F, J, _ = evaluate([arb(float(v)) for v in z])
    J = np.array([[middle(v) for v in row] for row in J])
    assert J.shape == (len(F), z.size)
    for _ in range(3):
        d = rng.standard_normal(z.size) * scale
        sides = [evaluate([arb(float(v)) + arb(float(s * w)) * arb(2)**-40 for v, w in zip(z, d, strict=True)])[0]
                 for s in (1.0, -1.0)]
        slope = floats([(a - b) * arb(2)**39 for a, b in zip(*sides, strict=True)])
        np.testing.assert_allclose(J @ d, slope, rtol=1e-7, atol=1e-7 * np.abs(J @ d).max())
    return F


@pytest.mark.parametrize("name", SYSTEMS)
@pytest.mark.parametrize("factor", [1, -1])
def test_a_singular_jacobian_has_a_null_vector(name, factor, rng):
    """The Jacobian is as regular as the monodromy less the factor; with a multiplier as factor its null vector is a solution."""
    problem, path, point = made(SYSTEMS[name][0]())
    system = Singular(path, factor)
    z = system.start(point)
    assert z.size == 2 * path.size + 1 == system.scale.size
    F = floats(system.evaluate([arb(float(v)) for v in z])[0])
    np.testing.assert_allclose(F[:path.size], 0.0, atol=1e-10)
    assert F[-1] == pytest.approx(0.0, abs=1e-12)  # l v = 1
    differences(system.evaluate, z * (1.0 + 1e-3 * rng.standard_normal(z.size)), system.scale * 1e-3, rng)


def test_the_factor_is_a_multiplier_where_the_jacobian_is_singular(rng):
    """Of an overdamped motion: both multipliers are real."""
    problem, path, point = made(bf.systems.impact_oscillator(zeta=1.4, omega=2.0, amplitude=12.0, restitution=0.7))
    assert path.length == 1
    multipliers = problem.solution(problem.x0).multipliers
    assert np.abs(multipliers.imag).max() == 0.0 and np.abs(np.diff(multipliers.real)) > 1e-3
    for mu in multipliers.real:
        system = Singular(path, float(mu))
        F = floats(system.evaluate([arb(float(v)) for v in system.start(point)])[0])
        np.testing.assert_allclose(F, 0.0, atol=1e-9)
        system = Singular(path, float(mu) + 0.1)
        F = floats(system.evaluate([arb(float(v)) for v in system.start(point)])[0])
        assert np.abs(F).max() > 1e-3


def test_a_complex_factor_is_a_multiplier_where_the_jacobian_is_singular(rng):
    problem, path, point = made(bf.systems.impact_oscillator(zeta=0.05, omega=0.7, amplitude=0.1))
    assert not problem.sequence.events
    mu = complex(np.exp((-0.05 + 1j * np.sqrt(1.0 - 0.05**2)) * 2.0 * np.pi / 0.7))
    system = Torus(path, mu)
    assert abs(system.multiplier) == pytest.approx(1.0)
    for value, small in ((mu, True), (mu.conjugate(), True), (1.05 * mu, False), (mu * np.exp(0.05j), False)):
        system.multiplier = value
        z = system.start(point)
        F = floats(system.evaluate([arb(float(v)) for v in z])[0])
        assert (np.abs(F[:-1]).max() < 1e-9) == small
        assert F[-1] == pytest.approx(abs(value)**2 - 1.0, abs=1e-12)
        assert middle(system.evaluate([arb(float(v)) for v in z])[2]) == pytest.approx(value.imag)
    differences(system.evaluate, z * (1.0 + 1e-3 * rng.standard_normal(z.size)), system.scale * 1e-3, rng)


@pytest.mark.parametrize("name", SYSTEMS)
def test_the_rate_of_the_guard_at_an_impact_is_the_speed_that_arrives(name, rng):
    problem, path, point = made(SYSTEMS[name][0](), whole=True)
    for node in range(path.length):
        system = Touch(path, node)
        step = 1 + path.candidate.states.shape[1]
        F, _, further = system.evaluate([arb(float(v)) for v in point])
        omega = point[-1]
        side = 1.0 if point[node * step + 1] > 0.0 else -1.0
        assert middle(F[-1]) == pytest.approx(side * point[node * step + 2] / omega, rel=1e-10)  # per phase
        q, v, t = point[node * step + 1], point[node * step + 2], point[node * step]
        _, zeta, force = SYSTEMS[name]
        a = force * np.cos(t) - 2.0 * zeta * v - q
        assert middle(further) == pytest.approx(side * a / omega**2, rel=1e-9)
        differences(system.evaluate, point, system.scale * 1e-3, rng)


def test_a_sheet_gives_the_matrices_and_slopes_of_the_sequence(rng):
    problem, path, point = made(SYSTEMS["one stop"][0](), whole=True)
    sheet = Sheet(path, point[-1] - 0.01, point[-1] + 0.01)

    def evaluate(z):
        solved, _, J = sheet.evaluate(z)
        return solved.F[0], J, None
    F = differences(evaluate, point, path.scale * 1e-3, rng)
    np.testing.assert_allclose(floats(F), 0.0, atol=1e-10)
    row = np.zeros(point.size)
    row[-1] = 1.0 / path.scale[-1]
    z, tangent, inverse = sheet.corrected(point + 1e-6 * path.scale * rng.standard_normal(point.size) * (row == 0.0), row)
    np.testing.assert_allclose(z, point, atol=1e-9)
    assert row @ tangent == pytest.approx(1.0)
    _, J, _ = evaluate([arb(float(v)) for v in z])
    J = np.array([[middle(v) for v in line] for line in J])
    np.testing.assert_allclose(J @ tangent, 0.0, atol=1e-9 * np.abs(J).max() * np.abs(tangent).max())
    np.testing.assert_allclose(np.vstack([J, row]) @ inverse, np.eye(point.size), atol=1e-8)
    node, other = sheet.node(point, row), None
    assert node is not None and all(abs(middle(b) - v) < 1e-15 for b, v in zip(node.box, node.z, strict=True))
    there = point.copy()
    there[-1] += 1e-3
    other = sheet.node(there, row)
    assert other is not None and other.z[-1] == pytest.approx(there[-1], abs=1e-12)
    part = between(sheet, node, other)
    chord = (other.z - node.z) / path.scale
    share = ((part.z - node.z) / path.scale) @ chord / (chord @ chord)
    assert share == pytest.approx(0.37, abs=1e-6)  # off the middle, in the plane across the chord


def test_places_left_open_are_joined_where_they_meet_for_one_reason():
    fold, flip = "a fold or branch point is near", "a period doubling is near"
    assert joined([(2.0, 3.0, fold), (1.0, 2.0, fold), (3.0, 4.0, flip), (5.0, 6.0, flip)]) == [
        (1.0, 3.0, fold), (3.0, 4.0, flip), (5.0, 6.0, flip)]
    assert joined([(1.0, 4.0, fold), (2.0, 3.0, fold)]) == [(1.0, 4.0, fold)]
    assert joined([]) == [] and kind_of(fold) != kind_of(flip)
    assert len(joined([(1.0, 2.0, fold), (2.1, 3.0, fold)])) == 2


@pytest.mark.parametrize("values, off", [((0.5, -0.3), True), ((0.5, 1.5), True), ((2.0, -3.0), True), ((1.0, 0.2), False),
                                         ((0.5, -1.0), False), ((0.995, 0.1), False), ((1.005, 0.1), False)])
def test_eigenvalues_off_the_unit_circle_over_a_range(values, off, rng):
    """A matrix that changes by .01 d, |d| <= 1, about given eigenvalues."""
    reach = Reach(1.0, 1)
    V = np.array([[1.0, 0.3], [-0.2, 1.0]])
    middle_one = V @ np.diag(values) @ np.linalg.inv(V)
    slope = 0.01 * np.eye(2)
    M = form_matrix(reach, [[Form(reach, arb(float(middle_one[i, j])), arb(float(slope[i, j]))) for j in range(2)]
                            for i in range(2)])
    assert apart(M) == off
    if 1.0 not in np.abs(values):  # without the change it is told
        assert apart(form_matrix(reach, [[arb(float(v)) for v in row] for row in middle_one]))
    assert eye(2)[0, 0] == 1 and eye(2)[1, 0] == 0


def test_a_rotation_inside_the_circle_is_apart_and_one_on_it_is_not():
    reach = Reach(1.0, 1)
    for size, off in ((0.9, True), (1.1, True), (1.0, False)):
        c, s = size * np.cos(1.0), size * np.sin(1.0)
        M = form_matrix(reach, [[arb(float(v)) for v in row] for row in ((c, -s), (s, c))])
        assert apart(M) == off
