"""Systems that move alike by an exact property: other units, other coordinates, a mirror, a later start of the clock.

A result of a system and the same result of its image differ by a known factor, and by nothing else: constants with a hidden
unit, indices that only the first coordinate survives, and signs that only one side knows are seen so, in any verb.
"""
import dataclasses
from collections.abc import Callable

import numpy as np

from bifurc import System
from bifurc import elements as el

LENGTH, TIME, MASS, NONE = np.array([1, 0, 0]), np.array([0, 1, 0]), np.array([0, 0, 1]), np.zeros(3, int)
SPEED, RATE = LENGTH - TIME, -TIME
FORCE = MASS + LENGTH - 2 * TIME
STIFFNESS, DAMPING = FORCE - LENGTH, FORCE - SPEED
ROUND = {"centre_x": LENGTH, "centre_y": LENGTH, "radius": LENGTH, "surface_speed": SPEED, "frame_spin": RATE}
DIMENSIONS = {  # of the fields that have any
    el.BaseMotion: {"amplitude": LENGTH},
    el.ConstantForce: {"force": FORCE},
    el.Coulomb: {"friction": FORCE, "friction_negative": FORCE, "belt_speed": SPEED},
    el.CubicFriction: {"static": FORCE, "falling": DAMPING, "rising": FORCE - 3 * SPEED, "belt_speed": SPEED},
    el.CubicSpring: {"beta": FORCE - 3 * LENGTH},
    el.ElasticStator: {**ROUND, "stiffness": STIFFNESS, "damping": DAMPING},
    el.ElasticStop: {"gap": LENGTH, "amplitude": LENGTH, "stiffness": STIFFNESS, "damping": DAMPING},
    el.HarmonicForce: {"amplitude": FORCE},
    el.Iwan: {"stiffnesses": STIFFNESS, "limits": FORCE},
    el.Jenkins: {"stiffness": STIFFNESS, "limit": FORCE},
    el.LinearSpring: {"stiffness": STIFFNESS, "damping": DAMPING},
    el.LoadedMicroSlip: {"spring": STIFFNESS, "contact": STIFFNESS, "limits": FORCE},
    el.MicroSlip: {"spring": STIFFNESS, "contact": STIFFNESS, "limits": FORCE},
    el.ParametricSpring: {"amplitude": STIFFNESS, "stiffness": STIFFNESS},
    el.ParametricStop: {"gap": LENGTH, "amplitude": LENGTH, "stiffness": STIFFNESS, "damping": DAMPING, "variation": STIFFNESS},
    el.PeriodicForce: {"amplitude": NONE, "mean": FORCE},
    el.PolynomialSpring: {f"c{k}": FORCE - k * LENGTH for k in (2, 3, 4, 5)},
    el.Pulse: {"impulse": FORCE + TIME},
    el.RegularizedFriction: {"friction": FORCE, "width": SPEED, "belt_speed": SPEED},
    el.RigidStator: ROUND,
    el.RigidStop: {"gap": LENGTH, "amplitude": LENGTH},
    el.Shift: {},
    el.SquareForce: {"amplitude": FORCE},
    el.SquareSpring: {"amplitude": STIFFNESS, "stiffness": STIFFNESS},
    el.Stribeck: {"kinetic": FORCE, "static": FORCE, "speed": SPEED, "belt_speed": SPEED},
}


@dataclasses.dataclass(frozen=True)
class Image:
    """A system that moves alike.

    Attributes
    ----------
    system : System
    matrix : ndarray, shape (ns, ns)
        A state of the image is ``matrix @ y``.
    time : float
        Times of the image over those of the system.
    later : float
        What the image's clock has less, in forcing periods of the system.
    mirrored : bool
        Whether slips up have become slips down.
    factor : callable
        ``factor(name)``: values of a parameter of the image over those of the system.
    """

    system: System
    matrix: np.ndarray
    time: float = 1.0
    later: float = 0.0
    mirrored: bool = False
    factor: Callable[[str], float] = lambda name: 1.0

    def state(self, y):
        """Return the states (..., ns) of the image."""
        return np.asarray(y) @ self.matrix.T


