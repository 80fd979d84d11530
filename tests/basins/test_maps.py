"""Maps as results: workers, interrupts and files, other kinds of scenes, chaos, symmetry, the printed report."""
import json
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

import bifurc as bf
from bifurc import io
from bifurc.basins.maps import compute as mapping
from bifurc.basins.maps import labelling
from bifurc.basins.maps.label_noise import LADDER, ROUNDING, extrapolated, measure

ARRAYS = ("labels", "states", "periods", "impacts")
SYSTEM = bf.systems.impact_oscillator(zeta=0.02, omega=2.6, amplitude=1.0, gap=0.0, restitution=0.8)
GRID = bf.Grid(q0=(-2.5, 0.25, 60), v0=(-3, 3, 50))


def same(a, b):
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
    assert (a.radii, a.fractions, a.options) == (b.radii, b.fractions, b.options)
    assert json.dumps(a.noise.to_record()) == json.dumps(b.noise.to_record())
    for one, other in zip(a.attractors, b.attractors, strict=True):
        np.testing.assert_array_equal(one.state, other.state)


@pytest.fixture(scope="module")
def basins():
    return bf.basins_of_attraction(SYSTEM, GRID, workers=1)


def test_the_number_of_workers_changes_no_bit(basins):
    same(basins, bf.basins_of_attraction(SYSTEM, GRID, workers=2))
    same(basins, bf.basins_of_attraction(SYSTEM, GRID, workers=5))


def test_another_seed_changes_no_label(basins):
    other = bf.basins_of_attraction(SYSTEM, GRID, seed=7)
    np.testing.assert_array_equal(basins.labels, other.labels)


def test_saved_and_loaded(basins, tmp_path):
    basins.save(tmp_path / "basins.npz")
    same(basins, bf.load(tmp_path / "basins.npz"))


def test_an_interrupt_loses_no_finished_chunk(basins, tmp_path, monkeypatch):
    file, work, sizes = tmp_path / "map.npz", labelling.label_part, []
    monkeypatch.setattr(labelling, "LEAN", 512)

    def interrupted(payload):
        if len(sizes) == 3:
            raise KeyboardInterrupt
        sizes.append(len(payload["starts"]))
        return work(payload)

    monkeypatch.setattr(labelling, "label_part", interrupted)
    for _ in range(2):  # twice, the second time at once
        with pytest.raises(KeyboardInterrupt):
            bf.basins_of_attraction(SYSTEM, GRID, workers=1, file=file)
    assert not file.exists() and sizes == [512] * 3
    assert len(list((tmp_path / "map.npz.chunks").glob("*.npz"))) == 3

    def counted(payload):
        sizes.append(len(payload["starts"]))
        return work(payload)

    sizes.clear()
    monkeypatch.setattr(labelling, "label_part", counted)
    monkeypatch.setattr(mapping._Work, "_noise", lambda self, cells: basins.noise)
    resumed = bf.basins_of_attraction(SYSTEM, GRID, workers=2, file=file)
    assert sum(sizes) == GRID.size - 3 * 512
    same(basins, resumed)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["map.npz"]

    sizes.clear()
    same(basins, bf.basins_of_attraction(SYSTEM, GRID, file=file))
    assert not sizes  # read from the file


def test_processes_and_any_chunk_size_change_no_bit(basins, monkeypatch):
    for size, workers in ((300, 1), (701, 2)):
        monkeypatch.setattr(labelling, "LEAN", size)
        same(basins, bf.basins_of_attraction(SYSTEM, GRID, workers=workers))
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        same(basins, bf.basins_of_attraction(SYSTEM, GRID, executor=pool))


def test_a_chunk_that_fails_is_named_and_the_others_are_kept(basins, tmp_path, monkeypatch):
    work = labelling.label_part
    monkeypatch.setattr(labelling, "LEAN", 512)

    def failing(payload):
        if payload["starts"][0, 0] > -1.2 and payload["starts"][0, 0] < -0.8:
            raise ArithmeticError("no luck")
        return work(payload)

    with monkeypatch.context() as patch:
        patch.setattr(labelling, "label_part", failing)
        with pytest.raises(RuntimeError, match=r"1 of 6 chunks of starts failed; .* no luck"):
            bf.basins_of_attraction(SYSTEM, GRID, file=tmp_path / "map.npz")
    assert len(list((tmp_path / "map.npz.chunks").glob("*.npz"))) == 5
    same(basins, bf.basins_of_attraction(SYSTEM, GRID, file=tmp_path / "map.npz"))


