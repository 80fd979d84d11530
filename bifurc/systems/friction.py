"""Oscillators with dry friction: rigid (Den Hartog 1931; Li 2019) and elastic (Jenkins 1962)."""
import math

from ..checks import number
from ..elements import Coulomb, HarmonicForce, Jenkins
from ..system import System, builder


@builder
def dry_friction_oscillator(*, zeta: float = 0.1, omega: float = 1.0, amplitude: float = 1.4, friction: float = 1.0,
                            friction_negative: float | None = None, load_amplitude: float | None = None,
                            load_phase: float | None = None) -> System:
    """x'' + 2 zeta x' + x + friction load(t) Sgn(x') = amplitude sin(omega t), Sgn set-valued at rest.

    Time is in units of the free oscillator.  With the defaults the mass sticks twice a period; raising the amplitude
    through 1.48820269035416898 the stops become instants.  Motion exists for amplitude > friction only.

    Parameters
    ----------
    zeta : float
        Damping ratio, dimensionless.
    omega : float
        Excitation frequency over natural frequency.
    amplitude, friction : float
        Load and friction limit over stiffness, lengths.
    friction_negative : float, optional
        Friction limit of motion with x' < 0; None: as `friction`.
    load_amplitude, load_phase : float, optional
        Normal load 1 + load_amplitude cos(omega t + load_phase) over its mean; the contact separates where that is
        negative.  None: constant, and phase 0.

    References
    ----------
    J. P. Den Hartog, Forced vibrations with combined Coulomb and viscous friction, Trans. ASME 53 (1931), 107-115.
    Li Peng, On a numerical method for dry friction oscillators, Open J. Acoust. Vib. 7 (2019); its Omega, xi, alpha,
    beta are `omega`, `zeta`, `amplitude`, `friction`, and its velocity is v/omega.
    """
    number("dry_friction_oscillator", "friction", friction, least=0.0)
    if load_phase is not None and load_amplitude is None:
        raise ValueError(f"dry_friction_oscillator: load_phase = {load_phase!r} is not allowed with a constant load; "
                         "give load_amplitude, or leave it out")
    contact = Coulomb(friction, friction_negative, load_amplitude=load_amplitude, load_phase=load_phase or 0.0)
    return System(1.0, 2.0 * zeta, 1.0, (HarmonicForce(amplitude, phase=-0.5 * math.pi), contact), omega=omega)


@builder
def jenkins_oscillator(*, zeta: float = 0.01, omega: float = 1.1, amplitude: float = 1.0, stiffness: float = 1.0,
                       limit: float = 1.0) -> System:
    """x'' + 2 zeta x' + x + Jenkins(x) = amplitude cos(omega t): a spring that slips at a force limit, beside the main one.

    With the defaults the slider slips twice a period; below the amplitude at which it would slip the system is linear
    with natural frequency sqrt(1 + stiffness).

    Parameters
    ----------
    zeta : float
        Damping ratio of the oscillator without slider, dimensionless.
    omega : float
        Excitation frequency over natural frequency without slider.
    amplitude : float
        Load over main stiffness, length.
    stiffness : float
        Of the spring in series with the slider, over the main stiffness; above 0.
    limit : float
        Largest force of the slider over the main stiffness, length; 0: no contact.

    References
    ----------
    G. M. Jenkins, Analysis of the stress-strain relationships in reactor grade graphite, Brit. J. Appl. Phys. 13 (1962).
    """
    return System(1.0, 2.0 * zeta, 1.0, (HarmonicForce(amplitude), Jenkins(stiffness, limit)), omega=omega)
