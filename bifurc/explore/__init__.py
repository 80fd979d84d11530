"""The explorer in the browser: branches, orbits and basin maps of one system on one page (``bifurc explore``).

`model` and `script` hold what is shown and the commands on it, without a web library; `work` computes beside them;
`view` draws with bokeh, `gate` and `server` let one browser of this machine in.
"""
import importlib

_NAMES = {"serve": ".serving", "Session": ".model", "Shown": ".model"}
__all__ = [*_NAMES]


def __getattr__(name: str):
    if name not in _NAMES:
        raise AttributeError(f"module 'bifurc.explore' has no attribute {name!r}; it has {', '.join(__all__)}")
    value = getattr(importlib.import_module(_NAMES[name], __name__), name)
    globals()[name] = value
    return value
