"""Periodic orbits as event sequences: residual, Jacobian, a corrector, runs of steps and zeros of tests along them, compiled.

The unknowns are, for each node, its time ``tau`` in forcing periods and the state ``y`` just before its event; a node
without event is a section at a fixed time.  With the jump ``y+ = R(x)``, the arc ``phi`` of the mode that follows and
the guard ``g`` of the mode before,

    phi(tau_i, tau_{i+1}, y_i+) - y_{i+1} = 0,     g(tau_i, y_i) = 0,     (tau_m, y_m) = (tau_0 + span, closure y_0).

No row contains 1/speed, so that Newton and arclength pass zero impact speed regularly.  Where the opening of an
interval makes its closing guard vanish at zero duration ``s`` that root is trivial; the row is divided by ``s**order``,
which keeps it regular through the birth of a contact (elastic graze: order 1) and of a slip (order 2).  Events that
coincide always (two sliders on one coordinate stop together) have the row ``tau_{i+1} = tau_i`` instead.

A perturbation that is multiplied by mu over the period makes ``det J(mu)`` vanish, where the columns of node ``m``
carry the factor mu; mu = -1 gives the flip test, finite through zero speed.

Where nothing depends on time the period is unknown and the phase is free: ``span`` = 0, node 0 is at time zero, and the
place of its time holds that of the closing node, the period.  A section then asks for ``normal . y = value`` instead of a
time.  So there is one equation for each unknown, and the trivial multiplier +1 is no zero of ``det J``.

Steps of a branch in which nothing lies are made one after the other in one call, by the rules of `solve.steplaw`.

One file, because residual, Jacobian and corrector are compiled as one call and share the columns of `nodes` and the places of
`info`.
"""
import numpy as np

from ..._jit import FLAG, NOTHING, NUMBER, WHOLE, apart, both, inlined, leaf, njit
from ...compose.tables import ORDER, rebuild, rebuild_mode
from ...elements.kinds import EventKind
from ...flow.affine.engine import (
    KNOWS_BESIDE,
    advance,
    arc,
    arc_beside,
    curved_hold,
    field,
    forcing,
    forcing_rate,
    guard_divided,
    guard_gradient,
    guard_rate,
    guard_series,
    guard_value,
)
from ...flow.affine.peak import segment_peak
from ...flow.chatter import closure, multiple
from ...flow.rule import jump
from ...solve.dense import lu, lu_solve
from ...solve.steplaw import lowest
from ...solve.steprun import (
    BACK,
    BEYOND,
    CORNER,
    HIGH,
    LAST_ROW,
    LENGTH,
    LOW,
    MADE,
    MOST,
    aside,
    beside,
    between,
    foretold,
    looked_at,
    remembered,
    taken,
)
from ...solve.zeros import DONE, PARAMETER, TRIED, VALUE, enclosing, polishing

# columns of `nodes`: GUARD -1 is a section at a fixed time; DIVIDE 0, order, or TOGETHER; CLOSES 1: ends an infinite
# sequence of impacts, 2: belongs to one; ENDING the guard of the mode AFTER that ends the interval, -1 none; then for every
# guard of the mode AFTER the order of its zero at the start, negative where its leading rate is a condition that no arriving
# speed implies (a reversal: the mass must be moving away), or FOREVER
BEFORE, GUARD, AFTER, DIVIDE, CLOSES, ENDING, STARTS = range(7)
TOGETHER = -1
KEPT, ODD = 0.0, 2.0  # in place of the sign of a state: what nothing changes keeps the value it has; is zero, by symmetry
FOREVER = ORDER + 1  # order at the start of a guard that what is held keeps at zero: no event of its own
SHORT = 0.01  # periods
CLOCK = 64.0 * 2.2e-16  # periods: a shorter flight is rounding
LONGEST = 64.0  # units of time that an orbit of unknown period may become
NOISE = 4.0 * 2.2e-16  # of an unknown, relative
STALLED = 1e-10  # last two steps of Newton that small (scaled): what is left is rounding, of forces far larger than the motion's
CALM = 1e-6  # a step so small (scaled) at a residual that is rounding twice over: a duration near its birth is known no better
LAST = 1e-9  # a step so small (scaled) is the last one, and changes the derivative in the parameter by less than its error
NEAR = 1e-4  # a step so small is followed by next to none
SECANT = 1e-2  # a step so small (scaled) is followed by secant steps, which ask for the residual alone,
PART = 0.1  # as long as each is a part of the one before
SETTLED = 2e-14  # scaled: what may be left of the way behind the last one; less is left, since they become better
FOLLOWS = 1e-24  # of the square of a row: what other rows leave of it is rounding
LEAP = 1e-12  # relative difference of two rows that are two
HELD = 1e-9  # scaled value or speed of a row that is held where a mode begins
NO_PEAK = -1.0  # scaled value of the unlisted maximum where there is none
DETERMINED = 2e-14  # relative, for each unknown, to which a ratio of determinants is known
DIFFERENCE = 1e-7  # of the parameter's natural size; the tangent is good to that, special points to its square
(ITERATIONS, RESIDUAL, DET_SIGN, DET_LOG, CONTRACTION, FLIP, LISTED, LISTED_AT, PEAK, PEAK_SEGMENT, PEAK_GUARD,
 PEAK_TIME, RESTS, LEAVING, LEAVING_AT, LEAVING_GUARD, BROKEN, LEFT, MOVING, HOLDING,
 INFO) = range(21)  # places in the `info` that `correct` fills
RELEASED, SLIPS = EventKind.RELEASE.code, EventKind.SLIP.code  # where a force can hold no longer
RESET = EventKind.RESET.code
UNKNOWN = 2  # `locate`: the kernel does not know the test there


@both
def set_parameter(T, index, series, low, high, value):
    """Write the numbers of the scene at a parameter value, given as Chebyshev series on [low, high], and rebuild."""
    if index.size > 0:
        set_numbers(T, index, series, low, high, value)
        rebuild(T)


@apart(NOTHING)
def set_modes(T, index, series, low, high, value, nodes):
    """As `set_parameter`, but only the modes that occur in ``nodes`` are rebuilt, and of those under laws what laws ask for."""
    if index.size == 0:
        return
    whole = T.acts.shape[1] == 0
    set_numbers(T, index, series, low, high, value)
    done = np.zeros(T.n_guards.size, np.int64)
    for i in range(nodes.shape[0]):
        for column in (BEFORE, AFTER):
            m = nodes[i, column]
            if done[m] == 0:
                rebuild_mode(T, m, whole)
                done[m] = 1


