"""Algebraic problems whose branches and special points are known in closed form."""
import math

import numpy as np

from bifurc.continuation import Monitor, Problem

STEPS = (0.02, 0.1, 0.5)


class Scalar(Problem):
    """One unknown: ``f(u, p)`` with derivatives ``df(u, p) -> (f_u, f_p)``; without ``df`` it is differenced."""

    def __init__(self, f, df, u0, p0, **scales):
        super().__init__(u0, p0, **scales)
        self.f, self.df = f, df

    def residual(self, u, p):
        return np.array([self.f(float(u[0]), p)])

    def jacobian(self, u, p):
        if self.df is None:
            return super().jacobian(u, p)
        fu, fp = self.df(float(u[0]), p)
        return np.array([[fu]]), np.array([fp])


def pitchfork(u0=0.0, p0=-1.0, **scales):
    return Scalar(lambda u, p: u * (p - u * u), lambda u, p: (p - 3 * u * u, u), u0, p0, **scales)


def transcritical(u0=0.0, p0=-1.0, **scales):
    return Scalar(lambda u, p: u * (p - u), lambda u, p: (p - 2 * u, u), u0, p0, **scales)


def parabola(u0=0.0, p0=0.0, delta=1.0, **scales):
    return Scalar(lambda u, p: p + u * u / delta, lambda u, p: (2 * u / delta, 1.0), u0, p0, **scales)


def hysteresis(u_size=1.0, p_size=1.0, differenced=False):
    """u^3 - u - p with u measured in 1 / u_size and p in 1 / p_size."""
    u0 = -1.3247179572447460 * u_size

    def df(u, p):
        return (3 * (u / u_size)**2 - 1) / u_size, -1.0 / p_size
    return Scalar(lambda u, p: (u / u_size)**3 - u / u_size - p / p_size, None if differenced else df, u0, -p_size)


def circle(u0=1.0, p0=0.0, radius=1.0, **scales):
    return Scalar(lambda u, p: u * u + p * p - radius**2, lambda u, p: (2 * u, 2 * p), u0, p0, **scales)


def near_miss(eps):
    return Scalar(lambda u, p: u * u - p * p - eps, lambda u, p: (2 * u, -2 * p), math.sqrt(1 + eps), -1.0)


def close_pair(a):
    return Scalar(lambda u, p: p - u**3 + 3 * a * a * u, lambda u, p: (-3 * u * u + 3 * a * a, 1.0),
                  -1.0, -1 + 3 * a * a)


class Bratu(Problem):
    """u'' + p exp(u) = 0, u(0) = u(1) = 0, second-order differences on ``n`` interior points."""

    def __init__(self, n=99, u0=0.0, p0=0.0):
        super().__init__(np.full(n, u0), p0)
        self.h2 = (n + 1)**2
        self.laplace = (np.diag(np.full(n, -2.0)) + np.diag(np.ones(n - 1), 1) + np.diag(np.ones(n - 1), -1)) * self.h2

    def residual(self, u, p):
        return self.laplace @ u + p * np.exp(u)

    def jacobian(self, u, p):
        e = np.exp(u)
        return self.laplace + np.diag(p * e), e


class Product(Problem):
    """(w - a(p)) (w - b(p)) = eps for the first of n unknowns w in skew coordinates u = Q w; the others follow it."""

    def __init__(self, a, b, eps, n, rng, p0=-1.0):
        self.a, self.b, self.eps = a, b, eps
        self.da, self.db = np.polyder(a), np.polyder(b)
        q, _ = np.linalg.qr(rng.normal(size=(n, n)))
        self.q = q * (1.0 + rng.random(n))
        self.inverse = np.linalg.inv(self.q)
        s, d = np.polyval(a, p0) + np.polyval(b, p0), np.polyval(a, p0) - np.polyval(b, p0)
        w = np.zeros(n)
        w[0] = 0.5 * (s + math.copysign(math.sqrt(d * d + 4 * eps), d))
        for k in range(1, n):
            w[k] = math.sin(w[k - 1]) + 0.3 * p0
        super().__init__(self.q @ w, p0)

    def residual(self, u, p):
        w = self.inverse @ u
        f = np.empty(w.size)
        f[0] = (w[0] - np.polyval(self.a, p)) * (w[0] - np.polyval(self.b, p)) - self.eps
        f[1:] = w[1:] - np.sin(w[:-1]) - 0.3 * p
        return f

    def jacobian(self, u, p):
        w = self.inverse @ u
        va, vb = w[0] - np.polyval(self.a, p), w[0] - np.polyval(self.b, p)
        fu, fp = np.eye(w.size), np.full(w.size, -0.3)
        fu[0, 0], fp[0] = va + vb, -np.polyval(self.da, p) * vb - np.polyval(self.db, p) * va
        for k in range(1, w.size):
            fu[k, k - 1] = -math.cos(w[k - 1])
        return fu @ self.inverse, fp


GRAZE = 0.2
P_GRAZE = (-1.0 + math.sqrt(1.0 + 4.0 * 0.3 * GRAZE)) / 0.6  # p + 0.3 p^2 = GRAZE


class Free(Problem):
    """u = p + 0.3 p^2, valid below u = GRAZE; behind it `Hit` goes on."""

    monitors = (Monitor("grazing", boundary=True),)
    signature = "free"

    def __init__(self, u0, p0, series, **scales):
        super().__init__(u0, p0, **scales)
        self.series = series

    def residual(self, u, p):
        return u - (p + 0.3 * p * p)

    def jacobian(self, u, p):
        return np.eye(1), np.array([-(1.0 + 0.6 * p)])

    def monitor_values(self, u, p, tangent):
        return np.array([u[0] - GRAZE])

    def switch(self, point, monitor):
        other = Hit([GRAZE, 0.0], point.p, self.series, scale_p=self.scale[-1])
        return other, np.array([GRAZE, 0.0, point.p]), np.array([1.0, 1.0, self.series[0]]) / other.scale


class Hit(Problem):
    """u = GRAZE + w + 0.1 w^2, p = P_GRAZE + c1 w + c2 w^2 + c3 w^3, valid for w > 0; a flip at w = 0.3."""

    monitors = (Monitor("grazing", boundary=True), Monitor("period_doubling"))
    signature = "hit"

    def __init__(self, u0, p0, series, **scales):
        super().__init__(u0, p0, **scales)
        self.series = series

    def residual(self, u, p):
        (a, w), (c1, c2, c3) = u, self.series
        return np.array([a - GRAZE - w - 0.1 * w * w, p - P_GRAZE - w * (c1 + w * (c2 + w * c3))])

    def jacobian(self, u, p):
        w, (c1, c2, c3) = u[1], self.series
        return np.array([[1.0, -1.0 - 0.2 * w], [0.0, -c1 - w * (2 * c2 + w * 3 * c3)]]), np.array([0.0, 1.0])

    def monitor_values(self, u, p, tangent):
        return np.array([-u[1], u[1] - 0.3])

    def switch(self, point, monitor):
        other = Free([GRAZE], point.p, self.series, scale_p=self.scale[-1])
        tangent = np.array([-1.0, -1.0 / (1.0 + 0.6 * point.p)]) / other.scale
        return other, np.array([GRAZE, point.p]), tangent
