"""Shared set-up: the folder of compiled kernels, floating-point errors raised, seeded draws."""
import hashlib
import os
import tempfile

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # workers beside each other: threads that spin for a small matrix wait for cores

import numpy as np
import pytest
from hypothesis import settings

from bifurc import warm
from bifurc._cache import source_hash

settings.register_profile("bifurc", derandomize=True, deadline=None, print_blob=False)
settings.load_profile("bifurc")

# numba looks only at a caller's own file when it judges a cached kernel, so an edited callee would be replayed in its
# old form: inside this folder every state of a module and of all it imports gets a folder of its own (`bifurc._cache`).
os.environ.setdefault("NUMBA_CACHE_DIR", os.path.join(tempfile.gettempdir(), f"bifurc-tests-{os.getuid()}"))
os.makedirs(os.environ["NUMBA_CACHE_DIR"], exist_ok=True)
marker = os.path.join(os.environ["NUMBA_CACHE_DIR"], warm.DONE.format(source_hash()))
open(marker, "a").close()  # commands under test start no compiling processes
os.environ.setdefault("MPLBACKEND", "Agg")


@pytest.fixture(autouse=True)
def floating_point_errors_raised():
    """Numpy code of the package neither divides by zero, nor overflows, nor makes NaN unnoticed."""
    with np.errstate(divide="raise", over="raise", invalid="raise"):
        yield


@pytest.fixture
def rng(request) -> np.random.Generator:
    """A generator seeded by the test's own name: the same draws in any order and in any worker."""
    seed = int.from_bytes(hashlib.sha256(request.node.nodeid.encode()).digest()[:8], "little")
    return np.random.default_rng(seed)
