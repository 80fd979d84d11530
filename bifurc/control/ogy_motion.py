"""The motion under control by small changes of a parameter, from section to section, with noise."""
from dataclasses import dataclass, field

import numpy as np

from .. import plotting
from ..checks import checked, state
from ..content import Content
from ..flow.simulate import simulate


@dataclass(frozen=True, eq=False)
class ControlledMotion(Content):
    """States on the section and what the controller did.

    Attributes
    ----------
    states : ndarray (k + 1, ns)
        On the section, one a period of the orbit.
    corrections : ndarray (k,)
        Change of the parameter during each period.
    active : ndarray (k,) of bool
        Whether the controller was on.
    distances : ndarray (k + 1,)
        Distance from the orbit on the section, in sizes of its states.
    success : bool
        Every period was simulated.
    message : str
    parameter : str
    """

    states: np.ndarray = field(repr=False)
    corrections: np.ndarray = field(repr=False)
    active: np.ndarray = field(repr=False)
    distances: np.ndarray = field(repr=False)
    success: bool
    message: str
    parameter: str

    @property
    def captured(self) -> int | None:
        """Number of the period from which the controller stayed on to the end; None: it was not."""
        off = np.flatnonzero(~self.active)
        first = 0 if off.size == 0 else int(off[-1]) + 1
        return first if first < self.active.size else None

    @checked()
    def plot(self, axes=None):
        """Draw the states on the section and the corrections over the periods; return the axes."""
        return plotting.plot_controlled(self, axes)


def simulated(controller, y0, periods: int, limit: float, noise: float, seed: int, start: int) -> ControlledMotion:
    """Return the motion under control.

    Parameters
    ----------
    controller : OGYController
    y0 : array_like (ns,)
        State on the section.
    periods : int
        Periods of the orbit.
    limit : float
        Largest change of the parameter; beyond it the controller is off.
    noise : float
        Standard deviation of what is added to each state at each section, in sizes of the orbit's states.
    seed : int
    start : int
        Period in which the controller is switched on.
    """
    orbit, rng = controller.orbit, np.random.default_rng(seed)
    system, value = orbit.system, orbit.system.parameter(controller.parameter)
    y = state("y0", y0, (controller.state.size,))
    states, corrections, active = [y], [], []
    message, success = "every period was simulated", True
    for k in range(periods):
        change = controller.correction(y, limit) if k >= start else 0.0
        on = k >= start and abs(controller.gain @ (y - controller.state)) <= limit
        changed = system.with_parameters(**{controller.parameter: value + change}) if change else system
        motion = simulate(changed, y, periods=orbit.periods, t0=controller.section * changed.period)
        corrections.append(change)
        active.append(bool(on))
        if not motion.success:
            message, success = motion.message, False
            break
        y = motion.final + noise * orbit.weights * rng.normal(size=y.size)
        states.append(y)
    found = np.array(states)
    distances = np.linalg.norm((found - controller.state) / orbit.weights, axis=1)
    return ControlledMotion(found, np.array(corrections), np.array(active), distances, success, message, controller.parameter)
