"""Gains of feedback and of Ott, Grebogi and Yorke's control in other units, coordinates and from the other side."""
import numpy as np
import pytest

import bifurc as bf
from bifurc import elements as el
from tests.reference.images import IMAGES, in_units, pair
from tests.reference.impacting_orbit import impacting

UNITS = {"small": (1e-2, 1e1, 1e2), "large": (1e5, 1e-3, 1e-2)}
PAIR = pair(el.HarmonicForce(0.9, dof=1), el.RigidStop(0.2, 0.8, dof=1), el.RigidStop(0.2, 0.8, side=-1, dof=1), omega=1.6)


@pytest.fixture(scope="module")
def orbit():
    return impacting()


def carried(orbit, image):
    found = bf.find_orbit(image.system, image.state(orbit.state), periods=orbit.periods)
    assert found.success
    return found


@pytest.fixture(scope="module")
def gains(orbit):
    return bf.control.feedback_range(orbit, "displacement", (-0.1, 0.2), samples=9)


@pytest.mark.parametrize("units", [*UNITS, "opposite"])
def test_ranges_of_gains_have_the_unit_of_a_stiffness(orbit, gains, units):
    image = IMAGES[units](orbit.system) if units == "opposite" else in_units(orbit.system, *UNITS[units])
    _, time, mass = UNITS.get(units, (1.0, 1.0, 1.0))
    gain, own = mass / time**2, gains
    found = bf.control.feedback_range(carried(orbit, image), "displacement", (-0.1 * gain, 0.2 * gain), samples=9)
    assert found.status == own.status and len(found.ends) == len(own.ends) > 0
    assert [end.kind for end in found.ends] == [end.kind for end in own.ends]
    assert np.allclose([end.gain / gain for end in found.ends], [end.gain for end in own.ends], rtol=1e-9)
    assert np.allclose([end.multiplier for end in found.ends], [end.multiplier for end in own.ends], atol=1e-8)
    assert np.allclose(np.array(found.intervals) / gain, own.intervals, rtol=1e-9)


@pytest.mark.parametrize("parameter", ["amplitude", "gap", "omega", "restitution"])
@pytest.mark.parametrize("method", ["ogy", "deadbeat"])
@pytest.mark.parametrize("units", UNITS)
def test_gains_of_control_have_the_unit_of_their_parameter(orbit, units, method, parameter):
    """Sensitivities are states per parameter, gains parameters per state; multipliers are numbers."""
    image = in_units(orbit.system, *UNITS[units])
    full = next(name for name in image.system.parameters if name.endswith(parameter))
    factor = image.factor(full)
    own = bf.control.ogy(orbit, parameter, section=0.3, method=method)
    found = bf.control.ogy(carried(orbit, image), full, section=0.3, method=method)
    back = np.linalg.inv(image.matrix)
    assert np.allclose(back @ found.state, own.state, rtol=1e-10)
    assert np.allclose(back @ found.monodromy @ image.matrix, own.monodromy, rtol=1e-8, atol=1e-9)
    size = np.abs(own.sensitivity).max()
    assert np.abs(back @ found.sensitivity * factor - own.sensitivity).max() < 1e-9 * size
    assert np.abs(found.gain @ image.matrix / factor - own.gain).max() < 1e-9 * np.abs(own.gain).max()
    assert np.allclose(np.sort_complex(found.closed_loop), np.sort_complex(own.closed_loop), atol=1e-6)


@pytest.mark.parametrize("parameter", ["amplitude", "gap", "omega", "restitution"])
def test_sensitivities_are_differences_of_simulations(orbit, parameter):
    """States a period later, by a change of the parameter at the section."""
    controller = bf.control.ogy(orbit, parameter, section=0.0)
    value = orbit.system.parameter(parameter)
    h = 1e-6 * value
    changed = [orbit.system.with_parameters(**{parameter: value + side * h}) for side in (1.0, -1.0)]
    ends = [bf.simulate(system, controller.state, periods=orbit.periods).final for system in changed]
    seen = (ends[0] - ends[1]) / (2.0 * h)
    assert np.allclose(controller.sensitivity, seen, rtol=1e-5, atol=1e-6 * np.abs(seen).max())
    closed = np.linalg.eigvals(controller.monodromy - np.outer(controller.sensitivity, controller.gain))
    assert np.allclose(np.sort(np.abs(closed)), np.sort(np.abs(controller.closed_loop)), atol=1e-9)


@pytest.mark.parametrize("image", ["reversed", "turned", "opposite"])
def test_multipliers_under_feedback_know_no_coordinates(image):
    """The row that is measured and pushed is another one in other coordinates."""
    orbit = bf.find_orbit(PAIR)
    assert orbit.success
    image = IMAGES[image](PAIR)
    found = carried(orbit, image)
    row = np.linalg.solve(image.matrix[:2, :2].T, [1.0, 0.4])
    for gain in (-0.2, 0.15):
        a = bf.control.controlled_multipliers(orbit, "displacement", gain, row=(1.0, 0.4), least=0.3)
        b = bf.control.controlled_multipliers(found, "displacement", gain, row=tuple(row), least=0.3)
        k = min(len(a), len(b), 4)
        assert np.allclose(np.sort(np.abs(a))[-k:], np.sort(np.abs(b))[-k:], rtol=1e-8)
