"""Control of chaos: which feedback holds an unstable orbit, and the motion under it.

`feedback_range` for delayed feedback (Pyragas 1992), `feedback_basins` for how far it reaches, `ogy` for small changes of a
parameter (Ott, Grebogi, Yorke 1990).
"""
from .basins import feedback_basins
from .feedback import controlled_multipliers, feedback_range
from .feedback_map import FeedbackBasins, HeldMotion
from .linearization import NotSupported
from .ogy import ControlStatus, OGYController, ogy
from .ogy_motion import ControlledMotion
from .results import EndKind, FeedbackEnd, FeedbackRange, FeedbackStatus

__all__ = ["ControlStatus", "ControlledMotion", "EndKind", "FeedbackBasins", "FeedbackEnd", "FeedbackRange", "FeedbackStatus",
           "HeldMotion", "NotSupported", "OGYController", "controlled_multipliers", "feedback_basins", "feedback_range", "ogy"]
