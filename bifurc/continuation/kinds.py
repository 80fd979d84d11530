"""Kinds of special points, reasons to stop, states of the corrector: enumerations whose members have sentences."""
from enum import StrEnum


class SpecialPointKind(StrEnum):
    """What happens at a special point of a branch."""

    FOLD = "fold"
    PERIOD_DOUBLING = "period_doubling"
    NEIMARK_SACKER = "neimark_sacker"
    BRANCH_POINT = "branch_point"
    GRAZING = "grazing"
    STICK_ONSET = "stick_onset"
    SLIP_ONSET = "slip_onset"
    SEPARATION = "separation"
    CHATTER_COMPLETION = "chatter_completion"
    PEAK = "peak"
    EXTREMUM = "extremum"
    CUSP = "cusp"
    USER = "user"


class LocationStatus(StrEnum):
    """How well a special point is known."""

    LOCATED = "located"
    GUESS = "guess"
    UNRESOLVED_PAIR = "unresolved_pair"

    @property
    def sentence(self) -> str:
        """What the status means, and what to try."""
        return {
            "located": "The point is enclosed by a sign change and polished to rounding level; `error` bounds it.",
            "guess": "The sign changes here but the point is degenerate and was only enclosed, not polished: "
                     "`error` is the width of the bracket. Look at the branch with a smaller ds_max.",
            "unresolved_pair": "Two points lie so close together that they cannot be told from none; "
                               "vary a second parameter to separate them.",
        }[self.value]


class CorrectorStatus(StrEnum):
    """How one correction ended."""

    CONVERGED = "converged"
    NOT_CONVERGED = "not_converged"
    NOT_FINITE = "not_finite"
    SINGULAR = "singular"
    INADMISSIBLE = "inadmissible"


class StopReason(StrEnum):
    """Why a half of a branch ended; ``sentence`` says what to try."""

    BOUND = "bound"
    CLOSED = "closed"
    MAX_STEPS = "max_steps"
    STOPPED = "stopped"
    INTERRUPTED = "interrupted"
    DS_MIN = "ds_min"
    NOT_FINITE = "not_finite"
    SINGULAR = "singular"
    EXCEPTION = "exception"
    NO_SUCCESSOR = "no_successor"
    INADMISSIBLE = "inadmissible"
    NOT_STARTED = "not_started"

    @property
    def sentence(self) -> str:
        """What happened, and what to try."""
        return _SENTENCES[self.value]


_SENTENCES = {
    "bound": "The branch reached the bound of the parameter; extend(bounds=...) goes on.",
    "closed": "The branch came back to its first point: it is a closed loop and is listed once.",
    "max_steps": "max_steps points were computed; extend(max_steps=...) goes on from here.",
    "stopped": "The stop function returned true.",
    "interrupted": "The trace was interrupted from the keyboard; the points so far are kept and extend() goes on.",
    "ds_min": "The corrector failed, turned too much or jumped at every step down to ds_min; the branch may end, or "
              "have a corner here. Try a smaller ds_min, other scales, or look at the last solution.",
    "not_finite": "The residual or its Jacobian is NaN or infinite at every step down to ds_min; the branch reaches "
                  "the edge of where the problem is defined. Set a bound before it.",
    "singular": "The Jacobian has lost more than one rank and no single branch direction exists; perturb the start or "
                "a second parameter.",
    "exception": "The problem's own code raised at every step down to ds_min; the message names the exception.",
    "no_successor": "The branch crossed the end of validity of its equations and no successor problem was offered, or "
                    "the successor could not be started.",
    "inadmissible": "The solutions beyond this point are not admissible and no monitor tells why.",
    "not_started": "This direction was not asked for.",
}


class ContinuationError(ValueError):
    """A branch cannot be started; the text names the reason and what to try."""
