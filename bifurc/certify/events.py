"""What vanishes identically behind an event, decided in exact rational arithmetic: orders of guards, held rows, earlier candidates.

Just after an event some guards are zero for a reason (the position on the stop, the speed at the end of stick): their rows, pulled
back through the event, are combinations of rows that the event makes zero.  A ball can never show that; rationals can.
"""
import functools
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from .arithmetic.balls import Rationals, flint
from .candidate import Candidate, Event, followers
from .model import GuardRow, Model, Refused

FOREVER = -1  # order of a guard that is zero as long as its mode lasts
BALANCED = 3  # times that rows and columns are divided by their largest entry
ROUNDING = 1e-13  # relative: coefficients that an element computes (rates of loads, products) carry the rounding of floats


@dataclass(frozen=True, eq=False)
class Rule:
    """What rules out a candidate tried earlier: a held row that is not zero, or a guard that is positive behind the event."""

    key: Any  # of the element that decides
    keys: tuple  # the mode
    after: int  # of the guards of the event, the last whose reset has acted
    held: list[int]  # places in the held rows (see `held_rows`) that do not vanish identically
    guards: list[tuple[int, int]]  # guard, and its lowest derivative that does not vanish identically

    def decides(self, model: Model, resets: list, x) -> bool:
        """Return whether the candidate is ruled out at the joined state ``x`` (arb_mat) just before the event."""
        y = x
        for reset in resets[:self.after + 1]:
            y = reset * y
        rows = held_rows(model, self.keys)
        if any(not dot(rows[k], y).contains(0) for k in self.held):
            return True
        mode = model.mode(self.keys)
        for q, order in self.guards:
            z = y
            for _ in range(order):
                z = balls_of(mode.B) * z
            if dot(mode.guards[q].row, z) > 0:
                return True
        return False


@dataclass(frozen=True, eq=False)
class Transition:
    """An event made ready: exact matrices and the orders of all guards behind it."""

    event: Event
    reset: Any  # fmpq_mat (nx, nx)
    guard: list | None  # row (nx,)
    orders: tuple[int, ...]  # of the guards of the mode behind it at its start
    ending: frozenset  # (element, number) of the guards of the mode before that vanish with the event
    breaks: str  # why the mode behind cannot be held, or empty
    rounded: bool  # something vanishes only up to the rounding of the element's own coefficients
    rules: list[Rule]


def transition(model: Model, candidate: Candidate, event: Event) -> Transition:
    """Return an event with everything about it that is decided exactly.

    Parameters
    ----------
    model : Model
        In rationals.
    candidate : Candidate
    event : Event
    """
    if not event.guards:
        reset = model.at_rest(event.after)
        return Transition(event, reset, None, _orders(model, event.after, reset, Span(model, [])), frozenset(), "", False, [])
    element, number = event.guards[0]
    fired: list = list(model.guard(event.before, element, number).row)
    span = Span(model, [fired, *held_rows(model, event.before)])
    reset = model.reset(event.before, element, number)
    ending = frozenset((g.element, g.number) for g in model.mode(event.before).guards if span.holds(g.row))
    rules, breaks = [], ""
    keys_at = [event.before, *event.middle, event.after]
    for k, (owner, which) in enumerate(event.guards):
        here = keys_at[k]
        if k:  # another element waited on the same row: its guard vanishes with the first
            if not behind(model, model.guard(here, owner, which).row, reset, span):
                breaks = f"the events of {candidate.system.labels[owner]!r} and its neighbour do not coincide identically"
            reset = model.reset(here, owner, which) * reset
        rules += _earlier(model, here, keys_at[k + 1], owner, which, reset, span, k)
    for held in model.mode(event.after).holds:
        for row in (held.speed, held.surface):
            if row is not None and not behind(model, row, reset, span):
                breaks = f"{candidate.system.labels[held.element]!r} is held behind an event that does not bring it to rest there"
    owners = {element for element, _ in event.guards}
    for e, key in enumerate(event.before):
        if e not in owners and event.after[e] != key and model.writes(e, key):
            breaks = f"{candidate.system.labels[e]!r} leaves a mode with memory to write in an event of another element"
    orders = _orders(model, event.after, reset, span)
    return Transition(event, reset, fired, orders, ending, breaks, span.rounded, rules)


def held_rows(model: Model, keys: tuple) -> list:
    """Return the rows that are zero while a mode lasts."""
    return [row for held in model.mode(keys).holds for row in (held.speed, held.surface) if row is not None]


