"""Conditions that curves of special points solve, against closed forms and differences of an evaluation of their own."""
import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import brentq

from bifurc.continuation import Problem, conditions
from bifurc.continuation.conditions import (
    ASIDE,
    Circle,
    Extremum,
    Flip,
    Fold,
    Number,
    Zero,
    difference,
    finite_scale,
    measure_gradient,
    null_vector,
    orthogonal_sign,
    smallest,
    weighted_second,
    wide_at,
)
from bifurc.continuation.curves.problem import ROUNDINGS, CurveProblem
from bifurc.continuation.curves.unfolding import Crossed, Unfolded, UnfoldedFamily, unfolded
from bifurc.continuation.families import family_of, orbit_family
from bifurc.continuation.kinds import SpecialPointKind

SCALE = np.array([2.0, 0.5, 3.0, 0.25])  # of u0, u1, a, b
COUPLING = np.array([[0.7, -1.3], [0.4, 0.9]])


class At:
    """F(u, a) at one value of b: two equations without any symmetry, cubic in all."""

    derived_beside = True

    def __init__(self, b):
        self.b, self.scale = b, SCALE[:3]

    def residual(self, u, a):
        x, y = u
        b = self.b
        return np.array([x**3 - a * x + 0.3 * y * y + b * y + 0.2 * a * b, y - 0.5 * x * y + a * a - b * b * x + 0.1 * x * x * a])

    def jacobian(self, u, a):
        x, y = u
        b = self.b
        return (np.array([[3.0 * x * x - a, 0.6 * y + b], [-0.5 * y - b * b + 0.2 * x * a, 1.0 - 0.5 * x]]),
                np.array([-x + 0.2 * b, 2.0 * a + 0.1 * x * x]))

    def wrapped_jacobian(self, u, multiplier):
        return np.array([[u[0] * u[1] - multiplier * u[2], self.b], [u[1], u[0] + multiplier * self.b * u[2]]])

    def monitor_value(self, index, x, tangent):
        assert index == 3
        return float(x[0]**2 - x[1] * x[2] + self.b + 0.1 * tangent() @ [1.0, -2.0, 0.5])

    def multipliers_of_rows(self, xs):
        return np.array([[x[0] + self.b * x[1], x[2]] for x in xs])

    def solution(self, x):
        return self.b, x

    def measure_gradient(self, name, x):
        assert name == "m"
        return np.array([2.0 * x[0] * x[2] + self.b * x[1], self.b * x[0], x[0]**2])  # of x^2 a + b x y

    def restarted(self, x):
        return self


FAMILY = SimpleNamespace(at=At, alone=At, scale=SCALE, problem=At(0.0))
X = np.array([0.7, -0.4, 1.3, 0.6])


def differenced(f, x=X, relative=1e-4):
    """Central differences of fourth order, in steps of the scale."""
    out = []
    for i in range(x.size):
        h = relative * SCALE[i]

        def at(k, i=i, h=h):
            y = x.copy()
            y[i] += k * h
            return f(y)
        out.append((8.0 * (at(1) - at(-1)) - at(2) + at(-2)) / (12.0 * h))
    return np.array(out)


def wide(x):
    fu, fa = At(x[3]).jacobian(x[:2], x[2])
    return np.column_stack([fu, fa])


def test_the_wide_jacobian_is_that_of_the_residual():
    np.testing.assert_array_equal(wide_at(FAMILY, X), wide(X))
    slopes = [differenced(lambda y, k=k: At(y[3]).residual(y[:2], y[2])[k])[:3] for k in range(2)]
    np.testing.assert_allclose(np.array(slopes), wide(X), atol=1e-8)


