"""Numbers of a batch step through several modes, see `several_modes`: polynomials on the substeps, and what events do."""
from functools import cache

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial

from ...compose.tables import Tables
from ...elements import EventKind
from .several_modes import CANDIDATES, KICKS, MANY, NOISE, NOTHING, STOPS, UNKNOWN, Places

PARALLEL = 1e-12  # rows that differ by less are the same row


def step_numbers(T: Tables, most: int, h: float, flow: np.ndarray, phases: np.ndarray,
                 bounds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return ``numbers`` and ``grid``, flat, in the places of `several_modes.Places`.

    Parameters
    ----------
    T : Tables
    most : int
        Largest number of guards of a mode.
    h : float
        Substep.
    flow : ndarray
        State after h (modes, ns, nx).
    phases : ndarray
        Forcing states on the grid (substeps + 1, nw).
    bounds : ndarray
        Largest distance of a guard from its cubic, per unit of every component (modes, guards, nx).
    """
    modes, steps, ns, n = len(T.n_guards), len(phases) - 1, T.A.shape[1], T.LP.shape[2]
    at = Places(n, most)
    numbers, grid = np.zeros((modes, at.mode)), np.zeros((modes, steps, at.substep))
    before, after = phases[:-1], phases[1:]
    for m in range(modes):
        states, signs = T.YT[m], (-1.0) ** np.arange(T.YT.shape[3])
        place = economised(states[:n], h)
        numbers[m, :at.flow] = (h, *flow[m, :, :ns].ravel(), *place[:, :ns].ravel(),
                                *economised(signs * states[:n, :ns], h).ravel())
        grid[m, :, :ns] = before @ flow[m, :, ns:].T
        grid[m, :, ns:at.forced] = np.einsum("kc,icj->kij", before, place[:, ns:]).reshape(steps, -1)
        for g in range(T.n_guards[m]):
            whole = T.GT[m, g]
            value, slope, series = T.G[m, g], whole[:, 1] * (h / 3.0), economised(whole, h)
            bound, size = bounds[m, g], NOISE * (np.abs(whole) @ h ** np.arange(whole.shape[1]))
            rates = np.pad(whole[:, 1:] * np.arange(1, whole.shape[1]), ((0, 0), (0, 1))) * (h / 3.0)
            at_s = [economised(along[ns:] - np.tensordot(row[:ns], states[:, ns:], 1), h)
                    for along, row in ((whole, value), (rates, slope))]
            i, j = at.flow + g * at.guard, at.forced + g * at.guard_forced
            numbers[m, i:i + at.guard] = (*value[:ns], *slope[:ns], *bound[:ns], bound[ns:].sum(), *size[:ns], size[ns:].sum(),
                                          *added(T, m, g), value[ns], *series[:ns].ravel())
            grid[m, :, j:j + 4] = np.column_stack([phase @ row[ns:] for phase in (before, after) for row in (value, slope)])
            grid[m, :, j + 4:j + at.guard_forced] = np.hstack([before @ rows for rows in (series[ns:], *at_s)])
    return numbers.ravel(), grid.ravel()


def economised(series: np.ndarray, h: float, order: int = MANY - 1) -> np.ndarray:
    """Return the power series (..., terms) in s cut to an order on [0, h]: by Chebyshev polynomials, from the last term on.

    Lanczos (1938): each term that goes leaves the error 2^(1 - 2k) of itself, of the k-th power.
    """
    terms = series.shape[-1]
    return series * h ** np.arange(terms) @ _cut(terms, order) / h ** np.arange(order + 1)


@cache
def _cut(terms: int, order: int) -> np.ndarray:
    """Return the coefficients (terms, order + 1) of what the powers become on [0, 1]."""
    powers = np.eye(terms)
    for k in range(terms - 1, order, -1):
        shape = Chebyshev.basis(k, domain=(0.0, 1.0)).convert(kind=Polynomial, domain=(-1.0, 1.0)).coef
        powers[:, :k + 1] -= powers[:, k:k + 1] / shape[k] * shape
    return powers[:, :order + 1]


def plan_of(T: Tables, most: int) -> np.ndarray:
    """Return the integers (modes, ...) of the step: guards, and for each what it does, whether it is a hit, its candidates."""
    modes = len(T.n_guards)
    plan = np.zeros((modes, 1 + most * (3 + CANDIDATES)), np.int64)
    for m in range(modes):
        plan[m, 0] = T.n_guards[m]
        for g in range(T.n_guards[m]):
            at = 1 + g * (3 + CANDIDATES)
            what, known = _does(T, m, g), _known(T, m, g)
            if what == UNKNOWN or not known or len(known) > CANDIDATES:
                what, known = UNKNOWN, []
            plan[m, at:at + 3] = what, is_hit(T, m, g), len(known)
            plan[m, at + 3:at + 3 + len(known)] = known
    return plan


def is_hit(T: Tables, m: int, g: int) -> bool:
    """Return whether an event counts as an impact or elastic contact."""
    return bool(T.kick[m, g] == 1 or T.kind[m, g] == EventKind.CONTACT.code)


def _does(T: Tables, m: int, g: int) -> int:
    """Return what an event does to the speeds."""
    n, ns = T.LP.shape[2], T.A.shape[1]
    if T.kick[m, g] == 1:
        return KICKS if rebounds(T, m, g) else UNKNOWN
    if not _only(T, m, g, 0.0):
        return UNKNOWN
    if T.D[m, g, n:2 * n].any():
        return STOPS if not T.G[m, g, ns + 1:].any() else UNKNOWN
    return NOTHING


def rebounds(T: Tables, m: int, g: int) -> bool:
    """Return whether an event is an impact with restitution, whose kick is all that changes the state."""
    return bool(T.kick[m, g] == 1 and T.ratio[m, g] > 0.0 and T.B[m, g].any()
                and _only(T, m, g, np.outer(added(T, m, g), T.GT[m, g, :, 1])))


def _only(T: Tables, m: int, g: int, change) -> bool:
    """Return whether the state jumps by ``change`` (ns, nx) times x alone, but for what is put on the guard's surface."""
    jump = T.R[m, g] - np.eye(*T.R[m, g].shape) - change
    near = PARALLEL * max(1.0, float(np.abs(change).max()))
    return any(np.allclose(jump, put, rtol=PARALLEL, atol=near) for put in (0.0, -np.outer(T.D[m, g], T.G[m, g])))


def added(T: Tables, m: int, g: int) -> np.ndarray:
    """Return what an event adds to the state (ns,): a kick per speed of arrival; else minus this per value of the guard."""
    return -(1.0 + T.ratio[m, g]) * T.B[m, g] if T.kick[m, g] == 1 else T.D[m, g]


def _known(T: Tables, m: int, g: int) -> list[int]:
    """Return the candidates that the step may try in turn; none where one of them is out of its reach."""
    kicks, found = T.kick[m, g] == 1, []
    for c in followers(T, m, g):
        if c < 0:
            return []
        new = [k for k in range(T.n_holds[c]) if not _kept(T, m, g, T.H[c, k], T.S[c, k])]
        if new and kicks:  # a rebound does not rest
            continue
        if new and not (len(new) == 1 and T.D[m, g].any() and _same_row(T.G[m, g], T.H[c, new[0]]) and not T.S[c, new[0]].any()):
            return []
        found.append(c)
    return found


def _kept(T: Tables, m: int, g: int, row: np.ndarray, surface: np.ndarray) -> bool:
    """Return whether mode ``m`` holds a row on the same surface, and the event leaves it held."""
    if not any(_same_row(row, T.H[m, k]) and _same_surface(surface, T.S[m, k]) for k in range(T.n_holds[m])):
        return False
    change = added(T, m, g)
    return bool(abs(row[:change.size] @ change) <= PARALLEL * np.abs(row[:change.size]) @ np.abs(change))


def followers(T: Tables, m: int, g: int) -> list[int]:
    """Return the modes that may follow an event, in the order they are tried; -2: one is not built yet.

    A rebound also turns the friction on its row round, whose guard the general integration finds outside and lets fire at once:
    the modes of the other direction follow the stop's own.
    """
    found = [int(c) for c in T.then[m, g] if c != -1]
    if T.kick[m, g] != 1:
        return found
    for c in found:  # grows while it is walked
        if c < 0 or T.n_holds[c] or not _same_guard(T, m, c, g):
            continue
        for k in range(T.n_guards[c]):
            turns = T.element[c, k] != T.element[m, g] and T.kick[c, k] == 0 and T.D[c, k, T.LP.shape[2]:].any()
            whole = T.R[c, k] + np.outer(T.D[c, k], T.G[c, k])  # nothing jumps but what is put on the surface
            if turns and np.allclose(whole, np.eye(*whole.shape), rtol=0.0, atol=PARALLEL):
                found += [int(d) for d in T.then[c, k]
                          if d >= 0 and d not in found and T.n_holds[d] == 0 and _same_guard(T, m, d, g)]
    return found


def keeps_guard(T: Tables, m: int, g: int) -> bool:
    """Return whether guard ``g`` is the same in all modes without held rows that may follow it."""
    return all(_same_guard(T, m, c, g) for c in followers(T, m, g) if c >= 0 and T.n_holds[c] == 0)


def _same_guard(T: Tables, m: int, c: int, g: int) -> bool:
    """Return whether guard number ``g`` of two modes is one: its element, value, and slope."""
    return bool(g < T.n_guards[c] and T.element[m, g] == T.element[c, g] and T.kick[m, g] == T.kick[c, g]
                and np.array_equal(T.GT[m, g, :, :2], T.GT[c, g, :, :2]))


def _same_row(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether two rows vanish together."""
    return bool(np.abs(a / np.abs(a).max() * np.abs(b).max() * np.sign(a @ b) - b).max() <= PARALLEL * np.abs(b).max())


def _same_surface(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether rows of positions vanish together; both may be none."""
    return _same_row(a, b) if a.any() and b.any() else not (a.any() or b.any())
