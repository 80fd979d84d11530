"""What the searches for orbits do between guess and orbit: starts, raised loads, added harmonics, windows, maps, sizes."""

import numpy as np
import pytest

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.elements import ConstantForce, Coulomb, CubicSpring, ElasticStop, HarmonicForce, RigidStop
from bifurc.hbm.status import BalanceStatus
from bifurc.orbits import forced, standing
from bifurc.orbits.balance import find
from bifurc.orbits.balance.find import HarmonicBalance
from bifurc.orbits.kinds import OrbitStatus

from .test_rests_and_series import PAIR, C, K, M


@pytest.fixture(scope="module")
def balance():
    method = HarmonicBalance(6)
    return method.balance(PAIR, method.layout(2))


def test_starts_of_a_balance(balance, rng):
    """Every kind of guess is the packed Fourier series of its positions."""
    layout = balance.layout
    packed = rng.normal(size=layout.size)
    first, rest = find._starts(balance, None)
    assert np.array_equal(first, balance.linear_response()) and not rest.any() and rest.shape == first.shape
    (own,) = find._starts(balance, packed)
    assert np.array_equal(own, packed) and not np.shares_memory(own, packed)
    orbit = bf.find_orbit(PAIR, packed * 0.01, method=HarmonicBalance(6))
    (other,) = find._starts(balance, bf.find_orbit(PAIR, method=HarmonicBalance(4)))
    assert layout.matrix(other)[9:] == pytest.approx(0.0, abs=1e-300)  # harmonics 5 and 6 of both coordinates
    assert orbit.success and find._starts(balance, orbit)[0] == pytest.approx(orbit.coefficients, abs=0.0)
    exact = bf.find_orbit(PAIR)
    (start,) = find._starts(balance, exact)
    for k, dof in ((1, 0), (1, 1), (4, 1)):
        known = exact.harmonic(k, dof)
        assert layout.matrix(start)[2 * k - 1 : 2 * k + 1, dof] == pytest.approx([known.real, -known.imag], abs=1e-6)
    for state in (exact.state, exact.state[:4]):
        (moved,) = find._starts(balance, state)
        assert moved == pytest.approx(start, abs=2e-3 if state.size == 5 else 0.2)
    double = HarmonicBalance((0, 1, 2, 0.5))
    twice = double.balance(PAIR, double.layout(2, periods=2))
    (doubled,) = find._starts(twice, exact)
    pairs = [(exact.harmonic(k, 1).real, -exact.harmonic(k, 1).imag) for k in (1, 2)]
    assert twice.layout.matrix(doubled)[:, 1] == pytest.approx(
        [exact.harmonic(0, 1).real, 0.0, 0.0, *pairs[0], *pairs[1]], abs=1e-6
    )


def test_loads_that_are_raised(balance):
    """Linear equations: one iteration, as starts are scaled by the load; it is the old one afterwards, also after a failure."""
    method = HarmonicBalance(6)
    system = bf.System(M, C, K, PAIR.elements[:3], omega=1.1)
    linear = method.balance(system, method.layout(2))
    full = linear.numbers.E.copy()
    x, count, failed = find._raised(linear, method)
    assert failed is None and x == pytest.approx(linear.linear_response(), abs=1e-12)
    assert count == 1 and np.array_equal(linear.numbers.E, full)
    x, count, failed = find._raised(balance, method)
    assert failed is None and np.abs(balance.residual(x)).max() < 1e-10
    seen = []

    def lost(equations, method, start):
        seen.append(float((equations.numbers.E[full != 0.0] / full[full != 0.0]).mean()))
        return start, 3, BalanceStatus.SINGULAR if len(seen) % 2 else BalanceStatus.CONTACTS_FAILED

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(find, "_solve", lost)
        x, count, failed = find._raised(linear, method)
    assert seen == pytest.approx([0.1 / 2**k for k in range(7)]) and count == 21
    assert failed is BalanceStatus.SINGULAR and not x.any() and np.array_equal(linear.numbers.E, full)


@pytest.mark.parametrize("solver", ["newton", "broyden"])
def test_solvers_say_what_failed(balance, solver):
    method = HarmonicBalance(6, solver=solver)
    x, count, failed = find._solve(balance, method, balance.linear_response())
    assert failed is None and count > 1 and np.abs(balance.residual(x)).max() < 1e-9
    again = find._solve(balance, method, x)
    assert again[2] is None and again[1] <= 1 and again[0] == pytest.approx(x, abs=1e-10)


