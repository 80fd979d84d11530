"""Results by their content: equality, hash, copies, pickles, and arrays that nobody can write, on real results of every kind."""
import ast
import copy
import dataclasses
import pathlib
import pickle

import numpy as np
import pytest

import bifurc as bf
from bifurc.basins.cells.cell_map import Absorption
from bifurc.content import Content, alike, digest, read_only
from bifurc.elements import DelayedFeedback, HarmonicForce
from tests.reference.beam import beam

SOURCES = pathlib.Path(bf.__file__).parent
# what no user gets: steps of solvers, tables of kernels, parts of equations
INNER = {"Recorded", "Sampled", "Linear", "Condensed", "Contact", "ForceLaw", "Held", "Parts", "Terms", "Clusters",
         "SetValuedResult", "NewtonResult", "BroydenResult", "Signature", "ParameterPath", "Earlier", "Repetition", "Member",
         "Rows", "BalancePath", "Candidate", "Event", "Rule", "Transition", "Shown", "Comparison", "Edge", "Tables"}
WAYS = {"copy": copy.copy, "deepcopy": copy.deepcopy, "pickle": lambda item: pickle.loads(pickle.dumps(item))}


def impacts(**parameters):
    return bf.systems.impact_oscillator(omega=1.4, **parameters)


def branch(**options):
    return bf.trace(bf.find_orbit(bf.systems.duffing_oscillator()), "omega", bounds=(0.45, 2.0), **options)


def delayed(start):
    held = bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.0), DelayedFeedback(0.2, 1.0)], omega=1.3)
    past = bf.find_orbit(bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.0)], omega=1.3))
    return bf.simulate(held, (start, 0.0), t0=past.period, periods=2, history=past)


def driven(amplitude):
    return bf.System(1.0, 0.1, 1.0, [bf.elements.Driven(bf.elements.Jenkins(1.0, 0.5), amplitude)], omega=1.0)


def reduced(keep):
    M, K, names = beam(6)
    return bf.System.from_matrices(M, None, K, dofs=names).reduced(keep, 3).reduction


def cells(zeta):
    system = bf.systems.impact_oscillator(zeta=zeta, omega=2.6, amplitude=1.0, gap=0.0, restitution=0.8)
    return bf.cell_mapping(system, bf.Grid(q0=(-2.5, 0.0, 20), v0=(-3, 3, 20)), periods=5)


def basins(gap):
    return bf.basins_of_attraction(impacts(gap=gap), bf.Grid(q0=(-3, 0.9, 8), v0=(-4, 4, 8)))


# name -> what makes one from a number; two different numbers make two different results
MADE = {
    "trajectory": lambda x: bf.simulate(impacts(), (0.0, x), periods=4),
    "event": lambda x: bf.simulate(impacts(), (0.0, 4.0 * x), periods=4).events[0],
    "events": lambda x: bf.simulate(impacts(), (0.0, x), periods=4).events,
    "delayed": delayed,
    "orbit": lambda x: bf.find_orbit(impacts(amplitude=0.5 + 0.1 * x)),
    "balance": lambda x: bf.find_orbit(bf.systems.duffing_oscillator(amplitude=0.5 + 0.1 * x), method=bf.HarmonicBalance(3)),
    "equilibrium": lambda x: bf.find_equilibrium(bf.systems.belt_oscillator(belt_speed=2.0 + x)),
    "branch": lambda x: branch(ds=0.02 + 0.01 * x),
    "point": lambda x: branch().special_points[int(x > 0.3)],
    "points": lambda x: branch().special_points[:1 + int(x > 0.3)],
    "audit": lambda x: branch(ds=0.02 + 0.01 * x).audit,
    "end": lambda x: branch(ds=0.02 + 0.01 * x).ends[0],
    "solution": lambda x: bf.continuation.problem.Solution(np.array([x, np.nan]), 1.0),
    "mode": lambda x: bf.extended_mode(bf.systems.jenkins_oscillator(), 2.0 + x, method=bf.HarmonicBalance(1)),
    "backbone": lambda x: bf.backbone(bf.systems.jenkins_oscillator(), [2.0, 2.0 + x], method=bf.HarmonicBalance(1)),
    "reduction": lambda x: reduced(["tip.uy"] if x > 0.3 else ["2.uy"]),
    "structure": lambda x: bf.structure.checks.checked(np.eye(2), None, np.diag([1.0, x])),
    "exponents": lambda x: bf.lyapunov_exponents(impacts(), (0.0, x), periods=40, transient=2),
    "grid": lambda x: bf.Grid(q0=(-3, x, 8)),
    "section": lambda x: bf.Section(coordinate="q0", value=x),
    "basins": lambda x: basins(1.0 + 0.1 * x),
    "noise": lambda x: basins(1.0 + 0.1 * x).noise,
    "cells": lambda x: cells(0.02 + 0.01 * x),
    "diagram": lambda x: bf.bifurcation_diagram(impacts(), "amplitude", [0.5, 0.5 + x], transient=20, keep=8),
    "loop": lambda x: bf.hysteresis(driven(1.0 + x)),
}


