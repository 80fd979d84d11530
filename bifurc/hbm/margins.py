"""How far the order of events is from changing: least overshoot of a guard that fires, nearest approach of one that does not.

A pair of events is born where the maximum of a guard along its mode reaches zero.  Before, that maximum is seen as a near
miss; afterwards as the overshoot of the same polynomial beyond the event, had the mode gone on.  Both are smooth in the
parameter and continue each other.
"""
import numpy as np

from .._jit import njit
from .march import GUARD, MODE, guard_of, summit
from .parts import Numbers, Shape
from .waves import size, value

KINDS = 8  # of events, see `elements.EventKind`
COUNT, OVERSHOOT, MISS, FIELDS = 0, 1, 2, 3
FAR = 1.0  # stands for no overshoot and, negative, for no near miss; both are relative to the size of the guard


@njit
def margins(shape: Shape, T: Numbers, k, path, ends, zs, count, c, v, grid, out):
    """Update ``out`` (KINDS, FIELDS): number of events of each kind, least overshoot, largest near miss (negative).

    ``out`` starts as (0, FAR, -FAR) in each row; arguments as `march.exact` leaves them.
    """
    waves, Z = shape.waves, shape.memory[k]
    a = np.empty(waves.size)
    h = 2.0 * np.pi / grid
    start = 0.0
    for n in range(count):
        m, stop = path[n, MODE], ends[n, 0]
        for g in range(shape.guards[k, m]):
            guard_of(shape, T, k, m, g, c, v, zs[n, :Z], a)
            bound = size(a)
            if bound == 0.0:
                continue
            kind = shape.kinds[k, m, g]
            fired = n < count - 1 and path[n, GUARD] == g
            if fired:
                out[kind, COUNT] += 1.0
                t = stop
                rising = True
                while rising and t < stop + 2.0 * np.pi:
                    t += h
                    rising = value(waves, a, t)[1] > 0.0
                top = value(waves, a, summit(waves, a, max(t - h, stop), t))[0] / bound
                if top < out[kind, OVERSHOOT]:
                    out[kind, OVERSHOOT] = top
            # near misses: maxima inside the segment; a segment that passes phase 0 is looked at in both its parts
            t, slope = start, value(waves, a, start)[1]
            while t < stop:
                after = min(t + h, stop)
                turn = value(waves, a, after)[1]
                if slope > 0.0 and turn <= 0.0:
                    top = value(waves, a, summit(waves, a, t, after))[0] / bound
                    if top > out[kind, MISS]:
                        out[kind, MISS] = top
                t, slope = after, turn
        start = stop
