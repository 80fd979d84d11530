"""Monodromy matrix of (q, v, memory) along a harmonic motion: what a small perturbation becomes after one period.

    M dq'' + C dq' + K dq = sum R^T (f_u R dq + f_s R dq' + f_z dz),   dz' = 0

Between events the coefficients of contacts are constant and the propagator is one matrix exponential: exact.  At an event a
mode that slaves its memory writes it, dz = z_u R dq + z_s R dq' + z' dt, with the shift dt = -dg/g' of the event itself: a
slider is perturbed with the displacement at the start of stick.  Where the force jumps, dv jumps by M^-1 R^T (f- - f+) dt.
Laws have coefficients that vary in time; a Magnus series of order six with three Gauss nodes a step carries them (Blanes,
Casas and Ros, BIT 40 (2000) 434, eq. 3.14).
"""
import numpy as np

from .._jit import njit
from ..solve.dense import lu, lu_solve
from .march import AFTER, FOLLOWED, GUARD, MODE, WROTE, expression, guard_of, width
from .parts import Numbers, Shape
from .residual import Grid, Room, followed, motion, unpacked
from .waves import jet, powers, size

TAYLOR = 13  # terms of the exponential of a matrix of norm at most a half: 6e-16
NODES = np.array([0.5 - np.sqrt(15.0) / 10.0, 0.5, 0.5 + np.sqrt(15.0) / 10.0])  # Gauss, in a step
JUMP = 1e-9  # relative: a force or memory that is continuous across an event but for rounding
GRAZE = 1e-9  # rate of a guard, relative to its size, below which the shift of its event has no derivative


@njit
def product(a, b, out):
    """Write a b (square matrices) into ``out``."""
    n = a.shape[0]
    for i in range(n):
        for j in range(n):
            out[i, j] = 0.0
        for k in range(n):
            x = a[i, k]
            if x != 0.0:
                for j in range(n):
                    out[i, j] += x * b[k, j]


@njit
def exponential(a, out):
    """Write the exponential of ``a`` (n, n) into ``out``: Taylor series after scaling, then squaring."""
    n = a.shape[0]
    norm = 0.0
    for i in range(n):
        total = 0.0
        for j in range(n):
            total += abs(a[i, j])
        norm = max(norm, total)
    halvings = 0
    while norm > 0.5 and halvings < 60:
        norm *= 0.5
        halvings += 1
    small = a * 0.5**halvings
    term, room = np.eye(n), np.empty((n, n))
    out[:] = np.eye(n)
    for k in range(1, TAYLOR + 1):
        product(term, small, room)
        for i in range(n):
            for j in range(n):
                term[i, j] = room[i, j] / k
                out[i, j] += term[i, j]
    for _ in range(halvings):
        product(out, out, room)
        out[:] = room


@njit
def commutator(a, b, out, room):
    """Write a b - b a into ``out``."""
    product(a, b, out)
    product(b, a, room)
    out -= room


@njit
def magnus(A, h, out):
    """Write the propagator over a step ``h`` from the generators ``A`` (3, n, n) at its Gauss nodes."""
    n = A.shape[1]
    first = h * A[1]
    second = (np.sqrt(15.0) / 3.0 * h) * (A[2] - A[0])
    third = (10.0 / 3.0 * h) * (A[2] - 2.0 * A[1] + A[0])
    c1, c2, last, room = np.empty((n, n)), np.empty((n, n)), np.empty((n, n)), np.empty((n, n))
    commutator(first, second, c1, room)
    commutator(first, 2.0 * third + c1, c2, room)
    commutator(-20.0 * first - third + c1, second - c2 / 60.0, last, room)
    exponential(first + third / 12.0 + last / 240.0, out)


@njit
def cuts_of(paths, ends, counts, steps):
    """Return the phases (count,) at which contacts have events, with 0, 2 pi and ``steps`` equal parts of the period."""
    total = 1 + steps
    for k in range(len(counts)):
        total += counts[k, 0]
    out = np.empty(total)
    n = 0
    for j in range(steps + 1):
        out[n] = 2.0 * np.pi * j / steps
        n += 1
    for k in range(len(counts)):
        for i in range(counts[k, 0] - 1):
            out[n] = ends[k, i, 0]
            n += 1
    out = np.sort(out[:n])
    m = 1
    for i in range(1, n):
        if out[i] > out[m - 1]:
            out[m] = out[i]
            m += 1
    return out[:m]


