"""What every builder puts into its system, at values that are all different: matrices, loads and contacts with their numbers."""
import math

import numpy as np
import pytest

from bifurc import elements as el
from bifurc import systems
from bifurc.elements.local import Core, affine
from bifurc.systems.rotors import unbalance

QUARTER = -0.5 * math.pi  # of a turn: cos becomes sin
I2 = np.eye(2)


def check(system, M, C, K, elements, omega=None):
    """Compare matrices, and elements field by field with tolerance of rounding."""
    for name, matrix in (("mass", M), ("damping", C), ("stiffness", K)):
        assert getattr(system, name) == pytest.approx(np.atleast_2d(matrix), rel=1e-14, abs=1e-15), name
    assert system.omega == omega and len(system.elements) == len(elements)
    for found, known in zip(system.elements, elements, strict=True):
        one, other = found.to_record(), known.to_record()
        assert list(one) == list(other)
        for name, value in other.items():
            if name == "element":  # of a driven one
                assert one[name] == {key: pytest.approx(item, rel=1e-14) if type(item) is float else pytest.approx(
                    list(item)) if isinstance(item, tuple) else item for key, item in value.items()}
            else:
                assert one[name] == (pytest.approx(value, rel=1e-14, abs=1e-15) if type(value) is float else value), (name, value)


def force(element, q, v, mass, t, omega):
    """Return the affine force of a load on all coordinates at a time."""
    n = len(mass)
    found = element.mode("always", Core(mass, mass, mass, omega)).force
    values = [sum(weight * (math.cos(k * omega * t) if name == "cos" else math.sin(k * omega * t) if name == "sin" else 1.0)
                  for (name, k), weight in affine(entry).terms.items()) for entry in found]
    return element.site(n).R.T @ values


# ---- one degree of freedom -----------------------------------------------------------------------------------------------------


def test_oscillators_with_stops_and_springs():
    load = el.HarmonicForce(0.7)
    check(systems.impact_oscillator(zeta=0.2, omega=0.9, amplitude=0.7, gap=0.4, restitution=0.3), 1, 0.4, 1,
          (load, el.RigidStop(0.4, 0.3)), 0.9)
    check(systems.two_sided_impact_oscillator(zeta=0.2, omega=0.9, amplitude=0.7, gap=0.4, restitution=0.3), 1, 0.4, 1,
          (load, el.RigidStop(0.4, 0.3), el.RigidStop(0.4, 0.3, side=-1)), 0.9)
    check(systems.bilinear_oscillator(zeta=0.2, omega=0.9, amplitude=0.7, gap=0.4, stiffness_ratio=2.5), 1, 0.4, 1,
          (load, el.ElasticStop(0.4, 1.5)), 0.9)
    check(systems.duffing_oscillator(zeta=0.2, omega=0.9, amplitude=0.7, alpha=-0.4, beta=0.3), 1, 0.4, -0.4,
          (load, el.CubicSpring(0.3)), 0.9)
    for damper in ("frame", "ground"):
        check(systems.moving_frame_impact_oscillator(zeta=0.2, omega=0.9, amplitude=0.7, gap=0.4, restitution=0.3, damper=damper),
              1, 0.4, 1, (el.BaseMotion(0.7, damper=damper), el.RigidStop(0.4, 0.3)), 0.9)
    check(systems.bouncing_ball(omega=0.9, amplitude=0.7, restitution=0.3, gravity=1.7), 1, 0, 0,
          (el.ConstantForce(-1.7), el.RigidStop(0.0, 0.3, side=-1, amplitude=0.7, harmonic=1)), 0.9)


