"""Oil film of a short journal bearing that carries positive pressure only (Ocvirk 1952; Capone 1991)."""
import math
from dataclasses import dataclass

from .checks import number
from .element import Element
from .mode import Law, Mode
from .site import Rows


def film(x, y, xs, ys, size):
    """Force of the film on the journal, ``size`` times

        f = 2 int N (cos, sin) / h^3 over N < 0,   h = 1 - x cos - y sin,   N = (x - 2 y') sin - (y + 2 x') cos,

    in closed form: with a = x - 2 y', b = y + 2 x', rho = |(a, b)|, k = (x b - y a) / rho, c = -(x a + y b) / rho and
    q = 1 - x^2 - y^2.  At exact half-speed whirl (rho = 0) there is no pressure and no force; where there is no film
    (q <= 0) it is not a number.
    """
    a, b = x - 2.0 * ys, y + 2.0 * xs
    rho = math.hypot(a, b)
    if rho == 0.0:
        return 0.0, 0.0
    q = 1.0 - x * x - y * y
    if q <= 0.0:
        return math.nan, math.nan
    k, c = (x * b - y * a) / rho, -(x * a + y * b) / rho
    root = math.sqrt(q)
    G = 2.0 / root * (0.5 * math.pi + math.atan(k / root))
    U = rho * (2.0 + k * G) / q
    S = c / ((1.0 - c) * (1.0 + c))
    return -size * (3.0 * x * U + b * G + 2.0 * a * S) / q, -size * (3.0 * y * U - a * G + 2.0 * b * S) / q


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
    root = math.sqrt(q)
    G = 2.0 / root * (0.5 * math.pi + math.atan(k / root))
    V = (2.0 + k * G) / q
    U = rho * V
    S = c / ((1.0 - c) * (1.0 + c))
    turn = (1.0 + c * c) / ((1.0 - c) * (1.0 + c)) ** 2
    fx, fy = (3.0 * x * U + b * G + 2.0 * a * S) / q, (3.0 * y * U - a * G + 2.0 * b * S) / q

    # by x, y, a, b as if they were independent; (ca, cb) turns by (-cb, ca) w
    ka, kb = cb * c / rho, -ca * c / rho
    sa, sb = -cb * k / rho, ca * k / rho
    g = 2.0 / (q + k * k)
    Gx, Gy = g * (cb + k * x / q) + G * x / q, g * (-ca + k * y / q) + G * y / q
    Ga, Gb = g * ka, g * kb
    Ux = rho * (cb * G + k * Gx) / q + 2.0 * x * U / q
    Uy = rho * (-ca * G + k * Gy) / q + 2.0 * y * U / q
    Ua = ca * V + rho * (ka * G + k * Ga) / q
    Ub = cb * V + rho * (kb * G + k * Gb) / q
    Sx, Sy, Sa, Sb = -turn * ca, -turn * cb, turn * sa, turn * sb

    xx = (3.0 * U + 3.0 * x * Ux + b * Gx + 2.0 * a * Sx) / q + 2.0 * x * fx / q
    xy = (3.0 * x * Uy + b * Gy + 2.0 * a * Sy) / q + 2.0 * y * fx / q
    xa = (3.0 * x * Ua + b * Ga + 2.0 * S + 2.0 * a * Sa) / q
    xb = (3.0 * x * Ub + G + b * Gb + 2.0 * a * Sb) / q
    yx = (3.0 * y * Ux - a * Gx + 2.0 * b * Sx) / q + 2.0 * x * fy / q
    yy = (3.0 * U + 3.0 * y * Uy - a * Gy + 2.0 * b * Sy) / q + 2.0 * y * fy / q
    ya = (3.0 * y * Ua - G - a * Ga + 2.0 * b * Sa) / q
    yb = (3.0 * y * Ub - a * Gb + 2.0 * S + 2.0 * b * Sb) / q
    return (-size * (xx + xa), -size * (xy + xb), -size * 2.0 * xb, size * 2.0 * xa,
            -size * (yx + ya), -size * (yy + yb), -size * 2.0 * yb, size * 2.0 * ya)


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

    def site(self, n):
        """Return the rows of the journal."""
        rows = [[1.0 if i == dof else 0.0 for i in range(n)] for dof in (self.x, self.y)]
        return Rows.of(rows, n)

    def mode(self, key, core):
        """Return the only mode."""
        return Mode(force=Law(film, (self.size,), film_slope))
