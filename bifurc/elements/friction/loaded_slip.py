"""Micro-slip bar or ring under normal loads that vary with time: every contact sticks, slips or is apart on its own.

A load that varies lets contacts stop and separate in any order (specs: a slipping contact then feels the rate of its own
limit), so that no parallel set is equal to the chain.  The blocks have no mass: in every mode their places are affine in
drive, memory and loads.  After an event the statuses follow from the rates of all contacts together, a monotone problem.
"""
import dataclasses
import functools
import itertools
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...checks import number, vector, whole
from ..kinds import EventKind
from ..local import Affine, affine, rate, s, u, wave
from ..mode import Algebraic, Guard, Mode
from .microslip import along, chain_stiffness
from .sliders import Sliders

STUCK, UP, DOWN, APART = "s", "+", "-", "a"
CLOSE = 1e-11  # of the sizes met: what differs by less is equal at an event
TIES = 6  # contacts whose next status only the second rate decides: up to so many are tried in all combinations


@dataclass(frozen=True)
class LoadedMicroSlip(Sliders):
    """Elastic bar or ring on elastic sliders whose limits vary, limit_i (1 + amplitude_i cos(harmonic omega t + phase_i)).

    Driven at its first block as `MicroSlip`; a contact is apart while its limit is negative.  A mode is a word with one
    letter a contact: "s" sticks, "+" and "-" slip, "a" is apart.  The memory holds where each contact grips.

    Parameters
    ----------
    spring : float
        Between neighbours, force per length, above 0.
    contact : float
        Tangential stiffness of each contact, force per length, above 0.
    limits : sequence of float
        Mean limit of each contact (mu times its mean normal load), at least 0.
    load_amplitudes : sequence of float
        One a contact, relative to the mean, dimensionless; above 1 the contact separates.
    load_phases : sequence of float, optional
        One a contact, radians; None: zeros.
    load_harmonic : int
        Multiple of the excitation frequency, at least 1.
    closed : bool
        A ring: the last block is joined to the first.
    dof, row
        What drives the first block, see `AtRow`.

    References
    ----------
    Zhao & Lin, J. NUDT 37 (2015), sections 2 and 3, with the rate of the limit that its eq. (3) leaves out.
    """

    spring: float = 1.0
    contact: float = 1.0
    limits: tuple[float, ...] = (1.0,)
    load_amplitudes: tuple[float, ...] = (0.5,)
    load_phases: tuple[float, ...] | None = None
    load_harmonic: int = 1
    closed: bool = False

    tuples: ClassVar[dict[str, dict[str, float]]] = {"limits": {"least": 0.0}, "load_amplitudes": {}, "load_phases": {}}
    each = "contact"

    def __post_init__(self):
        if self.load_phases is None:
            object.__setattr__(self, "load_phases", (0.0,) * len(vector(type(self).__name__, "limits", self.limits)))
        super().__post_init__()
        name = type(self).__name__
        number(name, "spring", self.spring, above=0.0)
        number(name, "contact", self.contact, above=0.0)
        object.__setattr__(self, "load_harmonic", whole(name, "load_harmonic", self.load_harmonic, least=1))
        for field in self.tuples:
            if len(getattr(self, field)) != self.count:
                raise self.no_list(field)

    @property
    def harmonics(self):
        """That of the loads."""
        return (self.load_harmonic,)

    @property
    def structure(self):
        """Class, place, number of contacts."""
        return (type(self), self.dof, self.row, self.count, self.load_harmonic, self.closed)

    @functools.cached_property
    def limit(self) -> tuple[Affine, ...]:
        """Limits as functions of time; negative: apart."""
        phases = self.load_phases or (0.0,) * self.count
        return tuple(affine(mean) + wave(mean * amplitude, self.load_harmonic, phase) for mean, amplitude, phase in
                     zip(self.limits, self.load_amplitudes, phases, strict=True))

    @functools.cached_property
    def start(self):
        """All contacts stick but those that are apart: one word for every time of the period."""
        limits = np.array(self.limits)
        turn = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False)
        loads = 1.0 + np.multiply.outer(np.ones(turn.size), self.load_amplitudes) * np.cos(np.add.outer(turn, self.load_phases))
        words = ("".join(APART if low else STUCK for low in row) for row in (loads < 0.0) | (limits == 0.0))
        return tuple(dict.fromkeys(words))

    def statics(self, key: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return places x = drive u + held w + pushed f for a word: shapes (n,), (n, n), (n, n); f of those that slip."""
        n, k = self.count, self.contact
        K = chain_stiffness(n, self.spring, self.closed)
        stuck = np.array([letter == STUCK for letter in key], float)
        drive, held, pushed = np.ones(n), np.zeros((n, n)), np.zeros((n, n))
        flexible = along(np.diagonal(K)[1:] + k * stuck[1:], -self.spring, np.eye(n - 1))
        drive[1:] = -flexible @ K[1:, 0]
        held[1:, 1:] = flexible * (k * stuck[1:])
        pushed[1:, 1:] = -flexible
        return drive, held, pushed

    def mode(self, key, core):
        """Return the mode of a word."""
        n, k = self.count, self.contact
        drive, held, pushed = self.statics(key)
        signs = [{UP: 1.0, DOWN: -1.0}.get(letter, 0.0) for letter in key]
        rates = [rate(limit, core.omega) for limit in self.limit]

        def place(i, moved, grips, limits):
            terms = sum((pushed[i, j] * signs[j] * limits[j] for j in range(n) if signs[j]), affine(0.0))
            held_terms = {("z", j): float(held[i, j]) for j in range(n) if grips and key[j] == STUCK}
            return float(drive[i]) * moved + terms + Affine(held_terms)

        x = [place(i, u(0), True, self.limit) for i in range(n)]
        dx = [place(i, s(0), False, rates) for i in range(n)]
        spring = [k * (x[i] - Affine({("z", i): 1.0})) for i in range(n)]
        carried = [spring[i] if key[i] == STUCK else signs[i] * self.limit[i] if signs[i] else affine(0.0) for i in range(n)]
        force = carried[0]
        K = chain_stiffness(n, self.spring, self.closed)
        for j in range(n):
            if K[0, j]:
                force = force + K[0, j] * x[j]
        guards, memory = [], []
        for i, letter in enumerate(key):
            then = _Then(self, key, core.omega, tuple(carried), i)
            if letter == APART:
                memory.append(Algebraic(x[i]) if self.limits[i] > 0.0 else None)  # without a limit there is no contact
                if self.limits[i] > 0.0:
                    guards.append(Guard(self.limit[i], EventKind.CONTACT, then))
                continue
            if letter == STUCK:
                memory.append(None)
                guards += [Guard(way * spring[i] - self.limit[i], EventKind.SLIP, then) for way in (1.0, -1.0)]
            else:
                memory.append(Algebraic(x[i] - (signs[i] / k) * self.limit[i]))
                guards.append(Guard(rates[i] / k - signs[i] * dx[i], EventKind.STICK, then))
            guards.append(Guard(-self.limit[i], EventKind.SEPARATION, then))
        return Mode(force=(-force,), memory=tuple(memory), guards=tuple(guards))

    def loaded(self, key, slider: int) -> bool:
        """Return whether a slider carries a normal load in a mode."""
        return key[slider] != APART

    def mirrored(self):
        """Its own image but for the phase of the loads."""
        if self.load_harmonic % 2 == 0:
            return self
        return dataclasses.replace(self, load_amplitudes=tuple(0.0 - a for a in self.load_amplitudes))

    def mirrored_key(self, key):
        """Slip turns round."""
        return key.translate(str.maketrans("+-", "-+"))

    def mirrored_guard(self, key, guard):
        """The two limits of every stuck contact change places."""
        first = 0
        for i, letter in enumerate(key):
            size = {STUCK: 3, APART: int(self.limits[i] > 0.0)}.get(letter, 2)
            if first <= guard < first + size:
                inside = guard - first
                return first + 1 - inside if letter == STUCK and inside < 2 else guard
            first += size
        raise IndexError(guard)


@dataclass(frozen=True)
class _Then:
    """What follows an event of a word: statuses of all contacts from their rates, then the ties the second rate decides."""

    chain: LoadedMicroSlip
    key: str
    omega: float
    carried: tuple[Affine, ...]
    fired: int  # contact

    def __call__(self, value) -> tuple[str, ...]:
        """Return words in the order they are tried.

        Parameters
        ----------
        value : callable
            ``value(expression)`` is the value of an `Affine` expression of the element at the event.
        """
        chain = self.chain
        n, k = chain.count, chain.contact
        limits = np.array([value(limit) for limit in chain.limit])
        rates = np.array([value(rate(limit, self.omega)) for limit in chain.limit])
        forces = np.array([value(force) for force in self.carried])
        size = CLOSE * (np.abs(forces).max() + np.array(chain.limits))
        low, high = np.full(n, -np.inf), np.full(n, np.inf)  # of the rates of the forces
        apart = (limits < -size) | ((np.abs(limits) <= size) & (rates < 0.0)) | (np.array(chain.limits) == 0.0)
        high[~apart & (forces >= limits - size)] = rates[~apart & (forces >= limits - size)]
        low[~apart & (forces <= size - limits)] = -rates[~apart & (forces <= size - limits)]
        low[apart] = high[apart] = 0.0
        speeds = _speeds(chain, value(s(0)), low, high)
        pull = k * speeds
        tie = CLOSE * max(np.abs(pull).max(), np.abs(rates).max(), k * abs(value(s(0))))
        words = self._words(pull, low, high, apart, tie)
        i = self.fired
        if self.key[i] in (UP, DOWN):  # it has stopped, so that its rate says how far rounding reaches
            drive = chain.statics(self.key)[0]
            left = abs(pull[i] - (high[i] if self.key[i] == UP else low[i]))
            words += self._words(pull, low, high, apart, tie + 8.0 * left * drive.max() / drive[i])
        return tuple(dict.fromkeys(word for word in words if word != self.key))

    def _words(self, pull, low, high, apart, tie) -> list[str]:
        """Return the words whose rates agree, ties by less than ``tie`` open: stick first."""
        n = len(pull)
        letters: list[tuple[str, ...]] = []
        for i in range(n):
            if apart[i]:
                letters.append((APART,))
            elif pull[i] > high[i] + tie:
                letters.append((UP,))
            elif pull[i] < low[i] - tie:
                letters.append((DOWN,))
            else:
                ways = [STUCK]
                ways += [UP] if pull[i] >= high[i] - tie else []
                ways += [DOWN] if pull[i] <= low[i] + tie else []
                letters.append(tuple(ways))
        open_ = [i for i, ways in enumerate(letters) if len(ways) > 1]
        if len(open_) > TIES:  # all stop, or one goes on, or one stops
            words = ["".join(ways[0] for ways in letters)]
            kept = [self.key[i] if self.key[i] in letters[i] else letters[i][0] for i in range(n)]
            for i in open_:
                words.append("".join(self.key[j] if j == i and self.key[j] in letters[j] else letters[j][0] for j in range(n)))
                words.append("".join(letters[j][0] if j == i else kept[j] for j in range(n)))
        else:
            words = ["".join(word) for word in itertools.product(*letters)]
        return words


def _speeds(chain: LoadedMicroSlip, drive: float, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return the speeds of the blocks (n,) when every contact force has the rate clip(contact speed, low, high).

    The problem is monotone with an M-matrix, so that the active-set (semi-smooth Newton) iteration ends.
    """
    n, k = chain.count, chain.contact
    K = chain_stiffness(n, chain.spring, chain.closed)
    free = (low < high).astype(float)
    speeds = np.full(n, drive)
    for _ in range(4 * n + 8):
        diagonal = np.diagonal(K)[1:] + k * free[1:]
        given = np.where(free > 0.0, 0.0, np.clip(k * speeds, low, high))
        load = -K[1:, 0] * drive - given[1:]
        new = speeds.copy()
        if n > 1:
            new[1:] = along(diagonal, -chain.spring, load[:, None])[:, 0]
        still = ((k * new > low) & (k * new < high)).astype(float)
        done = np.array_equal(still, free) and np.array_equal(np.clip(k * new, low, high)[free == 0.0], given[free == 0.0])
        speeds, free = new, still
        if done:
            break
    return speeds
