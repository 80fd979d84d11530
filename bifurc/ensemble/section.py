"""Poincare section of motions without a clock: where a component of the state passes a value."""
import math
from dataclasses import dataclass

import numpy as np

from ..checks import TRAJECTORY, checked, choice, of, word
from ..compose.scene import Scene, scene_of
from ..compose.tables import TURN
from ..flow.trajectory import Trajectory
from ..structure.components import named, place_of

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
        Component of the state: ``q0`` is the first coordinate, ``v0`` its velocity, ``w0`` the first memory;
        of a system of first order one of its own names.
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
        named(self.coordinate, "Section: coordinate")

    def place(self, scene: Scene) -> int:
        """Return the place of the component in the state.

        Raises
        ------
        ValueError
            When the system has not this component.
        """
        return place_of(self.coordinate, scene.n, scene.ns, "section", scene.system.states)

    @checked(motion=TRAJECTORY)
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
        before, after = told[passed], told[passed + 1]
        jumps = t[after] <= t[before]
        at = np.where(jumps, before, before + 1)  # the state before a jump; else it lies in the section from there on
        times, states = t[at], y[at]
        arcs = np.flatnonzero((after == before + 1) & ~jumps)
        if arcs.size:
            first, last = before[arcs], after[arcs]
            times[arcs], states[arcs] = motion.passing(t[first], y[first], t[last] - t[first], place, self.value,
                                                       np.column_stack([away[first], away[last]]))
        return times, states

    def to_record(self) -> dict:
        """Return the section as JSON knows it."""
        return {"coordinate": self.coordinate, "value": self.value, "direction": self.direction}
