"""Cycles of a map as a continuation problem: regular at borders, with flips, tori and border collisions."""
import numpy as np

from ..families import Family
from ..kinds import SpecialPointKind
from ..problem import Monitor, Problem
from .orbit import MapOrbit, MapOrbitStatus, cycle_equations, newton

BORDER = "border"  # name of the monitor of points that reach the border of their piece
MERGES = "merges"  # name of that of doubled cycles that become single ones
OUT = (1e-3, 1e-4, 1e-2, 1e-5)  # scaled steps to the doubled cycle that is handed out


class CycleProblem(Problem):
    """A cycle of a map along one parameter.

    Parameters
    ----------
    cycle : MapOrbit
    parameter : str
    bounds : tuple of float, optional
        Half their distance is the natural size of the parameter.

    Raises
    ------
    ValueError
        For an unknown parameter, or a cycle that is none.
    """

    wraps = True
    monitors_read_tangent = False

    def __init__(self, cycle: MapOrbit, parameter: str, bounds=None):
        if not cycle.success:
            raise ValueError(f"the cycle cannot be continued, it is {cycle.status}: {cycle.message}")
        if parameter not in cycle.map.names:
            raise ValueError(f"{cycle.map!r} has no parameter {parameter!r}; there are {', '.join(cycle.map.names)}")
        width = None if bounds is None else 0.5 * abs(float(bounds[1]) - float(bounds[0]))
        size = float(np.abs(cycle.u).max())
        least = 1.0 if len(cycle.map.pieces) == 1 else 1e-9  # square roots have no size of their own
        super().__init__(cycle.u.ravel(), cycle.map.parameters[parameter], scale_u=max(size, least), scale_p=width or None)
        self.map, self.itinerary, self.parameter = cycle.map, cycle.itinerary, parameter
        self.signature = cycle.itinerary
        self._begin()

    def _begin(self):
        monitors = [Monitor(SpecialPointKind.PERIOD_DOUBLING)]
        self._torus = self.map.dimension > 1
        if self._torus:
            monitors.append(Monitor(SpecialPointKind.NEIMARK_SACKER))
        self._bordered = len(self.map.pieces) > 1
        if self._bordered:
            monitors.append(Monitor(SpecialPointKind.GRAZING, BORDER, boundary=True))
        self._apart = self._halves()
        if self._apart is not None:
            monitors.append(Monitor(SpecialPointKind.PERIOD_DOUBLING, MERGES, boundary=True))
        self.monitors = tuple(monitors)

    def _halves(self):
        """Return the unit difference (n d / 2,) of the two halves of a doubled cycle, or None."""
        half = len(self.itinerary) // 2
        if len(self.itinerary) % 2 or self.itinerary[:half] != self.itinerary[half:]:
            return None
        a, b = np.split(self.x0[:-1], 2)
        length = float(np.linalg.norm(a - b))
        return None if length <= 1e-12 * float(np.abs(self.scale[:-1]).max()) else (a - b) / length

    def correct(self, x, tangent, fixed=False):
        """See `Problem.correct`; the determinant is odd in the difference of the halves, whose zero is no crossing but the end."""
        c = super().correct(x, tangent, fixed)
        if c.converged and self._apart is not None:
            apart = -float(c.monitors[-1])
            c.det_sign *= np.copysign(1.0, apart)
            c.det_log -= np.log(max(abs(apart), 1e-300) / (1.0 + abs(apart)))
        return c

    def _at(self, p):
        return self.map.with_parameters(**{self.parameter: float(p)})

    # equations

    def residual(self, u, p):
        """See `Problem.residual`."""
        return cycle_equations(self._at(p), self.itinerary, np.asarray(u, float))[0]

    def jacobian(self, u, p):
        """See `Problem.jacobian`; the derivative in the parameter by differences."""
        step = 7e-4 * max(abs(p), float(self.scale[-1]) if np.isfinite(self.scale[-1]) else 1.0)
        total = np.zeros(len(u))
        for k, weight in ((-2, 1.0), (-1, -8.0), (1, 8.0), (2, -1.0)):
            total += weight * self.residual(u, p + k * step)
        return self.wrapped_jacobian(np.append(u, p), 1.0), total / (12.0 * step)

    def wrapped_jacobian(self, x, mu):
        """See `Problem.wrapped_jacobian`: of the closing point."""
        return cycle_equations(self._at(float(x[-1])), self.itinerary, x[:-1], mu)[1]

    def pencil(self, x) -> np.ndarray:
        """Return the coefficients (d + 1,) of det F_u(mu) as a polynomial in mu, lowest first: its roots are the multipliers."""
        d = self.map.dimension
        system, u = self._at(x[-1]), x[:-1]
        nodes = np.cos(np.pi * np.arange(d + 1) / d) if d > 1 else np.array([-1.0, 1.0])
        values = [np.linalg.det(cycle_equations(system, self.itinerary, u, mu)[1]) for mu in nodes]
        return np.linalg.solve(np.vander(nodes, increasing=True), values)

    def monitor_values(self, u, p, tangent):
        """Return the determinants of flip and torus, regular where a multiplier is infinite, and the border."""
        x = np.append(u, p)
        c = self.pencil(x)
        signs = (-1.0)**np.arange(c.size)
        size = float(np.abs(c).max()) or 1.0
        values = [float(c @ signs) / size]
        if self._torus:
            values.append(self._torus_value(c) / size)
        if self._bordered:
            values.append(self._border(u))
        if self._apart is not None:
            a, b = np.split(np.asarray(u, float), 2)
            values.append(-float(self._apart @ (a - b)) / float(self.scale[0]))
        return np.array(values)

    def _torus_value(self, c):
        """What is zero where the product of two multipliers is 1."""
        if c.size == 3:
            return float(c[2] - c[0])
        mu = np.roots(c[::-1])
        product = np.prod([1.0 - mu[i] * mu[j] for i in range(len(mu)) for j in range(i)])
        return float(np.real(product)) * float(np.abs(c).max())

    def _border(self, u):
        d = self.map.dimension
        scale = float(self.scale[0])
        return max(self.map.pieces[c].inside(u[i * d:(i + 1) * d]) for i, c in enumerate(self.itinerary)) / scale

    def confirm(self, kind, x) -> bool:
        """A torus point needs a complex pair on the circle."""
        if kind is not SpecialPointKind.NEIMARK_SACKER:
            return True
        mu = np.roots(self.pencil(x)[::-1]).astype(complex)
        return bool(np.any((np.abs(mu.imag) > 1e-7) & (np.abs(np.abs(mu) - 1.0) < 1e-6)))

    # other problems

    def family_over(self, name, bounds):
        """Return the same cycle over a second parameter."""
        return MapFamily(self, name, bounds)

    def repeated(self, x, times=2) -> tuple["CycleProblem", np.ndarray]:
        """Return the equations of the cycle run through several times, and their solution."""
        other = self.restarted(np.append(np.tile(x[:-1], times), x[-1]))
        other.itinerary = self.itinerary * times
        other.size = len(x[:-1]) * times
        other.scale = np.append(np.tile(self.scale[:-1], times), self.scale[-1])
        other.signature = other.itinerary
        other._begin()
        return other, other.x0

    def branches(self, point, n_max):
        """Return the doubled cycle at a flip; None for the general rule."""
        if point.kind is SpecialPointKind.GRAZING or point.name == MERGES:
            return ()
        if point.kind is not SpecialPointKind.PERIOD_DOUBLING:
            return None
        x = point.x
        J = self.wrapped_jacobian(x, -1.0) * self.scale[:-1]
        v = np.linalg.svd(J)[2][-1] * self.scale[:-1]
        other, start = self.repeated(x)
        direction = np.concatenate([v, -v, [0.0]])
        tangent = direction / other.scale
        tangent /= np.linalg.norm(tangent)
        for step in OUT:
            c = other.correct(start + step * other.scale * tangent, tangent)
            if c.converged and other._border(c.u) < 0.0 if self._bordered else c.converged:
                cycle = newton(other._at(c.p), other.itinerary, c.u)
                if cycle.success and np.abs(cycle.u - np.roll(cycle.u, len(self.itinerary), axis=0)).max() > 1e-9:
                    return (cycle,)
        return ()

    def same(self, other) -> bool:
        """See `Problem.same`."""
        return self.itinerary == other.itinerary and self.parameter == other.parameter

    # what is shown

    @property
    def measure_names(self):
        """Coordinates of the first point, largest first coordinate, period, stability, multipliers."""
        d = self.map.dimension
        return (*(f"x_{i}" for i in range(d)), "max_0", "period", "stable", *(f"multiplier_{i}" for i in range(d)))

    def measure(self, name, xs):
        """See `Problem.measure`."""
        cycles = [self.solution(x) for x in xs]
        if name == "period":
            return np.full(len(xs), len(self.itinerary))
        if name == "stable":
            return np.array([float(np.abs(c.multipliers).max()) < 1.0 for c in cycles])
        if name == "max_0":
            return np.array([c.points[:, 0].max() for c in cycles])
        if name.startswith("multiplier_"):
            return np.array([c.multipliers[int(name[11:])] for c in cycles])
        return np.array([c.points[0, int(name[2:])] for c in cycles])

    def solution(self, x):
        """Return the cycle at ``x`` (n d + 1,)."""
        system = self._at(x[-1])
        u = np.array(x[:-1], float)
        residual = float(np.abs(cycle_equations(system, self.itinerary, u)[0]).max())
        inside = self._border(u) if self._bordered else -1.0
        status = MapOrbitStatus.CONVERGED if inside <= 1e-11 else MapOrbitStatus.INADMISSIBLE
        return MapOrbit(system, self.itinerary, u.reshape(len(self.itinerary), -1), status, residual)


class MapFamily(Family):
    """A cycle over a second parameter of its map."""

    def __init__(self, problem, name, bounds):
        if name not in problem.map.names or name == problem.parameter:
            raise ValueError(f"{problem.map!r} has no second parameter {name!r}; there are "
                             f"{', '.join(n for n in problem.map.names if n != problem.parameter) or 'none'}")
        value = problem.map.parameters[name]
        width = 0.5 * (bounds[1] - bounds[0])
        super().__init__(problem, name, value, width if np.isfinite(width) else max(1.0, abs(value)), bounds)

    def at(self, value):
        """See `Family.at`."""
        other = self.problem.restarted(self.problem.x0)
        other.map = self.problem.map.with_parameters(**{self.name: float(value)})
        return other

    alone = at
