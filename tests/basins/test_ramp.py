"""Run-up and run-down: jumps where branches end, against their special points and closed forms."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.basins.sweeps.ramp import jumps_of
from tests.reference.rub import contact_speeds


@pytest.fixture(scope="module")
def duffing():
    return bf.ramp(bf.systems.duffing_oscillator(amplitude=0.2), "omega", (0.8, 1.8), steps=300, periods=8)


def test_a_hardening_spring_jumps_at_its_folds(duffing):
    branch = bf.trace(bf.find_orbit(bf.systems.duffing_oscillator(amplitude=0.2, omega=0.8)), "omega", bounds=(0.8, 1.8))
    folds = sorted(point.parameter for point in branch.special_points.of("fold"))
    assert duffing.success and [jump.direction for jump in duffing.jumps] == ["up", "down"]
    up, down = duffing.jumps
    step = 1.0 / 299  # never before the fold by more than that, and late by a little
    assert -step <= up.value - folds[1] < 0.03 and -step <= folds[0] - down.value < 0.03
    assert up.after < up.before and down.after > down.before
    assert [point.kind for _, point, _ in duffing.nearest([branch])] == ["fold", "fold"]


def test_between_jumps_the_motion_is_on_the_branch(duffing):
    place = int(np.argmin(np.abs(duffing.values[0] - 1.1)))
    system = bf.systems.duffing_oscillator(amplitude=0.2, omega=duffing.values[0, place])
    orbit = bf.find_orbit(system, guess=duffing.states[0, place])
    assert abs(duffing.maximum[0, place, 0] - orbit.maximum(0)) < 0.02 * orbit.maximum(0)


def test_a_slower_run_jumps_nearer_to_the_fold():
    system = bf.systems.duffing_oscillator(amplitude=0.2)
    late = [bf.ramp(system, "omega", (1.2, 1.6), steps=steps, periods=4, directions="up").jumps[0].value for steps in (40, 400)]
    assert late[1] < late[0]


@pytest.mark.slow
def test_a_rotor_runs_up_through_its_rub_and_down_past_it():
    # synchronous rub is stable up to its fold, the whirl without rub down to the speed at which it reaches the stator
    zeta, eccentricity = 0.05, 0.2
    system = bf.systems.jeffcott_rotor(zeta=zeta, eccentricity=eccentricity, stiffness=4.0, friction=0.05, offset=0.0)
    run = bf.ramp(system, "nu", (1.0, 2.0), steps=400, periods=6)
    assert run.success and [jump.direction for jump in run.jumps] == ["up", "down"]
    up, down = run.jumps
    assert 0.0 <= up.value - 1.79940624106 < 0.02 and up.after < up.before
    assert -0.0026 <= contact_speeds(zeta, eccentricity)[1] - down.value < 0.02 and down.after > down.before
    assert run.events.max() <= 1  # contact is made once, not once a turn


def test_a_ramp_comes_back_from_its_file(duffing, tmp_path):
    duffing.save(tmp_path / "run.npz")
    again = bf.load(tmp_path / "run.npz")
    assert repr(again) == repr(duffing) and np.array_equal(again.maximum, duffing.maximum)
    axes = again.plot()
    assert len(axes.lines) == 2


def test_noise_without_a_jump_is_none():
    values = np.linspace(0.0, 1.0, 200)
    assert jumps_of("up", values, 1.0 + 0.5 * np.random.default_rng(0).random(200)) == []
    assert jumps_of("up", values, 1.0 + values) == []
    (jump,) = jumps_of("up", values, np.where(values < 0.5, 1.0 + values, 0.3))
    assert abs(jump.value - 0.5) < 0.01 and jump.before > jump.after == 0.3


@pytest.mark.parametrize(("arguments", "words"), [
    ({"bounds": (1.0, 0.5)}, "bounds"), ({"bounds": 3}, "bounds"), ({"bounds": (0.5, 1.0), "steps": 1}, "steps"),
    ({"bounds": (0.5, 1.0), "directions": "left"}, "directions"), ({"bounds": (0.5, 1.0), "start": (0.0,)}, "start")])
def test_impossible_ramps(arguments, words):
    with pytest.raises(ValueError, match=words):
        bf.ramp(bf.systems.duffing_oscillator(), "omega", **arguments)


def test_a_system_without_a_clock_has_no_run_up():
    with pytest.raises(ValueError, match="autonomous"):
        bf.ramp(bf.systems.belt_oscillator(), "belt_speed", (0.1, 0.5))


def test_extremes_are_those_of_the_last_period_at_each_value():
    """A linear oscillator far below its resonance follows its load: in whatever period, once the start has died away."""
    system = bf.System(1.0, 1.4, 1.0, [bf.elements.HarmonicForce(1.0)], omega=1.0)
    run = bf.ramp(system, "omega", (0.1, 1.6), steps=4, periods=6, directions=("down", "up"))
    w = run.values
    amplitude = 1.0 / np.hypot(1.0 - w**2, 1.4 * w)
    np.testing.assert_allclose(run.maximum[..., 0], amplitude, rtol=2e-3)
    np.testing.assert_allclose(run.minimum[..., 0], -amplitude, rtol=2e-3)
