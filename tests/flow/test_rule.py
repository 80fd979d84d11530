"""The rule at an event: coupled inertia, several contacts on one mass, many kicks at one instant."""
import itertools

import numpy as np
import pytest

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.compose.writer import kernels
from bifurc.elements import ConstantForce, Coulomb, ElasticStop, HarmonicForce, RigidStop
from bifurc.flow import scan
from bifurc.flow.engine import engine_of
from bifurc.flow.settle import Rule, decide

M = np.array([[1.0, 0.25], [0.25, 1.44]])
C = np.array([[0.11, -0.019], [-0.019, 0.11]])
K = np.array([[1.38, -0.38], [-0.38, 1.38]])


def stop_and_friction(mu, omega):
    return bf.System(M, C, K, (HarmonicForce(2.1), RigidStop(gap=0.12, restitution=0.0, dof=0), Coulomb(mu, dof=1)), omega=omega)


def time_stepping(mu, omega, duration, h):
    """Moreau's scheme for `stop_and_friction` from rest: plastic impacts and friction as impulses, Gauss-Seidel."""
    inverse = np.linalg.inv(M)
    q, v = np.zeros(2), np.zeros(2)
    for i in range(round(duration / h)):
        middle = q + 0.5 * h * v
        v = v + h * inverse @ (np.array([2.1 * np.cos(omega * (i + 0.5) * h), 0.0]) - C @ v - K @ middle)
        push = np.zeros(2)
        for _ in range(12):
            if middle[0] >= 0.12:
                change = max(0.0, push[0] + v[0] / inverse[0, 0]) - push[0]
                push[0] += change
                v = v - inverse[:, 0] * change
            change = np.clip(push[1] + v[1] / inverse[1, 1], -mu * h, mu * h) - push[1]
            push[1] += change
            v = v - inverse[:, 1] * change
        q = middle + 0.5 * h * v
    return np.concatenate([q, v])


@pytest.mark.parametrize(("mu", "omega"), list(itertools.product((0.4, 0.8, 1.2), (0.4, 0.7, 1.2))))
def test_coupled_inertia_with_a_stop_and_friction(mu, omega):
    """An impulse on one mass moves the other: friction lets go in the same instant, rest on the stop is rest to rounding."""
    motion = bf.simulate(stop_and_friction(mu, omega), np.zeros(4), periods=30)
    assert motion.success, motion.message
    assert motion.y[:, 0].max() <= 0.12 + 1e-14


def test_coupled_inertia_agrees_with_time_stepping():
    for mu, omega, duration in ((0.4, 0.5, 8.0), (0.8, 0.6, 6.0)):
        motion = bf.simulate(stop_and_friction(mu, omega), np.zeros(4), duration=duration)
        found = [time_stepping(mu, omega, duration, h) for h in (8e-4, 4e-4)]
        assert np.abs(found[1] - motion.final).max() < 4e-3
        assert any(event.kind == "impact" for event in motion.events)


def test_two_frictions_on_one_mass_are_one_with_the_sum_of_the_limits():
    """A mass between two surfaces: one of them holds it, the share of the two in the reaction is not unique, the motion is."""
    def system(*limits):
        return bf.System(1.0, 0.02, 1.0, (HarmonicForce(1.3), *(Coulomb(limit) for limit in limits)), omega=0.6)

    whole = bf.simulate(system(0.7), (0.4, 0.0), periods=6)
    for limits in ((0.5, 0.2), (0.2, 0.5), (0.1, 0.25, 0.35)):
        shared = bf.simulate(system(*limits), (0.4, 0.0), periods=6)
        assert shared.success
        t = np.linspace(0.0, shared.stop, 300)
        np.testing.assert_allclose(shared(t), whole(t), rtol=0, atol=1e-12)
    orbits = [bf.find_orbit(system(*limits)) for limits in ((0.7,), (0.5, 0.2))]
    assert all(orbit.success for orbit in orbits)
    assert abs(orbits[0].maximum(0) - orbits[1].maximum(0)) < 1e-12


