"""How far the order of events is from changing: least overshoot of a guard that fires, nearest approach of one that does not.

A pair of events is born where the maximum of a guard along its mode reaches zero.  Before, that maximum is seen as a near
miss; afterwards as the overshoot of the same polynomial beyond the event, had the mode gone on.  Both are smooth in the
parameter and continue each other.
"""
import numpy as np

from ..._jit import leaf
from ..residual import arose
from ..tables import GUARDS, KIND, MEMORY, SILENT
from ..waves import size, value
from .common import GUARD, MODE, RESTING, TOUCHED, WRITER, WRITTEN, further, guard_of, resting, virgin, writer
from .event_driven import TURNED, slopes_on, summit

KINDS = 8  # of events, see `elements.EventKind`
COUNT, OVERSHOOT, MISS, FIELDS = 0, 1, 2, 3
FAR = 1.0  # stands for no overshoot and, negative, for no near miss; both are relative to the size of the guard


@leaf
def margins(contact, segments, grid, rates, out, a, line, relaxation):
    """Update ``out`` (KINDS, FIELDS): number of events of each kind, least overshoot, largest near miss.

    ``out`` starts as (0, FAR, -FAR) in each row; ``segments`` as `event_driven.exact` leaves them.
    Beyond where the listed order of events holds, overshoots are negative and misses positive.  The slip that brought a
    contact to where it always sticks counts with its overshoot from a virgin start.  ``rates`` (M, G, grid + 1) are the derivatives
    of guards that `event_driven.exact` left; ``a`` (mi,), ``line`` (grid + 1,) and ``relaxation`` (Z,) are overwritten.
    """
    waves, A = contact.waves, contact.A
    path, ends, zs, source, counts = segments
    samples, cosines, sines, _, _ = grid
    count, Z = counts[0], A[A.shape[0] - 1, 0, MEMORY]
    nodes = cosines.shape[1] - 1
    h = 2.0 * np.pi / nodes
    if count == 1 and source[WRITER] >= 0.0:  # at rest where it slipped last: it would not have, from a virgin start
        m, z = path[0, MODE], relaxation[:Z]
        virgin(contact, z)
        for g in range(A[m, 0, GUARDS]):
            if A[m, 1 + g, SILENT] == 0 and writer(A, m, g) == int(source[WRITER]):
                guard_of(contact, m, g, z, a)
                kind = A[m, 1 + g, KIND]
                out[kind, OVERSHOOT] = min(out[kind, OVERSHOOT], value(waves, a, source[WRITTEN])[0] / size(a))
    start = 0.0
    for n in range(count):
        m, stop = path[n, MODE], ends[n, 0]
        if n < count - 1 and A[m, 1 + path[n, GUARD], SILENT] == 0:
            kind = A[m, 1 + path[n, GUARD], KIND]
            out[kind, COUNT] += 1.0
            out[kind, OVERSHOOT] = min(out[kind, OVERSHOOT], arose(contact, grid, rates, segments, n, a))
        for g in range(A[m, 0, GUARDS]):
            if A[m, 1 + g, SILENT] > 0:
                continue
            kind = A[m, 1 + g, KIND]
            guard_of(contact, m, g, zs[n, :Z], a)
            bound = size(a)
            # maxima inside the segment; the grid ends on both its ends, but for a segment that passes phase 0
            first, last = int(start / h) + 1, int(np.ceil(stop / h - 1e-9))
            if samples:
                slopes_on(waves, a, cosines, sines, first, last, line)
            slopes = line if samples else rates[m, g]
            t, slope = start, value(waves, a, start)[1]  # a guard may be zero where its mode begins: not at phase 0
            for node in range(first, last + 1):
                after = min(node * h, stop)
                turn = slopes[node] if node < last else value(waves, a, stop)[1]
                if slope > 0.0 and (turn <= 0.0 or (node == last and turn < TURNED * bound)) and (t > start or n == 0):
                    high = t if samples and value(waves, a, t)[0] > value(waves, a, after)[0] else after
                    if samples == 0:
                        high = summit(waves, a, t, after, slope, turn)
                    if count == 1 and resting(A, m, g, high, source, 1.5 * h if samples else RESTING):
                        t, slope = after, turn
                        continue
                    top = value(waves, a, high)[0] / bound
                    if source[TOUCHED] > 0.0 and top > -source[TOUCHED] and writer(A, m, g) < 0 and further(A, m, g) < 0:
                        # a touch that was only counted
                        out[kind, OVERSHOOT] = min(out[kind, OVERSHOOT], top)
                    elif top > out[kind, MISS]:
                        out[kind, MISS] = top
                t, slope = after, turn
        start = stop
