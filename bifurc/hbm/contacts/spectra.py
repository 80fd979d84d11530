"""Forces of contacts and their derivatives as Fourier coefficients, from the segments of their modes, in closed form.

Within a segment the force is affine in the motion, so that its coefficients and their derivatives follow from the spectrum
of the segment's indicator up to twice the top harmonic (a Toeplitz and a Hankel part), one rank-one term a segment with
frozen memory, and one an event at which the force jumps.  Exact and sampled segments differ in one list of numbers:

    (1/2 pi) int_a^b e^{il theta} = d_l (e^{ilb} - e^{ila}),  d_l = 1/(2 pi i l)
    (1/N) sum_{a <= theta_j < b} e^{il theta_j} = the same with d_l = 1/(N (e^{2 pi il/N} - 1))

One file, because forces and their derivatives of all kinds of segments are one sum, compiled as one.
"""
from typing import NamedTuple

import numpy as np

from ..._jit import leaf, separate_leaf
from ...solve.dense import inner
from ..tables import ALGEBRAIC, FORGETS, MEMORY, PAIRS, ROWS, SILENT, WIDTH, moved, structure
from ..waves import both_ways, height, jet, powers, size, spectrum_row, turned
from .common import AFTER, GUARD, MODE, WROTE, expression

NEGLIGIBLE = 1e-11  # relative: a force without jump, a memory without slope


class Slopes(NamedTuple):
    """Derivatives of a contact along a motion by the parameter."""

    dX: np.ndarray  # of the expressions
    dloose: np.ndarray  # of the memory of a virgin start
    rate: float  # frequency of the slowest harmonic
    cp: np.ndarray  # (nr, mi) of the coefficients of coordinates, at fixed unknowns
    vp: np.ndarray  # (nr, mi) and of speeds


class Sums(NamedTuple):
    """Forces of all contacts and their derivatives, to which those of each are added."""

    spectra: np.ndarray  # (4, nr, nr, L, 2) by which coordinates and speeds act on forces, and their derivatives by the parameter
    F: np.ndarray  # (nr, slots) forces that are not proportional to the rows' motion
    J: np.ndarray  # (nr, slots, nr, mi + 1) rank-one terms of derivatives; the last column of row 0 is that by the parameter


class Scratch(NamedTuple):
    """Arrays that are overwritten while forces are summed."""

    lines: np.ndarray  # (4, Q mi + 1)
    p: np.ndarray  # (L, 2) powers at a phase
    total: np.ndarray  # (M, L, 2)
    E: np.ndarray  # (3, L, 2)
    dz: np.ndarray  # (Z, Q mi + 1) derivative of the memory


@separate_leaf
def divisors(count, samples, out):
    """Write d_l, l = 0 .. count - 1, into ``out`` (count, 2) as real and imaginary part; samples = 0: exact."""
    out[0] = 0.0
    for l in range(1, count):
        if samples:
            half = np.pi * l / samples  # 1/(e^{2ix} - 1) = -1/2 - i/(2 tan x)
            out[l, 0], out[l, 1] = -0.5 / samples, -0.5 / (samples * np.tan(half))
        else:
            out[l, 0], out[l, 1] = 0.0, -0.5 / (np.pi * l)


@separate_leaf
def add(out, factor, spectrum):
    """Add a multiple of a spectrum (count, 2)."""
    for l in range(len(out)):
        out[l, 0] += factor * spectrum[l, 0]
        out[l, 1] += factor * spectrum[l, 1]


@separate_leaf
def nonzero(spectrum):
    """Return whether a spectrum (count, 2) has an entry that is not zero."""
    for l in range(len(spectrum)):
        if spectrum[l, 0] != 0.0 or spectrum[l, 1] != 0.0:
            return True
    return False


@separate_leaf
def indicator(a, b, Ea, Eb, D, out):
    """Write the spectrum of the indicator of [a, b] into ``out`` (count, 2), from powers at both ends and divisors."""
    out[0, 0], out[0, 1] = (b - a) / (2.0 * np.pi), 0.0
    for l in range(1, len(out)):
        c, s = Eb[l, 0] - Ea[l, 0], Eb[l, 1] - Ea[l, 1]
        out[l, 0], out[l, 1] = D[l, 0] * c - D[l, 1] * s, D[l, 0] * s + D[l, 1] * c


@separate_leaf
def coefficients(T, waves, place, out):
    """Write the coefficients (slots,) of a signal with spectrum ``T`` into ``out``."""
    for i in range(place.size):
        a = place[i]
        if a == 0:
            out[i] = T[0, 0]
        else:
            out[i] = 2.0 * T[waves[a], 1 - a % 2]


