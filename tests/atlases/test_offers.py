"""What special points of a branch offer to an atlas: which points, how long periods, in which order."""
from types import SimpleNamespace

import pytest

from bifurc.atlases import jobs
from bifurc.continuation.kinds import ContinuationError, SpecialPointKind
from bifurc.orbits.orbit import PeriodicOrbit


class Orbit(PeriodicOrbit):
    """A periodic orbit that is a name, a period and whether it is one."""

    def __init__(self, name, periods, success=True):
        self._about = name, periods, success

    periods = property(lambda self: self._about[1])
    success = property(lambda self: self._about[2])

    def __repr__(self):
        return self._about[0]


@pytest.fixture
def offered(monkeypatch):
    """Switching at a point gives the orbits written beside it; ``asked`` are the points and the longest multiples."""
    asked = []

    def switch(point, n_max):
        asked.append((point.parameter, n_max))
        return point.orbits
    monkeypatch.setattr(jobs, "switch_branch", switch)
    monkeypatch.setattr(jobs, "periods_of", lambda branch: branch.periods)
    return asked


def point(kind, parameter, *orbits):
    return SimpleNamespace(kind=kind, parameter=parameter, orbits=orbits)


def test_offers_are_the_orbits_of_each_point_with_its_parameter(offered):
    kinds = SpecialPointKind
    a, b, c, d = Orbit("a", 4), Orbit("b", 6), Orbit("c", 2), Orbit("d", 7)
    branch = SimpleNamespace(periods=2, special_points=[
        point(kinds.GRAZING, 0.9, a, b), point(kinds.FOLD, 0.1, Orbit("e", 1)), point(kinds.PERIOD_DOUBLING, 0.3, d, c),
        point(kinds.NEIMARK_SACKER, 0.4, Orbit("f", 1)), point(kinds.BRANCH_POINT, 0.2, Orbit("g", 2, False), object(), b),
        point(kinds.USER, 0.7, Orbit("h", 1)), point(kinds.STICK_ONSET, 0.8, Orbit("i", 1))])
    offers, at = jobs._offers(branch, 6)
    assert offers == [a, b, c, b] and at == [0.9, 0.9, 0.3, 0.2]  # no longer than six periods, and those that are orbits
    assert offered == [(0.9, 3), (0.3, 3), (0.2, 3)]
    assert jobs._offers(branch, 5)[0] == [a, c] and jobs._offers(branch, 7)[0] == [a, b, d, c, b]


@pytest.mark.parametrize("periods, longest, most", [(1, 5, 5), (2, 5, 2), (3, 5, 1), (4, 8, 2), (5, 4, 1), (7, 1, 1)])
def test_no_longer_multiples_are_asked_for_than_could_be_taken(offered, periods, longest, most):
    branch = SimpleNamespace(periods=periods, special_points=[point(SpecialPointKind.GRAZING, 0.5)])
    assert jobs._offers(branch, longest) == ([], []) and offered == [(0.5, most)]


def test_starts_that_fail_leave_the_others_in_their_places(offered, monkeypatch):
    starts = [Orbit("fails", 1), Orbit("good", 1), Orbit("breaks", 2), Orbit("empty", 1), Orbit("last", 3)]
    other = Orbit("other", 2)

    def traced(orbit, payload):
        if repr(orbit) == "fails":
            raise ContinuationError("why not")
        if repr(orbit) == "breaks":
            raise ZeroDivisionError("by zero")
        points = [point(SpecialPointKind.GRAZING, 0.1 * orbit.periods, *[other] * orbit.periods)]
        if repr(orbit) == "empty":
            return None
        return SimpleNamespace(name=repr(orbit), periods=orbit.periods, special_points=points, ends=())
    monkeypatch.setattr(jobs, "_traced", traced)
    monkeypatch.setattr(jobs, "unpacked", lambda orbits, arrays, elements: starts)
    monkeypatch.setattr(jobs, "packed_branches", lambda made: ([branch and branch.name for branch in made], {}))
    monkeypatch.setattr(jobs, "packed_points", lambda points: ([len(mine) for mine in points], {}))
    meta, _ = jobs.trace_orbits({"orbits": [], "arrays": {}, "periods": 4})
    assert [mine["header"] for mine in meta["branches"]] == [None, "good", None, None, "last"]
    assert [mine["offers"] for mine in meta["branches"]] == [0, 1, 0, 0, 3]
    assert [mine["why"] for mine in meta["branches"]] == ["why not", "", "by zero", "", ""]
    assert [mine["at"] for mine in meta["branches"]] == [[], [0.1], [], [], pytest.approx([0.3] * 3)]
