"""The text of a Runge-Kutta step under laws, of one or two masses in one mode: for many starts at once, and for one.

A mode moves by v' = K q + D v + load(t) + sum over rows of P f, with forces f = law(u, s) of the rows' coordinates u = U q + ...
and speeds s = S v + ....  Coefficients of U, S, P that are 0 or 1 are not written; a new pattern of them is a new text.
"""
from typing import NamedTuple

import numpy as np
from scipy.integrate import DOP853

from ...compose.tables import Tables
from ...flow.laws.calls import SOURCE
from .several_modes import MANY, dot, loaded

NONE, ONE, NUMBER = range(3)  # what is written of a coefficient: nothing, no factor, a number
Pattern = tuple[tuple[int, ...], ...]


class Nystrom(NamedTuple):
    """An explicit Runge-Kutta method of fixed step for x'' = f(t, x, x'), written so that only the values of f are kept.

    With the stages' velocities V_i = v + h sum_j a_ij f_j put into X_i = x + h sum_j a_ij V_j,

        X_i = x + c_i h v + h^2 sum_j (a^2)_ij f_j,    x(h) = x + h v + h^2 sum_j (b a)_j f_j,    v(h) = v + h sum_j b_j f_j.
    """

    c: np.ndarray  # (stages,) times
    position: np.ndarray  # (stages, stages) a^2
    velocity: np.ndarray  # (stages, stages) a
    last_position: np.ndarray  # (stages,) b a
    last_velocity: np.ndarray  # (stages,) b


def nystrom(order: int) -> Nystrom:
    """Return the method of order 4, the classical one, or that of order 8 of Dormand and Prince, with 12 stages.

    The latter's coefficients are in scipy (Hairer, Norsett, Wanner, Solving ordinary differential equations I, 1993, code DOP853).
    """
    a, b = {4: (np.diag([0.5, 0.5, 1.0], -1), np.array([1.0, 2.0, 2.0, 1.0]) / 6.0), 8: (DOP853.A, DOP853.B)}[order]
    return Nystrom(a.sum(axis=1), a @ a, a, b @ a, b)


def coefficients(method: Nystrom) -> dict[tuple[str, float], None]:
    """Return the coefficients of a method with the power of the step that each goes with ("h", "hh"): equal ones once."""
    weights = {"h": (method.c, method.velocity, method.last_velocity), "hh": (method.position, method.last_position)}
    return {(power, weight): None for power, arrays in weights.items() for array in arrays for weight in array.ravel().tolist()
            if weight != 0.0}


class Acts(NamedTuple):
    """What the text of a mode depends on."""

    laws: tuple[int, ...]  # that act
    pushes: Pattern  # (rows, n) of accelerations per force
    watched: bool  # a guard feels a law


class Kind(NamedTuple):
    """What the written module depends on."""

    order: int  # of the method
    n: int  # masses
    laws: str  # their text
    rows: tuple[int, ...]  # of every law
    values: tuple[int, ...]  # parameters of every law
    keys: tuple[int, ...]  # sets of parameters of every law
    coordinates: Pattern  # (rows, n) of U
    speeds: Pattern  # (rows, n) of S
    moving: tuple[tuple[int, int], ...]  # coordinates (0, row) and speeds (1, row) to which the site's own motion adds
    acts: tuple[Acts, ...]
    modes: tuple[int, ...]  # entry of ``acts`` of every mode
    guards: int  # largest number of guards of a mode
    forcings: int  # forcing states

    @property
    def loads(self) -> int:
        """What time alone gives to a stage: accelerations, then coordinates and speeds of sites that move."""
        return self.n + len(self.moving)

    @property
    def records(self) -> tuple[np.dtype, np.dtype]:
        """What the step reads of a mode, and of a mode on a substep.

        Of a mode the method's coefficients times powers of the step, see `coefficients`.  On a substep the loads at all stages, and
        their polynomials; of a guard what forcing gives to value and slope h/3 at both ends, and its polynomial.
        """
        rows, n, method = (sum(self.rows), self.n), self.n, nystrom(self.order)
        guard = [("value", float, 2 * n), ("constant", float), ("fourth", float), ("least", float), ("added", float, 2 * n)]
        mode = [("h", float), ("field", float, (n, 2 * n)), ("values", float, (sum(self.values),)), ("u", float, rows),
                ("s", float, rows), ("p", float, rows), ("guards", guard, (self.guards,)),
                ("method", float, (len(coefficients(method)),))]
        forced = [("ends", float, (2, 2)), ("series", float, MANY)]
        return np.dtype(mode), np.dtype([("stages", float, (len(method.c), self.loads)), ("guards", forced, (self.guards,)),
                                         ("loads", float, (self.loads, MANY))])


def pattern_of(matrix: np.ndarray) -> Pattern:
    """Return what is written of each coefficient."""
    return tuple(tuple(NONE if value == 0.0 else ONE if value == 1.0 else NUMBER for value in row) for row in matrix.tolist())


def seen(T: Tables) -> tuple[np.ndarray, np.ndarray]:
    """Return what every row of the laws sees of x: coordinates and speeds (rows, nx)."""
    return T.LU[T.owners[SOURCE]], T.LS[T.owners[SOURCE]]


