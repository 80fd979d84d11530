"""The mass on a moving belt: cycles, the end of the stick-slip cycle, grazing-sliding, against closed forms and long arithmetic."""
import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

import bifurc as bf


def stick_slip(zeta, V, static, kinetic):
    """Slip and stick times of the Coulomb cycle from its closed form (the arc of slip starts at x' = V, leaves it and returns)."""
    w = math.sqrt(1.0 - zeta * zeta)
    a, v = static - 2.0 * zeta * V - kinetic, V

    def state(t):
        e, c, s = math.exp(-zeta * t), math.cos(w * t), math.sin(w * t)
        x = e * (a * c + (v + zeta * a) / w * s)
        return x, e * (v * c - (a + zeta * v) / w * s)

    t = np.linspace(1e-3, 2.0 * math.pi / w, 4001)
    speeds = np.array([state(s)[1] - V for s in t])
    k = int(np.flatnonzero((speeds[:-1] < 0.0) & (speeds[1:] >= 0.0))[0])
    slip = brentq(lambda s: state(s)[1] - V, t[k], t[k + 1], xtol=1e-15)
    return slip, (a - state(slip)[0]) / V


@pytest.mark.parametrize("zeta, V, static, kinetic", [(0.0, 0.3, 1.0, 0.6), (0.05, 0.3, 1.0, 0.6), (0.02, 0.7, 1.6, 0.9),
                                                      (0.1, 0.05, 0.8, 0.3)])
def test_stick_slip_cycle(zeta, V, static, kinetic):
    orbit = bf.find_orbit(bf.systems.belt_oscillator(zeta=zeta, belt_speed=V, static=static, kinetic=kinetic))
    assert orbit.success and orbit.autonomous and orbit.stable
    slip, stick = stick_slip(zeta, V, static, kinetic)
    assert orbit.period == pytest.approx(slip + stick, abs=1e-12)
    times = {str(event.kind): event.time for event in orbit.events}
    assert (times["stick"] - times["slip"]) % orbit.period == pytest.approx(slip, abs=1e-12)
    assert np.abs(orbit.multipliers).tolist() == pytest.approx([0.0], abs=1e-14)
    if zeta == 0.0:
        assert slip == pytest.approx(2.0 * math.pi - 2.0 * math.atan((static - kinetic) / V), abs=1e-12)
        size = math.hypot(static - kinetic, V)
        assert (orbit.minimum(), orbit.maximum()) == pytest.approx((kinetic - size, kinetic + size), abs=1e-13)


@pytest.mark.parametrize("zeta, static, kinetic, known", [(0.05, 1.0, 0.6, 0.439237049646349), (0.01, 1.0, 0.6, 1.0956961667151),
                                                          (0.1, 1.3, 0.5, None)])
def test_the_stick_slip_cycle_ends_with_positive_stick(zeta, static, kinetic, known):
    w, d = math.sqrt(1.0 - zeta**2), static - kinetic
    s = brentq(lambda s: math.exp(zeta * s) * (math.cos(w * s) - zeta / w * math.sin(w * s)) - 1.0,
               1.5 * math.pi / w, 2.0 * math.pi / w, xtol=1e-15)
    end = -d * w * math.exp(-zeta * s) / math.sin(w * s)
    assert known is None or end == pytest.approx(known, rel=1e-13)
    start = bf.find_orbit(bf.systems.belt_oscillator(zeta=zeta, belt_speed=0.4 * end, static=static, kinetic=kinetic))
    branch = bf.trace(start, "belt_speed", bounds=(0.2 * end, 2.0 * end))
    (point,) = branch.special_points
    assert (point.kind, branch.ends[1].reason) == ("cycle_end", "cycle_end")
    assert "positive duration" in branch.ends[1].reason.sentence
    assert point.parameter == pytest.approx(end, abs=1e-12) and point.error < 1e-11
    orbit = point.solution
    times = {str(event.kind): event.time for event in orbit.events}
    assert (times["stick"] - times["slip"]) % orbit.period == pytest.approx(s, abs=1e-6)  # a fold of the landing time
    assert orbit.period - s == pytest.approx(d / end, abs=1e-6)
    assert np.abs(orbit.multipliers).max() < 1e-10


EXPONENTIAL = {"law": "exponential", "static": 1.0, "kinetic": 0.5, "decay_speed": 0.5, "zeta": 0.05}
CUBIC = {"law": "cubic", "static": 1.0, "falling": 0.4, "rising": 0.1, "zeta": 0.05}


@pytest.mark.parametrize("law, V, slip, stick", [(EXPONENTIAL, 0.4, 4.92650766131036, 2.25271731145692),
                                                 (CUBIC, 0.5, 5.27086543356804, 1.36985221657594)])
