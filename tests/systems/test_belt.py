"""The mass on a moving belt: cycles, the end of the stick-slip cycle, grazing-sliding, against closed forms and long arithmetic."""
import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
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
    before = branch.orbits[-3]  # at the end itself the time of landing has no derivative
    assert np.abs(before.multipliers).max() < 1e-10


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


def force(law, u):
    """F(u) for u > 0."""
    if law["law"] == "exponential":
        return law["kinetic"] + (law["static"] - law["kinetic"]) * np.exp(-u / law["decay_speed"])
    return law["static"] - law["falling"] * u + law["rising"] * u**3


def arc_of_slip(law, V, stop):
    """Return time and state at the first landing, or at the first top of x' (``stop``), of the arc of slip from its release, where
    its acceleration is zero: by DOP853."""
    def field(t, y):
        return [y[1], force(law, V - y[1]) - 2.0 * law["zeta"] * y[1] - y[0]]

    def lands(t, y):
        return y[1] - V

    def top(t, y):
        return field(t, y)[1]

    lands.terminal, lands.direction, top.terminal, top.direction = stop == "landing", 1, 2, -1
    found = solve_ivp(field, (0.0, 60.0), [force(law, 0.0) - 2.0 * law["zeta"] * V, V], method="DOP853", rtol=1e-13, atol=1e-14,
                      first_step=1e-3, events=lands if stop == "landing" else top)
    times, states = found.t_events[0], found.y_events[0]
    k = int(np.flatnonzero(times > 1e-2)[0])
    return times[k], states[k]


LAWS = [{"law": "exponential", "kinetic": 0.8096, "decay_speed": 0.4684, "zeta": 0.0481, "static": 1.1838},
        {"law": "exponential", "kinetic": 0.1496, "decay_speed": 0.4387, "zeta": 0.0675, "static": 1.0806},
        {"law": "cubic", "static": 1.8283, "falling": 0.5962, "rising": 0.1209, "zeta": 0.0396},
        {"law": "cubic", "static": 0.5102, "falling": 0.2888, "rising": 0.1077, "zeta": 0.0248}]


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("part", [0.1, 0.6])
def test_falling_friction_of_other_numbers(law, part):
    if law["law"] == "exponential":
        hopf = law["decay_speed"] * math.log((law["static"] - law["kinetic"]) / (2.0 * law["zeta"] * law["decay_speed"]))
    else:
        hopf = math.sqrt((law["falling"] - 2.0 * law["zeta"]) / (3.0 * law["rising"]))
    V = part * hopf
    orbit = bf.find_orbit(bf.systems.belt_oscillator(belt_speed=V, **law))
    slip, (x, _) = arc_of_slip(law, V, "landing")
    assert orbit.period == pytest.approx(slip + (force(law, 0.0) - 2.0 * law["zeta"] * V - x) / V, abs=1e-10)
    branch = bf.trace(orbit, "belt_speed", bounds=(0.05 * hopf, 4.0 * hopf))
    end, sliding = branch.special_points  # the same names whichever event the orbit begins with
    assert (end.kind, sliding.kind) == ("stick_onset", "hopf") and {e.reason.value for e in branch.ends} == {"bound", "hopf"}
    assert sliding.parameter == pytest.approx(hopf, abs=1e-12)
    # the slip from the release comes back to the speed of the belt with its top
    near = end.parameter * np.array([1.0 - 1e-3, 1.0 + 1e-3])
    known = brentq(lambda V: arc_of_slip(law, V, "top")[1][1] - V, *near, xtol=1e-14)
    assert end.parameter == pytest.approx(known, abs=1e-10)


def test_a_landing_beyond_the_static_limit_slips_through():
    # from the belt speed on at which the landing lies at -static, the mass overtakes the belt before it sticks
    law = {"law": "cubic", "static": 0.7679, "falling": 0.4378, "rising": 0.0322, "zeta": 0.0168}

    def landing(V):
        return arc_of_slip(law, V, "landing")[1][0] + 2.0 * law["zeta"] * V + law["static"]

    known = brentq(landing, 0.7, 0.8, xtol=1e-14)
    branch = bf.trace(bf.find_orbit(bf.systems.belt_oscillator(belt_speed=0.614, **law)), "belt_speed", bounds=(0.1, 8.18))
    points = branch.special_points
    assert [str(point.kind) for point in points] == ["slip_onset", "slip_onset", "stick_onset", "hopf"]
    assert points[0].parameter == pytest.approx(known, abs=1e-11)


@pytest.mark.parametrize("zeta, V, static, kinetic", [(0.154, 0.0136, 1.822, 0.3018), (0.1215, 0.0049, 0.999, 0.467),
                                                      (0.232, 3.04e-4, 1.096, 0.841), (0.2369, 6.71e-5, 0.696, 0.3951),
                                                      (0.0436, 3.47e-5, 1.6802, 0.8966), (0.2136, 1.74e-5, 1.0742, 0.9028)])
def test_relaxation_of_a_slow_belt(zeta, V, static, kinetic):
    # the mass sticks for hundreds or thousands of periods of anything that oscillates; where it is rounds in each unit of that time
    orbit = bf.find_orbit(bf.systems.belt_oscillator(zeta=zeta, belt_speed=V, static=static, kinetic=kinetic))
    T = sum(stick_slip(zeta, V, static, kinetic))
    assert orbit.success and orbit.period == pytest.approx(T, rel=1e-12 + 1.1e-16 / V)


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
        bf.systems.belt_oscillator(kinetic=-0.1)
