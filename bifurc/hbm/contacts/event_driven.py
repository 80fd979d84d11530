"""Contacts followed event by event: guards are polynomials, their zeros are found on a grid and polished.

Guards are scanned on a grid finer than an eighth of the shortest wave, sign changes and interior maxima (from the Hermite
cubic of a cell) are polished by Newton on the polynomial; what follows an event is decided as in `flow.settle`: the first
candidate whose guards are all negative, or zero with a negative first non-zero derivative.

One file, because finding and deciding an event are compiled as one text.
"""
import numpy as np

from ..._jit import leaf
from ..tables import ALGEBRAIC, GUARDS, MEMORY, PAIRS, SILENT, THEN, WRITES
from ..waves import jet, powers, size, turn, value
from .common import (
    FOLLOWED,
    GUARD,
    INCONSISTENT,
    MODE,
    NEXT,
    NOT_SETTLED,
    PASSED,
    PERIODS,
    REPEATS,
    RESTING,
    ROUNDING,
    TOO_MANY,
    TOUCHED,
    WRITER,
    WRITTEN,
    WROTE,
    admissible,
    again,
    back,
    begin,
    ended,
    expression,
    filled,
    further,
    guard_of,
    missed,
    repeats,
    resting,
    slaves,
    virgin,
    writer,
)

TURNED = 1e-7  # of the size: a guard of a set of sliders turns where the drive does, which is where its mode ends
SAME = 1e-14  # difference of phases that is none
TIED = 1e-10  # of the size: a guard so near to zero may be the first of two that vanish at one instant
SLACK = 0.05  # of the height of a cell's cubic above its ends: how far below zero it is still looked at


@leaf
def root(waves, a, low, high, guess):
    """Return the zero of a polynomial that is negative at ``low`` and not at ``high``: Newton kept inside by halving."""
    t, before = guess if low < guess < high else 0.5 * (low + high), 0.0  # step of Newton before, 0: none
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
            new, before = 0.5 * (low + high), 0.0
        step = abs(new - t)
        if step <= 4e-16 * (1.0 + t) or high - low <= 4e-16 * (1.0 + t) or step * step * step <= before * before * 1e-18:
            return new  # the next step, which two steps of Newton foretell, would be below rounding
        t, before = new, step
    return t


@leaf
def zero_of_cubic(v0, d0, v1, d1):
    """Return where in (0, 1) the cubic with the values ``v0`` < 0 <= ``v1`` and derivatives at the ends is zero, about."""
    c2, c3 = 3.0 * (v1 - v0) - 2.0 * d0 - d1, 2.0 * (v0 - v1) + d0 + d1
    t = v0 / (v0 - v1)
    for _ in range(4):
        slope = d0 + t * (2.0 * c2 + 3.0 * t * c3)
        new = t - (v0 + t * (d0 + t * (c2 + t * c3))) / slope if slope > 0.0 else -1.0
        if not 0.0 < new < 1.0:
            break
        t = new
    return t


@leaf
def summit(waves, a, low, high, rise, fall):
    """Return the phase of a maximum between a ``rise`` at ``low`` and a ``fall`` at ``high`` (derivatives, about), from the side
    on which it falls.

    Up to 1e-9 behind it, where a rate has a sign: on the top itself it would be that of rounding.
    """
    t = low + (high - low) * (rise / (rise - fall)) if rise > 0.0 > fall else 0.5 * (low + high)
    for _ in range(60):
        g1, g2 = turn(waves, a, t)
        if g1 > 0.0:
            low = t
        else:
            high = t
        new = t - g1 / g2 if g2 < 0.0 else low
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - t) < 1e-9 or high - low < 1e-9:
            return min(new + 1e-9, high)
        t = new
    return high


@leaf
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
        high = summit(waves, a, t0, t1, d0, d1)
        if value(waves, a, high)[0] < 0.0:
            return np.inf
        return root(waves, a, t0, high, 0.5 * (t0 + high))
    low, guess = t0, t0
    if not fresh:
        guess = t0 + h * zero_of_cubic(v0, h * d0, v1, h * d1)
    else:
        step, small, rising = h, ROUNDING * waves[-1] * size(a), np.inf
        for _ in range(48):
            step *= 0.5
            g, d = value(waves, a, t0 + step)
            if g < 0.0:
                low = t0 + step
                break
            high = t0 + step
            if d > small:
                rising = high
            else:
                small = np.inf
        if low == t0:  # it dips by less than rounding, if at all: where it clearly rises
            return rising
        guess = 0.5 * (low + high)
    return root(waves, a, low, high, guess)


