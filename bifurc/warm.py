"""Compile the kernels of a first command in two processes at once: this one and a helper, into the shared disk cache.

A kernel is compiled once a machine and version of the sources; on an empty cache that is most of the time of a first
command.  The compiler holds a lock within a process, so that only processes run side by side.
"""
import os
import pathlib
import subprocess
import sys

from ._cache import cache_folder, source_hash

DONE = "warm-{}"  # marker in the cache folder, with the hash of the sources
LONGEST = 300.0  # seconds to wait for a helper process; what it has not compiled is compiled here when it is needed


def warm_up(say=print) -> bool:
    """Fill an empty kernel cache; return whether there was anything to do.

    A helper that fails costs nothing but its time: kernels that are still missing are compiled when they are called.
    """
    marker = cache_folder() / DONE.format(source_hash())
    if marker.exists():
        return False
    say("compiling kernels for this machine (once, about half a minute)")
    code = "import sys; from bifurc import first_kernels; sys.stdin.read(); first_kernels.motions()"
    helper = subprocess.Popen([sys.executable, "-P", "-c", code], env=same_package(), stdin=subprocess.PIPE,
                              stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        from . import first_kernels  # loads most of the package: not for commands that have nothing to compile
        first_kernels.scenes()
        if helper.stdin is not None:
            helper.stdin.close()  # its turn: what both need is on disk
        first_kernels.orbits()
        if helper.wait(LONGEST) == 0:
            marker.touch()
    except subprocess.TimeoutExpired:
        pass
    finally:
        if helper.poll() is None:
            helper.kill()
    return True


def same_package() -> dict[str, str]:
    """Return the environment in which another process, started with ``-P``, finds this very package.

    In a clone of the sources the folder that a command is called in has a package of the same name: kernels that are compiled
    for that one are of no use to the one that is installed.
    """
    here = str(pathlib.Path(__file__).parent.parent)
    return {**os.environ, "PYTHONPATH": os.pathsep.join([here, *filter(None, [os.environ.get("PYTHONPATH")])])}
