"""Zeros and maxima of a guard on a step, against numpy's polynomials and their roots."""
import numpy as np
import pytest
from numpy.polynomial import Polynomial

from bifurc.compose.tables import ORDER
from bifurc.flow.affine import polynomial as kernels

EPS = np.finfo(float).eps
first_zero, highest = kernels.first_zero.py_func, kernels.highest.py_func  # only compiled functions call them: no door
LENGTHS = (1e-3, 0.7, 40.0)  # of a step: nothing may hang on the unit of time


@pytest.fixture(params=LENGTHS)
def length(request):
    return request.param


def series(rng, length, degree=ORDER):
    """Return coefficients (ORDER + 1,) of a guard of size 1 on a step of any length, of mixed signs, without a common zero."""
    a = np.zeros(ORDER + 1)
    a[:degree + 1] = rng.normal(size=degree + 1) * 0.7**np.arange(degree + 1)
    return a / length**np.arange(ORDER + 1)


def first_root(a, length):
    """Return the first real root in (0, length] of coefficients, None where there is none, and whether all are well apart."""
    found = Polynomial(a * length**np.arange(a.size)).roots() * length
    near = found[(found.real > -0.05 * length) & (found.real < 1.05 * length) & (np.abs(found.imag) < 0.05 * length)]
    plain = all(abs(r.imag) < 1e-12 * length and 0.0 < r.real < length for r in near) and \
        (near.size < 2 or np.diff(np.sort(near.real)).min() > 0.02 * length)
    return (float(near.real.min()) if near.size else None), bool(plain)


@pytest.mark.parametrize("depth", [0.999, 0.5, 0.05, 1e-6])
def test_a_hump_between_ends_that_are_level_is_not_passed_over(length, depth):
    """16 t^2 (1 - t)^2 - depth: values and slopes at the ends say nothing of it, and the bound on what they miss is sharp."""
    a, out, stack = np.zeros(ORDER + 1), np.empty(3), np.empty(64)
    a[:5] = np.array([-depth, 0.0, 16.0, -32.0, 16.0]) / length**np.arange(5)
    first_zero(a, 0, length, 1e-15, out, stack)
    assert out[0] == pytest.approx(0.5 * length * (1.0 - np.sqrt(1.0 - np.sqrt(depth))), rel=1e-9)
    assert highest(a, length, -1.0, out, stack) == pytest.approx(1.0 - depth, abs=1e-14)
    assert out[0] == pytest.approx(0.5 * length, rel=1e-7)
    first_zero(a - np.eye(ORDER + 1)[0] * 1.0, 0, length, 1e-15, out, stack)
    assert out[0] == np.inf


@pytest.mark.parametrize("low", range(5))
def test_values_slopes_and_bends_with_a_zero_divided_out(rng, length, low):
    for degree in (ORDER, ORDER - 1, low + 1):
        a = series(rng, length, degree)
        p = Polynomial(a[low:])
        for s in np.array([0.0, 0.31, 1.0]) * length:
            size = Polynomial(np.abs(a[low:]))
            for found in (kernels.horner(a, low, s), kernels.curved(a, low, s)):
                for j, (value, half) in enumerate(zip(found, (1.0, 1.0, 0.5), strict=False)):
                    assert value == pytest.approx(half * p.deriv(j)(s), abs=1e-14 * size.deriv(j)(s), rel=0.0)
            assert kernels.rounding(a, low, s) == pytest.approx(4.0 * EPS * size(s), rel=1e-12)


@pytest.mark.parametrize("low", range(5))
def test_the_bound_on_the_fourth_derivative_is_that_of_the_sizes(rng, length, low):
    """All terms of one sign are the worst case: there the bound is the derivative at the end."""
    a = series(rng, length)
    worst = Polynomial(np.abs(a[low:])).deriv(4)
    assert kernels.fourth(a, low, length) == pytest.approx(worst(length), rel=1e-13)
    inner = Polynomial(a[low:]).deriv(4)(np.linspace(0.0, length, 50))
    assert np.abs(inner).max() <= kernels.fourth(a, low, length) * (1.0 + 1e-13)


@pytest.mark.parametrize("low", (0, 1, 2))
def test_first_zero_is_the_first_of_all_roots(rng, length, low):
    """Random guards that begin inside; the zero at the start is divided out, and the slope is that of the guard itself."""
    out, stack = np.empty(3), np.empty(kernels.HALVINGS + 1)
    seen = {False: 0, True: 0}
    while min(seen.values()) < 25:
        a = series(rng, length)
        a[:low] = 0.0
        a[low] = -abs(a[low])
        root, plain = first_root(a[low:], length)
        if not plain:
            continue
        first_zero(a, low, length, 1e-13, out, stack)
        assert out[2] == np.inf
        seen[root is not None] += 1
        if root is None:
            assert out[0] == np.inf
        else:
            assert out[0] == pytest.approx(root, abs=1e-10 * length)
            slope = Polynomial(a).deriv()
            assert out[1] == pytest.approx(slope(out[0]), rel=1e-9, abs=1e-9 * abs(a[low]) * length**(low - 1))


