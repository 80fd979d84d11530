"""Functions that are compiled for a caller keep their own settings, whichever caller comes first."""
import numpy as np

from bifurc._jit import both, leaf


@both
def filled(base, out):
    """Write half of what is given, from an array made here."""
    room = np.empty(base.size)
    room[:] = 0.5 * base
    out[:] = room


@leaf
def below(base, out):
    """Count no references; nothing else has compiled `filled` before."""
    filled(base, out)


@both
def above(base, out):
    """Call what counts no references."""
    below(base, out)


def test_what_is_compiled_first_for_a_leaf_counts_references_itself():
    out = np.zeros(4)
    above(np.arange(4.0), out)
    assert out.tolist() == [0.0, 0.5, 1.0, 1.5]
