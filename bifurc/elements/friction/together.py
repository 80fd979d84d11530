"""Dry frictions on one row: at rest they are one set-valued force, whose limits are the sums of theirs.

How the contacts share the reaction of a mass at rest is not unique, the motion is: it moves off where all of them are at their
limits (Moreau 1988: a sum of normal cones on one speed is the cone of the sum).  The first of them, the leader, holds the row and
has the events; the others have its key, and their forces of slip.
"""
import dataclasses
from collections.abc import Hashable
from functools import reduce
from operator import add

from ..local import affine
from ..mode import Guard, Mode
from ..site import Rows

LAM = ("lam", 0)


def leaders(elements, n: int) -> tuple[tuple[int, int], ...]:
    """Return for each element the first one that rests together with it, itself where there is none before, and 1, or -1 where
    the rows of the two run opposite ways."""
    found: list[tuple[int, int]] = []
    for e, element in enumerate(elements):
        same = ((k, sign) for k in range(e) if element.rests_together and elements[k].rests_together and found[k] == (k, 1)
                for sign in (1, -1) if on_one_row(elements[k].site(n), element.site(n), sign))
        found.append(next(same, (e, 1)))
    return tuple(found)


def on_one_row(one: Rows, other: Rows, sign: int) -> bool:
    """Whether the speed of one site is always ``sign`` times that of the other."""
    if type(one) is not Rows or type(other) is not Rows or one.base or other.base or len(one.R) != 1 or len(other.R) != 1:
        return False
    drifts = [site.drift or (0.0,) for site in (one, other)]
    return bool((one.R == sign * other.R).all()) and drifts[0][0] == sign * drifts[1][0]


def key_of(elements, together, element: int, key: Hashable) -> dict[int, Hashable]:
    """Return the keys of all elements that change with that of one of them."""
    leader, sign = together[element]
    lead = key if sign > 0 else elements[element].mirrored_key(key)
    return {e: lead if way > 0 else elements[e].mirrored_key(lead) for e, (first, way) in enumerate(together) if first == leader}


def includes(together, others) -> bool:
    """Whether all contacts that rest together by ``others`` do so by ``together`` too, with rows that run the same ways."""
    return all(together[e][0] == together[leader][0] and together[e][1] == way * together[leader][1]
               for e, (leader, way) in enumerate(others))


def mode_of(system, together, element: int, key: Hashable, core) -> Mode:
    """Return the mode of an element of a system, beside the others that rest ``together`` with it, see `leaders`."""
    own, (leader, _) = system.elements[element].mode(key, core), together[element]
    if leader != element:
        return dataclasses.replace(own, hold=(), guards=(), bounds=())
    others = [(e, way) for e, (first, way) in enumerate(together) if first == element != e]
    if not others or not own.hold:
        return own
    limits = [system.elements[e].mode(key, core).bounds[0] for e, _ in others]
    limits = [pair if way > 0 else (-pair[1], -pair[0]) for pair, (_, way) in zip(limits, others, strict=True)]
    least, most = (reduce(add, side) for side in zip(*limits, strict=True))
    return dataclasses.replace(own, bounds=((own.bounds[0][0] + least, own.bounds[0][1] + most),),
                               guards=tuple(beside(guard, least, most) for guard in own.guards))


def beside(guard: Guard, least, most) -> Guard:
    """Return a limit of stick with those of the other contacts: the reaction may be that much larger."""
    weight = affine(guard.value).terms.get(LAM, 0.0)
    return dataclasses.replace(guard, value=guard.value - abs(weight) * most if weight > 0.0 else guard.value + abs(weight) * least)
