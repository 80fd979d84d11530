"""Starts followed to attractors, mapped and begun, against loops over simulations: labels, periods, impacts, speeds, states."""
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.elements import Coulomb, ElasticStop, HarmonicForce, Jenkins, RigidStop
from bifurc.ensemble import initial_conditions, integrator, outcomes
from bifurc.ensemble.grid import Grid, place_of
from bifurc.ensemble.integrator import Cells, Images, Integrator, Targets
from bifurc.ensemble.outcomes import CellState
from bifurc.ensemble.period_map import Kernel, PeriodMap
from bifurc.ensemble.proximity import boxes
from bifurc.ensemble.region import Region
from bifurc.ensemble.section import Section
from bifurc.ensemble.section_integrator import SectionIntegrator

PLAIN = bf.systems.impact_oscillator(omega=1.4)
RICH = bf.System(np.diag([1.0, 1.5]), [[0.2, -0.05], [0.0, 0.25]], [[2.0, -0.6], [-0.6, 1.2]], [
    HarmonicForce(0.9), RigidStop(0.5, 0.6), ElasticStop(0.3, 4.0, 0.2, side=-1, dof=1), Coulomb(0.08, dof=1), Jenkins(0.8, 0.15)],
    omega=1.2)


def drawn(system, rng, count):
    scene = scene_of(system)
    X = rng.uniform(-1.0, 0.45, (count, scene.ns))
    X[:, scene.n:] *= 1.5
    return X


def targets(system, rng, stay=3):
    """Return points of an orbit with radii, and boxes around some sections of other motions."""
    scene = scene_of(system)
    scale = np.linspace(0.7, 1.6, scene.ns)
    orbit = bf.find_orbit(system)
    points = orbit.sections / scale
    far = np.array([bf.simulate(system, x, periods=6).sections[4:] for x in drawn(system, rng, 12)]).reshape(-1, scene.ns)
    keys = np.empty(len(far), np.uint64)
    boxes(far, 1.0 / scale, 0.4, keys)
    keys = np.unique(keys)
    return scale, Targets(1.0 / scale, points, np.full(len(points), 0.05**2), np.full(len(points), 7), 0.4, keys,
                          np.full(len(keys), 3), stay)


def twin(system, x, scale, T, most, limit):
    """Return label, periods, impacts, least speed, state, end of one start: period by period, from simulations."""
    known = dict(zip(T.keys.tolist(), T.keepers.tolist(), strict=True))
    try:
        motion = bf.simulate(system, x, periods=most, max_events=limit)
    except ValueError:
        return -1, 0, 0, np.inf, outcomes.OUTSIDE
    hits = [(e.time, 0.0 if e.kind == "chatter" else e.speed) for e in motion.events if e.kind in ("impact", "contact", "chatter")]
    visits = 0
    for k, y in enumerate(motion.sections[1:], 1):
        near = np.linalg.norm(y / scale - T.points, axis=1)**2 <= T.squares
        key = np.empty(1, np.uint64)
        boxes(y[None], T.inverse, T.width, key)
        visits = visits + 1 if int(key[0]) in known else 0
        label = int(T.owner[near.argmax()]) if near.any() else 3 if visits >= T.stay else -1
        if label >= 0:
            before = [speed for time, speed in hits if time < k * system.period]
            return label, k, len(before), min(before, default=np.inf), outcomes.REACHED
    return -1, most, len(hits), min((speed for _, speed in hits), default=np.inf), outcomes.UNSETTLED


@pytest.mark.parametrize("by", ["itself", "simulation"])
@pytest.mark.parametrize("system", [PLAIN, RICH], ids=["batch", "scalar"])
def test_starts_are_followed_as_simulations_say(system, by, rng):
    scale, T = targets(system, rng)
    most, found = 7, Integrator(scene_of(system), 2000)
    assert found.lean is (system is PLAIN) and found.compiled and found.chunk == (8192 if system is PLAIN else 512)
    if by == "simulation":
        found._module = found._scalar = None
    X = drawn(system, rng, 40)
    X[-1, 0] = 9.0
    ends = X.copy()
    cells = found.label(ends, T, most)
    seen = set()
    for i, x in enumerate(X):
        label, periods, impacts, speed, state = twin(system, x, scale, T, most, 2000)
        assert (cells.labels[i], cells.states[i], cells.periods[i], cells.impacts[i]) == (label, state, periods, impacts), i
        assert cells.speeds[i] == pytest.approx(speed, rel=1e-6, abs=1e-9)
        if state == outcomes.UNSETTLED:
            last = bf.simulate(system, x, periods=most).sections[-1]
            assert ends[i] == pytest.approx(last, abs=1e-7)
        seen.add(label)
    assert {-1, 3} <= seen or {-1, 7} <= seen


