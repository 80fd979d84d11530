"""Oscillators of one degree of freedom with stops and springs (Shaw and Holmes 1983; Zhang 2008, chapters 1 and 2)."""
from ..checks import number
from ..elements import BaseMotion, ConstantForce, CubicSpring, ElasticStop, HarmonicForce, RigidStop
from ..system import System, builder


@builder
def impact_oscillator(*, zeta: float = 0.05, omega: float = 0.5, amplitude: float = 0.52, gap: float = 1.0,
                      restitution: float = 0.7) -> System:
    """x'' + 2 zeta x' + x = amplitude cos(omega t), x <= gap, x'+ = -restitution x'-.

    Time is in units of the free oscillator (unit natural frequency).  With the defaults, raising omega from 0.5 leads
    from free vibration through two grazings into impacting motion that coexists with the free one.

    Parameters
    ----------
    zeta : float
        Damping ratio, dimensionless.
    omega : float
        Excitation frequency over natural frequency.
    amplitude : float
        Static deflection under the load, in the unit of `gap`.
    gap : float
        Distance of the stop; zero and negative (preloaded) allowed.
    restitution : float
        0 (plastic) to 1 (elastic).

    References
    ----------
    S. W. Shaw, P. J. Holmes, A periodically forced piecewise linear oscillator, J. Sound Vib. 90 (1983), 129-155.
    """
    return System(1.0, 2.0 * zeta, 1.0, (HarmonicForce(amplitude), RigidStop(gap, restitution)), omega=omega)


@builder
def moving_frame_impact_oscillator(*, zeta: float = 0.05, omega: float = 1.5, amplitude: float = 0.4, gap: float = 1.0,
                                   restitution: float = 0.7, damper: str = "frame") -> System:
    """Impact oscillator in a frame that moves as X = amplitude cos(omega t); the coordinate is relative to the frame.

    z'' + 2 zeta z' + z = amplitude omega^2 cos(omega t), z <= gap; with the damper fixed to the ground the load is
    amplitude (omega^2 cos(omega t) + 2 zeta omega sin(omega t)).  With the defaults free and impacting motion coexist.

    Parameters
    ----------
    zeta, omega, gap, restitution : float
        As for `impact_oscillator`.
    amplitude : float
        Amplitude of the frame, in the unit of `gap`.
    damper : {"frame", "ground"}
        What the damper is fixed to; spring and stop are fixed to the frame.

    References
    ----------
    Zhang Sijin, impact dynamics (2008), figure 1.1.
    """
    elements = (BaseMotion(amplitude, damper=damper), RigidStop(gap, restitution))
    return System(1.0, 2.0 * zeta, 1.0, elements, omega=omega)


@builder
def two_sided_impact_oscillator(*, zeta: float = 0.1, omega: float = 2.0, amplitude: float = 3.0, gap: float = 1.0,
                                restitution: float = 0.7) -> System:
    """x'' + 2 zeta x' + x = amplitude cos(omega t), |x| <= gap.

    Symmetric under x(t) -> -x(t + half a period).  With the defaults the motion hits both stops once a period;
    at amplitude 3.397988672 the symmetry breaks in a pitchfork.

    Parameters
    ----------
    zeta, omega, amplitude, restitution : float
        As for `impact_oscillator`.
    gap : float
        Distance of each stop from the middle, above 0.

    References
    ----------
    Zhang Sijin, impact dynamics (2008), section 2.3.
    """
    number("two_sided_impact_oscillator", "gap", gap, above=0.0)
    stops = (RigidStop(gap, restitution, side=1), RigidStop(gap, restitution, side=-1))
    return System(1.0, 2.0 * zeta, 1.0, (HarmonicForce(amplitude), *stops), omega=omega)


@builder
def bilinear_oscillator(*, zeta: float = 0.05, omega: float = 0.5, amplitude: float = 0.3, gap: float = 0.5,
                        stiffness_ratio: float = 5.0) -> System:
    """x'' + 2 zeta x' + P(x) = amplitude cos(omega t), P piecewise linear with a corner at the gap.

    P = x below the gap, stiffness_ratio x + (1 - stiffness_ratio) gap above it.  With the defaults the branch in omega
    grazes, folds and flips twice each up to omega = 2.5.

    Parameters
    ----------
    zeta, omega, amplitude : float
        As for `impact_oscillator`.
    gap : float
        Where the second spring begins.
    stiffness_ratio : float
        Stiffness above the gap over that below, above 0.

    References
    ----------
    Zhang Sijin, impact dynamics (2008), eqs. 1.5 and 1.6 (its omega_b squared is `stiffness_ratio`).
    """
    number("bilinear_oscillator", "stiffness_ratio", stiffness_ratio, above=0.0)
    spring = ElasticStop(gap, stiffness_ratio - 1.0)
    return System(1.0, 2.0 * zeta, 1.0, (HarmonicForce(amplitude), spring), omega=omega)


@builder
def duffing_oscillator(*, zeta: float = 0.05, omega: float = 0.5, amplitude: float = 0.3, alpha: float = 1.0,
                       beta: float = 1.0) -> System:
    """x'' + 2 zeta x' + alpha x + beta x^3 = amplitude cos(omega t).

    Parameters
    ----------
    zeta, omega, amplitude : float
        As for `impact_oscillator`.
    alpha : float
        Linear stiffness; negative: two wells.
    beta : float
        Cubic stiffness, in 1 / (unit of x)^2.

    References
    ----------
    G. Duffing, Erzwungene Schwingungen bei veraenderlicher Eigenfrequenz (1918).
    """
    return System(1.0, 2.0 * zeta, alpha, (HarmonicForce(amplitude), CubicSpring(beta)), omega=omega)


@builder
def bouncing_ball(*, omega: float = 1.0, amplitude: float = 0.5, restitution: float = 0.8,
                  gravity: float = 1.0) -> System:
    """Ball on a table that moves as amplitude cos(omega t): x'' = -gravity, x >= amplitude cos(omega t).

    The coordinate is the height of the ball; restitution acts on the speed relative to the table.  Bouncing once a
    period exists for amplitude omega^2 / gravity >= pi (1 - r) / (1 + r); below 1 it coexists with rest on the table.

    Parameters
    ----------
    omega : float
        Frequency of the table, radians per time.
    amplitude : float
        Amplitude of the table, length.
    restitution : float
        0 (plastic) to 1 (elastic).
    gravity : float
        Length per time squared.

    References
    ----------
    P. J. Holmes, The dynamics of repeated impacts with a sinusoidally vibrating table, J. Sound Vib. 84 (1982),
    173-189.
    """
    table = RigidStop(0.0, restitution, side=-1, amplitude=amplitude, harmonic=1)
    return System(1.0, 0.0, 0.0, (ConstantForce(-gravity), table), omega=omega)
