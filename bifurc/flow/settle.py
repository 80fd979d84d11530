"""Which modes hold at a start or after an event: all elements decide together (the slow, general rule).

A combination may start iff every row it holds is at rest and every guard of every element is inside (`bifurc.flow.rule`).
The compiled integration (`bifurc.flow.scan`) decides the usual cases by the same test, element by element; what it leaves open
comes here.

One file, because a start, an event and a coming to rest are decided by one test and one search of combinations.
"""
import itertools

import numpy as np

from ..compose.tables import ORDER
from ..compose.writer import kernels
from ..elements import Circle, EventKind
from .affine.endless import lasting
from .affine.polynomial import SMALLEST
from .laws.calls import KICKS, RESTS
from .rule import NOISE
from .scan import PENETRATION


class Penetration(ValueError):
    """A start lies beyond a surface by more than rounding."""


class Inconsistent(ArithmeticError):
    """No combination of modes may start; the message names what forbids each."""


class Rule:
    """The rule of a scene's engine, for decisions that need names: compiled tests of `bifurc.flow.rule` at one state.

    Parameters
    ----------
    scene : Scene
        Its tables are taken anew at every call: they grow.
    """

    def __init__(self, scene):
        self.scene = scene

    def inside(self, m: int, g: int, x, scale=None) -> tuple[int, int]:
        """Return sign of a guard just after ``x`` (0: not told from zero) and the order of its zero at ``x``, see `rule.inside`."""
        return self._rule.inside(self.scene.tables, m, g, x, self.sizes(m, x) if scale is None else scale, np.empty(ORDER + 1))

    def leaving(self, m: int, g: int, x, scale) -> tuple[int, int, float]:
        """Return what `inside` does, and the rate with which the guard leaves a zero, where that is known; see `engine.leaves`."""
        a = np.empty(ORDER + 1)
        sign, order = self._rule.inside(self.scene.tables, m, g, x, scale, a)
        return sign, order, self._engine.leaves(order, a)

    def sizes(self, m: int, x) -> np.ndarray:
        """Return what the rounding of the entries of ``x`` (nx,), where mode ``m`` has led, is measured by, see `rule.sizes`."""
        scale = np.empty(x.size)
        self._rule.sizes(self.scene.tables, x, scale)
        self._rule.blur(self.scene.tables, m, x, scale)
        return scale

    def jump(self, m: int, g: int, x) -> tuple[np.ndarray, np.ndarray]:
        """Return the state (nx,) after an event and its derivative (ns, nx) in the state before."""
        xp, P = np.empty(x.size), np.empty((self.scene.ns, x.size))
        self._rule.jump(self.scene.tables, m, g, 0, x, xp, P)
        return xp, P

    def jumped(self, m: int, g: int, x, arrive: float) -> np.ndarray:
        """Return the state (nx,) after an event, reached with a known rate, see `rule.jumped`."""
        xp = np.empty(x.size)
        self._rule.jumped(self.scene.tables, m, g, x, arrive, xp)
        return xp

    def rate(self, m: int, g: int, x) -> tuple[float, float]:
        """Return the rate of a guard along the flow and the rounding of it."""
        T, ns = self.scene.tables, self.scene.ns
        f, dw, row = np.empty(ns), np.empty(x.size - ns), np.empty(x.size)
        self._engine.field(T, m, x, f)
        self._engine.forcing_rate(T, x, dw)
        self._engine.guard_gradient(T, m, g, x, row)
        rates = np.concatenate([f, dw])
        return float(row @ rates), float(NOISE * (np.abs(T.GT[m, g, :, 1]) @ plain(x, ns) + np.abs(row) @ np.abs(rates)))

    def onto(self, m: int, g: int, x) -> np.ndarray | None:
        """Return by how much (ns,) of ``x`` (nx,) a guard falls by one: that of a surface, flat or round; None of other guards."""
        T, ns = self.scene.tables, self.scene.ns
        if T.D[m, g].any():
            return T.D[m, g]
        if not T.kick[m, g] or not T.LG[m, g].any():
            return None
        row = np.empty(x.size)
        self._engine.guard_gradient(T, m, g, x, row)
        square = row[:ns] @ row[:ns]
        return row[:ns] / square if square > 0.0 else None

    def broken(self, m: int, x, scale) -> list[tuple]:
        """Return what forbids mode ``m`` at ``x``: ``("hold", element)`` and ``("guard", g, order)``; empty: it may start."""
        T = self.scene.tables
        signs, orders = np.zeros((2, max(1, T.G.shape[1])), np.int64)
        if self._rule.admit(T, m, x, scale, signs, orders, np.empty(ORDER + 1)):
            return []
        found: list[tuple] = [("hold", self.scene.hold_element(m, k)) for k in range(T.n_holds[m])
                              if self._rule.loose(T, m, k, x, scale)]
        if self.scene.laws:
            owner = int(self._engine.curved_rest(T, m, x, scale))
            found += [("hold", owner)] if owner >= 0 else []
        for g in range(T.n_guards[m]):
            sign, order = self.inside(m, g, x, scale)
            if sign > 0:
                found.append(("guard", g, order))
        return found

    @property
    def _rule(self):
        return kernels(self.scene, "bifurc.flow.rule")

    @property
    def _engine(self):
        return kernels(self.scene)


