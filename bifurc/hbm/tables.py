"""How kernels see the parts of a balance: structure and numbers in one flat vector each, read as a few arrays.

Arrays that are passed from Python are unpacked one by one, and compiled functions that take many are slow to compile; the
parts by name, `parts.Shape` and `parts.Numbers`, are for Python.
"""
from typing import NamedTuple

import numpy as np

from .._jit import both, inlined

# the head of the vector of structure: sizes, see `parts.Shape`
DOFS, SLOTS, ROWS_ALL, INTERNAL, EXCITED, CONTACTS, MODES, PAIRED, MOST_GUARDS, MEMORIES, COLUMNS, HEAD = range(12)

# one contact: (modes + 1, guards + 1, columns); row 0 of a mode, further rows of its guards
GUARDS, WRITES, FORGETS, ALGEBRAIC = 0, 1, 2, 3  # number; memory is written when left: any, all; from here on: which
# code; no force changes; mode tried first, -1: none; choice, see `parts.Shape`; from here on: successors, -1: none
KIND, SILENT, TRIAL, CHOICE, THEN = 0, 1, 2, 3, 4
# and of its last "mode": row 0 of the contact, row 1 the modes of a start in order, -1: none
# modes, memories, rows; rows of an expression (padded); whether guards have a choice; from here on: rows
COUNT, MEMORY, WIDTH, PAIRS, CHOOSES, ROWS = 0, 1, 2, 3, 4, 5

# an expression (columns,): constant and harmonics, then pairs of coordinate and speed of every row, then memory
# the expressions of a mode: forces, guards, algebraic memory


class Series(NamedTuple):
    """Numbers of a system along a parameter: those that change, as Chebyshev series on [low, high]."""

    base: np.ndarray  # all of them
    places: np.ndarray  # int (k,): which change
    series: np.ndarray  # (k, degree + 1)
    low: float
    high: float


class Grid(NamedTuple):
    """Where motions are looked at: 0 or the number of samples, and tables (nk, grid + 1) of the waves, both ends included."""

    samples: int
    cosines: np.ndarray
    sines: np.ndarray
    excite: np.ndarray  # (nx, grid + 1) columns of excitation, the constant left at 0, and their derivatives by phase
    dexcite: np.ndarray


class Room(NamedTuple):
    """Arrays that kernels overwrite; see `contacts.spectra.Sums` and, of every contact, `contacts.common.Segments`."""

    spectra: np.ndarray
    F: np.ndarray
    J: np.ndarray
    f: np.ndarray  # (size,) residual
    wide: np.ndarray  # (size, size + 1) derivatives
    paths: np.ndarray  # of every contact
    ends: np.ndarray
    zs: np.ndarray
    sources: np.ndarray
    counts: np.ndarray
    rates: np.ndarray  # (nc, M, G, grid + 1) derivatives by phase of the guards of modes that were entered, of exact events
    rows: np.ndarray  # (4, nr, mi) coefficients of coordinates and speeds of the rows, and their derivatives by the parameter
    grids: np.ndarray  # (4, nr, grid + 1) see `contacts.common.Tabulated`
    tables: np.ndarray  # see `contacts.common.Space`


