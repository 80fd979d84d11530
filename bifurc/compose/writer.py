"""Kernels of a scene under laws that are not affine: the package's own text, written again around the laws.

A written module is a template of this package (`bifurc.flow.smooth`, or any module of kernels that builds on
`bifurc.flow.affine`) with three kinds of lines changed: the law functions come from a module with the text of the laws,
every name of the engine (`ENGINE` of `bifurc.flow.smooth`) comes from the engine written around them, and imports of
modules that are themselves written again lead there.  Files are named by a hash of everything in them and of numba's
version, appear by renaming, and are ordinary modules with ordinary ``@njit(cache=True)``: a later process loads them.
"""
import ast
import hashlib
import importlib
import importlib.util
import pathlib
import sys

from . import written
from .lawtext import LawError, standalone

ENGINE_MODULES = ("bifurc.flow.smooth", "bifurc.flow.smoothguards")  # their `ENGINE` names replace those of templates
FACADE_MODULE = "bifurc.flow.smoothguards"  # has every name of the affine engine
LAW_MODULE = "bifurc.flow.nolaw"  # what the templates import; its written twin takes its place
AFFINE_MODULE = "bifurc.flow.affine"

_loaded: dict[tuple, object] = {}


def kernels(laws, dofs: int, template: str = AFFINE_MODULE):
    """Return the module of kernels ``template`` for scenes with these laws.

    Parameters
    ----------
    laws : sequence of SceneLaw
        ``scene.laws``; without any, the template itself is returned.
    dofs : int
        Degrees of freedom, literal in the written text.
    template : str
        Full name of a module of kernels, such as "bifurc.orbits.sequence".  The affine engine's name gives the engine.

    Raises
    ------
    LawError
        When a law cannot be written or compiled.
    """
    if not laws:
        return importlib.import_module(template)
    identity = (dofs, *((law.law.function, law.law.jacobian, law.rows, len(law.law.values)) for law in laws))
    found = _loaded.get((identity, template))
    if found is None:
        text = law_text(laws, dofs)
        writer = _Writer(text)
        found = _loaded[identity, template] = writer.module(FACADE_MODULE if template == AFFINE_MODULE else template)
    return found


def differenced(laws) -> tuple[str, ...]:
    """Return the names of the laws without a Jacobian of their own: their derivatives are differenced."""
    return tuple(law.name for law in laws if law.law.jacobian is None)


def law_text(laws, dofs: int) -> str:
    """Return the text of the law module: the laws, their derivatives, and loops over the nodes."""
    first: list[int] = []
    count: list[int] = []
    value = 0
    defined, force, slope = [], [], []
    for i, law in enumerate(laws):
        _check(law)
        rows, row = law.rows, len(first)
        first += [row] * rows
        count += [rows] * rows
        names = [f"p{k}" for k in range(len(law.law.values))]
        load = "".join(f"        {name} = law[{value + k}]\n" for k, name in enumerate(names))
        value += len(names)
        local = [f"local[{part}, {row + k}, j]" for part in (0, 1) for k in range(rows)]
        out = [f"local[2, {row + k}, j]" for k in range(rows)]
        places = [[f"slope[{part}, {row + a}, {b}, j]" for part in (0, 1) for b in range(rows)] for a in range(rows)]
        defined.append(standalone(law.law.function, f"law_{i}"))
        force.append(_branch(i, load, "nodes", out, _call(f"law_{i}", out, local, names)))
        if law.law.jacobian is not None:
            defined.append(standalone(law.law.jacobian, f"slope_{i}"))
            body = _call(f"slope_{i}", sum(places, []), local, names)
        else:
            body = _differences(i, row, rows, places, local, names)
        slope.append(_branch(i, load, "nodes", sum(places, []), body))
    steps = "    step = steps(local, nodes, h)\n" if differenced(laws) else ""
    return "\n".join([
        '"""Laws of one scene, written by bifurc.compose.writer."""', "import numpy as np\n", "from bifurc._jit import njit\n",
        'NAME = "bifurc_step_@"  # of the step as a symbol', f"DOFS = {dofs}", f"ROWS = {len(first)}",
        f"FIRST = np.array({first})", f"COUNT = np.array({count})", f"WIDTH = {max(count)}\n\n", "\n\n".join(defined), "",
        _STEPS if steps else "",
        "@njit", "def forces(law, acts, m, nodes, local):", *force, "",
        "@njit", "def slopes(law, acts, m, h, nodes, local, slope):", steps + "".join(slope), ""])


def _branch(number: int, load: str, nodes: str, places: list[str], body: str) -> str:
    """Loop over the nodes where the law acts; zeros where it does not."""
    zeros = "".join(f"            {place} = 0.0\n" for place in places)
    return (f"    if acts[m, {number}]:\n{load}        for j in range({nodes}):\n{body}"
            f"    else:\n        for j in range({nodes}):\n{zeros}")


def _call(function: str, places: list[str], local: list[str], names: list[str]) -> str:
    return f"            {', '.join(places)} = {function}({', '.join(local + names)})\n"


