"""What is tested along curves of special points, on pencils and maps with known numbers."""
import math
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.continuation import Monitor, SpecialPointKind
from bifurc.continuation.curves import codimension_two, leaving
from bifurc.continuation.curves.codimension_two import cosines, cubic_coefficient, double, second, watched
from bifurc.continuation.kinds import LocationStatus
from bifurc.continuation.maps import CycleProblem, MapOrbit, MapOrbitStatus, SmoothMap


class Pencil:
    """J(mu) of two unknowns; the closing columns carry mu."""

    scale = np.array([2.0, 0.5, 1.0])

    def __init__(self, multipliers, pencil=None):
        self.A, self.of, self.poly = np.array([[1.0, 0.7], [0.3, 2.0]]), multipliers, pencil

    def wrapped_jacobian(self, x, mu):
        return self.A - mu * np.array([[0.4, x[0]], [0.0, 0.6]])

    def pencil(self, x):
        return self.poly

    def multipliers_at(self, x):
        return np.array(self.of, complex)


def test_tests_of_a_further_and_of_a_double_multiplier():
    problem, x = Pencil([]), np.array([0.2, 0.0, 0.0])
    for mu in (1.0, -1.0):
        J = problem.wrapped_jacobian(x, mu) * problem.scale[:2]
        sigma = np.linalg.svd(J, compute_uv=False)
        assert second(mu)(problem, x) == pytest.approx(np.linalg.det(J) / sigma[0])
        C = -np.array([[0.4, 0.2], [0.0, 0.6]]) * problem.scale[:2]
        u, _, vt = np.linalg.svd(J)
        sign = np.linalg.det(u) * np.linalg.det(vt)
        assert double(mu)(problem, x) == pytest.approx(sign * u[:, -1] @ C @ vt[-1])


def test_cosines_of_the_pair_nearest_to_the_circle():
    x, theta = np.zeros(3), 2.0 * np.pi / 3.0
    for size in (1.0, 1.1):
        problem = Pencil([0.2, size * np.exp(1j * theta), size * np.exp(-1j * theta)])
        want = size * math.cos(theta)
        np.testing.assert_allclose(cosines(problem, x), [want - 1.0, -1.0 - want, want + 0.5, want], atol=1e-12)
    quadratic = Pencil(None, np.array([1.0, -2.0 * 0.4 * 3.0, 3.0]))  # 3 z^2 - 2.4 z + 1
    np.testing.assert_allclose(cosines(quadratic, x), [0.4 - 1.0, -1.4, 0.9, 0.4], atol=1e-12)
    cubic = np.poly([0.1, np.exp(1j), np.exp(-1j)]).real[::-1]
    assert cosines(Pencil(None, cubic), x)[3] == pytest.approx(math.cos(1.0))


def test_the_cubic_coefficient_of_a_flip_is_zero_where_it_is_generalised():
    """x' = -x + b x^2 + c x^3 doubles to x - 2 (b^2 + c) x^3: the coefficient vanishes at c = -b^2 and has its sign."""
    values = []
    for c in (-0.5, -0.36, 0.2):
        made = SmoothMap(lambda x, a, c=c: -(1.0 + a) * x + 0.6 * x * x + c * x**3, 1, a=0.0)
        cycle = MapOrbit(made, "-", np.array([[0.0]]), MapOrbitStatus.CONVERGED, 0.0)
        problem = CycleProblem(cycle, "a", (-0.5, 0.5))
        values.append(cubic_coefficient(problem, np.array([0.0, 0.0])))
    assert values[1] == pytest.approx(0.0, abs=1e-9)
    assert values[0] / values[2] == pytest.approx((0.36 - 0.5) / (0.36 + 0.2), rel=1e-6)


class Pair:
    """Multipliers that are given, of equations M - mu in skew coordinates and other units."""

    wraps, scale = True, np.array([2.0, 0.5, 1.0])
    skew = np.array([[1.0, 0.7], [-0.4, 1.2]])

    def wrapped_jacobian(self, x, mu):
        upper = np.array([[x[0], 1.0], [0.0, x[1]]])  # one Jordan block where both are the same
        return self.skew @ (upper - mu * np.eye(2)) @ np.linalg.inv(self.skew)


@pytest.mark.parametrize("kind, own, kinds, passes", [
    ("fold", 1.0, ["fold_flip", "resonance_1_1"], [-1.0, 1.0]),
    ("period_doubling", -1.0, ["fold_flip", "resonance_1_2"], [1.0, -1.0])])
def test_what_is_watched_along_a_curve_passes_zero_where_the_other_multiplier_does(monkeypatch, kind, own, kinds, passes):
    """On folds and flips one multiplier is 1 or -1; the other passes -1 or 1, or joins it."""
    monkeypatch.setattr(codimension_two, "cubic_coefficient", lambda problem, x: 7.0)
    monitors, values = watched(Pair(), None, SpecialPointKind(kind))
    assert [monitor.kind.value for monitor in monitors[:2]] == kinds
    for k, at in enumerate(passes):
        below, here, above = (values(Pair(), np.array([own, at + aside, 0.0]))[k] for aside in (-1e-3, 0.0, 1e-3))
        assert below * above < 0.0 and abs(here) < 1e-9
        other = passes[1 - k]
        assert values(Pair(), np.array([own, other - 1e-3, 0.0]))[k] * values(Pair(), np.array([own, other + 1e-3, 0.0]))[k] > 0.0
    assert kind == "fold" or values(Pair(), np.array([own, 0.3, 0.0]))[2] == 7.0


