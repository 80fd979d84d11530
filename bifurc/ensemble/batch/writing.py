"""The written module of a kind of scene: templates of the package around its batch step, kept in the kernel cache."""
import hashlib
import importlib.util
import pathlib
import re
import sys
from functools import cache

import numba

from ..._cache import cache_folder, closure_hash
from ...compose.writer import LAWS, twin
from ...compose.written import load, source

SIZE = 576  # side by side: rows fill most of a first-level cache, and are not whole pages apart, where stores hold up loads
DRIVER, SCALAR = "bifurc.ensemble.batch.driver", "bifurc.ensemble.scalar"
REST = "# what is the same for all kinds\n"  # of the driver: what stands before it is written for each kind


@cache
def written(step: str, states: int, spaces: tuple[int, ...], laws: bool = False):
    """Return the module around a batch step, imported; its kernels are cached on disk like those of the package.

    Parameters
    ----------
    step : str
        Source of ``period_step``, and of what it calls.
    states : int
        Of a start.
    spaces : tuple of int
        Scratch of the step, see `bifurc.ensemble.batch.driver`.
    laws : bool
        Whether what is deferred moves under laws.
    """
    head, _, rest = source(DRIVER).partition(REST)
    text = "\n\n".join([f'"""Batch of one kind of scene, written by {__name__}."""', _imports(head),
                        f"SIZE, NS = {SIZE}, {states}\nFLOATS, FLOATS_A_MODE, WHOLES_USED, WHOLES_A_MODE = {spaces}", step, rest])
    if laws:
        text = text.replace(f"from {SCALAR} import", f"from {twin(SCALAR, LAWS).__name__} import")
    whole = "\n".join((numba.__version__, sys.version, closure_hash(DRIVER), text))
    key = hashlib.sha256(whole.encode()).hexdigest()[:20]
    name = f"bifurc_written_batch_{key}"
    return load(name, pathlib.Path(cache_folder()) / "written" / f"batch_{key}.py", text)


def _imports(head: str) -> str:
    """Return the imports of the driver with full names."""
    package = DRIVER.rpartition(".")[0]
    return "\n".join(re.sub(r"^from (\.\S*)", lambda found: f"from {importlib.util.resolve_name(found[1], package)}", line)
                     for line in re.findall(r"^(?:from|import) .*$", head, re.MULTILINE))