@separate_leaf
def local_slopes(contact, slopes, row, drow, z, scratch, out):
    """Write the derivative of an expression at one phase by the coefficients of the contact's rows, and by the parameter.

    ``row`` and ``drow`` are the expression and its derivative by the parameter; ``out`` (Q mi + 1,): row by row, the parameter
    last; ``scratch`` has the powers at the phase and the derivative of the memory ``z``.
    """
    waves, excited, A, _, _, c, v = contact
    _, _, rate, cp, vp = slopes
    p, dz, own = scratch.p, scratch.dz, A[A.shape[0] - 1, 0]
    mi, Q, nx = waves.size, own[WIDTH], excited.size
    for q in range(Q):
        first = q * mi
        fu, fs = row[nx + 2 * q], row[nx + 2 * q + 1] * rate
        out[first] = fu
        for j in range(1, mi, 2):
            n = waves[j]
            co, si = p[n, 0], p[n, 1]
            out[first + j] = fu * co - fs * n * si
            out[first + j + 1] = fu * si + fs * n * co
    total = 0.0
    for q in range(Q):  # of the parameter: motion that is prescribed, and the numbers of the expression
        r = own[ROWS + q]
        total += row[nx + 2 * q] * height(waves, cp[r], p) + row[nx + 2 * q + 1] * height(waves, vp[r], p)
        fu, fs = drow[nx + 2 * q], drow[nx + 2 * q + 1]
        if fu != 0.0 or fs != 0.0:
            total += fu * height(waves, c[r], p) + fs * height(waves, v[r], p)
    for x in range(nx):
        s = excited[x]
        total += drow[x] * (1.0 if s == 0 else p[waves[s], 1 - s % 2])
    first = nx + 2 * own[PAIRS]
    for i in range(z.size):
        total += drow[first + i] * z[i]
    out[Q * mi] = total
    for i in range(z.size):
        w = row[first + i]
        if w != 0.0:
            for j in range(out.size):
                out[j] += w * dz[i, j]


@separate_leaf
def written(contact, slopes, m, g, z, moves, scratch):
    """Change ``dz`` to the derivatives of the memory that mode ``m`` wrote when its guard ``g`` (-1: none) was reached; ``scratch``
    has the powers at the phase of that."""
    waves, _, A, X, _, _, _ = contact
    dX, p, dz = slopes.dX, scratch.p, scratch.dz
    own, mi = A[A.shape[0] - 1, 0], waves.size
    Q, first = own[WIDTH], own[PAIRS] + A.shape[1] - 1
    a, new, shift = scratch.lines[0, :mi], scratch.lines[1, :Q * mi + 1], scratch.lines[2, :Q * mi + 1]
    none = z[:0]
    known = False
    for i in range(own[MEMORY]):
        if A[m, 0, ALGEBRAIC + i] <= 0:
            continue
        local_slopes(contact, slopes, X[m, first + i], dX[m, first + i], none, scratch, new)
        if moves and g >= 0:
            expression(contact, X[m, first + i], none, a)
            slope = jet(waves, a, p)[1]
            if abs(slope) > NEGLIGIBLE * waves[-1] * size(a):
                if not known:
                    delay(contact, slopes, m, g, z, scratch, shift, a)
                    known = True
                for j in range(new.size):
                    new[j] += slope * shift[j]
        for j in range(new.size):
            dz[i, j] = new[j]


@separate_leaf
def delay(contact, slopes, m, g, z, scratch, out, a):
    """Write the derivative of the phase of an event by the coefficients of the rows and by the parameter; ``a`` is overwritten."""
    r = contact.A[contact.A.shape[0] - 1, 0, PAIRS] + g
    row, drow = contact.X[m, r], slopes.dX[m, r]
    expression(contact, row, z, a)
    speed = jet(contact.waves, a, scratch.p)[1]
    local_slopes(contact, slopes, row, drow, z, scratch, out)
    for j in range(out.size):  # a touch moves like a root, and its effect vanishes with the speed of the guard
        out[j] = -out[j] / speed if speed != 0.0 else 0.0


