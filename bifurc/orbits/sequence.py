"""Periodic orbits as event sequences: residual, Jacobian and one compiled corrector call a continuation step.

The unknowns are, for each node, its time ``tau`` in forcing periods and the state ``y`` just before its event; a node
without event is a section at a fixed time.  With the reset ``y+ = R x``, the arc ``phi`` of the mode that follows and
the guard ``g`` of the mode before,

    phi(tau_i, tau_{i+1}, y_i+) - y_{i+1} = 0,     g(tau_i, y_i) = 0,     (tau_m, y_m) = (tau_0 + span, closure y_0).

No row contains 1/speed, so that Newton and arclength pass zero impact speed regularly.  Where an interval opens and
closes on the same surface its closing guard has a trivial root at zero duration ``s``; that row is divided by
``s**order``, which keeps it regular through the birth of a contact (elastic graze).

A perturbation that is multiplied by mu over the period makes ``det J(mu)`` vanish, where the columns of node ``m`` carry
the factor mu; mu = -1 gives the flip test, finite through zero speed.
"""
import numpy as np

from .._jit import njit
from ..compose.tables import ORDER, rebuild
from ..flow.affine import arc, carry, field, forcing, guard_series
from ..solve.dense import lu, lu_solve

BEFORE, GUARD, AFTER, DIVIDE = range(4)  # columns of `nodes`; GUARD -1: section at a fixed time; DIVIDE: 0 or order
MAX_ITERATIONS = 12
(ITERATIONS, RESIDUAL, DET_SIGN, DET_LOG, CONTRACTION, FLIP, LISTED, LISTED_AT, PEAK, PEAK_SEGMENT, PEAK_GUARD,
 PEAK_TIME, STEP_NORM, INFO) = range(14)  # places in the `info` array that `correct` fills


@njit
def set_parameter(T, index, series, low, high, value):
    """Write the numbers of the scene at a parameter value, given as Chebyshev series on [low, high], and rebuild."""
    flat = T.flat
    z = (2.0 * value - low - high) / (high - low)
    for k in range(index.size):
        b0 = 0.0
        b1 = 0.0
        for j in range(series.shape[1] - 1, 0, -1):
            b0, b1 = 2.0 * z * b0 - b1 + series[k, j], b0
        flat[index[k]] = z * b0 - b1 + series[k, 0]
    rebuild(T)


@njit
def guard_value(T, m, g, x):
    """Value of guard ``g`` of mode ``m`` at ``x``."""
    G = T.G
    total = 0.0
    for c in range(G.shape[2]):
        total += G[m, g, c] * x[c]
    return total


@njit
def forcing_rate(T, x, k, period):
    """d w_k / d tau at the joined state ``x``."""
    A, flat, harmonics = T.A, T.flat, T.harmonics
    if k == 0:
        return 0.0
    h = (k - 1) // 2
    base = A.shape[1] + 1 + 2 * h
    rate = harmonics[h] * flat[0] * period
    return -rate * x[base + 1] if k == 1 + 2 * h else rate * x[base]


@njit
def guard_rate(T, m, g, x, f):
    """Rate of guard ``g`` along the field ``f`` of its mode at ``x``."""
    A, G = T.A, T.G
    ns, nx = A.shape[1], A.shape[2]
    total = 0.0
    for c in range(ns):
        total += G[m, g, c] * f[c]
    for k in range(1, nx - ns):
        total += G[m, g, ns + k] * forcing_rate(T, x, k, 1.0)
    return total


