"""The parts of the rule at an event and of the integration one by one, on tables where no two numbers are equal."""
import itertools
import logging
import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.linalg import expm

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.compose.tables import ORDER
from bifurc.elements import ConstantForce, Coulomb, CubicSpring, ElasticStop, HarmonicForce, Jenkins, RigidStop
from bifurc.flow import chatter, initial, linear, periodic, rule, scan, settle, simulate
from bifurc.flow.rule import NOISE
from bifurc.flow.status import Status

logging.getLogger("numba").setLevel(logging.WARNING)
M = np.array([[1.0, 0.25], [0.25, 1.44]])
C = np.array([[0.11, -0.03], [0.02, 0.07]])
K = np.array([[1.38, -0.38], [-0.31, 1.1]])


@pytest.fixture(scope="module")
def scene():
    """Two coupled masses: a stop on the first, dry friction with static excess and a slider with memory on the second."""
    return scene_of(bf.System(M, C, K, [HarmonicForce(0.7, phase=0.3), RigidStop(0.12, 0.6), Coulomb(0.5, 0.4, 1.2, dof=1),
                                        Jenkins(2.0, 0.3, dof=1)], omega=1.3))


def states(scene, rng, count):
    for _ in range(count):
        t = rng.uniform(0.0, 9.0)
        yield np.concatenate([rng.normal(size=scene.ns) * [0.3, 1.0, 2.0, 0.5, 0.7], scene.forcing(np.array([t]))[0]])


def whole_matrix(scene, m):
    return np.vstack([scene.tables.A[m], np.hstack([np.zeros((scene.nw, scene.ns)), scene.frame.W])])


def guards(scene):
    return [(m, g) for m in range(len(scene.keys)) for g in range(scene.tables.n_guards[m])]


def sizes(T, x):
    """Return the scale of every entry, written out."""
    ns = T.F.shape[0]
    met = np.concatenate([np.abs(x[:ns]), np.ones(x.size - ns)])
    return np.concatenate([np.maximum(np.abs(x[:ns]), (T.F * met).max(axis=1)), np.ones(x.size - ns)])


def test_what_rounding_is_measured_by(scene, rng):
    T = scene.tables
    for x in states(scene, rng, 5):
        scale = np.empty(x.size)
        rule.sizes(T, x, scale)
        assert scale == pytest.approx(sizes(T, x), rel=1e-15)
        assert settle.plain(x, scene.ns).tolist() == [*np.abs(x[:scene.ns]), *np.ones(scene.nw)]
    steps = [expm(whole_matrix(scene, m) * T.step[m])[:scene.ns] for m in range(len(scene.keys))]
    assert pytest.approx(np.abs(steps).max(axis=0), abs=1e-12) == T.F  # the largest term of a step of any mode


def test_a_held_row_is_at_rest_on_its_surface_to_rounding(scene, rng):
    T, seen = scene.tables, set()
    for m in range(len(scene.keys)):
        for k in range(T.n_holds[m]):
            for rows, kind in ((T.H, "speed"), (T.S, "place")):
                if not rows[m, k].any():
                    continue
                for x in states(scene, rng, 3):
                    for _ in range(2):
                        for row in (T.S[m, k], T.H[m, k]):
                            if row.any():
                                x[:scene.ns] -= row[:scene.ns] * (row @ x) / (row[:scene.ns] @ row[:scene.ns])
                    scale = sizes(T, x)
                    row = rows[m, k]
                    limit = NOISE * np.abs(row) @ scale
                    for share, held in ((0.5, True), (3.0, False), (-0.5, True), (-3.0, False)):
                        y = x.copy()
                        y[:scene.ns] += row[:scene.ns] * share * limit / (row[:scene.ns] @ row[:scene.ns])
                        assert rule.loose(T, m, k, y, scale) is not held
                        first = rule.broken_hold(T, m, y, scale)
                        assert held or first <= k and rule.loose(T, m, first, y, scale)
                    seen.add(kind)
    assert seen == {"speed", "place"}


def test_signs_of_guards_are_those_just_after(scene, rng):
    """At values of a half and of twice the rounding; on the surface by the rate; where that is zero too by its rate."""
    T, a, orders = scene.tables, np.empty(ORDER + 1), set()
    for m, g in guards(scene):
        row, A = T.G[m, g], whole_matrix(scene, m)
        if not row[:scene.ns].any():
            continue
        for x, depth in zip(states(scene, rng, 6), (0, 0, 0, 1, 1, 2), strict=True):
            rows = [row @ np.linalg.matrix_power(A, j) for j in range(depth + 2)]
            flat = np.array([r[:scene.ns] for r in rows[:depth + 1]])
            if np.linalg.matrix_rank(flat, tol=1e-9) <= depth:
                continue
            x[:scene.ns] -= np.linalg.pinv(flat) @ np.array([r @ x for r in rows[:depth + 1]])
            scale = sizes(T, x)
            rate = rows[depth + 1] @ x
            if abs(rate) < 1e-6:
                continue
            assert rule.inside(T, m, g, x, scale, a) == (1 if rate > 0.0 else -1, depth + 1)
            orders.add(depth + 1)
            size = NOISE * np.abs(row) @ scale
            for share in (2.0, -2.0):
                y = x.copy()
                y[:scene.ns] += share * size * row[:scene.ns] / (row[:scene.ns] @ row[:scene.ns])
                assert rule.inside(T, m, g, y, scale, a) == (1 if share > 0.0 else -1, 0)
            y = x.copy()
            y[:scene.ns] += 0.4 * size * row[:scene.ns] / (row[:scene.ns] @ row[:scene.ns])
            assert rule.inside(T, m, g, y, scale, a)[1] > 0
    assert {1, 2} <= orders


