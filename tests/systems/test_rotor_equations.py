"""Accelerations of rotors with several contacts against their equations written out."""
import numpy as np

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.flow.linear import ModeField
from tests.elements.test_bearings import pressure


def accelerations(system, touching, q, v):
    """Return the accelerations (n,) at phase 0 with some elements in forward slip."""
    scene = scene_of(system)
    mode = next(scene.start_modes())
    for label in touching:
        mode = scene.combine(mode, system.labels.index(label), "slip+")
    x = np.concatenate([q, v, scene.forcing(np.zeros(1))[0]])
    T = scene.tables
    field = ModeField(scene, T, mode)
    rates = T.A[mode] @ x
    rates[scene.n:2 * scene.n] += field.forces(np.concatenate([q, v])) @ T.LP[mode]
    return rates[scene.n:2 * scene.n]


def test_two_arcs_touched_at_once():
    system = bf.systems.snubber_rotor(zeta=0.1, nu=0.9, eccentricity=0.6, stiffness=20.0, friction=0.05, preload=0.5)
    q, v = np.array([0.85, 0.8]), np.array([0.3, -0.2])
    found = accelerations(system, ("arc_right", "arc_up"), q, v)
    known = [0.6 * 0.9**2, 0.0] - q - 0.2 * v
    for centre in ([-0.5, 0.0], [0.0, -0.5]):
        p = q - centre
        r = np.hypot(*p)
        assert r > 1.5
        known = known - 20.0 * (r - 1.5) * (p + 0.05 * np.array([-p[1], p[0]])) / r
    assert np.abs(found - known).max() < 1e-13


def test_journal_and_disk():
    system = bf.systems.oil_film_rub_rotor(speed_ratio=1.3, unbalance=0.1, load=1.2, journal_mass=2.0, disk_mass=8.0)
    q, v = np.array([0.2, -0.3, 0.4, -0.5]), np.array([0.03, 0.02, -0.05, 0.04])
    found = accelerations(system, ("stator",), q, v)
    k, W, r = 10.0 / 1.3, 1.2 / 1.3, np.hypot(0.4, 0.5)
    n = q[2:] / r
    rub = 20.0 / 1.3 * (r - 0.5) * (n + 0.1 * np.array([-n[1], n[0]]))
    journal = pressure(*q[:2], *v[:2]) - 0.05 * v[:2] - k * (q[:2] - q[2:]) - [0.0, 0.2 * W]
    disk = [8.0 * 1.3 * 0.1, 0.0] - 0.5 * v[2:] - k * (q[2:] - q[:2]) - [0.0, 0.8 * W] - rub
    assert np.abs(found - np.concatenate([journal / 2.6, disk / 10.4])).max() < 1e-11
