"""Codimension-2 points on curves: closed forms and reference digits; the curves that leave them."""
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

import bifurc as bf
from bifurc.continuation.maps import SmoothMap
from bifurc.elements import HarmonicForce, RigidStop
from bifurc.system import System

ZETA, R = 0.05, 0.7


def free_force(omega):
    return math.hypot(1.0 - omega**2, 2.0 * ZETA * omega)


def resonance(n, k):
    """Frequency, load, and coefficients of fold and flip of resonant grazing: wc = 2 n wd / k."""
    wd = math.sqrt(1.0 - ZETA**2)
    w, t = 2.0 * n * wd / k, k * math.pi / wd
    q = (-1.0)**k * math.exp(-ZETA * t)
    fold = ((1.0 + R) * q * t / ((1.0 - q) * (1.0 + R * q)))**2 / 2.0
    flip = ((1.0 + R) * q * t / ((1.0 - q) * (1.0 - R * q)))**2 / 2.0 * (2.0 + ((1.0 + R * q) / (1.0 - R * q))**2)
    return w, free_force(w), fold, flip


@pytest.fixture(scope="module")
def grazings():
    system = bf.systems.impact_oscillator(zeta=ZETA, omega=1.9, amplitude=0.3, restitution=R)
    point = bf.trace(bf.find_orbit(system), "amplitude", bounds=(0.3, 6.0)).special_points.of("grazing")[0]
    return bf.trace_curve(point, ("amplitude", "omega"), bounds={"amplitude": (0.05, 6.0), "omega": (1.25, 2.1)})


@pytest.mark.parametrize(("n", "k"), [(1, 1), (2, 3), (3, 4), (4, 5), (5, 6)])
def test_resonant_grazing(grazings, n, k):
    w, force = resonance(n, k)[:2]
    points = [p for p in grazings.special_points.of("resonant_grazing") if p.name == f"s_{n}"]
    point = min(points, key=lambda p: abs(p.parameters["omega"] - w))
    assert point.parameters["omega"] == pytest.approx(w, abs=1e-10)
    assert point.parameters["amplitude"] == pytest.approx(force, abs=1e-10)


def test_numbers_of_resonant_grazing():
    assert resonance(1, 1) == pytest.approx((1.99749843554382, 2.99666481275434, 18.7945107585377, 2.45207225196651), rel=1e-13)
    assert resonance(2, 3) == pytest.approx((1.33166562369588, 0.784715093796149, 59.8546897684572, 19.8166898178109), rel=1e-9)


@pytest.fixture(scope="module")
def fast_grazings():
    system = bf.systems.impact_oscillator(zeta=ZETA, omega=3.9, amplitude=3.0, restitution=R)
    point = bf.trace(bf.find_orbit(system), "amplitude", bounds=(3.0, 16.0)).special_points.of("grazing")[0]
    return bf.trace_curve(point, ("amplitude", "omega"), bounds={"amplitude": (3.0, 18.0), "omega": (3.8, 4.2)})


@pytest.mark.parametrize(("n", "k", "curve"), [(1, 1, "grazings"), (2, 1, "fast_grazings")])
def test_fold_and_flip_curves_leave_a_resonant_grazing_quadratically(n, k, curve, request):
    w, force, fold, flip = resonance(n, k)
    points = [p for p in request.getfixturevalue(curve).special_points.of("resonant_grazing") if p.name == f"s_{n}"]
    point = min(points, key=lambda p: abs(p.parameters["omega"] - w))
    starts = {str(start.kind): start for start in bf.switch_branch(point)}
    assert set(starts) == {"fold", "period_doubling"}
    width = 4e-2 * math.sqrt(18.8 / fold)
    bounds = {"amplitude": (0.8 * force, 1.2 * force), "omega": (w - 2.5 * width, w + 2.5 * width)}
    for kind, want, side in (("fold", -fold, -1.0), ("period_doubling", flip, 1.0)):
        curve = bf.trace_curve(starts[kind], ("amplitude", "omega"), bounds=bounds, ds_max=0.1)
        omega, amplitude = curve.column("omega"), curve.column("amplitude")
        near = (side * (omega - w) > 0.0125 * width) & (side * (omega - w) < width)
        assert near.sum() >= 6
        d = omega[near] - w
        ratio = (amplitude[near] / [free_force(value) for value in omega[near]] - 1.0) / d**2
        fitted = np.polynomial.polynomial.polyfit(d / width, ratio, min(6, near.sum() - 1))
        assert fitted[0] == pytest.approx(want, rel=1e-6), kind


