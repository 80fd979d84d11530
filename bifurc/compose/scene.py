"""A system becomes mode tables: combinations of element modes, looked up when reached and packed as numbers.

A scene mode is one mode of every element.  Its forces are summed, its held rows eliminated by one multiplier solve,

    lam = -(H M^-1 D)^-1 (H a_free + base''),     a = a_free + M^-1 D lam,

with H the held rows of all elements and D their pushes; guards and resets become rows over x = (q, v, z, 1, cos, sin).

One file, because it is one class: modes are looked up, combined, numbered and mirrored in one table that grows.
"""
import copy
import functools
import itertools
import math
from collections.abc import Collection, Hashable, Iterable, Iterator
from typing import NamedTuple

import numpy as np

from ..elements import EventKind, Frame, Guard
from ..elements.friction.joint import Joint
from ..elements.friction.together import includes, key_of
from ..system import System
from .jointly import FIRST, carried, slips
from .numbers import Block, DependentHolds, Packer, layout, views
from .pieces import SceneLaw, law_rows
from .tables import MODAL, NUMBERS, Tables, allocate, keep, rebuild
from .writer import bind

CLOSURE = 64  # scenes of at most so many reachable modes are built at once


class GuardOf(NamedTuple):
    """A guard of a scene mode: the element that owns it, its number there, and what it says."""

    element: int
    number: int
    guard: Guard


class Leads(NamedTuple):
    """What the guards of a mode lead to: keys of modes that can be, built or not."""

    then: tuple[tuple | None, ...]  # modes tried after each guard, without the mode itself; None: decided where it happens
    ends_in: tuple[tuple | None, ...]  # mode in which a complete chattering ends
    still: list[int]  # see `Packer.still`
    waiting: tuple[tuple[int, Hashable], ...]  # elements that would hold a row which others hold, and the key with which


def scene_of(system: System) -> "Scene":
    """Return the scene of a system; made once and kept with it.

    A system made from another by changes of numbers has its modes under the same numbers.
    """
    if system._scene is None:
        refuse_delay(system)
        kin = system._kin
        if isinstance(kin, Scene):
            scene = kin.at(system) if kin.same_structure(system) else Scene(system)
        else:
            scene = Scene(system, kin or ())
        system.__dict__.update(_scene=scene, _kin=None)
    return system._scene


def beside(system: System, name: str, value: float, inside: float) -> System:
    """Return the system with a parameter changed, which its last digit moves towards ``inside`` where other contacts would rest
    together at just this value: what the modes of the system come to there is the limit of their motions."""
    made = system.with_parameters(**{name: value})
    return made if alike(made, system) else system.with_parameters(**{name: math.nextafter(value, inside)})


def alike(one: System, other: System) -> bool:
    """Return whether the same contacts rest together, and jointly, in two systems."""
    return one.together == other.together and one.joints == other.joints


def given(system: System, tables: Tables) -> System:
    """Return a system made from another by a change of numbers that takes these tables, of all modes, for its own."""
    kin = system._kin
    if isinstance(kin, Scene) and kin.same_structure(system):
        system.__dict__.update(_scene=kin.at(system, tables), _kin=None)
    return system


def numbered(system: System) -> dict:
    """Return the record of a system, with the modes met where their numbers depend on the order in which they were met."""
    scene = scene_of(system)
    return system.to_record() if scene.complete else {**system.to_record(), "modes": scene.keys}


def refuse_delay(system: System) -> None:
    """Raise ValueError for a system whose force depends on its own past, naming the elements."""
    past = [label for label, element in zip(system.labels, system.elements, strict=True) if element.delayed]
    if past:
        raise ValueError(f"{', '.join(map(repr, past))}: delayed feedback is not supported here; `simulate` follows it. "
                         "On orbits of its period it vanishes: find and trace them without it, and ask control.feedback_range for "
                         "their stability")


