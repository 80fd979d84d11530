"""A balance condensed to the coordinates that contacts and laws touch: its size no longer depends on the degrees of freedom.

    Z_k q_k = e_k + R^T f_k(R q)   ->   p_k - B Z_k^-1 e_k - H_k S^T f_k(S p) = 0,   H_k = B Z_k^-1 B^T,   R = S B

for every harmonic k, with the independent rows B among the touched ones R and p = B q; afterwards q_k = Z_k^-1 (e_k + R^T f_k).
The forces are those of an ordinary `Balance` on p without a linear part.  The receptances H_k (Krack & Gross 2019, section 2.5)
cost, at a new frequency, for n degrees of freedom, m rows in B and K harmonics,

* O(K n m^2) where the modes of (M, K) diagonalise the damping, after one eigendecomposition O(n^3),
* O(K n^3) otherwise, one factorisation a harmonic,

and nothing while the frequency stays; an evaluation is then O((2 K m)^2) besides the contacts.
"""
import functools
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..system import System
from .balance import Balance
from .layout import Layout
from .parts import Numbers, Parts, length, views
from .status import BalanceStatus, MarchStatus

DEPENDENT = 1e-12  # relative size below which a row is a combination of others
MODAL = 1e-13  # largest coupling of modes by damping, over the largest damping, that is rounding
NEAR = 1e-6  # distance of a harmonic from an undamped resonance, relative, below which contacts are held by a spring
RIGID = 1e-12  # stiffness of a mode over the largest, below which it is free


class Receptance(NamedTuple):
    """What is left of the linear part at a frequency, for the K harmonics of a layout; phasors a - ib.

    ``shift`` (K,) is the stiffness added along B to the linear part and taken from the forces: the equations are the same, and
    finite where the linear part alone is singular (a free body, an undamped resonance).
    """

    H: np.ndarray  # (K, m, m)
    free: np.ndarray  # (K, m) response of the touched coordinates to the load
    dH: np.ndarray  # derivatives by omega
    dfree: np.ndarray
    shift: np.ndarray
    regular: bool  # whether every harmonic could be solved


@dataclass(frozen=True)
class CondensedSolution:
    """Outcome of `Condensed.solve`: ``u`` (size,) touched coordinates, status, Newton steps, largest residual (that of u)."""

    u: np.ndarray
    status: BalanceStatus
    iterations: int
    residual: float

    @property
    def success(self) -> bool:
        """Whether the balance is solved."""
        return self.status is BalanceStatus.CONVERGED

    def __repr__(self) -> str:
        return f"CondensedSolution({self.status.value}, {self.iterations} iterations, residual {self.residual:.1e})"


