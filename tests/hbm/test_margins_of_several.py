"""Margins of several contacts are the counts of all, the least overshoot and the largest miss of those of each alone."""
import numpy as np
import pytest

from bifurc import System
from bifurc.elements import ElasticStop, HarmonicForce, Jenkins
from bifurc.hbm.balance import Balance
from bifurc.hbm.contacts.margins import COUNT, FAR, FIELDS, KINDS, MISS, OVERSHOOT
from bifurc.hbm.corrector import watched
from bifurc.hbm.layout import Layout
from bifurc.hbm.status import ContactStatus

H = 4


def margins(n, elements, x, samples):
    system = System(np.eye(n), 0.1 * np.eye(n), np.eye(n), (HarmonicForce(1.0), *elements), omega=1.3)
    balance = Balance(system, Layout(tuple(range(H + 1)), n), samples)
    status, _, _ = balance.linearised(np.asarray(x, float).T.ravel())
    assert status is ContactStatus.FOLLOWED
    events = np.full((KINDS, FIELDS), np.nan)
    watched(balance.parts.structure, balance.parts.flat, balance.grid, balance.room, events)
    return events


@pytest.mark.parametrize("samples", [0, 4096])
@pytest.mark.parametrize("seed", range(6))
def test_margins_of_each_alone_make_those_of_all(seed, samples):
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(3, 2 * H + 1)) / np.repeat(np.arange(H + 1) + 1.0, 2)[1:]
    made = (lambda dof: ElasticStop(0.5, 3.0, dof=dof), lambda dof: ElasticStop(0.3, 2.0, dof=dof, side=-1),
            lambda dof: Jenkins(2.0, 0.4, dof=dof))
    alone = np.array([margins(1, (make(0),), row[None], samples) for make, row in zip(made, x, strict=True)])
    together = margins(3, [make(dof) for dof, make in enumerate(made)], x, samples)
    np.testing.assert_allclose(together[:, COUNT], alone[:, :, COUNT].sum(axis=0), rtol=0, atol=0)
    np.testing.assert_allclose(together[:, OVERSHOOT], alone[:, :, OVERSHOOT].min(axis=0), rtol=0, atol=1e-9)
    np.testing.assert_allclose(together[:, MISS], alone[:, :, MISS].max(axis=0), rtol=0, atol=1e-9)
    assert (together[:, COUNT] > 0.0).sum() >= 3 and (together[:, MISS] > -FAR).any()
