"""An automaton: states with affine rates of their own, modes, and what leads from one to another.

It sits on no coordinate: a system of first order is one without degrees of freedom, with an automaton, see `bifurc.piecewise`.
"""
from dataclasses import dataclass

import numpy as np

from .element import Element
from .mode import Mode, Rate
from .site import Rows


@dataclass(frozen=True, kw_only=True)
class Automaton(Element):
    """States with affine rates in modes.

    Parameters
    ----------
    states : tuple of str
        Their names.
    rates : tuple of (key, tuple of Affine)
        Mode by mode, the rate of every state.
    exits : tuple of (key, tuple of Guard)
        Mode by mode, what ends it.
    begins : tuple of keys
        Modes that may hold at a start, in the order in which they are tried.
    final : tuple of (key, str)
        Modes in which a motion ends, and its status.
    regions : tuple of (key, sides)
        Modes of which a motion may hold one only: where several with different sides may begin it ends, "escaping" or at a
        "two-fold".
    slides : tuple of (key, tuple of (key, guard))
        Modes that stay on surfaces, and the guards of other modes that vanish there.
    """

    states: tuple
    rates: tuple
    exits: tuple
    begins: tuple
    final: tuple = ()  # type: ignore[misc]  # of each automaton its own
    regions: tuple = ()  # type: ignore[misc]
    slides: tuple = ()  # type: ignore[misc]

    def site(self, n):
        """See `Element`: there is none."""
        return Rows(np.zeros((0, n)))

    @property
    def start(self):
        """See `Element`."""
        return self.begins

    @property
    def memory(self):
        """See `Element`: the states."""
        return self.states

    @property
    def harmonics(self):
        """See `Element`."""
        expressions = [*(rate for _, rates in self.rates for rate in rates),
                       *(part for _, exits in self.exits for leave in exits for part in (leave.value, *leave.reset))]
        return tuple(sorted({k for expression in expressions for k in expression.harmonics}))

    def mode(self, key, core):
        """See `Element`."""
        return Mode(memory=tuple(map(Rate, dict(self.rates)[key])), guards=dict(self.exits)[key])

    @property
    def structure(self):
        """See `Element`: which terms there are, not what they weigh."""
        def terms(expressions):
            return tuple(tuple(sorted(expression.terms)) for expression in expressions)
        return (type(self), self.states, self.begins, self.final, self.regions, self.slides,
                tuple((key, terms(rates)) for key, rates in self.rates),
                tuple((key, tuple((terms((leave.value, *leave.reset)), leave.kind, leave.then) for leave in exits))
                      for key, exits in self.exits))

    @property
    def parameters(self):
        """See `Element`: those of an automaton are the keywords of its system."""
        return {}
