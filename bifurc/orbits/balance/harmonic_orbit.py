"""A periodic motion found by harmonic balance: coefficients, measures, multipliers, stated error."""
import functools
import math

import numpy as np

from ... import io
from ...checks import checked
from ...content import copy_of, kept
from ...flow.trajectory import Event, Events
from ...hbm.balance import Balance
from ...hbm.condensation.condensed import Condensed
from ...hbm.errors import truncation
from ...hbm.floquet import stability
from ...hbm.layout import Layout
from ...hbm.parts import event_kind
from ...hbm.status import BalanceStatus, ContactStatus
from ...hbm.waves import value
from ...system import System
from ..base import Orbit
from ..multipliers import attracting
from .method import HarmonicBalance

TOLERANCE = 1e-9  # residual over the forces in it, up to which an orbit counts as converged
LARGE_ERROR = 1.0  # stated error over the amplitude from which on the message says so


class HarmonicOrbit(Orbit):
    """A periodic motion in Fourier coefficients.  Made by `find_orbit(method=HarmonicBalance(...))` and by branches.

    Parameters
    ----------
    system : System
    method : HarmonicBalance
    layout : Layout
    coefficients : ndarray (layout.size,)
        Packed, see `hbm.layout.Layout`.
    how : dict, optional
        Method, tolerances, iterations, error estimate.
    status : BalanceStatus, optional
        Of a failure, or that a branch located it where the order of events changes; default: from the residual.

    Attributes
    ----------
    system, method, layout
        As given.
    coefficients : ndarray
    periods : int
        Forcing periods of the motion.
    period : float
        Time.
    how : dict

    Examples
    --------
    >>> import bifurc as bf
    >>> orbit = bf.find_orbit(bf.systems.duffing_oscillator(), method=bf.HarmonicBalance(harmonics=7))
    >>> orbit.success
    True
    """

    _facts = ("signature", "period", "stable", "status", "residual")

    closure = 1
    weights: np.ndarray

    def __init__(self, system: System, method: HarmonicBalance, layout: Layout, coefficients, how: dict | None = None,
                 status: BalanceStatus | None = None, balance: Balance | None = None, like: Condensed | None = None):
        self.system, self.method, self.layout = system, method, layout
        self._x = np.array(coefficients, float)
        self.how = dict(how or {})
        self._failed, self._like = status, like
        if balance is not None:
            self.__dict__["balance"] = balance

    def _content(self) -> tuple:
        return self.system, self.method, self.layout, self._x, self._failed

    # what it is

    @property
    def coefficients(self) -> np.ndarray:
        """Packed Fourier coefficients (layout.size,), a copy."""
        return self._x.copy()

    @functools.cached_property
    def balance(self) -> Balance:
        """The equations it solves."""
        return self.method.balance(self.system, self.layout)

    @functools.cached_property
    def condensed(self) -> Condensed | None:
        """The equations in the touched coordinates alone; None where the whole balance is solved."""
        like = self._like
        if like is not None and like.balance is self.balance:
            return like
        return self.method.condensed(self.balance, like=like)

    @functools.cached_property
    def exact(self) -> Balance:
        """The equations with events found exactly: those of `balance`, or of the same motion taken exactly."""
        return self.balance if self.balance.samples == 0 else Balance(self.system, self.layout, 0, self.balance.law_samples)

    @property
    def periods(self) -> int:
        """Number of forcing periods after which the motion repeats."""
        return self.layout.periods

    @property
    def forcing_period(self) -> float:
        """Period of the excitation, time."""
        period = self.system.period
        assert period is not None  # `balanced` refuses autonomous systems
        return period

    @property
    def period(self) -> float:
        """Period, time."""
        return self.periods * self.forcing_period

    @property
    def rate(self) -> float:
        """Frequency of the slowest harmonic, omega / periods."""
        return 2.0 * math.pi / self.period

    @kept
    def state(self) -> np.ndarray:
        """State (ns,) at phase 0: coordinates, velocities, memory."""
        return self._states(np.zeros(1))[0]

    @functools.cached_property
    def segments(self):
        """Stays of every contact in its modes, see `hbm.balance.Segment`; events are exact."""
        return self.exact.segments(self._x)

    @property
    def signature(self) -> str:
        """Modes of the contacts over a period, in words."""
        words = []
        for contact, own in zip(self.exact.contacts, self.segments, strict=True):
            stays = [str(contact.keys[segment.mode]) for segment in own]
            if len(stays) > 1 and own[0].mode == own[-1].mode:
                stays.pop()
            words.append(f"{contact.name}: {' '.join(stays)}")
        return "; ".join(words) or "no contacts"

    @functools.cached_property
    def events(self) -> Events:
        """Events of one period from phase 0 in order of time: those of the contacts along this motion, found exactly."""
        balance, found = self.exact, []
        shape = balance.parts.shape
        for k, (contact, own) in enumerate(zip(balance.contacts, self.segments, strict=True)):
            for segment in own:
                if segment.guard is None or shape.silent[k, segment.mode, segment.guard]:
                    continue
                guard = balance.guard(k, segment.mode, segment.guard, self._x, segment.memory)
                speed = self.rate * value(shape.waves, guard, segment.stop)[1]
                state = self._states(np.array([segment.stop]))[0]
                found.append(Event(segment.stop / self.rate, contact.name, event_kind(shape, k, segment.mode, segment.guard),
                                   float(speed), state, state))
        return Events(sorted(found, key=lambda event: event.time))

    # what it says of itself

    @functools.cached_property
    def residual(self) -> float:
        """Largest residual of the balance over the largest force in it, dimensionless."""
        if "residual" in self.how and self.balance.parts.held:
            return float(self.how["residual"])
        return relative_residual(self.condensed or self.balance, self._x)

    @property
    def status(self) -> BalanceStatus:
        """How the orbit is to be taken."""
        if self._failed not in (None, BalanceStatus.ON_BOUNDARY):
            return self._failed
        return self._failed or BalanceStatus.CONVERGED if self.residual <= TOLERANCE else BalanceStatus.NOT_CONVERGED

    def _on_boundary(self) -> "HarmonicOrbit":
        """Return the orbit as one where the order of events changes, of which a branch tells."""
        return HarmonicOrbit(self.system, self.method, self.layout, self._x, self.how, BalanceStatus.ON_BOUNDARY,
                             self.__dict__.get("balance"), self._like)

    @property
    def success(self) -> bool:
        """Whether the balance is solved."""
        return self.status in (BalanceStatus.CONVERGED, BalanceStatus.ON_BOUNDARY, BalanceStatus.AT_REST)

    @property
    def message(self) -> str:
        """The status as a sentence, and what else is to be known: friction that holds all contacts, an error as large as the
        motion."""
        words = [self.status.sentence]
        if self.how.get("free"):
            words.append(f"Nothing restores {self.how['free']}: a mean displacement along it changes no force at this motion. Give "
                         "it a spring, or a guess that reaches the contacts that hold it.")
        if self.success and self.status is not BalanceStatus.AT_REST:
            words += [self.how["statement"]] if self.how.get("held") else []
            part = self._relative_error()
            if part >= LARGE_ERROR:
                words.append(f"The stated error is {part:.2g} times the amplitude: this is no picture of the motion; give more "
                             "harmonics, or polish with find_orbit(system, guess=orbit).")
        return " ".join(words)

    def _relative_error(self) -> float:
        """Return the stated error over the amplitude of the coordinate for which it is largest; 0 where none is stated."""
        stated = self.how.get("error")
        if not stated:
            return 0.0
        size = np.abs(self.layout.matrix(self._x)[int(self.layout.mean):]).max(axis=0, initial=0.0)
        return float(np.max(np.asarray(stated) / np.maximum(size, 1e-300)))

    @functools.cached_property
    def _stability(self):
        if not self.success:
            return None, "The orbit is not converged."
        return stability.multipliers(self)

    @property
    def multipliers(self) -> np.ndarray | None:
        """Floquet multipliers (complex, largest first) of the motion with its memory; None where `how` says why not."""
        return copy_of(self._stability[0])

    @property
    def stable(self) -> bool | None:
        """Whether all multipliers lie inside the unit circle; None on it, and where they are not known."""
        found = self.multipliers
        return None if found is None or not np.isfinite(found).all() else attracting(found)

    def error(self) -> np.ndarray | None:
        """Return an estimate (n,) of the largest distance of each coordinate from the true motion; see `hbm.errors`."""
        return None if self.balance.parts.held else truncation(self.balance, self._x, self.condensed)

    # measures

    def _phasor(self, h: float, dof: int) -> complex:
        return self.layout.phasor(self._x, round(h * self.periods), dof)

    def _sampled(self, n: int) -> tuple[np.ndarray, np.ndarray]:
        theta = np.linspace(0.0, 2.0 * np.pi, n)
        return theta / self.rate, self._states(theta)

    def _states(self, theta) -> np.ndarray:
        """Return states (m, ns) at phases ``theta`` (m,) in [0, 2 pi]."""
        q = self.layout.values(self._x, theta)
        v = self.rate * self.layout.values(self.layout.derivative(self._x), theta)
        sizes = [len(element.memory) for element in self.system.elements]
        memory = np.zeros((len(theta), sum(sizes)))
        if any(sizes) and self.exact.contacts:
            first = np.concatenate([[0], np.cumsum(sizes)]).astype(int)
            parts = self.exact.parts
            T, shape = parts.numbers, parts.shape
            c, s, _, _ = self.exact.rows(self._x)
            sine = np.arange(len(shape.waves)) % 2 == 0
            sine[0] = False
            angle = np.multiply.outer(theta, shape.waves)
            basis = np.where(sine, np.sin(angle), np.cos(angle))
            for k, (contact, own) in enumerate(zip(parts.contacts, self.segments, strict=True)):
                U, S = basis @ c[list(contact.rows)].T, basis @ s[list(contact.rows)].T
                E, Q = basis[:, shape.excited], len(contact.rows)
                E = np.concatenate([np.ones((len(theta), 1)), E[:, 1:]], axis=1)
                stops = np.array([segment.stop for segment in own])
                where = np.minimum(np.searchsorted(stops, theta, side="right"), len(own) - 1)
                for n, segment in enumerate(own):
                    here = where == n
                    for i in range(int(shape.memory[k])):
                        out = memory[:, first[contact.element] + i]
                        m = segment.mode
                        if shape.algebraic[k, m, i]:
                            out[here] = (U[here] @ T.ZU[k, m, i, :Q] + S[here] @ T.ZS[k, m, i, :Q] + E[here] @ T.ZH[k, m, i])
                        else:
                            out[here] = segment.memory[i]
        return np.concatenate([q, v, memory], axis=1)

    @checked()
    def maximum(self, dof: int = 0) -> float:
        """Largest value of a coordinate over the period, of the polynomial itself."""
        return self._extremum(dof, 1.0)

    @checked()
    def minimum(self, dof: int = 0) -> float:
        """Smallest value of a coordinate over the period, of the polynomial itself."""
        return -self._extremum(dof, -1.0)

    def _extremum(self, dof: int, sign: float) -> float:
        return largest(self.layout, sign * self.layout.matrix(self._x)[:, self._coordinate(dof)])

    @checked()
    def rms(self, dof: int = 0) -> float:
        """Root mean square of a coordinate over the period."""
        weight = np.where(self.layout.waves == 0, 1.0, 0.5)
        return math.sqrt(float(weight @ self.layout.matrix(self._x)[:, self._coordinate(dof)]**2))

    # files

    def to_record(self) -> tuple[dict, dict]:
        """Return header and arrays for `bifurc.io`."""
        header = {"kind": "harmonic_orbit", "system": self.system.to_record(), "method": self.method.to_record(),
                  "harmonics": list(self.layout.harmonics), "periods": self.periods, "how": self.how,
                  "status": None if self._failed is None else str(self._failed)}
        return header, {"coefficients": self._x}

    @classmethod
    def from_record(cls, header: dict, arrays: dict, elements=()) -> "HarmonicOrbit":
        """Make the orbit that `to_record` described; ``elements`` are user classes and laws."""
        system = System.from_record(header["system"], elements)
        layout = Layout(tuple(header["harmonics"]), system.n, int(header["periods"]))
        io.fitted(arrays, {"coefficients": "finite size"}, size=layout.size)
        status = None if header["status"] is None else BalanceStatus(header["status"])
        return cls(system, HarmonicBalance.from_record(header["method"]), layout, arrays["coefficients"], header["how"], status)

    def __repr__(self):
        harmonics = f"{len(self.layout.harmonics)} harmonics up to {self.layout.top / self.periods:g}"
        return f"HarmonicOrbit({harmonics}, {self.status}, residual {self.residual:.1e})"


