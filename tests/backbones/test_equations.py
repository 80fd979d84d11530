"""Equations of nonlinear modes in other units, two masses, without symmetry; steps of a backbone; what is read of a mode."""

import numpy as np
import pytest
from scipy.special import ellipk

import bifurc as bf
from bifurc.backbones.backbone import Backbone
from bifurc.backbones.equations import balanced, returning, swings, with_negative_damping
from bifurc.backbones.modes import ModeStatus, first_harmonic, linear_mode, unloaded
from bifurc.elements import ConstantForce, CubicSpring, ElasticStop, HarmonicForce, Jenkins, LinearSpring

M, K = np.array([[2.0, 0.2], [0.2, 0.5]]), np.array([[5.0, -1.0], [-1.0, 2.0]])


def pair(*elements, damping=0.0):
    return bf.System(M, damping * K + 0.03 * damping * M, K, elements)


def linear_values():
    values, shapes = np.linalg.eig(np.linalg.solve(M, K))
    order = np.argsort(values)
    return np.sqrt(values[order]), shapes[:, order]


@pytest.mark.parametrize("method", [None, bf.HarmonicBalance(harmonics=3)])
@pytest.mark.parametrize("number", [0, 1])
def test_a_linear_mode_is_itself_at_any_amplitude(method, number):
    """Frequency, shape, and a negative damping phi^T C phi / phi^T M phi, in units that are not one."""
    omegas, shapes = linear_values()
    found = bf.extended_mode(pair(damping=0.02), -3.0, dof=1, mode=number, method=method)
    shape = shapes[:, number] / shapes[1, number] * -3.0
    assert found.success and found.status is ModeStatus.CONVERGED and found.dof == 1 and found.amplitude == -3.0
    assert found.omega == pytest.approx(omegas[number], rel=1e-8)
    np.testing.assert_allclose(found.state[:2], shape, rtol=1e-7)
    np.testing.assert_allclose(found.state[2:], 0.0, atol=1e-7)
    xi = 0.02 * omegas[number] ** 2 + 0.0006
    assert found.xi == pytest.approx(xi, rel=1e-7) and found.damping == pytest.approx(xi / (2.0 * omegas[number]), rel=1e-7)
    assert found.period == pytest.approx(2.0 * np.pi / omegas[number]) and found.first_harmonic == pytest.approx(3.0, rel=1e-7)
    assert found.method == ("shooting" if method is None else "harmonic balance") and found.message == found.status.sentence
    motion = found.motion()
    np.testing.assert_allclose(motion.final, found.state, atol=1e-6)
    assert motion.t[-1] == pytest.approx(found.period)


def test_a_balanced_mode_begins_with_the_speeds_of_its_start_in_any_unit_of_time():
    """A state a tenth of a radian before the farthest point, with a stop on the way; without one it is the linear mode."""
    omega, shapes = linear_values()
    for stop in (0.0, 2.0):
        seen = []
        for unit in (1.0, 1e-5, 1e5):
            system = bf.System(M, np.zeros((2, 2)), K / unit**2, [ElasticStop(0.25, stop / unit**2)] if stop else [])
            shape, w = 0.3 * shapes[:, 0] / shapes[0, 0], omega[0] / unit
            start = np.concatenate([np.cos(0.1) * shape, np.sin(0.1) * w * shape])
            state, found, xi, _, success, _ = balanced(system, bf.HarmonicBalance(harmonics=3), 0, 0.3, start, 1.001 * w, 0.0)
            assert success and abs(xi) < 1e-8 * w and np.abs(state[2:]).max() < 1e-8 * w
            seen.append([found * unit, *state[:2]])
            assert stop or seen[-1] == pytest.approx([omega[0], *shape], abs=1e-8)
        assert seen[1] == pytest.approx(seen[0], abs=1e-8) and seen[2] == pytest.approx(seen[0], abs=1e-8)


