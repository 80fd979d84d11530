"""Numbers of a lap through several modes, see `bifurc.basins.lanesmodes`: polynomials on the substeps, and what events do."""
import numpy as np

from ..compose.tables import Tables
from ..elements import EventKind
from .lanesmodes import (
    CANDIDATES,
    FIXED,
    KICKS,
    MANY,
    NOISE,
    NOTHING,
    OF_GUARD,
    OF_GUARD_STEPPED,
    STEPPED,
    STOPS,
    UNKNOWN,
)

PARALLEL = 1e-12  # rows that differ by less are the same row


def lap_numbers(T: Tables, most: int, h: float, flow: np.ndarray, phases: np.ndarray,
                bounds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return ``numbers`` and ``grid``, flat.

    Parameters
    ----------
    T : Tables
    most : int
        Largest number of guards of a mode.
    h : float
        Substep.
    flow : ndarray
        State after h (modes, 2, nx).
    phases : ndarray
        Forcing states on the grid (substeps + 1, nw).
    bounds : ndarray
        Largest distance of a guard from its cubic, per unit of every component (modes, guards, nx).
    """
    modes, steps = len(T.n_guards), len(phases) - 1
    numbers = np.zeros((modes, FIXED + most * OF_GUARD))
    grid = np.zeros((modes, steps, STEPPED + most * OF_GUARD_STEPPED))
    for m in range(modes):
        place = T.YT[m, 0, :, :MANY]
        numbers[m, 0], numbers[m, 1:5] = h, flow[m, :, :2].ravel()
        numbers[m, 5:FIXED] = place[:2].ravel()
        grid[m, :, :2], grid[m, :, 2:STEPPED] = phases[:-1] @ flow[m, :, 2:].T, phases[:-1] @ place[2:]
        for g in range(T.n_guards[m]):
            value, slope = T.G[m, g], T.GT[m, g, :, 1] * (h / 3.0)
            bound, size = bounds[m, g], NOISE * (np.abs(T.GT[m, g, :, :MANY]) @ h ** np.arange(MANY))
            one, two = _jump(T, m, g)
            i, j = FIXED + g * OF_GUARD, STEPPED + g * OF_GUARD_STEPPED
            numbers[m, i:i + OF_GUARD] = (*value[:2], *slope[:2], *bound[:2], bound[2:].sum(), *size[:2], size[2:].sum(), one, two,
                                          *T.GT[m, g, :2, :MANY].ravel())
            before, after = phases[:-1], phases[1:]
            grid[m, :, j:j + 4] = np.column_stack((before @ value[2:], before @ slope[2:], after @ value[2:], after @ slope[2:]))
            grid[m, :, j + 4:j + 4 + MANY] = before @ T.GT[m, g, 2:, :MANY]
    return numbers.ravel(), grid.ravel()


def plan_of(T: Tables, most: int) -> np.ndarray:
    """Return the integers (modes, ...) of the lap: guards, and for each what it does, whether it is a hit, its candidates."""
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
    """Return what an event does to the speed."""
    if T.kick[m, g] == 1:
        return KICKS if T.ratio[m, g] > 0.0 and T.B[m, g].any() and T.n_holds[m] == 0 else UNKNOWN
    if T.D[m, g, 1] != 0.0:
        return STOPS if not T.G[m, g, 3:].any() else UNKNOWN
    return NOTHING


def _jump(T: Tables, m: int, g: int) -> tuple[float, float]:
    """Return restitution and slope of the guard by the speed; or the speed where it stops, by position and 1."""
    what = _does(T, m, g)
    if what == KICKS:
        return T.ratio[m, g], T.GT[m, g, 1, 1]
    if what == STOPS:
        return -T.G[m, g, 0] / T.G[m, g, 1], -T.G[m, g, 2] / T.G[m, g, 1]
    return 0.0, 1.0


def _known(T: Tables, m: int, g: int) -> list[int]:
    """Return the candidates that the lap may try in turn; none where one of them is out of its reach."""
    kicks, found = T.kick[m, g] == 1, []
    for c in followers(T, m, g):
        if c < 0:
            return []
        if T.n_holds[c]:
            if kicks:  # a rebound does not rest
                continue
            if T.n_holds[m] == 0 and not (T.D[m, g, 1] != 0.0 and _same_row(T.G[m, g], T.H[c, 0]) and not T.S[c, 0].any()):
                return []
        found.append(c)
    return found


def followers(T: Tables, m: int, g: int) -> list[int]:
    """Return the modes that may follow an event, in the order they are tried; -2: one is not built yet.

    A rebound also turns the friction on its row round, whose guard the general march finds outside and lets fire at once:
    the modes of the other direction follow the stop's own.
    """
    found = [int(c) for c in T.then[m, g] if c != -1]
    if T.kick[m, g] != 1:
        return found
    for c in found:  # grows while it is walked
        if c < 0 or T.n_holds[c] or not _same_guard(T, m, c, g):
            continue
        for k in range(T.n_guards[c]):
            turns = T.element[c, k] != T.element[m, g] and T.kick[c, k] == 0 and T.D[c, k, 1] != 0.0
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
