"""Load any saved result: the header's kind names the class that reads it."""
import importlib
import os
from collections.abc import Iterable
from typing import Any

from . import io

_READERS = {
    "branch": (".continuation.branch", "Branch"),
    "curve": (".continuation.curves", "ParameterCurve"),
    "orbit": (".orbits.orbit", "PeriodicOrbit"),
    "harmonic_orbit": (".orbits.balance", "HarmonicOrbit"),
    "basins": (".basins.basinmap", "BasinMap"),
    "refinement": (".basins.refine", "Refinement"),
    "cells": (".basins.cellmap", "CellMap"),
    "sweep": (".basins.sweeps", "Sweep"),
    "chart": (".basins.charts", "ParameterChart"),
    "diagram": (".basins.diagrams", "BifurcationDiagram"),
}


def load(path: str | os.PathLike, elements: Iterable[type] = ()) -> Any:
    """Read a result that was written with its ``save`` method.

    Parameters
    ----------
    path : path-like
        An npz file written by bifurc.
    elements : iterable of type
        User element classes, or user laws, that the saved system was built with. No code is ever taken from a file.

    Returns
    -------
    Branch, PeriodicOrbit or BasinMap

    Raises
    ------
    FileNotFoundError
    bifurc.io.FileFormatError
        If the file is foreign, damaged, or newer than this version.

    Examples
    --------
    >>> import bifurc as bf
    >>> branch = bf.load("branch.npz")                     # doctest: +SKIP
    """
    header, arrays = io.read(path)
    kind = header["kind"]
    if kind not in _READERS:
        raise io.FileFormatError(f"{path} holds a {kind!r}; this version reads {', '.join(sorted(_READERS))}")
    module, name = _READERS[kind]
    reader = getattr(importlib.import_module(module, __package__), name)
    elements = tuple(elements)
    return reader.from_record(header, arrays, elements=elements) if elements else reader.from_record(header, arrays)
