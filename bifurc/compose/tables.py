"""Mode tables of an affine scene: packed numbers, and the compiled builder of their Taylor tables.

In every mode the motion is linear with periodic forcing.  With the state ``y`` and the forcing states
``w = (1, cos k1 theta, sin k1 theta, cos k2 theta, ...)``, ``theta = omega t``, joined to ``x = (y, w)``,

    y' = A x,      w' = W x,      guard = G x,      y+ = R x  (kick and memory writes).

Forcing enters as further linear states, so that undamped resonance, free masses and missing stiffness are no special
cases.  ``rebuild`` fills, for a step ``h`` on which the scaled motion turns by at most ``TURN``, the Taylor rows of the
flow; their truncation ``TURN**(ORDER+1)/(ORDER+1)!`` = 6e-17 is below rounding.

One file, because what rebuilds the tables fills nearly all arrays of their layout.
"""
import array
import dataclasses
import math
from typing import NamedTuple

import numpy as np

from .._jit import NOTHING, apart, both, leaf, njit, separate_leaf
from .pointer import WORD, Pointer, directory, seen_as

ORDER = 16  # of the Taylor rows
TURN = 0.8  # largest scaled angle of a step
BALANCES, UNITS = 4, 16  # sweeps over rows and columns, and products, that find the units of states in which their rates are least
FLIGHT = 64.0  # units of time of the loads, for which a slow mode adds up rounding: an event ends it before a far longer step does
MOST_STEPS = 4096  # of a motion in a scene without rates: any number of them is as exact
MANY = 5  # degrees of freedom from which on modes have modal coordinates: below it whole steps of the tables cost less
LEVELS = 80  # of the steps in modal coordinates, each longer than the one before by the root of 2


class Rows(NamedTuple):
    """Where the rows of the laws of a scene stand.

    Attributes
    ----------
    owners : ndarray (4, rows)
        For every row: first row and number of rows of its law; the row whose coordinates, speeds and accelerations it sees
        (itself, or the same of an earlier law of the element); the element.
    stages : ndarray (6,)
        Where the rows of forces, of reactions, of values of guards, and of impulses end (those of what constraints on curves
        ask to be zero are behind them); the largest number of rows of one law; where among the values of guards those end that
        are `curve.level`, which come first.
    """

    owners: np.ndarray
    stages: np.ndarray


