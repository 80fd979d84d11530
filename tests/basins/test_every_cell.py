"""Every cell of two basin maps of 400 x 400 against second implementations on numpy vectors (specs/global 6)."""
import numpy as np
import pytest

import bifurc as bf

from .second import SectionMap

A = {"zeta": 0.02, "omega": 2.6, "amplitude": 1.0, "gap": 0.0, "restitution": 0.8}
DUFFING = {"zeta": 0.075, "omega": 1.0, "amplitude": 0.3, "alpha": -1.0, "beta": 1.0}
BLOCK = 20000  # cells at once: their vectors stay in the cache
# Yoshida's composition of order 6 (1990, solution A)
OUTER = (0.784513610477560, 0.235573213359357, -1.17767998417887)
STAGES = np.array([*OUTER, 1.0 - 2.0 * sum(OUTER), *OUTER[::-1]])


def settled(step, x, v, points, owner, periods, near):
    """Owner of the point that each start comes to within ``near`` in so many periods, -1: to none."""
    found = np.full(x.size, -1)
    open_ = np.arange(x.size)
    for _ in range(periods):
        x, v = step(x, v)
        distance = np.hypot(x[:, None] - points[:, 0], v[:, None] - points[:, 1])
        there = distance.min(axis=1) < near
        found[open_[there]] = owner[distance.argmin(axis=1)[there]]
        open_, x, v = open_[~there], x[~there], v[~there]
        if not open_.size:
            break
    return found


@pytest.mark.slow
def test_every_cell_of_problem_a():
    """Closed-form flights in numpy, until a start is 1e-9 from an orbit: 160000 cells, none different."""
    basins = bf.basins_of_attraction(bf.systems.impact_oscillator(**A), bf.Grid(q0=(-2.5, 0, 400), v0=(-3, 3, 400)), workers=1)
    second = SectionMap(A["zeta"], A["omega"], A["amplitude"], A["gap"], A["restitution"])
    points = [np.array([[-0.6575133778, 0.0413666341]]), np.array([[-1.0220227055, 0.2057415990]])]
    for k, count in enumerate((1, 3)):
        for _ in range(600):  # onto the orbit of the second implementation, from the ten digits of the reference
            points[k] = np.array(second(*points[k].T)[:2]).T
        for _ in range(count - 1):
            points[k] = np.vstack((points[k], np.array(second(*points[k][-1:].T)[:2]).T))
    owner = np.array([0, 1, 1, 1])
    starts = basins.grid.starts(1, 2)
    labels = np.concatenate([settled(lambda x, v: second(x, v)[:2], *part.T, np.vstack(points), owner, 400, 1e-9)
                             for part in np.array_split(starts, len(starts) // BLOCK)])
    assert np.count_nonzero(basins.labels.ravel() != labels) == 0
    assert np.count_nonzero(labels == 0) == 0.4286875 * 160000


def duffing(steps):
    """Map of the Duffing oscillator over a period: drift with exact damping, kick; so many compositions of order 6 a period."""
    h, c = 2.0 * np.pi / steps, 0.15
    drifts = np.convolve(STAGES, [0.5, 0.5]) * h
    decay, length = np.exp(-c * drifts), -np.expm1(-c * drifts) / c
    times = np.cumsum(drifts)[:-1] + h * np.arange(steps)[:, None]
    force = DUFFING["amplitude"] * np.cos(times)

    def step(x, v):
        x, v = x.copy(), v.copy()
        for row in force:
            for i, f in enumerate(row):
                x += length[i] * v
                v *= decay[i]
                v += (h * STAGES[i]) * (x * (1.0 - x * x) + f)
            x += length[-1] * v
            v *= decay[-1]
        return x, v
    return step


@pytest.mark.slow
def test_every_cell_of_the_duffing_oscillator():
    """160000 cells by splitting of order 6: those that come to the orbit, and those that do not in 300 periods."""
    basins = bf.basins_of_attraction(bf.systems.duffing_oscillator(**DUFFING), bf.Grid(q0=(-2.2, 2.2, 400), v0=(-2.2, 2.2, 400)),
                                     workers=1)
    starts = basins.grid.starts(1, 2)
    coarse, fine = duffing(160), duffing(320)
    few = starts[::997].T
    x, v = coarse(*few)
    y, w = fine(*few)
    assert max(np.abs(x - y).max(), np.abs(v - w).max()) < 1e-5
    point = np.array([[0.6387555305], [1.3415984052]])
    for _ in range(400):
        point = np.array(coarse(*point))
    assert np.abs(point.T - basins.attractors[0].state).max() < 1e-5
    labels = np.concatenate([settled(coarse, *part.T, point.T, np.zeros(1, int), 300, 1e-5)
                             for part in np.array_split(starts, len(starts) // BLOCK)])
    assert np.count_nonzero((basins.labels.ravel() == 0) != (labels == 0)) == 0
    assert np.count_nonzero(basins.labels == 0) == pytest.approx(0.3728 * 160000, abs=8)
