"""Limits and refusals of the checker, the damping helpers and the names, each from both sides; reductions by their equations."""
import types

import numpy as np
import pytest
from scipy.linalg import eigh

import bifurc as bf
from bifurc.structure.checks import Structure, checked, dense, even
from bifurc.structure.damping import modal_damping, rayleigh_damping
from bifurc.structure.names import dof_names, place_of
from bifurc.structure.reduction import Reduction, reduce

K = np.array([[5.0, -1.0, -0.5, 0.2], [-1.0, 4.0, -1.5, 0.3], [-0.5, -1.5, 3.0, -0.7], [0.2, 0.3, -0.7, 2.0]])
M = np.array([[2.0, 0.3, 0.0, 0.1], [0.3, 1.5, 0.2, 0.0], [0.0, 0.2, 1.0, 0.1], [0.1, 0.0, 0.1, 0.8]])


# ---- matrices ------------------------------------------------------------------------------------------------------------------


def test_asymmetry_up_to_a_billionth_of_the_largest_entry_is_rounding():
    fine, wrong = (np.array([[-4.0, 1.0], [1.0 + share * 4.0e-9, 3.0]]) for share in (0.9, 1.1))
    assert np.array_equal(even("K", fine), 0.5 * (fine + fine.T))
    with pytest.raises(ValueError, match=r"K is not symmetric: K\[0, 1\] = 1, K\[1, 0\] = 1"):
        even("K", wrong)
    assert np.array_equal(even("K", np.zeros((2, 2))), np.zeros((2, 2)))


def test_the_largest_asymmetry_is_named_and_what_to_do_with_it():
    matrix = np.array([[1.0, 2.0, 3.0], [2.1, 1.0, -4.0], [3.0, -3.5, 1.0]])
    with pytest.raises(ValueError) as said:
        even("K", matrix)
    assert str(said.value) == ("from_matrices: K is not symmetric: K[1, 2] = -4, K[2, 1] = -3.5; a skew-symmetric part belongs "
                               "into G, a circulatory one needs from_matrices(..., symmetric=False)")
    with pytest.raises(ValueError) as said:
        even("M", matrix)
    assert str(said.value) == "from_matrices: M is not symmetric: M[1, 2] = -4, M[2, 1] = -3.5"
    for triangle, which in ((np.triu(matrix), "upper"), (np.tril(matrix), "lower")):
        with pytest.raises(ValueError, match=f"C is the {which} triangle of a matrix; write C \\+ C.T"):
            even("C", triangle)


def test_a_gyroscopic_matrix_is_skew_but_for_rounding():
    G = np.zeros((4, 4))
    G[0, 1], G[1, 0] = 2.0, -2.0 + 1.9e-9
    assert np.array_equal(checked(M, None, K, G).G, G)
    G[1, 0] = -2.0 + 2.1e-9
    with pytest.raises(ValueError, match="G is not skew-symmetric"):
        checked(M, None, K, G)


@pytest.mark.parametrize("name", ["K", "C", "G"])
def test_every_matrix_has_the_shape_of_the_mass(name):
    given = {"M": M, "C": None, "K": K} | {name: np.eye(3)}
    with pytest.raises(ValueError, match=f"{name} has shape .3, 3.; it must be that of M, .4, 4."):
        checked(**given)


def test_symmetry_is_asked_of_stiffness_and_damping_unless_told_otherwise():
    skew = np.zeros((4, 4))
    skew[0, 3], skew[3, 0] = 0.4, -0.4
    for name in ("K", "C"):
        given = {"M": M, "C": 0.1 * K, "K": K}
        given[name] = given[name] + skew
        with pytest.raises(ValueError, match=f"{name} is not symmetric"):
            checked(**given)
        found = checked(**given, symmetric=False)
        assert np.array_equal(getattr(found, name), given[name]) and np.array_equal(found.M, M)
    found = checked(M, None, K)
    assert not found.C.any() and not found.G.any() and found.C.shape == found.G.shape == (4, 4) and found.n == 4
    with pytest.raises(ValueError, match="M is not symmetric"):
        checked(M + skew, None, K, symmetric=False)


