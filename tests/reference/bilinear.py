"""The bilinear oscillator: orbits with one contact a period by shooting cut at the two crossings, in mpmath.

    x'' + 2 zeta x' + x + (ratio - 1) max(x - gap, 0) = force cos(omega t)

Unknowns are (entry time, entry velocity, exit time, exit velocity); both pieces are closed form.  The monodromy is the
product of two matrix exponentials, det M = exp(-2 zeta T).
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


def equations(zeta, omega, force, gap, ratio, unknowns):
    """Four residuals of the closed orbit."""
    apart, contact = pieces(zeta, omega, force, gap, ratio)
    t0, v0, t1, v1 = unknowns
    x, v = contact.flow(t0, number(gap), v0, t1)
    y, w = apart.flow(t1, number(gap), v1, t0 + apart.period)
    return x - number(gap), v - v1, y - number(gap), w - v0


def monodromy(zeta, omega, force, gap, ratio, unknowns):
    """Trace and determinant of the map over one period."""
    apart, contact = pieces(zeta, omega, force, gap, ratio)
    t0, _, t1, _ = unknowns
    a = matrix(2, 2)
    b = matrix(2, 2)
    a[0, 0], a[0, 1], a[1, 0], a[1, 1] = contact.homogeneous(t1 - t0)
    b[0, 0], b[0, 1], b[1, 0], b[1, 1] = apart.homogeneous(t0 + apart.period - t1)
    m = b * a
    return m[0, 0] + m[1, 1], mp.exp(-2 * apart.zeta * apart.period)


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


def special_point(kind, zeta, force, gap, ratio, guess):
    """Fold ('fold') or flip ('period_doubling') in omega; guess = (omega, entry, speed, exit, speed)."""
    sign = {"fold": -1, "period_doubling": 1}[kind]

    def system(w, *u):
        trace, det = monodromy(zeta, w, force, gap, ratio, u)
        return *equations(zeta, w, force, gap, ratio, u), 1 + sign * trace + det

    solution = mp.findroot(system, [number(g) for g in guess], tol=mpf(10) ** (-2 * mp.dps + 14), maxsteps=40)
    return solution[0], [solution[i] for i in range(1, 5)]
