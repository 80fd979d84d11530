"""Every solver and every rule once more, with dense matrices and polynomials of numpy, on problems drawn at random: the same
steps, counts and verdicts."""
import math

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from bifurc.solve import bordered, broyden, dense, newton, steplaw
from bifurc.solve.broyden import BroydenStatus
from bifurc.solve.newton import NewtonStatus

EPS = np.finfo(float).eps


# ---- rules of a step -----------------------------------------------------------------------------------------------------------


def twin_judged(cosine, along, sideways, singular):
    if not cosine > 0.9:
        return steplaw.TURNS, math.pi, 0.0
    angle = 2.0 * math.atan2(sideways, along) if singular else math.acos(min(cosine, 1.0))
    if angle > 0.35:
        return steplaw.TURNS, angle, 0.0
    misfit = sideways / along - math.tan(angle / 2.0)
    return (steplaw.LEADS_AWAY if abs(misfit) > 0.1 else steplaw.CREDIBLE), angle, misfit


def twin_next_length(ds, bend, before, iterations, most):
    foreseen = bend * min(bend / before, 2.0) if bend > before and before > 0.0 else bend
    factor = 2.0 if foreseen * ds <= 0.1 else float(np.clip(0.2 / (foreseen * ds), 0.5, 2.0))
    limit = {5: 1.2, 6: 0.5}.get(iterations, 2.0 if iterations <= 4 else 1.2)
    return min(min(factor, limit) * ds, most)


def twin_two_folds(a, b, mean):
    """The quadratic with the end values a, b and that mean."""
    if a * b <= 0.0 or min(abs(a), abs(b)) <= 1e-7:
        return -1.0
    sign = math.copysign(1.0, a)
    a, b, mean = sign * a, sign * b, sign * mean
    c = np.linalg.solve([[1, 0, 0], [1, 1, 1], [1, 1 / 2, 1 / 3]], [a, b, mean])
    if c[2] <= 0.0:
        return -1.0
    t = -0.5 * c[1] / c[2]
    least = Polynomial(c)(t)
    return t if 0.0 < t < 1.0 and least < 0.15 * min(a, b) + 0.03 * max(a, b) else -1.0


def twin_lowest(a, b, slope_a, slope_b):
    """The minimum of the cubic with these values and rates at 0 and 1."""
    c = np.linalg.solve([[1, 0, 0, 0], [1, 1, 1, 1], [0, 1, 0, 0], [0, 1, 2, 3]], [a, b, slope_a, slope_b])
    cubic = Polynomial(c)
    rate, bend = cubic.deriv(), cubic.deriv(2)
    places = [t.real for t in rate.roots() if abs(t.imag) < 1e-12 and bend(t.real) > 0.0]
    if not places or not 1e-3 < places[0] < 1.0 - 1e-3:
        return -1.0
    return places[0] if cubic(places[0]) < 0.15 * min(a, b) + 0.03 * max(a, b) else -1.0


def twin_two_zeros(f0, a, b, back, length):
    """The minimum of |test| on the parabola through three rows, in the step that has it (always where the middle fell much), or a
    corner that reaches zero."""
    if not (a * b > 0.0 and f0 * a > 0.0 and abs(a) < max(abs(f0), abs(b))):
        return 2.0
    f0, a, b = abs(f0), abs(a), abs(b)
    c = np.linalg.solve(np.vander([-back, 0.0, length], 3), [f0, a, b])
    if c[0] <= 0.0:
        return 2.0
    t = -0.5 * c[1] / c[0]
    least = -math.inf if a < 0.4 * min(f0, b) else np.polyval(c, t)
    if 0.0 < t < length and least < 0.9 * min(a, b):
        return t / length
    if -back < t <= 0.0 and least < 0.9 * min(a, f0):
        return t / back
    # a corner in this step falls on with the slope of the one before and rises with the same, and the other way round
    fall, rise = (f0 - a) / back, (b - a) / length
    corner = np.linalg.solve([[fall, 1.0], [-fall, 1.0]], [a, b - fall * length]) if fall > 0.0 else (0.0, 1.0)
    if corner[1] <= 0.0:
        return corner[0] / length
    corner = np.linalg.solve([[rise, 1.0], [-rise, 1.0]], [a, f0 - rise * back]) if rise > 0.0 else (0.0, 1.0)
    return -corner[0] / back if corner[1] <= 0.0 else 2.0


