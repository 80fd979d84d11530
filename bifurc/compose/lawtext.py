"""The text of a user's function, made to stand alone in a written module.

The text is taken from the syntax tree of the file or notebook cell and checked against the code that runs, so that a
file edited after its import cannot slip in.  Numbers, modules and functions that the law uses from around it go along.
"""
import ast
import builtins
import inspect
import math
import types

import numpy as np


class LawError(ValueError):
    """A law that cannot be written into a compiled module; the message says why."""


def standalone(function, name: str) -> str:
    """Return statements that define ``name`` as ``function`` does, with everything it needs, undecorated.

    Raises
    ------
    LawError
        When the source cannot be found, is not what runs, or uses something that cannot be written.
    """
    parts: dict[str, str] = {}
    _define(getattr(function, "py_func", function), name, parts, {})
    return "\n\n".join(parts.values()) + "\n"


def _define(function, name, parts, known) -> None:
    """Add the definition of ``function`` under ``name`` to ``parts``, what it needs before it."""
    if not isinstance(function, types.FunctionType):
        raise LawError(f"law {function!r} is not a Python function")
    node = _tree(function)
    known[function] = name
    renamed = {}
    around = inspect.getclosurevars(function)
    values = {**around.globals, **around.nonlocals}
    if around.unbound - set(dir(builtins)) - {n.attr for n in ast.walk(node) if isinstance(n, ast.Attribute)}:
        raise LawError(f"law {function.__name__}: the names {sorted(around.unbound)} are not defined around it")
    for inner, value in values.items():
        value = getattr(value, "py_func", value)
        own = f"{name}_{inner}"
        if isinstance(value, types.ModuleType):
            parts[own] = f"import {value.__name__} as {own}"
        elif isinstance(value, (bool, np.bool_)):
            parts[own] = f"{own} = {bool(value)}"
        elif isinstance(value, (int, np.integer)):
            parts[own] = f"{own} = {int(value)}"
        elif isinstance(value, (float, np.floating)):
            parts[own] = f"{own} = {float(value)!r}" if math.isfinite(value) else f"{own} = float({str(float(value))!r})"
        elif isinstance(value, (types.BuiltinFunctionType, np.ufunc)):
            module = getattr(value, "__module__", None) or "numpy"
            parts[own] = f"from {module} import {value.__name__} as {own}"
        elif isinstance(value, types.FunctionType):
            if value in known:
                own = known[value]
            else:
                _define(value, own, parts, known)
        else:
            raise LawError(f"law {function.__name__}: {inner} = {value!r} is not allowed; a law may use numbers, modules "
                           "and functions from around it, and takes everything else as parameters")
        renamed[inner] = own
    arguments = ast.parse(f"lambda {', '.join(a.arg for a in node.args.args)}: 0", mode="eval")
    if isinstance(node, ast.Lambda):
        body = [ast.Return(node.body)]
    else:
        body = [s for s in node.body if not (isinstance(s, ast.Expr) and isinstance(s.value, ast.Constant))]
    assert isinstance(arguments.body, ast.Lambda)
    written = ast.FunctionDef(name, arguments.body.args, [_Rename(renamed).visit(s) for s in body], [], None)
    written.type_params = []  # type: ignore[attr-defined]  # Python 3.12 asks for them
    parts[name] = "@njit\n" + ast.unparse(ast.fix_missing_locations(written))


class _Rename(ast.NodeTransformer):
    def __init__(self, names):
        self.names = names

    def visit_Name(self, node):
        return ast.Name(self.names.get(node.id, node.id), node.ctx)


def _tree(function):
    """Return the syntax tree of a function or lambda: the one that compiles to the code which runs."""
    code = function.__code__
    try:
        lines, _ = inspect.findsource(function)
        tree = ast.parse("".join(lines))
    except (OSError, TypeError, SyntaxError):
        raise LawError(f"law {function.__name__}: its source text cannot be found; define it in a file or a notebook cell, "
                       "not on a command line or by exec") from None
    if code.co_flags & (inspect.CO_VARARGS | inspect.CO_VARKEYWORDS) or code.co_kwonlyargcount:
        raise LawError(f"law {function.__name__}: only plain arguments are allowed")
    whole = compile(tree, code.co_filename, "exec", dont_inherit=True)
    if any(_same(other, code) for other in _all(whole)):
        spots = [(line, column) for line, _, column, _ in code.co_positions() if line and column]
        low, high = min(spots, default=(0, 0)), max(spots, default=(0, 0))
        found = [node for node in ast.walk(tree) if _is(node, code)]
        inside = [node for node in found if (node.lineno, node.col_offset) <= low
                  and high <= (node.end_lineno, node.end_col_offset)]
        for node in (inside or found)[-1:]:
            return node
    raise LawError(f"law {function.__name__}: the source in {code.co_filename} is no longer the one that runs; "
                   "reload it and make the system again")


def _is(node, code) -> bool:
    """Return whether a node may be the definition of a code object."""
    if isinstance(node, ast.Lambda):
        return code.co_name == "<lambda>" and node.lineno == code.co_firstlineno
    return isinstance(node, ast.FunctionDef) and node.name == code.co_name and code.co_firstlineno in (
        node.lineno, *(decorator.lineno for decorator in node.decorator_list))


def _all(code):
    """Yield all code objects in one."""
    yield code
    for inner in _codes(code):
        yield from _all(inner)


def _codes(code):
    return [c for c in code.co_consts if isinstance(c, types.CodeType)]


def _same(one, other) -> bool:
    """Return whether two code objects are compiled from the same text at the same place."""
    names = ("co_name", "co_firstlineno", "co_code", "co_names", "co_varnames", "co_freevars")
    if any(getattr(one, name) != getattr(other, name) for name in names):
        return False
    a, b = ([(type(c), c) for c in code.co_consts if not isinstance(c, types.CodeType)] for code in (one, other))
    return repr(a) == repr(b) and list(one.co_positions()) == list(other.co_positions())