def test_oscillators_with_dry_friction():
    load = el.HarmonicForce(0.7, phase=QUARTER)
    check(systems.dry_friction_oscillator(zeta=0.2, omega=0.9, amplitude=0.7, friction=0.4, friction_negative=0.3), 1, 0.4, 1,
          (load, el.Coulomb(0.4, 0.3)), 0.9)
    check(systems.dry_friction_oscillator(zeta=0.2, omega=0.9, amplitude=0.7, friction=0.4, load_amplitude=0.6, load_phase=0.2), 1,
          0.4, 1, (load, el.Coulomb(0.4, load_amplitude=0.6, load_phase=0.2)), 0.9)
    check(systems.dry_friction_oscillator(friction=0.4, load_amplitude=0.6), 1, 0.2, 1,
          (el.HarmonicForce(1.4, phase=QUARTER), el.Coulomb(0.4, load_amplitude=0.6)), 1.0)
    check(systems.jenkins_oscillator(zeta=0.2, omega=0.9, amplitude=0.7, stiffness=1.5, limit=0.4), 1, 0.4, 1,
          (el.HarmonicForce(0.7), el.Jenkins(1.5, 0.4)), 0.9)
    with pytest.raises(ValueError, match="load_phase = 0.1 is not allowed with a constant load"):
        systems.dry_friction_oscillator(load_phase=0.1)
    with pytest.raises(ValueError, match="friction = -0.1 is not allowed; it must be a finite number, at least 0"):
        systems.dry_friction_oscillator(friction=-0.1)


def test_belts():
    common = dict(zeta=0.2, belt_speed=0.7, static=1.2, kinetic=0.8, decay_speed=0.6, falling=0.3, rising=0.15)
    for law, contact in (("coulomb", el.Coulomb(0.8, static=1.2, belt_speed=0.7)),
                         ("exponential", el.Stribeck(0.8, 1.2, 0.6, belt_speed=0.7)),
                         ("cubic", el.CubicFriction(1.2, 0.3, 0.15, belt_speed=0.7))):
        check(systems.belt_oscillator(law=law, **common), 1, 0.4, 1, (contact,))
    systems.belt_oscillator(law="cubic", kinetic=2.0, static=1.0)  # not used by the cubic law
    assert systems.belt_oscillator(static=0.6, kinetic=0.6).elements[0].static == 0.6
    for given, words in (({"law": "dry"}, "law = 'dry' .* one of 'coulomb', 'exponential', 'cubic'"),
                         ({"kinetic": -0.1}, "kinetic = -0.1"),
                         ({"static": 0.5}, "static = 0.5 is not allowed; it must be at least kinetic = 0.6")):
        with pytest.raises(ValueError, match=words):
            systems.belt_oscillator(**given)


def test_a_chain_counts_its_masses_from_either_end():
    for stopped, loaded in ((0, 2), (-3, -1), (1, -3)):
        made = systems.impact_chain(n=3, mass=2.0, stiffness=1.5, damping=0.2, omega=0.9, amplitude=0.7, gap=0.4, restitution=0.3,
                                    stopped=stopped, loaded=loaded)
        K = 1.5 * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
        check(made, 2.0 * np.eye(3), 0.2 * K, K,
              (el.HarmonicForce(0.7, dof=loaded % 3), el.RigidStop(0.4, 0.3, dof=stopped % 3)), 0.9)
    assert systems.impact_chain(n=1).stiffness.tolist() == [[1.0]]
    for name in ("stopped", "loaded"):
        systems.impact_chain(n=3, **{name: 2}), systems.impact_chain(n=3, **{name: -3})
        for wrong in (3, -4):
            with pytest.raises(ValueError, match=f"{name} = {wrong} is not allowed; it must be a whole number, at least -3 and at"):
                systems.impact_chain(n=3, **{name: wrong})


# ---- contacts on a bench -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("case, numbers", [
    (1, (3.0, 2.0, 1, 5.0, 20.0, 0.25, 0.0)), (2, (3.0, 2.0, 1, 4.0, 5.0, 2.0, 0.0)), (3, (3.0, 3.0, 3, 6.0, 18.0, 0.25, QUARTER))])
def test_the_contact_of_yang(case, numbers):
    def bench(ax, ay, ky, k, n, rho, phase):
        contact = el.Jenkins(k, 0.4 * n, load_amplitude=rho, load_phase=phase)
        return el.Driven(contact, ax, phase=QUARTER, label="x"), el.Driven(contact, ay, ky, label="y")

    names = ("amplitude_x", "amplitude_y", "harmonic_y", "stiffness", "load", "load_amplitude", "load_phase")
    check(systems.macro_slip_contact(case=case, omega=0.9, friction=0.4), 1, 0.9, 0.81, bench(*numbers), 0.9)
    for name, other in zip(names, (1.1, 1.2, 2, 1.3, 1.4, 0.0, 1.5), strict=True):
        given = tuple(other if own == name else known for own, known in zip(names, numbers, strict=True))
        check(systems.macro_slip_contact(case=case, omega=0.9, friction=0.4, **{name: other}), 1, 0.9, 0.81, bench(*given), 0.9)
    for name in ("friction", "load"):
        with pytest.raises(ValueError, match=f"{name} = -0.1 is not allowed; it must be a finite number, at least 0"):
            systems.macro_slip_contact(case=case, **{name: -0.1})