def twin_doubtful(misfit, corner, a, b, back, length, same_sign):
    line = a + (a - 1.0) / back * length  # through 1 and a
    if abs(misfit) < 0.01 + corner / 2.0 and line > a / 2.0 and b > a / 2.0:
        return steplaw.CLEAR
    return steplaw.JUMPS if line < 0.0 and same_sign and b > 0.2 * abs(line) else steplaw.UNCLEAR


def test_rules_are_those_of_polynomials():
    rng = np.random.default_rng(11)
    seen = {}

    def same(rule, twin, *values):
        found, known = rule(*values), twin(*values)
        assert found == pytest.approx(known, rel=1e-8, abs=1e-10), (rule.__name__, values)
        kind = found if isinstance(found, int) else found[0] if isinstance(found, tuple) else found in (-1.0, 2.0, 2.0 * values[0])
        seen.setdefault(rule.__name__, []).append(kind)

    for a, b, c, d, e in rng.normal(size=(1500, 5)):
        g, h = abs(d) + 0.05, abs(e) + 0.05
        same(steplaw.judged, twin_judged, math.cos(0.4 * a), g, 0.3 * abs(b) * g, bool(c > 0.0))
        same(steplaw.judged, twin_judged, 1.0 - 0.12 * abs(a), g, 0.2 * abs(b) * g, bool(c > 0.0))
        same(steplaw.two_folds, twin_two_folds, a, a * abs(b), 0.3 * c)
        same(steplaw.two_folds, twin_two_folds, a, b, c)
        same(steplaw.lowest, twin_lowest, abs(a), abs(b), 3.0 * c, 3.0 * d)
        same(steplaw.two_zeros, twin_two_zeros, a + b, 0.5 * a, a + c, g, h)
        same(steplaw.two_zeros, twin_two_zeros, a, b, c, g, h)
        same(steplaw.doubtful, twin_doubtful, 0.02 * a, 0.02 * abs(b), abs(c), abs(d), g, h, bool(e > 0.0))
        same(steplaw.next_length, twin_next_length, 0.2 * g, abs(a), abs(b), int(rng.integers(1, 7)), h)
    assert all(np.mean(kinds) not in (0.0, 1.0) for kinds in seen.values()) and len(seen) == 6
    assert set(seen["judged"]) == set(seen["doubtful"]) == {0, 1, 2}


def test_limits_of_the_rules_belong_to_one_side():
    assert steplaw.crosses(0.2, 1, 0.1) is False and steplaw.crosses(-0.2, 1, 0.1) and steplaw.crosses(0.2, -1, 0.1)
    assert not steplaw.crosses(-0.1, 1, 0.1) and not steplaw.crosses(-0.2, 0, 0.1) and not steplaw.crosses(-0.2, -1, 0.1)
    for angle in (1e-3, 1.9e-4, 1e-8):  # either form of the arc
        assert steplaw.arc_length(2.0, angle) == pytest.approx(2.0 * (1.0 + angle**2 / 24.0), rel=1e-13)
    assert steplaw.judged(0.9, 1.0, 0.1, True) == (steplaw.TURNS, math.pi, 0.0)
    assert steplaw.two_folds(1e-7, 1.0, -1.0) == -1.0 < steplaw.two_folds(1.1e-7, 1e-6, -1e-6)
    assert steplaw.next_length(0.1, 1.0, 0.0, 4, 9.0) == 0.2 and steplaw.next_length(0.1, 1.0001, 1.0001, 4, 9.0) < 0.2
    assert steplaw.next_length(0.1, 5.0, 5.0, 4, 9.0) == pytest.approx(0.05) and steplaw.next_length(0.1, 0.0, 0.0, 4, 9.0) == 0.2
    assert steplaw.two_zeros(2.0, 1.0, 1.0, 1.0, 1.0) == pytest.approx(0.5)


# ---- Newton --------------------------------------------------------------------------------------------------------------------


