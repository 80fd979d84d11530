"""Dry friction along a row: Coulomb (set-valued), Stribeck, regularised, and elastic (Jenkins) with a load that may vary.

Limits are forces, mu times the normal load.  Transitions of the elastic contact under a varying load are those of Yang,
Chu and Menq 1998, derived again: a slider stops where its own speed, not its force, vanishes.

One file, because the laws of friction along a row share their modes, their limits and the images under reversal.
"""
import dataclasses
import math
from dataclasses import dataclass

from ...checks import choice, number, refused, whole
from ..atrow import AtRow
from ..kinds import EventKind
from ..local import Affine, affine, lam, rate, s, u, wave, z
from ..mode import Algebraic, Guard, Hold, Law, Mode

STICK, SLIP_UP, SLIP_DOWN, APART = "stick", "slip+", "slip-", "apart"
_MIRROR = {STICK: STICK, SLIP_UP: SLIP_DOWN, SLIP_DOWN: SLIP_UP, APART: APART}


@dataclass(frozen=True, kw_only=True)
class LoadedContact(AtRow):
    """A contact whose normal load may vary: load(t) = 1 + load_amplitude cos(load_harmonic omega t + load_phase).

    Limits are multiplied by the load; the contact is apart where it is negative.

    Parameters
    ----------
    load_amplitude : float, optional
        Relative to the mean, dimensionless; above 1 the contact separates.  None: the load is constant, and nothing is
        built or computed for its variation (0 is a variation that happens to vanish).
    load_harmonic : int
        Multiple of the excitation frequency, at least 1.
    load_phase : float
        Radians.
    dof, row
        What slides, see `AtRow`.
    """

    load_amplitude: float | None = None
    load_harmonic: int = 1
    load_phase: float = 0.0

    def __post_init__(self):
        super().__post_init__()
        name = type(self).__name__
        object.__setattr__(self, "load_harmonic", whole(name, "load_harmonic", self.load_harmonic, least=1))
        if self.load_amplitude is None and (self.load_phase != 0.0 or self.load_harmonic != 1):
            what = "load_phase" if self.load_phase != 0.0 else "load_harmonic"
            raise ValueError(f"{name}: {what} = {getattr(self, what)!r} is not allowed with a constant load; "
                             "give load_amplitude, or leave it out")

    @property
    def varies(self) -> bool:
        """Whether the load varies with time."""
        return self.load_amplitude is not None

    @property
    def parameters(self):
        """Fields that are floats; the phase only of a load that varies."""
        values = super().parameters
        return values if self.varies else {k: v for k, v in values.items() if k != "load_phase"}

    @property
    def harmonics(self):
        """That of the load."""
        return (self.load_harmonic,) if self.varies else ()

    @property
    def load(self) -> Affine:
        """The load over its mean, dimensionless."""
        if self.load_amplitude is None:
            return affine(1.0)
        return 1.0 + wave(self.load_amplitude, self.load_harmonic, self.load_phase)

    @property
    def start(self):
        """Keys of a start."""
        return (STICK, SLIP_UP, SLIP_DOWN, APART) if self.varies else (STICK, SLIP_UP, SLIP_DOWN)

    def leaves(self) -> tuple[Guard, ...]:
        """Guard of a contact that loses its load; none when the load is constant."""
        return (Guard(-self.load, EventKind.SEPARATION, (APART,)),) if self.varies else ()

    def returns(self) -> Guard:
        """Guard of a contact that gets its load back."""
        return Guard(self.load, EventKind.CONTACT, (STICK, SLIP_UP, SLIP_DOWN))

    def mirrored_load(self) -> float | None:
        """Amplitude of the load half a period later."""
        if self.load_amplitude is None or self.load_harmonic % 2 == 0:
            return self.load_amplitude
        return 0.0 - self.load_amplitude

    def mirrored_key(self, key):
        """Slip turns round."""
        return _MIRROR[key]

    def mirrored_guard(self, key, guard):
        """The two limits of stick change places."""
        return 1 - guard if key == STICK and guard < 2 else guard


class OnBelt:
    """What a row slides on moves along it with ``belt_speed``."""

    belt_speed: float

    def site(self, n):
        """Return the row, seen from the belt."""
        site = super().site(n)
        return site if self.belt_speed == 0.0 else dataclasses.replace(site, drift=(-self.belt_speed,))

    def mirrored(self):
        """Friction on a belt that runs the other way."""
        return dataclasses.replace(self, belt_speed=0.0 - self.belt_speed)


class FallingFriction(OnBelt):
    """Friction with one limit of stick and a law for slip either way."""

    @property
    def rests_together(self) -> bool:
        """It comes to rest with others on its row."""
        return True

    def mirrored_key(self, key):
        """Slip turns round."""
        return _MIRROR[key]

    def mirrored_guard(self, key, guard):
        """The two limits of stick change places."""
        return 1 - guard if key == STICK else guard


