"""Deflation: solutions that are known are divided out, so that Newton's method from the same start ends on others.

With known solutions r_i, Newton's method on M(u) F(u), M = product of (1 + |u - r_i|^-2), does not come back to them.  Its step is
that of F times tau = 1 / (1 - grad(log M) . step), so that nothing but the length of the step changes
(P. E. Farrell, A. Birkisson, S. W. Funke, SIAM J. Sci. Comput. 37 (2015) A2026).

Isolated branches (isolas) of a response are found so, or by following the fold of another value of a second parameter, whose curve
bounds them.
"""
import numpy as np

from ..checks import EQUATIONS, ORBIT, UNKNOWNS, array, checked, many, number, of, refused, state
from ..orbits.find import find_orbit
from ..orbits.forced import period_map
from ..orbits.standing import resting_start
from .curves.tracing import trace_curve
from .kinds import CorrectorStatus, SpecialPointKind

STEPS = 60
CLOSE = 1e-9  # scaled step with which Newton's method has arrived
APART = 1e-6  # scaled distance of different solutions
LONGEST = 1.0  # scaled step


class Deflation:
    """What is divided out.

    Parameters
    ----------
    scale : ndarray (n,)
        Natural sizes of the unknowns.
    known : iterable of ndarray (n,)
    """

    def __init__(self, scale, known=()):
        self.scale = np.asarray(scale, float)
        self.known = [np.array(u, float) for u in known]

    def add(self, u) -> None:
        """Divide out one more."""
        self.known.append(np.array(u, float))

    def has(self, u) -> bool:
        """Whether a solution is known."""
        return any(np.linalg.norm((u - r) / self.scale) <= APART for r in self.known)

    def length(self, u, step) -> float:
        """Return the factor tau of a Newton step (n,) at ``u``."""
        slope = 0.0
        for r in self.known:
            d = (u - r) / self.scale
            square = float(d @ d)
            if square == 0.0:
                return 1.0
            slope += -2.0 * float(d @ (step / self.scale)) / (square * (square + 1.0))
        return 1.0 / (1.0 - slope) if slope != 1.0 else LONGEST


def newton(equations, u, deflation):
    """Return the solution (n,) that deflated Newton steps lead to, or None; ``equations(u) -> (step, scale)`` or None."""
    for _ in range(STEPS):
        step = equations(u)
        if step is None or not np.isfinite(step).all():
            return None
        size = float(np.linalg.norm(step / deflation.scale))
        if size <= CLOSE:
            return u + step
        step = step * deflation.length(u, step)
        size = float(np.linalg.norm(step / deflation.scale))
        u = u + step * min(1.0, LONGEST / size)
    return None


@checked(problem=EQUATIONS, p=number, known=of(many, of=UNKNOWNS), starts=of(many, of=UNKNOWNS))
def deflated_solutions(problem, p=None, known=(), starts=(), most: int = 12) -> tuple:
    """Return further solutions of a problem at one value of its parameter, as problems that `trace` takes.

    Parameters
    ----------
    problem : Problem
        Of one branch; its own start counts as known where it solves the equations.
    p : float, optional
        Value of the parameter; default that of the problem's start.
    known : iterable of ndarray (n,)
        Solutions at ``p``.
    starts : iterable of ndarray (n,)
        Guesses; the known solutions and the origin are tried too.
    most : int
        Largest number of solutions returned.

    Examples
    --------
    >>> from bifurc.continuation import Problem
    >>> from bifurc.continuation.deflation import deflated_solutions
    >>> class Cubic(Problem):
    ...     def residual(self, u, p):
    ...         return u**3 - u - p
    >>> found = deflated_solutions(Cubic(1.2, 0.1), known=[[1.0466805318046]])
    >>> len(found)
    2
    """
    p = float(problem.x0[-1] if p is None else p)
    scale = np.where(np.isfinite(problem.scale[:-1]), problem.scale[:-1], 1.0)
    known, starts = ([np.atleast_1d(u) for u in given] for given in (known, starts))
    for u in (*known, *starts):
        if u.size != scale.size:
            raise refused("deflated_solutions", "known and starts", u, f"lists of solutions of {scale.size} numbers")
    deflation = Deflation(scale, known)

    def step(u):
        with np.errstate(all="ignore"):
            f = np.reshape(np.asarray(problem.residual(u, p), float), u.size)
            J = np.reshape(np.asarray(problem.jacobian(u, p)[0], float), (u.size, u.size)) * scale
            if not (np.isfinite(f).all() and np.isfinite(J).all()):
                return None
            return -np.linalg.lstsq(J, f, rcond=1e-13)[0] * scale
    own = newton(step, problem.x0[:-1].copy(), Deflation(scale))
    if own is not None and not deflation.has(own):
        deflation.add(own)
    guesses = starts + [u * (1.0 + 1e-3) + 1e-3 * scale for u in deflation.known]
    guesses.append(1e-3 * scale)
    found: list = []
    for guess in guesses:
        while len(found) < most:
            u = newton(step, guess.copy(), deflation)
            if u is None or deflation.has(u):
                break
            fixed = np.zeros(u.size + 1)
            fixed[-1] = 1.0
            c = problem.correct(np.append(u, p), fixed, True)
            if not c.converged or c.status is CorrectorStatus.SINGULAR:
                break
            deflation.add(c.x[:-1])
            found.append(problem.restarted(c.x))
    return tuple(found)


