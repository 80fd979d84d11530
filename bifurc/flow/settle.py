"""Which modes hold at a start or after an event: all elements decide together (the slow, general rule).

A combination of modes may start iff every held row is at rest on its surface and every guard of every element is inside:
negative, or zero with its first non-zero derivative along the combination's own flow negative.  The compiled march
(`bifurc.flow.scan`) decides the usual cases by the same rule, element by element; what it leaves open comes here.
"""
import itertools

import numpy as np

from ..compose.tables import ORDER
from .scan import INSTANTS, NOISE, PENETRATION


class Penetration(ValueError):
    """A start lies beyond a surface by more than rounding."""


class Inconsistent(ArithmeticError):
    """No combination of modes may start; the message names what forbids each."""


def affine_series(T, m, g, x):
    """Return Taylor coefficients (ORDER+1,) of a guard along the flow, and the sums of the sizes of their terms."""
    rows = T.GT[m, g]
    return x @ rows, sizes(x, T.A.shape[1]) @ np.abs(rows)


def sizes(x, ns):
    """Return sizes of the entries of ``x`` (nx,) that their rounding is measured by: forcing has that of its amplitude."""
    size = np.ones(x.size)
    size[:ns] = np.abs(x[:ns])
    return size


def sign_after(series, T, m, g, x):
    """Return sign of a guard just after ``x`` (0: zero forever) and the order of its zero at ``x``."""
    a, size = series(T, m, g, x)
    for j in range(ORDER + 1):
        if abs(a[j]) > NOISE * size[j]:
            return (1, j) if a[j] > 0.0 else (-1, j)
    return 0, ORDER


def broken(scene, series, m, x, scale):
    """Return what forbids mode ``m`` at ``x``: ``("hold", element)`` and ``("guard", g, order)``; empty: it may start."""
    T = scene.tables
    found = []
    for k in range(T.n_holds[m]):
        for row in (T.H[m, k], T.S[m, k]):
            if abs(row @ x) > NOISE * (np.abs(row) @ scale):
                found.append(("hold", scene.hold_element(m, k)))
                break
    for g in range(T.n_guards[m]):
        sign, order = sign_after(series, T, m, g, x)
        if sign > 0:
            found.append(("guard", g, order))
    return found


def start(scene, x, series=affine_series):
    """Return the mode in which a motion starts from ``x`` (nx,) and the state put on its surfaces.

    A state on a surface that arrives there with a speed is the event itself: the mode before it is returned, and the
    march fires at once.

    Raises
    ------
    Penetration
        When the state lies beyond a surface of every start mode by more than rounding.
    Inconsistent
        When no mode may start.
    """
    reasons, arriving, deepest = [], None, None
    x = unloaded(scene, x)
    for m in scene.start_modes():
        T = scene.tables
        y = x.copy()
        for g in range(T.n_guards[m]):  # a state beyond a surface by rounding is on it
            if T.D[m, g].any():
                value, size = T.G[m, g] @ y, np.abs(T.G[m, g]) @ sizes(y, scene.ns)
                if NOISE * size < value <= PENETRATION * size:
                    y[:scene.ns] -= T.D[m, g] * value
        why = broken(scene, series, m, y, sizes(y, scene.ns))
        if not why:
            return m, y
        events = [w for w in why if w[0] == "guard" and w[2] > 0]
        if arriving is None and len(events) == len(why):
            arriving = m, y
        reasons.append(_say(scene, m, why))
        for w in why:
            if w[0] == "guard" and w[2] == 0 and T.kick[m, w[1]]:
                deepest = scene.element_name(m, w[1]), T.G[m, w[1]] @ y
    if arriving is not None:
        return arriving
    if deepest is not None:
        raise Penetration(f"y0 lies {deepest[1]:.6g} beyond the stop {deepest[0]!r}; a start must be on the free side of "
                          "every rigid stop, or on it")
    raise Inconsistent("no combination of modes may start here: " + "; ".join(reasons))


