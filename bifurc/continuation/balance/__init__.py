"""Branches of harmonic-balance solutions: `start` makes the problem of an orbit, `problem` whole, `condensed` in the touched
coordinates.  Start at `problem`."""
