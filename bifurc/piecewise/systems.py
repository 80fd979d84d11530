"""`PiecewiseSystem` and `HybridSystem`: systems of first order from fields, surfaces and resets."""
import itertools
import keyword
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..checks import flag, floats, listed, number, refused
from ..elements.automaton import Automaton
from ..elements.kinds import EventKind
from ..elements.mode import Guard
from ..system import System, of_states
from .fields import AffineField, AffineReset, AffineSurface, Columns, affine
from .regions import SIDES, Regions

TAKEN = ("t", "pi", "omega")


@dataclass(frozen=True)
class Switch:
    """A surface on whose sides fields differ.

    Parameters
    ----------
    surface : AffineSurface
        h = 0; h < 0 is below.
    below, above : str
        Names of the fields of the two sides; of several switches fields are named by sides, such as "-+", instead.
    sliding : bool
        Whether a motion may slide along the surface (Filippov); False: where both fields lead to it, a motion ends.
    hysteresis : (float, float), optional
        Values of h at which a motion that comes from above and from below changes the field, the first below the second.

    Examples
    --------
    >>> import bifurc as bf
    >>> switch = bf.Switch(bf.AffineSurface([1.0, 0.0]), below="left", above="right")
    """

    surface: AffineSurface
    below: str = "-"
    above: str = "+"
    sliding: bool = True
    hysteresis: tuple[float, float] | None = None

    def __post_init__(self):
        affine("Switch", "surface", self.surface, AffineSurface)
        for name in ("below", "above"):
            if not isinstance(getattr(self, name), str):
                raise refused("Switch", name, getattr(self, name), "the name of a field")
        object.__setattr__(self, "sliding", flag("Switch", "sliding", self.sliding))
        if self.hysteresis is not None:
            found = floats(self.hysteresis)
            if found is None or found.shape != (2,) or not np.isfinite(found).all() or not found[0] < found[1]:
                raise refused("Switch", "hysteresis", self.hysteresis, "None or two numbers, the first below the second: with "
                              "equal thresholds a motion would switch infinitely often in no time")
            object.__setattr__(self, "hysteresis", tuple(found.tolist()))

    @property
    def band(self) -> tuple[float, float]:
        """Values of h at which the field changes from above, and from below."""
        return self.hysteresis or (0.0, 0.0)

    @property
    def slides(self) -> bool:
        """Whether motions may slide on the surface."""
        return self.sliding and self.hysteresis is None


@dataclass(frozen=True)
class Jump:
    """What leads from one mode to another: where the surface is passed upwards, h from below zero to above.

    Parameters
    ----------
    mode : str
        The mode that ends.
    surface : AffineSurface
    to : str or sequence of str
        The mode that follows; of several the first that may begin there.
    reset : AffineReset, optional
        States after it; None: they stay.

    Examples
    --------
    >>> import bifurc as bf
    >>> impact = bf.Jump("free", bf.AffineSurface([1, 0], lambda gap: -gap), to="free",
    ...                  reset=bf.AffineReset(lambda restitution: [[1, 0], [0, -restitution]]))
    """

    mode: str
    surface: AffineSurface
    to: str | tuple[str, ...]
    reset: AffineReset | None = None

    def __post_init__(self):
        if not isinstance(self.mode, str):
            raise refused("Jump", "mode", self.mode, "the name of a mode")
        affine("Jump", "surface", self.surface, AffineSurface)
        to = names_in(self.to)
        if not to:
            raise refused("Jump", "to", self.to, "the name of a mode, or names of some")
        if self.reset is not None:
            affine("Jump", "reset", self.reset, AffineReset)
        object.__setattr__(self, "to", to)


