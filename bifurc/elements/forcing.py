"""Loads: harmonic and constant forces, and the inertia load of a moving frame (specs: Zhang 2008, section 1.2)."""
import dataclasses
from dataclasses import dataclass

import numpy as np

from ..checks import choice, vector, whole
from .atrow import AtRow
from .element import Element
from .local import affine, rate, wave
from .mode import Mode
from .site import Rows


@dataclass(frozen=True)
class HarmonicForce(AtRow):
    """Force amplitude cos(harmonic omega t + phase) on one degree of freedom, or spread over several.

    Parameters
    ----------
    amplitude : float
        In the units of the equations of motion.
    harmonic : int
        Multiple of the excitation frequency, at least 1.
    phase : float
        Radians.
    dof, row
        Where it acts, see `AtRow`.
    """

    amplitude: float = 1.0
    harmonic: int = 1
    phase: float = 0.0

    def __post_init__(self):
        super().__post_init__()
        object.__setattr__(self, "harmonic", whole(type(self).__name__, "harmonic", self.harmonic, least=1))

    @property
    def harmonics(self):
        """The one harmonic."""
        return (self.harmonic,)

    def mode(self, key, core):
        """Return the only mode."""
        return Mode(force=(wave(self.amplitude, self.harmonic, self.phase),))

    def mirrored(self):
        """Odd harmonics are their own image; even ones change sign."""
        return self if self.harmonic % 2 else dataclasses.replace(self, amplitude=0.0 - self.amplitude)


@dataclass(frozen=True)
class ConstantForce(AtRow):
    """Constant force on one degree of freedom, or spread over several.

    Parameters
    ----------
    force : float
        In the units of the equations of motion.
    dof, row
        Where it acts, see `AtRow`.
    """

    force: float = 1.0

    def mode(self, key, core):
        """Return the only mode."""
        return Mode(force=(affine(self.force),))

    def stored_energy(self, u):
        """Energy in the field of the load."""
        return -self.force * u[0]

    def mirrored(self):
        """The image pushes the other way."""
        return dataclasses.replace(self, force=0.0 - self.force)


@dataclass(frozen=True)
class BaseMotion(Element):
    """Load of a moving frame: coordinates are relative to X(t) = amplitude cos(harmonic omega t + phase).

    With z = x - row X the load is -M row X'', and with dampers to the ground also -C row X'.

    Parameters
    ----------
    amplitude : float
        Amplitude of the frame, length.
    harmonic : int
        Multiple of the excitation frequency, at least 1.
    phase : float
        Radians.
    damper : {"frame", "ground"}
        What the dampers of the system are fixed to; its springs are fixed to the frame.
    row : sequence of float, optional
        How far each coordinate is carried by the frame; default: ones.
    """

    amplitude: float = 1.0
    harmonic: int = 1
    phase: float = 0.0
    damper: str = "frame"
    row: tuple[float, ...] | None = None

    def __post_init__(self):
        super().__post_init__()
        name = type(self).__name__
        object.__setattr__(self, "harmonic", whole(name, "harmonic", self.harmonic, least=1))
        choice(name, "damper", self.damper, ("frame", "ground"))
        if self.row is not None:
            object.__setattr__(self, "row", vector(name, "row", self.row))

    @property
    def harmonics(self):
        """The one harmonic."""
        return (self.harmonic,)

    def site(self, n):
        """Return all coordinates."""
        if self.row is not None and len(self.row) != n:
            raise ValueError(f"BaseMotion: row = {self.row!r} is not allowed; it must be {n} factors")
        return Rows.of(np.eye(n), n)

    def mode(self, key, core):
        """Return the only mode."""
        carried = np.ones(len(core.mass)) if self.row is None else np.array(self.row)
        speed = rate(wave(self.amplitude, self.harmonic, self.phase), core.omega)
        acceleration = rate(speed, core.omega)
        inertia = core.mass @ carried
        if self.damper == "frame":
            return Mode(force=tuple(acceleration * -m for m in inertia))
        drag = core.damping @ carried
        return Mode(force=tuple(acceleration * -m - speed * c for m, c in zip(inertia, drag, strict=True)))

    def mirrored(self):
        """Odd harmonics are their own image; even ones change sign."""
        return self if self.harmonic % 2 else dataclasses.replace(self, amplitude=0.0 - self.amplitude)