@njit
def set_numbers(T, index, series, low, high, value):
    """Write the numbers of the scene at a parameter value: zero where all that is left of a series is its rounding, as of the
    restitution of a plastic stop."""
    flat = T.flat
    z = (2.0 * value - low - high) / (high - low)
    for k in range(index.size):
        b0 = 0.0
        b1 = 0.0
        for j in range(series.shape[1] - 1, 0, -1):
            b0, b1 = 2.0 * z * b0 - b1 + series[k, j], b0
        number = z * b0 - b1 + series[k, 0]
        flat[index[k]] = number if abs(number) > 2.2e-16 * abs(series[k, 0]) else 0.0


@njit
def closed_in(node):
    """Return what `flow.rule.jump` asks of a node: whether a complete chattering ends with it, and in which mode it rests."""
    return 2 + node[AFTER] if node[CLOSES] == 1 else 0


@apart(NOTHING, python=True)
def reset(T, m, g, closes, x, xp, P):
    """Write the state behind a node into ``xp`` (nx,) and its derivative in the state before, ``x`` (nx,), into ``P`` (ns, nx).

    An event jumps (``closes``: see `flow.rule.jump`); before it, and at a section, what is held is put on its surface and to rest:
    rows that are held all period are no unknowns of the orbit.
    """
    ns, nx = P.shape
    if T.n_holds[m] == 0:
        if g >= 0:
            jump(T, m, g, closes, x, xp, P)
            return
        for i in range(ns):
            for c in range(nx):
                P[i, c] = 1.0 if i == c else 0.0
        for c in range(nx):
            xp[c] = x[c]
        curved_hold(T, m, xp, P)
        return
    Q, held = np.empty((ns, nx)), x.copy()
    for i in range(ns):
        for c in range(nx):
            Q[i, c] = 1.0 if i == c else 0.0
    done = np.empty((2 * T.n_holds[m], nx))
    for k in range(T.n_holds[m]):
        clear(T.S[m, k], done, 2 * k, Q)
        clear(T.H[m, k], done, 2 * k + 1, Q)
    for i in range(ns):
        held[i] = 0.0
        for c in range(nx):
            held[i] += Q[i, c] * x[c]
    if g < 0:
        P[:] = Q
        xp[:] = held
        curved_hold(T, m, xp, P)
        return
    jump(T, m, g, closes, held, xp, P)
    row = np.empty(nx)
    for i in range(ns):
        for c in range(nx):
            row[c] = P[i, c] if c >= ns else 0.0
            for k in range(ns):
                row[c] += P[i, k] * Q[k, c]
        P[i] = row


@njit
def clear(given, done, count, P):
    """Change the affine map ``P`` (ns, nx) so that the row ``given`` (nx,) of its image is zero, as the first ``count`` rows of
    ``done`` (2 k, nx) are; the new one, made orthogonal to them in the states, is written behind them."""
    ns, nx = P.shape
    row, whole = done[count], 0.0
    row[:] = given
    for i in range(ns):
        whole += row[i] * row[i]
    for k in range(count):
        along, size = 0.0, 0.0
        for i in range(ns):
            along += row[i] * done[k, i]
            size += done[k, i] * done[k, i]
        if along != 0.0:
            for c in range(nx):
                row[c] -= done[k, c] * (along / size)
    square = 0.0
    for i in range(ns):
        square += row[i] * row[i]
    if square <= FOLLOWS * whole:  # none, or one that the others make zero
        row[:] = 0.0
        return
    for c in range(nx):
        value = row[c] if c >= ns else 0.0
        for i in range(ns):
            value += row[i] * P[i, c]
        for i in range(ns):
            P[i, c] -= row[i] * (value / square)


@njit
def scale_of(row, weights):
    """Natural size of a guard with gradient ``row``: that of its states, or of its forcing where time alone decides."""
    total = 0.0
    for c in range(weights.size):
        total += abs(row[c]) * weights[c]
    if total == 0.0:
        for c in range(weights.size, row.size):
            total += abs(row[c])
    return total


@apart(NOTHING, python=True)
def assemble(T, nodes, fixed, span, closure, U, weights, F, J, C, want, room):
    """Residual ``F`` (n,) and, if ``want`` > 0, Jacobian ``J`` (n, n), n = m (1 + ns), of the event sequence.

    ``nodes`` (m, 5) integers, ``fixed`` (m,) times of sections (``span`` = 0: normal and value of the section, (ns + 1,)),
    ``closure`` (1 + k, ns) the closing map, see `Signature.closing`, ``weights`` (ns,) natural sizes of the states (rows are
    scaled).  The first columns of ``C`` (n, 2 + ns) are the part of those of ``J`` that node 0 has as the closing node: the
    Jacobian with the factor mu on it is ``J + (mu - 1) C``.  With ``span`` = 0 its last column is the derivative in the time at
    which node 0 begins the orbit, which belongs to the first column where perturbations are compared, but not to the equations.

    ``room`` is that of `room_of`.  An engine that knows what other numbers change in an arc (`KNOWS_BESIDE`) keeps that there with
    ``want`` = 2; with ``want`` = -1, and these numbers in ``T``, it is what leads from node to node.
    """
    assembled(T, nodes, fixed, span, closure, U, weights, F, J, C, want, room)


@njit
def room_of(T, count):
    """Return room for `assemble`: arrays that it overwrites, numbers near those of ``T``, and arcs of ``count`` nodes; 0: of no
    other numbers."""
    ns, nx = T.A.shape[1], T.A.shape[2]
    numbers = np.empty(T.flat.size if count > 0 else 0)
    return np.empty((9, nx)), np.empty((ns, nx)), np.empty((2, ns, ns)), numbers, np.empty((count, ns, ns + 3))


