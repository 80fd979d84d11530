"""Orbits that branch off at a special point: doubled ones, mirror images, crossing branches, those born at a graze."""
import numpy as np

from ...orbits.least import reduced
from ...orbits.shooting.signature import Signature, repeated
from ...solve.bordered import null_vectors
from ..kinds import CorrectorStatus, SpecialPointKind
from ..problem import Corrected, at_end
from ..steps.branchpoint import other_direction
from ..switched import Switched
from .appearing import inserted
from .autonomous import changed
from .signature_change import admissible_side
from .successor import inside
from .vanishing import dropped

SEPARATE = 1e-6  # scaled difference of the halves of a doubled orbit that has not merged; below `ONE` it is its parent
APART = 1e-3  # of a unit direction, by which the halves come apart along it
TURNED = 0.5  # cosine of two differences of halves of which one has turned into the other
OUT = (1e-3, 1e-4, 1e-2, 1e-5)  # scaled steps to the orbits that are handed out
SECANT, PART = 1e-5, 0.1  # first step of the secant to a flip, scaled, and as part of the distance of the rows beside it, at most
BESIDE = 2.0  # distances of two rows from each other, up to which a point from either lies between them


def halves(signature: Signature, x0, scale, wide):
    """Return (covector (n + 1,), constant) of the measure in which the two halves of a doubled orbit differ, or None.

    It is positive at ``x0`` (n + 1,) and vanishes where the orbit becomes twice an orbit of half the period.  Where it is that to
    rounding, the halves are told apart as along the solutions of ``wide()``, [F_u F_p] (n, n + 1) in scaled unknowns, that leave.
    """
    nodes = signature.nodes
    count = len(nodes) // 2
    if signature.closure < 0 or len(nodes) % 2 or abs(signature.span % 2.0) > 1e-9:
        return None
    if not np.array_equal(nodes[:count], nodes[count:]):
        return None
    difference = half_difference(signature, x0, scale)
    if np.sqrt(difference @ difference) <= SEPARATE:
        plane, _ = null_vectors(wide())
        if len(plane) > 1:
            difference = np.linalg.svd(apart(signature, plane))[2][0]
    norm = np.sqrt(difference @ difference)
    if norm == 0.0:
        return None
    row = difference / (norm * scale[:len(difference)])
    return apart(signature, np.eye(len(x0))) @ row, float(row[::len(row) // count].sum()) * 0.5 * signature.span


def parts(signature: Signature, x, shift: float):
    """Return the unknowns (..., 2, n / 2) of the two halves of a doubled orbit at ``x`` (..., n + 1), each as those of an orbit.

    The second begins ``shift`` later; where the period is unknown it begins at its first event, and each half has a period of its
    own.  Of differences of solutions the shift is 0.
    """
    count = len(signature.nodes) // 2
    rows = np.array(x[..., :-1]).reshape(*x.shape[:-1], 2, count, -1)
    if signature.clock:
        total, middle = rows[..., 0, 0, 0].copy(), rows[..., 1, 0, 0].copy()
        rows[..., 1, :, 0] -= middle[..., None]
        rows[..., 0, 0, 0], rows[..., 1, 0, 0] = middle, total - middle
    else:
        rows[..., 1, :, 0] -= shift
    return rows.reshape(*x.shape[:-1], 2, -1)


def joined(signature: Signature, first, second, shift: float) -> np.ndarray:
    """Return the unknowns (n,) of an orbit of two halves (n / 2,) of a ``signature``, the inverse of `parts`."""
    rows = np.array([first, second]).reshape(2, len(signature.nodes), -1)
    if signature.clock:
        period, later = rows[:, 0, 0]
        rows[1, 0, 0] = 0.0
        rows[1, :, 0] += period
        rows[0, 0, 0] = period + later
    else:
        rows[1, :, 0] += shift
    return rows.ravel()


def apart(signature: Signature, directions):
    """Return the differences (m, n / 2) of the halves along ``directions`` (m, n + 1)."""
    found = parts(signature, directions, 0.0)
    return found[:, 0] - found[:, 1]


def half_difference(signature: Signature, x, scale):
    """Return the scaled difference of the two halves (n / 2,) of a doubled orbit at ``x`` (n + 1,)."""
    found = apart(signature, x[None])[0]
    found[::2 * len(found) // len(signature.nodes)] += 0.5 * signature.span
    return found / scale[:len(found)]


def splitting(signature: Signature, directions):
    """Return those of unit ``directions`` (m, n + 1), scaled unknowns, along which the halves of a doubled orbit come apart."""
    far = np.linalg.norm(apart(signature, directions), axis=1) > APART
    return directions[far] if far.any() else directions


def turned(problem, a, b) -> bool:
    """Whether the difference of the two halves of a doubled orbit has turned between the solutions ``a`` and ``b`` (n + 1,), rather
    than shrunk to nothing and grown again to the other side."""
    one, two = (half_difference(problem.sequence, x, problem.scale) for x in (a, b))
    return float(one @ two) > TURNED * float(np.linalg.norm(one) * np.linalg.norm(two)) > 0.0


def branches(problem, point, n_max: int):
    """Return the audited orbits on the branches that meet at a special point; None for the general rule."""
    if problem.sequence.clock and (point.kind is SpecialPointKind.PERIOD_DOUBLING and not problem.sequence.events
                                   or point.kind is SpecialPointKind.BRANCH_POINT and problem.sequence.closure < 0):
        return Switched((), "the orbits that branch off here are not constructed for an unknown period; simulate beside the point "
                            "and give find_orbit a state of that motion")
    if point.kind is SpecialPointKind.PERIOD_DOUBLING:
        return doubled(problem, point)
    if point.kind is SpecialPointKind.BRANCH_POINT and problem.sequence.closure < 0:
        return symmetry_broken(problem, point)
    if point.kind is SpecialPointKind.BRANCH_POINT and point.directions is not None:
        return crossing(problem, point)
    if point.kind is SpecialPointKind.GRAZING:
        return grazing_orbits(problem, point, n_max)
    return None


def critical(problem, x):
    """Return the null vector (n,), own units, of the Jacobian with multiplier -1."""
    J = problem.wrapped_jacobian(x, -1.0)
    return np.linalg.svd(J * problem.scale[:-1])[2][-1] * problem.scale[:-1]


def stepped_out(problem, x, direction):
    """Return the first audited orbit on the branch through ``x`` in ``direction`` (n + 1,, own units), or None.

    It is given over its least period.
    """
    tangent = direction / problem.scale
    tangent /= np.sqrt(tangent @ tangent)
    for step in OUT:
        c = problem.correct(x + step * problem.scale * tangent, tangent)
        if c.converged and inside(problem, c):
            orbit = problem.solution(c.x)
            if orbit.success:
                return reduced(orbit)  # a doubled orbit may end in its parent, run through twice, where it grazes
    return None


def doubled(problem, point):
    """Return the orbit of twice the period at a flip; a one-tuple, or empty when it is not admissible."""
    s, x = problem.sequence, point.x
    v = critical(problem, x)
    signature = Signature(np.vstack([s.nodes, s.nodes]), np.concatenate([s.fixed, s.fixed + s.span]), 2.0 * s.span, clock=s.clock)
    direction = np.append(joined(s, v, -v, 0.0), 0.0)
    start = np.append(joined(s, x[:-1], x[:-1], s.span), x[-1])
    new = problem.with_sequence(signature, start + 1e-6 * direction)
    orbit = stepped_out(new, start, direction)
    return () if orbit is None else (orbit,)


def merging(problem, a, b, t):
    """Return the corrected point where the doubled orbits between rows ``a`` and ``b`` merge, near the part ``t``; or None.

    It is the flip of the single orbit: secant on its flip test along its own branch, then written out twice.  At fixed parameters
    there may be no single orbit beside the flip: where it grazes an elastic stop next to it, the parameter hardly moves.  What
    lies far from the rows is no point between them.
    """
    s, x = problem.sequence, a.x + t * (b.x - a.x)
    count = len(s.nodes) // 2
    one = Signature(s.nodes[:count], s.fixed[:count], 0.5 * s.span, clock=s.clock)
    single = problem.with_sequence(one, np.append(0.5 * parts(s, x, one.span).sum(axis=0), x[-1]))

    def flip(guess, tangent):
        c = single.correct(guess, tangent)
        return c if c.converged and np.isfinite(c.monitors[0]) else None

    length = float(np.linalg.norm((b.x - a.x) / problem.scale))
    old, step = flip(single.x0, single.null_tangent(single.x0)), min(SECANT, PART * length)
    new = None if old is None else flip(old.x + step * single.scale * old.tangent, old.tangent)
    for _ in range(20):
        if new is None or new.monitors[0] == old.monitors[0]:
            break
        step *= -new.monitors[0] / (new.monitors[0] - old.monitors[0])
        old, new = new, flip(new.x + step * single.scale * new.tangent, new.tangent)
        if new is None or abs(step) <= 4e-16 * (1.0 + abs(new.p) / problem.scale[-1]):
            break
    if new is None:
        return None
    twice = np.append(joined(one, new.x[:-1], new.x[:-1], one.span), new.x[-1])
    if any(np.linalg.norm((twice - row.x) / problem.scale) > BESIDE * length for row in (a, b)):
        return None
    v = critical(single, new.x)
    direction = np.append(joined(one, v, -v, 0.0), 0.0) / problem.scale
    direction /= np.sqrt(direction @ direction)
    if direction @ a.tangent < 0.0:
        direction = -direction
    return Corrected(twice, direction, True, CorrectorStatus.CONVERGED, new.iterations, new.residual, 0.0, 0.0, a.det_sign,
                     a.det_log, at_end(problem, a, problem._merges))


def symmetry_broken(problem, point):
    """Return the two mirror orbits at a pitchfork of a half-period orbit."""
    s, x = problem.sequence, point.x
    v = critical(problem, x).reshape(len(s.nodes), -1)
    whole, U = repeated(problem.scene, s, x[:-1])
    other = v.copy()
    other[:, 0] = -v[:, 0]
    direction = np.append(np.vstack([v, other]).ravel(), 0.0)
    start = np.append(U, x[-1])
    new = problem.with_sequence(whole, start)
    found = [stepped_out(new, start, sign * direction) for sign in (1.0, -1.0)]
    return tuple(orbit for orbit in found if orbit is not None)


def crossing(problem, point):
    """Return the orbits on both sides of the branch that crosses this one at a branch point."""
    direction = other_direction(point.directions, point.tangent) * problem.scale
    found = [stepped_out(problem, point.x, sign * direction) for sign in (1.0, -1.0)]
    return tuple(orbit for orbit in found if orbit is not None)


def grazing_orbits(problem, point, n_max: int):
    """Return the orbits of 1 .. n_max times the period with one more event that are born at a graze."""
    x = point.x
    base = problem
    if point.name == "listed":
        found = changed(dropped, problem, x)
        if found is None:
            return ()
        base = problem.with_sequence(*found)
        x = base.x0
    orbits = []
    for n in range(1, n_max + 1):
        found = changed(inserted, base, x, n)
        if found is None:
            continue
        new = base.with_sequence(*found)
        side = admissible_side(new, new.x0)
        if side is None:
            continue
        orbit = stepped_out(new, new.x0, side * new.scale)
        if orbit is not None:
            orbits.append(orbit)
    return tuple(orbits)