def test_a_guard_that_is_not_inside_at_the_start_fires_there(length):
    out, stack = np.empty(3), np.empty(kernels.HALVINGS + 1)
    for a0 in (0.0, 0.4):
        a = np.zeros(ORDER + 1)
        a[:3] = a0, 2.5, -7.0
        first_zero(a, 0, length, 1e-13, out, stack)
        assert out.tolist() == [0.0, 2.5, np.inf]


@pytest.mark.parametrize("where", (0.21, 0.5, 0.83))
@pytest.mark.parametrize("low", (0, 1))
def test_a_hump_beside_zero(length, where, low):
    """A hump c above zero is two roots at +- sqrt(c), of which the first counts; within the noise it touches; below it is none."""
    out, stack = np.empty(3), np.empty(kernels.HALVINGS + 1)
    for height in (1e-4, 1e-9, 0.0, -1e-9, -1e-4):
        a = np.zeros(ORDER + 1)
        hump = Polynomial([height - where**2, 2.0 * where, -1.0]) * Polynomial([1.0, 0.3])
        a[low:low + 4] = hump.coef
        a[:] /= length**np.arange(ORDER + 1)
        first_zero(a, low, length, 1e-13, out, stack)
        if height > 0.0:
            assert out[0] == pytest.approx((where - np.sqrt(height)) * length, rel=1e-7)
            assert out[1] == pytest.approx(Polynomial(a).deriv()(out[0]), rel=1e-6)
            assert out[2] == np.inf
        else:
            assert out[0] == np.inf
            assert out[2] == (np.inf if height < 0.0 else pytest.approx(where * length, rel=1e-6))


def test_a_touch_before_a_zero_is_told_with_it(length):
    """-(s - .3)^2 (.8 - s): a touch at .3, then the zero."""
    out, stack = np.empty(3), np.empty(kernels.HALVINGS + 1)
    a = np.zeros(ORDER + 1)
    a[:4] = (-1.0 * Polynomial([-0.3, 1.0])**2 * Polynomial([0.8, -1.0])).coef / length**np.arange(4)
    first_zero(a, 0, length, 1e-13, out, stack)
    assert out[0] == pytest.approx(0.8 * length, rel=1e-12)
    assert out[1] == pytest.approx(0.25 / length, rel=1e-11)
    assert out[2] == pytest.approx(0.3 * length, rel=1e-6)


def test_highest_is_the_best_of_all_inner_maxima(rng, length):
    """Where the slope falls through zero inside; ends do not count, and nothing below what is known already."""
    out, stack = np.empty(3), np.empty(kernels.HALVINGS + 1)
    seen = {False: 0, True: 0}
    while min(seen.values()) < 25:
        p = Polynomial(a := series(rng, length))
        slope, bend = p.deriv(), p.deriv(2)
        _, plain = first_root(slope.coef, length)
        if not plain:
            continue
        tops = [s.real for s in slope.roots() if abs(s.imag) < 1e-12 * length and 0.0 < s.real < length and bend(s.real) < 0.0]
        seen[bool(tops)] += 1
        if not tops:
            assert highest(a, length, -np.inf, out, stack) == -np.inf
            continue
        best = max(tops, key=p)
        assert highest(a, length, -np.inf, out, stack) == pytest.approx(p(best), abs=1e-13)
        assert out[0] == pytest.approx(best, abs=1e-6 * length)
        assert highest(a, length, p(best) - 1e-6, out, stack) == pytest.approx(p(best), abs=1e-13)
        assert highest(a, length, p(best) + 1e-6, out, stack) == p(best) + 1e-6


def test_a_bracketed_zero_is_found_to_rounding(rng, length):
    """A rising guard in a bracket that is not symmetric about its zero: time and slope to the rounding of the guard."""
    for _ in range(40):
        roots = np.concatenate([[rng.uniform(0.2, 0.8)], rng.uniform(1.5, 3.0, 3), -rng.uniform(0.5, 2.0, 2)])
        p = Polynomial.fromroots(roots)
        p = p * -np.sign(p(0.0))
        a = np.zeros(ORDER + 1)
        a[:p.coef.size] = p.coef / length**np.arange(p.coef.size)
        left, right = rng.uniform(0.0, 0.15) * length, rng.uniform(0.85, 1.2) * length
        (pl, dl), (pr, dr) = (kernels.horner(a, 0, s) for s in (left, right))
        assert pl < 0.0 < pr
        root, slope = kernels.bracketed(a, 0, left, right, pl, pr, dl, dr)
        noise = kernels.rounding(a, 0, root)
        assert abs(root - roots[0] * length) <= 4.0 * noise / slope
        assert slope == pytest.approx(kernels.horner(a, 0, root)[1], rel=1e-12)


def test_a_maximum_in_a_bracket_is_where_the_slope_falls_through_zero(rng, length):
    for _ in range(40):
        top = rng.uniform(0.1, 0.9)
        rate = -Polynomial([-top, 1.0]) * Polynomial.fromroots([3.0, -2.0]) * -1.0
        p = (rate if rate.deriv()(top) < 0.0 else -rate).integ()
        a = np.zeros(ORDER + 1)
        a[:p.coef.size] = p.coef / length**np.arange(p.coef.size)
        assert kernels.maximum(a, 0, 0.0, length) == pytest.approx(top * length, rel=1e-12)