def twin_newton(residual, jacobian, x, scale, tolerance, iterations, noise):
    """Return status, x, iterations, norm of the residual, of the last correction."""
    x, correction = np.array(x, float), np.inf
    for count in range(iterations):
        f, J = residual(x), jacobian(x)
        if not (np.isfinite(f).all() and np.isfinite(J).all()):
            return NewtonStatus.NOT_FINITE, x, count, np.linalg.norm(f), correction
        if (np.abs(f) <= 2.0 * EPS * np.abs(J) @ np.abs(x)).all() or not f.any():
            return NewtonStatus.CONVERGED, x, count, np.linalg.norm(f), 0.0 if count == 0 else correction
        if np.linalg.matrix_rank(J * scale, tol=0.0) < len(x):
            return NewtonStatus.SINGULAR, x, count, np.linalg.norm(f), correction
        step = -np.linalg.solve(J * scale, f)
        size = np.linalg.norm(step)
        rounding = 4.0 * EPS * np.linalg.norm(x / scale)
        if size <= max(tolerance, rounding):
            x = x + scale * step
            return NewtonStatus.CONVERGED, x, count + 1, np.linalg.norm(residual(x)), size
        for k in range(11):
            damping = 0.5**k
            trial = x + damping * scale * step
            g = residual(trial)
            simplified = np.linalg.norm(np.linalg.solve(J * scale, g)) if np.isfinite(g).all() else np.inf
            if simplified <= (1.0 - damping / 2.0) * size or simplified <= 16.0 * rounding:
                break
            if np.linalg.norm(f) <= noise:
                return NewtonStatus.CONVERGED, x, count, np.linalg.norm(f), size
        else:
            return NewtonStatus.STUCK, x, count, np.linalg.norm(f), size
        x, correction = trial, damping * size
    return NewtonStatus.ITERATIONS, x, iterations, np.linalg.norm(residual(x)), correction


def curved(rng, n):
    """Return a residual with its Jacobian: linear, quadratic and saturating terms."""
    A, B, c = rng.normal(size=(n, n)) + 2.0 * np.eye(n), rng.normal(size=(n, n)), rng.normal(size=n)
    return (lambda x: A @ x + 0.6 * B @ (x * x) + np.arctan(3.0 * x) - c,
            lambda x: A + 1.2 * B * x + np.diag(3.0 / (1.0 + 9.0 * x * x)))


def problems(seed, count, most, spread):
    """Yield number, residual, Jacobian, scale of the unknowns and start, of up to ``most`` unknowns."""
    rng = np.random.default_rng(seed)
    for k in range(count):
        n = int(rng.integers(1, most + 1))
        f, J = curved(rng, n)
        scale = 10.0**rng.uniform(-1.0, 1.0, n)
        yield k, f, J, scale, spread * rng.normal(size=n)


def test_newton_makes_the_steps_of_its_twin():
    seen = []
    with np.errstate(all="ignore"):
        for k, f, J, scale, start in problems(5, 160, 3, 3.0):
            given = dict(scale=scale, tolerance=(1e-14, 1e-6)[k % 2], iterations=(50, 3)[k % 5 == 4], noise=(0.0, 1.0)[k % 7 == 6])
            found = newton.newton(f, J, start, **given)
            status, x, count, left, correction = twin_newton(f, J, start, **given)
            assert (found.status, found.iterations) == (status, count), k
            if status is not NewtonStatus.STUCK:
                assert found.x == pytest.approx(x, rel=1e-7, abs=1e-9)
            assert found.residual == pytest.approx(np.linalg.norm(f(found.x)), rel=1e-12, abs=1e-14)
            assert found.correction == pytest.approx(correction, rel=1e-4, abs=1e-9) and found.success is (status == "converged")
            seen.append(str(status))
    assert {name: seen.count(name) > 2 for name in ("converged", "stuck", "iterations")} == dict.fromkeys(
        ("converged", "stuck", "iterations"), True)


def test_newton_says_where_it_ended():
    nan = newton.newton(lambda x: x - 1.0, lambda x: np.diag(x * np.nan), [0.5])
    assert (nan.status, nan.iterations, nan.correction) == (NewtonStatus.NOT_FINITE, 0, np.inf) and nan.residual == 0.5
    flat = newton.newton(lambda x: x * x + 1.0, lambda x: np.diag(2.0 * x), [0.0])
    assert (flat.status, flat.iterations, flat.residual) == (NewtonStatus.SINGULAR, 0, 1.0)
    root = newton.newton(lambda x: x - 2.0, lambda x: np.eye(1), [2.0])
    assert (root.status, root.iterations, root.residual, root.correction) == (NewtonStatus.CONVERGED, 0, 0.0, 0.0)
    line = newton.newton(lambda x: 3.0 * x - 1.0, lambda x: 3.0 * np.eye(1), [0.0])
    assert line.success and line.iterations == 1 and repr(line) == "NewtonResult(converged, 1 iterations, residual 0.00e+00)"


