"""The equations of a proof, read anew in rationals and balls, against matrices written by hand."""
from fractions import Fraction

import numpy as np
import pytest

import bifurc as bf
from bifurc.certify.arithmetic.balls import Balls, Rationals
from bifurc.certify.model import KNOWN, Model, Refused, floats_of, understood
from bifurc.certify.parameter.family import Family
from bifurc.elements import BaseMotion, Coulomb, CubicSpring, EventKind, Guard, HarmonicForce, Jenkins, Mode, RigidStop
from bifurc.elements.local import affine

flint = pytest.importorskip("flint")

M = np.array([[2.0, 0.25], [0.25, 0.5]])
C = np.array([[0.5, -0.125], [-0.0625, 0.25]])
K = np.array([[3.0, -1.0], [-1.5, 2.0]])
OMEGA, F, GAP, R, KT, LIMIT = 0.75, 1.25, 0.375, 0.5, 1.5, 0.625


def floats(matrix):
    return np.array([[float(Fraction(int(v.p), int(v.q))) for v in row] for row in matrix])


def rows_of(matrix):
    return [[matrix[i, j] for j in range(matrix.ncols())] for i in range(matrix.nrows())]


def system(*elements):
    return bf.System(M, C, K, [HarmonicForce(F, harmonic=2, dof=1), *elements], omega=OMEGA)


def model(*elements, keys):
    made = system(*elements)
    return Model(made, Rationals(), [(e, key) for e, own in enumerate(keys) for key in own])


def generator(force_rows):
    """Return d(q, v, z, 1, cos 2 theta, sin 2 theta)/d theta for forces (2, nx) in the coordinates beside M, C, K."""
    nx = force_rows.shape[1]
    out = np.zeros((nx, nx))
    out[0, 2] = out[1, 3] = 1.0 / OMEGA
    inner = np.zeros((2, nx))
    inner[:, :2], inner[:, 2:4] = -K, -C
    out[2:4] = np.linalg.solve(M, inner + force_rows) / OMEGA
    out[-2, -1], out[-1, -2] = -2.0, 2.0
    return out


def test_a_slider_between_two_masses_in_both_of_its_kinds_of_modes():
    """Stick: -kt (u - z); slip: -+ limit, where the memory follows u -+ limit / kt; u = q0 - 2 q1."""
    slider = Jenkins(KT, LIMIT, row=(1.0, -2.0))
    modes = list(slider.start)
    stick = next(key for key in modes if not any(slider.mode(key, None).memory))
    slips = [key for key in _keys(slider) if key != stick]
    found = model(slider, keys=([system(slider).elements[0].start[0]], _keys(slider)))
    load = system(slider).elements[0].start[0]
    nx, J = 8, np.array([1.0, -2.0])
    force = np.zeros((2, nx))
    force[1, 6] = F  # cos 2 theta
    sticking = force.copy()
    sticking[:, :2] -= KT * np.outer(J, J)
    sticking[:, 4] += KT * J
    mode = found.mode((load, stick))
    np.testing.assert_allclose(floats(rows_of(mode.B)), generator(sticking), rtol=1e-14, atol=1e-15)
    assert (found.ns, found.nx, found.harmonics) == (5, 8, (2,)) and not mode.holds
    assert not found.writes(1, stick) and len(slips) == 2
    for key in slips:
        side = found.mode((load, key))
        pushed = (floats(rows_of(side.B)) - generator(force))[2:4] * OMEGA
        limit = (M @ pushed)[:, 5]
        assert found.writes(1, key)
        np.testing.assert_allclose(np.abs(limit), LIMIT * np.abs(J), rtol=1e-14)
        sign = limit[0] / LIMIT  # force on u
        np.testing.assert_allclose(limit, sign * LIMIT * J, rtol=1e-14)
        np.testing.assert_allclose(np.delete(pushed, 5, axis=1), 0.0, atol=1e-15)
        (guard,) = side.guards  # slip ends where its speed turns
        want = np.zeros(nx)
        want[2:4] = J
        row = floats([guard.row])[0]
        np.testing.assert_allclose(row, row[2] * want, atol=1e-15)
        assert row[2] * sign > 0.0  # inside while u moves against the force
        reset = floats(rows_of(found.reset((load, key), 1, guard.number)))
        memory = np.zeros(nx)
        memory[:2], memory[5] = J, sign * LIMIT / KT  # -kt (u - z) = sign limit
        wanted = np.eye(nx)
        wanted[4] = memory
        np.testing.assert_allclose(reset, wanted, atol=1e-15)


