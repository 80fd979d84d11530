"""What events do to states where laws have a say, on tables of numbers: derivatives are those of differences of the states."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.compose.tables import ORDER
from bifurc.flow.chatter import CLOSE, DURATION, EXCESS, WAY
from bifurc.flow.laws import calls, guards
from tests.reference.plain import plain

ROWS, KICKED, RESTING = 5, (1, 3), (3, 5)  # rows of laws: one force, two impulses, two constraints; two coordinates, one memory


@pytest.fixture
def T(rng):
    stages = np.zeros(9, np.int64)
    stages[[calls.FORCES, calls.ACTING, calls.KICKS, calls.RESTS, calls.WIDTH]] = 1, 1, *KICKED, 2
    owners = np.zeros((6, ROWS), np.int64)
    owners[calls.SOURCE] = [0, 1, 1, 3, 4]
    owners[calls.FIRST], owners[calls.COUNT] = [0, 1, 1, 3, 3], [1, 2, 2, 2, 2]
    owners[calls.OWNER] = [10, 11, 12, 13, 14]
    kick = np.zeros((2, 2), np.int64)
    kick[1, 1] = 1
    return SimpleNamespace(LU=rng.normal(size=(ROWS, 8)), LS=rng.normal(size=(ROWS, 8)), LP=rng.normal(size=(2, ROWS, 2)),
                           kick=kick, A=rng.normal(size=(2, 5, 8)), stages=stages, owners=owners,
                           element=np.array([[0, 4], [0, 7]]),
                           LG=np.zeros((2, 2, ROWS)), n_guards=np.array([1, 2]), step=np.array([0.5, 0.25]),
                           ratio=np.array([[0.0, 0.0], [0.0, 0.6]]), G=rng.normal(size=(2, 2, 8)),
                           GT=rng.normal(size=(2, 2, 8, ORDER + 1)))


def differences(function, x, h=1e-6):
    return np.array([(function(x + e) - function(x - e)) / (2.0 * h) for e in h * np.eye(x.size)]).T


def test_rows_see_their_coordinates_and_speeds(T, rng):
    x = rng.normal(size=8)
    local = plain(guards.local_at)(T, x)
    own = [0, 1, 3, 4]
    assert local.shape == (4, ROWS, 1) and not local[2:].any() and not local[:2, 2].any()  # row 2 looks where row 1 does
    assert local[0, own, 0] == pytest.approx(T.LU[own] @ x, abs=1e-14)
    assert local[1, own, 0] == pytest.approx(T.LS[own] @ x, abs=1e-14)


def impulse(local):
    """Return two impulses of coordinates and speeds of the rows 1 and 2, and their slopes (2, 2, 2)."""
    (u, w), (s, z) = local[0, 1:3], local[1, 1:3]
    return np.array([u * w + s * s, w * w - 2.0 * s * z]), np.array([[[w, u], [0.0, 2 * w]], [[2 * s, 0.0], [-2 * z, -2 * s]]])


def kicks(T):
    def seen(x):
        local = np.zeros((4, ROWS))
        local[0], local[1] = T.LU @ x, T.LS @ x
        return local

    def impulses(T_, m, g, closes, x):
        local = seen(x)
        local[2, 1:3] = impulse(local)[0]
        return local[:, :, None]

    def ask(T_, what, m, owner, closes, local, slope):
        assert (what, m, owner, closes) == (calls.KICK_SLOPE, 1, 7, 1)
        slope[:2, 1:3, :, 0] = impulse(local[:, :, 0])[1]

    return impulses, ask


def test_impulses_of_laws_and_their_derivative(T, rng):
    impulses, ask = kicks(T)
    x, base = rng.normal(size=8), rng.normal(size=5)
    P, add = np.zeros((5, 8)), plain(guards.kick_and_slope, impulses=impulses, ask=ask)

    def moved(x):
        found = np.concatenate([base, x[5:]])
        add(T, 1, 1, True, x, found, np.zeros((5, 8)))
        return found[:5]

    add(T, 1, 1, True, x, np.zeros(8), P)
    known = impulse(np.array([T.LU @ x, T.LS @ x]))[0]
    assert moved(x) == pytest.approx(base + [0.0, 0.0, *(known @ T.LP[1, 1:3]), 0.0], abs=1e-13)
    assert P == pytest.approx(differences(moved, x), abs=1e-8)
    for kick, rests, changed in ((1, 3, True), (0, 3, False), (1, 1, False)):
        T.kick[1, 1], T.stages[calls.RESTS] = kick, rests
        found = np.zeros(8)
        plain(guards.curved_kick, impulses=impulses)(T, 1, 1, x, found)
        assert found[2:4] == pytest.approx(known @ T.LP[1, 1:3] if changed else np.zeros(2), abs=1e-13)
        assert not found[[0, 1, 4, 5, 6, 7]].any()


@pytest.mark.parametrize("moves", ["places and speeds", "memory alone", "nothing"])
def test_a_jump_from_a_surface_that_is_a_law_leaves_the_distance_out(T, rng, moves):
    """The derivative knows no direction across the surface, and the state is that from the point on it."""
    T.LG[1, 1, 2] = 1.0
    x, xp, P = rng.normal(size=8), rng.normal(size=8), rng.normal(size=(5, 8))
    row = {"places and speeds": np.array([0.5, -1.0, 0.3, 0.7, 2.0, 0.1, 0.2, -0.4]),
           "memory alone": np.array([0.0, 0.0, 0.0, 0.0, -1.6, 0.3, 0.1, 0.2]), "nothing": np.zeros(8)}[moves]
    asked = []

    def surface(T_, m, g, at, out):
        out[:] = row
        return 0.37

    def kick(T_, m, g, closes, at, xp_, P_):
        asked.append((m, g, closes, at.copy()))

    x0, xp0, P0 = x.copy(), xp.copy(), P.copy()
    jump = plain(guards.curved_jump, guard_and_gradient=surface, kick_and_slope=kick)
    jump(T, 1, 1, True, x, xp, P)
    across = np.zeros(8)
    across[:4 if moves == "places and speeds" else 5] = row[:4 if moves == "places and speeds" else 5]
    way = across * (0.37 / (across @ across)) if moves != "nothing" else across
    assert np.array_equal(x, x0) and len(asked) == 1 and asked[0][:3] == (1, 1, True)
    assert asked[0][3] == pytest.approx(x0 - way, abs=1e-14) and xp[:5] == pytest.approx(xp0[:5] - P0 @ way, abs=1e-13)
    assert np.array_equal(xp[5:], xp0[5:]) and P @ way == pytest.approx(np.zeros(5), abs=1e-13)
    along = P0 @ across / max(across @ across, 1e-9)
    assert P == pytest.approx(P0 - np.outer(along, row), abs=1e-13)
    T.LG[1, 1, 2], T.kick[1, 1] = 0.0, 0  # an affine guard without impulses: nothing is left to do
    jump(T, 1, 1, True, x0, xp0, P0)
    assert len(asked) == 1
    T.kick[1, 1] = -1
    jump(T, 1, 1, False, x0, xp0, P0)
    assert len(asked) == 2 and asked[1][2] is False and asked[1][3] == pytest.approx(x0)


def circle(T):
    """Return the rest on a curve and its slopes: places and speeds are moved by what laws say of the rows 3 and 4."""
    def moves(u, s):
        return np.array([u[0] * u[1], -0.5 * u[1] ** 2]), np.array([s[0] * u[1], s[1] * u[0] - s[0]])

    def slopes(T_, what, m, local):
        out, u, s = np.zeros((3, ROWS, 2, 1)), local[0, 3:, 0], local[1, 3:, 0]
        if what == calls.REST_MOVE:
            out[0, 3:, 0, 0], out[1, 3:, 0, 0] = moves(u, s)
        else:
            assert what == calls.REST_SLOPE
            out[0, 3:, :, 0] = [[u[1], u[0]], [0.0, -u[1]]]
            out[1, 3:, :, 0] = [[0.0, s[0]], [s[1], 0.0]]
            out[2, 3:, :, 0] = [[u[1], 0.0], [-1.0, u[0]]]
        return out

    return moves, slopes


def test_what_a_curve_holds_is_put_on_it_with_its_derivative(T, rng):
    moves, slopes = circle(T)
    T.stages[calls.RESTS] = 3
    project = plain(guards.curved_project, slopes=slopes)
    given, first = rng.normal(size=8), rng.normal(size=(5, 8))

    def earlier(z):
        return np.concatenate([first @ z, z[5:]])

    def held(z):
        x = earlier(z)
        project(T, 1, x)
        return x[:5]

    x = earlier(given)
    place, speed = moves(*(rows[3:] @ x for rows in (T.LU, T.LS)))
    assert held(given) == pytest.approx([*(x[:2] + place @ T.LP[1, 3:]), *(x[2:4] + speed @ T.LP[1, 3:]), x[4]], abs=1e-12)
    P = first.copy()
    plain(guards.curved_hold, slopes=slopes)(T, 1, x, P)
    assert x[:5] == pytest.approx(held(given), abs=1e-13) and P == pytest.approx(differences(held, given), abs=1e-7)
    T.stages[calls.RESTS] = ROWS  # no constraints on curves
    y, Q = rng.normal(size=8), np.ones((5, 8))
    z = y.copy()
    plain(guards.curved_project, slopes=None)(T, 1, y)
    plain(guards.curved_hold, slopes=None)(T, 1, y, Q)
    assert np.array_equal(y, z) and (Q == 1.0).all()


def test_a_mode_begins_on_its_curve_and_at_rest_to_rounding(T, rng):
    """The first row, a speed, against its terms and the fastest one; the second, a place, against a radius of 1."""
    T.stages[calls.RESTS] = 3
    x, scale = rng.normal(size=8), np.array([9.0, 9.0, 0.3, 2.0, 50.0, 1.0, 1.0, 1.0])
    own = 0.7  # the speed of the curve itself

    def rest(speed, place):
        def values(T_, what, m, local):
            assert what == calls.REST and m == 1
            still = not local[1].any()
            local[2, 3, 0], local[2, 4, 0] = -own if still else speed, place
        return plain(guards.curved_rest, values=values)(T, 1, x, scale)

    limit = guards.ZERO * (own + 2.0 * np.abs(T.LS[3:, :5]).sum())
    assert rest(0.0, 0.0) == -1
    for sign in (1.0, -1.0):
        assert rest(sign * 0.999 * limit, 0.0) == -1 and rest(sign * 1.001 * limit, 0.0) == 13
        assert rest(0.0, sign * 0.999 * guards.ZERO) == -1 and rest(0.0, sign * 1.001 * guards.ZERO) == 14
    assert rest(1.0, 1.0) == 13
    T.stages[calls.RESTS] = ROWS
    assert rest(1.0, 1.0) == -1


def test_what_the_rounding_of_forces_is_measured_by(T, rng):
    """One force of two rows, then a reaction that feels accelerations without it: sizes written out."""
    T.stages[[calls.FORCES, calls.ACTING]] = 1, 2
    T.owners[calls.FIRST, :2], T.owners[calls.COUNT, :2] = [0, 2], [2, 1]
    local, scale, edge = rng.normal(size=(4, ROWS, 1)), rng.uniform(0.5, 2.0, 8), rng.normal(size=(3, ROWS, 2, 1))
    found = plain(guards.force_sizes, slopes=lambda T_, what, m, at: edge if what == calls.SLOPE else None)
    sizes, pull = found(T, 1, scale, local)
    terms = [abs(edge[0, 0, b, 0] * T.LU[b]) + abs(edge[1, 0, b, 0] * T.LS[b]) for b in range(2)]
    force = abs(local[2, 0, 0]) + sum(terms) @ scale
    free = np.abs(T.A[1, 2:4]) @ scale + np.abs(T.LP[1, 0]) * force
    reaction = abs(local[2, 1, 0]) + (abs(edge[0, 1, 0, 0] * T.LU[2]) + abs(edge[1, 1, 0, 0] * T.LS[2])) @ scale \
        + np.abs(edge[2, 1, 0, 0] * T.LU[2, :2]) @ free
    assert sizes == pytest.approx([force, reaction, *np.abs(local[2, 2:, 0])], rel=1e-13)
    assert pull == pytest.approx(free + np.abs(T.LP[1, 1]) * reaction, rel=1e-13)


@pytest.mark.parametrize("kind, exact", [("place", 2), ("speed", 1), ("reaction", 1)])
def test_terms_of_guards_that_are_exact_and_those_of_polynomials(T, rng, kind, exact):
    """The force's rounding comes with the second derivative of places, the first of speeds; from there on each is over the step."""
    h, force, scale = 0.1, 3.0, rng.uniform(0.5, 2.0, 8)
    T.G[1, 1] = [0.5, -2.0, 0, 0, 0, 0, 0, 0] if kind == "place" else [0.5, 0, 0.7, -0.4, 0, 0, 0, 0]
    T.LG[1, 1, 0] = -0.9 if kind == "reaction" else 0.0
    a, size = np.empty(ORDER + 1), np.empty(ORDER + 1)

    def gradient_sizes(T_, m, g, x, f, given, pull, out):
        assert pull == "pull" and given is scale
        out[0], out[1] = 4.0, 5.0
        return -0.1, -0.2

    plain(guards.guard_terms, rate=lambda *args: None, values=lambda *args: None, scratch_of=lambda *args: None,
          fitted=lambda *args: h, series=lambda *args: args[-1].fill(7.0), gradient_sizes=gradient_sizes,
          force_sizes=lambda *args: (np.array([force, 0, 0, 0, 0]), "pull"))(T, 1, 1, np.ones(8), scale, a, size)
    known = np.abs(T.GT[1, 1]).T @ scale
    along = np.abs(T.LP[1, 0]) * force
    known[0] += abs(T.LG[1, 1, 0]) * force
    known[1] += np.abs(T.G[1, 1, 2:4]) @ along
    known[2] += 0.5 * np.abs(T.G[1, 1, :2]) @ along
    if kind == "reaction":
        known[:2] = 4.0, 5.0
    for j in range(exact + 1, ORDER + 1):
        known[j] = max(known[j], known[j - 1] / h)
    known[exact + 1:] *= guards.FITTED
    assert size == pytest.approx(known, rel=1e-12)
    assert a.tolist() == ([-0.1, -0.2] if kind == "reaction" else [7.0, 7.0]) + [7.0] * (ORDER - 1)


