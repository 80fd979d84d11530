"""Motions that are periodic up to a shift: a pendulum that turns, a mass that creeps along its rail.

A direction along which no force, guard or memory changes is one along which a motion may be moved: y(t + T) = y(t) + d is
periodic for what moves back by d once a period (`elements.timed.shift.Shift`).  Where d is known and the forces are periodic in it
(an angle), nothing else changes.  Where it is unknown the coordinate is put back to zero: perturbations along the direction die at
once, and the multiplier 1 that they have otherwise is 0.
"""
from collections.abc import Mapping

import numpy as np

from ..checks import listed, number, plain_text, refused
from ..elements.timed.shift import Shift
from ..structure.components import place_of
from ..system import System
from .scene import Scene, scene_of
from .writer import kernels

PERIODIC = 1e-12  # of forces: what a shift may change of them, by the rounding of angles
TRIED = 8  # states at which laws are asked whether they are periodic


def shifted(system: System, shift) -> System:
    """Return the system with its motions seen up to a shift.

    Parameters
    ----------
    system : System
    shift : str, sequence of str, or dict
        Coordinates (``"q0"``) that may advance by an unknown amount a period, which is found; or the amount by coordinate,
        ``{"q0": 2 pi}`` for an angle.

    Raises
    ------
    ValueError
        Where a force, a guard or memory would change.
    """
    names = [shift] if isinstance(shift, str) else listed(list(shift) if isinstance(shift, Mapping) else shift)
    if not names or not all(isinstance(name, str) for name in names) or len({*map(plain_text, names)}) < len(names):
        raise refused("find_orbit", "shift", shift, "names of different coordinates, such as ['q0'], or {'q0': 6.283185307179586}")
    known = {plain_text(name): value for name, value in shift.items()} if isinstance(shift, Mapping) else None
    names = [*map(plain_text, names)]
    if any(isinstance(element, Shift) for element in system.elements):
        raise ValueError(f"shift = {shift!r} is not allowed; the motions of {system!r} are seen up to a shift already")
    scene = scene_of(system)
    places = [place_of(name, scene.n, scene.ns, "shift", system.states) for name in names]
    if max(places) >= scene.n:
        raise refused("find_orbit", "shift", shift, f"coordinates, q0 .. q{scene.n - 1}; velocities and memory follow them")
    if system.period is None and (known is None or len(places) > 1):
        raise ValueError(f"shift = {shift!r} is not allowed without excitation, where only one known shift gives the period: "
                         "use coordinates relative to what advances")
    if known is None:
        directions = free_directions(scene, places)
        parts = [Shift(tuple(direction), place) for direction, place in zip(directions.T.tolist(), places, strict=True)]
    else:
        amounts = np.zeros(scene.ns)
        amounts[places] = [number("find_orbit", f"shift[{name!r}]", value) for name, value in known.items()]
        if not amounts.all(where=np.isin(np.arange(scene.ns), places)):
            raise refused("find_orbit", "shift", shift, "amounts that are not zero")
        amounts = with_memory(scene, amounts)
        unchanged(scene, amounts)
        first = places[0]
        parts = [Shift(tuple((amounts / amounts[first]).tolist()), first, float(amounts[first]), system.period is not None)]
    return system.with_elements(parts)


def felt(scene: Scene) -> tuple[np.ndarray, list[str]]:
    """Return what tells the states in all modes listed, rows (k, ns) that are zero along what nothing feels, and whose each is."""
    T, ns, n = scene.tables, scene.ns, scene.n
    rows, owners = [], []
    for m in range(len(scene.keys)):
        rows += [*T.A[m, :, :ns], *T.G[m, :T.n_guards[m], :ns], *T.S[m, :T.n_holds[m], :ns]]
        owners += [*(f"the motion of coordinate {c % n if c < 2 * n else c}" for c in range(ns)),
                   *(scene.element_name(m, g) for g in range(T.n_guards[m])),
                   *(scene.system.labels[scene.hold_element(m, k)] for k in range(T.n_holds[m]))]
        for place, row in scene.algebraic(m):
            own = row[:ns].copy()
            own[place] -= 1.0
            rows.append(own)
            owners.append("memory")
    first = 0
    for law in scene.laws:
        rows += [*T.LU[first:first + law.rows, :ns]]
        owners += [law.name] * law.rows
        first += law.rows
    return np.array(rows), owners