class Span:
    """The space spanned by some rational rows."""

    def __init__(self, model: Model, rows):
        self.matrix = model.field.matrix
        self.rows = [row for row in rows if any(v != 0 for v in row)]
        self.rank = self._rank(self.rows)
        self.rounded = False

    @functools.cached_property
    def _scaled(self) -> tuple[np.ndarray, np.ndarray]:
        """Orthonormal columns (nx, rank) of the rows in units (nx,) in which their entries are of one size, and these units."""
        rows = np.array([[as_float(v) for v in row] for row in self.rows])
        units = np.ones(rows.shape[1])
        for _ in range(BALANCED):
            rows = rows / np.abs(rows).max(axis=1)[:, None]
            largest = np.abs(rows).max(axis=0)
            largest[largest == 0.0] = 1.0
            rows, units = rows / largest, units * largest
        columns, sizes, _ = np.linalg.svd(rows.T, full_matrices=False)
        return columns[:, sizes > 1e-14 * sizes[0]], units

    def _rank(self, rows) -> int:
        return self.matrix(len(rows), len(rows[0]), [v for row in rows for v in row]).rank() if rows else 0

    def holds(self, row, terms=None) -> bool:
        """Return whether a row is a combination of them, exactly or up to the rounding of coefficients (noted in `rounded`).

        Parameters
        ----------
        row : list of fmpq
        terms : callable, optional
            Gives the sizes (nx,) of the terms whose sums the entries of the row are; by default their own.
        """
        if not any(v != 0 for v in row) or self._rank([*self.rows, row]) == self.rank:
            return True
        target = np.array([as_float(v) for v in row])
        sizes = np.abs(target) if terms is None else terms()
        if self.rows:
            basis, units = self._scaled
            target, sizes = target / units, sizes / units
            target = target - basis @ (target @ basis)
            sizes = sizes + np.abs(basis) @ (sizes @ np.abs(basis))  # weights are rounded like the terms they are made of
        near = bool((np.abs(target) <= ROUNDING * sizes).all())
        self.rounded |= near
        return near


def dot(row, x):
    """Return a row of numbers of any field times a joined state (arb_mat), a ball."""
    total = flint().arb(0)
    for k, value in enumerate(row):
        if not value == 0:
            total = total + flint().arb(value) * x[k, 0]
    return total


def balls_of(matrix):
    """Return a matrix of any field as one of balls."""
    return flint().arb_mat(matrix)


def as_float(value) -> float:
    """Return the float nearest to a rational."""
    return float(Fraction(int(value.p), int(value.q))) if value != 0 else 0.0


def times(model: Model, row, matrix) -> list:
    """Return a row times a matrix."""
    out = model.field.matrix(1, len(row), list(row)) * matrix
    return [out[0, j] for j in range(out.ncols())]


def behind(model: Model, row, matrix, span: Span) -> bool:
    """Return whether a row vanishes identically behind an event, up to the rounding of the terms that cancel."""
    def terms():
        rows, columns = matrix.nrows(), matrix.ncols()
        return (np.abs([as_float(v) for v in row])
                @ np.abs([[as_float(matrix[i, j]) for j in range(columns)] for i in range(rows)]))
    return span.holds(times(model, row, matrix), terms)


def order_of(model: Model, guard: GuardRow, B, reset, span: Span) -> int:
    """Return the lowest derivative of a guard that does not vanish identically behind an event."""
    row = guard.row
    for order in range(model.nx):
        if not behind(model, row, reset, span):
            return order
        row = times(model, row, B)
    return FOREVER


def _orders(model: Model, keys: tuple, reset, span: Span) -> tuple[int, ...]:
    mode = model.mode(keys)
    return tuple(order_of(model, guard, mode.B, reset, span) for guard in mode.guards)


def _earlier(model: Model, before: tuple, after: tuple, owner: int, which: int, reset, span: Span, done: int) -> list[Rule]:
    """Return what rules out the candidates that are tried before the one that follows."""
    rules: list[Rule] = []
    for key in followers(model.guard(before, owner, which).guard):
        if key == after[owner]:
            return rules
        for others in dict.fromkeys((after, before)):
            keys = (*others[:owner], key, *others[owner + 1:])
            try:
                mode = model.mode(keys)
            except ZeroDivisionError:  # its held rows depend on each other: it is no mode
                continue
            held = [k for k, row in enumerate(held_rows(model, keys)) if not behind(model, row, reset, span)]
            guards = [(q, order) for q, guard in enumerate(mode.guards)
                      if (order := order_of(model, guard, mode.B, reset, span)) != FOREVER]
            rules.append(Rule(key, keys, done, held, guards))
    return rules


def kept_exactly(model: Model, candidate: Candidate, transitions: list[Transition]) -> bool:
    """Return whether the states that label a family are indeed changed by no event and no mode."""
    n, labels = model.n, candidate.labels
    memory = [c for c in labels.places if c >= 2 * n]
    coordinates = [row[:n] for c, row in zip(labels.places, labels.rows.tolist(), strict=True) if c < n]
    if len(memory) + len(coordinates) != len(labels.places):
        return False
    for item in transitions:
        B, R = model.mode(item.event.after).B, item.reset
        for c in memory:
            if any(B[c, j] != 0 or R[c, j] != (1 if j == c else 0) for j in range(model.nx)):
                return False
    if not coordinates:
        return True
    holds = [held for held in model.mode(candidate.events[0].after).holds if held.surface is None]
    if len(candidate.events) > 1 or candidate.events[0].guards or any(held.driven for held in holds):
        return False
    exact, J = Rationals(), [list(held.J) for held in holds]
    spanned = [*J, *[[exact.number(v) for v in row] for row in coordinates]]
    ranks = [exact.matrix(len(rows), n, [v for row in rows for v in row]).rank() for rows in (J, spanned)]
    return ranks == [len(coordinates)] * 2


def structure(candidate: Candidate) -> tuple[Model, list[Transition]]:
    """Return the exact model of a candidate, and its events with what vanishes identically behind them.

    Raises
    ------
    Refused
        Naming what is not covered.
    """
    model = Model(candidate.system, Rationals(), candidate.places)
    transitions = [transition(model, candidate, event) for event in candidate.events]
    for item in transitions:
        if item.breaks:
            raise Refused(item.breaks)
    if not kept_exactly(model, candidate, transitions):
        raise Refused("the states that label the family of this motion are not seen to be constant")
    return model, transitions
