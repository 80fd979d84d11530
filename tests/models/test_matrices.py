"""Systems from matrices with named coordinates, and reduced ones with their contacts."""
import numpy as np
import pytest
from scipy.linalg import eigh

import bifurc as bf
from bifurc import elements
from bifurc.models.cost import SLOW, period_cost, warn_if_slow
from bifurc.models.reducing import seated
from tests.reference.beam import cantilever


@pytest.fixture(scope="module")
def stopped():
    """Return the beam with load and stop at its tip."""
    M, K, names = cantilever()
    return bf.System.from_matrices(M, bf.modal_damping(M, K, 0.02), K, dofs=names, omega=3.0, elements=[
        elements.HarmonicForce(0.5, dof="tip.uy"), elements.RigidStop(0.3, 0.7, dof="tip.uy")])


def test_elements_sit_on_names(stopped):
    assert [element.dof for element in stopped.elements] == [38, 38]
    assert stopped.dof("tip.rz") == 39 and stopped.dofs[:2] == ("1.uy", "1.rz")
    with pytest.raises(ValueError, match="'tip.ux'; there are tip.uy, tip.rz"):
        stopped.dof("tip.ux")
    with pytest.raises(ValueError, match="no names; give them with dofs"):
        bf.System(1.0, 0.0, 1.0, [elements.RigidStop(dof="tip.uy")])
    moved = stopped.with_parameters(**{"rigid_stop.gap": 0.4})
    assert moved.dofs == stopped.dofs
    assert bf.System.from_record(stopped.to_record()) == stopped
    force = bf.System(np.eye(2), np.eye(2), np.eye(2), [elements.Force(lambda u, s: -u**3, site="b.x")], dofs=["a.x", "b.x"])
    assert force.elements[0].where == 1


def test_a_reduced_beam_is_fast_and_keeps_its_names(stopped):
    small = stopped.reduced(keep=["tip.uy"], modes=8)
    assert small.elements == (elements.HarmonicForce(0.5, dof=0), elements.RigidStop(0.3, 0.7, dof=0))
    motion = bf.simulate(small, np.zeros(2 * small.n), periods=2)
    assert motion.success and any(str(event.kind) == "impact" for event in motion.events)
    # counts of work: a step reaches at least a radian of the fastest motion, and costs 16 products of state matrix and state
    top, bottom = (np.sqrt(eigh(item.stiffness, item.mass, eigvals_only=True).max()) for item in (stopped, small))
    period = 2.0 * np.pi / 3.0
    assert period_cost(small) == pytest.approx(16.0 * 18**2 * bottom * period, rel=1e-6)
    assert period_cost(stopped) / period_cost(small) == pytest.approx((40 / 9)**2 * top / bottom, rel=1e-6)
    assert period_cost(small) < 0.1 * SLOW < SLOW < period_cost(stopped)
    assert motion.t.size - 2 * len(motion.events) <= 2.0 * bottom * period
    loaded = bf.System.from_record(small.to_record())
    assert np.array_equal(loaded.reduction.recovery, small.reduction.recovery)
    assert small.with_parameters(omega=4.0).reduction is small.reduction


def test_slow_simulations_say_what_to_do(stopped):
    with pytest.warns(bf.StiffModelWarning, match=r"system.reduced\(keep=\[...\], modes=12\)"):
        warn_if_slow(stopped)
    warn_if_slow(stopped.reduced("tip.uy", 12))  # warnings are errors here


def test_elements_elsewhere_act_through_the_shapes(stopped):
    M, K, names = cantilever()
    full = bf.System.from_matrices(M, bf.modal_damping(M, K, 0.05), K, dofs=names, omega=2.0, elements=[
        elements.HarmonicForce(0.1, dof="10.uy"), elements.ConstantForce(0.2, dof="5.uy")])
    small = full.reduced(keep=["tip.uy"], modes=6)
    # the receptance of the full beam is a second computation of its steady motion
    drive = np.zeros(40)
    drive[full.dof("10.uy")] = 0.1
    amplitude = np.linalg.solve(full.stiffness - 4.0 * full.mass + 2.0j * full.damping, drive)
    orbit = bf.find_orbit(small, guess=np.zeros(2 * small.n))
    assert abs(orbit.harmonic(1, 0)) == pytest.approx(abs(amplitude[38]), rel=1e-5)
    t, y = orbit.sample(9)
    weight = np.zeros(40)
    weight[full.dof("5.uy")] = 0.2
    still = np.linalg.solve(full.stiffness, weight)
    everywhere = small.recover(y)
    assert everywhere[:, :40:2] == pytest.approx((still + np.real(np.exp(2.0j * t)[:, None] * amplitude))[:, ::2], abs=3e-5)


