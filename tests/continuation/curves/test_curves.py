"""Curves in two parameters and peaks, against closed forms."""
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation import Monitor, Problem, SpecialPointKind, StopReason, trace, trace_curve
from bifurc.continuation.conditions import difference


class Cusp(Problem):
    """u^3 - q u - p: folds where 27 p^2 = 4 q^3."""

    def __init__(self, q=1.0):
        u = -1.5
        super().__init__(u, u**3 - q * u)
        self.q = q

    def residual(self, u, p):
        return u**3 - self.q * u - p


class Turned(Problem):
    """The same with its parameters turned by an angle, so that both stand still at the cusp."""

    parameter = "a"

    def __init__(self):
        super().__init__(1.2, 0.0)
        self.b = 1.0

    def residual(self, u, a):
        return u**3 - (0.6 * a + 0.8 * self.b) * u - (0.8 * a - 0.6 * self.b)


class Duffing(Problem):
    """One harmonic of x'' + c x' + x + g x^3 = f cos(w t), x = a cos + b sin."""

    parameter = "w"
    measure_names = ("amplitude", "u_0")

    def __init__(self, c=0.1, f=0.3, g=1.0, w=0.4):
        super().__init__([f / (1 - w * w), 0.0], w, scale_u=2.0)
        self.c, self.f, self.g = c, f, g

    def residual(self, u, w):
        a, b = u
        k = 1 - w * w + 0.75 * self.g * (a * a + b * b)
        return np.array([k * a + self.c * w * b - self.f, k * b - self.c * w * a])

    def measure(self, name, xs):
        return np.hypot(xs[:, 0], xs[:, 1]) if name == "amplitude" else xs[:, 0].copy()


class Touch(Problem):
    """A line u = p + r with a monitor u^2 + p^2 - 1: zero on a circle arc in (p, r)."""

    monitors = (Monitor(SpecialPointKind.USER, "touch"),)

    def __init__(self):
        super().__init__(0.1, -0.9)
        self.r = 1.0

    def residual(self, u, p):
        return u - p - self.r

    def monitor_values(self, u, p, tangent):
        return np.array([float(u[0])**2 + p * p - 1.0])


@pytest.fixture(scope="module")
def duffing():
    return trace(Duffing(), bounds=(0.2, 3.0), peaks="amplitude")


def peak_of(duffing, f, c):
    """Largest amplitude over frequency of the single-harmonic balance: y = A^2 solves (y/4) c^2 (4 + 3 g y - c^2) = f^2."""
    y = np.roots([0.75 * duffing.g, 1.0 - c * c / 4.0, -(f / c)**2])
    return math.sqrt(y.real.max())


def test_fold_curve_through_a_cusp():
    fold = trace(Cusp(), bounds=(-3, 3)).special_points[0]
    curve = trace_curve(fold, ("p", "q"), bounds={"q": (-2, 3), "p": (-2, 2)})
    p, q, u = curve.column("p"), curve.column("q"), curve.column("u_0")
    assert np.abs(27 * p**2 - 4 * q**3).max() < 1e-12
    assert np.abs(q - 3 * u**2).max() < 1e-12  # the Jacobian is differenced
    (cusp,) = curve.special_points
    assert cusp.kind is SpecialPointKind.CUSP
    assert max(map(abs, cusp.parameters.values())) < 1e-12
    assert set(cusp.parameters) == {"p", "q"}
    assert curve.stop_reason == (StopReason.BOUND, StopReason.BOUND)
    assert {abs(p[0]), abs(p[-1])} == {2.0} or np.allclose(np.abs(p[[0, -1]]), 2.0, atol=1e-12) or q.max() == 3.0


