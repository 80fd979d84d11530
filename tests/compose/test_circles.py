"""Laws on circles and what becomes of expressions there, against differences and the mechanics of a point that moves on one."""
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc.compose import curve, evaluate, lawtext, pieces, writer, written
from bifurc.compose.pieces import FORCE, GUARD, KICK, REACTION, REST, SceneLaw
from bifurc.compose.scene import scene_of
from bifurc.elements import CubicSpring, ElasticStator, Force, HarmonicForce, Law, RigidStator, RigidStop, Rows
from bifurc.elements.local import cos, lam, s, u, z
from bifurc.elements.site import Circle

X, V, A = np.array([0.8, -0.5]), np.array([0.4, 1.3]), np.array([-0.7, 0.6])
CENTRE, RADIUS, DRIFT, SPIN = np.array([0.1, -0.2]), 0.6, 0.3, 0.7


def frame(x, v):
    """Return normal, tangent, radius, and speeds along both."""
    p = x - CENTRE
    r = np.hypot(*p)
    n = p / r
    t = np.array([-n[1], n[0]])
    return n, t, r, n @ v, t @ v


def slopes(function, *at, h=1e-6):
    """Return the derivatives of a function of several vectors by all their entries, (outs, entries)."""
    columns = []
    for i, part in enumerate(at):
        for d in h * np.eye(part.size):
            moved = [[*at[:i], part + way * d, *at[i + 1:]] for way in (1.0, -1.0)]
            columns.append((np.atleast_1d(function(*moved[0])) - np.atleast_1d(function(*moved[1]))) / (2.0 * h))
    return np.array(columns).T


def test_local_coordinates():
    n, t, r, sn, w = frame(X, V)
    found = curve.polar(*(X - CENTRE), *V)
    assert found == pytest.approx((*n, r, sn, w), rel=1e-15)
    assert curve.polar(0.0, 0.0, 0.3, 0.4) == (1.0, 0.0, 0.0, 0.3, 0.4) and curve.turned(0.0) == 0.0 and curve.turned(4.0) == 0.25


def g(depth, sn, w):
    return 0.3 * depth**2 + depth * sn - 0.7 * w + sn * w


def test_slopes_of_functions_of_depth_and_speeds():
    n, t, r, sn, w = frame(X, V)
    by = (0.6 * r + sn, r + w, -0.7 + sn)

    def value(x, v):
        _, _, r, sn, w = frame(x, v)
        return g(r, sn, w)

    def force(x, v):
        n, t, r, sn, w = frame(x, v)
        return n * g(r, sn, w) + t * (r * w - sn)

    assert curve.scalar_slope(*n, r, sn, w, *by) == pytest.approx(slopes(value, X, V)[0], abs=1e-8)
    found = curve.vector_slope(*n, r, sn, w, g(r, sn, w), r * w - sn, by, (w, -1.0, r))
    assert np.reshape(found, (2, 4)) == pytest.approx(slopes(force, X, V), abs=1e-8)


def test_polynomial_depth_and_affine_laws():
    def depth(x, v):
        return curve.level(*x, *v, *CENTRE, -1.3, RADIUS)

    assert depth(X, V) == pytest.approx(-1.3 * (np.sum((X - CENTRE)**2) - RADIUS**2) / (2.0 * RADIUS), rel=1e-15)
    assert curve.level_slope(*X, *V, *CENTRE, -1.3, RADIUS) == pytest.approx(slopes(depth, X, V)[0], abs=1e-8)
    c = (0.5, -1.5, 2.5, 3.5, -0.4, 0.3, 0.2, 0.1)
    at = (0.6, 9.0, 0.7, -0.8)
    one, two = c[0] + c[1] * 0.6 + c[2] * 0.7 - c[3] * 0.8, c[4] + c[5] * 0.6 + c[6] * 0.7 - c[7] * 0.8
    assert curve.affine_scalar(*at, *c[:4]) == pytest.approx(one) and curve.affine_pair(*at, *c) == pytest.approx((one, two))
    assert curve.affine_scalar_slope(*at, *c[:4]) == (c[1], 0.0, c[2], c[3])
    assert curve.affine_pair_slope(*at, *c) == (c[1], 0.0, c[2], c[3], c[5], 0.0, c[6], c[7])


W = np.array([[1.2, 0.3], [0.3, 0.9]])
PUSHES = {0: (-1.0, 0.25), 1: (0.3, 1.0), 2: (0.0, 0.0)}


