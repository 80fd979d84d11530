"""Rows, the curve between two of them, and what is read off a step, on branches in closed form."""
import math
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.continuation.kinds import CorrectorStatus, SpecialPointKind, StopReason
from bifurc.continuation.problem import Corrected, Monitor
from bifurc.continuation.steps import arclength, branchpoint, hidden, tori
from bifurc.continuation.steps.branchpoint import Crossing, first_direction, locate_crossing, other_direction
from bifurc.continuation.steps.detect import clear_slope, remember
from bifurc.continuation.steps.inside import known_to, near, stands
from bifurc.continuation.steps.rows import Curve, Part, Point, Row, followed, reversed_row
from bifurc.continuation.steps.rows import tests_of as values_of
from bifurc.solve.steplaw import BOUNDARY_BAND, MONITOR_BAND, NEARLY_SINGULAR, SLOPE_BAND
from tests.continuation.problems import Scalar


def corrected(x, tangent, monitors=(), sign=1.0, log=0.0, status=CorrectorStatus.CONVERGED):
    return Corrected(np.array(x, float), np.array(tangent, float), True, status, 3, 1e-14, 0.0, 0.0, sign, log,
                     np.array(monitors, float))


class Bent(Scalar):
    """u = p^3 - 2 p in other units, with two monitors of which one is odd."""

    monitors = (Monitor(SpecialPointKind.GRAZING, boundary=True), Monitor(SpecialPointKind.USER, "odd", odd=True))

    def __init__(self, **more):
        super().__init__(lambda u, p: u - (p**3 - 2.0 * p), lambda u, p: (1.0, -(3.0 * p * p - 2.0)), 0.0, 0.0, scale_u=4.0,
                         scale_p=0.5, **more)

    def monitor_values(self, u, p, tangent):
        return np.array([u[0] - 1.0, tangent[-1] * p])


def row_at(part, p, s, log=0.0, sign=1.0):
    """Return the row of a branch at ``p``, with its exact tangent."""
    problem = part.problem
    u = p**3 - 2.0 * p
    t = np.array([(3.0 * p * p - 2.0) * 0.5 / 4.0, 1.0])
    t /= np.linalg.norm(t)
    c = corrected([u, p], t, problem.monitor_values(np.array([u]), p, t), sign, log)
    return Row(c, part, s, 0.01, values_of(c), 0.2)


@pytest.fixture
def part():
    return Part(Bent(), 7, born=1)


def test_what_is_read_of_a_problem(part):
    assert part.index == 7 and part.born == 1 and part.count == 3
    assert part.kinds == [SpecialPointKind.FOLD, SpecialPointKind.GRAZING, SpecialPointKind.USER]
    assert part.boundary == [1] and part.events == [0, 2]
    np.testing.assert_array_equal(part.turned([3.0, 5.0]), [3.0, -5.0])
    np.testing.assert_array_equal(part.scale, [4.0, 0.5])


def test_a_row_and_its_image_in_the_other_direction(part):
    row = row_at(part, 0.75, 1.5, log=-2.0, sign=-1.0)
    row.recorded = {"a": 1.0}
    assert (row.p, row.s, row.ds, row.iterations, row.det_sign, row.det_log) == (0.75, 1.5, 0.2, 3, -1.0, -2.0)
    np.testing.assert_allclose(row.direction, part.scale * row.tangent)
    assert row.tests[0] == row.tangent[-1] and len(row.tests) == 3 and not row.singular
    other = reversed_row(row)
    np.testing.assert_array_equal(other.tangent, -row.tangent)
    assert other.s == -1.5 and other.det_sign == 1.0 and other.det_log == -2.0 and other.recorded == {"a": 1.0}
    assert other.tests == [-row.tests[0], row.tests[1], -row.tests[2]] and other.part is part and other.angle == row.angle
    again = reversed_row(other)
    assert again.tests == row.tests and again.s == row.s
    assert math.copysign(1.0, reversed_row(row_at(part, 0.0, 0.0)).s) == 1.0  # no negative zero
    singular = Row(corrected([0, 0], [0, 1], [0, 0], status=CorrectorStatus.SINGULAR), part, 0.0, 0.0, [1.0, 0.0, 0.0], 0.1)
    assert singular.singular and reversed_row(singular).singular
    point = Point(row)
    np.testing.assert_array_equal(point.x, row.x)
    assert point.u.tolist() == [row.x[0]] and point.parameter == 0.75 and point.s == 1.5 and point.monitors == row.tests[1:]