@njit
def assemble(T, nodes, fixed, span, closure, wrap, U, weights, F, J, want):
    """Residual ``F`` (n,) and, if ``want``, Jacobian ``J`` (n, n), n = m (1 + ns), of the event sequence.

    ``nodes`` (m, 4) integers, ``fixed`` (m,) times of sections, ``closure`` (ns,) signs of the closing map, ``wrap`` the
    factor mu on the columns of the closing node, ``weights`` (ns,) natural sizes of the states (rows are scaled).
    """
    A, G, GT, R, flat, step = T.A, T.G, T.GT, T.R, T.flat, T.step
    count = nodes.shape[0]
    ns, nx = A.shape[1], A.shape[2]
    size = 1 + ns
    period = 2.0 * np.pi / flat[0]
    x = np.empty(nx)
    xp = np.empty(nx)
    xe = np.empty(nx)
    f = np.empty(ns)
    y1 = np.empty(ns)
    jump = np.empty(ns)  # d y+ / d tau - (start field) * period
    Phi = np.empty((ns, ns))
    a = np.empty(ORDER + 1)
    if want > 0.0:
        for r in range(J.shape[0]):
            for c in range(J.shape[1]):
                J[r, c] = 0.0
    for i in range(count):
        base = i * size
        before, g, after = nodes[i, BEFORE], nodes[i, GUARD], nodes[i, AFTER]
        tau = U[base]
        for c in range(ns):
            x[c] = U[base + 1 + c]
        forcing(T, tau * period, x)
        row = base
        if g < 0:
            F[row] = tau - fixed[i]
            if want > 0.0:
                J[row, base] = 1.0
        elif nodes[i, DIVIDE] == 0:
            scale = 0.0
            for c in range(ns):
                scale += abs(G[before, g, c]) * weights[c]
            F[row] = guard_value(T, before, g, x) / scale
            if want > 0.0:
                for c in range(ns):
                    J[row, base + 1 + c] += G[before, g, c] / scale
                for k in range(1, nx - ns):
                    J[row, base] += G[before, g, ns + k] * forcing_rate(T, x, k, period) / scale
        # state after the event and its derivative in (tau, y)
        for c in range(nx):
            xp[c] = x[c]
        if g >= 0:
            for c in range(ns):
                total = 0.0
                for k in range(nx):
                    total += R[before, g, c, k] * x[k]
                xp[c] = total
        last = i == count - 1
        nxt = 0 if last else i + 1
        end = U[nxt * size] + (span if last else 0.0)
        s = (end - tau) * period
        if s < 0.0:
            s = 0.0  # a virtual negative duration is met only inside Newton; the row below keeps its slope
        arc(T, after, xp, s, y1, Phi)
        field(T, after, xp, f)
        for c in range(ns):
            jump[c] = -f[c] * period
            if g >= 0:
                for k in range(1, nx - ns):
                    jump[c] += R[before, g, c, ns + k] * forcing_rate(T, x, k, period)
        for c in range(ns):
            xe[c] = y1[c]
        forcing(T, end * period, xe)
        field(T, after, xe, f)
        mu = wrap if last else 1.0
        for c in range(ns):
            row = base + 1 + c
            target = U[nxt * size + 1 + c] * (closure[c] if last else 1.0)
            F[row] = (y1[c] - target) / weights[c]
            if want > 0.0:
                total = 0.0
                for k in range(ns):
                    total += Phi[c, k] * jump[k]
                J[row, base] += total / weights[c]
                for k in range(ns):
                    if g >= 0:
                        total = 0.0
                        for q in range(ns):
                            total += Phi[c, q] * R[before, g, q, k]
                    else:
                        total = Phi[c, k]
                    J[row, base + 1 + k] += total / weights[c]
                J[row, nxt * size] += mu * f[c] * period / weights[c]
                J[row, nxt * size + 1 + c] -= mu * (closure[c] if last else 1.0) / weights[c]
        order = nodes[nxt, DIVIDE]
        if order > 0:  # closing guard of this interval, divided by s**order
            close = nodes[nxt, GUARD]
            row = nxt * size
            scale = 0.0
            for c in range(ns):
                scale += abs(G[after, close, c]) * weights[c]
            raw = (end - tau) * period
            if raw < step[after]:
                guard_series(T, after, close, xp, a)
                value, slope = 0.0, 0.0
                for j in range(ORDER, order - 1, -1):
                    slope = slope * raw + value
                    value = value * raw + a[j]
                F[row] = value / scale
                if want > 0.0:
                    J[row, nxt * size] += mu * slope * period / scale
                    J[row, base] -= slope * period / scale
                    for c in range(nx):  # dependence on the start: one Taylor row a column
                        e = 0.0
                        for j in range(ORDER, order - 1, -1):
                            e = e * raw + GT[after, close, c, j]
                        e /= scale
                        if c >= ns:
                            J[row, base] += e * forcing_rate(T, x, c - ns, period)
                        for k in range(ns):
                            if g >= 0:
                                if c < ns:
                                    J[row, base + 1 + k] += e * R[before, g, c, k]
                            elif c == k:
                                J[row, base + 1 + k] += e
                        if c < ns and g >= 0:
                            for k in range(1, nx - ns):
                                J[row, base] += e * R[before, g, c, ns + k] * forcing_rate(T, x, k, period)
            else:
                scale *= raw**order
                F[row] = guard_value(T, after, close, xe) / scale
                if want > 0.0:
                    rate = guard_rate(T, after, close, xe, f)
                    J[row, nxt * size] += mu * rate * period / scale
                    for k in range(ns):
                        part = G[after, close, k] / scale
                        if part != 0.0:
                            for q in range(ns):
                                total = 0.0
                                if g >= 0:
                                    for p in range(ns):
                                        total += Phi[k, p] * R[before, g, p, q]
                                else:
                                    total = Phi[k, q]
                                J[row, base + 1 + q] += part * total
                                J[row, base] += part * Phi[k, q] * jump[q]


