"""Nearness to orbits and boxes of samples, against plain loops."""
import numpy as np

from bifurc.ensemble.proximity import box_of, boxed, boxes, nearest


def test_the_first_point_within_its_own_radius_owns_a_state(rng):
    scale = np.array([2.0, 0.5, 10.0])
    points, radii, owner = rng.uniform(-1.0, 1.0, (30, 3)), rng.uniform(0.05, 0.6, 30), rng.integers(0, 9, 30)
    hits = 0
    for y in rng.uniform(-1.5, 1.5, (400, 3)) * scale:
        inside = np.flatnonzero(np.linalg.norm(y / scale - points, axis=1) <= radii)
        assert nearest(y, 1.0 / scale, points, radii**2, owner) == (owner[inside[0]] if inside.size else -1)
        hits += inside.size > 1
    assert hits > 20


def test_states_in_one_box_have_one_key_and_others_others(rng):
    scale, width = np.array([2.0, 0.5, 10.0]), 0.25
    Y = rng.uniform(-1.5, 1.5, (2000, 3)) * scale
    places = np.floor(Y / scale / width).astype(int)
    keys = np.empty(len(Y), np.uint64)
    boxes(Y, 1.0 / scale, width, keys)
    assert [box_of(y, 1.0 / scale, width) for y in Y[:50]] == keys[:50].tolist()
    by_place = {tuple(place): key for place, key in zip(places.tolist(), keys.tolist(), strict=True)}
    assert all(by_place[tuple(place)] == key for place, key in zip(places.tolist(), keys.tolist(), strict=True))
    assert len(set(by_place.values())) == len(by_place) > 1000


def test_boxes_are_found_among_sorted_keys(rng):
    """The first, the last, those between, and none."""
    scale, width = np.array([1.0, 3.0]), 0.1
    sample = rng.uniform(-1.0, 1.0, (60, 2)) * scale
    keys = np.empty(60, np.uint64)
    boxes(sample, 1.0 / scale, width, keys)
    keys, first = np.unique(keys, return_index=True)
    keepers = rng.integers(0, 5, len(keys))
    places = {tuple(np.floor(sample[i] / scale / width)): keeper for i, keeper in zip(first, keepers, strict=True)}
    for y in [*sample, *rng.uniform(-1.2, 1.2, (300, 2)) * scale]:
        assert boxed(y, 1.0 / scale, width, keys, keepers) == places.get(tuple(np.floor(y / scale / width)), -1)
    assert boxed(sample[0], 1.0 / scale, width, keys[:0], keepers[:0]) == -1