def plain(x, ns):
    """Return sizes of the entries of ``x`` (nx,) as they are; forcing has that of its amplitude."""
    size = np.ones(x.size)
    size[:ns] = np.maximum(np.abs(x[:ns]), SMALLEST)
    return size


def start(scene, x, keys=None):
    """Return the mode in which a motion starts from ``x`` (nx,) and the state put on its surfaces; with ``keys`` it is theirs.

    A state on a surface that arrives there with a speed is the event itself: the mode before it is returned, and the
    integration fires at once.

    Raises
    ------
    Penetration
        When the state lies beyond a surface of every start mode by more than rounding.
    Inconsistent
        When no mode may start.
    """
    reasons, arriving, deepest = [], None, None
    rule = Rule(scene)
    x = unloaded(scene, x).copy()
    for m in scene.start_modes(scene.disordered(x[None])) if keys is None else [scene.index(keys)]:
        T = scene.tables
        y = x.copy()
        for g in range(T.n_guards[m]):  # a state beyond a surface by rounding is on it
            value, size = _value(scene, m, g, y)
            if NOISE * size < value <= PENETRATION * size and (direction := rule.onto(m, g, y)) is not None:
                y[:scene.ns] -= direction * value
                if T.kick[m, g]:  # whatever the mode
                    x[:scene.ns] -= direction * value
        why = rule.broken(m, y, rule.sizes(m, y))
        why += [("memory", e) for e in displaced(scene, m, y)] + [("surface", e) for e in _aside(scene, m, y)]
        if not why:
            return (m if keys is not None else _unique(scene, rule, m, y)), y
        events = [w for w in why if w[0] == "guard" and w[2] > 0]
        if arriving is None and len(events) == len(why):
            arriving = m, y
            if any(w[2] == 1 and _throws_back(scene, m, w[1]) for w in events):  # no other mode may start
                break
        reasons.append(_say(scene, m, why))
        for w in why:
            if w[0] == "guard" and w[2] == 0 and T.kick[m, w[1]]:
                deepest = scene.element_name(m, w[1]), _depth(scene, m, w[1], y)
    if arriving is not None:
        return arriving
    if deepest is not None:
        raise Penetration(f"y0 lies {deepest[1]:.6g} beyond the stop {deepest[0]!r}; a start must be on the free side of "
                          "every rigid stop, or on it")
    raise Inconsistent("no combination of modes may start here: " + "; ".join(reasons))


