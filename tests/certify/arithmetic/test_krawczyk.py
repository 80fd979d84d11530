"""Krawczyk's operator: what is inside, what is empty, what is undecided, and how far a proved box shrinks."""
import numpy as np
import pytest

from bifurc.certify.arithmetic.balls import middle, radius, working
from bifurc.certify.arithmetic.krawczyk import FINE, Zero, bound, krawczyk, meet, preconditioner, tightened

flint = pytest.importorskip("flint")
arb, mat = flint.arb, flint.arb_mat


@pytest.fixture(autouse=True)
def bits():
    with working(128):
        yield


def residual(z):
    """Zeros at (sqrt 2, 3 - sqrt 2) and (-sqrt 2, 3 + sqrt 2); the first equation is in another unit."""
    x, y = z
    return [(x * x - 2) * arb(1e6), x + y - 3]


def jacobian(z):
    return [[z[0] * arb(2e6), arb(0)], [arb(1), arb(1)]]


def judged(middles, radii, **options):
    m = [arb(v) for v in middles]
    X = [arb(v, r) for v, r in zip(middles, radii, strict=True)]
    return krawczyk(m, X, residual(m), jacobian(X), **options)


def test_a_box_round_a_zero_holds_one_and_is_made_small():
    found = judged((1.42, 1.58), (0.02, 0.03))
    assert found.inside and not found.empty
    root = arb(2).sqrt()
    for ball, true in zip(found.box, (root, 3 - root), strict=True):
        assert ball.overlaps(true) and (ball + arb(0, 1e-30)).contains(true.mid())
        assert radius(ball) < 4e-4  # the Jacobian over the box is known to a part in a hundred: so much smaller in a turn at least


@pytest.mark.parametrize(("middles", "radii"), [((1.5, 1.5), (0.02, 0.02)), ((1.42, 1.7), (0.02, 0.03)),
                                                 ((-1.3, 4.3), (0.05, 0.05))])
def test_a_box_beside_a_zero_is_empty(middles, radii):
    found = judged(middles, radii)
    assert found.empty and not found.inside and found.box[0].overlaps(arb(middles[0]))


def test_a_box_with_a_zero_on_its_edge_or_with_two_is_undecided():
    for middles, radii in (((1.40, 1.58), (0.0142135, 0.03)), ((0.0, 3.0), (2.0, 2.0)), ((0.5, 2.5), (1.0, 1.0))):
        found = judged(middles, radii)
        assert not found.inside and not found.empty


def test_a_box_that_is_known_to_hold_a_zero_need_not_hold_the_operator():
    """The operator of a middle that is not that of the box leaves it on one side; what is known is only made smaller."""
    X = [arb(1.42, 0.02), arb(1.58, 0.03)]
    m = [arb(1.4395), arb(1.58)]
    proved = krawczyk(m, X, residual(m), jacobian(X), known=True)
    assert proved.inside and all(a.rad() <= b.rad() for a, b in zip(proved.box, X, strict=True))
    assert proved.box[0].overlaps(arb(2).sqrt())


def test_a_box_shrinks_turn_by_turn_as_far_as_its_middle_is_right():
    found = judged((1.4142, 1.5858), (0.02, 0.03))
    assert found.inside and max(radius(b) for b in found.box) < 1e-6  # after two turns it would be 4e-6


def test_without_a_preconditioner_nothing_is_said():
    m = [arb(1), arb(1)]
    flat = [[arb(1), arb(2)], [arb(2), arb(4)]]
    found = krawczyk(m, [arb(1, 0.1)] * 2, [arb(0), arb(0)], flat)
    assert found == Zero(False, False, found.box) and radius(found.box[0]) == pytest.approx(0.1)
    assert preconditioner(flat) is None
    assert preconditioner([[arb(1), arb(1)], [arb(1), arb(1 + 1e-13)]]) is None  # worse than floats can tell
    assert preconditioner([[arb(1), arb(1)], [arb(1), arb(1 + 1e-11)]]) is not None
    assert preconditioner([[arb("nan"), arb(0)], [arb(0), arb(1)]]) is None
    assert preconditioner([[arb(0), arb(0)], [arb(0), arb(1)]]) is None


def test_what_is_not_finite_is_undecided():
    m, X = [arb(1.42), arb(1.58)], [arb(1.42, 0.02), arb(1.58, 0.03)]
    found = krawczyk(m, X, [arb("nan"), arb(0)], jacobian(X))
    assert not found.inside and not found.empty


def test_the_preconditioner_is_the_inverse_whatever_the_units_of_rows(rng):
    A = rng.normal(size=(3, 3)) * np.array([1e-30, 1.0, 1e25])[:, None]
    Y = preconditioner([[arb(float(v), 1e-40) for v in row] for row in A])
    np.testing.assert_allclose(float(preconditioner([[arb(-4.0)]])[0, 0]), -0.25)
    for scale in (1.0, -1e20):  # and whatever their signs
        assert preconditioner([[arb(-1.0) * scale, arb(-1e-14) * scale], [arb(-1e-14), arb(-1.0)]]) is not None
        assert preconditioner([[arb(-1.0) * scale, arb(-1.0) * scale], [arb(-1.0) * scale, arb(-1.0 - 2e-14) * scale]]) is None
    product = np.array([[float(Y[i, j].mid()) for j in range(3)] for i in range(3)]) @ A
    np.testing.assert_allclose(product, np.eye(3), atol=1e-10)


def test_a_proved_box_is_tightened_to_the_last_digit_asked_for():
    with working(256):
        first = judged((1.42, 1.58), (0.02, 0.03))
        Y = preconditioner(jacobian(first.box))
        scale = (1.0, 1.0)
        found = tightened(first, scale, residual, jacobian, Y)
        root = arb(2).sqrt()
        assert found.inside and all(b.overlaps(v) for b, v in zip(found.box, (root, 3 - root), strict=True))
        assert max(radius(b) for b in found.box) < 1e-6 * max(radius(b) for b in first.box)
        beside = Zero(True, False, [root - arb(0.004) + arb(0, 0.005), 3 - root + arb(0, 1e-4)])  # a zero off the middle
        assert max(radius(b) for b in tightened(beside, scale, residual, jacobian, Y).box) < 1e-12
        again = tightened(Zero(True, False, [root + arb(0, 0.5 * FINE), 3 - root]), scale, residual, jacobian, Y)
        assert radius(again.box[0]) == pytest.approx(0.5 * FINE, rel=1e-6)  # fine enough: left as it is
        large = tightened(Zero(True, False, [root + arb(0, 0.5), 3 - root + arb(0, 0.5)]), (1e30, 1e30), residual, jacobian, Y)
        assert radius(large.box[0]) == pytest.approx(0.5)  # that of scaled unknowns
        refused = tightened(first, scale, lambda z: [arb("nan")] * 2, jacobian, Y)
        assert refused.box == first.box


def test_the_smaller_ball_and_the_norm():
    a, b = arb(1, 0.5), arb(1.2, 0.25)
    assert meet(a, b) is b and meet(b, a) is b
    C = mat(2, 2, [arb(1, 0.5), arb(-2), arb(0.25), arb(1)])
    assert bound(C) == pytest.approx(3.5, rel=1e-7) and bound(C) >= 3.5
    assert middle(C[0, 1]) == -2.0
