"""Packed coefficients: places, transforms, errors."""
import numpy as np
import pytest

from bifurc.hbm.layout import Layout, listed


def test_order_is_harmonic_major_and_degree_of_freedom_inner():
    layout = Layout((0, 1, 3), 2)
    assert layout.size == 10
    assert layout.place(0, 1) == (1,)
    assert layout.place(1, 0) == (2, 4)
    assert layout.place(3, 1) == (7, 9)


@pytest.mark.parametrize("harmonics", [(0, 1, 2, 3), (1,), (1, 3, 5), (0, 2, 7)])
def test_synthesis_analysis_and_derivative_agree(harmonics, rng):
    layout = Layout(harmonics, 3)
    x = rng.standard_normal(layout.size)
    theta = 2.0 * np.pi * np.arange(32) / 32
    np.testing.assert_allclose(layout.analysis(layout.values(x, theta)), x, atol=1e-14)
    h = 1e-5
    difference = (layout.values(x, theta + h) - layout.values(x, theta - h)) / (2.0 * h)
    np.testing.assert_allclose(layout.values(layout.derivative(x), theta), difference, atol=1e-7)


def test_phasors_are_a_minus_ib():
    layout = Layout((0, 1, 2), 2)
    x = layout.pack({0: [1.0, 2.0], 2: [3.0 - 4.0j, 0.5j]})
    assert layout.phasor(x, 2, 0) == 3.0 - 4.0j
    assert layout.phasor(x, 2, 1) == 0.5j
    assert layout.phasor(x, 0, 1) == 2.0
    assert layout.phasor(x, 5) == 0.0
    theta = np.array([0.3])
    expected = 1.0 + 3.0 * np.cos(0.6) + 4.0 * np.sin(0.6)
    assert layout.values(x, theta)[0, 0] == pytest.approx(expected, abs=1e-15)


def test_moving_between_layouts_keeps_what_both_list(rng):
    small, large = Layout((0, 1, 2), 2), Layout((0, 1, 2, 3, 4), 2)
    x = rng.standard_normal(small.size)
    assert np.array_equal(large.moved(small.moved(x, large), small), x)
    doubled = Layout(tuple(range(9)), 2, periods=2)
    theta = np.linspace(0.0, 2.0 * np.pi, 7)
    np.testing.assert_allclose(doubled.values(small.moved(x, doubled), theta / 2.0), small.values(x, theta), atol=1e-14)


def test_harmonics_are_listed_in_units_of_the_excitation():
    assert listed(3) == (0, 1, 2, 3)
    assert listed(2, periods=2) == (0, 1, 2, 3, 4)
    assert listed([0.5, 1, 3], periods=2) == (1, 2, 6)


@pytest.mark.parametrize("harmonics", [0, -1, [], [1.5], [-1], "seven", None])
def test_bad_harmonics_are_refused(harmonics):
    with pytest.raises(ValueError, match="harmonics"):
        listed(harmonics)


def test_too_few_samples_name_the_need():
    with pytest.raises(ValueError, match="at least 7"):
        Layout((0, 1, 2, 3), 1).analysis(np.zeros(6))


@pytest.mark.parametrize("harmonics", [(0, 1), (0, 1, 2, 3), (1, 3), (0, 5)])
def test_as_many_samples_as_there_are_coefficients_up_to_the_top_are_enough(harmonics, rng):
    layout = Layout(harmonics, 2)
    x, count = rng.standard_normal(layout.size), 2 * harmonics[-1] + 1
    samples = layout.values(x, 2.0 * np.pi * np.arange(count) / count)
    np.testing.assert_allclose(layout.analysis(samples), x, atol=1e-14)
    with pytest.raises(ValueError, match=f"{count - 1} samples are not enough for harmonic {harmonics[-1]}; give at least {count}"):
        layout.analysis(samples[1:])


@pytest.mark.parametrize("harmonics", [(), (0,), (0, 0, 1), (0, 1, 1, 2), (0, 2, 1), (0, -1, 1), (0, 1.5), (0, True)])
def test_a_layout_lists_each_harmonic_once_in_ascending_order(harmonics):
    """Anything else has no one place for a coefficient."""
    with pytest.raises(ValueError, match="harmonics"):
        Layout(harmonics, 2)


@pytest.mark.parametrize("harmonics", [(0, 1, 2, 3), (1, 3, 5), (0, 2, 7), (4,)])
def test_every_coefficient_has_one_place(harmonics):
    """Places of all harmonics and coordinates are 0 .. size - 1, and slots carry the waves that they say."""
    layout = Layout(harmonics, 3)
    places = [place for k in harmonics for dof in range(3) for place in layout.place(k, dof)]
    assert sorted(places) == list(range(layout.size)) and layout.size == layout.slots * 3
    assert layout.top == harmonics[-1] and layout.mean == (harmonics[0] == 0)
    for k in harmonics:
        cosine = layout.slot(k)
        assert layout.waves[cosine] == k and not layout.is_sine[cosine]
        assert k == 0 or (layout.waves[cosine + 1] == k and layout.is_sine[cosine + 1])
    with pytest.raises(KeyError, match="is not listed"):
        layout.slot(6)
