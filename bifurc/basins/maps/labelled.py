"""What every map of labelled starts gives a picture."""
from typing import Any

import numpy as np

from ...checks import checked, is_real, scalar, shown
from ..attractors.attractors import section_points

NONE = "-1 marks starts that led to no attractor"


class LabelledStarts:
    """Starts over two or more components of the state, with the attractor that each leads to.

    Attributes
    ----------
    section : Section or None
        Where the states of a system without excitation are seen; None: at phase 0.
    label_uncertainty : float or None
        Predicted fraction of labels that errors could change.
    reliability : Reliability or None
        How far its labels can be relied on.
    """

    attractors: tuple
    section: Any = None
    label_uncertainty: Any = None
    reliability: Any = None

    def points(self, label: int) -> np.ndarray:
        """Return the states (k, ns) of an attractor at phase 0, or in the section.

        Raises
        ------
        ValueError
            For a label that is no attractor's: -1 marks starts that led to none.
        """
        return section_points(self.attractors[numbered("label", label, len(self.attractors), NONE)], self.section)

    @checked()
    def entropy(self, side: int = 5) -> Any:
        """Return basin and boundary entropy over boxes of ``side`` cells; None: not known."""
        return None


def numbered(name: str, number: Any, count: int, none: str) -> int:
    """Return a number that stands for one of ``count`` things, checked; ``none`` says what -1 stands for.

    Raises
    ------
    ValueError
    """
    given = scalar(number)
    if not is_real(given) or not isinstance(given, int | np.integer) or not 0 <= given < count:
        there = f"it must be 0 .. {count - 1}" if count else "there is none"
        raise ValueError(f"{name} = {shown(number)} is not allowed; {there} ({none})")
    return int(given)
