"""Certificates: what was proved, in words and numbers that enclose the truth, and how they are stored."""
import math
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from .. import io
from ..checks import checked, number
from ..content import Content


class Verdict(StrEnum):
    """What became of a claim.  Only ``proved`` counts as true."""

    PROVED = "proved"
    DISPROVED = "disproved"
    UNDECIDED = "undecided"

    def __bool__(self) -> bool:
        return self is Verdict.PROVED

    @classmethod
    def of(cls, value: bool | None) -> "Verdict":
        """Return the verdict of True, False, or None."""
        return cls.UNDECIDED if value is None else cls.PROVED if value else cls.DISPROVED


@dataclass(frozen=True, eq=False)
class EventEnclosure(Content):
    """An event of a proved orbit.

    Attributes
    ----------
    time : tuple of float
        Enclosure, time from phase 0.
    element, kind : str
    speed : tuple of float
        Enclosure of the rate with which the guard arrives, unit of the guard over time.
    state : ndarray (ns, 2)
        Enclosure of the state just before.
    """

    time: tuple[float, float]
    element: str
    kind: str
    speed: tuple[float, float]
    state: np.ndarray = field(repr=False)


@dataclass(frozen=True, eq=False)
class Certificate(Content):
    """What was proved of a periodic orbit.

    Attributes
    ----------
    exists : Verdict
        Proved: the event-sequence equations have a solution in the box of `radius` around the orbit.  Disproved: they have none
        so near (see `message`).
    radius : float
        Largest distance of the true solution from the orbit as stored, scaled (states by their natural sizes, phases in radians).
    unique_in : float
        Half width of the box, scaled, in which it is the only solution; 0 where nothing was proved.
    admissible : Verdict
        Proved: every guard is strictly inside between the events of the sequence, every listed event arrives with a
        positive rate, and what follows it is what the rule of the package takes.
    multipliers : ndarray (k, 2, 2)
        Enclosures of the Floquet multipliers: real and imaginary part, lower and upper.
    stable : Verdict
        Proved: all multipliers are inside the unit circle.  Disproved: one at least is outside.
    events : tuple of EventEnclosure
    grazing_distance : float
        Lower bound of the distance of unlisted guards from zero, own unit of the guard; infinite without any.
    least_speed : float
        Lower bound of the rate with which listed events arrive, unit of the guard over radian; infinite without events.
    method : str
    precision : int
        Bits.
    seconds : float
        Processor time.
    message : str
        What was proved, or what was not and why.

    Examples
    --------
    >>> import bifurc as bf
    >>> orbit = bf.find_orbit(bf.systems.impact_oscillator(omega=1.5, amplitude=0.9), guess=(1.0, 0.2))
    >>> orbit.certify().exists             # doctest: +SKIP
    True
    """

    exists: Verdict
    radius: float
    unique_in: float
    admissible: Verdict
    multipliers: np.ndarray = field(repr=False)
    stable: Verdict = Verdict.UNDECIDED
    events: tuple[EventEnclosure, ...] = field(default=(), repr=False)
    grazing_distance: float = math.inf
    least_speed: float = math.inf
    method: str = ""
    precision: int = 0
    seconds: float = 0.0
    message: str = ""

    @property
    def proved(self) -> bool:
        """Whether the orbit was proved to be a motion of the system."""
        return bool(self.exists) and bool(self.admissible)

    def contains(self, multiplier: complex) -> bool:
        """Return whether a number lies in the enclosure of one of the multipliers."""
        z = multiplier if isinstance(multiplier, complex) else complex(number("Certificate.contains", "multiplier", multiplier))
        return any(re[0] <= z.real <= re[1] and im[0] <= z.imag <= im[1] for re, im in self.multipliers)

    def __repr__(self):
        what = "proved" if self.proved else f"exists {self.exists}, admissible {self.admissible}"
        stable = {"proved": "stable", "disproved": "unstable", "undecided": "stability undecided"}[self.stable]
        return (f"Certificate({what}, {stable}, radius {self.radius:.1e}, unique in {self.unique_in:.0e}, "
                f"{1e3 * self.seconds:.1f} ms)")

    # files

    def to_record(self) -> tuple[dict, dict]:
        """Return header and arrays for `bifurc.io`."""
        header = {"kind": "certificate", "exists": str(self.exists), "admissible": str(self.admissible), "stable": str(self.stable),
                  "method": self.method, "precision": self.precision, "message": self.message,
                  "elements": [event.element for event in self.events], "kinds": [event.kind for event in self.events]}
        count = len(self.events)
        ns = len(self.events[0].state) if count else 0
        arrays = {"numbers": np.array([self.radius, self.unique_in, self.grazing_distance, self.least_speed, self.seconds]),
                  "multipliers": self.multipliers,
                  "times": np.array([event.time for event in self.events]).reshape(count, 2),
                  "speeds": np.array([event.speed for event in self.events]).reshape(count, 2),
                  "states": np.array([event.state for event in self.events]).reshape(count, ns, 2)}
        return header, arrays

    @classmethod
    def from_record(cls, header: dict, arrays: dict, elements=()) -> "Certificate":
        """Make the certificate that `to_record` described."""
        io.fitted(arrays, {"numbers": "real 5", "multipliers": "real k 2 2", "times": "real m 2", "speeds": "real m 2",
                           "states": "real m ns 2"}, m=len(header["elements"]))
        numbers = [float(v) for v in arrays["numbers"]]
        events = tuple(EventEnclosure((float(t[0]), float(t[1])), element, kind, (float(v[0]), float(v[1])), state)
                       for t, element, kind, v, state in zip(arrays["times"], header["elements"], header["kinds"],
                                                             arrays["speeds"], arrays["states"], strict=True))
        return cls(Verdict(header["exists"]), numbers[0], numbers[1], Verdict(header["admissible"]), arrays["multipliers"],
                   Verdict(header["stable"]), events, numbers[2], numbers[3], header["method"], int(header["precision"]),
                   numbers[4], header["message"])

    @checked()
    def save(self, path) -> None:
        """Write the certificate to an npz file, which `bifurc.load` reads."""
        io.write(path, *self.to_record())


