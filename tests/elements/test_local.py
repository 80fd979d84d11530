"""Affine expressions, frames and sites."""
import numpy as np
import pytest

from bifurc.elements import EventKind, Frame, Rows
from bifurc.elements.local import Affine, affine, cos, lam, rate, s, sin, u, wave, z


def test_expressions_add_and_scale():
    expression = 2.0 * u(0) - s(1) / 4 + 3 - (1 - 0.5 * lam()) * 2 + z(2)
    assert expression.terms == {("u", 0): 2.0, ("s", 1): -0.25, ("one", 0): 1.0, ("lam", 0): 1.0, ("z", 2): 1.0}
    assert expression.names == {"u", "s", "one", "lam", "z"}
    assert affine(2) == Affine({("one", 0): 2.0}) and hash(affine(2)) == hash(affine(2.0)) and affine(2) != 2
    assert repr(2.0 * u(1) - 0.5) == "2*u(1) + -0.5" and repr(Affine({})) == "0"


def test_terms_that_weigh_nothing_are_kept():
    assert (0.0 * u(0) + 1.0 - u(0) + u(0)).terms == {("u", 0): 0.0, ("one", 0): 1.0}
    assert wave(0.0, 2, 0.3).harmonics == {2}


@pytest.mark.parametrize("omega", [0.3, 2.0])
def test_waves_and_their_rates(omega):
    frame = Frame(1, 0, (1, 3), omega)
    motion = wave(0.7, 3, 0.4) + 0.2 * cos(1) - 0.1 * sin(1) + 5.0
    t = np.linspace(0.0, 9.0, 7)
    w = np.array([np.ones_like(t), np.cos(omega * t), np.sin(omega * t), np.cos(3 * omega * t), np.sin(3 * omega * t)])
    value = 0.7 * np.cos(3 * omega * t + 0.4) + 0.2 * np.cos(omega * t) - 0.1 * np.sin(omega * t) + 5.0
    slope = omega * (-2.1 * np.sin(3 * omega * t + 0.4) - 0.2 * np.sin(omega * t) - 0.1 * np.cos(omega * t))
    assert frame.row(motion)[2:] @ w == pytest.approx(value, rel=1e-14)
    assert frame.row(rate(motion, omega))[2:] @ w == pytest.approx(slope, rel=1e-13)
    assert frame.row(motion)[2:] @ frame.W @ w == pytest.approx(slope, rel=1e-13)


def test_a_site_gives_coordinates_speeds_and_the_rest_of_their_rates():
    frame = Frame(2, 1, (2,), 0.5)
    site = Rows.of([[1.0, 2.0], [0.0, 1.0]], 2, base=(0.3 * cos(2) + 1.0, affine(0.0)), drift=(0.0, -0.7))
    U, S, rest = site.rows(frame)  # q, v, z, 1, cos, sin with 2 omega = 1
    assert np.array_equal(U, [[1, 2, 0, 0, 0, 1, 0.3, 0], [0, 1, 0, 0, 0, 0, 0, 0]])
    assert np.array_equal(S, [[0, 0, 1, 2, 0, 0, 0, -0.3], [0, 0, 0, 1, 0, -0.7, 0, 0]])
    assert np.array_equal(rest, [[0, 0, 0, 0, 0, 0, -0.3, 0], [0, 0, 0, 0, 0, 0, 0, 0]])
    assert site.harmonics == {2} and site.count == 2


@pytest.mark.parametrize("where, words", [
    (2, "degree of freedom 2 is not allowed; there are 0 to 1"), (-1, "degree of freedom -1"),
    ([1.0], "it must be 2 finite factors"), ([0.0, 0.0], "not all zero"), ([[1.0, 0.0], [0.0, np.nan]], "finite"),
])
def test_bad_sites_are_named(where, words):
    with pytest.raises(ValueError, match=words):
        Rows.of(where, 2)


def test_base_and_drift_fit_the_rows():
    with pytest.raises(ValueError, match="one entry a row"):
        Rows.of(0, 2, drift=(1.0, 2.0))


def test_kinds_have_codes_in_order():
    assert [kind.code for kind in EventKind] == [*range(12), EventKind.RESET.code]  # kernels take a clock as a reset
    assert EventKind("impact") is EventKind.IMPACT and f"{EventKind.GRAZE}" == "graze"
