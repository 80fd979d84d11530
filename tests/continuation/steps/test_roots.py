"""Roots of a test along a curve: brackets, measured errors, noise, and what is given up."""
import math
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.continuation.steps.roots import bracketed, enclose, off_line, polish

TESTS = {
    "line": (lambda t: 3.0 * t - 0.6, 0.2),
    "falling": (lambda t: 0.2 - t + 0.1 * math.sin(9.0 * (t - 0.2)), 0.2),
    "triple": (lambda t: (t - 0.7)**3 * 1e4, 0.7),
    "steep at one end": (lambda t: math.exp(20.0 * t) - math.exp(16.0), 0.8),
    "small at one end for another reason": (lambda t: (t * t + 1e-13) * (t - 0.6), 0.6),
    "tiny": (lambda t: 1e-30 * (t**3 - 0.027), 0.3),
}


def watched(f, p=lambda t: t):
    """Return ``f`` as a test along a curve, with the points that were asked and their parameters."""
    def made(t):
        made.asked.append(t)
        return f(t), SimpleNamespace(x=np.array([t, p(t)]))
    made.asked = []
    return made


@pytest.mark.parametrize("name", TESTS)
@pytest.mark.parametrize("ends", ((0.0, 1.0), (1.0, 0.0)))
@pytest.mark.parametrize("guess", (None, 0.21, 5.0))
def test_a_bracket_shrinks_onto_its_root(name, ends, guess):
    """From either end, whatever guess; no point is asked outside, and few are."""
    f, root = TESTS[name]
    made, (a, b) = watched(f), ends
    if a > b and guess is not None:
        guess = None
    t, value, point = enclose(made, a, f(a), b, f(b), guess)
    assert abs(value) <= 1e-9 * max(abs(f(a)), abs(f(b))) or abs(t - root) < 1e-11
    assert value == f(t) and (point is None or point.x[0] == t)
    assert t == pytest.approx(root, abs=2e-3 if name == "triple" else 1e-8)
    assert min(made.asked) >= 0.0 and max(made.asked) <= 1.0 and len(made.asked) <= 25
    if guess is not None and guess < 1.0:
        assert made.asked[0] == guess


def test_an_end_that_is_the_root_costs_nothing():
    made = watched(lambda t: t - 1.0)
    assert enclose(made, 0.0, -1.0, 1.0, 0.0) == (1.0, 0.0, None)
    assert enclose(made, 1.0, 0.0, 2.0, 1.0) == (1.0, 0.0, None)
    assert made.asked == []


def test_of_two_ends_alike_that_at_rounding_is_the_root():
    """A row may lie on a boundary but for rounding, of either sign; without one at that level there is nothing to look for."""
    made = watched(lambda t: t)
    assert enclose(made, 0.0, 1e-17, 1.0, 1.0) == (0.0, 1e-17, None)
    assert enclose(made, 0.0, -1.0, 1.0, -1e-17) == (1.0, -1e-17, None)
    assert enclose(made, 0.0, 0.5, 1.0, 1.0) is None
    assert made.asked == []


def test_a_curve_that_ends_has_no_root():
    assert enclose(lambda t: None, 0.0, -1.0, 1.0, 1.0) is None
    assert polish(lambda t: None, 0.5, 0.0, None) is None
    assert bracketed(lambda t: None, 0.0, -1.0, 1.0, 1.0) is None


@pytest.mark.parametrize("ratio", (30.0, 3e3, 1e5))
@pytest.mark.parametrize("sign", (1.0, -1.0))
@pytest.mark.parametrize("bend", (0.0, 0.3))
def test_a_root_in_a_corner_is_that_of_the_flat_side_too(ratio, sign, bend):
    """An end of a bracket is small against the steep side's values while it is far from zero on the flat side."""
    root = 1.0 / 3.0
    made = watched(lambda t: sign * (t - root) * (1.0 + bend * (t - root)) * (ratio if t > root else 1.0))
    found = polish(made, *enclose(made, 0.0, made(0.0)[0], 1.0, made(1.0)[0]))
    assert abs(found.at - root) <= min(found.error, 1e-8) and found.error < 1e-6


