"""A motion under delayed feedback: events, states at any time, and the feedback force."""
from dataclasses import dataclass, field

import numpy as np

from ... import plotting
from ...content import Content
from ...motion import Motion
from ...system import System
from ..status import Status
from ..trajectory import Event, past
from .history import History


@dataclass(frozen=True, eq=False)
class DelayedMotion(Content, Motion):
    """A motion through its events, under feedback of its own past.

    Attributes
    ----------
    system : System
    start, stop : float
    final : ndarray (ns,)
        State at `stop`.
    status : Status
    message : str
    events : tuple of Event
    """

    system: System
    start: float
    stop: float
    final: np.ndarray = field(repr=False)
    status: Status
    message: str = field(repr=False)
    events: tuple[Event, ...] = field(repr=False)
    history: History = field(repr=False)
    gain: np.ndarray = field(repr=False)  # (m,) of each feedback
    rows: np.ndarray = field(repr=False)  # (m, ns) coordinates that are fed back

    @property
    def success(self) -> bool:
        """Whether the end time was reached."""
        return self.status is Status.COMPLETED

    def __call__(self, t) -> np.ndarray:
        """Return the states (..., ns) at times ``t``; at an event the state after it.

        Raises
        ------
        ValueError
            When a time lies outside the motion.
        """
        times, found = self._at(t)
        return found[0].reshape(*times.shape, self.final.size)

    def feedback(self, t) -> np.ndarray:
        """Return the feedback force (...,) at times ``t``; (..., m) for m feedbacks, in the order of the elements."""
        times, (states, delayed, _) = self._at(t)
        forces = delayed - self.gain * (states @ self.rows.T)
        return forces.reshape(times.shape if len(self.gain) == 1 else (*times.shape, len(self.gain)))

    def _at(self, t):
        times = np.asarray(t, float)
        slack = 1e-12 * max(abs(self.start), abs(self.stop))
        if times.size and not (times.min() >= self.start - slack and times.max() <= self.stop + slack):
            raise ValueError(f"t must lie in [{self.start!r}, {self.stop!r}], the motion that was simulated")
        return times, self.history.at(np.clip(times.ravel(), self.start, self.stop))

    @property
    def sections(self) -> np.ndarray:
        """States (K, ns) at the whole forcing periods from start to stop."""
        period = self.system.period
        if period is None:
            raise ValueError("sections need a forcing period; this system is autonomous")
        first = np.ceil(self.start / period - 1e-12)
        last = np.floor(self.stop / period + 1e-12)
        return self(np.clip(np.arange(first, last + 1) * period, self.start, self.stop))

    def past(self, t0: float, delay: float):
        """See `Motion.past`."""
        return past(self, t0, delay)

    def sample(self, n: int) -> tuple[np.ndarray, np.ndarray]:
        """Return ``n`` equally spaced times from start to stop, and the states (n, ns)."""
        times = np.linspace(self.start, self.stop, n)
        return times, self(times)

    def plot(self, axes=None):
        """Draw the motion on the section and the feedback force; return the axes."""
        return plotting.plot_delayed(self, axes)
