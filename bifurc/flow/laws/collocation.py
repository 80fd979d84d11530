"""Steps of a mode under a law that is not affine: collocation at eight Gauss points.

The accelerations at the nodes are iterated (order 16; integrating to the last digit with few long steps is Everhart's
idea, 1985, see also Rein and Spiegel 2015).  Positions are integrated twice, so that an iteration gains two orders of
the step.  Variations of the state obey the same equations, linear.

All other kernels reach a scene's step, and its laws, through two C functions (`calls`): what is compiled for a law is
this file, and nothing that calls it.

This is a template: the written module of a scene (`bifurc.compose.writer`) is this text with the law functions of that
scene in the place of `nolaw`, so that the numbers of degrees of freedom and of rows are literals.

One file, because the written module of a scene is made of this text as a whole.
"""
import numpy as np
from numba import carray, cfunc, types
from numba.extending import intrinsic

from ..._jit import separate
from ...compose.tables import TURN
from ..affine.polynomial import SMALLEST
from .calls import (
    ALIKE,
    ARRAYS,
    BESIDE,
    ERROR,
    FORCE,
    HIGHER,
    KICK,
    KICK_SLOPE,
    REACTION,
    REST,
    REST_MOVE,
    SLOPE,
    TABLED,
    WATCH,
    WISH,
    WORST,
)
from .gauss import NODES, C
from .nodes import (
    defect,
    farthest,
    finish,
    frequency,
    largest,
    prepare,
    quicken,
    remembered,
    rounding,
    spread,
    squarable,
    taken,
    wished,
)
from .nolaw import (
    ACTING,
    COUNT,
    DOFS,
    FIRST,
    FORCES,
    ROWS,
    SOURCE,
    WIDTH,
    forces,
    kick_slopes,
    kicks,
    reaction_slopes,
    reactions,
    rest_moves,
    rest_slopes,
    rests,
    slopes,
    watch_slopes,
    watches,
)

FAST = 3.0  # angle by which a variation turns on a step at most: Gauss' method then errs by 1e-15
ROUNDING = 2e-15  # of the largest sum of terms: a change below it is none
ITERATIONS = 30
SHORTEST = 1e-6  # of the Taylor tables' step: a law with a kink is crossed with steps of this size
FLOOR = 1e-5  # of the forces of the springs: where forces cancel to less (a constant motion) the defect is that of their rounding


@separate
def rate(A, m, LU, LS, LP, law, acts, x, f, local):
    """Write y' into ``f`` (ns,); ``local`` (4, rows, 1) receives coordinates, speeds, forces and accelerations of the law rows.

    The accelerations are those that the rows would have without reactions; reactions of curved constraints follow from them.
    """
    n, rows = DOFS, ROWS
    for i in range(2 * n, A.shape[1]):
        f[i] = 0.0
    for i in range(n):
        f[i] = x[n + i]
        total = 0.0
        for c in range(x.size):
            total += A[m, n + i, c] * x[c]
        f[n + i] = total
    if rows > 0:
        for r in range(rows):
            if SOURCE[r] != r:
                continue
            total, speed = 0.0, 0.0
            for c in range(x.size):
                total += LU[r, c] * x[c]
                speed += LS[r, c] * x[c]
            local[0, r, 0] = total
            local[1, r, 0] = speed
        forces(law, acts, m, 1, local)
        for r in range(FORCES):
            for i in range(n):
                f[n + i] += LP[m, r, i] * local[2, r, 0]
        if ACTING > FORCES:
            for r in range(rows):
                if SOURCE[r] != r:
                    continue
                total = 0.0
                for i in range(n):
                    total += LU[r, i] * f[n + i]
                local[3, r, 0] = total
            reactions(law, acts, m, 1, local)
            for r in range(FORCES, ACTING):
                for i in range(n):
                    f[n + i] += LP[m, r, i] * local[2, r, 0]


