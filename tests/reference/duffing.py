"""Folds of the Duffing oscillator by harmonic balance of high order in mpmath.

    x'' + 2 zeta x' + alpha x + beta x**3 = force cos(omega t)

Odd harmonics only; the cube is an exact convolution of complex coefficients.  The branch is
parametrised by one coefficient s; a fold is a zero of d omega / d s.
"""
from mpmath import matrix, mp, mpf

from .oscillator import number


def cube(c):
    """Coefficients of x**3 for x = sum over odd h of c[h] e^{i h theta}; c maps h to coefficient, both signs."""
    square = {}
    for h, a in c.items():
        for k, b in c.items():
            square[h + k] = square.get(h + k, 0) + a * b
    result = {}
    for h in c:
        result[h] = sum(a * c[h - k] for k, a in square.items() if (h - k) in c)
    return result, square


def unpack(u, harmonics):
    """Complex two-sided coefficients from the real vector (re, im) per odd harmonic."""
    c = {}
    for i, h in enumerate(harmonics):
        c[h] = mp.mpc(u[2 * i], u[2 * i + 1])
        c[-h] = mp.conj(c[h])
    return c


def residual(u, omega, zeta, force, alpha, beta, harmonics):
    """Residual and its Jacobians by u and omega."""
    c = unpack(u, harmonics)
    third, square = cube(c)
    size = 2 * len(harmonics)
    f, jac, by_omega = matrix(size, 1), matrix(size, size), matrix(size, 1)
    for i, h in enumerate(harmonics):
        z = mp.mpc(alpha - (h * omega) ** 2, 2 * zeta * h * omega)
        dz = mp.mpc(-2 * h * h * omega, 2 * zeta * h)
        value = z * c[h] + beta * third[h] - (force / 2 if h == 1 else 0)
        f[2 * i], f[2 * i + 1] = value.real, value.imag
        slope = dz * c[h]
        by_omega[2 * i], by_omega[2 * i + 1] = slope.real, slope.imag
        for j, k in enumerate(harmonics):
            plus = 3 * beta * square.get(h - k, 0) + (z if h == k else 0)  # derivative by c[k]
            minus = 3 * beta * square.get(h + k, 0)  # derivative by conj(c[k])
            real, imag = plus + minus, mp.mpc(0, 1) * (plus - minus)
            jac[2 * i, 2 * j], jac[2 * i + 1, 2 * j] = real.real, real.imag
            jac[2 * i, 2 * j + 1], jac[2 * i + 1, 2 * j + 1] = imag.real, imag.imag
    return f, jac, by_omega


def response(omega, zeta, force, alpha, beta, count, start):
    """Newton at a fixed omega from a start vector (padded with zeros)."""
    harmonics = [2 * i + 1 for i in range(count)]
    u = matrix(2 * count, 1)
    for i in range(min(len(start), 2 * count)):
        u[i] = start[i]
    for _ in range(60):
        f, jac, _ = residual(u, omega, zeta, force, alpha, beta, harmonics)
        step = mp.lu_solve(jac, f)
        u = u - step
        if mp.norm(step) < mpf(10) ** (-mp.dps + 8):
            return u
    raise RuntimeError("no response found")


def at_coordinate(index, value, omega, zeta, force, alpha, beta, u, harmonics):
    """Newton on (u, omega) with u[index] = value; returns u, omega and d omega / d u[index] along the branch."""
    size = 2 * len(harmonics)
    u = u.copy()
    for _ in range(60):
        f, jac, by_omega = residual(u, omega, zeta, force, alpha, beta, harmonics)
        big, right = matrix(size + 1, size + 1), matrix(size + 1, 2)
        for a in range(size):
            for b in range(size):
                big[a, b] = jac[a, b]
            big[a, size] = by_omega[a]
            right[a, 0] = -f[a]
        big[size, index] = 1
        right[size, 0] = value - u[index]
        step = mp.lu_solve(big, right[:, 0])
        for a in range(size):
            u[a] += step[a]
        omega += step[size]
        if mp.norm(step) < mpf(10) ** (-mp.dps + 8):
            right[size, 1] = 1
            return u, omega, mp.lu_solve(big, right[:, 1])[size]
    raise RuntimeError("no point of the branch found")


def fold(zeta, force, alpha, beta, omega, start, count=16, index=0):
    """Fold in omega near a guess: zero of d omega / d u[index] along the branch; returns (omega, coefficients)."""
    zeta, force, alpha, beta, omega = (number(z) for z in (zeta, force, alpha, beta, omega))
    harmonics = [2 * i + 1 for i in range(count)]
    u = matrix(2 * count, 1)
    for i in range(min(len(start), 2 * count)):
        u[i] = number(start[i])
    s0 = u[index]
    s1 = s0 * (1 + mpf(10) ** -3)
    u, omega, g0 = at_coordinate(index, s0, omega, zeta, force, alpha, beta, u, harmonics)
    u, omega, g1 = at_coordinate(index, s1, omega, zeta, force, alpha, beta, u, harmonics)
    for _ in range(60):
        s0, s1, g0 = s1, s1 - g1 * (s1 - s0) / (g1 - g0), g1
        u, omega, g1 = at_coordinate(index, s1, omega, zeta, force, alpha, beta, u, harmonics)
        if abs(s1 - s0) < mpf(10) ** (-mp.dps // 2 - 1):  # omega is quadratic in s at the fold
            return omega, u
    raise RuntimeError("no fold found")
