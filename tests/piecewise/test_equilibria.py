"""States of rest of systems of first order against linear algebra, closed forms and labels by roots of quadratics."""
import math

import numpy as np
import pytest
from scipy.optimize import brentq

import bifurc as bf
from bifurc.piecewise import equilibria

F, S = bf.AffineField, bf.AffineSurface
A = [[-1.0, 1.0], [-1.0, -0.5]]
PERSISTS, FOLDS = (0.5, -1.0), (-2.0, -1.0)  # C A^-1 g = 1 and -2/3


def boundary(g, mu, shift=0.0):
    """F1 = A x + (0, mu), F2 = F1 + g, about the surface y = shift."""
    offset = -np.array(A) @ [0.0, shift]
    return bf.PiecewiseSystem("x y", {"-": F(A, lambda mu: offset + [0.0, mu]),
                                      "+": F(A, lambda mu: offset + [g[0], mu + g[1]])}, [bf.Switch(S([0.0, 1.0], -shift))], mu=mu)


@pytest.mark.parametrize("shift", [0.0, 3.0])
@pytest.mark.parametrize(("g", "mu", "kind", "state", "weight", "eigenvalue"), [
    (PERSISTS, -0.3, "regular", (-0.2, -0.2), None, None), (PERSISTS, 0.3, "pseudo", (0.1, 0.0), 0.2, -1.5),
    (FOLDS, -0.3, "regular", (-0.2, -0.2), None, None), (FOLDS, -0.3, "pseudo", (-0.6, 0.0), 0.3, 1.0)])
def test_the_kind_weight_and_eigenvalues_of_a_state_of_rest(g, mu, kind, state, weight, eigenvalue, shift):
    system, at = boundary(g, mu, shift), np.add(state, (0.0, shift))
    rest = bf.find_equilibrium(system, at + 0.01 * (kind == "regular"))
    assert rest.success and rest.kind == kind and not rest.virtual
    assert rest.weight == (None if weight is None else pytest.approx(weight))
    np.testing.assert_allclose(rest.state, at, atol=1e-14)
    values = np.linalg.eigvals(A) if kind == "regular" else [eigenvalue]
    np.testing.assert_allclose(sorted(rest.eigenvalues), sorted(values), atol=1e-13)
    assert rest.stable is (eigenvalue is None or eigenvalue < 0.0)
    assert ("both sides" if kind == "pseudo" else "vanishes here") in rest.message and kind in repr(rest)


@pytest.mark.parametrize(("g", "low", "high"), [(PERSISTS, -1.0, 1.0), (FOLDS, -1.0, -1.0)])
@pytest.mark.parametrize("begin", [-0.4, -0.05])
def test_a_branch_passes_a_boundary_equilibrium_or_turns_back(g, low, high, begin):
    """Persistence where C A^-1 g > 0; below zero a nonsmooth fold, with the regular and the pseudo-equilibrium on one side."""
    branch = bf.trace(bf.find_equilibrium(boundary(g, begin), (-0.1, -0.1)), "mu", bounds=(-1.0, 1.0))
    [point] = branch.special_points
    assert point.kind == "boundary_equilibrium" and abs(point.parameter) <= 1e-13 and branch.audit.ok
    assert ("reverses" in repr(point)) is (g == FOLDS)
    mu = branch.column("mu")
    assert mu[[0, -1]] == pytest.approx([low, high], abs=1e-12)
    states = np.array([branch.column("q_0"), branch.column("q_1")]).T
    on = np.abs(states[:, 1]) < 1e-12
    np.testing.assert_allclose(states[~on], np.outer(mu[~on], [2.0 / 3.0, 2.0 / 3.0]), atol=1e-12)
    np.testing.assert_allclose(states[on, 0], mu[on] * (1.0 / 3.0 if g == PERSISTS else 2.0), atol=1e-12)
    assert on.any() and (~on).any()


