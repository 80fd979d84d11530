"""Harmonic balance in the coordinates that contacts touch: `receptance` is the linear part, `condensed` the equations."""
