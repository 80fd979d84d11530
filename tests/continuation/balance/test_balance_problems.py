"""Problems of harmonic balance: equations, measures, monitors, condensation and records against what they stand for."""

import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.balance.condensed import CondensedProblem, changed_along, condensed_along
from bifurc.continuation.balance.problem import path_over
from bifurc.continuation.balance.start import balance_problem, from_record
from bifurc.elements import ElasticStop, HarmonicForce, Jenkins
from bifurc.hbm.residual import order_of
from bifurc.orbits.balance.method import HarmonicBalance
from bifurc.system import System

M = np.diag([1.0, 1.5, 0.8])
K = np.array([[2.0, -0.7, 0.0], [-0.7, 1.6, -0.5], [0.0, -0.5, 1.4]])
H = 3


def system_of(omega=1.15, load=1.0):
    return System(M, 0.1 * M + 0.05 * K, K, (HarmonicForce(load, dof=0), Jenkins(1.5, 0.4, dof=0), ElasticStop(0.5, 0.5, dof=1)),
                  omega=omega)


@pytest.fixture(scope="module")
def orbit():
    found = bf.find_orbit(system_of(), method=HarmonicBalance(harmonics=H))
    assert found.success
    return found


@pytest.fixture(scope="module", params=["omega", "harmonic_force.amplitude"])
def problem(request, orbit):
    value = orbit.system.parameter(request.param)
    return balance_problem(orbit, request.param, (0.8 * value, 1.2 * value))


def at(problem, p):
    return problem.system.with_parameters(**{problem.parameter: float(p)})


def test_equations_are_those_of_the_balance_at_the_parameter(problem):
    rng = np.random.default_rng(2)
    u = problem.x0[:-1] * (1.0 + 0.02 * rng.standard_normal(problem.size))
    for share in (0.9, 1.0, 1.1):
        p = share * problem.x0[-1]
        whole = problem.whole.at(at(problem, p))
        np.testing.assert_allclose(problem.residual(u, p), whole.residual(u), atol=1e-11)
        fu, fp = problem.jacobian(u, p)
        np.testing.assert_allclose(fu, whole.jacobian(u), atol=1e-10)
        h = 1e-5 * p
        slope = (problem.residual(u, p + h) - problem.residual(u, p - h)) / (2.0 * h)
        np.testing.assert_allclose(fp, slope, atol=1e-6 * max(1.0, np.abs(slope).max()))
    assert np.abs(problem.residual(problem.x0[:-1], problem.x0[-1])).max() < 1e-9


def test_measures_are_those_of_the_motion(problem, orbit):
    xs = np.array([problem.x0, problem.x0 * 1.05])
    theta = np.linspace(0.0, 2.0 * np.pi, 4001)[:-1]
    for dof in range(3):
        values = np.array([orbit.layout.values(x[:-1], theta)[:, dof] for x in xs])
        np.testing.assert_allclose(problem.measure(f"max_{dof}", xs), values.max(axis=1), atol=1e-5)
        np.testing.assert_allclose(problem.measure(f"min_{dof}", xs), values.min(axis=1), atol=1e-5)
        np.testing.assert_allclose(problem.measure(f"rms_{dof}", xs), np.sqrt((values**2).mean(axis=1)), rtol=1e-12)
        first = 2.0 * np.abs((values * np.exp(-1j * theta)).mean(axis=1))
        np.testing.assert_allclose(problem.measure(f"h1_{dof}", xs), first, rtol=1e-12)
        for name in (f"max_{dof}", f"rms_{dof}", f"h1_{dof}", f"min_{dof}"):
            gradient = problem.measure_gradient(name, xs[0])
            d = np.append(np.random.default_rng(1).standard_normal(problem.size), 0.0) * 1e-5
            sides = problem.measure(name, np.array([xs[0] + d, xs[0] - d]))
            assert gradient @ d == pytest.approx(0.5 * (sides[0] - sides[1]), rel=1e-3, abs=1e-10)
    omegas = np.array([at(problem, x[-1]).omega for x in xs])
    np.testing.assert_allclose(problem.measure("period", xs), 2.0 * np.pi / omegas, rtol=1e-13)
    events = int(np.maximum(problem.listed, 0).sum())
    assert events > 0 and problem.measure("n_events", xs).tolist() == [events, events] and problem.signature == f"{events} events"
    assert {"max_2", "h1_0", "period", "stable", "multiplier_6"} <= set(problem.measure_names)
    assert "max_3" not in problem.measure_names and "multiplier_7" not in problem.measure_names