@pytest.mark.parametrize("key", ["-", "+", "slide"])
@pytest.mark.parametrize("g", [PERSISTS, FOLDS])
@pytest.mark.parametrize("mu", [-0.4, 0.4])
def test_a_branch_of_a_virtual_equilibrium_goes_through_the_boundary(g, mu, key):
    """The equilibria A x + (0, mu) = 0, A x + (0, mu) + g = 0 and C x = 0 of each mode, whether it holds there or not: up to where
    a regular or pseudo-equilibrium goes on as the other one."""
    closed = {"-": lambda mu: np.linalg.solve(A, (0.0, -mu)), "+": lambda mu: np.linalg.solve(A, np.subtract((0.0, -mu), g)),
              "slide": lambda mu: (mu / 3.0 if g == PERSISTS else 2.0 * mu, 0.0)}
    rest = {one.contacts["automaton"]: one for one in equilibria(boundary(g, mu))}[key]
    if not rest.virtual:
        return
    branch = bf.trace(rest, "mu", bounds=(-1.0, 1.0))
    where, virtual = branch.column("mu"), branch.column("virtual").astype(bool)
    states = np.array([branch.column("q_x"), branch.column("q_y")]).T
    np.testing.assert_allclose(states, [closed[key](value) for value in where], atol=1e-12)
    assert branch.audit.ok and sorted(where[[0, -1]]) == pytest.approx([-1.0, 1.0])
    assert [point.kind for point in branch.special_points] == ["boundary_equilibrium"] * (key != "+")
    far = np.abs(where) > 1e-12
    assert (virtual[far] == ((where[far] * mu > 0.0) | (key == "+"))).all()
    assert (branch.column("stable") == None)[virtual].all()  # noqa: E711  an array of True, False and None
    assert all(branch.orbits[i].virtual for i in np.flatnonzero(virtual & far))


@pytest.mark.parametrize(("switch", "threshold"), [({"sliding": False}, 0.0), ({"hysteresis": (-0.2, 0.1)}, 0.15)])
def test_where_nothing_else_rests_an_equilibrium_goes_on_as_a_virtual_one(switch, threshold, tmp_path):
    """y = 2 mu/3 meets the surface where motions below leave it."""
    fields = {"-": F(A, lambda mu: [0.0, mu]), "+": F(A, lambda mu: [0.5, mu - 1.0])}
    system = bf.PiecewiseSystem("x y", fields, [bf.Switch(S([0.0, 1.0]), **switch)], mu=-0.3)
    branch = bf.trace(bf.find_equilibrium(system, {"x": -0.2, "y": -0.2}), "mu", bounds=(-1.0, 0.5))
    branch.save(tmp_path / "branch.npz")
    for one in (branch, bf.load(tmp_path / "branch.npz", elements=[system.builder]).extend(bounds=(-1.0, 1.0))):
        [point] = one.special_points
        assert point.kind == "boundary_equilibrium" and point.parameter == pytest.approx(threshold, abs=1e-13)
        assert (one.column("virtual").astype(bool) == (one.column("mu") > threshold + 1e-13))[1:].mean() > 0.9 and one.audit.ok
        assert one.column("q_y") == pytest.approx(2.0 * one.column("mu") / 3.0) and "virtual" in point.after
    assert one.column("mu").max() == 1.0


def test_a_hopf_point_of_a_virtual_equilibrium_is_none():
    """Below y = 0 the field turns round (0, 1), where it does not hold; its spiral opens at mu = 0."""
    fields = {"-": F(lambda mu: [[mu, -1.0], [1.0, mu]], lambda mu: [1.0, -mu]), "+": F(-np.eye(2), [0.0, -1.0])}
    system = bf.PiecewiseSystem("x y", fields, [bf.Switch(S([0.0, 1.0]), sliding=False)], mu=-0.3)
    [rest] = [one for one in equilibria(system) if one.contacts["automaton"] == "-"]
    assert rest.virtual and not len(bf.trace(rest, "mu", bounds=(-0.5, 0.5)).special_points)


def test_virtual_equilibria_are_listed_and_not_found():
    found = {rest.contacts["automaton"]: rest for rest in equilibria(boundary(PERSISTS, 0.3))}
    assert {key: rest.virtual for key, rest in found.items()} == {"-": True, "+": True, "slide": False}
    assert found["-"].stable is None and "virtual" in found["-"].message and not found["-"].success
    rest = bf.find_equilibrium(boundary(PERSISTS, 0.3), found["-"].state)
    assert rest.kind == "pseudo" and rest.success
    beyond = bf.find_equilibrium(boundary(FOLDS, 3.0), (0.0, -1.0))  # only the field above has one
    assert beyond.success and beyond.contacts["automaton"] == "+"


def test_a_boundary_equilibrium_says_so():
    rest = bf.find_equilibrium(boundary(PERSISTS, 0.0))
    assert rest.kind == "boundary" and rest.success and rest.stable is None and "ends" in rest.message


