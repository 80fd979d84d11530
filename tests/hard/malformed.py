"""Malformed calls of the public face, drawn from signatures: every argument of every function and method gets what it cannot mean.

`cases` lists what can be called: public functions, elements, ready systems, and the methods of every kind of result, each with a
valid call that is quick.  `WRONG` says for every kind of argument what it cannot be, and `KIND` which kind an argument of a name
is; `everything` combines them all, `draw` some at random.  `verdict` runs one call within a limit of processor time and says what
came of it.  A good end is an error whose text names the argument or shows the value; one from the depths of Python or numpy is
confusing.
"""

import decimal
import enum
import fractions
import functools
import inspect
import itertools
import math
import os
import pathlib
import re
import signal
import tempfile
import types
import warnings
from typing import Any, NamedTuple

import matplotlib
import numpy as np
import scipy.io

import bifurc as bf
from bifurc import elements as el
from bifurc.explore.model import of_system

matplotlib.use("Agg")


class Case(NamedTuple):
    """Something public that can be called, with a valid call of it."""

    name: str
    function: Any
    base: dict  # a valid call
    kinds: dict  # kind of argument by name, where it is not that of `KIND`


class Hostile:
    """Something that answers every question with an error of its own."""

    def __repr__(self):
        raise RuntimeError("no repr")

    def __len__(self):
        raise RuntimeError("no length")

    def __array__(self, *_, **__):
        raise RuntimeError("no array")

    def __float__(self):
        raise RuntimeError("no float")

    __int__ = __index__ = __bool__ = __iter__ = __fspath__ = __float__

    def __eq__(self, other):
        raise RuntimeError("no equality")

    __hash__ = object.__hash__

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        raise RuntimeError("no attributes")


class Pair:
    """Something with a shape and no sense."""

    shape = (2,)
    ndim = 1


class HostileList(list):
    """A list that cannot be gone through."""

    def __iter__(self):
        raise RuntimeError("no iteration")


class HostileText(str):
    """A text that compares with nothing."""

    def __eq__(self, other):
        raise RuntimeError("no equality")

    __hash__ = str.__hash__


