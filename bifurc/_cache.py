"""Where compiled kernels and written modules are kept: folders named by hashes of the sources they are made of.

numba decides whether a cached kernel is stale from the file of its own function alone, so that an edited callee is
silently replayed in its old form.  The kernels of a module are therefore kept in a folder named by the sources of that
module and of everything it imports from the package: an edit leaves all kernels valid that cannot see it.
"""
import ast
import functools
import hashlib
import importlib.util
import os
import pathlib
import re
import tempfile

_IMPORT = re.compile(rb"^[ \t]*((?:from[ \t]+[\w.]+[ \t]+)?import[ \t]+(?:\([^)]*\)|[\w., \t*]+))", re.MULTILINE)
_PACKAGE = pathlib.Path(__file__).resolve().parent
# folders with compiled functions and constants they freeze
KERNELS = ("solve", "compose", "flow", "hbm", "orbits", "ensemble", "basins")
LONE = {"bifurc._jit": "bifurc._jit", "bifurc._apart": "bifurc._apart", "bifurc._pipeline": "bifurc._pipeline",
        "bifurc.elements": "bifurc.elements.kinds"}  # and what an import of others can bring


@functools.cache
def source_hash() -> str:
    """Return 16 hexadecimal digits that change with any source a kernel can depend on."""
    files = [path for folder in KERNELS for path in (_PACKAGE / folder).rglob("*.py")]
    return _digest([*files, *filter(None, map(_path, LONE))])


@functools.cache
def closure_hash(*modules: str) -> str:
    """Return 16 hexadecimal digits that change with the source of the modules or of any that they import.

    Parameters
    ----------
    *modules : str
        Full names, such as "bifurc.flow.scan".  Imports inside functions count.
    """
    seen: dict[str, pathlib.Path] = {}
    open_ = list(modules)
    while open_:
        name = open_.pop()
        path = _path(name)
        if name not in seen and path is not None:
            seen[name] = path
            open_ += _imported(name, path)
    return _digest(seen.values())


def _digest(paths) -> str:
    digest = hashlib.sha256()
    for path in sorted(paths):
        digest.update(path.relative_to(_PACKAGE).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _path(name: str) -> pathlib.Path | None:
    """Return the file of a module that kernels can depend on, or None."""
    name = LONE.get(name, name)
    parts = name.split(".")
    if name not in LONE.values() and (parts[0] != "bifurc" or len(parts) < 2 or parts[1] not in KERNELS):
        return None
    path = _PACKAGE.joinpath(*parts[1:])
    return next((file for file in (path.with_suffix(".py"), path / "__init__.py") if file.exists()), None)


@functools.cache
def _imported(name: str, path: pathlib.Path) -> list[str]:
    """Return the full names that a module imports from: modules, and names in packages that may be modules.

    Statements are found by their form, a tenth of the time that parsing takes; imports in texts that are compiled later count.
    """
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    found = []
    for node in (node for match in _IMPORT.finditer(path.read_bytes()) for node in ast.parse(match[1]).body):
        if isinstance(node, ast.ImportFrom):
            source = importlib.util.resolve_name("." * node.level + (node.module or ""), package)
            inner = [f"{source}.{alias.name}" for alias in node.names]
            inside = [module for module in inner if _path(module) is not None]
            found += inside if len(inside) == len(inner) else [source, *inside]
        elif isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
    return found


def cache_folder() -> pathlib.Path:
    """Return the folder of all kernels, created when missing; ``NUMBA_CACHE_DIR`` is set to it unless the user has set it."""
    if "NUMBA_CACHE_DIR" not in os.environ:
        root = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
        folder = pathlib.Path(root) / "bifurc"
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:  # a read-only home: kernels are then cached in this machine's temporary folder
            folder = pathlib.Path(tempfile.gettempdir()) / f"bifurc-{os.getuid()}"
            folder.mkdir(parents=True, exist_ok=True)
        os.environ["NUMBA_CACHE_DIR"] = str(folder)
    folder = pathlib.Path(os.environ["NUMBA_CACHE_DIR"])
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def kernel_folder(module: str) -> pathlib.Path:
    """Return the folder of the kernels of one module.

    A module from elsewhere (a study, a written law) may call any kernel of the package: its own is stale when any of them changes.
    """
    return cache_folder() / (closure_hash(module) if _path(module) is not None else source_hash())
