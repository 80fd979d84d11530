"""Event signature of a periodic orbit: which guards fire in which modes, in what order, and how the orbit closes.

One file, because what an event implies of the guards behind it, of memory and of events beside it is one algebra of rows.
"""
import dataclasses
from collections.abc import Hashable
from dataclasses import dataclass

import numpy as np

from ...compose.natural import natural_length, natural_rate
from ...compose.numbers import cancelled
from ...compose.scene import Scene
from ...compose.writer import kernels
from ...elements import EventKind
from ...elements.friction.dry import SLIP_DOWN, SLIP_UP, STICK
from ...elements.site import Rows
from ...elements.stops import FREE
from .births import law_guards, needs_samples, sampled_orders
from .labels import Labels
from .sequence import AFTER, BEFORE, CLOSES, DIVIDE, ENDING, FOREVER, GUARD, KEPT, ODD, STARTS, TOGETHER

PROPORTIONAL = 1e-12  # a row that other rows leave less of (relative) follows from them
MOST = 5  # orders looked at
SEQUENCES = 1024  # of which a scene keeps what `divided` found


@dataclass(frozen=True, eq=False)
class Signature:
    """The discrete part of an orbit.

    Parameters
    ----------
    nodes : ndarray (m, 5 or more) of int
        Mode before, guard (-1: section at a fixed time), mode after, order of the trivial root of its closing row, 1 where
        a complete chattering is closed, and what `divided` adds.
    fixed : ndarray (m,)
        Times of sections, periods; of an autonomous orbit without events the normal (1 over the units of the states) and
        the value of its section, (ns + 1,).
    span : float
        Forcing periods after which the orbit closes; half of one for orbits solved on the half period; 0: unknown, the
        place of the first time among the unknowns holds it (autonomous systems).
    closure : int
        1, or -1 when ``y(t + span) = -y(t)``.
    clock : float
        Unit of all times of an autonomous orbit, time; 0: the forcing period.
    """

    nodes: np.ndarray
    fixed: np.ndarray
    span: float
    closure: int = 1
    clock: float = 0.0

    @property
    def key(self) -> tuple:
        """What tells signatures apart."""
        return (self.nodes.tobytes(), self.fixed.tobytes(), self.span, self.closure, self.clock)

    def written_out(self, U: np.ndarray) -> tuple["Signature", np.ndarray]:
        """Return the orbit with its period as a number and its first node at time zero: as if it were forced with it."""
        if self.span > 0.0:
            return self, U
        times = np.array(U, float)
        times[0] = 0.0
        fixed = np.zeros(len(self.nodes))
        return Signature(self.nodes, fixed, float(U[0]), self.closure, self.clock), times

    @property
    def events(self) -> int:
        """Number of listed events."""
        return int(np.count_nonzero(self.nodes[:, GUARD] >= 0))

    def closing(self, labels: Labels) -> np.ndarray:
        """Return the closing map as the kernels read it (1 + k, ns): the signs of the states, `KEPT` or `ODD` at the places of
        labels, and the rows of these.  Where half a period turns the state round, what nothing changes is zero."""
        signs = np.full(labels.rows.shape[1], float(self.closure))
        signs[list(labels.places)] = KEPT if self.closure > 0 else ODD
        return np.concatenate([signs[None], labels.rows])

    def labels(self, scene: Scene, velocities=False) -> Labels:
        """Return what no event and no mode of the orbit changes: memory never written, rows of coordinates always held; with
        ``velocities`` those of such rows too, where no section puts them to rest.
        """
        T, n = scene.tables, scene.n
        modes = sorted({int(m) for m in self.nodes[:, AFTER]})
        if scene.ns == 2 * n and not T.n_holds[modes].all():
            return Labels((), np.empty((0, scene.ns)))
        unit = np.eye(scene.ns, T.A.shape[2])
        found = [unit[c] for c in range(2 * n, scene.ns) if all(
            not T.A[m, c].any() and c not in [place for place, _ in scene.algebraic(m)] for m in modes)]
        held = [T.H[m, :T.n_holds[m]] for m in modes]
        fixed = [rows[T.S[m, :len(rows)].any(axis=1), n:2 * n] for m, rows in zip(modes, held, strict=True)]
        still = np.unique(np.concatenate(held), axis=0) if all(map(len, held)) else np.empty((0, unit.shape[1]))
        for row in still:  # not carried along by a belt, not on a surface, and held all the time
            if row[scene.ns:].any() or not all(combined_of(row, rows, scene.ns) for rows in held) \
                    or any(len(rows) and combined_of(row[n:2 * n], rows, n) for rows in fixed):
                continue
            found.append(np.concatenate([row[n:2 * n], np.zeros(len(row) - n)]))
            if velocities and self.events == len(self.nodes):
                found.append(row)
        jumps = [slope_of_jump(scene, T, int(m), int(g)) for m, g in self.nodes[:, :AFTER] if g >= 0] if found else []
        kept = [row[:scene.ns] for row in found if all(np.array_equal(row[:scene.ns] @ P, row) for P in jumps)]
        return Labels.of(np.reshape(kept, (-1, scene.ns)))

    def creeping(self, scene: Scene) -> list[int]:
        """Return the elements that, at rest otherwise, slip in one direction only: not back where they began after a period, or by
        nothing, in an interval that rounding tells from none.  At its limit while a stop holds what it acts on, none slips."""
        modes = self.nodes[:, AFTER].tolist() if self.closure > 0 else []
        words = [scene.keys[mode] for mode in modes]
        return [e for e, element in enumerate(scene.system.elements)
                if len(slips := {str(key[e])[:len(SLIP_UP)] for key in words} - {STICK}) == 1 and slips <= {SLIP_UP, SLIP_DOWN}
                and any(key[e] == STICK for key in words) and not np.any((site := element.site(scene.n)).drift)
                and not scene.system.advances(site.R)
                and not all(stands(scene, mode, site) for mode, key in zip(modes, words, strict=True) if key[e] != STICK)]

    def unmoved(self, scene: Scene) -> list[int]:
        """Return the nodes of events that nothing leads to: what is held in the mode before keeps their guard where it is, as the
        force that holds a mass does while all that pushes it stands still.  Zero all the time, it tells no instant."""
        T = scene.tables
        return [] if scene.laws else [
            i for i, (m, g, *_) in enumerate(self.nodes.tolist())
            if g >= 0 and self.nodes[i, DIVIDE] != TOGETHER and T.n_holds[m] and not T.LG[m, g].any()
            and combined_of(T.GT[m, g, :, 1], np.array(held_rows(T, m)), scene.ns)]

    def text(self, scene: Scene) -> str:
        """Return the events in words, e.g. ``rigid_stop.impact / 1 T``; without events ``free``, ``in contact``, ``rest`` or
        ``carried``."""
        names = [f"{scene.element_name(m, g)}.{scene.event_kind(m, g)}" + ("..." if closes == 1 else "")
                 for m, g, _, _, closes in self.nodes[:, :ENDING].tolist() if g >= 0 and not idles(scene, m, g)]
        parts: list[str] = []
        for name in names:
            if parts and parts[-1].split(" x")[0] == name:
                count = int(parts[-1].split(" x")[1]) if " x" in parts[-1] else 1
                parts[-1] = f"{name} x{count + 1}"
            else:
                parts.append(name)
        T, mode = scene.tables, int(self.nodes[0, AFTER])
        held = T.H[mode, :T.n_holds[mode], scene.ns:]
        touching = any(key != FREE and FREE in element.start
                       for key, element in zip(scene.keys[mode], scene.system.elements, strict=True))
        still = "carried" if held.any() else "rest" if len(held) else "in contact" if touching else FREE
        span = "" if self.clock else f"{self.span:g} "
        return f"{', '.join(parts) or still} / {span}T{' (half)' if self.closure < 0 else ''}"


