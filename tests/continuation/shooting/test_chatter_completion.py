"""Where a complete chattering just completes: a special point with its error, and a curve, against bounces in 60 digits."""
import numpy as np
import pytest
from mpmath import mpf

import bifurc as bf
from bifurc.continuation.shooting.completion import begun_at, growth, ratio, rebound, train
from bifurc.continuation.shooting.problem import OrbitProblem, orbit_problem
from bifurc.continuation.shooting.train_length import longer, shorter
from bifurc.elements import Coulomb, HarmonicForce, RigidStop
from bifurc.orbits.shooting.path import parameter_path
from bifurc.orbits.shooting.sequence import CLOSES
from tests.reference.completion import completes, cycle, rests, rests_beside_friction


@pytest.fixture(scope="module")
def branch():
    """Return a branch over the restitution that ends where its chattering no longer completes."""
    system = bf.systems.impact_oscillator(zeta=0.05, omega=0.7, amplitude=0.6, gap=0.0, restitution=0.42)
    return bf.trace(bf.find_orbit(system), "restitution", bounds=(0.4, 0.5))


@pytest.mark.parametrize("restitution", [0.1, 0.5, 0.9])
def test_ratio_is_the_fixed_point_of_two_flights_under_a_falling_load(restitution):
    """x'' = c tau: one flight from the fixed point ends on it; a neighbour is left ``growth`` times as far away."""
    r, rho = restitution, ratio(restitution)

    def bounce(w):  # from impact to impact: time left 1, speed before the impact w, both scaled by what is left behind
        s = min(root.real for root in np.roots([1.0 / 6.0, -0.5, r * w]) if abs(root.imag) < 1e-12 and root.real > 0.0)
        return 1.0 - s, (s - 0.5 * s * s - r * w) / (1.0 - s)**2

    s = 1.0 - rho
    w = (s / 2.0 - s * s / 6.0) / r
    assert bounce(w) == pytest.approx((rho, w), rel=1e-12)
    slope = (bounce(w + 1e-6)[1] - bounce(w - 1e-6)[1]) / 2e-6
    assert slope == pytest.approx(growth(r), rel=1e-8) and slope > 1.0


def test_a_branch_ends_in_the_completion_of_its_chattering(branch):
    (point,) = branch.special_points
    assert point.kind == "chatter_completion" and branch.stop_reason[1] == "chattering"
    assert point.error < 1e-13
    assert point.parameter == pytest.approx(0.46735067445959911495, abs=1e-14)  # halved in 60 digits with `completes`
    assert completes("0.05", "0.7", "0.6", point.parameter - 1e-13)
    assert not completes("0.05", "0.7", "0.6", point.parameter + 1e-13)
    assert point.solution.success and branch.audit.ok
    (release,) = [event.time * 0.7 for event in point.solution.events if event.kind == "release"]
    assert np.cos(release) == pytest.approx(0.0, abs=1e-12)  # the load changes its sign there


def test_motions_that_never_come_to_rest_end_in_the_same_point(branch, tmp_path):
    """Beyond, impacts are added one by one, with a grazing and a fold each; the limit of them all is the completion."""
    system = bf.systems.impact_oscillator(zeta=0.05, omega=0.7, amplitude=0.6, gap=0.0, restitution=0.48)
    other = bf.trace(bf.find_orbit(system), "restitution", bounds=(0.46, 0.481))
    (point,) = other.special_points.of("chatter_completion")
    assert point.parameter == pytest.approx(branch.special_points[0].parameter, abs=1e-14)
    assert point.solution.success and "release" in point.solution.signature
    assert other.audit.ok
    other.save(tmp_path / "other.npz")
    (loaded,) = bf.Branch.load(tmp_path / "other.npz").special_points.of("chatter_completion")
    assert (loaded.parameter, loaded.error) == (point.parameter, point.error) and np.array_equal(loaded.x, point.x)
    assert len(other.extend(bounds=(0.46, 0.485))) > len(other)
    curve = bf.trace_curve(loaded, ("restitution", "omega"), bounds={"omega": (0.69, 0.71), "restitution": (0.3, 0.6)}, max_steps=1)
    assert curve.stop_reason == ("max_steps", "max_steps")


