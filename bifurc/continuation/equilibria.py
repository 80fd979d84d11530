"""Equilibria along a parameter: folds, Hopf points, and boundary equilibria, where a contact touches, parts, sticks or slips.

The unknowns are the positions and the internal variables; velocities are zero.  The equations are the accelerations that
the mode leaves free, the surfaces of what rests on them, and the values of what is held or frozen, which label a continuum.

A Hopf point is a zero of the product of the sums of two eigenvalues (Kuznetsov 2004, section 10.2); a pair of real ones
makes it vanish too, which is told apart.  Every guard is a boundary of the mode: beyond its zero the mode that the guard
names is tried, on both sides of the parameter, for equilibria may go on or turn back there (di Bernardo et al. 2008, chapter 5).

One file, because equations, tests and what is shown read the same unknowns, coordinates and depths.
"""
import copy
import math
from functools import partial

import numpy as np

from ..compose.scene import beside, scene_of
from ..elements.element import tupled
from ..flow.linear import ModeField
from ..jobs.executors import user_parts
from ..orbits.autonomous import section
from ..orbits.equilibria.equilibrium import INSIDE, Equilibrium
from ..orbits.equilibria.hopf import critical_pair
from ..orbits.shooting.path import SHAKEN, ParameterPath, of_all_modes, parameter_path
from ..orbits.shooting.sequence import set_parameter
from ..orbits.shooting.signature import Signature, sections
from ..structure.components import by_number, worded
from ..system import System
from .families import orbit_family
from .kinds import NUMERICAL, SpecialPointKind
from .problem import Monitor, Problem
from .shooting.branching import stepped_out
from .shooting.problem import OrbitProblem
from .shooting.signature_change import admissible_side
from .switched import Switched

IMAGINARY = 1e-5  # real over imaginary part of a pair of eigenvalues at a Hopf point
KEPT = 16  # values of a parameter at which how steep walls are is remembered: differences ask for the same ones again
FREE = 1e-10  # singular values of held rows below this part of the largest: directions that are not held


def equilibrium_problem(start: Equilibrium, parameter: str, bounds: tuple[float, float]) -> "EquilibriumProblem":
    """Return the problem that continues an equilibrium in ``parameter`` over ``bounds``.

    Raises
    ------
    ValueError
        Unknown or discrete parameter, or an equilibrium that is no state of rest of its system; of systems of first order virtual
        ones are followed, too.
    """
    name = start.system.parameter_name(parameter)
    value = start.system.parameter(name)
    if not start.success and not (start.virtual and not start.scene.n):
        raise ValueError(f"the equilibrium cannot be continued, it is {start.status}: {start.message}")
    path = parameter_path(start.scene, start.system, name, bounds)
    return EquilibriumProblem(start.system, path, start.mode, start.state, value, 0.5 * abs(bounds[1] - bounds[0]),
                              depths=start.depths, beyond=np.flatnonzero(start.field.guards(start.state) > INSIDE))