def test_a_map_of_another_job_or_a_damaged_one_is_not_used(basins, tmp_path):
    chunks = tmp_path / "map.npz.chunks"
    chunks.mkdir()
    io.write(chunks / f"{'0' * 32}.npz", {"kind": "chunk", "key": "other"}, {"labels": np.zeros(3)})
    (tmp_path / "map.npz").write_bytes(b"PK\x03\x04 cut short")
    same(basins, bf.basins_of_attraction(SYSTEM, GRID, file=tmp_path / "map.npz"))
    assert [path.name for path in tmp_path.iterdir()] == ["map.npz"]


def test_given_attractors_keep_their_numbers(basins):
    known = basins.attractors[1]
    again = bf.basins_of_attraction(SYSTEM, GRID, attractors=[known])
    assert again.attractors[0] is known
    np.testing.assert_array_equal(again.labels, np.array([1, 0, -1])[basins.labels])


def test_an_orbit_that_repels_or_of_another_system_is_no_attractor(basins):
    with pytest.raises(ValueError, match="of another system"):
        bf.basins_of_attraction(bf.systems.impact_oscillator(), GRID, attractors=[basins.attractors[0]])
    neutral = bf.System(1.0, 0.0, 1.0, [bf.elements.HarmonicForce(0.1)], omega=0.6)
    orbit = bf.find_orbit(neutral, guess=(0.15, 0.0))
    assert orbit.success and orbit.stable is None
    with pytest.raises(ValueError, match="it must be a stable orbit"):
        bf.basins_of_attraction(neutral, GRID, attractors=[orbit])


def test_report_and_line(basins):
    assert "\n" not in repr(basins)
    assert repr(basins).startswith("BasinMap(60 x 50 cells, 2 attractors: 0.")
    text = basins.report()
    for words in ("rigid_stop.impact x3 / 3 T", "lies beyond a rigid stop", "uncertainty exponent", "untrustworthy"):
        assert words in text
    assert f"{basins.fractions[0]:.6f}" in text


def test_a_chaotic_attractor_is_recognised_by_its_exponent():
    system = bf.systems.impact_oscillator(zeta=0.05, omega=2.5, amplitude=8.0, gap=1.0, restitution=0.7)
    basins = bf.basins_of_attraction(system, bf.Grid(q0=(-3, 1, 20), v0=(-4, 4, 20)))
    (chaos,) = basins.attractors
    per_period, error = chaos.exponent * system.period, chaos.exponent_error * system.period
    assert abs(per_period - 0.304) <= 3.0 * np.hypot(error, 0.008)
    assert per_period > 10.0 * error
    assert basins.fractions == {0: 1.0, -1: 0.0}
    assert chaos.points.shape == (20000, 2) and "exponent 0.1" in repr(chaos)


def test_a_chaotic_map_is_saved_and_loaded(tmp_path):
    system = bf.systems.impact_oscillator(zeta=0.05, omega=2.5, amplitude=8.0, gap=1.0, restitution=0.7)
    basins = bf.basins_of_attraction(system, bf.Grid(q0=(-3, 1, 6), v0=(-4, 4, 6)))
    basins.save(tmp_path / "chaos.npz")
    loaded = bf.load(tmp_path / "chaos.npz")
    np.testing.assert_array_equal(loaded.attractors[0].points, basins.attractors[0].points)
    np.testing.assert_array_equal(loaded.labels, basins.labels)


def test_mirror_partners_are_two_attractors_with_mirrored_basins():
    """Above the pitchfork at 3.398 both asymmetric orbits attract; mirrored starts half a period later swap them."""
    system = bf.systems.two_sided_impact_oscillator(amplitude=3.45)
    basins = bf.basins_of_attraction(system, bf.Grid(q0=(-1, 1, 20), v0=(-3, 3, 20)))
    one, other = basins.attractors
    assert basins.fractions[-1] == 0.0
    half = one.sample(3)[1][1]  # after half a period
    np.testing.assert_allclose(-half, other.state, rtol=0, atol=1e-9)


def test_an_elastic_stop_and_a_law():
    """Both scenes have a free or small motion beside a large one; labels against long simulations."""
    for system in (bf.systems.bilinear_oscillator(omega=1.29), bf.systems.duffing_oscillator(omega=1.5)):
        grid = bf.Grid(q0=(-2.5, 2.5, 8), v0=(-4, 4, 8))
        basins = bf.basins_of_attraction(system, grid)
        assert len(basins.attractors) == 2 and basins.fractions[-1] == 0.0
        for cell in (0, 19, 36, 63):
            end = bf.simulate(system, grid.starts(1, 2)[cell], periods=400).final
            away = [np.abs(item.state - end).max() for item in basins.attractors]
            assert np.argmin(away) == basins.labels.flat[cell] and min(away) < 1e-6


