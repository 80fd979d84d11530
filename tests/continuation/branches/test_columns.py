"""Columns of problems of orbits against the orbits themselves; rows at boundaries; classification on stand-ins."""
import math
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.free_vibration import EnergyProblem, resonances
from bifurc.continuation.grazing import local
from bifurc.continuation.grazing.classify import grazing_of
from bifurc.continuation.kinds import CorrectorStatus, SpecialPointKind, StopReason
from bifurc.continuation.problem import Corrected
from bifurc.continuation.shooting.problem import orbit_problem
from bifurc.continuation.steps import detect
from tests.continuation.problems import parabola

CASES = {
    "one stop": (lambda: bf.systems.impact_oscillator(omega=0.8), "omega"),
    "two stops": (lambda: bf.systems.two_sided_impact_oscillator(zeta=0.1, omega=1.2, amplitude=2.0, restitution=0.7), "amplitude"),
    "two masses": (lambda: bf.systems.impact_chain(n=2, damping=0.1, omega=0.9, restitution=0.7, amplitude=0.9), "omega"),
}


@pytest.mark.parametrize("name", CASES)
def test_columns_are_those_of_the_orbit(name):
    made, parameter = CASES[name]
    orbit = bf.find_orbit(made())
    value = orbit.system.parameter(orbit.system.parameter_name(parameter))
    problem = orbit_problem(orbit, parameter, (0.9 * value, 1.1 * value))
    xs = problem.x0[None]
    t, y = orbit.sample(4001)

    def column(what):
        return problem.measure(what, xs)[0]
    assert column("period") == pytest.approx(2.0 * np.pi / orbit.system.omega * orbit.periods, rel=1e-13)
    impacts = np.count_nonzero(np.abs(np.diff(y[:, orbit.system.n])) > 0.1 * np.ptp(y[:, orbit.system.n]))
    assert column("n_events") == len(orbit.events) and impacts <= column("n_events")
    assert bool(column("stable")) == orbit.stable
    for dof in range(orbit.system.n):
        q = y[:, dof]
        near = np.abs(y[:, orbit.system.n + dof]).max() * (t[1] - t[0])  # tops at impacts lie between two samples
        assert 0.0 <= column(f"max_{dof}") - q.max() <= near and 0.0 <= q.min() - column(f"min_{dof}") <= near
        mean_square = np.trapezoid(q * q, t) / (t[-1] - t[0])
        assert column(f"rms_{dof}") == pytest.approx(np.sqrt(mean_square), rel=1e-3)
        first = 2.0 * np.abs(np.trapezoid(q * np.exp(-1j * orbit.system.omega * t), t)) / (t[-1] - t[0])
        assert column(f"h1_{dof}") == pytest.approx(first, rel=1e-3)
    told = sorted((column(f"multiplier_{k}") for k in range(2 * orbit.system.n)), key=lambda z: (abs(z), np.imag(z)))
    np.testing.assert_allclose(np.abs(told), np.sort(np.abs(orbit.multipliers)), atol=1e-9)


def test_the_column_of_a_parameter_has_the_names_that_trace_takes():
    """Without a gap motions scale with the load, so that columns of one are those of the other."""
    orbit = bf.find_orbit(bf.System(1.0, 0.1, 1.0, [bf.elements.HarmonicForce(0.6), bf.elements.RigidStop(0.0, 0.8)], omega=0.9))
    branch = bf.trace(orbit, "harmonic_force.amplitude", bounds=(0.5, 0.7))
    load = branch.column("amplitude")
    assert load.min() == 0.5 and load.max() == 0.7
    for name in ("harmonic_force.amplitude", "parameter"):
        np.testing.assert_array_equal(branch.column(name), load)
    np.testing.assert_allclose(branch.column("min_0") / load, branch.column("min_0")[0] / load[0], rtol=1e-12)
    for name in ("tude", "gap"):
        with pytest.raises(KeyError, match=f"no column '{name}'"):
            branch.column(name)