def test_floor_and_belt_on_one_mass():
    """A belt that drags with .1 moves a mass on a floor of limit .3 once the load exceeds .2: v = .25 sin t - .2 t."""
    def system(load):
        return bf.System(1.0, 0.0, 0.0, (HarmonicForce(load), Coulomb(0.3), Coulomb(0.1, belt_speed=2.0)), omega=1.0)

    assert bf.simulate(system(0.15), (0.0, 0.0), periods=3).y.any() == np.False_
    t = 0.3
    moved = bf.simulate(system(0.25), (0.0, 0.0), duration=t).final
    np.testing.assert_allclose(moved, [0.25 * (1.0 - np.cos(t)) - 0.1 * t * t, 0.25 * np.sin(t) - 0.2 * t], rtol=0, atol=1e-15)


def test_infinitely_many_kicks_at_one_instant_end_in_rest():
    """A mass hits another one that touches a wall, all plastic: blow follows blow at one instant, until both are at rest."""
    stops = (RigidStop(gap=0.0, restitution=0.0, row=(1.0, -1.0)), RigidStop(gap=0.0, restitution=0.0, dof=1))
    for mass in (0.1, 1.0, 10.0):
        system = bf.System(np.diag([1.0, mass]), np.zeros((2, 2)), np.zeros((2, 2)), (ConstantForce(1e-3, dof=1), *stops))
        motion = bf.simulate(system, (-0.5, 0.0, 1.0, 0.0), duration=2.0)
        assert motion.success, motion.message
        np.testing.assert_allclose(motion.final, np.zeros(4), rtol=0, atol=1e-14)


def test_contacts_that_take_turns_come_to_rest_together():
    """A mass is pushed against another one that friction holds: each blow, of restitution e, lets that one slide and stick again.

    In closed form: a blow of speed v leaves the speeds a v and b v, the slide has the length m1 a^2 v^2 / (2 mu), the next blow the
    speed r v with r^2 = b^2 + F m1 a^2 / (mu m2).  Nothing here has a rate: the loads and the gap say which time is short.
    """
    counts = set()
    for unit in (1.0, 2.0**-30, 2.0**40):  # of time
        m1, m2, e, F, mu, gap, d = 1.0, 1.44, 0.7, 0.15 / unit**2, 0.8 / unit**2, 0.3, 0.2
        a, b = (1.0 + e) * m2 / (m1 + m2), (m2 - e * m1) / (m1 + m2)
        r = np.sqrt(b**2 + F * m1 * a**2 / (mu * m2))
        assert m1 * a / mu < (r - b) * m2 / F  # it sticks before it is hit again
        v = np.sqrt(2.0 * F * d / m2)
        slide = m1 * a**2 * v**2 / (2.0 * mu * (1.0 - r**2))
        end = v * m2 / F + (r - b) * m2 * v / (F * (1.0 - r))
        system = bf.System(np.diag([m1, m2]), np.zeros((2, 2)), np.zeros((2, 2)), (
            ConstantForce(F, dof=1), RigidStop(gap=gap, restitution=e, row=(-1.0, 1.0)), Coulomb(mu, dof=0)))
        motion = bf.simulate(system, (0.0, gap - d, 0.0, 0.0), duration=2.0 * end)
        assert motion.success, motion.message
        np.testing.assert_allclose(motion.final, [slide, slide + gap, 0.0, 0.0], rtol=0, atol=1e-12)
        last = motion.events[-1]
        assert last.kind == "chatter" and last.end == pytest.approx(end, rel=1e-11) and last.mode_after[1:] == ("rest", "stick")
        counts.add(len(motion.events))
    assert len(counts) == 1 and max(counts) < 60


@pytest.mark.parametrize("restitution", [0.5, 0.3])
def test_a_stack_comes_to_rest_after_as_many_impacts_in_any_unit_of_time(restitution):
    """A mass falls on a wall, another one on it: units that are powers of two leave all roundings as they are."""
    counts = set()
    for unit in (1.0, 2.0**-30, 2.0**40):
        loads = [ConstantForce(1.0 / unit**2), ConstantForce(1.5 / unit**2, dof=1)]
        stops = [RigidStop(gap=0.7, restitution=restitution), RigidStop(gap=0.3, restitution=restitution, row=(-1.0, 1.0))]
        motion = bf.simulate(bf.System(np.diag([1.0, 1.5]), np.zeros((2, 2)), np.zeros((2, 2)), [*loads, *stops]),
                             (0.4, 0.2, 0.0, 0.0), duration=10.0 * unit)
        assert motion.success and motion.events[-1].mode_after[2:] == ("rest", "rest")
        np.testing.assert_allclose(motion.final[:2], [0.7, 1.0], rtol=1e-15)
        np.testing.assert_allclose(motion.final[2:] * unit, 0.0, atol=1e-20)
        counts.add((len(motion.events), motion.events[-1].time / unit))
    assert len(counts) == 1


