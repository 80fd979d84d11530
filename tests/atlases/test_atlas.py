"""The whole diagram: known branches and points, nothing twice, bands, graph, files, interruption, odd systems."""
import networkx as nx
import numpy as np
import pytest
from matplotlib.figure import Figure

import bifurc as bf
from bifurc.atlases.identity import on_branch, periods_of

REGION = {"q0": (-3, 1), "v0": (-4, 4)}


@pytest.fixture(scope="module")
def found():
    """From free vibration through grazing into impacting motion, without the cascade below 0.71."""
    return bf.atlas(bf.systems.impact_oscillator(), "omega", (0.76, 2.0), REGION, probes=6, checks=4, samples=200, periods=4)


def test_the_branches_are_those_of_the_tutorial(found):
    assert sorted(periods_of(branch) for branch in found.branches) == [1, 2]
    kinds = {(str(p.kind), round(p.parameter, 9)) for branch in found.branches for p in branch.special_points}
    assert {("period_doubling", 0.824134290), ("period_doubling", 0.923529077), ("fold", 1.527621387), ("grazing", 1.226914230),
            ("fold", 0.872495332), ("grazing", 0.853221479), ("grazing", 0.938380148), ("fold", 0.922176350)} <= kinds
    assert found.status == "nothing_new"


