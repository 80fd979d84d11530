"""Engine of modes under a law that is not affine: state after a time, its derivative, guards as polynomials.

A step solves the collocation equations at eight Gauss points (order 16; the idea of integrating to the last digit with
few long steps is Everhart's, 1985, and Rein and Spiegel's, 2015) by iterating the accelerations at the nodes.  Positions
are twice integrated, so that an iteration gains two orders of the step.  The nodes also carry the derivative (the same
iteration, linear) and a polynomial of every guard over the whole step.

This module is a template: the written module of a scene (`bifurc.compose.writer`) is this text with the law functions
of that scene in the place of `nolaw`.  As it stands it integrates affine scenes, which the tests use.
"""
import numpy as np

from .._jit import njit
from ..compose.tables import TURN
from .gauss import C, DOUBLE, EDGES, MOMENTS, NODES, SINGLE, WEIGHTS
from .nolaw import COUNT, DOFS, FIRST, ROWS, WIDTH, forces, slopes

ENGINE = ("field", "advance", "arc")  # what replaces the affine functions of the same names in other templates
ANGLE = 1.2  # largest phase of the highest harmonic in a step: Taylor series of guards to ORDER are good to 6e-14
FIRST_STEP = 1.0  # in units of the Taylor tables' step
DEFECT = 1e-7  # aimed at: the interpolated acceleration against the true one at the ends; the state errs like its square
WORST = 30.0  # times DEFECT is still accepted
ITERATIONS = 30
SHORTEST = 1e-6  # of the Taylor tables' step: a law with a kink is crossed with steps of this size


@njit
def field(T, m, x, f):
    """Write y' of mode ``m`` into ``f`` (ns,)."""
    rows = ROWS if DOFS > 0 else T.LU.shape[0]
    rate(T.A, m, T.LU, T.LS, T.LP, T.law, T.acts, x, f, np.empty((3, rows, 1)))


@njit
def rate(A, m, LU, LS, LP, law, acts, x, f, local):
    """Write y' into ``f`` (ns,); ``local`` (3, rows, 1) is room for coordinates, speeds and forces of the laws."""
    n = DOFS if DOFS > 0 else A.shape[1] // 2
    rows = ROWS if DOFS > 0 else LU.shape[0]
    for i in range(n):
        f[i] = x[n + i]
        total = 0.0
        for c in range(x.size):
            total += A[m, n + i, c] * x[c]
        f[n + i] = total
    if rows > 0:
        for r in range(rows):
            total, speed = 0.0, 0.0
            for c in range(x.size):
                total += LU[r, c] * x[c]
                speed += LS[r, c] * x[c]
            local[0, r, 0] = total
            local[1, r, 0] = speed
        forces(law, acts, m, 1, local)
        for r in range(rows):
            for i in range(n):
                f[n + i] += LP[m, r, i] * local[2, r, 0]


@njit
def prepare(harmonics, omega, h, turn):
    """Fill the turns of the forcing states at the nodes and the end of a step ``h``."""
    for k in range(harmonics.size):
        angle = harmonics[k] * omega * h
        for j in range(NODES):
            turn[1 + 2 * k, j] = np.cos(angle * C[j])
            turn[2 + 2 * k, j] = np.sin(angle * C[j])
        turn[1 + 2 * k, NODES] = np.cos(angle)
        turn[2 + 2 * k, NODES] = np.sin(angle)


@njit
def excite(A, m, LU, LS, x, turn, base, local):
    """Write what the forcing states give to accelerations and to the law rows at the nodes of the step from ``x``."""
    n = DOFS if DOFS > 0 else base.shape[0]
    rows = ROWS if DOFS > 0 else LU.shape[0]
    ns = 2 * n
    for i in range(n):
        for j in range(NODES):
            base[i, j] = A[m, n + i, ns]
    for r in range(rows):
        for j in range(NODES):
            local[3, r, j] = LU[r, ns]
            local[4, r, j] = LS[r, ns]
    for c in range(1, x.size - ns, 2):
        cos0, sin0 = x[ns + c], x[ns + c + 1]
        for j in range(NODES):
            cos = turn[c, j] * cos0 - turn[c + 1, j] * sin0
            sin = turn[c, j] * sin0 + turn[c + 1, j] * cos0
            for i in range(n):
                base[i, j] += A[m, n + i, ns + c] * cos + A[m, n + i, ns + c + 1] * sin
            for r in range(rows):
                local[3, r, j] += LU[r, ns + c] * cos + LU[r, ns + c + 1] * sin
                local[4, r, j] += LS[r, ns + c] * cos + LS[r, ns + c + 1] * sin


