"""Label reliability of a basin map: how many labels its errors may change, and the errors of the fractions."""
from typing import Any, NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter

from ...ensemble.outcomes import DIVERGED
from ...enumerations import DescribedEnum
from ...lazy import renamed
from .label_noise import ROUNDING

FEW = 1e-3  # expected share of wrong labels up to which single cells are spoken of
MANY = 0.01  # share of starts without a label above which that comes first


class ReliabilityKind(DescribedEnum):
    """How far the labels of a basin map can be relied on."""

    CELLS = "cells", "Every label can be trusted: the error of the computed motion is expected to change none."
    MOST_CELLS = "most_cells", "Labels can be trusted but for a few beside boundaries."
    FRACTIONS = ("fractions", "No single label is promised: the boundary is so intricate that errors of the computed "
                              "motion decide; the fractions hold.")
    UNRESOLVED = ("unresolved", "Many starts have no label: where they lead is unknown, and fractions of basins are "
                                "lower bounds; raise max_periods or max_events, or look at the states of the cells.")
    NO_STARTS = "no_starts", "No cell of the grid is a start: all lie beyond a stop; there is nothing to trust."


class Reliability(NamedTuple):
    """How far the labels of a basin map can be relied on, with numbers."""

    kind: ReliabilityKind
    wrong: float  # expected number of labels that errors of the computed motion change
    cells: int  # that are starts
    exponent: float  # uncertainty exponent
    size: float  # scaled error of a forcing period
    fractions: dict  # label -> (fraction, standard error)
    unresolved: int = 0  # cells without a label, though they are starts

    @property
    def statement(self) -> str:
        """Two sentences for a report or a caption."""
        share = self.wrong / max(self.cells, 1)
        cause = "rounding" if self.size <= ROUNDING else f"an error of {self.size:.0e} a period"
        if self.kind is ReliabilityKind.NO_STARTS:
            return self.kind.sentence
        left = f" {self.unresolved} of {self.cells} starts ({100 * self.unresolved / self.cells:.2g} %) have no label."
        if self.kind is ReliabilityKind.UNRESOLVED:
            first = f"No label is promised.{left} Of the others {cause} is expected to change {self.wrong:.2g}."
        elif self.kind is ReliabilityKind.CELLS and self.unresolved:
            first = f"Every label that is there can be trusted: {cause} is expected to change {self.wrong:.0e} of them.{left}"
        elif self.kind is ReliabilityKind.CELLS:
            first = f"Every label can be trusted: {cause} is expected to change {self.wrong:.0e} of {self.cells}."
        elif self.kind is ReliabilityKind.MOST_CELLS:
            first = (f"Labels can be trusted but for about {max(self.wrong, 1):.0f} of {self.cells} beside boundaries, which "
                     f"{cause} may change.")
        else:
            first = (f"No single label is promised: {cause} alone is expected to change {100 * share:.2g} % of {self.cells} "
                     f"(uncertainty exponent {self.exponent:.2g}).")
        shares = ", ".join(f"{value:.4f} +- {error:.1g}" for label, (value, error) in self.fractions.items() if label != -1)
        if self.unresolved and self.kind in (ReliabilityKind.MOST_CELLS, ReliabilityKind.FRACTIONS):
            first += left
        hold = {ReliabilityKind.FRACTIONS: " hold", ReliabilityKind.UNRESOLVED: ", lower bounds"}.get(self.kind, "")
        return f"{first} Fractions{hold}: {shares or 'none'}."


def reliability(basins: Any) -> Reliability:
    """Return how far the labels of a `BasinMap` can be relied on."""
    cells = int(np.count_nonzero(basins.starts))
    wrong = basins.label_uncertainty * cells
    unresolved = int(np.count_nonzero(basins.starts & (basins.labels < 0) & (basins.states != DIVERGED)))
    if not cells:
        kind = ReliabilityKind.NO_STARTS
    elif unresolved > MANY * cells:
        kind = ReliabilityKind.UNRESOLVED
    else:
        some = ReliabilityKind.MOST_CELLS if wrong <= FEW * cells else ReliabilityKind.FRACTIONS
        kind = ReliabilityKind.CELLS if wrong < 0.5 else some
    errors = fraction_errors(basins.labels, basins.starts)
    return Reliability(kind, float(wrong), cells, basins.noise.exponent, basins.noise.size,
                 {label: (value, errors.get(label, 0.0)) for label, value in basins.fractions.items() if isinstance(label, int)},
                 unresolved)


def fraction_errors(labels: np.ndarray, starts: np.ndarray) -> dict[int, float]:
    """Return the standard error of each label's fraction as a measure of the region.

    A cell whose neighbours have other labels stands for an area of which only a part is its own: a draw with the variance
    p (1 - p), p the share of the label among the cell and its neighbours.  Draws of different cells are taken as independent.

    Parameters
    ----------
    labels : ndarray of int
    starts : ndarray of bool
        Cells that count.
    """
    total = max(int(np.count_nonzero(starts)), 1)
    weight = uniform_filter(starts.astype(float), 3, mode="nearest")
    errors = {}
    for label in np.unique(labels[starts]).tolist():
        share = uniform_filter(((labels == label) & starts).astype(float), 3, mode="nearest")[starts] / weight[starts]
        share = np.clip(share, 0.0, 1.0)
        errors[label] = float(np.sqrt((share * (1.0 - share)).sum()) / total)
    return errors


__getattr__ = renamed(globals(), {"Trust": "Reliability", "TrustKind": "ReliabilityKind", "trust": "reliability"})
