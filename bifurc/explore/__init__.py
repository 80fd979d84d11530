"""The explorer in the browser: branches, orbits and basin maps of one system on one page (``bifurc explore``).

`model` and `script` hold what is shown and the commands on it, without a web library; `work` computes beside them;
`view` draws with bokeh, `gate` and `server` let one browser of this machine in.
"""
from ..lazy import lazy

_NAMES = {"serve": "serving", "Session": "model", "Shown": "model"}
__all__ = [*_NAMES]
__getattr__, __dir__ = lazy(__name__, _NAMES)
