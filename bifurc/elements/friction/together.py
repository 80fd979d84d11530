"""Dry frictions on one row: at rest they are one set-valued force, whose limits are the sums of theirs.

How the contacts share the reaction of a mass at rest is not unique, the motion is: it moves off where all of them are at their
limits (Moreau 1988: a sum of normal cones on one speed is the cone of the sum).  The first of them, the leader, holds the row and
has the events; the others have its key, and their forces of slip.
"""
import dataclasses
import math
from collections.abc import Hashable
from functools import reduce
from operator import add

import numpy as np

from ..kinds import EventKind
from ..local import affine
from ..mode import Guard, Mode
from ..site import Rows
from .joint import Joint

LAM = ("lam", 0)
ROUNDING = 4.0 * np.finfo(float).eps  # of a product, beside a number that was given for it


def leaders(elements, n: int) -> tuple[tuple[int, float], ...]:
    """Return for each element the first one that rests together with it, itself where there is none before, and how many times
    the speed of that one its own speed is: 1 on the same row, negative where the rows of the two run opposite ways.

    Raises
    ------
    ValueError
        Where two whose force drops as they begin to slip are on one row, and one of them separates.
    """
    found: list[tuple[int, float]] = []
    sites = {e: element.site(n) for e, element in enumerate(elements) if element.rests_together or element.drops}
    for e, element in enumerate(elements):
        own = (e, 1.0)
        for k in range(e if e in sites else 0):
            if k not in sites or found[k][0] != k or (ratio := times(sites[k], sites[e])) == 0.0:
                continue
            if element.rests_together and elements[k].rests_together:
                own = k, ratio
                break
            if element.drops and elements[k].drops:
                raise ValueError(f"elements {k} and {e} ({type(elements[k]).__name__}, {type(element).__name__}) are on one row "
                                 "with static friction above that of slip, and one separates while its load is not positive: what "
                                 "they hold together is not followed. Give both a load_amplitude below 1, or one static_ratio=1")
        found.append(own)
    return tuple(found)


def times(one: Rows, other: Rows) -> float:
    """Return how many times the speed of one site that of the other always is; 0: they are not on one row."""
    if type(one) is not Rows or type(other) is not Rows or one.base or other.base or len(one.R) != 1 or len(other.R) != 1:
        return 0.0
    speeds, others = (np.array([*site.R[0], *(site.drift or (0.0,))]) for site in (one, other))
    place = int(np.abs(speeds[:-1]).argmax())
    ratio = float(others[place] / speeds[place])
    rounds = 0.0 if math.frexp(abs(ratio))[0] == 0.5 else ROUNDING  # products with powers of two are exact
    return ratio if (np.abs(others - ratio * speeds) <= rounds * np.abs(others)).all() else 0.0


def key_of(elements, together, element: int, key: Hashable) -> dict[int, Hashable]:
    """Return the keys of all elements that change with that of one of them."""
    if isinstance(key, Joint):
        return {other: own for e, changed in key.changes for other, own in key_of(elements, together, e, changed).items()}
    leader, sign = together[element]
    lead = key if sign > 0 else elements[element].mirrored_key(key)
    return {e: lead if way > 0 else elements[e].mirrored_key(lead) for e, (first, way) in enumerate(together) if first == leader}


def includes(together, others) -> bool:
    """Whether all contacts that rest together by ``others`` do so by ``together`` too, with rows that run the same ways."""
    return all(together[e][0] == together[leader][0] and together[e][1] * way * together[leader][1] > 0.0
               for e, (leader, way) in enumerate(others))


def mode_of(system, together, element: int, key: Hashable, core) -> Mode:
    """Return the mode of an element of a system, beside the others that rest ``together`` with it, see `leaders`."""
    own, (leader, _) = system.elements[element].mode(key, core), together[element]
    if leader != element:
        return dataclasses.replace(own, hold=(), guards=(), bounds=())
    others = [(e, way) for e, (first, way) in enumerate(together) if first == element != e]
    if not others:
        return own
    own = dataclasses.replace(own, guards=tuple(guard for guard in own.guards if guard.kind != EventKind.SEPARATION))
    if not own.hold:
        return own
    limits = [system.elements[e].mode(key, core).bounds[0] for e, _ in others]
    limits = [(way * pair[way < 0], way * pair[way > 0]) for pair, (_, way) in zip(limits, others, strict=True)]
    least, most = (reduce(add, side) for side in zip(*limits, strict=True))
    return dataclasses.replace(own, bounds=((own.bounds[0][0] + least, own.bounds[0][1] + most),),
                               guards=tuple(beside(guard, least, most) for guard in own.guards))


def beside(guard: Guard, least, most) -> Guard:
    """Return a limit of stick with those of the other contacts: the reaction may be that much larger."""
    weight = affine(guard.value).terms.get(LAM, 0.0)
    return dataclasses.replace(guard, value=guard.value - abs(weight) * most if weight > 0.0 else guard.value + abs(weight) * least)