def test_formal_orbits_leave_no_curve_and_it_is_said(grazings):
    """At n = 2, k = 3 the mass comes back through the stop after one period: s_1 < 0."""
    w = resonance(2, 3)[0]
    point = min((p for p in grazings.special_points.of("resonant_grazing") if p.name == "s_2"),
                key=lambda p: abs(p.parameters["omega"] - w))
    starts = bf.switch_branch(point)
    assert not starts and "through the stop" in starts.status


def magnet(u, s, strength):
    """A magnet behind the stop, another one as far behind the mass."""
    return strength / (1.8 - u)**2 - strength / (1.8 + u)**2


@bf.systems.builder
def beside_a_magnet(*, omega=1.9, amplitude=0.3):
    """Return an oscillator with a rigid stop, beside a user's law and a cubic spring."""
    law = bf.elements.Force(magnet, odd=True, label="magnet", strength=0.2)
    return System(1.0, 0.1, 1.0, [bf.elements.CubicSpring(0.3), law, HarmonicForce(amplitude), RigidStop(1.0, R)], omega=omega)


@pytest.mark.slow
def test_resonant_grazing_beside_laws_against_integrated_variations():
    """Where s_k = 0, E^k of the orbit that touches leads from no speed to any height: by DOP853 with variations."""
    (point, *_) = bf.trace(bf.find_orbit(beside_a_magnet()), "amplitude", bounds=(0.3, 6.0)).special_points.of("grazing")
    curve = bf.trace_curve(point, ("amplitude", "omega"), bounds={"amplitude": (0.05, 6.0), "omega": (1.25, 2.7)})

    def motion(t, z, amplitude, omega):
        x, v = z[:2]
        force = 0.2 / (1.8 - x)**2 - 0.2 / (1.8 + x)**2 - 0.3 * x**3 - x - 0.1 * v
        stiffness = 0.4 / (1.8 - x)**3 + 0.4 / (1.8 + x)**3 - 0.9 * x * x - 1.0
        rates = [v, force + amplitude * math.cos(omega * t)]
        for k in (2, 4):
            rates += [z[k + 1], stiffness * z[k] - 0.1 * z[k + 1]]
        return rates

    for k in (1, 2):
        known = next(p for p in curve.special_points.of("resonant_grazing") if p.name == f"s_{k}" and p.parameters["omega"] > 1.5)

        def equations(unknown, k=k, rtol=1e-12):
            start, amplitude, omega = unknown
            span = (start, start + 2.0 * math.pi / omega)
            z = solve_ivp(motion, span, [1.0, 0.0, 1.0, 0.0, 0.0, 1.0], "DOP853", rtol=rtol, atol=0.1 * rtol,
                          args=(amplitude, omega)).y[:, -1]
            return z[0] - 1.0, z[1], np.linalg.matrix_power(z[2:].reshape(2, 2).T, k)[0, 1]
        amplitude, omega = known.parameters["amplitude"], known.parameters["omega"]
        starts = np.linspace(0.0, 2.0 * math.pi / omega, 40)
        start = min(starts, key=lambda t: np.abs(equations((t, amplitude, omega), rtol=1e-5)[:2]).sum())
        exact = fsolve(equations, (start, amplitude, omega), xtol=1e-13)
        assert exact[1:] == pytest.approx([amplitude, omega], abs=2e-9)


def test_flip_orbit_that_touches_inside_its_period_ends_the_curve():
    free = bf.find_orbit(bf.systems.impact_oscillator(zeta=ZETA, omega=2.5, amplitude=0.3, restitution=R))
    point = bf.trace(free, "amplitude", bounds=(0.3, 6.0)).special_points.of("grazing")[0]
    branch = bf.trace(bf.switch_branch(point, n_max=2)[-1], "amplitude", bounds=(0.3, 6.0))
    (flip,) = [p for p in branch.special_points.of("period_doubling") if not p.name]
    curve = bf.trace_curve(flip, ("amplitude", "omega"), bounds={"amplitude": (0.3, 6.0), "omega": (2.0, 2.6)})
    (end,) = curve.special_points.of("grazing")
    assert end.parameters["omega"] == pytest.approx(2.15405401940522, abs=1e-11)
    assert end.parameters["amplitude"] == pytest.approx(2.12794290618093, abs=1e-11)
    assert "codimension two" in " ".join(item.message for item in curve.ends)
    assert end.solution.events[0].speed == pytest.approx(0.515311586304512, abs=1e-10)
    (start,) = bf.switch_branch(end)  # the grazing of the orbit whose flip was followed
    assert start.kind == "grazing"
    grazes = bf.trace_curve(start, ("amplitude", "omega"), bounds={"amplitude": (0.3, 6.0), "omega": (2.1, 2.2)}, max_steps=6)
    assert len(grazes) > 4


