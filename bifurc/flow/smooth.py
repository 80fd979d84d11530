"""Engine of modes under a law that is not affine: state after a time, its derivative, guards as polynomials.

A step solves the collocation equations at eight Gauss points (order 16; the idea of integrating to the last digit with
few long steps is Everhart's, 1985, and Rein and Spiegel's, 2015) by iterating the accelerations at the nodes.  Positions
are twice integrated, so that an iteration gains two orders of the step.  The nodes also carry the derivative (the same
iteration, linear) and a polynomial of every guard over the whole step.

This module is a template: the written module of a scene (`bifurc.compose.writer`) is this text with the law functions
of that scene in the place of `nolaw`.  As it stands it integrates affine scenes, which the tests use.
"""
from typing import NamedTuple

import numpy as np

from .._jit import njit
from ..compose.tables import TURN
from .affine import forcing
from .gauss import C, DOUBLE, EDGES, MOMENTS, NODES, SINGLE, WEIGHTS
from .nolaw import COUNT, FIRST, WIDTH, forces, slopes

ANGLE = 1.2  # largest phase of the highest harmonic in a step: Taylor series of guards to ORDER are good to 6e-14
LONGEST = 2.0  # largest first step, in units of the Taylor tables' step
DEFECT = 1e-7  # aimed at: the interpolated acceleration against the true one at the ends; the state errs like its square
WORST = 30.0  # times DEFECT is still accepted
ITERATIONS = 30
SHORTEST = 1e-6  # of the Taylor tables' step: a law with a kink is crossed with steps of this size


class Work(NamedTuple):
    """Arrays of a step: at the nodes unless said otherwise."""

    q: np.ndarray  # (n, NODES)
    v: np.ndarray  # (n, NODES)
    a: np.ndarray  # (n, NODES)
    base: np.ndarray  # (n, NODES) acceleration by the forcing states
    u: np.ndarray  # (rows, NODES) coordinates of the law rows, their speeds, their forces
    s: np.ndarray
    f: np.ndarray
    ub: np.ndarray  # (rows, NODES) parts of u and s by the forcing states
    sb: np.ndarray
    turn: np.ndarray  # (nw, NODES + 1) cos and sin of k omega h c in the places of w, the whole step last


@njit
def workspace(T):
    """Return the arrays of a step."""
    n, rows, nw = T.A.shape[1] // 2, T.LU.shape[0], T.A.shape[2] - T.A.shape[1]
    N = NODES
    return Work(np.empty((n, N)), np.empty((n, N)), np.empty((n, N)), np.empty((n, N)), np.empty((rows, N)),
                np.empty((rows, N)), np.empty((rows, N)), np.empty((rows, N)), np.empty((rows, N)),
                np.empty((nw, N + 1)))


@njit
def field(T, m, x, f):
    """Write y' of mode ``m`` into ``f`` (ns,)."""
    ns, nx = T.A.shape[1], T.A.shape[2]
    n, rows = ns // 2, T.LU.shape[0]
    for i in range(n):
        f[i] = x[n + i]
    for i in range(n, ns):
        total = 0.0
        for c in range(nx):
            total += T.A[m, i, c] * x[c]
        f[i] = total
    if rows > 0:
        u, s, force = np.empty((rows, 1)), np.empty((rows, 1)), np.empty((rows, 1))
        site(T, x, u, s)
        forces(T, m, u, s, force)
        for r in range(rows):
            for i in range(n):
                f[n + i] += T.LP[m, r, i] * force[r, 0]


@njit
def site(T, x, u, s):
    """Write coordinates and speeds of the law rows at ``x`` into the first column of ``u``, ``s``."""
    for r in range(u.shape[0]):
        total, speed = 0.0, 0.0
        for c in range(T.A.shape[2]):
            total += T.LU[r, c] * x[c]
            speed += T.LS[r, c] * x[c]
        u[r, 0] = total
        s[r, 0] = speed


@njit
def prepare(T, h, W):
    """Fill the turns of the forcing states over a step ``h``."""
    for k in range(T.harmonics.size):
        rate = T.harmonics[k] * T.flat[0] * h
        for j in range(NODES):
            W.turn[1 + 2 * k, j] = np.cos(rate * C[j])
            W.turn[2 + 2 * k, j] = np.sin(rate * C[j])
        W.turn[1 + 2 * k, NODES] = np.cos(rate)
        W.turn[2 + 2 * k, NODES] = np.sin(rate)


@njit
def turned(W, x, ns, c, j):
    """Forcing state number ``c`` at node ``j`` of the step from ``x``."""
    if c == 0:
        return 1.0
    if c % 2 == 1:
        return W.turn[c, j] * x[ns + c] - W.turn[c + 1, j] * x[ns + c + 1]
    return W.turn[c, j] * x[ns + c - 1] + W.turn[c - 1, j] * x[ns + c]