def mode_numbers(T: Tables, kind: Kind, m: int, h: float, numbers: np.ndarray) -> np.ndarray:
    """Write what ``numbers``, of all modes, hold of a mode but its guards; return what the forcing states give to its loads."""
    n, ns = kind.n, 2 * kind.n
    (U, S), values, at = seen(T), [], 0
    for i, (count, keys) in enumerate(zip(kind.values, kind.keys, strict=True)):
        first = at + (max(int(T.acts[m, i]), 1) - 1) * count
        values += T.law[first:first + count].tolist()
        at += count * keys
    own = numbers[m]
    own["h"], own["field"], own["values"], own["u"], own["s"], own["p"] = (
        h, T.A[m, n:ns, :ns], values, U[:, :n], S[:, n:ns], T.LP[m, :len(U)])
    own["method"] = [weight * h ** len(power) for power, weight in coefficients(nystrom(kind.order))]
    return np.vstack([T.A[m, n:ns, ns:], *((U, S)[which][row:row + 1, ns:] for which, row in kind.moving)])


def stage_times(kind: Kind, steps: int) -> np.ndarray:
    """Return the phases (steps, stages) of the excitation at all stages."""
    return 2.0 * np.pi * (np.arange(steps)[:, None] + nystrom(kind.order).c) / steps


def stage_loads(T: Tables, loads: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return what the forcing gives to every load at ``times``, as (*times.shape, loads)."""
    found = np.broadcast_to(loads[:, 0], (*times.shape, len(loads))).copy()
    for i, k in enumerate(T.harmonics):
        found += np.multiply.outer(np.cos(k * times), loads[:, 1 + 2 * i])
        found += np.multiply.outer(np.sin(k * times), loads[:, 2 + 2 * i])
    return found


class Step:
    """Lines of a step: ``head`` names numbers, ``products`` those of the step ``h``, ``body`` takes y0, y1, ... to z0, z1, ... with
    the stages' accelerations f0_0, ....

    Parameters
    ----------
    kind : Kind
    acts : Acts
        The step ``h`` and the loads substep_stages_0_0, ... of the stages have names already.
    given : bool
        Whether the method's coefficients times powers of the step are those of the mode: the compiler takes them faster from there
        than from products made in the same function.
    """

    def __init__(self, kind: Kind, acts: Acts, given: bool = False):
        self.kind, self.acts, self.method = kind, acts, nystrom(kind.order)
        self._known = {known: f"mode_method_{i}" for i, known in enumerate(coefficients(self.method))}
        self.head = loaded(kind.records, "mode", "field", "values", "u", "s", "p", *(["method"] if given else []))
        self.products = ["hh = h * h"]
        if not given:
            self.products += [f"{name} = {power} * {weight!r}" for (power, weight), name in self._known.items()]
        n, method = kind.n, self.method
        self.body = self.field([f"y{c}" for c in range(2 * n)], "f0", 0)
        for i in range(1, len(method.c)):
            for c in range(n):
                start = f"y{c} + {self._known['h', float(method.c[i])]} * y{n + c}"
                self.body.append(f"x{c} = {self._summed(start, 'hh', method.position[i, :i], c)}")
                self.body.append(f"x{n + c} = {self._summed(f'y{n + c}', 'h', method.velocity[i, :i], c)}")
            self.body += self.field([f"x{c}" for c in range(2 * n)], f"f{i}", i)
        for c in range(n):
            self.body.append(f"z{c} = {self._summed(f'y{c} + h * y{n + c}', 'hh', method.last_position, c)}")
            self.body.append(f"z{n + c} = {self._summed(f'y{n + c}', 'h', method.last_velocity, c)}")

    def nearest(self, time: float) -> int:
        """Return the last of the stages that are nearest to a part of the step."""
        away = np.abs(self.method.c - time)
        return int(np.flatnonzero(away == away.min())[-1])

    def _summed(self, start: str, power: str, weights: np.ndarray, c: int) -> str:
        for j, weight in enumerate(weights.tolist()):
            if weight != 0.0:
                start = f"{start} + {self._known[power, weight]} * f{j}_{c}"
        return start

    def field(self, state: list[str], name: str, stage: int) -> list[str]:
        """Lines for the accelerations ``name``_0, ... at a state under the loads of a stage."""
        kind, n, row, value, lines = self.kind, self.kind.n, 0, 0, []
        force: dict[int, str] = {}
        moved = {row: f" + substep_stages_{stage}_{n + e}" for e, row in enumerate(kind.moving)}
        for i, (rows, values) in enumerate(zip(kind.rows, kind.values, strict=True)):
            own = range(row, row + rows)
            if i in self.acts.laws:
                arguments = [_linear(pattern[r], f"mode_{part}_{r}_", state[n * which:n * which + n]) + moved.get((which, r), "")
                             for which, part, pattern in ((0, "u", kind.coordinates), (1, "s", kind.speeds)) for r in own]
                results = [f"{name}_of_{r}" for r in own]
                arguments += [f"mode_values_{value + k}" for k in range(values)]
                lines.append(f"{', '.join(results)} = law_{i}({', '.join(arguments)})")
                force |= dict(zip(own, results, strict=True))
            row, value = row + rows, value + values
        for c in range(n):
            text = dot([f"mode_field_{c}_{j} * {state[j]}" for j in range(2 * n)], f"substep_stages_{stage}_{c}")
            for r, made in force.items():
                factor = self.acts.pushes[r][c]
                if factor != NONE:
                    text = f"{text} + {made}" if factor == ONE else f"{text} + mode_p_{r}_{c} * {made}"
            lines.append(f"{name}_{c} = {text}")
        return lines


def _linear(pattern: tuple[int, ...], name: str, values: list[str]) -> str:
    """Return the text of a sum of products."""
    terms = [value if what == ONE else f"{name}{c} * {value}"
             for c, (what, value) in enumerate(zip(pattern, values, strict=True)) if what != NONE]
    return " + ".join(terms) or "0.0"
