"""Branches of motions that a preload presses into an elastic stop: where the contact opens, from either side, under one name."""
import numpy as np
import pytest
import scipy.optimize

import bifurc as bf
from bifurc.elements import ElasticStop, HarmonicForce, Jenkins

K, GAP, FORCE, C = 4.0, -0.3, 0.02, 0.1
MASS = [[1.6685, 0.0783, -0.0089], [0.0783, 1.2556, -0.0174], [-0.0089, -0.0174, 1.2745]]
DAMPING = [[0.3139, -0.083, -0.0004], [-0.083, 0.3319, -0.1899], [-0.0004, -0.1899, 0.2942]]
STIFFNESS = [[2.3851, -0.8629, 0.0], [-0.8629, 2.7492, -1.8863], [0.0, -1.8863, 2.3645]]


def opens(low, high):
    """Return the frequency at which the linear motion on the stop, about its equilibrium, is as large as this is deep."""
    def beyond(omega):
        return FORCE / abs(1.0 + K - omega**2 + 1j * C * omega) + GAP / (1.0 + K)
    return scipy.optimize.brentq(beyond, low, high, xtol=1e-16, rtol=1e-15)


@pytest.mark.parametrize("start", [1.5, 2.6, 2.8])
@pytest.mark.parametrize("harmonics", [5, 31])
def test_a_pressed_contact_opens_where_the_linear_motion_says_within_the_stated_error(start, harmonics):
    system = bf.System(1.0, C, 1.0, [HarmonicForce(FORCE), ElasticStop(GAP, K)], omega=start)
    orbit = bf.find_orbit(system, method=bf.HarmonicBalance(harmonics))
    branch = bf.trace(orbit, "omega", bounds=(1.5, 2.9))
    assert [str(reason) for reason in branch.stop_reason] == ["bound", "bound"]
    found = sorted(branch.special_points.of("grazing"), key=lambda point: point.parameter)
    for point, true in zip(found, (opens(2.1, 2.23), opens(2.25, 2.5)), strict=True):
        assert abs(point.parameter - true) <= point.error + 4e-16 * true
        assert point.error <= 1e-11


def pressed(omega):
    """Return three masses, two of them pressed together on a stop, which their motion opens once or twice a period."""
    return bf.System(MASS, DAMPING, STIFFNESS, [HarmonicForce(1.62, dof=1), ElasticStop(-0.103, 2.11, row=(-1.0, 1.0, 0.0))],
                     omega=omega)


@pytest.mark.parametrize(("low", "high"), [(0.97, 1.133), (0.927, 1.133), (0.83, 1.23)])
def test_a_window_of_further_events_is_entered_and_left_where_the_exact_branch_says(low, high):
    """At both of its ends the contact opens once a period, between them twice; some steps are longer than that."""
    exact = bf.find_orbit(pressed(1.03))
    truth = [p.parameter for p in bf.trace(exact, "omega", bounds=(1.03, 1.133)).special_points]
    balance = bf.find_orbit(pressed(1.03), exact, method=bf.HarmonicBalance(41))
    branch = bf.trace(balance, "omega", bounds=(low, high))
    assert [str(reason) for reason in branch.stop_reason] == ["bound", "bound"] and branch.audit.ok
    points = [p for p in branch.special_points if 1.03 < p.parameter < 1.133]
    assert [str(p.kind) for p in points] == ["grazing", "grazing"] and len(truth) == 2
    assert np.allclose([p.parameter for p in points], truth, rtol=0.0, atol=2e-7)  # truncation: error of the balance is 5e-7
    inside = (branch.column("omega") > truth[0] + 1e-6) & (branch.column("omega") < truth[1] - 1e-6)
    assert set(branch.column("n_events")[inside].tolist()) <= {4}


def test_a_load_that_lets_go_is_a_separation_in_both_methods():
    """The normal load 1 + a cos is zero first at a = 1: that is no surface in space."""
    system = bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.0), Jenkins(1.0, 0.3, load_amplitude=0.8)], omega=0.8)
    exact = bf.find_orbit(system)
    for orbit in (exact, bf.find_orbit(system, exact, method=bf.HarmonicBalance(21))):
        branch = bf.trace(orbit, "jenkins.load_amplitude", bounds=(0.8, 1.1))
        (point,) = branch.special_points
        assert str(point.kind) == "separation" and abs(point.parameter - 1.0) <= point.error + 4e-16
