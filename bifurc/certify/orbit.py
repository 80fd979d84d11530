"""The proof of a periodic orbit: existence, uniqueness, admissibility, multipliers, from the system's numbers alone."""
import math
import time
from typing import Any, NamedTuple

import numpy as np

from ..checks import checked
from .arithmetic.balls import PRECISION, below, ends, flint, size, working
from .arithmetic.jets import Jet
from .arithmetic.krawczyk import krawczyk, preconditioner, tightened
from .candidate import Candidate, candidate_of
from .certificate import Certificate, EventEnclosure, Verdict, refusal
from .equations import Pieces, Solved, evaluate, labels_of
from .events import FOREVER, Transition, balls_of, structure
from .model import Model, Refused
from .segments import Steps, rate
from .spectrum import characteristic, eigenvalues, monodromy, saltations, stable

RADII = (1e-5, 1e-7, 1e-9, 1e-11)  # half widths of the boxes tried, scaled
CLAIM = 1e-9  # scaled: a stored orbit is that near to the one it stands for, or it is another motion
METHOD = "Krawczyk on multiple shooting, Bernstein bounds of the guards, Schur-Cohn"


class Proof(NamedTuple):
    """A proved zero: its box (phases and states), what was evaluated on it, and the events made ready."""

    candidate: Candidate
    transitions: list[Transition]
    pieces: Pieces
    box: list
    solved: Solved
    unique: float
    distance: float


class Prepared(NamedTuple):
    """A candidate with exact matrices and their balls."""

    candidate: Candidate
    model: Model
    transitions: list[Transition]
    pieces: Pieces


def prepare(candidate: Candidate) -> Prepared:
    """Return the exact matrices of a candidate, and their balls at the working precision.

    Raises
    ------
    Refused
        Naming what is not covered.
    """
    model, transitions = structure(candidate)
    matrix = flint().arb_mat
    balls: dict = {}

    def ball(exact):
        if id(exact) not in balls:
            balls[id(exact)] = matrix(exact)
        return balls[id(exact)]
    pieces = Pieces([Jet(ball(model.mode(t.event.after).B)) for t in transitions], [Jet(matrix(t.reset)) for t in transitions],
                    [None if t.guard is None else Jet(row_of(t.guard)) for t in transitions], model.W, model.ns, model.harmonics,
                    candidate.span, candidate.closure, *labels_of(candidate),
                    [flint().arb.pi() * 2 * exact(float(t)) for t in candidate.times])
    return Prepared(candidate, model, transitions, pieces)


def row_of(row):
    """Return a row of rationals or balls as a matrix of balls (1, nx)."""
    arb = flint().arb
    return flint().arb_mat(1, len(row), [arb(v) for v in row])


def unknowns_of(candidate: Candidate) -> tuple[list, list]:
    """Return phases and states of a candidate as balls of radius zero, one list, and their natural sizes (floats)."""
    arb = flint().arb
    u, scale = [], []
    for t, y in zip(candidate.times, candidate.states, strict=True):
        u += [arb(2.0 * math.pi * float(t)), *[arb(float(v)) for v in y]]
        scale += [1.0, *[float(w) for w in candidate.weights]]
    if not candidate.events[0].guards:
        u[0] = arb(0)
    return u, scale


def unpacked(u: list, pieces: Pieces, count: int) -> tuple[list, list, tuple]:
    """Return what `evaluate` takes of unknowns without further parts."""
    step = 1 + pieces.ns
    theta = [Jet(u[i * step]) for i in range(count)]
    y = [[Jet(v) for v in u[i * step + 1:(i + 1) * step]] for i in range(count)]
    close = Jet(u[0] + flint().arb.pi() * 2 * exact(pieces.span)), [Jet(u[1 + c] * pieces.closure) for c in range(pieces.ns)]
    return theta, y, close


def exact(span: float):
    """Return a span (whole or half periods) as a ball of radius zero."""
    return flint().arb(span)


