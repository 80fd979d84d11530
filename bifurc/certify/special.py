"""Proofs of special points as regular zeros of extended systems: folds, flips, tori, symmetric branch points, grazings, onsets.

    fold, flip:   F(u, p) = 0,  F_u(mu) v = 0,  l v = 1      (mu = 1, -1: factor on the closing event; also of half a period)
    torus:        F(u, p) = 0,  F_u(mu) v = 0,  l v = 1,  |mu| = 1,  with complex v and mu
    grazing:      F(u, p) = 0,  d^k/dtheta^k of the guard of one event = 0

A zero in the interior of a box on which Krawczyk's operator contracts is regular: the Jacobian of the extended system is invertible
on the box, which is the transversality of the point (R. Seydel, Numerische Mathematik 33 (1979), 339-352).

One file, because folds, flips, tori and grazings are one extended system with other last rows.
"""
import dataclasses
import math
import time

import numpy as np

from ..checks import checked
from ..continuation.shooting.signature_change import UNLISTED
from ..orbits.shooting import sequence
from .arithmetic.balls import PRECISION, ends, flint, middle, size, working
from .arithmetic.jets import Jet
from .arithmetic.krawczyk import krawczyk, preconditioner, tightened
from .candidate import Candidate, Event
from .certificate import PointCertificate, Verdict
from .equations import evaluate
from .model import Refused
from .parameter.sequence import Along, along, pieces_along, point_of

RADII = (1e-5, 1e-7, 1e-9, 1e-11)
CLAIM = 1e-7  # scaled: the point as stored and the one proved are the same
STEPS = 6  # of Newton before the proof
SMALL = 1e-5  # scaled rate of the event that grazes
FACTORS = {"fold": 1, "period_doubling": -1, "branch_point": -1}


@checked()
def certify_point(point, precision: int | None = None) -> PointCertificate:
    """Return what is proved of a special point of a branch of periodic orbits.

    Parameters
    ----------
    point : SpecialPoint
        Fold, period doubling, Neimark-Sacker point, symmetric branch point, grazing, or onset that is a graze of a listed or an
        unlisted guard.
    precision : int, optional
        Bits; None: 96.

    Returns
    -------
    PointCertificate
    """
    start = time.process_time()
    bits = precision or PRECISION
    flint()
    kind = str(point.kind)

    def result(exists, message, **more):
        return PointCertificate(kind, exists, message=message, precision=bits, seconds=time.process_time() - start, **more)
    problem = point.problem
    if problem is None or problem.sequence is None:
        return result(Verdict.UNDECIDED, "refused: the point is not one of a branch of event sequences")
    p = float(point.parameter)
    width = 1e-3 * max(abs(p), 1e-3 * problem.parameter_scale)
    with working(bits):
        try:
            if kind in FACTORS:
                symmetric = problem.sequence.closure < 0
                if kind == "branch_point" and not symmetric:
                    return result(Verdict.UNDECIDED, "refused: a branch point without symmetry has no regular extended system")
                if symmetric:
                    _assert_symmetric(problem)
                path = along(problem, point.x, p - width, p + width, whole=False)
                system: Singular | Touch | Torus = Singular(path, FACTORS[kind])
            elif kind == "neimark_sacker":
                path = along(problem, point.x, p - width, p + width, whole=False)
                near = min(problem.solution(point.x).multipliers, key=lambda z: abs(abs(z) - 1.0) + (abs(z.imag) < 1e-9))
                if problem.sequence.closure < 0:
                    raise Refused("a Neimark-Sacker point of a motion that is solved on half a period")
                system = Torus(path, complex(near))
            elif kind in ("grazing", "stick_onset", "slip_onset", "separation"):
                system = touching(problem, point, p, width)
            else:
                return result(Verdict.UNDECIDED, f"refused: no extended system is made for {kind}")
            z = system.start(point_of(system.path, system.path.candidate, p))
            return _proved(system, z, p, result)
        except Refused as error:
            return result(Verdict.UNDECIDED, f"refused: {error}")
        except (ZeroDivisionError, np.linalg.LinAlgError):
            return result(Verdict.UNDECIDED, "a matrix of the extended system cannot be inverted")


def _assert_symmetric(problem) -> None:
    if problem.system.symmetry != -1:
        raise Refused("the orbit closes on its mirror image, and the system is not symmetric")


