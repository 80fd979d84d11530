"""Friction contacts and dampers: Yang's contact, micro-slip rings and strips on a test bench, a damped oscillator."""
import math

from ..checks import choice, number, vector, whole
from ..elements import Driven, HarmonicForce, Iwan, Jenkins, LoadedMicroSlip, MicroSlip
from ..system import System, builder

# Zhao & Lin 2015, Table 2: amplitudes of x (sin) and y (cos), stiffness, mean load, load amplitude over the mean, phase of the
# load; harmonic of y.  The normal load is the contact's stiffness times its normal displacement, offset included
_YANG = {1: ((3.0, 2.0, 5.0, 20.0, 0.25, 0.0), 1), 2: ((3.0, 2.0, 4.0, 5.0, 2.0, 0.0), 1),
         3: ((3.0, 3.0, 6.0, 18.0, 0.25, -0.5 * math.pi), 3)}


def _bench(elements, omega: float) -> System:
    """Return a system for driven elements: a coordinate that stays at rest, damped, so that no frequency excites it."""
    return System(1.0, omega, omega**2, elements, omega=omega)


def _sizes(owner: str, **values) -> None:
    """Raise ValueError unless all are above 0."""
    for name, value in values.items():
        number(owner, name, value, above=0.0)


def _chain(owner, spring, contact, limits, closed, load_amplitude, load_harmonic, load_phase):
    """Return a bar or ring whose contacts share the variation of their load; None: a constant load."""
    whole(owner, "load_harmonic", load_harmonic, least=1)
    if load_amplitude is None:
        if load_phase is not None:
            raise ValueError(f"{owner}: load_phase = {load_phase!r} is not allowed with a constant load; "
                             "give load_amplitude, or leave it out")
        return MicroSlip(spring, contact, limits, closed)
    n = len(limits)
    return LoadedMicroSlip(spring, contact, limits, (load_amplitude,) * n, (load_phase or 0.0,) * n, load_harmonic, closed)


@builder
def macro_slip_contact(*, case: int = 1, omega: float = 1.0, friction: float = 0.5, amplitude_x: float | None = None,
                       amplitude_y: float | None = None, harmonic_y: int | None = None, stiffness: float | None = None,
                       load: float | None = None, load_amplitude: float | None = None,
                       load_phase: float | None = None) -> System:
    """Two elastic friction contacts, x and y, under one normal load that varies; their motion is prescribed.

    x = amplitude_x sin(omega t), y = amplitude_y cos(harmonic_y omega t), normal load
    load (1 + load_amplitude cos(omega t + load_phase)), apart where that is negative.  For `bifurc.hysteresis`; the
    in-plane motion coupled by |f| <= friction load is integrated by `studies/planar_hysteresis.py`.

    Parameters
    ----------
    case : {1, 2, 3}
        Of Table 2: the numbers of all arguments that are None.
    omega : float
        Frequency; it only sets the time scale.
    friction : float
        Coefficient, dimensionless.
    amplitude_x, amplitude_y : float, optional
        Lengths.
    harmonic_y : int, optional
        Of the motion in y.
    stiffness : float, optional
        Of both contacts, force per length.
    load, load_amplitude, load_phase : float, optional
        Mean normal load (force), relative amplitude, phase (radians).

    References
    ----------
    B. D. Yang, M. L. Chu, C. H. Menq, J. Sound Vib. 210 (1998), 461-481.
    Zhao & Lin, J. NUDT 37 (2015), Table 2.
    """
    name = "macro_slip_contact"
    choice(name, "case", case, tuple(_YANG))
    given = (amplitude_x, amplitude_y, stiffness, load, load_amplitude, load_phase)
    own, known = _YANG[case]
    ax, ay, k, n, rho, phase = (a if a is not None else b for a, b in zip(given, own, strict=True))
    ky = known if harmonic_y is None else whole(name, "harmonic_y", harmonic_y, least=1)
    number(name, "friction", friction, least=0.0)
    number(name, "load", n, least=0.0)
    contact = Jenkins(k, friction * n, load_amplitude=rho, load_phase=phase)
    return _bench((Driven(contact, ax, phase=-0.5 * math.pi, label="x"), Driven(contact, ay, ky, label="y")), omega)


@builder
def micro_slip_ring(*, n: int = 15, omega: float = 1.0, amplitude: float = 0.31e-3, load: float = 137.0,
                    friction: float = 0.5, length: float = 290.0 * math.pi, area: float = 300.0,
                    modulus: float = 2.07e5, width: float = 30.0, contact: float = 140.625,
                    load_amplitude: float | None = None, load_harmonic: int = 1, load_phase: float | None = None) -> System:
    """Split ring in a groove as n blocks on elastic sliders, driven at one of them; N and mm.

    The full-slip loop encloses 4 F (amplitude - u_s - (2/3) u_e (1 - 1/n^2)) for odd n, with F = friction load,
    u_s = friction load / (contact width length) and u_e = friction load length / (8 modulus area).

    Parameters
    ----------
    n : int
        Number of blocks, at least 1; the last is joined to the first.
    omega : float
        Frequency; it only sets the time scale.
    amplitude : float
        Of the driven block, sin(omega t); mm.
    load : float
        Normal load of the whole ring, N, spread evenly.
    friction : float
        Coefficient, dimensionless.
    length, area : float
        Mean circumference (mm) and cross section (mm^2).
    modulus : float
        Young's, N/mm^2.
    width : float
        Of the contact, mm.
    contact : float
        Tangential stiffness of the contact per area, N/mm^3.
    load_amplitude : float, optional
        The normal load varies as 1 + load_amplitude cos(load_harmonic omega t + load_phase), and contacts are apart where
        that is negative; None: it is constant.
    load_harmonic : int
    load_phase : float, optional
        Radians; None: 0.

    References
    ----------
    Zhao & Lin, J. NUDT 37 (2015), example 1 in micrometres with the total load in newtons.
    """
    whole("micro_slip_ring", "n", n, least=1, most=10_000)
    number("micro_slip_ring", "friction", friction, least=0.0)
    _sizes("micro_slip_ring", length=length, area=area, modulus=modulus, width=width, contact=contact)
    block = length / n
    ring = _chain("micro_slip_ring", modulus * area / block, contact * width * block, (friction * load / n,) * n, True,
                  load_amplitude, load_harmonic, load_phase)
    return _bench((Driven(ring, amplitude, phase=-0.5 * math.pi, label="ring"),), omega)


