"""Batch steps of a scene: which scenes have one, its numbers, and the module written for its kind."""
from typing import NamedTuple

import numpy as np

from ...compose.scene import Scene
from ...compose.tables import ORDER as TERMS_ORDER
from ...compose.tables import Tables, rate
from . import one_mode, several_modes
from . import tables as plan
from .writing import CERTIFIED, DEFERRED, SIZE, written

MOST_MASSES = 3
MOST_GUARDS = 3  # of a mode of one mass, which has a certified integration of its own
MOST_GUARDS_OF_SEVERAL, MOST_MODES_OF_SEVERAL = 8, 64
MOST_HARMONICS = 8
MOST_SUBSTEPS = 4096


class Kind(NamedTuple):
    """What the written module depends on."""

    n: int  # masses
    guards: int  # largest number of guards of a mode
    forcings: int  # forcing states: 1, cos and sin of every harmonic
    one_stop: bool  # whether the batch step knows one mode only, free with one rigid stop


class Numbers(NamedTuple):
    """What the kernels of a written module read, see `bifurc.ensemble.batch.certified` and `bifurc.ensemble.batch.tables`."""

    P: np.ndarray | Tables  # (modes, NUMBERS); of several masses the tables themselves
    I: np.ndarray  # (modes, ...) int64
    harmonics: np.ndarray  # int64
    phases: np.ndarray  # (forcings (substeps + 1),) forcing states on the grid, one after the other
    forced: np.ndarray  # (modes (substeps + 1) (2 + 2 guards),) what they add: to the state after, to values, slopes
    home: int  # the mode of the batch step; ANY: the batch step knows all
    numbers: np.ndarray  # of the batch step, flat, see `several_modes.Places`
    grid: np.ndarray  # the same on every substep


def kind_of(scene: Scene) -> Kind | None:
    """Return what batch a scene needs, None when it has none: many degrees of freedom, memory, laws, many guards."""
    T = scene.tables
    if scene.n > MOST_MASSES or scene.ns != 2 * scene.n or not scene.closed_form or not scene.complete or scene.period is None:
        return None
    if len(scene.harmonics) > MOST_HARMONICS or not 0 < substeps(T) <= MOST_SUBSTEPS:
        return None
    if scene.n > 1:
        few = T.n_guards.max() <= MOST_GUARDS_OF_SEVERAL and len(T.n_guards) <= MOST_MODES_OF_SEVERAL
        return Kind(scene.n, max(int(T.n_guards.max()), 1), scene.nw, False) if few else None
    if T.n_guards.max() > MOST_GUARDS or T.n_holds.max() > 1:
        return None
    return Kind(1, max(int(T.n_guards.max()), 1), scene.nw, home_of(T) >= 0)


def home_of(T: Tables) -> int:
    """Return the first mode without held rows whose only guard is a rigid stop that throws the mass back, or -1."""
    for m in range(len(T.n_guards)):
        if T.n_holds[m] == 0 and T.n_guards[m] == 1 and plan.rebounds(T, m, 0):
            return m
    return -1


def substeps(T: Tables) -> int:
    """Return the substeps of a period: on none of them the scaled motion of any mode turns by more than `several_modes.TURN`."""
    top = max(rate(T, m) for m in range(len(T.n_guards)))
    count = 2.0 * np.pi / T.flat[0] * top / several_modes.TURN
    return max(int(np.ceil(count - 1e-9)), 8) if np.isfinite(count) and count < 1e9 else -1


