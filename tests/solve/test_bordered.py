"""Bordered systems against numpy."""
import numpy as np
import pytest

from bifurc.solve.bordered import (
    LARGE,
    Factors,
    across,
    factor,
    few,
    kernel,
    least_ratio,
    least_solution,
    null_vectors,
    solve_factored,
)


@pytest.mark.parametrize("n", [1, 2, 3, 7, 20])
def test_factor_gives_solution_and_determinant(n):
    rng = np.random.default_rng(n)
    for _ in range(10):
        a, b = rng.normal(size=(n, n)), rng.normal(size=n)
        lu, pivots, sign, log = factor(a)
        expected = np.linalg.slogdet(a)
        assert sign == expected[0] and log == pytest.approx(expected[1], abs=1e-12)
        assert a @ solve_factored(lu, pivots, b) == pytest.approx(b, abs=1e-9)


def test_singular_and_not_finite_have_no_sign():
    assert factor(np.zeros((2, 2)))[2:] == (0.0, -np.inf)
    assert factor(np.full((2, 2), np.nan))[2:] == (0.0, -np.inf)
    assert factor(np.array([[1.0, 2.0], [2.0, 4.0]]))[2] == 0.0


@pytest.mark.parametrize("n", [1, 2, 7, 60])
def test_a_vector_across_all_rows(n):
    """It is the null vector of a matrix of full rank, and one of several where ranks are lost."""
    rng = np.random.default_rng(n)
    for _ in range(4):
        wide = rng.normal(size=(n, n + 1))
        found, sign = across(wide)
        assert abs(found @ np.linalg.svd(wide)[2][-1]) == pytest.approx(1.0, abs=1e-12)
        assert sign == np.linalg.slogdet(np.vstack([wide, found]))[0]
    assert across(np.eye(n, n + 1))[1] == 1.0 and across(np.zeros((n, n + 1)))[1] == 0.0
    wide[-1] = wide[0]
    found, _ = across(wide)
    assert np.linalg.norm(found) == pytest.approx(1.0, abs=1e-14) and wide @ found == pytest.approx(0.0, abs=1e-13)


@pytest.mark.parametrize("n", [5, 60])
@pytest.mark.parametrize("lost", [0, 1, 2])
def test_null_vectors(lost, n):
    rng = np.random.default_rng(lost)
    wide = rng.normal(size=(n, n + 1))
    wide[:lost] = 0.0
    right, left = null_vectors(wide)
    assert len(right) == 1 + lost and len(left) == lost
    assert np.abs(wide @ right.T).max() < 1e-14
    assert lost == 0 or np.abs(left @ wide).max() < 1e-14
    assert right @ right.T == pytest.approx(np.eye(1 + lost), abs=1e-14)


@pytest.mark.parametrize("n", [8, 40])
@pytest.mark.parametrize("least", [1e-4, 1e-8, 1.1e-10, 0.9e-10, 1e-13])
def test_ranks_are_those_of_given_singular_values(n, least):
    rng = np.random.default_rng(n)
    u, v = np.linalg.qr(rng.normal(size=(n, n)))[0], np.linalg.qr(rng.normal(size=(n + 1, n + 1)))[0]
    wide = u @ np.diag([*np.linspace(1.0, 0.1, n - 1), least]) @ v[:n]
    right, left = null_vectors(wide)
    assert len(right) == 1 + len(left) == (1 if least > 1e-10 else 2)
    assert abs(right @ v[n]).max() == pytest.approx(1.0, abs=1e-6)
    assert np.abs(right @ v[:n - 1].T).max() < 1e-12


def test_sign_changes_with_the_last_row():
    """det [J; r] = (r.t) det [J; t] for the unit null vector t: the rule by which the tracer orients determinants."""
    rng = np.random.default_rng(0)
    wide, row = rng.normal(size=(4, 5)), rng.normal(size=5)
    (t,), _ = null_vectors(wide)
    value = np.linalg.det(np.vstack([wide, row]))
    assert value == pytest.approx((row @ t) * np.linalg.det(np.vstack([wide, t])), rel=1e-12)


