"""States of rest: contacts that touch and stick, continua, folds, Hopf points and boundary equilibria against closed forms."""
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc import System
from bifurc import elements as el


@pytest.mark.parametrize("static, kinetic, decay, zeta", [(1.0, 0.5, 0.5, 0.05), (1.3, 0.4, 0.7, 0.02), (0.8, 0.6, 0.3, 0.1)])
def test_hopf_of_the_exponential_law(static, kinetic, decay, zeta):
    hopf = decay * math.log((static - kinetic) / (2.0 * zeta * decay))
    system = bf.systems.belt_oscillator(zeta=zeta, belt_speed=1.7 * hopf, static=static, kinetic=kinetic, law="exponential",
                                        decay_speed=decay)
    branch = bf.trace(bf.find_equilibrium(system), "belt_speed", bounds=(0.3 * hopf, 2.0 * hopf))
    (point,) = branch.special_points
    assert point.kind == "hopf" and point.parameter == pytest.approx(hopf, abs=1e-12)
    assert point.solution.eigenvalues == pytest.approx([1j, -1j], abs=1e-12)
    assert point.solution.lyapunov_coefficient() == pytest.approx(zeta / (8.0 * decay**2), rel=1e-8)
    assert branch.column("stable").astype(bool).tolist() == (branch.column("belt_speed") > hopf).tolist()
    friction = kinetic + (static - kinetic) * np.exp(-branch.column("belt_speed") / decay)
    assert branch.column("q_0") == pytest.approx(friction, abs=1e-13)


@pytest.mark.parametrize("falling, rising, zeta", [(0.4, 0.1, 0.05), (0.6, 0.3, 0.1)])
def test_hopf_of_the_cubic_law_and_the_orbits_born_there(falling, rising, zeta):
    hopf = math.sqrt((falling - 2.0 * zeta) / (3.0 * rising))
    system = bf.systems.belt_oscillator(zeta=zeta, belt_speed=1.2 * hopf, law="cubic", falling=falling, rising=rising)
    (point,) = bf.trace(bf.find_equilibrium(system), "belt_speed", bounds=(0.5 * hopf, 1.5 * hopf)).special_points
    assert point.parameter == pytest.approx(hopf, abs=1e-12)
    assert point.solution.lyapunov_coefficient() == pytest.approx(-3.0 * rising / 8.0, rel=1e-9)
    (orbit,) = bf.switch_branch(point)
    assert orbit.success and orbit.stable
    V = orbit.system.parameter("belt_speed")
    amplitude = 0.5 * (orbit.maximum() - orbit.minimum())
    assert amplitude == pytest.approx(2.0 * math.sqrt(hopf**2 - V**2), rel=1e-3)


def test_fold_of_a_spring_that_snaps():
    # a softening spring under a load F = x - x^3 has its fold at x = 1/sqrt 3
    system = System(1.0, 0.1, 1.0, [el.CubicSpring(-1.0), el.ConstantForce(0.1)])
    branch = bf.trace(bf.find_equilibrium(system), "force", bounds=(-0.3, 0.5))
    folds = branch.special_points.of("fold")
    assert [abs(point.parameter) for point in folds] == pytest.approx([2.0 / (3.0 * math.sqrt(3.0))] * len(folds), abs=1e-13)
    assert folds and folds[0].reverses and branch.column("stable").min() == 0.0


def test_measures_of_a_mass_that_stands_still():
    """Maximum and minimum are where it stands, the root of the mean square is its distance from the origin."""
    branch = bf.trace(bf.find_equilibrium(System(1.0, 0.1, 2.0, [el.ConstantForce(-0.6)])), "force", bounds=(-1.0, 1.0))
    q = branch.column("force") / 2.0
    assert q.min() < 0.0 < q.max()
    for name, wanted in (("q_0", q), ("max_0", q), ("min_0", q), ("rms_0", np.abs(q))):
        np.testing.assert_allclose(branch.column(name), wanted, atol=1e-15)


def test_boundary_equilibria():
    # a load presses a mass against an elastic stop: touches at force = gap
    system = System(1.0, 0.1, 1.0, [el.ElasticStop(0.5, 4.0), el.ConstantForce(0.1)])
    branch = bf.trace(bf.find_equilibrium(system), "force", bounds=(0.0, 2.0))
    (point,) = branch.special_points
    assert point.kind == "boundary_equilibrium" and point.parameter == pytest.approx(0.5, abs=1e-13)
    q, p = branch.column("q_0"), branch.column("parameter")
    assert q == pytest.approx(np.where(p < 0.5, p, (p + 2.0) / 5.0), abs=1e-13)
    # against a rigid stop it comes to rest on it
    system = System(1.0, 0.1, 1.0, [el.RigidStop(0.5), el.ConstantForce(0.1)])
    branch = bf.trace(bf.find_equilibrium(system), "force", bounds=(0.0, 2.0))
    assert branch.special_points[0].parameter == pytest.approx(0.5, abs=1e-13)
    assert branch.column("q_0") == pytest.approx(np.minimum(branch.column("parameter"), 0.5), abs=1e-13)
    # a stuck mass lets go: no state of rest goes on in slip
    system = System(1.0, 0.1, 0.0, [el.Coulomb(0.5), el.ConstantForce(0.1)])
    branch = bf.trace(bf.find_equilibrium(system), "force", bounds=(-1.0, 1.0))
    assert [point.parameter for point in branch.special_points] == pytest.approx([-0.5, 0.5], abs=1e-13)
    assert {end.reason.value for end in branch.ends} == {"no_successor"} and "ends here" in branch.ends[0].message


