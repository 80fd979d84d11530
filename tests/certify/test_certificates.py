"""What certificates say, and what is said of a branch, with plain proofs in the place of those that take time."""
from types import SimpleNamespace

import numpy as np
import pytest

from bifurc.certify import PointCertificate, StretchCertificate, Verdict
from bifurc.certify import branch as branches
from bifurc.certify.branch import certify_branch as checked

certify_branch = checked.__wrapped__  # type: ignore[attr-defined]  # what it does of anything with rows

def test_a_point_says_where_it_is_only_if_it_exists():
    proved = PointCertificate("fold", Verdict.PROVED, (1.25, 1.5), 1e-7, Verdict.PROVED, 96, 0.5)
    assert proved.proved and "fold proved in [1.25, 1.5]" in repr(proved) and "500.0 ms" in repr(proved)
    for exists in (Verdict.UNDECIDED, Verdict.DISPROVED):
        other = PointCertificate("fold", exists, (1.25, 1.5))
        assert not other.proved and "[" not in repr(other)
    assert not PointCertificate("fold", Verdict.PROVED, (1.25, 1.5)).proved  # not transversal


class Pieces:
    """What lies between the rows: the second stretch is not proved."""

    def __init__(self, branch, points, precision):
        self.all_proved = branch.all_proved

    def between(self, i):
        good = self.all_proved or i != 1
        return StretchCertificate((i, i + 1), (0.0, 1.0), Verdict.PROVED if good else Verdict.UNDECIDED, message=f"stretch {i}")


class Branch(SimpleNamespace):
    def __len__(self):
        return 3


@pytest.fixture
def made(monkeypatch):
    asked = []

    def make(all_proved, **more):
        branch = Branch(**{"problems": [SimpleNamespace(sequence=object())], "orbits": ["a", "b", "c"], "special_points": ["p"],
                           "parameter": "omega", "column": lambda name: np.array([0.5, 0.625, 0.75]), "all_proved": all_proved,
                           **more})

        def row(orbit, precision):
            asked.append((orbit, precision))
            return SimpleNamespace(proved=all_proved or orbit != "b", admissible=Verdict.PROVED, exists=Verdict.PROVED,
                                   message=f"row of {orbit}", verdict=Verdict.PROVED)
        monkeypatch.setattr(branches, "certify_orbit", row)
        monkeypatch.setattr(branches, "certify_point", lambda point, precision: PointCertificate(
            "fold", Verdict.PROVED if all_proved else Verdict.UNDECIDED, message="no fold"))
        monkeypatch.setattr(branches, "Stretches", Pieces)
        return branch
    return make, asked


def test_a_branch_that_is_proved_says_what(made):
    make, asked = made
    found = certify_branch(make(True), 80)
    assert asked == [("a", 80), ("b", 80), ("c", 80)] and len(found.rows) == 3 and len(found.stretches) == 2
    assert found.message.startswith("every special point is proved") and "no other lies between the rows" in found.message
    few = certify_branch(make(True), stretches=False)
    assert few.stretches == () and "nothing is said of what lies between the rows" in few.message
    assert found.values.tolist() == [0.5, 0.625, 0.75] and found.parameter == "omega" and found.seconds >= 0.0


def test_what_is_left_is_named(made):
    make, _ = made
    found = certify_branch(make(False))
    parts = found.message.split("; ")
    assert "fold: no fold" in parts and "rows 1 to 2: stretch 1" in parts and not any("rows 0 to 1" in part for part in parts)


@pytest.mark.parametrize("sequences", [(None,), (object(), None)])
def test_branches_of_other_problems_are_refused(made, sequences):
    make, _ = made
    with pytest.raises(ValueError, match="event sequences"):
        certify_branch(make(True, problems=[SimpleNamespace(sequence=s) for s in sequences]))