def test_stick_slip_under_falling_friction(law, V, slip, stick):
    orbit = bf.find_orbit(bf.systems.belt_oscillator(belt_speed=V, **law))
    times = {str(event.kind): event.time for event in orbit.events}
    assert (times["stick"] - times["slip"]) % orbit.period == pytest.approx(slip, abs=1e-11)
    assert orbit.period == pytest.approx(slip + stick, abs=1e-11)
    assert np.abs(orbit.multipliers).max() < 1e-12


def slope(law, u):
    """F'(u) for u > 0."""
    if law is EXPONENTIAL:
        return -0.5 / 0.5 * math.exp(-u / 0.5)
    return -0.4 + 0.3 * u * u


@pytest.mark.parametrize("law, V, guess, multiplier, low", [
    (EXPONENTIAL, 1.49395, (-0.6388, 0.0), 1.48317407194657, -0.638809967039895),
    (CUBIC, 0.948369, None, 0.823488985254, None)])
def test_cycles_without_stick(law, V, guess, multiplier, low):
    system = bf.systems.belt_oscillator(belt_speed=V, **law)
    orbit = bf.find_orbit(system, guess=guess, period=None if guess is None else 6.29)
    assert orbit.success and not orbit.events
    assert orbit.multipliers.real == pytest.approx([multiplier], abs=1e-11)
    assert low is None or orbit.minimum() == pytest.approx(low, abs=1e-11)
    damped = quad(lambda t: 2.0 * law["zeta"] + slope(law, V - orbit._states(np.array([t / orbit.forcing_period]))[0, 1]),
                  0.0, orbit.period, epsabs=1e-12)[0]
    assert orbit.multipliers[0].real == pytest.approx(math.exp(-damped), abs=1e-10)
    assert orbit.stable is (multiplier < 1.0)


@pytest.mark.parametrize("law, V, guess, end", [(EXPONENTIAL, 1.49395, (-0.6388, 0.0), 1.83660097220793),
                                                (CUBIC, 0.948369, None, 0.8967386176534)])
def test_grazing_sliding_from_both_sides(law, V, guess, end):
    sliding = bf.find_orbit(bf.systems.belt_oscillator(belt_speed=V, **law), guess=guess)
    sticking = bf.find_orbit(bf.systems.belt_oscillator(belt_speed=0.8 * min(end, V), **law))
    assert not sliding.events and len(sticking.events) == 2
    for start, direction in ((sliding, 1 if end > V else -1), (sticking, 1)):
        branch = bf.trace(start, "belt_speed", bounds=(0.6, 2.0), direction=direction)
        point = branch.special_points[0 if direction == 1 else -1]
        assert point.kind == "stick_onset"
        assert point.parameter == pytest.approx(end, abs=1e-12)
        assert point.before != point.after  # the branch goes on with the other sequence
    if law is EXPONENTIAL:
        assert point.problem.solution(point.x).period == pytest.approx(6.30401373105203, abs=1e-10)


@pytest.mark.parametrize("law, hopf, end", [(EXPONENTIAL, 0.5 * math.log(10.0), 1.83660097220793), (CUBIC, 1.0, 0.8967386176534)])
def test_from_steady_sliding_through_the_hopf_point_to_stick_slip(law, hopf, end):
    rest = bf.find_equilibrium(bf.systems.belt_oscillator(belt_speed=2.5, **law))
    (point,) = bf.trace(rest, "belt_speed", bounds=(0.3, 3.0)).special_points
    (orbit,) = bf.switch_branch(point)
    branch = bf.trace(orbit, "belt_speed", bounds=(0.3, 3.0))
    assert sorted(str(found.kind) for found in branch.special_points) == ["hopf", "stick_onset"]
    assert branch.special_points.of("hopf")[0].parameter == pytest.approx(hopf, abs=1e-12)
    assert branch.special_points.of("stick_onset")[0].parameter == pytest.approx(end, abs=1e-12)
    assert {end.reason.value for end in branch.ends} == {"hopf", "bound"}
    assert branch.special_points.of("stick_onset")[0].reverses is (law is EXPONENTIAL)
    last = branch.orbits[0 if branch.ends[0].reason == "bound" else -1]
    assert len(last.events) == 2 and last.stable


@pytest.mark.parametrize("bounds", [(0.6, 1.5), (0.3, 3.0)])
def test_no_fold_is_invented_where_a_cycle_shrinks_onto_steady_sliding(bounds):
    orbit = bf.find_orbit(bf.systems.belt_oscillator(belt_speed=0.948369, **CUBIC))
    points = bf.trace(orbit, "belt_speed", bounds=bounds).special_points
    assert [str(point.kind) for point in points] == ["stick_onset", "hopf"]


def test_bad_belts():
    with pytest.raises(ValueError, match="law"):
        bf.systems.belt_oscillator(law="linear")
    with pytest.raises(ValueError, match="static"):
        bf.systems.belt_oscillator(static=0.5, kinetic=0.6)
    with pytest.raises(ValueError, match="kinetic"):
        bf.systems.belt_oscillator(kinetic=0.0)
