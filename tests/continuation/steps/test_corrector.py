"""The corrector by itself: how each of its ends comes about, on equations whose Newton steps are known."""
import math

import numpy as np
import pytest

from bifurc.continuation import Problem, trace
from bifurc.continuation.kinds import CorrectorStatus

PLANE = np.array([0.0, 1.0])  # the parameter is kept


class Scalar(Problem):
    """One unknown, f(u) = p."""

    def __init__(self, f, slope, u=0.0, p=0.0):
        super().__init__(u, p, scale_u=1.0, scale_p=1.0)
        self.f, self.slope = f, slope

    def residual(self, u, p):
        return np.array([self.f(float(u[0])) - p])

    def jacobian(self, u, p):
        return np.array([[self.slope(float(u[0]))]]), np.array([-1.0])


class Scripted(Problem):
    """Newton steps as they are told, whatever the point."""

    def __init__(self, steps):
        super().__init__(0.0, 0.0, scale_u=1.0, scale_p=1.0)
        self.left, self.floor = list(steps), 0.0

    def _linearised(self, x):
        step = self.left.pop(0)
        return np.array([step]), np.array([[1.0, 0.0]]), np.array([self.floor])


def newton(f, slope, u):
    """Yield the lengths of Newton's steps from u."""
    while True:
        step = f(u) / slope(u)
        yield abs(step)
        u -= step


@pytest.mark.parametrize("start", [1.42, 1.6, 3.0])
def test_steps_that_grow_twice_as_long_are_given_up(start):
    """Of arctan Newton diverges from beyond 1.3917; it is given up where one step is more than twice the last."""
    def slope(u):
        return 1.0 / (1.0 + u * u)
    found = Scalar(math.atan, slope).correct(np.array([start, 0.0]), PLANE, True)
    lengths, count = newton(math.atan, slope, start), 0
    old = next(lengths)
    while (now := next(lengths)) <= 2.0 * old:
        old, count = now, count + 1
    assert not found.converged and found.status is CorrectorStatus.NOT_CONVERGED and found.iterations == count + 1
    assert found.distance == found.contraction == math.inf
    closer = Scalar(math.atan, slope).correct(np.array([1.38, 0.0]), PLANE, True)
    assert closer.converged and closer.x == pytest.approx([0.0, 0.0], abs=1e-12) and closer.distance == pytest.approx(1.38)


def test_rounding_may_grow_but_not_what_is_more():
    """Steps of 1e-9, 5e-9 are noise of a residual, of 1e-7, 5e-7 they are not."""
    noise = Scripted([1e-9, 5e-9, 1e-9, 1e-11, 0.0, 0.0]).correct(np.zeros(2), PLANE, True)
    assert noise.converged and noise.x[0] == pytest.approx(-(1e-9 + 5e-9 + 1e-9 + 1e-11), rel=1e-12)
    lost = Scripted([1e-7, 5e-7, 1e-9, 1e-11, 0.0]).correct(np.zeros(2), PLANE, True)
    assert not lost.converged and lost.status is CorrectorStatus.NOT_CONVERGED and lost.iterations == 1 and lost.residual == 5e-7
    slow = Scripted([1e-3, 1.9e-3, 1e-3, 1e-5, 1e-9, 1e-12, 0.0]).correct(np.zeros(2), PLANE, True)
    assert slow.converged  # grows by less than twice


def test_it_ends_when_the_next_step_would_be_rounding():
    """After a step of 1e-10 or less, or where a quadratic one that is foreseen would be below it."""
    small = Scripted([1e-3, 0.9e-10, 7.0]).correct(np.zeros(2), PLANE, True)
    assert small.converged and small.iterations == 2 and small.x[0] == pytest.approx(-1e-3 - 0.9e-10, rel=1e-14)
    not_yet = Scripted([1e-2, 1e-6, 1e-9, 7.0]).correct(np.zeros(2), PLANE, True)  # 1e-3 squared times 1e-9 is not below it
    assert not not_yet.converged and not_yet.iterations == 3
    steep = Scripted([1e-1, 1e-4, 3e-10, 7.0]).correct(np.zeros(2), PLANE, True)  # 3e-6 squared times 3e-10
    assert steep.converged and steep.iterations == 3 and steep.contraction == pytest.approx(3e-6)
    at_once = Scripted([0.0, 7.0]).correct(np.array([0.3, 0.0]), PLANE, True)
    assert at_once.converged and (at_once.iterations, at_once.distance) == (0, 0.0)


