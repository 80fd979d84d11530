"""Arclengths of what the half that was traced backwards knows are negative in the branch, and the ends are in the order of rows."""
import numpy as np
import pytest

from bifurc.continuation import tracing
from bifurc.continuation.branches.branch import Branch
from tests.continuation.steps.lines import Line


@pytest.mark.parametrize("direction", [None, 1, -1])
def test_what_was_left_unresolved_lies_where_it_was_seen(direction, monkeypatch):
    halves, join = [], Branch.of_halves.__func__

    def of_halves(cls, plus, minus, options):
        halves.extend((plus, minus))
        plus.unresolved, minus.unresolved = [("fold", 0.25, 0.3)], [("grazing", 0.5, -0.4), ("fold", 0.75, -0.6)]
        plus.rejected, minus.rejected = 3, 5
        return join(cls, plus, minus, options)

    monkeypatch.setattr(Branch, "of_halves", classmethod(of_halves))
    branch = tracing.trace(Line(), bounds=(-2.0, 1.0), direction=direction)
    assert [tuple(item) for item in branch.unresolved] == [("grazing", -0.5, -0.4), ("fold", -0.75, -0.6), ("fold", 0.25, 0.3)]
    plus, minus = halves
    s = np.array([row.s for row in branch.rows()])
    assert (np.diff(s) > 0.0).all() and s[0] == -minus.rows[-1].s and s[-1] == plus.rows[-1].s
    assert [end.rejected for end in branch.ends] == [5, 3]
    assert [end.p for end in branch.ends] == [minus.rows[-1].p, plus.rows[-1].p]
