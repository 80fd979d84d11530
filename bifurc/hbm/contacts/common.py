"""What following a contact along a given periodic motion needs, event by event (`exactly`) or at samples (`sampling`).

The motion of the contact's rows is a trigonometric polynomial, so that guards are too once memory is frozen or put in.
Rows are followed with c (nr, mi), the coefficients of the coordinates u, and v (nr, mi), those of the speeds s.  A contact
comes as ``A`` (modes + 1, guards + 1, columns), its structure, and ``X`` (modes, Q + G + Z, columns), its expressions: one
entry of each array that `tables.structure` and `tables.expressions` return.
"""
from typing import NamedTuple

import numpy as np

from ..._jit import leaf
from ..tables import ALGEBRAIC, CHOICE, COUNT, FORGETS, GUARDS, MEMORY, PAIRS, ROWS, THEN, TRIAL, WIDTH, WRITES
from ..waves import jet, powers, size

FOLLOWED, INCONSISTENT, TOO_MANY, NOT_SETTLED, NOT_FINITE = range(5)  # codes, see `ContactStatus`
PERIODS = 8  # most periods until memory has to repeat
ROUNDING = 1e-12  # of the size of a guard or its derivative (times the top harmonic): zero
REPEATS = 1e-11  # relative difference of memory after a period

# columns of a path: segments of one mode, in order, from 0 to 2 pi
MODE, GUARD, AFTER, WROTE = 0, 1, 2, 3  # mode, guard that ended it (-1: end of the period), successor, mode that wrote memory
FIELDS = 4
# columns of a source: mode that wrote the memory at phase 0 (-1: a virgin start) and phase of it; with touches: how near, as
# part of its size, the guard came that is next to touch (-inf: none), the number of events that were only counted, and how
# near a touch has to come (0: none is looked for); from there on `choices`, and those that an order asks for
WRITER, WRITTEN, NEXT, PASSED, TOUCHED, CHOSEN, ASKED = 0, 1, 2, 3, 4, 5, 8
SOURCE = 11
RESTING = 1e-4  # radians


class Contact(NamedTuple):
    """A contact along a motion of its rows."""

    waves: np.ndarray  # (mi,) harmonic of every internal slot
    excited: np.ndarray  # (nx,) slots of the excitation
    A: np.ndarray  # structure
    X: np.ndarray  # expressions
    loose: np.ndarray  # (Z, 2 Q) memory of a virgin start, from the means of coordinates and speeds
    c: np.ndarray  # (nr, mi) coefficients of coordinates
    v: np.ndarray  # (nr, mi) and of speeds


class Tabulated(NamedTuple):
    """The motion of all rows, and the excitation, on a grid of phases with both ends."""

    U: np.ndarray  # (nr, grid + 1) coordinates
    V: np.ndarray  # speeds
    dU: np.ndarray  # derivatives by phase
    dV: np.ndarray
    excite: np.ndarray  # (nx, grid + 1) columns of excitation
    dexcite: np.ndarray


class Segments(NamedTuple):
    """The stays of a contact in its modes over a period; kernels overwrite it."""

    path: np.ndarray  # int (most, FIELDS): mode, guard, successor and the mode that wrote memory at the end (-1: none)
    ends: np.ndarray  # (most, 2) phases of the end and of the writing
    zs: np.ndarray  # (most, Z) memory
    source: np.ndarray  # (SOURCE,)
    counts: np.ndarray  # int (2,): segments, and periods that were followed


class Space(NamedTuple):
    """Arrays that are overwritten as a contact is followed; as long as internal slots, guards, modes and memories."""

    scratch: np.ndarray  # (8, .)
    flags: np.ndarray  # int (3, .)
    p: np.ndarray  # (top + 1, 2)
    tables: np.ndarray  # (1 or 2, M, G, grid + 1) guards, and memory at samples


@leaf
def expression(contact, row, z, out):
    """Write an affine expression along the motion as a polynomial: ``out`` (mi,)."""
    _, excited, A, _, _, c, v = contact
    own = A[A.shape[0] - 1, 0]
    for j in range(out.size):
        out[j] = 0.0
    nx = excited.size
    for q in range(own[WIDTH]):
        r, a, b = own[ROWS + q], row[nx + 2 * q], row[nx + 2 * q + 1]
        if a != 0.0:
            for j in range(out.size):
                out[j] += a * c[r, j]
        if b != 0.0:
            for j in range(out.size):
                out[j] += b * v[r, j]
    for x in range(nx):
        out[excited[x]] += row[x]
    first = nx + 2 * own[PAIRS]
    for i in range(z.size):
        out[0] += row[first + i] * z[i]