def test_harmonics_are_added_until_the_error_is_small():
    method = HarmonicBalance("auto", tolerance=2e-2)
    orbit = bf.find_orbit(PAIR, method=method)
    tried = orbit.how["harmonics tried"]
    assert (
        orbit.success and tried[:2] == [7, 15][: len(tried)] and all(b == 2 * a + 1 for a, b in zip(tried, tried[1:], strict=False))
    )
    amplitude = np.abs(orbit.layout.matrix(orbit.coefficients)).max()
    assert max(orbit.how["error"]) <= 2e-2 * amplitude and orbit.layout.top == tried[-1]
    if len(tried) > 1:
        before = bf.find_orbit(PAIR, method=HarmonicBalance(tried[-2]))
        assert max(before.how["error"]) > 2e-2 * np.abs(before.layout.matrix(before.coefficients)).max()
    cubic = bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.5), CubicSpring(0.4)], omega=0.6)
    found = bf.find_orbit(cubic, method=HarmonicBalance("auto", tolerance=1e-9))
    assert found.how["harmonics tried"][-1] in (31, 63) and found.how["method"] == "harmonic balance, newton"
    assert found.how["harmonics"] == list(range(found.layout.top + 1)) and found.how["aft"] == "exact"
    assert "samples" not in found.how and found.how["law samples"] >= 128 and found.how["iterations"] >= 1
    assert "differenced Jacobians" not in found.how
    sampled = bf.find_orbit(PAIR, method=HarmonicBalance(3, aft="sampled", samples=200))
    assert sampled.how["samples"] == 200 and "law samples" in sampled.how
    exact = bf.find_orbit(PAIR, method=HarmonicBalance(3))
    assert sampled.harmonic(1) == pytest.approx(exact.harmonic(1), abs=5e-3) and sampled.harmonic(1) != exact.harmonic(1)
    with_half = bf.find_orbit(PAIR, exact, method=HarmonicBalance((0, 1, 2, 3, 0.5)), periods=2)
    assert with_half.periods == 2 and with_half.how["harmonics"] == [0.0, 0.5, 1.0, 2.0, 3.0]
    assert abs(with_half.harmonic(0.5)) < 1e-8 and with_half.harmonic(1) == pytest.approx(exact.harmonic(1), abs=1e-8)


# ---- forced systems by events --------------------------------------------------------------------------------------------------

HIT = bf.System(
    M, C, K, [HarmonicForce(1.4, phase=0.6), ConstantForce(0.3, dof=1), RigidStop(0.4, restitution=0.7, dof=1)], omega=1.1
)


def test_rest_moved_out_of_stops():
    for gap, side in ((-0.4, 1), (0.4, -1), (0.3, 1), (-0.3, -1)):
        y = standing.resting_start(bf.System(M, C, K, [HarmonicForce(1.0), RigidStop(gap, side=side, dof=1)], omega=1.1))
        assert y.shape == (4,) and not y[2:].any() and y[0] == pytest.approx(-0.15 * y[1], abs=1e-14)  # an impulse moves both
        clear = abs(y[1]) + gap  # a tenth of the gap and of the length that the load makes, which is below 1 here
        assert 0.1 * abs(gap) < clear < 0.1 * (1.0 + abs(gap)) if gap < 0.0 else y[1] == 0.0
        assert y[1] * side <= 0.0
    touching = standing.resting_start(bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.0), RigidStop(0.0)], omega=1.1))
    assert -0.2 < touching[0] < -0.05 and touching[1] == 0.0


def test_sizes_of_states():
    scene = scene_of(HIT)
    assert forced.sizes_of(scene, np.array([[0.1, -0.5, 0.2, 0.3], [0.2, 0.0, -0.1, 0.1]])) == pytest.approx([0.5, 0.5, 0.55, 0.55])
    assert forced.sizes_of(scene, np.array([[0.1, 0.0, 0.2, -3.3]])) == pytest.approx([3.0, 3.0, 3.3, 3.3])
    assert forced.sizes_of(scene, np.zeros((1, 4))) == pytest.approx([1.0, 1.0, 1.1, 1.1])
    with_memory = scene_of(PAIR)
    assert forced.sizes_of(with_memory, np.array([[0.0, 2.0, 0.0, 0.0, 9.0]])) == pytest.approx([2.0, 2.0, 2.2, 2.2, 2.0])