def with_elements(system: System, elements) -> System:
    """Return a hand-made system with these elements."""
    return System(system.mass, system.damping, system.stiffness, elements, omega=system.omega)


def memory_count(system: System) -> int:
    return sum(len(element.memory) for element in system.elements)


def in_units(system: System, length=1.0, time=1.0, mass=1.0) -> Image:
    """Return the system with lengths, times and masses that are these factors times as many."""
    units = np.array([length, time, mass], float)

    def by(dimension):
        return float(np.prod(units**dimension))

    def scaled(element):
        changes = {}
        for name, dimension in DIMENSIONS[type(element)].items():
            value = getattr(element, name)
            if value is not None:
                changes[name] = tuple(by(dimension) * v for v in value) if isinstance(value, tuple) else by(dimension) * value
        return dataclasses.replace(element, **changes)

    def factor(name):
        name = image.parameter_name(name)
        known = {"omega": RATE, "mass": MASS, "damping": DAMPING, "stiffness": STIFFNESS}
        field = name.partition("[")[0]
        if field in known:
            return by(known[field])
        label, _, field = field.partition(".")
        return by(DIMENSIONS[type(system.elements[system.labels.index(label)])].get(field, NONE))

    omega = None if system.omega is None else system.omega * by(RATE)
    image = System(system.mass * by(MASS), system.damping * by(DAMPING), system.stiffness * by(STIFFNESS),
                   [scaled(element) for element in system.elements], omega=omega)
    n = system.n
    matrix = np.diag([by(LENGTH)] * n + [by(SPEED)] * n + [by(LENGTH)] * memory_count(system))
    return Image(image, matrix, float(time), factor=factor)


def in_coordinates(system: System, P) -> Image:
    """Return the system in coordinates p with q = P p; where a row has one coordinate the element sits on that degree."""
    P = np.asarray(P, float)

    def moved(element):
        if isinstance(element, el.BaseMotion):
            row = np.ones(system.n) if element.row is None else np.array(element.row)
            return dataclasses.replace(element, row=tuple(np.linalg.solve(P, row)))
        if isinstance(element, el.AroundPoint):
            order = [int(np.argmax(P[k])) for k in range(system.n)]
            at = {name: getattr(element, name) for name in ("x", "y", "against_x", "against_y")}
            return dataclasses.replace(element, **{name: None if k is None else order[k] for name, k in at.items()})
        row = (np.eye(system.n)[element.dof] if element.row is None else np.array(element.row)) @ P
        k = int(np.argmax(np.abs(row)))
        if np.array_equal(row, np.eye(system.n)[k]):
            return dataclasses.replace(element, dof=k, row=None)
        return dataclasses.replace(element, dof=0, row=tuple(row))

    image = System(P.T @ system.mass @ P, P.T @ system.damping @ P, P.T @ system.stiffness @ P,
                   [moved(element) for element in system.elements], omega=system.omega)
    inverse, rest = np.linalg.inv(P), memory_count(system)
    matrix = np.zeros((2 * system.n + rest,) * 2)
    matrix[:system.n, :system.n] = matrix[system.n:2 * system.n, system.n:2 * system.n] = inverse
    matrix[2 * system.n:, 2 * system.n:] = np.eye(rest)
    return Image(image, matrix)


def permuted(system: System, order) -> Image:
    """Return the system with its degrees of freedom in another order: the new k-th is the old ``order[k]``-th."""
    return in_coordinates(system, np.eye(system.n)[:, list(order)])


def turned(system: System, angle=0.4) -> Image:
    """Return the system in coordinates turned in the plane of the first and the last degree of freedom."""
    P = np.eye(system.n)
    P[np.ix_([0, -1], [0, -1])] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return in_coordinates(system, P)


def in_other_order(system: System, order) -> Image:
    """Return the system with its elements in another order; they keep their labels."""
    named = [dataclasses.replace(element, label=label) for element, label in zip(system.elements, system.labels, strict=True)]
    at = np.cumsum([2 * system.n, *(len(element.memory) for element in system.elements)])
    columns = [*range(2 * system.n), *(j for k in order for j in range(at[k], at[k + 1]))]
    return Image(with_elements(system, [named[k] for k in order]), np.eye(at[-1])[columns])


