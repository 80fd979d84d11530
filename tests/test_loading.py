"""Saved results whose arrays are not what they were, or not what their class describes: file and array are told."""
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc import io
from bifurc.jobs.executors import SerialExecutor

A = bf.systems.impact_oscillator(omega=1.4)
GRID = bf.Grid(q0=(-1.0, 0.5, 6), v0=(-1.0, 1.0, 5))
REGION = {"q0": (-1.0, 0.5), "v0": (-1.0, 1.0)}


def branch():
    return bf.trace(bf.find_orbit(A), "omega", bounds=(1.2, 1.41), max_steps=60)


MADE = {
    "orbit": lambda: bf.find_orbit(A),
    "branch": branch,
    "series": lambda: bf.find_orbit(bf.systems.duffing_oscillator(), method=bf.HarmonicBalance(3)),
    "basins": lambda: bf.basins_of_attraction(A, GRID),
    "refinement": lambda: bf.refined_basins(A, GRID),
    "cells": lambda: bf.cell_mapping(A, GRID, periods=2, audit=0),
    "chain": lambda: bf.cell_mapping(A, GRID, periods=2, audit=0, samples=2),
    "sweep": lambda: bf.sweep(A, "omega", [1.4, 1.41], REGION, samples=8),
    "diagram": lambda: bf.bifurcation_diagram(A, "omega", [1.4, 1.41, 1.42], transient=4, keep=4),
    "chart": lambda: bf.parameter_chart(A, {"omega": [1.4, 1.5], "gap": [1.0]}, REGION, starts=2, transient=4, longest=2),
    "ramp": lambda: bf.ramp(A, "omega", (1.4, 1.5), steps=5, periods=2),
    "certificate": lambda: bf.find_orbit(A).certify(),
}
# lengths that nothing else in the record tells, and arrays that may hold NaN or infinity
FREE = {"nodes", "fixed", "multipliers", "undecided", "group_0", "bounds"}
OPEN = {"slope", "residual", "angle", "det_sign", "det_log", "ds", "monitors", "bounds", "ends", "special", "radii", "speeds",
        "numbers", "points", "impacts", "exponents", "errors", "maximum", "minimum", "states", "multipliers", "times"}


def damages(values):
    """Yield (what, the array damaged so)."""
    if values.ndim and values.size:
        yield "cut", values[:-1]
    if values.ndim > 1 and values.shape[0] != values.shape[-1]:
        yield "transposed", np.ascontiguousarray(values.T)
    yield "turned", values[None]
    yield "text", values.astype(str)
    yield "complex", values.astype(complex)
    if values.dtype.kind in "ib":
        yield "float", values.astype(float)
    if values.dtype.kind == "f":
        yield "single", values.astype(np.float32)
        for wrong in (math.nan, math.inf) if values.size else ():
            yield str(wrong), np.where(np.arange(values.size).reshape(values.shape) == values.size - 1, wrong, values)


def plain_name(name):
    """Name of an array without the part of the record that it is in."""
    return name.split("_", 2)[-1] if name.startswith(("attractor_", "p0_", "p1_")) else name


@pytest.mark.parametrize("kind", MADE)
def test_an_array_that_is_not_what_it_must_be_is_told(tmp_path, kind):
    """Every array in turn is damaged in every way, and written as a record that vouches for itself."""
    path, broken = tmp_path / "good.npz", tmp_path / "broken.npz"
    found = MADE[kind]()
    found.save(path)
    assert repr(bf.load(path)) == repr(found)
    header, arrays = io.read(path)
    for name, values in arrays.items():
        for what, wrong in damages(values):
            if what == "cut" and plain_name(name) in FREE or what in ("nan", "inf") and plain_name(name) in OPEN:
                continue
            io.write(broken, header, {**arrays, name: wrong})
            with pytest.raises(io.FileFormatError, match=r"broken\.npz holds a '\w+' that cannot be read: array '"):
                bf.load(broken)
        io.write(broken, header, {other: values for other, values in arrays.items() if other != name})
        if name not in ("group", "steps", "speeds"):  # older files lack them
            with pytest.raises(io.FileFormatError, match=rf"broken\.npz .*array '{name}' is missing"):
                bf.load(broken)


