"""Free flights inside a ring: closed form, no slower than beside a flat stop, and no touch is lost however slight."""
import time

import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import ElasticStator, HarmonicForce, RigidStator, RigidStop

EYE = np.eye(2)
RINGS = {"rigid": lambda radius, **at: RigidStator(radius=radius, restitution=0.5, **at),
         "elastic": lambda radius, **at: ElasticStator(radius=radius, stiffness=25.0, **at)}


def seconds(system, start, **length):
    best = np.inf
    for _ in range(3):
        clock = time.process_time()
        motion = bf.simulate(system, start, **length)
        best = min(best, time.process_time() - clock)
    assert motion.success and not len(motion.events)
    return best, motion.final


@pytest.mark.parametrize("kind", RINGS)
@pytest.mark.parametrize("load", [0.0, 0.3])
def test_a_long_flight_costs_no_more_than_beside_a_flat_stop(kind, load):
    forces = () if load == 0.0 else (HarmonicForce(load, dof=0),)
    flat, ringed = (bf.System(EYE, 0.0 * EYE, np.diag([1.0, 2.0]), [*forces, element], omega=0.6 if load else None)
                    for element in (RigidStop(gap=10.0, dof=0), RINGS[kind](3.0)))
    length = {"periods": 1500} if load else {"duration": 3000.0 * np.pi}
    (beside, _), (inside, final) = seconds(flat, (1.0, 0.5, 0.0, 0.7), **length), seconds(ringed, (1.0, 0.5, 0.0, 0.7), **length)
    assert inside < 8.0 * beside + 5e-3  # by the collocation of laws it was 100 times
    t = ringed.with_parameters().omega and 1500 * 2.0 * np.pi / 0.6 or 3000.0 * np.pi
    own = load / (1.0 - 0.36) if load else 0.0
    known = [own * np.cos(0.6 * t) + (1.0 - own) * np.cos(t), 0.5 * np.cos(2.0**0.5 * t) + 0.7 / 2.0**0.5 * np.sin(2.0**0.5 * t)]
    assert np.abs(final[:2] - known).max() < 1e-10


@pytest.mark.parametrize("kind", RINGS)
@pytest.mark.parametrize("aspect", [0.0, 0.5, 0.99])
@pytest.mark.parametrize("centre", [(0.0, 0.0), (0.25, -0.125)])
def test_a_flight_touches_where_it_reaches_the_ring(kind, aspect, centre):
    # (cos t, aspect sin t) reaches the radius 1 at t = pi, and about a centre beside the origin the greatest distance
    angle = np.linspace(0.0, 2.0 * np.pi, 100001)
    away = np.hypot(np.cos(angle) - centre[0], aspect * np.sin(angle) - centre[1])
    i = int(np.argmax(away))
    for _ in range(60):  # Newton on the slope of the square of the distance
        c, s = np.cos(angle[i]), np.sin(angle[i])
        slope = -s * (c - centre[0]) + aspect * c * (aspect * s - centre[1])
        bend = s * s - c * (c - centre[0]) + aspect**2 * c * c - aspect * s * (aspect * s - centre[1])
        angle[i] -= slope / bend
    most = float(np.hypot(np.cos(angle[i]) - centre[0], aspect * np.sin(angle[i]) - centre[1]))
    begin = angle[i] - 2.5
    start = (np.cos(begin), aspect * np.sin(begin), -np.sin(begin), aspect * np.cos(begin))
    for off in (1e-3, 1e-6, 1e-9, 1e-11):
        for way in (1.0, -1.0):
            stator = RINGS[kind](most * (1.0 + way * off), centre_x=centre[0], centre_y=centre[1])
            motion = bf.simulate(bf.System(EYE, 0.0 * EYE, EYE, [stator]), start, duration=2.9)
            assert (len(motion.events) == 0) == (way > 0.0), off
