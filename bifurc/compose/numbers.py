"""Numbers of a scene: local expressions of elements become rows of the joined vector, held rows are eliminated."""
from collections.abc import Hashable
from typing import NamedTuple

import numpy as np

from ..elements import Frame, Law, Mode, Rate, Slaved
from ..system import System
from .tables import Tables

RANK = 1e-12  # held rows whose normalised Gram matrix has a smaller singular value are dependent


class DependentHolds(ValueError):
    """A combination of modes holds rows that depend on each other."""


class LawSite(NamedTuple):
    """A law that acts in a mode, with its numbers: v' = A x + push @ force, force = function(U x, S x, *values).

    The forces of laws also move multipliers, and guards with them: guard = G x + in_guards @ force.
    """

    element: int
    law: Law
    U: np.ndarray  # (rows, nx) coordinates
    S: np.ndarray  # (rows, nx) speeds
    push: np.ndarray  # (n, rows) accelerations by unit forces, held rows respected
    in_guards: np.ndarray  # (guards of the mode, rows)
    values: tuple[float, ...]


class Views(NamedTuple):
    """The named parts of a flat vector, see `Tables`."""

    A: np.ndarray
    G: np.ndarray
    R: np.ndarray
    B: np.ndarray
    D: np.ndarray
    H: np.ndarray
    S: np.ndarray
    ratio: np.ndarray


def views(flat: np.ndarray, like: Tables) -> Views:
    """Return the parts of ``flat`` in the shapes they have in ``like``."""
    parts, start = [], 1
    for name in Views._fields:
        shape = getattr(like, name).shape
        stop = start + getattr(like, name).size
        parts.append(flat[start:stop].reshape(shape))
        start = stop
    return Views(*parts)


class Placed(NamedTuple):
    """A site in a frame: rows of an element, and how impulses meet it."""

    J: np.ndarray  # (rows, n)
    U: np.ndarray  # (rows, nx)
    S: np.ndarray  # (rows, nx)
    rest: np.ndarray  # (rows, nx) part of s' that is not J a
    X: np.ndarray  # (n, rows) M^-1 J^T


