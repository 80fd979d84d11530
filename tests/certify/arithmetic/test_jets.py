"""Jets and Taylor series in balls, against differences in many bits, polynomials of numpy, and the algebra itself."""
import numpy as np
import pytest

from bifurc.certify.arithmetic.balls import size, working
from bifurc.certify.arithmetic.forms import Form, Reach, column, hull, total
from bifurc.certify.arithmetic.jets import Jet, Series, SeriesField, SeriesMatrix, leibniz, norm_of

flint = pytest.importorskip("flint")
arb, mat = flint.arb, flint.arb_mat
STEP = 2.0**-60


@pytest.fixture(autouse=True)
def many_bits():
    with working(320):
        yield


def matrix(values):
    values = np.asarray(values, float)
    return mat(*values.shape, values.ravel().tolist())


def floats(found):
    return np.array([[float(found[i, j].mid()) for j in range(found.ncols())] for i in range(found.nrows())])


def mixed_difference(f, a, parts):
    """Return value, both slopes and the mixed second derivative of f(a + s b + t c + s t d), by differences in many bits."""
    b, c, d = parts
    h = arb(STEP)

    def at(s, t):
        return f(a + b * (h * s) + c * (h * t) + d * (h * h * (s * t)))
    one = at(1, 0) - at(-1, 0)
    two = at(0, 1) - at(0, -1)
    both = at(1, 1) - at(1, -1) - at(-1, 1) + at(-1, -1)
    return at(0, 0), one * (1 / (2 * h)), two * (1 / (2 * h)), both * (1 / (4 * h * h))


def test_products_of_jets_are_those_of_the_algebra(rng):
    """(a + b e1 + c e2 + d e1 e2) times the same, of matrices that do not commute; parts that are None are zero."""
    for _ in range(3):
        left, right = ([matrix(rng.normal(size=(2, 2))) for _ in range(4)] for _ in range(2))
        a, b, c, d = left
        p, q, r, s = right
        want = [a * p, a * q + b * p, a * r + c * p, a * s + b * r + c * q + d * p]
        for found, expected in zip((Jet(*left) * Jet(*right)).parts, want, strict=True):
            np.testing.assert_allclose(floats(found), floats(expected), rtol=1e-14)
        two = Jet(*left[:2]) * Jet(*right[:2])
        for found, expected in zip(two.parts, want[:2], strict=True):
            np.testing.assert_allclose(floats(found), floats(expected), rtol=1e-14)
        (one,) = (Jet(a) * Jet(p)).parts
        np.testing.assert_allclose(floats(one), floats(a * p), rtol=1e-14)
        product = (Jet(a, None, c, None) * Jet(p, q, None, None)).parts
        for found, expected in zip(product, (a * p, a * q, c * p, c * q), strict=True):
            np.testing.assert_allclose(floats(found), floats(expected), rtol=1e-14)
        assert (Jet(a, None) * Jet(p, None)).parts[1] is None


def test_sums_and_multiples_of_jets():
    x, y = Jet(arb(3), arb(5), None, arb(7)), Jet(arb(11), None, arb(13), arb(17))
    for found, want in ((x + y, (14, 5, 13, 24)), (x - y, (-8, 5, -13, -10)), (-x, (-3, -5, None, -7)),
                        (x.times(arb(2)), (6, 10, None, 14))):
        assert [None if v is None else float(v) for v in found.parts] == [None if v is None else float(v) for v in want]
    assert [v is None for v in x.like(arb(1)).parts] == [False, True, True, True]
    assert float(x.value) == 3.0
    wide = Jet(matrix([[1.0, 2.0], [3.0, 4.0]]), None)
    assert float(wide.entry(0, 1, 0, arb(0))) == 3.0 and float(wide.entry(1, 1, 0, arb(9))) == 9.0


