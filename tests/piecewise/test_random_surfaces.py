"""Random relays on two surfaces, driven or with a clock that moves them, against a program with expm, sampled guards and brentq."""
import itertools

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

import bifurc as bf

F, S = bf.AffineField, bf.AffineSurface
STOP, STEP, ON, CLOSE = 6.0, 0.02, 1e-9, 1e-7


def drawn(seed):
    """Return the numbers of a system: x' = A x + b + B u + load cos(2 t) with u = sgn(H x + c + ramp clock), and a start."""
    rng = np.random.default_rng([seed, 99])
    n = int(rng.integers(2, 5))
    A, b = rng.normal(size=(n, n)) - (0.6 + rng.random()) * np.eye(n), 0.4 * rng.normal(size=n)
    B, H = 1.5 * rng.normal(size=(2, n)), rng.normal(size=(2, n))
    for i in range(2):
        B[i] *= -np.sign(H[i] @ B[i]) if rng.random() < 0.8 else 1.0
    c, x, period = 0.3 * rng.normal(size=2), rng.normal(size=n), None
    ramp, load = np.zeros(2), np.zeros(n)
    if rng.random() < 0.4:
        period, ramp = float(rng.uniform(0.7, 1.6)), 0.8 * rng.normal(size=2) * (rng.random(2) < 0.6)
    elif rng.random() < 0.5:
        load = rng.normal(size=n)
    return A, b, B, H, c, ramp, load, period, x


def system_of(A, b, B, H, c, ramp, load, period, x):
    """Return the system of these numbers."""
    sign, cos = {"-": -1.0, "+": 1.0}, {1: load} if load.any() else None
    fields = {p + q: F(A, b + sign[p] * B[0] + sign[q] * B[1], cos=cos) for p in "-+" for q in "-+"}
    more = {"period": period, "clock": {0.0: "decide"}} if period else {"omega": 2.0} if cos else {}
    return bf.PiecewiseSystem([f"x{i}" for i in range(len(x))], fields,
                              [bf.Switch(S(h, level, ramp=rise)) for h, level, rise in zip(H, c, ramp, strict=True)], **more)


class Own:
    """The same motion over (x, 1, cos, sin, clock)."""

    def __init__(self, A, b, B, H, c, ramp, load, period, x):
        n = self.n = len(x)
        self.period = period or np.inf
        self.base, self.H, self.B = np.zeros((n + 4, n + 4)), np.zeros((2, n + 4)), np.zeros((2, n + 4))
        self.base[:n, :n], self.base[:n, n], self.base[:n, n + 1] = A, b, load
        self.base[n + 1, n + 2], self.base[n + 2, n + 1], self.base[n + 3, n] = -2.0, 2.0, 1.0 / self.period
        self.H[:, :n], self.H[:, n], self.H[:, n + 3], self.B[:, :n] = H, c, ramp, B
        self.z = np.concatenate([x, [1.0, 1.0, 0.0, 0.0]])

    def flow(self, mode):
        """Return the matrix of a mode and the controls of the surfaces it slides on; None where these do not attract."""
        M, on = self.base.copy(), [i for i in range(2) if mode[i] == "0"]
        for i in range(2):
            if mode[i] != "0":
                M[:, self.n] += self.B[i] * (1.0 if mode[i] == "+" else -1.0)
        meets = -self.H[on] @ self.B[on].T
        parts = [list(part) for size in range(1, len(on) + 1) for part in itertools.combinations(range(len(on)), size)]
        if any(np.linalg.det(meets[np.ix_(part, part)]) <= 0.0 for part in parts):
            return None, {}
        controls = np.linalg.solve(meets, self.H[on] @ M) if on else []
        return M + sum(np.outer(self.B[i], row) for i, row in zip(on, controls, strict=True)), dict(zip(on, controls, strict=True))

    def mode(self, z):
        """Return the one mode that may hold at ``z``, None where it is not clear which."""
        values, found = self.H @ z, []
        for mode in itertools.product(*("-+0" if abs(value) < ON else "+" if value > 0.0 else "-" for value in values)):
            M, controls = self.flow(mode)
            if M is None:
                continue
            holds = True
            for i, side in enumerate(mode):
                if side == "0":
                    u, rate = controls[i] @ z, controls[i] @ M @ z
                    holds &= abs(u) < 1.0 - 1e-8 or abs(u) < 1.0 + 1e-8 and np.sign(u) * rate < 0.0
                elif abs(values[i]) < ON:
                    first, second = self.H[i] @ M @ z, self.H[i] @ M @ M @ z
                    rate = first if abs(first) > 1e-7 else second
                    if abs(rate) < 1e-6:
                        return None
                    holds &= (rate > 0.0) == (side == "+")
            if holds:
                found.append(mode)
        return found[0] if len(found) == 1 else None

    def final(self):
        """Return the state at `STOP`, None where the motion escapes, grazes, or meets two events at once."""
        t, z, mode = 0.0, self.z, self.mode(self.z)
        while mode is not None and t < STOP - 1e-12:
            M, controls = self.flow(mode)
            whole, rows = expm(M * STEP), []
            for i, side in enumerate(mode):  # each is below zero while the mode lasts
                edge = np.eye(len(z))[self.n]
                rows += [controls[i] - edge, -controls[i] - edge] if side == "0" else [self.H[i] * (1.0 if side == "-" else -1.0)]
            tick = self.period * (np.floor(t / self.period + 1e-9) + 1.0) if self.period < np.inf else np.inf
            end, times, left = min(STOP, tick), [], True
            while t < end - 1e-13 and not times:
                step = min(STEP, end - t)
                after = (whole if step == STEP else expm(M * step)) @ z
                for row in rows:
                    behind = min(1e-5, 0.25 * step) if left and row @ z > -1e-7 else 0.0
                    if row @ expm(M * behind) @ z > 0.0 or row @ after <= 0.0 < row @ expm(0.5 * M * step) @ z:
                        return None
                    if row @ after > 0.0:
                        times.append(brentq(lambda s, M=M, row=row, z=z: row @ expm(M * s) @ z, behind, step, xtol=1e-14))
                if len(times) > 1 and np.ptp(np.sort(times)[:2]) < 1e-7:
                    return None
                z, left = (expm(M * min(times)) @ z, False) if times else (after, False)
                t += min(times, default=step)
            if not times and t >= STOP - 1e-12:
                break
            if not times:
                z[self.n + 3] = 0.0
            mode = self.mode(z)
        return None if mode is None else z[:self.n]


def compared(seed):
    """Return what is wrong with a random system, or an empty string."""
    numbers = drawn(seed)
    wanted, motion = Own(*numbers).final(), bf.simulate(system_of(*numbers), numbers[-1], duration=STOP)
    if wanted is None:
        return "open"
    if not motion.success:
        return f"{motion.status}: {motion.message}"
    apart = np.abs(motion.final[:len(wanted)] - wanted).max()
    return "" if apart <= CLOSE * max(np.abs(motion.y).max(), 1.0) else f"{apart} apart after {len(motion.events)} events"


@pytest.mark.parametrize("seed", [1, 5, *range(20, 26)])
def test_motions_on_two_surfaces_agree(seed):
    assert compared(seed) in ("", "open")


@pytest.mark.slow
def test_a_hundred_motions_on_two_surfaces_agree():
    verdicts = [compared(seed) for seed in range(100, 200)]
    assert [(100 + k, why) for k, why in enumerate(verdicts) if why not in ("", "open")] == [] and verdicts.count("open") < 10
