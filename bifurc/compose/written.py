"""Modules that the package writes: kept as files named by a hash of what is in them, and imported like any other.

A file appears by renaming, whole or not at all; a later process, and numba's cache in it, finds it again.
"""
import importlib.util
import os
import pathlib
import sys
import tempfile
import threading

_lock = threading.RLock()  # a written module may import another one


def load(name: str, path: pathlib.Path, text: str):
    """Return the module ``name`` with this text, from ``path``, which is written when it is not there."""
    with _lock:
        if name in sys.modules:
            return sys.modules[name]
        if not path.exists():
            write(path, text)
        spec = importlib.util.spec_from_file_location(name, path)
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        try:
            spec.loader.exec_module(module)
        except BaseException:
            del sys.modules[name]
            raise
        return module


def write(path: pathlib.Path, text: str) -> None:
    """Write a file that appears whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, suffix=".part")
    with os.fdopen(handle, "w", encoding="utf-8") as file:
        file.write(text)
    os.replace(temporary, path)


def source(name: str) -> str:
    """Return the text of a module of the package."""
    spec = importlib.util.find_spec(name)
    assert spec is not None and spec.origin is not None
    return pathlib.Path(spec.origin).read_text(encoding="utf-8")
