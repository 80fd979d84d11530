"""A motion seen up to a shift: what it has moved along in a period is taken away again, which nothing feels."""
from dataclasses import dataclass

import numpy as np

from ...checks import number, refused, vector, whole
from ..element import ALWAYS, Element
from ..kinds import EventKind
from ..local import affine, sin, u
from ..mode import Guard, Mode
from ..site import Rows

BEFORE, AFTER = "before", "after"


@dataclass(frozen=True)
class Shift(Element):
    """Moves the system back at the beginning of every period, along a direction in which no force changes.

    A motion that advances by the same amount in every period is periodic then.  `compose.shifts.shifted` makes one for a system.

    Parameters
    ----------
    direction : sequence of float
        How far each state (coordinates, velocities, memory; those left out stay) is moved for one unit of the coordinate.
    dof : int
        The coordinate that measures the shift, of which the direction has 1.
    by : float, optional
        The shift of a period, length or angle; None: whatever it is, the coordinate is put back to zero.
    clocked : bool
        At phase 0 of the excitation; False: where the coordinate reaches ``by``, for systems without excitation.
    """

    direction: tuple[float, ...] = (1.0,)
    dof: int = 0
    by: float | None = None
    clocked: bool = True

    def __post_init__(self):
        super().__post_init__()
        name = type(self).__name__
        object.__setattr__(self, "dof", whole(name, "dof", self.dof, least=0))
        object.__setattr__(self, "direction", vector(name, "direction", self.direction))
        if self.dof >= len(self.direction) or self.direction[self.dof] != 1.0:
            raise refused(name, "direction", self.direction, f"factors of the states, 1 of coordinate {self.dof}")
        if self.by is not None:
            number(name, "by", self.by)
        if not self.clocked and not self.by:
            raise refused(name, "by", self.by, "a shift that is not zero, without an excitation that gives the period")

    @property
    def parameters(self):
        """None: a shift is what motions are found up to."""
        return {}

    @property
    def structure(self):
        """All of it."""
        return (type(self), self.direction, self.dof, self.by, self.clocked)

    @property
    def harmonics(self):
        """That of its clock."""
        return (1,) if self.clocked else ()

    @property
    def start(self):
        """Keys of a start."""
        return (BEFORE, AFTER) if self.clocked else (ALWAYS,)

    def site(self, n):
        """Return the row of the coordinate."""
        return Rows.of(self.dof, n)

    def mode(self, key, core):
        """Return "before", the half of a period that ends in the shift, or "after"; without a clock the only mode."""
        back = (self.direction, -u(0) if self.by is None else affine(-self.by))
        if not self.clocked:
            way = float(np.sign(self.by))
            return Mode(guards=(Guard(way * u(0) - abs(self.by), EventKind.RESET, (ALWAYS,), displaced=back),))
        if key == BEFORE:
            return Mode(guards=(Guard(sin(1), EventKind.RESET, (AFTER,), displaced=back),))
        return Mode(guards=(Guard(-sin(1), EventKind.CLOCK, (BEFORE,), silent=True),))

    def stored_energy(self, u):
        """None."""
        return 0.0