def _unique(scene, rule, m, x) -> int:
    """Return mode ``m``, which may start at ``x`` (nx,), or that in which a motion ends where a region beside it may start, too.

    Both stay on the surface with one field: it is one motion.  Where all guards that are zero are tangent the point is a two-fold.
    """
    own = scene.region(m)
    if not own:
        return m
    zeros = _zeros(scene, rule, m, x)
    if not zeros:
        return m
    for other in scene.start_modes():
        if scene.region(other) in ((), own) or rule.broken(other, x, rule.sizes(other, x)):
            continue
        both = zeros + _zeros(scene, rule, other, x)
        T = scene.tables
        change, size = (T.A[other] - T.A[m]) @ x, (np.abs(T.A[other]) + np.abs(T.A[m])) @ np.abs(x)
        if any(sign for sign, _ in both) or (np.abs(change) > NOISE * size).any():
            return scene.ended(m, "escaping" if any(order == 1 for _, order in both) else "two_fold")
    return m


def _zeros(scene, rule, m, x) -> list[tuple[int, int]]:
    """Return sign and order of the guards of mode ``m`` that are zero at ``x`` (nx,), see `Rule.inside`."""
    found = (rule.inside(m, g, x) for g in range(scene.tables.n_guards[m]))
    return [(sign, order) for sign, order in found if order > 0]


def _aside(scene, m, x) -> list[int]:
    """Return the elements that slide in mode ``m`` along a surface on which ``x`` (nx,) does not lie."""
    found = []
    for other, g in scene.kept(m):
        value, size = _value(scene, other, g, x)
        if abs(value) > PENETRATION * size:
            found.append(scene.guard(other, g).element)
    return found


def _throws_back(scene, m, g) -> bool:
    """Whether an arrival at guard ``g`` of mode ``m`` with a speed leaves its element no other start: those hold its row."""
    e = scene.guard(m, g).element
    element = scene.system.elements[e]
    return bool(scene.tables.kick[m, g]) and all(key == scene.keys[m][e] or element.mode(key, scene.system.core).hold
                                                 for key in element.start)


def displaced(scene, m, x, noise=NOISE) -> list[int]:
    """Return the elements that mode ``m`` gives another memory than the state ``x`` (nx,) has: a slider slips at its limit only.

    Part ``noise`` of what is added up is none.
    """
    return _owners(scene, _off_limits(scene, m, x, noise))


def _off_limits(scene, m, x, noise) -> list[int]:
    """Return the places of the memory to which mode ``m`` gives another value than the state ``x`` (nx,) has, see `displaced`."""
    if scene.ns == 2 * scene.n:
        return []
    return [place for place, row in scene.algebraic(m)
            if abs(row @ x - x[place]) > noise * (np.abs(row) @ plain(x, scene.ns) + abs(x[place]))]


def _owners(scene, places) -> list[int]:
    """Return the elements whose memory stands at some places of the state."""
    owned = [(e, scene.memory_of(e)) for e in range(len(scene.system.elements))] if places else []
    return [e for e, own in owned if any(own.start <= place < own.stop for place in places)]


def leaping(scene, m, mode, x, owners) -> list[int]:
    """Return the elements that cannot go from mode ``m`` to ``mode`` at ``x`` (nx,) by an event of the ``owners``.

    A slider that slips is at its limit, whatever its memory was when it began: another slip with another limit would be a leap of
    its force.  Where it sticks its memory has to be written, which an event of its own does, and a kick.
    """
    if scene.ns == 2 * scene.n:
        return []
    at_limits, slips = x.copy(), {place for place, _ in scene.algebraic(mode)}
    for place, row in scene.algebraic(m):
        at_limits[place] = row @ x
    unwritten = [place for place in _off_limits(scene, m, x, PENETRATION) if place not in slips]
    return displaced(scene, mode, at_limits, PENETRATION) + [e for e in _owners(scene, unwritten) if e not in owners]


def _depth(scene, m, g, x) -> float:
    """Return how far a state is beyond a surface, length: of a circle the guard is a polynomial that says so near it only."""
    site = scene.system.elements[scene.guard(m, g).element].site(scene.n)
    if isinstance(site, Circle):
        return float(np.hypot(*(site.R @ x[:scene.n] - np.array(site.centre)))) - site.radius
    return float(_value(scene, m, g, x)[0])