def _keys(element):
    keys = list(element.start)
    for key in keys:
        for guard in element.mode(key, None).guards:
            keys += [after for after in guard.then if after not in keys]
    return keys


def test_an_impact_in_coordinates_with_coupled_inertia():
    """Newton's law along a row: v+ = v - (1 + r) M^-1 J^T s / (J M^-1 J^T); at rest the contact force holds the row."""
    stop = RigidStop(gap=GAP, restitution=R, row=(1.0, 2.0))
    made = system(stop)
    keys, load = _keys(stop), made.elements[0].start[0]
    found = model(stop, keys=([load], keys))
    J = np.array([1.0, 2.0])
    push = np.linalg.solve(M, J)
    free = next(key for key in keys if not stop.mode(key, None).hold)
    held = next(key for key in keys if stop.mode(key, None).hold)
    guard = next(g for g in found.mode((load, free)).guards if g.guard.kick is not None)
    row = floats([guard.row])[0]
    np.testing.assert_allclose(row, [1.0, 2.0, 0.0, 0.0, -GAP, 0.0, 0.0], atol=1e-15)
    reset = floats(rows_of(found.reset((load, free), 1, guard.number)))
    wanted = np.eye(7)
    wanted[2:4, 2:4] -= (1.0 + R) * np.outer(push, J) / (J @ push)
    np.testing.assert_allclose(reset, wanted, atol=1e-15)
    resting = found.mode((load, held))
    force = np.zeros((2, 7))
    force[1, 5] = F
    without = generator(force)
    reaction = -(J @ without[2:4]) / (J @ push)
    wanted = without.copy()
    wanted[2:4] += np.outer(push, reaction)
    np.testing.assert_allclose(floats(rows_of(resting.B)), wanted, atol=1e-14)
    (hold,) = resting.holds
    np.testing.assert_allclose(floats([hold.speed])[0], [0.0, 0.0, 1.0, 2.0, 0.0, 0.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(floats([hold.surface])[0], row, atol=1e-15)
    assert not hold.driven
    rest = floats(rows_of(found.at_rest((load, held))))
    state = np.array([0.3, -0.7, 1.1, 0.4, 1.0, 0.2, 0.9])
    after = rest @ state
    assert J @ after[:2] == pytest.approx(GAP, abs=1e-14) and J @ after[2:4] == pytest.approx(0.0, abs=1e-14)
    np.testing.assert_allclose(after[4:], state[4:])
    np.testing.assert_allclose(rest @ after, after, atol=1e-14)
    np.testing.assert_array_equal(floats(rows_of(found.at_rest((load, free)))), np.eye(7))


def test_a_belt_and_the_phase_as_time():
    """Stick on a belt: s = v - V is held, which is driven; forcing states turn with their harmonic."""
    friction = Coulomb(LIMIT, belt_speed=0.5, dof=0)
    made = system(friction)
    load = made.elements[0].start[0]
    stick = next(key for key in _keys(friction) if friction.mode(key, None).hold)
    found = model(friction, keys=([load], _keys(friction)))
    (hold,) = found.mode((load, stick)).holds
    np.testing.assert_allclose(floats([hold.speed])[0], [0.0, 0.0, 1.0, 0.0, -0.5, 0.0, 0.0], atol=1e-15)
    assert hold.driven and hold.surface is None and floats([hold.J])[0].tolist() == [1.0, 0.0]
    np.testing.assert_allclose(floats(rows_of(found.mode((load, stick)).B))[2], 0.0, atol=1e-15)
    rate = found.forced_rate([found.field.scalar(v) for v in (0, 0, 0, 0, 0, 3, 5)])  # 3 cos 2 theta + 5 sin 2 theta
    np.testing.assert_allclose(floats([rate])[0][5:], [5.0 * 2.0 * OMEGA, -3.0 * 2.0 * OMEGA])


def test_a_moving_frame_loads_with_its_acceleration():
    """z'' + .3 z' + 2 z = -X'' - .3 X' with X = A cos 2 theta."""
    made = bf.System(1.0, 0.3, 2.0, [BaseMotion(0.5, harmonic=2, damper="ground")], omega=OMEGA)
    found = Model(made, Rationals(), [(0, made.elements[0].start[0])])
    B = floats(rows_of(found.mode((made.elements[0].start[0],)).B))
    w = 2.0 * OMEGA
    np.testing.assert_allclose(B[1] * OMEGA, [-2.0, -0.3, 0.0, w * w * 0.5, 0.3 * w * 0.5], atol=1e-15)


def test_a_stop_that_moves_moves_its_surface_and_its_speed():
    """A stop that moves with cos(3 theta): the guard holds the motion, what rests on it has speed and acceleration of the base."""
    stop = RigidStop(gap=GAP, restitution=0.0, amplitude=0.5, harmonic=3)
    made = bf.System(1.0, 0.3, 2.0, [stop], omega=OMEGA)
    keys = _keys(made.elements[0])
    found = Model(made, Rationals(), [(0, key) for key in keys])
    free = next(key for key in keys if not stop.mode(key, None).hold)
    held = next(key for key in keys if stop.mode(key, None).hold)
    guard = next(g for g in found.mode((free,)).guards if g.guard.kick is not None)
    row = floats([guard.row])[0]
    sign = row[3] / 0.5  # u = x -+ A cos
    assert abs(sign) == 1.0
    np.testing.assert_allclose(row, [1.0, 0.0, -GAP, sign * 0.5, 0.0], atol=1e-15)
    (hold,) = found.mode((held,)).holds
    w = 3.0 * OMEGA
    np.testing.assert_allclose(floats([hold.speed])[0], [0.0, 1.0, 0.0, 0.0, -sign * 0.5 * w], atol=1e-15)
    assert hold.driven
    B = floats(rows_of(found.mode((held,)).B))
    np.testing.assert_allclose(B[1] * OMEGA, [0.0, 0.0, 0.0, sign * 0.5 * w * w, 0.0], atol=1e-14)  # x'' = -u_base''


def test_what_no_proof_is_made_for_is_named():
    with pytest.raises(Refused, match="autonomous"):
        Model(bf.System(1.0, 0.1, 1.0, [RigidStop(1.0, 0.5)]), Rationals(), [])
    cubic = bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.0), CubicSpring(0.5)], omega=1.0)
    with pytest.raises(Refused, match="is not affine"):
        Model(cubic, Rationals(), [(1, cubic.elements[1].start[0])])