@pytest.mark.parametrize("soft, rigid", [(0.0, 1), (4e-16, 1), (1e-13, 0), (-4e-16, 1), (-1e-3, 0)])
@pytest.mark.parametrize("unit", [1e-12, 1.0, 1e12])
def test_a_rigid_body_has_no_strain_energy_but_rounding_of_its_terms(soft, rigid, unit):
    """Two masses on a spring of 1, one of them held by a soft one: (1, 1) has the energy `soft` and terms that sum to 4."""
    K = np.array([[1.0, -1.0], [-1.0, 1.0 + soft]])
    assert checked(np.eye(2), None, unit * K).rigid_body_modes == rigid
    turned = np.diag([1.0, 1e-7]) @ K @ np.diag([1.0, 1e-7])  # the second coordinate in another unit
    assert checked(np.eye(2), None, unit * turned).rigid_body_modes == rigid


def test_a_soft_spring_of_its_own_is_no_rigid_body():
    assert checked(np.eye(2), None, np.diag([1.0, 1e-20])).rigid_body_modes == 0
    assert checked(np.eye(2), None, np.diag([1.0, 0.0])).rigid_body_modes == 1


def test_stiffness_of_either_sign_is_scaled_by_its_size():
    found = checked(np.eye(2), None, np.diag([2.0, -1.5]))
    assert found.rigid_body_modes == 0 and found.report == "2 degrees of freedom, no rigid-body mode: it is held"
    assert checked(np.eye(2), None, np.diag([1.0, -1.0])).rigid_body_modes == 0


def test_the_report_counts():
    found = checked(np.diag([1.0, 0.0, 2.0]), None, np.zeros((3, 3)), dofs=["a", ("b", "x"), "c"])
    assert found.massless == (1,) and found.rigid_body_modes == 3 and found.dofs == ("a", "b.x", "c")
    assert found.report == "3 degrees of freedom, 3 rigid-body modes, 1 coordinates without mass"
    one = Structure(M, K, K, K, rigid_body_modes=1)
    assert one.report == "4 degrees of freedom, 1 rigid-body mode" and repr(one) == "Structure(massless=(), rigid_body_modes=1)"


@pytest.mark.parametrize("mass, words", [
    (np.diag([0.0, 1.0, -1.0]), "not positive semidefinite .smallest scaled eigenvalue -1, mostly in coordinate 2"),
    ([[0.0, 0.0, 0.0], [0.0, 1.0, 1.0 + 1e-9], [0.0, 1.0 + 1e-9, 1.0]], "not positive semidefinite .*-1e-09"),
    ([[0.0, 0.0, 0.0], [0.0, 1.0, 1.0 + 1e-11], [0.0, 1.0 + 1e-11, 1.0]], "singular in a direction that is no single coordinate"),
    ([[0.0, 0.0, 0.0], [0.0, 1.0, 1.0 - 5e-15], [0.0, 1.0 - 5e-15, 1.0]], r"singular .*\(mostly [12]\)"),
    ([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], "not positive semidefinite"),
    ([[1.0, 0.0, 0.0], [0.0, 4.0, 0.5], [0.0, 0.5, 0.0]], "not positive semidefinite .* mostly in coordinate 2"),
])
def test_masses_that_are_none(mass, words):
    with pytest.raises(ValueError, match=words):
        checked(np.array(mass), None, np.eye(3))


def test_small_masses_are_masses():
    assert checked(np.diag([1.0, 1e-20]), None, np.eye(2)).massless == ()
    near = np.array([[1.0, 1.0 - 1e-12], [1.0 - 1e-12, 1.0]])
    assert checked(near, None, np.eye(2)).massless == ()


def test_what_becomes_a_matrix():
    assert dense("M", 3).tolist() == [[3.0]] and dense("M", [[1, 2], [3, 4]]).dtype == float
    given = np.eye(2)
    dense("M", given)[0, 0] = 7.0
    assert given[0, 0] == 1.0  # inputs are not changed
    for size, taken in ((6000, True), (6001, False)):
        sparse = types.SimpleNamespace(shape=(2, size), toarray=lambda: np.array([[1.0, 2.0], [3.0, 4.0]]))
        if taken:
            assert dense("K", sparse).tolist() == [[1.0, 2.0], [3.0, 4.0]]
        else:
            with pytest.raises(ValueError, match="up to 6000 degrees of freedom are taken"):
                dense("K", sparse)


@pytest.mark.parametrize("value, words", [
    (np.zeros((0, 0)), r"C has shape \(0, 0\); it must be square"), (np.zeros(3), r"shape \(3,\)"),
    (np.zeros((1, 2)), r"shape \(1, 2\)"), ([["a"]], "must be a matrix of numbers"), ([[1.0, 2.0], [np.inf, 4.0]],
     r"C\[1, 0\] = inf"),
    ([[1.0, np.nan], [1.0, 4.0]], r"C\[0, 1\] = nan; all entries must be finite"), ([[1j]], "C is complex; structural damping")])
