"""Gains of Ott, Grebogi and Yorke: closed forms, the closed loop by differences of the exact map, motions that are caught."""
import mpmath as mp
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import HarmonicForce, RigidStop
from tests.reference.impacting_orbit import closed_form, impacting


@pytest.fixture(scope="module")
def orbit():
    return impacting()


@pytest.fixture(scope="module")
def section(orbit):
    return (closed_form()[1] / orbit.forcing_period + 0.5) % 1.0  # half a period after the impact


def test_gain_on_the_section_half_a_period_after_the_impact(orbit, section):
    found = bf.control.ogy(orbit, "amplitude", section=section)
    np.testing.assert_allclose(found.state, (-6.30682069286358, -0.765602049463289), rtol=1e-12)
    M = [[-0.956616080317260, -4.18326963783281], [-0.0319916891638215, -0.538289116533979]]
    np.testing.assert_allclose(found.monodromy, M, rtol=1e-11)
    np.testing.assert_allclose(found.sensitivity, (-1.69887698755325, -0.0866821515356910), rtol=1e-10)
    np.testing.assert_allclose(found.gain, (0.514021444402009, 3.41010104228882), rtol=1e-9)
    np.testing.assert_allclose(found.closed_loop, (-0.326051098548087, 0.0), atol=1e-11)


def test_dead_beat_is_there_but_not_the_default(orbit, section):
    found = bf.control.ogy(orbit, "amplitude", section=section, method="deadbeat")
    np.testing.assert_allclose(found.gain, (13.7814022853258, -252.854845127811), rtol=1e-8)
    assert np.abs(found.closed_loop).max() < 1e-5  # a double root: its square is at rounding level
    assert bf.control.ogy(orbit, "amplitude", section=section).method == "ogy"


def test_dead_beat_leaves_what_sticking_has_put_to_zero():
    """A period of stick and slip forgets one direction of two, control takes the other one: after two periods nothing of first
    order is left."""
    system = bf.systems.dry_friction_oscillator()
    orbit = bf.find_orbit(system)
    found = bf.control.ogy(orbit, "omega", method="deadbeat", section=0.1)
    assert np.count_nonzero(np.abs(orbit.multipliers) > 1e-8) == 1

    def left(h, controlled):
        state = found.state + h * np.array((1.0, 0.5))
        for _ in range(2):
            other = system.with_parameters(omega=system.omega + controlled * found.correction(state))
            state = bf.simulate(other, state, periods=1, t0=0.1 * other.period).final
        return np.abs(state - found.state).max()

    assert left(1e-4, False) / left(5e-5, False) == pytest.approx(2.0, rel=1e-2)
    assert left(1e-4, True) / left(5e-5, True) == pytest.approx(4.0, rel=1e-2)