# what leaves a point

@dataclass(frozen=True)
class At:
    kind: SpecialPointKind
    name: str = ""
    x: object = None
    problem: object = None
    successor: object = None
    parameter: float = 0.0
    tangent: object = None
    before: str = ""
    after: str = ""
    directions: object = None
    reverses: bool = False
    status: LocationStatus = LocationStatus.LOCATED


K = SpecialPointKind


def a_curve(kind, monitors=(K.PERIOD_DOUBLING,), **more):
    problem = SimpleNamespace(monitors=[Monitor(kind) for kind in monitors], signature="touches")
    return SimpleNamespace(kind=kind, base_parameter="a", scale=np.array([1.0, 8.0, 0.5]), bounds_a=(-math.inf, 3.0),
                           family=SimpleNamespace(alone=lambda b: problem, problem=problem), **more)


@pytest.mark.parametrize("name, flip, leaves", [("fold", K.PERIOD_DOUBLING, K.FOLD), ("flip", K.PERIOD_DOUBLING, K.PERIOD_DOUBLING),
                                                ("flip", K.BRANCH_POINT, K.BRANCH_POINT)])
def test_where_a_touching_orbit_has_a_multiplier_on_the_circle_its_own_curve_leaves(name, flip, leaves):
    """Of a multiplier 1 that of folds; of -1 that of flips, or where a symmetry breaks."""
    (found,) = leaving.curves_from(a_curve(K.GRAZING, (flip,)), At(K.RESONANT_GRAZING, name, np.array([0.1, 2.0, 5.0])), 1)
    assert found.kind is leaves and found.name == "" and found.parameter == 2.0 and found.x.tolist() == [0.1, 2.0]
    assert found.problem.signature == found.before == "touches" and found.tangent.tolist() == [0.0, 1.0]


@pytest.mark.parametrize("here, at, leaves", [(K.FOLD, K.FOLD_FLIP, K.PERIOD_DOUBLING), (K.PERIOD_DOUBLING, K.FOLD_FLIP, K.FOLD),
                                              (K.PERIOD_DOUBLING, K.RESONANCE_1_2, K.NEIMARK_SACKER)])
def test_curves_of_the_same_orbit_leave_where_it_watches_them(here, at, leaves):
    point = At(at, "", np.array([0.1, 2.0, 5.0]))
    (found,) = leaving.curves_from(a_curve(here, (leaves,)), point, 1)
    assert found.kind is leaves
    assert bool(leaving.curves_from(a_curve(here, ()), point, 1)) is (leaves is K.FOLD)  # a fold needs no monitor


def test_orbits_of_as_many_periods_as_are_asked_for_leave_a_resonant_grazing(monkeypatch):
    asked = []
    monkeypatch.setattr(leaving, "beside", lambda curve, point, starts, kinds: asked.append(kinds) or ("found",))
    point = At(K.RESONANT_GRAZING, "s_3", np.array([0.1, 2.0, 5.0]))
    assert leaving.curves_from(a_curve(K.GRAZING), point, 3) == ("found",) and asked == [(K.FOLD, K.PERIOD_DOUBLING)]
    none = leaving.curves_from(a_curve(K.GRAZING), point, 2)
    assert len(none) == 0 and "n_max = 3" in none.status and len(asked) == 1


def test_points_beside_are_looked_for_in_the_unit_of_the_parameter_and_the_nearest_is_taken(monkeypatch):
    """At distances of 1e-2 and 3e-3: 40 times that, in sizes of 8, to both sides of a = 2, within the bounds."""
    asked = []

    def traced(start, name, bounds, ds, max_steps):
        asked.append((start, name, bounds, ds))
        if len(asked) == 1:
            raise ValueError("not on a branch")
        return SimpleNamespace(special_points=[At(K.FOLD, "", parameter=2.5), At(K.FOLD, "", parameter=1.8), At(
            K.PERIOD_DOUBLING, "", parameter=2.0), At(K.FOLD, "named", parameter=2.0), At(
            K.FOLD, "", parameter=2.0, status=LocationStatus.GUESS)])
    monkeypatch.setattr(leaving, "trace", traced)
    point = SimpleNamespace(x=np.array([0.1, 2.0, 5.0]))

    def aside(point, sign, distances):
        assert distances == leaving.ASIDE
        return ((distance, point) for distance in ((1e-2, 3e-3) if sign > 0.0 else ()))
    curve = a_curve(K.GRAZING, aside=aside)
    found = leaving.beside(curve, point, lambda problem, x: ("orbit",), (K.FOLD,))
    assert [one.parameter for one in found] == [1.8]
    assert asked[0][:3] == ("orbit", "a", (pytest.approx(2.0 - 3.2), 3.0)) and asked[0][3] == pytest.approx(1e-3)
    assert asked[1][2] == pytest.approx((2.0 - 0.96, 2.0 + 0.96)) and len(asked) == 2
