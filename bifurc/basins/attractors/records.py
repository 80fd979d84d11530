"""Attractors in files: headers and arrays of several side by side."""
from collections.abc import Mapping, Sequence

import numpy as np

from ...orbits.equilibrium import Equilibrium
from ...orbits.orbit import PeriodicOrbit
from .attractors import ChaoticAttractor, QuasiperiodicAttractor

READERS = {item.kind: item for item in (ChaoticAttractor, QuasiperiodicAttractor)} | {"equilibrium": Equilibrium}


def packed(attractors: Sequence, prefix: str = "attractor_") -> tuple[list[dict], dict[str, np.ndarray]]:
    """Return headers and arrays of attractors; the names of the arrays begin with the prefix and the number."""
    headers: list[dict] = []
    arrays: dict[str, np.ndarray] = {}
    for k, item in enumerate(attractors):
        header, mine = item.to_record()
        headers.append(header)
        arrays |= {f"{prefix}{k}_{name}": np.asarray(values) for name, values in mine.items()}
    return headers, arrays


def unpacked(headers: Sequence[dict], arrays: Mapping[str, np.ndarray], prefix: str = "attractor_",
             elements: Sequence = ()) -> list:
    """Return the attractors that `packed` described; ``elements`` are user classes and laws."""
    found = []
    for k, header in enumerate(headers):
        start = f"{prefix}{k}_"
        mine = {name.removeprefix(start): values for name, values in arrays.items() if name.startswith(start)}
        reader = READERS.get(header["kind"], PeriodicOrbit)
        found.append(reader.from_record(header, mine, elements))
    return found
