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

    Notes
    -----
    Where a force acts beyond a circle, its depth may be known better than the coordinates can tell: a stiff wall takes the whole
    load with what rounding leaves of them.  `press` gives it; the forces are those of these depths then.
    """

    def __init__(self, scene, tables, mode: int):
        self.scene, self.tables, self.mode = scene, tables, mode
        self._laws = Laws(scene.laws, tables, mode)
        self._kept = scene.kept(mode)

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

    @property
    def slides(self) -> bool:
        """Whether the mode stays on surfaces of fields of first order."""
        return bool(self._kept)

    @property
    def contacts(self) -> int:
        """Number of forces beyond circles, each with a depth of its own."""
        return len(self._laws.beyond)

    def depths(self, y) -> tuple[np.ndarray, np.ndarray]:
        """Return the depths beyond circles that the coordinates tell (contacts,), and their derivatives (contacts, ns)."""
        return self._laws.depths(self.joined(y))

    def press(self, y, depths) -> tuple[np.ndarray, np.ndarray]:
        """Let forces beyond circles be those of ``depths`` (contacts,) at the state ``y``; return what `depths` does there."""
        told, normals = self.depths(y)
        self._laws.beyond[:] = depths - told
        return told, normals

    def pressed(self, y) -> np.ndarray:
        """Return the depths (contacts,) with which the accelerations at ``y`` are least: what stiff walls need there."""
        n = self.scene.n
        depths = self.depths(y)[0]
        if not self.contacts:
            return depths
        self.press(y, depths)
        by_depth = self.apart(y)[n:2 * n, self.scene.ns:]
        height = np.abs(by_depth).max(axis=0)
        height[~(height > 0.0)] = 1.0
        change = np.linalg.lstsq(by_depth / height, -self.rate(y)[n:2 * n], rcond=None)[0] / height
        return np.where(np.isfinite(change), depths + change, depths)

    def stiffening(self, y) -> np.ndarray:
        """Return how steep the forces beyond circles (contacts,) are by their depths at ``y``, as accelerations over length."""
        steep = self._laws.steepness(self.joined(y))
        return np.where(steep > 0.0, steep, 1.0)

    def apart(self, y) -> np.ndarray:
        """Return the derivative (ns, ns + contacts) of the rate by the state while depths stay, and by these."""
        T, n = self.tables, self.scene.n
        if not self.contacts:
            return self.jacobian(y)
        J = np.hstack([T.A[self.mode, :, :self.scene.ns], np.zeros((self.scene.ns, self.contacts))])
        J[n:2 * n] += T.LP[self.mode].T @ self._laws.apart(self.joined(y))[1]
        return J

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

        The terms of a law are its value and its gradient times the state, whose components count as at least ``least``; a depth
        counts as at least that with which the wall gives the acceleration of such a state.
        """
        T, m = self.tables, self.mode
        count = int(T.n_guards[m])
        G, weight = T.G[m, :count], T.LG[m, :count]
        forces, slopes = self._laws.apart(self.joined(y))
        size = np.maximum(np.abs(y), least)
        if self.contacts:
            depths = np.maximum(np.abs(self.depths(y)[0] + self._laws.beyond), size.max() * self.pace**2 / self.stiffening(y))
            size, y = np.append(size, depths), np.asarray(y)
        terms = np.abs(G) @ self.joined(size[:len(y)]) + np.abs(weight) @ (np.abs(forces) + np.abs(slopes) @ size)
        return (G @ self.joined(y) + weight @ forces) / np.where(terms > 0.0, terms, 1.0)

    def guard_slopes(self, y) -> tuple[np.ndarray, np.ndarray]:
        """Return the values of the guards (guards,) and their derivatives (guards, ns) by the state, own units."""
        T, m = self.tables, self.mode
        count = int(T.n_guards[m])
        forces, slopes = self._laws.both(self.joined(y))
        return T.G[m, :count] @ self.joined(y) + T.LG[m, :count] @ forces, T.G[m, :count, :len(y)] + T.LG[m, :count] @ slopes

    def constraints(self) -> np.ndarray:
        """Return the rows (k, nx) that vanish while the mode lasts: speeds and surfaces of what it holds, and what it slides on."""
        T, m = self.tables, self.mode
        rows = [row for k in range(int(T.n_holds[m])) for row in (T.H[m, k], T.S[m, k]) if row.any()]
        rows += [T.G[other, g] for other, g in self._kept]
        return np.array(rows).reshape(len(rows), T.A.shape[2])
