"""Fields, guards and jumps of the modes of a scene and of its exact images, at random states."""
import numpy as np
import pytest

from bifurc.compose.scene import scene_of
from bifurc.elements import BUILT_IN, AroundPoint, DelayedFeedback, Driven, Element, Force, OilFilm
from bifurc.flow.settle import Rule
from tests.reference.images import DIMENSIONS, IMAGES, SCENES, in_units, later

ALIKE = {**IMAGES, "tiny": lambda system: in_units(system, 1e-9, 1e6, 1e9), "later": lambda system: later(system, 0.31)}
AFFINE = [name for name in SCENES if not scene_of(SCENES[name]).laws]


@pytest.mark.parametrize("image", ALIKE)
@pytest.mark.parametrize("scene", AFFINE)
def test_fields_guards_and_jumps_are_images(scene, image, rng):
    """In every mode that both scenes have: accelerations, rates of guards over their values, and states behind events."""
    system = SCENES[scene]
    image = ALIKE[image](system)
    own, other = scene_of(system), scene_of(image.system)
    y = rng.normal(size=own.ns) * 0.5
    t = 0.37 * system.period
    x = np.concatenate([y, own.forcing(np.array([t]))[0]])
    xi = np.concatenate([image.state(y), other.forcing(np.array([t * image.time - image.later * image.system.period]))[0]])
    seen = 0
    for m, keys in enumerate(own.keys):
        if image.mirrored:
            keys = tuple(element.mirrored_key(key) if hasattr(element, "mirrored_key") else key
                         for element, key in zip(system.elements, keys, strict=True))
        wanted = dict(zip(system.labels, keys, strict=True))
        extra = dict(zip(image.system.labels, (element.start[0] for element in image.system.elements), strict=True))
        full = tuple({**extra, **wanted}[label] for label in image.system.labels)
        if full not in other.keys:
            continue
        k = other.keys.index(full)
        seen += 1
        f, fi = own.tables.A[m] @ x, other.tables.A[k] @ xi
        back = np.linalg.solve(image.matrix, fi) * image.time
        assert np.abs(back - f).max() < 1e-12 * (np.abs(own.tables.A[m]) @ np.abs(x)).max()
        if image.mirrored:
            continue
        for g in range(own.tables.n_guards[m]):
            label = system.labels[own.tables.element[m, g]]
            mine = [h for h in range(own.tables.n_guards[m]) if own.tables.element[m, h] == own.tables.element[m, g]].index(g)
            theirs = [h for h in range(other.tables.n_guards[k]) if image.system.labels[other.tables.element[k, h]] == label]
            h = theirs[mine]
            value, size = own.tables.G[m, g] @ x, np.abs(own.tables.G[m, g]) @ np.abs(x)
            value_i, size_i = other.tables.G[k, h] @ xi, np.abs(other.tables.G[k, h]) @ np.abs(xi)
            assert np.sign(value) == np.sign(value_i)
            assert other.tables.kind[k, h] == own.tables.kind[m, g] and other.tables.kick[k, h] == own.tables.kick[m, g]
            rate = own.tables.G[m, g, :own.ns] @ f
            rate_i = other.tables.G[k, h, :other.ns] @ fi * image.time
            assert abs(rate_i * value - rate * value_i) < 1e-11 * (abs(rate) + size) * (abs(value_i) + size_i)
            jumped = Rule(own).jump(m, g, x)[0][:own.ns]
            jumped_i = Rule(other).jump(k, h, xi)[0][:other.ns]
            assert np.abs(np.linalg.solve(image.matrix, jumped_i) - jumped).max() < 1e-12 * np.abs(x).max()
    assert seen >= 1


@pytest.mark.parametrize("cls", [cls for cls in BUILT_IN.values() if cls not in {Force, Driven, DelayedFeedback, OilFilm}])
def test_every_number_of_an_element_has_a_known_unit(cls):
    """The table of units in `tests.reference.images` names every number that is none of the kind that has no unit."""
    numbers = {"phase", "load_phase", "load_amplitude", "static_ratio", "restitution", "load_amplitudes", "load_phases", "harmonic",
               "duty", "variation_phase"}
    if issubclass(cls, AroundPoint):
        numbers |= {"friction"}
    element: Element = cls()
    fields = {name.partition("[")[0] for name in element.parameters}
    assert fields <= numbers | set(DIMENSIONS[cls])
