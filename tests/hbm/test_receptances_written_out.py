"""Receptances of a linear part against inverses written out, with every derivative there is and each of them alone."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.hbm.condensation.receptance import BLOCKS, FACTORS, MODES, POLES, Changed, LinearPart, packed, phasors
from bifurc.hbm.layout import Layout

HARMONICS = (0, 1, 2, 5)


def numbers(rng, damping, n=4):
    """Matrices in which no two entries are equal, load and frequency."""
    X, Y = rng.normal(size=(2, n, n))
    M, K = np.eye(n) + 0.2 * X @ X.T, 2.0 * np.eye(n) + Y @ Y.T
    C = {"modal": 0.02 * M + 0.05 * K, "local": 0.3 * np.diag(np.arange(n) + 1.0),
         "full": 0.2 * rng.normal(size=(n, n)) + np.eye(n)}[damping]
    return SimpleNamespace(M=M, C=C, K=K, omega=np.array([0.83]), E=rng.normal(size=(7, n)))


def change(rng, T, frequency, load, core):
    """Derivatives of the numbers; each kind of them may be absent."""
    parts = {name: rng.normal(size=(4, 4)) * core for name in "MCK"}
    return SimpleNamespace(omega=np.array([0.7 * frequency]), E=rng.normal(size=T.E.shape) * load, **parts)


def written(T, dT, layout, rows, outputs, shift, moved):
    """Z^-1 and its derivative -Z^-1 dZ Z^-1 of every harmonic, by numpy."""
    found = [[], [], [], []]
    for i, k in enumerate(layout.harmonics):
        w, dw = k * T.omega[0], k * dT.omega[0]
        Z = T.K - w**2 * T.M + 1j * w * T.C + shift[i] * rows.T @ rows
        dZ = dw * (1j * T.C - 2.0 * w * T.M) + moved * (dT.K - w**2 * dT.M + 1j * w * dT.C)
        slot = [0] if k == 0 else [2 * i - 1, 2 * i]
        e, de = ((X[slot[0]] - 1j * X[slot[1]] if k else X[0] + 0j) for X in (T.E, dT.E))
        inverse = np.linalg.inv(Z)
        d = -inverse @ dZ @ inverse
        for place, value in zip(found, (inverse @ rows.T, inverse @ e, d @ rows.T, d @ e + inverse @ de), strict=True):
            place.append(outputs @ value)
    return [np.array(value) for value in found]


@pytest.mark.parametrize("what", [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1), (1, 1, 1)])
@pytest.mark.parametrize(("damping", "sweep", "way"), [("modal", False, MODES), ("local", True, POLES), ("local", False, FACTORS),
                                                       ("full", True, POLES), ("full", False, FACTORS)])
def test_responses_and_their_derivatives(damping, sweep, way, what, rng):
    """Of frequency, load and core, whichever changes: with one of them still its part is zero and the others stay."""
    layout, rows = Layout(HARMONICS, 4), rng.normal(size=(2, 4))
    outputs = np.concatenate([rows, rng.normal(size=(1, 4))])
    T = numbers(rng, damping)
    dT, moved = change(rng, T, *what), bool(what[2])
    linear = LinearPart(T, layout, rows, outputs, sweep)
    assert linear.way == way
    found = linear.receptance(T, dT, moved)
    assert found.regular and not found.shift.any()
    for own, true in zip(found[:4], written(T, dT, layout, rows, outputs, np.zeros(4), moved), strict=True):
        np.testing.assert_allclose(own, true, atol=1e-11 * max(1.0, np.abs(true).max()))
    again = linear.receptance(T, dT, moved)
    assert all(np.array_equal(a, b) for a, b in zip(found[:4], again[:4], strict=True))
    other = change(rng, T, *what)  # another direction at the same point: nothing of the last one is kept
    for own, true in zip(linear.receptance(T, other, moved)[:4], written(T, other, layout, rows, outputs, np.zeros(4), moved),
                         strict=True):
        np.testing.assert_allclose(own, true, atol=1e-11 * max(1.0, np.abs(true).max()))


@pytest.mark.parametrize("negative", [False, True])
@pytest.mark.parametrize("places", [(1,), (2, 0)])
@pytest.mark.parametrize("damping", ["modal", "local"])
def test_a_core_that_moved_in_few_coordinates(damping, places, negative, rng):
    """From the core as it was: also where the mean's stiffness changes its sign."""
    layout, rows, outputs = Layout(HARMONICS, 4), np.eye(4)[[0, 3]], np.eye(4)[[0, 3, 1]]
    T, place, places = numbers(rng, damping), np.ix_(sorted(places), sorted(places)), np.sort(places)
    linear = LinearPart(T, layout, rows, outputs, True, changed=Changed(places, ()))
    there, dT = SimpleNamespace(**{name: value.copy() for name, value in vars(T).items()}), change(rng, T, 1, 1, 1)
    for name in "MCK":
        getattr(there, name)[place] += 0.3 * rng.normal(size=(len(places),) * 2)
        still = np.ones((4, 4), bool)
        still[place] = False
        getattr(dT, name)[still] = 0.0
    if negative:
        there.K[places[0], places[0]] -= 40.0  # one of its eigenvalues
    there.omega = np.array([1.1])
    assert np.linalg.det(there.K) < 0.0 if negative else np.linalg.det(there.K) > 0.0
    found = linear.receptance(there, dT, True)
    for own, true in zip(found[:4], written(there, dT, layout, rows, outputs, np.zeros(4), True), strict=True):
        np.testing.assert_allclose(own, true, atol=1e-10 * np.abs(true).max())
    assert found.sign == (-1.0 if negative else 1.0) and not found.shift.any()
    direct = linear._direct(there, dT, range(4), True)
    assert direct.sign == found.sign


