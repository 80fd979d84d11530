"""The engine of modes under laws that are not affine: the same functions as `flow.affine`, by collocation.

`engine` moves a state by the steps of `collocation` (coefficients in `gauss`), `guards` has guards and states as polynomials on
a step.  A scene's laws are reached through two C functions: `calls`; `nolaw` holds the place of their text.  Start reading at
`engine`.
"""
