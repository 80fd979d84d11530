"""Sweeps: what is found against independent searches, the same bits from every executor, resumed after interrupts."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.basins.attractors.attractors import same
from bifurc.basins.attractors.matching import Links, follow
from bifurc.basins.sweeps import attractor_sweep as sweeps
from bifurc.compose.scene import scene_of
from bifurc.ensemble.region import Region
from bifurc.jobs.executors import SerialExecutor
from bifurc.jobs.store import ChunkStore, fingerprint

A = bf.systems.impact_oscillator(zeta=0.02, omega=2.6, amplitude=1.0, gap=0.0, restitution=0.8)
REGION = {"q0": (-2.5, 0.0), "v0": (-3.0, 3.0)}
VALUES = np.linspace(2.55, 2.64, 8)  # the three-period motion is born at a fold, then doubles


def bits(found):
    header, arrays = found.to_record()
    return fingerprint([{name: value for name, value in header.items() if name != "key"}, arrays])


def swept(**options):
    return bf.sweep(A, "omega", VALUES, REGION, **{"samples": 200, **options})


@pytest.fixture(scope="module")
def found():
    return swept(workers=1)


def test_tracks_are_born_at_the_fold_and_double(found):
    """The branch of the three-period orbit folds at 2.5678 and flips at 2.6113: the tracks change between those values."""
    single, triple, double = found.tracks[:3]
    assert [track.attractors[0].periods for track in (single, triple, double)] == [1, 3, 6]
    assert len(single.values) == len(VALUES) and single.fractions[0] == 1.0
    branch = bf.trace(triple.attractors[0], "omega", bounds=(2.5, 2.7))
    fold = min(point.parameter for point in branch.special_points.of("fold"))
    flip = min(point.parameter for point in branch.special_points.of("period_doubling") if point.parameter > fold)
    assert triple.values[0] > fold and triple.values[0] - fold < VALUES[1] - VALUES[0]
    assert triple.values[-1] < flip < double.values[0] < flip + VALUES[1] - VALUES[0]
    assert double.parent == triple.number and single.parent is None and triple.parent is None
    assert (triple.number, double.number) == found.families[1][:2]


def test_fractions_are_those_of_a_fine_map(found):
    """At 200 evenly spread starts: within two standard errors, and they add up."""
    np.testing.assert_allclose(found.fractions.sum(axis=1) + found.unresolved / found.starts, 1.0)
    for i in (2, 4):
        fine = bf.basins_of_attraction(A.with_parameters(omega=VALUES[i]), bf.Grid(q0=(-2.5, 0, 60), v0=(-3, 3, 60)))
        assert len(fine.attractors) == len(found.attractors[i])
        for number, item in zip(found.numbers[i], found.attractors[i], strict=True):
            k = next(k for k, other in enumerate(fine.attractors) if same(other, item, fine.scale))
            assert abs(fine.fractions[k] - found.fractions[i, number]) <= 2.0 * found.errors[i, number]


def test_executors_and_chunk_sizes_change_no_bit(found):
    from concurrent.futures import ThreadPoolExecutor
    expected = bits(found)
    assert bits(swept(executor=SerialExecutor(), chunk=3)) == expected
    with ThreadPoolExecutor(3) as pool:
        assert bits(swept(executor=pool, chunk=1)) == expected


def test_following_finds_what_the_sample_misses():
    """With five starts a value the smaller basin is missed at some values; it is there all the same."""
    few = bf.sweep(A, "omega", VALUES[2:5], REGION, samples=6, seed=3)
    for items in few.attractors:
        assert sorted(item.periods for item in items) == [1, 3]


def test_an_attractor_is_followed_both_ways_from_one_value():
    systems = [A.with_parameters(omega=float(value)) for value in VALUES[2:5]]
    scales = [Region(REGION).sizes(scene_of(system)) for system in systems]
    known = [[], [], [bf.find_orbit(systems[2], guess=(-1.0, 0.2), periods=3)]]
    assert known[2][0].stable and known[2][0].periods == 3
    links = Links(systems, scales, known)
    links.spread()
    assert [items[0].periods for items in known] == [3, 3, 3] and links.grown == {0, 1}
    assert links.tracks() == ([[0], [0], [0]], {})
    lost, continued = follow(A.with_parameters(omega=2.5), known[0][0], scales[0])  # before the fold
    assert lost.periods == 1 and not continued


def test_links_of_a_part_change_nothing_and_leave_out_what_is_new(found):
    """What `spread` finds is the same whether the links among known attractors were told before."""
    systems = [A.with_parameters(omega=float(value)) for value in VALUES]
    scales = [Region(REGION).sizes(scene_of(system)) for system in systems]
    few = [sorted(items, key=lambda item: item.periods or 9)[:1 if i != 3 else 2] for i, items in enumerate(found.attractors)]
    assert [item.periods for items in few for item in items] == [1, 1, 1, 1, 3, 1, 1, 1, 1]
    part = Links(systems, scales, [list(items) for items in few])  # the orbit of period 3 is known at one value alone
    told = dict(part.among())
    assert [list(items) for items in few] == part.attractors and not part.grown
    assert told[0, 0, 1] == told[1, 0, -1] == (0, True) and (0, 0, -1) not in told and (3, 1, 1) not in told
    whole = Links(systems, scales, [list(items) for items in few])
    rest = Links(systems, scales, [list(items) for items in few], told)
    whole.spread()
    rest.spread()
    assert whole.grown == rest.grown != set() and whole.tracks() == rest.tracks()


def test_saved_loaded_read_again_and_reported(found, tmp_path):
    first = swept(file=tmp_path / "sweep.npz")
    assert [path.name for path in tmp_path.iterdir()] == ["sweep.npz"]
    assert bits(bf.load(tmp_path / "sweep.npz")) == bits(first) == bits(found)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sweeps, "run_chunks", lambda *a, **k: pytest.fail("computed again"))
        assert bits(swept(file=tmp_path / "sweep.npz")) == bits(found)
    assert "\n" not in repr(found) and "period 3" in found.report()


def test_an_interrupted_sweep_goes_on(found, tmp_path, monkeypatch):
    work, calls = sweeps.sweep_points, []

    def interrupted(payload):
        calls.append(1)
        if len(calls) == 4:
            raise KeyboardInterrupt
        return work(payload)

    monkeypatch.setattr(sweeps, "sweep_points", interrupted)
    with pytest.raises(KeyboardInterrupt):
        swept(file=tmp_path / "sweep.npz", workers=1, chunk=1)
    assert len(list((tmp_path / "sweep.npz.chunks").glob("*.npz"))) == 3
    calls[:] = [1] * 10
    assert bits(swept(file=tmp_path / "sweep.npz", workers=1, chunk=1)) == bits(found)
    assert len(calls) - 10 >= 5 and sorted(path.name for path in tmp_path.iterdir()) == ["sweep.npz"]


def test_a_value_that_fails_is_reported_and_the_others_are_there(found, tmp_path, monkeypatch):
    work = sweeps.sweep_points

    def failing(payload):
        if payload["points"][0]["omega"] == VALUES[3]:
            raise ArithmeticError("no luck")
        return work(payload)

    with monkeypatch.context() as patch:
        patch.setattr(sweeps, "sweep_points", failing)
        partial = swept(file=tmp_path / "sweep.npz", chunk=1)
    assert partial.failures == {3: "ArithmeticError: no luck"} and partial.attractors[3] == ()
    assert "not computed: omega" in partial.report() and "1 values failed" in repr(partial)
    assert not (tmp_path / "sweep.npz").exists()  # its chunks are kept for the next call
    assert bits(swept(file=tmp_path / "sweep.npz", chunk=1)) == bits(found)


def test_a_start_region_of_another_problem_gives_other_names():
    store = ChunkStore(None, {"what": "sweep", "system": A.to_record()})
    other = ChunkStore(None, {"what": "sweep", "system": A.with_parameters(zeta=0.03).to_record()})
    assert store.name({}) != other.name({})


def test_a_gap_that_moves_starts_behind_the_stop():
    """Where the stop moves in, starts beyond it are counted out."""
    region = {"q0": (-1.0, 1.0), "v0": (-1.0, 1.0)}
    found = bf.sweep(bf.systems.impact_oscillator(omega=1.4), "gap", [0.2, 0.6, 1.0], region, samples=100)
    np.testing.assert_allclose(found.outside / found.starts, [0.4, 0.2, 0.0], atol=0.03)
    np.testing.assert_allclose(found.fractions.sum(axis=1), 1.0)


def test_starts_are_even():
    """Each of 8 x 8 boxes holds 16 of 1024 starts, give or take a few; random ones spread twice as far."""
    starts = Region(REGION).starts(scene_of(A), 1024, 5)
    counts, _, _ = np.histogram2d(starts[:, 0], starts[:, 1], bins=8, range=[REGION["q0"], REGION["v0"]])
    assert counts.min() >= 13 and counts.max() <= 19
    np.testing.assert_array_equal(Region(REGION).starts(scene_of(A), 10, 5), starts[:10])


@pytest.mark.parametrize(("change", "words"), [
    ({"values": [1.0, 1.0]}, "must rise or fall"),
    ({"values": []}, "must be a list of finite numbers"),
    ({"values": [1.0, np.nan]}, "must be a list of finite numbers"),
    ({"region": {"x": (0, 1)}}, "component 'x' is unknown"),
    ({"region": {"q0": (1, 0)}}, "low bound must be below"),
    ({"region": {"q3": (0, 1)}}, "'q3' is unknown to this system"),
    ({"region": {}}, "must be components and ranges"),
    ({"parameter": "mass"}, "mass"),
    ({"samples": 0}, "samples = 0 is not allowed"),
    ({"tolerance": 1.0}, "tolerance = 1.0"),
    ({"executor": 3}, "executor = 3 is not allowed"),
])
def test_bad_requests(change, words):
    request = {"parameter": "omega", "values": [2.5, 2.6], "region": REGION, **change}
    with pytest.raises(ValueError, match=words):
        bf.sweep(A, request.pop("parameter"), request.pop("values"), request.pop("region"), **request)


def test_the_autonomous_are_refused():
    with pytest.raises(ValueError, match="autonomous"):
        bf.sweep(bf.System(1.0, 0.1, 1.0), "stiffness[0,0]", [1.0], REGION)


def test_an_attractor_starts_a_branch_and_a_branch_point_owns_a_basin_map(found):
    branch = bf.trace(found.tracks[0].attractors[0], "omega", bounds=(2.5, 2.6))
    orbit = branch.orbits[len(branch) // 2]
    basins = bf.basins_of_attraction(orbit.system, bf.Grid(q0=(-2.5, 0, 12), v0=(-3, 3, 12)), attractors=[orbit])
    assert basins.attractors[0] is orbit and basins.fractions[0] > 0.2
    start = bf.basins_of_attraction(A, bf.Grid(q0=(-2.5, 0, 12), v0=(-3, 3, 12))).attractors[1]
    again = bf.trace(start, "omega", bounds=(2.59, 2.61))
    assert again.column("omega").min() == 2.59 and again.column("omega").max() == 2.61
