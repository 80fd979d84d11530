"""Whether the bouncing of a mass ends before its stop would let it go, bounce by bounce in mpmath.

x'' + 2 zeta x' + x = force cos(omega t),   x <= 0,   v+ = -r v-; it starts at rest at the release, force cos(omega t) = 0 falling.
Between two stops, |x| <= gap, it starts at rest on one, and must come to rest on the other within half a period (`completes`).
Without a load: two masses, of which the other one has negative damping (`cycle`).  Every flight is solved with the exact flow.  No
limit of the sequence is used: the times left to the next release fall by a constant ratio while a motion is near the boundary, and
leave that to one side or the other.
"""
import numpy as np
from mpmath import mp, mpf

SOONER, LATER = mpf("0.55"), mpf("0.72")  # ratios of times left that only motions to one side of the boundary have, r = .3 to .6
WARM = 4  # bounces after which the ratio counts
BOUNCES = 70


def completes(zeta, omega, force, restitution, digits=40, gap=0) -> bool:
    """Return whether the mass comes to rest before its release, one period after the last; between two stops half a period."""
    saved = mp.dps
    mp.dps = digits
    try:
        zeta, omega, force, r, gap = (mpf(value) for value in (zeta, omega, force, restitution, gap))
        wd = mp.sqrt(1 - zeta**2)
        steady = force / mp.mpc(1 - omega**2, 2 * zeta * omega)
        start = (2 * mp.pi - mp.acos(-gap / force) if gap else mp.acos(mpf(0))) / omega
        end = start + (mp.pi if gap else 2 * mp.pi) / omega
        x0 = -gap

        def flow(t, v, s):
            """Displacement from the stop and speed a time s after leaving x0 at t with v."""
            at, then = steady * mp.expj(omega * t), steady * mp.expj(omega * (t + s))
            c, d = x0 - at.real, v - (1j * omega * at).real
            decay, cos, sin = mp.exp(-zeta * s), mp.cos(wd * s), mp.sin(wd * s)
            return (decay * (c * cos + (d + zeta * c) / wd * sin) + then.real - gap,
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
                s = -2 * v / (force * mp.cos(omega * t) - gap)
            else:
                for _ in range(12):
                    s = (low + high) / 2
                    low, high = (s, high) if flow(t, v, s)[0] < 0 else (low, s)
            for _ in range(8):  # Newton's method for displacement / time, whose zero at the start is gone
                x, w = flow(t, v, s)
                s -= x / (w - x / s)
            w = flow(t, v, s)[1]
            t, v, x0 = t + s, -r * w, gap
            before, left = left, end - t
            if left <= 0:
                return False
            if bounce > WARM and not SOONER < left / before < LATER:
                return left / before >= LATER
        raise ArithmeticError("too near to the boundary to tell")
    finally:
        mp.dps = saved


def cycle(speed, restitution, damping, gap="-0.1", stiffness=1, digits=30):
    """Return (whether the bouncing completes, speed at the next release) of two masses,

        q0'' + .2 q0' + (1 + k) q0 - k q1 = 0,   q1'' - damping q1' + k (q1 - q0) = 0,   q0 <= gap,

    from a release of the first one, at rest on its stop, with the ``speed`` of the second.  The speed is None where it does not
    complete.  The times left are those to the release if the first mass stayed on its stop.
    """
    saved = mp.dps
    mp.dps = digits
    try:
        v1, r, c, gap, k = (mpf(value) for value in (speed, restitution, damping, gap, stiffness))
        A = mp.matrix([[0, 0, 1, 0], [0, 0, 0, 1], [-(1 + k), k, -mpf("0.2"), 0], [k, -k, 0, c]])
        values, V = mp.eig(A)
        W = V**-1
        roots = [(c + sign * mp.sqrt(c * c - 4 * k)) / 2 for sign in (1, -1)]
        at_release = (1 + k) * gap / k

        def flow(y, s):
            """State a time s after y in flight."""
            b = W * y
            return (V * mp.matrix([b[j] * mp.exp(values[j] * s) for j in range(4)])).apply(mp.re)

        def to_release(y):
            """Time to, and speed of the second mass at, the release, with the first one at rest."""
            u, v = y[1] - gap, y[3]
            a = (v - roots[1] * u) / (roots[0] - roots[1])
            parts = ((a, roots[0]), (u - a, roots[1]))

            def motion(s, order):
                return mp.re(sum(weight * root**order * mp.exp(root * s) for weight, root in parts))
            s, level = mpf(0), at_release - gap
            while motion(s + mpf("0.01"), 0) > level:
                s += mpf("0.01")
            for _ in range(9):
                s -= (motion(s, 0) - level) / motion(s, 1)
            return s, motion(s, 1)

        y, left = mp.matrix([gap, at_release, 0, v1]), None
        for bounce in range(4 * BOUNCES):
            a = -(1 + k) * gap + k * y[1] - mpf("0.2") * y[2]
            s = -2 * y[2] / a if bounce > WARM else mpf("0.02")
            if bounce <= WARM:
                while flow(y, s)[0] < gap:
                    s += mpf("0.02")
            for _ in range(9):
                ahead = flow(y, s)
                x = ahead[0] - gap
                s -= x / (ahead[2] - x / s)
            y = flow(y, s)
            y[2] *= -r
            before, (left, end) = left, to_release(y)
            if bounce > WARM and left / before < SOONER:
                return False, None
            if -y[2] < mpf(10)**(6 - digits) * left:
                return True, end
            if left < mpf(10)**(8 - digits):
                raise ArithmeticError("too near to the boundary to tell")
        raise ArithmeticError("too many impacts")
    finally:
        mp.dps = saved


def rests(M, C, K, force, omega, row, gap, restitution, time, state, digits=30) -> bool:
    """Return whether the bouncing of two masses with a stop between them ends with both at rest on it,

        M x'' + C x' + K x = force cos(omega t),   row . x <= gap,

    from the ``state`` (x, x') just before an impact at a ``time``.  It does not where an impact comes at which the stop would no
    longer press the masses together.
    """
    saved = mp.dps
    mp.dps = digits
    try:
        M, C, K = (mp.matrix(np.asarray(matrix, float).tolist()) for matrix in (M, C, K))
        row, force = (mp.matrix(list(values)) for values in (row, force))
        t, r, gap, omega = (mpf(value) for value in (time, restitution, gap, omega))
        inverse = M**-1
        steady = mp.lu_solve(K - omega**2 * M + 1j * omega * C, force)
        A, free = mp.zeros(4), inverse * K
        for i in range(2):
            A[i, 2 + i] = 1
            for j in range(2):
                A[2 + i, j], A[2 + i, 2 + j] = -free[i, j], -(inverse * C)[i, j]
        values, V = mp.eig(A)
        W = V**-1
        push = inverse * row
        push /= (row.T * push)[0]

        def forced(t):
            x = steady * mp.expj(omega * t)
            return mp.matrix([*x, *(1j * omega * x)]).apply(mp.re)

        def flow(y, t, s):
            """State a time s after y at t."""
            b = W * (y - forced(t))
            return (V * mp.matrix([b[j] * mp.exp(values[j] * s) for j in range(4)])).apply(mp.re) + forced(t + s)

        def relative(y):
            """Distance beyond the stop, and its rate."""
            return (row.T * y[:2])[0] - gap, (row.T * y[2:])[0]

        y = mp.matrix([mpf(float(value)) for value in state])
        for _ in range(4 * BOUNCES):
            x, v = relative(y)
            y[:2] = y[:2] - x * push
            y[2:] = y[2:] - (1 + r) * v * push
            v = relative(y)[1]
            load = (row.T * (inverse * (force * mp.cos(omega * t) - K * y[:2] - C * y[2:])))[0]
            if load <= 0:
                return False
            if -v < mpf(10)**(8 - digits):
                return True
            s = -2 * v / load
            for _ in range(12):
                x, w = relative(flow(y, t, s))
                s -= x / (w - x / s)
            y, t = flow(y, t, s), t + s
            if abs(relative(y)[0]) > mpf(10)**(14 - digits):
                return False  # it does not fall back while the stop would press
        raise ArithmeticError("too many impacts")
    finally:
        mp.dps = saved


def rests_beside_friction(M, C, K, force, omega, gap, restitution, friction, time, state, digits=40) -> bool:
    """Return whether the bouncing of the first of two masses ends with it at rest on its stop,

        M x'' + C x' + K x = (force cos(omega t), -friction sign x_1'),   x_0 <= gap,

    from the ``state`` (x, x') just before an impact at a ``time``, while friction holds the second: every impact lets it slip, and
    it sticks again before the next.  It does not where an impact comes at which the load would no longer press the first to its
    stop.
    """
    saved = mp.dps
    mp.dps = digits
    try:
        M, C, K = (mp.matrix(np.asarray(matrix, float).tolist()) for matrix in (M, C, K))
        t, r, gap, omega, force, friction = (mpf(value) for value in (time, restitution, gap, omega, force, friction))
        inverse = M**-1

        def steady(m, c, k, f):
            """Amplitude under f cos(omega t)."""
            return mp.lu_solve(k - omega**2 * m + 1j * omega * c, f)

        def matrix_of(m, c, k):
            """Matrix of the first-order equations, diagonal in its eigenvectors."""
            n, free, damped = m.rows, m**-1 * k, m**-1 * c
            A = mp.zeros(2 * n)
            for i in range(n):
                A[i, n + i] = 1
                for j in range(n):
                    A[n + i, j], A[n + i, n + j] = -free[i, j], -damped[i, j]
            values, V = mp.eig(A)
            return values, V, V**-1

        both, one = (M, C, K), tuple(matrix[:1, :1] for matrix in (M, C, K))
        parts = {2: (matrix_of(*both), steady(*both, mp.matrix([force, 0]))),
                 1: (matrix_of(*one), steady(*one, mp.matrix([force])))}

        def flow(y, t, s, still):
            """State a time s after y at t, about the state of rest ``still``."""
            (values, V, W), amplitude = parts[len(y) // 2]
            at, then = (mp.matrix([*(amplitude * mp.expj(omega * u)), *(1j * omega * amplitude * mp.expj(omega * u))]).apply(mp.re)
                        for u in (t, t + s))
            still = mp.matrix([*still, *[0] * len(still)])
            b = W * (y - at - still)
            return (V * mp.matrix([b[j] * mp.exp(values[j] * s) for j in range(len(y))])).apply(mp.re) + then + still

        y = mp.matrix([mpf(float(value)) for value in state])
        for _ in range(4 * BOUNCES):
            v = y[2]
            y[0], y[3] = gap, mpf(0)
            push = (force * mp.cos(omega * t) - K[0, 0] * gap - K[0, 1] * y[1]) / M[0, 0]
            if push <= 0:
                return False
            if v < mpf(10)**(8 - digits // 2):  # rises as the square of that are known
                return True
            y[2:] = mp.matrix([-r * v, -(1 + r) * v * inverse[1, 0] / inverse[0, 0]])
            turned = mp.sign(y[3])
            still = mp.lu_solve(K, mp.matrix([0, -friction * turned]))
            loss = (inverse * (mp.matrix([force * mp.cos(omega * t), -friction * turned]) - C * y[2:] - K * y[:2]))[1]
            s = -y[3] / loss
            for _ in range(12):
                ahead = flow(y, t, s, still)
                s -= ahead[3] / loss
            y, t = flow(y, t, s, still), t + s
            held = [-K[0, 1] * y[1] / K[0, 0]]
            small = mp.matrix([y[0], y[2]])
            push = (force * mp.cos(omega * t) - K[0, 0] * gap - K[0, 1] * y[1] - C[0, 0] * y[2]) / M[0, 0]
            s = -y[2] / push + mp.re(mp.sqrt((y[2] / push)**2 + 2 * (gap - y[0]) / push))
            for _ in range(12):
                x, w = flow(small, t, s, held)
                s -= (x - gap) / w
            if not (s > 0 and abs(x - gap) < mpf(10)**(14 - digits)):
                return False  # it does not fall back while the load would press it
            small, t = flow(small, t, s, held), t + s
            y = mp.matrix([small[0], y[1], small[1], 0])
        raise ArithmeticError("too many impacts")
    finally:
        mp.dps = saved