@pytest.mark.parametrize("unit", [1.0, 2.0**-30, 2.0**40])
def test_a_belt_takes_a_mass_along_in_any_unit_of_time(unit):
    """Neither a rate nor a length is known: the speed of the belt is reached at V / mu, uniformly accelerated."""
    belt, mu = 0.4 / unit, 0.1 / unit**2
    motion = bf.simulate(bf.System(1.0, 0.0, 0.0, (Coulomb(mu, belt_speed=belt),)), (0.0, 0.0), duration=10.0 * belt / mu)
    (event,) = motion.events
    assert event.kind == "stick" and event.time == pytest.approx(belt / mu, rel=1e-12)
    np.testing.assert_allclose(motion.final, [9.5 * belt**2 / mu, belt], rtol=1e-12)


def test_all_impacts_of_a_chattering_have_a_derivative_by_the_speed_of_the_first():
    """Coupled inertia lets a held friction slip in every impact: what all leave is quadratic in the speed of arrival."""
    scene = scene_of(bf.System(M, C, K, (ConstantForce(0.9), RigidStop(gap=0.12, restitution=0.6), Coulomb(0.5, dof=1))))
    m = scene.index(("always", "free", "stick"))
    (g,) = scene.guards_of(m, 1)
    kernels(scene, "bifurc.flow.chatter")  # the flight behind an impact slips: its modes are made when they are asked for
    for key in itertools.product(("free", "rest"), ("stick", "slip+", "slip-")):
        mode = scene.index(("always", *key))
        for k in range(scene.tables.n_guards[mode]):
            scene.expand(mode, k)
    rule, x = Rule(scene), np.array([0.12, 0.3, 0.2, 0.0, 1.0])

    def closed(x):
        xp, P = np.empty(5), np.empty((4, 5))
        rule._rule.jump(scene.tables, m, g, True, x, xp, P)
        return xp, P
    xp, P = closed(x)
    assert xp[1] != pytest.approx(0.3, abs=1e-4)  # it has slipped
    h = 1e-4
    found = (closed(x + [0.0, 0.0, h, 0.0, 0.0])[0] - closed(x - [0.0, 0.0, h, 0.0, 0.0])[0])[:4] / (2.0 * h)
    np.testing.assert_allclose(P[:, 2], found, rtol=0, atol=1e-10)


def test_a_mass_that_is_caught_says_so():
    """A wall that moves beyond the other one leaves no room: that is said, not a number of events."""
    walls = (RigidStop(gap=0.07, restitution=0.3, amplitude=0.14, harmonic=1), RigidStop(gap=0.0, restitution=0.0, side=-1))
    motion = bf.simulate(bf.System(1.0, 0.1, 1.0, (HarmonicForce(0.1), *walls), omega=1.0), (0.01, 0.0), periods=3)
    assert motion.status == "inconsistent"
    assert "caught between 'rigid_stop' and 'rigid_stop_2'" in motion.message


def test_a_second_stop_in_the_same_step_is_hit_too():
    """Two masses fly freely onto their stops, 1e-3 to 1e-12 one after the other: both impacts, in their order, at their time."""
    for late in (1e-3, 1e-6, 1e-12):
        for order in ((0, 1), (1, 0)):
            stops = tuple(RigidStop(gap=0.0, restitution=0.5, dof=dof) for dof in order)
            system = bf.System(np.eye(2), np.zeros((2, 2)), np.zeros((2, 2)), stops)
            motion = bf.simulate(system, (-0.1, -0.1 - late, 1.0, 1.0), duration=1.0)
            times = [event.time for event in motion.events]
            np.testing.assert_allclose(times, [0.1, 0.1 + late], rtol=1e-14)
            assert [event.element for event in motion.events] == [system.labels[order.index(dof)] for dof in (0, 1)]
            np.testing.assert_allclose(motion.final[2:], [-0.5, -0.5], rtol=1e-15)


