"""Harmonic orbits: what find_orbit gives, its measures, events, error estimate, files."""
import numpy as np
import pytest

import bifurc as bf
from bifurc import HarmonicBalance, System, systems
from bifurc.elements import CubicSpring, ElasticStop, HarmonicForce, Jenkins
from bifurc.hbm.status import BalanceStatus


@pytest.fixture(scope="module")
def slider():
    return bf.find_orbit(systems.jenkins_oscillator(), method=HarmonicBalance(21))


def test_measures_are_those_of_fine_samples(slider):
    t, y = slider.sample(200001)
    assert slider.success and slider.status is BalanceStatus.CONVERGED and slider.message
    assert slider.maximum() == pytest.approx(y[:, 0].max(), abs=1e-8) and slider.maximum() >= y[:, 0].max()
    assert slider.minimum() == pytest.approx(y[:, 0].min(), abs=1e-8)
    assert slider.rms() == pytest.approx(np.sqrt((y[:-1, 0]**2).mean()), abs=1e-10)
    assert t[-1] == pytest.approx(slider.period) and slider.periods == 1
    assert slider.harmonic(0) == pytest.approx(y[:-1, 0].mean(), abs=1e-12)
    assert slider.harmonic(40) == 0.0


def test_states_hold_the_slider_and_satisfy_its_law(slider):
    t, y = slider.sample(20001)
    assert y.shape == (20001, 3)
    u, v, w = y.T
    assert np.abs(u - w).max() <= 1.0 + 1e-12
    np.testing.assert_allclose(np.gradient(u, t, edge_order=2)[1:-1], v[1:-1], atol=1e-4)
    moving = np.abs(np.gradient(w, t)) > 1e-6
    assert np.abs(np.abs(u - w)[moving] - 1.0).max() < 1e-3
    np.testing.assert_allclose(slider.state, y[0], rtol=1e-15, atol=1e-15)


def test_events_lie_where_force_and_speed_say(slider):
    events = slider.events
    assert [str(event.kind) for event in events] == ["stick", "slip", "stick", "slip"]
    assert slider.signature == "jenkins: slip+ stick slip- stick"
    times = np.array([event.time for event in events])
    np.testing.assert_allclose(times[2:] - times[:2], 0.5 * slider.period, atol=1e-9)  # y(t + T/2) = -y(t)
    for event in events:
        u, v, w = event.before
        assert abs(abs(u - w) - 1.0) < 1e-12
        assert event.speed > 0.0
        if event.kind == "stick":
            assert abs(v) < 1e-12


def test_error_estimate_tells_the_distance_from_many_harmonics(slider):
    true = bf.find_orbit(slider.system, guess=slider, method=HarmonicBalance(161))
    t = np.linspace(0.0, 2.0 * np.pi, 4001)
    for H in (5, 9, 21):
        orbit = bf.find_orbit(slider.system, guess=slider, method=HarmonicBalance(H))
        away = np.abs(orbit.layout.values(orbit.coefficients, t) - true.layout.values(true.coefficients, t)).max()
        assert 0.5 * away <= orbit.how["error"][0] <= 5.0 * away


def test_harmonics_are_added_until_the_error_is_small_enough():
    orbit = bf.find_orbit(systems.jenkins_oscillator(), method=HarmonicBalance("auto", tolerance=1e-5))
    assert orbit.success and orbit.how["harmonics tried"][0] == 7 and len(orbit.how["harmonics tried"]) > 1
    assert max(orbit.how["error"]) <= 1e-5 * orbit.maximum()


def test_a_law_takes_the_samples_it_needs():
    system = System(1.0, 0.05, 1.0, [HarmonicForce(0.18), CubicSpring(0.1)], omega=0.9)
    default = bf.find_orbit(system, method=HarmonicBalance(7))
    least = bf.find_orbit(system, guess=default, method=HarmonicBalance(7, samples=29))  # (3 + 1) 7 + 1
    np.testing.assert_allclose(default.coefficients, least.coefficients, atol=1e-14)
    assert default.how["law samples"] == 128


def test_guesses_of_every_kind_lead_to_the_same_orbit(slider):
    system = slider.system
    method = HarmonicBalance(21)
    for guess in (slider, slider.coefficients, slider.state, slider.state[:2]):
        found = bf.find_orbit(system, guess=guess, method=method)
        assert found.success
        np.testing.assert_allclose(found.coefficients, slider.coefficients, atol=1e-10)
    with pytest.raises(ValueError, match="guess has shape"):
        bf.find_orbit(system, guess=np.zeros(5), method=method)


def test_odd_harmonics_alone_give_the_symmetric_motion(slider):
    odd = bf.find_orbit(slider.system, method=HarmonicBalance(tuple(range(1, 22, 2))))
    for k in range(1, 22, 2):
        assert abs(odd.harmonic(k) - slider.harmonic(k)) < 1e-11


def test_orbit_is_saved_and_loaded(slider, tmp_path):
    slider.save(tmp_path / "orbit.npz")
    again = bf.load(tmp_path / "orbit.npz")
    assert np.array_equal(again.coefficients, slider.coefficients)
    assert again.system == slider.system and again.method == slider.method and again.how == slider.how
    assert again.success and "21" in repr(again)


def test_elastic_stops_of_two_masses(rng):
    system = System(np.eye(2), 0.1 * np.eye(2), [[2.0, -1.0], [-1.0, 2.0]],
                    [HarmonicForce(1.0), ElasticStop(0.3, 4.0), Jenkins(1.0, 0.4, row=(1.0, -1.0))], omega=0.9)
    orbit = bf.find_orbit(system, method=HarmonicBalance(15))
    assert orbit.success and orbit.state.shape == (5,)
    kinds = {str(event.kind) for event in orbit.events}
    assert kinds == {"contact", "separation", "slip", "stick"}
    for event in orbit.events:
        if event.element == "elastic_stop":
            assert abs(event.before[0] - 0.3) < 1e-12


def test_resonance_without_damping_is_told():
    orbit = bf.find_orbit(System(1.0, 0.0, 1.0, [HarmonicForce(1.0)], omega=1.0), method=HarmonicBalance(1))
    assert not orbit.success and orbit.status is BalanceStatus.SINGULAR and "damping" in orbit.message


@pytest.mark.parametrize(("options", "named"), [
    (dict(harmonics=0), "harmonics"), (dict(aft="fft"), "aft"), (dict(solver="secant"), "solver"), (dict(samples=2), "samples"),
    (dict(harmonics="many"), "harmonics"), (dict(tolerance=0.0), "tolerance")])
def test_bad_options_are_named(options, named):
    with pytest.raises(ValueError, match=named):
        HarmonicBalance(**options)


def test_method_must_be_one():
    with pytest.raises(ValueError, match="HarmonicBalance"):
        bf.find_orbit(systems.jenkins_oscillator(), method="hbm")
