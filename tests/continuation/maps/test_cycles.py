"""Cycles of maps on plain numbers: equations with their derivative, multipliers, symbols, slopes by differences."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.continuation.kinds import SpecialPointKind
from bifurc.continuation.maps import MapOrbit, MapOrbitStatus, NordmarkMap, SmoothMap, SquareRootMap
from bifurc.continuation.maps import orbit as cycles
from bifurc.continuation.maps.orbit import cycle_equations
from bifurc.continuation.maps.problem import CycleProblem


@pytest.mark.parametrize("made", [SquareRootMap(lam=0.3, mu=0.2), NordmarkMap(alpha=0.6, gamma=0.05, r2=0.5, rho=0.1)])
def test_equations_of_a_cycle_and_their_derivative(made, rng):
    n, d, symbols = 3, made.dimension, "IOI"
    U = rng.uniform(0.1, 0.6, n * d)
    F, J = cycle_equations(made, symbols, U)
    rows = U.reshape(n, d)
    for i in range(n):
        k = (i + 1) % n
        want = made.pieces[symbols[i]].image(rows[i], made)[0] - made.pieces[symbols[k]].place(rows[k])[0]
        np.testing.assert_allclose(F[i * d:(i + 1) * d], want)
    h = 1e-6
    sides = [[cycle_equations(made, symbols, U + sign * h * e)[0] for sign in (1.0, -1.0)] for e in np.eye(n * d)]
    slopes = np.column_stack([(above - below) / (2.0 * h) for above, below in sides])
    np.testing.assert_allclose(J, slopes, atol=1e-8)
    turned = cycle_equations(made, symbols, U, mu=-1.0)[1]
    wanted = J.copy()
    wanted[(n - 1) * d:, :d] *= -1.0  # only the closing point
    np.testing.assert_allclose(turned, wanted, atol=1e-15)


def test_multipliers_of_a_cycle_are_those_of_the_product_of_slopes():
    made = NordmarkMap(alpha=0.6, gamma=0.05, r2=0.5, rho=0.15)
    cycle = made.find(2, itinerary="IO")
    product = made.slope(cycle.points[1]) @ made.slope(cycle.points[0])
    mu = np.linalg.eigvals(product)
    np.testing.assert_allclose(np.sort_complex(cycle.multipliers), np.sort_complex(mu), atol=1e-12)
    assert abs(cycle.multipliers[0]) >= abs(cycle.multipliers[1])
    assert cycle.stable == (abs(mu).max() < 1.0) and cycle.period == 2
    np.testing.assert_allclose(made.iterate(cycle.points[0], 2)[2], cycle.points[0], atol=1e-12)
    for status, stable in ((MapOrbitStatus.CONVERGED, cycle.stable), (MapOrbitStatus.INADMISSIBLE, None),
                           (MapOrbitStatus.NOT_CONVERGED, None)):
        item = MapOrbit(made, cycle.itinerary, cycle.u, status, 0.0)
        assert item.stable is stable and item.success is (status is MapOrbitStatus.CONVERGED) and item.message == status.sentence
    border = MapOrbit(SquareRootMap(lam=0.2, mu=0.0), "I", np.array([[0.0]]), MapOrbitStatus.CONVERGED, 0.0)
    assert np.isinf(border.multipliers).all() and border.stable is False
    neutral = SmoothMap(lambda x, a: -x + a, 1, a=0.4).find(1, guess=0.2)
    assert neutral.stable is None


def test_cycles_begin_at_the_rarest_symbol_and_bad_requests_are_named():
    cycle = SquareRootMap(lam=0.2, mu=0.005).find(3)
    assert cycle.itinerary == "IOO"
    given = SquareRootMap(lam=0.2, mu=0.005).find(3, guess=cycle.points[1])
    assert given.itinerary == "OOI"
    for n in (0, 1.5, -1):
        with pytest.raises(ValueError, match="whole number, at least 1"):
            SquareRootMap(lam=0.2, mu=0.1).find(n)
    with pytest.raises(ValueError, match="3 of the symbols"):
        SquareRootMap(lam=0.2, mu=0.1).find(3, itinerary="IO")
    lost = SmoothMap(lambda x, a: x * x + a, 1, a=4.0).find(1, guess=30.0)  # no real fixed point
    assert lost.status is MapOrbitStatus.NOT_CONVERGED and lost.stable is None


@pytest.mark.parametrize("late", [0, 1, 2])
def test_the_guess_of_a_cycle_is_the_settled_motion_in_its_order(late, monkeypatch):
    """Where iteration has settled on a cycle the guess solves its equations, wherever on the cycle iteration has stopped."""
    asked = []
    monkeypatch.setattr(cycles, "SETTLE", cycles.SETTLE + late)
    monkeypatch.setattr(cycles, "newton", lambda *guess: asked.append(guess))
    SquareRootMap(lam=0.2, mu=0.005).find(3)
    [(system, symbols, U)] = asked
    assert symbols == "IOO" and np.abs(U).max() > 1e-3
    np.testing.assert_allclose(cycle_equations(system, symbols, U)[0], 0.0, atol=1e-12)


def test_a_map_with_another_parameter_and_its_slopes_by_differences(rng):
    made = NordmarkMap(alpha=0.6, gamma=0.05, r2=0.5, rho=0.1)
    other = made.with_parameters(rho=0.3)
    assert (made.rho, other.rho, other.alpha) == (0.1, 0.3, 0.6) and other.parameters["rho"] == 0.3
    assert repr(other) == "NordmarkMap(alpha=0.6, gamma=0.05, r2=0.5, rho=0.3)"
    henon = SmoothMap(lambda x, a, b: np.stack([1.0 - a * x[..., 0]**2 + x[..., 1], b * x[..., 0]], axis=-1), 2, a=1.2, b=0.3)
    x = rng.normal(size=(5, 2))
    want = np.array([[[-2.4 * u, 1.0], [0.3, 0.0]] for u in x[:, 0]])
    np.testing.assert_allclose(henon.slope(x), want, atol=1e-12)

    def real(x, a, b):
        if np.iscomplexobj(x):
            raise TypeError
        return np.stack([1.0 - a * x[..., 0]**2 + x[..., 1], b * x[..., 0]], axis=-1)
    np.testing.assert_allclose(SmoothMap(real, 2, a=1.2, b=0.3).slope(x), want, atol=1e-9)
    given = SmoothMap(real, 2, slope=lambda x, a, b: np.broadcast_to(np.eye(2) * a, (*x.shape, 2)), a=1.2, b=0.3)
    np.testing.assert_allclose(given.slope(x), np.broadcast_to(1.2 * np.eye(2), (5, 2, 2)))


@pytest.mark.parametrize(("multipliers", "torus"), [
    ([0.6 + 0.8j, 0.6 - 0.8j], True), ([0.3 + 0.4j, 0.3 - 0.4j], False), ([2.0, 0.5], False), ([1.0, 0.3], False),
    ([-1.0, 0.3], False), ([0.8j, -0.8j, 1.0], False), ([1j, -1j, 0.2], True)])
def test_a_torus_begins_where_a_complex_pair_is_on_the_circle(multipliers, torus):
    """Neither a pair inside it, nor real multipliers on it, nor two whose product is 1."""
    problem = object.__new__(CycleProblem)
    problem.pencil = lambda x: np.poly(multipliers).real[::-1]
    assert problem.confirm(SpecialPointKind.NEIMARK_SACKER, None) is torus
    assert problem.confirm(SpecialPointKind.FOLD, None) is True


def test_the_border_of_a_piece_is_as_far_away_in_any_unit_of_length():
    """In units of the cycle's size: the point that is nearest to the end of its piece counts."""
    piece = type("Half", (), {"inside": lambda self, u: float(u[0])})()
    found = []
    for unit in (1.0, 1e-6, 1e6):
        problem = object.__new__(CycleProblem)
        problem.map, problem.itinerary = SimpleNamespace(dimension=1, pieces={"A": piece}), "AAA"
        problem.scale = np.array([2.0, 2.0, 2.0, 1.0]) * [unit, unit, unit, 1.0]
        found.append(problem._border(unit * np.array([-3.0, -0.5, -1.0])))
    assert found == pytest.approx([-0.25] * 3)


@pytest.mark.parametrize("off", [0.25, -0.25, 0.0])
def test_the_residual_of_a_cycle_is_the_size_of_its_largest_defect(off):
    """x -> a - x from x = a / 2 + off comes to a / 2 - off, twice that away, on either side."""
    cycle = SmoothMap(lambda x, a: a - x, 1, a=0.4).find(1, guess=0.2)
    found = CycleProblem(cycle, "a", (0.0, 1.0)).solution(np.array([0.3 + off, 0.6]))
    assert found.map.a == 0.6 and found.points.tolist() == [[0.3 + off]]
    assert found.residual == pytest.approx(2.0 * abs(off), abs=1e-15)
