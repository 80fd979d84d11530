"""Conditions of orbits and states of rest, in closed form: reversals that do not stick, what circles hold, intervals."""
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.elements import Coulomb, ElasticStop, HarmonicForce, RigidStator, Stribeck
from bifurc.elements.friction.dry import SLIP_DOWN, SLIP_UP, STICK
from bifurc.orbits import least
from bifurc.orbits.shooting import refused
from bifurc.orbits.shooting.births import curved_rests
from bifurc.orbits.shooting.refused import Refusal, earlier_modes, proportional
from bifurc.orbits.shooting.signature import Signature

# reversals of slip

W, F, MU = 1.4, 2.0, 0.3


def sliding(static, phase=0.0):
    orbit = bf.find_orbit(bf.System(1.0, 0.1, 1.0, (HarmonicForce(F, phase=phase), Coulomb(MU, static_ratio=static)), omega=W),
                          closure=1)
    assert orbit.success and len(orbit.events) == 2
    return orbit


@pytest.mark.parametrize("static", [1.0, 1.5])
def test_stick_is_tried_before_a_reversal_and_refused_by_what_pulls_beyond_its_limit(static):
    """The force on the mass at rest is that of load and spring; its excess over static friction is the margin."""
    orbit = sliding(static, 0.4)
    scene = orbit.scene
    whole, U = orbit._whole
    found = earlier_modes(scene, whole)
    stick = scene.index((scene.keys[0][0], STICK))
    assert [one.mode for one in found] == [stick, stick] and [one.node for one in found] == [0, 1]
    assert all(set(one.guards) == set(scene.guards_of(stick, 1)) for one in found)
    e = orbit.equations
    refusal = Refusal(e, found, 0.0)
    assert bool(refusal) is (static > 1.0)  # where both limits are one, the rate behind the reversal says the same
    if static == 1.0:
        assert refusal.worst(np.append(orbit.unknowns, 0.0)) == -np.inf
        return
    row = np.array([1.0, 0.1])  # of a guard: spring and dashpot
    scale = row @ orbit.weights
    margins = []
    for time, x, v in U.reshape(-1, 3):
        assert v == pytest.approx(0.0, abs=1e-12)
        margins.append((static * MU - abs(F * np.cos(2.0 * np.pi * time + 0.4) - x)) / scale)
    assert refusal.worst(np.append(orbit.unknowns, 0.0)) == pytest.approx(max(margins), rel=1e-9) and max(margins) < 0.0
    near = orbit.unknowns.copy()
    near[1::3] = [F * np.cos(2.0 * np.pi * t + 0.4) for t in near[::3]]  # nothing pulls: it sticks
    assert refusal.worst(np.append(near, 0.0)) == pytest.approx(static * MU / scale, rel=1e-9)
    assert refusal.on(e).earlier is refusal.earlier


def test_only_modes_that_hold_and_come_before_the_listed_one_are_earlier():
    scene = sliding(1.5).scene
    up, stick, down = (scene.index((scene.keys[0][0], key)) for key in (SLIP_UP, STICK, SLIP_DOWN))
    lets_go = next(g for g in scene.guards_of(stick, 1) if up in scene.expand(stick, g).then[stick, g].tolist()[:1])

    def listed(*nodes):
        rows = np.zeros((len(nodes), 5), np.int64)
        rows[:, :3] = nodes
        return earlier_modes(scene, Signature(rows, np.zeros(len(nodes)), 1.0))
    assert listed((up, 0, stick), (stick, lets_go, up)) == []  # it sticks; it lets go: nothing that holds is tried before
    assert [(one.node, one.mode) for one in listed((up, 0, stick), (up, 0, down))] == [(1, stick)]
    assert listed((up, -1, up)) == []


def test_where_another_contact_changes_with_it_the_mode_of_the_listed_key_is_none_that_comes_before():
    K = np.array([[2.0, -1.0], [-1.0, 2.0]])
    scene = scene_of(bf.System(np.eye(2), 0.1 * K, K, (HarmonicForce(2.0), Coulomb(0.3), Coulomb(0.4, dof=1)), omega=W))
    before, both, turned = (scene.index((scene.keys[0][0], *keys)) for keys in (
        (SLIP_UP, SLIP_UP), (STICK, SLIP_DOWN), (SLIP_DOWN, SLIP_DOWN)))
    guard = scene.guards_of(before, 1)[0]

    def listed(after):
        return earlier_modes(scene, Signature(np.array([[before, guard, after, 0, 0]]), np.zeros(1), 1.0))
    assert listed(both) == []
    assert [scene.keys[one.mode][1:] for one in listed(turned)] == [(STICK, SLIP_UP)]


@pytest.mark.parametrize("belt", [0.0, 0.3, -0.2])
def test_friction_that_grows_toward_rest_leaves_no_other_condition_wherever_the_belt_goes(belt):
    """Its limit of stick is that of slip at rest relative to the belt: the rate behind the reversal is what pulls beyond it there,
    and at no other speed."""
    falling = Stribeck(kinetic=0.2, static=0.3, speed=0.4, belt_speed=belt)
    orbit = bf.find_orbit(bf.System(1.0, 0.1, 1.0, (HarmonicForce(F), falling), omega=W), closure=1)
    found = earlier_modes(orbit.scene, orbit._whole[0])
    assert orbit.success and len(found) == 2 and not Refusal(orbit.equations, found, 0.0)


