"""Modes of a contact along a given periodic motion: events found and polished, or the modes of samples.

The motion of the contact's rows is a trigonometric polynomial, so that guards are too once memory is frozen or put in.
Exact: guards are scanned on a grid finer than an eighth of the shortest wave, sign changes and interior maxima (from the
Hermite cubic of a cell) are polished by Newton on the polynomial; what follows an event is decided as in `flow.settle`: the
first candidate whose guards are all negative, or zero with a negative first non-zero derivative.  Sampled: guards are
checked at the samples.  Both repeat the period until mode and memory come back.

Rows are followed with c (nr, mi), the coefficients of the coordinates u, and v (nr, mi), those of the speeds s.
"""
import numpy as np

from .._jit import njit
from .parts import Numbers, Shape
from .waves import jet, powers, size, value

FOLLOWED, INCONSISTENT, TOO_MANY, NOT_SETTLED, NOT_FINITE = range(5)  # codes, see `MarchStatus`
PERIODS = 8  # most periods until memory has to repeat
ROUNDING = 1e-12  # of the size of a guard or its derivative (times the top harmonic): zero
SAME = 1e-14  # difference of phases that is none
REPEATS = 1e-11  # relative difference of memory after a period
SLACK = 0.05  # of the height of a cell's cubic above its ends: how far below zero it is still looked at

# columns of a path: segments of one mode, in order, from 0 to 2 pi
MODE, GUARD, AFTER, WROTE = 0, 1, 2, 3  # mode, guard that ended it (-1: end of the period), successor, mode that wrote memory
FIELDS = 4


@njit
def expression(T_U, T_S, T_Z, T_H, rows, Q, excited, c, v, z, out):
    """Write an affine expression along the motion as a polynomial: ``out`` (mi,)."""
    for j in range(out.size):
        total = 0.0
        for q in range(Q):
            if rows[q] < 0:
                break
            total += T_U[q] * c[rows[q], j] + T_S[q] * v[rows[q], j]
        out[j] = total
    for x in range(excited.size):
        out[excited[x]] += T_H[x]
    for i in range(z.size):
        out[0] += T_Z[i] * z[i]


@njit
def width(shape: Shape, k):
    """Return the number of rows of contact ``k``."""
    Q = 0
    for q in range(shape.rows.shape[1]):
        if shape.rows[k, q] >= 0:
            Q += 1
    return Q


@njit
def slaves(shape: Shape, T: Numbers, k, m, c, v, p, z):
    """Write the memory that mode ``m`` slaves, at the phase of the powers ``p``, into ``z``."""
    a = np.empty(c.shape[1])
    for i in range(shape.memory[k]):
        if shape.slaved[k, m, i]:
            expression(T.ZU[k, m, i], T.ZS[k, m, i], z[:0], T.ZH[k, m, i], shape.rows[k], shape.rows.shape[1], shape.excited,
                       c, v, z[:0], a)
            z[i] = jet(shape.waves, a, p)[0]


@njit
def guard_of(shape: Shape, T: Numbers, k, m, g, c, v, z, a):
    """Write guard ``g`` of mode ``m`` as a polynomial into ``a`` (mi,)."""
    expression(T.GU[k, m, g], T.GS[k, m, g], T.GZ[k, m, g], T.GH[k, m, g], shape.rows[k], shape.rows.shape[1], shape.excited, c, v,
               z, a)


@njit
def admissible(shape: Shape, T: Numbers, k, m, c, v, z, p, slack, a):
    """Return whether mode ``m`` may hold from the phase of the powers ``p`` on; ``slack``: part of a guard that is forgiven."""
    top = shape.waves[-1]
    for g in range(shape.guards[k, m]):
        guard_of(shape, T, k, m, g, c, v, z, a)
        j = jet(shape.waves, a, p)
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


