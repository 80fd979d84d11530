"""Floquet multipliers of harmonic motions, by the monodromy matrix in the time domain; see `monodromy`.

Memory that is never written in a period is a parameter of a family of motions, not a state: its +1 is left out.
"""

import numpy as np

from ...enumerations import DescribedEnum
from ..balance import Balance
from ..laws import compiled
from ..parts import views
from ..status import ContactStatus
from ..tables import Series
from .monodromy import NODES, along, cuts_of, states, with_laws

LAW_STEPS = 12  # Magnus steps a shortest wave
LEAST_LAW_STEPS = 96
MOST = 1 << 23  # numbers of the matrices of a branch that are held at once


class StabilityStatus(DescribedEnum):
    """Whether multipliers of a harmonic motion are known."""

    KNOWN = "known", "The multipliers are those of the equations linearised along the harmonic motion."
    SET_VALUED = ("set_valued", "Friction of this scene is set-valued: its stick is a constraint, which the balance "
                                "only approximates. Polish the motion with find_orbit(system, guess=orbit) and take "
                                "the multipliers of that.")
    NOT_FOLLOWED = ("not_followed", "The contacts could not be followed along the motion, so that their modes are not "
                                    "known.")
    GRAZING = "grazing", "An event only touches along this motion: there the linearisation has no finite limit."


def multipliers_of(balance: Balance, x, flat=None) -> tuple[StabilityStatus, np.ndarray]:
    """Return the multipliers of a motion over the period of its slowest harmonic.

    Parameters
    ----------
    balance : Balance
        Contacts are followed event by event, also where the balance samples them.
    x : ndarray (size,)
        Packed motion.
    flat : ndarray, optional
        Numbers of the system; default: the balance's own.

    Returns
    -------
    status : StabilityStatus
    multipliers : ndarray of complex
        Largest first; empty unless known.
    """
    status, P = monodromy_of(balance, x, flat)
    return status, ordered(np.linalg.eigvals(P)) if status is StabilityStatus.KNOWN else np.empty(0, complex)


def multipliers(orbit) -> tuple[np.ndarray | None, str]:
    """Return the multipliers of a `HarmonicOrbit` (None where they are not known) and the sentence that says how or why."""
    status, mu = multipliers_of(orbit.balance, orbit.coefficients)
    return (mu if status is StabilityStatus.KNOWN else None), status.sentence


