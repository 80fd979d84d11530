"""What the package asks of a motion, however it is known: integrated, periodic, at rest, or from a sample of its section."""
from typing import Any, ClassVar

import numpy as np


class Motion:
    """A motion of a system, or a cycle of a map.

    Pictures, tables and verbs ask these, and nothing else, to tell one kind of motion from another.

    Attributes
    ----------
    periodic : bool
        Whether it is an orbit: ``sample(n)`` gives one period of it, ``periods`` forcing periods long.
    autonomous : bool
        Whether it has no phase: nothing excites the system.
    regime : str
        What it is, where period and events do not tell: "at rest", "chaotic", ...
    signature : str
        Its events or contact states in order, in words.
    family : list of int
        Coordinates along which motions of the same kind lie nearby, see `PeriodicOrbit.family`; empty: it stands alone.
    """

    __slots__ = ()
    periodic: ClassVar[bool] = False
    autonomous: Any = False
    regime: Any = ""
    signature: Any = ""
    family: Any = ()

    @property
    def sections(self) -> np.ndarray:
        """States (k, ns) at phase 0, one a forcing period."""
        raise NotImplementedError

    def past(self, t0: float, delay: float):
        """Return the motion before ``t0`` as a function of time, and the times of its events within ``delay`` before it.

        Raises
        ------
        ValueError
            When it is not known from ``t0 - delay`` to ``t0``.
        """
        raise ValueError(f"history = {self!r} is not allowed; it must be a motion, an orbit, or a function of time")