def idles(scene: Scene, mode: int, guard: int) -> bool:
    """Whether a known instant comes at which nothing changes, as between two pulses."""
    return scene.guard(mode, guard).guard.silent and scene.event_kind(mode, guard) is EventKind.CLOCK


def since(times, span: float) -> np.ndarray:
    """Return the times (m,) that pass before events at ``times`` (m,) of an orbit of period ``span`` since the one before."""
    spans = np.empty(times.size)
    spans[0], spans[1:] = times[0] - (times[-1] - span), times[1:] - times[:-1]
    return spans


def sections(mode: int, span: float, closure: int = 1) -> Signature:
    """Return the signature of an orbit without events: one section at phase 0."""
    return Signature(np.array([[mode, -1, mode, 0, 0]]), np.zeros(1), float(span), closure)


def divided(scene: Scene, nodes: np.ndarray, tables=None, closure: int = 1) -> np.ndarray:
    """Return ``nodes`` with the orders of the trivial zeros of all guards at the starts of the intervals, (m, STARTS + guards).

    Just after an event the guards of the new mode obey what the event says: its own guard is zero, held rows are at rest,
    memory was written.  The derivatives of a guard that follow from that alone are trivially zero; how many there are is its
    order at the start.  That of the guard that closes the interval is written into DIVIDE.
    """
    if tables is not None:
        return _divided(scene, nodes, tables, closure)
    key = np.asarray(nodes, np.int64)[:, :ENDING].tobytes(), closure  # one motion is read many times before it is known
    found = scene.divisions.get(key)
    if found is None:
        T = scene.tables
        found = _divided(scene, nodes, T, closure)
        if scene.tables is T:  # no mode was met
            if len(scene.divisions) >= SEQUENCES:
                scene.divisions.clear()
            scene.divisions[key] = found
    return found.copy()


