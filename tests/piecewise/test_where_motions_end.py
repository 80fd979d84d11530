"""Where a motion of first order is not determined, or has no end of events, it ends with a status and the exact time."""
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.ensemble.integrator import Integrator
from bifurc.ensemble.outcomes import REACHED, STUCK

F, S, R = bf.AffineField, bf.AffineSurface, bf.AffineReset
STILL = np.zeros((2, 2))


def folded(a, b, c=0.0, scale=1.0, **switch):
    """Fields (1, a x), (1, b x) below and above y = c, in coordinates whose unit is ``scale``."""
    return bf.PiecewiseSystem("x y", {"-": F([[0.0, 0.0], [a, 0.0]], [scale, 0.0]), "+": F([[0.0, 0.0], [b, 0.0]], [scale, 0.0])},
                              [bf.Switch(S([0.0, 1.0], -c * scale), **switch)])


@pytest.mark.parametrize("scale", [1.0, 1e-6, 1e5])
@pytest.mark.parametrize(("a", "b", "x", "time"), [(-1.0, 1.0, -1.0, 1.0), (-3.0, 0.5, -2.5, 2.5), (-0.1, 7.0, -1e-3, 1e-3)])
def test_a_slide_ends_at_a_two_fold_of_visible_folds(a, b, x, time, scale):
    """l1 = a x and l2 = b x keep their ratio: the slide has a constant weight and speed, and ends at x = 0."""
    motion = bf.simulate(folded(a, b, scale=scale), (x * scale, 0.0), duration=5.0)
    assert motion.status == "two_fold" and motion.stop == pytest.approx(time, abs=1e-12) and not motion.success
    np.testing.assert_allclose(motion.final, 0.0, atol=1e-14 * scale)
    assert "two-fold" in motion.message


@pytest.mark.parametrize("c", [0.0, 0.7])
def test_behind_an_invisible_two_fold_motions_slide_for_ever(c):
    escaping = bf.simulate(folded(1.0, -1.0, c), (-1.0, c), duration=5.0)
    assert escaping.status == "escaping" and escaping.stop == 0.0
    motion = bf.simulate(folded(1.0, -1.0, c), (-1.0, c - 0.5), duration=5.0)
    [event] = motion.events
    assert motion.success and event.kind == "slide_begin" and event.before[0] == pytest.approx(math.sqrt(2.0), abs=1e-12)
    np.testing.assert_allclose(motion.final, [4.0, c], atol=1e-13)
    at_fold = bf.simulate(folded(1.0, -1.0, c), (0.0, c), duration=2.0)  # only the slide leads away
    assert at_fold.success and at_fold.final == pytest.approx([2.0, c], abs=1e-14)


@pytest.mark.parametrize("switch", [{}, {"sliding": False}])
@pytest.mark.parametrize(("a", "b", "x", "status"), [
    (-1.0, 1.0, 0.5, "escaping"), (-1.0, 1.0, 0.0, "two_fold"), (1.0, -1.0, -0.5, "escaping"), (1.0, 1.0, 0.5, "completed"),
    (1.0, 1.0, -0.5, "completed"), (1.0, 2.0, 0.0, "completed"), (-1.0, -2.0, 0.0, "completed")])
def test_a_start_on_the_surface_is_counted(a, b, x, status, switch):
    """Two regions may begin: escaping, at a two-fold of tangent fields; one: it goes on; with and without sliding."""
    motion = bf.simulate(folded(a, b, **switch), (x, 0.0), duration=0.25)
    assert motion.status == status and motion.stop == (0.25 if status == "completed" else 0.0)
    if motion.success and x:
        assert math.copysign(1.0, motion.final[1]) == math.copysign(1.0, (a + b) * x)


def test_a_start_at_a_fold_leaves_by_the_field_that_leads_away():
    """F1 is tangent at x = 0 and bends back (visible) or not (invisible); F2 leads away upwards."""
    def system(bend):
        return bf.PiecewiseSystem("x y", {"-": F([[0.0, 0.0], [bend, 0.0]], [1.0, 0.0]), "+": F(STILL, [1.0, 2.0])},
                                  [bf.Switch(S([0.0, 1.0]))])
    assert bf.simulate(system(-1.0), (0.0, 0.0), duration=1.0).status == "escaping"
    assert bf.simulate(system(1.0), (0.0, 0.0), duration=1.0).final == pytest.approx([1.0, 2.0])


