"""Rotors that rub: elastic and rigid stators, offset and gravity, casings, oil film.  Zhang 2008, chapters 4 and 5.

Displacements are measured by the clearance, time by the natural frequency of the shaft; q = (x, y) in the fixed frame.
"""
import math

import numpy as np

from ..checks import number
from ..elements import ConstantForce, ElasticStator, HarmonicForce, OilFilm, RigidStator
from ..system import System, builder


def unbalance(size: float) -> tuple[HarmonicForce, HarmonicForce]:
    """Return the load ``size`` (cos nu t, sin nu t) of a rotor that spins with the excitation frequency."""
    return (HarmonicForce(size, dof=0, label="unbalance_x"),
            HarmonicForce(size, dof=1, phase=-0.5 * math.pi, label="unbalance_y"))


@builder
def jeffcott_rotor(*, zeta: float = 0.05, nu: float = 1.04, eccentricity: float = 0.2, stiffness: float = 30.0,
                   friction: float = 0.02, disk_radius: float = 20.0, contact_damping: float = 0.0, offset: float = 0.6,
                   gravity: float = 0.0) -> System:
    """Jeffcott rotor in an elastic stator with Coulomb rub.

    z'' + 2 zeta z' + z + F = eccentricity nu^2 exp(i nu t) - i gravity, z = x + i y; from |z - offset| = 1 on the stator
    pushes back along n with max(0, stiffness (|z - offset| - 1) + contact_damping d') and rubs with friction times that
    against the sliding speed, tangential speed + disk_radius nu.  With the defaults the rotor rubs once a turn; raising nu
    through 1.0854564383082 the period doubles.

    Parameters
    ----------
    zeta : float
        Damping ratio of the shaft.
    nu : float
        Spin over natural frequency, above 0; 2 pi / nu is the forcing period.
    eccentricity : float
        Of the mass, over the clearance.
    stiffness : float
        Of the stator over that of the shaft, above 0.
    friction : float
        Coefficient of the rub.
    disk_radius : float
        Over the clearance.
    contact_damping : float
        Of the stator; contact ends where the force vanishes.
    offset : float
        Of the centre of the stator along x, over the clearance; from -1 to 1.
    gravity : float
        Static sag over the clearance.

    References
    ----------
    Zhang Sijin, impact dynamics (2008), sections 4.2 and 5.2.
    """
    number("jeffcott_rotor", "nu", nu, above=0.0)
    number("jeffcott_rotor", "offset", offset, least=-1.0, most=1.0)
    number("jeffcott_rotor", "disk_radius", disk_radius, least=0.0)
    stator = ElasticStator(stiffness=stiffness, damping=contact_damping, friction=friction, centre_x=offset,
                           surface_speed=disk_radius * nu, label="stator")
    eye = np.eye(2)
    return System(eye, 2.0 * zeta * eye, eye, (*unbalance(eccentricity * nu**2), ConstantForce(-gravity, dof=1, label="gravity"),
                                               stator), omega=nu)


@builder
def rigid_stator_rotor(*, zeta: float = 0.1, nu: float = 1.7, eccentricity: float = 0.3, restitution: float = 0.5,
                       friction: float = 0.1, disk_radius: float = 2.0, offset: float = 0.5, gravity: float = 0.0) -> System:
    """Jeffcott rotor in a rigid stator with Coulomb friction at the impacts, and sliding or rolling on the wall.

    As `jeffcott_rotor`, with |z - offset| <= 1: an impact turns the radial speed u to -restitution u, and changes the
    tangential speed by friction (1 + restitution) u against the sliding, at most until that stops.  With the defaults an orbit
    of one impact a turn coexists with sustained rub; the free motion grazes at nu = 0.80424764150707548.

    Parameters
    ----------
    restitution : float
        From 0 to 1.
    zeta, nu, eccentricity, friction, disk_radius, offset, gravity
        As for `jeffcott_rotor`.

    References
    ----------
    Zhang Sijin, impact dynamics (2008), sections 4.3 and 4.4.
    """
    number("rigid_stator_rotor", "nu", nu, above=0.0)
    number("rigid_stator_rotor", "offset", offset, least=-1.0, most=1.0)
    number("rigid_stator_rotor", "disk_radius", disk_radius, least=0.0)
    stator = RigidStator(restitution=restitution, friction=friction, centre_x=offset, surface_speed=disk_radius * nu,
                         label="stator")
    eye = np.eye(2)
    return System(eye, 2.0 * zeta * eye, eye, (*unbalance(eccentricity * nu**2), ConstantForce(-gravity, dof=1, label="gravity"),
                                               stator), omega=nu)


