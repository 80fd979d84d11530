"""States, derivatives and series of affine modes against the matrix exponential, where no matrix is symmetric."""
import math
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.linalg import expm

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.compose.tables import ORDER
from bifurc.elements import ConstantForce, HarmonicForce, Jenkins, RigidStop
from bifurc.flow.affine import engine, event_free
from bifurc.flow.affine.engine import FAR
from bifurc.flow.dense import sample
from bifurc.flow.rule import jump
from bifurc.flow.saltation import joined as with_it
from bifurc.flow.saltation import order_gap, saltation

free_steps = event_free.free_steps.py_func  # only compiled functions call it: it has no door


@pytest.fixture(scope="module")
def scene():
    """Return three coupled masses, gyroscopic and circulatory, of two harmonics, with moving stops on two of them."""
    rng = np.random.default_rng(81)
    M = np.diag([1.0, 2.5, 0.4]) + 0.1 * (lambda a: a @ a.T)(rng.normal(size=(3, 3)))
    C = 0.1 * np.eye(3) + 0.2 * rng.normal(size=(3, 3))
    K = np.diag([3.0, 1.0, 6.0]) + 0.4 * rng.normal(size=(3, 3))
    forces = [HarmonicForce(0.7, dof=0, phase=0.4), HarmonicForce(0.2, dof=2, harmonic=3, phase=-1.1)]
    stops = [RigidStop(0.5, 0.6, dof=1, amplitude=0.05, phase=0.3, harmonic=1), RigidStop(0.8, 0.3, dof=2, side=-1)]
    return scene_of(bf.System(M, C, K, [*forces, *stops], omega=1.3))


def mode_of(scene):
    return next(m for m in range(len(scene.keys)) if scene.tables.n_holds[m] == 0)


def joined(scene, y, t):
    """Return the state with its forcing at time ``t``."""
    waves = [f(k * scene.omega * t) for k in scene.harmonics for f in (np.cos, np.sin)]
    return np.concatenate([y, [1.0, *waves]])


def whole_matrix(scene, m):
    """Return the matrix of x' = A x, forcing states included."""
    W = np.zeros((scene.nw, scene.nw))
    for i, k in enumerate(scene.harmonics):
        W[1 + 2 * i, 2 + 2 * i], W[2 + 2 * i, 1 + 2 * i] = -k * scene.omega, k * scene.omega
    return np.vstack([scene.tables.A[m], np.hstack([np.zeros((scene.nw, scene.ns)), W])])


def starts(scene, rng, count):
    """Yield joined states of different sizes at different times."""
    for _ in range(count):
        t = rng.uniform(0.0, 20.0)
        yield t, joined(scene, rng.normal(size=scene.ns) * [1.0, 0.1, 3.0, 2.0, 5.0, 0.3], t)


def test_forcing_and_rates_at_any_time(scene, rng):
    T, m = scene.tables, mode_of(scene)
    A = whole_matrix(scene, m)
    for t, x in starts(scene, rng, 5):
        written = np.concatenate([x[:scene.ns], np.full(scene.nw, np.nan)])
        engine.forcing(T, t, written)
        assert written == pytest.approx(x, abs=1e-14)
        f, dw = np.empty(scene.ns), np.empty(scene.nw)
        engine.field(T, m, x, f)
        engine.forcing_rate(T, x, dw)
        assert np.concatenate([f, dw]) == pytest.approx(A @ x, abs=1e-13)


@pytest.mark.parametrize("steps", (0.0, 0.37, 1.0, 2.6, 7.0, 45.3))
def test_state_and_derivative_after_any_time(scene, rng, steps):
    T, m = scene.tables, mode_of(scene)
    s = steps * T.step[m]
    E = expm(whole_matrix(scene, m) * s)
    size = max(1.0, np.abs(E).max())
    for _, x in starts(scene, rng, 4):
        kept = x.copy()
        y, y1, Phi = np.empty(scene.ns), np.empty(scene.ns), np.empty((scene.ns, scene.ns))
        engine.advance(T, m, x, s, y)
        engine.arc(T, m, x, s, y1, Phi)
        assert np.array_equal(x, kept)
        for found in (y, y1):
            assert found == pytest.approx((E @ x)[:scene.ns], abs=2e-13 * size * np.abs(x).max())
        assert Phi == pytest.approx(E[:scene.ns, :scene.ns], abs=2e-13 * size)
        if steps <= 1.0:
            out = np.empty(x.size)
            engine.propagate(T, m, x, s, out)
            assert out == pytest.approx(E @ x, abs=2e-13 * np.abs(x).max())


