"""Proofs in other units, coordinates, order and from the other side: what is proved of a motion is proved of its image."""
import functools

import numpy as np
import pytest

import bifurc as bf
from tests.reference.images import IMAGES, SCENES, in_units

pytest.importorskip("flint")

ALIKE = {**IMAGES, "tiny": lambda system: in_units(system, 1e-9, 1e6, 1e9),
         "huge": lambda system: in_units(system, 1e9, 1e-6, 1e-9)}
PROVED = ["stop", "two stops, one moves", "stop and friction", "elastic", "varying load"]


@functools.cache
def certified(scene):
    orbit = bf.find_orbit(SCENES[scene])
    found = orbit.certify()
    assert found.proved
    return orbit, found


@pytest.mark.parametrize("image", ALIKE)
@pytest.mark.parametrize("scene", PROVED)
def test_images_of_proved_orbits_are_proved(scene, image):
    """Times and speeds of their events lie in the images of the enclosures, multipliers in the same ones."""
    orbit, own = certified(scene)
    image = ALIKE[image](SCENES[scene])
    found = bf.find_orbit(image.system, image.state(orbit.state)).certify()
    assert found.proved and found.stable is own.stable and found.admissible is own.admissible
    assert len(found.events) == len(own.events)
    first = {(e.element, round(e.time[0] / orbit.period, 6)): e for e in own.events}
    for event in found.events:
        partner = first[event.element, round(event.time[0] / (orbit.period * image.time), 6)]
        width = (partner.time[1] - partner.time[0]) + (event.time[1] - event.time[0]) / image.time
        assert abs(event.time[0] / image.time - partner.time[0]) <= 1e-9 * orbit.period + width
        if event.speed is not None and event.kind == "impact":
            length = abs(image.matrix[0, 0]) if np.count_nonzero(image.matrix) == len(image.matrix) and image.time != 1.0 else 1.0
            assert event.speed[0] * image.time / length == pytest.approx(partner.speed[0], rel=1e-8)
    a, b = (np.sort(np.hypot(*c.multipliers.mean(axis=2).T)) for c in (own, found))
    assert np.allclose(a, b, atol=1e-8)