@builder
def rotor_in_casing(*, zeta: float = 0.05, nu: float = 1.05, eccentricity: float = 0.2, stiffness: float = 100.0,
                    friction: float = 0.05, disk_radius: float = 20.0, casing_mass: float = 2.0, casing_damping: float = 2.0,
                    casing_stiffness: float = 50.0) -> System:
    """Jeffcott rotor that rubs against an elastically suspended casing; q = (x, y) of the rotor, then of the casing.

    As `jeffcott_rotor` without offset, with the contact in q = z - z_s, and

    casing_mass z_s'' + casing_damping z_s' + casing_stiffness z_s = F.

    Parameters
    ----------
    casing_mass, casing_damping, casing_stiffness : float
        Over mass, and units, of the rotor; the mass above 0.
    zeta, nu, eccentricity, stiffness, friction, disk_radius
        As for `jeffcott_rotor`.

    References
    ----------
    Zhang Sijin, impact dynamics (2008), section 5.3.
    """
    number("rotor_in_casing", "nu", nu, above=0.0)
    number("rotor_in_casing", "casing_mass", casing_mass, above=0.0)
    stator = ElasticStator(stiffness=stiffness, friction=friction, against_x=2, against_y=3, surface_speed=disk_radius * nu,
                           label="stator")
    M, C, K = (np.diag([own, own, other, other]) for own, other in (
        (1.0, casing_mass), (2.0 * zeta, casing_damping), (1.0, casing_stiffness)))
    return System(M, C, K, (*unbalance(eccentricity * nu**2), stator), omega=nu)


@builder
def rotating_frame_rotor(*, zeta: float = 0.05, nu: float = 1.05, eccentricity: float = 0.2, stiffness: float = 25.0,
                         friction: float = 0.1, disk_radius: float = 20.0, contact_damping: float = 0.0,
                         casing_mass: float | None = None, casing_damping: float = 2.0, casing_stiffness: float = 50.0) -> System:
    """Concentric `jeffcott_rotor` in coordinates that turn with the spin, w = z exp(-i nu t): a system without excitation.

    Synchronous rub is an equilibrium here, partial rub a limit cycle (a torus in the fixed frame).  With a casing mass it is
    `rotor_in_casing`, q = (rotor, casing).

    w'' + 2 (zeta + i nu) w' + (1 - nu^2 + 2 i zeta nu) w + F = eccentricity nu^2.

    Parameters
    ----------
    casing_mass : float, optional
        None: the stator stands still, and the other parameters of the casing mean nothing.
    zeta, nu, eccentricity, stiffness, friction, disk_radius, contact_damping, casing_damping, casing_stiffness
        As for `jeffcott_rotor` and `rotor_in_casing`; nu may be 0 or negative (backward spin).

    References
    ----------
    Zhang Sijin, impact dynamics (2008), sections 4.2 and 5.3.
    """
    bodies = [(1.0, 2.0 * zeta, 1.0)]
    if casing_mass is not None:
        bodies.append((number("rotating_frame_rotor", "casing_mass", casing_mass, above=0.0), casing_damping, casing_stiffness))
    n = 2 * len(bodies)
    M, C, K = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    turn = np.array([[0.0, -1.0], [1.0, 0.0]])
    for i, (m, c, k) in enumerate(bodies):
        own = slice(2 * i, 2 * i + 2)
        M[own, own] = m * np.eye(2)
        C[own, own] = c * np.eye(2) + 2.0 * m * nu * turn
        K[own, own] = (k - m * nu**2) * np.eye(2) + c * nu * turn
    second = (None, None) if casing_mass is None else (2, 3)
    stator = ElasticStator(stiffness=stiffness, damping=contact_damping, friction=friction, surface_speed=disk_radius * nu,
                           frame_spin=nu, label="stator", against_x=second[0], against_y=second[1])
    return System(M, C, K, (ConstantForce(eccentricity * nu**2, dof=0, label="unbalance"), stator))


