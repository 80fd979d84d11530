"""Branches of sampled contacts: where a slider begins to slip or stick among samples they go on as those of exact events do."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import HarmonicForce, Jenkins

CASES = [
    (3, ((0.405, 0.971, 0), (1.081, 0.16, 1), (1.576, 0.632, 1)), 1.843, 0.03),  # turned at an onset of stick, ran back
    (2, ((1.736, 0.746, 1), (1.243, 0.323, 0), (0.577, 0.121, 1)), 1.929, 0.03),  # these two ended there
    (1, ((1.84, 0.199, 0), (1.539, 0.347, 0), (0.786, 0.576, 0)), 1.859, 0.05),
]


def chain(n, sliders, force, damping, omega):
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    return bf.System(np.eye(n), damping * K, K, [*(Jenkins(k, limit, dof=dof) for k, limit, dof in sliders), HarmonicForce(force)],
                     omega=omega)


@pytest.mark.parametrize(("n", "sliders", "force", "damping"), CASES)
def test_a_branch_over_sliders_goes_from_bound_to_bound(n, sliders, force, damping):
    start = bf.find_orbit(chain(n, sliders, force, damping, 0.4), method=bf.HarmonicBalance(15, aft="sampled"))
    branch = bf.trace(start, "omega", bounds=(0.3, 3.0))
    omega = branch.column("omega")
    assert {omega[0], omega[-1]} == {0.3, 3.0} and [str(reason) for reason in branch.stop_reason] == ["bound", "bound"]
    assert branch.audit.ok and not any(point.reverses for point in branch.special_points)
    for row in (0, -1):  # events found exactly, another start
        exact = bf.find_orbit(chain(n, sliders, force, damping, float(omega[row])), method=bf.HarmonicBalance(15))
        known = exact.rms()
        assert branch.orbits[row].rms() == pytest.approx(known, rel=1e-4)
