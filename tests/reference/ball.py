"""Ball on a table moving as amplitude cos(omega t): one bounce in n table periods, folds and flips in closed form.

Between bounces x'' = -g; at a bounce the relative velocity u = x' - s' is reversed, u+ = -restitution u-.  A flight of
n T starts with the velocity V = g n T/2 and ends with -V, so the table moves at the bounce with
s' = V (1 - r)/(1 + r); in (time, velocity) the map has trace 1 + r**2 + (1 + r)**2 s''/g and determinant r**2.
(Holmes 1982 treats the high-bounce approximation; this is the exact ball.)
"""
from dataclasses import dataclass

from mpmath import mp

from .one_stop import roots_of
from .oscillator import number


@dataclass(frozen=True)
class BallOrbit:
    """Time of the bounce in [0, T), take-off velocity, approach speed relative to the table, multipliers."""

    time: object
    take_off: object
    approach: object
    multipliers: tuple
    admissible: bool


def orbits(omega, amplitude, restitution, gravity=1, n=1):
    """Both one-bounce orbits of n table periods; the first has the larger table deceleration (cos(omega t) > 0)."""
    w, a, r, g = (number(z) for z in (omega, amplitude, restitution, gravity))
    span = 2 * mp.pi * n / w
    velocity = g * span / 2
    sine = -velocity * (1 - r) / ((1 + r) * a * w)  # of omega t: s' = -a w sin(omega t)
    if abs(sine) > 1:
        return []
    found = []
    for angle in (mp.asin(sine), mp.pi - mp.asin(sine)):
        t = (angle % (2 * mp.pi)) / w
        second = -a * w**2 * mp.cos(angle)
        approach = velocity + velocity * (1 - r) / (1 + r)
        trace, det = 1 + r**2 + (1 + r) ** 2 * second / g, r**2
        found.append(BallOrbit(t, velocity, approach, roots_of(trace, det), _flies(w, a, g, t, velocity, span)))
    return found


def _flies(w, a, g, t0, velocity, span, samples=2000):
    """Whether the ball stays above the table during the flight (dense check; the table's curvature bounds the rest)."""
    start = a * mp.cos(w * t0)
    for i in range(1, samples):
        s = span * i / samples
        if start + velocity * s - g * s**2 / 2 - a * mp.cos(w * (t0 + s)) <= 0:
            return False
    return True


def special_amplitudes(omega, restitution, gravity=1, n=1):
    """Amplitudes of the fold (birth) and of the flip of the one-bounce orbit."""
    w, r, g = number(omega), number(restitution), number(gravity)
    least = g * mp.pi * n / w**2 * (1 - r) / (1 + r)  # amplitude at which |sin| = 1
    flip = mp.hypot(2 * g * (1 + r**2) / (1 + r) ** 2, least * w**2) / w**2
    return {"fold": least, "period_doubling": flip}


def special_frequencies(amplitude, restitution, gravity=1, n=1):
    """The same in omega at a fixed amplitude."""
    one = special_amplitudes(1, restitution, gravity, n)
    return {kind: mp.sqrt(value / number(amplitude)) for kind, value in one.items()}


def zeno_time(height, restitution, gravity=1):
    """Time at which a ball dropped from ``height`` on a still table comes to rest: (first hit)(1 + r)/(1 - r)."""
    h, r, g = number(height), number(restitution), number(gravity)
    return mp.sqrt(2 * h / g) * (1 + r) / (1 - r)