@builder
def micro_slip_strip(*, n: int = 15, omega: float = 1.0, amplitude: float = 0.32e-3, load_end: float = 34.5,
                     load_middle: float = 5.0, friction: float = 0.5, length: float = 80.0, area: float = 90.0,
                     modulus: float = 2.07e5, width: float = 30.0, contact: float = 140.625,
                     loads: tuple[float, ...] | None = None, load_amplitude: float | None = None, load_harmonic: int = 1,
                     load_phase: float | None = None) -> System:
    """Strip as n blocks on elastic sliders, loaded more at the ends than in the middle, driven at the first; N and mm.

    With the defaults blocks 5 to 10 slip, block 8 first.

    Parameters
    ----------
    n : int
        Number of blocks, at least 1.
    omega : float
        Frequency; it only sets the time scale.
    amplitude : float
        Of the driven block, sin(omega t); mm.
    load_end, load_middle : float
        Normal load of the end blocks and of the middle, N; parabolic in between.
    friction : float
        Coefficient, dimensionless.
    length, area, width : float
        mm, mm^2, mm.
    modulus : float
        Young's, N/mm^2.
    contact : float
        Tangential stiffness of the contact per area, N/mm^3.
    loads : sequence of float, optional
        Normal load of every block, N, instead of the parabola.
    load_amplitude : float, optional
        The normal load varies as 1 + load_amplitude cos(load_harmonic omega t + load_phase), and contacts are apart where
        that is negative; None: it is constant.
    load_harmonic : int
    load_phase : float, optional
        Radians; None: 0.

    References
    ----------
    Zhao & Lin, J. NUDT 37 (2015), example 2 in micrometres.
    """
    whole("micro_slip_strip", "n", n, least=1, most=10_000)
    number("micro_slip_strip", "friction", friction, least=0.0)
    _sizes("micro_slip_strip", length=length, area=area, modulus=modulus, width=width, contact=contact)
    block = length / n
    if loads is None:
        places = [(2.0 * i - (n - 1)) / max(n - 1, 1) for i in range(n)]
        loads = tuple(load_middle + (load_end - load_middle) * x * x for x in places)
    loads = vector("micro_slip_strip", "loads", loads)
    if len(loads) != n:
        raise ValueError(f"micro_slip_strip: loads has {len(loads)} numbers; it must be n = {n}, one a block")
    limits = tuple(friction * load for load in loads)
    strip = _chain("micro_slip_strip", modulus * area / block, contact * width * block, limits, False, load_amplitude,
                   load_harmonic, load_phase)
    return _bench((Driven(strip, amplitude, phase=-0.5 * math.pi, label="strip"),), omega)


@builder
def friction_damped_oscillator(*, omega: float = 90.0, normal_load: float = 100.0, damper: str = "macro", n: int = 15,
                               mass: float = 1.07, stiffness: float = 1e4, damping: float = 0.562, force: float = 100.0,
                               friction: float = 0.5, contact: float = 18.328497, span: float = 3.0) -> System:
    """Oscillator under force cos(omega t) with a friction damper: a strip that slips block by block, or all at once; SI units.

    The micro damper is a strip of n blocks driven at the first, the normal load shared evenly, as the parallel set of
    sliders that is equal to it (`bifurc.elements.MicroSlip.iwan`); the macro damper is one elastic slider of the same stuck
    stiffness under the whole load.  With the defaults the largest amplitude over all
    frequencies is least near 95 N (micro, 1.281 m) and 117 N (macro, 1.156 m); the micro damper slips somewhere up to
    1007 N.  (Amplitudes of metres are those of the source: only ratios matter.)

    Parameters
    ----------
    omega : float
        Excitation frequency, rad/s.
    normal_load : float
        On the damper, N; 0: there is no damper.
    damper : {"macro", "micro"}
    n : int
        Blocks of the strip, at least 1.
    mass, stiffness, damping : float
        kg, N/m, N s/m.
    force : float
        N.
    friction : float
        Coefficient, dimensionless.
    contact : float
        Stiffness of each contact of the strip, N/m.
    span : float
        n sqrt(contact/spring), length of the strip over that on which its displacement dies out, dimensionless.

    References
    ----------
    Zhao & Lin, J. NUDT 37 (2015), section 4, which leaves `contact` and `span` open.
    """
    name = "friction_damped_oscillator"
    choice(name, "damper", damper, ("macro", "micro"))
    whole(name, "n", n, least=1, most=10_000)
    number(name, "friction", friction, least=0.0)
    number(name, "normal_load", normal_load, least=0.0)
    number(name, "span", span, above=0.0)
    strip = MicroSlip(spring=contact * (n / span) ** 2, contact=contact, limits=(1.0 / n,) * n).iwan()  # friction force 1
    found: Jenkins | Iwan
    if damper == "macro":
        found = Jenkins(sum(strip.stiffnesses), friction * normal_load)
    else:
        found = Iwan(strip.stiffnesses, tuple(friction * normal_load * limit for limit in strip.limits))
    return System(mass, damping, stiffness, (HarmonicForce(force), found), omega=omega)
