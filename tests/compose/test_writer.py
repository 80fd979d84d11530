"""Laws as text of their own, and the modules that are written around them."""
import functools
import importlib.util
import math
import os
import pathlib
from math import sin

import numpy as np
import pytest

import bifurc as bf
from bifurc.compose import lawtext, writer
from bifurc.compose.scene import scene_of
from bifurc.elements import CubicSpring, Force
from bifurc.flow import rule
from bifurc.flow.affine import engine as affine
from bifurc.flow.affine import polynomial
from bifurc.flow.modal import engine as modal_engine

HARD = 3.5
SWITCH = True


def helper(u):
    """Odd part."""
    return u * abs(u)


def with_globals(u, s, c: float = 1.0):
    """A docstring that must not matter."""
    if SWITCH and u > 0.0:
        return -c * HARD * helper(u) + math.exp(-u) * np.tanh(s)
    return sin(u) - s


def made(number):
    def law(u, s, c):
        return number * u + c * s
    return law


def defined(text):
    names = {"njit": lambda function: function}
    exec(text, names)
    return names


def test_text_stands_alone():
    names = defined(lawtext.standalone(with_globals, "law_0"))
    for u, s in ((0.3, -0.2), (-1.0, 2.0)):
        assert names["law_0"](u, s, 0.7) == with_globals(u, s, 0.7)


def test_numbers_around_a_closure_go_along():
    assert defined(lawtext.standalone(made(2.25), "law_3"))["law_3"](1.5, 2.0, 0.5) == made(2.25)(1.5, 2.0, 0.5)
    assert lawtext.standalone(made(2.25), "law_3") != lawtext.standalone(made(2.5), "law_3")


def test_two_lambdas_on_a_line_are_told_apart():
    one, other = (lambda u, s, c: -c * u * u), (lambda u, s, c: c * s * u)
    assert defined(lawtext.standalone(one, "f"))["f"](2.0, 3.0, 5.0) == -20.0
    assert defined(lawtext.standalone(other, "f"))["f"](2.0, 3.0, 5.0) == 30.0


def test_comments_and_layout_do_not_change_the_text():
    assert '"""' not in lawtext.standalone(with_globals, "law_0") and "float" not in lawtext.standalone(with_globals, "law_0")


@pytest.mark.parametrize("function, words", [
    (functools.partial(made, 1.0), "not a Python function"),
    (lambda u, s, *rest: u, "plain arguments"),
    (lambda u, s: u * BOX[0], "BOX"),
])
def test_what_cannot_be_written_is_named(function, words):
    with pytest.raises(lawtext.LawError, match=words):
        lawtext.standalone(function, "law_0")


BOX = [1.0]


def test_a_law_without_source_is_an_error():
    names = {}
    exec("def law(u, s):\n    return -u", names)
    with pytest.raises(lawtext.LawError, match="source text cannot be found"):
        lawtext.standalone(names["law"], "law_0")