@dataclass(frozen=True)
class Plan:
    """What a system is built from, but for its parameters: calling it with them builds it."""

    kind: str
    states: tuple[str, ...]
    fields: tuple[tuple[str, AffineField], ...]
    rules: tuple
    start: tuple[str, ...]
    forced: bool

    @property
    def __name__(self) -> str:
        return self.kind

    def __call__(self, **parameters) -> System:
        """Return the system with these parameters."""
        values = {name: number(self.kind, name, value) for name, value in parameters.items()}
        if self.forced and not values["omega"] > 0.0:
            raise refused(self.kind, "omega", values["omega"], "above 0")
        omega = values["omega"] if self.forced else None
        harmonics = sorted({k for _, field in self.fields for k in field.harmonics} | {
            k for rule in self.rules for part in (rule.surface, getattr(rule, "reset", None)) if part is not None
            for k in part.harmonics})
        if harmonics and not self.forced:
            raise ValueError(f"{self.kind}: omega = None is not allowed with harmonics of it in fields or surfaces")
        columns = Columns(len(self.states), tuple(harmonics), omega)
        build = self._regions if self.kind == "PiecewiseSystem" else self._jumps
        system = of_states([build(columns, values)], omega)
        system.__dict__["_origin"] = (self, values)
        return system

    def _numbers(self, columns, values):
        n = len(self.states)
        fields = {name: field.numbers(f"{self.kind}, field {name!r}", (n,), n, columns.harmonics, values)
                  for name, field in self.fields}
        surfaces = np.array([rule.surface.numbers(f"{self.kind}, surface {i}", (), n, columns.harmonics, values)
                             for i, rule in enumerate(self.rules)]).reshape(len(self.rules), len(columns.names))
        for i in (i for i, h in enumerate(surfaces) if not h[:n].any()):
            raise ValueError(f"{self.kind}: surface {i} has the normal {surfaces[i, :n].tolist()}; it must depend on a state")
        return fields, surfaces

    def _regions(self, columns, values) -> Automaton:
        fields, surfaces = self._numbers(columns, values)
        names = {}
        if len(self.rules) == 1:
            rule = self.rules[0]
            names = {"-": rule.below, "+": rule.above, "0": "slide"}
            fields = {"-": fields[rule.below], "+": fields[rule.above]}
        return Regions(self.kind, columns, fields, surfaces, self.rules, names).automaton(self.states)

    def _jumps(self, columns, values) -> Automaton:
        fields, surfaces = self._numbers(columns, values)
        n = len(self.states)
        exits: dict[str, list[Guard]] = {name: [] for name in fields}
        for i, (rule, h) in enumerate(zip(self.rules, surfaces, strict=True)):
            reset = () if rule.reset is None else columns.expressions(
                rule.reset.numbers(f"{self.kind}, reset {i}", (n,), n, columns.harmonics, values))
            kind = EventKind.CROSS if rule.reset is None else EventKind.RESET
            exits[rule.mode].append(Guard(columns.expression(h), kind, rule.to, reset=reset))
        return Automaton(states=self.states, rates=tuple((name, columns.expressions(field)) for name, field in fields.items()),
                         exits=tuple((name, tuple(ends)) for name, ends in exits.items()), begins=self.start)


def names_in(value) -> tuple[str, ...]:
    """Return names that are given as one, or as a list of some; none where anything else is among them."""
    found = (value,) if isinstance(value, str) else tuple(listed(value) or ())
    return found if all(isinstance(name, str) for name in found) else ()


def named_states(kind: str, states, parameters) -> tuple[str, ...]:
    """Return the names of the states, or raise ValueError."""
    names = names_in(states.split() if isinstance(states, str) else states)
    if not names or not all(name.isidentifier() and not keyword.iskeyword(name) for name in names) or len(set(names)) < len(names):
        raise refused(kind, "states", states, "different names, such as 'v i'")
    for name in names:
        if name in TAKEN or name in parameters:
            raise ValueError(f"{kind}: the state {name!r} has the name of "
                             + ("a parameter" if name in parameters else "something else: " + ", ".join(TAKEN) + " are taken"))
    return names


def named_fields(kind: str, argument: str, fields) -> dict[str, AffineField]:
    """Return fields by name, or raise ValueError."""
    if not isinstance(fields, dict) or not fields or not all(isinstance(name, str) for name in fields):
        raise refused(kind, argument, fields, "a dict of names to AffineField")
    for name, field in fields.items():
        affine(kind, f"{argument}[{name!r}]", field, AffineField)
    return fields


def rules_of(kind: str, argument: str, rules, cls) -> tuple:
    """Return switches or jumps as a tuple, or raise ValueError."""
    found = listed(rules)
    if found is None or not all(isinstance(rule, cls) for rule in found):
        raise refused(kind, argument, rules, f"a list of {cls.__name__}")
    return tuple(found)


def planned(plan: Plan, omega, parameters) -> System:
    """Return the system of a plan with its frequency, if it has one, among the parameters."""
    return plan(**({} if omega is None else {"omega": omega}), **parameters)


