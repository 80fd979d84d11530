"""Cell mapping against closed forms of simple maps, graph algorithms of networkx, and the measured references of problem A."""
from types import SimpleNamespace

import networkx
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy import sparse

import bifurc as bf
from bifurc.basins.cells.cell_map import Audit, CellFate, GroupKind
from bifurc.basins.cells.compute import cell_mapping
from bifurc.basins.cells.generalized import _sorted, components, period, solved, stationary, transition
from bifurc.basins.cells.morse import _reach, morse_graph
from bifurc.basins.cells.simple import colour, cycles

A = bf.systems.impact_oscillator(zeta=0.02, omega=2.6, amplitude=1.0, gap=0.0, restitution=0.8)


def bistable(x):
    """Two stable fixed points +-1 a component, 0 between them repels; multiplier 0.2 and 1.4."""
    return x + 0.4 * (x - x**3)


# graphs

@given(st.lists(st.integers(-1, 40), min_size=1, max_size=40))
@example([3, 2, 4, 0, 1, 0, 5, 6])  # cycles of two and of three cells, and a way to one of them
@example([2, 2, 5, 9, 3, 1, 0, 2, 7])
def test_cycles_of_a_functional_graph_are_those_of_networkx(images):
    image = np.array(images)
    size = len(image)
    found = colour(image)
    inside = np.where((image < 0) | (image >= size), size, image)
    graph = networkx.DiGraph([(cell, int(to)) for cell, to in enumerate(inside)] + [(size, size)])
    expected = sorted(sorted(part) for part in networkx.strongly_connected_components(graph)
                      if len(part) > 1 or graph.has_edge(*[*part] * 2))
    lists = cycles(found, image)
    lists[0] = np.array([size])
    assert sorted(sorted(cells.tolist()) for cells in lists) == expected and found.total == len(expected)
    for cell in range(size):
        walk, steps = cell, 0
        while found.steps[walk]:
            walk, steps = int(inside[walk]), steps + 1
        assert steps == found.steps[cell] and walk in lists[found.group[cell]]
    assert all(cells[0] == cells.min() for cells in lists[1:])  # each begins at its first cell
    for cells in lists[1:]:
        np.testing.assert_array_equal(image[cells], np.roll(cells, -1))


