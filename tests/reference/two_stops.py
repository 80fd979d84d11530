"""Symmetric orbits between two rigid stops |x| <= gap: one impact a side in n forcing periods, n odd, in closed form.

With h = n T/2 and x(t + h) = -x(t), the state y- = (gap, v) before the upper impact and the half flow E = E(h),

    y- - P = -E (R y- - P)   gives   P = y- - (1 + r) v a,   a = (I + E)^-1 E (0, 1),

P(t) being antisymmetric itself for odd n.  Multipliers are those of the half map N = -E S, squared.
"""
from dataclasses import dataclass

from mpmath import mp, mpf

from .one_stop import roots_of
from .oscillator import Oscillator, first_arrival, highest, number


@dataclass(frozen=True)
class SymmetricOrbit:
    """Impact time on the upper stop in [0, n T), speed, multipliers over the full period and of the half map."""

    motion: Oscillator
    gap: object
    restitution: object
    n: int
    time: object
    speed: object
    multipliers: tuple
    half_multipliers: tuple
    admissible: bool


def coefficients(motion, r, n):
    """Return a = (I + E)^-1 E (0, 1) and E over half of n periods."""
    e11, e12, e21, e22 = motion.homogeneous(n * motion.period / 2)
    det = (1 + e11) * (1 + e22) - e12 * e21
    a1 = ((1 + e22) * e12 - e12 * e22) / det
    a2 = (-e21 * e12 + (1 + e11) * e22) / det
    return a1, a2, (e11, e12, e21, e22)


def orbits(zeta, omega, force, gap, restitution, n=1, samples=400):
    """All symmetric orbits with v > 0, by increasing speed."""
    motion, gap, r = Oscillator(zeta, omega, force), number(gap), number(restitution)
    a1, a2, (e11, e12, e21, e22) = coefficients(motion, r, n)
    p, q = -(1 + r) * a1, (1 - (1 + r) * a2) / motion.omega
    a, b, c = p**2 + q**2, 2 * gap * p, gap**2 - motion.amplitude**2
    disc = b**2 - 4 * a * c
    if disc < 0:
        return []
    found = []
    for v in sorted([(-b - mp.sqrt(disc)) / (2 * a), (-b + mp.sqrt(disc)) / (2 * a)]):
        if v <= 0:
            continue
        angle = mp.arg(mp.mpc(gap + p * v, -q * v)) - mp.arg(motion.force * motion.receptance)
        t = (angle % (2 * mp.pi)) / motion.omega
        g = (1 + r) * (motion.load(t)[0] - gap) / v
        trace, det = r * (e11 + e22) - g * e12, r**2 * (e11 * e22 - e12 * e21)
        half = roots_of(trace, det)
        end = t + n * motion.period / 2
        up = highest(motion, t, gap, -r * v, end, samples=samples)[0]
        down = highest(motion, t, gap, -r * v, end, side=-1, samples=samples)[0]
        inside = end - mpf(10) ** -12 * motion.period
        hit = first_arrival(motion, t, gap, -r * v, inside, gap, from_surface=True)
        hit = hit or first_arrival(motion, t, gap, -r * v, inside, -gap, side=-1)
        good = bool(up < gap and down < gap and hit is None)
        found.append(SymmetricOrbit(motion, gap, r, n, t, v, roots_of(trace**2 - 2 * det, det**2), half, good))
    return found


def special_forces(zeta, omega, gap, restitution, n=1):
    """Fold and symmetry-breaking pitchfork of the symmetric branch in the load: dict kind -> (force, speed)."""
    motion, gap, r = Oscillator(zeta, omega, 1), number(gap), number(restitution)
    a1, a2, (e11, e12, e21, e22) = coefficients(motion, r, n)
    w2 = motion.omega**2
    alpha = r * (e11 + e22) - (1 + r) * e12 * (
        -(1 - w2) * (1 + r) * a1 + 2 * motion.zeta * (1 - (1 + r) * a2))
    beta = (1 + r) * e12 * w2 * gap
    det = r**2 * (e11 * e22 - e12 * e21)
    result = {}
    for kind, target in (("fold", 1 + det), ("branch_point", -(1 + det))):
        v = beta / (target - alpha)
        amplitude = mp.hypot(gap - (1 + r) * a1 * v, (1 - (1 + r) * a2) * v / motion.omega)
        result[kind] = (amplitude / abs(motion.receptance), v)
    return result


def asymmetric_orbit(zeta, omega, force, gap, restitution, n, guess):
    """Refine an orbit with one impact a side that need not be symmetric.

    guess = (t_up, v_up, t_down, v_down): time and speed at +gap, then at -gap (speeds positive).
    Returns the refined tuple and the multipliers over the full period.
    """
    motion, gap, r = Oscillator(zeta, omega, force), number(gap), number(restitution)
    span = n * motion.period

    def equations(t0, v0, t1, v1):
        x, v = motion.flow(t0, gap, -r * v0, t1)
        y, w = motion.flow(t1, -gap, r * v1, t0 + span)
        return x + gap, v + v1, y - gap, w - v0

    solution = mp.findroot(equations, [number(g) for g in guess], tol=mpf(10) ** (-2 * mp.dps + 14), maxsteps=40)
    t0, v0, t1, v1 = solution
    m = mp.eye(2)
    for t, v, end, side in ((t0, v0, t1, 1), (t1, -v1, t0 + span, -1)):
        g = (1 + r) * (motion.load(t)[0] - side * gap) / v
        e11, e12, e21, e22 = motion.homogeneous(end - t)
        m = mp.matrix([[e11, e12], [e21, e22]]) * mp.matrix([[-r, 0], [g, -r]]) * m
    return (t0, v0, t1, v1), roots_of(m[0, 0] + m[1, 1], m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0])


def asymmetric_flip(zeta, omega, gap, restitution, n, force, guess):
    """Load at which the asymmetric orbit near ``guess`` doubles its period (multiplier -1)."""
    def test(f):
        solution, (m1, m2) = asymmetric_orbit(zeta, omega, f, gap, restitution, n, guess)
        return ((1 + m1) * (1 + m2)).real

    return mp.findroot(test, (number(force), number(force) * (1 + mpf(10) ** -4)), solver="secant", tol=mpf(10) ** -50)
