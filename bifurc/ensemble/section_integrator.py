"""From starts to labels without a clock: motions are compared with attractors where they pass a section."""
import numpy as np

from ..compose.scene import Scene
from ..elements import EventKind
from .integrator import Cells, Targets, failed, integrated
from .outcomes import REACHED, UNSETTLED
from .proximity import boxed, nearest
from .section import Section

BLOCK = 8  # natural periods that a motion is simulated at a time


class SectionIntegrator:
    """Labels starts of a scene without excitation.

    A motion that passes the section no more is compared at times of its own, so that a state of rest beside the section is
    recognised too.

    Parameters
    ----------
    scene : Scene
    limit : int
        Largest number of events a natural period.
    section : Section
    unit : float
        Natural period, time: what ``most`` counts where the motion does not return to the section.
    """

    lean, error, steps = False, 0.0, None
    chunk = 512

    def __init__(self, scene: Scene, limit: int, section: Section, unit: float):
        self.scene, self.limit, self.section, self.unit = scene, limit, section, unit
        section.place(scene)

    def label(self, X: np.ndarray, targets: Targets, most: int) -> Cells:
        """Follow the starts ``X`` (N, ns), in place, until near an attractor, for ``most`` returns or natural periods."""
        cells = Cells.blank(len(X), state=UNSETTLED)
        for i in range(len(X)):
            self._follow(i, X, cells, targets, most)
        return cells

    def _follow(self, i: int, X: np.ndarray, cells: Cells, targets: Targets, most: int) -> None:
        """Follow one start."""
        y, visits, guest = X[i].copy(), 0, -1
        for _ in range(0, most, BLOCK):
            motion, code = integrated(self.scene, y, (0, 0.0), (0, BLOCK * self.unit), BLOCK * self.limit)
            if motion is None:
                cells.states[i] = code
                return
            times, states = self.section.crossings(motion)
            found, until = -1, motion.stop
            for until, point in zip([*times, motion.stop], [*states, motion.final], strict=True):
                found = nearest(point, targets.inverse, targets.points, targets.squares, targets.owner)
                if found < 0 and targets.keys.size and until < motion.stop:
                    keeper = boxed(point, targets.inverse, targets.width, targets.keys, targets.keepers)
                    visits = visits + 1 if keeper >= 0 and (keeper == guest or visits == 0) else 0
                    guest = keeper
                    found = keeper if visits >= targets.stay else -1
                if found >= 0:
                    break
            cells.periods[i] += np.count_nonzero(times <= until)
            arrivals = [event.speed for event in motion.events
                        if event.kind in (EventKind.IMPACT, EventKind.CHATTER, EventKind.CONTACT) and event.time <= until]
            cells.impacts[i] += len(arrivals)
            cells.speeds[i] = min([cells.speeds[i], *arrivals])
            y = motion.final
            X[i] = y
            if found >= 0:
                cells.labels[i], cells.states[i] = found, REACHED
                return
            if not motion.success:
                cells.states[i] = failed(motion.status)
                return
            if cells.periods[i] >= most:
                return