@separate
def excite(A, m, LU, LS, x, turn, base, local):
    """Write what memory and forcing states give to accelerations and to the law rows at the nodes of the step from ``x``."""
    n, rows = DOFS, ROWS
    ns = A.shape[1]
    for i in range(n):
        still = A[m, n + i, ns] + remembered(A, m, i, n, x)
        for j in range(NODES):
            base[i, j] = still
    for r in range(rows):
        if SOURCE[r] != r:
            continue
        for j in range(NODES):
            local[4, r, j] = LU[r, ns]
            local[5, r, j] = LS[r, ns]
    for c in range(1, x.size - ns, 2):
        cos, sin = x[ns + c], x[ns + c + 1]
        for i in range(n):  # p cos + q sin at a node, from the values at the start and the turn to the node
            p, q = A[m, n + i, ns + c], A[m, n + i, ns + c + 1]
            even, odd = p * cos + q * sin, q * cos - p * sin
            for j in range(NODES):
                base[i, j] += even * turn[c, j] + odd * turn[c + 1, j]
        for r in range(rows):
            if SOURCE[r] != r:
                continue
            for k in range(2):
                p, q = (LU[r, ns + c], LU[r, ns + c + 1]) if k == 0 else (LS[r, ns + c], LS[r, ns + c + 1])
                if p != 0.0 or q != 0.0:
                    even, odd = p * cos + q * sin, q * cos - p * sin
                    for j in range(NODES):
                        local[4 + k, r, j] += even * turn[c, j] + odd * turn[c + 1, j]


@separate
def solve(motion, m, x, h, f0, stiff, turn, local, room):
    """Accelerations ``a`` at the nodes of the step ``h`` from ``x`` (nx,), ``f0`` (ns,) the field there.

    ``motion`` are the tables that `rate` takes, ``local`` (6, rows, NODES) coordinates, speeds, forces, accelerations of the law
    rows, and what forcing adds to the first two, ``room`` the arrays ``q``, ``v``, ``a``, ``base``, ``free`` (n, NODES).  Returns
    the number of iterations, 0 where they do not converge, and the largest acceleration.
    """
    A, LU, LS, LP, law, acts = motion
    q, v, a, base, free = room
    n, rows = DOFS, ROWS
    excite(A, m, LU, LS, x, turn, base, local)
    for i in range(n):
        for j in range(NODES):
            a[i, j] = f0[n + i]
    scale = squarable(n, x, f0, base)
    old, top, noise = np.inf, 0.0, 0.0
    for iteration in range(1, ITERATIONS + 1):
        for i in range(n):
            spread(x, i, n, h, a, q, v)
        if rows > 0:
            for r in range(rows):
                if SOURCE[r] != r:
                    continue
                for j in range(NODES):
                    total, speed = local[4, r, j], local[5, r, j]
                    for i in range(n):
                        total += LU[r, i] * q[i, j]
                        speed += LS[r, n + i] * v[i, j]
                    local[0, r, j] = total
                    local[1, r, j] = speed
            forces(law, acts, m, NODES, local)
        for i in range(n):
            for j in range(NODES):
                new = base[i, j]
                for k in range(n):
                    new += A[m, n + i, k] * q[k, j] + A[m, n + i, n + k] * v[k, j]
                for r in range(FORCES):
                    new += LP[m, r, i] * local[2, r, j]
                free[i, j] = new
        if ACTING > FORCES:
            for r in range(rows):
                if SOURCE[r] != r:
                    continue
                for j in range(NODES):
                    total = 0.0
                    for i in range(n):
                        total += LU[r, i] * free[i, j]
                    local[3, r, j] = total
            reactions(law, acts, m, NODES, local)
            for i in range(n):
                for j in range(NODES):
                    new = free[i, j]
                    for r in range(FORCES, ACTING):
                        new += LP[m, r, i] * local[2, r, j]
                    free[i, j] = new
        change = 0.0
        for i in range(n):
            change += taken(free, i, a, scale)
        change = np.sqrt(change)
        if not (change < np.inf):
            return 0, 0.0
        if iteration == 2:
            top = largest(n, a)
            noise = rounding(n, scale, top, stiff, q)
        if iteration < 2:
            old = change
            continue
        if change <= noise or (change < 0.5 * old and change * change <= noise * (old - change)):
            return iteration, top
        if iteration > 4 and change > 0.5 * old:
            if change <= 1e3 * noise:
                return iteration, top
            if change > old:
                return 0, top
        old = change
    return 0, 0.0


