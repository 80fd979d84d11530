"""Scenes that meet their modes one by one: the numbers of modes depend on the order, and go with orbits, files and branches."""
import numpy as np
import pytest

import bifurc as bf
from bifurc import elements as el
from bifurc.compose.scene import scene_of


def chain(friction):
    """Four masses in a row, each with dry friction: 81 modes, more than are built at once."""
    n = 4
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    contacts = [el.Coulomb(friction * (1.0 + 0.3 * i), dof=i) for i in range(n)]
    return bf.System(np.eye(n), 0.05 * K + 0.02 * np.eye(n), K, [el.HarmonicForce(1.0, dof=0), *contacts], omega=0.9)


@pytest.fixture(scope="module")
def orbit():
    system = chain(0.02)
    assert not scene_of(system).complete
    return bf.find_orbit(system)


@pytest.fixture(scope="module")
def branch(orbit):
    return bf.trace(orbit, "omega", bounds=(0.88, 0.92), ds=0.2, audit="fast")


def test_systems_with_other_numbers_keep_the_numbers_of_modes(orbit):
    scene = scene_of(orbit.system)
    other = scene_of(orbit.system.with_parameters(omega=0.95))
    fresh = scene_of(bf.System.from_record(orbit.system.to_record()).with_parameters(omega=0.95))
    assert other.keys == scene.keys != fresh.keys
    for m in (0, len(other.keys) // 2, len(other.keys) - 1):
        k = fresh.index(other.keys[m])
        assert np.array_equal(other.tables.A[m], fresh.tables.A[k])
        g = int(fresh.tables.n_guards[k])
        assert np.array_equal(other.tables.G[m, :g], fresh.tables.G[k, :g])


def test_orbits_of_a_branch_are_motions(branch):
    assert [str(reason) for reason in branch.stop_reason] == ["bound", "bound"]
    for k in (0, len(branch.orbits) - 1):
        orbit = branch.orbits[k]
        assert orbit.success
        motion = bf.simulate(orbit.system, y0=orbit.state, periods=1)
        assert np.abs(motion.final - orbit.state).max() < 1e-12


def test_files_keep_the_modes(orbit, branch, tmp_path):
    orbit.save(tmp_path / "orbit.npz")
    again = bf.load(tmp_path / "orbit.npz")
    assert again.success and np.abs(again.multipliers - orbit.multipliers).max() < 1e-12
    branch.save(tmp_path / "branch.npz")
    loaded = bf.load(tmp_path / "branch.npz")
    assert loaded.orbits[2].success and np.array_equal(loaded.x(2), branch.x(2))


def test_modes_that_are_met_where_the_sequence_changes():
    """Masses begin to stick one after the other; from either end the same points, each row repeated by simulation."""
    system, found = chain(0.12), []
    for omega in (0.9, 1.25):
        branch = bf.trace(bf.find_orbit(system.with_parameters(omega=omega)), "omega", bounds=(0.6, 1.3))
        assert [str(reason) for reason in branch.stop_reason] == ["bound", "bound"] and branch.audit.ok
        found.append([(str(point.kind), point.parameter) for point in branch.special_points])
    assert [kind for kind, _ in found[0]] == [kind for kind, _ in found[1]] and len(found[0]) == 8
    assert np.abs(np.subtract([p for _, p in found[0]], [p for _, p in found[1]])).max() < 1e-11
