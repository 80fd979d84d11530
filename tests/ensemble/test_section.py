"""Sections of motions without a clock, and boxes of chaotic attractors."""
import numpy as np
import pytest
from scipy.special import ellipk

import bifurc as bf
from bifurc.elements import CubicSpring
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


@pytest.mark.parametrize("a, k", [(0.5, 1.0), (3.0, 1.0), (1.5, -1.0)])
def test_sections_under_a_law_are_passed_when_elliptic_functions_say(a, k):
    """q'' + k q + q^3 = 0 from (a, 0): q = a cn(w t, m), w^2 = k + a^2, m = a^2 / (2 w^2), quarter of the period K(m) / w."""
    w = np.sqrt(k + a**2)
    quarter = ellipk(a**2 / (2.0 * w**2)) / w
    motion = bf.simulate(bf.System(1.0, 0.0, k, [CubicSpring(1.0)]), (a, 0.0), duration=40.5 * quarter)
    for section, first, value in ((bf.Section("v0", direction=-1), 4.0, (a, 0.0)), (bf.Section("v0", direction=1), 2.0, (-a, 0.0)),
                                  (bf.Section("q0", direction=1), 3.0, (0.0, a * np.sqrt(k + 0.5 * a**2)))):
        times, states = section.crossings(motion)
        np.testing.assert_allclose(times, (first + 4.0 * np.arange(len(times))) * quarter, rtol=2e-12)
        np.testing.assert_allclose(states, np.tile(value, (len(times), 1)), atol=1e-11 * a)
        assert len(times) == (40.5 - first) // 4 + 1