# along a parameter

def family(low=0.5, high=1.5, name="omega"):
    made = bf.systems.impact_oscillator(zeta=0.05, omega=0.8, amplitude=0.5, gap=1.0, restitution=0.7)
    places = [(0, made.elements[0].start[0]), *((1, key) for key in _keys(made.elements[1]))]
    return made, Family(made, name, low, high, places), places


@pytest.mark.parametrize("name", ["omega", "zeta", "gap"])
def test_numbers_along_a_parameter_are_those_of_the_system_and_their_derivatives(name):
    made, along, places = family(name=name)
    p, h = 0.875, 2.0**-20
    value, above, below = (np.array(floats_of(made.with_parameters(**{name: v}), places)) for v in (p, p + h, p - h))
    found = along.numbers(flint.arb(p), 3)
    assert len(found) == len(value)
    np.testing.assert_allclose([float(v[0].mid()) for v in found], value, rtol=1e-14, atol=1e-15)
    np.testing.assert_allclose([float(v[1].mid()) for v in found], (above - below) / (2.0 * h), atol=1e-8)
    np.testing.assert_allclose([float(v[2].mid()) for v in found], 0.0, atol=1e-12)
    assert np.any(above != below)
    for v, exact in zip(found, value, strict=True):
        assert v[0].contains(flint.arb(float(exact))) and float(v[0].rad()) < 1e-12
    wide = along.numbers(flint.arb(p, 0.1), 2)
    for v, a, b in zip(wide, *(floats_of(made.with_parameters(**{name: q}), places) for q in (p - 0.09, p + 0.09)), strict=True):
        assert v[0].contains(flint.arb(a)) and v[0].contains(flint.arb(b))
    assert [len(v) for v in along.numbers(flint.arb(p), 1)] == [1] * len(value)


