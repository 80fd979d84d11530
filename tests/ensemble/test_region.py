"""Regions of starts: sizes that do not depend on units, and starts that fill a box evenly."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.compose import scene_of
from bifurc.ensemble.region import Region


@pytest.mark.parametrize(("ranges", "length"), [
    ({"q0": (-3.0, 1.0), "v0": (-4.0, 8.0)}, 4.0), ({"q0": (-3.0, 5.0), "v0": (-4.0, 8.0)}, 5.0), ({"v0": (-4.0, 1.0)}, 2.0),
    ({"q0": (0.5, 1.0)}, 1.0)])
def test_one_length_measures_coordinates_and_at_the_frequency_velocities(ranges, length):
    """omega = 2: a speed of 8 is as large as a displacement of 4.  In other units of time and length the sizes are the same."""
    omega = 2.0
    for time, unit in ((1.0, 1.0), (60.0, 1.0), (1e-3, 1e3)):
        scene = scene_of(bf.systems.impact_oscillator(omega=omega / time))
        scaled = {name: tuple(unit / (time if name == "v0" else 1.0) * np.array(pair)) for name, pair in ranges.items()}
        found = Region(scaled).sizes(scene)
        np.testing.assert_allclose(found, [length * unit, length * unit * omega / time], rtol=1e-14)


def test_memory_is_a_position_and_has_the_size_of_coordinates():
    """In any unit of time: only velocities scale with it."""
    for omega in (1e-3, 0.7, 50.0):
        scene = scene_of(bf.System(1.0, 0.1, 1.0, [bf.elements.HarmonicForce(1.0), bf.elements.Jenkins(1.0, 0.5)], omega=omega))
        found = Region({"q0": (-1.0, 3.0), "v0": (-omega, omega)}).sizes(scene)
        np.testing.assert_allclose(found, [3.0, 3.0 * omega, 3.0], rtol=1e-14)


def test_starts_fill_a_box_evenly_and_a_longer_row_begins_with_a_shorter_one():
    """Every part of the box gets its share to a few starts, where random ones would miss by the root of their number."""
    system = bf.systems.impact_chain(n=2)
    region = Region({"v1": (-2.0, 6.0), "q0": (1.0, 2.0)}, {"q1": 0.25})
    starts = region.starts(scene_of(system), 4000, 3)
    assert np.array_equal(starts[:500], region.starts(scene_of(system), 500, 3))
    assert (starts[:, 1] == 0.25).all() and (starts[:, 2] == 0.0).all()
    unit = np.column_stack(((starts[:, 3] + 2.0) / 8.0, starts[:, 0] - 1.0))
    assert unit.min() >= 0.0 and unit.max() < 1.0
    for a, b in np.random.default_rng(0).uniform(0.1, 1.0, (50, 2)):
        assert abs(np.count_nonzero((unit < (a, b)).all(axis=1)) - 4000 * a * b) < 12.0
