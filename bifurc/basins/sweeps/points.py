"""One parameter value of a sweep: attractors found from many starts, and the share of the starts that each attracts.

The work of chunks: it takes and returns plain records, so that threads, processes and clusters give the same bits.
"""
from collections.abc import Mapping, Sequence

import numpy as np

from ...compose.scene import scene_of
from ...ensemble.integrator import Integrator
from ...ensemble.outcomes import OUTSIDE, REACHED, UNSETTLED
from ...ensemble.region import Region
from ...system import System
from ..attractors.discovery import Discovery
from ..attractors.matching import Links
from ..attractors.records import packed_points, unpacked_points

FIRST = 256  # starts from which attractors are looked for before all are labelled
LOOKED = 16  # unsettled starts that are examined before they are labelled again
ROUNDS = 8  # of that, at most


def sweep_points(payload: Mapping) -> tuple[dict, dict[str, np.ndarray]]:
    """Find attractors and count their starts at some parameter values.

    Parameters
    ----------
    payload : dict
        ``system`` (record), ``elements`` (user classes), ``points`` (one dict of parameters each), ``region``
        (record), ``samples``, ``options`` (seed, tolerance, max_periods, max_events), and optionally ``known``:
        headers of attractors a point, with their arrays in ``arrays``.

    Returns
    -------
    meta, arrays
        ``points``: a dict each with ``attractors`` (headers), ``counts``, ``unresolved``, ``outside``, ``starts``; ``links``:
        rows (point, attractor, step, number, continued) of the links among neighbouring points, see `matching.Links`;
        number -1: the attractor becomes none.
    """
    elements = payload.get("elements", ())
    base = System.from_record(payload["system"], elements)
    region, options = Region.from_record(payload["region"]), payload["options"]
    known = None if payload.get("known") is None else unpacked_points(payload["known"], payload["arrays"], elements)
    scene_of(base)  # those of the points are made from it
    points: list[dict] = []
    attractors: list[list] = []
    systems: list[System] = []
    for p, changes in enumerate(payload["points"]):
        system = base.with_parameters(**changes)
        found, counts = point(system, region, payload["samples"], options, [] if known is None else known[p])
        attractors.append(found)
        points.append(counts)
        systems.append(system)
    among = Links(systems, [region.sizes(scene_of(system)) for system in systems], attractors).among()
    links = [[*key, *((-1, False) if end is None else end)] for key, end in among.items()]
    headers, arrays = packed_points(attractors)
    rows = [{**counts, "attractors": mine} for counts, mine in zip(points, headers, strict=True)]
    return {"points": rows, "links": links}, arrays


def point(system: System, region: Region, samples: int, options: Mapping, known: Sequence) -> tuple[list, dict]:
    """Return the attractors of one system, those known first, and what became of the starts."""
    scene = scene_of(system)
    starts, scale = region.starts(scene, samples, options["seed"]), region.sizes(scene)
    integrator = Integrator(scene, options["max_events"])
    found = Discovery(system, integrator, scale, dict(options), list(known))
    found.search(starts[:FIRST])
    labels, states = np.full(samples, -1), np.full(samples, UNSETTLED)
    waiting = np.arange(samples)
    for _ in range(ROUNDS):
        cells = integrator.label(starts[waiting].copy(), found.targets(), options["max_periods"])
        labels[waiting], states[waiting] = cells.labels, cells.states
        waiting = np.flatnonzero(states == UNSETTLED)
        before = len(found.attractors)
        if not waiting.size:
            break
        found.search(starts[waiting[np.linspace(0, waiting.size - 1, min(LOOKED, waiting.size)).astype(int)]])
        if len(found.attractors) == before:
            break
    reached = states == REACHED
    counts = [int(np.count_nonzero(reached & (labels == k))) for k in range(len(found.attractors))]
    outside = int(np.count_nonzero(states == OUTSIDE))
    return found.attractors, {"counts": counts, "outside": outside, "unresolved": samples - outside - sum(counts),
                              "starts": samples}