def test_a_mode_may_start_where_its_holds_hold_and_its_guards_are_inside(scene, rng):
    T, count, a, said = scene.tables, scene.tables.G.shape[1], np.empty(ORDER + 1), []
    decider = settle.Rule(scene)
    for m in range(len(scene.keys)):
        for x in states(scene, rng, 12):
            if rng.random() < 0.7 and T.n_holds[m]:
                rows = np.array([r for k in range(T.n_holds[m]) for r in (T.S[m, k], T.H[m, k]) if r.any()])
                for _ in range(3):
                    x[:scene.ns] -= np.linalg.pinv(rows[:, :scene.ns]) @ (rows @ x)
            scale = sizes(T, x)
            broken = [k for k in range(T.n_holds[m]) if rule.loose(T, m, k, x, scale)]
            signs, orders = np.full((2, count), 7)
            may = rule.admit(T, m, x, scale, signs, orders, a)
            found = [rule.inside(T, m, g, x, scale, a) for g in range(T.n_guards[m])]
            outside = [(g, order) for g, (sign, order) in enumerate(found) if sign > 0]
            assert may is (not broken and not outside)
            if broken:
                assert (signs == 7).all() and rule.broken_hold(T, m, x, scale) == broken[0]
            else:
                assert list(zip(signs.tolist(), orders.tolist(), strict=True))[:len(found)] == found
                assert rule.broken_hold(T, m, x, scale) == -1
            why = decider.broken(m, x, scale)
            assert why == [] if may else why == [*(("hold", scene.hold_element(m, k)) for k in broken),
                                                 *(("guard", g, order) for g, order in outside)]
            said.append((may, bool(broken)))
    assert set(said) == {(True, False), (False, True), (False, False)}


def test_states_behind_an_event(scene, rng):
    """Kicks by restitution leave the rate -r times that of the arrival, in place of what rounding made of it."""
    T, kicks = scene.tables, 0
    for m, g in guards(scene):
        for x in states(scene, rng, 2):
            xp, jumped, P = np.empty(x.size), np.empty(x.size), np.empty((scene.ns, x.size))
            rule.jump(T, m, g, False, x, xp, P)
            assert xp[:scene.ns] == pytest.approx(T.R[m, g] @ x, abs=1e-13) and np.array_equal(P, T.R[m, g])
            assert np.array_equal(xp[scene.ns:], x[scene.ns:])
            rate = T.G[m, g] @ whole_matrix(scene, m) @ x
            after = rule.jumped(T, m, g, x, rate * (1.0 + 1e-6), jumped)
            if T.kick[m, g]:
                kicks += 1
                assert after == pytest.approx(-0.6 * rate * (1.0 + 1e-6), rel=1e-15)
                assert T.G[m, g] @ whole_matrix(scene, m) @ jumped == pytest.approx(after, abs=1e-12)
                assert jumped == pytest.approx(xp, abs=1e-5)
                assert rate != 0.0 and settle.Rule(scene).jumped(m, g, x, rate) == pytest.approx(xp, abs=1e-12)
            else:
                assert math.isnan(after) and jumped == pytest.approx(xp, abs=1e-14)
            assert settle.Rule(scene).rate(m, g, x)[0] == pytest.approx(rate, abs=1e-12)
            found = settle.Rule(scene).jump(m, g, x)
            assert np.array_equal(found[0], xp) and np.array_equal(found[1], P)
    assert kicks > 4


@pytest.mark.parametrize("length", [1e-13, 1e13])
def test_what_is_zero_is_told_by_the_size_of_the_terms_in_any_unit(length, rng):
    """Rates of guards on their surfaces, far from zero or as small as their rounding: the same signs in any unit of length."""
    def made(unit):
        return scene_of(bf.System(M, C, K, [ConstantForce(0.4 * unit), RigidStop(0.12 * unit, 0.6), Coulomb(0.5 * unit, dof=1),
                                            Jenkins(2.0, 0.3 * unit, dof=1)]))
    one, other, a, told = made(1.0), made(length), np.empty(ORDER + 1), []
    for m, g in guards(one):
        row = one.tables.G[m, g][:one.ns]
        if not row.any():
            continue
        for _ in range(4):
            y = rng.normal(size=one.ns)
            y -= row * ((row @ y + one.tables.G[m, g][one.ns]) / (row @ row))
            found = []
            for scene, unit in ((one, 1.0), (other, length)):
                x, scale = np.append(unit * y, 1.0), np.empty(one.ns + 1)
                rule.sizes(scene.tables, x, scale)
                found.append(rule.inside(scene.tables, m, g, x, scale, a))
            assert found[0] == found[1]
            told.append(found[0])
    assert {sign for sign, order in told if order == 1} == {-1, 1}


