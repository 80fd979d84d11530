"""Pictures of stand-ins whose motions, cells and branches are written out: every column belongs to its neighbour."""
import math
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import ElasticStop, HarmonicForce, RigidStop
from bifurc.explore import pictures
from bifurc.plotting import style
from bifurc.plotting.basins import cell_codes

W = 2.0


class Orbit:
    """q0 = 3 cos W t, q1 = 1 + 2 sin W t over two forcing periods, with events that are told."""

    def __init__(self, elements=(), events=(), multipliers=None):
        self.system = bf.System(np.eye(2), 0.1 * np.eye(2), np.eye(2), (HarmonicForce(1.0, dof=0), *elements), omega=W)
        self.events, self.multipliers, self.period = list(events), multipliers, 4.0 * np.pi / W

    def sample(self, count):
        t = np.linspace(0.0, self.period, count)
        c, s = np.cos(W * t), np.sin(W * t)
        return t, np.column_stack([3.0 * c, 1.0 + 2.0 * s, -3.0 * W * s, 2.0 * W * c])

    def maximum(self, dof):
        return 3.0 + 10.0 * dof

    def minimum(self, dof):
        return -3.0 - 10.0 * dof

    def rms(self, dof):
        return 0.5 + dof

    def harmonic(self, k, dof):
        return (3.0 + 4.0j) * k * (1.0 + dof)


def event(kind, time, before, after):
    return SimpleNamespace(kind=kind, time=time, before=np.array(before), after=np.array(after))


@pytest.mark.parametrize("dof", [0, 1])
def test_a_motion_shows_the_coordinate_that_is_asked_for(dof):
    events = [event("impact", 0.5, [10.0, 11.0, 12.0, 13.0], [14.0, 15.0, 16.0, 17.0]),
              event("contact", 0.8, [20.0, 21.0, 22.0, 23.0], [24.0, 25.0, 26.0, 27.0]),
              event("impact", 2.0, [30.0, 31.0, 32.0, 33.0], [34.0, 35.0, 36.0, 37.0])]
    data = pictures.motion(Orbit(events=events), dof)
    t, y = Orbit().sample(len(data["history"]["t"]))
    unit = np.pi
    np.testing.assert_allclose(data["history"]["t"], t / unit)
    np.testing.assert_allclose(data["history"]["x"], y[:, dof])
    assert data["section"] == {"x": [y[0, dof]], "v": [y[0, 2 + dof]]} and data["t_range"] == (0.0, pytest.approx(2.0))
    x, v = data["phase"]["x"], data["phase"]["v"]
    gaps = np.flatnonzero(np.isnan(x))
    assert (np.flatnonzero(np.isnan(v)) == gaps).all() and len(gaps) == 2
    for k, time, first in zip(gaps, (0.5, 2.0), (10.0, 30.0), strict=True):
        assert [x[k - 1], v[k - 1], x[k + 1], v[k + 1]] == [first + dof, first + 2 + dof, first + 4 + dof, first + 6 + dof]
        later = t[t >= time][0]  # the line goes on with the first point behind the event
        assert x[k + 2] == pytest.approx(np.interp(later, t, y[:, dof])) and x[k - 2] == pytest.approx(y[t < time][-1, dof])
    assert data["jumps"]["xs"] == [[10.0 + dof, 14.0 + dof], [30.0 + dof, 34.0 + dof]]
    assert data["jumps"]["vs"] == [[12.0 + dof, 16.0 + dof], [32.0 + dof, 36.0 + dof]]
    np.testing.assert_allclose(data["marks"]["t"], np.array([0.5, 0.8, 2.0]) / unit)
    assert data["marks"]["x"] == [10.0 + dof, 20.0 + dof, 30.0 + dof]
    assert data["marks"]["words"] == [style.EVENTS[kind][2] for kind in ("impact", "contact", "impact")]
    assert data["marks"]["fill"] == [style.EVENTS[kind][1] for kind in ("impact", "contact", "impact")]
    assert data["marks"]["marker"] == [pictures._MARKERS[style.EVENTS[kind][0]] for kind in ("impact", "contact", "impact")]
    low, high = data["v_range"]
    size = W * (3.0, 2.0)[dof]
    assert low + high == pytest.approx(0.0, abs=1e-3) and 1.05 * size < high < 1.3 * size


