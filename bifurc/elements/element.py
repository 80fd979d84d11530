"""The protocol of an element.  Built-in elements and those of users are the same to the rest of the package."""
import dataclasses
import functools
import re
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..checks import DECLARED, Kind
from ..lazy import deprecated
from .local import Affine, Core
from .mode import Mode
from .site import Ring, Rows, Surface

ALWAYS = "always"  # key of the only mode of an element that has one
BUILT_IN: dict[str, type["Element"]] = {}  # the elements of the package by their names, as records name them


@dataclass(frozen=True, kw_only=True)
class Element:
    """An effect that acts on a system through a site, in one of several modes.  Frozen.

    To write one, derive a frozen dataclass with the parameters as fields (those declared ``float`` are parameters of
    the system, and ``float | None`` where they are given; anything else is structure and must be hashable) and give it

    * ``site(n)`` -> `Rows`: where it sits in a system of n degrees of freedom,
    * ``mode(key, core)`` -> `Mode`: how it acts; called for the keys that are reached, never for all,

    and where they differ from the defaults

    * ``start``: keys that may hold at a start, tried in this order (default: one mode, `ALWAYS`),
    * ``harmonics``: harmonics of the excitation that occur in its expressions (those of the site are found),
    * ``memory``: names of its memory states; ``virgin``: their values, affine in u and s, where a start gives none
      (default: zeros),
    * ``unordered``: key of a start with memory for which ``ordered(z)`` is not (default: all memory is),
    * ``stored_energy(u)``: its energy at given coordinates, if it keeps energy (default: not known),
    * ``surface`` or ``ring``: the `Surface` or `Ring` that pictures show (default: none),
    * ``mirrored()``: the element seen after u -> -u and half a period, or None when that is not known;
      ``mirrored_key(key)`` and ``mirrored_guard(key, guard)``: its mode and guard in that image (default: the same).

    Parameters
    ----------
    label : str, optional
        Name in a system; parameters of hand-made systems are called ``label.field``.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> from bifurc.elements import Element, Mode, Rows, local
    >>> @dataclass(frozen=True)
    ... class Magnet(Element):
    ...     pull: float = 0.1
    ...     def site(self, n):
    ...         return Rows.of(0, n)
    ...     def mode(self, key, core):
    ...         return Mode(force=(local.affine(-self.pull),))
    """

    label: str | None = None

    start: ClassVar[tuple[Hashable, ...]] = (ALWAYS,)
    harmonics: ClassVar[tuple[int, ...]] = ()
    memory: ClassVar[tuple[str, ...]] = ()
    virgin: ClassVar[tuple[Affine, ...]] = ()
    unordered: ClassVar[Hashable | None] = None  # key of a start with memory that is not `ordered`; None: all memory is
    final: ClassVar[tuple[tuple[Hashable, str], ...]] = ()  # keys in which a motion ends, and its status
    regions: ClassVar[tuple[tuple[Hashable, str], ...]] = ()  # keys of which one holds, and on which sides of surfaces
    slides: ClassVar[tuple[tuple[Hashable, tuple[tuple[Hashable, int], ...]], ...]] = ()  # keys that stay on guards of other keys
    omitted: ClassVar[int] = 0  # last states of its memory that a start may leave out
    isotropic: ClassVar[bool] = False  # acts in a plane, the same in every direction around its centre
    delayed: ClassVar[bool] = False  # acts on what the motion was one delay ago

    def __init_subclass__(cls, **keywords):
        """Take the values of undeformed memory under their old name, too."""
        super().__init_subclass__(**keywords)
        if "relaxed" in vars(cls):
            deprecated(f"{cls.__name__}.relaxed", "virgin")
            cls.virgin = vars(cls)["relaxed"]

    def __post_init__(self):
        """Store fields as what they are declared: floats finite, whole numbers, flags, words; call it first when you check more."""
        owner = type(self).__name__
        for name, kind, optional in _named(type(self))[3]:
            value = getattr(self, name)
            if value is not None or not optional:
                object.__setattr__(self, name, kind(owner, name, value))

    def site(self, n: int) -> Rows:
        """Return the site in a system of ``n`` degrees of freedom."""
        raise NotImplementedError(f"{type(self).__name__} must define site(n)")

    def mode(self, key: Hashable, core: Core) -> Mode:
        """Return the mode of that key."""
        raise NotImplementedError(f"{type(self).__name__} must define mode(key, core)")

    @property
    def rests_together(self) -> bool:
        """Whether the element is dry friction that is one set-valued force with others on its row, see `friction.together`."""
        return False

    @property
    def drops(self) -> bool:
        """Whether the force of the element falls by a finite amount where it begins to slip."""
        return False

    @property
    def surface(self) -> Surface | None:
        """The plane surface that a picture shows of the element; None: it has none."""
        return None

    @property
    def ring(self) -> Ring | None:
        """The round surface that a picture shows of the element; None: it has none."""
        return None

    def ordered(self, z: np.ndarray) -> np.ndarray:
        """Return whether memory ``z`` (..., memory) is such as the keys of `start` rely on, shape (...)."""
        return np.ones(z.shape[:-1], bool)

    def loaded(self, key: Hashable, slider: int) -> bool:
        """Return whether a slider (an internal variable) carries a normal load in a mode."""
        return key != "apart"

    def stored_energy(self, u) -> float | None:
        """Return the energy that the element stores at the coordinates ``u`` (rows,) of its site, whichever mode it is in.

        None (the default): it is not known, or motions through the element do not keep their energy.
        """
        return None

    def placed(self, place: Callable[[str], int]) -> "Element":
        """Return the element with the name of a degree of freedom turned into its number by ``place``."""
        return self

    def mirrored(self) -> "Element | None":
        """Return the element seen after u -> -u and half a period; None: not known."""
        return None

    def mirrored_key(self, key: Hashable) -> Hashable:
        """Return the key of the mirrored element while this one has ``key``."""
        return key

    def mirrored_guard(self, key: Hashable, guard: int) -> int:
        """Return the guard of the mirrored element that answers guard number ``guard`` of mode ``key``."""
        return guard

    @classmethod
    @functools.cache  # one entry a class
    def default_label(cls) -> str:
        """Return the class name in lower case with underscores."""
        return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", cls.__name__).lower()

    @property
    def parameters(self) -> dict[str, float]:
        """Fields that are floats, by name."""
        return {name: value for name in _named(type(self))[1] if (value := getattr(self, name)) is not None}

    @property
    def structure(self) -> tuple:
        """What a change of parameters cannot change: the class and all fields that are not floats."""
        names, floats, optional, _ = _named(type(self))
        return (type(self), *(getattr(self, name) is None if name in optional else getattr(self, name)
                              for name in names if name not in floats or name in optional))

    def with_parameters(self, **changes) -> "Element":
        """Return a copy with some fields changed."""
        return dataclasses.replace(self, **changes)

    def to_record(self) -> dict:
        """Return class name and fields, ready for JSON."""
        values = {field: getattr(self, field) for field in ("label", *_named(type(self))[0])}
        return {"class": type(self).__name__, **values}

    @classmethod
    def from_record(cls, record: dict, functions: dict | None = None) -> "Element":
        """Make the element that gave ``record``."""
        return cls(**{name: tupled(value) for name, value in record.items() if name != "class"})


