"""Multipliers of harmonic motions: monodromy in the time domain against Hill's method, folds, and closed forms."""
import numpy as np
import pytest
from scipy.linalg import expm

import bifurc as bf
from bifurc.continuation.balance.start import balance_problem
from bifurc.hbm.floquet import stability
from bifurc.hbm.floquet.stability import StabilityStatus, multipliers_of
from tests.hbm.test_examples import duffing, unilateral
from tests.reference.hill import Hill, hill_multipliers


def jenkins(omega=1.1, harmonics=21):
    system = bf.systems.jenkins_oscillator(zeta=0.01, omega=omega, amplitude=1.0, stiffness=1.0, limit=1.0)
    return bf.find_orbit(system, method=bf.HarmonicBalance(harmonics))


def test_linear_closed_form():
    orbit = bf.find_orbit(bf.System(1.0, 0.1, 1.0, [bf.elements.HarmonicForce(1.0)], omega=1.3), method=bf.HarmonicBalance(3))
    want = np.linalg.eigvals(expm(np.array([[0.0, 1.0], [-1.0, -0.1]]) * orbit.period))
    assert np.sort_complex(orbit.multipliers) == pytest.approx(np.sort_complex(want), abs=1e-13)
    assert orbit.stable


def coupled(u0, u1, s0, s1, a, b):
    return -a * u1 - b * s1, 0.5 * a * u0 - 0.2 * b * s0


@pytest.mark.parametrize("gyroscopic", [0.0, 0.4])  # without it the transposed slopes have the same multipliers
def test_a_law_of_two_rows_is_linearised_row_by_row(gyroscopic):
    """A linear law whose slopes are not symmetric: the multipliers are those of the linear system."""
    law = bf.elements.Force(coupled, site=np.eye(2), a=0.3, b=0.15)
    K, C = np.diag([1.0, 2.0]), np.array([[0.1, gyroscopic], [-gyroscopic, 0.2]])
    system = bf.System(np.eye(2), C, K, [bf.elements.HarmonicForce(1.0), law], omega=1.3)
    orbit = bf.find_orbit(system, method=bf.HarmonicBalance(3))
    whole = K + 0.3 * np.array([[0.0, 1.0], [-0.5, 0.0]]), C + 0.15 * np.array([[0.0, 1.0], [0.2, 0.0]])
    want = np.linalg.eigvals(expm(np.block([[np.zeros((2, 2)), np.eye(2)], [-whole[0], -whole[1]]]) * orbit.period))
    assert np.sort_complex(orbit.multipliers) == pytest.approx(np.sort_complex(want), abs=1e-9)


def test_elastic_slider_is_stable():
    """The slider starts its stick with the displacement of that instant: 0, .388, .780."""
    mu = jenkins().multipliers
    assert mu == pytest.approx([0.7796, 0.3876, 0.0], abs=1e-4) and abs(mu[2]) < 1e-14
    assert jenkins().stable


def test_stuck_slider_is_a_spring():
    """Memory that is never written is a parameter of a family: its +1 is left out."""
    orbit = jenkins(omega=0.5, harmonics=3)
    want = np.linalg.eigvals(expm(np.array([[0.0, 1.0], [-2.0, -0.02]]) * orbit.period))
    assert np.sort_complex(orbit.multipliers) == pytest.approx(np.sort_complex(want), abs=1e-12)


def test_monodromy_against_delay_weighted_hill():
    orbit = jenkins()
    time = orbit.multipliers
    assert hill_multipliers(orbit.balance, orbit.coefficients, 42)[:2] == pytest.approx(time[:2], abs=1e-8)
    plain = Hill(orbit.balance, orbit.coefficients, 30)
    assert np.abs(plain.multipliers()[:2] - time[:2]).min() > 1e-2  # without the weight no multiplier is right
    plain.delayed = []  # the derivative of the force alone, as if sliders knew nothing of the displacement they stopped at:
    assert plain.multipliers()[0] == pytest.approx(1.767, abs=1e-3)  # a stable orbit is called unstable


def test_monodromy_against_shooting_as_harmonics_grow():
    """The multipliers of the true motion: those of the balance come nearer at least as H^-2."""
    true = bf.find_orbit(jenkins().system, guess=jenkins()).multipliers
    errors = [np.abs(jenkins(harmonics=H).multipliers[:2] - true[:2]).max() for H in (7, 21, 61)]
    assert errors[1] < errors[0] / 5 and errors[2] < 1e-5


def test_law_multipliers_against_hill():
    orbit = bf.find_orbit(duffing(1.2), method=bf.HarmonicBalance(7))
    assert orbit.multipliers == pytest.approx(hill_multipliers(orbit.balance, orbit.coefficients, 21), abs=1e-9)
    det = np.exp(-0.05 * orbit.period)  # Liouville
    assert np.prod(orbit.multipliers) == pytest.approx(det, abs=1e-11)