@njit
def without_laws(shape: Shape, flat, x, grid: Grid, room: Room, out, kept):
    """Follow the contacts along the packed motion ``x`` and write its monodromy matrix: one call, for scenes without laws.

    ``kept`` (2 n + memories,) is overwritten: 1 for states, 0 for memory that is not written. Returns as `monodromy`, and
    -1 where the contacts cannot be followed.
    """
    nr, mi, n = len(shape.R), shape.waves.size, shape.dims[0]
    T = unpacked(flat, shape)
    c, v, cp, vp = np.empty((nr, mi)), np.empty((nr, mi)), np.empty((nr, mi)), np.empty((nr, mi))
    motion(shape, flat, np.zeros_like(flat), x, c, v, cp, vp)
    if followed(shape, T, 0, grid.cosines, grid.sines, c, v, room.paths, room.ends, room.zs, room.sources, room.counts) != FOLLOWED:
        return -1
    states(shape, room.paths, room.counts, kept)
    none = np.empty((0, n, n))
    return monodromy(shape, T, room.paths, room.ends, room.zs, room.counts, c, v, cuts_of(room.paths, room.ends, room.counts, 1),
                     none, none, out)


@njit
def states(shape: Shape, paths, counts, kept):
    """Mark in ``kept`` what is a state: q, v, and memory that is written in the period."""
    start = 2 * shape.dims[0]
    kept[:start] = 1
    for k in range(shape.modes.size):
        for z in range(shape.memory[k]):
            kept[start + z] = 0
            for i in range(counts[k, 0]):
                wrote = paths[k, i, WROTE]
                if wrote >= 0 and shape.slaved[k, wrote, z]:
                    kept[start + z] = 1
        start += shape.memory[k]


@njit
def monodromy(shape: Shape, T: Numbers, paths, ends, zs, counts, c, v, cuts, KL, CL, out):
    """Write the monodromy matrix (2 n + memories) into ``out``; return 1, or 0 where an event grazes and it has none.

    Parameters
    ----------
    paths, ends, zs, counts
        Segments of the contacts as `march.exact` writes them.
    c, v : (nr, mi)
        Coefficients of the rows' coordinates and speeds.
    cuts : (S + 1,)
        Phases from 0 to 2 pi that hold every event, see `cuts_of`.
    KL, CL : (3 S, n, n) or empty
        What laws add to -K and -C at the Gauss nodes of every step.
    """
    n, nc = shape.dims[0], shape.modes.size
    size_all = out.shape[0]
    P = np.eye(size_all)
    E, room = np.empty((size_all, size_all)), np.empty((size_all, size_all))
    A = np.zeros((3, size_all, size_all))
    mass, pivot, column = T.M.copy(), np.empty(n, np.int64), np.empty(n)
    sign, _ = lu(mass, pivot)
    if sign == 0.0:
        return 0
    offset = np.empty(nc, np.int64)
    start = 2 * n
    for k in range(nc):
        offset[k] = start
        start += shape.memory[k]
    at = np.zeros(nc, np.int64)
    stale = True
    law = KL.shape[0] > 0
    nodes = 3 if law else 1
    for j in range(cuts.size - 1):
        h = (cuts[j + 1] - cuts[j]) / T.omega[0]
        if stale or law:
            for g in range(nodes):
                generator(shape, T, paths, at, offset, KL, CL, 3 * j + g, mass, pivot, column, A[g])
            stale = False
        if law:
            magnus(A, h, E)
        else:
            exponential(A[0] * h, E)
        product(E, P, room)
        P[:] = room
        if j == cuts.size - 2:
            break
        for k in range(nc):
            while at[k] < counts[k, 0] - 1 and ends[k, at[k], 0] <= cuts[j + 1]:
                i = at[k]
                if event(shape, T, k, paths[k, i], ends[k, i, 0], zs[k, i], zs[k, i + 1], offset[k], c, v, mass, pivot, P) == 0:
                    return 0
                at[k] += 1
                stale = True
    out[:] = P
    return 1


