"""Rotors that rub: orbits, multipliers and special points against a second implementation, closed forms and 20-digit values."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import ElasticStator, OilFilm, RigidStator
from bifurc.elements.stators import impact, impact_slope
from tests.reference.rub import contact_speeds, elastic_rotor


def test_a_rub_orbit_closes_in_a_second_implementation():
    system = bf.systems.jeffcott_rotor()
    orbit = bf.find_orbit(system)
    assert orbit.success and orbit.stable and orbit.sequence.events == 4
    end = elastic_rotor(orbit.state, orbit.period, **system.parameters)
    assert np.abs(end - orbit.state).max() < 1e-11


@pytest.mark.parametrize(("nu", "multiplier"), [(0.86, -1.127), (1.10, -1.074), (1.16, -1.300), (1.22, -1.488), (1.28, -1.631)])
def test_multipliers_of_unstable_rub_orbits(nu, multiplier):
    orbit = bf.find_orbit(bf.systems.jeffcott_rotor(nu=nu), guess=bf.find_orbit(bf.systems.jeffcott_rotor()))
    assert orbit.success and orbit.stable is False
    real = orbit.multipliers[np.argmax(np.abs(orbit.multipliers))]
    assert abs(real - multiplier) < 5.1e-4
    assert np.abs(elastic_rotor(orbit.state, orbit.period, **orbit.parameters) - orbit.state).max() < 1e-10


def test_an_unstable_rub_orbit_to_ten_digits():
    orbit = bf.find_orbit(bf.systems.jeffcott_rotor(nu=1.28), guess=(1.436, -0.348, 0.456, 0.668))
    known = (1.435757840528465, -0.348039325418749, 0.455604609814722, 0.667747833906096)
    assert np.abs(orbit.state - known).max() < 1e-12
    assert abs(orbit.multipliers[0] + 1.630858324397) < 1e-10


def test_the_flip_of_the_rub_orbit():
    branch = bf.trace(bf.find_orbit(bf.systems.jeffcott_rotor()), "nu", bounds=(1.0, 1.12))
    flips = [point for point in branch.special_points if point.kind == "period_doubling"]
    assert len(flips) == 1 and abs(flips[0].parameter - 1.0854564383082) < 1e-12


@pytest.mark.parametrize("changes", [
    {"contact_damping": 0.4}, {"contact_damping": 0.4, "nu": 1.0}, {"gravity": 0.1}, {"gravity": 0.3, "contact_damping": 0.2},
    {"contact_damping": 0.4, "gravity": 0.1, "offset": 0.5, "nu": 1.3}])
def test_orbits_with_contact_damping_and_gravity(changes):
    # with a dashpot the contact ends at zero force, inside the stator: separating ends as an event of its own
    system = bf.systems.jeffcott_rotor(**changes)
    orbit = bf.find_orbit(system)
    assert orbit.success and orbit.sequence.events >= 2
    end = elastic_rotor(orbit.state, orbit.period, **system.parameters)
    assert np.abs(end - orbit.state).max() < 1e-11
    h, M = 1e-5, np.empty((4, 4))
    for k in range(4):
        moved = [elastic_rotor(orbit.state + sign * h * np.eye(4)[k], orbit.period, **system.parameters) for sign in (1, -1)]
        M[:, k] = (moved[0] - moved[1]) / (2.0 * h)
    assert np.abs(np.sort_complex(np.linalg.eigvals(M)) - np.sort_complex(orbit.multipliers)).max() < 1e-7


@pytest.mark.parametrize(("nu", "periods", "events"), [(0.80, 1, 0), (0.86, 2, 2), (0.98, 12, None), (1.04, 1, 4), (1.10, 2, 8),
                                                       (1.16, 2, 8), (1.64, 1, 0)])
def test_attractors_along_the_speed(nu, periods, events):
    orbit = bf.find_orbit(bf.systems.jeffcott_rotor(nu=nu))
    assert orbit.success and orbit.stable and orbit.periods == periods
    assert events is None or orbit.sequence.events == events


@pytest.mark.slow
@pytest.mark.parametrize(("nu", "known"), [(1.22, 0.0690), (1.28, 0.1015)])
def test_chaotic_rub(nu, known):
    found = bf.lyapunov_exponents(bf.systems.jeffcott_rotor(nu=nu), (0.0, 0.0, 0.0, 0.0), periods=1500, transient=200)
    assert found.chaotic and abs(found.values[0] - known) < 0.012
    assert found.values.sum() == pytest.approx(-0.2, abs=1e-9)  # minus twice the damping 2 zeta


def test_chaos_beside_a_stable_orbit():
    system = bf.systems.jeffcott_rotor(nu=0.92)
    assert bf.lyapunov_exponents(system, (0.0, 0.0, 0.0, 0.0), periods=1000, transient=300).chaotic
    orbit = bf.find_orbit(system, guess=(0.5693, -0.3053, 0.0597, 0.4911), periods=2)
    assert orbit.success and orbit.stable and orbit.periods == 2
    single = bf.find_orbit(system, guess=bf.find_orbit(bf.systems.jeffcott_rotor()))
    assert single.success and single.stable is False and abs(single.multipliers[0].imag) > 0.1


def test_the_first_contact():
    speeds = contact_speeds(0.05, 0.2, 0.6)
    branch = bf.trace(bf.find_orbit(bf.systems.jeffcott_rotor(nu=0.8)), "nu", bounds=(0.75, 0.9))
    grazings = [point.parameter for point in branch.special_points if point.kind == "grazing"]
    assert min(abs(nu - speeds[0]) for nu in grazings) < 1e-12 and speeds[0] == pytest.approx(0.82063108771208711, abs=1e-15)


@pytest.mark.slow
def test_an_orbit_without_friction():
    system = bf.systems.jeffcott_rotor(friction=0.0, disk_radius=0.0)
    orbit = bf.find_orbit(system)
    assert orbit.success and orbit.sequence.events >= 2
    end = elastic_rotor(orbit.state, orbit.period, **system.parameters)
    assert np.abs(end - orbit.state).max() < 1e-10


def test_the_impact_law_never_turns_the_sliding_round():
    rng = np.random.default_rng(4)
    for speed, slide, ratio, mu, mass in rng.uniform((0.0, -3.0, 0.0, 0.0, 0.2), (2.0, 3.0, 1.0, 0.9, 3.0), (200, 5)):
        normal, tangential = impact(0.0, 0.0, speed, slide, ratio, mu, mass)
        after, slide_after = speed + normal / mass, slide + tangential / mass
        assert abs(after + ratio * speed) <= 1e-15 * (1.0 + speed)
        assert slide * slide_after >= 0.0 or abs(slide_after) < 1e-15
        expected = np.sign(slide) * min(mu * (1.0 + ratio) * speed, abs(slide))
        assert abs(slide - slide_after - expected) <= 2e-15 * (1.0 + abs(slide))
        slope = np.reshape(impact_slope(0.0, 0.0, speed, slide, ratio, mu, mass), (2, 4))[:, 2:]
        for k in range(2):
            moved = np.array([speed, slide])
            moved[k] += 1e-6
            other = np.array(impact(0.0, 0.0, *moved, ratio, mu, mass))
            if min(speed, abs(slide), abs(abs(slide) - mu * (1 + ratio) * speed)) > 1e-4:
                assert np.abs((other - (normal, tangential)) / 1e-6 - slope[:, k]).max() < 1e-8


@pytest.mark.parametrize("element", [ElasticStator, RigidStator])
@pytest.mark.parametrize(("name", "value"), [("radius", 0.0), ("radius", -1.0), ("friction", -0.1), ("surface_speed", np.nan),
                                             ("x", -1)])
def test_bad_stators_are_refused_by_name(element, name, value):
    with pytest.raises(ValueError, match=name if name != "x" else "x = -1 is not allowed"):
        element(**{name: value}).site(2)


@pytest.mark.parametrize(("name", "value"), [("offset", 1.2), ("nu", 0.0), ("disk_radius", -1.0), ("stiffness", 0.0),
                                             ("contact_damping", -0.1)])
def test_bad_rotors_are_refused_by_name(name, value):
    with pytest.raises(ValueError, match=name.removeprefix("contact_")):
        bf.systems.jeffcott_rotor(**{name: value})


def test_a_start_inside_the_rigid_wall_is_refused():
    with pytest.raises(ValueError, match="beyond the stop"):
        bf.simulate(bf.systems.rigid_stator_rotor(), (1.8, 0.0, 0.0, 0.0), periods=1)


def test_masses_that_differ_are_refused_by_the_rigid_stator():
    with pytest.raises(ValueError, match="same"):
        bf.simulate(bf.System(np.diag([1.0, 2.0]), np.zeros((2, 2)), np.eye(2), [RigidStator()]), (0.0, 0.0, 0.0, 0.0), duration=1)


def test_the_film_needs_a_size():
    with pytest.raises(ValueError, match="size"):
        OilFilm(size=0.0)
