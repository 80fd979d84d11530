"""All multipliers above a modulus, of matrices so large that only the leading ones are computed."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.control.collocated import DENSE, LEADING, Collocated


@pytest.mark.parametrize("many", [1, LEADING, LEADING + 3])
@pytest.mark.parametrize("size", [DENSE // 4, DENSE + 20])
def test_none_above_the_modulus_is_left_out(size, many, rng):
    """``many`` lie between 1.5 and 2.5 and the rest below 0.5, some of them complex pairs, in a random basis."""
    many = min(many, size // 2)
    values = np.concatenate([np.linspace(2.5, 1.5, many), np.linspace(0.5, 0.01, size - many)])
    D = np.diag(values)
    for k in range(0, size - 1, 6):  # pairs of the same modulus
        angle = 0.3 + 0.1 * (k % 5)
        D[k:k + 2, k:k + 2] = values[k] * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    Q = np.linalg.qr(rng.normal(size=(size, size)))[0]
    moduli = np.sort(np.abs(np.linalg.eigvals(D)))[::-1]
    known = SimpleNamespace(_reduced=lambda gain: Q @ D @ Q.T)
    for least in (1.0, 3.0, 2.0):
        found = np.abs(Collocated.outside(known, 0.3, least))
        above = max(int((moduli > least).sum()), 1)
        assert (np.diff(found) <= 1e-9).all() and len(found) >= above
        np.testing.assert_allclose(found[:above], moduli[:above], rtol=1e-8)
        assert size <= DENSE or len(found) <= 4 * max(above, LEADING)  # nor are many others computed
