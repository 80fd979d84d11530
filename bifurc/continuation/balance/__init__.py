"""Branches of harmonic-balance solutions: `problem` whole, `condensed` in the touched coordinates.  Start at `problem`."""
