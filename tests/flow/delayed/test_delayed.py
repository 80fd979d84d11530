"""Motions under delayed feedback: exact delay equations by steps, growth rates of the linear theory, refusals by name."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import DelayedFeedback
from bifurc.flow.delayed.integration import integrate
from tests.reference.impacting_orbit import impacting

VELOCITY_GAIN = 0.11974245320865


def controlled(system, gain, **options):
    """Return the system with a delayed feedback."""
    return bf.System(system.mass, system.damping, system.stiffness, (*system.elements, DelayedFeedback(gain, **options)),
                     omega=system.omega)


@pytest.fixture(scope="module")
def orbit():
    return impacting()


def test_without_gain_it_is_the_motion_of_the_system(orbit):
    start = orbit.state + (1e-3, 0.0)
    plain = bf.simulate(orbit.system, start, periods=5)
    delayed = bf.simulate(controlled(orbit.system, 0.0), start, periods=5)
    np.testing.assert_allclose(delayed.final, plain.final, atol=1e-11)
    assert [e.kind for e in delayed.events] == [e.kind for e in plain.events]
    np.testing.assert_allclose([e.time for e in delayed.events], [e.time for e in plain.events], atol=1e-12)


def test_at_an_event_the_state_is_that_after_it():
    """A rebound: the motion and the force of its feedback jump there, to what comes after; a little earlier they are what was."""
    stops = (bf.elements.HarmonicForce(0.6), bf.elements.RigidStop(0.2, 0.5), DelayedFeedback(0.3, delay=0.4, of="velocity"))
    motion = bf.simulate(bf.System(1.0, 0.1, 1.0, stops, omega=1.1), (0.0, 0.5), periods=8, max_events=2)
    assert motion.success and len(motion.events) >= 6  # in each period no more than two
    for event in motion.events:
        assert event.before[1] > 0.0 > event.after[1] == pytest.approx(-0.5 * event.before[1], rel=1e-10)
        assert motion(event.time) == pytest.approx(event.after, abs=1e-10)
        assert motion(event.time - 1e-9) == pytest.approx(event.before, abs=1e-7)
        jump = motion.feedback(event.time) - motion.feedback(event.time - 1e-9)
        assert jump == pytest.approx(-0.3 * (event.after[1] - event.before[1]), abs=1e-6)


@pytest.mark.parametrize("repeat", [0.0, 0.5])
def test_a_linear_delay_equation_by_the_method_of_steps(repeat):
    """x'' + 2 zeta x' + x = p, p = K (x(t-1) - x(t)) + R p(t-1), against Taylor series a step in 40 digits."""
    mp = pytest.importorskip("mpmath").mp
    mp.dps = 40
    zeta, K, tau = mp.mpf("0.1"), mp.mpf("0.7"), 1
    terms, steps = 60, 5
    past, force, y = None, None, (mp.mpf(1), mp.mpf(0))
    for _ in range(steps):
        a = [y[0], y[1]]
        known = [K * past[j] + mp.mpf(repeat) * force[j] if past else mp.mpf(0) for j in range(terms)]
        for j in range(terms - 2):
            p = known[j] - K * a[j]
            a.append((p - a[j] - 2 * zeta * (j + 1) * a[j + 1]) / ((j + 1) * (j + 2)))
        past, force = a, [known[j] - K * a[j] for j in range(terms)]
        y = sum(a), sum(j * a[j] for j in range(1, terms))
    system = bf.System(1.0, 0.2, 1.0, (DelayedFeedback(0.7, delay=float(tau), repeat=repeat),))
    motion = bf.simulate(system, (1.0, 0.0), duration=float(steps))
    np.testing.assert_allclose(motion.final, [float(v) for v in y], atol=1e-13)


def test_a_jump_of_the_past_arrives_a_delay_later():
    """A velocity that jumped from 0 to 1 at -0.3 is a step of the force at 0.7, whose answer is known in closed form."""
    gain, at = 0.6, 0.7
    system = bf.System(1.0, 0.0, 1.0, (DelayedFeedback(gain, delay=1.0, of="velocity"),))

    def past(t):
        return np.column_stack((np.zeros_like(t), np.where(t > at - 1.0, 1.0, 0.0)))
    motion = integrate(system, np.zeros(2), 0.0, 1.0, past, breaks=(at - 1.0,))
    a, w = 0.5 * gain, np.sqrt(1.0 - 0.25 * gain**2)
    for t in (0.5, 0.7, 0.8, 0.9, 1.0):
        s = max(t - at, 0.0)
        x = gain * (1.0 - np.exp(-a * s) * (np.cos(w * s) + a / w * np.sin(w * s)))
        v = gain * np.exp(-a * s) * np.sin(w * s) / w
        np.testing.assert_allclose(motion(t), [x, v], rtol=0, atol=1e-13)