@leaf
def assembled(T, nodes, fixed, span, closure, U, weights, F, J, C, want, spare):
    """Do what `assemble` says, without counting references to arrays."""
    room, P, square, numbers, arcs = spare
    step = T.step
    count = nodes.shape[0]
    ns, nx = T.A.shape[1], T.A.shape[2]
    size = 1 + ns
    period = 2.0 * np.pi / T.flat[0]
    unit = 2.0**(10.0 * np.round(0.1 * np.log2(T.flat[0])))  # of rates: the frequency, coarse, so that branches over it keep theirs
    x, xp, xe = room[0], room[1], room[2]  # before the event, after it, at the end of the interval
    f, dw, row, y1 = room[3, :ns], room[4, :nx - ns], room[5], room[6, :ns]
    start, move = room[7, :ns], room[8, :ns]  # d y+ / d tau at fixed y, without and with what the later start takes away
    Phi, PhiP = square[0], square[1]
    if want > 0.0:
        for r in range(J.shape[0]):
            for c in range(J.shape[1]):
                J[r, c] = 0.0
            for c in range(size + 1):
                C[r, c] = 0.0
    for i in range(count):
        base = i * size
        before, g, after = nodes[i, BEFORE], nodes[i, GUARD], nodes[i, AFTER]
        begins = i == 0 and span == 0.0
        tau = 0.0 if begins else U[base]
        for c in range(ns):
            x[c] = U[base + 1 + c]
        forcing(T, tau * period, x)
        if want > 0.0:
            forcing_rate(T, x, dw)
        if g < 0 and span == 0.0:
            F[base] = -fixed[ns]
            for c in range(ns):
                F[base] += fixed[c] * x[c]
                if want > 0.0:
                    J[base, base + 1 + c] = fixed[c]
        elif g < 0:
            F[base] = tau - fixed[i]
            if want > 0.0:
                J[base, base] = 1.0
        elif nodes[i, DIVIDE] == 0:
            guard_gradient(T, before, g, x, row)
            scale = scale_of(row, weights)
            F[base] = guard_value(T, before, g, x) / scale
            if want > 0.0:
                for c in range(ns):
                    J[base, base + 1 + c] += row[c] / scale
                for k in range(1, nx - ns):
                    J[base, base] += row[ns + k] * dw[k] * period / scale
        reset(T, before, g, closed_in(nodes[i]), x, xp, P)
        for c in range(ns if want > 0.0 else 0):
            rate = 0.0
            for k in range(1, nx - ns):
                rate += P[c, ns + k] * dw[k] * period
            start[c] = rate
        last = i == count - 1
        nxt = 0 if last else i + 1
        end = U[nxt * size] + (span if last else 0.0)
        duration = (end - tau) * period
        most = span + 1.0 if span > 0.0 else LONGEST
        if not -step[after] <= duration <= most * period:  # Newton has left the sequence: nothing to integrate
            F[:] = np.nan
            return
        if want < 0.0:
            moved_end(arcs[i], xp, y1)
        elif want == 0.0:  # a duration may be just below zero, on the far side of a birth: the series goes on there
            advance(T, after, xp, duration, y1)
        elif KNOWS_BESIDE and want > 1.0:
            arc_beside(T, after, xp, duration, numbers, y1, Phi, move)
            for c in range(ns):
                arcs[i, c, ns], arcs[i, c, ns + 1], arcs[i, c, ns + 2] = xp[c], y1[c], move[c]
                for k in range(ns):
                    arcs[i, c, k] = Phi[c, k]
        else:
            arc(T, after, xp, duration, y1, Phi)
        for c in range(ns):
            xe[c] = y1[c]
        forcing(T, end * period, xe)
        if want > 0.0:
            field(T, after, xp, f)
            for c in range(ns):
                move[c] = start[c] - f[c] * period
            field(T, after, xe, f)
            for c in range(ns):
                for k in range(ns):
                    total = 0.0
                    for q in range(ns):
                        total += Phi[c, q] * P[q, k]
                    PhiP[c, k] = total
        label = 0
        for c in range(ns):
            r = base + 1 + c
            sign = closure[0, c] if last else 1.0
            if sign == KEPT or sign == ODD:  # nothing changes this combination in a period: it labels the orbits of a family
                label += 1
                scale = scale_of(closure[label], weights)
                F[r] = 0.0
                for k in range(ns):
                    if sign == ODD:
                        F[r] += closure[label, k] * U[1 + k] / scale
                    if want > 0.0:
                        J[r, 1 + k] = closure[label, k] / scale
                continue
            F[r] = (y1[c] - sign * U[nxt * size + 1 + c]) / weights[c]
            if want > 0.0:
                for k in range(ns):
                    if begins:
                        C[r, size] += Phi[c, k] * move[k] / weights[c]
                    else:
                        J[r, base] += Phi[c, k] * move[k] / weights[c]
                    J[r, base + 1 + k] += PhiP[c, k] / weights[c]
                J[r, nxt * size] += f[c] * period / weights[c]
                J[r, nxt * size + 1 + c] -= sign / weights[c]
                if last:
                    C[r, 0] += f[c] * period / weights[c]
                    C[r, 1 + c] -= sign / weights[c]
        order = nodes[nxt, DIVIDE]
        if order == 0:
            continue
        if order == TOGETHER:
            r = nxt * size
            F[r] = U[r] + (span if last else 0.0) - tau
            if want > 0.0:
                J[r, r] += 1.0
                if last:
                    C[r, 0] += 1.0
                if begins:
                    C[r, size] -= 1.0
                else:
                    J[r, base] -= 1.0
            continue
        close, r = nodes[i, ENDING], nxt * size  # closing guard of this interval, divided by duration**order
        if duration < step[after]:
            value, slope = guard_divided(T, after, close, xp, duration, order, row)
            scale = scale_of(row, weights)  # of a row that is divided itself
            F[r] = value / scale
            if want > 0.0:
                J[r, nxt * size] += slope * period / scale
                if last:
                    C[r, 0] += slope * period / scale
                if begins:
                    C[r, size] -= slope * period / scale
                else:
                    J[r, base] -= slope * period / scale
                    for k in range(1, nx - ns):
                        J[r, base] += row[ns + k] * dw[k] * period / scale
                    for c in range(ns):
                        J[r, base] += row[c] * start[c] / scale
                for c in range(ns):
                    for k in range(ns):
                        J[r, base + 1 + k] += row[c] * P[c, k] / scale
        else:
            guard_gradient(T, after, close, xe, row)
            scale = scale_of(row, weights) * (unit * duration)**order
            F[r] = guard_value(T, after, close, xe) / scale
            if want > 0.0:
                forcing_rate(T, xe, dw)
                rate = guard_rate(row, f, dw) * period / scale
                J[r, nxt * size] += rate
                if last:
                    C[r, 0] += rate
                for c in range(ns):
                    for k in range(ns):
                        if begins:
                            C[r, size] += row[c] * Phi[c, k] * move[k] / scale
                        else:
                            J[r, base] += row[c] * Phi[c, k] * move[k] / scale
                        J[r, base + 1 + k] += row[c] * PhiP[c, k] / scale


@njit
def moved_end(arc, xp, y1):
    """Write the end of an arc that begins at ``xp`` (nx,) into ``y1`` (ns,), by what was kept of it; see `assemble`."""
    ns = y1.size
    for c in range(ns):
        y1[c] = arc[c, ns + 1] + arc[c, ns + 2]
        for k in range(ns):
            y1[c] += arc[c, k] * (xp[k] - arc[k, ns])