def opposite(system: System) -> Image:
    """Return the system seen from the other side, q -> -q."""
    def mirrored(element):
        belt = {"belt_speed": -element.belt_speed} if hasattr(element, "belt_speed") else {}
        if isinstance(element, el.Coulomb) and element.friction_negative is not None:
            belt |= {"friction": element.friction_negative, "friction_negative": element.friction}
        if belt:
            return dataclasses.replace(element, **belt)
        if isinstance(element, el.HarmonicForce | el.BaseMotion):
            return dataclasses.replace(element, amplitude=-element.amplitude)
        if isinstance(element, el.ConstantForce):
            return dataclasses.replace(element, force=-element.force)
        if isinstance(element, el.Wall):
            return dataclasses.replace(element, side=-element.side, amplitude=-element.amplitude if element.harmonic else 0.0)
        if isinstance(element, el.PolynomialSpring):
            return dataclasses.replace(element, c2=-element.c2, c4=-element.c4)
        return element

    def factor(name):
        name = image.parameter_name(name)
        return -1.0 if name.partition(".")[2] in ("belt_speed", "force", "amplitude", "c2", "c4") else 1.0

    image = with_elements(system, [mirrored(element) for element in system.elements])
    return Image(image, -np.eye(2 * system.n + memory_count(system)), mirrored=True, factor=factor)


def later(system: System, part: float) -> Image:
    """Return the system on a clock that starts ``part`` of a forcing period later: y_image(t) = y(t + part T)."""
    def shifted(element):
        if isinstance(element, el.HarmonicForce | el.BaseMotion | el.Wall) and element.harmonic:
            return dataclasses.replace(element, phase=element.phase + 2.0 * np.pi * part * element.harmonic)
        if getattr(element, "load_amplitude", None) is not None:
            return dataclasses.replace(element, load_phase=element.load_phase + 2.0 * np.pi * part * element.load_harmonic)
        return element
    return Image(with_elements(system, [shifted(element) for element in system.elements]),
                 np.eye(2 * system.n + memory_count(system)), later=part)


def idle(system: System, rigid: bool) -> tuple[el.Element, ...]:
    """Return elements that change nothing: loads of no size, springs without stiffness, a stop far away on either side."""
    last = system.n - 1
    return (el.HarmonicForce(0.0, harmonic=3, label="no_load"), el.ConstantForce(0.0, dof=last, label="no_weight"),
            el.LinearSpring(0.0, 0.0, dof=last, label="no_spring"), el.ElasticStop(1e4, 5.0, dof=last, label="far"),
            el.RigidStop(1e4, 0.5, side=-1, label="far_below") if rigid else el.ElasticStop(1e4, 5.0, side=-1, label="far_below"))


def crowded(system: System, rigid: bool = True) -> Image:
    """Return the system with elements beside it that change nothing, before its own; ``rigid``: a rigid stop among them."""
    named = [dataclasses.replace(element, label=label) for element, label in zip(system.elements, system.labels, strict=True)]
    return Image(with_elements(system, [*idle(system, rigid), *named]), np.eye(2 * system.n + memory_count(system)))


