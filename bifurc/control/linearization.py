"""An orbit's variational equations with room for a feedback: pieces between events, their jumps, and where the feedback acts.

The feedback is a force -p_k(t) along each of m rows (a degree of freedom, or a combination) and p_k is proportional to the
coordinate s_k that is fed back there, so that a perturbation dy of the orbit obeys

    dy' = A(t) dy + b p,        dy+ = S dy- + (rho + J gamma) p   at an event,

with p first order in dy: the feedback vanishes on the orbit.  b, rho and gamma are read off the same scene with a spring (or a
dashpot) of natural size at each row, so that held rows, reactions and every contact law take part as they do anywhere else.

One file, because pieces and jumps are read off the same scenes, with the feedback's spring and without it.
"""
import numbers
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from ..checks import choice, floats, refused, whole
from ..compose.evaluate import Laws
from ..compose.natural import natural_rate
from ..compose.scene import Scene, scene_of
from ..compose.writer import kernels
from ..content import Content
from ..elements import EventKind
from ..elements.element import ALWAYS
from ..elements.springs import LinearSpring
from ..orbits.orbit import PeriodicOrbit
from ..orbits.shooting.labels import Labels
from ..orbits.shooting.sequence import AFTER, BEFORE, CLOSES, GUARD
from ..structure.names import place_of
from ..system import System

NODES = 16  # Gauss points of a piece
TURN = 1.0  # largest scaled angle of a piece
JUMPS = 1e-12  # of the size of the coordinate that is fed back
LEAP = 1e-9  # of the terms of the rate of what is fed back


class NotSupported(ValueError):
    """The orbit or the system has something that this method cannot treat; the message names it."""


@dataclass(frozen=True, eq=False)
class Kick(Content):
    """What an event does to a perturbation.

    Attributes
    ----------
    S : ndarray (ns, ns)
        Saltation matrix.
    push : ndarray (ns, m)
        What the feedback p at the event adds, rho + J gamma (reactions that guard a release feel it).
    arrival : ndarray (ns,)
        The event happens ``arrival @ dy + delayed p`` later than on the orbit.
    jump : ndarray (m,)
        Jumps of the coordinates that are fed back.
    before, after : ndarray (ns, m)
        Change of the state after the event by units of p acting for a unit of time just before, and just after it.
    label : str
        Element.
    """

    S: np.ndarray
    push: np.ndarray
    arrival: np.ndarray
    jump: np.ndarray
    before: np.ndarray
    after: np.ndarray
    label: str


@dataclass(frozen=True, eq=False)
class Piece(Content):
    """A part of the period within one mode: its linear equations at Gauss points, and the event with which it begins.

    Attributes
    ----------
    kick : Kick or ndarray or None
        The event; a matrix for a section at a fixed time.
    start, span : float
        Time, from the section at phase 0, and duration.
    A : ndarray (NODES, ns, ns)
    b : ndarray (ns, m)
    constant : bool
        The piece's equations do not depend on time.
    """

    kick: Kick | np.ndarray | None
    start: float
    span: float
    A: np.ndarray
    b: np.ndarray
    constant: bool


@dataclass(frozen=True, eq=False)
class Linearization(Content):
    """Variational equations of an orbit with a feedback, over one period from just before its first listed event.

    Attributes
    ----------
    orbit : PeriodicOrbit
    pieces : tuple of Piece
    rows : ndarray (m, ns)
        The coordinates that are fed back, s = rows @ y.
    labels : Labels
        What nothing changes in a period: it labels a continuum of orbits and is left out of the multipliers.
    """

    orbit: PeriodicOrbit
    pieces: tuple[Piece, ...]
    rows: np.ndarray
    labels: Labels

    @property
    def kicks(self) -> list[Kick]:
        """Events, in order."""
        return [piece.kick for piece in self.pieces if isinstance(piece.kick, Kick)]

    @property
    def jumping(self) -> list[Kick]:
        """Events at which a coordinate that is fed back jumps."""
        sizes = np.abs(self.rows) @ self.orbit.weights
        return [kick for kick in self.kicks if (np.abs(kick.jump) > JUMPS * sizes).any()]

    def transition(self, kappa: np.ndarray) -> np.ndarray:
        """Return the matrices (k, ns, ns) over the period for p = kappa s, one a value of ``kappa`` (k,), complex."""
        kappa = np.asarray(kappa)[:, None, None]
        ns = self.rows.shape[1]
        total = np.broadcast_to(np.eye(ns, dtype=kappa.dtype), (len(kappa), ns, ns))
        last, step = None, total
        for piece in self.pieces:
            if isinstance(piece.kick, Kick):
                total = (piece.kick.S + kappa * (piece.kick.push @ self.rows)) @ total
            elif piece.kick is not None:
                total = piece.kick @ total
            if last is None or piece.A is not last.A:  # pieces of one interval with constant equations share them
                step = flow(piece, piece.A + kappa[..., None] * (piece.b @ self.rows))
            last, total = piece, step @ total
        return self.orbit._followed @ total

    def reduced(self, M: np.ndarray) -> np.ndarray:
        """Return matrices (k, ns, ns) without the states that only label a continuum."""
        return self.labels.reduced(M)