@separate
def linearise(A, m, LU, LS, LP, law, acts, h, local, slope, K, D):
    """Derivatives of the acceleration at some nodes in positions, ``K`` (n, n, nodes), and velocities, ``D``.

    ``slope`` (3, rows, WIDTH, nodes) is room for the derivatives of the laws by coordinates, speeds and accelerations.
    """
    n, rows = DOFS, ROWS
    nodes = K.shape[2]
    for i in range(n):
        for c in range(n):
            for j in range(nodes):
                K[i, c, j] = A[m, n + i, c]
                D[i, c, j] = A[m, n + i, n + c]
    if rows > 0:
        slopes(law, acts, m, h, nodes, local, slope)
        for r in range(FORCES):
            for b in range(COUNT[r]):
                other = FIRST[r] + b
                for i in range(n):
                    for c in range(n):
                        pu = LP[m, r, i] * LU[other, c]
                        ps = LP[m, r, i] * LS[other, n + c]
                        for j in range(nodes):
                            K[i, c, j] += pu * slope[0, r, b, j]
                            D[i, c, j] += ps * slope[1, r, b, j]
    if ACTING > FORCES:
        reaction_slopes(law, acts, m, h, nodes, local, slope)
        K0, D0 = K.copy(), D.copy()
        for r in range(FORCES, ACTING):
            for b in range(COUNT[r]):
                other = FIRST[r] + b
                for i in range(n):
                    for c in range(n):
                        for j in range(nodes):
                            along, across = 0.0, 0.0
                            for k in range(n):
                                along += LU[other, k] * K0[k, c, j]
                                across += LU[other, k] * D0[k, c, j]
                            K[i, c, j] += LP[m, r, i] * (slope[0, r, b, j] * LU[other, c] + slope[2, r, b, j] * along)
                            D[i, c, j] += LP[m, r, i] * (slope[1, r, b, j] * LS[other, n + c] + slope[2, r, b, j] * across)


@separate
def vary(load, x, X, row, h, K, D, iterations, room):
    """Move row ``row`` of ``X`` (count, ns), a variation of the state, to the end of the step.

    ``load`` (n, NODES) are accelerations that do not depend on it.  ``x`` (ns,) is room, and so are the five arrays (n, NODES) of
    ``room``.

    The state took ``iterations``; a variation may need more, in directions that the motion itself does not stir.
    """
    q, v, a, new, terms = room
    n = DOFS
    still = True
    for i in range(2 * n):
        x[i] = X[row, i]
        still = still and x[i] == 0.0
    if still and largest(n, load) == 0.0:  # memory that no force knows in this mode
        for i in range(n):
            for j in range(NODES):
                a[i, j] = 0.0
        return
    for i in range(n):
        for j in range(NODES):
            q[i, j] = x[i] + h * C[j] * x[n + i]
            v[i, j] = x[n + i]
    old = np.inf
    for iteration in range(ITERATIONS):
        change = 0.0
        for i in range(n):
            for j in range(NODES):
                total = load[i, j]
                for c in range(n):
                    total += K[i, c, j] * q[c, j] + D[i, c, j] * v[c, j]
                new[i, j] = total
        for i in range(n):
            change = max(change, farthest(new, i, a))
        if iteration >= iterations:
            for i in range(n):
                for j in range(NODES):
                    total = abs(load[i, j])
                    for c in range(n):
                        total += abs(K[i, c, j] * q[c, j]) + abs(D[i, c, j] * v[c, j])
                    terms[i, j] = total
            noise = ROUNDING * largest(n, terms)
            if change <= noise or (change < 0.5 * old and change * change <= noise * (old - change)) or change != change:
                break
        old = change
        for i in range(n):
            spread(x, i, n, h, a, q, v)
    for i in range(n):
        finish(x, i, n, h, a)
    for i in range(2 * n):
        X[row, i] = x[i]


