"""Scenes that meet their modes one by one: the numbers of modes depend on the order, and go with orbits, files and branches."""
import numpy as np
import pytest

import bifurc as bf
from bifurc import elements as el
from bifurc.compose.scene import scene_of


@pytest.fixture(scope="module")
def orbit():
    """Four masses in a row, each with dry friction: 81 modes, more than are built at once."""
    n = 4
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    contacts = [el.Coulomb(0.02 * (1.0 + 0.3 * i), dof=i) for i in range(n)]
    system = bf.System(np.eye(n), 0.05 * K + 0.02 * np.eye(n), K, [el.HarmonicForce(1.0, dof=0), *contacts], omega=0.9)
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