def flow(piece: Piece, A: np.ndarray) -> np.ndarray:
    """Return the transition matrices (k, m, m) over a piece for the matrices ``A`` (k, NODES or 1, m, m) at its Gauss points."""
    if piece.constant:
        return expm(A[:, 0] * piece.span)
    k, m = len(A), A.shape[-1]
    inner, _, ends = _tables()
    system = np.eye(NODES * m) - piece.span * np.einsum("ij,kjab->kiajb", inner, A).reshape(k, NODES * m, NODES * m)
    values = np.linalg.solve(system, np.broadcast_to(np.tile(np.eye(m), (NODES, 1)), (k, NODES * m, m)))
    return np.eye(m) + piece.span * np.einsum("j,kjab,kjbc->kac", ends, A, values.reshape(k, NODES, m, m))


def gauss() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points c (NODES,) on (0, 1), integrals a (NODES, NODES) up to them and weights b of Gauss collocation."""
    inner, points, ends = _tables()
    return points, inner, ends


def linearized(orbit: PeriodicOrbit, of: str, row=0, strength: float = 0.0) -> Linearization:
    """Return the variational equations of an orbit with a feedback of a coordinate or its velocity.

    Parameters
    ----------
    orbit : PeriodicOrbit
        Converged and admissible.
    of : {"displacement", "velocity"}
    row : int, sequence of float (n,), or sequence of such (m, n)
        Degree of freedom, or factors of the coordinates: where it is measured and where the force acts; several rows are fed
        back each to itself with the same gain.
    strength : float
        Largest size of the gain that will be asked for: pieces are made short enough for it.

    Raises
    ------
    NotSupported
        For orbits with complete chattering, laws beside memory with a rate, multipliers that are not unique, feedback of the
        velocity of a row that lets go with a leap (static friction above kinetic), and orbits without a clock.
    ValueError
        For a failed orbit, an unknown ``of``, a degree of freedom there is not.
    """
    choice("feedback", "of", of, ("displacement", "velocity"))
    forced(orbit)
    scene, T = orbit.scene, orbit.equations.path.tables
    # of a size that the motion feels: one would be lost in the rounding of stiff systems
    gain = float(np.abs(orbit.system.mass).max()) * natural_rate(T) ** (2 if of == "displacement" else 1)
    stiffness, damping = (gain, 0.0) if of == "displacement" else (0.0, gain)
    where = place_of(row, orbit.system.dofs, orbit.system.n, "", "row") if isinstance(row, str) else row
    if isinstance(where, numbers.Integral):
        where = whole("", "row", where, least=0, most=orbit.system.n - 1)
    units = [LinearSpring(stiffness=stiffness, damping=damping, **place) for place in places(where)]
    C = np.zeros((len(units), scene.ns))
    for c, unit in zip(C, units, strict=True):
        c[slice(0, scene.n) if of == "displacement" else slice(scene.n, 2 * scene.n)] = unit.site(scene.n).R[0]
    if np.linalg.matrix_rank(C) < len(C):
        raise ValueError(f"row = {row!r} is not allowed; its rows must be independent")
    plus = [scene_of(with_element(orbit.system, unit)) for unit in units]
    return Linearization(orbit, tuple(_pieces(orbit, scene, T, plus, gain, C, strength)), C, orbit.labels)


def forced(orbit) -> None:
    """Raise unless an orbit can be controlled: a converged motion with a clock and multipliers of its own."""
    if not isinstance(orbit, PeriodicOrbit):
        raise ValueError(f"orbit = {orbit!r} is not allowed; control needs a PeriodicOrbit (polish an orbit of harmonic balance "
                         "with find_orbit(system, guess=orbit))")
    if not orbit.success:
        raise ValueError(f"orbit = {orbit!r} is not allowed; it must be a converged motion of its system")
    if orbit._disputed is not None:
        raise NotSupported(orbit.message)
    if orbit.autonomous:  # no odd-number limitation holds there, and no root can be counted on the unit circle
        raise NotSupported("the orbit has no clock: one multiplier is 1 whatever is fed back, and its period is its own; control "
                           "is linearised about forced orbits")


def places(row) -> list[dict]:
    """Return the keywords of elements that act on a degree of freedom, along n factors, or along each of several rows."""
    if isinstance(row, str | numbers.Integral) and not isinstance(row, bool):
        return [{"dof": row}]
    found = floats(row)
    if found is None or found.ndim not in (1, 2) or not found.size:
        raise refused("", "row", row, "a degree of freedom, n factors, or several rows of n factors")
    return [{"row": tuple(one)} for one in np.atleast_2d(found).tolist()]


def with_element(system: System, element) -> System:
    """Return the system with one more element, as a hand-made one."""
    return System(system.mass, system.damping, system.stiffness, (*system.elements, element), omega=system.omega)


def _pieces(orbit: PeriodicOrbit, scene: Scene, T, plus: list[Scene], gain: float, C: np.ndarray, strength: float):
    """Yield the pieces of a period; the scenes ``plus`` have ``gain`` more at one row each."""
    whole, U = orbit._whole
    nodes, rows = whole.nodes, U.reshape(len(whole.nodes), -1)
    units = []  # tables with the feedback of each row, their modes, and what reads off them what a unit of it does
    for unit, c in zip(plus, C, strict=True):
        images = [unit.index((*keys, ALWAYS)) for keys in scene.keys]
        units.append((unit.tables, images, c / (c @ c * gain)))
    period = orbit.forcing_period
    engine, motion = orbit.equations.kernel, orbit.equations.motion
    ns, nx = scene.ns, T.A.shape[2]
    reset = np.empty((ns, nx))
    for i, node in enumerate(nodes):
        g, after = int(node[GUARD]), int(node[AFTER])
        start = rows[i][0] * period
        end = (rows[i + 1][0] if i + 1 < len(nodes) else rows[0][0] + whole.span) * period
        x, xp = np.empty(nx), np.empty(nx)
        motion.start_of(T, nodes, U, i, reset, xp)
        x[:ns], x[ns:] = rows[i][1:], xp[ns:]
        kick = _section(engine, T, node, x, ns) if g < 0 else _kick(orbit, scene, T, units, node, x, xp, C)
        b = _effect(units, lambda P, images, after=after: P.A[images[after], :, :ns] - T.A[after, :, :ns])
        yield from _parts(scene, T, after, kick, start, end - start, xp, b, C, strength)


def _effect(units, change) -> np.ndarray:
    """Return (..., m): what a unit of p at each row adds to what ``change(tables, modes)`` (..., ns) reads off."""
    return np.stack([change(P, images) @ c for P, images, c in units], axis=-1)


def _section(engine, T, node, x, ns):
    """Return the map of a section at a fixed time."""
    P = np.empty((ns, x.size))
    engine.reset(T, node[BEFORE], -1, 0, x, np.empty(x.size), P)
    return P[:, :ns]


def _kick(orbit, scene, T, units, node, x, xp, C) -> Kick:
    """Return what an event does to a perturbation, with the feedback at it."""
    before, g, after = int(node[BEFORE]), int(node[GUARD]), int(node[AFTER])
    label, ns = scene.element_name(before, g), scene.ns
    if node[CLOSES] or scene.event_kind(before, g) is EventKind.CHATTER:
        raise NotSupported(f"{label!r} chatters completely on this orbit; feedback is linearised about orbits with finitely many "
                           "events (its multipliers are 0 there: nothing is left to control)")
    engine = orbit.equations.kernel
    f, fp, h, dw, R = np.empty(ns), np.empty(ns), np.empty(x.size), np.empty(x.size - ns), np.empty((ns, x.size))
    engine.field(T, before, x, f)
    engine.field(T, after, xp, fp)
    engine.forcing_rate(T, x, dw)
    engine.guard_gradient(T, before, g, x, h)
    engine.reset(T, before, g, 0, x, np.empty(x.size), R)
    rate = float(h @ np.concatenate((f, dw)))
    if rate == 0.0:
        raise NotSupported(f"{label!r} is touched with zero speed on this orbit: its multipliers are not finite")
    J = (fp - R @ np.concatenate((f, dw))) / rate
    gamma = _effect(units, lambda P, images: P.G[images[before], g, :ns] - T.G[before, g, :ns])
    leap, terms = C @ (fp - f), np.abs(C) @ (np.abs(fp) + np.abs(f))
    if np.any((gamma != 0.0) & (np.abs(leap) > LEAP * terms)):
        raise NotSupported(f"{label!r} lets go with a leap of the acceleration of what is fed back: the instant at which it does "
                           "feels the feedback, and perturbations that let go earlier grow otherwise than later ones")
    rho = _effect(units, lambda P, images: P.R[images[before], g, :, :ns] - T.R[before, g, :, :ns])
    b = [_effect(units, lambda P, images, m=m: P.A[images[m], :, :ns] - T.A[m, :, :ns]) for m in (before, after)]
    return Kick(R[:, :ns] + np.outer(J, h[:ns]), rho + np.outer(J, gamma), -h[:ns] / rate, C @ (xp[:ns] - x[:ns]),
                R[:, :ns] @ b[0], b[1], label)


def _parts(scene, T, mode, kick, start, span, xp, b, C, strength):
    """Yield the pieces of one interval: a single one where the equations are constant, otherwise short enough to collocate."""
    ns = scene.ns
    constant = not (T.acts.shape[1] and T.acts[mode].any())
    points, _, _ = gauss()
    rate = max(TURN / T.step[mode], float(np.abs(np.linalg.eigvals(T.A[mode, :, :ns] + 2.0 * strength * (b @ C))).max()))
    count = max(1, int(np.ceil(span * rate / TURN)))
    size, engine = span / count, kernels(scene)
    A = np.repeat(T.A[mode, :, :ns][None], NODES, axis=0)
    for k in range(count):
        at = start + k * size
        if not constant:
            A = np.array([_slope(scene, T, mode, _after(engine, T, mode, xp, k * size + point * size)) for point in points])
        yield Piece(kick if k == 0 else None, at, size, A, b, constant)


def _after(engine, T, mode, x, time):
    """Return the joined state (nx,) a time after ``x``."""
    out = np.empty(x.size)
    y = np.empty(T.A.shape[1])
    engine.advance(T, mode, x, time, y)
    out[:y.size] = y
    out[y.size] = 1.0
    for k, harmonic in enumerate(T.harmonics):
        at = y.size + 1 + 2 * k
        turn = harmonic * T.flat[0] * time
        out[at] = np.cos(turn) * x[at] - np.sin(turn) * x[at + 1]
        out[at + 1] = np.sin(turn) * x[at] + np.cos(turn) * x[at + 1]
    return out


def _slope(scene, T, mode, x) -> np.ndarray:
    """Return the Jacobian (ns, ns) of the vector field of a mode at the joined state ``x``."""
    n, ns = scene.n, scene.ns
    A = T.A[mode, :, :ns].copy()
    A[n:2 * n] += T.LP[mode].T @ Laws(scene.laws, T, mode).slopes(x)
    return A


def _tables() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (a, c, b) of Gauss collocation on (0, 1)."""
    if not _GAUSS:
        roots, weights = np.polynomial.legendre.leggauss(NODES)
        points = 0.5 * (roots + 1.0)
        values = np.polynomial.legendre.legvander(roots, NODES - 1)
        order = np.arange(NODES)
        norms = 2.0 / (2 * order + 1)
        integrals = np.empty((NODES, NODES))
        above = np.polynomial.legendre.legvander(roots, NODES)
        integrals[:, 0] = 0.5 * (roots + 1.0)
        for k in range(1, NODES):
            integrals[:, k] = 0.5 * (above[:, k + 1] - above[:, k - 1]) / (2 * k + 1)
        _GAUSS.extend([integrals @ (values * weights[:, None] / norms).T, points, 0.5 * weights])
    return _GAUSS[0], _GAUSS[1], _GAUSS[2]


_GAUSS: list[np.ndarray] = []  # filled once
