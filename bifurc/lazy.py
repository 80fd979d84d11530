"""What is made when it is first used: names of packages (PEP 562), so that importing one costs next to nothing, and numbers; and
old names, which work for one more version."""
import warnings
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import Any


def lazy(package: str, homes: Mapping[str, str],
         modules: Sequence[str] = ()) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return the ``__getattr__`` and the ``__dir__`` of a package.

    Parameters
    ----------
    package : str
        Its full name.
    homes : mapping of str to str
        Public names and the modules, below the package, that define them.
    modules : sequence of str
        Public modules.
    """
    public = [*sorted(homes), *modules]

    def find(name: str) -> Any:
        if name in modules:
            return import_module(f"{package}.{name}")
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}; it has {', '.join(public)}")
        return getattr(import_module(f"{package}.{homes[name]}"), name)

    return find, lambda: public


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


class Later:
    """A number that is found when ``float`` first asks for it; copied and pickled as that number."""

    __slots__ = ("_find", "_value")

    def __init__(self, find: Callable[[], float]):
        self._find: Callable[[], float] | None = find

    def __float__(self) -> float:
        if self._find is not None:
            self._value, self._find = float(self._find()), None
        return self._value

    def __reduce__(self):
        return float, (float(self),)
