"""Sustained contact with a rigid stator is a periodic orbit without events: against the sliding equation on the wall."""
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import bifurc as bf


def on_the_wall(angle, rate, duration, *, zeta, nu, eccentricity, friction, disk_radius, offset, restitution=0.0, gravity=0.0):
    """Return angle and rate after a time from phase 0, and the least normal force on the way: phi'' = f_t - mu N sgn(slip)."""
    def forces(t, y):
        n, s = np.array([np.cos(y[0]), np.sin(y[0])]), np.array([-np.sin(y[0]), np.cos(y[0])])
        z, v = n + [offset, 0.0], y[1] * s
        f = eccentricity * nu**2 * np.array([np.cos(nu * t), np.sin(nu * t)]) - 2.0 * zeta * v - z - [0.0, gravity]
        return f @ s, f @ n + y[1]**2

    def field(t, y):
        along, normal = forces(t, y)
        return [y[1], along - friction * normal * np.sign(y[1] + disk_radius * nu)]

    found = solve_ivp(field, (0.0, duration), (angle, rate), method="DOP853", rtol=3e-14, atol=1e-14, dense_output=True)
    least = min(forces(t, found.sol(t))[1] for t in np.linspace(0.0, duration, 400))
    return found.y[:, -1], least


@pytest.mark.parametrize("nu", [1.45, 1.7])
def test_sustained_contact_closes_on_the_wall(nu):
    system = bf.systems.rigid_stator_rotor(nu=nu)
    start = None if nu == 1.45 else bf.simulate(system, (0.5, 0.0, 0.0, 0.0), periods=150).final
    orbit = bf.find_orbit(system, guess=start)
    assert orbit.success and orbit.stable and not orbit.events and orbit.periods == 1
    x, y, u, v = orbit.state - [0.5, 0.0, 0.0, 0.0]
    assert abs(np.hypot(x, y) - 1.0) < 1e-12 and abs(x * u + y * v) < 1e-12
    angle, rate = np.arctan2(y, x), x * v - y * u
    (end, last), least = on_the_wall(angle, rate, orbit.period, **system.parameters)
    turned = (end - angle) / (2.0 * np.pi)
    assert least > 0.0 and abs(turned - round(turned)) < 1e-10 and abs(last - rate) < 1e-10
    h, M = 1e-6, np.empty((2, 2))
    for k in range(2):
        ends = [on_the_wall(*(np.array([angle, rate]) + sign * h * np.eye(2)[k]), orbit.period, **system.parameters)[0]
                for sign in (1, -1)]
        M[:, k] = (ends[0] - ends[1]) / (2.0 * h)
    ours = orbit.multipliers[:2]
    assert np.abs(np.sort_complex(np.linalg.eigvals(M)) - np.sort_complex(ours)).max() < 1e-7
    assert np.abs(orbit.multipliers[2:]).max(initial=0.0) < 1e-12  # what the wall holds is forgotten


@pytest.mark.parametrize("nu, eccentricity, friction", [(2.0, 0.3, 0.1), (1.5, 0.5, 0.05)])
def test_exponents_of_a_rotor_that_slides_on_the_wall_are_those_of_its_phase(nu, eccentricity, friction):
    # all round the wall psi = angle of the load - angle of the rotor is constant (Zhang 2008, section 4.3)
    zeta = 0.1
    system = bf.systems.rigid_stator_rotor(zeta=zeta, nu=nu, eccentricity=eccentricity, friction=friction, offset=0.0)
    load = eccentricity * nu**2
    psi = np.arctan(friction) + np.arcsin((2.0 * zeta * nu + friction * (nu**2 - 1.0)) / (load * np.sqrt(1.0 + friction**2)))
    assert nu**2 - 1.0 + load * np.cos(psi) > 0.0
    z = np.exp(-1j * psi)
    v = 1j * nu * z
    found = bf.lyapunov_exponents(system, (z.real, z.imag, v.real, v.imag), periods=40, transient=4, batches=4)
    decay = np.roots([1.0, 2.0 * zeta + 2.0 * friction * nu, load * (np.cos(psi) + friction * np.sin(psi))]).real
    assert found.values[:2].sum() == pytest.approx(decay.sum(), rel=1e-8)  # a pair turns: each alone only on the average
    assert (found.values[2:] == -np.inf).all() and found.sum_rule == -np.inf  # what the wall holds is forgotten
