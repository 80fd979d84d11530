"""The references of dry friction against each other and against numbers computed elsewhere (Den Hartog's closed form)."""
import numpy as np
import pytest

from .coulomb import EventDriven, SlipOnly, interior_limit

STICK = [(1, 0.1, 1.48820269035416898), (0.5, 0.1, 3.94319458595741668), (0.6, 0.05, 2.13308673515489137),
         (0.8, 0, 1.22338168318849024), (0.8, 0.1, 1.52890556878138916), (1, 0.01, 1.29339175750892055),
         (1.2, 0.1, 1.56742747191747650), (2, 0.1, 1.76667041633174530)]


@pytest.mark.parametrize("omega, xi, alpha", STICK)
def test_stick_onset(omega, xi, alpha):
    assert float(SlipOnly(omega, xi, 2 * alpha).alpha_stick) == pytest.approx(alpha, rel=1e-15)


def test_li_amplitude():
    orbit = SlipOnly(1, 0.1, 1.6)
    assert float(orbit.x_max) == pytest.approx(1.62291754679770128, rel=1e-15)
    assert float(orbit.tau_max) == pytest.approx(3.1019211691241545, rel=1e-14)
    assert float(orbit.interior()) < 0.0


def test_interior_limit():
    assert float(interior_limit(0.4, 0.1)) == pytest.approx(9.252, abs=1e-3)
    assert float(interior_limit(0.4, 0)) == pytest.approx(6.950, abs=1e-3)


def test_velocity_coefficients_sum_to_the_velocity():
    orbit = SlipOnly(1, 0.1, 1.6)
    n = np.arange(1, 4001, 2)
    c = orbit.velocity_coefficients(n)
    for tau in (0.3, 1.7, 4.0):
        assert 2 * np.real(np.sum(c * np.exp(1j * n * tau))) == pytest.approx(float(orbit.state(tau)[1]), abs=2e-6)


@pytest.mark.parametrize("parameters, x_max, sticks", [
    (dict(omega=1.0, xi=0.1, alpha=1.6), 1.62291754679770128, 0),
    (dict(omega=1.0, xi=0.1, alpha=1.4), 0.644462527619, 2),
    (dict(omega=1.0, xi=0.1, alpha=1.1), 0.0241585840332, 2),
    (dict(omega=0.06, xi=0.02, alpha=2.0), 1.03199125, 6),
    (dict(omega=1 / 3, xi=0.1, alpha=2.0), 1.61166144684, 2),
    (dict(omega=1.0, xi=0.1, alpha=1.4, down=0.5), 1.96786299137, 0),
    (dict(omega=1.0, xi=0.1, alpha=1.4, load=(1.5, 0.7)), 1.65227279125, 1),
])
def test_event_driven(parameters, x_max, sticks):
    events, _ = EventDriven(**parameters).orbit()
    assert sum(event[3] == "stick" for event in events) == sticks
    top = max(event[1] for event in events)
    assert top == pytest.approx(x_max, rel=2e-9) or parameters.get("load")