@pytest.mark.parametrize("k", [1, 3])
def test_circular_functions_of_a_jet(k):
    a, parts = arb(0.7), (arb(1.3), arb(-0.4), arb(2.1))
    cosine, sine = Jet(a, *parts).circular(k)
    for found, f in ((cosine, lambda x: (x * k).cos()), (sine, lambda x: (x * k).sin())):
        for mine, want in zip(found.parts, mixed_difference(f, a, parts), strict=True):
            assert float((mine - want).mid()) == pytest.approx(0.0, abs=1e-13)
        assert [float(v) for v in found.parts[:2]] == [
            float(v) for v in (Jet(a, parts[0]).circular(k)[0 if found is cosine else 1]).parts]
    cosine, sine = Jet(a).circular(k)
    assert float(cosine.parts[0]) == pytest.approx(np.cos(0.7 * k), rel=1e-15)
    assert float(sine.parts[0]) == pytest.approx(np.sin(0.7 * k), rel=1e-15)
    cosine, _ = Jet(a, None, arb(2), None).circular(k)  # parts that are None: the mixed one vanishes
    assert float(cosine.parts[1]) == 0.0 and float(cosine.parts[3]) == 0.0
    assert float(cosine.parts[2]) == pytest.approx(-2.0 * k * np.sin(0.7 * k), rel=1e-14)


def test_exponential_of_a_jet_of_matrices(rng):
    a, *parts = (matrix(rng.normal(size=(3, 3))) for _ in range(4))
    wanted = mixed_difference(lambda x: x.exp(), a, parts)
    for mine, want in zip(Jet(a, *parts).exp().parts, wanted, strict=True):
        np.testing.assert_allclose(floats(mine), floats(want), atol=1e-13 * norm_of(want))
    for mine, want in zip(Jet(a, parts[0]).exp().parts, wanted, strict=False):
        np.testing.assert_allclose(floats(mine), floats(want), atol=1e-13 * norm_of(want))
    np.testing.assert_allclose(floats(Jet(a).exp().parts[0]), floats(a.exp()), rtol=1e-15)
    without = Jet(a, parts[0], None, None).exp()
    np.testing.assert_allclose(floats(without.parts[1]), floats(wanted[1]), atol=1e-13 * norm_of(wanted[1]))
    assert norm_of(without.parts[2]) < 1e-60 and norm_of(without.parts[3]) < 1e-60


def test_flow_over_a_wide_duration_holds_all_flows_and_is_not_much_wider(rng):
    B = matrix(rng.normal(size=(3, 3)))
    duration = Jet(arb(1.5, 1e-3), arb(0.25))
    found = Jet(B, None).flow(duration)
    for t in (1.499, 1.5, 1.5007, 1.501):
        here = (B * arb(t)).exp()
        slope = B * here * arb(0.25)
        for mine, want in zip(found.parts, (here, slope), strict=True):
            for i in range(3):
                for j in range(3):
                    assert (mine[i, j] + arb(0, 1e-14)).contains(want[i, j].mid())
    spread = max(float(v.rad()) for v in found.parts[0].entries())
    rate = norm_of(B * (B * arb(1.5)).exp())
    assert spread < 4.0 * rate * 1e-3
    thin = Jet(B).flow(Jet(arb(1.5)))
    assert max(float(v.rad()) for v in thin.parts[0].entries()) < 1e-80


@pytest.mark.parametrize("scale", [0.0, 1e-3, 0.2, 1.0, 40.0])
def test_exponentials_of_forms_without_width_are_exponentials(scale, rng):
    """A form of which only the first part is there: Taylor's sum with squarings, against flint's own."""
    reach = Reach(0.0, 1)
    a, b = (matrix(scale * rng.normal(size=(3, 3)) / 2.0) for _ in range(2))
    value, slope = Jet(Form(reach, a), Form(reach, b)).exp().parts
    true = Jet(a, b).exp().parts
    for mine, want in zip((hull(value), hull(slope)), true, strict=True):
        for got, exact in zip(mine.entries(), want.entries(), strict=True):
            assert got.overlaps(exact)
            assert float(got.rad()) <= 1e-11 * max(norm_of(true[0]), norm_of(want))
    alone = Jet(Form(reach, a)).exp().parts[0]
    assert all(got.overlaps(exact) for got, exact in zip(hull(alone).entries(), true[0].entries(), strict=True))


def test_the_exponential_of_what_is_not_finite_is_not_finite():
    broken = mat(1, 1, [arb("nan")])
    found = Jet(Form(Reach(0.1, 1), broken)).exp().parts[0]
    assert not hull(found)[0, 0].is_finite()


def test_norm_is_the_largest_sum_of_a_row():
    assert norm_of(matrix([[1.0, -2.0], [0.5, 0.25]])) == pytest.approx(3.0, rel=1e-11)
    assert norm_of(matrix([[1.0, -2.0], [0.5, 0.25]])) >= 3.0
    assert norm_of(matrix([[0.5, 0.25], [-4.0, 3.0]])) == pytest.approx(7.0, rel=1e-11)
    assert norm_of(matrix([[1.0, 1.0, 1.0]])) == pytest.approx(3.0, rel=1e-11)  # not square
    assert norm_of(mat(1, 1, [arb(1, 0.5)])) == pytest.approx(1.5, rel=1e-8)


