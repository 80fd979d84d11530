"""Euler-Bernoulli beams of two coordinates a node: models whose frequencies and statics are known."""
import numpy as np
from scipy.optimize import brentq

FIRST = {"clamped": 0.5, "pinned": 1.0, "free": 1.5}  # beta L / pi of the first bending mode, about


def beam(count, ends="clamped", length=1.0, bending=1.0, inertia=1.0):
    """Return M, K, names of a beam of bending stiffness and mass a length: clamped at the left, pinned at both ends, or free."""
    h, n = length / count, 2 * (count + 1)
    M, K = np.zeros((n, n)), np.zeros((n, n))
    k = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]]) * bending / h**3
    m = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]) * inertia * h / 420.0
    turn = np.array([1.0, h, 1.0, h])
    for e in range(count):
        part = slice(2 * e, 2 * e + 4)
        K[part, part] += k * np.outer(turn, turn)
        M[part, part] += m * np.outer(turn, turn)
    names = [(node if node < count else "tip", direction) for node in range(count + 1) for direction in ("uy", "rz")]
    out = {"clamped": (0, 1), "pinned": (0, n - 2), "free": ()}[ends]
    left = [place for place in range(n) if place not in out]
    return M[np.ix_(left, left)], K[np.ix_(left, left)], [names[place] for place in left]


def cantilever(count=20):
    """Return M, K (2 count, 2 count) and names for unit length, bending stiffness and mass a length."""
    return beam(count)


def wave_numbers(ends, count):
    """Return beta L of the first bending modes: cos x cosh x = -1, sin x = 0, cos x cosh x = 1."""
    about = np.pi * (np.arange(count) + FIRST[ends])
    if ends == "pinned":
        return about
    sign = 1.0 if ends == "clamped" else -1.0
    return np.array([brentq(lambda x: np.cos(x) + sign / np.cosh(x), x - 0.4, x + 0.4, xtol=1e-14) for x in about])
