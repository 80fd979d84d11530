"""Isolated branches: an isola in closed form, one of a bilinear oscillator against 40 digits, deflation itself."""
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation import Problem
from bifurc.continuation.deflation import deflated_orbits, deflated_solutions, isolas
from tests.reference import bilinear


class OneHarmonic(Problem):
    """x'' + (2 zeta - c x^2 + d x^4) x' + x + beta x^3 = F cos wt with x = a cos + b sin."""

    parameter = "w"
    measure_names = ("amplitude",)

    def __init__(self, u, w, f=0.02202):
        super().__init__(u, w, scale_u=1.0, scale_p=0.1)
        self.f = float(f)

    def residual(self, u, w):
        a, b = u
        square = a * a + b * b
        damping = 0.1 - 0.8 * square / 4.0 + square**2 / 8.0
        k = 1.0 - w * w + 0.075 * square
        return np.array([k * a + damping * w * b - self.f, k * b - damping * w * a])

    def measure(self, name, xs):
        return np.hypot(xs[:, 0], xs[:, 1])


ENDS = ((1.01577491955197, 0.755548679752), (1.03695837893160, 0.934933912622))


def amplitudes(w, f=0.02202):
    """Roots a = A^2 of a ((1 - w^2 + 3/4 beta a)^2 + w^2 del^2) = F^2."""
    k = np.polynomial.Polynomial([1.0 - w * w, 0.075])
    damping = np.polynomial.Polynomial([0.1, -0.2, 0.125])
    a = np.polynomial.Polynomial([0.0, 1.0])
    roots = (a * (k**2 + w * w * damping**2) - f * f).roots()
    return np.sort(roots[(np.abs(roots.imag) < 1e-12) & (roots.real > 0.0)].real)


def test_solutions_inside_and_outside_the_isola():
    for w, others in ((1.025, 2), (1.005, 0), (1.045, 0)):
        a = math.sqrt(amplitudes(w)[0])
        found = deflated_solutions(OneHarmonic([0.9 * a, 0.3 * a], w))
        assert len(found) == others
        sizes = sorted(float(item.x0[:-1] @ item.x0[:-1]) for item in found)
        np.testing.assert_allclose(sizes, amplitudes(w)[1:], atol=1e-11)


def check_isola(start):
    branch = bf.trace(start, bounds=(0.9, 1.1))
    assert branch.closed
    folds = branch.special_points.of("fold")
    assert len(folds) == 2
    for point, (w, amplitude) in zip(sorted(folds, key=lambda p: p.parameter), ENDS, strict=True):
        assert point.parameter == pytest.approx(w, abs=1e-11)
        assert point.measures["amplitude"] == pytest.approx(amplitude, abs=1e-9)


def test_isola_by_deflation():
    a = math.sqrt(amplitudes(1.025)[0])
    check_isola(deflated_solutions(OneHarmonic([a, 0.0], 1.025))[0])


def test_isola_by_the_folds_of_a_higher_load():
    branch = bf.trace(OneHarmonic([0.3, 0.05], 0.9, f=0.032), bounds=(0.9, 1.1))
    folds = branch.special_points.of("fold")
    assert len(folds) >= 2  # one branch there
    bounds = {"w": (0.9, 1.1), "f": (0.021, 0.035)}
    starts = [start for point in folds for start in isolas(point, "f", 0.02202, bounds)]
    for start in starts:  # they solve the equations at that load, and are folds there
        assert start.f == 0.02202 and np.abs(start.residual(start.x0[:-1], start.x0[-1])).max() < 1e-12
        assert abs(np.linalg.det(start.jacobian(start.x0[:-1], start.x0[-1])[0])) < 1e-9
    closed = [bf.trace(start, bounds=(0.9, 1.1)).closed for start in starts]
    assert any(closed)
    check_isola(starts[closed.index(True)])


@pytest.fixture(scope="module")
def isola():
    """Orbits of three forcing periods beside a free response that never touches the spring."""
    system = bf.systems.bilinear_oscillator(zeta=0.02, omega=3.6, amplitude=1.0, gap=0.2, stiffness_ratio=5.0)
    free = bf.find_orbit(system)
    assert free.signature.startswith("free")
    return deflated_orbits(system, [free], periods=3, most=2)


def test_bilinear_isola_is_found_and_closes(isola):
    assert {orbit.stable for orbit in isola} == {True, False} and all(orbit.periods == 3 for orbit in isola)
    branch = bf.trace(isola[0], "omega", bounds=(2.0, 7.0))
    assert branch.closed and len(branch) < 200
    assert [str(p.kind) for p in branch.special_points].count("fold") == 2
    assert len(branch.special_points.of("grazing")) == 2


def test_ends_of_the_bilinear_isola_in_40_digits(isola):
    branch = bf.trace(isola[0], "omega", bounds=(2.0, 7.0))
    for point in branch.special_points.of("fold"):
        orbit = point.solution
        events = list(orbit.events)
        if str(events[0].kind) != "contact":
            last = events.pop(0)
            events.append(type(last)(last.time + orbit.period, last.element, last.kind, last.speed, last.before, last.after))
        guess = [point.parameter]
        for event in events:
            guess += [event.time, float(event.before[1])]
        w, _ = bilinear.special_point("fold", 0.02, 1.0, 0.2, 5.0, guess, periods=3)
        assert abs(point.parameter - float(w)) < 1e-11
        assert abs(point.parameter - float(w)) <= point.error + 1e-14


def test_wrong_points_are_named():
    branch = bf.trace(bf.find_orbit(bf.systems.impact_oscillator()), "omega", bounds=(0.5, 0.75))
    flip = branch.special_points.of("period_doubling")[0]
    with pytest.raises(ValueError, match="period_doubling"):
        isolas(flip, "amplitude", 0.5, {})