def test_series_of_states_and_guards_are_their_derivatives(scene, rng):
    T, m = scene.tables, mode_of(scene)
    A = whole_matrix(scene, m)
    s = 0.6 * T.step[m]
    for _, x in starts(scene, rng, 3):
        a, later = np.full(ORDER + 1, np.nan), expm(A * s) @ x
        terms, sizes = [x], [np.abs(x)]  # A^j x/j!, and what its rounding is measured by
        for j in range(1, ORDER + 1):
            terms.append(A @ terms[-1] / j)
            sizes.append(np.abs(A) @ sizes[-1] / j)
        for i in range(scene.ns):
            engine.state_series(T, m, i, x, a)
            assert np.all(np.abs(a - np.array(terms)[:, i]) <= 1e-13 * np.array(sizes)[:, i])
            assert np.polyval(a[::-1], s) == pytest.approx(later[i], abs=1e-13 * np.abs(x).max())
        for g in range(T.n_guards[m]):
            engine.guard_series(T, m, g, x, a)
            assert np.all(np.abs(a - np.array(terms) @ T.G[m, g]) <= 1e-13 * (np.array(sizes) @ np.abs(T.G[m, g])))
            assert np.polyval(a[::-1], s) == pytest.approx(T.G[m, g] @ later, abs=1e-13 * np.abs(x).max())
            assert engine.guard_value(T, m, g, x) == pytest.approx(T.G[m, g] @ x, abs=1e-14)
            assert engine.terms_size(T, m, g, x) == pytest.approx(np.abs(T.G[m, g]) @ np.abs(x), rel=1e-14)
            for order in range(3):  # the guard without its first terms, over s**order
                row = np.empty(x.size)
                value, slope = engine.guard_divided.py_func(T, m, g, x, s, order, row)
                rest = np.poly1d(a[order:][::-1])
                assert value == pytest.approx(rest(s), rel=1e-11)
                assert value == pytest.approx(row @ x, rel=1e-11)
                assert slope == pytest.approx(rest.deriv()(s), rel=1e-11)


def test_long_segments_are_sampled_at_times_in_any_order(scene, rng):
    """Behind more than twice FAR steps a segment is gone on with from the sample before; times that fall begin anew."""
    T, m = scene.tables, mode_of(scene)
    A, leap = whole_matrix(scene, m), FAR * T.step[m]
    begun = list(starts(scene, rng, 2))
    states = np.array([x[:scene.ns] for _, x in begun])
    where = np.array([(0, 0.3), (0, 2.4), (0, 2.45), (0, 5.2), (0, 1.1), (0, 3.7), (1, 3.7), (1, 0.0), (0, 3.7), (0, 9.1)])
    index, spans = where[:, 0].astype(int), where[:, 1] * leap
    out = np.empty((len(where), scene.ns))
    sample(T, np.array([m, m]), np.array([t for t, _ in begun]), states, index, spans, out)
    for k, s, y in zip(index, spans, out, strict=True):
        exact = (expm(A * s) @ begun[k][1])[:scene.ns]
        assert y == pytest.approx(exact, abs=1e-11 * max(1.0, np.abs(exact).max()))