def numbered(scene, m, element, number):
    """Return the guard of that number of an element in a mode, or None."""
    own = [g for g in range(scene.tables.n_guards[m]) if scene.guard(m, g).element == element]
    return own[number] if number < len(own) else None


def test_guards_of_other_modes_and_what_an_event_takes_along(scene, rng):
    T, a, said = scene.tables, np.empty(ORDER + 1), []
    drawn = list(states(scene, rng, 20))
    every = guards(scene)
    for i, ((m, g), (c, k)) in enumerate(itertools.product(every, every)):
        element = scene.guard(c, k).element
        known = numbered(scene, m, element, scene.guard(c, k).number)
        assert rule.foreign(T, m, c, k) == (-1 if known is None else known)
        if i % 3:
            continue
        x, kicked, order = drawn[i % 20], bool(i % 2), i % 4
        scale = sizes(T, x)
        memory = T.R[c, k][2 * scene.n:]
        still = np.array_equal(memory, np.eye(x.size)[2 * scene.n:scene.ns])
        if element == scene.guard(m, g).element or T.kick[c, k] and order < 2:
            expected = False
        elif kicked and order == 0:
            expected = True
        elif not kicked and not still:
            expected = False
        else:
            expected = known is None or rule.inside(T, m, known, x, scale, a)[0] <= 0
        assert rule.taken_along.py_func(T, m, g, c, k, kicked, order, x, scale, a) == expected
        said.append(expected)
    assert 0.05 < np.mean(said) < 0.95


def test_an_impact_takes_the_friction_on_its_mass_along(monkeypatch):
    """Turned round: from sliding up to sliding down; where no candidate may start there is no mode."""
    scene = scene_of(bf.System(1.0, 0.1, 1.0, [HarmonicForce(0.7), RigidStop(0.12, 0.6), Coulomb(0.2)], omega=1.3))
    T, a = scene.tables, np.empty(ORDER + 1)
    monkeypatch.setattr(rule, "taken_along", rule.taken_along.py_func)
    m = scene.index(("always", "free", "slip+"))
    g = next(g for g in range(T.n_guards[m]) if T.kick[m, g])
    x = np.concatenate([[0.12, 0.8], scene.forcing(np.array([0.4]))[0]])
    xp, scale = np.empty(x.size), np.empty(x.size)
    rule.jumped(T, m, g, x, 0.8, xp)
    assert xp[1] == pytest.approx(-0.48)
    rule.sizes(T, x, scale)
    signs, orders = np.zeros((2, T.G.shape[1]), np.int64)
    assert not rule.admit(T, m, xp, scale, signs, orders, a)
    found = rule.join.py_func(T, m, g, m, True, x, xp, scale, signs, orders, a)
    assert scene.keys[found] == ("always", "free", "slip-")
    assert list(signs[:T.n_guards[found]]) == [-1] * T.n_guards[found]
    assert settle.decide(scene, m, g, x, 0.8)[0] == found
    assert rule.join.py_func(T, m, g, found, True, x, xp, scale, signs, orders, a) == found  # nothing is outside: it stays
    rule.admit(T, m, xp, scale, signs, orders, a)
    with monkeypatch.context() as patch:  # a mode from which the stop would be hit again at once is none
        patch.setattr(rule, "inside", lambda T, c, k, x, scale, a: (1, 0) if T.kick[c, k] else (-1, 0))
        assert rule.join.py_func(T, m, g, m, True, x, xp, scale, signs, orders, a) == -1
    none = np.full(T.then.shape, -1, T.then.dtype)
    kept = T.then.copy()
    T.then[:] = none
    try:
        rule.admit(T, m, xp, scale, signs, orders, a)
        assert rule.join.py_func(T, m, g, m, True, x, xp, scale, signs, orders, a) == -1
    finally:
        T.then[:] = kept


# ---- the integration -----------------------------------------------------------------------------------------------------------


def test_held_rows_are_put_to_rest_by_the_least_move(rng):
    """The least sum of squares over sizes of entries; also where rows repeat each other; forcing columns are given and stay."""
    ns, nx = 5, 8
    for holds in (1, 2, 3):
        for repeated in (False, True):
            rows = np.zeros((2, 3, nx))
            rows[1, :holds] = rng.normal(size=(holds, nx)) * [[3.0], [0.2], [1.0]][:holds]
            if repeated and holds > 1:
                rows[1, holds - 1] = 2.0 * rows[1, 0]
            x = rng.normal(size=nx)
            y = x.copy()
            scan.put.py_func(rows, holds, ns, 1, y)
            used, roots = rows[1, :holds], np.sqrt(np.abs(x[:ns]))
            moved = roots * (np.linalg.pinv(used[:, :ns] * roots) @ (used @ x))
            assert y == pytest.approx(np.concatenate([x[:ns] - moved, x[ns:]]), abs=1e-12)
    x = rng.normal(size=nx)
    y = x.copy()
    scan.put.py_func(np.zeros((2, 3, nx)), 1, ns, 1, y)
    scan.put.py_func(np.zeros((2, 3, nx)), 3, ns, 1, y)
    assert np.array_equal(x, y)


