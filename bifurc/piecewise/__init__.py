"""Systems of first order that are written down as fields, surfaces and resets: Filippov systems, relays, converters, resets.

`PiecewiseSystem` names a field on each side of surfaces and writes the modes, sliding ones included; `HybridSystem` names modes and
jumps. Both give a `System` without degrees of freedom, whose states are those of one `elements.Automaton`: simulation, orbits,
branches and basins are those of every other system.  Start at `systems`; `fields` holds what a user writes, `regions` the modes.
"""
from .equilibria import equilibria
from .fields import AffineField, AffineReset, AffineSurface
from .systems import HybridSystem, Jump, PiecewiseSystem, Switch

__all__ = ["AffineField", "AffineReset", "AffineSurface", "HybridSystem", "Jump", "PiecewiseSystem", "Switch",
           "equilibria"]
