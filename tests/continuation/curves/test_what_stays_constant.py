"""Curves of special points on which a parameter does not change, by a scale invariance: no extremum is made of its rounding."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import BaseMotion, RigidStop


def impact_pair(omega=1.0):
    """A free mass between the walls of a shaken box: time may be counted in periods, so that nothing depends on the frequency."""
    return bf.System(1.0, 0.0, 0.0, [BaseMotion(0.8), RigidStop(0.5, 0.7, side=1), RigidStop(0.5, 0.7, side=-1)], omega=omega)


@pytest.fixture(scope="module")
def pair():
    return bf.trace(bf.find_orbit(impact_pair(), guess=(0.0, 0.3)), "base_motion.amplitude", (0.4, 1.0))


@pytest.fixture(scope="module")
def at_rest_on_its_stop():
    """A stop at the place of rest: all motions are proportional to the load."""
    system = bf.systems.impact_oscillator(zeta=0.05, omega=2.0, amplitude=1.0, gap=0.0, restitution=0.6)
    return bf.trace(bf.find_orbit(system), "omega", (1.8, 3.0))


@pytest.mark.parametrize(("branch", "kind", "other", "bounds"), [
    ("pair", "fold", "omega", (0.5, 2.0)),
    ("pair", "period_doubling", "omega", (0.5, 2.0)),
    ("pair", "grazing", "omega", (0.5, 2.0)),
    ("at_rest_on_its_stop", "period_doubling", "amplitude", (0.5, 2.0))])
def test_a_parameter_that_stands_still_has_no_extrema(branch, kind, other, bounds, request):
    point = request.getfixturevalue(branch).special_points.of(kind)[0]
    own = point.problem.parameter
    curve = bf.trace_curve(point, (own, other), {other: bounds})
    assert [end.reason.value for end in curve.ends] == ["bound", "bound"] and len(curve) < 40
    assert curve.special_points == () and np.ptp(curve.column(other)) == pytest.approx(bounds[1] - bounds[0])
    np.testing.assert_allclose(curve.column(own), point.parameter, rtol=1e-10)


def test_an_extremum_at_the_bottom_of_a_curve_is_still_one():
    """The load at which the free response touches the stop is least at omega = (1 - 2 zeta^2)^(1/2): 2 zeta (1 - zeta^2)^(1/2)."""
    zeta = 0.05
    branch = bf.trace(bf.find_orbit(bf.systems.impact_oscillator(zeta=zeta, omega=0.9, amplitude=0.1)), "amplitude", (0.05, 0.4))
    curve = bf.trace_curve(branch.special_points.of("grazing")[0], ("amplitude", "omega"), {"omega": (0.8, 1.2)})
    turn, = curve.special_points.of("extremum")
    assert turn.name == "amplitude"
    assert turn.parameters["amplitude"] == pytest.approx(2.0 * zeta * np.sqrt(1.0 - zeta**2), rel=1e-12)
    assert turn.parameters["omega"] == pytest.approx(np.sqrt(1.0 - 2.0 * zeta**2), abs=1e-7)
