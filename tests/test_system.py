"""Systems: matrices and elements checked, parameters by name, records, equality, symmetry."""
import copy
import json
import pickle
import subprocess
import sys

import numpy as np
import pytest

from bifurc import elements as el
from bifurc import systems
from bifurc.compose import scene_of
from bifurc.elements import HarmonicForce, RigidStop
from bifurc.system import System, builder


def hand_made():
    return System([[2.0, 0.1], [0.1, 1.0]], 0.1 * np.eye(2), [[2.0, -1.0], [-1.0, 1.0]],
                  [HarmonicForce(0.5, dof=1), RigidStop(0.3), RigidStop(0.4, 0.2, dof=1),
                   RigidStop(0.5, label="wall", side=-1)], omega=0.7)


def test_scalars_make_one_degree_of_freedom():
    system = System(2, 0.1, 3)
    assert system.n == 1 and system.mass.shape == system.damping.shape == system.stiffness.shape == (1, 1)
    assert system.omega is None and system.period is None
    assert System(1.0, 0.0, 1.0, omega=2.0).period == np.pi


@pytest.mark.parametrize("arguments, words", [
    ((-1.0, 0.0, 1.0), "mass = .*positive definite"),
    ((0.0, 0.0, 1.0), "mass = .*positive definite"),
    (([[1.0, 2.0], [2.0, 1.0]], np.eye(2), np.eye(2)), "mass = .*positive definite"),
    (([[1.0, 1.0], [1.0, 1.0]], np.eye(2), np.eye(2)), "mass = .*positive definite"),
    (([[1.0, 0.1], [0.0, 1.0]], np.eye(2), np.eye(2)), "mass = .*symmetric"),
    ((np.nan, 0.0, 1.0), "mass = nan .*finite"),
    ((1.0, np.inf, 1.0), "damping = inf .*finite"),
    ((1.0, 0.0, [1.0, 2.0]), r"stiffness has shape \(2,\)"),
    ((np.eye(2), 0.0, np.eye(2)), r"damping has shape \(1, 1\); it must be that of mass, \(2, 2\)"),
    ((np.ones((2, 3)), 0.0, 1.0), r"mass has shape \(2, 3\)"),
    ((np.ones((0, 0)), 0.0, 1.0), "mass has shape"),
    (("heavy", 0.0, 1.0), "mass = 'heavy' .*a number or a square matrix"),
    ((1.0, 0.0, 1.0, [3]), r"elements\[0\] = 3 is not allowed; it must be an instance of Element"),
    ((1.0, 0.0, 1.0, [RigidStop(dof=1)]), "degree of freedom 1 is not allowed; there are 0 to 0"),
    ((1.0, 0.0, 1.0, [RigidStop(row=(1.0, 2.0))]), "it must be 1 finite factors"),
    ((1.0, 0.0, 1.0, [RigidStop(row=(0.0,))]), "not all zero"),
    ((1.0, 0.0, 1.0, [el.BaseMotion(row=(1.0, 2.0))]), "BaseMotion: row = .* it must be 1 factors"),
    ((1.0, 0.0, 1.0, [HarmonicForce()]), "omega = None is not allowed with HarmonicForce"),
    ((1.0, 0.0, 1.0, [RigidStop(amplitude=1.0, harmonic=1)]), "omega = None is not allowed with RigidStop"),
])
def test_bad_arguments_are_named(arguments, words):
    with pytest.raises(ValueError, match=words):
        System(*arguments)


@pytest.mark.parametrize("value", ["1", True, 1j, [["1", "0"], ["0", "1"]], np.eye(2) > 0.0])
def test_what_is_no_number_is_no_mass(value):
    with pytest.raises(ValueError, match="(?s)mass = .* it must be a number or a square matrix of numbers"):
        System(value, 0.0, 1.0)


def test_the_element_that_sits_nowhere_is_named():
    with pytest.raises(ValueError, match="element 'rigid_stop_2': site: degree of freedom 9"):
        System(1.0, 0.0, 1.0, [RigidStop(1.0), RigidStop(1.0, dof=9)])
    with pytest.raises(ValueError, match="element 'tip': site: row"):
        System(1.0, 0.0, 1.0, [RigidStop(1.0, row=(1, 2), label="tip")])