@dataclass(frozen=True)
class Coulomb(OnBelt, LoadedContact):
    """Dry friction with a set-valued law: force -friction load(t) sign(s) while slipping, any force within limits at rest.

    Modes: "stick" (the speed of the row is held at zero), "slip+", "slip-" by the sign of the speed, and "apart" while a
    varying load is negative.  Several contacts on one row (or on multiples of it) whose loads do not vanish and whose surfaces
    move alike stick and slip together: at rest the limits of their static friction add up (`friction.together`), and the first one
    has the events.

    Parameters
    ----------
    friction : float
        Force while slipping with s > 0 (mu times the mean normal load), at least 0.
    friction_negative : float, optional
        Force while slipping with s < 0; None: as `friction`.
    static_ratio : float
        Largest force of stick over that of slip, at least 1, dimensionless.
    belt_speed : float
        Speed of the surface under the row; s is the speed relative to it.
    static : float, optional
        Largest force of stick at mean load, either way, at least those of slip, which may be zero; None: by `static_ratio`.
    load_amplitude, load_harmonic, load_phase
        Of a normal load that varies, see `LoadedContact`.
    dof, row
        What slides, see `AtRow`.

    Examples
    --------
    >>> from bifurc.elements import Coulomb
    >>> Coulomb(0.5).mode("slip+", None).force
    (-0.5,)
    """

    friction: float = 1.0
    friction_negative: float | None = None
    static_ratio: float = 1.0
    belt_speed: float = 0.0
    static: float | None = None

    def __post_init__(self):
        super().__post_init__()
        name = type(self).__name__
        number(name, "friction", self.friction, least=0.0)
        if self.friction_negative is not None:
            number(name, "friction_negative", self.friction_negative, least=0.0)
        number(name, "static_ratio", self.static_ratio, least=1.0)
        if self.static is not None:
            if not self.static >= max(self.limits):
                raise refused(name, "static", self.static, f"at least friction = {max(self.limits):g}")
            if self.static_ratio != 1.0:
                raise ValueError(f"{name}: static_ratio = {self.static_ratio!r} is not allowed beside static = {self.static!r}; "
                                 "give one of them")

    @property
    def rests_together(self) -> bool:
        """Whether it comes to rest with others on its row: under a load that never vanishes."""
        return self.load_amplitude is None or abs(self.load_amplitude) < 1.0

    @property
    def drops(self) -> bool:
        """Whether static friction is above that of slip."""
        return self.static_ratio > 1.0 or self.static is not None and self.static > min(self.limits)

    @property
    def limits(self) -> tuple[float, float]:
        """Forces of slip with s > 0 and with s < 0, at mean load."""
        return self.friction, self.friction if self.friction_negative is None else self.friction_negative

    def mode(self, key, core):
        """Return "stick", "slip+", "slip-" or "apart"."""
        up, down = (limit * self.load for limit in self.limits)
        if key == STICK:
            if self.static is None:
                most, least = self.static_ratio * down, -self.static_ratio * up
            else:
                most, least = self.static * self.load, -self.static * self.load
            guards = (Guard(least - lam(0), EventKind.SLIP, (SLIP_UP,)), Guard(lam(0) - most, EventKind.SLIP, (SLIP_DOWN,)))
            return Mode(hold=(Hold(0, (1.0,)),), guards=(*guards, *self.leaves()), bounds=((least, most),))
        if key == APART:
            return Mode(guards=(self.returns(),))
        way, other = (1.0, SLIP_DOWN) if key == SLIP_UP else (-1.0, SLIP_UP)
        stop = Guard(-way * s(0), EventKind.STICK, (STICK, other))
        return Mode(force=(-up if key == SLIP_UP else down,), guards=(stop, *self.leaves()))

    def mirrored(self):
        """Friction seen from the other side."""
        negative = None if self.friction_negative is None else self.friction
        return dataclasses.replace(self, friction=self.limits[1], friction_negative=negative,
                                   belt_speed=0.0 - self.belt_speed, load_amplitude=self.mirrored_load())


def exponential_up(u, s, kinetic, static, speed):
    """Force of slip with s > 0 that falls as exp(-s/speed)."""
    return -kinetic - (static - kinetic) * math.exp(-s / speed)


def exponential_up_slope(u, s, kinetic, static, speed):
    """Derivatives of `exponential_up` by u and s."""
    return 0.0, (static - kinetic) / speed * math.exp(-s / speed)


def exponential_down(u, s, kinetic, static, speed):
    """Force of slip with s < 0 that falls as exp(s/speed)."""
    return kinetic + (static - kinetic) * math.exp(s / speed)