@separate
def pull(motion, m, x, turn, room, now, f, one, load):
    """Write into ``load`` (n, NODES) by how much the accelerations at the nodes of the step from ``x`` (nx,) are others under the
    tables ``motion``, at the same places and speeds and the same phase of the forcing; ``now`` (nx,), ``f`` (ns,) and ``one`` are
    room."""
    A, LU, LS, LP, law, acts = motion
    q, v, a = room[:3]
    n = DOFS
    ns = A.shape[1]
    for j in range(NODES):
        for c in range(2 * n, ns + 1):
            now[c] = x[c]
        for i in range(n):
            now[i], now[n + i] = q[i, j], v[i, j]
        for c in range(ns + 1, x.size, 2):
            cos, sin = turn[c - ns, j], turn[c + 1 - ns, j]
            now[c], now[c + 1] = cos * x[c] - sin * x[c + 1], cos * x[c + 1] + sin * x[c]
        rate(A, m, LU, LS, LP, law, acts, now, f, one)
        for i in range(n):
            load[i, j] = f[n + i] - a[i, j]


@separate
def attempt(motion, m, clock, h, fresh, now, moved, ends, turn, local, one, room):
    """Solve the step ``h`` from ``now`` (nx,) to ``moved``; return iterations (0: failed) and the defect at its ends.

    ``clock`` are harmonics, frequency of the forcing and the square of the largest rate of the motion; ``ends`` the field (ns,) at
    the start, and room for that at the end; ``fresh``: the turns fit this ``h`` already.  The others see `solve`.
    """
    A, LU, LS, LP, law, acts = motion
    q, v, a, base, free = room
    (harmonics, omega, stiff), (f0, f1) = clock, ends
    n = DOFS
    ns = A.shape[1]
    if not fresh:
        prepare(harmonics, omega, h, turn)
    iterations, top = solve(motion, m, now, h, f0, stiff, turn, local, room)
    if iterations == 0:
        return 0, np.inf
    for i in range(ns):
        moved[i] = now[i]
    for i in range(n):
        finish(moved, i, n, h, a)
    moved[ns] = 1.0
    for c in range(ns + 1, now.size, 2):
        cos, sin = turn[c - ns, NODES], turn[c + 1 - ns, NODES]
        moved[c], moved[c + 1] = cos * now[c] - sin * now[c + 1], cos * now[c + 1] + sin * now[c]
    rate(A, m, LU, LS, LP, law, acts, moved, f1, one)
    e = defect(n, h, f0, f1, max(top, max(FLOOR * stiff * largest(n, q), (1.0 + stiff) * SMALLEST)), a)
    if not e < np.inf:  # a force that is no number at an end of the step
        return 0, np.inf
    return iterations, e


@intrinsic
def offset(typing_context, pointer, count):
    """Pointer to the number ``count`` places further on (a view of an array would cost more than some of the loops)."""
    def codegen(context, builder, signature, arguments):
        return builder.gep(arguments[0], [arguments[1]])
    return pointer(pointer, types.intp), codegen


_numbers, _whole = types.CPointer(types.float64), types.CPointer(types.int64)
SIGNATURE = types.float64(
    types.intp, types.intp, types.intp, types.intp, types.intp, types.intp, types.intp,
    types.float64, types.float64, types.float64, types.float64,
    _numbers, _numbers, _numbers, _numbers, _numbers, _whole, _whole,
    _numbers, _numbers, _numbers, _numbers, _numbers, _numbers, _numbers)


