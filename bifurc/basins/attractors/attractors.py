"""Attractors: found from where motions end, confirmed before they get a number.

One file, because finding, confirming, comparing and making targets of an attractor share its scaled distances and their
thresholds.
"""
import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial import cKDTree

from ... import io
from ...compose.scene import scene_of
from ...content import Content
from ...ensemble.integrator import Integrator, Targets
from ...ensemble.outcomes import REACHED
from ...ensemble.proximity import STAY, boxes
from ...ensemble.section import Section
from ...flow.simulate import simulate
from ...motion import Motion
from ...orbits.autonomous import slowest
from ...orbits.concentric import concentric
from ...orbits.equilibria.equilibrium import Equilibrium
from ...orbits.find import find_orbit
from ...orbits.forced import finished, from_motion
from ...orbits.lyapunov import lyapunov_exponents
from ...orbits.shooting.resting import line_of_members
from ...system import System
from .clockless import crossings_from, exponent_of, members, section_of, settles_on
from .continuum import continuum, relabelled
from .trapping import touches, trapping

LONGEST = 128  # forcing periods of the longest orbit looked for, half of BLOCK (one of 73 periods with a rest is known)
BLOCK = 256  # forcing periods between attempts
ATTEMPTS = 4
CLOSED = 1e-6  # scaled distance after which a return counts as one for certain
OPEN = 0.1  # scaled distance after which it counts as none
NEAR = 0.03  # scaled distance of the settled motion from the orbit that is accepted for it
SAME = 1e-6  # scaled distance of section points of one orbit found twice
EXPONENT_PERIODS = 4000
LAW_PERIODS = 1000  # the same under laws, where a period costs more
FOLDS = 10.0  # factors e by which neighbours must separate in all: undamped turns give a small exponent, and a small error
SAMPLE = 20000  # section points of a chaotic attractor
PROBE = 2000  # further ones, of which COVERED lie in the boxes of the sample
COVERED = 0.999
ON_CURVE = 3000  # section points of a quasi-periodic one, at first
MOST_ON_CURVE = 40000  # where it is nearly locked
AHEAD = 10.0  # spacings of its points by which further ones may lie beside them
THINNER = 4.5  # by what neighbours on a curve come nearer, at least, where the points are 8 times as many; a surface gives 8**0.5
CLOUD = 100  # motions side by side
CLOUD_SIZE = 1e-5  # scaled distance at which they start
COMPARED = 60  # forcing periods after which they are compared, and over which exponents are measured
SETTLING = 10  # forcing periods until neighbours lie along the direction that grows
APART = 1e-7  # scaled distance of neighbours
MOST_EVENTS = 2000
CREEPING, SEEN = 1e-3, 65  # scaled motion of a creeping mass, and at how many times of its orbit
MOST_MEMBERS = 40000  # of a family that kernels compare with, one a radius


@dataclass(frozen=True, eq=False)
class SampledAttractor(Content, Motion):
    """A motion that settles on no orbit, known from a sample of its section points.

    Attributes
    ----------
    system : System
    points : ndarray
        States at phase 0, (k, ns); k = 20000, for curves 5000 or, nearly locked, up to 40000.
    exponent, exponent_error : float
        Largest Lyapunov exponent and its standard error, per time.
    width : float
        Side of the boxes, in units of ``scale``, that hold 99.9 % of the motion when those of the sample are taken.
    cover : ndarray or None
        Centres (K, ns) of boxes that hold the attractor and that the map over a forcing period carries into themselves, see
        `bifurc.basins.attractors.trapping`: a start whose section point is in one has reached the attractor.
    """

    system: System
    points: np.ndarray = field(repr=False)
    exponent: float
    exponent_error: float
    width: float
    cover: np.ndarray | None = field(default=None, repr=False)

    stable = True
    kind = "sampled_attractor"
    multipliers = None

    @property
    def sections(self) -> np.ndarray:
        """The sample, see `points`."""
        return self.points

    @property
    def periods(self) -> None:
        """No period."""
        return None

    def to_record(self) -> tuple[dict, dict]:
        """Return header and arrays for `bifurc.io`."""
        header = {"kind": self.kind, "system": self.system.to_record(), "exponent": self.exponent,
                  "exponent_error": self.exponent_error, "width": self.width}
        return header, {"points": self.points} | ({} if self.cover is None else {"cover": self.cover})

    @classmethod
    def from_record(cls, header: dict, arrays: dict, elements=()) -> "SampledAttractor":
        """Make the attractor that `to_record` described."""
        system = System.from_record(header["system"], elements)
        io.fitted(arrays, {"points": "finite k ns", "cover?": "finite boxes ns"}, ns=scene_of(system).ns)
        return cls(system, arrays["points"], header["exponent"], header["exponent_error"], header["width"],
                   arrays.get("cover"))

    def __repr__(self):
        return (f"{type(self).__name__}({len(self.points)} points, "
                f"exponent {self.exponent:.4g} +- {self.exponent_error:.1g} per time)")