@pytest.mark.parametrize("omega", [0.0, -1.0, np.nan, np.inf, "1"])
def test_bad_frequencies_are_named(omega):
    with pytest.raises(ValueError, match="System: omega = .* above 0"):
        System(1.0, 0.0, 1.0, omega=omega)


def test_arguments_are_copied_and_frozen():
    M = np.eye(2)
    system = System(M, np.zeros((2, 2)), np.eye(2))
    M[0, 0] = 5.0
    assert system.mass[0, 0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        system.mass[0, 0] = 2.0
    with pytest.raises(AttributeError, match="immutable"):
        system.omega = 1.0


def test_names_of_a_hand_made_system():
    system = hand_made()
    assert system.labels == ("harmonic_force", "rigid_stop", "rigid_stop_2", "wall")
    assert set(system.parameters) == {
        *(f"{name}[{i},{j}]" for name in ("mass", "damping", "stiffness") for i in (0, 1) for j in (0, 1)), "omega",
        "harmonic_force.amplitude", "harmonic_force.phase", "rigid_stop.gap", "rigid_stop.restitution",
        "rigid_stop_2.gap", "rigid_stop_2.restitution", "wall.gap", "wall.restitution"}
    assert system.parameter("rigid_stop_2.restitution") == 0.2
    assert system.parameter_name("amplitude") == "harmonic_force.amplitude"
    with pytest.raises(ValueError, match="'gap' is ambiguous; there are rigid_stop.gap, rigid_stop_2.gap, wall.gap"):
        system.parameter("gap")
    with pytest.raises(ValueError, match="'mu' is unknown; there are .*wall.gap"):
        system.with_parameters(mu=1.0)


def test_every_parameter_of_a_hand_made_system_can_be_changed():
    system = hand_made()
    for name, value in system.parameters.items():
        changed = system.with_parameters(**{name: 1.25 * value + 0.01})
        assert changed.parameters[name] == 1.25 * value + 0.01
        assert changed.with_parameters(**{name: value}).to_record() == system.to_record()
        others = {key for key in system.parameters if changed.parameters[key] != system.parameters[key]}
        entry = name.partition("[")
        mirror = {f"{entry[0]}[{entry[2][2]},{entry[2][0]}]"} if entry[1] else set()
        assert others <= {name} | mirror


def test_a_coupling_stays_symmetric_and_gyroscopic_terms_stay_as_they_are():
    system = System(np.eye(2), [[0.1, 0.5], [-0.5, 0.1]], [[2.0, -1.0], [-1.0, 1.0]])
    assert system.with_parameters(**{"stiffness[0,1]": -2.0}).stiffness[1, 0] == -2.0
    assert system.with_parameters(**{"damping[0,1]": 0.6}).damping[1, 0] == -0.5


def test_one_degree_of_freedom_takes_short_names_of_matrices():
    system = System(2.0, 0.1, 3.0)
    assert system.with_parameters(mass=4.0, stiffness=5.0).mass[0, 0] == 4.0
    assert system.parameter("damping") == 0.1


def test_records_round_trip():
    system = hand_made()
    assert System.from_record(json.loads(json.dumps(system.to_record()))) == system
    for name in systems.__all__:
        ready = getattr(systems, name)()
        again = System.from_record(json.loads(json.dumps(ready.to_record())))
        assert again == ready and again.parameters == ready.parameters and repr(again) == repr(ready)


def test_records_of_unknown_classes_and_builders_are_refused():
    record = hand_made().to_record()
    record["elements"][0]["class"] = "Magic"
    with pytest.raises(ValueError, match=r"element 'Magic'; hand its class over in .* Known: BaseMotion"):
        System.from_record(record)
    with pytest.raises(ValueError, match="builder 'os_system'.*Known: belt_oscillator"):
        System.from_record({"builder": "os_system", "parameters": {}})


def test_laws_are_looked_up_by_name_and_never_imported():
    def pull(u, s, k):
        return -k * u

    record = System(1.0, 0.0, 1.0, [el.Force(pull, k=1.0)]).to_record()
    with pytest.raises(ValueError, match=r"law 'pull'; hand it over in elements=\[pull\]"):
        System.from_record(record)
    assert System.from_record(record, elements=[pull]).elements[0].law is pull


def test_a_builder_of_a_user():
    assert systems.builder is builder and "builder" not in systems.__all__
    @builder
    def pendulum(*, length: float = 2.0, gap: float = 0.3, beads: int = 2) -> System:
        return System(length**2, 0.0, length, [RigidStop(gap)] * beads)

    system = pendulum(length=3)
    assert system.parameters == {"length": 3.0, "gap": 0.3, "beads": 2}
    assert repr(system) == "pendulum(length=3, gap=0.3, beads=2)"
    assert system.with_parameters(length=4.0).mass[0, 0] == 16.0
    assert system.parameter("gap") == 0.3
    with pytest.raises(ValueError, match="'beads' = 2 cannot vary continuously; those that can: length, gap"):
        system.parameter("beads")
    with pytest.raises(ValueError, match="pendulum: parameter 'width' is unknown; there are length, gap, beads"):
        pendulum(width=1.0)
    with pytest.raises(ValueError, match="'width' is unknown; there are length, gap, beads"):
        system.with_parameters(width=1.0)
    with pytest.raises(ValueError, match="pendulum: length = nan is not allowed"):
        pendulum(length=np.nan)


def test_equality_is_by_content():
    assert hand_made() == hand_made() and hash(hand_made()) == hash(hand_made())
    assert hand_made() != hand_made().with_parameters(omega=0.71)
    assert hand_made() != 3
    assert systems.impact_oscillator() != systems.impact_oscillator(gap=0.9)
    assert repr(hand_made()) == "System(n=2, omega=0.7, elements=[harmonic_force, rigid_stop, rigid_stop_2, wall])"


def test_systems_that_differ_in_the_frequency_only_are_told_from_all_others():
    """Numbers of a scene are kept for these alone.  The static response to a constant force is that of the changed matrices."""
    system = System([[2.0, 0.1], [0.1, 1.0]], 0.1 * np.eye(2), [[2.0, -1.0], [-1.0, 3.0]],
                    [el.ConstantForce(0.5, dof=1), RigidStop(9.0)], omega=0.7)
    for name in system.parameters:
        other = system.with_parameters(**{name: system.parameter(name) + 0.25})
        assert system.differs_in_omega_only(other) == other.differs_in_omega_only(system) == (name == "omega"), name
        A = scene_of(system).refill(other).A[0]
        stands = np.linalg.solve(other.stiffness, [0.0, other.parameter("constant_force.force")])
        assert np.abs(A[2:, :2] @ stands + A[2:, 4]).max() < 1e-14, name


@pytest.mark.parametrize("elements, symmetry", [
    ([HarmonicForce(0.5)], -1),
    ([HarmonicForce(0.5, harmonic=2)], None),
    ([HarmonicForce(0.5, harmonic=2), HarmonicForce(-0.5, harmonic=2)], -1),
    ([HarmonicForce(0.5, harmonic=3, phase=0.2), RigidStop(1.0), RigidStop(1.0, side=-1)], -1),
    ([HarmonicForce(0.5), RigidStop(1.0, 0.7), RigidStop(1.0, 0.6, side=-1)], None),
    ([HarmonicForce(0.5), RigidStop(1.0), RigidStop(1.1, side=-1)], None),
    ([HarmonicForce(0.5), RigidStop(1.0, label="a"), RigidStop(1.0, side=-1, label="b")], -1),
    ([HarmonicForce(0.5), el.ElasticStop(1.0), el.ElasticStop(1.0, side=-1)], -1),
    ([HarmonicForce(0.5), el.CubicSpring(1.0)], -1),
    ([HarmonicForce(0.5), el.PolynomialSpring(c3=1.0, c5=0.1)], -1),
    ([HarmonicForce(0.5), el.PolynomialSpring(c2=0.1, c3=1.0)], None),
    ([HarmonicForce(0.5), el.ConstantForce(0.1)], None),
    ([HarmonicForce(0.5), el.ConstantForce(0.0)], -1),
    ([el.BaseMotion(0.5), el.BaseMotion(0.5, harmonic=2)], None),
    ([HarmonicForce(0.5), el.Force(lambda u, s: -u * u)], None),
    ([HarmonicForce(0.5), el.Force(lambda u, s: -u * u * u, odd=True)], -1),
    ([RigidStop(1.0, amplitude=0.1, harmonic=1), RigidStop(1.0, side=-1, amplitude=0.1, harmonic=1)], -1),
    ([RigidStop(1.0, amplitude=0.1, harmonic=2), RigidStop(1.0, side=-1, amplitude=0.1, harmonic=2)], None),
    ([RigidStop(1.0, amplitude=0.1, harmonic=2), RigidStop(1.0, side=-1, amplitude=-0.1, harmonic=2)], -1),
])
def test_symmetry_is_found_from_the_elements(elements, symmetry):
    assert System(1.0, 0.1, 1.0, elements, omega=0.7).symmetry == symmetry


def test_copies_and_processes():
    system = systems.impact_chain(n=2)
    scene_of(system)
    assert copy.deepcopy(system) is system and copy.copy(system) is system
    sent = pickle.loads(pickle.dumps(system))
    assert sent == system and sent._scene is None and sent.with_parameters(n=3).n == 3


def test_builders_of_the_package_are_found_in_a_fresh_process():
    record = json.dumps(systems.impact_oscillator(gap=0.3).to_record())
    code = f"import json; from bifurc.system import System; print(System.from_record(json.loads('{record}')))"
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert shown.startswith("impact_oscillator(") and "gap=0.3" in shown


def test_entries_of_matrices_are_parameters_by_their_plain_name():
    """A large system finds one without listing all."""
    system = System(np.eye(12), np.eye(12), 2.0 * np.eye(12), [RigidStop(gap=1.0)])
    assert system.parameter_name("stiffness[11,3]") == "stiffness[11,3]" and system.parameter("mass[11,11]") == 1.0
    assert system.parameter_name("gap") == "rigid_stop.gap"
    assert set(system.parameters) >= {"damping[0,11]", "rigid_stop.gap"} and "omega" not in system.parameters
    for name in ("stiffness[12,0]", "stiffness[01,0]", "omega"):
        with pytest.raises(ValueError, match="unknown"):
            system.parameter(name)


@pytest.mark.parametrize("unit", [1e-20, 1.0, 1e20])
def test_a_mass_is_symmetric_beside_its_largest_entry(unit):
    System(unit * np.array([[1.0, 0.25 + 5e-15], [0.25, 2.0]]), np.eye(2), np.eye(2))
    with pytest.raises(ValueError, match="symmetric"):
        System(unit * np.array([[1.0, 0.25 + 1e-12], [0.25, 2.0]]), np.eye(2), np.eye(2))
    with pytest.raises(ValueError, match="positive definite"):
        System(unit * np.array([[1.0, 2.0], [2.0, 1.0]]), np.eye(2), np.eye(2))


def test_images_of_elements_are_elements_each_of_one(rng):
    """Of stops on both sides, some of them equal: each has a partner of its own, or the system is not symmetric."""
    for _ in range(40):
        gaps = rng.choice([0.2, 0.5], 2)
        stops = [RigidStop(gap, 0.6, side=side) for gap in gaps for side in (1, -1)]
        elements = [(HarmonicForce(1.0), *stops)[i] for i in rng.permutation(5)]
        order = System(1.0, 0.1, 1.0, elements, omega=1.2).mirror_order
        assert sorted(order) == list(range(5))
        assert all(elements[k] == element.mirrored() for element, k in zip(elements, order, strict=True))
    two = [RigidStop(0.2, 0.6), RigidStop(0.2, 0.6), RigidStop(0.2, 0.6, side=-1)]
    assert System(1.0, 0.1, 1.0, two, omega=1.2).mirror_order is None
