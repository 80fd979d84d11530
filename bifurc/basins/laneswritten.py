"""The written module of a kind of lanes: templates of the package around the lap of that kind, kept in the kernel cache."""
import hashlib
import pathlib
import re
import sys
from functools import cache

from ..compose.written import load, source

LANES = 512  # side by side: their rows fill most of a first-level cache
MARCH, PERIOD = "bifurc.basins.lanesmarch", "bifurc.basins.lanesperiod"


@cache
def written(lap: str, guards: int, forcings: int, certified: bool, spaces: tuple[int, ...] = (0, 0, 0, 0)):
    """Return the module around a lap, imported; its kernels are cached on disk like those of the package.

    Parameters
    ----------
    lap : str
        Source of ``lap``, and of what it calls.
    guards, forcings : int
        Literal numbers of `bifurc.basins.lanesperiod`.
    certified : bool
        Whether lanes that are set aside are taken again by `bifurc.basins.lanesperiod`; if not, they are lost.
    spaces : tuple of int
        Scratch of the lap, see `bifurc.basins.lanesblank`.
    """
    import numba

    from .._cache import cache_folder, closure_hash

    parts = [f"LANES = {LANES}\nGUARDS = {guards}\nFORCINGS = {forcings}\n"
             f"FLOATS, FLOATS_A_MODE, WHOLES_USED, WHOLES_A_MODE = {spaces}\n", _body(PERIOD) if certified else _NO_PERIOD, lap,
             _body(MARCH)]
    text = "\n\n".join(["\n".join((f'"""Lanes of one kind of scene, written by {__name__}."""', *_imports(PERIOD, MARCH))),
                        *parts])
    whole = "\n".join((numba.__version__, sys.version, closure_hash(MARCH, PERIOD), text))
    key = hashlib.sha256(whole.encode()).hexdigest()[:20]
    name = f"bifurc_written_lanes_{key}"
    return load(name, pathlib.Path(cache_folder()) / "written" / f"lanes_{key}.py", text)


_NO_PERIOD = '''ASIDE, EVENTS, HITS, LEAST = 100, 0, 1, 2


@njit
def scratch():
    """Return arrays in the places of those of the certified march."""
    none = np.zeros(3)
    return np.zeros(2), none, none, none, none, none, none


@njit
def period(P, I, harmonics, phases, forced, m, y, a, out, stack, force, due, tally, limit):
    """Give a lane up: there is nothing behind the lap."""
    return LOST, m
'''


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
            full = re.sub(r"^from \.\.(\S+)", r"from bifurc.\1", line)
            full = re.sub(r"^from \.(\S+)", rf"from {name.rpartition('.')[0]}.\1", full)
            if ".lanesblank " not in full and f"{PERIOD} " not in full:
                found[full] = None
    return list(found)