def _divided(scene: Scene, nodes: np.ndarray, T, closure: int) -> np.ndarray:
    """Return what `divided` returns, found anew."""
    nodes = np.asarray(nodes, np.int64)
    whole = np.zeros((len(nodes), STARTS + T.G.shape[1]), np.int64)
    whole[:, :ENDING] = nodes[:, :ENDING]
    whole[:, ENDING] = -1
    known: dict[tuple, np.ndarray] = {}
    zeros: list[tuple] = [()] * len(whole)
    at_once: dict[tuple, bool] = {}
    for i in [*range(len(whole)), *range(len(whole))]:  # twice: what is zero all the last interval counts for the first
        node, zero = whole[i], tuple(np.flatnonzero(whole[i - 1, STARTS:] == FOREVER).tolist())
        if i == 0 and closure < 0:
            zero = tuple(sorted(scene.mirror_guard(int(whole[-1, AFTER]), q) for q in zero))
        before, guard, after = (int(value) for value in node[:DIVIDE])
        zeros[i] = zero
        key = (before, guard, after, int(node[CLOSES] == 1), zero)
        if key not in known:
            known[key] = start_orders(scene, T, *key)
        node[STARTS:STARTS + known[key].size] = known[key]
    for i, node in enumerate(whole):
        opening = whole[i - 1]
        node[DIVIDE] = 0
        if node[GUARD] < 0:
            continue
        before, guard = int(node[BEFORE]), int(node[GUARD])
        if i == 0 and closure < 0:  # closes on the mirror image of the first event
            guard = scene.mirror_guard(before, guard)
        opening[ENDING] = guard
        if opening[GUARD] < 0:
            continue
        order = abs(int(opening[STARTS + guard]))
        order = 0 if order == FOREVER else order
        if order:
            pair = (*opening[:DIVIDE].tolist(), int(opening[CLOSES] == 1), zeros[i - 1], guard)
            if pair not in at_once:
                at_once[pair] = coincide(scene, T, opening, guard, zeros[i - 1])
            node[DIVIDE] = TOGETHER if at_once[pair] else order
    if scene.ns > 2 * scene.n:
        mark_implied(scene, T, whole, closure)
    return whole


