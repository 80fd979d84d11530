"""Certificates of orbits: closed forms lie in the enclosures, false orbits are never proved, other scenes are covered."""
import dataclasses

import numpy as np
import pytest

import bifurc as bf
from bifurc import System
from bifurc.certify import Verdict, certify_orbit
from bifurc.certify.arithmetic.balls import Rationals
from bifurc.certify.model import Model
from bifurc.elements import Coulomb, ElasticStop, HarmonicForce, Jenkins, RigidStop
from bifurc.orbits.orbit import PeriodicOrbit
from tests.certify.orbits_made import one_impact, random_cases, system_of
from tests.reference import one_stop

pytest.importorskip("flint")


def judged(count, seed):
    """Random orbits of the closed form, admissible or not, with their certificates."""
    for zeta, omega, force, gap, r, n in random_cases(count, seed):
        for reference in one_stop.orbits(zeta, omega, force, gap, r, n, samples=100):
            orbit = one_impact(system_of(zeta, omega, force, gap, r), reference.time, reference.speed, n, gap)
            yield reference, orbit, certify_orbit(orbit)


def test_closed_forms_lie_in_the_enclosures_and_formal_orbits_are_not_proved():
    proved = formal = undecided = 0
    for reference, orbit, found in judged(40, 1):
        assert found.exists is Verdict.PROVED
        assert found.radius < 1e-12
        if not reference.admissible:
            assert not found.proved, (orbit.system, found)
            formal += 1
            continue
        if not found.proved:
            assert float(reference.margin) < 1e-6 or float(reference.speed) < 1e-6
            undecided += 1
            continue
        proved += 1
        (event,) = found.events
        assert event.time[0] <= reference.time <= event.time[1]
        assert event.speed[0] <= reference.speed <= event.speed[1]
        assert found.grazing_distance <= float(reference.margin)
        for z in reference.multipliers:
            assert any(re[0] <= z.real <= re[1] and im[0] <= z.imag <= im[1] for re, im in found.multipliers)
            assert not found.contains(complex(z) + 1e-6)
        top = abs(reference.multipliers[0])
        if found.stable is not Verdict.UNDECIDED:
            assert (found.stable is Verdict.PROVED) == (top < 1)
        else:
            assert abs(top - 1) < 1e-9
    assert proved > 10 and formal > 10 and undecided == 0


@pytest.mark.parametrize("shift", [1e-3, 1e-6, 3e-9])
@pytest.mark.parametrize("place", [0, 1, 2])
def test_shifted_orbits_are_not_proved(shift, place):
    orbit = bf.find_orbit(bf.systems.impact_oscillator(omega=0.8))
    assert orbit.certify().proved
    unknowns = orbit.unknowns
    unknowns[place] += shift * (1.0 if place == 0 else orbit.weights[place - 1])
    assert not PeriodicOrbit(orbit.system, orbit.sequence, unknowns, orbit.weights).certify().proved


def test_a_wrong_sequence_is_not_proved():
    """The free response that passes through the stop, offered as a motion without events; and an impact that is not there."""
    system = bf.systems.impact_oscillator(omega=0.8)
    free = bf.find_orbit(system.with_parameters(gap=10.0))
    claimed = PeriodicOrbit(system, free.sequence, free.unknowns, free.weights).certify()
    assert claimed.exists is Verdict.PROVED and claimed.admissible is Verdict.DISPROVED
    assert "rigid_stop" in claimed.message
    hitting = bf.find_orbit(system)
    beside = PeriodicOrbit(system.with_parameters(gap=1.001), hitting.sequence, hitting.unknowns, hitting.weights).certify()
    assert not beside.proved


STICK_SLIP = System(1.0, 0.1, 1.0, [HarmonicForce(1.0), Coulomb(0.6)], omega=0.4)
SCENES = {
    "stick and slip": STICK_SLIP,
    "higher limit of stick": System(1.0, 0.1, 1.0, [HarmonicForce(1.0), Coulomb(0.6, static_ratio=1.2)], omega=0.4),
    "reversals without stick": System(1.0, 0.1, 1.0, [HarmonicForce(2.0), Coulomb(0.3)], omega=1.3),
    "stuck all the time": System(1.0, 0.1, 1.0, [HarmonicForce(0.5), Coulomb(0.8)], omega=0.9),
    "elastic slider": System(1.0, 0.1, 1.0, [HarmonicForce(1.5), Jenkins(2.0, 0.6)], omega=0.9),
    "slider whose load varies and is lost": System(
        1.0, 0.1, 1.0, [HarmonicForce(1.5), Jenkins(2.0, 0.6, load_amplitude=1.4, load_phase=0.3)], omega=0.9),
    "elastic stop": bf.systems.bilinear_oscillator(omega=1.2),
    "elastic stop with a dashpot": System(1.0, 0.1, 1.0, [HarmonicForce(1.0), ElasticStop(0.5, 6.0, damping=0.4)], omega=0.9),
    "rest on the stop": System(1.0, 0.1, 1.0, [HarmonicForce(1.0), RigidStop(0.3, 0.0)], omega=0.9),
    "two stops, half a period": bf.systems.two_sided_impact_oscillator(),
    "moving table": bf.systems.bouncing_ball(),
    "chain of eight": bf.systems.impact_chain(),
}
GUESSES = {"moving table": (2.49, 2.37)}  # a bouncing ball; from rest it is carried along


