"""A branch under a cubic law through grazing: the same walk over signatures as in affine scenes."""
import numpy as np

import bifurc as bf
from bifurc.elements import CubicSpring, HarmonicForce, RigidStop
from tests.flow.taylor import Duffing
from tests.reference import digits

GAP, RESTITUTION = 0.8, 0.7


def test_duffing_with_a_stop_grazes_where_its_free_response_reaches_the_stop():
    elements = (HarmonicForce(0.3), CubicSpring(1.0), RigidStop(GAP, RESTITUTION))
    system = bf.System(1.0, 0.1, 1.0, elements, omega=0.5)
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(0.4, 2.0))
    points = branch.special_points
    assert sorted(str(point.kind) for point in points) == ["fold", "fold", "grazing", "grazing", "period_doubling"]
    free = bf.trace(bf.find_orbit(bf.systems.duffing_oscillator(omega=0.5)), "omega", bounds=(0.4, 2.0))
    for point in points.of("grazing"):
        near = free.orbits[int(np.argmin(abs(free.column("omega") - point.parameter) + abs(free.column("max_0") - GAP)))]
        orbit = bf.find_orbit(bf.systems.duffing_oscillator(omega=point.parameter), near)
        assert abs(orbit.maximum(0) - GAP) < 1e-11
    lower = min(points.of("fold"), key=lambda point: point.parameter)
    assert abs(lower.parameter - min(digits.DUFFING_FOLDS)) < 1e-11  # beyond the second grazing the motion is free again
    flip = points.of("period_doubling")[0]
    row = int(np.argmin(abs(branch.column("omega") - flip.parameter) + 10.0 * (branch.column("n_events") == 0)))
    orbit = branch.orbits[row]
    omega = float(branch.column("omega")[row])
    reference = Duffing(omega=omega, gap=GAP, restitution=RESTITUTION)
    end, impacts = reference.run(orbit.state, 0.0, orbit.period)
    assert len(impacts) == len(orbit.events) == 1
    assert abs(np.array(end, float) - orbit.state).max() < 1e-11
    assert abs(orbit.events[0].time - float(impacts[0][0])) < 1e-11