@njit
def begin(shape: Shape, T: Numbers, k, c, v, slack, z):
    """Return (mode, mode that wrote the memory) at phase 0: of a start with relaxed memory (-1), or as a mode writes it.

    Mode -1: none may hold; ``slack`` as in `admissible`.
    """
    p = np.empty((shape.waves[-1] + 1, 2))
    a = np.empty(c.shape[1])
    powers(0.0, p.shape[0], p)
    Q = width(shape, k)
    for attempt in range(-1, shape.modes[k]):
        for i in range(shape.memory[k]):
            z[i] = 0.0
            for q in range(Q):
                z[i] += T.XU[k, i, q] * c[shape.rows[k, q], 0] + T.XS[k, i, q] * v[shape.rows[k, q], 0]
        if attempt >= 0:
            slaves(shape, T, k, attempt, c, v, p, z)
        for s in range(shape.start.shape[1]):
            m = shape.start[k, s]
            if m >= 0 and admissible(shape, T, k, m, c, v, z, p, slack, a):
                return m, attempt
    return -1, -1


@njit
def root(waves, a, low, high, guess):
    """Return the zero of a polynomial that is negative at ``low`` and not at ``high``: Newton kept inside by halving."""
    t = guess if low < guess < high else 0.5 * (low + high)
    for _ in range(80):
        g, d = value(waves, a, t)
        if g < 0.0:
            low = t
        else:
            high = t
        new = t - g / d if d != 0.0 else low
        if not low < new < high:
            if abs(new - t) <= 4e-16 * (1.0 + t):
                return t
            new = 0.5 * (low + high)
        if abs(new - t) <= 4e-16 * (1.0 + t) or high - low <= 4e-16 * (1.0 + t):
            return new
        t = new
    return t


@njit
def summit(waves, a, low, high):
    """Return the phase of a maximum between a rise at ``low`` and a fall at ``high``."""
    for _ in range(60):
        t = 0.5 * (low + high)
        g0, g1 = value(waves, a, t)
        if g1 > 0.0:
            low = t
        else:
            high = t
        if high - low < 1e-9:
            break
    return 0.5 * (low + high)


@njit
def first_zero(waves, a, t0, t1, v0, d0, v1, d1, fresh):
    """Return the first phase in (t0, t1] where a guard that is negative behind t0 is not, or inf.

    ``v``, ``d`` are values and derivatives at the ends; ``fresh``: the value at t0 is zero but for rounding.
    """
    h = t1 - t0
    high = t1
    if v1 < 0.0:
        if not (d0 > 0.0 and d1 < 0.0) or fresh:
            return np.inf
        cross = (d0 * t0 - d1 * t1 + v1 - v0) / (d0 - d1)  # the tangents of both ends meet above the maximum
        top = v0 + d0 * (min(max(cross, t0), t1) - t0)
        if top < 0.0 and top < SLACK * max(v0, v1):
            return np.inf
        high = summit(waves, a, t0, t1)
        if value(waves, a, high)[0] < 0.0:
            return np.inf
        return root(waves, a, t0, high, 0.5 * (t0 + high))
    low = t0
    if fresh:
        step = h
        for _ in range(48):
            step *= 0.5
            if value(waves, a, t0 + step)[0] < 0.0:
                low = t0 + step
                break
            high = t0 + step
        if low == t0:
            return np.inf
        return root(waves, a, low, high, 0.5 * (low + high))
    return root(waves, a, low, high, t0 + h * v0 / (v0 - v1))


@njit
def overshoot(waves, a, t, h):
    """Return how high a guard would rise behind its zero at ``t``, as part of its size."""
    end = t
    for _ in range(int(2.0 * np.pi / h) + 2):
        end += h
        if value(waves, a, end)[1] <= 0.0:
            break
    return value(waves, a, summit(waves, a, max(end - h, t), end))[0] / size(a)


@njit
def forgets(shape: Shape, k, m):
    """Return whether a mode writes all memory when it is left."""
    for i in range(shape.memory[k]):
        if not shape.slaved[k, m, i]:
            return False
    return shape.memory[k] > 0


@njit
def writer(shape: Shape, k, m, g):
    """Return the first successor of a guard that writes memory, of a mode that does not; -1: none."""
    if writes(shape, k, m):
        return -1
    for i in range(shape.then.shape[3]):
        b = shape.then[k, m, g, i]
        if b >= 0 and writes(shape, k, b):
            return b
    return -1


@njit
def back(shape: Shape, k, b):
    """Return the guard by which a mode that writes memory goes back to one that keeps it."""
    for g in range(shape.guards[k, b]):
        if shape.trial[k, b, g] >= 0:
            return g
    return 0