@pytest.mark.parametrize("by", ["itself", "simulation"])
@pytest.mark.parametrize("system", [PLAIN, RICH], ids=["batch", "scalar"])
def test_images_are_those_of_simulations(system, by, rng):
    found = PeriodMap(system)
    if by == "simulation":
        found._integrator._module = found._integrator._scalar = None
    X = drawn(system, rng, 25)
    X[-1, 0] = 9.0
    keep = X.copy()
    images = found.apply(X, periods=3)
    assert np.array_equal(X, keep) and images.outcomes[-1] == outcomes.OUTSIDE
    for i, x in enumerate(X[:-1]):
        motion = bf.simulate(system, x, periods=3)
        hits = [0.0 if e.kind == "chatter" else e.speed for e in motion.events if e.kind in ("impact", "contact", "chatter")]
        assert images.ends[i] == pytest.approx(motion.sections[-1], abs=1e-9)
        assert (images.outcomes[i], images.impacts[i]) == (outcomes.REACHED, len(hits))
        assert images.speeds[i] == pytest.approx(min(hits, default=np.inf), rel=1e-7, abs=1e-10)
    assert repr(found) == f"PeriodMap({system!r}, kernel {'batch' if system is PLAIN else 'scalar'})" and found.error == 0.0


def test_a_simulation_goes_on_from_block_to_block(rng, monkeypatch):
    """What it counts in blocks of 3 periods is what one simulation counts, an impact just behind the last section included."""
    monkeypatch.setattr(integrator, "BLOCK", 3)
    just_behind = 0
    for system in (PLAIN, RICH):
        found = Integrator(scene_of(system), 2000)
        found._module = found._scalar = None
        X = drawn(system, rng, 12)
        ends, carried = X.copy(), X.copy()
        cells, images = found.label(ends, Targets.none(X.shape[1]), 8), found.propagate(carried, 8)
        for i, x in enumerate(X):
            motion = bf.simulate(system, x, periods=9)
            hits = [(e.time / system.period, 0.0 if e.kind == "chatter" else e.speed) for e in motion.events
                    if e.kind in ("impact", "contact", "chatter")]
            before = [speed for time, speed in hits if time < 8]
            just_behind += sum(8 < time < 8 + 1.0 / system.period for time, _ in hits)
            assert cells.impacts[i] == images.impacts[i] == len(before) and cells.periods[i] == 8
            assert cells.speeds[i] == images.speeds[i] == pytest.approx(min(before, default=np.inf), rel=1e-6, abs=1e-9)
            assert ends[i] == pytest.approx(motion.sections[8], abs=1e-7) and np.array_equal(ends[i], carried[i])
        assert (cells.states == outcomes.UNSETTLED).all() and (images.outcomes == outcomes.REACHED).all()
    assert just_behind > 3


def test_a_target_met_in_a_later_block_is_reached_with_what_came_before_it(rng, monkeypatch):
    monkeypatch.setattr(integrator, "BLOCK", 2)
    found = Integrator(scene_of(RICH), 2000)
    found._module = found._scalar = None
    for x in drawn(RICH, rng, 6):
        motion = bf.simulate(RICH, x, periods=6)
        hits = [(e.time / RICH.period, 0.0 if e.kind == "chatter" else e.speed) for e in motion.events
                if e.kind in ("impact", "contact", "chatter")]
        T = Targets.none(len(x))._replace(points=motion.sections[[5]], squares=np.array([1e-16]), owner=np.array([4]))
        cells = found.label(x[None].copy(), T, 6)
        before = [speed for time, speed in hits if time < 5]
        assert (cells.labels[0], cells.states[0], cells.periods[0], cells.impacts[0]) == (4, outcomes.REACHED, 5, len(before))
        assert cells.speeds[0] == pytest.approx(min(before, default=np.inf), rel=1e-6, abs=1e-9)


