"""Unions of boxes that a map carries into themselves: of a spiral towards a point, known in closed form."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.basins.attractors.trapping import MARGIN, _closed, _numbers, _places, touches, trapping
from bifurc.ensemble.outcomes import REACHED

CENTRE = np.array([0.37, -1.21])
SCALE = np.array([2.0, 0.5])


class Spiral:
    """A map that turns about a point by .9 and shrinks by a factor, in the scaled plane."""

    def __init__(self, factor):
        turn = factor * np.array([[np.cos(0.9), -np.sin(0.9)], [np.sin(0.9), np.cos(0.9)]])
        self.map = SCALE[:, None] * turn / SCALE

    def propagate(self, starts, periods):
        ends = CENTRE + (starts - CENTRE) @ np.linalg.matrix_power(self.map, periods).T
        return SimpleNamespace(ends=ends, outcomes=np.full(len(starts), REACHED))


def test_places_and_their_numbers():
    rng = np.random.default_rng(2)
    places = rng.integers(-10**6, 10**6, (500, 2))
    places[:4] = (0, -1), (-1, 0), (-1, -1), (0, 0)
    np.testing.assert_array_equal(_places(_numbers(places.astype(float))), places)
    order = np.lexsort((places[:, 1], places[:, 0]))
    np.testing.assert_array_equal(np.argsort(_numbers(places.astype(float))), order)
    far = _places(_numbers(np.array([[1e30, -1e30]])))[0]
    assert far[0] == -far[1] > 10**9


def test_a_spiral_has_a_trapping_union_that_holds_its_sample():
    points = CENTRE + 1e-3 * SCALE * np.array([[1.0, 0.3], [-0.4, 0.9], [0.2, -0.8]])
    centres, width = trapping(Spiral(0.8), points, SCALE, 0.05)
    boxes = {tuple(box) for box in np.floor(centres / SCALE / width).astype(int).tolist()}
    assert len(boxes) == len(centres) and touches(centres, width, SCALE, points)
    sides = np.linspace(-0.5, 0.5, 5)
    starts = (centres[:, None, None] + np.stack(np.meshgrid(sides, sides), -1) * width * SCALE).reshape(-1, 2)
    ends = Spiral(0.8).propagate(starts, 1).ends / SCALE / width
    for shift in ((0.0, 0.0), (MARGIN, -MARGIN), (-MARGIN, -MARGIN), (MARGIN, MARGIN), (-MARGIN, MARGIN)):
        assert {tuple(box) for box in np.floor(ends + shift).astype(int).tolist()} <= boxes


@pytest.mark.parametrize("factor", [1.0 + 1e-2, 2.0])
def test_a_spiral_outwards_has_none(factor):
    assert trapping(Spiral(factor), CENTRE + 1e-3 * SCALE * np.array([[1.0, 0.3]]), SCALE, 0.05) is None


@pytest.mark.parametrize("away", [0.0, 3.0])
def test_a_closed_union_holds_all_boxes_that_it_began_with_and_all_their_images(away):
    """A contraction, and points beside its centre: nothing comes back to the boxes of the points, which belong to the union."""
    width, points = 0.25, CENTRE + SCALE * (np.array([[0.1, 0.2], [-0.3, 0.0]]) + away)
    carrier = Spiral(0.5)
    boxes = _closed(carrier, points, SCALE, width)
    if away:
        assert boxes is None or {tuple(b) for b in np.floor(points / SCALE / width).tolist()} <= {tuple(b) for b in boxes.tolist()}
        return
    known = {tuple(b) for b in boxes.tolist()}
    assert {tuple(b) for b in np.floor(points / SCALE / width).tolist()} <= known
    corner = np.array([(a, b) for a in (0.0, 0.5, 1.0) for b in (0.0, 0.5, 1.0)])
    starts = ((boxes[:, None] + corner) * width * SCALE).reshape(-1, 2)
    ends = carrier.propagate(starts, 1).ends
    assert {tuple(b) for b in np.floor(ends / SCALE / width).tolist()} <= known
