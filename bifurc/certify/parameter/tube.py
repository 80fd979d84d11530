"""A piece of a branch in a tube: one smooth curve of orbits in it, and no special point on it.

About a point z0 = (u, p) of the branch, with its tangent t, half its bend c and the row r of a plane across it,

    F(z0 + t d + c d^2 + y) = 0,   r y = 0,   |d| <= h,

has for every d one solution y in the box Y, and only one, when Krawczyk's operator with the whole range of d in it maps Y into its
interior.  Residual and Jacobian over the range are Taylor forms in d.  The parameter is one of the unknowns, so that a fold is
nothing special; the plane is across the chord of the piece.  In the same tube are tested

    the tangent has a component along p       no fold and no branch point (det F_u = 0 there),
    det F_u(-1) does not vanish               no period doubling,
    the multipliers keep off the unit circle  no Neimark-Sacker point,
    all guards, arriving speeds, durations    no grazing, no onset, nothing passed unnoticed.
"""
from typing import Any, NamedTuple

import numpy as np

from ..arithmetic.balls import below, flint, middle, size
from ..arithmetic.forms import Form, Reach, hull
from ..orbit import Proof, admit
from ..spectrum import characteristic, inside_count, reduced, saltations
from .sheet import Node, Sheet

WIDER = 2.5  # box tried over the residual
FLOOR = 1e-12  # of the box, scaled
OVERHANG, ROUNDING = 1e-6, 1e-13  # of a tube beyond its ends: relative, and scaled


class Piece(NamedTuple):
    """What became of the piece between two nodes."""

    joined: bool  # one curve leads from node to node
    missing: str  # why special points on it are not ruled out; empty: they are
    centre: Node | None


def piece(sheet: Sheet, a: Node, b: Node) -> Piece:
    """Return what is proved of the piece between two nodes."""
    scale = sheet.path.scale
    chord = b.z - a.z
    length = float(np.linalg.norm(chord / scale))
    row = chord / scale**2 / length
    ta, tb = a.tangent / (row @ a.tangent), b.tangent / (row @ b.tangent)
    guess = 0.5 * (a.z + b.z) + 0.125 * length * (ta - tb)
    found = sheet.corrected(guess, row)
    if found is None:
        return Piece(False, "Newton does not reach the branch there", None)
    z, t, inverse = found
    tube = Tube(sheet, z, t, (tb - ta) / (2.0 * length), inverse, row, 0.5 * length * (1.0 + OVERHANG) + ROUNDING)
    missing = tube.contract()
    if not missing and not (tube.holds(a) and tube.holds(b)):
        missing = "the ends of the piece do not lie in its tube"
    if missing:
        return Piece(False, missing, sheet.proved(z, t, inverse, row))
    missing = tube.regular() or tube.flipless() or tube.torusless() or tube.admissible()
    return Piece(True, missing, sheet.proved(z, t, inverse, row) if missing else None)


