"""The decorator that checks arguments: it changes nothing else, and costs next to nothing."""
import inspect
import pickle
import time
import timeit

import numpy as np
import pytest

import bifurc as bf
from bifurc import checks


@checks.checked(y=checks.of(checks.number, least=0.0), word=checks.word)
def example(x, y=None, *more, word="a", **rest):
    """Say what came in."""
    return x, y, more, word, rest


def test_signature_name_and_words_stay():
    assert list(inspect.signature(example).parameters) == ["x", "y", "more", "word", "rest"]
    assert example.__name__ == "example" and example.__doc__ == "Say what came in."
    assert pickle.loads(pickle.dumps(bf.simulate)) is bf.simulate


def test_values_arrive_in_their_plain_form_and_a_default_is_not_checked():
    assert example(1) == (1, None, (), "a", {})
    found = example([], np.array(2), 3, word=np.str_("b"), other=None)
    assert found == ([], 2.0, (3,), "b", {"other": None}) and type(found[1]) is float


@pytest.mark.parametrize("call, words", [
    (lambda: example(1, -1.0), "^example: y = -1.0 is not allowed; it must be a finite number, at least 0$"),
    (lambda: example(1, word=3), "^example: word = 3 is not allowed; it must be a name, in quotes$"),
    (lambda: bf.simulate(3, (0.0, 0.0), periods=1), "^simulate: system = 3 is not allowed; it must be a System"),
    (lambda: bf.System(1.0, 0.0, 1.0, [3]), r"^System: elements\[0\] = 3 is not allowed; it must be an instance of Element$"),
    (lambda: bf.HarmonicBalance((1, 1)), r"harmonics = .1, 1. is not allowed; it must be a list that names each harmonic once"),
    (lambda: bf.elements.Driven(bf.elements.Driven(bf.elements.Jenkins())), "an element that is not driven already"),
])
def test_an_error_names_owner_argument_value_and_what_is_allowed(call, words):
    with pytest.raises(ValueError, match=words):
        call()


def test_a_missing_and_an_unknown_argument_are_told_by_python():
    with pytest.raises(TypeError, match="missing 1 required positional argument: 'y0'"):
        bf.simulate(bf.systems.impact_oscillator())
    with pytest.raises(TypeError, match="unexpected keyword argument 'nope'"):
        bf.simulate(bf.systems.impact_oscillator(), (0.0, 0.0), nope=1)


def test_a_check_costs_less_than_a_hot_call_would_notice():
    """Two microseconds of processor time where it was written, for two arguments; a shared machine is given five."""
    def least(function):
        return min(timeit.repeat(lambda: function(1, 2.0, word="b"), number=100, repeat=200, timer=time.process_time)) / 100

    assert least(example) - least(example.__wrapped__) < 5e-6
