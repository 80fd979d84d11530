"""Sliders that slip less and less until they hold: the motion that is left, against one with springs in their place."""
import numpy as np

import bifurc as bf
from bifurc.elements import ConstantForce, ElasticStop, HarmonicForce, Jenkins, LinearSpring


def system(second):
    return bf.System(1.0, 0.0288, 1.0, [HarmonicForce(0.883), Jenkins(0.515, 0.088, label="a"), *second, ElasticStop(0.648, 14.6)],
                     omega=0.702)


def test_a_slip_that_dies_out_is_no_event():
    """The second slider reaches its limit in ever shorter slips; what it tends to lists none, and has the multipliers of a spring
    there (a slip of 2e-9 periods was listed, .835 and .612 were told of .816 and .378)."""
    orbit = bf.find_orbit(system([Jenkins(0.795, 0.575, label="b")]))
    assert orbit.success and "b." not in str(orbit)
    w = float(orbit.state[3])
    held = bf.find_orbit(system([LinearSpring(0.795), ConstantForce(0.795 * w)]), guess=np.delete(orbit.state, 3))
    assert held.success
    np.testing.assert_allclose(held.state, np.delete(orbit.state, 3), rtol=0, atol=1e-12)
    np.testing.assert_allclose(np.sort(np.abs(orbit.multipliers))[-2:], np.sort(np.abs(held.multipliers))[-2:], rtol=0, atol=1e-9)


def test_slips_in_one_direction_only_come_to_nothing():
    """The second slider is just at its limit at the farthest point of every period: a slip there is rounding, none is listed."""
    orbit = bf.find_orbit(bf.System(1.0, 0.194, 1.0, [
        HarmonicForce(1.53), Jenkins(0.832, 0.0522, label="a"), Jenkins(0.318, 0.442, label="b"), ElasticStop(0.603, 14.6)],
        omega=0.536))
    assert orbit.success and "b." not in str(orbit) and orbit.family == [3]
    motion = bf.simulate(orbit.system, y0=orbit.state, periods=1)
    turns = [motion(event.time) for event in motion.events if event.kind.value == "stick"]
    force = max(abs(0.318 * (y[0] - y[3])) for y in turns)
    assert abs(force - 0.442) < 1e-12