def test_what_is_left_of_a_complete_chattering(rng):
    """Against its series: flights under a(t) = a + f' t with a loss kappa per unit of speed, summed up one by one."""
    zeta, omega, amplitude, r, gap = 0.08, 1.1, 0.3, 0.7, -0.6
    scene = scene_of(bf.System(1.0, 2.0 * zeta, 1.0, [HarmonicForce(amplitude), RigidStop(gap, r)], omega=omega))
    T, out = scene.tables, np.empty(scene.ns + scene.nw)
    m = scene.index(("always", "free"))
    for t in (0.3, 1.7, 4.0):
        def flights(v, t=t):
            """Return the time of all flights from the impact of speed v on, by exact flights."""
            (w, V), total = np.linalg.eig(whole_matrix(scene, m)), 0.0
            back = np.linalg.inv(V)
            z = np.concatenate([[gap, v], scene.forcing(np.array([t]))[0]])
            while z[1] > 1e-7 * v:
                z[1] *= -r
                push = amplitude * math.cos(omega * (t + total)) - gap
                s = -2.0 * z[1] / push
                for _ in range(6):
                    now = (V @ (np.exp(w * s) * (back @ z))).real
                    s -= (now[0] - gap) / now[1]
                z = (V @ (np.exp(w * s) * (back @ z))).real
                z[0] = gap
                total += s
            return total

        errors = []
        for v in (2e-2, 1e-2):
            x = np.concatenate([[gap, v], scene.forcing(np.array([t]))[0]])
            _, duration = chatter.closure(T, m, 0, x, v, out)
            errors.append(abs(duration - flights(v)))
            assert out == pytest.approx(np.concatenate([[gap, 0.0], x[2:]]), abs=1e-15)
        assert errors[0] < 1e-3 and errors[1] < errors[0] / 6.0  # of the third order in the speed
        push = amplitude * math.cos(omega * t) - gap
        assert chatter.pushed(T, m, 0, x, v, out) == pytest.approx(push, rel=1e-12)
        rate = amplitude * omega * math.sin(omega * t)
        closes = 2e-5 * push * (1.0 - r) / (2.0 * r * max(1.0 / T.step[m], 2.0 * zeta, abs(rate) / push))
        for share, closed in ((0.99, True), (1.01, False)):
            x = np.concatenate([[gap, share * closes], scene.forcing(np.array([t]))[0]])
            assert (chatter.closing(T, m, 0, x, share * closes, out) > 0.0) is closed
    pulled = np.array([gap, 0.1, 1.0, -9.0, 0.0])
    assert chatter.undivided(T, m, 0) and chatter.closure(T, m, 0, pulled, 0.1, out) == (np.inf, 0.0)


def test_which_friction_an_impact_turns_round():
    scene = scene_of(bf.System(M, C, K, [HarmonicForce(0.7), RigidStop(0.12, 0.6), Coulomb(0.5), Coulomb(0.3, dof=1)], omega=1.3))
    T = scene.tables
    m = scene.index(("always", "free", "slip+", "slip-"))
    hit, own, other = (next(g for g in range(T.n_guards[m]) if scene.guard(m, g).element == e) for e in (1, 2, 3))
    assert chatter.multiple(T.G[m, own], T.GT[m, hit, :, 1]) == -1.0 and chatter.multiple(T.G[m, other], T.GT[m, hit, :, 1]) == 0.0
    flight, slides = chatter.flight_mode(T, m, hit)
    assert scene.keys[flight] == ("always", "free", "slip-", "slip-") and scene.guard(flight, slides).element == 2


@pytest.mark.parametrize("coupled", [(), (1,), (2,), (1, 2)])
def test_which_held_friction_an_impact_moves(coupled):
    """Those whose mass the mass matrix couples to the one that hits: none, one by its number, several as such."""
    inertia = np.diag([1.0, 2.0, 3.0])
    for dof in coupled:
        inertia[0, dof] = inertia[dof, 0] = 0.3
    scene = scene_of(bf.System(inertia, np.eye(3), np.eye(3), [RigidStop(0.12, 0.6), Coulomb(0.5, dof=1), Coulomb(0.3, dof=2)]))
    m = scene.index(("free", "stick", "stick"))
    (hit,) = scene.guards_of(m, 0)
    row = chatter.moved_row(scene.tables, m, hit)
    assert row == {0: -1, 2: -2}.get(len(coupled), row)
    if len(coupled) == 1:
        assert scene.hold_element(m, row) == coupled[0]


FLIGHT = bf.System(1.0, 0.1, 1.0, [HarmonicForce(0.6), RigidStop(0.3, 0.8)], omega=0.9)