def test_no_branch_is_there_twice(found):
    for k, branch in enumerate(found.branches):
        orbit = branch.orbits[len(branch) // 2]
        assert [on_branch(orbit, other) for other in found.branches] == [i == k for i in range(len(found.branches))]


def test_bands_of_coexistence_agree_with_orbits_solved_there(found):
    for low, high, numbers in found.coexistence:
        if high - low > 1e-3:
            stable = [k for k, orbit in found.orbits_at(0.5 * (low + high)) if orbit.stable]
            assert sorted(stable) == sorted(numbers)
    both = [(low, high) for low, high, numbers in found.coexistence if len(numbers) == 2 and high > 1.2]
    assert both == [pytest.approx((1.2269142301, 1.5276213870), abs=1e-9)]


def test_every_random_attractor_is_on_a_branch(found):
    for value in (0.9, 0.93, 1.4, 1.9):
        system = found.system.with_parameters(omega=value)
        swept = bf.sweep(system, "omega", [value], REGION, samples=300, seed=5)
        for attractor in swept.attractors[0]:
            assert any(on_branch(attractor, branch) for branch in found.branches)


def test_the_graph_joins_branches_where_they_meet(found):
    graph = found.graph
    assert isinstance(graph, nx.MultiGraph) and nx.number_connected_components(graph) == 1
    shared = {round(data["parameter"], 6) for _, data in graph.nodes(data=True) if data["branches"] == [0, 1]}
    assert shared == {0.824134, 0.923529}
    assert not any("stopped" in data["kind"].split(" + ") for _, data in graph.nodes(data=True))  # ends are the points they lie on
    assert all({"branch", "stable", "periods", "low", "high"} <= set(data) for *_, data in graph.edges(data=True))
    unstable = [data for *_, data in graph.edges(data=True) if data["periods"] == 1 and not data["stable"]]
    assert sorted((round(d["low"], 4), round(d["high"], 4)) for d in unstable) == [(0.8241, 0.9235), (1.2269, 1.5276)]


def test_the_table_reaches_as_far_as_the_stable_intervals(found):
    for row in found.table():
        assert all(row["from"] <= low <= high <= row["to"] for low, high in row["stable"])


def test_the_statement_tells_what_was_searched(found):
    text = found.statement
    assert text.startswith(f"{200 * len(found.probes)} starts at {len(found.probes)} values of omega") and "1.5 %" in text
    assert "The last check found nothing new." in text and len(found.report().splitlines()) >= 4


def test_files_give_the_atlas_back(found, tmp_path):
    found.save(tmp_path / "atlas.npz")
    again = bf.load(tmp_path / "atlas.npz")
    assert repr(again) == repr(found) and again.statement == found.statement and again.table() == found.table()
    assert (again.branches[0].column("omega") == found.branches[0].column("omega")).all()


def test_a_picture_with_bands(found):
    ax = found.plot(ax=Figure().subplots())
    assert "number of stable motions" in [text.get_text() for text in ax.get_legend().get_texts()]


def test_a_symmetric_system_lists_mirror_images_once():
    atlas = bf.atlas(bf.systems.two_sided_impact_oscillator(), "amplitude", (3.0, 3.8), {"q0": (-1, 1), "v0": (-3, 3)}, probes=3,
                     checks=2, samples=100, periods=1)
    rows = atlas.table()
    assert [row["mirror_image"] for row in rows].count(True) == 1 and len(rows) == 2
    (broken,) = (row for row in rows if row["mirror_image"])
    assert broken["stable"] == [pytest.approx((3.397988672, 3.8), abs=1e-8)]


def test_after_an_interrupt_only_the_rest_is_computed(tmp_path, monkeypatch):
    from bifurc.atlases import search

    arguments = (bf.systems.impact_oscillator(), "omega", (1.2, 1.6), REGION)
    options = {"probes": 2, "checks": 2, "samples": 60, "periods": 1, "workers": 1, "file": tmp_path / "a.npz"}
    work, calls = search.trace_orbits, []

    def interrupted(payload):
        raise KeyboardInterrupt

    def counted(name, function):
        def inner(payload):
            calls.append(name)
            return function(payload)
        return inner

    monkeypatch.setattr(search, "trace_orbits", interrupted)
    with pytest.raises(KeyboardInterrupt):
        bf.atlas(*arguments, **options)
    monkeypatch.setattr(search, "trace_orbits", counted("trace", work))
    monkeypatch.setattr(search, "sweep_points", counted("probe", search.sweep_points))
    whole = bf.atlas(*arguments, **options)
    assert calls[0] == "trace" and whole.status == "nothing_new"  # the first probes were on disk
    calls.clear()
    assert repr(bf.atlas(*arguments, **options)) == repr(whole) and calls == []


def test_a_system_that_diverges_says_so():
    runaway = bf.System(1.0, -0.5, 1.0, (bf.elements.HarmonicForce(1.0),), omega=1.0)
    atlas = bf.atlas(runaway, "omega", (0.9, 1.1), {"q0": (-1, 1), "v0": (-1, 1)}, probes=2, checks=1, samples=20, periods=1)
    assert not any(b for _, _, b in atlas.coexistence)
    assert atlas.status == "no_motion" and not atlas.branches


def test_bad_arguments_are_named():
    system = bf.systems.impact_oscillator()
    with pytest.raises(ValueError, match="autonomous"):
        bf.atlas(bf.System(1.0, 0.1, 1.0), "stiffness", (0.5, 1.0), REGION)
    with pytest.raises(ValueError, match="probes = 0"):
        bf.atlas(system, "omega", (0.5, 1.0), REGION, probes=0)
    with pytest.raises(ValueError, match="tolerance = 1"):
        bf.atlas(system, "omega", (0.5, 1.0), REGION, tolerance=1.0)
    with pytest.raises(ValueError, match="executor"):
        bf.atlas(system, "omega", (0.5, 1.0), REGION, executor=3)


def test_intervals():
    from bifurc.atlases.stability import gaps, layers

    assert gaps([(0.1, 0.4), (0.3, 0.5), (0.8, 2.0)], 0.0, 1.0) == [(0.0, 0.1), (0.5, 0.8)]
    assert layers([(0.0, 0.5, 0), (0.25, 0.75, 1)], 0.0, 1.0) == [(0.0, 0.25, (0,)), (0.25, 0.5, (0, 1)), (0.5, 0.75, (1,)),
                                                                    (0.75, 1.0, ())]
    assert np.isclose(sum(b - a for a, b in gaps([], 0.0, 1.0)), 1.0)


def test_a_continuum_of_rests_is_named_and_counts_once():
    """Dry friction of strength 1 under a load of 0.8 lets a mass rest up to 0.2 from its middle; motions creep to its edge."""
    system = bf.System(1.0, 0.1, 1.0, [bf.elements.HarmonicForce(0.8), bf.elements.Coulomb(1.0)], omega=1.2)
    atlas = bf.atlas(system, "harmonic_force.amplitude", (0.7, 0.9), {"q0": (-3, 3), "v0": (-3, 3)}, probes=1, checks=1, samples=20,
                     periods=1)
    assert all(probe.counts == [probe.starts] for probe in atlas.probes)  # one attractor, and every start ends on it
    for probe in atlas.probes:
        (band,) = probe.continua
        np.testing.assert_allclose(band["0"], (probe.value - 1.0, 1.0 - probe.value), atol=1e-12)
    assert "continuum" in atlas.statement and f"{len(atlas.probes)} of {len(atlas.probes)} values" in atlas.statement
