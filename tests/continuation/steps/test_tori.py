"""Torus points that a product of multipliers does not show, of a map whose multipliers are known in closed form."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.maps import SmoothMap


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


def test_multipliers_are_counted_where_a_special_point_allows_their_number():
    """Inside b = -e^2 no multiplier is outside the circle and at the fold none but that at +1: two are outside a little before, none
    or one can be right beside the fold."""
    e = -1e-3
    point = SmoothMap(resonant, 3, b=-0.25, e=e, m=0.9).find(1, guess=(-0.5, 0.0, 0.0))
    branch = bf.trace(point, "b", bounds=(-0.6, 0.1))
    (fold,) = branch.special_points.of("fold")
    problem = branch.rows()[0].part.problem
    for x, near in ((-2e-3, False), (-5e-4, True), (5e-4, True)):
        at = np.array([x, 0.0, 0.0, -x * x])
        outside = np.count_nonzero(np.abs(np.roots([1.0, -(2.0 + e + x), 1.0 + e - x])) > 1.0)
        assert outside == (2 if x < e else 1 if x > 0.0 else 0) and next_to(problem, fold, at) == near


def test_a_torus_point_between_a_count_and_a_fold():
    """Two masses with stops between them: a pair passes the circle .0014 of arclength before a fold, and both are real and one of
    them inside again a little behind it.  Differences of simulated periods show the pair at the point that is found."""
    between = (1.0, -1.0)
    system = bf.System(*SYSTEM[:3], [HarmonicForce(SYSTEM[3]), RigidStop(*SYSTEM[4], row=between), RigidStop(*SYSTEM[5], row=(-1.0, 1.0))],
                       omega=1.52)
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(1.064, 1.976), max_steps=250)
    (torus,) = [p for p in branch.special_points.of("neimark_sacker") if abs(p.parameter - 1.187422) < 1e-5]
    (fold,) = [p for p in branch.special_points.of("fold") if abs(p.parameter - 1.187422) < 1e-5]
    assert 0.0 < fold.parameter - torus.parameter < 1e-7
    orbit = torus.orbit
    step, columns = 1e-7, []
    for k in range(4):
        ends = [bf.simulate(orbit.system, orbit.state + sign * step * np.eye(4)[k], periods=1).final for sign in (1.0, -1.0)]
        columns.append((ends[0] - ends[1]) / (2.0 * step))
    mu = np.linalg.eigvals(np.array(columns).T)
    pair = mu[np.abs(mu.imag) > 1e-4]
    assert pair.size == 2 and np.abs(np.abs(pair) - 1.0).max() < 1e-5
