"""Pictures of maps of cells and of what basin maps record."""
import matplotlib.pyplot as plt
import numpy as np
import pytest

import bifurc as bf
from bifurc import plotting
from bifurc.basins import edge_state
from bifurc.plotting.basins import plot_field
from tests.plotting import pictures

A = bf.systems.impact_oscillator(zeta=0.02, omega=2.6, amplitude=1.0, gap=0.0, restitution=0.8)


@pytest.fixture(autouse=True)
def no_figure_stays_open():
    yield
    plt.close("all")


@pytest.fixture(scope="module")
def cells():
    return bf.cell_mapping(A, bf.Grid(q0=(-2.5, 0.2, 54), v0=(-3, 3, 60)), periods=3, samples=2)


@pytest.fixture(scope="module")
def basins():
    return bf.basins_of_attraction(A, bf.Grid(q0=(-2.5, 0.2, 54), v0=(-3, 3, 60)))


def test_labels_of_cells_are_drawn_with_attractors_and_audit(cells):
    ax = cells.plot()
    (image,) = ax.get_images()
    drawn = image.get_array().T
    np.testing.assert_array_equal(drawn[cells.labels >= 0] - 3, cells.labels[cells.labels >= 0])
    np.testing.assert_array_equal(drawn == 2, cells.fates == 3)
    words = [text.get_text() for text in ax.get_legend().get_texts()]
    assert any(word.startswith("period 3, 3 impacts: ") for word in words) and "beyond the stop" in words
    assert "generalized cell mapping, 54 x 60 cells, 3 periods a mapping; wrong labels" in ax.get_title(loc="right")


@pytest.mark.parametrize("field", ["doubt", "time", "density"])
def test_fields_of_cells(cells, field):
    ax = cells.plot(field=field)
    values = ax.get_images()[0].get_array()
    assert values.count() > 0 and values.min() >= 0.0
    if field == "density":
        np.testing.assert_allclose(values.sum() * np.prod(cells.grid.widths), 1.0, rtol=1e-12)


def test_doubt_is_the_chance_of_all_ends_but_the_likeliest(rng):
    """To leave the grid, or to end at no confirmed attractor, is an end like others."""
    cells, chances = pictures.cells(), rng.dirichlet(np.ones(4), size=(4, 3))
    assert set(chances.argmax(axis=-1).ravel()) == {0, 1, 2, 3}
    cells.absorption = lambda: pictures.Made(probability=chances[..., :2], unresolved=chances[..., 2], left=chances[..., 3])
    drawn, starts = plotting.plot_cells(cells, field="doubt").get_images()[0].get_array().T, cells.fates != 3
    np.testing.assert_array_equal(drawn.mask, ~starts)
    np.testing.assert_allclose(drawn[starts], np.sort(chances)[starts, :3].sum(axis=-1), rtol=0, atol=1e-15)


def test_a_morse_graph_has_a_mark_a_group_and_an_arrow_an_edge(cells):
    ax = cells.plot_morse()
    assert len(ax.collections) == len(cells.morse)
    arrows = [note for note in ax.texts if note.get_text() == ""]
    assert len(arrows) == cells.morse.number_of_edges()
    few = cells.plot_morse(least=10**6)
    assert len(few.collections) == sum(content["closed"] for _, content in cells.morse.nodes(data=True))
    assert "transient groups below" in few.get_title(loc="right") or len(few.collections) == len(cells.morse)


def test_a_basin_map_shows_stop_saddle_and_promise(basins):
    edge = edge_state(basins)
    ax = basins.plot(saddle=edge)
    words = [text.get_text() for text in ax.get_legend().get_texts()]
    assert words[-2:] == ["beyond the stop", "saddle"]
    (image,) = ax.get_images()
    np.testing.assert_array_equal(image.get_array().T == 1, basins.states == 2)
    crosses = [line.get_xydata() for line in ax.get_lines() if line.get_marker() == "P"]
    np.testing.assert_allclose(crosses[0][0], edge.saddle.state, rtol=0, atol=1e-12)
    assert "boundary entropy" in ax.get_title(loc="right")
    assert ax.figure.get_supxlabel().startswith("Every label can be trusted")


@pytest.mark.parametrize("size", [(3.2, 2.6), (4.2, 3.3), (7.0, 5.0)])
def test_the_legend_of_a_basin_map_keeps_clear_of_the_axis(basins, size):
    figure, ax = plt.subplots(figsize=size, layout="constrained")
    basins.plot(ax)
    figure.canvas.draw()
    legend, label = ax.get_legend().get_window_extent(), ax.xaxis.label.get_window_extent()
    assert legend.y1 <= label.y0 + 1.0
    assert legend.x1 <= figure.bbox.x1 + 1.0 and legend.y0 >= -1.0
    plt.close(figure)


def test_a_sweep_tells_motions_of_one_period_by_their_impacts():
    found = bf.sweep(bf.systems.impact_oscillator(), "omega", [1.35, 1.4, 1.45], {"q0": (-3, 1), "v0": (-4, 4)}, samples=60)
    above, below = found.plot()
    assert {text.get_text() for text in below.get_legend().get_texts()} == {"period 1, no impact", "period 1, 1 impact"}
    plt.close(below.figure)


@pytest.mark.parametrize("field", ["periods", "impacts", "speeds"])
def test_records_of_a_basin_map(basins, field):
    ax = basins.plot(field=field)
    values = ax.get_images()[0].get_array().T
    settled = basins.labels >= 0
    shown = ~np.ma.getmaskarray(values)
    assert not shown[~settled].any() and shown[settled].mean() > 0.9


def test_what_cannot_be_drawn_is_named(basins, cells):
    with pytest.raises(ValueError, match="field = 'colour' is not allowed"):
        plot_field(basins, "colour")
    with pytest.raises(ValueError, match="field = 'colour' is not allowed"):
        cells.plot(field="colour")
    line = bf.basins_of_attraction(A, bf.Grid(v0=(-3, 3, 5), at={"q0": -1.0}))
    with pytest.raises(ValueError, match="over 1 components cannot be drawn"):
        plotting.plot_basins(line)