@separate_leaf
def gather(contact, slopes, place, segments, samples, D, wanted, sums, scratch):
    """Add what a contact gives along its segments.

    Parameters
    ----------
    contact : Contact
    slopes : Slopes
    place : int (slots,)
        Internal slots of the balance.
    segments : Segments
        As `event_driven.exact` and `sampled.sampled` leave them.
    samples : int
        0: exact.
    D : (L, 2)
        See `divisors`.
    wanted : bool
        Derivatives are wanted.
    sums : Sums
    scratch : Scratch
        Overwritten.
    """
    waves, excited, A, X, loose, c, v = contact
    dX, dloose, _, cp, vp = slopes
    path, ends, zs, source, counts = segments
    spectra, F, J = sums
    lines, p, total, E, dz = scratch
    count = counts[0]
    own, mi, m_slots = A[A.shape[0] - 1, 0], waves.size, place.size
    Q, Z, L, nx = own[WIDTH], own[MEMORY], len(D), excited.size
    modes, frozen = A.shape[0] - 1, nx + 2 * own[PAIRS]
    Ea, Eb, I, e = E[0], E[1], E[2], lines[3, :m_slots]
    total[:] = 0.0
    dz[:] = 0.0
    none = zs[0, :0]
    if wanted and Z:
        if source[0] < 0.0:
            for i in range(Z):
                for q in range(Q):
                    dz[i, q * mi] = loose[i, 2 * q]
                    row = own[ROWS + q]
                    dz[i, Q * mi] += loose[i, 2 * q] * cp[row, 0] + loose[i, 2 * q + 1] * vp[row, 0] \
                        + dloose[i, 2 * q] * c[row, 0] + dloose[i, 2 * q + 1] * v[row, 0]
        else:
            powers(source[1], len(p), p)
            written(contact, slopes, int(source[0]), path[count - 1, GUARD], none, samples < 0, scratch)
        first = 0
        for n in range(count - 1):  # the memory at phase 0 was written by the last event before it
            if path[n, WROTE] >= 0 and A[path[n, WROTE], 0, FORGETS] > 0:
                first = n
        for n in range(first, count - 1):
            if path[n, WROTE] >= 0:
                powers(ends[n, 1], len(p), p)
                written(contact, slopes, path[n, WROTE], path[n, GUARD] if path[n, WROTE] == path[n, MODE] else -1, zs[n, :Z],
                        samples == 0, scratch)
    start = 0.0
    powers(0.0, L, Ea)
    for n in range(count):
        m, stop = path[n, MODE], ends[n, 0]
        if n < count - 1:
            powers(stop, L, Eb)
        else:
            powers(0.0, L, Eb)
        indicator(start, stop, Ea, Eb, D, I)
        add(total[m], 1.0, I)
        for q in range(Q):
            for i in range(Z):
                weight, turn = X[m, q, frozen + i], dX[m, q, frozen + i]
                if weight != 0.0 or turn != 0.0:
                    row = own[ROWS + q]
                    coefficients(I, waves, place, e)
                    for j in range(m_slots):
                        F[row, j] += weight * zs[n, i] * e[j]
                    if wanted:
                        for j in range(m_slots):
                            w = weight * e[j]
                            for other in range(Q):
                                target, first = own[ROWS + other], other * mi
                                for b in range(mi):
                                    J[row, j, target, b] += w * dz[i, first + b]
                            J[row, j, 0, mi] += (weight * dz[i, Q * mi] + turn * zs[n, i]) * e[j]
        if wanted and n < count - 1:
            g, after = path[n, GUARD], path[n, AFTER]
            for l in range(len(p)):
                p[l, 0], p[l, 1] = Eb[l, 0], Eb[l, 1]
            if samples == 0 and A[m, 1 + g, SILENT] == 0:
                if path[n + 1, WROTE] >= 0 and ends[n + 1, 0] == stop:  # a touch: the instant is that of the way on
                    jumps(contact, slopes, place, m, path[n + 1, AFTER], after, path[n + 1, GUARD], zs[n, :Z],
                          zs[n + 2, :Z], J, scratch)
                else:
                    jumps(contact, slopes, place, m, after, m, g, zs[n, :Z], zs[n + 1, :Z], J, scratch)
            if path[n, WROTE] >= 0:
                if ends[n, 1] != stop:  # at samples
                    powers(ends[n, 1], len(p), p)
                written(contact, slopes, path[n, WROTE], g if path[n, WROTE] == m else -1, zs[n, :Z], samples == 0, scratch)
        start = stop
        Ea, Eb = Eb, Ea
    for m in range(modes):
        if not nonzero(total[m]):
            continue
        for q in range(Q):
            row = own[ROWS + q]
            for other in range(Q):
                target = own[ROWS + other]
                for part in range(2):
                    weight, turn = X[m, q, nx + 2 * other + part], dX[m, q, nx + 2 * other + part]
                    if weight != 0.0:
                        add(spectra[part, row, target], weight, total[m])
                    if turn != 0.0:
                        add(spectra[2 + part, row, target], turn, total[m])
            for x in range(nx):
                weight, turn = X[m, q, x], dX[m, q, x]
                if weight == 0.0 and turn == 0.0:
                    continue
                slot = excited[x]
                if slot == 0:
                    coefficients(total[m], waves, place, e)
                else:
                    modulated(total[m], waves, place, slot, e)
                for j in range(m_slots):
                    F[row, j] += weight * e[j]
                    J[row, j, 0, mi] += turn * e[j]


