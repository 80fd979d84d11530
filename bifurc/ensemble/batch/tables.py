"""Numbers of a batch step through several modes, see `several_modes`: polynomials on the substeps, and what events do."""
from functools import cache

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial

from ...compose.tables import ORDER, Tables
from ...elements import EventKind
from .several_modes import CANDIDATES, NOISE, records
from .writing import MANY

SAME = 1e-12  # of the terms that are added up: what differs by less is the same
SAMPLES, LARGEST = 64, 100.0  # states that meet a guard: how many, and in what range of sizes


def step_numbers(T: Tables, most: int, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the `several_modes.records` of modes (modes,), and of modes on substeps (modes, steps); ``most`` guards."""
    modes, ns, n = len(T.n_guards), T.A.shape[1], T.LP.shape[2]
    mode, forcing = records(n, most)
    numbers, grid = np.zeros(modes, mode), np.zeros((modes, steps), forcing)
    h, phases = 2.0 * np.pi / float(T.flat[0]) / steps, phases_of(T, 2.0 * np.pi * np.arange(steps + 1) / steps)
    phases[-1] = phases[0]
    before, after, powers = phases[:-1], phases[1:], h ** np.arange(ORDER + 1)
    for m in range(modes):
        own, forced, states, flow = numbers[m], grid[m], T.YT[m], T.YT[m] @ powers
        place = economised(states[:n], h)
        own["h"], own["count"], own["flow"], own["place"] = h, T.n_guards[m], flow[:, :ns], place[:, :ns]
        own["back"] = economised((-1.0) ** np.arange(ORDER + 1) * states[:n, :ns], h)
        forced["flow"], forced["place"] = before @ flow[:, ns:].T, np.einsum("kc,icj->kij", before, place[:, ns:])
        for g in range(T.n_guards[m]):
            guard, on_grid, whole = own["guards"][g], forced["guards"][:, g], T.GT[m, g]
            event_numbers(T, m, g, guard)
            value, slope, series = T.G[m, g], whole[:, 1] * (h / 3.0), economised(whole, h)
            rates = np.pad(whole[:, 1:] * np.arange(1, ORDER + 1), ((0, 0), (0, 1))) * (h / 3.0)
            bound = fourth(whole, h)
            for name, size in (("bound", bound), ("noise", NOISE * (np.abs(whole) @ powers))):
                guard[name], guard[f"{name}_all"] = size[:ns], size[ns:].sum()  # forcing counts with its amplitude
            guard["slope"], guard["series"] = slope[:ns], series[:ns]
            guard["kicked"] = np.tensordot(guard["added"], own["place"], (0, 1))
            guard["reach"][:T.n_guards[m]] = np.abs(np.tensordot(guard["added"], T.GT[m, :T.n_guards[m], :ns], (0, 1))) @ powers
            guard["reach"][g] = np.abs(guard["added"]) @ bound[:ns]
            on_grid["ends"] = np.stack([phase @ np.stack((value, slope))[:, ns:].T for phase in (before, after)], axis=1)
            on_grid["series"] = before @ series[ns:]
            for name, along, row in (("value", whole, value), ("slope", rates, slope)):
                on_grid[name] = before @ economised(along[ns:] - np.tensordot(row[:ns], states[:, ns:], 1), h)
    return numbers, grid


def phases_of(T: Tables, angles: np.ndarray) -> np.ndarray:
    """Return the forcing states (..., nw) at phases of the excitation."""
    turns = np.multiply.outer(angles, T.harmonics)
    turning = np.stack([np.cos(turns), np.sin(turns)], axis=-1).reshape(*angles.shape, -1)
    return np.concatenate([np.ones((*angles.shape, 1)), turning], axis=-1)


def fourth(rows: np.ndarray, h: float) -> np.ndarray:
    """Return h^4/384 times the bound on the fourth derivative over [0, h], per unit of each component of x."""
    j = np.arange(rows.shape[1])
    falling = j * (j - 1.0) * (j - 2.0) * (j - 3.0)
    return (np.abs(rows[:, 4:]) * falling[4:] * h ** (j[4:] - 4.0)).sum(axis=1) * h**4 / 384.0


def economised(series: np.ndarray, h: float) -> np.ndarray:
    """Return the power series (..., terms) in s with fewer terms, MANY, on [0, h]: what its Chebyshev series begins with.

    Lanczos (1938): each term that goes leaves the error 2^(1 - 2k) of itself, of the k-th power.
    """
    terms = series.shape[-1]
    return series * h ** np.arange(terms) @ _cut(terms) / h ** np.arange(MANY)


@cache
def _cut(terms: int) -> np.ndarray:
    """Return the coefficients (terms, MANY) of what the powers become on [0, 1]."""
    rows = [Polynomial.basis(k).convert(kind=Chebyshev, domain=(0.0, 1.0)).truncate(MANY).convert(kind=Polynomial).coef
            for k in range(terms)]
    return np.array([np.pad(row, (0, MANY - row.size)) for row in rows])


def event_numbers(T: Tables, m: int, g: int, guard: np.ndarray) -> None:
    """Write what the record of a guard holds of its value, and of its event: what it adds, and the modes that may follow."""
    n, ns = T.LP.shape[2], T.A.shape[1]
    kicks, known = bool(T.kick[m, g] == 1), candidates(T, m, g)
    guard["value"], guard["constant"], guard["added"] = T.G[m, g, :ns], T.G[m, g, ns], added(T, m, g)
    guard["kicks"], guard["stops"] = kicks, not kicks and T.D[m, g, n:2 * n].any()
    guard["hit"] = kicks or T.kind[m, g] == EventKind.CONTACT.code
    guard["many"] = len(known) if len(known) <= CANDIDATES and not (guard["stops"] and T.G[m, g, ns + 1:].any()) else 0
    guard["modes"][:guard["many"]] = known[:guard["many"]]


def added(T: Tables, m: int, g: int) -> np.ndarray:
    """Return what an event adds to the state (ns,): a kick per speed of arrival; else minus this per value of the guard."""
    return -(1.0 + T.ratio[m, g]) * T.B[m, g] if T.kick[m, g] == 1 else T.D[m, g]


def candidates(T: Tables, m: int, g: int) -> list[int]:
    """Return the modes that the step may try in turn after an event; none: the scalar integrator decides.

    What jumps, and which rows are at rest, is linear: random states that meet the guard tell.  A kick may turn friction round,
    whose guard is then outside and fires at once: the modes behind that guard follow those of the stop.  Where a mode holds another
    element, too, what refuses it may be that element, which would let go in the same instant: the scalar integrator decides.
    """
    X, sizes = meeting(T, m, g)
    ns, kicks, after = T.A.shape[1], T.kick[m, g] == 1, X.copy()
    after[:, :ns] = X @ T.R[m, g].T
    known = X[:, :ns] + np.outer(X @ T.GT[m, g, :, 1], added(T, m, g)) if kicks else X[:, :ns]
    if kicks and T.ratio[m, g] == 0.0 or np.any(np.abs(after[:, :ns] - known) > SAME * sizes[:ns]):
        return []
    found, tried = [], [int(c) for c in T.then[m, g] if c != -1]
    for c in tried:  # grows while it is walked
        if c < 0:
            return []
        rows = np.vstack([T.H[c, :T.n_holds[c]], T.S[c, :T.n_holds[c]]])
        rest = np.all(np.abs(after @ rows.T) <= SAME * (np.abs(rows) @ sizes), axis=1)
        if rest.all():
            found.append(c)
            if not kicks and T.n_holds[c] > 1:
                break
            for k in range(T.n_guards[c] if kicks else 0):
                turned = (X @ T.G[c, k] < 0.0) & (after @ T.G[c, k] > 0.0)
                if T.element[c, k] != T.element[m, g] and T.kick[c, k] == 0 and turned.any():
                    tried += [int(d) for d in T.then[c, k] if d >= 0 and d not in tried]
        elif rest.any():
            return []
    return found


def meeting(T: Tables, m: int, g: int) -> tuple[np.ndarray, np.ndarray]:
    """Return random x (SAMPLES, nx) in mode ``m`` on the surface of guard ``g``, and the size of their entries (nx,).

    Forcing states are any numbers, but for the one that is 1; all others are of the size that the surfaces ask for, or larger.
    """
    one, nx = T.A.shape[1:]
    rows, free = np.vstack([T.G[m, g], T.H[m, :T.n_holds[m]], T.S[m, :T.n_holds[m]]]), np.arange(nx) != one
    onto = np.linalg.pinv(rows[:, free])
    place, moves = -onto @ rows[:, one], np.random.default_rng(0).normal(size=(SAMPLES, nx - 1))
    moves *= (np.abs(place).max() or 1.0) * np.geomspace(1.0, LARGEST, SAMPLES)[:, None]
    X, sizes = np.ones((SAMPLES, nx)), np.ones(nx)
    X[:, free], sizes[free] = place + moves - moves @ rows[:, free].T @ onto.T, np.abs(moves).max()
    return X, sizes
