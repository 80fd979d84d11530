"""Solvers that know no class above them: Newton's method and bordered linear systems."""
