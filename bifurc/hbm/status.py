"""States of a balance: enumerations whose members are also sentences."""
from ..enumerations import DescribedEnum
from ..lazy import deprecated


class ContactStatus(DescribedEnum):
    """How the modes of the contacts along a given periodic motion were found; the position is the code of the kernels."""

    FOLLOWED = "followed", "Modes and memory of every contact repeat after the period."
    INCONSISTENT = ("inconsistent", "No mode of a contact may follow an event: its guards forbid all of them. Check "
                                    "the element's guards.")
    TOO_MANY = ("too_many", "A contact changes its mode more often than the limit; the motion is rougher than its "
                            "harmonics say. Give a closer guess, or fewer harmonics.")
    NOT_SETTLED = "not_settled", "The memory of a contact does not repeat after several periods of the motion."
    NOT_FINITE = "not_finite", "The coefficients of the motion are NaN or infinite."


class BalanceStatus(DescribedEnum):
    """How a harmonic orbit is to be taken."""

    CONVERGED = ("converged", "The residual in the kept harmonics is at rounding level; the balance is an "
                              "approximation, and how['error'] estimates its distance from the motion.")
    ON_BOUNDARY = ("on_boundary", "The residual in the kept harmonics is at rounding level, and the order of events of a contact "
                                  "changes just here: an event has no duration or is only just touched. Multipliers are those of "
                                  "one side; look at balances a little to either side for stability.")
    NOT_CONVERGED = ("not_converged", "Newton did not converge from this guess. Give a guess closer to the motion, "
                                      "trace a branch from easier parameters, or try solver='broyden'.")
    SINGULAR = ("singular", "The Jacobian is singular on the way (undamped resonance, or a free coordinate); add "
                            "damping, or start elsewhere.")
    CONTACTS_FAILED = ("contacts_failed", "The contacts could not be followed along the motion that the iteration reached; "
                                    "give a closer guess.")
    FALSE_CONVERGENCE = ("false_convergence", "The iteration stopped because its increment was small, but the "
                                              "residual is not: this is no solution. Use a solver that stops on the "
                                              "residual ('newton' or 'broyden').")
    AT_REST = ("at_rest", "The load stays below the friction limit: the mass rests, anywhere in the interval that "
                          "how['interval'] gives.")

    @classmethod
    def _missing_(cls, value):
        """Take the old value of `CONTACTS_FAILED`."""
        if value != "march_failed":
            return None
        deprecated("'march_failed'", "'contacts_failed'")
        return cls.CONTACTS_FAILED
