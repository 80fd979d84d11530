"""Infinitely many events in a finite time that no law closes: durations that fall geometrically, and where they end."""
import numpy as np

CYCLE = 8  # events at most after which the same guards fire again
CYCLES = 6  # that must be seen
AGREE = 1e-3  # of the last durations: by so much the ends that they predict may differ


def accumulation(rows: np.ndarray, times: np.ndarray) -> tuple[float, float] | None:
    """Return the time at which the durations between events, listed in ``rows`` (N, 5) of a motion at ``times`` (N,), come to an
    end, and its error; None where they do not fall geometrically.

    Of what the cycles of events predict, by Aitken's rule, the two that differ least are taken: earlier ones are not yet
    geometric, in later ones rounding shows.
    """
    for cycle in range(1, CYCLE + 1):
        count = (len(times) - 1) // cycle - 1
        if count < CYCLES:
            return None
        last = rows[len(rows) - CYCLES * cycle:, :2]
        if not np.array_equal(last[:-cycle], last[cycle:]):
            continue
        ends = times[len(times) - 1 - count * cycle::cycle]
        spans = np.diff(ends)
        first = len(spans) - int(np.argmin(np.append((spans[1:] < spans[:-1])[::-1], False))) - 1  # they fall from here on
        ends, spans = ends[first:], spans[first:]
        if len(spans) < CYCLES or not spans[-1] > 0.0:
            continue
        ratio = spans[1:] / spans[:-1]
        predicted = ends[2:] + spans[1:] * ratio / (1.0 - ratio)
        differ = np.abs(np.diff(predicted))
        best = int(np.argmin(differ))
        if abs(predicted[best + 1] - ends[-1]) <= AGREE * (ends[-1] - ends[0]) and differ[best] <= AGREE * spans[best + 1]:
            end = float(predicted[best + 1])
            return end, float(max(differ[best], len(times) * np.spacing(end)))  # each time is rounded
    return None
