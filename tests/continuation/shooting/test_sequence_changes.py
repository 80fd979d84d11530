"""Where the event sequence of a branch changes, the branch goes on with what simulation does beyond; it holds only motions."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.kinds import StopReason
from bifurc.continuation.shooting import successor
from bifurc.continuation.shooting.problem import orbit_problem
from bifurc.elements import Coulomb, ElasticStop, HarmonicForce, RigidStop, Stribeck
from bifurc.orbits.repetition import repetition


def assert_motions(branch):
    """Every orbit between the changes is admissible and repeated by simulation; the audit says so."""
    changes = np.array([point.s for point in branch.special_points] or [np.inf])
    for s, orbit in zip(branch.column("s"), branch.orbits, strict=True):
        if np.abs(changes - s).min() < 1e-9:  # there both sequences are right
            continue
        assert orbit.success, orbit
        assert repetition(orbit).repeated, (orbit, repetition(orbit))
    assert branch.audit.ok and branch.audit.resimulated.rows > 0, branch.audit


def test_release_from_a_preloaded_stop_is_a_complete_chattering():
    """The mass rests on its stop up to amplitude = -gap; beyond it leaves it once a period and comes back to rest."""
    system = bf.systems.impact_oscillator(zeta=0.05, omega=0.7, amplitude=0.1, gap=-0.3, restitution=0.5)
    branch = bf.trace(bf.find_orbit(system), "amplitude", bounds=(0.05, 0.6))
    assert branch.stop_reason == (StopReason.BOUND, StopReason.BOUND)
    assert [p.parameter for p in branch.special_points] == pytest.approx([0.3], abs=1e-12)
    assert_motions(branch)
    assert np.abs(branch.orbits[-1].multipliers).max() < 1e-9  # superstable: it forgets everything at rest


def test_plastic_impacts_become_chattering_where_restitution_grows():
    """No row keeps a rest after an impact with rebound."""
    system = bf.systems.impact_oscillator(zeta=0.05, omega=0.7, amplitude=0.6, gap=0.0, restitution=0.0)
    orbit = bf.find_orbit(system)
    assert "release" in orbit.signature
    branch = bf.trace(orbit, "restitution", bounds=(0.0, 0.5))
    assert branch.stop_reason == (StopReason.BOUND, StopReason.CHATTERING)
    assert all(orbit.success and repetition(orbit).repeated for orbit in list(branch.orbits)[::4])


def test_listed_impacts_of_a_chattering_follow_its_closure():
    """From r = .3 to .7 a complete chattering needs more and more listed impacts; the accumulation stays right."""
    system = bf.systems.impact_oscillator(zeta=0.05, omega=0.4, amplitude=0.6, gap=0.0, restitution=0.3)
    branch = bf.trace(bf.find_orbit(system), "restitution", bounds=(0.3, 0.7))
    assert branch.stop_reason == (StopReason.BOUND, StopReason.BOUND)
    counts = branch.column("n_events")
    assert counts[-1] > counts[0] + 10
    assert not branch.special_points  # a change of the equations is none of the motion
    orbit = branch.orbits[-1]
    (end,) = [event.end for event in orbit.events if event.kind == "chatter"]
    motion = bf.simulate(orbit.system, orbit.state, periods=1)
    assert [event.end for event in motion.events if event.kind == "chatter"] == pytest.approx([end], abs=1e-9)


def test_a_plastic_impact_that_begins_to_rest_is_a_special_point():
    """At r = 0 the mass rests behind its impact as soon as it is pressed there; that is located."""
    system = bf.systems.impact_oscillator(zeta=0.01737, omega=2.1, amplitude=6.268, gap=0.0, restitution=0.0)
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(1.9, 2.2))
    assert branch.stop_reason == (StopReason.BOUND, StopReason.BOUND)
    (point,) = branch.special_points
    assert point.kind == "separation" and "release" in point.before and "release" not in point.after
    (event,) = point.solution.events
    load = 6.268 * np.cos(point.parameter * event.time)  # at the stop, at rest: the acceleration is the load
    assert abs(load) < 1e-9
    assert_motions(branch)


def test_jumps_of_static_friction_end_a_branch_and_say_so():
    """Static friction above kinetic: a slip that is born has a finite size at once."""
    system = bf.System(1.0, 0.153, 1.0, [HarmonicForce(0.433), Coulomb(0.247, static_ratio=1.3, belt_speed=0.191)], omega=0.623)
    branch = bf.trace(bf.find_orbit(system), "harmonic_force.amplitude", bounds=(0.2165, 0.6495))
    assert StopReason.JUMP in branch.stop_reason
    assert all(reason in (StopReason.JUMP, StopReason.CYCLE_END, StopReason.BOUND) for reason in branch.stop_reason)
    assert "not continuous" in StopReason.JUMP.sentence


def test_a_parameter_that_breaks_the_symmetry_is_followed_on_the_whole_period():
    """Two equal stops: the orbit is solved on its half period, the gap of one of them is not."""
    system = bf.System(1.0, 0.1, 1.0, [HarmonicForce(0.8), RigidStop(0.6, 0.5), RigidStop(0.6, 0.5, side=-1)], omega=1.04)
    orbit = bf.find_orbit(system)
    assert orbit.closure == -1
    branch = bf.trace(orbit, "rigid_stop.gap", bounds=(0.5, 0.7))
    assert branch.orbits[0].closure == 1
    assert_motions(branch)


def test_a_mass_that_a_belt_carries_along_is_no_rest():
    """A held row with drift moves: no orbit of constant position."""
    system = bf.System(1, 0.05, 1, [HarmonicForce(0.3), Stribeck(kinetic=0.5, static=1, speed=0.4, belt_speed=0.3)], omega=2)
    orbit = bf.find_orbit(system, transient=80)
    assert not orbit.success or orbit.sequence.events


@pytest.mark.parametrize("kind", ["record", "stop"])
def test_time_limits_of_the_caller_pass_through(kind):
    """A TimeoutError is not taken for a step that failed."""
    def ends(point):
        raise TimeoutError("enough")

    with pytest.raises(TimeoutError, match="enough"):
        bf.trace(bf.find_orbit(bf.systems.impact_oscillator()), "omega", bounds=(0.4, 0.6), **{kind: ends})


def test_fast_audits_simulate_nothing():
    """The cost of the full audit is reported, the fast one has none."""
    orbit = bf.find_orbit(bf.systems.impact_oscillator())
    full = bf.trace(orbit, "omega", bounds=(0.45, 0.55)).audit
    fast = bf.trace(orbit, "omega", bounds=(0.45, 0.55), audit="fast").audit
    assert full.resimulated.rows > 5 and full.resimulated.seconds > 0.0 and "simulated again" in repr(full)
    assert fast.resimulated is None and fast.ok
    with pytest.raises(ValueError, match="audit"):
        bf.trace(orbit, "omega", bounds=(0.45, 0.55), audit="slow")


def test_column_stable_is_that_of_the_orbits():
    """Same order, same neutral band."""
    branch = bf.trace(bf.find_orbit(bf.systems.impact_oscillator()), "omega", bounds=(0.45, 0.7))
    assert list(branch.column("stable")) == [orbit.stable for orbit in branch.orbits]
    first = np.array([orbit.multipliers[0] for orbit in branch.orbits])
    clear = np.abs(first) < 1e6  # at a graze itself it is infinite, to rounding
    assert np.count_nonzero(~clear) <= 2
    assert np.allclose(branch.column("multiplier_0")[clear], first[clear], rtol=1e-8, atol=1e-12)


def test_nearly_rigid_stops_are_traced_through_grazing():
    """Stiffness ratio 1e8: Newton stops at the rounding of contact forces and does not crawl; the grazings of the free motion
    are those of every stiffness."""
    system = bf.systems.bilinear_oscillator(zeta=0.05, omega=0.5, amplitude=0.3, gap=0.5, stiffness_ratio=1e8)
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(0.5, 2.5), max_steps=400)
    assert branch.stop_reason == (StopReason.BOUND, StopReason.BOUND)
    grazings = [point.parameter for point in branch.special_points.of("grazing")]
    assert grazings[0] == pytest.approx(0.63511486615490092382, abs=1e-11)
    assert grazings[-1] == pytest.approx(1.2596146659947407444, abs=1e-11)
    assert branch.audit.ok, branch.audit


def two_masses(amplitude, omega, ratio, k, gap, restitution, friction):
    """Return two masses; one hits a rigid stop, the other rubs."""
    K = np.array([[1.0 + k, -k], [-k, 1.0 + k]])
    return bf.System(np.diag([1.0, ratio]), (0.06 * K).round(4), K, [
        HarmonicForce(amplitude), RigidStop(gap, restitution), Coulomb(friction, dof=1)], omega=omega)


def test_a_branch_goes_on_where_a_contact_slips_no_more():
    """Its mass slips once a period each way; where both slips fall to nothing it sticks all the time, as simulation says."""
    system = two_masses(1.19, 1.18, 1.65, 1.1, 0.602, 0.319, 0.736)
    branch = bf.trace(bf.find_orbit(system), "amplitude", bounds=(0.595, 1.785))
    assert branch.stop_reason == (StopReason.BOUND, StopReason.BOUND)
    assert_motions(branch)
    onset, = (point for point in branch.special_points if ("slip" in point.before) != ("slip" in point.after))
    end, near = onset.parameter, int(np.argmin(np.abs(branch.column("s") - onset.s)))
    state = branch.orbits[near].state
    for amplitude, slips in ((end - 1e-3, False), (end + 1e-3, True)):
        motion = bf.simulate(system.with_parameters(amplitude=amplitude), state, periods=200)
        late = [event for event in motion.events if event.time > 0.9 * motion.t[-1]]
        assert {event.kind.value for event in late} == ({"impact", "slip", "stick"} if slips else {"impact"})
    apart = np.flatnonzero(branch.column("harmonic_force.amplitude") > end + 1e-6)[0]  # nearer, the slips are made of rounding
    back = bf.trace(branch.orbits[apart], "amplitude", bounds=(0.595, 1.785))
    assert [point.kind for point in back.special_points] == [point.kind for point in branch.special_points]


def test_where_both_slips_fall_to_nothing_the_branch_goes_on_with_rest():
    """The second of two masses slips once a period each way, and below some load sticks where it is: its slips begin where the
    force that holds it there, linear in the motion of the first mass, meets mu."""
    k, omega, mu = 0.323, 0.554, 0.129
    system = two_masses(0.65, omega, 0.555, k, 0.692, 0.228, mu)
    K, C = 1.0 + k, 0.06 * (1.0 + k)
    c = round(0.06 * k, 4)
    onset = mu * abs(K - omega**2 + 1j * omega * round(C, 4)) / abs(k + 1j * omega * c)
    branch = bf.trace(bf.find_orbit(system), "amplitude", bounds=(0.325, 0.975))
    assert branch.stop_reason == (StopReason.BOUND, StopReason.BOUND)
    point = branch.special_points[0]
    assert point.kind == "slip_onset" and point.parameter == pytest.approx(onset, abs=1e-9)
    assert_motions(branch)
    assert branch.orbits[1].sequence.events == 0
    named = sorted((p.kind.value, round(p.parameter, 6)) for p in branch.special_points)
    for row in (2, len(branch) - 3):  # the names of changes do not depend on the direction: of two events at one instant neither
        back = bf.trace(branch.orbits[row], "amplitude", bounds=(0.325, 0.975))
        assert sorted((p.kind.value, round(p.parameter, 6)) for p in back.special_points) == named


@pytest.mark.parametrize("amplitude", [1.0408, 1.04087, 1.041])
def test_two_slips_that_begin_where_rounding_solves_the_equations(amplitude):
    """All durations of two slips born at one instant solve the equations to rounding as long as they are short: no direction is
    told there, and the branch begins beside, from wherever it is traced."""
    system = two_masses(amplitude, 0.586, 1.07, 0.619, 0.234, 0.124, 0.273)
    branch = bf.trace(bf.find_orbit(system), "amplitude", bounds=(0.95, 1.15))
    assert branch.stop_reason == (StopReason.BOUND, StopReason.BOUND)
    assert [(p.kind, p.parameter) for p in branch.special_points] == [("stick_onset", pytest.approx(1.0408820652041, abs=1e-10))]
    assert_motions(branch)


def test_a_slip_that_ends_with_an_impact_falls_to_nothing():
    """An impact interrupts a slip that has hardly begun, and the mass sticks at once: the slip before it is nothing in first order
    of the distance from the change, that behind it in second, and the impact has moved away from its stop by as little."""
    system = two_masses(0.848, 0.636, 1.79, 0.817, 0.119, 0.785, 0.362)
    orbit = bf.find_orbit(system)
    down = bf.trace(orbit, "amplitude", bounds=(0.776, 0.85))
    up = bf.trace(down.orbits[1], "amplitude", bounds=(0.776, 0.85))
    for branch in (down, up):
        assert [(p.kind.value, p.parameter) for p in branch.special_points] == [
            ("slip_onset", pytest.approx(0.782310738754, abs=1e-10))]
        assert max(p.error for p in branch.special_points) < 1e-10
        assert_motions(branch)


def test_the_nearest_beginning_is_taken_where_two_are_near():
    """Between two changes 4e-8 apart lies a part of its own, with a corner: coming from above the branch does not leave it out."""
    system = bf.System(1.0, 0.107, 1.0, [HarmonicForce(1.0), RigidStop(0.29, 0.842), Coulomb(0.0526)], omega=0.467)
    branch = bf.trace(bf.find_orbit(system), "rigid_stop.restitution", bounds=(0.67, 0.86))
    near = [point.parameter for point in branch.special_points if abs(point.parameter - 0.6726073) < 1e-7
            and point.kind != "period_doubling"]
    assert sorted(near) == pytest.approx([0.672607291254, 0.672607332998], abs=1e-10)


@pytest.mark.parametrize("case", [(1.25, 0.937, 1.35, 1.96, 0.398, 0.805, 0.573), (1.21, 0.92, 1.02, 0.474, 0.257, 0.753, 0.172)])
def test_what_an_impact_lets_slip_must_move_away(case):
    """An impact on one mass lets the other slip at once, or after a time that is never negative: rows beyond were solved with a
    slip before the impact that it follows, or one that begins against its friction."""
    system = two_masses(*case)
    omega = case[1]
    bounds = (0.7 * omega, 1.3 * omega)
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=bounds, max_steps=250)
    assert branch.stop_reason == (StopReason.BOUND, StopReason.BOUND)
    assert_motions(branch)
    found = sorted(point.parameter for point in branch.special_points)
    back = bf.trace(branch.orbits[2], "omega", bounds=bounds, max_steps=500)
    np.testing.assert_allclose(sorted(point.parameter for point in back.special_points), found, rtol=0, atol=1e-8)


def test_a_pair_that_leaves_the_circle_and_comes_back_in_one_step_is_seen():
    """Beside a flip, both ways: the modulus of the pair at both points is that of an independent difference of the period map."""
    system = two_masses(1.53, 2.23, 0.609, 1.8, 0.358, 0.413, 0.0948)
    branch = bf.trace(bf.find_orbit(system), "rigid_stop.gap", bounds=(0.2148, 0.5012))
    tori = branch.special_points.of("neimark_sacker")
    assert [point.parameter for point in tori] == pytest.approx([0.223596801562, 0.246244899320], abs=1e-9)
    for point in tori:
        orbit = point.problem.solution(point.x)
        begin = 0.5 * orbit.forcing_period  # away from events
        y = orbit.sample(3)[1][1]
        flow = [bf.simulate(orbit.system, y + step, periods=1, t0=begin).final for h in (1e-7, -1e-7) for step in h * np.eye(4)]
        monodromy = (np.array(flow[:4]) - np.array(flow[4:])).T / 2e-7
        moduli = np.abs(np.linalg.eigvals(monodromy))
        assert np.sort(np.abs(moduli - 1.0))[:2] == pytest.approx([0.0, 0.0], abs=1e-5)


def three_masses(amplitude, first, second, stiffness, friction, omega):
    """Return three masses with two elastic clearances between them and friction on the last."""
    K = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 2.0]])
    return bf.System(np.eye(3), 0.05 * K, K, [
        HarmonicForce(amplitude), ElasticStop(first, stiffness, row=(1.0, -1.0, 0.0)),
        ElasticStop(second, stiffness, row=(0.0, 1.0, -1.0)), Coulomb(friction, dof=2)], omega=omega)


@pytest.mark.parametrize("start", [1.045, 1.05, 1.0533])
def test_a_pair_that_reaches_the_circle_where_another_leaves_it_is_seen(start):
    """Both passages lie in one step, whose ends have as many multipliers outside: two complex pairs have changed sides."""
    guess = (-0.2823747333905713, -0.5815870233176214, -1.1305838984475276, -0.004354818737983665, 0.5181868515321713,
             -0.25159591558716565)
    near = bf.find_orbit(three_masses(1.24, 0.592, 0.391, 6.11, 0.0389, 1.0588778970390507), guess=guess, periods=1)
    orbit = bf.find_orbit(near.system.with_parameters(omega=start), guess=near)
    branch = bf.trace(orbit, "omega", bounds=(0.819, 1.521), ds=0.12, direction=1, max_steps=5)
    tori = branch.special_points.of("neimark_sacker")[:2]
    assert [point.parameter for point in tori] == pytest.approx([1.05845943676, 1.06060547896], abs=1e-9)
    for point in tori:
        mu = point.solution.multipliers
        assert np.abs(np.abs(mu[mu.imag > 0.0]) - 1.0).min() < 1e-9


@pytest.mark.parametrize("step", [0.001, 0.004, 0.01])
def test_two_pairs_that_reach_the_circle_beside_a_fold_are_seen(step):
    """Between a fold and a graze four multipliers come in, two by two; the fold changes their number by one the other way."""
    guess = (-0.5359519012210141, -0.9072863696884995, -0.34517061032588003, 1.2175570443892139, 0.5083946869019232,
             0.418879803624831)
    orbit = bf.find_orbit(three_masses(0.32, 0.607, 0.369, 41.9, 0.0268, 0.8131418368371817), guess=guess, periods=1)
    branch = bf.trace(orbit, "omega", bounds=(0.5537, 1.0283), ds=step, direction=-1, max_steps=4)
    tori = branch.special_points.of("neimark_sacker")
    assert sorted(point.parameter for point in tori) == pytest.approx([0.81314458528, 0.81314695071], abs=1e-9)


def test_flights_that_a_simulation_closes_are_no_miss():
    """An orbit may list an impact more of a complete chattering than the simulation that repeats it: in the middle of that last
    flight, 1e-6 of a period long, their speeds differ by as much, and behind the sequence they do not."""
    system = bf.System(1.0, 0.113, 1.0, [HarmonicForce(1.0), RigidStop(0.153, 0.128), Coulomb(0.273)], omega=1.06)
    branch = bf.trace(bf.find_orbit(system), "rigid_stop.restitution", bounds=(0.0, 0.378), max_steps=250)
    assert all(repetition(orbit).repeated for orbit in branch.orbits if orbit.success)


@pytest.mark.parametrize("later", [0, 1, 2, 3])
def test_what_simulation_reads_beyond_has_the_phase_of_the_branch(later):
    """An orbit of four forcing periods and the same a period later are two solutions; the sequence read from a simulation, which
    begins in any of the four periods, is that of the branch."""
    orbit = bf.find_orbit(bf.systems.impact_oscillator(omega=2.8, amplitude=1.0, gap=0.0, restitution=0.6, zeta=0.1))
    assert orbit.success and orbit.periods == 4
    times = orbit.unknowns.reshape(len(orbit.sequence.nodes), -1)
    times[:, 0] += later
    problem = orbit_problem(orbit, "gap", (-0.1, 0.1))
    x = np.append(times.ravel(), 0.0)
    read = list(successor._read(problem, x, successor.Search()))
    assert read
    for signature, unknowns in read:
        same = problem.with_sequence(signature, np.append(unknowns, 0.0))
        assert successor.distance(problem.solution(x), same.solution(same.x0)) < 1e-9


def test_a_branch_of_two_forcing_periods_goes_on_beyond_a_chattering():
    """Where one listed impact more or less closes the complete chattering is no end of the motion."""
    system = bf.System(1.0, 0.0301, 1.0, [HarmonicForce(0.613), RigidStop(0.111, 0.0762)], omega=2.58)
    orbit = bf.find_orbit(system)
    assert orbit.periods == 2
    branch = bf.trace(orbit, "gap", bounds=(0.031, 0.191))
    assert StopReason.NO_SUCCESSOR not in branch.stop_reason
    assert_motions(branch)


@pytest.mark.parametrize("omega", [1.93, 2.17, 2.25, 2.32, 2.47])
def test_slips_both_ways_are_born_at_once_from_wherever_the_branch_starts(omega):
    """A mass at rest under friction begins to slip up and down in one period: of the two branches of equations that cross there one
    has a negative duration.  The onset is where the spring and dashpot between the masses reach the friction."""
    M, C, K = np.diag([1.0, 0.863]), np.array([[0.0903, -0.0303], [-0.0303, 0.0903]]), np.array([[1.505, -0.505], [-0.505, 1.505]])
    system = bf.System(M, C, K, [HarmonicForce(0.741), RigidStop(0.972, 0.0201), Coulomb(0.411, dof=1)], omega=omega)
    orbit = bf.find_orbit(system, guess=(0.0, 0.0, 0.0, 0.0))
    assert orbit.signature.startswith("rest")
    branch = bf.trace(orbit, "omega", bounds=(1.4, 2.5))
    assert branch.stop_reason == (StopReason.BOUND, StopReason.BOUND)
    assert [str(point.kind) for point in branch.special_points] == ["stick_onset", "stick_onset", "fold", "grazing", "slip_onset"]
    onset = branch.special_points[-1].parameter
    force = 0.741 / (1.505 - onset**2 + 0.0903j * onset) * (-0.505 - 0.0303j * onset)
    assert abs(force) == pytest.approx(0.411, abs=1e-13)
    assert "rest" in branch.orbits[-1].signature and "impact" in branch.orbits[0].signature