@pytest.mark.parametrize("side", [0, 1, -1])
def test_differences_are_exact_to_fourth_order_also_at_the_end_of_a_range(side):
    """Of a quartic; where one side is refused the other is taken, and where both are the refusal is raised."""
    asked = []

    def quartic(x):
        asked.append(x.copy())
        if side and side * (x[1] - 0.5) < -1e-12:
            raise ValueError("beyond its range")
        return x[0] * (x[1]**4 - 2.0 * x[1]**3 + x[1])
    x = np.array([3.0, 0.5])
    slope = 3.0 * (4.0 * 0.125 - 6.0 * 0.25 + 1.0)
    assert difference(quartic, x, 1, 0.1) == pytest.approx(slope, abs=1e-10)
    assert x.tolist() == [3.0, 0.5] and all(y[0] == 3.0 for y in asked)
    assert difference(quartic, x, 0, 0.1) == pytest.approx(0.0625 - 0.25 + 0.5, abs=1e-12)
    vector = difference(lambda y: np.array([y[1]**2, y[1]]), x, 1, 0.1)
    np.testing.assert_allclose(vector, [1.0, 1.0], atol=1e-12)

    def never(x):
        raise ValueError("nowhere")
    with pytest.raises(ValueError, match="nowhere"):
        difference(never, x, 1, 0.1)


def test_the_smallest_singular_value_has_the_sign_of_the_determinant(rng):
    for _ in range(10):
        K = rng.normal(size=(3, 3))
        g, w, v = smallest(K)
        sigma = np.linalg.svd(K, compute_uv=False)
        assert g == pytest.approx(np.linalg.det(K) / (sigma[0] * sigma[1]), rel=1e-10) and abs(g) == pytest.approx(sigma[2])
        assert w @ K @ v == pytest.approx(g, abs=1e-12)
        assert np.linalg.norm(w) == pytest.approx(1.0) and np.linalg.norm(v) == pytest.approx(1.0)
        q, _ = np.linalg.qr(K)
        assert orthogonal_sign(q) == round(np.linalg.det(q))


def test_the_null_vector_is_oriented_by_the_determinant(rng):
    for _ in range(10):
        J, scale = rng.normal(size=(3, 4)), rng.uniform(0.1, 5.0, 4)
        t, q, r = null_vector(J, scale)
        np.testing.assert_allclose(J * scale @ t, 0.0, atol=1e-12)
        assert np.linalg.det(np.vstack([J * scale, t])) > 0.0 and np.linalg.norm(t) == pytest.approx(1.0)
        np.testing.assert_allclose(q @ r, (J * scale).T, atol=1e-12)


def test_weighted_second_derivatives(monkeypatch):
    w, along = np.array([0.8, -0.3]), np.array([0.4, 1.1, -0.7])
    want = differenced(lambda y: w @ (wide(y) @ along))
    np.testing.assert_allclose(weighted_second(FAMILY, X, w, along), want, rtol=1e-6)
    plain = SimpleNamespace(at=At, scale=SCALE, problem=SimpleNamespace(derived_beside=False))
    np.testing.assert_allclose(weighted_second(plain, X, w, along), want, rtol=1e-8)


CONDITIONS = {
    "fold": (Fold(None), lambda y: smallest(wide(y)[:, :2] * SCALE[:2])[0]),
    "flip": (Flip(None), lambda y: smallest(At(y[3]).wrapped_jacobian(y[:3], -1.0)[:, :2] * SCALE[:2])[0]),
    "circle": (Circle(None, lambda mu: mu[0] * mu[1] - 1.0), lambda y: (y[0] + y[3] * y[1]) * y[2] - 1.0),
    "number": (Number(None, lambda s: s[0] * s[1][0] - s[1][2]**2), lambda y: y[3] * y[0] - y[2]**2),
    "zero": (Zero(None, 3), lambda y: y[0]**2 - y[1] * y[2] + y[3]
             + 0.1 * null_vector(wide(y), SCALE[:3])[0] @ [1.0, -2.0, 0.5]),
}


@pytest.mark.parametrize("name", CONDITIONS)
def test_values_and_gradients_of_conditions(name, monkeypatch):
    condition, value = CONDITIONS[name]
    if name == "flip":  # its unknowns include the parameter of the stand-in
        monkeypatch.setattr(At, "wrapped_jacobian", lambda self, u, m: np.array([[u[0] * u[1] - m * u[1], self.b],
                                                                                 [u[1], u[0] + m * self.b * u[0]]]))
        value = lambda y: smallest(At(y[3]).wrapped_jacobian(y[:2], -1.0) * SCALE[:2])[0]  # noqa: E731
    assert condition.value(FAMILY, X) == pytest.approx(value(X), rel=1e-10)
    g, gradient = condition.linearised(FAMILY, X, wide(X))
    assert g == pytest.approx(value(X), rel=1e-10)
    np.testing.assert_allclose(gradient, differenced(value), rtol=2e-6, atol=1e-7)
    assert condition.reached(FAMILY, X) is None


