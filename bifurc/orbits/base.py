"""What orbits have in common, however they were found: measures that are checked alike, files, pictures."""
import math

import numpy as np

from .. import io, plotting
from ..checks import POINTS, RATIO, checked, of
from ..content import Content
from ..flow.trajectory import Events
from ..motion import Motion
from ..notebook import Notebook
from ..system import System


class Orbit(Content, Notebook, Motion):
    """A periodic motion of a system: a sequence of events (`PeriodicOrbit`) or a Fourier series (`HarmonicOrbit`).

    Attributes
    ----------
    system : System
    how : dict
        How it was found, and what limits it.
    success : bool
    message : str
    periods : int
        Number of forcing periods after which the motion repeats.
    """

    _panels = (1, 2)
    periodic = True

    system: System
    how: dict

    @property
    def parameters(self) -> dict:
        """Parameters of the system."""
        return self.system.parameters

    @property
    def sections(self) -> np.ndarray:
        """States (periods, ns) at phase 0, one a forcing period; of an autonomous orbit the one at time 0."""
        return self.sample(self.periods + 1)[1][:-1]

    def past(self, t0: float, delay: float):
        """See `Motion.past`; the orbit has gone on for ever, with phase 0 at time 0."""
        first = math.floor((t0 - delay) / self.period) * self.period
        times = [first + k * self.period + event.time for k in range(math.ceil(delay / self.period) + 2) for event in self.events]
        return self._states_at, [t for t in times if t0 - delay < t < t0]

    def _states_at(self, t: np.ndarray) -> np.ndarray:
        return self._states(t / self.forcing_period)

    def _on_boundary(self) -> "Orbit":
        """Return the orbit as one that lies where its sequence of events changes, of which a branch tells."""
        raise NotImplementedError

    @checked(n=of(POINTS, least=2))
    def sample(self, n: int = 400) -> tuple[np.ndarray, np.ndarray]:
        """Return times ``t`` (n,) from 0 over one period, both ends included, and states ``y`` (n, ns)."""
        return self._sampled(n)

    @checked(h=RATIO)
    def harmonic(self, h: float, dof: int = 0) -> complex:
        """Return a - ib of a cos(h omega t) + b sin(h omega t) in a coordinate; h = 0 gives the mean.

        ``h`` counts forcing frequencies (of an autonomous orbit: its own); h times ``periods`` must be whole (1/2 for a
        period-2 orbit).  Harmonics that a balance leaves out are 0.
        """
        if not abs(h * self.periods - round(h * self.periods)) < 1e-9:
            raise ValueError(f"harmonic: h = {h!r} is not allowed; h times {self.periods} periods must be a whole number")
        return self._phasor(h, self._coordinate(dof))

    @checked()
    def save(self, path) -> None:
        """Write the orbit to an npz file."""
        io.write(path, *self.to_record())

    def plot(self, axes=None, names=None):
        """Draw phase plane and time history; return the axes. ``names`` gives labels: ``{"q0": "x (mm)"}``."""
        return plotting.plot_orbit(self, axes, names=names)

    def animate(self, path=None, **options):
        """Return the motion as a matplotlib animation, written to a ``.gif`` when a path is given; see `animate_orbit`."""
        return plotting.animate_orbit(self, path, **options)

    def _coordinate(self, dof: int) -> int:
        """Return the number of a coordinate, checked."""
        if not (isinstance(dof, (int, np.integer)) and 0 <= dof < self.system.measured):
            raise ValueError(f"dof = {dof!r} is not allowed; it must be 0 .. {self.system.measured - 1}")
        return int(dof)

    # what every kind of orbit brings

    @property
    def periods(self) -> int:
        """Number of forcing periods after which the motion repeats."""
        raise NotImplementedError

    @property
    def period(self) -> float:
        """Period, time."""
        raise NotImplementedError

    @property
    def forcing_period(self) -> float:
        """Period of the excitation, time; the unit of time of an autonomous orbit."""
        raise NotImplementedError

    @property
    def events(self) -> Events:
        """Events of one period in the order of time."""
        raise NotImplementedError

    @property
    def state(self) -> np.ndarray:
        """State (ns,) at phase 0."""
        raise NotImplementedError

    @property
    def success(self) -> bool:
        """Whether it is a motion of the system."""
        raise NotImplementedError

    @property
    def message(self) -> str:
        """What became of the search, in a sentence."""
        raise NotImplementedError

    def to_record(self) -> tuple[dict, dict]:
        """Return header and arrays for `bifurc.io`."""
        raise NotImplementedError

    def _states(self, tau) -> np.ndarray:
        """Return the states (k, ns) at times (k,) in forcing periods."""
        raise NotImplementedError

    def _sampled(self, n: int) -> tuple[np.ndarray, np.ndarray]:
        raise NotImplementedError

    def _phasor(self, h: float, dof: int) -> complex:
        raise NotImplementedError

