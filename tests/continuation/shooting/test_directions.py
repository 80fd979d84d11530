"""Directions in which solutions leave a point where the equations lose another rank: two lines, or none at a cusp."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.continuation import Problem
from bifurc.continuation.shooting.directions import chords, directions, found_again


class TwoDurations(Problem):
    """The parameter at zero, and one equation between two durations: ``f(a, b)``."""

    def __init__(self, f):
        super().__init__([0.0, 0.0], 0.0, scale_u=1.0, scale_p=1.0)
        self.f = f

    def residual(self, u, p):
        return np.array([p, self.f(*u)])


@pytest.mark.parametrize("slope", [1.0, 0.3, 4.0])
def test_two_lines_that_cross(slope):
    """a^2 = (slope b)^2, and what is of third order bends the lines without turning them."""
    lines = directions(TwoDurations(lambda a, b: a * a - (slope * b)**2 + a**3), np.zeros(3))
    wanted = np.array([[slope, 1.0, 0.0], [slope, -1.0, 0.0]]) / np.hypot(slope, 1.0)
    assert len(lines) == 2
    for line in wanted:
        assert max(abs(line @ other) for other in lines) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("around", [1e-3, 1e-4])
@pytest.mark.parametrize("slope", [1.0, 0.3])
def test_each_way_of_two_lines_is_one_chord(slope, around):
    """Newton comes to one of four solutions from every angle: two lines, either way, and each of them once."""
    found, lost = chords(TwoDurations(lambda a, b: a * a - (slope * b)**2), np.zeros(3), np.eye(3)[:2], around)
    wanted = np.array([[slope, 1.0, 0.0], [slope, -1.0, 0.0]]) / np.hypot(slope, 1.0)
    assert len(found) == 4 and not lost
    for line in (*wanted, *-wanted):
        assert max(line @ other for other in found) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("length", [1e-4, 3e-5])
def test_a_line_that_bends_within_the_length_at_which_it_is_looked_for(length):
    """b = a, and b = -a - a^2/length: chords of the second one as long as that are off its direction by half a right angle."""
    lines = directions(TwoDurations(lambda a, b: (b - a) * (b + a + a * a / length)), np.zeros(3))
    assert len(lines) == 2
    for line in np.array([[1.0, 1.0, 0.0], [1.0, -1.0, 0.0]]) / np.sqrt(2.0):
        assert max(abs(line @ other) for other in lines) > 0.98


def test_two_lines_of_a_form_of_fourth_order():
    """a^4 = b^4, as of two slips that end at once."""
    lines = directions(TwoDurations(lambda a, b: 1e-2 * (a**4 - b**4)), np.zeros(3))
    assert all(abs(line[-1]) < 1e-12 for line in lines)


def test_no_direction_at_a_cusp():
    """b^2 = a^3: from either side of one branch Newton comes to the other."""
    assert directions(TwoDurations(lambda a, b: b * b - a**3), np.zeros(3)) == []


@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_directions_are_those_in_any_unit_of_time(unit):
    """Two lines and a cusp, of durations that are long or short."""
    def in_unit(f):
        problem = TwoDurations(lambda a, b: f(a / unit, b / unit))
        problem.scale[:2] = unit
        return directions(problem, np.zeros(3))
    lines = in_unit(lambda a, b: a * a - b * b + a**3)
    assert len(lines) == 2
    for line in np.array([[1.0, 1.0, 0.0], [1.0, -1.0, 0.0]]) / np.sqrt(2.0):
        assert max(abs(line @ other) for other in lines) == pytest.approx(1.0, abs=1e-6)
    assert in_unit(lambda a, b: b * b - a**3) == []


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize(("left", "back"), [(0.0, True), (0.05, True), (0.2, False), (1.0, False)])
def test_a_solution_is_found_again_to_a_tenth_of_the_way_aside_in_any_unit(unit, left, back):
    """Newton that leaves a part of the way aside: 0 where it ends on the line, 1 where everything is a solution."""
    along = np.array([0.6, 0.8, 0.0])

    def correct(guess, tangent):
        made = unit * along * (along @ guess) / unit
        return SimpleNamespace(x=made + left * (guess - made), converged=True, iterations=3)
    problem = SimpleNamespace(scale=np.full(3, unit), correct=correct)
    assert found_again(problem, np.zeros(3), along, np.eye(3)[:2]) is back
