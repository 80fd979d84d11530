"""Torus points that a product of multipliers does not show, of a map whose multipliers are known in closed form."""
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.kinds import SpecialPointKind
from bifurc.continuation.maps import SmoothMap
from bifurc.continuation.steps.tori import next_to
from bifurc.elements import HarmonicForce, RigidStop


def resonant(x, b, e, m):
    """Fixed points (x, 0, 0) with b = -x^2; the multipliers are m and the roots of mu^2 - (2 + e + x) mu + 1 + e - x."""
    u, v, w = np.moveaxis(np.asarray(x), -1, 0)
    b, e, m = (np.ravel(value)[0] for value in (b, e, m))
    return np.stack([u + v, v + b + e * v + u * u + u * v, m * w], axis=-1)


@pytest.mark.parametrize("e", [-1e-2, -1e-3, -1e-4])
@pytest.mark.parametrize("start", [-0.5, 0.44])
def test_a_pair_that_leaves_the_circle_right_beside_a_fold(e, start):
    """It passes at b = -e^2, shortly before one multiplier passes +1 at the fold b = 0.  Beyond the fold that one and m soon have a
    product above 1: in one step the product over all pairs keeps its sign."""
    point = SmoothMap(resonant, 3, b=-start**2, e=e, m=0.9).find(1, guess=(start, 0.0, 0.0))
    branch = bf.trace(point, "b", bounds=(-0.6, 0.1))
    found = {p.kind.value: p for p in branch.special_points}
    assert sorted(found) == ["fold", "neimark_sacker"] and len(branch.special_points) == 2
    assert abs(found["fold"].parameter) < 1e-12
    assert abs(found["neimark_sacker"].parameter + e * e) < 1e-12


class Resonant:
    """Multipliers of the fixed points ``x`` of `resonant` in closed form."""

    e = -1e-3

    def followed_multipliers(self, x):
        return np.append(np.roots([1.0, -(2.0 + self.e + x[0]), 1.0 + self.e - x[0]]), 0.9)


def test_multipliers_are_counted_where_a_special_point_allows_their_number():
    """Between the pair's passage at x = e and the fold at 0 no multiplier is outside the circle, and one is behind: two a little
    before are none that can be right beside the fold."""
    fold = SimpleNamespace(kind=SpecialPointKind.FOLD, x=np.zeros(1))
    torus = SimpleNamespace(kind=SpecialPointKind.NEIMARK_SACKER, x=np.array([Resonant.e]))
    beside = [[next_to(Resonant(), point, np.array([x])) for x in (-2e-3, -5e-4, 5e-4)] for point in (fold, torus)]
    assert beside == [[False, True, True], [True, True, False]]


def test_a_torus_point_between_a_count_and_a_fold():
    """Two masses with stops between them: a pair passes the circle .0014 of arclength before a fold, and both are real and one of
    them inside again a little behind it.  Differences of simulated periods show the pair at the point that is found."""
    between = (1.0, -1.0)
    system = bf.System(np.diag([1.0, 0.461]), [[0.1, -0.03], [-0.03, 0.08]], [[1.728, -0.728], [-0.728, 1.728]], [
        HarmonicForce(0.52), RigidStop(0.244, 0.791, row=between), RigidStop(0.509, 0.301, side=-1, row=between)], omega=1.52)
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(1.064, 1.976), max_steps=250)
    (torus,) = [p for p in branch.special_points.of("neimark_sacker") if abs(p.parameter - 1.187422) < 1e-5]
    (fold,) = [p for p in branch.special_points.of("fold") if abs(p.parameter - 1.187422) < 1e-5]
    assert 0.0 < fold.parameter - torus.parameter < 1e-7
    orbit = torus.solution
    step, columns = 1e-7, []
    for k in range(4):
        ends = [bf.simulate(orbit.system, orbit.state + sign * step * np.eye(4)[k], periods=1).final for sign in (1.0, -1.0)]
        columns.append((ends[0] - ends[1]) / (2.0 * step))
    mu = np.linalg.eigvals(np.array(columns).T)
    pair = mu[np.abs(mu.imag) > 1e-4]
    assert pair.size == 2 and np.abs(np.abs(pair) - 1.0).max() < 1e-5
