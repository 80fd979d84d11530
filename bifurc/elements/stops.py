"""Stops: rigid (Newton's restitution, rest on the stop) and elastic (piecewise linear).  Zhang 2008, eqs. 1.1-1.6."""
import dataclasses
from dataclasses import dataclass

from .checks import choice, number, whole
from .element import Element
from .forcing import set_place
from .kinds import EventKind
from .local import lam, s, u, wave
from .mode import Guard, Hold, Mode, Restitution
from .site import Rows

FREE, REST, CONTACT, PARTING = "free", "rest", "contact", "parting"


@dataclass(frozen=True)
class RigidStop(Element):
    """Rigid wall at a distance: side u <= gap, restitution s+ = -r s- in the speed relative to the wall.

    Modes: "free", and "rest" while the wall pushes back.

    Parameters
    ----------
    gap : float
        Distance of the wall in the direction of `side`, length; zero and negative (preloaded) allowed.
    restitution : float
        r, from 0 (plastic) to 1 (elastic).
    side : {1, -1}
        +1: u <= gap; -1: u >= -gap.
    dof : int
        Degree of freedom that hits.
    row : sequence of float, optional
        Instead of `dof`: u = row . q.
    amplitude, phase : float
        The wall itself moves as amplitude cos(harmonic omega t + phase); length, radians.
    harmonic : int
        Multiple of the excitation frequency; 0: the wall stands still (and `amplitude` must be 0).
    """

    gap: float = 1.0
    restitution: float = 0.7
    side: int = 1
    dof: int = 0
    row: tuple[float, ...] | None = None
    amplitude: float = 0.0
    phase: float = 0.0
    harmonic: int = 0

    start = (FREE, REST)

    def __post_init__(self):
        super().__post_init__()
        number(type(self).__name__, "restitution", self.restitution, least=0.0, most=1.0)
        set_wall(self)

    def site(self, n):
        """Return the row that hits, seen from the wall."""
        return wall_site(self, n)

    def mode(self, key, core):
        """Return "free" or "rest"."""
        depth = self.side * u(0) - self.gap
        if key == FREE:
            hit = Guard(depth, EventKind.IMPACT, (REST, FREE), Restitution(self.restitution),
                        accumulates=(self.restitution, REST))
            return Mode(guards=(hit,))
        push = Hold(0, (1.0,), depth)
        return Mode(hold=(push,), guards=(Guard(self.side * lam(0), EventKind.RELEASE, (FREE,)),))

    def mirrored(self):
        """The wall on the other side."""
        return mirrored_wall(self)


@dataclass(frozen=True)
class ElasticStop(Element):
    """Spring, and optionally a dashpot, that act beyond a gap: force stiffness d + damping d', d = side u - gap > 0.

    Modes: "free", "contact", and with ``release="force"`` "parting": let go, but not yet back behind the gap.

    Parameters
    ----------
    gap : float
        Distance of the stop in the direction of `side`, length; zero and negative allowed.
    stiffness : float
        Force per length; negative is allowed where the release is at zero penetration (a spring that is taken away).
    damping : float
        Force per speed, in contact only.
    release : {"penetration", "force"}
        Contact ends at zero penetration (the dashpot may pull), or at zero contact force.
    side : {1, -1}
        +1: acts for u > gap; -1: for u < -gap.
    dof, row, amplitude, phase, harmonic
        As for `RigidStop`.
    """

    gap: float = 1.0
    stiffness: float = 4.0
    damping: float = 0.0
    release: str = "penetration"
    side: int = 1
    dof: int = 0
    row: tuple[float, ...] | None = None
    amplitude: float = 0.0
    phase: float = 0.0
    harmonic: int = 0

    def __post_init__(self):
        super().__post_init__()
        name = type(self).__name__
        choice(name, "release", self.release, ("penetration", "force"))
        number(name, "stiffness", self.stiffness, above=0.0 if self.release == "force" else None)
        number(name, "damping", self.damping, least=0.0)
        set_wall(self)

    @property
    def start(self):
        """Keys of a start."""
        return (FREE, CONTACT) if self.release == "penetration" else (FREE, CONTACT, PARTING)

    def site(self, n):
        """Return the row that touches, seen from the stop."""
        return wall_site(self, n)

    def mode(self, key, core):
        """Return "free", "contact" or "parting"."""
        depth = self.side * u(0) - self.gap
        force = self.stiffness * depth + (self.damping * self.side) * s(0)
        if key == FREE:
            return Mode(guards=(Guard(depth, EventKind.CONTACT, (CONTACT,)),))
        if key == CONTACT and self.release == "penetration":
            return Mode(force=(-self.side * force,), guards=(Guard(-depth, EventKind.SEPARATION, (FREE,)),))
        if key == CONTACT:
            return Mode(force=(-self.side * force,), guards=(Guard(-force, EventKind.SEPARATION, (FREE, PARTING)),))
        return Mode(guards=(Guard(-depth, EventKind.SEPARATION, (FREE,), silent=True),
                            Guard(force, EventKind.CONTACT, (CONTACT,))))

    def mirrored(self):
        """The stop on the other side."""
        return mirrored_wall(self)


def set_wall(element) -> None:
    """Check and normalise side, place and motion of a wall under construction."""
    name = type(element).__name__
    object.__setattr__(element, "side", int(choice(name, "side", element.side, (1, -1))))
    set_place(element)
    object.__setattr__(element, "harmonic", whole(name, "harmonic", element.harmonic, least=0))
    if element.harmonic == 0 and element.amplitude != 0.0:
        raise ValueError(f"{name}: amplitude = {element.amplitude!r} is not allowed with harmonic = 0; "
                         "a moving wall needs the harmonic it moves with, at least 1")


def wall_site(element, n: int) -> Rows:
    """Return the row of an element, seen from its wall."""
    where = element.dof if element.row is None else element.row
    if element.harmonic == 0:
        return Rows.of(where, n)
    return Rows.of(where, n, base=(-wave(element.amplitude, element.harmonic, element.phase),))


def mirrored_wall(element):
    """Return the wall seen after u -> -u and half a period: the other side, even motions turned round."""
    amplitude = element.amplitude if element.harmonic % 2 else 0.0 - element.amplitude
    return dataclasses.replace(element, side=-element.side, amplitude=amplitude)
