"""Multiple shooting in balls: residual and Jacobian of an event sequence, with derivatives by a parameter and along a vector.

Unknowns are, for each event, its phase theta = omega t and the state before it.  With x = (y, forcing states at theta):

    exp(B s) R x_i - y_{i+1} = 0,  s = theta_{i+1} - theta_i,        G x_i = 0,        closing on (theta_0 + 2 pi span, +-y_0).
"""
from typing import Any, NamedTuple

from .arithmetic.balls import flint
from .arithmetic.forms import column
from .arithmetic.jets import Jet


class Pieces(NamedTuple):
    """Matrices of a sequence, one entry an event: generator and reset behind it, guard (None: a section); parts as jets."""

    B: list[Jet]
    R: list[Jet]
    G: list[Jet | None]
    W: list[list[int]]
    ns: int
    harmonics: tuple[int, ...]
    span: Any
    closure: int
    kept: tuple[int, ...]  # places of labels
    rows: Any  # (k, ns) of arb: the labels, which are 1 at their places
    labels: list  # their values (arb)
    fixed: list  # phases (arb) of the sections, one entry an event


def labels_of(candidate) -> tuple[tuple[int, ...], list, list]:
    """Return places, rows and values of what labels the family of a candidate, as balls."""
    arb = flint().arb
    rows = [[arb(v) for v in row] for row in candidate.labels.rows.tolist()]
    state = [arb(v) for v in (candidate.states[0] if candidate.closure > 0 else 0.0 * candidate.states[0]).tolist()]
    return candidate.labels.places, rows, [sum((a * b for a, b in zip(row, state, strict=True)), arb(0)) for row in rows]


class Solved(NamedTuple):
    """Residual and Jacobian as lists of parts, and for each event the states around it, its flow and its duration (phase)."""

    F: list
    J: list
    x: list[Jet]
    plus: list[Jet]
    end: list[Jet]
    flow: list[Jet]
    span: list[Jet]


def joined(theta: Jet, y: list[Jet], harmonics) -> Jet:
    """Return the joined state (nx, 1): states and forcing states (1, cos k theta, sin k theta, ...)."""
    entries = [*y, theta.like(flint().arb(1))]
    for k in harmonics:
        entries += theta.circular(k)
    return theta.like(*[column([e.parts[part] for e in entries]) for part in range(len(theta.parts))])


def evaluate(pieces: Pieces, theta: list[Jet], y: list[list[Jet]], closing: tuple[Jet, list[Jet]], want: bool = True) -> Solved:
    """Return residual and Jacobian of the sequence.

    Parameters
    ----------
    pieces : Pieces
    theta : list of Jet
        Phases of the events.
    y : list of list of Jet
        States before every event.
    closing : (Jet, list of Jet)
        Phase and state on which the last interval closes: those of the first event, shifted and turned; given apart,
        so that a perturbation may be multiplied over the period.
    want : bool
        Whether the Jacobian is wanted.
    """
    arb = flint().arb
    zero, one = arb(0), arb(1)
    count, ns, parts = len(theta), pieces.ns, len(theta[0].parts)
    size = 1 + ns
    nx = len(pieces.W) + ns
    total = count * size
    F = [[zero] * total for _ in range(parts)]
    J = [[[zero] * total for _ in range(total)] for _ in range(parts)] if want else []
    W = theta[0].like(flint().arb_mat(nx, nx, [arb(pieces.W[i - ns][j - ns]) if min(i, j) >= ns else zero for i in range(nx)
                                               for j in range(nx)]))
    xs, plus, ends, flows, spans = [], [], [], [], []
    for i in range(count):
        base = i * size
        last = i == count - 1
        nxt = 0 if last else i + 1
        x = joined(theta[i], y[i], pieces.harmonics)
        following, target = closing if last else (theta[i + 1], y[i + 1])
        G = pieces.G[i]
        drive = W * x  # rate of the forcing states by the phase
        if G is None:
            F[0][base] = theta[i].parts[0] - pieces.fixed[i]
            for k in range(1, parts):
                F[k][base] = zero if theta[i].parts[k] is None else theta[i].parts[k]
        else:
            value = G * x
            for k in range(parts):
                F[k][base] = value.entry(k, 0, 0, zero)
        R, B = pieces.R[i], pieces.B[i]
        start = R * x
        span = following - theta[i]
        Phi = B.flow(span)
        end = Phi * start
        xs.append(x)
        plus.append(start)
        ends.append(end)
        flows.append(Phi)
        spans.append(span)
        for c in range(ns):
            for k, part in enumerate(target[c].parts):
                F[k][base + 1 + c] = end.entry(k, c, 0, zero) - (zero if part is None else part)
        if last:
            for label, c in enumerate(pieces.kept):  # what nothing changes keeps the value it has
                for k in range(parts):
                    F[k][base + 1 + c] = sum((pieces.rows[label][q] * y[0][q].parts[k] for q in range(ns)
                                              if y[0][q].parts[k] is not None), -pieces.labels[label] if k == 0 else zero)
        if not want:
            continue
        rate = B * end
        through = Phi * R
        by_phase = Phi * (R * drive) - rate
        pushed = None if G is None else G * drive
        sign = pieces.closure if last else 1
        for k in range(parts):
            rows = J[k]
            if G is None:
                if k == 0:
                    rows[base][base] = one
            else:
                assert pushed is not None
                rows[base][base] = pushed.entry(k, 0, 0, zero)
                if G.parts[k] is not None:
                    for c in range(ns):
                        rows[base][base + 1 + c] = G.parts[k][0, c]
            for c in range(ns):
                row = rows[base + 1 + c]
                if last and c in pieces.kept:
                    if k == 0:
                        row[1:size] = pieces.rows[pieces.kept.index(c)]
                    continue
                row[base] = row[base] + by_phase.entry(k, c, 0, zero)
                part = through.parts[k]
                if part is not None:
                    for q in range(ns):
                        row[base + 1 + q] = row[base + 1 + q] + part[c, q]
                row[nxt * size] = row[nxt * size] + rate.entry(k, c, 0, zero)
                if k == 0:
                    row[nxt * size + 1 + c] = row[nxt * size + 1 + c] - sign
    return Solved(F, J, xs, plus, ends, flows, spans)
