"""The error that a special point states, of every kind, against closed forms: it holds the truth, and is not much more."""
import math

import mpmath as mp
import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation import Monitor, Problem
from bifurc.elements import ConstantForce, Coulomb, CubicSpring, HarmonicForce, Jenkins, RigidStop
from tests.reference.coulomb import SlipOnly
from tests.reference.one_impact import OneImpact

FARTHER, LEAST = 1e4, 1e-11  # how much more than the error may be stated: that, and a part of the parameter's scale
BIG = 1e9


def said(branch, kind, truth):
    """Check what is stated of the point of a kind next to the truth."""
    bounds = branch.bounds or (0.0, 0.0)
    points = [point for point in branch.special_points if point.kind == kind]
    assert points, (kind, truth, branch.special_points)
    point = min(points, key=lambda point: abs(mp.mpf(point.parameter) - truth))
    wrong, scale = float(abs(mp.mpf(point.parameter) - truth)), max(abs(float(truth)), 0.5 * abs(bounds[1] - bounds[0]))
    assert wrong < 1e-6 * scale
    assert wrong <= point.error <= FARTHER * wrong + LEAST * scale, f"{point}: off by {wrong:.2e}, states {point.error:.2e}"


class Watched(Problem):
    """u = exp(p) and a boundary, a peak of nothing, and events, all of a size of their own: zero at p = ln 2."""

    def __init__(self, size, boundary, power=1):
        super().__init__([1.0], 0.0)
        self.number, self.power = size, power
        self.monitors = (Monitor("grazing" if boundary else "user", "own", boundary=boundary),)

    def residual(self, u, p):
        return np.array([u[0] - math.exp(p)])

    def monitor_values(self, u, p, tangent):
        return np.array([self.number * math.copysign(abs(u[0] - 2.0)**self.power, u[0] - 2.0)])

    def switch(self, point, monitor):
        return "end"


class Cusp(Problem):
    """p = u - u^3 in units of u and of p."""

    def __init__(self, unit_u, unit_p):
        super().__init__([-1.5 * unit_u], 1.875 * unit_p, scale_u=unit_u, scale_p=unit_p)
        self.units = unit_u, unit_p

    def residual(self, u, p):
        v = u / self.units[0]
        return v - v**3 - p / self.units[1]


class Fork(Problem):
    """u (p - p0 - u^2) = 0 in skew coordinates: (u, v), v = sin u + p."""

    def __init__(self, place, size):
        super().__init__([0.0, -size], -size + place, scale_p=size)
        self.place, self.number = place, size

    def residual(self, u, p):
        mu = (p - self.place) / self.number
        return np.array([u[0] * (mu - u[0]**2), u[1] / self.number - math.sin(u[0]) - mu])


@pytest.mark.parametrize("size", [1e-9, 1.0, BIG])
@pytest.mark.parametrize("boundary", [True, False])
def test_numbers_of_an_algebraic_problem(size, boundary):
    said(bf.trace(Watched(size, boundary), bounds=(-1.0, 1.0)), "grazing" if boundary else "user", mp.log(2))


