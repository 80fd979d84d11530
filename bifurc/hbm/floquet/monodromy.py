"""Monodromy matrix of (q, v, memory) along a harmonic motion: what a small perturbation becomes after one period.

    M dq'' + C dq' + K dq = sum R^T (f_u R dq + f_s R dq' + f_z dz),   dz' = 0

Between events the coefficients of contacts are constant and the propagator is one matrix exponential: exact.  At an event a
mode that slaves its memory writes it, dz = z_u R dq + z_s R dq' + z' dt, with the shift dt = -dg/g' of the event itself: a
slider is perturbed with the displacement at the start of stick.  Where the force jumps, dv jumps by M^-1 R^T (f- - f+) dt.
Laws have coefficients that vary in time; a Magnus series of order six with three Gauss nodes a step carries them (Blanes,
Casas and Ros, BIT 40 (2000) 434, eq. 3.14).

One file, because stretches, their exponentials and the jumps between them make one product.
"""
from typing import NamedTuple

import numpy as np

from ..._jit import both, leaf, njit
from ...solve.dense import lu, lu_solve
from ..contacts.common import AFTER, FOLLOWED, GUARD, MODE, WROTE, Contact, expression, guard_of
from ..residual import followed_in, moved_rows, work
from ..tables import (
    ALGEBRAIC,
    CONTACTS,
    DOFS,
    EXCITED,
    HEAD,
    INTERNAL,
    MEMORIES,
    MEMORY,
    PAIRS,
    ROWS,
    WIDTH,
    core,
    expressions,
    numbers_at,
    structure,
)
from ..waves import jet, powers, size

TAYLOR = 1.0 / np.cumprod(np.array([1.0, *range(1, 14)]))  # of the exponential of a matrix of norm at most a half: 6e-16
NODES = np.array([0.5 - np.sqrt(15.0) / 10.0, 0.5, 0.5 + np.sqrt(15.0) / 10.0])  # Gauss, in a step
JUMP = 1e-9  # relative: a force or memory that is continuous across an event but for rounding
GRAZE = 1e-9  # rate of a guard, relative to its size, below which the shift of its event has no derivative


@leaf
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


@leaf
def identity(out):
    """Write the identity."""
    out[:] = 0.0
    for i in range(len(out)):
        out[i, i] = 1.0


@leaf
def exponential(small, out, room):
    """Write the exponential of ``small`` (n, n) into ``out``: Taylor series after scaling, then squaring.

    The series is a polynomial in the fourth power, with cubic ones as coefficients: six products of matrices in place of thirteen
    (Paterson and Stockmeyer 1973).  ``small`` and ``room`` (4, n, n) are overwritten.
    """
    n = small.shape[0]
    norm = 0.0
    for i in range(n):
        total = 0.0
        for j in range(n):
            total += abs(small[i, j])
        norm = max(norm, total)
    halvings = 0
    while norm > 0.5 and halvings < 60:
        norm *= 0.5
        halvings += 1
    two, three, four, made = room[0], room[1], room[2], room[3]
    for i in range(n):
        for j in range(n):
            small[i, j] *= 0.5**halvings
            made[i, j] = 0.0
    product(small, small, two)
    product(two, small, three)
    product(two, two, four)
    for first in range(12, -1, -4):
        if first < 12:
            product(out, four, made)
        c0, c1, c2, c3 = TAYLOR[first], TAYLOR[first + 1], 0.0, 0.0
        if first < 12:
            c2, c3 = TAYLOR[first + 2], TAYLOR[first + 3]
        for i in range(n):
            for j in range(n):
                out[i, j] = made[i, j] + (c1 * small[i, j] + (c2 * two[i, j] + c3 * three[i, j]))
            out[i, i] += c0
    for _ in range(halvings):
        product(out, out, made)
        for i in range(n):
            for j in range(n):
                out[i, j] = made[i, j]


@leaf
def similar(A, n, rate):
    """Change a matrix of (q, v, memory) into that of (q, v / rate, memory), in place.

    In the time that the excitation knows, entries are of one size: what an exponential is scaled by depends on no unit.
    """
    for i in range(n, 2 * n):
        for j in range(A.shape[0]):
            A[i, j] /= rate
    for j in range(n, 2 * n):
        for i in range(A.shape[0]):
            A[i, j] *= rate


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
    exponential(first + third / 12.0 + last / 240.0, out, np.empty((4, n, n)))


