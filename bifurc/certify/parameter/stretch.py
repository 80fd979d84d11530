"""What lies between two rows of a branch: pieces in tubes, halved until each is proved or too small to matter."""
from typing import NamedTuple

import numpy as np

from ..arithmetic.balls import working
from ..certificate import StretchCertificate, Verdict
from ..events import structure
from ..model import Refused
from .family import Family
from .sequence import Along, along, candidate_along, point_of
from .sheet import Node, Sheet
from .tube import piece

BITS = 64  # of tubes: their width is far above rounding
# of the largest value of the parameter on the branch: what lies that near to a special point is a matter of the point's own proof
NEAR = 1e-6
LEAST = 1e-8  # scaled: a piece that is not halved any more
CLAIM = 1e-7  # scaled: a row as stored and the point proved are the same
MOST = 500  # pieces tried on a stretch


class Mark(NamedTuple):
    """A special point on a stretch: its place among the points, its parameter, whether it is proved, and how near to it its own
    proof takes over."""

    place: int
    parameter: float
    proved: bool
    near: float

    def holds(self, values) -> bool:
        """Return whether values of the parameter lie so near that the proof of the point is theirs."""
        return self.proved and max(abs(value - self.parameter) for value in values) <= self.near


class Stretches:
    """The stretches of a branch of event sequences.

    Parameters
    ----------
    branch : Branch
    points : sequence of PointCertificate
        In the order of its special points.
    precision : int, optional
        Bits; None: 64.
    """

    def __init__(self, branch, points, precision: int | None = None):
        self.branch, self.points, self.precision = branch, points, precision or BITS
        self._part = branch._arrays["part"]
        self._s = branch.column("s")
        self._near = NEAR * float(np.abs(branch.column("parameter")).max())
        self._families: dict[int, Family | str] = {}
        self._nodes: dict[int, tuple] = {}

    def between(self, i: int) -> StretchCertificate:
        """Return what is proved between the rows i and i + 1."""
        low, high = sorted(float(self.branch.x(k)[-1]) for k in (i, i + 1))
        marks = self._marks(i)
        if self._part[i] != self._part[i + 1]:
            return self._joint(i, low, high, marks)
        with working(self.precision):
            try:
                sheet, a, b = self._ends(i)
                if a is None or b is None:
                    return StretchCertificate((i, i + 1), (low, high), Verdict.UNDECIDED, message="a row is not proved to be a "
                                              "point of its event-sequence equations")
                return bisect(sheet, a, b, marks, (i, i + 1))
            except Refused as error:
                return StretchCertificate((i, i + 1), (low, high), Verdict.UNDECIDED, message=f"refused: {error}")
            except (ZeroDivisionError, np.linalg.LinAlgError):
                return StretchCertificate((i, i + 1), (low, high), Verdict.UNDECIDED,
                                          message="a matrix along the stretch cannot be inverted")

    def _marks(self, i: int) -> list[Mark]:
        low, high = self._s[i], self._s[i + 1]
        slack = 1e-6 * max(1.0, abs(low), abs(high))
        return [Mark(k, float(point.parameter), certificate.proved, self._near)
                for k, (point, certificate) in enumerate(zip(self.branch.special_points, self.points, strict=True))
                if low - slack <= point.s <= high + slack]

    def _joint(self, i: int, low: float, high: float, marks: list[Mark]) -> StretchCertificate:
        """The event sequence changes between these rows: they must lie on one proved special point."""
        done = [mark.place for mark in marks if mark.holds((low, high))]
        message = ("both rows lie on a proved special point, where the event sequence changes" if done else
                   "the event sequence changes between these rows, at no proved special point")
        return StretchCertificate((i, i + 1), (low, high), Verdict.PROVED if done else Verdict.UNDECIDED, 0, tuple(done),
                                  message=message)

    def _family(self, part: int, first: Along) -> Family:
        found = self._families.get(part)
        if found is None:
            p = self.branch.column("parameter")[self._part == part]
            try:
                found = Family(first.family.system, first.family.name, float(p.min()), float(p.max()), first.family.places)
            except Refused as error:
                found = str(error)
            self._families[part] = found
        return first.family if isinstance(found, str) else found

    def _ends(self, i: int) -> tuple[Sheet, Node | None, Node | None]:
        branch = self.branch
        problem = branch.problems[int(self._part[i])]
        xs = [branch.x(k) for k in (i, i + 1)]
        low, high = sorted(float(x[-1]) for x in xs)
        between = [point.parameter for point in branch.special_points if self._s[i] <= point.s <= self._s[i + 1]]
        low, high = min([low, *between]), max([high, *between])
        pad = 1e-3 * (high - low) + 1e-9 * max(abs(low), abs(high))
        path = along(problem, xs[0], low - pad, high + pad)
        path = path._replace(family=self._family(int(self._part[i]), path))
        other = candidate_along(problem, xs[1])
        if kinds(structure(other)[1]) != kinds(path.transitions):
            raise Refused("what vanishes identically behind the events differs between the two rows")
        sheet = Sheet(path, low - pad, high + pad)
        nodes: list[Node | None] = []
        for x, candidate in zip(xs, (path.candidate, other), strict=True):
            z = point_of(path, candidate, float(x[-1]))
            row = np.zeros(z.size)
            row[-1] = 1.0 / path.scale[-1]
            node = sheet.node(z, row)
            if node is not None and np.abs((node.z - z) / path.scale).max() > CLAIM:
                node = None
            nodes.append(node)
        return sheet, nodes[0], nodes[1]


