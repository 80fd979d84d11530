"""Labels of many starts through any executor: the parts of a basin map as chunks."""
from collections.abc import Mapping
from typing import Any

import numpy as np

from ...ensemble.integrator import Cells, Integrator, Targets
from ...ensemble.section import Section
from ...ensemble.section_integrator import SectionIntegrator
from ...jobs.executors import Kept, run_chunks
from ...jobs.progress import Progress
from ...jobs.store import ChunkStore, fingerprint
from ...system import System
from ..attractors.clockless import integrator_of

LEAN, CLOSED, LAW = 8192, 2048, 256  # starts a chunk: about half a second of work, by the kind of the scene
FEWEST = 256  # a part that is not filed may be smaller, to keep all threads busy
_integrators = Kept()


class Labeller:
    """Makes payloads of one system.

    Parameters
    ----------
    integrator : Integrator or SectionIntegrator
    elements : tuple
        User classes, laws and builder of the system.
    """

    def __init__(self, integrator: Integrator | SectionIntegrator, elements: tuple):
        self.common: dict[str, Any] = {"system": integrator.scene.system.to_record(), "limit": integrator.limit,
                                       "elements": elements}
        if integrator.section is not None:
            self.common["section"] = integrator.section.to_record()
        self.common["key"] = fingerprint(self.common)
        self.size = LEAN if integrator.lean else CLOSED if integrator.scene.closed_form else LAW
        _integrators.put(self.common["key"], integrator)

    def parts(self, waiting: np.ndarray, filed: bool, workers: int) -> list[np.ndarray]:
        """Return the places of starts in parts: of a fixed size where they are filed, else enough for all workers."""
        size = self.size if filed else int(np.clip(len(waiting) // (8 * workers), FEWEST, self.size))
        return [waiting[i:i + size] for i in range(0, len(waiting), size)]

    def payload(self, starts: np.ndarray, targets: Targets, most: int) -> dict:
        """Return what `label_part` takes."""
        return {**self.common, "starts": starts, "targets": dict(targets._asdict()), "most": most}


def label_starts(labeller: Labeller, starts: np.ndarray, targets, most: int, store: ChunkStore, run: Mapping,
                 bar: Progress | None = None, fresh: np.ndarray | None = None, note: str = "") -> Cells:
    """Label starts (k, ns) in chunks, wherever an executor runs them; ``fresh`` (k,) is the progress that each is worth.

    Raises
    ------
    RuntimeError
        When chunks fail; the others are kept where a file is given.
    """
    parts = labeller.parts(np.arange(len(starts)), store.folder is not None, run["workers"])
    outcome = run_chunks(store, label_part, [labeller.payload(starts[part], targets, most) for part in parts], bar=bar,
                         weights=None if fresh is None else [float(fresh[part].sum()) for part in parts], note=note, **run)
    if outcome.failures:
        first, why = next(iter(outcome.failures.items()))
        raise RuntimeError(f"{len(outcome.failures)} of {len(parts)} chunks of starts failed; the others are finished, and "
                           f"kept where a file is given. Chunk {first}, from {starts[parts[first][0]].tolist()} on: {why}")
    cells = Cells.blank(len(starts))
    for part, result in zip(parts, outcome.results, strict=True):
        assert result is not None
        for name, mine in cells._asdict().items():
            mine[part] = result[1][name]
    return cells


def label_part(payload: Mapping) -> tuple[dict, dict[str, np.ndarray]]:
    """Label the starts of a payload: the work of a chunk."""
    integrator = _integrators.get(payload["key"])
    if integrator is None:
        system = System.from_record(payload["system"], payload["elements"])
        section = payload.get("section")
        integrator = integrator_of(system, payload["limit"], None if section is None else Section(**section))
        _integrators.put(payload["key"], integrator)
    cells = integrator.label(payload["starts"].copy(), Targets(**payload["targets"]), payload["most"])
    return {}, cells._asdict()
