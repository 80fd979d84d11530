"""One low impact or short contact of an oscillator by root finding in 40 digits: what discontinuity maps approximate.

x'' + 2 zeta x' + x = F cos w t with a stop at x = gap, rigid (r) or a spring k and dashpot c that act beyond it.
"""
import mpmath as mp

mp.mp.dps = 40


def generator(zeta, w, force, gap, k=0, c=0):
    """Matrix of (x, x', cos w t, sin w t, 1)' = L (...)."""
    return mp.matrix([[0, 1, 0, 0, 0], [-(1 + mp.mpf(k)), -(2 * mp.mpf(zeta) + mp.mpf(c)), mp.mpf(force), 0, mp.mpf(k) * gap],
                      [0, 0, 0, -mp.mpf(w), 0], [0, 0, mp.mpf(w), 0, 0], [0, 0, 0, 0, 0]])


def flow(L, y, t, s, w):
    """State (x, v) after the time ``s``, from ``y`` at time ``t``."""
    start = mp.matrix([y[0], y[1], mp.cos(w * t), mp.sin(w * t), 1])
    end = mp.expm(L * s, method="taylor") * start
    return end[0], end[1]


def root(function, guess):
    """Root by the secant rule in all digits."""
    return mp.findroot(function, (guess, guess * (1 + mp.mpf("1e-3")) + mp.mpf("1e-25")), tol=mp.mpf("1e-70"), maxsteps=60)


def zero_time(zeta, w, force, gap, y, t, r=None, k=0, c=0):
    """Return the state at the time ``t`` that continues the motion behind the contact of a free motion with apex (y, t)."""
    y = [mp.mpf(float(value)) for value in y]
    t, w = mp.mpf(float(t)), mp.mpf(w)
    free = generator(zeta, w, force, gap)
    A = mp.mpf(force) * mp.cos(w * t) - 2 * mp.mpf(zeta) * y[1] - y[0]
    u = mp.sqrt(2 * (y[0] - gap) / abs(A))
    back = root(lambda s: flow(free, y, t, s, w)[0] - gap, -u)
    x, v = flow(free, y, t, back, w)
    if r is not None:
        return flow(free, (x, -mp.mpf(r) * v), t + back, -back, w)
    contact = generator(zeta, w, force, gap, k, c)
    span = root(lambda s: (flow(contact, (x, v), t + back, s, w)[0] - gap) / s, 2 * u)
    x, v = flow(contact, (x, v), t + back, span, w)
    return flow(free, (x, v), t + back + span, -back - span, w)


def section(zeta, w, force, gap, y, t, guess, **contact):
    """Return (state, time) where the motion behind the contact, followed freely, has x' = 0, near the time ``t + guess``."""
    after = zero_time(zeta, w, force, gap, y, t, **contact)
    w = mp.mpf(w)
    free = generator(zeta, w, force, gap)
    move = root(lambda s: flow(free, after, mp.mpf(float(t)), s, w)[1], mp.mpf(float(guess)))
    return flow(free, after, mp.mpf(float(t)), move, w), mp.mpf(float(t)) + move