# series

def series(coefficients):
    return Series(*[arb(float(c)) for c in coefficients])


def test_series_are_truncated_polynomials(rng):
    P = np.polynomial.polynomial
    for _ in range(5):
        a, b = rng.integers(-5, 6, 5).astype(float), rng.integers(-5, 6, 5).astype(float)
        b[0] = 3.0
        for found, want in ((series(a) + series(b), a + b), (series(a) - series(b), a - b), (-series(a), -a),
                            (series(a) * series(b), P.polymul(a, b)[:5]), (series(a) * arb(2.5), 2.5 * a)):
            assert [float(v) for v in found.parts] == pytest.approx([*want, *[0.0] * (5 - len(want))])
        quotient = series(a) / series(b)
        assert [float(v.mid()) for v in (quotient * series(b)).parts] == pytest.approx(a.tolist(), abs=1e-12)
    assert series([2, 0, 0]) == 2 and not series([2, 0, 1e-9]) == 2 and not series([3, 0, 0]) == 2


def test_products_with_a_constant_series_are_multiples():
    constant, other = [arb(4), arb(0), arb(0)], [arb(1), arb(2), arb(3)]
    assert [float(v) for v in leibniz(constant, other)] == [4.0, 8.0, 12.0]
    assert [float(v) for v in leibniz(other, constant)] == [4.0, 8.0, 12.0]
    assert [float(v) for v in leibniz(other, other)] == [1.0, 4.0, 10.0]


def test_matrices_of_series_multiply_transpose_and_invert(rng):
    A, B = (SeriesMatrix(*[matrix(rng.normal(size=(2, 2))) for _ in range(4)]) for _ in range(2))
    a, b = ([floats(part) for part in item.parts] for item in (A, B))
    for found, want in zip((A * B).parts, [sum(a[j] @ b[k - j] for j in range(k + 1)) for k in range(4)], strict=True):
        np.testing.assert_allclose(floats(found), want, rtol=1e-13)
    for found, want in zip((A + B).parts, [p + q for p, q in zip(a, b, strict=True)], strict=True):
        np.testing.assert_allclose(floats(found), want, rtol=1e-15)
    for found, want in zip((A * arb(3)).parts, a, strict=True):
        np.testing.assert_allclose(floats(found), 3.0 * want, rtol=1e-15)
    factor = [1, 2, 0, -1]
    for k, found in enumerate((A * series(factor)).parts):
        want = sum(a[j] * factor[k - j] for j in range(k + 1))
        np.testing.assert_allclose(floats(found), want, rtol=1e-13, atol=1e-15)
    for k, part in enumerate((A * A.inv()).parts):
        np.testing.assert_allclose(floats(part), np.eye(2) if k == 0 else 0.0, atol=1e-12)
    np.testing.assert_array_equal(floats(A.transpose().parts[2]), a[2].T)
    assert (A.nrows(), A.ncols()) == (2, 2)
    wide = SeriesMatrix(matrix([[1.0, 2.0, 3.0]]), matrix([[4.0, 5.0, 6.0]]))
    assert (wide.nrows(), wide.ncols()) == (1, 3) and (wide.transpose().nrows(), wide.transpose().ncols()) == (3, 1)
    assert [float(v) for v in wide[0, 2].parts] == [3.0, 6.0]


def test_the_field_of_series_reads_its_numbers_in_order():
    field = SeriesField([[arb(1), arb(2)], [arb(3), arb(4)]], 2)
    assert [float(v) for v in field.number(0.0).parts] == [1.0, 2.0] and [float(v) for v in field.number(0.0).parts] == [3.0, 4.0]
    assert [float(v) for v in field.scalar(5).parts] == [5.0, 0.0]
    made = field.matrix(1, 2, (Series(arb(k), arb(10 * k)) for k in (1, 2)))
    np.testing.assert_array_equal(floats(made.parts[1]), [[10.0, 20.0]])


# forms