def test_an_unsymmetric_mode_by_both_methods():
    """A stop on one side and a constant load: mean and even harmonics; many harmonics come near the exact motion."""
    system = pair(ElasticStop(0.4, 3.0, dof=0), ConstantForce(0.2, dof=1), damping=0.01)
    exact = bf.extended_mode(system, 1.2, dof=0)
    balanced = bf.extended_mode(system, 1.2, dof=0, method=bf.HarmonicBalance(harmonics=24))
    assert exact.success and balanced.success
    assert balanced.omega == pytest.approx(exact.omega, rel=1e-5) and balanced.xi == pytest.approx(exact.xi, rel=2e-3)
    np.testing.assert_allclose(balanced.state, exact.state, atol=3e-4)
    assert balanced.first_harmonic == pytest.approx(exact.first_harmonic, rel=1e-4)
    assert exact.state[0] == 1.2 and abs(exact.state[2]) < 1e-12
    moving = with_negative_damping(exact.system, exact.xi)
    assert swings(moving, exact.state, exact.omega, 0) and not swings(pair(), np.array([1.0, 0.0, 0.0, 0.0]), 1e4, 0)


@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_a_mode_swings_in_any_unit_of_length(unit):
    omegas, shapes = linear_values()
    state = np.concatenate((unit * shapes[:, 0] / shapes[0, 0], np.zeros(2)))
    plain = bf.System(M, np.zeros((2, 2)), K)
    assert swings(plain, state, omegas[0], 0)
    assert not swings(plain, state, 1e4 * omegas[0], 0)  # over a period that is none it hardly moves


def test_the_first_harmonic_is_that_of_the_motion():
    system = pair(CubicSpring(0.8, dof=0))
    found = bf.extended_mode(system, 1.0)
    motion = found.motion()
    N = 4096
    t = found.period * np.arange(N) / N
    x = motion(t)[:, 1]
    want = abs(2.0 * np.mean(x * np.exp(-1j * found.omega * t)))
    assert first_harmonic(found.system, found.state, found.omega, found.xi, 1) == pytest.approx(want, rel=1e-9)


def test_linear_modes_and_what_has_none():
    omegas, shapes = linear_values()
    for k in (0, 1):
        omega, shape = linear_mode(pair(), k)
        assert omega == pytest.approx(omegas[k]) and abs(np.dot(shape, shapes[:, k])) == pytest.approx(np.linalg.norm(shape))
    stuck = bf.System(1.0, 0.0, 1.0, [Jenkins(3.0, 0.5)])
    assert linear_mode(stuck, 0)[0] == pytest.approx(2.0)  # contacts as at rest
    free = bf.System(np.eye(2), np.zeros((2, 2)), [[1.0, -1.0], [-1.0, 1.0]])
    with pytest.raises(ValueError, match="linear mode 0 .* has no frequency"):
        linear_mode(free, 0)
    assert linear_mode(free, 1)[0] == pytest.approx(np.sqrt(2.0))
    still = bf.System(np.eye(2), np.zeros((2, 2)), np.diag([1.0, 4.0]))
    with pytest.raises(ValueError, match="dof = 1 rests in linear mode 0"):
        bf.extended_mode(still, 1.0, dof=1)


def test_loads_are_left_out_and_those_inside_contacts_refused():
    system = bf.System(1.0, 0.0, 1.0, [HarmonicForce(1.0), ConstantForce(0.3), LinearSpring(2.0)], omega=3.0)
    left = unloaded(system)
    assert left.omega is None and [type(item) for item in left.elements] == [ConstantForce, LinearSpring]
    moving = bf.System(1.0, 0.0, 1.0, [bf.elements.RigidStop(1.0, 0.5, amplitude=0.1, harmonic=1)], omega=1.0)
    with pytest.raises(ValueError, match="varies in time by itself"):
        unloaded(moving)


