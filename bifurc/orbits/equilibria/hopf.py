"""First Lyapunov coefficient of a Hopf point, from derivatives of the vector field along a few directions.

With the eigenvectors A q = i w q, A^T p = -i w p, <p, q> = 1 and the multilinear forms B, C of second and third derivatives
(Kuznetsov 2004, eq. 5.39),

    c1 = <p, C(q, q, q*) - 2 B(q, A^-1 B(q, q*)) + B(q*, (2 i w - A)^-1 B(q, q))> / 2,      z' = i w z + c1 z |z|^2,

and the amplitude r = 2 |q_i| |z| of coordinate i obeys r' = Re(c1) r^3 / (4 |q_i|^2).  The forms come from polynomials
through the field at Chebyshev points on a line; of the radii that are tried the one counts whose results change least.
"""
import numpy as np

from ...compose.natural import natural_length

DEGREE = 10
RADII = 0.5 ** np.arange(1, 9)  # of the natural size, tried in turn
IMAGINARY = 1e-5  # real over imaginary part of the pair at a Hopf point, at most


def lyapunov_coefficient(equilibrium, dof: int) -> float:
    """Return l1 in the amplitude of coordinate ``dof``, see `Equilibrium.lyapunov_coefficient`."""
    A, Z, read = equilibrium._small
    omega, q, p = critical_pair(A)
    y = equilibrium.state
    size = max(natural_length(equilibrium.field.tables), float(np.abs(y).max()))
    values = []
    for radius in RADII * size:
        forms = Forms(lambda c: read @ equilibrium.field.rate(y + Z @ c), len(A), radius)
        try:
            values.append(_coefficient(forms, A, omega, q, p))
        except (ArithmeticError, ValueError):  # the law does not reach so far
            continue
    values = [value for value in values if np.isfinite(value)]
    if len(values) < 2:
        raise ValueError("the force laws are not defined near the Hopf point; l1 is not known")
    best = int(np.argmin(np.abs(np.diff(values))))
    return float(values[best] / (4.0 * abs(Z[dof] @ q) ** 2))


def critical_pair(A):
    """Return frequency, right and left eigenvector (k,), <p, q> = 1, of the imaginary pair of a matrix.

    Raises
    ------
    ValueError
        When no pair is imaginary.
    """
    values, vectors = np.linalg.eig(A)
    pairs = np.flatnonzero(values.imag > 0.0)
    if not pairs.size:
        raise ValueError("no pair of eigenvalues is complex: this is no Hopf point")
    k = pairs[np.argmin(np.abs(values[pairs].real) / values[pairs].imag)]
    if abs(values[k].real) > IMAGINARY * values[k].imag:
        raise ValueError(f"the pair nearest to the imaginary axis is {values[k]:.6g}: this is no Hopf point")
    left, others = np.linalg.eig(A.T)
    p = others[:, np.argmin(np.abs(left - np.conj(values[k])))]
    q = vectors[:, k]
    return float(values[k].imag), q, p / np.conj(np.vdot(p, q))


class Forms:
    """Second and third derivatives of a vector field along complex directions.

    Parameters
    ----------
    field : callable
        ``field(c) -> ndarray (k,)``.
    size : int
        k.
    radius : float
        Half the length of the lines on which it is sampled.
    """

    def __init__(self, field, size, radius):
        self.field, self.size, self.radius = field, size, radius
        angle = np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1)
        self._nodes = np.cos(angle)
        self._fit = np.linalg.inv(np.polynomial.chebyshev.chebvander(self._nodes, DEGREE))

    def along(self, direction) -> np.ndarray:
        """Return the second and third derivative (2, k) along a real direction (k,)."""
        length = float(np.abs(direction).max())
        if length == 0.0:
            return np.zeros((2, self.size))
        values = np.array([self.field(self.radius * t * direction / length) for t in self._nodes])
        power = np.zeros((DEGREE + 1, self.size))
        for k, column in enumerate((self._fit @ values).T):
            found = np.polynomial.chebyshev.cheb2poly(column)  # leaves out the zeros it would end with
            power[: len(found), k] = found
        scale = length / self.radius
        return np.array([2.0 * power[2] * scale**2, 6.0 * power[3] * scale**3])

    def B(self, u, v) -> np.ndarray:
        """Return the bilinear form at complex directions: of two that are as long, since in small units of length one may be longer
        by many digits."""
        out = np.zeros(self.size, complex)
        for a, wa in ((u.real, 1.0), (u.imag, 1j)):
            for b, wb in ((v.real, 1.0), (v.imag, 1j)):
                one, two = float(np.abs(a).max()), float(np.abs(b).max())
                if one > 0.0 and two > 0.0:
                    plus, minus = a / one + b / two, a / one - b / two
                    out += wa * wb * 0.25 * one * two * (self.along(plus)[0] - self.along(minus)[0])
        return out

    def C(self, q) -> np.ndarray:
        """Return C(q, q, q*) of the trilinear form."""
        a, b = q.real, q.imag
        aaa, bbb = self.along(a)[1], self.along(b)[1]
        plus, minus = self.along(a + b)[1], self.along(a - b)[1]
        aab = (plus - minus - 2.0 * bbb) / 6.0
        abb = (plus + minus - 2.0 * aaa) / 6.0
        return aaa + abb + 1j * (aab + bbb)


def _coefficient(forms, A, omega, q, p) -> float:
    h11 = np.linalg.solve(A.astype(complex), forms.B(q, q.conj()))
    h20 = np.linalg.solve(2j * omega * np.eye(len(A)) - A, forms.B(q, q))
    total = forms.C(q) - 2.0 * forms.B(q, h11) + forms.B(q.conj(), h20)
    return 0.5 * float(np.vdot(p, total).real)
