"""Pieces of control on stand-ins in closed form: quasipolynomials, ends of feedback, placing, watching, chunks."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bifurc.control import basins, linearization
from bifurc.control.basins import Watch, _numbered, constant, packed, unpacked
from bifurc.control.characteristic import Characteristic, OnCircle
from bifurc.control.collocated import Collocated, _last_values
from bifurc.control.feedback import (
    EndKind,
    FeedbackStatus,
    _best,
    _bounds,
    _extrema,
    _Jumping,
    _repeats,
    _scan,
    _Smooth,
    odd_number,
    repeated,
)
from bifurc.control.linearization import NODES, Kick, Linearization, Piece, flow, gauss, places
from bifurc.control.ogy import UNSTABLE, ControlStatus, OGYController, _above, placed
from bifurc.ensemble.outcomes import CellState
from bifurc.orbits.shooting.labels import Labels

A = np.array([[0.2, 1.0], [-1.5, -0.1]])
ROW = np.array([[1.0, 0.5]])
PUSH = np.array([[0.0], [-1.0]])


def constant_piece(span=1.3, kick=None, A=A):
    return Piece(kick, 0.0, span, np.repeat(A[None], NODES, axis=0), PUSH, True)


def varying_piece(span=1.3):
    points, _, _ = gauss()
    return Piece(None, 0.0, span, np.array([A * (1.0 + span * t) for t in points]), PUSH, False)


def kick_of(S, push=0.0, jump=0.0):
    return Kick(
        np.array(S, float), np.full((2, 1), push), np.zeros(2), np.full(1, jump), np.zeros((2, 1)), np.zeros((2, 1)), "stop"
    )


def linear(*pieces, kept=()):
    unit = np.eye(3 if kept else 2)
    orbit = SimpleNamespace(weights=np.array([1.0, 4.0]), _followed=unit)
    return Linearization(orbit, pieces, ROW, Labels.of(unit[list(kept)]))


# linear equations of an orbit


def test_gauss_collocation_integrates_polynomials():
    points, inner, ends = gauss()
    for k in range(NODES):
        np.testing.assert_allclose(inner @ points**k, points ** (k + 1) / (k + 1), atol=1e-14)
    for k in range(2 * NODES - 1):
        assert ends @ points**k == pytest.approx(1.0 / (k + 1), abs=1e-14)
        if k < NODES:
            assert _last_values() @ points**k == pytest.approx(1.0, abs=1e-10)


@pytest.mark.parametrize("kappa", [0.0, 0.7 - 0.4j])
def test_transitions_are_those_of_the_equations_with_feedback(kappa):
    """dy = A(t) dy + b kappa s between, S + kappa push C at an event."""
    S = np.array([[0.8, 0.1], [-0.3, -0.6]])
    made = linear(constant_piece(), Piece(kick_of(S, 0.25), 0.0, 0.9, varying_piece(0.9).A, PUSH, False))
    found = made.transition(np.array([kappa, 0.0]))
    BK = PUSH @ ROW * kappa

    def carried(f, span):
        y = np.eye(2, dtype=complex)
        return np.column_stack(
            [solve_ivp(lambda t, v: (f(t) + BK) @ v, (0.0, span), y[:, i], rtol=1e-11, atol=1e-12).y[:, -1] for i in range(2)]
        )

    want = carried(lambda t: A * (1.0 + t), 0.9) @ (S + kappa * np.full((2, 1), 0.25) @ ROW) @ carried(lambda t: A, 1.3)
    np.testing.assert_allclose(found[0], want, atol=1e-8)
    fixed = linear(Piece(np.array([[0.0, 1.0], [1.0, 0.0]]), 0.0, 1.3, constant_piece().A, PUSH, True))
    np.testing.assert_allclose(fixed.transition(np.zeros(1))[0], carried_exact(1.3) @ [[0.0, 1.0], [1.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(flow(constant_piece(), A[None, None])[0], carried_exact(1.3), atol=1e-12)
    assert linear(kept=[1]).reduced(np.arange(9.0).reshape(1, 3, 3)).tolist() == [[[0.0, 2.0], [6.0, 8.0]]]
    assert linear().reduced(found) is found


def carried_exact(span):
    from scipy.linalg import expm

    return expm(A * span)


def test_events_at_which_the_coordinate_jumps():
    still, jumps, tiny = kick_of(np.eye(2)), kick_of(np.eye(2), jump=-2.0), kick_of(np.eye(2), jump=1e-12)
    assert linear(*(constant_piece(kick=kick) for kick in (still, jumps, tiny, None))).jumping == [jumps]
    assert linear(constant_piece(kick=still)).jumping == [] and linear().jumping == []
    rounding = kick_of(np.eye(2), jump=1e-15)  # of a coordinate of size 3: a jump alone does not say that it is one
    assert linear(constant_piece(kick=rounding)).jumping == []
    section = Piece(np.eye(2), 0.0, 1.0, constant_piece().A, PUSH, True)
    assert linear(section, constant_piece(kick=still)).kicks == [still]


def test_places_of_feedback():
    assert places(1) == [{"dof": 1}] and places("top") == [{"dof": "top"}] and places([1, -2.5]) == [{"row": (1.0, -2.5)}]
    assert places([[1, 0], [0, 2]]) == [{"row": (1.0, 0.0)}, {"row": (0.0, 2.0)}]
    for wrong in (np.empty((0, 2)), np.zeros((1, 1, 1))):
        with pytest.raises(ValueError, match="must be a degree of freedom, n factors, or several rows"):
            places(wrong)
    assert linearization.TURN == 1.0


# quasipolynomials


class Scalar:
    """Phi(kappa) = exp((a - kappa) T) of y' = a y - p."""

    rows, kept = np.ones((1, 1)), []

    def __init__(self, a, T=1.0):
        self.a, self.T = a, T

    def transition(self, kappa):
        with np.errstate(over="ignore", invalid="ignore"):
            return np.exp((self.a - np.asarray(kappa)) * self.T)[:, None, None]

    def reduced(self, M):
        return M


