"""Random rotors: elastic and rigid stators, also carried by a casing, beside friction, stops and sliders on the same masses.

None may hang, raise, end without a physical reason, or pass a rigid wall.  Gaps, speeds and forces of several contacts vanish
together here, and their rounding is not the same.
"""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import ConstantForce, Coulomb, ElasticStator, HarmonicForce, Jenkins, RigidStator, RigidStop
from bifurc.orbits.standing import resting_start

PERIODS, DEPTH = 10, 1e-11


def drawn(seed):
    """Return a random rotor, by half in a casing with masses of its own."""
    rng = np.random.default_rng([seed, 77])
    u, n, omega = rng.random, int(rng.choice([2, 4])), rng.uniform(0.3, 3.0)
    M, C, K = np.eye(n), rng.uniform(0.02, 0.2) * np.eye(n), np.eye(n)
    if n == 4:
        K += 0.7 * np.array([[1.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, -1.0], [-1.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 1.0]])
        M[2, 2] = M[3, 3] = rng.uniform(0.3, 2.0)
    for matrix, largest in ((K, 0.08), (C, 0.2)):  # cross-coupling, gyroscopic effects
        if u() < 0.3:
            matrix[0, 1] = rng.uniform(-largest, largest)
            matrix[1, 0] = -matrix[0, 1]
    load = rng.uniform(0.05, 1.0) * omega**2
    parts = [HarmonicForce(load, dof=0), HarmonicForce(load, dof=1, phase=-0.5 * np.pi)]
    if u() < 0.5:
        parts.append(ConstantForce(-rng.uniform(0.0, 0.4), dof=1))
    radius = rng.uniform(0.3, 1.0)
    wall = {"radius": radius, "friction": float(rng.choice([0.0, rng.uniform(0.0, 0.6)])),
            "surface_speed": float(rng.choice([0.0, rng.uniform(-1.0, 1.0) * radius * omega])),
            "frame_spin": float(rng.choice([0.0, 0.0, rng.uniform(-1.0, 1.0)]))}
    if n == 4 and u() < 0.5:
        wall |= {"against_x": 2, "against_y": 3}
    if u() < 0.3:
        wall |= {"centre_x": rng.uniform(-0.2, 0.2) * radius, "centre_y": rng.uniform(-0.2, 0.2) * radius}
    if u() < 0.65:
        parts.append(RigidStator(restitution=float(rng.choice([0.0, 1.0, rng.uniform(0.05, 0.9)], p=[0.45, 0.05, 0.5])), **wall))
    else:
        parts.append(ElasticStator(stiffness=10**rng.uniform(0.5, 3), damping=float(rng.choice([0.0, rng.uniform(0.0, 2.0)])),
                                   release=str(rng.choice(["force", "penetration"])), **wall))
    if u() < 0.25:
        parts.append(Coulomb(rng.uniform(0.02, 0.3), dof=int(rng.integers(n))))
    if u() < 0.2 and n == 4:
        parts.append(RigidStop(rng.uniform(0.1, 0.6), float(rng.choice([0.0, 0.5])), dof=2))
    if u() < 0.2:
        parts.append(Jenkins(rng.uniform(1.0, 10.0), rng.uniform(0.05, 0.3), dof=int(rng.integers(n))))
    return bf.System(M, C, K, parts, omega=omega)


def judged(seeds):
    """Return (seed, what is wrong) of motions from rest."""
    wrong = []
    for seed in seeds:
        system = drawn(seed)
        try:
            motion = bf.simulate(system, resting_start(system), periods=PERIODS)
        except Exception as error:  # whatever it raises is wrong
            wrong.append((seed, repr(error)))
            continue
        if not motion.success or not np.isfinite(motion.final).all():
            wrong.append((seed, motion.message))
            continue
        q = motion(np.linspace(0.0, motion.stop, 2001))[:, :system.n]
        for element in system.elements:
            depth = -1.0
            if isinstance(element, RigidStator):
                p = q[:, :2] - (0.0 if element.against_x is None else q[:, 2:]) - [element.centre_x, element.centre_y]
                depth = (np.hypot(*p.T) - element.radius).max()
            elif isinstance(element, RigidStop):
                depth = (q[:, 2] - element.gap).max()
            if depth > DEPTH:
                wrong.append((seed, f"{element!r} is passed by {depth:.1e}"))
    return wrong


@pytest.mark.parametrize("seed", [3, 51, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (53, 55, 56, 82, 223, 261, 350))])
def test_rotors_with_several_contacts_end_at_their_end(seed):
    """Rotors whose wall and whose friction, stop or casing hold at once, or that a plastic impact leaves without any speed."""
    assert judged((seed,)) == []  # each compiles the laws of its own contacts


@pytest.mark.slow
def test_forty_rotors_end_at_their_end():
    """The same, drawn."""
    assert judged(range(1000, 1040)) == []
