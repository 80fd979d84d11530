"""Basins of rotors that rub: tori in concentric stators, sustained contact in rigid ones; counts of a Runge-Kutta computation."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.basins.attractors.attractors import on_curve

SPREAD = 3  # cells on the boundary, which its steps and ours may give to either side


def grid(cells: int, *, x: tuple[float, float], v: tuple[float, float]) -> bf.Grid:
    """Return the grid whose cells have their centres where ``cells`` equally spaced points from end to end lie."""
    half = [0.5 * (high - low) / (cells - 1) for low, high in (x, v)]
    return bf.Grid(q0=(x[0] - half[0], x[1] + half[0], cells), v1=(v[0] - half[1], v[1] + half[1], cells))


@pytest.mark.slow
@pytest.mark.parametrize(("nu", "free", "partial", "whirl"), [(1.5, 284, 554, 123), (2.1, 437, 24.5, 499.5)])
def test_basins_of_a_concentric_rotor(nu, free, partial, whirl):
    system = bf.systems.jeffcott_rotor(nu=nu, zeta=0.05, eccentricity=0.2, stiffness=25.0, friction=0.1, offset=0.0)
    basins = bf.basins_of_attraction(system, grid(31, x=(-0.9, 0.9), v=(-3.0, 3.0)), max_periods=500)
    counts = {"free": 0, "partial": 0, "whirl": 0}
    for label, item in enumerate(basins.attractors):
        if isinstance(item, bf.PeriodicOrbit):
            assert not item.events and item.periods == 1
            counts["free"] += basins.counts[label]
        else:  # dry whirl rolls far out: friction drives the disk at the surface speed
            assert isinstance(item, bf.basins.QuasiperiodicAttractor)
            r = np.hypot(item.points[:, 0], item.points[:, 1])
            counts["whirl" if r.min() > 3.0 else "partial"] += basins.counts[label]
    assert basins.counts[-1] == 0
    assert abs(counts["free"] - free) <= SPREAD and abs(counts["partial"] - partial) <= SPREAD
    assert abs(counts["whirl"] - whirl) <= SPREAD


def test_points_on_a_curve_are_told_from_others():
    rng = np.random.default_rng(0)
    turns = np.arange(4000) * 2.399963
    circle = np.column_stack([np.cos(turns), np.sin(turns), 0.3 * np.cos(2.0 * turns), np.sin(turns)])
    assert on_curve(circle)
    slow = np.arange(4000) * (2.0 * np.pi / 5.0 + 1e-5)  # nearly locked: five short arcs
    assert on_curve(np.column_stack([np.cos(slow), np.sin(slow)]))
    assert not on_curve(rng.random((4000, 4))) and not on_curve(np.column_stack([circle[:, :2], rng.random((4000, 2))]))
    assert not on_curve(np.zeros((4000, 4)))


def test_a_torus_behind_a_neimark_sacker_point_is_an_attractor(tmp_path):
    # a driven van der Pol oscillator off resonance: its own oscillation and the load do not lock
    damping = bf.elements.Force(van_der_pol, label="self", a=0.3)
    system = bf.System(1.0, 0.0, 1.0, [bf.elements.HarmonicForce(0.2), damping], omega=2.3)
    starts = bf.Grid(q0=(-1.0, 1.0, 3), v0=(-1.0, 1.0, 3))
    found = bf.basins_of_attraction(system, starts, max_periods=600, file=tmp_path / "map.npz")
    (torus,) = found.attractors
    assert isinstance(torus, bf.basins.QuasiperiodicAttractor) and found.counts == {0: 9, -1: 0}
    assert abs(torus.exponent) < 0.01 and bf.plotting.describe(torus) == "quasi-periodic"
    (again,) = bf.load(tmp_path / "map.npz", elements=[van_der_pol]).attractors
    assert type(again) is type(torus) and np.array_equal(again.points, torus.points)


def van_der_pol(u, s, a):
    """Damping that feeds small oscillations and takes from large ones."""
    return a * (1.0 - u * u) * s