def test_rest_is_told_by_the_rounding_of_the_terms():
    """A speed that is the rounding of what was added up counts as rest; one ten thousand times larger does not."""
    system = stop_and_friction(0.8, 0.6)
    scene, rule = scene_of(system), Rule(scene_of(system))
    mode = scene.index(("always", "rest", "stick"))
    x = np.concatenate([[0.12, 0.3, 0.0, 0.0], scene.forcing(np.array([2.0]))[0]])
    scale = rule.sizes(mode, x)
    for speed, held in ((2e-17, True), (2e-12, False)):
        x[2] = speed
        assert (("hold", 1) in rule.broken(mode, x, scale)) is not held


def test_the_mode_after_an_event_may_start_there():
    """The dashpot of a stop loads a friction that holds: whatever an event takes along, the mode its row tells may start."""
    elements = (HarmonicForce(1.0, dof=0), ElasticStop(gap=0.2, stiffness=5.0, damping=4.0, dof=0), Coulomb(0.5, row=(1.0, -1.0)))
    system = bf.System(np.eye(2), 0.02 * np.eye(2), np.eye(2), elements, omega=0.7)
    motion = bf.simulate(system, np.zeros(4), periods=4)
    assert motion.success and {"contact", "separation", "stick", "slip"} <= {event.kind for event in motion.events}
    scene, rule = scene_of(system), Rule(scene_of(system))
    for first, second in itertools.pairwise(motion.events):
        assert first.mode_after == second.mode_before
    for event in motion.events:
        x = np.concatenate([event.after, scene.forcing(np.array([event.time]))[0]])
        assert rule.broken(scene.index(event.mode_after), x, rule.sizes(scene.index(event.mode_after), x)) == []


@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.9])
def test_the_end_of_an_infinite_sequence_is_the_state_that_a_plastic_impact_leaves(restitution):
    """Coupled inertia: the row has no speed, and the impulse lies along it, whatever the restitution."""
    scene = scene_of(bf.System(M, C, K, (RigidStop(gap=0.12, restitution=restitution),)))
    rule = Rule(scene)
    x = np.array([0.12, 0.3, 0.8, -0.4, 1.0])
    xp, P = np.empty(5), np.empty((4, 5))
    rule._rule.jump(scene.tables, scene.index(("free",)), 0, True, x, xp, P)
    impulse = M @ (xp[2:4] - x[2:4])
    np.testing.assert_allclose([xp[2], impulse[1]], 0.0, rtol=0, atol=1e-15)
    np.testing.assert_allclose(xp[:2], x[:2], rtol=0, atol=0)


def test_rest_on_a_stop_forgets_place_and_speed_of_its_mass_alone():
    """All exponents of a mass that comes to rest on a plastic stop are -inf; a mass that nothing couples to it keeps its two."""
    plastic = bf.systems.impact_oscillator(zeta=0.05, omega=0.7, amplitude=0.6, gap=0.0, restitution=0.0)
    assert "release" in bf.find_orbit(plastic).signature
    assert np.isneginf(bf.lyapunov_exponents(plastic, periods=40, transient=20).values).all()
    pair = bf.System(np.eye(2), np.diag([0.1, 0.2]), np.eye(2), (HarmonicForce(0.6), RigidStop(0.0, 0.0)), omega=0.7)
    found = bf.lyapunov_exponents(pair, periods=40, transient=60)
    np.testing.assert_allclose(found.values[:2], -0.1, rtol=0, atol=0.02)
    assert np.isneginf(found.values[2:]).all()


@pytest.mark.parametrize("unit", [1.0, 1e-6, 1e-12])
def test_a_guard_passed_by_another_event_puts_nothing_right_in_any_unit(unit):
    """What an impact carried beyond the zero of a speed keeps that speed."""
    scene = scene_of(bf.System(1.0, 0.05, 1.0, (HarmonicForce(unit), Coulomb(0.2 * unit)), omega=1.3))
    mode = scene.index(("always", "slip+"))
    guard, = scene.guards_of(mode, 1)
    speed = 0.1 * unit * np.sign(scene.tables.G[mode, guard, 1])
    after, y = decide(scene, mode, guard, np.append([1.3 * unit, speed], scene.forcing(np.array([0.2]))[0]), 0.0)
    assert after == scene.index(("always", "slip-"))
    assert y[1] == pytest.approx(speed, rel=1e-12, abs=0.0)


