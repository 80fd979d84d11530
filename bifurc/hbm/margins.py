"""How far the order of events is from changing: least overshoot of a guard that fires, nearest approach of one that does not.

A pair of events is born where the maximum of a guard along its mode reaches zero.  Before, that maximum is seen as a near
miss; afterwards as the overshoot of the same polynomial beyond the event, had the mode gone on.  Both are smooth in the
parameter and continue each other.
"""
import numpy as np

from .._jit import njit
from .march import GUARD, MODE, arose, guard_of, summit
from .parts import Numbers, Shape
from .waves import size, value

KINDS = 8  # of events, see `elements.EventKind`
COUNT, OVERSHOOT, MISS, FIELDS = 0, 1, 2, 3
FAR = 1.0  # stands for no overshoot and, negative, for no near miss; both are relative to the size of the guard


@njit
def margins(shape: Shape, T: Numbers, k, path, ends, zs, count, c, v, samples, grid, out):
    """Update ``out`` (KINDS, FIELDS): number of events of each kind, least overshoot, largest near miss.

    ``out`` starts as (0, FAR, -FAR) in each row; arguments as `march.exact` leaves them.  Beyond where the listed order of
    events holds, overshoots are negative and misses positive.
    """
    waves, Z = shape.waves, shape.memory[k]
    a = np.empty(waves.size)
    h = 2.0 * np.pi / grid
    start = 0.0
    for n in range(count):
        m, stop = path[n, MODE], ends[n, 0]
        if n < count - 1 and not shape.silent[k, m, path[n, GUARD]]:
            kind = shape.kinds[k, m, path[n, GUARD]]
            out[kind, COUNT] += 1.0
            out[kind, OVERSHOOT] = min(out[kind, OVERSHOOT], arose(shape, T, k, c, v, samples, path, ends, zs, n, a))
        for g in range(shape.guards[k, m]):
            if shape.silent[k, m, g]:
                continue
            kind = shape.kinds[k, m, g]
            guard_of(shape, T, k, m, g, c, v, zs[n, :Z], a)
            bound = size(a)
            # maxima inside the segment; the grid ends on both its ends, but for a segment that passes phase 0
            t, slope = start, value(waves, a, start)[1]
            while t < stop - 1e-9:
                after = min(t + h, stop)
                turn = value(waves, a, after)[1]
                if slope > 0.0 and turn <= 0.0 and t > start:
                    top = max(value(waves, a, t)[0], value(waves, a, after)[0]) if samples \
                        else value(waves, a, summit(waves, a, t, after))[0]
                    if top > out[kind, MISS] * bound:
                        out[kind, MISS] = top / bound
                t, slope = after, turn
        start = stop
