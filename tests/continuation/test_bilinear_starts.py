"""The bilinear branch is the same from every start, in both directions, after saving and after extending."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation import Branch
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
