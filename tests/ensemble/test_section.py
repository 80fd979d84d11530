"""Sections of motions without a clock, and boxes of chaotic attractors."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.ensemble import proximity


def test_each_direction_of_a_section_has_the_crossings_of_its_own():
    """q = cos t passes .5 falling at pi / 3 + 2 pi k and rising at -pi / 3 + 2 pi k; both together are all."""
    motion = bf.simulate(bf.System(1.0, 0.0, 1.0), (1.0, 0.0), duration=4.0 * np.pi)
    falling, rising = np.array([1.0, 7.0]) * np.pi / 3.0, np.array([5.0, 11.0]) * np.pi / 3.0
    for direction, times in ((-1, falling), (1, rising), (0, np.sort([*falling, *rising]))):
        t, y = bf.Section("q0", 0.5, direction).crossings(motion)
        np.testing.assert_allclose(t, times, rtol=0, atol=1e-10)
        np.testing.assert_allclose(y[:, 0], 0.5, rtol=0, atol=1e-12)
        assert direction == 0 or (np.sign(y[:, 1]) == direction).all()


@pytest.mark.parametrize("component", [0, 1])
def test_boxes_on_both_sides_of_zero_are_two(component):
    """All boxes have one width, those beside zero too."""
    keys = []
    for place in (-1.5, -0.5, 0.5, 1.5):
        y = np.array([0.25, 0.25])
        y[component] = 0.1 * place
        keys.append(int(proximity.box_of(y, np.ones(2), 0.1)))
        assert int(proximity.box_of(y + 0.02, np.ones(2), 0.1)) == keys[-1]
    assert len(set(keys)) == 4


@pytest.mark.parametrize("length", [1e-14, 1e9])
def test_a_section_is_passed_in_any_unit_of_length(length):
    """What lies in the section is told by the size of the motion."""
    system = bf.System(1.0, 0.1, 1.0)
    for coordinate, value in (("q0", 0.2), ("v0", 0.0), ("q0", 0.0)):
        one, other = (bf.Section(coordinate, unit * value, 0).crossings(
            bf.simulate(system, (0.7 * unit, -0.2 * unit), duration=20.0)) for unit in (1.0, length))
        assert other[0] == pytest.approx(one[0], abs=1e-9) and len(one[0]) >= 2
        np.testing.assert_allclose(other[1] / length, one[1], rtol=0, atol=1e-9)