@njit
def spread(x, i, n, h, a, q, v):
    """Positions and velocities of coordinate ``i`` at the nodes, from its accelerations there."""
    for j in range(NODES):
        once, twice = 0.0, 0.0
        for k in range(NODES):
            twice += DOUBLE[j, k] * a[i, k]
            once += SINGLE[j, k] * a[i, k]
        q[i, j] = x[i] + h * (C[j] * x[n + i] + h * twice)
        v[i, j] = x[n + i] + h * once


@njit
def finish(x, i, n, h, a):
    """Move coordinate ``i`` and its velocity in ``x`` to the end of the step."""
    once, twice = 0.0, 0.0
    for k in range(NODES):
        twice += MOMENTS[k] * a[i, k]
        once += WEIGHTS[k] * a[i, k]
    x[i] += h * (x[n + i] + h * twice)
    x[n + i] += h * once


@njit
def solve(A, m, LU, LS, LP, law, acts, x, h, f0, stiff, turn, local, q, v, a, base):
    """Accelerations ``a`` at the nodes of the step ``h`` from ``x`` (nx,), ``f0`` (ns,) the field there.

    ``local`` (5, rows, NODES): coordinates, speeds, forces of the laws, and what forcing adds to the first two; ``q``,
    ``v``, ``a``, ``base`` (n, NODES).  Returns the number of iterations, 0 where they do not converge, and the largest
    acceleration.
    """
    n = DOFS if DOFS > 0 else a.shape[0]
    rows = ROWS if DOFS > 0 else LU.shape[0]
    excite(A, m, LU, LS, x, turn, base, local)
    for i in range(n):
        for j in range(NODES):
            a[i, j] = f0[n + i]
    old = np.inf
    for iteration in range(1, ITERATIONS + 1):
        for i in range(n):
            spread(x, i, n, h, a, q, v)
        if rows > 0:
            for r in range(rows):
                for j in range(NODES):
                    total, speed = local[3, r, j], local[4, r, j]
                    for i in range(n):
                        total += LU[r, i] * q[i, j]
                        speed += LS[r, n + i] * v[i, j]
                    local[0, r, j] = total
                    local[1, r, j] = speed
            forces(law, acts, m, NODES, local)
        change, top, size = 0.0, 0.0, 0.0
        for i in range(n):
            for j in range(NODES):
                new = base[i, j]
                for k in range(n):
                    new += A[m, n + i, k] * q[k, j] + A[m, n + i, n + k] * v[k, j]
                for r in range(rows):
                    new += LP[m, r, i] * local[2, r, j]
                change = max(change, abs(new - a[i, j]))
                top = max(top, abs(new))
                size = max(size, abs(q[i, j]))
                a[i, j] = new
        noise = 2e-15 * (top + stiff * size)
        if not (change < np.inf):
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
def defect(h, f0, f1, top, a):
    """Interpolated against true accelerations at both ends of a step, relative to the largest force and speed."""
    n = DOFS if DOFS > 0 else a.shape[0]
    worst = 0.0
    for i in range(n):
        a0, a1 = 0.0, 0.0
        for k in range(NODES):
            a0 += EDGES[0, k] * a[i, k]
            a1 += EDGES[1, k] * a[i, k]
        worst = max(worst, abs(a0 - f0[n + i]), abs(a1 - f1[n + i]))
        top = max(top, abs(f1[i]) / h)
    return worst / top if top > 0.0 else 0.0


@njit
def linearise(A, m, LU, LS, LP, law, acts, h, local, slope, K, D):
    """Derivatives of the acceleration at the nodes in positions, ``K`` (n, n, NODES), and velocities, ``D``.

    ``slope`` (2, rows, WIDTH, NODES) is room for the derivatives of the laws.
    """
    n = DOFS if DOFS > 0 else K.shape[0]
    rows = ROWS if DOFS > 0 else LU.shape[0]
    for i in range(n):
        for c in range(n):
            for j in range(NODES):
                K[i, c, j] = A[m, n + i, c]
                D[i, c, j] = A[m, n + i, n + c]
    if rows > 0:
        slopes(law, acts, m, h, local, slope)
        for r in range(rows):
            for b in range(COUNT[r]):
                other = FIRST[r] + b
                for i in range(n):
                    for c in range(n):
                        pu = LP[m, r, i] * LU[other, c]
                        ps = LP[m, r, i] * LS[other, n + c]
                        for j in range(NODES):
                            K[i, c, j] += pu * slope[0, r, b, j]
                            D[i, c, j] += ps * slope[1, r, b, j]


