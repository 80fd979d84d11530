"""The text of a batch step, from words and records, and the module written around it, kept in the kernel cache."""
import pathlib
import re
from functools import cache

import numpy as np

from ..._cache import cache_folder
from ...compose.writer import LAWS, redirected, text_key, twin
from ...compose.written import load

ORDER = 11  # of the polynomials in time on a substep
MANY = ORDER + 1
DRIVER, STEP, SCALAR = "bifurc.ensemble.batch.driver", "bifurc.ensemble.batch.step", "bifurc.ensemble.scalar"
HEAD = f"import numpy as np\n\nfrom bifurc._jit import fused, leaf, njit\nfrom {SCALAR} import DONE, substep\n\n"
_WORD = re.compile(r"^([A-Z0-9_]+):\n(.*?)(?=^[A-Z0-9_]+:$|\Z)", re.MULTILINE | re.DOTALL)
_SUM = re.compile(r"SUM\[ (.*?)(?: ; (.*?))? \]")
Records = tuple[np.dtype, np.dtype]  # what a step reads of a mode, and of a mode on a substep of the forcing


@cache
def written(step: str, laws: bool = False):
    """Return the driver's module around the text of a batch step, imported; under ``laws`` what it defers moves by them."""
    scalar = twin(SCALAR, LAWS).__name__ if laws else SCALAR
    step = step.replace(SCALAR, scalar)
    key, folder = text_key(DRIVER, step), pathlib.Path(cache_folder()) / "written"
    own, sources = f"bifurc_batch_step_{key}", {STEP: f"bifurc_batch_step_{key}", SCALAR: scalar}
    load(own, folder / f"batch_step_{key}.py", step)
    around = redirected(DRIVER, lambda source, imported: sources.get(source, source))
    return load(f"bifurc_batch_{key}", folder / f"batch_{key}.py", around)


def filled(text: str, words: str, read: Records, n: int, numbers: dict[str, float], head: str = "") -> str:
    """Return the source: names of ``numbers``, ``head``, then ``text`` for ``n`` masses, which reads the records ``read``.

    A line with {k} is written for every state, with {i} and {n+i} for every coordinate and its velocity, with {j} for every power
    of a polynomial.  SUM[ term ; last ] is a sum over states {c}, or coordinates {p} and velocities {n+p}, added from its end.
    LOAD names the numbers of parts of a record, see `loaded`; HORNER stands for the lines of `horner`; a word in capitals for the
    lines below it in ``words``, where the last one of that name counts.
    """
    lines = {name: inside.splitlines() for name, inside in _WORD.findall(words)}

    def at(line: str, index: str, v: int) -> str:
        return line.replace(f"{{{index}}}", str(v)).replace(f"{{n+{index}}}", str(n + v))

    def summed(found: re.Match) -> str:
        index, many = ("c", 2 * n) if "{c}" in found[1] else ("p", n)
        return dot([at(found[1], index, v) for v in range(many)], found[2])

    def spelled(line: str) -> list[str]:
        for index, many in (("k", 2 * n), ("i", n), ("j", MANY)):
            if f"{{{index}}}" in line or f"{{n+{index}}}" in line:
                return [made for v in range(many) for made in spelled(at(line, index, v))]
        word, *rest = line.split() or [""]
        inside = loaded(read, *rest) if word == "LOAD" else horner(*rest) if word == "HORNER" else lines.get(line.strip())
        if inside is None:
            return [_SUM.sub(summed, line)]
        indent = line[:len(line) - len(line.lstrip())]
        return [made for inner in inside for made in spelled(indent + inner)]

    named = (f"AT_{name} = {value!r}" for name, value in numbers.items())
    return "\n".join([HEAD, *named, "\n", head, *(made for line in text.split("\n") for made in spelled(line))])


def loaded(read: Records, owner: str, *parts: str) -> list[str]:
    """Return lines that name the numbers of parts of a record by owner, part and index: guard_value_0 = guard.value[0].

    ``owner`` is mode, forcing, which is a mode on a substep, or a guard of either: guard, forced.
    """
    record = read[owner.startswith("forc")]
    record = record["guards"].base if owner in ("guard", "forced") else record
    return [f"{'_'.join((owner, part, *map(str, index)))} = {owner}.{part}{list(index) or ''}"
            for part in parts for index in np.ndindex(record[part].shape)]


def dot(terms: list[str], last: str | None = None) -> str:
    """Return the text of a sum, added from its end."""
    *terms, text = terms if last is None else [*terms, last]
    for term in reversed(terms):
        text = f"{term} + ({text})"
    return text


def horner(name: str, at: str, value: str, slope: str = "", bend: str = "") -> list[str]:
    """Lines for the value of a polynomial, and for slope and half the second derivative if they have names."""
    lines = [f"{made} = {name}_{ORDER}" for made in (value, slope, bend) if made]
    for j in range(ORDER - 1, 0, -1):
        lines.append(f"{value} = {value} * {at} + {name}_{j}")
        if slope:
            lines.append(f"{slope} = {slope} * {at} + {value}")
        if bend and j > 1:
            lines.append(f"{bend} = {bend} * {at} + {slope}")
    return [*lines, f"{value} = {value} * {at} + {name}_0"]