def test_cusp_in_turned_parameters():
    fold = trace(Turned(), bounds=(-3, 3)).special_points[0]
    curve = trace_curve(fold, ("a", "b"), bounds=[(-3, 3), (-3, 3)])
    (cusp,) = curve.special_points.of("cusp")
    assert max(map(abs, cusp.parameters.values())) < 1e-9
    (turn,) = curve.special_points.of("extremum")  # where the curve is vertical: da = 0 away from the cusp
    a, b = turn.parameters["a"], turn.parameters["b"]
    q, p = 0.6 * a + 0.8 * b, 0.8 * a - 0.6 * b
    assert turn.name == "a" and abs(27 * p**2 - 4 * q**3) < 1e-9
    # da = 0.6 dq + 0.8 dp with q = 3 u^2, p = -2 u^3: u = 0.6 * 6 / (0.8 * 6)
    assert abs(q - 3 * 0.75**2) < 1e-9 and turn.error < 1e-6


def test_peak_is_refined_and_bounds_its_error(duffing):
    (peak,) = duffing.special_points.of("peak")
    assert peak.name == "amplitude"
    y = peak_of(duffing.problems[0], 0.3, 0.1)**2
    w = math.sqrt(1.0 + 0.75 * y - 0.1**2 / 2.0)
    assert peak.measures["amplitude"] == pytest.approx(math.sqrt(y), abs=1e-12)
    assert abs(peak.parameter - w) < 1e-9
    assert not peak.reverses
    stored = duffing.column("amplitude").max()
    assert stored < peak.measures["amplitude"]


@pytest.mark.parametrize("ds_max", [0.05, 0.2, 0.5])
def test_only_maxima_and_at_any_step(ds_max):
    kinds = [point.kind.value for point in trace(Duffing(), bounds=(0.2, 3.0), peaks="amplitude", ds_max=ds_max).special_points]
    assert sorted(kinds) == ["fold", "fold", "peak"]
    back = trace(Duffing(w=2.9), bounds=(0.2, 3.0), peaks="amplitude", ds_max=ds_max, direction=-1)
    assert [point.kind.value for point in back.special_points].count("peak") <= 1


def test_peak_followed_over_the_load(duffing):
    (peak,) = duffing.special_points.of("peak")
    curve = trace_curve(peak, ("f", "w"), bounds={"f": (0.05, 0.6)})
    assert curve.parameters == ("f", "w") and curve.kind is SpecialPointKind.PEAK
    want = [peak_of(curve.problems[0].family.problem, f, 0.1) for f in curve.column("f")]
    assert np.abs(curve.column("amplitude") - want).max() < 1e-9
    assert {curve.column("f").min(), curve.column("f").max()} == {0.05, 0.6}
    y = curve.column("amplitude")**2
    assert np.abs(curve.column("w")**2 - (1.0 + 0.75 * y - 0.005)).max() < 1e-8
    assert not curve.special_points


def test_fold_curve_of_duffing_ends_in_its_cusp(duffing):
    """Folds of k(y) y form: f^2 = y [(1 - w^2 + 3/4 y)^2 + c^2 w^2]; at the cusp first and second derivative by y vanish."""
    curve = trace_curve(duffing.special_points.of("fold")[0], ("w", "f"), bounds={"w": (0.5, 3.0), "f": (0.01, 0.5)})
    w, f, y = curve.column("w"), curve.column("f"), curve.column("amplitude")**2
    k = 1 - w**2
    assert np.abs(y * ((k + 0.75 * y)**2 + 0.01 * w**2) - f**2).max() < 1e-12
    assert np.abs((k + 0.75 * y)**2 + 0.01 * w**2 + 1.5 * y * (k + 0.75 * y)).max() < 1e-11
    (cusp,) = curve.special_points.of("cusp")
    w = cusp.parameters["w"]
    assert abs((1 - w**2)**2 - 3 * 0.01 * w**2) < 1e-9  # double root of the derivative


def test_zero_of_a_monitor():
    point = trace(Touch(), bounds=(-2, 2)).special_points.of("user")[0]
    curve = trace_curve(point, ("p", "r"), bounds={"r": (-5, 5)})
    p, u = curve.column("p"), curve.column("u_0")
    assert np.abs(u**2 + p**2 - 1.0).max() < 1e-12
    assert curve.closed
    turns = sorted(round(abs(turn.parameters[turn.name]), 9) for turn in curve.special_points)
    assert turns == [1.0, 1.0, round(math.sqrt(2), 9), round(math.sqrt(2), 9)]


