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


def drawn(seed):
    """Return a chain of up to three masses with as many sliders anywhere, at omega = 0.3, and a number of harmonics."""
    random = np.random.default_rng(seed)
    n, count, harmonics = int(random.integers(1, 4)), int(random.integers(1, 4)), int(random.choice([5, 7, 9, 11, 15]))
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    C = float(random.uniform(0.01, 0.1)) * K
    force = HarmonicForce(float(random.uniform(0.3, 2.0)), dof=int(random.integers(n)))
    sliders = [Jenkins(float(random.uniform(0.3, 4.0)), float(random.uniform(0.1, 1.0)), dof=int(random.integers(n)))
               for _ in range(count)]
    return bf.System(np.eye(n), C, K, [force, *sliders], omega=0.3), harmonics


@pytest.mark.parametrize("seed", [9, 38, 64, 114, 137, 160, 208])
def test_events_that_samples_tell_before_or_after_the_margins_do_not_end_a_branch(seed):
    """Each ended where a stick or slip shorter than the distance of two samples begins; another start, with exact events, ends
    there."""
    system, harmonics = drawn(seed)
    branch = bf.trace(bf.find_orbit(system, method=bf.HarmonicBalance(harmonics, aft="sampled")), "omega", bounds=(0.3, 2.0))
    omega = branch.column("omega")
    assert {omega[0], omega[-1]} == {0.3, 2.0} and [str(reason) for reason in branch.stop_reason] == ["bound", "bound"]
    assert branch.audit.ok and not any(point.reverses for point in branch.special_points)
    for row in np.linspace(0, len(branch) - 1, 5).astype(int):
        orbit = branch.orbits[row]
        there = bf.System(system.mass, system.damping, system.stiffness, system.elements, omega=float(omega[row]))
        exact = bf.find_orbit(there, orbit.state, method=bf.HarmonicBalance(harmonics))
        assert orbit.rms() == pytest.approx(exact.rms(), rel=2e-3)
