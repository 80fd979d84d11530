"""Equilibria of systems without excitation.

`equilibrium` finds them with the contacts that touch and stick, and their eigenvalues; `hopf` has the first Lyapunov coefficient
where a pair of them crosses the imaginary axis.  Start reading at `equilibrium`.
"""