def test_multipliers_inside_the_circle_are_told_from_those_outside_by_colour():
    mu = np.array([0.99, -1.01, 0.6 + 0.8j, 0.5j, np.inf, complex(np.nan, 0.0)])
    data = pictures.motion(Orbit(multipliers=mu), 0)
    shown = data["multipliers"]
    assert shown["re"].tolist() == [0.99, -1.01, 0.6, 0.0] and shown["im"].tolist() == [0.0, 0.0, 0.8, 0.5]
    assert data["multipliers"]["fill"][:2] == [style.BLUE, style.VERMILION] and data["multipliers"]["fill"][3] == style.BLUE
    assert len(data["all"]) == 6 and pictures.motion(Orbit(), 0)["multipliers"]["fill"] == []


def test_stops_on_both_sides_are_in_the_picture_and_lead_away_from_the_motion():
    moving = RigidStop(4.0, 0.8, dof=1, side=-1, amplitude=0.5, phase=0.3, harmonic=1)
    stops = (RigidStop(5.0, 0.8, dof=1), moving, ElasticStop(9.0, 2.0, dof=0))
    orbit = Orbit(elements=stops)
    data = pictures.motion(orbit, 1)
    walls, t = data["walls"], orbit.sample(len(data["history"]["t"]))[0]
    n = len(t)
    assert len(walls["xs"]) == 2 and walls["fixed"] == [True, False]
    assert walls["x0"][0] == 5.0 and walls["x1"][0] > 1e3 and np.isnan(walls["x0"][1]) and np.isnan(walls["x1"][1])
    surface = np.array(walls["xs"][1][:n])
    assert (surface < -3.0).all() and np.ptp(surface) == pytest.approx(1.0, rel=1e-4) and walls["xs"][1][-1] < -1e3
    np.testing.assert_allclose(surface.mean(), -4.0, atol=1e-2)
    np.testing.assert_allclose(walls["xs"][0], [5.0] * n + [walls["x1"][0]] * 2)
    for ts in walls["ts"]:
        np.testing.assert_allclose(ts, [*(t / np.pi), 2.0, 0.0])
    low, high = data["x_range"]  # the motion reaches from -1 to 3
    assert low < surface.min() - 0.1 and 5.1 < high < 6.0 and low > -6.0
    free = pictures.motion(Orbit(), 1)["x_range"]
    assert -1.5 < free[0] < -1.1 and 3.1 < free[1] < 3.5
    soft = pictures.motion(orbit, 0)["walls"]
    assert soft["hatch"] == ["blank"] and soft["x0"] == [9.0] and walls["hatch"] == ["right_diagonal_line"] * 2
    assert (np.array(soft["xs"][0]) >= 9.0).all()


def test_measures_read_the_coordinate_in_their_name():
    orbit = Orbit(events=[1, 2, 3])
    assert [pictures.measure_of(orbit, f"{kind}_1") for kind in ("max", "min", "rms", "h1")] == [13.0, -13.0, 1.5, 10.0]
    assert pictures.measure_of(orbit, "max_12") == 123.0 and pictures.measure_of(orbit, "n_events") == 3.0
    assert pictures.measure_of(orbit, "period") == orbit.period and pictures.measure_of(orbit, "h2_0") is None