def test_an_extremum_of_a_measure_along_the_branch():
    """g = m' t; where it is zero its gradient is that along the branch, and to the solutions at another b."""
    condition = Extremum(None, "m")

    def solved(a, b, start=(0.990, -0.717)):
        u = np.array(start)
        for _ in range(40):
            u = u - np.linalg.solve(At(b).jacobian(u, a)[0], At(b).residual(u, a))
        return np.array([*u, a, b])

    def value(y):
        t = null_vector(wide(y), SCALE[:3])[0]
        return float(np.array([2.0 * y[0] * y[2] + y[3] * y[1], y[3] * y[0], y[0]**2]) * SCALE[:3] @ t)
    x = solved(brentq(lambda a: value(solved(a, 0.6)), 0.75, 0.8, xtol=1e-14), 0.6)
    g, gradient = condition.linearised(FAMILY, x, wide(x))
    assert g == pytest.approx(0.0, abs=1e-10) and condition.value(FAMILY, x) == pytest.approx(0.0, abs=1e-10)
    h = 1e-5
    for move in ((h, 0.0), (0.0, h)):
        above, below = solved(x[2] + move[0], 0.6 + move[1], x[:2]), solved(x[2] - move[0], 0.6 - move[1], x[:2])
        assert gradient @ (above - below) / h == pytest.approx((value(above) - value(below)) / h, rel=1e-4, abs=1e-6)


def test_gradients_of_measures_are_the_problems_own_or_differenced():
    np.testing.assert_allclose(measure_gradient(At(0.6), "m", X[:3]), At(0.6).measure_gradient("m", X[:3]))

    class Plain:
        scale = np.array([2.0, np.inf, 3.0])

        def measure_gradient(self, name, x):
            return None

        def measure(self, name, xs):
            return np.array([x[0]**2 * x[2] + 0.6 * x[0] * x[1] + 1e-3j for x in xs])
    np.testing.assert_allclose(measure_gradient(Plain(), "m", X[:3]), At(0.6).measure_gradient("m", X[:3]), rtol=1e-8)
    np.testing.assert_array_equal(finite_scale([2.0, np.inf, np.inf], [5.0, -7.0, 0.1]), [2.0, 7.0, 1.0])
    assert ASIDE > conditions.ALONG


def test_times_of_a_sequence_as_parts_of_its_span():
    s = SimpleNamespace(events=1, span=2.0, nodes=[0, 1])
    x = np.array([0.5, 9.0, 9.0, 3.0, 9.0, 9.0, 0.7])
    np.testing.assert_allclose(Fold(None).instants(SimpleNamespace(sequence=s), x), [0.25, 0.5])
    for none in (None, SimpleNamespace(events=0, span=2.0), SimpleNamespace(events=1, span=0.0)):
        assert Fold(None).instants(SimpleNamespace(sequence=none), x).size == 0


# branch points in two parameters

class Pitchfork(At):
    """u (a - u^2) and v - 2 u = 0 in skew coordinates, kept for all b; b moves it along a."""

    parameter, signature, monitors = "a", "-", ()

    def residual(self, u, a):
        w, v = COUPLING @ u
        return np.array([w * (a + self.b - w * w) + 0.3 * (v - 2.0 * w), v - 2.0 * w])

    def jacobian(self, u, a):
        w, v = COUPLING @ u
        by = np.array([[a + self.b - 3.0 * w * w - 0.6, 0.3], [-2.0, 1.0]])
        return by @ COUPLING, np.array([w, 0.0])