@checked(known=of(many, of=ORBIT), starts=of(many, of=array))
def deflated_orbits(system, known=(), periods: int = 1, starts=None, most: int = 8) -> tuple:
    """Return further periodic orbits of a forced system, found by deflated Newton steps on the map over some periods.

    Parameters
    ----------
    system : System
    known : iterable of PeriodicOrbit
        Orbits of this system; every section point of theirs is divided out.
    periods : int
        Forcing periods after which the orbits close.
    starts : iterable of array_like (ns,), optional
        Guesses at phase 0; default a few rings about the known orbits, or about rest.
    most : int
        Largest number of orbits returned.

    Returns
    -------
    tuple of PeriodicOrbit
        Audited motions of the system, none of them known.
    """
    known = list(known)
    points = [point for orbit in known for point in sections(orbit)]
    first = period_map(system, resting_start(system), 1, False)
    if first is None and not points:
        return ()
    weights = known[0].weights if known else first[3]
    deflation = Deflation(weights, points)

    def step(y):
        mapped = period_map(system, y, periods, False)
        if mapped is None:
            return None
        _, gap, M, size = mapped
        return np.linalg.lstsq((np.eye(y.size) - M) * size, gap, rcond=1e-11)[0] * size
    guesses = rings(points or [np.asarray(resting_start(system), float)], weights) if starts is None else \
        [state("starts", y, (weights.size,)) for y in starts]
    found: list = []
    for guess in guesses:
        if len(found) >= most:
            break
        y = newton(step, np.array(guess, float), deflation)
        if y is None or deflation.has(y):
            continue
        orbit = find_orbit(system, guess=y, periods=periods)
        if orbit.success and not deflation.has(orbit.state):
            found.append(orbit)
            for point in sections(orbit):
                deflation.add(point)
    return tuple(found)


def sections(orbit) -> list:
    """Return the states of an orbit at the beginnings of its forcing periods."""
    times = np.arange(orbit.periods, dtype=float)
    return list(orbit._states(times))


def rings(points, weights, radii=(0.3, 1.0, 2.0), count=8):
    """Yield guesses around points in the plane of the first coordinate and its velocity, in natural sizes."""
    n = points[0].size // 2
    for radius in radii:
        for point in points:
            for angle in 2.0 * np.pi * np.arange(count) / count:
                guess = np.array(point, float)
                guess[0] += radius * weights[0] * np.cos(angle)
                guess[n] += radius * weights[n] * np.sin(angle)
                yield guess


@checked(bounds=None)
def isolas(point, second: str, value: float, bounds) -> tuple:
    """Return starts on the branches that a fold bounds at another value of a second parameter.

    The fold is followed in both parameters; wherever its curve reaches ``value`` lies an end of a branch, also of one that no
    other branch meets.

    Parameters
    ----------
    point : SpecialPoint
        A fold, or a grazing, of a branch of orbits or of a `Problem` at a value of ``second`` where the branches are joined.
    second : str
        The second parameter, such as the amplitude of the load.
    value : float
        Its value that is asked for.
    bounds : dict
        Of both parameters by name, as for `trace_curve`; ``value`` lies inside.

    Returns
    -------
    tuple
        Solutions (problems or orbits) on the branches at ``value``, in the order met, which `trace` takes.
    """
    if point.kind not in (SpecialPointKind.FOLD, SpecialPointKind.GRAZING):
        raise ValueError(f"isolas start from a fold or a grazing, not from a {point.kind.value}")
    first = point.problem.parameter
    curve = trace_curve(point, (first, second), bounds=bounds)
    b = curve.column(second)
    found: list = []
    for i in np.flatnonzero((b[:-1] - value) * (b[1:] - value) <= 0.0).tolist():
        t = (value - b[i]) / (b[i + 1] - b[i]) if b[i + 1] != b[i] else 0.0
        if curve.x(i).size != curve.x(i + 1).size:
            continue
        problem = curve.problems[int(curve._arrays["part"][i])]
        x = (1.0 - t) * curve.x(i) + t * curve.x(i + 1)
        x[-1] = value
        fixed = np.zeros(x.size)
        fixed[-1] = 1.0
        c = problem.correct(x, fixed, True)
        if not c.converged:
            continue
        base = problem.family.alone(float(value))
        found.append(base.restarted(c.x[:-1]))
    return tuple(found)