@dataclasses.dataclass(frozen=True, init=False, eq=False, repr=False)
class Tables(array.array):
    """Numbers of a scene as the kernels see them; ``ns`` states, ``nw`` forcing states, ``nx = ns + nw``.

    The first group are views on ``flat`` (a parameter change writes there and calls `rebuild`), the second are integers
    fixed with the scene's structure, the third is derived by `rebuild`.
    """

    flat: np.ndarray  # (size,) all numbers below up to `LG`, one after the other; flat[0] is omega (0: autonomous)
    A: np.ndarray  # (modes, ns, nx) y' = A x
    G: np.ndarray  # (modes, guards, nx) guard = G x, negative inside
    R: np.ndarray  # (modes, guards, ns, nx) state after the event; rows of the identity where nothing jumps
    B: np.ndarray  # (modes, guards, ns) velocity direction of the kick with d(guard')/d(B) = 1; zero without a kick
    D: np.ndarray  # (modes, guards, ns) direction with guard changing by 1: positions of a surface, velocities of a stop, else 0
    H: np.ndarray  # (modes, holds, nx) speeds of held rows, zero while held
    S: np.ndarray  # (modes, holds, nx) positions of held rows that are frozen on a surface; zero row: no surface
    ratio: np.ndarray  # (modes, guards) ratio of the complete chattering (restitution); 0: none
    law: np.ndarray  # (values,) parameters of the laws that are not affine, one law after the other, each for all its modes
    LU: np.ndarray  # (rows, nx) coordinates u = LU x of all rows of all laws; no rows in an affine scene
    LS: np.ndarray  # (rows, nx) their speeds
    LP: np.ndarray  # (modes, rows, n) velocity rates per unit of force: v' = A x + sum over rows of LP f
    LG: np.ndarray  # (modes, guards, rows) guard = G x + LG f (reactions of held rows under a law; guards that are laws)

    harmonics: np.ndarray  # (nw-1)/2 integers k
    n_guards: np.ndarray  # (modes,)
    n_holds: np.ndarray  # (modes,)
    then: np.ndarray  # (modes, guards, candidates) modes in the order they are tried; -1 none, -2 not built yet
    kick: np.ndarray  # (modes, guards) 1 where R holds a kick, given only when the guard arrives with g' > 0
    ends_in: np.ndarray  # (modes, guards) mode in which a complete chattering ends; -1 none, -2 not built yet
    silent: np.ndarray  # (modes, guards) 1 where both sides have the same force
    element: np.ndarray  # (modes, guards) index of the element that owns the guard
    kind: np.ndarray  # (modes, guards) code of the event kind, see `bifurc.elements.EventKind`
    acts: np.ndarray  # (modes, laws) 0 where the law has no say in the mode, else 1 + where its values stand in ``law``
    owners: np.ndarray  # (4, rows) and
    stages: np.ndarray  # (6,) where the rows of the laws stand, see `Rows`
    bound: np.ndarray  # (2,) addresses of the C functions of the laws in this process, see `flow.laws.calls`; 0: not compiled yet
    still: np.ndarray  # (modes, guards) derivative from which on held rows make all of a guard vanish: 1, 2; 0: none does

    step: np.ndarray  # (modes,) h
    YT: np.ndarray  # (modes, ns, nx, ORDER+1) Taylor rows of the state
    GT: np.ndarray  # (modes, guards, nx, ORDER+1) Taylor rows of the guards
    E: np.ndarray  # (modes, ns, nx) state after h
    turn: np.ndarray  # (modes, nw) cos and sin of k omega h in the places of w; 1 first
    G4: np.ndarray  # (modes, guards, nx) h**4/384 max |g''''| on [0, h] per unit of x
    F: np.ndarray  # (ns, nx) largest |E| of all modes: what is added up where a state comes to zero

    # modal coordinates of many degrees of freedom, x = V xi; filled by `bifurc.compose.modal` and given up by `rebuild`
    blocks: np.ndarray  # (modes, 4) pairs, single decays, coordinates of the slow block, levels of steps; no levels: not there
    V: np.ndarray  # (modes, nx, nx)
    L: np.ndarray  # (modes, nx, nx) inverse of V
    N: np.ndarray  # (modes, nx, nx) the slow block, in its first rows and columns
    spin: np.ndarray  # (modes, nx, 2) eigenvalues, those of a pair in its first place
    GS: np.ndarray  # (modes, guards, nx, ORDER+1) Taylor rows of the guards over xi
    tail: np.ndarray  # (modes, guards, nx, 2) sizes of a guard's row over xi: itself, and of its Taylor term ORDER+1
    turns: np.ndarray  # (modes, LEVELS, nx) factors of all levels of steps
    level: np.ndarray  # (modes, LEVELS) their durations

    layout: "Layout" = dataclasses.field(init=False)
    numbers: np.ndarray = dataclasses.field(init=False)  # all floats, `flat` first
    whole: np.ndarray = dataclasses.field(init=False)  # all integers but `bound`
    address: int = dataclasses.field(init=False)  # of the directory: what compiled code takes

    def __new__(cls, layout: "Layout", numbers: np.ndarray, whole: np.ndarray, bound: np.ndarray):
        """Make the tables of which ``numbers`` and ``whole`` hold all floats and all integers, one array after the other."""
        words, places, own = [], (numbers.ctypes.data, whole.ctypes.data), bound.ctypes.data
        for name, (of_numbers, start, shape) in layout.items():
            words += [own if name == "bound" else places[not of_numbers] + WORD * start, *shape]
        made = directory(cls, words)
        made.__dict__.update(bound=bound, layout=layout, numbers=numbers, whole=whole, address=made.buffer_info()[0])
        return made

    def __getattr__(self, name: str):
        """Return an array, made when Python asks for it first: of most tables compiled code alone reads most of them."""
        if name not in PARTS:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        of_numbers, start, shape = self.layout[name]
        kind, buffer = (np.float64, self.numbers) if of_numbers else (np.int64, self.whole)
        made = self.__dict__[name] = np.ndarray(shape, kind, buffer, WORD * start)
        return made

    def __copy__(self):
        """Copies are lists of the same arrays' addresses; those of an array of integers would be plain ones."""
        return Tables(self.layout, self.numbers, self.whole, self.bound)

    def __deepcopy__(self, memo):
        return Tables(self.layout, self.numbers.copy(), self.whole.copy(), self.bound)

    def __reduce_ex__(self, protocol):
        """Addresses of functions mean nothing elsewhere."""
        return Tables, (self.layout, self.numbers, self.whole, np.zeros_like(self.bound))

    __eq__ = object.__eq__
    __hash__ = object.__hash__  # type: ignore[assignment]