PLACE = tempfile.mkdtemp()  # all that a call may write lies here
NOTHING, HOSTILE, GENERATOR, COUNTER = object(), Hostile(), (i for i in ()), itertools.count()
STRANGE = [
    NOTHING,
    HOSTILE,
    GENERATOR,
    Pair(),
    bf.System,
    math,
    b"omega",
    {"a": 1},
    {1, 2},
    1j,
    range(0),
    memoryview(b"ab"),
    ...,
    frozenset("q0"),
    decimal.Decimal("1.5"),
    np.complex128(1.0),
    np.datetime64("2020-01-01"),
    np.timedelta64(3, "s"),
    np.bytes_(b"q0"),
    np.array(None),
    np.ma.masked,
    slice(0, 1),
    bf.systems,
    COUNTER,
]
LISTS = [
    [],
    [1.0, 2.0],
    (0.5, 1.5, 2.5),
    np.array([1.0, 2.0]),
    np.zeros((2, 2)),
    ["a"],
    [None],
    [[1.0], [2.0, 3.0]],
    np.array([]),
    [True, 1.0],
    np.ma.array([1.0, 2.0], mask=[True, False]),
    np.array([1.0, None]),
    np.array([1j, 2.0]),
    np.array(["2020"], "M8[Y]"),
    HostileList([1.0]),
]
WORDS = ["", "x", "1.0", "nonsense", "omega ", np.str_("nonsense"), HostileText("nonsense")]
BOOLS = [True, False, np.True_, np.array(True)]
BROKEN = [math.nan, math.inf, -math.inf, np.float64("nan"), np.array(math.inf)]
NUMBERS = [3, 2.5, -1, np.float64(1.5), np.int64(2), np.array(2.0), 0]
GIGANTIC = [10**400, -(10**400)]
NO_NUMBER = [*STRANGE, *LISTS, *WORDS, *BOOLS, *BROKEN, *GIGANTIC, None]
NO_WHOLE = [*NO_NUMBER, 1.5, -3, np.float64(2.5), 2.0, 10**30]
NO_OBJECT = [*STRANGE, *LISTS, *WORDS, *BOOLS, *NUMBERS, None]
NO_LIST = [
    *STRANGE,
    *WORDS,
    *BOOLS,
    None,
    ["a"],
    [None],
    [math.nan],
    [1j],
    [[1.0], [2.0, 3.0]],
    np.array(["1.0"]),
    [HOSTILE],
    ["1.0"],
    [True, 1.0],
    [False, np.timedelta64(1)],
    np.ma.array([1.0, 2.0], mask=[True, False]),
    np.array([1.0, None]),
    np.array(["2020"], "M8[Y]"),
    [10**400],
    HostileList([1.0]),
]
NO_RANGE = [
    (1, -1, 10),
    (0, 1, 0),
    (0, 1, -5),
    (0, 1, 2.5),
    (math.nan, 1, 5),
    (0, math.inf, 5),
    (0, 1),
    3,
    (0, 1, True),
    (0, 1, 10**30),
]
NO_MAPPING = [*STRANGE[:7], *LISTS, *WORDS, *BOOLS, 3, {"z0": (0, 1)}, {3: 1.0}, [("q0", 0, 1)], {"q7": 1.0}, {"q0": "x"}]
WRONG = {  # what an argument of a kind cannot be
    "number": NO_NUMBER,
    "positive": [*NO_NUMBER, 0.0, -1.0, -1e-300],
    "ratio": [*NO_NUMBER, -0.1, -1e-3],
    "share": [*NO_NUMBER, 0.0, -1e-9, 2.0],
    "index": NO_WHOLE,
    "count": [*NO_WHOLE, 0],
    "points": [*NO_WHOLE, 0, 10**12],
    "flag": [*STRANGE, *LISTS, *WORDS, *BROKEN, None, 1, 0, "yes"],
    "switch": [v for v in [*STRANGE, *LISTS, *WORDS, 1, 0, 2.5] if not callable(v)],
    "word": [*STRANGE, *LISTS, *BOOLS, *NUMBERS, *BROKEN, None, ""],
    "choice": [*STRANGE, *LISTS, *WORDS, 7, -3, math.nan, 1.5],
    "label": [*STRANGE, *LISTS, *BOOLS, *NUMBERS],
    "far": [*[v for v in NO_WHOLE if not (type(v) is int and v == -3)], 10**6],
    "complex": [v for v in NO_NUMBER if not isinstance(v, complex | float)],
    "numbered": [v for v in NO_WHOLE if v is not None],
    "boxes": [*NO_WHOLE, 0],
    "scalars": [*NO_LIST, [math.inf], [[1.0, 2.0]], np.zeros((2, 2, 2)), math.nan, (1.0, 2.0)],
    "offset": [*NO_LIST, -0.1, 1.5, [1.0, 2.0], (0.5, 0.5, 0.5), math.nan],
    "cells": [*NO_LIST, 0.5, [1.0], -1, [36], 10**30],
    "pairs": [*NO_LIST, [1.0, 2.0], 3.0, [], [[1.0, 2.0, 3.0]]],
    "factors": [v for v in [*STRANGE, *BOOLS, 1.5, -3, None, 10**30, [0.0, 0.0], np.zeros((2, 2)), [math.nan], [True, 1.0], [[]]]],
    "window": [*NO_MAPPING, {"q7": (0.0, 1.0)}, {"q0": (1.0, -1.0)}, {"q0": 1.0}],
    "two": [*NO_RANGE, *STRANGE, *WORDS, *BOOLS, (1.0, 0.0), (0.0, 0.0), (0.0, math.nan), (0.0, 1.0, 2.0, 3.0)],
    "named": [*NO_OBJECT, "nonsense", "restitution[0]"],
    "side": [*STRANGE, *LISTS, *WORDS, *BROKEN, 0, 2, 1.5, None, True, HOSTILE],
    "object": NO_OBJECT,
    "function": [v for v in NO_OBJECT if not callable(v)],
    "list": [*NO_LIST, [math.inf], [[1.0, 2.0]], np.zeros((2, 2, 2))],
    "array": NO_LIST,
    "states": [*NO_LIST, 3.0, [], Pair()],
    "state": [*NO_LIST, 3.0, (1.0,), (1.0, 2.0, 3.0), (math.nan, 0.0), (0.0, math.inf), Pair(), [["a"]], np.zeros((2, 2))],
    "start": [v for v in [*NO_LIST, 3.0, (1.0,), (1.0, 2.0, 3.0), (math.nan, 0.0), (0.0, math.inf), Pair()] if v is not None],
    "pair": [*NO_OBJECT, (1.0, 1.0), (math.nan, 2.0), (1.0,), (0.5, 1.0, 2.0), (None, 1.0), ("a", "b"), {"a": 1.0, "b": 2.0}],
    "values": [*NO_LIST, [], [math.inf], [[1.0], [1.1]], [True, "a"]],
    "shift": [*[v for v in NO_OBJECT if v is not None], *BROKEN, {"q0": "x"}, {"q0": math.nan}, {"q0": 0.0}, {"q7": 1.0},
              ["q0", "q0"], ["q0", 3], "v0"],
    "range": [*NO_RANGE, *STRANGE, *WORDS, None],
    "mapping": NO_MAPPING,
    "filled": [*NO_MAPPING, {}, None],
    "path": [*STRANGE[:4], *LISTS, *BOOLS, 3, 2.5, "", "a\0b", None, b"omega"],
    "folder": [
        f"{PLACE}/no/such/folder/result.npz",
        PLACE,
        f"{PLACE}/foreign.txt",
        f"{PLACE}/fifo",
        "",
        "a\0b",
        3,
        NOTHING,
        HOSTILE,
        [],
        True,
        2.5,
    ],
    "filled_matrix": [*STRANGE, *WORDS, *BOOLS, *BROKEN, [[1.0, 2.0]], [["a"]], [[1.0, math.inf], [0.0, 1.0]], [], [[[1.0]]]],
    "seat": [*STRANGE, *LISTS, *BOOLS, 1.5, -3, None, 10**30],
    "member": [*NO_WHOLE, 99],
    "trace": [],
    "matrix": [*STRANGE, *WORDS, *BOOLS, *BROKEN, [[1.0, 2.0]], [["a"]], [[1.0, math.inf], [0.0, 1.0]], [], [[[1.0]]], None],
    "elements": [
        3,
        [3],
        [bf.systems],
        "abc",
        [el.RigidStop],
        b"ab",
        NOTHING,
        HOSTILE,
        {"a": 1},
        [None],
        np.array(1.0),
        [HOSTILE],
        True,
    ],
    "classes": [3, [3], "abc", [None], NOTHING, HOSTILE, {"a": 1}, True, [HOSTILE]],
    "executor": [v for v in NO_OBJECT if v is not None and not callable(v)],
    "names": [3, "ab", [("omega", "x")], {"omega": 3}, {3: "x"}, NOTHING, HOSTILE, True],
    "axes": [v for v in NO_OBJECT if v is not None],
    "dofs": [3, "ab", ["a", "b", "c", "d"], [3], [None], NOTHING, HOSTILE, [["a"], 3]],
    "signed": [*NO_NUMBER, 1.5, 10**30, 99, -99],
    "harmonics": [
        *STRANGE[:10],
        *BOOLS,
        *BROKEN,
            "",
        0,
        -1,
        1.5,
        (1, 1),
        (1.0, -1.0),
        (0.0,),
        [math.nan],
        ["a"],
        [],
        (True, 2),
        None,
    ],
    "directions": [*NO_OBJECT[:-1], ("up", "up"), ("q0", "sideways"), "sideways", None, ["up", 3]],
    "place": [*STRANGE, *LISTS, *BOOLS, 1.5, -3, None, "nonsense", 10**30],
    # of systems of first order with one state
    "states named": [*STRANGE, *LISTS[:5], *LISTS[6:], *BOOLS, *NUMBERS, None, "", "1.0", "x x", "if", "t", "x\0", ["x", 3]],
    "fields": [*NO_OBJECT, {}, {"-": 3, "+": 4}, {"-": bf.AffineField([[-1.0]])}, {3: bf.AffineField([[-1.0]])}],
    "rules": [*[v for v in NO_OBJECT if not isinstance(v, types.GeneratorType)], [3], [bf.Switch], [bf.AffineSurface([1.0])]],
    "surface": [*NO_OBJECT, lambda x: x, bf.AffineField([[1.0]]), [1.0]],
    "reset": [*[v for v in NO_OBJECT if v is not None], lambda x: x, bf.AffineField([[1.0]]), [1.0]],
    "modes named": [*[v for v in NO_OBJECT if v is not None], "nonsense", ["nonsense"], [None], {"rise": 1.0}],
    "ticks": [*[v for v in NO_OBJECT if v is not None], {0.0: "decide"}, {1.0: "decide"}, {"a": "decide"}, {0.5: 3}, {0.5: [None]}],
    "names of modes": [*STRANGE, *LISTS[:5], *LISTS[6:], *BOOLS, *NUMBERS, None, [None], ["rise", 3]],
    "rows": [*STRANGE, *WORDS, *BOOLS, *BROKEN, None, [[1.0, 2.0]], [["a"]], [[1.0, math.inf], [0.0, 1.0]], [], [[[1.0]]], 3.0],
    "constants": [*[v for v in NO_LIST if v is not None], [math.inf], [1.0, 2.0], [[1.0, 2.0]], np.zeros((2, 2, 2)), 3.0],
    "amplitudes of harmonics": [*STRANGE, *LISTS, *WORDS, *BOOLS, 3, {1: "x"}, {0: [1.0]}, {1: [1.0, 2.0]}, {1.0: [1.0]}],
    "first order start": [v for v in [*NO_LIST, 3.0, (1.0, 2.0), (math.nan,), Pair(), {"y": 1.0}, {"q0": 1.0}, {"x": "a"},
                                      {"x": math.nan}, {3: 1.0}, {"x 1": 1.0}] if v is not None],
}
KIND = {
    name: kind
    for kind, names in {
        "object": "system grid point edge motion attractor found chart cells diagram ramp sweep curve loop "
        "trajectory orbit basins made "
        "rotor problem branch pair_of what kind",
        "state": "y0 y x0",
        "start": "guess start starts",
        "number": "t0 value amplitude phase offset gain energy speed zeta belt_speed gap "
        "friction_negative alpha beta gravity eccentricity load unbalance preload centre_x centre_y surface_speed "
        "frame_spin c2 c3 c4 c5 "
        "force load_amplitude load_phase amplitude_x amplitude_y load_middle load_end contact_damping size "
        "static_ratio p section",
        "positive": "period omega nu ds ds_max ds_min distance mass_ratio radius limit_ low high stiffness_ratio "
        "limit width height "
        "speed_ratio delay",
        "ratio": "duration memory noise h friction damping",
        "share": "tolerance",
        "index": "x against_x against_y transient max_steps mode seed audit start_ i",
        "member": "dof label group axis component",
        "shift": "shift",
        "count": "variation_harmonic checks periods max_events max_periods batches longest most_branches workers chunk keep most "
        "steps cells side_ rate probes precision "
        "iterations n_max least first harmonic load_harmonic columns rows",
        "points": "samples n frames count",
        "flag": "clocked exponents stretches symmetric browser odd closed points_",
        "switch": "progress",
        "word": "coordinate method_ measure field column name second itinerary",
        "label": "label",
        "named": "parameter element",
        "choice": "case condense aft solver audit_ of past release curve_ damper law law_ closure direction",
        "side": "side",
        "function": "jacobian stop record say plot_",
        "pair": "bounds pair dofs_",
        "values": "cosines sines values amplitudes ratios frequencies",
        "mapping": "at window",
        "filled": "region parameters",
        "path": "path out",
        "folder": "file",
        "elements": "elements",
        "executor": "executor method history",
        "names": "names",
        "axes": "ax axes saddle unstable stable",
        "matrix": "M C K G mass stiffness",
        "signed": "stopped loaded",
        "place": "keep site",
        "directions": "directions periodic",
        "harmonics": "harmonics",
        "trace": "trace",
        "array": "t",
        "list": "loads load_amplitudes load_phases branches attractors known monitors peaks row limits stiffnesses",
        "dofs": "dofs",
    }.items()
    for name in names.split()
}
"""Names of arguments by kind; those with an underscore keep a name out of a kind."""


