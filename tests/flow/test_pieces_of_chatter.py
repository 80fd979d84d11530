"""Parts of complete chattering: impacts that turn a friction written out event by event, and what is left behind as differences."""
import itertools
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.flow import chatter
from bifurc.flow.chatter import SPENT, TURNS, WAY
from tests.reference.plain import plain


def bounced(r, kick, push, slopes, u):
    """Follow impacts from the speed 1 event by event; return time, time with the friction of side 1, and the sliding speed."""
    height, speed, t, other = 0.0, 1.0, 0.0, 0.0
    while True:
        u += (1.0 + r) * kick * speed
        speed, height = -r * speed, 0.0
        if speed > -1e-11:
            return t, other, u
        while True:
            side = 0 if u > 0.0 else 1
            a = 0.5 * push[side]
            lands = (-speed + np.sqrt(speed**2 - 4.0 * a * height)) / (2.0 * a)  # height + speed t + a t^2 = 0, the later one
            turns = -u / slopes[side] if -u / slopes[side] > 1e-15 else np.inf
            h = min(lands, turns)
            height, speed, u = height + speed * h + a * h * h, speed + 2.0 * a * h, u + slopes[side] * h
            t, other = t + h, other + side * h
            if h == lands:
                break
            u = 1e-30 * np.sign(slopes[side])


SLIDES = [(0.5, -0.3, (2.0, 1.2), (0.4, 0.7), 0.5), (0.5, 0.3, (2.0, 1.2), (-0.4, -0.7), -0.5),
          (0.7, -0.6, (1.0, 1.6), (0.5, 0.8), 0.9), (0.4, -0.2, (3.0, 2.0), (0.2, 0.1), 5.0),
          (0.4, -0.2, (3.0, 2.0), (-0.2, -0.1), -5.0),
          (0.6, 0.8, (1.5, 0.9), (-1.1, -0.6), 0.2), (0.5, -0.05, (2.0, 1.5), (-0.4, -0.7), 1.0)]


@pytest.mark.parametrize("r, kick, push, slopes, u", SLIDES)
def test_impacts_that_turn_a_friction_are_those_written_out(r, kick, push, slopes, u):
    """Times to the last digit but those of the last flights; at rest the speed changes by its own slopes to the same end."""
    push, slopes, spent = np.array(push), np.array(slopes), np.full(2, np.nan)
    rests = slopes + kick * push
    if rests[0] * rests[1] <= 0.0:
        rests = np.array([0.3, 0.5])
    total, other, last = bounced(r, kick, push, slopes, u)
    assert plain(chatter.back_and_forth)(r, kick, push, slopes, rests, u, -1, spent)
    side = 0 if last > 0.0 else 1
    ago, way = total, last  # back from the end at rest, where the other friction acted before the speed was zero
    before = 0.0
    back = way / rests[side]
    if 0.0 < back < total:
        ago, before = back, total - back
    assert spent[1] == pytest.approx(total, abs=1e-9)
    assert spent[0] == pytest.approx(other - (ago if side == 1 else before), abs=1e-9)
    turned = spent[0]
    for stays in (0, 1):  # the mode of rest is known: where it is that of the end nothing turns in it
        assert plain(chatter.back_and_forth)(r, kick, push, slopes, rests, u, stays, spent)
        assert spent == pytest.approx([other - side * total if stays == side else turned, total], abs=1e-9)


@pytest.mark.parametrize("push, slopes, rests, u", [
    ((0.0, 1.0), (0.4, 1.7), (9.0, 9.0), 5.0), ((1.0, 0.0), (0.4, 1.7), (9.0, 9.0), -5.0),  # no push on the side where it begins
    ((1.0, 0.0), (0.4, 1.7), (9.0, 9.0), 0.4), ((0.0, 1.0), (0.4, 1.7), (9.0, 9.0), -0.1),  # nor where an impact or a turn leads
    ((1.0, 1.0), (-0.4, 1.7), (9.0, 9.0), 0.4), ((1.0, 1.0), (0.0, 1.7), (9.0, 9.0), 0.4),  # it sticks where it turns
    ((1.0, 1.0), (0.4, 1.7), (9.0, -0.2), 0.4), ((1.0, 1.0), (0.4, 1.7), (9.0, 0.0), 0.4)])  # it sticks at rest
def test_frictions_that_stick_are_not_known(push, slopes, rests, u):
    def known(push, slopes, rests):
        return plain(chatter.back_and_forth)(0.5, -0.6, *map(np.array, (push, slopes, rests)), u, -1, np.empty(2))

    assert known((1.0, 1.0), (0.4, 1.7), (9.0, 9.0)) and not known(push, slopes, rests)


def tables(rng, n=2, ns=5, nx=8):
    T = SimpleNamespace(A=rng.normal(size=(3, ns, nx)), B=rng.normal(size=(3, 2, ns)), D=rng.normal(size=(3, 2, n)),
                        G=rng.normal(size=(3, 2, nx)), GT=rng.normal(size=(3, 2, nx, 4)), H=np.zeros((3, 2, ns)),
                        LP=np.zeros((3, 0, n)), n_holds=np.array([0, 1, 0]),
                        ends_in=np.full((3, 2), -1), ratio=np.full((3, 2), 0.5))
    return T


def differences(function, x, h=1e-6):
    return np.array([(function(x + e) - function(x - e)) / (2.0 * h) for e in h * np.eye(x.size)]).T