@pytest.mark.slow
def test_completions_are_followed_in_two_parameters(branch):
    """Each point of the curve lies between a motion that completes and one that does not."""
    (point,) = branch.special_points
    curve = bf.trace_curve(point, ("restitution", "omega"), bounds={"omega": (0.62, 0.76), "restitution": (0.3, 0.6)})
    assert curve.stop_reason == ("bound", "bound")
    rows = list(zip(curve.column("omega"), curve.column("restitution"), strict=True))
    for omega, restitution in (rows[0], rows[len(rows) // 2], rows[-1]):
        assert completes("0.05", omega, "0.6", restitution - 1e-11)
        assert not completes("0.05", omega, "0.6", restitution + 1e-11)


@pytest.mark.slow
def test_completion_in_a_chain_of_two_masses_against_simulation():
    """The stop holds one mass while the other moves on: simulated motions come to rest before it, and never behind it."""
    stiffness = np.array([[2.0, -1.0], [-1.0, 1.0]])

    def chain(restitution):
        elements = [bf.elements.HarmonicForce(1.2, dof=1), bf.elements.RigidStop(0.3, restitution, dof=0)]
        return bf.System(np.eye(2), 0.2 * stiffness, stiffness, elements, omega=0.4)

    branch = bf.trace(bf.find_orbit(chain(0.6)), "rigid_stop.restitution", bounds=(0.55, 0.9))
    (point,) = branch.special_points.of("chatter_completion")
    assert point.error < 1e-13 and point.solution.success
    for aside in (-1e-8, 1e-8):
        motion = bf.simulate(chain(point.parameter + aside), point.solution.state, periods=40)
        rests = sum(event.kind == "chatter" and event.time > 38 * 2.0 * np.pi / 0.4 for event in motion.events)
        assert rests == (2 if aside < 0.0 else 0)


def between_stops(**changes):
    """Return a mass that chatters on each of two stops in turn."""
    parameters = {"zeta": 0.05, "omega": 0.8, "amplitude": 1.5, "gap": 0.3, "restitution": 0.5}
    return bf.systems.two_sided_impact_oscillator(**{**parameters, **changes})


@pytest.mark.parametrize("parameter, bounds", [("omega", (0.8, 1.0)), ("amplitude", (0.3, 1.5))])
def test_orbits_solved_on_half_their_period_end_in_the_completion(parameter, bounds):
    orbit = bf.find_orbit(between_stops() if parameter == "omega" else between_stops(omega=0.3))
    assert orbit.closure == -1
    (point,) = bf.trace(orbit, parameter, bounds=bounds).special_points.of("chatter_completion")
    assert point.error < 1e-13 and point.solution.success

    def at(value):
        p = {**point.solution.system.parameters, parameter: value}
        return completes(p["zeta"], p["omega"], p["amplitude"], p["restitution"], gap=p["gap"])
    inside = -1e-12 if parameter == "omega" else 1e-12
    assert at(point.parameter + inside) and not at(point.parameter - inside)


@pytest.mark.slow
def test_completions_of_the_half_period_are_followed():
    (point,) = bf.trace(bf.find_orbit(between_stops()), "omega", bounds=(0.8, 1.0)).special_points.of("chatter_completion")
    curve = bf.trace_curve(point, ("omega", "restitution"), bounds={"omega": (0.5, 1.2), "restitution": (0.37, 0.55)})
    assert curve.stop_reason == ("bound", "bound")
    rows = list(zip(curve.column("omega"), curve.column("restitution"), strict=True))
    for omega, restitution in (rows[0], rows[len(rows) // 3], rows[-1]):
        assert completes("0.05", omega - 1e-11, "1.5", restitution, gap="0.3")
        assert not completes("0.05", omega + 1e-11, "1.5", restitution, gap="0.3")


@bf.systems.builder
def driven_by_damping(*, restitution=0.3, damping=0.03, gap=-0.1):
    """Return two masses, one on a stop, the other one with negative damping: nothing depends on time."""
    stiffness = np.array([[2.0, -1.0], [-1.0, 1.0]])
    return bf.System(np.eye(2), np.diag([0.2, -damping]), stiffness, [bf.elements.RigidStop(gap, restitution, dof=0)])


def settled(speed, restitution, damping):
    """Return the speed of the second mass at the releases of the motion that repeats itself, by secants, in mpmath."""
    a = mpf(speed)
    fa = cycle(a, restitution, damping)[1] - a
    b = a + fa
    fb = cycle(b, restitution, damping)[1] - b
    while abs(fb) > mpf("1e-14"):
        a, fa, b = b, fb, b - fb * (b - a) / (fb - fa)
        fb = cycle(b, restitution, damping)[1] - b
    return b


@pytest.mark.slow
def test_a_motion_without_a_clock_ends_in_its_completion():
    """The number of listed impacts grows on the way; motions in 30 digits lead to the point, and one is led on to either side."""
    excited = bf.trace(bf.find_orbit(driven_by_damping()), "damping", bounds=(0.02, 0.2), direction=1).orbits[-1]
    branch = bf.trace(excited, "restitution", bounds=(0.2, 0.9))
    assert branch.stop_reason[1] == "chattering"
    (point,) = branch.special_points.of("chatter_completion")
    assert point.error < 1e-13 and point.solution.success and point.solution.autonomous
    (release,) = [event for event in point.solution.events if event.kind == "release"]
    speed = float(point.solution._states(np.array([release.time / point.solution.period]))[0][3])
    at, step = mpf(point.parameter), mpf("1e-7")
    damping = excited.system.parameters["damping"]
    one, two = settled(speed, at - 2 * step, damping), settled(speed, at - step, damping)
    assert float(2 * two - one) == pytest.approx(speed, abs=1e-12)
    for d in (mpf("1e-9"), mpf("1e-10")):
        slope = (two - one) / step
        assert cycle(two + slope * (step - d), at - d, damping)[0]
        assert not cycle(two + slope * (step + d), at + d, damping)[0]
    curve = bf.trace_curve(point, ("restitution", "damping"), bounds={"damping": (0.1, 0.22), "restitution": (0.3, 0.9)})
    assert curve.stop_reason == ("bound", "bound")
    row = curve.orbits[len(curve) // 2]
    damping, at = row.system.parameters["damping"], mpf(row.system.parameters["restitution"])
    (release,) = [event for event in row.events if event.kind == "release"]
    speed = float(row._states(np.array([release.time / row.period]))[0][3])
    one, two = settled(speed, at - 2 * step, damping), settled(speed, at - step, damping)
    d, slope = mpf("1e-9"), (two - one) / step
    assert cycle(two + slope * (step - d), at - d, damping)[0]
    assert not cycle(two + slope * (step + d), at + d, damping)[0]


@pytest.fixture(scope="module")
def released():
    """Return the branch of a mass pressed to a stop with restitution .9, which is let go beyond an amplitude of .453."""
    system = bf.System(1.0, 0.0342, 1.0, [bf.elements.HarmonicForce(0.405), bf.elements.RigidStop(-0.453, 0.9)], omega=1.24)
    return bf.trace(bf.find_orbit(system), "harmonic_force.amplitude", bounds=(0.4, 0.47), max_steps=400)


def test_lists_of_many_impacts_grow_by_as_many_as_the_closing_allows(released):
    """A hundred impacts more are listed in fewer than thirty changes; nothing but the release is a special point of the motion, and
    determinants that grow by e^30 a step are no doubt."""
    assert released.stop_reason == ("bound", "bound") and released.audit.ok, released.audit
    assert [point.parameter for point in released.special_points] == pytest.approx([0.453], abs=1e-12)
    numbers = [len(problem.sequence.nodes) for problem in released.problems]
    assert max(numbers) > 100 and len(numbers) < 30
    assert all(one <= other for one, other in zip(numbers[1:], numbers[2:], strict=False))


def test_lists_lengthened_and_shortened_by_several_are_the_same_motion(released):
    """The closing in closed form stands for what is no longer listed: states differ by its error, of third order in speeds."""
    k = len(released) - 3
    problem, x = released.problems[int(released._arrays["part"][k])], released.x(k)
    i = int(np.flatnonzero(problem.sequence.nodes[:, CLOSES] == 1)[0])
    at, x = begun_at(problem, x, i + 1)
    states = [at.solution(x).state]
    for change in (longer, shorter):
        new, guess = change(at, x, 3)
        assert len(new.sequence.nodes) == len(at.sequence.nodes) + (3 if change is longer else -3)
        c = new.correct(guess, np.eye(1, guess.size, guess.size - 1)[0], True)
        assert c.converged and c.iterations <= 3
        states.append(new.solution(c.x).state)
    np.testing.assert_allclose(states[1:], [states[0]] * 2, rtol=0, atol=1e-10)
    assert shorter(at, x, len(at.sequence.nodes)) is None


def between_masses(coupling, mass, omega, amplitude, stops):
    """Return two masses with rigid stops between them, on both sides."""
    K = [[1.0 + coupling, -coupling], [-coupling, 1.0 + coupling]]
    return bf.System(np.diag([1.0, mass]), [[0.1, -0.03], [-0.03, 0.08]], K, [
        HarmonicForce(amplitude), RigidStop(*stops[0], row=(1.0, -1.0)), RigidStop(*stops[1], row=(-1.0, 1.0))], omega=omega)


@pytest.mark.parametrize(("numbers", "side", "bounds"), [
    ((0.871, 1.22, 0.947, 0.572, ((0.574, 0.289), (0.245, 0.323))), -1.0, (0.3, 0.573)),
    ((0.498, 0.92, 0.584, 0.53, ((0.122, 0.54), (0.311, 0.648))), 1.0, (0.53, 0.578)),
])
def test_a_completion_of_many_impacts(numbers, side, bounds):
    """The last flights are known to seven digits: Newton's method ends there, on branches and at the completion."""
    system = between_masses(*numbers)
    name = "rigid_stop.restitution" if side > 0.0 else "rigid_stop_2.restitution"
    branch = bf.trace(bf.find_orbit(system), name, bounds=bounds)
    assert branch.stop_reason == ("bound", "chattering") and branch.audit.ok
    (point,) = branch.special_points.of("chatter_completion")
    assert point.error < 1e-9
    for aside, complete in ((-2e-9, True), (2e-9, False)):
        orbit = bf.find_orbit(system.with_parameters(**{name: point.parameter + aside}))
        first = int(np.argmax(orbit.sequence.nodes[:, CLOSES] == 2))
        time, *state = orbit.unknowns.reshape(-1, 5)[first]
        gap = numbers[-1][0 if side > 0.0 else 1][0]
        assert rests(system.mass, system.damping, system.stiffness, (numbers[3], 0.0), system.omega, (side, -side), gap,
                     point.parameter + aside, time * system.period, state) is complete


@pytest.mark.parametrize(("numbers", "starts"), [
    ((0.579, 0.365, 0.629, 0.939, ((0.371, 0.167), (0.294, 0.276))), (2e-3, 8e-3)),
    ((1.22, 0.428, 0.791, 1.22, ((0.175, 0.218), (0.371, 0.311))), (5e-4, 4e-3)),
])
def test_towards_restitution_zero_no_flight_of_a_chattering_falls_together_with_its_start(numbers, starts):
    """An impact at the very instant of the one before is a solution too, and crosses the branch at zero."""
    name = "rigid_stop.restitution"
    system = between_masses(*numbers)
    branch = bf.trace(bf.find_orbit(system), name, bounds=(0.0, 0.25))
    for start in starts:
        again = bf.trace(branch.orbits[int(np.argmin(abs(branch.column(name) - start)))], name, bounds=(0.0, 0.25))
        for one in (branch, again):
            assert one.special_points == () and one.stop_reason == ("bound", "bound") and one.audit.ok


def coupled(friction, omega, restitution=0.5):
    """Return two masses coupled by inertia: the first hits a stop, and lets the second slip, which friction holds."""
    return bf.System([[1.0, 0.25], [0.25, 1.44]], [[0.11, -0.019], [-0.019, 0.11]], [[1.38, -0.38], [-0.38, 1.38]],
                     [HarmonicForce(2.1), RigidStop(0.12, restitution), Coulomb(friction, dof=1)], omega=omega)


@pytest.mark.slow
@pytest.mark.parametrize(("friction", "bounds"), [(1.2, (0.8, 0.83)), (0.8, (0.765, 0.79))])
def test_completion_where_every_impact_lets_a_held_mass_slip(friction, bounds):
    """What the slip takes of the impulse lowers the restitution: with m12^2 / (m11 m22) = k, to r - (1 + r) k.  Motions a little
    beyond were told complete: of flights under hardly any load the rise during the slip alone was looked at."""
    branch = bf.trace(bf.find_orbit(coupled(friction, bounds[0])), "omega", bounds=bounds)
    (point,) = branch.special_points.of("chatter_completion")
    assert branch.stop_reason == ("bound", "chattering") and branch.audit.ok and point.error < 1e-10
    row = branch.rows()[-1]
    impacts, release = train(row.part.problem, row.x)
    assert rebound(row.part.problem, row.x, impacts[-1]) == pytest.approx(0.5 - 1.5 * 0.25**2 / 1.44, abs=1e-14)
    for aside, complete in ((-1e-9, True), (1e-9, False)):
        system = coupled(friction, point.parameter + aside)
        orbit = bf.find_orbit(system, guess=point.solution.state)
        impact = [event for event in orbit.events if event.kind == "impact"][2]
        assert rests_beside_friction(system.mass, system.damping, system.stiffness, 2.1, system.omega, 0.12, 0.5, friction,
                                     impact.time, impact.before) is complete
    for aside, complete in ((-1e-8, True), (1e-8, False)):
        orbit = bf.find_orbit(coupled(friction, point.parameter + aside), guess=point.solution.state)
        assert orbit.success and (orbit.sequence.nodes[:, CLOSES] == 1).any() == complete


def test_motions_that_slip_and_never_come_to_rest_end_in_the_same_point():
    """Impacts are added one by one towards it, each with its slip and stick."""
    other = bf.trace(bf.find_orbit(coupled(1.2, 0.83)), "omega", bounds=(0.8, 0.83))
    (point,) = other.special_points.of("chatter_completion")
    assert point.parameter == pytest.approx(0.8124312244, abs=2e-10) and point.solution.success
    assert "release" in point.solution.signature


def test_what_impacts_leave_open_that_no_parameter_ends_is_not_known(branch):
    """The load of another mass, which nothing connects to the one that chatters, does not tell where that just completes; the
    restitution does, and is no farther off than stated."""
    completes_at, beside, load = branch.special_points[0].parameter, 1e-10, "harmonic_force_2.amplitude"
    system = bf.System(np.eye(2), 0.1 * np.eye(2), np.eye(2), [
        HarmonicForce(0.6, dof=0), RigidStop(0.0, completes_at - 1e-5, dof=0), HarmonicForce(0.3, dof=1)], omega=0.7)
    own = orbit_problem(bf.find_orbit(system), "rigid_stop.restitution", (0.4, 0.5))
    known = own.x0[:-1]
    for restitution, unknown in ((completes_at - 1e-5, False), (completes_at - beside, True)):  # more impacts than are listed
        c = own.correct(np.append(known, restitution), np.eye(1, known.size + 1, known.size)[0], True)
        orbit = own.solution(c.x)
        path = parameter_path(orbit.scene, orbit.system, load, (0.2, 0.4))
        other = OrbitProblem(orbit.system, path, orbit.sequence, orbit.weights, np.append(orbit.unknowns, 0.3), 0.1)
        assert other.uncertainty(other.x0, other.null_tangent(other.x0)) == (np.inf if unknown else 0.0)
        found = own.uncertainty(c.x, own.null_tangent(c.x))
        assert beside < found < 1e-8 if unknown else found == 0.0
