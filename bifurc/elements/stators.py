"""A stator around a rotor, elastic or rigid, with Coulomb friction that slides either way or rolls.  Zhang 2008, chapters 4, 5."""
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..checks import choice, number, vector, whole
from .element import Element
from .kinds import EventKind
from .local import affine, lam, s, u
from .mode import Guard, Hold, Law, Mode
from .site import Circle, Ring

FREE, FORWARD, BACKWARD, ROLL, SEPARATING = "free", "slip+", "slip-", "roll", "separating"


@dataclass(frozen=True, kw_only=True)
class AroundPoint(Element):
    """An element on a circle around a point that moves in a plane.

    Parameters
    ----------
    x, y : int
        Degrees of freedom of the point.
    against_x, against_y : int, optional
        Degrees of freedom of a second body that carries the circle (a casing); None: it stands still.
    centre_x, centre_y : float
        Centre of the circle, length; that of its rest position on a second body.
    radius : float
        Of the circle that the point may not leave freely: the clearance; length, above 0.
    surface_speed : float
        Radius of the body times its spin: what its surface adds to the tangential speed, counted like that of the point.
    frame_spin : float
        Rate at which the frame of the coordinates turns against the circle; 0: a frame at rest.
    """

    x: int = 0
    y: int = 1
    against_x: int | None = None
    against_y: int | None = None
    centre_x: float = 0.0
    centre_y: float = 0.0
    radius: float = 1.0
    surface_speed: float = 0.0
    frame_spin: float = 0.0

    isotropic = True
    rigid: ClassVar[bool] = False  # how a picture shows it

    @property
    def ring(self):
        """The circle."""
        against = None if self.against_x is None or self.against_y is None else (self.against_x, self.against_y)
        return Ring((self.centre_x, self.centre_y), self.radius, (self.x, self.y), against, self.rigid)

    def __post_init__(self):
        super().__post_init__()
        name = type(self).__name__
        number(name, "radius", self.radius, above=0.0)
        for field in ("x", "y", *("against_x", "against_y") * (self.against_x is not None and self.against_y is not None)):
            whole(name, field, getattr(self, field), least=0)
        if (self.against_x is None) != (self.against_y is None):
            raise ValueError(f"{name}: against_x = {self.against_x!r} and against_y = {self.against_y!r} are not allowed; give "
                             "both degrees of freedom of the second body, or none")

    def site(self, n):
        """Return the circle seen by the point, relative to the second body where there is one."""
        rows = []
        for own, other in ((self.x, self.against_x), (self.y, self.against_y)):
            row = [0.0] * n
            for dof, sign in ((own, 1.0), (other, -1.0)):
                if dof is not None:
                    if not 0 <= dof < n:
                        raise ValueError(f"{type(self).__name__}: degree of freedom {dof} is not allowed; there are 0 to {n - 1}")
                    row[dof] += sign
            rows.append(vector(type(self).__name__, "row", row))
        return Circle.around(rows, n, (self.centre_x, self.centre_y), self.radius, self.surface_speed,
                             self.frame_spin)


@dataclass(frozen=True, kw_only=True)
class ElasticStator(AroundPoint):
    """Elastic ring around a rotor with Coulomb rub.

    Beyond the clearance the stator pushes back with F = stiffness d + damping d', d = |p| - radius, and rubs with friction F
    against the sliding of the rotor's surface.  Modes: "free", "slip+" and "slip-" (sign of the sliding speed), "roll" where
    the surfaces do not slide, and with ``release="force"`` "separating": let go, but not yet back within the clearance.

    Parameters
    ----------
    stiffness : float
        Force per length, above 0.
    damping : float
        Force per speed, in contact only.
    friction : float
        Coefficient of friction.
    release : {"force", "penetration"}
        Contact ends at zero force, or at zero penetration (the dashpot may pull).
    x, y, against_x, against_y, centre_x, centre_y, radius, surface_speed, frame_spin
        See `AroundPoint`.

    Notes
    -----
    The limit of large stiffness is `RigidStator`.  With the damping 2 b sqrt(stiffness m), m the mass met, and release at zero
    force a contact has the restitution exp(-(b / c) atan2(2 b c, 2 b^2 - 1)), c = sqrt(1 - b^2) (0.5: b = 0.2552756376486518).
    Orbits then differ from the rigid ones by O(stiffness^(-1/2)), so that two stiffnesses extrapolate.  Without contact damping
    sliding all the way round a stiff stator is unstable from the spin damping ratio / friction on (over the natural frequency).

    References
    ----------
    Zhang Sijin, impact dynamics (2008), sections 4.2 and 5.2.
    """

    stiffness: float = 25.0
    damping: float = 0.0
    friction: float = 0.1
    release: str = "force"

    start = (FREE, FORWARD, BACKWARD, ROLL, SEPARATING)

    def __post_init__(self):
        super().__post_init__()
        name = type(self).__name__
        number(name, "stiffness", self.stiffness, above=0.0)
        number(name, "damping", self.damping, least=0.0)
        number(name, "friction", self.friction, least=0.0)
        choice(name, "release", self.release, ("force", "penetration"))

    def mode(self, key, core):
        """Return the mode of a key."""
        depth = u(0)
        load = self.stiffness * depth + self.damping * s(0)
        if key == FREE:
            return Mode(guards=(Guard(depth, EventKind.CONTACT, (FORWARD, BACKWARD, ROLL, SEPARATING)),))
        if key == SEPARATING:
            return Mode(guards=(Guard(-depth, EventKind.SEPARATION, (FREE,)),
                                Guard(load, EventKind.CONTACT, (FORWARD, BACKWARD, ROLL))))
        leaves = Guard(-load, EventKind.SEPARATION, (FREE, SEPARATING)) if self.release == "force" else Guard(
            -depth, EventKind.SEPARATION, (FREE,))
        if key == ROLL:
            cone = self.friction * load
            return Mode(force=(-load, affine(0.0)), hold=(Hold(1, (0.0, 1.0)),), guards=(
                leaves, Guard(lam(0) - cone, EventKind.SLIP, (BACKWARD, FORWARD)),
                Guard(-lam(0) - cone, EventKind.SLIP, (FORWARD, BACKWARD))))
        sign = 1.0 if key == FORWARD else -1.0
        other = BACKWARD if key == FORWARD else FORWARD
        return Mode(force=(-load, (-sign * self.friction) * load),
                    guards=(leaves, Guard(-sign * s(1), EventKind.STICK, (ROLL, other))))


