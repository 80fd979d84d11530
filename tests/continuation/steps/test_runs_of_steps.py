"""Steps made many in one call are those that Python makes one by one; numbers along a parameter are sampled once."""
import numpy as np
import pytest

import bifurc as bf
from bifurc import systems
from bifurc.elements import Coulomb, HarmonicForce, RigidStop
from bifurc.orbits.repetition import repetition

SCENES = {
    "impacts": (lambda: systems.impact_oscillator(zeta=0.05, omega=0.5, amplitude=0.52, gap=1.0, restitution=0.7), (0.5, 2.0)),
    "elastic": (lambda: systems.bilinear_oscillator(zeta=0.05, omega=0.4, amplitude=0.3, gap=0.2, stiffness_ratio=10.0),
                (0.3, 2.0)),
    "Duffing": (lambda: systems.duffing_oscillator(omega=0.3), (0.3, 2.0)),
    "friction": (lambda: bf.System(1.0, 0.05, 1.0, [HarmonicForce(1.0), Coulomb(0.3)], omega=0.7), (0.4, 1.6)),
    "masses": (lambda: bf.System(np.eye(2), 0.1 * np.eye(2), np.array([[2.0, -1.0], [-1.0, 2.0]]),
                                 [HarmonicForce(0.4), RigidStop(0.6, 0.8)], omega=0.6), (0.5, 1.2)),
}


def traced(name, **options):
    """Return the branch of a scene from its orbit at the first bound's side, and how many steps were made in runs."""
    make, bounds = SCENES[name]
    return bf.trace(bf.find_orbit(make()), "omega", bounds=bounds, **options)


@pytest.mark.parametrize("name", SCENES)
def test_a_run_of_steps_finds_what_single_steps_find(name, monkeypatch):
    from bifurc.continuation.shooting.problem import OrbitProblem

    made, follow = [], OrbitProblem.follow

    def counted(self, *arguments):
        rows, c = follow(self, *arguments)
        made.append(len(rows))
        return rows, c

    monkeypatch.setattr(OrbitProblem, "follow", counted)
    runs = traced(name)
    count = sum(made)
    single = traced(name, record=lambda point: {})  # a user's function is asked at every row: no runs
    assert sum(made) == count
    if name != "masses":  # tori are watched beside, row by row
        assert count > 0.3 * len(runs.orbits)
    assert runs.stop_reason == single.stop_reason
    assert [point.kind for point in runs.special_points] == [point.kind for point in single.special_points]
    for one, other in zip(runs.special_points, single.special_points, strict=True):
        assert one.parameter == pytest.approx(other.parameter, abs=1e-11 + one.error + other.error)
    assert 0.7 * len(single.orbits) <= len(runs.orbits) <= 1.3 * len(single.orbits)
    assert runs.audit.ok and single.audit.ok
    rows = [orbit for orbit in runs.orbits[::7]]
    assert all(orbit.success and repetition(orbit).repeated for orbit in rows)


@pytest.mark.parametrize("name", ["impacts", "elastic", "Duffing"])
def test_a_run_begins_behind_the_first_row(name, monkeypatch):
    """Its first step is the single one: the corrector begins at the end of the same tangent."""
    from bifurc.continuation.shooting.problem import OrbitProblem

    made, follow = [], OrbitProblem.follow

    def counted(self, before, row, *arguments):
        rows, c = follow(self, before, row, *arguments)
        made.append((before is row, len(rows)))
        return rows, c

    monkeypatch.setattr(OrbitProblem, "follow", counted)
    run, single = (traced(name, max_steps=1, direction=1, **options) for options in ({}, {"record": lambda point: {}}))
    assert made == [(True, 1)]
    assert run.column("s") == pytest.approx(single.column("s"), abs=1e-14)
    for one, other in zip(run.rows(), single.rows(), strict=True):
        assert one.x == pytest.approx(other.x, abs=1e-13) and one.tangent == pytest.approx(other.tangent, abs=1e-12)
        assert (one.signs, one.ds) == (other.signs, pytest.approx(other.ds))


def test_rows_of_a_run_keep_the_order_and_lengths_of_the_branch():
    branch = traced("impacts")
    s = np.asarray(branch.column("s"))
    assert np.all(np.diff(s) >= 0.0)  # equal where the sequence of events changes
    assert np.max(np.diff(s)) <= 0.2 * 1.2
    assert np.min(branch.column("omega")) == 0.5 and np.max(branch.column("omega")) == 2.0


@pytest.mark.parametrize("most", [1, 3, 10, 33])
def test_max_steps_holds_in_a_run(most):
    branch = traced("Duffing", max_steps=most, direction=1)
    assert branch.stop_reason[1] == "max_steps"
    assert len(branch.orbits) == most + 1


