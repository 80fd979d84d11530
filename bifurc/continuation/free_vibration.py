"""Free vibration without damping along its energy: nonlinear modes as branches (Kerschen, Peeters, Golinval, Vakakis 2009).

The problem is that of an orbit of unknown period with the artificial damping as one unknown more and the energy as the
parameter (`bifurc.orbits.energy`).  Contacts that are reached as the energy grows change the event sequence as on any branch.

Internal resonances are special points: there a pair of multipliers is exp(+-2 pi i p / q), so that a small vibration in another
mode comes back after q periods, the ratio of the two frequencies being a whole number over q.  q = 1 is a fold in energy or a
branch point, which are found as on any branch.
"""
import dataclasses
import math

import numpy as np

from ..checks import checked, number, whole
from ..compose.scene import numbered, scene_of
from ..orbits.autonomous import section, solution
from ..orbits.energy import EnergyEquations, conservative, unfolding_path
from ..orbits.energy import energy as stored
from ..orbits.equilibria.equilibrium import find_equilibrium
from ..orbits.orbit import TOUCH, PeriodicOrbit
from ..orbits.shooting.signature import Signature, sections
from ..system import System
from .kinds import NUMERICAL, ContinuationError, CorrectorStatus, SpecialPointKind, StopReason
from .problem import Corrected, Monitor, Problem
from .shooting import autonomous
from .shooting.problem import OrbitProblem
from .shooting.signature_change import admissible_side
from .tracing import trace

ORDERS = (2, 3, 4, 5)  # of internal resonances that are marked
ON_CIRCLE = 1e-6  # distance of a multiplier from the unit circle
SMALL = 1e-6  # energy of the linear mode from which a nonlinear one starts, as part of the energy asked for
STILL = 1e-4  # scaled extent of an orbit that steps bring no nearer to a state of rest
LOST = 1e-3  # scaled distance from a saddle next to which an orbit is hardly more than rounding
FEW = 0.3  # scaled extent up to which a step may pass a state of rest
ENDED = (StopReason.NO_SUCCESSOR, StopReason.DS_MIN, StopReason.INADMISSIBLE, StopReason.NOT_FINITE, StopReason.SINGULAR)


def energy_problem(orbit: PeriodicOrbit) -> "EnergyProblem":
    """Return the problem that continues a free vibration in its energy.

    Raises
    ------
    ValueError
        A system that does not keep its energy, or an orbit that is no motion of it.
    """
    if not conservative(orbit.system):
        raise ValueError(f"{orbit.system!r} does not keep its energy: its orbits do not form a family along it; trace a parameter")
    if not orbit.success:
        raise ValueError(f"the orbit cannot be continued, it is {orbit.status}: {orbit.message}")
    x = np.concatenate([orbit.unknowns, [0.0, orbit.energy]])
    return EnergyProblem(orbit.system, orbit.sequence, orbit.weights, x)


