"""Names of degrees of freedom: ``node.direction``, such as ``tip.uy``."""
import numbers
from collections.abc import Iterable, Sequence
from typing import Any

from ..checks import many, plain_text, refused, shown, whole


def dof_names(dofs: Iterable | None, n: int, owner: str = "System") -> tuple[str, ...] | None:
    """Return names of ``n`` degrees of freedom, from names or from pairs (node, direction); None stays None.

    Raises
    ------
    ValueError
        Wrong number, doubled names, names that are no text.
    """
    if dofs is None:
        return None
    made = many(owner, "dofs", dofs, of=_name)
    if len(made) != n:
        raise ValueError(f"{owner}: dofs has {len(made)} names; there are {n} degrees of freedom")
    doubled = sorted({name for name in made if made.count(name) > 1}) if len(set(made)) < n else []
    if doubled:
        raise ValueError(f"{owner}: dofs names {', '.join(doubled[:5])} more than once")
    return tuple(made)


def named(dof: Any) -> str | None:
    """Return the name of a degree of freedom given by name or pair (node, direction), names or numbers; None: it is neither."""
    if isinstance(dof, str):
        return plain_text(dof)
    if isinstance(dof, tuple | list) and len(dof) == 2 and all(
            isinstance(part, str | numbers.Integral) and not isinstance(part, bool) and part != "" for part in dof):
        return f"{dof[0]}.{dof[1]}"
    return None


def place_of(dof: Any, names: Sequence[str] | None, n: int, owner: str = "System", argument: str = "dof") -> int:
    """Return the number of a degree of freedom given by name, by pair (node, direction), or by number.

    Raises
    ------
    ValueError
        When there is none of that name or number; the message names similar ones.
    """
    name = named(dof)
    if name is not None:
        if names is None:
            raise ValueError(f"{owner}: {argument} = {shown(dof)} is a name, and this system has no names; give them with "
                             "dofs=[...]")
        if name in names:
            return names.index(name)
        node = name.split(".")[0]
        near = [other for other in names if other.split(".")[0] == node] or list(names[:8])
        raise ValueError(f"{owner}: {argument}: there is no degree of freedom {shown(dof)}; there are {', '.join(near[:8])}"
                         f"{' ...' if len(names) > len(near[:8]) else ''}")
    return whole(owner, argument, dof, least=0, most=n - 1)


def _name(owner: str, argument: str, item) -> str:
    """Return a name from a name or a pair (node, direction)."""
    name = named(item)
    if not name:
        raise refused(owner, argument, item, "a name such as 'tip.uy', or a pair such as ('tip', 'uy')")
    return name