@njit
def series_maximum(a, s):
    """Largest interior local maximum (value, time) of the polynomial ``a`` on (0, s); value -inf if there is none."""
    best, where = -np.inf, 0.0
    parts = 8
    left, dl = 0.0, a[1]
    if dl == 0.0:
        left = 1e-9 * s
        dl = slope_of(a, left)
    for k in range(1, parts + 1):
        right = s * k / parts
        dr = slope_of(a, right)
        if dl > 0.0 and dr <= 0.0:
            low, high, mid = left, right, left + (right - left) * dl / (dl - dr)
            for _ in range(60):
                d = slope_of(a, mid)
                if d > 0.0:
                    low = mid
                else:
                    high = mid
                dd = 0.0
                for j in range(ORDER, 1, -1):
                    dd = dd * mid + a[j] * (j * (j - 1))
                new = mid - d / dd if dd != 0.0 else 0.5 * (low + high)
                if not (low < new < high):
                    new = 0.5 * (low + high)
                if abs(new - mid) <= 1e-15 * s:
                    mid = new
                    break
                mid = new
            value = 0.0
            for j in range(ORDER, -1, -1):
                value = value * mid + a[j]
            if value > best:
                best, where = value, mid
        left, dl = right, dr
    return best, where


@njit
def slope_of(a, s):
    """Derivative of the polynomial ``a`` at ``s``."""
    d = 0.0
    for j in range(ORDER, 0, -1):
        d = d * s + a[j] * j
    return d


@njit
def segment_peak(T, m, g, x, s, closing):
    """Largest interior maximum (value, time) of guard ``g`` on a segment of duration ``s`` from ``x``.

    A step whose Bernstein bound (cubic Hermite and its error) stays below the best value found is skipped.  The end
    value counts unless the guard is the one that ``closing`` (1) says ends the segment.
    """
    A, G4, step = T.A, T.G4, T.step
    ns, nx = A.shape[1], A.shape[2]
    f = np.empty(ns)
    moved = x.copy()
    after = x.copy()
    a = np.empty(ORDER + 1)
    best, where, t = -np.inf, 0.0, 0.0
    field(T, m, moved, f)
    g0 = guard_value(T, m, g, moved)
    d0 = guard_rate(T, m, g, moved, f)
    while t < s:
        h = min(step[m], s - t)
        part = h / step[m]
        e = 0.0
        for c in range(nx):
            e += G4[m, g, c] * abs(moved[c])
        e *= part**4
        carry(T, m, moved, h, after)
        field(T, m, after, f)
        g1 = guard_value(T, m, g, after)
        d1 = guard_rate(T, m, g, after, f)
        top = max(g0 + h * d0 / 3.0, g1 - h * d1 / 3.0) + e
        if top > best and ((d0 > 0.0 and d1 <= 0.0) or top > max(g0, g1)):
            guard_series(T, m, g, moved, a)
            value, at = series_maximum(a, h)
            if value > best:
                best, where = value, t + at
        for c in range(nx):
            moved[c] = after[c]
        g0, d0 = g1, d1
        t += h
    if closing == 0 and g0 > best:
        best, where = g0, s
    return best, where


