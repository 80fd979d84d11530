"""Command line: ``bifurc trace|frf|basins|sweep|atlas|hysteresis|explore SYSTEM``, ``bifurc certify FILE``,
``bifurc info [SYSTEM]``; one file a command.

Every command is the Python of the tutorials with names in place of variables.  Files are renamed into place as soon as
they are complete, so that an interrupt loses nothing that is finished.
"""
from . import one_thread  # noqa: F401, I001  (before numpy)

import os
import sys
from collections.abc import Sequence

import bifurc as bf

from . import atlas, branches, certify, completion, explore, frf, info, loops, maps, sweeps
from .common import Parser, shared

_INTERRUPTED, _UNHEARD = 130, 141  # exit codes of shells for a program that was interrupted, and for one that nobody listened to


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Without the program's name; those of the process by default.

    Returns
    -------
    int
        0; 2 for a request that cannot be met; 130 after an interrupt; 141 where the reader of the output has gone.
    """
    code = 0
    try:
        try:
            code = _run(arguments)
        finally:
            if sys.stdout is not None:
                sys.stdout.flush()  # while an error of it can be told
        return code
    except BrokenPipeError:  # as `bifurc info | head -1` does: there is nobody to tell
        code = _UNHEARD
    except OSError as error:  # as of a disk that is full
        code = code or _failed(error)
    for stream in (sys.stdout, sys.stderr):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())  # what is left in them goes there at the end of the process
    return code


def _run(arguments: Sequence[str] | None) -> int:
    """Run the command line; what it has to say is said in one line."""
    parser = _parser()
    try:
        options = parser.parse_args(arguments)
        if options.run is None:
            print(parser.format_help(), end="")
            return 0
        return options.run(options)
    except BrokenPipeError:
        raise
    except (ValueError, LookupError, OSError, MemoryError) as error:
        return _failed(error)
    except KeyboardInterrupt:
        print("bifurc: interrupted; what was finished is on disk", file=sys.stderr)
        return _INTERRUPTED


def _failed(error: Exception) -> int:
    """Tell an error in one line; return the code of a request that cannot be met."""
    message = error.args[0] if isinstance(error, KeyError) and error.args else error
    print(f"bifurc: error: {' '.join(str(message).split())}", file=sys.stderr)
    return 2


def _parser() -> Parser:
    parser = Parser(prog="bifurc", description="Periodic motions of systems that hit, rub, stick and slip.")
    parser.add_argument("--version", action="version", version=f"bifurc {bf.__version__}")
    parser.set_defaults(run=None)
    commands = parser.add_subparsers(title="commands", metavar="COMMAND")
    branches.add(commands, shared())
    maps.add(commands, shared())
    frf.add(commands, shared())
    loops.add(commands, shared())
    sweeps.add(commands, shared())
    atlas.add(commands, shared())
    explore.add(commands)
    certify.add(commands)
    info.add(commands)
    completion.add(commands, parser)
    return parser
