"""Elements carried into other coordinates, contacts without mass, what simulation costs: by their formulas, refusals by name."""
import logging

import numpy as np
import pytest
from scipy.linalg import eigh

import bifurc as bf
from bifurc import elements as el
from bifurc.models.assembling import assembled
from bifurc.models.cost import SLOW, StiffModelWarning, fastest, period_cost, warn_if_slow
from bifurc.models.reducing import carried, seated
from bifurc.structure.checks import checked
from tests.reference.beam import cantilever

K = np.array([[5.0, -1.0, -0.5, 0.2], [-1.0, 4.0, -1.5, 0.3], [-0.5, -1.5, 3.0, -0.7], [0.2, 0.3, -0.7, 2.0]])
M = np.diag([2.0, 1.5, 1.0, 0.8])
C = np.array([[0.3, -0.1, 0.0, 0.05], [-0.1, 0.2, 0.02, 0.0], [0.0, 0.01, 0.1, 0.0], [0.0, 0.0, 0.03, 0.4]])
NAMES = ("a.x", "a.y", "b.x", "b.y")


def system(*parts, omega=1.3, stiffness=K):
    return bf.System(M, C, stiffness, parts, omega=omega, dofs=NAMES)


# ---- what a period costs -------------------------------------------------------------------------------------------------------