def unloaded(scene, x):
    """Return ``x`` with memory that is beyond a limit where the limit puts it: an overloaded slider has slipped."""
    if scene.ns == 2 * scene.n:
        return x
    x = x.copy()
    mode = next(scene.start_modes(scene.disordered(x[None])))
    for _ in range(4 * (scene.ns - 2 * scene.n)):
        T = scene.tables
        for g in range(T.n_guards[mode]):
            value, size = _value(scene, mode, g, x)
            if value <= NOISE * size or T.kick[mode, g]:
                continue
            owner = scene.guard(mode, g)
            keys = scene.followers(mode, g, x)
            after = next((m for key in keys if (m := scene.combine(mode, owner.element, key)) is not None), mode)
            own = scene.memory_of(owner.element)
            rows = [(place, row) for place, row in scene.algebraic(after) if own.start <= place < own.stop]
            if after != mode and rows:
                for place, row in rows:
                    x[place] = row @ x
                mode = after
                break
        else:
            break
    return x


def decide(scene, m, g, x, arrive):
    """Return mode and state after guard ``g`` of mode ``m`` fired at ``x`` (nx,), reached with the rate ``arrive``.

    Elements that the jump, or the new mode of the fired guard's element, takes beyond a guard or breaks the hold of, join with
    their own candidates.  A guard with a kick that arrives at the same instant is left to fire at once: kicks come one after
    the other.  Where nothing else is possible the others fire at once too, each with its own candidates.

    Raises
    ------
    Inconsistent
        When no combination may follow.
    """
    rule = Rule(scene)
    T = scene.tables
    y = x.copy()
    if T.kick[m, g] and arrive > 0.0:
        y = rule.jumped(m, g, x, arrive)
    elif not T.kick[m, g]:
        value, size = _value(scene, m, g, x)
        y = rule.jumped(m, g, x, arrive)
        if value > PENETRATION * size:  # at once, by another's impact: nothing is to be put right
            y[:scene.ns] += value * T.D[m, g]
    return _follow(scene, rule, m, y, {scene.guard(m, g).element: [g]}, np.maximum(rule.sizes(m, x), rule.sizes(m, y)), x)


def jumped_on(scene, m, g, x):
    """Return mode and state after a jump (guard ``g`` of mode ``m`` at ``x``, (nx,)) beyond a jump of the mode that it leads to."""
    after = scene.combine(m, scene.guard(m, g).element, scene.followers(m, g, x)[0])
    return (m if after is None else after), Rule(scene).jumped(m, g, x, 0.0)


def come_to_rest(scene, m, g, x, arrive):
    """Return mode and state after infinitely many impacts at the instant of ``x`` (nx,): all that take part rest on each other.

    Arguments as for `decide`, which is asked where it is not shown that impacts never end (`affine.endless`).  Every impulse
    acts along a contact, and in the end none of these has a speed left: velocities are projected by inertia.  Contacts that the
    impacts drive apart are let go.  On a circle each impulse takes its share of friction along,
    against the sliding that is left in the end, or stops it.

    Raises
    ------
    Inconsistent
        When the contacts cannot rest together: something is caught between them.
    """
    rule, free = Rule(scene), _let_go(scene, m)
    T = scene.tables
    meeting = []
    for k in range(T.n_guards[free]):
        value, size = _value(scene, free, k, x)
        if scene.guard(free, k).guard.accumulates is not None and abs(value) <= PENETRATION * size:
            meeting.append(k)
    owners = [scene.guard(free, k).element for k in meeting]
    first, base = x, m
    ends = np.full(len(meeting), scene.guard(m, g).element in owners)
    if T.stages[KICKS] != T.stages[RESTS]:  # with a law of impulses, as friction on a circle, they are not written out
        ends &= bool((T.ratio[free, meeting] < 1.0).any())
    elif ends.any():
        ends, parted, first = lasting(scene, free, x, meeting)
        base = scene.combined(m, {e: scene.keys[free][e] for e, away in zip(owners, parted, strict=True) if away})
    if not ends.any():
        if first is x:
            return decide(scene, m, g, x, arrive)
        return _follow(scene, rule, base, first, {}, np.maximum(rule.sizes(m, x), rule.sizes(m, first)), x)
    touching = {e: scene.guard(free, k).guard.accumulates[1] for e, k, rests in zip(owners, meeting, ends, strict=True) if rests}
    for resting in _restings(scene, base, touching, x):
        y, added = scene.put_to_rest(resting, first)
        scale, sliding = np.maximum(np.maximum(rule.sizes(m, x), rule.sizes(m, y)), added), {*touching}
        open_ones = [g for e in touching for g in scene.guards_of(resting, e) if scene.tables.kick[resting, g]]
        if any(rule.inside(resting, g, y, scale) == (1, 1) for g in open_ones):  # two walls that approach each other
            continue
        for why, k, *_ in rule.broken(resting, y, scale):
            if why == "guard" and scene.event_kind(resting, k) == EventKind.STICK:
                sliding.discard(scene.guard(resting, k).element)
        if len(sliding) == len(touching):
            return _follow(scene, rule, resting, y, {}, scale, x)
    held = {scene.hold_element(m, k) for k in range(scene.tables.n_holds[m])}
    names = " and ".join(repr(scene.system.labels[e]) for e in sorted({*touching, *held}))
    raise Inconsistent(f"impacts follow each other without end: something is caught between {names}{_unsolved(scene)}")