def test_too_many_events_are_said_by_either(rng):
    for system in (PLAIN, RICH):
        for by in ("itself", "simulation"):
            found = PeriodMap(system, max_events=1)
            if by == "simulation":
                found._integrator._module = found._integrator._scalar = None
            X = drawn(system, rng, 12)
            images = found.apply(X, periods=4)
            for i, x in enumerate(X):
                motion = bf.simulate(system, x, periods=4, max_events=1)
                assert images.outcomes[i] == (outcomes.REACHED if motion.success else outcomes.CROWDED), (by, i)
            assert system is PLAIN or (images.outcomes == outcomes.CROWDED).any()


def test_the_limit_of_events_is_that_of_each_period():
    """A settled motion with as many events as are allowed, however long it is followed; with one less it ends at once."""
    system = bf.System(1.0, 0.1, 1.0, [HarmonicForce(0.9), RigidStop(0.4, 0.6), Jenkins(0.8, 0.15)], omega=1.2)
    motion = bf.simulate(system, np.zeros(3), periods=60)
    y, period = motion.final[None], system.period
    counts = [sum(k * period < e.time <= (k + 1) * period for e in motion.events) for k in range(40, 60)]
    most = max(counts)
    assert set(counts) == {most} and most >= 3 and PeriodMap(system).kernel == Kernel.SCALAR
    assert PeriodMap(system, max_events=most).apply(y, 12).outcomes.tolist() == [0]
    assert PeriodMap(system, max_events=most - 1).apply(y, 12).outcomes.tolist() == [CellState.TOO_MANY_EVENTS.code]


@pytest.mark.parametrize("given, words", [
    (np.zeros(2), "X has shape .2,.; it must be .N, 2., one start a row"), (np.zeros((3, 4)), "X has shape .3, 4."),
    (np.full((1, 2), np.nan), "X contains states that are not finite")])
def test_starts_that_are_none(given, words):
    with pytest.raises(ValueError, match=words):
        PeriodMap(PLAIN).apply(given)
    for periods in (0, -1, 1.5, True):
        with pytest.raises(ValueError, match=f"periods = {periods} is not allowed; it must be a whole number of at least 1"):
            PeriodMap(PLAIN).apply(np.zeros((1, 2)), periods)
    for steps in (0, 2.5, True):
        with pytest.raises(ValueError, match=f"steps = {steps} is not allowed; it must be a whole number of at least 1"):
            PeriodMap(PLAIN, steps=steps)
    with pytest.raises(ValueError, match="is autonomous; a map over forcing periods needs an excitation"):
        PeriodMap(bf.systems.belt_oscillator())


def test_the_mode_of_a_start_is_that_of_the_simulation(rng):
    """Random starts, on a stop, at rest under friction, beyond a stop, with overloaded sliders."""
    for system in (PLAIN, RICH):
        scene = scene_of(system)
        X = drawn(system, rng, 60)
        X[:8, 0], X[8:16, scene.n + scene.n - 1] = 0.5 if system is RICH else 1.0, 0.0
        X[16:20, 0] = 2.0
        if scene.ns > 2 * scene.n:
            X[:, -1] = X[:, 0] + rng.uniform(-0.1, 0.1, len(X))
            X[20:40, -1] = X[20:40, 0] + rng.choice([-1.0, 1.0], 20) * rng.uniform(0.2, 0.9, 20)
        Y, modes = X.copy(), np.empty(len(X), np.int64)
        initial_conditions.unloaded(scene, Y)
        initial_conditions.begin(scene.tables, np.array(list(scene.start_modes())), Y, modes)
        told = 0
        for x, y, m in zip(X, Y, modes, strict=True):
            try:
                motion = bf.simulate(system, x, duration=0.0)
            except ValueError as error:
                assert "beyond the stop" in str(error) and m in (outcomes.BEYOND, outcomes.UNCLEAR)
                continue
            assert m in (outcomes.UNCLEAR, motion.recorded.rows[0, 2])
            if m >= 0:
                told += 1
                place = scene.keys[m][-1] == "stick" if scene.ns > 2 * scene.n else True
                assert not place or y == pytest.approx(motion.recorded.after[0], abs=1e-12)
        assert told > 15 and (system is RICH or (modes == outcomes.BEYOND).any())