def multipliers_along(problem, xs) -> np.ndarray | None:
    """Return multipliers (m, k) for the rows ``xs`` (m, n + 1) of a branch of harmonic orbits.

    Rows with fewer states (memory that is not written) end in zeros; rows whose multipliers are not known are NaN.  None for
    set-valued friction.
    """
    balance = problem.whole
    if balance.parts.held:
        return None
    rows = np.concatenate([problem.motions(xs), np.asarray(xs)[:, -1:]], axis=1)
    size = 2 * balance.layout.n + int(balance.parts.shape.memory.sum())
    out, most = np.zeros((len(rows), size), complex), 0
    step = max(1, MOST // size**2)
    for first in range(0, len(rows), step):
        codes, matrices, kept = _matrices(balance, rows[first:first + step], problem.path, problem.whole_numbers)
        out[first:first + step][codes <= 0] = np.nan
        known = np.flatnonzero(codes > 0)
        while known.size:  # rows with the same states at once
            place = np.flatnonzero(kept[known[0]])
            alike = (kept[known] == kept[known[0]]).all(axis=1)
            where, known = known[alike], known[~alike]
            own = matrices[where] if len(place) == size else matrices[where][:, place[:, None], place]
            out[first + where, :len(place)] = ordered(np.linalg.eigvals(own))
            most = max(most, len(place))
    return out[:, :most]


def _matrices(balance: Balance, xs, path, numbers) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return codes as of `monodromy.along` for the rows of ``xs``, matrices (m, size, size), and which of (q, v, z) are states."""
    balance = exact_twin(balance) if balance.samples else balance
    parts, grid, room = balance.parts, balance.grid, balance.walk
    size = 2 * int(parts.shape.dims[0]) + int(parts.shape.memory.sum())
    out, kept, codes = np.zeros((len(xs), size, size)), np.zeros((len(xs), size), np.int64), np.zeros(len(xs), np.int64)
    if parts.laws:
        for i, x in enumerate(xs):
            codes[i] = _with_laws(balance, numbers(x[-1]), x[:-1], out[i], kept[i])
    else:
        along(parts.structure, parts.shape.R, path.numbers, xs, grid, room, out, kept, codes)
    codes[(codes > 0) & ~np.isfinite(out).all(axis=(1, 2))] = 0
    return codes, out, kept


def monodromy_of(balance: Balance, x, flat=None) -> tuple[StabilityStatus, np.ndarray]:
    """Return status and monodromy matrix of (q, v, memory that is written), see `multipliers_of`."""
    none = np.empty((0, 0))
    if balance.parts.held:
        return StabilityStatus.SET_VALUED, none
    flat = balance.parts.flat if flat is None else flat
    codes, matrices, kept = _matrices(balance, np.append(x, 0.0)[None], _Still(flat), lambda _: flat)
    if codes[0] <= 0:
        return (StabilityStatus.NOT_FOLLOWED if codes[0] < 0 else StabilityStatus.GRAZING), none
    place = np.flatnonzero(kept[0])
    return StabilityStatus.KNOWN, matrices[0][np.ix_(place, place)]


class _Still:
    """Numbers that depend on nothing, as a path."""

    def __init__(self, flat):
        self.numbers = Series(flat, np.empty(0, np.int64), np.empty((0, 1)), 0.0, 1.0)


def _with_laws(balance: Balance, flat, x, out, kept) -> int:
    """Write the monodromy matrix of a scene with laws; returns as the codes of `monodromy.along`."""
    parts, room = balance.parts, balance.walk
    status, c, v = balance.follow(x, flat)
    if status is not ContactStatus.FOLLOWED:
        return -1
    states(parts.structure, room.paths, room.counts, kept)
    cuts = cuts_of(room.ends, room.counts, max(LEAST_LAW_STEPS, LAW_STEPS * int(parts.shape.waves[-1])))
    KL, CL = law_slopes(balance, flat, c, v, cuts)
    return with_laws(parts.structure, parts.shape.R, flat, room, c, v, cuts, KL, CL, out)


def law_slopes(balance: Balance, flat, c, v, cuts) -> tuple[np.ndarray, np.ndarray]:
    """Return R^T f_u R and R^T f_s R (3 S, n, n) of all laws at the Gauss nodes of the steps between ``cuts``."""
    parts = balance.parts
    shape = parts.shape
    phase = (cuts[:-1, None] + np.diff(cuts)[:, None] * NODES).ravel()
    basis = np.ones((shape.waves.size, phase.size))
    basis[1::2] = np.cos(np.multiply.outer(shape.waves[1::2], phase))
    basis[2::2] = np.sin(np.multiply.outer(shape.waves[2::2], phase))
    n = int(shape.dims[0])
    KL, CL = np.zeros((phase.size, n, n)), np.zeros((phase.size, n, n))
    values = views(flat, shape).law
    for law in parts.laws:
        rows, Q = list(law.rows), len(law.rows)
        g = np.empty((Q, 2 * Q, phase.size))
        compiled(law).slopes(values[law.values], c[rows] @ basis, v[rows] @ basis, g)
        R = shape.R[rows]
        KL += np.einsum("qa,qpt,pb->tab", R, g[:, :Q], R)
        CL += np.einsum("qa,qpt,pb->tab", R, g[:, Q:], R)
    return KL, CL


def exact_twin(balance: Balance) -> Balance:
    """Return the balance of the same system that follows contacts event by event; made once."""
    twin = balance.__dict__.get("_exact_twin")
    if twin is None:
        twin = Balance(balance.system, balance.layout, 0, balance.law_samples, balance.parts)
        balance.__dict__["_exact_twin"] = twin
    return twin


def ordered(multipliers) -> np.ndarray:
    """Return complex multipliers (k,) or (m, k), largest first, conjugate pairs with the positive imaginary part first."""
    mu = np.asarray(multipliers).astype(complex)
    order = np.lexsort((-mu.imag, -mu.real.round(9), -np.abs(mu).round(9)), axis=-1)
    return mu[order] if mu.ndim == 1 else mu[np.arange(len(mu))[:, None], order]
