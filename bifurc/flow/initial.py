"""What a motion is started with: its state, its time, its length, checked."""
import math
from collections.abc import Mapping

import numpy as np

from ..checks import listed, refused, state
from ..structure.components import state_of

PHASE = 1e-6  # of the period: floats that far apart lose as much of the phase, far above the error of a motion


def checked_length(scene, periods, duration, t0) -> tuple[float, float]:
    """Return start and length (periods or duration, whichever is given) of a motion, or raise ValueError."""
    if (periods is None) == (duration is None):
        raise ValueError("give either periods or duration")
    if periods is not None and scene.period is None:
        raise ValueError(f"{scene.system!r} has no forcing period; give duration instead of periods")
    length = periods if periods is not None else duration
    if np.spacing(abs(t0)) > PHASE * (scene.period or length or math.inf):
        raise refused("simulate", "t0", t0, "a time at which floats are close enough to tell the phase of the excitation: they are "
                      f"{np.spacing(abs(t0)):.3g} apart there. The motion is the same a whole number of periods earlier")
    return t0, length


def checked_state(scene, y0, t0: float) -> np.ndarray:
    """Return a start state (ns,) as given, memory that is left out in its virgin state, or raise ValueError."""
    given = start_of(scene, "y0", y0)
    x = np.concatenate((given, np.zeros(scene.ns - given.size), scene.forcing(np.array([t0]))[0]))
    if given.size < scene.ns:
        scene.relax(x)
    return x[:scene.ns]


def start_of(scene, owner: str, value) -> np.ndarray:
    """Return a start (2 n,) or (ns,) given as numbers, or as a dict of components by name, or raise ValueError."""
    if isinstance(value, Mapping):
        return state_of(owner, value, scene.n, scene.ns, scene.system.states)
    return state(owner, value, (2 * scene.n or scene.ns, scene.ns))


def checked_mode(scene, mode) -> tuple:
    """Return keys of all elements as given, or raise ValueError."""
    try:
        if len(keys := tuple(listed(mode) or ())) == len(scene.system.elements):
            scene.index(keys)
            return keys
    except (KeyError, TypeError, ValueError):  # of what is no key of an element
        pass
    raise refused("simulate", "mode", mode, f"one mode of each of the {len(scene.system.elements)} elements, such as orbit.mode")
