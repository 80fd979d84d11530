"""A plastic impact takes the whole speed of its row: with any mass matrix, not but for rounding."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.continuation import StopReason
from bifurc.elements import ConstantForce, HarmonicForce, RigidStop
from bifurc.orbits.shooting.signature import slope_of_jump, start_orders


def coupled(seed, n=2, gap=0.1):
    """Masses coupled by inertia, of which the first one hits a plastic stop."""
    rng = np.random.default_rng(seed)
    A = 0.3 * rng.normal(size=(n, n))
    M = 1.2 * np.eye(n) + A @ A.T
    K = np.diag(np.full(n, 2.0)) - np.diag(np.ones(n - 1), 1) - np.diag(np.ones(n - 1), -1)
    return bf.System(M, 0.1 * K, K, [HarmonicForce(1.0), RigidStop(gap, 0.0)], omega=0.9)


@pytest.mark.parametrize("n", (1, 2, 3, 4))
def test_nothing_is_left_of_the_speed(n):
    """The guard behind the impact is zero with its rate: what leads away is the acceleration, as with one mass."""
    for seed in range(30):
        scene = scene_of(coupled(seed, n))
        T = scene.tables
        (hit,) = (g for g in range(int(T.n_guards[0])) if T.kick[0, g])
        P = slope_of_jump(scene, T, 0, hit)
        np.testing.assert_array_equal(P[n], 0.0)
        assert start_orders(scene, T, 0, hit, 0, 0)[hit] == -2


def test_a_branch_of_plastic_impacts_is_valid():
    """A stop at the origin, where the place of the impact has no rounding of its own: no branch ends at its start."""
    for seed in range(4):
        system = coupled(seed, gap=0.0)
        system = bf.System(system.mass, system.damping, system.stiffness, [*system.elements, ConstantForce(-0.2)], omega=0.9)
        orbit = bf.find_orbit(system)
        assert orbit.success and any(event.kind.value == "impact" for event in orbit.events)
        branch = bf.trace(orbit, "omega", bounds=(0.8, 1.0))
        assert StopReason.INADMISSIBLE not in branch.stop_reason and len(branch) > 4, branch.ends
