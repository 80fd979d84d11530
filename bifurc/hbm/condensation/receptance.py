"""The linear part of a balance as a few rows see it: receptances at any frequency, and the motion behind them.

    Z_k q_k = e_k + B^T f_k,   Z_k = K - w^2 M + i w C,   w = k nu;   y_k = O q_k = O Z_k^-1 e_k + (O Z_k^-1 B^T) f_k

for every harmonic k, with rows B through which forces enter and rows O that are looked at (Krack & Gross 2019, section 2.5).
Four ways, for n degrees of freedom, m rows and K harmonics, all exact:

* modes of (M, K), where they diagonalise the damping: after one eigenproblem of size n, O(K n m^2) a frequency,
* poles of the first-order system, for any other damping: after one eigenproblem of size 2 n, the same (Z^-1 is a sum of
  residues over i w - s); made where many frequencies are asked,
* blocks of poles, where eigenvectors are nearly dependent (critical damping): the Schur form is split into blocks as small as a
  transformation of bounded size leaves them (Bavely & Stewart, SIAM J. Numer. Anal. 16 (1979) 359), and poles that lie together
  stay in one triangular block, through which one substitutes,
* one factorisation a harmonic, O(K n^3): for a single frequency, and where none of the others is accurate.

Where a parameter changes the core in r coordinates alone, the first three serve the core as it was, and the rest is a system of
size r a harmonic (Woodbury); where it changes all of it but leaves the modes as they are (a damping ratio, a modulus), only the
numbers of the modes are new.

One file, because the ways share their rows, their accuracy and the choice between them.
"""
import functools
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh, lapack, schur

from ..layout import Layout
from ..parts import Numbers

MODES, POLES, BLOCKS, FACTORS = "by modes", "by poles", "by blocks of poles", "by factorisation"
MODAL = 1e-13  # largest coupling of modes by damping, over the largest damping, that is rounding
NEAR = 1e-6  # distance of a harmonic from an undamped resonance, relative, below which contacts are held by a spring
RIGID = 1e-12  # stiffness of a mode, or speed of a pole, over the largest, below which it is free
LIGHT = 1e-4  # damping ratio below which a resonance that a step passes may be one between branches that hardly touch
SINGULAR = 1e13  # growth of a solution above which a harmonic has none
DEPENDENT = 1e5  # condition of an eigenvalue from which on poles are left aside
RESIDUE = 1e-12  # relative residual of the sum over poles from which on it is left aside
SPLIT = 1e3  # largest entry of a transformation that separates a block of poles from the rest
FEW = 8  # coordinates in which the core may change for it to be updated, at most
LOST = 1e4  # growth of an update's solution from which on its digits are not given away


def phasors(layout: Layout, x) -> np.ndarray:
    """Return a - ib (K, ...) of packed slots (slots, ...)."""
    first = int(layout.mean)
    out = x[first::2] - 1j * x[first + 1::2]
    return np.concatenate([x[:1].astype(complex), out]) if first else out


def packed(layout: Layout, found) -> np.ndarray:
    """Return packed slots (slots, ...) of phasors (K, ...)."""
    first = int(layout.mean)
    out = np.empty((layout.slots, *found.shape[1:]))
    out[first::2], out[first + 1::2] = found.real[first:], -found.imag[first:]
    if first:
        out[0] = found.real[0]
    return out


class Receptance(NamedTuple):
    """Response of the rows O, m of which are B, at a frequency; phasors a - ib.

    ``shift`` (K,) is the stiffness added along B to the linear part and taken from the forces: the equations are the same, and
    finite where the linear part alone is singular (a free body, an undamped resonance).
    """

    H: np.ndarray  # (K, o, m) to forces along B
    free: np.ndarray  # (K, o) to the load
    dH: np.ndarray  # derivatives by the parameter
    dfree: np.ndarray
    shift: np.ndarray
    regular: bool  # whether every harmonic could be solved
    sign: float  # of the determinant of the mean's stiffness; 1 where it cannot change


