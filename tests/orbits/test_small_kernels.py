"""Small functions of orbits by name: against numpy, sums written out, and closed forms."""
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.elements import Coulomb, HarmonicForce
from bifurc.orbits import lyapunov, multipliers
from bifurc.orbits.shooting import motion, path, resting, sequence
from bifurc.orbits.shooting.labels import Labels
from tests.reference.plain import plain

PLAIN = SimpleNamespace(system=SimpleNamespace(elements=()))
NOTHING = Labels((), np.empty((0, 3)))


def test_multipliers_are_those_of_the_matrix_largest_first(rng):
    """Pairs with the positive part first; a state that nothing changes, and the shift of the phase, are left out."""
    Q = rng.normal(size=(3, 3))
    whole, equations = SimpleNamespace(clock=0.0), SimpleNamespace(scene=PLAIN)
    M = Q @ np.array([[0.3, -0.4, 0.0], [0.4, 0.3, 0.0], [0.0, 0.0, -0.9]]) @ np.linalg.inv(Q)
    found = multipliers.nontrivial(equations, whole, None, M, NOTHING)
    assert found == pytest.approx([-0.9, 0.3 + 0.4j, 0.3 - 0.4j], abs=1e-12)
    found = multipliers.nontrivial(equations, whole, None, np.diag([0.5, -0.5, 2.0]), NOTHING)
    assert found.tolist() == [2.0, 0.5, -0.5] and found.dtype == complex
    kept = Labels.of([[0.0, 0.0, 1.0]])
    assert multipliers.nontrivial(equations, whole, None, np.diag([0.5, -0.7, 1.0]), kept) == pytest.approx([-0.7, 0.5])
    assert multipliers.nontrivial(equations, whole, None, M, Labels.of(np.eye(3))).size == 0
    M[1, 2] = np.nan
    for clock, gradient, count in ((0.0, None, 3), (1.0, None, 2), (1.0, np.ones(3), 1)):
        found = multipliers.nontrivial(equations, SimpleNamespace(clock=clock), None, M, NOTHING, gradient)
        assert found.shape == (count,) and np.isinf(found).all()


@pytest.mark.parametrize("energy", [False, True])
def test_the_shift_of_the_phase_is_no_multiplier(energy, rng, monkeypatch):
    """M f = f, and E M = E for what is kept: the eigenvalues that are left are those that the matrix was made with."""
    f, weights = rng.normal(size=3), rng.uniform(0.5, 2.0, 3)
    monkeypatch.setattr(multipliers, "field_before", lambda equations, whole, U: f)
    Q = np.column_stack([f, rng.normal(size=(3, 2))])
    inner = np.array([[1.0, 0.7, 0.2], [0.0, 1.0, 0.0], [0.0, 0.4, 0.6]]) if energy else np.diag([1.0, 0.6, -0.3])
    row = np.linalg.inv(Q)[1]  # left eigenvector of the Jordan block
    M = Q @ inner @ np.linalg.inv(Q)
    found = multipliers.nontrivial(SimpleNamespace(weights=weights, scene=PLAIN), SimpleNamespace(clock=2.0), None, M, NOTHING,
                                   row if energy else None)
    assert found == pytest.approx([0.6] if energy else [0.6, -0.3], abs=1e-9)


def test_the_field_before_an_orbit():
    """Of the mode before the first node, at the phase of its time."""
    def forcing(T, t, x):
        x[2:] = [1.0, np.cos(3.0 * t), np.sin(3.0 * t)]

    def field(T, m, x, f):
        f[:] = m + x[1] + 10.0 * x[3], -x[0] + x[2]

    equations = SimpleNamespace(path=SimpleNamespace(tables=SimpleNamespace(A=np.zeros((1, 2, 5)), flat=np.array([3.0, 7.0]))),
                                scene=SimpleNamespace(ns=2), kernel=SimpleNamespace(forcing=forcing, field=field))
    whole = SimpleNamespace(nodes=np.array([[4, 0, 9, 0, 0], [5, 0, 4, 0, 0]]))
    found = multipliers.field_before(equations, whole, np.array([0.21, 1.5, -2.5, 0.7, 8.0, 8.0]))
    assert found == pytest.approx([4.0 - 2.5 + 10.0 * np.cos(0.42 * np.pi), -0.5], rel=1e-14)


