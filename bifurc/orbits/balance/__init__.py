"""Orbits by harmonic balance: what stands between a system and the equations of `hbm`.

`method` has the options, `find` goes from a guess to an orbit, `setvalued` does so where friction is set-valued;
`harmonic_orbit` is the result with its measures, multipliers and stated error.  Start reading at `find`.
"""
