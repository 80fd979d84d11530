"""Branches in files: headers and arrays of several side by side.

The names of the arrays are known here alone, so that what one function writes the other reads.
"""
from collections.abc import Mapping, Sequence

import numpy as np

from ..continuation.branches.branch import Branch
from ..io import part


def packed_branches(branches: Sequence[Branch | None]) -> tuple[list[dict | None], dict[str, np.ndarray]]:
    """Return headers (None for None) and arrays of branches; `unpacked_branches` reads them."""
    headers: list[dict | None] = []
    arrays: dict[str, np.ndarray] = {}
    for k, branch in enumerate(branches):
        header, mine = (None, {}) if branch is None else branch.to_record()
        headers.append(header)
        arrays |= {f"{_prefix(k)}{name}": np.asarray(values) for name, values in mine.items()}
    return headers, arrays


def unpacked_branches(headers: Sequence[dict | None], arrays: Mapping[str, np.ndarray], elements=()) -> list[Branch | None]:
    """Return the branches that `packed_branches` described; ``elements`` are user classes and laws."""
    found: list[Branch | None] = []
    for k, header in enumerate(headers):
        found.append(None if header is None else Branch.from_record(header, part(arrays, _prefix(k)), elements=elements))
    return found


def _prefix(k: int) -> str:
    """Return what the names of the arrays of a branch begin with."""
    return f"b{k}_"
