"""Attractors: found from where motions end, confirmed before they get a number."""
from dataclasses import dataclass, field

import numpy as np

from ..system import System
from .marcher import Targets

LONGEST = 64  # forcing periods of the longest orbit looked for
BLOCK = 256  # forcing periods between attempts
ATTEMPTS = 4
CLOSED = 1e-6  # scaled distance after which a return counts as one for certain
NEAR = 0.03  # scaled distance of the settled motion from the orbit that is accepted for it
SAME = 1e-6  # scaled distance of section points of one orbit found twice
EXPONENT_PERIODS = 4000
SAMPLE = 20000  # section points of a chaotic attractor
PROBE = 2000  # further ones, of which COVERED lie in the boxes of the sample
COVERED = 0.999


@dataclass(frozen=True)
class ChaoticAttractor:
    """A motion that settles on no orbit and whose neighbours part exponentially.

    Attributes
    ----------
    system : System
    points : ndarray
        States at phase 0, (k, ns), k = 20000.
    exponent, exponent_error : float
        Largest Lyapunov exponent and its standard error, per time.
    width : float
        Side of the boxes, in units of ``scale``, that hold 99.9 % of the motion when those of the sample are taken.
    """

    system: System
    points: np.ndarray = field(repr=False)
    exponent: float
    exponent_error: float
    width: float

    stable = True

    @property
    def periods(self) -> None:
        """No period."""
        return None

    def to_record(self) -> tuple[dict, dict]:
        """Return header and arrays for `bifurc.io`."""
        header = {"kind": "chaotic_attractor", "system": self.system.to_record(), "exponent": self.exponent,
                  "exponent_error": self.exponent_error, "width": self.width}
        return header, {"points": self.points}

    @classmethod
    def from_record(cls, header: dict, arrays: dict, elements=()) -> "ChaoticAttractor":
        """Make the attractor that `to_record` described."""
        system = System.from_record(header["system"], elements)
        return cls(system, arrays["points"], header["exponent"], header["exponent_error"], header["width"])

    def __repr__(self):
        return (f"ChaoticAttractor({len(self.points)} points, "
                f"exponent {self.exponent:.4g} +- {self.exponent_error:.1g} per time)")


def section_points(attractor) -> np.ndarray:
    """Return the states (k, ns) of an attractor at phase 0, one a forcing period."""
    if isinstance(attractor, ChaoticAttractor):
        return attractor.points
    return attractor.sample(attractor.periods + 1)[1][:-1]


def examine(system: System, y: np.ndarray, scale: np.ndarray):
    """Return the attractor on which the motion from ``y`` (ns,) at phase 0 settles, or None.

    A return of the section points after k periods is only a candidate: Newton on the map must confirm an orbit there,
    and its multipliers must call it stable.  A motion without return is chaotic when its largest exponent exceeds zero
    by four standard errors.
    """
    from ..flow.simulate import simulate
    from ..orbits.find import find_orbit, finished, from_motion
    for _ in range(ATTEMPTS):
        motion = simulate(system, y, periods=BLOCK)
        if not motion.success:
            return None
        sections = motion.sections / scale
        y = motion.final
        back = [(float(np.linalg.norm(sections[-1] - sections[-1 - k])), k) for k in range(1, LONGEST + 1)]
        least = min(back)[0]
        candidates = [k for gap, k in back if gap <= max(2.0 * least, CLOSED)]
        for k in candidates[:2]:
            orbit = from_motion(system, motion, BLOCK - 2 * k, k)  # of its end: a start may add an event of rounding
            orbit = finished(orbit, None) if orbit.success else find_orbit(system, guess=y, periods=k)
            if orbit.success and orbit.stable and distance(section_points(orbit) / scale, y / scale) <= NEAR:
                return orbit
    return sampled(system, y, scale)


def distance(points: np.ndarray, y: np.ndarray) -> float:
    """Return the distance of ``y`` (ns,) from the nearest of ``points`` (k, ns)."""
    return float(np.sqrt(((points - y) ** 2).sum(axis=1).min()))


