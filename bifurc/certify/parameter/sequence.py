"""An event sequence along a parameter: its matrices with derivatives, its unknowns (u, p), and Newton on them."""
from typing import NamedTuple

import numpy as np

from ...orbits.shooting.signature import repeated
from ..arithmetic.balls import flint
from ..arithmetic.jets import Jet
from ..candidate import Candidate, read
from ..equations import Pieces, labels_of
from ..events import Transition, structure
from ..model import Model
from .family import Family


class Along(NamedTuple):
    """A sequence over a range of a parameter: its exact structure and the family of its systems."""

    candidate: Candidate
    transitions: list[Transition]
    family: Family

    @property
    def length(self) -> int:
        """Number of events."""
        return len(self.candidate.events)

    @property
    def size(self) -> int:
        """Number of unknowns without the parameter."""
        return self.candidate.states.size + self.length

    @property
    def scale(self) -> np.ndarray:
        """Natural sizes of the unknowns and the parameter."""
        one = np.concatenate([[1.0], self.candidate.weights])
        return np.append(np.tile(one, self.length), max(self.family.high - self.family.low, 1e-300))


def along(problem, x, low: float, high: float, whole: bool = True, touch=None) -> Along:
    """Return the sequence of a problem of a branch at the point ``x``, over a range of its parameter.

    Parameters
    ----------
    problem : OrbitProblem
    x : ndarray (n + 1,)
    low, high : float
    whole : bool
        Write a half-period orbit out over its full period.
    touch : callable, optional
        Changes the candidate (inserts an event).

    Raises
    ------
    Refused
    """
    candidate = candidate_along(problem, x, whole)
    if touch is not None:
        candidate = touch(candidate)
    transitions = structure(candidate)[1]
    return Along(candidate, transitions, Family(candidate.system, problem.parameter, low, high, candidate.places))


def candidate_along(problem, x, whole: bool = True) -> Candidate:
    """Return the candidate of a problem at a point ``x`` (n + 1,) of its branch."""
    scene, system = problem.scene, problem.system.with_parameters(**{problem.parameter: float(x[-1])})
    signature, u = repeated(scene, problem.sequence, x[:-1]) if whole else (problem.sequence, x[:-1])
    return read(system, scene, signature, u, problem.weights)


def point_of(path: Along, candidate: Candidate, p: float) -> np.ndarray:
    """Return unknowns and parameter (N + 1,) in floats: phases and states of the events."""
    rows = np.column_stack([2.0 * np.pi * candidate.times, candidate.states])
    return np.append(rows.ravel(), p)


def pieces_along(path: Along, p, parts: int, slot: int) -> tuple[Pieces, Model]:
    """Return the matrices over a ball of the parameter as jets of ``parts``, the derivative by it in ``slot``, and their model."""
    model = path.family.model(p)

    def jet(found):
        return Jet(*[found.parts[0] if k == 0 else found.parts[1] if k == slot else None for k in range(parts)])
    return pieces_of(path, model, jet), model


def pieces_of(path: Along, model: Model, jet) -> Pieces:
    """Return the matrices of a sequence from a model; ``jet`` makes one of a matrix of its field."""
    def row(values):
        return jet(model.field.matrix(1, len(values), values))
    B: list[Jet] = []
    R: list[Jet] = []
    G: list[Jet | None] = []
    for item in path.transitions:
        event = item.event
        B.append(jet(model.mode(event.after).B))
        if not event.guards:
            R.append(jet(model.at_rest(event.after)))
            G.append(None)
            continue
        G.append(row(model.guard(event.before, *event.guards[0]).row))
        reset = None
        for keys, guard in zip((event.before, *event.middle), event.guards, strict=True):
            one = model.reset(keys, *guard)
            reset = one if reset is None else one * reset
        R.append(jet(reset))
    candidate, arb = path.candidate, flint().arb
    return Pieces(B, R, G, model.W, model.ns, model.harmonics, candidate.span, candidate.closure,
                  *labels_of(candidate), [arb.pi() * 2 * arb(float(t)) for t in candidate.times])
