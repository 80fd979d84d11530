"""What is remembered and left out while kernels are compiled changes none of them."""
import colorsys
import contextlib
import json
import operator
import os
import subprocess
import sys

import numba
import numpy as np
import pytest
from numba.core import compiler, errors, event, ir, types
from numba.core.registry import cpu_target
from numba.core.runtime import _nrt_python, rtsys
from numba.np import arrayobj

from bifurc import _pipeline
from bifurc._jit import both, njit, separate

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


@pytest.mark.skipif(numba.version_info.short not in _pipeline.TRIED, reason="this numba compiles as it always does")
def test_arrays_of_separate_functions_are_told_apart(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))

    @separate
    def apart(a, b, out):
        for j in range(8):
            out[j] = (a[0] * b[j] + a[1] * b[j] ** 2) + (a[2] * b[j] ** 3 + a[3] * b[j] ** 4)

    @njit
    def alike(a, b, out):
        for j in range(8):
            out[j] = (a[0] * b[j] + a[1] * b[j] ** 2) + (a[2] * b[j] ** 3 + a[3] * b[j] ** 4)

    @both
    def caller(a, b):
        one, two = np.empty(8), np.empty(8)
        apart(a, b, one)
        alike(a, b, two)
        return one, two

    a, b = np.array([0.3, -0.2, 0.7, 1.1]), np.linspace(-1.0, 2.0, 8)
    for found in caller(a, b):
        np.testing.assert_allclose(found, np.polynomial.polynomial.polyval(b, [0.0, *a]), rtol=1e-14, atol=1e-14)
    said = [str(next(f for f in made.library._get_module_for_linking().functions if "_called" in f.name and not f.is_declaration))
            for function in (apart, alike) for made in function.get_overload.__self__.overloads.values()]
    assert len(said) == 2 and said[0].count("noalias") > said[1].count("noalias")


@pytest.mark.parametrize("args, plain", [
    ((types.float64, types.int64), True),
    ((types.float64[::1], types.UniTuple(types.int64, 2)), True),
    ((types.UniTuple(types.int64, 2), types.int64), False),
    ((types.float64, types.unicode_type), False),
    ((types.Optional(types.float64), types.float64), False),
])
def test_only_operators_on_numbers_and_arrays_are_remembered(args, plain):
    assert _pipeline._plain(args) is plain


@pytest.mark.parametrize("op", [operator.add, operator.mul, operator.pow, operator.truediv, operator.lt, operator.getitem])
def test_what_is_remembered_of_an_operator_is_what_numba_finds(op):
    """Twice, for literals too; what numba refuses stays refused."""
    context = cpu_target.typing_context
    context.refresh()
    function = context.resolve_value_type(op)
    array, number, two = types.float64[:, ::1], types.float64, types.literal(2)
    for args in ((number, number), (number, types.int64), (number, two), (array, types.UniTuple(types.int64, 2)),
                 (array, types.slice2_type)):
        try:
            wanted = _pipeline._FIND(function, context, args, {})
        except errors.TypingError:
            with pytest.raises(errors.TypingError):
                _pipeline._signature(function, context, args, {})
        else:
            assert _pipeline._signature(function, context, args, {}) == _pipeline._signature(function, context, args, {}) == wanted


def test_variables_of_instructions_are_those_that_numba_finds():
    """In their order, of every instruction of a function with loops, and of a mathematical one."""
    many = 0
    for function in (ways, colorsys.rgb_to_hls):
        for block in compiler.run_frontend(function).blocks.values():
            for stmt in block.body:
                for inst in (stmt, getattr(stmt, "value", stmt)):
                    if isinstance(inst, ir.Inst):
                        wanted = inst.list_vars()
                        with _pipeline._less_work():
                            found = inst.list_vars()
                        assert list(map(id, found)) == list(map(id, wanted))
                        many += len(found)
    assert many > 50


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


def ways(n):
    total = 0.0
    for k in range(n):
        room = np.full(k + 1, 2.0)
        if k == 3:
            continue
        part = room[1:]
        if k == 7:
            return total + part.sum()
        total += part.sum()
        room = part
    return total


@contextlib.contextmanager
def compiled():
    """List the module, name and argument types of every function that is compiled."""
    found = []
    with event.install_recorder("numba:compile") as recorder:
        yield found
    found += [(data["dispatcher"].py_func.__module__, data["dispatcher"].py_func.__qualname__, data["args"])
              for _, e in recorder.buffer if e.is_start for data in [e.data]]


def test_arrays_of_other_shapes_are_refused_without_functions_of_text(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))  # where kernels go is decided when they are decorated
    before = arrayobj.raise_with_shape_context

    @both
    def copied(a, b):
        a[:] = b
        return a.sum()

    with compiled() as made:
        assert copied(np.zeros(3), np.arange(3.0)) == 3.0
        assert copied(np.zeros(3), np.ones(1)) == 3.0  # one number for all
        assert copied(np.zeros((2, 3)), np.arange(3.0)) == 6.0
        for a, b in ((np.zeros(3), np.zeros(2)), (np.zeros((2, 3)), np.zeros(2)), (np.zeros((2, 3)), np.zeros((3, 2)))):
            with pytest.raises(ValueError, match="another shape"):
                copied(a, b)
    assert any(name.startswith("test_arrays") for _, name, _ in made)
    if numba.version_info.short in _pipeline.TRIED:
        assert not [module for module, _, _ in made if "unicode" in module]
    assert arrayobj.raise_with_shape_context is before  # kernels of others say what they always said


@pytest.mark.skipif(numba.version_info.short not in _pipeline.TRIED, reason="this numba compiles as it always does")
def test_functions_with_and_without_doors_share_what_they_call(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))

    @njit
    def inner(n):
        return np.empty((n, n, 2 * n), np.int16).size

    @both
    def outer(n):
        return inner(n) + np.empty((n, n, 2 * n), np.int16).size

    with compiled() as made:
        assert outer(3) == 108
    assert [args for module, name, args in made if module == "numba.np.arrayobj" and "np_empty" in name].count(
        next(args for module, name, args in made if "np_empty" in name)) == 1


def test_flags_differ_where_a_callee_differs():
    def flags(**values):
        made = _pipeline._Flags()
        for name, value in values.items():
            setattr(made, name, value)
        return made

    assert flags(no_cpython_wrapper=True) == flags() == flags(no_cfunc_wrapper=True)
    assert flags(nrt=True) != flags()
    assert flags(error_model="numpy") != flags(error_model="python")
    assert flags(nrt=False, error_model="python") == flags()  # what numba takes if nothing is set


def test_variables_live_as_long_as_they_did(tmp_path, monkeypatch):
    """Arrays are freed where numba frees them: as many are made as are freed, in loops and on all ways out."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))

    compiled_ways = both(ways)
    assert compiled_ways(1) == 0.0
    _nrt_python.memsys_enable_stats()
    try:
        before = rtsys.get_allocation_stats()
        assert compiled_ways(5) == 14.0  # 2 (0 + 1 + 2 + 4)
        assert compiled_ways(9) == 50.0  # 2 (0 + 1 + 2 + 4 + 5 + 6 + 7)
        after = rtsys.get_allocation_stats()
    finally:
        _nrt_python.memsys_disable_stats()
    assert after.mi_alloc - before.mi_alloc == after.mi_free - before.mi_free == 13
