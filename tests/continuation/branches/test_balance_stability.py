"""Changes of stability on branches of harmonic balance: located, and the same as by ways that use no multiplier."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.branches.stability_changes import circling, passing
from bifurc.elements import ConstantForce, CubicSpring, Force, HarmonicForce

AMPLITUDE = "harmonic_force.amplitude"


def ueda(amplitude=2.0, mean=0.0):
    return bf.System(1.0, 0.1, 0.0, [HarmonicForce(amplitude), ConstantForce(mean), CubicSpring(1.0)], omega=1.0)


def branch_of(system, method, bounds, **options):
    return bf.trace(bf.find_orbit(system, method=method), AMPLITUDE, bounds=bounds, **options)


def test_symmetry_breaks_where_the_determinant_of_all_harmonics_says():
    """Odd harmonics alone cannot express the asymmetric motions: only the multiplier tells."""
    odd = branch_of(ueda(), bf.HarmonicBalance(tuple(range(1, 26, 2))), (1.0, 6.0))
    every = branch_of(ueda(), bf.HarmonicBalance(25), (1.0, 6.0))
    (point,), (known,) = odd.special_points, every.special_points
    assert point.kind == known.kind == "branch_point" and known.directions is not None
    assert abs(point.parameter - known.parameter) < 1e-7 and point.error < 1e-9


@pytest.fixture(scope="module")
def asymmetric():
    return branch_of(ueda(mean=0.6), bf.HarmonicBalance(15), (1.0, 12.0))


def test_period_doublings_are_branch_points_of_two_periods(asymmetric):
    points = asymmetric.special_points
    flips = points.of("period_doubling")
    assert len(flips) == 6 and [str(p.kind) for p in points if p.kind != "period_doubling"] == ["fold", "fold"]
    assert [p.s for p in points] == sorted(p.s for p in points)
    for flip in flips[:2]:
        assert flip.error < 1e-9 and flip.status == "located"
        assert np.abs(np.array(flip.measures["multiplier_0"]) + 1.0) < 1e-8 or np.abs(flip.measures["multiplier_1"] + 1.0) < 1e-8
        near = asymmetric.orbits[int(np.argmin(np.abs(asymmetric.column("s") - flip.s)))]
        two = bf.find_orbit(near.system, guess=near, periods=2, method=bf.HarmonicBalance(15))
        bounds = (flip.parameter - 0.2, flip.parameter + 0.2)
        (known,) = bf.trace(two, AMPLITUDE, bounds=bounds).special_points.of("branch_point")
        assert abs(known.parameter - flip.parameter) < 2e-6


def test_points_do_not_depend_on_direction_or_steps(asymmetric):
    known = sorted(p.parameter for p in asymmetric.special_points.of("period_doubling"))
    back = bf.trace(asymmetric.orbits[-1], AMPLITUDE, bounds=(1.0, 12.0), ds_max=0.05)
    assert sorted(p.parameter for p in back.special_points.of("period_doubling")) == pytest.approx(known, abs=1e-7)


def test_points_are_stored_and_extended(asymmetric, tmp_path):
    asymmetric.save(tmp_path / "branch.npz")
    loaded = bf.load(tmp_path / "branch.npz")
    assert [(p.kind, p.parameter) for p in loaded.special_points] == [(p.kind, p.parameter) for p in asymmetric.special_points]
    part = branch_of(ueda(mean=0.6), bf.HarmonicBalance(15), (1.0, 3.0))
    longer = part.extend(bounds=(1.0, 3.2))
    assert len(longer.special_points.of("period_doubling")) == len(part.special_points.of("period_doubling")) == 2


def test_columns_are_those_of_the_orbits(asymmetric):
    stable = asymmetric.column("stable")
    table = np.array([asymmetric.column(f"multiplier_{k}") for k in range(2)]).T
    for i in range(0, len(asymmetric), 5):
        assert stable[i] is asymmetric.orbits[i].stable or stable[i] == asymmetric.orbits[i].stable
        np.testing.assert_allclose(table[i], asymmetric.orbits[i].multipliers, atol=1e-9)


def test_on_the_circle_stability_is_not_told():
    undamped = bf.System(1.0, 0.0, 1.0, [HarmonicForce(0.3), CubicSpring(0.1)], omega=0.5)
    branch = branch_of(undamped, bf.HarmonicBalance(7), (0.2, 0.4))
    assert all(value is None for value in branch.column("stable"))
    assert branch.orbits[0].stable is None and len(branch.special_points) == 0


def van_der_pol(u, s, mu):
    return mu * (1.0 - u * u) * s


@pytest.mark.slow
def test_entrainment_ends_in_a_torus():
    """A driven van der Pol oscillator leaves its forcing where the divergence of the flow over a period is zero."""
    system = bf.System(1.0, 0.0, 1.0, [HarmonicForce(3.0), Force(van_der_pol, mu=0.3)], omega=1.6)
    branch = bf.trace(bf.find_orbit(system, method=bf.HarmonicBalance(9)), AMPLITUDE, bounds=(0.5, 4.0))
    (point,) = branch.special_points.of("neimark_sacker")
    orbit = point.solution  # by Liouville: the product of the multipliers is exp of the mean of mu (1 - u^2) times the period
    assert orbit.rms(0) == pytest.approx(1.0, abs=1e-8)


def test_tests_of_multipliers():
    inside, outside = np.array([0.5 + 0.5j, 0.5 - 0.5j, 0.1]), np.array([0.9 + 0.5j, 0.9 - 0.5j, 0.1])
    assert circling(inside) * circling(outside) < 0.0
    assert passing(np.array([-0.9, 0.1 + 0j]), -1.0) * passing(np.array([-1.1, 0.1 + 0j]), -1.0) < 0.0
    assert passing(np.array([-1.1, -1.2 + 0j]), -1.0) > 0.0  # two at once cancel
    assert circling(np.zeros(1, complex)) == 1.0 and passing(np.array([1j, -1j]), 1.0) == 1.0
