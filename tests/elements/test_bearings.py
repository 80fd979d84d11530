"""Force of the oil film against the pressure integrated, closed forms of the static journal, and thresholds of its stability."""
import mpmath as mp
import numpy as np
import pytest
from scipy.optimize import brentq

from bifurc.elements.bearings import film, film_slope

NODES, WEIGHTS = np.polynomial.legendre.leggauss(600)


def pressure(x, y, xs, ys):
    """Return the force by quadrature over the half of the film that presses."""
    a, b = x - 2.0 * ys, y + 2.0 * xs
    end = np.arctan2(b, a)  # N = rho sin(theta - end) is negative in the half turn before

    theta = end + 0.5 * np.pi * (NODES - 1.0)
    n = a * np.sin(theta) - b * np.cos(theta)
    part = np.pi * WEIGHTS * n / (1.0 - x * np.cos(theta) - y * np.sin(theta)) ** 3
    return np.array([part @ np.cos(theta), part @ np.sin(theta)])


@pytest.mark.parametrize("eccentricity", [0.0, 1e-6, 0.2, 0.5, 0.8, 0.95, 0.99, 0.999])
def test_force_against_quadrature(eccentricity):
    rng = np.random.default_rng(7)
    for angle, xs, ys in rng.uniform((0.0, -0.5, -0.5), (2.0 * np.pi, 0.5, 0.5), (40, 3)):
        at = (eccentricity * np.cos(angle), eccentricity * np.sin(angle), xs, ys)
        force = np.array(film(*at, 1.0))
        assert np.abs(force - pressure(*at)).max() < 1e-11 * np.hypot(*force)


def long_film(x, y, xs, ys):
    """Return the force as numbers of mpmath, in the closed form of Zhang (2008), 4.5, written without arctangents of quotients."""
    a, b = x - 2 * ys, y + 2 * xs
    rho, q = mp.sqrt(a * a + b * b), 1 - x * x - y * y
    k, c = (x * b - y * a) / rho, -(x * a + y * b) / rho
    G = 2 / mp.sqrt(q) * (mp.pi / 2 + mp.atan(k / mp.sqrt(q)))
    V, S = (2 + k * G) / q, c / (1 - c * c)
    return -(3 * x * rho * V + b * G + 2 * a * S) / q, -(3 * y * rho * V - a * G + 2 * b * S) / q


@pytest.mark.parametrize("e", [0.3, 0.9, 0.99, 0.999, 0.9999])
def test_nothing_cancels_in_a_thin_film(e):
    rng, h = np.random.default_rng(1), mp.mpf(10) ** -15
    for angle, xs, ys in rng.uniform((0.0, -0.5, -0.5), (2.0 * np.pi, 0.5, 0.5), (60, 3)):
        at = (e * np.cos(angle), e * np.sin(angle), xs, ys)
        with mp.workdps(40):
            known = np.array([float(part) for part in long_film(*map(mp.mpf, at))])
            slope = np.empty((2, 4))
            for i in range(4):
                ends = [long_film(*(mp.mpf(value) + (sign * h if i == j else 0) for j, value in enumerate(at))) for sign in (1, -1)]
                slope[:, i] = [float((one - other) / (2 * h)) for one, other in zip(*ends, strict=True)]
        # the film as thin as 1 - e^2 is known to the rounding of 1: the force is its power -5/2, the slope -7/2
        noise = 2e-13 + 40.0 * 2.2e-16 / (1.0 - e * e)
        assert np.abs(np.array(film(*at, 1.0)) - known).max() < noise * np.hypot(*known)
        assert np.abs(np.reshape(film_slope(*at, 1.0), (2, 4)) - slope).max() < noise * np.abs(slope).max()


def test_derivatives_against_differences():
    rng = np.random.default_rng(3)
    for e, angle, xs, ys in rng.uniform((0.05, 0.0, -0.4, -0.4), (0.9, 6.0, 0.4, 0.4), (20, 4)):
        at = np.array([e * np.cos(angle), e * np.sin(angle), xs, ys])
        slope = np.reshape(film_slope(*at, 2.0), (2, 4))
        for k in range(4):
            h = np.zeros(4)
            h[k] = 1e-4 * (1.0 - e)

            def f(m, at=at, h=h):
                return np.array(film(*(at + m * h), 2.0))

            found = (45.0 * (f(1) - f(-1)) - 9.0 * (f(2) - f(-2)) + f(3) - f(-3)) / (60.0 * h[k])
            assert np.abs(found - slope[:, k]).max() < 1e-8 * np.abs(slope).max()


@pytest.mark.parametrize("e", [1e-8, 0.1, 0.4, 0.9, 0.999])
def test_static_force(e):
    against, across = film(e, 0.0, 0.0, 0.0, 1.0)
    assert against == pytest.approx(-4.0 * e**2 / (1.0 - e**2) ** 2, rel=1e-12)
    assert across == pytest.approx(np.pi * e / (1.0 - e**2) ** 1.5, rel=1e-12)


def test_no_force_at_exact_half_speed_whirl():
    assert film(0.3, 0.4, -0.2, 0.15, 1.0) == (0.0, 0.0)
    # the force has a corner there: the slope is the mean of those on opposite sides
    at, slope = np.array([0.3, 0.4, -0.2, 0.15]), np.reshape(film_slope(0.3, 0.4, -0.2, 0.15, 1.0), (2, 4))
    for move in 1e-6 * np.random.default_rng(2).normal(size=(20, 4)):
        odd = 0.5 * (np.array(film(*(at + move), 1.0)) - film(*(at - move), 1.0))
        assert np.abs(odd - slope @ move).max() < 1e-4 * np.abs(odd).max()


def test_outside_the_clearance_there_is_no_film():
    assert np.isnan(film(0.8, 0.7, 0.0, 0.0, 1.0)).all() and np.isnan(film_slope(0.8, 0.7, 0.0, 0.0, 1.0)).all()


def rest(load):
    """Return eccentricity, position of the journal under a load downwards."""
    def left(e):
        return np.hypot(4.0 * e**2 / (1.0 - e**2) ** 2, np.pi * e / (1.0 - e**2) ** 1.5) - load
    e = brentq(left, 1e-9, 1.0 - 1e-9, xtol=1e-15, rtol=1e-15)
    angle = 0.5 * np.pi - np.arctan2(np.pi * e / (1.0 - e**2) ** 1.5, -4.0 * e**2 / (1.0 - e**2) ** 2)
    return e, np.array([e * np.cos(angle), e * np.sin(angle)])


@pytest.mark.parametrize(("load", "eccentricity", "critical", "whirl"), [
    (0.1, 0.0317568729725, 0.762643991573977, 0.500305512), (2.0, 0.414795689696, 12.8936782078841, 0.523591257),
    (10.0, 0.704790370650, 140.649741962245, 0.332915700)])
def test_threshold_of_the_rigid_journal(load, eccentricity, critical, whirl):
    e, at = rest(load)
    assert abs(e - eccentricity) < 1e-12
    slope = np.reshape(film_slope(*at, 0.0, 0.0, 1.0), (2, 4))
    (kxx, kxy), (kyx, kyy) = -slope[:, :2]
    (cxx, cxy), (cyx, cyy) = -slope[:, 2:]
    k = (kxx * cyy + kyy * cxx - kxy * cyx - kyx * cxy) / (cxx + cyy)
    square = ((kxx - k) * (kyy - k) - kxy * kyx) / (cxx * cyy - cxy * cyx)
    assert k / square == pytest.approx(critical, rel=2e-13)
    assert np.sqrt(square) == pytest.approx(whirl, rel=2e-9)