@both
def cuts_of(ends, counts, steps):
    """Return the phases (count,) at which contacts have events, with 0, 2 pi and ``steps`` equal parts of the period."""
    out = np.empty(1 + steps + np.sum(counts[:, 0]))
    return out[:cut(ends, counts, steps, out)]


@leaf
def cut(ends, counts, steps, out):
    """Do what `cuts_of` says, in ``out``, of which the number of phases is returned that are filled."""
    n = 0
    for j in range(steps + 1):
        out[n] = 2.0 * np.pi * j / steps
        n += 1
    for k in range(len(counts)):
        for i in range(counts[k, 0] - 1):
            j = n  # sorted by insertion
            while j > 0 and out[j - 1] > ends[k, i, 0]:
                out[j] = out[j - 1]
                j -= 1
            out[j] = ends[k, i, 0]
            n += 1
    m = 1
    for i in range(1, n):
        if out[i] > out[m - 1]:
            out[m] = out[i]
            m += 1
    return m


class Desk(NamedTuple):
    """Arrays that are overwritten while the perturbations of one motion are followed."""

    matrices: np.ndarray  # (7, size, size)
    mass: np.ndarray  # (n, n) its factors, and its rows' order
    pivot: np.ndarray
    at: np.ndarray  # int (nc,): the segment of each contact at the present phase
    cuts: np.ndarray
    rows: np.ndarray  # (2 + Z, size) perturbations: of an event's phase, of one memory, of all memory behind the event
    a: np.ndarray  # (mi,)
    p: np.ndarray  # (top + 1, 2)
    column: np.ndarray  # (n,)


@njit
def desk_of(S, room, size):
    """Return arrays to follow perturbations with."""
    n, mi, nc = S[DOFS], S[INTERNAL], S[CONTACTS]
    return Desk(np.empty((7, size, size)), np.empty((n, n)), np.empty(n, np.int64), np.empty(nc, np.int64),
                np.empty(2 + nc * room.ends.shape[1]), np.empty((S[MEMORIES] + 2, size)), np.empty(mi),
                np.empty((S[HEAD + mi - 1] + 1, 2)), np.empty(n))


@both
def states(S, paths, counts, kept):
    """Mark in ``kept`` (2 n + memories,) what is a state: q, v, and memory that is written in the period."""
    contacts, start = structure(S)[3], 2 * S[DOFS]
    kept[:start] = 1
    for k in range(len(contacts)):
        for z in range(contacts[k, contacts.shape[1] - 1, 0, MEMORY]):
            kept[start] = 0
            for i in range(counts[k, 0]):
                wrote = paths[k, i, WROTE]
                if wrote >= 0 and contacts[k, wrote, 0, ALGEBRAIC + z] > 0:
                    kept[start] = 1
            start += 1


@both
def along(S, R, numbers, xs, grid, room, out, kept, codes):
    """Write the monodromy matrices ``out`` (m, size, size) of the motions ``xs`` (m, n + 1) along a parameter, without laws.

    Parameters
    ----------
    S, R
        Structure, see `tables`, and rows.
    numbers, grid : tables.Series, tables.Grid
        Numbers of the system along the parameter; tables of the waves for exact events.
    kept : int (m, size)
        Overwritten: 1 for states, 0 for memory that is not written.
    codes : int (m,)
        Overwritten: 1, 0 where an event grazes and there is no matrix, -1 where the contacts cannot be followed.
    """
    flat, dflat = np.empty_like(numbers.base), np.empty_like(numbers.base)
    signals = np.empty((4, len(R), S[INTERNAL]))
    c, v, cp, vp = signals[0], signals[1], signals[2], signals[3]
    listed = np.full(len(room.counts), -1)
    size = xs.shape[1] - 1
    space, desk, line = work(S, grid, room), desk_of(S, room, kept.shape[1]), np.empty(S[INTERNAL])
    for i in range(len(xs)):
        numbers_at(numbers, xs[i, size], flat, dflat)
        moved_rows(S, R, flat, dflat, xs[i, :size], c, v, cp, vp, line)
        status = followed_in(S, flat, grid, c, v, listed, room, space)
        codes[i] = -1
        if status == FOLLOWED:
            states(S, room.paths, room.counts, kept[i])
            codes[i] = plain(S, R, flat, room, c, v, desk, out[i])