def _let_go(scene, m) -> int:
    """Return the mode ``m`` with all contacts that rest free to strike again."""
    changes = {}
    for e in {scene.hold_element(m, k) for k in range(scene.tables.n_holds[m])}:
        element, now = scene.system.elements[e], scene.keys[m][e]
        for key in element.start:
            if any(guard.accumulates is not None and guard.accumulates[1] == now
                   for guard in element.mode(key, scene.system.core).guards):
                changes[e] = key
    return scene.combined(m, changes)


def _unsolved(scene) -> str:
    """Return what a message adds where circles share a body."""
    pairs = " or ".join(f"{one!r} and {other!r}" for one, other in scene.meeting_circles)
    return pairs and (f"; {pairs} share a body, and two circles cannot hold it at once (sliding on rigid walls, rolling): "
                      "make one of them an ElasticStator")


def _undeclared(scene, m, joined) -> str:
    """Return what a message adds where an impact of an element fired whose guard does not say how infinitely many of them end."""
    names = {scene.element_name(m, g): None for guards in joined.values() for g in guards
             if scene.tables.kick[m, g] and scene.guard(m, g).guard.accumulates is None}
    return "".join(f"; impacts of {name!r} that follow each other ever faster end in the mode that accumulates=(ratio, key) of "
                   "their guard names, which is not given" for name in names)


def _restings(scene, m, touching, x):
    """Yield the modes in which all that touches rests: on a circle it slides either way, or rolls.

    A row is held once: where walls meet from both sides as many of them hold as can, and the others are without speed with them.
    """
    ways = [[key for g in scene.guards_of(m, e) for key in scene.followers(m, g, x)
             if scene.system.elements[e].mode(key, scene.system.core).hold] if scene.is_curved(e) else [rest]
            for e, rest in touching.items()]
    curved = any(scene.is_curved(e) for e in touching)
    for many in range(len(touching), 0 if not curved else len(touching) - 1, -1):
        found = False
        for some in itertools.combinations(zip(touching, ways, strict=True), many):
            for keys in itertools.product(*(keys for _, keys in some)):
                resting = scene.combined(m, dict(zip((e for e, _ in some), keys, strict=True)))
                if resting is not None:
                    found = True
                    yield resting
        if found:
            return


