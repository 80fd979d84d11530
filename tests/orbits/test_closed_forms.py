"""Impact orbits against their closed forms: times, speeds, multipliers to 1e-11, stable and unstable, any n, r, gap."""
import numpy as np
import pytest
from matplotlib.figure import Figure

import bifurc as bf
from bifurc.elements import HarmonicForce, RigidStop
from tests.reference import ball, chain, digits, one_stop, two_stops
from tests.reference.compare import worst_impact, worst_multiplier

TOLERANCE = 1e-11

# zeta, omega, force, gap, restitution, n: near folds and flips, on both sides, and away from them
ONE_STOP = [
    (0.05, 1.5, 0.9, 1.0, 0.7, 1), (0.05, 1.5, 0.5, 1.0, 0.7, 1), (0.05, 2.5, 13.0, 1.0, 0.7, 1),
    (0.05, 2.5, 8.0, 1.0, 0.7, 1), (0.05, 2.5, 2.0, 1.0, 0.7, 2), (0.05, 2.5, 1.0, 1.0, 0.7, 2),
    (0.05, 0.8, 0.5, 1.0, 0.7, 1), (0.05, 0.8, 0.55, 1.0, 0.7, 1), (0.02, 2.8, 2.0, 1.0, 0.8, 2),
    (0.1, 0.7, 0.535, 1.0, 0.6, 1), (0.1, 0.7, 0.5224, 1.0, 0.6, 2), (0.02, 2.6, 1.0, 0.0, 0.8, 1),
    (0.0, 2.6, 1.0, 0.0, 0.8, 1), (0.0, 1.6, 1.0, 0.5, 0.8, 1), (0.0, 2.6, 1.0, 0.0, 1.0, 1),
    (0.0, 1.5, 0.6, 0.3, 1.0, 1), (0.0, 2.7, 1.0, -0.1, 1.0, 1), (0.1, 2.5, 1.0, -0.2, 0.8, 1),
    (0.1, 2.2, 1.5, -0.3, 0.8, 1), (0.2, 2.2, 2.0, -0.3, 0.7, 1), (0.05, 1.8, 1.0, 0.2, 0.0, 1),
    (0.05, 1.8, 1.0, 0.2, 0.3, 1), (0.05, 1.8, 1.0, 0.2, 0.7, 1), (0.05, 1.8, 1.0, 0.2, 1.0, 1),
    (0.3, 1.4, 2.0, 0.1, 0.5, 1), (1.25, 2.0, 20.0, 1.0, 0.7, 1), (1.0, 2.0, 20.0, 1.0, 0.7, 1),
]


def state_at_zero(reference):
    """State of a reference orbit at phase 0, as floats."""
    return np.array([float(z) for z in reference.state(0)])


def one_stop_system(zeta, omega, force, gap, r):
    return bf.systems.impact_oscillator(zeta=zeta, omega=omega, amplitude=force, gap=gap, restitution=r)


def assert_is(orbit, reference, periods, tolerance=TOLERANCE):
    """The orbit is the reference, admissible, converged, and says itself whether it is stable."""
    assert orbit.success, orbit.message
    assert orbit.admissible and orbit.periods == periods
    assert worst_impact(orbit, [reference.time], [reference.speed]) < tolerance
    assert worst_multiplier(orbit, reference.multipliers) < tolerance
    top = float(abs(reference.multipliers[0]))
    if abs(top - 1) > 1e-6:
        assert orbit.stable is (top < 1)


@pytest.mark.parametrize("case", ONE_STOP, ids=str)
def test_every_admissible_one_impact_orbit(case):
    zeta, omega, force, gap, r, n = case
    references = [o for o in one_stop.orbits(zeta, omega, force, gap, r, n, samples=200) if o.admissible]
    assert references, "the case must have an admissible orbit"
    for reference in references:
        orbit = bf.find_orbit(one_stop_system(zeta, omega, force, gap, r), state_at_zero(reference), periods=n)
        assert_is(orbit, reference, n)


@pytest.mark.parametrize("case", [(0.05, 1.5, 2.4800127912891815, 1.0, 0.7, 2), (0.05, 1.5, 1.2583, 1.0, 0.7, 3),
                                  (0.1, 2.5, 1.0, -0.2, 0.8, 1), (0.1, 0.7, 0.55673770552749112, 1.0, 0.6, 2)], ids=str)
