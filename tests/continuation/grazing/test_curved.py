"""Grazings of rotors at their stator: the clearance of a disk in a bore is a law, its row in the tables is zero."""
import numpy as np
import pytest
from scipy.linalg import expm

import bifurc as bf

ZETA, OFFSET, FRICTION = 0.05, 0.3, 0.05


def rotor(rigid: bool):
    common = {"zeta": ZETA, "nu": 0.5, "eccentricity": 0.2, "friction": FRICTION, "disk_radius": 20.0, "offset": OFFSET}
    return (bf.systems.rigid_stator_rotor(restitution=0.6, **common) if rigid
            else bf.systems.jeffcott_rotor(stiffness=30.0, **common))


def radius(nu, eccentricity):
    """Whirl of the rotor without contact."""
    return eccentricity * nu**2 / np.hypot(1.0 - nu**2, 2.0 * ZETA * nu)


@pytest.fixture(scope="module", params=[False, True], ids=["elastic", "rigid"])
def grazing(request):
    branch = bf.trace(bf.find_orbit(rotor(request.param)), "nu", bounds=(0.5, 0.95), max_steps=100)
    return request.param, branch.special_points.of("grazing")[0]


def test_a_whirl_grazes_where_it_fills_the_clearance(grazing):
    _, point = grazing
    assert radius(point.parameter, 0.2) == pytest.approx(1.0 - OFFSET, abs=1e-12)
    curve = bf.trace_curve(point, ("nu", "eccentricity"), bounds={"nu": (0.6, 1.2), "eccentricity": (0.05, 0.4)})
    assert len(curve) > 10 and {end.reason for end in curve.ends} == {"bound"}
    assert radius(curve.column("nu"), curve.column("eccentricity")) == pytest.approx(1.0 - OFFSET, abs=1e-11)
    (least,) = curve.special_points.of("extremum")  # of the whirl's amplitude, which has a closed form
    assert least.parameters["nu"] == pytest.approx(1.0 / np.sqrt(1.0 - 2.0 * ZETA**2), abs=1e-7)


def test_the_touch_of_a_curve_is_classified(grazing):
    rigid, point = grazing
    touch = point.grazing.touch
    eye, none = np.eye(2), np.zeros((2, 2))
    E = expm(np.block([[none, eye], [-eye, -2.0 * ZETA * eye]]) * 2.0 * np.pi / point.parameter)
    assert touch.E == pytest.approx(E, abs=1e-11)
    assert touch.apex == pytest.approx(-point.parameter**2 * 0.7 * OFFSET, abs=1e-9)  # of |p - centre| at its top
    inward, along = touch.h[:2], np.array([touch.h[1], -touch.h[0]])
    assert np.linalg.norm(inward) == pytest.approx(1.0, abs=1e-12) and not touch.h[2:].any()
    push = inward - FRICTION * along
    if rigid:
        assert touch.restitution == pytest.approx(0.6, abs=1e-11)
        assert touch.B == pytest.approx(np.concatenate([[0.0, 0.0], push]), abs=1e-11)
        assert point.grazing.verdict == "jump"
    else:
        assert touch.restitution is None
        assert touch.B == pytest.approx(np.concatenate([[0.0, 0.0], 30.0 * push]), abs=1e-7)
        assert point.grazing.verdict == "persistence"
    assert point.grazing.confirmed