@pytest.mark.parametrize("n", [4, LARGE, LARGE + 31])
def test_solutions_leave_along_the_kernel(n):
    """By reflections where the matrix is large; where another rank is all but lost, its vector comes before the null vector."""
    rng = np.random.default_rng(n)
    left, right = (np.linalg.qr(rng.standard_normal((k, k)))[0] for k in (n, n + 1))
    for least, count in ((1e-3, 1), (3e-5, 1), (1e-7, 2), (0.0, 2)):
        sizes = np.append(np.geomspace(3.0, 1.0, n - 1), least)
        rows = kernel((left * sizes) @ right[:n], 1e-5)
        assert len(rows) == count
        assert np.linalg.norm(right[n - count + 1:] @ rows[-1]) == pytest.approx(1.0, abs=1e-12)
        assert np.abs(rows @ rows.T - np.eye(count)).max() < 1e-12
        if least > 0.0:
            assert abs(rows[-1] @ right[n]) == pytest.approx(1.0, abs=1e-12)
    r = np.triu(rng.standard_normal((n, n))) + 9.0 * np.eye(n)
    sizes = np.linalg.svd(r, compute_uv=False)
    assert least_ratio(r) == pytest.approx(sizes[-1] / sizes[-2], rel=0.2)


@pytest.mark.parametrize("n", [4, LARGE + 31])
@pytest.mark.parametrize("lost", [0, 1, 2])
def test_the_least_solution_has_no_part_along_the_kernel(n, lost):
    """Made from its parts along the singular vectors; what is lost of the rank has part neither in it nor in what it leaves."""
    rng = np.random.default_rng(n + lost)
    left, right = (np.linalg.qr(rng.standard_normal((k, k)))[0] for k in (n, n + 1))
    sizes, parts = np.geomspace(3.0, 1e-3, n), rng.standard_normal(n)
    sizes[n - lost:] = 0.0
    x = least_solution((left * sizes) @ right[:n], left @ parts)
    expected = np.divide(parts, sizes, out=np.zeros(n), where=sizes > 0.0)
    assert right @ x == pytest.approx(np.append(expected, 0.0), abs=1e-9)


def chain_of(n, rng, lost=1.0):
    """Return a wide matrix (n, n + 1) with few entries, as of a long sequence of events: each row knows neighbours round a circle,
    and the parameter.  With ``lost`` the difference of its last two rows is that part of a row."""
    wide = np.zeros((n, n + 1))
    for i in range(n):
        wide[i, (i + np.arange(-2, 3)) % n] = rng.standard_normal(5)
    wide[:, -1] = rng.standard_normal(n)
    if lost < 1.0:
        wide[-1] = wide[-2] + lost * wide[-1]
    return wide


@pytest.mark.parametrize("n", [LARGE, LARGE + 133])
def test_a_large_matrix_with_few_entries_has_the_same_factors(n, rng):
    matrix = np.vstack([chain_of(n, rng), rng.standard_normal(n + 1)])
    made, inverse, right = Factors(matrix), np.linalg.inv(matrix), rng.standard_normal((n + 1, 2))
    assert few(matrix) and not few(matrix[:20, :20])
    np.testing.assert_allclose(made.solve(right), inverse @ right, atol=1e-9 * np.abs(inverse).max())
    np.testing.assert_allclose(made.solve(right[:, 0], True), inverse.T @ right[:, 0], atol=1e-9 * np.abs(inverse).max())
    sizes = rng.uniform(0.0, 1.0, n + 1)
    exact = (np.abs(inverse) @ sizes).max()
    assert 0.3 * exact <= made.largest(sizes) <= (1.0 + 1e-9) * exact
    small = Factors(matrix[:4, :4])
    assert small.largest(sizes[:4]) == pytest.approx((np.abs(np.linalg.inv(matrix[:4, :4])) @ sizes[:4]).max(), rel=1e-9)
    matrix[3] = 0.0
    with pytest.raises(np.linalg.LinAlgError):
        Factors(matrix)


@pytest.mark.parametrize("n", [LARGE, LARGE + 133])
@pytest.mark.parametrize("lost", [1.0, 1e-3, 1e-9, 0.0])
def test_of_a_large_matrix_with_few_entries_the_kernel_is_that_of_singular_values(n, lost, rng):
    wide = chain_of(n, rng, lost)
    _, sizes, rows = np.linalg.svd(wide)
    found = kernel(wide, 1e-5)
    assert few(wide) and len(found) == (1 if sizes[-1] > 1e-5 * sizes[-2] else 2)
    assert np.linalg.norm(rows[-len(found):] @ found[-1]) == pytest.approx(1.0, abs=1e-12)
    right = wide @ rng.standard_normal(n + 1)
    x = least_solution(wide, right)
    assert wide @ x == pytest.approx(right, abs=1e-9 * np.abs(right).max())
    if lost > 1e-6:
        assert x == pytest.approx(np.linalg.lstsq(wide, right, rcond=1e-13)[0], abs=1e-8 * np.abs(x).max())
        assert abs(x @ found[-1]) < 1e-9 * np.linalg.norm(x)
