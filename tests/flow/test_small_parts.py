"""Small functions of simulation, one by one: sums, choices and limits on numbers where every place differs from the others."""
import heapq
import math
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.polynomial import Polynomial

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.compose.tables import ORDER
from bifurc.flow import hysteresis, periodic, saltation, settle, simulate
from bifurc.flow.affine import engine
from bifurc.flow.delayed import history, integration, motion, verb
from bifurc.flow.modal import steps
from bifurc.flow.rule import NOISE
from bifurc.flow.settle import PENETRATION
from bifurc.flow.trajectory import PER_PERIOD, Trajectory
from tests.reference.plain import plain

# ---- sums over tables ----------------------------------------------------------------------------------------------------------


def test_a_state_by_taylor_rows(rng):
    T = SimpleNamespace(A=np.zeros((2, 3, 5)), YT=rng.normal(size=(2, 3, 5, ORDER + 1)))
    x, y, s = rng.normal(size=5), np.empty(3), 0.7
    plain(engine.remainder)(T, 1, x, s, y)
    assert y == pytest.approx([sum(Polynomial(T.YT[1, i, c])(s) * x[c] for c in range(5)) for i in range(3)], rel=1e-12)


def test_the_rate_of_a_guard_is_that_of_states_and_of_forcing():
    row, f, dw = np.array([2.0, -3.0, 5.0, 7.0]), np.array([1.0, 10.0]), np.array([100.0, 1000.0])
    assert plain(engine.guard_rate)(row, f, dw) == 2.0 - 30.0 + 500.0 + 7000.0


@pytest.mark.parametrize("modal", [False, True])
def test_series_of_guards_whose_zero_has_a_known_order(modal, rng):
    """Written for those guards alone; modal ones reach as far as the worst of them lets them."""
    level = np.array([[0.0, 0.0, 0.0, 0.0], [0.1, 0.2, 0.4, 0.8]])
    T = SimpleNamespace(n_guards=np.array([1, 3]), GS=rng.normal(size=(2, 3, 4, ORDER + 1)), level=level,
                        blocks=np.array([[0, 0, 0, 0], [0, 0, 0, 4]]))
    a, x, orders = np.full((3, ORDER + 1), 9.0), rng.normal(size=4), np.array([1, ORDER, 0])
    known = np.full((3, ORDER + 1), 9.0)
    for g in (0, 2):
        known[g] = x @ T.GS[1, g]
    if modal:
        def to_modal(T_, m, y, xi):
            xi[:] = y
        found = plain(steps.modal_series, to_modal=to_modal, amplitudes=lambda *args: None,
                      good_for=lambda T_, m, g, size: ([2, 0, 1][g], 0.0))(T, 1, x, orders, a)
        assert found == 0.2
        nothing = plain(steps.modal_series, to_modal=to_modal, amplitudes=lambda *args: None)
        assert nothing(T, 1, x, np.full(3, ORDER), a.copy()) == 0.8
    else:
        def series(T_, m, g, y, out):
            out[:] = y @ T_.GS[m, g]
        assert plain(engine.all_series, guard_series=series, reach=lambda T_, m, y: 0.3 * m)(T, 1, x, orders, a) == 0.3
    assert a == pytest.approx(known, rel=1e-12)


def test_the_longest_step_whose_series_is_good():
    """Levels .1 2^(k/2): of a step s the terms that are left out grow as s^(ORDER+1)."""
    T = SimpleNamespace(tail=np.zeros((2, 2, 3, 2)), blocks=np.array([[0, 0, 0, 1], [0, 0, 0, 7]]),
                        level=0.1 * 2.0 ** (np.ones((2, 1)) * np.arange(7) / 2))
    size = np.array([3.0, 2.0, 0.0])
    T.tail[1, 1, :, 0] = 5.0, 1.0, 77.0
    good = plain(steps.good_for)
    assert good(T, 1, 1, size) == (6, 17.0)  # nothing is left out
    for k in range(7):
        for off, level in ((1.01, k), (0.99, max(k - 1, 0))):
            T.tail[1, 1, :, 1] = 0.0, 0.5 * steps.TRUNCATED * 17.0 / (off * T.level[1, k]) ** (ORDER + 1), 99.0
            assert good(T, 1, 1, size) == (level, 17.0)
    T.tail[1, 1, 1, 1] = 0.5 * steps.TRUNCATED * 17.0
    assert good(T, 1, 1, size)[0] == 6  # not beyond the last
    T.tail[1, 1, :, 0] = 0.0
    assert good(T, 1, 1, size) == (0, 0.0)


