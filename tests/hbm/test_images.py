"""Balances of a system and of its exact images, by every way through the balance; and balances against exact orbits."""
import functools

import numpy as np
import pytest

import bifurc as bf
from bifurc import elements as el
from tests.reference.images import IMAGES, SCENES, crowded, in_units, later, pair, side_by_side

BALANCED = {
    **{name: SCENES[name] for name in ("elastic", "varying load", "sliders")},
    "cubic": pair(el.HarmonicForce(0.9, dof=1), el.CubicSpring(0.8)),
    "cubic beside a stop": pair(el.HarmonicForce(0.9, dof=1), el.CubicSpring(0.8), el.ElasticStop(0.3, 6.0, 0.2, dof=1)),
    "dry friction": pair(el.HarmonicForce(2.1), el.Coulomb(0.4, dof=1)),
}
WAYS = {"exact": {}, "sampled": {"aft": "sampled"}, "condensed": {"condense": True}, "whole": {"condense": False}}
H = 9
IMAGES = {**IMAGES, "crowded": lambda system: crowded(system, rigid=False), "small lengths": lambda system: in_units(system, 1e-9),
          "large times": lambda system: in_units(system, time=1e9), "large masses": lambda system: in_units(system, mass=1e9)}
every_scene = pytest.mark.parametrize("scene", BALANCED)


@functools.cache
def balance_of(scene, way):
    orbit = bf.find_orbit(BALANCED[scene], method=bf.HarmonicBalance(H, **WAYS[way]))
    assert orbit.success and all(abs(orbit.harmonic(3, dof)) > 1e-6 for dof in range(orbit.system.n))
    return orbit


def phasors(orbit, dofs=None):
    """Of all coordinates (rows) and harmonics."""
    return np.array([[orbit.harmonic(h, dof) for h in range(H + 1)] for dof in (range(orbit.system.n) if dofs is None else dofs)])


def by_size(values):
    return np.sort_complex(np.round(values, 8))


@pytest.mark.parametrize("image", IMAGES)
@pytest.mark.parametrize("scene, way", [(scene, way) for scene in BALANCED for way in WAYS
                                        if scene != "dry friction" or way == "exact"])  # set-valued friction has its own ways
def test_images_have_the_image_of_the_balance(scene, way, image):
    """Phasors, multipliers and the stated error, found from nothing."""
    orbit, image = balance_of(scene, way), IMAGES[image](BALANCED[scene])
    found = bf.find_orbit(image.system, method=bf.HarmonicBalance(H, **WAYS[way]))
    assert found.success and found.how["method"] == orbit.how["method"]
    A = image.matrix[:orbit.system.n, :orbit.system.n]
    assert np.abs(np.linalg.solve(A, phasors(found)) - phasors(orbit)).max() < 1e-11 * np.abs(phasors(orbit)).max()
    assert (found.multipliers is None) == (orbit.multipliers is None)
    if orbit.multipliers is not None:
        assert np.abs(by_size(found.multipliers) - by_size(orbit.multipliers)).max() < 3e-8
    order = [int(np.argmax(np.abs(row))) for row in A]
    if np.count_nonzero(A) == len(A):  # a size of its own for every coordinate
        for new, old in enumerate(order):
            size = abs(A[new, old])
            assert found.how["error"][new] == pytest.approx(size * orbit.how["error"][old], rel=1e-6)
            assert found.rms(new) == pytest.approx(size * orbit.rms(old), rel=1e-11)
            assert {round(found.maximum(new) / size, 9), round(-found.minimum(new) / size, 9)} == {
                round(orbit.maximum(old), 9), round(-orbit.minimum(old), 9)}


@pytest.mark.parametrize("part", [0.29, 0.5])
@every_scene
def test_a_later_clock_turns_the_phasors(scene, part):
    orbit, image = balance_of(scene, "exact"), later(BALANCED[scene], part)
    found = bf.find_orbit(image.system, method=bf.HarmonicBalance(H))
    turned = phasors(orbit) * np.exp(2j * np.pi * part * np.arange(H + 1))
    assert found.success and np.abs(phasors(found) - turned).max() < 1e-11 * np.abs(turned).max()


@pytest.mark.parametrize("first", [True, False])
@pytest.mark.parametrize("way", ["exact", "condensed"])
@pytest.mark.parametrize("scene", ["elastic", "varying load", "sliders", "cubic"])
def test_an_uncoupled_mass_has_its_own_balance(scene, way, first):
    """Beside a balance it moves by its receptance, whichever comes first."""
    orbit, system = balance_of(scene, way), BALANCED[scene]
    alone = bf.System(2.0, 0.3, 1.5, (el.HarmonicForce(0.4, harmonic=2, phase=0.3),), omega=system.omega)
    one, at, free = side_by_side(system, alone, first)
    found = bf.find_orbit(one, method=bf.HarmonicBalance(H, **WAYS[way]))
    w = 2.0 * system.omega
    expected = np.zeros(H + 1, complex)
    expected[2] = 0.4 * np.exp(0.3j) / (1.5 - 2.0 * w**2 + 0.3j * w)
    assert found.success
    assert np.abs(phasors(found, at[:system.n]) - phasors(orbit)).max() < 1e-11 * np.abs(phasors(orbit)).max()
    assert np.abs(phasors(found, free[:1])[0] - expected).max() < 1e-11
    own = np.exp(orbit.period * np.linalg.eigvals([[0.0, 1.0], [-0.75, -0.15]]))
    assert np.abs(by_size(found.multipliers) - by_size([*orbit.multipliers, *own])).max() < 3e-8


@pytest.mark.parametrize("scene", ["elastic", "varying load", "cubic", "sliders"])
def test_balances_tend_to_the_exact_orbit(scene):
    """As 1/h^3 at least where forces have corners; stated errors are of the size of the true ones."""
    exact = bf.find_orbit(BALANCED[scene])
    assert exact.success
    true = np.array([[exact.harmonic(h, dof) for h in range(4)] for dof in range(2)])
    errors = {}
    for harmonics in (9, 36):
        found = bf.find_orbit(BALANCED[scene], method=bf.HarmonicBalance(harmonics))
        errors[harmonics] = np.abs(phasors(found)[:, :4] - true).max()
        t, y = found.sample(400)
        worst = np.abs(y[:, :2] - exact.sample(400)[1][:, :2]).max(axis=0)
        assert (worst < 3.0 * found.error() + 1e-11).all() and (found.error() < 30.0 * worst + 1e-11).all()
        assert np.abs(by_size(np.abs(found.multipliers))[-2:] - by_size(np.abs(exact.multipliers))[-2:]).max() < 20.0 / harmonics**3
    assert errors[36] < max(errors[9] / 40.0, 1e-12)


@pytest.mark.parametrize("harmonics", [5, 9])
def test_a_balance_of_two_periods_is_that_of_one(harmonics):
    """Whatever is listed twice as often: phasors, stated errors, and the times at which friction turns round."""
    system = BALANCED["dry friction"]
    one = bf.find_orbit(system, method=bf.HarmonicBalance(harmonics))
    two = bf.find_orbit(system, method=bf.HarmonicBalance(harmonics), periods=2)
    assert two.success and max(abs(two.harmonic(h, d) - one.harmonic(h, d)) for h in (1, 3, 5) for d in (0, 1)) < 1e-6
    assert np.allclose(two.how["error"], one.how["error"], rtol=0.5)
