"""Curves in two parameters of branch points, and of changes of stability that only multipliers tell."""
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation import Problem, trace, trace_curve
from bifurc.elements import ConstantForce, CubicSpring, Force, HarmonicForce
from bifurc.system import System
from tests.reference import chain, two_stops

AMPLITUDE = "harmonic_force.amplitude"


class Pitchfork(Problem):
    """u^3 - (p - q^2) u: branch points at p = q^2."""

    def __init__(self, q=0.5):
        super().__init__(0.0, -1.0)
        self.q = q

    def residual(self, u, p):
        return u**3 - (p - self.q**2) * u


class Transcritical(Problem):
    """u = 0 for all p, another branch crosses it where p + 0.3 p = sin q; v follows."""

    def __init__(self, q=0.5):
        super().__init__([0.0, -0.3], -1.0)
        self.q = q

    def residual(self, u, p):
        return np.array([u[0] * (p - math.sin(self.q) - u[0] + u[1]), u[1] - 0.3 * p - u[0]])


class Broken(Problem):
    """A pitchfork that q breaks."""

    def __init__(self, q=0.5):
        super().__init__(0.0, -1.0)
        self.q = q

    def residual(self, u, p):
        return u**3 - (p - 1.0) * u + 0.3 * (self.q - 0.5)


@pytest.mark.parametrize(("make", "exact"), [(Pitchfork, np.square), (Transcritical, lambda q: np.sin(q) / 1.3)])
def test_branch_points_that_a_symmetry_or_a_known_solution_keeps(make, exact, tmp_path):
    point = trace(make(), bounds=(-2, 2)).special_points.of("branch_point")[0]
    curve = trace_curve(point, ("p", "q"), bounds={"q": (-1, 2), "p": (-3, 3)})
    assert len(curve) > 10 and np.abs(curve.column("p") - exact(curve.column("q"))).max() < 1e-12
    assert all(end.reason == "bound" for end in curve.ends)
    curve.save(tmp_path / "curve.npz")
    read = type(curve).load(tmp_path / "curve.npz", problem=make())
    assert np.array_equal(read.column("p"), curve.column("p"))


def test_a_branch_point_that_the_second_parameter_breaks_says_so():
    point = trace(Broken(), bounds=(-2, 2)).special_points.of("branch_point")[0]
    with pytest.raises(ValueError, match="isolated points only"):
        trace_curve(point, ("p", "q"), bounds={"q": (-1, 2), "p": (-3, 3)})


@pytest.mark.parametrize("closure", [1, -1])
def test_pitchforks_between_two_stops_in_closed_form(closure):
    """On the whole period by the unfolded equations, on half of it as a flip."""
    omega, force = 2.0, 2.0
    system = bf.systems.two_sided_impact_oscillator(zeta=0.1, omega=omega, amplitude=force, gap=1.0, restitution=0.7)
    reference = [o for o in two_stops.orbits(0.1, omega, force, 1, 0.7, 1) if o.admissible][-1]
    motion, half = reference.motion, reference.motion.period / 2
    t = reference.time % (2 * half)
    sign = -1 if t < half else 1
    y = motion.flow(t + half if t < half else t, sign * reference.gap, -sign * reference.restitution * reference.speed, 2 * half)
    orbit = bf.find_orbit(system, tuple(float(z) for z in y), closure=closure)
    (point,) = bf.trace(orbit, "amplitude", bounds=(0.5, 3.6)).special_points.of("branch_point")
    curve = bf.trace_curve(point, ("omega", "amplitude"), bounds={"omega": (1.95, 2.1), "amplitude": (1.0, 6.0)})
    for w, a in zip(curve.column("omega")[::4], curve.column("amplitude")[::4], strict=True):
        assert a == pytest.approx(float(two_stops.special_forces(0.1, w, 1, 0.7, 1)["branch_point"][0]), rel=1e-12)


