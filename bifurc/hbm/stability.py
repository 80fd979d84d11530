"""Floquet multipliers of harmonic motions, by the monodromy matrix in the time domain; see `monodromy`.

Memory that is never written in a period is a parameter of a family of motions, not a state: its +1 is left out.
"""
from enum import StrEnum

import numpy as np

from .balance import Balance
from .march import WROTE
from .monodromy import NODES, cuts_of, monodromy
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
    c, v, _, _ = balance.rows(x, flat)
    shape, room, grid = parts.shape, balance.room, balance.grid
    T = unpacked(flat, shape)
    if len(parts.contacts):
        code = followed(shape, T, 0, grid.cosines, grid.sines, c, v, room.paths, room.ends, room.zs, room.sources, room.counts)
        if tuple(MarchStatus)[code] is not MarchStatus.FOLLOWED:
            return StabilityStatus.NOT_FOLLOWED, none
    return along(balance, T, c, v, flat)


def along(balance: Balance, T, c, v, flat) -> tuple[StabilityStatus, np.ndarray]:
    """Return status and monodromy matrix along rows ``c``, ``v`` whose contacts ``balance.room`` has followed."""
    parts, room = balance.parts, balance.room
    shape = parts.shape
    n = int(shape.dims[0])
    out = np.empty((2 * n + int(shape.memory.sum()),) * 2)
    nothing = np.empty((0, n, n))
    steps = max(LEAST_LAW_STEPS, LAW_STEPS * int(shape.waves[-1])) if parts.laws else 1
    cuts = cuts_of(room.paths, room.ends, room.counts, steps)
    KL, CL = law_slopes(balance, flat, c, v, cuts) if parts.laws else (nothing, nothing)
    if not monodromy(shape, T, room.paths, room.ends, room.zs, room.counts, c, v, cuts, KL, CL, out) or not np.isfinite(out).all():
        return StabilityStatus.GRAZING, np.empty((0, 0))
    kept = list(range(2 * n))
    start = 2 * n
    for k in range(len(parts.contacts)):
        count, Z = int(room.counts[k, 0]), int(shape.memory[k])
        if (room.paths[k, :count, WROTE] >= 0).any():
            kept += range(start, start + Z)
        start += Z
    return StabilityStatus.KNOWN, out[np.ix_(kept, kept)]


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
    return mu[np.lexsort((-mu.imag, -mu.real, -np.abs(mu).round(14)))]
