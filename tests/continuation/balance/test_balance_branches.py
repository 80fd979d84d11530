"""Branches of harmonic orbits: corners where slip begins and ends, peaks, folds, other parameters, files."""
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc import HarmonicBalance, System, systems
from bifurc.continuation.balance.problem import BalanceProblem
from bifurc.elements import CubicSpring, ElasticStop, HarmonicForce

ONSETS = [math.sqrt(s) for s in np.roots([1.0, 0.02**2 - 4.0, 3.0])[::-1]]  # (2 - s)^2 + .02^2 s = 1: the stuck amplitude is 1


def j1(omega, **changes):
    return systems.jenkins_oscillator(**{**dict(zeta=0.01, omega=omega, amplitude=1.0, stiffness=1.0, limit=1.0), **changes})


def traced(method, **options):
    return bf.trace(bf.find_orbit(j1(0.4), method=method), "omega", bounds=(0.4, 2.0), **options)


@pytest.mark.parametrize(("H", "peak"), [(7, 3.5365983), (21, 3.5361209)])
def test_friction_response_from_stick_through_slip_to_stick(H, peak):
    branch = traced(HarmonicBalance(H))
    assert [str(point.kind) for point in branch.special_points] == ["slip_onset", "slip_onset"]
    for point, onset in zip(branch.special_points, ONSETS, strict=True):
        assert abs(point.parameter - onset) <= 1e-10 and point.error <= 1e-10
    assert [str(reason) for reason in branch.stop_reason] == ["bound", "bound"]
    assert len(branch) <= 60
    assert branch.column("h1_0").max() == pytest.approx(peak, rel=2e-3)  # the largest stored point, not refined
    assert branch.column("residual").max() < 1e-9
    counts = branch.column("n_events")
    assert set(counts.tolist()) == {0, 4}
    inside = branch.column("omega")
    assert np.all(counts[(inside > ONSETS[0] + 1e-9) & (inside < ONSETS[1] - 1e-9)] == 4)


@pytest.mark.parametrize("samples", [256, 1024])
def test_sampled_contacts_give_the_same_branch(samples):
    branch = traced(HarmonicBalance(7, aft="sampled", samples=samples))
    assert [str(reason) for reason in branch.stop_reason] == ["bound", "bound"]
    points = branch.special_points
    assert len(points) == 2 and all(abs(p.parameter - onset) < 40.0 / samples**2 for p, onset in zip(points, ONSETS, strict=True))
    assert len(branch) <= 60 and sum(end.rejected for end in branch.ends) <= 2  # corners that sampling makes are no jumps


@pytest.mark.parametrize("method", [HarmonicBalance(7), HarmonicBalance(7, aft="sampled", samples=256)])
def test_multipliers_of_a_branch_are_those_of_its_orbits(method):
    branch = traced(method, ds_max=0.1)
    columns = np.array([branch.column(f"multiplier_{k}") for k in range(3)]).T
    for i in range(0, len(branch), 7):
        own = branch.orbits[i].multipliers  # memory is a state only where it is written
        np.testing.assert_allclose(columns[i, :len(own)], own, atol=1e-9)
        assert not columns[i, len(own):].any()


def test_points_of_the_branch_are_orbits_with_their_measures():
    branch = traced(HarmonicBalance(7))
    i = int(np.argmax(branch.column("h1_0")))
    orbit = branch.orbits[i]
    assert orbit.success and orbit.signature == "jenkins: slip+ stick slip- stick"
    for name, value in (("h1_0", abs(orbit.harmonic(1))), ("max_0", orbit.maximum()), ("min_0", orbit.minimum()),
                        ("rms_0", orbit.rms()), ("period", orbit.period)):
        assert branch.column(name)[i] == pytest.approx(value, abs=1e-12)
    again = bf.find_orbit(orbit.system, guess=orbit, method=HarmonicBalance(7))
    np.testing.assert_allclose(again.coefficients, orbit.coefficients, atol=1e-11)


def test_branch_in_the_limit_of_the_slider():
    """The stuck amplitude at omega 1.3 does not depend on the limit; slip ends where the limit reaches its force."""
    stuck = 1.0 / abs(2.0 - 1.69 + 0.026j)
    branch = bf.trace(bf.find_orbit(j1(1.3), method=HarmonicBalance(9)), "limit", bounds=(0.5, 4.0))
    point, = branch.special_points
    assert abs(point.parameter - stuck) <= 1e-10 and str(point.kind) == "slip_onset"


