"""A straight branch whose monitors are given functions of the parameter, rows on it, and a half that has walked along them."""
import math
from types import SimpleNamespace

import numpy as np

from bifurc.continuation.kinds import CorrectorStatus, SpecialPointKind
from bifurc.continuation.problem import Corrected, Monitor
from bifurc.continuation.steps import detect
from bifurc.continuation.steps.arclength import Half
from bifurc.continuation.steps.rows import Part, Row
from bifurc.continuation.steps.rows import tests_of as values_of
from tests.continuation.problems import Scalar

USER, GRAZING, SLIDE = SpecialPointKind.USER, SpecialPointKind.GRAZING, SpecialPointKind.STICK_ONSET
SPEED = math.sqrt(1.0 + 0.25**2)  # arclength a unit of u = p / 2 in scaled unknowns, scale (2, 1)


class Line(Scalar):
    """u = p / 2 with u in 2 and p in 1: (p / 4, p) in scaled unknowns; monitors are functions of p."""

    def __init__(self, *watched, confirms=lambda kind, x: True, leaves=None, mu=None):
        self.watched = [function for _, function in watched]
        self.monitors = tuple(monitor for monitor, _ in watched)
        super().__init__(lambda u, p: u - 0.5 * p, lambda u, p: (1.0, -0.5), 0.0, 0.0, scale_u=2.0, scale_p=1.0)
        self.confirm, self.mu = confirms, mu
        self.leaves = (lambda a, b: -1.0) if leaves is None else leaves

    def monitor_values(self, u, p, tangent):
        return np.array([function(p) for function in self.watched])

    def floquet_multipliers(self, x):
        return None if self.mu is None else np.asarray(self.mu(float(x[-1])), complex)


def row_at(part, p, angle=0.01, ds=0.1):
    tangent = np.array([0.25, 1.0]) / SPEED
    c = Corrected(np.array([0.5 * p, p]), tangent, True, CorrectorStatus.CONVERGED, 3, 1e-15, 0.0, 0.0, 1.0, -2.0,
                  part.problem.monitor_values(None, p, None))
    return Row(c, part, SPEED * p, angle, values_of(c), ds)


def walk(problem, *places, born=-1):
    """Return a half with rows at all places but the last, and the row there."""
    part = Part(problem, 0, born)
    rows = [row_at(part, p) for p in places]
    half = Half(rows[0], SimpleNamespace(low=-9.0, high=9.0))
    for row in rows[1:-1]:
        detect.remember(half, row, half.rows)
        half.rows.append(row)
    return half, half.rows[-1], rows[-1]


def user(function, name="", **more):
    return Monitor(USER, name, **more), function


def edge(function, kind=GRAZING, name=""):
    return Monitor(kind, name, boundary=True), function