@dataclass(frozen=True, eq=False)
class PointCertificate(Content):
    """What was proved of a special point of a branch.

    Attributes
    ----------
    kind : str
    exists : Verdict
        Proved: the extended system of the point has a solution at the stored one.
    parameter : tuple of float
        Enclosure of the parameter; NaN where nothing was proved.
    unique_in : float
        Half width of the box, scaled, in which the point is the only one of its kind; 0 where nothing was proved.
    transversal : Verdict
        Proved: the extended system is regular on the box.
    precision : int
        Bits.
    seconds : float
        Processor time.
    message : str
    """

    kind: str
    exists: Verdict
    parameter: tuple[float, float] = (math.nan, math.nan)
    unique_in: float = 0.0
    transversal: Verdict = Verdict.UNDECIDED
    precision: int = 0
    seconds: float = 0.0
    message: str = ""

    @property
    def proved(self) -> bool:
        """Whether the point was proved, transversality included."""
        return bool(self.exists) and bool(self.transversal)

    def __repr__(self):
        where = f" in [{self.parameter[0]:.16g}, {self.parameter[1]:.16g}]" if self.exists else ""
        return f"PointCertificate({self.kind} {self.exists}{where}, {1e3 * self.seconds:.1f} ms)"

    def to_record(self) -> tuple[dict, dict]:
        """Return header and arrays for `bifurc.io`."""
        header = {"kind": "point_certificate", "point": self.kind, "exists": str(self.exists), "transversal": str(self.transversal),
                  "precision": self.precision, "message": self.message}
        return header, {"numbers": np.array([*self.parameter, self.unique_in, self.seconds])}

    @classmethod
    def from_record(cls, header: dict, arrays: dict, elements=()) -> "PointCertificate":
        """Make the certificate that `to_record` described."""
        io.fitted(arrays, {"numbers": "real 4"})
        low, high, unique, seconds = (float(v) for v in arrays["numbers"])
        return cls(header["point"], Verdict(header["exists"]), (low, high), unique, Verdict(header["transversal"]),
                   int(header["precision"]), seconds, header["message"])

    @checked()
    def save(self, path) -> None:
        """Write the certificate to an npz file, which `bifurc.load` reads."""
        io.write(path, *self.to_record())


@dataclass(frozen=True, eq=False)
class StretchCertificate(Content):
    """What was proved of a branch between two of its rows.

    Attributes
    ----------
    rows : tuple of int
    parameter : tuple of float
        Smallest and largest value at the two rows.
    verdict : Verdict
        Proved: one smooth curve of admissible orbits leads from row to row, and farther than 1e-6 (of the parameter) from the
        special points in `near`, which are proved on their own, there is no special point on it.
    pieces : int
        Tubes of the proof.
    near : tuple of int
        Special points on the stretch, by their place among those of the branch.
    undecided : ndarray (k, 2)
        Ranges of the parameter where something is missing.
    message : str
        What was proved, or what is missing and where.
    """

    rows: tuple[int, int]
    parameter: tuple[float, float]
    verdict: Verdict
    pieces: int = 0
    near: tuple[int, ...] = ()
    undecided: np.ndarray = field(default_factory=lambda: np.empty((0, 2)), repr=False)
    message: str = ""

    @property
    def proved(self) -> bool:
        """Whether the stretch is proved."""
        return bool(self.verdict)

    def __repr__(self):
        return f"StretchCertificate(rows {self.rows[0]} to {self.rows[1]}: {self.verdict}, {self.pieces} pieces)"

    def to_record(self) -> tuple[dict, dict]:
        """Return header and arrays for `bifurc.io`."""
        header = {"kind": "stretch_certificate", "rows": list(self.rows), "verdict": str(self.verdict), "pieces": self.pieces,
                  "near": list(self.near), "message": self.message}
        return header, {"parameter": np.array(self.parameter), "undecided": self.undecided}

    @classmethod
    def from_record(cls, header: dict, arrays: dict, elements=()) -> "StretchCertificate":
        """Make the certificate that `to_record` described."""
        io.fitted(arrays, {"parameter": "real 2", "undecided": "real k 2"})
        low, high = (float(v) for v in arrays["parameter"])
        first, last = (int(v) for v in header["rows"])
        return cls((first, last), (low, high), Verdict(header["verdict"]), int(header["pieces"]),
                   tuple(int(k) for k in header["near"]), arrays["undecided"], header["message"])


def refusal(message: str, precision: int, seconds: float = 0.0) -> Certificate:
    """Return the certificate of something that was not decided."""
    return Certificate(Verdict.UNDECIDED, math.inf, 0.0, Verdict.UNDECIDED, np.empty((0, 2, 2)), method="none",
                       precision=precision, seconds=seconds, message=message)
