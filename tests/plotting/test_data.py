"""What is drawn is the data: over which axis, how often, between which bounds."""
from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
import pytest

from bifurc import plotting
from bifurc.plotting.basins import draw_sets


@pytest.fixture
def axes():
    figure, axes = plt.subplots(1, 2)
    yield axes
    plt.close(figure)


def lines(ax):
    return [np.column_stack(line.get_data()) for line in ax.get_lines()]


def test_a_backbone_is_amplitude_over_frequency_and_damping_over_amplitude(axes):
    found = SimpleNamespace(omega=np.array([1.0, 1.1, 1.3]), amplitude=np.array([-0.5, -1.0, -2.0]),
                            damping=np.array([0.01, 0.02, 0.0]))
    left, right = plotting.plot_backbone(found, axes)
    np.testing.assert_array_equal(lines(left)[0], [[1.0, 0.5], [1.1, 1.0], [1.3, 2.0]])
    np.testing.assert_array_equal(lines(right)[0], [[0.5, 0.01], [1.0, 0.02], [2.0, 0.0]])
    assert "frequency" in left.get_xlabel() and right.get_xlabel() == left.get_ylabel() == "amplitude"


def test_feedback_is_growth_over_the_gain_with_its_ends(axes):
    ends = (SimpleNamespace(kind="period_doubling", gain=-0.5), SimpleNamespace(kind="other", gain=0.25))
    found = SimpleNamespace(intervals=((-0.5, 0.25),), gains=np.array([-1.0, 0.0, 1.0]), moduli=np.array([1.5, 0.5, 2.0]),
                            ends=ends, best_gain=0.0, best_modulus=0.5, bounds=(-1.0, 1.0), of="velocity")
    ax = plotting.plot_feedback(found, axes[0])
    drawn = lines(ax)
    assert any(np.array_equal(line, [[-1.0, 1.5], [0.0, 0.5], [1.0, 2.0]]) for line in drawn)
    for point in ([-0.5, 1.0], [0.25, 1.0], [0.0, 0.5]):
        assert any(np.array_equal(line, [point]) for line in drawn)
    assert ax.get_xlim() == (-1.0, 1.0) and ax.get_ylim() == pytest.approx((0.0, 2.1)) and "velocity" in ax.get_xlabel()
    found.moduli = np.array([1.5, 0.5, 20.0])
    assert plotting.plot_feedback(found, axes[1]).get_ylim() == (0.0, 3.0)
    words = [text.get_text() for text in ax.get_legend().get_texts()]
    assert "stable" in words and "best gain" in words and "order of impacts" in words


def test_motions_under_control_are_drawn_section_by_section(axes):
    motion = SimpleNamespace(states=np.array([[0.5, 9.0], [0.25, 9.0], [0.125, 9.0]]), corrections=np.array([0.1, -0.2]),
                             parameter="omega")
    upper, lower = plotting.plot_controlled(motion, axes)
    np.testing.assert_array_equal(lines(upper)[0], [[0, 0.5], [1, 0.25], [2, 0.125]])
    np.testing.assert_array_equal(lines(lower)[0], [[0, 0.1], [1, -0.2]])
    assert upper.get_xlim() == lower.get_xlim() == (0.0, 2.0)


@pytest.mark.parametrize(("names", "columns"), [(("q0", "v0"), [0, 2]), (("v1", "q0"), [3, 0]), (("q1", "w0"), [1, 4])])
def test_pieces_of_a_set_are_drawn_apart_over_the_components_of_the_grid(axes, names, columns):
    """Every piece whole, nothing between two of them; an empty set has no entry in the legend."""
    points = np.arange(35.0).reshape(7, 5) ** 1.5
    curves = np.array([0, 0, 0, 2, 3, 3, 3])
    grid, none = SimpleNamespace(names=names), SimpleNamespace(points=np.empty((0, 5)), curves=np.empty(0))
    handles = draw_sets(axes[0], grid, 2, SimpleNamespace(points=points, curves=curves), none)
    (line,) = lines(axes[0])
    gaps = np.isnan(line).any(axis=1)
    pieces = [part[~np.isnan(part).any(axis=1)] for part in np.split(line, np.flatnonzero(gaps))]
    for piece, number in zip(pieces, (0, 2, 3), strict=True):
        np.testing.assert_array_equal(piece, points[curves == number][:, columns])
    assert [words for _, words in handles] == ["unstable set of the saddle"]
    draw_sets(axes[1], grid, 2, None, SimpleNamespace(points=points[:2], curves=np.zeros(2)))
    np.testing.assert_array_equal(lines(axes[1])[0], points[:2][:, columns])