def test_the_time_of_return_tells_the_frequency():
    system = bf.System(4.0, 0.0, 9.0)
    assert returning(system, np.array([2.0, 0.0]), 0, 1.4) == pytest.approx(1.5, rel=0.1)
    assert returning(system, np.array([-2.0, 0.0]), 0, 1.4) == pytest.approx(1.5, rel=0.1)
    assert returning(bf.System(1.0, 0.0, 1e-9), np.array([2.0, 0.0]), 0, 1.4) == 1.4  # it does not come back


def test_the_time_of_return_is_a_whole_period_from_a_trough_too():
    """Around an equilibrium aside the first turn may be a trough: half a period later the motion turns, but not there."""
    system = bf.System(1.0, 0.0, 4.0, [ConstantForce(4.0)])  # swings about 1
    for start in (0.4, 1.7, -2.0):
        assert returning(system, np.array([start, 0.0]), 0, 1.0) == pytest.approx(2.0, rel=0.05)


@pytest.mark.parametrize("amplitude", [1e-3, *(pytest.param(size, marks=pytest.mark.slow) for size in (0.01, 0.05, 0.1))])
def test_a_chain_below_its_stop_has_the_mode_of_the_linear_chain(amplitude):
    """Damping proportional to stiffness: xi = beta omega^2, at every amplitude, also where the speed at the start is rounding."""
    chain = bf.systems.impact_chain(n=8, damping=0.1, stiffness=1.0)
    found = bf.extended_mode(chain, amplitude)
    omega = 2.0 * np.sin(np.pi / 34.0)
    assert found.success
    assert found.omega == pytest.approx(omega, rel=1e-12)
    assert found.xi == pytest.approx(0.1 * omega**2, rel=1e-10)


def test_a_mass_on_a_belt_has_the_mode_that_sticks_for_a_part_of_the_period():
    """Slip without net damping lies on a circle about the kinetic force; stick leaves it at the static one, radius 1/2."""
    belt = bf.systems.belt_oscillator(zeta=0.05, belt_speed=0.3, static=1.0, kinetic=0.6)
    found = bf.extended_mode(belt, 0.1)
    assert found.success
    assert found.xi == pytest.approx(0.1, abs=1e-12)
    assert found.period == pytest.approx(np.pi + 2.0 * np.arctan(0.75) + 0.8 / 0.3, rel=1e-12)
    within = bf.extended_mode(belt, 0.5)  # slower than the belt all along
    assert within.success and within.omega == pytest.approx(1.0, rel=1e-12)


def test_a_backbone_is_read_as_columns_and_ends_where_there_is_no_mode():
    """x'' + x - x^3 = 0 swings up to the hilltop at 1: omega by an elliptic integral; beyond it no motion comes back."""
    soft = bf.System(1.0, 0.02, 1.0, [CubicSpring(-1.0)])
    amplitudes = np.array([0.2, 0.6, 0.9])
    found = bf.backbone(soft, [*amplitudes, 1.2, 1.3])
    modulus = amplitudes**2 / (2.0 - amplitudes**2)
    exact = np.pi * np.sqrt(1.0 - 0.5 * amplitudes**2) / (2.0 * ellipk(modulus))
    assert found.amplitude.tolist() == amplitudes.tolist() and found.omega == pytest.approx(exact, rel=1e-10)
    assert found.damping == pytest.approx(0.01 / exact, rel=1e-9)
    assert found.first_harmonic == pytest.approx([item.first_harmonic for item in found.modes])
    assert found.message.startswith("at the amplitude 1.2: Newton did not converge")
    assert repr(found).startswith("Backbone(3 modes, amplitude 0.2 to 0.9, omega ")
    assert repr(Backbone((), "why")) == "Backbone(no mode: why)"


@pytest.mark.parametrize("amplitudes", [[], [0.0], [1.0, np.nan], [[1.0, 2.0]], [-1.0, 2.0], [np.inf]])
def test_rows_of_amplitudes_that_are_none(amplitudes):
    with pytest.raises(ValueError, match="amplitudes = .* is not allowed; it must be finite numbers"):
        bf.backbone(pair(), amplitudes)