def test_states_from_named_components():
    scene = scene_of(RICH)
    found = initial_conditions.states_at(scene, ("v1", "q0"), {"q1": 0.3}, np.array([[1.0, 2.0], [3.0, 4.0]]))
    assert found.tolist() == [[2.0, 0.3, 0.0, 1.0, 2.0], [4.0, 0.3, 0.0, 3.0, 4.0]]  # the slider follows its spring
    given = initial_conditions.states_at(scene, ("q0", "w0"), {}, np.array([[1.0, 2.0]]))
    assert given.tolist() == [[1.0, 0.0, 0.0, 0.0, 2.0]] and given.flags.c_contiguous
    assert initial_conditions.states_at(scene, ("q0",), {"w0": 0.5}, np.array([[1.0]])).tolist() == [[1.0, 0.0, 0.0, 0.0, 0.5]]
    assert [place_of(name, 2, 5) for name in ("q1", "v0", "v1", "w0")] == [1, 2, 3, 4]
    for name, words in (("q2", "q2"), ("w1", "w1"), ("x", "'x' is unknown")):
        with pytest.raises(ValueError, match=words):
            place_of(name, 2, 5)
    with pytest.raises(ValueError, match="it has 2 degrees of freedom: q0 .. q1 and v0 .. v1, memory w0 .. w0"):
        place_of("v2", 2, 5)


def test_cells_of_which_nothing_is_known():
    cells = Cells.blank(3)
    assert cells.labels.tolist() == [-1] * 3 and cells.states.tolist() == [outcomes.ASK] * 3
    assert cells.periods.tolist() == cells.impacts.tolist() == [0] * 3 and np.isinf(cells.speeds).all()
    assert {array.dtype.name for array in cells[:4]} == {"int64"} and Cells.blank(1, 4, 2)[0][0] == 4
    assert [state.code for state in CellState] == list(range(6)) and all(state.sentence.endswith(".") for state in CellState)


def test_coded_labels_tell_what_is_no_start_from_what_leaves_all_bounds():
    states = np.array([CellState.ATTRACTED, CellState.OUTSIDE, CellState.DIVERGED, CellState.UNSETTLED])
    codes = np.array([CellState(state).code for state in states])
    assert outcomes.coded(np.array([5, -1, -1, -1]), codes).tolist() == [5, outcomes.NO_START, outcomes.INFINITY, -1]
    assert len({outcomes.NO_START, outcomes.INFINITY, -1}) == 3 and max(outcomes.NO_START, outcomes.INFINITY) < 0


# ---- sections ------------------------------------------------------------------------------------------------------------------


def test_crossings_at_events_and_on_the_value():
    """A jump over the value counts where it is, with the state before; what stays on it has passed when it leaves beyond."""
    ball = bf.System(1.0, 0.0, 0.0, [bf.elements.ConstantForce(-1.0), RigidStop(0.0, 0.5, side=-1)])
    motion = bf.simulate(ball, (2.0, 0.0), duration=5.0)  # falls for 2, bounces with 1 and .5
    rising = Section("v0", 0.0, 1).crossings(motion)
    first = motion.events[0]
    assert rising[0][0] == first.time == 2.0 and rising[1][0].tolist() == pytest.approx([0.0, -2.0])
    falling = Section("v0", 0.0, -1).crossings(motion)
    assert falling[0][0] == pytest.approx(3.0, abs=1e-12) and falling[1][0] == pytest.approx([0.5, 0.0], abs=1e-12)
    both = Section("v0", 0.0, 0).crossings(motion)
    assert both[0] == pytest.approx(np.sort(np.concatenate([rising[0], falling[0]])), abs=1e-12)
    stick = bf.simulate(bf.systems.belt_oscillator(), (0.0, 0.3), duration=25.0)
    assert sum(e.kind == "stick" for e in stick.events) > 2  # it comes from below and leaves below
    assert all(Section("v0", 0.3, direction).crossings(stick)[0].size == 0 for direction in (-1, 0, 1))
    none = Section("q0", 99.0).crossings(motion)
    assert none[0].shape == (0,) and none[1].shape == (0, 2)
    assert Section("v0", 1, -1).to_record() == {"coordinate": "v0", "value": 1.0, "direction": -1}
    assert Section("v1").place(scene_of(RICH)) == 3
    for given, words in (((3,), "coordinate = 3"), (("x 1",), "'x 1' is unknown"), (("q0", np.nan), "Section: value = nan"),
                         (("q0", 0.0, 2), "direction = 2")):
        with pytest.raises(ValueError, match=words):
            Section(*given)


