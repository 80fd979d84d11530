"""Pictures: the right lines in the right style end at the right points; and every picture draws without a warning."""
import subprocess
import sys
from types import SimpleNamespace

import matplotlib
import matplotlib.image
import numpy as np
import pytest

from bifurc import plotting
from bifurc.elements import CubicSpring, ElasticStop, HarmonicForce, RigidStop
from bifurc.orbits.base import Orbit
from bifurc.plotting import style
from bifurc.plotting.motions import phase_plane
from tests.plotting import fakes


@pytest.fixture
def ax():
    return plotting.figure()[1][0]


def drawn(ax, label):
    """Points of all lines with a label, in drawing order."""
    lines = [line.get_xydata() for line in ax.get_lines() if line.get_label() == label]
    return np.concatenate(lines) if lines else np.zeros((0, 2))


def test_styles_change_exactly_at_the_special_points(ax):
    branch = fakes.branch()
    plotting.plot_branch(branch, ax)
    free = drawn(ax, "free, stable")
    assert free[0, 0] == 0.5
    assert free[-1, 0] == 0.696191
    unstable = drawn(ax, "impacting, unstable")
    assert {0.710690, 0.824134, 0.923529, 1.527621, 1.226914} <= set(unstable[:, 0])
    stable = drawn(ax, "impacting, stable")
    assert stable[0, 0] == 0.710690  # just beyond the graze the multiplier is unbounded
    assert stable[:, 0].max() == 1.527621
    for line in ax.get_lines():
        if line.get_label().endswith("unstable"):
            assert line.get_linestyle() == "--"


@pytest.mark.parametrize(("kind", "word"), [("impact", "impacting"), ("contact", "in contact"), ("slip", "slipping")])
def test_the_legend_says_what_happens_at_the_events(ax, kind, word):
    branch = fakes.branch()
    branch.kind = kind
    plotting.plot_branch(branch, ax)
    assert f"{word}, stable" in {text.get_text() for text in ax.get_legend().get_texts()}


@pytest.mark.parametrize(("elements", "words"), [((HarmonicForce(1.0), CubicSpring(0.1)), {"stable"}),
                                                 ((HarmonicForce(1.0), RigidStop(1.0, 0.7)), {"free, stable"})])
def test_motions_without_events_are_called_free_only_where_something_can_happen(ax, elements, words):
    x = np.linspace(0.5, 0.9, 9)
    branch = fakes.FakeBranch({"s": x, "omega": x, "rms_0": x**2, "stable": np.ones(9, bool), "n_events": np.zeros(9, int)}, [])
    for orbit in branch.orbits:
        orbit.system = SimpleNamespace(elements=elements)
    plotting.plot_branch(branch, ax)
    assert {text.get_text() for text in ax.get_legend().get_texts()} == words


def test_every_part_of_the_branch_is_drawn_once():
    branch = fakes.branch()
    s, x, y = (branch.columns[name] for name in ("s", "omega", "rms_0"))
    values = [np.interp(point.s, s, y) for point in branch.special_points]
    runs = plotting.branches.pieces(branch, s, x, y, branch.special_points, values)
    for (_, px, py), (_, qx, qy) in zip(runs, runs[1:], strict=False):
        assert (px[-1], py[-1]) == (qx[0], qy[0])
    assert all(a != b for (a, *_), (b, *_) in zip(runs, runs[1:], strict=False))


def test_lines_are_smooth_but_keep_their_corners(ax):
    """A half circle of 13 rows, its top among them, then a straight line: errors below a pixel, a corner where contact begins."""
    angle = np.append(np.linspace(0, np.pi, 13), np.pi + np.array([0.5, 1.0]))
    x, y = np.cos(angle), np.sin(angle)
    x[-2:], y[-2:] = [-0.5, 0.0], [0.0, 0.0]
    columns = {"s": angle, "p": x, "u_0": y, "stable": np.ones(15), "n_events": np.array([0] * 13 + [1] * 2)}
    point = SimpleNamespace(kind="grazing", parameter=-1.0, s=np.pi, measures={"u_0": 0.0})
    plotting.plot_branch(fakes.FakeBranch(columns, [point], "p"), ax)
    circle, line = drawn(ax, "free, stable"), drawn(ax, "impacting, stable")
    assert abs(np.hypot(*circle.T) - 1).max() < 5e-3
    assert len(circle) > 80
    np.testing.assert_allclose(line[:, 1], 0.0, atol=1e-12)
    assert line[0, 0] == -1.0