def test_a_slice_through_a_chain():
    """Two masses, one stopped: fixed components are kept, the slice is labelled."""
    system = bf.systems.impact_chain(n=2, omega=0.6, amplitude=0.5)
    grid = bf.Grid(q1=(-1, 1, 6), v1=(-1, 1, 6), at={"q0": 0.1})
    basins = bf.basins_of_attraction(system, grid, max_periods=500)
    assert basins.fractions[-1] == 0.0
    for cell in (0, 20):
        motion = bf.simulate(system, grid.starts(2, 4)[cell], periods=int(basins.periods.flat[cell]) + 200)
        points = basins.attractors[basins.labels.flat[cell]].sample(2)[1]
        assert np.abs(points - motion.final).max(axis=1).min() < 1e-6


def test_unforced_motion_of_no_attraction_stays_unsettled():
    """Without damping nothing attracts: every cell is unsettled, and says so."""
    system = bf.System(1.0, 0.0, 1.0, [bf.elements.HarmonicForce(0.1)], omega=0.6)
    basins = bf.basins_of_attraction(system, bf.Grid(q0=(-1, 1, 3), v0=(-1, 1, 3)), max_periods=50)
    assert basins.attractors == () and basins.fractions == {-1: 1.0}
    assert basins.counts[bf.basins.CellState.UNSETTLED] == 9


def test_extrapolation_of_an_exact_power_law():
    e = np.array(LADDER[2:8])
    for exponent, level in [(0.5, 0.3), (0.09, 0.4)]:
        law = level * (e / e[0]) ** exponent
        found = extrapolated(e, law * 1e9, 10**9)
        np.testing.assert_allclose(found.exponent, exponent, rtol=1e-6)
        np.testing.assert_allclose(found.at_error, level * (ROUNDING / e[0]) ** exponent, rtol=1e-6)
    none = extrapolated(np.array(LADDER[:3]), np.zeros(3), 1000)
    assert 0.0 < none.at_error < 1e-16


def test_noise_of_a_straight_boundary(rng):
    """Labels by the sign of the first component, uniform starts: f(e) = e E|cos| / 2 = e / pi."""
    starts = rng.uniform(-1, 1, (4000, 2))
    labels = (starts[:, 0] > 0).astype(int)
    found = measure(lambda y: (y[:, 0] > 0).astype(int), starts, labels, np.ones(2), rng)
    assert abs(found.exponent - 1.0) <= 0.15
    np.testing.assert_allclose(found.changed[:2], found.perturbations[:2] / np.pi, rtol=0.4)


@pytest.mark.parametrize(("system", "counted"), [
    (bf.systems.impact_oscillator(omega=1.4), "impact"),
    (bf.systems.bilinear_oscillator(omega=1.29), "contact"),
    (bf.systems.two_sided_impact_oscillator(amplitude=3.45), "impact"),
])
def test_impacts_of_a_cell_are_those_of_its_simulated_motion(system, counted):
    """The period kernel and the general march count what the event table of a simulation lists."""
    basins = bf.basins_of_attraction(system, bf.Grid(q0=(-0.9, 0.4, 5), v0=(-2, 2, 5)))
    starts = basins.grid.starts(1, 2)
    for cell in (0, 7, 18, 24):
        motion = bf.simulate(system, starts[cell], periods=int(basins.periods.flat[cell]))
        assert basins.impacts.flat[cell] == sum(event.kind == counted for event in motion.events)


def test_sticking_orbits_attract():
    """Impacts chatter to rest under the slow load: the superstable orbit is confirmed and every start reaches it."""
    system = bf.systems.impact_oscillator(zeta=0.05, omega=0.2, amplitude=1.0, gap=0.0, restitution=0.5)
    basins = bf.basins_of_attraction(system, bf.Grid(q0=(-2, -0.1, 12), v0=(-1, 1, 12)))
    (orbit,) = basins.attractors
    assert basins.fractions == {0: 1.0, -1: 0.0}
    assert np.abs(orbit.multipliers).max() == 0.0
    assert basins.periods.max() <= 2  # a start is forgotten when it first rests


def test_rest_for_ever_is_an_attractor():
    """A ball on a table that never throws it off: rest beside bouncing, each with its multipliers."""
    basins = bf.basins_of_attraction(bf.systems.bouncing_ball(), bf.Grid(q0=(0.5, 8, 12), v0=(-4, 4, 12)))
    rest, bouncing = basins.attractors
    np.testing.assert_allclose(rest.state, [0.5, 0.0], rtol=0, atol=1e-14)
    assert np.abs(rest.multipliers).max() == 0.0 and len(rest.events) == 0
    assert len(bouncing.events) == 1 and basins.fractions[-1] == 0.0
