"""Names of degrees of freedom: ``node.direction``, such as ``tip.uy``."""
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np


def dof_names(dofs: Iterable | None, n: int, owner: str = "System") -> tuple[str, ...] | None:
    """Return names of ``n`` degrees of freedom, from names or from pairs (node, direction); None stays None.

    Raises
    ------
    ValueError
        Wrong number, doubled names, names that are no text.
    """
    if dofs is None:
        return None
    made = []
    for item in dofs:
        name = named(item)
        if not name:
            raise ValueError(f"{owner}: dofs contain {item!r}; they must be names such as 'tip.uy', or pairs such as ('tip', 'uy')")
        made.append(name)
    if len(made) != n:
        raise ValueError(f"{owner}: dofs has {len(made)} names; there are {n} degrees of freedom")
    doubled = sorted({name for name in made if made.count(name) > 1}) if len(set(made)) < n else []
    if doubled:
        raise ValueError(f"{owner}: dofs names {', '.join(doubled[:5])} more than once")
    return tuple(made)


def named(dof: Any) -> str | None:
    """Return the name of a degree of freedom given by name or pair (node, direction); None: it is neither."""
    return dof if isinstance(dof, str) else ".".join(str(part) for part in dof) if isinstance(dof, tuple | list) else None


def place_of(dof: Any, names: Sequence[str] | None, n: int, owner: str = "System") -> int:
    """Return the number of a degree of freedom given by name, by pair (node, direction), or by number.

    Raises
    ------
    ValueError
        When there is none of that name or number; the message names similar ones.
    """
    name = named(dof)
    if name is not None:
        if names is None:
            raise ValueError(f"{owner}: dof = {dof!r} is a name, and this system has no names; give them with dofs=[...]")
        if name in names:
            return names.index(name)
        node = name.split(".")[0]
        near = [other for other in names if other.split(".")[0] == node] or list(names[:8])
        raise ValueError(f"{owner}: there is no degree of freedom {dof!r}; there are {', '.join(near[:8])}"
                         f"{' ...' if len(names) > len(near[:8]) else ''}")
    if isinstance(dof, bool | np.bool_) or not isinstance(dof, int | np.integer) or not 0 <= dof < n:
        raise ValueError(f"{owner}: dof = {dof!r} is not allowed; it must be 0 .. {n - 1}")
    return int(dof)
