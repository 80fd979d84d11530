"""Kinds of special points, reasons to stop, states of the corrector: enumerations whose members have sentences."""
from dataclasses import dataclass
from enum import StrEnum

from ..content import Content
from ..enumerations import DescribedEnum

# what the formulas of a problem or of a user's function may raise; time limits, interruptions and lack of memory are passed on
ERRORS = (ArithmeticError, AssertionError, AttributeError, LookupError, NameError, RuntimeError, TypeError, ValueError)
PASSED_ON = (TimeoutError, MemoryError)
NUMERICAL = (ArithmeticError, RuntimeError, ValueError)  # what formulas may raise that are right


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
    GRAZING_SLIDING = "grazing_sliding"
    CROSSING_SLIDING = "crossing_sliding"
    SWITCHING_SLIDING = "switching_sliding"
    ADDING_SLIDING = "adding_sliding"
    BORDER_COLLISION = "border_collision"
    CYCLE_END = "cycle_end"
    HOPF = "hopf"
    BOUNDARY_EQUILIBRIUM = "boundary_equilibrium"
    PEAK = "peak"
    EXTREMUM = "extremum"
    CUSP = "cusp"
    GENERALIZED_FLIP = "generalized_flip"
    FOLD_FLIP = "fold_flip"
    RESONANCE_1_1 = "resonance_1_1"
    RESONANCE_1_2 = "resonance_1_2"
    RESONANCE_1_3 = "resonance_1_3"
    RESONANCE_1_4 = "resonance_1_4"
    RESONANT_GRAZING = "resonant_grazing"
    DOUBLE_GRAZING = "double_grazing"
    DEGENERATE_GRAZING = "degenerate_grazing"
    INTERNAL_RESONANCE = "internal_resonance"
    USER = "user"


# kinds of points where an event is touched, born or dies: the equations of one event sequence end there
BOUNDARIES = (SpecialPointKind.GRAZING, SpecialPointKind.STICK_ONSET, SpecialPointKind.SLIP_ONSET, SpecialPointKind.SEPARATION,
              SpecialPointKind.CHATTER_COMPLETION, SpecialPointKind.GRAZING_SLIDING, SpecialPointKind.CROSSING_SLIDING,
              SpecialPointKind.SWITCHING_SLIDING, SpecialPointKind.ADDING_SLIDING, SpecialPointKind.BORDER_COLLISION,
              SpecialPointKind.CYCLE_END, SpecialPointKind.BOUNDARY_EQUILIBRIUM)


class LocationStatus(DescribedEnum):
    """How well a special point is known."""

    LOCATED = "located", "The point is enclosed by a sign change and polished to rounding level; `error` bounds it."
    GUESS = ("guess", "The sign changes here but the point is degenerate and was only enclosed, not polished: `error` "
                      "is the width of the bracket. Look at the branch with a smaller ds_max.")
    UNRESOLVED_PAIR = ("unresolved_pair", "Two points lie so close together that they cannot be told from none; vary "
                                          "a second parameter to separate them.")


class CorrectorStatus(StrEnum):
    """How one correction ended."""

    CONVERGED = "converged"
    NOT_CONVERGED = "not_converged"
    NOT_FINITE = "not_finite"
    SINGULAR = "singular"
    INADMISSIBLE = "inadmissible"