PARTS = tuple(field.name for field in dataclasses.fields(Tables) if field.init)  # names of the arrays
Layout = dict[str, tuple[bool, int, tuple[int, ...]]]  # of every array: float or not, place in its buffer, shape
NO_ROWS = Rows(np.zeros((4, 0), np.int64), np.array([0, 0, 0, 0, 1, 0]))


def allocate(modes: int, guards: int, candidates: int, holds: int, n: int, ns: int, harmonics, laws: int = 0, law_values: int = 0,
             rows: Rows = NO_ROWS, bound: np.ndarray | None = None) -> Tables:
    """Return tables of zeros: views on one buffer of floats and one of integers.

    ``bound`` (2,) is shared by all tables with the same laws: whoever compiles them binds all.
    """
    count = rows.owners.shape[1]
    k = np.asarray(harmonics, np.int64)
    nw = 1 + 2 * k.size
    nx = ns + nw
    flat = {"A": (modes, ns, nx), "G": (modes, guards, nx), "R": (modes, guards, ns, nx), "B": (modes, guards, ns),
            "D": (modes, guards, ns), "H": (modes, holds, nx), "S": (modes, holds, nx), "ratio": (modes, guards),
            "law": (law_values,), "LU": (count, nx), "LS": (count, nx), "LP": (modes, count, n), "LG": (modes, guards, count)}
    counts = {"harmonics": k.shape, "n_guards": (modes,), "n_holds": (modes,), "then": (modes, guards, candidates),
              **dict.fromkeys(("kick", "ends_in", "silent", "element", "kind"), (modes, guards)), "acts": (modes, laws),
              "owners": rows.owners.shape, "stages": rows.stages.shape, "bound": (2,), "still": (modes, guards)}
    many, wide, levels = (modes, nx, LEVELS) if n >= MANY and laws == 0 else (0, 0, 0)
    derived = {"step": (modes,), "YT": (modes, ns, nx, ORDER + 1), "GT": (modes, guards, nx, ORDER + 1), "E": (modes, ns, nx),
               "turn": (modes, nw), "G4": (modes, guards, nx), "F": (ns, nx),
               "blocks": (modes, 4), **dict.fromkeys(("V", "L", "N"), (many, wide, wide)), "spin": (many, wide, 2),
               "GS": (many, guards, wide, ORDER + 1), "tail": (many, guards, wide, 2), "turns": (many, levels, wide),
               "level": (many, levels)}
    layout: Layout = {"flat": (True, 0, (1 + sum(map(math.prod, flat.values())),))}
    sizes = [0, 1]
    for name, shape in {**flat, **counts, **derived}.items():
        of_numbers = name in flat or (name in derived and name != "blocks")
        layout[name] = of_numbers, sizes[of_numbers], shape
        sizes[of_numbers] += math.prod(shape)
    T = Tables(layout, np.zeros(sizes[True]), np.zeros(sizes[False], np.int64),
               np.zeros(2, np.int64) if bound is None else bound)
    T.harmonics[:], T.owners[:], T.stages[:], T.then[:], T.ends_in[:] = k, rows.owners, rows.stages, -1, -1
    return T


NUMBERS = ("A", "G", "R", "B", "D", "H", "S", "ratio", "LP", "LG")  # of modes, in `Tables.flat`
MODAL = ("blocks", "V", "L", "N", "spin", "GS", "tail", "turns", "level")


def keep(old: Tables, new: Tables, names: tuple[str, ...]) -> None:
    """Copy the named arrays of all modes of ``old`` tables into ``new`` ones, which have more modes and may have more places."""
    for name in names:
        part = getattr(old, name)
        getattr(new, name)[tuple(slice(length) for length in part.shape)] = part


