"""A slider whose normal load vanishes for a part of the period: how it slips as it closes and as it opens, by both methods."""
import math

import numpy as np
import pytest
from scipy.optimize import brentq

import bifurc as bf
from bifurc import HarmonicBalance, System
from bifurc.elements import HarmonicForce, Jenkins

OMEGA, DAMPING, STIFFNESS, LIMIT = 0.8, 0.1, 1e-6, 0.5e-6
RECEPTANCE = 1.0 / (1.0 - OMEGA**2 + 1j * DAMPING * OMEGA)


def rates_at_closing(amplitude):
    """Rate of the spring's force less that of the limit over omega, where 1 + amplitude cos(omega t) rises through zero."""
    angle = math.acos(-1.0 / amplitude)
    return STIFFNESS * abs(RECEPTANCE) * abs(math.sin(angle - np.angle(RECEPTANCE))) - LIMIT * math.sqrt(amplitude**2 - 1.0)


def light(amplitude):
    """A slider so light that the motion is that of the oscillator, to a part of 1e-6."""
    return System(1.0, DAMPING, 1.0, (HarmonicForce(1.0), Jenkins(STIFFNESS, LIMIT, load_amplitude=amplitude)), omega=OMEGA)


@pytest.mark.parametrize(("start", "harmonics"), [(0.8, 5), (0.8, 11), (5.0, 5)])
def test_a_light_slider_slips_at_once_where_its_force_grows_faster_than_its_limit(start, harmonics):
    """Between two amplitudes it sticks as it closes; at one end the slip has no duration, at the other the stick."""
    orbit = bf.find_orbit(light(start), method=HarmonicBalance(harmonics))
    branch = bf.trace(orbit, "jenkins.load_amplitude", bounds=(0.8, 5.0))
    assert [str(point.kind) for point in branch.special_points] == ["separation", "slip_onset", "stick_onset"]
    known = [1.0, brentq(rates_at_closing, 1.01, 1.03), brentq(rates_at_closing, 1.03, 2.0)]
    assert [point.parameter for point in branch.special_points] == pytest.approx(known, abs=5e-7)
    assert [str(reason) for reason in branch.stop_reason] == ["bound", "bound"] and branch.audit.ok


def heavy(**changes):
    values = {"limit": 0.3, "load_amplitude": 1.3, **changes}
    return System(1.0, 0.1, 1.0, (HarmonicForce(1.0), Jenkins(1.0, **values)), omega=0.8)


@pytest.mark.parametrize(("system", "name", "bounds"), [
    (heavy(load_amplitude=0.8), "load_amplitude", (0.8, 1.5)), (heavy(), "load_phase", (-3.0, 3.0)),
    (heavy(), "limit", (0.05, 3.0)), (heavy(), "omega", (0.5, 2.5))])
def test_points_are_those_of_shooting(system, name, bounds):
    """Also where the slip before the load vanishes changes its side, or begins there."""
    exact = bf.find_orbit(system)
    parameter = name if name == "omega" else f"jenkins.{name}"
    known = bf.trace(exact, parameter, bounds=bounds)
    branch = bf.trace(bf.find_orbit(system, exact, method=HarmonicBalance(31)), parameter, bounds=bounds)
    assert [str(point.kind) for point in branch.special_points] == [str(point.kind) for point in known.special_points]
    # harmonics up to 31 leave that much of a motion with corners in its second derivative
    assert [p.parameter for p in branch.special_points] == pytest.approx([p.parameter for p in known.special_points], abs=2e-5)
    assert branch.stop_reason == known.stop_reason and branch.audit.ok
