"""Elements as a user writes them: nothing is taken from the built-in ones."""
from dataclasses import dataclass

from bifurc import elements as el
from bifurc.elements.local import s, u


@dataclass(frozen=True)
class Slider(el.Element):
    """Spring and slider in series, with memory: the position of the slider."""

    kt: float = 2.0
    limit: float = 0.3
    start = ("stick", "up", "down")
    memory = ("slider",)

    def site(self, n):
        return el.Rows.of(0, n)

    def mode(self, key, core):
        if key == "stick":
            pull = self.kt * (u() - el.local.z())
            return el.Mode(force=(-pull,), guards=(el.Guard(pull - self.limit, el.EventKind.SLIP, ("up",)),
                                                   el.Guard(-pull - self.limit, el.EventKind.SLIP, ("down",))))
        way = 1.0 if key == "up" else -1.0
        slider = el.Algebraic(u() - way * self.limit / self.kt)
        return el.Mode(force=(el.local.affine(-way * self.limit),), memory=(slider,),
                       guards=(el.Guard(-way * s(), el.EventKind.STICK, ("stick",)),))

    def mirrored(self):
        return self

    def mirrored_key(self, key):
        return {"stick": "stick", "up": "down", "down": "up"}[key]

    def mirrored_guard(self, key, guard):
        return 1 - guard if key == "stick" else guard


@dataclass(frozen=True)
class Shaken(el.Element):
    """Springs and dashpots between two rows and a base that moves with two harmonics about a place, on a belt that runs."""

    k: float = 0.7
    c: float = 0.3
    harmonics = (1, 2)

    def site(self, n):
        base = [el.local.affine(0.4) + el.local.wave(0.5, 1, 0.3), el.local.wave(0.2, 2, -0.8) + el.local.affine(-0.1)]
        return el.Rows.of([[1.0, -0.5], [0.0, 2.0]], n, base=base, drift=(0.6, -0.9))

    def mode(self, key, core):
        return el.Mode(force=(-self.k * u(0) - self.c * s(0) - 0.1 * u(1) + 0.05 * s(1),
                              -2.0 * self.k * u(1) - 0.5 * self.c * s(1) + el.local.wave(0.3, 1, 1.1) + 0.2))