@leaf
def crest(waves, a, t):
    """Return the phase of the first maximum of a guard behind its zero at ``t``."""
    h = 2.0 * np.pi / max(64, 8 * waves[-1])
    end = t
    for _ in range(int(2.0 * np.pi / h) + 2):
        end += h
        if value(waves, a, end)[1] <= 0.0:
            break
    return summit(waves, a, max(end - h, t), end, 0.0, 0.0)


@leaf
def slopes_on(waves, a, cosines, sines, first, last, out):
    """Write the derivative of a polynomial by phase at grid points ``first`` to ``last - 1``."""
    for n in range(first, last):
        out[n] = 0.0
    for j in range(1, a.size, 2):
        even, odd, i = waves[j] * a[j + 1], waves[j] * a[j], j // 2
        for n in range(first, last):
            out[n] += even * cosines[i, n] - odd * sines[i, n]


@leaf
def crest_on(waves, a, t, rates):
    """Return what `crest` does, where the derivative is known on a grid: ``rates`` (grid + 1,)."""
    nodes = rates.size - 1
    h = 2.0 * np.pi / nodes
    first = int(t / h) + 1
    for node in range(first, first + nodes + 1):
        if rates[node % nodes] <= 0.0:
            return summit(waves, a, max((node - 1) * h, t), node * h, rates[(node - 1) % nodes], rates[node % nodes])
    return summit(waves, a, t, t + h, 0.0, 0.0)


@leaf
def overshoot(waves, a, t, rates):
    """Return how high a guard would rise behind its zero at ``t``, as part of its size; ``rates`` as of `crest_on`."""
    return value(waves, a, crest_on(waves, a, t, rates))[0] / size(a)


@leaf
def entered(contact, m, z, p, a, g0, d0, fresh, offset):
    """Write guards of mode ``m``, their rates, and whether they are zero, behind an event; and what memory adds to them."""
    waves, excited, A, X, _, _, _ = contact
    own = A[A.shape[0] - 1, 0]
    first = excited.size + 2 * own[PAIRS]
    for g in range(A[m, 0, GUARDS]):
        row = X[m, own[PAIRS] + g]
        expression(contact, row, z, a)
        here = jet(waves, a, p)
        g0[g], d0[g] = here[0], here[1]
        fresh[g] = 1 if here[0] >= -ROUNDING * size(a) else 0
        offset[g] = 0.0
        for i in range(z.size):
            offset[g] += row[first + i] * z[i]


@leaf
def beyond(contact, m, which, z, p, touch, source, a):
    """Return the guard of a mode that ends by another one, as it is at its nearest to zero, if that is a touch; -1: none.

    One that is above zero there by rounding was not found before the end of the mode: it counts too.
    """
    waves, A = contact.waves, contact.A
    for g in range(A[m, 0, GUARDS]):
        if g == which or A[m, 1 + g, SILENT] > 0:
            continue
        if further(A, m, g) < 0:
            continue
        guard_of(contact, m, g, z, a)
        here = jet(waves, a, p)
        if here[0] < ROUNDING * size(a) and abs(here[1]) < TURNED * size(a) and missed(here[0] / size(a), touch, True, source):
            return g
    return -1


@leaf
def unquiet(guards, values, slopes, offset, ignored, first):
    """Return the first cell from ``first`` on in which a guard of a mode may be zero, or is ignored; one more than there are: none.

    ``values`` and ``slopes`` (G, grid + 1) are those of the guards, to which ``offset`` (G,) adds what memory does.
    """
    cell = values.shape[1]
    for g in range(guards):
        if ignored[g] > 0:
            return first
        own, rates, add = values[g], slopes[g], offset[g]
        for j in range(first, cell):
            if not own[j] + add < 0.0 or (rates[j - 1] > 0.0 and rates[j] < 0.0):
                cell = j
                break
    return cell


@leaf
def successor(contact, m, which, z, p, a):
    """Return the first mode that may follow a guard of mode ``m`` at the phase of the powers ``p``; -1: none."""
    A = contact.A
    for i in range(THEN, A.shape[2]):
        b = A[m, 1 + which, i]
        if b >= 0 and admissible(contact, b, z, p, 0.0, a):
            return b
    return -1


