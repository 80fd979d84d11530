"""Rules for steps: what they say of arcs, cubics and parabolas whose truth is known, compiled as in Python."""
import math

import numpy as np
import pytest

from bifurc.solve import steplaw

RNG = np.random.default_rng(4)


@pytest.mark.parametrize("angle", [0.0, 1e-6, 0.02, 0.1, 0.3])
def test_a_step_along_a_circle_is_credible_and_its_length_is_the_arc(angle):
    radius = 1.7
    along, sideways = radius * math.sin(angle), radius * (1.0 - math.cos(angle))
    if angle == 0.0:
        along = 0.2
    verdict, turn, misfit = steplaw.judged(math.cos(angle), along, sideways, False)
    assert verdict == steplaw.CREDIBLE and misfit == pytest.approx(0.0, abs=1e-7)
    assert turn == pytest.approx(angle, abs=3e-8)  # the cosine of a small angle tells no more
    length = steplaw.arc_length(math.hypot(along, sideways), angle)
    assert length == pytest.approx(radius * angle if angle else along, rel=1e-12)


def test_steps_that_turn_or_lead_aside_are_not_credible():
    assert steplaw.judged(math.cos(0.4), 0.1, 0.02, False)[0] == steplaw.TURNS
    assert steplaw.judged(-1.0, 0.1, 0.0, False)[0] == steplaw.TURNS
    assert steplaw.judged(1.0, 0.1, 0.011, False)[0] == steplaw.LEADS_AWAY
    assert steplaw.judged(1.0, 0.1, 0.009, False)[0] == steplaw.CREDIBLE


def test_two_folds_are_found_on_the_cubic_that_has_them():
    """p' = (t - a)(t - b) in a step of length 1: equal signs at the ends, two zeros between."""
    found = 0
    for a, b in np.sort(RNG.uniform(0.05, 0.95, (200, 2))):
        mean = 1.0 / 3.0 - (a + b) / 2.0 + a * b
        t = steplaw.two_folds(a * b, (1.0 - a) * (1.0 - b), mean)
        assert t == steplaw.two_folds(-a * b, -(1.0 - a) * (1.0 - b), -mean)
        if t > 0.0:
            found += 1
            assert t == pytest.approx(0.5 * (a + b), abs=1e-9)
    assert found == 200
    assert steplaw.two_folds(1.0, 1.0, 1.0) == -1.0 and steplaw.two_folds(1.0, -1.0, 0.0) == -1.0


def test_two_zeros_are_found_on_the_parabola_that_has_them():
    """Zeros a, b of (t - a)(t - b) between the last two rows, or the two before them."""
    for a, b in np.sort(RNG.uniform(0.02, 0.98, (200, 2))):
        values = [(t - a) * (t - b) for t in (-1.5, 0.0, 1.0)]
        assert steplaw.two_zeros(*values, 1.5, 1.0) == pytest.approx(0.5 * (a + b), abs=1e-9)
        values = [(t + a) * (t + b) for t in (-1.0, 0.0, 0.6)]
        assert steplaw.two_zeros(*values, 1.0, 0.6) == pytest.approx(-0.5 * (a + b), abs=1e-9)
    for c, d in np.sort(RNG.uniform(0.02, 0.2, (50, 2)))[:, ::-1]:  # zeros c - d, c + d of a peak that no parabola tells
        values = [abs(t - c) - d for t in (-1.0, 0.0, 1.0)]
        assert 0.0 < steplaw.two_zeros(*values, 1.0, 1.0) < 1.0
        assert -1.0 < steplaw.two_zeros(*values[::-1], 1.0, 1.0) <= 0.0
    for c, d, length in RNG.uniform((-1.0, 0.0, 0.4), (1.0, 0.3, 2.5), (2000, 3)):  # wherever it lies and however steps grow
        values = [abs(t - c * min(1.0, length)) - d for t in (-1.0, 0.0, length)]
        if min(values) > 0.0:
            assert steplaw.two_zeros(*values, 1.0, length) != 2.0
            assert steplaw.two_zeros(*[-value for value in values[::-1]], length, 1.0) != 2.0
    assert steplaw.two_zeros(1.0, 1.0, 1.0, 1.0, 1.0) == 2.0  # constant
    assert steplaw.two_zeros(1.0, 2.0, 3.0, 1.0, 1.0) == 2.0  # grows
    assert steplaw.two_zeros(1.0, 0.5, -0.1, 1.0, 1.0) == 2.0  # changes its sign: that is seen anyway