def test_starts_without_a_clock_are_followed_from_section_to_section(rng):
    """A cubic limit cycle that is known from a long simulation; returns are counted by the crossings before it is near."""
    system = bf.systems.belt_oscillator()
    scene, section, unit = scene_of(system), Section("v0", 0.0, -1), 2.0 * math.pi
    cycle = section.crossings(bf.simulate(system, (-0.5, 0.3), duration=80.0))[1][-1]
    none = np.empty(0, np.uint64)
    T = Targets(np.ones(2), cycle[None], np.array([1e-6]), np.array([5]), 0.1, none, np.empty(0, np.int64))
    found = SectionIntegrator(scene, 100, section, unit)
    X = np.array([[-0.5, 0.3], [1.5, -0.4], [1.6, -1.0]])
    ends = X.copy()
    cells = found.label(ends, T, 40)
    for i, x in enumerate(X):
        motion = bf.simulate(system, x, duration=60.0)
        points = section.crossings(motion)[1]
        count = int(np.argmax(np.abs(points - cycle).max(axis=1) < 7e-4)) + 1
        assert (cells.labels[i], cells.states[i]) == (5, outcomes.REACHED) and cells.periods[i] in (count, count - 1, count + 1)
        assert cells.impacts[i] == 0 and np.isinf(cells.speeds[i])
    lost = Targets(np.ones(2), cycle[None] + 9.0, np.array([1e-6]), np.array([5]), 0.1, none, np.empty(0, np.int64))
    never = found.label(X.copy(), lost, 10)
    assert (never.labels == -1).all() and (never.states == outcomes.UNSETTLED).all() and (never.periods >= 10).all()


def test_where_the_following_without_a_clock_ends(rng):
    """Impacts before it, the state at the end of its block, boxes that must be met several times in a row, and every failure."""
    ball = bf.System(1.0, 0.0, 4.0, [bf.elements.ConstantForce(1.0), RigidStop(0.5, 0.9)])  # about .25, up to .5
    scene, section, unit = scene_of(ball), Section("v0", 0.0, 1), 2.0
    T = Targets(np.array([2.0, 1.0]), np.array([[9.0, 9.0], [2.0, 3.0]]), np.array([0.01, 0.01]), np.array([4, 6]), 0.1,
                np.empty(0, np.uint64), np.empty(0, np.int64))
    found = SectionIntegrator(scene, 50, section, unit)
    assert (found.lean, found.error, found.steps, found.chunk) == (False, 0.0, None, 512)
    X = np.array([[-0.9, 0.2], [-0.2, -0.7], [0.3, 0.1], [0.7, 0.0]])
    ends = X.copy()
    cells = found.label(ends, T, 9)
    assert cells.states.tolist() == 3 * [outcomes.UNSETTLED] + [outcomes.OUTSIDE] and (cells.labels == -1).all()
    assert np.array_equal(ends[3], X[3]) and cells.periods[3] == 0
    for i in range(3):
        whole = bf.simulate(ball, X[i], duration=4 * 16.0)
        passes = section.crossings(whole)[0]
        stops = [stop for stop in (16.0, 32.0) if (passes <= stop).sum() >= 9 or stop == 32.0]  # 9 periods: two blocks at most
        hits = [e.speed for e in whole.events if e.time <= stops[0]]
        assert ends[i] == pytest.approx(whole(stops[0]), abs=1e-8)
        assert (cells.periods[i], cells.impacts[i]) == ((passes <= stops[0]).sum(), len(hits))
        assert cells.speeds[i] == pytest.approx(min(hits, default=np.inf), rel=1e-8)
    # the point of a target, by its owner: the second return of the first start, scaled
    times, points = section.crossings(bf.simulate(ball, X[0], duration=16.0))
    at = T._replace(points=np.array([[9.0, 9.0], points[1] * T.inverse]), squares=np.array([0.01, 1e-10]))
    cells = found.label(X[:1].copy(), at, 9)
    hits = [e.speed for e in bf.simulate(ball, X[0], duration=times[1]).events]
    assert (cells.labels[0], cells.states[0], cells.periods[0], cells.impacts[0]) == (6, outcomes.REACHED, 2, len(hits))
    assert cells.speeds[0] == pytest.approx(min(hits), rel=1e-8)
    # boxes around the returns 1 .. 5: met `stay` times in a row, of one keeper
    keys = np.empty(5, np.uint64)
    boxes(points[:5], T.inverse, 0.1, keys)
    for owners, stay, wanted in ((5 * [3], 1, (3, 1)), (5 * [3], 3, (3, 3)), ([3, 8, 8, 8, 8], 2, (8, 4))):
        table = dict(zip(keys.tolist(), owners, strict=True))
        assert len(table) == 5
        order = np.argsort(keys)
        cells = found.label(X[:1].copy(), T._replace(keys=keys[order], keepers=np.array(owners)[order], stay=stay), 9)
        run, guest, expected = 0, -1, None
        for k, point in enumerate(points):
            key = np.empty(1, np.uint64)
            boxes(point[None], T.inverse, 0.1, key)
            keeper = table.get(int(key[0]), -1)
            run = run + 1 if keeper >= 0 and (keeper == guest or run == 0) else 0
            guest = keeper
            if run >= stay:
                expected = (keeper, k + 1)
                break
        assert (cells.labels[0], cells.periods[0]) == expected == wanted
    crowded = SectionIntegrator(scene, 1, section, unit).label(np.array([[-0.9, 6.0]]), T, 9)  # more than 8 impacts in a block
    assert crowded.states.tolist() == [outcomes.CROWDED] and crowded.labels[0] == -1
    away = bf.System(1.0, 0.0, -100.0, [RigidStop(0.5, 0.9)])
    lost = SectionIntegrator(scene_of(away), 50, Section("v0"), 10.0).label(np.array([[-1.0, -1.0]]), T, 9)
    assert lost.states.tolist() == [outcomes.DIVERGED]
    still = SectionIntegrator(scene, 50, section, unit).label(
        np.array([[0.25, 0.0]]), T._replace(points=np.array([[0.5, 0.0]]), squares=np.array([1e-12]), owner=np.array([2])), 9)
    assert (still.labels[0], still.periods[0], still.states[0]) == (2, 0, outcomes.REACHED)  # at rest, by its last state


