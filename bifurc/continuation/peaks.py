"""Peaks of a response as special points: zeros of the derivative of a measure along the branch, located and not sampled."""
import numpy as np

from ..checks import either, many, of, word
from ..structure.components import by_number, worded
from .conditions import measure_gradient, null_vector
from .kinds import SpecialPointKind
from .problem import Monitor
from .watching import Watching

FLAT = 1e-12  # slope of a measure along the branch, as part of its gradient, that is rounding


class WithPeaks(Watching):
    """A problem that also watches the slopes of some of its measures along the branch; only maxima are listed.

    Parameters
    ----------
    problem : Problem
    names : tuple of str
        Measures, as in ``problem.measure_names``.
    """

    def __init__(self, problem, names):
        self.peaks = tuple(names)
        super().__init__(problem, (Monitor(SpecialPointKind.PEAK, name, odd=True, falling=True) for name in names))

    def around(self, inner):
        """See `Watching.around`."""
        return WithPeaks(inner, self.peaks)

    def values_at(self, x, tangent):
        """See `Watching.values_at`."""
        return [self._slope(measure_gradient(self.inner, name, x) * self.scale, tangent) for name in self.peaks]

    def _slope(self, gradient, tangent) -> float:
        """Slope of a measure along a tangent; 0 where it is rounding: an orbit that touches its stop has the height of that."""
        slope = float(gradient @ tangent)
        return slope if abs(slope) > FLAT * float(np.linalg.norm(gradient)) else 0.0

    def to_record(self) -> dict:
        """Return the record of the inner problem with the measures watched."""
        return {**self.inner.to_record(), "peaks": list(self.peaks)}

    def values(self, c):
        """See `Watching.values`."""
        tangent = c.tangent
        if not self.inner.exact_tangent and c.det_sign:
            # the corrector's derivative in the parameter may be a rough difference: good for a step, not for a peak
            parts = self.inner.jacobian(c.x[:-1], float(c.x[-1]))
            wide = np.column_stack([np.reshape(part, (self.inner.size, -1)) for part in parts])
            if np.isfinite(wide).all():
                fresh, _, _ = null_vector(wide, self.scale)
                tangent = fresh if float(fresh @ c.tangent) > 0.0 else -fresh
        return self.values_at(c.x, tangent)


def with_peaks(problem, peaks):
    """Return ``problem`` watching ``peaks`` (None, a name, or names of measures).

    Raises
    ------
    ValueError
        Naming a measure that the problem does not have.
    """
    states = getattr(problem, "states", ())
    known = (*problem.measure_names, *(by_number(name, states) for name in problem.measure_names if states))
    names = tuple(worded(name, states) for name in checked_peaks(peaks, known))
    return WithPeaks(problem, names) if names else problem


def checked_peaks(peaks, measures) -> tuple[str, ...]:
    """Return the names of ``peaks`` (None, a name, or several), or raise ValueError: amplitudes among ``measures``."""
    kind = either(word, of(many, of=word), allowed="the name of a measure, or several")
    found = () if peaks is None else kind("", "peaks", peaks)
    names = (found,) if isinstance(found, str) else tuple(found)
    good = [key for key in measures if key not in UNORDERED and not key.startswith("multiplier")]
    for name in names:
        if name not in good:
            raise ValueError(f"peaks = {name!r} is no amplitude measure of this branch; there are {', '.join(good)}")
    return names


UNORDERED = ("stable", "n_events", "period")
