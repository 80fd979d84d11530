"""What a step does at its nodes, against polynomials with known integrals and against linear maps, column by column."""
from fractions import Fraction

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from bifurc.flow.laws import collocation, gauss, nodes
from tests.reference.plain import plain

C = 0.5 * (np.polynomial.legendre.leggauss(8)[0] + 1.0)
POLYNOMIALS = [Polynomial([0.3, -1.1, 0.7, 2.0, -0.4, 0.9, -1.3, 0.6]), Polynomial([-0.8, 0.5, 1.4, -0.2, 1.7, -0.6, 0.1, 1.9])]


def accelerations():
    """Return those of two coordinates at the nodes, as polynomials of the part of the step."""
    return np.array([p(C) for p in POLYNOMIALS])


def moved(k, x, part, h, n=2):
    """Return position and velocity of coordinate ``k`` after a part of the step, integrated by coefficients."""
    once = POLYNOMIALS[k].integ()
    return x[k] + part * h * x[n + k] + h * h * once.integ()(part), x[n + k] + h * once(part)


def test_basis_polynomials_are_one_at_their_own_point_alone():
    points = [Fraction(0), Fraction(1, 3), Fraction(2), Fraction(-1, 2)]
    rows = gauss.lagrange(points)
    values = [[sum(c * p**k for k, c in enumerate(row)) for p in points] for row in rows]
    assert values == [[int(i == j) for j in range(4)] for i in range(4)]
    assert gauss.lagrange([Fraction(1), Fraction(3)]) == [[Fraction(3, 2), Fraction(-1, 2)], [Fraction(-1, 2), Fraction(1, 2)]]
    assert gauss.lagrange([Fraction(5)]) == [[1]] and gauss.lagrange([]) == []


@pytest.mark.parametrize("end", [Fraction(1), Fraction(2), Fraction(1, 2)])
def test_integrals_of_polynomials_once_and_twice(end):
    row = [Fraction(4), Fraction(-2), Fraction(3)]  # 4 - 2 t + 3 t^2
    once, twice = gauss._integrals([row, row[:1]], end, 1), gauss._integrals([row, row[:1]], end, 2)
    t = float(end)
    assert once == pytest.approx([4 * t - t**2 + t**3, 4 * t], rel=1e-15)
    assert twice == pytest.approx([2 * t**2 - t**3 / 3 + t**4 / 4, 2 * t**2], rel=1e-15)


def test_turns_of_the_forcing_are_those_of_its_harmonics():
    turn, harmonics, omega, h = np.full((5, 9), np.nan), np.array([2, 5]), 1.3, 0.4
    plain(nodes.prepare)(harmonics, omega, h, turn)
    whole = np.exp(1j * np.outer(harmonics, [*C, 1.0]) * omega * h)
    assert turn[1::2] == pytest.approx(whole.real, abs=1e-14) and turn[2::2] == pytest.approx(whole.imag, abs=1e-14)


@pytest.mark.parametrize("h", [0.3, -0.7])
def test_positions_and_velocities_at_nodes_and_at_the_end(h):
    a, x = accelerations(), np.array([0.2, -0.5, 1.1, 0.4])
    q, v, end = np.full((2, 8), np.nan), np.full((2, 8), np.nan), x.copy()
    for k in range(2):
        plain(nodes.spread)(x, k, 2, h, a, q, v)
        plain(nodes.finish)(end, k, 2, h, a)
        known = moved(k, x, C, h)
        assert q[k] == pytest.approx(known[0], abs=1e-14) and v[k] == pytest.approx(known[1], abs=1e-14)
        assert [end[k], end[2 + k]] == pytest.approx(moved(k, x, 1.0, h), abs=1e-14)


def test_the_defect_is_the_largest_difference_at_an_end():
    a = accelerations()
    f0 = np.array([0.0, 0.0, POLYNOMIALS[0](0.0), POLYNOMIALS[1](0.0)])
    f1 = np.array([0.6, -0.9, POLYNOMIALS[0](1.0), POLYNOMIALS[1](1.0)])
    defect = plain(nodes.defect)
    assert defect(2, 0.5, f0, f1, 1.0, a) < 1e-13
    for f, place, off, known in ((f0, 2, 0.9, 0.5), (f0, 3, -0.9, 0.5), (f1, 2, 3.6, 2.0), (f1, 3, -3.6, 2.0)):
        was, f[place] = f[place], f[place] + off
        assert defect(2, 0.5, f0, f1, 1.0, a) == pytest.approx(known, rel=1e-12)  # over the speed .9 of a step .5
        assert defect(2, -0.5, f0, f1, 3.6, a) == pytest.approx(abs(off) / 3.6, rel=1e-12)  # a larger force counts
        f[place] = was
    assert defect(2, 0.5, np.zeros(4), np.zeros(4), 0.0, np.zeros((2, 8))) == 0.0


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
def test_a_defect_that_is_no_number_is_told(wrong):
    """Compiled: a comparison with NaN is false there, so that the largest of some numbers does not see it."""
    for place in range(8):
        f0, f1, a = np.zeros(4), np.zeros(4), accelerations()
        (f0 if place < 2 else f1)[2 + place % 2] = wrong if place < 4 else 0.0
        if place > 3:
            a[place % 2, place] = wrong
        assert not np.isfinite(nodes.defect(2, 0.5, f0, f1, 1.0, a))
    f1[0] = 1.0
    assert not np.isfinite(nodes.defect(2, 0.5, f0, f1, 0.0, a))