class Tube:
    """The tube about a parabola; see the head of the module."""

    def __init__(self, sheet: Sheet, z, t, c, inverse, row, h: float):
        self.sheet, self.path = sheet, sheet.path
        self.z, self.t, self.c, self.row, self.h = z, t, c, row, h
        arb, matrix = flint().arb, flint().arb_mat
        self.N = len(z)
        self.Y = matrix(self.N, self.N, inverse.ravel().tolist())
        self.fine, self.coarse = Reach(h, 2), Reach(h, 1)
        self.forms = [Form(self.fine, arb(float(a)), arb(float(b)), arb(float(e))) for a, b, e in zip(z, t, c, strict=True)]

    def contract(self) -> str:
        """Find the box Y; return why there is none, or an empty string."""
        arb, matrix = flint().arb, flint().arb_mat
        N, scale = self.N, self.path.scale
        solved, _, _ = self.sheet.evaluate(self.forms, slopes=False)
        F = solved.F[0]
        rows = [[v.parts[k] if isinstance(v, Form) else (v if k == 0 else None) for v in F] for k in range(3)]
        parts = [self.Y * matrix(N, 1, [*[arb(0) if v is None else v for v in line], arb(0)]) for line in rows]
        shift = Form(self.fine, *parts).value
        box = [arb(0, WIDER * size(shift[i, 0]) + FLOOR * scale[i]) for i in range(N)]
        if not all(v.is_finite() for v in box):
            return "the residual along the piece is not finite"
        for _ in range(2):
            z = [form.lower(self.coarse) + y for form, y in zip(self.forms, box, strict=True)]
            self.solved, self.pieces, J = self.sheet.evaluate(z)
            self.J = J
            A = form_matrix(self.coarse, [*J, [arb(float(v)) for v in self.row]])
            C = (self.Y * A).each(lambda a: a * -1)
            C = Form(self.coarse, C.parts[0] + eye(N), C.parts[1])
            over = C.value
            new = over * matrix(N, 1, box)
            image = [new[i, 0] - shift[i, 0] for i in range(N)]
            if not all(v.is_finite() for v in image):
                return "the Jacobian along the piece is not finite"
            if all(y.contains_interior(k) for y, k in zip(box, image, strict=True)):
                self.C, self.over, self.box = C, over, [arb(0, size(k)) for k in image]
                self.inside = box
                return ""
            if self.norm(over) > 0.8:
                break
            box = [arb(0, 2.0 * max(size(k), size(y))) for k, y in zip(image, box, strict=True)]
        return "the piece is too long for a proof"

    def norm(self, C) -> float:
        """Return a bound of the norm of a matrix in scaled unknowns."""
        scale = self.path.scale
        return max(sum(size(C[i, j]) * scale[j] for j in range(C.ncols())) / scale[i] for i in range(C.nrows())) * (1 + 1e-12)

    def holds(self, node: Node) -> bool:
        """Return whether a proved point lies in the tube, so that it is the one of its plane."""
        arb = flint().arb
        row = [arb(float(v)) for v in self.row]
        away = [b - arb(float(v)) for b, v in zip(node.box, self.z, strict=True)]
        rt, rc, ra = (sum((r * v for r, v in zip(row, vector, strict=True)), arb(0))
                      for vector in ([arb(float(v)) for v in self.t], [arb(float(v)) for v in self.c], away))
        d = (ra - self.fine.square * rc) / rt
        if not self.fine.d.contains(d):
            return False
        return all(y.contains(v - arb(float(t)) * d - arb(float(c)) * d * d)
                   for y, v, t, c in zip(self.inside, away, self.t, self.c, strict=True))

    def regular(self) -> str:
        """Return why a fold or branch point may lie in the tube, or an empty string."""
        arb, matrix = flint().arb, flint().arb_mat
        N, scale = self.N, self.path.scale
        first = matrix(N, 1, [self.Y[i, N - 1] for i in range(N)])
        one = (self.C * first).value
        norm = self.norm(self.over)
        if norm >= 1.0:
            return "a fold or branch point is near"
        left = max(size(one[i, 0]) / scale[i] for i in range(N)) * norm / (1.0 - norm) * (1.0 + 1e-12)
        along = first[N - 1, 0] + one[N - 1, 0] + arb(0, left * scale[-1])
        return "a fold or branch point is near" if along.contains(0) else ""

    def flipless(self) -> str:
        """Return why a multiplier -1 may occur, or an empty string."""
        n = self.N - 1
        pieces, solved = self.pieces, self.solved
        base = (self.path.length - 1) * (1 + pieces.ns)
        rate = (pieces.B[-1] * solved.end[-1]).parts[0]
        rows = []
        for i in range(n):
            line = list(self.J[i][:n])
            c = i - base - 1
            if c >= 0 and c not in pieces.kept:  # the columns of the closing event carry the factor -1
                line[0] = line[0] + rate[c, 0] * -2
                line[1 + c] = line[1 + c] + 2 * pieces.closure
            rows.append(line)
        A = form_matrix(self.coarse, rows)
        floats = np.array([[middle(A.parts[0][i, j]) for j in range(n)] for i in range(n)])
        scale = self.path.scale[:n]
        try:
            inverse = np.linalg.inv(floats * scale) * scale[:, None]
        except np.linalg.LinAlgError:
            return "a period doubling is near"
        if not np.isfinite(inverse).all():
            return "a period doubling is near"
        C = flint().arb_mat(n, n, inverse.ravel().tolist()) * A
        return "" if self.norm(eye(n) - C.value) < 1.0 else "a period doubling is near"

    def torusless(self) -> str:
        """Return why a pair of multipliers may lie on the unit circle, or an empty string."""
        pieces, solved = self.pieces, self.solved
        places = [c for c in range(pieces.ns) if c not in pieces.kept]
        if len(places) < 2:
            return ""
        arb = flint().arb
        jumps = saltations(pieces, solved)
        if jumps is None:
            return "an event arrives with no speed"
        if len(places) == 2 and pieces.ns == 2:  # their product: no pair on the circle unless it is one
            product = arb(1)
            for i, S in enumerate(jumps):
                B = pieces.B[i].parts[0]
                product = product * hull((B[0, 0] + B[1, 1]) * solved.span[i].parts[0]).exp()
                product = product * hull(S[0, 0] * S[1, 1] - S[0, 1] * S[1, 0])
            return "" if abs(product) < 1 or abs(product) > 1 else "a pair of multipliers may lie on the unit circle"
        M: Any = None
        for Phi, S in zip(solved.flow, jumps, strict=True):
            one = Phi.parts[0] * S
            M = one if M is None else one * M
        small = M.each(lambda a: reduced(a, pieces.ns, pieces.kept, pieces.rows))
        if apart(small) or inside_count(characteristic(small.value)) is not None:
            return ""
        return "a multiplier may lie on the unit circle"

    def admissible(self) -> str:
        """Return which guard or event is not seen to be as listed, or an empty string."""
        path = self.path
        ranges = [hull(form.lower(self.coarse) + y) for form, y in zip(self.forms, self.box, strict=True)]
        model = path.family.balls(ranges[-1])
        found = admit(model, Proof(path.candidate, path.transitions, self.pieces, ranges[:-1], self.solved, 0.0, 0.0))
        if found.verdict is None:
            return found.message
        return "" if found.verdict else f"not admissible: {found.message}"

    @property
    def parameter(self) -> Any:
        """All values of the parameter in the tube."""
        return hull(self.forms[-1]) + self.box[-1]