class EnergyProblem(Problem):
    """Orbits of a conservative system along their energy.

    Parameters
    ----------
    system : System
    sequence : Signature
        With the period unknown.
    weights : ndarray (ns,)
        Natural sizes of the states.
    x0 : ndarray (n + 1,)
        Unknowns of the start (U, unfolding) and the energy.
    """

    errors = NUMERICAL
    parameter = "energy"
    touch = TOUCH  # as of other orbits
    monitors_read_tangent = False

    def __init__(self, system: System, sequence: Signature, weights, x0):
        self.system, self.sequence = system, sequence
        self.scene = scene_of(system)
        self.x0 = np.array(x0, float)
        self.equations = EnergyEquations(system, sequence, weights)
        self.orbits = OrbitProblem(system, unfolding_path(self.scene, system), sequence, weights, self.x0[:-1], 1.0)
        self.weights = self.orbits.weights
        self.size = self.equations.size
        self.scale = np.concatenate([self.orbits.scale[:-1], [1.0, math.nan]])
        self.signature = sequence.text(self.scene)
        self._kept = [k for k, monitor in enumerate(self.orbits.monitors) if monitor.boundary]
        marks = [Monitor(SpecialPointKind.INTERNAL_RESONANCE, f"order {q}") for q in ORDERS] if self.scene.n > 1 else []
        self._marks = len(marks)
        self.monitors = (*(self.orbits.monitors[k] for k in self._kept), *marks)

    def residual(self, u, p):
        """Return the scaled residual (n,)."""
        return self.equations.residual(u, p)

    def jacobian(self, u, p):
        """Return F_u (n, n) and F_p (n,)."""
        slope = np.zeros(self.size)
        slope[-1] = -1.0 / self.equations.unit
        return self.equations.jacobian(u), slope

    def correct(self, x, tangent, fixed=False) -> Corrected:
        """See `Problem.correct`.

        Beyond the state of rest at which a family begins the equations have the same orbits with the other sign of the amplitude,
        or none: what hardly moves is that state.  Next to a homoclinic orbit rounding grows until nothing is known.
        """
        made = super().correct(x, tangent, fixed)
        if made.converged and (self._turned(made.x[:-1]) or autonomous.small(self.orbits, made.x[:-1])
                               or autonomous.homoclinic(self.solution(made.x), LOST)):
            return self._failed(made.x, tangent, CorrectorStatus.INADMISSIBLE, made.iterations, made.residual)
        return made

    def _turned(self, x) -> bool:
        """Whether the orbit at ``x`` (n + 1,) is a small one with its least value on the section in place of its largest."""
        born = self.sequence.clock and not self.sequence.events
        return bool(born and autonomous.extent(self.orbits, x) > 0.0 and autonomous.small(self.orbits, x, FEW))

    def named_end(self, x, reason, message):
        """See `Problem.named_end`: what hardly moves is a state of rest, what hardly comes back a homoclinic orbit."""
        if reason in ENDED and autonomous.small(self.orbits, x[:-1], STILL):
            return StopReason.AT_REST, ""
        if reason in ENDED and autonomous.homoclinic(self.solution(x)):
            return StopReason.HOMOCLINIC, ""
        return reason, message

    def monitor_values(self, u, p, tangent):
        """Return the tests that bound the validity of the event sequence, and those of internal resonances."""
        bounds = self.orbits.monitor_values(u[:-1], u[-1], tangent)[self._kept]
        return np.append(bounds, resonances(self.solution(np.append(u, p)).multipliers)) if self._marks else bounds

    def confirm(self, kind, x) -> bool:
        """Whether a zero of a monitor is what its kind says: a resonance needs a pair on the unit circle."""
        mu = self.solution(x).multipliers if kind is SpecialPointKind.INTERNAL_RESONANCE else np.ones(1)
        return bool(np.isfinite(mu).all() and np.any(np.abs(np.abs(mu) - 1.0) < ON_CIRCLE))

    def null_tangent(self, x) -> np.ndarray:
        """Return a unit null vector of [F_u F_p] in scaled unknowns (n + 1,)."""
        return np.linalg.svd(self.wide_jacobian(x) * self.scale)[2][-1]

    def kind_at(self, monitor, x):
        """Return what a zero of a monitor at ``x`` is."""
        return self.orbits.kind_at(monitor, x[:-1])

    def switch(self, point, monitor):
        """Return (problem, x, tangent) of the event sequence behind a boundary, or why none goes on."""
        change = autonomous.CHANGES.get(monitor.name)
        if monitor.name == autonomous.SHRINKS:  # not small: the section touches the orbit, another one is taken
            change = same_sequence
        found = None if change is None else autonomous.changed(change, self.orbits, point.x[:-1])
        if found is None:
            return None
        signature, inner = found
        new = EnergyProblem(self.system, signature, self.weights, np.append(inner, point.x[-1]))
        new.scale[-1] = self.scale[-1]
        side = admissible_side(new, new.x0)
        return None if side is None else (new, new.x0, side)

    def same(self, other) -> bool:
        """Whether two problems have the same equations and unknowns."""
        return isinstance(other, EnergyProblem) and self.sequence.key == other.sequence.key

    @property
    def measure_names(self) -> tuple[str, ...]:
        """Columns on demand."""
        n = self.scene.n
        return (*(f"{name}_{i}" for i in range(n) for name in ("max", "min", "rms", "h1")), "period", "omega", "n_events", "stable",
                *(f"multiplier_{k}" for k in range(self.scene.ns - 2)))

    def measure(self, name, xs):
        """Return the column ``name`` (m,) for the rows ``xs``."""
        if name == "omega":
            return 2.0 * np.pi / self.orbits.measure("period", xs[:, :-1])
        if name.startswith("multiplier_"):
            return np.array([self.solution(x).multipliers[int(name[11:])] for x in xs])
        if name == "stable":  # of a family that keeps its energy: whether no neighbour departs
            return np.array([self.solution(x).stable is not False for x in xs])
        return self.orbits.measure(name, xs[:, :-1])

    def solution(self, x) -> PeriodicOrbit:
        """Return the orbit at ``x`` (n + 1,)."""
        return PeriodicOrbit(self.system, self.sequence, x[:-2], self.weights, {"method": "event sequence", "energy": float(x[-1])})

    def to_record(self) -> dict:
        """Return a JSON-able description."""
        s = self.sequence
        return {"kind": "free vibration", "system": numbered(self.system), "nodes": s.nodes.tolist(), "fixed": s.fixed.tolist(),
                "closure": s.closure, "clock": s.clock, "weights": self.weights.tolist(), "x0": self.x0.tolist(),
                "scale": float(self.scale[-1])}

    @classmethod
    def from_record(cls, record: dict, elements=()) -> "EnergyProblem":
        """Make the problem that gave ``record``."""
        system = System.from_record(record["system"], elements)
        scene_of(system)
        nodes, fixed = np.array(record["nodes"], np.int64), np.array(record["fixed"])
        signature = Signature(nodes, fixed, 0.0, record["closure"], record["clock"])
        made = cls(system, signature, np.array(record["weights"]), np.array(record["x0"]))
        made.scale[-1] = record["scale"]
        return made