def held(x, v, a, rows):
    """Return multipliers and force by asking that the rates of the held speeds vanish, as a linear system."""
    n, t, r, sn, w = frame(x, v)
    conditions = {0: [(n, w * w / r)], 1: [(t, SPIN * sn - sn * w / r)],
                  2: [(n, w * w / r), (t, SPIN * sn - sn * w / r)]}[rows]
    directions = [n * PUSHES[rows][0] + t * PUSHES[rows][1]] if rows < 2 else [n, t]
    matrix = np.array([[h @ W @ d for d in directions] for h, _ in conditions])
    found = np.linalg.solve(matrix, [-(h @ a) - bend for h, bend in conditions])
    return np.array([*found, 0.0][:2]), sum(k * d for k, d in zip(found, directions, strict=True))


@pytest.mark.parametrize("rows", [0, 1, 2])
def test_reactions_keep_rows_at_rest(rows):
    numbers = (*CENTRE, DRIFT, SPIN, float(rows), W[0, 0], W[0, 1], W[1, 1], *PUSHES[rows])
    multipliers, force = held(X, V, A, rows)
    assert curve.multipliers(*X, *V, *A, numbers) == pytest.approx((*multipliers, *force), rel=1e-12, abs=1e-14)
    assert curve.reaction(*X, *V, *A, *numbers) == pytest.approx(tuple(force), rel=1e-12)
    n, t, r, sn, w = frame(X, V)  # the rates of n . v and t . v + spin r along the motion, by differences
    acceleration, h = A + W @ force, 1e-6
    later, before = (frame(X + way * h * V, V + way * h * acceleration) for way in (1.0, -1.0))
    if rows != 1:
        assert (later[3] - before[3]) / (2.0 * h) == pytest.approx(0.0, abs=1e-8)
    if rows != 0:
        assert (later[4] + SPIN * later[2] - before[4] - SPIN * before[2]) / (2.0 * h) == pytest.approx(0.0, abs=1e-8)
    for k in range(6):
        d = 1e-6 * np.eye(6)[k]
        ends = [curve.multipliers(*(np.concatenate([X, V, A]) + way * d), numbers) for way in (1.0, -1.0)]
        known = (np.array(ends[0]) - ends[1]) / 2e-6
        assert curve.varied(*X, *V, *A, numbers, k) == pytest.approx(known, abs=1e-7)
    more = (RADIUS, 0.4, 1.1, -0.3, 0.6, 0.8, -0.5)

    def limit(x, v, a):
        return curve.limit(*x, *v, *a, *numbers, *more)

    assert limit(X, V, A) == pytest.approx(0.4 + 1.1 * (r - RADIUS) - 0.3 * sn + 0.6 * (w + DRIFT + SPIN * r) + 0.8 * multipliers[0]
                                           - 0.5 * multipliers[1])
    assert curve.limit_slope(*X, *V, *A, *numbers, *more) == pytest.approx(slopes(limit, X, V, A)[0], abs=1e-7)


@pytest.mark.parametrize("rows", [0.0, 1.0, 2.0])
def test_states_are_put_to_rest_on_the_circle(rows):
    numbers = (*CENTRE, RADIUS, DRIFT, SPIN, rows)
    change = np.array(curve.put_at_rest(*X, *V, *numbers))
    x, v = X + change[:2], V + change[2:]
    n, t, r, sn, w = frame(x, v)
    if rows != 1.0:
        assert (r, sn) == pytest.approx((RADIUS, 0.0), abs=1e-14)
    else:
        assert np.array_equal(x, X) and n @ v == pytest.approx(frame(X, V)[3])
    if rows != 0.0:
        assert w + DRIFT + SPIN * r == pytest.approx(0.0, abs=1e-14)
    else:
        assert t @ change[2:] == pytest.approx(0.0, abs=1e-15)
    whole = slopes(lambda x, v: np.array(curve.put_at_rest(*x, *v, *numbers)), X, V)
    found = curve.rest_slope(*X, *V, *numbers)
    assert np.reshape(found[:4], (2, 2)) == pytest.approx(whole[:2, :2], abs=1e-8) and np.abs(whole[:2, 2:]).max() < 1e-9
    assert np.reshape(found[4:8], (2, 2)) == pytest.approx(whole[2:, :2], abs=1e-8)
    assert np.reshape(found[8:], (2, 2)) == pytest.approx(whole[2:, 2:], abs=1e-8)
    n, t, r, sn, w = frame(X, V)
    slide, stop = abs(w + DRIFT + SPIN * r), abs(sn)
    depth = (r - RADIUS) / (r + 0.3)
    expected = {0.0: (stop, depth), 1.0: (slide, 0.0), 2.0: (max(slide, stop), depth)}[rows]
    assert curve.unrest(*X, *V, *numbers) == pytest.approx(expected, rel=1e-12)