@separate_leaf
def modulated(T, waves, place, slot, out):
    """Write the coefficients (slots,) of a signal with spectrum ``T`` times the wave of an internal slot."""
    k, sine = waves[slot], slot % 2 == 0
    for i in range(place.size):
        a = place[i]
        j = waves[a]
        if a == 0:
            out[i] = T[k, 1] if sine else T[k, 0]
            continue
        d = k - j
        odd = T[d, 1] if d >= 0 else -T[-d, 1]
        if a % 2 == 0:  # sine row
            out[i] = T[abs(d), 0] - T[j + k, 0] if sine else T[j + k, 1] - odd
        else:
            out[i] = T[j + k, 1] + odd if sine else T[abs(d), 0] + T[j + k, 0]


@separate_leaf
def jumps(contact, slopes, place, m, after, mode, g, z, znew, J, scratch):
    """Add the derivatives by the phase of an event at which the force jumps, if it does; guard ``g`` of ``mode`` sets the phase, of
    which ``scratch`` has the powers."""
    waves, _, A, X, _, _, _ = contact
    lines, p = scratch.lines, scratch.p
    own, mi = A[A.shape[0] - 1, 0], waves.size
    Q = own[WIDTH]
    a, b, shift = lines[0, :mi], lines[1, :mi], lines[2, :Q * mi + 1]
    known = False
    for q in range(Q):
        expression(contact, X[m, q], z, a)
        expression(contact, X[after, q], znew, b)
        gap = height(waves, a, p) - height(waves, b, p)
        if abs(gap) <= NEGLIGIBLE * (size(a) + size(b)):
            continue
        if not known:
            delay(contact, slopes, mode, g, z, scratch, shift, a)
            known = True
        row = own[ROWS + q]
        for i in range(place.size):
            s = place[i]
            w = gap / (2.0 * np.pi) if s == 0 else gap / np.pi * p[waves[s], 1 - s % 2]
            for other in range(Q):
                target = own[ROWS + other]
                for n in range(mi):
                    J[row, i, target, n] += w * shift[other * mi + n]
            J[row, i, 0, mi] += w * shift[Q * mi]


@separate_leaf
def joined(waves, place, rate, signals, wanted, sums, line, ways):
    """Turn spectra into forces and derivatives: multiply them out and add them to ``F`` and ``J``; ``line`` (mi,) and ``ways``
    (2, 2 L - 1) are overwritten."""
    c, v, cp, vp = signals[0], signals[1], signals[2], signals[3]
    spectra, F, J = sums
    mi = waves.size
    for row in range(spectra.shape[1]):
        for target in range(spectra.shape[1]):
            for part in range(4):
                S = spectra[part, row, target]
                if part > 1 and not wanted or not nonzero(S):
                    continue
                signal, shifted = (c[target], cp[target]) if part % 2 == 0 else (v[target], vp[target])
                moves = size(shifted) > 0.0
                both_ways(S, ways[0], ways[1])
                for i in range(place.size):
                    spectrum_row(ways[0], ways[1], waves, place[i], line)
                    total = inner(line, signal)
                    if part > 1:
                        J[row, i, 0, mi] += total
                        continue
                    F[row, i] += total
                    if moves:
                        J[row, i, 0, mi] += inner(line, shifted)
                    if wanted and part == 0:
                        onto = J[row, i, target]
                        for b in range(mi):
                            onto[b] += line[b]
                    elif wanted:
                        for b in range(1, mi, 2):
                            turn = rate * waves[b]
                            J[row, i, target, b] -= turn * line[b + 1]
                            J[row, i, target, b + 1] += turn * line[b]


@leaf
def signals(S, flat, dflat, c, v, cp, vp, a):
    """Add base motion and drift to the rows' coordinates ``c``; write speeds ``v`` and both derivatives by the parameter; ``a``
    (mi,) is overwritten."""
    waves, _, excited, _ = structure(S)
    base, drift = moved(S, flat)
    dbase, ddrift = moved(S, dflat)
    rate, drate = flat[0], dflat[0]
    for row in range(len(c)):
        for j in range(a.size):
            cp[row, j] = 0.0
        for x in range(excited.size):
            c[row, excited[x]] += base[row, x]
            cp[row, excited[x]] += dbase[row, x]
        turned(waves, c[row], a)
        for j in range(a.size):
            v[row, j] = rate * a[j]
            vp[row, j] = drate * a[j]
        v[row, 0] += drift[row]
        turned(waves, cp[row], a)
        for j in range(a.size):
            vp[row, j] += rate * a[j]
        vp[row, 0] += ddrift[row]