def test_rings_and_strips():
    common = dict(n=4, omega=0.9, amplitude=0.2, friction=0.4, length=8.0, area=3.0, modulus=7.0, width=1.5, contact=2.5)
    springs = (7.0 * 3.0 / 2.0, 2.5 * 1.5 * 2.0)
    ring = el.MicroSlip(*springs, (0.4 * 6.0 / 4,) * 4, True)
    check(systems.micro_slip_ring(load=6.0, **common), 1, 0.9, 0.81, (el.Driven(ring, 0.2, phase=QUARTER, label="ring"),), 0.9)
    varied = el.LoadedMicroSlip(*springs, (0.6,) * 4, (0.7,) * 4, (0.3,) * 4, 2, True)
    check(systems.micro_slip_ring(load=6.0, load_amplitude=0.7, load_harmonic=2, load_phase=0.3, **common), 1, 0.9, 0.81,
          (el.Driven(varied, 0.2, phase=QUARTER, label="ring"),), 0.9)
    loads = (9.0, 2.0 + 7.0 / 9.0, 2.0 + 7.0 / 9.0, 9.0)  # at -1, -1/3, 1/3, 1 of a parabola
    for given, own in (({"load_end": 9.0, "load_middle": 2.0}, loads), ({"loads": [1.0, 2.0, 3.0, 4.0]}, (1.0, 2.0, 3.0, 4.0))):
        strip = el.MicroSlip(*springs, tuple(0.4 * load for load in own))
        check(systems.micro_slip_strip(**given, **common), 1, 0.9, 0.81,
              (el.Driven(strip, 0.2, phase=QUARTER, label="strip"),), 0.9)
    loads = (1.0, 2.0, 3.0, 4.0)
    made = systems.micro_slip_strip(load_amplitude=0.7, loads=loads, **common).elements[0].element
    assert made == el.LoadedMicroSlip(*springs, tuple(0.4 * load for load in loads), (0.7,) * 4, (0.0,) * 4, 1, False)
    assert systems.micro_slip_strip(n=1, load_middle=3.0, load_end=5.0, friction=1.0).elements[0].element.limits == (3.0,)
    for build in (systems.micro_slip_ring, systems.micro_slip_strip):
        with pytest.raises(ValueError, match=f"{build.__name__}: load_phase = 0.0 is not allowed with a constant load"):
            build(load_phase=0.0)
        with pytest.raises(ValueError, match=f"{build.__name__}: n = 0 is not allowed; it must be a whole number, at least 1"):
            build(n=0)
    with pytest.raises(ValueError, match="loads has 2 numbers; it must be n = 4, one a block"):
        systems.micro_slip_strip(n=4, loads=(1.0, 2.0))


def test_friction_damped_oscillators():
    """The macro damper has the stuck stiffness of the strip, the micro one its sliders: drops of the slope of its virgin curve."""
    given = dict(omega=9.0, normal_load=7.0, n=3, mass=2.0, stiffness=50.0, damping=0.4, force=6.0, friction=0.3, contact=1.5,
                 span=2.0)
    strip = el.MicroSlip(1.5 * (3 / 2.0)**2, 1.5, (1.0 / 3,) * 3)
    K = strip.spring * np.array([[1.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]]) + 1.5 * np.eye(3)
    stuck = K[0, 0] - K[0, 1:] @ np.linalg.solve(K[1:, 1:], K[1:, 0])
    load = el.HarmonicForce(6.0)
    made = systems.friction_damped_oscillator(**given)
    assert made.elements[1].stiffness == pytest.approx(stuck, rel=1e-13)
    check(made, 2, 0.4, 50, (load, el.Jenkins(made.elements[1].stiffness, 2.1)), 9.0)
    micro = systems.friction_damped_oscillator(damper="micro", **given).elements[1]
    drive = np.linspace(0.0, 3.0, 40)
    assert micro.virgin_force(2.1 * drive) == pytest.approx(2.1 * strip.virgin_force(drive), rel=1e-12)
    assert sum(micro.limits) == pytest.approx(2.1) and len(micro.limits) == 3
    for wrong, words in (({"damper": "none"}, "damper = 'none'"), ({"n": 0}, "n = 0"), ({"normal_load": -1.0}, "normal_load = -1"),
                         ({"span": 0.0}, "span = 0.0 .* above 0")):
        with pytest.raises(ValueError, match=words):
            systems.friction_damped_oscillator(**wrong)