def test_states_of_rest():
    stuck = bf.find_equilibrium(System(1.0, 0.1, 1.0, [el.Coulomb(0.5)]), guess=(0.2,))
    assert stuck.status == "continuum" and stuck.state.tolist() == [0.2, 0.0]
    assert stuck.intervals[0] == pytest.approx((-0.5, 0.5)) and stuck.contacts == {"coulomb": "stick"}
    edge = bf.find_equilibrium(System(1.0, 0.1, 1.0, [el.Coulomb(0.5)]), guess=(0.7,))
    assert edge.state[0] == pytest.approx(0.5) and edge.on_boundary == ["coulomb"] and edge.stable is None
    pressed = bf.find_equilibrium(System(1.0, 0.1, 1.0, [el.ElasticStop(-0.3, 4.0)]))
    assert pressed.state[0] == pytest.approx(-0.24) and pressed.eigenvalues.imag.max() == pytest.approx(math.sqrt(5.0 - 0.0025))
    leaning = bf.find_equilibrium(System(1.0, 0.1, 1.0, [el.RigidStop(-0.3)]))
    assert leaning.contacts == {"rigid_stop": "rest"} and leaning.stable and leaning.eigenvalues.size == 0
    free = bf.find_equilibrium(System(1.0, 0.1, 0.0))
    assert free.status == "continuum" and free.eigenvalues == pytest.approx([-0.1])
    none = bf.find_equilibrium(System(1.0, 0.1, 0.0, [el.ConstantForce(1.0)]))
    assert none.status == "not_found" and not none.success and "No state of rest" in none.message
    centre = bf.find_equilibrium(System(1.0, 0.0, 1.0))
    assert centre.success and centre.stable is None
    well = bf.find_equilibrium(System(1.0, 0.1, -1.0, [el.CubicSpring(1.0)]), guess=(0.7, 0.0))
    assert well.state[0] == pytest.approx(1.0) and well.stable
    hill = bf.find_equilibrium(System(1.0, 0.1, -1.0, [el.CubicSpring(1.0)]))
    assert hill.state[0] == 0.0 and hill.stable is False


def test_bad_questions():
    with pytest.raises(ValueError, match="has an excitation"):
        bf.find_equilibrium(bf.systems.impact_oscillator())
    with pytest.raises(ValueError, match="shape"):
        bf.find_equilibrium(System(1.0, 0.1, 1.0), guess=(1.0, 2.0, 3.0))
    with pytest.raises(ValueError, match="finite"):
        bf.find_equilibrium(System(1.0, 0.1, 1.0), guess=(math.nan,))
    with pytest.raises(ValueError, match="no Hopf point"):
        bf.find_equilibrium(System(1.0, 0.1, 1.0)).lyapunov_coefficient()
    none = bf.find_equilibrium(System(1.0, 0.1, 0.0, [el.ConstantForce(1.0)]))
    with pytest.raises(ValueError, match="cannot be continued"):
        bf.trace(none, "force", bounds=(0.0, 1.0))


@pytest.mark.parametrize("place", [0.25, -0.4])
def test_a_mass_that_sticks_stays_where_it_is(place):
    """Over a load on its neighbour, which moves as its spring lets it: k (q - place) = force; until the force of the spring between
    them is that of slip."""
    k, mu = 2.0, 0.9
    K = [[1.0 + k, -k], [-k, k]]
    system = System(np.eye(2), 0.1 * np.eye(2), K, [el.Coulomb(mu), el.ConstantForce(0.1, dof=1)])
    start = bf.find_equilibrium(system, (place, place + 0.05))
    assert start.success and start.state[0] == pytest.approx(place, abs=1e-15)
    branch = bf.trace(start, "force", bounds=(-3.0, 3.0))
    force, first, second = (branch.column(name) for name in ("parameter", "q_0", "q_1"))
    stuck = np.abs(force - place) <= mu
    assert stuck.sum() > 3
    assert first[stuck] == pytest.approx(place, abs=1e-13) and second[stuck] == pytest.approx(place + force[stuck] / k, abs=1e-12)


@bf.systems.builder
def damped(*, damping=0.0):
    """Return a mass with a dashpot of either sign."""
    return System(1.0, damping, 1.0)


def test_the_column_of_stability_is_that_of_the_states_of_rest():
    """Without damping nothing is decided, on the boundary of a contact neither."""
    swing = bf.trace(bf.find_equilibrium(damped()), "damping", bounds=(-0.1, 0.1))
    told = [orbit.stable for orbit in swing.orbits]
    assert set(told) == {True, False, None} and list(swing.column("stable")) == told
    values = [orbit.eigenvalues[0] for orbit in swing.orbits]
    np.testing.assert_allclose(swing.column("eigenvalue_0"), values, atol=1e-14)