@pytest.mark.parametrize("seed", range(8))
def test_pseudo_equilibria_solve_a_linear_system(seed):
    """A x + b + B u = 0, h x + c = 0; motions on the surface have (I - B h/(h B)) A, but for one zero."""
    rng = np.random.default_rng([seed, 7])
    n = int(rng.integers(2, 6))
    M, b, h, c = rng.normal(size=(n, n)), 0.1 * rng.normal(size=n), rng.normal(size=n), 0.1 * rng.normal()
    B = rng.normal(size=n)
    B *= -np.sign(h @ B)
    x = np.linalg.solve(np.block([[M, B[:, None]], [h[None], np.zeros((1, 1))]]), -np.append(b, c))
    system = bf.PiecewiseSystem([f"x{i}" for i in range(n)], {"-": F(M, b - B), "+": F(M, b + B)}, [bf.Switch(S(h, c))])
    [rest] = [one for one in equilibria(system) if one.contacts["automaton"] == "slide"]
    np.testing.assert_allclose(rest.state, x[:n], atol=1e-11 * max(1.0, np.abs(x).max()))
    assert rest.weight == pytest.approx(0.5 * (1.0 + x[n]), abs=1e-11) and rest.virtual is bool(abs(x[n]) > 1.0)
    values = np.linalg.eigvals(M - np.outer(B, h @ M) / (h @ B))
    values = np.delete(values, np.argmin(np.abs(values)))
    np.testing.assert_allclose(np.sort_complex(rest.eigenvalues), np.sort_complex(values), atol=1e-10)


def test_two_surfaces_have_two_weights():
    a, B = np.array([0.3, -0.2]), np.array([[1.0, 0.3], [-0.2, 0.8]])
    way = {"-": 1.0, "+": -1.0}
    system = bf.PiecewiseSystem("x y", {p + q: F(np.zeros((2, 2)), a + B @ [way[p], way[q]]) for p in way for q in way},
                                [bf.Switch(S([1.0, 0.0])), bf.Switch(S([0.0, 1.0]))])
    rest = bf.find_equilibrium(system, (0.4, -0.3))
    assert rest.success and rest.kind == "pseudo" and rest.stable and not rest.eigenvalues.size
    assert rest.weight == pytest.approx(0.5 * (1.0 - np.linalg.solve(B, -a)))
    np.testing.assert_allclose(rest.state, 0.0, atol=1e-15)


def test_chuas_equilibria_and_their_hopf_point():
    """The outer region's characteristic polynomial is s^3 + p s^2 + q s + r: a pair is imaginary where p q = r."""
    for guess, x in (((1.4, 0.0, -1.4), 1.5), ((-1.0, 0.0, 1.0), -1.5), ((0.1, 0.0, 0.0), 0.0)):
        rest = bf.find_equilibrium(bf.systems.chua_circuit(alpha=5.0), guess)
        np.testing.assert_allclose(rest.state, [x, 0.0, -x], atol=1e-14)
        assert rest.stable is bool(x) and rest.kind == "regular"
    rest = bf.find_equilibrium(bf.systems.chua_circuit(alpha=5.0), (1.4, 0.0, -1.4))
    branch, beta, slope = bf.trace(rest, "alpha", bounds=(4.0, 9.0)), 100.0 / 7.0, 2.0 / 7.0
    [point] = branch.special_points
    where = brentq(lambda al: (1.0 + al * slope) * (al * (slope - 1.0) + beta) - al * slope * beta, 5.0, 9.0, xtol=1e-14)
    assert point.kind == "hopf" and point.parameter == pytest.approx(where, abs=1e-11) and branch.audit.ok
    assert "closed" in bf.switch_branch(point).status
    assert point.solution.lyapunov_coefficient(0) == pytest.approx(0.0, abs=1e-10)
    again = type(rest).from_record(*rest.to_record())
    assert again.system == rest.system and np.array_equal(again.state, rest.state)
    assert "alpha" in branch.plot().get_xlabel()


def test_other_systems_have_kinds_too():
    rest = bf.find_equilibrium(bf.systems.belt_oscillator(belt_speed=0.5))
    assert rest.kind == "regular" and rest.weight is None and not rest.virtual
    with pytest.raises(ValueError, match="frequency"):
        bf.find_equilibrium(bf.PiecewiseSystem("x", {"-": F([[-1.0]]), "+": F([[-2.0]])}, [bf.Switch(S([1.0]))], omega=1.0))


# basins

def bistable(omega=None):
    """x' = -x + sgn(x + y), y' = -2 y: rests (1, 0) and (-1, 0); between x = -1 and 1 both fields leave the line x + y = 0."""
    return bf.PiecewiseSystem("x y", {"-": F(np.diag([-1.0, -2.0]), [-1.0, 0.0]), "+": F(np.diag([-1.0, -2.0]), [1.0, 0.0])},
                              [bf.Switch(S([1.0, 1.0]))], omega=omega)


