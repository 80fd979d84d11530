"""A piece of a branch in its tube, on the unit circle: its parabola in closed form, and what a missing proof makes of it."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.certify.parameter import tube
from bifurc.certify.parameter.sheet import Node

TESTS = ("regular", "flipless", "torusless", "admissible")


def on_circle(angle):
    return np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])


class Circle:
    """Stands for a sheet whose branch is the unit circle."""

    path = SimpleNamespace(scale=np.ones(2))
    reached = True

    def corrected(self, guess, row):
        self.guess = guess
        z = guess / np.linalg.norm(guess)
        return (z, np.array([-z[1], z[0]]), np.eye(2)) if self.reached else None

    def proved(self, z, tangent, inverse, row):
        return Node(z, tangent, [])


def tubes(monkeypatch, ends=(), **said):
    """Let tubes say what they are told to, and nothing against the piece otherwise; return the list of those made."""
    made = []

    def stand_in(sheet, z, t, c, inverse, row, h):
        made.append(SimpleNamespace(z=z, t=t, c=c, row=row, h=h, contract=lambda: said.get("contract", ""),
                                    holds=lambda node: "outside" not in said or node is not ends[said["outside"]],
                                    **{name: lambda name=name: said.get(name, "") for name in TESTS}))
        return made[-1]
    monkeypatch.setattr(tube, "Tube", stand_in)
    return made


@pytest.mark.parametrize("half", [0.02, 0.1, 0.3])
def test_the_parabola_touches_the_circle_and_bends_as_it(monkeypatch, half):
    """Half way, z + t d - z d^2/2: the guess is off by the fourth power of the length, the bend by its square."""
    made, sheet = tubes(monkeypatch), Circle()
    a, b = (Node(*on_circle(0.7 + way * half), []) for way in (-1.0, 1.0))
    assert tube.piece(sheet, a, b) == (True, "", None)
    (found,) = made
    z, t = on_circle(0.7)
    np.testing.assert_allclose(sheet.guess, z, atol=half**4)
    np.testing.assert_allclose(found.z, z, atol=1e-14)
    np.testing.assert_allclose(found.t, t, atol=1e-14)
    np.testing.assert_allclose(found.c, -0.5 * z, atol=half**2)
    assert found.h == pytest.approx(np.sin(half), rel=1e-5) and found.h > np.sin(half)  # half the chord, and over it
    np.testing.assert_allclose(found.row, t, atol=1e-14)
    assert found.row @ (b.z - a.z) == pytest.approx(2.0 * np.sin(half))


@pytest.mark.parametrize(("said", "why"), [({"contract": "long"}, "long"), ({"outside": 0}, "ends"), ({"outside": 1}, "ends")])
def test_a_piece_is_joined_only_where_its_tube_is_proved_and_holds_both_ends(monkeypatch, said, why):
    ends = [Node(*on_circle(angle), []) for angle in (0.1, 0.3)]
    tubes(monkeypatch, **said, ends=ends)
    found = tube.piece(Circle(), *ends)
    assert not found.joined and why in found.missing
    np.testing.assert_allclose(found.centre.z, on_circle(0.2)[0])  # where the piece is cut in two


def test_a_piece_that_newton_does_not_reach_has_no_middle():
    lost = Circle()
    lost.reached = False
    found = tube.piece(lost, *(Node(*on_circle(angle), []) for angle in (0.1, 0.3)))
    assert found == (False, "Newton does not reach the branch there", None)


@pytest.mark.parametrize("test", TESTS)
def test_a_joined_piece_says_what_may_lie_on_it(monkeypatch, test):
    tubes(monkeypatch, **{test: "something is near"})
    found = tube.piece(Circle(), *(Node(*on_circle(angle), []) for angle in (0.1, 0.3)))
    assert found.joined and found.missing == "something is near" and found.centre is not None
