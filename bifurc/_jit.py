"""The one `njit` of the package: disk cache keyed by the package's source, IEEE arithmetic, no GIL.

numba decides whether a cached kernel is stale from the caller's own file alone, so that an edited callee is silently
replayed in its old form.  The cache folder is therefore named by a hash of all sources of the package; it is chosen
here, before numba is imported anywhere, unless the user has set ``NUMBA_CACHE_DIR``.
"""
import hashlib
import os
import pathlib
import tempfile

_PACKAGE = pathlib.Path(__file__).resolve().parent


def source_hash() -> str:
    """Return 16 hexadecimal digits that change with any Python file of the package."""
    digest = hashlib.sha256()
    for path in sorted(_PACKAGE.rglob("*.py")):
        digest.update(path.relative_to(_PACKAGE).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cache_folder() -> pathlib.Path:
    """Return the folder that holds compiled kernels and written modules; created when missing."""
    if "NUMBA_CACHE_DIR" not in os.environ:
        root = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
        folder = pathlib.Path(root) / "bifurc" / source_hash()
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:  # a read-only home: kernels are then cached for this machine's temporary folder
            folder = pathlib.Path(tempfile.gettempdir()) / f"bifurc-{os.getuid()}" / source_hash()
            folder.mkdir(parents=True, exist_ok=True)
        os.environ["NUMBA_CACHE_DIR"] = str(folder)
    folder = pathlib.Path(os.environ["NUMBA_CACHE_DIR"])
    folder.mkdir(parents=True, exist_ok=True)
    return folder


cache_folder()

import numba  # noqa: E402  (after the cache folder is chosen)

njit = numba.njit(cache=True, error_model="numpy", nogil=True)
