"""What became of a start."""
from enum import StrEnum
from typing import NamedTuple

import numpy as np


class CellState(StrEnum):
    """Outcome of a cell; the position in ``tuple(CellState)`` is the code in `BasinMap.states`."""

    ATTRACTED = "attracted"
    UNSETTLED = "unsettled"
    OUTSIDE = "outside"
    DIVERGED = "diverged"
    TOO_MANY_EVENTS = "too_many_events"
    INCONSISTENT = "inconsistent"

    @property
    def code(self) -> int:
        """Position of the state."""
        return _CODES[self]

    @property
    def sentence(self) -> str:
        """What it means, and what to try."""
        return _SENTENCES[self]


_CODES = {state: code for code, state in enumerate(CellState)}
_SENTENCES = {
    CellState.ATTRACTED: "The motion came within the tolerance of a confirmed attractor.",
    CellState.UNSETTLED: "The motion came near no confirmed attractor within max_periods; raise max_periods, or look "
                         "at it with simulate: it may be quasi-periodic, neutral, or very slow.",
    CellState.OUTSIDE: "The cell lies beyond a rigid stop: it is no start.",
    CellState.DIVERGED: "The state left the finite numbers.",
    CellState.TOO_MANY_EVENTS: "A period held more events than max_events.",
    CellState.INCONSISTENT: "No combination of modes may follow an event of this motion, or several may begin: fields of first "
                            "order lead away from the surface on which it starts.",
}
REACHED, UNSETTLED, OUTSIDE, DIVERGED, CROWDED, STUCK = range(6)  # the codes, as kernels know them
ASK = 6  # the kernel leaves the cell to the general integration
NO_START, INFINITY = -2, -3  # coded labels of a start beyond a rigid stop, and of a motion that leaves all bounds


def coded(labels: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Return labels with codes of their own for cells that are no starts and for infinity."""
    return np.where(states == OUTSIDE, NO_START, np.where(states == DIVERGED, INFINITY, labels))
BEYOND = -1  # in place of the mode of a start: it lies beyond a rigid stop
UNCLEAR = -2  # it lies on a surface, or no mode is clear: all elements decide together
DEFERRED = -3  # its memory is not such as the usual modes of a start rely on: the general integration knows others
STOPPED = -4  # it is followed no longer: somebody interrupts


class Cells(NamedTuple):
    """What became of starts, one entry each."""

    labels: np.ndarray  # int64, -1: none
    periods: np.ndarray  # int64, forcing periods until it was near the attractor
    impacts: np.ndarray  # int64, impacts and elastic contacts until then
    states: np.ndarray  # int64, code of `CellState`
    speeds: np.ndarray  # float, least speed of arrival at a stop until then; 0: a complete chattering; inf: no impact

    @classmethod
    def blank(cls, size: int, label: int = -1, state: int = ASK) -> "Cells":
        """Return cells of which nothing is known yet."""
        labels, periods, impacts, states = (np.full(size, value, np.int64) for value in (label, 0, 0, state))
        return cls(labels, periods, impacts, states, np.full(size, np.inf))