@functools.cache
def made() -> dict[str, Any]:
    """Return one of every kind of result, quickly made."""
    A = bf.systems.impact_oscillator(omega=1.4)
    found: dict[str, Any] = {
        "two": bf.System(
            np.eye(2), 0.1 * np.eye(2), [[2.0, -1.0], [-1.0, 1.0]], [el.HarmonicForce(0.3), el.RigidStop(gap=1.0)], omega=0.7
        ),
        "system": A,
    }
    found["free"] = bf.System(1.0, 0.1, 1.0, [el.RigidStop(gap=1.0)])
    found["linear"] = bf.System(1.0, 0.1, 1.0)
    found["conservative"] = bf.System(1.0, 0.0, 1.0, [el.CubicSpring(0.5)])
    found["trajectory"] = bf.simulate(A, (0.0, 0.0), periods=3)
    found["orbit"] = bf.find_orbit(A)
    found["branch"] = bf.trace(found["orbit"], "omega", bounds=(1.2, 1.41))
    found["point"] = found["branch"].special_points[0]
    found["curve"] = bf.trace_curve(found["point"], ("omega", "amplitude"), bounds=((1.2, 1.41), (0.5, 0.56)), max_steps=2)
    found["balance"] = bf.find_orbit(bf.systems.duffing_oscillator(), method=bf.HarmonicBalance(3))
    found["equilibrium"] = bf.find_equilibrium(found["free"])
    found["grid"] = bf.Grid(q0=(-3, 1, 6), v0=(-4, 4, 6))
    found["basins"] = bf.basins_of_attraction(A, bf.Grid(q0=(-3, 1, 20), v0=(-4, 4, 20)), max_periods=200)
    found["edge"] = bf.edge_state(found["basins"])
    found["cells"] = bf.cell_mapping(A, found["grid"], audit=0)
    found["region"] = {"q0": (-1.0, 0.5), "v0": (-1.0, 1.0)}
    found["sweep"] = bf.sweep(A, "omega", [1.4, 1.41], found["region"], samples=8)
    found["diagram"] = bf.bifurcation_diagram(A, "omega", [1.4, 1.41], transient=4, keep=4)
    found["chart"] = bf.parameter_chart(
        A, {"omega": [1.4, 1.41], "gap": [1.0, 1.1]}, found["region"], starts=1, transient=4, longest=2
    )
    found["ramp"] = bf.ramp(A, "omega", (1.4, 1.41), steps=3, periods=1)
    found["atlas"] = bf.atlas(A, "omega", (1.39, 1.41), found["region"], probes=2, checks=1, samples=8)
    found["hysteresis"] = bf.hysteresis(bf.systems.macro_slip_contact(case=1))
    found["loop"] = next(
        iter(found["hysteresis"].loops.values() if isinstance(found["hysteresis"].loops, dict) else found["hysteresis"].loops)
    )
    found["backbone"] = bf.backbone(bf.System(1.0, 0.0, 1.0, [el.CubicSpring(0.5)]), [0.1, 0.2], method=bf.HarmonicBalance(3))
    found["reduced"] = bf.systems.impact_chain(n=6).reduced(keep=[5], modes=2)
    found["saddle"] = found["edge"].saddle
    found["controller"] = bf.control.ogy(found["saddle"], "amplitude")
    found["controlled"] = found["controller"].simulate(found["saddle"].state, periods=3, limit=0.1)
    found["delayed_orbit"] = bf.find_orbit(bf.System(1.0, 0.2, 1.0, [el.HarmonicForce(0.3)], omega=1.3))
    found["delayed"] = bf.System(1.0, 0.2, 1.0, [el.HarmonicForce(0.3), el.DelayedFeedback(0.1, delay=1.0)], omega=1.3)
    found["smooth"] = bf.continuation.maps.SquareRootMap(lam=0.5, mu=0.1)
    found["file"] = f"{PLACE}/matrix.mtx"
    scipy.io.mmwrite(found["file"], np.eye(2), symmetry="general")
    pathlib.Path(PLACE, "foreign.txt").write_text("not ours")
    os.mkfifo(f"{PLACE}/fifo")
    found["friction"] = bf.systems.jenkins_oscillator()
    found["relay"] = bf.PiecewiseSystem("x", dict.fromkeys("-+", bf.AffineField([[-1.0]], [0.5])), [RELAY])
    found["spiking"] = bf.systems.integrate_and_fire()
    found["stable"], found["unstable"] = found["edge"].stable_set(periods=2), found["edge"].unstable_set(periods=2)
    found["refined"] = bf.refined_basins(A, found["grid"], max_periods=100)
    found["model"] = bf.read(mass=found["file"], stiffness=found["file"])
    found["reduction"] = found["reduced"].reduction
    found["map diagram"] = found["smooth"].diagram("mu", [0.1, 0.2], transient=5, keep=3)
    found["feedback"] = bf.control.feedback_range(found["saddle"], samples=5)
    found["branch"].save(f"{PLACE}/branch.npz")
    found["figure"] = bf.plotting.figure()[0]
    found["certificate"], found["branch certificate"] = found["orbit"].certify(), found["branch"].certify(stretches=False)
    found["point certificate"] = found["point"].certify()
    found["feedback basins"] = bf.control.feedback_basins(
        found["delayed"], found["delayed_orbit"], bf.Grid(q0=(-1, 0, 2), v0=(-1, 0, 2)), max_periods=5
    )
    found["method"], found["section"] = bf.HarmonicBalance(3), bf.Section("q0")
    found["special points"], found["mode"] = found["branch"].special_points, bf.extended_mode(found["conservative"], 0.1)
    found["stop"], found["slider"], found["driven"] = el.RigidStop(), el.Jenkins(), el.Driven(el.Jenkins())
    found["shown"] = of_system(A)
    return found


