"""Packages whose names are loaded when they are first used (PEP 562): importing one costs next to nothing."""
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