@leaf
def slaves(contact, m, p, z, a):
    """Write the memory that mode ``m`` slaves, at the phase of the powers ``p``, into ``z``; ``a`` (mi,) is overwritten."""
    waves, _, A, X, _, _, _ = contact
    own = A[A.shape[0] - 1, 0]
    if A[m, 0, WRITES] <= 0:
        return
    first = own[PAIRS] + A.shape[1] - 1
    for i in range(own[MEMORY]):
        if A[m, 0, ALGEBRAIC + i] > 0:
            expression(contact, X[m, first + i], z[:0], a)
            z[i] = jet(waves, a, p)[0]


@leaf
def guard_of(contact, m, g, z, a):
    """Write guard ``g`` of mode ``m`` as a polynomial into ``a`` (mi,)."""
    expression(contact, contact.X[m, contact.A[contact.A.shape[0] - 1, 0, PAIRS] + g], z, a)


@leaf
def admissible(contact, m, z, p, slack, a):
    """Return whether mode ``m`` may hold from the phase of the powers ``p`` on; ``slack``: part of a guard that is forgiven."""
    waves = contact.waves
    top = waves[-1]
    for g in range(contact.A[m, 0, GUARDS]):
        guard_of(contact, m, g, z, a)
        j = jet(waves, a, p)
        bound = ROUNDING * (size(a) + 1e-300)
        if j[0] < -bound or 0.0 < j[0] < slack * size(a):
            continue
        if j[0] > bound:
            return False
        for order in range(1, 4):
            bound *= top
            if j[order] < -bound:
                break
            if j[order] > bound:
                return False
    return True


@leaf
def virgin(contact, z):
    """Write the memory of a virgin start, from the means of coordinates and speeds."""
    _, _, A, _, loose, c, v = contact
    own = A[A.shape[0] - 1, 0]
    for i in range(own[MEMORY]):
        z[i] = 0.0
        for q in range(own[WIDTH]):
            z[i] += loose[i, 2 * q] * c[own[ROWS + q], 0] + loose[i, 2 * q + 1] * v[own[ROWS + q], 0]


@leaf
def writer(A, m, g):
    """Return the first successor of a guard that writes memory, of a mode that does not; -1: none."""
    if A[m, 0, WRITES] > 0:
        return -1
    for i in range(THEN, A.shape[2]):
        b = A[m, 1 + g, i]
        if b >= 0 and A[b, 0, WRITES] > 0:
            return b
    return -1


@leaf
def writes_all(A, b):
    """Return whether mode ``b`` writes all memory of the contact."""
    for i in range(A[A.shape[0] - 1, 0, MEMORY]):
        if A[b, 0, ALGEBRAIC + i] <= 0:
            return False
    return True


@leaf
def holding(contact, still, slack, z, p, a):
    """Return the first mode that may hold at phase 0 with memory ``z``, or -1; ``still``: of those that keep memory."""
    A = contact.A
    for s in range(A[A.shape[0] - 1, 0, COUNT]):
        m = A[A.shape[0] - 1, 1, s]
        if m >= 0 and not (still and A[m, 0, WRITES] > 0) and admissible(contact, m, z, p, slack, a):
            return m
    return -1


@leaf
def begin(contact, slack, z, p, a):
    """Return (mode, mode that wrote the memory) at phase 0: of a start with virgin memory (-1), or as a mode writes it.

    Mode -1: none may hold; ``slack`` as in `admissible`; ``p`` and ``a`` are overwritten.  Where a mode that keeps virgin memory
    is beyond a guard at phase 0, memory is as the mode writes it that this guard leads to: the limit that was passed on the way
    there, whatever the direction in which the motion goes now (of one slider; in a set others may have passed theirs).
    """
    powers(0.0, p.shape[0], p)
    waves, A = contact.waves, contact.A
    own = A[A.shape[0] - 1, 0]
    virgin(contact, z)
    m = holding(contact, True, slack, z, p, a)
    if m >= 0:
        return m, -1
    for s in range(own[COUNT]):
        still = A[A.shape[0] - 1, 1, s]
        if still < 0 or A[still, 0, WRITES] > 0:
            continue
        for g in range(A[still, 0, GUARDS]):
            b = writer(A, still, g)
            if b < 0 or not writes_all(A, b):
                continue
            virgin(contact, z)
            guard_of(contact, still, g, z, a)
            if jet(waves, a, p)[0] > ROUNDING * size(a):
                slaves(contact, b, p, z, a)
                m = holding(contact, False, slack, z, p, a)
                if m >= 0:
                    return m, b
    for b in range(-1, own[COUNT]):
        virgin(contact, z)
        if b >= 0:
            slaves(contact, b, p, z, a)
        m = holding(contact, False, slack, z, p, a)
        if m >= 0:
            return m, b
    return -1, -1


