"""The kernels that move a scene under laws that are not affine."""
from types import SimpleNamespace

import numpy as np

from ..compose.tables import ORDER
from ..compose.writer import kernels


def engine_of_laws(scene) -> SimpleNamespace:
    """Return the written kernels ``run``, ``sample``, ``workspace`` of a scene with laws, and ``series`` on its guards.
    """
    scan = kernels(scene.laws, scene.n, "bifurc.flow.scan")
    dense = kernels(scene.laws, scene.n, "bifurc.flow.dense")
    engine = kernels(scene.laws, scene.n)

    def series(T, m, g, x):
        """Return the polynomial (ORDER+1,) of a guard along the flow, and what its rounding is measured by."""
        a, size = np.empty(ORDER + 1), np.empty(ORDER + 1)
        engine.guard_terms(T, m, g, np.ascontiguousarray(x, float), a, size)
        return a, size

    return SimpleNamespace(run=scan.run, sample=dense.sample, workspace=scan.workspace, series=series)