# ---- Broyden -------------------------------------------------------------------------------------------------------------------


def twin_broyden(residual, x, J, kind, scale, size, tolerance, iterations, increment, restarts, calls):
    """Return status, x, iterations, jacobians, history; the Jacobian is a dense matrix, updated by its formula."""
    x = np.array(x, float)
    f = residual(x)
    norm = np.linalg.norm(f)
    history, jacobians = [norm], 1
    wanted = tolerance * (norm if size is None else size)
    if norm <= wanted:
        return BroydenStatus.CONVERGED, x, 0, 0, history
    B = J(x) * scale
    best, best_norm, mark, since, fresh, renewed = x, norm, norm, 0, True, np.inf
    for number in range(1, iterations + 1):
        dx = -np.linalg.solve(B, f)
        for k in range(9):
            trial = x + 0.5**k * scale * dx
            g = residual(trial)
            if not restarts or np.linalg.norm(g) <= (1.0 if fresh else 10.0) * norm:
                break
        dx = 0.5**k * dx
        df, x, f = g - f, trial, g
        norm = np.linalg.norm(f)
        history.append(norm)
        if norm < best_norm:
            best, best_norm = x, norm
        rounding = 4.0 * EPS * np.linalg.norm(np.abs(np.linalg.qr(B)[1]) @ np.abs(x / scale))
        solved = norm <= max(wanted, rounding)
        if increment is not None and np.linalg.norm(dx) < increment:
            return (BroydenStatus.CONVERGED if solved else BroydenStatus.FALSE_CONVERGENCE), x, number, jacobians, history
        if increment is None and solved:
            return BroydenStatus.CONVERGED, x, number, jacobians, history
        fresh, since = False, since + 1
        if norm <= 0.5 * mark:
            mark, since = norm, 0
        if restarts and since >= 8:
            if best_norm > 0.99 * renewed:
                return BroydenStatus.STALLED, best, number, jacobians, history
            renewed, x, f, norm, mark, since, fresh = best_norm, best, residual(best), best_norm, best_norm, 0, True
            B, jacobians = J(x) * scale, jacobians + 1
            continue
        if kind == "good":
            B = B + np.outer(df - B @ dx, dx) / (dx @ dx)
        else:
            H = np.linalg.inv(B)
            if np.linalg.cond(H + np.outer(dx - H @ df, df) / (df @ df)) > 1e12:
                return None, x, number, jacobians, history
            B = np.linalg.inv(H + np.outer(dx - H @ df, df) / (df @ df))
    return BroydenStatus.ITERATIONS, best, iterations, jacobians, history


def test_broyden_makes_the_steps_of_its_twin():
    seen = []
    with np.errstate(all="ignore"):
        for k, f, J, scale, start in problems(6, 120, 4, 1.5):
            given = dict(kind=("good", "bad")[k % 2], scale=scale, size=(None, 0.3)[k % 3 == 2], tolerance=(1e-9, 1e-3)[k % 4 == 3],
                         iterations=(60, 4)[k % 5 == 4], increment=(None, 1e-3)[k % 6 == 5], restarts=k % 7 != 6)
            found = broyden.broyden(f, start, J, **given)
            status, x, count, jacobians, history = twin_broyden(f, start, J, **given, calls=None)
            some = min(len(history), 12)  # rounding grows where the path wanders
            assert found.history[:some] == pytest.approx(history[:some], rel=1e-4, abs=1e-9), k
            if status is not None and len(history) <= 12:
                assert (found.status, found.iterations, found.jacobians) == (status, count, jacobians), k
                assert found.x == pytest.approx(x, rel=1e-6, abs=1e-7)
            assert found.residual == pytest.approx(np.linalg.norm(f(found.x)), rel=1e-9, abs=1e-13)
            assert len(found.history) == found.iterations + 1 and found.success is (found.status == "converged")
            seen.append(str(found.status))
    assert {"converged", "iterations"} < set(seen)