class ChaoticAttractor(SampledAttractor):
    """A motion that settles on no orbit with a positive largest Lyapunov exponent."""

    kind = "chaotic_attractor"
    regime = "chaotic"


class QuasiperiodicAttractor(SampledAttractor):
    """A motion on a torus: its section points fill a closed curve, and its largest Lyapunov exponent is zero.

    A rotor that rubs part of the time in a concentric stator moves so, and what is left past a Neimark-Sacker point.
    """

    kind = "quasiperiodic_attractor"
    regime = "quasi-periodic"


def section_points(attractor, section: Section | None = None) -> np.ndarray:
    """Return the states (k, ns) of an attractor at phase 0, one a forcing period; without excitation those in the section."""
    return attractor.sections if section is None or not attractor.periodic else section_of(attractor, section)


def examine(system: System, y: np.ndarray, scale: np.ndarray, section: Section | None = None):
    """Return the attractor on which the motion from ``y`` (ns,) at phase 0 settles, or None.

    Without excitation it is a state of rest, or an orbit whose period is solved for, and ``section`` is where chaos is sampled.

    A return of the section points after k periods is only a candidate: Newton on the map must confirm an orbit there,
    and its multipliers must call it stable.  A motion without return is chaotic when its largest exponent exceeds zero
    by four standard errors, and quasi-periodic when that is none and its section points lie on a curve.
    """
    if section is not None:
        found, y = settles_on(system, y, scale)
        return found if found is not None or y is None else sampled(system, y, scale, section)
    longest = 1 if concentric(system) else LONGEST  # no direction is special: an orbit that closes is a circle
    for _ in range(ATTEMPTS):
        motion = simulate(system, y, periods=BLOCK)
        if not motion.success:
            return None
        sections = motion.sections / scale
        y = motion.final
        back = [(float(np.linalg.norm(sections[-1] - sections[-1 - k])), k) for k in range(1, longest + 1)]
        least = min(back)[0]
        candidates = [k for gap, k in back if gap <= min(max(2.0 * least, CLOSED), OPEN)]
        for k in candidates[:2]:
            orbit = from_motion(system, motion, BLOCK - 2 * k, k)  # of its end: a start may add an event of rounding
            orbit = finished(orbit, None) if orbit.success else find_orbit(system, guess=y, periods=k)
            if orbit.success and orbit.stable and distance(section_points(orbit) / scale, y / scale) <= NEAR:
                return at_rest(system, orbit, scale) or orbit
    return sampled(system, y, scale)


def at_rest(system: System, orbit, scale: np.ndarray):
    """Return the rest, one of a continuum, that an orbit is but for slips that no one sees; None where it is another motion.

    Towards the edge of the interval in which a mass may rest motions creep for ever, by slips that tend to zero: that edge is a
    member of the continuum and no attractor of its own.
    """
    if not orbit.events or orbit.intervals:
        return None
    states = orbit.sample(SEEN)[1]
    if np.ptp(states / scale, axis=0).max() > CREEPING:
        return None
    start, n = states.mean(axis=0), scene_of(system).n
    start[n:2 * n] = 0.0
    for c in range(n):
        for side in (-CREEPING, CREEPING):  # one of them leads into the interval
            inside = start.copy()
            inside[c] += side * scale[c]
            rest = find_orbit(system, guess=inside, periods=1)
            if rest.success and rest.intervals and distance(section_points(rest) / scale, start / scale) <= 2.0 * CREEPING:
                return rest
    return None


def distance(points: np.ndarray, y: np.ndarray) -> float:
    """Return the distance of ``y`` (ns,) from the nearest of ``points`` (k, ns)."""
    return float(np.sqrt(((points - y) ** 2).sum(axis=1).min()))


