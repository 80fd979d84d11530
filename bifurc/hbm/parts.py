"""A system as harmonic balance sees it: a linear core with its excitation, contacts with modes, and force laws.

    M q'' + C q' + K q = e(t) + sum R^T f(u, s, t),   u = R q + base(t),   s = R q' + drift + base'(t)

Elements with one affine mode and nothing else (loads, springs, dashpots, moving frames) are folded into M, C, K and e.
Those with guards or memory become *contacts*: tables of their modes over (u, s, z, 1, harmonics), all modes that can be
reached.  One mode with a law that is not affine is a *law*.  Elements that hold rows (`Mode.hold`, set-valued friction) are
*held*: they have no finite force along a given motion and are left to the solvers of set-valued laws.  All numbers lie in
one flat vector whose structure does not change with parameters, as in `compose.scene`.

One file, because structure, numbers and views of one set of tables are laid out, filled and read here and nowhere else.
"""
import math
from collections.abc import Hashable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..elements import Algebraic, Circle, Core, EventKind, Law, Mode, Rate, WatchedCore
from ..elements.local import Affine, affine
from ..system import System
from .layout import Layout
from .tables import packed

MOST_MODES = 64  # of one element, reached from its starts through its guards


class Shape(NamedTuple):
    """Structure of the parts: integers (and the rows R, which are structure too); kernels take `Parts.structure`.

    nc contacts of at most (M modes, G guards, Z memories, Q rows, T successors), nr different rows of all contacts and
    laws, nx columns of excitation (first the constant), mi internal slots: mean, cosine and sine of every harmonic of
    the balance or of the excitation.
    """

    dims: np.ndarray  # n, slots, nr, mi, nx, nc, M, Q, G, Z, T, number of laws
    waves: np.ndarray  # (mi,) harmonic of each internal slot
    place: np.ndarray  # (slots,) internal slot of each slot of the layout
    excited: np.ndarray  # (nx,) internal slot of each column of excitation
    R: np.ndarray  # (nr, n)
    rows: np.ndarray  # (nc, Q) row of each row of a contact; -1: none
    modes: np.ndarray  # (nc,) number of modes
    guards: np.ndarray  # (nc, M) number of guards
    then: np.ndarray  # (nc, M, G, T) successors in order, the mode itself last; -1: none
    algebraic: np.ndarray  # (nc, M, Z) 1: memory follows local values
    memory: np.ndarray  # (nc,) number of memories
    start: np.ndarray  # (nc, M) modes of a start in order; -1: none
    kinds: np.ndarray  # (nc, M, G) code of the event
    silent: np.ndarray  # (nc, M, G) 1: no force changes at the event
    trial: np.ndarray  # (nc, M, G) of modes that write memory: the first successor that keeps it; -1: none
    choice: np.ndarray  # (nc, M, G) 1: a contact closes, to stick (``trial``) or slip at once; 2, 3: it slips up, down, and opens


class Numbers(NamedTuple):
    """The named parts of a flat vector."""

    omega: np.ndarray  # (1,) frequency of the slowest harmonic, omega / periods
    M: np.ndarray  # (n, n)
    C: np.ndarray  # (n, n) with dashpots that are elements
    K: np.ndarray  # (n, n) with springs that are elements
    E: np.ndarray  # (slots, n) excitation
    base: np.ndarray  # (nr, nx) motion added to the rows
    drift: np.ndarray  # (nr,) speed added to the rows
    FU: np.ndarray  # (nc, M, Q, Q) force of a mode by coordinates,
    FS: np.ndarray  # (nc, M, Q, Q) by speeds,
    FZ: np.ndarray  # (nc, M, Q, Z) by frozen memory,
    FH: np.ndarray  # (nc, M, Q, nx) by constant and harmonics
    GU: np.ndarray  # (nc, M, G, Q) guards, the same
    GS: np.ndarray
    GZ: np.ndarray  # (nc, M, G, Z)
    GH: np.ndarray  # (nc, M, G, nx)
    ZU: np.ndarray  # (nc, M, Z, Q) algebraic memory, the same
    ZS: np.ndarray
    ZH: np.ndarray  # (nc, M, Z, nx)
    XU: np.ndarray  # (nc, Z, Q) memory of a virgin start, from the means of coordinates and speeds
    XS: np.ndarray  # (nc, Z, Q)
    law: np.ndarray  # (number of values,) of all laws