def side_by_side(system: System, other: System, first: bool) -> tuple[System, list[int], list[int]]:
    """Return two uncoupled systems as one, and where the states of each are in its states; the second has no memory."""
    n, m = system.n, other.n
    begin, free = (0, n) if first else (m, 0)

    def block(name):
        matrix = np.zeros((n + m, n + m))
        matrix[begin:begin + n, begin:begin + n] = getattr(system, name)
        matrix[free:free + m, free:free + m] = getattr(other, name)
        return matrix

    def placed(element, start, size):
        if isinstance(element, el.BaseMotion):  # a frame for its own coordinates
            carried = (1.0,) * size if element.row is None else element.row
            return dataclasses.replace(element, row=(0.0,) * start + carried + (0.0,) * (n + m - start - size))
        if element.row is None:
            return dataclasses.replace(element, dof=element.dof + start)
        return dataclasses.replace(element, row=(0.0,) * start + element.row + (0.0,) * (n + m - start - size))

    joined = System(block("mass"), block("damping"), block("stiffness"),
                    [*(placed(element, begin, n) for element in system.elements),
                     *(placed(element, free, m) for element in other.elements)], omega=system.omega)
    at = [*range(begin, begin + n), *range(n + m + begin, 2 * n + m + begin),
          *range(2 * (n + m), 2 * (n + m) + memory_count(system))]
    return joined, at, [*range(free, free + m), *range(n + m + free, n + 2 * m + free)]


M2 = np.array([[1.0, 0.25], [0.25, 1.44]])
C2, K2 = np.array([[0.11, -0.019], [-0.019, 0.11]]), np.array([[1.38, -0.38], [-0.38, 1.38]])


def pair(*elements, omega=0.9) -> System:
    """Return two masses coupled by inertia, damping and stiffness."""
    return System(M2, C2, K2, elements, omega=omega)


SCENES = {  # with events of every kind; each moves otherwise when a sign, a row or a unit of it is changed
    "stop": System(1.0, 0.1, 1.0, (el.HarmonicForce(0.7), el.RigidStop(0.6, 0.7)), omega=0.8),
    "two stops, one moves": pair(el.HarmonicForce(1.3, phase=0.4, dof=1), el.RigidStop(0.5, 0.6, row=(1.0, -1.0)),
                                 el.RigidStop(0.7, 0.8, side=-1, dof=1, amplitude=0.1, phase=0.3, harmonic=1)),
    "stop and friction": pair(el.HarmonicForce(2.1), el.RigidStop(0.6, 0.5), el.Coulomb(0.4, 0.3, static_ratio=1.3, dof=1)),
    "belts": pair(el.HarmonicForce(0.9, harmonic=2), el.Coulomb(0.5, belt_speed=0.3, row=(1.0, -1.0)),
                  el.Coulomb(0.6, load_amplitude=0.7, load_harmonic=2, load_phase=0.3, dof=1), el.ConstantForce(0.2, dof=1)),
    "elastic": pair(el.BaseMotion(0.6, harmonic=1, phase=0.2, damper="ground", row=(1.0, 0.5)),
                    el.ElasticStop(0.3, 6.0, 0.2, dof=1), el.LinearSpring(0.3, 0.05, dof=1),
                    el.ElasticStop(0.4, 3.0, 0.3, release="force", side=-1, row=(1.0, -0.5))),
    "sliders": pair(el.HarmonicForce(1.7, row=(1.0, 0.3)), el.Jenkins(2.0, 0.4, dof=1),
                    el.Iwan((2.0, 1.0), (0.3, 0.5), row=(1.0, -1.0)), el.MicroSlip(3.0, 1.0, (0.2, 0.3), dof=0)),
    "varying load": pair(el.HarmonicForce(1.7), el.Jenkins(2.0, 0.4, load_amplitude=1.2, load_phase=0.7, dof=1)),
    "cubic": pair(el.HarmonicForce(0.9, dof=1), el.CubicSpring(0.8), el.RigidStop(0.8, 0.7, dof=1)),
    "falling friction": System(1.0, 0.05, 1.0, (el.HarmonicForce(0.5), el.Stribeck(0.5, 1.0, 0.4, belt_speed=0.3)), omega=0.7),
}

IMAGES: dict[str, Callable[[System], Image]] = {
    "small units": lambda system: in_units(system, 1e-4, 1e5, 3e2),
    "large units": lambda system: in_units(system, 1e5, 1e-4, 2e-3),
    "reversed": lambda system: permuted(system, range(system.n)[::-1]),
    "turned": lambda system: turned(system) if system.n > 1 else in_coordinates(system, [[2.5]]),
    "opposite": opposite,
    "reordered": lambda system: in_other_order(system, range(len(system.elements))[::-1]),
    "crowded": crowded,
}