def exponential_down_slope(u, s, kinetic, static, speed):
    """Derivatives of `exponential_down` by u and s."""
    return 0.0, (static - kinetic) / speed * math.exp(s / speed)


def hyperbolic_up(u, s, kinetic, static, speed):
    """Force of slip with s > 0 that falls as 1/(1 + s/speed)."""
    return -kinetic - (static - kinetic) * speed / (speed + s)


def hyperbolic_up_slope(u, s, kinetic, static, speed):
    """Derivatives of `hyperbolic_up` by u and s."""
    return 0.0, (static - kinetic) * speed / ((speed + s) * (speed + s))


def hyperbolic_down(u, s, kinetic, static, speed):
    """Force of slip with s < 0 that falls as 1/(1 - s/speed)."""
    return kinetic + (static - kinetic) * speed / (speed - s)


def hyperbolic_down_slope(u, s, kinetic, static, speed):
    """Derivatives of `hyperbolic_down` by u and s."""
    return 0.0, (static - kinetic) * speed / ((speed - s) * (speed - s))


# each direction has its own smooth law, which goes on a little beyond s = 0: a step is never cut short by the sign
_CURVES = {("exponential", SLIP_UP): (exponential_up, exponential_up_slope),
           ("exponential", SLIP_DOWN): (exponential_down, exponential_down_slope),
           ("hyperbolic", SLIP_UP): (hyperbolic_up, hyperbolic_up_slope),
           ("hyperbolic", SLIP_DOWN): (hyperbolic_down, hyperbolic_down_slope)}


@dataclass(frozen=True)
class Stribeck(FallingFriction, AtRow):
    """Dry friction that falls with speed: kinetic + (static - kinetic) c(|s|/speed), with stick up to `static`.

    Modes as those of `Coulomb` under constant load.

    Parameters
    ----------
    kinetic, static : float
        Force at high speed, at least 0, and limit of stick, at least `kinetic`.
    speed : float
        Speed over which the force falls, above 0.
    curve : {"exponential", "hyperbolic"}
        c(x) = exp(-x), or 1/(1 + x).
    belt_speed : float
        Speed of the surface under the row; s is the speed relative to it.
    dof, row
        What slides, see `AtRow`.
    """

    kinetic: float = 1.0
    static: float = 1.5
    speed: float = 0.5
    curve: str = "exponential"
    belt_speed: float = 0.0

    start = (STICK, SLIP_UP, SLIP_DOWN)

    def __post_init__(self):
        super().__post_init__()
        name = type(self).__name__
        number(name, "kinetic", self.kinetic, least=0.0)
        if not self.static >= self.kinetic:
            raise refused(name, "static", self.static, f"at least kinetic = {self.kinetic:g}")
        number(name, "speed", self.speed, above=0.0)
        choice(name, "curve", self.curve, ("exponential", "hyperbolic"))

    def mode(self, key, core):
        """Return "stick", "slip+" or "slip-"."""
        if key == STICK:
            return _stick(self.static)
        law, slope = _CURVES[self.curve, key]
        return _slip(key, Law(law, (self.kinetic, self.static, self.speed), slope))


def cubic_up(u, s, static, falling, rising):
    """Force of slip with s > 0 that falls in proportion to s and rises with its cube."""
    return -static + s * (falling - rising * s * s)


def cubic_up_slope(u, s, static, falling, rising):
    """Derivatives of `cubic_up` by u and s."""
    return 0.0, falling - 3.0 * rising * s * s


def cubic_down(u, s, static, falling, rising):
    """Force of slip with s < 0 that falls in proportion to -s and rises with its cube."""
    return static + s * (falling - rising * s * s)


_CUBIC = {SLIP_UP: (cubic_up, cubic_up_slope), SLIP_DOWN: (cubic_down, cubic_up_slope)}


@dataclass(frozen=True)
class CubicFriction(FallingFriction, AtRow):
    """Dry friction with a minimum over the speed: static - falling |s| + rising |s|^3, with stick up to `static`.

    Modes as those of `Coulomb` under constant load.

    Parameters
    ----------
    static : float
        Limit of stick, at least 0.
    falling : float
        Force per speed, by which the friction falls at first.
    rising : float
        Force per cubed speed, by which it rises at high speed.
    belt_speed : float
        Speed of the surface under the row; s is the speed relative to it.
    dof, row
        What slides, see `AtRow`.

    References
    ----------
    R. A. Ibrahim, Friction-induced vibration, chatter, squeal and chaos, Appl. Mech. Rev. 47 (1994), part II.
    """

    static: float = 1.0
    falling: float = 0.4
    rising: float = 0.1
    belt_speed: float = 0.0

    start = (STICK, SLIP_UP, SLIP_DOWN)

    def __post_init__(self):
        super().__post_init__()
        number(type(self).__name__, "static", self.static, least=0.0)

    def mode(self, key, core):
        """Return "stick", "slip+" or "slip-"."""
        if key == STICK:
            return _stick(self.static)
        return _slip(key, Law(_CUBIC[key][0], (self.static, self.falling, self.rising), _CUBIC[key][1]))