class Condensed:
    """Equations of a balance in the packed coefficients ``u`` of the touched coordinates p = B q alone.

    Parameters
    ----------
    balance : Balance
        Of n degrees of freedom; events exact or sampled, as it says.  Its numbers must not be changed afterwards.

    Attributes
    ----------
    layout : Layout
        Of the unknowns: the same harmonics, m = len(rows).
    size : int
    rows : ndarray (m, n)
        B.
    modal : bool
        Whether receptances come from the modes of (M, K).

    Raises
    ------
    ValueError
        Where nothing is touched (the motion is `Balance.linear_response`), and for set-valued elements
        (`setvalued_condensed`).

    Examples
    --------
    >>> from bifurc import System
    >>> from bifurc.elements import HarmonicForce, Jenkins
    >>> system = System(np.eye(2), 0.1 * np.eye(2), [[2.0, -1.0], [-1.0, 2.0]], [HarmonicForce(1.0), Jenkins(1.0, 0.1, dof=1)],
    ...                 omega=0.8)
    >>> balance = Balance(system, Layout((0, 1, 2, 3), 2))
    >>> condensed = Condensed(balance)
    >>> condensed.size, balance.size
    (7, 14)
    >>> found = condensed.solve()
    >>> bool(np.abs(balance.residual(condensed.expand(found.u))).max() < 1e-12)
    True
    """

    def __init__(self, balance: Balance):
        parts = balance.parts
        if parts.held:
            raise ValueError(f"Condensed: {parts.held[0].name} is set-valued; use hbm.setvalued_condensed")
        if not parts.shape.R.any():
            raise ValueError(f"Condensed: no contact and no law feels the motion of {balance.system!r}; it is "
                             "Balance.linear_response()")
        self.balance, self.whole = balance, balance.layout
        self.rows, combined = _independent(parts.shape.R)
        self.layout = Layout(self.whole.harmonics, len(self.rows), self.whole.periods)
        self.size = self.layout.size
        self._harmonics = np.array(self.layout.harmonics)
        self._forces = Balance(balance.system, self.layout, balance.samples, balance.law_samples,
                               _without_core(parts, self.layout, combined))
        # numbers that follow the frequency: all but itself are mostly constant (base motion through a dashpot is not)
        flat = self._flat(1.25 * self.omega)
        self._steady = np.array_equal(parts.flat[1:], flat[1:])
        T, probe = parts.numbers, views(flat, parts.shape)
        core = all(np.array_equal(a, b) for a, b in zip((T.M, T.C, T.K), (probe.M, probe.C, probe.K), strict=True))
        self._modes = _modes(T.M, T.C, T.K) if core else None
        top = max(float(np.abs(T.K).max()), self.omega**2 * float(np.abs(T.M).max()))
        self._spring = np.where(self._harmonics == 0, top, 1j * top)  # constant, or the slopes by omega would need its own
        self._still = views(np.zeros_like(parts.flat), parts.shape)
        self._kept: dict[float, tuple] = {}

    @property
    def omega(self) -> float:
        """Excitation frequency of the balance's system."""
        return float(self.balance.parts.numbers.omega[0]) * self.whole.periods

    @property
    def modal(self) -> bool:
        """Whether receptances come from the modes of (M, K)."""
        return self._modes is not None

    # the linear part

    def _flat(self, omega: float) -> np.ndarray:
        """Return the numbers of the system at another frequency: the same core and elements."""
        system = self.balance.system
        return self.balance.parts.flat_of(System(system.mass, system.damping, system.stiffness, system.elements, omega=omega))

    def _numbers(self, omega: float) -> tuple[Numbers, Numbers, np.ndarray, np.ndarray]:
        """Return the numbers at a frequency and their derivatives by it, and those of the contacts as `Balance` takes them."""
        parts, own, periods = self.balance.parts, self._forces.parts, self.whole.periods
        if self._steady:
            flat, slope = own.flat.copy(), np.zeros_like(own.flat)
            flat[0], slope[0] = omega / periods, 1.0 / periods
            return parts.numbers._replace(omega=flat[:1]), self._still._replace(omega=slope[:1]), flat, slope
        step = 1e-3 * omega  # exact for polynomials up to degree 4
        near = [self._flat(omega + i * step) for i in (-2, -1, 1, 2)]
        flat, slope = self._flat(omega), (near[0] - near[3] + 8.0 * (near[2] - near[1])) / (12.0 * step)
        slope[0] = 1.0 / periods
        return (views(flat, parts.shape), views(slope, parts.shape), _moved(flat, parts, own), _moved(slope, parts, own))

    def _at(self, omega: float | None):
        """Return receptance, numbers of the system, and those of the contacts with their derivatives; the last is kept."""
        omega = self.omega if omega is None else float(omega)
        if omega not in self._kept:
            T, dT, flat, slope = self._numbers(omega)
            found = self._modal(T, dT) if self.modal else self._direct(T, dT, range(len(self._harmonics)))
            self._kept = {omega: (found, T, flat, slope)}
        return self._kept[omega]

    def receptance(self, omega: float | None = None) -> Receptance:
        """Return the receptances at a frequency."""
        return self._at(omega)[0]

    def _phasors(self, x) -> np.ndarray:
        """Return a - ib (K, ...) of packed slots (slots, ...)."""
        first = int(self.layout.mean)
        out = x[first::2] - 1j * x[first + 1::2]
        return np.concatenate([x[:1].astype(complex), out]) if first else out

    def _slots(self, phasors) -> np.ndarray:
        """Return packed slots (slots, ...) of phasors (K, ...)."""
        first = int(self.layout.mean)
        out = np.empty((self.layout.slots, *phasors.shape[1:]))
        out[first::2], out[first + 1::2] = phasors.real[first:], -phasors.imag[first:]
        if first:
            out[0] = phasors.real[0]
        return out

    def _divisors(self, T) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return modal dynamic stiffnesses (K, n), harmonics where one is nearly zero (K,), and derivatives by omega."""
        assert self._modes is not None
        _, stiffness, damping = self._modes
        k = self._harmonics[:, None] * 1.0
        w = k * T.omega[0]
        d = stiffness - w * w + 1j * w * damping
        size = np.abs(stiffness) + w * w + np.abs(w * damping)
        near = (np.abs(d) <= NEAR * size + RIGID * np.abs(stiffness).max()).any(axis=1)
        return d, near, (-2.0 * w * k + 1j * k * damping) / self.whole.periods

    @functools.cached_property
    def _touching(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Modes at the touched coordinates (m, n), their products (n, m m), and modal load (K, n)."""
        assert self._modes is not None
        modes = self._modes[0]
        A = self.rows @ modes
        pairs = (A[:, None] * A[None]).reshape(-1, A.shape[1]).T
        return A.astype(complex), np.ascontiguousarray(pairs, complex), self._phasors(self.balance.parts.numbers.E) @ modes

    def _modal(self, T, dT) -> Receptance:
        """Return receptances from the modes; harmonics at an undamped resonance from direct solutions."""
        d, near, slope = self._divisors(T)
        d[near] = 1.0  # replaced below
        A, pairs, load = self._touching
        turn = None
        if not self._steady:
            assert self._modes is not None
            load, turn = self._phasors(T.E) @ self._modes[0], self._phasors(dT.E) @ self._modes[0]
        inverse = 1.0 / d
        change = -slope * inverse * inverse
        m = len(A)
        H, dH = (inverse @ pairs).reshape(-1, m, m), (change @ pairs).reshape(-1, m, m)
        free, dfree = (inverse * load) @ A.T, (change * load) @ A.T
        if turn is not None:
            dfree += (inverse * turn) @ A.T
        found = Receptance(H, free, dH, dfree, np.zeros(len(d), complex), True)
        if near.any():
            other = self._direct(T, dT, np.flatnonzero(near), True)
            for mine, others in zip(found[:5], other[:5], strict=True):
                mine[near] = others[near]
            found = found._replace(regular=other.regular)
        return found

    def _stiffness(self, T, k: int, shift: complex) -> np.ndarray:
        w = k * T.omega[0]
        Z = T.K - w * w * T.M + 1j * w * T.C
        return Z + shift * (self.rows.T @ self.rows) if shift else Z

    def _solved(self, T, i: int, load, shift: complex):
        """Return factors of harmonic number ``i``, Z^-1 B^T and Z^-1 e, and whether they are finite and of sensible size."""
        from scipy.linalg import lapack

        Z = self._stiffness(T, int(self._harmonics[i]), shift)
        right = np.concatenate([self.rows.T, load[i][:, None]], axis=1).astype(complex)
        lu, pivots, info = lapack.zgetrf(Z)
        if info:
            return None, right, False
        found, _ = lapack.zgetrs(lu, pivots, right)
        growth = np.abs(found[:, :-1]).max() * np.abs(Z).max() / np.abs(self.rows).max()
        return (lu, pivots), found, bool(np.isfinite(found).all() and growth < 1.0 / NEAR)

    def _direct(self, T, dT, which, held: bool = False) -> Receptance:
        """Return receptances from one factorisation for each of the harmonics with numbers ``which``; the others are zero.

        ``held``: with the spring in any case; else where it is needed.
        """
        from scipy.linalg import lapack

        K, m, nu = len(self._harmonics), len(self.rows), T.omega[0]
        load, turn = self._phasors(T.E), self._phasors(dT.E)
        H, dH = np.zeros((K, m, m), complex), np.zeros((K, m, m), complex)
        free, dfree, shift, regular = np.zeros((K, m), complex), np.zeros((K, m), complex), np.zeros(K, complex), True
        for i in which:
            factors, found, fine = (None, None, False) if held else self._solved(T, i, load, 0.0)
            if not fine:
                shift[i] = self._spring[i]
                factors, found, _ = self._solved(T, i, load, shift[i])
            if factors is None or found is None or not np.isfinite(found).all():
                regular = False
                continue
            left, _ = lapack.zgetrs(*factors, self.rows.T.astype(complex), trans=1)
            k = int(self._harmonics[i])
            w, dw = k * nu, k / self.whole.periods
            dZ = dT.K - w * w * dT.M - 2.0 * w * dw * T.M + 1j * (w * dT.C + dw * T.C)
            both = self.rows @ found
            change = left.T @ (dZ @ found)
            H[i], free[i], dH[i] = both[:, :-1], both[:, -1], -change[:, :-1]
            dfree[i] = left.T @ turn[i] - change[:, -1]
        return Receptance(H, free, dH, dfree, shift, regular)

    # equations

    def linearised(self, u, omega: float | None = None, slopes: bool = True,
                   load: float = 1.0) -> tuple[MarchStatus, np.ndarray, np.ndarray]:
        """Return status, residual (size,), in the units of u, and derivatives (size, size + 1), the last column by omega.

        Where the contacts cannot be followed, or a harmonic has no solution (see `Receptance`), the arrays are NaN.

        Parameters
        ----------
        u : ndarray (size,)
            Packed coefficients of the touched coordinates.
        omega : float, optional
            Excitation frequency; default that of the system.
        slopes : bool
            False: derivatives are zero.
        load : float
            Factor of the load, dimensionless.
        """
        u = np.ascontiguousarray(u, float)
        found = self.receptance(omega)
        status, f, wide = self._contacts(u, omega, slopes)
        size, shape = self.size, (self.layout.slots, self.layout.n)
        if status is not MarchStatus.FOLLOWED or not found.regular:
            return status, np.full(size, np.nan), np.full((size, size + 1), np.nan)
        q, force = self._phasors(u.reshape(shape)), self._phasors(f.reshape(shape))
        if found.shift.any():
            force = force - found.shift[:, None] * q
        residual = u - self._slots(load * found.free - (found.H @ force[:, :, None])[:, :, 0]).ravel()
        out = np.zeros((size, size + 1))
        if slopes:
            change = self._phasors(wide.reshape(*shape, size + 1))
            if found.shift.any():
                unit = np.eye(size, size + 1).reshape(*shape, size + 1)
                change = change - found.shift[:, None, None] * self._phasors(unit)
            change = found.H @ change
            change[:, :, -1] += (found.dH @ force[:, :, None])[:, :, 0] - load * found.dfree
            out[:] = self._slots(change).reshape(size, size + 1)
            out[np.arange(size), np.arange(size)] += 1.0
        return status, residual, out

    def _contacts(self, u, omega, slopes):
        """Return status, minus the forces along B (size,), and derivatives (size, size + 1), overwritten by the next call."""
        _, _, flat, slope = self._at(omega)
        return self._forces.linearised(u, flat, slope, slopes)

    def residual(self, u, omega: float | None = None, load: float = 1.0) -> np.ndarray:
        """Return the residual (size,), in the units of u; NaN where `linearised` says why."""
        return self.linearised(u, omega, False, load)[1]

    def jacobian(self, u, omega: float | None = None) -> np.ndarray:
        """Return the derivative of the residual (size, size), dimensionless; the load does not enter."""
        return self.linearised(u, omega)[2][:, :-1]

    def restricted(self, x) -> np.ndarray:
        """Return the unknowns (size,) of packed coefficients of all coordinates (whole.size,)."""
        return (self.whole.matrix(np.asarray(x, float)) @ self.rows.T).ravel()

    def linear_response(self, omega: float | None = None) -> np.ndarray:
        """Return the unknowns (size,) without contacts and laws (with the spring that holds a free body, see `Receptance`)."""
        return self._slots(self.receptance(omega).free).ravel()

    def solve(self, u0=None, omega: float | None = None) -> CondensedSolution:
        """Solve the equations by Newton's method.

        Parameters
        ----------
        u0 : ndarray (size,), optional
            Guess; default: the linear response, then rest, then the load raised step by step.
        omega : float, optional
            Excitation frequency; default that of the system.
        """
        from ..solve.newton import NewtonStatus, newton

        if not self.receptance(omega).regular:
            return CondensedSolution(np.zeros(self.size), BalanceStatus.SINGULAR, 0, np.inf)
        count = 0

        def tried(start, load=1.0):
            nonlocal count
            found = newton(lambda u: self.residual(u, omega, load), lambda u: self.jacobian(u, omega), start)
            count += found.iterations
            return found

        starts = [self.linear_response(omega), np.zeros(self.size)] if u0 is None else [np.array(u0, float)]
        for start in starts:
            found = tried(start)
            if found.success:
                break
        if u0 is None and not found.success:
            found = _raised(tried, self.size) or found
        status = {NewtonStatus.CONVERGED: BalanceStatus.CONVERGED, NewtonStatus.SINGULAR: BalanceStatus.SINGULAR,
                  NewtonStatus.NOT_FINITE: BalanceStatus.MARCH_FAILED}.get(found.status, BalanceStatus.NOT_CONVERGED)
        return CondensedSolution(found.x, status, count, float(np.abs(self.residual(found.x, omega)).max()))

    def expand(self, u, omega: float | None = None) -> np.ndarray:
        """Return the packed coefficients of all coordinates (whole.size,) for the unknowns ``u``; NaN where contacts fail."""
        u = np.ascontiguousarray(u, float)
        found, T, _, _ = self._at(omega)
        status, f, _ = self._contacts(u, omega, False)
        if status is not MarchStatus.FOLLOWED or not found.regular:
            return np.full(self.whole.size, np.nan)
        shape = (self.layout.slots, self.layout.n)
        force = self._phasors(f.reshape(shape)) - found.shift[:, None] * self._phasors(u.reshape(shape))
        load = self._phasors(T.E) - force @ self.rows
        out = np.zeros((len(load), self.whole.n), complex)
        near = np.ones(len(load), bool)
        if self._modes is not None:
            modes = self._modes[0]
            d, near, _ = self._divisors(T)
            d[near] = 1.0
            out = ((load @ modes) / d) @ modes.T
        for i in np.flatnonzero(near):
            out[i] = np.linalg.solve(self._stiffness(T, int(self._harmonics[i]), found.shift[i]), load[i])
        return self._slots(out).ravel()

    def __repr__(self):
        way = "modal" if self.modal else "direct"
        return f"Condensed({self.whole.n} degrees of freedom to {len(self.rows)}, {self.size} unknowns, {way} receptance)"