def test_what_is_no_matrix(value, words):
    with pytest.raises(ValueError, match=words):
        dense("C", value)


# ---- damping -------------------------------------------------------------------------------------------------------------------


def test_proportional_damping_by_factors_and_by_ratios():
    assert np.array_equal(rayleigh_damping(M, K, alpha=0.3), 0.3 * M)
    assert np.array_equal(rayleigh_damping(M, K, beta=0.2), 0.2 * K)
    assert np.array_equal(rayleigh_damping(M, K, 0.3, 0.2), 0.3 * M + 0.2 * K)
    z, w = (0.02, 0.035), (1.3, 2.9)
    C = rayleigh_damping(M, K, ratios=z, frequencies=w)
    for ratio, frequency in zip(z, w, strict=True):  # a mode of unit mass: 2 zeta w = alpha + beta w^2
        one = rayleigh_damping([[1.0]], [[frequency**2]], ratios=z, frequencies=w)
        assert one[0, 0] == pytest.approx(2.0 * ratio * frequency, rel=1e-13)
    beta = 2.0 * (z[1] * w[1] - z[0] * w[0]) / (w[1]**2 - w[0]**2)
    alpha = 2.0 * z[0] * w[0] - beta * w[0]**2
    assert C == pytest.approx(alpha * M + beta * K, rel=1e-12)


@pytest.mark.parametrize("given, words", [
    ({}, "write alpha= and beta="), ({"alpha": 0.1, "ratios": (0.1, 0.1), "frequencies": (1.0, 2.0)}, "write alpha= and beta="),
    ({"beta": 0.1, "ratios": (0.1, 0.1), "frequencies": (1.0, 2.0)}, "write alpha="), ({"ratios": (0.1, 0.1)}, "write alpha="),
    ({"alpha": 0.1, "frequencies": (1.0, 2.0)}, "write alpha="), ({"ratios": (0.1,), "frequencies": (1.0, 2.0)},
     "two ratios at two|list of 2 finite"),
    ({"ratios": (0.1, 0.1), "frequencies": (1.0, 2.0, 3.0)}, "list of 2 finite"),
    ({"ratios": (0.1, 0.1), "frequencies": (0.0, 2.0)}, "different frequencies above 0"),
    ({"ratios": (0.1, 0.1), "frequencies": (2.0, 2.0)}, "different frequencies above 0"),
    ({"alpha": -0.1, "beta": 0.5}, "alpha = -0.1 is not allowed; it must be a finite number, at least 0"),
    ({"beta": -0.1}, "beta = -0.1"),
    ({"alpha": np.inf}, "alpha = inf is not allowed"), ({"alpha": 0.1, "beta": np.nan}, "beta = nan is not allowed")])
def test_proportional_damping_that_is_not_one(given, words):
    with pytest.raises(ValueError, match=words):
        rayleigh_damping(M, K, **given)


def test_the_wrong_matrix_of_a_damping_is_named():
    for make in (lambda a, b: rayleigh_damping(a, b, 0.1), lambda a, b: modal_damping(a, b, 0.1)):
        with pytest.raises(ValueError, match="M is the upper triangle"):
            make(np.triu(M), K)
        with pytest.raises(ValueError, match="K is the lower triangle"):
            make(M, np.tril(K))


@pytest.mark.parametrize("ratios, whole", [(0.03, [0.03] * 4), ((0.01, 0.04), [0.01, 0.04, 0.04, 0.04]),
                                           ((0.01, 0.02, 0.03, 0.0), [0.01, 0.02, 0.03, 0.0])])
def test_modal_damping_damps_every_mode_by_itself(ratios, whole):
    squares, modes = eigh(K, M)
    C = modal_damping(M, K, ratios)
    assert np.array_equal(C, C.T)
    assert modes.T @ C @ modes == pytest.approx(np.diag(2.0 * np.array(whole) * np.sqrt(squares)), abs=1e-14)


def test_modal_damping_leaves_rigid_bodies_alone():
    free = np.array([[1.0, -1.0], [-1.0, 1.0]])
    C = modal_damping(np.diag([1.0, 2.0]), free, 0.1)
    assert C @ np.ones(2) == pytest.approx([0.0, 0.0], abs=1e-8)
    assert C == pytest.approx(2.0 * 0.1 * free / np.sqrt(1.5), rel=1e-8)  # M^-1 K has the one frequency^2 1.5, and C = c K