def _stick(static: float) -> Mode:
    """Return the mode of stick up to a limit."""
    return Mode(hold=(Hold(0, (1.0,)),), bounds=((affine(-static), affine(static)),),
                guards=(Guard(-static - lam(0), EventKind.SLIP, (SLIP_UP,)), Guard(lam(0) - static, EventKind.SLIP, (SLIP_DOWN,))))


def _slip(key: str, law: Law) -> Mode:
    """Return a mode of slip under a law."""
    way, other = (1.0, SLIP_DOWN) if key == SLIP_UP else (-1.0, SLIP_UP)
    return Mode(force=law, guards=(Guard(-way * s(0), EventKind.STICK, (STICK, other)),))


def regularized(u, s, friction, width):
    """Friction with a smooth sign."""
    return -friction * math.tanh(s / width)


def regularized_slope(u, s, friction, width):
    """Derivatives of `regularized` by u and s."""
    t = math.tanh(s / width)
    return 0.0, -friction / width * (1.0 - t * t)


@dataclass(frozen=True)
class RegularizedFriction(OnBelt, AtRow):
    """Smooth stand-in for dry friction: force -friction tanh(s/width).  It creeps where dry friction sticks.

    Parameters
    ----------
    friction : float
        Force at high speed, at least 0.
    width : float
        Speed over which the force changes sign, above 0.
    belt_speed : float
        Speed of the surface under the row; s is the speed relative to it.
    dof, row
        What slides, see `AtRow`.
    """

    friction: float = 1.0
    width: float = 0.01
    belt_speed: float = 0.0

    def __post_init__(self):
        super().__post_init__()
        number(type(self).__name__, "friction", self.friction, least=0.0)
        number(type(self).__name__, "width", self.width, above=0.0)

    def mode(self, key, core):
        """Return the only mode."""
        return Mode(force=Law(regularized, (self.friction, self.width), regularized_slope))


@dataclass(frozen=True)
class Jenkins(LoadedContact):
    """Elastic dry friction: a spring in series with a slider that holds forces up to limit load(t).

    The memory is the position w of the slider.  Modes: "stick" (force -stiffness (u - w), w frozen), "slip+" and "slip-"
    (force at the limit; w follows u at its distance), and "apart" while a varying load is negative (w = u, no force).

    Parameters
    ----------
    stiffness : float
        Force per length, above 0.
    limit : float
        Largest force (mu times the mean normal load), at least 0; 0: there is no contact.
    load_amplitude, load_harmonic, load_phase
        Of a normal load that varies, see `LoadedContact`.
    dof, row
        What slides, see `AtRow`.

    References
    ----------
    B. D. Yang, M. L. Chu, C. H. Menq, Stick-slip-separation analysis and non-linear stiffness and damping
    characterization of friction contacts having variable normal load, J. Sound Vib. 210 (1998), 461-481.
    """

    stiffness: float = 1.0
    limit: float = 1.0

    memory = ("slider",)
    virgin = (u(0),)  # a slider without load has followed its spring

    def __post_init__(self):
        super().__post_init__()
        name = type(self).__name__
        number(name, "stiffness", self.stiffness, above=0.0)
        number(name, "limit", self.limit, least=0.0)

    def mode(self, key, core):
        """Return "stick", "slip+", "slip-" or "apart"."""
        k, limit = self.stiffness, self.limit * self.load
        if key == STICK:
            force = k * (u(0) - z(0))
            guards = (Guard(force - limit, EventKind.SLIP, (SLIP_UP,)), Guard(-force - limit, EventKind.SLIP, (SLIP_DOWN,)))
            return Mode(force=(-force,), guards=(*guards, *self.leaves()))
        if key == APART:
            return Mode(memory=(Algebraic(u(0)),), guards=(self.returns(),))
        way, other = (1.0, SLIP_DOWN) if key == SLIP_UP else (-1.0, SLIP_UP)
        speed = way * s(0)  # of the slider in its direction
        if self.varies:
            speed = speed - rate(limit, core.omega) / k
        return Mode(force=(-way * limit,), memory=(Algebraic(u(0) - (way / k) * limit),),
                    guards=(Guard(-speed, EventKind.STICK, (STICK, other)), *self.leaves()))

    def mirrored(self):
        """Its own image but for the phase of the load."""
        return dataclasses.replace(self, load_amplitude=self.mirrored_load())
