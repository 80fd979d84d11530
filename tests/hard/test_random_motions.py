"""Random motions: one to four masses, full mass matrices, up to four contacts of any kind, several on one mass and between masses.

None may hang, raise, or end without a physical reason.
"""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import Coulomb, ElasticStop, HarmonicForce, RigidStop


def drawn(seed):
    """Return a random system and the number of forcing periods."""
    rng = np.random.default_rng([seed, 808])
    n = int(rng.integers(1, 5))
    A, B = rng.normal(size=(2, n, n))
    M, K = np.eye(n) + 0.2 * A @ A.T, np.eye(n) + 0.4 * B @ B.T
    parts = [HarmonicForce(float(rng.uniform(0.3, 2.5)), dof=int(rng.integers(n)))]
    for _ in range(int(rng.integers(0, 5))):
        row = np.zeros(n)
        first = int(rng.integers(n))
        row[first] = 1.0
        if n > 1 and rng.random() < 0.35:
            row[(first + int(rng.integers(1, n))) % n] = -1.0
        row, side = tuple(row.tolist()), int(rng.choice([-1, 1]))
        gap, kind = float(rng.uniform(0.05, 0.8)), rng.random()
        if kind < 0.4:
            parts.append(RigidStop(gap, float(rng.choice([0.0, rng.uniform(0.05, 0.9)])), side=side, row=row))
        elif kind < 0.65:
            parts.append(ElasticStop(gap, float(rng.uniform(2.0, 100.0)), side=side, row=row))
        else:
            belt = float(rng.uniform(0.0, 0.5)) if rng.random() < 0.3 else 0.0
            more = float(rng.choice([1.0, 1.3]))
            parts.append(Coulomb(float(rng.uniform(0.02, 0.8)), row=row, belt_speed=belt, static_ratio=more))
    return bf.System(M, 0.05 * K, K, parts, omega=float(rng.uniform(0.4, 2.5)))


def judged(seeds):
    """Return (seed, what is wrong) of motions over twelve periods from rest."""
    wrong = []
    for seed in seeds:
        system = drawn(seed)
        try:
            motion = bf.simulate(system, np.zeros(2 * system.n), periods=12)
        except Exception as error:  # whatever it raises is wrong
            wrong.append((seed, repr(error)))
            continue
        if not motion.success or not np.isfinite(motion.final).all():
            wrong.append((seed, motion.message))
    return wrong


def test_sixty_motions_end_at_their_end():
    """Seeds that no other test has."""
    assert judged(range(60)) == []


@pytest.mark.slow
def test_five_hundred_motions_end_at_their_end():
    """The same, more of them."""
    assert judged(range(1000, 1500)) == []


def test_contacts_that_take_turns_without_end_come_to_rest():
    """Two of the five hundred: an impact lets another contact slip or part, which comes back at once; again and again."""
    assert judged((1176, 1358)) == []


def test_in_the_end_no_stop_is_passed():
    """Positions at samples over the motion keep the gaps of rigid stops, to rounding."""
    for seed in range(20):
        system = drawn(seed)
        motion = bf.simulate(system, np.zeros(2 * system.n), periods=12)
        _, y = motion.sample(400)
        for element in system.elements:
            if isinstance(element, RigidStop):
                assert (element.side * (y[:, :system.n] @ np.array(element.row)) <= element.gap + 1e-9).all(), seed
