"""Nearness to orbits and boxes of samples, against plain loops."""
from types import SimpleNamespace

import numpy as np

from bifurc.ensemble import scalar
from bifurc.ensemble.outcomes import CROWDED, REACHED, UNSETTLED
from bifurc.ensemble.proximity import box_of, boxed, boxes, nearest
from bifurc.flow.scan import DONE, LIMIT
from tests.reference.plain import plain


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


def labelled(script, stay=3, arrival=None, most=12):
    """Return label, state and period of a start that is seen in boxes of these attractors, one a period (-1: in none); at
    ``arrival`` it is near number 7."""
    period = [0]

    def integrate(T, ints, floats, x, k, *others):
        period[0] = k
        return DONE if k <= len(script) else LIMIT
    follow = plain(scalar.label, workspace=lambda T: (np.zeros(40, np.int64), np.zeros(4)), started=lambda *_: True,
                   integrate=integrate, recall=lambda *_: None, nearest=lambda *_: 7 if period[0] == arrival else -1,
                   boxed=lambda *_: script[period[0] - 1])
    cells = tuple(np.full(1, -9, kind) for kind in (np.int64, np.int64, np.int64, np.int64, float))
    targets = (np.ones(2), np.empty((0, 2)), np.empty(0), np.empty(0), 0.1, np.zeros(1, np.uint64), np.zeros(1, np.int64), stay)
    follow(SimpleNamespace(A=np.zeros((1, 2, 5))), np.zeros((1, 0, 5)), None, np.zeros(1, np.int64), np.zeros((1, 2)), 100, most,
           targets, cells)
    return cells[0][0], cells[3][0], cells[1][0]


def test_a_start_belongs_to_the_attractor_in_whose_boxes_it_stays():
    """Several periods one after the other in boxes of one attractor: neither here and there, nor with periods in none between."""
    assert labelled([0, 0, 0]) == (0, REACHED, 3) and labelled([4] * 5, stay=5) == (4, REACHED, 5)
    assert labelled([-1, -1, 2, 2, 2, 2]) == (2, REACHED, 5)
    for script in ([0, 1] * 6, [0, 0, 1] * 4, [0, 0, -1] * 4, [0, 1, 2] * 4, [-1] * 12):
        assert labelled(script) == (-1, UNSETTLED, 12)
    for script in ([0, 1, 1, 1, 1], [0, 0, -1, 1, 1, 1], [2, 0, 2, 1, 1, 1, 1]):
        label, state, period = labelled(script)
        assert (label, state) == (1, REACHED) and script[period - 3:period] == [1, 1, 1]
    assert labelled([0, 0, 0], arrival=2) == (7, REACHED, 2)  # near it is enough
    assert labelled([0, 0]) == (-1, CROWDED, 3)  # too many events in the third period
