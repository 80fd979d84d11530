"""Uncertainty exponent: how the fraction of starts whose label a perturbation changes falls with its size.

S. W. McDonald, C. Grebogi, E. Ott, J. A. Yorke, Physica D 17, 125 (1985): f(e) ~ e**alpha; a basin boundary in D dimensions has
the box dimension D - alpha.  The law is fitted to counts; where it does not hold, the error bar is widened by the misfit.
"""
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...content import Content
from ...ensemble.outcomes import NO_START
from ...ensemble.period_map import Kernel, PeriodMap

RANGE = 1e-4, 3e-2  # of perturbations, in units of the states
RUNGS = 6
MANY, SOME = 20000, 4000  # starts, where motions are cheap or not
FEWEST = 5  # changed labels that three rungs must have
ROUNDS = 12  # of iterated weights
CERTAIN = 0.999  # largest fraction of the law


@dataclass(frozen=True, eq=False)
class Uncertainty(Content):
    """Fractions of changed labels, and the power law fitted to them.

    Attributes
    ----------
    perturbations : ndarray
        Sizes e (k,), in units of the grid's components.
    changed : ndarray
        Fraction of the starts (k,) whose label differs from that of a start at distance e.
    samples : int
        Starts behind each fraction.
    exponent, error : float
        Uncertainty exponent and its standard error: counting error, widened by ``misfit`` where that exceeds 1.
    misfit : float
        Root of chi2 per degree of freedom of the power law.
    dimensions : int
        Components that are perturbed.
    """

    perturbations: np.ndarray = field(repr=False)
    changed: np.ndarray = field(repr=False)
    samples: int
    exponent: float
    error: float
    misfit: float
    dimensions: int

    @property
    def boundary_dimension(self) -> float:
        """Box dimension of the basin boundary, dimensions - exponent."""
        return self.dimensions - self.exponent

    def __repr__(self):
        return (f"Uncertainty(exponent {self.exponent:.3f} +- {self.error:.3f}, misfit {self.misfit:.1f}, "
                f"{self.samples} starts at each of {len(self.perturbations)} sizes)")


def uncertainty_exponent(basins: Any, low: float = RANGE[0], high: float = RANGE[1], *, rungs: int = RUNGS,
                         samples: int | None = None, seed: int = 0, workers: int | None = None,
                         executor=None) -> Uncertainty:
    """Return the uncertainty exponent of a basin map, measured on random starts of its region (not on its cells).

    Parameters
    ----------
    basins : BasinMap
    low, high : float
        Smallest and largest perturbation, in units of the grid's components.
    rungs : int
        Sizes between them, evenly spaced in the logarithm.
    samples : int, optional
        Random starts; each is compared with one partner a size, in a random direction.  Default: 20000, where motions are simulated
        one by one 4000.
    seed : int
    workers : int, optional
        Threads; default: one a processor.
    executor : Executor, dask.distributed.Client, function, or None
        Where motions are followed, see `bifurc.sweep`.

    Returns
    -------
    Uncertainty

    Raises
    ------
    ValueError
        Sizes or counts out of range, or a map with no attractor.
    """
    if not (0.0 < float(low) < float(high) < np.inf):
        raise ValueError(f"low = {low!r}, high = {high!r} are not allowed; write sizes 0 < low < high")
    if samples is None:
        samples = SOME if PeriodMap(basins.system).kernel is Kernel.SIMULATION else MANY
    for name, value, least in (("rungs", rungs, 3), ("samples", samples, 1)):
        if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
            raise ValueError(f"{name} = {value!r} is not allowed; it must be a whole number of at least {least}")
    if not basins.attractors:
        raise ValueError(f"{basins!r} has no attractor: its starts have no labels to compare")
    rng = np.random.default_rng([seed, 4])
    relabel = basins.labeller(workers, executor)
    points = rng.uniform(basins.grid.low, basins.grid.high, (samples, len(basins.grid.names)))
    labels = relabel(points)
    points, labels = points[labels != NO_START], labels[labels != NO_START]
    sizes = np.geomspace(low, high, rungs)
    counts, totals = np.zeros(rungs), np.zeros(rungs)
    for k, size in enumerate(sizes):
        away = rng.normal(size=points.shape)
        again = relabel(points + size * away / np.linalg.norm(away, axis=1)[:, None])
        seen = again != NO_START  # a partner beyond a stop says nothing
        counts[k] = np.count_nonzero((again != labels) & seen)
        totals[k] = max(int(np.count_nonzero(seen)), 1)
    return Uncertainty(sizes, counts / totals, len(labels), *fitted(sizes, counts, totals), len(basins.grid.names))


def fitted(sizes: np.ndarray, counts: np.ndarray, totals: np.ndarray) -> tuple[float, float, float]:
    """Return exponent, its error, and the misfit of the power law; (1, 0, 0) when too few labels changed to tell.

    The law is fitted to counts by likelihood (binomial, logarithmic link, iterated weights), which is not biased by small ones.
    """
    if np.count_nonzero(counts >= FEWEST) < 3:
        return 1.0, 0.0, 0.0
    seen = counts > 0
    x, shares = np.log(sizes), counts / totals
    slope, level = np.polyfit(x[seen], np.log(shares[seen]), 1, w=np.sqrt(counts[seen]))
    for _ in range(ROUNDS):
        law = np.minimum(np.exp(level + slope * x), CERTAIN)
        weights = totals * law / (1.0 - law)
        target = np.log(law) + (shares - law) / law
        centre, middle = weights @ x / weights.sum(), weights @ target / weights.sum()
        spread = weights @ (x - centre) ** 2
        slope = weights @ ((x - centre) * (target - middle)) / spread
        level = middle - slope * centre
    law = np.minimum(np.exp(level + slope * x), CERTAIN)
    misfit = float(np.sqrt((totals * (shares - law) ** 2 / (law * (1.0 - law))).sum() / (len(x) - 2)))
    return float(slope), float(spread**-0.5 * max(misfit, 1.0)), misfit
