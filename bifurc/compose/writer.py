"""Kernels of scenes that another engine moves: the package's own text, written again.

Two kinds of modules are written.  One for every set of laws: `bifurc.flow.laws.collocation` with the functions of these laws in
the place of `bifurc.flow.laws.nolaw`; it holds the two C functions that the tables of a scene point to.  And, once for an engine,
twins of the modules of kernels that build on `bifurc.flow.affine.engine`: in a twin every name of the engine comes from the
engine's own modules (their `ENGINE`), and what reaches such a name is defined again on it.  There are two engines beside the
affine one: of laws that are not affine, and of many degrees of freedom.
Files are named by a hash of everything in them and of numba's version, appear by renaming, and are ordinary modules with
ordinary ``@njit(cache=True)``: a later process loads them.

One file, because a written module is collected, written, hashed and loaded by one set of rules on names.
"""
import ast
import functools
import hashlib
import importlib
import importlib.util
import itertools
import logging
import pathlib
import re
import sys
import textwrap
import time
from collections.abc import Callable, Container
from typing import NamedTuple

import numba
import numpy as np

from .._cache import cache_folder, closure_hash
from . import curve, written
from .lawtext import LawError, standalone
from .pieces import FORCE, GUARD, KICK, REACTION, REST, SceneLaw, law_rows

AFFINE_MODULE = "bifurc.flow.affine.engine"
STEP_MODULE = "bifurc.flow.laws.collocation"  # the text written around laws
LAW_MODULE = "bifurc.flow.laws.nolaw"  # whose place they take in it
LEVELS, FALL = 5, 16.0  # of the steps of differences: how many, and by what factor they fall

_log = logging.getLogger("bifurc.compose")


class Engine(NamedTuple):
    """Functions that move a state in the place of those of `bifurc.flow.affine.engine`."""

    name: str
    modules: tuple[str, ...]  # their `ENGINE` names replace those of templates


LAWS = Engine("laws", ("bifurc.flow.laws.engine", "bifurc.flow.laws.guards", "bifurc.flow.laws.hidden"))
MODAL = Engine("modal", ("bifurc.flow.modal.engine",))
_compiled: dict[tuple, tuple[int, ...]] = {}


def kernels(scene, template: str = AFFINE_MODULE):
    """Return the module of kernels ``template`` for a scene; its laws are compiled when they are not yet.

    Parameters
    ----------
    scene : Scene
        Without laws and of few degrees of freedom the template itself is returned.
    template : str
        Full name of a module of kernels, such as "bifurc.orbits.shooting.sequence".  The affine engine's name gives the engine.

    Raises
    ------
    LawError
        When a law cannot be written or compiled.
    """
    if scene.laws:
        bind(scene)
        return twin(template, LAWS)
    return twin(template, MODAL) if scene.tables.V.size else _module(template)


_module = functools.cache(importlib.import_module)


def bind(scene) -> None:
    """Write the addresses of the C functions of a scene's laws into its tables, compiled here when they are not yet."""
    if scene.bound.any():
        return
    identity = (scene.n, *((law.law.function, law.law.jacobian, law.rows, len(law.law.values), law.stage, law.curved, law.element)
                           for law in scene.laws))
    found = _compiled.get(identity)
    if found is None:
        names, clock = ", ".join(dict.fromkeys(law.name for law in scene.laws)), time.perf_counter()
        _log.info("compiling the laws of %s, or loading them where this machine has seen them", names)
        found = _compiled[identity] = step_module(law_text(scene.laws, scene.n)).ADDRESSES
        _log.info("laws of %s ready after %.1f s", names, time.perf_counter() - clock)
    scene.bound[:] = found


def step_module(text: str):
    """Return the module of the step around laws with this text, written and compiled when it is not there yet."""
    key = law_key(text)
    laws, step = f"bifurc_laws_{key}", f"bifurc_step_{key}"
    folder = _folder() / key
    written.load(laws, folder / "laws.py", text)
    around = redirected(STEP_MODULE, lambda source, imported: laws if source == LAW_MODULE else source)
    return written.load(step, folder / "step.py", around)