def _step(m, nx, harmonic_count, laws, values, count, edges, omega, unit, h, aim,
          A_, LU_, LS_, LP_, law_, acts_, harmonics_, x_, x1_, acc_, force_, X_, accs_, scratch_):
    """See `step`."""
    n, rows = DOFS, ROWS
    nw = 1 + 2 * harmonic_count
    ns = nx - nw
    A, LU, LS, LP = carray(A_, (m + 1, ns, nx)), carray(LU_, (rows, nx)), carray(LS_, (rows, nx)), carray(LP_, (m + 1, rows, n))
    law, acts, harmonics = carray(law_, (values,)), carray(acts_, (m + 1, laws)), carray(harmonics_, (harmonic_count,))
    x, x1, acc, force = carray(x_, (nx,)), carray(x1_, (nx,)), carray(acc_, (n, NODES + 2)), carray(force_, (rows, NODES + 2))
    scratch, at = carray(scratch_, (ARRAYS,)), ARRAYS
    turn, at = carray(offset(scratch_, at), (nw, NODES + 1)), at + nw * (NODES + 1)
    local, at = carray(offset(scratch_, at), (6, rows, NODES)), at + 6 * rows * NODES
    one, at = carray(offset(scratch_, at), (4, rows, 1)), at + 4 * rows
    q, at = carray(offset(scratch_, at), (n, NODES)), at + n * NODES
    v, at = carray(offset(scratch_, at), (n, NODES)), at + n * NODES
    a, at = carray(offset(scratch_, at), (n, NODES)), at + n * NODES
    base, at = carray(offset(scratch_, at), (n, NODES)), at + n * NODES
    free, at = carray(offset(scratch_, at), (n, NODES)), at + n * NODES
    f0, at = carray(offset(scratch_, at), (ns,)), at + ns
    f1, at = carray(offset(scratch_, at), (ns,)), at + ns
    rate(A, m, LU, LS, LP, law, acts, x, f0, one)
    X, accs = carray(X_, (count, ns)), carray(accs_, (count, n, NODES + 2))
    K, at = carray(offset(scratch_, at), (n, n, NODES)), at + n * n * NODES
    D, at = carray(offset(scratch_, at), (n, n, NODES)), at + n * n * NODES
    slope, at = carray(offset(scratch_, at), (3, rows, WIDTH, NODES)), at + 3 * rows * WIDTH * NODES
    Ke, at = carray(offset(scratch_, at), (n, n, 1)), at + n * n
    De, at = carray(offset(scratch_, at), (n, n, 1)), at + n * n
    edge, at = carray(offset(scratch_, at), (3, rows, WIDTH, 1)), at + 3 * rows * WIDTH
    variation, at = carray(offset(scratch_, at), (nx,)), at + nx
    load, room, motion = carray(offset(scratch_, at), (n, NODES)), (q, v, a, base, free), (A, LU, LS, LP, law, acts)
    watches(law, acts, m, 1, one)
    for r in range(rows):
        force[r, 0] = one[2, r, 0]
    most = np.inf
    if count > 0:  # variations may turn faster than the motion does
        linearise(A, m, LU, LS, LP, law, acts, h, one, edge, Ke, De)
        most = FAST / max(frequency(Ke, De), 1e-300)
        h = min(h, most) if h > 0.0 else max(h, -most)
    clock = harmonics, omega, (TURN / unit) ** 2
    while True:
        fresh = abs(h - scratch[TABLED]) <= 1e-14 * abs(h)
        iterations, e = attempt(motion, m, clock, h, fresh, x, x1, (f0, f1), turn, local, one, room)
        scratch[TABLED] = h
        scratch[ERROR] = e
        scratch[WISH] = min(wished(abs(h), e, aim), most)
        if e <= WORST * aim or not abs(h) > SHORTEST * unit:
            break
        h = scratch[WISH] if h > 0.0 else -scratch[WISH]
    if iterations == 0:
        for i in range(ns):
            x1[i] = np.nan
    watches(law, acts, m, NODES, local)
    watches(law, acts, m, 1, one)
    for i in range(n):
        acc[i, 0] = f0[n + i]
        acc[i, NODES + 1] = f1[n + i]
        for j in range(NODES):
            acc[i, j + 1] = a[i, j]
    for r in range(rows):
        force[r, NODES + 1] = one[2, r, 0]
        for j in range(NODES):
            force[r, j + 1] = local[2, r, j]
    if count == 0:
        return h
    linearise(A, m, LU, LS, LP, law, acts, h, local, slope, K, D)
    for i in range(n):
        for j in range(NODES):
            load[i, j] = 0.0
    other, eps = int(scratch[BESIDE]), 0.0
    if other != 0:
        eps = scratch[HIGHER]
        if other != ALIKE:
            pull((carray(offset(A_, other), (m + 1, ns, nx)), carray(offset(LU_, other), (rows, nx)),
                  carray(offset(LS_, other), (rows, nx)), carray(offset(LP_, other), (m + 1, rows, n)),
                  carray(offset(law_, other), (values,)), acts), m, x, turn, room, variation, f1, one, load)
        quicken(DOFS, eps, room, D, load)
    for end in range(2):
        if edges:
            rate(A, m, LU, LS, LP, law, acts, x if end == 0 else x1, f1, one)
            linearise(A, m, LU, LS, LP, law, acts, h, one, edge, Ke, De)
        for k in range(count - 1, -1, -1):
            if end == 1:
                of_numbers = other != 0 and k == count - 1  # the first one: its load is there
                for i in range(n):
                    if of_numbers:
                        X[k, n + i] -= eps * x[n + i]
                    elif other != 0 or ns > 2 * n:
                        for c in range(2 * n, ns):
                            variation[c] = X[k, c]
                        memory = remembered(A, m, i, n, variation)
                        for j in range(NODES):
                            load[i, j] = memory
                vary(load, variation, X, k, h, K, D, iterations, room)
                for i in range(n if of_numbers else 0):
                    X[k, n + i] += eps * x1[n + i]
            if edges:
                for c in range(ns):
                    variation[c] = X[k, c]
                for i in range(n):
                    total = remembered(A, m, i, n, variation)
                    for c in range(n):
                        total += Ke[i, c, 0] * X[k, c] + De[i, c, 0] * X[k, n + c]
                    accs[k, i, end * (NODES + 1)] = total
                    if end == 1:
                        for j in range(NODES):
                            accs[k, i, j + 1] = a[i, j]
    return h


