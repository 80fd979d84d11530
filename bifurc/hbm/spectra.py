"""Forces of contacts and their derivatives as Fourier coefficients, from the segments of their modes, in closed form.

Within a segment the force is affine in the motion, so that its coefficients and their derivatives follow from the spectrum
of the segment's indicator up to twice the top harmonic (a Toeplitz and a Hankel part), one rank-one term a segment with
frozen memory, and one an event at which the force jumps.  Exact and sampled segments differ in one list of numbers:

    (1/2 pi) int_a^b e^{il theta} = d_l (e^{ilb} - e^{ila}),  d_l = 1/(2 pi i l)
    (1/N) sum_{a <= theta_j < b} e^{il theta_j} = the same with d_l = 1/(N (e^{2 pi il/N} - 1))
"""
import numpy as np

from .._jit import njit
from .march import AFTER, GUARD, MODE, WROTE, expression, forgets, guard_of, width
from .parts import Numbers, Shape
from .waves import jet, powers, size, spectrum, turned

NEGLIGIBLE = 1e-11  # relative: a force without jump, a memory without slope


@njit
def divisors(count, samples, out):
    """Write d_l, l = 0 .. count - 1, into ``out`` (count, 2) as real and imaginary part; samples = 0: exact."""
    out[0] = 0.0
    for l in range(1, count):
        if samples:
            half = np.pi * l / samples  # 1/(e^{2ix} - 1) = -1/2 - i/(2 tan x)
            out[l, 0], out[l, 1] = -0.5 / samples, -0.5 / (samples * np.tan(half))
        else:
            out[l, 0], out[l, 1] = 0.0, -0.5 / (np.pi * l)


@njit
def add(out, factor, spectrum):
    """Add a multiple of a spectrum (count, 2)."""
    for l in range(len(out)):
        out[l, 0] += factor * spectrum[l, 0]
        out[l, 1] += factor * spectrum[l, 1]


@njit
def nonzero(spectrum):
    """Return whether a spectrum (count, 2) has an entry that is not zero."""
    for l in range(len(spectrum)):
        if spectrum[l, 0] != 0.0 or spectrum[l, 1] != 0.0:
            return True
    return False


@njit
def indicator(a, b, Ea, Eb, D, out):
    """Write the spectrum of the indicator of [a, b] into ``out`` (count, 2), from powers at both ends and divisors."""
    out[0, 0], out[0, 1] = (b - a) / (2.0 * np.pi), 0.0
    for l in range(1, len(out)):
        c, s = Eb[l, 0] - Ea[l, 0], Eb[l, 1] - Ea[l, 1]
        out[l, 0], out[l, 1] = D[l, 0] * c - D[l, 1] * s, D[l, 0] * s + D[l, 1] * c


@njit
def coefficients(T, waves, place, out):
    """Write the coefficients (slots,) of a signal with spectrum ``T`` into ``out``."""
    for i in range(place.size):
        a = place[i]
        if a == 0:
            out[i] = T[0, 0]
        else:
            out[i] = 2.0 * T[waves[a], 1 - a % 2]


@njit
def local_slopes(shape: Shape, T: Numbers, dT: Numbers, k, TU, TS, TZ, TH, dTU, dTS, dTH, p, c, v, cp, vp, z, dz, out):
    """Write the derivative of an expression at one phase by the coefficients of the contact's rows, and by the parameter.

    ``out`` (Q mi + 1,): row by row, the parameter last; ``dz`` (Z, Q mi + 1) the derivative of the memory.
    """
    waves, mi, Q = shape.waves, shape.waves.size, width(shape, k)
    a = np.empty(mi)
    rate = T.omega[0]
    for q in range(Q):
        first = q * mi
        fu, fs = TU[q], TS[q] * rate
        out[first] = fu
        for j in range(1, mi, 2):
            n = waves[j]
            co, si = p[n, 0], p[n, 1]
            out[first + j] = fu * co - fs * n * si
            out[first + j + 1] = fu * si + fs * n * co
    none = z[:0]
    expression(TU, TS, TZ, TH, shape.rows[k], Q, shape.excited, cp, vp, none, a)
    for x in range(TH.size):
        a[shape.excited[x]] -= TH[x]
    total = jet(waves, a, p)[0]
    expression(dTU, dTS, TZ, dTH, shape.rows[k], Q, shape.excited, c, v, none, a)
    out[Q * mi] = total + jet(waves, a, p)[0]
    for i in range(z.size):
        if TZ[i] != 0.0:
            for j in range(out.size):
                out[j] += TZ[i] * dz[i, j]