@pytest.mark.parametrize("memory", [0.0, 0.4])
def test_the_characteristic_function_and_its_count(memory):
    """F = 1 - mu exp(a - K (1 - mu)/(1 - R mu)); zeros counted by a grid of Newton starts."""
    made = Characteristic(Scalar(0.7), memory)
    mu = np.array([0.3 + 0.2j, -0.5])
    np.testing.assert_allclose(made(mu, 0.9), 1.0 - mu * np.exp(0.7 - 0.9 * (1.0 - mu) / (1.0 - memory * mu)))
    for gain in (0.3, 2.0, -1.0):
        found = []
        for r in np.linspace(0.05, 1.5, 12):
            for angle in np.linspace(0.0, np.pi, 12):
                with np.errstate(all="ignore"):  # far starts may run away
                    z = made.root(r * np.exp(1j * angle), gain)
                if z is not None and not any(abs(z - w) < 1e-8 for w in found):
                    assert abs(made(z, gain)[0]) < 1e-9
                    found.append(z)
        for radius in (0.6, 1.0, 1.3):
            inside = [z for z in found if abs(z) < radius * (1 - 1e-6)]
            want = sum(1 if abs(z.imag) < 1e-9 else 2 for z in {complex(round(z.real, 7), round(abs(z.imag), 7)) for z in inside})
            assert made.count(gain, radius) == want
    if memory:
        with pytest.raises(ValueError, match="with memory 0.4 it must be below 2.5"):
            made.count(0.3, 2.5)
    real = made.root(0.5 + 0j, 0.3)
    assert real.imag == 0.0


def test_a_multiplier_on_the_circle_has_no_count_and_no_root_far_from_one():
    turn = np.array([[np.cos(1.0), -np.sin(1.0)], [np.sin(1.0), np.cos(1.0)]], complex)
    flip = Characteristic(SimpleNamespace(transition=lambda kappa: np.tile(turn, (len(kappa), 1, 1)), reduced=lambda M: M))
    with pytest.raises(OnCircle, match="circle of radius 1 to rounding at the gain 0.5"):
        flip.count(0.5)
    assert flip.count(0.5, 0.9) == 0 and flip.count(0.5, 1.1) == 2
    nothing = Characteristic(SimpleNamespace(transition=lambda kappa: np.zeros((len(kappa), 1, 1), complex), reduced=lambda M: M))
    assert nothing.root(0.5, 1.0) is None and nothing.count(1.0) == 0


