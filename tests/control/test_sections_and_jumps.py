"""Linear maps of control against differences of motions: sections in either period of an orbit, events under feedback."""
import itertools

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

import bifurc as bf
from bifurc.control.linearization import linearized
from bifurc.control.ogy import orbit_derivative, section_monodromy
from bifurc.elements import Coulomb, HarmonicForce, RigidStop


@pytest.fixture(scope="module")
def double():
    """Return an orbit of two periods, with its impacts at different places of either."""
    system = bf.systems.impact_oscillator(omega=2.5, amplitude=11.0)
    orbit = bf.find_orbit(system)
    assert orbit.success and orbit.periods == 2 and len(orbit.events) == 2
    return orbit


@pytest.mark.parametrize("section", [0.15, 1.15, 1.7])
def test_the_map_of_a_section_is_that_of_motions_over_all_periods_of_the_orbit(double, section):
    system, h = double.system, 1e-6
    state = double._states(np.array([section]))[0]

    def moved(system, y):
        return bf.simulate(system, y, periods=2, t0=section * system.period).final

    np.testing.assert_allclose(moved(system, state), state, atol=1e-10)
    columns = [(moved(system, state + h * e) - moved(system, state - h * e)) / (2.0 * h) for e in np.eye(2)]
    M = section_monodromy(double, section)
    np.testing.assert_allclose(M, np.transpose(columns), atol=1e-5)
    for name in ("amplitude", "omega"):
        value = system.parameter(name)
        sides = [moved(system.with_parameters(**{name: value + sign * h}), state) for sign in (1.0, -1.0)]
        pushed = (sides[0] - sides[1]) / (2.0 * h)
        np.testing.assert_allclose((np.eye(2) - M) @ orbit_derivative(double, name, section), pushed, atol=1e-5)


def test_a_motion_is_held_when_it_has_stayed_for_three_delays(double):
    """However many forcing periods a delay has: here on an orbit of two, which is fed back to itself."""
    system = double.system
    feedback = bf.elements.DelayedFeedback(0.01, delay=2.0)
    held = bf.System(system.mass, system.damping, system.stiffness, (*system.elements, feedback), omega=system.omega)
    q, v = double.state
    grid = bf.Grid(q0=(q, q + 2e-3, 1), v0=(v, v + 2e-3, 1))
    known = {past: bf.control.feedback_basins(held, double, grid, past=past) for past in ("orbit", "free")}
    assert all(found.labels.tolist() == [[0]] for found in known.values())
    orbit, free = (int(known[past].periods[0, 0]) for past in ("orbit", "free"))
    assert orbit >= 1 + 3 * 2 and free >= 1 + 3 * 2 + 2  # without a past there is no feedback before the first delay is over


def test_a_controlled_motion_is_that_of_the_changed_system_from_section_to_section():
    """The frequency is what is changed: phases of the section are kept, times are not."""
    system = bf.systems.impact_oscillator(omega=2.5, amplitude=12.0)
    orbit = bf.find_orbit(system, guess=(-6.3, 0.7))
    made = bf.control.ogy(orbit, "omega", section=0.4)
    start = made.state + 1e-3 * orbit.weights * [1.0, -0.5]
    found = made.simulate(start, 2, limit=1.0, noise=0.0)
    y = start
    for k in range(2):
        change = -float(made.gain @ (y - made.state))
        assert found.corrections[k] == pytest.approx(change, rel=1e-12) and found.active[k]
        other = system.with_parameters(omega=2.5 + change)
        y = bf.simulate(other, y, periods=1, t0=0.4 * other.period).final
        np.testing.assert_allclose(found.states[k + 1], y, rtol=0, atol=1e-13)
        assert found.distances[k + 1] == pytest.approx(np.linalg.norm((y - made.state) / orbit.weights))
    noisy = made.simulate(start, 1, limit=1.0, noise=0.25, seed=3)
    np.testing.assert_allclose((noisy.states[1] - found.states[1]) / orbit.weights,
                               0.25 * np.random.default_rng(3).normal(size=2), rtol=1e-9)
    late = made.simulate(start, 2, limit=1.0, start=1)
    assert late.corrections[0] == 0.0 and late.active.tolist() == [False, True] and late.captured == 1
    tight = made.simulate(start, 1, limit=0.5 * abs(found.corrections[0]))
    assert tight.corrections[0] == 0.0 and not tight.active[0] and tight.captured is None


# events of a system with a feedback, integrated by Runge-Kutta

ZETA, W, K, STOP, MU = 0.06, 0.9, np.array([[1.6, -0.6], [-0.6, 1.9]]), (0.45, 0.7), 0.8
LOAD = np.array([0.8, 1.1])


def pair(static):
    """Return two masses, the first with a stop, the second with dry friction of a static over kinetic ratio."""
    return bf.System(np.eye(2), 2.0 * ZETA * np.eye(2), K, (
        HarmonicForce(LOAD[0], dof=0), HarmonicForce(LOAD[1], dof=1), RigidStop(*STOP, dof=0),
        Coulomb(MU, static_ratio=static, dof=1)), omega=W)