def largest(layout: Layout, a) -> float:
    """Return the largest value of the polynomial with coefficients ``a`` (slots,): grid maxima polished by Newton."""
    theta = 2.0 * np.pi * np.arange(16 * layout.top) / (16 * layout.top)
    values = layout.basis(theta) @ a
    top = np.flatnonzero((values >= np.roll(values, 1)) & (values >= np.roll(values, -1)))
    if not top.size:
        return float(values.max())
    t = theta[top[np.argsort(values[top])[-8:]]]
    sine, k = layout.is_sine, layout.waves
    best = float(values.max())
    for _ in range(6):
        angle = np.multiply.outer(t, k)
        co, si = np.cos(angle), np.sin(angle)
        d1 = np.where(sine, k * co, -k * si) @ a
        d2 = np.where(sine, -k * k * si, -k * k * co) @ a
        t = t - np.where(d2 < 0.0, np.clip(d1 / np.where(d2 < 0.0, d2, -1.0), -0.2 / layout.top, 0.2 / layout.top), 0.0)
    return max(best, float((layout.basis(t) @ a).max()))


def relative_residual(balance: Balance | Condensed, x) -> float:
    """Return the largest residual over the largest force in it; infinite where contacts cannot be followed."""
    if isinstance(balance, Condensed):
        return balance.relative_residual(x)
    status, f, wide = balance.linearised(x)
    if status is not ContactStatus.FOLLOWED:
        return math.inf
    load = float(np.abs(balance.numbers.E).max(initial=0.0))
    size = max(float((np.abs(wide[:, :-1]) @ np.abs(x)).max()), load, 1e-300)
    return float(np.abs(f).max()) / size