def test_counts_of_broyden():
    """Differences cost one residual an unknown; the step of each is that of its scale."""
    places = []

    def f(x):
        places.append(x.copy())
        return np.array([x[0] - 1.0, 2.0 * x[1] + 4.0])

    found = broyden.broyden(f, [0.0, 0.0], scale=np.array([1.0, 100.0]), step=1e-3)
    assert found.success and (found.iterations, found.jacobians) == (1, 1) and found.evaluations == len(places) == 4
    assert places[1].tolist() == [1e-3, 0.0] and places[2].tolist() == [0.0, 0.1]
    assert found.x == pytest.approx([1.0, -2.0]) and found.increment == pytest.approx(np.hypot(1.0, 0.02))
    assert repr(found).startswith("BroydenResult(converged, 1 iterations, 4 evaluations, residual ")
    lost = broyden.broyden(lambda x: x - 1.0, [0.0], jacobian=lambda x: np.full((1, 1), np.nan))
    assert lost.status is BroydenStatus.NOT_FINITE and (lost.iterations, lost.residual) == (0, 1.0)
    none = broyden.broyden(lambda x: 0.0 * x, [3.0])
    assert none.success and (none.evaluations, none.jacobians, none.increment) == (1, 0, np.inf)
    matrix = np.array([[2.0]])
    given = broyden.broyden(lambda x: 2.0 * x - 1.0, [0.0], jacobian=matrix)
    assert given.success and given.evaluations == 2 and matrix[0, 0] == 2.0
    flat = broyden.broyden(lambda x: x - 1.0, [0.0], jacobian=np.zeros((1, 1)), restarts=False)
    assert flat.status is BroydenStatus.SINGULAR and flat.iterations == 0
    assert broyden.Factors(np.diag([1.0, 1e-15])).singular and not broyden.Factors(np.diag([1.0, 1e-14])).singular
    J = np.array([[1.0, 2.0], [3.0, 5.0]])
    assert broyden.Factors(J).times([1.0, 2.0]) == pytest.approx([5.0, 13.0])
    for kind in ("good", "bad"):  # nothing is learnt from no step
        factors = broyden.Factors(J)
        broyden._learn(factors, kind, np.zeros(2), np.zeros(2))
        assert factors.q @ factors.r == pytest.approx(J)


# ---- linear systems ------------------------------------------------------------------------------------------------------------


def test_right_hand_sides_by_column_and_ranks_by_tolerance():
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(4, 4)), rng.normal(size=(4, 3))
    keep = a.copy()
    lu, pivots, _, _ = bordered.factor(a)
    assert np.array_equal(a, keep) and bordered.solve_factored(lu, pivots, b) == pytest.approx(np.linalg.solve(a, b))
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    wide = turn @ np.hstack([np.diag([1.0, 1e-3, 1e-9]), np.zeros((3, 1))]) @ np.linalg.qr(rng.normal(size=(4, 4)))[0]
    for given, lost in (({}, 1), ({"tolerance": 1e-8}, 2), ({"tolerance": 1e-2}, 3)):
        right, left = bordered.null_vectors(wide, **given)
        assert len(right) == lost and len(left) == lost - 1 and left @ left.T == pytest.approx(np.eye(lost - 1), abs=1e-14)
    right, left = bordered.null_vectors(np.zeros((2, 3)))
    assert right.shape == (3, 3) and left.shape == (2, 2)
    assert bordered.factor(np.diag([1.0, np.inf]))[2:] == (0.0, -math.inf) and bordered.factor(np.eye(1) * -2.0)[2] == -1.0


def test_compiled_pivots_are_the_largest_of_scaled_rows():
    rng = np.random.default_rng(2)
    for _ in range(30):
        n = int(rng.integers(2, 6))
        a = rng.normal(size=(n, n)) * 10.0**rng.uniform(-6.0, 6.0, (n, 1))
        work, scale, order = a.copy(), 1.0 / np.abs(a).max(axis=1), []
        for k in range(n):  # Gauss, row by row, in numpy
            row = k + int(np.abs(work[k:, k] * scale[k:]).argmax())
            order.append(row)
            work[[k, row]], scale[[k, row]] = work[[row, k]], scale[[row, k]]
            work[k + 1:, k] /= work[k, k]
            work[k + 1:, k + 1:] -= np.outer(work[k + 1:, k], work[k, k + 1:])
        pivot = np.empty(n, np.int64)
        dense.lu(a, pivot)
        assert pivot.tolist() == order and a == pytest.approx(work, rel=1e-9)