@pytest.mark.parametrize("section", [0.0, 0.1, 0.3])  # slip, slip, stick
@pytest.mark.parametrize("parameter", ["omega", "amplitude", "stiffness", "limit"])
def test_the_map_of_a_slider_that_slips_on_the_section(parameter, section):
    """Its memory is the coordinate less limit / stiffness there: all derivatives are those of simulated turns."""
    system, h = bf.systems.jenkins_oscillator(), 1e-6
    found = bf.control.ogy(bf.find_orbit(system), parameter, section=section)
    value = system.parameter(parameter)

    def turned(away, change):
        other = system.with_parameters(**{parameter: value + change})
        return bf.simulate(other, found.state + away, periods=1, t0=section * other.period).final

    columns = [(turned(h * e, 0.0) - turned(-h * e, 0.0)) / (2.0 * h) for e in np.eye(3)]
    np.testing.assert_allclose(found.monodromy, np.transpose(columns), atol=1e-6)
    np.testing.assert_allclose(found.sensitivity, (turned(0.0, h) - turned(0.0, -h)) / (2.0 * h), rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("parameter", ["amplitude", "omega", "gap", "zeta"])
def test_one_turn_of_the_exact_map_confirms_the_closed_loop(orbit, parameter):
    found = bf.control.ogy(orbit, parameter, section=0.1)
    value, h = orbit.system.parameter(parameter), 1e-6

    def turned(away):
        system = orbit.system.with_parameters(**{parameter: value - float(found.gain @ away)})
        return bf.simulate(system, found.state + away, periods=1, t0=0.1 * system.period).final

    columns = [(turned(h * e) - turned(-h * e)) / (2.0 * h) for e in np.eye(2)]
    np.testing.assert_allclose(np.array(columns).T, found.monodromy - np.outer(found.sensitivity, found.gain), atol=2e-6)
    assert np.abs(found.closed_loop).max() < 0.33


@pytest.mark.parametrize("scale", [1.0, 1e-6])
def test_the_phase_of_the_force_moves_the_orbit_in_time(scale):
    """A parameter whose value is zero, in two units of length: the orbit of the phase a is that of 0, a / omega earlier."""
    omega, damping, force = 0.9, 0.1, 0.6 * scale
    system = bf.System(1.0, damping, 1.0, [HarmonicForce(force), RigidStop(0.3 * scale, 0.8)], omega=omega)
    found = bf.control.ogy(bf.find_orbit(system), "phase", section=0.37)
    x, v = found.state
    rate = np.array((v, force * np.cos(2.0 * np.pi * 0.37) - damping * v - x))
    np.testing.assert_allclose(found.sensitivity, (np.eye(2) - found.monodromy) @ rate / omega, rtol=1e-9)


def test_chaos_is_caught_and_held_under_noise():
    system = bf.systems.impact_oscillator(omega=2.5, amplitude=8.0)
    orbit = bf.find_orbit(system, guess=(-4.7, 0.0))
    assert orbit.success and orbit.periods == 1 and len(orbit.events) == 1 and orbit.stable is False
    controller = bf.control.ogy(orbit, "amplitude")
    starts = bf.simulate(system, (0.3, -1.0), periods=80).sections[50::6]  # how long each waits is chance
    motions = [controller.simulate(start, 400, limit=1.0) for start in starts]
    held = [motion for motion in motions if motion.captured is not None]
    assert len(held) >= 3 and all(motion.distances[-1] < 1e-12 for motion in held if motion.captured < 300)
    assert all(motion.success and np.abs(motion.corrections).max() <= 1.0 for motion in motions)
    caught = min(held, key=lambda motion: motion.captured)
    noisy = controller.simulate(orbit.state, 100, limit=0.4, noise=1e-3)
    assert noisy.captured == 0 and 1e-5 < noisy.distances[-50:].mean() < 2e-2
    without = controller.simulate(caught.states[-1] + 1e-9, 100, limit=0.4, start=100)
    assert without.distances[-1] > 1e-2  # nothing holds it


def test_a_stable_orbit_needs_no_gain():
    found = bf.control.ogy(bf.find_orbit(bf.systems.impact_oscillator()), "amplitude")
    assert not found.gain.any() and found.status == "stable_already"


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_section_just_beside_an_event_is_refused_on_either_side(orbit, side):
    """Also across the end of the period, where the event is the first or the last thing that happens in it."""
    at = orbit.events[0].time / orbit.forcing_period
    with pytest.raises(ValueError, match="has its event there"):
        bf.control.ogy(orbit, "amplitude", section=at + side * 5e-10)
    assert bf.control.ogy(orbit, "amplitude", section=at + side * 1e-6).gain.any()


def test_bad_arguments_are_named(orbit):
    with pytest.raises(ValueError, match="section = 1.0"):
        bf.control.ogy(orbit, "amplitude", section=1.0)
    at = orbit.events[0].time / orbit.forcing_period
    with pytest.raises(ValueError, match="has its event there"):
        bf.control.ogy(orbit, "amplitude", section=at)
    with pytest.raises(ValueError, match="method = 'fast'"):
        bf.control.ogy(orbit, "amplitude", method="fast")
    with pytest.raises(ValueError, match="unknown"):
        bf.control.ogy(orbit, "colour")
    controller = bf.control.ogy(orbit, "amplitude")
    with pytest.raises(ValueError, match="limit"):
        controller.simulate(orbit.state, 5, limit=0.0)


def turned_exactly(z, phase, hit, *, zeta, omega, amplitude, gap, restitution):
    """Return the states after a period from ``z`` at a phase, with one impact near the time ``hit``, in many digits."""
    w, period, H = mp.sqrt(1 - zeta**2), 2 * mp.pi / omega, amplitude / (1 - omega**2 + 2j * zeta * omega)

    def flow(start, z, t):
        (x, v), (end, end_v) = ((value.real, (1j * omega * value).real)
                                for value in (H * mp.mpc(mp.cos(omega * at), mp.sin(omega * at)) for at in (start, t)))
        a, b, d = z[0] - x, z[1] - v, t - start
        e, c, s = mp.exp(-zeta * d), mp.cos(w * d), mp.sin(w * d) / w
        return end + e * (a * (c + zeta * s) + b * s), end_v + e * (b * (c - zeta * s) - a * s)
    start = mp.mpf(phase) * period
    at = mp.findroot(lambda t: flow(start, z, t)[0] - gap, mp.mpf(hit), tol=mp.mpf(10)**-60)
    return mp.matrix(flow(at, (gap, -restitution * flow(start, z, at)[1]), start + period))


@pytest.mark.parametrize("parameter", ["amplitude", "omega", "gap", "zeta", "restitution"])
@pytest.mark.parametrize("phase", [0.0, 0.1, 0.3])
def test_the_sensitivity_is_exact_and_so_is_the_dead_beat_gain(orbit, phase, parameter):
    """Against differences of the closed form in 40 digits: a difference in double precision leaves 1e-10 of it, and 1e-8 of the
    gain."""
    found = bf.control.ogy(orbit, parameter, section=phase, method="deadbeat")
    (event,), period = orbit.events, orbit.forcing_period
    hit = event.time if event.time > phase * period else event.time + period
    with mp.workdps(40):
        names, h = ("amplitude", "omega", "gap", "zeta", "restitution"), mp.mpf(10)**-14
        numbers = {name: mp.mpf(orbit.system.parameter(name)) for name in names}

        def turned(z, **changed):
            return turned_exactly(z, phase, hit, **{**numbers, **changed})
        z = mp.matrix(mp.findroot(lambda x, v: list(turned((x, v)) - mp.matrix((x, v))), [mp.mpf(value) for value in found.state],
                                  tol=mp.mpf(10)**-50))
        value = numbers[parameter]
        g = (turned(z, **{parameter: value + h}) - turned(z, **{parameter: value - h})) / (2 * h)
        M = mp.matrix(2)
        for k in range(2):
            e = mp.matrix([h * (k == 0), h * (k == 1)])
            M[:, k] = (turned(z + e) - turned(z - e)) / (2 * h)
        reach = mp.matrix(2)
        reach[:, 0], reach[:, 1] = g, M * g
        gain = mp.lu_solve(reach.T, mp.matrix([0, 1])).T * M * M  # Ackermann
        g, gain, reach = (np.array(made.tolist(), float) for made in (g, gain, reach))
    np.testing.assert_allclose(found.sensitivity, g.ravel(), atol=1e-13 * np.abs(g).max(), rtol=0)
    np.testing.assert_allclose(found.gain, gain.ravel(), atol=3e-14 * np.linalg.cond(reach) * np.abs(gain).max(), rtol=0)


@pytest.mark.parametrize("parameter", ["amplitude", "omega", "zeta"])
@pytest.mark.parametrize("zeta", [0.05, 0.6])
def test_the_sensitivity_of_a_linear_oscillator(parameter, zeta):
    """The response H(omega) amplitude, and the flow that takes what is left of its change."""
    omega, amplitude = 0.7, 0.3
    orbit = bf.find_orbit(bf.systems.impact_oscillator(zeta=zeta, omega=omega, amplitude=amplitude, gap=9.0))
    found = bf.control.ogy(orbit, parameter)
    with mp.workdps(40):
        numbers, h = {"amplitude": mp.mpf(amplitude), "omega": mp.mpf(omega), "zeta": mp.mpf(zeta)}, mp.mpf(10)**-14

        def response(amplitude, omega, zeta):
            H = amplitude / (1 - omega**2 + 2j * zeta * omega)
            return mp.matrix([H.real, (1j * omega * H).real])
        at = numbers[parameter]
        change = (response(**{**numbers, parameter: at + h}) - response(**{**numbers, parameter: at - h})) / (2 * h)
        flow = mp.expm(mp.matrix([[0, 1], [-1, -2 * numbers["zeta"]]]) * 2 * mp.pi / numbers["omega"])
        g = np.array((change - flow * change).tolist(), float).ravel()
    np.testing.assert_allclose(found.sensitivity, g, atol=5e-13 * np.abs(g).max(), rtol=0)