@njit
def tabulated(shape: Shape, T: Numbers, k, m, U, V, excite, constant, out, written):
    """Write guards (G, nodes) and slaved memory (Z, nodes) of mode ``m`` on a grid, without the part of frozen memory.

    ``constant`` is 1, or 0 with tables of derivatives.
    """
    nodes = U.shape[1]
    for g in range(shape.guards[k, m]):
        filled(shape, k, T.GU[k, m, g], T.GS[k, m, g], T.GH[k, m, g], U, V, excite, constant, nodes, out[g])
    for i in range(shape.memory[k] if len(written) else 0):
        if shape.slaved[k, m, i]:
            filled(shape, k, T.ZU[k, m, i], T.ZS[k, m, i], T.ZH[k, m, i], U, V, excite, constant, nodes, written[i])


@njit
def filled(shape: Shape, k, byU, byS, byH, U, V, excite, constant, nodes, out):
    """Write one expression on a grid."""
    first = constant * byH[0]
    for n in range(nodes):
        out[n] = first
    for q in range(byU.size):
        row = shape.rows[k, q]
        if row >= 0:
            a, b = byU[q], byS[q]
            for n in range(nodes):
                out[n] += a * U[row, n] + b * V[row, n]
    for x in range(1, byH.size):
        a = byH[x]
        for n in range(nodes):
            out[n] += a * excite[x, n]


@njit
def kept(byZ, z, count, out):
    """Write what frozen memory adds to the guards of a mode."""
    for g in range(count):
        out[g] = 0.0
        for i in range(z.size):
            out[g] += byZ[g, i] * z[i]