def law_key(text: str) -> str:
    """Return what names the modules written around laws with this text: 20 hexadecimal digits."""
    return text_key(STEP_MODULE, __name__, text)


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


class Alike(NamedTuple):
    """Laws of one text, such as those of several equal stops; where there is more than one they are gone through in a loop."""

    number: int  # of the first one
    law: SceneLaw  # the first one
    places: list[tuple[int, int, int, int]]  # number, first row, row whose coordinates it sees, element of each

    def place(self, k: int) -> str:
        """Return the text of number ``k`` of a place: a literal where there is one law."""
        return str(self.places[0][k]) if len(self.places) == 1 else f"PLACES_{self.number}[k, {k}]"

    def looped(self, body: str) -> str:
        """Return the text of what is done for each of the laws; ``body`` is indented once."""
        if len(self.places) == 1:
            return body
        return f"    for k in range({len(self.places)}):\n{textwrap.indent(body, '    ')}"


def alike(laws) -> list[Alike]:
    """Return the laws of a scene with those of different elements together that have one text."""
    (_, _, source, _), _ = law_rows(laws)
    found: dict[tuple, Alike] = {}
    row = 0
    for i, law in enumerate(laws):
        own = (*law.group[1:], law.rows)
        found.setdefault(own, Alike(i, law, [])).places.append((i, row, int(source[row]), law.element))
        row += law.rows
    return list(found.values())


def law_text(laws, dofs: int) -> str:
    """Return the text of the law module: the laws, their derivatives, and loops over the nodes."""
    (first, count, source, _), stages = law_rows(laws)
    defined: list[str] = []
    force: dict[int, list[str]] = {stage: [] for stage in (FORCE, REACTION, GUARD, KICK, REST)}
    slope: dict[int, list[str]] = {stage: [] for stage in force}
    turns: list[str] = []
    stepped = {stage: any(law.stage == stage and law.law.jacobian is None for law in laws) for stage in force}
    for each in alike(laws):
        i, law = each.number, each.law
        _check(law)
        row, seen, rows, parts = each.place(1), each.place(2), law.rows, (0, 1, 3) if law.reads else (0, 1)
        names = [f"p{k}" for k in range(len(law.law.values))]
        load = f"        at = acts[m, {each.place(0)}] - 1\n" + "".join(
            f"        {name} = {'0.0 if closes else ' if law.stage == KICK and k == 5 * law.curved else ''}law[at + {k}]\n"
            for k, name in enumerate(names))
        local = [f"local[{part}, {seen} + {k}, j]" for part in parts for k in range(rows)]
        out = [f"local[2, {row} + {k}, j]" for k in range(law.outs)]
        none = [f"local[2, {row} + {k}, j]" for k in range(law.outs, rows)]
        places = [[f"slope[{part}, {row} + {a}, {b}, j]" for part in range(len(parts)) for b in range(rows)]
                  for a in range(law.outs)]
        known = sum(places, [])
        rest = [] if law.stage == FORCE else [
            place for part in range(3) for a in range(rows) for b in range(rows)
            if (place := f"slope[{part}, {row} + {a}, {b}, j]") not in known]
        defined += _definitions(law, i, names)
        acts = f"acts[m, {each.place(0)}]" + (f" and owner == {each.place(3)}" if law.stage == KICK else "")
        force[law.stage].append(each.looped(_branch(acts, load, "nodes", out, _call(f"law_{i}", out, local, names), none)))
        if law.stage > GUARD:
            force[GUARD].append(each.looped("    for j in range(nodes):\n" + "".join(f"        {place} = 0.0\n" for place in out)))
        if law.stage == REST:
            known = [f"slope[{part}, {row} + {a}, {b}, j]" for part in range(3) for a in range(rows) for b in range(rows)]
            turns.append(each.looped(_branch(acts, load, "nodes", known, _call("rest_slope", known, local, names))))
            known = [f"slope[{part}, {row} + {k}, 0, j]" for part in (0, 1) for k in range(rows)]
            rest = []
        if law.law.jacobian is not None:
            body = _call(f"slope_{i}", known, local, names)
        else:
            body = _differences(i, seen, rows, places, local, names)
        slope[law.stage].append(each.looped(_branch(acts, load, "nodes", known, body, rest)))
        if len(each.places) > 1:
            defined.append(f"PLACES_{i} = np.array({[list(place) for place in each.places]})\n")
    text = [
        '"""Laws of one scene, written by bifurc.compose.writer."""', "import numpy as np\n", "from bifurc._jit import njit",
        "from bifurc.compose.curve import polar, scalar_slope, vector_slope\n" if any(law.curved for law in laws) else "",
        "from bifurc.compose.curve import rest_slope\n" if turns else "",
        f"DOFS = {dofs}", f"ROWS = {len(source)}", f"FORCES = {stages[0]}", f"ACTING = {stages[1]}", f"WIDTH = {stages[4]}",
        f"SOURCE = np.array({source.tolist()})", f"FIRST = np.array({first.tolist()})",
        f"COUNT = np.array({count.tolist()})\n\n", "\n\n".join(defined), "",
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
                "    return vector_slope(nx, ny, r, sn, w, fn, ft, (a + p4 * c, b, c), (d + p4 * f, e, f))\n")
    if law.law.jacobian is not None:
        text.append(f"@njit\ndef slope_{i}({arguments}):\n{local}{back}")
    return text


