"""Laws of a scene at one state in plain Python: what the written kernels compute, for the few states that are asked singly."""
import math

import numpy as np

from .curve import level, limit, polar, scalar_slope, vector_slope
from .natural import natural_length, natural_rate
from .pieces import FORCE, GUARD, SceneLaw
from .writer import FALL, LEVELS

STEP = 1e-3  # of fourth-order differences of a law without a Jacobian, part of the natural size


def value(law: SceneLaw, local: np.ndarray, values: np.ndarray, beyond: float = 0.0) -> np.ndarray:
    """Return what a law gives, (outs,), from the coordinates and speeds (accelerations) of its rows and its values; on a circle
    at the depth ``beyond`` more than the coordinates tell."""
    if not law.curved:
        return np.atleast_1d(law.law.function(*local, *values)) + _by_depth(law, values) * beyond
    nx, ny, r, sn, w = polar(local[0] - values[0], local[1] - values[1], local[2], local[3])
    found = law.law.function(r - values[2] + beyond, 0.0, sn, w + values[3] + values[4] * r, *values[5:])
    if law.outs == 1:
        return np.atleast_1d(found)
    fn, ft = found
    return np.array([nx * fn - ny * ft, ny * fn + nx * ft])


def _by_depth(law: SceneLaw, values) -> float:
    """Return the derivative by depth of a law that sees a circle from the coordinates themselves."""
    return float(values[12]) if law.law.function is limit else float(values[2]) if law.law.function is level else 0.0


