"""PeriodicOrbit: a closed motion as an event sequence, with its multipliers, its audit and exact measures.

One file, because it is one class with the audit that decides whether its equations are a motion.
"""
import functools
import importlib
import math

import numpy as np

from .. import io
from ..checks import checked
from ..compose.scene import Scene, numbered, scene_of
from ..compose.writer import kernels
from ..content import handed_out, kept
from ..elements import EventKind
from ..flow.settle import displaced
from ..flow.trajectory import Event, Events
from ..system import System
from .base import Orbit
from .energy import EnergyEquations, conservative, energy
from .kinds import OrbitStatus
from .multipliers import attracting, nontrivial
from .repetition import MOST, repetition
from .shooting import sequence
from .shooting.equations import TOLERANCE, Equations
from .shooting.labels import Labels
from .shooting.path import constant_path
from .shooting.refused import Earlier, Refusal, meet_modes
from .shooting.resting import resting_intervals
from .shooting.sequence import AFTER, BEFORE, CLOSES, DIVIDE, GUARD, HELD
from .shooting.signature import Signature, repeated

INSTANT = 1e-12  # periods: impacts this close are simultaneous
DISPUTED = 1e-9  # relative difference of their two derivatives that is none of rounding
CORRECTED = 1e-9  # scaled Newton correction of an orbit whose residual is rounding of forces far larger than its motion
TOUCH = 2e-13  # scaled; an unlisted maximum so far beyond a guard is still a touch
NOTHING = 1e-13  # scaled speed of an impact after which the rest of a complete chattering is rounding, however it ends
LATE = 8.0  # excess up to which a closed complete chattering counts: the error of the closed form is of second order in it


