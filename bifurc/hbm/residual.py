"""Residual of a balance and its derivatives: dynamic stiffness, excitation, and the forces of contacts along the motion.

    (K - k^2 nu^2 M) a_k + k nu C b_k = e_k + R^T f_k (cosines),   (K - k^2 nu^2 M) b_k - k nu C a_k = ... (sines)

Derivatives are exact, also that by a parameter of the system, given the derivative of the packed numbers by it.
"""
from typing import NamedTuple

import numpy as np

from .._jit import both, njit
from .march import FOLLOWED, NOT_FINITE, arose, exact, sampled
from .parts import Numbers, Shape
from .spectra import divisors, gather, joined, signals

TOUCH = 0.5  # part of a guard's size below zero up to which it counts as a touch where events are missing


@njit
def unpacked(flat, shape: Shape):
    """Return the flat vector by name, see `parts.views`."""
    d = shape.dims
    n, m, nr, nx, nc, M, Q, G, Z, values = d[0], d[1], d[2], d[4], d[5], d[6], d[7], d[8], d[9], d[12]
    i = 0
    omega = flat[i:i + 1]
    i += 1
    mass = flat[i:i + n * n].reshape(n, n)
    i += n * n
    damping = flat[i:i + n * n].reshape(n, n)
    i += n * n
    stiffness = flat[i:i + n * n].reshape(n, n)
    i += n * n
    E = flat[i:i + m * n].reshape(m, n)
    i += m * n
    base = flat[i:i + nr * nx].reshape(nr, nx)
    i += nr * nx
    drift = flat[i:i + nr]
    i += nr
    s = nc * M * Q * Q
    FU = flat[i:i + s].reshape(nc, M, Q, Q)
    i += s
    FS = flat[i:i + s].reshape(nc, M, Q, Q)
    i += s
    s = nc * M * Q * Z
    FZ = flat[i:i + s].reshape(nc, M, Q, Z)
    i += s
    s = nc * M * Q * nx
    FH = flat[i:i + s].reshape(nc, M, Q, nx)
    i += s
    s = nc * M * G * Q
    GU = flat[i:i + s].reshape(nc, M, G, Q)
    i += s
    GS = flat[i:i + s].reshape(nc, M, G, Q)
    i += s
    s = nc * M * G * Z
    GZ = flat[i:i + s].reshape(nc, M, G, Z)
    i += s
    s = nc * M * G * nx
    GH = flat[i:i + s].reshape(nc, M, G, nx)
    i += s
    s = nc * M * Z * Q
    ZU = flat[i:i + s].reshape(nc, M, Z, Q)
    i += s
    ZS = flat[i:i + s].reshape(nc, M, Z, Q)
    i += s
    s = nc * M * Z * nx
    ZH = flat[i:i + s].reshape(nc, M, Z, nx)
    i += s
    s = nc * Z * Q
    XU = flat[i:i + s].reshape(nc, Z, Q)
    i += s
    XS = flat[i:i + s].reshape(nc, Z, Q)
    i += s
    law = flat[i:i + values]
    return Numbers(omega, mass, damping, stiffness, E, base, drift, FU, FS, FZ, FH, GU, GS, GZ, GH, ZU, ZS, ZH, XU, XS, law)


@njit
def synthesised(waves, cosines, sines, c, U, dU, ddU, twice):
    """Write values and derivatives by phase of the rows ``c`` (nr, mi) on a grid, from its tables (nk, grid + 1)."""
    count = U.shape[1]
    for row in range(len(c)):
        for n in range(count):
            U[row, n] = c[row, 0]
            dU[row, n] = 0.0
            ddU[row, n] = 0.0
        for j in range(1, waves.size, 2):
            k, i = waves[j], j // 2
            a, b = c[row, j], c[row, j + 1]
            if a == 0.0 and b == 0.0:
                continue
            ka, kb = k * a, k * b
            if twice:
                for n in range(count):
                    co, si = cosines[i, n], sines[i, n]
                    u = a * co + b * si
                    U[row, n] += u
                    dU[row, n] += kb * co - ka * si
                    ddU[row, n] -= k * k * u
            else:
                for n in range(count):
                    co, si = cosines[i, n], sines[i, n]
                    U[row, n] += a * co + b * si
                    dU[row, n] += kb * co - ka * si


