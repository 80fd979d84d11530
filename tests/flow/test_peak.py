"""The largest maximum of a guard along a segment, against closed forms of a mass under a constant force."""
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.elements import ConstantForce, RigidStop
from bifurc.flow.affine import peak
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


@pytest.mark.parametrize("phase", np.linspace(0.0, 2.0 * np.pi, 13)[:-1])
def test_of_maxima_that_grow_slowly_the_last_is_the_largest(phase):
    """y = e^(z t) cos(w t + phase) with z = 2e-5: the maxima differ by 1e-4 of their height, wherever steps cut them."""
    z = 2e-5
    w = math.sqrt(1.0 - z * z)
    scene = scene_of(bf.System(1.0, -2.0 * z, 1.0, [ConstantForce(0.0), RigidStop(5.0, 0.8)], omega=1.0))
    T = scene.tables
    mode = next(m for m in range(len(scene.keys)) if T.n_holds[m] == 0)
    guard = next(g for g in range(int(T.n_guards[mode])) if T.kick[mode, g])
    end = (6.0 * np.pi - phase) / w + 1.3  # behind the third maximum
    start = state(T, math.cos(phase), z * math.cos(phase) - w * math.sin(phase))
    value, at = segment_peak(T, mode, guard, start, end, 1, 0)
    top = (6.0 * np.pi - phase + math.atan(z / w)) / w
    assert at == pytest.approx(top, abs=1e-6)
    assert value == pytest.approx(math.exp(z * top) * math.cos(w * top + phase) - 5.0, abs=1e-12)


def test_a_rate_that_is_the_rounding_of_its_terms_is_zero():
    """Two masses that meet with next to the same speed: behind the zero of their gap its rate is known only beyond rounding."""
    scene = scene_of(bf.System(np.eye(2), np.zeros((2, 2)), np.eye(2), [RigidStop(0.0, 0.5, row=(1.0, -1.0))]))
    m = scene.index(("free",))
    (g,) = scene.guards_of(m, 0)
    for speed in (1e-8, 1.0, 1e8):
        for share, known in ((0.0, 2), (2e-16, 2), (-4e-16, 2), (1e-13, 1), (-1e-9, 1), (0.5, 1)):
            x = np.array([0.3, 0.3, speed, speed * (1.0 - share), 1.0])
            assert peak.zeros(scene.tables, m, g, x, 1) == known
            assert peak.zeros(scene.tables, m, g, x, 0) == 0


@pytest.mark.parametrize("noise", [1e-13, -1e-13])
def test_a_touch_at_the_start_is_no_maximum_beyond_it(noise):
    """A mass on its stop without speed, to rounding, that a force pulls away."""
    scene = scene_of(bf.System(1.0, 0.0, 1.0, [ConstantForce(-1.0), RigidStop(0.3, 0.8)]))
    T = scene.tables
    mode = next(m for m in range(len(scene.keys)) if T.n_holds[m] == 0)
    guard = next(g for g in range(int(T.n_guards[mode])) if T.kick[mode, g])
    start = state(T, 0.3 + noise, noise)
    assert segment_peak(T, mode, guard, start, 0.5, 1, 2)[0] == -np.inf
    if noise > 0.0:
        value, at = segment_peak(T, mode, guard, start, 0.5, 1, 0)
        assert 0.0 < at < 1e-12 and value == pytest.approx(noise, rel=1e-2)