@pytest.mark.parametrize("ratios", [(), (0.1,) * 5, -0.1, np.nan, np.inf, (0.1, -0.1), ((0.1, 0.2),)])
def test_damping_ratios_that_are_none(ratios):
    with pytest.raises(ValueError, match="it must be 1 to 4 numbers of at least 0"):
        modal_damping(M, K, ratios)


def test_modal_damping_needs_mass():
    with pytest.raises(ValueError, match="M must be positive definite; reduce or condense"):
        modal_damping(np.diag([1.0, 0.0]), np.eye(2), 0.1)


# ---- names ---------------------------------------------------------------------------------------------------------------------


def test_names_are_texts_or_pairs():
    assert dof_names(None, 3) is None
    assert dof_names(iter(["a", ("tip", "uy"), [3, "ux"]]), 3) == ("a", "tip.uy", "3.ux")
    for wrong in (["a", ""], ["a", 3], ["a", ()], ["a", None]):
        with pytest.raises(ValueError, match=r"System: dofs\[\d\] = .*; it must be a name"):
            dof_names(wrong, 2)
    with pytest.raises(ValueError, match="^stop: dofs has 1 names; there are 2"):
        dof_names(["a"], 2, "stop")
    many = [name for name in "gfedcbaz" for _ in range(2)]
    with pytest.raises(ValueError, match="names a, b, c, d, e more than once"):
        dof_names(many, len(many))


def test_places_by_name_and_number():
    names = ("a.x", "a.y", "b.x")
    assert [place_of(dof, names, 3) for dof in ("a.y", "b.x", 0, 2, np.int64(1))] == [1, 2, 0, 2, 1]
    for wrong in (-1, 3):
        with pytest.raises(ValueError,
                           match=f"System: dof = {wrong} is not allowed; it must be a whole number, at least 0 and at most 2"):
            place_of(wrong, names, 3)
    with pytest.raises(ValueError, match="dof = 'a.x' is a name, and this system has no names"):
        place_of("a.x", None, 3)
    with pytest.raises(ValueError, match=r"no degree of freedom 'a.z'; there are a.x, a.y \.\.\.$"):
        place_of("a.z", names, 3)
    with pytest.raises(ValueError, match=r"no degree of freedom 'c'; there are a.x, a.y, b.x$"):
        place_of("c", names, 3)


# ---- reduction -----------------------------------------------------------------------------------------------------------------


def test_fixed_interface_modes_solve_their_two_problems():
    """Kept coordinates in the order asked for: K_ii T_i = -K_ik, and modes of the held inside with unit mass."""
    keep, inner = (3, 1), [0, 2]
    mass, stiffness, found = reduce(M, K, keep, 1, "craig-bampton", ("a", "b", "c", "d"))
    T = found.recovery
    assert np.array_equal(T[list(keep)], np.eye(2, 3))
    assert K[np.ix_(inner, inner)] @ T[inner, :2] == pytest.approx(-K[np.ix_(inner, list(keep))], abs=1e-14)
    squares = eigh(K[np.ix_(inner, inner)], M[np.ix_(inner, inner)], eigvals_only=True)
    assert stiffness[2] == pytest.approx([0.0, 0.0, squares[0]], abs=1e-14) and mass[2, 2] == pytest.approx(1.0)
    assert mass == pytest.approx(T.T @ M @ T) and stiffness == pytest.approx(T.T @ K @ T)
    assert found.frequencies == pytest.approx(np.sqrt(eigh(T.T @ K @ T, T.T @ M @ T, eigvals_only=True)))
    assert found.full_frequencies == pytest.approx(np.sqrt(eigh(K, M, eigvals_only=True)[:3]))
    assert (found.keep, found.method, found.dofs) == (keep, "craig-bampton", ("a", "b", "c", "d"))
    assert not found.residual.any() and found.residual.shape == (2, 2) and found.static_error < 1e-14


