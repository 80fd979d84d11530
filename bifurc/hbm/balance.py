"""Equations of a balance, and what Python asks of them: residual and derivatives, corrections, segments of the contacts."""
import functools
from typing import NamedTuple

import numpy as np

from ..solve.interrupts import LARGE, interruptible
from ..system import System
from .contacts.common import SOURCE
from .laws import Sampled, law_forces
from .layout import Layout
from .parts import Contact, Numbers, Parts, split, views
from .residual import followed, linearised, motion
from .status import ContactStatus
from .tables import Grid, Room

GRID = 8  # points a shortest wave on which exact events are looked for
LEAST_GRID = 64
LAW_SAMPLES = 8  # a shortest wave, by default: exact for polynomials up to degree 6
LEAST_LAW_SAMPLES = 128


class Segment(NamedTuple):
    """A contact's stay in one mode: phases (radians of the slowest harmonic), mode, memory; what ended it, None: phase 2 pi."""

    start: float
    stop: float
    mode: int
    memory: np.ndarray
    guard: int | None


class Balance:
    """Harmonic balance equations of one system: residual(x) = 0, x packed as `Layout` says.

    Parameters
    ----------
    system : System
    layout : Layout
    samples : int
        Samples a period, at which contacts are integrated and laws taken; 0: contacts are followed event by event.
    law_samples : int, optional
        Samples for laws where contacts are exact; default: `LAW_SAMPLES` a shortest wave.
    parts : Parts, optional
        If the system was split before.

    Attributes
    ----------
    parts : Parts
    size : int
        Number of unknowns.

    Raises
    ------
    ValueError
        See `parts.split`; and for too few samples.

    Examples
    --------
    >>> from bifurc.systems import jenkins_oscillator
    >>> balance = Balance(jenkins_oscillator(), Layout((0, 1, 2, 3), 1))
    >>> balance.residual(np.zeros(balance.size))
    array([ 0., -1.,  0.,  0.,  0.,  0.,  0.])
    """

    def __init__(self, system: System, layout: Layout, samples: int = 0, law_samples: int | None = None,
                 parts: Parts | None = None):
        self.system, self.layout, self.samples = system, layout, int(samples)
        self.parts = split(system, layout) if parts is None else parts
        self.size = layout.size
        top = int(self.parts.shape.waves[-1])
        self.law_samples = self.samples or int(law_samples or max(LEAST_LAW_SAMPLES, LAW_SAMPLES * top))
        for name, count in (("samples", self.samples), ("law_samples", self.law_samples)):
            if count and count < 2 * top + 1:
                raise ValueError(f"{name} = {count} is not enough for harmonic {top}; give at least {2 * top + 1}, and at least "
                                 f"{4 * top + 1} for a cubic law without aliasing")
        self._still = np.zeros_like(self.parts.flat)
        self._free = np.full(len(self.parts.contacts), -1)

    # arrays for kernels

    @functools.cached_property
    def grid(self):
        """Tables of the waves at the samples, or on the grid on which events are looked for."""
        waves = self.parts.shape.waves
        nodes = self.samples or max(LEAST_GRID, GRID * int(waves[-1]))
        angle = np.multiply.outer(waves[1::2], np.arange(nodes + 1)) % nodes * (2.0 * np.pi / nodes)
        cosines, sines = np.cos(angle), np.sin(angle)
        excite, dexcite = np.zeros((2, len(self.parts.shape.excited), nodes + 1))
        for x, slot in enumerate(self.parts.shape.excited.tolist()):
            i, k = (slot - 1) // 2, waves[slot]
            if x:
                excite[x], dexcite[x] = (cosines[i], -k * sines[i]) if slot % 2 else (sines[i], k * cosines[i])
        return Grid(self.samples, cosines, sines, excite, dexcite)

    @functools.cached_property
    def room(self):
        """Arrays that kernels overwrite: those of `walk`, and residual and derivatives."""
        return self.walk._replace(f=np.zeros(self.size), wide=np.zeros((self.size, self.size + 1)))

    @functools.cached_property
    def walk(self):
        """Arrays that kernels overwrite as they follow contacts; without derivatives, which large systems need not hold."""
        _, m, nr, mi, _, nc, M, _, G, Z = (int(v) for v in self.parts.shape.dims[:10])
        top = int(self.parts.shape.waves[-1])
        L, most, nodes = 2 * top + 1, 32 + 8 * top, self.grid.cosines.shape[1]
        return Room(np.zeros((4, nr, nr, L, 2)), np.zeros((nr, m)), np.zeros((nr, m, nr, mi + 1)), np.zeros(0), np.zeros((0, 1)),
                    np.zeros((nc, most, 4), np.int64), np.zeros((nc, most, 2)), np.zeros((nc, most, Z)), np.zeros((nc, SOURCE)),
                    np.zeros((nc, 2), np.int64), np.zeros((nc, M, G, 0 if self.samples else nodes)), np.zeros((4, nr, mi)),
                    np.zeros((4, nr, nodes)), np.zeros((2 if self.samples else 1, M, max(G, Z), nodes)))

    @functools.cached_property
    def _tables(self):
        return Sampled(self.parts.shape.waves, self.parts.shape.place, self.law_samples)

    # equations

    def rows(self, x, flat=None, dflat=None) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return coefficients (nr, mi) of the rows' coordinates and speeds, and their derivatives by the parameter.

        Internal slots: mean, then cosine and sine of each harmonic in `Shape.waves`.
        """
        shape = self.parts.shape
        out = np.empty((4, len(shape.R), shape.waves.size))
        motion(self.parts.structure, shape.R, self.parts.flat if flat is None else flat, self._still if dflat is None else dflat,
               np.ascontiguousarray(x, float), *out)
        return out[0], out[1], out[2], out[3]

    def linearised(self, x, flat=None, dflat=None, slopes: bool = True,
                   listed=None) -> tuple[ContactStatus, np.ndarray, np.ndarray]:
        """Return status, residual (size,) and derivatives (size, size + 1) at ``x``; the last column is by the parameter.

        The arrays are overwritten by the next call.

        Parameters
        ----------
        x : ndarray (size,)
        flat, dflat : ndarray, optional
            Numbers of the system and their derivatives by a parameter; default: the system's own, and zero.
        slopes : bool
            False: only the residual is complete.
        listed : int ndarray (contacts,), optional
            Number of events of each contact in an order of events that is kept, see `residual.followed`; default: as they
            come.
        """
        room, parts = self.room, self.parts
        flat = parts.flat if flat is None else flat
        dflat = self._still if dflat is None else dflat
        x = np.ascontiguousarray(x, float)
        room.spectra[:], room.F[:], room.J[:] = 0.0, 0.0, 0.0
        if parts.laws:
            if not np.isfinite(x).all():
                return ContactStatus.NOT_FINITE, room.f, room.wide
            c, v, _, _ = self.rows(x, flat, dflat)
            law_forces(parts.laws, self._tables, views(flat, parts.shape).law, views(dflat, parts.shape).law, c, v,
                       room.spectra[0], room.spectra[1], room.F, room.J)
        listed = self._free if listed is None else listed
        code = interruptible(self.size >= LARGE, lambda: None, linearised, parts.structure, parts.shape.R, flat, dflat, x,
                             self.grid, slopes, listed, room, 0.0)
        return tuple(ContactStatus)[code], room.f, room.wide

    def residual(self, x) -> np.ndarray:
        """Return the residual (size,), force; NaN where the contacts cannot be followed."""
        status, f, _ = self.linearised(x, slopes=False)
        return f.copy() if status is ContactStatus.FOLLOWED else np.full(self.size, np.nan)

    def jacobian(self, x) -> np.ndarray:
        """Return the derivative of the residual (size, size)."""
        status, _, wide = self.linearised(x)
        return wide[:, :-1].copy() if status is ContactStatus.FOLLOWED else np.full((self.size, self.size), np.nan)

    def stiffness(self, k: int) -> np.ndarray:
        """Return the dynamic stiffness of the linear core at harmonic ``k``, (n, n) complex, acting on phasors a - ib."""
        T = self.parts.numbers
        w = k * T.omega[0]
        return T.K - w * w * T.M + 1j * w * T.C

    def linear_response(self) -> np.ndarray:
        """Return the packed motion without contacts and laws; NaN free: a singular harmonic is left zero."""
        T, layout, out = self.parts.numbers, self.layout, {}
        for k in layout.harmonics:
            slot = layout.slot(k)
            load = T.E[slot] - 1j * T.E[slot + 1] if k else T.E[slot].astype(complex)
            if load.any():
                try:
                    out[k] = np.linalg.solve(self.stiffness(k), load)
                except np.linalg.LinAlgError:
                    out[k] = np.zeros(layout.n)
        return layout.pack(out)

    # contacts along a motion

    def follow(self, x, flat=None) -> tuple[ContactStatus, np.ndarray, np.ndarray]:
        """Follow the contacts along ``x`` into `walk`; return status and coefficients (nr, mi) of coordinates and speeds."""
        c, v, _, _ = self.rows(x, flat)
        room, flat = self.walk, self.parts.flat if flat is None else flat
        code = followed(self.parts.structure, flat, self.grid, c, v, self._free, room)
        return tuple(ContactStatus)[code], c, v

    def guard(self, contact: int, mode: int, guard: int, x, memory) -> np.ndarray:
        """Return a guard along ``x`` as a polynomial in internal slots (mi,), with frozen memory."""
        c, v, _, _ = self.rows(x)
        T, rows = self.parts.numbers, list(self.parts.contacts[contact].rows)
        place = contact, mode, guard
        out = T.GU[place][:len(rows)] @ c[rows] + T.GS[place][:len(rows)] @ v[rows]
        np.add.at(out, self.parts.shape.excited, T.GH[place])
        out[0] += T.GZ[place][:len(memory)] @ memory
        return out

    def segments(self, x) -> tuple[tuple[Segment, ...], ...]:
        """Return, for every contact, its stays in modes along the motion ``x`` over a period from phase 0.

        Raises
        ------
        ValueError
            Where the contacts cannot be followed; the message is the sentence of the `ContactStatus`.
        """
        status, _, _ = self.follow(x)
        if status is not ContactStatus.FOLLOWED:
            raise ValueError(status.sentence)
        room, out = self.walk, []
        for k in range(len(self.parts.contacts)):
            own, start = [], 0.0
            Z = int(self.parts.shape.memory[k])
            for n in range(int(room.counts[k, 0])):
                mode, guard = int(room.paths[k, n, 0]), int(room.paths[k, n, 1])
                stop = float(room.ends[k, n, 0])
                own.append(Segment(start, stop, mode, room.zs[k, n, :Z].copy(), None if guard < 0 else guard))
                start = stop
            out.append(tuple(own))
        return tuple(out)

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """Elements with guards or memory."""
        return self.parts.contacts

    @property
    def numbers(self) -> Numbers:
        """Numbers of the system by name."""
        return self.parts.numbers

    def at(self, system: System) -> "Balance":
        """Return the same balance of another system of the same structure."""
        return Balance(system, self.layout, self.samples, self.law_samples, self.parts.at(system))
