"""Hard and bad cases of rotors that rub: each ends in the right motion, a named status, or one clear sentence."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.orbits.concentric import concentric
from tests.reference.rub import elastic_rotor


def test_a_motion_through_the_centre_of_the_stator():
    # r = 0: nothing has a direction to turn, and nothing happens
    zeta, x0 = 0.05, 0.8
    system = bf.systems.jeffcott_rotor(zeta=zeta, nu=1.0, eccentricity=0.0, offset=0.0)
    motion = bf.simulate(system, (x0, 0.0, 0.0, 0.0), periods=2)
    t, y = motion.sample(200)
    wd = np.sqrt(1.0 - zeta**2)
    known = x0 * np.exp(-zeta * t) * (np.cos(wd * t) + zeta / wd * np.sin(wd * t))
    assert motion.success and np.abs(y[:, 0] - known).max() < 1e-12 and np.abs(y[:, 1]).max() == 0.0


@pytest.mark.parametrize("y0", [(0.6, 1.5, 0.3, 0.0), (1.9, 0.0, -0.2, 0.4), (0.6, -1.2, 0.0, 0.0)])
def test_a_start_inside_the_elastic_wall(y0):
    system = bf.systems.jeffcott_rotor()
    motion = bf.simulate(system, y0, periods=1)
    assert motion.success
    assert np.abs(elastic_rotor(np.array(y0), system.period, **system.parameters) - motion.final).max() < 1e-9


def test_a_stiff_stator():
    system = bf.systems.jeffcott_rotor(stiffness=1e6)
    motion = bf.simulate(system, (0.3, 0.2, 0.0, 0.0), periods=3)
    assert motion.success and np.isfinite(motion.final).all()
    depth = np.hypot(motion.sample(400)[1][:, 0] - 0.6, motion.sample(400)[1][:, 1]) - 1.0
    assert depth.max() < 3e-3  # the speed over the frequency of the contact


@pytest.mark.parametrize("builder", [bf.systems.jeffcott_rotor, bf.systems.rigid_stator_rotor, bf.systems.rotor_in_casing])
def test_spin_zero_is_refused_where_it_is_the_clock(builder):
    with pytest.raises(ValueError, match="nu"):
        builder(nu=0.0)


def test_spin_zero_is_a_rotor_at_rest_in_the_other_frame():
    rest = bf.find_equilibrium(bf.systems.rotating_frame_rotor(nu=0.0))
    assert rest.success and rest.stable and np.abs(rest.state).max() == 0.0


def test_concentric_rotors_are_told_from_others():
    s = bf.systems
    assert concentric(s.jeffcott_rotor(offset=0.0)) and concentric(s.rotor_in_casing()) and concentric(s.oil_film_rotor(load=0.0))
    assert concentric(s.rigid_stator_rotor(offset=0.0)) and concentric(s.jeffcott_rotor(offset=0.0, eccentricity=0.0))
    for system in (s.jeffcott_rotor(), s.jeffcott_rotor(offset=0.0, gravity=0.1), s.oil_film_rotor(), s.impact_oscillator(),
                   s.snubber_rotor()):
        assert not concentric(system)


def test_partial_rub_of_a_concentric_rotor_is_not_looked_for_by_turns():
    system = bf.systems.jeffcott_rotor(offset=0.0, nu=1.05, stiffness=25.0, friction=0.1)
    orbit = bf.find_orbit(system)
    assert not orbit.success and orbit.status == "concentric" and "rotating_frame_rotor" in orbit.message
    for nu, friction, stiffness in ((1.5, 0.1, 25.0), (1.0, 0.05, 4.0)):  # no rub, and synchronous rub, are orbits of one turn
        orbit = bf.find_orbit(system.with_parameters(nu=nu, friction=friction, stiffness=stiffness))
        assert orbit.success and orbit.sequence.events == 0
        r = np.hypot(*orbit.sample(50)[1][:, :2].T)
        assert np.ptp(r) < 1e-12