def _text(function, name: str) -> str:
    """Return the text that defines ``name``: an import where the law is the package's own."""
    own = getattr(function, "py_func", function)
    if own.__module__ == curve.__name__:
        return f"from {curve.__name__} import {own.__name__} as {name}\n"
    return standalone(function, name)


def _branch(acts: str, load: str, nodes: str, places: list[str], body: str, none=()) -> str:
    """Loop over the nodes where the law acts; zeros where it does not, and always in the places ``none``."""
    always = "".join(f"            {place} = 0.0\n" for place in none)
    zeros = "".join(f"            {place} = 0.0\n" for place in places)
    return (f"    if {acts}:\n{load}        for j in range({nodes}):\n{body}{always}"
            f"    else:\n        for j in range({nodes}):\n{zeros}{always}")


def _call(function: str, places: list[str], local: list[str], names: list[str]) -> str:
    return f"            {', '.join(places)} = {function}({', '.join(local + names)})\n"


def _differences(number: int, at: str, rows: int, places, local, names) -> str:
    """Central differences of fourth order in every coordinate and speed of the law.

    They are taken with steps that fall by a factor of 16; of each derivative the one that differs least from that of the
    step before is kept: a law that turns within a small width needs small steps, a smooth one has less rounding with large.
    """
    body, outs = "", range(len(places))
    for b in range(2 * rows):
        body += f"            shift = step[{b // rows}, {at} + {b % rows}]\n"
        body += "".join(f"            last_{a}, best_{a} = 0.0, np.inf\n" for a in outs)
        body += f"            for level in range({LEVELS}):\n"
        for k, shift in enumerate((-2.0, -1.0, 1.0, 2.0)):
            moved = [*local[:b], f"{local[b]} + {shift} * shift", *local[b + 1:]]
            body += f"                {', '.join(f'd{k}_{a}' for a in outs)} = law_{number}({', '.join(moved + names)})\n"
        for a in outs:
            body += (f"                g = (d0_{a} - d3_{a} + 8.0 * (d2_{a} - d1_{a})) / (12.0 * shift)\n"
                     f"                if level == 1 or level > 1 and abs(g - last_{a}) < best_{a}:\n"
                     f"                    best_{a}, {places[a][b]} = abs(g - last_{a}), g\n"
                     f"                last_{a} = g\n")
        body += f"                shift /= {FALL}\n"
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


