"""Show a system or a saved result in the browser until the keyboard interrupts."""
import logging
import signal
import webbrowser
from collections.abc import Mapping, Sequence
from typing import Any

from ..checks import BALANCE, BASINS, BRANCH, ORBIT, SYSTEM, checked, either, function, path, text
from ..system import System
from .model import of_result, of_system


@checked(what=either(SYSTEM, BRANCH, ORBIT, BALANCE, BASINS, allowed="a System, a branch, an orbit or a basin map"), bounds=None,
         path=text, out=path, say=function)
def serve(what: Any, parameter: str | None = None, bounds: Sequence[float] | None = None, *, window: Mapping | None = None,
          path: str = "", out="bifurc-results", workers: int | None = None, browser: bool = True, say: Any = print) -> None:
    """Show a system, or a saved result, in the browser until the keyboard interrupts.

    The server answers one browser of this machine alone: it is bound to 127.0.0.1 and a free port, and the address that is
    printed opens once.

    Parameters
    ----------
    what : System, Branch, PeriodicOrbit, HarmonicOrbit or BasinMap
    parameter : str, optional
        That a system's branches are traced in; default ``omega``.
    bounds : pair of float, optional
        Its range; default half to twice the value.
    window : dict of str to (low, high), optional
        Components and ranges of the slice of starts; default around the orbit.
    path : str
        File of a saved result, which the script of the page loads.
    out : path-like
        Folder of what is saved.
    workers : int, optional
        Threads of a basin map.
    browser : bool
        Open the address in the default browser.
    say : callable
        Gets the address as a line.

    Raises
    ------
    ValueError
        What cannot be explored.
    ModuleNotFoundError
        Without bokeh.

    Examples
    --------
    >>> import bifurc as bf
    >>> from bifurc.explore import serve
    >>> serve(bf.systems.impact_oscillator(), bounds=(0.5, 2.0))     # doctest: +SKIP
    """
    first = of_system(what, parameter, bounds, window) if isinstance(what, System) else of_result(what, path)
    try:
        from .server import Explorer  # bokeh is optional
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(f"the explorer needs bokeh ({error}): python -m pip install 'bifurc[explore]'") from error
    from .desk import Desk  # bokeh is optional

    logging.getLogger("bokeh").setLevel(logging.ERROR)  # a page that is closed is no news
    explorer = Explorer(Desk(first, out, workers))
    say(f"explorer: {explorer.url}\n(opens once; Ctrl-C ends it)")
    before = signal.signal(signal.SIGTERM, lambda number, frame: explorer.loop.add_callback_from_signal(explorer.end))
    try:
        if browser:
            webbrowser.open(explorer.url)
        explorer.run()
    except KeyboardInterrupt:
        say("explorer closed")
    finally:
        signal.signal(signal.SIGTERM, before)
        explorer.desk.close()
