"""Numbers of a system over two parameters: each has the degree that it needs."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.families import surface


def evaluated(found, first, x, y):
    (low, high), index, series = found
    one = np.polynomial.chebyshev.chebval((2.0 * x - sum(first)) / (first[1] - first[0]), np.moveaxis(series, 1, 0))
    return index, np.polynomial.chebyshev.chebval((2.0 * y - low - high) / (high - low), one.T)


@pytest.mark.parametrize("first, second", [((0.3, 2.0), (0.8, 1.25)), ((0.8, 1.25), (0.3, 2.0)), ((0.4, 3.0), (0.4, 3.0))])
def test_a_pole_near_one_interval_takes_many_degrees_there_only(first, second):
    """1/a needs degree 60 where a polynomial in b needs 2; the reference is the function itself."""
    def sample(a, b):
        return np.array([3.0, -b / a, b * b + a, a * a, np.exp(b), 1.0 / b])

    found = surface(sample, first, second, "b")
    size = np.max([np.abs(sample(x, y)[1:]) for x in first for y in second], axis=0)
    rng = np.random.default_rng(2)
    for x, y in zip(rng.uniform(*first, 40), rng.uniform(*second, 40), strict=True):
        index, values = evaluated(found, first, x, y)
        np.testing.assert_array_equal(index, [1, 2, 3, 4, 5])
        np.testing.assert_allclose(values / size, sample(x, y)[1:] / size, atol=1e-14)


def test_numbers_that_bend_sharply_are_refused():
    with pytest.raises(ValueError, match="no smooth function of both"):
        surface(lambda a, b: np.array([a * abs(b)]), (0.0, 1.0), (-1.0, 1.0), "b")
    with pytest.raises(ValueError, match="no smooth function of both"):
        surface(lambda a, b: np.array([abs(a - b)]), (0.0, 1.0), (0.0, 1.0), "b")


def test_folds_of_a_journal_are_followed_over_its_load():
    """The curve's end is the fold of the branch at that load."""
    film = bf.systems.oil_film_journal()
    branch = bf.trace(bf.find_orbit(film), "speed_ratio", bounds=(0.5, 1.6))
    fold = next(point for point in branch.special_points if point.kind == "fold")
    curve = bf.trace_curve(fold, ("speed_ratio", "load"), bounds={"load": (0.9, 1.1), "speed_ratio": (0.5, 1.6)})
    assert [end.reason for end in curve.ends] == ["bound", "bound"]
    other = bf.systems.oil_film_journal(load=1.1, speed_ratio=1.1)
    again = bf.trace(bf.find_orbit(other), "speed_ratio", bounds=(0.5, 1.6))
    folds = [point.parameter for point in again.special_points if point.kind == "fold"]
    at = int(np.argmax(curve.column("load")))
    assert curve.column("load")[at] == 1.1
    assert np.abs(curve.column("speed_ratio")[at] - folds).min() < 1e-8
