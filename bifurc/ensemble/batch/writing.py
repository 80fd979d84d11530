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

SIZE = 512  # side by side: their rows fill most of a first-level cache
DRIVER, CERTIFIED, DEFERRED, BLANK = (f"bifurc.ensemble.batch.{name}" for name in ("driver", "certified", "deferred", "blank"))


@cache
def written(step: str, states: int, spaces: tuple[int, ...], behind: str = "", forcings: int = 0, laws: bool = False):
    """Return the module around a batch step, imported; its kernels are cached on disk like those of the package.

    Parameters
    ----------
    step : str
        Source of ``period_step``, and of what it calls.
    states, forcings : int
        States of a start, and forcing states.
    spaces : tuple of int
        Scratch of the step, see `bifurc.ensemble.batch.blank`.
    behind : str
        Full name of a template that the step calls.
    laws : bool
        Whether what is deferred moves under laws.
    """
    templates = (behind, DRIVER) if behind else (DRIVER,)
    head = (f"SIZE = {SIZE}\nNS, NX = {states}, {states + forcings}\n"
            f"FLOATS, FLOATS_A_MODE, WHOLES_USED, WHOLES_A_MODE = {spaces}\n")
    text = "\n\n".join(["\n".join((f'"""Batch of one kind of scene, written by {__name__}."""', *_imports(*templates))), head,
                        *map(_body, templates[:-1]), step, _body(DRIVER)])
    if laws:
        text = text.replace(f"from {DEFERRED} import", f"from {twin(DEFERRED, LAWS).__name__} import")
    whole = "\n".join((numba.__version__, sys.version, closure_hash(DEFERRED, *templates), text))
    key = hashlib.sha256(whole.encode()).hexdigest()[:20]
    name = f"bifurc_written_batch_{key}"
    return load(name, pathlib.Path(cache_folder()) / "written" / f"batch_{key}.py", text)


def _body(name: str) -> str:
    """Return the source of a template without its docstring and imports."""
    template = source(name)
    last = list(re.finditer(r"^(?:from|import) .*\n", template, re.MULTILINE))[-1]
    return template[last.end():].strip() + "\n"


def _imports(*names: str) -> list[str]:
    """Return the imports of templates, but those of what is written in their place, with full names."""
    found: dict[str, None] = {}
    for name in names:
        for line in re.findall(r"^(?:from|import) .*$", source(name), re.MULTILINE):
            match = re.match(r"from (\.+\S*) (.*)", line)
            if match:
                line = f"from {importlib.util.resolve_name(match[1], name.rpartition('.')[0])} {match[2]}"
            if not line.startswith(f"from {BLANK} "):
                found[line] = None
    return list(found)