def test_a_core_that_moved_and_kept_its_modes(rng):
    """All of the stiffness and of the damping, through zero: the sign is that of the number of negative stiffnesses."""
    layout, rows = Layout(HARMONICS, 3), np.eye(3)[:1]
    T, signs = numbers(rng, "modal", 3), []
    T.C, dT = 0.3 * T.M, SimpleNamespace(M=0 * T.M, C=0 * T.M, K=T.M, omega=np.array([0.4]), E=rng.normal(size=T.E.shape))
    linear = LinearPart(T, layout, rows, np.eye(3), changed=Changed(np.arange(3), tuple(map(np.array, ([T.M], [T.C], [T.K, T.M])))))
    stiffness = np.sort(np.linalg.eigvals(np.linalg.solve(T.M, T.K)).real)
    for amount in (0.0, -0.5 * stiffness[:2].sum(), -0.5 * stiffness[1:].sum(), -2.0 * stiffness[2]):
        there = SimpleNamespace(**vars(T) | {"K": T.K + amount * T.M})
        found = linear.receptance(there, dT, True)
        for own, true in zip(found[:4], written(there, dT, layout, rows, np.eye(3), np.zeros(4), True), strict=True):
            np.testing.assert_allclose(own, true, atol=1e-10 * np.abs(true).max())
        signs.append(found.sign)
        load = rng.normal(size=(4, 3)) + 0.5j
        found = linear.motion(there, load, np.zeros(4), True)
        for k, Z in enumerate(linear.stiffnesses(there, True)):
            np.testing.assert_allclose(Z @ found[k], load[k], atol=1e-10)
    assert signs == [1.0, -1.0, 1.0, -1.0]


@pytest.mark.parametrize("below", [1.0, 0.4])
def test_a_harmonic_on_an_undamped_resonance_is_held_by_a_spring_along_the_rows(below, rng):
    """The equations are the same: what the spring adds is taken from the forces.  Also with a stiffness that is not symmetric."""
    layout, rows = Layout(HARMONICS, 3), np.array([[1.0, 0.4, -0.3]])
    M, K = np.diag([1.0, 2.0, 1.5]), np.array([[3.0, -1.0, 0.0], [-below, 4.0, -2.0], [0.0, -2.0 * below, 6.0]])
    own = np.sqrt(np.linalg.eigvals(np.linalg.solve(M, K)).real.max())
    T = SimpleNamespace(M=M, C=np.zeros((3, 3)), K=K, omega=np.array([own / 2.0]), E=rng.normal(size=(7, 3)))
    dT = SimpleNamespace(M=0 * M, C=0 * M, K=0 * M, omega=np.array([1.0]), E=rng.normal(size=(7, 3)))
    for sweep in (False, True):
        linear = LinearPart(T, layout, rows, rows, sweep)
        found = linear.receptance(T, dT, False)
        assert np.flatnonzero(found.shift).tolist() == [2] and found.regular
        for mine, true in zip(found[:4], written(T, dT, layout, rows, rows, found.shift, False), strict=True):
            np.testing.assert_allclose(mine, true, atol=1e-10 * np.abs(true).max())
        load = rng.normal(size=(4, 3)) + 1j * rng.normal(size=(4, 3))
        for transposed in (False, True):
            q = linear.motion(T, load, found.shift, False, transposed)
            for k, Z in enumerate(linear.stiffnesses(T, False)):
                held = Z + found.shift[k] * rows.T @ rows
                np.testing.assert_allclose((held.T if transposed else held) @ q[k], load[k], atol=1e-10)


