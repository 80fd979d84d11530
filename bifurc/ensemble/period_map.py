"""The map of many starts over whole forcing periods, by the fastest kernel that the scene allows.

Everything that works on section points (cell mapping, bifurcation diagrams, edge tracking) goes through `PeriodMap`;
which kernel it takes is decided once, from the structure of the scene and the work it will have, and can be read in
`PeriodMap.kernel`.
"""

import numpy as np

from ..compose.scene import Scene, scene_of
from ..enumerations import DescribedEnum
from ..system import System
from .integrator import Images, Integrator
from .outcomes import REACHED

MAPPED = REACHED  # outcome of a start that was carried through all its periods; the other codes are those of `CellState`


class Kernel(DescribedEnum):
    """How starts are carried over a forcing period."""

    BATCH = ("batch", "Hundreds of starts side by side, events on compacted lists with proof, everything else "
                      "(grazes, repeated impacts, rest) by the scalar integrator: one to three degrees of freedom, "
                      "affine modes without memory.")
    SMOOTH = ("smooth", "Hundreds of starts side by side by Runge-Kutta steps, as many as the measured error asks for, through "
                        "stops and dry friction beside them: one or two degrees of freedom under smooth laws.")
    SCALAR = "scalar", "One start after the other on the compiled event integration: any scene whose laws can be compiled."
    SIMULATION = "simulation", "One start after the other by simulation: laws that only it can compile."


class PeriodMap:
    """Carries starts at phase 0 over whole forcing periods.  Safe to be called from several threads.

    The image of a start depends on nothing but the start: not on the other starts of a call, nor on their order.

    Parameters
    ----------
    system : System or Scene
        With an excitation.
    max_events : int
        Largest number of events a forcing period.
    steps : int, optional
        Runge-Kutta steps (order 8) a period under smooth laws; default: as many as the measured error asks for.
    work : float, optional
        Forcing periods that will be asked for, over all starts; default: many. Under smooth laws steps are measured only where
        there is work enough to pay for it.

    Attributes
    ----------
    system : System
    scene : Scene
    kernel : Kernel
    error : float
        Measured error of one period of Runge-Kutta steps, in units of the region where the scene lives; 0: rounding only
        (with ``steps`` given: not measured).
    steps : int or None
        Runge-Kutta steps a period.

    Raises
    ------
    ValueError
        For an autonomous system.

    Examples
    --------
    >>> import numpy as np
    >>> import bifurc as bf
    >>> from bifurc.basins import PeriodMap
    >>> period_map = PeriodMap(bf.systems.impact_oscillator(omega=1.4))
    >>> images = period_map.apply(np.array([[0.0, 0.5], [-1.0, 2.0]]), periods=10)
    >>> images.ends.shape, images.outcomes.tolist()
    ((2, 2), [0, 0])
    """

    def __init__(self, system: System | Scene, *, max_events: int = 2000, steps: int | None = None,
                 work: float = np.inf):
        scene = system if isinstance(system, Scene) else scene_of(system)
        if scene.period is None:
            raise ValueError(f"{scene.system!r} is autonomous; a map over forcing periods needs an excitation (omega)")
        self.system, self.scene = scene.system, scene
        self.max_events = int(max_events)
        if steps is not None and (isinstance(steps, bool) or steps != int(steps) or steps < 1):
            raise ValueError(f"steps = {steps!r} is not allowed; it must be a whole number of at least 1")
        self._integrator = Integrator(scene, self.max_events, None if steps is None else int(steps), work)
        self.error, self.steps = self._integrator.error, self._integrator.steps
        if self._integrator.lean:
            self.kernel = Kernel.BATCH if scene.closed_form else Kernel.SMOOTH
        else:
            self.kernel = Kernel.SCALAR if self._integrator.compiled else Kernel.SIMULATION

    def __repr__(self):
        return f"PeriodMap({self.system!r}, kernel {self.kernel})"

    def apply(self, X: np.ndarray, periods: int = 1) -> Images:
        """Return where the starts ``X`` (N, ns) at phase 0 are after ``periods`` forcing periods; ``X`` is kept.

        Raises
        ------
        ValueError
            For starts of the wrong shape or not finite, or fewer than one period.
        """
        X = np.array(X, float, order="C")
        if X.ndim != 2 or X.shape[1] != self.scene.ns:
            raise ValueError(f"X has shape {X.shape}; it must be (N, {self.scene.ns}), one start a row")
        if not np.isfinite(X).all():
            raise ValueError("X contains states that are not finite")
        if isinstance(periods, bool) or periods != int(periods) or periods < 1:
            raise ValueError(f"periods = {periods!r} is not allowed; it must be a whole number of at least 1")
        return self._integrator.propagate(X, int(periods))