@leaf
def begun(S, flat, desk):
    """Factor the mass and put the contacts at phase 0; return whether the mass is regular."""
    M = core(S, flat)[0][0]
    for a in range(len(M)):
        for b in range(len(M)):
            desk.mass[a, b] = M[a, b]
    desk.at[:] = 0
    return lu(desk.mass, desk.pivot)[0] != 0.0


@leaf
def plain(S, R, flat, room, c, v, desk, P):
    """Write the monodromy matrix (2 n + memories) of a scene without laws into ``P``; return 1, or 0 where an event grazes."""
    A, E, last, none, cuts = desk.matrices[0], desk.matrices[1], desk.matrices[2], desk.matrices[:0], desk.cuts
    if not begun(S, flat, desk):
        return 0
    count = cut(room.ends, room.counts, 1, cuts)
    identity(P)
    for j in range(count - 1):
        generator(S, R, flat, room.paths, none, none, 0, desk, A)
        for i in range(len(A)):
            for k in range(len(A)):
                A[i, k] *= (cuts[j + 1] - cuts[j]) / flat[0]
        similar(A, S[DOFS], flat[0])
        exponential(A, E, desk.matrices[3:])
        similar(E, S[DOFS], 1.0 / flat[0])
        product(E, P, last)
        for i in range(len(P)):
            for k in range(len(P)):
                P[i, k] = last[i, k]
        if j < count - 2 and passed(S, R, flat, cuts[j + 1], room, c, v, desk, P) < 0:
            return 0
    return 1


@both
def with_laws(S, R, flat, room, c, v, cuts, KL, CL, P):
    """Write the monodromy matrix (2 n + memories) into ``P``; return 1, or 0 where an event grazes and it has none.

    Parameters
    ----------
    room : tables.Room
        With the segments of the contacts as `event_driven.exact` writes them.
    c, v : (nr, mi)
        Coefficients of the rows' coordinates and speeds.
    cuts : (S + 1,)
        Phases from 0 to 2 pi that hold every event, see `cuts_of`.
    KL, CL : (3 S, n, n)
        What laws add to -K and -C at the Gauss nodes of every step.
    """
    size = len(P)
    A, E, last = np.empty((3, size, size)), np.empty((size, size)), np.empty((size, size))
    desk = desk_of(S, room, size)
    if not begun(S, flat, desk):
        return 0
    identity(P)
    for j in range(cuts.size - 1):
        for g in range(3):
            generator(S, R, flat, room.paths, KL, CL, 3 * j + g, desk, A[g])
            similar(A[g], S[DOFS], flat[0])
        magnus(A, (cuts[j + 1] - cuts[j]) / flat[0], E)
        similar(E, S[DOFS], 1.0 / flat[0])
        product(E, P, last)
        P[:] = last
        if j < cuts.size - 2 and passed(S, R, flat, cuts[j + 1], room, c, v, desk, P) < 0:
            return 0
    return 1


@leaf
def passed(S, R, flat, phase, room, c, v, desk, P):
    """Apply the events up to a phase to the perturbations ``P`` and go on behind them; return -1 where one grazes, else 0."""
    waves, _, excited, contacts = structure(S)
    X, loose = expressions(S, flat)
    ends, zs, counts, at = room.ends, room.zs, room.counts, desk.at
    offset = 2 * S[DOFS]
    for k in range(len(contacts)):
        contact = Contact(waves, excited, contacts[k], X[k], loose[k], c, v)
        while at[k] < counts[k, 0] - 1 and ends[k, at[k], 0] <= phase:
            i = at[k]
            if event(contact, R, flat[0], room.paths[k, i], ends[k, i, 0], zs[k, i], zs[k, i + 1], offset, desk, P) == 0:
                return -1
            at[k] += 1
        offset += contacts[k, contacts.shape[1] - 1, 0, MEMORY]
    return 0


