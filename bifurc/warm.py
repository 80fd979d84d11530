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
    code = "from bifurc import warm; warm.{}()"
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


def motions() -> None:
    """Compile what simulations and basin maps of one degree of freedom call."""
    import numpy as np

    from .compose.scene import scene_of
    from .ensemble.marcher import Marcher, Targets
    from .flow.simulate import simulate
    from .systems import impact_oscillator

    system = impact_oscillator(omega=1.4)
    simulate(system, (0.0, 2.0), periods=3).sections  # noqa: B018 (the property compiles)
    none = np.empty(0, np.int64)
    targets = Targets(np.ones(2), np.zeros((1, 2)), np.zeros(1), np.zeros(1, np.int64), 1.0, none.astype(np.uint64), none)
    Marcher(scene_of(system), 100).label(np.zeros((2, 2)), targets, 2)


def orbits() -> None:
    """Compile the corrector of event sequences and the measures of orbits."""
    import numpy as np

    from .continuation.shooting.problem import orbit_problem
    from .orbits.find import solve
    from .orbits.signature import Signature
    from .systems import impact_oscillator

    nodes = np.array([[0, 0, 0, 1, 0]])
    start = np.array([0.1298, 1.0, 2.9594])  # one impact a period at omega 1.5, amplitude .9
    system = impact_oscillator(omega=1.5, amplitude=0.9)
    orbit = solve(system, Signature(nodes, np.zeros(1), 1.0), start, np.array([1.0, 1.5]), {})
    problem = orbit_problem(orbit, "omega", (1.4, 1.6))
    problem.correct(problem.x0, problem.null_tangent(problem.x0))
    orbit.maximum(), orbit.multipliers, orbit.state, orbit.events