def test_crossings_of_the_circle():
    """-exp((a - 2 K)) at mu = -1: the flip lies at 2 K = a + i pi turned away: of Phi = -exp(a - kappa) at K = a/2."""
    a = 0.7
    turned = SimpleNamespace(transition=lambda kappa: -np.exp(a - np.asarray(kappa))[:, None, None], reduced=lambda M: M)
    angle, gain, error = Characteristic(turned).crossing(np.pi - 1e-8, 0.4, 0.4)
    assert angle == np.pi and gain == pytest.approx(a / 2.0, abs=1e-12) and error < 1e-12
    made, h = Characteristic(turned), 1e-4
    slope = complex(made(np.array([-1.0]), np.array([gain + h]))[0] - made(np.array([-1.0]), np.array([gain - h]))[0]) / (2.0 * h)
    largest = np.abs(made(np.exp(1j * np.linspace(0.0, np.pi, 5)), np.full(5, gain))).max()
    assert error == pytest.approx(64.0 * 2.2e-16 * largest / abs(slope), rel=0.05)  # what the rounding of the function makes of it
    pair = Characteristic(Scalar(0.3, 2.0))  # mu = e^(-i t): 1 = e^(-i t) exp(2 (a - K (1 - e^(-i t))))
    angle, gain, _ = pair.crossing(2.0, -1.0, 1.0) or (None, None, None)
    if angle is not None:
        z = np.exp(-1j * angle)
        assert abs(1.0 - z * np.exp(2.0 * (0.3 - gain * (1.0 - z)))) < 1e-9


@pytest.mark.parametrize("memory", [0.0, 0.3])
def test_both_methods_give_the_same_multipliers(memory):
    made = linear(
        constant_piece(0.8), Piece(kick_of([[0.8, 0.1], [-0.3, -0.6]], 0.25), 0.0, 0.7, varying_piece(0.7).A, PUSH, False)
    )
    operator, equation = Collocated(made, memory), Characteristic(made, memory)
    assert operator.size == 2 + 2 * NODES * (2 if memory else 1)
    for gain in (0.0, 0.4, -0.6):
        values = operator.multipliers(gain)
        leading = [v for v in values if abs(v) > 0.35 and abs(v - memory) > 1e-3]
        assert leading and abs(values[0]) == max(abs(values)) and operator.leading(gain) == values[0]
        for value in leading:
            assert abs(equation(1.0 / value, gain)[0]) < 1e-6
        if not gain:
            np.testing.assert_allclose(
                np.sort_complex(values[:2]), np.sort_complex(np.linalg.eigvals(made.transition(np.zeros(1))[0])), atol=1e-10
            )
    assert odd_number(made) == (np.linalg.det(np.eye(2) - made.transition(np.zeros(1))[0]) < 0.0)
    assert odd_number(linear(constant_piece(A=np.diag([0.5, -0.5])))) and not odd_number(
        linear(constant_piece(A=np.diag([0.5, 0.4])))
    )
    twice = repeated(made, 3)
    np.testing.assert_allclose(
        twice.transition(np.zeros(1))[0], np.linalg.matrix_power(made.transition(np.zeros(1))[0], 3), atol=1e-12
    )


# ends of a range of gains


class Growth:
    """A modulus over the gain in closed form."""

    polished = True

    def __init__(self, modulus, stable=True):
        self.of, self.stable, self.asked = modulus, stable, []

    def modulus(self, gain):
        return float(self.of(gain))

    def end(self, low, high):
        from scipy.optimize import brentq

        return SimpleNamespace(gain=brentq(lambda k: self.modulus(k) - 1.0, low, high, xtol=1e-13))

    def confirmed(self, gain):
        self.asked.append(gain)
        if self.stable is None:
            raise OnCircle
        return self.stable


def scanned(analysis, bounds=(0.0, 1.0), samples=11):
    return _scan("orbit", "velocity", bounds, 0.2, analysis, samples)