def sampled(system: System, y: np.ndarray, scale: np.ndarray, section: Section | None = None) -> SampledAttractor | None:
    """Return the attractor without a period on which ``y`` lies, or None when it is neither surely chaotic nor on a curve."""
    scene = scene_of(system)
    carrier = None if section else Integrator(scene, MOST_EVENTS)
    lean = carrier if carrier is not None and carrier.lean else None
    try:
        if section is not None:
            exponent, error, span = exponent_of(system, y)
        elif scene.closed_form or lean is None:
            count = EXPONENT_PERIODS if scene.closed_form else LAW_PERIODS
            measured = lyapunov_exponents(system, y, periods=count, transient=0)
            exponent, error, span = float(measured.values[0]), float(measured.errors[0]), count * float(scene.period or 0.0)
        else:
            exponent, error = largest_exponent(lean, y, scale)
            span = COMPARED * float(scene.period or 0.0)
    except ArithmeticError:
        return None
    folds = exponent * span
    chaotic = exponent > 4.0 * error and folds >= FOLDS
    if not chaotic and not (abs(folds) < FOLDS and attracts(system, y)):
        return None
    count = SAMPLE + PROBE if chaotic else ON_CURVE + PROBE
    if section is not None:
        points = crossings_from(system, y, section, ON_CURVE + PROBE)
    else:
        points = settled(lean, y, scale) if lean is not None and chaotic else followed(system, y, count)
    if points is None:
        return None
    sections = points[-LONGEST - 1:] / scale
    if min(np.linalg.norm(sections[-1] - sections[-1 - k]) for k in range(1, LONGEST + 1)) < CLOSED:
        return None  # it was a long transient
    if not chaotic:
        if not on_curve(points / scale):
            return None
        points = filled(points, scale, lambda y, more: followed(system, y, more) if section is None else
                        crossings_from(system, y, section, more))
        return None if points is None else QuasiperiodicAttractor(system, points, exponent, error, box_width(points / scale))
    width, cover = box_width(points / scale), None
    if lean is not None and scene.ns == 2:  # boxes in a plane; in more dimensions a sample is all that is known
        found = trapping(lean, points, scale, width)
        cover, width = (None, width) if found is None else found
    return ChaoticAttractor(system, points[:SAMPLE], exponent, error, width, cover)


def attracts(system: System, y: np.ndarray) -> bool:
    """Return whether neighbours of a motion on a torus come nearer to it: of the exponents that are left when those along the torus
    (one, without excitation two) are taken out, the largest is clearly negative.  Motions without damping fill tori that attract
    nothing."""
    along = 1 if system.period is not None else 2
    values = lyapunov_exponents(system, y, periods=LAW_PERIODS, transient=0).values
    unit = system.period if system.period is not None else slowest(scene_of(system))
    return len(values) > along and float(values[along]) * LAW_PERIODS * unit < -FOLDS


def on_curve(points: np.ndarray) -> bool:
    """Return whether scaled points (k, ns) lie on a curve: where they are eight times as many, neighbours are as much nearer.

    Both sets are drawn at random from the points, which follow each other along the curve in an order of their own.
    """
    def gap(some: np.ndarray) -> float:
        return float(np.median(cKDTree(some).query(some, 2)[0][:, 1]))

    few = len(points) // 50
    drawn = points[np.random.default_rng(0).permutation(len(points))[:8 * few]]
    near = gap(drawn)
    return near > 0.0 and float(np.mean([gap(part) for part in np.split(drawn, 8)])) / near > THINNER


def filled(points: np.ndarray, scale: np.ndarray, follow: Callable[[np.ndarray, int], np.ndarray | None]) -> np.ndarray | None:
    """Return section points on a curve that lie everywhere on it, or None when the motion fails.

    Those of a motion that is nearly locked fill short arcs, which take long to meet: it is followed, by ``follow(y, count)``,
    until its last points lie about as near to the earlier ones as these to each other.
    """
    while len(points) < MOST_ON_CURVE:
        earlier, last = points[:-PROBE] / scale, points[-PROBE:] / scale
        tree = cKDTree(earlier)
        ahead, spacing = (float(np.quantile(far, COVERED)) for far in (tree.query(last)[0], tree.query(earlier, 2)[0][:, 1]))
        if ahead <= AHEAD * spacing:
            break
        further = follow(points[-1], len(points))
        if further is None:
            return None
        points = np.concatenate((points, further))
    return points


