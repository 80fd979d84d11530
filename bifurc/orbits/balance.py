"""Harmonic balance: the options, the orbit it finds, and how it finds it."""
import functools
import math
from dataclasses import dataclass

import numpy as np

from .. import io, plotting
from ..compose.scene import refuse_delay
from ..elements.checks import choice, whole
from ..flow.simulate import simulate
from ..flow.trajectory import Event, Events
from ..hbm.balance import Balance
from ..hbm.condensation.condensed import Condensed
from ..hbm.errors import truncation
from ..hbm.floquet import stability
from ..hbm.layout import Layout, listed
from ..hbm.parts import event_kind
from ..hbm.status import BalanceStatus, MarchStatus
from ..hbm.waves import value
from ..notebook import Notebook
from ..solve.broyden import broyden
from ..solve.newton import NewtonStatus, newton
from ..system import System
from .balance_setvalued import set_valued

TOLERANCE = 1e-9  # residual over the forces in it, up to which an orbit counts as converged
SOLVERS = ("newton", "broyden", "galerkin-broyden")
AUTO_FIRST, AUTO_MOST = 7, 161  # harmonics of "auto": first and most
LARGE_ERROR = 1.0  # stated error over the amplitude from which on the message says so
NEUTRAL = 1e-8  # | |multiplier| - 1 | below this: stability is not told
SAMPLES = 1024  # of contacts by default with aft="sampled"; per highest harmonic at least SAMPLES_A_WAVE
SAMPLES_A_WAVE = 16
ALIASING = 1e-12  # relative change of the residual at twice the samples that is none
SCALED = (0.7, 0.5, 0.3, 1.5, 2.0, 0.1, 0.05)  # of the linear response: starts where its own, rest and raised loads lead nowhere
CONDENSED = 200  # unknowns of the whole balance from which on those of the touched rows alone take less time (measured)
FEWER = 0.5  # of the unknowns at most, for the same reason