@pytest.mark.parametrize("unit_u", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("unit_p", [1e-6, 1.0, 1e6])
def test_folds_of_an_algebraic_problem(unit_u, unit_p):
    branch = bf.trace(Cusp(unit_u, unit_p), bounds=(-2.0 * unit_p, 2.0 * unit_p))
    for sign in (-1, 1):
        said(branch, "fold", sign * 2 * mp.mpf(unit_p) / (3 * mp.sqrt(3)))


@pytest.mark.parametrize(("place", "size"), [(0.3, 1.0), (0.3, 1e-3), (1e3, 1e4)])
def test_branch_points_of_an_algebraic_problem(place, size):
    said(bf.trace(Fork(place, size), bounds=(place - 1.1 * size, place + 1.3 * size)), "branch_point", mp.mpf(place))


def response(omega, zeta, level, **more):
    """Load at which the free response of a linear oscillator has the amplitude ``level``."""
    omega, zeta = mp.mpf(omega), mp.mpf(zeta)
    return level * abs(1 - omega**2 + 2j * zeta * omega)


@pytest.mark.parametrize("omega", [0.1, 0.6, 0.9, 1.7])
@pytest.mark.parametrize("gap", [1.0, 1e-4, 1e4])
def test_grazing(omega, gap):
    truth = response(omega, 0.05, mp.mpf(gap))
    system = bf.systems.impact_oscillator(zeta=0.05, omega=omega, amplitude=0.6 * float(truth), gap=gap)
    said(bf.trace(bf.find_orbit(system), "amplitude", (0.4 * float(truth), 1.05 * float(truth))), "grazing", truth)


@pytest.mark.parametrize("unit", [1e-9, 1.0, BIG])
def test_numbers_of_the_user(unit):
    system = bf.systems.impact_oscillator(zeta=0.05, omega=0.6, amplitude=0.3)
    branch = bf.trace(bf.find_orbit(system), "amplitude", (0.2, 0.6),
                      monitors={"clearance": lambda orbit: unit * (0.8 - orbit.maximum())})
    said(branch, "user", response(0.6, 0.05, mp.mpf(0.8)))


@pytest.mark.parametrize("measure", ["max_0", "rms_0", "h1_0"])
@pytest.mark.parametrize("load", [1e-6, 0.3, 1e6])
@pytest.mark.parametrize("method", [None, bf.HarmonicBalance(3)])
def test_peak(measure, load, method):
    zeta = mp.mpf(0.1)
    system = bf.System(1.0, 0.2, 1.0, [HarmonicForce(load)], omega=0.5)
    orbit = bf.find_orbit(system) if method is None else bf.find_orbit(system, method=method)
    branch = bf.trace(orbit, "omega", (0.5, 2.0), peaks=measure)
    said(branch, "peak", mp.sqrt(1 - 2 * zeta**2))


@pytest.mark.parametrize(("masses", "bounds"), [(8, (0.3, 0.5)), (2, (0.2, 0.8))])
def test_changes_of_stability_of_impacting_chains(masses, bounds):
    K = 2 * np.eye(masses) - np.eye(masses, k=1) - np.eye(masses, k=-1)
    K[-1, -1] = 1.0
    reference = OneImpact(0.1 * K, K, masses - 1, 1.0, 0.7, omega=0.3)
    branch, seen = bf.trace(bf.find_orbit(bf.systems.impact_chain(n=masses)), "amplitude", bounds), 0
    for point in branch.special_points:
        if point.kind in ("fold", "period_doubling", "neimark_sacker") and len(point.solution.events) == 1:
            said(branch, point.kind, reference.special(point))
            seen += 1
    assert seen


@pytest.mark.parametrize(("omega", "amplitude", "guess"), [(1.5, 0.9, (1.0, 0.2)), (2.6, 5.0, (-1.0, 1.0))])
def test_folds_and_flips_of_an_impact_oscillator(omega, amplitude, guess):
    reference = OneImpact([[0.1]], [[1.0]], 0, 1.0, 0.7, amplitude=amplitude)
    orbit = bf.find_orbit(bf.systems.impact_oscillator(omega=omega, amplitude=amplitude), guess=guess)
    branch, seen = bf.trace(orbit, "omega", (0.7 * omega, 1.6 * omega)), 0
    for point in branch.special_points:
        if point.kind in ("fold", "period_doubling") and len(point.solution.events) == 1:
            said(branch, point.kind, reference.special(point))
            seen += 1
    assert seen


@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e3])
def test_bounces(unit):
    """A ball once a period: born in a fold at pi (1 - r) / (1 + r), and its flip (Holmes 1982)."""
    r = mp.mpf(0.8)
    system = bf.systems.bouncing_ball(omega=1.0, amplitude=0.6 * unit, gravity=unit)
    orbit = bf.find_orbit(system, guess=(0.6 * unit, 2.8 * unit))
    branch = bf.trace(orbit, "amplitude", (0.3 * unit, 1.2 * unit))
    born, unit = mp.pi * (1 - r) / (1 + r), mp.mpf(unit)
    said(branch, "fold", unit * born)
    said(branch, "period_doubling", unit * mp.sqrt(born**2 + 4 * (1 + r**2)**2 / (1 + r)**4))


@pytest.mark.parametrize(("static", "kinetic", "decay", "zeta"), [
    (1.0, 0.5, 0.5, 0.05), (1.3, 0.4, 0.7, 0.02), (0.8, 0.6, 0.3, 0.1)])
def test_hopf(static, kinetic, decay, zeta):
    truth = mp.mpf(decay) * mp.log((mp.mpf(static) - mp.mpf(kinetic)) / (2 * mp.mpf(zeta) * mp.mpf(decay)))
    system = bf.systems.belt_oscillator(zeta=zeta, belt_speed=1.7 * float(truth), static=static, kinetic=kinetic,
                                        law="exponential", decay_speed=decay)
    said(bf.trace(bf.find_equilibrium(system), "belt_speed", (0.3 * float(truth), 2.0 * float(truth))), "hopf", truth)


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_folds_of_equilibria(unit):
    system = bf.System(1.0, 0.1, 1.0, [CubicSpring(-1.0 / unit**2), ConstantForce(0.1 * unit)])
    branch = bf.trace(bf.find_equilibrium(system), "force", (-0.3 * unit, 0.5 * unit))
    said(branch, "fold", 2 * mp.mpf(unit) / (3 * mp.sqrt(3)))