@dataclass(frozen=True)
class Contact:
    """An element with guards or memory: its number in the system, name, mode keys, and rows (numbers of `Shape.R`)."""

    element: int
    name: str
    keys: tuple[Hashable, ...]
    rows: tuple[int, ...]


@dataclass(frozen=True)
class ForceLaw:
    """A memoryless law f(u, s): element, name, law, rows, and where its values lie in `Numbers.law`."""

    element: int
    name: str
    law: Law
    rows: tuple[int, ...]
    values: slice


@dataclass(frozen=True)
class Held:
    """An element that holds rows in some mode: its number, name, mode keys, and rows."""

    element: int
    name: str
    keys: tuple[Hashable, ...]
    rows: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Parts:
    """A system split for a layout.

    Attributes
    ----------
    system : System
    layout : Layout
    shape : Shape
    flat : ndarray
        All numbers, see `Numbers`.
    contacts : tuple of Contact
    laws : tuple of ForceLaw
    held : tuple of Held
        Set-valued elements; a plain balance refuses them, see `orbits.balance.find`.
    sampled : dict
        How the numbers depend on parameters, kept by those who sample them for all parts made from each other.
    """

    system: System
    layout: Layout
    shape: Shape
    flat: np.ndarray
    contacts: tuple[Contact, ...]
    laws: tuple[ForceLaw, ...]
    held: tuple[Held, ...]
    sampled: dict = field(default_factory=dict, repr=False, compare=False)

    @cached_property
    def numbers(self) -> Numbers:
        """The flat vector by name (views)."""
        return views(self.flat, self.shape)

    @cached_property
    def structure(self) -> np.ndarray:
        """The structure as kernels take it, one vector of integers; see `hbm.tables`."""
        return packed(self.shape)

    @property
    def rows(self) -> np.ndarray:
        """All rows on which forces that are not linear act, (nr, n)."""
        return self.shape.R

    def flat_of(self, system: System) -> np.ndarray:
        """Return the flat vector of another system of the same structure.

        Raises
        ------
        ValueError
            When the structure differs.
        """
        if system.structure != self.system.structure:
            raise ValueError(f"{system!r} has another structure than {self.system!r}")
        own, reads_omega = self._own
        flat = own.copy()
        if not reads_omega and self.system.differs_in_omega_only(system):
            assert system.omega is not None
            flat[0] = system.omega / self.layout.periods
        else:
            flat[:] = 0.0
            _fill(system, self, views(flat, self.shape))
        return flat

    @cached_property
    def _own(self) -> tuple[np.ndarray, bool]:
        """The numbers of the own system, and whether they follow the frequency, but the frequency itself."""
        flat = np.zeros_like(self.flat)
        return flat, _fill(self.system, self, views(flat, self.shape))

    def at(self, system: System) -> "Parts":
        """Return the parts of another system of the same structure."""
        return replace(self, system=system, flat=self.flat_of(system))


