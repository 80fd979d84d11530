"""The kernels that move a scene under laws that are not affine."""
from types import SimpleNamespace

from ..compose.writer import kernels


def engine_of_laws(scene) -> SimpleNamespace:
    """Return the written kernels ``run``, ``sample``, ``workspace`` of a scene with laws.

    Raises
    ------
    ValueError
        For memory with a rate beside a law: in the steps of `collocation` memory stays, until an event writes it.
    """
    if scene.tables.A[:, 2 * scene.n:].any():
        moving = [label for label, element, place in zip(scene.system.labels, scene.system.elements, scene.slices, strict=True)
                  if element.memory and scene.tables.A[:, place].any()]
        raise ValueError(f"{', '.join(moving)}: memory with a rate is not marched together with a force law that is not affine "
                         f"({', '.join(law.name for law in scene.laws)}); make it a coordinate of the system, or the law "
                         "piecewise linear")
    scan = kernels(scene, "bifurc.flow.scan")
    dense = kernels(scene, "bifurc.flow.dense")
    return SimpleNamespace(run=scan.run, sample=dense.sample, workspace=scan.workspace)