def test_series_of_all_guards_but_those_whose_zero_has_no_known_order(T):
    written, a = [], np.zeros((2, ORDER + 1))
    found = plain(guards.all_series, fitted=lambda *args: 0.3, scratch_of=lambda *args: None,
                  series=lambda T_, m, g, x, n, h, acc, force, unit, out: written.append((m, g, n, h, unit, out is not None)))(
        T, 1, np.ones(8), np.array([ORDER, ORDER - 1]), a)
    assert found == 0.3 and written == [(1, 1, 2, 0.3, 1, True)]


@pytest.mark.parametrize("bend", [0.0, 0.4, -0.4])
def test_impacts_on_a_surface_that_is_a_law_until_they_are_over(T, bend):
    """Push a + b t: flights written out one by one last 2 r v / (a (1 - r)) to first order, and so long to the second."""
    T.LG[1, 1, 0], push, v, r = 1.0, 2.0, 1e-3, 0.6
    asked, found, out = [], np.full(5, np.nan), np.empty(8)

    def terms(T_, m, g, x, scale, a, size):
        assert np.array_equal(scale, np.abs(x))
        a[:] = 0.0
        a[2], a[3] = 0.5 * push, bend / 6.0

    def jump(T_, m, g, closes, x, xp, P):
        asked.append((m, g, closes, P.shape))
        xp[2] = 9.0

    x = np.arange(1.0, 9.0) - 4.0
    closure = plain(guards.curved_closure, curved_jump=jump, guard_terms=terms)
    assert closure(T, 1, 1, x, v, out, found) and asked == [(1, 1, True, (5, 8))]
    assert out.tolist() == [*x[:2], 9.0, *x[3:]] and found[WAY] == 0.0
    speed, t = v, 0.0
    while speed > 1e-12 * v:
        rest = np.roots([bend / 6.0, 0.5 * (push + bend * t), -r * speed])  # height over time: -r v t + p t^2 / 2 + b t^3 / 6
        flight = min(root.real for root in rest if root.real > 0.0)
        speed = -r * speed + (push + bend * t) * flight + 0.5 * bend * flight**2
        t += flight
    assert found[DURATION] == pytest.approx(t, rel=1e-6) and abs(t / (2 * r * v / (push * (1 - r))) - 1) < 2e-3
    assert found[EXCESS] == pytest.approx(2 * r * v / (push * (1 - r)) * 4.0 / CLOSE, rel=1e-12)  # over the mode's step of 1/4
    bend = 6.0 * push
    closure(T, 1, 1, x, v, out, found)
    assert found[EXCESS] == pytest.approx(2 * r * v / (push * (1 - r)) * 6.0 / CLOSE, rel=1e-12)
    push = 0.0
    assert closure(T, 1, 1, x, v, out, found) and found[:2].tolist() == [np.inf, 0.0]
    T.LG[1, 1, 0] = 0.0
    assert not closure(T, 1, 1, x, v, out, found)