def mark_implied(scene: Scene, T, whole: np.ndarray, closure: int, given=()) -> None:
    """Mark (`FOREVER`) the guards that reach zero only where a contact strikes and turns the motion round, and those that stay zero
    while the mass rests there: they make no event.

    A slider that slipped up to a stop, in one impact, reaches its limit there again in the next: as long as it sticks, its guard
    and that of the stop differ by a multiple and by what the memory written then makes zero.  When the impacts have come to rest,
    the slider is at its limit all the time.  The rows ``given`` (nx,) are zero in all of the period.
    """
    size = state_sizes(scene, T)
    facts = [_basis(given, size, known) for known in known_facts(scene, T, whole, closure, size)]
    mark_returns(scene, T, whole, closure, facts, size)
    for node, known in zip(whole, facts, strict=True):
        mode = int(node[AFTER])
        guards = range(int(T.n_guards[mode]))
        rows = {q: left_of(T.G[mode, q] * size, known) for q in guards if len(known) and not T.LG[mode, q].any()}
        if rows and T.n_holds[mode]:
            still = _basis(held_rows(T, mode), size, known)
            for q in rows:
                if not (T.kick[mode, q] or q == node[ENDING]) and vanishes(T.G[mode, q] * size, still):
                    node[STARTS + q] = FOREVER
        for k in (k for k in rows if T.kick[mode, k]):
            for q in rows:
                own = scene.guard(mode, q).element == scene.guard(mode, k).element
                if not (own or T.kick[mode, q] or q == node[ENDING]) and parallel(rows[q], rows[k]):
                    node[STARTS + q] = FOREVER


def at_limits(scene: Scene, signature: Signature, y: np.ndarray, tables) -> Signature:
    """Return the signature of an orbit of a family with the guards marked that make no event because of the labels that its state
    ``y`` (ns,) has, with all of the ``tables``, as of a slider that in all of the period sticks where an impact once stopped it.

    Such a guard is zero in every impact, of either sign of its rounding, however the parameter changes: it tells nothing.
    """
    labels = signature.labels(scene)
    if not labels.places or signature.closure < 0 or not signature.events:
        return signature
    T, found = scene.tables, np.ones(signature.nodes[:, STARTS:].shape, bool)
    given = np.zeros((len(labels.places), T.A.shape[2]))
    given[:, :scene.ns], given[:, scene.ns] = labels.rows, -labels.values(y)
    for T in tables:
        nodes = signature.nodes.copy()
        mark_implied(scene, T, nodes, signature.closure, given)
        found &= nodes[:, STARTS:] == FOREVER
    nodes[:, STARTS:] = np.where(found, FOREVER, signature.nodes[:, STARTS:])
    nodes[:, DIVIDE] = signature.nodes[:, DIVIDE]
    return dataclasses.replace(signature, nodes=nodes)


def state_sizes(scene: Scene, T) -> np.ndarray:
    """Return natural sizes (nx,) of states, of which memory is a length, and 1 for the forcing."""
    size = np.ones(T.A.shape[2])
    size[:scene.ns] = natural_length(T)
    size[scene.n:2 * scene.n] *= natural_rate(T)
    return size


def known_facts(scene: Scene, T, whole: np.ndarray, closure: int, size: np.ndarray) -> list[np.ndarray]:
    """Return for every interval orthonormal rows (k, nx), in states of the ``size`` (nx,), of memory and the constant that are zero
    in all of it.

    At one instant several memories are written from one state: what is left of them without that state stays.
    """
    facts = [np.empty((0, size.size))] * len(whole)
    now: list[np.ndarray] = []  # rows that are zero at this instant: what it has written, less the state that this was written from
    for i in [*range(len(whole)), *range(len(whole))]:  # twice: what is known at the end of the period counts at its beginning
        known = turned(scene, facts[i - 1]) if i == 0 and closure < 0 else facts[i - 1]
        if i == 0 or whole[i, DIVIDE] != TOGETHER:
            now = []
        facts[i] = frozen_facts(scene, T, whole[i], _basis(now, size, known), size)
        now = [*now, *written(scene, T, whole[i])]
    return facts


