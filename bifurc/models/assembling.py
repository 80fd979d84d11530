"""A system from the matrices of a model, with names of its degrees of freedom."""
import logging
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ..structure.checks import Structure, checked
from ..structure.reduction import Reduction
from ..system import System
from .reducing import carried

_log = logging.getLogger("bifurc.models")


def system_from_matrices(M: Any, C: Any, K: Any, *, G: Any = None, dofs: Sequence | None = None, elements: Iterable = (),
                         omega: float | None = None, symmetric: bool = True) -> System:
    """Return the system of checked matrices, see `System.from_matrices`."""
    found = checked(M, C, K, G, dofs, symmetric)
    _log.info("from_matrices: %s", found.report)
    return assembled(found, elements, omega)


def assembled(found: Structure, elements: Iterable = (), omega: float | None = None) -> System:
    """Return the system of a structure; coordinates without mass are condensed.

    Raises
    ------
    ValueError
        When coordinates without mass are damped, cannot be condensed, or carry an element.
    """
    elements = tuple(elements)
    if not found.massless:
        return System(found.M, found.C + found.G, found.K, elements, omega=omega, dofs=found.dofs)
    light = np.array(found.massless)
    heavy = np.setdiff1d(np.arange(found.n), light)
    name = [str(i) if found.dofs is None else found.dofs[i] for i in light]
    damped = (found.C + found.G)[light].any(axis=1) | (found.C + found.G)[:, light].any(axis=0)
    if damped.any():
        raise ValueError(f"from_matrices: coordinate {name[int(damped.argmax())]} has damping but no mass; give it a small mass, "
                         f"or take "
                         "its damping out")
    if not heavy.size:
        raise ValueError("from_matrices: M is zero; a motion needs mass")
    own = found.K[np.ix_(light, light)]
    if np.linalg.cond(own) > 1e14:
        raise ValueError(f"from_matrices: the coordinates without mass ({', '.join(name[:5])}) have no stiffness against each "
                         f"other; "
                         "take them out of the matrices")
    T = np.zeros((found.n, heavy.size))
    T[heavy] = np.eye(heavy.size)
    T[light] = -np.linalg.solve(own, found.K[np.ix_(light, heavy)])
    full = System(np.eye(found.n), np.zeros((found.n, found.n)), found.K, elements, omega=omega, dofs=found.dofs)  # places names
    for element in full.elements:
        rows = element.site(found.n).R
        if rows[:, light].any():
            at = name[int(rows[:, light].any(axis=0).argmax())]
            raise ValueError(f"from_matrices: {element!r} acts on {at}, which has no mass; give it the mass that moves with the "
                             f"contact")
    K = found.K[np.ix_(heavy, heavy)] - found.K[np.ix_(heavy, light)] @ np.linalg.solve(own, found.K[np.ix_(light, heavy)])
    dofs = None if found.dofs is None else tuple(found.dofs[i] for i in heavy)
    K = 0.5 * (K + K.T) if np.allclose(found.K, found.K.T) else K
    made = System(found.M[np.ix_(heavy, heavy)], (found.C + found.G)[np.ix_(heavy, heavy)], K,
                  [carried(element, T, found.M, found.C) for element in full.elements], omega=omega, dofs=dofs)
    none, kept = np.empty(0), tuple(int(i) for i in heavy)
    made.__dict__["reduction"] = Reduction("condensed", kept, T, found.dofs, none, none, 0.0, np.zeros((0, 0)))
    return made