def test_branch_is_saved_and_extended_bit_for_bit(tmp_path):
    whole = bf.trace(bf.find_orbit(j1(1.5), method=HarmonicBalance(5)), "omega", bounds=(1.2, 2.0))
    part = bf.trace(bf.find_orbit(j1(1.5), method=HarmonicBalance(5)), "omega", bounds=(1.4, 1.8))
    part.save(tmp_path / "branch.npz")
    loaded = bf.load(tmp_path / "branch.npz")
    assert np.array_equal(loaded.column("h1_0"), part.column("h1_0"))
    a, b = part.extend(bounds=(1.2, 2.0)), loaded.extend(bounds=(1.2, 2.0))
    assert np.array_equal(a.column("h1_0"), b.column("h1_0")) and np.array_equal(a.column("omega"), b.column("omega"))
    assert [p.kind for p in a.special_points] == [p.kind for p in whole.special_points]


def test_duffing_response_folds_twice_through_its_peak():
    system = System(1.0, 0.05, 1.0, [HarmonicForce(0.18), CubicSpring(0.1)], omega=0.5)
    branch = bf.trace(bf.find_orbit(system, method=HarmonicBalance(7, samples=29)), "omega", bounds=(0.5, 1.6))
    assert [str(point.kind) for point in branch.special_points] == ["fold", "fold"]
    assert branch.column("h1_0").max() == pytest.approx(2.83019805945, rel=1e-3)
    assert [str(reason) for reason in branch.stop_reason] == ["bound", "bound"]


def test_grazing_of_an_elastic_stop_is_where_the_linear_amplitude_reaches_the_gap():
    system = System(1.0, 0.2, 1.0, [HarmonicForce(0.5), ElasticStop(gap=1.0, stiffness=3.0)], omega=0.5)
    branch = bf.trace(bf.find_orbit(system, method=HarmonicBalance(9)), "omega", bounds=(0.5, 1.6))
    graze = [math.sqrt(s) for s in np.roots([1.0, 0.2**2 - 2.0, 1.0 - 0.25])[::-1]]  # |1 - s + .2i sqrt(s)| = .5
    found = branch.special_points.of("grazing")
    assert abs(found[0].parameter - graze[0]) <= 1e-10
    assert [str(reason) for reason in branch.stop_reason] == ["bound", "bound"]


def test_set_valued_friction_is_not_continued():
    orbit = bf.find_orbit(systems.dry_friction_oscillator(), method=HarmonicBalance(15))
    with pytest.raises(ValueError, match="set-valued"):
        bf.trace(orbit, "omega", bounds=(0.5, 2.0))

def test_special_points_are_those_of_the_general_search(monkeypatch):
    """The zero of a margin in one compiled call, and asked place by place from Python."""
    made = []
    for general in (False, True):
        if general:
            monkeypatch.setattr(BalanceProblem, "zero", lambda *_: None)
        for system, bounds in ((lambda w: bf.systems.jenkins_oscillator(zeta=0.01, omega=w, amplitude=1.0), (0.4, 2.0)),
                               (lambda w: bf.systems.bilinear_oscillator(zeta=0.05, omega=w, amplitude=0.3, gap=0.5), (0.5, 1.5))):
            orbit = bf.find_orbit(system(bounds[0]), method=bf.HarmonicBalance(5))
            made.append(bf.trace(orbit, "omega", bounds=bounds).special_points)
    for fast, slow in zip(made[:2], made[2:], strict=True):
        assert len(fast) >= 2 and [point.kind for point in fast] == [point.kind for point in slow]
        for one, other in zip(fast, slow, strict=True):
            assert abs(one.parameter - other.parameter) <= one.error + other.error
            assert 0.0 < one.error < 1e-11


def test_a_correction_at_a_value_stays_at_it():
    """Beside a law that is sampled, too: it is how a branch ends at its bound."""
    for element in (CubicSpring(0.4), ElasticStop(0.2, 2.0)):
        orbit = bf.find_orbit(System(1.0, 0.1, 1.0, [HarmonicForce(0.3), element], omega=0.5), method=HarmonicBalance(5))
        problem = bf.trace(orbit, "omega", bounds=(0.4, 0.6), max_steps=2).problems[0]
        x = problem.x0 + 1e-3 * problem.scale
        for tangent in (np.ones(x.size) / np.sqrt(x.size), np.eye(x.size)[-1]):
            c = problem.correct(x, tangent, True)
            assert c.converged and c.x[-1] == x[-1]
