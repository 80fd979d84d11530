"""Stability of harmonic-balance solutions: `monodromy` in the time domain, multipliers in `stability`.  Start reading there."""