@dataclass(frozen=True)
class HarmonicBalance:
    """How `find_orbit` balances harmonics.

    Parameters
    ----------
    harmonics : int, sequence, or "auto"
        H: 0 .. H; or the harmonics of the excitation themselves (multiples of 1/periods for an orbit of several forcing
        periods); "auto": added until the estimated error is below `tolerance`.
    aft : {"exact", "sampled"}
        How contacts are taken: their events found and polished and forces integrated in closed form, or at samples.  Force
        laws are always sampled.
    samples : int, optional
        A period.  Default for contacts: 1024, and 16 a shortest wave at least; for laws: 8 a shortest wave and 128 at least,
        which is exact for polynomials up to degree 6, doubled until the residual no longer changes.
    solver : {"newton", "broyden", "galerkin-broyden"}
        Newton with the exact Jacobian; Broyden from it; Li's published method for dry friction (for study).
    tolerance : float
        With "auto": wanted error over the amplitude, dimensionless.
    condense : bool, optional
        Whether orbits and branches are solved in the coordinates that contacts and laws touch, and the others recovered from
        the linear part: the same solutions, in a time that hardly depends on the degrees of freedom.  Default: where it pays;
        `HarmonicOrbit.how` says whether.  Set-valued friction has its own ways and "galerkin-broyden" is as published; for
        them this has no meaning.

    Examples
    --------
    >>> import bifurc as bf
    >>> from bifurc.orbits.balance import HarmonicBalance
    >>> orbit = bf.find_orbit(bf.systems.jenkins_oscillator(), method=HarmonicBalance(7))
    >>> round(abs(orbit.harmonic(1)), 9)
    3.514307059
    """

    harmonics: int | tuple[float, ...] | str = 7
    aft: str = "exact"
    samples: int | None = None
    solver: str = "newton"
    tolerance: float = 1e-4
    condense: bool | None = None

    def __post_init__(self):
        name = type(self).__name__
        choice(name, "condense", self.condense, (None, True, False))
        choice(name, "aft", self.aft, ("exact", "sampled"))
        choice(name, "solver", self.solver, SOLVERS)
        if self.samples is not None:
            object.__setattr__(self, "samples", whole(name, "samples", self.samples, least=3))
        if not (isinstance(self.tolerance, (int, float)) and 0.0 < self.tolerance < 1.0):
            raise ValueError(f"{name}: tolerance = {self.tolerance!r} is not allowed; it must lie between 0 and 1")
        if isinstance(self.harmonics, str):
            choice(name, "harmonics", self.harmonics, ("auto",))
        else:
            listed(self.harmonics, 64)  # for its message; orbits of several periods are asked again with theirs
            if not isinstance(self.harmonics, (int, np.integer)):
                object.__setattr__(self, "harmonics", tuple(float(k) if k % 1 else int(k) for k in self.harmonics))

    def layout(self, n: int, periods: int = 1, first: int = AUTO_FIRST) -> Layout:
        """Return the layout for ``n`` degrees of freedom; "auto" gives harmonics up to ``first``."""
        return Layout(listed(first if self.harmonics == "auto" else self.harmonics, periods), n, periods)

    def balance(self, system: System, layout: Layout, parts=None) -> Balance:
        """Return the equations.

        Raises
        ------
        ValueError
            See `hbm.parts.split`.
        """
        samples = 0
        if self.aft == "sampled":
            samples = self.samples or max(SAMPLES, SAMPLES_A_WAVE * layout.top)
        return Balance(system, layout, samples, self.samples, parts)

    def condensed(self, balance: Balance, like: Condensed | None = None) -> Condensed | None:
        """Return the equations of the touched coordinates alone, `hbm.condensation`; None: the whole balance is to be solved."""
        rows = balance.parts.shape.R
        if self.condense is False or self.solver == "galerkin-broyden" or balance.parts.held or not rows.any():
            return None
        touched = np.count_nonzero(rows.any(axis=1))
        if self.condense is None and (balance.size < CONDENSED or touched > FEWER * balance.layout.n):
            return None
        made = Condensed(balance, like=like)
        return made if made.here.linear.regular else None

    def to_record(self) -> dict:
        """Return the fields, ready for JSON."""
        harmonics = self.harmonics if isinstance(self.harmonics, (int, str)) else list(self.harmonics)
        return {"harmonics": harmonics, "aft": self.aft, "samples": self.samples, "solver": self.solver,
                "tolerance": self.tolerance, "condense": self.condense}

    @classmethod
    def from_record(cls, record: dict) -> "HarmonicBalance":
        """Make the options that gave ``record``."""
        return cls(**{**record, "harmonics": tuple(record["harmonics"]) if isinstance(record["harmonics"], list)
                      else record["harmonics"]})


