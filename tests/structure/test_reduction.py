"""Reduced models against the full ones, and against the beam's own formulas."""
import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq

import bifurc as bf
from bifurc.structure.reduction import METHODS, reduce
from tests.reference.beam import cantilever


@pytest.fixture(scope="module")
def beam():
    return cantilever()


def test_rubin_keeps_three_frequencies_and_the_statics_of_the_tip(beam):
    M, K, names = beam
    system = bf.System.from_matrices(M, 0.0 * K, K, dofs=names)
    small = system.reduced(keep=["tip.uy"], modes=8)
    assert small.n == 9 and small.dofs[0] == "tip.uy"
    own = np.sqrt(eigh(small.stiffness, small.mass, eigvals_only=True))
    full = np.sqrt(eigh(K, M, eigvals_only=True))
    assert np.abs(own[:3] / full[:3] - 1.0).max() < 1e-6
    # 1 + cos x cosh x = 0; these elements are off by (x h)^4 / 1440, 1.65e-5 for the third
    exact = [brentq(lambda x: np.cos(x) + 1.0 / np.cosh(x), *around)**2 for around in ((1.5, 2.5), (4.0, 5.5), (7.0, 8.5))]
    assert own[:3] == pytest.approx(exact, rel=1.7e-5)
    load = np.eye(small.n)[0]
    assert np.linalg.solve(small.stiffness, load)[0] == pytest.approx(1.0 / 3.0, rel=1e-10)  # L^3 / 3 EI
    assert small.reduction.static_error < 1e-10
    shape = small.recover(np.concatenate([np.linalg.solve(small.stiffness, load), np.zeros(small.n)]))
    x = np.arange(1, 21) / 20.0
    assert shape[:40:2] == pytest.approx(x * x * (3.0 - x) / 6.0, rel=1e-8)
    assert not shape[40:].any()


@pytest.mark.parametrize("method", METHODS[:2])
def test_errors_are_those_of_the_full_model_and_fall_with_modes(beam, method):
    M, K, _ = beam
    full = np.sqrt(eigh(K, M, eigvals_only=True))
    errors = []
    for modes in (2, 5, 10):
        mass, stiffness, found = reduce(M, K, (38,), modes, method)
        own = np.sqrt(eigh(stiffness, mass, eigvals_only=True))
        assert found.errors == pytest.approx(np.abs(own / full[:modes + 1] - 1.0), abs=1e-8)  # rounding of eigenvalues, 5e7 apart
        assert (own >= full[:modes + 1] * (1.0 - 1e-9)).all()  # Rayleigh-Ritz: from above
        errors.append(max(found.errors[2], 1e-8))
        assert found.static_error < 1e-10
        top = found.valid_to(1e-3)
        assert np.all(found.errors[full[:modes + 1] <= top] <= 1e-3)
    assert errors[0] > errors[1] >= errors[2]


def test_the_complete_set_of_modes_is_the_full_model(beam):
    M, K, _ = beam
    mass, stiffness, found = reduce(M, K, (38, 0), 38, "craig-bampton")
    T = found.recovery
    assert np.linalg.cond(T) < 1e6
    assert T.T @ K @ T == pytest.approx(stiffness, rel=1e-9, abs=1e-9 * np.abs(stiffness).max())
    assert found.valid_to() == float("inf")
    assert found.errors.max() < 1e-7


def test_free_structures_need_their_rigid_body_modes():
    chain = 2.0 * np.eye(6) - np.eye(6, k=1) - np.eye(6, k=-1)
    chain[0, 0] = chain[5, 5] = 1.0
    mass, stiffness, found = reduce(np.eye(6), chain, (5,), 3, "rubin")
    own = np.sqrt(np.maximum(eigh(stiffness, mass, eigvals_only=True), 0.0))
    assert own[:2] == pytest.approx([0.0, 2.0 * np.sin(np.pi / 12.0)], abs=1e-6)
    assert found.errors[0] == 0.0 and found.static_error < 1e-9
    with pytest.raises(ValueError, match="1 rigid-body modes"):
        reduce(np.eye(6), chain, (5,), 0, "rubin")
    assert reduce(np.eye(6), chain, (5,), 3, "massless")[2].static_error < 1e-9
    # constraint modes do not hold what inertia balances
    assert 1e-9 < reduce(np.eye(6), chain, (5,), 2, "craig-bampton")[2].static_error < 1e-2
    loose = np.zeros((3, 3))
    loose[:2, :2] = [[1.0, -1.0], [-1.0, 1.0]]
    with pytest.raises(ValueError, match="rubin"):
        reduce(np.eye(3), loose, (2,), 1, "craig-bampton")


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("keep, modes", [((5,), 1), ((5,), 3), ((0, 5), 2)])
@pytest.mark.parametrize("mass, stiffness", [(1e3, 1e8), (1.0, 1e-8), (1e-12, 1e-12), (1e12, 1e12)])
def test_errors_of_free_structures_know_no_units(method, keep, modes, mass, stiffness):
    chain = 2.0 * np.eye(6) - np.eye(6, k=1) - np.eye(6, k=-1)
    chain[0, 0] = chain[5, 5] = 1.0
    plain = reduce(np.eye(6), chain, keep, modes, method)[2]
    scaled = reduce(mass * np.eye(6), stiffness * chain, keep, modes, method)[2]
    assert scaled.static_error == pytest.approx(plain.static_error, rel=1e-6, abs=1e-12)
    assert scaled.frequencies[1:] == pytest.approx(np.sqrt(stiffness / mass) * plain.frequencies[1:], rel=1e-9)
    assert scaled.residual == pytest.approx(plain.residual / stiffness, rel=1e-9)
    assert scaled.errors == pytest.approx(plain.errors, abs=1e-9) and scaled.errors[0] == 0.0


def test_the_massless_boundary_is_free_modes_beside_a_spring(beam):
    M, K, _ = beam
    mass, stiffness, found = reduce(M, K, (38,), 6, "massless")
    assert not mass[0].any()
    squares, modes = eigh(K, M)
    flexibility = (modes[38, 6:]**2 / squares[6:]).sum()
    assert found.residual[0, 0] == pytest.approx(flexibility, rel=1e-6)
    condensed = stiffness[1:, 1:] - np.outer(stiffness[1:, 0], stiffness[0, 1:]) / stiffness[0, 0]
    assert condensed == pytest.approx(np.diag(squares[:6]), rel=1e-6, abs=1e-5)
    assert found.static_error < 1e-10


@pytest.mark.parametrize(("keep", "modes", "method", "words"), [
    ((38,), 40, "rubin", "0 to 39 modes"), ((), 3, "rubin", "1 to 39"), ((1,), 3, "guyan", "craig-bampton, rubin, massless")])
def test_requests_that_cannot_be_met(beam, keep, modes, method, words):
    with pytest.raises(ValueError, match=words):
        reduce(beam[0], beam[1], keep, modes, method)