def test_components_are_those_of_networkx_in_topological_order(rng):
    for size in (1, 5, 60, 300):
        rows = np.repeat(np.arange(size), 2)
        matrix = transition(rows, rng.integers(-1, size + size // 3, rows.size), size)
        np.testing.assert_allclose(matrix.sum(axis=1), 1.0, rtol=0, atol=1e-15)
        found = components(matrix)
        graph = networkx.DiGraph(list(zip(*matrix.nonzero(), strict=True)))
        expected = {frozenset(map(int, part)) for part in networkx.strongly_connected_components(graph)}
        assert {frozenset(np.flatnonzero(found.label == k).tolist()) for k in range(found.total)} == expected
        tail, head = (found.label[np.array(end)] for end in matrix.nonzero())
        assert (tail >= head).all()
        for k in range(found.total):
            members = set(np.flatnonzero(found.label == k).tolist())
            assert found.closed[k] == all(set(graph.successors(i)) <= members for i in members)
            assert found.recurrent[k] == (len(members) > 1 or graph.has_edge(*[*members] * 2))
        wild = rng.permutation(found.total)[found.label]  # as if scipy had numbered them in any order
        number = _sorted(found.total, *(wild[np.array(end)] for end in matrix.nonzero()))[wild]
        assert (number[matrix.nonzero()[0]] >= number[matrix.nonzero()[1]]).all()


# chains with closed forms

@pytest.mark.parametrize("chance", [0.5, 0.48, 0.7])
def test_the_gambler_is_ruined_with_the_known_probability_and_in_the_known_time(chance):
    """Feller, An Introduction to Probability Theory and Its Applications, volume 1, XIV.2-3."""
    n = 41
    matrix = sparse.lil_matrix((n + 1, n + 1))
    for i in range(1, n - 1):
        matrix[i, i + 1], matrix[i, i - 1] = chance, 1 - chance
    matrix[0, 0] = matrix[n - 1, n - 1] = matrix[n, n] = 1.0
    matrix = matrix.tocsr()
    fixed = np.zeros((n + 1, 1))
    fixed[0] = 1.0
    i, a = np.arange(n), n - 1
    odds = (1 - chance) / chance
    ruin = 1 - i / a if chance == 0.5 else (odds**i - odds**a) / (1 - odds**a)
    time = i * (a - i) if chance == 0.5 else i / (1 - 2 * chance) - a / (1 - 2 * chance) * (1 - odds**i) / (1 - odds**a)
    found = components(matrix)
    np.testing.assert_allclose(solved(matrix, found, fixed, np.zeros(n + 1))[:n, 0], ruin, rtol=0, atol=1e-12)
    np.testing.assert_allclose(solved(matrix, found, np.zeros((n + 1, 1)), np.ones(n + 1))[:n, 0], time, rtol=1e-11, atol=1e-9)


def test_large_groups_are_iterated_to_the_same(monkeypatch):
    grid = bf.Grid(q0=(-2, 2, 101))
    direct = cell_mapping(bistable, grid, samples=5).absorption()
    from bifurc.basins.cells import generalized
    monkeypatch.setattr(generalized, "DIRECT", 0)
    again = cell_mapping(bistable, grid, samples=5).absorption()
    np.testing.assert_allclose(again.probability, direct.probability, rtol=0, atol=1e-11)
    np.testing.assert_allclose(again.time, direct.time, rtol=1e-9)


def test_the_density_of_the_tent_map_is_uniform_and_that_of_the_logistic_map_the_arcsine_law():
    tent = cell_mapping(lambda x: 1 - np.abs(1 - 2 * x), bf.Grid(q0=(0, 1, 128)), samples=4, audit=0)
    (group,) = tent.groups
    assert group.period == 1 and len(group.cells) == 128
    np.testing.assert_allclose(tent.density(0), 1 / 128, rtol=1e-12)
    edges = np.linspace(0, 1, 201)
    exact = np.diff(2 / np.pi * np.arcsin(np.sqrt(edges)))
    logistic = cell_mapping(lambda x: 4 * x * (1 - x), bf.Grid(q0=(0, 1, 200)), samples=100, audit=0)
    error = np.abs(logistic.density(0) - exact).sum()
    finer = cell_mapping(lambda x: 4 * x * (1 - x), bf.Grid(q0=(0, 1, 3200)), samples=100, audit=0)
    smaller = np.abs(finer.density(0).reshape(200, 16).sum(axis=1) - exact).sum()
    assert error <= 0.1 and smaller <= error / 4  # the density is no smoother than a square root at its ends


def test_stationary_weights_of_a_periodic_chain_solved_and_iterated(monkeypatch):
    matrix = sparse.csr_matrix(np.array([[0, 0.25, 0.75, 0], [1, 0, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1.0]]))
    cells = np.arange(3)
    assert period(matrix, cells) == 2
    np.testing.assert_allclose(stationary(matrix, cells), [0.5, 0.125, 0.375], rtol=1e-14)
    big = cell_mapping(lambda x: np.mod(x + 0.25, 1.0), bf.Grid(q0=(0, 1, 8), periodic=("q0",)), audit=0)
    assert [len(group.cells) for group in big.groups] == [4, 4] and {group.period for group in big.groups} == {4}
    from bifurc.basins.cells import generalized
    monkeypatch.setattr(generalized, "DIRECT", 2)
    np.testing.assert_allclose(stationary(matrix, cells), [0.5, 0.125, 0.375], rtol=1e-9)


# maps with known basins

def test_eight_basins_in_three_dimensions_are_told_by_sign():
    grid = bf.Grid(q0=(-1.5, 1.5, 10), q1=(-1.5, 1.5, 8), v0=(-1.5, 1.5, 16))
    found = cell_mapping(bistable, grid, periods=3, audit=400)
    assert len(found.attractors) == 8 and found.audit == Audit(400, 0) and not found.spurious
    signs = np.array([np.sign(item.state) for item in found.attractors])
    centres = np.stack(np.meshgrid(*(grid.centres(axis) for axis in range(3)), indexing="ij"), axis=-1)
    np.testing.assert_array_equal(signs[found.labels], np.sign(centres))
    for item in found.attractors:
        np.testing.assert_allclose(np.abs(item.state), 1.0, rtol=0, atol=1e-12)
        np.testing.assert_allclose(item.multipliers, 0.2, rtol=0, atol=1e-6)


@pytest.mark.parametrize("chosen", [5, 64, 200])
def test_groups_that_a_cell_meets_first_whatever_their_number(chosen, rng):
    """Cells that lead to lower cells only: a walk over all edges that stops at chosen cells, in sets."""
    size = 300
    heads = [np.unique(rng.integers(0, i, rng.integers(0, 4))) if i else np.empty(0, int) for i in range(size)]
    indptr = np.concatenate(([0], np.cumsum([len(mine) for mine in heads])))
    number = np.full(size, -1)
    number[np.sort(rng.choice(size, chosen, replace=False))] = np.arange(chosen)
    first = np.zeros((size, (chosen + 63) // 64), np.uint64)
    cells = np.arange(size)
    _reach(indptr, np.concatenate(heads).astype(np.int64), cells, cells, number, first)
    met = []
    for i in range(size):
        met.append(set().union(*({int(number[j])} if number[j] >= 0 else met[j] for j in heads[i].tolist())))
        assert {k for k in range(chosen) if int(first[i, k // 64]) >> (k % 64) & 1} == met[i]
    assert max(max(mine, default=0) for mine in met) >= 0.4 * chosen


def test_the_morse_graph_of_a_bistable_map_is_a_repeller_above_two_attractors():
    found = cell_mapping(bistable, bf.Grid(q0=(-1.6, 1.6, 161)), samples=5)
    graph = found.morse
    middle = found.grid.cells_of(np.zeros((1, 1)))[0]
    (source,) = [node for node, content in graph.nodes(data=True) if middle in content["numbers"]]
    ends = [node for node in graph if graph.out_degree(node) == 0]
    assert graph.nodes[source]["kind"] == "transient" and graph.in_degree(source) == 0
    assert sorted(graph.nodes[end]["attractor"] for end in ends) == [0, 1]
    assert all(graph.nodes[end]["kind"] == "periodic" and graph.nodes[end]["closed"] for end in ends)
    assert networkx.descendants(graph, source) > set(ends) and networkx.is_directed_acyclic_graph(graph)
    chances = found.absorption()
    np.testing.assert_allclose(chances.probability.sum(axis=-1) + chances.left + chances.unresolved, 1.0, rtol=0, atol=1e-12)
    np.testing.assert_allclose(chances.probability[:, 0], chances.probability[::-1, 1], rtol=0, atol=1e-12)  # mirrored


def test_a_motion_round_the_circle_and_what_leaves_the_grid():
    """x -> x + .3 sin x on the circle ends at pi; the same on a line leaves what starts beyond a repeller at 2 pi."""
    def push(x):
        return x + 0.3 * np.sin(x)
    circle = cell_mapping(push, bf.Grid(q0=(-np.pi, np.pi, 90), periodic=("q0",)), periods=5)
    (item,) = circle.attractors
    assert circle.fractions == {0: 1.0, -1: 0.0} and abs(abs(item.state[0]) - np.pi) < 1e-11
    line = cell_mapping(push, bf.Grid(q0=(0.0, 3 * np.pi - 0.5, 300)), periods=5)
    middle = line.grid.centres(0)
    np.testing.assert_array_equal(line.fates, np.where(middle < 2 * np.pi, CellFate.ATTRACTED.code, CellFate.LEFT.code))


def test_a_map_to_infinity_leaves():
    found = cell_mapping(lambda x: x**3, bf.Grid(q0=(-2, 2, 40)), periods=20)
    middle = np.abs(found.grid.centres(0))
    np.testing.assert_array_equal(found.fates == CellFate.LEFT.code, middle > 1)
    assert found.lost > 0 and found.fractions[0] == 0.5


def test_slow_spirals_make_cycles_of_cells_that_are_no_attractors():
    """A turn by 1 radian with contraction .97: cells close cycles far from the only fixed point, and are flagged or near it."""
    turn = 0.97 * np.array([[np.cos(1.0), -np.sin(1.0)], [np.sin(1.0), np.cos(1.0)]])
    found = cell_mapping(lambda x: x @ turn.T, bf.Grid(q0=(-1, 1, 61), v0=(-1, 1, 61)))
    (item,) = found.attractors
    np.testing.assert_allclose(item.state, 0.0, rtol=0, atol=1e-12)
    assert item.periods == 1 and len(found.groups) > 1
    assert found.fractions[0] + np.mean(found.fates == CellFate.LEFT.code) == 1.0
    neutral = cell_mapping(lambda x: x @ turn.T / 0.97, bf.Grid(q0=(-1, 1, 21), v0=(-1, 1, 21)), max_periods=100)
    assert neutral.attractors == () and {group.kind for group in neutral.groups} == {GroupKind.UNCONFIRMED}


# systems

@pytest.fixture(scope="module")
def problem_a():
    return cell_mapping(A, bf.Grid(q0=(-2.5, 0, 200), v0=(-3, 3, 200)), periods=30, audit=4000)


def test_problem_a_at_thirty_periods_has_hardly_a_wrong_label(problem_a):
    assert [item.periods for item in problem_a.attractors] == [1, 3]
    assert all(item.success and item.stable and item.residual < 1e-12 for item in problem_a.attractors)
    assert problem_a.audit.wrong <= 4 and problem_a.audit.undecided == 0 and problem_a.audit.bounds[1] < 2.5e-3
    assert abs(problem_a.fractions[0] - 0.4286875) < 2e-3


@pytest.mark.slow
def test_problem_a_at_four_hundred_a_side_against_every_direct_label():
    grid = bf.Grid(q0=(-2.5, 0, 400), v0=(-3, 3, 400))
    found = cell_mapping(A, grid, periods=30)
    direct = bf.basins_of_attraction(A, grid)
    assert np.mean(found.labels != direct.labels) <= 5e-4


def test_one_period_a_mapping_makes_spurious_cycles_that_become_no_attractor():
    grid = bf.Grid(q0=(-5.0, 0.0, 200), v0=(-6, 6, 200))
    found = cell_mapping(A, grid, periods=3)
    assert [item.periods for item in found.attractors] == [1, 3]
    assert found.spurious and found.audit.fraction > 0.05
    genuine = [group for group in found.groups if group.kind is GroupKind.PERIODIC]
    assert {group.attractor for group in genuine} == {0, 1} and {group.period for group in genuine} == {1}  # 3 / 3
    assert "no attractor. Its cells are given" in found.report() and "closed groups" in found.report()


def test_workers_change_no_bit(problem_a):
    grid = bf.Grid(q0=(-2.5, 0.3, 40), v0=(-3, 3, 40))
    one, two = (cell_mapping(A, grid, periods=2, samples=2, workers=workers) for workers in (1, 2))
    for name in ("labels", "fates"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
    np.testing.assert_array_equal(one.matrix.data, two.matrix.data)
    np.testing.assert_array_equal(one.matrix.indices, two.matrix.indices)


def test_cells_beyond_the_stop_are_no_starts_unless_motions_arrive_in_them():
    grid = bf.Grid(q0=(-2.5, 0.62, 104), v0=(-3, 3, 100))  # the cell around the stop has its centre beyond it
    found = cell_mapping(A, grid, periods=30, audit=500)
    beyond = grid.centres(0) - 0.5 * grid.widths[0] > 0.0
    assert (found.fates[beyond] == CellFate.OUTSIDE.code).all() and (found.labels[beyond] == -1).all()
    assert found.audit.wrong + found.audit.undecided <= 2


@pytest.mark.parametrize("samples", [1, 3, 4])
def test_a_cell_whose_centre_lies_beyond_the_stop_is_judged_by_a_start_in_it(samples):
    """A table of less than the acceleration of gravity carries the ball for ever, from every start: amplitude omega^2 < g.  At
    phase 0 it lies at (amplitude, 0); the cell of that point, 0.455 to 0.52, has its centre below the table."""
    system = bf.systems.bouncing_ball(omega=1.0, amplitude=0.5, restitution=0.8, gravity=1.0)
    found = cell_mapping(system, bf.Grid(q0=(-0.65, 0.65, 20), v0=(-0.65, 0.65, 20)), samples=samples, audit=60, max_periods=500)
    assert np.allclose(found.points(0), [[0.5, 0.0]])
    assert found.fractions[0] == 1.0 and not found.spurious
    assert found.audit.wrong == found.audit.undecided == 0


def test_saved_and_loaded(tmp_path):
    found = cell_mapping(A, bf.Grid(q0=(-2.5, 0, 20), v0=(-3, 3, 20)), periods=10, samples=2)
    found.save(tmp_path / "cells.npz")
    loaded = bf.load(tmp_path / "cells.npz")
    np.testing.assert_array_equal(loaded.labels, found.labels)
    np.testing.assert_array_equal(loaded.absorption().probability, found.absorption().probability)
    assert (loaded.audit, loaded.options, repr(loaded)) == (found.audit, found.options, repr(found))
    with pytest.raises(ValueError, match="files hold no code"):
        cell_mapping(bistable, bf.Grid(q0=(-1, 1, 5))).save(tmp_path / "map.npz")


def test_bounds_of_an_audit_are_those_of_clopper_and_pearson():
    assert Audit(10, 0).bounds[0] == 0.0 and Audit(10, 10).bounds[1] == 1.0
    np.testing.assert_allclose(Audit(10, 0).bounds[1], 1 - 0.025**0.1, rtol=1e-12)
    np.testing.assert_allclose(Audit(20, 5).bounds, (0.0865714, 0.4910459), rtol=1e-5)


@pytest.mark.parametrize(("system", "grid", "keywords", "said"), [
    (A, {"q0": (0, 1, 2)}, {}, "must be a Grid"),
    (A, bf.Grid(q0=(-1, 0, 3)), {}, "missing: v0"),
    (bf.systems.impact_chain(n=2), bf.Grid(q0=(-1, 0, 3), v0=(-1, 1, 3)), {}, "missing: q1, v1"),
    (bf.System(1.0, 0.1, 1.0), bf.Grid(q0=(-1, 0, 3), v0=(-1, 1, 3)), {}, "is autonomous"),
    (3.0, bf.Grid(q0=(-1, 0, 3)), {}, "must be a System, or a map"),
    (bistable, bf.Grid(q0=(-1, 0, 3)), {"periods": 0}, "periods = 0"),
    (bistable, bf.Grid(q0=(-1, 0, 3)), {"samples": 1.5}, "samples = 1.5"),
    (bistable, bf.Grid(q0=(-1, 0, 3), at={"v0": 1.0}), {}, "fixes components"),
    (lambda x: x[:, :1], bf.Grid(q0=(-1, 0, 3), v0=(0, 1, 2)), {}, "must return states (k, 2)"),
])
def test_bad_requests_are_named(system, grid, keywords, said):
    with pytest.raises(ValueError) as error:
        cell_mapping(system, grid, **keywords)
    assert said in str(error.value)


def test_an_enormous_grid_says_its_memory_before_taking_it():
    with pytest.raises(MemoryError, match=r"1e\+12 cells; a map of its cells needs about \d+ TB.*write at most"):
        cell_mapping(A, bf.Grid(q0=(-1, 0, 10**6), v0=(-1, 1, 10**6)))


def test_one_cell():
    found = cell_mapping(A, bf.Grid(q0=(-2.5, 0, 1), v0=(-3, 3, 1)), periods=30)
    assert found.labels.shape == (1, 1) and [item.periods for item in found.attractors] == [1, 3]


def test_transient_groups_hold_the_saddle_that_edge_tracking_finds():
    grid = bf.Grid(q0=(-2.5, 0, 200), v0=(-3, 3, 200))
    found = cell_mapping(A, grid, periods=3, samples=3, audit=0)
    (saddle,) = found.saddles()
    assert saddle.success and saddle.stable is False and saddle.residual < 1e-12
    np.testing.assert_allclose(np.abs(saddle.multipliers), [2.24854477, 0.08723604], rtol=0, atol=1e-8)
    with pytest.raises(ValueError, match="saddles are solved for systems"):
        cell_mapping(bistable, bf.Grid(q0=(-1, 1, 5))).saddles()


def test_a_chaotic_attractor_has_a_density_where_its_motion_goes():
    system = bf.systems.impact_oscillator(zeta=0.05, omega=2.5, amplitude=8.0, gap=1.0, restitution=0.7)
    found = cell_mapping(system, bf.Grid(q0=(-9, 1, 120), v0=(-9, 9, 120)), samples=4, audit=100)
    assert [group.kind for group in found.groups] == [GroupKind.CHAOTIC] and found.audit.wrong == 0
    density = found.density(0)
    np.testing.assert_allclose(density.sum(), 1.0, rtol=0, atol=1e-12)
    cells = found.grid.cells_of(found.attractors[0].points)
    motion = np.bincount(cells, minlength=density.size) / len(cells)
    assert density.ravel()[np.unique(cells)].sum() > 0.9  # cells smear the attractor a little
    blocks = [values.reshape(12, 10, 12, 10).sum(axis=(1, 3)) for values in (density, motion.reshape(120, 120))]
    assert np.abs(blocks[0] - blocks[1]).sum() < 0.15


@pytest.mark.parametrize("size, draws", [(1, 1), (7, 1), (30, 1), (30, 2), (120, 1), (120, 3)])
def test_morse_graphs_of_random_chains_are_those_of_networkx(size, draws, rng):
    """Recurrent components of the condensation, and who reaches whom without a third between."""
    for _ in range(4):
        rows = np.repeat(np.arange(size), draws)
        images = rng.integers(-1, size, rows.size)
        images[rng.uniform(size=rows.size) < 0.2] = -1
        matrix = transition(rows, images, size)
        grid = bf.Grid(q0=(0.0, 1.0 * size, size))
        parts = components(matrix)
        closed = [k for k in range(parts.total) if parts.closed[k] and parts.label[size] != k]
        groups = [SimpleNamespace(cells=np.flatnonzero(parts.label[:size] == k)[::-1], attractor=n, kind=GroupKind.SPURIOUS)
                  for n, k in enumerate(closed) if n != 1]
        found = morse_graph(SimpleNamespace(_components=parts, _chain=matrix, grid=grid, groups=groups))
        whole = networkx.DiGraph(list(zip(*(end.tolist() for end in matrix.nonzero()), strict=True)))
        short = networkx.condensation(whole)
        recurrent = [k for k, content in short.nodes(data="members")
                     if len(content) > 1 or whole.has_edge(*[next(iter(content))] * 2)]
        reach = networkx.DiGraph()
        reach.add_nodes_from(recurrent)
        reach.add_edges_from((a, b) for a in recurrent for b in networkx.descendants(short, a) if b in reach)
        reach = networkx.transitive_reduction(reach)
        members = {k: frozenset(short.nodes[k]["members"]) for k in recurrent}
        sink = next(k for k in recurrent if size in members[k])
        entered = any(size in whole.successors(cell) for cell in range(size))
        if not entered:
            reach.remove_node(sink)
        own = {name: frozenset(content["numbers"].tolist()) if name != "left" else frozenset({size})
               for name, content in found.nodes(data=True)}
        assert set(own.values()) == {members[k] for k in reach} and found.graph["omitted"] == 0
        assert {(own[a], own[b]) for a, b in found.edges} == {(members[a], members[b]) for a, b in reach.edges}
        assert all(b == "left" or a > b for a, b in found.edges if a != "left") and not any(a == "left" for a, _ in found.edges)
        for name, content in found.nodes(data=True):
            if name == "left":
                continue
            cells = sorted(own[name])
            mine = [k for k, group in enumerate(groups) if set(group.cells.tolist()) == set(cells)]
            assert content["cells"] == len(cells) and content["period"] == period(matrix, np.array(cells))
            assert (content["low"], content["high"]) == ((cells[0] + 0.5,), (cells[-1] + 0.5,))
            assert content["attractor"] == (groups[mine[0]].attractor if mine else -1)
            assert content["kind"] == (str(GroupKind.SPURIOUS) if mine else "transient")
            assert content["closed"] == all(set(whole.successors(cell)) <= own[name] for cell in cells)
