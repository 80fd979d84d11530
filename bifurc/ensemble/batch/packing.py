"""Batch steps of a scene: which scenes have one, its numbers, and the module written for its kind."""
from typing import NamedTuple

import numpy as np

from ...compose.scene import Scene
from ...compose.tables import Tables, rate
from . import several_modes
from .tables import step_numbers
from .writing import written

MOST_MASSES, MOST_MODES, MOST_GUARDS = 3, 64, 8
MOST_HARMONICS = 8
MOST_SUBSTEPS = 4096


class Kind(NamedTuple):
    """What the written module depends on."""

    n: int  # masses
    guards: int  # largest number of guards of a mode


class Numbers(NamedTuple):
    """What the kernels of a written module read."""

    T: Tables
    numbers: np.ndarray  # (modes,) records, see `several_modes.records` and `law_modes.Kind.records`
    grid: np.ndarray  # (modes, substeps) records of what forcing adds


def fits(scene: Scene, masses: int, modes: int, guards: int) -> bool:
    """Return whether a scene may have a batch: forced, without memory, all its modes known, and not more of anything than that."""
    T = scene.tables
    return bool(scene.n <= masses and scene.ns == 2 * scene.n and scene.complete and scene.period is not None
                and len(scene.harmonics) <= MOST_HARMONICS and len(T.n_guards) <= modes and T.n_guards.max() <= guards)


def kind_of(scene: Scene) -> Kind | None:
    """Return what batch a scene needs, None when it has none: see `fits`, and laws."""
    if not scene.closed_form or not fits(scene, MOST_MASSES, MOST_MODES, MOST_GUARDS):
        return None
    if not 0 < substeps(scene.tables) <= MOST_SUBSTEPS:
        return None
    return Kind(scene.n, max(int(scene.tables.n_guards.max()), 1))


def substeps(T: Tables) -> int:
    """Return the substeps of a period: on none of them the scaled motion of any mode turns by more than `several_modes.TURN`."""
    count = 2.0 * np.pi / T.flat[0] * max(rate(T, m) for m in range(len(T.n_guards))) / several_modes.TURN
    return max(int(np.ceil(count - 1e-9)), 8) if np.isfinite(count) and count < 1e9 else -1


def numbers_of(T: Tables, kind: Kind) -> Numbers:
    """Return what the kernels read of the tables of a scene."""
    return Numbers(T, *step_numbers(T, kind.guards, substeps(T)))


def module_of(kind: Kind):
    """Return the written module of a kind."""
    return written(several_modes.modes_text(*kind))
