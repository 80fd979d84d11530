"""Modal coordinates of many degrees of freedom: the particular solution under loads of any phase."""
import numpy as np
import pytest
import scipy.linalg

import bifurc as bf
from bifurc.compose.modal import GROWTH, give_modal, separated
from bifurc.compose.scene import scene_of
from bifurc.elements import HarmonicForce, RigidStop


@pytest.mark.parametrize("phase", [0.0, 0.8, np.pi / 2])
def test_the_forced_motion_of_a_chain_is_that_of_its_dynamic_stiffness(phase):
    """A stop out of reach makes the scene one of modes; the load is cosine and sine."""
    n, omega = 6, 0.9
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    C = 0.2 * K + np.diag(0.05 * np.arange(n))
    system = bf.System(np.eye(n), C, K, [HarmonicForce(0.7, phase=phase, dof=2), RigidStop(1e3, 0.5)], omega=omega)
    q = np.linalg.solve(K - omega**2 * np.eye(n) + 1j * omega * C, 0.7 * np.exp(1j * phase) * np.eye(n)[2])
    start = np.concatenate([q.real, -omega * q.imag])
    motion = bf.simulate(system, start, periods=2)
    t = np.linspace(0.0, motion.stop, 9)
    np.testing.assert_allclose(motion(t)[:, :n], (np.exp(1j * omega * t)[:, None] * q).real, rtol=0, atol=1e-12)


def chain(n, damping, *elements, omega=0.9, ground=1.0):
    """Unit masses and springs; damping = (of the masses, of the springs)."""
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    K[0, 0] = K[-1, -1] = 1.0 + ground
    return bf.System(np.eye(n), damping[0] * np.eye(n) + damping[1] * K, K, elements, omega=omega)


LOADS = HarmonicForce(0.7, phase=0.3, dof=1), HarmonicForce(0.2, 3, dof=2)
N = 24  # as many degrees of freedom as modal coordinates are made for
FREE = 2.0 * np.sin(np.pi / (2.0 * N))  # the first elastic frequency of a free chain
HELD = 2.0 * np.sin(np.pi / (2.0 * (N + 1)))  # and of one that is held at both ends


@pytest.mark.parametrize("system, pairs, decays, slow", [
    (chain(N, (0.02, 0.05), *LOADS), N + 2, 0, 1),  # modes and two harmonics; the constant
    (chain(N, (0.0, 0.0), *LOADS, omega=HELD), N, 0, 1 + 2 + 2),  # resonance: the mode beside its harmonic
    (chain(N, (0.0, 0.0), *LOADS, omega=HELD / 3.0), N, 0, 1 + 2 + 2),  # of the other harmonic
    (chain(N, (0.02, 0.0), *LOADS, omega=HELD), N + 2, 0, 1),  # damped: none
    (chain(N, (0.0, 0.02), *LOADS, ground=0.0), N - 1 + 2, 0, 1 + 2),  # a free chain: place and speed of its centre
    (chain(N, (0.1, 0.0), *LOADS, ground=0.0), N - 1 + 2, 1, 1 + 1),  # its speed decays
    (chain(N, (0.0, 0.0), *LOADS, ground=0.0, omega=FREE), N - 2 + 1, 0, 1 + 2 + 2 + 2),
    (chain(N, (1.5, 0.0), *LOADS), N - 6 + 2, 12, 1),  # of 6 modes 2 sin(k pi / 50) < .75: two decays each
    (chain(N, (2.0 * HELD, 0.0), *LOADS), N - 1 + 2, 0, 1 + 2)],  # critical damping of the first
    ids=["damped", "resonance", "third harmonic", "damped resonance", "free", "free, dragged", "free, resonance", "overdamped",
         "critical"])
def test_every_mode_is_a_pair_two_decays_or_in_the_slow_block(system, pairs, decays, slow):
    T = scene_of(system).tables
    V, turning, fading, block, rate = separated(T, 0)
    assert (len(turning), len(fading), len(block)) == (pairs, decays, slow)
    blocks = [np.array([[z.real, -z.imag], [z.imag, z.real]]) for z in turning]
    moved = scipy.linalg.block_diag(*blocks, np.diag(fading), block)
    generator = np.zeros_like(moved)
    generator[:T.A.shape[1]] = T.A[0]
    for k, harmonic in enumerate(T.harmonics):
        cosine, speed = T.A.shape[1] + 1 + 2 * k, harmonic * system.omega
        generator[cosine, cosine + 1], generator[cosine + 1, cosine] = -speed, speed
    start = np.concatenate([np.linspace(-1.0, 1.0, 2 * N), [1.0, 1.0, 0.0, 1.0, 0.0]])
    for time in (0.5, 20.0):
        known = scipy.linalg.expm(generator * time) @ start
        np.testing.assert_allclose(V @ scipy.linalg.expm(moved * time) @ np.linalg.solve(V, start), known,
                                   rtol=0, atol=1e-10 * np.abs(known).max())
    resting = np.abs(np.linalg.matrix_power(block, 4)).max() == 0.0
    assert (rate == 0.0) == resting


@pytest.mark.parametrize("growth", [0.004, 0.04, 0.3])
def test_steps_are_no_longer_than_a_growing_motion_allows(growth):
    """Beside motions that fade fast one grows, as that of a machine with negative damping: it is the one that bounds the steps."""
    n = 6
    system = bf.System(np.eye(n), np.diag([-2.0 * growth, 0.3, 0.5, 0.7, 1.0, 1.4]), np.diag(np.arange(1.0, n + 1.0)),
                       [HarmonicForce(0.7), RigidStop(50.0, dof=1)], omega=0.9)
    scene = scene_of(system)
    T = scene.tables
    give_modal(T)
    m = next(m for m in range(len(scene.keys)) if T.n_holds[m] == 0)
    rates = np.linalg.eigvals(T.A[m, :, :scene.ns])
    assert rates.real.max() == pytest.approx(growth, rel=1e-9) and T.blocks[m, 3] > 0
    last = T.blocks[m, 3] - 1
    assert T.level[m, last] * growth <= GROWTH < T.level[m, last + 1] * growth


def test_a_chain_that_grows_moves_by_its_matrix_exponential():
    """Negative damping of its slow modes; numbers that no step needs are not made."""
    system = chain(N, (-0.06, 0.03), *LOADS, RigidStop(1e3, 0.5))
    scene = scene_of(system)
    A = np.vstack([scene.tables.A[0], np.hstack([np.zeros((scene.nw, scene.ns)), scene.frame.W])])
    assert np.linalg.eigvals(A[:scene.ns, :scene.ns]).real.max() > 0.01
    motion = bf.simulate(system, np.linspace(-0.2, 0.3, 2 * N), periods=2)
    x = np.concatenate([np.linspace(-0.2, 0.3, 2 * N), scene.forcing(np.zeros(1))[0]])
    wanted = (scipy.linalg.expm(A * motion.stop) @ x)[:scene.ns]
    np.testing.assert_allclose(motion.final, wanted, rtol=0, atol=1e-11 * np.abs(wanted).max())