@apart(NOTHING, python=True)
def monitor(T, nodes, fixed, span, closure, U, weights, info):
    """Fill LISTED (least arriving speed or duration of a listed event), PEAK (largest unlisted maximum), LEAVING (largest
    leading rate of a guard that vanishes at a start), BROKEN (largest value or speed of a row that a mode holds, where it
    begins), all scaled, and RESTS (shortest rest behind a complete chattering, periods).

    PEAK is the larger of HOLDING, of guards beyond which a force can hold no longer, and MOVING, of the others: a mass that rests
    next to a stop is as near to it all the while, and would hide that its friction just holds.
    """
    flat, n_guards = T.flat, T.n_guards
    count = nodes.shape[0]
    ns, nx = T.A.shape[1], T.A.shape[2]
    size = 1 + ns
    period = 2.0 * np.pi / flat[0]
    x = np.empty(nx)
    xp = np.empty(nx)
    f = np.empty(ns)
    dw = np.empty(nx - ns)
    row = np.empty(nx)
    P = np.empty((ns, nx))
    a = np.empty(ORDER + 1)
    info[LISTED], info[LISTED_AT], info[RESTS] = np.inf, -1.0, np.inf
    info[LEAVING], info[LEAVING_AT], info[LEAVING_GUARD] = -np.inf, -1.0, -1.0
    info[PEAK], info[PEAK_SEGMENT], info[PEAK_GUARD], info[PEAK_TIME] = -np.inf, -1.0, -1.0, 0.0
    info[BROKEN], info[MOVING], info[HOLDING] = 0.0, -np.inf, -np.inf
    for i in range(count):
        before, g, after = nodes[i, BEFORE], nodes[i, GUARD], nodes[i, AFTER]
        tau = U[i * size]
        for c in range(ns):
            x[c] = U[i * size + 1 + c]
        forcing(T, tau * period, x)
        if g >= 0:
            speed = measure(T, nodes, span, U, weights, i, x, f, dw, row)
            if speed < info[LISTED]:
                info[LISTED], info[LISTED_AT] = speed, i
        reset(T, before, g, closed_in(nodes[i]), x, xp, P)
        last = i == count - 1
        nxt = 0 if last else i + 1
        s = (U[nxt * size] + (span if last else 0.0) - tau) * period
        if nodes[i, CLOSES] == 1:
            info[RESTS] = min(info[RESTS], s / period)
        if g >= 0:
            for k in range(T.n_holds[after]):
                info[BROKEN] = max(info[BROKEN], row_value(T.H[after, k], xp, weights), row_value(T.S[after, k], xp, weights))
        if nodes[nxt, DIVIDE] == TOGETHER:
            continue
        for q in range(n_guards[after]):
            start = nodes[i, STARTS + q] if STARTS + q < nodes.shape[1] else 0
            if start == FOREVER:
                continue
            listed = 1 if nodes.shape[1] > ENDING and nodes[i, ENDING] == q else 0
            if listed == 0 and waits(T, nodes, nxt, after, q):
                listed = 2
            guard_gradient(T, after, q, xp, row)
            scale = scale_of(row, weights)
            if listed == 2:
                for c in range(ns):
                    x[c] = (-1.0 if last and closure[0, c] < 0.0 else 1.0) * U[nxt * size + 1 + c]
                forcing(T, (U[nxt * size] + (span if last else 0.0)) * period, x)
                listed = 1 if abs(guard_value(T, after, q, x)) < 1e-6 * scale else 0
            if start < 0:
                guard_series(T, after, q, xp, a)
                value = a[-start] / (scale * flat[0]**(-start))
                if value > info[LEAVING]:
                    info[LEAVING], info[LEAVING_AT], info[LEAVING_GUARD] = value, i, q
            value, at = segment_peak(T, after, q, xp, s, listed, abs(start))
            if starts_beyond(T, nodes, i, q, xp, listed, a):
                first = guard_value(T, after, q, xp)
                if nodes[i, CLOSES] == 1:
                    first = at_rest(T, nodes[i], after, q, U[i * size:(i + 1) * size], xp, first, x, f, dw, row)
                if first > value:
                    value, at = first, 0.0
            value /= scale
            kind = HOLDING if T.kind[after, q] == RELEASED or T.kind[after, q] == SLIPS else MOVING
            info[kind] = max(info[kind], value)
            if value > info[PEAK]:
                info[PEAK], info[PEAK_SEGMENT], info[PEAK_GUARD], info[PEAK_TIME] = value, i, q, tau + at / period


@apart(NUMBER)
def at_rest(T, node, mode, q, place, xp, first, x, f, dw, row):
    """Value of guard ``q`` of a mode of rest when the impacts are over that the closing ``node`` of a complete chattering does not
    list, where it is ``first`` at the state ``xp`` (nx,) that they leave: they last a while, and are no rest yet.

    ``place`` (1 + ns,) are time and state of the node; ``x`` and ``row`` (nx,), ``f`` (ns,) and ``dw`` (nx - ns,) are room.
    """
    before, g, ns = node[BEFORE], node[GUARD], f.size
    for c in range(ns):
        x[c] = place[1 + c]
    forcing(T, place[0] * 2.0 * np.pi / T.flat[0], x)
    field(T, before, x, f)
    forcing_rate(T, x, dw)
    guard_gradient(T, before, g, x, row)
    _, lasts_for = closure(T, before, g, x, guard_rate(row, f, dw), np.empty(x.size))
    field(T, mode, xp, f)
    forcing_rate(T, xp, dw)
    guard_gradient(T, mode, q, xp, row)
    return first + min(lasts_for * guard_rate(row, f, dw), 0.0)


@njit
def waits(T, nodes, i, mode, q):
    """Whether guard ``q`` of a mode that ends with node ``i`` is zero there with that of the node, or of an event listed behind it
    that coincides with it: they are of one row, in the mirror image of a half period but for signs.

    Of two frictions on one row that turn round one may stick, while the other goes on without an event.  Another guard that is
    zero there to rounding, as that of a stop where friction turns round, has an event of its own.
    """
    count = nodes.shape[0]
    for later in range(count):
        k = (i + later) % count
        if later > 0 and nodes[k, DIVIDE] != TOGETHER or nodes[k, GUARD] < 0:
            break
        before, guard, same = nodes[k, BEFORE], nodes[k, GUARD], True
        for c in range(T.G.shape[2]):
            if abs(T.G[mode, q, c]) != abs(T.G[before, guard, c]):
                same = False
        if same:
            return True
    return False