def test_coasting_ends_before_any_guard_is_reached(scene, rng):
    """The state is that of the matrix exponential, nothing was passed, and what stopped it is near: two steps at most."""
    T, m = scene.tables, mode_of(scene)
    A, h, ng = whole_matrix(scene, m), T.step[m], int(T.n_guards[m])
    G = T.G[m, :ng]
    room, none = np.empty(2 * ng + scene.ns + scene.nw), np.full(ng, np.nan)
    hits, least = 0, []
    for _, x in starts(scene, rng, 60):
        x[:3] *= 0.2
        inner = expm(A * h / 8.0)
        z, free = x.copy(), 0
        while (G @ z < 0.0).all() and free < 8 * 30:
            z, free = inner @ z, free + 1
        moved = x.copy()
        s = free_steps(T, m, moved, 30, np.zeros(ng, np.int64), none, room)
        assert s <= free * h / 8.0
        assert moved == pytest.approx(expm(A * s) @ x, abs=1e-12 * max(1.0, np.abs(moved).max()))
        hits += free < 8 * 30
        least.append(free / 8.0 - s / h)
    assert 10 < hits and np.median(least) < 1.5 and max(least) < 4.0


@pytest.mark.parametrize("guard", (0, 1))
def test_coasting_from_a_surface(scene, rng, guard):
    """Behind an impact the zero at the start is known; where the guard rises, or is zero to a higher order, nothing is proved."""
    T, m = scene.tables, mode_of(scene)
    A, h, ng = whole_matrix(scene, m), T.step[m], int(T.n_guards[m])
    room, orders = np.empty(2 * ng + scene.ns + scene.nw), np.zeros(ng, np.int64)
    orders[guard] = 1
    moves = 0
    for _, x in starts(scene, rng, 40):
        row = T.G[m, guard]
        x[:3] *= 0.1
        x[:3] -= row[:3] * (row @ x) / (row[:3] @ row[:3])
        rate = row @ A @ x
        moved = x.copy()
        s = free_steps(T, m, moved, 5, orders, np.array([rate if g == guard else np.nan for g in range(ng)]), room)
        assert moved == pytest.approx(expm(A * s) @ x, abs=1e-12 * max(1.0, np.abs(moved).max()))
        times = np.linspace(0.0, s, 40)[1:]
        assert s == 0.0 or rate < 0.0 and max((T.G[m, :ng] @ expm(A * t) @ x).max() for t in times) < 0.0
        moves += s > h
        orders[guard] = 2
        assert free_steps(T, m, x.copy(), 5, orders, np.full(ng, np.nan), room) == 0.0
        orders[guard] = 1
    assert moves > 5


@pytest.mark.parametrize(("bend", "free"), [(-2.0, False), (-4.0, False), (-5.2, False), (-5.5, True), (-9.0, True)])
def test_the_bound_behind_a_surface_is_the_sharp_one(bend, free):
    """A guard of fourth degree that is farthest from its cubic, 16 e u^2 (1 - u)^2 above it: zero and falling at the start, it has
    risen beyond zero within the step where the middle coefficient is above -16/3 e, and falls all the way where it is below."""
    e, slight = 0.25, 1e-6
    u = Polynomial([0.0, 1.0])
    guard = 3.0 * -slight * u * (1 - u)**2 + 3.0 * bend * e * u**2 * (1 - u) - 0.3 * u**3 + 16.0 * e * u**2 * (1 - u)**2
    assert (guard(np.linspace(1e-3, 1.0, 999)).max() < 0.0) == free
    x = np.append([guard.deriv(k)(0.0) if k else 0.0 for k in range(5)], 1.0)  # the state: the guard and its derivatives
    E = np.array([[1.0 / math.factorial(j - i) if j >= i else 0.0 for j in range(6)] for i in range(5)])
    E[:, 5] = 0.0
    G, rate, G4 = np.zeros((1, 1, 6)), np.zeros((1, 1, 6, ORDER + 1)), np.zeros((1, 1, 6))
    G[0, 0, 0] = rate[0, 0, 1, 1] = 1.0
    G4[0, 0, 4] = 1.0 / 384.0
    T = SimpleNamespace(A=np.zeros((1, 5, 6)), E=E[None], G=G, G4=G4, GT=rate, n_guards=np.array([1]), step=np.array([1.0]),
                        turn=np.zeros((1, 1)), harmonics=np.zeros(0, np.int64))
    assert G4[0, 0] @ np.abs(x) == pytest.approx(e)
    assert free_steps(T, 0, x, 1, np.array([1]), np.array([np.nan]), np.empty(8)) == float(free)