@pytest.mark.parametrize("name", MADE)
def test_results_are_equal_by_content_and_copied_as_they_are(name):
    one, same, other = MADE[name](0.25), MADE[name](0.25), MADE[name](0.5)
    assert one == one and one == same and hash(one) == hash(same) and not one != same
    assert one != other and not one == other and one != name and one in [other, same] and other not in [one]
    assert len({one, same, other}) == 2
    for way in WAYS.values():
        again = way(one)
        assert again == one and hash(again) == hash(one) and again != other and type(again) is type(one)
        assert_read_only(again)
    assert_read_only(one)


def assert_read_only(result):
    """Arrays of a result cannot be written, or are copies: what is written does not come back."""
    for item in result if isinstance(result, tuple) else (result,):
        if not dataclasses.is_dataclass(item):
            continue
        for field in dataclasses.fields(item):
            value = getattr(item, field.name)
            if isinstance(value, np.ndarray) and value.size and type(item).__name__ != "Recorded":
                if value.flags.writeable:
                    before = value.copy()
                    value.flat[0] += 1
                    assert alike(getattr(item, field.name), before), field.name
                else:
                    with pytest.raises(ValueError, match="read-only"):
                        value.flat[0] = 0


def written(value):
    """Write into an array or a sparse matrix, as a user may by mistake."""
    for part in (value.data, value.indices, value.indptr) if hasattr(value, "indptr") else (value,):
        try:
            part.flat[0] = part.flat[-1] + 1
        except (ValueError, TypeError):
            assert not part.flags.writeable


def arrays_of(result, path=""):
    """Return the public arrays and sparse matrices of a result, properties included, and of what it holds: (path, owner, name)."""
    found, kind = [], type(result)
    if isinstance(result, list | tuple) and not hasattr(result, "_fields"):
        return [item for k, part in enumerate(result[:2]) for item in arrays_of(part, f"{path}[{k}]")]
    if not (isinstance(result, Content) or hasattr(result, "_fields")) or kind.__name__ in INNER:
        return found
    for name in (name for name in dir(result) if name[0] != "_" and name != "trust"):
        if callable(getattr(kind, name, None)) or name in ("system", "problem", "problems", "scene", "equations"):
            continue
        try:
            value = getattr(result, name)
        except (ValueError, AttributeError):  # what this one does not have
            continue
        if isinstance(value, np.ndarray) and value.size or hasattr(value, "indptr"):
            found.append((f"{path}.{name}", result, name))
        else:
            found += arrays_of(value, f"{path}.{name}")
    return found


@pytest.mark.parametrize("name", MADE)
def test_what_is_written_into_an_array_of_a_result_does_not_come_back(name):
    """Of every class of result: fields, properties that are computed once, sparse matrices, and those of attractors and points."""
    arrays = arrays_of(MADE[name](0.25), name)
    for path, owner, of in arrays:
        before = copy.deepcopy(getattr(owner, of))
        written(getattr(owner, of))
        assert alike(getattr(owner, of), before), path


def test_arrays_of_results_are_found():
    """The search above does not pass over what it is for."""
    found = {path for name in ("orbit", "equilibrium", "cells") for path, _, _ in arrays_of(MADE[name](0.25), name)}
    assert {"orbit.state", "orbit.multipliers", "orbit.monodromy", "orbit.weights", "equilibrium.eigenvalues", "cells.matrix",
            "cells.components.label", "cells.groups[0].cells", "cells.attractors[0].state"} <= found