def split(system: System, layout: Layout) -> Parts:
    """Return the parts of a forced system.

    Parameters
    ----------
    system : System
    layout : Layout
        Of the balance.

    Raises
    ------
    ValueError
        Autonomous system; an element with a kick (rigid stop); an excitation on a harmonic that is not listed; more modes
        than `MOST_MODES`, memory with a rate, or laws in an element of several modes: the message names the element and
        says what to do.
    """
    if system.omega is None:
        raise ValueError(f"{system!r} is autonomous; harmonic balance needs an excitation frequency omega")
    found = [_reached(system, number) for number in range(len(system.elements))]
    n, periods = system.n, layout.periods
    rows: list[np.ndarray] = []
    known: dict[bytes, int] = {}
    contacts, laws, held = [], [], []
    values = 0
    excited: set[int] = set()
    for number, (element, modes) in enumerate(zip(system.elements, found, strict=True)):
        kind = _kind(modes)
        if kind == "linear":
            continue
        site = element.site(n)
        own = []
        for R in site.R:
            key = R.tobytes()
            if site.base or site.drift or key not in known:
                rows.append(R)
                own.append(len(rows) - 1)
                if not (site.base or site.drift):
                    known[key] = own[-1]
            else:
                own.append(known[key])
        excited |= {*element.harmonics, *site.harmonics}
        name, keys = system.labels[number], tuple(modes)
        if kind == "held":
            held.append(Held(number, name, keys, tuple(own)))
        elif kind == "law":
            law = next(iter(modes.values())).law
            assert law is not None
            laws.append(ForceLaw(number, name, law, tuple(own), slice(values, values + len(law.values))))
            values += len(law.values)
        else:
            contacts.append(Contact(number, name, keys, tuple(own)))
    internal = sorted({*layout.harmonics, *(k * periods for k in excited)} - {0})
    shape = _shape(system, layout, found, contacts, np.array(rows).reshape(len(rows), n), internal,
                   sorted(k * periods for k in excited), values, len(laws))
    parts = Parts(system, layout, shape, np.zeros(length(shape)), tuple(contacts), tuple(laws), tuple(held))
    _fill(system, parts, parts.numbers)
    return parts


def _reached(system: System, number: int) -> dict[Hashable, Mode]:
    """Return the modes of an element that can be reached from its starts, by key."""
    element, name = system.elements[number], system.labels[number]
    modes: dict[Hashable, Mode] = {}
    left = list(element.start)
    if isinstance(element.site(system.n), Circle):
        raise ValueError(f"{name} acts on a circle, which harmonic balance does not treat. Use find_orbit without method= "
                         "(event-exact shooting)")
    while left:
        key = left.pop(0)
        if key in modes:
            continue
        if len(modes) == MOST_MODES:
            raise ValueError(f"{name}: more than {MOST_MODES} modes can be reached, too many to tabulate for harmonic balance; "
                             "split the element into several that act on the same rows")
        mode = modes[key] = element.mode(key, system.core)
        for guard in mode.guards:
            if guard.kick is not None:
                raise ValueError(f"{name} gives an impulse ({guard.kind}), which has no finite force and no Fourier series: "
                                 "harmonic balance cannot treat it. Use find_orbit without method= (event-exact shooting), or "
                                 "an ElasticStop")
            if isinstance(guard.value, Law):
                raise ValueError(f"{name} has a guard that is a law ({guard.kind}), which harmonic balance does not treat. Use "
                                 "find_orbit without method= (event-exact shooting)")
            if callable(guard.then):
                raise ValueError(f"{name} decides jointly what follows an event ({guard.kind}), which harmonic balance does not "
                                 "tabulate. Use find_orbit without method= (event-exact shooting)")
            left += [*guard.then]
    law = [key for key, mode in modes.items() if mode.law is not None]
    if law and len(modes) > 1 and not any(mode.hold for mode in modes.values()):
        raise ValueError(f"{name}: laws that are not affine in an element of several modes ({', '.join(map(str, modes))}) are not "
                         "treated by harmonic balance; use find_orbit without method=")
    if any(isinstance(memory, Rate) for mode in modes.values() for memory in mode.memory):
        raise ValueError(f"{name}: memory with a rate is not treated by harmonic balance; make it a coordinate of the system, or "
                         "use find_orbit without method=")
    return modes


def _kind(modes: dict[Hashable, Mode]) -> str:
    """Return "linear", "law", "held" or "contact"."""
    if any(mode.hold for mode in modes.values()):
        return "held"
    if len(modes) == 1:
        mode = next(iter(modes.values()))
        if mode.law is not None:
            return "law"
        if not mode.guards and not any("z" in affine(entry).names for entry in mode.entries):
            return "linear"
    return "contact"


