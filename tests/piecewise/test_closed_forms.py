"""Systems of first order against closed forms and numbers of the literature: relays, converters, neurons, Chua's circuit."""
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import Coulomb, ElasticStop, HarmonicForce, RigidStop
from bifurc.piecewise import equilibria

F, S, R = bf.AffineField, bf.AffineSurface, bf.AffineReset


def on_a_belt(V, A=1.0, zeta=0.05, omega=1.6, friction=0.3):
    """x'' + 2 zeta x' + x = F sgn(V - x') + A cos(omega t)."""
    M = [[0.0, 1.0], [-1.0, -2.0 * zeta]]
    return bf.PiecewiseSystem(
        "x v", {"slow": F(M, lambda Fr: [0, Fr], cos={1: lambda A: [0, A]}),
                "fast": F(M, lambda Fr: [0, -Fr], cos={1: lambda A: [0, A]})},
        [bf.Switch(S([0.0, 1.0], lambda V: -V), below="slow", above="fast")], omega=omega, V=V, A=A, Fr=friction)


def test_a_thermostat_has_the_period_of_two_exponentials():
    orbit = bf.find_orbit(bf.systems.thermostat(), (20.0,))
    assert orbit.success and orbit.period == pytest.approx(10.0 * math.log(11.0 / 9.0), abs=1e-11) and orbit.stable
    motion = bf.simulate(bf.systems.thermostat(), (15.0,), duration=5.0)
    assert motion.events[0].time == pytest.approx(5.0 * math.log(15.0 / 9.0), abs=1e-12)
    assert [event.mode_after for event in motion.events[:2]] == [("off",), ("on",)]


@pytest.mark.parametrize("current", [1.01, 1.5, 7.0])
def test_a_neuron_fires_with_the_period_of_one_exponential(current):
    orbit = bf.find_orbit(bf.systems.integrate_and_fire(current=current), (0.5,))
    assert orbit.success and orbit.period == pytest.approx(math.log(current / (current - 1.0)), rel=1e-12)
    assert [event.kind for event in orbit.events] == ["reset"]


def test_a_buck_converter_doubles_its_period_where_it_should():
    """di Bernardo, Garofalo, Glielmo and Vasca (1998); the product of multipliers is exp(-T/(R C))."""
    orbit = bf.find_orbit(bf.systems.buck_converter(), (11.969511538815, 0.591571935915, 0.0))
    assert orbit.success and orbit.period == pytest.approx(400e-6, rel=1e-12)
    np.testing.assert_allclose(sorted(orbit.multipliers, key=np.imag), [-0.691894155545 - 0.447746969128j,
                                                                        -0.691894155545 + 0.447746969128j], atol=1e-9)
    on, again = orbit.events
    assert (on.time - again.time) % orbit.period / orbit.period == pytest.approx(0.402350330388, abs=1e-10)
    np.testing.assert_allclose(again.after, [11.969511538815, 0.591571935915, 0.0], rtol=1e-11, atol=1e-15)
    branch = bf.trace(orbit, "E", bounds=(18.0, 30.0))
    [point] = branch.special_points
    assert point.kind == "period_doubling" and point.parameter == pytest.approx(24.516572829, abs=1e-8) and branch.audit.ok
    on, again = point.solution.events
    np.testing.assert_allclose(again.after[:2], [12.0277089452, 0.6080842878], rtol=1e-9)
    assert (on.time - again.time) % point.solution.period / point.solution.period == pytest.approx(0.509509672869, abs=1e-9)
    np.testing.assert_allclose(np.sort(point.solution.multipliers.real), [-1.0, -0.679194870931], atol=1e-9)
    determinant = np.prod([branch.column(f"multiplier_{k}") for k in range(2)], axis=0)
    np.testing.assert_allclose(determinant, math.exp(-400e-6 / (22.0 * 47e-6)), rtol=1e-9)


def test_chuas_one_sided_cycle():
    orbit = bf.find_orbit(bf.systems.chua_circuit(), (1.0, -0.353564617790, -1.339863032722))
    assert orbit.success and orbit.period == pytest.approx(2.283400900496, abs=1e-10) and orbit.stable is False
    np.testing.assert_allclose(sorted(orbit.multipliers.real), [-1.048753846, -0.01282308], atol=1e-7)
    assert sorted(found.state[0] for found in equilibria(bf.systems.chua_circuit())) == pytest.approx([-1.5, 0.0, 1.5], abs=1e-14)