def test_labels_cannot_be_written_and_negative_ones_are_no_attractors():
    found = basins(1.0)
    before = dict(found.fractions)
    with pytest.raises(ValueError, match="read-only"):
        found.labels[:] = 0
    assert found.fractions == before
    count = len(found.attractors)
    assert np.array_equal(found.points(0), found.attractors[0].sections)
    for label in (-1, -count, count, 0.0, True, None, "0"):
        with pytest.raises(ValueError, match=r"label = .* is not allowed; it must be 0 \.\. .*-1 marks starts that led to no"):
            found.points(label)
    made = cells(0.02)
    with pytest.raises(ValueError, match="label = -1 is not allowed"):
        made.points(-1)
    for group in (-1, len(made.groups), True, None, "0", object()):
        with pytest.raises(ValueError, match=r"group = .* is not allowed; it must be 0 \.\. .*-1 is the sink"):
            made.density(group)


@dataclasses.dataclass(frozen=True, eq=False)
class Kept(Content):
    a: np.ndarray
    b: object = None


def test_an_array_that_somebody_else_holds_stays_writable():
    mine = np.arange(6.0)
    kept = Kept(mine[1:], (1.0, [np.nan]))
    assert kept.a.base is mine and not kept.a.flags.writeable and mine.flags.writeable  # a view, no copy
    mine[0] = 7.0
    assert Kept(mine[1:], (1.0, [np.nan])) == kept


@pytest.mark.parametrize("one, other, equal", [
    (np.array([1.0, np.nan]), np.array([1.0, np.nan]), True), (np.zeros(2), np.zeros(3), False),
    (np.zeros(2), np.zeros((2, 1)), False),
    (np.zeros(2), np.zeros(2, int), False), (np.array([0.0]), np.array([-0.0]), True), (np.nan, float("nan"), True),
    (1, 1.0, True), (complex(np.nan, 1), 2j, False), ((1, np.ones(2)), (1, np.ones(2)), True), ([1], (1,), False),
    ({"a": np.ones(2)}, {"a": np.ones(2)}, True), ({"a": 1}, {"b": 1}, False), ({"a": 1}, {"a": 2}, False), (None, 0, False),
    (np.array(["x"]), np.array(["x"]), True), (np.array([{"a": np.ones(2)}], object), np.array([{"a": np.ones(2)}], object), True)])
def test_what_is_alike(one, other, equal):
    assert alike(one, other) is equal and alike(other, one) is equal and (Kept(None, one) == Kept(None, other)) is equal
    if equal:
        assert digest(one) == digest(other) and hash(Kept(None, one)) == hash(Kept(None, other))


def test_read_only_goes_into_tuples():
    first, rest = read_only([np.ones(2), "a"])
    assert not first.flags.writeable and rest == "a" and read_only("a") == "a"


def test_every_frozen_class_with_arrays_is_known_by_its_content():
    """Classes of the package that hold arrays and are frozen: results among them are `Content`, and compare no other way."""
    bases, frozen = {}, {}
    for path in SOURCES.rglob("*.py"):
        text = path.read_text()
        for node in ast.parse(text).body if "@dataclass" in text or "(Content" in text else ():
            if not isinstance(node, ast.ClassDef):
                continue
            bases[node.name, path] = bases[node.name] = [ast.unparse(base) for base in node.bases]
            words = [ast.unparse(item) for item in node.decorator_list]
            arrays = any(isinstance(item, ast.AnnAssign) and "ndarray" in ast.unparse(item.annotation) for item in node.body)
            if arrays and any("dataclass" in word and "frozen=True" in word for word in words):
                frozen[node.name, path] = " ".join(words)

    def known(key):
        return key == "Content" or any(known(base) for base in bases.get(key, []))

    inner = {key for key in frozen if key[0] in INNER or key[0][0] == "_"}
    assert not sorted(key for key in frozen if not known(key) and key not in inner)
    assert not [key for key, words in frozen.items() if known(key) and "eq=False" not in words]


def test_named_tuples_of_arrays_are_told_apart_by_content():
    one, same, other = (Absorption(*(np.full(2, value) for value in (0.5, 0.25, np.nan, last))) for last in (1.0, 1.0, 2.0))
    assert one == same and hash(one) == hash(same) and not one != same
    assert one != other and not one == other and one != tuple(one)
