"""Stability of harmonic-balance solutions: `monodromy` in the time domain, multipliers in `stability`.

`hill` reads exponents from the balance itself (Hill's method).  Start reading at `stability`.
"""