def test_cusp_of_the_duffing_oscillator():
    orbit = bf.find_orbit(bf.systems.duffing_oscillator(zeta=0.05, omega=0.9, amplitude=0.1, beta=1.0))
    fold = bf.trace(orbit, "omega", bounds=(0.8, 1.6)).special_points.of("fold")[0]
    curve = bf.trace_curve(fold, ("omega", "amplitude"), bounds={"omega": (0.9, 1.6), "amplitude": (0.02, 0.12)})
    (cusp,) = curve.special_points.of("cusp")
    assert cusp.parameters["omega"] == pytest.approx(1.09010950261775654689911, abs=1e-11)
    assert cusp.parameters["amplitude"] == pytest.approx(0.0513635020789035622417387, abs=1e-12)
    assert abs(cusp.solution.harmonic(1)) == pytest.approx(0.408207450507482253, abs=1e-9)


def test_cusp_of_the_duffing_oscillator_in_one_harmonic():
    """w = sqrt 3 zeta + sqrt(1 + 3 zeta^2), q = w^2 - 1, F^2 = 32 q^3 / 81, A^2 = 8 q / 9."""
    system = bf.systems.duffing_oscillator(zeta=0.05, omega=0.9, amplitude=0.1, beta=1.0)
    orbit = bf.find_orbit(system, method=bf.HarmonicBalance((1,)))
    fold = bf.trace(orbit, "omega", bounds=(0.8, 1.6)).special_points.of("fold")[0]
    curve = bf.trace_curve(fold, ("omega", "amplitude"), bounds={"omega": (0.9, 1.6), "amplitude": (0.02, 0.12)})
    (cusp,) = curve.special_points.of("cusp")
    w = math.sqrt(3.0) * 0.05 + math.sqrt(1.0 + 3.0 * 0.05**2)
    q = w * w - 1.0
    assert cusp.parameters["omega"] == pytest.approx(w, abs=1e-12)
    assert cusp.parameters["amplitude"] == pytest.approx(math.sqrt(32.0 * q**3 / 81.0), abs=1e-12)
    assert abs(cusp.solution.harmonic(1)) == pytest.approx(math.sqrt(8.0 * q / 9.0), abs=1e-9)


def two_loads(a1, a2, fraction=1.0):
    """Oscillator (w 1.5) whose free response is a1 cos th + a2 cos 2 th, times ``fraction``, with the stop at 1."""
    w = 1.5
    G = [1.0 - (k * w)**2 + 2j * ZETA * k * w for k in (1, 2)]
    sign = 1.0 if a2 > 0.0 else -1.0
    loads = (HarmonicForce(fraction * a1 * abs(G[0])),
             HarmonicForce(fraction * abs(a2) * abs(G[1]), harmonic=2, phase=np.angle(sign * G[1]) - 2.0 * np.angle(G[0])))
    return System(1.0, 2.0 * ZETA, 1.0, (*loads, RigidStop(1.0, R)), omega=w), a1 * abs(G[0]), abs(a2) * abs(G[1])


def test_fourth_order_graze_ends_a_grazing_curve():
    system, f1, f2 = two_loads(4.0 / 3.0, -1.0 / 3.0, 0.5)
    assert (f1, f2) == pytest.approx((1.67862377493522, 2.66854100795006), rel=1e-14)
    names = ("harmonic_force.amplitude", "harmonic_force_2.amplitude")
    point = bf.trace(bf.find_orbit(system), names[0], bounds=(0.1, 6.0)).special_points.of("grazing")[0]
    curve = bf.trace_curve(point, names, bounds={names[0]: (0.1, 6.0), names[1]: (0.5, 4.0)})
    (flat,) = curve.special_points.of("degenerate_grazing")
    assert flat.parameters[names[0]] == pytest.approx(f1, abs=1e-10) and flat.parameters[names[1]] == pytest.approx(f2, abs=1e-10)
    assert any("degenerate_grazing" in end.message for end in curve.ends)