def solve(prepared: Prepared, radii=RADII) -> tuple[Proof | None, str, bool]:
    """Return the proof that a zero exists near a candidate; or why not, and whether none exists there."""
    candidate, pieces = prepared.candidate, prepared.pieces
    u, scale = unknowns_of(candidate)
    count = len(candidate.events)
    arb = flint().arb
    at = evaluate(pieces, *unpacked(u, pieces, count))
    Y = preconditioner(at.J[0])
    if Y is None:
        return None, "the Jacobian of its event sequence is singular: a special point of its branch, or no orbit", False
    for half in radii:
        X = [m + arb(0, half * s) for m, s in zip(u, scale, strict=True)]
        over = evaluate(pieces, *unpacked(X, pieces, count))
        zero = krawczyk(u, X, at.F[0], over.J[0], Y)
        if zero.empty:
            return None, (f"no solution of its event sequence lies within {half:.0e} (scaled) of the stored orbit"), True
        if zero.inside:
            zero = tightened(zero, scale, lambda at: evaluate(pieces, *unpacked(at, pieces, count), want=False).F[0],
                             lambda at: evaluate(pieces, *unpacked(at, pieces, count)).J[0], Y)
            distance = max(size(b - m) / s for b, m, s in zip(zero.box, u, scale, strict=True))
            if distance > CLAIM:
                return None, (f"the solution nearest to the stored orbit is about {distance:.2g} (scaled) away from it: the orbit "
                              "as stored is none"), True
            solved = evaluate(pieces, *unpacked(zero.box, pieces, count))
            return Proof(candidate, prepared.transitions, pieces, zero.box, solved, half, distance), "", False
    return None, "Krawczyk's operator does not map any of the boxes tried into itself: a special point is near", False


class Admitted(NamedTuple):
    """What is known of the guards of a motion."""

    verdict: bool | None
    distance: float
    speed: float
    message: str
    speeds: list


def resets_of(model: Model, event) -> list:
    """Return the matrices (arb_mat) of the guards of an event, one after the other."""
    keys_at = [event.before, *event.middle]
    return [balls_of(model.reset(keys, *guard)) for keys, guard in zip(keys_at, event.guards, strict=True)]


def admit(model: Model, proof: Proof) -> Admitted:
    """Return whether every guard is inside on every segment, every listed event arrives, and no earlier candidate may follow.

    ``model`` is that of the candidate, in rationals or balls.
    """
    solved, pieces, transitions = proof.solved, proof.pieces, proof.transitions
    system = proof.candidate.system
    labels = system.labels
    count = len(transitions)
    width = 1 + pieces.ns
    least, nearest, speeds = math.inf, math.inf, []
    rates: dict[int, float] = {}
    for i, item in enumerate(transitions):
        x, end = solved.x[i].value, solved.end[i].value
        G = pieces.G[i]
        if G is not None:
            before = pieces.B[i - 1].value
            speed = (G.value * (before * x))[0, 0]
            speeds.append(speed)
            if speed < 0:
                return Admitted(False, 0.0, 0.0, f"event {i} ({name(labels, model, item)}) is left, not reached", speeds)
            if not speed > 0:
                return Admitted(None, 0.0, 0.0, f"event {i} ({name(labels, model, item)}) may be a graze", speeds)
            least = min(least, below(speed))
        else:
            speeds.append(None)
        for rule in item.rules:
            if not rule.decides(model, resets_of(model, item.event), x):
                return Admitted(None, 0.0, 0.0, f"behind event {i} the mode {rule.key!r}, tried first, is not ruled out", speeds)
        theta = proof.box[i * width]
        duration = solved.span[i].value
        if duration < 0:
            return Admitted(False, 0.0, 0.0, f"event {i + 1} comes before event {i}", speeds)
        if not duration > 0:
            return Admitted(None, 0.0, 0.0, f"the time between the events {i} and {(i + 1) % count} encloses zero", speeds)
        mode = model.mode(item.event.after)
        if not mode.guards:
            continue
        if id(pieces.B[i]) not in rates:
            rates[id(pieces.B[i])] = rate(pieces.B[i].value)
        steps = Steps(pieces.B[i], [row_of(g.row) for g in mode.guards], solved.span[i], rates[id(pieces.B[i])])
        if steps.too_many:
            return Admitted(None, 0.0, 0.0, "the motion is too fast for its period: too many steps", speeds)
        states = steps.states(solved.plus[i])
        ending = transitions[(i + 1) % count].ending
        for q, guard in enumerate(mode.guards):
            if item.orders[q] == FOREVER:
                continue
            here = (guard.element, guard.number) in ending
            sign = steps.sign(q, states, end, item.orders[q], here)
            if not sign.proved:
                where = f"{labels[guard.element]}.{guard.guard.kind} at phase {float(theta.mid()) + sign.at:.6g}, after event {i}"
                if sign.violated:
                    return Admitted(False, 0.0, 0.0, f"the motion passes {where} without noticing it", speeds)
                return Admitted(None, 0.0, 0.0, f"undecided whether the motion passes {where}: a graze is near", speeds)
            nearest = min(nearest, sign.margin)
    return Admitted(True, nearest, least, "", speeds)


