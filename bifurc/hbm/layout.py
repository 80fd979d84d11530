"""Real packed Fourier coefficients of a periodic motion: harmonic-major, degree of freedom inner.

    q(t) = m + sum_k a_k cos(k theta) + b_k sin(k theta),   theta = omega t / periods,   x = [m, a_1, b_1, a_2, ...]

each entry being a vector over the degrees of freedom (the layout of NLvib, pyHarm, tmdsimpy; Krack & Gross 2019).  The
phasor of a harmonic is a - ib.
"""
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..checks import floats, refused, scalar, whole


@dataclass(frozen=True)
class Layout:
    """Which harmonics a packed vector holds, and where.

    Parameters
    ----------
    harmonics : tuple of int
        Ascending, in multiples of omega / periods; 0 is the mean.
    n : int
        Degrees of freedom.
    periods : int
        Forcing periods of the motion.

    Examples
    --------
    >>> Layout((0, 1, 3), 2).size
    10
    >>> Layout((0, 1, 3), 2).place(3, 1)
    (7, 9)
    """

    harmonics: tuple[int, ...]
    n: int
    periods: int = 1

    def __post_init__(self):
        found = tuple(whole("Layout", "harmonics", k, least=0) for k in self.harmonics)
        if not any(found) or tuple(sorted(set(found))) != found:
            raise ValueError(f"Layout: harmonics = {self.harmonics!r} is not allowed; it must be whole numbers in ascending "
                             "order, each once, at least one of them above 0")
        object.__setattr__(self, "harmonics", found)

    @cached_property
    def positive(self) -> np.ndarray:
        """Harmonics above 0, (nh,) int."""
        return np.array([k for k in self.harmonics if k], np.int64)

    @property
    def mean(self) -> bool:
        """Whether the mean is among the unknowns."""
        return self.harmonics[0] == 0

    @property
    def top(self) -> int:
        """Highest harmonic."""
        return self.harmonics[-1]

    @property
    def slots(self) -> int:
        """Number of coefficients of one degree of freedom."""
        return self.mean + 2 * len(self.positive)

    @property
    def size(self) -> int:
        """Length of the packed vector."""
        return self.slots * self.n

    @cached_property
    def waves(self) -> np.ndarray:
        """Harmonic of each slot, (slots,) int; the mean is 0."""
        return np.concatenate([np.zeros(int(self.mean), np.int64), np.repeat(self.positive, 2)])

    @cached_property
    def is_sine(self) -> np.ndarray:
        """Whether a slot weighs a sine, (slots,) bool."""
        return np.concatenate([np.zeros(int(self.mean), bool), np.tile([False, True], len(self.positive))])

    def slot(self, k: int) -> int:
        """Return the slot of the mean (k = 0) or of the cosine of harmonic ``k``; the sine follows.

        Raises
        ------
        KeyError
            When the harmonic is not listed.
        """
        if k not in self.harmonics:
            raise KeyError(f"harmonic {k} is not listed; there are {', '.join(map(str, self.harmonics))}")
        return 0 if k == 0 else int(self.mean) + 2 * int(np.searchsorted(self.positive, k))

    def place(self, k: int, dof: int) -> tuple[int, ...]:
        """Return the places of (cosine, sine) of harmonic ``k``, or of the mean alone, in the packed vector."""
        first = self.slot(k) * self.n + dof
        return (first,) if k == 0 else (first, first + self.n)

    def matrix(self, x) -> np.ndarray:
        """Return a view of ``x`` (size,) as (slots, n)."""
        return np.reshape(x, (self.slots, self.n))

    def phasor(self, x, k: int, dof: int = 0) -> complex:
        """Return a - ib of harmonic ``k``; the mean for k = 0, and 0 for harmonics that are not listed."""
        if k not in self.harmonics:
            return 0j
        where = self.place(k, dof)
        return complex(x[where[0]], -x[where[1]] if k else 0.0)

    def pack(self, phasors: dict) -> np.ndarray:
        """Return the packed vector of ``{k: phasors (n,)}``; harmonics that are not given are zero."""
        x = np.zeros((self.slots, self.n))
        for k, value in phasors.items():
            slot, value = self.slot(k), np.broadcast_to(np.asarray(value, complex), self.n)
            x[slot] = value.real
            if k:
                x[slot + 1] = -value.imag
        return x.ravel()

    def basis(self, theta) -> np.ndarray:
        """Return cosines and sines at phases ``theta`` (m,), radians of the slowest: (m, slots)."""
        angle = np.multiply.outer(np.asarray(theta, float), self.waves)
        return np.where(self.is_sine, np.sin(angle), np.cos(angle))

    def derivative(self, x) -> np.ndarray:
        """Return the coefficients (size,) of dq/dtheta; times omega / periods they are those of the velocity."""
        q, first = self.matrix(np.asarray(x, float)), int(self.mean)
        out = np.zeros_like(q)
        k = self.positive[:, None]
        out[first::2] = k * q[first + 1::2]
        out[first + 1::2] = -k * q[first::2]
        return out.ravel()

    def values(self, x, theta) -> np.ndarray:
        """Return q (m, n) at phases ``theta`` (m,)."""
        return self.basis(theta) @ self.matrix(x)

    def analysis(self, samples) -> np.ndarray:
        """Return the coefficients (size,) of N equidistant samples of one period, (N, n), the first at theta = 0.

        Raises
        ------
        ValueError
            For fewer than 2 top + 1 samples.
        """
        samples = np.asarray(samples, float).reshape(len(samples), -1)
        if len(samples) < 2 * self.top + 1:
            raise ValueError(f"analysis: {len(samples)} samples are not enough for harmonic {self.top}; give at least "
                             f"{2 * self.top + 1}")
        spectrum = np.fft.rfft(samples, axis=0) * (2.0 / len(samples))
        out = np.where(self.is_sine[:, None], -spectrum.imag[self.waves], spectrum.real[self.waves])
        if self.mean:
            out[0] *= 0.5
        return out.ravel()

    def moved(self, x, other: "Layout") -> np.ndarray:
        """Return the coefficients in another layout: what it does not list is lost, what is new is zero.

        The periods of ``other`` must be a multiple of those of this one, or a divisor whose harmonics are then kept.
        """
        out = np.zeros((other.slots, other.n))
        q = self.matrix(x)
        for k in self.harmonics:
            new = k * other.periods
            if new % self.periods or new // self.periods not in other.harmonics:
                continue
            here, there = self.slot(k), other.slot(new // self.periods)
            out[there] = q[here]
            if k:
                out[there + 1] = q[here + 1]
        return out.ravel()

MOST = 100_000  # a harmonic beyond it is a mistake


def listed(harmonics, periods: int = 1) -> tuple[int, ...]:
    """Return the harmonics of a balance: a whole number H means 0 .. H (in steps of 1/periods), a sequence itself.

    Raises
    ------
    ValueError
        For anything else, naming what is allowed.
    """
    if not isinstance(harmonics, bool) and isinstance(scalar(harmonics), (int, np.integer)):
        return tuple(range(whole("", "harmonics", harmonics, least=1, most=MOST) * periods + 1))
    found = floats(list(harmonics) if isinstance(harmonics, range) else harmonics)
    if found is None or found.ndim != 1 or not found.size or not (np.abs(found) <= MOST).all():
        raise refused("", "harmonics", harmonics, "a whole number or a list of harmonics of the excitation")
    turns = np.round(found * periods)
    if (turns < 0.0).any() or (np.abs(found * periods - turns) > 1e-9).any():
        raise refused("", "harmonics", harmonics, f"such that each times {periods} period(s) is a whole number >= 0")
    if not turns.any():
        raise refused("", "harmonics", harmonics, "a list with a harmonic above 0, which moves")
    if np.unique(turns).size < turns.size:
        raise refused("", "harmonics", harmonics, "a list that names each harmonic once")
    return tuple(np.sort(turns).astype(int).tolist())