def test_what_stands_for_an_orbit_that_was_not_found():
    lost = forced.unfound(PAIR, np.array([0.5, -3.0]), {"transient periods": 40})
    assert not lost.success and lost.status is OrbitStatus.NOT_FOUND and lost.periods == 1
    assert lost.how == {"method": "simulation", "transient periods": 40}
    assert lost.state.tolist() == [0.5, -3.0, 0.0, 0.0, 0.0] and lost.weights.tolist() == [1.0, 3.0, 1.0, 1.0, 1.0]


@pytest.mark.parametrize("half", [False, True])
def test_the_derivative_of_the_map(half, rng):
    """By central differences of simulations; the half map is turned round."""
    elements = [
        HarmonicForce(1.4, phase=0.6),
        RigidStop(0.5, restitution=0.9, dof=1),
        RigidStop(0.6, side=-1, restitution=0.8, dof=1),
    ]
    system = bf.System(M, C, K, elements, omega=1.1)
    y = np.array([0.3, -0.2, 0.4, 0.9])
    start, gap, D, weights = forced.period_map(system, y, 3, half)
    span, sign = (1.5, -1.0) if half else (3.0, 1.0)

    def end(state):
        return sign * bf.simulate(system, state, periods=span).final

    assert len(bf.simulate(system, y, periods=span).events) >= 1
    assert start == pytest.approx(y, abs=1e-14) and gap == pytest.approx(end(y) - y, abs=1e-12)
    for direction in rng.normal(size=(2, 4)):
        known = (end(y + 1e-6 * direction) - end(y - 1e-6 * direction)) / 2e-6
        assert D @ direction == pytest.approx(known, abs=1e-4 * np.abs(D).max())
    assert (weights[0], weights[2]) == (weights[1], weights[3]) and weights[2] == pytest.approx(1.1 * weights[0])
    assert forced.period_map(system, [0.0, 0.7, 0.0, 0.0], 1, half) is None  # beyond a stop


def test_windows_of_one_period():
    """Events are (time in periods, [mode before, guard, mode after, ...]); a window ends where its first event returns."""
    a, b, c = [0, 0, 1], [1, 1, 0], [0, 2, 0]
    listed = [(0.0, a), (0.3, b), (1.02, a), (1.3, b), (2.02, a), (2.3, b)]
    found = forced.window(listed, 1)
    assert found.stop - found.start == 2 and listed[found.start][1] == a  # behind the long interval
    assert found == slice(2, 4)  # the better return, and the later one
    assert forced.window(listed, 2) == slice(1, 5)
    assert forced.window(listed[:2], 1) is None
    assert forced.window([(0.0, a), (1.0, c)], 1) is None  # the first event never returns
    assert forced.window([(0.0, c), (1.49, c)], 1) == slice(0, 1) and forced.window([(0.0, c), (1.51, c)], 1) is None
    assert forced.window([(0.0, c), (0.5, c)], 1) is None and forced.window([(0.0, c), (0.51, c)], 1) == slice(0, 1)
    assert forced.window([(0.0, a), (0.9, [0, 0, 1])], 1) is None  # it would not close: mode 1 is left, mode 0 is entered


def test_the_orbit_of_a_motion_is_one_of_its_periods():
    settled = bf.find_orbit(HIT)
    assert settled.success and settled.how["transient periods"] % forced.CHUNK == 0
    periods = settled.periods
    near = forced.from_state(HIT, settled.state + 1e-3, periods)
    assert near.success and near.state == pytest.approx(settled.state, abs=1e-9)
    end = bf.simulate(HIT, settled.state, periods=periods)
    assert end.final == pytest.approx(settled.state, abs=1e-9)
    moved = HIT.with_parameters(amplitude=1.41)
    followed = forced.from_orbit(moved, settled, None)
    assert followed.success and followed.how["guess"] == "orbit" and followed.system == moved
    assert bf.simulate(moved, followed.state, periods=periods).final == pytest.approx(followed.state, abs=1e-9)
    signature, unknowns, weights = forced.read_motion(
        scene_of(HIT), bf.simulate(HIT, settled.state, periods=3 * periods), periods, periods
    )
    assert signature.span == periods and len(unknowns) == 5 * len(signature.nodes) and weights[2] == pytest.approx(1.1 * weights[0])
    times = unknowns.reshape(-1, 5)[:, 0]
    impacts = [e for e in settled.events]
    assert len(times) >= len(impacts) > 0 and (np.diff(times) > 0.0).all() and times[-1] - times[0] < periods