def sampled(system: System, y: np.ndarray, scale: np.ndarray) -> ChaoticAttractor | None:
    """Return the chaotic attractor on which ``y`` lies, or None when its exponent is not surely positive."""
    from ..flow.simulate import simulate
    from ..orbits.lyapunov import lyapunov_exponents
    try:
        found = lyapunov_exponents(system, y, periods=EXPONENT_PERIODS, transient=0)
    except ArithmeticError:
        return None
    if not found.chaotic:
        return None
    exponent, error = float(found.values[0]), float(found.errors[0])
    pieces = []
    for _ in range(0, SAMPLE + PROBE, 1000):
        motion = simulate(system, y, periods=1000)
        if not motion.success:
            return None
        pieces.append(motion.sections[1:])
        y = motion.final
    points = np.concatenate(pieces)
    sections = points[-LONGEST - 1:] / scale
    if min(np.linalg.norm(sections[-1] - sections[-1 - k]) for k in range(1, LONGEST + 1)) < CLOSED:
        return None  # it was a long transient
    return ChaoticAttractor(system, points[:SAMPLE], exponent, error, box_width(points / scale))


def box_width(points: np.ndarray) -> float:
    """Return the least width, a power of 2, whose boxes at the sample hold `COVERED` of the further points."""
    known, further = points[:SAMPLE], points[SAMPLE:SAMPLE + PROBE]
    width = 2.0**-12
    while width < 1.0:
        boxes = np.unique(np.floor(known / width), axis=0)
        every = np.concatenate((boxes, np.unique(np.floor(further / width), axis=0)))
        unique, inverse = np.unique(every, axis=0, return_inverse=True)
        seen = np.zeros(len(unique), bool)
        seen[inverse[:len(boxes)].ravel()] = True
        place = np.floor(further / width)
        new = {tuple(row) for row in unique[~seen]}
        if sum(tuple(row) in new for row in place) <= (1.0 - COVERED) * len(place):
            return width
        width *= 2.0
    return width


def same(a, b, scale: np.ndarray) -> bool:
    """Return whether two attractors are one, up to a shift by whole forcing periods."""
    chaotic = [isinstance(item, ChaoticAttractor) for item in (a, b)]
    if any(chaotic):
        if not all(chaotic):
            return False
        width = 2.0 * max(a.width, b.width)
        boxes = [{tuple(row) for row in np.floor(item.points / scale / width)} for item in (a, b)]
        return len(boxes[0] & boxes[1]) > 0.5 * min(len(boxes[0]), len(boxes[1]))
    if a.periods != b.periods:
        return False
    return distance(section_points(b) / scale, a.state / scale) <= SAME


def partners(system: System, attractors, scale: np.ndarray) -> dict[int, int]:
    """Return which attractor is the mirror image -y(t + half a period) of which, by number; a symmetric one is its own.

    Empty for systems without this symmetry; chaotic attractors are left out.
    """
    found: dict[int, int] = {}
    if system.symmetry != -1:
        return found
    for a, item in enumerate(attractors):
        if isinstance(item, ChaoticAttractor):
            continue
        half = -item.sample(2 * item.periods + 1)[1][1] / scale
        for b, other in enumerate(attractors):
            if not isinstance(other, ChaoticAttractor) and other.periods == item.periods \
                    and distance(section_points(other) / scale, half) <= SAME:
                found[a] = b
    return found


def targets_of(attractors, radii, scale: np.ndarray) -> Targets:
    """Return the attractors as the kernels see them; ``radii`` are scaled, one an attractor."""
    from .near import boxes
    ns = scale.size
    points, squares, owner = [np.empty((0, ns))], [np.empty(0)], [np.empty(0, np.int64)]
    keys, keepers = [np.empty(0, np.uint64)], [np.empty(0, np.int64)]
    chaotic = [item for item in attractors if isinstance(item, ChaoticAttractor)]
    width = max((item.width for item in chaotic), default=1.0)
    for number, (attractor, radius) in enumerate(zip(attractors, radii, strict=True)):
        found = section_points(attractor)
        if isinstance(attractor, ChaoticAttractor):
            mine = np.empty(len(found), np.uint64)
            boxes(np.ascontiguousarray(found), 1.0 / scale, width, mine)
            mine = np.unique(mine)
            keys.append(mine)
            keepers.append(np.full(len(mine), number))
        else:
            points.append(found / scale)
            squares.append(np.full(len(found), radius**2))
            owner.append(np.full(len(found), number))
    order = np.argsort(np.concatenate(keys), kind="stable")
    return Targets(1.0 / scale, np.concatenate(points), np.concatenate(squares), np.concatenate(owner), width,
                   np.concatenate(keys)[order], np.concatenate(keepers)[order])