@pytest.mark.parametrize("order", [1, 2])
def test_forms_with_parts_that_are_zero(order, rng):
    """Every pattern of parts that are None gives what the full pattern with zeros gives."""
    reach = Reach(0.125, order)
    zero = arb(0)
    for first in range(4):
        for second in range(4):
            if order == 1 and (first > 1 or second > 1):
                continue
            a = [arb(1.5), arb(-0.5) if first & 1 else None, arb(0.25) if first & 2 else None]
            b = [arb(2.0), arb(0.75) if second & 1 else None, arb(-1.0) if second & 2 else None]
            x, y = Form(reach, *a), Form(reach, *b)
            full = [Form(reach, *[zero if v is None else v for v in parts[:order + 1]]) for parts in (a, b)]
            for mine, want in ((x * y, full[0] * full[1]), (x + y, full[0] + full[1]), (x / y, full[0] / full[1]),
                               (x.sin_cos()[0], full[0].sin_cos()[0]), (x.sin_cos()[1], full[0].sin_cos()[1]),
                               (3 - x, 3 - full[0])):
                assert hull(mine).overlaps(hull(want))
                for p, q in zip(mine.parts, want.parts, strict=True):
                    assert (zero if p is None else p).overlaps(zero if q is None else q)
                for d in (-0.125, 0.0, 0.08, 0.125):  # and the true value lies in the form there
                    u, v = (sum(float(c) * d**k for k, c in enumerate(parts) if c is not None) for parts in (a, b))
                    true = (u * v, u + v, u / v, 3.0 - u, u - v)
                    for number, form in enumerate((x * y, x + y, x / y, 3 - x, x - y)):
                        here = sum((part * arb(d)**k for k, part in enumerate(form.parts) if part is not None), zero)
                        assert (here + arb(0, 1e-15)).contains(arb(true[number]))


def test_sines_of_forms_are_narrow_about_their_values():
    """The part of second order holds t2 cos - t1^2 sin / 2, and is no wider than the range makes it."""
    reach = Reach(2.0**-12, 2)
    sine, cosine = Form(reach, arb(0.9), arb(1.5), arb(-0.7)).sin_cos()
    s, c = np.sin(0.9), np.cos(0.9)
    for form, want in ((sine, (s, 1.5 * c, -0.7 * c - 1.125 * s)), (cosine, (c, -1.5 * s, 0.7 * s - 1.125 * c))):
        assert [float(v.mid()) for v in form.parts] == pytest.approx(want, abs=5e-3)
        assert all(float(v.rad()) < 5e-3 for v in form.parts)
    inverse = Form(reach, arb(2.0), arb(1.5), arb(-0.7)).reciprocal()
    assert [float(v.mid()) for v in inverse.parts] == pytest.approx((0.5, -0.375, 0.175 + 2.25 / 8.0), abs=2e-3)
    assert all(float(v.rad()) < 2e-3 for v in inverse.parts)


def test_range_slope_and_lower_order_of_a_form():
    reach = Reach(0.5, 2)
    form = Form(reach, arb(1), arb(2), arb(-4))
    assert all(form.value.contains(arb(1 + 2 * d - 4 * d * d)) for d in (-0.5, 0.0, 0.25, 0.5))
    assert size(form.value) == pytest.approx(2.0, rel=1e-6)  # 1 +- 1 + [-1, 0]
    assert float(form.value.lower()) == pytest.approx(-1.0, abs=1e-6) and float(form.value.upper()) == pytest.approx(2.0, abs=1e-6)
    assert float(form.slope.lower()) == pytest.approx(0.0, abs=1e-6) and float(form.slope.upper()) == pytest.approx(4.0, abs=1e-6)
    first = Reach(0.5, 1)
    lower = form.lower(first)
    assert lower.reach is first and lower.parts[2] is None and lower.parts[1].overlaps(form.slope)
    assert Form(reach, arb(1)).slope is None
    assert float(Form(reach, arb(1), None, arb(-4)).slope.upper()) == pytest.approx(2.0, abs=1e-6)


def test_columns_of_balls_and_forms():
    reach = Reach(0.5, 2)
    plain = column([arb(1), None, arb(3)])
    assert floats(plain).tolist() == [[1.0], [0.0], [3.0]]
    mixed = column([arb(1), None, Form(reach, arb(5), arb(6))])
    assert floats(mixed.parts[0]).tolist() == [[1.0], [0.0], [5.0]] and floats(mixed.parts[1]).tolist() == [[0.0], [0.0], [6.0]]
    assert mixed.parts[2] is None and mixed.reach is reach
    assert float(mixed[2, 0].parts[1]) == 6.0
    assert total(None, None) is None and float(total(None, arb(2))) == 2.0 and float(total(arb(2), None)) == 2.0