@builder
def oil_film_rotor(*, speed_ratio: float = 1.0, unbalance: float = 0.2, load: float = 1.0, mass: float = 10.0) -> System:
    """Rigid journal on a short oil film under its weight and an unbalance; q = (x, y) over the clearance, time is the angle.

    M q'' = f(q, q') - (0, W) + M unbalance (cos t, sin t), with W = load / speed_ratio and M = mass speed_ratio.  With the
    defaults the journal has passed its Hopf speed, 0.82212133384945 without unbalance, and the orbit of one turn is
    unstable by a flip (half-speed whirl).

    Parameters
    ----------
    speed_ratio : float
        Spin over that of the load and mass given, above 0.
    unbalance : float
        Eccentricity of the mass over the clearance.
    load, mass : float
        Dimensionless weight and mass at the speed ratio 1; the mass above 0.

    References
    ----------
    Zhang Sijin, impact dynamics (2008), section 4.5; F. W. Ocvirk, NACA TN 2808 (1952).
    """
    number("oil_film_rotor", "speed_ratio", speed_ratio, above=0.0)
    number("oil_film_rotor", "mass", mass, above=0.0)
    M = mass * speed_ratio
    eye = np.eye(2)
    loads = (HarmonicForce(M * unbalance, dof=0, label="unbalance_x"),
             HarmonicForce(M * unbalance, dof=1, phase=-0.5 * math.pi, label="unbalance_y"))
    return System(M * eye, 0.0 * eye, 0.0 * eye, (*loads, ConstantForce(-load / speed_ratio, dof=1, label="weight"),
                                                  OilFilm(label="film")), omega=1.0)


@builder
def oil_film_journal(*, speed_ratio: float = 1.0, load: float = 1.0, mass: float = 10.0) -> System:
    """`oil_film_rotor` without unbalance, a system without excitation: its rest is the centre of the journal, lost in a Hopf
    bifurcation at speed_ratio = 0.82212133384945 with the defaults (oil whirl).

    Parameters
    ----------
    speed_ratio, load, mass
        As for `oil_film_rotor`.

    References
    ----------
    F. W. Ocvirk, NACA TN 2808 (1952).
    """
    number("oil_film_journal", "speed_ratio", speed_ratio, above=0.0)
    number("oil_film_journal", "mass", mass, above=0.0)
    eye = np.eye(2)
    return System(mass * speed_ratio * eye, 0.0 * eye, 0.0 * eye,
                  (ConstantForce(-load / speed_ratio, dof=1, label="weight"), OilFilm(label="film")))


