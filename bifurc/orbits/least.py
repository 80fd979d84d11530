"""The least period of an orbit, and its half where the other half mirrors it."""
from collections.abc import Callable

import numpy as np

from ..compose.scene import Scene
from .kinds import OrbitStatus
from .orbit import PeriodicOrbit
from .repetition import middles
from .shooting.sequence import AFTER, BEFORE, CLOSES, DIVIDE, ENDING, GUARD, TOGETHER
from .shooting.signature import Signature, divided, repeated, sections
from .solving import solve

SAME = 1e-8  # scaled difference of repeated halves, thirds, ... of an orbit
LONG = 1e-2  # forcing periods: intervals in whose middles motions are compared, and not the last flights of a chattering
GEOMETRIC = 1.25  # ratio of the factors by which speeds fall from impact to impact, up to which they are one sequence


def mark_trains(nodes, speeds):
    """Mark (CLOSES 2) the impacts that lead to the end of a complete chattering: none of them can graze.

    Their speeds fall, each by nearly the same factor as the next: an impact before them, out of the geometric sequence, may become
    a graze along a branch, however fast it is here.  Between two of them another element may have an event, as friction does where
    the speed turns, or several of one instant: they are marked too.
    """
    count = len(nodes)
    for end in np.flatnonzero(nodes[:, CLOSES] == 1):
        at, factor = end, None
        for _ in range(count - 1):
            between = before = first = (at - 1) % count
            while nodes[first, DIVIDE] == TOGETHER and first != end:
                first = (first - 1) % count
            if nodes[between, AFTER] == nodes[end, BEFORE] != nodes[first, BEFORE]:
                before = (first - 1) % count
            if nodes[before, GUARD] != nodes[end, GUARD] or nodes[before, BEFORE] != nodes[end, BEFORE] \
                    or speeds[before] <= speeds[at] or nodes[before, CLOSES] or nodes[between, CLOSES]:
                break
            own = speeds[at] / speeds[before]
            if factor and not factor / GEOMETRIC < own < factor * GEOMETRIC:
                break
            nodes[(before + np.arange((between - before) % count + 1)) % count, CLOSES] = 2
            at, factor = before, own


def reduced(orbit: PeriodicOrbit) -> PeriodicOrbit:
    """Return the orbit over its least period."""
    s = orbit.sequence
    n = round(s.span)
    if s.closure < 0 or n == 1:
        return orbit
    for k in range(1, n):
        if n % k:
            continue
        found = repeating(orbit, k)
        if found is not None:
            nodes, rows = found
            how = {**orbit.how, "note": f"repeats after {k} of {n} periods and was reduced"}
            less = Signature(divided(orbit.scene, nodes), s.fixed[:len(nodes)], float(k))
            return solve(orbit.system, less, rows.ravel(), orbit.weights, how)
    return orbit


