"""Elements that act along one row: a degree of freedom, or a combination of several."""
import dataclasses
from dataclasses import dataclass

from ..checks import vector, whole
from ..structure.names import named
from .element import Element
from .site import Rows


@dataclass(frozen=True, kw_only=True)
class AtRow(Element):
    """An element on one row of the system.

    Parameters
    ----------
    dof : int, str or (node, direction)
        Degree of freedom it acts on, from 0, or its name in a system that has names.
    row : sequence of float, optional
        Instead of `dof`: u = row . q, n factors; (1, -1) is the distance of two coordinates.  Forces act along it.
    """

    dof: int | str | tuple = 0
    row: tuple[float, ...] | None = None

    def __post_init__(self):
        super().__post_init__()
        name = named(self.dof)
        object.__setattr__(self, "dof", whole(type(self).__name__, "dof", self.dof, least=0) if name is None else name)
        if self.row is not None:
            object.__setattr__(self, "row", vector(type(self).__name__, "row", self.row))

    def placed(self, place):
        """Return the element at a number instead of a name."""
        return dataclasses.replace(self, dof=place(self.dof)) if isinstance(self.dof, str) else self

    def site(self, n):
        """Return the row it acts on."""
        return Rows.of(self.dof if self.row is None else self.row, n)


class Waving(AtRow):
    """An element on one row that follows one ``harmonic`` of the excitation, which its class declares."""

    harmonic: int

    def __post_init__(self):
        super().__post_init__()
        object.__setattr__(self, "harmonic", whole(type(self).__name__, "harmonic", self.harmonic, least=1))

    @property
    def harmonics(self):
        """The one harmonic."""
        return (self.harmonic,)
