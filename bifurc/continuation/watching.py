"""Problems that also watch something along their branch: what they stand for does the work, a few monitors are added."""
import copy

import numpy as np

from .kinds import ERRORS
from .problem import Corrected


class Watching:
    """Base class: passes everything on to the problem it stands for and adds monitors.

    A subclass writes ``values(x, tangent, problem)``, the values of its monitors, and ``around(inner)``, the same watch on another
    problem.

    Parameters
    ----------
    problem : Problem
    monitors : iterable of Monitor
    """

    errors = ERRORS  # functions of the user are among what is watched
    follows = False  # what is watched is looked up in every step

    def __init__(self, problem, monitors):
        self.inner = problem
        self.monitors = (*problem.monitors, *monitors)

    def __getattr__(self, name):
        if name.startswith("__") or name == "inner":
            raise AttributeError(name)
        return getattr(self.inner, name)

    def __copy__(self):
        return self.around(copy.copy(self.inner))

    def around(self, inner):
        """Return the same watch on another problem."""
        raise NotImplementedError

    def values(self, c):
        """Return the values of the added monitors at a corrected point."""
        raise NotImplementedError

    def values_at(self, x, tangent):
        """Return the values of the added monitors at a solution ``x`` (n + 1,)."""
        raise NotImplementedError

    @property
    def scale(self):
        """Natural sizes (n + 1,) of unknowns and parameter."""
        return self.inner.scale

    @scale.setter
    def scale(self, value):
        self.inner.scale = value

    def correct(self, x, tangent, fixed=False) -> Corrected:
        """See `Problem.correct`."""
        c = self.inner.correct(x, tangent, fixed)
        if c.converged:
            c.monitors = np.append(c.monitors, self.values(c))
        return c

    def zero(self, curve, test, ends, guess):
        """See `Problem.zero`: what is watched is known at points that this problem corrects."""
        return None

    def monitor_values(self, u, p, tangent):
        """See `Problem.monitor_values`."""
        return np.append(self.inner.monitor_values(u, p, tangent), self.values_at(np.append(u, p), tangent))

    def switch(self, point, monitor):
        """See `Problem.switch`; the watch goes on behind the boundary."""
        inner = copy.copy(point)
        inner.monitors = point.monitors[:len(self.inner.monitors)]
        answer = self.inner.switch(inner, monitor)
        return (self.around(answer[0]), *answer[1:]) if isinstance(answer, tuple) else answer

    def beyond_corner(self, row):
        """See `Problem.beyond_corner`; the watch goes on behind the corner."""
        answer = self.inner.beyond_corner(row)
        return None if answer is None else (self.around(answer[0]), *answer[1:])

    def shaken(self):
        """See `Problem.shaken`."""
        size, pairs = self.inner.shaken()
        return size, tuple(tuple(lambda make=make: self.around(make()) for make in pair) for pair in pairs)

    def restarted(self, x):
        """See `Problem.restarted`."""
        return self.around(self.inner.restarted(x))

    def bounded(self, low, high, made):
        """See `Problem.bounded`."""
        inner = self.inner.bounded(low, high, made)
        return self if inner is self.inner else self.around(inner)

    def same(self, other) -> bool:
        """See `Problem.same`."""
        return type(other) is type(self) and self.inner.same(other.inner)


def bare(problem):
    """Return the problem that does the work."""
    while isinstance(problem, Watching):
        problem = problem.inner
    return problem