def impact(u, none, sn, st, restitution, friction, mass):
    """Impulses, radial and tangential, of an impact with friction that stops the sliding at most."""
    normal = -(1.0 + restitution) * sn * mass
    most = friction * abs(normal)
    tangential = -st * mass
    if tangential > most:
        tangential = most
    elif tangential < -most:
        tangential = -most
    return normal, tangential


def impact_slope(u, none, sn, st, restitution, friction, mass):
    """Derivatives of `impact`."""
    by = -(1.0 + restitution) * mass
    most = friction * abs(by * sn)
    slides = abs(st * mass) > most
    way = -1.0 if st > 0.0 else 1.0
    growth = friction * abs(by) * (1.0 if sn > 0.0 else -1.0)
    return 0.0, 0.0, by, 0.0, 0.0, 0.0, way * growth if slides else 0.0, 0.0 if slides else -mass


@dataclass(frozen=True, kw_only=True)
class RigidStator(AroundPoint):
    """Rigid ring around a rotor: impacts with restitution and friction, sliding and rolling on the wall.

    An impact with the radial speed u > 0 turns it to -restitution u and takes friction (1 + restitution) u of the sliding
    speed, but never turns that round.  Modes: "free", "slip+" and "slip-" on the wall (sign of the sliding speed), "roll".
    A body that touches two circles (a ring between shaft and housing) is held by one of them at a time: where both are rigid
    and hold it together the motion ends with a status that says so.

    Parameters
    ----------
    restitution : float
        From 0 (plastic) to 1 (elastic).
    friction : float
        Coefficient of friction.
    x, y, against_x, against_y, centre_x, centre_y, radius, surface_speed, frame_spin
        See `AroundPoint`; both coordinates must have the same mass.

    References
    ----------
    Zhang Sijin, impact dynamics (2008), sections 4.3 and 4.4.
    """

    restitution: float = 0.8
    friction: float = 0.1

    rigid = True
    start = (FREE, FORWARD, BACKWARD, ROLL)

    def __post_init__(self):
        super().__post_init__()
        number(type(self).__name__, "restitution", self.restitution, least=0.0, most=1.0)
        number(type(self).__name__, "friction", self.friction, least=0.0)

    def mode(self, key, core):
        """Return the mode of a key."""
        if key == FREE:
            R = self.site(len(core.mass)).R
            W = R @ np.linalg.solve(core.mass, R.T)
            if abs(W[0, 1]) > 1e-12 * W[0, 0] or abs(W[0, 0] - W[1, 1]) > 1e-12 * W[0, 0]:
                raise ValueError(f"{type(self).__name__}: the masses met along x and y are not the same (R M^-1 R^T = "
                                 f"{W.tolist()}); an impact would turn with the place on the circle")
            kick = Law(impact, (self.restitution, self.friction, 1.0 / float(W[0, 0])), impact_slope)
            return Mode(guards=(Guard(u(0), EventKind.IMPACT, (FREE, FORWARD, BACKWARD, ROLL), kick,
                                      accumulates=(self.restitution, FORWARD)),))
        if key == ROLL:
            cone = self.friction * lam(0)
            return Mode(hold=(Hold(0, (1.0, 0.0), u(0)), Hold(1, (0.0, 1.0))), guards=(
                Guard(lam(0), EventKind.RELEASE, (FREE,)), Guard(lam(1) + cone, EventKind.SLIP, (BACKWARD, FORWARD)),
                Guard(-lam(1) + cone, EventKind.SLIP, (FORWARD, BACKWARD))))
        sign = 1.0 if key == FORWARD else -1.0
        other = BACKWARD if key == FORWARD else FORWARD
        return Mode(hold=(Hold(0, (-1.0, -sign * self.friction), u(0)),), guards=(
            Guard(-lam(0), EventKind.RELEASE, (FREE,)), Guard(-sign * s(1), EventKind.STICK, (ROLL, other))))