@njit
def vary(x, X, row, h, K, D, iterations, q, v, a):
    """Move row ``row`` of ``X`` (count, ns), a variation of the state, to the end of the step; ``x`` (ns,) is room."""
    n = DOFS if DOFS > 0 else K.shape[0]
    for i in range(2 * n):
        x[i] = X[row, i]
    for i in range(n):
        for j in range(NODES):
            q[i, j] = x[i] + h * C[j] * x[n + i]
            v[i, j] = x[n + i]
    for iteration in range(iterations + 1):
        for i in range(n):
            for j in range(NODES):
                total = 0.0
                for c in range(n):
                    total += K[i, c, j] * q[c, j] + D[i, c, j] * v[c, j]
                a[i, j] = total
        if iteration < iterations:
            for i in range(n):
                spread(x, i, n, h, a, q, v)
    for i in range(n):
        finish(x, i, n, h, a)
    for i in range(2 * n):
        X[row, i] = x[i]


@njit
def travel(T, m, x, s, y1, X):
    """State after the time ``s >= 0`` from ``x`` (nx,) into ``y1`` (ns,); rows of ``X`` (count, ns) are carried along.

    Where the law leaves the finite numbers the state is NaN, which the callers' statuses catch.
    """
    A, LU, LS, LP, law, acts, harmonics = T.A, T.LU, T.LS, T.LP, T.law, T.acts, T.harmonics
    omega, unit = T.flat[0], T.step[m]
    n = DOFS if DOFS > 0 else A.shape[1] // 2
    rows = ROWS if DOFS > 0 else LU.shape[0]
    ns, nx, count = 2 * n, A.shape[2], X.shape[0]
    turn, local, one = np.empty((nx - ns, NODES + 1)), np.empty((5, rows, NODES)), np.empty((3, rows, 1))
    q, v, a, base = np.empty((n, NODES)), np.empty((n, NODES)), np.empty((n, NODES)), np.empty((n, NODES))
    now, moved, f0, f1 = x.copy(), np.empty(nx), np.empty(ns), np.empty(ns)
    varied = min(count, 1)
    K, D = np.empty((varied * n, n, NODES)), np.empty((varied * n, n, NODES))
    slope, room = np.empty((2 * varied, rows, WIDTH, NODES)), np.empty(varied * ns)
    longest = np.inf
    if harmonics.size > 0 and omega > 0.0:
        longest = ANGLE / (harmonics[-1] * omega)
    left, tabled = s, -1.0
    steps = int(np.ceil(left / min(longest, FIRST_STEP * unit)))
    rate(A, m, LU, LS, LP, law, acts, now, f0, one)
    while steps > 0:
        h = left / steps
        if abs(h - tabled) > 1e-14 * h:
            prepare(harmonics, omega, h, turn)
            tabled = h
        iterations, top = solve(A, m, LU, LS, LP, law, acts, now, h, f0, (TURN / unit) ** 2, turn, local, q, v, a, base)
        wish, good = 0.25 * h, False
        if iterations > 0:
            for i in range(ns):
                moved[i] = now[i]
            for i in range(n):
                finish(moved, i, n, h, a)
            moved[ns] = 1.0
            for c in range(ns + 1, nx, 2):
                cos, sin = turn[c - ns, NODES], turn[c + 1 - ns, NODES]
                moved[c], moved[c + 1] = cos * now[c] - sin * now[c + 1], cos * now[c + 1] + sin * now[c]
            rate(A, m, LU, LS, LP, law, acts, moved, f1, one)
            e = defect(h, f0, f1, top, a)
            good = e <= WORST * DEFECT
            if e < np.inf:
                wish = h * min(2.0, max(0.1, 0.9 * (DEFECT / max(e, 1e-30)) ** (1.0 / NODES)))
        if not good:
            if h > SHORTEST * unit:
                steps = int(np.ceil(left / wish))
                continue
            if iterations == 0:
                for i in range(ns):
                    y1[i] = np.nan
                return
        if count > 0:
            linearise(A, m, LU, LS, LP, law, acts, h, local, slope, K, D)
            for row in range(count):
                vary(room, X, row, h, K, D, iterations, q, v, a)
        for c in range(nx):
            now[c] = moved[c]
        for i in range(ns):
            f0[i] = f1[i]
        left -= h
        steps -= 1
        if steps > 0 and (wish < 0.8 * h or wish > 1.6 * h):
            steps = int(np.ceil(left / min(wish, longest)))
    for i in range(ns):
        y1[i] = now[i]


@njit
def advance(T, m, x, s, y1):
    """Write the state at time ``s >= 0`` after ``x`` (nx,) into ``y1`` (ns,); ``x`` is kept."""
    travel(T, m, x, s, y1, np.empty((0, y1.size)))


@njit
def arc(T, m, x, s, y1, Phi):
    """Like `advance`, with the derivative ``Phi`` (ns, ns) of the state in the state at the start."""
    X = np.eye(y1.size)
    travel(T, m, x, s, y1, X)
    for i in range(y1.size):
        for c in range(y1.size):
            Phi[i, c] = X[c, i]
