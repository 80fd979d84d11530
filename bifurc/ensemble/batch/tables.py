"""Numbers of a batch step through several modes, see `several_modes`: polynomials on the substeps, and what events do."""
from functools import cache

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial

from ...compose.tables import ORDER, Tables
from ...elements import EventKind
from .several_modes import CANDIDATES, KICKS, MANY, NOISE, NOTHING, STOPS, UNKNOWN, records

PARALLEL = 1e-12  # rows that differ by less are the same row


def step_numbers(T: Tables, most: int, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the `several_modes.records` of all modes, and of all modes on the substeps of a period, flat; ``most`` guards."""
    modes, ns, n = len(T.n_guards), T.A.shape[1], T.LP.shape[2]
    mode, substep = records(n, most)
    numbers, grid = np.zeros(modes, mode), np.zeros((modes, steps), substep)
    grid["guards"]["ends"][..., 0] = -1.0  # a place without a guard
    h, angles, phases = 2.0 * np.pi / float(T.flat[0]) / steps, 2.0 * np.pi * np.arange(steps + 1) / steps, np.ones((steps + 1, 1))
    for k in T.harmonics:
        phases = np.column_stack((phases, np.cos(k * angles), np.sin(k * angles)))
    phases[-1] = phases[0]
    before, after, powers = phases[:-1], phases[1:], h ** np.arange(ORDER + 1)
    for m in range(modes):
        own, forced, states, flow = numbers[m], grid[m], T.YT[m], T.YT[m] @ powers
        place = economised(states[:n], h)
        own["h"], own["flow"], own["place"] = h, flow[:, :ns], place[:, :ns]
        own["back"] = economised((-1.0) ** np.arange(ORDER + 1) * states[:n, :ns], h)
        forced["flow"], forced["place"] = before @ flow[:, ns:].T, np.einsum("kc,icj->kij", before, place[:, ns:])
        for g in range(T.n_guards[m]):
            guard, on_grid, whole = own["guards"][g], forced["guards"][:, g], T.GT[m, g]
            value, slope, series = T.G[m, g], whole[:, 1] * (h / 3.0), economised(whole, h)
            rates = np.pad(whole[:, 1:] * np.arange(1, ORDER + 1), ((0, 0), (0, 1))) * (h / 3.0)
            guard["value"], guard["slope"], guard["constant"], guard["added"] = value[:ns], slope[:ns], value[ns], added(T, m, g)
            bound = fourth(whole, h)
            for name, size in (("bound", bound), ("noise", NOISE * (np.abs(whole) @ powers))):
                guard[name], guard[f"{name}_all"] = size[:ns], size[ns:].sum()  # forcing counts with its amplitude
            guard["series"], guard["kicked"] = series[:ns], np.tensordot(guard["added"], own["place"], (0, 1))
            guard["reach"][:T.n_guards[m]] = np.abs(np.tensordot(guard["added"], T.GT[m, :T.n_guards[m], :ns], (0, 1))) @ powers
            guard["reach"][g] = np.abs(guard["added"]) @ bound[:ns]
            on_grid["ends"] = np.stack([phase @ np.stack((value, slope))[:, ns:].T for phase in (before, after)], axis=1)
            on_grid["series"] = before @ series[ns:]
            for name, along, row in (("value", whole, value), ("slope", rates, slope)):
                on_grid[name] = before @ economised(along[ns:] - np.tensordot(row[:ns], states[:, ns:], 1), h)
    return numbers.view(float).ravel(), grid.view(float).ravel()


def fourth(rows: np.ndarray, h: float) -> np.ndarray:
    """Return h^4/384 times the bound on the fourth derivative over [0, h], per unit of each component of x."""
    j = np.arange(rows.shape[1])
    falling = j * (j - 1.0) * (j - 2.0) * (j - 3.0)
    return (np.abs(rows[:, 4:]) * falling[4:] * h ** (j[4:] - 4.0)).sum(axis=1) * h**4 / 384.0


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
