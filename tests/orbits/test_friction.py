"""Periodic motions with dry friction: closed forms, the event-driven reference, multipliers with stick and memory."""
import numpy as np
import pytest

import bifurc as bf
from bifurc import elements as el
from bifurc.system import System
from tests.reference.coulomb import EventDriven, SlipOnly

REST = (0.0, 0.0)


def dry(**parameters):
    return bf.systems.dry_friction_oscillator(**parameters)


@pytest.mark.parametrize("omega, zeta, amplitude", [(1.0, 0.1, 1.6), (0.5, 0.1, 4.2), (0.8, 0.0, 1.3), (2.0, 0.1, 1.8)])
def test_slip_only_against_den_hartog(omega, zeta, amplitude):
    orbit = bf.find_orbit(dry(omega=omega, zeta=zeta, amplitude=amplitude), REST)
    exact = SlipOnly(omega, zeta, amplitude)
    assert orbit.success and orbit.closure == -1 and orbit.periods == 1
    assert [str(event.kind) for event in orbit.events] == ["stick", "stick"]  # two reversals
    assert orbit.maximum() == pytest.approx(float(exact.x_max), rel=1e-13)
    times, y = orbit.sample(23)
    for t, (x, v) in zip(times, y, strict=True):
        x0, v0 = exact.state(omega * t)
        assert x == pytest.approx(float(x0), abs=1e-12) and v / omega == pytest.approx(float(v0), abs=1e-12)
    for n in (1, 3, 5):
        want = exact.velocity_coefficients([n])[0] / (1j * n)  # of x, complex amplitude of e^(i n tau)
        assert orbit.harmonic(n) == pytest.approx(2.0 * want, abs=1e-12)


@pytest.mark.parametrize("parameters, x_max, x_min, sticks", [
    (dict(amplitude=1.4), 0.644462527619, None, 2),
    (dict(amplitude=1.1), 0.0241585840332, None, 2),
    (dict(amplitude=1.001), 2.23022537e-6, None, 2),
    (dict(amplitude=1.0001), 2.2428e-8, None, 2),
    (dict(omega=0.06, zeta=0.02, amplitude=2.0), 1.03199125, None, 6),
    (dict(omega=1 / 3, amplitude=2.0), 1.61166144684, None, 2),
    (dict(omega=0.2, zeta=0.02, amplitude=5.0), 4.72013539569, None, 2),
    (dict(zeta=0.0, amplitude=1.2), 0.163823617124, None, 2),
    (dict(amplitude=1.4, friction_negative=0.5), 1.96786299137, -2.46786299137, 0),
    (dict(amplitude=1.4, load_amplitude=1.5, load_phase=0.7), 1.65227279125, -0.274666817, 1),
])
def test_table_of_orbits(parameters, x_max, x_min, sticks):
    orbit = bf.find_orbit(dry(**parameters), REST)
    assert orbit.success and orbit.stable
    digits = len(f"{x_max:.12g}".split("e")[0].replace(".", "").lstrip("0"))
    assert orbit.maximum() == pytest.approx(x_max, rel=10.0 ** (1 - min(digits, 12)))
    assert orbit.minimum() == pytest.approx(-x_max if x_min is None else x_min, rel=1e-5 if x_max < 1e-7 else 2e-9)
    held = [event for event in orbit.events if event.kind == "slip"]
    assert len(held) == sticks


def test_stick_slip_instants_and_share():
    orbit = bf.find_orbit(dry(amplitude=1.4), REST)
    slips = [event.time for event in orbit.events if event.kind == "slip"]
    sticks = [event.time for event in orbit.events if event.kind == "stick"]
    assert slips[0] == pytest.approx(0.2567674781, abs=2e-10)
    assert sticks[-1] - 2 * np.pi == pytest.approx(-0.0751088010, abs=2e-10)
    assert (slips[0] + 2 * np.pi - sticks[-1]) / np.pi == pytest.approx(0.105639501, abs=1e-9)
    events, state = EventDriven(1.0, 0.1, 1.4).orbit()
    assert orbit.state == pytest.approx(state, abs=1e-12)
    assert [event.time for event in orbit.events] == pytest.approx([event[0] for event in events], abs=1e-12)