def _follow(scene, rule, m, y, joined, scale, x):
    """Return the first admissible mode after ``m`` at ``y`` (nx,), and the state; ``joined``: elements and their fired guards.

    ``scale`` (nx,) is what rounding is measured by, ``x`` (nx,) the state before the event.  Frictions that rested jointly and that
    an impulse moves slip as it moves them: their guards know the slips of a slow load alone.
    """
    owners, along = set(joined), scene.taken_along(m, y, NOISE * scale)
    further: dict[int, dict] = {}  # keys of joined elements that follow candidates which another event ends at once
    reasons: dict[int, str] = {}
    slipping: list[int] = []  # behind those in which contacts would rest that others let go, be it jointly
    while True:
        missing: dict[int, None] = {}
        striking: dict[int, None] = {}  # will fire by themselves: they join only where nothing else does
        later, waiting, modes = [], [], []
        for mode in [*slipping, *_combinations(scene, m, joined, further, along, x)]:
            z = y.copy()
            why = rule.broken(mode, z, scale) + [("memory", e) for e in leaping(scene, m, mode, y, owners)]
            if not why:
                return mode, z
            reasons[mode] = _say(scene, mode, why)
            fires = [w[0] == "guard" and w[2] > 0 and scene.guard(mode, w[1]).element not in owners for w in why]
            kicks = [fire and bool(scene.tables.kick[mode, w[1]]) and rule.rate(mode, w[1], z)[0] > rule.rate(mode, w[1], z)[1]
                     for fire, w in zip(fires, why, strict=True)]
            if all(fires):
                waiting.append((not all(kicks), mode, z))
            for w, kick in zip(why, kicks, strict=True):
                if w[0] == "guard" and scene.joints and scene.event_kind(mode, w[1]) is EventKind.SLIP:
                    modes += [scene.combine(mode, scene.guard(mode, w[1]).element, key) for key in scene.followers(mode, w[1], z)]
                element = scene.guard(mode, w[1]).element if w[0] == "guard" else w[1]
                if element not in joined:
                    (striking if kick else missing)[element] = None
                elif w[0] == "guard" and w[2] > 0:
                    later += [(element, key) for key in scene.followers(mode, w[1], z)]
        at_once = [(mode, z) for others, mode, z in waiting if not others]
        if at_once:
            return at_once[0]
        if modes := [mode for mode in dict.fromkeys(modes) if mode is not None and mode not in reasons]:
            slipping = modes
            continue
        missing = missing or striking
        if not missing:
            later = [(element, key) for element, key in later if key not in further.get(element, {})]
            if not later:
                if waiting:
                    return waiting[0][1:]
                raise Inconsistent("no combination of modes may follow this event: "
                                   + "; ".join(reasons.values()) + _undeclared(scene, m, joined) + _unsolved(scene))
            for element, key in later:
                further.setdefault(element, {})[key] = None
        for element in missing:
            joined[element] = list(scene.guards_of(m, element))


def _value(scene, m, g, x):
    """Return the value of a guard and the sum of the sizes of its terms."""
    T = scene.tables
    if scene.laws and T.LG[m, g].any():
        engine = kernels(scene)
        return engine.guard_value(T, m, g, x), engine.terms_size(T, m, g, x)
    return T.G[m, g] @ x, np.abs(T.G[m, g]) @ plain(x, T.A.shape[1])


def _combinations(scene, m, joined, further, along, x):
    """Yield the modes in which the joined elements take the keys of their guards' `then`, keep theirs, or take `further` keys.

    Those that are moved ``along`` slip in all.
    """
    choices = []
    for element, guards in joined.items():
        if element in along:
            continue
        keys = [key for g in guards for key in scene.followers(m, g, x)]
        keys = list(dict.fromkeys([*keys, scene.keys[m][element], *further.get(element, ())]))
        choices.append([(element, key) for key in keys])
    for choice in itertools.product(*choices):
        yield from scene.tried(m, along | dict(choice))


def _say(scene, m, why):
    parts = []
    for w in why:
        if w[0] == "hold":
            parts.append(f"{scene.system.labels[w[1]]} is not at rest")
        elif w[0] == "memory":
            parts.append(f"{scene.system.labels[w[1]]} is not at its limit")
        elif w[0] == "surface":
            parts.append(f"{scene.system.labels[w[1]]} is not on its surface")
        else:
            name = scene.element_name(m, w[1])
            parts.append(f"{name} is past its {scene.event_kind(m, w[1])}" if w[2] == 0 else
                         f"{name} is about to pass its {scene.event_kind(m, w[1])}")
    return f"{scene.keys[m]}: " + ", ".join(parts)
