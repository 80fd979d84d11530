"""Floquet exponents from the balance itself (Hill's method), with frozen memory weighted by its delay.

A perturbation dq = e^{lambda t} sum_k p_k e^{i k nu t} turns the linearised equations into H(lambda) p = 0,

    [(lambda + i k nu)^2 M + (lambda + i k nu) C + K] p_k - sum_j R^T [Gu_{k-j} + (lambda + i j nu) Gs_{k-j}] R p_j - d_k = 0

with the Fourier coefficients Gu, Gs of the slopes of all forces along the motion: a quadratic eigenvalue problem.  A mode
with frozen memory z, written at phase w, feels the displacement of that instant, older by t - t_w: in the periodic factor it
carries e^{-lambda (t - t_w)}.  A plain Hill matrix leaves this weight out, which is right for lambda = 0 only, and calls stable
friction orbits unstable.  With the weight the problem is nonlinear in lambda; each exponent is polished by Newton.

Reference: Hill (1886); for the quadratic form, Detroux, Renson, Masset and Kerschen, CMAME 296 (2015), section 2.3.
"""
import numpy as np

from bifurc.hbm.balance import Balance
from bifurc.hbm.contacts.common import GUARD, MODE, WROTE
from bifurc.hbm.floquet.monodromy import JUMP
from bifurc.hbm.floquet.stability import StabilityStatus, exact_twin, multipliers_of, ordered
from bifurc.hbm.laws import compiled
from bifurc.hbm.status import ContactStatus

ITERATIONS = 30
TAIL = 24  # times the kept harmonics: how far the rest of the series is taken into account to first order
PLAIN_SAMPLES = 8  # of law slopes, times the kept harmonics


