"""Load any saved result: the header's kind names the class that reads it."""
import functools
import importlib
import os
from collections.abc import Iterable
from typing import Any

from . import io
from .checks import checked

_READERS = {
    "branch": (".continuation.branches.branch", "Branch"),
    "curve": (".continuation.curves.tracing", "ParameterCurve"),
    "orbit": (".orbits.orbit", "PeriodicOrbit"),
    "harmonic_orbit": (".orbits.balance.harmonic_orbit", "HarmonicOrbit"),
    "basins": (".basins.maps.basin_map", "BasinMap"),
    "refinement": (".basins.maps.refinement", "Refinement"),
    "cells": (".basins.cells.cell_map", "CellMap"),
    "sweep": (".basins.sweeps.attractor_sweep", "Sweep"),
    "chart": (".basins.sweeps.chart", "ParameterChart"),
    "point_certificate": (".certify.certificate", "PointCertificate"),
    "stretch_certificate": (".certify.certificate", "StretchCertificate"),
    "branch_certificate": (".certify.branch", "BranchCertificate"),
    "atlas": (".atlases.result", "Atlas"),
    "certificate": (".certify.certificate", "Certificate"),
    "diagram": (".basins.sweeps.diagram", "BifurcationDiagram"),
    "ramp": (".basins.sweeps.ramp", "Ramp"),
}


@checked()
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
        If the file is foreign, damaged, or newer than this version, an array has not the type or shape that it must have, or its
        system needs classes that ``elements`` lacks.

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
    read = functools.partial(reader.from_record, elements=elements) if elements else reader.from_record
    return io.made(path, read, header, arrays)
