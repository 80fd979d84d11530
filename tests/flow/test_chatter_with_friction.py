"""Complete chattering of a mass that rubs: friction turns round in every impact and at the top of every flight."""
import mpmath as mp
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import ConstantForce, Coulomb, HarmonicForce, RigidStop
from bifurc.flow.scan import slowed


def flights(r, v, push, away, loss, rate):
    """Return the duration of a complete chattering, by flights, 40 digits: w' = a + rate t - loss w, speed w to the stop."""
    with mp.workdps(40):
        r, v, push, away, loss, rate = (mp.mpf(value) for value in (r, v, push, away, loss, rate))

        def motion(a, t, w, tau):
            """Speed and way of w' = a + rate (t + tau) - loss w from w at t, series in the small loss tau."""
            b = a + rate * t
            terms, speed, way = [w], w, w * tau
            for k in range(1, 14):
                source = b if k == 1 else rate if k == 2 else mp.mpf(0)
                terms.append((source - loss * terms[-1]) / k)
                speed += terms[-1] * tau**k
                way += terms[-1] * tau**(k + 1) / (k + 1)
            return speed, way

        t, u = mp.mpf(0), r * v
        while u > v * mp.mpf("1e-25"):
            first = mp.findroot(lambda s, u=u, t=t: motion(away, t, -u, s)[0], u / away)
            height = -motion(away, t, -u, first)[1]
            guess = mp.sqrt(2 * height / push)
            second = mp.findroot(lambda s, t=t + first, h=height: motion(push, t, mp.mpf(0), s)[1] - h, guess)
            u = r * motion(push, t + first, mp.mpf(0), second)[0]
            t += first + second
        return t


@pytest.mark.parametrize(("r", "push", "away"), [(0.5, 1.0, 1.0), (0.3, 0.7, 1.3), (0.8, 0.2, 1.9), (0.9, 1.7, 2.0)])
@pytest.mark.parametrize(("loss", "rate"), [(0.3, 0.0), (0.0, -0.4), (0.2, 0.7)])
def test_duration_is_right_to_second_order(r, push, away, loss, rate):
    """What is left falls with the cube of the speed."""
    missed = []
    for v in (1e-4, 1e-5):
        first, second = slowed(r, v, push, away, loss, rate)
        exact = flights(r, v, push, away, loss, rate)
        assert abs(float(first - exact)) < 100.0 * v * float(exact)
        missed.append(abs(float(second - exact)))
    assert missed[1] <= 1.3e-3 * missed[0] + 1e-19


@pytest.mark.parametrize("r", [0.2, 0.5, 0.9])
def test_a_mass_that_rubs_comes_to_rest_on_a_wall(r):
    """Pushed by P: flights begin under P + mu and end under P - mu; the speeds fall by r sqrt((P - mu)/(P + mu))."""
    P, mu, v = 0.8, 0.3, 0.4
    system = bf.System(1.0, 0.0, 0.0, [ConstantForce(P), RigidStop(gap=1.0, restitution=r), Coulomb(mu)])
    motion = bf.simulate(system, (1.0 - v**2 / (2 * (P - mu)), 0.0), duration=30.0)
    chatter = [event for event in motion.events if event.kind == "chatter"]
    rho = r * np.sqrt((P - mu) / (P + mu))
    end = v / (P - mu) + r * v / (1 - rho) * (1 / (P + mu) + 1 / np.sqrt((P - mu) * (P + mu)))
    assert len(chatter) == 1
    assert chatter[0].end == pytest.approx(end, abs=1e-10)
    np.testing.assert_allclose(motion.final, [1.0, 0.0], rtol=0, atol=1e-14)


def test_where_friction_holds_against_the_push_there_is_no_sequence():
    """P < mu: after the impact the mass stops at the top of its flight and stays there."""
    P, mu, v, r = 0.3, 0.5, 0.4, 0.6
    system = bf.System(1.0, 0.0, 0.0, [ConstantForce(P), RigidStop(gap=1.0, restitution=r), Coulomb(mu)])
    motion = bf.simulate(system, (0.9, v), duration=30.0)
    assert [str(event.kind) for event in motion.events] == ["impact", "stick"]
    arriving = v**2 - 2 * (mu - P) * 0.1
    np.testing.assert_allclose(motion.final, [1.0 - r**2 * arriving / (2 * (P + mu)), 0.0], rtol=0, atol=1e-14)


def test_flights_in_the_rounding_of_the_position_are_not_listed():
    """The push falls to the limit of friction: the nearer, the more slowly the flights come back, until none is seen."""
    system = bf.System(1.0, 0.0288, 1.0, [HarmonicForce(1.0), RigidStop(0.161, 0.4281), Coulomb(0.0283)], omega=0.651)
    motion = bf.simulate(system, (-0.5, 0.0), periods=30)
    speeds = [event.speed for event in motion.events if event.kind == "impact"]
    assert len(speeds) > 100 and min(speeds) > 8e-9  # (r v)^2 / 2 away = 4 roundings of .3
