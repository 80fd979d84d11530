"""Events that always fall on one instant, in one order: which of them is listed first is rounding, and the motion is the same.

Two frictions on one row turn round where its speed is zero, sliders that stuck at one instant slip at one instant.  A motion read
from a simulation lists them in either order, in each of its periods and halves another one: only in one order is it seen that a
part of an orbit repeats or mirrors the other.
"""
import numpy as np

from ...compose.scene import Scene
from ...compose.writer import kernels
from .sequence import AFTER, BEFORE, CLOSES, DIVIDE, ENDING, FOREVER, GUARD, STARTS, TOGETHER
from .signature import Signature, divided

AT_ONCE = 1e-9  # periods between a slip that is rounding and its impact


def in_order(scene: Scene, nodes: np.ndarray, U: np.ndarray, span: float, clock=0.0) -> tuple[Signature, np.ndarray]:
    """Return signature and unknowns (m (1 + ns),) of events ``nodes``, as `divided` gives them, with the unknowns ``U``
    (m (1 + ns),), those of each instant in the order of their elements, as far as each of them may come first.

    Events that another one makes, as an impact does, stay behind it.  ``span`` and ``clock`` are those of a `Signature`; where the
    span is known the first node begins an instant.
    """
    nodes, rows = over(scene, nodes, np.reshape(U, (len(nodes), -1)).copy(), span)
    nodes, rows = without_implied(scene, nodes, rows, span)
    first = next((k for k, node in enumerate(nodes) if node[DIVIDE] != TOGETHER), 0) if span else 0
    if first:
        rows[:first, 0] += span
        nodes, rows = np.roll(nodes, -first, axis=0), np.roll(rows, -first, axis=0)
    together = [k for k in range(1, len(nodes)) if nodes[k, DIVIDE] == TOGETHER]
    changed = bool(together)
    while changed:  # neighbours that change places: an instant has few events
        changed = False
        for k in together:
            made = exchanged(scene, nodes, k)
            if made is not None:
                nodes, changed = made, True
                rows[k, 1:] = behind(scene, nodes[k - 1], rows[k - 1])
    return Signature(nodes, np.zeros(len(nodes)), span, clock=clock), rows.ravel()


def over(scene: Scene, nodes: np.ndarray, rows: np.ndarray, span: float) -> tuple[np.ndarray, np.ndarray]:
    """Return nodes and unknowns (m, 1 + ns) without a turn of friction behind a complete chattering, whose last listed impact turns
    it, that comes before the impacts are over that are not listed: some of those turn it back and forth, the rest has none."""
    T = scene.tables
    for k in np.flatnonzero(nodes[:, CLOSES] == 1).tolist() if len(nodes) > 1 else ():
        later = (k + 1) % len(nodes)
        (mode, guard, during), (event, after) = nodes[k, :DIVIDE].tolist(), nodes[later, GUARD:DIVIDE].tolist()
        if event < 0 or nodes[later, CLOSES] or nodes[later, DIVIDE] == TOGETHER:
            continue
        element, stop = scene.guard(during, event).element, scene.guard(mode, guard).element
        keys = [scene.keys[one][element] for one in (mode, during, after)]
        if element == stop or keys[0] != keys[2] or keys[0] == keys[1]:
            continue
        period = 2.0 * np.pi / T.flat[0] if span else 1.0
        z = np.append(rows[k, 1:], scene.forcing(rows[k, :1] * period)[0])
        speed = float(T.GT[mode, guard, :, 1] @ z)
        wait = (rows[later, 0] - rows[k, 0] + (span if later == 0 else 0.0)) * period
        closure = kernels(scene, "bifurc.flow.chatter").closure
        if speed > 0.0 and 0.0 <= wait <= closure(T, mode, guard, z, speed, np.empty(z.size))[1]:
            plain = nodes[:, :ENDING].copy()
            plain[k, AFTER] = after
            return over(scene, divided(scene, np.delete(plain, later, axis=0)), np.delete(rows, later, axis=0), span)
    return nodes, rows


def without_implied(scene: Scene, nodes: np.ndarray, rows: np.ndarray, span: float) -> tuple[np.ndarray, np.ndarray]:
    """Return nodes and unknowns (m, 1 + ns) without the slips that begin with an impact that ends them, where they would always do
    so: a slider comes back to the stop at which an impact ended its slip, and whether it is beyond its limit there is rounding."""
    k = 0
    while k < len(nodes):
        later = (k + 1) % len(nodes)
        (mode, guard), (during, strikes, after) = nodes[k, :AFTER].tolist(), nodes[later, :DIVIDE].tolist()
        wait = rows[later, 0] - rows[k, 0] + (span if later == 0 else 0.0)
        k += 1
        if wait > AT_ONCE or min(guard, strikes) < 0 or scene.tables.kick[mode, guard] or not scene.tables.kick[during, strikes]:
            continue
        owner = scene.guard(during, strikes)
        guards = scene.guards_of(mode, owner.element)
        if owner.number >= len(guards) or scene.combine(mode, owner.element, scene.keys[after][owner.element]) != after:
            continue
        plain = nodes[:, :ENDING].copy()
        plain[later, [BEFORE, GUARD]] = mode, guards[owner.number]
        made = divided(scene, np.delete(plain, k - 1, axis=0))
        if len(made) and made[k - 2 if k > 1 else -1, STARTS + guard] == FOREVER:
            return without_implied(scene, made, np.delete(rows, k - 1, axis=0), span)
    return nodes, rows


def exchanged(scene: Scene, nodes: np.ndarray, k: int) -> np.ndarray | None:
    """Return the nodes with number ``k``, of the instant of the one before it, in its place; None where its element comes later
    anyway, or where it cannot be the first."""
    first, second = nodes[k - 1, :ENDING].tolist(), nodes[k, :ENDING].tolist()
    one, two = (scene.guard(node[BEFORE], node[GUARD]) for node in (first, second))
    if one.element <= two.element or first[CLOSES] or second[CLOSES] or any(
            scene.tables.kick[node[BEFORE], node[GUARD]] for node in (first, second)):
        return None
    begin, end = first[BEFORE], second[AFTER]
    middle = scene.combine(begin, two.element, scene.keys[end][two.element])
    if middle is None or scene.combine(middle, one.element, scene.keys[end][one.element]) != end:
        return None
    guards = scene.guards_of(begin, two.element), scene.guards_of(middle, one.element)
    if two.number >= len(guards[0]) or one.number >= len(guards[1]):
        return None
    made = nodes[:, :ENDING].copy()
    made[k - 1] = begin, guards[0][two.number], middle, 0, 0
    made[k] = middle, guards[1][one.number], end, 0, 0
    made = divided(scene, made)
    return made if np.array_equal(made[:, DIVIDE] == TOGETHER, nodes[:, DIVIDE] == TOGETHER) else None


def behind(scene: Scene, node: np.ndarray, row: np.ndarray) -> np.ndarray:
    """Return the state (ns,) behind the event of a ``node``, whose time and state before it are ``row`` (1 + ns,)."""
    T = scene.tables
    x, after = np.zeros(T.A.shape[2]), np.zeros(T.A.shape[2])
    x[:scene.ns] = row[1:]
    x[scene.ns:] = scene.forcing(np.array([row[0] * (scene.period or 0.0)]))[0]
    kernels(scene, "bifurc.flow.rule").jump(T, int(node[BEFORE]), int(node[GUARD]), 0, x, after, np.empty((scene.ns, x.size)))
    return after[:scene.ns]
