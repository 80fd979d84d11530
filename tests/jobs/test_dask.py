"""A cluster of two local workers: the same bits as threads; a chunk that kills its workers is reported, the others finish."""
import logging

import numpy as np
import pytest

import bifurc as bf
from bifurc.jobs.executors import run_chunks
from bifurc.jobs.store import ChunkStore, fingerprint
from tests.basins.work import JOB, hardening, payloads, squares

distributed = pytest.importorskip("dask.distributed")
pytestmark = pytest.mark.filterwarnings("ignore")  # of the cluster's own threads


@pytest.fixture(scope="module")
def client():
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, \
            distributed.Client(cluster) as made:
        yield made


def bits(outcome):
    return [None if item is None else fingerprint(list(item)) for item in outcome.results]


def test_a_client_and_its_executor_serve(client, tmp_path):
    expected = bits(run_chunks(ChunkStore(None, JOB), squares, payloads(9)))
    assert bits(run_chunks(ChunkStore(tmp_path / "chunks", JOB), squares, payloads(9), executor=client)) == expected
    with client.get_executor(pure=False) as executor:
        assert bits(run_chunks(ChunkStore(None, JOB), squares, payloads(9), executor=executor)) == expected


@pytest.mark.slow
def test_a_poison_chunk_is_reported(client, tmp_path):
    store = ChunkStore(tmp_path / "chunks", JOB)
    found = run_chunks(store, squares, payloads(6, at2={"dies": True}), executor=client)
    assert list(found.failures) == [2] and "KilledWorker" in found.failures[2]
    assert found.computed == 5


def test_basins_and_sweeps_on_the_cluster_equal_those_here(client):
    system = bf.systems.impact_oscillator(omega=1.4)
    grid = bf.Grid(q0=(-3, 1, 24), v0=(-4, 4, 24))
    here, there = bf.basins_of_attraction(system, grid), bf.basins_of_attraction(system, grid, executor=client)
    np.testing.assert_array_equal(here.labels, there.labels)
    np.testing.assert_array_equal(here.periods, there.periods)
    region = {"q0": (-3, 1), "v0": (-4, 4)}
    request = {"parameter": "omega", "values": [1.3, 1.4, 1.5], "region": region, "samples": 100, "chunk": 1}
    one, other = bf.sweep(system, **request), bf.sweep(system, **request, executor=client)
    np.testing.assert_array_equal(one.fractions, other.fractions)
    assert one.report() == other.report()
    for mine, others in zip(one.attractors, other.attractors, strict=True):
        for a, b in zip(mine, others, strict=True):
            np.testing.assert_array_equal(a.state, b.state)


@pytest.mark.slow
def test_a_law_of_the_user_travels_to_the_workers(client):
    system = bf.System(1.0, 0.1, 0.0, [bf.elements.HarmonicForce(0.3), bf.elements.Force(hardening, beta=0.5)], omega=1.5)
    found = bf.sweep(system, "omega", [1.4, 1.5], {"q0": (-2, 2), "v0": (-2, 2)}, samples=8, executor=client)
    assert found.failures == {} and found.fractions.sum() == 2.0
