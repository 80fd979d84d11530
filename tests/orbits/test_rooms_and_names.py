"""Room between stops by inertia, and names of labels, on inequalities written out."""
import itertools

import numpy as np
import pytest
from scipy.optimize import minimize

from bifurc.orbits.shooting.labels import Labels
from bifurc.orbits.standing import ASIDE, against, between


@pytest.mark.parametrize("seed", range(6))
def test_the_nearest_place_by_inertia(seed):
    """q^T M q is least among the places that are aside of all stops."""
    rng = np.random.default_rng(seed)
    n = 3
    L = rng.normal(size=(n, n))
    M, rows, reach = L @ L.T + np.eye(n), rng.normal(size=(2, n)), rng.normal(size=2)
    q, aside = between(M, rows, reach), reach + ASIDE[0] * np.abs(reach).max()
    assert (rows @ q + aside).max() <= 1e-9
    best = minimize(lambda x: x @ M @ x, q + 0.1, constraints={"type": "ineq", "fun": lambda x: -(rows @ x + aside)},
                    method="SLSQP", tol=1e-12)
    assert q @ M @ q == pytest.approx(best.fun, rel=1e-5, abs=1e-7)


@pytest.mark.parametrize("unit", [1e-9, 1.0, 1e9])
def test_room_and_contradiction_in_any_unit(unit):
    M, rows = np.diag([1.0, 4.0]), np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0]])
    q = between(M, rows, np.array([0.3, -2.0, -1.0]) * unit)  # q0 <= -0.3, q0 >= -2, q1 <= 1
    assert -2.0 * unit <= q[0] <= -0.3 * unit and abs(q[1]) < 1e-12 * unit
    closed = np.array([0.3, -0.2, -1.0]) * unit  # q0 <= -0.3 and q0 >= -0.2
    assert between(M, rows, closed) is None and sorted(against(M, rows, closed)) == [0, 1]
    for order in itertools.permutations(range(3)):
        found = against(M, rows[list(order)], closed[list(order)])
        assert sorted(order[k] for k in found) == [0, 1]


def test_labels_in_words():
    """Signs, factors, coordinates before memories; speeds have no place in a label."""
    rows = [[1.0, 0.0, 0.0, 0.0, 0.0, 0.0], [-1.0, 2.5, 0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, 1.0, -1.0],
            [0.0, -0.25, 0.0, 0.0, 0.0, 3.0]]
    assert Labels((0, 1, 4, 5), np.array(rows)).names(2) == [
        "coordinate 0", "- coordinate 0 + 2.5 coordinate 1", "memory 0 - memory 1", "- 0.25 coordinate 1 + 3 memory 1"]
