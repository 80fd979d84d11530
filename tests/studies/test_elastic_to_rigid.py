"""The elastic rub converges to the rigid one with the order 1/2 and the constants of an independent computation."""
import numpy as np
import pytest

from studies import elastic_to_rigid as study


@pytest.mark.parametrize(("restitution", "beta"), [(0.5, 0.255275637648651807), (0.8, 0.0743550970976406),
                                                   (0.9, 0.0342652041262328)])
def test_damping_ratio_of_a_restitution(restitution, beta):
    assert abs(study.damping_ratio(restitution) - beta) < 1e-13


@pytest.mark.slow
@pytest.mark.parametrize(("orbit", "constants"), [("one impact, nu = 1.7", (8.46497, 8.11234, 8.00554)),
                                                  ("three impacts, nu = 1.1", (0.55552, 0.56262, 0.56484))])
def test_order_and_constants(orbit, constants):
    nu, guess = study.ORBITS[orbit]
    stiffnesses = np.array(study.STIFFNESSES[study.Setting.SMALL])
    away, better = study.deviations(nu, guess, stiffnesses)
    assert np.abs(away * np.sqrt(stiffnesses) / constants - 1.0).max() < 2e-5
    assert better[-1] * stiffnesses[-1] < 300.0  # extrapolated: what is left is of order 1 / stiffness