def test_a_row_of_a_step_that_the_problem_made_itself(part):
    before = row_at(part, 0.5, 1.0)
    told = 0.25, 0.05, 0.01, 0.4, 2.0, 1e-13, -1.0, 3.5
    (row,) = followed(before, np.array([[1.0, 2.0, 0.6, 0.8, 0.8, -1.0, 2.0, *told]]), (1, -1, 1))
    assert (row.s, row.angle, row.misfit, row.ds, row.iterations) == (1.25, 0.05, 0.01, 0.4, 2)
    assert row.bend == pytest.approx(0.2) and row.signs == (1, -1, 1)
    assert (row.residual, row.det_sign, row.det_log, row.p) == (1e-13, -1.0, 3.5, 2.0)
    assert row.tests == [0.8, -1.0, 2.0] and row.part is part


def test_the_curve_between_two_rows_is_the_cubic_of_both(part):
    a, b = row_at(part, 0.4, 1.0), row_at(part, 0.7, 1.75)
    curve = Curve(a, b)
    assert curve.length == 0.75
    for t, row in ((0.0, a), (1.0, b)):
        np.testing.assert_allclose(curve.place(t), row.x, atol=1e-15)
        h = 1e-6
        slope = (curve.place(t + h) - curve.place(t - h)) / (2.0 * h)
        np.testing.assert_allclose(slope, 0.75 * row.direction, rtol=1e-8)
    bends = []
    for t in (0.0, 0.21, 0.5, 0.83, 1.0):
        slope = (curve.place(t + h) - curve.place(t - h)) / (2.0 * h) / part.scale
        np.testing.assert_allclose(curve.tangent(t), slope / np.linalg.norm(slope), rtol=1e-7)
        k = 1e-4
        bends.append(abs(curve.place(t + k)[-1] - 2.0 * curve.place(t)[-1] + curve.place(t - k)[-1]) / k**2)
    assert curve.parameter_bend() == pytest.approx(max(bends), rel=1e-5)
    c = curve.at(0.3)
    assert c.converged and c.x[0] == pytest.approx(c.x[1]**3 - 2.0 * c.x[1], abs=1e-12)
    assert (c.x - curve.place(0.3)) / part.scale @ curve.tangent(0.3) == pytest.approx(0.0, abs=1e-9)  # in the plane across
    value, point = curve.test(0)(0.3)
    assert value == point.tangent[-1] and curve.test(2)(0.3)[0] == point.monitors[1]
    t, gap = curve.nearest(curve.place(0.62) + 1e-3 * part.scale * np.array([-curve.tangent(0.62)[1], curve.tangent(0.62)[0]]))
    assert t == pytest.approx(0.62, abs=1e-3) and gap == pytest.approx(1e-3, rel=1e-3)
    assert curve.nearest(curve.place(1.2))[0] == pytest.approx(1.2, abs=1e-6)
    assert curve.nearest(curve.place(3.0))[0] == 1.5 and curve.nearest(curve.place(-3.0))[0] == -0.5


def test_a_test_that_is_not_known_is_none(part, monkeypatch):
    curve = Curve(row_at(part, 0.4, 1.0), row_at(part, 0.7, 1.75))
    monkeypatch.setattr(Bent, "monitor_values", lambda self, u, p, t: np.array([math.nan, 1.0]))
    assert curve.test(1)(0.5) is None and curve.test(2)(0.5)[0] == 1.0

    def broken(*args):
        raise ValueError("own code")
    monkeypatch.setattr(Bent, "residual", broken)
    assert curve.at(0.5) is None and curve.test(0)(0.5) is None


# signs and places

def half_of(part, rows=(), count=3):
    return SimpleNamespace(signs=[0] * count, sizes=[0.0] * count, rows=list(rows), unresolved=[])