def test_contact_multipliers_against_hill():
    orbit = bf.find_orbit(unilateral(0.62), method=bf.HarmonicBalance(21))
    assert np.prod(orbit.multipliers) == pytest.approx(np.exp(-0.09 * orbit.period), rel=1e-11)  # trace of M^-1 C is .09


def test_folds_of_duffing_by_both():
    """Example 01: a multiplier passes +1 at each fold, by monodromy and by Hill, within 1e-6 in frequency."""
    branch = bf.trace(bf.find_orbit(duffing(0.5), method=bf.HarmonicBalance(9)), "omega", bounds=(0.5, 1.6))
    folds = branch.special_points.of("fold")
    assert len(folds) == 2
    for fold in folds:
        low = max(i for i in range(len(branch)) if branch.column("s")[i] < fold.s - 1e-3)
        a, b = branch.orbits[low], fold.solution
        # d omega = bend (mu - 1)^2 near a fold: the frequency at which mu = 1 differs by bend (mu(fold) - 1)^2
        near = a.multipliers[np.argmin(np.abs(a.multipliers - 1.0))].real - 1.0
        bend = abs((a.parameters["omega"] - b.parameters["omega"]) / near**2)
        for mu in (b.multipliers, hill_multipliers(b.balance, b.coefficients, 27)):
            off = np.abs(mu - 1.0).min()
            assert bend * off**2 < 1e-6 and off < 1e-5


def test_sampled_balance_and_columns():
    exact = jenkins(harmonics=7)
    method = bf.HarmonicBalance(7, aft="sampled", samples=4096)
    orbit = bf.find_orbit(exact.system, guess=exact, method=method)
    assert orbit.multipliers == pytest.approx(exact.multipliers, abs=1e-4)
    branch = bf.trace(exact, "omega", bounds=(1.05, 1.15))
    mu = branch.column("multiplier_0")
    i = len(branch) // 2
    assert mu[i] == pytest.approx(branch.orbits[i].multipliers[0], abs=1e-12)
    assert branch.column("stable").all()


def test_set_valued_friction_says_why():
    system = bf.systems.dry_friction_oscillator()
    orbit = bf.find_orbit(system, method=bf.HarmonicBalance(9))
    status, mu = multipliers_of(orbit.balance, orbit.coefficients)
    assert status is StabilityStatus.SET_VALUED and "Polish" in status.sentence and not len(mu)
    assert orbit.stable is None


def test_rows_in_pieces_have_the_multipliers_of_their_own(monkeypatch):
    """A branch too long to hold at once is done in pieces; a row whose motion is not followed tells nothing, and no number."""
    branch = bf.trace(bf.find_orbit(duffing(0.5), method=bf.HarmonicBalance(5)), "omega", bounds=(0.5, 0.6))
    problem, xs = branch.problems[0], np.array([branch.x(i) for i in range(len(branch))])
    whole = stability.multipliers_along(problem, xs)
    singly = np.array([multipliers_of(problem.whole, problem.motions(x[None])[0], problem.whole_numbers(x[-1]))[1] for x in xs])
    np.testing.assert_allclose(whole, singly, rtol=1e-12)
    assert np.unique(whole.round(9), axis=0).shape == whole.shape
    monkeypatch.setattr(stability, "MOST", 3 * 4)
    np.testing.assert_array_equal(stability.multipliers_along(problem, xs), whole)
    matrices = stability._matrices

    def lost(*arguments):
        codes, found, kept = matrices(*arguments)
        codes[0] = 0
        return codes, found, kept

    monkeypatch.setattr(stability, "_matrices", lost)
    assert np.isnan(stability.multipliers_along(problem, xs)[0]).all()


def test_multipliers_are_the_same_when_they_are_asked_for_again():
    """Two coupled masses with a stop that is not met: exponentials of the linear equations; numbers are not overwritten."""
    M, K = np.array([[1.0, 0.3], [0.3, 2.0]]), np.array([[2.0, -0.5], [-0.5, 1.0]])
    C = 0.1 * M + 0.02 * K
    system = bf.System(M, C, K, (bf.elements.HarmonicForce(0.1, dof=0), bf.elements.ElasticStop(5.0, 2.0, dof=1)), omega=0.9)
    orbit = bf.find_orbit(system, method=bf.HarmonicBalance(2))
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    want = np.sort_complex(np.linalg.eigvals(expm(A * system.period)))
    problem = balance_problem(orbit, "omega", (0.8, 1.0))
    for _ in range(3):
        np.testing.assert_allclose(np.sort_complex(problem.multipliers_of_rows(problem.x0[None])[0]), want, atol=1e-9)