@pytest.mark.parametrize("moved", [False, True])
def test_the_change_of_a_stiffness_acting_on_a_motion(moved, rng):
    layout = Layout(HARMONICS, 4)
    T = numbers(rng, "full")
    dT, q, h = change(rng, T, 1, 0, 1), rng.normal(size=(4, 4)) + 1j * rng.normal(size=(4, 4)), 1e-6
    linear = LinearPart(T, layout, np.eye(4)[:1], np.eye(4)[:1])
    Z = []
    for way in (1.0, -1.0):
        near = {name: getattr(T, name) + way * h * getattr(dT, name) * moved for name in "MCK"}
        Z.append(list(linear.stiffnesses(SimpleNamespace(omega=T.omega + way * h * dT.omega, **near), moved)))
    expected = [((up - down) / (2.0 * h)) @ x for up, down, x in zip(*Z, q, strict=True)]
    np.testing.assert_allclose(linear.derived(T, dT, q, moved), expected, atol=1e-7 * np.abs(expected).max())
    assert packed(layout, phasors(layout, T.E)) == pytest.approx(T.E, abs=0.0)
    odd = Layout((1, 3), 4)
    assert np.array_equal(phasors(odd, T.E[:4]), [T.E[0] - 1j * T.E[1], T.E[2] - 1j * T.E[3]])
    assert packed(odd, phasors(odd, T.E[:4])) == pytest.approx(T.E[:4], abs=0.0)


def test_the_determinant_of_nearly_undamped_modes(rng):
    """It is that of the dynamic stiffness, over the sizes of its factors; a heavy dashpot leaves none."""
    layout, T = Layout(HARMONICS, 4), numbers(rng, "modal")
    T.C = np.zeros((4, 4))
    linear = LinearPart(T, layout, np.eye(4)[:1], np.eye(4)[:1])
    stiffness = np.linalg.eigvals(np.linalg.solve(T.M, T.K)).real
    for omega in (0.4, 0.9, 3.0):
        T.omega = np.array([omega])
        true = 0.0
        for k in HARMONICS[1:]:
            w = k * omega
            sizes = np.prod(stiffness + w**2) * np.linalg.det(T.M)
            true += 2.0 * np.log(abs(np.linalg.det(T.K - w**2 * T.M)) / sizes)  # of cosine and sine
        assert linear.log_determinant(T, False) == pytest.approx(true, rel=1e-10)
    assert linear.log_determinant(T, True) == 0.0
    T.C = 0.5 * T.M
    assert LinearPart(T, layout, np.eye(4)[:1], np.eye(4)[:1]).log_determinant(T, False) == 0.0


def test_poles_that_lie_together_stay_together(rng):
    """Critical damping of three modes, two of them equal and coupled one way; the fourth swings."""
    layout, n = Layout(HARMONICS, 4), 4
    Q = np.linalg.qr(rng.normal(size=(n, n)))[0]
    K = np.diag([1.0, 4.0, 4.0, 9.0]) + np.diag([0.0, 0.5, 0.0], 1)
    T = SimpleNamespace(M=np.eye(n), C=Q @ np.diag([2.0, 4.0, 4.0, 1.0]) @ Q.T, K=Q @ K @ Q.T, omega=np.array([0.6]),
                        E=rng.normal(size=(7, n)))
    dT = change(rng, T, 1, 1, 0)
    rows, outputs = np.eye(n)[:2], np.concatenate([np.eye(n)[:2], rng.normal(size=(1, n))])
    linear = LinearPart(T, layout, rows, outputs, True)
    assert linear.way == BLOCKS
    found = linear.receptance(T, dT, False)
    for own, true in zip(found[:4], written(T, dT, layout, rows, outputs, np.zeros(4), False), strict=True):
        np.testing.assert_allclose(own, true, atol=1e-11 * np.abs(true).max())
    load = rng.normal(size=(4, n)) + 1j * rng.normal(size=(4, n))
    for transposed in (False, True):
        q = linear.motion(T, load, np.zeros(4), False, transposed)
        for k, Z in enumerate(linear.stiffnesses(T, False)):
            np.testing.assert_allclose((Z.T if transposed else Z) @ q[k], load[k], atol=1e-10)