def _proved(system, z: np.ndarray, p: float, result):
    arb = flint().arb
    scale, stored = system.scale, z
    for _ in range(STEPS):
        F, J, _ = system.evaluate([arb(float(v)) for v in z])
        f, A = np.array([middle(v) for v in F]), np.array([[middle(v) for v in row] for row in J])
        if not (np.isfinite(f).all() and np.isfinite(A).all()):
            return result(Verdict.UNDECIDED, "Newton on the extended system does not converge")
        move = np.linalg.solve(A * scale, f) * scale
        z = z - move
        if np.abs(move / scale).max() < 1e-13:
            break
    place = system.path.size
    m = [arb(float(v)) for v in z]
    F, J, _ = system.evaluate(m)
    Y = preconditioner(J)
    if Y is None:
        return result(Verdict.UNDECIDED, "the extended system is singular: the point is degenerate, or none")
    for half in RADII:
        X = [c + arb(0, half * s) for c, s in zip(m, scale, strict=True)]
        _, over, extra = system.evaluate(X)
        zero = krawczyk(m, X, F, over, Y)
        if not zero.inside:
            continue
        zero = tightened(zero, scale, lambda at: system.evaluate(at)[0], lambda at: system.evaluate(at)[1], Y)
        enclosed = zero.box[place]
        away = size(enclosed - arb(p)) / float(scale[place])
        if away > CLAIM:  # it says that there is none at the stored one only where that lies in the box of the only one
            inside = np.abs((z - stored) / scale).max() < half - CLAIM
            return result(Verdict.DISPROVED if inside else Verdict.UNDECIDED,
                          f"the point proved nearest lies {away:.2g} (scaled) away from the one stored"
                          + ("" if inside else "; whether there is another one is not known"), parameter=ends(enclosed))
        _, _, extra = system.evaluate(zero.box)
        if extra is not None and extra.contains(0):
            why = ("the multipliers may be real" if isinstance(system, Torus) else
                   "the next derivative of the guard encloses zero: a degenerate graze")
            return result(Verdict.UNDECIDED, why, unique_in=half, parameter=ends(enclosed))
        message = ("the point exists, is the only one of its kind near, and is transversal: its extended system is regular "
                   "on the box")
        if isinstance(system, Torus):
            message += "; of its multiplier on the unit circle the imaginary part does not vanish"
        elif extra is not None:
            message += f"; the guard's next derivative is at least {min(abs(v) for v in ends(extra)):.4g} in size"
        return result(Verdict.PROVED, message, unique_in=half, parameter=ends(enclosed), transversal=Verdict.PROVED)
    return result(Verdict.UNDECIDED, "Krawczyk's operator maps none of the boxes tried into itself: it is nearly degenerate")


class Singular:
    """F = 0, F_u(mu) v = 0, l v = 1 in (u, p, v)."""

    def __init__(self, path: Along, factor: int):
        self.path, self.factor = path, factor

    @property
    def scale(self) -> np.ndarray:
        """Natural sizes of the unknowns."""
        return np.concatenate([self.path.scale, self.path.scale[:-1]])

    def start(self, point: np.ndarray) -> np.ndarray:
        """Return unknowns with the null vector of the Jacobian at a point."""
        arb = flint().arb
        scale = self.path.scale[:-1]
        self.normal = np.zeros(self.path.size)
        _, J, _ = self.evaluate([arb(float(v)) for v in (*point, *np.zeros(self.path.size))])
        n = self.path.size
        A = np.array([[middle(v) for v in row[n + 1:]] for row in J[n:2 * n]])
        v = np.linalg.svd(A * scale)[2][-1]
        self.normal = v / scale
        return np.concatenate([point, v * scale])

    def evaluate(self, z: list):
        """Return residual, Jacobian, and nothing further."""
        arb = flint().arb
        zero = arb(0)
        path, n, mu = self.path, self.path.size, self.factor
        u, p, v = z[:n], z[n], z[n + 1:]
        pieces, _ = pieces_along(path, p, 4, 2)
        step = 1 + pieces.ns
        theta = [Jet(u[i * step], v[i * step], zero, zero) for i in range(path.length)]
        y = [[Jet(u[i * step + 1 + c], v[i * step + 1 + c], zero, zero) for c in range(pieces.ns)] for i in range(path.length)]
        turn = pieces.closure
        close = (Jet(u[0] + arb.pi() * 2 * arb(pieces.span), v[0] * mu, zero, zero),
                 [Jet(u[1 + c] * turn, v[1 + c] * (turn * mu), zero, zero) for c in range(pieces.ns)])
        solved = evaluate(pieces, theta, y, close)
        F = [*solved.F[0], *solved.F[1], sum((arb(float(a)) * b for a, b in zip(self.normal, v, strict=True)), arb(-1))]
        rate = (pieces.B[-1] * solved.end[-1]).value
        base = (path.length - 1) * step
        rows = []
        for i in range(n):
            rows.append([*solved.J[0][i], solved.F[2][i], *[zero] * n])
        for i in range(n):
            row = list(solved.J[0][i])
            c = i - base - 1
            if c >= 0 and c not in pieces.kept:  # the columns of the closing event carry the factor
                row[0] = row[0] + rate[c, 0] * (mu - 1)
                row[1 + c] = row[1 + c] - turn * (mu - 1)
            rows.append([*solved.J[1][i], solved.F[3][i], *row])
        rows.append([zero] * (n + 1) + [arb(float(a)) for a in self.normal])
        return F, rows, None


