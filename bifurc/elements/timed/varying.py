"""Springs and stops whose stiffness varies as a cosine of the excitation.

The change of stiffness is a second row of their site, which no coordinate moves: their forces are laws of both rows.
"""
import dataclasses
from dataclasses import dataclass

import numpy as np

from ...checks import choice, whole
from ..atrow import Waving
from ..kinds import EventKind
from ..local import Affine, affine, u, wave
from ..mode import Guard, Law, Mode
from ..site import Rows
from ..stops import FREE, ElasticStop


def varied(u0, u1, s0, s1, stiffness):
    """Force of a spring on a row, whose stiffness has the second row added; the second row feels nothing."""
    return -(stiffness + u1) * u0, 0.0


def varied_slope(u0, u1, s0, s1, stiffness):
    """Derivatives of `varied` by u0, u1, s0, s1."""
    return -(stiffness + u1), -u0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0


def beside(site: Rows, motion: Affine) -> Rows:
    """Return a site of one row with a second one that no coordinate moves: it is the ``motion``."""
    n = site.R.shape[1]
    return Rows(np.vstack([site.R, np.zeros((1, n))]), (*(site.base or (affine(0.0),)), motion),
                (*(site.drift or (0.0,)), 0.0) if site.drift else ())


@dataclass(frozen=True)
class ParametricSpring(Waving):
    """Spring whose stiffness varies: force -(stiffness + amplitude cos(harmonic omega t + phase)) u (Mathieu).

    Parameters
    ----------
    amplitude : float
        Of the change of stiffness, force per length.
    stiffness : float
        Its mean, force per length; 0 where the stiffness matrix has it.
    harmonic : int
        Multiple of the excitation frequency, at least 1.
    phase : float
        Radians.
    dof, row
        Where it acts, see `AtRow`.

    Examples
    --------
    >>> import bifurc as bf
    >>> mathieu = bf.System(1.0, 0.0, 2.0, [bf.elements.ParametricSpring(-2.0)], omega=2.0)
    >>> print(f"{bf.find_orbit(mathieu, [0.0, 0.0]).multipliers.sum().real:.9f}")
    -1.554649354
    """

    amplitude: float = 0.1
    stiffness: float = 0.0
    harmonic: int = 1
    phase: float = 0.0

    def site(self, n):
        """Return the row it acts on, and the change of stiffness."""
        return beside(super().site(n), wave(self.amplitude, self.harmonic, self.phase))

    def mode(self, key, core):
        """Return the only mode."""
        return Mode(force=Law(varied, (self.stiffness,), varied_slope))

    def mirrored(self):
        """Odd harmonics change sign in half a period."""
        return dataclasses.replace(self, amplitude=0.0 - self.amplitude) if self.harmonic % 2 else self


def pressed(u0, u1, s0, s1, stiffness, damping, gap, side):
    """Force of a stop whose stiffness has the second row added."""
    return -side * ((stiffness + u1) * (side * u0 - gap) + damping * side * s0), 0.0


def pressed_slope(u0, u1, s0, s1, stiffness, damping, gap, side):
    """Derivatives of `pressed` by u0, u1, s0, s1."""
    return -(stiffness + u1), -side * (side * u0 - gap), -damping, 0.0, 0.0, 0.0, 0.0, 0.0


@dataclass(frozen=True)
class ParametricStop(ElasticStop):
    """Elastic stop whose stiffness varies, as that of teeth in mesh; two of opposite sides are a backlash.

    It is stiffness + variation cos(variation_harmonic omega t + variation_phase).

    Parameters
    ----------
    gap, stiffness, damping
        Of the stop, see `ElasticStop`.
    variation : float
        Amplitude of the change of stiffness, force per length.
    variation_harmonic : int
        Multiple of the excitation frequency, at least 1.
    variation_phase : float
        Radians.
    release : {"penetration"}
        Contact ends at zero penetration.
    side, amplitude, phase, harmonic, dof, row
        Side, motion and place of the stop, see `Wall`.
    """

    variation: float = 0.1
    variation_phase: float = 0.0
    variation_harmonic: int = 1

    def __post_init__(self):
        super().__post_init__()
        name = type(self).__name__
        choice(name, "release", self.release, ("penetration",))
        object.__setattr__(self, "variation_harmonic", whole(name, "variation_harmonic", self.variation_harmonic, least=1))

    def site(self, n):
        """Return the row, seen from the stop, and the change of stiffness."""
        return beside(super().site(n), wave(self.variation, self.variation_harmonic, self.variation_phase))

    def mode(self, key, core):
        """Return "free" or "contact"."""
        if key == FREE:
            return super().mode(key, core)
        return Mode(force=Law(pressed, (self.stiffness, self.damping, self.gap, float(self.side)), pressed_slope),
                    guards=(Guard(self.gap - self.side * u(0), EventKind.SEPARATION, (FREE,)),))

    def stored_energy(self, u):
        """The stiffness does work: none is stored."""
        return None

    def mirrored(self):
        """The stop on the other side, its stiffness half a period later."""
        image = super().mirrored()
        return dataclasses.replace(image, variation=0.0 - self.variation) if self.variation_harmonic % 2 else image