def element_from(record: dict, functions: dict | None = None) -> Element:
    """Make the element that gave ``record``; classes and functions of users are looked up by name in ``functions``."""
    found = (functions or {}).get(record["class"]) or BUILT_IN.get(record["class"])
    if found is None:
        raise ValueError(f"the record uses the element {record['class']!r}; hand its class over in elements=[...]. "
                         f"Known: {', '.join(sorted(BUILT_IN))}")
    return found.from_record(record, functions)


_FIELDS: dict[type, tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...], tuple[tuple[str, Kind, bool], ...]]] = {}


def _named(cls: type):
    """Names of the fields of a class but for the label, of those that are floats, of those floats that may be None; kinds."""
    if cls not in _FIELDS:
        fields = dataclasses.fields(cls)
        optional = tuple(field.name for field in fields if field.type in (float | None, "float | None"))
        _FIELDS[cls] = (tuple(field.name for field in fields if field.name != "label"),
                        tuple(field.name for field in fields if field.type in (float, "float") or field.name in optional),
                        optional, tuple((field.name, *DECLARED[field.type]) for field in fields if field.type in DECLARED))
    return _FIELDS[cls]


def tupled(value):
    """JSON knows no tuples; fields are hashable, so that every list was one."""
    return tuple(tupled(item) for item in value) if isinstance(value, list) else value
