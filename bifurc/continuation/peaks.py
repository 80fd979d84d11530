"""Peaks of a response as special points: zeros of the derivative of a measure along the branch, located and not sampled."""
import numpy as np

from .conditions import measure_gradient, null_vector
from .kinds import SpecialPointKind
from .problem import Corrected, Monitor


class WithPeaks:
    """A problem that also watches the slopes of some of its measures along the branch.

    It passes everything on to the problem it stands for and adds one monitor a measure; only maxima are listed.

    Parameters
    ----------
    problem : Problem
    names : tuple of str
        Measures, as in ``problem.measure_names``.
    """

    def __init__(self, problem, names):
        self.inner, self.peaks = problem, tuple(names)
        self.monitors = (*problem.monitors, *(Monitor(SpecialPointKind.PEAK, name, odd=True, falling=True) for name in names))

    def __getattr__(self, name):
        if name.startswith("__") or name == "inner":
            raise AttributeError(name)
        return getattr(self.inner, name)

    def __copy__(self):
        import copy

        return WithPeaks(copy.copy(self.inner), self.peaks)

    @property
    def scale(self):
        """Natural sizes (n + 1,) of unknowns and parameter."""
        return self.inner.scale

    @scale.setter
    def scale(self, value):
        self.inner.scale = value

    def correct(self, x, tangent, fixed=False) -> Corrected:
        """See `Problem.correct`."""
        c = self.inner.correct(x, tangent, fixed)
        if c.converged:
            c.monitors = np.append(c.monitors, self._slopes(c))
        return c

    def monitor_values(self, u, p, tangent):
        """See `Problem.monitor_values`."""
        x = np.append(u, p)
        slopes = [float(measure_gradient(self.inner, name, x) * self.scale @ tangent) for name in self.peaks]
        return np.append(self.inner.monitor_values(u, p, tangent), slopes)

    def switch(self, point, monitor):
        """See `Problem.switch`; the watch goes on behind the boundary."""
        inner = Corrected(*(getattr(point, name) for name in Corrected.__slots__))
        inner.monitors = point.monitors[:len(self.inner.monitors)]
        answer = self.inner.switch(inner, monitor)
        return (WithPeaks(answer[0], self.peaks), *answer[1:]) if isinstance(answer, tuple) else answer

    def restarted(self, x):
        """See `Problem.restarted`."""
        return WithPeaks(self.inner.restarted(x), self.peaks)

    def bounded(self, low, high, made):
        """See `Problem.bounded`."""
        inner = self.inner.bounded(low, high, made)
        return self if inner is self.inner else WithPeaks(inner, self.peaks)

    def same(self, other) -> bool:
        """See `Problem.same`."""
        return isinstance(other, WithPeaks) and self.inner.same(other.inner)

    def to_record(self) -> dict:
        """Return the record of the inner problem with the measures watched."""
        return {**self.inner.to_record(), "peaks": list(self.peaks)}

    def _slopes(self, c):
        tangent = c.tangent
        if not getattr(self.inner, "exact_tangent", False) and c.det_sign:
            # the corrector's derivative in the parameter may be a rough difference: good for a step, not for a peak
            parts = self.inner.jacobian(c.x[:-1], float(c.x[-1]))
            wide = np.column_stack([np.reshape(part, (self.inner.size, -1)) for part in parts])
            if np.isfinite(wide).all():
                fresh, _, _ = null_vector(wide, self.scale)
                tangent = fresh if float(fresh @ c.tangent) > 0.0 else -fresh
        return [float(measure_gradient(self.inner, name, c.x) * self.scale @ tangent) for name in self.peaks]


def with_peaks(problem, peaks):
    """Return ``problem`` watching ``peaks`` (None, a name, or names of measures).

    Raises
    ------
    ValueError
        Naming a measure that the problem does not have.
    """
    names = () if peaks is None else ((peaks,) if isinstance(peaks, str) else tuple(peaks))
    if not names:
        return problem
    for name in names:
        if name not in problem.measure_names or name in UNORDERED or name.startswith("multiplier"):
            good = [key for key in problem.measure_names if key not in UNORDERED and not key.startswith("multiplier")]
            raise ValueError(f"peaks = {name!r} is no amplitude measure of this branch; there are {', '.join(good)}")
    return WithPeaks(problem, names)


UNORDERED = ("stable", "n_events", "period")