class Packer:
    """Fills the numbers of scene modes for one system."""

    def __init__(self, system: System, frame: Frame, slices: list[slice]):
        self.system, self.frame, self.slices = system, frame, slices
        M, C, K, _ = system.core
        n = system.n
        self.inverse = 1.0 / M if n == 1 else np.linalg.inv(M)
        if n > 1 and not np.any(M - np.diag(np.diagonal(M))):
            self.inverse = np.diag(1.0 / np.diagonal(M))
        self.core_rows = np.zeros((n, frame.nx))
        self.core_rows[:, :n] = -self.inverse @ K
        self.core_rows[:, n:2 * n] = -self.inverse @ C
        self.sites = [self._place(element) for element in system.elements]
        self._modes: dict[tuple[int, Hashable], Mode] = {}
        self._loads: dict[tuple[int, Hashable], np.ndarray | None] = {}

    def _place(self, element) -> Placed:
        site = element.site(self.system.n)
        return Placed(site.R, *site.rows(self.frame), self.inverse @ site.R.T)

    def mode(self, element: int, key: Hashable) -> Mode:
        """Return a mode of an element, made once."""
        found = self._modes.get((element, key))
        if found is None:
            found = self._modes[element, key] = self.system.elements[element].mode(key, self.system.core)
            self._check(element, key, found)
        return found

    def _check(self, element: int, key: Hashable, mode: Mode) -> None:
        """Raise ValueError unless a mode fits its site."""
        rows = len(self.sites[element].J)
        name = f"{self.system.labels[element]}, mode {key!r}"
        if not isinstance(mode, Mode):
            raise ValueError(f"{name}: mode(...) returned {mode!r}; it must be a Mode")
        if not isinstance(mode.force, Law) and len(mode.force) not in (0, rows):
            raise ValueError(f"{name}: force has {len(mode.force)} entries; the site has {rows} rows")
        for hold in mode.hold:
            if not 0 <= hold.row < rows or len(hold.push) != rows:
                raise ValueError(f"{name}: {hold!r} does not fit a site of {rows} rows")
        if len(mode.memory) not in (0, len(self.system.elements[element].memory)):
            raise ValueError(f"{name}: memory has {len(mode.memory)} entries; the element names "
                             f"{len(self.system.elements[element].memory)}")
        for guard in mode.guards:
            if guard.kick is not None and not guard.kick.affine:
                raise ValueError(f"{name}: the kick {guard.kick!r} is not affine in the speeds; only affine ones are composed")

    def independent(self, keys: tuple) -> bool:
        """Return whether the rows held by all elements together are independent."""
        H, D = self._held(keys)[:2]
        if len(H) <= 1:
            return True
        gram = H @ self.inverse @ D
        scale = np.sqrt(np.abs(np.diagonal(H @ self.inverse @ H.T)))
        other = np.sqrt(np.abs(np.diagonal(D.T @ self.inverse @ D)))
        return bool(np.linalg.svd(gram / np.outer(scale, other), compute_uv=False)[-1] > RANK)

    def _held(self, keys: tuple) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, list]:
        """Return held rows J (holds, n), pushes J^T push (n, holds), speeds and s' rests (holds, nx), and (element, hold)s."""
        owners = [(e, hold) for e, key in enumerate(keys) for hold in self.mode(e, key).hold]
        n, nx = self.frame.n, self.frame.nx
        J, D = np.empty((len(owners), n)), np.empty((n, len(owners)))
        S, rest = np.empty((len(owners), nx)), np.empty((len(owners), nx))
        for i, (e, hold) in enumerate(owners):
            site = self.sites[e]
            J[i], S[i], rest[i] = site.J[hold.row], site.S[hold.row], site.rest[hold.row]
            D[:, i] = site.J.T @ np.array(hold.push)
        return J, D, S, rest, owners

    def fill(self, flat: np.ndarray, T: Views, all_keys: list[tuple]) -> list[tuple[LawSite, ...]]:
        """Write the numbers of all modes into ``flat`` through its views; return the laws of each mode."""
        flat[0] = 0.0 if self.system.omega is None else self.system.omega
        return [self._fill_mode(T, m, keys) for m, keys in enumerate(all_keys)]

    def _fill_mode(self, T: Views, m: int, keys: tuple) -> tuple[LawSite, ...]:
        frame = self.frame
        n, ns = frame.n, frame.ns
        modes = [self.mode(e, key) for e, key in enumerate(keys)]
        J, D, H, rest, owners = self._held(keys)
        free = self.core_rows.copy()
        for e, key in enumerate(keys):
            load = self._load(e, key)
            if load is not None:
                free += load
        lam = T.H[m, :0]
        solve = None
        if owners:
            X = self.inverse @ D
            solve = 1.0 / (J @ X) if len(owners) == 1 else np.linalg.inv(J @ X)
            lam = -solve @ (J @ free + rest)
            free += X @ lam
            for i, row in enumerate(J):  # a held coordinate stays exactly: no rounding is left in its acceleration
                places = np.flatnonzero(row)
                if places.size == 1:
                    free[places[0]] = 0.0 - rest[i] / row[places[0]]
            T.H[m, :len(owners)] = H
        T.A[m, :n, n:2 * n] = np.eye(n)
        T.A[m, n:2 * n] = free
        g = 0
        laws = [(e, mode.force) for e, mode in enumerate(modes) if isinstance(mode.force, Law)]
        in_guards = {e: [] for e, _ in laws}
        for e, mode in enumerate(modes):
            site = self.sites[e]
            own = [i for i, (owner, _) in enumerate(owners) if owner == e]
            local = {"u": site.U, "s": site.S, "lam": lam[own], "z": np.eye(frame.nx)[self.slices[e]]}
            for i in own:
                if owners[i][1].surface is not None:
                    T.S[m, i] = frame.row(owners[i][1].surface, local)
            for i, memory in enumerate(mode.memory):
                if isinstance(memory, Rate):
                    T.A[m, self.slices[e].start + i] = frame.row(memory.value, local)
            for guard in mode.guards:
                row = T.G[m, g]
                row[:] = frame.row(guard.value, local)
                self._fill_reset(T, m, g, e, mode, guard, local, modes)
                if laws:
                    weights = np.array([guard.value.terms.get(("lam", k), 0.0) for k in range(len(own))])
                    for other, _ in laws:
                        push = -solve[own] @ J @ self.sites[other].X if own else np.zeros((0, len(self.sites[other].J)))
                        in_guards[other].append(weights @ push)
                g += 1
        found = []
        for e, law in laws:
            site = self.sites[e]
            push = site.X if solve is None else site.X - X @ (solve @ (J @ site.X))
            rows = np.array(in_guards[e]).reshape(g, len(site.J))
            found.append(LawSite(e, law, site.U, site.S, push, rows, law.values))
        return tuple(found)

    def _load(self, e: int, key: Hashable) -> np.ndarray | None:
        """Return the accelerations by the affine force of an element, (n, nx); None when it gives none."""
        if (e, key) not in self._loads:
            mode, site = self.mode(e, key), self.sites[e]
            load = None
            if not isinstance(mode.force, Law) and mode.force:
                local = {"u": site.U, "s": site.S, "z": np.eye(self.frame.nx)[self.slices[e]]}
                load = site.X @ np.array([self.frame.row(entry, local) for entry in mode.force])
            self._loads[e, key] = load
        return self._loads[e, key]

    def _fill_reset(self, T: Views, m: int, g: int, e: int, mode: Mode, guard, local: dict, modes: list) -> None:
        """Write the state after a guard: identity, position on the surface, kick, memory of the mode that is left."""
        n, ns = self.frame.n, self.frame.ns
        site, row, R = self.sites[e], T.G[m, g], T.R[m, g]
        R[:, :ns] = np.eye(ns)
        names = guard.value.names
        if "u" in names and names <= {"u", "one", "cos", "sin"}:
            direction = self.inverse @ row[:n]
            direction = direction / (row[:n] @ direction)
            T.D[m, g, :n] = direction
            R[:n] -= np.outer(direction, row)
        if guard.kick is not None:
            W = site.J @ site.X
            constant, slope = guard.kick.impulse(np.zeros(len(W)), W)
            R[n:2 * n] += site.X @ (slope @ site.S)
            R[n:2 * n, ns] += site.X @ constant
            push = np.ones(1)
            if len(W) > 1:
                push = np.array(self.mode(e, guard.accumulates[1]).hold[0].push) if guard.accumulates else slope @ site.J @ row[:n]
            direction = site.X @ push
            T.B[m, g, n:2 * n] = direction / (row[:n] @ direction + (row[n:2 * n] @ T.A[m, n:2 * n, n:2 * n]) @ direction)
        if guard.accumulates is not None:
            T.ratio[m, g] = guard.accumulates[0]
        for i, memory in enumerate(mode.memory):
            if isinstance(memory, Slaved):
                R[self.slices[e].start + i] = self.frame.row(memory.value, local)