class Torus:
    """F = 0, F_u(mu) v = 0, l v = 1, |mu| = 1 in (u, p, Re v, Im v, Re mu, Im mu), with complex v and mu off the real axis."""

    def __init__(self, path: Along, multiplier: complex):
        self.path, self.multiplier = path, multiplier / abs(multiplier)

    @property
    def scale(self) -> np.ndarray:
        """Natural sizes of the unknowns."""
        one = self.path.scale[:-1]
        return np.concatenate([self.path.scale, one, one, [1.0, 1.0]])

    def start(self, point: np.ndarray) -> np.ndarray:
        """Return unknowns with the null vector of the Jacobian at a point."""
        arb, n = flint().arb, self.path.size
        scale, mu = self.path.scale[:-1], self.multiplier
        self.normal = np.zeros(n, complex)
        _, J, _ = self.evaluate([arb(float(v)) for v in (*point, *np.zeros(2 * n), mu.real, mu.imag)])
        A = np.array([[middle(v) for v in row[n + 1:3 * n + 1]] for row in J[n:3 * n]])
        v = np.linalg.svd((A[:n, :n] - 1j * A[:n, n:]) * scale)[2][-1].conj()
        self.normal = v.conj() / scale
        return np.concatenate([point, (v * scale).real, (v * scale).imag, [mu.real, mu.imag]])

    def evaluate(self, z: list):
        """Return residual, Jacobian, and the imaginary part of the multiplier, which must not vanish."""
        arb = flint().arb
        zero = arb(0)
        path, n = self.path, self.path.size
        u, p, parts, (a, b) = z[:n], z[n], (z[n + 1:2 * n + 1], z[2 * n + 1:3 * n + 1]), z[3 * n + 1:]
        pieces, _ = pieces_along(path, p, 4, 2)
        step, turn = 1 + pieces.ns, pieces.closure
        wide = 3 * n + 3
        F: list = []
        rows: list = []
        base = (path.length - 1) * step
        for own, v in enumerate(parts):
            other, sign = parts[1 - own], 1 - 2 * own  # Re: a vr - b vi; Im: a vi + b vr
            around = [a * x - b * y * sign for x, y in zip(v[:step], other[:step], strict=True)]
            theta = [Jet(u[i * step], v[i * step], zero, zero) for i in range(path.length)]
            y = [[Jet(u[i * step + 1 + c], v[i * step + 1 + c], zero, zero) for c in range(pieces.ns)]
                 for i in range(path.length)]
            close = (Jet(u[0] + arb.pi() * 2 * arb(pieces.span), around[0], zero, zero),
                     [Jet(u[1 + c] * turn, around[1 + c] * turn, zero, zero) for c in range(pieces.ns)])
            solved = evaluate(pieces, theta, y, close)
            rate = (pieces.B[-1] * solved.end[-1]).value
            if own == 0:
                F += solved.F[0]
                rows += [[*solved.J[0][i], solved.F[2][i], *[zero] * (wide - n - 1)] for i in range(n)]
            F += solved.F[1]
            for i in range(n):
                row = [*solved.J[1][i], solved.F[3][i], *[zero] * (wide - n - 1)]
                mine, theirs = n + 1 + own * n, n + 1 + (1 - own) * n
                for k, value in enumerate(solved.J[0][i]):
                    row[mine + k] = value
                c = i - base - 1
                if c >= 0 and c not in pieces.kept:  # the columns of the closing event carry the factor
                    for k, factor in ((0, rate[c, 0]), (1 + c, arb(-turn))):
                        row[mine + k] = row[mine + k] + factor * (a - 1)
                        row[theirs + k] = row[theirs + k] - factor * b * sign
                        row[wide - 2] = row[wide - 2] + factor * v[k]
                        row[wide - 1] = row[wide - 1] - factor * other[k] * sign
                rows.append(row)
        real, imaginary = ([arb(float(x)) for x in part] for part in (self.normal.real, self.normal.imag))
        blank = [zero] * (n + 1)
        for first, second, value in ((real, [-x for x in imaginary], 1), (imaginary, real, 0)):
            F.append(sum((x * y for x, y in zip([*first, *second], [*parts[0], *parts[1]], strict=True)), arb(-value)))
            rows.append([*blank, *first, *second, zero, zero])
        F.append(a * a + b * b - 1)
        rows.append([*blank, *[zero] * (2 * n), a * 2, b * 2])
        return F, rows, b