_small = allocate(1, 1, 1, 1, 1, 2, [1])
seen_as(Tables, Pointer("Tables", tuple((name, getattr(_small, name).dtype.name, getattr(_small, name).ndim) for name in PARTS)))


@njit
def rate(T, m):
    """Bound on the rate of change in mode ``m``: scaled norm of A (velocities over root of stiffness), forcing."""
    A, flat, harmonics = T.A, T.flat, T.harmonics
    n = T.LP.shape[2]
    stiff = 0.0
    damp = 0.0
    for i in range(n, 2 * n):
        k = 0.0
        c = 0.0
        for j in range(n):
            k += abs(A[m, i, j])
            c += abs(A[m, i, n + j])
        stiff = max(stiff, k)
        damp = max(damp, c)
    top = np.sqrt(stiff) + damp
    if A.shape[1] > 2 * n:
        top = max(top, rate_of_memory(A[m], n))
    for i in range(harmonics.size):
        top = max(top, harmonics[i] * flat[0])
    return top


@njit
def rate_of_memory(A, n):
    """Bound on the rate of change of states of which some, behind the first ``2 n``, have rates of their own; 0 where none has.

    For every positive x the largest of (|A| x)_i / x_i is the norm of A in the units x (Collatz and Wielandt).  Rows and columns
    are made as large as each other (Osborne), repeated products then find the least norm there is, whatever the units.
    """
    ns, moves = A.shape[0], False
    for i in range(2 * n, ns):
        for j in range(ns):
            moves = moves or A[i, j] != 0.0
    if not moves:
        return 0.0
    x, y, best = np.ones(ns), np.empty(ns), np.inf
    for _ in range(BALANCES):
        for i in range(ns):
            own, others = 0.0, 0.0
            for j in range(ns):
                if j != i:
                    own += abs(A[i, j]) * x[j]
                    others += abs(A[j, i]) / x[j]
            if own > 0.0 and others > 0.0:
                x[i] = np.sqrt(own / others)
    for _ in range(UNITS):
        top, largest = 0.0, 0.0
        for i in range(ns):
            y[i] = 0.0
            for j in range(ns):
                y[i] += abs(A[i, j]) * x[j]
            top, largest = max(top, y[i] / x[i]), max(largest, y[i])
        best = min(best, top)
        if best == 0.0:
            break
        for i in range(ns):
            x[i] = x[i] + y[i] / best
        x /= x.max()
    return best


@njit
def unit_of_time(T):
    """Return the time in which the constant loads of a scene without rates pass its largest length or reach its largest speed;
    without loads, in which that speed passes that length; 0 where its numbers tell no time: a motion does, see `paced`.

    Steps of such a scene are exact at any size, but rounding is measured by what is added up in one (`flow.rule.sizes`).
    """
    A, G = T.A, T.G
    n, ns = T.LP.shape[2], A.shape[1]
    load, length, speed = 0.0, 0.0, 0.0
    for m in range(T.n_guards.size):
        for i in range(n, 2 * n):
            load = max(load, abs(A[m, i, ns]))
        for g in range(T.n_guards[m]):
            of_places, of_speeds = 0.0, 0.0
            for c in range(n):
                of_places = max(of_places, abs(G[m, g, c]))
                of_speeds = max(of_speeds, abs(G[m, g, n + c]))
            if of_places > 0.0:
                length = max(length, abs(G[m, g, ns]) / of_places)
            elif of_speeds > 0.0:
                speed = max(speed, abs(G[m, g, ns]) / of_speeds)
    if load > 0.0 and max(length, speed) > 0.0:
        return max(np.sqrt(length / load), speed / load)
    return length / speed if length > 0.0 and speed > 0.0 else 0.0


def paced(T, x, span):
    """Measure the rounding of a scene without a clock by the time of a motion from ``x`` (nx,): that in which its loads stop its
    largest speed or pass its largest distance, or without loads in which that speed passes that distance.

    A scene without rates has steps as long as a motion of this ``span`` needs: they are exact at any size.
    """
    if T.flat[0] > 0.0:
        return
    unit = unit_of_motion(T, x)
    if not 0.0 < unit < np.inf:
        return
    if any(rate(T, m) > 0.0 for m in range(T.n_guards.size)):
        measure(T, FLIGHT * unit)
        return
    step = max(unit, span / MOST_STEPS)
    if (T.step != step).any():
        T.step[:] = step
        for m in range(T.n_guards.size):
            summed(T, m)
    measure(T, unit)


