"""What sets of elastic sliders on one row share: lists with one number a slider, which are parameters one by one."""
import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from ...checks import floats, many, number, of, refused, vector
from ..atrow import AtRow
from ..local import u


@dataclass(frozen=True, kw_only=True)
class Sliders(AtRow):
    """Elastic sliders that one row drives; the memory holds the position of each, where its spring would carry no force."""

    tuples: ClassVar[dict[str, dict[str, float]]] = {"limits": {"least": 0.0}}  # fields with one number a slider, what is allowed
    each: ClassVar[str] = "slider"  # what there is a number for
    if TYPE_CHECKING:  # a field of every set, in its own place
        limits: tuple[float, ...] = ()

    def __post_init__(self):
        super().__post_init__()
        for field, allowed in self.tuples.items():
            value = tuple(many(type(self).__name__, field, getattr(self, field), of=of(number, **allowed)))
            if not value:
                raise self.no_list(field)
            object.__setattr__(self, field, value)

    def no_list(self, field: str) -> ValueError:
        """Return the error of a field that is not one number a slider."""
        others = [f"{name} has {len(vector('', name, getattr(self, name)))}" for name in self.tuples
                  if name != field and floats(getattr(self, name)) is not None]
        return refused(type(self).__name__, field, getattr(self, field), f"a list of numbers, one a {self.each}, at least one"
                       f"{'; ' * bool(others)}{', '.join(others)}")

    @property
    def count(self) -> int:
        """Number of sliders."""
        return len(self.limits)

    @property
    def memory(self):
        """Positions of the sliders."""
        return tuple(f"slider[{i}]" for i in range(self.count))

    @property
    def virgin(self):
        """Without load every slider has followed its spring."""
        return (u(0),) * self.count

    @property
    def parameters(self):
        """Fields that are floats, and every number of the sliders as ``field[i]``."""
        values = super().parameters
        for field in self.tuples:
            values |= {f"{field}[{i}]": value for i, value in enumerate(getattr(self, field))}
        return values

    def with_parameters(self, **changes):
        """Return a copy with some fields, or single numbers ``limits[i]``, changed."""
        return dataclasses.replace(self, **gathered(self, changes))


def gathered(element, changes: dict) -> dict:
    """Return changes of whole fields from changes that may name single numbers ``field[i]``."""
    found: dict = {}
    for name, value in changes.items():
        field, bracket, rest = name.partition("[")
        if not bracket:
            found[name] = value
            continue
        numbers = list(found.get(field, getattr(element, field)))
        numbers[int(rest[:-1])] = value
        found[field] = tuple(numbers)
    return found