@njit
def generator(shape: Shape, T: Numbers, paths, at, offset, KL, CL, node, mass, pivot, column, A):
    """Write the linear generator of (q, v, z) in the present modes into ``A``."""
    n = shape.dims[0]
    A[:] = 0.0
    for i in range(n):
        A[i, n + i] = 1.0
    force = A[n:2 * n]
    for a in range(n):
        for b in range(n):
            force[a, b] = -T.K[a, b]
            force[a, n + b] = -T.C[a, b]
            if KL.shape[0] > 0:
                force[a, b] += KL[node, a, b]
                force[a, n + b] += CL[node, a, b]
    for k in range(at.size):
        m, Q = paths[k, at[k], MODE], width(shape, k)
        for q in range(Q):
            R = shape.R[shape.rows[k, q]]
            for p in range(Q):
                S = shape.R[shape.rows[k, p]]
                fu, fs = T.FU[k, m, q, p], T.FS[k, m, q, p]
                if fu != 0.0 or fs != 0.0:
                    for a in range(n):
                        for b in range(n):
                            force[a, b] += R[a] * fu * S[b]
                            force[a, n + b] += R[a] * fs * S[b]
            for i in range(shape.memory[k]):
                for a in range(n):
                    force[a, offset[k] + i] += R[a] * T.FZ[k, m, q, i]
    for j in range(A.shape[1]):
        for a in range(n):
            column[a] = force[a, j]
        lu_solve(mass, pivot, column)
        for a in range(n):
            force[a, j] = column[a]


@njit
def gradient(shape: Shape, U, S, Z, k, offset, P, out):
    """Write the perturbation (columns of ``P``) of an affine expression of the rows, speeds and memory of contact ``k``."""
    n = shape.dims[0]
    out[:] = 0.0
    for q in range(width(shape, k)):
        R = shape.R[shape.rows[k, q]]
        for a in range(n):
            x, y = U[q] * R[a], S[q] * R[a]
            if x != 0.0 or y != 0.0:
                for j in range(out.size):
                    out[j] += x * P[a, j] + y * P[n + a, j]
    for i in range(Z.size):
        if Z[i] != 0.0:
            for j in range(out.size):
                out[j] += Z[i] * P[offset + i, j]


@njit
def event(shape: Shape, T: Numbers, k, path, phase, before, after, offset, c, v, mass, pivot, P):
    """Apply an event of contact ``k`` to the perturbations ``P``; return 0 where its shift has no derivative."""
    n, rate, Q, Z = shape.dims[0], T.omega[0], width(shape, k), shape.memory[k]
    m, g, b = path[MODE], path[GUARD], path[AFTER]
    a = np.empty(c.shape[1])
    p = np.empty((shape.waves[-1] + 1, 2))
    powers(phase, p.shape[0], p)
    dz = np.zeros((Z, P.shape[1]))
    dt, row = np.zeros(P.shape[1]), np.empty(P.shape[1])
    guard_of(shape, T, k, m, g, c, v, before[:Z], a)
    speed = rate * jet(shape.waves, a, p)[1]
    regular = abs(speed) > GRAZE * rate * (size(a) + 1e-300)
    if regular:
        gradient(shape, T.GU[k, m, g], T.GS[k, m, g], T.GZ[k, m, g, :Z], k, offset, P, dt)
        dt *= -1.0 / speed
    wrote = path[WROTE] >= 0
    for i in range(Z):
        if wrote and shape.slaved[k, m, i]:
            gradient(shape, T.ZU[k, m, i], T.ZS[k, m, i], T.ZU[k, m, i, :0], k, offset, P, row)
            expression(T.ZU[k, m, i], T.ZS[k, m, i], before[:0], T.ZH[k, m, i], shape.rows[k], Q, shape.excited, c, v,
                       before[:0], a)
            moving = rate * jet(shape.waves, a, p)[1]
            if abs(moving) > JUMP * rate * (size(a) + 1e-300):
                if not regular:
                    return 0
                row += moving * dt
            dz[i] = row
        else:
            dz[i] = P[offset + i]
    for q in range(Q):
        own = shape.rows[k, q]
        expression(T.FU[k, m, q], T.FS[k, m, q], T.FZ[k, m, q, :Z], T.FH[k, m, q], shape.rows[k], Q, shape.excited, c, v,
                   before[:Z], a)
        old, bound = jet(shape.waves, a, p)[0], size(a)
        expression(T.FU[k, b, q], T.FS[k, b, q], T.FZ[k, b, q, :Z], T.FH[k, b, q], shape.rows[k], Q, shape.excited, c, v,
                   after[:Z], a)
        jump = old - jet(shape.waves, a, p)[0]
        if abs(jump) > JUMP * (bound + size(a) + 1e-300):
            if not regular:
                return 0
            push = np.empty(n)
            for i in range(n):
                push[i] = shape.R[own, i] * jump
            lu_solve(mass, pivot, push)
            for i in range(n):
                for j in range(P.shape[1]):
                    P[n + i, j] += push[i] * dt[j]
    for i in range(Z):
        P[offset + i] = dz[i]
    return 1