@builder
def oil_film_rub_rotor(*, speed_ratio: float = 1.0, unbalance: float = 0.1, load: float = 1.0, journal_mass: float = 2.0,
                       disk_mass: float = 8.0, shaft_stiffness: float = 10.0, disk_damping: float = 0.5,
                       journal_damping: float = 0.05, clearance: float = 0.5, stiffness: float = 20.0, friction: float = 0.1,
                       disk_radius: float = 20.0) -> System:
    """Disk on an elastic shaft whose journal runs on a short oil film; the disk rubs against an elastic stator around the
    origin.  q = (x, y) of the journal, then of the disk, over the clearance of the bearing; time is the angle.

    M_1 q_1'' + c_1 q_1' + k (q_1 - q_2) = f(q_1, q_1') - (0, W_1),
    M_2 q_2'' + c_2 q_2' + k (q_2 - q_1) = M_2 unbalance (cos t, sin t) - (0, W_2) - rub,

    with M = mass speed_ratio, k = shaft_stiffness / speed_ratio, and the load / speed_ratio shared as the masses are.

    Parameters
    ----------
    speed_ratio : float
        Spin over that of the loads, masses and stiffnesses given, above 0.
    unbalance : float
        Eccentricity of the disk over the clearance of the bearing.
    load : float
        Weight of journal and disk.
    journal_mass, disk_mass : float
        Above 0.
    shaft_stiffness, disk_damping, journal_damping : float
        Of the shaft, and of what damps disk and journal.
    clearance : float
        Of the stator over that of the bearing, above 0.
    stiffness, friction : float
        Of the stator; at the speed ratio 1.
    disk_radius : float
        Over the clearance of the bearing.

    References
    ----------
    Zhang Sijin, impact dynamics (2008), section 4.5.
    """
    for name, value in (("speed_ratio", speed_ratio), ("journal_mass", journal_mass), ("disk_mass", disk_mass),
                        ("clearance", clearance)):
        number("oil_film_rub_rotor", name, value, above=0.0)
    number("oil_film_rub_rotor", "disk_radius", disk_radius, least=0.0)
    eye, k = np.eye(2), shaft_stiffness / speed_ratio
    M = np.diag([journal_mass, journal_mass, disk_mass, disk_mass]) * speed_ratio
    C = np.diag([journal_damping, journal_damping, disk_damping, disk_damping])
    K = np.block([[k * eye, -k * eye], [-k * eye, k * eye]])
    weight, whole = load / speed_ratio, journal_mass + disk_mass
    size = disk_mass * speed_ratio * unbalance
    return System(M, C, K, (
        HarmonicForce(size, dof=2, label="unbalance_x"), HarmonicForce(size, dof=3, phase=-0.5 * math.pi, label="unbalance_y"),
        ConstantForce(-weight * journal_mass / whole, dof=1, label="journal_weight"),
        ConstantForce(-weight * disk_mass / whole, dof=3, label="disk_weight"), OilFilm(label="film"),
        ElasticStator(x=2, y=3, radius=clearance, stiffness=stiffness / speed_ratio, friction=friction, surface_speed=disk_radius,
                      label="stator")), omega=1.0)


@builder
def snubber_rotor(*, zeta: float = 0.1, nu: float = 0.9, eccentricity: float = 0.6, stiffness: float = 20.0, friction: float = 0.05,
                  disk_radius: float = 20.0, contact_damping: float = 0.0, preload: float = 0.5, gravity: float = 0.0) -> System:
    """Jeffcott rotor between four elastic arcs, one along each of +x, +y, -x, -y (a snubber in four parts, a lobed stator).

    As `jeffcott_rotor`, but each arc is a part of a circle of the radius 1 + preload whose centre is moved by preload away from
    it: the clearance is 1 along the axes, and more along the diagonals, where two arcs meet and can be touched at once.

    Parameters
    ----------
    preload : float
        Distance of the centres of the arcs from the origin, above 0; over the clearance along the axes.
    zeta, nu, eccentricity, stiffness, friction, disk_radius, contact_damping, gravity
        As for `jeffcott_rotor`.

    References
    ----------
    E. V. Karpenko et al., J. Sound Vib. 267 (2003) 509 (a snubber ring).
    """
    number("snubber_rotor", "nu", nu, above=0.0)
    number("snubber_rotor", "preload", preload, above=0.0)
    number("snubber_rotor", "disk_radius", disk_radius, least=0.0)
    eye = np.eye(2)
    arcs = tuple(ElasticStator(stiffness=stiffness, damping=contact_damping, friction=friction, radius=1.0 + preload,
                               centre_x=-preload * x, centre_y=-preload * y, surface_speed=disk_radius * nu, label=f"arc_{name}")
                 for name, x, y in (("right", 1.0, 0.0), ("up", 0.0, 1.0), ("left", -1.0, 0.0), ("down", 0.0, -1.0)))
    return System(eye, 2.0 * zeta * eye, eye, (*unbalance(eccentricity * nu**2), ConstantForce(-gravity, dof=1, label="gravity"),
                                               *arcs), omega=nu)
