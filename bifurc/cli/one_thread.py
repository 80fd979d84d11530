"""One BLAS thread for the command line, set before numpy is loaded; who has set a number keeps it.

The matrices of small systems gain nothing from more, and threads that wait for each other by spinning slow everything beside them:
`bifurc trace impact_oscillator` took seven times as long with two.
"""
import os

for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")