def test_every_start_leads_to_the_one_orbit():
    """The velocity of the viscously damped oscillator is unique: starts far away give the same orbit."""
    system = dry(amplitude=1.4)
    want = bf.find_orbit(system, REST).state
    for guess in ((2.0, 0.0), (-1.0, 3.0), (0.3, -0.4), None):
        assert bf.find_orbit(system, guess).state == pytest.approx(want, abs=1e-12)
    near = bf.find_orbit(dry(amplitude=1.5), REST)
    assert bf.find_orbit(system, near).state == pytest.approx(want, abs=1e-12)


@pytest.mark.parametrize("amplitude", [0.9, 1.0])
def test_below_the_limit_the_answer_is_rest_with_its_interval(amplitude):
    for guess in (REST, (0.05, 0.0), (0.3, 0.1), None):
        orbit = bf.find_orbit(dry(amplitude=amplitude), guess)
        if not (amplitude == 1.0 and guess == (0.05, 0.0)):
            assert orbit.success and orbit.stable and not orbit.events
            assert orbit.intervals[0] == pytest.approx((amplitude - 1.0, 1.0 - amplitude), abs=1e-14)
            assert "coordinate 0 in [" in orbit.message
            assert np.abs(orbit.sample(50)[1][:, 1]).max() == 0.0
    orbit = bf.find_orbit(dry(amplitude=0.9, friction_negative=0.95), REST)
    assert orbit.intervals[0] == pytest.approx((-0.1, 0.05), abs=1e-14)


def differenced(system, y, step=1e-6):
    """Multipliers from differences of simulated periods."""
    n = len(y)
    M = np.empty((n, n))
    for i in range(n):
        d = np.zeros(n)
        d[i] = step
        M[:, i] = (bf.simulate(system, y + d, periods=1).final - bf.simulate(system, y - d, periods=1).final) / (2 * step)
    return np.sort(np.abs(np.linalg.eigvals(M)))[::-1]


def test_multipliers_with_stick_and_memory():
    """Coulomb stick one zero; J1 at omega 1.1: 0, .388, .780; both against differences of the simulated map."""
    orbit = bf.find_orbit(dry(amplitude=1.4), REST)
    assert np.abs(orbit.multipliers[1]) < 1e-12 and 0.4 < orbit.multipliers[0].real < 0.5
    t = orbit.events[0].time + 0.5  # a section inside a slip
    y = bf.simulate(dry(amplitude=1.4), orbit.state, duration=t).final
    system = System(1.0, 0.2, 1.0, [el.HarmonicForce(1.4, phase=t - np.pi / 2), el.Coulomb(1.0)], omega=1.0)
    assert differenced(system, y) == pytest.approx(np.abs(orbit.multipliers), abs=1e-6)
    orbit = bf.find_orbit(bf.systems.jenkins_oscillator(), (0.3, 0.0))
    assert np.abs(orbit.multipliers) == pytest.approx([0.780, 0.388, 0.0], abs=5e-4)
    assert differenced(orbit.system, orbit.state) == pytest.approx(np.abs(orbit.multipliers), abs=1e-6)