def test_intervals_ends_and_the_best_gain():
    found = scanned(Growth(lambda k: 0.5 + 8.0 * (k - 0.43) ** 2))
    edge = 0.25
    assert [end.gain for end in found.ends] == pytest.approx([0.43 - edge, 0.43 + edge], abs=1e-10)
    assert found.intervals == (pytest.approx((0.18, 0.68), abs=1e-10),) and found.status is FeedbackStatus.FOUND
    assert found.best_gain == pytest.approx(0.43, abs=1e-6) and found.best_modulus == pytest.approx(0.5)
    both = scanned(Growth(lambda k: 1.0 + 0.5 * np.cos(2.0 * np.pi * k) - 0.2 * k))
    assert len(both.intervals) == 1 and len(both.ends) == 2 - (both.moduli[-1] < 1.0)
    open_ = scanned(Growth(lambda k: 0.5 + k))
    assert open_.intervals == (pytest.approx((0.0, 0.5)),) and len(open_.ends) == 1 and open_.best_gain < 1e-3
    right = scanned(Growth(lambda k: 1.6 - k))
    assert right.intervals == (pytest.approx((0.6, 1.0)),)
    two = scanned(Growth(lambda k: 1.0 + 0.3 * np.cos(4.0 * np.pi * k) + 0.1 * k))
    assert len(two.intervals) == 2 and abs(two.best_gain - 0.25) < 0.02  # the lower of both


@pytest.mark.parametrize(
    ("modulus", "stable", "status"),
    [
        (lambda k: 0.5, True, "EVERYWHERE"),
        (lambda k: 1.5, True, "NEVER_STABLE"),
        (lambda k: 0.5 + k, False, "DISPUTED"),
        (lambda k: 0.5 + k, None, "DISPUTED"),
    ],
)
def test_statuses_of_a_range(modulus, stable, status):
    analysis = Growth(modulus, stable)
    found = scanned(analysis)
    assert found.status is FeedbackStatus[status] and (found.best_gain is None) == (status == "NEVER_STABLE")
    if status == "DISPUTED":
        assert analysis.asked == [pytest.approx(0.25)]
    with pytest.raises(ArithmeticError, match="not finite at the gain 0.3"):
        scanned(Growth(lambda k: np.inf if 0.25 < k < 0.35 else 0.5))


def test_an_interval_between_two_samples_is_seen():
    """A dip below 1 that no sample shows, and a hump above it."""
    for sign in (1.0, -1.0):
        analysis = Growth(lambda k, sign=sign: 1.0 + sign * (40.0 * (k - 0.46) ** 2 - 0.02))
        gains = np.linspace(0.0, 1.0, 11)
        moduli = np.array([analysis.modulus(k) for k in gains])
        found, values = _extrema(analysis, gains, moduli)
        assert (
            len(found) == 12
            and found[5] == pytest.approx(0.46, abs=1e-3)
            and values[5] == pytest.approx(1.0 - sign * 0.02, abs=1e-4)
        )
        assert (np.diff(found) > 0.0).all()
        assert len(scanned(analysis).ends) == 2
    far = Growth(lambda k: 1.0 + 4.0 * (k - 0.46) ** 2 + 0.3)
    assert _extrema(far, gains, np.array([far.modulus(k) for k in gains]))[0] is gains
    assert _best(Growth(lambda k: abs(k - 0.3)), gains, np.abs(gains - 0.3), 0.05, 0.9)[0] == pytest.approx(0.3, abs=1e-6)


def test_kinds_of_the_ends_of_smooth_feedback():
    class Ends(_Smooth):
        def __init__(self, leading, crossing):
            self.operator = SimpleNamespace(leading=leading)
            self.equation = SimpleNamespace(crossing=lambda angle, gain, size: crossing, count=lambda gain: 0)

    def negative(k):
        return -(0.5 + k) + 0j

    def pair(k):
        return (0.5 + k) * np.exp(1j)

    for leading, crossing, kind, multiplier in (
        (negative, (math.pi, 0.5, 1e-14), EndKind.PERIOD_DOUBLING, -1.0),
        (pair, (1.0, 0.5, 1e-14), EndKind.NEIMARK_SACKER, np.exp(1j)),
        (negative, None, EndKind.PERIOD_DOUBLING, -1.0),
        (pair, None, EndKind.NEIMARK_SACKER, np.exp(1j)),
        (pair, (1.0, 7.0, 1e-14), EndKind.NEIMARK_SACKER, np.exp(1j)),
    ):  # polished away: the bracket counts
        end = Ends(leading, crossing).end(0.2, 0.9)
        assert (
            end.kind is kind and end.gain == pytest.approx(0.5, abs=1e-9) and end.multiplier == pytest.approx(multiplier, abs=1e-8)
        )
        assert 0.0 < end.error < 1e-9
    made = Ends(negative, None)
    assert made.confirmed(0.3) and made.modulus(0.25) == pytest.approx(0.75)
    made.equation.count = lambda gain: 1
    assert not made.confirmed(0.3)