def unloaded(scene, x):
    """Return ``x`` with memory that is beyond a limit where the limit puts it: an overloaded slider has slipped."""
    if scene.ns == 2 * scene.n:
        return x
    x = x.copy()
    mode = next(scene.start_modes())
    for _ in range(4 * (scene.ns - 2 * scene.n)):
        T = scene.tables
        for g in range(T.n_guards[mode]):
            value, size = _value(T, mode, g, x)
            if value <= NOISE * size or T.kick[mode, g]:
                continue
            owner = scene.guard(mode, g)
            keys = scene.followers(mode, g, x)
            after = next((m for key in keys if (m := scene.combine(mode, owner.element, key)) is not None), mode)
            own = scene.memory_of(owner.element)
            rows = [(place, row) for place, row in scene.slaved(after) if own.start <= place < own.stop]
            if after != mode and rows:
                for place, row in rows:
                    x[place] = row @ x
                mode = after
                break
        else:
            break
    return x


def decide(scene, m, g, x, arrive, series=affine_series):
    """Return mode and state after guard ``g`` of mode ``m`` fired at ``x`` (nx,), and how often kicks were given.

    Raises
    ------
    Inconsistent
        When no combination may follow.
    """
    joined = {scene.guard(m, g).element: [g]}
    order = [g]
    further: dict[int, dict] = {}  # keys of joined elements that follow candidates which another event ends at once
    while True:
        y, kicks = _kicks(scene, series, m, order, x, g, arrive)
        scale = np.maximum(sizes(x, scene.ns), sizes(y, scene.ns))
        reasons, missing, later = [], {}, []
        for mode in _combinations(scene, m, joined, further, x):
            T = scene.tables
            z = y.copy()
            why = broken(scene, series, mode, z, scale)
            if not why:
                return mode, z, kicks
            reasons.append(_say(scene, mode, why))
            for w in why:
                element = w[1] if w[0] == "hold" else scene.guard(mode, w[1]).element
                if element not in joined:
                    missing[element] = None
                elif w[0] == "guard" and w[2] > 0:
                    later += [(element, key) for key in scene.followers(mode, w[1], z)]
        if not missing:
            later = [(element, key) for element, key in later if key not in further.get(element, {})]
            if not later:
                raise Inconsistent("no combination of modes may follow this event: " + "; ".join(reasons))
            for element, key in later:
                further.setdefault(element, {})[key] = None
        for element in missing:
            joined[element] = list(scene.guards_of(m, element))
            order += [i for i in joined[element] if abs(_value(T, m, i, x)[0]) <= NOISE * _value(T, m, i, x)[1]]


def _value(T, m, g, x):
    return T.G[m, g] @ x, np.abs(T.G[m, g]) @ sizes(x, T.A.shape[1])


def _kicks(scene, series, m, order, x, fired, arrive):
    """Give the kicks of the guards that arrive, again while a kick makes another one arrive."""
    T = scene.tables
    y, kicks = x.copy(), 0
    for turn in range(INSTANTS):
        given = False
        for g in order:
            speed = arrive if g == fired and turn == 0 else series(T, m, g, y)[0][1]
            size = series(T, m, g, y)[1][1]
            if T.kick[m, g] and speed > NOISE * size:
                y[:scene.ns] = T.R[m, g] @ y
                given = True
                kicks += 1
            elif not T.kick[m, g] and turn == 0:
                value, size = _value(T, m, g, y)
                passed = value > PENETRATION * size  # at once, by another's kick: nothing is to be put right
                y[:scene.ns] = T.R[m, g] @ y + (value if passed else 0.0) * T.D[m, g]
        if not given:
            break
    return y, kicks


def _combinations(scene, m, joined, further, x):
    """Yield the modes in which the joined elements take the keys of their guards' `then`, keep theirs, or take `further` keys."""
    choices = []
    for element, guards in joined.items():
        keys = [key for g in guards for key in scene.followers(m, g, x)]
        keys = list(dict.fromkeys([*keys, scene.keys[m][element], *further.get(element, ())]))
        choices.append([(element, key) for key in keys])
    for choice in itertools.product(*choices):
        mode = m
        for element, key in choice:
            mode = scene.combine(mode, element, key)
            if mode is None:
                break
        if mode is not None:
            yield mode


def _say(scene, m, why):
    parts = []
    for w in why:
        if w[0] == "hold":
            parts.append(f"{scene.system.labels[w[1]]} is not at rest")
        else:
            name = scene.element_name(m, w[1])
            parts.append(f"{name} is past its {scene.event_kind(m, w[1])}" if w[2] == 0 else
                         f"{name} is about to pass its {scene.event_kind(m, w[1])}")
    return f"{scene.keys[m]}: " + ", ".join(parts)
