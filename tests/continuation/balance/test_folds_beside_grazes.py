"""A branch that turns within 1e-5 of its length behind a graze: its fold is found, as by shooting, and is one point."""
import pytest

import bifurc as bf
from bifurc.elements import ElasticStop, HarmonicForce

MASS = [[1.0251, 0.0, 0.0], [0.0, 0.5962, 0.0], [0.0, 0.0, 1.9097]]
DAMPING = [[0.2329, -0.1292, 0.0], [-0.1292, 0.2393, -0.0852], [0.0, -0.0852, 0.3199]]
STIFFNESS = [[2.2267, -1.5135, 0.0], [-1.5135, 2.5116, -0.9981], [0.0, -0.9981, 2.8123]]
GRAZE, FOLD = 0.5486, 1e-5  # where to look, and how near


@pytest.fixture(scope="module")
def orbit():
    """Return the motion of three masses, a stop between two of them, at which the branches begin."""
    elements = [HarmonicForce(1.05), ElasticStop(0.193, 25.9, row=(-1.0, 0.0, 1.0))]
    return bf.find_orbit(bf.System(MASS, DAMPING, STIFFNESS, elements, omega=0.57))


@pytest.fixture(scope="module")
def exact(orbit):
    return bf.trace(orbit, "omega", bounds=(0.54, 0.6)).special_points


@pytest.mark.parametrize("bounds", [(0.545, 0.57), *(pytest.param(wide, marks=pytest.mark.slow) for wide in ((0.513, 0.627),
                                                                                                              (0.545, 0.58)))])
@pytest.mark.parametrize(("harmonics", "away"), [(41, 1e-5), (81, 3e-7)])
def test_a_fold_just_behind_a_graze_is_that_of_shooting(orbit, exact, harmonics, away, bounds):
    """Truncation moves the points by ``away``: harmonics of a force with corners in its slope fall as their third power."""
    balance = bf.find_orbit(orbit.system, orbit, method=bf.HarmonicBalance(harmonics))
    branch = bf.trace(balance, "omega", bounds=bounds, max_steps=300)
    assert [str(reason) for reason in branch.stop_reason] == ["bound", "bound"]
    for kind in ("fold", "grazing"):
        known = sorted(p.parameter for p in exact.of(kind) if 0.545 < p.parameter < 0.57)
        found = sorted(p.parameter for p in branch.special_points.of(kind) if 0.545 < p.parameter < 0.57)
        assert found == pytest.approx(known, abs=away)
    (fold,) = (p for p in exact.of("fold") if abs(p.parameter - GRAZE) < FOLD)
    (graze,) = (p for p in exact.of("grazing") if abs(p.parameter - GRAZE) < FOLD)
    (mine,) = (p for p in branch.special_points.of("fold") if abs(p.parameter - GRAZE) < 2.0 * FOLD)
    (beside,) = (p for p in branch.special_points.of("grazing") if abs(p.parameter - GRAZE) < 2.0 * FOLD)
    assert beside.parameter - mine.parameter == pytest.approx(graze.parameter - fold.parameter, rel=0.1)
    assert not branch.special_points.of("branch_point")  # multipliers of a truncated motion pass +1 beside its fold
