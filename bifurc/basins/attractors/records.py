"""Attractors in files: headers and arrays of several side by side, of one place or of many.

The names of the arrays are known here alone, so that what one function writes its counterpart reads.
"""
from collections.abc import Mapping, Sequence

import numpy as np

from ...io import part
from ...orbits.equilibria.equilibrium import Equilibrium
from ...orbits.orbit import PeriodicOrbit
from .attractors import ChaoticAttractor, QuasiperiodicAttractor

READERS = {item.kind: item for item in (ChaoticAttractor, QuasiperiodicAttractor)} | {"equilibrium": Equilibrium}


def packed(attractors: Sequence) -> tuple[list[dict], dict[str, np.ndarray]]:
    """Return headers and arrays of attractors; `unpacked` reads them."""
    return _packed(attractors, _prefix())


def unpacked(headers: Sequence[dict], arrays: Mapping[str, np.ndarray], elements: Sequence = ()) -> list:
    """Return the attractors that `packed` described; ``elements`` are user classes and laws."""
    return _unpacked(headers, arrays, _prefix(), elements)


def packed_points(points: Sequence[Sequence]) -> tuple[list[list[dict]], dict[str, np.ndarray]]:
    """Return headers, one list a point, and arrays of the attractors of several points; `unpacked_points` reads them."""
    headers: list[list[dict]] = []
    arrays: dict[str, np.ndarray] = {}
    for i, attractors in enumerate(points):
        mine, more = _packed(attractors, _prefix(i))
        headers.append(mine)
        arrays |= more
    return headers, arrays


def unpacked_points(headers: Sequence[Sequence[dict]], arrays: Mapping[str, np.ndarray], elements: Sequence = ()) -> list[list]:
    """Return the attractors of every point that `packed_points` described; ``elements`` are user classes and laws."""
    by_point: dict[str, dict[str, np.ndarray]] = {}
    for name, values in arrays.items():  # one pass: a sweep has thousands of points
        by_point.setdefault(_group(name), {})[name] = values
    return [_unpacked(mine, by_point.get(_group(_prefix(i)), {}), _prefix(i), elements) for i, mine in enumerate(headers)]


def _prefix(point: int | None = None) -> str:
    """Return what the names of the arrays of the attractors of a point begin with; None: there is one place only."""
    return "attractor_" if point is None else f"p{point}_a"


def _group(name: str) -> str:
    """Return what tells the point of an array's name."""
    return name.split("_", 1)[0]


def _packed(attractors: Sequence, prefix: str) -> tuple[list[dict], dict[str, np.ndarray]]:
    headers: list[dict] = []
    arrays: dict[str, np.ndarray] = {}
    for k, item in enumerate(attractors):
        header, mine = item.to_record()
        headers.append(header)
        arrays |= {f"{prefix}{k}_{name}": np.asarray(values) for name, values in mine.items()}
    return headers, arrays


def _unpacked(headers: Sequence[dict], arrays: Mapping[str, np.ndarray], prefix: str, elements: Sequence) -> list:
    found = []
    for k, header in enumerate(headers):
        reader = READERS.get(header["kind"], PeriodicOrbit)
        found.append(reader.from_record(header, part(arrays, f"{prefix}{k}_"), elements))
    return found