def test_numbers_along_a_parameter_are_sampled_once_for_orbits_of_one_system():
    system = SCENES["impacts"][0]()
    orbit = bf.find_orbit(system)
    first = bf.trace(orbit, "omega", bounds=(0.5, 2.0))
    known = orbit.scene.sampled
    assert len(known) == 1
    other = bf.find_orbit(system.with_parameters(omega=0.6), guess=orbit)
    again = bf.trace(other, "omega", bounds=(0.5, 2.0))
    assert other.scene.sampled is known and len(known) == 1  # whatever the parameter is now
    bf.trace(orbit, "omega", bounds=(0.5, 1.9))
    bf.trace(bf.find_orbit(system.with_parameters(gap=1.1)), "omega", bounds=(0.5, 2.0))
    assert len(known) == 3  # other bounds, another system
    fresh = bf.trace(bf.find_orbit(SCENES["impacts"][0]()), "omega", bounds=(0.5, 2.0))
    assert np.array_equal(fresh.column("omega"), first.column("omega"))
    assert [p.parameter for p in again.special_points] == pytest.approx([p.parameter for p in first.special_points], abs=1e-12)


def test_an_orbit_on_the_numbers_of_its_branch_is_the_orbit():
    from bifurc.continuation.tracing import problem_of

    for name in ("impacts", "friction", "Duffing"):
        make, bounds = SCENES[name]
        problem = problem_of(bf.find_orbit(make()), "omega", bounds)
        x = problem.correct(problem.x0, problem.null_tangent(problem.x0), True).x
        own, packed = problem.motion(x), problem.solution(x)
        assert own.success and packed.success
        assert np.abs(own.scene.tables.flat - packed.scene.tables.flat).max() <= 1e-14 * np.abs(packed.scene.tables.flat).max()
        assert own.multipliers == pytest.approx(packed.multipliers, abs=1e-11)
        assert own.sample(50)[1] == pytest.approx(packed.sample(50)[1], abs=1e-12)
        assert repetition(own).repeated


@pytest.mark.parametrize("name", ["impacts", "elastic", "Duffing"])
def test_zeros_found_in_one_call_are_those_of_the_general_search(name, monkeypatch):
    """Place, error and kind of every special point; the compiled search is the one that finds them."""
    from bifurc.continuation.shooting.problem import OrbitProblem

    found, zero = [], OrbitProblem.zero

    def counted(self, *arguments):
        made = zero(self, *arguments)
        found.append(made is not None and made[0] is not None)
        return made

    monkeypatch.setattr(OrbitProblem, "zero", counted)
    at_once = traced(name)
    assert sum(found) >= 0.7 * len([point for point in at_once.special_points if point.kind != "peak"]) > 0
    monkeypatch.setattr(OrbitProblem, "zero", lambda self, *arguments: None)
    one_by_one = traced(name)
    assert [point.kind for point in at_once.special_points] == [point.kind for point in one_by_one.special_points]
    for one, other in zip(at_once.special_points, one_by_one.special_points, strict=True):
        assert abs(one.parameter - other.parameter) <= one.error + other.error
        assert one.error < 1e-11 and other.error < 1e-11


def test_the_middle_of_a_step_tells_an_arc_from_two_branches():
    from bifurc.orbits.shooting import sequence
    from bifurc.orbits.shooting.equations import MAX_ITERATIONS, TOLERANCE

    system = systems.bilinear_oscillator(zeta=0.05, omega=0.5, amplitude=0.3, gap=0.5, stiffness_ratio=5.0)
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(0.5, 1.4), ds_max=0.1)
    above, below = (point.parameter for point in branch.special_points.of("fold"))
    rows = [row for row in branch.rows() if row.part.index == 1]  # with the contact
    problem = branch.problems[1]
    equations = problem.equations

    def smooth(a, b):
        length = float(np.linalg.norm((b.x - a.x) / problem.scale))
        equations.numbers_at(0.5 * (a.p + b.p))
        told = sequence.smooth(equations.path.tables, equations._data, a.x, a.tangent, b.x, b.tangent, length, 0.0, TOLERANCE,
                               MAX_ITERATIONS)
        after = equations.path.tables.flat.copy()
        equations.numbers_at(b.p)
        np.testing.assert_array_equal(after, equations.path.tables.flat)
        return told
    fold = max(range(len(rows)), key=lambda i: rows[i].p)
    calm = [(a, b) for a, b in zip(rows[3:-2], rows[4:-1], strict=True) if b.angle < 0.1]
    assert len(calm) > 20 and all(smooth(a, b) for a, b in calm)
    middle = 0.5 * (above + below)  # of three orbits at one frequency two follow each other along the branch
    one, two = (min(half, key=lambda row: abs(row.p - middle)) for half in (rows[:fold], rows[fold:]))
    assert one.p == pytest.approx(two.p, abs=0.02) and not smooth(one, two)
