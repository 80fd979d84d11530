"""What `feedback_range` gives: intervals of the gain, their ends, the best gain, and a status with a sentence."""
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from .. import plotting
from ..checks import checked
from ..content import Content
from ..enumerations import DescribedEnum
from ..orbits.orbit import PeriodicOrbit


class EndKind(StrEnum):
    """How stability ends at a gain."""

    PERIOD_DOUBLING = "period_doubling"
    NEIMARK_SACKER = "neimark_sacker"
    OTHER = "other"


class FeedbackStatus(DescribedEnum):
    """What was found about the gains."""

    FOUND = "found", "The orbit is stable for the gains in `intervals`."
    EVERYWHERE = "everywhere", "The orbit is stable for all gains within the bounds; wider bounds may show an end."
    NEVER_STABLE = ("never_stable", "No gain within the bounds makes the orbit stable. Try wider bounds, the other "
                                    "quantity, another row, or memory (extended feedback).")
    ODD_NUMBER = ("odd_number", "The orbit has an odd number of real multipliers above 1: no delayed feedback of this "
                                "kind can make it stable (Nakajima 1997). Use ogy, which has no such limit.")
    DISPUTED = ("disputed", "Two methods disagree about the number of unstable multipliers inside an interval: do not "
                            "rely on it; try narrower bounds.")


@dataclass(frozen=True, eq=False)
class FeedbackEnd(Content):
    """Where an interval of stabilising gains ends.

    Attributes
    ----------
    gain : float
    kind : EndKind
    multiplier : complex
        On the unit circle; NaN where the return map has none.
    error : float
        Last correction of the gain, or width of the bracket.
    pattern : tuple, optional
        Signs of the shifts of the impacts in two successive periods, where the return map is not differentiable.
    """

    gain: float
    kind: EndKind
    multiplier: complex
    error: float
    pattern: tuple[tuple[int, ...], tuple[int, ...]] | None = None


@dataclass(frozen=True, eq=False)
class FeedbackRange(Content):
    """Gains of a delayed feedback that make an orbit stable.

    Attributes
    ----------
    orbit : PeriodicOrbit
    of : str
        "displacement" or "velocity".
    bounds : tuple of float
        Of the gain.
    memory : float
        R of the extended feedback.
    intervals : tuple of (low, high)
        Gains for which the orbit is stable.
    ends : tuple of FeedbackEnd
        Ends within the bounds, in order.
    best_gain, best_modulus : float or None
        Gain with the fastest decay, and the largest modulus of a multiplier (growth per period) there.
    status : FeedbackStatus
    gains, moduli : ndarray (k,)
        What was looked at: gains and largest moduli.
    """

    orbit: PeriodicOrbit = field(repr=False)
    of: str
    bounds: tuple[float, float]
    memory: float
    intervals: tuple[tuple[float, float], ...]
    ends: tuple[FeedbackEnd, ...] = field(repr=False)
    best_gain: float | None
    best_modulus: float | None
    status: FeedbackStatus
    gains: np.ndarray = field(repr=False)
    moduli: np.ndarray = field(repr=False)

    @property
    def success(self) -> bool:
        """Whether some gain makes the orbit stable."""
        return self.status in (FeedbackStatus.FOUND, FeedbackStatus.EVERYWHERE)

    @property
    def message(self) -> str:
        """The status as a sentence."""
        return self.status.sentence

    @checked()
    def plot(self, ax=None):
        """Draw the largest modulus over the gain, with the stable intervals; return the axes."""
        return plotting.plot_feedback(self, ax)
