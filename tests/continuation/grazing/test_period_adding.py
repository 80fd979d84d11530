"""Period adding of the overdamped impact oscillator: five windows of the orbit with one impact in n periods.

x'' + 2 zeta x' + x = F cos w t, x <= 1, zeta 1.25 (roots -1/2, -2), w 2, r .7.  A window reaches from the flip, in closed form,
to the border where the free arc touches the stop a period before its impact (here found in 40 digits).
"""
import mpmath as mp
import numpy as np
import pytest

import bifurc as bf

ZETA, W, R = mp.mpf("1.25"), mp.mpf(2), mp.mpf("0.7")
T = 2 * mp.pi / W


def homogeneous(t):
    slow, fast = mp.e**(-t / 2), mp.e**(-2 * t)
    k = mp.mpf(2) / 3
    return mp.matrix([[k * (2 * slow - fast / 2), k * (slow - fast)], [-k * (slow - fast), k * (2 * fast - slow / 2)]])


def parts(n):
    """Lam, Gam of the ellipse A^2 = (1 - Lam v)^2 + (Gam v / w)^2, and what the flip needs."""
    E = homogeneous(n * T)
    D, trace = mp.det(E), E[0, 0] + E[1, 1]
    below = trace - 1 - D
    lam, gam = (1 + R) * E[0, 1] / below, 1 - (1 + R) * (E[1, 1] - D) / below
    K = -R * trace + (1 + R) * E[0, 1] * (2 * ZETA * gam - (1 - W**2) * lam)
    return lam, gam, E[0, 1], D, K


def excess(n, v):
    """A / sigma - 1 of the orbit with impact speed v."""
    lam, gam = parts(n)[:2]
    return mp.sqrt((1 - lam * v)**2 + (gam * v / W)**2) - 1


def flip(n):
    lam, gam, e12, D, K = parts(n)
    return excess(n, (1 + R) * e12 * W**2 / (K + 1 + R**2 * D))


def border(n):
    """Excess at which the arc behind the impact first touches the stop, a period before the next impact."""
    lam, gam = parts(n)[:2]

    def arc(v, t):
        p = (1 - lam * v, gam * v)  # steady response at the impact: A cos psi, -A w sin psi
        c, s = mp.cos(W * t), mp.sin(W * t)
        steady = (p[0] * c + p[1] / W * s, -p[0] * W * s + p[1] * c)
        h = homogeneous(t) * mp.matrix([1 - p[0], -R * v - p[1]])
        return steady[0] + h[0], steady[1] + h[1]
    rough = mp.mpf("0.33") * mp.mpf("0.0437")**(n - 2)  # excess |Lam| v + v^2 / (2 w^2)
    guess = 2 * W**2 * rough / (abs(lam) * W**2 + mp.sqrt((lam * W**2)**2 + 2 * W**2 * rough))
    v, _ = mp.findroot(lambda v, t: ((arc(v, t)[0] - 1) / v, arc(v, t)[1] / v), (guess, (n - 1) * T + guess / W**2))
    return excess(n, v)


@pytest.fixture(scope="module")
def windows():
    system = bf.systems.impact_oscillator(zeta=1.25, omega=2.0, amplitude=5.0)
    point = bf.trace(bf.find_orbit(system), "amplitude", bounds=(5.0, 6.0)).special_points.of("grazing")[0]
    found = {}
    for orbit in bf.switch_branch(point, n_max=6):
        branch = bf.trace(orbit, "amplitude", bounds=(5.0, 9.0), ds=1e-4)
        touch = branch.special_points.of("grazing")
        doubling = [p.parameter / point.parameter - 1.0 for p in branch.special_points.of("period_doubling") if not p.name]
        ends = [p.parameter / point.parameter - 1.0 for p in touch]
        found[orbit.periods] = (min(doubling), next((e for e in ends if e > 1e-9), None))
    return found


@pytest.mark.parametrize("n", [2, 3, 4, 5, 6])
def test_windows(windows, n):
    mp.mp.dps = 40
    assert windows[n][0] == pytest.approx(float(flip(n)), abs=2e-13, rel=1e-9)
    assert windows[n][1] == pytest.approx(float(border(n)), abs=2e-13, rel=1e-9)


def test_windows_shrink_by_the_square_of_the_leading_multiplier(windows):
    ratios = [windows[n + 1][0] / windows[n][0] for n in (2, 3, 4, 5)]
    np.testing.assert_allclose(ratios, [0.046361, 0.043973, 0.043376, 0.043248], atol=6e-7 / 0.9)
    square = np.exp(-np.pi)
    assert ratios[-1] == pytest.approx(square, rel=0.02) and ratios[-2] == pytest.approx(square, rel=0.02)
    assert windows[2] == pytest.approx((0.0131208, 0.331718), rel=1e-5)
    assert windows[6] == pytest.approx((5.018e-8, 1.2260e-6), rel=1e-4)
