"""States of an orbit: an enumeration whose members are also sentences."""
from enum import StrEnum


class OrbitStatus(StrEnum):
    """How an orbit is to be taken."""

    CONVERGED = "converged"
    INADMISSIBLE = "inadmissible"
    NOT_CONVERGED = "not_converged"
    NOT_FOUND = "not_found"
    NOT_SYMMETRIC = "not_symmetric"

    @property
    def sentence(self) -> str:
        """What the status means, and what to try."""
        return {
            "converged": "The orbit closes to rounding and every segment was audited.",
            "inadmissible": "The equations of this event sequence are solved, but a segment passes through a surface or an event "
                            "has negative speed: it is no motion of the system. Simulate from its state for a new sequence.",
            "not_converged": "Newton did not converge from this guess. Give a guess closer to the orbit, another number of "
                             "periods, or let guess=None simulate.",
            "not_symmetric": "The orbit found lacks the symmetry y(t + period/2) = -y(t) that closure = -1 asks for. Give a guess "
                             "near a symmetric orbit.",
            "not_found": "The simulated motion did not settle on a periodic orbit within the limit; it may be chaotic, quasi-"
                         "periodic or slow. Raise transient or periods, or look at lyapunov_exponents.",
        }[self.value]