def _raised(tried, size: int):
    """Return Newton's result at the full load, raised from a tenth in steps that halve where it fails; None: it fails."""
    done, step, x = 0.0, 0.1, np.zeros(size)
    while done < 1.0 and step > 1e-3:
        part = min(done + step, 1.0)
        found = tried(x * part / done if done else x, part)
        if found.success:
            x, done, step = found.x, part, 1.5 * step
        else:
            step *= 0.5
    return found if done >= 1.0 else None


def _independent(R) -> tuple[np.ndarray, np.ndarray]:
    """Return independent rows B (m, n) among R (nr, n), and S (nr, m) with R = S B."""
    from scipy.linalg import qr

    size = np.linalg.norm(R, axis=1)
    size[size == 0.0] = 1.0  # of elements that are driven, whatever the system does
    _, triangle, order = qr((R / size[:, None]).T, mode="economic", pivoting=True)
    rank = int((np.abs(np.diag(triangle)) > DEPENDENT).sum())
    if rank == len(R):
        return R.copy(), np.eye(len(R))
    kept = np.sort(order[:rank])
    B = R[kept]
    S = np.linalg.lstsq(B.T, R.T, rcond=None)[0].T
    S[np.abs(S) < DEPENDENT] = 0.0
    S[kept] = np.eye(rank)
    return np.ascontiguousarray(B), np.ascontiguousarray(S)