def test_two_equal_tops_are_a_double_grazing():
    level = 0.75  # -a1^2 / (8 a2) - a2 for a1 = 1, a2 = -1/2
    system, f1, _ = two_loads(1.0 / level, -0.5 / level)
    names = ("harmonic_force.amplitude", "harmonic_force_2.phase")
    phase = system.parameter(names[1])
    start = bf.find_orbit(system.with_parameters(**{names[0]: 0.4 * f1, names[1]: phase + 0.3, "harmonic_force_2.amplitude": 0.5}))
    branch = bf.trace(start, "harmonic_force_2.amplitude", bounds=(0.5, system.parameter("harmonic_force_2.amplitude")))
    orbit = branch.orbits[int(np.argmax(branch.column("harmonic_force_2.amplitude")))]
    point = bf.trace(orbit, names[0], bounds=(0.1, 3.0)).special_points.of("grazing")[0]
    curve = bf.trace_curve(point, names, bounds={names[0]: (0.1, 6.0), names[1]: (phase - 0.5, phase + 0.5)})
    (double,) = curve.special_points.of("double_grazing")
    assert double.parameters[names[0]] == pytest.approx(f1, abs=1e-9)
    assert double.parameters[names[1]] == pytest.approx(phase, abs=1e-9)
    (other,) = bf.switch_branch(double)  # the other top touches first behind it
    assert other.kind == "grazing" and (other.parameters[names[0]] != double.parameters[names[0]])
    crossing = bf.trace_curve(other, names, bounds={names[0]: (0.1, 6.0), names[1]: (phase - 0.5, phase + 0.5)})
    (again,) = crossing.special_points.of("double_grazing")
    assert tuple(again.parameters.values()) == pytest.approx(tuple(double.parameters.values()), abs=1e-9)


@pytest.mark.slow
def test_double_grazing_beside_a_law_against_integration():
    """Two tops of an oscillator with a cubic spring at the stop at once: by DOP853 from top to top."""
    w, second = 1.5, 0.5 / 0.75 * abs(1.0 - 9.0 + 0.3j)

    def motion(t, z, load, phase):
        x, v = z
        return [v, load * math.cos(w * t) + second * math.cos(2.0 * w * t + phase) - x - 0.1 * v - 0.1 * x**3]

    def equations(unknown):
        first, later, *loads = unknown
        top = solve_ivp(motion, (first, later), [1.0, 0.0], "DOP853", rtol=1e-12, atol=1e-13, args=loads).y[:, -1]
        end = solve_ivp(motion, (later, first + 2.0 * math.pi / w), top, "DOP853", rtol=1e-12, atol=1e-13, args=loads).y[:, -1]
        return [*(top - (1.0, 0.0)), *(end - (1.0, 0.0))]
    exact = fsolve(equations, (1.25, 2.75, 1.3, -6.05), xtol=1e-13)
    assert np.abs(equations(exact)).max() < 1e-12
    load, phase = exact[2:]
    loads = (HarmonicForce(0.4 * load), HarmonicForce(0.5, harmonic=2, phase=phase + 0.3))
    system = System(1.0, 0.1, 1.0, (bf.elements.CubicSpring(0.1), *loads, RigidStop(1.0, R)), omega=w)
    names = ("harmonic_force.amplitude", "harmonic_force_2.phase")
    branch = bf.trace(bf.find_orbit(system), "harmonic_force_2.amplitude", bounds=(0.5, second))
    orbit = branch.orbits[int(np.argmax(branch.column("harmonic_force_2.amplitude")))]
    point = bf.trace(orbit, names[0], bounds=(0.1, 3.0)).special_points.of("grazing")[0]
    bounds = {names[0]: (0.1, 6.0), names[1]: (phase - 0.5, phase + 0.5)}
    (double,) = bf.trace_curve(point, names, bounds=bounds).special_points.of("double_grazing")
    (other,) = bf.switch_branch(double)
    (again,) = bf.trace_curve(other, names, bounds=bounds).special_points.of("double_grazing")
    for found in (double, again):
        assert tuple(found.parameters.values()) == pytest.approx((load, phase), abs=1e-11)


