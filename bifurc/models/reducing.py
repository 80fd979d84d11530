"""Reduced systems: component mode synthesis with the elements carried over, and what becomes of contacts without mass."""
import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..checks import whole
from ..elements import BaseMotion, Coulomb, ElasticStop, Element, Force, Jenkins, RigidStop
from ..elements.atrow import AtRow
from ..solve.interrupts import LARGE, interruptible
from ..structure import names
from ..structure.reduction import reduce
from ..structure.statics import product
from ..system import System

UNIT = 1e-13  # a carried row so close to one coordinate is that coordinate
FITS = 1e-9  # relative residual of a rigid motion in the reduced coordinates


def reduced_system(system: System, keep: Sequence, modes: int, method: str) -> System:
    """Return the reduced system, see `System.reduced`."""
    if isinstance(keep, str | int | np.integer):
        keep = (keep,)
    kept = tuple(names.place_of(dof, system.dofs, system.n, "reduced", "keep") for dof in keep)
    if len(set(kept)) < len(kept):
        raise ValueError(f"reduced: keep = {list(keep)!r} names a coordinate twice")
    modes = whole("reduced", "modes", modes, least=0)
    M, C, K = system.mass, system.damping, system.stiffness
    if not np.allclose(K, K.T, rtol=0.0, atol=1e-9 * np.abs(K).max(initial=0.0)):
        raise ValueError("reduced: the stiffness is not symmetric; move its circulatory part into a Force element, and reduce "
                         "the rest")
    mass, stiffness, found = interruptible(system.n >= LARGE, None, reduce, M, 0.5 * (K + K.T), kept, modes, method, system.dofs)
    T = found.recovery
    damping = T.T @ product(C, T)  # in proportion to the stiffness it cancels as that does
    dofs = [f"q{i}" if system.dofs is None else system.dofs[i] for i in kept] + [f"mode.{k + 1}" for k in range(modes)]
    if method != "massless":
        elements = [carried(element, T, M, C) for element in system.elements]
        made = System(mass, damping, stiffness, elements, omega=system.omega, dofs=dofs)
        made.__dict__["reduction"] = found
        return made
    b = len(kept)
    standing = -np.linalg.solve(stiffness[:b, :b], stiffness[:b, b:])  # kept coordinates of the modes without a force on them
    free = T[:, b:] + T[:, :b] @ standing
    elements = _without_mass(system, kept, found.residual, free)
    made = System(np.eye(modes), free.T @ product(C, free), np.diag(found.frequencies**2), elements, omega=system.omega,
                  dofs=dofs[b:])
    made.__dict__["reduction"] = dataclasses.replace(found, recovery=free)
    return made


def carried(element: Element, T: np.ndarray, M: np.ndarray, C: np.ndarray) -> Element:
    """Return an element of the full coordinates as it acts on coordinates that they are ``T`` (n, m) times.

    Raises
    ------
    ValueError
        For an element whose place cannot be carried.
    """
    if isinstance(element, BaseMotion):
        along = np.ones(len(T)) if element.row is None else np.array(element.row)
        row, *_ = np.linalg.lstsq(T, along, rcond=None)
        if np.abs(T @ row - along).max() > FITS * np.abs(along).max():
            raise ValueError(f"reduced: {element!r} moves all coordinates in a way that the reduced ones cannot; with "
                             "method='craig-bampton' keep the coordinates on the frame, or write the load as "
                             "HarmonicForce(row=...)")
        return dataclasses.replace(element, row=tuple(row))
    rows = element.site(len(T)).R @ T
    if isinstance(element, AtRow):
        return seated(element, rows[0])
    if isinstance(element, Force):
        return element.seated(rows if len(rows) > 1 else rows[0])
    raise ValueError(f"reduced: {element!r} has a site of its own, which cannot be carried into reduced coordinates; derive it "
                     f"from "
                     "elements.AtRow, or add it to the reduced system")