class HarmonicOrbit(Notebook):
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
        Of a failure; default: told by the residual.

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
    _panels = (1, 2)

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

    @property
    def parameters(self) -> dict:
        """Parameters of the system."""
        return self.system.parameters

    @functools.cached_property
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
        if self._failed is not None:
            return self._failed
        return BalanceStatus.CONVERGED if self.residual <= TOLERANCE else BalanceStatus.NOT_CONVERGED

    @property
    def success(self) -> bool:
        """Whether the balance is solved."""
        return self.status in (BalanceStatus.CONVERGED, BalanceStatus.AT_REST)

    @property
    def message(self) -> str:
        """The status as a sentence, and what else is to be known: friction that holds all contacts, an error as large as the
        motion."""
        words = [self.status.sentence]
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
        return self._stability[0]

    @property
    def stable(self) -> bool | None:
        """Whether all multipliers lie inside the unit circle; None on it, and where they are not known."""
        found = self.multipliers
        if found is None or not np.isfinite(found).all():
            return None
        top = float(np.abs(found).max(initial=0.0))
        return None if abs(top - 1.0) < NEUTRAL else top < 1.0

    def error(self) -> np.ndarray | None:
        """Return an estimate (n,) of the largest distance of each coordinate from the true motion; see `hbm.errors`."""
        return None if self.balance.parts.held else truncation(self.balance, self._x, self.condensed)

    # measures

    def harmonic(self, h: float, dof: int = 0) -> complex:
        """Return a - ib of a cos(h omega t) + b sin(h omega t) in a coordinate; h = 0 gives the mean.

        ``h`` counts forcing frequencies; h times ``periods`` must be whole.  Harmonics that are not balanced are 0.
        """
        self._check(dof)
        if not (math.isfinite(h) and h >= 0.0 and abs(h * self.periods - round(h * self.periods)) < 1e-9):
            raise ValueError(f"harmonic: h = {h!r} is not allowed; h times {self.periods} periods must be a whole number >= 0")
        return self.layout.phasor(self._x, round(h * self.periods), dof)

    def sample(self, n: int = 400) -> tuple[np.ndarray, np.ndarray]:
        """Return times ``t`` (n,) from 0 over one period, both ends included, and states ``y`` (n, ns)."""
        if not (isinstance(n, (int, np.integer)) and n >= 2):
            raise ValueError(f"sample: n = {n!r} is not allowed; it must be a whole number of at least 2")
        theta = np.linspace(0.0, 2.0 * np.pi, int(n))
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
                        if shape.slaved[k, m, i]:
                            out[here] = (U[here] @ T.ZU[k, m, i, :Q] + S[here] @ T.ZS[k, m, i, :Q] + E[here] @ T.ZH[k, m, i])
                        else:
                            out[here] = segment.memory[i]
        return np.concatenate([q, v, memory], axis=1)

    def maximum(self, dof: int = 0) -> float:
        """Largest value of a coordinate over the period, of the polynomial itself."""
        return self._extremum(dof, 1.0)

    def minimum(self, dof: int = 0) -> float:
        """Smallest value of a coordinate over the period, of the polynomial itself."""
        return -self._extremum(dof, -1.0)

    def _extremum(self, dof: int, sign: float) -> float:
        self._check(dof)
        return largest(self.layout, sign * self.layout.matrix(self._x)[:, dof])

    def rms(self, dof: int = 0) -> float:
        """Root mean square of a coordinate over the period."""
        self._check(dof)
        weight = np.where(self.layout.waves == 0, 1.0, 0.5)
        return math.sqrt(float(weight @ self.layout.matrix(self._x)[:, dof]**2))

    def _check(self, dof: int) -> None:
        if not (isinstance(dof, (int, np.integer)) and 0 <= dof < self.layout.n):
            raise ValueError(f"dof = {dof!r} is not allowed; it must be 0 .. {self.layout.n - 1}")

    # files and pictures

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
        status = None if header["status"] is None else BalanceStatus(header["status"])
        return cls(system, HarmonicBalance.from_record(header["method"]), layout, arrays["coefficients"], header["how"], status)

    def save(self, path) -> None:
        """Write the orbit to an npz file."""
        io.write(path, *self.to_record())

    def plot(self, axes=None, names=None):
        """Draw phase plane and time history; return the axes."""
        return plotting.plot_orbit(self, axes, names=names)

    def animate(self, path=None, **options):
        """Return the motion as a matplotlib animation, written to a ``.gif`` when a path is given; see `animate_orbit`."""
        return plotting.animate_orbit(self, path, **options)

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
    if status is not MarchStatus.FOLLOWED:
        return math.inf
    load = float(np.abs(balance.numbers.E).max(initial=0.0))
    size = max(float((np.abs(wide[:, :-1]) @ np.abs(x)).max()), load, 1e-300)
    return float(np.abs(f).max()) / size


# finding

def balanced(system: System, method: HarmonicBalance, guess=None, periods: int | None = None) -> HarmonicOrbit:
    """Return a harmonic orbit of a forced system; the part of `find_orbit` for ``method=HarmonicBalance(...)``.

    Parameters
    ----------
    system : System
    method : HarmonicBalance
    guess : HarmonicOrbit, PeriodicOrbit, array, or None
        An orbit, of other parameters, harmonics or method; a state (2 n,) or (ns,) from which the motion is simulated and
        analysed; packed coefficients (layout.size,); None: the linear response, then the motion at rest, then loads raised
        step by step.
    periods : int, optional
        Forcing periods of the motion; default that of a guessed orbit, or 1.

    Raises
    ------
    ValueError
        Autonomous system, elements that harmonic balance cannot treat, an excitation on a harmonic that is not listed.
    """
    if not isinstance(method, HarmonicBalance):
        raise ValueError(f"method = {method!r} is not allowed; it must be a HarmonicBalance, or None for event-exact shooting")
    if system.period is None:
        raise ValueError(f"{system!r} is autonomous; harmonic balance needs an excitation frequency omega")
    refuse_delay(system)
    count = int(periods or getattr(guess, "periods", None) or 1)
    if method.harmonics == "auto":
        return _grown(system, method, guess, count)
    return _told(_solved(system, method, guess, method.layout(system.n, count)))


