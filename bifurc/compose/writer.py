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
import itertools
import pathlib
import sys

import numba
import numpy as np

from .._cache import cache_folder, closure_hash
from . import curve, written
from .lawtext import LawError, standalone
from .pieces import FORCE, GUARD, KICK, REACTION, REST

ENGINE_MODULES = ("bifurc.flow.smooth", "bifurc.flow.smoothguards")  # their `ENGINE` names replace those of templates
FACADE_MODULE = "bifurc.flow.smoothguards"  # has every name of the affine engine
LAW_MODULE = "bifurc.flow.nolaw"  # what the templates import; its written twin takes its place
AFFINE_MODULE = "bifurc.flow.affine"
LEVELS, FALL = 5, 16.0  # of the steps of differences: how many, and by what factor they fall

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
    identity = (dofs, *((law.law.function, law.law.jacobian, law.rows, len(law.law.values), len(law.keys), law.stage, law.curved,
                         law.element) for law in laws))
    found = _loaded.get((identity, template))
    if found is None:
        text = law_text(laws, dofs)
        writer = _Writer(text)
        found = _loaded[identity, template] = writer.module(FACADE_MODULE if template == AFFINE_MODULE else template)
    return found


def differenced(laws) -> tuple[str, ...]:
    """Return the names of the laws without a Jacobian of their own: their derivatives are differenced."""
    return tuple(dict.fromkeys(law.name for law in laws if law.law.jacobian is None))


def difference_error(law, points) -> float:
    """Return an estimate of the relative error of the differenced derivatives of a law, from two successive steps.

    Parameters
    ----------
    law : SceneLaw
        One without a Jacobian.
    points : ndarray (N, 2 rows)
        Coordinates, then speeds, met along a motion.
    """
    points = np.asarray(points, float)
    unit = 1e-3 * np.maximum(np.abs(points).max(axis=0), 1e-12)
    worst = size = 0.0
    for point in points:
        for b in range(points.shape[1]):
            found = []
            for level in range(LEVELS):
                step = unit[b] * FALL**-level
                d = [np.atleast_1d(law.law.function(*(point + np.eye(point.size)[b] * shift * step), *law.law.values))
                     for shift in (-2.0, -1.0, 1.0, 2.0)]
                found.append((d[0] - d[3] + 8.0 * (d[2] - d[1])) / (12.0 * step))
            size = max(size, float(np.abs(found[-1]).max()))
            worst = max(worst, float(np.min([np.abs(p - q) for p, q in itertools.pairwise(found)], axis=0).max()))
    return worst / size if size > 0.0 else 0.0


