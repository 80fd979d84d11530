"""Harmonic balance: a period in Fourier coefficients, contacts followed along it event by event or sampled.

`parts` reads a system, `layout` packs coefficients, `residual` forms the equations, `balance` is what Python asks of them and
`corrector` one continuation step.  `contacts` gives their forces, `condensation` eliminates what they do not touch, `floquet`
the multipliers, `setvalued` dry friction without regularisation, `errors` the truncation error.  Start reading at `balance`.
"""
