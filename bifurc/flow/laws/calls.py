"""What laws that are not affine give to a scene: two C functions, called by the addresses that its tables keep.

A scene with laws compiles two functions of its own, a step of the collocation and the values of its laws
(`bifurc.flow.laws.collocation`).  All other kernels are the same for every scene, compiled once for all laws there will ever be.
"""
import numpy as np

from ..._jit import leaf, njit
from ...compose.pointer import call
from .gauss import NODES

STEP, VALUES = range(2)  # places in ``T.bound``
FIRST, COUNT, SOURCE, OWNER = range(4)  # rows of ``T.owners``
FORCES, ACTING, KICKS, RESTS, WIDTH, LEVELS = range(6)  # places in ``T.stages``
# what `ask` gives: into local[2] (rows, 1), or derivatives into slope (3, rows, WIDTH, 1); see `bifurc.flow.laws.nolaw`
FORCE, REACTION, WATCH, SLOPE, KICK, KICK_SLOPE, REST, REST_MOVE, REST_SLOPE = range(9)

# places in the scratch: step of the tabled turns, step wished next, defect; how many words behind the numbers of the tables those
# at another value of a parameter stand (0: none, `ALIKE`: they are the same), and by what part their frequency is higher
TABLED, WISH, ERROR, BESIDE, HIGHER, ARRAYS = range(6)
ALIKE = 1
WORST = 3.0  # times the defect aimed at is still accepted
ANGLE = 1.2  # largest phase of the highest harmonic in a step: Taylor series of guards to ORDER are good to 6e-14


@leaf
def longest(harmonics, omega):
    """Longest step on which the forcing is one Taylor series."""
    return ANGLE / (harmonics[-1] * omega) if harmonics.size > 0 and omega > 0.0 else np.inf


@njit
def scratch_of(T, count):
    """Return the scratch array of `step` for ``count`` variations."""
    n, rows, width = T.LP.shape[2], T.LU.shape[0], T.stages[WIDTH]
    size = ARRAYS + (T.A.shape[2] - 2 * n) * (NODES + 4) + rows * (6 * NODES + 4) + n * (5 * NODES + 4)
    if count > 0:
        size += (NODES + 1) * (2 * n * n + 3 * rows * width) + n * (NODES + 1) + T.A.shape[2]
    scratch = np.empty(size)
    scratch[TABLED], scratch[WISH], scratch[BESIDE] = 0.0, np.inf, 0.0
    return scratch


@leaf
def address(T, place):
    """Return the address of a C function of the scene."""
    if T.bound[place] == 0:
        raise RuntimeError("the laws of this scene are not compiled in this process; ask bifurc.compose.writer.kernels first")
    return T.bound[place]


@leaf
def step(T, m, x, h, aim, x1, acc, force, X, edges, accs, scratch):
    """One step of at most ``h`` from ``x`` (nx,) to ``x1`` with a defect near ``aim``; return its length.

    ``acc`` (n, NODES + 2) and ``force`` (rows, NODES + 2) receive accelerations and forces of laws at start, nodes and
    end; the variations ``X`` (count, ns) move along, and where ``edges`` is 1 ``accs`` (count, n, NODES + 2) receives their
    accelerations.  ``scratch``, see `scratch_of`, keeps the step to try next and the defect; with numbers `BESIDE` those of the
    tables the last variation is what they change in the state, at the same phase of the forcing.  Where the law leaves the
    finite numbers ``x1`` is NaN, which the callers' statuses catch.
    """
    return call(address(T, STEP), (
        m, T.A.shape[2], T.harmonics.size, T.acts.shape[1], T.law.size, X.shape[0], edges,
        T.flat[0], T.step[m], h, aim, T.A, T.LU, T.LS, T.LP, T.law, T.acts, T.harmonics, x, x1, acc, force, X, accs, scratch))


@njit
def ask(T, what, m, owner, closes, local, slope):
    """Let the laws of the scene write what they give at one point: values into ``local[2]``, derivatives into ``slope``.

    Where no derivatives are asked for, any array will do.
    """
    call(address(T, VALUES), (what, m, T.acts.shape[1], T.law.size, owner, closes, T.step[m], T.law, T.acts, local, slope))


@njit
def values(T, what, m, local):
    """As `ask`, for values that no event has a say in."""
    ask(T, what, m, -1, 0, local, local)


@njit
def slopes(T, what, m, local):
    """Return derivatives (3, rows, WIDTH, 1) by coordinates, speeds and accelerations of the rows of each law."""
    slope = np.zeros((3, T.LU.shape[0], T.stages[WIDTH], 1))
    ask(T, what, m, -1, 0, local, slope)
    return slope


@njit
def rate(T, m, x, f, local):
    """Write y' into ``f`` (ns,); ``local`` (4, rows, 1) receives coordinates, speeds, forces and accelerations of the law rows.

    The accelerations are those that the rows would have without reactions; reactions of curved constraints follow from them.
    """
    A, LU, LS, LP, sources = T.A, T.LU, T.LS, T.LP, T.owners[SOURCE]
    n, rows, forces, acting = LP.shape[2], LU.shape[0], T.stages[FORCES], T.stages[ACTING]
    for i in range(2 * n, A.shape[1]):
        f[i] = 0.0
    for i in range(n):
        f[i] = x[n + i]
        total = 0.0
        for c in range(x.size):
            total += A[m, n + i, c] * x[c]
        f[n + i] = total
    if rows == 0:
        return
    for r in range(rows):
        if sources[r] != r:
            continue
        total, speed = 0.0, 0.0
        for c in range(x.size):
            total += LU[r, c] * x[c]
            speed += LS[r, c] * x[c]
        local[0, r, 0] = total
        local[1, r, 0] = speed
    values(T, FORCE, m, local)
    push(LP, m, 0, forces, local, f)
    if acting > forces:
        for r in range(rows):
            if sources[r] != r:
                continue
            total = 0.0
            for i in range(n):
                total += LU[r, i] * f[n + i]
            local[3, r, 0] = total
        values(T, REACTION, m, local)
        push(LP, m, forces, acting, local, f)


@njit
def push(LP, m, first, last, local, f):
    """Add what the forces of the rows from ``first`` to ``last`` give to the accelerations in ``f`` (ns,)."""
    n = LP.shape[2]
    for r in range(first, last):
        for i in range(n):
            f[n + i] += LP[m, r, i] * local[2, r, 0]