def test_saltation_is_the_derivative_of_the_motion_through_an_impact(scene, rng):
    """Against differences of motions that meet the moving stop a little earlier and later."""
    T, m = scene.tables, mode_of(scene)
    A, ns = whole_matrix(scene, m), scene.ns
    impact = next(g for g in range(T.n_guards[m]) if T.G[m, g, ns + 1:].any())
    row = T.G[m, impact]

    def through(x, span):
        """Return the state a time ``span`` after ``x``, which is near the guard, with the impact between."""
        s = 0.0
        for _ in range(30):
            z = expm(A * s) @ x
            s -= (row @ z) / (row @ A @ z)
        z = expm(A * s) @ x
        xp, P = np.empty(z.size), np.empty((ns, z.size))
        jump(T, m, impact, False, z, xp, P)
        return (expm(A * (span - s)) @ xp)[:ns]

    for _, x in starts(scene, rng, 6):
        x[:3] -= row[:3] * (row @ x) / (row[:3] @ row[:3])
        if row @ A @ x < 0.3:
            x[3:6] += row[:3] / (row[:3] @ row[:3]) * (1.5 - row @ A @ x)
        xp, P, S, when = np.empty(x.size), np.empty((ns, x.size)), np.empty((ns, ns)), np.empty(ns)
        jump(T, m, impact, False, x, xp, P)
        assert P @ x == pytest.approx(xp[:ns], abs=1e-13)
        assert saltation(T, m, impact, m, x, xp, P, when, S) == pytest.approx(row @ A @ x, rel=1e-13)
        h = 1e-5
        for c in range(ns):
            d = h * np.eye(x.size)[c]
            column = (through(x + d, 0.0) - through(x - d, 0.0)) / (2.0 * h)
            assert S[:, c] == pytest.approx(column, abs=1e-7 * np.abs(S).max())


def test_a_jump_that_closes_a_chattering_is_a_plastic_impact(scene, rng):
    """The gap's rate is zero behind it, and the impulse is along the same direction as with restitution."""
    T, m = scene.tables, mode_of(scene)
    A, ns, n = whole_matrix(scene, m), scene.ns, scene.n
    for g in range(T.n_guards[m]):
        for _, x in starts(scene, rng, 3):
            row = T.G[m, g]
            x[:n] -= row[:n] * (row @ x) / (row[:n] @ row[:n])
            xp, P = np.empty(x.size), np.empty((ns, x.size))
            jump(T, m, g, False, x, xp, P)
            closed, Q = np.empty(x.size), np.empty((ns, x.size))
            jump(T, m, g, True, x, closed, Q)
            assert row @ A @ xp == pytest.approx(-T.ratio[m, g] * (row @ A @ x), abs=1e-12)
            assert row @ A @ closed == pytest.approx(0.0, abs=1e-12)
            assert Q @ x == pytest.approx(closed[:ns], abs=1e-13)
            assert (closed - x)[n:ns] * (1.0 + T.ratio[m, g]) == pytest.approx((xp - x)[n:ns], abs=1e-12)


def test_two_impacts_at_one_instant_commute_without_coupled_inertia():
    """Masses that are coupled by springs only hit independently; a mass matrix with a term between them lets the order matter."""
    def gap(coupling):
        system = bf.System([[1.0, coupling], [coupling, 2.0]], 0.1 * np.eye(2), [[2.0, -1.0], [-1.0, 2.0]],
                           [HarmonicForce(0.3), RigidStop(0.5, 0.6, dof=0), RigidStop(0.4, 0.3, dof=1)], omega=1.1)
        scene = scene_of(system)
        x = joined(scene, np.array([0.5, 0.4, 1.0, 0.7]), 0.2)
        return order_gap(scene, mode_of(scene), 0, 1, x)

    assert gap(0.0) < 1e-12
    assert gap(0.3) == np.inf