def test_no_line_leaves_the_range_of_its_data(ax, rng):
    """Rows beside a fast change: between two of them nothing is drawn that lies beyond both."""
    s = np.cumsum(rng.uniform(1e-4, 1.0, 40))
    y = np.where(np.arange(40) < 20, 0.1, 5.0) + 1e-3 * rng.standard_normal(40)
    x = np.cumsum(rng.standard_normal(40))
    columns = {"s": s, "p": x, "u_0": y, "stable": np.ones(40)}
    plotting.plot_branch(fakes.FakeBranch(columns, [], "p"), ax)
    line = drawn(ax, "stable")
    assert len(line) == 39 * 8 + 1
    for values, seen in ((x, line[:, 0]), (y, line[:, 1])):
        ends = np.stack([values[:-1], values[1:]])
        inner = seen[:-1].reshape(39, 8)
        assert np.all(inner >= ends.min(axis=0)[:, None]) and np.all(inner <= ends.max(axis=0)[:, None])
        assert seen.min() == values.min() and seen.max() == values.max()


def test_unstable_motions_are_seen_where_stable_ones_cover_them(ax):
    """The same values, one branch unstable, the other stable: neither hides the other, in any order."""
    s = np.linspace(0.0, 1.0, 30)
    for stable in (np.zeros(30), np.ones(30)):
        plotting.plot_branch(fakes.FakeBranch({"s": s, "p": s, "u_0": s, "stable": stable}, [], "p"), ax)
    dashed, full = ax.get_lines()
    assert dashed.get_zorder() > full.get_zorder() and dashed.get_linewidth() < full.get_linewidth()
    assert dashed.get_path_effects() and not full.get_path_effects()


def test_curves_of_one_kind_share_a_colour(ax):
    for kind, shift in (("fold", 0.0), ("grazing", 1.0), ("fold", 2.0)):
        values = {"s": np.arange(5.0), "a": np.arange(5.0), "b": np.arange(5.0) + shift}
        curve = SimpleNamespace(parameters=("a", "b"), kind=kind, special_points=(), name="", column=values.__getitem__)
        plotting.plot_curve(curve, ax)
    first, other, again = ax.get_lines()
    assert first.get_color() == again.get_color() != other.get_color()
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["fold", "grazing"]


@pytest.mark.parametrize(("kinds", "element", "words"), [
    ((), RigidStop(1.0, 0.5), "no impact"), (("impact",), RigidStop(1.0, 0.5), "1 impact"),
    (("chatter", "release", "impact"), RigidStop(1.0, 0.5), "2 impacts"),
    ((), ElasticStop(1.0, 2.0), "no contact"), (("contact", "separation") * 2, ElasticStop(1.0, 2.0), "2 contacts"),
    (("impact", "contact"), RigidStop(1.0, 0.5), "1 impact, 1 contact"), ((), HarmonicForce(1.0), "no impact")])
def test_words_for_a_motion_name_what_it_touches(kinds, element, words):
    events = [SimpleNamespace(kind=kind) for kind in kinds]
    motion = fakes.motion(periods=2, events=events, system=SimpleNamespace(elements=(element,)))
    assert phase_plane.describe(motion) == f"period 2, {words}"


def test_one_legend_entry_a_label_for_several_branches(ax):
    first, second = fakes.branch(), fakes.branch()
    plotting.plot_branches([first, second], ax)
    words = [text.get_text() for text in ax.get_legend().get_texts()]
    assert sorted(words) == sorted(set(words))
    assert set(words) == {"free, stable", "impacting, stable", "impacting, unstable", "grazing", "period doubling",
                          "fold"}
    second.parameter = "amplitude"
    with pytest.raises(ValueError, match="amplitude.*omega"):
        plotting.plot_branches([first, second], ax)


def test_a_point_that_carries_its_measures_is_drawn_there(ax):
    branch = fakes.branch()
    branch.special_points[0].measures = {"rms_0": 1.0}
    plotting.plot_branch(branch, ax)
    assert [0.696191, 1.0] in drawn(ax, "grazing").tolist()


def test_a_row_on_a_special_point_changes_the_style_there(ax):
    columns = {"s": np.arange(4.0), "p": np.arange(4.0), "u_0": np.zeros(4), "stable": np.array([1, 1, 0, 0])}
    plotting.plot_branch(fakes.FakeBranch(columns, [SimpleNamespace(kind="fold", parameter=1.0, s=1.0, measures={})], "p"), ax)
    assert [line.get_xydata()[[0, -1], 0].tolist() for line in ax.get_lines()] == [[0, 1], [1, 3], [1, 1]]


@pytest.mark.parametrize("stable", [np.array([1.0, np.nan, 0.0]), np.array([1, -1, 0], np.int8),
                                    np.array([True, None, False], object)])
