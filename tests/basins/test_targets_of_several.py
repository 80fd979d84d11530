"""Boxes of several chaotic attractors, whose hashes lie among each other, are known as those of their own attractor."""
import numpy as np
import pytest

from bifurc.basins.attractors.attractors import SampledAttractor, targets_of
from bifurc.ensemble.proximity import boxes


@pytest.mark.parametrize("covered", [False, True])
@pytest.mark.parametrize("scale", [np.ones(2), np.array([1e-5, 300.0])])
def test_every_box_has_its_owner(scale, covered, rng):
    width, made, own = 0.1, [], []
    for number in range(3):
        cells = np.unique(rng.integers(0, 9, (30, 2)) + [20 * number, 0], axis=0)
        points = (cells + rng.uniform(0.2, 0.8, cells.shape)) * width * scale
        made.append(SampledAttractor(None, points, 1.0, 0.01, width, (cells + 0.5) * width * scale if covered else None))
        keys = np.empty(len(points), np.uint64)
        boxes(points, 1.0 / scale, width, keys)
        own.append(set(keys.tolist()))
    for order in ((0, 1, 2), (2, 0, 1)):
        found = targets_of([made[k] for k in order], np.full(3, 0.01), scale)
        keys, keepers = found[5], found[6]
        assert (np.diff(keys.astype(object)) > 0).all() and len(keys) == sum(map(len, own))
        for place, k in enumerate(order):
            assert set(keys[keepers == place].tolist()) == own[k]