def test_a_slider_that_never_slips_is_a_parameter_of_a_family():
    system = bf.systems.jenkins_oscillator(amplitude=0.01)
    orbit = bf.find_orbit(system, (0.003, 0.0, 0.01))
    assert orbit.success and orbit.stable and orbit.family == [2] and len(orbit.multipliers) == 2
    assert orbit.state[2] == 0.01
    free = bf.find_orbit(System(1.0, 0.02, 2.0, [el.HarmonicForce(0.01)], omega=1.1), (0.0, 0.0))
    assert np.sort_complex(orbit.multipliers) == pytest.approx(np.sort_complex(free.multipliers), abs=1e-13)
    assert orbit.maximum() - 0.005 == pytest.approx(free.maximum(), abs=1e-15)  # w / 2 aside
    low, high = orbit.intervals[2]
    top = free.maximum()
    assert (low, high) == pytest.approx((-2.0 * (1.0 - top), 2.0 * (1.0 - top)), abs=1e-12)  # |u - w| <= 1, u = w / 2 +- top


def test_two_sliders_on_one_coordinate_stop_together():
    sliders = [el.Jenkins(1.0, 0.5, label="weak"), el.Jenkins(0.7, 0.8, label="strong")]
    system = System(1.0, 0.05, 1.0, [el.HarmonicForce(1.6), *sliders], omega=1.1)
    orbit = bf.find_orbit(system, (1.0, 0.0))
    assert orbit.success and orbit.stable and orbit.closure == -1
    times = {(event.element, str(event.kind)): event.time for event in orbit.events}
    assert times["weak", "stick"] == times["strong", "stick"]
    motion = bf.simulate(system, orbit.state, periods=1)
    assert motion.final == pytest.approx(orbit.state, abs=1e-11)
    assert [event.time for event in motion.events] == pytest.approx([event.time for event in orbit.events], abs=1e-11)


def test_an_orbit_with_friction_is_saved_and_loaded(tmp_path):
    orbit = bf.find_orbit(dry(amplitude=1.4), REST)
    orbit.save(tmp_path / "orbit.npz")
    again = bf.load(tmp_path / "orbit.npz")
    assert np.array_equal(again.state, orbit.state) and again.system == orbit.system


@pytest.mark.parametrize("amplitude", [1.6, 1.4, 1.1])
def test_a_harmonic_orbit_is_polished(amplitude):
    system = dry(amplitude=amplitude)
    balance = bf.find_orbit(system, method=bf.HarmonicBalance(harmonics=20))
    orbit = bf.find_orbit(system, guess=balance)
    assert orbit.success and orbit.state == pytest.approx(bf.find_orbit(system, REST).state, abs=1e-12)
    error = abs(orbit.harmonic(1) - balance.harmonic(1))
    assert orbit.how["error of its first harmonic"] == pytest.approx(error, rel=1e-12) and 0.0 < error < 0.03


def test_without_a_guess_the_symmetric_member_of_a_family_is_given():
    system = bf.systems.friction_damped_oscillator(omega=96.0, normal_load=100.0, damper="macro")
    orbit = bf.find_orbit(system)
    assert orbit.success and orbit.closure == -1 and not orbit.events and orbit.state[2] == pytest.approx(0.0, abs=1e-15)
    given = bf.find_orbit(system, (*orbit.state[:2], 0.02))
    assert given.success and given.closure == 1 and given.state[2] == 0.02


def test_the_monodromy_has_the_rows_of_memory_that_follows():
    """From just before the first stick, with the slider at its limit behind the mass, against simulated neighbours."""
    system = bf.systems.jenkins_oscillator()
    orbit = bf.find_orbit(system)
    assert str(orbit.events[0].kind) == "stick"
    begin = orbit.events[0].time - 1e-9 * orbit.period
    state, h = bf.simulate(system, orbit.state, duration=begin).final, 1e-6
    for column, direction in ((0, (1.0, 0.0, 1.0)), (1, (0.0, 1.0, 0.0))):
        step = h * np.array(direction)
        more, less = (bf.simulate(system, state + sign * step, periods=1, t0=begin).final for sign in (1.0, -1.0))
        assert orbit.monodromy[:, column] == pytest.approx((more - less) / (2.0 * h), rel=0, abs=1e-6)
    assert np.all(orbit.monodromy[:, 2] == 0.0)
