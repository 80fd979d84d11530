"""Periodic orbits as a continuation problem: one event signature, one parameter, one compiled call a step."""
import copy
import math

import numpy as np

from ..compose.scene import scene_of
from ..orbits import sequence
from ..orbits.equations import Equations
from ..orbits.orbit import PeriodicOrbit
from ..orbits.path import ParameterPath, parameter_path
from ..orbits.sequence import CLOSES, STARTS
from ..orbits.signature import Signature, repeated
from ..system import System
from . import branching, orbit_switching
from .kinds import CorrectorStatus, SpecialPointKind
from .orbit_switching import LEAVING, LISTED, MERGES, UNLISTED
from .problem import NO_MONITORS, Corrected, Monitor, Problem

NO_PEAK = -1.0  # scaled value of the unlisted maximum where there is none
STATUS = {1: CorrectorStatus.CONVERGED, 0: CorrectorStatus.NOT_CONVERGED, -1: CorrectorStatus.SINGULAR}


def orbit_problem(orbit: PeriodicOrbit, parameter: str, bounds: tuple[float, float]) -> "OrbitProblem":
    """Return the problem that continues ``orbit`` in ``parameter`` over ``bounds``.

    Raises
    ------
    ValueError
        Unknown or discrete parameter, or an orbit that is no motion of its system.
    """
    name = orbit.system.parameter_name(parameter)
    value = orbit.system.parameter(name)
    if not orbit.success:
        raise ValueError(f"the orbit cannot be continued, it is {orbit.status}: {orbit.message}")
    path = parameter_path(orbit.scene, orbit.system, name, bounds)
    x = np.append(orbit.unknowns, value)
    return OrbitProblem(orbit.system, path, orbit.sequence, orbit.weights, x, 0.5 * abs(bounds[1] - bounds[0]))


