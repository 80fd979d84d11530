"""What is remembered and left out while kernels are compiled changes none of them."""
import json
import os
import subprocess
import sys

import numba
import numpy as np
import pytest
from numba.core import compiler, types

from bifurc import _pipeline
from bifurc._jit import both, njit

KERNELS = '''
import numpy as np
from bifurc._jit import both, leaf, njit


@leaf
def deep(a, k):
    return 2.0 * a[k] + max(a[0], 1)


@njit
def inner(a):
    if a.size == 0:
        raise ValueError("empty", 3)
    out = np.zeros(a.size)
    for k in range(a.size):
        out[k] = deep(a, k) if k > 1 and a[k] < 9.0 else -a[k] ** 2
    return out[1:].sum()


@both
def first(a):
    return inner(a) + 1


@both
def second(a):
    return 2 * inner(a)
'''
RUN = '''
import json, sys
import numpy as np
import kernels
a = np.arange(5.0)
out = [getattr(kernels, name)(a) for name in sys.argv[1:]]
try:
    kernels.first(np.empty(0))
except ValueError as error:
    out.append(list(error.args))
print(json.dumps(out))
'''


def test_a_function_that_is_only_linked_comes_back_from_the_disk_for_another_caller(tmp_path):
    (tmp_path / "kernels.py").write_text(KERNELS)

    def run(*names):
        made = subprocess.run([sys.executable, "-c", RUN, *names], capture_output=True, text=True, check=True, cwd=tmp_path,
                              env={**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path]),
                                   "NUMBA_CACHE_DIR": str(tmp_path / "cache")})
        return json.loads(made.stdout)

    wanted = -1.0 + sum(2.0 * k + 1.0 for k in (2, 3, 4))
    assert run("first") == [wanted + 1.0, ["empty", 3]]
    assert run("second") == [2.0 * wanted, ["empty", 3]]  # its callee is read
    assert run("first", "second") == [wanted + 1.0, 2.0 * wanted, ["empty", 3]]


@pytest.mark.skipif(numba.version_info.short not in _pipeline.TRIED, reason="this numba compiles as it always does")
def test_a_function_that_is_only_linked_has_no_machine_code(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))  # what comes from the disk is a library like any other

    @njit
    def callee(x):
        return np.sqrt(x * x + 1.0)

    @both
    def caller(x):
        return callee(x)

    assert caller(2.0) == np.sqrt(5.0)
    [made] = callee.get_overload.__self__.overloads.values()
    assert isinstance(made.library, _pipeline._Library)
    assert not list(made.library.get_defined_functions())
    assert any(not f.is_declaration for f in made.library._get_module_for_linking().functions)


@pytest.mark.parametrize("args, plain", [
    ((types.float64, types.int64), True),
    ((types.float64[::1], types.UniTuple(types.int64, 2)), True),
    ((types.UniTuple(types.int64, 2), types.int64), False),
    ((types.float64, types.unicode_type), False),
    ((types.Optional(types.float64), types.float64), False),
])
def test_only_operators_on_numbers_and_arrays_are_remembered(args, plain):
    assert _pipeline._plain(args) is plain


def test_a_numba_that_was_not_tried_compiles_as_it_always_does(monkeypatch):
    monkeypatch.setattr(_pipeline, "TRIED", ())
    assert _pipeline.for_this_numba(_pipeline.Linked) is compiler.Compiler

    @njit
    def callee(x):
        return x + 2.0

    @both
    def caller(x):
        return callee(x) * 3.0

    assert caller(1.0) == 9.0
