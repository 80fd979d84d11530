"""What somebody once decided: defaults of functions, constants of methods, fields of records, members of enumerations.

A folder of tests keeps the table of its part of the package in ``decided.txt``; a changed number is a decision, which is taken
there too.  ``python -m tests.reference.defaults`` writes the tables anew: look at what differs before you commit it.
"""
import ast
import dataclasses
import difflib
import enum
import hashlib
import importlib
import inspect
import pathlib
import pkgutil
import types

import numpy as np

TESTS = pathlib.Path(__file__).resolve().parents[1]
FOLDERS = ("compose", "elements", "ensemble", "flow", "jobs", "models", "orbits", "plotting", "solve", "structure", "systems", "")
ELSEWHERE = ("bifurc.ensemble.batch",)  # texts of kernels: their numbers are tested as kernels
SKIPPED = ("BUILT_IN", "_BUILDERS", "_FIELDS", "ADDRESSES")  # registers that grow, addresses of compiled functions
LONGEST = 80  # characters of a text that is shown itself
PLAIN = (bool, int, float, complex, str, bytes, type(None), np.generic)


def table(folder: str) -> str:
    """Return the table of a folder of the package; of the modules that lie in none for an empty name."""
    return "".join(f"{line}\n" for module in _modules(folder) for line in _lines(module))


def compare(folder: str) -> None:
    """Raise an AssertionError that shows what differs from the table of a folder."""
    known, found = (TESTS / folder / "decided.txt").read_text(encoding="utf-8"), table(folder)
    differs = list(difflib.unified_diff(known.splitlines(), found.splitlines(), "decided.txt", "found", n=0, lineterm=""))
    assert not differs, "\n".join([*differs, "meant so? python -m tests.reference.defaults writes the tables anew"])


def _modules(folder: str):
    package = importlib.import_module(f"bifurc.{folder}" if folder else "bifurc")
    if folder:
        yield package
    walk = (pkgutil.walk_packages if folder else pkgutil.iter_modules)(package.__path__, f"{package.__name__}.")
    for item in sorted(walk, key=lambda item: item.name):
        if not item.name.startswith(ELSEWHERE) and (folder or not item.ispkg):
            yield importlib.import_module(item.name)


def _lines(module):
    name = module.__name__.removeprefix("bifurc.")
    tree = ast.parse(pathlib.Path(module.__file__).read_text(encoding="utf-8"))
    own = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}  # not imported
    for key in sorted(vars(module)):
        value = vars(module)[key]
        value = getattr(value, "py_func", value)  # a compiled function
        if key.startswith("__") or inspect.ismodule(value):
            continue
        if inspect.isfunction(value) or inspect.isclass(value):
            if value.__module__ == module.__name__:
                yield from _of_class(f"{name}.{key}", value) if inspect.isclass(value) else _of_function(f"{name}.{key}", value)
        elif key in own and key not in SKIPPED and key.strip("_").isupper() and (shown := _shown(value)) is not None:
            yield f"{name}.{key} = {shown}"


def _of_function(name: str, function):
    given = [f"{key}={_shown(item.default) or type(item.default).__name__}"
             for key, item in inspect.signature(inspect.unwrap(function)).parameters.items() if item.default is not item.empty]
    if given:
        yield f"{name}({', '.join(given)})"


def _of_class(name: str, cls):
    if issubclass(cls, enum.Enum):
        yield f"{name}: {', '.join(f'{item.name}={item.value!r}' for item in cls)}"
        return
    if "__dataclass_params__" in vars(cls):
        how = cls.__dataclass_params__
        own = vars(cls).get("__annotations__", {})
        fields = [field for field in dataclasses.fields(cls) if field.name in own]
        shown = [f"{field.name}={_shown(field.default) or '?'}" for field in fields if field.default is not dataclasses.MISSING]
        hidden = [field.name for field in fields if not field.repr]
        yield (f"{name}{' frozen' if how.frozen else ''}{'' if how.eq else ' eq=False'}({', '.join(shown)})"
               + (f" hides {', '.join(hidden)}" if hidden else ""))
        skipped = {field.name for field in fields}
    else:
        skipped = set()
    for key, value in sorted(vars(cls).items()):
        if key in skipped or key == "_field_defaults" or key.startswith("__") and key != "__init__":
            continue
        value = value.__func__ if isinstance(value, classmethod | staticmethod) else value
        if inspect.isfunction(value):
            if "__dataclass_params__" not in vars(cls) or key != "__init__":
                yield from _of_function(f"{name}.{key}", value)
        elif not isinstance(value, property | types.MemberDescriptorType) and (shown := _shown(value)) is not None:
            yield f"{name}.{key} = {shown}"


def _shown(value) -> str | None:
    """Return a value as text that is the same in every process, or None."""
    if isinstance(value, enum.Enum):
        return f"{type(value).__name__}.{value.name}"
    if isinstance(value, np.generic):
        return repr(value.item())
    if isinstance(value, str) and len(value) > LONGEST:
        return f"text {hashlib.sha256(value.encode()).hexdigest()[:12]}"
    if isinstance(value, PLAIN):
        return repr(value)
    if inspect.isfunction(value) or inspect.isclass(value):
        return value.__qualname__
    if isinstance(value, np.ndarray) and value.size <= 64:
        return f"array({value.tolist()!r})"
    if isinstance(value, tuple | list):
        items = [_shown(item) for item in value]
        return None if None in items else f"{'(' if isinstance(value, tuple) else '['}{', '.join(map(str, items))}" \
            f"{')' if isinstance(value, tuple) else ']'}"
    if isinstance(value, set | frozenset):
        items = [_shown(item) for item in value]
        return None if None in items else "{" + ", ".join(sorted(map(str, items))) + "}"
    if isinstance(value, dict):
        pairs = [(_shown(key), _shown(item)) for key, item in value.items()]
        return None if any(None in pair for pair in pairs) else "{" + ", ".join(f"{key}: {item}" for key, item in pairs) + "}"
    return None


if __name__ == "__main__":
    for each in FOLDERS:
        (TESTS / each / "decided.txt").write_text(table(each), encoding="utf-8")