def law_text(laws, dofs: int) -> str:
    """Return the text of the law module: the laws, their derivatives, and loops over the nodes."""
    first: list[int] = []
    count: list[int] = []
    source: list[int] = []
    seen: dict[int, int] = {}  # first row of every element: all its laws see the same coordinates
    value = 0
    defined: list[str] = []
    force: dict[int, list[str]] = {stage: [] for stage in (FORCE, REACTION, GUARD, KICK, REST)}
    slope: dict[int, list[str]] = {stage: [] for stage in force}
    turns: list[str] = []
    stepped = {stage: any(law.stage == stage and law.law.jacobian is None for law in laws) for stage in force}
    for i, law in enumerate(laws):
        _check(law)
        rows, row, parts = law.rows, len(first), (0, 1, 3) if law.reads else (0, 1)
        first += [row] * rows
        at = seen.setdefault(law.element, row)
        source += [at + k for k in range(rows)]
        count += [rows] * rows
        names = [f"p{k}" for k in range(len(law.law.values))]
        load = f"        at = {value} + (acts[m, {i}] - 1) * {len(names)}\n" + "".join(
            f"        {name} = {'0.0 if closes else ' if law.stage == KICK and k == 5 * law.curved else ''}law[at + {k}]\n"
            for k, name in enumerate(names))
        value += len(law.keys) * len(names)
        local = [f"local[{part}, {at + k}, j]" for part in parts for k in range(rows)]
        out = [f"local[2, {row + k}, j]" for k in range(law.outs)]
        none = [f"local[2, {row + k}, j]" for k in range(law.outs, rows)]
        places = [[f"slope[{part}, {row + a}, {b}, j]" for part in range(len(parts)) for b in range(rows)]
                  for a in range(law.outs)]
        known = sum(places, [])
        rest = [] if law.stage == FORCE else [
            place for part in range(3) for a in range(rows) for b in range(rows)
            if (place := f"slope[{part}, {row + a}, {b}, j]") not in known]
        defined += _definitions(law, i, names)
        own = f" and owner == {law.element}" if law.stage == KICK else ""
        force[law.stage].append(_branch(i, own, load, "nodes", out, _call(f"law_{i}", out, local, names), none))
        if law.stage > GUARD:
            force[GUARD].append("    for j in range(nodes):\n" + "".join(f"        {place} = 0.0\n" for place in out))
        if law.stage == REST:
            known = [f"slope[{part}, {row + a}, {b}, j]" for part in range(3) for a in range(rows) for b in range(rows)]
            turns.append(_branch(i, own, load, "nodes", known, _call("rest_slope", known, local, names)))
            known = [f"slope[{part}, {row + k}, 0, j]" for part in (0, 1) for k in range(rows)]
            rest = []
        if law.law.jacobian is not None:
            body = _call(f"slope_{i}", known, local, names)
        else:
            body = _differences(i, at, rows, places, local, names)
        slope[law.stage].append(_branch(i, own, load, "nodes", known, body, rest))
    acting = [sum(law.rows for law in laws if law.stage <= stage) for stage in (FORCE, REACTION, GUARD, KICK)]
    owner = [law.element for law in laws for _ in range(law.rows)]
    text = [
        '"""Laws of one scene, written by bifurc.compose.writer."""', "import numpy as np\n", "from bifurc._jit import njit",
        "from bifurc.compose.curve import polar, scalar_slope, vector_slope\n" if any(law.curved for law in laws) else "",
        "from bifurc.compose.curve import rest_slope\n" if turns else "",
        'NAME = "bifurc_step_@"  # of the step as a symbol', f"DOFS = {dofs}", f"ROWS = {len(first)}",
        f"FORCES = {acting[0]}", f"ACTING = {acting[1]}", f"KICKS = {acting[2]}", f"RESTS = {acting[3]}",
        f"OWNER = np.array({owner})", f"SOURCE = np.array({source})",
        f"FIRST = np.array({first})", f"COUNT = np.array({count})", f"WIDTH = {max(count)}\n\n", "\n\n".join(defined), "",
        _STEPS if any(stepped.values()) else ""]
    for stage, (one, many, owner_) in {FORCE: ("forces", "slopes", ""), REACTION: ("reactions", "reaction_slopes", ""),
                                       GUARD: ("watches", "watch_slopes", ""), KICK: ("kicks", "kick_slopes", "owner, closes, "),
                                       REST: ("rests", "rest_moves", "")}.items():
        text += ["@njit", f"def {one}(law, acts, m, nodes, {owner_}local):", "".join(force[stage]) or "    return", ""]
        steps = "    step = steps(local, nodes, h)\n" if stepped[stage] else ""
        text += ["@njit", f"def {many}(law, acts, m, h, nodes, {owner_}local, slope):",
                 steps + "".join(slope[stage]) or "    return", ""]
    text += ["@njit", "def rest_slopes(law, acts, m, nodes, local, slope):", "".join(turns) or "    return", ""]
    return "\n".join(text)


def _definitions(law, i: int, names: list[str]) -> list[str]:
    """Return the text of law number ``i`` and of its derivatives, in the coordinates of its rows."""
    functions = [("law", law.law.function)] + ([] if law.law.jacobian is None else [("slope", law.law.jacobian)])
    if not law.curved:
        return [_text(function, f"{what}_{i}") for what, function in functions]
    own = ", ".join(names[5:])
    arguments = f"x, y, vx, vy, {', '.join(names)}"
    local = "    nx, ny, r, sn, w = polar(x - p0, y - p1, vx, vy)\n    u, st = r - p2, w + p3 + p4 * r\n"
    call = f"(u, 0.0, sn, st, {own})"
    text = [_text(function, f"own_{what}_{i}") for what, function in functions]
    if law.outs == 1:
        text.append(f"@njit\ndef law_{i}({arguments}):\n{local}    return own_law_{i}{call}\n")
        back = f"    a, _, b, c = own_slope_{i}{call}\n    return scalar_slope(nx, ny, r, sn, w, a + p4 * c, b, c)\n"
    else:
        text.append(f"@njit\ndef law_{i}({arguments}):\n{local}    fn, ft = own_law_{i}{call}\n"
                    "    return nx * fn - ny * ft, ny * fn + nx * ft\n")
        back = (f"    fn, ft = own_law_{i}{call}\n    a, _, b, c, d, _, e, f = own_slope_{i}{call}\n"
                "    return vector_slope(nx, ny, r, sn, w, fn, ft, a + p4 * c, b, c, d + p4 * f, e, f)\n")
    if law.law.jacobian is not None:
        text.append(f"@njit\ndef slope_{i}({arguments}):\n{local}{back}")
    return text


