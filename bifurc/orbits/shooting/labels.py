"""What labels the orbits of a family: memory that nothing writes, and rows of coordinates that are held all the time.

A mass that sticks to another one may do so at any distance from it.  Nothing changes that distance in a period: it is no direction
of stability, and a branch keeps it.
"""
from dataclasses import dataclass

import numpy as np

from ...content import Content

FOLLOWS = 1e-12  # of a row: what other rows leave of it is rounding


@dataclass(frozen=True, eq=False)
class Labels(Content):
    """Combinations of states that nothing changes in a period.

    Parameters
    ----------
    places : tuple of int
        A state for each, ascending.
    rows : ndarray (k, ns)
        What is constant is ``rows @ y``; each row is 1 at its own place, and 0 at those of the others.
    """

    places: tuple[int, ...]
    rows: np.ndarray

    @classmethod
    def of(cls, rows) -> "Labels":
        """Return the labels that span the same space as ``rows`` (any number, ns); what follows from others is left out."""
        found: list[np.ndarray] = []
        places: list[int] = []
        for given in np.asarray(rows, float):
            row = given - given[places] @ found if found else given.copy()
            place = int(np.argmax(np.abs(row)))
            if abs(row[place]) <= FOLLOWS * np.abs(given).max():
                continue
            row /= row[place]
            found = [other - other[place] * row for other in found]
            found.append(row)
            places.append(place)
        order = np.argsort(places)
        return cls(tuple(places[k] for k in order), np.array([found[k] for k in order]).reshape(len(order), np.shape(rows)[1]))

    @property
    def rest(self) -> np.ndarray:
        """The states (indices) that are free beside them."""
        return np.setdiff1d(np.arange(self.rows.shape[1]), self.places)

    def names(self, n: int, states=()) -> list[str]:
        """Return them in words; ``n`` is the number of coordinates, ``states`` see `System.states`.

        Examples
        --------
        >>> Labels.of([[1.0, -0.5, 0.0, 0.0]]).names(2)
        ['coordinate 0 - 0.5 coordinate 1']
        """
        found = []
        for row in self.rows.tolist():
            terms = [(factor, states[c] if states else f"coordinate {c}" if c < n else f"memory {c - 2 * n}")
                     for c, factor in enumerate(row) if factor]
            parts = [f"{'-' if factor < 0 else '+'} {'' if abs(factor) == 1.0 else f'{abs(factor):.6g} '}{word}"
                     for factor, word in terms]
            found.append(" ".join(parts).removeprefix("+ "))
        return found

    def values(self, states) -> np.ndarray:
        """Return the values (..., k) of states (..., ns)."""
        return np.asarray(states) @ self.rows.T

    def moved(self, states, values) -> np.ndarray:
        """Return states (..., ns) with these values, changed at the places alone."""
        states = np.array(states, float)
        states[..., list(self.places)] += values - self.values(states)
        return states

    def reduced(self, M) -> np.ndarray:
        """Return matrices (..., m, m), m >= ns, that keep the labels, on the perturbations that do not change them."""
        if not self.places:
            return M
        ns, size, places = self.rows.shape[1], np.shape(M)[-1], list(self.places)
        rest = np.r_[self.rest, ns:size]
        through = M[..., rest[:, None], places] @ np.pad(self.rows, ((0, 0), (0, size - ns)))[:, rest]
        return M[..., rest[:, None], rest] - through

    def seen(self, gradient) -> np.ndarray:
        """Return a gradient (ns,) on the perturbations that do not change the labels."""
        return gradient[self.rest] - gradient[list(self.places)] @ self.rows[:, self.rest]
