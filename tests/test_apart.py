"""Functions compiled apart from their callers: when they are called, once, and again from the disk in another process."""
import json
import os
import subprocess
import sys

import numpy as np
import pytest

from bifurc._jit import both, fused

KERNELS = '''
import numpy as np
from bifurc._jit import NOTHING, NUMBER, PAIR, apart, both


@apart(PAIR)
def extremes(a):
    low, high = np.inf, -np.inf
    for value in a:
        low, high = min(low, value), max(high, value)
    return low, high


@apart(NOTHING, python=True)
def shift(a, by):
    for i in range(a.size):
        a[i] += by


@apart(NUMBER)
def wrong(a):
    return a.nothing_of_that_name


@apart(NUMBER)
def root(a):
    if a[0] < 0.0:
        raise ValueError("no root of a negative number")
    return np.sqrt(a[0])


@both
def twice(a):
    return 2.0 * root(a)


@both
def width(a, rare):
    if rare > 1:
        return wrong(a)
    if rare > 0:
        shift(a[1:], 1)
        shift(a[:, np.newaxis][:, 0], 1)
    low, high = extremes(a)
    return high - low
'''
RUN = '''
import json, sys
import numpy as np
import kernels
a = np.array([3.0, 1.0, 2.0])
compiled = lambda: [len(f.overloads) for f in (kernels.width, kernels.extremes, kernels.shift, kernels.wrong)]
out = [kernels.width(a, 0), compiled()]
out += [kernels.width(a, 1), a.tolist(), compiled()]
kernels.shift(a, 0.5)
out += [a.tolist(), sum(sum(f.stats.cache_misses.values()) for f in (kernels.width, kernels.extremes, kernels.shift))]
try:
    kernels.width(a, 2)
except Exception as error:
    out.append(f"{type(error).__name__}: {error}")
try:
    kernels.extremes(a)
except TypeError as error:
    out.append(str(error))
print(json.dumps(out))
'''


@pytest.fixture
def run(tmp_path):
    """Return a function that runs the kernels in a process of their own and returns what it prints."""
    (tmp_path / "kernels.py").write_text(KERNELS)

    def result():
        path = os.pathsep.join([str(tmp_path), *sys.path])
        done = subprocess.run([sys.executable, "-c", RUN], capture_output=True, text=True, check=True, cwd=tmp_path,
                              env={**os.environ, "PYTHONPATH": path, "NUMBA_CACHE_DIR": str(tmp_path / "cache")})
        return json.loads(done.stdout), done.stderr

    return result


def test_a_function_apart_is_compiled_at_its_first_call_and_kept_on_disk(run):
    (first, said), (again, _) = run(), run()
    width, compiled, wider, moved, then, shifted, missed, message, refused = first
    assert (width, wider, moved) == (2.0, 0.0 + 1.0, [4.0, 3.0, 4.0])
    assert compiled == [1, 1, 0, 0]  # the rare branch has not been taken
    assert then[2] >= 1 and then[3] == 0
    assert shifted == [4.5, 3.5, 4.5]
    assert message.startswith("NotCompiled: kernels:wrong could not be compiled") and "nothing_of_that_name" in said
    assert "extremes has no door for Python" in refused  # though it is compiled: no null pointer is called
    assert missed > 0 and again[-3] == 0
    assert again[:-3] == first[:-3]


@fused
def of_rows(a, out):
    """Sums that arithmetic of real numbers would shorten, and a product with a sum."""
    for i in range(a.shape[0]):
        out[i, 0] = (a[i, 0] + a[i, 1]) - a[i, 0]
        out[i, 1] = 1.0 if a[i, 1] != a[i, 1] else 0.0
        out[i, 2] = a[i, 0] * a[i, 0] - a[i, 1]
        out[i, 3] = a[i, 0] / 3.0


@both
def fill(a, out):
    of_rows(a, out)


def test_fused_functions_keep_order_and_what_is_no_number():
    """Products and sums may be fused; nothing is reordered, divided by reciprocals, or taken for finite."""
    a = np.array([[1e16, 1.0], [2.0, np.nan], [1.0, np.inf], [1.0 + 2.0**-30, 1.0]])
    out = np.empty((4, 4))
    fill(a, out)
    with np.errstate(invalid="ignore"):
        np.testing.assert_array_equal(out[:, 0], (a[:, 0] + a[:, 1]) - a[:, 0])
    assert out[:, 1].tolist() == [0.0, 1.0, 0.0, 0.0] and out[2, 2] == -np.inf and np.isnan(out[1, 2])
    assert out[3, 2] == pytest.approx(2.0**-29, rel=1e-8)
    np.testing.assert_array_equal(out[:, 3], a[:, 0] / 3.0)


def test_an_error_of_a_function_apart_is_that_of_its_caller(tmp_path):
    """Also where the function was compiled for an earlier call."""
    (tmp_path / "kernels.py").write_text(KERNELS)
    script = "import numpy as np, kernels\n" + "".join(f'''
try:
    print(kernels.twice(np.array([{value}])))
except ValueError as error:
    print(error)
''' for value in (-1.0, 4.0, -4.0))
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd=tmp_path,
                          env={**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path]),
                               "NUMBA_CACHE_DIR": str(tmp_path / "cache")})
    assert done.stdout.splitlines() == ["no root of a negative number", "4.0", "no root of a negative number"]


def test_an_interruption_waits_until_a_function_is_compiled(tmp_path):
    """Ctrl-C that falls into the compilation of a function behind a compiled caller is not taken for a failed computation: the
    caller gets its result, the interruption comes after it."""
    (tmp_path / "kernels.py").write_text(KERNELS)
    script = """
import signal
import time
import numpy as np
import kernels
from bifurc import _apart
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell that starts jobs in the background lets them ignore it
dispatcher = _apart._known["kernels:extremes"]
compile_it, calls = dispatcher.compile, []


def interrupted(arguments):
    calls.append(arguments)
    if len(calls) == 1:
        raise KeyboardInterrupt
    return compile_it(arguments)


dispatcher.compile = interrupted
try:
    print(kernels.width(np.array([3.0, 1.0, 2.0]), 0), len(calls), flush=True)
    time.sleep(10.0)
    print("never")
except KeyboardInterrupt:
    print("interrupted")
"""
    path = os.pathsep.join([str(tmp_path), *sys.path])
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd=tmp_path,
                          env={**os.environ, "PYTHONPATH": path, "NUMBA_CACHE_DIR": str(tmp_path / "cache")})
    assert done.stdout.split() == ["2.0", "2", "interrupted"]