def same_sequence(plain, x):
    """Return signature and unknowns as they are."""
    return plain.sequence, x


def resonances(mu) -> list[float]:
    """Return tests (one an order) that change sign where a pair of multipliers (k,) passes a root of unity of that order.

    With c = (mu + 1 / mu) / 2, the cosine of a pair on the circle, each is the product of c - cos(2 pi p / q) over the pairs and
    over the p that have no factor in common with q.
    """
    if not (np.isfinite(mu).all() and np.all(mu != 0.0)):
        return [math.nan] * len(ORDERS)
    c = np.sort_complex(0.5 * (mu + 1.0 / mu))[::2]  # one of each pair
    tests = []
    for q in ORDERS:
        roots = [math.cos(2.0 * math.pi * p / q) for p in range(1, q // 2 + 1) if math.gcd(p, q) == 1]
        product = 1.0 + 0.0j
        for root in roots:
            for factor in c - root:
                product *= factor / (1.0 + abs(factor))
        tests.append(float(product.real))
    return tests


@checked()
def nonlinear_mode(system: System, mode: int = 0, energy: float = 1.0) -> PeriodicOrbit:
    """Return the free vibration of given energy on the family that begins with a linear mode.

    Parameters
    ----------
    system : System
        Without excitation and damping.
    mode : int
        Of the small vibrations about the state of rest nearest to zero, counted from the lowest frequency.
    energy : float
        Above that of the state of rest, in the unit of `bifurc.energy`, which counts from zero coordinates.

    Returns
    -------
    PeriodicOrbit
        ``trace(orbit, "energy", bounds=...)`` goes on from it.

    Raises
    ------
    ValueError
        A system that does not keep its energy, no state of rest, one on the boundary of a contact (there are no linear modes:
        give `find_orbit` a guess), an energy not above that of rest.

    Examples
    --------
    >>> import bifurc as bf
    >>> system = bf.System(1.0, 0.0, 1.0, [bf.elements.ElasticStop(gap=1.0, stiffness=4.0)])
    >>> round(bf.nonlinear_mode(system, energy=2.0).omega, 6)
    1.170544
    """
    energy, mode = number("nonlinear_mode", "energy", energy), whole("nonlinear_mode", "mode", mode, least=0)
    if not conservative(system):
        raise ValueError(f"{system!r} does not keep its energy; nonlinear modes are those of a conservative system")
    rest = find_equilibrium(system)
    if not rest.success or rest.on_boundary or len(rest.continuum):
        raise ValueError(f"{system!r}: no linear modes to start from. {rest.message}")
    ground = stored(system, rest.state)
    if not energy > ground:
        raise ValueError(f"energy = {energy!r} is not allowed; it must be above that of rest, {ground:.6g}")
    values, vectors = np.linalg.eig(rest._small[0])
    order = [k for k in np.argsort(values.imag) if values[k].imag > 0.0]
    if not mode < len(order):
        raise ValueError(f"mode = {mode!r} is not allowed; about the state of rest there are {len(order)} that oscillate")
    omega, q = float(values[order[mode]].imag), rest._small[1] @ vectors[:, order[mode]]
    start = linear_mode(system, rest, q, omega, SMALL * (energy - ground))
    try:
        branch = trace(start, "energy", bounds=(start.energy, energy), direction=1)
    except (ValueError, ContinuationError) as error:
        raise ContinuationError(f"energy = {energy:g} is too far from rest, or too near: {error}") from error
    last = branch.orbits[-1]
    if abs(last.energy - energy) > 1e-12 * abs(energy):
        raise ContinuationError(f"the family of mode {mode} ends at the energy {last.energy:.6g}: {branch.ends[1]}")
    return last


def linear_mode(system: System, rest, q, omega: float, E: float) -> PeriodicOrbit:
    """Return the orbit on a linear mode (eigenvector ``q`` (ns,), frequency) with a small energy E above that of rest."""
    scene, n = scene_of(system), system.n
    i = int(np.argmax(np.abs(q[:n])))
    q = np.real(q / q[i])  # the coordinate that moves most is at its maximum; under gyroscopic terms others move
    q[n + i] = 0.0
    v, stiffness = q[n:2 * n], -system.mass @ rest.field.jacobian(rest.state)[n:2 * n, :n]
    y = rest.state + q * math.sqrt(2.0 * E / (v @ system.mass @ v + q[:n] @ stiffness @ q[:n]))
    away = float(np.abs(y - rest.state).max()) / math.sqrt(SMALL)  # where the family is asked for
    weights = np.full(scene.ns, max(away, float(np.abs(rest.state).max())) or 1.0)
    weights[n:2 * n] *= omega
    signature = dataclasses.replace(sections(rest.mode, 0.0), fixed=section(scene, i, weights), clock=2.0 * np.pi / omega)
    return solution(system, signature, np.append(1.0, y), weights, {"guess": "linear mode"})