def _differences(number: int, row: int, rows: int, places, local, names) -> str:
    """Central differences of fourth order in every coordinate and speed of the law."""
    body = ""
    for b in range(2 * rows):
        step = f"step[{b // rows}, {row + b % rows}]"
        for k, shift in enumerate((-2.0, -1.0, 1.0, 2.0)):
            moved = [*local[:b], f"{local[b]} + {shift} * {step}", *local[b + 1:]]
            body += _call(f"law_{number}", [f"d{k}_{a}" for a in range(rows)], moved, names)
        for a in range(rows):
            body += f"            {places[a][b]} = (d0_{a} - d3_{a} + 8.0 * (d2_{a} - d1_{a})) / (12.0 * {step})\n"
    return body


_STEPS = '''
@njit
def steps(local, nodes, h):
    """Steps of the differences: a thousandth of the largest coordinate and speed met on the way."""
    out = np.empty((2, ROWS))
    for r in range(ROWS):
        size, speed = 0.0, 0.0
        for j in range(nodes):
            size = max(size, abs(local[0, r, j]))
            speed = max(speed, abs(local[1, r, j]))
        out[0, r] = 1e-3 * max(size + h * speed, 1e-12)
        out[1, r] = 1e-3 * max(speed + size / h, 1e-12)
    return out

'''


def _check(law) -> None:
    """Raise LawError when law or Jacobian, called at a few numbers, return what does not fit the rows."""
    rows, values = law.rows, law.law.values
    for what, function, size in (("law", law.law.function, rows), ("jacobian", law.law.jacobian, 2 * rows * rows)):
        if function is None:
            continue
        try:
            out = function(*(0.25 + 0.125 * k for k in range(2 * rows)), *values)
        except (ArithmeticError, ValueError):
            continue
        except TypeError as error:
            raise LawError(f"{what} of {law.name}: {error}") from None
        found = len(out) if isinstance(out, tuple) else 1
        if found != size or (size > 1) != isinstance(out, tuple):
            raise LawError(f"{what} of {law.name}: it returned {out!r}; a site of {rows} row(s) needs "
                           f"{'one number' if size == 1 else f'a tuple of {size} numbers'}")


class _Writer:
    """Writes and loads the modules of one set of laws."""

    def __init__(self, text: str):
        import numba

        from .._cache import cache_folder, closure_hash

        whole = "\n".join((numba.__version__, sys.version, closure_hash(__name__, *ENGINE_MODULES), text))
        self.key = hashlib.sha256(whole.encode()).hexdigest()[:20]
        self.folder = pathlib.Path(cache_folder()) / "written" / self.key
        self.text = text.replace("bifurc_step_@", f"bifurc_step_{self.key}")
        self.engine = {name: module for module in ENGINE_MODULES for name in importlib.import_module(module).ENGINE}
        self._again: dict[str, bool] = {}

    def module(self, name: str):
        """Return the written twin of a module of the package, imported."""
        from .._cache import closure_hash

        short = f"{name.removeprefix('bifurc.').replace('.', '_')}_{closure_hash(name)}"
        own = f"bifurc_written_{self.key}_{short}"
        if own in sys.modules:
            return sys.modules[own]
        return written.load(own, self.folder / f"{short}.py", self.text if name == LAW_MODULE else self._rewritten(name))

    def again(self, name: str) -> bool:
        """Return whether a module must be written again: it imports a name of the engine, or a module that must."""
        if name not in self._again:
            self._again[name] = False  # a circle would end here
            self._again[name] = name == LAW_MODULE or any(
                self.again(source) or not self.engine.keys().isdisjoint(alias.name for alias in node.names)
                for node, source in _imports(name))
        return self._again[name]

    def _rewritten(self, name: str) -> str:
        """Return the text of a module with imports redirected and the engine's own functions left out."""
        text = written.source(name)
        lines = text.splitlines()
        new: dict[int, str] = {}
        gone: set[int] = set()
        own = name in (*ENGINE_MODULES, LAW_MODULE)
        for node, source in _imports(name):
            place: dict[str, list[str]] = {}
            for alias in node.names:
                origin = source if own else self.engine.get(alias.name, source)
                place.setdefault(origin, []).append(ast.unparse(alias))
            gone |= _lines(node.lineno, node)
            new[node.lineno] = "\n".join(f"from {self._twin(origin)} import {', '.join(names)}"
                                         for origin, names in place.items())
        for node in ast.parse(text).body:
            if not own and isinstance(node, ast.FunctionDef) and node.name in self.engine:
                start = min([node.lineno, *(d.lineno for d in node.decorator_list)])
                gone |= _lines(start, node)
                new[start] = f"from {self._twin(self.engine[node.name])} import {node.name}"
        out = [new.get(i, "") if i in gone else line for i, line in enumerate(lines, 1)]
        return "\n".join(out) + "\n"

    def _twin(self, source: str) -> str:
        """Return the name under which a module is imported: its written twin, loaded here, or itself."""
        return self.module(source).__name__ if self.again(source) else source


def _lines(start: int, node: ast.stmt) -> set[int]:
    """Return the numbers of the lines from ``start`` to the end of a statement."""
    assert node.end_lineno is not None
    return set(range(start, node.end_lineno + 1))


def _imports(name: str):
    """Return top-level from-imports of a module that stay inside the package, with the full name of their source."""
    package = name.rpartition(".")[0]
    found = []
    for node in ast.parse(written.source(name)).body:
        if isinstance(node, ast.ImportFrom):
            source = importlib.util.resolve_name("." * node.level + (node.module or ""), package)
            if source == "bifurc" or source.startswith("bifurc."):
                found.append((node, source))
    return found
