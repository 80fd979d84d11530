"""Basin entropy: how mixed the labels are in small boxes, and on the boundary alone.

A. Daza, A. Wagemakers, B. Georgeot, D. Guery-Odelin, M. A. F. Sanjuan, Scientific Reports 6, 31416 (2016).  Natural logarithm.
"""
from typing import NamedTuple

import numpy as np

FRACTAL = float(np.log(2.0))  # a boundary entropy above it proves a fractal boundary; below it nothing is said


class BasinEntropy(NamedTuple):
    """Entropies of a basin map; dimensionless."""

    basin: float  # mean over boxes
    boundary: float  # mean over boxes that hold more than one label; 0 when there is none
    boxes: int
    mixed: int  # boxes that hold more than one label
    side: int  # of a box, cells

    @property
    def fractal(self) -> bool | None:
        """True where the boundary entropy exceeds ln 2; None: this criterion is silent."""
        return True if self.boundary > FRACTAL else None


def basin_entropy(labels: np.ndarray, side: int = 5, starts: np.ndarray | None = None) -> BasinEntropy:
    """Return the entropies of labels on a grid.

    Parameters
    ----------
    labels : ndarray of int, any shape
        -1 (no attractor) counts as a label of its own.
    side : int
        Of the boxes, in cells; boxes do not overlap, and what is left at the upper ends of the axes is not used.
    starts : ndarray of bool, optional
        Cells that count; boxes without any are left out.

    Returns
    -------
    BasinEntropy

    Raises
    ------
    ValueError
        When a side is no whole number or not one box fits.
    """
    labels = np.asarray(labels)
    if isinstance(side, bool) or not isinstance(side, (int, np.integer)) or side < 1:
        raise ValueError(f"side = {side!r} is not allowed; it must be a whole number of at least 1")
    if min(labels.shape, default=0) < side:
        raise ValueError(f"side = {side} is not allowed for labels of shape {labels.shape}; not one box fits")
    counts = [length // side for length in labels.shape]
    boxes = int(np.prod(counts))

    def boxed(values: np.ndarray) -> np.ndarray:
        values = values[tuple(slice(0, count * side) for count in counts)]
        values = values.reshape([number for count in counts for number in (count, side)])
        axes = [*range(0, 2 * len(counts), 2), *range(1, 2 * len(counts), 2)]
        return values.transpose(axes).reshape(boxes, -1)

    mine = boxed(labels)
    counted = np.ones(mine.shape, bool) if starts is None else boxed(np.asarray(starts, bool))
    total = counted.sum(axis=1)
    entropy, kinds = np.zeros(boxes), np.zeros(boxes, int)
    for label in np.unique(labels):
        share = ((mine == label) & counted).sum(axis=1) / np.maximum(total, 1)
        entropy -= share * np.log(np.where(share > 0, share, 1.0))
        kinds += share > 0
    filled, mixed = int(np.count_nonzero(total)), int(np.count_nonzero(kinds > 1))
    return BasinEntropy(float(entropy.sum() / max(filled, 1)), float(entropy.sum() / max(mixed, 1)), filled, mixed, int(side))
