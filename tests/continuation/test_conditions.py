"""Differences of conditions along branches: to fourth order inside a range and at its ends."""
import numpy as np
import pytest

from bifurc.continuation.conditions import difference


@pytest.mark.parametrize("bounds", [(-9.0, 9.0), (0.3, 9.0), (-9.0, 0.3)], ids=["inside", "lower end", "upper end"])
def test_differences_are_of_fourth_order(bounds):
    """At an end of the range the function refuses the other side with a `ValueError`."""
    def function(x):
        if not bounds[0] <= x[1] <= bounds[1]:
            raise ValueError("beyond the range")
        return np.array([np.exp(x[1]), x[0] * np.sin(3.0 * x[1])])

    x = np.array([2.0, 0.3])
    exact = np.array([np.exp(0.3), 6.0 * np.cos(0.9)])
    wide, narrow = (np.abs(difference(function, x, 1, step) - exact) for step in (4e-2, 2e-2))
    assert (narrow < 2e-5).all() and (narrow < wide / 10.0).all()


def test_a_range_without_room_is_refused():
    """No point on either side: the function's own error."""
    def function(x):
        if x[0] != 1.0:
            raise ValueError("only one value")
        return x[0]

    with pytest.raises(ValueError, match="only one value"):
        difference(function, np.array([1.0]), 0, 1e-3)