@njit
def written(shape: Shape, T: Numbers, dT: Numbers, k, m, g, theta, c, v, cp, vp, z, dz, moves):
    """Change ``dz`` to the derivatives of the memory that mode ``m`` wrote when its guard ``g`` (-1: none) was reached."""
    waves, mi, Q, Z = shape.waves, shape.waves.size, width(shape, k), shape.memory[k]
    p, a = np.empty((waves[-1] + 1, 2)), np.empty(mi)
    powers(theta, p.shape[0], p)
    new = np.empty(Q * mi + 1)
    none = z[:0]
    shift = np.zeros(Q * mi + 1)
    known = False
    for i in range(Z):
        if not shape.slaved[k, m, i]:
            continue
        local_slopes(shape, T, dT, k, T.ZU[k, m, i], T.ZS[k, m, i], none, T.ZH[k, m, i], dT.ZU[k, m, i], dT.ZS[k, m, i],
                     dT.ZH[k, m, i], p, c, v, cp, vp, none, dz, new)
        if moves and g >= 0:
            expression(T.ZU[k, m, i], T.ZS[k, m, i], none, T.ZH[k, m, i], shape.rows[k], Q, shape.excited, c, v, none, a)
            slope = jet(waves, a, p)[1]
            if abs(slope) > NEGLIGIBLE * waves[-1] * size(a):
                if not known:
                    delay(shape, T, dT, k, m, g, p, c, v, cp, vp, z, dz, shift)
                    known = True
                for j in range(new.size):
                    new[j] += slope * shift[j]
        for j in range(new.size):
            dz[i, j] = new[j]


@njit
def delay(shape: Shape, T: Numbers, dT: Numbers, k, m, g, p, c, v, cp, vp, z, dz, out):
    """Write the derivative of the phase of an event by the coefficients of the rows and by the parameter."""
    a = np.empty(shape.waves.size)
    guard_of(shape, T, k, m, g, c, v, z, a)
    rate = jet(shape.waves, a, p)[1]
    local_slopes(shape, T, dT, k, T.GU[k, m, g], T.GS[k, m, g], T.GZ[k, m, g], T.GH[k, m, g], dT.GU[k, m, g], dT.GS[k, m, g],
                 dT.GH[k, m, g], p, c, v, cp, vp, z, dz, out)
    # the numbers by which guards weigh memory may depend on the parameter as well
    for i in range(z.size):
        out[out.size - 1] += dT.GZ[k, m, g, i] * z[i]
    for j in range(out.size):  # a touch moves like a root, and its effect vanishes with the speed of the guard
        out[j] = -out[j] / rate if rate != 0.0 else 0.0