def test_formal_orbits_are_never_passed_off_as_motions(case):
    zeta, omega, force, gap, r, n = case
    formal = [o for o in one_stop.orbits(zeta, omega, force, gap, r, n) if not o.admissible]
    assert formal
    for reference in formal:
        orbit = bf.find_orbit(one_stop_system(zeta, omega, force, gap, r), state_at_zero(reference), periods=n)
        if orbit.success:  # another motion was found from there; it is not the formal one
            impacts = [e for e in orbit.events if e.kind == "impact"]
            assert len(impacts) != 1 or orbit.periods != n or abs(impacts[0].speed - float(reference.speed)) > 1e-6


def random_cases(count, seed=20080115):
    """Parameters that nobody tuned for."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield (float(rng.uniform(0.0, 0.4)), float(rng.uniform(0.4, 4.0)), float(np.exp(rng.uniform(-1.5, 2.5))),
               float(rng.uniform(-0.5, 1.5)), float(rng.uniform(0.0, 1.0)), int(rng.choice([1, 1, 2, 3])))


@pytest.mark.parametrize("chunk", [0, *(pytest.param(chunk, marks=pytest.mark.slow) for chunk in (1, 2, 3))])
def test_random_one_impact_orbits(chunk):
    found = 0
    for zeta, omega, force, gap, r, n in list(random_cases(120))[chunk::4]:
        for reference in one_stop.orbits(zeta, omega, force, gap, r, n, samples=120):
            if not reference.admissible or abs(reference.multipliers[0]) > 1e3 or reference.margin < 1e-5:
                continue
            orbit = bf.find_orbit(one_stop_system(zeta, omega, force, gap, r), state_at_zero(reference), periods=n)
            assert_is(orbit, reference, n)
            found += 1
    assert found >= 3


@pytest.mark.parametrize("case", [*ONE_STOP[:6:2], (0.1, 2.2, 1.5, -0.3, 0.8, 1)], ids=str)
def test_mirrored_stop_gives_the_mirrored_orbit(case):
    zeta, omega, force, gap, r, n = case
    reference = [o for o in one_stop.orbits(zeta, omega, force, gap, r, n) if o.admissible][-1]
    system = bf.System(1.0, 2 * zeta, 1.0, (HarmonicForce(-force), RigidStop(gap, r, side=-1)), omega=omega)
    orbit = bf.find_orbit(system, -state_at_zero(reference), periods=n)
    assert_is(orbit, reference, n)
    assert orbit.maximum() == pytest.approx(-bf.find_orbit(one_stop_system(zeta, omega, force, gap, r),
                                                           state_at_zero(reference), periods=n).minimum(), rel=1e-12)


@pytest.mark.parametrize("length, time, mass", [(1e6, 1.0, 1.0), (1e-6, 1.0, 1.0), (1.0, 1e3, 1.0), (1.0, 1e-3, 5e4),
                                                (3e-3, 2e-4, 0.02)])
def test_units_do_not_matter(length, time, mass):
    """Lengths, times and masses in other units: the same multipliers, scaled times and speeds."""
    zeta, omega, force, gap, r, n = ONE_STOP[4]
    reference = one_stop.orbits(zeta, omega, force, gap, r, n)[-1]
    system = bf.System(mass, 2 * zeta * mass / time, mass / time**2,
                       (HarmonicForce(force * mass * length / time**2), RigidStop(gap * length, r)), omega=omega / time)
    orbit = bf.find_orbit(system, state_at_zero(reference) * [length, length / time], periods=n)
    assert orbit.success and orbit.periods == n
    (impact,) = orbit.events
    assert impact.time / time == pytest.approx(float(reference.time % (n * reference.motion.period)), rel=1e-11)
    assert impact.speed * time / length == pytest.approx(float(reference.speed), rel=1e-11)
    assert worst_multiplier(orbit, reference.multipliers) < TOLERANCE


@pytest.mark.parametrize("shift", [0.3, 1.7, 4.4])
def test_a_shift_of_the_load_shifts_the_orbit(shift):
    zeta, omega, force, gap, r, n = ONE_STOP[0]
    reference = [o for o in one_stop.orbits(zeta, omega, force, gap, r, n, phase=shift) if o.admissible][-1]
    system = bf.System(1.0, 2 * zeta, 1.0, (HarmonicForce(force, phase=shift), RigidStop(gap, r)), omega=omega)
    assert_is(bf.find_orbit(system, state_at_zero(reference), periods=n), reference, n)


@pytest.mark.parametrize("damper", ["frame", "ground"])
def test_moving_frame(damper):
    """The load is X0 omega^2 cos, and with the damper on the ground X0 |omega^2 - 2 i zeta omega| with a phase."""
    zeta, omega, amplitude, gap, r = 0.05, 1.5, 0.4, 1.0, 0.7
    load = amplitude * complex(omega**2, -2 * zeta * omega if damper == "ground" else 0.0)
    phase = np.angle(load)
    reference = [o for o in one_stop.orbits(zeta, omega, abs(load), gap, r, 1, phase) if o.admissible][-1]
    system = bf.systems.moving_frame_impact_oscillator(zeta=zeta, omega=omega, amplitude=amplitude, gap=gap,
                                                       restitution=r, damper=damper)
    assert_is(bf.find_orbit(system, state_at_zero(reference), periods=1), reference, 1)


# zeta, omega, force, restitution, n
TWO_STOPS = [(0.1, 2.0, 0.7, 0.7, 1), (0.1, 2.0, 3.0, 0.7, 1), (0.1, 2.0, 3.6, 0.7, 1), (0.02, 1.6, 0.5, 0.8, 1),
             (0.1, 4.0, 2.0, 0.7, 3), (0.1, 4.0, 2.45, 0.7, 3), (0.05, 1.2, 1.5, 0.3, 1), (0.0, 2.3, 2.0, 0.9, 1)]


@pytest.mark.parametrize("case", TWO_STOPS, ids=str)
def test_symmetric_orbits_between_two_stops(case):
    zeta, omega, force, r, n = case
    system = bf.systems.two_sided_impact_oscillator(zeta=zeta, omega=omega, amplitude=force, gap=1.0, restitution=r)
    references = [o for o in two_stops.orbits(zeta, omega, force, 1, r, n, samples=200) if o.admissible]
    assert references
    for reference in references:
        motion, half = reference.motion, n * reference.motion.period / 2
        t = reference.time % half
        sign = 1 if int((reference.time - t) / half + 0.5) % 2 == 0 else -1  # of the last impact
        end = 2 * half
        x, v = motion.flow(t + half, -sign * reference.gap, sign * reference.restitution * reference.speed, end)
        orbit = bf.find_orbit(system, (float(x), float(v)), periods=n)
        assert orbit.success, orbit.message
        assert orbit.periods == n and len(orbit.events) == 2
        assert worst_impact(orbit, [t, t + half], [reference.speed] * 2) < TOLERANCE
        assert worst_multiplier(orbit, reference.multipliers) < TOLERANCE


def test_two_impacts_in_two_periods():
    """The orbit born in the flip at 12.69994, and its own flip at 10.1599 where one multiplier is -1."""
    system = one_stop_system(0.05, 2.5, 12.6, 1.0, 0.7)
    period = 2 * np.pi / 2.5
    motion = one_stop.Oscillator("0.05", "2.5", "12.6")
    times, speeds = digits.DOUBLED
    y = [float(z) for z in motion.flow(times[1], 1, -0.7 * speeds[1], 2 * motion.period)]
    orbit = bf.find_orbit(system, y, periods=2)
    assert orbit.success and orbit.periods == 2 and orbit.period == pytest.approx(2 * period, rel=1e-14)
    assert worst_impact(orbit, *digits.DOUBLED) < TOLERANCE
    assert worst_multiplier(orbit, digits.DOUBLED_MULTIPLIERS) < 1e-9  # stored to ten digits
    assert orbit.harmonic(0.5) != 0

    system = system.with_parameters(amplitude=digits.SECOND_FLIP)
    motion = motion.with_(force=digits.SECOND_FLIP)
    times, speeds = digits.SECOND_FLIP_ORBIT
    y = [float(z) for z in motion.flow(times[1], 1, -0.7 * speeds[1], 2 * motion.period)]
    orbit = bf.find_orbit(system, y, periods=2)
    assert worst_impact(orbit, *digits.SECOND_FLIP_ORBIT) < TOLERANCE
    assert abs(orbit.multipliers[0] + 1) < TOLERANCE and orbit.stable is None


def test_a_repeat_is_reduced_and_said():
    reference = one_stop.orbits(0.05, 1.5, 0.9, 1, 0.7, 1)[-1]
    orbit = bf.find_orbit(one_stop_system(0.05, 1.5, 0.9, 1.0, 0.7), state_at_zero(reference), periods=3)
    assert orbit.success and orbit.periods == 1
    assert worst_impact(orbit, [reference.time], [reference.speed]) < TOLERANCE


def test_stable_orbits_are_found_without_a_guess():
    """From rest the free motion, or where it touches the impacting one."""
    free = bf.find_orbit(one_stop_system(0.05, 0.5, 0.52, 1.0, 0.7))
    assert free.success and not free.events and free.stable
    motion = one_stop.Oscillator("0.05", "0.5", "0.52")
    assert free.maximum() == pytest.approx(float(motion.amplitude), rel=1e-13)
    assert free.harmonic(1) == pytest.approx(complex(motion.force * motion.receptance), rel=1e-12)
    assert worst_multiplier(free, [np.exp(-0.05 * free.period) * np.exp(1j * s * np.sqrt(1 - 0.05**2) * free.period)
                                   for s in (1, -1)]) < TOLERANCE
    hit = bf.find_orbit(one_stop_system(0.05, 1.1, 0.52, 1.0, 0.7))
    every = one_stop.orbits(0.05, 1.1, 0.52, 1, 0.7, 1)
    (reference,) = [o for o in every if o.admissible and abs(o.multipliers[0]) < 1]
    assert_is(hit, reference, 1)


@pytest.mark.parametrize("n, omega, force, r", [(2, 0.9, 0.8, 0.7), (2, 2.2, 4.0, 0.7), (8, 0.3, 0.45, 0.7),
                                                pytest.param(8, 0.3, 0.38, 0.7, marks=pytest.mark.slow),
                                                pytest.param(8, 0.3, 0.37, 0.7, marks=pytest.mark.slow)])
def test_orbits_of_a_chain(n, omega, force, r):
    system = bf.systems.impact_chain(n=n, omega=omega, amplitude=force, gap=1.0, restitution=r, damping=0.1)
    scene = chain.spring_chain(n, omega, force, r, damping_ratio=0.1)
    references = [o for o in scene.orbits(samples=200) if o.admissible]
    assert references
    for reference in references:
        y = scene.at_phase_zero(reference)
        orbit = bf.find_orbit(system, y, periods=1)
        assert orbit.success, orbit.message
        assert worst_impact(orbit, [reference.time], [reference.speed]) < TOLERANCE
        assert worst_multiplier(orbit, reference.multipliers) < TOLERANCE


@pytest.mark.parametrize("omega, amplitude, r, n", [(1.0, 1.3, 0.5, 1), (1.0, 1.6, 0.5, 1), (2.0, 0.16, 0.8, 1),
                                                    (1.0, 0.9, 0.8, 2)])
def test_bouncing_ball(omega, amplitude, r, n):
    system = bf.systems.bouncing_ball(omega=omega, amplitude=amplitude, restitution=r)
    references = [o for o in ball.orbits(omega, amplitude, r, 1, n) if o.admissible]
    assert references
    for reference in references:
        span = float(2 * np.pi * n / omega)
        t, u = float(reference.time), float(reference.take_off)
        height = amplitude * np.cos(omega * t)
        s = span - t  # from the bounce to phase 0
        orbit = bf.find_orbit(system, (height + u * s - s * s / 2, u - s), periods=n)
        assert orbit.success, orbit.message
        assert worst_impact(orbit, [reference.time], [reference.approach]) < TOLERANCE
        assert worst_multiplier(orbit, reference.multipliers) < TOLERANCE


@pytest.mark.parametrize("case", digits.STICKING, ids=lambda c: str(c[:5]))
def test_orbits_that_come_to_rest_on_the_stop(case):
    """End of the chatter and release to 1e-11; both multipliers exactly zero."""
    zeta, omega, force, gap, r, begin, end = case
    system = one_stop_system(zeta, omega, force, gap, r)
    orbit = bf.find_orbit(system)
    assert orbit.success, orbit.message
    assert orbit.periods == 1 and orbit.stable
    period = orbit.period
    release = [e for e in orbit.events if e.kind == "release"]
    assert len(release) == 1
    assert abs((release[0].time - end + period / 2) % period - period / 2) < TOLERANCE
    if r == 0:
        rests = [e.time for e in orbit.events if e.kind == "impact"]
    else:
        (closed,) = [e for e in orbit.events if e.kind == "chatter"]
        assert closed.ratio == r
        rests = [closed.end]
    assert min(abs((t - begin + period / 2) % period - period / 2) for t in rests) < TOLERANCE
    assert np.abs(orbit.multipliers).max() < 1e-14
    assert len(orbit.events) < 200


@pytest.mark.parametrize("r", [0.0, 0.3])
def test_two_masses_of_which_one_comes_to_rest(r):
    release, first, rest, q2, v2, multiplier = digits.TWO_MASS_STICKING[r]
    K = np.array([[2.0, -1.0], [-1.0, 1.0]])
    system = bf.System(np.eye(2), 0.2 * K, K, (HarmonicForce(1.2, dof=1), RigidStop(0.3, r, dof=0)), omega=0.4)
    orbit = bf.find_orbit(system)
    assert orbit.success, orbit.message
    (out,) = [e for e in orbit.events if e.kind == "release"]
    assert abs(out.time - release) < TOLERANCE
    impacts = sorted(e.time for e in orbit.events if e.kind in ("impact", "chatter"))
    assert abs(impacts[0] - first) < TOLERANCE
    ends = [e.end for e in orbit.events if e.kind == "chatter"] if r else impacts
    assert min(abs(t - rest) for t in ends) < TOLERANCE
    assert worst_multiplier(orbit, [multiplier, np.conj(multiplier), 0, 0]) < TOLERANCE


@pytest.mark.parametrize("force, gap, r", [(1.0, 1.0, 0.7), (0.3, 0.5, 0.3), (2.0, 1.5, 0.95)])
def test_undamped_resonance_with_impacts(force, gap, r):
    """K - omega^2 M is singular; the 1-1 orbit has v = pi F/(1 + r), hits at phase 0, and both multipliers are -r."""
    system = one_stop_system(0.0, 1.0, force, gap, r)
    v = float(one_stop.resonant_orbit(force, r))
    orbit = bf.find_orbit(system, (gap, -r * v), periods=1)
    assert orbit.success, orbit.message
    (impact,) = orbit.events
    assert abs(impact.speed - v) < TOLERANCE
    assert min(impact.time, orbit.period - impact.time) < TOLERANCE
    assert worst_multiplier(orbit, [-r, -r]) < 1e-7  # a double eigenvalue: the root of rounding
    assert np.prod(orbit.multipliers).real == pytest.approx(r * r, abs=TOLERANCE)
    assert np.sum(orbit.multipliers).real == pytest.approx(-2 * r, abs=TOLERANCE)


@pytest.mark.parametrize(("gap", "words"), [(-0.5, "in contact / 1 T"), (0.5, "free / 1 T")])
def test_a_motion_that_never_lets_go_is_not_called_free(gap, words):
    """A stop that presses all the time makes an oscillator with amplitude over |k - omega^2 + 2 i zeta omega|."""
    system = bf.systems.bilinear_oscillator(zeta=0.05, amplitude=0.05, gap=gap, stiffness_ratio=4.0, omega=0.3)
    orbit = bf.find_orbit(system)
    assert orbit.signature == words
    total = 4.0 if gap < 0 else 1.0
    assert abs(orbit.harmonic(1, 0)) == pytest.approx(0.05 / abs(total - 0.09 + 0.03j), abs=1e-13)
    branch = bf.trace(orbit, "omega", bounds=(0.25, 0.35))
    labels = {line.get_label() for line in branch.plot(ax=Figure().subplots()).lines}
    assert any(label.startswith("in contact") for label in labels) == (gap < 0)