def test_the_cost_counts_products_of_matrix_and_state():
    whole = system(el.HarmonicForce(1.0))
    top = np.sqrt(np.linalg.eigvals(np.linalg.solve(M, K)).real.max())
    assert fastest(whole) == pytest.approx(top, rel=1e-14)
    assert period_cost(whole) == pytest.approx(16.0 * 8.0**2 * top * 2.0 * np.pi / 1.3, rel=1e-14)
    assert period_cost(whole.with_parameters(omega=1e3)) == 16.0 * 8.0**2  # at least one step
    assert period_cost(system(omega=None)) == 0.0
    assert period_cost(bf.System(np.eye(2), np.eye(2), np.eye(2), [el.HarmonicForce()], omega=1.0)) == 0.0
    assert period_cost(bf.System(np.eye(3), np.eye(3), np.eye(3), [el.HarmonicForce()], omega=1.0)) > 0.0
    circulatory = np.array([[0.0, 2.0, 0.0], [-2.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # eigenvalues +-2i and 1
    assert fastest(bf.System(np.eye(3), np.eye(3), circulatory)) == pytest.approx(np.sqrt(2.0))


@pytest.mark.parametrize("share", [0.99, 1.01])
def test_the_warning_begins_at_the_cost_of_a_second(share):
    """n = 3: 16 x 36 x (frequency x period) products."""
    frequency = share * SLOW / (16.0 * 36.0) / (2.0 * np.pi)
    slow = bf.System(np.eye(3), np.eye(3), np.diag([1.0, 2.0, frequency**2]), [el.HarmonicForce()], omega=1.0)
    if share < 1.0:
        warn_if_slow(slow)  # warnings are errors here
    else:
        with pytest.warns(StiffModelWarning) as said:
            warn_if_slow(slow, stacklevel=2)
        assert said[0].filename == __file__ and str(said[0].message).startswith(
            "3 degrees of freedom with motions up to 5.58e+04 rad/time against omega = 1: every period takes 3.5e+05 steps")


# ---- coordinates without mass --------------------------------------------------------------------------------------------------


def test_condensed_coordinates_follow_statically():
    """K of the heavy ones is the Schur complement, a load there acts as itself, a row over both through the shape."""
    light, heavy = [1], [0, 2, 3]
    mass = np.diag([2.0, 0.0, 1.0, 0.8])
    damping = np.diag([0.3, 0.0, 0.1, 0.4])
    parts = [el.HarmonicForce(0.5, dof="b.x"), el.RigidStop(0.3, dof="b.y"), el.LinearSpring(1.0, row=(1.0, 0.0, 0.0, -1.0))]
    made = bf.System.from_matrices(mass, damping, K, elements=parts, omega=1.1, dofs=NAMES)
    schur = K[np.ix_(heavy, heavy)] - np.outer(K[heavy, 1], K[1, heavy]) / K[1, 1]
    assert made.stiffness == pytest.approx(schur, rel=1e-14) and np.array_equal(made.mass, mass[np.ix_(heavy, heavy)])
    assert np.array_equal(made.damping, damping[np.ix_(heavy, heavy)]) and made.dofs == ("a.x", "b.x", "b.y")
    assert made.omega == 1.1 and np.array_equal(made.stiffness, made.stiffness.T)
    assert [part.dof for part in made.elements[:2]] == [1, 2] and made.elements[2].row == (1.0, 0.0, -1.0)
    T = made.reduction.recovery
    assert np.array_equal(T[heavy], np.eye(3)) and T[light[0]] == pytest.approx(-K[1, heavy] / K[1, 1])
    assert (made.reduction.method, made.reduction.keep, made.reduction.dofs) == ("condensed", (0, 2, 3), NAMES)
    assert made.reduction.static_error == 0.0 and made.reduction.residual.shape == (0, 0)


def test_circulatory_stiffness_is_condensed_as_it_is():
    skew = K.copy()
    skew[0, 2] += 0.4
    skew[2, 0] -= 0.4
    mass = np.diag([2.0, 0.0, 1.0, 0.8])
    made = bf.System.from_matrices(mass, None, skew, symmetric=False)
    heavy = [0, 2, 3]
    assert made.stiffness == pytest.approx(skew[np.ix_(heavy, heavy)] - np.outer(skew[heavy, 1], skew[1, heavy]) / skew[1, 1])
    assert made.dofs is None and abs(made.stiffness[0, 1] - made.stiffness[1, 0]) > 0.7


@pytest.mark.parametrize("change, words", [
    ({"M": np.zeros((4, 4))}, "M is zero; a motion needs mass"),
    ({"C": np.array([[0.0, 0, 0, 0], [0, 0, 0, 0.1], [0, 0, 0, 0], [0, 0, 0, 0]])}, "coordinate a.y has damping but no mass"),
    ({"C": np.array([[0.0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0], [0, 0.1, 0, 0]])}, "coordinate a.y has damping but no mass"),
    ({"K": np.diag([1.0, 0.0, 1.0, 1.0])}, r"coordinates without mass \(a.y\) have no stiffness against each other"),
    ({"elements": [el.LinearSpring(row=(1.0, -1.0, 0.0, 0.0))]}, "acts on a.y, which has no mass")])
def test_what_cannot_be_condensed(change, words):
    given = {"M": np.diag([2.0, 0.0, 1.0, 0.8]), "C": None, "K": K, "dofs": NAMES, "symmetric": False} | change
    with pytest.raises(ValueError, match=words):
        bf.System.from_matrices(**given)
    with pytest.raises(ValueError, match=words.replace("a.y", "1")):
        bf.System.from_matrices(**{**given, "dofs": None})


@pytest.mark.parametrize("change, words", [
    ({"C": np.diag([0.0, 0.0, 0.2, 0.0])}, "from_matrices: coordinate b.x has damping but no mass; give it a small mass, or take "
                                           "its damping out"),
    ({"K": np.diag([1.0, 1.0, 0.0, 1.0])}, "from_matrices: the coordinates without mass (a.y, b.x) have no stiffness against each "
                                           "other; take them out of the matrices"),
    ({"elements": [el.LinearSpring(2.0, row=(1.0, 0.0, 2.0, 0.0))]},
     "from_matrices: LinearSpring(label=None, dof=0, row=(1.0, 0.0, 2.0, 0.0), stiffness=2.0, damping=0.0) acts on b.x, which "
     "has no mass; give it the mass that moves with the contact")])
def test_the_one_of_two_coordinates_without_mass_is_named(change, words):
    given = {"M": np.diag([2.0, 0.0, 0.0, 0.8]), "C": None, "K": K, "dofs": NAMES, "symmetric": False} | change
    with pytest.raises(ValueError) as refused:
        bf.System.from_matrices(**given)
    assert str(refused.value) == words


def test_gyroscopic_matrices_join_the_damping(caplog):
    G = np.zeros((4, 4))
    G[0, 1], G[1, 0] = 0.7, -0.7
    with caplog.at_level(logging.INFO, "bifurc.models"):
        made = bf.System.from_matrices(M, None, K, G=G, elements=[el.HarmonicForce(2.0, dof=3)], omega=0.9)
    assert np.array_equal(made.damping, G) and made.omega == 0.9 and made.elements[0].dof == 3 and made.reduction is None
    assert "from_matrices: 4 degrees of freedom, no rigid-body mode: it is held" in caplog.text
    light = bf.System.from_matrices(np.diag([1.0, 1.0, 0.0, 1.0]), np.diag([0.1, 0.2, 0.0, 0.0]), K, G=G, symmetric=False)
    assert light.damping.tolist() == [[0.1, 0.7, 0.0], [-0.7, 0.2, 0.0], [0.0, 0.0, 0.0]]
    assert assembled(checked(M, None, K)).omega is None


# ---- elements through shapes ---------------------------------------------------------------------------------------------------

T = np.array([[1.0, 0.0, 0.0], [0.3, -0.4, 0.7], [0.0, 1.0, 0.0], [-0.2, 0.5, 1.1]])


def twist(u0, u1, s0, s1, k):
    return -k * u0, -k * u1


def test_a_carried_element_has_the_same_power():
    """Rows of the site are R T: the force on reduced coordinates is T^T times that on the full ones."""
    row = carried(el.HarmonicForce(0.5, phase=0.2, dof=3), T, M, C)
    assert row.row == tuple(T[3]) and (row.dof, row.amplitude, row.phase) == (0, 0.5, 0.2)
    assert carried(el.RigidStop(0.4, dof=2, side=-1), T, M, C) == el.RigidStop(0.4, dof=1, side=-1)
    between = carried(el.LinearSpring(2.0, row=(0.0, 1.0, 0.0, -2.0)), T, M, C)
    assert between.row == pytest.approx(T[1] - 2.0 * T[3])
    one = carried(el.Force(lambda u, s, k: -k * u**3, site=1, k=2.0), T, M, C)
    assert one.where == pytest.approx(tuple(T[1])) and one.parameters == {"k": 2.0}
    two = carried(el.Force(twist, site=[[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]], k=2.0), T, M, C)
    assert np.array(two.where) == pytest.approx(T[[0, 3]])


def test_a_moving_frame_is_carried_by_the_coordinates_that_give_it():
    shapes = np.column_stack([np.ones(4), [0.0, 1.0, 2.0, -1.0]])
    assert carried(el.BaseMotion(0.3), shapes, M, C).row == pytest.approx((1.0, 0.0), abs=1e-14)
    tilted = el.BaseMotion(0.3, row=(1.0, 3.0, 5.0, -1.0), damper="ground")
    made = carried(tilted, shapes, M, C)
    assert made.row == pytest.approx((1.0, 2.0), rel=1e-13) and (made.damper, made.amplitude) == ("ground", 0.3)
    for off, fits in ((3e-9, True), (3e-8, False)):  # a billionth of the largest, and a component of what the shapes lack
        row = (1.0 + off, 3.0, 5.0, -1.0)
        if fits:
            assert carried(el.BaseMotion(0.3, row=row), shapes, M, C).row == pytest.approx((1.0, 2.0), rel=1e-7)
        else:
            with pytest.raises(ValueError, match="moves all coordinates in a way that the reduced ones cannot"):
                carried(el.BaseMotion(0.3, row=row), shapes, M, C)


def test_what_has_a_site_of_its_own_cannot_be_carried():
    with pytest.raises(ValueError, match="has a site of its own, which cannot be carried into reduced coordinates"):
        carried(el.ElasticStator(), T, M, C)


@pytest.mark.parametrize("off, whole", [(0.9e-13, True), (1.2e-13, False)])
def test_a_row_is_a_coordinate_but_for_rounding(off, whole):
    placed = seated(el.RigidStop(), np.array([off, 1.0, 0.0]))
    assert (placed.dof, placed.row) == ((1, None) if whole else (0, (off, 1.0, 0.0)))


def test_reduced_systems_name_their_coordinates_and_carry_the_damping():
    whole = system(el.HarmonicForce(0.5, dof=0), el.RigidStop(0.2, dof="b.x"))
    for keep in (["b.x", 0], ("b.x", "a.x"), [2, 0]):
        small = whole.reduced(keep=keep, modes=1, method="craig-bampton")
        assert small.dofs == ("b.x", "a.x", "mode.1") and [part.dof for part in small.elements] == [1, 0]
        shapes = small.reduction.recovery
        assert small.damping == pytest.approx(shapes.T @ C @ shapes, rel=1e-13) and small.omega == 1.3
        assert small.reduction.keep == (2, 0) and small.reduction.dofs == NAMES
    plain = bf.System(M, C, K, [el.HarmonicForce()], omega=1.0)
    assert plain.reduced(2, modes=2).dofs == ("q2", "mode.1", "mode.2")
    assert whole.reduced("a.y", modes=1).dofs == ("a.y", "mode.1")


@pytest.mark.parametrize("keep, modes, words", [
    (["b.x", 2], 1, "names a coordinate twice"), (0, 1.5, "modes = 1.5"), (0, -1, "modes = -1"), ("c.x", 1, "there is no degree"),
    (4, 1, "reduced: keep = 4 is not allowed")])
def test_requests_that_cannot_be_met(keep, modes, words):
    with pytest.raises(ValueError, match=words):
        system().reduced(keep, modes)


def test_only_symmetric_stiffness_is_reduced():
    for off, taken in ((4e-9, True), (6e-9, False)):  # a billionth of the largest entry, 5
        skew = K.copy()
        skew[0, 1] += off
        if taken:
            assert system(stiffness=skew).reduced(0, 1).n == 2
        else:
            with pytest.raises(ValueError, match="the stiffness is not symmetric; move its circulatory part into a Force"):
                system(stiffness=skew).reduced(0, 1)


# ---- contacts without mass -----------------------------------------------------------------------------------------------------


def massless(*parts, keep=3, modes=2):
    return system(*parts).reduced(keep, modes, "massless")


def test_without_mass_a_contact_acts_through_the_left_flexibility():
    """phi of the free modes; the rest of the flexibility in series with the contact."""
    squares, free = eigh(K, M)
    soft = (free[3, 2:]**2 / squares[2:]).sum()
    small = massless(el.HarmonicForce(0.5, dof=0), el.ElasticStop(0.2, 7.0, dof=3, side=-1, amplitude=0.1, harmonic=2, phase=0.4),
                     el.BaseMotion(0.0, row=(0.0,) * 4))
    assert small.n == 2 and np.array_equal(small.mass, np.eye(2)) and small.dofs == ("mode.1", "mode.2")
    assert small.stiffness == pytest.approx(np.diag(squares[:2]), abs=1e-12)
    shapes = small.reduction.recovery
    assert np.abs(shapes) == pytest.approx(np.abs(free[:, :2]), abs=1e-12)
    assert small.damping == pytest.approx(shapes.T @ C @ shapes, abs=1e-14)
    stop = small.elements[1]
    assert stop.stiffness == pytest.approx(7.0 / (1.0 + 7.0 * soft)) and stop.row == pytest.approx(tuple(shapes[3]))
    assert (stop.gap, stop.side, stop.amplitude, stop.harmonic, stop.phase, stop.damping) == (0.2, -1, 0.1, 2, 0.4, 0.0)
    assert small.elements[0].row == pytest.approx(tuple(shapes[0])) and small.elements[2].row == pytest.approx((0.0, 0.0))
    hard = massless(el.RigidStop(0.2, 0.3, dof=3, side=-1, label="wall")).elements[0]
    assert type(hard) is el.ElasticStop and hard.stiffness == pytest.approx(1.0 / soft)
    assert (hard.gap, hard.side, hard.label) == (0.2, -1, "wall")
    dry = massless(el.Coulomb(0.4, dof=3, load_amplitude=0.5, load_harmonic=2, load_phase=0.3, label="dry")).elements[0]
    assert type(dry) is el.Jenkins and (dry.limit, dry.label) == (0.4, "dry") and dry.stiffness == pytest.approx(1.0 / soft)
    assert (dry.load_amplitude, dry.load_harmonic, dry.load_phase) == (0.5, 2, 0.3)


def test_two_walls_of_a_clearance_never_act_together():
    small = massless(el.RigidStop(0.1, dof=3), el.RigidStop(0.2, dof=3, side=-1))
    assert [type(part) for part in small.elements] == [el.ElasticStop, el.ElasticStop]


STOP, FORCE = el.RigidStop(0.2, dof=3), el.HarmonicForce(1.0, dof=3)


@pytest.mark.parametrize("parts, keep, words", [
    ((FORCE, STOP), 3, "loads the same coordinate as a contact"), ((STOP, FORCE), 3, "loads the same coordinate as a contact"),
    ((STOP, el.HarmonicForce(1.0, row=(0.0, 0.0, 1.0, 1.0))), [2, 3], "loads the same coordinate as a contact"),
    ((STOP, el.Coulomb(0.1, dof=3)), 3, "share residual flexibility"), ((el.Coulomb(0.1, dof=3), STOP), 3, "share residual"),
    ((STOP, el.RigidStop(0.3, dof=3)), 3, "share residual"), ((STOP, el.RigidStop(-0.2, dof=3, side=-1)), 3, "share residual"),
    ((STOP, el.RigidStop(0.2, dof=3, side=-1, amplitude=0.41, harmonic=1)), 3, "share residual flexibility"),
    ((STOP, el.RigidStop(0.2, dof=2)), [2, 3], "share residual flexibility"),
    ((el.Jenkins(1.0, 1.0, dof=3),), 3, "knows what RigidStop, ElasticStop and Coulomb are without mass"),
    ((el.RigidStop(0.2, row=(0.0, 0.0, -1.0, 1.0)),), 3, "takes contacts on one kept coordinate each"),
    ((el.RigidStop(0.2, row=(0.0, 0.0, 0.0, 2.0)),), 3, "takes contacts on one kept coordinate each"),
    ((el.RigidStop(0.2, row=(0.0, 0.0, 1.0, 1.0)),), [2, 3], "takes contacts on one kept coordinate each"),
    ((el.Coulomb(0.4, dof=3, belt_speed=0.1),), 3, "one friction force and no belt"),
    ((el.Coulomb(0.4, dof=3, static_ratio=1.1),), 3, "one friction force and no belt"),
    ((el.Coulomb(0.4, 0.4, dof=3),), 3, "one friction force and no belt"),
    ((el.ElasticStop(0.4, 2.0, 0.1, dof=3),), 3, "elastic stops without damping that part at zero penetration"),
    ((el.ElasticStop(0.4, 2.0, release="force", dof=3),), 3, "elastic stops without damping that part at zero penetration")])
def test_contacts_without_mass_that_are_refused(parts, keep, words):
    with pytest.raises(ValueError, match=words):
        massless(*parts, keep=keep)


def test_contacts_without_common_flexibility_are_taken_together():
    """Two beams side by side."""
    m, k, _ = cantilever(3)
    none = np.zeros_like(k)
    M2, C2, K2 = (np.block([[a, none], [none, b]]) for a, b in ((m, m), (none, none), (k, 1.3 * k)))
    pair = bf.System(M2, C2, K2,
                     [el.RigidStop(0.1, dof=4), el.Coulomb(0.2, dof=10), el.HarmonicForce(1.0, dof=0),
                      el.Jenkins(1.0, 0.1, dof=2)], omega=1.0)
    small = pair.reduced([4, 10], 4, "massless")
    assert [type(part) for part in small.elements] == [el.ElasticStop, el.Jenkins, el.HarmonicForce, el.Jenkins]
    assert small.elements[0].stiffness == pytest.approx(1.0 / small.reduction.residual[0, 0])
    assert small.elements[1].stiffness == pytest.approx(1.0 / small.reduction.residual[1, 1])
