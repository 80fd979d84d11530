"""Dry frictions whose rows depend on each other: at rest one set-valued force, up to the facets of a zonotope.

Friction on two masses and on their difference: where two of the rows are at rest so is the third.  What the contacts hold together
is the sum of their segments, sum_i J_i^T [least_i, most_i], and they let go where the load leaves it (Moreau 1988: a sum of normal
cones).  Behind the facet with the normal v contacts with the speeds J_i v slip, each from its limit; those with J_i v = 0 stay at
rest.  A stop that holds a mass takes part with a segment that has one end.
"""
import itertools
import math
from collections.abc import Hashable
from typing import NamedTuple

import numpy as np

from ..mode import Mode
from ..site import Rows

RANK = 1e-12  # of a row: what is left of it beside others on which it depends
FLAT = 1e-9  # of a row: its speed along the normal of a facet on which it stays at rest
MANY = 20000  # sets of rows that are asked for the normal of a facet


class Joint(NamedTuple):
    """Keys that several elements take together, (element, key) each."""

    changes: tuple[tuple[int, Hashable], ...]


def joints(labels, elements, together, n: int, core) -> tuple:
    """Return for each dry friction whose row depends on those before it the elements that it depends on, and which way; empty where
    nothing is to be decided jointly.

    Raises
    ------
    ValueError
        Where what contacts hold together has too many facets.
    """
    found = []
    for e, element in enumerate(elements):
        site = element.site(n)
        held = type(site) is Rows and len(site.R) == 1 and not site.base and together[e][0] == e and [
            mode for key in element.start if isinstance(mode := element.mode(key, core), Mode) and len(mode.hold) == 1]
        if held:
            found.append((not held[0].bounds, e, np.array([*site.R[0], *(site.drift or (0.0,))])))
    if sum(not stop for stop, _, _ in found) < 2 or len(found) < 3:
        return ()
    found.sort(key=lambda item: (not item[0], item[1]))
    rows = np.array([row for _, _, row in found])
    basis, by = dependence(rows)
    if all(found[k][0] for k in by):
        return ()
    for held, made in groups({k: parts for k, parts in by.items() if not found[k][0]}):
        if math.comb(len(held) + len(made), len(held) - 1) > MANY:
            names = [labels[found[k][1]] for k in sorted([*(basis[b] for b in held), *made]) if not found[k][0]]
            raise ValueError(f"{', '.join(names)}: these frictions depend on each other (where some are at rest so are others), "
                             "and are too many for what they hold together to be followed. Leave some out")
    return tuple((found[k][1], tuple((found[b][1], float(np.sign(c))) for b, c in zip(basis, parts, strict=True) if c))
                 for k, parts in by.items() if not found[k][0])


def dependence(rows) -> tuple[list[int], dict[int, np.ndarray]]:
    """Return the first rows (k, n) that are independent, and how each of the others is made of them, with exact zeros."""
    basis: list[int] = []
    by: dict[int, np.ndarray] = {}
    sizes = np.linalg.norm(rows, axis=1)
    units = rows / sizes[:, None]
    for k, unit in enumerate(units):
        parts = np.linalg.lstsq(units[basis].T, unit, rcond=None)[0] if basis else np.zeros(0)
        if np.abs(unit - parts @ units[basis]).max() > RANK:
            basis.append(k)
        else:
            by[k] = np.where(np.abs(parts) > RANK, parts, 0.0) * sizes[k] / sizes[basis[:len(parts)]]
    return basis, {k: np.append(parts, np.zeros(len(basis) - len(parts))) for k, parts in by.items()}


def groups(by: dict[int, np.ndarray]) -> list[tuple[set[int], list[int]]]:
    """Return which rows (places of ``by`` not zero) and those that they make (its keys) depend on each other."""
    found: list[tuple[set[int], list[int]]] = []
    for k, parts in by.items():
        own, made = set(np.flatnonzero(parts).tolist()), [k]
        for group in [group for group in found if group[0] & own]:
            own, made = own | group[0], group[1] + made
            found.remove(group)
        found.append((own, made))
    return found


def facets(C) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return the normals (r,) of the facets of a sum of segments along the rows ``C`` (k, r), and their products (k,) with them.

    Products are zero to the last digit for the rows that the facet is made of.  The rows span all directions.
    """
    k, r = C.shape
    units = C / np.linalg.norm(C, axis=1)[:, None]
    if r == 1:
        normals = np.ones((1, 1))
    else:
        _, sizes, V = np.linalg.svd(units[np.array(list(itertools.combinations(range(k), r - 1)))])
        normals = V[sizes[:, -1] > FLAT, -1]
    along = normals @ units.T
    along[np.abs(along) <= FLAT] = 0.0
    _, first = np.unique(along == 0.0, axis=0, return_index=True)
    return [(way * normals[i], way * (along[i] != 0.0) * (C @ normals[i])) for i in np.sort(first) for way in (1.0, -1.0)]