def test_sliders_that_never_slip_stand_in_the_middle():
    system = bf.System(1.0, 0.1, 2.0, [HarmonicForce(0.05), Coulomb(0.3)], omega=1.1)
    stuck = forced.resting(system, bf.find_orbit(system), 1)
    assert stuck is None or stuck.success
    sliding = bf.System(1.0, 0.1, 2.0, [HarmonicForce(0.1), bf.elements.Jenkins(3.0, 0.6)], omega=1.1)
    orbit = bf.find_orbit(sliding, [0.02, 0.0, 0.05])
    assert orbit.success and not orbit.events
    t, y = orbit.sample(2001)
    force = 3.0 * (y[:, 0] - y[:, 2])
    assert np.ptp(y[:, 2]) < 1e-12
    centred = forced.centred(orbit)
    t, y = centred.sample(2001)
    force = 3.0 * (y[:, 0] - y[:, 2])
    assert force.max() == pytest.approx(-force.min(), abs=1e-7)
    assert (
        centred.how["note"] == "sliders that never slip stand equally near to both limits"
        or np.abs(orbit.state - centred.state).max() < 1e-9
    )


def test_ways_past_an_elastic_stop():
    """From rest, from a guess and from the series of the other method: the same orbit."""
    system = bf.System(M, C, K, [HarmonicForce(1.4, phase=0.6), ElasticStop(0.3, 2.0, 0.1, dof=1)], omega=1.1)
    found = [
        bf.find_orbit(system),
        bf.find_orbit(system, np.zeros(4)),
        bf.find_orbit(system, bf.find_orbit(system, method=HarmonicBalance(9))),
    ]
    for orbit in found:
        assert orbit.success and orbit.state == pytest.approx(found[0].state, abs=1e-9)
    assert found[1].how["method"] != "simulation"


@pytest.mark.parametrize("top", [4, 64, 100])
def test_every_wave_has_its_samples(top):
    """Sampled contacts get 16 samples a shortest wave, and 1024 at least; a number that is given is kept."""
    system = bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.0), ElasticStop(gap=0.5, stiffness=4.0)], omega=0.8)
    method = HarmonicBalance(top, aft="sampled")
    assert method.balance(system, method.layout(1)).samples == max(1024, 16 * top)
    assert HarmonicBalance(top, aft="sampled", samples=300).balance(system, method.layout(1)).samples == 300
    assert HarmonicBalance(top).balance(system, method.layout(1)).samples == 0


@pytest.mark.parametrize(("n", "top", "stops", "default"), [
    (2, 3, 1, False),  # few unknowns
    (30, 2, 1, False), (30, 4, 1, True), (30, 4, 15, True),
    (30, 4, 16, False),  # more than half of the coordinates are touched
    (2, 60, 2, False), (2, 60, 1, True), (4, 4, 0, False)])
def test_a_balance_is_condensed_where_it_pays(n, top, stops, default):
    """By default from 200 unknowns on, with half of the coordinates touched at most; asked for it always is, where there is one."""
    K = 2.5 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    elements = [HarmonicForce(1.0), *(ElasticStop(gap=0.5, stiffness=4.0, dof=k) for k in range(stops))]
    system = bf.System(np.eye(n), 0.1 * np.eye(n), K, elements, omega=0.8)
    for condense, made in ((None, default), (True, stops > 0), (False, False)):
        method = HarmonicBalance(top, condense=condense)
        found = method.condensed(method.balance(system, method.layout(n)))
        assert (found is not None) == made


def test_where_loads_cannot_be_raised_parts_of_the_linear_response_are_tried(balance, monkeypatch):
    """Starts one by one, the raised load, then every part; iterations add up, the first that is solved counts."""
    response, asked = balance.linear_response(), []

    def solve(equations, method, start):
        asked.append(start.copy())
        good = len(asked) == 2 + len(find.SCALED)
        return start + 1.0, 3, None if good else BalanceStatus.SINGULAR
    monkeypatch.setattr(find, "_solve", solve)
    monkeypatch.setattr(find, "_raised", lambda equations, method: (None, 7, BalanceStatus.CONTACTS_FAILED))
    starts = [np.full(response.size, 2.0), np.full(response.size, 3.0)]
    x, count, failed = find._iterated(balance, HarmonicBalance(6), starts, True)
    assert failed is None and count == 3 * (2 + len(find.SCALED)) + 7
    np.testing.assert_array_equal(asked, [*starts, *(part * response for part in find.SCALED)])
    np.testing.assert_array_equal(x, find.SCALED[-1] * response + 1.0)
    asked.clear()
    x, count, failed = find._iterated(balance, HarmonicBalance(6), starts, False)  # a guess is not left
    assert failed is BalanceStatus.SINGULAR and count == 6 and len(asked) == 2


