"""A state of rest on the free side of every rigid stop, from which a search without a guess starts; or why there is none.

Least distance programming: Lawson and Hanson, Solving Least Squares Problems (1974), chapter 23.  Where its inequalities have no
solution, the multipliers of nonnegative least squares name the stops that contradict each other (Farkas).
"""
import itertools

import numpy as np
from scipy.optimize import nnls

from ..compose.natural import natural_length
from ..compose.scene import Scene, scene_of
from ..system import System

ASIDE = (0.1, 0.01, 1e-3, 0.0)  # of the farthest reach of a stop: how far a start at rest keeps off all of them
FEASIBLE = 1e-12  # of 1: what inequalities that contradict each other leave
STARTS = 64  # start modes among which is looked for one in which a stop's mass is free
PHASES = 64  # of a wave of the fastest excitation, at which is looked whether stops leave room
PART = 1e-9  # of the largest multiplier: that of a stop that takes part in a contradiction


class NoRoom(ValueError):
    """Rigid stops leave no room at some time, so that there is no motion to look for."""


def resting_start(system: System) -> np.ndarray:
    """Return the state of rest (ns,), moved out of stops that it would penetrate, a tenth further than they reach where there is
    room.

    Raises
    ------
    NoRoom
        When stops contradict each other, be it at one phase of the excitation only.
    """
    scene = scene_of(system)
    stops = straight_stops(scene)
    T = scene.tables
    y = np.zeros(scene.ns)
    for _ in range(8):
        clear = True
        for stop in stops:
            row = T.G[stop]
            depth = row[:scene.ns] @ y + farthest(scene, row)
            if depth >= 0.0:
                clear = False
                y = y - T.D[stop] * (depth + 0.1 * (natural_length(T) + abs(depth)))
        if clear:
            return y
    rows = np.array([T.G[stop] for stop in stops])
    least = between(system.mass, rows[:, :scene.n], np.array([farthest(scene, row) for row in rows]))
    if least is None:  # walls that move alike need not leave the room that each of them takes at some time
        least = at_every_phase(scene, rows, [scene.element_name(*stop) for stop in stops])
    return np.append(least, y[scene.n:])


def straight_stops(scene: Scene) -> list[tuple[int, int]]:
    """Return (mode, guard) of the rigid stops whose surfaces are straight, each in modes in which nothing holds what it stops.

    The modes are those that there are, and start modes, which are built until each stop has one.
    """
    for _ in itertools.islice(scene.start_modes(), STARTS):
        T = scene.tables
        found = [(m, g) for m in range(len(scene.keys)) for g in range(int(T.n_guards[m]))
                 if T.kick[m, g] and not scene.is_curved(int(T.element[m, g]))]
        free = [stop for stop in found if T.D[stop].any()]
        if {int(T.element[stop]) for stop in found} == {int(T.element[stop]) for stop in free}:
            break
    return free


def farthest(scene: Scene, row: np.ndarray) -> float:
    """Return how far the wall of a guard's ``row`` (nx,) comes at any phase, without what the state adds."""
    return float(row[scene.ns] + np.hypot(row[scene.ns + 1::2], row[scene.ns + 2::2]).sum())


def at_every_phase(scene: Scene, rows: np.ndarray, names: list[str]) -> np.ndarray:
    """Return the coordinates (n,) next to 0 that the stops ``rows`` (k, nx) of some ``names`` leave at phase 0, or raise `NoRoom`
    where they leave none at some phase."""
    mass, lean = scene.system.mass, rows[:, :scene.n]
    count = PHASES * max((1, *(int(h) for h in scene.harmonics))) if scene.period is not None else 1
    phases = np.arange(count) / count
    reach = scene.forcing(phases * (scene.period or 0.0)) @ rows[:, scene.ns:].T
    for phase, here in zip(phases, reach, strict=True):
        if between(mass, lean, here) is None:
            own = sorted({names[k] for k in against(mass, lean, here)})
            when = f" {phase:.3g} of the forcing period after its beginning" if np.ptp(reach, axis=0).any() else ""
            raise NoRoom(f"{scene.system!r} has no motion: its rigid stops {' and '.join(map(repr, own))} leave no room{when}; "
                         "see their gaps, sides and the motion of their walls")
    least = between(mass, lean, reach[0])
    assert least is not None
    return least


def between(mass: np.ndarray, rows: np.ndarray, reach: np.ndarray) -> np.ndarray | None:
    """Return the coordinates q (n,) next to 0, by inertia, with ``rows`` (k, n) @ q + ``reach`` (k,) <= 0, by a part of the
    farthest reach where there is room; None where there are none."""
    L, G, far, unit = _in_own_units(mass, rows, reach)
    one = np.append(np.zeros(len(mass)), 1.0)
    for part in ASIDE:
        E = np.vstack([G, far + part * np.abs(far).max()])
        left = one - E @ nnls(E, one)[0]
        if left[-1] > FEASIBLE:
            return unit * np.linalg.solve(L.T, -left[:-1] / left[-1])
    return None


def against(mass: np.ndarray, rows: np.ndarray, reach: np.ndarray) -> list[int]:
    """Return which of the inequalities of `between`, which have no solution, contradict each other."""
    _, G, far, _ = _in_own_units(mass, rows, reach)
    pressing = nnls(np.vstack([G, far]), np.append(np.zeros(len(mass)), 1.0))[0]
    return np.flatnonzero(pressing > PART * pressing.max()).tolist()


def _in_own_units(mass: np.ndarray, rows: np.ndarray, reach: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Return the Cholesky factor L (n, n) of the mass, the inequalities for L^T q (n, k) and their reaches (k,), both of size 1,
    and the size of L^T q: what contradicts itself leaves nothing of 1 only where places are of its size."""
    L = np.linalg.cholesky(mass)
    G = -np.linalg.solve(L, rows.T)
    steep, far = float(np.abs(G).max()), float(np.abs(reach).max()) or 1.0
    return L, G / steep, reach / far, far / steep
