"""Where a branch passes a value of its parameter, in other units and from the other side."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.atlases.identity import orbits_at
from tests.reference.images import IMAGES, SCENES, in_units

ALIKE = {"tiny": lambda system: in_units(system, 1e-7, 1e5, 1e8), "huge": lambda system: in_units(system, 1e8, 1e-5, 1e-7),
         "opposite": IMAGES["opposite"]}
CASES = {"stop": ("harmonic_force.amplitude", (0.3, 1.2), (0.31, 0.55, 1.1)),
         "stop and friction": ("omega", (0.76, 0.9), (0.78, 0.785, 0.85))}


@pytest.mark.parametrize("image", ALIKE)
@pytest.mark.parametrize("scene", CASES)
def test_orbits_at_a_value_are_images(scene, image):
    """As many, the same ones; and each is what `find_orbit` finds there."""
    name, bounds, values = CASES[scene]
    image = ALIKE[image](SCENES[scene])
    factor = image.factor(name)
    start = bf.find_orbit(SCENES[scene])
    own = bf.trace(start, name, bounds=bounds)
    found = bf.trace(bf.find_orbit(image.system, image.state(start.state)), name, bounds=sorted(factor * b for b in bounds))
    for value in values:
        here, there = list(orbits_at(own, value)), list(orbits_at(found, factor * value))
        assert len(here) == len(there) >= 1
        back = np.array([np.linalg.solve(image.matrix, orbit.state) for orbit in there])
        for orbit in here:
            assert np.abs(back - orbit.state).max(axis=1).min() < 1e-8 * np.abs(orbit.state).max()
            again = bf.find_orbit(orbit.system, orbit.state, periods=orbit.periods)
            assert np.abs(again.state - orbit.state).max() < 1e-9 * np.abs(orbit.state).max()