def test_a_start_at_rest_in_a_narrow_clearance_that_does_not_hold_the_origin():
    """On a line, along the inverse mass, and where stops contradict each other; a tenth of the farthest reach is kept off."""
    line = standing.between(np.eye(1), np.array([[1.0], [-1.0]]), np.array([0.05, -0.09]))
    assert line == pytest.approx([-0.059], abs=1e-12)
    narrow = standing.between(np.eye(1), np.array([[1.0], [-1.0]]), np.array([0.05, -0.0502]))
    assert narrow == pytest.approx([-0.05 - 0.001 * 0.0502], abs=1e-12)
    plane = standing.between(np.diag([1.0, 3.0]), np.array([[1.0, -1.0]]), np.array([0.4]))
    assert plane == pytest.approx([-0.33, 0.11], abs=1e-12)
    assert standing.between(np.eye(1), np.array([[1.0], [-1.0]]), np.array([0.05, -0.04])) is None
    system = bf.System(np.eye(2), 0.1 * np.eye(2), [[2.0, -1.0], [-1.0, 2.0]], [
        HarmonicForce(0.4), RigidStop(-0.07, 0.6, row=(-1.0, 1.0)), RigidStop(0.1, 0.6, side=-1, row=(-1.0, 1.0))], omega=0.8)
    q = standing.resting_start(system)[:2]
    assert -0.1 < q[1] - q[0] < -0.07


def test_full_newton_steps_that_explode_are_given_up(monkeypatch):
    """Under a spring of fifth degree a state so far off moves so fast that one period of it takes minutes."""
    stiffness = [[1.22492901614305, -0.5310965488652989, 0.0], [-0.5310965488652989, 1.621838490250786, -1.0907419413854873],
                 [0.0, -1.0907419413854873, 2.1610848442003565]]
    damping = [[0.017178783466140348, -0.0036723341010297607, 0.0],
               [-0.0036723341010297607, 0.020057183797410855, -0.007542072783811772],
               [0.0, -0.007542072783811772, 0.021151078560870066]]
    spring = bf.elements.PolynomialSpring(c2=0.07885751779936834, c3=0.26784288725605865, c5=0.2525682783978959)
    stop = ElasticStop(0.028406514900620516, 39.348565043242445, 0.9438336723172844, release="force", dof=2)
    system = bf.System(np.diag([1.2594834478571741, 1.2788510444445673, 0.8978048209058165]), damping, stiffness,
                       [HarmonicForce(1.6397808694574136, dof=1), spring, stop], omega=0.4286825864787767)
    farthest, simulated = [], forced.simulate

    def watched(system, y0, **options):
        farthest.append(np.abs(y0).max())
        return simulated(system, y0, **options)

    monkeypatch.setattr(forced, "simulate", watched)
    start = [1.4115900570545326, 2.6494231362663228, 0.1384215977472097,
             0.1868445965311857, -0.15418005954760733, -0.011090790305586181]
    assert bf.find_orbit(system, guess=start).success
    assert max(farthest) < 1e4


@pytest.mark.parametrize("omega, least", [(1.5, 1), (4.2, 2)])
def test_a_motion_that_settles_is_found_at_any_multiple_of_its_period(omega, least):
    """The number of periods that is asked for counts itself among its divisors."""
    system = bf.systems.impact_oscillator(zeta=0.05, omega=omega, amplitude=1.0, gap=0.0, restitution=0.8)
    sections = bf.simulate(system, np.zeros(2), periods=400).sections[-3:]
    assert (np.abs(sections[-1] - sections[-2]).max() < 1e-9) == (least == 1) and np.abs(sections[-1] - sections[-3]).max() < 1e-9
    for periods in (None, least, 2 * least, 3 * least):
        found = bf.find_orbit(system, periods=periods)
        assert found.success and found.stable and found.periods == least
        assert np.abs(sections - found.state).max(axis=1).min() < 1e-9