def test_unfolded_equations_of_a_branch_point():
    inner = Pitchfork(0.0)
    x = np.array([0.0, 0.0, 0.0])
    made = unfolded(inner, x)
    assert made is not None and unfolded(inner, np.array([0.0, 0.0, 0.5])) is None
    assert made.size == 3 and made.x0.tolist() == [0.0, 0.0, 0.0, 0.0]
    np.testing.assert_allclose(made.scale, [2.0, 0.5, 1.0, 3.0])
    fu, fa = inner.jacobian(x[:2], 0.0)
    assert np.abs(made.w0 @ fu).max() < 1e-12 and np.linalg.norm(made.w0) == pytest.approx(1.0)
    np.testing.assert_array_equal(made.own(np.array([1.0, 2.0, 9.0, 3.0])), [1.0, 2.0, 3.0])
    u = np.array([0.01, -0.02, 0.3])
    np.testing.assert_allclose(made.residual(u, 0.1)[:2], inner.residual(u[:2], 0.1) + 0.3 * made.w0, atol=1e-15)
    np.testing.assert_allclose(made.residual(np.zeros(3), 0.0), 0.0, atol=1e-12)
    full, by_a = made.jacobian(np.zeros(3), 0.0)
    np.testing.assert_allclose(full[:2, :2], fu)
    np.testing.assert_allclose(full[:2, 2], made.w0)
    assert full[2, 2] == 0.0 and by_a[:2] == pytest.approx(fa)
    # at the branch point the last row is the derivative of w F_a along (z, 1) with F_u z = -F_a: here of w (w_coordinate) alone
    h, w = 1e-5, made.w0
    want = [w @ (inner.jacobian(h * e, 0.0)[1] - inner.jacobian(-h * e, 0.0)[1]) / (2.0 * h) for e in np.eye(2)]
    np.testing.assert_allclose(full[2, :2], np.array(want) * 3.0, atol=1e-8)  # times the scale of the parameter
    assert made.monitor_values(np.array([0.0, 0.0, -2e-7]), 0.0, np.zeros(4)) == pytest.approx([1e-7])
    assert made.monitors[-1].boundary
    record = SimpleNamespace(**{"to_record": lambda: {"kind": "inner"}})
    made.inner = record
    assert made.to_record() == {"kind": "unfolded", "of": {"kind": "inner"}, "w0": made.w0.tolist(), "x0": [0.0, 0.0, 0.0]}


def test_unfolded_equations_have_no_leap_where_the_equations_of_the_branch_lose_rank(rng):
    """Null vectors have a sign of their own, which the determinant turns: the equations must not turn with it."""
    made = unfolded(Pitchfork(0.0), np.zeros(3))
    for _ in range(4):
        u = np.append(1e-3 * rng.normal(size=2), 0.0)
        below, above = (made.residual(u, a) for a in (-1e-4, 1e-4))
        np.testing.assert_allclose(below, above, atol=1e-5)


def test_a_curve_of_branch_points_stays_where_the_symmetry_keeps_it():
    """The branch point of u (a + b - u^2) lies at a = -b: the condition is zero there, and its gradient leads along it."""
    inner = SimpleNamespace(at=Pitchfork, alone=Pitchfork, scale=SCALE, problem=Pitchfork(0.0), name="b", value=0.0,
                            interval=(-1.0, 1.0), over=lambda low, high: inner)
    made = unfolded(Pitchfork(0.0), np.zeros(3))
    family = UnfoldedFamily(made, inner)
    np.testing.assert_allclose(family.scale, [2.0, 0.5, 1.0, 3.0, 0.25])
    assert family.over(0.0, 1.0) is family and (family.name, family.value, family.interval) == ("b", 0.0, (-1.0, 1.0))
    condition = Crossed(made)
    for b in (0.0, 0.4):
        x = np.array([0.0, 0.0, 0.0, -b, b])
        assert family.at(b).inner.b == b and family.alone(b).inner.b == b
        assert condition.value(family, x) == pytest.approx(0.0, abs=1e-12)
        g, gradient = condition.linearised(family, x, None)

        def value(y):
            return smallest(Pitchfork(y[4]).jacobian(y[:2], y[3])[0] * SCALE[:2])[0]
        moved = x + np.array([0.0, 0.0, 0.0, 1e-6, 0.0])
        assert g == pytest.approx(0.0, abs=1e-12) and gradient[2] == 0.0
        assert gradient[3] == pytest.approx(value(moved) / 1e-6, rel=1e-4) and gradient[3] == pytest.approx(gradient[4], rel=1e-6)
    assert isinstance(made, Unfolded) and math.isfinite(float(gradient[3]))


class Snap(Problem):
    """u^3 - b u = p with b measured in ``unit``."""

    def __init__(self, unit):
        super().__init__(1.2, 1.2**3 - 1.2, scale_u=1.0, scale_p=1.0)
        self.unit, self.b = unit, unit

    def residual(self, u, p):
        return u**3 - self.b / self.unit * u - p

    def jacobian(self, u, p):
        return np.array([[3.0 * float(u[0])**2 - self.b / self.unit]]), np.array([-1.0])