def test_a_motion_is_the_same_however_it_is_cut(monkeypatch):
    """Periods or duration, one record or several, another start of time by whole periods, in one go or in two."""
    whole = bf.simulate(FLIGHT, (0.1, 0.5), periods=7.25, t0=0.4)
    period = FLIGHT.period
    assert whole.start == 0.4 and whole.stop == pytest.approx(0.4 + 7.25 * period, rel=1e-15) and len(whole.events) == 8
    for other in (bf.simulate(FLIGHT, (0.1, 0.5), duration=7.25 * period, t0=0.4),
                  bf.simulate(FLIGHT, (0.1, 0.5), periods=7.25, t0=0.4 - 3.0 * period),
                  bf.simulate(FLIGHT, (0.1, 0.5), periods=7.25, t0=0.4 + 2.0 * period)):
        shift = other.start - whole.start
        assert [e.time - shift for e in other.events] == pytest.approx([e.time for e in whole.events], abs=1e-10)
        assert other.final == pytest.approx(whole.final, abs=1e-10)
    monkeypatch.setattr(simulate, "ROWS", 3)
    short = bf.simulate(FLIGHT, (0.1, 0.5), periods=7.25, t0=0.4)
    assert [e.time for e in short.events] == [e.time for e in whole.events] and np.array_equal(short.final, whole.final)
    middle = 0.4 + 3.1 * period
    second = bf.simulate(FLIGHT, whole(middle), duration=whole.stop - middle, t0=middle)
    assert second.final == pytest.approx(whole.final, abs=1e-10)
    assert bf.simulate(FLIGHT, (0.1, 0.5), periods=0.0).events == () and bf.simulate(FLIGHT, (0.1, 0.5), periods=0.0).stop == 0.0


def test_the_record_is_what_the_motion_says():
    motion = bf.simulate(FLIGHT, (0.1, 0.5), periods=6.5, t0=0.4)
    period, events = FLIGHT.period, motion.events
    assert motion.success and motion.status is Status.COMPLETED and motion.message == Status.COMPLETED.sentence
    assert repr(motion) == f"Trajectory(start=0.4, stop={motion.stop:.6g}, events={len(events)}, status='completed')"
    for event in events:
        assert event.element == "rigid_stop" and event.kind == "impact" and event.ratio is None and event.end is None
        assert event.before[1] == pytest.approx(event.speed, rel=1e-12) and event.after[1] == pytest.approx(-0.8 * event.speed)
        assert event.before[0] == pytest.approx(0.3, abs=1e-14) and event.after[0] == event.before[0]
        assert motion(event.time) == pytest.approx(event.after, abs=1e-12)  # at an event the state after it
        assert motion(event.time - 1e-9) == pytest.approx(event.before, abs=1e-8)
        assert event.mode_before == event.mode_after == ("always", "free")
    t, y = motion.t, motion.y
    assert t.size in (417 + 2 * len(events), 418 + 2 * len(events)) and (np.diff(t) >= 0.0).all() and y.shape == (t.size, 2)
    for event in events:
        i = np.flatnonzero(t == event.time)
        assert np.array_equal(y[i[0]], event.before) and np.array_equal(y[i[-1]], event.after)
    assert motion.modes == (("always", "free"),) * (len(events) + 1)
    assert motion(motion.stop) == pytest.approx(motion.final, abs=1e-12) and motion(motion.start).tolist() == [0.1, 0.5]
    times, states = motion.sample(7)
    assert np.array_equal(times, np.linspace(0.4, motion.stop, 7)) and np.array_equal(states, motion(times))
    assert motion(np.full((2, 3), 1.0)).shape == (2, 3, 2) and motion(np.nextafter(motion.stop, 99.0)).shape == (2,)
    for outside in (0.4 - 1e-9, motion.stop + 1e-9, np.array([np.nan])):
        with pytest.raises(ValueError, match=r"t must lie in \[0.4, .*\], the motion that was simulated"):
            motion(outside)
    with pytest.raises(ValueError, match="t = nan is not allowed; it must be finite numbers, one or a list"):
        motion(np.nan)
    assert motion.sections.shape == (6, 2) and motion.sections[0] == pytest.approx(motion(period), abs=1e-12)
    before, known = motion.past(motion.stop, 2.0 * period)
    assert known == [e.time for e in events if e.time > motion.stop - 2.0 * period] and before(1.0) == pytest.approx(motion(1.0))
    assert motion.past(0.4 + period, period)[1] == [e.time for e in events if e.time > 0.4]
    for t0, delay in ((0.4 + period, 1.1 * period), (motion.stop + 0.1, period)):
        with pytest.raises(ValueError, match="history must reach from"):
            motion.past(t0, delay)
    free = bf.simulate(bf.System(1.0, 0.1, 1.0), (1.0, 0.0), duration=3.0)
    assert free.t.size == 2001 and free.modes == ((),)


