"""Events at known times: a clock that runs from 0 to 1 in each period, as the last state, and what its ticks do.

Between two ticks every mode is a mode of its own, whose last guard is the value of the clock at the next tick. Nothing of the
engine knows of it: a sawtooth is a surface that is affine in the clock, and jumps where the clock goes back to 0.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..checks import listed, number, refused, shown
from ..elements.automaton import Automaton
from ..elements.kinds import EventKind
from ..elements.mode import Guard
from .fields import AffineReset, Columns, read

NAME = "clock"
DECIDE = "decide"


@dataclass(frozen=True)
class Tick:
    """What happens at a known time: the modes that may follow, none: that which holds goes on, or another one that may begin there;
    and to the states."""

    to: tuple[str, ...] = ()
    reset: AffineReset | None = None


@dataclass(frozen=True)
class Clock:
    """Ticks of a period.

    Parameters
    ----------
    period : float or function of parameters
        Time.
    ticks : tuple of (fraction, what)
        Part of the period, from 0 on and below 1, a number or a function of parameters; what happens then, see `Tick`: of the
        modes that are named, and with the name None of all others.
    """

    period: Any
    ticks: tuple[tuple[Any, tuple[tuple[str | None, "Tick"], ...]], ...]

    @property
    def harmonics(self) -> set[int]:
        """Harmonics of an excitation that occur."""
        resets = [tick.reset for _, what in self.ticks for _, tick in what if tick.reset is not None]
        return {k for reset in resets for k in reset.harmonics}

    def length(self, owner: str, values: dict[str, float]) -> float:
        """Return the period with these parameters, or raise ValueError."""
        return number(owner, "period", read_number(owner, "period", self.period, values), above=0.0)

    def timed(self, owner: str, automaton: Automaton, columns: Columns, values: dict[str, float],
              after: Callable[[str, bool], tuple[str, ...]]) -> Automaton:
        """Return an automaton whose last state is the clock with its ticks.

        Parameters
        ----------
        owner : str
            For errors.
        automaton : Automaton
            Its modes, over the states and the clock.
        columns : Columns
        values : dict of str to float
            Parameters.
        after : callable
            Gives the modes that may follow a mode at a tick, and with True at one that resets states, in the order they are tried.
        """
        n = columns.n
        ticks: list[tuple[float, dict[str | None, Tick]]] = []
        for at, what in self.ticks:
            place = read_number(owner, "clock", at, values)
            if not 0.0 <= place < 1.0:
                raise refused(owner, "clock", place, "parts of a period, from 0 on and below 1")
            ticks.append((place or 1.0, dict(what)))
        ticks.sort(key=lambda tick: tick[0])
        if len({place for place, *_ in ticks}) < len(ticks):
            raise refused(owner, "clock", [place for place, *_ in ticks], "parts of a period that differ")
        if not ticks or ticks[-1][0] < 1.0:
            ticks.append((1.0, {}))
        count, final = len(ticks), dict(automaton.final)

        def name(key, k):
            return key if count == 1 or key in final else f"{key}@{k}"

        exits = []
        for k, (place, by_mode) in enumerate(ticks):
            ahead = np.zeros(n + 1 + 2 * len(columns.harmonics))
            ahead[n - 1], ahead[n] = 1.0, -place
            behind = np.zeros_like(ahead)
            behind[n - 1], behind[n] = -1.0, ticks[k - 1][0] if k else 0.0
            for key, guards in automaton.exits:
                if key in final:
                    continue
                tick = by_mode.get(key, by_mode.get(None, Tick()))
                move = np.eye(n, len(ahead))
                if tick.reset is not None:
                    move[:-1] = tick.reset.numbers(f"{owner}, clock", (n - 1,), n - 1, columns.harmonics, values, True)
                if place == 1.0:
                    move[-1] = 0.0
                moved = () if tick.reset is None and place < 1.0 else columns.expressions(move)
                then = tick.to or after(key, tick.reset is not None)
                ends = [replace(guard, then=tuple(name(other, k) for other in guard.then)) for guard in guards]
                ends.append(Guard(columns.expression(ahead), EventKind.CLOCK, tuple(name(other, (k + 1) % count) for other in then),
                                  reset=moved))
                if k:
                    ends.append(Guard(columns.expression(behind), EventKind.CLOCK, ()))
                exits.append((name(key, k), tuple(ends)))
        each = range(count)
        return replace(
            automaton,
            rates=(*((name(key, k), rate) for k in each for key, rate in automaton.rates if key not in final),
                   *((key, rate) for key, rate in automaton.rates if key in final)),
            exits=(*exits, *((key, ends) for key, ends in automaton.exits if key in final)),
            begins=tuple(name(key, k) for k in each for key in dict.fromkeys(  # behind a tick what it leads to, if it says so
                (*(key for tick in ticks[k - 1][1].values() for key in tick.to), *automaton.begins))),
            regions=tuple((name(key, k), sides) for k in each for key, sides in automaton.regions),
            slides=tuple((name(key, k), tuple((name(other, k), g) for other, g in beside))
                         for k in each for key, beside in automaton.slides),
            omitted=1)


def read_number(owner: str, name: str, value, values: dict[str, float]) -> float:
    """Return a number, or what a function of parameters gives, or raise ValueError."""


    return float(read(owner, name, value, (), values))


def clock_of(kind: str, states, omega, period, clock, modes) -> Clock | None:
    """Return the clock of a system's arguments, None where there is none, or raise ValueError."""
    if period is None and clock is None:
        return None
    if omega is not None:
        raise ValueError(f"{kind}: omega = {shown(omega)} is not allowed beside a clock: it has the one period that is known")
    if NAME in states:
        raise ValueError(f"{kind}: the state {NAME!r} has the name of the clock")
    if period is None:
        raise refused(kind, "period", period, "a time, or a function of parameters, where there is a clock")
    if clock is not None and not isinstance(clock, dict):
        raise refused(kind, "clock", clock, "a dict of parts of a period to what happens then")
    ticks = []
    for at, what in (clock or {}).items():
        if not (callable(at) or isinstance(at, (int, float)) and not isinstance(at, bool)):
            raise refused(kind, "clock", at, "parts of a period, numbers or functions of parameters")
        by_mode = what if isinstance(what, dict) else {None: what}
        for mode in (mode for mode in by_mode if mode is not None and mode not in modes):
            raise ValueError(f"{kind}: clock names the mode {shown(mode)}; there are {', '.join(map(repr, modes)) or 'no names'}")
        ticks.append((at, tuple((mode, tick_of(kind, what, modes)) for mode, what in by_mode.items())))
    return Clock(period, tuple(ticks))


def tick_of(kind: str, what, modes) -> Tick:
    """Return what an entry of a clock means, or raise ValueError."""
    both = isinstance(what, tuple) and len(what) == 2 and isinstance(what[1], AffineReset)
    to, reset = (DECIDE, what) if isinstance(what, AffineReset) else what if both else (what, None)
    names = () if isinstance(to, str) and to == DECIDE else (to,) if isinstance(to, str) else listed(to) or [None]
    if any(not isinstance(name, str) or name not in modes for name in names):
        raise refused(kind, "clock", what, f"{DECIDE!r}, the name of a mode or names of some, an AffineReset, or (modes, reset)")
    return Tick(tuple(names), reset)
