"""Signs of guards on a segment: Bernstein coefficients, their halves, and margins of motions in closed form."""
import math

import numpy as np
import pytest

from bifurc.certify import segments
from bifurc.certify.arithmetic.jets import Jet
from bifurc.certify.segments import (
    Steps,
    above_all,
    bernstein_balls,
    bernstein_matrix,
    column,
    halves,
    hull,
    negative,
    rate,
    searched,
)

flint = pytest.importorskip("flint")
arb, mat = flint.arb, flint.arb_mat
pytestmark = pytest.mark.usefixtures("bits")


def bernstein(values, t):
    n = len(values) - 1
    return sum(math.comb(n, i) * t**i * (1 - t)**(n - i) * v for i, v in enumerate(values))


def floats(b):
    return [float(v.mid()) for v in b]


@pytest.mark.parametrize("order", [1, 3, 6])
def test_bernstein_coefficients_stand_for_the_polynomial_and_so_do_those_of_both_halves(order, rng):
    a = rng.integers(-8, 9, order + 1).astype(float)
    b = hull([arb(float(v)) for v in a])
    left, right = (floats(part) for part in halves(b))
    for t in np.linspace(0.0, 1.0, 7):
        value = np.polynomial.polynomial.polyval(t, a)
        assert bernstein(floats(b), t) == pytest.approx(value, abs=1e-12)
        assert min(floats(b)) - 1e-12 <= value <= max(floats(b)) + 1e-12
        assert bernstein(left, t) == pytest.approx(np.polynomial.polynomial.polyval(0.5 * t, a), abs=1e-12)
        assert bernstein(right, t) == pytest.approx(np.polynomial.polynomial.polyval(0.5 + 0.5 * t, a), abs=1e-12)
    rows, exact = bernstein_balls(order), bernstein_matrix(order)
    assert all(rows[i, k].contains(arb(exact[i][k])) for i in range(order + 1) for k in range(order + 1))
    assert above_all(b) >= max(floats(b)) and negative([arb(-1), arb(-2)]) and not negative([arb(-1), arb(-1, 1)])
    assert floats(column(mat(2, 1, [3.0, 4.0]))) == [3.0, 4.0]


def of(coefficients):
    return hull([arb(float(c)) for c in coefficients])


@pytest.mark.parametrize(("top", "place"), [(-0.1, 0.3), (-1e-3, 0.72), (-1e-6, 0.5)])
def test_a_polynomial_below_zero_has_a_margin(top, place):
    """top - (t - place)^2: its largest value and where."""
    proved, violated, margin, at = searched(of([top - place**2, 2.0 * place, -1.0]), -math.inf)
    assert proved and not violated
    assert 0.9 * -top <= margin <= -top and abs(at - place) <= 0.25


def test_a_polynomial_above_zero_somewhere_is_violated_there():
    proved, violated, _, at = searched(of([1e-3 - 0.3**2, 0.6, -1.0]), -math.inf)  # 1e-3 - (t - .3)^2
    assert not proved and violated and abs(at - 0.3) < math.sqrt(1e-3) + 1e-12
    assert searched(of([1.0, -2.0]), -math.inf)[:2] == (False, True)
    assert searched(of([1.0, -2.0]), -math.inf)[3] == 0.0
    assert searched(of([-1.0, 2.0]), -math.inf)[3] == 1.0


def test_a_polynomial_that_touches_zero_is_undecided_there():
    proved, violated, _, at = searched(of([-0.140625, 0.75, -1.0]), -math.inf)  # -(t - .375)^2
    assert not proved and not violated and at == pytest.approx(0.375, abs=0.05)


def test_the_place_of_a_margin_that_is_only_told_at_once():
    """A line that falls from its nearest point, and one that rises to it: the place is in the half that is nearest."""
    for coefficients in ([-0.1, -1.0], [-1.1, 1.0]):
        proved, _, margin, at = searched(of(coefficients), -math.inf)
        assert proved and 0.09 < margin <= 0.1 + 1e-12 and 0.0 < at < 1.0
    assert searched(of([-0.5, 0.0]), -math.inf)[3] == 0.5


def test_margins_farther_than_the_floor_are_not_searched():
    """Nearer than .2 somewhere else already: a distance of one half is only known to exceed it."""
    proved, violated, margin, _ = searched(of([-0.5 - 0.25, 1.0, -1.0]), -0.2)
    assert proved and not violated and margin >= 0.19
    assert segments.HALVINGS == 40


@pytest.mark.parametrize("scale", [1.0, 1e8])
def test_the_rate_of_a_generator_does_not_depend_on_units(scale):
    """x' = v, v' = -4 x: two radians a unit of phase, whatever x is measured in."""
    B = mat(2, 2, [0.0, scale, -4.0 / scale, 0.0])
    assert rate(B) == pytest.approx(2.0, rel=1e-3)
    damped = mat(2, 2, [0.0, 1.0, -4.0, -3.0])
    assert 3.0 <= rate(damped) <= 5.1
    assert rate(mat(2, 2, [0.0, 0.25, -1e-4, 0.0])) == pytest.approx(5e-3, rel=1e-3)  # slow
    assert rate(mat(2, 2, [0.5, 0.0, 0.0, -7.0])) == pytest.approx(7.0)


