"""Random systems with loads that vary, walls that move, sliders, plastic and elastic stops: what settles from rest is found.

Forces are affine here, so that no scene compiles a law.
"""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import ConstantForce, Coulomb, ElasticStop, HarmonicForce, Iwan, Jenkins, MicroSlip, RigidStop
from bifurc.orbits.standing import NoRoom

SETTLED, PERIODS = 1e-9, 400  # part of the motion by which a section returns; forcing periods until then


def drawn(seed):
    """Return a random system of one to four masses with one to four contacts."""
    rng = np.random.default_rng([seed, 919])
    n, u = int(rng.integers(1, 5)), rng.random
    A, B = rng.normal(size=(2, n, n))
    M, K = np.eye(n) + 0.2 * A @ A.T, np.eye(n) + 0.4 * B @ B.T
    C = 10**rng.uniform(-2, -0.5) * K
    parts = [HarmonicForce(float(rng.uniform(0.3, 2.5)), dof=int(rng.integers(n)))]
    if u() < 0.2:
        parts.append(HarmonicForce(float(rng.uniform(0.1, 1.0)), dof=int(rng.integers(n)), harmonic=3,
                                   phase=float(rng.uniform(0, 6))))
    if u() < 0.3:
        parts.append(ConstantForce(float(rng.uniform(-3.0, 3.0)), dof=int(rng.integers(n))))
    for _ in range(int(rng.integers(1, 5))):
        row, first = np.zeros(n), int(rng.integers(n))
        row[first] = 1.0
        if n > 1 and u() < 0.35:
            row[(first + int(rng.integers(1, n))) % n] = float(rng.choice([-1.0, -1.0, 0.5]))
        row, kind = tuple(row.tolist()), u()
        gap = float(rng.choice([0.0, rng.uniform(0.05, 0.8), rng.uniform(-0.3, 0.0)], p=[0.1, 0.75, 0.15]))
        if kind < 0.35:
            wall = (float(rng.uniform(0.02, 0.2)), 1, float(rng.uniform(0, 6))) if u() < 0.2 else (0.0, 0, 0.0)
            restitution = float(rng.choice([0.0, rng.uniform(0.05, 0.9)], p=[0.35, 0.65]))
            parts.append(RigidStop(gap, restitution, side=int(rng.choice([-1, 1])), row=row,
                                   **dict(zip(("amplitude", "harmonic", "phase"), wall, strict=True))))
        elif kind < 0.5:
            parts.append(ElasticStop(gap, float(10**rng.uniform(0.3, 3)), damping=float(rng.choice([0.0, u()])), row=row))
        elif kind < 0.8:
            more = {"load_amplitude": float(rng.uniform(0.1, 1.4)), "load_phase": float(rng.uniform(0, 6))} if u() < 0.3 else {}
            belt = float(rng.uniform(-0.5, 0.5)) if u() < 0.3 else 0.0
            parts.append(Coulomb(float(rng.uniform(0.02, 0.8)), row=row, belt_speed=belt, **more))
        elif kind < 0.93:
            parts.append(Jenkins(float(10**rng.uniform(-0.3, 2)), float(rng.uniform(0.02, 0.8)), row=row))
        else:
            parts.append(Iwan(row=row) if u() < 0.5 else MicroSlip(row=row))
    return bf.System(M, C, K, parts, omega=float(rng.uniform(0.3, 2.8)))


def judged(seeds):
    """Return how many motions settle, and (seed, what is wrong) where no orbit is found, or one that does not repeat."""
    settled, wrong = 0, []
    for seed in seeds:
        system = drawn(seed)
        try:
            orbit = bf.find_orbit(system)
        except NoRoom:  # stops that contradict each other
            continue
        if orbit.success:
            again = bf.simulate(system, orbit.state, periods=orbit.periods)
            allowed = 1e-7 * max([1.0, *np.abs(orbit.multipliers)])
            if not np.abs((again.final - orbit.state) / orbit.weights).max() < allowed:
                wrong.append((seed, "not repeated"))
            settled += 1
            continue
        motion = bf.simulate(system, orbit.state, periods=PERIODS)
        if not motion.success:  # walls that move close the clearance of two stops, or something rattles in it
            assert "contradict each other" in motion.message or "max_events" in motion.message
            continue
        sections = motion.sections
        size = np.abs(sections).max(axis=0) + 1e-300
        if min(np.abs((sections[-1] - sections[-1 - k]) / size).max() for k in range(1, 9)) < SETTLED:
            wrong.append((seed, orbit.status.value))
            settled += 1
    return settled, wrong


def test_settled_motions_of_thirty_systems_are_found():
    settled, wrong = judged(range(30))
    assert wrong == [] and settled > 15


@pytest.mark.slow
def test_settled_motions_of_two_hundred_systems_are_found():
    """All but 2 % (of 189 two are not: 1150 and 1197), and none that is no motion."""
    settled, wrong = judged(range(1000, 1200))
    assert len(wrong) <= 0.02 * settled and settled > 100 and "not repeated" not in [what for _, what in wrong]
