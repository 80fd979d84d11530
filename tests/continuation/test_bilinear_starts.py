"""The bilinear branch is the same from every start, in both directions, after saving and after extending."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation import Branch, StopReason
from bifurc.elements import ElasticStop, HarmonicForce
from tests.reference import digits

WANTED = sorted([*digits.BILINEAR_GRAZINGS, *digits.BILINEAR_FLIPS, *digits.BILINEAR_FOLDS])


def start(omega):
    return bf.find_orbit(bf.systems.bilinear_oscillator(**digits.BILINEAR, omega=omega))


def values(branch):
    assert branch.audit.ok, branch.audit
    assert all(abs(min(WANTED, key=lambda w: abs(w - point.parameter)) - point.parameter) <= point.error + 1e-14
               for point in branch.special_points)
    return sorted(point.parameter for point in branch.special_points)


@pytest.mark.parametrize("omega", [0.6, 0.7, 0.8, 1.0, 1.25, 1.5, 2.5])
def test_free_and_touching_starts(omega):
    for ds_max in (0.1, 0.2, 0.5, 1.0):
        branch = bf.trace(start(omega), "omega", bounds=(2.5, 0.5), ds_max=ds_max)
        assert values(branch) == pytest.approx(WANTED, abs=1e-11)
        assert sorted(branch.column("omega")[[0, -1]]) == [0.5, 2.5]


def test_saved_loaded_extended_bit_for_bit(tmp_path):
    branch = bf.trace(start(0.8), "omega", bounds=(0.75, 1.2))
    branch.save(tmp_path / "branch.npz")
    loaded = Branch.load(tmp_path / "branch.npz")
    for a, b in ((branch, loaded), (branch.extend(bounds=(0.5, 2.5)), loaded.extend(bounds=(0.5, 2.5)))):
        header, arrays = a.to_record()
        other, others = b.to_record()
        assert header == other
        assert all(np.array_equal(arrays[name], others[name], equal_nan=True) for name in arrays)
    assert values(b) == pytest.approx(WANTED, abs=1e-11)


def test_a_flip_beside_the_end_of_a_doubled_branch_is_seen_from_both_sides():
    """Motions of 8 T against an elastic stop, between two period doublings of 4 T: a flip 2e-5 after the first, others beside
    grazes; traced back from next to either end all of them are found again."""
    system = bf.systems.bilinear_oscillator(zeta=0.05, amplitude=0.3, gap=0.0, stiffness_ratio=100.0, omega=2.815)
    orbit = bf.find_orbit(system)
    assert orbit.periods == 8
    branch = bf.trace(orbit, "omega", bounds=(2.5, 3.1))
    assert branch.stop_reason == (StopReason.MERGED, StopReason.MERGED)
    assert len(branch.special_points) == 12 and branch.audit.ok
    for k in (2, len(branch) - 3):
        again = bf.trace(branch.orbits[k], "omega", bounds=(2.5, 3.1))
        assert [point.kind for point in again.special_points] == [point.kind for point in branch.special_points]
        assert [point.parameter for point in again.special_points] == pytest.approx(
            [point.parameter for point in branch.special_points], abs=1e-11)
        assert again.audit.ok


def test_a_flip_beside_a_graze_of_several_short_contacts_is_not_missed():
    """The multiplier passes -1 about 2.4e-5 before a contact is born, in the wake of a fold where it was +1."""
    system = bf.System(1.0, 0.281, 1.0, [HarmonicForce(0.3), ElasticStop(-0.0603, 118.0, damping=0.134)], omega=0.401)
    branch = bf.trace(bf.find_orbit(system), "gap", bounds=(-0.1403, 0.0197))
    assert branch.audit.ok, branch.audit
    flips = branch.special_points.of("period_doubling")
    grazes = branch.special_points.of("grazing")
    pairs = [(flip, graze) for flip in flips for graze in grazes if 0.0 < abs(flip.s - graze.s) < 1e-4]
    assert pairs
    for flip, _ in pairs:
        assert np.abs(flip.solution.multipliers + 1.0).min() < 1e-6
