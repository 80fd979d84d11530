"""What cannot be a system of first order is refused at construction, with the name and the value of what is wrong."""
import numpy as np
import pytest

import bifurc as bf

F, S, R = bf.AffineField, bf.AffineSurface, bf.AffineReset
ONE = {"-": F([[-1.0]], [1.0]), "+": F([[-1.0]], [-1.0])}


def piecewise(states="x", fields=None, switches=None, **more):
    switches = [bf.Switch(S([1.0]))] if switches is None else switches
    return bf.PiecewiseSystem(states, ONE if fields is None else fields, switches, **more)


@pytest.mark.parametrize(("make", "words"), [
    (lambda: piecewise(states="x x"), "different names"),
    (lambda: piecewise(states=""), "different names"),
    (lambda: piecewise(states=3), "different names"),
    (lambda: piecewise(states="t"), "'t' has the name"),
    (lambda: piecewise(states="k", k=1.0), "'k' has the name of a parameter"),
    (lambda: piecewise(states="class"), "different names"),
    (lambda: piecewise(states="x y"), r"shape \(2, 2\)"),
    (lambda: piecewise(fields={"-": ONE["-"]}), r"fields of '\+' are missing"),
    (lambda: piecewise(fields={**ONE, "on": ONE["-"]}), "'on' belongs to no side"),
    (lambda: piecewise(fields={"-": lambda x: -x, "+": ONE["+"]}), "affine so far"),
    (lambda: piecewise(fields={"-": 1.0, "+": ONE["+"]}), "AffineField"),
    (lambda: piecewise(fields=None, switches=[S([1.0])]), "list of Switch"),
    (lambda: piecewise(switches=[bf.Switch(S([0.0], 1.0))]), "must depend on a state"),
    (lambda: piecewise(fields={"-": F([[float("nan")]]), "+": ONE["+"]}), "finite numbers"),
    (lambda: piecewise(fields={"-": F([[-1.0]], cos={1: [1.0]}), "+": ONE["+"]}), "omega = None is not allowed"),
    (lambda: piecewise(fields={"-": F(lambda k: [[-k]]), "+": ONE["+"]}), "takes a parameter 'k'"),
    (lambda: piecewise("x y", {"-": F([[-1.0, 0.5], [0.3, 0.0]], [1.0, 0.2]), "+": F([[-3.0, 1.0], [0.0, 1.0]], [-1.0, 0.4])},
                       [bf.Switch(S([1.0, 0.0]))]), "sliding field is not affine"),
    (lambda: piecewise(omega=-1.0), "omega = -1"),
    (lambda: piecewise(k="a"), "k = 'a'"),
    (lambda: bf.Switch(lambda x: x), "affine so far"),
    (lambda: bf.Switch(S([1.0]), hysteresis=(1.0, 1.0)), "infinitely often"),
    (lambda: bf.Switch(S([1.0]), hysteresis=1.0), "two numbers"),
    (lambda: bf.Switch(S([1.0]), sliding=1), "True or False"),
    (lambda: F([[1.0]], cos={0: [1.0]}), "whole numbers from 1 on"),
    (lambda: bf.Jump("a", S([1.0]), to=[]), "name of a mode"),
    (lambda: bf.Jump("a", S([1.0]), to="a", reset=[[1.0]]), "AffineReset"),
    (lambda: bf.HybridSystem("x", {"a": ONE["-"]}, [bf.Jump("a", S([1.0]), to="b")]), "'b' has no field"),
    (lambda: bf.HybridSystem("x", {"a": ONE["-"]}, [bf.Jump("a", S([1.0]), to="a", reset=R([[1.0, 0.0]]))]), r"shape \(1, 1\)"),
    (lambda: bf.HybridSystem("x", {"a": ONE["-"]}, [], start="b"), "'b' has no field"),
])
def test_it_is_refused(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def test_states_and_modes_of_a_start_are_checked():
    system = bf.PiecewiseSystem("x", {"on": F([[-0.2]], [6.0]), "off": F([[-0.2]], [2.0])},
                                [bf.Switch(S([1.0]), below="on", above="off", hysteresis=(19.0, 21.0))])
    with pytest.raises(ValueError, match="y0"):
        bf.simulate(system, (1.0, 2.0), duration=1.0)
    with pytest.raises(ValueError, match="mode = 'up'"):
        bf.simulate(system, (20.0,), duration=1.0, mode="up")
    up, down = (bf.simulate(system, (20.0,), duration=0.1, mode=(mode,)).final[0] for mode in ("on", "off"))
    assert up > 20.0 > down and bf.simulate(system, (20.0,), duration=0.1).final[0] == up


def test_parameters_are_those_of_the_functions():
    system = piecewise(fields={"-": F(lambda k: [[-k]], [1.0]), "+": F(lambda k: [[-k]], [-1.0])}, k=2.0)
    assert system.parameters == {"k": 2.0} and system.with_parameters(k=3.0).parameters == {"k": 3.0}
    with pytest.raises(ValueError, match="there are k"):
        system.with_parameters(c=1.0)
    with pytest.raises(ValueError, match="k = nan"):
        system.with_parameters(k=np.nan)
