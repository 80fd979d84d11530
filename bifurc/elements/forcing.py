"""Loads: harmonic, periodic and constant forces, and the inertia load of a moving frame (specs: Zhang 2008, section 1.2)."""
import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..checks import choice, floats, number, refused, vector, whole
from .atrow import AtRow, Waving
from .element import Element
from .local import affine, cos, rate, sin, wave
from .mode import Mode
from .site import Rows

MOST = 64  # harmonics of a load that is given as a function or a table, where none are asked for
RESOLVED = 1e-12  # of the largest value of a load: what its harmonics may miss
BETWEEN = 4  # samples at which harmonics are tried, a sample that they were taken from


@dataclass(frozen=True)
class HarmonicForce(Waving):
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


@dataclass(frozen=True)
class PeriodicForce(AtRow):
    """Any periodic force: amplitude times a sum of harmonics, mean + sum of cosines[k-1] cos(k theta) + sines[k-1] sin(k theta).

    theta = omega t + phase.  `PeriodicForce.of` makes one from a function or a table; for one with jumps see `SquareForce`.

    Parameters
    ----------
    cosines, sines : sequence of float
        Of the harmonics from the first on; the shorter one is filled up with zeros.
    mean : float
        Constant part.
    amplitude : float
        Factor of all.
    phase : float
        Radians of the first harmonic: the wave is earlier by phase/omega.
    dof, row
        Where it acts, see `AtRow`.
    """

    cosines: tuple[float, ...] = (1.0,)
    sines: tuple[float, ...] = (0.0,)
    mean: float = 0.0
    amplitude: float = 1.0
    phase: float = 0.0

    def __post_init__(self):
        super().__post_init__()
        name = type(self).__name__
        cosines, sines = (vector(name, field, getattr(self, field)) for field in ("cosines", "sines"))
        most = max(len(cosines), len(sines))
        object.__setattr__(self, "cosines", cosines + (0.0,) * (most - len(cosines)))
        object.__setattr__(self, "sines", sines + (0.0,) * (most - len(sines)))

    @classmethod
    def of(cls, load: Callable | object, harmonics: int | None = None, *, error: float = RESOLVED, amplitude: float = 1.0,
           phase: float = 0.0, dof=0, row=None, label: str | None = None) -> "PeriodicForce":
        """Return the force with the values of a function or of a table, as far as harmonics give them.

        Parameters
        ----------
        load : callable or array (m,)
            ``load(theta)``: the force at the phase theta = omega t, radians, of period 2 pi; or its values at m phases
            2 pi j/m, evenly over one period.
        harmonics : int, optional
            How many; default: as many as leave no more than ``error``, at most 64.
        error : float
            How far the sum may be from the load anywhere in the period, of its largest size.  A table is known at its phases
            alone.
        amplitude, phase, dof, row, label
            See the class.

        Raises
        ------
        ValueError
            When harmonics leave more than ``error``: what they leave is named.  A load with jumps or corners needs a larger
            error, or `SquareForce`.

        Examples
        --------
        >>> import math
        >>> from bifurc.elements import PeriodicForce
        >>> force = PeriodicForce.of(lambda theta: math.cos(theta) ** 3)
        >>> [round(value, 12) for value in force.cosines]
        [0.75, 0.0, 0.25]
        """
        most = MOST if harmonics is None else whole("PeriodicForce.of", "harmonics", harmonics, least=1)
        number("PeriodicForce.of", "error", error, above=0.0)
        known = _sampled(load, BETWEEN * 2 * (most + 1)) if callable(load) else floats(load)
        if known is None or known.ndim != 1 or known.size < 3 or not np.isfinite(known).all():
            raise refused("PeriodicForce.of", "load", load,
                          "a function of the phase, or at least three finite values over one period")
        most = min(most, (known.size - 1) // 2)
        found = np.fft.rfft(known) / known.size
        largest = float(np.abs(known).max())
        for count in [most] if harmonics is not None else range(1, most + 1):
            part = np.where(np.arange(found.size) <= count, found, 0.0)
            left = float(np.abs(np.fft.irfft(part * known.size, known.size) - known).max())
            if left <= error * largest:
                break
        else:
            count = most
        if left > error * largest:
            raise ValueError(f"PeriodicForce.of: {count} harmonics leave {left / largest:.3g} of the largest value of the load, "
                             f"error = {error:g} is allowed; ask for more harmonics, a larger error, or for jumps SquareForce")
        cosines, sines = 2.0 * found[1:count + 1].real, -2.0 * found[1:count + 1].imag
        noise = np.finfo(float).eps * largest  # of a sum of samples: what is below it is zero
        cosines[np.abs(cosines) < noise], sines[np.abs(sines) < noise] = 0.0, 0.0
        mean = float(found[0].real)
        return cls(tuple(cosines.tolist()), tuple(sines.tolist()), mean if abs(mean) >= noise else 0.0, amplitude, phase,
                   dof=dof, row=row, label=label)

    def values(self, theta) -> np.ndarray:
        """Return the force at phases ``theta`` (...), radians."""
        at = np.multiply.outer(np.asarray(theta, float) + self.phase, np.arange(1, len(self.cosines) + 1))
        return self.amplitude * (self.mean + np.cos(at) @ np.array(self.cosines) + np.sin(at) @ np.array(self.sines))

    @property
    def harmonics(self):
        """All that are not zero."""
        return tuple(k for k, parts in enumerate(zip(self.cosines, self.sines, strict=True), 1) if any(parts))

    def mode(self, key, core):
        """Return the only mode."""
        force = affine(self.amplitude * self.mean)
        for k in self.harmonics:
            a, b = self.amplitude * self.cosines[k - 1], self.amplitude * self.sines[k - 1]
            c, d = math.cos(k * self.phase), math.sin(k * self.phase)
            force = force + (a * c + b * d) * cos(k) + (b * c - a * d) * sin(k)
        return Mode(force=(force,))

    def mirrored(self):
        """Odd harmonics are their own image; even ones and the mean change sign."""
        cosines, sines = (tuple(value if k % 2 else 0.0 - value for k, value in enumerate(parts, 1))
                          for parts in (self.cosines, self.sines))
        return dataclasses.replace(self, cosines=cosines, sines=sines, mean=0.0 - self.mean)


def _sampled(load: Callable, count: int) -> np.ndarray | None:
    """Return values of a function at phases evenly over one period, the last of which is that of the first; None: not numbers."""
    theta = 2.0 * np.pi * np.arange(count + 1) / count
    try:
        found = floats([load(float(at)) for at in theta])
    except Exception as error:
        raise ValueError(f"PeriodicForce.of: load raised {type(error).__name__} within a period: {error}") from error
    if found is None or found.ndim != 1:
        return None
    if abs(found[-1] - found[0]) > 1e-9 * np.abs(found).max():
        raise ValueError(f"PeriodicForce.of: load is {found[0]:.6g} at phase 0 and {found[-1]:.6g} at 2 pi; it must have the "
                         "period 2 pi")
    return found[:-1]