def test_chattering_and_touches_are_told():
    """A ball comes to rest: ratio, and the time when it has; a mass that turns at its stop touches it."""
    ball = bf.System(1.0, 0.0, 0.0, [bf.elements.ConstantForce(1.0), RigidStop(0.5, 0.5)])
    motion = bf.simulate(ball, (0.0, 0.0), duration=4.0)
    chatter = motion.events[-1]
    assert chatter.kind == "chatter" and chatter.ratio == 0.5 and chatter.mode_after == ("always", "rest")
    assert chatter.end == pytest.approx(1.0 + 2.0, abs=1e-9) and motion.final.tolist() == [0.5, 0.0]  # 1 + 2 (r + r^2 + ...)
    assert chatter.end > chatter.time
    touch = bf.System(1.0, 0.0, 1.0, [RigidStop(1.0, 0.5)])
    grazing = bf.simulate(touch, (0.0, 1.0 - 1e-15), duration=3.0).events
    assert [str(event.kind) for event in grazing] == ["graze"] and grazing[0].time == pytest.approx(0.5 * np.pi, abs=1e-6)
    assert grazing[0].speed == 0.0 and grazing[0].mode_before == grazing[0].mode_after


def test_how_motions_end():
    runaway = bf.simulate(bf.System(1.0, -1.0, 0.0), (1.0, 1.0), duration=2000.0)
    assert not np.isfinite(runaway.final).all()
    assert runaway.status is Status.DIVERGED and runaway.message == Status.DIVERGED.sentence and not runaway.success
    many = bf.simulate(FLIGHT, (0.1, 0.5), periods=50, max_events=1)
    assert many.status is Status.TOO_MANY_EVENTS
    assert many.message.startswith(Status.TOO_MANY_EVENTS.sentence + " Element 'rigid_stop' at t = ")
    assert many.message.endswith(" fired event number 1 of its period.")
    enough = bf.simulate(FLIGHT, (0.1, 0.5), periods=50, max_events=4)
    assert enough.success and many.stop < enough.stop


@pytest.mark.parametrize("given, words", [
    ({}, "give either periods or duration"), ({"periods": 1, "duration": 1.0}, "give either periods or duration"),
    ({"periods": -1.0}, "simulate: periods = -1.0 is not allowed; it must be a number from 0 to 1e"),
    ({"duration": -1.0}, "simulate: duration = -1.0 is not allowed; it must be a finite number, at least 0"),
    ({"periods": np.inf}, "simulate: periods = inf"), ({"duration": "x"}, "simulate: duration = 'x'"),
    ({"periods": 1, "t0": np.nan}, "simulate: t0 = nan"), ({"periods": 1, "max_events": 0}, "simulate: max_events = 0"),
    ({"periods": 1, "history": print}, "history is not allowed; .* has no delayed feedback")])
def test_lengths_that_are_none(given, words):
    with pytest.raises(ValueError, match=words):
        bf.simulate(FLIGHT, (0.0, 0.0), **given)


def test_starts():
    with pytest.raises(ValueError, match="has no forcing period; give duration instead of periods"):
        bf.simulate(bf.System(1.0, 0.1, 1.0), (0.0, 0.0), periods=1)
    scene = scene_of(bf.System(1.0, 0.1, 1.0, [HarmonicForce(), Jenkins(2.0, 0.3)], omega=1.0))
    assert initial.checked_length(scene, 2.0, None, 0.3) == (0.3, 2.0)
    assert initial.checked_length(scene, None, 1.5, 0.0) == (0.0, 1.5)
    assert initial.checked_state(scene, (0.2, 0.4), 0.0).tolist() == [0.2, 0.4, 0.2]  # a slider without force
    assert initial.checked_state(scene, (0.2, 0.4, 0.1), 0.0).tolist() == [0.2, 0.4, 0.1]
    x = np.concatenate([[1.0, 0.0, 0.2], scene.forcing(np.zeros(1))[0]])
    assert settle.unloaded(scene, x)[2] == pytest.approx(1.0 - 0.15) and x[2] == 0.2  # it has slipped
    with pytest.raises(settle.Penetration, match="y0 lies 0.2 beyond the stop 'rigid_stop'"):
        bf.simulate(FLIGHT, (0.5, 0.0), periods=1)
    period = 2.5
    for t, split in ((0.0, (0, 0.0)), (2.5, (1, 0.0)), (-0.5, (-1, 2.0)), (6.0, (2, 1.0))):
        assert simulate._split(t, period) == pytest.approx(split)
    assert simulate._carry(3, -1e-18, period) == (3, 0.0) and simulate._carry(3, 2.5, period) == (4, 0.0)
    assert simulate._carry(3, 2.4, period) == (3, 2.4)


# ---- fields of a mode, sums of harmonics ---------------------------------------------------------------------------------------


