"""The square-root map and Nordmark's map against closed forms: windows, flips, borders, exponents."""
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.maps import MapOrbitStatus, NordmarkMap, SmoothMap, SquareRootMap


def window(lam, n):
    """(flip, border) of the maximal orbit of period n."""
    return (0.75 * lam**(2 * n - 2) * (1.0 - lam) / (1.0 - lam**n), lam**(2 * n - 4) * (1.0 - lam)**2 / (1.0 - lam**(n - 1))**2)


@pytest.mark.parametrize(("lam", "n"), [(0.2, 2), (0.2, 3), (0.2, 4), (0.4, 2), (0.4, 3), (0.1, 5)])
def test_windows_of_the_square_root_map(lam, n):
    low, high = window(lam, n)
    cycle = SquareRootMap(lam=lam, mu=math.sqrt(low * high)).find(n)
    assert cycle.itinerary == "I" + "O" * (n - 1) and cycle.stable
    s = math.sqrt(cycle.points[0, 0])
    assert s * s + lam**(n - 1) * s == pytest.approx(cycle.map.mu * (1.0 - lam**n) / (1.0 - lam), rel=1e-14)
    branch = bf.trace(cycle, "mu", bounds=(0.5 * low, 2.0 * high))
    (flip,) = branch.special_points.of("period_doubling")
    (border,) = branch.special_points.of("grazing")
    assert flip.parameter == pytest.approx(low, rel=1e-12) and border.parameter == pytest.approx(high, rel=1e-12)
    assert abs(flip.parameter - low) <= flip.error + 2e-16
    (doubled,) = bf.switch_branch(flip)
    assert doubled.period == 2 * n and doubled.success


def test_numbers_of_the_windows():
    assert window(0.2, 2) == pytest.approx((0.025, 1.0), rel=1e-14)
    assert window(0.2, 3) == pytest.approx((0.000967741935483871, 0.0277777777777778), rel=1e-13)


def test_exponent_of_the_square_root_map():
    found = SquareRootMap(lam=0.8, mu=1e-4).exponents(iterations=8000, starts=256)
    assert found.chaotic and found.errors[0] < 4e-4
    assert abs(found.values[0] - 0.1228) < 4.0 * found.errors[0] + 5e-5
    free = SquareRootMap(lam=0.8, mu=-0.1).exponents(iterations=100)
    assert free.values[0] == pytest.approx(math.log(0.8), abs=1e-12)


def test_diagram_adds_periods_towards_the_grazing():
    values = np.array([math.sqrt(np.prod(window(0.2, n))) for n in (2, 3, 4, 5)])
    diagram = SquareRootMap(lam=0.2, mu=0.1).diagram("mu", values)
    assert diagram.periods.tolist() == [2, 3, 4, 5]
    assert SquareRootMap(lam=0.8, mu=0.1).diagram("mu", [1e-3, 1e-4]).periods.tolist() == [0, 0]


def nordmark(alpha, gamma, r2, n, plus):
    """Return (s, rho, x, y) of the fold (plus = -1) or flip (plus = 1) of the orbit with one impact, in closed form."""
    A = np.array([[alpha, 1.0], [-gamma, 0.0]])
    P = np.linalg.matrix_power(A, n - 1)
    trace, det = P[1, 0] - gamma * r2 * P[0, 1], gamma**n * r2
    s = P[0, 0] / (2.0 * (1.0 + trace + det)) if plus > 0 else P[0, 0] / (2.0 * (trace - 1.0 - det))
    # x_1 = (-s + y + rho, -g r2 s^2), then n - 1 free steps back to (s^2, y): linear in y and rho
    total = sum((np.linalg.matrix_power(A, k) for k in range(n - 1)), np.zeros((2, 2)))
    M = np.column_stack([P @ [1.0, 0.0] - [0.0, 1.0], (P + total) @ [1.0, 0.0]])
    y, rho = np.linalg.solve(M, np.array([s * s, 0.0]) - P @ [-s, -gamma * r2 * s * s])
    return s, rho, s * s, y


@pytest.mark.parametrize(("alpha", "gamma", "r2", "n"), [(0.6, 0.05, 0.5, 2), (0.5, 0.04, 0.5, 3), (0.4, 0.02, 0.8, 2)])
def test_flip_of_nordmarks_map(alpha, gamma, r2, n):
    s, rho, x, y = nordmark(alpha, gamma, r2, n, 1)
    cycle = NordmarkMap(alpha=alpha, gamma=gamma, r2=r2, rho=1.1 * rho).find(n, guess=(x, y), itinerary="I" + "O" * (n - 1))
    assert cycle.success
    (point,) = bf.trace(cycle, "rho", bounds=(0.7 * rho, 1.3 * rho)).special_points.of("period_doubling")
    assert point.parameter == pytest.approx(rho, rel=1e-12)
    np.testing.assert_allclose(point.solution.points[0], [x, y], rtol=1e-11)
    np.testing.assert_allclose(point.solution.multipliers, [-1.0, -gamma**n * r2], rtol=1e-9)


def test_numbers_of_nordmarks_map():
    want = (0.186202035765215, 0.104902555360684, 0.00655640970971004)
    assert nordmark(0.6, 0.05, 0.5, 2, 1)[1:] == pytest.approx(want, rel=1e-13)


def test_formal_cycles_are_not_admissible():
    s, rho, x, y = nordmark(0.6, 0.05, 0.5, 3, 1)
    cycle = NordmarkMap(alpha=0.6, gamma=0.05, r2=0.5, rho=0.2).find(3, itinerary="IOO")
    assert cycle.status is MapOrbitStatus.INADMISSIBLE and cycle.stable is None and "outside" in cycle.message
    with pytest.raises(ValueError, match="inadmissible"):
        bf.trace(cycle, "rho", bounds=(0.1, 0.3))


