"""A user's monitors: located as points, followed as curves, saved by name."""
import math
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib import pyplot

import bifurc as bf
from bifurc.continuation import Problem
from bifurc.continuation.watching import Watching


def amplitude_at(omega, zeta, level):
    """Load with which the free response has the amplitude ``level``."""
    return level * math.hypot(1.0 - omega**2, 2.0 * zeta * omega)


def clearance(orbit):
    return 0.8 - orbit.maximum()


@pytest.fixture(scope="module")
def branch():
    system = bf.systems.impact_oscillator(zeta=0.05, omega=0.6, amplitude=0.3)
    return bf.trace(bf.find_orbit(system), "amplitude", bounds=(0.2, 0.6), monitors={"clearance": clearance})


def test_zero_of_a_monitor_is_located(branch):
    (point,) = branch.special_points.of("user")
    assert point.name == "clearance"
    assert point.parameter == pytest.approx(amplitude_at(0.6, 0.05, 0.8), abs=1e-12)
    assert abs(point.parameter - amplitude_at(0.6, 0.05, 0.8)) <= point.error + 1e-14


def test_zero_of_a_monitor_is_followed(branch):
    (point,) = branch.special_points.of("user")
    curve = bf.trace_curve(point, ("omega", "amplitude"), bounds={"omega": (0.5, 0.7), "amplitude": (0.1, 1.0)})
    omega, amplitude = curve.column("omega"), curve.column("amplitude")
    assert omega.min() == pytest.approx(0.5) and omega.max() == pytest.approx(0.7)
    np.testing.assert_allclose(amplitude, [amplitude_at(w, 0.05, 0.8) for w in omega], atol=1e-11)
    assert curve.name == "clearance"
    ax = curve.plot()
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["clearance"]
    pyplot.close(ax.figure)


def test_monitor_goes_on_behind_a_grazing():
    system = bf.systems.impact_oscillator(zeta=1.25, omega=2.0, amplitude=5.0)
    branch = bf.trace(bf.find_orbit(system), "amplitude", bounds=(5.0, 7.0),
                      monitors={"speed": lambda orbit: max((e.speed for e in orbit.events), default=0.0) - 0.3})
    (point,) = branch.special_points.of("user")
    assert point.solution.events[0].speed == pytest.approx(0.3, abs=1e-11)
    assert len(branch.special_points.of("grazing")) == 1


def test_monitors_of_algebraic_problems_and_files(tmp_path):
    class Parabola(Problem):
        def residual(self, u, p):
            return p + u**2
    branch = bf.trace(Parabola(0.5, -0.25), bounds=(-1, 1), monitors={"half": lambda s: s.u[0] - 0.7})
    (point,) = branch.special_points.of("user")
    assert point.parameter == pytest.approx(-0.49, abs=1e-13)
    branch.save(tmp_path / "branch.npz")
    again = bf.Branch.load(tmp_path / "branch.npz", problem=Parabola(0.5, -0.25))
    assert [p.name for p in again.special_points] == [p.name for p in branch.special_points]
    np.testing.assert_array_equal(again.column("parameter"), branch.column("parameter"))


def test_curve_of_a_monitor_is_not_read_without_its_function(branch, tmp_path):
    (point,) = branch.special_points.of("user")
    curve = bf.trace_curve(point, ("omega", "amplitude"), bounds={"omega": (0.55, 0.65), "amplitude": (0.1, 1.0)})
    curve.save(tmp_path / "curve.npz")
    with pytest.raises(ValueError, match="clearance"):
        bf.load(tmp_path / "curve.npz")


WRONG = [({"bound": clearance}, "bound"), ({"": clearance}, "free name"), ({"c": 1.0}, "'c'"), ({"c": lambda orbit: "no"}, "'c'")]


@pytest.mark.parametrize(("monitors", "word"), WRONG)
def test_wrong_monitors_are_named(monitors, word):
    orbit = bf.find_orbit(bf.systems.impact_oscillator(zeta=0.05, omega=0.6, amplitude=0.3))
    with pytest.raises(ValueError, match=word):
        bf.trace(orbit, "amplitude", bounds=(0.2, 0.6), monitors=monitors)


def test_whatever_a_watched_problem_makes_is_watched():
    """Each problem that the one inside makes, and that one: none is lost, none comes twice, none goes on unwatched."""
    class Watch(Watching):
        def around(self, inner):
            return Watch(inner, self.monitors[len(self.inner.monitors):])

    def plain(name, **more):
        return SimpleNamespace(name=name, monitors=(), **more)
    made = {name: plain(name) for name in ("less", "more", "fewer", "most", "again", "behind", "narrow")}
    inner = plain("inner", shaken=lambda: (1e-9, ((lambda: made["less"], lambda: made["more"]),
                                                  (lambda: made["fewer"], lambda: made["most"]))),
                  restarted=lambda x: made["again"], beyond_corner=lambda row: (made["behind"], row),
                  bounded=lambda low, high, done: made["narrow"] if done else inner)
    watch = Watch(inner, ["mine"])
    part, pairs = watch.shaken()
    found = [[make() for make in pair] for pair in pairs]
    assert part == 1e-9 and [[one.inner.name for one in pair] for pair in found] == [["less", "more"], ["fewer", "most"]]
    others = [watch.restarted(None), watch.beyond_corner(3)[0], watch.bounded(0.0, 1.0, True)]
    assert [one.inner.name for one in others] == ["again", "behind", "narrow"] and watch.beyond_corner(3)[1] == 3
    assert watch.bounded(0.0, 1.0, False) is watch
    assert all(one.monitors == ("mine",) for one in (*found[0], *found[1], *others))
