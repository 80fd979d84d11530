"""Whether the modes that are tried before the listed one are refused where an event leads past them.

After an event the first mode that may start is the one that holds (`flow.settle`).  At a reversal of slip, stick is tried
first: with static friction above kinetic it holds as long as its force is within the static limit, though a reversed slip
would have moved off as well.  That the reversal leaves is then too little: the force of stick must be beyond its limit.
Where both conditions are one (static friction equal to kinetic, Stribeck laws) the leading rate of the reversal tells.
The same holds for another element that an event lets go at once: the force that held it must be beyond its limit there.
"""
import copy
from dataclasses import dataclass, replace

import numpy as np

from ...compose.jointly import FIRST
from ...compose.tables import ORDER
from ...elements.friction.joint import Joint
from .sequence import AFTER, BEFORE, GUARD, STARTS

SAMPLES = 6  # states at which the two conditions are compared
ONE = 1e-9  # relative difference of two conditions that are one
RESTS = 1e-6  # scaled value of a row that an earlier mode would hold


@dataclass(frozen=True, slots=True)
class Earlier:
    """A mode tried before the listed one.

    Attributes
    ----------
    node : int
    mode : int
    guards : tuple of int
        Its guards of the element whose event it is, or of those that are let go with it: one of them must be beyond its limit.
    alone : tuple of int, optional
        The mode in which the event changes nothing but its own element, and the guard there by which another is let go at the same
        instant: unless it is beyond its limit, too, the mode is not tried.
    takes_over : bool
        It is another element than that of the event that takes hold.
    """

    node: int
    mode: int
    guards: tuple[int, ...]
    alone: tuple[int, int] | None = None
    takes_over: bool = False


def earlier_modes(scene, signature) -> list[Earlier]:
    """Return the modes that are tried before those after the events of ``signature``, built where they were not yet."""
    known: dict[tuple, list[Earlier]] = {}  # of long sequences most events are like others
    for event in signature.nodes[:, :AFTER + 1].tolist():
        if event[GUARD] >= 0 and tuple(event) not in known:
            known[tuple(event)] = tried_before(scene, *event)
    return [replace(one, node=i) for i, event in enumerate(signature.nodes[:, :AFTER + 1].tolist())
            for one in known.get(tuple(event), ())]


def tried_before(scene, before, guard, after) -> list[Earlier]:
    """Return the modes that are tried before the one ``after`` an event, see `earlier_modes`; of node 0."""
    owner = scene.guard(before, guard)
    found = let_go(scene, 0, owner.element, before, after)
    if scene.tables.kick[before, guard] or callable(owner.guard.then):  # of an impact there is one, or the state decides
        return found
    for key in owner.guard.then:
        listed = key == scene.keys[after][owner.element]  # also where another element has changed with it
        for mode in scene.tried(before, {owner.element: key}):
            joined = [e for e, own in enumerate(scene.keys[mode]) if e != owner.element and own != scene.keys[before][e]]
            if mode == after or listed and not joined:
                break
            if mode != before and scene.tables.n_holds[mode] and not closes(scene, before, guard, mode, joined):
                jointly = isinstance(key, Joint)  # others of a facet, that let go with it in the listed mode
                gripping = held(scene, mode) - held(scene, after if jointly else before) if joined else {owner.element}
                found += [Earlier(0, mode, limits(scene, mode, gripping), takes_over=owner.element not in gripping),
                          *(one for one in relieved(scene, 0, owner.element, mode) if one.mode != after)]
        if listed:
            break
    return found


def held(scene, mode) -> set[int]:
    """Return the elements that hold rows in a mode."""
    return {scene.hold_element(mode, k) for k in range(scene.tables.n_holds[mode])}


def limits(scene, mode, elements) -> tuple[int, ...]:
    """Return the guards of some elements in a mode, and those that they have jointly with others."""
    owners = [scene.guard(mode, g) for g in range(int(scene.tables.n_guards[mode]))]
    return tuple(g for g, (e, number, guard) in enumerate(owners)
                 if e in elements or number >= FIRST and any(other in elements for other, _ in guard.then[0].changes))


def closes(scene, before, guard, mode, joined) -> bool:
    """Whether one of the elements ``joined``, a stop that the event of a ``guard`` lets go for friction to hold, is back at once.

    The stop and the surface of the friction come to move alike: the acceleration that takes the speed of one past that of the
    other closes the gap, or opens it, whatever the state.
    """
    T = scene.tables
    for q in (q for e in joined for q in scene.guards_of(mode, e) if T.kick[mode, q]):
        rate, away = T.GT[before, guard, :, 1], T.GT[mode, q, :, 2]
        if proportional(rate, away) and rate @ away > 0.0:
            return True
    return False


def relieved(scene, i, element, mode) -> list[Earlier]:
    """Return the modes in which the ``element`` of the event at node ``i`` takes the key it has in ``mode`` while another that this
    mode holds is let go at the same instant: what they cannot hold together one of them may hold."""
    found, T = [], scene.tables
    held = {scene.hold_element(mode, k) for k in range(T.n_holds[mode])} - {element}
    for guard in range(int(T.n_guards[mode])):
        other = scene.guard(mode, guard)
        if other.element not in held or T.kick[mode, guard] or callable(other.guard.then):
            continue
        for key in other.guard.then:
            joined = scene.combine(mode, other.element, key)
            if joined is not None and scene.tables.n_holds[joined]:
                found.append(Earlier(i, joined, tuple(scene.guards_of(joined, element)), (mode, guard)))
    return found