def test_columns_of_a_family_of_free_vibration():
    """Two masses without contact: the frequencies are those of the linear modes at any energy."""
    K = np.array([[2.0, -0.6], [-0.6, 1.5]])
    system = bf.System(np.eye(2), np.zeros((2, 2)), K, [bf.elements.ElasticStop(50.0, 1.0, dof=0)])
    w = np.sqrt(np.linalg.eigvalsh(K))
    q = np.linalg.eigh(K)[1][:, 0]
    orbit = bf.find_orbit(system, guess=(*(q / q[0]), 0.0, 0.0))
    assert orbit.success and orbit.omega == pytest.approx(w[0], rel=1e-10)
    problem = EnergyProblem(system, orbit.sequence, orbit.weights, np.concatenate([orbit.unknowns, [0.0, orbit.energy]]))
    xs = problem.x0[None]
    assert problem.measure("omega", xs)[0] == pytest.approx(w[0], rel=1e-10)
    assert problem.measure("period", xs)[0] == pytest.approx(2.0 * np.pi / w[0], rel=1e-10)
    assert problem.measure("max_0", xs)[0] == pytest.approx(1.0, rel=1e-9)
    mu = np.array([problem.measure(name, xs)[0] for name in problem.measure_names if name.startswith("multiplier_")])
    want = np.exp(2j * np.pi * w[1] / w[0] * np.array([1.0, -1.0]))
    np.testing.assert_allclose(np.sort_complex(mu), np.sort_complex(want), atol=1e-8)
    assert problem.measure("stable", xs).tolist() == [True]
    assert problem.solution(problem.x0).energy == pytest.approx(orbit.energy)


@pytest.mark.parametrize("q, p", [(2, 1), (3, 1), (4, 1), (5, 1), (5, 2)])
def test_resonances_change_their_sign_where_a_pair_passes_a_root_of_unity(q, p):
    def at(angle, *others):
        return np.array(resonances(np.array([np.exp(1j * angle), np.exp(-1j * angle), *others], complex)))
    other = np.exp(np.array([1j, -1j]) * 0.3)
    angle = 2.0 * np.pi * p / q
    if q > 2:  # the cosine turns at -1
        assert at(angle - 1e-3, *other)[q - 2] * at(angle + 1e-3, *other)[q - 2] < 0.0
    assert at(angle, *other)[q - 2] == pytest.approx(0.0, abs=1e-12)
    rest = [k for k in range(4) if k != q - 2]
    assert (np.abs(at(angle, *other)[rest]) > 1e-4).all()
    assert np.isnan(resonances(np.array([np.inf, 0.0], complex))).all()


# grazings

def test_other_points_are_no_grazings():
    def point(kind, sequence):
        return SimpleNamespace(kind=kind, problem=SimpleNamespace(sequence=sequence))
    assert grazing_of(point(SpecialPointKind.FOLD, object())) is None
    assert grazing_of(point(SpecialPointKind.GRAZING, None)) is None


@pytest.mark.parametrize("growth", [2.0, -2.0])
def test_a_motion_that_forgets_all_between_two_touches_hits_with_the_speed_of_the_first(growth, monkeypatch):
    monkeypatch.setattr(local, "apex_growth", lambda touch: touch.growth)
    monkeypatch.setattr(local, "rate_gradient", lambda touch: np.array([0.0, 1.0]))
    monkeypatch.setattr(local, "field_slope", lambda e, T, mode, x: np.zeros((2, 2)))
    asked = []
    monkeypatch.setattr(local, "kicked", lambda touch, u, apex, jerk, F: asked.append(u) or np.array([0.0, -u]))

    def touch(E, **more):
        made = {"growth": growth, "restitution": 0.5, "x": np.array([1.0, 4.0]), "apex": -3.0, "jerk": 0.0, "E": np.array(E),
                "h": np.array([1.0, 0.0]), "state": np.zeros(2), "time": 0.0, "tables": None, "mode": 0,
                "joined": lambda y, t: np.zeros(2), "problem": SimpleNamespace(parameter_scale=1.0, equations=None)}
        return SimpleNamespace(**{**made, **more})
    eps = 1e-6
    seen = local.local_motion(touch(np.zeros((2, 2))), eps)
    depth = abs(growth) * eps * 4.0
    assert seen.first == pytest.approx(math.sqrt(2.0 * depth * 3.0), rel=1e-12)
    assert seen.speed == pytest.approx(seen.first, rel=1e-12) and seen.small and seen.eps == eps
    assert asked[0] == pytest.approx(math.sqrt(2.0 * depth / 3.0), rel=1e-12)
    # a position that is thrown far beyond makes it grow until it is out
    far = local.local_motion(touch([[0.0, -50.0], [0.0, 0.0]]), eps)
    assert far.speed > local.OUT * far.first and not far.small
    for none in (touch(np.eye(2), restitution=None), touch(np.eye(2), growth=0.0), touch(np.eye(2), growth=math.nan)):
        assert local.local_motion(none, eps) is None