# ---- rotors --------------------------------------------------------------------------------------------------------------------


def test_an_unbalance_turns_forwards():
    t, omega = 0.7, 1.3
    total = sum(force(item, None, None, I2, t, omega) for item in unbalance(0.4))
    assert total == pytest.approx([0.4 * math.cos(omega * t), 0.4 * math.sin(omega * t)], rel=1e-14)
    assert [item.label for item in unbalance(0.4)] == ["unbalance_x", "unbalance_y"]


def test_rotors_in_a_stator():
    common = dict(zeta=0.2, nu=1.5, eccentricity=0.3, friction=0.15, disk_radius=4.0, gravity=0.6)
    loads = (*unbalance(0.3 * 2.25), el.ConstantForce(-0.6, dof=1, label="gravity"))
    soft = el.ElasticStator(stiffness=7.0, damping=0.5, friction=0.15, centre_x=0.1, surface_speed=6.0, label="stator")
    check(systems.jeffcott_rotor(stiffness=7.0, contact_damping=0.5, offset=0.1, **common), I2, 0.4 * I2, I2, (*loads, soft), 1.5)
    hard = el.RigidStator(restitution=0.4, friction=0.15, centre_x=0.1, surface_speed=6.0, label="stator")
    check(systems.rigid_stator_rotor(restitution=0.4, offset=0.1, **common), I2, 0.4 * I2, I2, (*loads, hard), 1.5)
    arcs = [el.ElasticStator(stiffness=7.0, damping=0.5, friction=0.15, radius=1.2, centre_x=-0.2 * x, centre_y=-0.2 * y,
                             surface_speed=6.0, label=f"arc_{name}")
            for name, x, y in (("right", 1, 0), ("up", 0, 1), ("left", -1, 0), ("down", 0, -1))]
    check(systems.snubber_rotor(stiffness=7.0, contact_damping=0.5, preload=0.2, **common), I2, 0.4 * I2, I2, (*loads, *arcs), 1.5)
    for build in (systems.jeffcott_rotor, systems.rigid_stator_rotor):
        for offset in (-1.0, 1.0):
            build(offset=offset)
        for name, wrong in (("nu", 0.0), ("offset", 1.01), ("offset", -1.01), ("disk_radius", -0.1)):
            with pytest.raises(ValueError, match=f"{build.__name__}: {name} = {wrong}"):
                build(**{name: wrong})
    for name, wrong in (("nu", 0.0), ("preload", 0.0), ("disk_radius", -0.1)):
        with pytest.raises(ValueError, match=f"snubber_rotor: {name} = {wrong}"):
            systems.snubber_rotor(**{name: wrong})


def test_a_rotor_in_a_casing():
    made = systems.rotor_in_casing(zeta=0.2, nu=1.5, eccentricity=0.3, stiffness=7.0, friction=0.15, disk_radius=4.0,
                                   casing_mass=3.0, casing_damping=0.7, casing_stiffness=9.0)
    stator = el.ElasticStator(stiffness=7.0, friction=0.15, against_x=2, against_y=3, surface_speed=6.0, label="stator")
    check(made, np.diag([1.0, 1.0, 3.0, 3.0]), np.diag([0.4, 0.4, 0.7, 0.7]), np.diag([1.0, 1.0, 9.0, 9.0]),
          (*unbalance(0.3 * 2.25), stator), 1.5)
    for name in ("nu", "casing_mass"):
        with pytest.raises(ValueError, match=f"rotor_in_casing: {name} = 0.0"):
            systems.rotor_in_casing(**{name: 0.0})


