"""Loads and springs that are switched at known phases of the excitation, and pulses: their switches are events, and exact."""
import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from ...checks import refused
from ..atrow import Waving
from ..kinds import EventKind
from ..local import Affine, affine, u, wave
from ..mode import Guard, Mode

HIGH, LOW = "high", "low"
BEFORE, AFTER = "before", "after"


@dataclass(frozen=True, kw_only=True)
class Switched(Waving):
    """Something with two levels, the higher one while cos(harmonic omega t + phase) > cos(pi duty).

    Parameters
    ----------
    amplitude : float
        How far each level is from the middle.
    harmonic : int
        Multiple of the excitation frequency, at least 1.
    phase : float
        Radians; the middle of the higher level lies where harmonic omega t + phase = 0.
    duty : float
        Part of a period with the higher level, above 0 and below 1.
    dof, row
        Where it acts, see `AtRow`.
    """

    amplitude: float = 1.0
    harmonic: int = 1
    phase: float = 0.0
    duty: float = 0.5

    start = (HIGH, LOW)

    def __post_init__(self):
        super().__post_init__()
        name = type(self).__name__
        if not 0.0 < self.duty < 1.0:
            raise refused(name, "duty", self.duty, "a part of a period, above 0 and below 1")

    def level(self, sign: float) -> Affine:
        """Return its force on the higher level, +1, or on the lower one, -1."""
        raise NotImplementedError(f"{type(self).__name__} must define level(sign)")

    def mode(self, key, core):
        """Return "high" or "low"."""
        below = affine(math.cos(math.pi * self.duty)) - wave(1.0, self.harmonic, self.phase)
        if key == HIGH:
            return Mode(force=(self.level(1.0),), guards=(Guard(below, EventKind.CLOCK, (LOW,)),))
        return Mode(force=(self.level(-1.0),), guards=(Guard(-below, EventKind.CLOCK, (HIGH,)),))

    def turned(self, amplitude: float):
        """Return the image half a period later, with an amplitude where the harmonic is even."""
        if self.harmonic % 2 == 0:
            return dataclasses.replace(self, amplitude=amplitude)
        return dataclasses.replace(self, amplitude=0.0 - amplitude, duty=1.0 - self.duty)

    def mirrored_key(self, key):
        """After half a period the levels have changed where the harmonic is odd."""
        return key if self.harmonic % 2 == 0 else LOW if key == HIGH else HIGH


@dataclass(frozen=True)
class SquareForce(Switched):
    """Square wave: a force +amplitude for a part of each period, -amplitude for the rest of it.

    Parameters
    ----------
    amplitude : float
        In the units of the equations of motion.
    harmonic, phase, duty, dof, row
        When it is high, and where it acts, see `Switched`.

    Examples
    --------
    >>> import bifurc as bf
    >>> motion = bf.simulate(bf.System(1.0, 0.1, 1.0, [bf.elements.SquareForce(0.5)], omega=3.141592653589793), [0, 0], periods=1)
    >>> [f"{event.time:.6f}" for event in motion.events]
    ['0.500000', '1.500000']
    """

    amplitude: float = 1.0

    def level(self, sign):
        """The force is one of two numbers."""
        return affine(sign * self.amplitude)

    def mirrored(self):
        """Half a period later it pushes the other way round."""
        return self.turned(0.0 - self.amplitude)


@dataclass(frozen=True)
class SquareSpring(Switched):
    """Spring whose stiffness is switched: force -(stiffness +- amplitude) u, + for a part of each period (Meissner).

    Parameters
    ----------
    amplitude : float
        Half the change of stiffness, force per length.
    stiffness : float
        Its middle, force per length; 0 where the stiffness matrix has it.
    harmonic, phase, duty, dof, row
        When it is stiffer, and where it acts, see `Switched`.
    """

    amplitude: float = 0.1
    stiffness: float = 0.0

    def level(self, sign):
        """The force of a spring."""
        return -(self.stiffness + sign * self.amplitude) * u(0)

    def mirrored(self):
        """The spring half a period later."""
        return self.turned(self.amplitude)


@dataclass(frozen=True)
class Impulse:
    """Impact law of a pulse: the same impulse whatever the speed is."""

    size: float
    affine = True

    def impulse(self, s, W):
        """Return impulse and derivative, see `Kick`."""
        return np.array([self.size]), np.zeros((1, 1))


@dataclass(frozen=True)
class Pulse(Waving):
    """Impulse at one phase of each period: the momentum along the row changes at once where harmonic omega t + phase = 0.

    Parameters
    ----------
    impulse : float
        Force times time.
    harmonic : int
        Multiple of the excitation frequency, at least 1: pulses in a period.
    phase : float
        Radians.
    dof, row
        Where it acts, see `AtRow`.
    """

    impulse: float = 1.0
    harmonic: int = 1
    phase: float = 0.0

    start = (BEFORE, AFTER)

    def mode(self, key, core):
        """Return "before", the half of a period that ends in the pulse, or "after"."""
        rising = wave(1.0, self.harmonic, self.phase - 0.5 * math.pi)  # the sine: zero at the pulse
        if key == BEFORE:
            return Mode(guards=(Guard(rising, EventKind.CLOCK, (AFTER,), Impulse(self.impulse)),))
        return Mode(guards=(Guard(-rising, EventKind.CLOCK, (BEFORE,), silent=True),))

    def mirrored(self):
        """The image pushes the other way; half a period later its phase is another one where the harmonic is odd."""
        phase = self.phase + (math.pi if self.harmonic % 2 else 0.0)
        return dataclasses.replace(self, impulse=0.0 - self.impulse, phase=math.remainder(phase, 2.0 * math.pi))
