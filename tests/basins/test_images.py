"""Basins, cells, diagrams, sweeps and edges of a system in other units and from the other side."""
import functools

import numpy as np
import pytest

import bifurc as bf
from tests.reference.images import in_units, opposite

SYSTEMS = {"impacts": (bf.systems.impact_oscillator(zeta=0.02, omega=2.6, amplitude=1.0, gap=0.0, restitution=0.8),
                       (-2.5, 0.25), (-3.0, 3.0)),
           "elastic": (bf.systems.bilinear_oscillator(omega=1.29), (-2.5, 2.5), (-4.0, 4.0)),
           "bilinear": (bf.systems.bilinear_oscillator(zeta=0.02, omega=0.7, amplitude=1.0, gap=0.0), (-2.5, 2.5), (-4.0, 4.0))}
UNITS = {"small": (1e-7, 1e5, 1e8), "large": (1e6, 1e-6, 1e-7)}


def grid(name, image=None, cells=(24, 20)):
    """The grid of a system, or of an image of it; its axes turn with the mirror."""
    system, q, v = SYSTEMS[name]
    q, v = ([x * (1.0 if image is None else image.matrix[k, k]) for x in ends] for k, ends in enumerate((q, v)))
    return bf.Grid(q0=(*sorted(q), cells[0]), v0=(*sorted(v), cells[1]))


@functools.cache
def basins_of(name):
    return bf.basins_of_attraction(SYSTEMS[name][0], grid(name), workers=1)


def image_of(name, units):
    return opposite(SYSTEMS[name][0]) if units == "opposite" else in_units(SYSTEMS[name][0], *UNITS[units])


def matched(found, known, image):
    """Number of the attractor of ``found`` that is the image of each of ``known``."""
    numbers = {}
    for k, attractor in enumerate(known.attractors, 1):
        states = image.state(attractor.sections)
        size = np.abs(image.state(known.scale))
        apart = [np.abs((other.sections[:, None] - states[None]) / size).max(axis=-1).min() for other in found.attractors]
        numbers[k] = 1 + int(np.argmin(apart))
    return numbers


@pytest.mark.parametrize("units", [*UNITS, "opposite"])
@pytest.mark.parametrize("name", SYSTEMS)
def test_basins_of_images_have_the_same_labels(name, units):
    """Starts near the boundaries may differ, as their label reliability says; attractors, radii and speeds have their units."""
    image, basins = image_of(name, units), basins_of(name)
    found = bf.basins_of_attraction(image.system, grid(name, image), workers=1)
    assert len(found.attractors) == len(basins.attractors)
    numbers = matched(found, basins, image)
    assert sorted(numbers.values()) == list(range(1, len(numbers) + 1))
    expected = np.array([numbers.get(k, k) for k in range(int(basins.labels.max()) + 1)])[np.maximum(basins.labels, 0)]
    expected = np.where(basins.labels < 0, basins.labels, expected)
    labels = found.labels[::-1, ::-1] if units == "opposite" else found.labels
    assert np.mean(labels != expected) <= 0.02
    for k, new in numbers.items():
        a, b = basins.attractors[k - 1], found.attractors[new - 1]
        assert type(a) is type(b) and len(a.sections) == len(b.sections) or not hasattr(a, "multipliers")
        if hasattr(a, "multipliers"):
            assert b.stable and np.allclose(np.sort(np.abs(a.multipliers)), np.sort(np.abs(b.multipliers)), atol=1e-8)
    assert np.allclose(found.scale, np.abs(image.state(basins.scale)), rtol=1e-9)
    assert sorted(found.radii) == pytest.approx(sorted(basins.radii), rel=0.5)


@pytest.mark.parametrize("units", UNITS)
def test_cells_of_images_go_to_the_image_cells(units):
    image = image_of("bilinear", units)
    own = bf.cell_mapping(SYSTEMS["bilinear"][0], grid("bilinear"), audit=40, workers=1)
    found = bf.cell_mapping(image.system, grid("bilinear", image), audit=40, workers=1)
    assert (own.matrix != found.matrix).nnz <= 2
    assert np.mean(own.labels != found.labels) < 0.01 and np.mean(own.fates != found.fates) < 0.01
    assert len(own.groups) == len(found.groups) and len(own.attractors) == len(found.attractors)


@pytest.mark.parametrize("units", [*UNITS, "opposite"])
def test_diagrams_of_images(units):
    """Section points of every value of the parameter, and their periods."""
    image = image_of("elastic", units)
    factor, name = image.factor("omega"), "omega"
    values = np.linspace(1.2, 1.4, 5)
    own = bf.bifurcation_diagram(SYSTEMS["elastic"][0], name, values, starts=(0.1, 0.2), transient=300, keep=8)
    found = bf.bifurcation_diagram(image.system, name, factor * values, starts=image.state((0.1, 0.2)), transient=300, keep=8)
    assert np.allclose(found.points @ np.linalg.inv(image.matrix).T, own.points, atol=1e-8)
    assert np.array_equal(found.periods, own.periods) and np.array_equal(found.impacts, own.impacts)