class Hill:
    """H(lambda) along one motion.

    Parameters
    ----------
    balance : Balance
    x : ndarray (size,)
        Packed motion.
    harmonics : int
        K: perturbations carry harmonics -K .. K of the slowest frequency.

    Attributes
    ----------
    parts : tuple of ndarray
        P0, P1, P2 of the part that is quadratic in lambda, (n (2 K + 1), same) complex.
    memory : bool
        Whether a mode with frozen memory that is written in the period gives a force.

    Raises
    ------
    ValueError
        Set-valued friction; contacts that cannot be followed.

    Notes
    -----
    Forces must be continuous at events, and memory at rest when it is written, as those of springs and of elastic sliders
    under constant load are; the monodromy matrix knows the other cases.
    """

    def __init__(self, balance: Balance, x, harmonics: int):
        if balance.parts.held:
            raise ValueError(StabilityStatus.SET_VALUED.sentence)
        balance = exact_twin(balance) if balance.samples else balance
        parts = balance.parts
        shape, room, T = parts.shape, balance.room, parts.numbers
        status, c, v = balance.follow(x)
        if status is not ContactStatus.FOLLOWED:
            raise ValueError(status.sentence)
        self.K, self.n, self.nu = int(harmonics), int(shape.dims[0]), float(T.omega[0])
        self.order = np.arange(-self.K, self.K + 1)
        self.core = (T.K.copy(), T.C.copy(), T.M.copy())
        count, n = self.order.size, self.n
        self.reach = (TAIL + 1) * self.K if len(parts.contacts) else 2 * self.K
        self.lags = np.arange(-self.reach, self.reach + 1)
        Gu, Gs = np.zeros((self.lags.size, n, n), complex), np.zeros((self.lags.size, n, n), complex)
        self.delayed: list[tuple] = []  # (start, stop, written, left (n,), row (n,) of coordinates, row (n,) of speeds)
        for k in range(len(parts.contacts)):
            self._contact(shape, T, room, k, Gu, Gs)
        if parts.laws:
            self._laws(balance, c, v, Gu, Gs)
        self.slopes = Gu, Gs
        tail = np.arange(self.K + 1, self.reach - self.K + 1)
        self.tail = np.concatenate([-tail[::-1], tail])
        ik = 1j * self.nu * self.order
        lag = self.order[:, None] - self.order[None, :] + self.reach
        blocks = [np.zeros((count, n, count, n), complex) for _ in range(3)]
        for a in range(count):
            blocks[0][a, :, a] = ik[a]**2 * T.M + ik[a] * T.C + T.K
            blocks[1][a, :, a] = 2.0 * ik[a] * T.M + T.C
            blocks[2][a, :, a] = T.M
        U, S = Gu[lag].transpose(0, 2, 1, 3), Gs[lag].transpose(0, 2, 1, 3)
        blocks[0] -= U + S * ik[None, None, :, None]
        blocks[1] -= S
        self.parts = tuple(block.reshape(count * n, count * n) for block in blocks)

    @property
    def memory(self) -> bool:
        """Whether frozen memory takes part."""
        return bool(self.delayed)

    def _contact(self, shape, T, room, k, Gu, Gs):
        """Add the slopes of a contact's segments, and note those with memory."""
        count, Z = int(room.counts[k, 0]), int(shape.memory[k])
        rows = [int(row) for row in shape.rows[k] if row >= 0]
        R = shape.R[rows]
        Q = len(rows)
        written = [(int(room.sources[k, 0]), float(room.sources[k, 1]) - 2.0 * np.pi)]
        start, lags = 0.0, self.lags
        some = (room.paths[k, :count, WROTE] >= 0).any()
        for i in range(count):
            m, stop = int(room.paths[k, i, MODE]), float(room.ends[k, i, 0])
            spectrum = window(-1j * lags, start, stop)
            Gu += np.multiply.outer(spectrum, R.T @ T.FU[k, m, :Q, :Q] @ R)
            Gs += np.multiply.outer(spectrum, R.T @ T.FS[k, m, :Q, :Q] @ R)
            for z in range(Z):
                force = R.T @ T.FZ[k, m, :Q, z]
                if some and force.any() and not shape.algebraic[k, m, z]:
                    writer, phase = written[-1]
                    self.delayed.append((start, stop, phase, force, T.ZU[k, writer, z, :Q] @ R, T.ZS[k, writer, z, :Q] @ R))
            if room.paths[k, i, WROTE] >= 0:
                written.append((int(room.paths[k, i, WROTE]), float(room.ends[k, i, 1])))
            if room.paths[k, i, GUARD] >= 0:
                start = stop

    def _laws(self, balance, c, v, Gu, Gs):
        """Add the slopes of laws, sampled."""
        parts, K = balance.parts, self.K
        shape = parts.shape
        N = max(PLAIN_SAMPLES * max(2 * K, int(shape.waves[-1])), 2 * self.reach + 1)
        angle = 2.0 * np.pi * np.arange(N) / N
        basis = np.ones((shape.waves.size, N))
        basis[1::2] = np.cos(np.multiply.outer(shape.waves[1::2], angle))
        basis[2::2] = np.sin(np.multiply.outer(shape.waves[2::2], angle))
        lags = self.lags
        for law in parts.laws:
            rows = list(law.rows)
            Q = len(rows)
            g = np.empty((Q, 2 * Q, N))
            compiled(law).slopes(parts.numbers.law[law.values], c[rows] @ basis, v[rows] @ basis, g)
            G = np.fft.fft(g, axis=-1)[:, :, lags] / N
            R = shape.R[rows]
            Gu += np.einsum("qa,qpl,pb->lab", R, G[:, :Q], R)
            Gs += np.einsum("qa,qpl,pb->lab", R, G[:, Q:], R)

    def at(self, exponent: complex, weighted: bool = True) -> np.ndarray:
        """Return H(lambda) without its tail; ``weighted=False`` is the plain Hill matrix."""
        P0, P1, P2 = self.parts
        return P0 + exponent * P1 + exponent * exponent * P2 - self._aged(self.order, self.order, exponent, weighted)

    def _aged(self, rows, columns, exponent, weighted=True):
        """Return the forces of frozen memory: harmonics ``rows`` by those of the perturbation, ``columns``."""
        out = np.zeros((rows.size * self.n, columns.size * self.n), complex)
        age = exponent if weighted else 0.0
        for start, stop, phase, force, by_u, by_s in self.delayed:
            left = window(-1j * rows - age / self.nu, start, stop) * np.exp(age * phase / self.nu)
            wave = np.exp(1j * columns * phase)
            right = np.multiply.outer(wave, by_u) + np.multiply.outer(wave * (exponent + 1j * self.nu * columns), by_s)
            out += np.outer(np.multiply.outer(left, force).ravel(), right.ravel())
        return out

    def _forces(self, rows, columns, exponent):
        """Return all forces as `_aged`."""
        lag = rows[:, None] - columns[None, :] + self.reach
        U, S = (part[lag].transpose(0, 2, 1, 3) for part in self.slopes)
        out = U + S * (exponent + 1j * self.nu * columns)[None, None, :, None]
        return out.reshape(rows.size * self.n, columns.size * self.n) + self._aged(rows, columns, exponent)

    def condensed(self, exponent: complex) -> np.ndarray:
        """Return H(lambda) with the harmonics of the tail eliminated, whose own coupling is neglected.

        What is left out falls with two more powers of K than what `at` leaves out.
        """
        out = self.at(exponent)
        if not self.tail.size:
            return out
        K, C, M = self.core
        s = exponent + 1j * self.nu * self.tail
        stiffness = K + s[:, None, None] * C + (s * s)[:, None, None] * M
        down = self._forces(self.tail, self.order, exponent).reshape(self.tail.size, self.n, -1)
        return out - self._forces(self.order, self.tail, exponent) @ np.linalg.solve(stiffness, down).reshape(-1, down.shape[2])

    def polished(self, exponent: complex) -> complex:
        """Return the exponent near a guess, weighted, by Newton on the smallest singular value."""
        for _ in range(ITERATIONS):
            H = self.condensed(exponent)
            u, _, vh = np.linalg.svd(H)
            left, right = u[:, -1].conj(), vh[-1].conj()
            h = 1e-6 * (1.0 + abs(exponent))
            slope = left @ ((self.condensed(exponent + h) - self.condensed(exponent - h)) @ right) / (2.0 * h)
            step = (left @ H @ right) / slope
            exponent = exponent - step
            if abs(step) <= 1e-13 * (1.0 + abs(exponent)):
                break
        return complex(exponent)

    def multipliers(self) -> np.ndarray:
        """Return the 2 n multipliers of the plain (memoryless, or unweighted) problem, largest first."""
        P0, P1, P2 = (part.copy() for part in (self.at(0.0, False), self.parts[1], self.parts[2]))
        if self.delayed:
            h = 1.0
            P1 = 0.5 * (self.at(h, False) - self.at(-h, False)) / h
        size = len(P0)
        low = np.linalg.solve(P2, np.concatenate([P0, P1], axis=1))
        companion = np.block([[np.zeros((size, size)), np.eye(size)], [-low]])
        values, vectors = np.linalg.eig(companion)
        p = np.abs(vectors[:size].reshape(self.order.size, self.n, -1))**2
        weight = p.sum(axis=1)
        middle = np.abs((np.abs(self.order) @ weight) / weight.sum(axis=0))  # converged exponents have centred vectors
        chosen = values[np.argsort(middle)]
        found: list[complex] = []
        turn = 2.0 * np.pi / self.nu
        for value in chosen:  # each multiplier has a copy for every harmonic: the best centred one is taken
            mu = np.exp(value * turn)
            if abs(value.imag) <= 0.5 * self.nu * (1.0 + 1e-9) and len(found) < 2 * self.n:
                found.append(complex(mu))
        return ordered(np.array(found))