class Touch:
    """F = 0 and one derivative of the guard of event ``node`` = 0, in (u, p)."""

    def __init__(self, path: Along, node: int):
        self.path, self.node = path, node
        self.scale = path.scale

    def start(self, point: np.ndarray) -> np.ndarray:
        """Return the unknowns of a point."""
        return point

    def evaluate(self, z: list):
        """Return residual, Jacobian, and the next derivative of the guard."""
        arb = flint().arb
        zero = arb(0)
        path, n = self.path, self.path.size
        pieces, _ = pieces_along(path, z[-1], 2, 1)
        step = 1 + pieces.ns
        theta = [Jet(z[i * step], zero) for i in range(path.length)]
        y = [[Jet(v, zero) for v in z[i * step + 1:(i + 1) * step]] for i in range(path.length)]
        close = Jet(z[0] + arb.pi() * 2 * arb(pieces.span), zero), [Jet(z[1 + c] * pieces.closure, zero) for c in range(pieces.ns)]
        solved = evaluate(pieces, theta, y, close)
        i = self.node
        G, B, x = pieces.G[i], pieces.B[i - 1], solved.x[i]
        assert G is not None
        L = G * B
        value = L * x
        further = L * B
        row = [zero] * (n + 1)
        row[i * step] = (further * x).value[0, 0]
        for c in range(pieces.ns):  # the phase moves only the forcing states
            row[i * step] = row[i * step] - L.value[0, c] * (B * x).value[c, 0]
            row[i * step + 1 + c] = L.value[0, c]
        row[n] = value.entry(1, 0, 0, zero)
        J = [[*line, solved.F[1][k]] for k, line in enumerate(solved.J[0])]
        return [*solved.F[0], value.value[0, 0]], [*J, row], (further * x).value[0, 0]


def touching(problem, point, p: float, width: float) -> Touch:
    """Return the extended system of a graze: of a listed event that arrives with zero rate, or of a maximum that no event marks."""
    path = along(problem, point.x, p - width, p + width)
    arb = flint().arb
    model = path.family.balls(arb(p))
    slowest, at_event = SMALL, -1
    for i, item in enumerate(path.transitions):
        if not item.event.guards or point.name == UNLISTED:
            continue
        row = model.guard(item.event.before, *item.event.guards[0])
        x = _joined(path.candidate, i, model)
        B = model.mode(item.event.before).B
        speed = sum((a * (B * x)[k, 0] for k, a in enumerate(row.row)), arb(0))
        size = sum(abs(middle(a)) * w for a, w in zip(row.row, path.candidate.weights, strict=False))  # row: forcing follows
        if abs(middle(speed)) < slowest * size:  # other impacts may be slow too: the last ones of many
            slowest, at_event = abs(middle(speed)) / size, i
    if at_event >= 0:
        return Touch(path, at_event)
    orbit = problem.solution(point.x)
    info = np.zeros(sequence.INFO)
    s = orbit.sequence
    orbit.equations.kernel.monitor(orbit.equations.path.tables, s.nodes, s.fixed, s.span, orbit.equations.closure, orbit.unknowns,
                                   orbit.weights, info)
    if not abs(info[sequence.PEAK]) < SMALL:
        raise Refused("neither a listed event arrives with zero rate, nor does a maximum touch its guard, at this point")
    segment, guard = int(info[sequence.PEAK_SEGMENT]), int(info[sequence.PEAK_GUARD])
    mode = int(s.nodes[segment, sequence.AFTER])
    owner = orbit.scene.guard(mode, guard)
    at = float(info[sequence.PEAK_TIME])
    keys = orbit.scene.keys[mode]
    place: list[int] = []

    def insert(candidate: Candidate) -> Candidate:
        times, states, events = list(candidate.times), list(candidate.states), list(candidate.events)
        here = at
        while here < times[0]:
            here += candidate.span
        k = int(np.searchsorted(times, here, side="right"))
        state = orbit._states(np.array([here]))[0]
        touch = Event(keys, keys, ((owner.element, owner.number),))
        if not any(event.guards for event in events):  # the section is no longer needed: the touch is the first event
            times, states, events, k = [here], [state], [touch], 0
        else:
            times.insert(k, here)
            states.insert(k, state)
            events.insert(k, touch)
        place.append(k)
        return dataclasses.replace(candidate, times=np.array(times), states=np.array(states), events=tuple(events))
    whole = along(problem, point.x, p - width, p + width, touch=insert)
    return Touch(whole, place[0])


def _joined(candidate: Candidate, i: int, model):
    arb = flint().arb
    angle = 2.0 * math.pi * float(candidate.times[i])
    forcing = [1.0]
    for k in model.harmonics:
        forcing += [math.cos(k * angle), math.sin(k * angle)]
    return flint().arb_mat(model.nx, 1, [arb(float(v)) for v in (*candidate.states[i], *forcing)])

