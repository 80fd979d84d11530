"""Branches of impact orbits against closed forms: every special point to 1e-9 or better, `error` bounds the truth, none
missing and none invented, at any largest step."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import HarmonicForce, Jenkins, RigidStop
from tests.reference import ball, chain, digits, one_stop, two_stops
from tests.reference.oscillator import Oscillator


def assert_points(branch, want, tolerance):
    """Special points of a branch are exactly ``want``, pairs (kind, value), each within ``tolerance`` and its own error."""
    got = [(str(p.kind), p.parameter) for p in branch.special_points]
    assert len(got) == len(want), f"got {branch.special_points}\nwant {want}"
    left = list(branch.special_points)
    for kind, value in want:
        value = float(value)
        near = min((p for p in left if p.kind == kind), key=lambda p: abs(p.parameter - value), default=None)
        assert near is not None, f"no {kind} near {value}: {branch.special_points}"
        left.remove(near)
        apart = abs(near.parameter - value)
        assert apart <= tolerance * max(1.0, abs(value)), f"{near} is {apart:.2e} off {value!r}"
        assert apart <= near.error + 4e-16 * abs(value), f"{near} is {apart:.2e} off {value!r}: more than its error"
        assert near.bracket[0] <= near.s <= near.bracket[1]


def free_start(system, zeta, omega, force):
    """The free orbit: the steady response at phase 0 as guess."""
    return bf.find_orbit(system, tuple(float(z) for z in Oscillator(zeta, omega, force).particular(0)), periods=1)


def reference_start(orbit):
    """State of a closed-form orbit at phase 0."""
    return tuple(float(z) for z in orbit.state(0))


DEFAULT = [("grazing", digits.DEFAULT_GRAZINGS[0]), *(("period_doubling", w) for w in digits.DEFAULT_FLIPS),
           ("fold", digits.DEFAULT_FOLD), ("grazing", digits.DEFAULT_GRAZINGS[1])]


@pytest.fixture(scope="module")
def default_branch():
    return bf.trace(bf.find_orbit(bf.systems.impact_oscillator()), "omega", bounds=(0.5, 2.0))


def test_default_branch(default_branch):
    """Two grazings, three flips, one fold; free, impacting, free; both ends on their bounds."""
    assert_points(default_branch, DEFAULT, 1e-12)
    p = default_branch.column("omega")
    assert {p[0], p[-1]} == {0.5, 2.0}
    assert [str(r) for r in default_branch.stop_reason] == ["bound", "bound"]
    assert all(default_branch.orbits[i].success for i in range(0, len(default_branch), 7))


@pytest.mark.parametrize("ds_max", [0.05, 0.1, 0.3, 0.5, 1.0])
def test_default_branch_at_any_step(ds_max):
    branch = bf.trace(bf.find_orbit(bf.systems.impact_oscillator()), "omega", bounds=(0.5, 2.0), ds_max=ds_max)
    assert_points(branch, DEFAULT, 1e-12)


def test_points_lie_on_the_closed_form_branch(default_branch):
    """Every impacting row has the closed-form impact speed of one of the two solutions, and its multipliers."""
    omega = default_branch.column("omega")
    hits = default_branch.column("n_events")
    checked = 0
    for i in np.flatnonzero(hits == 1)[::2]:
        orbit = default_branch.orbits[int(i)]
        (impact,) = orbit.events
        motion = Oscillator(0.05, float(omega[i]), 0.52)
        speeds = one_stop.speeds(motion, 1, 0.7, 1)
        # at the fold the two solutions meet: the square root of rounding there
        apart = min(abs(float(v) - impact.speed) for v in speeds)
        spread = float(abs(speeds[1] - speeds[0]))
        assert apart < 1e-12 + 1e-14 / spread
        checked += 1
    assert checked > 10


def test_switching_at_both_grazings_of_the_default_branch(default_branch):
    """At the first grazing the 1-1 orbit and the 2-1 orbit are born, at the second only the 1-1 orbit."""
    first, second = default_branch.special_points.of("grazing")
    if first.parameter > second.parameter:
        first, second = second, first
    starts = bf.switch_branch(first)
    assert sorted(round(o.periods if hasattr(o, "periods") else o.sequence.span) for o in starts) == [1, 2]
    assert [round(o.periods if hasattr(o, "periods") else o.sequence.span) for o in bf.switch_branch(second)] == [1]
    again = bf.trace(bf.switch_branch(second)[0], "omega", bounds=(0.5, 2.0))
    assert_points(again, DEFAULT, 1e-12)


def test_the_two_period_branch_from_the_first_grazing(default_branch):
    """1-impact 2-period orbits with a fold and a grazing, then two impacts with a flip, up to the flip of the parent."""
    first = min(default_branch.special_points.of("grazing"), key=lambda p: p.parameter)
    (start,) = [o for o in bf.switch_branch(first) if round(o.periods if hasattr(o, "periods") else o.sequence.span) == 2]
    branch = bf.trace(start, "omega", bounds=(0.5, 2.0))
    want = [("grazing", digits.DEFAULT_GRAZINGS[0]), ("fold", digits.TWO_PERIOD_FOLD), ("grazing", digits.TWO_PERIOD_GRAZING),
            ("period_doubling", digits.TWO_PERIOD_FLIP), ("period_doubling", digits.DEFAULT_FLIPS[0])]
    assert_points(branch, want, 1e-11)


def test_flips_hand_out_the_doubled_orbit(default_branch):
    """Each doubled orbit is a motion of twice the period, near its parent, on the side where it exists."""
    for point in default_branch.special_points.of("period_doubling"):
        starts = bf.switch_branch(point)
        assert len(starts) == 1, starts
        branch = bf.trace(starts[0], "omega", bounds=(point.parameter - 0.004, point.parameter + 0.004))
        orbit = branch.orbits[len(branch) // 2]
        assert orbit.success and orbit.periods == 2 and len(orbit.events) == 2
        assert {p.kind for p in branch.special_points} <= {"period_doubling", "grazing", "fold"}


@pytest.mark.parametrize("index", [1, 2])
def test_the_bubble_of_doubled_orbits_between_two_flips(default_branch, index):
    """From either flip the same branch of 2-period orbits: two folds, two grazings, merging in both flips."""
    flips = sorted(default_branch.special_points.of("period_doubling"), key=lambda p: p.parameter)
    branch = bf.trace(bf.switch_branch(flips[index])[0], "omega", bounds=(0.5, 2.0))
    want = [*digits.BUBBLE, ("period_doubling", digits.DEFAULT_FLIPS[1]), ("period_doubling", digits.DEFAULT_FLIPS[2])]
    assert_points(branch, want, 1e-12)
    assert all(branch.orbits[i].periods == 2 for i in range(3, len(branch) - 3, 6))


@pytest.mark.parametrize("seed", range(12))
def test_random_branches_from_free_through_impacting_to_free(seed):
    """Systems that nobody tuned for: every fold and flip that a fine scan of the closed form finds, and both grazings."""
    rng = np.random.default_rng(77 + seed)
    zeta, r, gap = (float(rng.uniform(*pair)) for pair in ((0.02, 0.2), (0.2, 0.9), (0.5, 1.5)))
    force = float(gap * rng.uniform(2.5 * zeta, 0.95))
    grazings = one_stop.grazing_frequencies(zeta, force, gap)
    start = 0.6 * float(grazings[0])
    want = [("grazing", w) for w in grazings]
    for kind, omega, speed in one_stop.branch_points_by_scan(zeta, force, gap, r, 1, start, 3.0):
        want.append((kind, one_stop.special_frequency(kind, zeta, force, gap, r, 1, omega, speed)[0]))
    system = bf.systems.impact_oscillator(zeta=zeta, restitution=r, gap=gap, amplitude=force, omega=start)
    assert_points(bf.trace(free_start(system, zeta, start, force), "omega", bounds=(start, 3.0)), want, 1e-11)


# zeta, omega, gap, restitution, n, start force, bounds: branches in the load
FORCE_BRANCHES = [
    (0.05, 1.5, 1.0, 0.7, 1, 0.9, (0.2, 1.25)), (0.05, 2.5, 1.0, 0.7, 1, 11.0, (6.0, 14.0)),
    (0.05, 2.5, 1.0, 0.7, 2, 2.0, (0.5, 2.6)), (0.02, 2.8, 1.0, 0.8, 2, 2.0, (0.3, 4.0)),
    (0.05, 0.8, 1.0, 0.7, 1, 0.45, (0.38, 0.6)), (0.1, 0.7, 1.0, 0.6, 1, 0.535, (0.5295, 0.56)),
    (0.1, 0.7, 1.0, 0.6, 2, 0.5224, (0.5, 0.5235)),
]


@pytest.mark.parametrize("ds_max", [0.05, 0.2, 1.0])
@pytest.mark.parametrize("case", FORCE_BRANCHES, ids=str)
def test_folds_and_flips_in_the_load(case, ds_max):
    """The closed-form fold and flip of the n-1 branch, located to 1e-11, at any step; grazings are those of the arc."""
    zeta, omega, gap, r, n, force, bounds = case
    system = bf.systems.impact_oscillator(zeta=zeta, omega=omega, amplitude=force, gap=gap, restitution=r)
    reference = [o for o in one_stop.orbits(zeta, omega, force, gap, r, n) if o.admissible][-1]
    branch = bf.trace(bf.find_orbit(system, reference_start(reference), periods=n), "amplitude", bounds=bounds,
                      ds_max=ds_max)
    special = one_stop.special_forces(zeta, omega, gap, r, n)
    for kind in ("fold", "period_doubling"):
        value, speed = special[kind]
        inside = speed > 0 and bounds[0] < value < bounds[1]
        found = [p for p in branch.special_points.of(kind) if f"impact / {n} T" in p.before]
        assert len(found) == (1 if inside else 0), branch.special_points
        if inside:
            assert abs(found[0].parameter - float(value)) < min(1e-11 * float(value), found[0].error + 4e-16)
            assert found[0].reverses is (kind == "fold")


@pytest.mark.parametrize("seed", range(6))
def test_random_branches_in_the_load(seed):
    """Parameters that nobody tuned for: every admissible fold and flip of the 1-1 and 2-1 branches in reach."""
    rng = np.random.default_rng(1983 + seed)
    while True:
        zeta, omega, r = rng.uniform(0.01, 0.3), rng.uniform(0.5, 3.5), rng.uniform(0.1, 0.95)
        gap, n = rng.uniform(0.2, 2.0), int(rng.integers(1, 3))
        special = one_stop.special_forces(zeta, omega, gap, r, n)
        points = []
        for kind, (force, speed) in special.items():
            if speed <= 0.05:
                continue
            near = [o for o in one_stop.orbits(zeta, omega, force * (1 + 1e-9 if kind == "fold" else 1), gap, r, n)
                    if abs(o.speed - speed) < 1e-3 and o.admissible and o.margin > 1e-3]
            if near:
                points.append((kind, float(force), near[0]))
        if points:
            break
    for kind, force, near in points:
        start = force * (1.02 if kind == "fold" else 1.0 + 1e-3 * (1 if rng.random() < 0.5 else -1))
        every = [o for o in one_stop.orbits(zeta, omega, start, gap, r, n) if o.admissible]
        if not every:
            continue
        orbit = min(every, key=lambda o: abs(o.speed - near.speed))
        system = bf.systems.impact_oscillator(zeta=zeta, omega=omega, amplitude=start, gap=gap, restitution=r)
        branch = bf.trace(bf.find_orbit(system, reference_start(orbit), periods=n), "amplitude",
                          bounds=(0.97 * force, 1.03 * force))
        found = [p for p in branch.special_points.of(kind) if abs(p.parameter - force) < 1e-3 * force]
        assert len(found) == 1, (kind, force, branch.special_points)
        assert abs(found[0].parameter - force) <= found[0].error + 4e-16 * force
        assert abs(found[0].parameter - force) < 1e-11 * force


@pytest.mark.parametrize("zeta, force, gap", [(0.05, 0.52, 1.0), (0.01, 0.3, 1.0), (0.2, 1.9, 2.0), (0.3, 0.7, 1.0),
                                              (1e-3, 0.05, 0.7), (0.05, 52.0, 100.0)])
def test_grazings_of_the_free_response(zeta, force, gap):
    """1e-12 relative, both sides of the resonance."""
    low, high = (float(w) for w in one_stop.grazing_frequencies(zeta, force, gap))
    system = bf.systems.impact_oscillator(zeta=zeta, amplitude=force, gap=gap, omega=0.8 * low)
    branch = bf.trace(free_start(system, zeta, 0.8 * low, force), "omega",
                      bounds=(0.7 * low, low + 0.02 * (high - low)), direction=1)
    point = branch.special_points.of("grazing")[0]
    assert abs(point.parameter - low) < 1e-12 * low
    assert abs(point.parameter - low) <= point.error + 4e-16 * low
    system = system.with_parameters(omega=1.3 * high)
    branch = bf.trace(free_start(system, zeta, 1.3 * high, force), "omega",
                      bounds=(high - 0.02 * (high - low), 1.4 * high), direction=-1)
    point = min(branch.special_points.of("grazing"), key=lambda p: abs(p.parameter - high))
    assert abs(point.parameter - high) < 1e-12 * high


@pytest.mark.parametrize("zeta, omega, gap", [(0.05, 1.5, 1.0), (0.1, 0.7, 0.3), (0.02, 3.0, 2.0), (1.25, 2.0, 1.0),
                                              (0.0, 0.45, 1.0), (0.3, 5.0, 1e-3)])
def test_grazing_load(zeta, omega, gap):
    value = float(one_stop.grazing_force(zeta, omega, gap))
    system = bf.systems.impact_oscillator(zeta=zeta, omega=omega, amplitude=0.7 * value, gap=gap)
    branch = bf.trace(free_start(system, zeta, omega, 0.7 * value), "amplitude", bounds=(0.5 * value, 1.02 * value), direction=1)
    point = branch.special_points.of("grazing")[0]
    assert abs(point.parameter - value) < 1e-12 * value
    assert abs(point.parameter - value) <= point.error + 4e-16 * value


@pytest.mark.parametrize("omega, n, impacting", [(1.5, 1, -1), (0.8, 1, 1), (2.5, 1, 1), (2.5, 2, -1)])
def test_side_on_which_the_impacting_orbit_is_born(omega, n, impacting):
    """e12(nT) > 0: beyond the grazing load; e12(nT) < 0: before it (nonsmooth fold)."""
    value = float(one_stop.grazing_force(0.05, omega, 1.0))
    e12 = Oscillator(0.05, omega, 1).homogeneous(n * Oscillator(0.05, omega, 1).period)[1]
    assert (e12 > 0) is (impacting > 0)
    system = bf.systems.impact_oscillator(zeta=0.05, omega=omega, amplitude=0.9 * value, gap=1.0, restitution=0.7)
    branch = bf.trace(free_start(system, 0.05, omega, 0.9 * value), "amplitude", bounds=(0.8 * value, 1.001 * value),
                      direction=1)
    point = branch.special_points.of("grazing")[0]
    starts = [o for o in bf.switch_branch(point) if round(o.sequence.span) == n]
    assert len(starts) == 1
    problem_value = starts[0].x0[-1] if hasattr(starts[0], "x0") else starts[0].system.parameter("amplitude")
    assert np.sign(problem_value - value) == impacting


# zeta, omega, restitution, n, start force (on the upper branch), bounds
SYMMETRIC = [(0.1, 2.0, 0.7, 1, 2.0, (0.5, 3.6)), (0.02, 1.6, 0.8, 1, 1.0, (0.12, 2.3)), (0.1, 4.0, 0.7, 3, 2.2, (1.8, 2.45))]


@pytest.mark.parametrize("closure", [1, -1])
@pytest.mark.parametrize("case", SYMMETRIC, ids=str)
def test_pitchforks_between_two_stops(case, closure):
    """Fold and symmetry breaking in closed form, on the half and on the full period; both mirror orbits handed out."""
    zeta, omega, r, n, force, bounds = case
    system = bf.systems.two_sided_impact_oscillator(zeta=zeta, omega=omega, amplitude=force, gap=1.0, restitution=r)
    reference = [o for o in two_stops.orbits(zeta, omega, force, 1, r, n) if o.admissible][-1]
    motion = reference.motion
    half = n * motion.period / 2
    t = reference.time % (2 * half)
    if t < half:
        y = motion.flow(t + half, -reference.gap, reference.restitution * reference.speed, 2 * half)
    else:
        y = motion.flow(t, reference.gap, -reference.restitution * reference.speed, 2 * half)
    orbit = bf.find_orbit(system, tuple(float(z) for z in y), periods=n, closure=closure)
    assert orbit.success and orbit.closure == closure
    branch = bf.trace(orbit, "amplitude", bounds=bounds)
    special = two_stops.special_forces(zeta, omega, 1, r, n)
    for kind in ("fold", "branch_point"):
        value = float(special[kind][0])
        found = [p for p in branch.special_points.of(kind) if abs(p.parameter - value) < 1e-6 * value]
        assert len(found) == 1, branch.special_points
        assert abs(found[0].parameter - value) < 1e-11 * value
        assert abs(found[0].parameter - value) <= found[0].error + 4e-16 * value
    assert not branch.special_points.of("period_doubling")
    (point,) = branch.special_points.of("branch_point")
    starts = bf.switch_branch(point)
    assert len(starts) == 2, starts
    speeds = []
    for start in starts:
        side = bf.trace(start, "amplitude", bounds=(point.parameter * 0.999, point.parameter * 1.01), max_steps=12)
        far = int(np.argmax(np.abs(side.column("amplitude") - point.parameter)))
        assert side.orbits[far].success
        speeds.append(sorted(e.speed for e in side.orbits[far].events))
    assert all(abs(v[0] - v[1]) > 1e-4 for v in speeds)


def test_torus_points_of_the_chain():
    """Eight masses: Neimark-Sacker at .36805 and .42718 on the upper branch, below grazing at .374144."""
    system = bf.systems.impact_chain(amplitude=0.45)
    scene = chain.spring_chain(8, 0.3, 0.45, 0.7)
    reference = scene.orbits(samples=200)[-1]
    y = scene.at_phase_zero(reference)
    branch = bf.trace(bf.find_orbit(system, y, periods=1), "amplitude", bounds=(0.3672, 0.46))
    found = [p.parameter for p in branch.special_points.of("neimark_sacker") if p.before.count("impact") == 1]
    upper = [v for v in digits.CHAIN_TORUS]
    for value in upper:
        assert min(abs(p - value) for p in found) < 1e-11, branch.special_points


@pytest.mark.parametrize("ds_max", [0.02, 0.05, 0.1, 0.2, 0.5, 1.0])
def test_bilinear_branch_at_any_step(ds_max):
    """Two folds, two flips, two grazings, each to 1e-11, none invented."""
    system = bf.systems.bilinear_oscillator(**digits.BILINEAR, omega=0.5)
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(0.5, 2.5), ds_max=ds_max)
    want = [*(("grazing", w) for w in digits.BILINEAR_GRAZINGS), *(("period_doubling", w) for w in digits.BILINEAR_FLIPS),
            *(("fold", w) for w in digits.BILINEAR_FOLDS)]
    assert_points(branch, want, 1e-11)


@pytest.mark.parametrize("start", [0.9, 1.8, 2.5])
def test_bilinear_branch_from_other_starts(start):
    """From anywhere on it the same six points."""
    system = bf.systems.bilinear_oscillator(**digits.BILINEAR, omega=start)
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(2.5, 0.5))
    want = [*(("grazing", w) for w in digits.BILINEAR_GRAZINGS), *(("period_doubling", w) for w in digits.BILINEAR_FLIPS),
            *(("fold", w) for w in digits.BILINEAR_FOLDS)]
    assert_points(branch, want, 1e-11)


@pytest.mark.parametrize("ds_max", [0.05, 0.2, 0.5])
def test_duffing_folds(ds_max):
    """Both folds to 5e-9 (harmonic balance of 9 and 13 odd harmonics agrees in 20 digits)."""
    system = bf.systems.duffing_oscillator(zeta=0.05, amplitude=0.3, omega=0.5)
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(0.5, 2.5), ds_max=ds_max)
    assert [str(p.kind) for p in branch.special_points] == ["fold", "fold"]
    for point, value in zip(sorted(branch.special_points, key=lambda p: p.parameter), digits.DUFFING_FOLDS, strict=True):
        assert abs(point.parameter - value) < 5e-11


@pytest.mark.parametrize("r, n", [(0.5, 1), (0.8, 1), (0.8, 2)])
def test_ball_is_born_in_a_fold_and_flips(r, n):
    special = {kind: float(a) for kind, a in ball.special_amplitudes(1, r, 1, n).items()}
    amplitude = 0.5 * (special["fold"] + special["period_doubling"])
    reference = ball.orbits(1, amplitude, r, 1, n)[0]
    t, u = float(reference.time), float(reference.take_off)
    s = 2 * np.pi * n - t
    y = (amplitude * np.cos(t) + u * s - s * s / 2, u - s)
    system = bf.systems.bouncing_ball(omega=1.0, amplitude=amplitude, restitution=r)
    branch = bf.trace(bf.find_orbit(system, y, periods=n), "amplitude",
                      bounds=(0.9 * special["fold"], 1.05 * special["period_doubling"]))
    assert_points(branch, [(kind, value) for kind, value in special.items()], 1e-11)


def test_moving_frame_grazes_where_its_load_says():
    """X0 omega^2 / |1 - omega^2 + 2 i zeta omega| = gap."""
    system = bf.systems.moving_frame_impact_oscillator(zeta=0.05, omega=0.5, amplitude=0.4, gap=1.0)
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(0.5, 0.9), direction=1)
    w = branch.special_points.of("grazing")[0].parameter
    assert abs(0.4 * w**2 / abs(complex(1 - w**2, 0.1 * w)) - 1.0) < 1e-13


def test_mirrored_system_has_the_same_branch():
    system = bf.System(1.0, 0.1, 1.0, (HarmonicForce(-0.52), RigidStop(1.0, 0.7, side=-1)), omega=0.5)
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(0.5, 2.0))
    assert_points(branch, DEFAULT, 1e-12)


@pytest.mark.parametrize("length, time", [(1e5, 1.0), (1e-5, 1.0), (1.0, 1e3), (2e-3, 1e-3)])
def test_units_do_not_move_special_points(length, time):
    system = bf.System(1.0, 0.1 / time, 1.0 / time**2,
                       (HarmonicForce(0.52 * length / time**2), RigidStop(length, 0.7)), omega=0.5 / time)
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(0.5 / time, 2.0 / time))
    assert [str(p.kind) for p in branch.special_points] == [kind for kind, _ in DEFAULT]
    for point, (_, value) in zip(branch.special_points, DEFAULT, strict=True):
        assert abs(point.parameter * time - value) < 1e-11


def test_reversed_bounds_and_other_ends_give_the_same_points(default_branch):
    """Traced from the other end, with the bounds swapped."""
    branch = bf.trace(bf.find_orbit(bf.systems.impact_oscillator(omega=2.0)), "omega", bounds=(2.0, 0.5))
    assert_points(branch, DEFAULT, 1e-12)
    got = sorted(p.parameter for p in branch.special_points)
    assert np.allclose(got, sorted(p.parameter for p in default_branch.special_points), rtol=0, atol=3e-14)


def test_an_impact_branch_is_saved_and_extended_bit_for_bit(default_branch, tmp_path):
    """Loaded from its file it has the same columns and points; extended, it is the branch traced at once."""
    default_branch.save(tmp_path / "branch.npz")
    again = bf.load(tmp_path / "branch.npz")
    for name in ("omega", "s", "max_0", "n_events"):
        assert np.array_equal(again.column(name), default_branch.column(name))
    assert [(p.kind, p.parameter, p.error) for p in again.special_points] == \
        [(p.kind, p.parameter, p.error) for p in default_branch.special_points]
    both = [branch.extend(bounds=(0.5, 2.5)) for branch in (default_branch, again)]
    assert np.array_equal(both[0].column("omega"), both[1].column("omega"))
    assert both[0].column("omega").max() == 2.5


def test_branches_that_meet_in_the_touch_of_an_orbit_of_half_the_period_end_there():
    """At the grazing of an orbit of two forcing periods three branches of four begin, with an impact more in one of its two turns:
    none of them is how another one goes on.  Traced from both of its ends the branch has the same special points; its end, in
    coordinates from the equations' own clock, repeats after two periods, and simulation from there does."""
    system = bf.System(1.0, 0.292, 1.0, [HarmonicForce(0.405), RigidStop(-0.2, 0.925)], omega=1.94)
    name, bounds = "rigid_stop.gap", (-0.28, -0.12)
    branch = bf.trace(bf.find_orbit(system), name, bounds=bounds)
    found = [branch, *(bf.trace(branch.orbits[k], name, bounds=bounds) for k in (2, -3))]
    for one in found:
        assert one.audit.ok and [str(end.reason) for end in one.ends] == ["merged", "merged"]
        assert sorted(p.kind.value for p in one.special_points) == sorted(p.kind.value for p in branch.special_points)
        ordered = (sorted(points, key=lambda p: p.parameter) for points in (one.special_points, branch.special_points))
        for a, b in zip(*ordered, strict=True):
            assert abs(a.parameter - b.parameter) <= a.error + b.error
    for row, repeats in ((-1, True), (-4, False)):
        orbit = branch.orbits[row]
        middle = bf.simulate(orbit.system, orbit.state, periods=2).final
        assert bool(np.abs(middle - orbit.state).max() < 1e-4) is repeats


