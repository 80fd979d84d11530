"""Whether simulation repeats an orbit: misses in closed form, starts that no motion has, and what rounding may grow to."""
import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.linalg import expm

import bifurc as bf
from bifurc.elements import ConstantForce, HarmonicForce, RigidStop
from bifurc.orbits import repetition as module
from bifurc.orbits.least import reduced
from bifurc.orbits.orbit import PeriodicOrbit
from bifurc.orbits.repetition import Repetition, middles, repetition
from bifurc.orbits.shooting.signature import Signature, divided
from studies import branch_audit


def moved(orbit, away):
    """The orbit with other states at the events, as a solution of wrong equations would have them."""
    rows = orbit.unknowns.reshape(-1, 1 + orbit.system.n * 2)
    rows[:, 1:] += away
    return PeriodicOrbit(orbit.system, orbit.sequence, rows.ravel(), orbit.weights, orbit.how)


@pytest.mark.parametrize("load", [0.0, 0.5], ids=["half a period", "a period"])
@pytest.mark.parametrize("away", [[1e-3, 0.0], [0.0, -4e-3]])
def test_a_miss_is_the_growth_of_an_error(load, away):
    """Without events an error d at phase 0 is h = expm(A t) d where the motion begins, and grows on from there.

    Without a constant load the orbit is one of half a period: its second half has the error of the first, the other way.
    """
    orbit = bf.find_orbit(bf.System(1.0, 0.2, 1.0, [HarmonicForce(0.8, phase=0.3), ConstantForce(load)], omega=1.3))
    assert orbit.closure == (1 if load else -1)
    assert repetition(orbit).miss < 1e-12 and repetition(orbit).repeated and repetition(orbit).allowed == module.ALLOWED
    A = np.array([[0.0, 1.0], [-1.0, -0.2]])
    h = expm((0.5 if load else 0.25) * orbit.period * A) @ away
    missed = [expm(orbit.period * A) @ h - h] + ([] if load else [expm(0.5 * orbit.period * A) @ h + h])
    found = repetition(moved(orbit, away))
    assert found.miss == pytest.approx(np.abs(missed / orbit.weights).max(), rel=1e-6) and not found.repeated
    assert found.allowed == module.ALLOWED and found.message == ""  # both multipliers are inside the circle


@pytest.mark.parametrize("top, allowed", [
    (0.3, 1e-6), (1.0, 1e-6), (-40.0, 4e-5), (1e3, 1e-3), (2e4, 0.02), (1e7, 0.02), (1e10, 0.02), (2e10, math.inf),
    (math.inf, math.inf), (math.nan, math.inf)])
def test_rounding_grows_with_the_largest_multiplier_up_to_a_limit(top, allowed):
    assert module._growing(SimpleNamespace(multipliers=np.array([0.5, top]))) == pytest.approx(allowed)


def test_repeated_is_a_miss_up_to_what_is_allowed():
    assert Repetition(1e-6, 1e-6).repeated and not Repetition(1.1e-6, 1e-6).repeated and not Repetition(math.inf, 1e-6).repeated


def test_a_solution_beyond_a_stop_is_no_motion():
    system = bf.systems.impact_oscillator(omega=0.5, amplitude=0.3)
    orbit = bf.find_orbit(system)
    assert not orbit.events and repetition(orbit).repeated
    beyond = repetition(moved(orbit, [30.0, 0.0]))  # the free motion half a period later is still far behind the stop
    assert beyond.miss == math.inf and not beyond.repeated and "stop" in beyond.message
    crowded = bf.System(1.0, 0.0, 0.0, [ConstantForce(1.0), HarmonicForce(1e-9), RigidStop(0.0, 0.9999)], omega=1e-4)
    told = SimpleNamespace(system=crowded, weights=np.ones(2), forcing_period=crowded.period, autonomous=False, periods=1,
                           _whole=(SimpleNamespace(span=1.0), None))
    miss, message = module._missed(told, np.array([0.5]), np.ones(1), np.array([[-1e-3, 0.0]]), 0)
    assert miss == math.inf and message == bf.simulate(crowded, (-1e-3, 0.0), t0=0.5 * crowded.period, periods=1).message != ""


@pytest.mark.parametrize("make", [
    lambda: bf.find_orbit(bf.systems.impact_oscillator(omega=2.6, amplitude=1.0, gap=0.0, restitution=0.8), (-0.3, 0.4), periods=4,
                          transient=0),
    lambda: bf.find_orbit(bf.systems.belt_oscillator())], ids=["four periods", "no clock"])