@pytest.mark.parametrize("unit", [1.0, 1e-12])
def test_the_kernel_keeps_the_speed_that_another_event_carried_beyond_its_zero(unit):
    """It goes on where the joint rule may leave a motion: in slip, with a speed against it, and slip turns round at once."""
    scene = scene_of(bf.System(1.0, 0.05, 1.0, (HarmonicForce(unit), Coulomb(0.2 * unit)), omega=1.3))
    T, engine, mode = scene.tables, engine_of(scene), scene.index(("always", "slip+"))
    guard, = scene.guards_of(mode, 1)
    start = np.array([1.3 * unit, 0.1 * unit * np.sign(T.G[mode, guard, 1])])
    (ints, floats), x = engine.workspace(T), np.append(start, scene.forcing(np.array([0.2]))[0])
    ints[scan.MODE], floats[scan.TAU] = mode, 0.2
    rows, record = np.zeros((4, 5), np.int64), np.zeros((4, scan.STATE + 4))
    engine.run(T, ints, floats, x, 0, 0.2 + 1e-9, 10, rows, record)
    assert ints[scan.EVENTS] == 1 and scene.keys[rows[0, scan.AFTER]] == ("always", "slip-")
    assert record[0, scan.TIME] == 0.2
    for state in record[0, scan.STATE:].reshape(2, 2):
        np.testing.assert_allclose(state, start, rtol=1e-12)


@pytest.mark.parametrize("beyond", [1e-13, 1e-11, 9e-10])
def test_starts_beyond_a_stop_by_rounding_are_put_on_it(beyond):
    """On the stop, with the speed that they have; what is farther beyond is no start."""
    system = bf.systems.impact_oscillator(gap=1.0)
    motion = bf.simulate(system, (1.0 + beyond, -0.3), periods=1)
    np.testing.assert_allclose(motion.y[0], (1.0, -0.3), rtol=0, atol=4e-16)
    assert motion.y[:, 0].max() == motion.y[0, 0]
    with pytest.raises(ValueError, match="beyond the stop"):
        bf.simulate(system, (1.0 + 1e-8, -0.3), periods=1)


def carried(coupling, pull):
    """Return a mass on a floor of friction 1, static 1.5, that carries another one, which a constant force pulls back."""
    return bf.System(np.eye(2), np.zeros((2, 2)), np.zeros((2, 2)), (
        ConstantForce(-pull, dof=1), Coulomb(coupling, row=(1.0, -1.0)), Coulomb(1.0, static_ratio=1.5)), omega=1.0)


@pytest.mark.parametrize(("coupling", "pull"), [(1.2, 2.0), (1.4, 3.0), (1.2, 1.6), (0.5, 1.7)])
def test_what_stops_stays_where_another_friction_lets_go_of_what_pulls_at_it(coupling, pull):
    """Both slide with speed 1 and stop together.  The floor could not hold both, but the upper one slides back: what its friction
    passes on is within the static limit of the floor, so that the lower one stays, whichever mode was met before."""
    system, late = carried(coupling, pull), 0.7
    stop = 2.0 / (1.0 + pull)  # the two are slowed down by floor and pull
    for _ in range(2):
        motion = bf.simulate(system, np.array([0.0, 0.0, 1.0, 1.0]), duration=stop + late)
        assert motion.success
        back, speed = 0.5 * stop - 0.5 * (pull - coupling) * late**2, -(pull - coupling) * late
        np.testing.assert_allclose(motion.final, [0.5 * stop, back, 0.0, speed], rtol=0, atol=1e-14)


def test_what_the_friction_between_passes_on_beyond_the_static_limit_drags_the_lower_mass_back():
    """As above with a friction of 1.6 between them: 1.6 - 1 is left for the lower mass, pull - 1.6 for the upper one."""
    pull, late = 4.0, 0.5
    stop = 2.0 / (1.0 + pull)
    motion = bf.simulate(carried(1.6, pull), np.array([0.0, 0.0, 1.0, 1.0]), duration=stop + late)
    expected = [0.5 * stop - 0.3 * late**2, 0.5 * stop - 1.2 * late**2, -0.6 * late, -2.4 * late]
    np.testing.assert_allclose(motion.final, expected, rtol=0, atol=1e-14)
