"""Lyapunov exponents through impacts and stops, with their standard errors.

Perturbations are carried by the exact arcs and saltation matrices along an exact motion (Mueller 1995) and
orthonormalised after every arc and every event (Benettin et al. 1980).  Errors are those of batch means.
"""
from dataclasses import dataclass, field

import numpy as np

from ..compose.scene import scene_of
from ..system import System

CHUNK = 256  # forcing periods of one recorded piece


@dataclass(frozen=True)
class LyapunovExponents:
    """Exponents of a motion, largest first.

    Attributes
    ----------
    values : ndarray
        (ns,), per unit of time; ``-inf`` where a direction dies (a rest on a rigid stop forgets two).
    errors : ndarray
        (ns,), standard errors of `values` from batch means; 0 for ``-inf``.
    per_period : ndarray
        (ns,), `values` times the forcing period.
    impacts : float
        Kicks a forcing period.
    sum_rule : float
        What the sum of `values` must be: mean divergence of the vector field plus log|det| of the kicks.
    state : ndarray
        (ns,), where the motion ended, at a whole forcing period: a start to go on from.
    periods : int
    """

    values: np.ndarray
    errors: np.ndarray
    per_period: np.ndarray = field(repr=False)
    impacts: float
    sum_rule: float
    state: np.ndarray = field(repr=False)
    periods: int

    @property
    def chaotic(self) -> bool:
        """Whether the largest exponent is positive by more than four standard errors."""
        return bool(self.values[0] > 4.0 * self.errors[0] and self.values[0] > 0.0)


def lyapunov_exponents(system: System, y0, periods: int = 2000, transient: int = 200, batches: int = 20,
                       max_events: int = 2000) -> LyapunovExponents:
    """Return the Lyapunov exponents of the motion from a state.

    Parameters
    ----------
    system : System
        With a forcing period.
    y0 : array_like
        State (ns,) at phase 0.
    periods : int
        Forcing periods that are averaged over, a multiple of `batches` at least 2 `batches`.
    transient : int
        Forcing periods before that.
    batches : int
        Batches of the standard error, at least 4.
    max_events : int
        Largest number of events a forcing period.

    Returns
    -------
    LyapunovExponents

    Raises
    ------
    ValueError
        For an autonomous system or impossible counts.
    ArithmeticError
        When the motion does not complete; the message is that of the simulation.

    References
    ----------
    P. C. Mueller, Chaos, Solitons and Fractals 5 (1995) 1671; G. Benettin et al., Meccanica 15 (1980) 9.

    Examples
    --------
    >>> import bifurc as bf
    >>> system = bf.systems.impact_oscillator(omega=2.8, amplitude=1.0, gap=0.0, restitution=0.8)
    >>> bf.lyapunov_exponents(system, (-0.5, 0.0), periods=400).chaotic
    True
    """
    from ..flow.engine import engine_of
    from ..flow.simulate import march
    scene = scene_of(system)
    if scene.period is None:
        raise ValueError(f"{system!r} has no forcing period; Lyapunov exponents need one")
    if batches < 4 or periods < 2 * batches or transient < 0:
        raise ValueError(f"periods = {periods!r}, transient = {transient!r}, batches = {batches!r}: allowed are batches >= 4, "
                         "periods >= 2 batches, transient >= 0")
    periods -= periods % batches
    y = np.asarray(y0, float)
    now = 0
    while now < transient:
        step = min(CHUNK, transient - now)
        y = _checked(march(scene, y, (now, 0.0), (now + step, 0.0), max_events)).final
        now += step
    ns = scene.ns
    Q, alive = np.eye(ns), np.array([ns], np.int64)
    sums = np.zeros((periods, ns))
    kicks, logs = 0, 0.0
    end = now + periods
    begin = now
    while now < end:
        step = min(CHUNK, end - now)
        motion = _checked(march(scene, y, (now, 0.0), (now + step, 0.0), max_events))
        R = motion.recorded
        engine_of(scene).grow(scene.tables, R.rows, R.times, R.before, R.after, now + step, 0.0, scene.period, begin, Q, alive,
                              sums)
        count, log = _contraction(scene, R, now + step)
        kicks, logs = kicks + count, logs + log
        y = motion.final
        now += step
    batch = sums.reshape(batches, -1, ns).mean(axis=1)
    per_period = batch.mean(axis=0)
    errors = batch.std(axis=0, ddof=1) / np.sqrt(batches) / scene.period
    per_period[alive[0]:], errors[alive[0]:] = -np.inf, 0.0
    order = np.argsort(-per_period, kind="stable")
    return LyapunovExponents(per_period[order] / scene.period, errors[order], per_period[order], kicks / periods,
                             logs / (periods * scene.period), y, periods)


def _checked(motion):
    if not motion.success:
        raise ArithmeticError(motion.message)
    return motion


def _contraction(scene, R, whole) -> tuple[int, float]:
    """Return the number of kicks of a record and the logarithm of the factor by which it changes volumes."""
    from ..flow.scan import CHATTER, EVENT
    T, ns, n = scene.tables, scene.ns, scene.n
    starts = R.rows[:, 4] * scene.period + R.times
    spans = np.diff(np.append(starts, whole * scene.period))
    traces = np.array([np.trace(T.A[m, :, :ns]) for m in range(len(scene.keys))])
    total = float(spans @ traces[R.rows[:, 2]])
    kicks = 0
    for before, g, _, what, _ in R.rows:
        if what == CHATTER:
            return kicks, -np.inf
        if what == EVENT and T.kick[before, g]:
            kicks += 1
            velocity = slice(n, 2 * n)
            factor = abs(np.linalg.det(T.R[before, g, velocity, velocity])) ** 2
            total += np.log(factor) if factor > 0.0 else -np.inf
    return kicks, total