# ---- grids and regions ---------------------------------------------------------------------------------------------------------


def test_grids_count_in_their_units():
    grid = Grid(q0=(-1, 3, 8), v0=(0, 3, 3), at={"q1": 2}, periodic=["v0"])
    assert grid.widths.tolist() == [0.5, 1.0] and grid.centres(0)[:2].tolist() == [-0.75, -0.25] and grid.size == 24
    assert grid.points(np.array([0, 4]), 0.25).tolist() == [[-0.875, 0.25], [-0.375, 1.25]]
    assert grid.wrapped(np.array([[9.0, -0.5], [0.0, 3.0]])).tolist() == [[9.0, 2.5], [0.0, 0.0]]
    assert grid.places(2, 4) == (0, 2) and grid.base(2, 4).tolist() == [0.0, 2.0, 0.0, 0.0]
    assert grid.to_record() == {"ranges": {"q0": [-1.0, 3.0, 8], "v0": [0.0, 3.0, 3]}, "at": {"q1": 2.0}, "periodic": ["v0"]}
    assert Grid.from_record(grid.to_record()) == grid and hash(grid) != hash(Grid(q0=(-1, 3, 8), v0=(0, 3, 3), at={"q1": 2}))
    points = np.array([[0.1, 0.2]])
    assert Grid(q0=(0, 1, 2), v0=(0, 1, 2)).wrapped(points) is points and "periodic" not in Grid(q0=(0, 1, 2)).to_record()
    assert repr(grid) == "Grid(q0=(-1, 3, 8), v0=(0, 3, 3), at={'q1': 2.0}, periodic=('v0',))"
    for wrong in (3, [1.0]):
        with pytest.raises(ValueError, match="at = .* is not allowed; it must be a mapping of names"):
            Grid(q0=(0, 1, 2), at=wrong)


def test_memory_is_refused_beyond_half_of_the_machine(monkeypatch):
    from bifurc.ensemble import grid as module

    monkeypatch.setattr(module, "_memory", lambda: 2e6)
    grid = Grid(q0=(0, 1, 100), v0=(0, 1, 100))
    grid.require(100.0, "a map")
    with pytest.raises(MemoryError, match=r"1e\+04 cells; a map needs about 1.01 MB, and half of this machine's memory, 1 MB, is "
                                          r"allowed: write at most 9.9e\+03 cells"):
        grid.require(101.0, "a map")
    assert [module._bytes(size) for size in (5e2, 2e6, 3.2e9, 4e12)] == ["0.5 kB", "2 MB", "3.2 GB", "4 TB"]


