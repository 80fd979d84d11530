"""How far the order of events is from changing: least overshoot of a guard that fires, nearest approach of one that does not.

A pair of events is born where the maximum of a guard along its mode reaches zero.  Before, that maximum is seen as a near
miss; afterwards as the overshoot of the same polynomial beyond the event, had the mode gone on.  Both are smooth in the
parameter and continue each other.  So is what decides how a contact slips as it closes and opens, see `chosen`.
"""
import numpy as np

from ..._jit import leaf
from ...elements import EventKind
from ..residual import arose
from ..tables import CHOICE, CHOOSES, GUARDS, KIND, MEMORY, SILENT, TRIAL
from ..waves import size, turn, value
from .common import ASKED, GUARD, MODE, RESTING, TOUCHED, WRITER, WRITTEN, back, further, guard_of, resting, virgin, writer
from .event_driven import TURNED, slopes_on, summit

KINDS = 8  # of events, see `elements.EventKind`
COUNT, OVERSHOOT, MISS, FIELDS = 0, 1, 2, 3
STICK, SLIP, SEPARATION = EventKind.STICK.code, EventKind.SLIP.code, EventKind.SEPARATION.code
FAR = 1.0  # stands for no overshoot and, negative, for no near miss; both are relative to the size of the guard


@leaf
def closing(contact, segments, samples, n, a):
    """Return (how far it is from sticking, kind of event) of a contact that closes at event ``n``; ``a`` (mi,) is overwritten.

    Force and limit are both zero there, and the one that grows faster decides: it sticks where the difference of their rates, as
    part of the size of the guard, is negative, and slips at once else.  Among samples it is that of their values at the first one
    behind.  Where the difference changes its sign, it grows or falls behind the event: then it is a stay in stick that has no
    duration, or one in slip.
    """
    A, waves = contact.A, contact.waves
    path, ends, zs, _, _ = segments
    b = A[path[n, MODE], 1 + path[n, GUARD], TRIAL]
    z = zs[n if samples else n + 1, :A[A.shape[0] - 1, 0, MEMORY]]
    top, kind = -FAR, SLIP
    for g in range(A[b, 0, GUARDS]):
        if A[b, 1 + g, KIND] == SLIP:
            guard_of(contact, b, g, z, a)
            height = value(waves, a, ends[n, 0])[0 if samples else 1] / size(a)
            if height > top:
                top, kind = height, STICK if turn(waves, a, ends[n, 0])[1] > 0.0 else SLIP
    return top, kind


@leaf
def opening(contact, segments, n, a):
    """Return (how far it is from slipping the other way, kind of event) of a contact that slips until it opens at event ``n``: up
    negative, down positive; ``a`` (mi,) is overwritten.

    It would stick just before where its force fell faster than its limit, and slip the other way at last: what decides is the
    difference of their rates at the end.  And where it slips out of stick, it does so to the side on which the force of that is at
    the end: over half the time since, it is the same rate where the stick has no duration, but known to less digits.
    """
    A, waves = contact.A, contact.waves
    path, ends, zs, _, counts = segments
    m, stop, Z = path[n, MODE], ends[n, 0], A[A.shape[0] - 1, 0, MEMORY]
    before = earlier(n, counts[0])
    since = stop - ends[earlier(before, counts[0]), 0]
    b = A[m, 1 + back(A, m), TRIAL]
    least, force, turned, bound = FAR, FAR, 0.0, 0.0
    for g in range(A[b, 0, GUARDS]):
        if A[b, 1 + g, KIND] != SLIP:
            continue
        guard_of(contact, b, g, zs[before, :0], a)
        bound = max(bound, size(a))
        if writer(A, b, g) != m:
            turned = -value(waves, a, stop)[1]
            continue
        least = value(waves, a, stop)[1]
        if path[before, MODE] == b:
            guard_of(contact, b, g, zs[before, :Z], a)
            force = 2.0 * value(waves, a, stop)[0] / (since if since > 0.0 else since + 2.0 * np.pi)
    short = 0.5 * turned < force < 1.5 * turned
    kind, other = SEPARATION, turned if short else force
    if least < other or short:
        least, kind = min(least, other), STICK
    else:
        least = other
    return least / bound if A[m, 1 + path[n, GUARD], CHOICE] == 3 else -least / bound, kind


@leaf
def earlier(n, count):
    """Return the stay that ends where stay ``n`` of ``count`` begins; the last of a period and the first are one."""
    return n - 1 if n > 0 else count - 2


@leaf
def chosen(contact, segments, samples, n, a):
    """Return what `closing` or `opening` does, by the choice at event ``n``."""
    if contact.A[segments.path[n, MODE], 1 + segments.path[n, GUARD], CHOICE] == 1:
        return closing(contact, segments, samples, n, a)
    return opening(contact, segments, n, a)


@leaf
def margins(contact, segments, grid, rates, out, a, line, relaxation):
    """Update ``out`` (KINDS, FIELDS): number of events of each kind, least overshoot, largest near miss.

    ``out`` starts as (0, FAR, -FAR) in each row; ``segments`` as `event_driven.exact` leaves them.
    Beyond where the listed order of events holds, overshoots are negative and misses positive.  The slip that brought a
    contact to where it always sticks counts with its overshoot from a virgin start; of contacts that close or open what is
    `chosen`, as many as the order of events tells with their overshoot.  ``rates`` (M, G, grid + 1) are the derivatives
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
    for n in range(count - 1 if A[A.shape[0] - 1, 0, CHOOSES] > 0 else 0):
        choice = A[path[n, MODE], 1 + path[n, GUARD], CHOICE]
        if choice == 0:
            continue
        height, kind = chosen(contact, segments, samples, n, a)
        higher = 0
        for other in range(count - 1):
            rival = A[path[other, MODE], 1 + path[other, GUARD], CHOICE]
            if other != n and min(rival, 2) == min(choice, 2):
                top, _ = chosen(contact, segments, samples, other, a)
                if top > height or (top == height and other < n):
                    higher += 1
        if higher < source[ASKED + min(choice, 2) - 1]:
            out[kind, OVERSHOOT] = min(out[kind, OVERSHOOT], height)
        else:
            out[kind, MISS] = max(out[kind, MISS], height)
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
                    if samples > 0 and node == last and n < count - 1 and g == path[n, GUARD]:  # the event itself, beyond its zero
                        t, slope = after, turn
                        continue
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