@dataclass(frozen=True)
class Terms:
    """Z^-1 = sum over j of out[:, j] into[j] / d_j,   d_j = a_j + i w b_j - w^2 c_j: modes (real), or poles."""

    out: np.ndarray  # (n, N)
    into: np.ndarray  # (N, n)
    a: np.ndarray  # (N,)
    b: np.ndarray
    c: np.ndarray
    floor: float  # of |d|, below which it counts as zero
    light: np.ndarray  # which are nearly undamped
    name: str
    clusters: "Clusters | None" = None  # further terms that do not come one by one

    @functools.cached_property
    def first_order(self) -> bool:
        """Whether every d_j is a_j + i w."""
        return not self.c.any() and bool((self.b == 1.0).all())

    @functools.cached_property
    def sizes(self) -> tuple[np.ndarray, np.ndarray]:
        """Sizes of ``a`` and ``b``."""
        return np.abs(self.a), np.abs(self.b)

    def divisors(self, w) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return d (K, N) at frequencies ``w`` (K,), where one is nearly zero (K,), and the derivative by w, (K, N) or (1, 1)."""
        own, w = self.sizes, w[:, None]
        if self.first_order:
            d, size, slope = self.a + 1j * w, own[0] + w, np.full((1, 1), 1j)
        else:
            square, d, slope = w * w * self.c, np.empty((len(w), len(self.a)), complex), np.empty((len(w), len(self.a)), complex)
            d.real, d.imag, slope.real, slope.imag = self.a - square, w * self.b, -2.0 * w * self.c, self.b
            size = own[0] + w * own[1] + square
        least = NEAR * size + self.floor
        near = np.zeros(len(w), bool)
        if (np.abs(d.real) + np.abs(d.imag) <= 1.5 * least).any():  # the size of a complex number costs ten times as much
            near = (np.abs(d) <= least).any(axis=1)
        if self.clusters is not None:
            s = self.clusters.poles
            near |= (np.abs(1j * w - s) <= NEAR * (np.abs(s) + w) + self.floor).any(axis=1)
        if near.any():
            d[near] = 1.0
        return d, near, slope


@dataclass(frozen=True)
class Clusters:
    """out (i w - T)^-1 into, of poles that lie together: ``T`` (N, N) is upper triangular, in blocks along its diagonal."""

    T: np.ndarray
    out: np.ndarray  # (n, N)
    into: np.ndarray  # (N, n)
    levels: tuple[np.ndarray, ...]  # places by how many others are solved before them

    @functools.cached_property
    def poles(self) -> np.ndarray:
        """Poles (N,)."""
        return np.diag(self.T).copy()

    @functools.cached_property
    def couplings(self) -> tuple[np.ndarray, np.ndarray]:
        """What is above the diagonal, and its transpose."""
        upper = np.triu(self.T, 1)
        return upper, np.ascontiguousarray(upper.T)

    def solved(self, w, right, transposed: bool = False) -> np.ndarray:
        """Return (i w - T)^-1 right (K, N, m), or with the transposed matrix, for ``right`` (N, m) or (K, N, m)."""
        d = 1j * w[:, None, None] - self.poles[:, None]
        d[d == 0.0] = 1.0  # harmonics there are solved directly
        coupling, levels = self.couplings[int(transposed)], self.levels[::-1] if transposed else self.levels
        found = np.zeros((len(w), len(self.T), right.shape[-1]), complex)
        for rows in levels:
            found[:, rows] = (right[..., rows, :] + coupling[rows] @ found) / d[:, rows]
        return found


def modes(M, C, K) -> Terms | None:
    """Return the terms of undamped modes; None where they do not diagonalise the damping."""
    if np.abs(K - K.T).max() > MODAL * np.abs(K).max():
        return None
    stiffness, shapes = eigh(0.5 * (K + K.T), M)
    damping = shapes.T @ C @ shapes
    own = np.diag(damping).copy()
    if np.abs(damping - np.diag(own)).max() > MODAL * np.abs(damping).max(initial=0.0):
        return None
    return Terms(shapes, shapes.T.copy(), stiffness, own, np.ones(len(own)), RIGID * float(np.abs(stiffness).max()),
                 np.abs(own) < 2.0 * LIGHT * np.sqrt(np.abs(stiffness)), MODES)


def poles(M, C, K) -> Terms | None:
    """Return the terms of complex poles; None where their eigenvectors are nearly dependent."""
    n = len(M)
    try:
        A, shapes, size = _first_order(M, C, K)
        s, V = np.linalg.eig(A)
        W = np.linalg.inv(V)
    except np.linalg.LinAlgError:
        return None
    if not np.isfinite(W).all() or np.linalg.norm(W, axis=1).max() > DEPENDENT:
        return None
    return _of_poles(s, shapes @ (V[:n] / size[:, None]), W[:, n:] @ shapes.T, POLES)


def blocks(M, C, K) -> Terms | None:
    """Return the terms of complex poles, those that lie together in clusters; None where that is not accurate either."""
    n = len(M)
    try:
        A, shapes, size = _first_order(M, C, K)
        T, X = schur(A, output="complex")
    except np.linalg.LinAlgError:
        return None
    Y, N, start, parts = X.conj().T.copy(), 2 * n, 0, []
    while start < N:
        stop = start + 1
        while stop < N:
            P = _separating(T, start, stop)
            if P is not None:
                X[:, stop:] += X[:, start:stop] @ P
                Y[start:stop] -= P @ Y[stop:]
                T[start:stop, stop:] = 0.0
                break
            middle = np.diag(T)[start:stop].mean()  # the nearest of the others joins the block
            nearest = stop + int(np.argmin(np.abs(np.diag(T)[stop:] - middle)))
            if nearest > stop:
                T, G, info = lapack.ztrexc(T, np.eye(N, dtype=complex), nearest + 1, stop + 1)
                if info:
                    return None
                X, Y = X @ G, G.conj().T @ Y
            stop += 1
        parts.append(np.arange(start, stop))
        start = stop
    s, growth = np.diag(T).copy(), np.linalg.norm(X, axis=0) * np.linalg.norm(Y, axis=1)
    if not np.isfinite(growth).all() or growth.max() > DEPENDENT:
        return None
    out, into = shapes @ (X[:n] / size[:, None]), Y[:, n:] @ shapes.T
    single = np.array([part[0] for part in parts if len(part) == 1], int)
    many = [part for part in parts if len(part) > 1]
    terms = _of_poles(s[single], out[:, single], into[single], BLOCKS)
    if not many:
        return terms
    joined = np.concatenate(many)
    if (np.abs(s[joined].real) < LIGHT * s[joined].imag).any():  # whose resonances `log_determinant` has to tell
        return None
    own = _clean(T[np.ix_(joined, joined)])
    level = np.zeros(len(own), int)
    for i in range(len(own) - 2, -1, -1):  # behind all that a row reads
        level[i] = max((level[j] + 1 for j in np.flatnonzero(own[i, i + 1:]) + i + 1), default=0)
    levels = tuple(np.flatnonzero(level == i) for i in range(int(level.max()) + 1))
    return replace(terms, clusters=Clusters(own, out[:, joined], into[joined], levels))


def _separating(T, start: int, stop: int) -> np.ndarray | None:
    """Return P with T_11 P - P T_22 = -T_12, of the blocks of a triangular matrix at ``stop`` behind ``start``; None: too large."""
    P = np.zeros((stop - start, len(T) - stop), complex)
    for i in range(stop - start - 1, -1, -1):
        own, right = T[stop:, stop:].copy(order="F"), T[start + i, stop:] + T[start + i, start:stop] @ P
        np.fill_diagonal(own, np.diag(own) - T[start + i, start + i])
        found, failed = lapack.ztrtrs(own, right, trans=1)
        if failed or not np.abs(found).max() <= SPLIT:
            return None
        P[i] = found.ravel()
    return P


def _of_poles(s, out, into, name: str) -> Terms:
    """Return the terms out[:, j] into[j] / (i w - s_j)."""
    top = float(np.abs(s).max(initial=0.0))
    return Terms(out, into, -s, np.ones(len(s)), np.zeros(len(s)), RIGID * top, np.abs(s.real) < LIGHT * s.imag, name)


def _first_order(M, C, K) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the matrix (2 n, 2 n) of (size y, y'), and modes and sizes with q = shapes y: light damping is nearly normal there."""
    n = len(M)
    even, shapes = eigh(0.5 * (K + K.T), M)
    top = float(np.abs(even).max()) or 1.0
    free = np.abs(even) <= RIGID * top
    size = np.sqrt(np.where(free, top, np.abs(even)))
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:] = np.diag(size)
    A[n:, :n] = -(np.diag(np.where(free, 0.0, even)) + _clean(shapes.T @ (0.5 * (K - K.T)) @ shapes)) / size
    A[n:, n:] = -_clean(shapes.T @ C @ shapes)
    return A, shapes, size


