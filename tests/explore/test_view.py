"""The page without a browser: pictures as plain arrays, and a document that is drawn, clicked and dragged by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc.explore import model, pictures
from bifurc.plotting import style

pytest.importorskip("bokeh")
from bokeh.document import Document
from bokeh.events import ButtonClick, RangesUpdate, Tap

from bifurc.explore import view
from bifurc.explore.view import View, _basin_table, _cells, _diagram_key, _event_table, _range

WINDOW = {"q0": (-3.0, 1.0), "v0": (-4.0, 4.0)}


@pytest.fixture(scope="module")
def shown():
    first = model.of_system(bf.systems.impact_oscillator(), bounds=(0.5, 2.0), window=WINDOW)
    session = model.Session(first)
    session.put(model.begin(first))
    session.put(model.trace_here(session.now))
    session.put(model.map_here(session.now, WINDOW, 16))
    return session.now


def other(shown, **more):
    """Return the same page with other parts."""
    return SimpleNamespace(
        **{
            **{
                name: getattr(shown, name)
                for name in (
                    "system",
                    "parameter",
                    "bounds",
                    "measure",
                    "branches",
                    "orbit",
                    "basins",
                    "message",
                    "special_point",
                    "window",
                )
            },
            "fits": shown.fits,
            **more,
        }
    )


# pictures


def test_the_diagram_is_the_branch(shown):
    branch = shown.branches[0].value
    data = pictures.diagram(shown)
    x, y = (np.concatenate(data["lines"][name]) for name in ("xs", "ys"))
    column = branch.column("rms_0")
    for p, value in zip(branch.column("omega"), column, strict=True):
        assert np.hypot(x - p, y - value).min() < 1e-9
    stable = np.array([s is True or s == 1 for s in branch.column("stable")])
    for xs, dash, width in zip(data["lines"]["xs"], data["lines"]["dash"], data["lines"]["width"], strict=True):
        assert (width == 2.2) == (dash == "solid")
        if len(xs) > 4:
            inner = 0.5 * (xs[1:-1].min() + xs[1:-1].max())
            assert dash in ("solid", "dashed", "dotted") and np.isfinite(inner)
    assert "solid" in data["lines"]["dash"] and ("dashed" in data["lines"]["dash"]) == (not stable.all())
    assert set(data["lines"]["color"]) <= {style.BLACK, style.IMPACTING, style.FREE} and style.IMPACTING in data["lines"]["color"]
    assert data["points"]["x"] == [point.parameter for point in branch.special_points]
    np.testing.assert_allclose(data["points"]["y"], [point.measures["rms_0"] for point in branch.special_points], rtol=1e-9)
    folds = [k for k, point in enumerate(branch.special_points) if point.kind == "fold"]
    assert folds and all(data["points"]["words"][k] == style.POINTS["fold"][2] for k in folds)
    assert all(data["points"]["marker"][k] == pictures._MARKERS[style.POINTS["fold"][0]] for k in folds)
    assert set(data["points"]["line"]) == {"black"}


def test_branches_of_other_parameters_are_pale(shown):
    pale = pictures.diagram(other(shown, fits=lambda branch: False))
    assert set(pale["lines"]["color"]) == {pictures._PALE} and set(pale["lines"]["words"]) == {"other parameters"}
    assert set(pale["points"]["fill"]) == {"white"} and set(pale["points"]["line"]) == {pictures._PALE}
    for none in ({"parameter": "zeta"}, {"measure": "rms_7"}, {"branches": ()}):
        empty = pictures.diagram(other(shown, **none))
        assert not empty["lines"]["xs"] and not empty["points"]["x"] and set(empty["lines"]) == set(pale["lines"])


def test_measures_of_one_orbit(shown):
    orbit = shown.orbit.value
    _, y = orbit.sample(4001)
    for name, want in (
        ("max_0", y[:, 0].max()),
        ("min_0", y[:, 0].min()),
        ("rms_0", orbit.rms(0)),
        ("h1_0", abs(orbit.harmonic(1, 0))),
        ("period", orbit.period),
        ("n_events", len(orbit.events)),
    ):
        assert pictures.measure_of(orbit, name) == pytest.approx(want, rel=1e-5)
    assert pictures.measure_of(orbit, "stable") is None and pictures.measure_of(orbit, "multiplier_1") is None
    assert pictures.chosen(shown) == {"x": [shown.system.omega], "y": [orbit.rms(0)]}
    assert pictures.chosen(other(shown, orbit=None)) == {"x": [], "y": []}
    assert pictures.chosen(other(shown, measure="stable")) == {"x": [], "y": []}


def test_a_motion_with_its_jumps_events_and_stop(shown):
    change = model.pick(shown, 1.2, 1.0, (1.5, 1.2))
    orbit = change["orbit"].value
    hits = [event for event in orbit.events if event.kind == "impact"]
    assert hits
    data = pictures.motion(orbit, 0)
    unit = 2.0 * np.pi / orbit.system.omega
    np.testing.assert_allclose(data["history"]["t"][[0, -1]], [0.0, orbit.period / unit])
    assert data["t_range"] == (0.0, pytest.approx(orbit.period / unit))
    t, y = orbit.sample(len(data["history"]["t"]))
    np.testing.assert_allclose(data["history"]["x"], y[:, 0])
    assert data["section"] == {"x": [y[0, 0]], "v": [y[0, 1]]}
    x, v = data["phase"]["x"], data["phase"]["v"]
    gaps = np.flatnonzero(np.isnan(x))
    assert len(gaps) == len(hits) and len(x) == len(t) + 3 * len(hits)
    for k, event in zip(gaps, hits, strict=True):  # the line ends before the jump and begins behind it
        assert (x[k - 1], v[k - 1]) == (event.before[0], event.before[1]) and (x[k + 1], v[k + 1]) == (
            event.after[0],
            event.after[1],
        )
    assert data["jumps"] == {"xs": [[e.before[0], e.after[0]] for e in hits], "vs": [[e.before[1], e.after[1]] for e in hits]}
    assert data["marks"]["t"] == pytest.approx([event.time / unit for event in orbit.events])
    assert data["marks"]["x"] == pytest.approx([event.before[0] for event in orbit.events])
    assert data["marks"]["words"][0] == style.EVENTS["impact"][2] and data["marks"]["fill"][0] == style.EVENTS["impact"][1]
    mu = orbit.multipliers
    np.testing.assert_allclose(data["multipliers"]["re"] + 1j * data["multipliers"]["im"], mu)
    assert data["multipliers"]["fill"] == [style.BLUE if abs(m) < 1 else style.VERMILION for m in mu]
    low, high = data["x_range"]
    margin = 0.06 * np.ptp(y[:, 0])
    gap = orbit.system.parameter("gap")
    assert low == pytest.approx(y[:, 0].min() - margin) and high == pytest.approx(max(y[:, 0].max(), gap) + margin)
    reach = 0.06 * np.ptp(y[:, 1])
    assert data["v_range"] == (pytest.approx(y[:, 1].min() - reach), pytest.approx(y[:, 1].max() + reach))
    walls = data["walls"]
    assert walls["x0"] == [gap] and walls["fixed"] == [True] and walls["hatch"] == ["right_diagonal_line"]
    assert walls["x1"][0] > gap + 1e5 and walls["xs"][0][-1] == walls["x1"][0] and walls["xs"][0][0] == gap
    assert walls["ts"][0][-2:] == [pytest.approx(t[-1] / unit), 0.0]


def test_a_motion_with_a_stop_that_moves_below_it():
    system = bf.System(
        1.0,
        0.2,
        1.0,
        [bf.elements.HarmonicForce(0.3), bf.elements.RigidStop(gap=0.9, restitution=0.5, side=-1, amplitude=0.1, harmonic=1)],
        omega=0.7,
    )
    data = pictures.motion(bf.find_orbit(system), 0)
    walls = data["walls"]
    assert walls["fixed"] == [False] and np.isnan(walls["x0"]).all() and np.isnan(walls["x1"]).all()
    surface = np.array(walls["xs"][0][:-2])
    assert np.ptp(surface) == pytest.approx(0.2, rel=1e-3) and surface.mean() == pytest.approx(-0.9, abs=1e-2)
    assert walls["xs"][0][-1] < -1e4 and data["x_range"][0] < surface.min() < data["x_range"][1]


def test_a_slice_of_starts(shown):
    basins = shown.basins.value
    data = pictures.starts(basins)
    assert data["cells"].shape == (16, 16) and data["cells"].dtype == np.uint8 and data["box"] == (-3.0, -4.0, 1.0, 4.0)
    codes = data["cells"].T
    for a in np.unique(basins.labels):
        assert len(np.unique(codes[(basins.labels == a) & basins.starts])) == 1
    assert len(data["palette"]) > len(basins.attractors)
    labels = data["marks"]["label"]
    assert set(labels) == {str(k) for k in range(len(basins.attractors))}
    first = basins.points(0)[0]
    k = labels.index("0")
    assert (data["marks"]["x"][k], data["marks"]["y"][k]) == (first[0], first[1])


# the page


class Desk:
    """Notes what a page asks for."""

    def __init__(self, now):
        self.now, self.asked, self.busy = now, [], []
        self.session = SimpleNamespace(can_go_back=False)

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return lambda *arguments, **keywords: self.asked.append((name, *arguments, *keywords.items()))


@pytest.fixture
def page(shown):
    desk = Desk(shown)
    return View(Document(), desk), desk


def tap(x, y):
    return Tap(None, x=x, y=y)


def test_a_page_shows_all_parts(page, shown):
    made, desk = page
    orbit = shown.orbit.value
    assert made.diagram.xaxis.axis_label == "omega" and made.diagram.yaxis.axis_label == "rms_0"
    assert made.here.data == {"x": [shown.system.omega], "y": [orbit.rms(0)]}
    ys = np.concatenate(made.lines.data["ys"])
    margin = 0.05 * np.ptp(ys)
    assert (made.diagram.y_range.start, made.diagram.y_range.end) == (
        pytest.approx(ys.min() - margin),
        pytest.approx(ys.max() + margin),
    )
    assert (made.diagram.x_range.start, made.diagram.x_range.end) == (pytest.approx(0.5 - 0.045), pytest.approx(2.0 + 0.045))
    assert made.measure.value == "rms_0" and "max_0" in made.measure.options and "stable" not in made.measure.options
    assert made.name.value == "omega" and "zeta" in made.name.options
    assert (made.value.start, made.value.end, made.value.value) == (0.5, 2.0, shown.system.omega)
    assert made.value.step == pytest.approx(1.5e-3)
    assert made.phase.title.text.endswith(", stable") and made.phase.xaxis.axis_label == "x"
    assert made.circle.title.text == f"multipliers, largest {np.abs(orbit.multipliers).max():.5g}"
    assert made.circle.x_range.end == 1.25 and made.circle.y_range.start == -1.25
    assert made.slice.title.text == f"starts, 16 x 16 cells, omega = {shown.system.omega:.6g}: zoom, or click one"
    assert (made.slice.x_range.start, made.slice.x_range.end) == (-3.0, 1.0) and made.slice.y_range.end == 4.0
    assert made.slice.xaxis.axis_label == "q0 at phase 0" and made.slice.yaxis.axis_label == "v0 at phase 0"
    cells = made.cells.data
    assert (cells["x"], cells["y"], cells["dw"], cells["dh"]) == ([-3.0], [-4.0], [4.0], [8.0])
    assert made.colors.low == -0.5 and made.colors.high == len(made.colors.palette) - 0.5
    assert made.buttons["switch here"].disabled and made.buttons["back"].disabled
    assert not made.buttons["trace here"].disabled and not made.buttons["save"].disabled and not made.buttons["map here"].disabled
    assert "impact_oscillator" in made.head.text and "computing" not in made.head.text and "last step" in made.message.text
    assert desk.asked == []


def test_what_is_done_on_a_page_is_handed_on_once(page, shown):
    made, desk = page
    made._tapped(tap(1.1, 0.7))
    made._zoomed(RangesUpdate(None, x0=0.5, x1=-1.0, y0=2.0, y1=-3.0))
    made.value.value = 1.3
    made._dragged(1.25, True)
    made.measure.value = "max_0"
    (name, x, y, span), (zoom, window), drag, end, measure = desk.asked
    assert (name, x, y) == ("pick", 1.1, 0.7)
    assert span == (made.diagram.x_range.end - made.diagram.x_range.start, made.diagram.y_range.end - made.diagram.y_range.start)
    assert (zoom, window) == ("zoom", {"q0": (-1.0, 0.5), "v0": (-3.0, 2.0)})
    assert (
        drag == ("change", "omega", 1.3, False) and end == ("change", "omega", 1.25, True) and measure == ("show_measure", "max_0")
    )
    desk.asked.clear()
    made.name.value = "zeta"  # sets the slider, which is nobody's wish
    assert desk.asked == [] and made.value.title == "zeta" and made.value.value == 0.05
    assert (made.value.start, made.value.end) == model.reach(0.05)
    made.name.value = "omega"
    assert (made.value.start, made.value.end) == (0.5, 2.0)
    for label, action in (
        ("trace here", "trace"),
        ("switch here", "switch"),
        ("map here", "map"),
        ("back", "back"),
        ("reset", "reset"),
        ("save", "save"),
    ):
        made.buttons[label]._trigger_event(ButtonClick(made.buttons[label]))
        assert desk.asked.pop() == (action,)


def test_only_what_has_changed_is_drawn_again(page, shown, monkeypatch):
    made, desk = page
    drawn = []
    for part in ("_draw_diagram", "_draw_orbit", "_draw_starts", "_draw_values", "_draw_words"):
        monkeypatch.setattr(View, part, lambda self, *arguments, part=part: drawn.append(part))
    made.draw()
    assert drawn == ["_draw_words"]
    for change, parts in (
        ({"message": "m"}, []),
        ({"orbit": None}, ["_draw_orbit"]),
        ({"basins": None}, ["_draw_starts"]),
        ({"measure": "max_0"}, ["_draw_diagram", "_draw_orbit"]),
        ({"branches": ()}, ["_draw_diagram"]),
        ({"system": shown.system.with_parameters(omega=1.1)}, ["_draw_diagram", "_draw_values"]),
    ):
        desk.now = shown
        made.draw()
        drawn.clear()
        desk.now = other(shown, **change)
        made.draw()
        assert drawn == [*parts, "_draw_words"]
    waiting = []
    made.doc = SimpleNamespace(add_next_tick_callback=waiting.append)
    made.changed()
    made.changed()
    assert waiting == [made.draw]  # once, until it is drawn
    made.draw()
    made.changed()
    assert len(waiting) == 2


def test_a_page_without_orbit_map_and_branch(shown):
    desk = Desk(other(shown, orbit=None, basins=None, branches=(), message="<nothing> yet"))
    desk.busy, desk.session.can_go_back = ["orbit", "map"], True
    made = View(Document(), desk)
    assert made.phase.title.text == "no orbit" and made.events.text == "" and made.circle.title.text == "multipliers"
    assert all(not column for name in ("phase", "jumps", "marks") for column in made.sources[name].data.values())
    assert made.slice.title.text == "starts: press 'map here'" and made.legend.text == "" and made.cells.data["image"] == []
    assert made.here.data == {"x": [], "y": []} and (made.diagram.y_range.start, made.diagram.y_range.end) == (-0.05, 1.05)
    assert made.buttons["trace here"].disabled and made.buttons["map here"].disabled and not made.buttons["save"].disabled
    assert not made.buttons["back"].disabled and "&lt;nothing&gt; yet" in made.message.text
    assert "computing: orbit, map ..." in made.head.text
    made._zoomed(RangesUpdate(None, x0=0.0, x1=1.0, y0=0.0, y1=1.0))
    assert desk.asked == []
    desk.now = shown
    made.draw()
    assert made.slice.title.text.startswith("starts, 16 x 16") and made.phase.title.text != "no orbit"


def test_a_value_outside_the_slider_widens_it(page, shown):
    made, desk = page
    desk.now = other(shown, system=shown.system.with_parameters(omega=2.5))
    made.draw()
    assert (made.value.start, made.value.end, made.value.value) == (0.5, 2.5, 2.5) and desk.asked == []
    desk.now = other(shown, system=shown.system.with_parameters(omega=0.25))
    made.draw()
    assert (made.value.start, made.value.value) == (0.25, 0.25)


def test_words_of_multipliers(page):
    made, _ = page
    made._draw_multipliers(np.array([2.0 + 1j, 0.5]))
    assert made.circle.title.text == f"multipliers, largest {5.0**0.5:.5g}" and made.circle.x_range.end == pytest.approx(
        1.25 * 5.0**0.5
    )
    made._draw_multipliers(np.array([np.inf, 0.5]))
    assert made.circle.title.text == "multipliers, infinite or not unique" and made.circle.x_range.end == 1.25
    made._draw_multipliers(np.array([]))
    assert made.circle.title.text == "multipliers"


def test_tables_and_keys(shown):
    def event(k):
        return SimpleNamespace(time=k * np.pi, kind="impact", element="stop<1>", speed=1.5)

    orbit = SimpleNamespace(events=[event(k) for k in range(12)], system=SimpleNamespace(omega=2.0))
    table = _event_table(orbit)
    assert (
        table.count("<tr>") == 10
        and "and 3 more" in table
        and "<td>2.000000</td><td>impact</td><td>stop&lt;1&gt;</td><td>1.5</td>" in table
    )
    orbit.events = orbit.events[:9]
    assert "more" not in _event_table(orbit)
    orbit.events = []
    assert _event_table(orbit) == "no events in a period"
    assert (
        _cells("a", "<b>") == "<tr><td>a</td><td>&lt;b&gt;</td></tr>"
        and _cells("a", first="<i>") == "<tr><td><i></td><td>a</td></tr>"
    )
    basins = shown.basins.value
    words = _basin_table(basins, pictures.starts(basins)["palette"])
    for k in range(len(basins.attractors)):
        assert f"{100.0 * basins.fractions[k]:.2f} %" in words
    assert "unresolved" in words and ("beyond a stop" in words) == bool((~basins.starts).any())
    key = _diagram_key(
        {
            "lines": {"words": ["free", "free", "a<b"], "color": ["red", "red", "blue"], "dash": ["solid", "solid", "dotted"]},
            "points": {"words": ["fold", "fold", "x"], "marker": ["circle", "circle", "odd"], "fill": ["white", "white", "green"]},
        }
    )
    assert key.count("<span") == 4 and key.count("free") == 1 and "a&lt;b" in key and "stroke-dasharray='2 3'" in key
    assert "fill='black'>&#9675;" in key and "fill='green'>&#9679;" in key


def test_a_range_is_what_reset_returns_to():
    axis = view._figure("t", "a", "b", 100).x_range
    _range(axis, np.float64(1.0), 2)
    assert (axis.start, axis.end, axis.reset_start, axis.reset_end) == (1.0, 2.0, 1.0, 2.0)
    made = view._figure("t", "a", "b", 100, (0.0, 3.0), (1.0, 5.0), width=70)
    assert (made.width, made.height, made.x_range.end, made.y_range.start) == (70, 100, 3.0, 1.0)
    assert (made.xaxis.axis_label, made.yaxis.axis_label, made.title.text) == ("a", "b", "t")
