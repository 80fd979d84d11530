"""States of an orbit: an enumeration whose members are also sentences."""
from ..enumerations import DescribedEnum


class OrbitStatus(DescribedEnum):
    """How an orbit is to be taken."""

    CONVERGED = "converged", "The orbit closes to rounding and every segment was audited."
    ON_BOUNDARY = ("on_boundary", "The orbit closes to rounding and lies on a boundary of its event sequence, where an event has "
                                  "no speed or no duration, or is only just touched: a motion, whose multipliers are those of one "
                                  "side. Look at orbits a little to either side for its stability.")
    INADMISSIBLE = ("inadmissible", "The equations of this event sequence are solved, but a segment passes through a "
                                    "surface or an event has negative speed: it is no motion of the system. Simulate "
                                    "from its state for a new sequence.")
    NOT_CONVERGED = ("not_converged", "Newton did not converge from this guess. Give a guess closer to the orbit, "
                                      "another number of periods, or let guess=None simulate.")
    NOT_FOUND = ("not_found", "The simulated motion did not settle on a periodic orbit within the limit; it may be "
                              "chaotic, quasi-periodic or slow. Raise transient or periods, or look at "
                              "lyapunov_exponents.")
    NOT_SYMMETRIC = ("not_symmetric", "The orbit found lacks the symmetry y(t + period/2) = -y(t) that closure = -1 "
                                      "asks for. Give a guess near a symmetric orbit.")
    AT_REST = ("at_rest", "The motion of this system, which has no excitation, comes to rest: find_equilibrium gives "
                          "the state. An orbit that coexists needs a guess beyond its basin boundary.")
    CONCENTRIC = ("concentric", "No direction is special in this system, so that a motion that rubs part of the time "
                                "has no isolated orbit over whole forcing periods: it is a torus here. In coordinates "
                                "that turn with the spin it is an orbit, and synchronous rub an equilibrium: use "
                                "bifurc.systems.rotating_frame_rotor, or give the system an offset or gravity.")