VALUES_SIGNATURE = types.float64(
    types.intp, types.intp, types.intp, types.intp, types.intp, types.intp, types.float64,
    _numbers, _whole, _numbers, _numbers)


def _values(what, m, laws, values, owner, closes, h, law_, acts_, local_, slope_):
    """See `calls.ask`."""
    rows = ROWS
    law, acts = carray(law_, (values,)), carray(acts_, (m + 1, laws))
    local, slope = carray(local_, (4, rows, 1)), carray(slope_, (3, rows, WIDTH, 1))
    if what == FORCE:
        forces(law, acts, m, 1, local)
    elif what == REACTION:
        reactions(law, acts, m, 1, local)
    elif what == WATCH:
        watches(law, acts, m, 1, local)
    elif what == SLOPE:
        slopes(law, acts, m, h, 1, local, slope)
        reaction_slopes(law, acts, m, h, 1, local, slope)
        watch_slopes(law, acts, m, h, 1, local, slope)
    elif what == KICK:
        kicks(law, acts, m, 1, owner, closes != 0, local)
    elif what == KICK_SLOPE:
        kick_slopes(law, acts, m, h, 1, owner, closes != 0, local, slope)
    elif what == REST:
        rests(law, acts, m, 1, local)
    elif what == REST_MOVE:
        rest_moves(law, acts, m, h, 1, local, slope)
    else:
        rest_slopes(law, acts, m, 1, local, slope)
    return 0.0


_compiled = [cfunc(signature, cache=True, error_model="numpy")(function)
             for signature, function in ((SIGNATURE, _step), (VALUES_SIGNATURE, _values))]
ADDRESSES = tuple(made.address for made in _compiled)  # in the order of `calls.STEP` and `calls.VALUES`
