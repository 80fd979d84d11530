"""Names of the components of a state: q0, v0, w0, ... of coordinates, velocities and memory; a system of first order names its own.

The one place that knows them: grids, sections, regions, starts, columns and pictures ask here.
"""
import re
from collections.abc import Mapping, Sequence

import numpy as np

from ..checks import number, shown

MEASURES = ("q", "max", "min", "rms", "h1", "state")  # of a component, in names of columns: max_0, or max_v


def named(name: str, owner: str) -> str:
    """Return the name of a component that some system may have, or raise ValueError."""
    if not isinstance(name, str) or not name.isidentifier():
        raise ValueError(f"{owner}: component {shown(name)} is unknown; components are q0, q1, ... (coordinates), v0, v1, ... "
                         "(velocities) and w0, w1, ... (memory), or the states of a system of first order by name")
    return name


def place_of(name: str, n: int, ns: int, owner: str = "grid", states: Sequence[str] = ()) -> int:
    """Return the place of a component in the state (q, v, w) of ``n`` degrees of freedom and ``ns`` states, ``states`` by name.

    Raises
    ------
    ValueError
        When the system has not this component; the message lists those it has.
    """
    if name in states:
        return list(states).index(name)
    match = re.fullmatch(r"([qvw])(0|[1-9]\d*)", named(name, owner))
    kind, index = (match[1], int(match[2])) if match else ("", 0)
    if match and index < (ns - 2 * n if kind == "w" else n):
        return index + {"q": 0, "v": n, "w": 2 * n}[kind]
    if states:
        raise ValueError(f"{owner}: component {name!r} is unknown to this system; it has the states {', '.join(states)}")
    memory = f", memory w0 .. w{ns - 2 * n - 1}" if ns > 2 * n else ", no memory"
    raise ValueError(f"{owner}: component {name!r} is unknown to this system; it has {n} degree{'s' * (n > 1)} of "
                     f"freedom: q0 .. q{n - 1} and v0 .. v{n - 1}{memory}")


def component_names(n: int, ns: int, states: Sequence[str] = ()) -> tuple[str, ...]:
    """Return the names of all components of a state, in their order."""
    counts = (("q", n), ("v", n), ("w", ns - 2 * n))
    return tuple(states) or tuple(f"{kind}{k}" for kind, count in counts for k in range(count))


def state_of(owner: str, given: Mapping, n: int, ns: int, states: Sequence[str] = ()) -> np.ndarray:
    """Return the state that names components, (2 n,) where it names no memory, else (ns,); those not named are 0."""
    places = {place_of(name, n, ns, owner, states): number(owner, name, value) for name, value in given.items()}
    found = np.zeros(ns if max(places, default=0) >= 2 * n else 2 * n)
    for place, value in places.items():
        found[place] = value
    return found


def states_of(shown) -> tuple[str, ...]:
    """Return the names of the states of what belongs to a system of first order; none of anything else."""
    return getattr(getattr(shown, "system", None), "states", ())


def by_number(column: str, states: Sequence[str]) -> str:
    """Return the name of a column by the number of its component: ``max_v`` is ``max_0`` where v is the first state."""
    kind, _, name = column.partition("_")
    return f"{kind}_{list(states).index(name)}" if kind in MEASURES and name in states else column


def worded(column: str, states: Sequence[str]) -> str:
    """Return the name of a column by the name of its component, see `by_number`."""
    kind, _, number_ = column.partition("_")
    return f"{kind}_{states[int(number_)]}" if kind in MEASURES and number_.isdecimal() and int(number_) < len(states) else column
