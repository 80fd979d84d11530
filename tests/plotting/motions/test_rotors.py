"""Pictures of rotors: full spectra against a transform of their own, section points, stators."""
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf


def motion(z, span, **more):
    """Return a fake motion with the path z(t), and what a picture asks of one."""
    def sample(n):
        t = np.linspace(0.0, span, n)
        return t, np.column_stack([z(t).real, z(t).imag, 0.0 * t, 0.0 * t])
    return SimpleNamespace(sample=sample, system=SimpleNamespace(omega=2.0), **{"periodic": False, **more})


def test_forward_and_backward_lines_have_their_amplitudes():
    omega = 2.0
    orbit = motion(lambda t: 0.7 * np.exp(1j * omega * t) + 0.3j * np.exp(-2j * omega * t) + 0.1, 2.0 * np.pi / omega,
                   periodic=True)
    frequency, amplitude = bf.plotting.full_spectrum(orbit)
    lines = dict(zip(np.round(2.0 * np.pi * frequency / omega).astype(int).tolist(), amplitude.tolist(), strict=True))
    assert abs(lines[1] - 0.7) < 1e-13 and abs(lines[-2] - 0.3) < 1e-13 and abs(lines[0] - 0.1) < 1e-13
    assert max(value for line, value in lines.items() if line not in (1, -2, 0)) < 1e-13


def test_a_simulated_motion_is_windowed():
    free = motion(lambda t: np.exp(1j * 3.3 * t), 100.0)
    frequency, amplitude = bf.plotting.full_spectrum(free)
    top = int(np.argmax(amplitude))
    assert abs(2.0 * np.pi * frequency[top] - 3.3) < 2.0 * np.pi / 100.0 and 0.8 < amplitude[top] < 1.01
    assert amplitude[frequency < -0.2].max() < 1e-4


@pytest.fixture(scope="module")
def rub():
    return bf.find_orbit(bf.systems.jeffcott_rotor(nu=1.04))


def test_the_spectrum_of_a_rub_orbit_is_that_of_its_path(rub):
    t = np.arange(512) * rub.period / 512
    y = bf.simulate(rub.system, rub.state, periods=1)(t)
    known = np.abs(np.fft.fft(y[:, 0] + 1j * y[:, 1])) / 512
    frequency, amplitude = bf.plotting.full_spectrum(rub)
    order = np.round(frequency * rub.period).astype(int)
    for k in range(-5, 6):
        assert abs(amplitude[order == k][0] - known[k]) < 1e-5  # both alias the corners of a force that begins in an instant
    assert np.sum(amplitude**2) == pytest.approx(np.mean(np.sum(rub.sample(4097)[1][:-1, :2]**2, axis=1)), rel=1e-12)  # Parseval
    ax = bf.plotting.plot_full_spectrum(rub)
    assert ax.get_xlim() == (-5.0, 5.0)


def test_section_points_are_marked(rub):
    plane, _ = rub.plot()
    dots = [line for line in plane.lines if line.get_marker() == "."]
    assert len(dots) == 1 and np.abs(np.ravel(dots[0].get_data()) - rub.state[:2]).max() < 1e-12
    plane, _ = bf.simulate(rub.system, rub.state, periods=5).plot()
    (dots,) = [line for line in plane.lines if line.get_marker() == "."]
    assert len(dots.get_xdata()) == 6 and np.abs(dots.get_xdata() - rub.state[0]).max() < 1e-3
    assert len(plane.patches) == 2  # the stator and its clearance