def test_regions_keep_what_they_are_given():
    region = Region({"q0": (-3, 1), "v0": (-4, 4)}, {"q1": 0.5})
    assert repr(region) == "Region(q0=(-3, 1), v0=(-4, 4), at={'q1': 0.5})"
    assert repr(Region({"q0": (0, 1)})) == "Region(q0=(0, 1))"
    again = Region.from_record(region.to_record())
    assert again.ranges == region.ranges == {"q0": (-3.0, 1.0), "v0": (-4.0, 4.0)} and again.at == {"q1": 0.5}
    two = scene_of(bf.systems.impact_chain(n=2))
    assert not np.array_equal(region.starts(two, 5, 1), region.starts(two, 5, 2)) and region.starts(two, 0, 1).shape == (0, 4)
    for given, words in ((({},), "region = {} is not allowed"), ((3,), "region = 3"),
                         (({"x 1": (0, 1)},), "'x 1' is unknown"),
                         (({"q0": (1, 1)},), r"two different numbers, \(low, high\)"),
                         (({"q0": 3},), r"two different numbers, \(low, high\)"), (({"q0": (1, 0)},), "low bound must be below"),
                         (({"q0": (0, np.inf)},), "must be finite"),
                         (({"q0": (0, 1)}, {"q0": 1}), "at fixes q0, which has a range"),
                         (({"q0": (0, 1)}, 3), "at = 3 is not allowed"), (({"q0": (0, 1)}, {"1z": 1}), "'1z' is unknown")):
        with pytest.raises(ValueError, match=words):
            Region(*given)


@pytest.mark.parametrize(("speed", "told"), [(0.3, True), (-0.3, True), (0.0, False)])
def test_a_start_beyond_a_stop_is_told_where_everything_else_is_clear(speed, told):
    """A little beyond: that is told where it slides; without speed friction sticks or slips, which is left to the caller."""
    system = bf.System(1.0, 0.1, 2.0, [bf.elements.HarmonicForce(0.3), bf.elements.RigidStop(0.5, 0.7), bf.elements.Coulomb(1.0)],
                       omega=1.0)
    scene = scene_of(system)
    X, modes = np.array([[0.6, speed]]), np.empty(1, np.int64)
    initial_conditions.begin(scene.tables, np.array(list(scene.start_modes())), X, modes)
    assert modes[0] == (outcomes.BEYOND if told else outcomes.UNCLEAR)


@pytest.mark.parametrize(("beyond", "told"), [(1e-13, False), (1e-11, False), (1e-7, True)])
def test_a_start_beyond_a_stop_by_rounding_is_one(beyond, told):
    """As for a single motion: it is put on the stop, which no kernel does; a little further it lies in the stop."""
    system = bf.System(1.0, 0.1, 2.0, [bf.elements.HarmonicForce(0.3), bf.elements.RigidStop(0.5, 0.7)], omega=1.0)
    scene = scene_of(system)
    X, modes = np.array([[0.5 + beyond, -0.3]]), np.empty(1, np.int64)
    initial_conditions.begin(scene.tables, np.array(list(scene.start_modes())), X, modes)
    assert modes[0] == (outcomes.BEYOND if told else outcomes.UNCLEAR)
    if not told:
        assert bf.simulate(system, X[0], periods=0.1).success


def test_a_complete_chattering_arrives_without_speed_and_counts_once():
    """As the simulation has it, which takes what kernels leave open: all impacts in all blocks, the slowest of them."""
    system = bf.System(1.0, 0.0416, 1.0, [HarmonicForce(0.945), RigidStop(0.3, 0.2), Jenkins(1.5, 0.2)], omega=0.5)
    scene = scene_of(system)
    seen = set()
    for y in ((0.0, 0.0, 0.0), (0.25, 1.5, 0.2), (-0.4, 0.0, -0.4)):
        for periods in (1, 2, 33):
            blank = [np.full(1, value, np.int64) for value in (outcomes.ASK, 7)]
            images = Images(np.zeros((1, 3)), *blank, np.full(1, 3.0))
            Integrator(scene, 2000)._propagate(0, np.array(y), images, periods)
            motion = bf.simulate(system, y, periods=periods)
            hits = [event for event in motion.events if event.kind in ("impact", "chatter")]
            chatters = any(event.kind == "chatter" for event in hits)
            assert images.impacts[0] == len(hits) > 0 and images.outcomes[0] == outcomes.REACHED
            assert images.speeds[0] == (0.0 if chatters else pytest.approx(min(event.speed for event in hits), rel=1e-9))
            assert images.ends[0] == pytest.approx(motion.final, abs=1e-9)
            seen.add(chatters)
    assert True in seen