@njit
def unit_of_motion(T, x):
    """Return the time that `paced` says; 0 where nothing tells it."""
    n = T.LP.shape[2]
    load, length, speed = scales(T)
    for i in range(n):
        length, speed = max(length, abs(x[i])), max(speed, abs(x[n + i]))
    if load > 0.0:
        return max(np.sqrt(length / load), speed / load)
    return length / speed if speed > 0.0 else 0.0


@njit
def scales(T):
    """Return the largest constant load over a mass, distance of a surface, and speed of one."""
    load, length, speed = 0.0, 0.0, 0.0
    n, ns = T.LP.shape[2], T.A.shape[1]
    for m in range(T.n_guards.size):
        for i in range(n):
            load = max(load, abs(T.A[m, n + i, ns]))
        for g in range(T.n_guards[m]):
            for i in range(n):
                if T.D[m, g, i] != 0.0:
                    length = max(length, abs(T.G[m, g, ns] * T.D[m, g, i]))
                if T.D[m, g, n + i] != 0.0:
                    speed = max(speed, abs(T.G[m, g, ns] * T.D[m, g, n + i]))
    return load, length, speed


@njit
def longest_flight(T):
    """Return the time that bounds the flights whose rounding slow modes of a scene without a clock add up: `FLIGHT` times that in
    which the loads pass the largest distance of a surface; 0 where there are none.  A motion tells more, see `paced`."""
    load, length, _ = scales(T)
    return FLIGHT * np.sqrt(length / load) if load > 0.0 else 0.0


@both
def rebuild(T):
    """Fill step, YT, GT, E, turn, G4, F from the flat numbers."""
    for m in range(T.n_guards.size):
        rebuild_mode(T, m, True)
    measure(T, longest_flight(T) if T.flat[0] == 0.0 else 0.0)


@both
def measure(T, longest):
    """Write the largest numbers of a step of any mode, of steps that are cut to the time ``longest`` (0: of whole ones), into F."""
    E, F, YT = T.E, T.F, T.YT
    F[:] = 0.0
    for m in range(T.n_guards.size):
        slow = T.step[m] > longest > 0.0
        for i in range(F.shape[0]):
            for c in range(F.shape[1]):
                total = E[m, i, c]
                if slow:
                    total = YT[m, i, c, ORDER]
                    for j in range(ORDER - 1, -1, -1):
                        total = total * longest + YT[m, i, c, j]
                F[i, c] = max(F[i, c], abs(total))


@apart(NOTHING)
def rebuild_mode(T, m, whole):
    """Fill step, turn and GT of mode ``m`` from the flat numbers; with ``whole`` YT, E and G4, too, for flights without laws."""
    A, G, GT, YT, flat = T.A, T.G, T.GT, T.YT, T.flat
    harmonics, n_guards, step, still, turn = T.harmonics, T.n_guards, T.step, T.still, T.turn
    ns, nx = A.shape[1], A.shape[2]
    flights = ns if whole else 0
    omega = flat[0]
    T.blocks[m, 3] = 0
    top = rate(T, m)
    if top == 0.0:  # constant speeds: a polynomial that any step takes exactly; other modes tell the unit of time
        for k in range(n_guards.size):
            top = max(top, rate(T, k))
    if top == 0.0:
        h = unit_of_time(T)
        if h == 0.0:
            h = step[m] if step[m] > 0.0 else 1.0
    elif omega > 0.0:  # a whole number of steps a period, so that undisturbed flights end on a step
        period = 2.0 * np.pi / omega
        h = period / np.ceil(period * top / TURN)
    else:
        h = TURN / top
    step[m] = h
    turn[m, 0] = 1.0
    for k in range(harmonics.size):
        turn[m, 1 + 2 * k] = np.cos(harmonics[k] * omega * h)
        turn[m, 2 + 2 * k] = np.sin(harmonics[k] * omega * h)
    if whole and stand(T, m):  # the frequency is all that has changed
        for g in range(n_guards[m]):
            for c in range(ns + 1, nx):
                GT[m, g, c, 0] = G[m, g, c]
        for q in range(harmonics.size):
            for i in range(ns):
                forced_terms(A[m], harmonics[q] * omega, ns + 1 + 2 * q, YT[m, i], ORDER + 1)
            for g in range(n_guards[m]):
                forced_terms(A[m], harmonics[q] * omega, ns + 1 + 2 * q, GT[m, g], still[m, g] if still[m, g] > 0 else ORDER + 1)
    else:
        new = np.empty(nx)
        for i in range(flights):
            for c in range(nx):
                YT[m, i, c, 0] = 1.0 if c == i else 0.0
        for g in range(n_guards[m]):
            for c in range(nx):
                GT[m, g, c, 0] = G[m, g, c]
        for j in range(1, ORDER + 1):  # row by row in turn: one waits for its last term, and there are others meanwhile
            for i in range(flights):
                next_term(A, harmonics, omega, m, YT, i, j, new)
            for g in range(n_guards[m]):
                if still[m, g] == 0 or j < still[m, g]:
                    next_term(A, harmonics, omega, m, GT, g, j, new)
                else:
                    for c in range(nx):
                        GT[m, g, c, j] = 0.0
    if whole:
        summed(T, m)