def test_exponents_of_nordmarks_map_sum_to_the_determinant():
    """Without loss at impacts the determinant is gamma in both pieces."""
    found = NordmarkMap(alpha=0.9, gamma=0.1, r2=1.0, rho=0.02).exponents(iterations=2000, starts=16)
    assert found.values.sum() == pytest.approx(math.log(0.1), abs=1e-9)


def test_exponents_of_nordmarks_map_lose_r2_at_every_impact():
    """det = gamma on free steps and gamma r^2 at impacts: the sum tells the share of impacts, which counting tells as well."""
    gamma, r2 = 0.05, 0.5
    _, rho, x, y = nordmark(0.6, gamma, r2, 2, 1)
    cycle = NordmarkMap(alpha=0.6, gamma=gamma, r2=r2, rho=1.1 * rho).find(2, guess=(x, y), itinerary="IO")
    assert cycle.success and cycle.stable and sorted(cycle.itinerary) == ["I", "O"]
    found = cycle.map.exponents(cycle.points[0], iterations=2000, starts=8)
    # directions turn once by a finite angle until they are those of the multipliers; what they span is exact at once
    np.testing.assert_allclose(found.values, np.log(np.abs(cycle.multipliers)) / 2.0, atol=1.0 / 2000)
    assert found.values.sum() == pytest.approx(math.log(gamma) + 0.5 * math.log(r2), abs=1e-9)


@pytest.mark.parametrize("system", [SquareRootMap(lam=0.3, mu=0.1), NordmarkMap(alpha=0.6, gamma=0.05, r2=0.3, rho=0.1)])
def test_slopes_are_those_of_differences(system, rng):
    """In both pieces, of the map itself and of the pieces that cycles are solved with, which take the root of x as unknown."""
    h, d = 1e-6, system.dimension
    for x in rng.uniform(-0.3, 0.3, (20, d)):
        if abs(x[0]) < 0.01:
            continue
        moves = h * np.eye(d)
        slope = np.column_stack([(system.step(x + move) - system.step(x - move)) / (2.0 * h) for move in moves])
        np.testing.assert_allclose(system.slope(x), slope, atol=1e-7)
        piece = system.pieces[system.piece_of(x)]
        u = piece.coordinates(x)
        np.testing.assert_allclose(piece.place(u)[0], x, atol=1e-15)
        image, by_u = piece.image(u, system)
        np.testing.assert_allclose(image, system.step(x), atol=1e-15)
        np.testing.assert_allclose(by_u, slope @ piece.place(u)[1], atol=1e-6)


def test_smooth_maps_flip_and_torus():
    logistic = SmoothMap(lambda x, a: a * x * (1.0 - x), 1, a=2.8)
    branch = bf.trace(logistic.find(1, guess=0.6), "a", bounds=(2.5, 3.6))
    (flip,) = branch.special_points.of("period_doubling")
    assert flip.parameter == pytest.approx(3.0, abs=1e-12)
    (doubled,) = bf.switch_branch(flip)
    second = bf.trace(doubled, "a", bounds=(2.9, 3.6)).special_points.of("period_doubling")
    assert any(point.parameter == pytest.approx(1.0 + math.sqrt(6.0), abs=1e-11) for point in second)


@pytest.mark.parametrize("wrong", [{"lam": 0.2}, {"lam": 0.2, "mu": float("nan")}, {"lam": 0.2, "mu": 0.1, "nu": 1.0}])
def test_wrong_parameters_are_named(wrong):
    with pytest.raises(ValueError, match="mu|nu"):
        SquareRootMap(**wrong)


def test_wrong_questions_are_named():
    system = SquareRootMap(lam=0.2, mu=0.1)
    with pytest.raises(ValueError, match="itinerary"):
        system.find(2, itinerary="IX")
    with pytest.raises(ValueError, match="no parameter"):
        bf.trace(system.find(2), "lamda", bounds=(0, 1))
    with pytest.raises(ValueError, match="traced in a parameter"):
        bf.trace(system.find(2))
    with pytest.raises(ValueError, match="a point of"):
        system.iterate((1.0, 2.0), 3)


def test_diagram_is_drawn():
    import matplotlib.pyplot as plt

    ax = SquareRootMap(lam=0.2, mu=0.1).diagram("mu", np.linspace(0.01, 0.2, 20)).plot()
    assert ax.get_xlabel() and len(ax.lines[0].get_xdata()) == 20 * 128
    plt.close(ax.figure)


@pytest.mark.parametrize("system", [SquareRootMap(lam=0.3, mu=0.1), NordmarkMap(alpha=0.6, gamma=0.05, r2=0.3, rho=0.1)])
def test_the_border_belongs_to_the_free_side(system):
    """There the map is continuous, its slope that of the free motion; it becomes infinite from the other side."""
    n = system.dimension
    on, below, above = np.zeros(n), np.full(n, 0.0), np.full(n, 0.0)
    below[0], above[0] = -1e-12, 1e-12
    assert system.piece_of(on) == system.piece_of(below) != system.piece_of(above)
    np.testing.assert_allclose(system.step(on), system.step(below), rtol=0, atol=1e-11)
    np.testing.assert_allclose(system.step(on), system.step(above), rtol=0, atol=1.1e-6)
    slope = (system.step(on) - system.step(below)) / 1e-12
    np.testing.assert_allclose(system.slope(on)[:, 0], slope, rtol=1e-3)
    np.testing.assert_array_equal(system.slope(on), system.slope(below))
    assert system.slope(above)[0, 0] == pytest.approx(-0.5e6)
