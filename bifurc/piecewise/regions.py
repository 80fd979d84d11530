"""The modes of fields on both sides of surfaces: regions, slides, and where a motion may leave at any time.

On one surface h = 0 with the rates l1, l2 of h along the fields F1 below and F2 above, motions slide where l1 > 0 > l2, with

    Fs = F1 + l1 (F2 - F1)/(l1 - l2)    (Filippov),

which is affine where the jump F2 - F1 has one direction on the surface (relays, dry friction under any load), or where l1 and
l2 keep their ratio there.  A slide ends where l1 or l2 vanishes; where both do, at a two-fold, nothing says how it goes on.

On several surfaces let fields be affine in relays, F = a(x) + sum of B_i u_i with u_i = -1 below and +1 above surface h_i.  Where
h_i = 0 holds for i in S, and H_S are the normals, the equivalent control keeps it so (Utkin):

    u_S = -(H_S B_S)^-1 (H_S (a + sum of B_j u_j over the others) + h_t),    |u_i| <= 1.

It attracts where -H_S B_S is a P-matrix, and ends where a control reaches a bound.  A state on a surface from which several
fields lead away has no motion: `settle.start` counts the regions that may begin.
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
        """Return half the jump B_i (n,) of the field over surface ``i``, the same everywhere; None where it is not, or where
        motions do not slide."""
        if not self.switches[i].slides:
            return None
        n, size = self.columns.n, max(np.abs(field).max() for field in self.fields.values())
        jumps = [above - below for _, below, above in self.across(i)]
        if not jumps or not vanishes(np.delete(jumps[0], n, axis=1), size) or any(not vanishes(jump - jumps[0], size)
                                                                                   for jump in jumps):
            return None
        return 0.5 * jumps[0][:, n]

    def on(self, i: int, rows: np.ndarray) -> np.ndarray:
        """Return expressions (..., nx) that equal ``rows`` on surface ``i``, without the state on which it depends most."""
        h = self.surfaces[i]
        p = int(np.argmax(np.abs(h[:self.columns.n])))
        share = rows[..., p:p + 1] / h[p] * h
        found = without_rounding(rows - share, np.abs(rows) + np.abs(share))
        found[..., p] = 0.0
        return found

    def filippov(self, i: int, below: np.ndarray, above: np.ndarray):
        """Return field (n, nx) and two bounds (2, nx) of the slide on surface ``i``; None where motions do not slide."""
        h, n = self.surfaces[i], self.columns.n
        l1, l2 = (self.columns.rate(h, field) for field in (below, above))
        size = np.abs(h[:n]).max() * (np.abs(above).max() + np.abs(below).max()) + np.abs(self.columns.W @ h[n:]).max(initial=0.0)
        one, two = self.on(i, l1), self.on(i, l2)
        gap = one - two
        if vanishes(gap, size):  # on the surface the two sides move towards it alike: what meets it crosses it
            return None
        steady = [vanishes(np.delete(row, n), size) for row in (one, two, gap)]
        if steady[0] and not one[n] > 0.0 or steady[1] and not two[n] < 0.0 or steady[2] and not gap[n] > 0.0:
            return None
        rest = gap / (gap @ gap)
        weight, direction = float(one @ rest), self.on(i, above - below) @ rest
        if vanishes(one - weight * gap, size):
            if not 0.0 < weight < 1.0:
                return None
            field = below + weight * (above - below)
            field -= np.outer(h[:n], self.columns.rate(h, field)) / (h[:n] @ h[:n])  # it is a multiple of h
        elif vanishes(self.on(i, above - below) - np.outer(direction, gap), np.abs(above).max() + np.abs(below).max()):
            part = np.outer(direction, l1)
            field = without_rounding(below + part, np.abs(below) + np.abs(part))
        else:
            raise ValueError(f"{self.owner}: the fields on both sides of surface {i} differ by more than a multiple of one "
                             "direction, so that its sliding field is not affine; give sliding=False, or hysteresis, where "
                             "nothing slides")
        return field, np.array([-l1, l2])

    def slide(self, sides: str):
        """Return field (n, nx) and bounds (sliding, 2, nx) of the mode of ``sides``, "0" where it slides; None: there is none."""
        on = [i for i, side in enumerate(sides) if side == "0"]
        if not on:
            return self.fields[sides], np.zeros((0, 2, len(self.surfaces.T)))
        corners = ["".join(other) for other in itertools.product(*(SIDES if side == "0" else side for side in sides))]
        if any(corner not in self.fields for corner in corners) or not all(self.switches[i].slides for i in on):
            return None
        if len(on) == 1:
            made = self.filippov(on[0], *(self.fields[corner] for corner in corners))
            return None if made is None else (made[0], made[1][None])
        if any(self.jumps[i] is None for i in on):
            return None
        B, H, n = np.array([self.jumps[i] for i in on]).T, self.surfaces[on], self.columns.n
        meets = -H[:, :n] @ B
        if not all(np.linalg.det(meets[np.ix_(rows, rows)]) > ZERO * np.prod(np.abs(meets[list(rows)]).max(axis=1))
                   for count in range(1, len(on) + 1) for rows in map(list, itertools.combinations(range(len(on)), count))):
            return None
        middle = np.mean([self.fields[corner] for corner in corners], axis=0)
        controls = np.linalg.solve(meets, np.array([self.columns.rate(h, middle) for h in H]))
        bounds = np.stack([-controls, controls], axis=1)
        bounds[..., n] -= 1.0
        return without_rounding(middle + B @ controls, np.abs(middle) + np.abs(B) @ np.abs(controls)), bounds

    def modes(self):
        """Return sides, field and bounds of every mode."""
        found = []
        for sides in map("".join, itertools.product("-+0", repeat=len(self.surfaces))):
            made = self.slide(sides) if "0" in sides or sides in self.fields else None
            if made is not None:
                found.append((sides, *made))
        return found

    def automaton(self, states: tuple[str, ...]) -> Automaton:
        """Return the automaton of all modes."""
        modes = self.modes()
        self.folds = {sides for sides, _, bounds in modes if self.meets_fold(bounds)}
        known = {sides: self.names.get(sides, sides) for sides, _, _ in modes}
        rates = [(known[sides], self.columns.expressions(field)) for sides, field, _ in modes]
        exits: list[tuple[str, tuple[Guard, ...]]] = []
        for sides, _, bounds in modes:
            ends: list[Guard] = []
            on = [i for i, side in enumerate(sides) if side == "0"]
            for i, side in enumerate(sides):
                if side == "0":
                    ends += [self.exit(bound, EventKind.SLIDE_END, known, sides, i, way)
                             for way, bound in zip(SIDES, bounds[on.index(i)], strict=True)]
                else:
                    low, high = self.switches[i].band
                    h = self.surfaces[i].copy() if side == "-" else -self.surfaces[i]
                    h[self.columns.n] -= high if side == "-" else -low
                    ends.append(self.exit(h, EventKind.CROSS, known, sides, i, "+" if side == "-" else "-"))
            exits.append((known[sides], tuple(ends)))
        final = self.final(modes)
        still = self.columns.expressions(np.zeros((self.columns.n, len(self.surfaces.T))))
        return Automaton(
            states=states, rates=(*rates, *((key, still) for key, _, _ in final)),
            exits=(*exits, *((key, ends) for key, _, ends in final)),
            begins=tuple(known[sides] for sides in sorted(known, key=lambda one: one.count("0"))),
            final=tuple((key, status) for key, status, _ in final),
            regions=tuple((name, "".join(side if switch.hysteresis is None else "*"
                                         for side, switch in zip(sides, self.switches, strict=True)))
                          for sides, name in known.items() if "0" not in sides),
            slides=tuple((name, tuple((known[sides.replace("0", "-")], i) for i, side in enumerate(sides) if side == "0"))
                         for sides, name in known.items() if "0" in sides))

    def final(self, modes) -> list[tuple[str, str, tuple[Guard, ...]]]:
        """Return key, status and guards of the modes in which a motion ends: several fields lead away, or a slide comes to a
        two-fold."""
        found: list[tuple[str, str, tuple[Guard, ...]]] = [("escaping", "escaping", ()), ("two-fold", "two_fold", ())]
        for sides, _, bounds in modes:
            if sides in self.folds:
                rows = [sign * bound for bound in bounds[0] for sign in (1.0, -1.0)]
                found.append((f"two-fold {sides}", "two_fold", tuple(
                    Guard(self.columns.expression(row), EventKind.CROSS, ()) for row in rows)))
        return found

    def meets_fold(self, bounds) -> bool:
        """Whether both bounds of a slide on one surface may vanish at once: their sum is no constant."""
        return len(bounds) == 1 and not vanishes(np.delete(bounds[0].sum(axis=0), self.columns.n), np.abs(bounds))

    def exit(self, row, kind, known, sides, i, way) -> Guard:
        """Return what ends a mode through ``row`` (nx,), by the change of side ``i`` to ``way`` or to a slide; what slides
        elsewhere may change at once."""
        first = [sides[:i] + to + sides[i + 1:] for to in (("0", way) if sides[i] != "0" else (way,))]
        others = ["".join(other) for own in first for other in itertools.product(
            *("0-+" if side == "0" and k != i else own[k] for k, side in enumerate(sides)))]
        then = [known[other] for other in dict.fromkeys((*first, *others)) if other in known and other != sides]
        if kind is EventKind.SLIDE_END and sides in self.folds:
            then.insert(0, f"two-fold {sides}")
        return Guard(self.columns.expression(row), kind, tuple(then), reset=self.projected(i) if kind is EventKind.CROSS else ())

    def projected(self, i: int):
        """Return the reset that puts a state on surface ``i``, which it has reached: it takes the rounding away.  With hysteresis
        the surface is another one for each side, and nothing slides on it."""
        if self.switches[i].hysteresis is not None:
            return ()
        h, n = self.surfaces[i], self.columns.n
        move = np.eye(n, len(h)) - np.outer(h[:n], h) / (h[:n] @ h[:n])
        return self.columns.expressions(move)