@pytest.mark.parametrize("gain, growth", [(0.004, 1.099036), (0.0089, 0.999933)])
def test_growth_under_displacement_feedback(orbit, gain, growth):
    motion = bf.simulate(controlled(orbit.system, gain), orbit.state + 1e-6 * np.array([1.0, 0.3]), periods=45, history=orbit)
    away = np.linalg.norm(motion.sections - orbit.state, axis=1)
    assert (away[-1] / away[20]) ** (1 / (len(away) - 21)) == pytest.approx(growth, abs=2e-5)


@pytest.mark.parametrize("ratio, growth", [(0.9, 1.00929), (1.1, 0.99194)])
def test_growth_under_velocity_feedback_at_a_rigid_stop(orbit, ratio, growth):
    system = controlled(orbit.system, ratio * VELOCITY_GAIN, of="velocity")
    motion = bf.simulate(system, orbit.state + 1e-6 * np.array([1.0, 0.3]), periods=80, history=orbit)
    away = np.linalg.norm(motion.sections - orbit.state, axis=1)
    assert (away[-1] / away[40]) ** (1 / (len(away) - 41)) == pytest.approx(growth, abs=1e-5)


def test_the_feedback_vanishes_when_the_orbit_is_reached(orbit):
    motion = bf.simulate(controlled(orbit.system, 0.05), orbit.state + (0.01, 0.0), periods=150, history=orbit)
    assert np.abs(motion.sections[-1] - orbit.state).max() < 1e-9
    times = np.linspace(motion.stop - orbit.period, motion.stop, 50)
    assert np.abs(motion.feedback(times)).max() < 1e-9
    assert np.abs(motion.feedback(np.linspace(0.0, orbit.period, 50))).max() > 1e-4


def test_a_law_that_is_not_affine():
    """Duffing with velocity feedback, against DOP853 from period to period with the past interpolated."""
    from scipy.integrate import solve_ivp

    system = controlled(bf.systems.duffing_oscillator(omega=1.2, amplitude=0.4), 0.3, of="velocity")
    period = system.period
    motion = bf.simulate(system, (0.4, 0.1), periods=3)

    def rates(past):
        def rate(t, y):
            p = 0.3 * ((0.0 if past is None else past(t - period)[1]) - y[1])
            return y[1], 0.4 * np.cos(1.2 * t) - 0.1 * y[1] - y[0] - y[0] ** 3 + p
        return rate

    past, y = None, (0.4, 0.1)
    for k in range(3):
        solved = solve_ivp(rates(past), (k * period, (k + 1) * period), y, method="DOP853", rtol=1e-12, atol=1e-13,
                           dense_output=True)
        past, y = solved.sol, solved.y[:, -1]
    np.testing.assert_allclose(motion.final, y, atol=1e-8)


def test_two_feedbacks_on_one_row_are_their_sum(orbit):
    start = orbit.state + (0.01, 0.0)
    one = bf.simulate(controlled(orbit.system, 0.05), start, periods=4, history=orbit)
    two = bf.simulate(controlled(controlled(orbit.system, 0.02), 0.03), start, periods=4, history=orbit)
    np.testing.assert_allclose(two.final, one.final, atol=1e-12)
    times = np.linspace(0.0, one.stop, 30)
    assert two.feedback(times).shape == (30, 2)
    np.testing.assert_allclose(two.feedback(times).sum(axis=1), one.feedback(times), atol=1e-11)


@pytest.mark.slow
@pytest.mark.parametrize("gain", [0.1, 0.2])
def test_a_rotor_that_rubs_under_feedback_of_both_velocities(gain):
    """Growth a turn of the simulated delay equation is the largest multiplier of the linear theory."""
    system = bf.systems.jeffcott_rotor(nu=1.28)
    orbit = bf.find_orbit(system, guess=(1.435757840528465, -0.348039325418749, 0.455604609814722, 0.667747833906096))
    both = controlled(controlled(system, gain, of="velocity", dof=0), gain, of="velocity", dof=1)
    motion = bf.simulate(both, orbit.state + 1e-6 * np.array([1.0, 0.3, -0.2, 0.5]), periods=50, history=orbit)
    assert motion.success and len(motion.events) == 200
    away = np.log(np.linalg.norm(motion.sections - orbit.state, axis=1))
    largest = abs(bf.control.controlled_multipliers(orbit, "velocity", gain, row=((1, 0), (0, 1)))[0])
    assert np.exp(np.polyfit(np.arange(15, 51), away[15:], 1)[0]) == pytest.approx(largest, rel=1e-3)  # a line: angles average out


def test_on_the_orbit_of_a_curved_contact_no_event_is_lost():
    """Every event of the orbit again, turn after turn, where an event, a delayed one and the end of a piece are one instant."""
    system = bf.systems.jeffcott_rotor(nu=1.28)
    orbit = bf.find_orbit(system, guess=(1.435757840528465, -0.348039325418749, 0.455604609814722, 0.667747833906096))
    motion = bf.simulate(controlled(controlled(system, 0.2, of="velocity", dof=0), 0.2, of="velocity", dof=1), orbit.state,
                         periods=9, history=orbit)
    assert [e.kind for e in motion.events] == 9 * [e.kind for e in orbit.events]
    np.testing.assert_allclose([e.time for e in motion.events],
                               [k * orbit.period + e.time for k in range(9) for e in orbit.events], atol=1e-12)