def seated(element: Any, row: np.ndarray) -> Any:
    """Return an element at a row; at a single coordinate where the row is one."""
    largest = int(np.abs(row).argmax())
    unit = np.zeros(len(row))
    unit[largest] = 1.0
    if np.abs(row - unit).max() <= UNIT:
        return dataclasses.replace(element, dof=largest, row=None)
    return dataclasses.replace(element, dof=0, row=tuple(float(value) for value in row))


def _without_mass(system: System, kept: tuple[int, ...], flexibility: np.ndarray, free: np.ndarray) -> list[Element]:
    """Return the elements of a model whose kept coordinates have no mass: each contact acts through its residual flexibility.

    With u = phi eta + F f a rigid stop is an elastic one of stiffness 1/F (no impact: there is no mass to rebound), an
    elastic one has its own spring in series, a Coulomb contact is an elastic slider.
    """
    made: list[Element] = []
    touched: list[tuple[int, Element]] = []
    for element in system.elements:
        if isinstance(element, BaseMotion):
            made.append(carried(element, free, system.mass, system.damping))
            continue
        rows = element.site(system.n).R
        on = [j for j, place in enumerate(kept) if rows[:, place].any()]
        if not on or not isinstance(element, RigidStop | ElasticStop | Coulomb):
            if on and element.start != ("always",):
                raise ValueError(f"reduced: method='massless' knows what RigidStop, ElasticStop and Coulomb are without mass, not "
                                 f"{element!r}; use method='craig-bampton'")
            if any(isinstance(other, RigidStop | ElasticStop | Coulomb) and other.site(system.n).R[:, kept[j]].any()
                   for other in system.elements for j in on):
                raise ValueError(f"reduced: method='massless': {element!r} loads the same coordinate as a contact, whose residual "
                                 "flexibility it would move; use method='rubin', or load another coordinate")
            made.append(carried(element, free, system.mass, system.damping))
            continue
        own = rows[0, list(kept)]
        if len(on) > 1 or np.count_nonzero(rows[0]) > 1 or own[on[0]] != 1.0:
            raise ValueError(f"reduced: method='massless' takes contacts on one kept coordinate each, not {element!r}")
        j = on[0]
        coupled = [other for k, other in touched if (not _never_both(other, element) if k == j else
                                                     abs(flexibility[j, k]) > FITS * flexibility[j, j])]
        touched.append((j, element))
        if coupled:
            raise ValueError(f"reduced: method='massless': the contacts {coupled[0]!r} and {element!r} share residual "
                             f"flexibility; "
                             "use method='craig-bampton' or 'rubin'")
        soft = float(flexibility[j, j])
        made.append(seated(_softened(element, soft), free[kept[j]]))
    return made


def _never_both(one: Any, other: Any) -> bool:
    """Return whether two contacts of one coordinate never act together: stops on either side of a clearance."""
    if isinstance(one, Coulomb) or isinstance(other, Coulomb) or one.side == other.side:
        return False
    return one.gap + other.gap > abs(one.amplitude) + abs(other.amplitude)


def _softened(element: Any, soft: float) -> Element:
    """Return a contact in series with a flexibility, length per force."""
    if isinstance(element, Coulomb):
        if (element.belt_speed != 0.0 or element.static_ratio != 1.0 or element.static not in (None, element.friction)
                or element.friction_negative is not None):
            raise ValueError(f"reduced: method='massless' takes a Coulomb contact with one friction force and no belt, not "
                             f"{element!r}")
        load = {name: getattr(element, name) for name in ("load_amplitude", "load_harmonic", "load_phase")}
        return Jenkins(stiffness=1.0 / soft, limit=element.friction, dof=element.dof, label=element.label, **load)
    wall = {name: getattr(element, name) for name in ("side", "amplitude", "phase", "harmonic", "dof", "label")}
    if isinstance(element, RigidStop):
        return ElasticStop(element.gap, 1.0 / soft, **wall)
    if element.damping or element.release != "penetration":
        raise ValueError(f"reduced: method='massless' takes elastic stops without damping that part at zero penetration, not "
                         f"{element!r}")
    return ElasticStop(element.gap, element.stiffness / (1.0 + element.stiffness * soft), **wall)
