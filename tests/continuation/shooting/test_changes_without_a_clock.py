"""Orbits without a clock where their event sequence changes: against the equations of motion, integrated by scipy."""
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import bifurc as bf
from bifurc.continuation.kinds import StopReason
from bifurc.elements import ConstantForce, Coulomb, CubicFriction, ElasticStop, RigidStop, Stribeck

BELT, DAMPING = 0.135, 0.0124


def cycle(friction, static, gap, stiffness=0.0, restitution=None):
    """Return the period of stick and slip of a unit mass on a unit spring, from slip to slip.

    ``friction(speed)`` pulls it along while the belt is faster by ``speed``; behind the gap is a spring (``stiffness``) or a rigid
    stop (``restitution``), reached in this test once a period at most.
    """
    slips = static - DAMPING * BELT  # where friction holds no longer
    if slips > gap and restitution is None:
        slips = (slips + stiffness * gap) / (1.0 + stiffness)

    def rates(t, y):
        push = stiffness * max(y[0] - gap, 0.0)
        return y[1], friction(BELT - y[1]) - y[0] - DAMPING * y[1] - push

    def sticks(t, y):
        return y[1] - BELT if t > 1e-3 else -1.0

    def hits(t, y):
        return y[0] - gap

    sticks.terminal = hits.terminal = True
    sticks.direction = hits.direction = 1.0
    time, state = 0.0, (slips, BELT)
    if restitution is not None and slips >= gap:  # carried onto the stop
        slips, state = gap, (gap, -restitution * BELT)
    elif restitution is not None:
        arc = solve_ivp(rates, (0.0, 50.0), state, rtol=1e-12, atol=1e-14, events=[sticks, hits])
        time, state = arc.t[-1], arc.y[:, -1]
        if arc.t_events[1].size:
            state = (gap, -restitution * state[1])
        else:
            return time + (slips - state[0]) / BELT
    arc = solve_ivp(rates, (0.0, 50.0), state, rtol=1e-12, atol=1e-14, events=sticks)
    return time + arc.t[-1] + (slips - arc.y[0, -1]) / BELT


def test_contact_and_slip_change_places():
    """The belt carries a mass against a spring: before its friction gives way, or after."""
    static, gap = 0.644, 0.621
    system = bf.System(1.0, DAMPING, 1.0, [CubicFriction(static, 0.467, 0.286, belt_speed=BELT), ElasticStop(gap, 12.1)])
    branch = bf.trace(bf.find_orbit(system), "cubic_friction.static", bounds=(0.55, 0.68))
    assert [end.reason for end in branch.ends] == [StopReason.BOUND] * 2 and branch.audit.ok
    (change,) = branch.special_points
    assert change.parameter == pytest.approx(gap + DAMPING * BELT, abs=1e-12)
    for value, orbit in zip(branch.column("cubic_friction.static"), branch.orbits, strict=True):
        assert orbit.period == pytest.approx(cycle(lambda s, f=value: f - 0.467 * s + 0.286 * s**3, value, gap, 12.1), rel=1e-8)


def test_slip_begins_just_before_an_impact():
    """Where the stop lies farther away than friction can carry the mass, it slips before it hits: the branch goes on."""
    system = bf.System(1.0, DAMPING, 1.0, [Coulomb(0.4, static_ratio=1.5, belt_speed=BELT), RigidStop(0.57, 0.6)])
    branch = bf.trace(bf.find_orbit(system), "gap", bounds=(0.54, 0.65))
    assert [end.reason for end in branch.ends] == [StopReason.BOUND] * 2 and branch.audit.ok
    onset = branch.special_points[0]
    assert onset.parameter == pytest.approx(0.6 - DAMPING * BELT, abs=1e-12)
    values = branch.column("parameter")
    assert (values > onset.parameter).sum() > 3
    for value, orbit in zip(values, branch.orbits, strict=True):
        assert orbit.period == pytest.approx(cycle(lambda s: 0.4, 0.6, value, restitution=0.6), rel=1e-8), value


@pytest.mark.slow  # compiles the laws
def test_a_leap_of_a_reaction_keeps_two_events_on_one_instant():
    """Where one mass comes to rest on the belt, the force that holds the other moves by a leap: over an interval of the parameter
    it passes its limit there, neither before nor after."""
    M, C = np.array([[1.7591, -0.0074], [-0.0074, 1.2566]]), np.array([[0.0994, -0.0623], [-0.0623, 0.1697]])
    K, belt, static = np.array([[1.7552, -1.1002], [-1.1002, 2.996]]), 0.0992, 0.212
    system = bf.System(M, C, K, [Stribeck(0.162, static, 0.293, curve="hyperbolic", belt_speed=belt),
                                 CubicFriction(0.609, 0.406, 0.358, dof=1, belt_speed=belt)])
    branch = bf.trace(bf.find_orbit(system), "stribeck.static", bounds=(0.2, 0.22))
    assert branch.audit.ok and all(orbit.success for orbit in branch.orbits)
    low, high = sorted(point.parameter for point in branch.special_points if 0.20797 < point.parameter < 0.20799)
    between = system.with_parameters(**{"stribeck.static": 0.5 * (low + high)})
    near = branch.orbits[int(np.argmin(np.abs(branch.column("stribeck.static") - high)))]
    orbit = bf.find_orbit(between, guess=near.state, period=near.period)
    assert orbit.success and [str(event.kind) for event in orbit.events].count("slip") == 1  # of the second mass alone

    at = next(event for event in orbit.events if event.mode_after == ("slip-", "stick"))
    q, v = at.after[:2], at.after[2:]
    pull = K @ q + C @ v
    held = 0.5 * (low + high)

    def reaction(second):
        """Friction that holds the first mass on the belt, with ``second`` on the other, or with that held as well."""
        if second is None:
            return pull[0]  # neither moves against the belt
        return pull[0] + M[0, 1] * (second - pull[1]) / M[1, 1]

    assert v == pytest.approx([belt, belt], abs=1e-9)
    assert reaction(0.609) < held < reaction(None)


@pytest.mark.parametrize("stop", [RigidStop(0.5, 0.6), ElasticStop(0.5, 9.0, damping=1.0)])
def test_a_cycle_shrinks_onto_a_state_of_rest_that_touches_a_contact(stop):
    """x'' - .06 x' + x = 0 beside one stop: all lengths are multiples of the gap.  A force moves the state of rest."""
    cases = ((), "gap", (-0.3, 1.0), 0.0, 1.0), ((ConstantForce(0.2),), "force", (-1.0, 0.7), 0.5, -1.0)
    for loads, name, bounds, at, sign in cases:
        orbit = bf.find_orbit(bf.System(1.0, -0.06, 1.0, [stop, *loads]), guess=(0.2, 0.1))
        branch = bf.trace(orbit, name, bounds=bounds)
        values, period = branch.column("parameter"), branch.column("period")
        (end,) = (end for end in branch.ends if end.reason is not StopReason.BOUND)
        assert end.reason is StopReason.SHRUNK and abs(end.p - at) < 1e-5 and branch.audit.ok
        away = sign * (values - at)
        large = away > 1e-3
        assert period[large] == pytest.approx(orbit.period, rel=1e-9)
        speeds = np.array([np.abs(item.sample(200)[1][:, 1]).max() for item, far in zip(branch.orbits, large, strict=True) if far])
        assert np.ptp(speeds / away[large]) < 1e-6 * speeds[0] / away[large][0]