def test_unknown_stability_is_its_own_style(ax, stable):
    columns = {"s": np.arange(3.0), "p": np.arange(3.0), "u_0": np.arange(3.0) ** 2, "stable": stable}
    plotting.plot_branch(fakes.FakeBranch(columns, [], "p"), ax)
    assert [line.get_label() for line in ax.get_lines()] == ["stable", "stability unknown", "unstable"]
    assert drawn(ax, "stability unknown")[[0, -1], 0].tolist() == [0.5, 1.5]
    assert ax.get_ylabel() == "u_0"


def test_algebraic_branch_without_stability(ax):
    columns = {"s": np.arange(3.0), "p": np.arange(3.0), "u_0": np.zeros(3)}
    point = SimpleNamespace(kind="hopf_like", parameter=0.0, s=0.0, measures={})
    plotting.plot_branch(fakes.FakeBranch(columns, [point], "p"), ax)
    assert drawn(ax, "hopf like").tolist() == [[0.0, 0.0]]
    assert [line.get_label() for line in ax.get_lines()] == ["stability unknown", "hopf like"]


def test_orbit_is_cut_at_the_impact_and_the_stop_is_drawn():
    orbit = fakes.FakeOrbit()
    axes = plotting.figure(columns=2)[1]
    phase, history = plotting.plot_orbit(orbit, axes)
    jump = drawn(phase, "impact")
    np.testing.assert_allclose(jump[:, 0], 1.0, atol=5e-3)
    np.testing.assert_allclose(jump[:, 1], [orbit.speed, -fakes.R * orbit.speed], atol=5e-3)
    blue = [line.get_xydata() for line in phase.get_lines() if line.get_color() == style.BLUE]
    assert len(blue) == 2
    assert max(abs(np.diff(line[:, 1])).max() for line in blue) < 0.01
    marks = drawn(history, "impact")
    np.testing.assert_allclose(marks, [[orbit.hit / orbit.period, 1.0]], atol=1e-3)
    assert history.get_xlim() == (0.0, 1.0)
    assert history.get_ylim()[1] > 1.0
    assert 1.0 in [line.get_ydata()[0] for line in history.get_lines() if line.get_color() == "black"]


def test_stops_of_a_system():
    found = [HarmonicForce(0.5), RigidStop(gap=1.0), ElasticStop(gap=0.5, side=-1), RigidStop(gap=2.0, dof=1),
             RigidStop(row=(1.0, -1.0))]
    system = SimpleNamespace(elements=found, omega=2.0)
    assert phase_plane.stops(system, 0) == [(1.0, 1, True, None), (-0.5, -1, False, None)]
    assert phase_plane.stops(system, 1) == [(2.0, 1, True, None)]
    system.elements = [RigidStop(gap=0.0, side=-1, amplitude=0.3, harmonic=2, phase=0.1)]
    (wall,) = phase_plane.stops(system, 0)
    assert wall.position == 0.0
    np.testing.assert_allclose(wall.swing(np.array([0.0, 1.0])), 0.3 * np.cos([0.1, 4.1]), rtol=1e-15)


def test_basins_show_every_cell_attractors_and_fractions(ax):
    basins = fakes.basins()
    plotting.plot_basins(basins, ax)
    (image,) = ax.get_images()
    np.testing.assert_array_equal(image.get_array().T, np.where(basins.labels < 0, 0, basins.labels + 3))
    assert image.get_extent() == [-3, 1, -4, 4]
    words = [text.get_text() for text in ax.get_legend().get_texts()]
    assert words == [f"period 1, 1 impact: {100 * basins.fractions[0]:.1f} %",
                     f"period 1, no impact: {100 * basins.fractions[1]:.1f} %",
                     f"unresolved: {100 * basins.fractions[-1]:.2f} %"]
    assert basins.attractors[1].state.tolist() in [line.get_xydata()[0].tolist() for line in ax.get_lines()]
    assert "predicted label noise" in ax.get_title(loc="right")


@pytest.mark.parametrize(("height", "columns"), [(2.6, 1), (6.0, 1), (4.0, 2)])
def test_the_legend_of_a_map_is_clear_of_the_label_of_its_axis_and_within_the_picture(height, columns):
    figure, axes = plotting.figure(6.8, height, columns=columns)
    ax = axes[-1]
    plotting.plot_basins(fakes.basins(), ax)
    figure.draw_without_rendering()
    label, legend = ax.xaxis.label.get_window_extent(), ax.get_legend().get_window_extent()
    assert legend.y1 <= label.y0 and legend.y0 >= 0.0 and legend.x1 <= figure.bbox.width
    title = ax._right_title.get_window_extent()
    assert title.x0 >= (0.5 * figure.bbox.width if columns == 2 else 0.0)