@njit
def exact(shape: Shape, T: Numbers, k, c, v, U, V, dU, dV, excite, dexcite, skip, touch, path, ends, zs, source, count):
    """Follow contact ``k`` along the motion event by event over one period that repeats.

    Parameters
    ----------
    c, v : (nr, mi)
        Coefficients of coordinates and speeds.
    U, V, dU, dV : (nr, grid + 1)
        The same on the grid, and their derivatives by phase.
    excite, dexcite : (nx, grid + 1)
        Columns of excitation on the grid, and their derivatives.
    skip : float
        Events whose guard rises no higher than this part of its size are ignored; 0: none.  This and `touch` extend an order
        of events beyond where it holds, see `followed_as`.
    touch : float
        A guard that comes to within this part of its size below zero counts as two events at its maximum, if the mode
        behind it writes memory; 0: no.
    path : int (most, FIELDS), ends : (most, 2), zs : (most, Z)
        Segments, overwritten: mode, guard, successor and the mode that wrote memory at the end (-1: none); phases of the end
        and of the writing; memory.
    source : (2,)
        Overwritten: mode (-1: a relaxed start) and phase that wrote the memory at phase 0.
    count : int (2,)
        Overwritten by the number of segments, and of periods that were followed.

    Returns
    -------
    int
        Code of a `MarchStatus`.
    """
    waves, grid, most = shape.waves, U.shape[1] - 1, len(ends)
    Z, turn = shape.memory[k], 2.0 * np.pi
    z, z0 = np.zeros(Z), np.zeros(Z)
    p = np.empty((waves[-1] + 1, 2))
    a = np.empty(waves.size)
    m, wrote = begin(shape, T, k, c, v, skip, z)
    if m < 0:
        return INCONSISTENT
    at, strict = 0.0, 0.0 * skip
    G = shape.kinds.shape[2]
    g0, d0, g1, d1 = np.empty(G), np.empty(G), np.empty(G), np.empty(G)
    fresh, ignored = np.zeros(G, np.bool_), np.zeros(G, np.bool_)
    modes = shape.modes[k]
    ready, offset = np.zeros(modes, np.bool_), np.empty(G)
    values, slopes, nothing = np.empty((modes, G, grid + 1)), np.empty((modes, G, grid + 1)), np.empty((0, grid + 1))
    for period in range(PERIODS):
        m0, events, t = m, 0, 0.0
        z0[:] = z
        source[0], source[1] = wrote, at
        if not ready[m]:
            tabulated(shape, T, k, m, U, V, excite, 1.0, values[m], nothing)
            tabulated(shape, T, k, m, dU, dV, dexcite, 0.0, slopes[m], nothing)
            ready[m] = True
        kept(T.GZ[k, m], z, shape.guards[k, m], offset)
        for g in range(shape.guards[k, m]):
            g0[g], d0[g] = values[m, g, 0] + offset[g], slopes[m, g, 0]
            fresh[g] = g0[g] >= 0.0
        for j in range(1, grid + 1):
            t1 = turn * j / grid
            while True:  # events within the cell
                soonest, which, beside = np.inf, -1, False
                for g in range(shape.guards[k, m]):
                    g1[g], d1[g] = values[m, g, j] + offset[g], slopes[m, g, j]
                    if g1[g] < 0.0 and (ignored[g] or not (d0[g] > 0.0 and d1[g] < 0.0)):
                        ignored[g] = False
                        continue
                    if ignored[g]:
                        continue
                    guard_of(shape, T, k, m, g, c, v, z, a)
                    found = first_zero(waves, a, t, t1, g0[g], d0[g], g1[g], d1[g], fresh[g])
                    if found < np.inf and skip > 0.0 and overshoot(waves, a, found, turn / grid) < skip:
                        ignored[g] = g1[g] >= 0.0
                        continue
                    nearly = False
                    if touch > 0.0 and found == np.inf and g1[g] < 0.0 and not fresh[g] and writer(shape, k, m, g) >= 0:
                        found = summit(waves, a, t, t1)
                        nearly = value(waves, a, found)[0] > -touch * size(a)
                        if not nearly:
                            continue
                    if found < soonest:
                        soonest, which, beside = found, g, nearly
                if which < 0:
                    break
                if events >= most - 1:
                    return TOO_MANY
                powers(soonest, p.shape[0], p)
                zs[events, :Z] = z
                if beside:  # there and back at one instant
                    if events >= most - 2:
                        return TOO_MANY
                    b = writer(shape, k, m, which)
                    slaves(shape, T, k, b, c, v, p, z)
                    path[events, MODE], path[events, GUARD], path[events, AFTER], path[events, WROTE] = m, which, b, -1
                    ends[events, 0], ends[events, 1] = soonest, soonest
                    events += 1
                    path[events, MODE], path[events, GUARD], path[events, AFTER], path[events, WROTE] = b, back(shape, k, b), m, b
                    ends[events, 0], ends[events, 1] = soonest, soonest
                    zs[events, :Z] = z
                    wrote, at = b, soonest
                    events += 1
                    t = soonest
                    kept(T.GZ[k, m], z, shape.guards[k, m], offset)
                    for g in range(shape.guards[k, m]):
                        guard_of(shape, T, k, m, g, c, v, z, a)
                        first = jet(waves, a, p)
                        g0[g], d0[g] = first[0], first[1]
                        fresh[g] = g0[g] >= -ROUNDING * size(a)
                    continue
                slaves(shape, T, k, m, c, v, p, z)
                after = -1
                for i in range(shape.then.shape[3]):
                    b = shape.then[k, m, which, i]
                    if b >= 0 and admissible(shape, T, k, b, c, v, z, p, strict, a):
                        after = b
                        break
                if after < 0:
                    return INCONSISTENT
                again = period > 0 and events < count[0] - 1 and path[events, MODE] == m and path[events, GUARD] == which \
                    and path[events, AFTER] == after and abs(ends[events, 0] - soonest) <= SAME and forgets(shape, k, m)
                path[events, MODE], path[events, GUARD], path[events, AFTER], path[events, WROTE] = m, which, after, -1
                ends[events, 0], ends[events, 1] = soonest, soonest
                if writes(shape, k, m):
                    wrote, at, path[events, WROTE] = m, soonest, m
                if again:  # all memory is that of the period before, which was followed from here on
                    count[1] = period + 1
                    return FOLLOWED
                events += 1
                m, t = after, soonest
                if not ready[m]:
                    tabulated(shape, T, k, m, U, V, excite, 1.0, values[m], nothing)
                    tabulated(shape, T, k, m, dU, dV, dexcite, 0.0, slopes[m], nothing)
                    ready[m] = True
                kept(T.GZ[k, m], z, shape.guards[k, m], offset)
                for g in range(shape.guards[k, m]):
                    guard_of(shape, T, k, m, g, c, v, z, a)
                    first = jet(waves, a, p)
                    g0[g], d0[g] = first[0], first[1]
                    fresh[g] = g0[g] >= -ROUNDING * size(a)
                if t >= t1:
                    break
            if t < t1:
                for g in range(shape.guards[k, m]):
                    g0[g], d0[g], fresh[g] = g1[g], d1[g], False
            t = t1
        path[events, MODE], path[events, GUARD], path[events, AFTER], path[events, WROTE] = m, -1, m, -1
        ends[events, 0], ends[events, 1] = turn, turn
        zs[events, :Z] = z
        count[0], count[1] = events + 1, period + 1
        if m == m0 and repeats(shape, k, m, z, z0, c):
            return FOLLOWED
    return NOT_SETTLED