def test_orbits_of_several_periods_and_without_a_clock_are_compared_over_their_own_period(make):
    orbit = make()
    assert orbit.success and repetition(orbit).repeated
    at, spans = middles(orbit)
    assert spans.sum() * orbit.forcing_period == pytest.approx(orbit.period)
    states = orbit._states(at)
    for k in range(len(at)):
        assert module._missed(orbit, at, spans, states, k)[0] < 1e-8
    wrong = states.copy()
    wrong[(k + 1) % len(at), 1] += 3e-3  # another interval than that of the start
    if len(at) > 1:
        assert module._missed(orbit, at, spans, wrong, k)[0] == pytest.approx(3e-3 / orbit.weights[1], rel=1e-3)


def test_of_several_starts_the_best_counts(monkeypatch):
    """Longest intervals first, three of them; the message is that of a failure without any success."""
    at, spans, tried = np.arange(5.0), np.array([0.1, 0.5, 0.2, 0.9, 0.5]), []
    told = {3: (0.5, ""), 1: (math.inf, "behind"), 4: (2e-7, ""), 2: (0.0, ""), 0: (0.0, "")}
    orbit = SimpleNamespace(_states=lambda at: at, multipliers=np.array([0.4]))
    monkeypatch.setattr(module, "middles", lambda orbit: (at, spans))

    def missed(orbit, at, spans, states, k):
        tried.append(k)
        return told[k]
    monkeypatch.setattr(module, "_missed", missed)
    assert repetition(orbit) == Repetition(2e-7, 1e-6) and tried == [3, 1, 4]
    told[4] = math.inf, "last"
    assert repetition(orbit) == Repetition(0.5, 1e-6)
    told[3] = math.inf, "first"
    assert repetition(orbit) == Repetition(math.inf, 1e-6, "last") and tried[-3:] == [3, 1, 4]
    orbit.multipliers = np.array([1e6])
    told[1] = 0.01, ""
    assert repetition(orbit) == Repetition(0.01, 0.02) and tried[-2:] == [3, 1]


@pytest.mark.parametrize("zeta", [0.02, 0.1, 1.5], ids=["nearly one", "complex", "real"])
def test_how_far_an_orbit_is_from_its_own_solution(zeta):
    """The equations are linear: Newton's step leads all the way back; near a multiplier of 1 rounding moves it farther, and is
    allowed for by |multiplier - 1|."""
    orbit = bf.find_orbit(bf.System(1.0, 2.0 * zeta, 1.0, [HarmonicForce(0.8), ConstantForce(0.5)], omega=1.0))
    mu = np.linalg.eigvals(expm(np.array([[0.0, 1.0], [-1.0, -2.0 * zeta]]) * orbit.period))
    near = min(1.0, np.abs(mu - 1.0).min())
    assert orbit._correction < 1e-13 and (near < 0.2) == (zeta == 0.02)
    for away in ([1e-4, 0.0], [0.0, -3e-4]):
        other = moved(orbit, away)
        step = np.abs(away / other.equations.scale[1:3]).max()
        assert other._correction == pytest.approx(max(step * near, other.residual), rel=1e-6)


def test_a_chattering_listed_once_with_an_impact_more_is_no_motion_of_two_periods():
    """The state comes back after one period of the load, by simulation, and of the two lists one is taken: the multipliers are
    those of the map that is made twice there."""
    system = branch_audit.scene("between_masses", 53044)[0]
    orbit = bf.find_orbit(system)
    assert orbit.success and orbit.periods == 1
    motion = bf.simulate(system, orbit.state, periods=1)
    assert np.abs(motion.y[-1] - orbit.state).max() < 1e-9
    twice = PeriodicOrbit(system, *over_two_periods(orbit), orbit.weights)
    assert reduced(twice).periods == 1 and np.allclose(np.sort(twice.multipliers), np.sort(orbit.multipliers**2), atol=1e-9)


def over_two_periods(orbit):
    """Return sequence and unknowns of an orbit over two of its periods, in the second of which the chattering closes an impact
    earlier."""
    s, size = orbit.sequence, 1 + orbit.scene.ns
    nodes, rows = np.vstack([s.nodes[:, :5]] * 2), np.vstack([orbit.unknowns.reshape(-1, size)] * 2)
    rows[len(s.nodes):, 0] += 1.0
    end = len(s.nodes) + int(np.flatnonzero(s.nodes[:, 4] == 1)[0])
    nodes[end - 1, [2, 4]] = nodes[end, [2, 4]]
    nodes, rows = np.delete(nodes, end, axis=0), np.delete(rows, end, axis=0)
    return Signature(divided(orbit.scene, nodes), np.zeros(len(nodes)), 2.0), rows.ravel()