NOT_CALLED = {  # what a user never calls: the protocol of elements and problems, records, and what reads and writes them
    "from_record",
    "to_record",
    "of_halves",
    "joined",
    "reaching",
    "mirrored",
    "mirrored_guard",
    "mirrored_key",
    "site",
    "mode",
    "placed",
    "ordered",
    "loaded",
    "stored_energy",
    "default_label",
    "past",
    "but",
    "differs_in_omega_only",
    "with_audit",
    "with_labels",
    "balance",
    "condensed",
    "place",
    "places",
    "base",
    "starts",
    "rows",
    "seated",
    "step",
    "slope",
    "piece_of",
    "to_xarray",
    "to_pandas",
}
RECORDS = {  # results: the package makes them
    "Trajectory",
    "PeriodicOrbit",
    "HarmonicOrbit",
    "Equilibrium",
    "Branch",
    "SpecialPoint",
    "BasinMap",
    "CellMap",
    "Atlas",
    "Ramp",
    "Certificate",
    "Model",
    "StiffModelWarning",
}
OPEN = {"PiecewiseSystem", "HybridSystem"}  # any other name is that of a parameter
AUTHORS = {  # what authors of elements and problems derive from
    "Affine",
    "AroundPoint",
    "AtRow",
    "Circle",
    "Core",
    "Element",
    "Frame",
    "Guard",
    "Hold",
    "Kick",
    "Law",
    "LoadedContact",
    "Mode",
    "Rate",
    "Restitution",
    "Ring",
    "Rows",
    "Algebraic",
    "SliderSet",
    "Surface",
    "Switched",
    "Wall",
    "WatchedCore",
}


def accepted(*_):
    """Stand in the way of what would serve a browser: the call was accepted."""
    raise Served


class Served(Exception):
    """A call that got as far as serving."""


