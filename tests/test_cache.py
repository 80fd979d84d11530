"""Kernels are keyed by all sources they can see, and by no others."""
import ast
import os
import shutil
import subprocess
import sys

import pytest

from bifurc import _cache


def hashes(folder, *modules):
    """Return the keys of modules of a copy of the package."""
    code = f"from bifurc import _cache; print(*(_cache.closure_hash(m) for m in {modules!r}), _cache.source_hash())"
    return subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=True).stdout.split()


@pytest.mark.parametrize("edited, changed", [
    ("flow/affine/engine.py", (True, True, True)),  # everybody builds on the engine
    ("orbits/shooting/sequence.py", (False, True, False)),
    ("ensemble/proximity.py", (False, False, True)),
    ("elements/kinds.py", (True, True, True)),  # its codes are frozen in kernels
    ("elements/stops.py", (False, False, False)),  # composed into numbers, never compiled
])
def test_an_edit_changes_the_keys_of_those_that_see_it(tmp_path, edited, changed):
    shutil.copytree(_cache._PACKAGE, tmp_path / "bifurc", ignore=shutil.ignore_patterns("__pycache__"))
    modules = ("bifurc.flow.simulate", "bifurc.orbits.find", "bifurc.ensemble.integrator")
    before = hashes(tmp_path, *modules)
    with open(tmp_path / "bifurc" / edited, "a") as file:
        file.write("# edited\n")
    after = hashes(tmp_path, *modules)
    assert tuple(a != b for a, b in zip(after[:3], before[:3], strict=True)) == changed
    assert (after[3] != before[3]) == any(changed)


def test_imports_are_found_as_the_parser_finds_them():
    for path in _cache._PACKAGE.rglob("*.py"):
        parts = path.relative_to(_cache._PACKAGE.parent).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        package = parts[:-1]
        for node in ast.walk(ast.parse(path.read_bytes())):
            if isinstance(node, ast.ImportFrom) and node.module:
                source = ".".join([*package[:len(package) - node.level + 1], node.module]) if node.level else node.module
                modules = {full for alias in node.names if _cache._path(full := f"{source}.{alias.name}") is not None}
                found = set(_cache._imported(name, path))
                assert modules <= found and (source in found or len(modules) == len(node.names)), (name, node.lineno)


def test_kernels_lie_in_the_folder_of_their_sources(tmp_path):
    code = "from bifurc.solve import dense; print(dense.lu._cache.cache_path)"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True,
                         env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)})
    assert out.stdout.startswith(str(tmp_path / _cache.closure_hash("bifurc.solve.dense")))
    assert _cache.kernel_folder("bifurc.flow.scan").name == _cache.closure_hash("bifurc.flow.scan")
    assert _cache.kernel_folder("elsewhere") == _cache.cache_folder() / _cache.source_hash()


def test_a_kernel_from_elsewhere_follows_what_it_calls(tmp_path):
    """Its file stays as it is while the package changes: replayed in its old form it would write beyond shorter arrays."""
    shutil.copytree(_cache._PACKAGE, tmp_path / "bifurc", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "elsewhere.py").write_text("from bifurc._jit import njit\nfrom bifurc.solve.probe import size\n\n\n"
                                           "@njit\ndef twice():\n    return 2 * size()\n")
    told = []
    for size in (7, 8):
        text = f"from .._jit import njit\n\n\n@njit\ndef size():\n    return {size}\n"
        (tmp_path / "bifurc" / "solve" / "probe.py").write_text(text)
        told.append(subprocess.run([sys.executable, "-c", "import elsewhere; print(elsewhere.twice())"], text=True, check=True,
                                   capture_output=True, cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(tmp_path),
                                   "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONDONTWRITEBYTECODE": "1"}).stdout)
    assert told == ["14\n", "16\n"]