def test_points_tangents_and_the_way_inward(problem):
    only = np.append(np.zeros(problem.size), 1.0)
    found = problem.correct(problem.x0, only, True)
    assert found.converged and (found.monitors < 0.0).all()
    wide = np.column_stack(problem.jacobian(found.x[:-1], found.p)) * problem.scale
    np.testing.assert_allclose(wide @ found.tangent, 0.0, atol=1e-9)
    null, sign = problem._null_vector(found.x)
    assert abs(null @ found.tangent) == pytest.approx(1.0, abs=1e-9)
    assert sign == np.linalg.slogdet(np.vstack([wide, null]))[0]
    np.testing.assert_array_equal(problem.order_at(found.x), order_of(problem.balance.room))
    np.testing.assert_array_equal(problem.order_at(found.x), problem.listed)
    np.testing.assert_allclose(problem.monitor_values(found.x[:-1], found.p, found.tangent), found.monitors, atol=1e-8)
    assert len(found.monitors) == len(problem.monitors) and found.monitors.min() >= -0.05
    ahead = problem._inward(found, found.x + 1e-4 * problem.scale * found.tangent)[0]
    assert ahead @ found.tangent > 0.9


def test_problems_of_other_orders_and_paths(problem):
    more = problem.with_order(problem.listed + 2)
    assert not more.same(problem) and problem.same(problem) and not problem.same(object())
    assert more.signature != problem.signature and (more.listed == problem.listed + 2).all()
    low, high = problem.path.low, problem.path.high
    assert problem.bounded(low, high, {}) is problem
    for ends in ((low - 0.1, high), (low, high + 0.1), (low - 0.1, high + 0.1)):
        made = {}
        wide = problem.bounded(*ends, made)
        assert list(made) == [problem.path] and problem.bounded(*ends, made).path is wide.path
        assert wide.path.low <= ends[0] and wide.path.high >= ends[1]
        np.testing.assert_allclose(wide.residual(problem.x0[:-1], problem.x0[-1]), problem.residual(
            problem.x0[:-1], problem.x0[-1]), atol=1e-10)
    with pytest.raises(ValueError, match="differ"):
        problem.family_over(problem.parameter, (0.5, 1.0))
    with pytest.raises(ValueError, match="finite"):
        problem.family_over("jenkins.limit", (0.5, np.inf))


@pytest.mark.parametrize("bounds", [(0.3, 0.5), (0.1, 0.5)])
def test_a_family_over_a_second_parameter_is_the_equations_at_both(problem, bounds):
    """At any pair of values at which it slips as often; the second parameter is measured by half of its interval."""
    family = problem.family_over("jenkins.limit", bounds)
    np.testing.assert_allclose(family.scale, [*problem.scale, 0.5 * (bounds[1] - bounds[0])])
    assert family.value == problem.system.parameter("jenkins.limit") and family.interval == bounds
    u = problem.x0[:-1] * 1.02
    for limit in (bounds[0], 0.4, 0.3 * bounds[0] + 0.7 * bounds[1]):
        for share in (0.9, 1.05):
            p = share * problem.x0[-1]
            whole = problem.whole.at(at(problem, p).with_parameters(**{"jenkins.limit": float(limit)}))
            np.testing.assert_allclose(family.at(limit).residual(u, p), whole.residual(u), atol=1e-10)


def test_a_problem_that_is_read_is_the_one_that_was_written(problem):
    read = from_record(problem.to_record())
    assert read.same(problem) and (read.scale == problem.scale).all() and (read.x0 == problem.x0).all()
    assert (read.path.low, read.path.high) == (problem.path.low, problem.path.high)
    u, p = problem.x0[:-1] * 1.01, problem.x0[-1] * 1.02
    np.testing.assert_allclose(read.residual(u, p), problem.residual(u, p), atol=1e-12)
    assert problem.scale[-1] == pytest.approx(0.2 * problem.x0[-1])


def test_what_is_not_continued_is_named(orbit):
    with pytest.raises(ValueError, match="parameter"):
        balance_problem(orbit, "nothing", (0.5, 1.0))


@pytest.fixture(scope="module")
def condensed(problem):
    path = path_over(problem.whole, problem.parameter, (0.8 * problem.x0[-1], 1.2 * problem.x0[-1]))
    made = condensed_along(problem.whole, path)
    u = made.restricted(problem.x0[:-1])
    return CondensedProblem(made, problem.method, path, np.append(u, problem.x0[-1]), np.append(
        np.full(made.size, problem.scale[0]), problem.scale[-1]), problem.listed)


@pytest.mark.parametrize("fixed", [True, False])
def test_determinants_are_of_rows_of_unit_size_over_the_tangent(problem, condensed, fixed):
    """Of [F_u F_p] in scaled unknowns, whatever the units of forces: of a condensed problem times that of what it leaves out."""
    for one in (problem, condensed):
        c = one.correct(one.x0, np.append(np.zeros(one.size), 1.0), fixed)
        A = np.column_stack(one.jacobian(c.x[:-1], c.p)) * one.scale
        A /= np.abs(A).max(axis=1)[:, None]
        sign, log = np.linalg.slogdet(np.vstack([A, c.tangent]))
        left = 0.0
        if one is condensed:
            point = condensed._along.at(c.p)
            left, sign = condensed.condensed.linear.log_determinant(point.T, point.moved), sign * point.linear.sign
        assert c.converged and c.det_sign == sign and c.det_log == pytest.approx(log + left, abs=1e-9)