def _told(orbit: HarmonicOrbit) -> HarmonicOrbit:
    """Add the estimated error to an orbit that converged."""
    if orbit.success and "error" not in orbit.how and not orbit.balance.parts.held:
        error = orbit.error()
        orbit.how["error"] = None if error is None else [float(value) for value in error]
    return orbit


def _grown(system: System, method: HarmonicBalance, guess, periods: int) -> HarmonicOrbit:
    """Return an orbit with harmonics added until its estimated error is below the tolerance."""
    top, tried = AUTO_FIRST, []
    while True:
        orbit = _told(_solved(system, method, guess, method.layout(system.n, periods, top)))
        tried.append(top)
        if not orbit.success:
            break
        error, guess = orbit.how["error"], orbit
        amplitude = max(np.abs(orbit.layout.matrix(orbit._x)).max(axis=0).max(), 1e-300)
        if error is None or max(error) <= method.tolerance * amplitude or 2 * top > AUTO_MOST:
            break
        top = 2 * top + 1
    orbit.how["harmonics tried"] = tried
    return orbit


def _solved(system: System, method: HarmonicBalance, guess, layout: Layout) -> HarmonicOrbit:
    """Return the orbit for given harmonics, by the solver of the method."""
    balance = method.balance(system, layout)
    starts = _starts(balance, guess)
    if balance.parts.held or method.solver == "galerkin-broyden":
        return _set_valued(balance, method, starts, guess is not None)
    how = {"method": f"harmonic balance, {method.solver}", "harmonics": [k / layout.periods for k in layout.harmonics],
           "aft": method.aft, "tolerance": TOLERANCE}
    if balance.samples:
        how["samples"] = balance.samples
    condensed = method.condensed(balance)
    x, iterations, status = _iterated(condensed or balance, method, starts, guess is None)
    while balance.parts.laws and method.samples is None and status is None:
        finer = Balance(system, layout, balance.samples, 2 * balance.law_samples, balance.parts)
        closer = None if condensed is None else method.condensed(finer, like=condensed)
        change = float(np.abs(_reaction(closer or finer, x) - _reaction(condensed or balance, x)).max())
        if change <= ALIASING * max(float(np.abs(balance.numbers.E).max()), 1e-300) or finer.law_samples > 1 << 14:
            break
        balance, condensed = finer, closer
        x, more, status = _iterated(condensed or balance, method, [x], False)
        iterations += more
    if condensed is not None:
        how["condensed"] = condensing(condensed)
    if balance.parts.laws:
        how["law samples"] = balance.law_samples
        differenced = [law.name for law in balance.parts.laws if law.law.jacobian is None]
        if differenced:
            how["differenced Jacobians"] = differenced
    how["iterations"] = iterations
    return HarmonicOrbit(system, method, layout, x, how, status, balance, condensed)


def condensing(condensed: Condensed) -> str:
    """Return in words what was solved instead of the whole balance."""
    return (f"{condensed.whole.size} unknowns to {condensed.layout.size}, those of the {condensed.layout.n} of {condensed.whole.n} "
            f"coordinates that contacts and laws touch; receptance {condensed.linear.way}")


def _reaction(equations: Balance | Condensed, x) -> np.ndarray:
    """Return what changes with the samples of laws: the forces (size,), for a whole balance with what does not change."""
    return equations.reaction(x) if isinstance(equations, Condensed) else equations.residual(x)