def test_a_fold_curve_of_a_doubled_motion_takes_long_steps():
    """Two impacts in two periods: a row is divided by a duration (second derivatives once were wrong: 2500 rows of .001)."""
    free = bf.find_orbit(bf.systems.impact_oscillator(zeta=ZETA, omega=2.4, amplitude=0.3, restitution=0.5))
    point = bf.trace(free, "amplitude", bounds=(0.3, 12.0)).special_points.of("grazing")[0]
    (start,) = [orbit for orbit in bf.switch_branch(point, n_max=2) if orbit.periods == 2]
    branch = bf.trace(start, "amplitude", bounds=(0.3, 12.0))
    names, bounds = ("amplitude", "omega"), {"amplitude": (0.3, 12.0), "omega": (1.6, 2.9)}
    folds = bf.trace_curve(branch.special_points.of("fold")[0], names, bounds=bounds)
    assert len(folds) < 60 and folds.special_points.of("grazing")


@pytest.mark.slow
@pytest.mark.parametrize("amplitude", [8.0, 9.0, 12.0])
def test_what_rounding_makes_of_the_end_of_a_curve_is_stated(amplitude):
    """Flips of a motion whose two impacts lose their speed together end in a resonant touch, which tiny speeds tell badly."""
    free = bf.find_orbit(bf.systems.impact_oscillator(zeta=ZETA, omega=2.4, amplitude=0.3, restitution=0.5))
    point = bf.trace(free, "amplitude", bounds=(0.3, 12.0)).special_points.of("grazing")[0]
    (start,) = [orbit for orbit in bf.switch_branch(point, n_max=2) if orbit.periods == 2]
    names, bounds = ("amplitude", "omega"), {"amplitude": (0.3, amplitude), "omega": (1.9, 2.9)}
    flips = [p for p in bf.trace(start, "amplitude", bounds=bounds["amplitude"]).special_points.of("period_doubling") if not p.name]
    w, seen = resonance(1, 1)[0], 0
    for flip in flips:
        for end in bf.trace_curve(flip, names, bounds=bounds).special_points:
            if abs(end.parameters["omega"] - w) < 1e-3:
                seen += 1
                assert abs(end.parameters["omega"] - w) <= end.error and end.error < 1e-6
            elif end.kind == "grazing":
                assert end.error < 1e-12
    assert seen


def quadratic(x, al, be, R):
    """x' = y, y' = al - be x - y^2 + R x y."""
    return np.stack([x[..., 1], al - be * x[..., 0] - x[..., 1]**2 + R * x[..., 0] * x[..., 1]], axis=-1)


def test_strong_resonances_of_a_map():
    theta = math.acos(0.3)
    y = 2.0 * math.cos(theta) / (-0.1 - 2.0)
    be = 1.0 - 0.1 * y
    system = SmoothMap(quadratic, 2, al=(1.0 + be) * y + 1.1 * y * y, be=be - 0.02, R=-0.1)
    (torus,) = bf.trace(system.find(1, guess=(y, y)), "be", bounds=(0.5, 1.5)).special_points.of("neimark_sacker")
    assert torus.parameter == pytest.approx(be, abs=1e-12)
    curve = bf.trace_curve(torus, ("be", "al"), bounds={"be": (0.5, 1.5), "al": (-1.0, 4.0)})
    for kind, cosine in (("resonance_1_1", 1.0), ("resonance_1_2", -1.0), ("resonance_1_3", -0.5), ("resonance_1_4", 0.0)):
        (point,) = curve.special_points.of(kind)
        y = 2.0 * cosine / -2.1
        be = 1.0 - 0.1 * y
        assert point.parameters["be"] == pytest.approx(be, abs=1e-11)
        assert point.parameters["al"] == pytest.approx((1.0 + be) * y + 1.1 * y * y, abs=1e-11)
    (two,) = curve.special_points.of("resonance_1_2")
    assert tuple(two.parameters.values()) == pytest.approx((0.904761904761905, 2.81179138321995), abs=1e-11)
    assert [str(start.kind) for start in bf.switch_branch(two)] == ["period_doubling"]
    assert all("becomes real" in end.message for end in curve.ends)  # no torus behind 1:1 and 1:2


