"""Brute-force diagrams and charts against branches of `trace` and closed forms; the same bits however they are computed."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.basins.sweeps import diagram as diagrams
from bifurc.basins.sweeps.diagram import RESTARTED
from bifurc.basins.sweeps.sections import groups, period_of
from bifurc.jobs.store import fingerprint

A = bf.systems.impact_oscillator(zeta=0.02, omega=2.6, amplitude=1.0, gap=0.0, restitution=0.8)
STORY = bf.systems.impact_oscillator()  # grazes at .696191 and 1.226914, flips at .710690, .824134, .923529, folds at 1.527621


def bits(found):
    header, arrays = found.to_record()
    return fingerprint([{name: value for name, value in header.items() if name != "key"}, arrays])


@pytest.fixture(scope="module")
def diagram():
    return bf.bifurcation_diagram(STORY, "omega", np.linspace(0.8, 1.6, 33), keep=16, workers=1)


def test_periods_change_at_the_closed_form_flips(diagram):
    """Up or down, the motion has period 2 between the flips at .824134 and .923529, and period 1 beyond."""
    inside = (diagram.values > 0.83) & (diagram.values < 0.9235)  # just beside a flip nothing settles
    for k in (0, 1):
        assert (diagram.periods[k, inside, 0] == 2).all()
        assert (diagram.periods[k, diagram.values > 0.93, 0] == 1).all()


def test_up_and_down_jump_at_the_ends_of_the_bistable_range(diagram):
    """Impacting motion is kept upwards to the fold at 1.527621, free motion downwards to the graze at 1.226914."""
    values, hits = diagram.values, diagram.impacts[:, :, 0]
    np.testing.assert_array_equal(hits[0] > 0, values < 1.527621)
    np.testing.assert_array_equal(hits[1] > 0, values < 1.226914)


def test_section_points_lie_on_the_branch(diagram):
    branch = bf.trace(bf.find_orbit(STORY.with_parameters(omega=1.0)), "omega", bounds=(0.95, 1.5))
    for i in (10, 20):
        omega = float(diagram.values[i])
        row = int(np.argmin(np.abs(branch.column("omega") - omega) + (branch.column("n_events") == 0)))
        orbit = bf.find_orbit(STORY.with_parameters(omega=omega), guess=branch.orbits[row])
        np.testing.assert_allclose(diagram.points[0, i, 0, -1], orbit.state, rtol=0, atol=1e-8)


def test_workers_executors_and_saving_change_no_bit(diagram, tmp_path):
    again = bf.bifurcation_diagram(STORY, "omega", np.linspace(0.8, 1.6, 33)[::-1], keep=16, workers=2, chunk=7,
                                   file=tmp_path / "d.npz")
    assert bits(again) == bits(diagram) == bits(bf.load(tmp_path / "d.npz"))
    assert [path.name for path in tmp_path.iterdir()] == ["d.npz"]


def test_an_interrupted_diagram_goes_on(diagram, tmp_path, monkeypatch):
    work, calls = diagrams.diagram_points, []

    def interrupted(payload):
        calls.append(1)
        if len(calls) == 4:
            raise KeyboardInterrupt
        return work(payload)

    monkeypatch.setattr(diagrams, "diagram_points", interrupted)
    request = {"parameter": "omega", "values": np.linspace(0.8, 1.6, 33), "keep": 16, "workers": 1, "chunk": 10,
               "file": tmp_path / "d.npz"}
    with pytest.raises(KeyboardInterrupt):
        bf.bifurcation_diagram(STORY, **request)
    assert bits(bf.bifurcation_diagram(STORY, **request)) == bits(diagram)
    assert len(calls) == 4 + 5  # three of eight were there


def test_several_starts_side_by_side():
    starts = [[0.0, 0.0], [0.9, 0.0]]
    both = bf.bifurcation_diagram(STORY, "omega", [1.3, 1.4], starts, directions="up", keep=4, transient=100)
    for k, start in enumerate(starts):
        alone = bf.bifurcation_diagram(STORY, "omega", [1.3, 1.4], start, directions="up", keep=4, transient=100)
        np.testing.assert_array_equal(both.points[:, :, k], alone.points[:, :, 0])


def test_a_state_behind_a_stop_that_moved_in_starts_anew():
    found = bf.bifurcation_diagram(STORY.with_parameters(omega=3.0), "gap", [-0.5, 0.0, 0.5], [-0.6, 0.0], transient=50, keep=4)
    down = found.outcomes[1, :, 0]
    assert (down % RESTARTED == 0).all() and np.isfinite(found.points).all()
    assert set(down.tolist()) <= {0, RESTARTED} and "ended" not in repr(found)


@pytest.mark.parametrize(("change", "words"), [
    ({"directions": "left"}, "directions = .* is not allowed; it must be 'up', 'down', or both"),
    ({"starts": [0.0]}, "starts = .* is not allowed"),
    ({"keep": 1}, "keep = 1 is not allowed"),
    ({"parameter": "mass"}, "mass"),
])
def test_bad_requests(change, words):
    request = {"parameter": "omega", "values": [1.0, 1.1], **change}
    with pytest.raises(ValueError, match=words):
        bf.bifurcation_diagram(STORY, **request)


def test_period_of_rows():
    row = np.tile(np.array([[0.0, 1.0], [1.0, 2.0], [2.0, 0.0]]), (4, 1))
    scale = np.ones(2)
    assert period_of(row, scale, 1e-6) == 3
    assert period_of(row[:5], scale, 1e-6) == 0  # seen less than twice
    assert period_of(np.cumsum(np.ones((8, 2)), axis=0), scale, 1e-6) == 0
    rows = np.array([row[:9], row[1:10], row[:9] + 5.0])
    assert groups(rows, np.array([3, 3, 3]), scale, 1e-6).tolist() == [0, 0, 1]
    assert groups(rows, np.array([0, 3, 0]), scale, 1e-6).tolist() == [0, 1, 0]


# charts

@pytest.fixture(scope="module")
def chart():
    return bf.parameter_chart(STORY, {"omega": [0.87, 1.0, 1.4, 1.6], "amplitude": [0.3, 0.52]}, {"q0": (-3, 1), "v0": (-4, 4)},
                              starts=12, longest=4, exponents=True, workers=1)


def test_a_chart_knows_the_story(chart):
    """At amplitude .52: two motions of period two, one of one, two between graze and fold, one free; at 1.6 nothing touches."""
    assert chart.periods[:, 1].tolist() == [2, 1, 1, 1]
    assert chart.attractors[:, 1].tolist() == [2, 1, 2, 1]
    assert chart.impacts[3].tolist() == [0.0, 0.0] and chart.impacts[1, 1] == 1.0
    assert (chart.settled == 12).all() and (chart.exponents < 0).all()


def test_its_exponents_are_those_of_the_multipliers(chart):
    """Free motion: -zeta; a periodic one: log|multiplier| over the period."""
    np.testing.assert_allclose(chart.exponents[3, 0], -0.05, rtol=1e-3)  # of a finite time
    orbit = bf.find_orbit(STORY.with_parameters(omega=1.0, amplitude=0.52))
    np.testing.assert_allclose(chart.exponents[1, 1], np.log(abs(orbit.multipliers[0])) / orbit.period, rtol=1e-2)


def test_chunks_workers_and_saving_change_no_bit_of_a_chart(chart, tmp_path):
    again = bf.parameter_chart(STORY, {"omega": [0.87, 1.0, 1.4, 1.6], "amplitude": [0.3, 0.52]}, {"q0": (-3, 1), "v0": (-4, 4)},
                               starts=12, longest=4, exponents=True, workers=2, chunk=3, file=tmp_path / "c.npz")
    assert bits(again) == bits(chart) == bits(bf.load(tmp_path / "c.npz"))


def test_starts_that_cannot_be_followed_leave_a_cell_blank():
    region = {"q0": (-3, 1), "v0": (-4, 4)}
    chart = bf.parameter_chart(STORY, {"gap": [-5.0, 1.0], "omega": [1.0, 1.1]}, region, starts=4, longest=2)
    assert chart.periods[0].tolist() == [-1, -1] and chart.settled[0].tolist() == [0, 0] and (chart.periods[1] == 1).all()


def test_bad_charts():
    with pytest.raises(ValueError, match="it must name two parameters"):
        bf.parameter_chart(STORY, {"omega": [1.0]}, {"q0": (-3, 1)})
    with pytest.raises(ValueError, match="field = 'period' is not allowed"):
        small = bf.parameter_chart(STORY, {"omega": [1.0], "gap": [1.0]}, {"q0": (-1, 1)}, starts=1, transient=1, longest=1)
        small.plot(field="period")


def test_periods_are_told_in_any_unit_of_time():
    """A motion that has come near its orbit, not onto it: how near is told in natural sizes of places and of speeds."""
    found = []
    for unit in (1.0, 2.0**-20, 2.0**20):
        elements = [bf.elements.HarmonicForce(0.5 / unit**2), bf.elements.RigidStop(0.3, 0.7)]
        system = bf.System(1.0, 0.1 / unit, 1.0 / unit**2, elements, omega=1.5 / unit)
        made = bf.bifurcation_diagram(system, "gap", np.linspace(0.25, 0.35, 3), starts=[0.1, 0.2 / unit], transient=30, keep=4,
                                      directions="up", workers=1)
        found.append((made.periods.tolist(), made.impacts.tolist()))
        away = np.ptp(made.points[0, ..., 0], axis=-1)
        assert (made.periods == 1).all() and 1e-10 < away.max() < 1e-7
    assert found[1] == found[0] and found[2] == found[0]
