"""Basins of rotors that rub, and attractors without a period: points on a curve are told from others."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.basins.attractors.attractors import SampledAttractor, filled, on_curve


def test_points_on_a_curve_are_told_from_others():
    rng = np.random.default_rng(0)
    turns = np.arange(4000) * 2.399963
    circle = np.column_stack([np.cos(turns), np.sin(turns), 0.3 * np.cos(2.0 * turns), np.sin(turns)])
    assert on_curve(circle)
    slow = np.arange(4000) * (2.0 * np.pi / 5.0 + 1e-5)  # nearly locked: five short arcs
    assert on_curve(np.column_stack([np.cos(slow), np.sin(slow)]))
    assert not on_curve(rng.random((4000, 4))) and not on_curve(np.column_stack([circle[:, :2], rng.random((4000, 2))]))
    assert not on_curve(np.zeros((4000, 4)))


@pytest.mark.parametrize("turn, count", [(0.4 * np.pi + 1e-5, 40000), (0.4 * np.pi + 1e-4, 20000), (2.399963, 5000)])
def test_points_of_a_nearly_locked_motion_are_followed_until_they_fill_the_curve(turn, count):
    # five arcs that grow by the drift a turn meet when they are 2 pi / 5 long; the slowest are given up
    scale = np.array([0.5, 2.0])

    def at(turns):
        return scale * np.column_stack([np.cos(turns), np.sin(turns)])

    def follow(y, more):
        return at(np.arctan2(y[1] / scale[1], y[0] / scale[0]) + turn * np.arange(1, more + 1))

    points = filled(at(turn * np.arange(5000)), scale, follow)
    angles = np.sort(np.arctan2(points[:, 1] / scale[1], points[:, 0] / scale[0]))
    gap = max(np.diff(angles).max(), angles[0] + 2.0 * np.pi - angles[-1])
    assert len(points) == count and (gap < 0.01 or count == 40000)


def starts(x, v, count, centre=0.0):
    """Return the grid whose cells have their centres at positions up to +-x around ``centre`` and speeds y' up to +-v."""
    return bf.Grid(q0=(centre - x * count / (count - 1), centre + x * count / (count - 1), count),
                   v1=(-v * count / (count - 1), v * count / (count - 1), count))


@pytest.mark.slow
@pytest.mark.parametrize("piece", [0.83, 0.29])
def test_labels_do_not_depend_on_the_steps(piece):
    # motions cut into pieces of other lengths take other steps everywhere
    system = bf.systems.jeffcott_rotor(nu=1.7)
    basins = bf.basins_of_attraction(system, bf.Grid(q0=(-0.3, 1.5, 7), v1=(-2.0, 2.0, 7)), max_periods=600)
    assert len(basins.attractors) == 2 and min(basins.counts[k] for k in range(2)) > 5 and basins.counts[-1] == 0
    points, scale = np.array([attractor.state for attractor in basins.attractors]), np.array([1.0, 1.0, 1.7, 1.7])
    for y, label in zip(basins.grid.starts(2, 4), basins.labels.ravel(), strict=True):
        times = np.append(np.arange(0.0, 120.0, piece), 120.0) * system.period
        for t0, t1 in zip(times[:-1], times[1:], strict=True):
            y = bf.simulate(system, y, t0=t0, duration=t1 - t0).final
        away = np.linalg.norm((points - y) / scale, axis=1)
        assert away.argmin() == label and away[label] < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("nu, known", [(1.7, {"free": 18, "stator.impact": 135, "in contact": 472}),
                                       (2.0, {"free": 215, "in contact": 410})])
def test_rigid_rub_beside_the_free_motion_and_beside_sustained_contact(nu, known):
    # counts of an integrator of its own: free flight exact, impacts bisected, friction on the wall by Runge-Kutta, at two steps
    basins = bf.basins_of_attraction(bf.systems.rigid_stator_rotor(nu=nu), starts(0.95, 2.0, 25, centre=0.5), max_periods=400)
    assert {str(attractor.signature).split(" /")[0]: basins.counts[k] for k, attractor in enumerate(basins.attractors)} == known
    assert basins.counts[-1] == 0


