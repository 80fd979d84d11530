"""What intervals cover and what they leave open, against a look at many single values."""
import numpy as np

from bifurc.atlases.stability import gaps, layers


def test_gaps_and_layers_agree_with_every_single_value(rng):
    """Intervals that nest, touch, overlap, reach beyond the range, or fold over: at each value those that hold it are counted."""
    for _ in range(200):
        low, high = 0.0, 1.0
        ends = np.sort(rng.integers(-3, 14, (rng.integers(0, 7), 2)) / 10.0, axis=1)
        ends = ends[ends[:, 1] > ends[:, 0]]
        intervals = [(float(a), float(b), int(number)) for (a, b), number in zip(ends, rng.integers(0, 3, len(ends)), strict=True)]
        values = rng.uniform(low, high, 300)
        true = [tuple(sorted(number for a, b, number in intervals if a <= value <= b)) for value in values]
        left = gaps([(a, b) for a, b, _ in intervals], low, high)
        assert [any(a < value < b for a, b in left) for value in values] == [not numbers for numbers in true]
        assert all(low <= a < b <= high for a, b in left)
        assert all(before[1] < after[0] for before, after in zip(left, left[1:], strict=False))
        found = layers(intervals, low, high)
        assert found[0][0] == low and found[-1][1] == high
        assert all(before[1] == after[0] and before[2] != after[2] for before, after in zip(found, found[1:], strict=False))
        assert [next(numbers for a, b, numbers in found if a <= value <= b) for value in values] == true


def test_an_interval_within_another_leaves_no_gap():
    assert gaps([(0.1, 0.9), (0.2, 0.3)], 0.0, 1.0) == [(0.0, 0.1), (0.9, 1.0)]
    assert gaps([(-1.0, 2.0), (0.2, 0.3)], 0.0, 1.0) == []
    assert gaps([], 0.0, 1.0) == [(0.0, 1.0)]