@njit
def gather(shape: Shape, T: Numbers, dT: Numbers, k, path, ends, zs, source, count, c, v, cp, vp, samples, D, slopes,
           SU, SS, PU, PS, F, J):
    """Add what contact ``k`` gives along its segments.

    Parameters
    ----------
    path, ends, zs, source, count
        As `march.exact` and `march.sampled` leave them; ``count`` the number of segments.
    c, v, cp, vp : (nr, mi)
        Coefficients of coordinates and speeds, and their derivatives by the parameter at fixed unknowns.
    samples : int
        0: exact.
    D : (L, 2)
        See `divisors`.
    slopes : bool
        Derivatives are wanted.
    SU, SS, PU, PS : (nr, nr, L, 2)
        Spectra by which the rows' coordinates and speeds act on the rows' forces, and their derivatives by the parameter.
    F : (nr, slots)
        Forces that are not proportional to the rows' motion.
    J : (nr, slots, nr, mi + 1)
        Rank-one terms of the derivatives; the last column of row 0 is that by the parameter.
    """
    waves, place, mi, m_slots = shape.waves, shape.place, shape.waves.size, shape.place.size
    Q, Z, L = width(shape, k), shape.memory[k], len(D)
    modes = shape.modes[k]
    total = np.zeros((modes, L, 2))
    Ea, Eb, I = np.empty((L, 2)), np.empty((L, 2)), np.empty((L, 2))
    seen = np.zeros(modes, np.bool_)
    e = np.empty(m_slots)
    dz = np.zeros((Z, Q * mi + 1))
    none = zs[0, :0]
    before, moves = source.size - 3, samples < 0  # -1 and False, but no literals: each compiles all callees again
    if slopes and Z:
        if source[0] < 0.0:
            for i in range(Z):
                for q in range(Q):
                    dz[i, q * mi] = T.XU[k, i, q]
                    row = shape.rows[k, q]
                    dz[i, Q * mi] += T.XU[k, i, q] * cp[row, 0] + T.XS[k, i, q] * vp[row, 0] \
                        + dT.XU[k, i, q] * c[row, 0] + dT.XS[k, i, q] * v[row, 0]
        else:
            written(shape, T, dT, k, int(source[0]), before, source[1], c, v, cp, vp, none, dz, moves)
        first = 0
        for n in range(count - 1):  # the memory at phase 0 was written by the last event before it
            if path[n, WROTE] >= 0 and forgets(shape, k, path[n, WROTE]):
                first = n
        for n in range(first, count - 1):
            if path[n, WROTE] >= 0:
                written(shape, T, dT, k, path[n, WROTE], path[n, GUARD] if path[n, WROTE] == path[n, MODE] else -1, ends[n, 1],
                        c, v, cp, vp, zs[n, :Z], dz, samples == 0)
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
        seen[m] = True
        for q in range(Q):
            for i in range(Z):
                weight, turn = T.FZ[k, m, q, i], dT.FZ[k, m, q, i]
                if weight != 0.0 or turn != 0.0:
                    row = shape.rows[k, q]
                    coefficients(I, waves, place, e)
                    for j in range(m_slots):
                        F[row, j] += weight * zs[n, i] * e[j]
                    if slopes:
                        for j in range(m_slots):
                            for other in range(Q):
                                target = shape.rows[k, other]
                                w = weight * e[j]
                                for b in range(mi):
                                    J[row, j, target, b] += w * dz[i, other * mi + b]
                            J[row, j, 0, mi] += (weight * dz[i, Q * mi] + turn * zs[n, i]) * e[j]
        if slopes and n < count - 1:
            g, after = path[n, GUARD], path[n, AFTER]
            if samples == 0 and not shape.silent[k, m, g]:
                if path[n + 1, AFTER] == m and ends[n + 1, 0] == stop:  # there and back: the instant is that of the way back
                    jumps(shape, T, dT, k, m, m, after, path[n + 1, GUARD], stop, zs[n, :Z], zs[n + 2, :Z], c, v, cp, vp, dz, J)
                else:
                    jumps(shape, T, dT, k, m, after, m, g, stop, zs[n, :Z], zs[n + 1, :Z], c, v, cp, vp, dz, J)
            if path[n, WROTE] >= 0:
                written(shape, T, dT, k, path[n, WROTE], g if path[n, WROTE] == m else -1, ends[n, 1], c, v, cp, vp, zs[n, :Z], dz,
                        samples == 0)
        start = stop
        Ea, Eb = Eb, Ea
    for m in range(modes):
        if not seen[m]:
            continue
        for q in range(Q):
            row = shape.rows[k, q]
            for other in range(Q):
                target = shape.rows[k, other]
                if T.FU[k, m, q, other] != 0.0:
                    add(SU[row, target], T.FU[k, m, q, other], total[m])
                if T.FS[k, m, q, other] != 0.0:
                    add(SS[row, target], T.FS[k, m, q, other], total[m])
                if dT.FU[k, m, q, other] != 0.0:
                    add(PU[row, target], dT.FU[k, m, q, other], total[m])
                if dT.FS[k, m, q, other] != 0.0:
                    add(PS[row, target], dT.FS[k, m, q, other], total[m])
            for x in range(shape.excited.size):
                weight, turn = T.FH[k, m, q, x], dT.FH[k, m, q, x]
                if weight == 0.0 and turn == 0.0:
                    continue
                slot = shape.excited[x]
                if slot == 0:
                    coefficients(total[m], waves, place, e)
                else:
                    modulated(total[m], waves, place, slot, e)
                for j in range(m_slots):
                    F[row, j] += weight * e[j]
                    J[row, j, 0, mi] += turn * e[j]


@njit
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