def _diagonal(matrices) -> bool:
    """Whether matrices (k, n, n) are diagonal but for the rounding of the largest."""
    rest = matrices * (1.0 - np.eye(matrices.shape[-1]))
    return float(np.abs(rest).max()) <= MODAL * float(np.abs(matrices).max())


def _clean(matrix) -> np.ndarray:
    """Return a matrix without entries that are rounding, to which the eigenvalue solver's scaling would give weight."""
    return np.where(np.abs(matrix) > 4e-16 * np.abs(matrix).max(), matrix, 0.0)


class Changed(NamedTuple):
    """How mass, damping and stiffness change along a parameter."""

    coordinates: np.ndarray  # int (r,) among which they do
    matrices: tuple[np.ndarray, ...]  # (k, n, n) of mass, damping, stiffness: those along the parameter are their combinations

    @property
    def few(self) -> bool:
        """Whether an update pays."""
        return 0 < len(self.coordinates) <= FEW


class LinearPart:
    """Linear core, frequencies and rows of a condensed balance.

    Parameters
    ----------
    T : Numbers
        Of the system: its core.  Frequency and load are given with every call.
    layout : Layout
        Of the balance.
    rows : ndarray (m, n)
        B.
    outputs : ndarray (o, n)
        O; its first m rows are B.
    sweep : bool
        Whether many frequencies will be asked, for which poles pay.
    like : LinearPart, optional
        Whose eigenvectors are shared if the core is the same.
    changed : Changed, optional
        How mass, damping and stiffness will change, where that is known.
    """

    def __init__(self, T: Numbers, layout: Layout, rows, outputs, sweep: bool = False, like: "LinearPart | None" = None,
                 changed: "Changed | None" = None):
        self.M, self.C, self.K, self.layout, self.rows, self.outputs = T.M, T.C, T.K, layout, rows, outputs
        self.harmonics = np.array(layout.harmonics) * 1.0
        known: Terms | None = like.terms if like is not None and self.same_core(like) else None
        self.terms: Terms | None = known if known is not None and (sweep or known.name == MODES) else modes(T.M, T.C, T.K)
        if self.terms is None and sweep:
            for made in (poles, blocks):
                found = made(T.M, T.C, T.K)
                if found is not None and self._residue(T, found) <= RESIDUE:
                    self.terms = found
                    break
        top = max(float(np.abs(T.K).max()), float(T.omega[0] * layout.periods)**2 * float(np.abs(T.M).max()))
        self._spring = np.where(self.harmonics == 0.0, top, 1j * top)  # constant, or its slopes would be needed
        self._kept: tuple | None = None
        self.changed, self._before = np.empty(0, int), None
        self._same_modes = bool(changed is not None and changed.matrices and self.terms is not None and self.terms.name == MODES
                                and all(_diagonal(self.terms.into @ X @ self.terms.out) for X in changed.matrices))
        if changed is not None and changed.few and self.terms is not None and not self._same_modes:
            self.changed, m = changed.coordinates, len(rows)  # their receptances in the core as it is
            inner = np.concatenate([rows, np.eye(len(self.M))[self.changed]])
            self._before = LinearPart(T, layout, inner, np.concatenate([inner, outputs[m:]]), True, self)
            static = self.stiffnesses(T, False) if layout.mean else ()
            self._static_sign = next((float(np.linalg.slogdet(Z.real)[0]) for Z in static), 1.0)

    def same_core(self, other) -> bool:
        """Whether mass, damping and stiffness are those of ``other`` (a `LinearPart`, or `Numbers`)."""
        return all(a is b or np.array_equal(a, b) for a, b in ((self.M, other.M), (self.C, other.C), (self.K, other.K)))

    @property
    def way(self) -> str:
        """How receptances are found, in words."""
        return FACTORS if self.terms is None else self.terms.name

    # receptances

    def receptance(self, T: Numbers, dT: Numbers, moved: bool) -> Receptance:
        """Return the receptances for frequency and load ``T`` and their derivatives for ``dT``.

        ``moved``: the core is that of ``T`` and changes with ``dT``; else both are taken to be the own core, and still.
        """
        if moved and self._same_modes:
            return self._summed(T, dT, self._renewed(T), self._renewed(dT), True)
        if moved:
            return self._direct(T, dT, range(len(self.harmonics)), True) if self._before is None else self._updated(T, dT)
        if self._kept is not None and all(np.array_equal(a, b) for a, b in zip(self._kept[0], (T.omega, dT.omega, T.E, dT.E),
                                                                               strict=True)):
            return self._kept[1]
        found = self._summed(T, dT) if self.terms is not None else self._direct(T, dT, range(len(self.harmonics)), False)
        self._kept = tuple(np.array(value) for value in (T.omega, dT.omega, T.E, dT.E)), found
        return found

    def _residue(self, T, terms: Terms) -> float:
        """Return the largest relative residual of Z X = B^T for the X that the terms give."""
        worst = 0.0
        d, near, _ = terms.divisors(self.harmonics * T.omega[0])
        right = terms.into @ self.rows.T
        for i in np.flatnonzero(~near).tolist():
            Z, X = self._stiffness(T, i, 0.0, False), terms.out @ (right / d[i][:, None])
            if terms.clusters is not None:
                c = terms.clusters
                X = X + c.out @ c.solved(self.harmonics[i:i + 1] * T.omega[0], c.into @ self.rows.T)[0]
            worst = max(worst, float((np.abs(Z @ X - self.rows.T).max(axis=0) / (np.abs(Z) @ np.abs(X)).max(axis=0)).max()))
        return worst

    def _renewed(self, T) -> Terms:
        """Return the terms of modes for other matrices, which they diagonalise, or for derivatives of such matrices."""
        assert self.terms is not None
        ones = self.terms.out.sum(axis=1)  # of a diagonal matrix times ones is its diagonal
        a, b, c = (self.terms.into @ (X @ ones) for X in (T.K, T.C, T.M))
        return replace(self.terms, a=a, b=b, c=c)

    def _summed(self, T, dT, terms: Terms | None = None, change: Terms | None = None, moved: bool = False) -> Receptance:
        """Return receptances from the terms; harmonics at an undamped resonance from direct solutions.

        ``terms``, ``change``: those of ``T`` and their derivatives, where the core moves.
        """
        own = self.terms
        assert own is not None
        terms = own if terms is None else terms
        left, pairs = self._seen(own)
        w = self.harmonics * T.omega[0]
        d, near, slope = terms.divisors(w)
        inverse, size = np.empty_like(d), 1.0 / (d.real**2 + d.imag**2)  # numpy divides complex numbers one by one
        inverse.real, inverse.imag = d.real * size, -d.imag * size
        o, m = len(self.outputs), len(self.rows)
        H, free = (inverse @ pairs).reshape(-1, o, m), np.zeros((len(d), o), complex)
        dH, dfree = np.zeros_like(H), np.zeros_like(free)
        load, turn = phasors(self.layout, T.E), phasors(self.layout, dT.E)
        excited, turned = load.any(axis=1), turn.any(axis=1)  # few of the harmonics
        load = load[excited] @ terms.into.T
        free[excited] = (inverse[excited] * load) @ left.T
        if dT.omega[0] or change is not None:
            rate, square = (-dT.omega[0] * self.harmonics)[:, None] * slope, inverse * inverse
            if change is not None:
                rate = rate - change.a + np.multiply.outer(w * w, change.c) - 1j * np.multiply.outer(w, change.b)
            if rate.shape[1] == 1:  # of poles: one number a harmonic
                dH = (rate * (square @ pairs)).reshape(-1, o, m)
                dfree[excited] = rate[excited] * ((square[excited] * load) @ left.T)
            else:
                square *= rate
                dH, dfree[excited] = (square @ pairs).reshape(-1, o, m), (square[excited] * load) @ left.T
        if turned.any():
            dfree[turned] += (inverse[turned] * (turn[turned] @ terms.into.T)) @ left.T
        if terms.clusters is not None:
            self._clustered(T, dT, terms.clusters, H, free, dH, dfree)
        sign = 1.0 if not moved or np.count_nonzero(terms.a < 0.0) % 2 == 0 else -1.0
        found = Receptance(H, free, dH, dfree, np.zeros(len(d), complex), True, sign)
        if near.any():
            other = self._direct(T, dT, np.flatnonzero(near), moved, True)
            for mine, others in zip(found[:5], other[:5], strict=True):
                mine[near] = others[near]
            found = found._replace(regular=other.regular)
        return found

    def _clustered(self, T, dT, clusters: Clusters, H, free, dH, dfree) -> None:
        """Add what poles give that lie together."""
        w, m = self.harmonics * T.omega[0], len(self.rows)
        left, right = self.outputs @ clusters.out, clusters.into @ self.rows.T
        load, turn = ((phasors(self.layout, E) @ clusters.into.T)[:, :, None] for E in (T.E, dT.E))
        found = clusters.solved(w, np.concatenate([np.broadcast_to(right, (len(w), *right.shape)), load], axis=2))
        seen = left @ found
        H += seen[:, :, :m]
        free += seen[:, :, m]
        if dT.omega[0]:
            back = clusters.solved(w, left.T, True)
            change = (-1j * dT.omega[0] * self.harmonics)[:, None, None] * (back.transpose(0, 2, 1) @ found)
            dH += change[:, :, :m]
            dfree += change[:, :, m]
        if turn.any():
            dfree += (left @ clusters.solved(w, turn))[:, :, 0]

    def _update(self, T) -> np.ndarray:
        """Return by what the dynamic stiffness differs from that of the own core among the coordinates that change, (K, r, r)."""
        w, place = (self.harmonics * T.omega[0])[:, None, None], np.ix_(self.changed, self.changed)
        return (T.K - self.K)[place] - w * w * (T.M - self.M)[place] + 1j * w * (T.C - self.C)[place]

    def _updated(self, T, dT) -> Receptance:
        """Return the receptances where the core differs in few coordinates from the own one, whose receptances are known."""
        before = self._before
        assert before is not None
        G, base, dG, dbase, shift, _, _ = before.receptance(T, dT, False)
        m, r = len(self.rows), len(self.changed)
        own, inside = np.r_[:m, m + r:len(before.outputs)], slice(m, m + r)
        w, dw = (self.harmonics * T.omega[0])[:, None, None], (self.harmonics * dT.omega[0])[:, None, None]
        place = np.ix_(self.changed, self.changed)
        D = self._update(T)
        dD = dT.K[place] - w * w * dT.M[place] + 1j * w * dT.C[place] \
            + dw * (1j * (T.C - self.C)[place] - 2.0 * w * (T.M - self.M)[place])
        square, dsquare = G[:, inside, inside], dG[:, inside, inside]
        joint = np.eye(r) + D @ square
        lost = np.full(len(w), np.inf)
        safe = shift == 0.0
        with np.errstate(all="ignore"):
            determinant = np.linalg.det(joint)
            safe &= np.isfinite(determinant) & (determinant != 0.0)
            inverse = np.zeros_like(joint)
            inverse[safe] = np.linalg.inv(joint[safe])
            lost[safe] = np.abs(inverse[safe]).max(axis=(1, 2)) * (1.0 + np.abs(D @ square)[safe].max(axis=(1, 2)))
        safe &= lost < LOST
        E = inverse @ D
        dE = inverse @ (dD - (dD @ square + D @ dsquare) @ E)
        left, dleft = G[:, own, inside], dG[:, own, inside]
        right = np.concatenate([G[:, inside, :m], base[:, inside, None]], axis=2)
        dright = np.concatenate([dG[:, inside, :m], dbase[:, inside, None]], axis=2)
        part = left @ (E @ right)
        dpart = dleft @ (E @ right) + left @ (dE @ right + E @ dright)
        found = Receptance(G[:, own, :m] - part[:, :, :m], base[:, own] - part[:, :, m], dG[:, own, :m] - dpart[:, :, :m],
                           dbase[:, own] - dpart[:, :, m], np.zeros(len(w), complex), True,
                           self._static_sign * float(np.sign(determinant[0].real)) if self.layout.mean else 1.0)
        if not safe.all():
            other = self._direct(T, dT, np.flatnonzero(~safe), True)
            for mine, others in zip(found[:5], other[:5], strict=True):
                mine[~safe] = others[~safe]
            found = found._replace(regular=other.regular)
            if self.layout.mean and not safe[0]:
                found = found._replace(sign=other.sign)
        return found

    def _seen(self, terms) -> tuple[np.ndarray, np.ndarray]:
        """Return the terms at the outputs (o, N), and their products with those at the rows (N, o m); made once."""
        kept = self.__dict__.get("_products")
        if kept is None or kept[0] is not terms:
            left, right = self.outputs @ terms.out, terms.into @ self.rows.T
            pairs = (left.T[:, :, None] * right[:, None, :]).reshape(len(right), left.shape[0] * right.shape[1])
            kept = self.__dict__["_products"] = terms, left.astype(complex), np.ascontiguousarray(pairs, complex)
        return kept[1:]

    def _stiffness(self, T, i: int, shift: complex, moved: bool) -> np.ndarray:
        M, C, K = (T.M, T.C, T.K) if moved else (self.M, self.C, self.K)
        w = self.harmonics[i] * T.omega[0]
        Z = K - w * w * M + 1j * w * C
        return Z + shift * (self.rows.T @ self.rows) if shift else Z

    def _solved(self, T, i: int, load, shift: complex, moved: bool):
        """Return factors of harmonic number ``i``, Z^-1 [B^T e], and by how much the solution grows, relative to 1 / |Z|."""
        Z = self._stiffness(T, i, shift, moved)
        right = np.concatenate([self.rows.T, load[i][:, None]], axis=1).astype(complex)
        lu, pivots, info = lapack.zgetrf(Z)
        if info:
            return None, right, np.inf
        found, _ = lapack.zgetrs(lu, pivots, right)
        growth = np.abs(found[:, :-1]).max() * np.abs(Z).max() / np.abs(self.rows).max()
        return (lu, pivots), found, float(growth) if np.isfinite(found).all() else np.inf

    def _direct(self, T, dT, which, moved: bool, held: bool = False) -> Receptance:
        """Return receptances from one factorisation for each of the harmonics with numbers ``which``; the others are zero.

        ``held``: with the spring in any case; else where it is needed.
        """
        count, m, o, nu, dnu = len(self.harmonics), len(self.rows), len(self.outputs), T.omega[0], dT.omega[0]
        M, C = (T.M, T.C) if moved else (self.M, self.C)
        load, turn = phasors(self.layout, T.E), phasors(self.layout, dT.E)
        H, dH = np.zeros((count, o, m), complex), np.zeros((count, o, m), complex)
        free, dfree = np.zeros((count, o), complex), np.zeros((count, o), complex)
        shift, regular, sign = np.zeros(count, complex), True, 1.0
        seen = np.asfortranarray(self.outputs.T, complex)
        for i in which:
            factors, found, growth = (None, None, np.inf) if held else self._solved(T, i, load, 0.0, moved)
            if not growth < 1.0 / NEAR:
                shift[i] = self._spring[i]
                factors, found, growth = self._solved(T, i, load, shift[i], moved)
            if factors is None or not growth < SINGULAR:
                regular = False
                continue
            if moved and self.harmonics[i] == 0.0:
                sign = _sign(*factors)
            both = self.outputs @ found
            H[i], free[i] = both[:, :-1], both[:, -1]
            w, dw = self.harmonics[i] * nu, self.harmonics[i] * dnu
            if not (dw or moved or turn[i].any()):
                continue
            left, _ = lapack.zgetrs(*factors, seen, trans=1)
            dZ = dw * (1j * C - 2.0 * w * M)
            if moved:
                dZ = dZ + (dT.K - w * w * dT.M + 1j * w * dT.C)
            change = left.T @ (dZ @ found)
            dH[i], dfree[i] = -change[:, :-1], left.T @ turn[i] - change[:, -1]
        return Receptance(H, free, dH, dfree, shift, regular, sign)

    def log_determinant(self, T: Numbers, moved: bool) -> float:
        """Return the logarithm of the factors d, over their sizes, by which nearly undamped modes enter the determinant.

        That of the whole balance is the condensed one times that of the linear part.  It falls where a harmonic comes near a
        resonance, which is how a branch is kept from stepping over an undamped one onto another branch; damped ones are many
        in a large system, and harmless.
        """
        if moved or self.terms is None or not self.terms.light.any():
            return 0.0
        terms, w = self.terms, (self.harmonics * T.omega[0])[:, None]
        a, b, c = terms.a[terms.light], w * terms.b[terms.light], w * w * terms.c[terms.light]
        part = np.abs(a - c + 1j * b) / (np.abs(a) + np.abs(b) + c)
        return 2.0 * float(np.log(np.maximum(part[w[:, 0] > 0.0], NEAR)).sum())

    # motions of all coordinates

    def motion(self, T: Numbers, load, shift, moved: bool, transposed: bool = False) -> np.ndarray:
        """Return q (K, n) with (Z_k + shift_k B^T B) q_k = load_k (K, n), or the same with the transposed matrix."""
        out, left = np.zeros((len(load), len(self.M)), complex), np.ones(len(load), bool)
        if self.terms is not None and (not moved or self._same_modes):
            d, near, _ = (self._renewed(T) if moved else self.terms).divisors(self.harmonics * T.omega[0])
            into, back = (self.terms.out.T, self.terms.into.T) if transposed else (self.terms.into, self.terms.out)
            out = ((load @ into.T) / d) @ back.T
            if self.terms.clusters is not None:
                c = self.terms.clusters
                into, back = (c.out.T, c.into.T) if transposed else (c.into, c.out)
                out += c.solved(self.harmonics * T.omega[0], (load @ into.T)[:, :, None], transposed)[:, :, 0] @ back.T
            left = near | (shift != 0.0)
        left &= load.any(axis=1)
        for i in np.flatnonzero(left).tolist():
            Z = self._stiffness(T, i, shift[i], moved)
            out[i] = np.linalg.solve(Z.T if transposed else Z, load[i])
        return out

    def stiffnesses(self, T: Numbers, moved: bool):
        """Return the dynamic stiffness (n, n) of every harmonic, one after the other."""
        return (self._stiffness(T, i, 0.0, moved) for i in range(len(self.harmonics)))

    def derived(self, T: Numbers, dT: Numbers, q, moved: bool) -> np.ndarray:
        """Return dZ_k q_k (K, n), the derivative of the dynamic stiffness by the parameter acting on a motion (K, n)."""
        M, C = (T.M, T.C) if moved else (self.M, self.C)
        w, dw = (self.harmonics * T.omega[0])[:, None], (self.harmonics * dT.omega[0])[:, None]
        out = -2.0 * w * dw * (q @ M.T) + 1j * dw * (q @ C.T)
        if moved:
            out += q @ dT.K.T - w * w * (q @ dT.M.T) + 1j * w * (q @ dT.C.T)
        return out


def _sign(lu, pivots) -> float:
    """Return the sign of the determinant of a real matrix from its factors."""
    swaps = int(np.count_nonzero(pivots != np.arange(len(pivots))))
    return float(np.prod(np.sign(np.diag(lu).real))) * (-1.0 if swaps % 2 else 1.0)