@njit
def excitation(shape: Shape, cosines, sines, excite, dexcite):
    """Write the columns of excitation on a grid, and their derivatives by phase."""
    for x in range(1, shape.excited.size):
        slot = shape.excited[x]
        i, k = (slot - 1) // 2, shape.waves[slot]
        for n in range(excite.shape[1]):
            co, si = cosines[i, n], sines[i, n]
            excite[x, n] = si if slot % 2 == 0 else co
            dexcite[x, n] = k * co if slot % 2 == 0 else -k * si


@njit
def followed(shape: Shape, T: Numbers, samples, cosines, sines, c, v, paths, ends, zs, sources, counts):
    """Follow all contacts along rows with coefficients ``c``, ``v``; return the code of a `MarchStatus`."""
    return followed_as(shape, T, samples, cosines, sines, c, v, np.full(shape.modes.size, -1), paths, ends, zs, sources, counts)


@njit
def followed_as(shape: Shape, T: Numbers, samples, cosines, sines, c, v, listed, paths, ends, zs, sources, counts):
    """Follow all contacts as `followed`, with numbers of events that are given.

    ``listed`` (nc,): events of each contact, -1: as they come.  Where a contact has more, the least of them are ignored; where
    it has fewer, guards that nearly fire count as touches: so the equations of an order of events go on smoothly beyond the
    point where the order changes, as far as a corrector looks.
    """
    nr, nodes = len(c), cosines.shape[1]
    for row in range(nr):
        for j in range(c.shape[1]):
            if not np.isfinite(c[row, j]) or not np.isfinite(v[row, j]):
                return NOT_FINITE
    U, dU, ddU = np.empty((nr, nodes)), np.empty((nr, nodes)), np.empty((nr, nodes))
    synthesised(shape.waves, cosines, sines, c, U, dU, ddU, samples == 0)
    rate = T.omega[0]
    V = np.empty((nr, nodes))
    for row in range(nr):
        for n in range(nodes):
            V[row, n] = v[row, 0] + rate * dU[row, n]
            ddU[row, n] *= rate
    excite, dexcite = np.zeros((shape.excited.size, nodes)), np.zeros((shape.excited.size, nodes))
    excitation(shape, cosines, sines, excite, dexcite)
    a = np.empty(shape.waves.size)
    for k in range(shape.modes.size):
        skip, touch = 0.0, 0.0
        for attempt in range(2):
            if samples:
                status = sampled(shape, T, k, c, v, U, V, excite, skip, touch, paths[k], ends[k], zs[k], sources[k], counts[k])
            else:
                status = exact(shape, T, k, c, v, U, V, dU, ddU, excite, dexcite, skip, touch, paths[k], ends[k], zs[k], sources[k],
                               counts[k])
            if status != FOLLOWED:
                return status
            events = counts[k, 0] - 1
            if attempt == 1 or listed[k] < 0 or events == listed[k]:
                break
            if events < listed[k]:
                touch = TOUCH
                continue
            heights = np.empty(events)
            for n in range(events):
                heights[n] = arose(shape, T, k, c, v, samples, paths[k], ends[k], zs[k], n, a)
            drop = (events - listed[k] + 1) // 2
            for i in range(1, events):  # sorted by insertion
                n = i
                while n > 0 and heights[n - 1] > heights[n]:
                    heights[n - 1], heights[n] = heights[n], heights[n - 1]
                    n -= 1
            skip = 0.5 * (heights[drop - 1] + heights[drop]) if drop < events else 2.0
    return FOLLOWED


@njit
def assembled(shape: Shape, T: Numbers, dT: Numbers, x, F, J, slopes, f, wide):
    """Write residual ``f`` (slots n,) and derivatives ``wide`` (slots n, slots n + 1), the last by the parameter."""
    n, m, nr = shape.dims[0], shape.place.size, len(F)
    waves, place, R = shape.waves, shape.place, shape.R
    nu, dnu = T.omega[0], dT.omega[0]
    size, mi = m * n, waves.size
    wide[:] = 0.0
    for i in range(m):
        slot = place[i]
        k = waves[slot]
        w, dw = k * nu, k * dnu
        for a in range(n):
            total, slope = -T.E[i, a], -dT.E[i, a]
            for r in range(nr):
                if R[r, a] != 0.0:
                    total -= R[r, a] * F[r, i]
                    slope -= R[r, a] * J[r, i, 0, mi]
            for b in range(n):
                d = T.K[a, b] - w * w * T.M[a, b]
                q = x[i * n + b]
                total += d * q
                slope += (dT.K[a, b] - w * w * dT.M[a, b] - 2.0 * w * dw * T.M[a, b]) * q
                wide[i * n + a, i * n + b] += d
                if k > 0:
                    other, way = (i - 1, -1.0) if slot % 2 == 0 else (i + 1, 1.0)
                    q = x[other * n + b]
                    total += way * w * T.C[a, b] * q
                    slope += way * (w * dT.C[a, b] + dw * T.C[a, b]) * q
                    wide[i * n + a, other * n + b] += way * w * T.C[a, b]
            f[i * n + a] = total
            wide[i * n + a, size] = slope
    if not slopes:
        return
    for r in range(nr):
        for a in range(n):
            if R[r, a] == 0.0:
                continue
            for t in range(nr):
                for b in range(n):
                    weight = R[r, a] * R[t, b]
                    if weight == 0.0:
                        continue
                    for i in range(m):
                        for j in range(m):
                            wide[i * n + a, j * n + b] -= weight * J[r, i, t, place[j]]