# boundaries in a step

def test_a_step_beyond_a_boundary_is_cut_or_says_why(monkeypatch):
    part = SimpleNamespace(boundary=[1], monitors=[SimpleNamespace(kind="graze")], touch=1e-9, scale=np.ones(2), born=0)

    def row(s, *tests):
        return SimpleNamespace(s=s, tests=[0.0, *tests], part=part, det_sign=1.0, det_log=0.0, angle=0.1)

    def half(sign):
        return SimpleNamespace(signs=[0, sign], sizes=[1.0, 1.0], ds=0.1, rows=[row(0.0, 0.0)])
    monkeypatch.setattr(detect, "beginning", lambda half, row, new, j: row)
    assert detect.boundary(half(-1), row(0.0, -0.5), row(0.1, -0.2)) == (None, None)
    cut, why = detect.boundary(half(1), row(0.0, 0.2), row(0.1, 0.5))
    assert cut is None and why[0] is StopReason.INADMISSIBLE
    for sign, value in ((0, 0.2), (0, -0.2), (1, -0.2)):
        cut, why = detect.boundary(half(sign), row(0.0, value), row(0.1, 0.5))
        assert cut is None and why[0] is StopReason.NO_SUCCESSOR
    monkeypatch.setattr(detect, "zero_between", lambda part, a, b, j: None)
    assert detect.boundary(half(-1), row(0.0, -0.2), row(0.1, 0.5))[1][0] is StopReason.DS_MIN
    corrected = Corrected(np.zeros(2), np.array([0.0, 1.0]), True, CorrectorStatus.CONVERGED, 1, 0.0, 0.0, 0.0, 1.0, 0.0,
                          np.zeros(1))
    monkeypatch.setattr(detect, "zero_between", lambda part, a, b, j: SimpleNamespace(corrected=corrected, s=0.03))
    monkeypatch.setattr(detect, "tests_of", lambda c: [0.0, 0.0])
    cut, why = detect.boundary(half(-1), row(0.0, -0.2), row(0.1, 0.5))
    assert why is None and cut.test == 1 and cut.corrected is corrected and cut.row.s == 0.03
    assert cut.row.angle == pytest.approx(0.1 * 0.3)
    corrected.det_sign, new = -1.0, row(0.1, 0.5)
    new.det_sign = -1.0
    cut, why = detect.boundary(half(-1), row(0.0, -0.2), new)
    assert cut is None and why[0] is StopReason.DS_MIN
    part.boundary = []
    assert detect.boundary(half(1), row(0.0, 0.2), row(0.1, 0.5)) == (None, None)


def test_solutions_are_a_sequence():
    """Indices, slices with any step, and iteration give what a list of the rows gives."""
    branch = bf.continuation.trace(parabola(), bounds=(-1.0, 1.0))
    rows = [branch.x(i).tolist() for i in range(len(branch))]
    orbits = branch.orbits
    assert len(orbits) == len(rows) > 8 and repr(orbits) == f"Solutions({len(rows)})"

    def shown(items):
        return [[*item.u.tolist(), item.p] for item in items]
    assert shown(orbits) == rows == shown(orbits[i] for i in range(len(rows)))
    for part in (slice(None), slice(2, 7), slice(None, None, 2), slice(1, -2, 3), slice(None, None, -1), slice(7, 2, -2),
                 slice(-3, None), slice(5, 5)):
        assert shown(orbits[part]) == rows[part]
    assert shown([orbits[-1], orbits[-len(rows)]]) == [rows[-1], rows[0]] and branch.x(-2).tolist() == rows[-2]
    for i in (len(rows), -len(rows) - 1):
        with pytest.raises(IndexError):
            orbits[i]