@pytest.mark.parametrize("holds", [False, True])
def test_a_held_friction_that_slips_in_impacts_leaves_a_way_and_sticks_again(holds, rng):
    """Linear in the speed of impact by the direction at rest, square in it by the way; the derivative is that of differences."""
    T, x, way, change = tables(rng), rng.normal(size=8), 0.37, rng.normal(size=5)
    if holds:
        T.H[1, 0, 2] = 1.0

    def sequence(T_, m, g, x_, v, out, found):
        assert v == pytest.approx(T.GT[1, 1, :, 1] @ x_)
        found[WAY] = way

    def slipped(T_, m, g, out, into):
        into[:] = change

    def left(z):
        xp = np.zeros(8)
        plain(chatter.stilled, sequence=sequence, slipped=slipped)(T, 1, 1, z, xp, np.zeros((5, 8)))
        return xp[:5]

    v, rest = T.GT[1, 1, :, 1] @ x, T.B[1, 1].copy()
    if holds:
        rest[2:4] = T.D[1, 1]
    assert left(x) == pytest.approx((T.B[1, 1] - rest) * v + way * v * v * change, abs=1e-13)
    P = np.ones((5, 8))
    plain(chatter.stilled, sequence=sequence, slipped=slipped)(T, 1, 1, x, np.zeros(8), P)
    assert P - 1.0 == pytest.approx(differences(left, x), abs=1e-7)


def test_a_friction_that_turned_leaves_a_change_of_its_time(rng):
    """A time v f(u/v), f known: the state moves by it, and the derivative is that of differences."""
    T, change = tables(rng), rng.normal(size=5)
    x = rng.normal(size=8)
    x *= np.sign(T.GT[1, 1, :, 1] @ x)

    def ratio(z):
        return -(T.G[1, 0] @ z) / (T.GT[1, 1, :, 1] @ z)

    def sequence(T_, m, g, z, v, out, found):
        found[SPENT], found[TURNS] = v * np.sin(ratio(z)), 0

    def reversals(T_, m, g, k, near, v, out, after, spent):
        assert (m, g, k) == (1, 1, 0)
        spent[0] = np.sin(-(T.G[1, 0] @ near) / v)
        return known

    def against(T_, m, g, k, out, into):
        into[:] = change

    turned = plain(chatter.turned_back, sequence=sequence, reversals=reversals, against=against)

    def left(z):
        xp = np.zeros(8)
        turned(T, 1, 1, -1, z, xp, np.zeros((5, 8)))
        return xp[:5]

    known = True
    v = T.GT[1, 1, :, 1] @ x
    assert left(x) == pytest.approx(v * np.sin(ratio(x)) * change, rel=1e-12)
    P = np.zeros((5, 8))
    turned(T, 1, 1, -1, x, np.zeros(8), P)
    assert P == pytest.approx(differences(left, x), abs=1e-6)
    assert not left(-x).any()  # it leaves the stop
    known = False
    assert not left(x).any()


def test_the_mode_in_which_a_friction_is_against_what_it_was():
    """Of the modes behind a guard the first that differs, with as many holds and guards, that guard turned and the same stop."""
    T = SimpleNamespace(then=np.full((6, 2, 5), -1), n_holds=np.array([1, 1, 1, 1, 2, 1]), n_guards=np.array([2, 2, 2, 2, 2, 3]),
                        G=np.tile([[[0.0, 1.0], [1.0, 0.0]]], (6, 1, 1)),
                        element=np.tile([4, 9], (6, 1)), kick=np.ones((6, 2), int))
    T.G[[2, 3, 4, 5], 0, 1] = -1.0
    mode = plain(chatter.reversed_mode)

    def found(*behind):
        T.then[0, 0] = [*behind, *[-1] * (5 - len(behind))]
        return mode(T, 0, 0, 1, 0)

    assert found() == -1 and found(2) == 2 and found(-1, 3) == 3 and found(3, 2) == 3
    assert found(0, 1) == -1  # itself, and the same way
    assert found(4, 5) == -1 and found(4, 5, 2) == 2  # another number of holds or guards
    T.G[2, 0] = [5.0, 0.0]
    assert found(2) == -1  # across is not against
    T.G[2, 0] = [5.0, -0.1]
    T.element[2, 1] = 4
    assert found(2) == -1
    T.element[2, 1], T.kick[2, 1] = 9, 0
    assert found(2) == -1
    T.kick[2, 1], T.element[2, 0] = 1, 77
    assert found(2) == 2  # of other guards nothing is asked
    T.n_holds[0] = 1
    T.G[0, 0, 1] = -1.0  # the mode before the guard is another one than that of the motion
    T.then[1, 0] = [0, 2, 3, -1, -1]
    assert mode(T, 1, 0, 1, 0) == -1


def test_a_stop_in_another_mode_is_that_of_its_element_with_an_impact_and_the_same_rows():
    T = SimpleNamespace(n_guards=np.array([1, 3]), element=np.array([[7, 0, 0], [7, 7, 7]]), kick=np.array([[1, 0, 0], [0, 1, 1]]),
                        G=np.array([[[1.0, 2.0]] * 3, [[1.0, 2.0], [2.0, 1.0], [-2.0, -4.0]]]))
    stop = plain(chatter.stop_of)
    assert stop(T, 0, 0, 1) == 2 and stop(T, 0, 0, 0) == 0
    T.element[1, 2] = 6
    assert stop(T, 0, 0, 1) == -1
    T.element[1, 2], T.n_guards[1] = 7, 2
    assert stop(T, 0, 0, 1) == -1
    T.n_guards[1], T.kick[1, 2] = 3, 2
    assert stop(T, 0, 0, 1) == -1


def test_parallel_rows_are_multiples():
    for a, b in itertools.product((np.array([2.0, -4.0, 1.0]), np.array([1e-9, 3e-9, 0.0])), repeat=2):
        assert plain(chatter.multiple)(3.0 * a, b) == pytest.approx(3.0 if a is b else 0.0)