@leaf
def generator(S, R, flat, paths, KL, CL, node, desk, A):
    """Write the linear generator of (q, v, z) in the present modes into ``A``; ``KL``, ``CL`` may be empty."""
    n, nx, contacts = S[DOFS], S[EXCITED], structure(S)[3]
    X, (_, C, K), at, column = expressions(S, flat)[0], core(S, flat)[0], desk.at, desk.column
    A[:] = 0.0
    for i in range(n):
        A[i, n + i] = 1.0
    force = A[n:2 * n]
    for a in range(n):
        for b in range(n):
            force[a, b] = -K[a, b]
            force[a, n + b] = -C[a, b]
            if KL.shape[0] > 0:
                force[a, b] += KL[node, a, b]
                force[a, n + b] += CL[node, a, b]
    offset = 2 * n
    for k in range(at.size):
        m, own = paths[k, at[k], MODE], contacts[k, contacts.shape[1] - 1, 0]
        for q in range(own[WIDTH]):
            left, row = R[own[ROWS + q]], X[k, m, q]
            for p in range(own[WIDTH]):
                right = R[own[ROWS + p]]
                fu, fs = row[nx + 2 * p], row[nx + 2 * p + 1]
                if fu != 0.0 or fs != 0.0:
                    for a in range(n):
                        for b in range(n):
                            force[a, b] += left[a] * fu * right[b]
                            force[a, n + b] += left[a] * fs * right[b]
            for i in range(own[MEMORY]):
                for a in range(n):
                    force[a, offset + i] += left[a] * row[nx + 2 * own[PAIRS] + i]
        offset += own[MEMORY]
    for j in range(A.shape[1]):
        for a in range(n):
            column[a] = force[a, j]
        lu_solve(desk.mass, desk.pivot, column)
        for a in range(n):
            force[a, j] = column[a]


@leaf
def gradient(row, own, nx, memory, R, offset, P, out):
    """Write the perturbation (columns of ``P``) of an affine expression, with its first ``memory`` memories."""
    n = R.shape[1]
    out[:] = 0.0
    for q in range(own[WIDTH]):
        r = R[own[ROWS + q]]
        for a in range(n):
            x, y = row[nx + 2 * q] * r[a], row[nx + 2 * q + 1] * r[a]
            if x != 0.0 or y != 0.0:
                for j in range(out.size):
                    out[j] += x * P[a, j] + y * P[n + a, j]
    for i in range(memory):
        z = row[nx + 2 * own[PAIRS] + i]
        if z != 0.0:
            for j in range(out.size):
                out[j] += z * P[offset + i, j]


@leaf
def event(contact, R, rate, path, phase, before, after, offset, desk, P):
    """Apply an event of a contact to the perturbations ``P``; return 0 where its shift has no derivative."""
    waves, excited, A, X, _, _, _ = contact
    own, n, nx = A[A.shape[0] - 1, 0], R.shape[1], excited.size
    Z, slave = own[MEMORY], own[PAIRS] + A.shape[1] - 1
    m, g, b = path[MODE], path[GUARD], path[AFTER]
    a, p, push, dz = desk.a, desk.p, desk.column, desk.rows[2:]
    dt, row = desk.rows[0], desk.rows[1]
    powers(phase, p.shape[0], p)
    guard_of(contact, m, g, before[:Z], a)
    speed = rate * jet(waves, a, p)[1]
    regular = abs(speed) > GRAZE * rate * (size(a) + 1e-300)
    dt[:] = 0.0
    if regular:
        gradient(X[m, own[PAIRS] + g], own, nx, Z, R, offset, P, dt)
        for j in range(dt.size):
            dt[j] *= -1.0 / speed
    wrote = path[WROTE] >= 0
    for i in range(Z):
        if wrote and A[m, 0, ALGEBRAIC + i] > 0:
            gradient(X[m, slave + i], own, nx, 0 * Z, R, offset, P, row)
            expression(contact, X[m, slave + i], before[:0], a)
            moving = rate * jet(waves, a, p)[1]
            moves = abs(moving) > JUMP * rate * (size(a) + 1e-300)
            if moves and not regular:
                return 0
            for j in range(row.size):
                dz[i, j] = row[j] + moving * dt[j] if moves else row[j]
        else:
            for j in range(row.size):
                dz[i, j] = P[offset + i, j]
    for q in range(own[WIDTH]):
        expression(contact, X[m, q], before[:Z], a)
        old, bound = jet(waves, a, p)[0], size(a)
        expression(contact, X[b, q], after[:Z], a)
        jump = old - jet(waves, a, p)[0]
        if abs(jump) > JUMP * (bound + size(a) + 1e-300):
            if not regular:
                return 0
            for i in range(n):
                push[i] = R[own[ROWS + q], i] * jump
            lu_solve(desk.mass, desk.pivot, push)
            for i in range(n):
                for j in range(P.shape[1]):
                    P[n + i, j] += push[i] * dt[j]
    for i in range(Z):
        for j in range(P.shape[1]):
            P[offset + i, j] = dz[i, j]
    return 1