class OrbitProblem(Problem):
    """Event-sequence equations along one parameter.

    Parameters
    ----------
    system : System
        Any system of the family; its other parameters hold along the branch.
    path : ParameterPath
    sequence : Signature
    weights : ndarray (ns,)
        Natural sizes of the states.
    x0 : ndarray (n + 1,)
        Unknowns of the start and the parameter.
    parameter_scale : float
        Natural size of the parameter.
    """

    def __init__(self, system: System, path: ParameterPath, sequence: Signature, weights, x0, parameter_scale: float):
        self.system, self.path, self.sequence = system, path, sequence
        self.scene = scene_of(system)
        self.parameter = path.name or ""
        self.parameter_scale = parameter_scale
        self.equations = Equations(self.scene, path, sequence, weights, parameter_scale)
        self.weights = self.equations.weights
        self.size, self.scale = self.equations.size, self.equations.scale
        self.x0 = np.array(x0, float)
        self.signature = sequence.text(self.scene)
        self._kept = sequence.kept(self.scene)
        self._halves = branching.halves(self.sequence, self.x0, self.scale)
        flip = SpecialPointKind.PERIOD_DOUBLING if sequence.closure > 0 else SpecialPointKind.BRANCH_POINT
        monitors = [Monitor(flip)]
        self._hits = sequence.events > 0
        if self._hits:
            monitors.append(Monitor(SpecialPointKind.GRAZING, LISTED, boundary=True))
        monitors.append(Monitor(SpecialPointKind.GRAZING, UNLISTED, boundary=True))
        self._leaves = bool(np.any(self.sequence.nodes[:, STARTS:] < 0))
        if self._leaves:
            monitors.append(Monitor(SpecialPointKind.STICK_ONSET, LEAVING, boundary=True))
        self._chatters = bool(np.any(self.sequence.nodes[:, CLOSES] == 1))
        if self._chatters:
            monitors.append(Monitor(SpecialPointKind.CHATTER_COMPLETION, boundary=True))
        if self._halves is not None:
            self._merges = len(monitors)
            monitors.append(Monitor(SpecialPointKind.PERIOD_DOUBLING, MERGES, boundary=True))
        self._tori = self.scene.n > 1
        if self._tori:
            monitors.append(Monitor(SpecialPointKind.NEIMARK_SACKER))
        self.monitors = tuple(monitors)

    # equations

    def correct(self, x, tangent, fixed=False) -> Corrected:
        """See `Problem.correct`; one compiled call."""
        status, U, new, info = self.equations.correct(x, tangent, not fixed)
        iterations, residual = int(info[sequence.ITERATIONS]), float(info[sequence.RESIDUAL])
        if status != 1:
            return Corrected(U, tangent, False, STATUS[status], iterations, residual, math.inf, math.inf, 0.0, -math.inf,
                             NO_MONITORS)
        moved = (U - x) / self.scale
        sign, log = float(info[sequence.DET_SIGN]), float(info[sequence.DET_LOG])
        values = self._values(U, info)
        if self._halves is not None:  # det is odd in the difference of the halves: its zero is the merging, no crossing
            apart = -values[self._merges]
            sign *= math.copysign(1.0, apart)
            log -= math.log(max(abs(apart), 1e-300) / (1.0 + abs(apart)))
        return Corrected(U, new, True, CorrectorStatus.CONVERGED, iterations, residual, math.sqrt(float(np.dot(moved, moved))),
                         float(info[sequence.CONTRACTION]), sign, log, values)

    def _values(self, x, info) -> np.ndarray:
        """Values of the monitors at a solution, from what the kernel found."""
        values = [info[sequence.FLIP]]
        if self._hits:
            least = info[sequence.LISTED]
            values.append(-least if least < np.inf else NO_PEAK)
        peak = info[sequence.PEAK]
        values.append(peak if peak > NO_PEAK else NO_PEAK)
        if self._leaves:
            values.append(info[sequence.LEAVING])
        if self._chatters:
            values.append(-info[sequence.RESTS])
        if self._halves is not None:
            values.append(-float(np.dot(self._halves[0], x)) - self._halves[1])
        if self._tori:
            values.append(self._torus(x))
        return np.array(values)

    def _torus(self, x) -> float:
        """Product of (1 - mu_i mu_j) over pairs i < j: changes sign where a complex pair crosses the unit circle.

        It also does for a real pair mu, 1/mu, which is no bifurcation: `confirm` tells.
        """
        mu = self._multipliers(x)
        if not np.isfinite(mu).all():
            return math.nan
        product = 1.0
        for i in range(len(mu)):
            for j in range(i):
                factor = 1.0 - mu[i] * mu[j]
                product *= factor / (1.0 + abs(factor))
        return float(np.real(product))

    def kind_at(self, monitor, x) -> SpecialPointKind:
        """Return what a zero of a monitor at ``x`` is: a change of the signature has the name of what begins or ends."""
        if monitor.name not in (LISTED, UNLISTED):
            return monitor.kind
        return orbit_switching.kind_of(self, monitor.name, x)

    def confirm(self, kind, x) -> bool:
        """Whether a zero of a monitor is what its kind says: a torus point needs a complex pair on the circle."""
        if kind is not SpecialPointKind.NEIMARK_SACKER:
            return True
        mu = self._multipliers(x)
        return bool(np.any((np.abs(mu.imag) > 1e-7) & (np.abs(np.abs(mu) - 1.0) < 1e-6)))

    def locate(self, kind, a, b):
        """Return the point between two rows where a doubled orbit merges with its orbit of half the period, or None.

        There the doubled equations are singular; the flip of the single orbit is located instead.
        """
        if kind is not SpecialPointKind.PERIOD_DOUBLING or self._halves is None:
            return None
        f0, f1 = (float(np.dot(self._halves[0], row.x)) + self._halves[1] for row in (a, b))
        return branching.merging(self, a, b, f0 / (f0 - f1)) if f0 * f1 <= 0.0 else None

    def monitor_values(self, u, p, tangent) -> np.ndarray:
        """Return the values of ``monitors`` at a solution; that of the flip is NaN, `wrapped_jacobian` decides it."""
        e, s, info = self.equations, self.sequence, np.zeros(sequence.INFO)
        e.kernel.monitor(e.numbers_at(p), s.nodes, s.fixed, s.span, e.closure, u, e.weights, info)
        info[sequence.FLIP] = math.nan
        return self._values(np.append(u, p), info)

    def residual(self, u, p):
        """Return the scaled residual (n,)."""
        return self.equations.residual(np.append(u, p))

    def jacobian(self, u, p):
        """Return the scaled F_u (n, n) and F_p (n,)."""
        return self.wrapped_jacobian(np.append(u, p), 1.0)

    def wrapped_jacobian(self, x, mu):
        """Return F_u with the factor ``mu`` on the columns of the closing node, and F_p."""
        e, delta = self.equations, 1e-6 * self.scale[-1]
        below, above = x.copy(), x.copy()
        below[-1] -= delta
        above[-1] += delta
        return e.jacobian(x, mu), (e.residual(above) - e.residual(below)) / (2.0 * delta)

    def null_tangent(self, x) -> np.ndarray:
        """Return a unit null vector of [F_u F_p] in scaled unknowns (n + 1,)."""
        fu, fp = self.jacobian(x[:-1], x[-1])
        wide = np.column_stack([fu, fp]) * self.scale
        return np.linalg.svd(wide)[2][-1]

    # other equations

    def bounded(self, low, high, made):
        """Return the problem with its path reaching over [low, high]; ``made`` keeps the paths already widened."""
        path = self.path
        if path.low <= low and high <= path.high:
            return self
        if path not in made:
            made[path] = parameter_path(self.scene, self.system, path.name, (min(low, path.low), max(high, path.high)))
        return OrbitProblem(self.system, made[path], self.sequence, self.weights, self.x0, self.parameter_scale)

    def family(self, name: str, bounds: tuple[float, float]):
        """Return the same equations over a second parameter, see `families`."""
        from .families import orbit_family

        return orbit_family(self, name, bounds)

    def on_path(self, path: ParameterPath) -> "OrbitProblem":
        """Return the problem with the numbers of another path along the same parameter."""
        other = copy.copy(self)
        other.path, other.equations = path, self.equations.on(path)
        return other

    def with_sequence(self, signature: Signature, x0) -> "OrbitProblem":
        """Return the problem of another event signature along the same path."""
        path = self.path
        if len(path.tables.n_guards) != len(self.scene.keys):  # the scene has met more modes
            path = parameter_path(self.scene, self.system, self.parameter, (path.low, path.high), pad=0.0)
        return OrbitProblem(self.system, path, signature, self.weights, x0, self.parameter_scale)

    def switch(self, point, monitor):
        """Return the equations that go on behind a grazing, see `orbit_switching`."""
        return None if monitor.name == MERGES else orbit_switching.through_grazing(self, point, monitor)

    def branches(self, point, n_max):
        """Return the orbits that meet this branch in a special point."""
        return branching.branches(self, point, n_max)

    def same(self, other) -> bool:
        """Whether two problems have the same equations."""
        return self.sequence.key == other.sequence.key

    # what is shown and stored

    @property
    def measure_names(self) -> tuple[str, ...]:
        """Columns on demand."""
        n = self.scene.n
        each = [f"{name}_{i}" for i in range(n) for name in ("max", "min", "rms", "h1")]
        return (*each, "period", "n_events", "stable", *(f"multiplier_{k}" for k in range(self.scene.ns - len(self._kept))))

    def measure(self, name, xs):
        """Return the column ``name`` (m,) for the rows ``xs`` (m, n + 1)."""
        if name == "n_events":
            return np.full(len(xs), self.sequence.events * (2 if self.sequence.closure < 0 else 1))
        if name == "period":
            periods = self.sequence.span * (2 if self.sequence.closure < 0 else 1)
            return np.array([periods * 2.0 * np.pi / self.equations.numbers_at(x[-1]).flat[0] for x in xs])
        if name == "stable":
            top = np.array([np.abs(self._multipliers(x)).max(initial=0.0) for x in xs])
            return np.where(np.isfinite(top), top < 1.0, False)
        if name.startswith("multiplier_"):
            return np.array([self._multipliers(x)[int(name[11:])] for x in xs])
        kind, dof = name.rsplit("_", 1)
        rows = np.array([self._measured(x, int(dof)) for x in xs])
        return {"max": lambda: rows[:, 0], "min": lambda: rows[:, 1], "rms": lambda: np.sqrt(rows[:, 2]),
                "h1": lambda: np.hypot(rows[:, 3], rows[:, 4])}[kind]()

    def _whole(self, x):
        return repeated(self.scene, self.sequence, x[:-1])

    def _measured(self, x, dof) -> np.ndarray:
        whole, U = self._whole(x)
        out = np.empty(5)
        self.equations.motion.measures(self.equations.numbers_at(x[-1]), whole.nodes, whole.span, U, dof, 1.0, out)
        return out

    def _multipliers(self, x) -> np.ndarray:
        whole, U = self._whole(x)
        M = np.empty((self.scene.ns, self.scene.ns))
        self.equations.motion.monodromy(self.equations.numbers_at(x[-1]), whole.nodes, whole.span, U, M)
        if self._kept:
            M = np.delete(np.delete(M, self._kept, 0), self._kept, 1)
        if not np.isfinite(M).all():
            return np.full(len(M), complex(np.inf))
        mu = np.linalg.eigvals(M).astype(complex)
        return mu[np.lexsort((-mu.imag, -mu.real, -np.abs(mu).round(14)))]

    def solution(self, x) -> PeriodicOrbit:
        """Return the orbit at ``x`` (n + 1,)."""
        system = self.system.with_parameters(**{self.parameter: float(x[-1])})
        return PeriodicOrbit(system, self.sequence, x[:-1], self.weights, {"method": "event sequence", "parameter": self.parameter})

    def to_record(self) -> dict:
        """Return a JSON-able description."""
        s = self.sequence
        return {"kind": "orbit", "system": self.system.to_record(), "parameter": self.parameter,
                "path": [self.path.low, self.path.high], "nodes": s.nodes.tolist(), "fixed": s.fixed.tolist(), "span": s.span,
                "closure": s.closure, "weights": self.weights.tolist(), "parameter_scale": self.parameter_scale,
                "x0": self.x0.tolist()}

    @classmethod
    def from_record(cls, record: dict, elements=()) -> "OrbitProblem":
        """Make the problem that gave ``record``."""
        system = System.from_record(record["system"], elements)
        signature = Signature(np.array(record["nodes"], np.int64), np.array(record["fixed"]), record["span"], record["closure"])
        path = parameter_path(scene_of(system), system, record["parameter"], tuple(record["path"]), pad=0.0)
        return cls(system, path, signature, np.array(record["weights"]), np.array(record["x0"]), record["parameter_scale"])