def side_of(x, y):
    """Return where a motion ends: h = s + (x - s) u + y u^2 with u = exp(-t) on side s, to the last of its crossings."""
    s = math.copysign(1.0, x + y)
    for _ in range(10):
        roots = np.roots([y, x - s, s]) if y else np.array([s / (s - x)] if x != s else [])
        inside = [u.real for u in roots if abs(u.imag) < 1e-14 and 1e-9 < u.real < 1.0 - 1e-9]
        if not inside:
            return s
        u = max(inside)
        x, y, s = s + (x - s) * u, y * u * u, -s
    raise AssertionError


@pytest.mark.parametrize("section", [bf.Section("w0", value=0.5, direction=0), bf.Section("w1", value=0.1, direction=0)])
def test_a_relay_with_two_rests_has_the_basins_of_its_separatrix(section):
    grid = bf.Grid(w0=(-4.0, 4.0, 10), w1=(-5.0, 5.0, 9))
    basins = bf.basins_of_attraction(bistable(), grid, section=section, seed=3)
    assert [type(item).__name__ for item in basins.attractors] == ["Equilibrium", "Equilibrium"]
    ends = np.array([item.state[0] for item in basins.attractors])
    np.testing.assert_allclose(np.sort(ends), [-1.0, 1.0], atol=1e-12)
    points, labels = grid.points(np.arange(grid.size)), basins.labels.ravel()
    clear = labels >= 0
    assert clear.mean() > 0.98  # cells on the line itself are escaping, or cross
    wanted = np.array([side_of(*point) for point in points[clear]])
    assert (ends[labels[clear]].round() == wanted).all()


def test_a_pseudo_equilibrium_attracts():
    """x' = -x, y' = -sgn y + 0.3: rests at the origin, on the surface, with weight (1 + 0.3)/2 of the field above."""
    system = bf.PiecewiseSystem("x y", {"-": F(np.diag([-1.0, 0.0]), [0.0, 1.3]), "+": F(np.diag([-1.0, 0.0]), [0.0, -0.7])},
                                [bf.Switch(S([0.0, 1.0]))])
    grid = bf.Grid(w0=(-2.0, 2.0, 6), w1=(-1.0, 1.0, 6))
    basins = bf.basins_of_attraction(system, grid, section=bf.Section("w0", direction=0), seed=1)
    [rest] = basins.attractors
    assert rest.kind == "pseudo" and rest.weight == pytest.approx(0.65) and basins.counts[0] == 36
    np.testing.assert_allclose(rest.state, 0.0, atol=1e-15)


def test_a_search_for_orbits_says_that_the_motion_rests():
    for system, start in ((bistable(), (3.0, 1.0)), (boundary(PERSISTS, 0.3), (0.5, 1.0)),
                          (bf.systems.chua_circuit(alpha=5.0), (1.0, 0.0, 0.0))):
        orbit = bf.find_orbit(system, start)
        assert orbit.status == "at_rest" and bf.find_equilibrium(system, orbit.state).success


def test_cells_of_a_map_know_rests_of_both_kinds():
    found = bf.cell_mapping(bistable(omega=2.0), bf.Grid(w0=(-2.05, 2.0, 20), w1=(-2.0, 2.1, 20)), periods=4, audit=100)
    np.testing.assert_allclose(sorted(item.state[0] for item in found.attractors), [-1.0, 1.0], atol=1e-12)


def test_maps_at_phase_zero_know_pseudo_equilibria():
    """x' = -x, y' = -sgn(y) + 0.3 with a clock that nothing reads: all starts end on the surface y = 0, in the origin."""
    system = bf.PiecewiseSystem("x y", {"-": F(np.diag([-1.0, 0.0]), [0.0, 1.3]), "+": F(np.diag([-1.0, 0.0]), [0.0, -0.7])},
                                [bf.Switch(S([0.0, 1.0]))], omega=3.0)
    cells = bf.cell_mapping(system, bf.Grid(x=(-1.0, 1.1, 15), y=(-1.05, 1.0, 15)), periods=3, audit=50)
    basins = bf.basins_of_attraction(system, bf.Grid(x=(-2.0, 2.0, 6), y=(-1.0, 1.0, 7)), seed=1)
    for found in (cells, basins):
        [rest] = found.attractors
        np.testing.assert_allclose(rest.state, 0.0, atol=1e-12)
        assert rest.mode == ("slide",) and rest.stable
    assert basins.counts[0] == 42 and (cells.labels == 0).all()