def test_chaos_is_told_by_what_lies_in_the_section_alone():
    """A block of simulation ends anywhere: that its end lies in a box says nothing."""
    system, y = bf.System(1.0, 0.0, 1.0), np.array([0.0, 1.0])
    unit, width = 0.3, 0.01
    motion = bf.simulate(system, y, duration=40 * unit)
    ends = motion(8 * unit * np.arange(1, 6))
    for points, reached in ((ends, False), (np.array([[0.305, np.sqrt(1.0 - 0.305**2)]]), True)):
        keys = np.empty(len(points), np.uint64)
        boxes(np.ascontiguousarray(points), np.ones(2), width, keys)
        targets = Targets.none(2)._replace(width=width, keys=np.sort(keys), keepers=np.zeros(len(keys), np.int64), stay=1)
        found = SectionIntegrator(scene_of(system), 100, Section("q0", 0.305), unit).label(y[None].copy(), targets, 40)
        assert (found.states[0] == CellState.ATTRACTED.code) == reached and found.labels[0] == (0 if reached else -1)


def test_without_a_clock_the_limit_of_events_is_one_of_a_natural_period():
    """Two elastic impacts in each, for as long as the motion is followed."""
    system = bf.System(1.0, 0.0, 1.0, [RigidStop(0.0, 1.0)])
    for limit, state in ((3, CellState.UNSETTLED), (1, CellState.TOO_MANY_EVENTS)):
        integrator = SectionIntegrator(scene_of(system), limit, Section("v0", direction=1), 2.0 * math.pi)
        assert integrator.label(np.array([[-0.5, 0.3]]), Targets.none(2), 16).states[0] == state.code


@pytest.mark.parametrize("system, by", [(PLAIN, "batch"), (RICH, "scalar"), (PLAIN, "simulation")],
                         ids=["batch", "scalar", "simulation"])
def test_labels_and_images_of_starts_beyond_a_stop_say_so(system, by, rng):
    """Every other start is no start; the others are followed as they are alone."""
    found = Integrator(scene_of(system), 2000)
    if by == "simulation":
        found._module = found._scalar = None
    gap = next(element.gap for element in system.elements if isinstance(element, RigidStop))
    good = drawn(system, rng, 6)
    X = np.repeat(good, 2, axis=0)
    X[1::2, 0] = gap + rng.uniform(0.1, 1.0, 6)
    alone, carried = good.copy(), X.copy()
    whole, apart = found.label(X, Targets.none(X.shape[1]), 4), found.label(alone, Targets.none(X.shape[1]), 4)
    assert (whole.states[1::2] == outcomes.OUTSIDE).all() and np.array_equal(whole.states[::2], apart.states)
    assert (apart.states == outcomes.UNSETTLED).all() and np.array_equal(X[::2], alone)
    images = found.propagate(carried, 4)
    assert (images.outcomes[1::2] == outcomes.OUTSIDE).all() and (images.outcomes[::2] == outcomes.REACHED).all()


def test_memory_follows_what_it_is_fixed_to_in_modes_reached_early_and_late():
    """A spring that slips is stretched by its limit, z = q - limit/kt with the sign of the slip; one that sticks keeps z."""
    n, kt, limit = 4, 2.0, 0.4
    scene = scene_of(bf.System(np.eye(n), np.eye(n), np.eye(n), [Jenkins(kt, limit, dof=k) for k in range(n)]))
    following, identity, signs = Integrator(scene, 100), np.eye(scene.ns + scene.nw), {"slip+": -1.0, "slip-": 1.0}
    early = len(scene.tables.n_guards)
    for keys in (("stick", "slip+", "stick", "stick"), ("slip-", "stick", "stick", "slip+"), ("slip-",) * n):
        m = scene.index(keys)
        wanted = identity[2 * n:3 * n].copy()
        for k, key in enumerate(keys):
            if key in signs:
                wanted[k] = identity[k]
                wanted[k, scene.ns] = signs[key] * limit / kt
        np.testing.assert_allclose(following._followers(scene.tables)[m], wanted, atol=1e-15)
    assert len(scene.tables.n_guards) > early