@pytest.mark.parametrize(("omega", "zeta"), [(1.0, 0.1), (0.6, 0.05), (1.2, 0.1), (2.0, 0.1)])
@pytest.mark.parametrize("side", [0.9, 1.1])
def test_stick_onset(omega, zeta, side):
    truth = SlipOnly(omega, zeta, 100.0).alpha_stick
    near = float(truth)
    orbit = bf.find_orbit(bf.systems.dry_friction_oscillator(omega=omega, zeta=zeta, amplitude=side * near))
    said(bf.trace(orbit, "amplitude", (0.8 * near, 1.2 * near)), "stick_onset", truth)


@pytest.mark.parametrize("method", [None, bf.HarmonicBalance(7)])
@pytest.mark.parametrize("limit", [1.0, 1e-6, 1e6])
def test_slip_onset(limit, method):
    """A Jenkins element slips where its spring, of stiffness 1 beside one of 1, is stretched by its limit."""
    b = 4 - mp.mpf(0.02)**2
    system = bf.System(1.0, 0.02, 1.0, [HarmonicForce(limit), Jenkins(1.0, limit)], omega=0.4)
    orbit = bf.find_orbit(system) if method is None else bf.find_orbit(system, method=method)
    said(bf.trace(orbit, "omega", (0.4, 1.2)), "slip_onset", mp.sqrt((b - mp.sqrt(b * b - 12)) / 2))


@pytest.mark.parametrize("gap", [-0.3, -3e-6, -3e5])
@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_separation_of_a_pressed_mass(gap, restitution):
    load = -gap
    system = bf.System(1, 0.1, 1, [HarmonicForce(0.7 * load), RigidStop(gap, restitution)], omega=0.8)
    branch = bf.trace(bf.find_orbit(system), "harmonic_force.amplitude", (0.5 * load, 1.02 * load), max_steps=600)
    kinds = {str(point.kind) for point in branch.special_points if abs(point.parameter - load) < 1e-6 * load}
    assert len(kinds) == 1
    said(branch, kinds.pop(), mp.mpf(load))


def test_a_spring_opens_in_a_balance():
    system = bf.System(1, 0.1, 1, [HarmonicForce(0.2), ConstantForce(0.5), bf.elements.ElasticStop(0.0, 3.0)], omega=0.8)
    dynamic = abs(4 - mp.mpf(0.8)**2 + mp.mpc(0, 0.1) * mp.mpf(0.8))
    branch = bf.trace(bf.find_orbit(system, method=bf.HarmonicBalance(5)), "harmonic_force.amplitude", (0.1, 0.6))
    said(branch, "grazing", dynamic * mp.mpf(0.5) / 4)


def test_chatter_completion():
    """Halved in 60 digits, see `tests/reference/completion`."""
    system = bf.systems.impact_oscillator(zeta=0.05, omega=0.7, amplitude=0.6, gap=0.0, restitution=0.42)
    said(bf.trace(bf.find_orbit(system), "restitution", (0.4, 0.5)), "chatter_completion", mp.mpf("0.46735067445959911495"))


def test_flips_of_a_map():
    """x -> 1 - a x^2 flips at a = 3/4."""
    made = bf.continuation.maps.SmoothMap(lambda x, a: 1.0 - a * x * x, 1, a=0.5).find(1, guess=0.7)
    said(bf.trace(made, "a", (0.3, 1.0)), "period_doubling", mp.mpf("0.75"))


def test_tori_of_a_map():
    """Delayed logistic map: x' = a x (1 - y), y' = x has its Neimark-Sacker point at a = 2."""
    def step(z, a):
        return np.array([a * z[0] * (1.0 - z[1]), z[0]])
    made = bf.continuation.maps.SmoothMap(step, 2, a=1.8).find(1, guess=(0.44, 0.44))
    said(bf.trace(made, "a", (1.5, 2.2)), "neimark_sacker", mp.mpf(2))


@pytest.mark.parametrize(("start", "bounds"), [(0.581, (0.5801, 0.5841)), (0.5835, (0.5815, 0.5841))])
def test_an_event_that_meets_the_end_of_a_chattering(start, bounds):
    """A slider comes to rest before the 5th, 6th, 7th, ... impact of a chattering: the values at which it passes them fall
    geometrically, and their limit is that of the end of all.  The impacts that are not listed end with the last that is."""
    K = np.array([[2.73, -1.73], [-1.73, 2.73]])
    system = bf.System(np.diag([1.0, 0.661]), 0.06 * K, K, [HarmonicForce(1.38), RigidStop(0.178, 0.174), Coulomb(0.123, dof=1)],
                       omega=start)
    branch = bf.trace(bf.find_orbit(system), "omega", bounds, ds=0.02)
    points = sorted(branch.special_points.of("stick_onset"), key=lambda point: point.parameter)
    *_, a, b, c, end = points
    first, second = b.parameter - a.parameter, c.parameter - b.parameter
    limit = c.parameter + second * second / (first - second)  # of Aitken
    assert max(point.error for point in (a, b, c)) < 1e-10
    assert abs(end.parameter - limit) <= end.error < 4.0 * abs(end.parameter - limit)
