"""Rotors in a concentric stator, in the fixed frame: no rub touches the stator all along, and synchronous rub begins there.

Closed forms of Zhang 2008, sections 4.2, 4.3 and 5.3.
"""
import numpy as np
import pytest

import bifurc as bf

SETS = {  # zeta, eccentricity, stiffness, friction; special points in order from below: contact, torus point, fold, contact
    "S1": ((0.05, 0.2, 25.0, 0.1), [("grazing", 0.92518171947481791), ("fold", 3.33844085794), ("grazing", 1.10315703896422111)]),
    "S3": ((0.1, 0.4, 30.0, 0.05), [("grazing", 0.868093813), ("neimark_sacker", 2.84898186863), ("fold", 4.98839393762)]),
}


def radii(orbit, first=0):
    """Radius of the whirl, at forty instants."""
    q = orbit.sample(40)[1]
    return np.hypot(q[:, first], q[:, first + 1])


def missed(radius, nu, zeta, eccentricity, stiffness, friction):
    """By how much a radius is no whirl without rub, or with synchronous rub in an elastic stator."""
    shaft = 1.0 - nu**2 + 2j * zeta * nu
    push = stiffness * max(0.0, radius - 1.0) * (1.0 + 1j * friction)
    return abs(radius * shaft + push) - eccentricity * nu**2


@pytest.mark.parametrize("name", SETS)
def test_synchronous_rub_is_followed_from_no_rub(name):
    (zeta, eccentricity, stiffness, friction), points = SETS[name]
    system = bf.systems.jeffcott_rotor(zeta=zeta, nu=0.8, eccentricity=eccentricity, stiffness=stiffness, friction=friction,
                                       offset=0.0)
    branch = bf.trace(bf.find_orbit(system), "nu", bounds=(0.7, 5.5))
    assert branch.audit.ok and branch.stop_reason == ("bound", "bound")
    found = [(str(p.kind), p.parameter) for p in branch.special_points][:len(points)]
    assert [kind for kind, _ in found] == [kind for kind, _ in points]
    assert np.allclose([p for _, p in found], [p for _, p in points], rtol=0, atol=1e-9)
    for orbit in branch.orbits[::4]:
        radius = radii(orbit)
        assert np.ptp(radius) < 1e-10
        assert abs(missed(radius.mean(), orbit.system.parameters["nu"], zeta, eccentricity, stiffness, friction)) < 1e-9


@pytest.mark.parametrize("nu", [0.8, 1.6])
def test_branches_of_a_stiff_stator_go_on_beyond_contact(nu):
    """Unstable at once where nu > zeta/friction; the number of turns does not matter, the circle touches everywhere."""
    zeta, eccentricity, stiffness, friction = 0.05, 0.2, 400.0, 0.02
    system = bf.systems.jeffcott_rotor(zeta=zeta, nu=nu, eccentricity=eccentricity, stiffness=stiffness, friction=friction,
                                       offset=0.0)
    branch = bf.trace(bf.find_orbit(system), "nu", bounds=(0.7, 1.8))
    assert branch.audit.ok and branch.stop_reason == ("bound", "bound")
    assert str(branch.special_points[0].kind) == "grazing"
    assert branch.special_points[0].parameter == pytest.approx(0.92518171947481791 if nu < 1.0 else 1.10315703896422111, abs=1e-12)
    rub = [orbit for orbit in branch.orbits if radii(orbit).mean() > 1.0 + 1e-9]
    assert len(rub) > 5
    for orbit in rub:
        assert abs(missed(radii(orbit).mean(), orbit.system.parameters["nu"], zeta, eccentricity, stiffness, friction)) < 1e-9


@pytest.mark.parametrize("restitution", [0.0, 0.5])
@pytest.mark.parametrize("friction", [0.02, 0.1])
@pytest.mark.parametrize("nu", [0.8, 1.6])
def test_synchronous_sliding_on_a_rigid_stator(nu, friction, restitution):
    """sin(psi - atan mu) = (2 zeta nu + mu (nu^2 - 1))/(eps nu^2 sqrt(1 + mu^2)), and the reaction pushes."""
    zeta, eccentricity = 0.1, 0.3
    system = bf.systems.rigid_stator_rotor(zeta=zeta, nu=nu, eccentricity=eccentricity, friction=friction, restitution=restitution,
                                           offset=0.0)
    branch = bf.trace(bf.find_orbit(system), "nu", bounds=(0.7, 2.0))
    assert branch.audit.ok and branch.stop_reason == ("bound", "bound")
    (point,) = branch.special_points
    squares = np.roots([1.0 - eccentricity**2, 4.0 * zeta**2 - 2.0, 1.0])
    assert str(point.kind) == "grazing" and np.abs(np.sqrt(squares) - point.parameter).min() <= point.error + 1e-15
    slides = 0
    for orbit in branch.orbits:
        value, y = orbit.system.parameters["nu"], orbit.sample(2)[1][0]
        load = eccentricity * value**2
        if np.hypot(*y[:2]) < 1.0 - 1e-12:
            assert np.hypot(*y[:2]) == pytest.approx(load / abs(1.0 - value**2 + 2j * zeta * value), abs=1e-11)
            continue
        slides += 1
        psi = -np.angle(y[0] + 1j * y[1])
        reaction = value**2 - 1.0 + load * np.cos(psi)
        assert reaction > -1e-9 and np.hypot(*y[:2]) == pytest.approx(1.0, abs=1e-12)
        assert np.sin(psi - np.arctan(friction)) == pytest.approx(
            (2.0 * zeta * value + friction * (value**2 - 1.0)) / (load * np.sqrt(1.0 + friction**2)), abs=1e-10)
    assert slides > 5


def test_synchronous_rub_in_a_casing():
    """|rho (D_r + k (1 + i mu) g) - k (1 + i mu) g| = eps nu^2 of the distance rho, g = 1 + D_r/D_s."""
    zeta, eccentricity, stiffness, friction, mass, damping, spring = 0.0752, 0.235, 136.0, 0.052, 2.07, 2.34, 48.5
    system = bf.systems.rotor_in_casing(zeta=zeta, nu=1.21, eccentricity=eccentricity, stiffness=stiffness, friction=friction,
                                        disk_radius=14.7, casing_mass=mass, casing_damping=damping, casing_stiffness=spring)
    branch = bf.trace(bf.find_orbit(system), "nu", bounds=(0.726, 1.936))
    assert branch.audit.ok and branch.stop_reason == ("bound", "bound") and len(branch.special_points) == 1
    rubs = 0
    for orbit in branch.orbits:
        nu, q = orbit.system.parameters["nu"], orbit.sample(2)[1][0]
        distance = np.hypot(*(q[:2] - q[2:4]))
        shaft, casing = 1.0 - nu**2 + 2j * zeta * nu, spring - mass * nu**2 + 1j * damping * nu
        push = stiffness * (1.0 + 1j * friction) * (1.0 + shaft / casing) * (distance > 1.0)
        assert abs(distance * (shaft + push) - push) == pytest.approx(eccentricity * nu**2, abs=1e-9)
        rubs += distance > 1.0
    assert rubs > 5
