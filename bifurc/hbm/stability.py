"""Floquet multipliers of harmonic motions, by the monodromy matrix in the time domain; see `monodromy`.

Memory that is never written in a period is a parameter of a family of motions, not a state: its +1 is left out.
"""
from enum import StrEnum

import numpy as np

from .balance import Balance
from .monodromy import NODES, cuts_of, monodromy, states, without_laws
from .parts import views
from .residual import followed, unpacked
from .status import MarchStatus

LAW_STEPS = 12  # Magnus steps a shortest wave
LEAST_LAW_STEPS = 96


class StabilityStatus(StrEnum):
    """Whether multipliers of a harmonic motion are known."""

    KNOWN = "known"
    SET_VALUED = "set_valued"
    NOT_FOLLOWED = "not_followed"
    GRAZING = "grazing"

    @property
    def sentence(self) -> str:
        """What the status means, and what to try."""
        return {
            "known": "The multipliers are those of the equations linearised along the harmonic motion.",
            "set_valued": "Friction of this scene is set-valued: its stick is a constraint, which the balance only approximates. "
                          "Polish the motion with find_orbit(system, guess=orbit) and take the multipliers of that.",
            "not_followed": "The contacts could not be followed along the motion, so that their modes are not known.",
            "grazing": "An event only touches along this motion: there the linearisation has no finite limit.",
        }[self.value]


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
    balance = problem.balance
    if balance.parts.held:
        return None
    found = [multipliers_of(balance, x[:-1], problem.numbers(x[-1])[0])[1] for x in xs]
    out = np.zeros((len(found), max((len(mu) for mu in found), default=0)), complex)
    for row, mu in zip(out, found, strict=True):
        row[:len(mu)] = mu
        if not len(mu):
            row[:] = np.nan
    return out


def monodromy_of(balance: Balance, x, flat=None) -> tuple[StabilityStatus, np.ndarray]:
    """Return status and monodromy matrix of (q, v, memory that is written), see `multipliers_of`."""
    none = np.empty((0, 0))
    parts = balance.parts
    if parts.held:
        return StabilityStatus.SET_VALUED, none
    if balance.samples:
        balance = exact_twin(balance)
    flat = parts.flat if flat is None else flat
    x = np.ascontiguousarray(x, float)
    shape, room, grid = parts.shape, balance.room, balance.grid
    size = 2 * int(shape.dims[0]) + int(shape.memory.sum())
    out, kept = np.empty((size, size)), np.zeros(size, np.int64)
    if parts.laws:
        code = _with_laws(balance, flat, x, out, kept)
    else:
        code = without_laws(shape, flat, x, grid, room, out, kept)
    if code < 0:
        return StabilityStatus.NOT_FOLLOWED, none
    if code == 0 or not np.isfinite(out).all():
        return StabilityStatus.GRAZING, none
    return StabilityStatus.KNOWN, out if kept.all() else out[np.ix_(kept > 0, kept > 0)]


def _with_laws(balance: Balance, flat, x, out, kept) -> int:
    """Write the monodromy matrix of a scene with laws; returns as `monodromy.without_laws`."""
    parts, room, grid = balance.parts, balance.room, balance.grid
    shape = parts.shape
    c, v, _, _ = balance.rows(x, flat)
    T = unpacked(flat, shape)
    code = followed(shape, T, 0, grid.cosines, grid.sines, c, v, room.paths, room.ends, room.zs, room.sources, room.counts)
    if tuple(MarchStatus)[code] is not MarchStatus.FOLLOWED:
        return -1
    states(shape, room.paths, room.counts, kept)
    cuts = cuts_of(room.paths, room.ends, room.counts, max(LEAST_LAW_STEPS, LAW_STEPS * int(shape.waves[-1])))
    KL, CL = law_slopes(balance, flat, c, v, cuts)
    return monodromy(shape, T, room.paths, room.ends, room.zs, room.counts, c, v, cuts, KL, CL, out)


def law_slopes(balance: Balance, flat, c, v, cuts) -> tuple[np.ndarray, np.ndarray]:
    """Return R^T f_u R and R^T f_s R (3 S, n, n) of all laws at the Gauss nodes of the steps between ``cuts``."""
    from .laws import compiled

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
    """Return complex multipliers, largest first, conjugate pairs with the positive imaginary part first."""
    mu = np.asarray(multipliers).astype(complex)
    return mu[np.lexsort((-mu.imag, -mu.real.round(9), -np.abs(mu).round(9)))]
