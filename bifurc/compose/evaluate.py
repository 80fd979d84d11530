"""Laws of a scene at one state in plain Python: what the written kernels compute, for the few states that are asked singly."""
import numpy as np

from .curve import polar, scalar_slope, vector_slope
from .natural import natural_length, natural_rate
from .pieces import FORCE, GUARD, SceneLaw
from .writer import FALL, LEVELS

STEP = 1e-3  # of fourth-order differences of a law without a Jacobian, part of the natural size


def value(law: SceneLaw, local: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return what a law gives, (outs,), from the coordinates and speeds (accelerations) of its rows and its values."""
    if not law.curved:
        return np.atleast_1d(law.law.function(*local, *values))
    nx, ny, r, sn, w = polar(local[0] - values[0], local[1] - values[1], local[2], local[3])
    found = law.law.function(r - values[2], 0.0, sn, w + values[3] + values[4] * r, *values[5:])
    if law.outs == 1:
        return np.atleast_1d(found)
    fn, ft = found
    return np.array([nx * fn - ny * ft, ny * fn + nx * ft])


def slope(law: SceneLaw, local: np.ndarray, values: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Return the derivatives (outs, local) of `value`; ``sizes`` (local,) are natural sizes, for laws that are differenced."""
    if law.law.jacobian is None:
        return _differences(law, local, values, np.maximum(np.abs(local), sizes))
    if not law.curved:
        return np.reshape(law.law.jacobian(*local, *values), (law.outs, len(local)))
    nx, ny, r, sn, w = polar(local[0] - values[0], local[1] - values[1], local[2], local[3])
    arguments = (r - values[2], 0.0, sn, w + values[3] + values[4] * r, *values[5:])
    spin = values[4]
    if law.outs == 1:
        a, _, b, c = law.law.jacobian(*arguments)
        return np.reshape(scalar_slope(nx, ny, r, sn, w, a + spin * c, b, c), (1, 4))
    fn, ft = law.law.function(*arguments)
    a, _, b, c, d, _, e, f = law.law.jacobian(*arguments)
    return np.reshape(vector_slope(nx, ny, r, sn, w, fn, ft, (a + spin * c, b, c), (d + spin * f, e, f)), (2, 4))


def _differences(law: SceneLaw, local, values, sizes) -> np.ndarray:
    """Return the derivatives of a law by central differences of fourth order, of which those are kept that change least from one
    step to the next smaller one, as in the written kernels (`writer`)."""
    columns = []
    for i in range(len(local)):
        best, apart, last = np.zeros(law.outs), np.full(law.outs, np.inf), np.zeros(law.outs)
        for level in range(LEVELS):
            h = STEP * sizes[i] / FALL**level
            total = np.zeros(law.outs)
            for k, weight in ((-2, 1.0), (-1, -8.0), (1, 8.0), (2, -1.0)):
                moved = local.copy()
                moved[i] += k * h
                total = total + weight * value(law, moved, values)
            found = total / (12.0 * h)
            if level:
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
        length, rate = (natural_length(tables), natural_rate(tables)) if self._laws else (1.0, 1.0)
        self._sizes = np.array([length, length * rate, length * rate**2])  # of a coordinate, a speed, an acceleration

    def __bool__(self):
        return bool(self._laws)

    def values(self, x) -> np.ndarray:
        """Return forces, reactions and values of guards (rows,) at the joined state ``x`` (nx,)."""
        return self._all(x, False)[0]

    def slopes(self, x) -> np.ndarray:
        """Return the derivatives (rows, ns) of `values` by the state."""
        return self._all(x, True)[1]

    def both(self, x) -> tuple[np.ndarray, np.ndarray]:
        """Return values (rows,) and derivatives (rows, ns)."""
        return self._all(x, True)

    def _all(self, x, want: bool):
        T, m = self.tables, self.mode
        ns, n = T.A.shape[1], T.LP.shape[2]
        out, change = np.zeros(T.LU.shape[0]), np.zeros((T.LU.shape[0], ns))
        free = T.A[m, n:2 * n] @ x
        by = T.A[m, n:2 * n, :ns].copy()
        for law, rows, given, place in self._laws:  # forces first: reactions and guards see what they give
            local = np.concatenate([T.LU[rows] @ x, T.LS[rows] @ x])
            seen = np.vstack([T.LU[rows, :ns], T.LS[rows, :ns]])
            if law.reads:
                local, seen = np.append(local, T.LU[rows, :n] @ free), np.vstack([seen, T.LU[rows, :n] @ by])
            out[given] = value(law, local, T.law[place])
            if want:
                sizes = np.repeat(self._sizes[:len(local) // law.rows], law.rows)
                change[given] = slope(law, local, T.law[place], sizes) @ seen
            if law.stage == FORCE:
                free = free + out[rows] @ T.LP[m, rows]
                if want:
                    by = by + T.LP[m, rows].T @ change[rows]
        return out, change