def test_what_a_higher_frequency_adds(rng):
    v, a, D, load = rng.normal(size=(2, 8)), rng.normal(size=(2, 8)), rng.normal(size=(2, 2, 8)), rng.normal(size=(2, 8))
    known = load + 0.25 * (np.einsum("icj,cj->ij", D, v) - 2.0 * a)
    plain(nodes.quicken)(2, 0.25, (None, v, a, None, None), D, load)
    assert load == pytest.approx(known, rel=1e-13)


def test_forcing_and_memory_at_the_nodes(rng):
    """What does not depend on positions: a constant, memory, two harmonics; rows that look at another row's place have none."""
    ns, nx = 5, 10  # two masses, one memory; 1, cos, sin, cos, sin
    A, LU, LS = rng.normal(size=(2, ns, nx)), rng.normal(size=(3, nx)), rng.normal(size=(3, nx))
    LU[0, 6:8] = LS[2, 8:] = 0.0
    harmonics, theta, step = np.array([1, 3]), 0.8, 0.5
    x = np.concatenate([rng.normal(size=ns), [1.0], *[(np.cos(k * theta), np.sin(k * theta)) for k in harmonics]])
    turn, base, local = np.empty((5, 9)), np.full((2, 8), np.nan), np.full((6, 3, 8), 77.0)
    plain(nodes.prepare)(harmonics, 1.0, step, turn)
    plain(collocation.excite, DOFS=2, ROWS=3, SOURCE=(0, 0, 2))(A, 1, LU, LS, x, turn, base, local)
    at = theta + step * C
    forcing = np.array([np.ones(8), np.cos(at), np.sin(at), np.cos(3 * at), np.sin(3 * at)])
    assert base == pytest.approx(A[1, 2:4, 5:] @ forcing + (A[1, 2:4, 4] * x[4])[:, None], abs=1e-13)
    for k, rows in ((4, LU), (5, LS)):
        for r in (0, 2):
            assert local[k, r] == pytest.approx(rows[r, 5:] @ forcing, abs=1e-13)
    assert (local[:4] == 77.0).all() and (local[4:, 1] == 77.0).all()


def test_accelerations_are_made_linear_column_by_column(rng):
    """Two forces of two and of one row, then a reaction of two rows that feels accelerations without reactions."""
    n, count, first, forces, acting, nodes_ = 2, (2, 1, 2), (0, 2, 2), 2, 3, 2
    A, LU, LS, LP = rng.normal(size=(2, 4, 5)), rng.normal(size=(4, 5)), rng.normal(size=(4, 5)), rng.normal(size=(2, 4, 2))
    LU[:, 2:], LS[:, :2] = 0.0, 0.0  # coordinates look at positions, speeds at velocities
    given = rng.normal(size=(3, 4, 2, nodes_))

    def slopes(law, acts, m, h, nodes, local, slope):
        slope[:, :forces] = given[:, :forces]

    def reaction_slopes(law, acts, m, h, nodes, local, slope):
        slope[:, forces:] = given[:, forces:]

    def acceleration(x, j):
        found = A[1, 2:] @ x
        u, s = LU @ x, LS @ x
        for r in range(forces):
            f = sum(given[0, r, b, j] * u[first[r] + b] + given[1, r, b, j] * s[first[r] + b] for b in range(count[r]))
            found = found + LP[1, r] * f
        free = LU[:, :2] @ found
        for r in range(forces, acting):
            at = range(first[r], first[r] + count[r])
            f = sum(given[0, r, b, j] * u[i] + given[1, r, b, j] * s[i] + given[2, r, b, j] * free[i] for b, i in enumerate(at))
            found = found + LP[1, r] * f
        return found

    K, D = np.full((n, n, nodes_), np.nan), np.full((n, n, nodes_), np.nan)
    plain(collocation.linearise, DOFS=n, ROWS=4, FORCES=forces, ACTING=acting, COUNT=count, FIRST=first, slopes=slopes,
          reaction_slopes=reaction_slopes)(A, 1, LU, LS, LP, None, None, 0.1, None, np.zeros((3, 4, 2, nodes_)), K, D)
    for j in range(nodes_):
        columns = np.array([acceleration(e, j) for e in np.eye(5)]).T
        assert K[:, :, j] == pytest.approx(columns[:, :2], abs=1e-13) and D[:, :, j] == pytest.approx(columns[:, 2:4], abs=1e-13)
    plain(collocation.linearise, DOFS=n, ROWS=0, FORCES=0, ACTING=0)(A, 1, LU, LS, LP, None, None, 0.1, None, None, K, D)
    assert (K == A[1, 2:, :2, None]).all() and (D == A[1, 2:, 2:4, None]).all()