@leaf
def exact(contact, tabulated, skip, touch, segments, space, slopes):
    """Follow a contact along the motion event by event over one period that repeats.

    Parameters
    ----------
    contact : Contact
    tabulated : Tabulated
    skip : float
        Events whose guard rises no higher than this part of its size are ignored; 0: none.  This and `touch` extend an order
        of events beyond where it holds, see `residual.followed`.
    touch : float
        A guard that comes to within this part of its size below zero counts as events at its maximum (there and back): they
        are followed if the mode behind it writes memory, and only counted if not; 0: no.
    segments : Segments
        Overwritten.
    space : Space
        Overwritten.
    slopes : (M, G, grid + 1)
        Derivatives of guards by phase; overwritten for the modes that are entered.

    Returns
    -------
    int
        Code of a `ContactStatus`.
    """
    waves, _, A, X, _, c, _ = contact
    U, V, dU, dV, excite, dexcite = tabulated
    path, ends, zs, source, count = segments
    scratch, flags, p, tables = space
    grid, most, own = U.shape[1] - 1, len(ends), A[A.shape[0] - 1, 0]
    whole, Q = 2.0 * np.pi, own[PAIRS]
    a, g0, d0, g1, d1, offset = scratch[0, :waves.size], scratch[1], scratch[2], scratch[3], scratch[4], scratch[5]
    z, z0 = scratch[6, :own[MEMORY]], scratch[7, :own[MEMORY]]
    fresh, ignored, ready = flags[0], flags[1], flags[2]
    values = tables[0]
    z[:] = 0.0
    flags[:] = 0
    m, wrote = begin(contact, skip, z, p, a)
    if m < 0:
        return INCONSISTENT
    at = 0.0
    for period in range(PERIODS):
        m0, events, t, begun = m, 0, 0.0, True
        for i in range(z.size):
            z0[i] = z[i]
        source[0], source[1], source[NEXT], source[PASSED], source[TOUCHED] = wrote, at, -np.inf, 0.0, touch
        j = 0
        while j < grid:
            j += 1
            if not begun:
                quiet = j
                j = unquiet(A[m, 0, GUARDS], values[m], slopes[m], offset, ignored, j)
                for g in range(A[m, 0, GUARDS] if j > quiet else 0):
                    g0[g], d0[g], fresh[g] = values[m, g, j - 1] + offset[g], slopes[m, g, j - 1], 0
                t = whole * (j - 1) / grid
                if j > grid:
                    break
            t1 = whole * j / grid
            while True:  # events within the cell
                if begun:  # a mode that was entered
                    if ready[m] == 0:
                        for g in range(A[m, 0, GUARDS]):
                            filled(X[m, Q + g], own, U, V, excite, 1.0, values[m, g])
                            filled(X[m, Q + g], own, dU, dV, dexcite, 0.0, slopes[m, g])
                        ready[m] = 1
                    powers(t, p.shape[0], p)
                    entered(contact, m, z, p, a, g0, d0, fresh, offset)
                    if t == 0.0:
                        for g in range(A[m, 0, GUARDS]):
                            g0[g] = values[m, g, 0] + offset[g]
                            fresh[g] = 1 if g0[g] >= 0.0 else 0
                    begun = False
                    if t >= t1:
                        break
                soonest, which, beside = np.inf, -1, False
                for g in range(A[m, 0, GUARDS]):
                    g1[g], d1[g] = values[m, g, j] + offset[g], slopes[m, g, j]
                    if g1[g] < 0.0 and (ignored[g] > 0 or not (d0[g] > 0.0 and d1[g] < 0.0)):
                        ignored[g] = 0
                        continue
                    if ignored[g] > 0:
                        continue
                    guard_of(contact, m, g, z, a)
                    found = first_zero(waves, a, t, t1, g0[g], d0[g], g1[g], d1[g], fresh[g] > 0)
                    nearly = False
                    if touch > 0.0 and found == np.inf and g1[g] < 0.0 and fresh[g] == 0 and A[m, 1 + g, SILENT] == 0 \
                            and further(A, m, g) < 0:
                        top = summit(waves, a, t, t1, d0[g], d1[g])
                        nearly = missed(value(waves, a, top)[0] / size(a), touch, writer(A, m, g) >= 0, source)
                        if not nearly:
                            continue
                        found = top
                    if found < np.inf and (
                            (skip > 0.0 and not nearly and overshoot(waves, a, found, slopes[m, g]) < skip) or (
                                period > 0 and events == 0 and resting(A, m, g, found, source, RESTING))):
                        ignored[g] = 1 if g1[g] >= 0.0 else 0
                        continue
                    if found < soonest:
                        soonest, which, beside = found, g, nearly
                if which < 0:
                    break
                if events >= most - (2 if beside else 1):
                    return TOO_MANY
                powers(soonest, p.shape[0], p)
                t, begun = soonest, True
                for i in range(z.size):
                    zs[events, i] = z[i]
                if beside:  # there and back at one instant
                    b = writer(A, m, which)
                    slaves(contact, b, p, z, a)
                    ended(segments, events, m, which, b, soonest, soonest, z[:0])
                    events += 1
                    ended(segments, events, b, back(A, b), m, soonest, soonest, z)
                    path[events, WROTE] = b
                    wrote, at = b, soonest
                    events += 1
                    continue
                slaves(contact, m, p, z, a)
                if touch > 0.0 and A[m, 0, WRITES] > 0:
                    g = beyond(contact, m, which, z, p, touch, source, a)
                    if g >= 0 and events < most - 2:
                        b = further(A, m, g)
                        ended(segments, events, m, g, b, soonest, soonest, z[:0])
                        path[events, WROTE] = m
                        events += 1
                        m, which = b, back(A, b)
                        for i in range(z.size):
                            zs[events, i] = z[i]
                        slaves(contact, m, p, z, a)
                after = successor(contact, m, which, z, p, a)
                for g in range(A[m, 0, GUARDS]):
                    if after >= 0:
                        break
                    guard_of(contact, m, g, z, a)
                    if g != which and jet(waves, a, p)[0] > -TIED * size(a):  # rounding says which of two is first
                        which, after = g, successor(contact, m, g, z, p, a)
                if after < 0:
                    return INCONSISTENT
                closed = period > 0 and touch == 0.0 and again(A, m, which, after, segments, events, soonest, SAME)
                ended(segments, events, m, which, after, soonest, soonest, z[:0])
                if A[m, 0, WRITES] > 0:
                    wrote, at, path[events, WROTE] = m, soonest, m
                if closed:  # all memory is that of the period before, which was followed from here on
                    count[1] = period + 1
                    return FOLLOWED
                events += 1
                m = after
            if t < t1:
                for g in range(A[m, 0, GUARDS]):
                    g0[g], d0[g], fresh[g] = g1[g], d1[g], 0
            t = t1
        ended(segments, events, m, -1, m, whole, whole, z)
        count[0], count[1] = events + 1, period + 1
        if m == m0 and wrote == int(source[WRITER]) and repeats(A, m, z, z0, c):
            return FOLLOWED
    return NOT_SETTLED