def test_a_surface_that_all_fields_keep_has_one_motion():
    """A kink in y leaves y = 0 alone: both fields agree there."""
    system = bf.PiecewiseSystem("x y", {"-": F([[-1.0, 0.0], [0.0, 0.3]]), "+": F([[-1.0, 2.0], [0.0, 0.5]])},
                                [bf.Switch(S([0.0, 1.0]))])
    motion = bf.simulate(system, (1.0, 0.0), duration=1.0)
    assert motion.success and motion.final == pytest.approx([math.exp(-1.0), 0.0])


def test_two_surfaces_from_which_all_fields_leave():
    way = {"-": -1.0, "+": 1.0}
    system = bf.PiecewiseSystem("x y", {a + b: F(STILL, [way[a], way[b]]) for a in way for b in way},
                                [bf.Switch(S([1.0, 0.0])), bf.Switch(S([0.0, 1.0]))])
    assert {bf.simulate(system, start, duration=1.0).status for start in ((0.0, 0.0), (0.0, 1.0), (-1.0, 0.0))} == {"escaping"}
    assert bf.simulate(system, (0.1, -0.1), duration=1.0).final == pytest.approx([1.1, -1.1])


def test_basins_leave_escaping_cells_open():
    system = bf.PiecewiseSystem("x y", {"-": F(-np.eye(2), [0.0, -1.0]), "+": F(-np.eye(2), [0.0, 1.0])},
                                [bf.Switch(S([0.0, 1.0]))], omega=1.0)
    basins = bf.basins_of_attraction(system, bf.Grid(w0=(-1.0, 1.0, 3), w1=(-1.0, 1.0, 4)), seed=1)
    assert [basins.counts[k] for k in (0, 1)] == [6, 6]
    row = bf.basins_of_attraction(system, bf.Grid(w0=(-1.0, 1.0, 3), at={"w1": 0.0}), seed=1)
    assert (row.labels < 0).all()


@pytest.mark.parametrize(("friction", "slope", "speed"), [(0.3, 0.5, 0.4), (1.2, -0.3, 0.1), (0.7, 0.0, 2.0)])
def test_a_mass_sticks_to_a_belt_under_a_load_that_grows_with_it(friction, slope, speed):
    """Friction times the load 1 + slope x: a slide along v = speed ends where the spring is as strong, x = mu (1 + slope x)."""
    pull = [[0.0, 1.0], [-1.0 + friction * slope, 0.0]], [0.0, friction]
    brake = [[0.0, 1.0], [-1.0 - friction * slope, 0.0]], [0.0, -friction]
    system = bf.PiecewiseSystem("x v", {"-": F(*pull), "+": F(*brake)}, [bf.Switch(S([0.0, 1.0], -speed))])
    end = friction / (1.0 - friction * slope)
    motion = bf.simulate(system, (0.0, speed), duration=2.0 * end / speed)
    assert motion.modes[0] == ("slide",) and motion.events[0].kind == "slide_end"
    assert motion.events[0].time == pytest.approx(end / speed, rel=1e-12)


# infinitely many events

def ball(restitution, gravity=1.0):
    return bf.HybridSystem("x v", {"fly": F([[0.0, 1.0], [0.0, 0.0]], [0.0, -gravity])}, [
        bf.Jump("fly", S([-1.0, 0.0]), to="fly", reset=R([[1.0, 0.0], [0.0, -restitution]]))])


@pytest.mark.parametrize(("restitution", "gravity"), [(0.5, 1.0), (0.8, 1.0), (0.95, 9.81), (0.1, 1e-3)])
def test_a_ball_comes_to_the_end_of_its_impacts(restitution, gravity):
    """From height 1: sqrt(2/g) (1 + r)/(1 - r)."""
    end = math.sqrt(2.0 / gravity) * (1.0 + restitution) / (1.0 - restitution)
    motion = bf.simulate(ball(restitution, gravity), (1.0, 0.0), duration=2.0 * end)
    assert motion.status == "zeno" and motion.stop == pytest.approx(end, rel=1e-13) and f"{end:.8g}"[:8] in motion.message
    np.testing.assert_allclose(motion.final, 0.0, atol=1e-7)