@apart(NOTHING, python=True)
def listed_speeds(T, nodes, span, U, weights, found):
    """Write the measure (LISTED) of every node into ``found`` (m,); infinite where it has none."""
    ns, nx = T.A.shape[1], T.A.shape[2]
    x, f, dw, row = np.empty(nx), np.empty(ns), np.empty(nx - ns), np.empty(nx)
    for i in range(nodes.shape[0]):
        for c in range(ns):
            x[c] = U[i * (1 + ns) + 1 + c]
        forcing(T, U[i * (1 + ns)] * 2.0 * np.pi / T.flat[0], x)
        found[i] = measure(T, nodes, span, U, weights, i, x, f, dw, row) if nodes[i, GUARD] >= 0 else np.inf


@apart(NUMBER)
def measure(T, nodes, span, U, weights, i, x, f, dw, row):
    """Arriving speed or duration of the event of node ``i``, scaled: it is one for as long as that is positive (LISTED).

    ``x`` (nx,) is the state before it, ``f`` (ns,), ``dw`` (nx - ns,) and ``row`` (nx,) are room.  For events that belong to a
    complete chattering, whose flights are short by themselves, part of the flight; infinite where that is rounding.
    """
    kick, count, size = T.kick, nodes.shape[0], 1 + f.size
    before, g, order = nodes[i, BEFORE], nodes[i, GUARD], nodes[i, DIVIDE]
    previous, tau, speed = i - 1 if i > 0 else count - 1, U[i * size], np.inf
    following = U[(i + 1) * size] if i < count - 1 else U[0] + span
    lasted = duration(U, size, span, i)
    if nodes[i, CLOSES] == 2:  # friction in every flight of a chattering, which its event neither begins nor ends
        if order == TOGETHER:
            return np.inf
        k = i + 1
        while k < count and nodes[k, DIVIDE] == TOGETHER:
            k += 1
            following = U[k * size] if k < count else U[0] + span
        flight = abs(lasted) + abs(following - tau)
        least = lasted if kick[before, g] == 1 else min(lasted, following - tau)
        return least / flight if flight > CLOCK * (1.0 + abs(tau)) else np.inf
    if nodes[i, CLOSES] == 1 and kick[before, g] == 1:  # Newton may find the last flight of many with a negative duration
        if nodes[previous, CLOSES] != 2:
            return np.inf
        flight = abs(lasted) + T.ratio[before, g] * abs(duration(U, size, span, previous))
        return lasted / flight if flight > CLOCK * (1.0 + abs(tau)) else np.inf
    # one measure a birth: that of a short interval is its duration, with the arriving speed at its beginning their minimum would
    # have a kink
    if kick[before, g] == 1 or (order == 0 or order > 0 and lasted > SHORT) and following - tau > SHORT:
        field(T, before, x, f)
        forcing_rate(T, x, dw)
        guard_gradient(T, before, g, x, row)
        speed = guard_rate(row, f, dw) / (scale_of(row, weights) * T.flat[0])
    if lasts(kick, nodes, i):
        later, beside = i + 1 if i < count - 1 else 0, np.inf
        for k in (previous, later):
            if k != i and (lasts(kick, nodes, k) or overtakes(T, nodes, k)):
                beside = min(beside, duration(U, size, span, k))
        speed = min(speed, evened(lasted, beside))
    elif overtakes(T, nodes, i):
        speed = min(speed, lasted)
    return speed


