"""Random masses with sliders, dry friction and rigid stops: what a slider remembers never leaps, whatever happens at once."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import ConstantForce, Coulomb, HarmonicForce, Iwan, Jenkins, RigidStop
from bifurc.orbits.standing import NoRoom, resting_start

BESIDE = 1e-9  # time on both sides of an event


def drawn(seed):
    """Return a random system of one to three masses with one or two sliders, and one to three frictions and stops."""
    rng = np.random.default_rng([seed, 4711])
    n, u = int(rng.integers(1, 4)), rng.random
    A, B = rng.normal(size=(2, n, n))
    M, K = np.eye(n) + 0.2 * (A @ A.T if u() < 0.5 else 0.0), np.eye(n) + 0.4 * B @ B.T
    if u() < 0.3:
        K = np.diag(np.diag(K))

    def row(joined):
        weights, first = np.zeros(n), int(rng.integers(n))
        weights[first] = 1.0
        if n > 1 and u() < joined:
            weights[(first + 1) % n] = -1.0
        return tuple(weights.tolist())
    C = 10**rng.uniform(-2, -0.5) * K
    parts = [HarmonicForce(float(rng.uniform(0.3, 2.5)), dof=int(rng.integers(n)))]
    if u() < 0.3:
        parts.append(ConstantForce(float(rng.uniform(-1.0, 1.0)), dof=int(rng.integers(n))))
    for _ in range(int(rng.integers(1, 3))):
        where = row(0.3)
        parts.append(Jenkins(float(10**rng.uniform(-0.3, 2)), float(rng.uniform(0.02, 0.8)), row=where) if u() < 0.7
                     else Iwan(row=where))
    for _ in range(int(rng.integers(1, 4))):
        where = row(0.5)
        if u() < 0.7:
            more = {"load_amplitude": float(rng.uniform(0.1, 0.6))} if u() < 0.4 else {}
            parts.append(Coulomb(float(rng.uniform(0.05, 0.8)), row=where, **more))
        else:
            parts.append(RigidStop(float(rng.uniform(-0.2, 0.5)), float(rng.choice([0.0, rng.uniform(0.1, 0.9)])), row=where,
                                   side=int(rng.choice([-1, 1]))))
    return bf.System(M, C, K, parts, omega=float(rng.uniform(0.4, 2.5)))


@pytest.mark.parametrize("seed", range(90, 140))
def test_the_memory_of_sliders_is_continuous(seed):
    """A slider moves with its mass while it slips and stands while it sticks: at no event does its place change."""
    system = drawn(seed)
    try:
        start = resting_start(system)
    except NoRoom:
        return
    motion = bf.simulate(system, start, periods=40)
    assert motion.success
    times = np.array([event.time for event in motion.events] + [event.end for event in motion.events if event.end])
    if not times.size:
        return
    before, after = motion(np.maximum(times - BESIDE, motion.start)), motion(np.minimum(times + BESIDE, motion.stop))
    memory = slice(2 * len(system.mass), None)
    assert np.abs(after[:, memory] - before[:, memory]).max() <= 1e-6 * max(1.0, np.abs(before).max())