def kinds(transitions) -> list:
    """Return what must be the same along a stretch: orders of guards, guards that vanish, what rules out earlier candidates."""
    return [(item.orders, item.ending, item.breaks, item.rounded,
             [(rule.key, rule.keys, rule.after, rule.held, rule.guards) for rule in item.rules]) for item in transitions]


def bisect(sheet: Sheet, a: Node, b: Node, marks: list[Mark], rows: tuple[int, int]) -> StretchCertificate:
    """Return what is proved between two nodes."""
    scale = sheet.path.scale
    values = (float(min(a.z[-1], b.z[-1])), float(max(a.z[-1], b.z[-1])))
    stack = [(a, b)]
    proved, tried, near = 0, 0, set()
    left: list[tuple[float, float, str]] = []
    while stack:
        first, last = stack.pop()
        found = piece(sheet, first, last)
        tried += 1
        if found.joined and not found.missing:
            proved += 1
            continue
        p = [first.z[-1], last.z[-1]] + ([] if found.centre is None else [found.centre.z[-1]])
        close = [mark for mark in marks if mark.holds(p)]
        if close and found.joined:
            near |= {mark.place for mark in close}
            continue
        size = float(np.linalg.norm((last.z - first.z) / scale))
        centre = found.centre
        if centre is None and size >= LEAST:
            centre = between(sheet, first, last)
        if centre is None or size < LEAST or tried >= MOST or found.missing.startswith("not admissible"):
            left.append((float(min(p)), float(max(p)), found.missing))
            continue
        stack += [(centre, last), (first, centre)]
    if not left:
        message = "one curve leads from row to row, without special points" if not near else (
            f"one curve leads from row to row; farther than {marks[0].near:.3g} from its special points it has no other")
        return StretchCertificate(rows, values, Verdict.PROVED, proved, tuple(sorted(near)), message=message)
    merged = joined(left)
    message = "; ".join(f"{low:.10g} to {high:.10g}: {why}" for low, high, why in merged[:4])
    if len(merged) > 4:
        message += f"; and {len(merged) - 4} further places"
    return StretchCertificate(rows, values, Verdict.UNDECIDED, proved, tuple(sorted(near)),
                              np.array([(low, high) for low, high, _ in merged]).reshape(-1, 2), message)


def between(sheet: Sheet, a: Node, b: Node) -> Node | None:
    """Return a point of the branch between two nodes, off their middle, which lies on a singular point."""
    row = (b.z - a.z) / sheet.path.scale**2
    row = row / np.linalg.norm((b.z - a.z) / sheet.path.scale)
    for share in (0.37, 0.71):
        node = sheet.node(a.z + share * (b.z - a.z), row)
        if node is not None:
            return node
    return None


def joined(left: list[tuple[float, float, str]]) -> list[tuple[float, float, str]]:
    """Return places with those joined that meet and have the same reason."""
    found: list[tuple[float, float, str]] = []
    for low, high, why in sorted(left):
        if found and low <= found[-1][1] + 1e-12 * abs(low) and kind_of(why) == kind_of(found[-1][2]):
            found[-1] = (found[-1][0], max(high, found[-1][1]), found[-1][2])
        else:
            found.append((low, high, why))
    return found


def kind_of(why: str) -> str:
    """Return the start of a reason, which names what is missing."""
    return why[:24]