@pytest.mark.parametrize(("force", "gap"), [(1.0, 1.0), (0.3, 0.5)])
def test_a_branch_from_a_plastic_impact_is_that_of_any_restitution(force, gap):
    """At undamped resonance the stop is hit with pi F/(1 + r), and both multipliers are -r; the equations are those of a start
    elsewhere, although the speed after the impact vanishes at r = 0 only."""
    def orbit_of(r):
        system = bf.systems.impact_oscillator(zeta=0.0, omega=1.0, amplitude=force, gap=gap, restitution=r)
        return bf.find_orbit(system, (gap, -r * np.pi * force / (1.0 + r)), periods=1)
    branches = [bf.trace(orbit_of(r), "restitution", bounds=(0.0, 0.5)) for r in (0.0, 0.3)]
    for branch in branches:
        r = branch.column("restitution")
        assert {r[0], r[-1]} == {0.0, 0.5} and not branch.special_points
        for orbit, value in zip(branch.orbits, r, strict=True):
            (impact,) = orbit.events
            assert impact.speed == pytest.approx(np.pi * force / (1.0 + value), rel=1e-12)
            assert np.abs(orbit.multipliers + value).max() < 1e-7  # a double one
    first, second = (branch.problems[0] for branch in branches)
    np.testing.assert_array_equal(first.sequence.nodes, second.sequence.nodes)
    u = np.append(second.x0[:-1], 0.3)
    np.testing.assert_allclose(first.residual(u[:-1], 0.3), second.residual(u[:-1], 0.3), atol=1e-12)


def test_a_branch_of_tripled_period_ends_on_both_sides_where_its_parent_grazes_and_its_slider_turns():
    """Contact and the turn of a slider are one instant of the parent: an interval between them holds nothing."""
    def scene(gap):
        return bf.System(1.0, 0.0918, 1.0, [HarmonicForce(1.13), RigidStop(gap, 0.275), Jenkins(1.15, 0.212)], omega=2.53)
    (touch,) = bf.trace(bf.find_orbit(scene(0.29)), "rigid_stop.gap", bounds=(0.21, 0.3)).special_points
    orbit = bf.find_orbit(scene(0.218))
    branch = bf.trace(orbit, "rigid_stop.gap", bounds=(0.1308, 0.3052))
    assert orbit.periods == 6 and [str(end.reason) for end in branch.ends] == ["merged", "merged"]
    assert all(abs(end.p - touch.parameter) <= 1e-9 for end in branch.ends)
    inside = branch.special_points[1:-1]
    assert all(point.parameter < touch.parameter for point in inside) and "period_doubling" in [str(p.kind) for p in inside]
