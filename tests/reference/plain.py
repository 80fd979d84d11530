"""Compiled functions as the Python they are written in, with all that they call: nothing is compiled to test a few lines."""
import types


def plain(kernel, **instead):
    """Return a compiled function and all compiled ones that it calls as Python functions; ``instead``: those to take by name."""
    return _plain(kernel.py_func, instead, {})


def _plain(function, instead, made):
    if function in made:
        return made[function]
    names = dict(function.__globals__)
    copy = types.FunctionType(function.__code__, names, function.__name__, function.__defaults__, function.__closure__)
    made[function] = copy
    for name in function.__code__.co_names:
        if name in instead:
            names[name] = instead[name]
        elif hasattr(names.get(name), "py_func"):
            names[name] = _plain(names[name].py_func, instead, made)
    return copy
