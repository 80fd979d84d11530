"""The modes of fields on both sides of surfaces: regions, slides, and where a motion may leave at any time.

Let fields be affine in relays, F = a(x) + sum of B_i u_i with u_i = -1 below and +1 above surface h_i.  Where h_i = 0 holds for i
in S, and H_S are the normals, the equivalent control keeps it so (Utkin; Filippov, for one surface):

    u_S = -(H_S B_S)^-1 (H_S (a + sum of B_j u_j over the others) + h_t),    |u_i| <= 1.

A slide is a mode: its field is affine, and it ends where a control reaches a bound.  It attracts where -H_S B_S is a P-matrix, for
one surface where H B < 0; where H B > 0 both fields leave the surface, and a motion on it may do so at any time: it ends.
"""
import itertools

import numpy as np

from ..elements.automaton import Automaton
from ..elements.kinds import EventKind
from ..elements.mode import Guard

ZERO = 1e-13  # of the largest of its terms: a difference of two fields that is rounding
SIDES = "-+"


def vanishes(values, sizes) -> bool:
    """Whether differences are the rounding of what they are differences of."""
    return bool(np.abs(values).max(initial=0.0) <= ZERO * np.abs(sizes).max(initial=0.0))


def without_rounding(values, sizes) -> np.ndarray:
    """Return values with zeros for those that are the rounding of terms that cancel; of those terms the sizes are the sums."""
    return np.where(np.abs(values) <= ZERO * sizes, 0.0, values)