@njit
def repeats(shape: Shape, k, m, z, z0, c):
    """Return whether the memory that mode ``m`` keeps came back."""
    for i in range(z.size):
        if not shape.slaved[k, m, i] and not abs(z[i] - z0[i]) <= REPEATS * (abs(z[i]) + abs(z0[i]) + size(c[shape.rows[k, 0]])):
            return False
    return True


@njit
def broken(values, byZ, guards, trial, m, z, j, tried):
    """Return the first guard of mode ``m`` that is positive at sample ``j``, or -1; ``tried``: but those with a trial."""
    for g in range(guards[m]):
        if tried and trial[m, g] >= 0:
            continue
        total = values[m, g, j]
        for i in range(z.size):
            total += byZ[m, g, i] * z[i]
        if total > 0.0:
            return g
    return -1


@njit
def next_of(values, byZ, guards, trial, then, m, z, j):
    """Return (guard, mode) that follow mode ``m`` at sample ``j``; guard -1: it stays.  ``z`` is the memory before the sample."""
    every = m < 0  # False, but no literal
    for g in range(guards[m]):
        b, h = m, g
        if trial[m, g] >= 0:
            b = trial[m, g]
            h = broken(values, byZ, guards, trial, b, z, j, every)
            if h < 0:
                return g, b
        total = values[m, g, j]
        for i in range(z.size):
            total += byZ[m, g, i] * z[i]
        if total <= 0.0:
            continue
        for i in range(then.shape[2]):
            d = then[b, h, i]
            if d == m:
                break
            if d >= 0 and broken(values, byZ, guards, trial, d, z, j, not every) < 0:
                return g, d
    return -1, m


@njit
def writes(shape: Shape, k, m):
    """Return whether a mode writes memory when it is left."""
    for i in range(shape.memory[k]):
        if shape.slaved[k, m, i]:
            return True
    return False