@both
def summed(T, m):
    """Fill E and G4 of mode ``m`` for its step, from the Taylor rows."""
    E, G4, GT, YT, h = T.E, T.G4, T.GT, T.YT, T.step[m]
    for i in range(E.shape[1]):
        for c in range(E.shape[2]):
            total = YT[m, i, c, ORDER]
            for j in range(ORDER - 1, -1, -1):
                total = total * h + YT[m, i, c, j]
            E[m, i, c] = total
    fourth = h**4
    for g in range(T.n_guards[m]):
        for c in range(G4.shape[2]):
            total = 0.0
            for j in range(ORDER, 3, -1):
                total = total * h + abs(GT[m, g, c, j]) * (j * (j - 1) * (j - 2) * (j - 3))
            G4[m, g, c] = total * fourth / 384.0


@leaf
def stand(T, m):
    """Whether the Taylor rows of mode ``m`` over states and constant are those of its present numbers: their first terms are."""
    A, G, GT, YT = T.A, T.G, T.GT, T.YT
    ns = A.shape[1]
    for c in range(ns + 1):
        for i in range(ns):
            if YT[m, i, c, 0] != (1.0 if c == i else 0.0) or YT[m, i, c, 1] != A[m, i, c]:
                return False
        for g in range(T.n_guards[m]):
            if GT[m, g, c, 0] != G[m, g, c]:
                return False
    return True


@leaf
def next_term(A, harmonics, omega, m, rows, i, j, new):
    """Write Taylor term ``j`` of row ``i`` of mode ``m`` into ``rows`` (modes, rows, nx, ORDER+1): the one before times the matrix
    of the joined system x' = (A; W) x, over j; ``new`` (nx,) is room."""
    ns, nx = A.shape[1], A.shape[2]
    r = rows[m, i, 0, j - 1]
    for c in range(nx):
        new[c] = r * A[m, 0, c]
    for k in range(1, ns):
        r = rows[m, i, k, j - 1]
        if r != 0.0:
            for c in range(nx):
                new[c] += r * A[m, k, c]
    for k in range(harmonics.size):  # cos' = -k omega sin, sin' = k omega cos
        rate_k = harmonics[k] * omega
        c = ns + 1 + 2 * k
        new[c + 1] -= rate_k * rows[m, i, c, j - 1]
        new[c] += rate_k * rows[m, i, c + 1, j - 1]
    for c in range(nx):
        rows[m, i, c, j] = new[c] / j


@separate_leaf
def forced_terms(A, rate, c, row, count):
    """Do what `next_term` does for the first ``count`` terms of one row (nx, ORDER+1), in the columns ``c`` and ``c + 1`` of the
    harmonic that turns with ``rate``; the columns of the states are there."""
    of_cos, of_sin = row[c, 0], row[c + 1, 0]
    for j in range(1, count):
        new_cos, new_sin = 0.0, 0.0
        for k in range(A.shape[0]):
            new_cos += row[k, j - 1] * A[k, c]
            new_sin += row[k, j - 1] * A[k, c + 1]
        of_cos, of_sin = (new_cos + rate * of_sin) / j, (new_sin - rate * of_cos) / j
        row[c, j], row[c + 1, j] = of_cos, of_sin
