"""The work of an atlas that executors do: trace an orbit and switch at its special points, records in and records out."""
from collections.abc import Mapping

import numpy as np

from ..basins.sweeps.points import packed, unpacked
from ..continuation.kinds import ContinuationError, SpecialPointKind
from ..continuation.switching import switch_branch
from ..continuation.tracing import trace
from ..orbits.orbit import PeriodicOrbit
from .identity import repeats, trimmed

SWITCHED = (SpecialPointKind.PERIOD_DOUBLING, SpecialPointKind.BRANCH_POINT, SpecialPointKind.GRAZING)


def trace_orbits(payload: Mapping) -> tuple[dict, dict[str, np.ndarray]]:
    """Trace orbits and switch at all special points.

    Parameters
    ----------
    payload : dict
        ``orbits`` (headers), ``arrays``, ``elements``, ``parameter``, ``bounds``, ``periods`` (longest period of what is
        offered), ``options`` (of `trace`).

    Returns
    -------
    meta, arrays
        ``branches``: one a start, each with ``header`` (None where none was traced, or all of its
        orbits have a shorter period), ``why`` and ``offers`` (headers of
        orbits on other branches), and the parameter where each leaves.
    """
    elements = payload.get("elements", ())
    found: list[dict] = []
    arrays: dict[str, np.ndarray] = {}
    for k, orbit in enumerate(unpacked(payload["orbits"], payload["arrays"], "start_", elements)):
        try:
            periods = orbit.periods
            branch = trimmed(trace(orbit, payload["parameter"], tuple(payload["bounds"]), **payload["options"],
                                   stop=lambda point, n=periods: point.solution.periods != n or repeats(point.solution)), periods)
        except (ContinuationError, ArithmeticError) as error:
            found.append({"header": None, "why": str(error), "offers": [], "at": []})
            continue
        if branch is None:
            found.append({"header": None, "why": "", "offers": [], "at": []})
            continue
        header, mine = branch.to_record()
        arrays |= {f"b{k}_{name}": np.asarray(values) for name, values in mine.items()}
        offers: list[PeriodicOrbit] = []
        at: list[float] = []
        for point in branch.special_points:
            if point.kind not in SWITCHED:
                continue
            most = payload["periods"] // orbit.periods
            for other in switch_branch(point, n_max=max(1, most)):
                if isinstance(other, PeriodicOrbit) and other.periods <= payload["periods"] and other.success:
                    offers.append(other)
                    at.append(point.parameter)
        headers, more = packed(offers, f"o{k}_")
        arrays |= more
        found.append({"header": header, "why": "", "offers": headers, "at": at})
    return {"branches": found}, arrays