@pytest.mark.parametrize("fresh", [False, True])
def test_an_attempt_moves_everything_to_the_end_of_the_step(fresh):
    """Positions by their polynomials, memory not at all, forcing by angles; the defect is that at the end."""
    h, theta, omega = 0.3, 0.9, 1.7
    now = np.array([0.2, -0.5, 1.1, 0.4, 0.66, 1.0, np.cos(theta), np.sin(theta), np.cos(4 * theta), np.sin(4 * theta)])
    harmonics, turn, calls_ = np.array([1, 4]), np.full((5, 9), np.nan), []
    if fresh:
        plain(nodes.prepare)(harmonics, omega, h, turn)
    room = np.zeros((2, 8)), np.zeros((2, 8)), np.zeros((2, 8)), None, None
    f0, f1 = np.array([1.1, 0.4, POLYNOMIALS[0](0.0), POLYNOMIALS[1](0.0)]), np.zeros(4)

    def solve(motion, m, x, step, f, stiff, angles, local, given):
        calls_.append((m, step, stiff))
        assert x is now and f is f0 and given is room and np.isfinite(angles[1:]).all()
        given[2][:] = accelerations()
        given[0][:] = 0.01
        return done, 5.0

    def rate(A, m, LU, LS, LP, law, acts, x, f, one):
        f[:] = [x[2], x[3], POLYNOMIALS[0](1.0) + 0.4, POLYNOMIALS[1](1.0) - 0.9]

    attempt = plain(collocation.attempt, solve=solve, rate=rate, DOFS=2)
    moved_, motion = np.full(10, np.nan), (np.zeros((3, 5, 10)), None, None, None, None, None)
    done = 0
    assert attempt(motion, 2, (harmonics, omega, 7.0), h, fresh, now, moved_, (f0, f1), turn, None, None, room) == (0, np.inf)
    assert np.isnan(moved_).all()
    done = 6
    count, e = attempt(motion, 2, (harmonics, omega, 7.0), h, fresh, now, moved_, (f0, f1), turn, None, None, room)
    assert count == 6 and calls_ == [(2, h, 7.0)] * 2
    ends = [moved(k, now, 1.0, h) for k in range(2)]
    assert moved_[:4] == pytest.approx([ends[0][0], ends[1][0], ends[0][1], ends[1][1]], abs=1e-14)
    later = theta + omega * h
    assert moved_[4:] == pytest.approx([0.66, 1.0, np.cos(later), np.sin(later), np.cos(4 * later), np.sin(4 * later)], abs=1e-14)
    assert e == pytest.approx(0.9 / max(5.0, *(abs(f1[:2]) / h)), rel=1e-12)
    # a stiff motion: the forces of its springs count, part 1e-5 of them, at the largest place
    _, e = attempt(motion, 2, (harmonics, omega, 1e9), h, fresh, now, moved_, (f0, f1), turn, None, None, room)
    assert e == pytest.approx(0.9 / (1e-5 * 1e9 * 0.01), rel=1e-12)


def test_what_is_infinite_at_the_end_of_a_step_is_a_defect():
    room = tuple(np.zeros((1, 8)) for _ in range(5))
    attempt = plain(collocation.attempt, DOFS=1, solve=lambda *args: (1, 1.0),
                    rate=lambda *args: args[8].fill(np.inf))
    ends = np.array([0.0, 0.0]), np.zeros(2)
    with np.errstate(invalid="ignore"):  # as compiled
        found = attempt((np.zeros((1, 2, 3)), *[None] * 5), 0, (np.zeros(0, int), 0.0, 1.0), 0.1, True, np.array([0.0, 0.0, 1.0]),
                        np.zeros(3), ends, np.zeros((1, 9)), None, None, room)
    assert found[1] == np.inf