def turned(scene: Scene, known: np.ndarray) -> np.ndarray:
    """Return rows (k, nx) as they are for the mirror image of a motion."""
    found = known.copy()
    found[:, scene.ns] *= -1.0
    return found


def written(scene: Scene, T, node: np.ndarray) -> list[np.ndarray]:
    """Return rows (nx,) that are zero just behind the event of a ``node``: memory less what is written into it; none of a kick."""
    before, guard = int(node[BEFORE]), int(node[GUARD])
    if guard < 0 or T.kick[before, guard]:
        return []
    jump, unit = slope_of_jump(scene, T, before, guard), np.eye(T.A.shape[2])
    places = [c for c in range(2 * scene.n, scene.ns) if (jump[c] != unit[c]).any()]
    return [unit[c] - jump[c] for c in places if not jump[c, places].any()]


def mark_returns(scene: Scene, T, whole: np.ndarray, closure: int, facts: list[np.ndarray], size: np.ndarray) -> None:
    """Mark (`TOGETHER`) the ends of stick of sliders on one row that stuck at one instant, and come back to where they slipped.

    They do so at one instant again (return-point memory, Masing 1926): their guards differ by a multiple, and by what the ``facts``
    of memory make zero.
    """
    for i, node in enumerate(whole):
        opening = whole[i - 1]
        if min(node[GUARD], opening[GUARD]) < 0 or node[DIVIDE] != 0:
            continue
        mode, first, before = (int(value) for value in opening[:DIVIDE])
        guard, known = int(node[GUARD]), facts[(i - 2) % len(whole)]
        if closure < 0 and i == 0:
            guard = scene.mirror_guard(int(node[BEFORE]), guard)
        elif closure < 0 and i == 1:
            known = turned(scene, known)
        if T.kick[mode, first] or T.kick[before, guard] or not len(known):
            continue
        element = scene.guard(before, guard).element
        waited = scene.keys[mode][element] == scene.keys[before][element]
        row = T.G[before, guard]
        own = [q for q in range(int(T.n_guards[mode])) if q != first and scene.guard(mode, q).element == element
               and np.array_equal(T.G[mode, q], row) and not T.LG[mode, q].any()] if waited else []
        if own and multiples(left_of(row * size, known), left_of(T.G[mode, first] * size, known)):
            node[DIVIDE] = TOGETHER