def test_bounds_and_delays():
    assert _bounds((0, 2)) == (0.0, 2.0) and _repeats(None) == 1 and _repeats(3) == 3 and _repeats(2.0) == 2
    for wrong, said in (
        ((1.0, 1.0), "must be below"),
        ((2.0, 1.0), "must be below"),
        (3.0, r"give \(low, high\)"),
        ((0.0, np.nan), "bounds"),
    ):
        with pytest.raises(ValueError, match=said):
            _bounds(wrong)
    for wrong in (0.0, -1.0, 1.5, 0.4):
        with pytest.raises(ValueError, match="delay"):
            _repeats(wrong)


# small changes of a parameter


def test_unstable_multipliers_are_put_to_zero_and_stable_ones_stay(rng):
    P = rng.normal(size=(4, 4))
    mu = np.array([2.5, -1.7, 0.4, -0.2])
    M = P @ np.diag(mu) @ np.linalg.inv(P)
    g = rng.normal(size=4)
    V = _above(M, UNSTABLE)
    assert V.shape == (4, 2)
    np.testing.assert_allclose(V.T @ V, np.eye(2), atol=1e-12)
    gain = placed(M, g, V, "p")
    closed = np.linalg.eigvals(M - np.outer(g, gain))
    np.testing.assert_allclose(np.sort(closed.real), np.sort([0.0, 0.0, 0.4, -0.2]), atol=1e-5)
    dead = placed(M, g, np.eye(4), "p")
    np.testing.assert_allclose(np.linalg.matrix_power(M - np.outer(g, dead), 4), 0.0, atol=1e-8)
    with pytest.raises(ValueError, match="parameter 'p' does not act"):
        placed(M, P[:, 2] + P[:, 3], V, "p")
    with pytest.raises(ValueError, match="the multiplier 2.5 stays"):
        placed(M, P[:, 1] + P[:, 3], V, "p")
    with pytest.raises(ValueError, match="does not act"):
        placed(2.0 * np.eye(2), np.array([1.0, 0.5]), np.eye(2), "p")  # one number cannot hold two equal ones
    assert _above(np.diag([0.5, -0.9]), UNSTABLE).shape == (2, 0) and _above(np.diag([0.5, -1.1]), UNSTABLE).shape == (2, 1)


def test_corrections_and_their_window():
    made = OGYController(None, "p", 0.0, np.array([1.0, 2.0]), np.eye(2), np.ones(2), np.array([3.0, -4.0]), np.zeros(2), "ogy")
    assert made.correction([1.1, 2.0]) == pytest.approx(-0.3) and made.correction([1.0, 2.1]) == pytest.approx(0.4)
    assert made.correction([1.1, 2.0], 0.31) == pytest.approx(-0.3) and made.correction([1.1, 2.0], 0.29) == 0.0
    assert made.window(0.5) == pytest.approx(0.1) and made.status is ControlStatus.READY
    idle = OGYController(None, "p", 0.0, np.zeros(2), np.eye(2), np.ones(2), np.zeros(2), np.zeros(2), "ogy")
    assert idle.window(0.5) == np.inf and idle.status is ControlStatus.STABLE_ALREADY and idle.message == idle.status.sentence
    with pytest.raises(ValueError, match="limit"):
        made.window(0.0)


# basins under feedback


def watched(states, places=((1.0, 0.0),), tolerance=0.1, stay=3, blind=0, weights=(2.0, 0.5)):
    watch = Watch(np.array(places), np.array(weights), tolerance, stay, blind)
    for k, state in enumerate(states):
        if watch(np.array(state, float)):
            return watch, k + 1
    return watch, None