def test_signs_are_remembered_where_they_are_clear(part):
    half = half_of(part)
    row = row_at(part, 0.5, 0.0)

    def seen(values, before=True, fresh=False):
        row.tests = list(values)
        remember(half, row, before, fresh)
        return half.signs
    assert seen([0.5, -2.0, 3.0]) == [1, -1, 1] and half.sizes == [0.5, 2.0, 3.0]
    assert seen([-0.5, 1.0, math.nan]) == [-1, 1, 1] and half.sizes == [0.5, 2.0, 3.0]
    assert seen([0.9 * SLOPE_BAND, 0.9 * MONITOR_BAND * 2.0, 0.9 * MONITOR_BAND * 3.0]) == [-1, 1, 1]
    assert seen([-0.9 * SLOPE_BAND, -0.9 * MONITOR_BAND * 2.0, 1.1 * MONITOR_BAND * 3.0]) == [-1, 1, 1]
    assert seen([1.1 * SLOPE_BAND, -1.1 * MONITOR_BAND * 2.0, -1.1 * MONITOR_BAND * 3.0]) == [1, -1, -1]
    assert seen([-1.0, math.inf, 1.0]) == [-1, 1, 1] and half.sizes[1] == 2.0
    half = half_of(part)  # at a first row the zero of the boundary on which it begins has no sign
    assert seen([1.0, 5.0, 7.0], before=False, fresh=True) == [1, 0, 1]
    half = half_of(part)
    assert seen([1.1 * BOUNDARY_BAND, 0.0, 0.9 * MONITOR_BAND], before=False, fresh=True)[::2] == [1, 0]
    half = half_of(part)
    assert seen([0.9 * BOUNDARY_BAND, 0.0, 1.1 * MONITOR_BAND], before=False)[0] == 0
    assert clear_slope(-1.1 * BOUNDARY_BAND) and not clear_slope(0.9 * BOUNDARY_BAND)


