"""Branches in few coordinates: points, special points, measures and multipliers are those of the whole balance."""
import numpy as np
import pytest

import bifurc as bf
from bifurc import HarmonicBalance, System
from bifurc.elements import ConstantForce, CubicSpring, ElasticStop, HarmonicForce, Jenkins, LinearSpring

H = 5
CONDENSED, WHOLE = HarmonicBalance(H, condense=True), HarmonicBalance(H, condense=False)


def chain(elements, modal=True, drive=0, n=6, omega=0.3):
    """Masses between walls, excited at ``drive``, with a static load at the end."""
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    C = 0.03 * np.eye(n) + 0.02 * K
    if not modal:
        C[n // 2, n // 2] += 0.2
    return System(np.eye(n), C, K, [HarmonicForce(1.0, dof=drive), ConstantForce(0.05, dof=n - 1), *elements], omega=omega)


SLIDER = [Jenkins(1.0, 0.4, dof=2)]
STOP = [ElasticStop(gap=2.0, stiffness=1.0, dof=1), CubicSpring(0.02, dof=4)]
CASES = {  # elements, modal, drive, parameter, bounds
    "slider": (SLIDER, True, 0, "omega", (0.25, 0.6)),
    "slider, local damping": (SLIDER, False, 5, "omega", (0.25, 0.6)),
    "stop and cubic": (STOP, False, 3, "omega", (0.25, 0.5)),
    "limit": (SLIDER, False, 4, "jenkins.limit", (0.2, 2.0)),
    "load": (STOP, True, 3, "harmonic_force.amplitude", (0.3, 1.2)),
    "mass": (SLIDER, True, 0, "mass[3,3]", (0.6, 1.5)),
    "damping": (SLIDER, False, 0, "damping[3,3]", (0.05, 1.0)),
    "spring": ([*SLIDER, LinearSpring(0.1, dof=4)], True, 0, "linear_spring.stiffness", (0.05, 1.0)),
}


def both(elements, modal, drive, parameter, bounds, **options):
    system = chain(elements, modal, drive)
    found = [bf.find_orbit(system, method=method) for method in (CONDENSED, WHOLE)]
    return [bf.trace(orbit, parameter, bounds=bounds, **options) for orbit in found]


def exact_at(orbit):
    """The whole balance solved at the parameters of an orbit, from near it."""
    return bf.find_orbit(orbit.system, method=WHOLE, guess=orbit.coefficients)


@pytest.mark.parametrize("case", CASES)
def test_branch_is_that_of_the_whole_balance(case):
    own, other = both(*CASES[case])
    assert [str(reason) for reason in own.stop_reason] == [str(reason) for reason in other.stop_reason] == ["bound", "bound"]
    assert [str(p.kind) for p in own.special_points] == [str(p.kind) for p in other.special_points]
    for a, b in zip(own.special_points, other.special_points, strict=True):
        assert a.parameter == pytest.approx(b.parameter, abs=1e-10)
    onsets = [point.parameter for point in own.special_points]  # where multipliers are most sensitive
    away = [min(map(abs, p - np.array([*onsets, np.inf]))) > 1e-4 for p in own.column(own.parameter)]
    for i in np.flatnonzero(away)[[0, len(own) // 2, -1]]:
        orbit = own.orbits[i]
        assert orbit.success and orbit.residual <= 1e-12 and "unknowns to" in orbit.how["condensed"]
        whole = exact_at(orbit)
        assert whole.success
        assert np.abs(whole.coefficients - orbit.coefficients).max() <= 1e-10 * np.abs(whole.coefficients).max()
        for name, value in (("max_5", orbit.maximum(5)), ("h1_3", abs(orbit.harmonic(1, 3))), ("rms_0", orbit.rms(0)),
                            ("period", orbit.period)):
            assert own.column(name)[i] == pytest.approx(value, abs=1e-12)
        assert own.column("multiplier_0")[i] == pytest.approx(whole.multipliers[0], abs=1e-8)
        assert bool(own.column("stable")[i]) is whole.stable


def test_peaks_of_coordinates_that_nothing_touches():
    """Where the contact is a node of the second mode, steps see its resonance through the drive."""
    system = chain([Jenkins(1.0, 0.4, dof=2)], True, 0, n=5, omega=0.8)
    own, other = (bf.trace(bf.find_orbit(system, method=method), "omega", bounds=(0.7, 1.3), peaks=("max_0", "h1_4"))
                  for method in (CONDENSED, WHOLE))
    a, b = own.special_points.of("peak"), other.special_points.of("peak")
    assert len(a) == len(b) >= 2
    for p, q in zip(a, b, strict=True):
        assert p.parameter == pytest.approx(q.parameter, abs=1e-10)
        assert p.solution.maximum(0) == pytest.approx(q.solution.maximum(0), rel=1e-10)
    assert own.column("max_0").max() == pytest.approx(other.column("max_0").max(), rel=1e-3)  # the largest stored


def test_folds_and_their_curve():
    """A cubic spring far from the load; the curve of folds in two parameters is that of the whole balance."""
    K, C = 2.0 * np.eye(5) - np.eye(5, k=1) - np.eye(5, k=-1), 0.01 * np.eye(5)
    C[2, 2] += 0.02
    system = System(np.eye(5), C, K, [HarmonicForce(0.1, dof=3), CubicSpring(0.03, dof=1)], omega=0.5)
    own, other = (bf.trace(bf.find_orbit(system, method=method), "omega", bounds=(0.5, 0.6)) for method in (CONDENSED, WHOLE))
    a, b = own.special_points.of("fold"), other.special_points.of("fold")
    assert len(a) == len(b) >= 2
    for p, q in zip(a, b, strict=True):
        assert p.parameter == pytest.approx(q.parameter, abs=1e-10)
    curves = [bf.trace_curve(points[0], ("omega", "harmonic_force.amplitude"), bounds=((0.5, 0.6), (0.08, 0.12)))
              for points in (a, b)]
    first, second = ([curve.column(name) for name in ("omega", "harmonic_force.amplitude")] for curve in curves)
    ends = [sorted(zip(*(column[[0, -1]] for column in columns), strict=True)) for columns in (first, second)]
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-9)


@pytest.mark.parametrize("case", ["slider, local damping", "mass"])
def test_branch_is_saved_and_extended_bit_for_bit(case, tmp_path):
    elements, modal, drive, parameter, (low, high) = CASES[case]
    middle = 0.5 * (low + high)
    system = chain(elements, modal, drive).with_parameters(**{parameter: middle})
    part = bf.trace(bf.find_orbit(system, method=CONDENSED), parameter, bounds=(0.5 * (low + middle), 0.5 * (middle + high)))
    part.save(tmp_path / "branch.npz")
    loaded = bf.load(tmp_path / "branch.npz")
    assert np.array_equal(loaded.column("h1_5"), part.column("h1_5"))
    a, b = part.extend(bounds=(low, high)), loaded.extend(bounds=(low, high))
    for name in (parameter, "max_3"):
        assert np.array_equal(a.column(name), b.column(name))


def test_stiffness_that_passes_through_zero_is_no_branch_point():
    """The mean's linear stiffness changes its sign where contacts still hold the mass: nothing happens there."""
    K = np.diag([1.0, 1.0, 1.0]) + np.zeros((3, 3))
    K[0, 1] = K[1, 0] = -0.2
    system = System(np.eye(3), 0.1 * np.eye(3), K, [HarmonicForce(0.5, dof=1), CubicSpring(0.3, dof=0), LinearSpring(0.5, dof=0)],
                    omega=0.6)
    own, other = (bf.trace(bf.find_orbit(system, method=method), "linear_spring.stiffness", bounds=(-1.3, 0.5))
                  for method in (CONDENSED, WHOLE))
    assert [str(p.kind) for p in own.special_points] == [str(p.kind) for p in other.special_points]
    for a, b in zip(own.special_points, other.special_points, strict=True):
        assert a.parameter == pytest.approx(b.parameter, abs=1e-9)
