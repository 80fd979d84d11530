"""Compile the kernels of a first command in two processes at once: half of them each, into the shared disk cache.

A kernel is compiled once a machine and version of the sources; on an empty cache that is most of the time of a first
command.  The compiler holds a lock within a process, so that only processes run side by side.
"""
import subprocess
import sys

from ._cache import cache_folder, source_hash

DONE = "warm-{}"  # marker in the cache folder, with the hash of the sources
LONGEST = 300.0  # seconds to wait for a helper process; what it has not compiled is compiled here when it is needed


def warm_up(say=print) -> bool:
    """Fill an empty kernel cache; return whether there was anything to do.

    A process that fails costs nothing but its time: kernels that are still missing are compiled when they are called.
    """
    marker = cache_folder() / DONE.format(source_hash())
    if marker.exists():
        return False
    say("compiling kernels for this machine (once, about half a minute)")
    code = "from bifurc import first_kernels; first_kernels.{}()"
    running = [subprocess.Popen([sys.executable, "-c", code.format(part)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
               for part in ("motions", "orbits")]
    try:
        ended = [process.wait(LONGEST) == 0 for process in running]
    except subprocess.TimeoutExpired:
        return True
    finally:
        for process in running:
            if process.poll() is None:
                process.kill()
    if all(ended):
        marker.touch()
    return True
