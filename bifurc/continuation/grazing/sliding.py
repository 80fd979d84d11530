"""Sliding bifurcations at friction events: crossing-, grazing-, switching- and adding-sliding.

The mass sticks where the orbit slides along the switching manifold.  At the event that names the special point the sliding
(sticking) interval

* crossing-sliding: is born where the orbit crosses the manifold at the limit of stick,
* grazing-sliding: is born where sliding on one side touches zero speed,
* switching-sliding: begins at the limit of stick: a short slip to the other side comes before it,
* adding-sliding: touches the limit of stick inside: a slip comes between two pieces of it.

References
----------
M. di Bernardo, C. Budd, A. Champneys, P. Kowalczyk, Piecewise-smooth Dynamical Systems (2008), chapter 8.
"""

import numpy as np

from ...enumerations import DescribedEnum
from ...orbits.shooting import sequence
from ...orbits.shooting.sequence import AFTER, BEFORE, GUARD
from ..kinds import SpecialPointKind
from ..shooting.vanishing import listed_speeds


class SlidingClass(DescribedEnum):
    """Which of the four sliding bifurcations a change of stick and slip is."""

    CROSSING = ("crossing_sliding", "The orbit crosses zero relative speed at the limit of stick: a short stick is "
                                    "born in the reversal.")
    GRAZING = ("grazing_sliding", "The sliding orbit touches zero relative speed: a short stick is born, the sliding "
                                  "goes on in the same direction.")
    SWITCHING = "switching_sliding", "Stick begins at its limit: a short slip to the other side comes before it."
    ADDING = "adding_sliding", "The friction force touches its limit within a stick: a short slip divides it in two."


NEAR = 1e-7  # scaled duration of an interval that vanishes
KINDS = (SpecialPointKind.STICK_ONSET, SpecialPointKind.SLIP_ONSET)


def sliding_class(point) -> SlidingClass | None:
    """Return the class of a stick or slip onset of a branch of periodic orbits; None for other points and elastic sliders."""
    if point.kind not in KINDS or point.problem.sequence is None:
        return None
    problem, x = point.problem, point.x
    if point.name == "leaving":
        return SlidingClass.CROSSING
    if point.name == "listed":
        return _of_vanishing(problem, x)
    return _of_touch(problem, x)


def _sticks(scene, mode, element) -> bool:
    """Whether an element constrains a row in a mode."""
    return any(scene.hold_element(mode, k) == element for k in range(int(scene.tables.n_holds[mode])))


def _of_touch(problem, x):
    """Class of an event that is not listed yet: which mode is touched, and whether at its beginning."""
    scene, s, e = problem.scene, problem.sequence, problem.equations
    info = np.zeros(sequence.INFO)
    e.kernel.monitor(e.numbers_at(x[-1]), s.nodes, s.fixed, s.span, e.closure, x[:-1], e.weights, info)
    at, guard = int(info[sequence.PEAK_SEGMENT]), int(info[sequence.PEAK_GUARD])
    if at < 0:
        return None
    mode = int(s.nodes[at, AFTER])
    element, rows = scene.guard(mode, guard).element, x[:-1].reshape(len(s.nodes), -1)
    if not _sticks(scene, mode, element):
        follows = [m for m in scene.expand(mode, guard).then[mode, guard].tolist() if m >= 0 and m != mode]
        own = s.nodes[at, GUARD] >= 0 and scene.guard(*s.nodes[at, :AFTER].tolist()).element == element
        turns = own and abs(info[sequence.PEAK_TIME] - rows[at, 0]) <= NEAR  # at the instant of the reversal that it begins with
        found = SlidingClass.CROSSING if turns else SlidingClass.GRAZING
        return found if any(_sticks(scene, m, element) for m in follows) else None
    return SlidingClass.SWITCHING if info[sequence.PEAK_TIME] == rows[at, 0] else SlidingClass.ADDING


def _of_vanishing(problem, x):
    """Class of a listed interval that has lost its duration: what it is, and what comes before and after."""
    scene, s = problem.scene, problem.sequence
    speeds = listed_speeds(problem, x)
    for i, (node, speed) in enumerate(zip(s.nodes, speeds, strict=True)):
        if node[GUARD] < 0 or speed is None or abs(speed) > NEAR:
            continue
        before, mode, after = int(s.nodes[i - 1, BEFORE]), int(node[BEFORE]), int(node[AFTER])
        if i == 0 and s.closure < 0:
            before, mode = scene.mirror(before), int(node[BEFORE])
        element = scene.guard(mode, int(node[GUARD])).element
        if _sticks(scene, mode, element):
            if _sticks(scene, before, element) or _sticks(scene, after, element):
                return None
            same = scene.keys[before][element] == scene.keys[after][element]
            return SlidingClass.GRAZING if same else SlidingClass.CROSSING
        both = _sticks(scene, before, element) and _sticks(scene, after, element)
        if both:
            return SlidingClass.ADDING
        return SlidingClass.SWITCHING if _sticks(scene, after, element) else None
    return None
