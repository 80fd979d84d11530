"""What leads from one field to another: surfaces on whose sides fields differ, and jumps between modes."""
from dataclasses import dataclass

import numpy as np

from ..checks import flag, floats, listed, refused
from .fields import AffineReset, AffineSurface, affine


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


def names_in(value) -> tuple[str, ...]:
    """Return names that are given as one, or as a list of some; none where anything else is among them."""
    found = (value,) if isinstance(value, str) else tuple(listed(value) or ())
    return found if all(isinstance(name, str) for name in found) else ()