def test_factors_of_exponentials_are_those_of_the_sum(rng):
    c, theta = rng.normal(size=5), 0.83
    p = periodic._complex((1, 3), c, 4)
    known = c[0] + c[1] * math.cos(theta) + c[2] * math.sin(theta) + c[3] * math.cos(3 * theta) + c[4] * math.sin(3 * theta)
    assert p.size == 9 and p @ np.exp(1j * np.arange(-4, 5) * theta) == pytest.approx(known, abs=1e-14)
    assert p == pytest.approx(np.conj(p[::-1]), abs=1e-15) and not p[[0, 2, 6, 8]].any()


def test_a_product_of_matrices_in_place(rng):
    a, b, scratch = rng.normal(size=(3, 5)), rng.normal(size=(3, 3)), np.full((3, 3), np.nan)
    known = a[:, :3] @ b
    plain(saltation.premultiply)(a, b, scratch)
    assert b == pytest.approx(known, rel=1e-12)


# ---- what may begin ------------------------------------------------------------------------------------------------------------


def sliders(ns=5, algebraic=None):
    """Two masses whose elements 1 and 2 own one place of memory each (4 and 5); element 0 has none."""
    return SimpleNamespace(n=2, ns=ns, algebraic=lambda m: algebraic[m], system=SimpleNamespace(elements=[None] * 3),
                           memory_of=lambda e: [range(0), range(4, 5), range(5, 6)][e])


ROW = np.array([1.0, 0, 0, 0, 0, 0, -0.5])
SLIP = {0: [(4, ROW)], 1: [(4, -ROW)], 2: [], 3: [(5, ROW)], 4: [(4, ROW), (5, 3 * ROW)]}


def test_memory_that_is_not_at_its_limit():
    scene, x = sliders(6, SLIP), np.array([2.0, 0, 0, 0, 1.5, 1.5, 1.0])
    assert settle._off_limits(scene, 0, x, NOISE) == settle._off_limits(scene, 2, x, NOISE) == []
    assert settle._off_limits(scene, 4, x, NOISE) == [5] and settle._off_limits(scene, 1, x, NOISE) == [4]
    for noise in (0.02, NOISE):  # of the terms: 2 and a half of the forcing's amplitude, and the memory
        for sign in (1.0, -1.0):
            for part, found in ((0.9, []), (1.1, [4])):
                x[4] = 1.5 + sign * part * noise * (2.5 + 1.5)
                assert settle._off_limits(scene, 0, x, noise) == found
    assert settle._off_limits(sliders(4, SLIP), 1, x, NOISE) == []  # there is no memory


def test_elements_that_would_leap():
    scene, x = sliders(6, SLIP), np.array([2.0, 0, 0, 0, 1.5, 0.3, 1.0])
    assert settle.leaping(scene, 0, 0, x, ()) == [] and settle.leaping(scene, 0, 2, x, ()) == []
    assert settle.leaping(scene, 0, 1, x, ()) == [1] and settle.leaping(scene, 0, 1, x, (1,)) == [1]  # another limit at once
    assert settle.leaping(scene, 2, 3, x, ()) == [2] and settle.leaping(scene, 3, 3, x, ()) == []
    assert settle.leaping(scene, 3, 2, x, ()) == [2] and settle.leaping(scene, 3, 2, x, (2,)) == []  # it has to be written
    assert settle.leaping(scene, 3, 2, x, (1,)) == [2]
    x[5] = 1.5 + 0.9 * PENETRATION * 4.0
    assert settle.leaping(scene, 3, 2, x, ()) == []
    assert settle.leaping(sliders(4, SLIP), 0, 1, x, ()) == []


def test_all_ways_of_resting_together():
    """A circle slides either way or rolls, a flat stop rests; what cannot be together is left out."""
    modes = {"go": SimpleNamespace(hold=()), "left": SimpleNamespace(hold=(1,)), "roll": SimpleNamespace(hold=(1, 2))}
    element = SimpleNamespace(mode=lambda key, core: modes[key])
    ways = {3: ["go", "left"], 4: ["roll"], 5: ["left", "go"]}
    scene = SimpleNamespace(system=SimpleNamespace(elements=[element, element, None], core=None), is_curved=lambda e: e < 2,
                            guards_of=lambda m, e: {0: [3, 4], 1: [5]}[e], followers=lambda m, g, x: ways[g],
                            combined=lambda m, keys: None if keys[0] == "roll" else (m, *keys.items()))
    found = list(settle._restings(scene, 7, {0: "rest", 1: "rest", 2: "lies"}, None))
    assert found == [(7, (0, "left"), (1, "left"), (2, "lies"))]
    scene.combined = lambda m, keys: keys
    assert list(settle._restings(scene, 7, {0: "rest", 2: "lies"}, None)) == [{0: "left", 2: "lies"}, {0: "roll", 2: "lies"}]