# ---- laws at one state ---------------------------------------------------------------------------------------------------------


def bent(d, none, sn, st, k):
    return -k * d * d - 0.3 * sn * st, -0.2 * k * d + st**3


def bent_slope(d, none, sn, st, k):
    return -2.0 * k * d, 0.0, -0.3 * st, -0.3 * sn, -0.2 * k, 0.0, 0.0, 3.0 * st * st


def test_values_and_slopes_of_laws():
    """Straight and curved, with derivatives of their own and differenced ones."""
    circle = (*CENTRE, RADIUS, DRIFT, SPIN)
    n, t, r, sn, w = frame(X, V)
    radial, tangential = bent(r - RADIUS, 0.0, sn, w + DRIFT + SPIN * r, 1.7)
    for jacobian in (bent_slope, None):
        law = SceneLaw(0, "x", ("always",), 2, Law(bent, (1.7,), jacobian), FORCE, 0, True)
        at, numbers = np.concatenate([X, V]), np.array([*circle, 1.7])
        assert law.outs == 2 and not law.reads
        assert evaluate.value(law, at, numbers) == pytest.approx(n * radial + t * tangential)
        known = slopes(lambda x, law=law, numbers=numbers: evaluate.value(law, x, numbers), at)
        found, by_depth = evaluate.slope(law, at, numbers, np.ones(len(at)))
        assert found == pytest.approx(known, abs=1e-7) and by_depth.tolist() == [0.0, 0.0]
        guard = law._replace(stage=GUARD, law=Law(lambda d, none, sn, st, k: k * d + sn * st,
                                                  (1.7,), jacobian and (lambda d, none, sn, st, k: (k, 0.0, st, sn))))
        assert guard.outs == 1
        assert evaluate.value(guard, at, numbers) == pytest.approx([1.7 * (r - RADIUS) + sn * (w + DRIFT + SPIN * r)])
        known = slopes(lambda x, law=guard, numbers=numbers: evaluate.value(law, x, numbers), at)
        found, by_depth = evaluate.slope(guard, at, numbers, np.ones(len(at)))
        assert found == pytest.approx(known, abs=1e-7) and by_depth.tolist() == [0.0]
        for each in (law, guard) if jacobian else ():
            whole, (kept, by_depth) = (evaluate.slope(each, at, numbers, np.ones(4), 0.0, apart) for apart in (False, True))
            assert kept + np.outer(by_depth, [*n, 0.0, 0.0]) == pytest.approx(whole[0], rel=1e-12, abs=1e-13)
            deeper = slopes(lambda more, given=(each, at, numbers): evaluate.value(*given, more[0]), np.zeros(1))
            assert by_depth == pytest.approx(deeper[:, 0], abs=1e-7) and np.abs(by_depth).min() > 0.05
        straight = SceneLaw(0, "x", ("always",), 2, Law(bent, (1.7,), jacobian), FORCE, 0, False)
        assert evaluate.value(straight, at, np.array([1.7])) == pytest.approx(bent(*at, 1.7))
        assert evaluate.slope(straight, at, np.array([1.7]), np.ones(len(at)))[0] == pytest.approx(
            slopes(lambda x, law=straight: evaluate.value(law, x, np.array([1.7])), at), abs=1e-7)