@njit
def solve(T, m, x, h, f0, W):
    """Accelerations at the nodes of the step ``h`` from ``x`` (nx,), ``f0`` (ns,) the field there.

    Returns the number of iterations, 0 where they do not converge, and the largest acceleration.
    """
    ns, nx = T.A.shape[1], T.A.shape[2]
    n, rows = ns // 2, T.LU.shape[0]
    for i in range(n):
        for j in range(NODES):
            W.base[i, j] = 0.0
            W.a[i, j] = f0[n + i]
    for r in range(rows):
        for j in range(NODES):
            W.ub[r, j] = 0.0
            W.sb[r, j] = 0.0
    for c in range(nx - ns):
        for j in range(NODES):
            w = turned(W, x, ns, c, j)
            for i in range(n):
                W.base[i, j] += T.A[m, n + i, ns + c] * w
            for r in range(rows):
                W.ub[r, j] += T.LU[r, ns + c] * w
                W.sb[r, j] += T.LS[r, ns + c] * w
    stiff = (TURN / T.step[m]) ** 2
    old = np.inf
    for iteration in range(1, ITERATIONS + 1):
        for i in range(n):
            for j in range(NODES):
                once, twice = 0.0, 0.0
                for k in range(NODES):
                    twice += DOUBLE[j, k] * W.a[i, k]
                    once += SINGLE[j, k] * W.a[i, k]
                W.q[i, j] = x[i] + h * (C[j] * x[n + i] + h * twice)
                W.v[i, j] = x[n + i] + h * once
        for r in range(rows):
            for j in range(NODES):
                total, speed = W.ub[r, j], W.sb[r, j]
                for i in range(n):
                    total += T.LU[r, i] * W.q[i, j]
                    speed += T.LS[r, n + i] * W.v[i, j]
                W.u[r, j] = total
                W.s[r, j] = speed
        if rows > 0:
            forces(T, m, W.u, W.s, W.f)
        change, top, noise = 0.0, 0.0, 0.0
        for i in range(n):
            for j in range(NODES):
                new = W.base[i, j]
                for k in range(n):
                    new += T.A[m, n + i, k] * W.q[k, j] + T.A[m, n + i, n + k] * W.v[k, j]
                for r in range(rows):
                    new += T.LP[m, r, i] * W.f[r, j]
                change = max(change, abs(new - W.a[i, j]))
                top = max(top, abs(new))
                noise = max(noise, abs(W.q[i, j]))
                W.a[i, j] = new
        noise = 2e-15 * (top + stiff * noise)
        if not np.isfinite(change) or not np.isfinite(top):
            return 0, top
        if change <= noise or (iteration > 1 and change < 0.5 * old and change * change <= noise * (old - change)):
            return iteration, top
        if iteration > 4 and change > 0.5 * old:
            if change <= 1e3 * noise:
                return iteration, top
            if change > old:
                return 0, top
        old = change
    return 0, 0.0


@njit
def finish(T, x, h, W):
    """Move ``x`` (nx,) to the end of the step."""
    ns = T.A.shape[1]
    n = ns // 2
    for i in range(n):
        once, twice = 0.0, 0.0
        for k in range(NODES):
            twice += MOMENTS[k] * W.a[i, k]
            once += WEIGHTS[k] * W.a[i, k]
        x[i] += h * (x[n + i] + h * twice)
        x[n + i] += h * once
    for c in range(1, T.A.shape[2] - ns, 2):
        cos, sin = turned(W, x, ns, c, NODES), turned(W, x, ns, c + 1, NODES)
        x[ns + c], x[ns + c + 1] = cos, sin


@njit
def defect(T, h, f0, f1, top, W):
    """Interpolated against true accelerations at both ends of a step, relative to the largest force and speed."""
    n = f0.size // 2
    worst = 0.0
    for i in range(n):
        a0, a1 = 0.0, 0.0
        for k in range(NODES):
            a0 += EDGES[0, k] * W.a[i, k]
            a1 += EDGES[1, k] * W.a[i, k]
        worst = max(worst, abs(a0 - f0[n + i]), abs(a1 - f1[n + i]))
        top = max(top, abs(f1[i]) / h)
    return worst / top if top > 0.0 else 0.0


@njit
def linearise(T, m, W, K, D):
    """Derivatives of the acceleration at the nodes in positions, ``K`` (n, n, NODES), and velocities, ``D``."""
    ns = T.A.shape[1]
    n, rows = ns // 2, T.LU.shape[0]
    for i in range(n):
        for c in range(n):
            for j in range(NODES):
                K[i, c, j] = T.A[m, n + i, c]
                D[i, c, j] = T.A[m, n + i, n + c]
    if rows > 0:
        fu, fs = np.zeros((rows, WIDTH, NODES)), np.zeros((rows, WIDTH, NODES))
        slopes(T, m, W.u, W.s, W.f, fu, fs)
        for r in range(rows):
            for b in range(COUNT[r]):
                other = FIRST[r] + b
                for i in range(n):
                    for c in range(n):
                        pu = T.LP[m, r, i] * T.LU[other, c]
                        ps = T.LP[m, r, i] * T.LS[other, n + c]
                        for j in range(NODES):
                            K[i, c, j] += pu * fu[r, b, j]
                            D[i, c, j] += ps * fs[r, b, j]