@leaf
def further(A, m, g):
    """Return the mode that follows a guard of a mode that writes memory, if it writes more (more sliders slip); -1: it does not."""
    b = A[m, 1 + g, THEN]
    if b < 0 or A[m, 0, WRITES] <= 0:
        return -1
    for i in range(A[A.shape[0] - 1, 0, MEMORY]):
        if A[b, 0, ALGEBRAIC + i] > A[m, 0, ALGEBRAIC + i]:
            return b
    return -1


@leaf
def choices(A, path, count):
    """Return how many contacts on a path slip at once as they close, where they could stick, how many slip down as they open, and
    how many open."""
    slips, down, opened = 0, 0, 0
    for n in range(count - 1):
        m, g = path[n, MODE], path[n, GUARD]
        choice = A[m, 1 + g, CHOICE]
        if choice == 1 and path[n, AFTER] != A[m, 1 + g, TRIAL]:
            slips += 1
        elif choice > 1:
            down += choice - 2
            opened += 1
    return slips, down, opened


@leaf
def missed(height, touch, followed, source):
    """Return whether a guard that stays below zero, by ``height`` of its size, is a touch to be followed; note it if not."""
    if height <= -touch:
        source[NEXT] = max(source[NEXT], height)
        return False
    if not followed:
        source[PASSED] += 2.0
    return followed


@leaf
def resting(A, m, g, t, source, near):
    """Return whether guard ``g`` of mode ``m`` is zero at phase ``t`` because it wrote the memory there, a period ago.

    A slider that always sticks but slipped to one side before it came to rest touches that limit once a period.
    """
    if not (source[WRITER] >= 0.0 and writer(A, m, g) == int(source[WRITER])):
        return False
    away = abs(t - source[WRITTEN])
    return min(away, 2.0 * np.pi - away) < near


@leaf
def back(A, b):
    """Return the guard by which a mode that writes memory goes back to one that keeps it."""
    for g in range(A[b, 0, GUARDS]):
        if A[b, 1 + g, TRIAL] >= 0:
            return g
    return 0


@leaf
def filled(row, own, U, V, excite, constant, out):
    """Write an expression on a grid, without the part of memory; ``constant`` is 1, or 0 with tables of derivatives."""
    first, nx = constant * row[0], excite.shape[0]
    for n in range(out.size):
        out[n] = first
    for q in range(own[WIDTH]):
        r, a, b = own[ROWS + q], row[nx + 2 * q], row[nx + 2 * q + 1]
        if a != 0.0:
            for n in range(out.size):
                out[n] += a * U[r, n]
        if b != 0.0:
            for n in range(out.size):
                out[n] += b * V[r, n]
    for x in range(1, nx):
        a = row[x]
        if a != 0.0:
            for n in range(out.size):
                out[n] += a * excite[x, n]


@leaf
def repeats(A, m, z, z0, c):
    """Return whether the memory that mode ``m`` keeps came back."""
    bound = size(c[A[A.shape[0] - 1, 0, ROWS]])
    for i in range(z.size):
        if A[m, 0, ALGEBRAIC + i] <= 0 and not abs(z[i] - z0[i]) <= REPEATS * (abs(z[i]) + abs(z0[i]) + bound):
            return False
    return True


@leaf
def ended(segments, n, m, g, after, stop, wrote_at, z):
    """Write segment ``n``."""
    path, ends, zs, _, _ = segments
    path[n, MODE], path[n, GUARD], path[n, AFTER], path[n, WROTE] = m, g, after, -1
    ends[n, 0], ends[n, 1] = stop, wrote_at
    for i in range(z.size):
        zs[n, i] = z[i]


@leaf
def again(A, m, g, after, segments, n, stop, tolerance):
    """Return whether event ``n`` is that of the period before, and all memory was written by it: then so is what follows."""
    path, ends, _, _, count = segments
    return A[m, 0, FORGETS] > 0 and n < count[0] - 1 and path[n, MODE] == m and path[n, GUARD] == g and path[n, AFTER] == after \
        and abs(ends[n, 0] - stop) <= tolerance
