"""Guards on their surface whose series shows nothing: chains against modes and a bracketing root finder, decoupled masses."""
import time

import numpy as np
import pytest
from scipy.optimize import brentq

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.elements import ConstantForce, Coulomb, CubicSpring, ElasticStop, HarmonicForce, RigidStop
from bifurc.ensemble.integrator import Integrator

OMEGA = 1.87


def stiffness(n):
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    K[-1, -1] = 1.0
    return K


def chain(n, push, *contacts, damping=0.0):
    return bf.System(np.eye(n), damping * np.eye(n), stiffness(n), [*contacts, HarmonicForce(push, dof=n - 1)], omega=OMEGA)


def driven_from_rest(K, push):
    """Free motion from rest under push cos(omega t) on the last mass: q(t), by modes."""
    squares, modes = np.linalg.eigh(K)
    answer = push * modes[-1] / (squares - OMEGA**2)
    return lambda t: modes @ (answer * (np.cos(OMEGA * t) - np.cos(np.sqrt(squares) * t)))


def first_zero(function, latest, faint=1e-9):
    """First change of sign after the function has become larger than ``faint``."""
    times = np.linspace(0.0, latest, 20 * int(latest))
    values = np.array([function(t) for t in times])
    seen = int(np.argmax(np.abs(values) > faint))
    k = seen + int(np.argmax(np.sign(values[seen:]) != np.sign(values[seen])))
    return brentq(function, times[k - 1], times[k], xtol=1e-14)


@pytest.mark.parametrize("n", [5, 8, 9, 10, 17, 30, 60])
def test_a_mass_that_is_pushed_onto_its_stop_rests_there_until_it_is_let_go(n):
    """The reaction is the force of the neighbour, whose motion beside a held mass is known by modes."""
    motion = bf.simulate(chain(n, 1.5, RigidStop(gap=0.0, restitution=0.5)), np.zeros(2 * n), duration=1.1 * n + 8.0)
    neighbour = driven_from_rest(stiffness(n)[1:, 1:], 1.5)
    assert motion.success and motion.modes[0][0] == "rest"
    assert motion.y[:, 0].max() <= 1e-11
    event = motion.events[0]
    assert event.kind == "release" and event.time == pytest.approx(first_zero(lambda t: neighbour(t)[0], 1.1 * n + 8.0), abs=1e-9)


@pytest.mark.parametrize("contact", [RigidStop(gap=0.0, restitution=0.5), ElasticStop(gap=0.0, stiffness=3.0)])
@pytest.mark.parametrize("n", [8, 9, 12, 30, 60])
def test_a_mass_that_is_pulled_off_its_stop_hits_it_when_it_returns(n, contact):
    motion = bf.simulate(chain(n, -1.5, contact), np.zeros(2 * n), duration=1.1 * n + 8.0)
    free = driven_from_rest(stiffness(n), -1.5)
    assert motion.success and motion.modes[0][0] == "free"
    event = motion.events[0]
    assert event.kind in ("impact", "contact")
    assert event.time == pytest.approx(first_zero(lambda t: free(t)[0], 1.1 * n + 8.0), abs=1e-9)


@pytest.mark.parametrize("n", [7, 9, 24])
def test_an_elastic_stop_acts_from_the_first_instant(n):
    """Pushed into it the motion is that of a chain with the spring of the stop."""
    motion = bf.simulate(chain(n, 1.5, ElasticStop(gap=0.0, stiffness=3.0)), np.zeros(2 * n), duration=1.1 * n + 8.0)
    K = stiffness(n)
    K[0, 0] += 3.0
    sprung = driven_from_rest(K, 1.5)
    assert motion.modes[0][0] == "contact"
    first = motion.events[0].time
    assert first == pytest.approx(first_zero(lambda t: sprung(t)[0], 1.1 * n + 8.0), abs=1e-9)
    np.testing.assert_allclose(motion(0.99 * first)[:n], sprung(0.99 * first), atol=1e-11)


@pytest.mark.parametrize("side", [1, -1])
def test_stops_on_both_sides_hold_from_the_start(side):
    """No gap on either side: the mass never moves, the rest of the chain as beside a held mass."""
    n = 11
    motion = bf.simulate(chain(n, 1.5 * side, RigidStop(gap=0.0, restitution=0.5), RigidStop(gap=0.0, restitution=0.5, side=-1)),
                         np.zeros(2 * n), periods=8)
    assert motion.success
    np.testing.assert_allclose(motion.y[:, 0], 0.0, atol=1e-12)
    np.testing.assert_allclose(motion.final[1:n], driven_from_rest(stiffness(n)[1:, 1:], 1.5 * side)(motion.stop), atol=1e-10)


