"""An element whose coordinate is prescribed: contacts on a test bench, hysteresis loops."""
import dataclasses
from dataclasses import dataclass

import numpy as np

from ..checks import refused, whole
from .element import Element, element_from
from .local import wave
from .site import Rows


@dataclass(frozen=True)
class Driven(Element):
    """An element of one row whose coordinate is u = amplitude cos(harmonic omega t + phase), whatever the system does.

    The system does not feel its force.

    Parameters
    ----------
    element : Element
        With one row that it does not hold: `Jenkins`, `Iwan`, `MicroSlip`, springs, elastic stops.  Where it sits does not
        matter.
    amplitude : float
        Of the motion, length.
    harmonic : int
        Multiple of the excitation frequency, at least 1.
    phase : float
        Radians.

    Examples
    --------
    >>> from bifurc.elements import Driven, Jenkins
    >>> Driven(Jenkins(5.0, 10.0), amplitude=3.0).parameters
    {'amplitude': 3.0, 'phase': 0.0, 'stiffness': 5.0, 'limit': 10.0}
    """

    element: Element
    amplitude: float = 1.0
    harmonic: int = 1
    phase: float = 0.0

    def __post_init__(self):
        if not isinstance(self.element, Element):
            raise refused("Driven", "element", self.element, "an element, such as Jenkins(...)")
        if isinstance(self.element, Driven):
            raise refused("Driven", "element", self.element, "an element that is not driven already: one motion can be prescribed")
        if self.label is None:
            object.__setattr__(self, "label", self.element.label or self.element.default_label())
        super().__post_init__()
        object.__setattr__(self, "harmonic", whole("Driven", "harmonic", self.harmonic, least=1))

    start = property(lambda self: self.element.start)
    memory = property(lambda self: self.element.memory)
    virgin = property(lambda self: self.element.virgin)
    harmonics = property(lambda self: self.element.harmonics)
    unordered = property(lambda self: self.element.unordered)

    @property
    def parameters(self):
        """Those of the motion and of the element."""
        return {"amplitude": self.amplitude, "phase": self.phase, **self.element.parameters}

    @property
    def structure(self):
        """The harmonic and the structure of the element."""
        return (type(self), self.harmonic, self.element.structure)

    def with_parameters(self, **changes):
        """Return a copy with parameters of the motion or of the element changed."""
        own = {name: changes.pop(name) for name in ("amplitude", "phase", "harmonic", "label", "element") if name in changes}
        element = own.pop("element", self.element)
        return dataclasses.replace(self, element=element.with_parameters(**changes) if changes else element, **own)

    def site(self, n):
        """Return a row that no coordinate moves and that moves none."""
        given = self.element.site(n)
        if given.count != 1:
            raise ValueError(f"Driven: {self.element!r} has {given.count} rows; only elements with one row can be driven")
        motion = wave(self.amplitude, self.harmonic, self.phase)
        return Rows(np.zeros((1, n)), (motion + given.base[0] if given.base else motion,), given.drift)

    def mode(self, key, core):
        """Return the mode of the element."""
        mode = self.element.mode(key, core)
        if mode.hold or any(guard.kick is not None for guard in mode.guards):
            raise ValueError(f"Driven: {self.element!r} stops or holds its coordinate, which is prescribed; "
                             "use an elastic contact, such as Jenkins for Coulomb or ElasticStop for RigidStop")
        return mode

    def ordered(self, z):
        """As the element."""
        return self.element.ordered(z)

    def loaded(self, key, slider: int) -> bool:
        """Return whether a slider carries a normal load in a mode."""
        return self.element.loaded(key, slider)

    def mirrored(self):
        """Image of element and motion."""
        image = self.element.mirrored()
        amplitude = self.amplitude if self.harmonic % 2 else 0.0 - self.amplitude
        return None if image is None else dataclasses.replace(self, element=image, amplitude=amplitude)

    def mirrored_key(self, key):
        """As the element."""
        return self.element.mirrored_key(key)

    def mirrored_guard(self, key, guard):
        """As the element."""
        return self.element.mirrored_guard(key, guard)

    def to_record(self):
        """Return the motion and the record of the element, ready for JSON."""
        return {"class": "Driven", "label": self.label, "amplitude": self.amplitude, "harmonic": self.harmonic,
                "phase": self.phase, "element": self.element.to_record()}

    @classmethod
    def from_record(cls, record, functions=None):
        """Make the element that gave ``record``; classes of users are looked up by name in ``functions``."""
        rest = {name: value for name, value in record.items() if name not in ("class", "element")}
        return cls(element_from(record["element"], functions), **rest)