def test_two_impacts_at_one_instant_do_not_commute_where_damping_couples():
    """Of masses with a dashpot between them the states after both orders are the same, their derivatives are not: against
    differences of flights and rebounds written out, one stop always before the other."""
    C, K, push = np.array([[0.3, -0.2], [-0.2, 0.4]]), np.array([[2.0, -1.0], [-1.0, 2.0]]), np.array([0.4, -0.2])
    gaps, restitutions, y = (0.5, 0.4), (0.6, 0.3), np.array([0.5, 0.4, 1.0, 0.7])
    M = np.diag([1.0, 2.0])
    A = np.zeros((5, 5))
    A[:2, 2:4] = np.eye(2)
    A[2:4] = np.linalg.solve(M, np.column_stack([-K, -C, push]))

    def through(y, order):
        """Flights before and behind both impacts, none in all: a time is negative where the surface was passed."""
        x, passed = np.append(y, 1.0), 0.0
        for i in order:
            t = 0.0
            for _ in range(20):
                now = expm(t * A) @ x
                t -= (now[i] - gaps[i]) / now[2 + i]
            x, passed = expm(t * A) @ x, passed + t
            x[2 + i] *= -restitutions[i]
        return (expm(-passed * A) @ x)[:4]
    h = 1e-5
    one, two = (np.array([(through(y + d, order) - through(y - d, order)) / (2.0 * h) for d in h * np.eye(4)]).T
                for order in ((0, 1), (1, 0)))
    stops = [RigidStop(gaps[i], restitutions[i], dof=i) for i in (0, 1)]
    forces = [ConstantForce(push[0]), ConstantForce(push[1], dof=1), HarmonicForce(0.0)]
    scene = scene_of(bf.System(M, C, K, [*forces, *stops], omega=1.1))
    gap = order_gap(scene, mode_of(scene), 0, 1, joined(scene, y, 0.2))
    assert gap == pytest.approx(np.abs(one - two).max() / max(np.abs(one).max(), np.abs(two).max()), rel=1e-6) and gap > 1e-3


def test_an_event_that_always_comes_with_another_takes_its_time():
    """Two sliders stick where their mass turns: the derivative through both against differences of flights, times and memories
    written out."""
    k, limits, omega = (1.5, 0.6), (0.4, 0.3), 1.1
    sliders = [Jenkins(stiffness, limit) for stiffness, limit in zip(k, limits, strict=True)]
    scene = scene_of(bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.2), *sliders], omega=omega))
    pairs = ("slip+", "slip+"), ("stick", "slip+"), ("stick", "stick")
    before, middle, after = (scene.index(("always", *keys)) for keys in pairs)
    T, ns = scene.tables, scene.ns
    turn = [scene.guards_of(mode, e)[0] for mode, e in ((before, 1), (middle, 2))]
    assert all(T.G[mode, g, 1] for mode, g in zip((before, middle), turn, strict=True))
    x = joined(scene, np.array([0.9, 0.0, 0.1, -0.2]), 0.7)
    flows = [whole_matrix(scene, mode) for mode in (before, after)]

    def through(y):
        t = 0.0
        for _ in range(20):
            now = expm(t * flows[0]) @ y
            t -= now[1] / (flows[0] @ now)[1]
        y = expm(t * flows[0]) @ y
        y[2:4] = y[0] - np.array(limits) / k  # each holds its limit
        return (expm(-t * flows[1]) @ y)[:ns]
    h = 1e-5
    found = np.array([(through(x + d) - through(x - d)) / (2.0 * h) for d in h * np.eye(x.size)[:ns]]).T
    y, P, S, when = np.empty(x.size), np.empty((ns, x.size)), np.empty((ns, ns)), np.empty(ns)
    jump(T, before, turn[0], False, x, y, P)
    saltation(T, before, turn[0], middle, x, y, P, when, S)
    z = np.empty(x.size)
    jump(T, middle, turn[1], False, y, z, P)
    with_it(T, middle, after, y, z, P, when, S, np.empty((ns, ns)))
    assert z[:ns] == pytest.approx([0.9, 0.0, *(0.9 - np.array(limits) / k)], abs=1e-14)
    assert S == pytest.approx(found, abs=1e-7)