def name(labels, model, item) -> str:
    """Return element and kind of the event."""
    element, number = item.event.guards[0]
    return f"{labels[element]}.{model.guard(item.event.before, element, number).guard.kind}"


def multipliers(proof: Proof):
    """Return the derivative over the period (arb_mat) without family states, or None at zero impact speed."""
    pieces, solved = proof.pieces, proof.solved
    jumps = saltations(pieces, solved)
    if jumps is None:
        return None
    return monodromy([Phi.value for Phi in solved.flow], jumps, pieces.ns, pieces.kept, pieces.rows)


@checked()
def certify_orbit(orbit, precision: int | None = None) -> Certificate:
    """Return what is proved of a periodic orbit.

    Parameters
    ----------
    orbit : PeriodicOrbit
        As it stands: converged or not, admissible or not; nothing that it says of itself is used.
    precision : int, optional
        Bits of the balls, at least 64; None: 96, and twice that where a verdict stays open.

    Returns
    -------
    Certificate

    Raises
    ------
    NotInstalled
        When python-flint is missing.
    ValueError
        For a precision that is not allowed.
    """
    start = time.process_time()
    flint()
    found = refusal("", PRECISION)
    for bits in (PRECISION, 2 * PRECISION) if precision is None else (precision,):
        with working(bits):
            try:
                found = _certified(candidate_of(orbit), bits, start)
            except Refused as error:
                return refusal(f"refused: {error}", bits, time.process_time() - start)
            except ZeroDivisionError:
                return refusal("refused: the rows that a mode of the motion holds depend on each other", bits,
                               time.process_time() - start)
        if Verdict.DISPROVED in (found.exists, found.admissible) or found.proved and found.stable is not Verdict.UNDECIDED:
            break
    return found


def _certified(candidate: Candidate, bits: int, start: float) -> Certificate:
    if not all(math.isfinite(v) for v in (*candidate.times, *candidate.states.ravel())):
        return refusal("the orbit holds numbers that are not finite", bits, time.process_time() - start)
    prepared = prepare(candidate)
    proof, why, none = solve(prepared)
    if proof is None:
        return Certificate(Verdict.DISPROVED if none else Verdict.UNDECIDED, math.inf, 0.0, Verdict.UNDECIDED, np.empty((0, 2, 2)),
                           method=METHOD, precision=bits, seconds=time.process_time() - start, message=why)
    admitted = admit(prepared.model, proof)
    M = multipliers(proof)
    enclosed, verdict = np.empty((0, 2, 2)), Verdict.UNDECIDED
    if M is not None:
        enclosed = np.array([[ends(z.real), ends(z.imag)] for z in eigenvalues(M)]).reshape(-1, 2, 2)
        verdict = Verdict.of(stable(characteristic(M)) if M.nrows() else True)
    if not admitted.verdict:
        verdict = Verdict.UNDECIDED
    note = ("; what vanishes identically behind its events does so up to the rounding of coefficients that elements compute"
            if any(item.rounded for item in proof.transitions) else "")
    words = {True: f"a motion of the system: it exists, is the only one near, and no guard is passed unnoticed{note}",
             False: f"not admissible: {admitted.message}", None: f"undecided: {admitted.message}"}[admitted.verdict]
    return Certificate(Verdict.PROVED, proof.distance, proof.unique, Verdict.of(admitted.verdict), enclosed, verdict,
                       _events(prepared, proof, admitted), admitted.distance, admitted.speed, METHOD, bits,
                       time.process_time() - start, words)


def _events(prepared: Prepared, proof: Proof, admitted: Admitted) -> tuple[EventEnclosure, ...]:
    arb = flint().arb
    omega = arb(proof.candidate.system.omega)
    width = 1 + proof.pieces.ns
    found: list[Any] = []
    for i, item in enumerate(proof.transitions):
        if not item.event.guards or i >= len(admitted.speeds):
            continue
        theta = proof.box[i * width]
        states = np.array([ends(v) for v in proof.box[i * width + 1:(i + 1) * width]])
        for element, number in item.event.guards[:1]:
            guard = prepared.model.guard(item.event.before, element, number).guard
            found.append(EventEnclosure(ends(theta / omega), proof.candidate.system.labels[element], str(guard.kind),
                                        ends(admitted.speeds[i] * omega), states))
    return tuple(found)