def PiecewiseSystem(states: str | Iterable[str], fields: dict[str, AffineField], switches: Iterable[Switch], *,
                    omega: float | None = None, **parameters: float) -> System:
    """Return the system x' = F(x, t) of fields on the sides of surfaces, which slides along surfaces to which both sides lead.

    Parameters
    ----------
    states : str or sequence of str
        Their names: ``"v i"``.
    fields : dict of str to AffineField
        By the names that the switch gives to its sides; of several switches by their sides, such as "-+" (below the first, above
        the second).
    switches : sequence of Switch
    omega : float, optional
        Frequency of the excitation, above 0; None: there is none.
    **parameters : float
        What numbers of fields and surfaces are functions of; all may be varied, followed, and changed with `with_parameters`.

    Returns
    -------
    System
        Without degrees of freedom; its states are memory.

    Raises
    ------
    ValueError
        Naming what is missing or wrong: a side without a field, a sliding field that is not affine, a parameter nobody has.

    Notes
    -----
    Sliding is Filippov's, on several surfaces at once by the equivalent control. A motion that begins where both fields leave the
    surface may leave it at any time: it ends there with the status "escaping".

    Examples
    --------
    >>> import bifurc as bf
    >>> relay = bf.PiecewiseSystem("x y", {"left": bf.AffineField([[0, 1], [-1, 0]], lambda k: [0, k]),
    ...                                    "right": bf.AffineField([[0, 1], [-1, 0]], lambda k: [0, -k])},
    ...                            [bf.Switch(bf.AffineSurface([0.5, 1.0]), below="left", above="right")], k=1.0)
    >>> bf.simulate(relay, (3.0, 0.0), duration=20.0).events[-1].mode_after
    ('slide',)
    """
    kind = "PiecewiseSystem"
    states = named_states(kind, states, parameters)
    fields = named_fields(kind, "fields", fields)
    rules = rules_of(kind, "switches", switches, Switch)
    if not rules:
        raise refused(kind, "switches", switches, "a list of at least one Switch; a HybridSystem may have no jumps")
    if len(rules) == 1:
        wanted = [rules[0].below, rules[0].above]
    else:
        wanted = ["".join(sides) for sides in itertools.product(SIDES, repeat=len(rules))]
    missing = [name for name in wanted if name not in fields]
    if missing and len(rules) == 1 or len(missing) == len(wanted):
        raise ValueError(f"{kind}: fields of {', '.join(map(repr, missing))} are missing; there are {', '.join(map(repr, fields))}")
    for name in (name for name in fields if name not in wanted):
        raise ValueError(f"{kind}: the field {name!r} belongs to no side; there are {', '.join(map(repr, wanted))}")
    return planned(Plan(kind, states, tuple(fields.items()), rules, (), omega is not None), omega, parameters)


def HybridSystem(states: str | Iterable[str], modes: dict[str, AffineField], jumps: Iterable[Jump], *,
                 start: str | Iterable[str] | None = None, omega: float | None = None, **parameters: float) -> System:
    """Return the system of modes with fields of their own and jumps between them, with resets of the states.

    Parameters
    ----------
    states : str or sequence of str
        Their names: ``"v i"``.
    modes : dict of str to AffineField
    jumps : sequence of Jump
    start : str or sequence of str, optional
        Modes that may hold at a start, in the order in which they are tried; None: all, as they are listed.
    omega : float, optional
        Frequency of the excitation, above 0; None: there is none.
    **parameters : float
        What numbers of fields, surfaces and resets are functions of.

    Returns
    -------
    System
        Without degrees of freedom; its states are memory.

    Raises
    ------
    ValueError
        Naming what is missing or wrong.

    Examples
    --------
    A voltage that is reset when it reaches 1, integrate and fire:

    >>> import bifurc as bf
    >>> neuron = bf.HybridSystem("v", {"rise": bf.AffineField([[-1.0]], lambda I: [I])}, [
    ...     bf.Jump("rise", bf.AffineSurface([1.0], -1.0), to="rise", reset=bf.AffineReset([[0.0]], [0.0]))], I=1.5)
    >>> round(bf.find_orbit(neuron, (0.5,)).period, 12)
    1.098612288668
    """
    kind = "HybridSystem"
    states = named_states(kind, states, parameters)
    modes = named_fields(kind, "modes", modes)
    rules = rules_of(kind, "jumps", jumps, Jump)
    begins = tuple(modes) if start is None else names_in(start)
    if not begins:
        raise refused(kind, "start", start, "None, the name of a mode, or names of some")
    for name in (*begins, *(name for rule in rules for name in (rule.mode, *rule.to))):
        if name not in modes:
            raise ValueError(f"{kind}: the mode {name!r} has no field; there are {', '.join(map(repr, modes))}")
    return planned(Plan(kind, states, tuple(modes.items()), rules, begins, omega is not None), omega, parameters)