@njit
def jumps(shape: Shape, T: Numbers, dT: Numbers, k, m, after, mode, g, theta, z, znew, c, v, cp, vp, dz, J):
    """Add the derivatives by the phase of an event at which the force jumps, if it does; guard ``g`` of ``mode`` sets the phase."""
    waves, place, mi, Q = shape.waves, shape.place, shape.waves.size, width(shape, k)
    p, a, b = np.empty((waves[-1] + 1, 2)), np.empty(mi), np.empty(mi)
    powers(theta, p.shape[0], p)
    shift = np.empty(Q * mi + 1)
    known = False
    for q in range(Q):
        expression(T.FU[k, m, q], T.FS[k, m, q], T.FZ[k, m, q], T.FH[k, m, q], shape.rows[k], Q, shape.excited, c, v, z, a)
        expression(T.FU[k, after, q], T.FS[k, after, q], T.FZ[k, after, q], T.FH[k, after, q], shape.rows[k], Q, shape.excited,
                   c, v, znew, b)
        gap = jet(waves, a, p)[0] - jet(waves, b, p)[0]
        if abs(gap) <= NEGLIGIBLE * (size(a) + size(b)):
            continue
        if not known:
            delay(shape, T, dT, k, mode, g, p, c, v, cp, vp, z, dz, shift)
            known = True
        row = shape.rows[k, q]
        for i in range(place.size):
            s = place[i]
            w = gap / (2.0 * np.pi) if s == 0 else gap / np.pi * p[waves[s], 1 - s % 2]
            for other in range(Q):
                target = shape.rows[k, other]
                for n in range(mi):
                    J[row, i, target, n] += w * shift[other * mi + n]
            J[row, i, 0, mi] += w * shift[Q * mi]


@njit
def joined(shape: Shape, T: Numbers, SU, SS, PU, PS, c, v, cp, vp, slopes, F, J):
    """Turn spectra into forces and derivatives: multiply them out and add them to ``F`` and ``J``, see `gather`."""
    waves, place, mi, m_slots = shape.waves, shape.place, shape.waves.size, shape.place.size
    B = np.empty((m_slots, mi))
    for row in range(len(SU)):
        for target in range(len(SU)):
            for part in range(2):
                S = SU[row, target] if part == 0 else SS[row, target]
                if nonzero(S):
                    signal, moved = (c[target], cp[target]) if part == 0 else (v[target], vp[target])
                    B[:] = 0.0
                    spectrum(S, waves, place, m_slots, B)
                    for i in range(m_slots):
                        total, slope = 0.0, 0.0
                        for b in range(mi):
                            total += B[i, b] * signal[b]
                            slope += B[i, b] * moved[b]
                        F[row, i] += total
                        J[row, i, 0, mi] += slope
                    if slopes and part == 0:
                        for i in range(m_slots):
                            for b in range(mi):
                                J[row, i, target, b] += B[i, b]
                    elif slopes:
                        for i in range(m_slots):
                            for b in range(1, mi, 2):
                                rate = T.omega[0] * waves[b]
                                J[row, i, target, b] -= rate * B[i, b + 1]
                                J[row, i, target, b + 1] += rate * B[i, b]
                S = PU[row, target] if part == 0 else PS[row, target]
                if slopes and nonzero(S):
                    signal = c[target] if part == 0 else v[target]
                    B[:] = 0.0
                    spectrum(S, waves, place, m_slots, B)
                    for i in range(m_slots):
                        total = 0.0
                        for b in range(mi):
                            total += B[i, b] * signal[b]
                        J[row, i, 0, mi] += total


@njit
def signals(shape: Shape, T: Numbers, dT: Numbers, c, v, cp, vp):
    """Add base motion and drift to the rows' coordinates ``c``; write speeds ``v`` and both derivatives by the parameter."""
    a = np.empty(shape.waves.size)
    rate, drate = T.omega[0], dT.omega[0]
    for row in range(len(c)):
        for j in range(a.size):
            cp[row, j] = 0.0
        for x in range(shape.excited.size):
            c[row, shape.excited[x]] += T.base[row, x]
            cp[row, shape.excited[x]] += dT.base[row, x]
        turned(shape.waves, c[row], a)
        for j in range(a.size):
            v[row, j] = rate * a[j]
            vp[row, j] = drate * a[j]
        v[row, 0] += T.drift[row]
        turned(shape.waves, cp[row], a)
        for j in range(a.size):
            vp[row, j] += rate * a[j]
        vp[row, 0] += dT.drift[row]