def integrated(y, begin, end, sign, static, push):
    """Return the state at the time ``end``; ``push(t, y)`` (2,) is one more load, ``sign`` that of the slip, 0: stick."""
    t = begin
    while t < end:
        def load(t, y):
            return LOAD * np.cos(W * t) - K @ y[:2] - 2.0 * ZETA * y[2:] + push(t, y)

        def rate(t, y, sign=sign):
            a = load(t, y)
            a[1] = a[1] - sign * MU if sign else 0.0
            return np.concatenate([y[2:], a])

        def hit(t, y):
            return y[0] - STOP[0]

        def turn(t, y, sign=sign):
            return sign * y[3] if sign else static * MU - abs(load(t, y)[1])

        hit.terminal, hit.direction, turn.terminal, turn.direction = True, 1.0, True, -1.0
        made = solve_ivp(rate, (t, end), y, method="DOP853", rtol=1e-11, atol=1e-12,
                         events=(hit, turn))
        t, y = float(made.t[-1]), made.y[:, -1].copy()
        if made.t_events[0].size:
            y[0], y[2] = STOP[0], -STOP[1] * y[2]
        elif made.t_events[1].size:
            pulled = load(t, y)[1]
            if sign:
                y[3] = 0.0
            sign = float(np.sign(pulled)) if not sign or abs(pulled) > static * MU else 0.0
    return y


@pytest.mark.parametrize("of, row, static", [("displacement", (1.2, -0.5), 1.25), ("velocity", (0.0, 0.8), 1.0)])
def test_events_under_a_feedback_pass_on_perturbations_as_motions_do(of, row, static):
    """p = kappa (s - s on the orbit): the release from stick feels it, impacts do not."""
    orbit = bf.find_orbit(pair(static))
    kinds = {event.kind for event in orbit.events}
    assert orbit.success and orbit.periods == 1 and {"impact", "stick", "slip"} <= kinds
    kappa, row, period = 0.3, np.array(row), orbit.period
    at = slice(0, 2) if of == "displacement" else slice(2, 4)
    sticks = next(event.time for event in orbit.events if event.kind == "stick")
    begin = sticks - 0.02 * period  # within the slip before the stick
    state = orbit._states(np.array([begin / period]))[0]
    cuts = sorted(event.time + (period if event.time < begin else 0.0) for event in orbit.events)
    pieces = []
    for a, b in itertools.pairwise([begin, *cuts, begin + period]):  # smooth between events
        times = np.linspace(a, b, 800)
        pieces.append(CubicSpline(times, orbit._states(times / period)[:, at] @ row))

    def push(t, y):
        there = pieces[int(np.searchsorted(cuts, t))]
        return -kappa * row * (y[at] @ row - there(t))

    sign, h = float(np.sign(state[3])), 1e-5
    np.testing.assert_allclose(integrated(state, begin, begin + period, sign, static, lambda t, y: np.zeros(2)), state, atol=1e-8)
    columns = [(integrated(state + h * e, begin, begin + period, sign, static, push)
                - integrated(state - h * e, begin, begin + period, sign, static, push)) / (2.0 * h) for e in np.eye(4)]
    found = np.linalg.eigvals(linearized(orbit, of, row, kappa).transition(np.array([kappa]))[0])
    np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(np.linalg.eigvals(np.transpose(columns))), atol=3e-4)


def test_a_release_with_a_leap_feels_what_its_velocity_feeds_back_on_one_side_only():
    """Behind the instant at which the orbit lets go the delayed velocity has grown already, before it is still zero."""
    orbit = bf.find_orbit(pair(1.25))
    with pytest.raises(bf.control.NotSupported, match="'coulomb' lets go with a leap"):
        linearized(orbit, "velocity", 1)
    assert linearized(orbit, "velocity", 0).rows.tolist() == [[0.0, 0.0, 1.0, 0.0]]  # the other mass: nothing that it waits for


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_a_pulse_before_an_impact_is_thrown_back_with_it_and_one_behind_it_is_not(restitution):
    """Two masses of coupled inertia, the first at a stop: -M^-1 row behind an impact, I - (1 + r) M^-1 e e' / (e' M^-1 e) of it
    before.  A stop that holds the mass takes its share of the pulse."""
    M, row = np.array([[1.0, 0.25], [0.25, 1.44]]), np.array([1.0, 0.5])
    system = bf.System(M, [[0.11, -0.019], [-0.019, 0.11]], [[1.38, -0.38], [-0.38, 1.38]], [
        HarmonicForce(0.6), RigidStop(0.12, restitution, dof=0)], omega=1.2)
    orbit = bf.find_orbit(system)
    made = linearized(orbit, "velocity", tuple(row), 0.2)
    assert orbit.success and made.jumping
    for kick in made.jumping:
        free, e = -np.linalg.solve(M, row), np.linalg.solve(M, [1.0, 0.0])
        before = free - (1.0 + restitution) * e * free[0] / e[0]
        after = free if restitution else np.array([0.0, -row[1] / M[1, 1]])
        np.testing.assert_allclose(kick.before[:, 0], [0.0, 0.0, *before], rtol=0, atol=1e-14)
        np.testing.assert_allclose(kick.after[:, 0], [0.0, 0.0, *after], rtol=0, atol=1e-14)
