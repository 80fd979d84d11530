"""Malformed calls of the public face: every argument of every verb in turn gets values that it cannot mean.

`calls` yields them; `verdict` runs one within a limit of processor time and says what came of it.  A good end is a ValueError
(or a subclass), a FileNotFoundError or a FileExistsError whose text names the argument or shows the value.
"""

import math
import signal
import warnings

import numpy as np

import bifurc as bf
from bifurc import elements as el

A = bf.systems.impact_oscillator(omega=1.4)
FREE = bf.System(1.0, 0.1, 1.0, [el.RigidStop(gap=1.0)])  # autonomous
TWO = bf.System(np.eye(2), 0.1 * np.eye(2), [[2.0, -1.0], [-1.0, 1.0]], [el.HarmonicForce(0.3), el.RigidStop(gap=1.0)], omega=0.7)
NOTHING = object()


class Pair:
    """Something with a shape and no sense."""

    shape = (2,)

    def __repr__(self):
        return "Pair()"


NO_SYSTEM = (None, 3, "impact_oscillator", [], bf.System, NOTHING)
NO_NUMBER = (math.nan, math.inf, -math.inf, "x", [], [1.0, 2.0], None, 1j, True, NOTHING)
NO_WHOLE = (0, -3, 1.5, math.nan, "x", [1], True, NOTHING)
NO_STATE = (3.0, (1.0,), (1.0, 2.0, 3.0), (math.nan, 0.0), (0.0, math.inf), "ab", [["a"]], Pair(), {"q": 1})
NO_BOUNDS = ((1.0, 1.0), (math.nan, 2.0), 3.0, (1.0,), (0.5, 1.0, 2.0), "ab", (None, 1.0), NOTHING)
NO_NAME = ("nonsense", "", None, 3, ["omega"], "omega ", "restitution[0]")
NO_RANGE = (
    (1, -1, 10),
    (0, 1, 0),
    (0, 1, -5),
    (0, 1, 2.5),
    (math.nan, 1, 5),
    (0, math.inf, 5),
    (0, 1),
    3,
    "abc",
    None,
    (0, 1, True),
)
NO_VALUES = ([], [math.nan], [1.0, 1.0], [1.0, 1.2, 1.1], "ab", None, [[1.0], [1.1]], [1.4, math.inf])
NO_REGION = ({}, {"q0": (1, -1)}, {"z0": (0, 1)}, {"q0": 3}, None, 3, {"q0": (math.nan, 1)}, {"q7": (0, 1)}, [("q0", 0, 1)])
NO_FILE = (3, "", "/dev/null", "/nowhere/at/all.npz", NOTHING)
NO_MATRIX = (math.nan, [[1.0, 2.0]], "x", [[1.0, math.inf], [0.0, 1.0]], None, [], NOTHING, [["a"]])
NO_ELEMENTS = (3, [3], [bf.systems], "abc", [el.RigidStop], None)