def numbers_of(T: Tables, kind: Kind) -> Numbers:
    """Return what the kernels read of the tables of a scene."""
    steps = substeps(T)
    omega, harmonics = float(T.flat[0]), T.harmonics
    h = 2.0 * np.pi / omega / steps
    angles = 2.0 * np.pi * np.arange(steps + 1) / steps
    phases = np.ones((steps + 1, kind.forcings))
    for i, k in enumerate(harmonics):
        phases[:, 1 + 2 * i], phases[:, 2 + 2 * i] = np.cos(k * angles), np.sin(k * angles)
    phases[-1] = phases[0]
    powers = h ** np.arange(TERMS_ORDER + 1)
    flow = T.YT @ powers  # (modes, ns, nx) state after h
    if kind.n > 1:
        none = np.zeros(1)
        I = np.hstack((np.zeros((len(T.n_guards), 3 + 4 * kind.guards), np.int64), plan.plan_of(T, kind.guards)))
        return Numbers(T, I, harmonics.astype(np.int64), none, none, several_modes.ANY,
                       *plan.step_numbers(T, kind.guards, h, flow, phases, _bounds(T, h)))
    modes, most = len(T.n_guards), kind.guards
    nx = 2 + kind.forcings
    followers = {(m, g): plan.followers(T, m, g) for m in range(modes) for g in range(T.n_guards[m])}
    candidates = max([1, *(len(found) for found in followers.values())])
    P = np.zeros((modes, _places(kind)["NUMBERS"]))
    I = np.zeros((modes, 3 + most * (4 + candidates)), np.int64)
    at = _places(kind)
    for m in range(modes):
        guards = int(T.n_guards[m])
        p = P[m]
        p[at["STEP"]], p[at["OMEGA"]], p[at["REACH"]] = h, omega, T.step[m]
        p[at["FLOW"]:at["FLOW"] + 2 * nx] = flow[m].ravel()
        p[at["STATES"]:at["SERIES"]] = T.YT[m, 0].ravel()
        if T.n_holds[m]:
            p[at["HOLD"]:at["HOLD"] + nx], p[at["PLACE"]:at["PLACE"] + nx] = T.H[m, 0], T.S[m, 0]
        I[m, :3] = guards, T.n_holds[m], candidates
        for g in range(guards):
            rows = T.GT[m, g]
            p[at["RATIOS"] + g] = T.ratio[m, g]
            p[at["KAPPAS"] + g] = -2.0 * rows[:2, 2] @ T.B[m, g]
            for name, values in (("VALUE", T.G[m, g]), ("SLOPE", rows[:, 1]), ("BOUND", _bound(rows, h)),
                                 ("PUSH", 2.0 * rows[:, 2])):
                if name == "BOUND":  # forcing counts with its amplitude
                    values[2:] = values[2:].sum(), *np.zeros(kind.forcings - 1)
                start = at[name] + g * nx
                p[start:start + nx] = values
            start = at["RESET"] + 2 * g * nx
            p[start:start + 2 * nx] = T.R[m, g].ravel()
            start = at["PUSH_RATE"] + g * nx
            rest = int(T.ends_in[m, g])
            if rest >= 0:
                p[start:start + nx] = 2.0 * rows[:2, 2] @ T.A[rest]
            for i, k in enumerate(harmonics):
                c = 2 + 1 + 2 * i
                p[start + c] += 2.0 * k * omega * rows[c + 1, 2]
                p[start + c + 1] -= 2.0 * k * omega * rows[c, 2]
            start = at["SERIES"] + g * nx * (TERMS_ORDER + 1)
            p[start:start + rows.size] = rows.ravel()
            start = 3 + g * (4 + candidates)
            kick = T.kick[m, g] * (2 if plan.keeps_guard(T, m, g) else 1)
            I[m, start:start + 4] = kick, T.D[m, g, 0] != 0.0, T.ends_in[m, g], plan.is_hit(T, m, g)
            found = followers[m, g]
            I[m, start + 4:start + 4 + candidates] = found + [-1] * (candidates - len(found))
    common = harmonics.astype(np.int64), phases.ravel(), _forced(T, kind, flow, phases)
    numbers, grid = plan.step_numbers(T, most, h, flow, phases, _bounds(T, h))
    if not kind.one_stop:
        return Numbers(P, np.hstack((I, plan.plan_of(T, most))), *common, several_modes.ANY, numbers, grid)
    home = home_of(T)
    return Numbers(P, I, *common, home, numbers.reshape(modes, -1)[home], grid.reshape(modes, -1)[home])


def _bounds(T: Tables, h: float) -> np.ndarray:
    """Return `_bound` of every guard of every mode (modes, guards, nx)."""
    return np.array([[_bound(T.GT[m, g], h) for g in range(T.GT.shape[1])] for m in range(len(T.n_guards))])


def _forced(T: Tables, kind: Kind, flow: np.ndarray, phases: np.ndarray) -> np.ndarray:
    """Return what the forcing adds on the grid, flat, see `Numbers.forced`."""
    modes = len(T.n_guards)
    made = np.zeros((modes, len(phases), 2 + 2 * kind.guards))
    for m in range(modes):
        made[m, :, :2] = phases @ flow[m, :, 2:].T
        for g in range(T.n_guards[m]):
            made[m, :, 2 + 2 * g], made[m, :, 3 + 2 * g] = phases @ T.G[m, g, 2:], phases @ T.GT[m, g, 2:, 1]
    return made.ravel()


def _bound(rows: np.ndarray, h: float) -> np.ndarray:
    """Return h^4/384 times the bound on the fourth derivative over [0, h], per unit of each component of x."""
    j = np.arange(rows.shape[1])
    falling = j * (j - 1.0) * (j - 2.0) * (j - 3.0)
    return (np.abs(rows[:, 4:]) * falling[4:] * h ** (j[4:] - 4.0)).sum(axis=1) * h**4 / 384.0


def _places(kind: Kind) -> dict[str, int]:
    """Return the places in the numbers of a mode: those of `bifurc.ensemble.batch.certified`."""
    guards, nx, terms = kind.guards, 2 + kind.forcings, TERMS_ORDER + 1
    sizes = {"STEP": 1, "OMEGA": 1, "REACH": 1, "RATIOS": guards, "KAPPAS": guards, "FLOW": 2 * nx, "VALUE": guards * nx,
             "SLOPE": guards * nx, "BOUND": guards * nx, "RESET": 2 * guards * nx, "PUSH": guards * nx,
             "PUSH_RATE": guards * nx, "HOLD": nx, "PLACE": nx, "STATES": nx * terms, "SERIES": guards * nx * terms,
             "NUMBERS": 0}
    starts = np.concatenate(([0], np.cumsum(list(sizes.values()))[:-1]))
    return dict(zip(sizes, starts.tolist(), strict=True))


def module_of(kind: Kind):
    """Return the written module of a kind."""
    if kind.one_stop:
        return written(one_mode.step_text(kind.guards, SIZE), 2, kind.guards, kind.forcings, CERTIFIED, one_mode.spaces(SIZE))
    text, spaces = several_modes.modes_text(kind.n, kind.guards, SIZE), several_modes.spaces(kind.n, kind.guards, SIZE)
    return written(text, 2 * kind.n, kind.guards, kind.forcings, CERTIFIED if kind.n == 1 else DEFERRED, spaces)
