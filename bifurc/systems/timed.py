"""Systems whose loads or stiffness follow time, and systems that advance: a mesh, tongues, a pendulum that turns, a capsule."""
import math

from ..checks import number
from ..elements import ConstantForce, Coulomb, Force, HarmonicForce, ParametricSpring, ParametricStop, RigidStop
from ..system import System, builder


@builder
def mathieu_oscillator(*, zeta: float = 0.0, a: float = 1.0, q: float = 0.2, omega: float = 2.0) -> System:
    """x'' + 2 zeta x' + (a - 2 q cos(omega t)) x = 0.

    At omega = 2 it is Mathieu's equation in its usual form; the state of rest loses its stability in tongues of the plane (a, q).

    Parameters
    ----------
    zeta : float
        Damping.
    a : float
        Mean stiffness.
    q : float
        Half the amplitude of the stiffness.
    omega : float
        Frequency of the stiffness.

    References
    ----------
    E. Mathieu, Memoire sur le mouvement vibratoire d'une membrane de forme elliptique, J. Math. Pures Appl. 13 (1868), 137-203.
    """
    return System(1.0, 2.0 * zeta, a, [ParametricSpring(-2.0 * q)], omega=omega)


@builder
def gear_mesh(*, damping: float = 0.06, load: float = 0.2, variation: float = 0.2, backlash: float = 1.0,
              omega: float = 0.9) -> System:
    """x'' + damping x' + (1 + variation cos(omega t)) f(x) = load, f the distance beyond a play of +-backlash.

    The transmission error of a pair of gears; lengths in units of half the backlash where that is 1.

    Parameters
    ----------
    damping : float
        Of the mesh, whether teeth touch or not.
    load : float
        Mean torque as a force on the teeth.
    variation : float
        Of the mean stiffness of the mesh, its change with the teeth in contact.
    backlash : float
        Half the play.
    omega : float
        Frequency of the meshing teeth.

    References
    ----------
    A. Kahraman, R. Singh, Interactions between time-varying mesh stiffness and clearance non-linearities in a geared system,
    J. Sound Vib. 146 (1991), 135-156.
    """
    number("gear_mesh", "damping", damping, least=0.0)
    teeth = [ParametricStop(backlash, 1.0, variation=variation, side=side) for side in (1, -1)]
    return System(1.0, damping, 0.0, [ConstantForce(load), *teeth], omega=omega)


def _gravity(u, s):
    """Force of gravity on a pendulum."""
    return -math.sin(u)


def _gravity_slope(u, s):
    """Derivatives of `_gravity`."""
    return -math.cos(u), 0.0


@builder
def rotating_pendulum(*, damping: float = 0.1, torque: float = 0.4, amplitude: float = 0.5, omega: float = 4.0) -> System:
    """x'' + damping x' + sin x = torque + amplitude cos(omega t): swings, and turns with shift = {"q0": 2 pi}.

    Parameters
    ----------
    damping : float
        Of the bearing.
    torque, amplitude : float
        Mean and amplitude of the driving torque, that of gravity at a right angle being 1.
    omega : float
        Frequency of the torque.

    Examples
    --------
    >>> import math
    >>> import bifurc as bf
    >>> orbit = bf.find_orbit(bf.systems.rotating_pendulum(), (-4.7, 4.0), shift={"q0": 2 * math.pi})
    >>> orbit.stable
    True
    """
    number("rotating_pendulum", "damping", damping, least=0.0)
    return System(1.0, damping, 0.0, [Force(_gravity, _gravity_slope, site=0), ConstantForce(torque), HarmonicForce(amplitude)],
                  omega=omega)


@builder
def vibro_impact_capsule(*, mass: float = 1.0, inner: float = 0.5, stiffness: float = 1.0, damping: float = 0.02,
                         amplitude: float = 0.6, friction: float = 0.25, gap: float = 0.15, restitution: float = 0.5,
                         omega: float = 1.1) -> System:
    """A capsule on dry ground (coordinate 0) with a mass inside (1) that is shaken against it and strikes its front.

    It creeps: with shift = "q0" its motions are periodic.

    Parameters
    ----------
    mass, inner : float
        Of the capsule and of what moves in it.
    stiffness, damping : float
        Of the spring between them.
    amplitude, omega : float
        Of the force between them.
    friction : float
        Of the ground.
    gap : float
        How far the inner mass is from the front when the spring is relaxed.
    restitution : float
        Of the front.

    References
    ----------
    Y. Liu, M. Wiercigroch, E. Pavlovskaia, H. Yu, Modelling of a vibro-impact capsule system, Int. J. Mech. Sci. 66 (2013), 2-11.

    Examples
    --------
    >>> import bifurc as bf
    >>> orbit = bf.find_orbit(bf.systems.vibro_impact_capsule(), shift="q0")
    >>> f"{orbit.shift['q0']:.6f}"
    '-0.382822'
    """
    number("vibro_impact_capsule", "damping", damping, least=0.0)

    def between(value):
        return [[value, -value], [-value, value]]

    return System([[mass, 0.0], [0.0, inner]], between(damping), between(stiffness), [
        HarmonicForce(amplitude, row=(-1.0, 1.0)), Coulomb(friction), RigidStop(gap, restitution, row=(-1.0, 1.0))], omega=omega)
