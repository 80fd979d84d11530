"""Harmonic balance: a period in Fourier coefficients, contacts marched along it event by event or sampled."""
