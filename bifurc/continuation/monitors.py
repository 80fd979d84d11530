"""A user's own numbers along a branch: `trace(monitors={"clearance": f})` locates where f(solution) is zero.

The functions are not stored with a branch; one that was read from a file is as good as before, but is extended, and its points
are followed as curves, only by a new trace.
"""
from ..checks import function, mapping
from ..elements import Shift
from .kinds import SpecialPointKind
from .problem import Monitor
from .steps.callbacks import value_of
from .watching import Watching

REVERSAL = "reversal_"  # of a coordinate: what a point is called where a motion that creeps turns back
TAKEN = ("bound", "listed", "unlisted", "leaving", "merges")  # names that monitors of the package have


class WithMonitors(Watching):
    """A problem that also watches functions of its solutions.

    Parameters
    ----------
    problem : Problem
    functions : dict of str to callable
        ``f(solution) -> float``; zeros are special points of kind ``user`` with the name.
    """

    def __init__(self, problem, functions):
        self.functions = dict(functions)
        super().__init__(problem, (Monitor(SpecialPointKind.USER, name) for name in self.functions))

    def around(self, inner):
        """See `Watching.around`."""
        return WithMonitors(inner, self.functions)

    def values(self, c):
        """See `Watching.values`."""
        return self.values_at(c.x, c.tangent)

    def values_at(self, x, tangent):
        """See `Watching.values_at`."""
        solution = self.inner.solution(x)
        return [value_of(name, function, solution) for name, function in self.functions.items()]

    def to_record(self) -> dict:
        """Return the record of the inner problem with the names watched."""
        return {**self.inner.to_record(), "monitors": list(self.functions)}


def with_monitors(problem, functions):
    """Return ``problem`` watching ``functions`` (None, or a dict of callables by name).

    Raises
    ------
    ValueError
        Naming what is no function, or a name that is taken.
    """
    own = reversals(problem)
    if not own and (functions is None or not mapping("trace", "monitors", functions)):
        return problem
    functions = {**own, **(functions or {})}
    taken = {*TAKEN, *(monitor.name for monitor in problem.monitors)}
    for name, value in functions.items():
        if not name or name in taken:
            raise ValueError(f"monitors: {name!r} is no free name; taken are {', '.join(sorted(filter(None, taken)))}")
        function("trace", f"monitors[{name!r}]", value)
    return WithMonitors(problem, functions)


def reversals(problem) -> dict:
    """Return the functions of an orbit that are zero where a shift that is not known changes its sign, by name."""
    system = problem.system
    names = () if system is None else [f"{REVERSAL}q{element.dof}" for element in system.elements
                                       if isinstance(element, Shift) and element.by is None]
    return {name: reversal(name) for name in names}


def reversal(name: str):
    """Return the function of that name."""
    return lambda orbit: orbit.shift[name.removeprefix(REVERSAL)]


def unknown(name):
    """Return the function that stands for one that was not stored with a branch; those of the package are known by name."""
    if name.startswith(REVERSAL):
        return reversal(name)

    def function(solution):
        raise ValueError(f"the function of the monitor {name!r} is not stored with a branch; trace it anew")
    return function
