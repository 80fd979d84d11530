"""What follows a grazing bifurcation: an enumeration with a sentence a member (Nordmark 1991; Chin, Ott, Nusse, Grebogi 1994)."""
from ...enumerations import DescribedEnum


class GrazingVerdict(DescribedEnum):
    """What a motion does beyond the parameter at which a periodic orbit touches a stop."""

    PERIOD_ADDING = ("period_adding", "A small attractor with one impact in n periods is born; towards the grazing n "
                                      "grows by one from window to window, and neighbouring windows overlap (leading "
                                      "multiplier below 1/4, all s_k > 0).")
    WINDOWS_AND_CHAOS = ("windows_and_chaos", "A small attractor is born: windows of one impact in n periods "
                                              "alternate with bands of chaos, both accumulate at the grazing (leading "
                                              "multiplier between 1/4 and 2/3, all s_k > 0).")
    IMMEDIATE_CHAOS = ("immediate_chaos", "A small chaotic attractor is born at once; its size grows from zero with "
                                          "the parameter (leading multiplier above 2/3, all s_k > 0).")
    JUMP = ("jump", "No attractor stays near: the first impact throws the motion back beyond the stop (some s_k < 0), "
                    "and it settles on another, distant motion.")
    PERSISTENCE = ("persistence", "The orbit goes on with a short contact and keeps its stability; it departs from "
                                  "the straight line that the motion without contact follows by a term of order 3/2.")
    UNSTABLE = "unstable", "The touching orbit is itself unstable, so that no motion stays near it on either side."
    DEGENERATE = ("degenerate", "A condition of the classification fails here, a point of higher codimension: vary a "
                                "second parameter.")

    @property
    def small(self) -> bool | None:
        """Whether an attractor stays near the touching orbit; None where this is not told."""
        return {"jump": False, "unstable": None, "degenerate": None}.get(self.value, True)
