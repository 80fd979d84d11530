"""Stops: rigid (Newton's restitution, rest on the stop) and elastic (piecewise linear).  Zhang 2008, eqs. 1.1-1.6."""
import dataclasses
from dataclasses import dataclass

from ..checks import choice, number, whole
from .atrow import AtRow
from .kinds import EventKind
from .local import lam, s, u, wave
from .mode import Guard, Hold, Mode, Restitution
from .site import Surface

FREE, REST, CONTACT, SEPARATING = "free", "rest", "contact", "separating"


@dataclass(frozen=True, kw_only=True)
class Wall(AtRow):
    """Something on one side of a row, that may move.

    Parameters
    ----------
    side : {1, -1}
        +1: the wall is above, -1: below.  Gaps are measured in this direction.
    amplitude, phase : float
        The wall moves as amplitude cos(harmonic omega t + phase); length, radians.
    harmonic : int
        Multiple of the excitation frequency; 0: the wall stands still, and amplitude and phase are no parameters.
    dof, row
        What hits, see `AtRow`.
    """

    side: int = 1
    amplitude: float = 0.0
    phase: float = 0.0
    harmonic: int = 0

    def __post_init__(self):
        name = type(self).__name__
        object.__setattr__(self, "side", choice(name, "side", self.side, (1, -1)))
        super().__post_init__()
        object.__setattr__(self, "harmonic", whole(name, "harmonic", self.harmonic, least=0))
        if self.harmonic == 0 and (self.amplitude != 0.0 or self.phase != 0.0):
            moved = "amplitude" if self.amplitude != 0.0 else "phase"
            raise ValueError(f"{name}: {moved} = {getattr(self, moved)!r} is not allowed with harmonic = 0; "
                             "a moving wall needs the harmonic it moves with, at least 1")

    @property
    def parameters(self):
        """Fields that are floats; amplitude and phase only of a wall that moves."""
        values = super().parameters
        return values if self.harmonic else {k: v for k, v in values.items() if k not in ("amplitude", "phase")}

    def _at(self, gap, rigid):
        """Return the wall at a distance as a picture shows it."""
        return Surface(self.dof if self.row is None else None, self.side * float(gap), self.side, rigid,
                       self.amplitude, self.harmonic, self.phase)

    def site(self, n):
        """Return the row, seen from the wall."""
        site = super().site(n)
        motion = (-wave(self.amplitude, self.harmonic, self.phase),) if self.harmonic else ()
        return dataclasses.replace(site, base=motion)

    def mirrored(self):
        """The wall on the other side; even motions are turned round."""
        amplitude = self.amplitude if self.harmonic % 2 else 0.0 - self.amplitude
        return dataclasses.replace(self, side=-self.side, amplitude=amplitude)


@dataclass(frozen=True)
class RigidStop(Wall):
    """Rigid wall at a distance: side u <= gap, restitution s+ = -r s- in the speed relative to the wall.

    Modes: "free", and "rest" while the wall pushes back.  A mass at rest that the impact of another pushes into the wall hits
    it in the same instant, with the wall's own restitution.

    Parameters
    ----------
    gap : float
        Distance of the wall in the direction of `side`, length; zero and negative (preloaded) allowed.
    restitution : float
        r, from 0 (plastic) to 1 (elastic).
    side, amplitude, phase, harmonic, dof, row
        Side, motion and place of the wall, see `Wall`; +1: u <= gap, -1: u >= -gap.
    """

    gap: float = 1.0
    restitution: float = 0.7

    start = (FREE, REST)

    @property
    def surface(self):
        """The wall."""
        return self._at(self.gap, True)

    def __post_init__(self):
        super().__post_init__()
        number(type(self).__name__, "restitution", self.restitution, least=0.0, most=1.0)

    def mode(self, key, core):
        """Return "free" or "rest"."""
        depth = self.side * u(0) - self.gap
        if key == FREE:
            hit = Guard(depth, EventKind.IMPACT, (REST, FREE), Restitution(self.restitution),
                        accumulates=(self.restitution, REST))
            return Mode(guards=(hit,))
        push = Hold(0, (1.0,), depth)
        return Mode(hold=(push,), guards=(Guard(self.side * lam(0), EventKind.RELEASE, (FREE,)),))

    def stored_energy(self, u):
        """Nothing is stored; an elastic rebound keeps the energy of the motion."""
        return 0.0 if self.restitution == 1.0 else None


@dataclass(frozen=True)
class ElasticStop(Wall):
    """Spring, and optionally a dashpot, that act beyond a gap: force stiffness d + damping d', d = side u - gap > 0.

    Modes: "free", "contact", and with ``release="force"`` "separating": let go, but not yet back behind the gap.

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
    side, amplitude, phase, harmonic, dof, row
        Side, motion and place of the stop, see `Wall`; +1: acts for u > gap, -1: for u < -gap.
    """

    gap: float = 1.0
    stiffness: float = 4.0
    damping: float = 0.0
    release: str = "penetration"

    def __post_init__(self):
        super().__post_init__()
        name = type(self).__name__
        choice(name, "release", self.release, ("penetration", "force"))
        number(name, "stiffness", self.stiffness, above=0.0 if self.release == "force" else None)
        number(name, "damping", self.damping, least=0.0)

    @property
    def start(self):
        """Keys of a start."""
        return (FREE, CONTACT) if self.release == "penetration" else (FREE, CONTACT, SEPARATING)

    @property
    def surface(self):
        """Where it begins to act."""
        return self._at(self.gap, False)

    def mode(self, key, core):
        """Return "free", "contact" or "separating"."""
        depth = self.side * u(0) - self.gap
        force = self.stiffness * depth + (self.damping * self.side) * s(0)
        if key == FREE:
            return Mode(guards=(Guard(depth, EventKind.CONTACT, (CONTACT,)),))
        if key == CONTACT and self.release == "penetration":
            return Mode(force=(-self.side * force,), guards=(Guard(-depth, EventKind.SEPARATION, (FREE,)),))
        if key == CONTACT:
            return Mode(force=(-self.side * force,), guards=(Guard(-force, EventKind.SEPARATION, (FREE, SEPARATING)),))
        return Mode(guards=(Guard(-depth, EventKind.SEPARATION, (FREE,), silent=True),
                            Guard(force, EventKind.CONTACT, (CONTACT,))))

    def stored_energy(self, u):
        """Energy of the spring; none is kept beside a dashpot."""
        return 0.5 * self.stiffness * max(self.side * u[0] - self.gap, 0.0) ** 2 if self.damping == 0.0 else None
