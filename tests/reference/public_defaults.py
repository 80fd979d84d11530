"""What a caller of the public names relies on without writing it: defaults of functions and records, members of enumerations.

The table is kept in ``tests/public_defaults.txt``; a change there is one that users notice, and has a line in the changelog.
``python -m tests.reference.public_defaults`` writes it anew: look at what differs before you commit it.
"""
import dataclasses
import difflib
import enum
import inspect
import pathlib

import bifurc as bf

TABLE = pathlib.Path(__file__).resolve().parents[1] / "public_defaults.txt"
MODULES = ("elements", "systems", "control")  # whose names are public too


def table() -> str:
    """Return a line for every public function with defaults, record with defaults, and enumeration."""
    found = {name: getattr(bf, name) for name in bf.__all__}
    found |= {f"{module}.{name}": getattr(getattr(bf, module), name) for module in MODULES for name in getattr(bf, module).__all__}
    return "".join(f"{line}\n" for name in sorted(found) for line in _lines(name, found[name]))


def compare() -> None:
    """Raise an AssertionError that shows what differs from the table."""
    known = TABLE.read_text(encoding="utf-8")
    differs = list(difflib.unified_diff(known.splitlines(), table().splitlines(), "known", "found", n=0, lineterm=""))
    assert not differs, "\n".join([*differs, "meant so? python -m tests.reference.public_defaults writes the table anew"])


def _lines(name: str, value):
    if inspect.isclass(value) and issubclass(value, enum.Enum):
        yield f"{name}: {', '.join(f'{item.name}={item.value!r}' for item in value)}"
    elif inspect.isclass(value):
        if dataclasses.is_dataclass(value):
            yield from _given(name, value)
        for key, method in sorted(vars(value).items()):
            method = method.__func__ if isinstance(method, classmethod | staticmethod) else method
            if inspect.isfunction(method) and not key.startswith("_"):
                yield from _given(f"{name}.{key}", method)
    elif callable(value):
        yield from _given(name, value)


def _given(name: str, function):
    parameters = inspect.signature(function).parameters.values()
    given = [f"{item.name}={_shown(item.default)}" for item in parameters if item.default is not item.empty]
    if given:
        yield f"{name}({', '.join(given)})"


def _shown(value) -> str:
    """Return a default as text that is the same in every process."""
    if isinstance(value, enum.Enum):
        return f"{type(value).__name__}.{value.name}"
    if inspect.isfunction(value) or inspect.isclass(value):
        return value.__qualname__
    if isinstance(value, bool | int | float | complex | str | tuple | type(None)):
        return repr(value)
    return type(value).__name__


if __name__ == "__main__":
    TABLE.write_text(table(), encoding="utf-8")