@leaf
def followed_on(contact, segments, far, z, start, p, a):
    """Move the events of a contact that was followed to where they are along a motion next to that one; return whether they are
    the same ones, each nearer than ``far`` to where it was.

    Events that begin or end between the two motions are not looked for; all memory has to be written by events of a period, or
    none.  ``z``, ``start`` (Z,), ``p`` and ``a`` are overwritten.
    """
    waves, A = contact.waves, contact.A
    path, ends, zs, source, count = segments
    events, wrote = count[0] - 1, -1
    if source[TOUCHED] > 0.0:
        return False
    for n in range(events):
        wrote = path[n, WROTE] if path[n, WROTE] >= 0 else wrote
    if wrote != int(source[WRITER]):
        return False
    virgin(contact, start)
    for i in range(z.size if wrote >= 0 else 0):
        start[i] = zs[0, i]
        mine = False
        for n in range(events):
            mine = mine or (path[n, WROTE] >= 0 and A[path[n, WROTE], 0, ALGEBRAIC + i] > 0)
        if not mine:  # it was written on the way to a motion that repeats, which is not followed here
            return False
    for _ in range(PERIODS):
        t = 0.0
        for i in range(z.size):
            z[i] = start[i]
        for n in range(events):
            m = path[n, MODE]
            for i in range(z.size):
                zs[n, i] = z[i]
            guard_of(contact, m, path[n, GUARD], z, a)
            new = risen(waves, a, ends[n, 0], far)
            if not t < new < 2.0 * np.pi:
                return False
            t = new
            ends[n, 0], ends[n, 1] = t, t
            if A[m, 0, WRITES] > 0:
                powers(t, p.shape[0], p)
                slaves(contact, m, p, z, a)
                source[WRITTEN] = t
        same = True
        for i in range(z.size):
            zs[events, i] = z[i]
            same = same and abs(z[i] - start[i]) <= REPEATS * (abs(z[i]) + abs(start[i]))
            start[i] = z[i]
        if same:
            return True
    return False


@leaf
def risen(waves, a, guess, far):
    """Return the zero of a polynomial that rises there, by Newton's method; inf where that leads ``far`` away from the guess."""
    t, before = guess, far
    for _ in range(6):
        g, d = value(waves, a, t)
        step = g / d if d > 0.0 else np.inf
        if not abs(step) <= before:
            return np.inf
        t -= step
        if abs(t - guess) > far:
            return np.inf
        if abs(step)**3 <= before * before * 1e-18:  # as of `root`
            return t
        before = abs(step)
    return np.inf