def test_a_condensed_problem_has_the_solutions_of_the_whole_one(problem, condensed):
    only = np.append(np.zeros(problem.size), 1.0)
    few = np.append(np.zeros(condensed.size), 1.0)
    assert condensed.size < problem.size
    found, small = problem.correct(problem.x0, only, True), condensed.correct(condensed.x0, few, True)
    assert found.converged and small.converged
    np.testing.assert_allclose(condensed.motions(small.x[None])[0], found.x[:-1], atol=1e-9)
    np.testing.assert_allclose(small.monitors, found.monitors, atol=1e-7)
    for name in ("max_2", "rms_1", "h1_0", "period", "n_events"):
        assert condensed.measure(name, small.x[None])[0] == pytest.approx(problem.measure(name, found.x[None])[0], rel=1e-9)
    rates = small.tangent[-1], found.tangent[-1]
    for name in ("max_2", "rms_1"):  # derivatives along the branch, by the parameter
        per = [p.measure_gradient(name, c.x) @ (c.tangent * p.scale) / (c.tangent[-1] * p.scale[-1])
               for p, c in ((condensed, small), (problem, found))]
        assert per[0] == pytest.approx(per[1], rel=1e-6)
    assert min(map(abs, rates)) > 0.0
    fu, fp = condensed.jacobian(small.x[:-1] * 1.01, small.p)
    rng = np.random.default_rng(5)
    d = rng.standard_normal(condensed.size + 1) * condensed.scale * 1e-6
    x = np.append(small.x[:-1] * 1.01, small.p)
    slope = 0.5 * (condensed.residual((x + d)[:-1], x[-1] + d[-1]) - condensed.residual((x - d)[:-1], x[-1] - d[-1]))
    np.testing.assert_allclose(np.column_stack([fu, fp]) @ d, slope, rtol=1e-4, atol=1e-5 * np.abs(slope).max())


def test_a_condensed_determinant_changes_its_sign_with_that_of_the_whole_matrix(problem, condensed):
    few = np.append(np.zeros(condensed.size), 1.0)
    small = condensed.correct(condensed.x0, few, True)
    x = np.append(condensed.motions(small.x[None])[0], small.p)
    wide = np.column_stack(problem.jacobian(x[:-1], x[-1])) * problem.scale
    direction = small.tangent[-1]
    null = np.linalg.svd(wide)[2][-1]
    null *= np.sign(null[-1] * direction)
    assert small.det_sign == np.linalg.slogdet(np.vstack([wide, null]))[0]


def test_a_condensed_problem_that_is_read_is_the_one_that_was_written(condensed):
    read = from_record(condensed.to_record())
    assert isinstance(read, CondensedProblem) and read.same(condensed) and read.size == condensed.size
    u, p = condensed.x0[:-1] * 1.01, condensed.x0[-1] * 1.02
    np.testing.assert_allclose(read.residual(u, p), condensed.residual(u, p), atol=1e-11)
    other = condensed.on_path(path_over(condensed.whole, condensed.parameter, (0.7 * p, 1.3 * p)))
    np.testing.assert_allclose(other.residual(u, p), condensed.residual(u, p), atol=1e-9)
    assert other.path.low < condensed.path.low


def test_the_rounding_of_a_residual_is_that_of_its_terms(problem, condensed):
    for one in (problem, condensed):
        f, wide, floor = one._linearised(one.x0)
        np.testing.assert_allclose(floor, np.finfo(float).eps * (np.abs(wide) @ np.abs(one.x0)), rtol=1e-12)
        assert (floor > 0.0).all() and f.shape == floor.shape


@pytest.mark.parametrize("name", ["mass[0,0]", "mass[2,2]", "damping[0,0]", "stiffness[2,2]", "stiffness[1,2]"])
def test_matrices_that_change_along_a_path_are_those_of_the_systems_on_it(orbit, name):
    system = orbit.system
    value = system.parameter(system.parameter_name(name))
    low, high = sorted((0.8 * value, 1.3 * value))
    path = path_over(orbit.balance, name, (low, high))
    changed = changed_along(orbit.balance, path)
    for p in (low, value, high):
        z = (2.0 * p - path.low - path.high) / (path.high - path.low)
        there = system.with_parameters(**{name: p})
        for series, matrix in zip(changed.matrices, (there.mass, there.damping, there.stiffness), strict=True):
            np.testing.assert_allclose(np.polynomial.chebyshev.chebval(z, series), matrix, atol=1e-12)
    row, column = (int(place) for place in name[:-1].split("[")[1].split(","))
    assert set(changed.coordinates.tolist()) == {row, column}