@functools.cache
def twin(name: str, engine: Engine):
    """Return the twin of a module of kernels on an engine; the module itself where it builds on no name of the engine."""
    changed = _changed(name, engine)
    if not changed:
        return importlib.import_module(name)
    names = _names(engine)
    own = f"bifurc_{engine.name}_{name.removeprefix('bifurc.').replace('.', '_')}_{text_key(name, __name__, *engine.modules)}"

    def place(source: str, imported: str) -> str:
        if imported in names:
            return names[imported]
        return twin(source, engine).__name__ if imported in _changed(source, engine) else source

    kept = {function.name for function in _functions(name) if function.name in names or function.name not in changed}
    text = redirected(name, place, kept)
    # references are counted: functions of these engines make arrays, and what a leaf calls is compiled as it is
    text = re.sub(r"^(from bifurc\._jit import .*)\bleaf\b", r"\1njit as leaf", text, flags=re.MULTILINE)
    return written.load(own, _folder() / f"{own}.py", text)


@functools.cache
def _names(engine: Engine) -> dict[str, str]:
    """Return the module of every name of an engine."""
    return {name: module for module in engine.modules for name in importlib.import_module(module).ENGINE}


@functools.cache
def _changed(name: str, engine: Engine) -> frozenset[str]:
    """Return the names in a module that are others on an engine: its own, and the functions that reach one."""
    if name in engine.modules:
        return frozenset()
    names = _names(engine)
    changed = {alias.asname or alias.name for node, source in _imports(name) for alias in node.names
               if alias.name in names or alias.name in _changed(source, engine)}
    functions = {function.name: {node.id for node in ast.walk(function) if isinstance(node, ast.Name)}
                 for function in _functions(name)}
    changed |= names.keys() & functions.keys()
    while found := {function for function, used in functions.items() if function not in changed and not used.isdisjoint(changed)}:
        changed |= found
    return frozenset(changed)


def _functions(name: str) -> list[ast.FunctionDef]:
    """Return the functions that a module defines."""
    return [statement for statement in _tree(name).body if isinstance(statement, ast.FunctionDef)]


@functools.cache
def _tree(name: str) -> ast.Module:
    """Return the syntax tree of a module of the package."""
    return ast.parse(written.source(name))


def _folder() -> pathlib.Path:
    return pathlib.Path(cache_folder()) / "written"


def text_key(*parts: str) -> str:
    """Return 20 hexadecimal digits that change with the versions, the sources of the modules among the parts, and the text."""
    modules = [part for part in parts if part.startswith("bifurc.") and "\n" not in part]
    whole = "\n".join((numba.__version__, sys.version, closure_hash(*modules), *parts))
    return hashlib.sha256(whole.encode()).hexdigest()[:20]


def redirected(name: str, place: Callable[[str, str], str], left_out: Container[str] = ()) -> str:
    """Return the text of a module with imports redirected and some functions imported instead of defined.

    Parameters
    ----------
    name : str
    place : callable
        place(source, imported name) -> name of the module from which it comes in the new text.
    left_out : container of str
        Functions that are not defined but imported.
    """
    text = written.source(name)
    lines = text.splitlines()
    new: dict[int, str] = {}
    gone: set[int] = set()
    for node, source in _imports(name):
        found: dict[str, list[str]] = {}
        for alias in node.names:
            found.setdefault(place(source, alias.name), []).append(ast.unparse(alias))
        gone |= _lines(node.lineno, node)
        new[node.lineno] = "\n".join(f"from {origin} import {', '.join(names)}" for origin, names in found.items())
    for statement in _functions(name):
        if statement.name in left_out:
            start = min([statement.lineno, *(d.lineno for d in statement.decorator_list)])
            gone |= _lines(start, statement)
            new[start] = f"from {place(name, statement.name)} import {statement.name}"
    out = [new.get(i, "") if i in gone else line for i, line in enumerate(lines, 1)]
    return "\n".join(out) + "\n"


def _lines(start: int, node: ast.stmt) -> set[int]:
    """Return the numbers of the lines from ``start`` to the end of a statement."""
    assert node.end_lineno is not None
    return set(range(start, node.end_lineno + 1))


def _imports(name: str):
    """Return top-level from-imports of a module that stay inside the package, with the full name of their source."""
    package = name.rpartition(".")[0]
    found = []
    for node in _tree(name).body:
        if isinstance(node, ast.ImportFrom):
            source = importlib.util.resolve_name("." * node.level + (node.module or ""), package)
            if source == "bifurc" or source.startswith("bifurc."):
                found.append((node, source))
    return found