@njit
def monitor(T, nodes, fixed, span, closure, U, weights, info):
    """Fill LISTED (smallest arriving speed or duration of a listed event) and PEAK (largest unlisted maximum), scaled."""
    A, G, R, flat, kick, n_guards = T.A, T.G, T.R, T.flat, T.kick, T.n_guards
    count = nodes.shape[0]
    ns, nx = A.shape[1], A.shape[2]
    size = 1 + ns
    period = 2.0 * np.pi / flat[0]
    x = np.empty(nx)
    xp = np.empty(nx)
    f = np.empty(ns)
    info[LISTED], info[LISTED_AT] = np.inf, -1.0
    info[PEAK], info[PEAK_SEGMENT], info[PEAK_GUARD], info[PEAK_TIME] = -np.inf, -1.0, -1.0, 0.0
    for i in range(count):
        before, g, after = nodes[i, BEFORE], nodes[i, GUARD], nodes[i, AFTER]
        tau = U[i * size]
        for c in range(ns):
            x[c] = U[i * size + 1 + c]
        forcing(T, tau * period, x)
        for c in range(nx):
            xp[c] = x[c]
        if g >= 0:
            field(T, before, x, f)
            scale = 0.0
            for c in range(ns):
                scale += abs(G[before, g, c]) * weights[c]
            speed = guard_rate(T, before, g, x, f) / (scale * flat[0])
            if kick[before, g] == 0 and nodes[i, DIVIDE] > 0:  # births of contacts: the duration is the smooth measure
                previous = U[(i - 1) * size] if i > 0 else U[(count - 1) * size] - span
                speed = tau - previous
            if speed < info[LISTED]:
                info[LISTED], info[LISTED_AT] = speed, i
            for c in range(ns):
                total = 0.0
                for k in range(nx):
                    total += R[before, g, c, k] * x[k]
                xp[c] = total
        last = i == count - 1
        nxt = 0 if last else i + 1
        s = (U[nxt * size] + (span if last else 0.0) - tau) * period
        for q in range(n_guards[after]):
            listed = 1 if nodes[nxt, GUARD] >= 0 and nodes[nxt, GUARD] == q and nodes[nxt, BEFORE] == after else 0
            if last and closure[0] < 0.0:  # the segment ends with the mirror image of the first event
                listed = 1 if nodes[0, GUARD] >= 0 and abs(guard_end(T, after, q, U, ns, closure, weights)) < 1e-6 else 0
            scale = 0.0
            for c in range(ns):
                scale += abs(G[after, q, c]) * weights[c]
            value, at = segment_peak(T, after, q, xp, s, listed)
            value /= scale
            if value > info[PEAK]:
                info[PEAK], info[PEAK_SEGMENT], info[PEAK_GUARD], info[PEAK_TIME] = value, i, q, tau + at / period


@njit
def guard_end(T, m, g, U, ns, closure, weights):
    """Scaled value of guard ``g`` at the mirrored first node, with which a half-period orbit closes."""
    A, G, flat = T.A, T.G, T.flat
    x = np.empty(A.shape[2])
    for c in range(ns):
        x[c] = U[1 + c]
    forcing(T, U[0] * 2.0 * np.pi / flat[0], x)
    total, scale = 0.0, 0.0
    for c in range(A.shape[2]):
        if c < ns:
            total += G[m, g, c] * closure[c] * x[c]
            scale += abs(G[m, g, c]) * weights[c]
        else:
            total += G[m, g, c] * (x[c] if c == ns else -x[c])
    return total / scale


