"""Orbits under laws: several rows coupled through speeds, differenced derivatives, constant motions."""
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import ConstantForce, CubicSpring, Force, HarmonicForce, RegularizedFriction


def coupled(u0, u1, s0, s1, a):
    """Forces that mix the rows, each by the other's speed, and not symmetrically."""
    return -a * s1 * (1.0 + u0 * u0) - 0.1 * s0, 0.3 * a * s0 * s0 * s0 - 0.2 * s1 - 0.4 * u0 * u1


def coupled_slope(u0, u1, s0, s1, a):
    """Derivatives of `coupled` by u0, u1, s0, s1: of the first force, then of the second."""
    return (-2.0 * a * s1 * u0, 0.0, -0.1, -a * (1.0 + u0 * u0),
            -0.4 * u1, -0.4 * u0, 0.9 * a * s0 * s0, -0.2)


def difference_map(system, state, periods, step=1e-5):
    columns = []
    for unit in np.eye(len(state)):
        ends = [bf.simulate(system, state + shift * step * unit, periods=periods).final for shift in (-2.0, -1.0, 1.0, 2.0)]
        columns.append((ends[0] - ends[3] + 8.0 * (ends[2] - ends[1])) / (12.0 * step))
    return np.array(columns).T


def test_a_law_of_two_rows_coupled_through_speeds():
    """Its orbit closes; the monodromy is that of differences of the map, with a given Jacobian and with differences."""
    for jacobian in (coupled_slope, None):
        law = Force(coupled, jacobian, site=np.eye(2), a=0.35)
        system = bf.System(np.eye(2), 0.05 * np.eye(2), [[2.0, -0.7], [-0.7, 1.5]], (HarmonicForce(0.5), law), omega=0.9)
        orbit = bf.find_orbit(system)
        assert orbit.success
        there = difference_map(system, orbit.state, 1)
        np.testing.assert_allclose(np.sort_complex(np.linalg.eigvals(there)), np.sort_complex(orbit.multipliers), rtol=0, atol=2e-9)
        np.testing.assert_allclose(orbit.monodromy, there, rtol=0, atol=2e-9)
        if jacobian is None:
            assert orbit.how["error of differenced Jacobians"] < 1e-9


def fast(u, s, width):
    """Friction that turns within a small width."""
    return -0.3 * math.tanh(s / width)


@pytest.mark.slow  # compiles the law
def test_differences_of_a_fast_law_take_small_steps():
    """The multipliers are those of the same law with its derivative, and the error is told."""
    for width in (0.5, 0.01):
        both = []
        for element in (Force(fast, site=0, odd=True, width=width), RegularizedFriction(0.3, width)):
            system = bf.System(1.0, 0.05, 1.0, (HarmonicForce(1.0), element), omega=0.8)
            both.append(bf.find_orbit(system))
        assert all(orbit.success for orbit in both)
        np.testing.assert_allclose(np.sort(np.abs(both[0].multipliers)), np.sort(np.abs(both[1].multipliers)), rtol=1e-6, atol=1e-9)
        apart = np.abs(np.sort(np.abs(both[0].multipliers)) - np.sort(np.abs(both[1].multipliers))).max()
        assert apart <= both[0].how["error of differenced Jacobians"] + 1e-9  # it bounds the truth, that of the coarser step
        assert both[0].how["error of differenced Jacobians"] < 1e-4


def test_constant_motions_under_a_law():
    """Where all forces cancel the steps of the collocation do not collapse: u + u^3 = load along a branch."""
    system = bf.System(1.0, 0.1, 1.0, (ConstantForce(0.5, label="load"), CubicSpring(1.0)), omega=1.0)
    start = float(np.real(np.roots([1.0, 0.0, 1.0, -0.5])[np.argmin(np.abs(np.roots([1.0, 0.0, 1.0, -0.5]).imag))]))
    orbit = bf.find_orbit(system, (start, 0.0))
    assert orbit.success and abs(orbit.state[0] - start) < 1e-14
    branch = bf.trace(orbit, "load.force", bounds=(0.3, 1.0), max_steps=60)
    assert len(branch) > 3
    for at in (branch.orbits[i] for i in range(len(branch))):
        assert at.success and abs(at.state[0] + at.state[0] ** 3 - at.system.parameters["load.force"]) < 1e-11
