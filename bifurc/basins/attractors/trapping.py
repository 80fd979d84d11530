"""Boxes that the map over a forcing period carries into themselves: where a start that is in one stays for good.

A chaotic attractor is sampled, never known.  A union of boxes around the sample that holds the images of all its boxes is
as good as a point attractor: one section point in it decides.  The union is found by carrying STARTS starts of every box,
corners and edges included, and adding the boxes they reach until none is new.  That is evidence of a dense grid of
starts, not a proof by interval arithmetic; between the starts an image can leave by a fraction of the distance of the
images of neighbours, which is why boxes are added that images come close to.
"""
import numpy as np

from ...ensemble.outcomes import REACHED

SIDE = 5  # starts along each side of a box
MARGIN = 0.05  # of a box: an image so close to a face counts for both sides
GROWTH = 4.0  # times the boxes of the sample: a union that grows beyond has left the attractor's neighbourhood
MOST_BOXES = 60000
SETTLING, LOOKED = 200, 4  # forcing periods after which, and for which, starts of a union must lie on the sample
STRIDE = 2**32  # numbers of boxes along the second state
FARTHEST = 2**30  # boxes from the origin: what lies farther counts as there
FINER = 2  # times smaller than those that the sample fills are the boxes tried first; then they are doubled


def trapping(carrier, points: np.ndarray, scale: np.ndarray, width: float) -> tuple[np.ndarray, float] | None:
    """Return centres (K, 2) of boxes that are carried into themselves and hold the points, and their width; or None.

    Parameters
    ----------
    carrier : Integrator
        Of a scene with two states.
    points : ndarray
        Section points (k, 2) of a motion that has settled.
    scale : ndarray
        Sizes (2,) of the states.
    width : float
        Side of boxes that the sample fills, in units of ``scale``.
    """
    tried = width / FINER
    while tried <= width:
        found = _closed(carrier, points, scale, tried)
        if found is not None:
            return (found + 0.5) * tried * scale, tried
        tried *= 2.0
    return None


def _closed(carrier, points: np.ndarray, scale: np.ndarray, width: float) -> np.ndarray | None:
    """Return the places (K, 2) of a closed union of boxes, or None when it grows too far."""
    known = np.unique(_numbers(np.floor(points / scale / width)))
    most = min(int(GROWTH * len(known)) + 64, MOST_BOXES)
    new = known
    side = np.linspace(0.0, 1.0, SIDE)
    grid = np.stack(np.meshgrid(side, side, indexing="ij"), axis=-1).reshape(-1, 2)
    shifts = np.array([(a, b) for a in (-MARGIN, MARGIN) for b in (-MARGIN, MARGIN)])
    while len(new):
        if len(known) > most:
            return None
        starts = ((_places(new)[:, None, :] + grid) * width * scale).reshape(-1, 2)
        images = carrier.propagate(starts, 1)
        if np.any(images.outcomes != REACHED):
            return None
        ends = images.ends / scale / width
        new = np.setdiff1d(np.concatenate([_numbers(np.floor(ends + shift)) for shift in shifts]), known)
        known = np.union1d(known, new)
    places = _places(known)
    return places if _one(carrier, places, points, scale, width) else None


def _numbers(places: np.ndarray) -> np.ndarray:
    """Return one whole number a place (k, 2), in the order of the places: far quicker to sort than rows."""
    return np.clip(places, -FARTHEST, FARTHEST).astype(np.int64) @ np.array([STRIDE, 1])


def _places(numbers: np.ndarray) -> np.ndarray:
    """Return the places (k, 2) of `_numbers`."""
    first = (numbers + STRIDE // 2) // STRIDE
    return np.stack((first, numbers - first * STRIDE), axis=1)


def _one(carrier, boxes: np.ndarray, points: np.ndarray, scale: np.ndarray, width: float) -> bool:
    """Return whether starts from all boxes (K, 2) settle on the sample: a union that reaches over a boundary of basins grows
    around the other attractor too, and is closed all the same."""
    side = np.arange(-1, 2)
    around = np.stack(np.meshgrid(side, side, indexing="ij"), axis=-1).reshape(-1, 2)
    home = np.unique(_numbers((np.floor(points / scale / width)[:, None] + around).reshape(-1, 2)))
    images = carrier.propagate((boxes + 0.5) * width * scale, SETTLING)
    for _ in range(LOOKED):
        if np.any(images.outcomes != REACHED):
            return False
        if not np.isin(_numbers(np.floor(images.ends / scale / width)), home).all():
            return False
        images = carrier.propagate(images.ends, 1)
    return True


def touches(centres: np.ndarray, width: float, scale: np.ndarray, points: np.ndarray) -> bool:
    """Return whether any of the ``points`` (k, 2) lies in the boxes."""
    boxes, reached = (_numbers(np.floor(states / scale / width)) for states in (centres, points))
    return bool(np.isin(reached, boxes).any())