def test_fields_and_their_derivatives(rng):
    """Laws on a row and on a circle: the rate is that of the compiled engine, derivatives those of differences."""
    from bifurc.compose.writer import kernels

    cubic = bf.System(M, C, K, [CubicSpring(0.8, row=(1.0, -0.5)), ElasticStop(0.2, 3.0, 0.1, dof=1), RigidStop(0.7, dof=0)])
    for system in (cubic, bf.systems.rotating_frame_rotor()):
        scene = scene_of(system)
        engine = kernels(scene)
        for m in list(scene.start_modes())[:3]:
            field = linear.ModeField(scene, scene.tables, m)
            y = rng.normal(size=scene.ns) * 0.8 + 1.0
            x, f = field.joined(y), np.empty(scene.ns)
            assert np.array_equal(x, [*y, 1.0])
            engine.field(scene.tables, m, x, f)
            assert field.rate(y) == pytest.approx(f, abs=1e-12)
            h = 1e-6

            def slopes(function, y=y, h=h):
                return np.array([(function(y + d) - function(y - d)) / (2.0 * h) for d in h * np.eye(y.size)]).T

            assert field.jacobian(y) == pytest.approx(slopes(field.rate), abs=1e-7)
            assert field.slopes(y) == pytest.approx(slopes(field.forces), abs=1e-7)
            values, by = field.guard_slopes(y)
            assert by == pytest.approx(slopes(lambda z, field=field: field.guard_slopes(z)[0]), abs=1e-7)
            known = [engine.guard_value(scene.tables, m, g, x) for g in range(int(scene.tables.n_guards[m]))]
            assert values == pytest.approx(known, abs=1e-12)
            T, count = scene.tables, len(values)
            told, normals = field.depths(y)  # a depth is an unknown of its own: laws change by it, and by the state while it stays
            by_state, by_depth = np.split(field._laws.apart(x)[1], [scene.ns], axis=1)
            assert by_state + by_depth @ normals == pytest.approx(field.slopes(y), abs=1e-12)

            def pressed(depths, y=y, field=field):
                field.press(y, depths)
                return field.forces(y)

            assert by_depth == pytest.approx(np.reshape([(pressed(told + d) - pressed(told - d)) / (2.0 * h)
                                                         for d in h * np.eye(told.size)], by_depth.T.shape).T, abs=1e-7)
            field.press(y, told)
            steep = np.sqrt(((T.LP[m].T @ by_depth)**2).sum(axis=0))
            depths = np.maximum(np.abs(told), np.abs(y).max() * field.pace**2 / np.where(steep > 0.0, steep, 1.0))
            terms = np.abs(T.G[m, :count]) @ np.abs(x)
            terms = terms + np.abs(T.LG[m, :count]) @ (np.abs(field.forces(y)) + np.abs(by_state) @ np.abs(y)
                                                       + np.abs(by_depth) @ depths)
            assert field.guards(y) == pytest.approx(values / np.where(terms > 0.0, terms, 1.0), rel=1e-12)
            held = field.constraints()
            assert held.shape == (len([k for k in range(T.n_holds[m]) for r in (T.H[m, k], T.S[m, k]) if r.any()]), x.size)
    scene = scene_of(cubic)
    rest = linear.ModeField(scene, scene.tables, scene.index(("always", "free", "rest")))
    assert rest.constraints().tolist() == [[0, 0, 1, 0, 0], [1, 0, 0, 0, pytest.approx(-0.7)]] or len(rest.constraints()) == 2
    assert rest.guards(np.zeros(4), least=1.0).shape == (2,)


@pytest.mark.parametrize("time", [1e-6, 1.0, 1e4])
def test_units_of_a_state_make_its_numbers_the_same_in_any_unit_of_time(time):
    """Velocities count in lengths over the time of the mode: they have the unit of velocities."""
    system = bf.System(M, C * 0.5 / time, K * 0.7 / time**2, [RigidStop(0.12, 0.6)])
    scene = scene_of(system)
    field = linear.ModeField(scene, scene.tables, scene.index(("free",)))
    assert field.units[:2].tolist() == [1.0, 1.0]
    inside = field.units * time  # an own unit of 1 for all velocities, whatever the clock
    fast = np.sqrt(np.abs(np.linalg.solve(M, 0.7 * K)).sum(axis=1).max())
    assert fast / 3.0 < inside[2] < 6.0 * fast and inside[2] == inside[3]


HARMONICS = (1, 3)


