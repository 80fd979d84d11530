"""A mass pressed on its stop opens where the load passes what presses it: at one amplitude exactly, from either side.

The first flights behind it last for the root of what the load is more, with all impacts of the chattering that ends them: all
unknowns of the motion that opens are zero there at once, and so is its dp/ds.
"""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import HarmonicForce, RigidStop

NAME = "harmonic_force.amplitude"
# of 60 draws those in which the way there leads through events that lose all they have at once
DRAWS = (6, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (7, 28)))


def pressed(seed):
    """Return the system of a draw, pressed with .7 of the load that opens it, and that load."""
    rng = np.random.default_rng(seed)
    gap, some = -rng.uniform(0.05, 1.0), rng.choice([0.0, rng.uniform(0.0, 0.95)])
    omega, zeta = rng.uniform(0.3, 2.5), rng.uniform(0.0, 0.3)
    return bf.System(1, 2.0 * zeta, 1, [HarmonicForce(-0.7 * gap), RigidStop(gap, some)], omega=omega), -gap


@pytest.mark.parametrize("seed", DRAWS)
def test_it_opens_at_what_presses_it_from_both_sides(seed):
    system, load = pressed(seed)
    options = {"bounds": (0.5 * load, 1.02 * load), "max_steps": 600}
    first = bf.trace(bf.find_orbit(system), NAME, **options)
    open_ = [k for k, p in enumerate(first.column(NAME)) if p > load * 1.0000001]
    for branch in (first, *(bf.trace(first.orbits[k], NAME, **options) for k in open_[::max(1, len(open_) // 3)])):
        point, = (point for point in branch.special_points if abs(point.parameter - load) < 1e-4 * load)
        assert abs(point.parameter - load) <= point.error < 1e-9 * load
        assert point.before.startswith("rest") and branch.audit.ok, branch.audit
        assert np.ptp(branch.column(NAME)) == pytest.approx(0.52 * load)


# of a draw, how far above the load the number of listed impacts changes
CHANGES = ((45, 1.08e-7), (45, 2.30e-7), (28, 1.109e-5))


@pytest.mark.parametrize(("seed", "above"), CHANGES)
def test_it_opens_also_from_rows_on_a_change_of_the_listed_impacts(seed, above):
    """A start there is inside its equations by less than a test tells; and what is left of the train is as short as rounding."""
    system, load = pressed(seed)
    options = {"bounds": (0.5 * load, 1.02 * load), "max_steps": 600}
    first = bf.trace(bf.find_orbit(system), NAME, **options)
    starts = [k for k, p in enumerate(first.column(NAME)) if abs(p / load - 1.0 - above) < 0.01 * above]
    assert len(starts) == 2 and len(first.orbits[starts[0]].sequence.nodes) != len(first.orbits[starts[1]].sequence.nodes)
    for start in starts:
        branch = bf.trace(first.orbits[start], NAME, **options)
        point, = (point for point in branch.special_points if abs(point.parameter - load) < 1e-4 * load)
        assert abs(point.parameter - load) <= point.error < 1e-9 * load
        assert point.before.startswith("rest") and branch.audit.ok, branch.audit
        assert np.ptp(branch.column(NAME)) == pytest.approx(0.52 * load)