def _shape(system, layout, found, contacts, R, internal, excited, values, laws) -> Shape:
    """Return the structure."""
    slots = {0: 0, **{k: 1 + 2 * i for i, k in enumerate(internal)}}
    waves = np.concatenate([[0], np.repeat(np.array(internal, np.int64), 2)])
    place = np.array([slots[int(k)] + int(sine) for k, sine in zip(layout.waves, layout.is_sine, strict=True)], np.int64)
    columns = np.array([0, *(slots[k] + i for k in excited if k for i in (0, 1))], np.int64)
    nc = len(contacts)
    modes = [list(found[c.element].values()) for c in contacts]
    most = max(map(len, modes), default=1)
    Q = max((len(c.rows) for c in contacts), default=1)
    G = max((len(m.guards) for each in modes for m in each), default=0) or 1
    Z = max((len(system.elements[c.element].memory) for c in contacts), default=0) or 1
    T = 1 + max((len(g.then) for each in modes for m in each for g in m.guards), default=0)
    dims = np.array([system.n, layout.slots, len(R), len(waves), len(columns), nc, most, Q, G, Z, T, laws, values], np.int64)
    rows = np.full((nc, Q), -1)
    guards, then = np.zeros((nc, most), np.int64), np.full((nc, most, G, T), -1)
    algebraic, start = np.zeros((nc, most, Z), np.int64), np.full((nc, most), -1)
    kinds, silent = np.zeros((nc, most, G), np.int64), np.zeros((nc, most, G), np.int64)
    memory, trial, choice = np.zeros(nc, np.int64), np.full((nc, most, G), -1), np.zeros((nc, most, G), np.int64)
    for c, (contact, own) in enumerate(zip(contacts, modes, strict=True)):
        element = system.elements[contact.element]
        index = {key: i for i, key in enumerate(contact.keys)}
        rows[c, :len(contact.rows)] = contact.rows
        memory[c] = len(element.memory)
        start[c, :len(element.start)] = [index[key] for key in element.start]
        for m, mode in enumerate(own):
            guards[c, m] = len(mode.guards)
            algebraic[c, m, :len(mode.memory)] = [isinstance(item, Algebraic) for item in mode.memory]
            for g, guard in enumerate(mode.guards):
                after = [index[key] for key in guard.then if index[key] != m]
                then[c, m, g, :len(after) + 1] = [*after, m]
                kinds[c, m, g] = guard.kind.code
                silent[c, m, g] = guard.silent
                if algebraic[c, m].any():
                    trial[c, m, g] = next((i for i in after if not any(isinstance(z, Algebraic) for z in own[i].memory)), -1)
                    choice[c, m, g] = guard.kind is EventKind.CONTACT and trial[c, m, g] >= 0 and len(after) > 1
        for m, mode in enumerate(own):
            ways = _slips_beside(own, index, mode)
            for g, guard in enumerate(mode.guards):
                if guard.kind is EventKind.SEPARATION and m in ways:
                    choice[c, m, g] = 2 + ways.index(m)
    count = np.array([len(own) for own in modes], np.int64)
    return Shape(dims, waves, place, columns, np.ascontiguousarray(R, float), rows, count, guards, then, algebraic, memory, start,
                 kinds, silent, trial, choice)


def _slips_beside(own, index, mode) -> list[int]:
    """Return the modes of slip that follow the stick in which a mode of slip ends; empty for other modes."""
    stick = next((own[index[key]] for guard in mode.guards if guard.kind is EventKind.STICK for key in guard.then[:1]), None)
    return [] if stick is None else [index[guard.then[0]] for guard in stick.guards if guard.kind is EventKind.SLIP]


def _blocks(shape: Shape) -> list[tuple[int, ...]]:
    """Return the shapes of the blocks of a flat vector, in order; expressions as in `hbm.tables`."""
    n, m, nr, _, nx, nc, M, Q, G, Z, _, _, values = (int(v) for v in shape.dims)
    return [(1,), (n, n), (n, n), (n, n), (m, n), (nr, nx), (nr,), (nc, M, Q + G + Z, nx + 2 * Q + Z), (nc, Z, 2 * Q), (values,)]


