"""Complete chatter and sticking on a rigid stop, bounce by bounce in mpmath.

    x'' + 2 zeta x' + x = force cos(omega t),   x <= gap,   v+ = -r v-

Every bounce is located from the surface with the exact flow at raised precision down to impact speeds of 1e-25; what is
left of the complete chattering is closed to second order in q = r v/(a (1 - r)) with a the pressing acceleration,

    t_end = t + 2 q - (4/3) q**2 (zeta + a'/a) + O(q**3).

The mass then rests until the load no longer presses it on the stop: force cos(omega t) = gap on the falling side.
"""
from dataclasses import dataclass

from mpmath import mp, mpf

from .oscillator import Oscillator, first_arrival, number


@dataclass(frozen=True)
class Rest:
    """One stay on the stop: when the bounces have died out, when it ends, and the impacts before it."""

    begin: object
    end: object
    impacts: tuple  # (time, speed before) of the bounces that were computed one by one


def release_time(motion, gap, after=0):
    """First time >= after at which force cos(omega t + phase) falls through gap."""
    angle = mp.acos(number(gap) / motion.force)
    turns = mp.ceil((motion.omega * after + motion.phase - angle) / (2 * mp.pi))
    return (angle + 2 * mp.pi * turns - motion.phase) / motion.omega


def flight_and_chatter(motion, gap, r, t, x, v, t1, surface, tiny=None):
    """March from a state until the mass rests on the stop or t1 comes; returns (Rest or None, impacts, end state).

    ``surface``: the start lies on the stop and moves off it.
    """
    gap, r = number(gap), number(r)
    tiny = mpf(10) ** -25 if tiny is None else tiny
    digits = mp.dps
    impacts = []
    try:
        mp.dps = 2 * digits + 20
        while True:
            press = motion.load(t)[0] - motion.stiffness * gap
            rebound = -v
            if surface and impacts and rebound < mpf(10) ** -3 and press > 30 * rebound:
                flight = 2 * rebound / press  # ballistic; Newton on displacement / time
                for _ in range(60):
                    y, w = motion.flow(t, gap, v, t + flight)
                    value, slope = (y - gap) / flight, w / flight - (y - gap) / flight**2
                    change = value / slope
                    flight -= change
                    if abs(change) < mpf(10) ** -(digits + 10) * flight:
                        break
                hit = t + flight
            else:
                hit = first_arrival(motion, t, x, v, t1, gap, from_surface=surface, smallest=mpf(10) ** -25)
            if hit is None or hit > t1:
                return None, impacts, motion.flow(t, x, v, t1)
            speed = motion.flow(t, x, v, hit)[1]
            impacts.append((hit, speed))
            press, change = motion.load(hit)
            press -= motion.stiffness * gap
            if r == 0 or speed < tiny:
                if press > 0:
                    q = r * speed / (press * (1 - r))
                    begin = hit + 2 * q - mpf(4) / 3 * q**2 * (motion.zeta + change / press)
                    return Rest(begin, release_time(motion, gap, begin), tuple(impacts)), impacts, (gap, mpf(0))
                if r == 0:
                    t, x, v, surface = hit, gap, mpf(0), True
                    continue
            if len(impacts) > 5000:
                raise RuntimeError("more bounces than the reference march is made for")
            t, x, v, surface = hit, gap, -r * speed, True
    finally:
        mp.dps = digits


def sticking_orbit(zeta, omega, force, gap, restitution, turns=40):
    """Periodic orbit with one rest per period or several: from a release until the same release phase comes back.

    Returns (periods, rests): rests as found between the release at t_r in [0, T) and t_r + periods T; or None.
    """
    motion = Oscillator(zeta, omega, force)
    gap, r = number(gap), number(restitution)
    start = release_time(motion, gap)
    end = start + turns * motion.period
    rest, _, _ = flight_and_chatter(motion, gap, r, start, gap, mpf(0), end, True)
    if rest is None:
        return None
    periods = (rest.end - start) / motion.period
    return int(mp.nint(periods)), rest


def remaining(motion, gap, r, t, v):
    """Second-order closure: time from an impact with speed v before it to the end of its complete chattering."""
    press, change = motion.load(t)
    press -= motion.stiffness * gap
    q = r * v / (press * (1 - r))
    return 2 * q - mpf(4) / 3 * q**2 * (motion.zeta + change / press)


def next_speed(motion, gap, r, t, v):
    """One bounce to second order: speed before the next impact and pressing acceleration there."""
    press, change = motion.load(t)
    press -= motion.stiffness * gap
    return (r * v + mpf(2) / 3 * (r * v) ** 2 * (change / press**2 - 2 * motion.zeta / press),
            press + 2 * change * r * v / press)