def test_a_range_of_one_value_is_widened_and_polynomials_are_followed():
    _, along, _ = family(0.8, 0.8)
    assert along.low == pytest.approx(0.8 - 0.8e-3) and along.high == pytest.approx(0.8 + 0.8e-3)
    _, wide, _ = family(0.5, 1.5)
    assert (wide.low, wide.high) == (0.5, 1.5)
    balls = along.balls(flint.arb(0.8))
    direct = Model(along.at(0.8), Balls(), along.places)
    keys = tuple(along.system.elements[e].start[0] for e in (0, 1))
    for a, b in zip(balls.mode(keys).B.entries(), direct.mode(keys).B.entries(), strict=True):
        assert a.overlaps(b)
    with pytest.raises(Refused, match="is no number"):
        along.at(float("nan"))


def squared(a: float = 1.0, b: float = 0.25):
    """A mass whose stiffness is a square of one parameter and an absolute value of the other."""
    return bf.System(1.0, 0.1, 1.0 + a * a, [HarmonicForce(abs(b) + 1.0)], omega=1.0)


def test_numbers_that_are_polynomials_have_series_and_others_are_refused():
    made = bf.systems.builder(squared)(a=1.0)
    places = [(0, made.elements[0].start[0])]
    along = Family(made, "a", 0.25, 2.0, places)
    numbers = along.numbers(flint.arb(1.5), 4)
    stiffness = next(v for v in numbers if abs(float(v[0].mid()) - 3.25) < 1e-12)
    assert [float(v.mid()) for v in stiffness] == pytest.approx([3.25, 3.0, 1.0, 0.0], abs=1e-11)
    with pytest.raises(Refused, match="no polynomials of b"):
        Family(made, "b", -1.0, 1.0, places)


def test_whatever_acts_is_understood_or_refused(monkeypatch):
    """An object of another class, and a field that the equations do not read."""
    guard = Guard(affine(1.0), EventKind.IMPACT, ("free",), silent=True)
    understood(guard, Guard, "g")
    with pytest.raises(Refused, match="^m has a Guard, which no proof is made for"):
        understood(guard, Mode, "m")
    monkeypatch.setitem(KNOWN, Guard, KNOWN[Guard] - {"silent"})
    with pytest.raises(Refused, match="^g has silent = True, which no proof takes account of"):
        understood(guard, Guard, "g")
    understood(Guard(affine(1.0), EventKind.IMPACT, ("free",)), Guard, "g")
    stop = bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.0), RigidStop(1.0, 0.5)], omega=1.0)
    monkeypatch.setitem(KNOWN, Guard, KNOWN[Guard] - {"accumulates"})  # it is asked of all that a system is made of
    with pytest.raises(Refused, match="accumulates"):
        Model(stop, Rationals(), [(1, key) for key in stop.elements[1].start])


def test_harmonics_of_several_loads_are_in_order():
    loads = [HarmonicForce(0.5, harmonic=3), HarmonicForce(0.25, harmonic=1), HarmonicForce(1.5, harmonic=12)]
    made = bf.System(1.0, 0.3, 2.0, loads, omega=OMEGA)
    found = Model(made, Rationals(), [(e, item.start[0]) for e, item in enumerate(made.elements)])
    assert found.harmonics == (1, 3, 12) and found.nx == 9
    B = floats(rows_of(found.mode(tuple(item.start[0] for item in made.elements)).B))
    np.testing.assert_allclose(B[1] * OMEGA, [-2.0, -0.3, 0.0, 0.25, 0.0, 0.5, 0.0, 1.5, 0.0], atol=1e-15)
    turning = np.zeros((7, 7))
    for i, k in enumerate((1, 3, 12)):
        turning[1 + 2 * i, 2 + 2 * i], turning[2 + 2 * i, 1 + 2 * i] = -k, k
    np.testing.assert_array_equal(B[2:, 2:], turning)


def test_a_short_range_is_widened_too():
    _, along, _ = family(0.8, 0.8 + 1e-4)
    assert along.low == pytest.approx(0.8 - 0.8e-3, rel=1e-6) and along.high == pytest.approx(0.8 + 0.9e-3, rel=1e-6)