@njit
def sampled(shape: Shape, T: Numbers, k, c, v, U, V, excite, skip, touch, path, ends, zs, source, count):
    """Follow contact ``k`` at the samples of one period that repeats; arguments and result as of `exact`.

    Predictor and corrector, so that forces are continuous in the samples: a mode that writes memory is left for one that
    keeps it as soon as that one is admissible with the memory of the sample before; where it is not, its own broken guard
    says which mode goes on.
    """
    N, most = U.shape[1] - 1, len(ends)
    Z, turn, modes = shape.memory[k], 2.0 * np.pi, shape.modes[k]
    z, z0 = np.zeros(Z), np.zeros(Z)
    m, wrote = begin(shape, T, k, c, v, skip, z)
    if m < 0:
        return INCONSISTENT
    values, slaved = np.empty((modes, shape.kinds.shape[2], N + 1)), np.empty((modes, Z, N + 1))
    for n in range(modes):
        tabulated(shape, T, k, n, U, V, excite, 1.0, values[n], slaved[n])
    guards, trial, then, byZ = shape.guards[k], shape.trial[k], shape.then[k], T.GZ[k]
    follows, writing, whole = shape.slaved[k], np.zeros(modes, np.bool_), np.zeros(modes, np.bool_)
    for n in range(modes):
        writing[n], whole[n] = writes(shape, k, n), forgets(shape, k, n)
    at, ignored = 0.0, False
    for period in range(PERIODS):
        m0, events = m, 0
        z0[:] = z
        source[0], source[1] = wrote, at
        for j in range(N):
            for i in range(Z):
                if follows[m, i]:
                    z[i] = slaved[m, i, j - 1 if j else N - 1]
            which, after = next_of(values, byZ, guards, trial, then, m, z, j)
            if which < 0:
                ignored = False
                if touch == 0.0 or writing[m]:
                    continue
                which = near(values, byZ, guards, shape, k, m, z, j, touch)
                if which < 0:
                    continue
                after = writer(shape, k, m, which)
            elif ignored or (skip > 0.0 and not writing[m] and rise(values, byZ, m, which, z, j) < skip):
                ignored = True
                continue
            if events >= most - 1:
                return TOO_MANY
            again = period > 0 and whole[m] and events < count[0] - 1 and path[events, MODE] == m and path[events, GUARD] == which \
                and path[events, AFTER] == after and ends[events, 0] == turn * j / N
            path[events, MODE], path[events, GUARD], path[events, AFTER], path[events, WROTE] = m, which, after, -1
            ends[events, 0], ends[events, 1] = turn * j / N, turn * (j - 1) / N
            zs[events, :Z] = z
            if writing[m]:
                wrote, at, path[events, WROTE] = m, ends[events, 1], m
            if again:  # as in `exact`
                count[1] = period + 1
                return FOLLOWED
            events += 1
            m = after
        path[events, MODE], path[events, GUARD], path[events, AFTER], path[events, WROTE] = m, -1, m, -1
        ends[events, 0], ends[events, 1] = turn, turn
        zs[events, :Z] = z
        count[0], count[1] = events + 1, period + 1
        if m == m0 and repeats(shape, k, m, z, z0, c):
            return FOLLOWED
    return NOT_SETTLED


@njit
def sample_of(values, byZ, m, g, z, j):
    """Return a guard at sample ``j`` modulo the period."""
    total = values[m, g, j % (values.shape[2] - 1)]
    for i in range(z.size):
        total += byZ[m, g, i] * z[i]
    return total


@njit
def spread(values, byZ, m, g, z):
    """Return a size of a guard: its largest value at a sample, and that of what memory adds."""
    total = np.abs(values[m, g]).max() + 1e-300
    for i in range(z.size):
        total += abs(byZ[m, g, i] * z[i])
    return total


@njit
def rise(values, byZ, m, g, z, j):
    """Return how high a guard would rise from sample ``j`` on, as part of its size."""
    top = sample_of(values, byZ, m, g, z, j)
    for i in range(1, values.shape[2] - 1):
        new = sample_of(values, byZ, m, g, z, j + i)
        if new < top:
            break
        top = new
    return top / spread(values, byZ, m, g, z)


@njit
def near(values, byZ, guards, shape: Shape, k, m, z, j, touch):
    """Return a guard of mode ``m`` with a maximum among the samples at ``j``, nearly zero; -1: none."""
    for g in range(guards[m]):
        here = sample_of(values, byZ, m, g, z, j)
        if sample_of(values, byZ, m, g, z, j - 1) < here and sample_of(values, byZ, m, g, z, j + 1) <= here:
            bound = spread(values, byZ, m, g, z)
            if here > -touch * bound and writer(shape, k, m, g) >= 0:
                return g
    return -1


@njit
def arose(shape: Shape, T: Numbers, k, c, v, samples, path, ends, zs, n, a):
    """Return how high the guard that ended segment ``n`` would rise behind it, as part of its size; negative after a touch."""
    m, g, stop = path[n, MODE], path[n, GUARD], ends[n, 0]
    guard_of(shape, T, k, m, g, c, v, zs[n, :shape.memory[k]], a)
    bound = size(a)
    if bound == 0.0:
        return 0.0
    if samples == 0:
        return overshoot(shape.waves, a, stop, 2.0 * np.pi / max(64, 8 * shape.waves[-1]))
    h = 2.0 * np.pi / samples
    top = value(shape.waves, a, stop)[0]
    for i in range(1, samples):
        new = value(shape.waves, a, stop + i * h)[0]
        if new < top:
            break
        top = new
    return top / bound