@pytest.mark.parametrize("slope", (2.0, -0.3))
@pytest.mark.parametrize("start", (3e-9, -4e-8, 6e-7))
def test_polished_roots_have_an_error_that_holds(slope, start):
    """With a noise of known size: the error covers the true root and is no more than some hundred times the noise."""
    for noise in (0.0, 1e-13, 1e-11):
        def f(t, noise=noise):
            return slope * (t - 0.4) + 0.5 * (t - 0.4)**2 + noise * math.sin(1e12 * t)

        root = polish(watched(f, lambda t: 2.0 + t), 0.4 + start, f(0.4 + start), None)
        assert abs(root.at - 0.4) <= root.error <= (300.0 * noise + 1e-14) / abs(slope) + 1e-15
        assert root.slope == pytest.approx(slope, rel=1e-2)
        assert root.low < root.at < root.high
        assert f(root.low) * f(root.high) < 0.0
        assert root.point.x[0] == root.at


def test_the_noise_of_the_parameter_is_measured_too():
    """p = 2 + 5 t with a noise of 1e-12: what is off the line, times the safety."""
    quiet = polish(watched(lambda t: t - 0.4, lambda t: 2.0 + 5.0 * t), 0.4, 0.0, None)
    noisy = polish(watched(lambda t: t - 0.4, lambda t: 2.0 + 5.0 * t + 1e-12 * math.sin(1e12 * t)), 0.4 + 1e-9, 1e-9, None)
    assert quiet.p_noise < 1e-13
    assert 1e-12 < noisy.p_noise < 64e-12


def test_where_the_slope_vanishes_there_is_nothing_to_polish():
    assert polish(watched(lambda t: 1.0), 0.4, 1.0, None) is None
    assert polish(watched(lambda t: (t - 0.4)**2 + 1e-6), 0.4, 1e-6, None) is None


@pytest.mark.parametrize("sign", (1.0, -1.0))
def test_halving_leaves_a_bracket_with_the_root(sign):
    def f(t):
        return sign * ((t - 0.3) + 1e-3 * math.copysign(1.0, t - 0.3))

    root = bracketed(watched(f), 0.0, f(0.0), 1.0, f(1.0))
    assert root.low <= 0.3 <= root.high and root.high - root.low < 1e-9
    assert root.error == root.high - root.low and abs(root.at - 0.3) <= root.error
    assert root.slope * sign > 0.0
    half = watched(f)

    def broken(t):
        return half(t) if t > 0.4 else None

    assert bracketed(broken, 0.0, f(0.0), 1.0, f(1.0)) is None  # what is left is too wide


@pytest.mark.parametrize("noise", (0.0, 1e-11))
def test_halving_states_the_rounding_of_the_parameter(noise):
    """Points whose parameter is a line and noise: that of the root is the line's to what is stated, which is no more than a few
    times the noise."""
    rng = np.random.default_rng(3)

    def f(t):
        p = 2.0 + 0.1 * t + noise * rng.uniform(-1.0, 1.0)
        return t - 0.3 + 1e-3 * math.copysign(1.0, t - 0.3), SimpleNamespace(x=[0.0, p])

    root = bracketed(f, 0.0, -0.3, 1.0, 0.7)
    rounding = 1e-15
    assert abs(root.point.x[-1] - (2.0 + 0.1 * 0.3)) <= root.p_noise + 0.1 * root.error + rounding
    assert 0.1 * noise <= root.p_noise <= 8.0 * noise + rounding


def test_a_root_of_infinite_slope_is_left_to_halving():
    def f(t):
        return math.copysign(math.sqrt(abs(t - 0.35)), t - 0.35)

    assert enclose(watched(f), 0.0, f(0.0), 1.0, f(1.0)) is None
    root = bracketed(watched(f), 0.0, f(0.0), 1.0, f(1.0))
    assert root.low <= 0.35 <= root.high and root.error < 1e-9


def test_distance_from_the_best_line(rng):
    for _ in range(20):
        places, values = np.sort(rng.normal(size=4)), rng.normal(size=4)
        fit = np.polynomial.Polynomial.fit(places, values, 1)
        assert off_line(places, values) == pytest.approx(np.abs(values - fit(places)).max(), rel=1e-9)
        assert off_line(places, 3.0 - 2.0 * places) < 1e-14