def ueda(amplitude=2.0, mean=0.0):
    return System(1.0, 0.1, 0.0, [HarmonicForce(amplitude), ConstantForce(mean), CubicSpring(1.0)], omega=1.0)


@pytest.mark.parametrize(("mean", "harmonics", "kind", "top"), [
    (0.6, 9, "period_doubling", 6.0), (0.0, (1, 3, 5, 7, 9), "branch_point", 4.0), (0.0, 9, "branch_point", 4.0)])
def test_changes_of_stability_of_harmonic_balance_are_followed(mean, harmonics, kind, top):
    """The last point of the curve is the special point of a separate branch."""
    method = bf.HarmonicBalance(harmonics)
    branch = bf.trace(bf.find_orbit(ueda(mean=mean), method=method), AMPLITUDE, bounds=(1.0, top))
    point = branch.special_points.of(kind)[0]
    curve = bf.trace_curve(point, (AMPLITUDE, "omega"), bounds={"omega": (0.99, 1.01), AMPLITUDE: (0.5, 6.0)})
    assert [end.reason.value for end in curve.ends] == ["bound", "bound"]
    other = ueda(mean=mean).with_parameters(omega=float(curve.column("omega")[-1]))
    there = bf.trace(bf.find_orbit(other, method=method), AMPLITUDE, bounds=(1.0, top)).special_points.of(kind)
    assert min(abs(p.parameter - curve.column(AMPLITUDE)[-1]) for p in there) < 1e-10


def van_der_pol(u, s, mu):
    return mu * (1.0 - u * u) * s


@pytest.mark.slow  # compiles the law
def test_tori_of_harmonic_balance_by_liouville():
    """Where entrainment ends the mean of mu (1 - u^2) is zero: the rms of u is 1 all along the curve."""
    system = System(1.0, 0.0, 1.0, [HarmonicForce(3.0), Force(van_der_pol, mu=0.3)], omega=1.6)
    branch = bf.trace(bf.find_orbit(system, method=bf.HarmonicBalance(9)), AMPLITUDE, bounds=(0.5, 4.0))
    (point,) = branch.special_points.of("neimark_sacker")
    curve = bf.trace_curve(point, (AMPLITUDE, "omega"), bounds={"omega": (1.55, 1.65), AMPLITUDE: (0.5, 4.0)})
    assert np.abs(curve.column("rms_0") - 1.0).max() < 1e-8


@pytest.mark.slow
def test_tori_of_the_chain_of_eight_masses_in_long_arithmetic():
    """Over the restitution: the multipliers of the orbits in closed form lie on the unit circle."""
    system = bf.systems.impact_chain(amplitude=0.45)
    scene = chain.spring_chain(8, 0.3, 0.45, 0.7)
    reference = scene.orbits(samples=200)[-1]
    y = scene.at_phase_zero(reference)
    branch = bf.trace(bf.find_orbit(system, y, periods=1), "amplitude", bounds=(0.3672, 0.46))
    point = min((p for p in branch.special_points.of("neimark_sacker") if p.before.count("impact") == 1), key=lambda p: p.parameter)
    curve = bf.trace_curve(point, ("amplitude", "restitution"), bounds={"restitution": (0.68, 0.72), "amplitude": (0.3, 0.6)})
    for k in (0, -1):
        at = [float(curve.column(name)[k]) for name in ("amplitude", "restitution")]
        exact = [torus_excess(amplitude, at[1]) for amplitude in (at[0], at[0] + 1e-6)]
        assert abs(exact[0] * 1e-6 / (exact[1] - exact[0])) < 1e-9  # in the amplitude


def torus_excess(amplitude, restitution):
    """Modulus of the complex pair nearest to the unit circle, less 1, of the upper orbit with one impact a period."""
    orbit = chain.spring_chain(8, 0.3, amplitude, restitution).orbits(samples=60)[-1]
    return min((abs(mu) - 1 for mu in orbit.multipliers if abs(mu.imag) > 1e-6), key=abs)
