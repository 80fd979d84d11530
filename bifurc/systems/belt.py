"""A mass on a moving belt: stick-slip and friction-induced vibration (Popp and Stelter 1990; Hetzler, Schwarzer, Seemann 2007)."""
from ..checks import choice, number, refused
from ..elements import Coulomb, CubicFriction, Stribeck
from ..elements.element import Element
from ..system import System, builder

LAWS = ("coulomb", "exponential", "cubic")


@builder
def belt_oscillator(*, zeta: float = 0.05, belt_speed: float = 0.3, static: float = 1.0, kinetic: float = 0.6,
                    law: str = "coulomb", decay_speed: float = 0.5, falling: float = 0.4, rising: float = 0.1) -> System:
    """x'' + 2 zeta x' + x = F(belt_speed - x'): friction carries the mass along until its spring pulls it back.

    Time is in units of the free oscillator.  F(u) = sgn(u) f(|u|) with stick up to f(0+):

    * ``law="coulomb"``: stick up to `static`, slip at `kinetic`;
    * ``law="exponential"``: f(u) = kinetic + (static - kinetic) exp(-u/decay_speed);
    * ``law="cubic"``: f(u) = static - falling u + rising u^3.

    There is no excitation: the period is part of the solution.  With the defaults the mass sticks for 2.09 and slips for 4.70
    units of time; raising the belt speed to V* = 0.43923704964635 the arc of slip touches the speed of the belt, and the
    cycle ends while the stick still lasts 0.91.  Under the falling laws steady sliding loses its stability below
    decay_speed ln((static - kinetic)/(2 zeta decay_speed)), or sqrt((falling - 2 zeta)/(3 rising)), in a Hopf point.

    Parameters
    ----------
    zeta : float
        Damping ratio, dimensionless.
    belt_speed : float
        Speed of the belt over that of a unit length in a radian of the free oscillator; any sign.
    static : float
        Limit of stick over the stiffness, length; at least `kinetic`.
    kinetic : float
        Friction of slip over the stiffness, length, at least 0 (exponential: that at high speed); not used by the cubic law.
    law : {"coulomb", "exponential", "cubic"}
    decay_speed : float
        Over which the exponential law falls, above 0; not used by the others.
    falling, rising : float
        Of the cubic law, over the stiffness; not used by the others.

    References
    ----------
    K. Popp, P. Stelter, Stick-slip vibrations and chaos, Phil. Trans. R. Soc. A 332 (1990), 89-105.
    H. Hetzler, D. Schwarzer, W. Seemann, Analytical investigation of steady-state stability and Hopf-bifurcations occurring
    in sliding friction oscillators, Commun. Nonlinear Sci. Numer. Simul. 12 (2007), 83-99.
    """
    choice("belt_oscillator", "law", law, LAWS)
    if law == "coulomb":
        number("belt_oscillator", "kinetic", kinetic, least=0.0)
        if not static >= kinetic:
            raise refused("belt_oscillator", "static", static, f"at least kinetic = {kinetic:g}")
    contact: Element
    if law == "coulomb":
        contact = Coulomb(kinetic, static=static, belt_speed=belt_speed)
    elif law == "exponential":
        contact = Stribeck(kinetic, static, decay_speed, belt_speed=belt_speed)
    else:
        contact = CubicFriction(static, falling, rising, belt_speed=belt_speed)
    return System(1.0, 2.0 * zeta, 1.0, (contact,))