def followed(system: System, y: np.ndarray, count: int) -> np.ndarray | None:
    """Return section points (count, ns) of the motion from ``y``, or None when it fails."""
    pieces = []
    for _ in range(0, count, 1000):
        motion = simulate(system, y, periods=1000)
        if not motion.success:
            return None
        pieces.append(motion.sections[1:])
        y = motion.final
    return np.concatenate(pieces)


def settled(carrier: Integrator, y: np.ndarray, scale: np.ndarray) -> np.ndarray | None:
    """Return section points (SAMPLE + PROBE, 2): a few long motions side by side from near ``y``, or None when one fails."""
    X = y + CLOUD_SIZE * scale * np.random.default_rng(0).normal(size=(CLOUD, y.size))
    points = np.empty((CLOUD, -(-(SAMPLE + PROBE) // CLOUD), y.size))
    for k in range(points.shape[1]):
        images = carrier.propagate(X, COMPARED if k == 0 else 1)
        if np.any(images.outcomes != REACHED):
            return None
        X = points[:, k] = images.ends
    return points.reshape(-1, y.size)[:SAMPLE + PROBE]


def largest_exponent(carrier: Integrator, y: np.ndarray, scale: np.ndarray) -> tuple[float, float]:
    """Return the largest exponent per time and its standard error, from how fast neighbours separate (Benettin et al. 1980).

    Many motions from near ``y`` are followed side by side, each with a neighbour whose distance is reset every period.
    """
    rng = np.random.default_rng(1)
    X = carrier.propagate(y + CLOUD_SIZE * scale * rng.normal(size=(CLOUD, y.size)), COMPARED).ends
    away = rng.normal(size=X.shape)
    logs = np.zeros((COMPARED, CLOUD))
    for k in range(-SETTLING, COMPARED):
        away *= APART / np.linalg.norm(away, axis=1)[:, None]
        both = carrier.propagate(np.concatenate((X, X + away * scale)), 1)
        if np.any(both.outcomes != REACHED):
            return 0.0, np.inf
        X = both.ends[:CLOUD]
        away = (both.ends[CLOUD:] - X) / scale
        size = np.linalg.norm(away, axis=1)
        if not size.all():
            return 0.0, np.inf  # neighbours have merged
        if k >= 0:
            logs[k] = np.log(size / APART)
    rates = logs.mean(axis=0) / carrier.scene.period
    return float(rates.mean()), float(rates.std(ddof=1) / np.sqrt(CLOUD))


def box_width(points: np.ndarray) -> float:
    """Return the least width, a power of 2, whose boxes at the sample hold `COVERED` of the further points."""
    known, further = points[:-PROBE], points[-PROBE:]
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


def same(a, b, scale: np.ndarray, section: Section | None = None) -> bool:
    """Return whether two attractors are one, up to a shift by whole forcing periods."""
    resting = [isinstance(item, Equilibrium) for item in (a, b)]
    if any(resting):
        return all(resting) and distance(members(a, SAME, scale) / scale, b.state / scale) <= SAME or (
            all(resting) and len(a.continuum) > 0 and a.mode == b.mode)
    chaotic = [isinstance(item, SampledAttractor) for item in (a, b)]
    if any(chaotic):
        if not all(chaotic):
            return False
        width = 2.0 * max(a.width, b.width)
        boxes = [{tuple(row) for row in np.floor(item.points / scale / width)} for item in (a, b)]
        return len(boxes[0] & boxes[1]) > 0.5 * min(len(boxes[0]), len(boxes[1]))
    if a.periods != b.periods:
        return False
    if section is not None:
        return distance(section_points(b, section) / scale, section_points(a, section)[0] / scale) <= SAME
    return distance(section_points(b) / scale, a.state / scale) <= SAME or one_family(a, b, scale) \
        or one_continuum(a, b, scale)


def one_continuum(a, b, scale: np.ndarray) -> bool:
    """Return whether two orbits with events are members of one continuum: they differ in the memories that label its members, and
    in what follows."""
    if not a.family or a.family != b.family or not a.sequence.events or a.family[0] < 2 * a.system.n:
        return False
    whole, values = continuum(a), b.state[a.family]
    member = relabelled(a, values) if whole is None else whole.member(float(values[0]))
    return member is not None and distance(section_points(b) / scale, member.state / scale) <= SAME


def one_family(a, b, scale: np.ndarray) -> bool:
    """Return whether two orbits are members of one family without events: a mass at rest anywhere in an interval, a slider that
    stands anywhere.  A continuum of motions is one attractor, not many."""
    if not a.intervals:
        a, b = b, a  # the edge of a family has events of no duration, and no family of its own
    if not a.intervals or (b.family and a.family != b.family):
        return False
    points = section_points(b)
    low, high = np.array(list(a.intervals.values())).T
    values, near = a.labels.values(points), SAME * (np.abs(a.labels.rows) @ scale)
    if np.any((values < low - near) | (values > high + near)):
        return False
    if not a.scene.closed_form:
        member = relabelled(a, np.clip(values[0], low, high))
        return member is not None and distance(points / scale, member.state / scale) <= SAME
    return bool(np.abs((points - line_of_members(a, values)) / scale).max() <= SAME)


def partners(system: System, attractors, scale: np.ndarray) -> dict[int, int]:
    """Return which attractor is the mirror image -y(t + half a period) of which, by number; a symmetric one is its own.

    Empty for systems without this symmetry; chaotic attractors are left out.
    """
    found: dict[int, int] = {}
    if system.symmetry != -1 or system.period is None:
        return found
    for a, item in enumerate(attractors):
        if isinstance(item, SampledAttractor):
            continue
        half = -item.sample(2 * item.periods + 1)[1][1] / scale
        for b, other in enumerate(attractors):
            if not isinstance(other, SampledAttractor) and other.periods == item.periods \
                    and distance(section_points(other) / scale, half) <= SAME:
                found[a] = b
    return found


def targets_of(attractors, radii, scale: np.ndarray, section: Section | None = None) -> Targets:
    """Return the attractors as the kernels see them; ``radii`` are scaled, one an attractor."""
    ns = scale.size
    points, squares, owner = [np.empty((0, ns))], [np.empty(0)], [np.empty(0, np.int64)]
    keys, keepers = [np.empty(0, np.uint64)], [np.empty(0, np.int64)]
    chaotic = [item for item in attractors if isinstance(item, SampledAttractor)]
    width = max((item.width for item in chaotic), default=1.0)
    proven = _proven(attractors, width, scale)
    for number, (attractor, radius) in enumerate(zip(attractors, radii, strict=True)):
        found = section_points(attractor, section)
        if isinstance(attractor, SampledAttractor):
            if proven and attractor.cover is not None:
                found = attractor.cover
            mine = np.empty(len(found), np.uint64)
            boxes(np.array(found, order="C"), 1.0 / scale, width, mine)
            mine = np.unique(mine)
            keys.append(mine)
            keepers.append(np.full(len(mine), number))
        else:
            rest = isinstance(attractor, Equilibrium)
            whole = continuum(attractor) if section is None else None
            if whole is not None:
                found, radius = whole.points(radius, scale, MOST_MEMBERS)
            else:
                found = members(attractor, radius, scale) if rest else resting(attractor, found, radius, scale)
            points.append(found / scale)
            squares.append(np.full(len(found), radius**2))
            owner.append(np.full(len(found), number))
    order = np.argsort(np.concatenate(keys), kind="stable")
    return Targets(1.0 / scale, np.concatenate(points), np.concatenate(squares), np.concatenate(owner), width,
                   np.concatenate(keys)[order], np.concatenate(keepers)[order], 1 if proven else STAY)


def resting(orbit, points: np.ndarray, radius: float, scale: np.ndarray) -> np.ndarray:
    """Return the section points (k, ns) of an orbit, or of all members of its family when a mass may rest in an interval."""
    n = orbit.system.n
    if len(orbit.family) != 1 or orbit.family[0] >= n or not orbit.intervals or len(points) != 1 or not orbit.scene.closed_form:
        return points
    (low, high), = orbit.intervals.values()
    if not 0.0 < high - low < math.inf:
        return points
    ends = line_of_members(orbit, np.array([[low], [high]]))
    count = float(np.linalg.norm((ends[1] - ends[0]) / scale)) / radius
    if count >= MOST_MEMBERS:
        return points
    return np.linspace(ends[0], ends[1], int(np.ceil(count)) + 1)


def _proven(attractors, width: float, scale: np.ndarray) -> bool:
    """Return whether all chaotic attractors have boxes of this width that nothing leaves, and these hold no other attractor."""
    chaotic = [item for item in attractors if isinstance(item, SampledAttractor)]
    return all(item.cover is not None and item.width == width and not any(
        touches(item.cover, width, scale, other.points if isinstance(other, SampledAttractor) else section_points(other))
        for other in attractors if other is not item) for item in chaotic)
