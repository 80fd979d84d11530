"""Starts side by side in other units and from the other side, by every kernel, and against simulations."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.basins import PeriodMap
from tests.ensemble.test_batch import SCENES
from tests.reference.images import in_units, opposite

NAMES = ["one stop", "two stops", "elastic stop", "dry friction", "static friction on a belt", "two masses, one hits, one rubs"]
UNITS = {"small": (1e-7, 1e5, 1e8), "large": (1e8, 1e-6, 1e-7), "binary": (2.0**20, 2.0**-17, 2.0**9)}


def starts(name, rng, count=60):
    _, low, high = SCENES[name]
    return rng.uniform(low, high, (count, len(low)))


@pytest.mark.parametrize("units", UNITS)
@pytest.mark.parametrize("name", NAMES)
def test_ends_and_counts_of_starts_in_other_units(name, units, rng):
    """Four periods by the kernel of the scene: ends and speeds have their units, outcomes and counts have none."""
    system, X = SCENES[name][0], starts(name, rng)
    image = in_units(system, *UNITS[units])
    own, other = PeriodMap(system), PeriodMap(image.system)
    assert other.kernel == own.kernel
    a, b = own.apply(X, 4), other.apply(image.state(X), 4)
    assert (a.outcomes == b.outcomes).all() and (a.impacts == b.impacts).all()
    scale = np.abs(X).max(axis=0)
    apart = np.abs(b.ends @ np.linalg.inv(image.matrix).T - a.ends) / scale
    assert np.median(apart) < 1e-13 and np.quantile(apart, 0.9) < 1e-9
    met = np.isfinite(a.speeds)
    assert (np.isfinite(b.speeds) == met).all()
    if met.any():
        speeds = b.speeds[met] * image.time / UNITS[units][0]
        assert np.quantile(np.abs(speeds - a.speeds[met]), 0.9) < 1e-8


@pytest.mark.parametrize("name", ["one stop", "static friction on a belt"])
def test_starts_from_the_other_side(name, rng):
    system, X = SCENES[name][0], starts(name, rng)
    image = opposite(system)
    a, b = PeriodMap(system).apply(X, 2), PeriodMap(image.system).apply(-X, 2)
    assert (a.impacts == b.impacts).all() and np.quantile(np.abs(a.ends + b.ends), 0.9) < 1e-12


@pytest.mark.parametrize("name", NAMES)
def test_ends_and_counts_are_those_of_simulations(name, rng):
    system, X = SCENES[name][0], starts(name, rng, 12)
    images = PeriodMap(system).apply(X, 3)
    for x, end, impacts in zip(X, images.ends, images.impacts, strict=True):
        motion = bf.simulate(system, x, periods=3)
        assert np.abs(motion.final - end).max() < 1e-9 * np.abs(X).max()
        rests = any(e.kind == "chatter" for e in motion.events)
        assert rests or impacts == sum(e.kind in ("impact", "contact") for e in motion.events)