@pytest.mark.parametrize(("inflow", "out", "start"), [(1.5, (1.0, 1.0), (1.0, 1.0)), (2.0, (1.0, 1.6), (0.3, 2.0)),
                                                      (0.5, (0.4, 0.45), (1.0, 0.1))])
def test_two_tanks_are_empty_at_a_time(inflow, out, start):
    """The hose goes to the tank that runs dry: levels fall by out - inflow together, and are 0 at once."""
    tanks = bf.HybridSystem("x y", {"one": F(STILL, [inflow - out[0], -out[1]]), "two": F(STILL, [-out[0], inflow - out[1]])}, [
        bf.Jump("one", S([0.0, -1.0]), to="two"), bf.Jump("two", S([-1.0, 0.0]), to="one")])
    motion = bf.simulate(tanks, start, duration=100.0)
    end = sum(start) / (sum(out) - inflow)
    assert motion.status == "zeno" and motion.stop == pytest.approx(end, rel=1e-12)


def test_thresholds_that_are_equal_end_with_the_list_of_modes():
    room = bf.HybridSystem("x", {"on": F([[0.0]], [1.0]), "off": F([[0.0]], [-1.0])},
                           [bf.Jump("on", S([1.0], -1.0), to="off"), bf.Jump("off", S([-1.0], 1.0), to="on")])
    motion = bf.simulate(room, (0.0,), duration=3.0)
    assert motion.status == "no_target" and motion.stop == pytest.approx(1.0) and "64 events" in motion.message
    assert "'off', 'on'" in motion.message


@pytest.mark.parametrize("where", [1.0, 1.5])
def test_a_reset_that_lands_on_its_own_guard_ends_with_the_list_of_modes(where):
    loop = bf.HybridSystem("x", {"up": F([[0.0]], [1.0])}, [bf.Jump("up", S([1.0], -1.0), to="up", reset=R([[0.0]], [where]))])
    motion = bf.simulate(loop, (0.0,), duration=3.0)
    assert motion.status == "no_target" and motion.stop == pytest.approx(1.0) and "to 'up'" in motion.message


def test_resets_of_one_instant_follow_each_other():
    """From 5 it is taken down by 1 until it is below 1: five resets at t = 5, counted by the second state."""
    steps = bf.HybridSystem("x n", {"up": F(STILL, [1.0, 0.0]), "down": F(STILL, [1.0, 0.0])}, [
        bf.Jump("up", S([1.0, 0.0], -5.0), to="down"),
        bf.Jump("down", S([1.0, 0.0], -1.0), to="down", reset=R(np.eye(2), [-1.0, 1.0]))])
    motion = bf.simulate(steps, (0.0, 0.0), duration=5.5)
    assert motion.success and motion.final == pytest.approx([0.5, 5.0]) and len(motion.events) == 6


def test_images_of_cells_do_not_end_in_a_two_fold():
    """Slides come to (0, 0) after the time -x; beside the surface motions go on: y = x^2/2 above it."""
    fields = {side: F([[0.0, 0.0], [slope, 0.0]], [1.0, 0.0]) for side, slope in (("-", -1.0), ("+", 1.0))}
    clocked = bf.PiecewiseSystem("x y", fields, [bf.Switch(S([0.0, 1.0]))], omega=2.0 * np.pi)
    starts = np.array([[-0.5, 0.0], [-1.5, 0.0], [-0.5, 1.0], [0.5, 0.3], [0.5, 0.0]])
    integrator = Integrator(scene_of(clocked), 500)
    for periods, ended in ((1, [True, False, False, False, True]), (3, [True, True, False, False, True])):
        images = integrator.propagate(starts.copy(), periods)
        assert (images.outcomes == np.where(ended, STUCK, REACHED)).all()
        x, y = starts[2:4].T
        np.testing.assert_allclose(images.ends[2:4], np.array([x + periods, y + 0.5 * ((x + periods)**2 - x * x)]).T)
