"""`atlas`: the whole diagram of a forced system over one parameter, as far as starts, branches and switching show it."""
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..checks import COUNT, checked
from ..compose.scene import scene_of
from ..continuation.tracing import handed_on, ordered_bounds
from ..ensemble.region import Region
from ..jobs.executors import check_executor, user_parts
from ..jobs.resumable import replaceable
from ..jobs.store import ChunkStore, finished
from ..system import System, require_values
from .result import Atlas
from .search import Search

PROBES, CHECKS, SAMPLES = 12, 8, 1000
PERIODS = 8  # longest orbits looked for by switching
LONGEST = 32  # longest attractors that are traced
MOST_BRANCHES = 200


@checked(checks=COUNT, trace=None)
def atlas(system: System, parameter: str, bounds, region: Mapping, *, at: Mapping | None = None, probes: int = PROBES,
          checks: int = CHECKS, samples: int = SAMPLES, periods: int = PERIODS, longest: int = LONGEST,
          most_branches: int = MOST_BRANCHES, seed: int = 0, tolerance: float = 1e-4, max_periods: int = 1000,
          max_events: int = 2000, trace: Mapping | None = None, executor=None, workers: int | None = None, file=None) -> Atlas:
    """Return all branches of periodic motions, and the chaotic ones, that a search over a parameter finds.

    Starts in a region, at a few values of the parameter, give attractors, which are confirmed.  Each is traced both ways;
    at every period doubling, branch point and grazing the search switches to the other branches, which are traced as well.
    Where no stable motion is known, and at random values, further starts are tried; what is new is traced again, until a
    whole check gives nothing new.  An orbit that lies on a known branch, up to a shift by forcing periods and the symmetry
    of the system, is not traced again.

    Parameters
    ----------
    system : System
        With an excitation.
    parameter : str
        Name of a float parameter.
    bounds : pair of float
    region : mapping of str to (low, high)
        Components of the starts and their ranges, such as ``{"q0": (-3, 1), "v0": (-4, 4)}``.
    at : mapping of str to float, optional
        Values of other components of the starts.
    probes, checks : int
        Values of the parameter at which starts are tried first, and in each check.
    samples : int
        Starts at each.
    periods : int
        Longest period, in forcing periods, of orbits taken from switching.
    longest : int
        Longest period of attractors that are traced; longer ones are listed.
    most_branches : int
        After so many the search ends, and says so.
    seed : int
        Of the starts and of the values of the checks.
    tolerance, max_periods, max_events
        As for `basins_of_attraction`.
    trace : mapping, optional
        Options of `trace`: ``ds``, ``ds_max``, ``ds_min``, ``max_steps``, ``peaks``, ``audit``, such as ``{"ds_max": 0.02}``.
    executor, workers, file
        As for `sweep`: probes and traces are chunks; after an interrupt the same call computes only what is missing.

    Returns
    -------
    Atlas

    Raises
    ------
    ValueError
        Autonomous system, unknown or whole-number parameter, bad bounds, unknown components, options out of range.

    References
    ----------
    Brute-force and branch-following strategies are combined as in B. Krauskopf, H. M. Osinga, J. Galan-Vioque (eds.),
    Numerical Continuation Methods for Dynamical Systems (2007), ch. 1.

    Examples
    --------
    >>> import bifurc as bf
    >>> found = bf.atlas(bf.systems.impact_oscillator(), "omega", (1.2, 1.6), {"q0": (-3, 1), "v0": (-4, 4)}, probes=3,
    ...                  checks=2, samples=50, periods=1)
    >>> len(found.branches)
    1
    """
    if system.period is None:
        raise ValueError(f"{system!r} is autonomous; an atlas needs the phase of an excitation (omega)")
    parameter = system.parameter_name(parameter)
    system.parameter(parameter)
    low, high = ordered_bounds(bounds)
    if not np.isfinite([low, high]).all():
        raise ValueError(f"bounds = {bounds!r} is not allowed; an atlas needs two finite numbers")
    require_values(system, "bounds", parameter, (low, high))
    box = Region(region, at)
    for value in (low, high):
        box.starts(scene_of(system.with_parameters(**{parameter: value})), 1, 0)
    amplitudes = [f"{name}_{i}" for i in range(system.measured) for name in ("max", "min", "rms", "h1")]
    options = {"probes": _whole("probes", probes), "checks": _whole("checks", checks), "periods": _whole("periods", periods),
               "longest": _whole("longest", longest), "most_branches": _whole("most_branches", most_branches),
               "seed": _whole("seed", seed, 0), "trace": handed_on("atlas", trace, (low, high), amplitudes)}
    if not 0.0 < float(tolerance) <= 0.1:
        raise ValueError(f"tolerance = {tolerance!r} is not allowed; it must be above 0 and at most 0.1")
    check_executor(executor)
    starts = {"seed": options["seed"], "tolerance": float(tolerance), "max_periods": _whole("max_periods", max_periods),
              "max_events": _whole("max_events", max_events)}
    job = {"system": system.to_record(), "elements": user_parts(system), "region": box.to_record(),
           "samples": _whole("samples", samples), "options": starts}
    store = ChunkStore(None if file is None else f"{Path(file)}.chunks",
                       {"what": "atlas", **job, "atlas": options, "bounds": [low, high], "parameter": parameter})
    if file is not None:
        replaceable(file, "atlas")
    ready = finished(file, "atlas", store.key)
    if ready is not None:
        store.clear()
        return Atlas.from_record(*ready, elements=job["elements"])
    search = Search(system, parameter, (low, high), job, options, store, {"executor": executor, "workers": workers})
    search.go()
    found = Atlas.of(search, box)
    if file is not None and not found.failures:
        store.publish(found, file)
    return found


def _whole(name: str, value, least: int = 1) -> int:
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        raise ValueError(f"atlas: {name} = {value!r} is not allowed; it must be a whole number of at least {least}")
    return int(value)
