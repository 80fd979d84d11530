"""Whether the bouncing of a mass ends before its stop would let it go, bounce by bounce in mpmath.

x'' + 2 zeta x' + x = force cos(omega t),   x <= 0,   v+ = -r v-; it starts at rest at the release, force cos(omega t) = 0 falling.
Every flight is solved with the exact flow.  No limit of the sequence is used: the times left to the next release fall by a constant
ratio while a motion is near the boundary, and leave that to one side or the other.
"""
from mpmath import mp, mpf

SOONER, LATER = mpf("0.55"), mpf("0.72")  # ratios of times left that only motions to one side of the boundary have, r = .3 to .6
WARM = 4  # bounces after which the ratio counts
BOUNCES = 70


def completes(zeta, omega, force, restitution, digits=40) -> bool:
    """Return whether the mass comes to rest before its release, one period after the last."""
    saved = mp.dps
    mp.dps = digits
    try:
        zeta, omega, force, r = (mpf(value) for value in (zeta, omega, force, restitution))
        wd = mp.sqrt(1 - zeta**2)
        steady = force / mp.mpc(1 - omega**2, 2 * zeta * omega)
        start = mp.acos(mpf(0)) / omega
        end = start + 2 * mp.pi / omega

        def flow(t, v, s):
            """Displacement and speed a time s after leaving the stop at t with v."""
            at, then = steady * mp.expj(omega * t), steady * mp.expj(omega * (t + s))
            c, d = -at.real, v - (1j * omega * at).real
            decay, cos, sin = mp.exp(-zeta * s), mp.cos(wd * s), mp.sin(wd * s)
            return (decay * (c * cos + (d + zeta * c) / wd * sin) + then.real,
                    decay * (d * cos - (c + zeta * d) / wd * sin) + (1j * omega * then).real)

        t, v, left = start, mpf(0), end - start
        for bounce in range(BOUNCES):
            step = left / 100
            s = step
            while flow(t, v, s)[0] < 0:
                s += step
                if s >= left:
                    return False
            low, high = s - step, s
            if low == 0:  # shorter than a step: nearly ballistic
                s = -2 * v / (force * mp.cos(omega * t))
            else:
                for _ in range(12):
                    s = (low + high) / 2
                    low, high = (s, high) if flow(t, v, s)[0] < 0 else (low, s)
            for _ in range(8):  # Newton's method for displacement / time, whose zero at the start is gone
                x, w = flow(t, v, s)
                s -= x / (w - x / s)
            w = flow(t, v, s)[1]
            t, v = t + s, -r * w
            before, left = left, end - t
            if left <= 0:
                return False
            if bounce > WARM and not SOONER < left / before < LATER:
                return left / before >= LATER
        raise ArithmeticError("too near to the boundary to tell")
    finally:
        mp.dps = saved