def test_states_at_times_are_asked_of_the_arc_that_they_lie_on():
    """From just behind an event, also at its time; times before the first node, by rounding, are those of the node."""
    omega, asked = 4.0, {}
    period = 0.5 * np.pi
    U = np.array([0.1, 1.0, 2.0, 0.6, 3.0, 4.0, 0.9, 5.0, 6.0])
    nodes = np.array([[0, 0, 1, 0, 0], [1, 0, 2, 0, 0], [2, 0, 0, 0, 0]])

    def start_of(T, nodes_, U_, i, P, x):
        x[:2] = -U_[i * 3 + 1:i * 3 + 3]

    def sample(T, modes, starts, begun, index, spans, out):
        asked.update(modes=modes.copy(), starts=starts.copy(), begun=begun.copy(), index=index.copy(), spans=spans.copy(), out=out)

    tau, out = np.array([0.1 - 1e-17, 0.3, 0.6, 0.6, 0.95, 1.1]), np.empty((6, 2))
    T = SimpleNamespace(A=np.zeros((3, 2, 5)), flat=np.array([omega, 9.0]))
    plain(motion.states, start_of=start_of, sample=sample)(T, nodes, 1.0, U, tau, out)
    assert asked["modes"].tolist() == [1, 2, 0] and asked["out"] is out and asked["index"].tolist() == [0, 0, 1, 1, 2, 2]
    assert asked["starts"] == pytest.approx(np.array([0.1, 0.6, 0.9]) * period, rel=1e-14)
    assert asked["begun"].tolist() == [[-1.0, -2.0], [-3.0, -4.0], [-5.0, -6.0]]
    assert asked["spans"] == pytest.approx(np.array([0.0, 0.2, 0.0, 0.0, 0.05, 0.2]) * period, abs=1e-14)


def test_modes_of_an_orbit_are_rebuilt_once_each():
    calls = []
    T = SimpleNamespace(acts=np.zeros((4, 0)), n_guards=np.zeros(4), flat=np.zeros(3))
    nodes = np.array([[3, 0, 1, 0, 0], [1, 0, 3, 0, 0], [3, -1, 0, 0, 0]])
    index, series = np.array([1]), np.array([[2.0, 0.5]])
    run = plain(sequence.set_modes, rebuild_mode=lambda T_, m, whole: calls.append((int(m), bool(whole))))
    run(T, index, series, 1.0, 3.0, 3.0, nodes)
    assert calls == [(3, True), (1, True), (0, True)] and T.flat.tolist() == [0.0, 2.5, 0.0]
    calls.clear()
    T.acts = np.zeros((4, 1))
    run(T, index, series, 1.0, 3.0, 1.0, nodes[2:])
    assert calls == [(3, False), (0, False)] and T.flat[1] == 1.5
    calls.clear()
    run(T, index[:0], series[:0], 1.0, 3.0, 2.0, nodes)
    assert not calls and T.flat[1] == 1.5


def test_noise_of_numbers_is_what_they_are_rounded_to():
    """One number each, smooth ones have none, and a leap at one place is none either."""
    grain, middle, half = 1e-4, 0.3, 2.0
    leap = middle + half * path.CHECKS[2]

    def sample(value):
        return np.array([value, np.sin(1e12 * value) * grain, 2.0 * (value > leap), 3.0,
                         np.sin(1e12 * value) * grain * (value > middle + 0.45 * half)])

    found = path.noise(sample, middle, half)
    assert found.shape == (5,) and found[0] < 1e-14 and found[2] == 0.0 and found[3] == 0.0
    assert 0.5 * grain < found[1] <= 4.0 * grain and 0.1 * grain < found[4] <= 4.0 * grain  # at two places of five