def bases(m) -> dict[str, dict]:
    """Return a valid call of every public function that needs an argument."""
    A, region, orbit, spring = m["system"], m["region"], m["orbit"], m["conservative"]
    plot = {
        "plot_atlas": "atlas",
        "plot_backbone": "backbone",
        "plot_basins": "basins",
        "plot_field": "basins",
        "plot_branch": "branch",
        "plot_cells": "cells",
        "plot_morse": "cells",
        "plot_curve": "curve",
        "plot_loop": "loop",
        "plot_orbit": "orbit",
        "plot_trajectory": "trajectory",
        "plot_chart": "chart",
        "plot_diagram": "diagram",
        "plot_edge": "edge",
        "plot_ramp": "ramp",
        "plot_sweep": "sweep",
        "full_spectrum": "orbit",
        "plot_full_spectrum": "orbit",
        "describe": "orbit",
        "animate_orbit": "orbit",
        "plot_controlled": "controlled",
        "plot_feedback": "feedback",
        "plot_map_diagram": "map diagram",
    }
    first = {name: next(iter(inspect.signature(getattr(bf.plotting, name)).parameters)) for name in plot}
    return {
        "System": {"mass": 1.0, "damping": 0.1, "stiffness": 1.0},
        "simulate": {"system": A, "y0": (0.0, 0.0), "periods": 2},
        "System.from_matrices": {"M": np.eye(2), "C": None, "K": np.eye(2)},
        "hysteresis": {"system": bf.systems.macro_slip_contact(case=1)},
        "find_orbit": {"system": A, "guess": (0.0, 0.0), "transient": 9},
        "energy": {"system": spring, "y": (1.0, 0.0)},
        "nonlinear_mode": {"system": spring},
        "find_equilibrium": {"system": m["free"]},
        "lyapunov_exponents": {"system": A, "y0": (0.0, 0.0), "periods": 20, "transient": 5, "batches": 4},
        "trace": {"start": orbit, "parameter": "omega", "bounds": (1.39, 1.41), "max_steps": 3},
        "trace_curve": {
            "point": m["point"],
            "parameters": ("omega", "amplitude"),
            "bounds": ((1.2, 1.41), (0.5, 0.56)),
            "max_steps": 1,
        },
        "switch_branch": {"point": m["point"]},
        "basins_of_attraction": {"system": A, "grid": m["grid"], "max_periods": 100},
        "Grid": {"q0": (0, 1, 3)},
        "Section": {"coordinate": "q0"},
        "cell_mapping": {"system": A, "grid": m["grid"], "audit": 0},
        "refined_basins": {"system": A, "grid": m["grid"], "max_periods": 100},
        "sweep": {"system": A, "parameter": "omega", "values": [1.4], "region": region, "samples": 4},
        "atlas": {
            "system": A,
            "parameter": "omega",
            "bounds": (1.39, 1.41),
            "region": region,
            "probes": 1,
            "checks": 1,
            "samples": 4,
        },
        "extended_mode": {"system": spring, "amplitude": 0.1, "method": bf.HarmonicBalance(3)},
        "backbone": {"system": spring, "amplitudes": [0.1], "method": bf.HarmonicBalance(3)},
        "edge_state": {"basins": m["basins"], "max_periods": 5},
        "bifurcation_diagram": {"system": A, "parameter": "omega", "values": [1.4], "transient": 2, "keep": 2},
        "ramp": {"system": A, "parameter": "omega", "bounds": (1.4, 1.41), "steps": 2, "periods": 1},
        "parameter_chart": {
            "system": A,
            "parameters": {"omega": [1.4], "gap": [1.0]},
            "region": region,
            "starts": 1,
            "transient": 2,
            "longest": 2,
        },
        "load": {"path": f"{PLACE}/branch.npz"},
        "Branch.load": {"path": f"{PLACE}/branch.npz"},
        "read": {"mass": m["file"], "stiffness": m["file"]},
        "from_ross": {"rotor": types.SimpleNamespace(M=matrix, C=matrix, K=matrix, G=nothing, number_dof=4), "speed": 1.0},
        "modal_damping": {"M": np.eye(2), "K": np.eye(2), "ratios": [0.1]},
        "rayleigh_damping": {"M": np.eye(2), "K": np.eye(2), "beta": 0.1},
        "control.controlled_multipliers": {"orbit": m["saddle"], "of": "displacement", "gain": 0.1},
        "control.feedback_basins": {
            "system": m["delayed"],
            "orbit": m["delayed_orbit"],
            "grid": bf.Grid(q0=(-1, 0, 2), v0=(-1, 0, 2)),
            "max_periods": 5,
        },
        "control.feedback_range": {"orbit": m["saddle"], "samples": 5},
        "control.ogy": {"orbit": m["saddle"], "parameter": "amplitude"},
        "continuation.deflated_orbits": {"system": A, "known": [orbit], "most": 1},
        "continuation.deflated_solutions": {"problem": m["branch"].problems[0], "most": 1},
        "continuation.isolas": {"point": m["point"], "second": "amplitude", "value": 0.5, "bounds": ((1.2, 1.41), (0.5, 0.56))},
        "basins.stable_set": {"edge": m["edge"], "periods": 2},
        "basins.unstable_set": {"edge": m["edge"], "periods": 2},
        "certify.certify_branch": {"branch": m["branch"], "stretches": False},
        "certify.certify_orbit": {"orbit": orbit},
        "certify.certify_point": {"point": m["point"]},
        "explore.serve": {"what": A, "bounds": (1.3, 1.5), "browser": False, "say": accepted},
        **{f"plotting.{name}": {first[name]: m[key]} for name, key in plot.items()},
        "plotting.plot_field": {"basins": m["basins"], "field": "periods"},
        "plotting.plot_branches": {"branches": [m["branch"]]},
        "plotting.save_figure": {"made": m["figure"], "path": f"{PLACE}/picture.png"},
        "plotting.figure": {},
        "elements.Driven": {"element": el.Jenkins()},
        "elements.Force": {"law": cube},
        "Trajectory.sample": {"n": 5},
        "PeriodicOrbit.harmonic": {"h": 1},
        "HarmonicOrbit.harmonic": {"h": 1},
        "System.reduced": {"keep": [0], "modes": 1},
        "System.dof": {"name": 0},
        "System.parameter": {"name": "omega"},
        "System.parameter_name": {"name": "omega"},
        "System.recover": {"y": (0.0, 0.0, 0.0, 0.0)},
        "Branch.column": {"name": "omega"},
        "Branch.distance": {"points": [[1.4, 0.1]]},
        "Branch.extend": {"bounds": (1.2, 1.42), "max_steps": 1},
        "ParameterCurve.column": {"name": "omega"},
        "ParameterCurve.distance": {"points": [[1.4, 0.1]], "measure": "amplitude"},
        "ParameterCurve.extend": {"bounds": (0.5, 0.561), "max_steps": 1},
        "ParameterCurve.certify": {},
        "Branch.x": {"i": 0},
        "Certificate.contains": {"multiplier": 0.5},
        "FeedbackBasins.points": {"label": 0},
        "Grid.cells_of": {"points": [[0.0, 0.0]]},
        "Grid.wrapped": {"points": [[0.0, 0.0]]},
        "Grid.require": {"bytes_a_cell": 8.0, "what": "a map"},
        "Section.crossings": {"motion": m["trajectory"]},
    "RigidStop.with_parameters": {"gap": 1.0},
        "Jenkins.with_parameters": {"stiffness": 1.0},
        "Driven.with_parameters": {"amplitude": 1.0},
        "plotting.plot_peaks": {"curves": {"a": (m["branch"], [(1.3, 0.5)])}, "name": "omega"},
        "plotting.plot_responses": {"branches": [m["branch"]], "values": [0.5], "name": "amplitude"},
        "plotting.drawn": {"plot": drawn, "rows": 1, "columns": 1},
        "explore.Session": {"first": m["shown"]},
        "BasinMap.points": {"label": 0},
        "CellMap.points": {"label": 0},
        "CellMap.density": {"group": 0},
        "BasinMap.zoom": {"q0": (-1.0, 0.0), "v0": (-1.0, 1.0), "cells": 3},
        "Atlas.orbits_at": {"value": 1.4},
        "Ramp.nearest": {"branches": [m["branch"]]},
        "Loop.displacement": {"t": 0.1},
        "Loop.force": {"t": 0.1},
        "Loop.sliders": {"t": 0.1},
        "OGYController.correction": {"state": m["saddle"].state},
        "OGYController.window": {"limit": 0.1},
        "OGYController.simulate": {"y0": m["saddle"].state, "periods": 2, "limit": 0.1},
        "Grid.centres": {"axis": 0},
        "Grid.points": {"cells": [0]},
        "HarmonicBalance.layout": {"n": 1},
        "SquareRootMap.iterate": {"x0": (0.1,), "n": 3},
        "SquareRootMap.find": {"n": 1},
        "SquareRootMap.exponents": {"iterations": 20, "starts": 4, "transient": 5},
        "SquareRootMap.diagram": {"parameter": "mu", "values": [0.1], "transient": 5, "keep": 3},
        "SpecialPoints.of": {"kind": "fold"},
        "Trajectory.animate": {"frames": 2},
        "BasinMap.uncertainty": {},
        "BasinMap.labeller": {},
        "PiecewiseSystem": {"states": "x", "fields": dict.fromkeys("-+", bf.AffineField([[-1.0]])), "switches": [RELAY]},
        "HybridSystem": {"states": "x", "modes": {"rise": bf.AffineField([[-1.0]], [1.5])}, "jumps": [SPIKE]},
        "Switch": {"surface": RELAY.surface},
        "Jump": {"mode": "rise", "surface": RELAY.surface, "to": "rise"},
        "piecewise.equilibria": {"system": m["relay"]},
    }