@pytest.mark.parametrize("nu", [1.5, -0.8])
@pytest.mark.parametrize("casing", [None, 3.0])
def test_the_rotating_frame_is_the_fixed_one_turned(nu, casing):
    """z = w exp(i nu t) in M z'' + C z' + K z, body by body, in complex numbers."""
    made = systems.rotating_frame_rotor(zeta=0.2, nu=nu, eccentricity=0.3, stiffness=7.0, friction=0.15, disk_radius=4.0,
                                        contact_damping=0.5, casing_mass=casing, casing_damping=0.7, casing_stiffness=9.0)
    w, dw = np.array([0.3 - 0.4j, 0.2 + 0.7j]), np.array([-0.5 + 0.1j, 0.6 - 0.2j])
    bodies = [(1.0, 0.4, 1.0), (3.0, 0.7, 9.0)][:1 if casing is None else 2]
    n = 2 * len(bodies)
    q, v = (np.array([part for z in values[:n // 2] for part in (z.real, z.imag)]) for values in (w, dw))
    found = made.damping @ v + made.stiffness @ q
    for i, (m, c, k) in enumerate(bodies):
        rest = m * (2j * nu * dw[i] - nu**2 * w[i]) + c * (dw[i] + 1j * nu * w[i]) + k * w[i]
        assert found[2 * i] + 1j * found[2 * i + 1] == pytest.approx(rest, rel=1e-14)
        assert np.array_equal(made.mass[2 * i:2 * i + 2, 2 * i:2 * i + 2], m * I2)
    second = (None, None) if casing is None else (2, 3)
    stator = el.ElasticStator(stiffness=7.0, damping=0.5, friction=0.15, surface_speed=4.0 * nu, frame_spin=nu, label="stator",
                              against_x=second[0], against_y=second[1])
    check(made, made.mass, made.damping, made.stiffness, (el.ConstantForce(0.3 * nu**2, dof=0, label="unbalance"), stator))
    with pytest.raises(ValueError, match="casing_mass = 0.0"):
        systems.rotating_frame_rotor(casing_mass=0.0)


def test_oil_film_rotors():
    film, weight = el.OilFilm(label="film"), el.ConstantForce(-0.7 / 1.6, dof=1, label="weight")
    M, none = 5.0 * 1.6 * I2, 0.0 * I2
    check(systems.oil_film_journal(speed_ratio=1.6, load=0.7, mass=5.0), M, none, none, (weight, film))
    check(systems.oil_film_rotor(speed_ratio=1.6, unbalance=0.3, load=0.7, mass=5.0), M, none, none,
          (*unbalance(5.0 * 1.6 * 0.3), weight, film), 1.0)
    for build in (systems.oil_film_rotor, systems.oil_film_journal):
        for name in ("speed_ratio", "mass"):
            with pytest.raises(ValueError, match=f"{build.__name__}: {name} = 0.0"):
                build(**{name: 0.0})
    made = systems.oil_film_rub_rotor(speed_ratio=1.6, unbalance=0.3, load=0.7, journal_mass=2.0, disk_mass=5.0,
                                      shaft_stiffness=8.0, disk_damping=0.4, journal_damping=0.09, clearance=0.6, stiffness=12.0,
                                      friction=0.15, disk_radius=4.0)
    loads = tuple(el.HarmonicForce(5.0 * 1.6 * 0.3, dof=dof, phase=phase, label=label)
                  for dof, phase, label in ((2, 0.0, "unbalance_x"), (3, QUARTER, "unbalance_y")))
    weights = (el.ConstantForce(-0.7 / 1.6 * 2.0 / 7.0, dof=1, label="journal_weight"),
               el.ConstantForce(-0.7 / 1.6 * 5.0 / 7.0, dof=3, label="disk_weight"))
    stator = el.ElasticStator(x=2, y=3, radius=0.6, stiffness=12.0 / 1.6, friction=0.15, surface_speed=4.0, label="stator")
    check(made, 1.6 * np.diag([2.0, 2.0, 5.0, 5.0]), np.diag([0.09, 0.09, 0.4, 0.4]), 5.0 * np.kron([[1, -1], [-1, 1]], I2),
          (*loads, *weights, film, stator), 1.0)
    for name in ("speed_ratio", "journal_mass", "disk_mass", "clearance"):
        with pytest.raises(ValueError, match=f"oil_film_rub_rotor: {name} = 0.0"):
            systems.oil_film_rub_rotor(**{name: 0.0})
    with pytest.raises(ValueError, match="disk_radius = -1.0"):
        systems.oil_film_rub_rotor(disk_radius=-1.0)