def test_an_array_that_is_not_as_it_was_written_is_told_by_its_name(tmp_path):
    """Whoever rewrites an array beside the header, by numpy alone, changes a type, a shape or a checksum that the header keeps."""
    path, broken = tmp_path / "good.npz", tmp_path / "broken.npz"
    square = np.arange(9.0).reshape(3, 3)
    io.write(path, {"kind": "branch"}, {"a": square, "b": np.arange(4), "c": np.array("text"), "d": np.asfortranarray(square[:2])})
    assert io.header(path) == {"kind": "branch", "format": "bifurc", "version": 1}
    with np.load(path) as archive:
        content = dict(archive)
    for name, wrong in (("a", square.T), ("a", square[:2]), ("a", square.astype(np.float32)),
                        ("a", np.where(square == 4.0, np.nan, square)), ("b", np.arange(4.0)), ("b", np.arange(3)),
                        ("c", np.array("test")), ("d", square)):
        np.savez(broken, **{**content, name: wrong})
        with pytest.raises(io.FileFormatError, match=rf"broken\.npz is damaged \(array '{name}' is not as it was written\)"):
            io.read(broken)
        del content[name]
        np.savez(broken, **content)
        with pytest.raises(io.FileFormatError, match=rf"broken\.npz is damaged \(array '{name}' is missing\)"):
            io.read(broken)
        with np.load(path) as archive:
            content = dict(archive)
    np.savez(broken, **content)
    assert {name: values.tolist() for name, values in io.read(broken)[1].items()} == {
        "a": square.tolist(), "b": [0, 1, 2, 3], "c": "text", "d": square[:2].tolist()}


def test_axes_and_types_of_arrays():
    x, t = np.zeros((3, 2)), np.zeros(4)
    io.fitted({"x": x, "t": t}, {"x": "finite m 2", "t": "real m+1", "none?": "whole m"})
    io.fitted({"x": x}, {"x": "finite grid"}, grid=(3, 2))
    io.fitted({"x": np.full(1, np.nan), "i": np.zeros(0, np.int8)}, {"x": "real *", "i": "whole k"})
    inner = io.part(io.part({"a.b.x": x, "a.y": t, "x": t}, "a."), "b.")
    assert list(inner) == ["x"] and inner["x"] is x
    for shapes, said in (({"x": "finite m 3"}, r"array 'a\.b\.x' has the shape \(3, 2\); it must be \(3, 3\)"),
                         ({"x": "whole m 2"}, r"array 'a\.b\.x' holds float64; it must hold whole numbers"),
                         ({"y": "whole m"}, r"array 'a\.b\.y' is missing"),
                         ({"x": "finite m"}, r"has the shape \(3, 2\); it must be \(3,\)"),
                         ({"x": "finite m n k"}, r"has the shape \(3, 2\); it must be \(3, 2, 0\)")):
        with pytest.raises(ValueError, match=said):
            io.fitted(inner, shapes)
    with pytest.raises(ValueError, match="holds float64 with NaN or infinity; it must hold finite real numbers"):
        io.fitted({"x": np.full(1, np.inf)}, {"x": "finite 1"})


def test_a_finished_result_that_was_rewritten_is_told_when_its_job_is_run_again(tmp_path):
    """The key in the header says that the job is done; arrays of other shapes beside it are no result."""
    path = tmp_path / "map.npz"
    bf.basins_of_attraction(A, GRID, file=path)
    header, arrays = io.read(path)
    io.write(path, header, {**arrays, "labels": arrays["labels"].T})
    with pytest.raises(io.FileFormatError, match=r"map\.npz .*array 'labels' has the shape \(5, 6\); it must be \(6, 5\)"):
        bf.basins_of_attraction(A, GRID, file=path)


def test_chunks_that_were_rewritten_are_computed_again(tmp_path):
    """Of an interrupted sweep, one chunk is cut, one has an array changed, one lies under the name of another."""
    values = [1.4, 1.41, 1.42, 1.43]
    plain = bf.sweep(A, "omega", values, REGION, samples=8, chunk=1)

    class Tired(SerialExecutor):
        left = 3

        def submit(self, fn, /, *args, **kwargs):
            if self.left == 0:
                raise KeyboardInterrupt
            self.left -= 1
            return super().submit(fn, *args, **kwargs)

    file = tmp_path / "sweep.npz"
    with pytest.raises(KeyboardInterrupt):
        bf.sweep(A, "omega", values, REGION, samples=8, chunk=1, file=file, executor=Tired())
    cut, changed, under = sorted((tmp_path / "sweep.npz.chunks").glob("*.npz"))
    cut.write_bytes(cut.read_bytes()[:-30])
    header, arrays = io.read(changed)
    name = next(iter(arrays))
    io.write(changed, header, {**arrays, name: arrays[name] + 1})
    under.write_bytes(changed.read_bytes())
    again = bf.sweep(A, "omega", values, REGION, samples=8, chunk=1, file=file)
    mine, its = again.to_record()[1], plain.to_record()[1]
    assert set(mine) == set(its) and all(np.array_equal(mine[key], its[key]) for key in its)
