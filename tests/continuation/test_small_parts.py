"""Small functions of continuation, one by one: beside a point, maps, curves in two parameters, equilibria; on stand-ins."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.continuation import equilibria, free_vibration, resimulation
from bifurc.continuation import problem as problems
from bifurc.continuation.curves import tracing as curve_tracing
from bifurc.continuation.curves.problem import FARTHEST, ROUNDINGS, CurveProblem
from bifurc.continuation.families import degree_of
from bifurc.continuation.kinds import SpecialPointKind as Kind
from bifurc.continuation.kinds import StopReason
from bifurc.continuation.maps.base import Map
from bifurc.continuation.maps.problem import CycleProblem
from bifurc.continuation.monitors import WithMonitors
from bifurc.continuation.problem import Problem

# ---- beside a point ------------------------------------------------------------------------------------------------------------


def test_numbers_of_multipliers_are_believed_where_three_points_agree(monkeypatch):
    """The lengths in their order, towards the next row, up to half of the way to it."""
    lengths = resimulation.BESIDE
    monkeypatch.setattr(resimulation, "beside", lambda problem, x, tangent, step: (asked.append(step), step)[1])
    monkeypatch.setattr(resimulation, "numbers_at", lambda problem, at: told[len(asked) - 1] if len(asked) <= len(told) else None)

    def found(numbers, room=1e9):
        asked.clear()
        told[:] = numbers
        return resimulation.numbers_beside(None, None, None, room)

    asked, told = [], []
    assert len(lengths) >= 4
    assert found([1, 1, 1]) == (lengths[2], 1) and found([1, 1, 1], -1e9) == (-lengths[2], 1)
    assert found([2, 1, 1, 1]) == (lengths[3], 1) and found([1, 1, 2, 1]) == (0.0, None)
    assert found([None, None, None]) == (0.0, None) and found([1, None, 1, 1])[1] is None
    assert found([1] * 9, 2.0 * lengths[2]) == (lengths[2], 1) and found([1] * 9, 1.999 * lengths[2]) == (0.0, None)
    assert asked == list(lengths[:2])


def test_the_tangent_and_the_determinant_bordered_by_it(rng):
    """Against the null vector by singular values and the determinant by numpy, for borders of both orientations."""
    J = rng.normal(size=(3, 4))
    null = np.linalg.svd(J)[2][-1]
    for fixed in (False, True):
        for old in (null + 0.3 * rng.normal(size=4), -null):
            last = np.eye(4)[3] if fixed else old
            matrix = np.vstack([J, last])
            new, sign, log = Problem._tangent(None, matrix.copy(), old, *problems.factor(matrix.copy()), fixed)
            assert np.linalg.norm(new) == pytest.approx(1.0) and new == pytest.approx(null * np.sign(null @ old), abs=1e-12)
            known = np.linalg.slogdet(np.vstack([J, new]))
            assert sign == known[0] and log == pytest.approx(known[1], abs=1e-12)
    lost = np.vstack([J, J[0]])
    new, sign, log = Problem._tangent(None, lost, null, None, None, 0.0, 0.0, False)
    assert new is null and (sign, log) == (0.0, -np.inf)


@pytest.mark.parametrize("value, good", [(2.0, True), ([1.0, 1e-300], True), (0.0, False), (-1.0, False), ([1.0, 0.0], False),
                                         (np.nan, False), (np.inf, False)])
def test_what_must_be_positive(value, good):
    if good:
        assert np.array_equal(problems._positive(value, "scale"), np.asarray(value))
    else:
        with pytest.raises(ValueError, match="scale must be finite and positive"):
            problems._positive(value, "scale")


@pytest.mark.parametrize("degree, found", [(0, 4), (4, 4), (5, 8), (8, 8), (9, 16), (16, 16), (17, 32)])
def test_degrees_of_polynomials_are_found(degree, found):
    """The least of those that are tried that fits to rounding over all of the interval; a root has none."""
    assert degree_of(lambda p: np.array([0.5, ((p - 2.0) / 0.5) ** degree]), 2.0, 0.5) == found
    assert degree_of(lambda p: np.array([abs(p - 2.1) ** 0.5]), 2.0, 0.5) is None


# ---- cycles of maps ------------------------------------------------------------------------------------------------------------


class Turning(Map):
    """A map of two coordinates with a number to spread."""

    dimension, pieces = 2, ("all",)

    def __init__(self, gain=1.0):
        self.gain = gain

    def with_parameters(self, **values):
        if set(values) != {"gain"}:
            raise ValueError("unknown")
        return Turning(values["gain"])


def test_points_and_spread_numbers_of_a_map():
    made = Turning(3.0)
    assert made._point(None).tolist() == [0.0, 0.0] and made._point([1, 2]).tolist() == [1.0, 2.0]
    for bad in (1.0, [1.0, 2.0, 3.0], [np.nan, 0.0], [[1.0, 2.0]]):
        with pytest.raises(ValueError, match="Turning: x0 = .* is not allowed; it must be a point of 2 finite numbers"):
            made._point(bad)
    other = made._spread("gain", [1, 2, 3])
    assert other.gain.tolist() == [1.0, 2.0, 3.0] and made.gain == 3.0
    with pytest.raises(ValueError, match="unknown"):
        made._spread("other", [1.0])


@pytest.mark.parametrize("mu", [(0.5, 0.7), (2.0, 0.5), (1.25j, -1.25j), (0.5, 0.3, 2.0), (0.9 + 0.2j, 0.9 - 0.2j, -0.4),
                                (3.0, 0.2, 0.1, 7.0)])
def test_the_test_of_a_torus_is_zero_where_a_product_of_multipliers_is_one(mu):
    """c[0] is the product, c[-1] one, of the characteristic polynomial by rising powers."""
    c = np.poly(mu)[::-1].real
    product = np.prod([1.0 - a * b for i, a in enumerate(mu) for b in mu[:i]]).real
    scale = 1.0 if len(mu) == 2 else np.abs(c).max()
    assert CycleProblem._torus_value(None, c) == pytest.approx(product * scale, abs=1e-12)


@pytest.mark.parametrize("dimension, pieces, apart, kinds", [
    (1, 1, None, ["period_doubling"]), (2, 1, None, ["period_doubling", "neimark_sacker"]),
    (1, 2, None, ["period_doubling", "grazing"]),
    (2, 2, "halves", ["period_doubling", "neimark_sacker", "grazing", "period_doubling"])])
def test_what_is_watched_along_cycles(dimension, pieces, apart, kinds):
    problem = object.__new__(CycleProblem)
    problem.map = SimpleNamespace(dimension=dimension, pieces=range(pieces))
    problem._halves = lambda: apart
    problem._begin()
    assert [str(monitor.kind.value) for monitor in problem.monitors] == kinds
    assert [monitor.boundary for monitor in problem.monitors] == [k in ("grazing",) for k in kinds[:3]] + [True] * (len(kinds) - 3)


# ---- curves in two parameters --------------------------------------------------------------------------------------------------


def test_bounds_by_name(monkeypatch):
    monkeypatch.setattr(curve_tracing, "full_name", lambda problem, name: {"a": "x.a"}.get(name, name))
    free = (-np.inf, np.inf)

    def table(bounds):
        return curve_tracing.bounds_by_name(None, ("x.a", "b"), bounds)

    assert table(None) == {"x.a": free, "b": free} and table({"a": (0, 2)}) == {"x.a": (0.0, 2.0), "b": free}
    assert table(((0, 1), (2, 5))) == {"x.a": (0.0, 1.0), "b": (2.0, 5.0)} and table([None, (2, 5)])["b"] == (2.0, 5.0)
    for bad in ({"c": (0, 1)}, (0.0, 1.0), ((0, 1),), ((0, 1), (1, 2), (2, 3)), 3.0):
        with pytest.raises(ValueError, match="bounds"):
            table(bad)


@pytest.mark.parametrize("part, converged, apart", [(0.9, True, False), (1.1, True, True), (-1.1, True, True), (1.1, False, False)])
def test_branch_points_that_a_second_parameter_breaks(part, converged, apart):
    def correct(x, tangent):
        assert tangent.tolist() == [0.0, 0.0, 0.0, 0.0, 1.0] and x is start.x0
        return SimpleNamespace(converged=converged, tangent=np.array([0.0, 0.0, part * curve_tracing.APART, 9.0, 9.0]))

    start = SimpleNamespace(x0=np.zeros(5), correct=correct, parameter="b")
    if apart:
        with pytest.raises(ValueError, match="b breaks it into two branches"):
            curve_tracing.kept_together(start)
    else:
        curve_tracing.kept_together(start)


def test_the_function_that_is_followed_is_found_through_all_that_watches():
    inner = object.__new__(WithMonitors)
    inner.functions, inner.inner = {"f": "deep"}, SimpleNamespace()
    outer = object.__new__(WithMonitors)
    outer.functions, outer.inner = {"g": "shallow"}, inner
    found = curve_tracing.watching_function
    assert found(outer, Kind.USER, "g") == "shallow" and found(outer, Kind.USER, "f") == "deep"
    assert found(outer, Kind.USER, "h") is None and found(outer, Kind.FOLD, "g") is None
    assert found(SimpleNamespace(), Kind.USER, "g") is None


@pytest.mark.parametrize("slope, noise, width, known", [(0.0, 1e-9, 1.0, 0), (1.0, 1e-3, 1.0, "some"), (1.0, 1e-3, np.inf, "some")])
def test_how_far_equations_may_have_a_solution(slope, noise, width, known):
    """What is left grows linearly: beyond noise on both sides at a tenth .. of the reach the reach is less."""
    problem = SimpleNamespace(residual=lambda u, b: np.array([slope * u[0], 0.0]))
    found = CurveProblem._width(problem, np.zeros(2), np.array([1.0, 0.0]), np.array([1.0, 0.0]), noise, width)
    if known == 0:
        assert found == width
    else:
        reach = min(width, FARTHEST)
        while reach > noise and slope * reach / ROUNDINGS > noise:
            reach /= ROUNDINGS
        assert found == reach and noise < found * 1.0001 and found / ROUNDINGS <= noise

    def one_sided(u, b):
        if u[0] < 0.0:
            raise ValueError("negative")
        return np.array([u[0], 0.0])
    problem.residual = one_sided
    assert CurveProblem._width(problem, np.zeros(2), np.array([1.0, 0.0]), np.array([1.0, 0.0]), noise, width) == width


def test_rows_of_what_an_equilibrium_holds():
    """Of two holds one has a place on its surface, the other stands where it is; memory is at its limit, or as it was."""
    H, S, A = np.zeros((1, 3, 7)), np.zeros((1, 3, 7)), np.zeros((1, 6, 7))
    H[0, 0, 2:4], H[0, 1, 2:4] = [1.0, -1.0], [2.0, -2.0]
    S[0, 0, [0, 1, 6]] = [1.0, -1.0, -0.3]
    T = SimpleNamespace(H=H, S=S, A=A, n_holds=np.array([2]))
    limit = np.array([3.0, 0, 0, 0, 0, 0, 0.5])
    problem = SimpleNamespace(path=SimpleNamespace(tables=T), mode=0, reference=np.array([0.7, 0.2, 0, 0, 9.0, 4.0]),
                              scene=SimpleNamespace(n=2, ns=6, algebraic=lambda m: [(4, limit)]))
    free, rows = equilibria.EquilibriumProblem._rows(problem)
    assert free.shape == (1, 2) and abs(free[0] @ [1.0, -1.0]) < 1e-12 and free[0] @ free[0] == pytest.approx(1.0)
    known = np.array([[1, -1, 0, 0, 0, 0, -0.3], [2, -2, 0, 0, 0, 0, -1.0], [-3, 0, 0, 0, 1, 0, -0.5], [0, 0, 0, 0, 0, 1, -4.0]])
    assert rows == pytest.approx(known)
    A[0, 5, 2], T.n_holds[0] = 1.0, 0  # this memory follows a rate
    free, rows = equilibria.EquilibriumProblem._rows(problem)
    assert np.array_equal(free, np.eye(2)) and rows == pytest.approx(known[2:3])


@pytest.mark.parametrize("still, lingers, found", [(True, True, StopReason.AT_REST), (False, True, StopReason.HOMOCLINIC),
                                                   (True, False, StopReason.AT_REST), (False, False, None)])
def test_ends_of_branches_over_the_energy(still, lingers, found, monkeypatch):
    """What hardly moves is at rest, to a size of its own; what hardly comes back is homoclinic; other ends keep their names."""
    asked = []

    def small(orbits, x, size=None):
        asked.append((orbits, x.tolist(), size))
        return still

    monkeypatch.setattr(free_vibration.autonomous, "small", small)
    monkeypatch.setattr(free_vibration.autonomous, "homoclinic", lambda orbit: lingers and orbit == "orbit")
    problem = SimpleNamespace(orbits="orbits", solution=lambda x: "orbit")

    def named(reason):
        return free_vibration.EnergyProblem.named_end(problem, np.array([1.0, 2.0, 3.0]), reason, "m")

    assert named(StopReason.BOUND) == (StopReason.BOUND, "m") and not asked
    for reason in free_vibration.ENDED:
        assert named(reason) == ((reason, "m") if found is None else (found, ""))
    assert asked == [("orbits", [1.0, 2.0], free_vibration.STILL)] * len(free_vibration.ENDED)
