"""The work of an atlas that executors do: trace an orbit and switch at its special points, records in and records out."""
from collections.abc import Mapping

import numpy as np

from ..basins.attractors.records import packed_points, unpacked
from ..continuation.branches.branch import Branch
from ..continuation.kinds import ERRORS, ContinuationError, SpecialPointKind, StopReason
from ..continuation.switching import switch_branch
from ..continuation.tracing import trace
from ..orbits.orbit import PeriodicOrbit
from .identity import periods_of, repeats, trimmed
from .records import packed_branches

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
        orbits have a shorter period), ``why``, ``failed`` (what raised on the way), ``offers`` (headers of
        orbits on other branches), and the parameter where each leaves.
    """
    elements = payload.get("elements", ())
    branches: list[Branch | None] = []
    found: list[dict] = []
    offered: list[list[PeriodicOrbit]] = []
    for orbit in unpacked(payload["orbits"], payload["arrays"], elements):
        why, offers, at, failed = "", list[PeriodicOrbit](), list[float](), list[str]()
        try:
            branch = _traced(orbit, payload)
        except (ContinuationError, ArithmeticError) as error:
            branch, why = None, str(error)
        if branch is not None:
            failed = [end.message for end in branch.ends if end.reason is StopReason.CALLBACK_FAILED]
            offers, at = _offers(branch, payload["periods"], failed)
        branches.append(branch)
        offered.append(offers)
        found.append({"why": why, "at": at, "failed": failed})
    headers, arrays = packed_branches(branches)
    others, more = packed_points(offered)
    return {"branches": [{"header": header, "offers": those, **mine}
                         for mine, header, those in zip(found, headers, others, strict=True)]}, arrays | more


def _traced(orbit: PeriodicOrbit, payload: Mapping) -> Branch | None:
    """Return the branch of an orbit as far as the orbits keep its least period."""
    periods = orbit.periods
    branch = trace(orbit, payload["parameter"], tuple(payload["bounds"]), **payload["options"],
                   stop=lambda point: point.solution.periods != periods or repeats(point.solution))
    return trimmed(branch, periods)


def _offers(branch: Branch, longest: int, failed: list[str] | None = None) -> tuple[list[PeriodicOrbit], list[float]]:
    """Return orbits on other branches that the special points of a branch lead to, and the parameters where they leave; what raises
    at one is added to ``failed`` and the others are kept."""
    offers: list[PeriodicOrbit] = []
    at: list[float] = []
    most = max(1, longest // periods_of(branch))
    for point in branch.special_points:
        if point.kind not in SWITCHED:
            continue
        try:
            others = switch_branch(point, n_max=most)
        except ERRORS as error:
            if failed is None:
                raise
            failed.append(f"switch_branch at {branch.parameter} = {point.parameter:.9g}: {type(error).__name__}: {error}")
            continue
        for other in others:
            if isinstance(other, PeriodicOrbit) and other.periods <= longest and other.success:
                offers.append(other)
                at.append(point.parameter)
    return offers, at
