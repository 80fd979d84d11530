"""Old public names: they work for one more version, with a warning that gives the new one."""
import warnings
from typing import Any


def renamed(namespace: dict, old: dict[str, str]):
    """Return the ``__getattr__`` of a module with the variables ``namespace`` whose names ``old`` (old -> new) are deprecated."""
    def find(name: str) -> Any:
        if name not in old:
            raise AttributeError(f"module {namespace['__name__']!r} has no attribute {name!r}")
        deprecated(f"{namespace['__name__']}.{name}", old[name])
        return namespace[old[name]]
    return find


def deprecated(old: str, new: str) -> None:
    """Warn that a name has changed."""
    warnings.warn(f"{old} is called {new} now; the old name goes with the next version", DeprecationWarning, stacklevel=3)
