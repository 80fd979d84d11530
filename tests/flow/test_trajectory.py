"""What a motion is at given times: sections at the whole forcing periods within it, wherever it begins and ends."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import DelayedFeedback, HarmonicForce, Jenkins, RigidStop

OMEGA, ZETA = 1.3, 0.05


def exact(t, t0, y0):
    """q'' + 2 zeta q' + q = cos(omega t) in closed form."""
    h = 1.0 / (1.0 - OMEGA**2 + 2j * ZETA * OMEGA)
    forced = np.array([h * np.exp(1j * OMEGA * t), 1j * OMEGA * h * np.exp(1j * OMEGA * t)]).real
    q, v = y0 - np.array([h * np.exp(1j * OMEGA * t0), 1j * OMEGA * h * np.exp(1j * OMEGA * t0)]).real
    w, s = np.sqrt(1.0 - ZETA**2), t - t0
    a, b = q, (v + ZETA * q) / w
    fade, c, d = np.exp(-ZETA * s), np.cos(w * s), np.sin(w * s)
    free = fade * (a * c + b * d)
    return forced + np.array([free, fade * w * (b * c - a * d) - ZETA * free])


@pytest.mark.parametrize(("start", "periods", "first", "count"), [
    (0.0, 3.0, 0, 4), (0.3, 3.0, 1, 3), (0.3, 2.6, 1, 2), (-1.4, 2.0, -1, 2), (2.0, 0.5, 2, 1), (0.2, 0.5, 1, 0), (5.0, 2.0, 5, 3)])
def test_sections_are_the_states_at_whole_forcing_periods_within_the_motion(start, periods, first, count):
    """None before the start or behind the end, where nothing was simulated; both ends count."""
    system = bf.System(1.0, 2.0 * ZETA, 1.0, [HarmonicForce(1.0)], omega=OMEGA)
    period, y0 = system.period, np.array([0.4, -0.2])
    motion = bf.simulate(system, y0, periods=periods, t0=start * period)
    assert motion.success and motion.sections.shape == (count, 2)
    for k, y in zip(range(first, first + count), motion.sections, strict=True):
        np.testing.assert_allclose(y, exact(k * period, start * period, y0), atol=1e-12)


@pytest.mark.parametrize("element", [HarmonicForce(1.0), DelayedFeedback(0.1, delay=2.0)])
def test_no_times_give_no_states(element):
    elements = [HarmonicForce(1.0), element] if element.delayed else [element]
    motion = bf.simulate(bf.System(np.eye(2), 0.1 * np.eye(2), np.eye(2), elements, omega=OMEGA), (0.0,) * 4, periods=0.4, t0=0.1)
    for shape in ((0,), (0, 3), (2, 0)):
        assert motion(np.empty(shape)).shape == (*shape, 4)
        if element.delayed:
            assert motion.feedback(np.empty(shape)).shape == shape
    assert motion.sections.shape == (0, 4)


def test_a_motion_without_excitation_has_no_sections():
    with pytest.raises(ValueError, match="forcing period"):
        bf.simulate(bf.System(1.0, 0.1, 1.0), (1.0, 0.0), duration=3.0).sections  # noqa: B018


@pytest.mark.parametrize("extra", [[], [RigidStop(0.9, 0.6)], [DelayedFeedback(0.01, delay=2.0)]],
                         ids=["slider", "slider and stop", "slider and feedback"])
def test_both_sides_of_an_event_tell_where_a_slider_is(extra):
    """One that slips lies by limit / stiffness from its spring's end, in every event row as between events."""
    system, near = bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.5), Jenkins(2.0, 0.6), *extra], omega=0.8), 1e-9
    motion = bf.simulate(system, (0.0, 0.0), periods=4)
    slips = 0
    for event in motion.events:
        for state, at, keys in ((event.before, -near, event.mode_before), (event.after, near, event.mode_after)):
            np.testing.assert_allclose(state, motion(event.time + at), atol=20.0 * near)
            if "slip" in str(keys):
                slips += 1
                assert abs(state[0] - state[2]) == pytest.approx(0.3, abs=1e-12)
    assert slips > 6
    for t, y in [(motion.t, motion.y)] if isinstance(motion, bf.Trajectory) else []:
        assert np.count_nonzero(np.diff(t) == 0.0) == len(motion.events) and np.abs(y[:, 0] - y[:, 2]).max() <= 0.3 + 1e-12
    if not any(one.delayed for one in extra):
        for event in bf.find_orbit(system).events:
            for state, keys in ((event.before, event.mode_before), (event.after, event.mode_after)):
                assert "slip" not in str(keys) or abs(state[0] - state[2]) == pytest.approx(0.3, abs=1e-12)


def test_the_modes_of_a_motion_are_that_of_its_start_and_those_behind_its_events():
    """A slider that sticks first, beside a stop that throws back: some events change the mode, others do not."""
    system = bf.System(1.0, 0.1, 1.0, [HarmonicForce(2.0), RigidStop(0.7, 0.6), Jenkins(0.5, 0.3)], omega=OMEGA)
    motion = bf.simulate(system, (0.0, 0.0), periods=3)
    kinds = {event.kind for event in motion.events}
    assert {"impact", "slip", "stick"} <= kinds and len(motion.modes) == len(motion.events) + 1
    assert motion.modes[0] == ("always", "free", "stick")
    assert list(motion.modes[1:]) == [event.mode_after for event in motion.events]
    assert all(event.mode_before == mode for event, mode in zip(motion.events, motion.modes[:-1], strict=True))
    assert {mode[2] for mode in motion.modes} == {"stick", "slip+", "slip-"}
