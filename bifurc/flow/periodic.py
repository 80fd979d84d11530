"""Sums of harmonics of one angle, as rows of coefficients: derivatives, extrema, first zero after an angle, integrals.

A row ``c`` stands for c[0] + sum over i of c[1 + 2 i] cos(k_i theta) + c[2 + 2 i] sin(k_i theta).
"""
import numpy as np

EPS = np.finfo(float).eps
NOISE = 64.0 * EPS  # of the sum of the terms: values below it are zero
ORDER = 16  # derivatives that are looked at


def states(harmonics, theta) -> np.ndarray:
    """Return 1, cos, sin, ... at angles, shape (*theta.shape, nw)."""
    angle = np.multiply.outer(np.asarray(theta, float), np.array(harmonics, float))
    found = np.ones((*np.shape(theta), 1 + 2 * len(harmonics)))
    found[..., 1::2], found[..., 2::2] = np.cos(angle), np.sin(angle)
    return found


def derivative(harmonics, c: np.ndarray) -> np.ndarray:
    """Return the derivative by the angle."""
    k = np.array(harmonics, float)
    d = np.zeros_like(c)
    d[1::2], d[2::2] = k * c[2::2], -k * c[1::2]
    return d


def sign_after(harmonics, c, size: float, theta: float) -> int:
    """Return the sign just after an angle: that of the value, or of its first derivative that is not zero to rounding.

    Parameters
    ----------
    c : ndarray, shape (nw,)
    size : float
        Sum of the sizes of the terms of the constant, which may be smaller itself.
    """
    w = states(harmonics, theta)
    k = np.repeat(np.array(harmonics, float), 2)
    weights = np.abs(c[1:])
    scale = size + weights.sum()
    for j in range(ORDER + 1):
        value = c @ w
        if abs(value) > NOISE * scale:
            return 1 if value > 0.0 else -1
        c = derivative(harmonics, c)
        scale = (weights * k ** (j + 1)).sum()
    return 0


def extrema(harmonics, c: np.ndarray) -> np.ndarray:
    """Return angles in [0, 2 pi) that contain all zeros of the derivative (some may be none)."""
    d = derivative(harmonics, c)
    return zeros(harmonics, d) if np.abs(d).max(initial=0.0) > 0.0 else np.empty(0)


def zeros(harmonics, c: np.ndarray) -> np.ndarray:
    """Return angles in [0, 2 pi) that contain all zeros (some may be none): eigenvalues of the companion matrix."""
    top = max(harmonics)
    p = np.zeros(2 * top + 1, complex)
    p[top] = c[0]
    for i, k in enumerate(harmonics):
        p[top - k] += 0.5 * (c[1 + 2 * i] - 1j * c[2 + 2 * i])  # of exp(i k theta), highest power first
        p[top + k] += 0.5 * (c[1 + 2 * i] + 1j * c[2 + 2 * i])
    large = np.flatnonzero(np.abs(p) > EPS * np.abs(p).max())
    p = p[large[0]:large[-1] + 1]
    if p.size < 2:
        return np.empty(0)
    found = np.roots(p)
    angles = np.angle(found[np.abs(np.abs(found) - 1.0) < 1e-3])
    d = derivative(harmonics, c)
    polished = angles.copy()
    for _ in range(3):
        w = states(harmonics, polished)
        slope = w @ d
        step = np.divide(w @ c, slope, out=np.zeros_like(slope), where=slope != 0.0)
        polished = polished - np.clip(step, -1e-3, 1e-3)
    return np.concatenate((angles, polished)) % (2.0 * np.pi)


def first_zero(harmonics, c: np.ndarray, size: float, start: float, end: float) -> float | None:
    """Return the first angle in [start, end] where the sum becomes positive; None: nowhere.

    Between neighbouring extrema the sum is monotone, so that no zero is lost; extrema that are zero to rounding are touches
    and no zeros.  The sum must not be positive just after ``start``.
    """
    if not harmonics or not np.abs(c[1:]).max() > 0.0:
        return None
    turn = 2.0 * np.pi
    inner = start + (extrema(harmonics, c) - start) % turn
    points = np.unique(np.concatenate(([start], inner[inner < end], [end])))
    values = states(harmonics, points) @ c
    noise = NOISE * (size + np.abs(c[1:]).sum())
    above = np.flatnonzero(values[1:] > noise)
    if not above.size:
        return None
    i = above[0]
    a, b, va, vb = points[i], points[i + 1], values[i], values[i + 1]
    if va >= -noise and i > 0:
        return float(a)
    d = derivative(harmonics, c)
    x = a - va * (b - a) / (vb - va)
    for _ in range(100):  # Newton inside the bracket, bisection where it leaves it
        w = states(harmonics, x)
        value, slope = w @ c, w @ d
        a, b = (a, x) if value > 0.0 else (x, b)
        new = x - value / slope if slope > 0.0 else 0.5 * (a + b)
        new = new if a < new < b else 0.5 * (a + b)
        if abs(new - x) <= 2.0 * EPS * max(1.0, abs(x)):
            return float(new)
        x = new
    return float(x)


def product(harmonics, pairs) -> tuple[tuple[int, ...], np.ndarray]:
    """Return the sum of products of pairs of sums: its harmonics and coefficients."""
    top = max(harmonics, default=0)
    total = np.zeros(4 * top + 1, complex)
    for a, b in pairs:
        total += np.convolve(_complex(harmonics, a, top), _complex(harmonics, b, top))
    wide = tuple(range(1, 2 * top + 1))
    c = np.zeros(1 + 4 * top)
    c[0] = total[2 * top].real
    c[1::2], c[2::2] = 2.0 * total[2 * top + 1:].real, -2.0 * total[2 * top + 1:].imag
    return wide, c


def product_integral(harmonics, a: np.ndarray, b: np.ndarray, start: float, end: float) -> float:
    """Return the integral of the product of two sums over the angle, in closed form."""
    top = max(harmonics, default=0)
    p, q = (_complex(harmonics, c, top) for c in (a, b))
    product = np.convolve(p, q)  # of exp(i m theta), m = -2 top .. 2 top
    m = np.arange(-2 * top, 2 * top + 1)
    total = product[2 * top].real * (end - start)
    for j in np.flatnonzero(m):
        # exp(i m end) - exp(i m start) without cancellation
        wave = 2j * np.sin(0.5 * m[j] * (end - start)) * np.exp(0.5j * m[j] * (end + start))
        total += (product[j] * wave / (1j * m[j])).real
    return float(total)


def _complex(harmonics, c: np.ndarray, top: int) -> np.ndarray:
    """Return the factors of exp(i m theta), m = -top .. top."""
    p = np.zeros(2 * top + 1, complex)
    p[top] = c[0]
    for i, k in enumerate(harmonics):
        p[top + k] += 0.5 * (c[1 + 2 * i] - 1j * c[2 + 2 * i])
        p[top - k] += 0.5 * (c[1 + 2 * i] + 1j * c[2 + 2 * i])
    return p
