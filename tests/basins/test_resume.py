"""Cell maps and refined maps through any executor, from files, interrupted and begun again: the same bits."""
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest

import bifurc as bf
from bifurc.jobs.executors import SerialExecutor

A = bf.systems.impact_oscillator(zeta=0.02, omega=2.6, amplitude=1.0, gap=0.0, restitution=0.8)
GRID = bf.Grid(q0=(-2.5, 0.0, 200), v0=(-3.0, 3.0, 200))
FIELDS = {"labels", "periods", "impacts", "speeds", "states", "evaluated", "fates", "group", "steps"}


class Counting(SerialExecutor):
    """Counts chunks, and is interrupted before the one after the last that it may do."""

    def __init__(self, most=10**9):
        self.count, self.most = 0, most

    def submit(self, fn, /, *args, **kwargs):
        if self.count == self.most:
            raise KeyboardInterrupt
        self.count += 1
        return super().submit(fn, *args, **kwargs)


def cells(**options):
    return bf.cell_mapping(A, GRID, periods=30, audit=200, **options)


def chain(**options):
    return bf.cell_mapping(A, GRID, periods=6, samples=2, audit=200, **options)


def refined(**options):
    return bf.refined_basins(A, GRID, **options)


def bits(found):
    """All arrays of a result, and what it says."""
    arrays = found.to_record()[1]
    assert FIELDS & set(arrays)
    return arrays


def same(a, b):
    one, two = bits(a), bits(b)
    assert set(one) == set(two) and repr(a) == repr(b)
    for name, values in one.items():
        np.testing.assert_array_equal(values, two[name], err_msg=name)


@pytest.mark.parametrize("make", [cells, chain, refined])
def test_no_executor_and_no_file_changes_a_bit(make, tmp_path):
    plain = make(workers=1)
    same(make(workers=2), plain)
    same(make(executor=SerialExecutor(), file=tmp_path / "one.npz"), plain)
    same(bf.load(tmp_path / "one.npz"), plain)
    assert [item.name for item in tmp_path.iterdir()] == ["one.npz"]


@pytest.mark.parametrize("make", [cells, refined])
def test_processes_give_the_same(make, tmp_path):
    same(make(executor=lambda: ProcessPoolExecutor(2), file=tmp_path / "two.npz"), make())


@pytest.mark.parametrize("make", [cells, chain, refined])
def test_what_was_interrupted_goes_on_where_it_stopped(make, tmp_path):
    """Twice interrupted, a chunk damaged in between: only what is missing is computed; the finished result is read."""
    file, total = tmp_path / "map.npz", Counting()
    plain = make(executor=total, file=tmp_path / "whole.npz")
    for most in (2, 1):
        with pytest.raises(KeyboardInterrupt):
            make(executor=Counting(most), file=file)
    chunks = sorted((tmp_path / "map.npz.chunks").glob("*.npz"))
    assert len(chunks) == 3 and not file.exists()
    chunks[0].write_bytes(chunks[0].read_bytes()[:-40])
    again = Counting()
    same(make(executor=again, file=file), plain)
    assert again.count == total.count - 2
    assert sorted(item.name for item in tmp_path.iterdir()) == ["map.npz", "whole.npz"]
    none = Counting(0)
    same(make(executor=none, file=file), plain)


def test_a_file_of_another_map_is_not_taken(tmp_path):
    file = tmp_path / "map.npz"
    cells(file=file)
    other = bf.cell_mapping(A, GRID, periods=29, audit=200, file=file)
    assert other.periods == 29 and bf.load(file).periods == 29


def test_maps_without_a_name_are_not_filed_and_failures_are_said(tmp_path):
    with pytest.raises(ValueError, match="files hold no code"):
        bf.cell_mapping(np.square, bf.Grid(q0=(0, 1, 10)), file=tmp_path / "map.npz")
    with pytest.raises(ValueError, match="is not allowed; it must be a concurrent.futures.Executor"):
        cells(executor=3)

    def fails(x):
        if len(x) > 1:
            raise FloatingPointError("no image")
        return x

    with pytest.raises(RuntimeError, match="1 of 1 chunks of cells failed.*cells 0 to 9: FloatingPointError: no image"):
        bf.cell_mapping(fails, bf.Grid(q0=(0, 1, 10)))
    assert not list(tmp_path.iterdir())