def test_forcing_states_of_a_phase():
    scene, x = SimpleNamespace(ns=2, harmonics=(1, 4), omega=1.7), np.full(7, 5.0)
    simulate._forcing(scene, 0.6, x)
    assert x == pytest.approx([5.0, 5.0, 1.0, math.cos(1.02), math.sin(1.02), math.cos(4.08), math.sin(4.08)], rel=1e-14)
    scene.omega = None
    simulate._forcing(scene, 0.6, x)
    assert x.tolist() == [5.0, 5.0, 1.0, 1.0, 0.0, 1.0, 0.0]


@pytest.mark.parametrize("law", [False, True])
def test_orders_of_the_zeros_at_a_start(law):
    """Inside, on the surface to some order, or leaving: that fires at once, which is order zero; under a law with its rate.

    Four masses without springs between them: one before its stop, three on theirs that go away, are pulled away, are pushed in.
    """
    pulls, stops = enumerate((0.0, 0.0, -0.5, 0.5)), enumerate((1.0, 0.0, 0.0, 0.0))
    elements = [bf.elements.HarmonicForce(1.0, dof=0), *(bf.elements.ConstantForce(pull, dof=k) for k, pull in pulls),
                *(bf.elements.RigidStop(gap, 0.7, dof=k) for k, gap in stops)]
    elements += law * [bf.elements.CubicSpring(0.8, dof=0)]
    scene = scene_of(bf.System(np.eye(4), np.zeros((4, 4)), np.eye(4), elements, omega=1.0))
    x = np.zeros(scene.ns + scene.nw)
    x[5] = -0.3
    simulate._forcing(scene, 0.0, x)
    ints, floats = np.full(30, -7), np.zeros(30)
    simulate._orders(scene, next(iter(scene.start_modes())), x, ints, floats)
    assert ints[simulate.ORDERS:simulate.ORDERS + 5].tolist() == [0, 1, 2, 0, -7]
    rates = floats[simulate.SLOPES:simulate.SLOPES + 4]
    assert rates == pytest.approx([math.nan, -0.3 if law else math.nan, math.nan, math.nan], rel=1e-12, nan_ok=True)
    assert np.count_nonzero(floats) == 4


# ---- motions of a delay --------------------------------------------------------------------------------------------------------


def test_points_and_integrals_of_a_piece():
    """Powers of the time up to the highest are integrated to the last digit; the interpolation has the weights of its points."""
    points, inner, weights, barycentric = history._tables()
    c = points[1:]
    assert points.size == history.COUNT + 1 and points[0] == 0.0 and (np.diff(points) > 0.0).all()
    for k in range(history.COUNT):
        assert inner @ c**k == pytest.approx(c ** (k + 1) / (k + 1), abs=1e-14)
    for k in range(2 * history.COUNT):
        assert weights @ c**k == pytest.approx(1.0 / (k + 1), abs=1e-14)
    t = 0.37
    rows = barycentric / (t - points)
    assert rows @ points**history.COUNT / rows.sum() == pytest.approx(t**history.COUNT, abs=1e-13)
    assert np.abs(barycentric).max() == 1.0


def test_coefficients_of_legendre_polynomials(rng):
    x, c = np.polynomial.legendre.leggauss(integration.COUNT)[0], rng.normal(size=integration.COUNT)
    assert integration._legendre() @ np.polynomial.legendre.legval(x, c) == pytest.approx(c, abs=1e-13)


def test_what_the_past_adds_to_forces(rng):
    """g (y + R F) of the past, where F is what is fed back; nothing before the past is known."""
    states, delayed, rows = rng.normal(size=(3, 4)), rng.normal(size=(3, 2)), rng.normal(size=(2, 4))
    asked = []

    def at(t):
        asked.append(t)
        return states, delayed, np.array([True, False, True])

    gain, repeat = np.array([0.3, -0.7]), np.array([0.5, 0.9])
    run = SimpleNamespace(history=SimpleNamespace(at=at), delay=2.0, gain=gain, repeat=repeat, rows=rows)
    force = integration._Integration._past(run, np.array([2.5, 3.0, 4.0]))
    assert asked[0].tolist() == [0.5, 1.0, 2.0]
    for k in range(3):
        for i in range(2):
            seen = gain[i] * (rows[i] @ states[k])
            known = (1.0 - repeat[i]) * seen + repeat[i] * delayed[k, i]
            assert force[k, i] == pytest.approx(known if k != 1 else 0.0, abs=1e-14)


