"""Equations of one event signature along one parameter, and the compiled corrector on them."""
import copy
import dataclasses
import math
from functools import partial
from typing import NamedTuple

import numpy as np

from ...compose.modal import give_modal
from ...compose.scene import Scene
from ...compose.tables import rebuild
from ...compose.writer import kernels
from ...solve.interrupts import MANY, interruptible, spoil
from ...solve.steprun import MADE, TOLD
from ...solve.zeros import BOX
from . import motion, sequence
from .path import ParameterPath, slope
from .signature import Signature, divided

TOLERANCE = 2e-13  # scaled residual; reached by the last quadratic step, so that orbits are good to rounding
MAX_ITERATIONS = 14
LONGER, LENGTHS, GROWN = 4.0, 9, 10.0  # stretches over which a derivative is taken, until its error is so much more than the least
GROWTH = 4.0  # a branch is expected to reach a few times the amplitude at its start: unit of arclength in the states


class Data(NamedTuple):
    """What the corrector reads: how numbers depend on the parameter, and the event sequence."""

    places: np.ndarray  # these four: `index`, `series`, `low`, `high` of `ParameterPath`
    series: np.ndarray
    low: float
    high: float
    nodes: np.ndarray  # these four: of `Signature`, closure as signs
    fixed: np.ndarray
    span: float
    closure: np.ndarray
    scales: np.ndarray  # (n + 1,) natural sizes of unknowns and parameter
    weights: np.ndarray  # (ns,) natural sizes of the states