def test_laws_of_a_scene_in_a_mode(rng):
    """Forces of the laws that act, in the order of their rows; none where they do not act."""
    stop = RigidStop(5.0)
    system = bf.System(np.eye(2), np.eye(2), np.eye(2), [CubicSpring(0.7, row=(1.0, -2.0)), stop,
                                                         Force(pair, site=np.eye(2), k=0.4)])
    scene = scene_of(system)
    laws = evaluate.Laws(scene.laws, scene.tables, scene.index(("always", "free", "always")))
    x = np.concatenate([rng.normal(size=4), [1.0]])
    d, (a, b) = x[0] - 2.0 * x[1], pair(*x[:2], *x[2:4], 0.4)
    assert bool(laws) and laws.values(x) == pytest.approx([-0.7 * d**3, a, b])
    known = slopes(lambda y: laws.values(np.concatenate([y, [1.0]])), x[:4])
    assert laws.slopes(x) == pytest.approx(known, abs=1e-7)
    both = laws.both(x)
    assert np.array_equal(both[0], laws.values(x)) and np.array_equal(both[1], laws.slopes(x))
    assert not evaluate.Laws((), scene.tables, 0)
    rubbing = scene_of(bf.systems.rotating_frame_rotor())
    free = evaluate.Laws(rubbing.laws, rubbing.tables, rubbing.index(("always", "free")))
    slip = evaluate.Laws(rubbing.laws, rubbing.tables, rubbing.index(("always", "slip+")))
    y = np.array([1.1, 0.2, 0.0, 0.3, 1.0])
    assert np.count_nonzero(free.values(y)) < np.count_nonzero(slip.values(y))


def pair(u0, u1, s0, s1, k):
    return -k * u0 * u1, s0 * s0 - k * u1


# ---- pieces --------------------------------------------------------------------------------------------------------------------


def test_expressions_on_a_circle_and_what_it_does_not_have():
    assert pieces.coefficients(2.0 * u(0) - s(1) + 3.0, "x") == (3.0, 2.0, 0.0, -1.0)
    assert pieces.coefficients(lam(1) - s(0), "x", 2) == (0.0, 0.0, -1.0, 0.0, 0.0, 1.0) and pieces.coefficients(4, "x")[0] == 4.0
    for wrong, name in ((u(1), "u(1)"), (z(0), "z(0)"), (cos(1), "cos(1)"), (lam(0), "lam(0)")):
        with pytest.raises(ValueError, match=f"x: .* contains {name}, which a circle does not have".replace("(", r"\(").replace(
                ")", r"\)").replace(r"\(circle", "(circle")):
            pieces.coefficients(wrong, "x")


def test_what_of_the_modes_of_a_stator_is_a_law():
    core = bf.elements.Core(np.eye(2), np.eye(2), np.eye(2), None)
    circle = (0.1, -0.2, 0.6, 0.3, 0.7)
    soft = ElasticStator(stiffness=5.0, damping=0.4, friction=0.2, centre_x=0.1, centre_y=-0.2, radius=0.6, surface_speed=0.3,
                         frame_spin=0.7)
    hard = RigidStator(restitution=0.5, friction=0.2, centre_x=0.1, centre_y=-0.2, radius=0.6, surface_speed=0.3, frame_spin=0.7)
    site = soft.site(2)

    def told(element, key, w=W):
        return [(piece.stage, piece.guard, piece.function, piece.values, piece.curved) for piece in
                pieces.pieces(site, element.mode(key, core), "x", w)]

    assert told(soft, "free") == [(GUARD, 0, curve.level, (0.1, -0.2, 1.0, 0.6), False)]
    slip = told(soft, "slip+")
    assert slip[0] == (FORCE, -1, curve.affine_pair, (*circle, 0.0, -5.0, -0.4, 0.0, 0.0, -1.0, pytest.approx(-0.08), 0.0), True)
    assert slip[1] == (GUARD, 0, curve.affine_scalar, (*circle, 0.0, -5.0, -0.4, 0.0), True)
    assert slip[2] == (GUARD, 1, curve.affine_scalar, (*circle, 0.0, 0.0, 0.0, -1.0), True)
    roll = told(soft, "roll")
    numbers = (0.1, -0.2, 0.3, 0.7, 1.0, 1.2, 0.3, 0.9, 0.0, 1.0)
    assert [item[:3] for item in roll] == [(FORCE, -1, curve.affine_pair), (REACTION, -1, curve.reaction), (REST, -1, curve.unrest),
                                           (GUARD, 0, curve.affine_scalar), (GUARD, 1, curve.limit), (GUARD, 2, curve.limit)]
    assert roll[1][3] == numbers and roll[2][3] == (*circle, 1.0)
    assert roll[4][3] == (*numbers, 0.6, 0.0, -1.0, pytest.approx(-0.08), 0.0, 1.0, 0.0)
    both = told(hard, "roll")
    assert both[0][3] == (0.1, -0.2, 0.3, 0.7, 2.0, 1.2, 0.3, 0.9, 0.0, 0.0)
    assert both[3][3][-2:] == (pytest.approx(0.2), 1.0) and both[4][3][-2:] == (pytest.approx(0.2), -1.0)
    kick = told(hard, "free")
    assert kick[0][:2] == (KICK, 0) and kick[0][3] == (*circle, 0.5, 0.2, 1.0) and kick[0][4] is True and kick[1][0] == GUARD
    straight = pieces.pieces(Rows.of(0, 1), CubicSpring(0.7).mode("always", core), "x", W[:1, :1])
    assert [(p.stage, p.guard, p.values, p.curved) for p in straight] == [(FORCE, -1, (0.7,), False)]
    assert pieces.pieces(Rows.of(0, 1), RigidStop().mode("free", core), "x", W[:1, :1]) == [] and type(site) is Circle
    assert pieces.is_law(Law(pair)) and not pieces.is_law(u())