def frozen_facts(scene: Scene, T, node: np.ndarray, known: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Return orthonormal rows (k, nx), in states of the ``size`` (nx,), of memory that stands still behind the event of a ``node``,
    and of the constant, that are zero there; ``known`` are those of the interval before."""
    before, guard, after = (int(value) for value in node[:DIVIDE])
    unit = np.eye(size.size)
    zero = [unit[c] - row for c, row in scene.algebraic(before)]
    zero += held_rows(T, before)
    jump = unit[:scene.ns]
    if guard >= 0:
        zero.append(T.G[before, guard])
        jump = slope_of_jump(scene, T, before, guard)
    moved = {c for c, _ in scene.algebraic(after)}
    places = [c for c in range(2 * scene.n, scene.ns) if c not in moved and not T.A[after, c].any()]
    if not places:
        return np.empty((0, size.size))
    values = np.vstack([jump[places] * size / size[places, None], unit[scene.ns]])
    left = left_of(values, _basis(zero, size, known))
    _, sizes, combinations = np.linalg.svd(left.T)
    sizes = np.append(sizes, np.zeros(len(values) - sizes.size))
    rows = combinations[sizes <= PROPORTIONAL * np.abs(values).max()]
    return _basis(rows @ np.vstack([unit[places], unit[scene.ns]]), np.ones(size.size))


def left_of(row, basis):
    """Return what orthonormal rows (k, nx) leave of a row, or of each of several."""
    return row - (row @ basis.T) @ basis


def parallel(a, b) -> bool:
    """Return whether two rows are positive multiples of each other, and not zero."""
    size = np.sqrt((a @ a) * (b @ b))
    return bool(size > 0.0 and size - a @ b <= PROPORTIONAL * size)


def multiples(a, b) -> bool:
    """Return whether two rows are positive multiples of each other to rounding, and not zero."""
    one, two = np.sqrt(a @ a), np.sqrt(b @ b)
    return bool(min(one, two) > 0.0 and np.abs(a / one - b / two).max() <= PROPORTIONAL)


def start_orders(scene: Scene, T, before: int, guard: int, after: int, closes: int, zero: tuple = ()) -> np.ndarray:
    """Return for every guard of the mode ``after`` the order of its trivial zero just after an event.

    It is negative where the leading rate is a condition of its own, neither given by a kick nor by the rate with which the
    event arrived; `FOREVER` where the guard stays zero.  The guards ``zero`` of the mode ``before`` have been zero in all of it.
    """
    orders = np.zeros(int(T.n_guards[after]), np.int64)
    if guard >= 0 and not closes:
        orders = sampled_orders(scene, T, before, guard, after) if needs_samples(T, before, guard, after) else implied_orders(
            scene, T, before, guard, after, zero)
    orders[held_guards(T, after)] = FOREVER
    return orders


def held_guards(T, mode: int) -> list[int]:
    """Return the guards of a mode that are zero as long as it lasts, because of the rows that it holds: the speed of friction
    under a mass that rests on its stop."""
    if T.n_holds[mode] == 0:
        return []
    basis = _basis(held_rows(T, mode), np.ones(T.A.shape[2]))
    return [q for q in range(int(T.n_guards[mode])) if not T.LG[mode, q].any() and vanishes(T.G[mode, q], basis)]


def held_rows(T, mode: int) -> list[np.ndarray]:
    """Return the rows (nx,) that are zero as long as a mode lasts."""
    return [row for k in range(int(T.n_holds[mode])) for row in (T.H[mode, k], T.S[mode, k])]


def vanishes(row, basis) -> bool:
    """Whether orthonormal rows (k, nx) that are zero make a row zero which is not that by itself."""
    length = np.sqrt(row @ row)
    return bool(length > 0.0 and np.abs(left_of(row, basis)).max() <= PROPORTIONAL * length)


def combined_of(row, held, ns: int) -> bool:
    """Whether a row (nx,), not zero, is a combination of rows (k, nx) that are held at zero.  The first ``ns`` entries, of the
    states, give the factors; every entry is compared with its own terms, as large as the largest factor makes them, since nothing
    tells the size of a state."""
    size = np.sqrt((held[:, :ns]**2).sum(axis=1))
    held = held[size > 0.0] / size[size > 0.0, None]
    factors = np.linalg.lstsq(held[:, :ns].T, row[:ns], rcond=None)[0]
    terms = np.abs(row) + np.abs(factors).max(initial=0.0) * np.abs(held).sum(axis=0)
    return bool(row.any() and (np.abs(row - factors @ held) <= PROPORTIONAL * terms).all())


def stands(scene: Scene, mode: int, site) -> bool:
    """Whether what is held in a mode keeps the rows of a ``site`` where they are."""
    held, n, nx = held_rows(scene.tables, mode), scene.n, scene.tables.A.shape[2]
    if not held or not isinstance(site, Rows) or site.base:
        return False
    return all(combined_of(np.pad(row, (n, nx - 2 * n)), np.array(held), scene.ns) for row in site.R)


def implied_orders(scene: Scene, T, before: int, guard: int, after: int, zero: tuple = ()) -> np.ndarray:
    """Return the orders of `start_orders` after an event whose jump and guards are affine."""
    count = int(T.n_guards[after])
    orders = np.zeros(count, np.int64)
    reset, size, basis, arrival = facts_of(scene, T, before, guard, zero)
    terms = np.eye(len(reset)) + np.abs(reset - np.eye(len(reset)))  # of what is added up in it
    for q in range(count):
        for order in range(T.GT.shape[3]):
            row = T.GT[after, q, :, order]
            row = cancelled(row @ reset, np.abs(row) @ terms) * size
            length = np.sqrt(row @ row)
            if order >= MOST and length > 0.0:
                break
            if length > 0.0 and np.abs(row - basis.T @ (basis @ row)).max() > PROPORTIONAL * length:
                own = np.abs(row - arrival.T @ (arrival @ row)).max() > PROPORTIONAL * length
                # the speed with which a kick throws back is implied; after a plastic one the next rate is a condition, as is that
                # of what a kick lets slip
                orders[q] = -order if own else order
                break
        else:
            orders[q] = FOREVER  # a mass that sticks on its stop touches it
    return orders


def facts_of(scene: Scene, T, before: int, guard: int, zero: tuple):
    """Return what an affine event tells: the derivative (nx, nx) of the state behind it in that before it, sizes (nx,) of states,
    and in these orthonormal rows (k, nx) that are zero before it; and the same with the rate of the guard, last."""
    ns, nx = T.A.shape[1], T.A.shape[2]
    reset, size = np.eye(nx), np.ones(nx)
    reset[:ns] = slope_of_jump(scene, T, before, guard)
    size[scene.n:2 * scene.n] = scene.omega or 1.0
    basis = _basis([T.G[before, guard], *held_rows(T, before), *(T.G[before, q] for q in zero)], size)
    return reset, size, basis, _basis([T.GT[before, guard, :, 1]], size, basis)


def slope_of_jump(scene: Scene, T, mode: int, guard: int, x=None) -> np.ndarray:
    """Return the derivative (ns, nx) of the jump at an event; where it depends on the state, that at ``x`` (nx,) counts.

    What a jump takes away altogether, as a plastic impact the speed of its mass, is no rounding of the difference.
    """
    P = np.empty((T.A.shape[1], T.A.shape[2]))
    x = np.zeros(P.shape[1]) if x is None else np.ascontiguousarray(x, float)
    kernels(scene, "bifurc.flow.rule").jump(T, mode, guard, 0, x, np.empty(x.size), P)
    unit = np.eye(*P.shape)
    return cancelled(P, unit + np.abs(P - unit))


def coincide(scene: Scene, T, opening, guard: int, zero: tuple = ()) -> bool:
    """Return whether the event that ``guard`` of the mode after ``opening`` makes always happens at the instant of ``opening``.

    Another element, whose mode the first event leaves as it is, waited on the same row; or the rate with which that event arrived
    drives the guard through zero at once: a slider that slipped as its stop was struck sticks as soon as that lets go, and a mass
    at rest on a stop strikes it where the impact of another one, coupled by inertia, drives it there; or what lets a contact begin
    to slip one way, the same rate, turns round one on its row that slipped the other way.  The ``opening`` is a node of a sequence,
    or its first three numbers; ``zero`` as in `start_orders`.
    """
    before, fired, after = (int(value) for value in opening[:DIVIDE])
    owner = scene.guard(after, guard).element
    impact = bool(T.kick[before, fired])
    waited = owner != scene.guard(before, fired).element and (impact or scene.keys[before][owner] == scene.keys[after][owner])
    if not waited or law_guards(T, before, fired, after):
        return False
    if not impact and parallel(T.G[before, fired], T.G[after, guard]):
        return True
    if needs_samples(T, before, fired, after):
        return False
    orders = opening[STARTS:] if len(opening) > STARTS else start_orders(scene, T, before, fired, after, 0, zero)
    order = int(orders[guard])
    if not 0 < abs(order) < T.GT.shape[3]:
        return False
    reset, size, basis, arrival = facts_of(scene, T, before, fired, zero)

    def leading(q):
        return left_of((T.GT[after, q, :, abs(order)] @ reset) * size, basis)
    along = leading(guard)
    if order > 0:
        return len(arrival) > len(basis) and bool(along @ arrival[-1] > PROPORTIONAL * np.sqrt(along @ along))
    others = (q for q in range(int(T.n_guards[after])) if orders[q] == order and scene.guard(after, q).element != owner)
    return any(parallel(leading(q), -along) for q in others)


def _basis(rows, size, found=None) -> np.ndarray:
    """Return an orthonormal basis (k, nx) of some rows in scaled states, and of those of the basis ``found``."""
    found = np.empty((0, len(size))) if found is None else found
    for row in rows:
        row = row * size
        length = np.sqrt(row @ row)
        for _ in range(2):
            row = row - found.T @ (found @ row)
        left = np.sqrt(row @ row)
        if left > PROPORTIONAL * length:
            found = np.vstack([found, row / left])
    return found


def sticking(scene: Scene, signature: Signature, U: np.ndarray) -> tuple[Signature, np.ndarray] | None:
    """Return a forced signature and its unknowns without the slips of the elements that creep: they stick all the time; None where
    nothing else happens, or an event is not one of those modes."""
    stuck: dict[int, Hashable] = dict.fromkeys(signature.creeping(scene), STICK)
    nodes, kept = [], []
    for k, (before, guard, after, _, closes) in enumerate(signature.nodes[:, :ENDING].tolist()):
        owner = scene.guard(before, guard).element if guard >= 0 else -1
        if owner in stuck:
            continue
        here, there = scene.combined(before, stuck), scene.combined(after, stuck)
        if here is None or there is None or guard < 0:
            return None
        own = scene.guards_of(before, owner).index(guard)
        nodes.append([here, scene.guards_of(here, owner)[own], there, 0, closes])
        kept.append(k)
    if not nodes or any(old[AFTER] != new[BEFORE] for old, new in zip(nodes[-1:] + nodes, nodes, strict=False)):
        return None
    found = divided(scene, np.array(nodes, np.int64))
    found[:, CLOSES] = signature.nodes[kept, CLOSES]
    rows = np.reshape(U, (len(signature.nodes), -1))[kept]
    return Signature(found, np.zeros(len(found)), signature.span), rows.ravel()


def translated(signature: Signature, scene: Scene, other: Scene) -> Signature:
    """Return a signature in the numbers of another scene of the same structure, which may have met its modes in another order."""
    if scene.keys == other.keys:
        return signature
    number = {m: other.index(scene.keys[m]) for m in {*signature.nodes[:, BEFORE].tolist(), *signature.nodes[:, AFTER].tolist()}}
    nodes = signature.nodes[:, :ENDING].copy()
    for column in (BEFORE, AFTER):
        nodes[:, column] = [number[m] for m in nodes[:, column].tolist()]
    return dataclasses.replace(signature, nodes=divided(other, nodes, closure=signature.closure))


def repeated(scene: Scene, signature: Signature, U: np.ndarray) -> tuple[Signature, np.ndarray]:
    """Return an orbit written out over its full period, a number, with its unknowns (m (1 + ns),); twice as many nodes where
    it was solved on the half period."""
    signature, U = signature.written_out(U)
    if signature.closure > 0:
        return signature, U
    mirrored = signature.nodes.copy()
    for node in mirrored:
        before, guard, after = int(node[BEFORE]), int(node[GUARD]), int(node[AFTER])
        node[BEFORE], node[AFTER] = scene.mirror(before), scene.mirror(after)
        if guard >= 0:
            node[GUARD] = scene.mirror_guard(before, guard)
        if node.size > ENDING and node[ENDING] >= 0:
            node[ENDING] = scene.mirror_guard(after, int(node[ENDING]))
        starts = node[STARTS:].copy()
        for g in range(min(int(scene.tables.n_guards[after]), starts.size)):
            node[STARTS + scene.mirror_guard(after, g)] = starts[g]
    rows = U.reshape(len(mirrored), -1)
    other = -rows
    other[:, 0] = rows[:, 0] + signature.span
    whole = Signature(np.vstack([signature.nodes, mirrored]), np.concatenate([signature.fixed, signature.fixed + signature.span]),
                      2.0 * signature.span, clock=signature.clock)
    return whole, np.vstack([rows, other]).ravel()