@pytest.mark.slow
@pytest.mark.parametrize("times, kind", [(3, "resonance_1_3"), (4, "resonance_1_4")])
def test_folds_of_orbits_of_three_and_four_periods_beside_a_strong_resonance(times, kind):
    """Against Newton's method on the map written out; the curve of folds of four periods begins in the resonance."""
    theta = math.acos(0.3)
    y = 2.0 * math.cos(theta) / (-0.1 - 2.0)
    be = 1.0 - 0.1 * y
    system = SmoothMap(quadratic, 2, al=(1.0 + be) * y + 1.1 * y * y, be=be - 0.02, R=-0.1)
    (torus,) = bf.trace(system.find(1, guess=(y, y)), "be", bounds=(0.5, 1.5)).special_points.of("neimark_sacker")
    curve = bf.trace_curve(torus, ("be", "al"), bounds={"be": (0.5, 1.5), "al": (-1.0, 4.0)})
    (point,) = curve.special_points.of(kind)
    starts = bf.switch_branch(point)
    fold = next(start for start in starts if start.kind == "fold")
    assert fold.solution.period == times and f"orbits of {times} periods" in starts.status
    name, value = fold.problem.parameter, fold.parameter
    known = fold.solution.map.parameters

    def equations(z):
        x, slope = z[:2], np.eye(2)
        al, be, R = {**known, name: z[2]}.values()
        for _ in range(times):
            slope = np.array([[0.0, 1.0], [-be + R * x[1], -2.0 * x[1] + R * x[0]]]) @ slope
            x = quadratic(x, al, be, R)
        return [*(x - z[:2]), np.linalg.det(slope - np.eye(2))]
    exact = fsolve(equations, [*fold.solution.points[0], value], xtol=1e-14)
    assert exact[2] == pytest.approx(value, abs=1e-10)
    if times == 4:
        folds = bf.trace_curve(fold, ("be", "al"), bounds={"be": (0.9, 1.05), "al": (-0.05, 0.05)}, max_steps=60)
        nearest = np.hypot(folds.column("be") - 1.0, folds.column("al")).min()
        assert nearest < 1e-6


def test_fold_flip_of_a_map_on_both_curves():
    branch = bf.trace(SmoothMap(quadratic, 2, al=0.3, be=-0.8, R=-0.1).find(1, guess=(-0.5, -0.5)), "al", bounds=(-0.5, 1.5))
    for kind, other in (("fold", "period_doubling"), ("period_doubling", "fold")):
        (point,) = branch.special_points.of(kind)
        curve = bf.trace_curve(point, ("al", "be"), bounds={"al": (-2.0, 2.0), "be": (-1.5, 0.5)})
        (both,) = curve.special_points.of("fold_flip")
        assert tuple(both.parameters.values()) == pytest.approx((0.0, -1.0), abs=1e-10)
        (start,) = bf.switch_branch(both)
        assert start.kind == other
        crossing = bf.trace_curve(start, ("al", "be"), bounds={"al": (-2.0, 2.0), "be": (-1.5, 0.5)})
        assert len(crossing) > 5 and crossing.kind == other


def test_generalised_flip_and_the_fold_that_leaves_it():
    def cubic(x, m, p, q):
        return -(1.0 + m) * x + p * x**2 + q * x**3
    system = SmoothMap(cubic, 1, m=-0.1, p=0.5, q=-0.3)
    (flip,) = bf.trace(system.find(1, guess=(0.0,)), "m", bounds=(-0.5, 0.5)).special_points.of("period_doubling")
    curve = bf.trace_curve(flip, ("m", "q"), bounds={"m": (-0.5, 0.5), "q": (-1.0, 1.0)})
    (point,) = curve.special_points.of("generalized_flip")
    assert point.parameters["q"] == pytest.approx(-0.25, abs=1e-9) and point.parameters["m"] == pytest.approx(0.0, abs=1e-12)
    (start,) = bf.switch_branch(point)
    assert start.kind == "fold"
    folds = bf.trace_curve(start, ("m", "q"), bounds={"m": (-0.5, 0.5), "q": (-1.0, -0.2)})
    assert folds.column("q").min() == pytest.approx(-0.25, abs=1e-4)
    system = system.with_parameters(q=-0.23)
    (flip,) = bf.trace(system.find(1, guess=(0.0,)), "m", bounds=(-0.5, 0.5)).special_points.of("period_doubling")
    doubled = bf.trace(bf.switch_branch(flip)[0], "m", bounds=(-0.05, 0.05), ds=1e-3)
    assert doubled.special_points.of("fold")[0].parameter == pytest.approx(0.000896770839102661, abs=1e-13)
