"""Equilibria of rub against stators of any stiffness: closed forms at 40 digits, the rigid limit, and branches of as many rows."""
import mpmath
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import ConstantForce, ElasticStator

ZETA, ECCENTRICITY, FRICTION = 0.1, 0.4, 0.05
STIFFNESSES = (30.0, 1e3, 1e5, 3e7, 1e9, 1e12)


def rotor(stiffness, nu=1.5, **changes):
    given = {"zeta": ZETA, "nu": nu, "eccentricity": ECCENTRICITY, "stiffness": stiffness, "friction": FRICTION}
    return bf.systems.rotating_frame_rotor(**{**given, **changes})


def sliding(stiffness, nu):
    """Return place, load of the wall and eigenvalues of synchronous rub (Zhang 2008, section 4.2), from 40 digits."""
    with mpmath.workdps(40):
        zeta, e, mu, k, nu = (mpmath.mpf(repr(float(value))) for value in (ZETA, ECCENTRICITY, FRICTION, stiffness, nu))
        a, c = 1 - nu**2 + k, 2 * zeta * nu + mu * k
        A, B, C = a * a + c * c, -2 * k * (a + mu * c), k * k * (1 + mu * mu) - (e * nu**2)**2
        r = (-B + mpmath.sqrt(B * B - 4 * A * C)) / (2 * A)
        z = e * nu**2 / (mpmath.mpc(1 - nu**2, 2 * zeta * nu) + k * mpmath.mpc(1, mu) * (1 - 1 / r))
        b, d, w = 1 - nu**2 + k * (1 - 1 / r), 2 * zeta * nu + mu * k * (1 - 1 / r), 2 * zeta
        # (x^2 + w x + a)(x^2 + w x + b) + (2 nu x + d)(2 nu x + c)
        polynomial = [1, 2 * w, a + b + w * w + 4 * nu**2, w * (a + b) + 2 * nu * (d + c), a * b + d * c]
        roots = mpmath.polyroots(polynomial[::-1], maxsteps=200, extraprec=400, asc=True)
        return np.array([float(z.real), float(z.imag)]), float(k * (r - 1)), np.array([complex(root) for root in roots])


@pytest.mark.parametrize("stiffness", STIFFNESSES)
@pytest.mark.parametrize("nu", [1.1, 1.5, 1.9])
def test_rest_in_contact_is_found_from_itself_and_from_near(stiffness, nu):
    place, load, values = sliding(stiffness, nu)
    for guess in (place, 1.01 * place, place + [0.03, -0.05]):  # not inside, where the free rotor may be at rest
        rest = bf.find_equilibrium(rotor(stiffness, nu), guess)
        assert rest.success and rest.contacts["stator"] == "slip+"
        assert np.abs(rest.state[:2] - place).max() < 1e-14 * 30
        assert stiffness * rest.depths[0] == pytest.approx(load, rel=1e-12)
        ours = rest.eigenvalues
        for value in values:  # of a matrix whose entries have the rounding of the stiffness
            assert np.abs(ours - value).min() < 1e-10 * (1.0 + abs(value)) + 2.3e-16 * stiffness


def test_the_rigid_limit():
    nu = 1.5  # Zhang 2008, section 4.3: sin(psi - atan mu) = (2 zeta nu + mu (nu^2 - 1)) / (e nu^2 sqrt(1 + mu^2))
    drag = (2.0 * ZETA * nu + FRICTION * (nu**2 - 1.0)) / (ECCENTRICITY * nu**2 * np.sqrt(1.0 + FRICTION**2))
    psi = np.arcsin(drag) + np.arctan(FRICTION)
    limit, load = np.array([np.cos(psi), -np.sin(psi)]), nu**2 - 1.0 + ECCENTRICITY * nu**2 * np.cos(psi)
    for stiffness in (1e6, 1e9, 1e12):
        rest = bf.find_equilibrium(rotor(stiffness), limit)
        assert np.abs(rest.state[:2] - limit).max() < 3.0 * load / stiffness + 1e-15
        assert stiffness * rest.depths[0] == pytest.approx(load, abs=20.0 / stiffness + 1e-12)


def test_branches_have_as_many_rows_at_any_stiffness():
    counts = []
    for stiffness in (1e3, 1e6, 1e9, 1e12):
        branch = bf.trace(bf.find_equilibrium(rotor(stiffness, 0.8), (0.1, 0.0)), "nu", bounds=(0.5, 3.0))
        assert all(str(end).startswith("bound") for end in branch.ends)
        (boundary,), (hopf,) = branch.special_points.of("boundary_equilibrium"), branch.special_points.of("hopf")
        # nu^4 (1 - e^2) + (4 zeta^2 - 2) nu^2 + 1 = 0: the lower speed at which the free rotor has the radius 1
        half = (2.0 - 4.0 * ZETA**2) / (2.0 * (1.0 - ECCENTRICITY**2))
        assert boundary.parameter == pytest.approx(np.sqrt(half - np.sqrt(half**2 - 1.0 / (1.0 - ECCENTRICITY**2))), abs=1e-12)
        fast = max(sliding(stiffness, hopf.parameter)[2], key=lambda value: value.imag)
        assert abs(fast.real) < 1e-8  # the root that crosses here
        counts.append(len(branch))
        row = int(np.argmin(np.abs(branch.column("nu") - 2.5)))
        place, load, _ = sliding(stiffness, branch.column("nu")[row])
        assert np.abs([branch.column("q_0")[row], branch.column("q_1")[row]] - place).max() < 1e-12
        assert stiffness * branch.orbits[row].depths[0] == pytest.approx(load, rel=1e-10)
    assert max(counts) <= 1.2 * min(counts)


@pytest.mark.parametrize("stiffness", [1e2, 1e6, 1e10])
@pytest.mark.parametrize("radius", [1e-3, 1.0, 1e3])
def test_a_load_that_presses_on_a_ring_without_turning(stiffness, radius):
    # surface at rest and no spring: where friction holds the load it may stand anywhere near, the wall takes its normal part
    load = stiffness * radius * 1e-4
    stator = ElasticStator(radius=radius, stiffness=stiffness, friction=0.3)
    system = bf.System(np.eye(2), np.eye(2), 1e-6 * stiffness * np.eye(2), [ConstantForce(load, dof=0), stator])
    rest = bf.find_equilibrium(system, (radius, 0.0))
    x = (load + stiffness * radius) / (stiffness * (1.0 + 1e-6))
    assert rest.success and rest.contacts[system.labels[1]] == "roll"
    assert rest.state[0] == pytest.approx(x, rel=1e-14) and abs(rest.state[1]) < 1e-14 * radius
    assert stiffness * rest.depths[0] == pytest.approx(load - 1e-6 * stiffness * x, rel=1e-9)


def test_following_in_stiffness():
    start = bf.find_equilibrium(rotor(30.0), sliding(30.0, 1.5)[0])
    branch = bf.trace(start, "stiffness", bounds=(30.0, 1e6))
    for nu_row in (0, len(branch) // 2, len(branch) - 1):
        stiffness = float(branch.column("stiffness")[nu_row])
        place, load, _ = sliding(stiffness, 1.5)
        assert np.abs(branch.orbits[nu_row].state[:2] - place).max() < 1e-12
        assert stiffness * branch.orbits[nu_row].depths[0] == pytest.approx(load, rel=1e-9)