def test_saved_and_read(tmp_path, duffing):
    (peak,) = duffing.special_points.of("peak")
    curve = trace_curve(peak, ("f", "w"), bounds={"f": (0.2, 0.4)})
    curve.save(tmp_path / "curve.npz")
    base = curve.problems[0].family.problem
    read = type(curve).load(tmp_path / "curve.npz", problem=base)
    for name in ("f", "w", "amplitude", "s"):
        assert np.array_equal(read.column(name), curve.column(name)), name
    assert read.parameters == curve.parameters
    longer = read.extend((0.1, 0.5))
    assert longer.column("f").max() == 0.5 and len(longer) > len(curve)
    duffing.save(tmp_path / "branch.npz")
    branch = type(duffing).load(tmp_path / "branch.npz", problem=Duffing())
    assert [p.kind for p in branch.special_points] == [p.kind for p in duffing.special_points]


def test_bad_requests(duffing):
    (peak,) = duffing.special_points.of("peak")
    fold = duffing.special_points.of("fold")[0]
    with pytest.raises(ValueError, match="there are c, f, g"):
        trace_curve(fold, ("w", "nothing"))
    with pytest.raises(ValueError, match="must hold the parameter of the branch"):
        trace_curve(fold, ("c", "f"))
    with pytest.raises(ValueError, match="two different names"):
        trace_curve(fold, ("w", "w"))
    with pytest.raises(ValueError, match="outside the bounds"):
        trace_curve(peak, ("w", "f"), bounds={"f": (0.5, 0.6)})
    with pytest.raises(ValueError, match="bounds name"):
        trace_curve(peak, ("w", "f"), bounds={"g": (0.5, 0.6)})
    with pytest.raises(ValueError, match="no amplitude measure"):
        trace(Duffing(), bounds=(0.2, 3.0), peaks="loudness")


# periodic orbits from shooting

@pytest.fixture(scope="module")
def impacts():
    return bf.trace(bf.find_orbit(bf.systems.impact_oscillator()), "omega", bounds=(0.5, 2.0))


def test_grazing_curve_closed_form(impacts):
    """The free orbit of amplitude a / |1 - w^2 + 2 i zeta w| touches the stop at 1."""
    graze = impacts.special_points.of("grazing")[0]
    curve = bf.trace_curve(graze, ("omega", "amplitude"), bounds={"omega": (0.3, 2.5), "amplitude": (0.1, 2.0)})
    w, a = curve.column("omega"), curve.column("amplitude")
    assert np.abs(a - np.hypot(1 - w * w, 0.1 * w)).max() < 1e-12
    assert len(curve) > 10 and a.min() == 0.1


@pytest.mark.parametrize("kind, multiplier", [("fold", 1.0), ("period_doubling", -1.0)])
def test_curves_of_impact_orbits_keep_their_multiplier(impacts, kind, multiplier):
    point = impacts.special_points.of(kind)[-1]
    curve = bf.trace_curve(point, ("omega", "amplitude"), bounds={"omega": (0.5, 2.4), "amplitude": (0.3, 0.8)})
    for orbit in [curve.orbits[i] for i in range(0, len(curve), 5)]:
        assert np.abs(orbit.multipliers - multiplier).min() < 1e-7
        assert orbit.residual < 1e-10
    other = curve.orbits[len(curve) // 2]
    branch = bf.trace(other, "omega", bounds=(other.parameters["omega"] - 0.02, other.parameters["omega"] + 0.02))
    assert min(abs(p.parameter - other.parameters["omega"]) for p in branch.special_points.of(kind)) < 1e-9


def test_differences_at_the_end_of_a_range_are_one_sided():
    """sin at 0 where negative arguments are refused: its derivative is 1; what always refuses raises."""
    def refused(x):
        if x[0] < 0.0:
            raise ValueError("negative")
        return np.sin(x[0]) * np.ones(2)

    np.testing.assert_allclose(difference(refused, np.array([0.0, 2.0]), 0, 1e-3), np.ones(2), rtol=0, atol=1e-11)
    with pytest.raises(ValueError, match="negative"):
        difference(refused, np.array([-1.0, 2.0]), 0, 1e-3)
