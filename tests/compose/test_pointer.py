"""Tables behind one pointer: compiled code reads and writes the arrays that Python sees, those of any scene."""
import copy
import pickle

import numpy as np
import pytest
from numba.core.errors import TypingError

from bifurc._jit import both
from bifurc.compose import scene_of
from bifurc.compose.tables import PARTS
from bifurc.systems import bilinear_oscillator, impact_chain


@pytest.fixture(scope="module")
def probe():
    """One kernel with two lines a part: its lengths, and its sum weighted by the place."""
    import numba

    @numba.njit
    def weighed(array):
        total = 0.0
        for j, number in enumerate(array.flat):
            total += (1 + j) * number
        return total

    lines = [f"    lengths[{i}, :T.{name}.ndim] = T.{name}.shape\n    out[{i}] = weighed(T.{name})\n"
             for i, name in enumerate(PARTS)]
    made: dict = {"weighed": weighed}
    exec("def probe(T, out, lengths):\n" + "".join(lines), made)
    return numba.njit(made["probe"])


@pytest.mark.parametrize("scene", [scene_of(bilinear_oscillator()), scene_of(impact_chain(n=3))], ids=["one", "three"])
def test_a_kernel_reads_every_array_of_any_scene(probe, scene):
    T = scene.tables
    out, lengths = np.zeros(len(PARTS)), np.zeros((len(PARTS), 4), np.int64)
    probe(T, out, lengths)
    for i, name in enumerate(PARTS):
        array = getattr(T, name)
        assert tuple(lengths[i, :array.ndim]) == array.shape, name
        total = 0.0
        for j, number in enumerate(array.ravel().tolist()):
            total += (1 + j) * number
        assert out[i] == total, name
    assert len(probe.signatures) == 1


@both
def scaled(T, factor):
    A = T.A
    for i in range(A.shape[1]):
        A[0, i] *= factor
    return A.strides, T.flat.size


def test_what_a_kernel_writes_is_in_the_arrays():
    T = scene_of(impact_chain(n=2)).tables
    before = T.A.copy()
    strides, size = scaled(T, 2.0)
    assert np.array_equal(T.A[0], 2.0 * before[0]) and np.array_equal(T.A[1:], before[1:])
    assert strides == T.A.strides and size == T.flat.size


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda T: pickle.loads(pickle.dumps(T))], ids=["copy", "pickle"])
def test_a_copy_has_arrays_and_addresses_of_its_own(copied):
    T = scene_of(impact_chain(n=2)).tables
    other = copied(T)
    before = T.A.copy()
    scaled(other, 3.0)
    assert np.array_equal(T.A, before) and np.array_equal(other.A[0], 3.0 * before[0])
    assert other.address != T.address and np.shares_memory(copy.copy(T).A, T.A)
    other.flat[1] = 7.0  # where a change of parameters is written
    assert other.A.flat[0] == 7.0 and not np.shares_memory(other.flat, T.flat)


def test_an_unknown_part_does_not_compile():
    import numba

    with pytest.raises(TypingError, match="nothing"):
        numba.njit(lambda T: T.nothing)(scene_of(bilinear_oscillator()).tables)