def _text(function, name: str) -> str:
    """Return the text that defines ``name``: an import where the law is the package's own."""
    own = getattr(function, "py_func", function)
    if own.__module__ == curve.__name__:
        return f"from {curve.__name__} import {own.__name__} as {name}\n"
    return standalone(function, name)


def _branch(number: int, own: str, load: str, nodes: str, places: list[str], body: str, none=()) -> str:
    """Loop over the nodes where the law acts; zeros where it does not, and always in the places ``none``."""
    always = "".join(f"            {place} = 0.0\n" for place in none)
    zeros = "".join(f"            {place} = 0.0\n" for place in places)
    return (f"    if acts[m, {number}]{own}:\n{load}        for j in range({nodes}):\n{body}{always}"
            f"    else:\n        for j in range({nodes}):\n{zeros}{always}")


def _call(function: str, places: list[str], local: list[str], names: list[str]) -> str:
    return f"            {', '.join(places)} = {function}({', '.join(local + names)})\n"


def _differences(number: int, at: int, rows: int, places, local, names) -> str:
    """Central differences of fourth order in every coordinate and speed of the law.

    They are taken with steps that fall by a factor of 16; of each derivative the one that differs least from that of the
    step before is kept: a law that turns within a small width needs small steps, a smooth one has less rounding with large.
    """
    body, outs = "", range(len(places))
    for b in range(2 * rows):
        for level in range(LEVELS):
            step = f"({FALL**-level} * step[{b // rows}, {at + b % rows}])"
            for k, shift in enumerate((-2.0, -1.0, 1.0, 2.0)):
                moved = [*local[:b], f"{local[b]} + {shift} * {step}", *local[b + 1:]]
                out = ", ".join(f"d{k}_{a}" for a in outs)
                body += f"            {out} = law_{number}({', '.join(moved + names)})\n"
            for a in outs:
                body += f"            g{level}_{a} = (d0_{a} - d3_{a} + 8.0 * (d2_{a} - d1_{a})) / (12.0 * {step})\n"
        for a in outs:
            body += f"            best, {places[a][b]} = abs(g1_{a} - g0_{a}), g1_{a}\n"
            for level in range(2, LEVELS):
                body += (f"            if abs(g{level}_{a} - g{level - 1}_{a}) < best:\n"
                         f"                best, {places[a][b]} = abs(g{level}_{a} - g{level - 1}_{a}), g{level}_{a}\n")
    return body


_STEPS = '''
@njit
def steps(local, nodes, h):
    """Largest steps of the differences: a thousandth of the largest coordinate and speed met on the way."""
    out = np.empty((2, ROWS))
    for r in range(ROWS):
        size, speed = 0.0, 0.0
        if SOURCE[r] != r:
            continue
        for j in range(nodes):
            size = max(size, abs(local[0, r, j]))
            speed = max(speed, abs(local[1, r, j]))
        out[0, r] = 1e-3 * max(size + h * speed, 1e-12)
        out[1, r] = 1e-3 * max(speed + size / h, 1e-12)
    return out

'''


def _check(law) -> None:
    """Raise LawError when law or Jacobian, called at a few numbers, return what does not fit the rows."""
    values = law.law.values[5 if law.curved else 0:]
    seen = (3 if law.reads else 2) * law.rows
    for what, function, size in (("law", law.law.function, law.outs), ("jacobian", law.law.jacobian, law.outs * seen)):
        if function is None or function.__module__ == curve.__name__:
            continue
        try:
            out = function(*(0.25 + 0.125 * k for k in range(seen)), *values)
        except (ArithmeticError, ValueError):
            continue
        except TypeError as error:
            raise LawError(f"{what} of {law.name}: {error}") from None
        found = len(out) if isinstance(out, tuple) else 1
        if found != size or (size > 1) != isinstance(out, tuple):
            raise LawError(f"{what} of {law.name}: it returned {out!r}; a site of {law.rows} row(s) needs "
                           f"{'one number' if size == 1 else f'a tuple of {size} numbers'}")


class _Writer:
    """Writes and loads the modules of one set of laws."""

    def __init__(self, text: str):
        whole = "\n".join((numba.__version__, sys.version, closure_hash(__name__, *ENGINE_MODULES), text))
        self.key = hashlib.sha256(whole.encode()).hexdigest()[:20]
        self.folder = pathlib.Path(cache_folder()) / "written" / self.key
        self.text = text.replace("bifurc_step_@", f"bifurc_step_{self.key}")
        self.engine = {name: module for module in ENGINE_MODULES for name in importlib.import_module(module).ENGINE}
        self._again: dict[str, bool] = {}

    def module(self, name: str):
        """Return the written twin of a module of the package, imported."""
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
