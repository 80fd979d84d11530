"""Orbits, multipliers, measures and exponents of a system and of its exact images."""
import functools

import numpy as np
import pytest

import bifurc as bf
from tests.reference.images import IMAGES, SCENES, Image, in_units, later, side_by_side

every_scene = pytest.mark.parametrize("scene", SCENES)
EXTREME = {f"{unit} {size:g}": tuple(size if unit == name else 1.0 for name in ("length", "time", "mass"))
           for unit in ("length", "time", "mass") for size in (1e-9, 1e9)}


@functools.cache
def motion_of(orbit):
    """The orbit simulated for two of its periods: a function of time."""
    return bf.simulate(orbit.system, orbit.state, periods=2 * orbit.periods)


@functools.cache
def orbit_of(scene):
    orbit = bf.find_orbit(SCENES[scene])
    assert orbit.success and orbit.stable and orbit.events
    return orbit


def by_size(values):
    """Multipliers in an order that rounding does not change."""
    return np.sort_complex(np.round(np.where(np.abs(values) < 1e-9, 0.0, values), 9))


def assert_same(found, orbit, image):
    """The orbit ``found`` of an image is the image of ``orbit``."""
    assert found.success and found.periods == orbit.periods and found.stable
    assert found.period == pytest.approx(orbit.period * image.time, rel=1e-13)
    sizes = np.abs(orbit.sample()[1]).max(axis=0)
    back = np.linalg.inv(image.matrix)
    shift = image.later * orbit.period
    times, y = found.sample(31)
    assert np.abs((y @ back.T - motion_of(orbit)(times / image.time + shift)) / sizes).max() < 1e-10
    assert np.abs(by_size(found.multipliers) - by_size(orbit.multipliers)).max() < 3e-9
    assert sorted((e.element, str(e.kind)) for e in found.events) == sorted((e.element, str(e.kind)) for e in orbit.events)


@pytest.mark.parametrize("image", IMAGES)
@every_scene
def test_images_have_the_image_of_the_orbit(scene, image):
    """Found from a state nearby, off by a part of its own sizes."""
    orbit, image = orbit_of(scene), IMAGES[image](SCENES[scene])
    found = bf.find_orbit(image.system, image.state(orbit.state * (1.0 + 1e-5)), periods=orbit.periods)
    assert_same(found, orbit, image)


@pytest.mark.parametrize("units", EXTREME)
@every_scene
def test_no_unit_is_preferred(scene, units):
    image = in_units(SCENES[scene], *EXTREME[units])
    assert_same(bf.find_orbit(image.system), orbit_of(scene), image)


@pytest.mark.parametrize("part", [0.29, 0.5])
@every_scene
def test_a_later_clock_has_the_same_orbit(scene, part):
    orbit, image = orbit_of(scene), later(SCENES[scene], part)
    found = bf.find_orbit(image.system, motion_of(orbit)(part * orbit.period))
    assert_same(found, orbit, image)


@pytest.mark.parametrize("image", ["small units", "large units", "reversed", "opposite"])
@every_scene
def test_measures_are_those_of_the_image(scene, image):
    """Extremes, root mean squares, phasors and energies of every degree of freedom."""
    orbit, image = orbit_of(scene), IMAGES[image](SCENES[scene])
    found = bf.find_orbit(image.system, image.state(orbit.state), periods=orbit.periods)
    for new in range(orbit.system.n):
        (old,) = np.flatnonzero(image.matrix[new, :orbit.system.n])
        factor = image.matrix[new, old]
        size = abs(factor) * max(orbit.maximum(old), -orbit.minimum(old))
        ends = factor * orbit.maximum(old), factor * orbit.minimum(old)
        assert abs(found.maximum(new) - max(ends)) < 1e-11 * size and abs(found.minimum(new) - min(ends)) < 1e-11 * size
        assert found.rms(new) == pytest.approx(abs(factor) * orbit.rms(old), rel=1e-11)
        for h in (1, 2, 3):
            assert abs(found.harmonic(h, new) - factor * orbit.harmonic(h, old)) < 1e-11 * size
        assert abs(found.harmonic(0, new) - factor * orbit.harmonic(0, old)) < 1e-11 * size


@pytest.mark.parametrize("scene", [scene for scene in SCENES if scene != "sliders"])  # at a limit they have no derivative
def test_multipliers_are_the_growth_of_small_perturbations(scene):
    """Against eigenvalues of central differences of simulations over a period; what a slip forgets is zero in both."""
    orbit = orbit_of(scene)
    n, sizes = len(orbit.state), np.abs(orbit.sample()[1]).max(axis=0)
    columns = []
    for c in range(n):
        step = np.zeros(n)
        step[c] = 1e-6 * sizes[c]
        ends = [bf.simulate(orbit.system, orbit.state + sign * step, periods=orbit.periods).final for sign in (1.0, -1.0)]
        columns.append((ends[0] - ends[1]) / (2.0 * step[c]))
    seen, told = (by_size(mu[np.abs(mu) > 1e-3]) for mu in (np.linalg.eigvals(np.array(columns).T), orbit.multipliers))
    assert np.abs(seen - told).max() < 1e-6


@pytest.mark.parametrize("scene", ["stop", "two stops, one moves", "elastic", "stop and friction"])
def test_exponents_of_images(scene):
    """Exponents are per time; those of an orbit are the logarithms of its multipliers, and so are those of its motion."""
    orbit = orbit_of(scene)
    exact = bf.lyapunov_exponents(orbit.system, orbit)
    mu = np.sort(np.abs(orbit.multipliers))[::-1]
    assert np.allclose(exact.values, np.log(mu) / orbit.period, rtol=1e-9, atol=0.0)
    for name in (None, "small units", "large units", "reversed", "opposite"):
        image = Image(orbit.system, np.eye(len(orbit.state))) if name is None else IMAGES[name](orbit.system)
        found = bf.lyapunov_exponents(image.system, image.state(orbit.state), periods=80, transient=10, batches=4)
        assert np.abs(found.values * image.time - exact.values).max() < 6.0 * max(found.errors) * image.time < 0.06
        assert np.allclose(found.per_period, found.values * image.system.period, rtol=1e-12)
        assert found.impacts == sum(e.kind == "impact" for e in orbit.events)
        assert found.sum_rule * image.time == pytest.approx(exact.values.sum(), rel=1e-9)
        assert found.values.sum() == pytest.approx(found.sum_rule, rel=1e-9)
        assert np.abs(np.linalg.solve(image.matrix, found.state) - orbit.state).max() < 1e-10 * np.abs(orbit.state).max()


@pytest.mark.parametrize("first", [True, False])
@every_scene
def test_an_uncoupled_mass_adds_its_own_multipliers(scene, first):
    """And nothing else: those of a damped free mass are exp of its eigenvalues times the period."""
    orbit = orbit_of(scene)
    system = SCENES[scene]
    alone = bf.System(2.0, 0.3, 1.5, (bf.elements.HarmonicForce(0.4, harmonic=2),), omega=system.omega)
    one, at, free = side_by_side(system, alone, first)
    y = np.zeros(2 * one.n + len(orbit.state) - 2 * system.n)
    y[at], y[free] = orbit.state, bf.find_orbit(alone).state
    found = bf.find_orbit(one, y)
    own = np.exp(orbit.period * np.linalg.eigvals([[0.0, 1.0], [-0.75, -0.15]]))
    assert found.success
    assert np.abs(by_size(found.multipliers) - by_size([*orbit.multipliers, *own])).max() < 3e-9
    assert np.abs(found.state[at] - orbit.state).max() < 1e-10
