"""The bilinear oscillator: orbits by shooting cut at the crossings of its kink, in mpmath.

    x'' + 2 zeta x' + x + (ratio - 1) max(x - gap, 0) = force cos(omega t)

Unknowns are (entry time, entry velocity, exit time, exit velocity) of each contact; both pieces are closed form.  The
monodromy is the product of their matrix exponentials, det M = exp(-2 zeta T).
"""
from dataclasses import dataclass

from mpmath import matrix, mp, mpf

from .one_stop import roots_of
from .oscillator import Oscillator, highest, number


@dataclass(frozen=True)
class ContactOrbit:
    """One contact a period: entry and exit times, velocities, monodromy, multipliers, admissibility."""

    entry: object
    entry_speed: object
    exit: object
    exit_speed: object
    multipliers: tuple
    trace: object
    det: object
    admissible: bool
    free_margin: object


def pieces(zeta, omega, force, gap, ratio):
    """The two linear oscillators: apart and in contact."""
    apart = Oscillator(zeta, omega, force)
    gap, ratio = number(gap), number(ratio)
    return apart, apart.with_(stiffness=ratio, constant=(ratio - 1) * gap)


def equations(zeta, omega, force, gap, ratio, unknowns, periods=1):
    """Residuals of the closed orbit with k contacts; unknowns (entry, its speed, exit, its speed) for each, in order."""
    apart, contact = pieces(zeta, omega, force, gap, ratio)
    gap, rows = number(gap), []
    for i in range(0, len(unknowns), 4):
        t0, v0, t1, v1 = unknowns[i:i + 4]
        last = i + 4 == len(unknowns)
        after, speed = (unknowns[0] + periods * apart.period, unknowns[1]) if last else (unknowns[i + 4], unknowns[i + 5])
        x, v = contact.flow(t0, gap, v0, t1)
        y, w = apart.flow(t1, gap, v1, after)
        rows += [x - gap, v - v1, y - gap, w - speed]
    return tuple(rows)


def monodromy(zeta, omega, force, gap, ratio, unknowns, periods=1):
    """Trace and determinant of the map over the period of the orbit."""
    apart, contact = pieces(zeta, omega, force, gap, ratio)
    m = mp.eye(2)
    for i in range(0, len(unknowns), 4):
        t0, t1 = unknowns[i], unknowns[i + 2]
        after = unknowns[0] + periods * apart.period if i + 4 == len(unknowns) else unknowns[i + 4]
        for motion, span in ((contact, t1 - t0), (apart, after - t1)):
            e11, e12, e21, e22 = motion.homogeneous(span)
            m = matrix([[e11, e12], [e21, e22]]) * m
    return m[0, 0] + m[1, 1], mp.exp(-2 * apart.zeta * periods * apart.period)


def orbit(zeta, omega, force, gap, ratio, guess):
    """Refine an orbit from guess = (entry time, entry velocity, exit time, exit velocity)."""
    solution = mp.findroot(lambda *u: equations(zeta, omega, force, gap, ratio, u), [number(g) for g in guess],
                           tol=mpf(10) ** (-2 * mp.dps + 14), maxsteps=40)
    u = [solution[i] for i in range(4)]
    apart, contact = pieces(zeta, omega, force, gap, ratio)
    trace, det = monodromy(zeta, omega, force, gap, ratio, u)
    top = highest(apart, u[2], number(gap), u[3], u[0] + apart.period)[0]
    dip = highest(contact, u[0], number(gap), u[1], u[2], side=-1)[0]
    good = u[1] > 0 > u[3] and u[0] < u[2] < u[0] + apart.period and top < number(gap) and -dip > number(gap)
    return ContactOrbit(*u, roots_of(trace, det), trace, det, bool(good), number(gap) - top)


def special_point(kind, zeta, force, gap, ratio, guess, periods=1):
    """Fold ('fold') or flip ('period_doubling') in omega; guess = (omega, then entry, speed, exit, speed of each contact)."""
    sign = {"fold": -1, "period_doubling": 1}[kind]

    def system(w, *u):
        trace, det = monodromy(zeta, w, force, gap, ratio, u, periods)
        return *equations(zeta, w, force, gap, ratio, u, periods), 1 + sign * trace + det

    solution = mp.findroot(system, [number(g) for g in guess], tol=mpf(10) ** (-2 * mp.dps + 14), maxsteps=40)
    return solution[0], [solution[i] for i in range(1, len(guess))]


def grazing(zeta, force, gap, ratio, guess):
    """Omega at which a further maximum touches the spring.

    guess = (omega, time of the touch, then (entry, speed, exit, speed) of each contact, the touch after the last one).
    """
    def system(w, touch, *u):
        apart, _ = pieces(zeta, w, force, gap, ratio)
        x, v = apart.flow(u[-2], number(gap), u[-1], touch)
        return *equations(zeta, w, force, gap, ratio, u), x - number(gap), v

    solution = mp.findroot(system, [number(g) for g in guess], tol=mpf(10) ** (-2 * mp.dps + 14), maxsteps=40)
    return solution[0], [solution[i] for i in range(1, len(guess))]