def reach(breaks, t=2.0, stop=9.0, step=0.4, delay=0.7):
    heapq.heapify(breaks)
    went = []
    run = SimpleNamespace(breaks=breaks, T=SimpleNamespace(step=np.array([9.0, step])), delay=delay, _carry_on=went.append)
    return *integration._Integration._reach(run, 1, t, stop), went, sorted(run.breaks)


def test_how_far_a_piece_reaches():
    angle = integration.ANGLE / 0.8
    assert reach([], step=1e-3)[0] == pytest.approx(1e-3 * angle, rel=1e-14)
    assert reach([], step=1e3) == (0.7, None, [], []) and reach([], step=1e3, stop=2.25) == (0.25, None, [], [])
    assert reach([(2.5, 1), (2.6, 2)], step=1e3) == (0.5, (2.5, 1), [], [(2.6, 2)])
    assert reach([(2.75, 1)], step=1e3, delay=0.75) == (0.75, (2.75, 1), [], []) and reach([(2.8, 1)], step=1e3)[:2] == (0.7, None)
    for t in (2.0, -2.0):  # what is already there, to rounding, is carried on from
        h, at, went, left = reach([(t, 1), (t - 0.1, 2), (t + 0.5, 3)], t=t, step=1e3)
        assert (h, at, went, left) == (0.5, (t + 0.5, 3), [(t - 0.1, 2), (t, 1)], [])
        near = (t + 0.9 * integration.SAME * abs(t), 1)
        assert reach([near], t=t, step=1e3)[1:3] == (None, [near])


def test_rates_under_delayed_forces(rng):
    push, delayed, rates = rng.normal(size=(2, 3, 2)), rng.normal(size=2), np.empty(5)

    class Engine:
        @staticmethod
        def field(T, mode, x, f):
            f[:] = mode + x[:3]

        @staticmethod
        def forcing_rate(T, x, dw):
            dw[:] = -x[3:]

    x = rng.normal(size=5)
    run = SimpleNamespace(scene=SimpleNamespace(ns=3), engine=Engine, T=None, push=push)
    integration._Integration._rates(run, 1, x, delayed, rates)
    assert rates == pytest.approx([*(1.0 + x[:3] + push[1] @ delayed), *-x[3:]], abs=1e-14)


@pytest.mark.parametrize("start, stop", [(1.0, 1e3), (-1e3, -1.0)])
def test_times_of_a_motion_to_rounding(start, stop):
    asked = []
    run = SimpleNamespace(start=start, stop=stop, history=SimpleNamespace(at=lambda t: asked.append(t.copy())))
    at = motion.DelayedMotion._at
    assert at(run, [[start - 0.9e-9, stop + 0.9e-9]])[0].shape == (1, 2) and asked[-1].tolist() == [start, stop]
    assert at(run, 0.5 * (start + stop))[0].shape == () and asked[-1].tolist() == [0.5 * (start + stop)]
    assert at(run, [])[0].size == 0
    for outside in (start - 1.1e-9, stop + 1.1e-9, np.nan, [start, stop + 1.0], [start - 1.0, stop]):
        with pytest.raises(ValueError, match=r"t must lie in \["):
            at(run, outside)


def test_pasts_of_all_kinds():
    assert verb.past_of(None, 0.0, 1.0, 2) == (None, [])
    past, events = verb.past_of(lambda t: np.outer(t, [1.0, 2.0]), 0.0, 1.0, 2)
    assert events == [] and past(np.array([1.0, 3.0])).tolist() == [[1.0, 2.0], [3.0, 6.0]]
    with pytest.raises(ValueError, match="history = 3 is not allowed; it must be a motion"):
        verb.past_of(3, 0.0, 1.0, 2)


@pytest.mark.parametrize("given, words", [
    ([[1.0, 2.0, 3.0]], "array of shape"), ([[1.0, 2.0]], "array of shape"), ([1.0, 2.0, 3.0], "array of shape"),
    (5.0, "array of shape"), ([[1.0, 2.0]] * 3, None), ([1, 2], None),
    ([1.0, np.nan], "not finite at t = 1 to 3"), ([1j, 2.0], "real numbers"), (["a", "b"], "real")])
