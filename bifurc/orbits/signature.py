"""Event signature of a periodic orbit: which guards fire in which modes, in what order, and how the orbit closes."""
from dataclasses import dataclass

import numpy as np

from ..compose.scene import Scene
from .sequence import AFTER, BEFORE, CLOSES, DIVIDE, GUARD

PROPORTIONAL = 1e-12  # two guard rows within this (relative) are one surface


@dataclass(frozen=True, eq=False)
class Signature:
    """The discrete part of an orbit.

    Parameters
    ----------
    nodes : ndarray (m, 5) of int
        Mode before, guard (-1: section at a fixed time), mode after, order of the trivial root of its closing row, and 1
        where an infinite sequence is closed.
    fixed : ndarray (m,)
        Times of sections, periods.
    span : float
        Forcing periods after which the orbit closes; half of one for orbits solved on the half period.
    closure : int
        1, or -1 when ``y(t + span) = -y(t)``.
    """

    nodes: np.ndarray
    fixed: np.ndarray
    span: float
    closure: int = 1

    @property
    def key(self) -> tuple:
        """What tells signatures apart."""
        return (self.nodes.tobytes(), self.fixed.tobytes(), self.span, self.closure)

    @property
    def events(self) -> int:
        """Number of listed events."""
        return int(np.count_nonzero(self.nodes[:, GUARD] >= 0))

    def signs(self, ns: int) -> np.ndarray:
        """Closing map as signs of the states (ns,)."""
        return np.full(ns, float(self.closure))

    def text(self, scene: Scene) -> str:
        """Return the events in words, e.g. ``rigid_stop.impact / 1 T``."""
        names = [f"{scene.element_name(m, g)}.{scene.event_kind(m, g)}" + ("..." if closes == 1 else "")
                 for m, g, _, _, closes in self.nodes.tolist() if g >= 0]
        parts: list[str] = []
        for name in names:
            if parts and parts[-1].split(" x")[0] == name:
                count = int(parts[-1].split(" x")[1]) if " x" in parts[-1] else 1
                parts[-1] = f"{name} x{count + 1}"
            else:
                parts.append(name)
        still = "rest" if scene.tables.n_holds[self.nodes[0, AFTER]] else "free"
        return f"{', '.join(parts) or still} / {self.span:g} T{' (half)' if self.closure < 0 else ''}"


def sections(mode: int, span: float, closure: int = 1) -> Signature:
    """Return the signature of an orbit without events: one section at phase 0."""
    return Signature(np.array([[mode, -1, mode, 0, 0]]), np.zeros(1), float(span), closure)


def divided(scene: Scene, nodes: np.ndarray, tables=None, closure: int = 1) -> np.ndarray:
    """Return ``nodes`` with the order of the trivial root of every closing row filled in.

    The root is trivial where the interval opened on the surface of the guard that closes it.
    """
    G = (scene.tables if tables is None else tables).G
    nodes = nodes.copy()
    for i in range(len(nodes)):
        opening = nodes[i - 1]
        nodes[i, DIVIDE] = 0
        if nodes[i, GUARD] < 0 or opening[GUARD] < 0:
            continue
        a, b = G[opening[BEFORE], opening[GUARD]], G[opening[AFTER], nodes[i, GUARD]]
        if i == 0 and closure < 0:  # closes on the mirror image of the first event
            image = scene.mirror(int(nodes[0, BEFORE]))
            b = G[image, scene.mirror_guard(int(nodes[0, BEFORE]), int(nodes[0, GUARD]))]
        size = np.sqrt((a @ a) * (b @ b))
        if opening[CLOSES] != 1 and np.any(a[:scene.n]) and size - abs(a @ b) <= PROPORTIONAL * size:
            nodes[i, DIVIDE] = 1
    return nodes


def repeated(scene: Scene, signature: Signature, U: np.ndarray) -> tuple[Signature, np.ndarray]:
    """Return a half-period orbit written out over the full period, with its unknowns (2m (1 + ns),)."""
    if signature.closure > 0:
        return signature, U
    mirrored = signature.nodes.copy()
    for node in mirrored:
        before, guard = int(node[BEFORE]), int(node[GUARD])
        node[BEFORE], node[AFTER] = scene.mirror(before), scene.mirror(int(node[AFTER]))
        if guard >= 0:
            node[GUARD] = scene.mirror_guard(before, guard)
    rows = U.reshape(len(mirrored), -1)
    other = -rows
    other[:, 0] = rows[:, 0] + signature.span
    whole = Signature(np.vstack([signature.nodes, mirrored]), np.concatenate([signature.fixed, signature.fixed + signature.span]),
                      2.0 * signature.span)
    return whole, np.vstack([rows, other]).ravel()