def test_places_beside_the_ends_of_a_step(part):
    a, b = row_at(part, 0.4, 1.0), row_at(part, 0.7, 2.0)
    assert near(a, b, 0) == (1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
    assert near(a, b, 2) == (1e-8, 1e-7, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
    short = row_at(part, 0.41, 1.0 + 5e-3)
    np.testing.assert_allclose(near(a, short, 1), (2e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1), rtol=1e-9)
    assert known_to(SimpleNamespace(low=1.0, high=1.0, known=0.0)) == 1e-9
    assert known_to(SimpleNamespace(low=1.0, high=1.5, known=0.0)) == 0.25
    assert known_to(SimpleNamespace(low=1.0, high=1.0, known=2e-8)) == 2e-8  # rounding of the test there
    # the parameter stands still at an end whose slope is no more than its change over what is known of the place
    a.tests[0], b.tests[0] = 1.0, 1e-4
    assert stands(a, b, b, 1.1e-4) and not stands(a, b, b, 0.9e-4) and not stands(a, b, a, 0.5)


# zeros that the ends of a step do not show

def test_a_determinant_that_falls_faster_than_foretold_is_nearly_singular(part):
    rows = [row_at(part, 0.1, 0.0, log=0.0), row_at(part, 0.2, 1.0, log=-3.0)]
    fall = NEARLY_SINGULAR
    assert not hidden.nearly_singular(rows, rows[1], -3.0 - 0.9 * fall, 1.0)
    assert not hidden.nearly_singular(rows, rows[1], -3.0 - 1.1 * fall, 1.0)  # 3 a length are foretold
    assert hidden.nearly_singular(rows, rows[1], -3.0 - fall - 3.1, 1.0)
    assert hidden.nearly_singular(rows, rows[1], -3.0 - fall - 1.6, 0.5) and not hidden.nearly_singular(
        rows, rows[1], -3.0 - fall - 1.4, 0.5)
    assert hidden.nearly_singular(rows[1:], rows[1], -3.0 - 1.1 * fall, 1.0)  # nothing is foretold by one row
    rising = [row_at(part, 0.1, 0.0, log=-9.0), rows[1]]
    assert hidden.nearly_singular(rising, rows[1], -3.0 - 1.1 * fall, 1.0)  # nor by one that grows
    other = [row_at(Part(Bent(), 1), 0.1, 0.0, log=0.0), rows[1]]
    assert hidden.nearly_singular(other, rows[1], -3.0 - 1.1 * fall, 1.0)


def test_growth_of_the_determinant_over_three_rows(part):
    def grown(first, second, lengths=(1.0, 2.0)):
        a = row_at(part, 0.1, 0.0, log=1.0)
        b = row_at(part, 0.2, lengths[0], log=1.0 + first * lengths[0])
        last = 1.0 + first * lengths[0] + second * lengths[1]
        return hidden.growth(a, b, row_at(part, 0.3, sum(lengths), log=last))
    assert grown(2.0, 3.0) == pytest.approx(2.0) and grown(-2.0, -3.0) == pytest.approx(-2.0)
    assert grown(3.0, 2.0) == pytest.approx(2.0) and grown(2.0, -3.0) == 0.0 and grown(-1.0, 3.0) == 0.0
    assert grown(2.0, -math.inf) == 0.0


def test_the_parabola_through_three_rows(rng):
    for _ in range(5):
        a, b, c = rng.normal(size=3)
        back, length = rng.uniform(0.2, 2.0, 2)

        def f(t, a=a, b=b, c=c):
            return a + b * t + c * t * t
        for at in (-back, 0.0, 0.3 * length, length):
            assert hidden.parabola(f(-back), f(0.0), f(length), back, length, at) == pytest.approx(f(at), abs=1e-12)


class Dip(Scalar):
    """u = p with a monitor (p - 1)^2 - depth of one sign at both ends of a step."""

    monitors = (Monitor(SpecialPointKind.USER, "dip"),)

    def __init__(self, depth, sign=1.0, shape=lambda p: (p - 1.0)**2):
        super().__init__(lambda u, p: u - p, lambda u, p: (1.0, -1.0), 0.0, 0.0, scale_u=1.0, scale_p=1.0)
        self.depth, self.sign, self.shape = depth, sign, shape

    def monitor_values(self, u, p, tangent):
        return np.array([self.sign * (self.shape(p) - self.depth)])


def dipping(depth, sign=1.0, places=(0.0, 0.7, 1.5), *shape):
    part = Part(Dip(depth, sign, *shape), 0)
    t = np.array([1.0, 1.0]) / math.sqrt(2.0)
    rows = []
    for p in places:
        c = corrected([p, p], t, part.problem.monitor_values(None, p, t))
        rows.append(Row(c, part, math.sqrt(2.0) * p, 0.0, values_of(c), 0.1))
    half = half_of(part, rows[:2], 2)
    half.sizes = [1.0, 1.0]
    return half, rows


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("depth", [1e-2, 1e-5])
def test_two_zeros_of_a_monitor_in_one_step_are_seen(depth, sign):
    half, rows = dipping(depth, sign)
    found = hidden.dip(half, rows[1], rows[2])
    assert abs(found.p - 1.0) < math.sqrt(depth) and sign * found.tests[1] < 0.0
    assert found.s == pytest.approx(math.sqrt(2.0) * found.p, abs=1e-9) and half.unresolved == []
    assert found.ds == pytest.approx(rows[2].s - found.s, abs=1e-9)
    half, rows = dipping(-depth, sign)  # passed at a distance
    assert hidden.dip(half, rows[1], rows[2]) is None and half.unresolved == []


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("at", "before", "length"), [(1.2, 0.0, 0.6), (1.1, 0.4, 0.7), (1.35, 0.1, 1.5), (0.8, 0.2, 0.6)])
def test_two_zeros_of_a_corner_are_seen(sign, at, before, length):
    """Between the middle row and either neighbour, although no parabola through the three has a zero."""
    half, rows = dipping(0.05, sign, (before, 1.0, 1.0 + length), lambda p: abs(p - at))
    found = hidden.dip(half, rows[1], rows[2])
    assert abs(found.p - at) < 0.05 and sign * found.tests[1] < 0.0 and half.unresolved == []
    half, rows = dipping(-0.02, sign, (before, 1.0, 1.0 + length), lambda p: abs(p - at))  # passed at a distance
    assert hidden.dip(half, rows[1], rows[2]) is None and half.unresolved == []


def test_a_monitor_that_touches_zero_is_noted_once():
    half, rows = dipping(0.0)
    for _ in range(2):
        assert hidden.dip(half, rows[1], rows[2]) is None
        (kind, s, p), = half.unresolved
        assert kind == "user" and p == pytest.approx(1.0, abs=1e-3) and s == pytest.approx(math.sqrt(2.0), abs=2e-3)


def test_two_zeros_between_the_last_rows_are_seen_with_the_next():
    half, rows = dipping(1e-3, places=(0.8, 1.15, 1.3))
    found = hidden.dip(half, rows[1], rows[2])
    assert found is not None and abs(found.p - 1.0) < math.sqrt(1e-3) and rows[0].s < found.s < rows[1].s


# directions of a branch point

def quadratic(first, second, n=2):
    """A problem near the origin whose branches cross along two given unit directions (n + 1,): product of two planes."""
    rng = np.random.default_rng(5)
    kernel = np.stack([first, second])
    rest = np.linalg.svd(kernel)[2][2:]  # what is not spanned
    a = rng.normal(size=n - 1)

    class Crosses:
        scale = np.array([2.0, 0.5, 3.0][:n + 1])

        def residual(self, u, p):
            z = np.append(u, p) / self.scale
            c = np.linalg.lstsq(kernel.T, z, rcond=None)[0]
            out = rest @ z
            return np.append(c[0] * c[1], out + a * c[0]**2)

        def jacobian(self, u, p):
            x, h = np.append(u, p), 1e-6
            moves = h * np.eye(n + 1) * self.scale
            J = np.column_stack([(self._at(x + e) - self._at(x - e)) / (2.0 * h) for e in moves]) / self.scale
            return J[:, :-1], J[:, -1]

        def _at(self, x):
            return self.residual(x[:-1], x[-1])
    return Crosses()


def test_a_crossing_is_located_with_both_of_its_directions():
    first, second = np.array([0.6, 0.0, 0.8]), np.array([0.48, 0.6, -0.64])
    problem = quadratic(first, second)
    found = locate_crossing(problem, problem.scale * np.array([0.02, -0.01, 0.015]))
    assert found.status == "located" and np.abs(found.x / problem.scale).max() < 1e-7
    agree = np.abs(found.directions @ np.stack([first, second]).T)
    assert np.sort(agree.max(axis=1)) == pytest.approx([1.0, 1.0], abs=1e-6) and set(agree.argmax(axis=1)) == {0, 1}
    assert np.linalg.norm(found.directions, axis=1) == pytest.approx([1.0, 1.0])
    other = other_direction(found.directions, first)
    assert abs(other @ second) == pytest.approx(1.0, abs=1e-6)
    assert abs(other_direction(found.directions, -second) @ first) == pytest.approx(1.0, abs=1e-6)
    pair = Crossing("located", directions=np.array([[0.6, 0.0, -0.8], [0.8, 0.6, 0.0]]))
    np.testing.assert_array_equal(first_direction(pair.directions), [-0.6, 0.0, 0.8])
    leading = first_direction(found.directions)
    assert leading[-1] == pytest.approx(0.8, abs=1e-6) and abs(leading @ first) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize(("form", "roots"), [
    ((1.0, 0.0, -4.0), [2.0, -2.0]), ((0.0, 1.5, -3.0), [1.0, None]), ((2.0, -1.5, 0.0), [0.0, 1.5]),
    ((1.0, 2.5, 4.0), [-1.0, -4.0]), ((-1.0, -2.5, -4.0), [-1.0, -4.0]),
])
def test_directions_solve_the_quadratic_form(form, roots, monkeypatch):
    """a y^2 + 2 b y z + c z^2 = 0, in a kernel that is not that of the coordinates."""
    a, b, c = form
    kernel = np.array([[0.6, 0.8], [-0.8, 0.6]])
    matrix = np.array([[a, b + 0.1], [b - 0.1, c]])  # symmetric but for rounding of its differences
    monkeypatch.setattr(branchpoint, "_second", lambda problem, x, w, v: matrix @ kernel)
    found = branchpoint._directions(None, None, None, kernel)
    ratios = set()
    for d in found:
        y, z = kernel @ d
        assert a * y * y + 2.0 * b * y * z + c * z * z == pytest.approx(0.0, abs=1e-12)
        assert np.linalg.norm(d) == pytest.approx(1.0)
        ratios.add(None if abs(z) < 1e-12 else round(y / z, 9) + 0.0)
    assert ratios == set(roots)


@pytest.mark.parametrize("form", [(1.0, 0.0, 4.0), (1.0, 2.0, 4.0), (0.0, 0.0, 0.0)])
def test_a_form_without_two_real_directions_is_no_crossing(form, monkeypatch):
    a, b, c = form
    kernel = np.eye(2)
    monkeypatch.setattr(branchpoint, "_second", lambda problem, x, w, v: np.array([[a, b], [b, c]]))
    assert branchpoint._directions(None, None, None, kernel) is None
    assert Crossing("failed").x is None and Crossing("failed").error == math.inf


# pairs of multipliers

class Multipliers(Scalar):
    """u = p; multipliers are given functions of p."""

    monitors = (Monitor(SpecialPointKind.NEIMARK_SACKER, ""),)

    def __init__(self, mu):
        super().__init__(lambda u, p: u - p, lambda u, p: (1.0, -1.0), 0.0, 0.0, scale_u=1.0, scale_p=1.0)
        self.mu = mu

    def monitor_values(self, u, p, tangent):
        return np.zeros(1)

    def floquet_multipliers(self, x):
        made = self.mu(float(x[-1]))
        return None if made is None else np.asarray(made, complex)


def step_of(mu, low=0.0, high=1.0):
    part = Part(Multipliers(mu), 0)
    t = np.array([1.0, 1.0]) / math.sqrt(2.0)
    rows = []
    for p in (low, high):
        c = corrected([p, p], t, [0.0])
        rows.append(Row(c, part, math.sqrt(2.0) * p, 0.0, values_of(c), 0.1))
    return part, *rows


def pair(size, angle=1.0):
    return [size * np.exp(1j * angle), size * np.exp(-1j * angle)]


def test_a_pair_on_the_circle_is_located():
    """|mu| = .91 + .2 p beside a real multiplier that changes nothing."""
    part, a, b = step_of(lambda p: [*pair(0.91 + 0.2 * p), 0.3])
    curve, root = tori.pair_on_circle(part, a, b, [])
    assert root.point.x[-1] == pytest.approx(0.45, abs=1e-9) and root.at == pytest.approx(0.45, abs=1e-9)
    assert curve.length == pytest.approx(math.sqrt(2.0))
    part, a, b = step_of(lambda p: [*pair(1.09 - 0.2 * p), 0.3])  # inwards
    assert tori.pair_on_circle(part, a, b, [])[1].point.x[-1] == pytest.approx(0.45, abs=1e-9)


@pytest.mark.parametrize("at", [0.5, 0.53125, 0.9375])
@pytest.mark.parametrize("size", [0.25, -0.25])
def test_a_pair_that_a_bisection_puts_exactly_on_the_circle_is_located(at, size):
    part, a, b = step_of(lambda p: [(1.0 + size * (p - at)) * 1j, -(1.0 + size * (p - at)) * 1j, 0.3])
    assert tori.pair_on_circle(part, a, b, [])[1].point.x[-1] == pytest.approx(at, abs=1e-9)


def test_real_multipliers_that_pass_explain_what_they_explain():
    fold = SimpleNamespace(kind=SpecialPointKind.FOLD, s=math.sqrt(2.0) * 0.25)
    peak = SimpleNamespace(kind=SpecialPointKind.PEAK, s=math.sqrt(2.0) * 0.25)
    part, a, b = step_of(lambda p: [*pair(0.5), 0.75 + p])
    assert tori.pair_on_circle(part, a, b, [fold]) is None
    part, a, b = step_of(lambda p: [*pair(0.91 + 0.2 * p), 0.75 + p])
    assert tori.pair_on_circle(part, a, b, [fold])[1].point.x[-1] == pytest.approx(0.45, abs=1e-9)
    part, a, b = step_of(lambda p: [*pair(0.91 + 0.2 * p), 0.2])
    assert tori.pair_on_circle(part, a, b, [peak]) is not None
    def large(p):  # beside a graze: its rounding is more than the others are
        return [3e16, *pair(0.91 + 0.2 * p)]
    for nothing in (lambda p: [*pair(0.5), 0.2], lambda p: None, lambda p: [np.nan, 0.2], large):
        part, a, b = step_of(nothing)
        assert tori.pair_on_circle(part, a, b, []) is None


def test_a_pair_that_leaves_and_comes_back_is_seen_inside():
    part, a, b = step_of(lambda p: pair(0.97 + 0.02 * p + 0.3 * p * (1.0 - p)))
    c, t = tori.inner_change(part, a, b)
    assert t == 0.5 and c.x[-1] == pytest.approx(0.5) and tori.outside(part.problem, c.x) == (2, 2)
    part, a, b = step_of(lambda p: [*pair(0.9 + 0.2 * p, 1.0), *pair(1.2 - 0.25 * p, 2.0)])  # at .5 and .8, one after the other
    c, t = tori.inner_change(part, a, b)
    assert 0.5 < t < 0.8 and tori.outside(part.problem, c.x) == (4, 4)
    part, a, b = step_of(lambda p: pair(0.5 + 0.01 * p))
    assert tori.inner_change(part, a, b) is None
    part, a, b = step_of(lambda p: [0.5, 0.2])
    assert tori.inner_change(part, a, b) is None
    part, a, b = step_of(lambda p: pair(0.5) if p < 0.5 else [0.5, 0.5])
    assert tori.inner_change(part, a, b) is None  # not as many pairs, and far from the circle


def meeting(p):
    """Return multipliers of which two meet on the real axis at .05, one pair is outside near .84, and one never passes."""
    roots = np.sqrt(complex(0.0025 - 0.05 * p)) + 1.6
    outside = [roots, 3.2 - roots] if p < 0.05 else [1.6 + 0.05j, 1.6 - 0.05j]
    return [*outside, *pair(0.65 + 0.2 * p + 0.2 / (1.0 + ((p - 0.84) / 0.1)**2), 2.0 - 0.8 * p), 0.4, 0.1]


def test_a_pair_is_seen_inside_where_others_have_met_the_real_axis():
    """The numbers of pairs at the ends of the step differ, and the pair is outside the circle in a tenth of it: the part in which
    the pair is nearer to the circle than it has moved is halved until it is found."""
    part, a, b = step_of(meeting)
    assert tori.outside(part.problem, a.x) == tori.outside(part.problem, b.x) == (2, 2)
    c, t = tori.inner_change(part, a, b)
    assert 0.8 < t < 0.9 and tori.outside(part.problem, c.x) == (4, 4)


def test_multipliers_outside_the_circle_and_complex_ones():
    problem = Multipliers(lambda p: [*pair(1.2), -1.5, 0.3, 2.0 + 5e-8j])
    assert tori.outside(problem, np.zeros(2)) == (4, 4)
    np.testing.assert_allclose(tori.multipliers(problem, np.zeros(2)), [*pair(1.2), -1.5, 0.3, 2.0 + 5e-8j])
    for none in (lambda p: None, lambda p: [np.inf, 0.1]):
        assert tori.outside(Multipliers(none), np.zeros(2)) is None and tori.multipliers(Multipliers(none), np.zeros(2)) is None
    part, a, b = step_of(lambda p: [*pair(0.9), *pair(1.05, 2.0), 3.0])
    value, point = tori.curve_value(part.problem, Curve(a, b))(0.25)
    assert value == pytest.approx(1.05**2 - 1.0) and point.x[-1] == pytest.approx(0.25)  # of the pair nearest to the circle
    part, a, b = step_of(lambda p: [0.3, 0.2])
    assert tori.curve_value(part.problem, Curve(a, b))(0.25) is None


def test_multipliers_that_rounding_moves_to_and_fro_over_the_circle_are_no_torus():
    """As of a motion that nothing damps: what lies on the circle up to its rounding is neither inside nor outside."""
    at = tori.ON_CIRCLE
    part, a, b = step_of(lambda p: [*pair(1.0 + 0.9 * at * math.cos(40.0 * p), 1.0 + p), 2.0, 0.5])
    assert tori.outside(part.problem, a.x) == tori.outside(part.problem, b.x) == (1, 3)
    assert tori.pair_on_circle(part, a, b, []) is None and tori.inner_change(part, a, b) is None


# a branch that creeps goes on with other equations, or not


class Creeping:
    """What `Half.leap_from` sees of a half; ``crossed`` is what the other equations make of it."""

    def __init__(self, crossed, end=StopReason.DS_MIN):
        self.crossed, self.end = crossed, end
        self.slope, self.signs, self.sizes, self.edge, self.pending = 0.1, [1, -1], [2.0, 3.0], None, ["later"]
        self.rows, self.parts, self.found = [SimpleNamespace(p=1.0)], ["first"], []
        self.part = SimpleNamespace(problem=SimpleNamespace(free=0, placed=None))
        self.reason, self.message, self.ds = None, "", 1e-9
        self.options = SimpleNamespace(ds=0.3, ds_max=0.2)

    def cross(self, row, cut):
        assert self.slope == row.tests[0]  # dp/ds where it creeps, not where it began to
        self.slope, self.signs, self.sizes, self.edge, self.pending = 9.0, [0], [0.0], 1e-9, []
        if isinstance(self.crossed, StopReason):
            self.reason, self.message = self.crossed, "it ends"
        else:
            self.rows.append(SimpleNamespace(p=self.crossed, part=self.part))
            self.parts.append("second")

    def ends_in(self, row):
        assert row is self.rows[-1]
        return self.end

    @property
    def kept(self):
        return self.slope, self.signs, self.sizes, self.edge, self.pending


@pytest.mark.parametrize("half, leaps, goes_on", [
    (Creeping(StopReason.BOUND), True, False), (Creeping(StopReason.NO_SUCCESSOR), False, False),
    (Creeping(1.25), True, True), (Creeping(1.25, StopReason.MERGED), False, False), (Creeping(0.75), True, True)],
    ids=["ends there", "no successor", "goes on", "creeps on", "goes on below"])
@pytest.mark.parametrize("silent", [False, True])
def test_a_leap_is_made_where_other_equations_go_on(half, leaps, goes_on, silent, monkeypatch):
    half = Creeping(half.crossed, half.end)
    row = SimpleNamespace(tests=[0.7], p=1.0, x=np.array([5.0, 6.0, 1.0]), part=half.part)
    special = SimpleNamespace(error=1e-6, x=None)
    monkeypatch.setattr(arclength.detect, "creeping", lambda made, start: None)
    assert arclength.Half.leap_from(half, row, "start") is False and half.rows[1:] == [] and half.slope == 0.1
    monkeypatch.setattr(arclength.detect, "creeping", lambda made, start: SimpleNamespace(special=special, silent=silent))
    before = half.kept
    assert arclength.Half.leap_from(half, row, "start") is leaps
    if goes_on:
        assert [made.p for made in half.rows] == [1.0, half.crossed] and half.parts == ["first", "second"] and half.slope == 9.0
        assert special.bound == pytest.approx(1e-6 + 0.25) and special.x.tolist() == [5.0, 6.0, half.crossed]
        assert half.found == ([] if silent else [special]) and half.ds == 0.2 and half.reason is None
        return
    assert len(half.rows) == len(half.parts) == 1 and half.found == [] and half.ds == 1e-9 and special.x is None
    assert half.reason is (StopReason.BOUND if leaps else None) and half.message == ("it ends" if leaps else "")
    assert leaps or half.slope == 0.1
    if half.crossed == 1.25:
        assert half.kept == before


# a branch that creeps over a change of its sequence ends before it

@pytest.mark.parametrize("tests, kept", [
    ([-1e-3, -1e-16, 1e-15, 1e-14, 2e-13], 2), ([-1e-3, -1e-4, -1e-5, -1e-6, -1e-7], 5),
    ([1e-17, 1e-17, 1e-17, 1e-17, 1e-17], 5), ([-1e-3, 1e-17, -1e-17, 1e-15, -1e-16], 5),
    ([2e-10, 2e-14, 1e-13, 1e-13, 2e-13], 1)],
    ids=["over it", "up to it", "zero by itself", "to and fro", "over it from where the equations begin"])
def test_rows_behind_a_change_below_rounding_are_undone(tests, kept):
    part = SimpleNamespace(boundary=[1])
    other = SimpleNamespace(part=SimpleNamespace(boundary=[1]), tests=[0.5, -1.0])
    half = SimpleNamespace(rows=[other, *(SimpleNamespace(part=part, tests=[0.5, value]) for value in tests)])
    half.take_back = half.rows.pop
    last = arclength.Half.come_inside(half)
    assert last is half.rows[-1] and len(half.rows) == 1 + kept and half.rows[0] is other


def test_how_far_a_row_that_creeps_is_from_its_boundary():
    """Tests that fall with the distance and with its square, and one that stays: the distance is not more than what is stated."""
    part = SimpleNamespace(boundary=[1, 2, 3])
    away = 3.0 * 0.7**np.arange(60)
    for power in (1.0, 1.5, 2.0):
        rows = [SimpleNamespace(part=part, p=2.0 + d, tests=[0.1, -d**power, -0.2, -1e-9 * d**power]) for d in away]
        stated = arclength.crept(rows, rows[-1], [0.1, away[0]**power, 0.2, 1e-9 * away[0]**power])
        assert away[-1] <= stated <= 25.0 * away[-1]
    assert arclength.crept(rows[:3], rows[2], [0.1, 9.0, 0.2, 9e-9]) == 0.0  # nothing has fallen yet


# steps to points that differ from a boundary by rounding

@pytest.mark.parametrize("known, kept, slope", [(0.0, 5, 9.0), (0.15, 5, 9.0), (0.25, 4, -1.0), (0.6, 3, -1.0), (1.6, 2, 1.0)])
def test_behind_rows_that_are_rounding_the_parameter_runs_as_before_them(known, kept, slope):
    """Rows at s = 0, 1, 1.5, 1.8 before a boundary at 2 and a fold at 1.2: the slope at the boundary is that of the last row kept,
    the other way behind a fold that is kept; a fold beside the boundary is one with it."""
    part, other = SimpleNamespace(), SimpleNamespace()
    slopes = {0.0: 1.0, 1.0: 1.0, 1.5: -1.0, 1.8: -1.0, 2.0: -1e-9}
    rows = [SimpleNamespace(part=part, s=s, tests=[dp]) for s, dp in slopes.items()]
    fold, birth = (SimpleNamespace(part=one, s=s, successor=None, reverses=True) for one, s in ((part, 1.2), (other, 0.0)))
    special = SimpleNamespace(part=part, s=2.0, successor=None, known=known, reverses=False)
    half = SimpleNamespace(rows=list(rows), found=[birth, fold, special], steps=4, slope=9.0)
    arclength.Half.drop_beside(half, rows[-1], special, 0.0)
    assert half.rows == [*rows[:kept - 1], rows[-1]] and half.steps == kept - 1 and half.slope == slope
    assert half.found == ([birth, special] if known > 0.8 else [birth, fold, special])
