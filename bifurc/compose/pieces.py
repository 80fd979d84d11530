"""What of an element's modes is not affine, as laws: forces, reactions of constraints on curves, values of guards, kicks.

A law of a straight site is taken as it is.  On a `Circle` even affine expressions in depth and speeds are no affine
functions of the coordinates: they become laws of `bifurc.compose.curve`, with their coefficients as values.
"""
from collections.abc import Callable, Hashable, Sequence
from typing import NamedTuple

import numpy as np

from ..elements import Affine, Circle, Law, Mode
from ..elements.local import ONE
from . import curve
from .tables import Rows

FORCE, REACTION, GUARD, KICK, REST = range(5)  # what a law gives; the order of the rows of laws
TERMS = (ONE, ("u", 0), ("s", 0), ("s", 1))  # what an affine expression on a circle may contain, besides multipliers


class Piece(NamedTuple):
    """A law of one mode of an element."""

    stage: int  # FORCE, REACTION, GUARD, KICK or REST
    guard: int  # number of the guard, of a guard or a kick; -1: neither
    function: Callable
    jacobian: Callable | None
    values: tuple[float, ...]
    curved: bool  # arguments are depth and speeds on a circle; its centre, radius, surface speed and spin come first in values


class SceneLaw(NamedTuple):
    """A law of a scene: ``v' = A x + sum LP f``, ``f = function(u..., s..., *values)`` with u = LU x, s = LS x."""

    element: int
    name: str  # label of the element
    keys: tuple[Hashable, ...]  # modes of the element in which the law acts, each with values of its own
    rows: int
    law: Law
    stage: int
    slot: int  # among the laws of one mode with this function
    curved: bool

    @property
    def outs(self) -> int:
        """Number of values that it returns: one force a row, or the value of a guard."""
        return 1 if self.stage == GUARD else self.rows

    @property
    def reads(self) -> bool:
        """Whether it takes accelerations."""
        return self.law.function in (curve.reaction, curve.limit)

    @property
    def is_level(self) -> bool:
        """Whether it is how far a position is beyond a circle."""
        return self.law.function is curve.level

    @property
    def group(self) -> tuple:
        """What laws of several modes that are evaluated as one have in common."""
        return (self.element, self.stage, self.slot, self.law.function, self.law.jacobian, len(self.law.values), self.curved)


def law_rows(laws: Sequence[SceneLaw]) -> Rows:
    """Return where the rows of laws stand, one law after the other."""
    owners: list[tuple[int, int, int, int]] = []
    seen: dict[int, int] = {}  # first row of every element: all its laws see the same coordinates
    for law in laws:
        first = len(owners)
        at = seen.setdefault(law.element, first)
        owners += [(first, law.rows, at + k, law.element) for k in range(law.rows)]
    ends = [sum(law.rows for law in laws if law.stage <= stage) for stage in (FORCE, REACTION, GUARD, KICK)]
    ends += [max((law.rows for law in laws), default=1), ends[REACTION] + sum(law.rows for law in laws if law.is_level)]
    return Rows(np.array(owners, np.int64).reshape(-1, 4).T.copy(), np.array(ends))


def is_law(value) -> bool:
    """Return whether the value of a guard is a law."""
    return isinstance(value, Law)


def pieces(site, mode: Mode, name: str, W: np.ndarray) -> list[Piece]:
    """Return the laws of a mode at its site; ``W`` (rows, rows) is R M^-1 R^T.

    Raises
    ------
    ValueError
        For an expression that has no meaning on a curve.
    """
    if not isinstance(site, Circle):
        found = [] if mode.law is None else [Piece(FORCE, -1, mode.law.function, mode.law.jacobian, mode.law.values, False)]
        for g, guard in enumerate(mode.guards):
            for stage, law in ((GUARD, guard.value), (KICK, guard.kick)):
                if isinstance(law, Law):
                    found.append(Piece(stage, g, law.function, law.jacobian, law.values, False))
        return found
    (cx, cy), radius, drift, spin = site.centre, site.radius, site.surface_speed, site.spin
    found, circle = [], (cx, cy, radius, drift, spin)
    if mode.law is not None:
        found.append(Piece(FORCE, -1, mode.law.function, mode.law.jacobian, circle + mode.law.values, True))
    elif mode.force:
        rows = [coefficients(entry, name) for entry in mode.entries]
        found.append(Piece(FORCE, -1, curve.affine_pair, curve.affine_pair_slope, circle + rows[0] + rows[1], True))
    held: tuple[float, ...] = ()
    if mode.hold:
        push = (0.0, 0.0) if len(mode.hold) == 2 else tuple(float(part) for part in mode.hold[0].push)
        rows_held = 2.0 if len(mode.hold) == 2 else float(mode.hold[0].row)
        held = (cx, cy, drift, spin, rows_held, float(W[0, 0]), float(W[0, 1]), float(W[1, 1]), *push)
        found.append(Piece(REACTION, -1, curve.reaction, curve.reaction_slope, held, False))
        found.append(Piece(REST, -1, curve.unrest, curve.put_at_rest, (*circle, rows_held), False))
    for g, guard in enumerate(mode.guards):
        if isinstance(guard.kick, Law):
            found.append(Piece(KICK, g, guard.kick.function, guard.kick.jacobian, circle + guard.kick.values, True))
        if isinstance(guard.value, Law):
            found.append(Piece(GUARD, g, guard.value.function, guard.value.jacobian, circle + guard.value.values, True))
            continue
        c, by_u, by_n, by_t, *multipliers = coefficients(guard.value, name, len(mode.hold))
        names = set(guard.value.terms)
        if names & {("lam", 0), ("lam", 1)}:
            both = (*multipliers, 0.0, 0.0)[:2]
            found.append(Piece(GUARD, g, curve.limit, curve.limit_slope, (*held, radius, c, by_u, by_n, by_t, *both), False))
        elif ("u", 0) in names and not names & {("s", 0), ("s", 1)} and by_u != 0.0 and radius - c / by_u > 0.0:
            found.append(Piece(GUARD, g, curve.level, curve.level_slope, (cx, cy, by_u, radius - c / by_u), False))
        else:
            found.append(Piece(GUARD, g, curve.affine_scalar, curve.affine_scalar_slope, (*circle, c, by_u, by_n, by_t), True))
    return found


def coefficients(expression, name: str, holds: int = 0) -> tuple[float, ...]:
    """Return the coefficients of 1, u(0), s(0), s(1) and of ``holds`` multipliers.

    Raises
    ------
    ValueError
        For other local values.
    """
    terms = expression.terms if isinstance(expression, Affine) else {ONE: float(expression)}
    allowed = (*TERMS, *(("lam", k) for k in range(holds)))
    other = [key for key in terms if key not in allowed]
    if other:
        raise ValueError(f"{name}: {expression!r} contains {other[0][0]}({other[0][1]}), which a circle does not have; there are "
                         "the constant, u(0), s(0), s(1), and lam(k) of held rows")
    return tuple(terms.get(key, 0.0) for key in allowed)


def joined(found: list[SceneLaw]) -> tuple[SceneLaw, ...]:
    """Return laws of several modes with the same text as one each, forces first, then reactions, then guards, levels first."""
    groups: dict[tuple, list[SceneLaw]] = {}
    for law in found:
        groups.setdefault(law.group, []).append(law)
    whole = [laws[0]._replace(keys=tuple(dict.fromkeys(law.keys[0] for law in laws))) for laws in groups.values()]
    return tuple(sorted(whole, key=lambda law: (law.stage, not law.is_level)))
