"""Cycles of maps: one unknown point a period, in the coordinates of its piece, solved together by Newton's method."""
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...content import Content
from ...enumerations import DescribedEnum

SETTLE = 2000  # iterations from the origin before a cycle is looked for
MAX_ITERATIONS = 60
TOLERANCE = 1e-14


class MapOrbitStatus(DescribedEnum):
    """How a cycle is to be taken."""

    CONVERGED = "converged", "The equations hold to rounding and every point lies in its piece."
    NOT_CONVERGED = "not_converged", "Newton's method did not settle; try another guess or itinerary."
    INADMISSIBLE = ("inadmissible", "The equations hold, but a point lies outside the piece whose formula was used: "
                                    "this is no cycle of the map.")


@dataclass(frozen=True, eq=False)
class MapOrbit(Content):
    """A cycle of a map.

    Attributes
    ----------
    map : Map
    itinerary : str
        Symbols of the pieces in order.
    u : ndarray (n, d)
        Coordinates of the points in their pieces.
    status : MapOrbitStatus
    residual : float
        Largest residual of the equations, in the unit of the points.
    """

    map: Any
    itinerary: str
    u: np.ndarray = field(repr=False)
    status: MapOrbitStatus
    residual: float

    @property
    def period(self) -> int:
        """Number of points."""
        return len(self.itinerary)

    @property
    def success(self) -> bool:
        """Converged, with every point in its piece."""
        return self.status is MapOrbitStatus.CONVERGED

    @property
    def message(self) -> str:
        """The status as a sentence."""
        return self.status.sentence

    @property
    def points(self) -> np.ndarray:
        """Points (n, d)."""
        return np.array([self.map.pieces[c].place(u)[0] for c, u in zip(self.itinerary, self.u, strict=True)])

    @property
    def multipliers(self) -> np.ndarray:
        """Multipliers (d,), complex, largest modulus first; infinite at the border of a square root."""
        total = np.eye(self.map.dimension)
        for symbol, u in zip(self.itinerary, self.u, strict=True):
            piece = self.map.pieces[symbol]
            place, image = piece.place(u)[1], piece.image(u, self.map)[1]
            if np.linalg.det(place) == 0.0:
                return np.full(self.map.dimension, complex(np.inf))
            total = image @ np.linalg.solve(place, total)
        mu = np.linalg.eigvals(total).astype(complex)
        return mu[np.lexsort((-mu.imag, -mu.real, -np.abs(mu).round(14)))]

    @property
    def stable(self) -> bool | None:
        """Whether all multipliers lie inside the unit circle; None for a failed cycle, and on the circle."""
        top = float(np.abs(self.multipliers).max())
        return None if not self.success or abs(top - 1.0) < 1e-9 else top < 1.0

    def __repr__(self) -> str:
        return f"MapOrbit({self.itinerary}, {self.status.value}, multipliers {np.array2string(self.multipliers, precision=5)})"


def find_cycle(system, n, guess, itinerary) -> MapOrbit:
    """See `Map.find`."""
    if not (isinstance(n, (int, np.integer)) and n >= 1):
        raise ValueError(f"n = {n!r} must be a whole number of at least 1")
    if itinerary is not None and (len(itinerary) != n or any(c not in system.pieces for c in itinerary)):
        raise ValueError(f"itinerary = {itinerary!r} must be {n} of the symbols {', '.join(system.pieces)}")
    x = system.iterate(None, SETTLE)[-1] if guess is None else system._point(guess, "guess")
    if not np.isfinite(x).all():
        x = np.zeros(system.dimension)
    points = system.iterate(x, n - 1)
    points = np.where(np.isfinite(points), points, 0.0)
    symbols = itinerary or "".join(system.piece_of(point) for point in points)
    if itinerary is None and guess is None and len(set(symbols)) > 1:  # begin at the first rare symbol: an impact
        rare = min(reversed(system.pieces), key=lambda c: symbols.count(c) or np.inf)  # of equals the last piece
        first = symbols.index(rare)
        symbols, points = symbols[first:] + symbols[:first], np.roll(points, -first, axis=0)
    U = np.concatenate([system.pieces[c].coordinates(point) for c, point in zip(symbols, points, strict=True)])
    return newton(system, symbols, U)


def newton(system, symbols, U) -> MapOrbit:
    """Return the cycle that Newton's method reaches from the coordinates ``U`` (n d,)."""
    n, d = len(symbols), system.dimension
    converged = False
    with np.errstate(all="ignore"):
        for _ in range(MAX_ITERATIONS):
            F, J = cycle_equations(system, symbols, U)
            if not (np.isfinite(F).all() and np.isfinite(J).all()):
                break
            try:
                step = np.linalg.solve(J, F)
            except np.linalg.LinAlgError:
                break
            U = U - step * min(1.0, 10.0 / max(1e-300, float(np.abs(step).max())))
            if np.abs(step).max() <= TOLERANCE * (1.0 + np.abs(U).max()):
                converged = True
                break
        residual = float(np.abs(cycle_equations(system, symbols, U)[0]).max())
    converged = converged or residual <= 10.0 * TOLERANCE
    rows = U.reshape(n, d)
    inside = max(system.pieces[c].inside(u) for c, u in zip(symbols, rows, strict=True))
    status = (MapOrbitStatus.NOT_CONVERGED if not converged else
              MapOrbitStatus.CONVERGED if inside <= 1e-13 else MapOrbitStatus.INADMISSIBLE)
    return MapOrbit(system, symbols, rows, status, residual)


def cycle_equations(system, symbols, U, mu=1.0):
    """Return image(u_i) - place(u_{i+1}) (n d,) and its derivative; ``mu`` multiplies the columns of the closing point."""
    n, d = len(symbols), system.dimension
    F, J = np.empty(n * d), np.zeros((n * d, n * d))
    rows = U.reshape(n, d)
    for i, symbol in enumerate(symbols):
        k = (i + 1) % n
        image, slope = system.pieces[symbol].image(rows[i], system)
        place, turn = system.pieces[symbols[k]].place(rows[k])
        here = slice(i * d, (i + 1) * d)
        F[here] = image - place
        J[here, i * d:(i + 1) * d] += slope
        J[here, k * d:(k + 1) * d] -= (mu if k == 0 else 1.0) * turn
    return F, J
