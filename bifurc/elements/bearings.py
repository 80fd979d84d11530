"""Oil film of a short journal bearing that carries positive pressure only (Ocvirk 1952; Capone 1991)."""
import math
from dataclasses import dataclass

from ..checks import number, whole
from .element import Element
from .mode import Law, Mode
from .site import Rows

TERMS = 26  # of the series of `film_parts`: 4^-26 is rounding


def film_parts(k, c, q):
    """Return n1, n2 of the film and the derivatives n1_k = -n2_c, n1_c, n2_k, with q = 1 - k^2 - c^2 and

        G = (2 / sqrt(q)) (pi/2 + atan(k / sqrt(q))),    V = (2 + k G) / q = dG/dk,    n2 = (G + 3 k V) / q = dV/dk,
        n1 = c (2 / (q + k^2) - 3 V) / q = -dV/dc.

    For k < 0 these are differences that almost vanish as q does.  With w = q / k^2 they are then the alternating series
    g = sum 4 j (-w)^(j - 1) / ((2 j + 1) (2 j + 3)), n2 = -2 g / k^3, and what follows from it.
    """
    if k < 0.0 and q < 0.25 * k * k:
        s = -k
        w = q / (s * s)
        g = g1 = 0.0
        for j in range(TERMS, 0, -1):
            g1 = -(g + w * g1)
            g = 4.0 * j / ((2.0 * j + 1.0) * (2.0 * j + 3.0)) - w * g
        p = g + (1.0 - w * g) / (3.0 + w) - 1.0 / (1.0 + w)
        p1 = (g1 - 2.0 * p) / (1.0 + w)
        two, share = 2.0 / (s * s), c / s
        four = two / (s * s)
        return (four * c * p, two * g / s, 2.0 * four * share * g1, four * (p - 2.0 * share * share * p1),
                four * (3.0 * g + 2.0 * (1.0 + w) * g1))
    root, rest = math.sqrt(q), q + k * k
    G = 2.0 / root * math.atan2(root, -k)
    V = (2.0 + k * G) / q
    left = 2.0 / rest - 3.0 * V
    n1, n2 = c * left / q, (G + 3.0 * k * V) / q
    return (n1, n2, (2.0 * k * n1 - 3.0 * c * n2) / q, (left + 4.0 * c * c / (rest * rest) + 5.0 * c * n1) / q,
            (4.0 * V + 5.0 * k * n2) / q)


def film(x, y, xs, ys, size):
    """Force of the film on the journal, ``size`` times

        f = 2 int N (cos, sin) / h^3 over N < 0,   h = 1 - x cos - y sin,   N = (x - 2 y') sin - (y + 2 x') cos,

    in closed form: with a = x - 2 y', b = y + 2 x', rho = |(a, b)|, k = (x b - y a) / rho, c = -(x a + y b) / rho,
    f = -(a n1 + b n2, b n1 - a n2), see `film_parts`.  At exact half-speed whirl (rho = 0) there is no pressure and no force;
    where there is no film (q <= 0) it is not a number.
    """
    a, b = x - 2.0 * ys, y + 2.0 * xs
    rho = math.hypot(a, b)
    if rho == 0.0:
        return 0.0, 0.0
    q = 1.0 - x * x - y * y
    if q <= 0.0:
        return math.nan, math.nan
    n1, n2, _, _, _ = film_parts((x * b - y * a) / rho, -(x * a + y * b) / rho, q)
    return -size * (a * n1 + b * n2), -size * (b * n1 - a * n2)


def film_slope(x, y, xs, ys, size):
    """Derivatives of `film`; at exact half-speed whirl, where it has a corner unless x = y = 0, the mean of those on two
    opposite sides."""
    a, b = x - 2.0 * ys, y + 2.0 * xs
    rho = math.hypot(a, b)
    q = 1.0 - x * x - y * y
    if q <= 0.0:
        return math.nan, math.nan, math.nan, math.nan, math.nan, math.nan, math.nan, math.nan
    if rho == 0.0:
        half = size * math.pi / (q * math.sqrt(q))
        xa, xb = half * 3.0 * x * y / q, -half * (1.0 + 3.0 * x * x / q)
        ya, yb = half * (1.0 + 3.0 * y * y / q), -half * 3.0 * x * y / q
        return xa, xb, 2.0 * xb, -2.0 * xa, ya, yb, 2.0 * yb, -2.0 * ya
    ca, cb = a / rho, b / rho
    k, c = x * cb - y * ca, -(x * ca + y * cb)
    n1, n2, n1k, n1c, n2k = film_parts(k, c, q)
    n2c = -n1k

    # by x, y, a, b as if they were independent: of P = rho n1 and Q = rho n2 in f = -(ca P + cb Q, cb P - ca Q); as (a, b) turns
    # by an angle, (k, c) changes by (-c, k) times that
    Px, Py = rho * (cb * n1k - ca * n1c), -rho * (ca * n1k + cb * n1c)
    Qx, Qy = rho * (cb * n2k - ca * n2c), -rho * (ca * n2k + cb * n2c)
    Pt, Qt = k * n1c - c * n1k, k * n2c - c * n2k
    Pa, Pb, Qa, Qb = ca * n1 - cb * Pt, cb * n1 + ca * Pt, ca * n2 - cb * Qt, cb * n2 + ca * Qt
    tx, ty = ca * n2 - cb * n1, ca * n1 + cb * n2  # what the angle does to the directions
    xa, xb = ca * Pa + cb * Qa - cb * tx, ca * Pb + cb * Qb + ca * tx
    ya, yb = cb * Pa - ca * Qa - cb * ty, cb * Pb - ca * Qb + ca * ty
    return (-size * (ca * Px + cb * Qx + xa), -size * (ca * Py + cb * Qy + xb), -size * 2.0 * xb, size * 2.0 * xa,
            -size * (cb * Px - ca * Qx + ya), -size * (cb * Py - ca * Qy + yb), -size * 2.0 * yb, size * 2.0 * ya)


@dataclass(frozen=True, kw_only=True)
class OilFilm(Element):
    """Short journal bearing with the positive half of the pressure (half-Sommerfeld).

    Coordinates are over the clearance, time is the angle of the shaft (spin 1).  The static force at the eccentricity e is
    4 e^2 / (1 - e^2)^2 against, pi e / (1 - e^2)^(3/2) across the displacement, times `size`.

    Parameters
    ----------
    x, y : int
        Degrees of freedom of the journal; below 1 in magnitude.
    size : float
        Factor of the force, above 0.

    References
    ----------
    F. W. Ocvirk, Short-bearing approximation for full journal bearings, NACA TN 2808 (1952).
    """

    x: int = 0
    y: int = 1
    size: float = 1.0

    isotropic = True

    def __post_init__(self):
        super().__post_init__()
        number(type(self).__name__, "size", self.size, above=0.0)
        whole(type(self).__name__, "x", self.x, least=0)
        whole(type(self).__name__, "y", self.y, least=0)

    def site(self, n):
        """Return the rows of the journal."""
        rows = [[1.0 if i == dof else 0.0 for i in range(n)] for dof in (self.x, self.y)]
        return Rows.of(rows, n)

    def mode(self, key, core):
        """Return the only mode."""
        return Mode(force=Law(film, (self.size,), film_slope))
