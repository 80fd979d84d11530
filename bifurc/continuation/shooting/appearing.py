"""Where an orbit touches what it does not list: unlisted maxima of guards that are zero, and guards that are zero all along."""
import dataclasses

import numpy as np

from ...orbits.shooting.sequence import AFTER, FOREVER, STARTS

NEAR = 1e-8  # scaled; listed speeds and unlisted maxima this small take part in one graze
ASIDE = 1e-3  # of an interval, from a maximum: where others are looked for
ALL_ALONG = 12  # states at which an orbit without events is looked at: does it touch all along
SHARP = 1e-11  # the same, where a train of impacts has more than one slow impact


def touches(problem, x, near=NEAR):
    """Return (tau, mode, guard, state) of every unlisted maximum that touches its guard at ``x``, to ``near`` (scaled), in order
    of time."""
    e, s, scene = problem.equations, problem.sequence, problem.scene
    T = e.numbers_at(x[-1])
    period = 2.0 * np.pi / T.flat[0]
    found = []
    size = 1 + scene.ns
    joined, P = np.empty(T.A.shape[2]), np.empty((scene.ns, T.A.shape[2]))
    ends = np.append(x[:-1:size], x[0] + s.span)
    for i, node in enumerate(s.nodes):
        mode = int(node[AFTER])
        e.motion.start_of(T, s.nodes, x[:-1], i, P, joined)
        for q in range(int(T.n_guards[mode])):
            if node.size > STARTS and node[STARTS + q] == FOREVER:
                continue
            low = abs(int(node[STARTS + q])) if node.size > STARTS else 0
            row = np.empty(joined.size)
            e.kernel.guard_gradient(T, mode, q, joined, row)
            size = near * e.kernel.scale_of(row, e.weights)
            for at in tops(e, T, mode, q, joined, ends[i] * period, (ends[i + 1] - ends[i]) * period, low, size):
                y = np.empty(scene.ns)
                e.motion.advance(T, mode, joined, at, y)
                found.append((ends[i] + at / period, mode, q, y))
    return sorted(found, key=lambda item: item[0])


def tops(e, T, mode, guard, x, begin, length, low, size):
    """Return the times after ``begin`` of all maxima of a guard that are zero to ``size``, inside an interval from the state ``x``
    (nx,): an orbit that is its own image under reversal of time touches twice at once.

    A guard that is zero over a stretch has one there: what lies beside a maximum is looked at where it is clearly lower.
    """
    value, at = e.kernel.segment_peak(T, mode, guard, x, length, 1, low)
    if not abs(value) <= size:
        return []
    aside, found = ASIDE * length, [at]
    if at > 2.0 * aside and e.kernel.guard_value(T, mode, guard, moved(e, T, mode, x, begin, at - aside)) < -size:
        found = tops(e, T, mode, guard, x, begin, at - aside, low, size) + found
    if length - at > 2.0 * aside:
        after = moved(e, T, mode, x, begin, at + aside)
        if e.kernel.guard_value(T, mode, guard, after) < -size:
            found += [at + aside + later
                      for later in tops(e, T, mode, guard, after, begin + at + aside, length - at - aside, 0, size)]
    return found


def moved(e, T, mode, x, begin, time):
    """Return the joined state (nx,) a time after ``x`` (nx,), which is at the time ``begin``."""
    y, after = np.empty(e.scene.ns), x.copy()
    e.motion.advance(T, mode, x, time, y)
    after[:y.size] = y
    e.motion.forcing(T, begin + time, after)
    return after


def passed_whole(problem, x):
    """Yield (signature, x) without events in every mode behind a guard that an orbit without events touches all along, as the whirl
    of a rotor does in a concentric stator: what touches nowhere first changes mode as a whole."""
    e, s, scene = problem.equations, problem.sequence, problem.scene
    if s.events:
        return
    T, mode, ns = e.numbers_at(x[-1]), int(s.nodes[0, AFTER]), scene.ns
    whole, U = problem._whole(x)
    times = whole.span * np.arange(ALL_ALONG) / ALL_ALONG
    states, joined = np.empty((ALL_ALONG, ns)), np.empty(T.A.shape[2])
    e.motion.states(T, whole.nodes, whole.span, U, times, states)
    for guard in range(int(T.n_guards[mode])):
        sizes = []
        for time, y in zip(times, states, strict=True):
            joined[:ns] = y
            e.motion.forcing(T, time * 2.0 * np.pi / T.flat[0], joined)
            row = np.empty(joined.size)
            e.kernel.guard_gradient(T, mode, guard, joined, row)
            sizes.append(abs(e.kernel.guard_value(T, mode, guard, joined)) / e.kernel.scale_of(row, e.weights))
        if max(sizes) > NEAR:
            continue
        for other in sorted(set(scene.expand(mode, guard).then[mode, guard].tolist()) - {-1, mode}):
            yield dataclasses.replace(s, nodes=np.array([[other, -1, other, 0, 0]])), x