def test_a_condition_is_another_one_times_a_constant():
    a = np.array([1.0, -2.0, 0.5])
    assert proportional(a, -3.0 * a) and proportional(a, 1e-9 * a) and not proportional(a, a + [0.0, 0.0, 1e-3])
    assert not proportional(a, np.zeros(3)) and refused.ONE < 1e-3**2 / 5.0


# circles

@pytest.mark.parametrize("spin, surface", [(0.0, 0.0), (0.7, 0.0), (0.0, 1.3), (-0.4, 0.6)])
def test_what_a_circle_holds_and_its_gradient(spin, surface, rng):
    """Rolling: no radial speed, no sliding against the wall, which turns with the frame, and no depth."""
    M = np.diag([1.3, 1.3])
    made = RigidStator(radius=0.8, centre_x=0.2, centre_y=-0.1, surface_speed=surface, frame_spin=spin)
    scene = scene_of(bf.System(M, 0.1 * M, M, (HarmonicForce(1.0), made), omega=1.1))
    key = scene.keys[0][0]
    modes = {name: scene.index((key, name)) for name in ("free", "roll", "slip+")}
    x = np.concatenate([rng.normal(size=4), [1.0, 1.0, 0.0]])
    assert curved_rests(scene, modes["free"], x) == [] and len(curved_rests(scene, modes["slip+"], x)) == 2
    found = curved_rests(scene, modes["roll"], x)
    p, v = x[:2] - [0.2, -0.1], x[2:4]
    r = np.hypot(*p)
    radial, tangential = p @ v / r, (p[0] * v[1] - p[1] * v[0]) / r
    np.testing.assert_allclose([value for value, _ in found], [radial, r - 0.8, tangential + surface + spin * r], atol=1e-13)
    for k in range(len(found)):
        for c in range(4):
            h = 1e-6 * np.eye(7)[c]
            slope = (curved_rests(scene, modes["roll"], x + h)[k][0] - curved_rests(scene, modes["roll"], x - h)[k][0]) / 2e-6
            assert found[k][1][c] == pytest.approx(slope, abs=1e-8)
        assert not found[k][1][4:].any()
    centre = np.concatenate([[0.2, -0.1], v, x[4:]])
    assert all(np.isfinite(value) and np.isfinite(slope).all() for value, slope in curved_rests(scene, modes["roll"], centre))


# states of rest

def test_a_mass_may_rest_up_to_the_first_limit_on_either_side():
    """Friction holds it in [-.3, .3]; stops begin at .2 and .12, and at -.05 and -.25 on the other side."""
    stops = [ElasticStop(0.2, 3.0), ElasticStop(0.12, 2.0), ElasticStop(0.05, 3.0, side=-1), ElasticStop(0.25, 3.0, side=-1)]
    found = bf.find_equilibrium(bf.System(1.0, 0.1, 1.0, (Coulomb(0.3), *stops)), [0.02])
    assert found.success and found.status == "continuum"
    assert found.intervals == {0: (pytest.approx(-0.05), pytest.approx(0.12))}
    free = bf.find_equilibrium(bf.System(1.0, 0.1, 1.0, (Coulomb(0.3),)), [0.02])
    assert free.intervals == {0: (pytest.approx(-0.3), pytest.approx(0.3))}


# the least period

class Listed:
    """An orbit over four periods, with events or without, that repeats after a number of them."""

    system, how, weights, scene = "system", {}, np.array([2.0, 0.5]), SimpleNamespace(ns=2)

    def __init__(self, after, events, off=0.0):
        times = [k + t for k in range(4) for t in (0.2, 0.7)] if events else [0.0]
        rows = np.array([[t, *self._state(t, after)] for t in times])
        rows[-1, 1] += off
        nodes = np.tile([[3, 0, 3, 0, 0], [3, 1, 3, 0, 0]], (4, 1)) if events else np.array([[3, -1, 3, 0, 0]])
        self.after, self.unknowns = after, rows.ravel()
        self.sequence = Signature(nodes, np.zeros(len(nodes)), 4.0)

    def _state(self, t, after):
        return np.cos(2.0 * np.pi * t / after + 0.3), np.sin(2.0 * np.pi * t / after)

    def _states(self, t):
        return np.array([self._state(s, self.after) for s in t])


@pytest.mark.parametrize("events", [False, True])
@pytest.mark.parametrize("after", [1, 2, 4])
def test_an_orbit_is_reduced_to_the_least_period_after_which_it_repeats(after, events, monkeypatch):
    monkeypatch.setattr(least, "solve", lambda system, signature, unknowns, weights, how: (signature, unknowns, how))
    monkeypatch.setattr(least, "divided", lambda scene, nodes: nodes)
    orbit = Listed(after, events)
    found = least.reduced(orbit)
    if after == 4:
        assert found is orbit
        return
    signature, unknowns, how = found
    count = 3 * 2 * after if events else 3
    assert signature.span == after and len(signature.nodes) == (2 * after if events else 1)
    assert unknowns.tolist() == orbit.unknowns[:count].tolist() and f"after {after} of 4 periods" in how["note"]
    if events:
        other = Listed(after, True, off=1e-6)
        assert least.reduced(other) is other
