"""Impacts of an element that accumulate without its saying what they lead to."""
from dataclasses import dataclass

import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import Element, EventKind, Guard, Mode, Rows, local
from bifurc.elements.mode import Restitution


@dataclass(frozen=True)
class Rocking(Element):
    """A block on two corners: its weight drives it back to the middle, where it changes corners and keeps a part of its speed."""

    weight: float = 1.0
    kept: float = 0.8

    start = ("right", "left")

    def site(self, n):
        return Rows.of(0, n)

    def mode(self, key, core):
        way, other = (1.0, "left") if key == "right" else (-1.0, "right")
        return Mode(force=(local.affine(-way * self.weight),),
                    guards=(Guard(-way * local.u(0), EventKind.IMPACT, (other,), kick=Restitution(-self.kept)),))


@dataclass(frozen=True)
class Bouncing(Element):
    """A stop whose impacts do not say that they come to rest."""

    kept: float = 0.5

    def site(self, n):
        return Rows.of(0, n)

    def mode(self, key, core):
        return Mode(guards=(Guard(local.u(0), EventKind.IMPACT, (key,), kick=Restitution(self.kept)),))


@pytest.mark.parametrize("element, start, force", [
    (Rocking(label="block"), (0.3, 0.0), 0.0), (Rocking(kept=0.5, label="block"), (-0.3, 0.0), 0.0),
    (Bouncing(label="block"), (-1.0, 0.0), 1.0)])
def test_what_accumulates_without_a_word_is_told_by_the_field_to_give(element, start, force):
    """Near the middle the times between impacts fall with the speeds: they all end at a finite time."""
    system = bf.System(1.0, 0.0, -0.5 if force == 0.0 else 0.0, [element, bf.elements.ConstantForce(force)])
    motion = bf.simulate(system, start, duration=100.0, max_events=10_000)
    assert not motion.success and np.isfinite(motion.final).all()
    assert motion.stop < 30.0
    assert "accumulates=(ratio, key)" in motion.message and "'block'" in motion.message