def test_equilibria_persist_or_meet_in_a_nonsmooth_fold():
    """With F2 - F1 = g and the surface C x = 0 the pseudo-equilibrium's weight is mu (C A^-1 b)/(-C A^-1 g)."""
    A = [[-1.0, 1.0], [-1.0, -0.5]]
    for g, slope, rate, both in (((0.5, -1.0), 1.0 / 3.0, -1.5, False), ((-2.0, -1.0), 2.0, 1.0, True)):
        for mu in (-0.3, 0.3):
            system = bf.PiecewiseSystem("x y", {"-": F(A, lambda mu: [0, mu]), "+": F(A, [g[0], mu + g[1]])},
                                        [bf.Switch(S([0.0, 1.0]))], mu=mu)
            found = {one.contacts["automaton"]: one for one in equilibria(system)}
            assert found["-"].state[1] == pytest.approx(2.0 * mu / 3.0, abs=1e-14) and found["-"].virtual is (mu > 0.0)
            pseudo = found["slide"]
            assert pseudo.kind == "pseudo" and pseudo.state == pytest.approx([slope * mu, 0.0], abs=1e-14)
            assert pseudo.eigenvalues == pytest.approx([rate], abs=1e-13) and pseudo.virtual is (mu > 0.0 if both else mu < 0.0)


def test_two_relays_slide_along_both_surfaces_by_the_equivalent_control():
    a, B = np.array([0.3, -0.2, 0.1]), np.array([[1.0, 0.3], [-0.2, 0.8], [0.5, -0.4]])
    system = bf.PiecewiseSystem("x y z", {"".join(sides): F(np.zeros((3, 3)), a - B @ [(-1.0, 1.0)[side == "+"] for side in sides])
                                          for sides in ("--", "-+", "+-", "++")},
                                [bf.Switch(S([1.0, 0.0, 0.0])), bf.Switch(S([0.0, 1.0, 0.0]))])
    motion = bf.simulate(system, (0.5, 0.7, 0.0), duration=5.0)
    last = motion.events[-1]
    assert motion.success and last.mode_after == ("00",)
    assert (motion.final[2] - last.after[2]) / (5.0 - last.time) == pytest.approx(-0.139534883721, abs=1e-11)
    np.testing.assert_allclose(motion.final[:2], 0.0, atol=1e-15)


def test_a_start_from_which_both_fields_leave_is_escaping():
    def system(sign):
        return bf.PiecewiseSystem("x y", {"-": F(np.zeros((2, 2)), [1.0, -sign]), "+": F(np.zeros((2, 2)), [1.0, sign])},
                                  [bf.Switch(S([0.0, 1.0]))])
    motion = bf.simulate(system(1.0), (0.0, 0.0), duration=2.0)
    assert motion.status == "escaping" and motion.stop == 0.0 and not motion.success
    assert bf.simulate(system(1.0), (0.0, 0.1), duration=2.0).final == pytest.approx([2.0, 2.1])
    slide = bf.simulate(system(-1.0), (0.0, 0.5), duration=2.0)
    assert slide.success and slide.final == pytest.approx([2.0, 0.0], abs=1e-15)


def test_where_sliding_is_not_allowed_a_motion_ends():
    system = bf.PiecewiseSystem("x", {"-": F([[0.0]], [1.0]), "+": F([[0.0]], [-1.0])}, [bf.Switch(S([1.0]), sliding=False)])
    motion = bf.simulate(system, (-1.0,), duration=3.0)
    assert motion.status == "no_target" and motion.stop == pytest.approx(1.0)


# systems that can be written as matrices with elements, too

def test_friction_on_a_belt_is_coulombs_and_its_slides_have_their_names():
    """Grazing-sliding is at the amplitude of the free motion: V = A w/|1 - w^2 + 2 i zeta w|."""
    graze = 1.6 / math.hypot(1.0 - 1.6**2, 0.16)
    orbit = bf.find_orbit(on_a_belt(0.99 * graze))
    own = bf.find_orbit(bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.0), Coulomb(0.3, belt_speed=0.99 * graze)], omega=1.6))
    np.testing.assert_allclose(orbit.state, own.state, atol=1e-12)
    np.testing.assert_allclose(sorted(orbit.multipliers.real), sorted(own.multipliers.real), atol=1e-11)
    branch, other = (bf.trace(one, name, bounds=(0.8, 1.3)) for one, name in ((orbit, "V"), (own, "belt_speed")))
    assert [point.kind for point in branch.special_points] == ["crossing_sliding", "switching_sliding", "grazing_sliding"]
    np.testing.assert_allclose([point.parameter for point in branch.special_points],
                               [point.parameter for point in other.special_points], atol=1e-9)
    assert branch.special_points[-1].parameter == pytest.approx(graze, abs=1e-12) and branch.audit.ok


def test_a_curve_of_grazing_sliding_is_a_line():
    graze = 1.6 / math.hypot(1.0 - 1.6**2, 0.16)
    branch = bf.trace(bf.find_orbit(on_a_belt(0.99 * graze)), "V", bounds=(0.95, 1.1))
    [point] = branch.special_points.of("grazing_sliding")
    curve = bf.trace_curve(point, ("V", "A"), bounds=((0.8, 1.3), (0.5, 2.0)))
    assert len(curve.column("V")) > 5
    np.testing.assert_allclose(curve.column("V"), graze * curve.column("A"), rtol=1e-10)