class Equations:
    """Residual of an event sequence as a function of its unknowns and one parameter.

    Parameters
    ----------
    scene : Scene
    path : ParameterPath
    signature : Signature
    weights : ndarray (ns,)
        Natural sizes of the states.
    parameter_scale : float
        Natural size of the parameter.

    Attributes
    ----------
    size : int
        Number n of unknowns.
    scale : ndarray (n + 1,)
        Natural sizes of unknowns and parameter; times count in quarter periods.
    labels : Labels
        What nothing changes in a period, see `Signature.labels`.
    """

    def __init__(self, scene: Scene, path: ParameterPath, signature: Signature, weights: np.ndarray, parameter_scale=1.0):
        if signature.events and signature.nodes.shape[1] <= sequence.ENDING:  # written by hand
            nodes = divided(scene, signature.nodes, path.tables, signature.closure)
            signature = dataclasses.replace(signature, nodes=nodes)
        self.scene, self.path, self.signature = scene, path, signature
        self.weights = np.ascontiguousarray(weights, float)
        self.size = signature.nodes.size // signature.nodes.shape[1] * (1 + scene.ns)
        self.scale = np.full(self.size + 1, float(parameter_scale))
        node = self.scale[:-1].reshape(len(signature.nodes), -1)
        node[:, 0], node[:, 1:] = 0.25, GROWTH * self.weights
        node *= np.sqrt(len(node))
        self.labels = signature.labels(scene)
        self.closure = signature.closing(self.labels)
        self.kernel = kernels(scene, sequence.__name__)
        self._room = self.kernel.room_of(path.tables, 0)
        set_clock(path.tables, signature.clock)
        self.motion = kernels(scene, motion.__name__)
        self._data = Data(path.index, path.series, path.low, path.high, signature.nodes, signature.fixed, signature.span,
                          self.closure, self.scale, self.weights)

    def on(self, path: ParameterPath) -> "Equations":
        """Return the same equations with the numbers of another path."""
        other = copy.copy(self)
        other.path = path
        set_clock(path.tables, self.signature.clock)
        other._data = self._data._replace(places=path.index, series=path.series, low=path.low, high=path.high)
        return other

    def correct(self, x, tangent, free: bool):
        """Return (status, x, tangent, info): 1 converged, 0 not, -1 singular.

        Parameters
        ----------
        x : ndarray (n + 1,)
            Guess; not changed.
        tangent : ndarray (n + 1,)
            Unit, in scaled unknowns.
        free : bool
            Search the plane through ``x`` orthogonal to ``tangent``; False: keep the parameter.
        """
        U, tangent, info = x.copy(), tangent.copy(), np.zeros(sequence.INFO)
        status = self._heard((U,), self.kernel.correct, U, x, tangent, 1.0 if free else 0.0, info, TOLERANCE, MAX_ITERATIONS)
        return status, U, tangent, info

    def follow(self, before, x, tangent, reads, run, tests, most: int):
        """Make up to ``most`` steps along the branch, see `sequence.follow`: status, x, predicted, tangent, info, rows.

        Parameters
        ----------
        before : ndarray (2, n + 1)
            Point and tangent of the row before the one where the walk begins.
        x, tangent : ndarray (n + 1,)
            Where the walk begins, and the tangent there.
        reads : ndarray (k - 1,) of int
            Places in ``info`` of the tests behind dp/ds.
        run : ndarray (RUN,)
        tests : ndarray (TESTS, k)
        most : int
        """
        U, predicted, tangent, info = x.copy(), x.copy(), tangent.copy(), np.zeros(sequence.INFO)
        rows = np.empty((most, 2 * x.size + tests.shape[1] + TOLD))
        status = self._heard((U, run), self.kernel.follow, (U, predicted, tangent), info, TOLERANCE, MAX_ITERATIONS,
                             (before, reads, run, tests, rows))
        return status, U, predicted, tangent, info, rows[:int(run[MADE])]

    def locate(self, hermite, bracket, place: int):
        """Find the zero of a test beside a cubic curve, see `sequence.locate`: status, x, the curve's point, tangent, info, box."""
        U, predicted, tangent = np.empty((3, self.size + 1))
        info, box = np.zeros(sequence.INFO), np.zeros(BOX)
        status = self._heard((U, hermite), self.kernel.locate, hermite, bracket, place, (U, predicted, tangent), info,
                             TOLERANCE, MAX_ITERATIONS, box)
        return status, U, predicted, tangent, info, box

    def _heard(self, read, kernel, *given):
        """Return what a kernel does with the tables; it ends early where a signal asks and NaN stands in the arrays ``read``."""
        if self.size < MANY:
            return kernel(self.path.tables, self._data, *given)
        return interruptible(True, partial(spoil, read), kernel, self.path.tables, self._data, *given)

    def residual(self, x) -> np.ndarray:
        """Return the scaled residual (n,) at ``x`` (n + 1,)."""
        return self._assembled(x, np.empty((1, 1)), np.empty((1, 1)), 0.0)

    def jacobian(self, x, mu=1.0) -> np.ndarray:
        """Return the Jacobian (n, n) at ``x`` (n + 1,) with the factor ``mu`` on the closing node."""
        J, C = np.empty((self.size, self.size)), np.empty((self.size, 2 + self.scene.ns))
        self._assembled(x, J, C, 1.0)
        if mu != 1.0:
            J[:, :C.shape[1] - 1] += (mu - 1.0) * C[:, :-1]
            J[:, 0] += C[:, -1]
        return J

    def by_parameter(self, x) -> np.ndarray:
        """Return the derivative (n,) of the scaled residual in the parameter at ``x`` (n + 1,), to rounding.

        The numbers of the tables have series, with exact derivatives; the residual is analytic in them.  Its own series along
        the line on which they change is taken over the stretch that leaves least of its rounding, whether or not the parameter may
        go so far: a part that falls with the length, as long as the residual itself does not grow.
        """
        line, best, least = self.path.line(float(x[-1])), np.empty(0), math.inf
        other, far = self.on(line), line.high * LONGER**-LENGTHS

        def residual(distance):
            return other.residual(np.append(x[:-1], distance))
        for _ in range(LENGTHS + 1):
            found, error = slope(residual, -far, far, 0.0)
            if not best.size or error < least:
                best, least = found, error
            elif error > GROWN * least:
                break
            far *= LONGER
        return best

    def _assembled(self, x, J, C, want) -> np.ndarray:
        """Let `sequence.assemble` write; return the scaled residual."""
        s, F = self.signature, np.empty(self.size)
        self.kernel.assemble(self.numbers_at(x[-1]), s.nodes, s.fixed, s.span, self.closure, x[:-1], self.weights, F, J, C, want,
                             self._room)
        return F

    def numbers_at(self, value):
        """Return the working tables, rewritten for a parameter value."""
        path = self.path
        self.kernel.set_parameter(path.tables, path.index, path.series, path.low, path.high, value)
        return path.tables


def set_clock(tables, clock: float) -> None:
    """Count the times of an autonomous orbit in the unit ``clock`` (time; 0: the forcing period, nothing is changed).

    The kernels know a unit of time by its frequency; without harmonics nothing else in the tables depends on it.
    """
    if clock and tables.flat[0] != 2.0 * np.pi / clock:
        tables.flat[0] = 2.0 * np.pi / clock
        rebuild(tables)
        give_modal(tables)