@njit
def vary(n, X, col, h, K, D, iterations, q, v, a):
    """Move column ``col`` of ``X`` (ns, columns), a variation of the state, to the end of the step; ``a`` keeps its nodes."""
    for i in range(n):
        for j in range(NODES):
            total = 0.0
            for c in range(n):
                total += K[i, c, j] * (X[c, col] + h * C[j] * X[n + c, col]) + D[i, c, j] * X[n + c, col]
            a[i, j] = total
    for _ in range(iterations):
        for i in range(n):
            for j in range(NODES):
                once, twice = 0.0, 0.0
                for k in range(NODES):
                    twice += DOUBLE[j, k] * a[i, k]
                    once += SINGLE[j, k] * a[i, k]
                q[i, j] = X[i, col] + h * (C[j] * X[n + i, col] + h * twice)
                v[i, j] = X[n + i, col] + h * once
        for i in range(n):
            for j in range(NODES):
                total = 0.0
                for c in range(n):
                    total += K[i, c, j] * q[c, j] + D[i, c, j] * v[c, j]
                a[i, j] = total
    for i in range(n):
        once, twice = 0.0, 0.0
        for k in range(NODES):
            twice += MOMENTS[k] * a[i, k]
            once += WEIGHTS[k] * a[i, k]
        X[i, col] += h * (X[n + i, col] + h * twice)
        X[n + i, col] += h * once


@njit
def first_step(T, m):
    """Step to try first."""
    h = LONGEST * T.step[m]
    if T.harmonics.size > 0 and T.flat[0] > 0.0:
        h = min(h, ANGLE / (T.harmonics[-1] * T.flat[0]))
    return h


@njit
def travel(T, m, x, s, y1, X):
    """State after the time ``s >= 0`` from ``x`` (nx,) into ``y1`` (ns,); columns of ``X`` (ns, columns) are carried along.

    Where the law leaves the finite numbers the state is NaN, which the callers' statuses catch.
    """
    ns, nx = T.A.shape[1], T.A.shape[2]
    n = ns // 2
    W = workspace(T)
    x = x.copy()
    moved = np.empty(nx)
    f0 = np.empty(ns)
    f1 = np.empty(ns)
    columns = X.shape[1]
    K = np.empty((n, n, NODES if columns > 0 else 0))
    D = np.empty((n, n, NODES if columns > 0 else 0))
    dq, dv, da = np.empty((n, NODES)), np.empty((n, NODES)), np.empty((n, NODES))
    longest = first_step(T, m)
    shortest = SHORTEST * T.step[m]
    h, tabled, left = longest, -1.0, s
    field(T, m, x, f0)
    count = int(np.ceil(left / h))
    while count > 0:
        h = left / count
        if abs(h - tabled) > 1e-14 * h:
            prepare(T, h, W)
            tabled = h
        iterations, top = solve(T, m, x, h, f0, W)
        wish, good = 0.25 * h, False
        if iterations > 0:
            moved[:] = x
            finish(T, moved, h, W)
            field(T, m, moved, f1)
            e = defect(T, h, f0, f1, top, W)
            good = e <= WORST * DEFECT
            if e == e:
                wish = h * min(2.0, max(0.1, 0.9 * (DEFECT / max(e, 1e-30)) ** (1.0 / NODES)))
        if not good:
            if h > shortest:
                longest = wish
                count = int(np.ceil(left / wish))
                continue
            if iterations == 0:
                y1[:] = np.nan
                return
        if columns > 0:
            linearise(T, m, W, K, D)
            for col in range(columns):
                vary(n, X, col, h, K, D, iterations, dq, dv, da)
        x[:] = moved
        f0[:] = f1
        left -= h
        count -= 1
        if count > 0 and (wish < 0.8 * h or wish > 1.6 * h):
            count = int(np.ceil(left / min(wish, first_step(T, m))))
    for i in range(ns):
        y1[i] = x[i]


@njit
def advance(T, m, x, s, y1):
    """Write the state at time ``s >= 0`` after ``x`` (nx,) into ``y1`` (ns,); ``x`` is kept."""
    travel(T, m, x, s, y1, np.empty((x.size, 0)))


@njit
def arc(T, m, x, s, y1, Phi):
    """Like `advance`, with the derivative ``Phi`` (ns, ns) of the state in the state at the start."""
    for i in range(Phi.shape[0]):
        for c in range(Phi.shape[1]):
            Phi[i, c] = 1.0 if i == c else 0.0
    travel(T, m, x, s, y1, Phi)