def length(shape: Shape) -> int:
    """Return the number of numbers."""
    return sum(math.prod(size) for size in _blocks(shape))


def views(flat: np.ndarray, shape: Shape) -> Numbers:
    """Return the parts of a flat vector by name."""
    blocks, start = [], 0
    for size in _blocks(shape):
        stop = start + math.prod(size)
        blocks.append(flat[start:stop].reshape(size))
        start = stop
    nx, Q, G = (int(v) for v in shape.dims[[4, 7, 8]])
    pairs, memory = nx + 2 * Q, []
    for rows in (slice(0, Q), slice(Q, Q + G), slice(Q + G, None)):
        own = blocks[7][:, :, rows]
        memory.append((own[..., nx:pairs:2], own[..., nx + 1:pairs:2], own[..., pairs:], own[..., :nx]))
    F, G_, Z_ = memory
    named = [*blocks[:7], *F, *G_, Z_[0], Z_[1], Z_[3], blocks[8][..., ::2], blocks[8][..., 1::2], blocks[9]]
    return Numbers(*named)


class _Row(NamedTuple):
    """An expression over the local values of a contact: (Q,) by u and s, (Z,) by z, (nx,) by constant and harmonics."""

    U: np.ndarray
    S: np.ndarray
    Z: np.ndarray
    H: np.ndarray


def _read(expression, Q: int, Z: int, columns: dict, what: str) -> _Row:
    """Split an expression; ``columns`` maps ("one", 0), ("cos", k), ("sin", k) to the column of excitation."""
    row = _Row(np.zeros(Q), np.zeros(Q), np.zeros(Z), np.zeros(max(columns.values()) + 1))
    places = {"u": row.U, "s": row.S, "z": row.Z}
    for key, weight in affine(expression).terms.items():
        name, index = key
        if key in columns:
            row.H[columns[key]] += weight
        elif name in places and index < len(places[name]):
            places[name][index] += weight
        else:
            raise ValueError(f"{what}: the expression {expression!r} uses {name}({index}), which is not there; harmonics must be "
                             "listed in `harmonics` of the element")
    return row


def _fill(system: System, parts: Parts, T: Numbers) -> bool:
    """Write the numbers of a system; return whether they follow the frequency, but the frequency itself."""
    layout, shape = parts.layout, parts.shape
    n, _, _, mi, nx, _, _, Q, _, Z = (int(v) for v in shape.dims[:10])
    M, C, K, omega = system.core
    assert omega is not None
    core = WatchedCore(system.core)
    nu = omega / layout.periods
    T.omega[0], T.M[:], T.C[:], T.K[:] = nu, M, C, K
    columns: dict = {("one", 0): 0}
    for i, slot in enumerate(shape.excited[1:], 1):
        k = int(shape.waves[slot]) // layout.periods
        columns["cos" if i % 2 else "sin", k] = i
    rest = {number for each in (parts.contacts, parts.laws, parts.held) for number in (item.element for item in each)}
    for number in range(len(system.elements)):
        if number not in rest:
            _fold(system, number, core, layout, T)
    placed: tuple[Contact | ForceLaw | Held, ...] = (*parts.contacts, *parts.laws, *parts.held)
    for item in placed:
        site = system.elements[item.element].site(n)
        for i, row in enumerate(item.rows):
            if site.base:
                T.base[row] = _read(site.base[i], 0, 0, columns, item.name).H
            if site.drift:
                T.drift[row] = site.drift[i]
    for law in parts.laws:
        element = system.elements[law.element]
        own = element.mode(element.start[0], core).law
        assert own is not None
        T.law[law.values] = own.values
    for c, contact in enumerate(parts.contacts):
        element = system.elements[contact.element]
        for i, value in enumerate(element.virgin):
            loose = _read(value, Q, Z, columns, contact.name)
            T.XU[c, i], T.XS[c, i] = loose.U, loose.S
        for m, key in enumerate(contact.keys):
            _fill_mode(T, c, m, element.mode(key, core), (Q, Z, columns, contact.name))
    return core.read


