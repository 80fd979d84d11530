"""The one `njit` of the package: disk cache keyed by the kernels' sources, IEEE arithmetic, no GIL."""
from ._cache import cache_folder, kernel_folder

cache_folder()  # before numba is imported anywhere

import gc  # noqa: E402
import types  # noqa: E402

import numba  # noqa: E402

from ._apart import refuse_python, set_apart  # noqa: E402
from ._pipeline import Linked, Pipeline, Separate, for_this_numba  # noqa: E402

NOTHING, NUMBER, WHOLE, FLAG = numba.types.none, numba.types.float64, numba.types.int64, numba.types.boolean
PAIR, WHOLES = numba.types.UniTuple(NUMBER, 2), numba.types.UniTuple(WHOLE, 2)  # what functions `apart` return
OPTIONS = {"cache": True, "error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True,
           "_nrt": True}  # said of every function: left open, one that is compiled first for a `leaf` would take over its setting


def _compiled(function, pipeline=Pipeline, **options):
    """Decorate a function; its cache is placed in the folder of its module, a choice that numba makes here and now.

    A literal argument of a compiled caller is a number like any other: numba would compile once more for each literal.
    """
    whole = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(kernel_folder(function.__module__))
    try:
        made = numba.njit(pipeline_class=for_this_numba(pipeline), **(OPTIONS | options))(function)
    finally:
        numba.config.CACHE_DIR = whole
    template = made.get_call_template

    def get_call_template(args, keywords):
        return template([numba.types.unliteral(arg) for arg in args],
                        {name: numba.types.unliteral(arg) for name, arg in keywords.items()})

    compile_it = made.compile

    def compile_uncollected(signature):
        """Compile with the garbage collector off: it would go through all that the compiler makes, a tenth of the time."""
        on = gc.isenabled()
        gc.disable()
        try:
            return compile_it(signature)
        finally:
            if on:
                gc.enable()

    made.get_call_template, made.compile = get_call_template, compile_uncollected
    return made


def both(function):
    """Compile a function once, for callers in Python and compiled ones."""
    return _compiled(function)


def njit(function):
    """Compile a function for compiled callers, and once more for Python if Python calls it.

    What unpacks the arguments from Python costs as much to compile as a small function.  Compiled callers therefore get a
    twin without it.  Large functions with callers of both kinds are better off as `both`.
    """
    return _with_twin(function)


def inlined(function):
    """Write a function with one compiled caller into it: as a function of its own it would be compiled and optimised twice."""
    return _compiled(function, inline="always")


def leaf(function):
    """Compile a function that allocates no arrays and returns none, like `njit`: without counting references to arrays.

    Counting is atomic: in small functions that pass on parts of arrays it costs more than the arithmetic (60 % of a harmonic
    balance).  Callers hold what they pass.  A leaf must not call functions that return arrays.
    """
    return _with_twin(function, _nrt=False)


def separate(function):
    """Compile a function like `njit`, for callers that never pass it two arrays of which it writes one and reads it as the other.

    Loops over a few numbers, as the nodes of a step, become vector instructions only so.
    """
    return _with_twin(function, Separate)


def separate_leaf(function):
    """Compile a function that is both a `leaf` and `separate`."""
    return _with_twin(function, Separate, _nrt=False)


def apart(returns, python=False, counted=True):
    """Compile a function by itself, when it is called for the first time; see `bifurc._apart`.

    For functions that are large, that several others call, or that rare events call: a call costs what any call costs that is
    not inlined.

    Parameters
    ----------
    returns : numba type
        What it returns: no array.
    python : bool
        Whether Python calls it, too; if not, such a call is a TypeError.
    counted : bool
        Whether references to arrays are counted; False only for what may be a `leaf`.
    """
    return lambda function: _set_apart(function, returns, python, **({} if counted else {"_nrt": False}))


def fused(function):
    """Compile loops over rows of numbers `apart`, with products and sums fused: not where the last digit counts."""
    return _set_apart(function, NOTHING, False, fastmath={"contract"})


def _set_apart(function, returns, python, **options):
    made = _compiled(function, no_cpython_wrapper=not python, **options)
    set_apart(made, returns)
    if not python:
        refuse_python(made)
    return made


def _with_twin(function, pipeline=Linked, **options):
    """Compile a function for Python, and a twin for compiled callers by a pipeline with further options."""
    twin = types.FunctionType(function.__code__, function.__globals__, function.__name__, function.__defaults__,
                              function.__closure__)
    twin.__module__, twin.__qualname__ = function.__module__, function.__qualname__ + "_called"
    outer, inner = both(function), _compiled(twin, pipeline, no_cpython_wrapper=True, **options)
    outer.get_call_template, outer.get_overload = inner.get_call_template, inner.get_overload  # what compiled callers ask
    return outer
