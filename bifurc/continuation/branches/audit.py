"""Checks of a finished branch that do not trust the way it was made."""
from dataclasses import dataclass

import numpy as np

from ...content import Content
from ...solve.steplaw import BOUNDARY_BAND
from ..kinds import StopReason
from ..resimulation import Resimulated, resimulated
from .retraced import retraced
from .truncated import truncated

EDGES = (0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35)  # radians


@dataclass(frozen=True, eq=False)
class Audit(Content):
    """Checks of a branch.

    Attributes
    ----------
    parity : bool
        Between any two rows the parameter turns back as often, modulo two, as reversing special points are listed.
    violations : tuple of (float, float)
        Arclength intervals where it does not.
    angles : ndarray (7,)
        How many steps turned by how much, in bins of .05 radians.
    n_points, n_rejected : int
    worst_residual : float
        In units of the residual.
    unresolved : tuple of (str, float, float)
        Kind, arclength and parameter of pairs of special points that cannot be told from none.
    retraced : tuple of (float, float)
        Arclengths of rows that lie on an earlier stretch of the branch in state and parameter, and of the place there: it runs
        back, or round once more. The last row of a closed branch is none of them.
    truncated : tuple of (float, float, int or None)
        Arclength intervals between rows of harmonic balance over which `stable` changes without a special point, because folds and
        multipliers of few harmonics differ, and the highest harmonic that would decide (None: more than four times as many).
    failed : tuple of str
        What functions of the caller did that ended the branch.
    resimulated : Resimulated or None
        Rows simulated again over their period, and multipliers balanced with the special points; None for ``audit="fast"``.
    """

    parity: bool
    violations: tuple[tuple[float, float], ...]
    angles: np.ndarray
    n_points: int
    n_rejected: int
    worst_residual: float
    unresolved: tuple[tuple[str, float, float], ...]
    retraced: tuple[tuple[float, float], ...] = ()
    truncated: tuple[tuple[float, float, int | None], ...] = ()
    failed: tuple[str, ...] = ()
    resimulated: Resimulated | None = None

    @property
    def ok(self) -> bool:
        """Whether nothing speaks against the list of special points, no row repeats another one, stability is decided, no function
        of the caller failed, and every row that was simulated again is a motion."""
        again = self.resimulated
        told = self.parity and not (self.unresolved or self.retraced or self.truncated or self.failed)
        return told and (again is None or not (again.not_repeated or again.unexplained))

    def __repr__(self) -> str:
        verdict = "ok" if self.ok else f"{len(self.violations)} parity violations, {len(self.unresolved)} unresolved"
        if self.retraced:
            verdict += f", {len(self.retraced)} rows on an earlier stretch"
        if self.truncated:
            most = max((harmonics or 0 for *_, harmonics in self.truncated), default=0)
            verdict += (f", stability changes {len(self.truncated)} times without a special point: give "
                        f"{'more' if None in [k for *_, k in self.truncated] else most} harmonics")
        verdict += "".join(f", {text}" for text in self.failed)
        again = self.resimulated
        if again is not None and not self.ok:
            verdict += f", {len(again.not_repeated)} rows not repeated, {len(again.unexplained)} changes of multipliers unexplained"
        simulated = "" if again is None or not again.rows else f", {again.rows} rows simulated again in {again.seconds:.2g} s"
        return (f"Audit({verdict}, {self.n_points} points, {self.n_rejected} rejected, "
                f"worst residual {self.worst_residual:.1e}{simulated})")


def audit_branch(branch, arrays) -> Audit:
    """Audit a branch from its arrays."""
    points = branch.special_points
    violations = parity_violations(arrays["s"], told_slopes(arrays, points), arrays["part"], points, branch.problems)
    bins = np.searchsorted(EDGES, np.minimum(arrays["angle"], EDGES[-1] - 1e-12), "right") - 1
    angles = np.bincount(bins, minlength=len(EDGES) - 1)
    failed = tuple(dict.fromkeys(end.message for end in branch.ends if end.reason is StopReason.CALLBACK_FAILED))
    fast = branch.options.get("audit") == "fast"
    again = None if fast else resimulated(branch, arrays)
    undecided = () if fast else truncated(branch)
    return Audit(not violations, violations, angles, arrays["s"].size, sum(end.rejected for end in branch.ends),
                 float(arrays["residual"].max()), branch.unresolved, retraced(branch, arrays), undecided, failed,
                 again)


def told_slopes(arrays, points):
    """Return dp/ds of the rows, zero where it tells nothing.

    Where a contact is born at speed zero the equations are singular on the boundary itself: the tangent of the row that lies
    there is rounding, and its slope counts only where the chord to the next row of the same equations has its sign. A row that is
    the only one of its equations has none.  The ends of the branch are such rows where one of its special ``points`` is there.
    """
    slope, part, p, s = arrays["slope"].copy(), arrays["part"], arrays["parameter"], arrays["s"]
    same = part[1:] == part[:-1]
    chords = np.where(same & (s[1:] > s[:-1]), p[1:] - p[:-1], 0.0)
    ends = [any(point.s == at for point in points) for at in (s[0], s[-1])]
    first, last = np.flatnonzero(np.append(ends[0], ~same)), np.flatnonzero(np.append(~same, ends[1]))
    for rows, beside in ((first, np.append(chords, 0.0)[first]), (last, np.append(0.0, chords)[last])):
        slope[rows[slope[rows] * beside <= 0.0]] = 0.0
    return slope


def parity_violations(s, slope, part, points, problems):
    """Return the intervals between clear values of dp/ds whose sign changes do not match the reversing points."""
    clear = np.flatnonzero(np.abs(slope) > BOUNDARY_BAND)
    if clear.size < 2:
        return ()
    left, right = clear[:-1], clear[1:]
    turned = np.sign(slope[left]) != np.sign(slope[right])
    counts = np.zeros(left.size, int)
    index = {id(problem): k for k, problem in enumerate(problems)}
    for point in points:
        if not point.reverses:
            continue
        before = s < point.s
        if point.successor is not None:  # two rows lie on a boundary, one on either side of the point
            before |= (s == point.s) & (part < max(index[id(point.problem)], index[id(point.successor)]))
        k = int(np.searchsorted(clear, np.count_nonzero(before))) - 1
        if 0 <= k < left.size:
            counts[k] += 1
    wrong = np.flatnonzero((counts % 2 == 1) != turned)
    return tuple((float(s[left[k]]), float(s[right[k]])) for k in wrong)