def apart(M: Form) -> bool:
    """Return whether no eigenvalue of a matrix has modulus one: Gershgorin's discs in the basis of its middle."""
    first, slope, _ = M.parts
    n = first.nrows()
    floats = np.array([[middle(first[i, j]) for j in range(n)] for i in range(n)])
    if not np.isfinite(floats).all():
        return False
    _, V = np.linalg.eig(floats)
    acb, matrix = flint().acb, flint().acb_mat
    basis = matrix(n, n, [acb(float(v.real), float(v.imag)) for v in V.ravel()])
    try:
        inverse = basis.inv()
    except ZeroDivisionError:
        return False
    D = inverse * (matrix(first) * basis)
    if slope is not None:
        D = D + inverse * (matrix(slope) * basis) * acb(M.reach.d)
    for i in range(n):
        reach = sum((abs(D[i, j]) for j in range(n) if j != i), flint().arb(0)).upper()
        centre = abs(D[i, i])
        if not (below(centre - reach) > 1.0 or centre + reach < 1):
            return False
    return True


def eye(n: int):
    """Return the identity."""
    return flint().arb_mat(n, n, [flint().arb(int(i == j)) for i in range(n) for j in range(n)])


def form_matrix(reach: Reach, rows: list) -> Form:
    """Return the matrix of order one of balls and forms."""
    matrix, zero = flint().arb_mat, flint().arb(0)
    shape = len(rows), len(rows[0])
    entries = [v for line in rows for v in line]
    return Form(reach, matrix(*shape, [v.parts[0] if isinstance(v, Form) else v for v in entries]),
                matrix(*shape, [(v.parts[1] if isinstance(v, Form) and v.parts[1] is not None else zero) for v in entries]))
