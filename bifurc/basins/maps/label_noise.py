"""How many labels the error of the computed motion could change: measured at larger perturbations, extrapolated by its exponent.

The fraction of starts whose label changes under a perturbation e goes like f(e) = C e**alpha with the uncertainty
exponent alpha (Grebogi, McDonald, Ott and Yorke 1983): 1 for smooth boundaries, near 0 where no computation can tell.
"""
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ...content import Content

ROUNDING = 5e-16  # scaled error of a forcing period of the exact kernels, median (measured)
INTEGRATED = 1e-13  # of the smooth engine under laws (measured over ten periods by studies/what_accuracy_costs)
LADDER = tuple(10.0**-k for k in (1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 13.0))  # scaled sizes
SAMPLES = 100, 4000  # least and most starts perturbed at each rung
SHARE = 0.25  # of the work of the map may go into its noise
FEWEST = 10  # changed labels that a rung must have to be fitted, and to go on down the ladder
RUNGS = 8  # of the lower end of the ladder are fitted
SMALL = 0.15  # fractions above it are left out when three are below: they saturate
EXTRA = 0.05  # relative error added to that of counting: the law is no exact power


@dataclass(frozen=True, eq=False)
class LabelNoise(Content):
    """Measured and extrapolated sensitivity of labels.

    Attributes
    ----------
    perturbations, changed : ndarray
        Sizes e of the perturbations (scaled, dimensionless) and fraction of labels that changed, both (k,).
    samples : int
        Starts behind each fraction.
    exponent, exponent_error : float
        Uncertainty exponent and its standard error; 1 and 0 where it could only be assumed.
    at_error : float
        Fraction of labels that a perturbation of ``size`` changes.
    size : float
        Scaled error of a forcing period: 5e-16, rounding, where the motion is exact; that of the integration under smooth laws.
    """

    perturbations: np.ndarray = field(repr=False)
    changed: np.ndarray = field(repr=False)
    samples: int
    exponent: float
    exponent_error: float
    at_error: float
    size: float = ROUNDING

    def to_record(self) -> dict:
        """Return the content as JSON knows it."""
        return {"perturbations": self.perturbations.tolist(), "changed": self.changed.tolist(), "samples": self.samples,
                "exponent": self.exponent, "exponent_error": self.exponent_error, "at_error": self.at_error, "size": self.size}

    @classmethod
    def from_record(cls, record: dict) -> "LabelNoise":
        """Make what `to_record` described."""
        return cls(**{**record, "perturbations": np.array(record["perturbations"], float),
                      "changed": np.array(record["changed"], float)})


def measure(relabel: Callable, starts: np.ndarray, labels: np.ndarray, steps: np.ndarray, rng,
            error: float = ROUNDING) -> LabelNoise:
    """Return the noise of the labels of a sample of starts.

    Parameters
    ----------
    relabel : callable
        Labels (N,) of starts (N, ns); -2 for what is no start.
    starts, labels : ndarray
        The sample, (N, ns) and (N,).
    steps : ndarray
        Change (ns,) of each component that counts as 1; zero for components that are not perturbed.
    rng : numpy.random.Generator
    error : float
        Scaled error of a forcing period, to which the noise is extrapolated.
    """
    n = len(labels)
    sizes, counts = [], []
    for size in LADDER:
        direction = rng.normal(size=starts.shape) * (steps > 0.0)
        direction /= np.linalg.norm(direction, axis=1)[:, None]
        again = relabel(starts + size * direction * steps)
        seen = again != -2  # a perturbed start beyond a stop says nothing
        sizes.append(size)
        counts.append(int(np.count_nonzero((again != labels) & seen)))
        if counts[-1] < FEWEST and len(sizes) > 2:
            break
    e, k = np.array(sizes), np.array(counts, float)
    return extrapolated(e, k, n, error)


def extrapolated(e: np.ndarray, counts: np.ndarray, n: int, error: float = ROUNDING) -> LabelNoise:
    """Return the noise at ``error`` from ``counts`` changed labels of ``n`` at perturbations ``e``."""
    good = np.flatnonzero(counts >= FEWEST)[-RUNGS:]
    changed = counts / n
    if np.count_nonzero(changed[good] <= SMALL) >= 3:
        good = good[changed[good] <= SMALL]
    if good.size >= 3:
        x, y = np.log(e[good]), np.log(changed[good])
        weights = 1.0 / ((1.0 - changed[good]) / counts[good] + EXTRA**2)
        centre = (weights @ x) / weights.sum()
        spread = weights @ (x - centre) ** 2
        slope = (weights @ ((x - centre) * y)) / spread
        level = (weights @ y) / weights.sum()
        slope = min(max(slope, 0.0), 1.0)
        at = np.exp(level + slope * (np.log(error) - centre))
        return LabelNoise(e, changed, n, float(slope), float(spread**-0.5), float(min(at, 1.0)), error)
    if not counts.any():  # no label changed: at most 3 of n at the largest, with 95 % confidence
        return LabelNoise(e, changed, n, 1.0, 0.0, float(3.0 / n * error / e[0]), error)
    last = np.flatnonzero(counts)[-1] if not good.size else good[-1]
    return LabelNoise(e, changed, n, 1.0, 0.0, float(changed[last] * error / e[last]), error)