@pytest.mark.parametrize("push", [1.5, -1.5])
def test_friction_that_is_loaded_to_its_limit_gives_way_when_the_wave_arrives(push):
    """A constant load equals the limit of stick: the mass begins to slip only where the wave adds to it."""
    n, limit = 10, 0.25
    system = chain(n, push, Coulomb(limit), ConstantForce(limit))
    motion = bf.simulate(system, np.zeros(2 * n), duration=14.0)
    held = driven_from_rest(stiffness(n)[1:, 1:], push)
    assert motion.success
    assert motion.modes[0][0] == ("slip+" if push > 0.0 else "stick")
    if push < 0.0:
        t = first_zero(lambda t: held(t)[0], 14.0)
        first = next(e for e in motion.events)
        assert first.kind == "slip" and first.time == pytest.approx(t, abs=1e-9)


@pytest.mark.parametrize("n", [4, 6, 9])
def test_beside_a_law_the_sign_is_that_of_the_motion(n):
    """A cubic spring at the driven mass: it does not change which way the wave pushes the other end."""
    for push, mode in ((1.5, "rest"), (-1.5, "free")):
        system = chain(n, push, RigidStop(gap=0.0, restitution=0.5), CubicSpring(0.3, dof=n - 1))
        motion = bf.simulate(system, np.zeros(2 * n), periods=4)
        assert motion.success and motion.modes[0][0] == mode
        assert motion.y[:, 0].max() <= 1e-9 and motion.events


def test_a_decoupled_mass_rests_on_its_stop_for_ever():
    """Zero by structure: no events, and no time lost beside the same chain without it."""
    n = 8
    K = np.zeros((n, n))
    K[1:, 1:] = stiffness(n - 1)
    K[0, 0] = 2.0
    spent = []
    for contacts in ((), (RigidStop(gap=0.0, restitution=0.5),)):
        system = bf.System(np.eye(n), 0.02 * np.eye(n), K, [*contacts, HarmonicForce(1.5, dof=n - 1)], omega=OMEGA)
        bf.simulate(system, np.zeros(2 * n), periods=1)
        begun = time.perf_counter()
        motion = bf.simulate(system, np.zeros(2 * n), periods=200)
        spent.append(time.perf_counter() - begun)
        assert motion.success and not len(motion.events) and not motion.y[:, 0].any()
    assert spent[1] < 4.0 * spent[0] + 0.2


def test_twins_that_touch_and_move_alike_have_no_events():
    """Zero by symmetry, which rounding may disturb: equal masses under equal loads neither strike nor part."""
    n = 12
    K = np.kron(np.eye(2), stiffness(6))
    touch = RigidStop(gap=0.0, restitution=0.5, row=(1.0, *[0.0] * 5, -1.0, *[0.0] * 5))
    loads = [HarmonicForce(1.5, dof=5), HarmonicForce(1.5, dof=11)]
    motion = bf.simulate(bf.System(np.eye(n), 0.02 * np.eye(n), K, [touch, *loads], omega=OMEGA), np.zeros(2 * n), periods=10)
    assert motion.success and not len(motion.events)


@pytest.mark.parametrize("share", [0.3, 0.7])
def test_a_motion_on_the_surface_may_be_begun_anew(share):
    """Restarted before the wave is back, the contact lets go when it does without the stop between."""
    n, system = 14, chain(14, 1.5, RigidStop(gap=0.0, restitution=0.5))
    whole = bf.simulate(system, np.zeros(2 * n), duration=22.0)
    cut = share * whole.events[0].time
    first = bf.simulate(system, np.zeros(2 * n), duration=cut)
    second = bf.simulate(system, first.final, duration=22.0 - cut, t0=cut)
    assert second.success
    late = [e for e in second.events if e.time > whole.events[0].time - 1e-6]
    assert late[0].time == pytest.approx(whole.events[0].time, abs=1e-8)
    np.testing.assert_allclose(second.final, whole.final, atol=1e-7)


def test_basins_begin_on_the_surface_as_motions_do():
    """Starts of a chain of three on its stop, carried by the integrators of many starts and by simulation."""
    for n in (3, 5, 9):
        system = chain(n, 1.5, RigidStop(gap=0.0, restitution=0.5), damping=0.1)
        starts = np.zeros((2, 2 * n))
        starts[1, 1] = -0.1
        found = Integrator(scene_of(system), 400).propagate(starts.copy(), 3)
        for start, end in zip(starts, found.ends, strict=True):
            motion = bf.simulate(system, start, periods=3)
            np.testing.assert_allclose(end, motion.final, atol=1e-9)