def test_free_modes_carry_the_statics_of_the_kept_coordinates():
    keep = (2, 0)
    squares, free = eigh(K, M)
    mass, stiffness, found = reduce(M, K, keep, 2, "rubin")
    T = found.recovery
    assert np.array_equal(T[list(keep)], np.eye(2, 4))
    unit = np.eye(4)[:, list(keep)]
    exact = np.linalg.solve(K, unit)
    assert T @ np.linalg.solve(stiffness, np.eye(4)[:, :2]) == pytest.approx(exact, rel=1e-12)  # everywhere, not at the kept alone
    assert mass == pytest.approx(T.T @ M @ T)
    residual = free[:, 2:] / squares[2:] @ free[:, 2:].T
    light, springs, other = reduce(M, K, keep, 2, "massless")
    assert other.residual == pytest.approx(residual[np.ix_(keep, keep)], rel=1e-12)
    assert np.array_equal(light, np.diag([0.0, 0.0, 1.0, 1.0])) and np.array_equal(other.recovery, T)
    assert springs == pytest.approx(stiffness) and springs[:2, :2] == pytest.approx(np.linalg.inv(other.residual))
    assert other.frequencies == pytest.approx(np.sqrt(squares[:2])) == other.full_frequencies


def test_the_static_error_is_that_of_the_elastic_flexibility():
    """A free chain by constraint modes, which do not know what inertia balances: both flexibilities from pseudo-inverses."""
    chain = np.array([[1.0, -1.0, 0, 0], [-1, 3.0, -2.0, 0], [0, -2.0, 2.5, -0.5], [0, 0, -0.5, 0.5]])
    mass = np.diag([1.0, 2.0, 0.5, 1.5])

    def elastic(m, k, at):
        root = np.linalg.cholesky(m)
        inverse = np.linalg.inv(root)
        return (inverse.T @ np.linalg.pinv(inverse @ k @ inverse.T, rcond=1e-8) @ inverse)[np.ix_(at, at)]

    keep = [3, 1]
    small, springs, found = reduce(mass, chain, tuple(keep), 1, "craig-bampton")
    full, own = elastic(mass, chain, keep), elastic(small, springs, [0, 1])
    size = np.sqrt(np.diag(full))
    assert found.static_error == pytest.approx((np.abs(own - full) / np.outer(size, size)).max(), rel=1e-8)
    assert 1e-3 < found.static_error < 1.0
    assert found.errors[0] == 0.0 and reduce(mass, chain, tuple(keep), 2, "craig-bampton")[2].static_error < 1e-12
    for count in (1, 2):
        assert reduce(mass, chain, (3,), count, "massless")[2].static_error < 1e-10


def test_errors_and_the_range_that_they_leave():
    def made(own, full, n=9):
        return Reduction("rubin", (0,), np.zeros((n, len(own))), None, np.array(own), np.array(full), 0.25, np.zeros((1, 1)))

    found = made([1e-9, 1.0, 2.003, 3.3], [0.0, 1.0, 2.0, 3.0])
    assert found.errors == pytest.approx([0.0, 0.0, 1.5e-3, 0.1]) and found.errors[0] == 0.0
    assert (found.valid_to(), found.valid_to(2e-3), found.valid_to(0.2), found.valid_to(1e-4)) == (1.0, 2.0, 3.0, 1.0)
    assert made([1.0, 2.0, 3.0, 4.0], [1.0, 2.0, 3.0, 4.0], 4).valid_to() == np.inf
    assert made([1.1, 2.0], [1.0, 2.0]).valid_to() == 0.0 and made([1.1, 2.0], [1.0, 2.0]).valid_to(0.1000001) == 2.0
    assert made([3e-9, 1.0], [2e-9, 1.0]).errors[0] == pytest.approx(0.5)  # however low: it is a frequency
    assert repr(made([1.0], [1.0])) == ("Reduction(rubin: 1 of 9 coordinates; statics at the 1 kept ones to 2.5e-01; natural "
                                        "frequencies to 0.001 up to 1 rad/time)")


@pytest.mark.parametrize("dofs", [None, ("a", "b", "c", "d")])
def test_a_reduction_goes_through_its_record(dofs):
    found = reduce(M, K, (2, 0), 1, "massless", dofs)[2]
    again = Reduction.from_record(found.to_record())
    for name in ("method", "keep", "dofs", "static_error"):
        assert getattr(again, name) == getattr(found, name) and type(getattr(again, name)) is type(getattr(found, name))
    for name in ("recovery", "frequencies", "full_frequencies", "residual"):
        assert np.array_equal(getattr(again, name), getattr(found, name))