def let_go(scene, i, element, before, after) -> list[Earlier]:
    """Return the mode in which the event of an ``element`` at node ``i`` changes nothing but itself, where after it others are
    let go that were held."""
    mode = scene.combine(before, element, scene.keys[after][element])
    if mode is None or mode == after:
        return []
    gone = held(scene, mode) - held(scene, after) - {element}
    guards = limits(scene, mode, gone)
    return [Earlier(i, mode, guards)] if guards else []


def meet_modes(scene, signature) -> list[Earlier]:
    """Build the modes beside a signature that its checks look at, so that tables made later have them: its mirror image, and
    `earlier_modes`, which are returned."""
    if signature.closure < 0 and not scene.complete:
        for mode in {*signature.nodes[:, BEFORE].tolist(), *signature.nodes[:, AFTER].tolist()}:
            scene.mirror(mode)
    return earlier_modes(scene, signature)


class Refusal:
    """The value that must stay negative for earlier modes to be refused, where no other condition says the same.

    Parameters
    ----------
    equations : Equations
    earlier : list of Earlier
    value : float
        Of the parameter, where the conditions are compared.
    """

    def __init__(self, equations, earlier, value: float):
        self.equations = equations
        T = equations.numbers_at(value) if earlier else None
        known = {}

        def implies(one):  # of long sequences most events are like others
            event = (*equations.signature.nodes[one.node].tolist(), one.mode, one.guards, one.takes_over)
            if event not in known:
                known[event] = self._implied(T, one)
            return known[event]
        implied = {(one.node, one.mode) for one in earlier if one.alone is None and implies(one)}
        self.earlier = [one for one in earlier if (one.node, one.alone[0] if one.alone else one.mode) not in implied]

    def on(self, equations) -> "Refusal":
        """Return the same conditions on the same equations with other numbers."""
        other = copy.copy(self)
        other.equations = equations
        return other

    def __bool__(self) -> bool:
        return bool(self.earlier)

    def worst(self, x) -> float:
        """Return the largest scaled margin by which an earlier mode could start at ``x`` (n + 1,); -inf without one."""
        e = self.equations
        T = e.numbers_at(x[-1])
        s, U = e.signature.written_out(x[:-1])
        period, size = 2.0 * np.pi / T.flat[0], 1 + e.scene.ns
        start, P, worst = np.empty(T.A.shape[2]), np.empty((e.scene.ns, T.A.shape[2])), -np.inf
        for one in self.earlier:
            e.motion.start_of(T, s.nodes, U, one.node, P, start)
            e.kernel.forcing(T, U[one.node * size] * period, start)
            if all(abs(T.H[one.mode, k] @ start) <= RESTS * e.kernel.scale_of(T.H[one.mode, k], e.weights)
                   for k in range(int(T.n_holds[one.mode]))):
                beyond = max((self._scaled(T, one.mode, q, start) for q in one.guards), default=-np.inf)
                relief = self._scaled(T, one.alone[0], one.alone[1], start) if one.alone else np.inf
                worst = max(worst, min(-beyond, relief))
        return worst

    def _scaled(self, T, mode, guard, x) -> float:
        """Return the scaled value of a guard at ``x`` (nx,)."""
        e, row = self.equations, np.empty(x.size)
        e.kernel.guard_gradient(T, mode, guard, x, row)
        return float(e.kernel.guard_value(T, mode, guard, x)) / e.kernel.scale_of(row, e.weights)

    def _implied(self, T, one) -> bool:
        """Whether the leading rate at the start of the listed mode is a guard of the earlier mode, times a constant.

        Of an element that takes over what is held, also whether the guard of the event is: it leaves by its own rate, as where
        static friction is equal to kinetic.
        """
        e = self.equations
        node = e.signature.nodes[one.node]
        event = int(node[BEFORE]), int(node[GUARD])
        orders = [(q, -int(start)) for q, start in enumerate(node[STARTS:]) if start < 0]
        if not orders and not one.takes_over:
            return True
        values, rates, a = [], [], np.empty(ORDER + 1)
        rng, ns = np.random.default_rng(1), e.weights.size
        rows = T.H[one.mode, :int(T.n_holds[one.mode])]
        states = np.hstack([e.weights * rng.standard_normal((SAMPLES, ns)), e.scene.forcing(rng.uniform(0.0, 6.0, SAMPLES))])
        states[:, :ns] -= np.linalg.lstsq(rows[:, :ns], rows @ states.T)[0].T  # on what the earlier mode would hold
        for x in states:
            rates.append([self._rate(T, int(node[AFTER]), q, order, x, a) for q, order in orders])
            if one.takes_over:
                rates[-1].append(float(e.kernel.guard_value(T, *event, x)))
            values.append([float(e.kernel.guard_value(T, one.mode, q, x)) for q in one.guards])
        return any(proportional(v, r) for v in np.transpose(values) for r in np.transpose(rates))

    def _rate(self, T, mode, guard, order, x, a) -> float:
        self.equations.kernel.guard_series(T, mode, guard, x, a)
        return float(a[order])


def proportional(a, b) -> bool:
    """Whether ``a`` (k,) is a constant times ``b`` (k,)."""
    size = np.linalg.norm(a) * np.linalg.norm(b)
    return bool(size > 0.0 and size - abs(a @ b) <= ONE * size)