def test_ten_steps_are_all():
    halves = Scripted([0.5**k for k in range(40)]).correct(np.zeros(2), PLANE, True)
    assert halves.status is CorrectorStatus.NOT_CONVERGED and halves.iterations == 10
    assert halves.x[0] == pytest.approx(-2.0 * (1.0 - 0.5**10))


def test_singular_and_lost_points_are_told_apart():
    flat = Scalar(lambda u: u * u + 1.0, lambda u: 2.0 * u).correct(np.zeros(2), PLANE, True)
    assert flat.status is CorrectorStatus.SINGULAR and (flat.iterations, flat.residual) == (0, 1.0)
    for f, slope in ((lambda u: math.nan, lambda u: 1.0), (lambda u: u - 1.0, lambda u: math.inf)):
        lost = Scalar(f, slope).correct(np.zeros(2), PLANE, True)
        assert lost.status is CorrectorStatus.NOT_FINITE and lost.iterations == 0
    fold = Scalar(lambda u: u * u, lambda u: 2.0 * u).correct(np.zeros(2), PLANE, True)  # solved, but p does not move it
    assert fold.status is CorrectorStatus.SINGULAR and fold.converged


@pytest.mark.parametrize("fixed", [True, False])
def test_the_plane_or_the_parameter_is_kept(fixed):
    """u^2 = p, from a guess beside it: along the parameter, or at right angles to the tangent."""
    problem = Scalar(lambda u: u * u, lambda u: 2.0 * u)
    tangent = np.array([0.6, 0.8])
    guess = np.array([1.2, 1.0])
    found = problem.correct(guess, tangent, fixed)
    assert found.converged and found.x[0]**2 == pytest.approx(found.x[1], rel=1e-14)
    if fixed:
        assert found.x[1] == 1.0 and found.x[0] == pytest.approx(1.0)
    else:
        assert tangent @ (found.x - guess) == pytest.approx(0.0, abs=1e-15)
    along = np.array([1.0, 2.0 * found.x[0]])
    assert found.tangent == pytest.approx(along / np.linalg.norm(along)) and found.distance == pytest.approx(
        np.linalg.norm(found.x - guess))
    back = problem.correct(guess, -tangent, fixed)
    assert back.tangent == pytest.approx(-found.tangent) and back.x == pytest.approx(found.x)


class Measured(Problem):
    """sin u = p with u measured in ``a`` and p in ``b``; its Jacobian is differenced."""

    def __init__(self, a, b):
        super().__init__(0.0, 0.0, scale_u=a, scale_p=b)
        self.a, self.b = a, b

    def residual(self, u, p):
        return np.array([math.sin(float(u[0]) / self.a) - p / self.b])


@pytest.mark.parametrize("u", [0.0, 0.3, 2.0])
@pytest.mark.parametrize(("a", "b"), [(1.0, 1.0), (1e-7, 1e5), (1e6, 1e-9)])
def test_differences_are_as_good_in_every_unit(a, b, u):
    """Steps are parts of the natural sizes, also where a number is zero."""
    fu, fp = Measured(a, b).jacobian(np.array([u * a]), 0.5 * b)
    assert fu[0, 0] * a == pytest.approx(math.cos(u), abs=1e-10) and fp[0] * b == pytest.approx(-1.0, abs=1e-10)


def test_defaults_of_the_natural_sizes():
    """The largest unknown, at least 1, in the root mean square; the parameter is left to the bounds."""
    for u0 in ([3.0, -4.0], [0.2, 0.1, -0.3], [5.0]):
        scale = Problem(u0, 2.0).scale
        assert scale[:-1] == pytest.approx(max(1.0, np.abs(u0).max()) * math.sqrt(len(u0))) and math.isnan(scale[-1])
    for bad in (0.0, -1.0, math.inf):
        with pytest.raises(ValueError, match="scale_u must be finite and positive"):
            Problem(1.0, 0.0, scale_u=bad)
        with pytest.raises(ValueError, match="scale_p must be finite and positive"):
            Problem(1.0, 0.0, scale_p=bad)


class Copies(Problem):
    """The equation u + u^3 = p, several times."""

    def residual(self, u, p):
        return u + u**3 - p

    def jacobian(self, u, p):
        return np.diag(1.0 + 3.0 * u * u), np.full(u.size, -1.0)


def test_copies_of_an_equation_make_the_same_branch():
    """Lengths are root mean squares: one unknown or many that are alike, the same rows."""
    one, many = (trace(Copies(np.zeros(n), 0.0), bounds=(-3.0, 3.0)) for n in (1, 7))
    assert len(one) == len(many) > 10
    np.testing.assert_allclose(many.column("parameter"), one.column("parameter"), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(many.column("s"), one.column("s"), rtol=1e-9)