def test_a_moving_frame_goes_over(stopped):
    chain = bf.systems.impact_chain(n=5).stiffness
    full = bf.System.from_matrices(np.eye(5), 0.1 * chain, chain, omega=0.5, elements=[elements.BaseMotion(0.1)])
    small = full.reduced(keep=[4], modes=4)
    assert bf.find_orbit(small).rms(0) == pytest.approx(bf.find_orbit(full).rms(4), rel=1e-9)
    with pytest.raises(ValueError, match="moves all coordinates"):
        full.reduced(keep=[4], modes=1, method="craig-bampton")


def test_contacts_without_mass_act_through_the_residual_flexibility():
    M, K, names = cantilever(6)
    C = bf.modal_damping(M, K, 0.02)
    parts = [elements.HarmonicForce(0.5, dof="3.uy"), elements.ElasticStop(0.05, 40.0, dof="tip.uy")]
    full = bf.System.from_matrices(M, C, K, dofs=names, omega=3.0, elements=parts)
    small = full.reduced(keep=["tip.uy"], modes=5, method="massless")
    soft = small.reduction.residual[0, 0]
    assert small.elements[1].stiffness == pytest.approx(40.0 / (1.0 + 40.0 * soft))
    same = full.reduced(keep=["tip.uy"], modes=10, method="rubin")
    small, same = bf.find_orbit(small), bf.find_orbit(same)
    tip = same.system.reduction.recovery[names.index((3, "uy"))]
    phi = small.system.reduction.recovery[names.index((3, "uy"))]
    assert small.success and same.success
    t, y = small.sample(65)
    _, z = same.sample(65)
    assert y[:, :5] @ phi == pytest.approx(z[:, :11] @ tip, abs=2e-4 * np.ptp(z[:, :11] @ tip) + 1e-4)
    rigid = full.with_parameters(omega=3.0)
    rigid = bf.System(full.mass, full.damping, full.stiffness, [parts[0], elements.RigidStop(0.05, dof="tip.uy")], omega=3.0,
                      dofs=full.dofs).reduced("tip.uy", 5, "massless")
    assert type(rigid.elements[1]) is elements.ElasticStop and rigid.elements[1].stiffness == pytest.approx(1.0 / soft)
    stuck = bf.System(full.mass, full.damping, full.stiffness, [elements.Coulomb(0.2, dof="tip.uy")], omega=3.0,
                      dofs=full.dofs).reduced("tip.uy", 5, "massless")
    assert stuck.elements[0].limit == 0.2 and stuck.elements[0].stiffness == pytest.approx(1.0 / soft)
    with pytest.raises(ValueError, match="residual flexibility it would move"):
        bf.System(full.mass, full.damping, full.stiffness, [elements.HarmonicForce(1.0, dof=10), elements.RigidStop(1.0, dof=10)],
                  omega=3.0).reduced(10, 5, "massless")
    with pytest.raises(ValueError, match="share residual flexibility"):
        bf.System(full.mass, full.damping, full.stiffness, [elements.RigidStop(1.0, dof=8), elements.RigidStop(1.0, dof=10)],
                  omega=3.0).reduced([8, 10], 5, "massless")


def test_coordinates_without_mass_are_condensed_or_refused():
    K = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    M = np.diag([1.0, 0.0, 1.0])
    system = bf.System.from_matrices(M, None, K, dofs=["a.x", "b.x", "c.x"], elements=[elements.RigidStop(dof="c.x")])
    assert system.n == 2 and system.dofs == ("a.x", "c.x") and system.elements[0].dof == 1
    assert system.stiffness == pytest.approx(np.array([[1.5, -0.5], [-0.5, 0.5]]))
    assert system.recover(np.array([1.0, 3.0, 0.0, 1.0])) == pytest.approx([1.0, 2.0, 3.0, 0.0, 0.5, 1.0])
    with pytest.raises(ValueError, match="b.x has damping but no mass"):
        bf.System.from_matrices(M, np.eye(3), K, dofs=["a.x", "b.x", "c.x"])
    with pytest.raises(ValueError, match="acts on b.x, which has no mass"):
        bf.System.from_matrices(M, None, K, dofs=["a.x", "b.x", "c.x"], elements=[elements.RigidStop(dof="b.x")])


@pytest.mark.parametrize(("row", "dof", "kept"), [((0.0, 1.0, 0.0), 1, None), ((0.0, 1.0, 0.5), 0, (0.0, 1.0, 0.5)),
                                                  ((-1.0, 0.0, 0.0), 0, (-1.0, 0.0, 0.0)), ((0.0, 0.0, 2.0), 0, (0.0, 0.0, 2.0))])
def test_an_element_sits_at_a_coordinate_only_where_its_row_is_one(row, dof, kept):
    placed = seated(elements.RigidStop(0.3, 0.7), np.array(row))
    assert (placed.dof, placed.row) == (dof, kept)
