"""The matrices of an event sequence over a range of its parameter, and proved points of the branch in it."""
from typing import Any, NamedTuple

import numpy as np

from ..arithmetic.balls import flint, middle, radius, size
from ..arithmetic.forms import Form, total
from ..arithmetic.jets import Jet
from ..equations import Pieces, Solved, evaluate
from .sequence import Along, pieces_of

ORDER = 20  # of the matrices as series in the parameter, at most; that of the ball that closes them
THIN = 1e-18  # relative width of what that ball does to a matrix
POINT = (1e-9, 1e-11, 1e-12)  # half widths of the boxes tried around a point, scaled


class Node(NamedTuple):
    """A proved point of a branch: near it ``z``, a tangent there (floats), and the box that holds the one solution."""

    z: np.ndarray
    tangent: np.ndarray
    box: list


class Sheet:
    """The matrices of a sequence over a range of its parameter, as Taylor series about its middle.

    Parameters
    ----------
    path : Along
    low, high : float
    """

    def __init__(self, path: Along, low: float, high: float):
        arb = flint().arb
        self.path = path
        self.low, self.high = low, high
        self.centre = arb(0.5 * (low + high))
        whole = arb(low).union(arb(high))
        near = pieces_of(path, path.family.model(self.centre, ORDER), lambda found: found)
        rest = pieces_of(path, path.family.model(whole, ORDER + 1), lambda found: found)
        known: dict[int, list] = {}

        half = 0.5 * (high - low) * (1.0 + 1e-12)
        weights = path.candidate.weights

        def series(a, b):
            if id(a) not in known:
                order = next((k for k in range(1, ORDER) if widest(b.parts[k] - a.parts[k], weights) * half**k
                              <= THIN * widest(a.parts[0], weights)), ORDER)
                parts = [*a.parts[:order], b.parts[order]]
                while len(parts) > 1 and all(v == 0 for v in parts[-1].entries()):
                    parts.pop()
                known[id(a)] = parts
            return known[id(a)]
        self.near = near
        self.B, self.R = ([series(a, b) for a, b in zip(*pair, strict=True)] for pair in ((near.B, rest.B), (near.R, rest.R)))
        self.G = [None if a is None else series(a, b) for a, b in zip(near.G, rest.G, strict=True)]

    def pieces(self, p, slopes: bool) -> Pieces:
        """Return the matrices at a ball or along a form of the parameter, with their derivatives by it where they are wanted."""
        d = p - self.centre
        made: dict[int, Jet] = {}

        def jet(parts):
            if id(parts) not in made:
                value: Any = parts[-1]
                for part in reversed(parts[:-1]):
                    value = scaled(value, d) + part
                slope: Any = None
                for k in range(len(parts) - 1, 0, -1):
                    slope = total(None if slope is None else scaled(slope, d), parts[k] * k)
                if isinstance(p, Form):
                    value = value if isinstance(value, Form) else Form(p.reach, value)
                    slope = slope if slope is None or isinstance(slope, Form) else Form(p.reach, slope)
                made[id(parts)] = Jet(value, slope) if slopes else Jet(value)
            return made[id(parts)]
        return self.near._replace(B=[jet(B) for B in self.B], R=[jet(R) for R in self.R],
                                  G=[None if G is None else jet(G) for G in self.G])

    def evaluate(self, z: list, slopes: bool = True) -> tuple[Solved, Pieces, Any]:
        """Return residual and Jacobian at balls or along forms of unknowns and parameter, and the matrix (N, N + 1) of the latter
        by both; without ``slopes`` the residual alone."""
        pieces = self.pieces(z[-1], slopes)
        step, rest = 1 + pieces.ns, [None] if slopes else []
        count = self.path.length
        theta = [Jet(z[i * step], *rest) for i in range(count)]
        y = [[Jet(v, *rest) for v in z[i * step + 1:(i + 1) * step]] for i in range(count)]
        close = (Jet(z[0] + flint().arb.pi() * 2 * flint().arb(pieces.span), *rest),
                 [Jet(z[1 + c] * pieces.closure, *rest) for c in range(pieces.ns)])
        solved = evaluate(pieces, theta, y, close, slopes)
        J = [[*row, solved.F[1][i]] for i, row in enumerate(solved.J[0])] if slopes else None
        return solved, pieces, J

    def corrected(self, z: np.ndarray, row: np.ndarray, steps: int = 5):
        """Return the point where the branch meets the plane ``row . z = value`` of ``z``, its tangent with row . tangent = 1, and
        the inverse of the Jacobian with the row below it; all in floats; or None."""
        arb = flint().arb
        scale, value = self.path.scale, float(row @ z)
        for _ in range(steps):
            solved, _, J = self.evaluate([arb(float(v)) for v in z])
            F = np.array([middle(v) for v in solved.F[0]] + [float(row @ z) - value])
            A = np.array([[middle(v) for v in line] for line in J] + [row.tolist()])
            if not (np.isfinite(F).all() and np.isfinite(A).all()):
                return None
            try:
                inverse = np.linalg.inv(A * scale) * scale[:, None]
            except np.linalg.LinAlgError:
                return None
            move = inverse @ F
            z = z - move
            if np.abs(move / scale).max() < 1e-10:
                return z, inverse[:, -1], inverse
        return None

    def node(self, z: np.ndarray, row: np.ndarray) -> Node | None:
        """Return the proved point of the branch in the plane through ``z`` across ``row``."""
        found = self.corrected(z, row)
        return None if found is None else self.proved(found[0], found[1], found[2], row)

    def proved(self, z: np.ndarray, tangent: np.ndarray, inverse: np.ndarray, row: np.ndarray) -> Node | None:
        """Return a corrected point as a node, or None where it is not proved."""
        arb, matrix = flint().arb, flint().arb_mat
        N = len(z)
        m = [arb(float(v)) for v in z]
        Y = matrix(N, N, inverse.ravel().tolist())
        solved, _, _ = self.evaluate(m, slopes=False)
        shift = Y * matrix(N, 1, [*solved.F[0], arb(0)])
        for half in POINT:
            X = self._shrunk(m, Y, shift, row, half)
            if X is not None:
                return Node(z, tangent, [a + b for a, b in zip(m, X, strict=True)])
        return None

    def _shrunk(self, m, Y, shift, row, half: float) -> list | None:
        """Return what Krawczyk's operator makes of a box about a point, where it maps it into its interior."""
        arb, matrix = flint().arb, flint().arb_mat
        N, scale = len(m), self.path.scale
        one = matrix(N, N, [arb(int(i == j)) for i in range(N) for j in range(N)])
        X = [arb(0, half * s) for s in scale]
        for _ in range(2):
            _, _, J = self.evaluate([a + b for a, b in zip(m, X, strict=True)])
            A = matrix(N, N, [v for line in J for v in line] + [arb(float(v)) for v in row])
            new = (one - Y * A) * matrix(N, 1, X) - shift
            if not all(X[i].contains_interior(new[i, 0]) for i in range(N)):
                return None
            X = [new[i, 0] for i in range(N)]
            if max(radius(x) / s for x, s in zip(X, scale, strict=True)) < 1e-13:
                break
        return X


def widest(matrix, weights) -> float:
    """Return a bound of the entries of a matrix of balls whose rows (one: a guard) and columns are states, with the natural sizes
    ``weights`` (ns,), and forcing states: entries are of different units."""
    def sized(k):
        return float(weights[k]) if k < len(weights) else 1.0
    return max(size(matrix[i, j]) * sized(j) / (sized(i) if matrix.nrows() > 1 else 1.0)
               for i in range(matrix.nrows()) for j in range(matrix.ncols()))


def scaled(matrix, d):
    """Return a matrix times a number, either of which may be a form."""
    if isinstance(d, Form) and not isinstance(matrix, Form):
        return d.each(lambda a: matrix * a)
    return matrix * d
