"""Vector field, guards and their Jacobians of one mode at one state, in plain Python from the packed numbers of a scene.

For what is computed at a few states (equilibria, normal forms); motions use the compiled engines (`affine`, `laws`,
`modal`), which read the same numbers.
"""
import numpy as np

from ..compose.evaluate import Laws
from ..compose.tables import TURN


class ModeField:
    """y' = f(y) of one mode of an autonomous scene.

    Parameters
    ----------
    scene : Scene
    tables : Tables
        With the numbers of the scene, or of another system of its structure.
    mode : int
    """

    def __init__(self, scene, tables, mode: int):
        self.scene, self.tables, self.mode = scene, tables, mode
        self._laws = Laws(scene.laws, tables, mode)

    @property
    def pace(self) -> float:
        """Rate of change of the mode, 1/time."""
        return TURN / float(self.tables.step[self.mode])

    @property
    def units(self) -> np.ndarray:
        """Units (ns,) of the states in which time is counted by `pace`: 1, and for velocities the pace."""
        units = np.ones(self.scene.ns)
        units[self.scene.n:2 * self.scene.n] = self.pace
        return units

    def joined(self, y) -> np.ndarray:
        """Return the state with the forcing states behind it (nx,); there is no forcing but the constant."""
        x = np.zeros(self.tables.A.shape[2])
        x[:len(y)] = y
        x[len(y)] = 1.0
        return x

    def forces(self, y) -> np.ndarray:
        """Return what the laws that act give (rows,): forces, reactions on curves, values of guards."""
        return self._laws.values(self.joined(y))

    def slopes(self, y) -> np.ndarray:
        """Return the derivatives (rows, ns) of `forces` by the state."""
        return self._laws.slopes(self.joined(y))

    def rate(self, y) -> np.ndarray:
        """Return y' (ns,)."""
        T, n = self.tables, self.scene.n
        f = T.A[self.mode] @ self.joined(y)
        if self._laws:
            f[n:2 * n] += self.forces(y) @ T.LP[self.mode]
        return f

    def jacobian(self, y) -> np.ndarray:
        """Return the derivative (ns, ns) of the rate by the state."""
        T, n, ns = self.tables, self.scene.n, self.scene.ns
        J = T.A[self.mode, :, :ns].copy()
        if self._laws:
            J[n:2 * n] += T.LP[self.mode].T @ self.slopes(y)
        return J

    def guards(self, y, least: float = 1e-300) -> np.ndarray:
        """Return the values of the guards (guards,), negative inside, relative to the size of their terms.

        The terms of a law are its value and its gradient times the state, whose components count as at least ``least``.
        """
        T, m = self.tables, self.mode
        count = int(T.n_guards[m])
        G, weight = T.G[m, :count], T.LG[m, :count]
        forces, slopes = self._laws.both(self.joined(y))
        size = np.maximum(np.abs(y), least)
        terms = np.abs(G) @ self.joined(size) + np.abs(weight) @ (np.abs(forces) + np.abs(slopes) @ size)
        return (G @ self.joined(y) + weight @ forces) / np.where(terms > 0.0, terms, 1.0)

    def guard_slopes(self, y) -> tuple[np.ndarray, np.ndarray]:
        """Return the values of the guards (guards,) and their derivatives (guards, ns) by the state, own units."""
        T, m = self.tables, self.mode
        count = int(T.n_guards[m])
        forces, slopes = self._laws.both(self.joined(y))
        return T.G[m, :count] @ self.joined(y) + T.LG[m, :count] @ forces, T.G[m, :count, :len(y)] + T.LG[m, :count] @ slopes

    def constraints(self) -> np.ndarray:
        """Return the rows (k, nx) that vanish while the mode lasts: speeds and surfaces of what it holds."""
        T, m = self.tables, self.mode
        rows = [row for k in range(int(T.n_holds[m])) for row in (T.H[m, k], T.S[m, k]) if row.any()]
        return np.array(rows).reshape(len(rows), T.A.shape[2])
