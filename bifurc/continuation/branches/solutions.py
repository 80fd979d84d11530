"""Solutions of the rows of a branch, as they are looked up."""
from typing import Any

from .special import solution_at


class Solutions:
    """Sequence of the solutions of a branch, made when looked up."""

    def __init__(self, branch):
        self._branch = branch

    def __len__(self) -> int:
        return len(self._branch)

    def __getitem__(self, i) -> Any:
        if isinstance(i, slice):
            return [self[k] for k in range(*i.indices(len(self)))]
        branch = self._branch
        return solution_at(branch.problems[int(branch._arrays["part"][i])], branch.x(i), bool(branch._on_boundary[i]))

    def __iter__(self):
        return (self[i] for i in range(len(self)))

    def __repr__(self) -> str:
        return f"Solutions({len(self)})"
