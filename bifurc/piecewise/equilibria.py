"""Equilibria of systems of first order without excitation: of regions, virtual ones included, and of slides."""
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..checks import SYSTEM, checked
from ..content import Content
from ..elements.automaton import Automaton
from ..elements.kinds import EventKind
from ..elements.local import Frame
from ..system import System

RANK = 1e-12  # singular values, of the largest, that are rounding: equilibria fill a continuum
ON = 1e-10  # of the terms of a surface or a control: an equilibrium so near to it is on it


class Rows(NamedTuple):
    """Numbers of one mode: rates (n, n + 1) and exits (exits, n + 1) over (states, 1)."""

    key: str
    rates: np.ndarray
    exits: np.ndarray


@dataclass(frozen=True, eq=False)
class PiecewiseEquilibrium(Content):
    """A state in which the field of a mode vanishes.

    Parameters
    ----------
    state : ndarray (n,)
    mode : str
        Whose field vanishes.
    kind : str
        "regular"; "pseudo": of a slide, where the two fields are opposite; "boundary": on a surface that ends the mode.
    virtual : bool
        The mode does not hold there, so that no motion rests there.
    eigenvalues : ndarray
        1/time; of a slide those on the surface.
    """

    state: np.ndarray
    mode: str
    kind: str
    virtual: bool
    eigenvalues: np.ndarray

    @property
    def stable(self) -> bool | None:
        """Whether motions of the mode come back to it; None where an eigenvalue is zero to rounding."""
        largest = self.eigenvalues.real.max(initial=-np.inf)
        return None if abs(largest) <= RANK * np.abs(self.eigenvalues).max(initial=0.0) else bool(largest < 0.0)

    def __repr__(self):
        words = ("virtual " if self.virtual else "") + self.kind
        stable = {True: "stable", False: "unstable", None: "undecided"}[self.stable]
        return f"PiecewiseEquilibrium({np.array2string(self.state, precision=6)}, {words}, of {self.mode!r}, {stable})"


def rows_of(automaton: Automaton) -> list[Rows]:
    """Return the numbers of all modes in which a motion does not end."""
    frame, final = Frame(0, len(automaton.states), (), None), dict(automaton.final)
    local, exits = {"z": frame.eye}, dict(automaton.exits)
    return [Rows(key, np.array([frame.row(rate, local) for rate in rates]),
                 np.array([frame.row(leave.value, local) for leave in exits[key]]).reshape(-1, frame.nx))
            for key, rates in automaton.rates if key not in final]


@checked(system=SYSTEM)
def equilibria(system: System) -> tuple[PiecewiseEquilibrium, ...]:
    """Return the equilibria of the modes of a system of first order without excitation, one a mode at most.

    Parameters
    ----------
    system : System
        A `PiecewiseSystem` or `HybridSystem` with omega = None.

    Returns
    -------
    tuple of PiecewiseEquilibrium
        Virtual ones too. A mode whose equilibria fill a continuum, or that has none, gives none.

    Raises
    ------
    ValueError
        For another system, or one with excitation.

    Examples
    --------
    >>> import bifurc as bf
    >>> from bifurc.piecewise import equilibria
    >>> A = [[-1.0, 1.0], [-1.0, -0.5]]
    >>> system = bf.PiecewiseSystem("x y", {"-": bf.AffineField(A, lambda mu: [0, mu]),
    ...                                     "+": bf.AffineField(A, lambda mu: [0.5, mu - 1])},
    ...                             [bf.Switch(bf.AffineSurface([0, 1.0]))], mu=0.3)
    >>> [(found.kind, found.virtual) for found in equilibria(system)]
    [('regular', True), ('regular', True), ('pseudo', False)]
    """
    automaton = next((element for element in system.elements if isinstance(element, Automaton)), None)
    if automaton is None or system.omega is not None:
        raise ValueError(f"equilibria: system = {system!r} is not allowed; it must be a PiecewiseSystem or HybridSystem without "
                         "excitation")
    n, found = len(automaton.states), []
    for rows in rows_of(automaton):
        A, b = rows.rates[:, :n], rows.rates[:, n]
        kept = surfaces_of(automaton, rows)
        both, right = np.vstack([A, kept[:, :n]]), -np.append(b, kept[:, n])
        x, _, rank, _ = np.linalg.lstsq(both, right, rcond=RANK)
        terms = np.abs(both).max(axis=1) * np.abs(x).max() + np.abs(right)
        if rank < n or np.any(np.abs(both @ x - right) > 1e3 * RANK * terms):
            continue
        x = np.where(np.abs(x) <= RANK * np.abs(x).max(), 0.0, x)
        values, sizes = rows.exits @ np.append(x, 1.0), np.abs(rows.exits) @ np.append(np.abs(x), 1.0)
        on = np.abs(values) <= ON * sizes
        kind = "boundary" if on.any() else "pseudo" if len(kept) else "regular"
        if len(kept):
            basis = np.linalg.svd(kept[:, :n])[2][len(kept):].T
            A = basis.T @ A @ basis
        found.append(PiecewiseEquilibrium(x, rows.key, kind, bool((values[~on] > 0.0).any()), np.linalg.eigvals(A)))
    return tuple(found)


def surfaces_of(automaton: Automaton, rows: Rows) -> np.ndarray:
    """Return the surfaces (surfaces, n + 1) on which the motion of a mode slides, each once."""
    n = len(automaton.states)
    frame = Frame(0, n, (), None)
    met = [frame.row(leave.value, {"z": frame.eye}) for _, exits in automaton.exits for leave in exits if rows.key in leave.then
           and leave.reset and leave.kind is EventKind.CROSS]
    found: list[np.ndarray] = []
    for h in (h / np.linalg.norm(h[:n]) for h in met):
        speed = np.abs(h[:n] @ rows.rates).max()
        if speed <= RANK * np.abs(rows.rates).max() and not any(abs(abs(h @ other) / (h @ h)) > 1.0 - RANK for other in found):
            found.append(h)
    return np.array(found).reshape(-1, n + 1)