def test_the_minimum_of_a_number_with_known_rates_is_that_of_its_cubic():
    """(t - a)(t - b)(t + c), positive at the ends of a step or zero at one of them: two zeros, or a zero and one more, are seen."""
    for a, b in np.sort(RNG.uniform(0.05, 0.95, (200, 2))):
        for c in (0.0, 0.5, 3.0):
            number = np.polynomial.Polynomial.fromroots([a, b, -c])
            rate = number.deriv()
            t = steplaw.lowest(number(0.0), number(1.0), rate(0.0), rate(1.0))
            assert t == pytest.approx(max(rate.roots()), abs=1e-9) and number(t) < 0.0
    assert steplaw.lowest(1.0, 1.0, 0.0, 0.0) == -1.0  # constant
    assert steplaw.lowest(1.0, 2.0, -0.2, 2.0) == -1.0  # its minimum is as high as the ends
    assert steplaw.lowest(0.0, 1.0, 1.0, 1.0) == -1.0 == steplaw.lowest(0.0, 1.0, -1e-12, 1.0)  # zero at an end alone


def test_a_jump_is_doubted():
    assert steplaw.doubtful(0.0, 0.0, 1.0, 1.0, 0.1, 0.1, True) == steplaw.CLEAR
    assert steplaw.doubtful(0.02, 0.0, 1.0, 1.0, 0.1, 0.1, True) == steplaw.UNCLEAR
    assert steplaw.doubtful(0.0, 0.0, 0.5, 0.05, 0.1, 0.1, True) == steplaw.UNCLEAR  # the determinant heads for zero
    assert steplaw.doubtful(0.0, 0.0, 0.4, 0.3, 0.1, 0.1, True) == steplaw.JUMPS  # and comes back from beyond it


def test_steps_grow_with_straightness_and_shrink_with_curvature():
    assert steplaw.next_length(0.1, 0.0, 0.0, 3, 1.0) == 0.2
    assert steplaw.next_length(0.1, 0.0, 0.0, 3, 0.15) == 0.15
    assert steplaw.next_length(0.1, 4.0, 4.0, 3, 1.0) == pytest.approx(0.05)  # .4 rad a step: .2 wanted
    assert steplaw.next_length(0.1, 2.0, 1.0, 3, 1.0) == pytest.approx(0.05)  # it grows: expected to grow on
    assert steplaw.next_length(0.1, 0.0, 0.0, 5, 1.0) == pytest.approx(0.12)
    assert steplaw.next_length(0.1, 0.0, 0.0, 6, 1.0) == pytest.approx(0.05)


def test_python_and_the_compiled_rules_say_the_same():
    for a, b, c, d, e in RNG.normal(size=(300, 5)):
        g, h = abs(d) + 0.01, abs(e) + 0.01
        for rule, values in ((steplaw.judged, (math.cos(a), g, abs(b), c > 0.0)), (steplaw.two_folds, (a, b, c)),
                             (steplaw.lowest, (abs(a), abs(b), c, d)),
                             (steplaw.two_zeros, (a, b, c, g, h)), (steplaw.doubtful, (0.01 * a, 0.0, abs(b), abs(c), g, h, True)),
                             (steplaw.next_length, (g, abs(a), abs(b), int(5 + c), h)), (steplaw.arc_length, (g, h)),
                             (steplaw.crosses, (a, int(np.sign(b)), h))):
            assert rule(*values) == pytest.approx(rule.py_func(*values), rel=1e-14)
