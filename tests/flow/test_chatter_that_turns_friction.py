"""Complete chattering whose impulses turn a friction of another row: impact by impact in closed form, without springs and damping.

Accelerations are constant between events, so that a flight is two parabolas.  The sliding speed over the speed of impact, x = u/v,
follows a map with an unstable fixed point: on one side of it the friction turns in a few flights and then keeps one direction, on
the other the other one; numbers of reversals change in a geometric sequence towards it, from both sides.
"""
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import ConstantForce, Coulomb, RigidStop

M = np.array([[1.0, 0.3], [0.3, 1.4]])
ROW, SLIDER = np.array([1.0, 0.5]), np.array([1.0, 0.0])
FRICTION, FORCES, RESTITUTION, SPEED = 0.3, (2.0, 0.6), 0.1, 1e-2
SPAN = 0.01
DEEP = 1e-14  # speed of the last impact
ALLOWED = 1e-13  # rounding: speeds of 1e-8 are left out where flights are no higher than that


def system():
    zero = np.zeros((2, 2))
    parts = [ConstantForce(force, dof=dof) for dof, force in enumerate(FORCES)]
    return bf.System(M, zero, zero, [*parts, RigidStop(0.0, RESTITUTION, row=tuple(ROW)), Coulomb(FRICTION, row=tuple(SLIDER))])


def accelerations(sign, held=False):
    """Return those of both masses where the friction slips with a ``sign``, and where the stop is ``held`` as well."""
    f = np.array(FORCES) - sign * FRICTION * SLIDER
    a = np.linalg.solve(M, f)
    if held:
        way = np.linalg.solve(M, ROW)
        a = a - way * (ROW @ a) / (ROW @ way)
    return a


def after(u):
    """Return place and speed (2,) of the slider `SPAN` after an impact with the speed `SPEED` and its own speed ``u``, its
    direction when the impacts end, and the number of reversals in flights.

    Impact by impact, then on the stop, where forces move it on.
    """
    kick = np.linalg.solve(M, ROW) / (ROW @ np.linalg.solve(M, ROW))
    v, t, q, turns = SPEED, 0.0, 0.0, 0
    while v > DEEP:
        u -= (1.0 + RESTITUTION) * v * kick[0]
        w, y = -RESTITUTION * v, 0.0  # speed towards the stop, and place
        a = accelerations(math.copysign(1.0, u))
        flight = -2.0 * w / (ROW @ a)
        if u < 0.0 < u + a[0] * flight:
            s, turns = -u / a[0], turns + 1
            y, w, q, u, t = (w + 0.5 * (ROW @ a) * s) * s, w + (ROW @ a) * s, q + 0.5 * u * s, 0.0, t + s
            a = accelerations(1.0)
            flight = (-w + math.sqrt(w * w - 2.0 * (ROW @ a) * y)) / (ROW @ a)
        q, u, v, t = q + (u + 0.5 * a[0] * flight) * flight, u + a[0] * flight, w + (ROW @ a) * flight, t + flight
    sign = math.copysign(1.0, u)
    for direction in (sign, 1.0):
        a = accelerations(direction, held=True)
        rest = min(SPAN - t, -u / a[0]) if u < 0.0 else SPAN - t
        q, u, t = q + (u + 0.5 * a[0] * rest) * rest, u + a[0] * rest, t + rest
    return np.array([q, u]), sign, turns


def limit():
    """Return the speed from which the friction turns in every flight, as far as numbers tell."""
    low, high = 0.5 * SPEED, 2.0 * SPEED
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if after(middle)[1] < 0.0 else (low, middle)
    return 0.5 * (low + high)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_turns_of_friction_in_the_last_flights_are_part_of_the_motion(side):
    """Down to flights that rounding hides."""
    counts = []
    for away in 10.0**-np.arange(1.0, 9.0, 0.5):
        u = limit() + side * away * SPEED
        motion = bf.simulate(system(), np.array([0.0, 0.0, u, (SPEED - u) / ROW[1]]), duration=SPAN)
        exact, _, turns = after(u)
        assert motion.success
        assert np.abs(motion.final[[0, 2]] - exact).max() < ALLOWED
        counts.append(turns)
    assert counts == sorted(counts) and counts[-1] >= 3  # a motion with ever more of them on the way to the limit