def free_directions(scene: Scene, places: list[int]) -> np.ndarray:
    """Return for each coordinate the least direction (ns,), columns, along which nothing changes: 1 there, 0 at the others.

    Raises
    ------
    ValueError
        Naming what changes.
    """
    rows, owners = felt(scene)
    moved = [c for c in range(scene.ns) if not scene.n <= c < 2 * scene.n]
    seen = rows[:, moved]
    size = np.abs(seen).max(axis=1)
    units = seen[size > 0.0] / size[size > 0.0, None]
    _, values, V = np.linalg.svd(units) if len(units) else (None, np.zeros(0), np.eye(len(moved)))
    noise = max(units.shape) * np.finfo(float).eps * values.max(initial=0.0)
    null = V[np.count_nonzero(values > noise):].T
    at = [moved.index(place) for place in places]
    if np.linalg.matrix_rank(null[at]) < len(at):
        named = ", ".join(f"q{place}" for place in places)
        if null[at].any(axis=1).all():
            raise ValueError(f"shift: {named} advance together, with one shift: name one of them")
        rest = np.setdiff1d(np.arange(len(moved)), at)
        least = np.linalg.lstsq(units[:, rest], -units[:, at].sum(axis=1), rcond=None)[0]
        left = np.abs(units[:, rest] @ least + units[:, at].sum(axis=1))
        told = [owner for owner, told in zip(owners, size > 0.0, strict=True) if told]
        raise ValueError(f"shift: {named} cannot advance: {told[int(np.argmax(left))]} depends on it, whatever moves along")
    exact = null @ np.linalg.pinv(null[at])
    clean = exact.round(12)
    found = np.zeros((scene.ns, len(places)))
    found[moved] = clean if np.abs(units @ clean).max(initial=0.0) <= np.abs(units @ exact).max(initial=0.0) else exact
    found[places] = np.eye(len(places))
    return found


def with_memory(scene: Scene, amounts: np.ndarray) -> np.ndarray:
    """Return a shift (ns,) of coordinates with what memory must move by for nothing to change, as far as it can."""
    rows, memory = felt(scene)[0], slice(2 * scene.n, scene.ns)
    if scene.ns == 2 * scene.n:
        return amounts
    found = amounts.copy()
    found[memory] = np.linalg.lstsq(rows[:, memory], -rows @ amounts, rcond=None)[0]
    return found


def unchanged(scene: Scene, amounts: np.ndarray) -> None:
    """Raise ValueError unless forces and guards are the same at states a shift (ns,) apart: rows exactly, laws where tried."""
    rows, owners = felt(scene)
    laws = {law.name for law in scene.laws}
    for row, owner in zip(rows, owners, strict=True):
        size = np.abs(row) @ np.abs(amounts)
        if owner not in laws and abs(row @ amounts) > PERIODIC * size:
            raise ValueError(f"shift: {owner} changes by it")
    if not scene.laws:
        return
    engine, T = kernels(scene), scene.tables
    draw = np.random.default_rng(0)
    for m in range(len(scene.keys)):
        for _ in range(TRIED):
            x = np.concatenate([draw.uniform(-1.0, 1.0, scene.ns) * max(1.0, np.abs(amounts).max()), scene.forcing(np.zeros(1))[0]])
            rates = np.empty((2, scene.ns))
            for rate, at in zip(rates, (0.0, amounts), strict=True):
                y = x.copy()
                y[:scene.ns] += at
                engine.field(T, m, y, rate)
            apart = np.abs(rates[1] - rates[0])
            if not (apart <= 1e3 * PERIODIC * (1.0 + np.abs(rates[0]))).all():
                raise ValueError(f"shift: forces are not the same there: they differ by {apart.max():.3g}; "
                                 f"one of {', '.join(sorted(laws))} is not periodic in it")