def test_states_of_a_past_of_three_times(given, words):
    def past(t):
        return given
    t = np.array([2.0, 1.0, 3.0])
    if words is None:
        assert verb._states(past, past, 2, t).tolist() == given
    else:
        with pytest.raises(ValueError, match=words):
            verb._states(past, past, 2, t)


# ---- loops and motions as rows -------------------------------------------------------------------------------------------------


def test_rows_of_a_loop_are_those_of_its_piece():
    """Three pieces of a period; times of any period, on a border that of the piece behind it."""
    pieces = tuple(SimpleNamespace(start=start) for start in (0.5, 2.0, 4.0))
    loop = SimpleNamespace(omega=2.0, harmonics=(1,), pieces=pieces)
    rows = np.array([[[1.0, 0, 0]], [[10.0, 0, 0]], [[100.0, 0, 7.0]]])

    def at(angle):
        return hysteresis.Loop._rows(loop, np.array(angle) / 2.0, rows)[..., 0]

    for turn in (0.0, 2.0 * np.pi, -4.0 * np.pi):
        assert at([0.6 + turn, 1.9 + turn, 2.1 + turn, 3.9 + turn]).tolist() == [1.0, 1.0, 10.0, 10.0]
        assert at([4.1 + turn, 6.2 + turn]) == pytest.approx(100.0 + 7.0 * np.sin([4.1, 6.2]), abs=1e-12)
    assert at(2.0) == 10.0 and at([[0.1]]).tolist() == [[1.0]]  # before the first border: no piece is behind the last
    loops = SimpleNamespace(loops=(SimpleNamespace(label="a"), SimpleNamespace(label="b")))
    assert hysteresis.Hysteresis.__getitem__(loops, "b") is loops.loops[1]
    with pytest.raises(KeyError, match="no driven element 'c'; there are a, b"):
        hysteresis.Hysteresis.__getitem__(loops, "c")


def test_guards_that_forbid_a_mode():
    """Four guards c + a sin: below zero, rising through it, falling through it, above; those at zero are told apart."""
    frame = SimpleNamespace(ns=2)
    rows = np.array([[0.0, 1, -0.5, 0, 0], [0, 1, 0.0, 0, 2.0], [0, 1, 0, 0, -2.0], [0, 1, 0.4, 0, 0]])  # memory 1 in all
    run = SimpleNamespace(mode=lambda key: (None, rows, None, None), frame=frame, z=slice(1, 2), harmonics=(1,))
    run.sums = lambda rows_, z: hysteresis._Integration.sums(run, rows_, z)
    leaving = hysteresis._Integration.leaving
    assert leaving(run, "slip", np.array([0.0]), 0.0) == [(1, True), (3, False)]
    assert leaving(run, "slip", np.array([0.0]), np.pi) == [(2, True), (3, False)]
    assert leaving(run, "slip", np.array([0.7]), 0.0) == [(0, False), (1, False), (2, False), (3, False)]
    assert leaving(run, "slip", np.array([-0.4]), 0.0) == []


@pytest.mark.parametrize("same", [False, True])
def test_rows_of_a_motion_have_both_sides_of_events(same):
    """Times in order, each event twice: the state that it leaves and the one that it enters; of two at one time pair by pair."""
    starts = np.array([0.0, 0.25, 0.8, 0.8 if same else 0.9])
    run = SimpleNamespace(start=0.0, stop=1.0, _period=2.0, _starts=starts, _is_event=np.array([False, True, True, True]),
                          _sides=(np.array([[0.0], [-1], [-2], [-3]]), np.array([[0.0], [1], [2], [3]])))
    run_type = type("Motion", (SimpleNamespace,), {"__call__": lambda self, t: np.column_stack([t])})
    t, y = Trajectory._rows.func(run_type(**vars(run)))
    count = math.ceil(PER_PERIOD * 0.5) + 1
    assert t.size == count + 6 and (np.diff(t) >= 0.0).all()
    sides = [(a, b[0]) for a, b in zip(t, y, strict=True) if b[0] != a]
    assert sides == [(0.25, -1.0), (0.25, 1.0), (0.8, -2.0), (0.8, 2.0), (starts[3], -3.0), (starts[3], 3.0)]
    assert y[t == 0.25, 0].tolist() == ([0.25, -1.0, 1.0] if same else [-1.0, 0.25, 1.0])
