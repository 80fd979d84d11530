"""Where compiled kernels and written modules are kept: a folder named by a hash of the sources they are made of.

numba decides whether a cached kernel is stale from the caller's own file alone, so that an edited callee is silently
replayed in its old form.  Every state of the kernels' sources therefore has a folder of its own.
"""
import hashlib
import os
import pathlib
import tempfile

_PACKAGE = pathlib.Path(__file__).resolve().parent
KERNELS = ("solve", "compose", "flow", "orbits", "basins")  # folders with compiled functions and the constants they freeze


def source_hash() -> str:
    """Return 16 hexadecimal digits that change with any source a kernel can depend on."""
    digest = hashlib.sha256()
    for path in sorted([_PACKAGE / "_jit.py", *(path for folder in KERNELS for path in (_PACKAGE / folder).rglob("*.py"))]):
        digest.update(path.relative_to(_PACKAGE).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cache_folder() -> pathlib.Path:
    """Return the folder, created when missing; ``NUMBA_CACHE_DIR`` is set to it unless the user has set it."""
    if "NUMBA_CACHE_DIR" not in os.environ:
        root = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
        folder = pathlib.Path(root) / "bifurc" / source_hash()
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:  # a read-only home: kernels are then cached in this machine's temporary folder
            folder = pathlib.Path(tempfile.gettempdir()) / f"bifurc-{os.getuid()}" / source_hash()
            folder.mkdir(parents=True, exist_ok=True)
        os.environ["NUMBA_CACHE_DIR"] = str(folder)
    folder = pathlib.Path(os.environ["NUMBA_CACHE_DIR"])
    folder.mkdir(parents=True, exist_ok=True)
    return folder