def test_rows_of_laws_and_laws_joined():
    one = SceneLaw(0, "a", ("k",), 2, Law(pair, (1.0,)), GUARD, 0, False)
    two = SceneLaw(1, "b", ("k",), 1, Law(bent, (1.0,)), FORCE, 0, False)
    three = SceneLaw(0, "a", ("m",), 2, Law(pair, (2.0,)), GUARD, 0, False)
    whole = pieces.joined([one, two, three])
    assert [(law.name, law.keys) for law in whole] == [("b", ("k",)), ("a", ("k", "m"))]
    again = SceneLaw(1, "b", ("k",), 1, Law(pair, (2.0,)), KICK, 0, False)
    rows = pieces.law_rows((two, one, again))
    assert rows.owners.tolist() == [[0, 1, 1, 3], [1, 2, 2, 1], [0, 1, 2, 0], [1, 0, 0, 1]]
    assert rows.stages.tolist() == [1, 1, 3, 4, 2, 1] and pieces.law_rows(()).stages.tolist() == [0, 0, 0, 0, 1, 0]
    level = SceneLaw(2, "c", ("k",), 2, Law(curve.level, (0.1, 0.2, 1.0, 0.6)), GUARD, 0, False)
    assert level.is_level and not one.is_level and pieces.law_rows((two, level, one, again)).stages.tolist() == [1, 1, 5, 6, 2, 3]
    assert [law.outs for law in (one, two)] == [1, 1] and SceneLaw(0, "a", (), 2, Law(curve.limit), GUARD, 0, False).reads


# ---- texts ---------------------------------------------------------------------------------------------------------------------


def test_laws_of_one_text_differ_in_their_element_alone():
    """What a law gives, its derivatives, its numbers, its turn in a mode and where it is read are parts of the text."""
    def f(u, s, k):
        return -k * u

    def g(u, s, k):
        return -k * s
    one = SceneLaw(0, "x", ("k",), 1, Law(f, (1.0,)), FORCE, 0, False)
    for change in ({"stage": GUARD}, {"stage": KICK}, {"law": Law(g, (1.0,))}, {"law": Law(f, (1.0,), g)},
                   {"law": Law(f, (1.0, 2.0))}, {"slot": 1}, {"curved": True}, {"rows": 2}):
        other = one._replace(element=1, **change)
        assert [each.places[0][0] for each in writer.alike([one, other])] == [0, 1], change
    alike, = writer.alike([one, one._replace(element=1, name="y", law=Law(f, (3.0,)), keys=("a", "b")), one._replace(element=4)])
    assert alike.places == [(0, 0, 0, 0), (1, 1, 1, 1), (2, 2, 2, 4)]


@pytest.mark.parametrize("fast, slope", [(800.0, 0.0), (2000.0, 0.3)])
def test_the_error_of_differences_is_that_of_their_formula(fast, slope):
    """Of sin(a u), five places h apart give a cos(a u) (8 sin a h - sin 2 a h) / 6 a h; of a linear part nothing is lost."""
    law = SceneLaw(0, "x", ("k",), 1, Law(lambda u, s: math.sin(fast * u) + slope * s), FORCE, 0, False)
    points = np.array([[1.0, 0.2], [-0.4, 2.0], [0.7, -1.0]])

    def slopes(u, step):
        return fast * math.cos(fast * u) * (8.0 * math.sin(fast * step) - math.sin(2.0 * fast * step)) / (6.0 * fast * step)
    first, second = 1e-3, 1e-3 / 16.0  # a thousandth of the largest coordinate, then 16 times smaller
    changes = [abs(slopes(u, first) - slopes(u, second)) for u in points[:, 0]]
    size = max(*(abs(slopes(u, second)) for u in points[:, 0]), slope)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(writer, "LEVELS", 2)
        assert writer.difference_error(law, points) == pytest.approx(max(changes) / size, rel=1e-6)
    assert writer.difference_error(law, points) < 1e-3 * max(changes) / size  # the best of all pairs of steps


