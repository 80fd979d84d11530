"""Number fields of a proof: floats enter exactly, and leave rounded to the side that is asked for."""
import math
from fractions import Fraction

import numpy as np
import pytest

from bifurc.certify.arithmetic import balls
from bifurc.certify.arithmetic.balls import Balls, Rationals, Recorder, above, below, ends, middle, radius, size, working
from bifurc.checks import KINDS

flint = pytest.importorskip("flint")


def test_precision_is_that_of_the_block_and_what_it_was_behind_it():
    before = flint.ctx.prec
    with working(200):
        assert flint.ctx.prec == 200
        with pytest.raises(KeyError), working(None):
            assert flint.ctx.prec == balls.PRECISION == 96
            raise KeyError
        assert flint.ctx.prec == 200
    assert flint.ctx.prec == before


@pytest.mark.parametrize("wrong", [63, 100_001, 0, -64, 96.0, True, "96"])
def test_precisions_that_are_none_are_refused(wrong):
    with pytest.raises(ValueError, match=r"precision = .* whole number, at least 64 and at most 100000"):
        KINDS["precision"]("certify", "precision", wrong)


def test_precisions_that_are_allowed():
    assert [KINDS["precision"]("certify", "precision", value) for value in (64, 96, 100_000)] == [64, 96, 100_000]


@pytest.mark.parametrize("value", [1.0 / 3.0, -0.1, 5e-324, -1.7e308, 0.0, 3.0])
def test_floats_enter_without_error(value):
    rational = Rationals().number(value)
    assert Fraction(int(rational.p), int(rational.q)) == Fraction(value)
    ball = Balls().number(value)
    assert float(ball.mid()) == value and ball.rad() == 0


def test_enclosures_replace_the_floats_in_their_order():
    field = Balls([flint.arb(2, 0.5), flint.arb(7)])
    assert middle(field.number(1.0)) == 2.0 and middle(field.number(1.0)) == 7.0
    noted = Recorder()
    assert [noted.number(v) for v in (3.0, -1.0)] == noted.floats == [3.0, -1.0]
    assert not noted.computes and field.computes


@pytest.mark.parametrize("centre", [2.0, -2.0, 0.1, -0.1, 1e-30, -3e20])
@pytest.mark.parametrize("share", [0.0, 0.25, 3.0])
def test_bounds_lie_outside_and_not_far(centre, share):
    r = share * abs(centre)
    ball = flint.arb(centre, r)
    low, high = Fraction(centre) - Fraction(r), Fraction(centre) + Fraction(r)
    near = 1e-7 * (abs(centre) + r)  # the radius of a ball has 30 bits
    assert Fraction(below(ball)) <= low and below(ball) == pytest.approx(float(low), abs=near)
    assert Fraction(above(ball)) >= high and above(ball) == pytest.approx(float(high), abs=near)
    assert ends(ball) == (below(ball), above(ball))
    largest = max(abs(low), abs(high))
    assert Fraction(size(ball)) >= largest and size(ball) == pytest.approx(float(largest), abs=near)
    assert radius(ball) >= r and radius(ball) == pytest.approx(r, abs=near)
    assert middle(ball) == centre


def test_bounds_of_a_number_that_is_no_float_are_strict():
    with working(96):
        third = flint.arb(1) / 3
        assert Fraction(below(third)) < Fraction(1, 3) < Fraction(above(third))
        assert above(third) - below(third) <= 4.0 * np.spacing(1.0 / 3.0)
        assert Fraction(size(-third)) > Fraction(1, 3)
        assert below(flint.arb(1)) < 1.0 < above(flint.arb(1)) and math.nextafter(above(flint.arb(1)), 0.0) == 1.0