RELAY = bf.Switch(bf.AffineSurface([1.0]))
SPIKE = bf.Jump("rise", bf.AffineSurface([1.0], -1.0), to="rise", reset=bf.AffineReset([[0.0]]))


def with_field(A=((-1.0,),), b=(1.0,), cos=None, sin=None, ramp=(0.0,)):
    """A system with a field of these numbers: a field alone does not know how many states there are."""
    return bf.PiecewiseSystem("x", dict.fromkeys("-+", bf.AffineField(A, b, cos=cos, sin=sin, ramp=ramp)), [RELAY], omega=1.0)


def with_surface(A=(1.0,), b=0.0, cos=None, sin=None, ramp=0.0):
    """A system with a surface of these numbers."""
    surface = bf.AffineSurface(A, b, cos=cos, sin=sin, ramp=ramp)
    return bf.PiecewiseSystem("x", dict.fromkeys("-+", bf.AffineField([[-1.0]])), [bf.Switch(surface)], omega=1.0)


def with_reset(A=((0.5,),), b=(0.0,), cos=None, sin=None, ramp=(0.0,)):
    """A system with a reset of these numbers."""
    jump = bf.Jump("rise", SPIKE.surface, to="rise", reset=bf.AffineReset(A, b, cos=cos, sin=sin, ramp=ramp))
    return bf.HybridSystem("x", {"rise": bf.AffineField([[-1.0]])}, [jump], omega=1.0)


ROWS = {"A": "rows", "b": "constants", "ramp": "constants", "cos": "amplitudes of harmonics", "sin": "amplitudes of harmonics"}
SPECIAL: dict[str, dict] = {  # kinds of arguments that differ from those of their names, or have no name in the signature
    "simulate": {"periods": "ratio"},
    "PiecewiseSystem": {"states": "states named", "fields": "fields", "switches": "rules", "k": "number", "clock": "ticks"},
    "HybridSystem": {"states": "states named", "modes": "fields", "jumps": "rules", "start": "modes named", "k": "number",
                     "clock": "ticks"},
    "Switch": {"surface": "surface", "below": "label", "above": "label", "sliding": "flag", "hysteresis": "pair"},
    "Jump": {"mode": "label", "surface": "surface", "to": "names of modes", "reset": "reset"},
    "lyapunov_exponents": {"y0": "start"},
    "bifurcation_diagram": {"starts": "start"},
    "parameter_chart": {"starts": "count"},
    "Branch.distance": {"points": "pairs"},
    "ParameterCurve.distance": {"points": "pairs"},
    "Branch.plot": {"points": "pairs"},
    "Branch.x": {"i": "far"},
    "SpecialPoints.of": {"kind": "word"},
    "Certificate.contains": {"multiplier": "complex"},
    "BasinMap.points": {"label": "numbered"},
    "CellMap.points": {"label": "numbered"},
    "FeedbackBasins.points": {"label": "numbered"},
    "BasinMap.entropy": {"side": "boxes"},
    "FeedbackBasins.entropy": {"side": "boxes"},
    "Grid.points": {"cells": "cells", "offset": "offset"},
    "Grid.cells_of": {"points": "pairs"},
    "Grid.wrapped": {"points": "pairs"},
    "HarmonicBalance.layout": {"n": "points"},
    "Grid.require": {"bytes_a_cell": "positive", "what": "label"},
    "systems.buck_converter": {"low": "number", "high": "number"},
    "systems.thermostat": {"low": "number"},
    "systems.friction_damped_oscillator": {"damping": "number"},
    "systems.jenkins_oscillator": {"limit": "ratio"},
    "systems.rotating_frame_rotor": {"nu": "number"},
    "SquareRootMap.iterate": {"n": "index"},
    "plotting.drawn": {"plot": "function"},
    "plotting.plot_peaks": {"curves": "object"},
    "plotting.plot_responses": {"measured": "pairs"},
    "explore.Session": {"first": "object"},
    "RigidStop.with_parameters": {"gap": "number", "restitution": "number", "nonsense": "number"},
    "Jenkins.with_parameters": {"stiffness": "number", "limit": "ratio", "nonsense": "number"},
    "Driven.with_parameters": {"amplitude": "number", "stiffness": "number", "nonsense": "number"},
    "plotting.plot_branch": {"points": "flag"},
    "plotting.plot_curve": {"points": "flag"},
    "System.parameter": {"name": "named"},
    "System.parameter_name": {"name": "named"},
    "System.dof": {"name": "place"},
    "System.recover": {"y": "states"},
    "System.reduced": {"method": "choice", "keep": "place", "modes": "index"},
    "System.with_parameters": {"omega": "positive", "nonsense": "number", "rigid_stop.gap": "number"},
    "System": {"damping": "matrix"},
    "System.from_matrices": {"C": "filled_matrix", "G": "filled_matrix"},
    "explore.serve": {"path": "label"},
    "systems.macro_slip_contact": {"harmonic_y": "count"},
    "Grid": {"q0": "range", "z0": "range"},
    "BasinMap.zoom": {"q0": "two", "z0": "two"},
    "OGYController.correction": {"state": "state"},
    "elements.LinearSpring": {"damping": "number"},
    "systems.impact_chain": {"damping": "number"},
    "elements.Jenkins": {"limit": "ratio"},
    "control.controlled_multipliers": {"least": "positive"},
    "elements.Shift": {"direction": "list"},
    "elements.Force": {"site": "factors", "stiffness": "number"},
    "control.ogy": {"method": "choice"},
    "plotting.plot_full_spectrum": {"most": "positive"},
    "load": {"elements": "classes"},
    "Branch.load": {"elements": "classes"},
    "read": {"mass": "path", "stiffness": "path", "damping": "path", "gyroscopic": "path"},
    "SquareRootMap.with_parameters": {"lam": "number", "nonsense": "number"},
    "Model.system": {"omega": "positive"},
    "Reduction.valid_to": {"tolerance": "positive"},
}