def test_laws_of_one_text_are_gone_through_together():
    springs = [CubicSpring(0.1 * k, dof=k) for k in (1, 2)] + [CubicSpring(0.3)]
    scene = scene_of(bf.System(np.eye(3), np.eye(3), np.eye(3), [*springs, Force(pair, site=np.eye(3)[:2], k=1.0)]))
    first, other = writer.alike(scene.laws)
    assert first.places == [(0, 0, 0, 0), (1, 1, 1, 1), (2, 2, 2, 2)] and other.places == [(3, 3, 3, 3)]
    assert first.place(1) == "PLACES_0[k, 1]" and other.place(1) == "3" and other.looped("    x\n") == "    x\n"
    assert first.looped("    x\n") == "    for k in range(3):\n        x\n"
    assert writer.differenced(scene.laws) == ("force",)
    error = writer.difference_error(scene.laws[-1], [[1.0, 2.0, 0.5, -0.4], [0.3, 0.1, 0.2, 2.0]])
    assert 0.0 <= error < 1e-9
    sharp = SceneLaw(0, "x", ("k",), 1, Law(lambda u, s, k: math.tanh(u / k), (1e-9,)), FORCE, 0, False)
    assert writer.difference_error(sharp, [[1.0, 0.0], [0.0, 0.0]]) > 1e-5
    still = SceneLaw(0, "x", ("k",), 1, Law(lambda u, s: 0.0), FORCE, 0, False)
    assert writer.difference_error(still, [[1.0, 1.0]]) == 0.0
    keys = {writer.law_key(text) for text in ("a\n", "b\n")}
    assert len(keys) == 2 and all(len(key) == 20 for key in keys)


def many(u, s, *more):
    return u


def named(u, s, *, k=1.0):
    return u


@pytest.mark.parametrize("law, words", [
    (many, "law many: only plain arguments are allowed"), (named, "law named: only plain arguments are allowed"),
    (math.sin, "is not a Python function"), (eval("lambda u, s: -u"), "its source text cannot be found")])
def test_functions_that_cannot_be_written(law, words):
    with pytest.raises(lawtext.LawError, match=words):
        lawtext.standalone(law, "law")


def test_written_modules_are_whole_files_and_loaded_once(tmp_path):
    path = tmp_path / "deep" / "m.py"
    module = written.load("bifurc_test_written", path, "x = 3\n")
    assert module.x == 3 and path.read_text() == "x = 3\n" and [item.name for item in path.parent.glob("*.*")] == ["m.py"]
    assert written.load("bifurc_test_written", path, "x = 4\n") is module
    other = written.load("bifurc_test_written_too", path, "x = 5\n")
    assert other.x == 3  # what is there is taken
    with pytest.raises(ZeroDivisionError):
        written.load("bifurc_test_written_ill", tmp_path / "ill.py", "1 / 0\n")
    import sys

    assert "bifurc_test_written_ill" not in sys.modules
    assert written.source("bifurc.compose.written").startswith('"""Modules that the package writes')
    HarmonicForce()


@pytest.mark.parametrize("length, time", [(1e-9, 1.0), (1e-6, 1e-6), (1.0, 1.0), (1e3, 1e3)])
def test_a_law_without_a_jacobian_has_its_slopes_in_any_units(length, time):
    """Steps of differences follow from the natural sizes of the scene: a spring that saturates, k u / (1 + (u / w)^2), with its
    derivative in closed form."""
    def soft(u, v, k=1.0, w=1.0, c=0.1):
        return -k * u / (1.0 + (u / w)**2) - c * v
    k, w, c = 2.0 / time**2, 0.3 * length, 0.1 / time
    force = bf.elements.Force(soft, k=k, w=w, c=c)
    system = bf.System(1.0, 0.0, 1.0 / time**2, [force, bf.elements.ConstantForce(1.0 * length / time**2)])
    scene = scene_of(system)
    for at in (0.0, 0.1 * w, w):
        found = evaluate.Laws(scene.laws, scene.tables, 0).slopes(np.array([at, 0.0, 1.0]))
        q = (at / w)**2
        assert found[0] / (k, c) == pytest.approx([-(1.0 - q) / (1.0 + q)**2, -1.0], abs=1e-9)
