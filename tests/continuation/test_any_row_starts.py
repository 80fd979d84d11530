"""A branch is the same whichever of its rows it is traced from, also one that lies on a boundary of its event sequence."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation import Monitor, Problem
from bifurc.continuation.kinds import ContinuationError, SpecialPointKind, StopReason
from bifurc.elements import Coulomb, ElasticStop, HarmonicForce, RigidStop
from bifurc.orbits.least import reduced


def rubbing(damping, omega, gap, restitution, friction):
    """Return a mass with a rigid stop and dry friction, driven by a force of amplitude 1."""
    return bf.System(1.0, damping, 1.0, [HarmonicForce(1.0), RigidStop(gap, restitution), Coulomb(friction)], omega=omega)


def told(branch, low, high):
    """Return kind, parameter and turn of the special points between two values, in the order of the branch from its low end."""
    points = [p for p in branch.special_points if low < p.parameter < high]
    low_first = branch.ends[0].p < branch.ends[1].p
    return [(p.kind.value, p.parameter, p.reverses) for p in (points if low_first else points[::-1])]


def alike(one, other):
    """Whether two such lists are one but for rounding."""
    return [(kind, turn) for kind, _, turn in one] == [(kind, turn) for kind, _, turn in other] and np.allclose(
        [p for _, p, _ in one], [p for _, p, _ in other], rtol=0.0, atol=1e-9)


@pytest.fixture(scope="module")
def nearly_chattering():
    """Return a branch whose slow last impacts are born one after the other, each with dp/ds = 0, and its parameter."""
    system, name = rubbing(0.0468, 0.908, 0.292, 0.335, 0.0418), "rigid_stop.restitution"
    return bf.trace(bf.find_orbit(system), name, bounds=(0.085, 0.585)), name


def test_a_birth_with_a_slope_of_rounding_is_no_fold(nearly_chattering):
    """Where an impact is born dp/ds = 0; its computed value is 1e-7 of either sign, and no fold lies there from any row."""
    branch, name = nearly_chattering
    window = 0.1974385, 0.1998
    whole = told(branch, *window)
    assert [kind for kind, _, _ in whole] == ["grazing", "slip_onset"] * 3 + ["grazing"]
    assert not any(turn for *_, turn in whole)
    born = [k for k, row in enumerate(branch.rows()) if abs(row.tests[0]) < 1e-5 and window[0] < row.p < window[1]]
    assert len(born) > 1
    for k in born[:4]:
        again = bf.trace(branch.orbits[k], name, bounds=(0.085, 0.2))
        assert alike(told(again, *window), whole) and again.audit.ok, (k, again)


def test_a_train_listed_too_long_is_shortened_at_the_start():
    """How many impacts of a complete chattering are listed is a choice: a start with one too many is a motion like any other."""
    system, name = rubbing(0.0294, 2.41, 0.25, 0.12, 0.0272), "rigid_stop.restitution"
    branch = bf.trace(bf.find_orbit(system), name, bounds=(0.0, 0.37))
    changes = np.flatnonzero(np.diff([row.part.index for row in branch.rows()]))
    for k in changes.tolist():
        again = bf.trace(branch.orbits[k], name, bounds=(0.12, 0.139)) if 0.12 < branch.column(name)[k] < 0.139 else None
        assert again is None or (again.audit.ok and not again.special_points), (k, again)
    assert any(0.12 < branch.column(name)[k] < 0.139 for k in changes)


@pytest.mark.parametrize(("system", "name", "bounds", "short", "kinds"), [
    (rubbing(0.145, 0.461, 0.415, 0.616, 0.0134), "rigid_stop.restitution", (0.366, 0.866), (0.5979239427, 0.5979241153),
     {"stick_onset", "grazing"}),
    (rubbing(0.0272, 0.461, 0.664, 0.753, 0.0232), "rigid_stop.gap", (0.3984, 0.9296), (0.7556837953, 0.7556838204),
     {"stick_onset", "fold", "grazing"})])
def test_a_sequence_of_a_short_interval_is_entered_at_its_near_end(system, name, bounds, short, kinds):
    """Its equations turn inside: which of its two ends is that of the old equations, the parameter tells."""
    inside = short[0] - 1e-9, short[1] + 1e-9
    branch = bf.trace(bf.find_orbit(system), name, bounds=bounds)
    one = told(branch, *inside)
    assert {kind for kind, _, _ in one} == kinds
    for k in (2, len(branch) - 3):
        assert alike(told(bf.trace(branch.orbits[k], name, bounds=bounds), *inside), one), k


@pytest.mark.parametrize(("damping", "omega", "amplitude", "gaps", "restitution", "name", "bounds"), [
    (0.239, 1.25, 0.834, (1.19, 0.501), 0.331, "rigid_stop_2.restitution", (0.081, 0.581)),
    (0.0954, 0.938, 1.14, (0.231, 0.231), 0.86, "omega", (0.6566, 1.2194))
])
def test_a_doubled_branch_starts_where_it_merges(damping, omega, amplitude, gaps, restitution, name, bounds):
    """Its last row is the orbit of half the period run twice, where two curves cross: the branch of the doubled orbits goes on."""
    elements = HarmonicForce(amplitude), RigidStop(gaps[0], restitution), RigidStop(gaps[1], restitution, side=-1)
    branch = bf.trace(bf.find_orbit(bf.System(1.0, damping, 1.0, elements, omega=omega)), name, bounds=bounds)
    merging = [k for k, end in zip((0, -1), branch.ends, strict=True) if end.reason is StopReason.MERGED]
    assert merging
    for k in merging:
        again = bf.trace(branch.orbits[k], name, bounds=bounds)
        assert {end.reason for end in again.ends} == {end.reason for end in branch.ends}
        assert np.allclose(sorted(end.p for end in again.ends), sorted(end.p for end in branch.ends), rtol=0.0, atol=1e-12)
        assert sorted(str(p.kind) for p in again.special_points) == sorted(str(p.kind) for p in branch.special_points)
        assert again.audit.ok and all(orbit.success for orbit in again.orbits)


def test_flights_of_a_chattering_do_not_turn_round():
    """A flight has the other root, too, from which it came; towards restitution 0 the last ones of a train are so short that
    Newton may end there: a solution that is no motion."""
    system, name = rubbing(0.0343, 0.448, 0.209, 0.149, 0.0707), "rigid_stop.restitution"
    branch = bf.trace(bf.find_orbit(system), name, bounds=(0.0, 0.399))
    row = next(row for row in branch.rows() if 1.6e-5 < row.p < 1e-3 and row.part.problem.signature.endswith("impact... / 1 T"))
    problem, size = row.part.problem, 1 + system.n * 2
    turned = row.x.copy()
    turned[-1 - size] = 2.0 * row.x[-1 - 2 * size] - row.x[-1 - size]
    turned[-2] = -row.x[-2]
    c = problem.correct(turned, row.tangent)
    assert not c.converged or np.all(np.diff(c.x[:-1:size]) > 0.0)
    for k in (-1, int(np.argmin(abs(branch.column(name) - 0.347)))):
        again = bf.trace(branch.orbits[k], name, bounds=(0.0, 0.399))
        assert again.audit.ok and all(orbit.success for orbit in again.orbits)
        assert alike(told(again, 1e-3, 0.39), told(branch, 1e-3, 0.39))


@pytest.mark.parametrize(("damping", "omega", "amplitude", "stop", "name", "bounds"), [
    (0.0332, 1.36, 0.445, ElasticStop(-0.167, 45.9, damping=0.19), "elastic_stop.gap", (-0.247, -0.087)),
    (0.0875, 1.18, 0.279, ElasticStop(-0.157, 7.97, damping=0.0716), "omega", (0.826, 1.534))
])
def test_a_doubled_branch_merges_beside_a_graze_of_its_parent(damping, omega, amplitude, stop, name, bounds):
    """Within 1e-8 of the parameter the parent grazes an elastic stop, turns back and doubles: the end is located there, and no row
    lies so near to it that its tangent is rounding."""
    system = bf.System(1.0, damping, 1.0, [HarmonicForce(amplitude), stop], omega=omega)
    branch = bf.trace(bf.find_orbit(system), name, bounds=bounds)
    merged = [point for point in branch.special_points if point.name == "merges"]
    assert len(merged) == [end.reason for end in branch.ends].count(StopReason.MERGED) > 0
    assert branch.audit.ok and all(orbit.success for orbit in branch.orbits)
    parent = bf.trace(reduced(branch.orbits[-1]), name, bounds=bounds)
    flips = [point.parameter for point in parent.special_points if point.kind is SpecialPointKind.PERIOD_DOUBLING]
    assert all(min(abs(flip - point.parameter) for flip in flips) < 1e-12 for point in merged)


class Born(Problem):
    """An event of speed u = sqrt(p) that is born at p = 0; before its birth another test, of what follows the event, is wrong."""

    monitors = (Monitor("grazing", boundary=True), Monitor("stick_onset", boundary=True))

    def residual(self, u, p):
        return p - u**2

    def monitor_values(self, u, p, tangent):
        return np.array([-u[0], -0.01 if u[0] > 0.0 else 0.01])


@pytest.mark.parametrize("u", [5e-15, 0.0, -5e-15, -2e-12])
def test_a_start_at_a_birth_is_put_on_the_side_of_motions(u):
    branch = bf.trace(Born(u, u * u), bounds=(-1.0, 1.0))
    found = np.array([branch.x(k) for k in range(len(branch))])
    assert found[:, 0].min() > -1e-12 and found[:, 1].max() == 1.0
    np.testing.assert_allclose(found[:, 0]**2, found[:, 1], atol=1e-12)


def test_a_start_beyond_a_birth_is_refused():
    with pytest.raises(ContinuationError, match=r"the start is not valid: its test for grazing is 0\.1 > 0"):
        bf.trace(Born(-0.1, 0.01), bounds=(-1.0, 1.0))
