"""Taylor forms enclose what they stand for, at every point of their range."""
import numpy as np
import pytest

from bifurc.certify.arithmetic.balls import working
from bifurc.certify.arithmetic.forms import Form, Reach
from bifurc.certify.arithmetic.jets import Jet, SeriesField, norm_of

flint = pytest.importorskip("flint")

H = 0.05


def at(form, d):
    """The values of a form at a point of its range."""
    a0, a1, a2 = form.parts
    found = a0
    for k, part in ((1, a1), (2, a2)):
        if part is not None:
            found = found + part * flint.arb(float(d)) ** k
    return found


def random_form(reach, rng, shape=None):
    """A form without width, and the polynomial that it is."""
    c = rng.uniform(-1.0, 1.0, (3, *(shape or ())))
    c[2] *= reach.order == 2

    def part(k):
        return flint.arb(float(c[k])) if shape is None else flint.arb_mat(*shape, c[k].ravel().tolist())
    return Form(reach, part(0), part(1), part(2) if reach.order == 2 else None), lambda d: c[0] + c[1] * d + c[2] * d * d


@pytest.mark.parametrize("order", [1, 2])
def test_arithmetic_of_forms_encloses_the_values(order):
    rng = np.random.default_rng(order)
    reach = Reach(H, order)
    for _ in range(40):
        (a, f), (b, g) = random_form(reach, rng), random_form(reach, rng)
        b = b + flint.arb(3)
        sine, cosine = a.sin_cos()
        forms = [a * b, a - b, a / b, sine, cosine]
        for d in (-H, -0.3 * H, 0.0, 0.77 * H, H):
            x, y = f(d), g(d) + 3.0
            for form, value in zip(forms, (x * y, x - y, x / y, np.sin(x), np.cos(x)), strict=True):
                here = at(form, d) + flint.arb(0, 1e-15)
                assert here.contains(flint.arb(float(value)))
                assert form.value.overlaps(here)
        for form in forms:
            assert float(form.value.rad()) < 4.0 * H  # no wider than its slopes make it
            assert float(at(form, H).rad()) < 40.0 * H**2


@pytest.mark.parametrize("order", [1, 2])
def test_exponentials_enclose_the_values_and_the_derivative(order):
    """exp(M(d)) by flint at single points; its derivative along a second matrix by a difference."""
    rng = np.random.default_rng(7)
    reach = Reach(H, order)
    (M, f), (D, _) = random_form(reach, rng, (3, 3)), random_form(reach, rng, (3, 3))
    scaled = Jet(M * flint.arb(6), D)
    value, slope = scaled.exp().parts
    for d in np.linspace(-H, H, 7):
        compared_with_differences(value, slope, D, f, d)
    assert norm_of(value.value) < 1e5


def compared_with_differences(value, slope, D, f, d):
    """Values and derivative at one point, against flint's exponential."""
    with working(160):
        point = flint.arb_mat(3, 3, (6.0 * f(d)).ravel().tolist())
        direction = at(D, d)
        assert near(at(value, d), point.exp(), 1e-12)
        step = flint.arb(2) ** -40
        difference = ((point + direction * step).exp() - (point - direction * step).exp()) * (1 / (2 * step))
        assert near(at(slope, d), difference, 1e-12)


def near(enclosure, value, slack):
    """Whether every entry of a matrix lies in an enclosure, but for rounding."""
    size = max(1.0, norm_of(value))
    return all((a + flint.arb(0, slack * size)).contains(b.mid())
               for a, b in zip(enclosure.entries(), value.entries(), strict=True))


def test_series_are_taylor_coefficients():
    """(1 + p) / (2 - p), and the inverse of a matrix in p, against their geometric series at p = 0."""
    field = SeriesField([], 5)
    arb = flint.arb
    one = field.scalar(1)
    p = type(one)(arb(0), arb(1), arb(0), arb(0), arb(0))
    found = (one + p) / (field.scalar(2) - p)
    for k, part in enumerate(found.parts):
        assert part.overlaps(arb(0.5**(k + 1) + (0.5**k if k else 0.0)))
    inverse = field.matrix(2, 2, [one, p, p, one]).inv()
    for k, part in enumerate(inverse.parts):  # (1, -p; -p, 1) / (1 - p^2)
        expected = [1.0, 0.0, 0.0, 1.0] if k % 2 == 0 else [0.0, -1.0, -1.0, 0.0]
        assert [float(v) for v in part.entries()] == expected