def test_sums_of_harmonics(rng):
    c = rng.normal(size=5)
    theta = rng.uniform(0.0, 7.0, (2, 4))
    value = c[0] + c[1] * np.cos(theta) + c[2] * np.sin(theta) + c[3] * np.cos(3 * theta) + c[4] * np.sin(3 * theta)
    slope = -c[1] * np.sin(theta) + c[2] * np.cos(theta) - 3 * c[3] * np.sin(3 * theta) + 3 * c[4] * np.cos(3 * theta)
    assert periodic.states(HARMONICS, theta) @ c == pytest.approx(value, abs=1e-14)
    assert periodic.states(HARMONICS, theta) @ periodic.derivative(HARMONICS, c) == pytest.approx(slope, abs=1e-13)
    fine = np.linspace(0.0, 2.0 * np.pi, 20001)
    grid = periodic.states(HARMONICS, fine) @ c
    c[0] -= 0.5 * (grid.max() + grid.min())
    grid = periodic.states(HARMONICS, fine) @ c
    crossings = fine[:-1][np.sign(grid[1:]) != np.sign(grid[:-1])]
    zeros, extrema = periodic.zeros(HARMONICS, c), periodic.extrema(HARMONICS, c)
    assert all(np.abs((zeros - at + np.pi) % (2.0 * np.pi) - np.pi).min() < 4e-4 for at in crossings)
    turns = fine[1:-1][(np.diff(grid)[1:] * np.diff(grid)[:-1]) < 0.0]
    assert all(np.abs((extrema - at + np.pi) % (2.0 * np.pi) - np.pi).min() < 6e-4 for at in turns) and len(turns)
    assert periodic.extrema(HARMONICS, np.array([2.0, 0, 0, 0, 0])).size == 0
    top = fine[grid.argmax()]
    begin = top + 1e-3
    while periodic.states(HARMONICS, begin) @ c > 0.0:
        begin += 0.01
    found = periodic.first_zero(HARMONICS, c, 0.0, begin, begin + 2.0 * np.pi)
    path = np.linspace(begin, found, 2000)[:-2]
    assert (periodic.states(HARMONICS, path) @ c < 1e-9).all() and abs(periodic.states(HARMONICS, found) @ c) < 1e-13
    assert periodic.first_zero(HARMONICS, c, 0.0, begin, found - 1e-6) is None
    assert periodic.first_zero((), c[:1], 1.0, 0.0, 9.0) is None
    assert periodic.first_zero((1,), np.array([-1.0, 0, 0]), 1.0, 0, 9) is None
    touching = np.array([-1.0, 1.0, 0.0])  # cos - 1: touches zero, never crosses it
    assert periodic.first_zero((1,), touching, 1.0, 1.0, 9.0) is None


def test_signs_after_a_zero_and_products(rng):
    def sign(c, theta, size=1.0, harmonics=(1,)):
        return periodic.sign_after(harmonics, np.array(c, float), size, theta)

    assert sign([0.5, 0, 0], 0.3) == 1 and sign([-0.5, 0, 0], 0.3) == -1 and sign([0, 0, 0], 0.3) == 0
    assert sign([0, 0, 1], 0.0) == 1 and sign([0, 0, -1], 0.0) == -1 and sign([0, 0, 1], np.pi) == -1
    assert sign([1, -1, 0], 0.0) == 1 and sign([-1, 1, 0], 0.0) == -1  # to the second order
    assert sign([0, 0, 1, 0, -1.0 / 3.0], 0.0, harmonics=(1, 3)) == 1  # sin x - sin 3x / 3: to the third
    assert sign([1e-15, 0, 0], 0.0, size=1.0) == 0 and sign([1e-15, 0, 0], 0.0, size=1e-3) == 1
    a, b = rng.normal(size=(2, 5))
    wide, c = periodic.product(HARMONICS, [(a, b), (a, a)])
    theta = rng.uniform(0.0, 6.0, 9)
    u, v = periodic.states(HARMONICS, theta) @ a, periodic.states(HARMONICS, theta) @ b
    assert wide == (1, 2, 3, 4, 5, 6) and periodic.states(wide, theta) @ c == pytest.approx(u * v + u * u, abs=1e-13)
    nodes, weights = np.polynomial.legendre.leggauss(60)
    start, end = 0.7, 5.1
    at = start + 0.5 * (end - start) * (nodes + 1.0)
    known = 0.5 * (end - start) * weights @ ((periodic.states(HARMONICS, at) @ a) * (periodic.states(HARMONICS, at) @ b))
    assert periodic.product_integral(HARMONICS, a, b, start, end) == pytest.approx(known, rel=1e-12)
    assert periodic.product_integral((), np.array([2.0]), np.array([3.0]), 0.5, 2.0) == pytest.approx(9.0)


@pytest.mark.parametrize(("r", "first", "push"), [(0.5, (2.0, 0.3, 4.0), 0.01), (0.5, (-0.4, 0.3, 4.0), 0.2),
                                                  (0.4, (9.0, 0.3, 4.0), 1.0), (0.7, (1.5, 0.0, 1.0), 1.5)])
def test_how_high_a_flight_rises(r, first, push):
    """Two accelerations toward the stop, the first until the slip is lost: the less the second is, the higher it rises."""
    acceleration, slip, loss = first
    parts = np.zeros(9)
    parts[[0, 4, 8]] = acceleration, loss, slip
    until = slip / loss
    t = np.linspace(0.0, 2.0 * r / push + until, 400001)
    speed = -r + acceleration * np.minimum(t, until) + push * np.maximum(t - until, 0.0)
    way = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(t))])
    assert chatter.height(r, parts, push) == pytest.approx(-way.min(), rel=1e-6)


def test_memory_that_is_left_out_follows_the_walls_at_the_time_of_the_start():
    """Of a slider on a wall that moves: the virgin slider is where the mass is, seen from the wall at that time."""
    def relax(x):
        x[2] = x[0] - x[4]
    scene = SimpleNamespace(n=1, ns=3, forcing=lambda t: np.column_stack((np.ones_like(t), np.cos(t), np.sin(t))), relax=relax)
    assert initial.checked_state(scene, (0.5, 0.1), 0.7) == pytest.approx([0.5, 0.1, 0.5 - math.cos(0.7)])
    assert initial.checked_state(scene, (0.5, 0.1, 9.0), 0.7).tolist() == [0.5, 0.1, 9.0]
