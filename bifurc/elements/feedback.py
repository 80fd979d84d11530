"""Delayed feedback as an element: the force K (s(t - T) - s(t)) of Pyragas (1992), extended with memory (Socolar 1994)."""
import math
from dataclasses import dataclass

from ..checks import choice, number
from .atrow import AtRow
from .local import s, u
from .mode import Mode


@dataclass(frozen=True)
class DelayedFeedback(AtRow):
    """Feedback of a coordinate or its velocity one delay ago: p = gain (s(t - T) - s(t)) + repeat p(t - T).

    It vanishes on every motion of period T, whose stability alone it changes.  `simulate` follows such systems;
    `control.feedback_range` tells the gains that make an orbit of the system without it stable.  Orbits, branches, harmonic
    balance and basin maps refuse it by name.

    Parameters
    ----------
    gain : float
        Force per length, or per speed.
    delay : float
        In forcing periods, above 0 (in an autonomous system: time).
    repeat : float
        R of the extended feedback, 0 <= R < 1 (its memory of earlier periods); 0: plain feedback.
    of : {"displacement", "velocity"}
        What is fed back.
    dof, row
        Where it is measured and acts, see `AtRow`.
    """

    gain: float = 0.1
    delay: float = 1.0
    repeat: float = 0.0
    of: str = "displacement"

    def __post_init__(self):
        super().__post_init__()
        name = type(self).__name__
        number(name, "delay", self.delay, above=0.0)
        if not 0.0 <= self.repeat < 1.0:
            raise ValueError(f"{name}: repeat = {self.repeat!r} is not allowed; it must be at least 0 and below 1")
        choice(name, "of", self.of, ("displacement", "velocity"))

    delayed = True

    def delay_of(self, omega: float | None) -> float:
        """Return the delay, time, in a system with this excitation frequency."""
        return self.delay if omega is None else self.delay * 2.0 * math.pi / omega

    def mode(self, key, core):
        """Return the only mode: what acts without delay."""
        return Mode(force=(-self.gain * (u(0) if self.of == "displacement" else s(0)),))

    def mirrored(self):
        """Its own image when the delay is a whole number of periods."""
        return self
