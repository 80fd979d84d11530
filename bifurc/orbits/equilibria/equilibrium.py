"""Equilibria of systems without excitation: F = 0 with the contacts that touch and stick, and the eigenvalues there.

In a mode the state is at rest where y' = 0 and what the mode holds stays on its surface.  Newton with the least change
solves that from the guess, so that where equilibria form a continuum (a mass that sticks, a slider that never slips) the
nearest one is found.  A guard that the solution violates names the modes that are tried next.

How deep a force on a circle is beyond it is an unknown of its own beside the coordinates, in the unit in which the wall is as
steep as the rest.  So a stiff wall needs no more steps than a soft one, and its load is known where the coordinates would have it
from their last digits, or not at all.

Eigenvalues are those of the motion that the mode allows, on the states modulo a continuum.  Time is counted in units of the mode's
own rate of change throughout: what is small, and what depends on what else, is then the same in all units.

One file, because the equilibrium tells its guards, modes and eigenvalues by the conditions that the search solves.
"""
import functools
from collections.abc import Mapping

import numpy as np
from scipy.linalg import qr

from ... import io
from ...checks import checked, floats, refused, whole
from ...compose.scene import Scene, scene_of
from ...content import Content, kept
from ...elements import EventKind
from ...enumerations import DescribedEnum
from ...flow import settle
from ...flow.initial import start_of
from ...flow.linear import ModeField
from ...motion import Motion
from ...notebook import Notebook
from ...system import System
from ..base import Orbit
from ..shooting.births import curved_rests
from .hopf import lyapunov_coefficient

STEPS = 40
HALVINGS = 40  # of a Newton step
NEAR = 1e-3  # of the size of the state: a step of Newton below it is taken in coordinates and depths alike
CONVERGED = 1e-13  # of the size of the state: last step
BALANCED = 1e-11  # of the size of their terms: forces that are left
RANK = 1e-10  # singular values below this part of the largest vanish
INSIDE = 1e-12  # of its terms: a guard above it is violated
BOUNDARY = 1e-11  # a guard that near zero: the equilibrium lies on the boundary of its mode
NEUTRAL = 1e-10  # of the largest eigenvalue: a real part that is none
MODES = 64  # tried at most


class EquilibriumStatus(DescribedEnum):
    """How an equilibrium is to be taken."""

    CONVERGED = "converged", "All forces are in balance, and no contact is beyond its limits."
    CONTINUUM = ("continuum", "All forces are in balance; the equilibrium is one of a continuum, the one nearest to "
                              "the guess.")
    INADMISSIBLE = ("inadmissible", "The forces are in balance only with a contact beyond its limits: it is no state "
                                    "of rest of the system. There may be none, or another one; give another guess.")
    NOT_FOUND = ("not_found", "No state of rest was found: in no mode of the contacts that was tried are the forces "
                              "in balance. A belt that only drags, or a constant load on a free mass, allows none.")


