"""Results in notebooks, as tables, with labels of the user, and moving."""
import base64
import io
import re

import matplotlib.image
import numpy as np
import pytest

import bifurc as bf
from bifurc.notebook import Table, short


@pytest.fixture(scope="module")
def system():
    return bf.systems.impact_oscillator(omega=1.4)


@pytest.fixture(scope="module")
def orbit(system):
    return bf.find_orbit(system, guess=(-0.2, 2.4))


@pytest.fixture(scope="module")
def branch(orbit):
    return bf.trace(orbit, "omega", bounds=(1.3, 1.6))


@pytest.fixture(scope="module")
def basins(system):
    return bf.basins_of_attraction(system, bf.Grid(q0=(-3, 1, 12), v0=(-4, 4, 10)))


def picture(text):
    """Return the thumbnail of an HTML representation."""
    found = re.search(r"src=.data:image/png;base64,([^']+)'", text)
    assert found, text[:300]
    return matplotlib.image.imread(io.BytesIO(base64.b64decode(found[1])))


def test_what_is_written_is_text_and_no_markup():
    class Rows(Table):
        _fields = ("a<b", "name")
    made = Rows([type("Row", (), {"a<b": "<script>", "name": "x & y"})()])._repr_html_()
    assert "<td>&lt;script&gt;</td><td>x &amp; y</td>" in made and "<th>a&lt;b</th>" in made


def test_numbers_are_written_in_few_digits_with_their_signs():
    assert [short(z) for z in (1.25 + 0.5j, 1.25 - 0.5j, 1.25 + 0.0j, np.complex128(-2.0 + 1e-3j))] == [
        "1.25+0.5i", "1.25-0.5i", "1.25", "-2+0.001i"]
    assert short(1.0 / 3.0) == "0.333333" and short(np.bool_(True)) == "yes" and short(None) == "unknown"
    assert short(np.arange(6.0)) == "0, 1, 2, 3, ... (6)"


def test_results_show_a_table_and_a_thumbnail(orbit, branch, basins, system):
    motion = bf.simulate(system, (0.0, 0.0), periods=3)
    for result, words in ((orbit, ["PeriodicOrbit(", "stable</th>", "yes"]), (branch, ["Branch(omega", "stop reason", "bound"]),
                          (basins, ["BasinMap(12 x 10", "fractions"]), (motion, ["Trajectory(", "completed"])):
        text = result._repr_html_()
        for word in words:
            assert word in text
        image = picture(text)
        assert image.shape[0] > 100 and np.ptp(image[..., :3]) > 0.5
    assert "<script" not in orbit._repr_html_()


def test_what_cannot_be_drawn_has_a_table_alone(system):
    line = bf.basins_of_attraction(system, bf.Grid(q0=(-1, 1, 6)))
    assert "<img" not in line._repr_html_() and "BasinMap(6 cells" in line._repr_html_()


def test_smaller_results_show_themselves_too(branch, basins):
    belt = bf.find_equilibrium(bf.systems.belt_oscillator())
    loops = bf.hysteresis(bf.systems.macro_slip_contact(case=1))
    exponents = bf.lyapunov_exponents(bf.systems.impact_oscillator(omega=1.4), (0.0, 0.0), periods=80)
    for result, words in ((branch.special_points[0], ["SpecialPoint(", "fold", "located"]), (exponents, ["per period", "no"]),
                          (belt, ["Equilibrium(", "contacts", "stable</th>"])):
        text = result._repr_html_()
        assert "<img" not in text
        assert all(word in text for word in words), text
    for result, word in ((loops, "work"), (loops["x"], "periodic"), (bf.edge_state(basins), "unstable directions")):
        text = result._repr_html_()
        assert word in text and picture(text).shape[0] > 100


def test_tables(orbit, branch, basins):
    pandas = pytest.importorskip("pandas")
    events = orbit.events.to_pandas()
    assert list(events["kind"]) == ["impact"] and events["speed"][0] == orbit.events[0].speed
    points = branch.special_points.to_pandas()
    assert list(points["kind"]) == ["fold"] and points["parameter"][0] == pytest.approx(1.527621, abs=1e-6)
    assert isinstance(branch.to_pandas(), pandas.DataFrame)
    assert "<td>fold</td>" in branch.special_points._repr_html_()
    assert len(branch.special_points.of("fold").to_pandas()) == 1


def test_maps_as_datasets(basins, system):
    pytest.importorskip("xarray")
    data = basins.to_xarray()
    assert data.labels.dims == ("q0", "v0") and data.labels.shape == (12, 10)
    q, v = float(data.q0[3]), float(data.v0[7])
    assert int(data.labels.sel(q0=q, v0=v)) == basins.labels[3, 7] == basins.labeller()(np.array([[q, v]]))[0]
    region = {"q0": (-2, 1), "v0": (-2, 2)}
    chart = bf.parameter_chart(system, {"omega": [1.3, 1.4], "amplitude": [0.5, 0.52, 0.54]}, region, starts=2, transient=50)
    data = chart.to_xarray()
    assert data.periods.dims == ("omega", "amplitude") and np.array_equal(data.periods, chart.periods)
    assert data.amplitude[2] == 0.54
    diagram = bf.bifurcation_diagram(system, "omega", [1.3, 1.4], [[0.0, 0.0]], transient=20, keep=4)
    data = diagram.to_xarray()
    assert np.array_equal(data.points.sel(omega=1.4), diagram.points[:, 1], equal_nan=True)


def test_names_label_the_axes_of_one_picture(branch, orbit, basins):
    axes = branch.plot(names={"omega": "speed (rad/s)", "rms_0": "rms (mm)"})
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("speed (rad/s)", "rms (mm)")
    assert branch.plot().get_xlabel() != "speed (rad/s)"
    phase, history = orbit.plot(names={"q0": "x (mm)", "v0": "x' (mm/s)"})
    assert (phase.get_xlabel(), phase.get_ylabel(), history.get_ylabel()) == ("x (mm)", "x' (mm/s)", "x (mm)")
    assert basins.plot(names={"q0": "x (mm)"}).get_xlabel().startswith("x (mm)")
    with pytest.raises(ValueError, match="names = 'x'"):
        orbit.plot(names="x")


def test_an_orbit_moves(orbit, tmp_path):
    from PIL import Image

    orbit.animate(tmp_path / "orbit.gif", frames=7)
    with Image.open(tmp_path / "orbit.gif") as image:
        assert image.n_frames == 7
    animation = bf.plotting.animate_orbit(orbit, frames=5)
    point, _, _ = animation._func(2)
    t, y = orbit.sample(6)
    assert (point.get_xdata()[0], point.get_ydata()[0]) == pytest.approx(y[2])
    animation._draw_was_started = True  # it is not shown here
    with pytest.raises(ValueError, match="gif"):
        orbit.animate(tmp_path / "orbit.avi")
    with pytest.raises(ValueError, match="frames"):
        orbit.animate(frames=1)
