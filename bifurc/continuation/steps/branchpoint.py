"""Simple branch points: located by an unfolded system that tells a crossing from a near miss; their two directions.

At a branch point the wide Jacobian J loses one rank: kernel V (n+1, 2), left null vector w (n,).  The system

    F(x) + beta b = 0,      g_i(x) = w(x)^T J(x) V_i = 0   (i = 1, 2)

is regular there and also at the centre of a perturbed (imperfect) bifurcation, where beta is the size of the
perturbation: beta at rounding level is a crossing, anything else two branches that miss each other (Griewank & Reddien
1984; Govaerts 2000, section 8).  The directions solve the algebraic bifurcation equation
sum_ij w^T F_xx[V_i, V_j] a_i a_j = 0.
"""
import math
from dataclasses import dataclass

import numpy as np

from ...solve.bordered import factor, solve_factored

NEAR_MISS = 1e-11  # |beta| over the size of the Jacobian: above it the branches do not meet
DIFFERENCE = 1e-5  # of the Jacobian along a kernel vector, in scaled unknowns (central)
ITERATIONS = 15


@dataclass(slots=True)
class Crossing:
    """A located branch point ``x`` (n+1,) with its two unit directions (2, n+1) in scaled unknowns.

    ``error`` is the scaled distance to the true point; ``status``: "located", "near_miss", "failed".
    """

    status: str
    x: np.ndarray | None = None
    directions: np.ndarray | None = None
    error: float = math.inf


def locate_crossing(problem, x) -> Crossing:
    """Find the branch point near ``x`` (n+1,), own units.

    Parameters
    ----------
    problem : Problem
        ``residual``, ``jacobian`` and ``scale`` are used.
    x : ndarray (n + 1,)

    Returns
    -------
    Crossing
    """
    scale = problem.scale
    x = np.array(x, float)
    try:
        with np.errstate(all="ignore"):
            return _newton(problem, x, scale)
    except problem.errors:  # also of a decomposition that did not converge on NaN
        return Crossing("failed")


def wide(problem, x):
    """[F_u F_p] in scaled columns (n, n + 1)."""
    fu, fp = problem.jacobian(x[:-1], float(x[-1]))
    n = x.size - 1
    out = np.empty((n, n + 1))
    out[:, :-1] = np.reshape(fu, (n, n))
    out[:, -1] = np.reshape(fp, n)
    return out * problem.scale


def _newton(problem, x, scale):
    n = x.size - 1
    beta, size, floor = 0.0, math.inf, 64.0 * np.finfo(float).eps
    j = wide(problem, x)
    u, _, vt = np.linalg.svd(j)
    b, kernel = u[:, -1], vt[-2:]
    norm = None
    for _ in range(ITERATIONS):
        # [J b; K 0] bordered with the null vectors of the last point
        matrix = np.zeros((n + 2, n + 2))
        matrix[:n, :n + 1], matrix[:n, n + 1], matrix[n:, :n + 1] = j, b, kernel
        lu, pivots, sign, _ = factor(matrix)
        if sign == 0.0:
            return Crossing("failed")
        right = np.zeros((n + 2, 2))
        right[n, 0] = right[n + 1, 1] = 1.0
        columns = solve_factored(lu, pivots, right)
        v, g = columns[:n + 1], columns[n + 1]
        left = np.zeros(n + 2)
        left[n + 1] = 1.0
        w = np.linalg.solve(matrix.T, left)[:n]
        w_size = math.sqrt(float(w @ w))
        hessian = _second(problem, x, w, v)  # (2, n + 1): w^T F_xx[V_i, .]
        f = np.reshape(np.asarray(problem.residual(x[:-1], float(x[-1])), float), n)
        if norm is None:
            norm = max(float(np.abs(j).max()), float(np.abs(hessian).max()) / max(w_size, 1e-300))
        system = np.zeros((n + 2, n + 2))
        system[:n, :n + 1], system[:n, n + 1], system[n:, :n + 1] = j, b, -hessian
        step = np.linalg.solve(system, -np.concatenate([f + beta * b, g]))
        if not np.isfinite(step).all():
            return Crossing("failed")
        old, size = size, math.sqrt(float(step[:n + 1] @ step[:n + 1]))
        if size > 4.0:
            return Crossing("failed")
        x = x + scale * step[:n + 1]
        beta += float(step[n + 1])
        j = wide(problem, x)
        u, _, vt = np.linalg.svd(j)
        b = u[:, -1] * (1.0 if float(u[:, -1] @ b) >= 0.0 else -1.0)
        kernel = vt[-2:]
        rounding = floor * (1.0 + float(np.abs(x / scale).max()))
        if size <= rounding or (size < 1e-9 and size >= 0.25 * old):
            break
    else:
        if size > 1e-8:
            return Crossing("failed")
    if abs(beta) > NEAR_MISS * norm:
        return Crossing("near_miss", x)
    directions = _directions(problem, x, u[:, -1], kernel)
    if directions is None:
        return Crossing("near_miss", x)
    error = 4.0 * size + abs(beta) / norm + floor * (1.0 + float(np.abs(x / scale).max()))
    return Crossing("located", x, directions, error)


def _second(problem, x, w, v):
    """Rows w^T F_xx[V_i, .] (2, n + 1) by central differences of the Jacobian, scaled unknowns."""
    rows = []
    for i in range(v.shape[1]):
        length = math.sqrt(float(v[:, i] @ v[:, i]))
        h = DIFFERENCE / length
        move = h * problem.scale * v[:, i]
        rows.append(w @ (wide(problem, x + move) - wide(problem, x - move)) / (2.0 * h))
    return np.array(rows)


def _directions(problem, x, w, kernel):
    """Unit directions (2, n + 1) of the branches that cross at ``x``; None if the quadratic form has no real ones."""
    form = _second(problem, x, w, kernel.T) @ kernel.T
    a, b, c = form[0, 0], 0.5 * (form[0, 1] + form[1, 0]), form[1, 1]
    size = max(abs(a), abs(b), abs(c))
    discriminant = b * b - a * c
    if size == 0.0 or discriminant <= 1e-8 * size * size:
        return None
    root = math.sqrt(discriminant)
    # a y^2 + 2 b y z + c z^2 = 0 without cancellation: (y, z) = (-c, q) and (q, -a) with q = b + sign(b) root
    q = b + math.copysign(root, b)
    pairs = [np.array([-c, q]), np.array([q, -a])]
    found = []
    for pair in pairs:
        d = pair @ kernel
        found.append(d / math.sqrt(float(d @ d)))
    return np.array(found)


def first_direction(directions):
    """Of directions, the one along which the parameter changes most, with growing parameter."""
    d = max(directions, key=lambda direction: abs(direction[-1]))
    return d if d[-1] >= 0.0 else -d


def other_direction(directions, tangent):
    """Of the two directions, the one that is not the branch of ``tangent``."""
    along = np.abs(directions @ tangent)
    return directions[int(np.argmin(along))]
