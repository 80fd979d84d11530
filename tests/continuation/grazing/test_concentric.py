"""Rotors whose orbit is a circle round the centre of the stator: all of it touches at once, at |z| = 1 in closed form."""
import numpy as np
import pytest

import bifurc as bf

ROTORS = {
    "elastic": lambda **numbers: bf.systems.jeffcott_rotor(offset=0.0, **numbers),
    "rigid": lambda **numbers: bf.systems.rigid_stator_rotor(offset=0.0, **numbers),
    "casing": lambda **numbers: bf.systems.rotor_in_casing(**numbers),
}


def touching(nu, zeta):
    """Eccentricity with which the rotor circles at the distance of the wall."""
    return np.sqrt((1.0 - nu**2)**2 + (2.0 * zeta * nu)**2) / nu**2


def touch_of(kind, zeta=0.06):
    system, e = ROTORS[kind](nu=1.1, eccentricity=0.4 * touching(1.1, zeta), zeta=zeta), touching(1.1, zeta)
    branch = bf.trace(bf.find_orbit(system), "eccentricity", (0.3 * e, 1.05 * e), 1, ds=0.1, max_steps=11)
    point, = branch.special_points.of("grazing")
    return point


@pytest.fixture(scope="module", params=ROTORS)
def grazing(request):
    point = touch_of(request.param)
    assert abs(point.parameter - touching(1.1, 0.06)) <= point.error < 1e-12
    return point


@pytest.mark.parametrize(("second", "bounds"), [("nu", (0.95, 1.15)), ("zeta", (0.02, 0.12))])
def test_the_touch_of_a_whole_circle_is_followed(grazing, second, bounds):
    """No instant is a maximum: nothing is degenerate, and no other maximum touches."""
    curve = bf.trace_curve(grazing, ("eccentricity", second), {second: bounds, "eccentricity": (0.02, 0.3)})
    assert [end.reason.value for end in curve.ends] == ["bound", "bound"]
    numbers = {"nu": 1.1, "zeta": 0.06, second: curve.column(second)}
    np.testing.assert_allclose(curve.column("eccentricity"), touching(**numbers), atol=1e-12)
    assert np.ptp(curve.column(second)) == pytest.approx(bounds[1] - bounds[0])
    turns = [point.parameters["nu"] for point in curve.special_points.of("extremum")]
    assert len(turns) == len(curve.special_points) == (second == "nu")
    assert turns == pytest.approx([1.0 / np.sqrt(1.0 - 2.0 * 0.06**2)] * len(turns), abs=1e-6)


@pytest.mark.parametrize("second", ["offset", "gravity"])
@pytest.mark.parametrize("kind", ["elastic", "rigid"])
def test_what_moves_the_circle_off_the_centre_is_refused_by_name(kind, second):
    with pytest.raises(ValueError, match="the distance to the wall is constant along the orbit") as error:
        bf.trace_curve(touch_of(kind), ("eccentricity", second), {second: (-0.1, 0.1)})
    assert second in str(error.value) and "follow the grazing there" in str(error.value)
