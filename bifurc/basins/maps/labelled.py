"""What every map of labelled starts gives a picture."""
from typing import Any

import numpy as np

from ...checks import whole


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
        """Return the states (k, ns) of an attractor at phase 0."""
        return self.attractors[whole("points", "label", label, least=0, most=len(self.attractors) - 1)].sections

    def entropy(self, side: int = 5) -> Any:
        """Return basin and boundary entropy over boxes of ``side`` cells; None: not known."""
        return None
