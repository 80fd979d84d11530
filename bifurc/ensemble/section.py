"""Poincare section of motions without a clock: where a component of the state passes a value."""
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from ..checks import checked, choice, of, word
from ..compose.scene import Scene, scene_of
from ..compose.tables import TURN
from ..flow.trajectory import Trajectory
from .grid import _named, place_of

PER_TURN = 32  # looks at the motion in a period of the fastest oscillation
ON = 1e-11  # of the largest value of the component: as near the motion lies in the section, and has not passed it


@checked(coordinate=word, direction=of(choice, allowed=(1, -1, 0)))
@dataclass(frozen=True)
class Section:
    """Surface on which motions are compared: a component of the state passes a value in one direction, or in both.

    Where an event makes the component jump over the value, the state before the event counts.  A component that stays on the
    value for a while, such as the speed of a mass that sticks, has passed it when it leaves on the other side.

    Parameters
    ----------
    coordinate : str
        Component of the state: ``q0`` is the first coordinate, ``v0`` its velocity, ``w0`` the first memory.
    value : float
        In the unit of the component.
    direction : {1, -1, 0}
        1: while it rises, -1: while it falls (the maxima of q0 are ``Section("v0", direction=-1)``), 0: both.

    Raises
    ------
    ValueError
        Unknown names, values that are not finite, other directions.

    Examples
    --------
    >>> import bifurc as bf
    >>> bf.Section(coordinate="v0", value=0.0, direction=-1)
    Section(coordinate='v0', value=0.0, direction=-1)
    """

    coordinate: str
    value: float = 0.0
    direction: int = 1

    def __post_init__(self):
        _named(self.coordinate)

    def place(self, scene: Scene) -> int:
        """Return the place of the component in the state.

        Raises
        ------
        ValueError
            When the system has not this component.
        """
        return place_of(self.coordinate, scene.n, scene.ns, "Section")

    def crossings(self, motion: Trajectory) -> tuple[np.ndarray, np.ndarray]:
        """Return times (k,) and states (k, ns) at which a motion passes the section."""
        scene = scene_of(motion.system)
        place, step = self.place(scene), 2.0 * math.pi / (TURN * PER_TURN) * float(scene.tables.step.min())
        events = motion.events
        stops = [motion.start, *(event.time for event in events), motion.stop]
        looks = [np.linspace(begin, end, 1 + max(1, math.ceil((end - begin) / step)))
                 for begin, end in zip(stops[:-1], stops[1:], strict=True)]  # at an event twice
        t = np.concatenate(looks)
        y = motion(t)
        y[np.cumsum([len(look) for look in looks])[:-1] - 1] = np.array([event.before for event in events]).reshape(-1, scene.ns)
        away = y[:, place] - self.value
        sign = np.sign(np.where(np.abs(away) <= ON * np.abs(y[:, place]).max(initial=abs(self.value)), 0.0, away))
        told = np.flatnonzero(sign)
        rise = np.diff(sign[told])
        passed = np.flatnonzero(rise * self.direction > 0.0 if self.direction else rise)
        found = [self._at(motion, t, y, place, int(told[i]), int(told[i + 1])) for i in passed]
        return np.array([item[0] for item in found]), np.array([item[1] for item in found]).reshape(-1, scene.ns)

    def _at(self, motion: Callable, t: np.ndarray, y: np.ndarray, place: int, i: int, j: int) -> tuple[float, np.ndarray]:
        """Return time and state of a crossing between the looks ``i`` and ``j``, which lie on its two sides."""
        if j > i + 1:
            return float(t[i + 1]), y[i + 1]  # it lies in the section from there on
        if t[j] <= t[i]:
            return float(t[i]), y[i]  # a jump

        def away(s: float) -> float:
            return float((y[i] if s <= t[i] else y[j] if s >= t[j] else motion(s))[place]) - self.value

        at = brentq(away, t[i], t[j], xtol=1e-15, rtol=1e-14)
        return at, y[j] if at >= t[j] else motion(at)

    def to_record(self) -> dict:
        """Return the section as JSON knows it."""
        return {"coordinate": self.coordinate, "value": self.value, "direction": self.direction}
