"""The one `njit` of the package: disk cache keyed by the kernels' sources, IEEE arithmetic, no GIL."""
from ._cache import cache_folder

cache_folder()  # before numba is imported anywhere

import numba  # noqa: E402

njit = numba.njit(cache=True, error_model="numpy", nogil=True)