class StopReason(DescribedEnum):
    """Why a half of a branch ended; ``sentence`` says what to try."""

    BOUND = "bound", "The branch reached the bound of the parameter; extend(bounds=...) goes on."
    CLOSED = "closed", "The branch came back to its first point: it is a closed loop and is listed once."
    MAX_STEPS = "max_steps", "max_steps points were computed; extend(max_steps=...) goes on from here."
    STOPPED = "stopped", "The stop function returned true."
    INTERRUPTED = ("interrupted", "The trace was interrupted from the keyboard; the points so far are kept and "
                                  "extend() goes on.")
    DS_MIN = ("ds_min", "The corrector failed, turned too much or jumped at every step down to ds_min; the branch may "
                        "end, or have a corner here. Try a smaller ds_min, other scales, or look at the last solution.")
    NOT_FINITE = ("not_finite", "The residual or its Jacobian is NaN or infinite at every step down to ds_min; the "
                                "branch reaches the edge of where the problem is defined. Set a bound before it.")
    SINGULAR = ("singular", "The Jacobian has lost more than one rank and no single branch direction exists; perturb "
                            "the start or a second parameter.")
    EXCEPTION = ("exception", "The problem's own code raised at every step down to ds_min, or where no shorter step avoids it; the "
                              "points before are kept, and the message names the exception.")
    CALLBACK_FAILED = ("callback_failed", "A function of the caller (stop=, record=, progress= or one of monitors=) raised, or "
                                          "returned what it must not; the message names it. The points so far are kept: mend the "
                                          "function, and extend(...) goes on.")
    NO_SUCCESSOR = ("no_successor", "The branch crossed the end of validity of its equations and no successor problem "
                                    "was offered, or the successor could not be started.")
    CYCLE_END = ("cycle_end", "The orbit ends here: the motion that leads into the stick reaches the speed of the "
                              "surface only just, and beyond this point not at all, though the stick still has a "
                              "positive duration. No multiplier tends to 1, no other orbit meets this one, and none "
                              "goes on.")
    HOPF = ("hopf", "The orbit has shrunk onto an equilibrium, in a Hopf point: trace(find_equilibrium(...)) shows "
                    "the branch of that.")
    SHRUNK = ("shrunk", "The orbit has shrunk onto a state of rest that just touches a contact (a boundary equilibrium): its size "
                        "falls to nothing in proportion to the distance from here, its period and its multipliers do not "
                        "change. find_equilibrium gives the state of rest, and trace the branch of that.")
    AT_REST = ("at_rest", "The free vibration has shrunk onto a state of rest: no motion of this family has less energy. "
                          "find_equilibrium gives that state.")
    HOMOCLINIC = ("homoclinic", "The period grows without bound: the motion spends ever more of it next to an unstable state of "
                                "rest, and here no longer comes back from there (a homoclinic orbit, or a heteroclinic one that "
                                "joins several). find_equilibrium gives that state of rest.")
    INADMISSIBLE = "inadmissible", "The solutions beyond this point are not admissible and no monitor tells why."
    NOT_STARTED = "not_started", "This direction was not asked for."
    MERGED = ("merged", "The motions of multiplied period become those of their parent here: the branch ends on it at "
                        "its period doubling or grazing; switch_branch gives the parent's other side.")
    CHATTERING = ("chattering", "A complete chattering sequence no longer ends before its contact is released; "
                                "beyond, the number of impacts grows without bound toward this point, and no single "
                                "event sequence goes on.")
    JUMP = ("jump", "However near to this point, motions beyond it depart from the periodic motion by a finite "
                    "amount: the system is not continuous here (static friction above kinetic, impacts of several "
                    "masses at one instant), and the branch ends.")
    STICKING = ("sticking", "One way from here a contact slips, or its mass moves elsewhere, as where a stop comes to where "
                            "it stands or moves it against a slider; the other way it sticks all the time, anywhere in an "
                            "interval of positions. Here a slip has one direction only and lasts for nothing, and no single "
                            "motion goes on. find_orbit from a state at rest gives one of them.")


class CallbackError(ValueError):
    """A function of the caller failed; the text names it and what it did."""


class ContinuationError(ValueError):
    """A branch cannot be started; the text names the reason and what to try."""


@dataclass(frozen=True, eq=False)
class End(Content):
    """How one half ended: reason, details, parameter there, next step length, rejected steps."""

    reason: StopReason
    message: str
    p: float
    ds: float
    rejected: int

    def __repr__(self) -> str:
        return f"{self.reason.value} at {self.p:.10g}" + (f" ({self.message})" if self.message else "")

    @property
    def sentence(self) -> str:
        """What happened, and what to try."""
        return self.reason.sentence + (f" [{self.message}]" if self.message else "")
