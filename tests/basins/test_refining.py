"""Refinement of maps and judging of groups of cells, with plain functions in the place of the motion."""
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc.basins.attractors.attractors import ChaoticAttractor, SampledAttractor
from bifurc.basins.cells import compute
from bifurc.basins.cells.cell_map import CellFate, GroupKind
from bifurc.basins.maps import refinement
from bifurc.ensemble.integrator import Cells
from bifurc.ensemble.outcomes import NO_START, REACHED, UNSETTLED

SIDE, STEP = 96, 8


def disk(points):
    """1 inside a circle, else 0."""
    return (np.hypot(points[:, 0] - 0.45, points[:, 1] - 0.55) < 0.28).astype(int)


def speck(points):
    """A second region smaller than the coarse cells, away from the first."""
    return np.where(np.hypot(points[:, 0] - 0.9, points[:, 1] - 0.12) < 0.02, 2, disk(points))


def round_the_edge(points):
    """A strip over both ends of a periodic component."""
    return (np.minimum(points[:, 0], 1.0 - points[:, 0]) < 0.13).astype(int)


@pytest.fixture
def refining(monkeypatch):
    """A refinement in the making of a label that is a function of the start, and the cells that it follows."""
    def make(truth, periodic=(), side=SIDE, seed=0):
        grid = bf.Grid(q0=(0.0, 1.0, side), v0=(0.0, 1.0, side), periodic=periodic)
        followed = []
        monkeypatch.setattr(refinement, "Labeller", lambda *a: None)
        monkeypatch.setattr(refinement, "Integrator", lambda *a: None)
        monkeypatch.setattr(refinement, "targets_of", lambda *a: None)
        monkeypatch.setattr(refinement, "states_at", lambda scene, names, at, points: points)

        def label(labeller, states, *more):
            followed.extend(grid.cells_of(states).tolist())
            return cells_of(truth(states))
        monkeypatch.setattr(refinement, "label_starts", label)
        whole = np.arange(grid.size).reshape(grid.shape)[::STEP, ::STEP]
        coarse = cells_of(truth(grid.points(whole.ravel())))
        known = SimpleNamespace(**{name: value.reshape(whole.shape) for name, value in coarse._asdict().items()},
                                options={"max_events": 1, "max_periods": 1, "seed": seed}, attractors=(), radii=(), scale=None)
        job = SimpleNamespace(scene=None, run=None, elements=())
        return refinement._Refining(known, grid, STEP, job, None, None), grid, followed, truth(grid.points(np.arange(grid.size)))
    return make


def cells_of(labels):
    made = Cells.blank(len(labels), -1, UNSETTLED)
    made.labels[:], made.states[:] = labels, REACHED
    made.periods[:], made.impacts[:] = 7, 3
    return made