class Regions:
    """Fields (n, nx) by sides, such as "-+", of surfaces (surfaces, nx), and the modes that they make.

    Parameters
    ----------
    owner : str
        Who asks, for errors.
    columns : Columns
    fields : dict of str to ndarray (n, nx)
    surfaces : ndarray (surfaces, nx)
    switches : sequence of Switch
    names : dict of str to str
        What the modes are called.
    """

    def __init__(self, owner, columns, fields, surfaces, switches, names):
        self.owner, self.columns, self.fields, self.surfaces, self.switches, self.names = (
            owner, columns, fields, surfaces, switches, names)
        self.jumps = [self.jump(i) for i in range(len(surfaces))]

    def across(self, i: int):
        """Yield the sides below surface ``i``, the field there, and that above it (n, nx)."""
        for sides, below in self.fields.items():
            above = self.fields.get(sides[:i] + "+" + sides[i + 1:])
            if sides[i] == "-" and above is not None:
                yield sides, below, above

    def jump(self, i: int) -> np.ndarray | None:
        """Return half the jump B_i (n,) of the field over surface ``i``, which is the same everywhere; None where a motion that
        meets the surface always crosses it."""
        found, h, n = [], self.surfaces[i], self.columns.n
        for _, below, above in self.across(i) if self.switches[i].slides else ():
            speed = h[:n] @ (above - below)
            along = h * (speed @ h) / (h @ h)
            if not vanishes(speed - along, np.abs(h[:n]).max() * (np.abs(above).max() + np.abs(below).max())):
                found.append(above - below)  # else on the surface the two sides move towards it alike
        if not found:
            return None
        size = max(np.abs(field).max() for field in self.fields.values())
        first = found[0]
        if not vanishes(np.delete(first, n, axis=1), size) or any(not vanishes(other - first, size) for other in found):
            raise ValueError(f"{self.owner}: the fields on both sides of surface {i} differ by more than a constant, so that its "
                             "sliding field is not affine; give sliding=False, or hysteresis, where there is no sliding")
        return 0.5 * first[:, n]

    def slide(self, sides: str):
        """Return field (n, nx) and controls (sliding, nx) of the mode of ``sides``, "0" where it slides; None: there is none."""
        on = [i for i, side in enumerate(sides) if side == "0"]
        if not on:
            return self.fields[sides], np.zeros((0, len(self.surfaces.T)))
        corners = ["".join(other) for other in itertools.product(*(SIDES if side == "0" else side for side in sides))]
        if any(self.jumps[i] is None for i in on) or any(corner not in self.fields for corner in corners):
            return None
        B, H, n = np.array([self.jumps[i] for i in on]).T, self.surfaces[on], self.columns.n
        meets = -H[:, :n] @ B
        if not all(np.linalg.det(meets[np.ix_(rows, rows)]) > ZERO * np.prod(np.abs(meets[list(rows)]).max(axis=1))
                   for count in range(1, len(on) + 1) for rows in map(list, itertools.combinations(range(len(on)), count))):
            return None
        middle = np.mean([self.fields[corner] for corner in corners], axis=0)
        controls = np.linalg.solve(meets, np.array([self.columns.rate(h, middle) for h in H]))
        return without_rounding(middle + B @ controls, np.abs(middle) + np.abs(B) @ np.abs(controls)), controls

    def modes(self):
        """Return sides, field and controls of every mode."""
        found = []
        for sides in map("".join, itertools.product("-+0", repeat=len(self.surfaces))):
            made = self.slide(sides) if "0" in sides or sides in self.fields else None
            if made is not None:
                found.append((sides, *made))
        return found

    def automaton(self, states: tuple[str, ...]) -> Automaton:
        """Return the automaton of all modes."""
        modes = self.modes()
        known = {sides: self.names.get(sides, sides) for sides, _, _ in modes}
        rates, final = [], []
        exits: list[tuple[str, tuple[Guard, ...]]] = []
        for sides, field, controls in modes:
            ends: list[Guard] = []
            on = [i for i, side in enumerate(sides) if side == "0"]
            for i, side in enumerate(sides):
                if side == "0":
                    u = controls[on.index(i)]
                    for way, bound in (("-", -u), ("+", u)):
                        ends.append(self.exit(bound, -1.0, EventKind.SLIDE_END, known, sides, i, way))
                else:
                    low, high = self.switches[i].band
                    h, over = (self.surfaces[i], high) if side == "-" else (-self.surfaces[i], -low)
                    ends.append(self.exit(h, -over, EventKind.CROSS, known, sides, i, "+" if side == "-" else "-"))
            rates.append((known[sides], self.columns.expressions(field)))
            exits.append((known[sides], tuple(ends)))
        for i, h in enumerate(self.surfaces):
            if self.jumps[i] is None or not h[:self.columns.n] @ self.jumps[i] > 0.0:
                continue
            final += [self.escaping(i, *pair) for pair in self.across(i)]
        for key, rate, leaves in final:
            rates.append((key, rate))
            exits.append((key, leaves))
        begins = (*(key for key, _, _ in final), *(known[sides] for sides in sorted(known, key=lambda one: one.count("0"))))
        return Automaton(states=states, rates=tuple(rates), exits=tuple(exits), begins=begins,
                         final=tuple((key, "escaping") for key, _, _ in final))

    def exit(self, row, constant, kind, known, sides, i, way) -> Guard:
        """Return what ends a mode through ``row`` (nx,) plus a constant, by the change of side ``i`` to ``way`` or to a slide; what
        slides elsewhere may change at once."""
        value = row.copy()
        value[self.columns.n] += constant
        first = [sides[:i] + to + sides[i + 1:] for to in (("0", way) if sides[i] != "0" else (way,))]
        others = ["".join(other) for own in first for other in itertools.product(
            *("0-+" if side == "0" and k != i else own[k] for k, side in enumerate(sides)))]
        then = tuple(known[other] for other in dict.fromkeys((*first, *others)) if other in known and other != sides)
        return Guard(self.columns.expression(value), kind, then, reset=self.projected(i) if kind is EventKind.CROSS else ())

    def projected(self, i: int):
        """Return the reset that puts a state on surface ``i``, which it has reached: it takes the rounding away.  With hysteresis
        the surface is another one for each side, and nothing slides on it."""
        if self.switches[i].hysteresis is not None:
            return ()
        h, n = self.surfaces[i], self.columns.n
        move = np.eye(n, len(h)) - np.outer(h[:n], h) / (h[:n] @ h[:n])
        return self.columns.expressions(move)

    def escaping(self, i, sides, below, above):
        """Return key, rates and exits of the mode in which a motion ends on surface ``i`` because both fields leave it."""
        h = self.surfaces[i]
        rows = [h, -h, self.columns.rate(h, below), -self.columns.rate(h, above)]
        others = [self.surfaces[k] * (1.0 if side == "-" else -1.0) for k, side in enumerate(sides) if k != i]
        ends = tuple(Guard(self.columns.expression(row), EventKind.CROSS, ()) for row in (*rows, *others))
        still = np.zeros((self.columns.n, len(h)))
        return f"escaping {sides[:i]}0{sides[i + 1:]}", self.columns.expressions(still), ends