def window(rate, start, stop):
    """Return (1/2 pi) times the integral of exp(rate theta) from ``start`` to ``stop`` for an array of rates."""
    rate = np.asarray(rate, complex)
    small = np.abs(rate) < 1e-12
    safe = np.where(small, 1.0, rate)
    return np.where(small, stop - start, (np.exp(safe * stop) - np.exp(safe * start)) / safe) / (2.0 * np.pi)


def hill_multipliers(balance: Balance, x, harmonics: int | None = None) -> np.ndarray:
    """Return the multipliers of a motion from its balance, largest first.

    Memoryless scenes: the quadratic eigenvalue problem, polished where contacts slow its series down.  With memory each
    nonzero multiplier of the monodromy matrix is polished in the delay-weighted problem, which tests one against the other;
    zero multipliers stay.

    Parameters
    ----------
    balance : Balance
    x : ndarray (size,)
        Packed motion.
    harmonics : int, optional
        Default: twice those of the balance.
    """
    top = int(balance.parts.shape.waves[-1])
    hill = Hill(balance, x, 2 * top if harmonics is None else harmonics)
    turn = 2.0 * np.pi / hill.nu
    if not hill.memory:
        mu = hill.multipliers()
        return ordered([np.exp(turn * hill.polished(np.log(m) / turn)) for m in mu]) if balance.parts.contacts else mu
    status, mu = multipliers_of(balance, x)
    if status is not StabilityStatus.KNOWN:
        raise ValueError(status.sentence)
    return ordered([np.exp(turn * hill.polished(np.log(m + 0j) / turn)) if abs(m) > JUMP else 0.0 for m in mu])