# x = cos t, v = -sin t, and a constant: B of (x, v, 1)
B = [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]


def steps(guard, span, rows=B):
    size = len(rows)
    return Steps(Jet(mat(size, size, np.ravel(rows).tolist())), [mat(1, size, guard)], Jet(arb(float(span))))


def start_of(phase):
    return Jet(mat(3, 1, [arb(float(phase)).cos(), -arb(float(phase)).sin(), arb(1)]))


def judged(guard, phase, span, order=0, ends_here=False):
    made, start = steps(guard, span), start_of(phase)
    states = made.states(start)
    assert len(states) == made.count and made.count >= 2
    for k, x in enumerate(states):  # the states are those of the closed form
        t = phase + k * span / made.count
        assert float(x[0, 0].mid()) == pytest.approx(math.cos(t), abs=1e-14)
        assert float(x[1, 0].mid()) == pytest.approx(-math.sin(t), abs=1e-14)
    return made.sign(0, states, made.E.value * states[-1], order, ends_here)


@pytest.mark.parametrize("clearance", [0.2, 1e-2, 1e-4])
def test_margin_of_a_motion_beside_a_stop(clearance):
    """cos t - 1 - c over more than a period from .4: nearest at 2 pi."""
    found = judged([1.0, 0.0, -1.0 - clearance], 0.4, 7.0)
    assert found.proved and not found.violated
    assert 0.9 * clearance <= found.margin <= clearance
    assert found.at == pytest.approx(2.0 * math.pi - 0.4, abs=0.1)


def test_a_motion_through_a_stop_is_violated_where_it_is_beyond():
    found = judged([1.0, 0.0, -0.9], 0.6, 7.0)
    assert not found.proved and found.violated and found.margin == 0.0
    assert math.cos(0.6 + found.at) > 0.9


@pytest.mark.parametrize(("guard", "phase", "order"), [
    ([1.0, 0.0, -math.cos(0.4)], 0.4, 1),  # falls from its zero at once
    ([1.0, 0.0, -1.0], 0.0, 2),  # from its maximum
])
def test_a_zero_at_the_start_is_divided_out(guard, phase, order):
    made = judged(guard, phase, 4.0, order=order)
    assert made.proved and not made.violated
    if phase == 0.0:
        assert not judged(guard, phase, 4.0, order=0).proved  # not listed
    assert judged(guard, phase, 7.0, order=order).violated == (phase == 0.4)  # it comes back in more than a period


def test_a_guard_that_rises_from_its_zero_is_violated():
    found = judged([1.0, 0.0, -math.cos(5.0)], 5.0, 0.5, order=1)
    assert not found.proved
    back = judged([1.0, 0.0, -math.cos(0.1)], -0.1, 0.5, order=1)  # below zero again in the second of two steps
    assert not back.proved and back.violated and 0.0 <= back.at < 0.2


def test_a_simple_zero_at_the_end_is_divided_out():
    """cos t - cos 1 from 2.0 to 2 pi - 1, where it arrives."""
    end = 2.0 * math.pi - 1.0
    guard = [1.0, 0.0, -math.cos(1.0)]
    made = steps(guard, end - 2.0)
    states = made.states(start_of(2.0))
    arrived = mat(3, 1, [arb(end).cos(), -arb(end).sin(), arb(1)])
    found = made.sign(0, states, arrived, 0, True)
    assert found.proved and not found.violated
    assert not made.sign(0, states, arrived, 0, False).proved
    late = steps(guard, end - 2.0 + 0.3)  # three tenths too long: it was beyond
    states = late.states(start_of(2.0))
    assert not late.sign(0, states, late.E.value * states[-1], 0, False).proved


def test_steps_are_as_many_as_the_rate_and_the_phase_ask_for():
    assert steps([1.0, 0.0, 0.0], 6.9).count == math.ceil(6.9 * rate(mat(3, 3, np.ravel(B).tolist())) / segments.TURN)
    assert steps([1.0, 0.0, 0.0], 1e-3).count == 2
    fast = steps([1.0, 0.0, 0.0], 1.0, [[0.0, 1e5, 0.0], [-1e5, 0.0, 0.0], [0.0, 0.0, 0.0]])
    assert fast.too_many and fast.count == segments.MOST_STEPS and not steps([1.0, 0.0, 0.0], 7.0).too_many
    known = Steps(Jet(mat(3, 3, np.ravel(B).tolist())), [], Jet(arb(7)), known_rate=2.95)
    assert known.count == math.ceil(7.0 * 2.95 / segments.TURN) and float(known.h.mid()) == pytest.approx(7.0 / known.count)
