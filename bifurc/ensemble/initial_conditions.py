"""Starts from named components, and in which mode each begins: the clear cases; the rest goes to `bifurc.flow.settle`."""
from collections.abc import Mapping, Sequence

import numpy as np

from ..compose.scene import Scene
from ..compose.tables import Tables
from ..flow.rule import NOISE
from ..flow.scan import PENETRATION
from ..structure.components import place_of
from .outcomes import BEYOND, UNCLEAR


def states_at(scene: Scene, names: Sequence[str], at: Mapping[str, float], points: np.ndarray,
              owner: str = "grid") -> np.ndarray:
    """Return starts (k, ns) at phase 0 from their components ``names`` in ``points`` (k, d) and the fixed ones ``at``.

    Components named in neither are 0, memory is that of the virgin state: where an element without load has it.

    Raises
    ------
    ValueError
        When the system has not a component.
    """
    n, ns = scene.n, scene.ns
    given = {name: place_of(name, n, ns, owner, scene.system.states) for name in (*names, *at)}
    x = np.zeros((ns + scene.nw, len(points)))
    for name, value in at.items():
        x[given[name]] = value
    for name, values in zip(names, points.T, strict=True):
        x[given[name]] = values
    if ns > 2 * n:
        x[ns:] = scene.forcing(np.zeros(1)).T
        virgin = x.copy()
        scene.relax(virgin)
        loose = [place for place in range(2 * n, ns) if place not in given.values()]
        x[loose] = virgin[loose]
    return np.ascontiguousarray(x[:ns].T)


def begin(T: Tables, candidates: np.ndarray, X: np.ndarray, modes: np.ndarray) -> None:
    """Write into ``modes`` (N,) the mode in which each of the starts ``X`` (N, ns) at phase 0 begins.

    ``candidates`` are scene modes in the order they are tried (`Scene.start_modes`).
    """
    ns, nx = T.A.shape[1], T.A.shape[2]
    x = np.zeros((len(X), nx))
    x[:, :ns] = X
    x[:, ns] = 1.0
    x[:, ns + 1::2] = 1.0  # cos 0; forcing has the rounding of its amplitude
    scale = np.abs(x)
    scale[:, ns:] = 1.0
    modes[:] = UNCLEAR
    open_, beyond = np.ones(len(X), bool), np.zeros(len(X), bool)
    for m in candidates.tolist():
        good, clear = open_.copy(), np.ones(len(X), bool)
        for rows in (T.H[m, :T.n_holds[m]], T.S[m, :T.n_holds[m]]):
            good &= (np.abs(x @ rows.T) <= NOISE * (scale @ np.abs(rows).T)).all(axis=1)
        ruled_out = ~good  # by what must be at rest: whatever the guards say, a load on the limit of stick included
        for g in range(T.n_guards[m]):
            value, size = x @ T.G[m, g], scale @ np.abs(T.G[m, g])
            past = value > PENETRATION * size
            good &= ~past
            beyond |= open_ & past & (T.kick[m, g] == 1)
            clear &= past | (value < -NOISE * size)
            if T.LG[m, g].any():  # the guard also feels a law
                clear[:] = False
        clear |= ruled_out
        modes[good & clear] = m
        open_ &= clear & ~good
    modes[open_ & beyond] = BEYOND


def unloaded(scene: Scene, X: np.ndarray) -> None:
    """Put memory beyond a limit, in the starts ``X`` (N, ns), where the limit puts it: `bifurc.flow.settle.unloaded` for many."""
    ns, n = scene.ns, scene.n
    if ns == 2 * n or not len(X):
        return
    x = np.hstack((X, np.tile(scene.forcing(np.zeros(1)), (len(X), 1))))
    disordered = scene.disordered(X)
    patterns, which = np.unique(np.array([*disordered.values()]).T.reshape(len(X), -1), axis=0, return_inverse=True)
    waiting = [(next(scene.start_modes([e for e, yes in zip(disordered, pattern, strict=True) if yes])),
                np.flatnonzero(which.ravel() == i), 4 * (ns - 2 * n)) for i, pattern in enumerate(patterns)]
    while waiting:
        mode, rows, turns = waiting.pop()
        for g in range(scene.tables.n_guards[mode]):
            T = scene.tables
            if T.kick[mode, g] or not rows.size or not turns:
                continue
            value = x[rows] @ T.G[mode, g]
            size = np.abs(x[rows, :ns]) @ np.abs(T.G[mode, g, :ns]) + np.abs(T.G[mode, g, ns:]).sum()
            over = value > NOISE * size
            if not over.any():
                continue
            owner = scene.guard(mode, g)
            own = scene.memory_of(owner.element)
            many = rows[over]
            for group in many[:, None] if callable(owner.guard.then) else (many,):  # what follows may depend on the state
                keys = scene.followers(mode, g, x[group[0]])
                after = next((m for key in keys if (m := scene.combine(mode, owner.element, key)) is not None), mode)
                slips = [(place, row) for place, row in scene.algebraic(after) if own.start <= place < own.stop]
                if after != mode and slips:
                    for place, row in slips:
                        x[group, place] = x[group] @ row
                    waiting.append((after, group, turns - 1))
                    rows = np.setdiff1d(rows, group)
    X[:] = x[:, :ns]