def test_motions_that_stay_near_the_orbit_and_come_nearer():
    nearer = [(1.0 + 0.16 * 0.3**k, 0.0) for k in range(20)]
    watch, when = watched(nearer)
    assert when == 3 and watch.state is CellState.ATTRACTED and watch.cycle.shape == (0, 2)
    assert watched(nearer, stay=6)[1] == 6 and watched(nearer, blind=4)[1] == 7
    same = [(1.0 + 0.16 * (-1.0) ** k, 0.0) for k in range(4)]
    assert watched(same)[1] is None  # near, but no nearer
    assert watched([(1.5, 0.0), *nearer], tolerance=0.1)[1] == 4  # the row begins when it is near
    far = [(1.0 + 0.21 * 0.999**k, 0.0) for k in range(3)]
    assert watched(far)[1] is None
    turns = [(0.0, 0.0), (1.0, 0.0)]
    two = [(turns[(k + 1) % 2][0] + 0.1 * 0.3**k, 0.0) for k in range(30)]
    watch, when = watched(two, places=turns, stay=3)
    assert when == 4 and watch.cycle.shape == (0, 2)
    shifted = [(turns[k % 2][0] + 0.1 * 0.3**k, 0.0) for k in range(30)]
    assert watched(shifted, places=turns, stay=3)[1] == 4


@pytest.mark.parametrize("q", [1, 2, 3])
def test_motions_that_repeat_elsewhere(q):
    row = [(5.0 + k % q, 0.25 * (k % q)) for k in range(40)]
    watch, when = watched([(9.0, 9.0), *row], stay=4)
    assert when == 1 + 4 + q and watch.state is CellState.ATTRACTED
    assert {tuple(point) for point in watch.cycle.tolist()} == set(row[:q]) and len(watch.cycle) == q
    watch, when = watched([(k * 1.0, 7.0) for k in range(60)])
    assert when is None and watch.state is CellState.UNSETTLED and watch.cycle is None
    assert watched(row, stay=4, blind=5)[1] == 5 + 4 + q


def test_chunks_of_starts_are_read_as_they_were_written():
    part = [
        (CellState.ATTRACTED, 7, np.empty((0, 2))),
        (CellState.OUTSIDE, 0, None),
        (CellState.ATTRACTED, 9, np.array([[1.0, 2.0], [3.0, 4.0]])),
        (CellState.ATTRACTED, 5, np.array([[5.0, 6.0]])),
    ]
    found = unpacked(*packed(part))
    for (a, b, c), (x, y, z) in zip(part, found, strict=True):
        assert a is x and b == y and (c is None) == (z is None)
        if c is not None and len(c):
            np.testing.assert_array_equal(c, z)
    assert unpacked(*packed([])) == []


def test_motions_that_are_met_are_numbered_in_the_order_of_the_starts():
    grid = SimpleNamespace(shape=(2, 3))
    orbit = SimpleNamespace(weights=np.array([2.0, 0.5]))
    one, other = np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([[1.0, 2.0], [3.0, 5.0]])
    near = one[::-1] + 0.5 * basins.SAME * np.array([2.0, 0.5])
    found = [
        (CellState.OUTSIDE, 0, None),
        (CellState.ATTRACTED, 3, one),
        (CellState.ATTRACTED, 4, np.empty((0, 2))),
        (CellState.ATTRACTED, 5, other),
        (CellState.ATTRACTED, 6, near),
        (CellState.ATTRACTED, 7, one[:1]),
    ]
    made = _numbered(None, orbit, grid, "free", found, "key")
    assert made.labels.tolist() == [[-1, 1, 0], [2, 1, 3]] and made.periods.tolist() == [[0, 3, 4], [5, 6, 7]]
    assert made.states[0, 0] == CellState.OUTSIDE.code and made.states[0, 1] == CellState.ATTRACTED.code
    assert made.attractors[0] is orbit and [item.periods for item in made.attractors[1:]] == [2, 2, 1]
    np.testing.assert_array_equal(constant(np.array([1.0, 2.0]), np.zeros(3)), [[1.0, 2.0]] * 3)


@pytest.mark.parametrize(("growths", "held"), [((), True), ((0.9, 0.2), True), ((1.3, 0.2), False), ((1.3, 1.1), False)])
def test_a_gain_at_a_jump_holds_where_no_pattern_of_signs_grows(growths, held):
    """One that grows is enough, and none at all means that everything dies."""
    jumping = object.__new__(_Jumping)
    jumping.order = SimpleNamespace(growths=lambda gain: [(growth, ((1,), (-1,))) for growth in growths])
    assert jumping.confirmed(0.1) is held