def packed(shape) -> np.ndarray:
    """Return the structure of a balance as one vector of integers, from a `parts.Shape`."""
    n, m, nr, mi, nx, nc, M, Q, G, Z, T = (int(v) for v in shape.dims[:11])
    columns = max(THEN + T, ALGEBRAIC + Z, ROWS + Q, M)
    own = np.full((nc, M + 1, G + 1, columns), -1)
    for k in range(nc):
        last = own[k, M]
        last[0, [COUNT, MEMORY, WIDTH, PAIRS]] = shape.modes[k], shape.memory[k], (shape.rows[k] >= 0).sum(), Q
        last[0, CHOOSES], last[0, ROWS:ROWS + Q] = shape.choice[k].any(), shape.rows[k]
        last[1, :M] = shape.start[k]
        for m_ in range(int(shape.modes[k])):
            algebraic = shape.algebraic[k, m_, :shape.memory[k]]
            own[k, m_, 0, [GUARDS, WRITES, FORGETS]] = shape.guards[k, m_], algebraic.any(), algebraic.size > 0 and algebraic.all()
            own[k, m_, 0, ALGEBRAIC:ALGEBRAIC + Z] = shape.algebraic[k, m_]
            own[k, m_, 1:, [KIND, SILENT, TRIAL]] = shape.kinds[k, m_], shape.silent[k, m_], shape.trial[k, m_]
            own[k, m_, 1:, CHOICE] = shape.choice[k, m_]
            own[k, m_, 1:, THEN:THEN + T] = shape.then[k, m_]
    head = (n, m, nr, mi, nx, nc, M, Q, G, Z, columns)
    return np.concatenate([head, shape.waves, shape.place, shape.excited, own.ravel()]).astype(np.int64)


@inlined
def structure(S):
    """Return harmonics (mi,), slots of the balance (slots,) and the excitation (nx,), and contacts (nc, M + 1, G + 1, columns)."""
    i = HEAD
    waves = S[i:i + S[INTERNAL]]
    i += S[INTERNAL]
    place = S[i:i + S[SLOTS]]
    i += S[SLOTS]
    excited = S[i:i + S[EXCITED]]
    i += S[EXCITED]
    return waves, place, excited, S[i:].reshape(S[CONTACTS], S[MODES] + 1, S[MOST_GUARDS] + 1, S[COLUMNS])


@inlined
def expressions(S, flat):
    """Return the expressions of all modes (nc, M, Q + G + Z, columns) and of virgin starts (nc, Z, 2 Q), of a flat vector."""
    n, nr, nx, nc, M, Q, Z = S[DOFS], S[ROWS_ALL], S[EXCITED], S[CONTACTS], S[MODES], S[PAIRED], S[MEMORIES]
    i = 1 + 3 * n * n + S[SLOTS] * n + nr * nx + nr
    count, wide = Q + S[MOST_GUARDS] + Z, nx + 2 * Q + Z
    size = nc * M * count * wide
    return flat[i:i + size].reshape(nc, M, count, wide), flat[i + size:i + size + 2 * nc * Z * Q].reshape(nc, Z, 2 * Q)


@inlined
def core(S, flat):
    """Return mass, damping and stiffness (3, n, n) and load (slots, n) of a flat vector."""
    n = S[DOFS]
    i = 1 + 3 * n * n
    return flat[1:i].reshape(3, n, n), flat[i:i + S[SLOTS] * n].reshape(S[SLOTS], n)


@inlined
def moved(S, flat):
    """Return what is added to the rows: motion (nr, nx) and speed (nr,)."""
    n, nr, nx = S[DOFS], S[ROWS_ALL], S[EXCITED]
    i = 1 + 3 * n * n + S[SLOTS] * n
    return flat[i:i + nr * nx].reshape(nr, nx), flat[i + nr * nx:i + nr * nx + nr]


@both
def numbers_at(along: Series, p, flat, dflat):
    """Write the numbers of the system at parameter ``p`` and their derivatives."""
    base, index, series, low, high = along
    flat[:] = base
    dflat[:] = 0.0
    z = (2.0 * p - low - high) / (high - low)
    slope = 2.0 / (high - low)
    degree = series.shape[1] - 1
    for i in range(index.size):
        b0, b1, d0, d1 = 0.0, 0.0, 0.0, 0.0
        for j in range(degree, 0, -1):  # Clenshaw, and its derivative
            d0, d1 = 2.0 * b0 + 2.0 * z * d0 - d1, d0
            b0, b1 = 2.0 * z * b0 - b1 + series[i, j], b0
        flat[index[i]] = z * b0 - b1 + series[i, 0]
        dflat[index[i]] = (b0 + z * d0 - d1) * slope
