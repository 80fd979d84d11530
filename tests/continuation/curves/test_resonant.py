"""Orbits of three and four periods beside a strong resonance, of normal forms in which they are known."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.continuation import SpecialPointKind
from bifurc.continuation.curves import resonant
from bifurc.continuation.curves.resonant import changes, first, multiplied
from bifurc.continuation.kinds import LocationStatus
from bifurc.continuation.maps import CycleProblem, MapOrbit, MapOrbitStatus, SmoothMap

K = SpecialPointKind


def resonance(times, strength=1.0, spread=1.0):
    """z -> (1 + a) w z + strength conj(z)^(times - 1) with w^times = 1, in coordinates of other sizes: w z + ... = w z where
    |z|^(times - 2) = |a| / strength, and w^k z are its images."""
    w = np.exp(2j * np.pi / times)

    def image(x, a):
        p, q = x[..., 0], x[..., 1] / spread
        zr, zi = p, q
        cr, ci = np.ones_like(zr), np.zeros_like(zr)
        for _ in range(times - 1):  # conj(z)^(times - 1)
            cr, ci = cr * zr + ci * zi, ci * zr - cr * zi
        lr, li = (1.0 + a) * w.real, (1.0 + a) * w.imag
        return np.stack([lr * zr - li * zi + strength * cr, spread * (lr * zi + li * zr + strength * ci)], axis=-1)
    made = SmoothMap(image, 2, a=0.0)
    return CycleProblem(MapOrbit(made, "-", np.zeros((1, 2)), MapOrbitStatus.CONVERGED, 0.0), "a", (-0.5, 0.5))


@pytest.mark.parametrize("times", [3, 4])
@pytest.mark.parametrize("a", [0.01, -0.01, 0.003])
@pytest.mark.parametrize("spread", [1.0, 2.0])
def test_an_orbit_of_as_many_periods_is_found_beside_its_resonance(times, a, spread):
    problem = resonance(times, spread=spread)
    orbit = multiplied(problem, np.array([0.0, 0.0, a]), times, abs(a))
    points = np.asarray(orbit.points)
    z = points[:, 0] + 1j * points[:, 1] / spread
    assert orbit.success and len(z) == times
    np.testing.assert_allclose(np.abs(z), abs(a)**(1.0 / (times - 2)), rtol=1e-6)
    np.testing.assert_allclose(z[1:] / z[:-1], np.exp(2j * np.pi / times), atol=1e-6)


@pytest.mark.parametrize("times", [3, 4])
def test_the_orbit_of_one_period_is_none_of_three_or_four(times):
    assert multiplied(resonance(times, strength=0.0), np.array([0.0, 0.0, 0.01]), times, 0.01) is None
    assert multiplied(resonance(times), np.array([0.0, 0.0, 0.4]), times, 1e-3) is None  # a circle of another size


def test_orbits_are_looked_for_across_the_curve_in_the_unit_of_the_parameter_and_within_its_bounds():
    asked = []

    def correct(x, row, fixed):
        asked.append(float(x[-1]))
        return SimpleNamespace(converged=False)
    family = SimpleNamespace(alone=lambda b: SimpleNamespace(correct=correct))
    curve = SimpleNamespace(family=family, scale=np.array([1.0, 8.0, 0.5]), bounds_a=(1.9, 2.5))
    assert first(curve, np.array([0.0, 2.0, 5.0]), 3, 0.01) is None
    assert asked == pytest.approx([2.0, 2.0 + 0.3 * 0.08, 2.0 - 0.3 * 0.08, 2.0 + 0.08, 2.0 - 0.08, 2.0 + 0.24])


def test_points_of_a_branch_are_listed_once_each(monkeypatch):
    def at(kind, parameter, name="", status=LocationStatus.LOCATED):
        return SimpleNamespace(kind=kind, parameter=parameter, name=name, status=status)
    found = [at(K.FOLD, 2.0), at(K.FOLD, 2.0 + 1e-12), at(K.FOLD, 2.1), at(K.PERIOD_DOUBLING, 2.0), at(K.PEAK, 2.0),
             at(K.FOLD, 2.2, "shrinks"), at(K.NEIMARK_SACKER, 2.3), at(K.FOLD, 2.4, status=LocationStatus.GUESS)]
    asked = []
    monkeypatch.setattr(resonant, "trace", lambda orbit, name, bounds, max_steps: asked.append((orbit, name, bounds)) or
                        SimpleNamespace(special_points=found))
    curve = SimpleNamespace(base_parameter="a", bounds_a=(1.5, 4.0))
    made = changes(curve, "orbit", 2.0, 0.75)
    assert asked == [("orbit", "a", (1.5, 2.75))]
    assert [(point.kind, point.parameter) for point in made] == [(K.FOLD, 2.0), (K.FOLD, 2.1), (K.PERIOD_DOUBLING, 2.0),
                                                                (K.NEIMARK_SACKER, 2.3)]
    monkeypatch.setattr(resonant, "trace", lambda *given, **more: (_ for _ in ()).throw(ValueError("on no branch")))
    assert changes(curve, "orbit", 2.0, 0.75) == []


def test_branches_are_followed_over_distances_in_the_unit_of_the_parameter(monkeypatch):
    """On both sides, from the nearer place at which there is an orbit."""
    asked = []
    monkeypatch.setattr(resonant, "first", lambda curve, x, times, distance: None if distance < 2e-2 else ("orbit", float(x[-2])))
    monkeypatch.setattr(resonant, "changes", lambda curve, orbit, a, width: asked.append((orbit, a, width)) or [])

    def aside(point, sign, distances):
        return ((distance, SimpleNamespace(x=np.array([0.0, 2.0 + sign, 5.0]))) for distance in distances)
    curve = SimpleNamespace(aside=aside, scale=np.array([1.0, 8.0, 0.5]))
    made = resonant.of_periods(curve, SimpleNamespace(kind=K.RESONANCE_1_4))
    assert asked == [("orbit", 3.0, pytest.approx(40.0 * 3e-2 * 8.0)), ("orbit", 1.0, pytest.approx(40.0 * 3e-2 * 8.0))]
    assert list(made) == ["orbit", "orbit"] and "orbits of 4 periods neither fold" in made.status