def drawn(ax):
    """A picture with nothing in it."""


def matrix(speed=0.0):
    """The matrices of a disk, as a rotor of ROSS gives them."""
    return np.eye(4)


def nothing():
    """No gyroscopic forces."""
    return np.zeros((4, 4))


def cube(u, s):
    """A law of force."""
    return -u * u * u


def cases() -> list[Case]:
    """Return everything public that can be called, with a valid call."""
    m, found = made(), []
    given = bases(m)
    modules = [("", bf, bf._NAMES)] + [
        (f"{name}.", module, module.__all__)
        for name, module in (
            ("elements", el),
            ("systems", bf.systems),
            ("control", bf.control),
            ("continuation", bf.continuation),
            ("basins", bf.basins),
            ("plotting", bf.plotting),
            ("explore", bf.explore),
            ("certify", __import__("bifurc.certify", fromlist="x")),
            ("piecewise", bf.piecewise),
        )
    ]
    seen = set()
    for prefix, module, names in modules:
        for name in names:
            thing = getattr(module, name)
            if thing in seen or not callable(thing) or name in RECORDS | AUTHORS:
                continue
            seen.add(thing)
            if isinstance(thing, type) and (
                issubclass(thing, enum.Enum | BaseException)
                or f"{prefix}{name}" not in given
                and prefix not in ("elements.", "")
            ):
                continue
            required = [
                p for p in inspect.signature(thing).parameters.values() if p.default is p.empty and p.kind not in (2, 4)
            ]
            if not required or f"{prefix}{name}" in given:
                found.append(
                    Case(f"{prefix}{name}", thing, given.get(f"{prefix}{name}", {}), SPECIAL.get(f"{prefix}{name}", {}))
                )
    found += [
        Case("simulate", bf.simulate, {"system": m["relay"], "y0": (0.5,), "duration": 1.0}, {"y0": "first order start"}),
        Case("find_orbit", bf.find_orbit, {"system": m["spiking"], "guess": (0.5,)}, {"guess": "first order start"}),
        Case("find_equilibrium", bf.find_equilibrium, {"system": m["relay"], "guess": (0.5,)}, {"guess": "first order start"}),
        Case("Grid", bf.Grid, {"x": (0, 1, 3)}, {"x": "range"}),
        *(Case(name, make, {}, ROWS) for name, make in (
            ("AffineField", with_field), ("AffineReset", with_reset))),
        Case("AffineSurface", with_surface, {}, {**ROWS, "A": "constants", "b": "number", "ramp": "number"}),
    ]
    F = m["friction"]  # one memory state: a start has two or three numbers
    found += [
        Case(name, function, {**given[name], "system": F, **more}, SPECIAL.get(name, {}))
        for name, function, more in (
            ("simulate", bf.simulate, {}),
            ("find_orbit", bf.find_orbit, {}),
            ("lyapunov_exponents", bf.lyapunov_exponents, {}),
            ("ramp", bf.ramp, {"bounds": (1.1, 1.11)}),
            ("bifurcation_diagram", bf.bifurcation_diagram, {"values": [1.1]}),
            ("find_orbit", bf.find_orbit, {"guess": None, "method": bf.HarmonicBalance(3)}),
        )
    ]
    seen = set()
    for thing in m.values():
        cls = type(thing)
        if cls in seen or not cls.__module__.startswith("bifurc."):
            continue
        seen.add(cls)
        for key in sorted(dir(cls)):
            method = getattr(cls, key) if not isinstance(inspect.getattr_static(cls, key), property) else None
            if (
                key.startswith("_")
                or key in NOT_CALLED
                or not callable(method)
                or not getattr(method, "__module__", "").startswith("bifurc")
            ):
                continue
            name = f"{cls.__name__}.{key}"
            base = given.get(name, {"path": f"{PLACE}/result.npz"} if key == "save" else {})
            bound = getattr(thing, key)
            required = [
                p.name for p in inspect.signature(bound).parameters.values() if p.default is p.empty and p.kind not in (2, 4)
            ]
            if base is not None and set(required) <= set(base) and inspect.signature(bound).parameters:
                found.append(Case(name, bound, base, SPECIAL.get(name, {})))
    return found


def arguments(case: Case) -> dict[str, str]:
    """Return the kinds of the arguments of something that can be called, by name."""
    found = {}
    for name, item in inspect.signature(case.function).parameters.items():
        if item.kind in (2, 4):
            continue
        kind = case.kinds.get(name, KIND.get(name))
        if kind is None and (type(item.default) is float or item.annotation in (float, "float", float | None, "float | None")):
            kind = "number"
        found[name] = kind
    if any(item.kind is item.VAR_KEYWORD for item in inspect.signature(case.function).parameters.values()):
        found |= {name: kind for name, kind in case.kinds.items() if name not in found}
    if case.name.startswith("elements."):
        found |= {name: kind for name, kind in (("dof", "seat"), ("label", "label")) if name in found}
        if "side" in found:  # a wall may stand still
            found["harmonic"] = "index"
    return found