class EquilibriumProblem(Problem):
    """Equilibria of one mode along one parameter.

    Parameters
    ----------
    system : System
        Any system of the family; its other parameters hold along the branch.
    path : ParameterPath
    mode : int
        Of the scene.
    state : ndarray (ns,)
        At the start.
    value, parameter_scale : float
        Of the parameter.
    size : float, optional
        Natural size of the unknowns; default: the largest of the state, or 1 where that is zero.
    depths : ndarray (contacts,), optional
        At the start, see `ModeField`; default: what balances the load there.
    beyond : iterable of int, optional
        Guards of the mode that are passed all along: of a system of first order the equilibria of a mode that does not hold there.

    Notes
    -----
    Forces beyond circles are unknowns, too: each by how far it would move the rest of the system, so that neither steps nor the
    accuracy of branches depend on how stiff the wall is.
    """

    errors = NUMERICAL
    monitors_read_tangent = False

    def __init__(self, system: System, path: ParameterPath, mode: int, state, value: float, parameter_scale: float, size=None,
                 depths=None, beyond=()):
        self.system, self.path, self.mode = system, path, mode
        self.scene = scene_of(system)
        self.parameter = path.name or ""
        self.field = ModeField(self.scene, path.tables, mode)
        ns, n = self.scene.ns, self.scene.n
        self.places = np.array([*range(n), *range(2 * n, ns)])
        self.reference = np.array(state, float)
        self._size_u = float(size or np.abs(state).max() or 1.0)
        self._steep: dict[float, np.ndarray] = {}
        self.numbers_at(value)
        self._soft = self.field.pace**2  # the rest of the system is as steep as that
        pressed = (self.field.pressed(self.reference) if depths is None else depths) * self._steepness()
        unknown = np.append(self.reference[self.places], pressed)
        super().__init__(unknown, value, self._size_u * math.sqrt(unknown.size), parameter_scale)
        self.signature = ", ".join(f"{label} {key}" for label, key in zip(system.labels, self.scene.keys[mode], strict=True))
        guards = int(path.tables.n_guards[mode])
        self.beyond = frozenset(map(int, beyond))
        if self.beyond:
            self.signature = f"virtual: {self.signature}"
        self._signs = np.where(np.isin(np.arange(guards), list(self.beyond)), -1.0, 1.0)
        monitors = [Monitor(SpecialPointKind.BOUNDARY_EQUILIBRIUM, f"{self.scene.element_name(mode, g)}.{g}", boundary=True)
                    for g in range(guards)]
        self.monitors = (*monitors, Monitor(SpecialPointKind.HOPF))

    # equations

    def state(self, u) -> np.ndarray:
        """Return the state (ns,) of the unknowns."""
        y = np.zeros(self.scene.ns)
        y[self.places] = u[:self.places.size]
        return y

    def _steepness(self) -> np.ndarray:
        """Return how much steeper walls (contacts,) are than the rest, with the numbers that are in the tables now."""
        if not self.field.contacts:
            return np.empty(0)
        found = self._steep.get(self._at)
        if found is None:
            self.field.press(self.reference, self.field.depths(self.reference)[0])
            while len(self._steep) >= KEPT:
                self._steep.pop(next(iter(self._steep)))
            found = self._steep[self._at] = self.field.stiffening(self.reference) / self._soft
        return found

    def _depths(self, u) -> np.ndarray:
        """Return the depths (contacts,) of the unknowns, with the numbers that are in the tables now."""
        return u[self.places.size:] / self._steepness()

    def _pressed(self, u) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the state (ns,) of the unknowns, and let the field have their depths; with it what vanishes (contacts,): depths
        that the coordinates tell less these, and the derivative (contacts, ns + contacts) of that."""
        y, contacts = self.state(u), self.field.contacts
        if not contacts:
            return y, u[:0], np.empty((0, y.size))
        depths = self._depths(u)
        told, normals = self.field.press(y, depths)
        return y, told - depths, np.hstack([normals, -np.eye(contacts)])

    def numbers_at(self, p) -> None:
        """Write the numbers of a parameter value into the tables."""
        path, self._at = self.path, float(p)
        set_parameter(path.tables, path.index, path.series, path.low, path.high, self._at)

    def _rows(self):
        """Return what picks the free accelerations (k, n), and rows (h, nx) that vanish with what is held and frozen."""
        T, m, n, ns = self.path.tables, self.mode, self.scene.n, self.scene.ns
        held = T.H[m, :int(T.n_holds[m])][:, n:2 * n]
        kept = []
        for k, speed in enumerate(held):
            row = T.S[m, k].copy()
            if not row.any():
                row[:n] = speed
                row[ns] = -speed @ self.reference[:n]
            kept.append(row)
        free = np.eye(n)
        if len(held):
            _, sigma, V = np.linalg.svd(held)
            free = V[int(np.count_nonzero(sigma > FREE * sigma[0])):]
        algebraic = dict(self.scene.algebraic(m))
        for place in range(2 * n, ns):
            row = np.zeros(T.A.shape[2])
            if T.A[m, place].any():
                continue
            row[place] = 1.0
            if place in algebraic:
                row -= algebraic[place]
            else:
                row[ns] = -self.reference[place]
            kept.append(row)
        return free, np.array(kept).reshape(len(kept), T.A.shape[2])

    def _sliding(self, rates, values, away):
        """Return what vanishes on the surfaces that a mode of first order slides on (ns,), or its derivative (ns, ns): of the rates
        what lies in the surfaces, beside them how far they are, and where nothing moves a state how far that is from its own."""
        normals = self.field.constraints()[:, :self.scene.ns]
        out = np.linalg.pinv(normals)
        found = rates - out @ (normals @ rates) + math.sqrt(self._soft) * (out @ values)
        still = ~self.path.tables.A[self.mode].any(axis=1) & ~normals.any(axis=0)
        found[still] = away[still]
        return found

    def residual(self, u, p):
        """Return free accelerations, rates of internal variables, and what is held (n + nz,)."""
        self.numbers_at(p)
        (y, apart, _), n = self._pressed(u), self.scene.n
        if self.field.slides:
            return self._sliding(self.field.rate(y), self.field.constraints() @ self.field.joined(y), y - self.reference)
        free, kept = self._rows()
        f = self.field.rate(y)
        moving = [place for place in range(2 * n, self.scene.ns) if self.path.tables.A[self.mode, place].any()]
        return np.concatenate([free @ f[n:2 * n], f[moving], kept @ self.field.joined(y), apart])

    def jacobian(self, u, p):
        """Return F_u (m, m) and F_p (m,)."""
        h = 1e-4 * self.scale[-1] if math.isfinite(self.scale[-1]) else 1e-4
        slope = sum(w * self.residual(u, p + k * h) for k, w in ((-2, 1.0), (-1, -8.0), (1, 8.0), (2, -1.0))) / (12.0 * h)
        self.numbers_at(p)
        (y, _, apart), n, ns = self._pressed(u), self.scene.n, self.scene.ns
        if self.field.slides:
            return self._sliding(self.field.apart(y), self.field.constraints()[:, :ns], np.eye(ns)), slope
        free, kept = self._rows()
        J = self.field.apart(y)
        moving = [place for place in range(2 * n, ns) if self.path.tables.A[self.mode, place].any()]
        found = np.vstack([free @ J[n:2 * n], J[moving]])
        if not self.field.contacts:
            return np.vstack([found, kept[:, :ns]])[:, self.places], slope
        found = np.vstack([found, np.hstack([kept[:, :ns], np.zeros((len(kept), len(apart)))]), apart])
        return np.hstack([found[:, self.places], found[:, ns:] / self._steepness()]), slope

    def monitor_values(self, u, p, tangent):
        """Return the guards, relative to the size of their terms, and the Hopf test."""
        self.numbers_at(p)
        made = self._equilibrium(u)
        eigenvalues = made.eigenvalues
        test = 1.0
        for i in range(len(eigenvalues)):
            for j in range(i):
                both = eigenvalues[i] + eigenvalues[j]
                test *= both / (abs(eigenvalues[i]) + abs(eigenvalues[j]) or 1.0)
        return np.append(self._signs * self.field.guards(made.state, self._size_u), float(np.real(test)))

    def confirm(self, kind, x) -> bool:
        """Whether a zero of the Hopf test is one: a complex pair on the imaginary axis, no pair of real ones; where the mode does
        not hold nothing moves like that."""
        if kind is not SpecialPointKind.HOPF:
            return True
        if self.beyond:
            return False
        self.numbers_at(x[-1])
        values = self._equilibrium(x[:-1]).eigenvalues
        return bool(np.any((values.imag > 0.0) & (np.abs(values.real) < IMAGINARY * np.abs(values.imag))))

    def frequency(self, x) -> float:
        """Return the imaginary part of the pair of eigenvalues nearest to the imaginary axis at ``x``."""
        self.numbers_at(x[-1])
        return critical_pair(self._equilibrium(x[:-1])._small[0])[0]

    def _equilibrium(self, u) -> Equilibrium:
        """Return the equilibrium of the unknowns with the numbers that are in the tables now."""
        made = Equilibrium(self.system, self.mode, self._pressed(u)[0], depths=self._depths(u) if self.field.contacts else None)
        made.__dict__["field"] = self.field
        return made

    def null_tangent(self, x) -> np.ndarray:
        """Return a unit null vector of [F_u F_p] in scaled unknowns (m + 1,)."""
        return np.linalg.svd(self.wide_jacobian(x) * self.scale)[2][-1]

    # what happens at special points

    def switch(self, point, monitor):
        """Return (problem, x, tangent) of the mode in which equilibria go on behind a boundary, or why none does; those of first
        order go on in their own mode where no other has any."""
        scene, guard = self.scene, int(monitor.name.rsplit(".", 1)[1])
        y = self.state(point.x[:-1])
        element = scene.guard(self.mode, guard).element
        self.numbers_at(point.x[-1])
        for key in () if self.beyond else scene.followers(self.mode, guard, self.field.joined(y)):
            mode = scene.combine(self.mode, element, key)
            if mode is None or mode == self.mode or scene.ending(mode) is not None:
                continue
            new = EquilibriumProblem(self.system, of_all_modes(scene, self.path), mode, y, float(point.x[-1]),
                                     float(self.scale[-1]), self._size_u)
            if np.abs(new.joined_residual(new.x0)).max() > 1e-8 * np.abs(new.wide_jacobian(new.x0) * new.scale).max():
                continue
            side = admissible_side(new, new.x0)
            if side is not None:
                return new, new.x0, side
        if not scene.n:
            new = EquilibriumProblem(self.system, self.path, self.mode, y, float(point.x[-1]), float(self.scale[-1]), self._size_u,
                                     beyond=self.beyond ^ {guard})
            side = admissible_side(new, new.x0)
            if side is not None:
                return new, new.x0, side
        return f"no equilibrium goes on behind the boundary of {scene.element_name(self.mode, guard)}: it ends here"

    def branches(self, point, n_max):
        """Return the periodic orbits born at a Hopf point; None for the general rule."""
        if point.kind is SpecialPointKind.HOPF and not self.scene.n:
            return Switched((), "the field is affine: at this value all motions around the equilibrium are closed, up to those "
                                "that touch a surface; find_orbit beside it gives the orbits that pass one")
        return self.hopf_orbits(point) if point.kind is SpecialPointKind.HOPF else None

    def hopf_orbits(self, point):
        """Return an orbit of small amplitude at a Hopf point, to be traced in the same parameter: a one-tuple, or empty."""
        problem, direction = self.hopf_orbit_problem(point.x)
        orbit = stepped_out(problem, problem.x0, direction)
        return () if orbit is None else (orbit,)

    def hopf_orbit_problem(self, x):
        """Return the problem of the orbits that are born at the Hopf point ``x`` (m + 1,), with the amplitude zero as its start,
        and the direction (., own units) in which they grow."""
        scene, n = self.scene, self.scene.n
        self.numbers_at(x[-1])
        y = self.state(x[:-1])
        small, Z, _ = self._equilibrium(x[:-1])._small
        omega, q, _ = critical_pair(small)
        q = Z @ q
        i = int(np.argmax(np.abs(q[:n])))
        q = np.real(q / q[i])  # the coordinate that moves most is at its maximum
        weights = np.full(scene.ns, self._size_u)
        weights[n:2 * n] *= omega
        q[n + i] = 0.0
        clock = 2.0 * np.pi / omega
        nodes = sections(self.mode, 0.0).nodes
        signature = Signature(nodes, section(scene, i, weights), 0.0, clock=clock)
        path = parameter_path(scene, self.system, self.parameter, (self.path.low, self.path.high), pad=0.0)
        start = np.concatenate([[1.0], y, x[-1:]])
        problem = OrbitProblem(self.system, path, signature, weights, start, float(self.scale[-1]))
        return problem, np.concatenate([[0.0], q, [0.0]])

    # other equations

    def family_over(self, name: str, bounds: tuple[float, float]):
        """Return the same equations over a second parameter, see `families`."""
        return orbit_family(self, name, bounds)

    def on_path(self, path: ParameterPath) -> "EquilibriumProblem":
        """Return the problem with the numbers of another path along the same parameter."""
        other = copy.copy(self)
        other.path, other.field, other._steep = path, ModeField(self.scene, path.tables, self.mode), {}
        return other

    def shaken(self):
        """See `Problem.shaken`."""
        return SHAKEN, tuple(tuple(partial(self._shaken, way, sign) for sign in (1, -1)) for way in (0, 1))

    def _shaken(self, way, sign):
        return self.on_path(self.path.shaken(way, sign))

    def bounded(self, low, high, made):
        """Return the problem with its path reaching over [low, high]; ``made`` keeps the paths already widened."""
        path = self.path
        if path.low <= low and high <= path.high:
            return self
        if path not in made:
            made[path] = parameter_path(self.scene, self.system, path.name, (min(low, path.low), max(high, path.high)))
        return EquilibriumProblem(self.system, made[path], self.mode, self.reference, float(self.x0[-1]), float(self.scale[-1]),
                                  self._size_u, beyond=self.beyond)

    def same(self, other) -> bool:
        """Whether two problems have the same equations."""
        return isinstance(other, EquilibriumProblem) and (self.mode, self.beyond) == (other.mode, other.beyond)

    # what is shown and stored

    @property
    def measure_names(self) -> tuple[str, ...]:
        """Columns on demand."""
        count = len(self._equilibrium(self.x0[:-1]).eigenvalues)
        each = [worded(f"{name}_{i}", self.states) for i in range(self.system.measured) for name in ("q", "max", "min", "rms")]
        return (*each, "stable", *(("virtual",) if self.states else ()), *(f"eigenvalue_{k}" for k in range(count)))

    def measure(self, name, xs):
        """Return the column ``name`` (m,) for the rows ``xs``."""
        kind, _, number = by_number(name, self.states).partition("_")
        if kind in ("q", "max", "min", "rms"):  # a motion that stands still has these, too
            return np.abs(xs[:, int(number)]) if kind == "rms" else xs[:, int(number)].copy()
        if name == "virtual":
            return np.full(len(xs), bool(self.beyond))
        found = []
        for x in xs:
            self.numbers_at(x[-1])
            made = self._equilibrium(x[:-1])
            found.append((None if self.beyond else made.stable) if kind == "stable" else made.eigenvalues[int(number)])
        return np.array(found, object if None in found else None)

    def solution(self, x) -> Equilibrium:
        """Return the equilibrium at ``x``."""
        system = beside(self.system, self.parameter, float(x[-1]), 0.5 * (self.path.low + self.path.high))
        mode = scene_of(system).index(self.scene.keys[self.mode])
        self.numbers_at(x[-1])
        return Equilibrium(system, mode, self.state(x[:-1]), depths=self._depths(x[:-1]))

    def __reduce_ex__(self, protocol):
        return EquilibriumProblem.from_record, (self.to_record(), user_parts(self.system))  # what is compiled does not travel

    def to_record(self) -> dict:
        """Return a JSON-able description."""
        return {"kind": "equilibrium", "system": self.system.to_record(), "parameter": self.parameter,
                "path": [self.path.low, self.path.high], "keys": list(self.scene.keys[self.mode]), "size": self._size_u,
                "state": self.reference.tolist(), "value": float(self.x0[-1]), "parameter_scale": float(self.scale[-1]),
                "beyond": sorted(self.beyond)}

    @classmethod
    def from_record(cls, record: dict, elements=()) -> "EquilibriumProblem":
        """Make the problem that gave ``record``."""
        system = System.from_record(record["system"], elements)
        scene = scene_of(system)
        mode = scene.index(tupled(record["keys"]))
        path = parameter_path(scene, system, record["parameter"], tuple(record["path"]), pad=0.0)
        return cls(system, path, mode, np.array(record["state"]), record["value"], record["parameter_scale"], record["size"],
                   beyond=record["beyond"])
