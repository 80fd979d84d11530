"""Where branches are stable, where nothing stable is known, and how many stable motions coexist."""
from collections.abc import Sequence

import numpy as np

from ..continuation.branches.branch import Branch


def stable_intervals(branch: Branch) -> list[tuple[float, float]]:
    """Return the intervals of the parameter over which a branch is stable, one a stretch; they end at special points."""
    s, p = branch.column("s"), branch.column("parameter")
    stable = np.array([value == 1 for value in branch.column("stable")])
    marks = sorted((point.s, point.parameter) for point in branch.special_points)
    found: list[tuple[float, float]] = []
    i = 0
    while i < len(s):
        if not stable[i]:
            i += 1
            continue
        k = i
        while k + 1 < len(s) and stable[k + 1]:
            k += 1
        inside = [float(p[j]) for j in range(i, k + 1)]
        inside += [at for where, at in marks if s[i] <= where <= s[k]]
        before, after = s[i - 1] if i else -np.inf, s[k + 1] if k + 1 < len(s) else np.inf
        inside += [at for where, at in marks if before <= where <= s[i]][-1:]
        inside += [at for where, at in marks if s[k] <= where <= after][:1]
        found.append((min(inside), max(inside)))
        i = k + 1
    return found


def gaps(intervals: Sequence[tuple[float, float]], low: float, high: float) -> list[tuple[float, float]]:
    """Return the parts of [low, high] that no interval covers."""
    found, at = [], low
    for a, b in sorted(intervals):
        if a > at:
            found.append((at, min(a, high)))
        at = max(at, b)
        if at >= high:
            break
    if at < high:
        found.append((at, high))
    return found


def layers(intervals: Sequence[tuple[float, float, int]], low: float, high: float) -> list[tuple[float, float, tuple[int, ...]]]:
    """Return the parts of [low, high] with what covers each: (from, to, numbers), in order; numbers repeat where one folds over."""
    edges = sorted({low, high, *(min(max(v, low), high) for a, b, _ in intervals for v in (a, b))})
    found: list[tuple[float, float, tuple[int, ...]]] = []
    for a, b in zip(edges, edges[1:], strict=False):
        middle = 0.5 * (a + b)
        mine = tuple(sorted(number for x, y, number in intervals if x <= middle <= y))
        if found and found[-1][2] == mine:
            found[-1] = (found[-1][0], b, mine)
        else:
            found.append((a, b, mine))
    return found