def _starts(balance: Balance, guess) -> list[np.ndarray]:
    """Return packed guesses, in the order in which they are tried."""
    layout = balance.layout
    if guess is None:
        return [balance.linear_response(), np.zeros(layout.size)]
    if hasattr(guess, "layout") and hasattr(guess, "coefficients"):
        return [guess.layout.moved(guess.coefficients, layout)]
    count = max(256, 8 * layout.top)
    if hasattr(guess, "sample"):
        t, y = guess.sample(layout.periods // guess.periods * count + 1 if layout.periods % guess.periods == 0 else count + 1)
        samples = np.tile(y[:-1, :layout.n], (max(layout.periods // guess.periods, 1), 1))
        return [layout.analysis(samples)]
    guess = np.asarray(guess, float)
    if guess.shape == (layout.size,):
        return [guess.copy()]
    n, memory = layout.n, sum(len(element.memory) for element in balance.system.elements)
    if guess.shape in ((2 * n,), (2 * n + memory,)):
        motion = simulate(balance.system, guess, periods=layout.periods)
        period = balance.system.period
        assert period is not None
        return [layout.analysis(motion(np.arange(count) * (layout.periods * period / count))[:, :n])]
    raise ValueError(f"guess has shape {guess.shape}; it must be an orbit, packed coefficients ({layout.size},), or a state "
                     f"({2 * n + memory},)")


def _iterated(equations: Balance | Condensed, method: HarmonicBalance, starts, anywhere: bool):
    """Return coefficients of all coordinates, iterations and None, or the status of the failure."""
    if isinstance(equations, Condensed):
        starts = [equations.restricted(start) for start in starts]
    total, best = 0, starts[0]
    status: BalanceStatus | None = BalanceStatus.NOT_CONVERGED
    for start in starts:
        best, count, failed = _solve(equations, method, start)
        total += count
        if failed is None:
            status = None
            break
        status = failed
    if anywhere and status is not None:
        x, count, failed = _raised(equations, method)
        total += count
        if failed is None:
            best, status = x, None
        for part in SCALED if status is not None else ():  # from where a load cannot be raised: a fold, a corner that turns back
            x, count, failed = _solve(equations, method, part * equations.linear_response())
            total += count
            if failed is None:
                best, status = x, None
                break
    return equations.expand(best) if isinstance(equations, Condensed) else best, total, status


def _solve(equations: Balance | Condensed, method: HarmonicBalance, start):
    """Return unknowns, iterations, and None or the status of the failure, of one run of the solver."""
    scale = max(float(np.abs(start).max()), float(np.abs(equations.linear_response()).max()), 1e-300)
    if method.solver == "broyden":
        found = broyden(equations.residual, start, jacobian=equations.jacobian, scale=scale)
        return found.x, found.iterations, None if found.success else BalanceStatus.NOT_CONVERGED
    result = newton(equations.residual, equations.jacobian, start, scale)
    if result.success or relative_residual(equations, _whole(equations, result.x)) <= TOLERANCE:
        return result.x, result.iterations, None
    failed = {NewtonStatus.SINGULAR: BalanceStatus.SINGULAR, NewtonStatus.NOT_FINITE: BalanceStatus.MARCH_FAILED}
    return result.x, result.iterations, failed.get(result.status, BalanceStatus.NOT_CONVERGED)


def _whole(equations: Balance | Condensed, x) -> np.ndarray:
    """Return the coefficients of all coordinates."""
    return equations.expand(x) if isinstance(equations, Condensed) else x


def _raised(equations: Balance | Condensed, method: HarmonicBalance):
    """Raise the load from a tenth to its value in steps that halve where Newton fails; returns as `_solve`."""
    done, step, total = 0.0, 0.1, 0
    x = np.zeros(equations.size)
    status = BalanceStatus.NOT_CONVERGED
    full = np.zeros(0) if isinstance(equations, Condensed) else equations.numbers.E.copy()

    def load(part: float):
        if isinstance(equations, Condensed):
            equations.load = part
        else:
            equations.numbers.E[:] = part * full

    try:
        while done < 1.0 and step > 1e-3:
            part = min(done + step, 1.0)
            load(part)
            new, count, failed = _solve(equations, method, x if not done else x * part / done)
            total += count
            if failed is None:
                x, done, step = new, part, 1.5 * step
            else:
                step, status = 0.5 * step, failed
    finally:
        load(1.0)
    return x, total, None if done >= 1.0 else status


def _set_valued(balance: Balance, method: HarmonicBalance, starts, guessed: bool) -> HarmonicOrbit:
    """Return the orbit of a system with set-valued friction, or by Li's published method."""
    x, how, status = set_valued(balance, method, starts, guessed)
    return HarmonicOrbit(balance.system, method, balance.layout, x, how, status, balance)