@njit
def duration(U, size, span, i):
    """Duration of the interval that node ``i`` closes, periods."""
    return U[i * size] - U[(i - 1) * size] if i > 0 else U[0] - U[U.size // size * size - size] + span


@njit
def evened(lasted, beside):
    """Measure of a short duration where the shortest ``beside`` it is short, too.

    Where both vanish one can be of the order of the other squared: a slip that begins before another friction turns round and ends
    soon behind that; a slider that stops just before an impact drives it on, which it follows where it stopped.  The part of its
    neighbour that it makes is linear along a branch, with the same zero.
    """
    return lasted * SHORT / min(max(beside, abs(lasted)), SHORT) if abs(lasted) < SHORT else lasted


@njit
def lasts(kick, nodes, i):
    """Whether the duration of the interval before node ``i`` bounds the validity of a sequence (LISTED): births, and what follows
    one impact, also of a train, where guards may jump; the duration is smooth."""
    before, g, previous = nodes[i, BEFORE], nodes[i, GUARD], i - 1 if i > 0 else nodes.shape[0] - 1
    return g >= 0 and kick[before, g] == 0 and nodes[i, DIVIDE] != TOGETHER and nodes[previous, GUARD] >= 0 and (
        nodes[i, DIVIDE] > 0 or nodes[previous, CLOSES] != 1 or kick[nodes[previous, BEFORE], nodes[previous, GUARD]] == 0)


@njit
def overtakes(T, nodes, i):
    """Whether node ``i`` is an impact that may come before the event before it, of another kind, where nothing but the duration
    tells of that with its first power: a guard that is zero there and rises with the square of time, as that of a slider that has
    just stopped.  Of impacts that are born the arriving speed is the measure, of changes of what is held the reactions."""
    previous = i - 1 if i > 0 else nodes.shape[0] - 1
    before, g, after = nodes[previous, BEFORE], nodes[previous, GUARD], nodes[previous, AFTER]
    if g < 0 or nodes[i, GUARD] < 0 or nodes[i, DIVIDE] != 0 or T.kick[nodes[i, BEFORE], nodes[i, GUARD]] == 0:
        return False
    if T.kick[before, g] == 1 or T.n_holds[before] != T.n_holds[after]:
        return False
    for q in range(min(T.n_guards[after], nodes.shape[1] - STARTS)):
        if 2 <= abs(nodes[previous, STARTS + q]) < FOREVER:
            return True
    return False


@both
def emptied(kick, nodes, span, last, old, U, tangent, scales, length):
    """Return the place in (0, 1) of the step of a ``length`` from ``last`` to ``U`` (n + 1,), with the tangents ``old`` and
    ``tangent`` there, at which an interval of the sequence may last no time though it does at both ends; -1 without one.

    LISTED is the least of many: two of its rows may tell of different intervals, and three of them of no zero between.
    """
    count, ns1 = nodes.shape[0], (U.size - 1) // nodes.shape[0]
    for i in range(count):
        if nodes[i, CLOSES] != 1 and lasts(kick, nodes, i):
            j, k = i * ns1, (i - 1 if i > 0 else count - 1) * ns1
            a, b, slope_a, slope_b = last[j], U[j], old[j] * scales[j], tangent[j] * scales[j]
            if span > 0.0 or k > 0:  # without a clock node 0 begins at time zero
                a, b, slope_a, slope_b = a - last[k], b - U[k], slope_a - old[k] * scales[k], slope_b - tangent[k] * scales[k]
            if i == 0:
                a, b = a + span, b + span
            t = lowest(max(a, 0.0), max(b, 0.0), length * slope_a, length * slope_b)  # on a boundary one is zero to rounding
            if t > 0.0:
                return t
    return -1.0


@njit
def row_value(row, x, weights):
    """Size of an affine row (nx,) at ``x`` (nx,), scaled; 0 for a row without states."""
    scale = 0.0
    for c in range(weights.size):
        scale += abs(row[c]) * weights[c]
    if scale == 0.0:
        return 0.0
    value = 0.0
    for c in range(x.size):
        value += row[c] * x[c]
    return abs(value) / scale


@apart(FLAG)
def starts_beyond(T, nodes, i, q, xp, listed, a):
    """Whether the value of guard ``q`` at the start ``xp`` of the interval behind node ``i`` is a condition: that a row may be
    held from there, or that an impact, or a force that the event turns round, does not carry it beyond.  Where the guard also ends
    the interval it is one only if it falls first.

    A surface is none: its value does not jump, and what it falls from is the interval before.
    """
    before, guard, after = nodes[i, BEFORE], nodes[i, GUARD], nodes[i, AFTER]
    if guard < 0 or STARTS + q < nodes.shape[1] and nodes[i, STARTS + q] != 0 or T.kick[after, q] == 1:
        return False
    if T.LP.shape[2] == 0:  # of first order
        return T.kind[before, guard] == RESET or not goes_on(T, before, after, q)
    alike_held = T.n_holds[after] == 0 or T.n_holds[before] == T.n_holds[after] and not begins_to_hold(T, before, after)
    if T.kick[before, guard] == 0 and alike_held and not leaps(T, before, after, q):
        return False
    if listed == 0:
        return True
    guard_series(T, after, q, xp, a)
    return a[1] < 0.0


@njit
def goes_on(T, before, after, q):
    """Whether guard ``q`` of the mode ``after`` is that of a surface which ends the mode ``before``, too, from either side."""
    for k in range(T.n_guards[before]):
        apart, sums = 0.0, 0.0
        for c in range(T.G.shape[2]):
            apart = max(apart, abs(T.G[after, q, c] - T.G[before, k, c]))
            sums = max(sums, abs(T.G[after, q, c] + T.G[before, k, c]))
        if apart == 0.0 or sums == 0.0:
            return True
    return False


@njit
def begins_to_hold(T, before, after):
    """Whether the mode ``after`` holds a row that the mode ``before`` does not."""
    for k in range(T.n_holds[after]):
        held = False
        for j in range(T.n_holds[before]):
            held = held or multiple(T.H[after, k], T.H[before, j]) != 0.0
        if not held:
            return True
    return False


@njit
def leaps(T, before, after, q):
    """Whether guard ``q`` of the mode ``after`` is another function of the state than the same one of its element ``before``: a
    friction that turns round moves, through the inertia of a full mass matrix, the reaction that holds another mass."""
    number = 0
    for k in range(q):
        number += T.element[after, k] == T.element[after, q]
    for k in range(T.n_guards[before]):
        if T.element[before, k] == T.element[after, q]:
            if number == 0:
                size, other = 0.0, 0.0
                for c in range(T.G.shape[2]):
                    size = max(size, abs(T.G[after, q, c]))
                    other = max(other, abs(T.G[after, q, c] - T.G[before, k, c]))
                return other > LEAP * size
            number -= 1
    return False


@njit
def at_rounding(F, J, U, tolerance):
    """Whether no residual exceeds what the rounding of the unknowns makes of it: a stiff contact turns far in one eps."""
    for i in range(F.size):
        noise = 0.0
        for j in range(F.size):
            noise += abs(J[i, j] * U[j])
        if not abs(F[i]) <= tolerance + NOISE * noise:
            return False
    return True


@njit
def astray(closure, U, predicted, weights, F):
    """Add to the residual ``F`` (n,) by how much labels differ at ``U`` from those at ``predicted`` (n + 1,): a guess that is
    extrapolated from rows changes them by their rounding, from row to row by a larger multiple of it."""
    label, ns = 0, weights.size
    for c in range(ns if closure.shape[0] > 1 else 0):
        if closure[0, c] == KEPT:
            label += 1
            scale = scale_of(closure[label], weights)
            for k in range(ns):
                F[F.size - ns + c] += closure[label, k] * (U[1 + k] - predicted[1 + k]) / scale
        elif closure[0, c] == ODD:
            label += 1


@apart(WHOLE, python=True)
def correct(T, data, U, predicted, tangent, free, info, tolerance, max_iterations):
    """Newton on the event sequence, bordered by the arclength row; return 1 converged, 0 not, -1 singular.

    ``data`` is the record `equations.Data`.  ``U`` (n+1,) holds the unknowns and the parameter, at entry a guess; ``predicted``
    (n+1,) the point whose plane orthogonal to ``tangent`` (n+1,, in scaled unknowns) is searched.  With ``free`` = 0 the
    parameter keeps its value.  At the end ``tangent`` is the unit tangent at the new point, oriented like the old.

    Derivatives are taken at the guess, and at the solution, where they are wanted for the tangent; between the two `secant` goes on
    with the first, unless that stalls.  The derivative in the parameter is a difference; it is renewed near the solution, and kept
    in between, where it only steers Newton.
    """
    index, series, low, high, nodes, fixed, span, closure, scales, weights = data
    n = U.size - 1
    size = 1 + weights.size
    F, F2 = np.empty(n), np.empty(n)
    J, C = np.empty((n, n)), np.empty((n, size + 1))
    K, b = np.empty((n + 1, n + 1)), np.empty(n + 1)
    slope = np.zeros(n)
    pivot = np.empty(n + 1, np.int64)
    steps = np.empty((2 * max_iterations + 2, n + 1))
    room = room_of(T, nodes.shape[0] if KNOWS_BESIDE and index.size > 0 else 0)
    numbers = room[3]
    delta = DIFFERENCE * scales[n]
    old_step, older_step, calm = np.inf, np.inf, 0
    moved = 0.0  # since the derivative in the parameter was taken
    info[CONTRACTION] = 0.0
    patience = max_iterations + 1  # a duration near zero is a nearly free unknown that rounding moves
    for i in range(nodes.shape[0]):
        if nodes[i, DIVIDE] > 0:
            patience = 1
        elif nodes[i, CLOSES] == 2:  # as those of the last impacts of a chattering, which is left alone where Newton gets on
            patience = min(patience, 2)
    k = 0
    while True:
        renew = index.size > 0 and (k == 0 or moved > LAST and old_step < NEAR)
        if renew and KNOWS_BESIDE:
            set_numbers(T, index, series, low, high, U[n] + delta)
            for i in range(numbers.size):
                numbers[i] = T.flat[i]
        elif renew:
            set_modes(T, index, series, low, high, U[n] + delta, nodes)
            assemble(T, nodes, fixed, span, closure, U, weights, F2, J, C, 0.0, room)
        set_modes(T, index, series, low, high, U[n], nodes)
        assemble(T, nodes, fixed, span, closure, U, weights, F, J, C, 2.0 if renew else 1.0, room)
        if renew and KNOWS_BESIDE:
            set_modes(T, index, series, low, high, U[n] + delta, nodes)
            assemble(T, nodes, fixed, span, closure, U, weights, F2, J, C, -1.0, room)
            set_modes(T, index, series, low, high, U[n], nodes)
        if renew:
            moved = 0.0
            for i in range(n):
                slope[i] = (F2[i] - F[i]) / DIFFERENCE
        astray(closure, U, predicted, weights, F)
        info[ITERATIONS] = k
        info[RESIDUAL] = 0.0
        for i in range(n):
            if not np.isfinite(F[i]):
                info[RESIDUAL] = np.inf
                return 0
            info[RESIDUAL] = max(info[RESIDUAL], abs(F[i]))
        calm = calm + 1 if info[RESIDUAL] <= tolerance and old_step <= CALM else 0
        stalled = max(old_step, older_step) <= STALLED
        finished = calm > patience or k > 0 and old_step <= LAST and (info[RESIDUAL] <= tolerance or stalled
                                                               or at_rounding(F, J, U, tolerance))
        for i in range(n):
            for j in range(n):
                K[i, j] = J[i, j] * scales[j]
            K[i, n] = slope[i]
            b[i] = -F[i]
        b[n] = 0.0
        if free > 0.0 or finished:
            for j in range(n + 1):
                K[n, j] = tangent[j]
                b[n] -= tangent[j] * (U[j] - predicted[j]) / scales[j]
        else:
            for j in range(n):
                K[n, j] = 0.0
            K[n, n] = 1.0
        sign, log = lu(K, pivot)
        if sign == 0.0:
            return -1
        if k >= max_iterations and not finished:
            return 0
        lu_solve(K, pivot, b)
        step = 0.0
        for j in range(n + 1):
            step = max(step, abs(b[j]))
        if finished:
            info[LEFT] = step
            break
        if not np.isfinite(step) or (k > 0 and step > 4.0 * old_step and step > 1e-6):
            return 0
        if k > 0 and old_step > 1e-10:
            info[CONTRACTION] = max(info[CONTRACTION], step / old_step)
        for j in range(n + 1):
            U[j] += b[j] * scales[j]
        older_step, old_step = old_step, step
        moved += step
        k += 1
        for j in range(n + 1):
            steps[0, j] = b[j]
        seconds = 0
        while LAST < old_step <= SECANT and k < max_iterations:
            step = secant(T, data, U, predicted, tangent, free, K, pivot, F2, steps, seconds, room)
            if not step <= PART * old_step:
                break
            seconds += 1
            for j in range(n + 1):
                U[j] += steps[seconds, j] * scales[j]
            older_step, old_step = old_step, step
            moved += step
            k += seconds % 2  # two of them cost and bring what one of Newton does
            if old_step * (old_step / older_step) <= SETTLED:
                break
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
    info[DET_SIGN], info[DET_LOG] = sign, log + np.log(norm)
    for i in range(n):
        for j in range(n):
            K[i, j] = (J[i, j] - 2.0 * C[i, j] if j < size else J[i, j]) * scales[j]
        K[i, 0] += C[i, size] * scales[0]
        K[i, n] = 0.0
        K[n, i] = 0.0
    K[n, n] = 1.0
    sign, log = lu(K, pivot)
    whole = U.copy()
    if span == 0.0:
        whole[0], span = 0.0, U[0]
    monitor(T, nodes, fixed, span, closure, whole, weights, info)
    short, least, orientation = 0.0, 1.0, sign  # det J(mu) carries the duration of every contact as a factor: a graze is no flip
    contacts = 0
    for i in range(nodes.shape[0]):
        if nodes[i, DIVIDE] > 0 and T.kick[nodes[i, BEFORE], nodes[i, GUARD]] == 0:
            contacts += 1
    for i in range(nodes.shape[0]):
        if nodes[i, DIVIDE] > 0 and T.kick[nodes[i, BEFORE], nodes[i, GUARD]] == 0:
            duration = whole[i * size] - (whole[(i - 1) * size] if i > 0 else whole[n - size] - span)
            factor = (duration / (0.05 / contacts + abs(duration)))**nodes[i, DIVIDE]
            least = min(least, abs(factor))  # the product of many is small without any that is
            orientation *= np.sign(factor)
            short += np.log(max(abs(factor), 1e-300))
    if least < 1e-9:
        info[FLIP] = np.nan
    else:
        ratio = np.exp(min(log - info[DET_LOG] - short, 700.0)) if sign != 0.0 else 0.0
        if ratio * least <= DETERMINED * n * (1.0 - least):  # where a duration divides it, a determinant is known to so much less
            ratio = 0.0
        info[FLIP] = orientation * ratio / (1.0 + ratio)
    return 1


@inlined
def secant(T, data, U, predicted, tangent, free, K, pivot, F, steps, count, room):
    """Write a step of Broyden's method at ``U`` (n + 1,) into ``steps[count + 1]`` (n + 1,), and return its size.

    ``K`` (n + 1, n + 1) and ``pivot`` are the derivatives of `correct`, factored where ``steps[0]`` began; the steps since then
    tell how they have changed (Kelley 1995, section 7.3).  ``F`` (n,) is room, as ``room`` is.
    """
    n, new = F.size, steps[count + 1]
    set_modes(T, data.places, data.series, data.low, data.high, U[n], data.nodes)
    assemble(T, data.nodes, data.fixed, data.span, data.closure, U, data.weights, F, K, K, 0.0, room)
    new[n] = 0.0
    for i in range(n):
        new[i] = -F[i]
    if free > 0.0:
        for j in range(n + 1):
            new[n] -= tangent[j] * (U[j] - predicted[j]) / data.scales[j]
    lu_solve(K, pivot, new)
    for i in range(count + 1):
        along, square = 0.0, 0.0
        for j in range(n + 1):
            along += steps[i, j] * new[j]
            square += steps[i, j]**2
        along /= square
        for j in range(n + 1):
            new[j] = new[j] + along * steps[i + 1, j] if i < count else new[j] / (1.0 - along)
    step = 0.0
    for j in range(n + 1):
        if not abs(new[j]) < np.inf:
            return np.inf
        step = max(step, abs(new[j]))
    return step


@inlined
def monitored(info, place):
    """Return the value of the test that stands at a place of ``info``, negative where the sequence is valid."""
    if place == LISTED:
        return -info[LISTED] if info[LISTED] < np.inf else NO_PEAK
    if place == PEAK or place == MOVING or place == HOLDING:
        return max(info[place], NO_PEAK)
    if place == BROKEN:
        return info[BROKEN] - 0.5 * HELD
    return info[place]


@both
def follow(T, data, point, info, tolerance, max_iterations, walk):
    """Step along the branch until a step needs a look; return the status of its correction, `BEYOND` or `LAST_ROW`.

    ``point`` is ``U``, ``predicted``, ``tangent``, and ``walk`` is ``before``, ``reads``, ``run``, ``tests``, ``rows``.
    ``rows`` (most, 2 (n + 1) + k + TOLD) takes the steps made, ``run[MADE]`` their number.  The walk begins at ``U`` with the
    tangent there, and ``before`` (2, n + 1) are point and tangent of the row before, if there is one; at the end ``U``,
    ``predicted``, ``tangent`` and ``info`` belong to the step that needs a look.  ``reads`` (k - 1,) are the places in ``info`` of
    the tests behind dp/ds, ``tests`` (TESTS, k) what is known of them.

    Newton begins on the polynomial through the last rows with their tangents, see `steprun.foretold`.
    """
    U, predicted, tangent = point
    before, reads, run, tests, rows = walk
    scales = data.scales
    n, most = U.size - 1, rows.shape[0]
    last, old = U.copy(), tangent.copy()
    past, lengths = np.zeros((4, n + 1)), np.zeros(2)
    past[:2], lengths[0] = before, run[BACK] if run[BACK] < np.inf else 0.0
    made = 0
    while True:
        run[MADE] = made
        if made == most:
            return LAST_ROW
        run[LENGTH] = min(run[LENGTH], run[MOST])
        foretold(past, last, old, scales, lengths, run[LENGTH], predicted, U)
        tangent[:] = old
        if predicted[n] > run[HIGH] or predicted[n] < run[LOW]:
            return BEYOND
        status = correct(T, data, U, predicted, tangent, 1.0, info, tolerance, max_iterations)
        if status != 1:
            return status
        values = rows[made, 2 * (n + 1):2 * (n + 1) + tests.shape[1]]
        length, angle, misfit = plain(T.kick, data, last, old, U, predicted, tangent, info, reads, run, tests, values)
        if length == 0.0 or length < 0.0 and not smooth(T, data, last, old, U, tangent, -length, run[CORNER], tolerance,
                                                        max_iterations):
            return status
        taken(U, tangent, values, (abs(length), angle, misfit),
              (int(info[ITERATIONS]), info[RESIDUAL], info[DET_SIGN], info[DET_LOG]), run, tests, rows[made])
        remembered(past, lengths, last, old, run[BACK])
        last[:], old[:] = U, tangent
        made += 1


@both
def locate(T, data, hermite, bracket, place, point, info, tolerance, max_iterations, box):
    """Find the zero of a test on the branch beside a cubic curve, as `solve.zeros` does; return 1 found, 0 not, `UNKNOWN`.

    Parameters
    ----------
    hermite : ndarray (4, n + 1)
        Start and chord of the curve, and its derivatives at both ends, own units; the curve is run through from 0 to 1.
    bracket : tuple of float
        The test at both ends, and the place to try first.
    place : int
        Where the test stands in ``info``, -1 for the slope of the parameter.
    point : tuple of ndarray (n + 1,)
        Receive the solution, the point of the curve that it was corrected from, and the tangent at the solution.
    box : ndarray (BOX,)
        Receives what is known of the zero.
    """
    first, last, guess = bracket
    miss = np.zeros(point[0].size)  # of the last point from the curve: the next one misses it by nearly the same
    for t in enclosing(box, 0.0, first, 1.0, last, guess):
        status = tested(T, data, hermite, t, place, point, miss, info, tolerance, max_iterations, box)
        if status != 1:
            return status
    if box[DONE] == 0.0:
        return 0
    for t in polishing(box):
        status = tested(T, data, hermite, t, place, point, miss, info, tolerance, max_iterations, box)
        if status == 0 and box[TRIED] > 0.0:
            box[VALUE] = np.nan
        elif status != 1:
            return status
    return 1 if box[DONE] > 0.0 else 0


@njit
def tested(T, data, hermite, t, place, point, miss, info, tolerance, max_iterations, box):
    """Correct the point at ``t`` of a curve, see `locate`, and write the test there into ``box``; return as `locate`."""
    U, predicted, tangent = point
    scales = data.scales
    n = U.size - 1
    beside(hermite, t, miss, scales, predicted, U, tangent)
    status = correct(T, data, U, predicted, tangent, 1.0, info, tolerance, max_iterations)
    if status != 1:
        return 0
    for j in range(n + 1):
        miss[j] = (U[j] - predicted[j]) / scales[j]
    box[VALUE], box[PARAMETER] = tangent[n] if place < 0 else monitored(info, place), U[n]
    return 1 if np.isfinite(box[VALUE]) else UNKNOWN


@njit
def plain(kick, data, last, old, U, predicted, tangent, info, reads, run, tests, values):
    """Return what `steprun.looked_at` does of the step from ``last`` to ``U``; write its tests into ``values`` (k,)."""
    values[0] = tangent[U.size - 1]
    for j in range(1, values.size):
        values[j] = monitored(info, reads[j - 1])
    iterations, sign, log = int(info[ITERATIONS]), info[DET_SIGN], info[DET_LOG]
    length, angle, misfit = looked_at(last, old, U, predicted, tangent, data.scales, values, iterations, sign, log, run, tests)
    if length != 0.0 and emptied(kick, data.nodes, data.span, last, old, U, tangent, data.scales, abs(length)) > 0.0:
        length = 0.0
    return length, angle, misfit


@njit
def smooth(T, data, last, old, U, tangent, length, corner, tolerance, max_iterations):
    """Whether the middle of the step from ``last`` to ``U`` lies where a smooth branch has it, as `hidden.jumped` asks; the tables
    hold the numbers at ``U`` in the end."""
    place, direction, info = np.empty(U.size), np.empty(U.size), np.empty(INFO)
    between(last, old, U, tangent, data.scales, length, place, direction)
    middle = place.copy()
    status = correct(T, data, middle, place, direction, 1.0, info, tolerance, max_iterations)
    set_modes(T, data.places, data.series, data.low, data.high, U[U.size - 1], data.nodes)
    return status == 1 and not aside(place, middle, data.scales, length, corner)