@pytest.mark.parametrize(("bounds", "wide"), [((1.5, 2.0), 0.5), ((2.0, 1.5), 0.5), ((2.0, 2.0), 2e-3), ((2.0, 2.0001), 2.0001e-3)])
def test_numbers_over_a_parameter_are_sampled_a_little_beyond_its_bounds(bounds, wide):
    """By the part of the interval that is asked for; of a very short one by a thousandth of the larger bound."""
    index, series, low, high = path.series_over(bf.systems.duffing_oscillator(), "omega", bounds,
                                                lambda system: np.array([1.0, system.omega**2, 1.0 / system.omega]), pad=0.1)
    assert [low, high] == pytest.approx([min(bounds) - 0.1 * wide, max(bounds) + 0.1 * wide], rel=1e-14)
    assert index.tolist() == [1, 2]
    for z in (-1.0, -0.3, 0.0, 0.8, 1.0):
        omega = 0.5 * (low + high) + 0.5 * (high - low) * z
        known = omega**2, 1.0 / omega
        assert np.polynomial.chebyshev.chebval(z, series.T) == pytest.approx(known, rel=1e-13)


def test_a_parameter_needs_room_to_move():
    with pytest.raises(ValueError, match="zeta must have room to move; give two different numbers"):
        path.series_over(bf.systems.duffing_oscillator(), "zeta", (0.0, 0.0), lambda system: np.ones(1))


def test_memory_in_the_middle_of_its_guards(monkeypatch):
    """Two memories, each between two guards that both of them move: where both are at the same distance of both sides."""
    tops = np.array([-1.0, -3.0, -0.5, -2.0, -9.0])
    rates = {4: np.array([2.0, -1.0, 0.3, 0.1, 0.0]), 5: np.array([0.2, 0.1, 1.0, -4.0, 0.0])}
    monkeypatch.setattr(resting, "Family", lambda orbit: SimpleNamespace(tops=tops, slopes=lambda c: rates[c]))
    orbit = SimpleNamespace(scene=SimpleNamespace(n=2), family=[1, 4, 5])
    found = resting.middle(orbit)
    # the nearest guard above and below of each, by hand; 4 is between 0 and 1, 5 between 2 and 3
    d = np.array([found[4], found[5]])
    value = tops + d[0] * rates[4] + d[1] * rates[5]
    assert value[0] / 2.0 == pytest.approx(value[1] / 1.0, abs=1e-13) and value[2] / 1.0 == pytest.approx(value[3] / 4.0, abs=1e-13)
    assert list(found) == [4, 5]
    rates[5][3] = 4.0  # no end below
    assert resting.middle(orbit) == {}
    orbit.family = [1]
    assert resting.middle(orbit) == {}
    orbit.family = [4]
    assert resting.middle(orbit) == pytest.approx({4: -1.25})  # between .5 and -3


def test_volumes_shrink_by_the_divergence():
    """Of an arc of a damped oscillator by exp(-2 zeta t), whatever its length: long arcs are divided."""
    system = bf.System(2.0, 0.8, 3.0, [HarmonicForce(0.5)], omega=1.3)
    for span in (0.0, 0.7, 5.0):
        assert lyapunov._volume(scene_of(system), 0, np.array([0.3, -0.2]), 0.4, span) == pytest.approx(-0.4 * span, abs=1e-11)
    overdamped = bf.System(1.0, 12.0, 3.0, [HarmonicForce(0.5)], omega=1.3)  # directions fade as exp(-12 t) beside each other
    assert lyapunov._volume(scene_of(overdamped), 0, np.array([0.3, -0.2]), 0.0, 8.0) == pytest.approx(-96.0, rel=1e-9)


@pytest.mark.parametrize("mu", [0.2, 0.5])
def test_a_continuum_of_rests_ends_where_friction_does(mu):
    """A mass that sticks holds another one on a spring: K q = r with r = 0 on the first row, |r| <= mu on the second."""
    K = np.array([[2.0, -1.0], [-1.0, 1.7]])
    system = bf.System(np.eye(2), 0.1 * np.eye(2), K, [Coulomb(mu, dof=1)])
    rest = bf.find_equilibrium(system, [0.02, 0.04])
    end = mu / (K[1, 1] - K[0, 1]**2 / K[0, 0])
    assert rest.continuum.shape == (1, 4) and list(rest.intervals) == [1]
    assert rest.intervals[1] == pytest.approx((-end, end), rel=1e-12)
    assert bf.find_equilibrium(bf.System(np.eye(2), 0.1 * np.eye(2), K)).intervals == {}