@pytest.mark.parametrize("truth, periodic", [(disk, ()), (round_the_edge, ("q0",)), (round_the_edge, ())])
def test_a_refined_map_is_the_map_of_all_cells_where_boundaries_are_smooth(refining, truth, periodic):
    work, grid, followed, labels = refining(truth, periodic)
    audit = work.refine()
    np.testing.assert_array_equal(work.cells.labels, labels)
    assert (work.cells.states == REACHED).all()
    assert len(followed) == len(set(followed))  # none twice
    lattice = (SIDE // STEP)**2
    assert int(work.known.sum()) == len(followed) + lattice and work.known.mean() < 0.5
    asked = int(np.ceil(refinement.CHECKED * grid.size))
    assert (audit.cells, audit.wrong) == (asked, 0)
    inherited = ~work.known
    assert (work.cells.periods[inherited] == -1).all() and (work.cells.impacts[inherited] == -1).all()
    assert np.isinf(work.cells.speeds[inherited]).all() and (work.cells.periods[~inherited] == 7).all()


def test_no_inherited_label_touches_another_and_what_is_missed_is_counted(refining, monkeypatch):
    monkeypatch.setattr(refinement, "CHECKED", 0.02)
    whole = 0
    for seed in range(6):
        work, grid, followed, labels = refining(speck, seed=seed)
        audit = work.refine()
        numbers = np.arange(grid.size).reshape(grid.shape)
        beside = refinement.mixed(work.codes(numbers), grid).ravel()
        if (work.cells.labels == 2).any() and not audit.wrong:
            assert work.known[beside].all()
            np.testing.assert_array_equal(work.cells.labels, labels)  # a seed is followed to the whole region
            whole += 1
        assert audit.cells == int(np.ceil(0.02 * grid.size))
        if audit.wrong:
            assert np.count_nonzero(work.cells.labels[work.known] != labels[work.known]) == 0
        assert len(followed) < grid.size
    assert whole > 0


# groups of cells

class Judge:
    """Two attractors on a line of cells: what a state leads to is given by a function."""

    def __init__(self, attractors, points, labels, rate=0.0):
        self.attractors, self._points, self._labels, self.rate = attractors, points, labels, rate
        self.searched, self.sorted = [], 0

    def search(self, states):
        self.searched.append(states)

    def sort(self):
        self.sorted += 1

    def label(self, states):
        return np.array([self._labels(s) for s in states])

    def points(self, k):
        return np.array(self._points[k], float)

    def contraction(self, k, periods):
        return self.rate


GRID = bf.Grid(q0=(0.0, 10.0, 10), v0=(0.0, 1.0, 1))


def periodic(p):
    return SimpleNamespace(periods=p)


def judged(judge, lists, lengths, simple, periods=1):
    return compute._judged(judge, GRID, periods, simple, [np.array(cells) for cells in lists], lengths, GRID.points)


def test_groups_belong_to_the_attractor_they_reach_and_hold_it_or_not():
    """Cells 0 .. 9 along q0; one attractor at 2.5, another one at 7.5."""
    judge = Judge([periodic(1), periodic(1)], [[[2.5, 0.5]], [[7.5, 0.5]]], lambda s: int(s[0] > 5.0))
    found = judged(judge, [[2], [6, 7], [9], [0, 9]], [1, 1, 1, 1], simple=False)
    assert [g.kind for g in found] == [GroupKind.PERIODIC, GroupKind.PERIODIC, GroupKind.SPURIOUS, GroupKind.SPURIOUS]
    assert [g.attractor for g in found][:3] == [0, 1, 1]
    assert judge.sorted == 1 and len(judge.searched) == 1
    merged = judged(judge, [[2, 7]], [1], simple=False)
    assert merged[0].kind is GroupKind.MERGED and merged[0].attractor == -1
    lost = Judge([periodic(1)], [[[2.5, 0.5]]], lambda s: -1)
    assert judged(lost, [[2]], [1], simple=False)[0].kind is GroupKind.UNCONFIRMED
    gone = Judge([periodic(1)], [[[2.5, 0.5]]], lambda s: -2)
    assert [(g.kind, g.attractor) for g in judged(gone, [[2]], [1], simple=False)] == [(GroupKind.SPURIOUS, -1)]
    nothing = Judge([], [], None)
    assert judged(nothing, [], [], simple=True) == [] and nothing.sorted == 1


def test_of_simple_cycles_the_nearest_is_the_attractor_and_a_weak_one_has_a_wide_reach():
    at = [[[2.5, 0.5]]]
    judge = Judge([periodic(1)], at, lambda s: 0)
    found = judged(judge, [[2], [3], [4, 5]], [1, 1, 2], simple=True)
    assert [g.kind for g in found] == [GroupKind.PERIODIC, GroupKind.SPURIOUS, GroupKind.SPURIOUS]
    assert all(g.attractor == 0 for g in found)
    far = judged(Judge([periodic(1)], at, lambda s: 0), [[6]], [1], simple=True)
    assert far[0].kind is GroupKind.SPURIOUS  # four cells away: 1 + sqrt(2) / 2 are told apart
    weak = judged(Judge([periodic(1)], at, lambda s: 0, rate=0.8), [[6]], [1], simple=True)
    assert weak[0].kind is GroupKind.PERIODIC  # 1 + sqrt(2) / 2 / .2
    # of period 4 under two periods a mapping: two cycles of two cells
    twice = judged(Judge([periodic(4)], [[[2.5, 0.5], [4.5, 0.5]]], lambda s: 0), [[2, 3], [4, 5], [1], [2]], [2, 2, 1, 2],
                   simple=True, periods=2)
    assert [g.kind for g in twice].count(GroupKind.PERIODIC) == 2 and twice[2].kind is GroupKind.SPURIOUS


def test_distances_in_cells_go_the_short_way_round(rng):
    for around in ((), ("q0",)):
        grid = bf.Grid(q0=(0.0, 10.0, 10), v0=(-1.0, 1.0, 4), periodic=around)
        points, cells = rng.uniform((0.0, -1.0), (10.0, 1.0), (5, 2)), np.array([0, 13, 38])
        least = np.inf
        for p in points:
            for c in grid.points(cells):
                dq, dv = abs(p[0] - c[0]) / 1.0, abs(p[1] - c[1]) / 0.5
                least = min(least, np.hypot(min(dq, 10.0 - dq) if around else dq, dv))
        assert compute._apart(grid, points, cells) == pytest.approx(least, rel=1e-12)


def test_an_audit_counts_wrong_and_missing_labels(rng):
    fates = np.full(10, CellFate.ATTRACTED.code)
    fates[9] = CellFate.OUTSIDE.code
    labels = np.array([0, 0, 0, 1, 1, -1, -1, 0, 1, 0])
    direct = np.array([0, 1, -1, 1, 1, 1, -1, NO_START, 0, 1])
    made = SimpleNamespace(options={"seed": 0}, fates=fates, labels=labels, grid=GRID)
    judge = SimpleNamespace(label=lambda states: direct[GRID.cells_of(states)])
    # wrong: 1, 2, 8; missing: 5; 7 is no start, 9 is not asked
    assert tuple(compute._audit(judge, made, lambda points: points, 100)) == (8, 3, 1)
    few = compute._audit(judge, made, lambda points: points, 4)
    assert few[0] <= 4
    none = SimpleNamespace(options={"seed": 0}, fates=np.full(10, CellFate.OUTSIDE.code), labels=labels, grid=GRID)
    assert tuple(compute._audit(judge, none, lambda points: points, 5)) == (0, 0, 0)


def test_cells_asked_of_a_large_group_are_spread_over_it():
    cells = np.arange(100, 1100)
    some = compute._some(cells)
    assert len(some) == compute.ASKED and some[0] == 100 and some[-1] == 1099 and np.ptp(np.diff(some)) <= 1
    np.testing.assert_array_equal(compute._some(cells[:5]), cells[:5])


def test_kinds_of_attractors():
    chaotic = object.__new__(ChaoticAttractor)
    assert issubclass(ChaoticAttractor, SampledAttractor)
    assert compute._kind(SimpleNamespace(attractors=[chaotic, periodic(1)]), 0) is GroupKind.CHAOTIC
    assert compute._kind(SimpleNamespace(attractors=[chaotic, periodic(1)]), 1) is GroupKind.PERIODIC


def test_wrong_labels_are_a_share_of_the_cells_that_were_not_followed():
    """Of four cells one was followed: what is wrong among the inherited ones is wrong among three of four."""
    evaluated = np.array([[True, False], [False, False]])
    missed = refinement.Audit(400, 100)
    made = refinement.Refinement(None, refinement.RefinementStatus.REFINED, evaluated, 0.3, 1.0, missed)
    low, high = missed.bounds
    assert 0.0 < low < 0.25 < high and f"of all cells {75 * low:.2g} to {75 * high:.2g} % have a wrong label" in made.message