def test_an_impact_oscillator_is_one_with_a_reset():
    zeta, omega, gap, restitution = 0.05, 0.5, 0.4, 0.7
    system = bf.HybridSystem("x v", {"free": F([[0, 1], [-1, -2 * zeta]], cos={1: lambda A: [0, A]})}, [
        bf.Jump("free", S([1.0, 0.0], -gap), to="free", reset=R([[1.0, 0.0], [0.0, -restitution]]))], omega=omega, A=0.52)
    own = bf.System(1.0, 2 * zeta, 1.0, [HarmonicForce(0.52), RigidStop(gap, restitution)], omega=omega)
    a, b = (bf.simulate(one, (0.0, 0.0), periods=20) for one in (system, own))
    assert len(a.events) == len(b.events) > 10
    np.testing.assert_allclose([event.time for event in a.events], [event.time for event in b.events], atol=1e-11)
    np.testing.assert_allclose(a.final, b.final, atol=1e-10)
    one, two = bf.find_orbit(system), bf.find_orbit(own)
    np.testing.assert_allclose(one.state, two.state, atol=1e-11)
    np.testing.assert_allclose(np.sort(one.multipliers), np.sort(two.multipliers), atol=1e-9)


def test_a_bilinear_oscillator_is_a_field_with_a_kink():
    k, omega = 8.0, 1.1
    system = bf.PiecewiseSystem("x v", {"-": F([[0, 1], [-1, -0.1]], cos={1: lambda A: [0, A]}),
                                        "+": F([[0, 1], [-1 - k, -0.1]], [0, 0.5 * k], cos={1: lambda A: [0, A]})},
                                [bf.Switch(S([1.0, 0.0], -0.5))], omega=omega, A=1.0)
    own = bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.0), ElasticStop(0.5, k)], omega=omega)
    one, two = bf.find_orbit(system), bf.find_orbit(own)
    np.testing.assert_allclose(one.state, two.state, atol=1e-12)
    np.testing.assert_allclose(np.sort_complex(one.multipliers), np.sort_complex(two.multipliers), atol=1e-10)
    branch, other = bf.trace(one, "A", bounds=(0.05, 1.5)), bf.trace(two, "harmonic_force.amplitude", bounds=(0.05, 1.5))
    assert branch.audit.ok
    np.testing.assert_allclose([point.parameter for point in branch.special_points],
                               [point.parameter for point in other.special_points], atol=1e-9)


# the rest of the package

def test_files_sweeps_and_basins(tmp_path):
    system = on_a_belt(0.9)
    orbit = bf.find_orbit(system)
    orbit.save(tmp_path / "orbit.npz")
    again = bf.load(tmp_path / "orbit.npz", elements=[system.builder])
    assert again.system == system and np.array_equal(again.state, orbit.state)
    basins = bf.basins_of_attraction(system, bf.Grid(w0=(-1, 1, 6), w1=(-1, 1, 6)))
    assert basins.counts[0] == 36
    np.testing.assert_allclose(basins.attractors[0].state, orbit.state, atol=1e-9)
    found = bf.bifurcation_diagram(system, "V", [0.9, 1.2], transient=60)
    assert found.points.shape[1] == 2
    axes = orbit.plot()
    assert [axes[0].get_xlabel(), axes[0].get_ylabel(), axes[1].get_ylabel()] == ["x", "v", "x"]


def test_what_is_not_there_for_systems_of_first_order_says_so():
    with pytest.raises(ValueError, match="first order"):
        bf.find_orbit(on_a_belt(0.9), method=bf.HarmonicBalance(3))
    with pytest.raises(ValueError, match="without excitation"):
        equilibria(on_a_belt(0.9))


def test_measures_of_states_and_a_diagram():
    """Between two events a neuron's voltage is 1.5 (1 - exp(-t)): its mean square is known."""
    branch = bf.trace(bf.find_orbit(bf.systems.integrate_and_fire(current=1.5), (0.5,)), "current", bounds=(1.2, 2.0))
    currents = branch.column("current")
    T = np.log(currents / (currents - 1.0))
    square = currents**2 * (T - 2.0 * (1.0 - np.exp(-T)) + 0.5 * (1.0 - np.exp(-2.0 * T))) / T
    np.testing.assert_allclose(branch.column("rms_0"), np.sqrt(square), rtol=1e-11)
    np.testing.assert_allclose(branch.column("max_0"), 1.0, rtol=1e-12)
    assert branch.plot().get_xlabel() == "current"
    assert [event.kind for event in bf.find_orbit(bf.systems.relay_feedback(), (0.1, -1.0, -3.0)).events] == [
        "slide_begin", "slide_end", "slide_begin", "slide_end"]