@njit
def rows_of(shape: Shape, x, c):
    """Write the coefficients of the rows' coordinates (nr, mi) of the packed motion ``x``; base motion is not in it."""
    n = shape.dims[0]
    c[:] = 0.0
    for r in range(len(c)):
        for a in range(n):
            weight = shape.R[r, a]
            if weight != 0.0:
                for i in range(shape.place.size):
                    c[r, shape.place[i]] += weight * x[i * n + a]


@both
def motion(shape: Shape, flat, dflat, x, c, v, cp, vp):
    """Write the coefficients (nr, mi) of the rows' coordinates and speeds, and their derivatives by the parameter."""
    T, dT = unpacked(flat, shape), unpacked(dflat, shape)
    rows_of(shape, x, c)
    signals(shape, T, dT, c, v, cp, vp)


class Grid(NamedTuple):
    """Where motions are looked at: 0 or the number of samples, and tables (nk, grid + 1) of the waves, both ends included."""

    samples: int
    cosines: np.ndarray
    sines: np.ndarray


class Room(NamedTuple):
    """Arrays that kernels overwrite; see `spectra.gather` and `march.exact`."""

    SU: np.ndarray
    SS: np.ndarray
    PU: np.ndarray
    PS: np.ndarray
    F: np.ndarray
    J: np.ndarray
    f: np.ndarray  # (size,) residual
    wide: np.ndarray  # (size, size + 1) derivatives
    paths: np.ndarray  # of every contact
    ends: np.ndarray
    zs: np.ndarray
    sources: np.ndarray
    counts: np.ndarray


@njit
def cleared(room: Room):
    """Set to zero what is added to."""
    room.SU[:], room.SS[:], room.PU[:], room.PS[:] = 0.0, 0.0, 0.0, 0.0
    room.F[:], room.J[:] = 0.0, 0.0


@both
def linearised(shape: Shape, flat, dflat, x, grid: Grid, slopes, listed, room: Room):
    """Write residual and derivatives of the balance at the packed motion ``x`` into ``room``.

    Spectra, forces and derivatives of laws must be there (or zeros); those of the contacts are added.

    Parameters
    ----------
    flat, dflat : ndarray
        Numbers of the system and their derivatives by the parameter.
    slopes : bool
        False: derivatives are not complete.
    listed : int (nc,)
        Events of each contact, see `followed_as`.

    Returns
    -------
    int
        Code of a `MarchStatus`.
    """
    T, dT = unpacked(flat, shape), unpacked(dflat, shape)
    nr, mi = len(shape.R), shape.waves.size
    c, v, cp, vp = np.empty((nr, mi)), np.empty((nr, mi)), np.empty((nr, mi)), np.empty((nr, mi))
    rows_of(shape, x, c)
    signals(shape, T, dT, c, v, cp, vp)
    status = followed_as(shape, T, grid.samples, grid.cosines, grid.sines, c, v, listed, room.paths, room.ends, room.zs,
                         room.sources, room.counts)
    if status != FOLLOWED:
        return status
    D = np.empty((room.SU.shape[2], 2))
    divisors(len(D), grid.samples, D)
    for k in range(shape.modes.size):
        gather(shape, T, dT, k, room.paths[k], room.ends[k], room.zs[k], room.sources[k], room.counts[k, 0], c, v, cp, vp,
               grid.samples, D, slopes, room.SU, room.SS, room.PU, room.PS, room.F, room.J)
    joined(shape, T, room.SU, room.SS, room.PU, room.PS, c, v, cp, vp, slopes, room.F, room.J)
    assembled(shape, T, dT, x, room.F, room.J, slopes, room.f, room.wide)
    return FOLLOWED
