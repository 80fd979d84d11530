"""The largest maximum of a guard along a segment, against closed forms of a mass under a constant force."""
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.elements import ConstantForce, RigidStop
from bifurc.flow.affine.peak import segment_peak


@pytest.fixture(scope="module")
def free():
    """Return tables, mode and guard of a mass on a spring, pressed to a stop at .3 by a force of 1; omega is 1 without damping."""
    scene = scene_of(bf.System(1.0, 0.0, 1.0, [ConstantForce(1.0), RigidStop(0.3, 0.8)], omega=1.0))
    T = scene.tables
    mode = next(m for m in range(len(scene.keys)) if T.n_holds[m] == 0)
    guard = next(g for g in range(int(T.n_guards[mode])) if T.kick[mode, g])
    return T, mode, guard


def state(T, y, v):
    """Return the joined state (nx,): that of the mass, and what the forces add."""
    x = np.zeros(T.A.shape[2])
    x[:2] = y, v
    x[2] = 1.0
    return x


def test_a_maximum_inside_is_that_of_the_closed_form(free):
    """About 1 the mass turns as on a circle: farthest where it turns, at 1 + hypot(1.2, .4)."""
    T, mode, guard = free
    start = state(T, -0.2, 0.4)  # y = 1 - 1.2 cos t + .4 sin t
    value, at = segment_peak(T, mode, guard, start, 6.0, 0, 0)
    assert at == pytest.approx(math.pi - math.atan2(0.4, 1.2), abs=1e-9)
    assert value == pytest.approx(1.0 + math.hypot(1.2, 0.4) - 0.3, abs=1e-12)


@pytest.mark.parametrize("speed", [1e-6, 1e-4, 1e-2, 0.3])
def test_a_flight_that_ends_at_its_farthest_point_has_no_maximum(free, speed):
    """Behind a rebound friction turns where the mass does: the depth of the flight is no maximum, on whatever side of it rounding
    puts the end."""
    T, mode, guard = free
    half = math.atan2(speed, 0.7)  # y = 1 - .7 cos t - speed sin t
    for end in (np.nextafter(half, 0.0), half, np.nextafter(half, 1.0), half * (1.0 + 1e-9)):
        assert segment_peak(T, mode, guard, state(T, 0.3, -speed), end, 0, 1)[0] == -np.inf


def test_an_end_that_the_guard_rises_to_counts(free):
    """Three quarters of the flight: the guard has fallen and risen again, and goes on behind the end."""
    T, mode, guard = free
    speed, end = 0.3, 1.5 * math.atan2(0.3, 0.7)
    value, at = segment_peak(T, mode, guard, state(T, 0.3, -speed), end, 0, 1)
    assert at == end
    assert value == pytest.approx(0.7 - 0.7 * math.cos(end) - speed * math.sin(end), abs=1e-13)
    assert segment_peak(T, mode, guard, state(T, 0.3, -speed), end, 1, 1)[0] == -np.inf  # the guard itself ends the segment