@pytest.mark.slow
def test_fast_starts_on_a_rigid_wall_end_in_backward_whirl_that_rolls_and_slips():
    basins = bf.basins_of_attraction(bf.systems.rigid_stator_rotor(nu=1.7), starts(0.9, 3.0, 25, centre=0.5), max_periods=400)
    whirl = [k for k, attractor in enumerate(basins.attractors) if isinstance(attractor, bf.basins.QuasiperiodicAttractor)]
    assert len(whirl) == 1 and basins.counts[whirl[0]] == 6 and basins.counts[-1] == 0
    assert sorted(basins.counts.values()) == [0, 6, 19, 117, 483]  # the same integrator: 489 that stay on the wall
    points = basins.attractors[whirl[0]].points
    turn = ((points[:, 0] - 0.5) * points[:, 3] - points[:, 1] * points[:, 2]).mean()
    assert turn < -2.0


@pytest.mark.slow
def test_partial_rub_and_dry_whirl_beside_no_rub_in_a_concentric_stator():
    # counts of Runge-Kutta motions of fixed step, the same at two steps
    system = bf.systems.jeffcott_rotor(stiffness=25.0, friction=0.1, offset=0.0, nu=1.5)
    basins = bf.basins_of_attraction(system, starts(0.9, 3.0, 31), max_periods=400)
    found = {0.0: 0, 1.0: 0, 2.0: 0}
    for k, attractor in enumerate(basins.attractors):
        points = attractor.points if isinstance(attractor, bf.basins.QuasiperiodicAttractor) else attractor.state[None]
        beyond = np.mean(np.hypot(points[:, 0], points[:, 1]) > 1.0)
        found[0.0 if beyond == 0.0 else 2.0 if beyond == 1.0 else 1.0] += basins.counts[k]  # dry whirl never lets go
    assert basins.counts[-1] == 0 and list(found.values()) == [284, 554, 123]


def motions_of_fixed_step(count, steps, periods, nu, zeta=0.05, eccentricity=0.2, stiffness=25.0, friction=0.1, disk=20.0):
    """Return 0 (no rub), 1 (partial rub) or 2 (never lets go) of a grid of starts, by steps of Runge and Kutta."""
    x, v = (part.ravel() for part in np.meshgrid(np.linspace(-0.9, 0.9, count), np.linspace(-3.0, 3.0, count), indexing="ij"))
    z, w, h = x + 0j, 1j * v, 2.0 * np.pi / nu / steps

    def acceleration(t, z, w):
        r = np.abs(z)
        n = z / np.maximum(r, 1e-300)
        load = stiffness * np.maximum(r - 1.0, 0.0) * (1.0 + 1j * friction * np.sign((w * n.conj()).imag + disk * nu))
        return eccentricity * nu * nu * np.exp(1j * nu * t) - 2.0 * zeta * w - z - load * n

    least, most = np.full(z.size, np.inf), np.zeros(z.size)
    for k in range(periods * steps):
        t = k % steps * h
        a = acceleration(t, z, w)
        b = acceleration(t + 0.5 * h, z + 0.5 * h * w, w + 0.5 * h * a)
        c = acceleration(t + 0.5 * h, z + 0.5 * h * (w + 0.5 * h * a), w + 0.5 * h * b)
        d = acceleration(t + h, z + h * (w + 0.5 * h * b), w + h * c)
        z, w = z + h * w + h * h / 6.0 * (a + b + c), w + h / 6.0 * (a + 2.0 * b + 2.0 * c + d)
        if k >= (periods - 20) * steps:
            r = np.abs(z)
            least, most = np.minimum(least, r), np.maximum(most, r)
    return np.where(most <= 1.0, 0, np.where(least > 1.0, 2, 1)).reshape(count, count)


@pytest.mark.slow
def test_dry_whirl_that_is_nearly_locked_to_the_spin():
    # the turns of dry whirl come back to phase 0 in short arcs, which take thousands of periods to meet
    known = motions_of_fixed_step(31, 300, 200, 2.1)
    assert [np.count_nonzero(known == k) for k in range(3)] == [437, 25, 499]
    system = bf.systems.jeffcott_rotor(stiffness=25.0, friction=0.1, offset=0.0, nu=2.1)
    basins = bf.basins_of_attraction(system, starts(0.9, 3.0, 11), max_periods=400)
    assert basins.counts[-1] == 0
    kinds = []
    for attractor in basins.attractors:
        points = attractor.points if isinstance(attractor, SampledAttractor) else attractor.state[None]
        beyond = np.mean(np.hypot(points[:, 0], points[:, 1]) > 1.0)
        kinds.append(0 if beyond == 0.0 else 2 if beyond == 1.0 else 1)
    assert np.count_nonzero(np.array(kinds)[basins.labels] != known[::3, ::3]) == 0