def test_section_points_of_a_longer_period():
    orbit = fakes.FakeOrbit()

    class Twice(Orbit):
        periods, events, system = 2, orbit.events * 2, orbit.system

        def _sampled(self, n):
            t = np.linspace(0, 2 * orbit.period, n)
            return t, orbit.at(t % orbit.period)

    twice = Twice()
    np.testing.assert_allclose(plotting.basins.section_points(twice), [orbit.state, orbit.state], atol=1e-12)
    assert plotting.basins.describe(twice) == "period 2, 2 impacts"
    elastic = fakes.motion(events=[SimpleNamespace(kind=kind) for kind in ("contact", "separation")])
    assert plotting.basins.describe(elastic) == "period 1, 1 contact"


def test_words_above_an_orbit_do_not_overlap():
    figure, axes = plotting.figure(6.0, 3.0, columns=2)
    plotting.plot_orbit(fakes.FakeOrbit(), axes)
    figure.draw_without_rendering()
    assert not axes[1].get_title(loc="right")
    assert axes[1].get_legend().get_title().get_text() == "period 1, 1 impact, stable"


def test_chaotic_attractors_and_empty_maps(ax, rng):
    basins = fakes.basins()
    basins.attractors = (fakes.motion(regime="chaotic", sections=rng.normal(size=(500, 2))), *basins.attractors[1:])
    plotting.plot_basins(basins, ax)
    assert ax.get_legend().get_texts()[0].get_text().startswith("chaotic")
    nothing = fakes.FakeMap(-np.ones((4, 5), int), basins.grid, (), {-1: 1.0}, 0.0)
    plotting.plot_basins(nothing, plotting.figure()[1][0])
    with pytest.raises(ValueError, match="'z0'"):
        basins.grid.names = ("z0", "v0")
        plotting.plot_basins(basins, ax)


def test_files_are_written_whole_and_formats_are_named(tmp_path, ax):
    plotting.plot_branch(fakes.branch(), ax)
    path = plotting.save_figure(ax.figure, tmp_path / "b.png")
    assert matplotlib.image.imread(path).shape[:2] == (1170, 1890)
    plotting.save_figure(ax.figure, tmp_path / "b.pdf")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["b.pdf", "b.png"]
    with pytest.raises(ValueError, match=r"\.png"):
        plotting.save_figure(ax.figure, tmp_path / "b.docx")


def test_user_settings_are_left_alone(ax):
    before = dict(matplotlib.rcParams)
    plotting.plot_branch(fakes.branch(), ax)
    assert dict(matplotlib.rcParams) == before


def test_axes_are_made_when_none_are_given():
    from matplotlib import pyplot

    before = pyplot.get_fignums()
    try:
        assert plotting.plot_branch(fakes.branch()).figure.number in set(pyplot.get_fignums()).difference(before)
        assert len(plotting.plot_orbit(fakes.FakeOrbit())) == 2
        plotting.plot_basins(fakes.basins())
    finally:
        pyplot.close("all")


def test_figures_for_files_need_no_pyplot():
    code = "import sys; from bifurc import plotting; plotting.figure(); assert 'matplotlib.pyplot' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_lines_follow_a_parabola_between_rows_at_any_distance():
    """Slopes of parabolas: where nothing has to be limited the line is the parabola itself."""
    s = np.array([0.0, 0.3, 1.0, 1.2, 2.0])
    x, y = s + 0.1 * s * s, 2.0 * s - 0.2 * s * s
    line = plotting.branches._smooth(np.column_stack([s, x, y]))
    at = (np.sqrt(1.0 + 0.4 * line[:, 0]) - 1.0) / 0.2
    np.testing.assert_allclose(line[:, 1], 2.0 * at - 0.2 * at * at, rtol=0, atol=1e-13)


def test_shares_of_cells_without_an_attractor_are_those_of_the_starts(ax):
    """Cells beyond a stop are no starts: of twelve cells four are none, and two of the eight others are unresolved."""
    basins = fakes.basins()
    basins.labels, basins.states = np.zeros((3, 4), int), np.ones((3, 4), int)
    basins.labels[0], basins.states[0] = -1, 2
    basins.labels[1, :2], basins.states[1, :2] = -1, 0
    plotting.plot_basins(basins, ax)
    words = [text.get_text() for text in ax.get_legend().get_texts()]
    assert any(word.startswith("unresolved: 25") for word in words), words


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_responses_show_where_there_is_one_in_any_unit(unit):
    """From a tenth of the highest peak on; the measure has its unit, the parameter keeps its own."""
    p = np.linspace(0.5, 1.5, 201)
    made = fakes.FakeBranch({"omega": p, "rms_0": unit / (1.0 + 400.0 * (p - 1.0) ** 2), "stable": np.ones(201)}, [], "omega")
    made.column_names = ("omega", "rms_0", "stable")
    ax = plotting.plot_responses([made], [0.1], "zeta", measure="rms_0")
    assert ax.get_xlim() == pytest.approx((0.85, 1.15), abs=0.01)
