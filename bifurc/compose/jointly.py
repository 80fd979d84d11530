"""Which contacts of a mode rest jointly, and where they let go: the guards of a scene mode that belong to several elements.

See `elements.friction.joint`.  Rows that depend on each other are held by some of them; reactions of these say where the load is.
"""
from collections.abc import Hashable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..elements import Affine, EventKind, Guard
from ..elements.friction.joint import Joint, dependence, facets, groups
from ..elements.friction.together import LAM
from ..elements.local import affine, lam

if TYPE_CHECKING:
    from .numbers import Packer

FIRST = 1000  # number of the first guard that several elements have jointly


class Limit(NamedTuple):
    """A guard on the reaction of one row: the reaction has this value where it fires, and this key follows."""

    value: Affine
    key: Hashable
    kind: EventKind


class Resting(NamedTuple):
    """What rests jointly in a mode."""

    redundant: list[int]  # places among the rows held of those that the others hold too
    groups: list[tuple[list[int], np.ndarray]]  # places of rows that depend on each other, and how the held ones make them


def resting(packer: "Packer", owners: list) -> Resting:
    """Return what rests jointly where these (element, hold) have straight rows at rest."""
    order = sorted(range(len(owners)), key=lambda i: owners[i][0] in packer.frictions)
    rows = np.array([packer.sites[e].S[hold.row] for e, hold in (owners[i] for i in order)])
    basis, by = dependence(rows) if len(rows) else ([], {})
    rough = np.array([owners[order[b]][0] in packer.frictions for b in basis], bool)
    jointly = {k: parts for k, parts in by.items() if owners[order[k]][0] in packer.frictions and parts[rough].any()}
    return Resting([order[k] for k in jointly],
                   [([order[i] for i in [*(basis[b] for b in sorted(own)), *made]],
                     np.vstack([np.eye(len(own)), *(jointly[k][sorted(own)] for k in made)])) for own, made in groups(jointly)])


def carried(packer: "Packer", keys: tuple) -> tuple[tuple[int, Hashable], ...]:
    """Return the frictions that slip by their keys, (element, key of rest) each, but are at rest with the others that are."""
    if keys in packer.carries:
        return packer.carries[keys]
    stops: list[np.ndarray] = []
    held: list[np.ndarray] = []
    for e, key in enumerate(keys):
        if not packer.sites[e].curved:
            (held if e in packer.frictions else stops).extend(packer.sites[e].S[hold.row] for hold in packer.mode(e, key).hold)
    found = []
    for e in packer.frictions if held else ():
        rests = [guard.then[0] for guard in packer.mode(e, keys[e]).guards
                 if guard.kind is EventKind.STICK and not callable(guard.then)]
        if rests and within(packer.sites[e].S[0], [*stops, *held]) and not within(packer.sites[e].S[0], stops):
            found.append((e, rests[0]))
    packer.carries[keys] = tuple(found)
    return packer.carries[keys]


def slips(packer: "Packer", keys: tuple, x: np.ndarray, noise: np.ndarray) -> dict[int, Hashable]:
    """Return the frictions that rest by their keys but move at ``x`` (nx,), by more than its ``noise`` (nx,), with their slips."""
    found = {}
    for e in packer.frictions:
        for hold in packer.mode(e, keys[e]).hold:
            row = packer.sites[e].S[hold.row]
            if abs(row @ x) > np.abs(row) @ noise and (least := limit(packer, e, keys[e], row @ x)) is not None:
                found[e] = least.key
    return found


def within(row: np.ndarray, rows: list[np.ndarray]) -> bool:
    """Return whether a row (nx,) depends on others."""
    return len(rows) in dependence(np.array([*rows, row]))[1]


def limit(packer: "Packer", element: int, key: Hashable, way: float) -> Limit | None:
    """Return where the row of an element lets go so that it moves this way; None: it never does."""
    for guard in packer.mode(element, key).guards:
        if isinstance(guard.value, Affine) and (weight := guard.value.terms.get(LAM, 0.0)) * way < 0.0 and not callable(guard.then):
            rest = Affine({name: part for name, part in guard.value.terms.items() if name != LAM})
            return Limit(rest * (-1.0 / weight), guard.then[0], guard.kind)
    return None


def joint_guards(packer: "Packer", keys: tuple, owners: list, rests: Resting) -> list[tuple[int, int, Guard]]:
    """Return element, number and guard of every facet: where a stop opens its own, else of the first friction that slips.

    The multipliers in a guard are those of all rows that the mode holds, in their order.
    """
    held = [i for i in range(len(owners)) if i not in rests.redundant]
    found: list[tuple[int, int, Guard]] = []
    for places, C in rests.groups:
        numbers = [held.index(i) for i in places[:C.shape[1]]]
        for normal, along in facets(C):
            moving = {owners[i][0]: float(speed) for i, speed in zip(places, along, strict=True) if speed}
            limits = {e: least for e, speed in sorted(moving.items()) if (least := limit(packer, e, keys[e], speed)) is not None}
            if len(limits) < len(moving):
                continue
            owner = min(limits, key=lambda e: (limits[e].kind is EventKind.SLIP, e))
            value = affine(0.0)
            for e, speed in moving.items():
                value = value + limits[e].value * (speed / abs(moving[owner]))
            for k, part in zip(numbers, normal, strict=True):
                value = value - lam(k) * (part / abs(moving[owner]))
            after = Joint(tuple((e, limits[e].key if e in limits else keys[e]) for e in sorted(owners[i][0] for i in places)))
            found.append((owner, FIRST + len(found), Guard(value, limits[owner].kind, (after,))))
    return found
