"""How states come to their modes: put on surfaces, kicked past them, brought to rest together; closed forms of the mechanics."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.elements import ConstantForce, Coulomb, CubicSpring, HarmonicForce, Jenkins, RigidStop
from bifurc.flow import settle

M = np.array([[1.0, 0.3], [0.3, 2.0]])
PAIR = bf.System(M, np.zeros((2, 2)), [[2.0, -0.5], [-0.5, 1.0]],
                 [HarmonicForce(0.5), RigidStop(0.4, 0.6), RigidStop(0.7, 0.8, dof=1, side=-1)], omega=1.1)


def joined(scene, y, t=0.0):
    return np.concatenate([y, scene.forcing(np.array([t]))[0]]) if scene.nw > 1 else np.append(y, 1.0)


@pytest.mark.parametrize("speed", [1.0, 1e7, 1e13])
def test_a_plastic_impact_however_fast_ends_at_rest(speed):
    """What is left of a speed is the rounding of that before: behind the impact nothing there is as large."""
    loaded = [ConstantForce(3.0), ConstantForce(-0.3, dof=1)]
    scene = scene_of(bf.System(M, 0.01 * M, PAIR.stiffness, [*loaded, RigidStop(0.4, 0.0, row=(0.7, 0.1)), Coulomb(0.5, dof=1)]))
    m = scene.index(("always", "always", "free", "stick"))
    (g,) = scene.guards_of(m, 2)
    for share in (1.0, 1.1, 1.3, 1.7, 1.9):
        x = joined(scene, [0.4 / 0.7, 0.0, share * speed, 0.0])
        after, z = settle.decide(scene, m, g, x, 0.7 * share * speed)
        assert scene.keys[after][2] == "rest" and abs(0.7 * z[2] + 0.1 * z[3]) < 1e-14 * speed


@pytest.mark.parametrize("speed", [1.0, 1e7, 1e13])
def test_an_impact_that_stops_everything_leaves_rest(speed):
    """Speeds along what the impulse changes: only the rounding of all is left, which holds the stop and lets friction stick."""
    rows = np.array([0.7, 0.1])
    scene = scene_of(bf.System(M, 0.01 * M, PAIR.stiffness, [ConstantForce(3.0), RigidStop(0.4, 0.0, row=tuple(rows)),
                                                             Coulomb(5.0, dof=1)]))
    for share in (1.0, 1.1, 1.3, 1.7, 1.9):
        v = share * speed * np.linalg.solve(M, rows)
        m = scene.index(("always", "free", "slip+" if v[1] > 0.0 else "slip-"))
        (g,) = scene.guards_of(m, 1)
        after, z = settle.decide(scene, m, g, joined(scene, [0.4 / 0.7, 0.0, *v]), float(rows @ v))
        assert scene.keys[after] == ("always", "rest", "stick") and np.abs(z[2:4]).max() < 1e-14 * speed


def test_how_far_a_start_lies_beyond_a_ring_is_its_distance_from_the_wall():
    """Of a ring anywhere: a point 3, 4 from the middle of one of radius 4.8 is .2 beyond it."""
    ring = bf.elements.RigidStator(centre_x=-2.0, centre_y=0.5, radius=4.8)
    scene = scene_of(bf.System(np.eye(2), 0.1 * np.eye(2), np.eye(2), [ring]))
    m = scene.index(("free",))
    (g,) = scene.guards_of(m, 0)
    for x, y, beyond in ((1.0, 4.5, 0.2), (1.0, -3.5, 0.2), (-2.0, 6.5, 1.2)):
        assert settle._depth(scene, m, g, joined(scene, [x, y, 0.0, 0.0])) == pytest.approx(beyond, abs=1e-14)


def test_a_start_beyond_a_surface_by_rounding_is_put_on_it():
    """By no more than that: a little further is in the stop, and said."""
    scene = scene_of(PAIR)
    for away, speed in ((2e-15, -0.3), (1e-13, -0.3), (1e-11, -0.3)):
        m, y = settle.start(scene, joined(scene, [0.4 + away, 0.1, speed, 0.0]))
        assert scene.keys[m] == ("always", "free", "free")
        assert y[0] <= 0.4 + 3e-15 and y[2:4].tolist() == [speed, 0.0]
        moved = M @ (y[:2] - [0.4 + away, 0.1])  # as an impulse would, and no more than that
        assert moved[1] == pytest.approx(0.0, abs=1e-16) and abs(y[0] - 0.4) < 1e-13
    m, y = settle.start(scene, joined(scene, [0.4 - 1e-11, 0.1, -0.3, 0.0]))
    assert y[0] == 0.4 - 1e-11  # on the free side it stays where it is
    with pytest.raises(settle.Penetration, match="y0 lies 1e-05 beyond the stop 'rigid_stop'"):
        settle.start(scene, joined(scene, [0.4 + 1e-5, 0.1, -0.3, 0.0]))
    m, _ = settle.start(scene, joined(scene, [0.4, 0.1, 0.3, 0.0]))  # it arrives: the event itself
    assert scene.keys[m] == ("always", "free", "free")


def test_what_is_pressed_on_a_stop_without_speed_rests_there():
    """Or leaves: as the force on the mass, with all that couples, says."""
    for push, key in ((3.0, "rest"), (-3.0, "free")):
        scene = scene_of(bf.System(1.0, 0.1, 1.0, [ConstantForce(push), RigidStop(0.4, 0.6)]))
        m, y = settle.start(scene, joined(scene, [0.4, 0.0]))
        assert scene.keys[m][-1] == key and y[:2].tolist() == [0.4, 0.0]


@pytest.mark.parametrize("speed", [0.9, 1e-3])
def test_a_kick_is_an_impulse_along_its_stop(speed):
    """-r times the arrival; what couples through the mass matrix moves along, the momentum across the stop stays."""
    scene, T = scene_of(PAIR), scene_of(PAIR).tables
    m = scene.index(("always", "free", "free"))
    for dof, side, gap, r in ((0, 1.0, 0.4, 0.6), (1, -1.0, 0.7, 0.8)):
        y = np.array([0.1, 0.2, -0.4, 0.25])
        y[dof], y[2 + dof] = side * gap, side * speed
        g = next(g for g in range(T.n_guards[m]) if T.G[m, g, dof] != 0.0)
        after, z = settle.decide(scene, m, g, joined(scene, y, 0.3), speed)
        assert after == m and z[:2] == pytest.approx(y[:2], abs=1e-15)
        assert z[2 + dof] == pytest.approx(-r * y[2 + dof], rel=1e-12)
        impulse = M @ (z[2:4] - y[2:4])
        assert impulse[1 - dof] == pytest.approx(0.0, abs=1e-14) and side * impulse[dof] < 0.0


def test_all_that_touch_come_to_rest_on_each_other():
    """Velocities are projected by inertia: impulses act on the masses that touch, the other keeps its momentum."""
    pressed = bf.System(M, np.zeros((2, 2)), PAIR.stiffness, [ConstantForce(9.0), ConstantForce(-9.0, dof=1), *PAIR.elements[1:]])
    scene = scene_of(pressed)
    T, m = scene.tables, scene.index(("always", "always", "free", "free"))
    first, second = (next(g for g in range(T.n_guards[m]) if T.G[m, g, dof] != 0.0) for dof in (0, 1))
    for g, y, keys, touching in ((first, [0.4, 0.0, 1e-9, 0.5], ("rest", "free"), [0]),
                                 (second, [0.0, -0.7, 0.5, -1e-9], ("free", "rest"), [1]),
                                 (first, [0.4, -0.7, 1e-9, 1e-9], ("rest", "rest"), [0, 1])):
        x = joined(scene, y)
        after, z = settle.come_to_rest(scene, m, g, x, 1e-9)
        assert scene.keys[after][2:] == keys and np.array_equal(z[:2], x[:2])
        impulse = M @ (z[2:4] - x[2:4])
        for dof in (0, 1):
            assert (z[2 + dof] if dof in touching else impulse[dof]) == pytest.approx(0.0, abs=1e-15)


def test_the_rate_of_a_guard_and_its_rounding(rng):
    """Along the flow, forcing included; rounding grows with the terms and not with what they leave of each other."""
    scene = scene_of(bf.System(1.0, 0.2, 3.0, [HarmonicForce(0.5), Coulomb(0.3), RigidStop(0.8, 0.5)], omega=1.7))
    rule, T = settle.Rule(scene), scene.tables
    for t in (0.0, 0.4, 2.0):
        u, v = rng.normal(size=2)
        for key, friction in (("slip+", -0.3), ("slip-", 0.3)):
            m = scene.index(("always", key, "free"))
            x = joined(scene, [u, v], t)
            acceleration = 0.5 * np.cos(1.7 * t) - 0.2 * v - 3.0 * u + friction
            for g in range(T.n_guards[m]):
                row = T.G[m, g]
                found, rounding = rule.rate(m, g, x)
                assert found == pytest.approx(row[0] * v + row[1] * acceleration, abs=1e-13)
                assert 0.0 < rounding < 1e-10
                _, large = rule.rate(m, g, joined(scene, [1e6 * u, 1e6 * v], t))
                assert large > 1e4 * rounding
            # where the forces are in balance the rate of the speed is that of rounding, which is not nothing
            y = joined(scene, [(0.5 * np.cos(1.7 * t) - 0.2 * 30.0 + friction) / 3.0, 30.0], t)
            still = [rule.rate(m, g, y) for g in range(T.n_guards[m]) if T.G[m, g, 1] and not T.G[m, g, 0]]
            assert still and all(abs(found) <= rounding and rounding > 1e-15 for found, rounding in still)
    # stuck: the force that friction must bear changes with the excitation and with nothing else
    m = scene.index(("always", "stick", "free"))
    x = joined(scene, [0.05, 0.0], 0.4)
    own = [g for g in range(T.n_guards[m]) if scene.guard(m, g).element == 1]
    rise = np.array([rule.rate(m, g, x)[0] for g in own])
    assert np.abs(rise) == pytest.approx([0.5 * 1.7 * np.sin(1.7 * 0.4)] * 2, abs=1e-12) and rise[0] * rise[1] < 0.0


def test_the_rounding_of_a_rate_is_that_of_a_law_as_well():
    """A slip whose speed changes by -u^3: known to the rounding of that."""
    scene = scene_of(bf.System(1.0, 0.2, 3.0, [HarmonicForce(0.5), Coulomb(0.3), CubicSpring(1.0)], omega=1.7))
    rule, m = settle.Rule(scene), scene.index(("always", "slip+", "always"))
    (g,) = (g for g in scene.guards_of(m, 1) if scene.tables.G[m, g, 1])
    for u in (1e2, 1e4):
        found, rounding = rule.rate(m, g, joined(scene, [u, 0.1]))
        assert abs(found) == pytest.approx(u**3, rel=0.1) and 2e-16 * u**3 < rounding < 1e-9 * u**3


@pytest.mark.parametrize("memory, known", [(0.0, 0.85), (0.9, 0.9), (1.05, 1.05), (2.0, 1.15), (-3.0, 0.85)])
def test_an_overloaded_slider_has_slipped(memory, known):
    """Spring 2, limit .3, at u = 1: its grip is within .15 of the mass."""
    scene = scene_of(bf.System(1.0, 0.1, 1.0, [HarmonicForce(), Jenkins(2.0, 0.3)], omega=1.0))
    x = joined(scene, [1.0, 0.0, memory])
    given = x.copy()
    found = settle.unloaded(scene, x)
    assert found[2] == pytest.approx(known, abs=1e-14) and np.array_equal(np.delete(found, 2), np.delete(given, 2))
    assert np.array_equal(x, given)


def test_sizes_of_a_state_are_its_own_and_amplitudes_of_forcing():
    x = np.array([-3.0, 0.0, 0.5, 1.0, 0.2, -0.4])
    np.testing.assert_allclose(settle.plain(x, 3), [3.0, 0.0, 0.5, 1.0, 1.0, 1.0], rtol=0, atol=1e-300)


def test_what_a_guard_asks_for_is_tried_before_what_was():
    """Keys of its `then` in their order, the present one, and what another event brings in; of several elements every pair, those
    of the last one fastest."""
    scene = scene_of(bf.System(1.0, 0.1, 1.0, [HarmonicForce(0.7), Coulomb(0.3), Jenkins(2.0, 0.4)], omega=1.3))
    m, x = scene.index(("always", "slip+", "stick")), joined(scene, [0.1, 0.0, 0.05])
    (turns,), ends = scene.guards_of(m, 1), list(scene.guards_of(m, 2))
    asked = list(scene.guard(m, turns).guard.then)
    assert "slip+" not in asked and len(asked) >= 2

    def tried(joined_, further=None):
        return [scene.keys[mode][1:] for mode in settle._combinations(scene, m, joined_, further or {}, {}, x)]
    assert tried({1: [turns]}) == [(key, "stick") for key in (*asked, "slip+")]
    slips = [key for g in ends for key in scene.guard(m, g).guard.then]
    assert len(slips) == 2 and tried({2: ends}) == [("slip+", key) for key in (*slips, "stick")]
    assert tried({2: ends[:1]}, {2: {slips[1]: None}}) == [("slip+", key) for key in (slips[0], "stick", slips[1])]
    assert tried({1: [turns], 2: ends[:1]}) == [(a, b) for a in (*asked, "slip+") for b in (slips[0], "stick")]
    assert tried({1: []}) == [("slip+", "stick")]


def test_a_slider_starts_in_slip_at_its_limit_only():
    """A mass is pressed on its stop, but would not be if a slider pulled with its limit: it pulls by its spring, and neither begins
    to slip, with another memory, nor takes the mass off its stop."""
    system = bf.System(np.eye(2), 0.1 * np.eye(2), [[2.0, -0.5], [-0.5, 2.0]], [
        HarmonicForce(0.3), ConstantForce(-1.1, dof=1), RigidStop(0.0, 0.5, side=-1, dof=1), Jenkins(1.0, 1.0, row=(1.0, -1.0))],
        omega=1.1)

    def motion(pull):
        return bf.simulate(system, (0.3, 0.0, 0.2, 0.0, 0.3 - pull), periods=0.01)
    stuck = motion(0.9)  # .9 and .15 from the spring between the masses against 1.1
    assert not stuck.events and stuck.final[4] == 0.3 - 0.9 and stuck.final[1] == 0.0
    for pull in (1.0, 1.3):  # at its limit, and moving on; an overloaded one has slipped
        slips = motion(pull)
        assert slips.final[0] - slips.final[1] - slips.final[4] == pytest.approx(1.0, abs=1e-12) and slips.final[1] > 0.0


def test_reasons_name_the_element_and_what_it_forbids():
    """Beyond a surface, on it and about to pass it, held but moving, held short of its place: of a stop and of friction."""
    scene = scene_of(bf.System(np.eye(2), np.eye(2), np.eye(2), [RigidStop(0.3, 0.5, label="stop"),
                                                                  Coulomb(1.0, dof=1, label="pad")]))

    def said(keys, q, v):
        m, x = scene.index(keys), np.array([*q, *v, 1.0])
        return settle._say(scene, m, settle.Rule(scene).broken(m, x, settle.Rule(scene).sizes(m, x)))
    free, rest = ("free", "slip+"), ("rest", "slip+")
    assert said(free, (0.5, 0.0), (0.0, 1.0)) == f"{free}: stop is past its impact"
    assert said(free, (0.3, 0.0), (1.0, 1.0)) == f"{free}: stop is about to pass its impact"
    assert said(free, (0.0, 0.0), (0.0, -1.0)) == f"{free}: pad is past its {scene.event_kind(scene.index(free), 1)}"
    assert "stop is not at rest" in said(rest, (0.3, 0.0), (0.2, 1.0)) and "pad" not in said(rest, (0.3, 0.0), (0.2, 1.0))
    assert settle._say(scene, 0, [("memory", 1), ("hold", 0)]).endswith(": pad is not at its limit, stop is not at rest")