@pytest.mark.parametrize("scene", SCENES, ids=str)
def test_scenes_are_proved_and_agree_with_the_multipliers(scene):
    orbit = bf.find_orbit(SCENES[scene], guess=GUESSES.get(scene))
    found = orbit.certify()
    assert found.proved, found.message
    assert found.stable.value == {True: "proved", False: "disproved", None: "undecided"}[orbit.stable]
    assert found.radius < 1e-9 < found.unique_in
    for z in orbit.multipliers:
        away = [max(re[0] - z.real, z.real - re[1], im[0] - z.imag, z.imag - im[1]) for re, im in found.multipliers]
        assert min(away) < 1e-9
    assert len(found.events) == len(orbit.events)
    mine_all, all_theirs = sorted(e.time[0] % orbit.period for e in found.events), sorted(e.time for e in orbit.events)
    for mine, theirs in zip(mine_all, all_theirs, strict=True):
        assert abs(mine - theirs) < 1e-9 * orbit.period


def test_what_is_not_covered_is_refused_by_name():
    cubic = bf.find_orbit(bf.systems.duffing_oscillator()).certify()
    assert not cubic.exists and "cubic" in cubic.message
    chatter = bf.find_orbit(System(1.0, 0.1, 1.0, [HarmonicForce(1.0), RigidStop(0.3, 0.5)], omega=0.3)).certify()
    assert not chatter.exists and "chattering" in chatter.message


def test_precision_is_checked_and_obeyed():
    orbit = bf.find_orbit(bf.systems.impact_oscillator(omega=0.8))
    with pytest.raises(ValueError, match="precision = 10 .*64"):
        orbit.certify(precision=10)
    assert orbit.certify(precision=300).precision == 300


def test_without_the_extra_the_call_says_what_to_install(monkeypatch):
    orbit = bf.find_orbit(bf.systems.impact_oscillator(omega=0.8))
    monkeypatch.setitem(__import__("sys").modules, "flint", None)
    with pytest.raises(ImportError, match=r"pip install 'bifurc\[certify\]'"):
        orbit.certify()


def test_certificates_are_stored(tmp_path):
    found = bf.find_orbit(STICK_SLIP).certify()
    found.save(tmp_path / "proof.npz")
    read = bf.load(tmp_path / "proof.npz")
    for field in dataclasses.fields(found):
        if field.name not in ("multipliers", "events"):
            assert getattr(read, field.name) == getattr(found, field.name)
    assert np.array_equal(read.multipliers, found.multipliers)
    assert [(e.time, e.kind, e.speed) for e in read.events] == [(e.time, e.kind, e.speed) for e in found.events]
    assert repr(read) == repr(found)


def test_nothing_that_acts_is_left_out():
    """An element that acts on the past has empty modes: it must not be taken for one that does nothing."""
    from bifurc.elements import DelayedFeedback

    plain = bf.find_orbit(bf.systems.impact_oscillator(omega=0.8))
    core = plain.system
    driven = System(core.mass, core.damping, core.stiffness, [*core.elements, DelayedFeedback(0.1)], omega=core.omega)
    free = bf.find_orbit(System(core.mass, core.damping, core.stiffness, core.elements[:1], omega=core.omega))
    with pytest.raises(ValueError, match="delay"):
        Model(driven, Rationals(), [])
    assert free.certify().proved


def test_an_orbit_that_was_solved_on_half_its_period_is_proved():
    """Its own mirror image, y(t + T/2) = -y(t); what is an orbit to a thousandth only is proved to be none, or not proved."""
    half = bf.find_orbit(bf.systems.two_sided_impact_oscillator(omega=2.0, amplitude=3.0))
    assert half.closure == -1 and certify_orbit(half).exists is Verdict.PROVED
    moved = PeriodicOrbit(half.system, half.sequence, half.unknowns + 1e-3, half.weights)
    assert certify_orbit(moved).exists is not Verdict.PROVED
