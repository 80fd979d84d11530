"""The compiled kernels that move a scene: those kept with the package, or twins on the engine that the scene needs."""
from types import SimpleNamespace

from ..compose.writer import kernels


def engine_of(scene) -> SimpleNamespace:
    """Return the kernels ``run``, ``sample``, ``passages``, ``workspace`` for the modes of a scene.

    Raises
    ------
    ValueError
        For memory with a rate beside a law: in the steps of `collocation` memory stays, until an event writes it.
    """
    if not scene.closed_form and scene.tables.A[:, 2 * scene.n:].any():
        moving = [label for label, element, place in zip(scene.system.labels, scene.system.elements, scene.slices, strict=True)
                  if element.memory and scene.tables.A[:, place].any()]
        raise ValueError(f"{', '.join(moving)}: memory with a rate is not integrated together with a force law that is not affine "
                         f"({', '.join(law.name for law in scene.laws)}); make it a coordinate of the system, or the law "
                         "piecewise linear")
    scan, dense = kernels(scene, "bifurc.flow.scan"), kernels(scene, "bifurc.flow.dense")
    return SimpleNamespace(run=scan.run, workspace=scan.workspace, sample=dense.sample, passages=dense.passages)