def calls():
    """Yield (name, argument, value, call)."""
    orbit = bf.find_orbit(A)
    branch = bf.trace(orbit, "omega", bounds=(1.39, 1.41), max_steps=4)
    point = bf.trace(orbit, "omega", bounds=(1.2, 1.41)).special_points[0]
    grid = bf.Grid(q0=(-1, 0.5, 4), v0=(-1, 1, 4))
    region = {"q0": (-1.0, 0.5), "v0": (-1.0, 1.0)}
    tables = {
        "simulate": (
            bf.simulate,
            {"system": A, "y0": (0.0, 0.0), "periods": 2},
            {
                "system": NO_SYSTEM,
                "y0": NO_STATE,
                "periods": (-1, math.nan, math.inf, "x", [], NOTHING),
                "duration": (1.0, -1.0),
                "t0": NO_NUMBER,
                "max_events": NO_WHOLE,
            },
        ),
        "find_orbit": (
            bf.find_orbit,
            {"system": A, "guess": (0.0, 0.0), "periods": 1},
            {
                "system": NO_SYSTEM,
                "guess": (*NO_STATE, NOTHING, branch),
                "periods": NO_WHOLE,
                "closure": (0, 2, "x", 1.5),
                "transient": (-1, 1.5, "x"),
                "method": (3, "shooting", bf.System),
            },
        ),
        "lyapunov_exponents": (
            bf.lyapunov_exponents,
            {"system": A, "y0": (0.0, 0.0), "periods": 20, "transient": 5, "batches": 4},
            {
                "system": (*NO_SYSTEM,),
                "y0": NO_STATE,
                "periods": NO_WHOLE,
                "transient": (-1, 1.5, "x", math.nan),
                "batches": NO_WHOLE,
                "max_events": NO_WHOLE,
            },
        ),
        "hysteresis": (
            bf.hysteresis,
            {"system": bf.systems.macro_slip_contact(case=1)},
            {"system": (*NO_SYSTEM, A), "element": ("nonsense", 3), "max_periods": NO_WHOLE},
        ),
        "trace": (
            bf.trace,
            {"start": orbit, "parameter": "omega", "bounds": (1.39, 1.41), "max_steps": 3},
            {
                "start": (None, 3, A, NOTHING, "orbit", branch),
                "parameter": NO_NAME,
                "bounds": NO_BOUNDS,
                "ds": (-1.0, 0.0, math.nan, math.inf, "x", NOTHING),
                "ds_max": (-1.0, 0.0, math.nan, "x"),
                "ds_min": (-1.0, math.nan, "x"),
                "max_steps": NO_WHOLE[1:],
                "direction": (0, 2, "sideways", 1.5),
                "stop": (3, "x"),
                "record": (3, "x"),
                "progress": ("x", 3),
                "peaks": (3, "nonsense", ["max_9"]),
            },
        ),
        "trace_curve": (
            bf.trace_curve,
            {"point": point, "parameters": ("omega", "amplitude"), "bounds": ((1.2, 1.41), (0.4, 0.6)), "max_steps": 2},
            {
                "point": (None, 3, orbit, NOTHING),
                "parameters": (("omega",), "omega", ("omega", "omega"), ("omega", "x"), 3),
                "bounds": (3, ((1, 2),), (math.nan, 1)),
            },
        ),
        "switch_branch": (bf.switch_branch, {"point": None}, {"point": (None, 3, orbit, branch, NOTHING)}),
        "basins_of_attraction": (
            bf.basins_of_attraction,
            {"system": A, "grid": grid},
            {
                "system": (*NO_SYSTEM, FREE),
                "grid": (
                    None,
                    3,
                    region,
                    NOTHING,
                ),
                "attractors": (3, [3], [FREE], "ab"),
                "seed": (-1, 1.5, "x", None),
                "workers": NO_WHOLE,
                "tolerance": (0.0, -1.0, 2.0, math.nan, "x", None),
                "max_periods": NO_WHOLE,
                "max_events": NO_WHOLE,
                "executor": (3, "threads"),
                "progress": ("x", 3),
                "file": NO_FILE,
            },
        ),
        "refined_basins": (
            bf.refined_basins,
            {"system": A, "grid": grid},
            {"system": (*NO_SYSTEM, FREE), "grid": (None, 3), "attractors": (3,), "workers": NO_WHOLE, "file": NO_FILE},
        ),
        "cell_mapping": (
            bf.cell_mapping,
            {"system": A, "grid": grid},
            {
                "system": (None, 3, "x", NOTHING, FREE, lambda x: None, lambda x: x * math.nan, lambda x: x[:0]),
                "grid": (None, 3, bf.Grid(q0=(0, 1, 4))),
                "periods": NO_WHOLE,
                "samples": NO_WHOLE,
                "audit": (-1, 1.5, "x"),
                "workers": NO_WHOLE,
                "tolerance": (0.0, math.nan, "x", 2.0),
                "max_periods": NO_WHOLE,
                "file": NO_FILE,
            },
        ),
        "sweep": (
            bf.sweep,
            {"system": A, "parameter": "omega", "values": [1.4], "region": region, "samples": 8},
            {
                "system": (*NO_SYSTEM, FREE),
                "parameter": NO_NAME,
                "values": NO_VALUES,
                "region": NO_REGION,
                "at": (3, {"z": 1}, {"q0": 1}),
                "samples": NO_WHOLE,
                "seed": (-1, 1.5, "x"),
                "tolerance": (0.0, math.nan, "x", 2.0),
                "workers": NO_WHOLE,
                "chunk": NO_WHOLE,
                "executor": (3,),
                "file": NO_FILE,
            },
        ),
        "bifurcation_diagram": (
            bf.bifurcation_diagram,
            {"system": A, "parameter": "omega", "values": [1.4], "transient": 4, "keep": 4},
            {
                "system": (*NO_SYSTEM, FREE),
                "parameter": NO_NAME,
                "values": [item for item in NO_VALUES if item != [1.0, 1.2, 1.1]],
                "starts": NO_STATE,
                "directions": ("sideways", (), 3, ("up", "up")),
                "transient": (-1, 1.5, "x"),
                "keep": NO_WHOLE,
                "chunk": NO_WHOLE,
                "workers": NO_WHOLE,
                "file": NO_FILE,
            },
        ),
        "parameter_chart": (
            bf.parameter_chart,
            {
                "system": A,
                "parameters": {"omega": [1.4], "gap": [1.0]},
                "region": region,
                "starts": 2,
                "transient": 4,
                "longest": 2,
            },
            {
                "system": (*NO_SYSTEM, FREE),
                "parameters": (3, {}, {"omega": [1.4]}, {"omega": [1.4], "x": [1]}, {"omega": [], "gap": [1.0]}),
                "region": NO_REGION,
                "starts": NO_WHOLE,
                "transient": (-1, 1.5),
                "longest": NO_WHOLE,
                "file": NO_FILE,
            },
        ),
        "Grid": (
            bf.Grid,
            {"q0": (0, 1, 3)},
            {"q0": NO_RANGE, "z0": ((0, 1, 3),), "at": (3, {"q0": 1}, {"z": 1}, {"v0": math.nan})},
        ),
        "System": (
            bf.System,
            {"mass": 1.0, "damping": 0.1, "stiffness": 1.0},
            {
                "mass": (*NO_MATRIX, 0.0, -1.0),
                "damping": NO_MATRIX,
                "stiffness": NO_MATRIX,
                "elements": NO_ELEMENTS,
                "omega": (-1.0, 0.0, math.nan, math.inf, "x", [], NOTHING),
            },
        ),
        "HarmonicForce": (
            el.HarmonicForce,
            {"amplitude": 1.0},
            {"amplitude": NO_NUMBER, "harmonic": (0, -1, 1.5, "x"), "dof": (-1, 1.5)},
        ),
        "RigidStop": (
            el.RigidStop,
            {"gap": 1.0, "restitution": 0.7},
            {"gap": NO_NUMBER, "restitution": (*NO_NUMBER, -0.1, 1.1), "side": (0, 2, "x")},
        ),
        "ElasticStop": (el.ElasticStop, {"gap": 1.0, "stiffness": 2.0}, {"gap": NO_NUMBER, "stiffness": (*NO_NUMBER,)}),
        "Coulomb": (el.Coulomb, {"friction": 0.1}, {"friction": (*NO_NUMBER, -0.1)}),
        "impact_oscillator": (
            bf.systems.impact_oscillator,
            {},
            {
                "zeta": NO_NUMBER,
                "omega": (*NO_NUMBER, 0.0, -1.0),
                "amplitude": NO_NUMBER,
                "gap": NO_NUMBER,
                "restitution": (*NO_NUMBER, 1.5),
            },
        ),
        "HarmonicBalance": (
            bf.HarmonicBalance,
            {"harmonics": 3},
            {"harmonics": tuple(item for item in NO_WHOLE if item != [1]), "samples": (0, -1, 1.5, "x")},
        ),
        "load": (bf.load, {"path": "nothing.npz"}, {"path": (None, 3, "nothing.npz", "/dev/null", "/tmp", [])}),
        "with_parameters": (A.with_parameters, {}, {"omega": (*NO_NUMBER, -1.0), "nonsense": (1.0,)}),
        "parameter": (A.parameter, {"name": "omega"}, {"name": NO_NAME}),
    }
    for name, (function, base, table) in tables.items():
        for argument, values in table.items():
            for value in values:
                yield name, argument, value, (function, {**base, argument: value})


class Slow(Exception):
    """A call that did not answer in time."""


def verdict(argument, value, call, limit: float = 20.0) -> tuple[str, str]:
    """Return ("good" | "confusing" | "accepted" | "slow", what was said)."""

    def late(*_):
        raise Slow

    function, keywords = call
    before = signal.signal(signal.SIGPROF, late)
    signal.setitimer(signal.ITIMER_PROF, limit)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            found = function(**keywords)
    except Slow:
        return "slow", f"no answer in {limit:g} s of processor time"
    except (ValueError, TypeError, FileNotFoundError, FileExistsError, NotADirectoryError, KeyError) as error:
        text = str(error)
        if isinstance(error, TypeError) and not (argument in text and "must be" in text):
            return "confusing", f"TypeError: {text}"
        shown = (
            repr(value) in text
            or (isinstance(value, tuple) and any(repr(item) in text for item in value))
            or str(value) in text
            or argument in text
            or (isinstance(value, dict) and any(k in text for k in value))
        )
        return ("good" if shown else "confusing"), f"{type(error).__name__}: {text}"
    except Exception as error:  # whatever else a call raises is confusing: that is what is looked for
        return "confusing", f"{type(error).__name__}: {error}"
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
    return "accepted", f"{found!r:.80}"
