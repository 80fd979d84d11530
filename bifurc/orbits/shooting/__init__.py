"""Shooting through a sequence of events: the equations of an orbit whose event signature is known.

`signature` says which guards fire in which modes, `sequence` has residual, Jacobian and the compiled corrector, `equations` and
`path` the same along a parameter, `motion` the motion between the events.  `births`, `labels`, `refused` and `resting`
hold what a signature implies beyond its events.  Start reading at `sequence`.
"""
