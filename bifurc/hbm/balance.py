"""Equations of a balance, and what Python asks of them: residual, derivatives, events, errors."""
import functools

import numpy as np

from ..system import System
from .layout import Layout
from .parts import Parts, split
from .status import MarchStatus

GRID = 8  # points a shortest wave on which exact events are looked for
LEAST_GRID = 64
SAMPLES = 256  # least number of samples by default


class Work:
    """Arrays that kernels overwrite, allocated once for a structure."""

    def __init__(self, parts: Parts, samples: int):
        shape = parts.shape
        _, m, nr, mi, _, nc, _, _, _, Z = (int(v) for v in shape.dims[:10])
        top = int(shape.waves[-1])
        nodes = samples or max(LEAST_GRID, GRID * top)
        theta = 2.0 * np.pi * np.arange(nodes + 1) / nodes
        angle = np.multiply.outer(shape.waves[1::2], np.arange(nodes + 1)) % nodes * (2.0 * np.pi / nodes)
        self.theta, self.cosines, self.sines = theta, np.cos(angle), np.sin(angle)
        L, most = 2 * top + 1, 32 + 8 * top
        size = m * shape.dims[0]
        self.SU, self.SS, self.PU, self.PS = (np.zeros((nr, nr, L, 2)) for _ in range(4))
        self.F, self.J = np.zeros((nr, m)), np.zeros((nr, m, nr, mi + 1))
        self.f, self.wide = np.zeros(size), np.zeros((size, size + 1))
        self.paths, self.ends, self.zs = np.zeros((nc, most, 4), np.int64), np.zeros((nc, most, 2)), np.zeros((nc, most, Z))
        self.sources, self.counts = np.zeros((nc, 2)), np.zeros((nc, 2), np.int64)

    def clear(self) -> None:
        """Set to zero what kernels add to."""
        for array in (self.SU, self.SS, self.PU, self.PS, self.F, self.J):
            array[:] = 0.0


class Balance:
    """Harmonic balance equations of one system.

    Parameters
    ----------
    system : System
    layout : Layout
    samples : int
        Samples a period for contacts and laws; 0: contacts are exact, and laws take the default.

    Attributes
    ----------
    parts : Parts
    size : int
        Number of unknowns: packed coefficients, see `Layout`.

    Raises
    ------
    ValueError
        See `parts.split`; and for too few samples.
    """

    def __init__(self, system: System, layout: Layout, samples: int = 0, parts: Parts | None = None):
        self.system, self.layout, self.samples = system, layout, int(samples)
        self.parts = split(system, layout) if parts is None else parts
        self.size = layout.size
        top = int(self.parts.shape.waves[-1])
        if self.samples and self.samples < 2 * top + 1:
            raise ValueError(f"samples = {samples} are not enough for harmonic {top}; give at least {2 * top + 1}")
        self._still = np.zeros_like(self.parts.flat)

    @functools.cached_property
    def work(self) -> Work:
        """Arrays for the kernels."""
        return Work(self.parts, self.samples)

    def linearised(self, x, flat=None, dflat=None, slopes: bool = True) -> tuple[MarchStatus, np.ndarray, np.ndarray]:
        """Return status, residual (size,) and derivatives (size, size + 1) at ``x``; the last column is by the parameter.

        Parameters
        ----------
        x : ndarray (size,)
        flat, dflat : ndarray, optional
            Numbers of the system and their derivatives by a parameter; default: the system's own, zero.
        slopes : bool
            False: only the residual is complete.
        """
        from .residual import linearised

        w = self.work
        w.clear()
        flat = self.parts.flat if flat is None else flat
        dflat = self._still if dflat is None else dflat
        code = linearised(self.parts.shape, flat, dflat, np.ascontiguousarray(x, float), self.samples, w.cosines, w.sines, slopes,
                          w.SU, w.SS, w.PU, w.PS, w.F, w.J, w.f, w.wide, w.paths, w.ends, w.zs, w.sources, w.counts)
        return tuple(MarchStatus)[code], w.f, w.wide

    def residual(self, x) -> np.ndarray:
        """Return the residual (size,), force; NaN where the contacts cannot be followed."""
        status, f, _ = self.linearised(x, slopes=False)
        return f.copy() if status is MarchStatus.FOLLOWED else np.full(self.size, np.nan)

    def jacobian(self, x) -> np.ndarray:
        """Return the derivative of the residual (size, size)."""
        status, _, wide = self.linearised(x)
        return wide[:, :-1].copy() if status is MarchStatus.FOLLOWED else np.full((self.size, self.size), np.nan)