class Equilibrium(Content, Notebook, Motion):
    """A state of rest of a system without excitation.  Made by `find_equilibrium` and by branches.

    Attributes
    ----------
    system : System
    state : ndarray (ns,)
        Positions, zero velocities, internal variables.
    mode : int
        Mode of the scene it is an equilibrium of; `contacts` says it in words.
    kind : str
        "regular", "pseudo" or "boundary".
    weight : float, tuple of float or None
        Of a pseudo-equilibrium: the share of the field above the surface.
    virtual : bool
        The mode does not hold there.
    depths : ndarray (contacts,)
        How far it is beyond each circle that gives a force, length: times the stiffness the load there, however stiff it is.
    status, message
    success : bool
        Whether it is a state of rest.

    Examples
    --------
    >>> import bifurc as bf
    >>> bf.find_equilibrium(bf.systems.belt_oscillator()).success
    True
    """

    _facts = ("status", "stable", "state", "contacts", "eigenvalues")
    _panels = None
    autonomous = True
    regime = "at rest"
    multipliers = None

    def __init__(self, system: System, mode: int, state, status: EquilibriumStatus | None = None, depths=None):
        self.system, self.mode = system, int(mode)
        self._state = np.array(state, float)
        self._failed, self._depths = status, depths

    def _content(self) -> tuple:
        return self.system, self.mode, self._state, self._failed

    def __getstate__(self):
        return {name: self.__dict__[name] for name in ("system", "mode", "_state", "_failed", "_depths")}

    @property
    def state(self) -> np.ndarray:
        """State (ns,)."""
        return self._state.copy()

    @property
    def sections(self) -> np.ndarray:
        """The state, (1, ns)."""
        return self._state[None].copy()

    @property
    def scene(self) -> Scene:
        """Modes and tables of the system."""
        return scene_of(self.system)

    @property
    def parameters(self) -> dict:
        """Parameters of the system."""
        return self.system.parameters

    @functools.cached_property
    def field(self) -> ModeField:
        """Vector field of the mode."""
        made = ModeField(self.scene, self.scene.tables, self.mode)
        if self._depths is not None:
            made.press(self._state, self._depths)
        return made

    @property
    def depths(self) -> np.ndarray:
        """How far the state is beyond each circle that gives a force (contacts,), length; better known than by the coordinates."""
        return self.field.depths(self._state)[0] if self._depths is None else self._depths.copy()

    @property
    def contacts(self) -> dict[str, object]:
        """Mode key of every element, by label: what touches, sticks, slips."""
        return dict(zip(self.system.labels, self.scene.keys[self.mode], strict=True))

    @functools.cached_property
    def residual(self) -> float:
        """Largest rate that is left, relative to the size of the terms it is the sum of, dimensionless."""
        F, _, terms = self._balance
        return float((np.abs(F) / terms)[:self.scene.ns].max())

    @kept
    def continuum(self) -> np.ndarray:
        """Directions (k, ns), orthonormal, in which equilibria of the same mode lie nearby; k = 0: it stands alone."""
        # nothing of it moves: its velocities are zero in any units
        found = _kernel(self._balance[1])
        return np.linalg.qr(found[:, :self.scene.ns].T)[0].T if self.field.contacts else found

    @functools.cached_property
    def _balance(self):
        """What vanishes here, see `_conditions`."""
        field = ModeField(self.scene, self.field.tables, self.mode)
        return _conditions(self.scene, field, np.append(self._state, self.depths), _units(field, self._state))

    @functools.cached_property
    def intervals(self) -> dict[int, tuple[float, float]]:
        """For a continuum of one dimension: least and largest value of the state (index) that varies most along it, up to which
        no contact is beyond a limit (by the tangent of the guards: exact where no force law is curved)."""
        if len(self.continuum) != 1 or not self.success:
            return {}
        direction = self.continuum[0] / self.continuum[0][np.argmax(np.abs(self.continuum[0]))]
        place = int(np.argmax(np.abs(direction)))
        values, slopes = self.field.guard_slopes(self._state)
        along = slopes @ direction
        with np.errstate(divide="ignore", invalid="ignore"):
            away = -values / along
        low = float(away[along < 0.0].max(initial=-np.inf))
        high = float(away[along > 0.0].min(initial=np.inf))
        return {place: (float(self._state[place]) + low, float(self._state[place]) + high)}

    @property
    def kind(self) -> str:
        """"regular"; "pseudo": of a slide, where fields of first order on both sides of a surface cancel; "boundary": on a surface
        that ends its mode."""
        return "boundary" if self.on_boundary else "pseudo" if self.scene.slides(self.mode) else "regular"

    @property
    def virtual(self) -> bool:
        """Whether it is an equilibrium of a mode that does not hold there: no motion rests there."""
        return self.status is EquilibriumStatus.INADMISSIBLE

    @functools.cached_property
    def weight(self) -> float | tuple[float, ...] | None:
        """Share of the field above the surface, 0 to 1, in the field of a slide, where both cancel; a tuple of several surfaces.
        None where nothing slides."""
        values = self.field.guard_slopes(self._state)[0]
        ends = [value for g, value in enumerate(values.tolist()) if self.scene.event_kind(self.mode, g) is EventKind.SLIDE_END]
        found = tuple(low / (low + high) for low, high in zip(ends[::2], ends[1::2], strict=True))
        return None if not found else found[0] if len(found) == 1 else found

    @functools.cached_property
    def on_boundary(self) -> list[str]:
        """Labels of the elements whose guard is zero here: the equilibrium lies on the boundary of two modes."""
        values = self.field.guards(self._state)
        return [self.scene.element_name(self.mode, g) for g in np.flatnonzero(np.abs(values) <= BOUNDARY).tolist()]

    @property
    def status(self) -> EquilibriumStatus:
        """How the equilibrium is to be taken."""
        if self._failed is not None:
            return self._failed
        if self.field.guards(self._state).max(initial=-1.0) > INSIDE:
            return EquilibriumStatus.INADMISSIBLE
        return EquilibriumStatus.CONTINUUM if len(self.continuum) else EquilibriumStatus.CONVERGED

    @property
    def success(self) -> bool:
        """Whether it is a state of rest of the system."""
        return self._failed is None and self.status in (EquilibriumStatus.CONVERGED, EquilibriumStatus.CONTINUUM)

    @property
    def message(self) -> str:
        """The status as a sentence, with the interval of a continuum, and what lies on a boundary."""
        text, n = self.status.sentence, self.scene.n
        if n == 0 and self._failed is None:
            of = repr(next(iter(self.contacts.values())))
            text = {"regular": f"The field of mode {of} vanishes here",
                    "pseudo": f"The fields on both sides of the surface of mode {of} cancel here",
                    "boundary": f"The field of mode {of} vanishes on a surface where the mode ends"}[self.kind]
            text += (", where the mode does not hold: it is virtual, no motion rests here." if self.virtual else
                     "; it is one of a continuum." if len(self.continuum) else ".")
        if not self.success:
            return text
        for place, (low, high) in self.intervals.items():
            name = self.system.states[place] if n == 0 else f"{'Coordinate' if place < n else 'State'} {place}"
            text += f" {name} may stand in [{low:.6g}, {high:.6g}]."
        if self.on_boundary:
            text += (f" It lies on the boundary of two modes of {', '.join(self.on_boundary)}: its eigenvalues are those of one "
                     "side, they do not decide stability.")
        return text

    @kept
    def linearisation(self) -> np.ndarray:
        """Matrix A (k, k) of small motions c' = A c that the mode allows, modulo the continuum, in the units of the system: the
        state is ``state + directions @ c``.  Where nothing is held it is the derivative of (velocities, accelerations, rates of
        memory) by the state."""
        A, Z, read = self._small
        B = self.directions
        return (B.T @ Z) @ A @ (read @ B)

    @kept
    def directions(self) -> np.ndarray:
        """Directions (ns, k), orthonormal in the units of the system, of the motions of `linearisation`: components of the state
        that are free, in their order, and combinations of those that are not alone so."""
        Q, _ = np.linalg.qr(self._small[1])
        B, _, order = qr(Q @ Q.T, pivoting=True)  # a component that is free alone is its own projection, and the longest
        k = Q.shape[1]
        B = B[:, :k] * np.sign(B[order[:k], np.arange(k)])
        return B[:, np.argsort(order[:k])]

    @functools.cached_property
    def _small(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The matrix of small motions (k, k), the directions (ns, k) it belongs to, orthonormal in the units of the mode, and what
        gives the coordinates (k, ns) of a state."""
        scene, ns, units = self.scene, self.scene.ns, self.field.units
        algebraic = [place for place, _ in scene.algebraic(self.mode)]
        free = np.setdiff1d(np.arange(ns), algebraic)
        J = (self.field.jacobian(self._state) * units / units[:, None])[np.ix_(free, free)]
        curved = [slope for _, slope in curved_rests(scene, self.mode, self.field.joined(self._state))]
        kept = _levelled(np.vstack([self.field.constraints(), *curved])[:, :ns] * units)
        Z = np.eye(ns)[:, free] @ _kernel(kept[:, free]).T
        A = Z[free].T @ J @ Z[free]
        N = _kernel(A) if len(self.continuum) else np.empty((0, len(A)))
        if len(N):
            Q = np.linalg.qr(N.T, mode="complete")[0][:, len(N):]
            A, Z = Q.T @ A @ Q, Z @ Q
        return A, Z * units[:, None], Z.T / units

    @kept
    def eigenvalues(self) -> np.ndarray:
        """Eigenvalues, complex, largest real part first, of the motions that the mode allows."""
        A = self._small[0]
        found = np.linalg.eigvals(A).astype(complex) if len(A) else np.empty(0, complex)
        return found[np.lexsort((-found.imag, -found.real.round(13)))]

    @property
    def stable(self) -> bool | None:
        """Whether all eigenvalues have negative real parts; None where one is neutral or the boundary of a mode is met."""
        if not self.success or self.on_boundary:
            return None
        values = self.eigenvalues
        top = float(values.real.max(initial=-np.inf))
        if abs(top) <= NEUTRAL * float(np.abs(values).max(initial=0.0)):
            return None
        return top < 0.0

    @checked()
    def lyapunov_coefficient(self, dof: int = 0) -> float:
        """Return the first Lyapunov coefficient l1 at a Hopf point: r' = mu r + l1 r^3 for the amplitude r of a coordinate.

        Negative: supercritical, stable orbits grow on the side where the equilibrium is unstable.

        Parameters
        ----------
        dof : int
            Coordinate (of a system of first order: state) whose amplitude r is meant; l1 scales with it, its sign does not.

        Raises
        ------
        ValueError
            Away from a Hopf point: no pair of eigenvalues is imaginary.

        References
        ----------
        Y. A. Kuznetsov, Elements of Applied Bifurcation Theory (2004), eqs. 3.18 and 5.39.
        """
        most = (self.system.n or self.scene.ns) - 1
        return lyapunov_coefficient(self, whole("lyapunov_coefficient", "dof", dof, least=0, most=most))

    def to_record(self) -> tuple[dict, dict]:
        """Return header and arrays for `bifurc.io`."""
        return {"kind": "equilibrium", "system": self.system.to_record()}, {"state": self.state}

    @classmethod
    def from_record(cls, header: dict, arrays: dict, elements=()) -> "Equilibrium":
        """Make the equilibrium that `to_record` described: it is solved for again from its state."""
        system = System.from_record(header["system"], elements)
        io.fitted(arrays, {"state": "finite ns"}, ns=scene_of(system).ns)
        return find_equilibrium(system, arrays["state"])

    def __repr__(self):
        stable = {True: "stable", False: "unstable", None: "stability unknown"}[self.stable]
        where = np.array2string(self._state[:self.scene.n or None], precision=8, threshold=6)
        if self.scene.n:
            return f"Equilibrium(q={where}, {stable}, {self.status})"
        words = ("virtual " if self.virtual else "") + (self.kind if self._failed is None else str(self.status))
        of = next(iter(self.contacts.values()))
        return f"Equilibrium({where}, {words}, of {of!r}, {stable})"


@checked()
def find_equilibrium(system: System, guess=None) -> Equilibrium:
    """Return a state of rest of a system without excitation.

    Parameters
    ----------
    system : System
    guess : array (n,), (2 n,) or (ns,), dict, Equilibrium, or None
        Positions or a state near it (None: zero), or its components by name.  Where states of rest form a continuum the one
        nearest to the guess is given.

    Returns
    -------
    Equilibrium
        Look at ``success``, ``status`` and ``message``: a failure is reported there, not raised.

    Raises
    ------
    ValueError
        A system with an excitation, a guess of wrong shape or not finite.

    Examples
    --------
    >>> import bifurc as bf
    >>> rest = bf.find_equilibrium(bf.systems.belt_oscillator(belt_speed=0.5))
    >>> rest.stable
    True
    """
    if system.omega is not None:
        raise ValueError(f"{system!r} has an excitation of frequency {system.omega:g} and no state of rest; "
                         "find_orbit gives its motion")
    scene = scene_of(system)
    y = _guess(scene, guess)
    tried: set[tuple[int, int]] = set()
    starts = {-1: y}  # the guess, and what modes have that are ended by a violated guard
    waiting, refused = [(mode, -1) for mode in _first(scene, y)], None
    while waiting and len(tried) < MODES:
        mode, source = waiting.pop(0)
        if (mode, source) in tried:
            continue
        tried.add((mode, source))
        for pressed in (False, True):
            rest = solved(scene, mode, starts[source], pressed)
            if rest is None:
                continue
            found = Equilibrium(system, mode, rest[0], depths=rest[1])
            if found.success:
                return resting(found)
            refused = refused or found
            starts[mode] = found.state
            for g in np.flatnonzero(found.field.guards(found.state) > INSIDE).tolist():
                element = scene.guard(mode, g).element
                after = [scene.combine(mode, element, key) for key in scene.followers(mode, g, found.field.joined(found.state))]
                waiting[:0] = [(m, start) for m in after if m is not None for start in (-1, mode)]
            if not len(rest[1]):
                break
    return refused or Equilibrium(system, next(scene.start_modes()), y, EquilibriumStatus.NOT_FOUND)


def equilibria_of(system: System, modes) -> tuple[Equilibrium, ...]:
    """Return the equilibria that stand alone of modes by their keys, one a mode at most, whether the mode holds there or not."""
    scene, found = scene_of(system), []
    for mode in map(scene.index, modes):
        rest = solved(scene, mode, np.zeros(scene.ns), False)
        made = None if rest is None else Equilibrium(system, mode, rest[0], depths=rest[1])
        if made is not None and not len(made.continuum):
            found.append(made)
    return tuple(found)


def resting(found: Equilibrium) -> Equilibrium:
    """Return the equilibrium in the mode that holds most, where it lies on the boundary of several: what slides with no speed
    sticks, and stands at the end of a continuum."""
    scene = found.scene
    for g in np.flatnonzero(np.abs(found.field.guards(found.state)) <= BOUNDARY).tolist():
        element = scene.guard(found.mode, g).element
        for key in scene.followers(found.mode, g, found.field.joined(found.state)):
            mode = scene.combine(found.mode, element, key)
            rest = None if mode is None or mode == found.mode else solved(scene, mode, found.state, True)
            if mode is None or rest is None:
                continue
            state = rest[0]
            other = Equilibrium(found.system, mode, state, depths=rest[1])
            near = np.abs(state - found.state).max() <= BOUNDARY * max(np.abs(state).max(), 1e-300)  # no velocities in it
            if near and other.success and len(other.continuum) > len(found.continuum):
                return resting(other)
    return found


def _guess(scene: Scene, guess) -> np.ndarray:
    """Return the state (ns,) that a guess means, at rest."""
    given: np.ndarray | None
    if guess is None:
        given = np.zeros(scene.ns)
    else:
        given = (guess.state if isinstance(guess, (Equilibrium, Orbit)) else start_of(scene, "guess", guess)
                 if isinstance(guess, Mapping) else floats(guess))
    if given is None:
        raise refused("find_equilibrium", "guess", guess, "positions, a state, an Equilibrium or an orbit")
    if given.shape not in {(scene.n or scene.ns,), (2 * scene.n or scene.ns,), (scene.ns,)}:
        raise ValueError(f"guess has shape {given.shape}; it must be ({scene.n},) positions, or a state ({scene.ns},)")
    if not np.isfinite(given).all():
        raise refused("find_equilibrium", "guess", guess, "finite")
    x = np.zeros(scene.ns + scene.nw)
    x[:given.size], x[scene.ns] = given, 1.0
    x[scene.n:2 * scene.n] = 0.0
    if given.size < scene.ns:
        scene.relax(x)
    return x[:scene.ns]


def _first(scene: Scene, y) -> list[int]:
    """Return the modes to be tried: that in which a motion from the guess begins, then all others that may hold at a start."""
    found = []
    x = np.append(y, [1.0])
    try:
        first = settle.start(scene, x)[0]
        found = [first] if scene.ending(first) is None else []
    except (settle.Penetration, settle.Inconsistent):
        pass  # the guess is beyond a surface, an equilibrium need not be
    return [*found, *scene.start_modes()]


def solved(scene: Scene, mode: int, y, pressed: bool) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the state (ns,) at rest in a mode nearest to ``y``, by Newton with the least change, and the depths (contacts,) of its
    forces beyond circles; None where there is none.

    Depths are those of the coordinates until these are `NEAR`; or, ``pressed``, they begin with those that balance the load at
    ``y`` best.
    """
    field, ns = ModeField(scene, scene.tables, mode), scene.ns
    units = _units(field, y)
    y = np.append(y, field.pressed(y) if pressed else field.depths(y)[0])
    largest, size = float(np.abs(y / units).max()), np.zeros(0)
    for count in range(STEPS):
        F, J, terms = _conditions(scene, field, y, units)
        if not (np.isfinite(F).all() and np.isfinite(J).all()):
            return None
        size = terms if count == 0 else np.maximum(size, terms)
        step = np.linalg.lstsq(J, -F, rcond=1e-12)[0] * units
        for _ in range(HALVINGS):  # out of where a law is defined
            field.press(y[:ns] + step[:ns], y[ns:] + step[ns:])
            if np.isfinite(field.rate(y[:ns] + step[:ns])).all():
                break
            step *= 0.5
        largest = max(largest, float(np.abs((y + step) / units).max()))
        better = np.abs(step / units).max() > CONVERGED * largest
        if better or np.abs(_conditions(scene, field, y + step, units)[0]).max() < np.abs(F).max():  # what was solved for stays
            y = y + step
            if not pressed and np.abs(step / units).max() > NEAR * largest:
                y[ns:] = field.depths(y[:ns])[0]
        else:
            if not bool((np.abs(F) <= BALANCED * size).all()):
                return None
            y[np.abs(y / units) <= CONVERGED * largest] = 0.0  # velocities, and what only rounding keeps from a surface at zero
            return y[:ns], y[ns:]
    return None


def _units(field: ModeField, y) -> np.ndarray:
    """Return the units (ns + contacts,) of the unknowns: those of the mode, and for depths those in which walls are no steeper."""
    return np.append(field.units, field.pace**2 / np.maximum(field.stiffening(y), field.pace**2))


def _conditions(scene: Scene, field: ModeField, unknown, units):
    """Return what vanishes at rest: rates, velocities, what the mode holds, internal variables that follow, and what depths are
    beside those of the coordinates; its derivative by ``unknown`` (ns + contacts,), states and depths, and the size of the terms;
    all in ``units``."""
    ns, n = scene.ns, scene.n
    y, depths = unknown[:ns], unknown[ns:]
    told, normals = field.press(y, depths)
    x = field.joined(y)
    rows = np.vstack([field.constraints(), np.eye(ns, x.size)[n:2 * n]])
    for place, row in scene.algebraic(field.mode):
        rows = np.vstack([rows, np.eye(1, x.size, place) - row])
    curved = curved_rests(scene, field.mode, x)
    F = np.concatenate([field.rate(y), rows @ x, [value for value, _ in curved], told - depths])
    held = np.vstack([rows[:, :ns], *(slope[:ns] for _, slope in curved)])
    J = np.vstack([field.apart(y), np.hstack([held, np.zeros((len(held), len(depths)))]),
                   np.hstack([normals, -np.eye(len(depths))])]) * units
    T = field.tables
    rates = np.abs(T.A[field.mode]) @ np.abs(x)
    rates[n:2 * n] += np.abs(field.forces(y)) @ np.abs(T.LP[field.mode])
    size = np.concatenate([rates, np.abs(rows) @ np.abs(x), np.zeros(len(curved)), np.abs(normals) @ np.abs(y)])
    weight = np.append(units[:ns] * field.pace, _heights(J[ns:]))
    return F / weight, J / weight[:, None], np.full(size.size, max(float((size / weight).max()), 1e-300))


def _heights(rows) -> np.ndarray:
    """Return the largest entry of each of the rows (k, ns), 1 for rows of zeros."""
    height = np.abs(rows).max(axis=1, initial=0.0)
    return np.where(height > 0.0, height, 1.0)


def _levelled(rows) -> np.ndarray:
    """Return rows (k, ns) over their largest entries: some are speeds, some positions."""
    return rows / _heights(rows)[:, None]


def _kernel(matrix) -> np.ndarray:
    """Return an orthonormal basis (k, n) of the null space of a matrix (m, n)."""
    if not len(matrix):
        return np.eye(matrix.shape[1])
    _, sigma, V = np.linalg.svd(matrix)
    rank = int(np.count_nonzero(sigma > RANK * sigma.max(initial=0.0)))
    return V[rank:]
