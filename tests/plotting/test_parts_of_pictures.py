"""Small parts of pictures: stretches drawn again, bands of counts, codes of cells, on numbers written out."""
from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.colors import to_rgb

from bifurc.plotting.atlases import _BAND, _NARROW, _band, _crowded
from bifurc.plotting.basins import cell_codes


@pytest.mark.parametrize("unit, shift", [(1.0, 0.0), (1e-3, 5.0), (1e3, -2.0)])
def test_a_crowd_is_three_short_branches_that_meet(unit, shift):
    bounds = (shift, shift + unit)

    def crowded(*pairs):
        return _crowded(SimpleNamespace(bounds=bounds), [{"from": shift + a * unit, "to": shift + b * unit} for a, b in pairs])

    long, first = (0.0, 1.0), [(0.40, 0.42), (0.41, 0.44), (0.43, 0.45)]
    assert crowded(long) is None and crowded(*first[:2], long) is None
    assert crowded(*first, long) == pytest.approx((shift + (0.4 - 0.006) * unit, shift + (0.45 + 0.006) * unit), rel=1e-9)
    assert crowded(*first[::-1], (0.7, 0.71)) == crowded(*first)
    assert crowded((0.40, 0.41), (0.42, 0.43), (0.44, 0.45)) is None  # they do not meet
    assert crowded((0.40, 0.45), (0.41, 0.42), (0.44, 0.45)) == crowded(*first)  # the longest one comes first
    assert crowded((0.4, 0.4 + 1.1 * _NARROW), *first[1:]) is None  # not short
    more = [(0.80, 0.82), (0.80, 0.81), (0.81, 0.83), (0.82, 0.84)]
    assert crowded(*first, *more) == crowded(*more)
    low, high = crowded((0.0, 0.02), (0.01, 0.03), (0.01, 0.04))
    assert low == bounds[0] and high == pytest.approx(shift + (0.04 + 0.0048) * unit)
    low, high = crowded((0.96, 0.98), (0.97, 1.0), (0.97, 0.99))
    assert high == bounds[1] and low == pytest.approx(shift + (0.96 - 0.0048) * unit)


def test_a_band_shows_how_many_motions_are_known():
    found = SimpleNamespace(bounds=(0.0, 2.0), coexistence=[(0.0, 0.5, [1]), (0.5, 1.5, [1, 2, 3]), (1.5, 1.7, []),
                                                            (1.7, 1.71, [4, 5])],
                            probes=[SimpleNamespace(value=0.3), SimpleNamespace(value=1.2)])
    _, ax = plt.subplots()
    ax.set_ylim(-1.0, 3.0)
    _band(found, ax)
    height = 4.0 * _BAND
    patches = list(ax.patches)
    assert [(p.get_x(), p.get_width()) for p in patches] == [(0.0, 0.5), (0.5, 1.0), (1.7, pytest.approx(0.01))]
    assert all(p.get_y() == pytest.approx(-1.0 - height) and p.get_height() == pytest.approx(height) for p in patches)
    shades = [to_rgb(p.get_facecolor())[0] for p in patches]
    assert shades[0] > shades[2] > shades[1] > 0.0 and shades[0] < 1.0  # darker for more
    assert [(text.get_text(), text.get_position()[0]) for text in ax.texts] == [("1", 0.25), ("3", 1.0)]  # none in a narrow one
    (ticks,) = ax.collections
    assert [segment[0][0] for segment in ticks.get_segments()] == [0.3, 1.2]
    assert all(segment[:, 1].max() == pytest.approx(-1.0 - height) for segment in ticks.get_segments())
    low, high = ax.get_ylim()
    assert high == 3.0 and low < min(segment[:, 1].min() for segment in ticks.get_segments())
    plt.close()


def test_codes_of_cells():
    labels = np.array([[0, 1, -1], [-1, -1, 2]])
    states = np.array([[1, 1, 2], [3, 0, 1]])
    codes, special = cell_codes(SimpleNamespace(labels=labels, states=states))
    np.testing.assert_array_equal(codes, [[3, 4, 1], [2, 0, 5]])
    assert [words for _, _, words, _, _ in special] == ["unresolved", "beyond the stop", "to infinity"]
    assert [share for *_, share, _ in special] == [None, pytest.approx(1.0 / 6.0), None]
    for place, (*_, mine) in enumerate(special):
        np.testing.assert_array_equal(mine, codes == place)
    codes, special = cell_codes(SimpleNamespace(labels=labels, states=None))
    np.testing.assert_array_equal(codes, [[3, 4, 0], [0, 0, 5]])
    assert len(special) == 1
    assert cell_codes(SimpleNamespace(labels=np.zeros((2, 2), int), states=np.ones((2, 2), int)))[1] == []