def test_the_uncertainty_of_a_point_on_a_curve_is_in_the_unit_of_its_parameter():
    """Of the fold p = -2 u^3, b = 3 u^2 in two parameters: what rounding makes of b, whatever its unit."""
    found = []
    for unit in (1.0, 1e-6, 1e4):
        family = family_of(Snap(unit), "b", (0.2 * unit, 4.0 * unit))
        curve = CurveProblem(family, SpecialPointKind.FOLD, "", (-math.inf, math.inf), np.array([0.6, -0.43, 1.1 * unit]))
        along = np.array([0.0, 0.0, 1.0])
        c = curve.correct(curve.x0, along, True)
        assert c.converged and c.x == pytest.approx([math.sqrt(1.1 / 3.0), -2.0 * math.sqrt(1.1 / 3.0)**3, 1.1 * unit], rel=1e-9)
        found.append(curve.uncertainty(c.x, c.tangent) / unit)
    assert found == pytest.approx([found[0]] * 3, rel=0.2) and 1e-16 < found[0] < 1e-12


@pytest.mark.parametrize("scale", [1.0, 1e3])
@pytest.mark.parametrize("away", [1e-1, 1e-3, 1e-5, 1e-7, 1e-9, 1e-12, 0.0])
def test_beside_a_crossing_of_curves_rounding_is_known_to_its_root(away, scale):
    """v (b + v) = e: at (away, -away) the curve of flips v = -b is sqrt(away^2 / 2 + e) - away / sqrt(2) off across, by the roots
    of the quadratic; a linear estimate says e / (sqrt(2) away)."""
    noise = 1e-15

    class Crossing(CurveProblem):
        def __init__(self):
            self.scale = np.array([1.0, scale])

        def residual(self, u, p):
            return np.array([u[0] * (p / scale + u[0])])

        def _linearised(self, x):
            v, b = x[0], x[1] / scale
            return self.residual(x[:-1], x[-1]), np.array([[b + 2.0 * v, v / scale]]), np.array([noise])

    told = Crossing().uncertainty(np.array([away, -scale * away]), np.array([1.0, -1.0]) / math.sqrt(2.0)) / scale
    off = [abs(-away / math.sqrt(2.0) + math.sqrt(away**2 / 2.0 + e)) / math.sqrt(2.0) for e in (noise, -noise)
           if away**2 / 2.0 + e >= 0.0]
    assert max(off) <= told <= 16.0 * ROUNDINGS * max(off)


def test_a_condition_is_not_asked_where_equations_have_no_value():
    """Where contacts cannot be followed derivatives are not numbers either: decompositions of them fail or do not, by chance."""
    curve = object.__new__(CurveProblem)
    curve.size, curve.condition = 3, None  # asked, it would fail
    curve.family = SimpleNamespace(at=lambda b: SimpleNamespace(residual=lambda u, a: np.array([a * b, np.nan])))
    found = curve.residual(np.array([1.0, 2.0, 3.0]), 2.0)
    assert found[0] == 6.0 and np.isnan(found[1:]).all() and found.shape == (3,)


@pytest.mark.parametrize("bounds", [(-1.0, 1.0), (0.5, 3.0)])
def test_what_a_builder_refuses_at_either_bound_is_said_before_anything_is_computed(bounds):
    class Built:
        def parameter_name(self, name):
            return name

        def parameter(self, name):
            return 0.7

        def with_parameters(self, **values):
            if not 0.0 <= values["gap"] <= 2.0:
                raise ValueError("the wall stands between 0 and 2")
            return self

    problem = SimpleNamespace(system=Built(), parameter="omega", scene=SimpleNamespace(flat_of=None))
    with pytest.raises(ValueError, match="the wall stands between 0 and 2"):
        orbit_family(problem, "gap", bounds)
    with pytest.raises(ValueError, match="must differ, got 'omega' twice"):
        orbit_family(problem, "omega", (0.5, 1.0))
    with pytest.raises(ValueError, match="bounds of 'gap' must be finite"):
        orbit_family(problem, "gap", (0.5, np.inf))
