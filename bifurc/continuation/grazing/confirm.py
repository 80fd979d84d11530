"""Short simulations beyond a grazing: what a motion that starts on the touching orbit does at 1e-6, 1e-5 and 1e-4."""
import math
from dataclasses import dataclass

import numpy as np

from ...content import Content
from ...elements import EventKind
from ...flow.simulate import simulate
from ...flow.status import Status
from ...orbits.shooting.signature import repeated
from .verdicts import GrazingVerdict

BEYOND = (1e-6, 1e-5, 1e-4)  # relative to the parameter
PERIODS = 1500  # after which it has settled, more where the touching orbit decays slowly
RECORDED = 96  # periods looked at
RETURNED = 1e-7  # difference of section points, scaled, that is a return
FAR = 12.0  # impact speed, in speeds of a first touch, that is no longer small
EITHER = 1.25  # ratio to that within which the expected speed may lie on either side


@dataclass(frozen=True, eq=False)
class Seen(Content):
    """What one simulation shows after it has settled.

    Attributes
    ----------
    eps : float
        Distance beyond the grazing, relative to the parameter.
    parameter : float
        Own units.
    period : int
        Forcing periods after which the section point returns; 0: it does not within those looked at.
    impacts : float
        Events at the touched element a forcing period.
    speed : float
        Largest rate of the guard at such an event, length per time for a stop.
    first : float
        The same of the first touch, w sqrt(2 depth |A_g|) in scale: what a small motion is measured by.
    small : bool
        Whether the motion has stayed near the touching orbit.
    completed : bool
        Whether the simulation ran to its end.
    """

    eps: float
    parameter: float
    period: int
    impacts: float
    speed: float
    first: float
    small: bool
    completed: bool

    def __str__(self) -> str:
        what = f"period {self.period}" if self.period else "no period found"
        return (f"at {self.eps:.0e} beyond: {what}, {self.impacts:.3g} impacts a period, largest speed {self.speed:.4g} "
                f"({'small' if self.small else 'far away'})")


def confirmed(grazing, beyond=BEYOND, periods=PERIODS) -> tuple[Seen, ...]:
    """Return what simulations show beyond a grazing; empty where there is no touch, or where no side is beyond."""
    touch = grazing.touch
    if touch is None or grazing.verdict is GrazingVerdict.DEGENERATE:
        return ()
    growth = apex_growth(touch)
    if growth == 0.0 or not math.isfinite(growth):
        return ()
    problem, p = touch.problem, float(touch.x[-1])
    size = abs(p) if p else problem.parameter_scale
    decay = math.log(1e-9) / math.log(max(abs(grazing.multiplier), 1e-3)) if abs(grazing.multiplier) < 1.0 else 0.0
    periods = int(min(max(periods, 20.0 * decay), 20000))
    state = problem.solution(touch.x).state
    found = []
    for eps in beyond:
        value = p + math.copysign(eps * size, growth)
        try:
            system = problem.system.with_parameters(**{problem.parameter: value})
        except ValueError:  # beyond what the builder allows
            continue
        first = math.sqrt(2.0 * abs(growth) * eps * size * abs(touch.apex))
        found.append(settled(system, state, touch, eps, value, first, periods))
    return tuple(found)


def settled(system, state, touch, eps, value, first, periods) -> Seen:
    """Return what a motion from ``state`` has come to after ``periods`` forcing periods."""
    begin = simulate(system, state, periods=periods)
    if begin.status is not Status.COMPLETED:
        return Seen(eps, value, 0, math.nan, math.nan, first, False, False)
    motion = simulate(system, begin.final, periods=RECORDED)
    if motion.status is not Status.COMPLETED:
        return Seen(eps, value, 0, math.nan, math.nan, first, False, False)
    kinds = (EventKind.IMPACT, EventKind.CONTACT, EventKind.CHATTER)
    elements = {touch.element} if not touch.symmetric else None
    speeds = [event.speed for event in motion.events
              if event.kind in kinds and (elements is None or event.element in elements)]
    sections = motion.sections / touch.problem.weights
    period = next((n for n in range(1, RECORDED // 2 + 1)
                   if np.abs(sections[-1] - sections[-1 - n]).max() < RETURNED * np.abs(sections).max()), 0)
    top = max(speeds, default=0.0)
    return Seen(eps, value, period, len(speeds) / RECORDED, float(top), first, bool(top <= FAR * first), True)


def apex_growth(touch) -> float:
    """Return d(depth)/dp of the touching apex along its branch, own units; its sign says which side is beyond.

    To first order the apex does not move in time, so it is the derivative of the guard at the time of the touch.
    """
    problem = touch.problem
    fixed = np.zeros(touch.x.size)
    fixed[-1] = 1.0
    step = 1e-5 * problem.parameter_scale
    T = touch.tables
    tau = touch.time * T.flat[0] / (2.0 * np.pi)
    values = []
    for sign in (1.0, -1.0):
        x = touch.x.copy()
        x[-1] += sign * step
        c = problem.correct(x, fixed, True)
        if not c.converged:
            return math.nan
        values.append(guard_at(problem, c.x, tau, touch))
    return (values[0] - values[1]) / (2.0 * step)


def guard_at(problem, x, tau, touch) -> float:
    """Return the touched guard on the orbit at ``x`` (n + 1,) at the time ``tau`` (periods)."""
    whole, U = repeated(problem.scene, problem.sequence, x[:-1])
    T = problem.equations.numbers_at(x[-1])
    state = np.empty((1, problem.scene.ns))
    begin = U[0] + np.mod(tau - U[0], whole.span)
    problem.equations.motion.states(T, whole.nodes, whole.span, U, np.array([begin]), state)
    joined = np.concatenate([state[0], problem.scene.forcing(np.zeros(1))[0]])
    problem.equations.kernel.forcing(T, tau * 2.0 * np.pi / T.flat[0], joined)
    return float(problem.equations.kernel.guard_value(T, touch.mode, touch.guard, joined))


def agrees(grazing) -> bool | None:
    """Whether the simulations agree with the verdict; None where nothing can be told."""
    small = grazing.verdict.small
    seen = [item for item in grazing.confirmation if item.completed]
    if small is None or not seen:
        return None
    if small:
        return all(item.small for item in seen)
    for item in seen:  # how far a motion is thrown does not shrink with the distance: the map tells from where on it is seen
        expected = grazing.expected(item.eps)
        if expected is not None and not FAR / EITHER < expected.speed / item.first < FAR * EITHER and item.small != expected.small:
            return False
    return True