@njit
def correct(T, index, series, low, high, nodes, fixed, span, closure, scales, weights, U, predicted, tangent, free, info,
            tolerance, max_iterations):
    """Newton on the event sequence, bordered by the arclength row; one call a continuation step.

    ``U`` (n+1,) holds the unknowns and the parameter, at entry a guess; ``predicted`` (n+1,) the point whose plane
    orthogonal to ``tangent`` (n+1,, in scaled unknowns) is searched; ``scales`` (n+1,) natural sizes.  With ``free`` = 0
    the parameter keeps its value.  At the end ``tangent`` is the unit tangent at the new point, oriented like the old.
    """
    n = U.size - 1
    F = np.empty(n)
    F2 = np.empty(n)
    J = np.empty((n, n))
    K = np.empty((n + 1, n + 1))
    b = np.empty(n + 1)
    pivot = np.empty(n + 1, np.int64)
    old_step = np.inf
    info[CONTRACTION] = 0.0
    info[ITERATIONS] = 0.0
    done = False
    k = 0
    while True:
        delta = 1e-7 * scales[n]
        set_parameter(T, index, series, low, high, U[n] + delta)
        assemble(T, nodes, fixed, span, closure, 1.0, U, weights, F2, J, 0.0)
        set_parameter(T, index, series, low, high, U[n])
        assemble(T, nodes, fixed, span, closure, 1.0, U, weights, F, J, 1.0)
        info[RESIDUAL] = 0.0
        for i in range(n):
            if not np.isfinite(F[i]):
                info[RESIDUAL] = np.inf
                return 0
            info[RESIDUAL] = max(info[RESIDUAL], abs(F[i]))
        if k == 0:
            info[STEP_NORM] = info[RESIDUAL]
        for i in range(n):
            for j in range(n):
                K[i, j] = J[i, j] * scales[j]
            K[i, n] = (F2[i] - F[i]) / 1e-7
            b[i] = -F[i]
        b[n] = 0.0
        if free:
            for j in range(n + 1):
                K[n, j] = tangent[j]
                b[n] -= tangent[j] * (U[j] - predicted[j]) / scales[j]
        else:
            for j in range(n):
                K[n, j] = 0.0
            K[n, n] = 1.0
        if not free and done:  # the tangent row, for determinant and tangent at the final point
            for j in range(n + 1):
                K[n, j] = tangent[j]
        sign, log = lu(K, pivot)
        if sign == 0.0:
            return -1
        if done or (k > 0 and info[RESIDUAL] <= tolerance and old_step <= 1e-9):
            if not done and not free:
                done = True
                continue
            break
        if k >= max_iterations:
            return 0
        lu_solve(K, pivot, b)
        step = 0.0
        for j in range(n + 1):
            step = max(step, abs(b[j]))
        if not np.isfinite(step) or (k > 0 and step > 4.0 * old_step and step > 1e-6):
            return 0
        if k > 0 and old_step > 1e-10:
            info[CONTRACTION] = max(info[CONTRACTION], step / old_step)
        for j in range(n + 1):
            U[j] += b[j] * scales[j]
        old_step = step
        k += 1
        info[ITERATIONS] = k
    info[DET_SIGN], info[DET_LOG] = sign, log
    for j in range(n):
        b[j] = 0.0
    b[n] = 1.0
    lu_solve(K, pivot, b)
    norm = 0.0
    for j in range(n + 1):
        norm += b[j] * b[j]
    norm = np.sqrt(norm)
    for j in range(n + 1):
        tangent[j] = b[j] / norm
    # flip test: the closing columns with mu = -1, relative to the bordered determinant
    assemble(T, nodes, fixed, span, closure, -1.0, U, weights, F2, J, 1.0)
    for i in range(n):
        for j in range(n):
            J[i, j] *= scales[j]
    sign2, log2 = lu(J, pivot[:n])
    ratio = np.exp(min(log2 - log - np.log(norm), 700.0)) if sign2 != 0.0 else 0.0
    info[FLIP] = sign2 * ratio / (1.0 + ratio)
    monitor(T, nodes, fixed, span, closure, U, weights, info)
    return 1