class Scene:
    """Modes of a system and their tables.

    Attributes
    ----------
    system : System
    together, joints : tuple
        Contacts that rest together, and jointly, see `System`; those of the first system of these modes.
    n, ns, nw : int
        Degrees of freedom, states, forcing states.
    harmonics : tuple of int
    omega, period : float or None
    keys : list of tuple
        Element keys of each scene mode.
    tables : Tables
        Grown when a mode is reached: take it again after `index` and `expand`.
    closed_form : bool
        No law in any mode built so far.
    laws : tuple of SceneLaw
        Laws that are not affine; the tables hold their places, rows, pushes and values, and in A the affine rest.
    bound : ndarray (2,)
        Addresses of what is compiled for these laws, zeros before; part of all tables with these laws.
    divisions : dict
        What was found about event sequences with the numbers of this scene, kept by those who ask it again and again.
    sampled : dict
        How the numbers depend on parameters, kept by those who sample them for all systems made from each other.
    """

    tables: Tables

    def __init__(self, system: System, modes: Iterable[tuple] = ()):
        self.system, self.together, self.joints = system, system.together, system.joints
        elements = system.elements
        n = system.n
        self.slices, nz = [], 0
        harmonics: set[int] = set()
        for element in elements:
            self.slices.append(slice(2 * n + nz, 2 * n + nz + len(element.memory)))
            nz += len(element.memory)
            harmonics |= {*element.harmonics, *element.site(n).harmonics}
        self.harmonics = tuple(sorted(harmonics))
        self.frame = Frame(n, nz, self.harmonics, system.omega)
        self.n, self.ns, self.nw = n, self.frame.ns, self.frame.nx - self.frame.ns
        self.omega, self.period = system.omega, system.period
        self.keys: list[tuple[Hashable, ...]] = []
        self._index: dict[tuple, int] = {}
        self._buildable: dict[tuple, bool] = {}
        self._holds: list[tuple[int, ...]] = []
        self._leads: list[Leads] = []
        self._algebraic: dict[int, list] = {}
        self.sampled: dict[tuple, tuple] = {}
        self.divisions: dict[tuple, np.ndarray] = {}
        self._reach: list[tuple[int, Hashable]] | None = None
        self.laws: tuple[SceneLaw, ...] = ()
        self._blocks: list[Block] = []
        self.bound = np.zeros(2, np.int64)
        self._packed = 0  # modes whose numbers are in the tables
        first = next(self._start_keys(), None)
        reach = self._closure()
        self.complete = reach is not None
        if first is None:
            raise ValueError(f"{system!r}: all combinations of start keys hold dependent rows")
        for keys in reach if reach is not None else (first,):
            self._add(keys)
        for keys in modes:
            if keys not in self._index and self._possible(keys):
                self._add(keys)
        self._pack()

    def at(self, system: System, tables: Tables | None = None) -> "Scene":
        """Return the scene of another system of the same structure, with the modes met here under the same numbers.

        ``tables`` are its own where its numbers are known; they must be of all modes.
        """
        other = copy.copy(self)
        other.system, other.frame = system, self.frame.at(system.omega)
        other.omega, other.period = system.omega, system.period
        for made in ("_packer", "_guards", "_flat"):
            other.__dict__.pop(made, None)
        other.keys, other._index, other._holds, other._leads = (
            self.keys.copy(), self._index.copy(), self._holds.copy(), self._leads.copy())
        other._buildable = dict.fromkeys(self.keys, True)
        other._algebraic, other.divisions = {}, {}
        other.tables = self._rebuilt(other._filled(other._packer)) if tables is None else tables
        return other

    @functools.cached_property
    def _packer(self) -> Packer:
        return Packer(self.system, self.frame, self.slices, self.together, self.joints)

    @functools.cached_property
    def _guards(self) -> list[tuple[GuardOf, ...]]:
        """Guards of each mode."""
        return [self._guards_of(keys) for keys in self.keys]

    def __repr__(self):
        return f"Scene(n={self.n}, modes={len(self.keys)}, harmonics={self.harmonics}, closed_form={self.closed_form})"

    # modes

    def index(self, keys: tuple) -> int:
        """Return the mode of these element keys, built when it is not there yet.

        Raises
        ------
        DependentHolds
            When the rows held by the elements together depend on each other.
        """
        found = self._index.get(keys)
        if found is None:
            if not self._possible(keys):
                raise DependentHolds(f"the modes {keys} of {self.system.labels} hold rows that depend on each other")
            found = self._add(keys)
            self._pack()
        return found

    def start_modes(self, unordered: Collection[int] = ()) -> Iterator[int]:
        """Yield the modes that may hold at a start, in the order they are tried: first keys of all elements first.

        The memory of the elements ``unordered`` is not such as their own starts rely on, see `disordered`.
        """
        for keys in self._start_keys(unordered):
            yield self.index(keys)

    def disordered(self, X: np.ndarray) -> dict[int, np.ndarray]:
        """Return the elements whose memory, in some of the states ``X`` (N, nx or ns), their starts do not rely on: which (N,).

        See `Element.ordered`.
        """
        found = {}
        for e, element in enumerate(self.system.elements):
            if element.unordered is not None:
                past = ~element.ordered(X[:, self.slices[e]])
                if past.any():
                    found[e] = past
        return found

    def _start_keys(self, unordered: Collection[int] = ()) -> Iterator[tuple]:
        """Yield the keys of start modes.  Of contacts that hold the same rows (two frictions on one mass) one holds them."""
        starts = [(element.unordered,) if e in unordered else element.start for e, element in enumerate(self.system.elements)]
        for changes in range(sum(len(keys) - 1 for keys in starts) + 1):
            for choice in itertools.product(*(range(min(len(keys), changes + 1)) for keys in starts)):
                if sum(choice) == changes:
                    keys = tuple(start[i] for start, i in zip(starts, choice, strict=True))
                    if self._possible(keys):
                        yield keys

    def expand(self, mode: int, guard: int) -> Tables:
        """Build what `then` and `ends_in` of a guard still lack (-2); return the tables, which have grown."""
        leads = self._leads[mode]
        for keys in (*(leads.then[guard] or ()), leads.ends_in[guard]):
            if keys is not None:
                self.index(keys)
        return self.tables

    def combine(self, mode: int, element: int, key: Hashable) -> int | None:
        """Return the mode with the key of one element changed, built when reached; None: its holds are dependent."""
        return self.combined(mode, {element: key})

    def combined(self, mode: int, changes: dict[int, Hashable]) -> int | None:
        """Return the mode with the keys of some elements changed together; None: its holds are dependent."""
        keys = self._with_keys(self.keys[mode], changes)
        return self.index(keys) if self._possible(keys) else None

    def tried(self, mode: int, changes: dict[int, Hashable]) -> Iterator[int]:
        """Yield the modes tried, in this order, where the keys of some elements change together, see `_tried`."""
        for keys in self._tried(self.keys[mode], changes, self._leads[mode].waiting):
            yield self.index(keys)

    def guard(self, mode: int, guard: int) -> GuardOf:
        """Return element, number and meaning of a guard."""
        return self._guards[mode][guard]

    def followers(self, mode: int, guard: int, x: np.ndarray) -> tuple[Hashable, ...]:
        """Return the keys of the guard's element that may follow at the joined state ``x`` (nx,), in the order they are tried."""
        element, _, what = self._guards[mode][guard]
        return what.then(self._packer.reader(element, x)) if callable(what.then) else what.then

    def guards_of(self, mode: int, element: int) -> tuple[int, ...]:
        """Return the guards of a mode that belong to an element."""
        return tuple(g for g, owner in enumerate(self._guards[mode]) if owner.element == element)

    def hold_element(self, mode: int, hold: int) -> int:
        """Return the element that holds row number ``hold``."""
        return self._holds[mode][hold]

    def event_kind(self, mode: int, guard: int, after: int | None = None) -> EventKind:
        """Return what happens when this guard fires; where the mode ``after`` it is known, whether a slide begins."""
        kind = self._guards[mode][guard].guard.kind
        if kind is EventKind.CROSS and after is not None and self.slides(after) and not self.slides(mode):
            return EventKind.SLIDE_BEGIN
        return kind

    def slides(self, mode: int) -> bool:
        """Return whether a motion slides along a surface of fields of first order in a mode."""
        return any(own.guard.kind is EventKind.SLIDE_END for own in self._guards[mode])

    def element_name(self, mode: int, guard: int) -> str:
        """Return the label of the element that owns a guard."""
        return self.system.labels[self._guards[mode][guard].element]

    @functools.cached_property
    def _final(self) -> tuple:
        return tuple((e, key, status) for e, element in enumerate(self.system.elements) for key, status in element.final)

    def ending(self, mode: int) -> str | None:
        """Return the status of a motion that ends in a mode; None where it goes on."""
        return next((status for e, key, status in self._final if key == self.keys[mode][e]), None)

    @functools.cached_property
    def _has_regions(self) -> bool:
        return any(element.regions or element.slides for element in self.system.elements)

    def region(self, mode: int) -> tuple[str, ...]:
        """Return the sides of surfaces on which the fields of a mode act; empty where none of its elements has such regions."""
        if not self._has_regions:
            return ()
        return tuple(sides for element, own in zip(self.system.elements, self.keys[mode], strict=True)
                     for key, sides in element.regions if key == own)

    def ended(self, mode: int, status: str) -> int:
        """Return the mode with which a motion ends with a status that one of its elements knows."""
        e, key = next((e, key) for e, element in enumerate(self.system.elements) for key, own in element.final if own == status)
        return self.index(self._with_key(self.keys[mode], e, key))

    def kept(self, mode: int) -> list[tuple[int, int]]:
        """Return the guards (mode, guard) that vanish while a mode lasts that slides along surfaces of fields of first order."""
        found: list[tuple[int, int]] = []
        if not self._has_regions:
            return found
        for e, (element, own) in enumerate(zip(self.system.elements, self.keys[mode], strict=True)):
            for other, number in dict(element.slides).get(own, ()):
                beside = self.index(self._with_key(self.keys[mode], e, other))
                found.append((beside, self.guards_of(beside, e)[number]))
        return found

    # memory

    def memory_of(self, element: int) -> slice:
        """Return the places of an element's memory in the state."""
        return self.slices[element]

    def relax(self, x: np.ndarray) -> None:
        """Write the virgin memory of all elements into the joined state ``x`` (nx,)."""
        for place, row in self._packer.virgin():
            x[place] = row @ x

    def show(self, mode: int, states: np.ndarray, tau: np.ndarray) -> None:
        """Write the memory that follows local values in a mode into ``states`` (k, ns) at the times ``tau`` (k,)."""
        if self.ns == 2 * self.n:
            return
        rows = self.algebraic(mode)
        if rows:
            joined = np.hstack([states, self.forcing(tau)])
            for place, row in rows:
                states[:, place] = joined @ row

    def shown(self, modes: np.ndarray, states: np.ndarray, tau: np.ndarray) -> np.ndarray:
        """Return the ``states`` (k, ns) in ``modes`` (k,) at the times ``tau`` (k,), with the memory that follows local values."""
        if self.ns == 2 * self.n:
            return states
        found = np.array(states)
        for mode in np.unique(modes):
            here = modes == mode
            some = found[here]
            self.show(int(mode), some, tau[here])
            found[here] = some
        return found

    def algebraic(self, mode: int) -> list[tuple[int, np.ndarray]]:
        """Return place and row (nx,) of every memory state that follows local values in a mode."""
        rows = self._algebraic.get(mode)
        if rows is None:
            rows = self._algebraic[mode] = self._packer.algebraic(self.keys[mode])
        return rows

    def forcing(self, tau: np.ndarray) -> np.ndarray:
        """Return the forcing states (k, nw) at the times ``tau`` (k,)."""
        angle = np.multiply.outer(np.asarray(tau, float), np.array(self.harmonics, float) * (self.omega or 0.0))
        found = np.ones((len(angle), self.nw))
        found[:, 1::2], found[:, 2::2] = np.cos(angle), np.sin(angle)
        return found

    def is_curved(self, element: int) -> bool:
        """Return whether the site of an element is curved."""
        return self._packer.sites[element].curved

    @property
    def meeting_circles(self) -> list[tuple[str, str]]:
        """Labels of elements on circles that share a body: only one of each pair can hold rows at a time."""
        labels = self.system.labels
        return [(labels[e], labels[other]) for e, other in self._packer.meeting_circles]

    def put_to_rest(self, mode: int, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the joined state ``x`` (nx,) with the speeds of rows that a mode holds taken away by inertia, and its sizes."""
        return self._packer.put_to_rest(self.keys[mode], x)

    def taken_along(self, mode: int, x: np.ndarray, noise: np.ndarray) -> dict[int, Hashable]:
        """Return the frictions that rest in a mode but move at ``x`` (nx,), by more than its ``noise`` (nx,), each with the key of
        that slip; none where nothing rests jointly."""
        return slips(self._packer, self.keys[mode], x, noise)

    # symmetry

    def mirror(self, mode: int) -> int:
        """Return the mode after y -> -y and half a period; the system must be symmetric."""
        order = self._order()
        keys: list = [None] * len(order)
        for e, element in enumerate(self.system.elements):
            keys[order[e]] = element.mirrored_key(self.keys[mode][e])
        return self.index(tuple(keys))

    def mirror_guard(self, mode: int, guard: int) -> int:
        """Return the guard of the mirrored mode that answers a guard of ``mode``."""
        owner, order = self._guards[mode][guard], self._order()
        image = self.mirror(mode)
        if isinstance(joint := owner.guard.then[0] if not callable(owner.guard.then) else None, Joint):
            mirrored = Joint(tuple((order[e], self.system.elements[e].mirrored_key(key)) for e, key in joint.changes))
            after = self._with_key(self.keys[image], order[owner.element], mirrored)
            return next(g for g, other in enumerate(self._guards[image]) if not callable(other.guard.then)
                        and after == self._with_key(self.keys[image], other.element, other.guard.then[0]))
        number = self.system.elements[owner.element].mirrored_guard(self.keys[mode][owner.element], owner.number)
        leader, way = self.together[order[owner.element]]
        if way < 0:
            number = self.system.elements[leader].mirrored_guard(self.keys[image][leader], number)
        return self.guards_of(image, leader)[number]

    def _order(self) -> tuple[int, ...]:
        order = self.system.mirror_order
        if order is None:
            raise ValueError(f"{self.system!r} is not symmetric")
        return order

    # numbers

    @property
    def closed_form(self) -> bool:
        """No law in any mode built so far."""
        return not self.laws

    def same_structure(self, other: "Scene | System") -> bool:
        """Return whether another system differs in numbers only, and the same contacts rest together."""
        system = other.system if isinstance(other, Scene) else other
        return self.system.structure == system.structure and self.together == other.together and self.joints == other.joints

    def flat_of(self, system: System) -> np.ndarray:
        """Return the numbers of another system of the same structure, laid out as ``tables.flat``.

        Raises
        ------
        ValueError
            When the structure differs, or contacts that rest together here do not there.
        """
        if system.structure != self.system.structure:
            raise ValueError(f"{system!r} has another structure than {self.system!r}")
        if self.joints and system.joints != self.joints:
            one = sorted({self.system.labels[e] for e, _ in set(self.joints) ^ set(system.joints)})
            raise ValueError(f"{', '.join(one)}: rests jointly with other frictions, whose rows its own depends on, at some values "
                             "only; begin beside it, or beyond")
        if system.together != self.together and not includes(system.together, self.together):
            one = [self.system.labels[e] for e, (leader, _) in enumerate(self.together) if leader != e]
            raise ValueError(f"{', '.join(one)}: rests together with another friction on its row at this one value, where both "
                             "surfaces move alike, or up to a load_amplitude of 1; begin beside it, or beyond")
        own = self._flat  # made first: it tells what reads the frequency
        if not self._packer.reads_omega and self.system.differs_in_omega_only(system):
            flat = own.copy()
            flat[0] = system.omega or 0.0
            return flat
        return self._filled(Packer(system, self.frame.at(system.omega), self.slices, self.together, self.joints))

    def refill(self, system: System) -> Tables:
        """Return new tables, rebuilt, with the numbers of another system of the same structure; its own: a copy."""
        return copy.deepcopy(self.tables) if system is self.system else self._rebuilt(self.flat_of(system))

    @functools.cached_property
    def _flat(self) -> np.ndarray:
        """The numbers of the scene's own system, of all modes there are."""
        return self._filled(self._packer)

    def _filled(self, packer: Packer) -> np.ndarray:
        flat = np.zeros(self.tables.flat.size)
        packer.fill(flat, views(flat, self._layout), self.keys, self.laws, self._blocks)
        return flat

    def _rebuilt(self, flat: np.ndarray) -> Tables:
        tables = copy.deepcopy(self.tables)
        tables.flat[:] = flat
        rebuild(tables)
        return tables

    def _pack(self) -> None:
        """Make the tables of all modes there are; what is known of modes that had been there before is kept."""
        met = [(e, key) for keys in self.keys for e, key in enumerate(keys)]
        laws = self._packer.laws(met)
        if laws:  # of all modes that an element can reach: what is compiled for them lasts
            if self._reach is None:
                self._reach = [(e, key) for e in range(len(self.system.elements)) for key in self._own_closure(e)]
            laws = self._packer.laws([*self._reach, *met])
        kept = self.tables if self._packed and laws == self.laws else None
        if laws != self.laws:
            known, self.laws, self.bound = self.bound.any(), laws, np.zeros(2, np.int64)
            if known:  # whoever integrates with kernels in hand goes on with the new tables
                bind(self)
        self._blocks, self.divisions = self._packer.blocks(self.keys, laws), {}
        tables = self._allocate()
        self._layout = layout(tables)
        self._packer.fill(tables.flat, views(tables.flat, self._layout), self.keys, self.laws, self._blocks,
                          0 if kept is None else self._packed)
        if kept is not None:
            keep(kept, tables, NUMBERS)
        self.__dict__.pop("_flat", None)
        if kept is None:
            self._flat = tables.flat.copy()
        rebuild(tables)
        if kept is not None:
            keep(kept, tables, MODAL)
        self.tables, self._packed = tables, len(self.keys)

    def _allocate(self) -> Tables:
        """Return tables with the integers of all modes there are, and no numbers yet."""
        for keys in self.keys[len(self._leads):]:
            self._leads.append(self._leads_to(keys))
        guards = max(len(found) for found in self._guards)
        candidates = max((len(then) + 1 for leads in self._leads for then in leads.then if then is not None), default=1)
        holds = max(len(found) for found in self._holds)
        T = allocate(len(self.keys), guards, candidates, holds, self.n, self.ns, self.harmonics, len(self.laws),
                     self._blocks[-1].end if self._blocks else 0, law_rows(self.laws), self.bound)
        first = {(block.law, block.key, block.beside): block.first for block in self._blocks}
        for m, (keys, found, leads) in enumerate(zip(self.keys, self._guards, self._leads, strict=True)):
            T.acts[m] = self._packer.acts(keys, self.laws, first)
            T.n_guards[m] = len(found)
            T.n_holds[m] = len(self._holds[m])
            T.still[m, :len(found)] = leads.still
            for g, (element, number, guard) in enumerate(found):
                T.kick[m, g] = guard.kick is not None
                T.silent[m, g] = guard.silent
                T.element[m, g] = element if number < FIRST else -1 - element
                T.kind[m, g] = guard.kind.code
                then, end = leads.then[g], leads.ends_in[g]
                if then is not None:  # the mode itself is last: a touch
                    T.then[m, g, :len(then) + 1] = [*(self._index.get(other, -2) for other in then), m]
                if end is not None:
                    T.ends_in[m, g] = self._index.get(end, -2)
        return T

    # structure

    def _leads_to(self, keys: tuple) -> "Leads":
        """Return what the guards of a mode lead to."""
        then: list[tuple | None] = []
        ends_in: list[tuple | None] = []
        guards, still = self._guards[self._index[keys]], self._packer.still(keys)
        waiting = tuple((element, guard.then[0]) for (element, _, guard), order in zip(guards, still, strict=True)
                        if order == 1 and not callable(guard.then) and self._grips(element, guard.then[0]))
        for element, _, guard in guards:
            tried = None if callable(guard.then) else [other for key in guard.then
                                                       for other in self._tried(keys, {element: key}, waiting)]
            if tried and self.joints and guard.kind is EventKind.STICK:  # all at rest, and beyond what they hold jointly
                tried += [self._with_key(tried[0], e, after) for e, number, facet in self._packer.guards(tried[0])
                          if number >= FIRST and not callable(facet.then) for after in facet.then]
            then.append(None if tried is None else tuple(other for other in dict.fromkeys(tried) if other != keys))
            end = None if guard.accumulates is None else self._with_key(keys, element, guard.accumulates[1])
            ends_in.append(end if end is not None and self._possible(end) else None)
        return Leads(tuple(then), tuple(ends_in), still, waiting)

    def _tried(self, keys: tuple, changes: dict[int, Hashable], waiting) -> list[tuple]:
        """Return the modes tried, in this order, where the keys of some elements change together in a mode.

        One row is held once: friction under a mass that rests on a stop is in a mode of slip, without a speed, and ``waiting``.
        Where the stop lets go friction takes hold first; it slips where the load is beyond its static limit, too.  Friction whose
        surface comes to move as the stop does takes hold as well, and the stop lets go.
        """
        new = self._with_keys(keys, changes)
        possible = self._possible(new)
        if possible and not waiting:
            return [new]
        grips = [[(e, key), (e, new[e])] for e, key in waiting if new[e] == keys[e]]
        found = [self._with_keys(new, dict(choice)) for choice in itertools.product(*grips)]
        if not possible and len(changes) == 1 and all(self._grips(e, key) for e, key in changes.items()):
            found += [self._with_key(new, e, released) for e, key in enumerate(keys) if e not in changes
                      and any(hold.surface is not None for hold in self._packer.mode(e, key).hold)
                      for guard in self._packer.mode(e, key).guards if not callable(guard.then) for released in guard.then]
        return [other for other in found if self._possible(other)]

    def _grips(self, element: int, key: Hashable) -> bool:
        """Return whether an element holds straight rows in a mode, wherever they are."""
        holds = () if isinstance(key, Joint) else self._packer.mode(element, key).hold
        return bool(holds) and not self.is_curved(element) and all(hold.surface is None for hold in holds)

    def _with_keys(self, keys: tuple, changes: dict[int, Hashable]) -> tuple:
        """Return the keys of a mode with those of some elements changed together, and with them those of others that rest together
        with these, or jointly where some of these come to rest."""
        changed: dict[int, Hashable] = {}
        for element, key in changes.items():
            changed |= key_of(self.system.elements, self.together, element, key)
        keys = tuple(changed.get(e, own) for e, own in enumerate(keys))
        if self.joints and any(not isinstance(key, Joint) and self._packer.mode(e, key).hold for e, key in changes.items()):
            if others := carried(self._packer, keys):
                return self._with_key(keys, others[0][0], Joint(others))
        return keys

    def _with_key(self, keys: tuple, element: int, key: Hashable) -> tuple:
        """Return the keys of a mode with that of one element changed, see `_with_keys`."""
        return self._with_keys(keys, {element: key})

    def _possible(self, keys: tuple) -> bool:
        """Return whether the rows held together are independent, and contacts that rest together do."""
        found = self._buildable.get(keys)
        if found is None:
            for e, key in enumerate(keys):
                self._packer.check(e, key)
            found = self._buildable[keys] = self._packer.independent(keys) and all(
                keys == self._with_key(keys, leader, keys[leader]) for leader, _ in self.together)
        return found

    def _add(self, keys: tuple) -> int:
        """List a mode, without numbers; return its index."""
        self._index[keys] = len(self.keys)
        self._guards.append(self._guards_of(keys))
        self.keys.append(keys)
        # reactions on curves are laws
        self._holds.append(tuple(e for e, _ in self._packer.held(enumerate(keys))[2]))
        return self._index[keys]

    def _guards_of(self, keys: tuple) -> tuple[GuardOf, ...]:
        """Return the guards of a mode."""
        return tuple([GuardOf(*guard) for guard in self._packer.guards(keys)])

    def _own_closure(self, element: int) -> list[Hashable]:
        """Return the keys of an element that it can reach from its starts, at most about CLOSURE of them."""
        found = list(self.system.elements[element].start)
        for key in found:  # grows while it is walked
            if len(found) > CLOSURE:
                break
            for guard in self._packer.mode(element, key).guards:
                ends = () if guard.accumulates is None else (guard.accumulates[1],)
                found += [other for other in (*(() if callable(guard.then) else guard.then), *ends) if other not in found]
        return found

    def _closure(self) -> list[tuple] | None:
        """Return all modes that can be reached from starts, or None when there are more than CLOSURE."""
        starts = [element.start for element in self.system.elements]
        if np.prod([float(len(keys)) for keys in starts]) > 4 * CLOSURE:
            return None
        waiting = sorted(itertools.product(*(range(len(keys)) for keys in starts)), key=sum)
        found = [keys for choice in waiting
                 if self._possible(keys := tuple(start[i] for start, i in zip(starts, choice, strict=True)))]
        known = set(found)
        for keys in found:  # grows while it is walked
            if len(found) > CLOSURE:
                return None
            for e, _, guard in self._packer.guards(keys):
                if callable(guard.then):
                    return None
                ends = () if guard.accumulates is None else (guard.accumulates[1],)
                for other in (*guard.then, *ends):
                    reached = self._with_key(keys, e, other)
                    if reached not in known and self._possible(reached):
                        known.add(reached)
                        found.append(reached)
        return found if len(found) <= CLOSURE else None