def _fill_mode(T: Numbers, c: int, m: int, mode: Mode, how) -> None:
    """Write forces, guards and algebraic memory of a mode; algebraic memory is put in where it occurs."""
    slaves = {}
    for i, item in enumerate(mode.memory):
        if isinstance(item, Algebraic):
            row = slaves[i] = _read(item.value, *how)
            if row.Z.any():
                raise ValueError(f"{how[3]}: an algebraic internal variable of another one is not treated by harmonic balance; "
                                 "use find_orbit without method=, or the parallel set equal to a MicroSlip, its iwan()")
            T.ZU[c, m, i], T.ZS[c, m, i], T.ZH[c, m, i] = row.U, row.S, row.H

    def put(expression, U, S, Zs, H):
        row = _read(expression, *how)
        for i, slave in slaves.items():
            weight = row.Z[i]
            if weight:
                row.U[:] += weight * slave.U
                row.S[:] += weight * slave.S
                row.H[:] += weight * slave.H
                row.Z[i] = 0.0
        U[:], S[:], Zs[:], H[:] = row

    for q, entry in enumerate(mode.entries):
        put(entry, T.FU[c, m, q], T.FS[c, m, q], T.FZ[c, m, q], T.FH[c, m, q])
    for g, guard in enumerate(mode.guards):
        put(guard.value, T.GU[c, m, g], T.GS[c, m, g], T.GZ[c, m, g], T.GH[c, m, g])


def _fold(system: System, number: int, core: Core, layout: Layout, T: Numbers) -> None:
    """Add an element of one affine mode to the core and the excitation."""
    element = system.elements[number]
    site, mode = element.site(system.n), element.mode(element.start[0], core)
    for i, entry in enumerate(mode.entries):
        constant = np.zeros(1)
        waves: dict[int, np.ndarray] = {}

        def add(expression: Affine, weight: float, turned: bool, constant=constant, waves=waves):
            """Add weight times an expression of constants and harmonics, or its time derivative."""
            for (name, k), value in expression.terms.items():
                if name == "one":
                    constant[0] += 0.0 if turned else weight * value
                    continue
                pair = waves.setdefault(k, np.zeros(2))
                if turned:  # cos -> -k omega sin, sin -> k omega cos
                    pair[1 if name == "cos" else 0] += (-1.0 if name == "cos" else 1.0) * k * core.omega * weight * value
                else:
                    pair[0 if name == "cos" else 1] += weight * value

        for (name, index), weight in affine(entry).terms.items():
            if name == "u":
                T.K[:] -= np.outer(site.R[i], weight * site.R[index])
            elif name == "s":
                T.C[:] -= np.outer(site.R[i], weight * site.R[index])
                if site.drift:
                    constant[0] += weight * site.drift[index]
            elif name in ("one", "cos", "sin"):
                add(Affine({(name, index): 1.0}), weight, False)
                continue
            else:
                raise ValueError(f"{system.labels[number]}: the expression {entry!r} uses {name}({index}), which is not there")
            if site.base:
                add(site.base[index], weight, name == "s")
        _excite(system, number, layout, T, site.R[i], float(constant[0]), waves)


def _excite(system: System, number: int, layout: Layout, T: Numbers, R, constant: float, waves: dict) -> None:
    """Add a load along a row; harmonics that the layout does not list are an error unless they vanish."""
    for k, pair in {0: (constant,), **waves}.items():
        own = k * layout.periods
        if own in layout.harmonics:
            first = layout.slot(own)
            for i, value in enumerate(pair):
                T.E[first + i] += value * R
        elif any(pair):
            raise ValueError(f"{system.labels[number]} excites harmonic {k}, which is not among the harmonics of the balance "
                             f"({', '.join(f'{h / layout.periods:g}' for h in layout.harmonics)}); add {k} to harmonics")


def event_kind(shape: Shape, contact: int, mode: int, guard: int) -> EventKind:
    """Return what happens when a guard of a contact's mode is reached."""
    return tuple(EventKind)[int(shape.kinds[contact, mode, guard])]