@pytest.mark.parametrize("keep, modes, method, words", [
    ((0, 1, 2, 3), 0, "rubin", r"keep = .* with modes = 0 is not allowed; of 4 coordinates 1 to 3 are kept, with 0 to 0"),
    ((0,), 4, "rubin", "1 to 3 are kept, with 0 to 3 modes"), ((0, 1), -1, "rubin", "with 0 to 2 modes"),
    ((), 1, "rubin", "1 to 3 are kept"), ((0,), 1, "static", "method = 'static' is not allowed")])
def test_how_many_coordinates_are_kept(keep, modes, method, words):
    with pytest.raises(ValueError, match=words):
        reduce(M, K, keep, modes, method)


def test_a_complete_reduction_and_one_without_modes():
    assert reduce(M, K, (1, 2), 2, "craig-bampton")[2].errors.max() < 1e-12
    guyan = reduce(M, K, (1, 2), 0, "craig-bampton")[1]
    kept, rest = [1, 2], [0, 3]
    schur = K[np.ix_(kept, kept)] - K[np.ix_(kept, rest)] @ np.linalg.solve(K[np.ix_(rest, rest)], K[np.ix_(rest, kept)])
    assert guyan == pytest.approx(schur, rel=1e-13)
    with pytest.raises(ValueError, match="reduced: the 3 modes leave no flexibility to the kept coordinates; take fewer modes"):
        reduce(np.eye(4), np.diag([1.0, 2.0, 3.0, 4.0]), (0,), 3, "rubin")


@pytest.mark.parametrize("soft, fails", [(-1e-2, True), (-1e-8, True), (-1e-10, False)])
def test_buckled_structures_are_refused(soft, fails):
    """(1, 1) has the energy `soft`, and terms that sum to 4: up to a billionth of them it is what condensations leave."""
    stiffness = np.array([[1.0, -1.0, 0.0], [-1.0, 1.0 + soft, 0.0], [0.0, 0.0, 1.0]])
    if not fails:
        assert reduce(np.eye(3), stiffness, (1, 2), 1, "craig-bampton")[2].frequencies[0] == 0.0
        return
    with pytest.raises(ValueError, match="K is not positive semidefinite: a motion with coordinate [01] has a negative strain"):
        reduce(np.eye(3), stiffness, (2,), 1, "craig-bampton")


@pytest.mark.parametrize("unit", [1e-9, 1.0, 1e9])
def test_the_inside_must_be_held_by_the_kept_coordinates(unit):
    soft = 1e-12
    held = unit * np.diag([1.0, soft, 1.0])
    found = reduce(np.eye(3), held, (2,), 2, "craig-bampton")[2]
    assert found.frequencies == pytest.approx(np.sqrt(unit * np.array([soft, 1.0, 1.0])), rel=1e-12)
    with pytest.raises(ValueError, match="the structure can still move as a rigid body; keep more"):
        reduce(np.eye(3), unit * np.diag([1.0, 0.0, 1.0]), (2,), 1, "craig-bampton")


def test_the_package_gives_these_helpers():
    assert bf.rayleigh_damping is rayleigh_damping and bf.modal_damping is modal_damping


@pytest.mark.parametrize("turned", [1.0, -1.0])
def test_what_is_not_skew_is_seen_on_either_side(turned):
    with pytest.raises(ValueError, match="not skew-symmetric"):
        checked(np.eye(2), None, np.eye(2), turned * np.array([[1.0, 2.0], [-2.0, 0.0]]), None, True)


@pytest.mark.parametrize("unit", [1e-18, 1.0, 1e18])
@pytest.mark.parametrize("method", ["craig-bampton", "rubin", "massless"])
def test_a_reduction_knows_no_unit(method, unit):
    """A free chain in other units of stiffness: the same shapes and errors, frequencies times the root, one rigid body."""
    n = 6
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    K[0, 0] = K[-1, -1] = 1.0
    plain, scaled = (reduce(np.eye(n), factor * K, (0, 5), 3, method) for factor in (1.0, unit))
    assert scaled[1] == pytest.approx(unit * plain[1], rel=1e-9, abs=1e-9 * unit)
    assert scaled[2].errors == pytest.approx(plain[2].errors, abs=1e-7)
    assert scaled[2].full_frequencies / np.sqrt(unit) == pytest.approx(plain[2].full_frequencies, abs=1e-6)
    with pytest.raises(ValueError, match="1 rigid-body modes" if method != "craig-bampton" else "with modes = -1"):
        reduce(np.eye(n), unit * K, (0, 5), 0 if method != "craig-bampton" else -1, method)