def loaded(path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.law


def key_of(law):
    laws = scene_of(bf.System(1.0, 0.0, 1.0, (Force(law),), omega=1.0)).laws
    return writer.law_key(writer.law_text(laws, 1))


def test_an_edited_law_is_never_replayed(tmp_path):
    path = tmp_path / "mylaw.py"
    path.write_text("def law(u, s):\n    return -2.0 * u**3\n")
    law = loaded(path)
    first = key_of(law)
    path.write_text("def law(u, s):\n    return -3.0 * u**3 - s\n")
    os.utime(path, (1e9, 1e9))
    with pytest.raises(lawtext.LawError, match="no longer the one that runs"):
        key_of(law)
    second = key_of(loaded(path))
    path.write_text("# only a comment\n\ndef law(u, s):\n    '''Says more.'''\n    return -3.0 * u ** 3 - s\n")
    os.utime(path, (2e9, 2e9))
    assert first != second == key_of(loaded(path))


def test_parameters_are_no_text():
    soft, stiff = (scene_of(bf.systems.duffing_oscillator(beta=beta)).laws for beta in (0.1, 7.0))
    assert writer.law_text(soft, 1) == writer.law_text(stiff, 1)
    assert writer.law_text(soft, 1) != writer.law_text(soft, 2)


@pytest.mark.parametrize("law, jacobian, words", [
    (lambda u, s: (u, s), None, "needs one number"),
    (lambda u, s: -u**3, lambda u, s: -3.0 * u * u, "tuple of 2 numbers"),
    (lambda u, s: -u**3, lambda u: (0.0, 0.0), "positional argument"),
])
def test_results_that_do_not_fit_are_named(law, jacobian, words):
    laws = scene_of(bf.System(1.0, 0.0, 1.0, (Force(law, jacobian, label="mine"),), omega=1.0)).laws
    with pytest.raises(lawtext.LawError, match=words):
        writer.law_text(laws, 1)


def test_scenes_without_laws_take_the_modules_themselves():
    from bifurc.orbits.shooting import sequence

    assert writer.kernels(scene_of(bf.systems.impact_oscillator()), "bifurc.orbits.shooting.sequence") is sequence


def test_written_modules_take_the_engine_of_the_laws():
    springs = CubicSpring(1.0), Force(lambda u, s: -u**5)
    scene, other = (scene_of(bf.System(1.0, 0.1, 1.0, (spring,), omega=1.0)) for spring in springs)
    engine = writer.kernels(scene)
    scan = writer.kernels(scene, "bifurc.flow.scan")
    for name, home in (("free_steps", "guards"), ("inside", "hidden"), ("all_series", "guards"), ("land", "guards")):
        assert getattr(scan, name).__module__ == f"bifurc.flow.laws.{home}", name
    assert engine.land is scan.land and engine.arc.__module__ == "bifurc.flow.laws.engine"
    assert engine.forcing is affine.forcing and scan.first_zero is polynomial.first_zero  # what reaches no law stays
    assert writer.kernels(other, "bifurc.flow.scan") is scan  # one for all laws
    assert scene.bound.all() and other.bound.all() and not (scene.bound == other.bound).any()  # each with a step of its own
    text = pathlib.Path(scan.__file__).read_text(encoding="utf-8")
    assert "from bifurc.flow.affine.engine import" in text  # forcing stays, the rest leads elsewhere
    assert ".part" not in " ".join(os.listdir(os.path.dirname(scan.__file__)))


def test_many_degrees_of_freedom_take_the_engine_of_modal_coordinates_and_few_do_not():
    K = 2.0 * np.eye(5) - np.eye(5, k=1) - np.eye(5, k=-1)
    many = scene_of(bf.System(np.eye(5), 0.1 * K, K, (bf.elements.RigidStop(1.0, 0.5),), omega=1.0))
    few = scene_of(bf.System(np.eye(4), 0.1 * K[:4, :4], K[:4, :4], (bf.elements.RigidStop(1.0, 0.5),), omega=1.0))
    engine, scan = writer.kernels(many), writer.kernels(many, "bifurc.flow.scan")
    assert engine.arc is modal_engine.arc and scan.free_steps is modal_engine.free_steps
    assert scan.land is engine.land is not affine.land
    assert engine.guard_value is affine.guard_value
    assert writer.kernels(many, "bifurc.flow.rule").blurred is modal_engine.blurred
    assert writer.kernels(few, "bifurc.flow.rule") is rule
    assert writer.kernels(few) is affine


def test_several_rows_are_one_law_with_all_derivatives():
    def pair(u0, u1, s0, s1, c):
        return -c * (u0 - u1) ** 3, c * (u0 - u1) ** 3

    system = bf.System(np.eye(2), np.zeros((2, 2)), np.eye(2), (Force(pair, site=((1.0, 0.0), (0.0, 1.0)), c=2.0),), omega=1.0)
    names = defined(writer.law_text(scene_of(system).laws, 2).replace("from bifurc._jit import njit", ""))
    local, slope = np.zeros((3, 2, 1)), np.empty((2, 2, 2, 1))
    local[0, :, 0], local[1, :, 0] = (0.7, -0.4), (0.1, 0.2)
    acts, values = np.ones((1, 1), np.int64), np.array([2.0])
    names["forces"](values, acts, 0, 1, local)
    names["slopes"](values, acts, 0, 0.1, 1, local, slope)
    assert tuple(local[2, :, 0]) == pair(0.7, -0.4, 0.1, 0.2, 2.0)
    k = 6.0 * 1.1**2
    assert abs(slope[0, :, :, 0] - [[-k, k], [k, -k]]).max() < 1e-9 * k and abs(slope[1]).max() < 1e-9