def repeating(orbit: PeriodicOrbit, k: int):
    """Return the nodes and rows of ``k`` forcing periods of an orbit that repeats after them; None where it does not.

    How many impacts of a complete chattering are listed is a matter of accuracy, and may differ from one repetition to the next:
    then the motions are compared, and one of them is listed from an event that both have.
    """
    s, ns = orbit.sequence, orbit.scene.ns
    if s.events == 0:
        y0, y1 = orbit._states(np.array([0.0, float(k)]))
        same = np.abs((y1 - y0) / orbit.weights).max() < SAME
        return (s.nodes[:1], orbit.unknowns[None, :1 + ns]) if same else None
    total, rows = len(s.nodes), orbit.unknowns.reshape(len(s.nodes), -1)
    count, rest = divmod(total * k, round(s.span))
    scale, shift = np.append(1.0, orbit.weights), np.append(float(k), np.zeros(ns))
    if not rest and np.array_equal(s.nodes[:-count], s.nodes[count:]):
        same = np.abs((rows[count:] - shift - rows[:-count]) / scale).max() < SAME
        return (s.nodes[:count], rows[:count]) if same else None
    if not np.any(s.nodes[:, CLOSES] == 1):
        return None
    at, spans = middles(orbit)
    at = at[spans > LONG]
    if not np.abs((orbit._states(at + k) - orbit._states(at)) / orbit.weights).max(initial=0.0) < SAME:
        return None
    nodes, rows = np.vstack([s.nodes, s.nodes]), np.vstack([rows, rows + np.append(s.span, np.zeros(ns))])
    for begin in range(total):
        end = begin + int(np.count_nonzero(rows[begin:, 0] < rows[begin, 0] + k - SAME))
        if (end < len(rows) and nodes[begin, DIVIDE] != TOGETHER and np.array_equal(nodes[begin, :AFTER], nodes[end, :AFTER])
                and np.abs((rows[end] - shift - rows[begin]) / scale).max() < SAME):
            return nodes[begin:end, :ENDING], rows[begin:end] - np.append(k * np.floor(rows[begin, 0] / k), np.zeros(ns))
    return None


def closed(orbit: PeriodicOrbit, closure: int | None, halved: Callable) -> PeriodicOrbit:
    """Return the orbit solved with the closure asked for; ``halved(orbit)`` is its half, or None where there is none."""
    if closure != 1 and orbit.system.symmetry == -1 and orbit.closure == 1:
        half = halved(orbit)
        if half is not None:
            return half
    if closure == -1 and orbit.closure == 1:
        return PeriodicOrbit(orbit.system, orbit.sequence, orbit.unknowns, orbit.weights, orbit.how, OrbitStatus.NOT_SYMMETRIC)
    return orbit


def halved(orbit: PeriodicOrbit) -> PeriodicOrbit | None:
    """Return the orbit solved on its half period with y -> -y, or None when it has not this symmetry."""
    s = orbit.sequence
    if round(s.span) % 2 == 0 or len(s.nodes) % 2 and s.events:
        return None
    y0, y1 = orbit._states(np.array([0.0, 0.5 * s.span]))
    if np.abs((y1 + y0) / orbit.weights).max() > SAME:
        return None
    if np.any(s.nodes[:, GUARD] < 0) and s.events:
        return None
    made = half_of(orbit.scene, s, orbit.unknowns)
    if made is None:
        return None
    half, rows = made
    found = solve(orbit.system, half, rows.ravel(), orbit.weights, orbit.how)
    return found if found.success else None


def half_of(scene: Scene, whole: Signature, unknowns) -> tuple[Signature, np.ndarray] | None:
    """Return the signature of the half period and its unknowns, where the second half is the mirror image of the first.

    It begins at an event that does not coincide with the one before it.
    """
    rows = np.reshape(unknowns, (len(whole.nodes), -1))
    if not whole.events:
        return sections(int(whole.nodes[0, AFTER]), 0.5 * whole.span, -1), rows
    count = len(rows) // 2
    if len(rows) % 2 or count == 0:
        return None
    later = rows.copy()
    later[:, 0] += whole.span
    nodes, rows = np.vstack([whole.nodes, whole.nodes]), np.vstack([rows, later])
    for k in range(count):
        own = nodes[k:k + count, :ENDING].copy()
        half = Signature(own, np.zeros(count), 0.5 * whole.span, -1)
        image = repeated(scene, half, rows[k:k + count].ravel())[0].nodes[count:]
        if not np.array_equal(image[:, :AFTER + 1], nodes[k + count:k + 2 * count, :AFTER + 1]):
            return None
        half = Signature(divided(scene, own, closure=-1), np.zeros(count), 0.5 * whole.span, -1)
        if half.nodes[0, DIVIDE] != TOGETHER:
            found = rows[k:k + count].copy()
            found[:, 0] -= np.floor(found[0, 0] / whole.span) * whole.span
            return half, found
    return None