@pytest.mark.parametrize("start", [-1e-14, 0.0, 1e-16, -1e-3])
def test_a_guard_that_crosses_before_the_first_point_of_a_piece(start):
    from bifurc.flow.delayed.history import collocation
    from bifurc.flow.delayed.integration import first_root

    value = collocation()[0] + max(start, -1e-4) + 1e-11  # what is interpolated is positive at once
    root = first_root(value, start, 1e-15)
    assert root is not None and 0.0 <= root <= collocation()[0][0]


@pytest.mark.parametrize("length, root", [(1e-15, None), (1e-14, None), (1e-12, None), (1.0, 0.75)])
def test_a_guard_that_goes_inside_is_left_by_no_rounding(length, root):
    """g = -25 t (1 - t / .75), to 1e-14 of rounding: on a short piece the exact rate is all that is known."""
    from bifurc.flow.delayed.history import collocation
    from bifurc.flow.delayed.integration import first_root

    t = length * collocation()[0]
    for seed in range(50):
        value = -25.0 * t * (1.0 - t / 0.75) + 1e-14 * np.random.default_rng(seed).uniform(-1.0, 1.0, t.size)
        found = first_root(value, 0.0, 64e-14, (-25.0 * length, 1e-14 * length))
        assert found == root if root is None else found == pytest.approx(root, rel=1e-12)
    assert first_root(25.0 * t, 0.0, 64e-14, (25.0 * length, 1e-14 * length)) == 0.0


def test_what_cannot_treat_it_refuses_by_name():
    system = controlled(bf.systems.duffing_oscillator(), 0.1)
    for call in (lambda: bf.find_orbit(system), lambda: bf.find_orbit(system, method=bf.HarmonicBalance(harmonics=3)),
                 lambda: bf.basins_of_attraction(system, bf.Grid(q0=(-1, 1, 4), v0=(-1, 1, 4))),
                 lambda: bf.lyapunov_exponents(system, (0.0, 0.0)),
                 lambda: bf.sweep(system, "omega", [1.0, 1.1], {"q0": (-1, 1)}, samples=4),
                 lambda: bf.atlas(system, "omega", (1.0, 1.1), {"q0": (-1, 1)}, samples=4),
                 lambda: bf.cell_mapping(system, bf.Grid(q0=(-1, 1, 4), v0=(-1, 1, 4)))):
        with pytest.raises(ValueError, match="'delayed_feedback': delayed feedback is not supported here"):
            call()


def test_bad_arguments_are_named():
    with pytest.raises(ValueError, match="repeat = 1.0"):
        DelayedFeedback(0.1, repeat=1.0)
    with pytest.raises(ValueError, match="delay = 0.0"):
        DelayedFeedback(0.1, delay=0.0)
    with pytest.raises(ValueError, match="of = 'force'"):
        DelayedFeedback(0.1, of="force")
    system = bf.systems.impact_oscillator()
    with pytest.raises(ValueError, match="has no delayed feedback"):
        bf.simulate(system, (0.0, 0.0), periods=1, history=lambda t: t)
    two = controlled(controlled(system, 0.1), 0.2, delay=2.0)
    with pytest.raises(ValueError, match="with the delays 1, 2"):
        bf.simulate(two, (0.0, 0.0), periods=1)
    short = bf.simulate(system, (0.0, 0.0), periods=0.5)
    with pytest.raises(ValueError, match="history must reach"):
        bf.simulate(controlled(system, 0.1), (0.0, 0.0), periods=1, history=short)


@pytest.mark.parametrize("past, text", [
    (lambda t: 1.0, r"shape \(\) at 1 times; it must give states \(1, 2\)"),
    (lambda t: np.zeros((t.size, 3)), r"shape \(1, 3\)"), (lambda t: np.full((t.size, 2), np.nan), "not finite at t = "),
    (lambda t: "x", "states of real numbers"), (lambda t: None, "states of real numbers"),
    (lambda t: np.zeros((t.size, 2), complex), "states of real numbers"), (3, "a motion, an orbit, or a function of time"),
    (bf.find_orbit(bf.System(np.eye(2), 0.1 * np.eye(2), np.eye(2), [bf.elements.HarmonicForce(1.0)], omega=0.5)), r"\(1, 4\)")])
def test_a_past_that_is_none_is_named(past, text):
    system = controlled(bf.systems.impact_oscillator(), 0.1)
    with pytest.raises(ValueError, match=text):
        bf.simulate(system, (0.0, 0.0), periods=1, history=past)


def test_a_state_that_lasts_is_a_past():
    """At rest at its equilibrium for ever: constant feedback of it leaves it there."""
    system = bf.System(1.0, 0.1, 2.0, [bf.elements.ConstantForce(3.0), DelayedFeedback(0.4, 0.7)])
    motion = bf.simulate(system, (1.5, 0.0), duration=20.0, history=lambda t: (1.5, 0.0))
    assert np.abs(motion(np.linspace(0.0, 20.0, 50)) - (1.5, 0.0)).max() < 1e-13