def slope(law: SceneLaw, local: np.ndarray, values: np.ndarray, sizes: np.ndarray, beyond: float = 0.0,
          apart: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Return the derivatives (outs, local) of `value`, and with depth taken ``apart`` as a variable of its own those (outs,) by it.

    ``sizes`` (local,) are natural sizes, for laws that are differenced.
    """
    still = np.zeros(law.outs)
    if law.law.jacobian is None:
        return _differences(law, local, values, np.maximum(np.abs(local), sizes)), still
    if not law.curved:
        by_depth = still
        if apart and law.law.function is limit:
            by_depth, values = still + values[12], np.array([*values[:12], 0.0, *values[13:]])
        return np.reshape(law.law.jacobian(*local, *values), (law.outs, len(local))), by_depth
    nx, ny, r, sn, w = polar(local[0] - values[0], local[1] - values[1], local[2], local[3])
    arguments = (r - values[2] + beyond, 0.0, sn, w + values[3] + values[4] * r, *values[5:])
    spin, kept = values[4], 0.0 if apart else 1.0
    if law.outs == 1:
        a, _, b, c = law.law.jacobian(*arguments)
        return np.reshape(scalar_slope(nx, ny, r, sn, w, kept * a + spin * c, b, c), (1, 4)), still + (1.0 - kept) * a
    fn, ft = law.law.function(*arguments)
    a, _, b, c, d, _, e, f = law.law.jacobian(*arguments)
    found = vector_slope(nx, ny, r, sn, w, fn, ft, (kept * a + spin * c, b, c), (kept * d + spin * f, e, f))
    return np.reshape(found, (2, 4)), (1.0 - kept) * np.array([nx * a - ny * d, ny * a + nx * d])


def _differences(law: SceneLaw, local, values, sizes) -> np.ndarray:
    """Return the derivatives of a law by central differences of fourth order, of which those are kept that change least from one
    step to the next smaller one, as in the written kernels (`writer`)."""
    columns = []
    for i in range(len(local)):
        best, apart, last = np.zeros(law.outs), np.full(law.outs, np.inf), np.zeros(law.outs)
        for fall in range(LEVELS):
            h = STEP * sizes[i] / FALL**fall
            total = np.zeros(law.outs)
            for k, weight in ((-2, 1.0), (-1, -8.0), (1, 8.0), (2, -1.0)):
                moved = local.copy()
                moved[i] += k * h
                total = total + weight * value(law, moved, values)
            found = total / (12.0 * h)
            if fall:
                better = np.abs(found - last) < apart
                apart[better], best[better] = np.abs(found - last)[better], found[better]
            last = found
        columns.append(best)
    return np.array(columns).T


class Laws:
    """All laws of a scene that act in one mode.

    Parameters
    ----------
    laws : sequence of SceneLaw
    tables : Tables
    mode : int
    """

    def __init__(self, laws, tables, mode: int):
        self.tables, self.mode, self._laws = tables, mode, []
        row = 0
        for i, law in enumerate(laws):
            at = int(tables.acts[mode, i]) - 1
            if at >= 0 and law.stage <= GUARD:
                place = slice(at, at + len(law.law.values))
                self._laws.append((law, slice(row, row + law.rows), slice(row, row + law.outs), place))
            row += law.rows
        self._circles = [(law, rows, place) for law, rows, _, place in self._laws
                         if law.stage == FORCE and law.curved and law.law.jacobian is not None]
        self._contact = {law.element: i for i, (law, _, _) in enumerate(self._circles)}
        self.beyond = np.zeros(len(self._circles))  # what the coordinates cannot tell of their depths: below rounding
        length, rate = (natural_length(tables), natural_rate(tables)) if self._laws else (1.0, 1.0)
        self._sizes = np.array([length, length * rate, length * rate**2])  # of a coordinate, a speed, an acceleration

    def __bool__(self):
        return bool(self._laws)

    def depths(self, x) -> tuple[np.ndarray, np.ndarray]:
        """Return how far ``x`` (nx,) is beyond each circle that gives a force (contacts,), and the derivative (contacts, ns)."""
        T = self.tables
        found, change = np.zeros(len(self._circles)), np.zeros((len(self._circles), T.A.shape[1]))
        for i, (_, rows, place) in enumerate(self._circles):
            p = T.LU[rows] @ x - T.law[place][:2]
            r = float(np.hypot(*p))
            found[i], change[i] = r - T.law[place][2], (p / r if r > 0.0 else np.array([1.0, 0.0])) @ T.LU[rows, :change.shape[1]]
        return found, change

    def steepness(self, x) -> np.ndarray:
        """Return what forces on circles (contacts,) change in the accelerations, over their depths."""
        T, found = self.tables, np.zeros(len(self._circles))
        for i, (law, rows, place) in enumerate(self._circles):
            local = np.concatenate([T.LU[rows] @ x, T.LS[rows] @ x])
            by_depth = slope(law, local, T.law[place], local, self.beyond[i], True)[1] @ T.LP[self.mode, rows]
            found[i] = math.sqrt(by_depth @ by_depth)
        return found

    def values(self, x) -> np.ndarray:
        """Return forces, reactions and values of guards (rows,) at the joined state ``x`` (nx,)."""
        return self._all(x, False)[0]

    def slopes(self, x) -> np.ndarray:
        """Return the derivatives (rows, ns) of `values` by the state."""
        return self._all(x, True)[1][:, :self.tables.A.shape[1]]

    def both(self, x) -> tuple[np.ndarray, np.ndarray]:
        """Return values (rows,) and derivatives (rows, ns)."""
        values, change = self._all(x, True)
        return values, change[:, :self.tables.A.shape[1]]

    def apart(self, x) -> tuple[np.ndarray, np.ndarray]:
        """Return values (rows,) and derivatives (rows, ns + contacts), by the state while depths stay, and by these."""
        return self._all(x, True, True)

    def _all(self, x, want: bool, apart: bool = False):
        T, m = self.tables, self.mode
        ns, n = T.A.shape[1], T.LP.shape[2]
        more = len(self.beyond)
        out, change = np.zeros(T.LU.shape[0]), np.zeros((T.LU.shape[0], ns + more))
        free = T.A[m, n:2 * n] @ x
        by = T.A[m, n:2 * n, :ns].copy() if not more else np.hstack([T.A[m, n:2 * n, :ns], np.zeros((n, more))])
        for law, rows, given, place in self._laws:  # forces first: reactions and guards see what they give
            local = np.concatenate([T.LU[rows] @ x, T.LS[rows] @ x])
            seen = np.vstack([T.LU[rows, :ns], T.LS[rows, :ns]]) if want else None
            if law.reads:
                local = np.append(local, T.LU[rows, :n] @ free)
            contact = self._contact.get(law.element)
            beyond = 0.0 if contact is None else self.beyond[contact]
            out[given] = value(law, local, T.law[place], beyond)
            if want:
                sizes = np.repeat(self._sizes[:len(local) // law.rows], law.rows)
                by_local, by_depth = slope(law, local, T.law[place], sizes, beyond, apart and contact is not None)
                change[given, :ns] = by_local[:, :2 * law.rows] @ seen
                if law.reads:
                    change[given] += by_local[:, 2 * law.rows:] @ (T.LU[rows, :n] @ by)
                if contact is not None:
                    change[given, ns + contact] += by_depth
            if law.stage == FORCE:
                free = free + out[rows] @ T.LP[m, rows]
                if want:
                    by = by + T.LP[m, rows].T @ change[rows]
        return out, change