def means(case: Case, name: str, kind: str, value) -> bool:
    """Return whether a value of a pool has a meaning in this place all the same."""
    if name == "jumps":
        return isinstance(value, list | range) and not len(value) or isinstance(value, np.ndarray) and value.shape == (0,)
    if isinstance(value, types.GeneratorType | range):  # an empty list
        return kind in ("list", "array", "elements", "axes", "states", "start", "place")
    if name in ("bounds", "hysteresis"):
        return isinstance(value, list | np.ndarray) and str(value) in ("[1.0, 2.0]", "[1. 2.]")
    if name == "q0" and case.name == "BasinMap.zoom":
        return isinstance(value, tuple) and value == (0, 1)
    if name == "limit":
        return isinstance(value, float | np.ndarray) and np.ndim(value) == 0 and value == math.inf
    if name in ("x0", "guess") and case.name.startswith("SquareRootMap"):  # of one dimension
        return value is None or isinstance(value, float) and value == 3.0 or isinstance(value, tuple) and value == (1.0,)
    if name in ("y0", "guess", "start", "starts") and isinstance(value, tuple) and value == (1.0, 2.0, 3.0):
        return case.base.get("system") is made()["friction"]  # which has a memory state
    if name == "guess":
        return isinstance(value, tuple) and value == (1.0,) and case.name != "find_orbit"
    if name == "periodic" and isinstance(value, str):
        return value in case.base
    if name in ("periodic", "saddle"):
        return value.size == 0 if isinstance(value, np.ndarray) else isinstance(value, list) and not len(value)
    if name == "at":  # components are looked up when a system is known
        return isinstance(value, dict) and "q7" in value
    return name == "element" and type(value) is str and value == "x"


def everything(among=None):
    """Yield every malformed call (case, argument, value) there is."""
    for case in among or cases():
        for name, kind in arguments(case).items():
            default = getattr(inspect.signature(case.function).parameters.get(name), "default", ...)
            for value in WRONG[kind] if kind else ():
                if not (value is None and default is None or means(case, name, kind, value)):
                    yield case, name, (i for i in ()) if isinstance(value, types.GeneratorType) else value
        if case.name not in OPEN:
            yield case, "unknown_argument", 1.0


def draw(seed: int, count: int, among=None):
    """Yield malformed calls (case, argument, value), each kind of case as often as it has arguments."""
    rng = np.random.default_rng(seed)
    every = [
        (case, name, kind)
        for case in among or cases()
        for name, kind in arguments(case).items()
        if kind is not None and WRONG[kind]
    ]
    for k in rng.permutation(np.arange(count) % len(every)).tolist():
        case, name, kind = every[k]
        default = getattr(inspect.signature(case.function).parameters.get(name), "default", ...)
        if rng.random() < 0.02 and case.name not in OPEN:
            yield case, f"unknown_{name}", 1.0
            continue
        while True:
            value = WRONG[kind][rng.integers(len(WRONG[kind]))]
            if value is None and default is None or means(case, name, kind, value):
                continue
            break
        yield case, name, (i for i in ()) if isinstance(value, types.GeneratorType) else value


class Slow(Exception):
    """A call that did not answer in time."""


DEEP = re.compile(
    r"has no attribute|argument must be a|truth value|not iterable|could not convert|unsupported operand|must be real number, "
    r"not|unpack|invalid literal|not subscriptable|no len\(\)|not callable|not supported between|unhashable|broadcast|"
    r"inhomogeneous|out of bounds|reduction operation|zip\(\)|list index|cannot be interpreted|Unable to allocate|"
    r"too large to convert|expected str, bytes|embedded null|no repr|no float|no array|no length|no attributes|no equality"
)


def verdict(case: Case, argument: str, value, limit: float = 20.0) -> tuple[str, str]:
    """Return ("good" | "confusing" | "accepted" | "slow", what was said)."""

    def late(*_):
        raise Slow

    before = signal.signal(signal.SIGPROF, late)
    signal.setitimer(signal.ITIMER_PROF, limit)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            found = case.function(**{**case.base, argument: value})
    except Slow:
        return "slow", f"no answer in {limit:g} s of processor time"
    except Served:
        return "accepted", "it serves"
    except ModuleNotFoundError as error:
        return "good", str(error)
    except (ValueError, TypeError, OSError, KeyError, MemoryError, AttributeError) as error:
        text = str(error)
        named = re.search(rf"\b{re.escape(argument.rpartition('.')[2])}\b", text) or (
            isinstance(value, dict) and any(str(key) in text for key in value)
        )
        named = named or isinstance(value, list) and len(value) and show(value[0]) in text
        named = named or isinstance(value, str) and len(value) > 2 and value in text
        named = named or (len(show(value)) > 2 and show(value) in text) or (isinstance(value, str) and repr(value) in text)
        return ("good" if named and not DEEP.search(text) else "confusing"), f"{type(error).__name__}: {text}"
    except Exception as error:  # whatever else a call raises is confusing: that is what is looked for
        return "confusing", f"{type(error).__name__}: {error}"
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
        close_figures()
    return "accepted", show(found)[:80]


def close_figures():
    """Close the figures that accepted calls opened."""
    from matplotlib import pyplot

    pyplot.close("all")


def show(value) -> str:
    """Return the repr of a value, or its class."""
    try:
        return repr(value)
    except Exception:
        return f"<{type(value).__name__}>"


def forms(value):
    """Yield a valid value in the other forms that mean the same: numpy numbers, arrays without axes, lists, paths."""
    if isinstance(value, bool):
        yield np.bool_(value)
    elif isinstance(value, int):
        yield from (np.int64(value), np.int32(value), np.array(value))
    elif isinstance(value, float):
        yield from (np.float64(value), np.array(value), fractions.Fraction(value))
    elif isinstance(value, tuple) and value and all(type(item) in (int, float) for item in value):
        yield from (list(value), np.array(value))
    elif isinstance(value, str) and "/" in value:
        yield pathlib.Path(value)
    elif isinstance(value, str):
        yield np.str_(value)