def _without_core(parts: Parts, layout: Layout, S) -> Parts:
    """Return the contacts and laws of a system on other coordinates (rows R -> S), without mass, damping, stiffness and load."""
    dims = parts.shape.dims.copy()
    dims[0] = layout.n
    shape = parts.shape._replace(dims=dims, R=np.ascontiguousarray(S, float))
    own = replace(parts, layout=layout, shape=shape, flat=np.zeros(length(shape)))
    own.flat[:] = _moved(parts.flat, parts, own)
    return own


def _moved(flat, parts: Parts, own: Parts) -> np.ndarray:
    """Return the numbers of contacts and laws, out of those of the whole system, as the smaller one holds them."""
    out = np.zeros(length(own.shape))
    mine, theirs = views(out, own.shape), views(flat, parts.shape)
    for name, to, come in zip(mine._fields, mine, theirs, strict=True):
        if name not in ("M", "C", "K", "E"):
            to[:] = come
    return out


def _modes(M, C, K) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Return modes (n, n) of unit modal mass, modal stiffness and damping (n,); None where they do not diagonalise C."""
    from scipy.linalg import eigh

    if np.abs(K - K.T).max() > MODAL * np.abs(K).max() or np.abs(M - M.T).max() > MODAL * np.abs(M).max():
        return None
    stiffness, modes = eigh(0.5 * (K + K.T), 0.5 * (M + M.T))
    damping = modes.T @ C @ modes
    own = np.diag(damping).copy()
    if np.abs(damping - np.diag(own)).max() > MODAL * np.abs(damping).max(initial=0.0):
        return None
    return modes, stiffness, own
