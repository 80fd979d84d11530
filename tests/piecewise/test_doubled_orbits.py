"""Orbits that branch off at a flip where the period is unknown: the converter's, against exponentials of its two circuits."""
import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq, root

import bifurc as bf

R, L, C, T, GAIN, REFERENCE, LOW, HIGH = 22.0, 20e-3, 47e-6, 400e-6, 8.4, 11.3, 3.8, 8.2
A = np.array([[-1 / (R * C), 1 / C], [-1 / L, 0.0]])


def period(y, on, E):
    """State after a period that is off until ``on`` and its derivative, and how far the ramp is from the control at ``on``."""
    rest = np.linalg.solve(A, [0.0, E / L])  # less the state of rest under the source
    y = expm(A * on) @ y
    gap = GAIN * (y[0] - REFERENCE) - LOW - (HIGH - LOW) * on / T
    jump = np.outer([0.0, E / L], [GAIN, 0.0]) / (GAIN * (A @ y)[0] - (HIGH - LOW) / T)
    after = expm(A * (T - on))
    return after @ (y + rest) - rest, after @ (np.eye(2) + jump) @ expm(A * on), gap


def smallest(E, count):
    """The smallest real part of the multipliers of the orbit over ``count`` periods."""
    def misses(x):
        y, out = x[:2] * [10.0, 1.0], []
        for on in x[2:]:
            y, _, gap = period(y, on * T, E)
            out.append(gap)
        return [*(y - x[:2] * [10.0, 1.0]), *out]
    guess = [1.2, 0.6, 0.5] if count == 1 else [1.214, 0.523, 0.353, 0.862]
    found = root(misses, guess, tol=1e-14)
    y, M = found.x[:2] * [10.0, 1.0], np.eye(2)
    for on in found.x[2:]:
        y, D, _ = period(y, on * T, E)
        M = D @ M
    assert np.abs(found.fun).max() < 1e-10 and (count == 1 or np.ptp(found.x[2:]) > 1e-3)
    return np.linalg.eigvals(M).real.min()


def test_the_doubled_orbit_leaves_the_flip_and_doubles_again():
    converter = bf.systems.buck_converter()
    branch = bf.trace(bf.find_orbit(converter, {"v": 11.97, "i": 0.59, "time": 0.0}), "E", bounds=(20, 35))
    flip, = branch.special_points
    once = brentq(lambda E: smallest(E, 1) + 1.0, 24.0, 25.0, xtol=1e-12)
    assert flip.kind == "period_doubling" and abs(flip.parameter - once) < 1e-8

    doubled, = bf.switch_branch(flip)
    assert doubled.period == pytest.approx(2.0 * T, rel=1e-12) and doubled.stable
    branch = bf.trace(doubled, "E", bounds=(20, 35))
    merges, again = sorted(branch.special_points, key=lambda point: point.parameter)
    twice = brentq(lambda E: smallest(E, 2) + 1.0, 30.5, 31.5, xtol=1e-12)
    assert branch.audit.ok and merges.name == "merges" and abs(merges.parameter - once) <= merges.error + 1e-12
    assert again.kind == "period_doubling" and abs(again.parameter - twice) < 1e-8