@handed_out("weights")
class PeriodicOrbit(Orbit):
    """A periodic motion y(t + period) = y(t).  Made by `find_orbit`, by branches and by basin maps.

    Parameters
    ----------
    system : System
    sequence : Signature
        Event signature it was solved with; a half-period orbit has ``closure`` -1 there.
    unknowns : ndarray (m (1 + ns),)
        Time (forcing periods; autonomous: units of ``sequence.clock``, the first is the period) and state before the event
        of each node.
    weights : ndarray (ns,)
        Natural sizes of the states.
    how : dict, optional
        Method, tolerances, iterations.
    status : OrbitStatus, optional
        Of a failure; or that a branch located it on a boundary of its event sequence.

    Attributes
    ----------
    system : System
    period, periods
        Period (time) and its number of forcing periods.
    success, status, message
        Whether this is a motion of the system; `OrbitStatus` and its sentence.
    residual : float
        Largest scaled residual of the event-sequence equations, dimensionless.
    admissible : bool
        No segment passes a guard unnoticed and no listed event has negative speed.
    how : dict

    Examples
    --------
    >>> import bifurc as bf
    >>> orbit = bf.find_orbit(bf.systems.impact_oscillator(omega=1.5, amplitude=0.9), guess=(1.0, 0.2))
    >>> orbit.success, orbit.periods, orbit.stable
    (True, 1, True)
    """

    _facts = ("signature", "period", "stable", "status", "residual", "multipliers")
    def __init__(self, system: System, sequence: Signature, unknowns: np.ndarray, weights: np.ndarray,
                 how: dict | None = None, status: OrbitStatus | None = None):
        self.system, self.sequence = system, sequence
        self._unknowns = np.array(unknowns, float)  # handed out as a copy: kernels compile again for read-only arrays
        self.weights = np.array(weights, float)
        self.how = dict(how or {})
        self._failed = status

    def _content(self) -> tuple:
        return self.system, self.sequence.key, self._unknowns, self.weights, self._failed

    def __getstate__(self):
        return {name: self.__dict__[name] for name in ("system", "sequence", "_unknowns", "weights", "how", "_failed")}

    # what it is

    @property
    def scene(self) -> Scene:
        """Modes and tables of the system."""
        return scene_of(self.system)

    @property
    def unknowns(self) -> np.ndarray:
        """Times (forcing periods) and states before the events, (m (1 + ns),)."""
        return self._unknowns.copy()

    @functools.cached_property
    def equations(self) -> Equations:
        """Event-sequence equations at this orbit's parameters."""
        _ = self._earlier  # before the tables are made
        return Equations(self.scene, constant_path(self.scene, self.system), self.sequence, self.weights)

    @functools.cached_property
    def _earlier(self) -> list[Earlier]:
        """Modes that are tried before those of the sequence; with them all modes are met that its checks look at."""
        return meet_modes(self.scene, self.sequence)

    @functools.cached_property
    def _whole(self) -> tuple[Signature, np.ndarray]:
        return repeated(self.scene, self.sequence, self._unknowns)

    @property
    def periods(self) -> int:
        """Number of forcing periods after which the motion repeats; 1 for an autonomous orbit."""
        return 1 if self.autonomous else round(self._whole[0].span)

    @property
    def autonomous(self) -> bool:
        """Whether the period is part of the solution, and the phase free: no excitation gives them."""
        return self.sequence.clock > 0.0

    @property
    def forcing_period(self) -> float:
        """Period of the excitation, time; the unit of time of an autonomous orbit."""
        period = self.sequence.clock or self.system.period
        assert period is not None  # an orbit without a forcing period has a clock
        return period

    @property
    def period(self) -> float:
        """Period, time."""
        return (self._whole[0].span if self.autonomous else self.periods) * self.forcing_period

    @property
    def omega(self) -> float:
        """Angular frequency 2 pi / period of the orbit."""
        return 2.0 * math.pi / self.period

    @property
    def closure(self) -> int:
        """-1 when y(t + period/2) = -y(t) was used to solve it, otherwise 1."""
        return self.sequence.closure

    @property
    def signature(self) -> str:
        """Events of a period in words."""
        return self.sequence.text(self.scene)

    @kept
    def state(self) -> np.ndarray:
        """State (ns,) at phase 0, after the event if one falls there."""
        return self._states(np.zeros(1))[0]

    @property
    def mode(self) -> tuple:
        """Modes of all elements at `state`, which a state alone does not tell where there is hysteresis: `simulate` takes them."""
        whole, U = self._whole
        return self.scene.keys[int(self._modes(self._wrapped(np.zeros(1)), whole, U)[0])]

    @functools.cached_property
    def events(self) -> Events:
        """Events of one period from phase 0, in order of time."""
        whole, U = self._whole
        rows = U.reshape(len(whole.nodes), -1)
        scene, period, found = self.scene, self.forcing_period, []
        T = self.equations.path.tables
        x, f, dw = np.empty(T.A.shape[2]), np.empty(scene.ns), np.empty(scene.nw)
        row = np.empty(x.size)
        P = np.empty((scene.ns, x.size))
        engine, motion = self.equations.kernel, self.equations.motion
        for i, (node, values) in enumerate(zip(whole.nodes.tolist(), rows, strict=True)):
            if node[GUARD] < 0:
                continue
            tau = values[0] % whole.span
            if whole.span - tau < 1e-14:
                tau = 0.0
            x[:scene.ns] = values[1:]
            engine.forcing(T, tau * period, x)
            engine.field(T, node[BEFORE], x, f)
            engine.forcing_rate(T, x, dw)
            engine.guard_gradient(T, node[BEFORE], node[GUARD], x, row)
            speed = float(engine.guard_rate(row, f, dw))
            kind, ratio, end = scene.event_kind(node[BEFORE], node[GUARD], node[AFTER]), None, None
            if node[CLOSES] == 1:  # the rest of a complete chattering, as one entry
                _, left = closure_of(scene)(T, node[BEFORE], node[GUARD], x, speed, np.empty(x.size))
                kind, end = EventKind.CHATTER, float(tau * period + left)
                ratio = float(T.ratio[node[BEFORE], node[GUARD]])
            motion.start_of(T, whole.nodes, U, i, P, x)
            left, entered = scene.shown(np.array([node[BEFORE], node[AFTER]]), np.array((values[1:], x[:scene.ns])),
                                        np.full(2, tau * period))
            found.append(Event(float(tau * period), scene.element_name(node[BEFORE], node[GUARD]), kind, speed, left, entered,
                               ratio, end, scene.keys[node[BEFORE]], scene.keys[node[AFTER]]))
        return Events(sorted(found, key=lambda event: event.time))

    # what it says of itself

    @functools.cached_property
    def residual(self) -> float:
        """Largest scaled residual, dimensionless."""
        return float(np.abs(self.equations.residual(np.append(self._unknowns, 0.0))).max())

    @functools.cached_property
    def _correction(self) -> float:
        """Largest scaled Newton correction, or residual where that is more; infinite where there is none.

        Near a fold, where a multiplier is 1, rounding of the forces moves an orbit farther, by 1 / |multiplier - 1|: that
        much is not held against it.
        """
        x, scale = np.append(self._unknowns, 0.0), self.equations.scale[:-1]
        residual = self.equations.residual(x)
        if not np.isfinite(residual).all():
            return math.inf
        try:
            step = np.abs(np.linalg.solve(self.equations.jacobian(x) * scale, -residual)).max()
        except np.linalg.LinAlgError:
            return math.inf
        near = np.min(np.abs(self.multipliers - 1.0), initial=1.0)  # at most 1; NaN where multipliers are not defined
        return float(max(step * near, self.residual)) if np.isfinite(near) else float(step)

    @functools.cached_property
    def _audit(self) -> tuple[float, float, float, float]:
        (s, U), info = self.sequence.written_out(self._unknowns), np.zeros(sequence.INFO)
        self.equations.kernel.monitor(self.equations.path.tables, s.nodes, s.fixed, s.span, self.equations.closure,
                                      U, self.weights, info)
        listed, peak, leaving, broken = info[[sequence.LISTED, sequence.PEAK, sequence.LEAVING, sequence.BROKEN]].tolist()
        at = int(info[sequence.LISTED_AT])
        if at >= 0 and s.nodes[at, CLOSES] == 2:  # in a flight of a chattering: measured by that, but known in periods
            times = U[::1 + self.scene.ns]
            listed *= times[(at + 1) % len(times)] + (s.span if at + 1 == len(times) else 0.0) - times[at - 1] + (
                0.0 if at else s.span)
        refusal = Refusal(self.equations, self._earlier, 0.0)
        return listed, peak, max(leaving, refusal.worst(np.append(self._unknowns, 0.0))), broken

    @property
    def _ordered(self) -> bool:
        """Whether no event comes before the one it is listed after: impacts have flights of negative duration as roots."""
        s, U = self.sequence.written_out(self._unknowns)
        times = U[::len(U) // len(s.nodes)]
        return bool((np.diff(np.append(times, times[0] + s.span)) >= -TOUCH).all())

    @functools.cached_property
    def admissible(self) -> bool:
        """Whether every segment was found free of unlisted events, every listed event arrives, what a mode holds is at rest on
        its surface where the mode begins, and complete chatterings are closed below their threshold."""
        listed, peak, leaving, broken = self._audit
        return (listed >= -TOUCH and max(peak, leaving) <= TOUCH and broken <= HELD and self._ordered
                and self.closing_excess <= LATE and self._continuous)

    @property
    def _continuous(self) -> bool:
        """Whether memory that begins to follow local values had the value that they give it: sliders begin to slip at their limits.

        Of several modes that may follow an event a sequence can list one in which more of them slip.
        """
        scene, nodes = self.scene, self.sequence.nodes[:, :DIVIDE]
        if scene.ns == 2 * scene.n:
            return True
        rows = self._unknowns.reshape(len(nodes), -1)
        times = rows[:, 0] * self.forcing_period
        states = np.hstack([scene.shown(nodes[:, BEFORE], rows[:, 1:], times), scene.forcing(times)])
        follows = {mode: {place for place, _ in scene.algebraic(mode)} for mode in set(nodes[:, [BEFORE, AFTER]].ravel().tolist())}
        return not any(guard >= 0 and follows[after] - follows[before] and displaced(scene, after, x, HELD)
                       for (before, guard, after), x in zip(nodes.tolist(), states, strict=True))

    @functools.cached_property
    def closing_excess(self) -> float:
        """Largest excess of the complete chatterings that are closed, see `flow.chatter.closure`: at most 1 where the
        simulation closes them; 0 without any, or where all that is left is rounding."""
        s, T, worst = self.sequence, self.equations.path.tables, 0.0
        kernel, rows = self.equations.kernel, self._unknowns.reshape(len(self.sequence.nodes), -1)
        for node, values in zip(s.nodes.tolist(), rows, strict=True):
            m, g = node[BEFORE], node[GUARD]
            if node[CLOSES] != 1 or T.ratio[m, g] == 0.0:
                continue
            x = np.empty(T.A.shape[2])
            f, dw, row = np.empty(self.scene.ns), np.empty(self.scene.nw), np.empty(x.size)
            x[:self.scene.ns] = values[1:]
            kernel.forcing(T, values[0] * self.forcing_period, x)
            kernel.field(T, m, x, f)
            kernel.forcing_rate(T, x, dw)
            kernel.guard_gradient(T, m, g, x, row)
            speed = float(kernel.guard_rate(row, f, dw))
            if np.abs(T.B[m, g] * speed / self.weights).max() <= NOTHING:
                continue
            worst = max(worst, float(closure_of(self.scene)(T, m, g, x, speed, np.empty(x.size))[0]))
        return worst

    @property
    def status(self) -> OrbitStatus:
        """How the orbit is to be taken."""
        if self._failed not in (None, OrbitStatus.ON_BOUNDARY):
            return self._failed
        if not (self.residual <= 50.0 * TOLERANCE or self._correction <= CORRECTED):
            return OrbitStatus.NOT_CONVERGED
        if self.admissible or self._failed is not None and self._repeated:
            return self._failed or OrbitStatus.CONVERGED
        return OrbitStatus.INADMISSIBLE

    @functools.cached_property
    def _repeated(self) -> bool:
        """Whether simulation repeats the orbit: on a boundary rounding decides on which side of it the guards lie."""
        again = repetition(self)
        return again.repeated and again.miss <= MOST

    def _on_boundary(self) -> "PeriodicOrbit":
        """Return the orbit as one that lies on a boundary of its event sequence, of which a branch tells."""
        return PeriodicOrbit(self.system, self.sequence, self._unknowns, self.weights, self.how, OrbitStatus.ON_BOUNDARY)

    @property
    def success(self) -> bool:
        """Converged and admissible, or a motion on a boundary of its event sequence."""
        return self.status in (OrbitStatus.CONVERGED, OrbitStatus.ON_BOUNDARY)

    @property
    def message(self) -> str:
        """The status as a sentence, and whether simultaneous impacts leave the multipliers undefined."""
        if self.success and self._disputed is not None:
            names = " and ".join(repr(name) for name in self._disputed)
            return (f"{self.status.sentence} The impacts of {names} are simultaneous and their two orders have different "
                    "derivatives: multipliers are not unique (NaN) and stability is not known. Orbits nearby, with one "
                    "gap slightly changed, have them.")
        if self.success and self.intervals:
            free = self.labels.names(self.scene.n, self.system.states)
            named = [f"{name} in [{low:.6g}, {high:.6g}]" for name, (low, high) in zip(free, self.intervals.values(), strict=True)]
            return f"{self.status.sentence} It is one of a family without events: {', '.join(named)}."
        if self.status is OrbitStatus.INADMISSIBLE and self._audit[3] > HELD:
            return f"{self.status.sentence} A row is held from where it is not at rest on its surface."
        if "simulation" in self.how:
            return f"{self.status.sentence} The simulation ended early: {self.how['simulation']}"
        return self.status.sentence

    @functools.cached_property
    def _disputed(self) -> tuple[str, str] | None:
        """Elements whose simultaneous impacts have no derivative that both orders share, or None."""
        whole, U = self._whole
        nodes, rows = whole.nodes.tolist(), U.reshape(len(whole.nodes), -1)
        scene, T = self.scene, self.equations.path.tables
        for i, node in enumerate(nodes):
            other = nodes[i - 1]
            apart = (rows[i][0] - rows[i - 1][0]) % whole.span
            if len(nodes) < 2 or min(apart, whole.span - apart) > INSTANT or min(node[GUARD], other[GUARD]) < 0 \
                    or not (node[BEFORE] == other[BEFORE] == node[AFTER] and node[GUARD] != other[GUARD]):
                continue
            mode, first, second = other[BEFORE], other[GUARD], node[GUARD]
            if T.kick[mode, first] and T.kick[mode, second]:
                x = np.empty(T.A.shape[2])
                x[:scene.ns] = rows[i - 1][1:]
                self.equations.kernel.forcing(T, rows[i - 1][0] * self.forcing_period, x)
                if _order_gap(scene)(scene, mode, first, second, x) > DISPUTED:
                    return scene.element_name(mode, first), scene.element_name(mode, second)
        return None

    @kept
    def monodromy(self) -> np.ndarray:
        """Derivative of the period map just before the first listed event (ns, ns).

        Memory that follows the motion there has the row that it follows, and a column of zeros: nothing is left of what it was.
        """
        whole, U = self._whole
        M = np.empty((self.scene.ns, self.scene.ns))
        motion = self.equations.motion
        motion.monodromy(self.equations.path.tables, whole.nodes, whole.span, U, M)
        return self._followed @ M

    @functools.cached_property
    def _followed(self) -> np.ndarray:
        """Changes (ns, ns) just before the first listed event: memory that follows the motion there changes with it."""
        R = np.eye(self.scene.ns)
        for place, row in self.scene.algebraic(int(self._whole[0].nodes[0, BEFORE])):
            R[place] = row[:self.scene.ns]
        return R

    @functools.cached_property
    def _energy_gradient(self) -> np.ndarray | None:
        """Derivative (ns,) of the energy just before the first node, where the motion keeps its energy."""
        if not self.autonomous or not conservative(self.system):
            return None
        return EnergyEquations(self.system, self.sequence, self.weights).gradient(self._unknowns[1:1 + self.scene.ns])

    @property
    def energy(self) -> float:
        """Energy of a free vibration that keeps it, see `bifurc.energy`."""
        return energy(self.system, self._unknowns[1:1 + self.scene.ns])

    @functools.cached_property
    def family(self) -> list[int]:
        """States (indices) that nothing changes in a period: the orbit is one of a family that they label.

        Where masses stick to each other the distance between them labels it; then the first of their coordinates that counts most
        in it stands for it.
        """
        return list(self.labels.places)

    @functools.cached_property
    def labels(self) -> Labels:
        """What the states of `family` stand for, as rows of all states."""
        return self._whole[0].labels(self.scene)

    @functools.cached_property
    def intervals(self) -> dict[int, tuple[float, float]]:
        """For every state of `family` the values (least, largest) with which the motion still has no event.

        A mass that sticks all the time may rest anywhere in an interval, a slider that never slips stand anywhere.  Of masses that
        stick to each other the value is that of the first, less what the others make of it: their distance.  Empty for orbits with
        events.
        """
        return {} if self.sequence.events or not self.family or not self.success else resting_intervals(self)

    @kept
    def multipliers(self) -> np.ndarray:
        """Floquet multipliers, complex, largest modulus first; infinite at zero impact speed, NaN where two simultaneous
        kicks have no common derivative (`message` says so).

        There is one a state, less those that nothing changes in a period (memory never written, coordinates that stick all
        the time): such a state labels the orbits of a family, its multiplier 1 says nothing of stability.  An autonomous
        orbit has one less: the multiplier 1 of a shift of its phase is left out as well; where the energy is kept, that of a
        change of energy, too.
        """
        whole, U = self._whole
        found = nontrivial(self.equations, whole, U, self.monodromy, self.labels, self._energy_gradient)
        return np.full(len(found), complex(np.nan)) if self._disputed is not None else found

    @property
    def stable(self) -> bool | None:
        """Whether all multipliers lie inside the unit circle; None on it, or for a failed orbit."""
        if not self.success or self._disputed is not None:
            return None
        told = attracting(self.multipliers)
        return None if told and self._energy_gradient is not None else told  # a motion that keeps its energy attracts nothing

    # measures

    def _sampled(self, n: int) -> tuple[np.ndarray, np.ndarray]:
        """Exact states."""
        tau = np.linspace(0.0, self._whole[0].span, n)
        return tau * self.forcing_period, self._states(tau)

    def _states(self, tau) -> np.ndarray:
        whole, U = self._whole
        wrapped = self._wrapped(tau)
        order = np.argsort(wrapped, kind="stable")
        out = np.empty((len(wrapped), self.scene.ns))
        self.equations.motion.states(self.equations.path.tables, whole.nodes, whole.span, U, wrapped[order], out)
        self._show(out, wrapped[order], whole, U)
        found = np.empty_like(out)
        found[order] = out
        return found

    def _show(self, states, tau, whole, U) -> None:
        """Write memory that follows local values into the states (k, ns) at the times ``tau`` (k,), periods."""
        scene = self.scene
        if scene.ns > 2 * scene.n:
            states[:] = scene.shown(self._modes(tau, whole, U), states, tau * self.forcing_period)

    def _wrapped(self, tau) -> np.ndarray:
        """Return times, periods, as those behind the first event."""
        whole, U = self._whole
        wrapped = U[0] + np.mod(np.asarray(tau, float) - U[0], whole.span)
        wrapped[np.abs(wrapped - U[0] - whole.span) < 1e-14] = U[0]
        return wrapped

    def _modes(self, tau, whole, U) -> np.ndarray:
        """Return the modes at times ``tau`` (k,) behind the first event, periods."""
        return whole.nodes[np.searchsorted(U[::1 + self.scene.ns], tau, side="right") - 1, AFTER]

    def _measure(self, dof: int, h: float) -> np.ndarray:
        """Return largest and smallest value, mean square, and the parts of harmonic ``h`` (an own period each) of a coordinate."""
        (whole, U), out = self._whole, np.empty(5)
        self.equations.motion.measures(self.equations.path.tables, whole.nodes, whole.span, U, self._coordinate(dof), float(h), out)
        return out

    @checked()
    def maximum(self, dof: int = 0) -> float:
        """Largest value of a coordinate over the period, exact."""
        return float(self._measure(dof, 0.0)[0])

    @checked()
    def minimum(self, dof: int = 0) -> float:
        """Smallest value of a coordinate over the period, exact."""
        return float(self._measure(dof, 0.0)[1])

    @checked()
    def rms(self, dof: int = 0) -> float:
        """Root mean square of a coordinate over the period."""
        return math.sqrt(self._measure(dof, 0.0)[2])

    def _phasor(self, h: float, dof: int) -> complex:
        out = self._measure(dof, h / self._whole[0].span if self.autonomous else h)
        return complex(out[3], -out[4])

    @checked()
    def certify(self, precision: int | None = None):
        """Prove the orbit in ball arithmetic: that it exists, is unique nearby, passes no guard unnoticed, and is stable or not.

        Everything is computed anew from the numbers of the system.  Needs the extra ``certify`` (python-flint).

        Parameters
        ----------
        precision : int, optional
            Bits, at least 64; None: 96, and twice that where a verdict stays open.

        Returns
        -------
        bifurc.certify.Certificate

        Examples
        --------
        >>> import bifurc as bf
        >>> orbit = bf.find_orbit(bf.systems.impact_oscillator(omega=0.8))
        >>> certificate = orbit.certify()                                      # doctest: +SKIP
        >>> certificate.proved, certificate.stable                             # doctest: +SKIP
        (True, <Verdict.PROVED: 'proved'>)
        """
        return importlib.import_module("bifurc.certify").certify_orbit(self, precision)

    # files

    def to_record(self) -> tuple[dict, dict]:
        """Return header and arrays for `bifurc.io`."""
        s = self.sequence
        header = {"kind": "orbit", "system": numbered(self.system), "span": s.span, "closure": s.closure, "clock": s.clock,
                  "how": self.how, "status": None if self._failed is None else str(self._failed)}
        return header, {"nodes": s.nodes, "fixed": s.fixed, "unknowns": self._unknowns, "weights": self.weights}

    @classmethod
    def from_record(cls, header: dict, arrays: dict, elements=()) -> "PeriodicOrbit":
        """Make the orbit that `to_record` described; ``elements`` are user classes and laws."""
        system = System.from_record(header["system"], elements)
        scene = scene_of(system)
        io.fitted(arrays, {"nodes": "whole m *", "fixed": "finite *", "weights": "finite ns"}, ns=scene.ns)
        io.fitted(arrays, {"unknowns": "finite size"}, size=len(arrays["nodes"]) * (1 + scene.ns))
        known = arrays["nodes"][:, [BEFORE, AFTER]]
        if not ((known >= 0) & (known < len(scene.keys))).all():
            raise ValueError(f"array 'nodes' names modes that the system has not; it has {len(scene.keys)}")
        signature = Signature(arrays["nodes"].astype(np.int64), arrays["fixed"], float(header["span"]),
                              int(header["closure"]), float(header.get("clock", 0.0)))
        status = None if header["status"] is None else OrbitStatus(header["status"])
        return cls(system, signature, arrays["unknowns"], arrays["weights"], header["how"], status)

    def __repr__(self):
        stable = {True: "stable", False: "unstable", None: "stability unknown"}[self.stable]
        return f"PeriodicOrbit({self.signature}, {stable}, {self.status}, residual {self.residual:.1e})"


def closure_of(scene: Scene):
    """Return the kernel that gives excess and duration of the rest of a complete chattering, see `flow.chatter.closure`."""
    return kernels(scene, "bifurc.flow.chatter").closure


def _order_gap(scene: Scene):
    """Return the function that compares the two orders of simultaneous impacts."""
    return kernels(scene, "bifurc.flow.saltation").order_gap