def test_lines_and_points_of_every_branch_keep_their_looks_together(monkeypatch):
    looks = [("free, stable", False, 1), ("impacts, unstable", True, 0), ("unknown", None, -1), ("free, unstable", False, 0)]

    def runs(branch, measure):
        assert measure == "rms_0"
        first = branch.first
        return [(words, contact, stable, [first + k], [first - k]) for k, (words, contact, stable) in enumerate(looks)], [7.0, 8.0]
    monkeypatch.setattr(pictures, "runs", runs)
    points = [SimpleNamespace(kind="fold", parameter=0.3), SimpleNamespace(kind="some_new_kind", parameter=0.4)]
    branches = [SimpleNamespace(value=SimpleNamespace(column_names=("rms_0",), parameter=name, special_points=points, first=first))
                for name, first in (("omega", 10.0), ("zeta", 20.0), ("omega", 30.0))]
    shown = SimpleNamespace(branches=branches, measure="rms_0", parameter="omega", fits=lambda branch: branch is branches[2])
    data = pictures.diagram(shown)
    lines, marks = data["lines"], data["points"]
    assert [x[0] for x in lines["xs"]] == [10.0, 11.0, 12.0, 13.0, 30.0, 31.0, 32.0, 33.0]
    assert [y[0] for y in lines["ys"]] == [10.0, 9.0, 8.0, 7.0, 30.0, 29.0, 28.0, 27.0]
    assert lines["dash"] == ["solid", "dashed", "dotted", "dashed"] * 2  # unstable stays visible, pale or not
    assert lines["width"][0] > lines["width"][1] == lines["width"][2] == lines["width"][3]
    assert len(set(lines["color"][:4])) == 1 and lines["color"][4:] == [style.FREE, style.IMPACTING, style.BLACK, style.FREE]
    assert lines["words"] == ["other parameters"] * 4 + [words for words, _, _ in looks]
    assert marks["x"] == [0.3, 0.4] * 2 and marks["y"] == [7.0, 8.0] * 2
    assert marks["words"] == ["other parameters"] * 2 + [style.POINTS["fold"][2], "some new kind"]
    assert marks["line"][2:] == ["black"] * 2 and "black" not in marks["line"][:2] and marks["fill"][:2] == ["white"] * 2
    assert marks["marker"][0] == marks["marker"][2] == pictures._MARKERS[style.POINTS["fold"][0]] and marks["marker"][1] == "circle"
    assert marks["fill"][2] == style.POINTS["fold"][1] and marks["fill"][3] == style.GREY


@pytest.mark.parametrize("names", [("q0", "v0"), ("v0", "q0")])
def test_cells_lie_across_and_up_as_their_axes(names):
    """Labels over the first and second component; an image has the second one upwards in its rows."""
    orbit = SimpleNamespace(sections=np.array([[1.0, 2.0], [3.0, 4.0]]), periodic=True)
    other = SimpleNamespace(sections=np.array([[5.0, 6.0]]), periodic=True)
    grid = bf.Grid(**{names[0]: (-1.0, 7.0, 3), names[1]: (0.0, 8.0, 2)})
    labels = np.array([[0, 1], [1, 1], [-1, 0]])
    system = bf.systems.impact_oscillator()
    basins = SimpleNamespace(labels=labels, states=None, attractors=[orbit, other], grid=grid, system=system, scale=np.ones(2))
    data = pictures.starts(basins)
    codes = cell_codes(basins)[0]
    assert data["cells"].shape == (2, 3) and all(data["cells"][j, i] == codes[i, j] for i in range(3) for j in range(2))
    tints = [data["palette"][code] for code in data["cells"].ravel()]
    assert tints[0] == tints[5] and tints[1] == tints[3] == tints[4] and len(set(tints)) == 3  # a colour an attractor
    assert data["box"] == (-1.0, 0.0, 7.0, 8.0)
    q, v = [1.0, 3.0, 5.0], [2.0, 4.0, 6.0]
    assert (data["marks"]["x"], data["marks"]["y"]) == ((q, v) if names[0] == "q0" else (v, q))
    one, again, second = data["marks"]["fill"]
    assert data["marks"]["label"] == ["0", "0", "1"] and one == again != second


def test_the_place_of_an_orbit_is_its_parameter_and_its_measure():
    system = bf.systems.impact_oscillator(omega=1.7)
    shown = SimpleNamespace(orbit=SimpleNamespace(value=Orbit()), measure="h1_0", system=system, parameter="omega")
    assert pictures.chosen(shown) == {"x": [1.7], "y": [pytest.approx(math.hypot(3.0, 4.0))]}
    shown.parameter = "gap"
    assert pictures.chosen(shown)["x"] == [system.parameter("gap")]
