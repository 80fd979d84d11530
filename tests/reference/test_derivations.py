"""The references themselves: against printed numbers, against differencing, against their stored digits."""
import pytest
from mpmath import mp, mpf, workdps

from tests.reference import ball, bilinear, chain, chain_stick, chatter, digits, duffing, one_stop, two_stops
from tests.reference.oscillator import Oscillator


def close(value, printed, relative=1e-15):
    return abs(mpf(value) - mpf(printed)) <= mpf(relative) * max(1, abs(mpf(printed)))


# case (zeta, omega, gap, restitution, n), grazing force, fold (force, speed), flip (force, speed); None: not printed
PRINTED = [
    ((".05", "2.5", 1, ".7", 1), "5.25594901", None, ("12.69994292", "5.00200990")),
    ((".05", "2.5", 1, ".7", 2), None, ("0.933016895", ".870175995"), ("2.273541706", None)),
    ((".05", "1.5", 1, ".7", 1), "1.258967831", (".471371390", "1.786254683"), None),
    ((".05", ".8", 1, ".7", 1), ".368781778", None, (".512672682", None)),
    ((".02", "2.8", 1, ".8", 2), None, (".613399844", None), ("3.542828065", None)),
    ((".1", ".7", 1, ".6", 1), None, None, (".538908338", None)),
    ((".1", ".7", 1, ".6", 2), None, (".522140724", None), None),
]


@pytest.mark.parametrize("case, grazing, fold, flip", PRINTED)
def test_one_stop_folds_and_flips_are_those_printed(case, grazing, fold, flip):
    zeta, omega, gap, r, n = case
    found = one_stop.special_forces(zeta, omega, gap, r, n)
    if grazing:
        assert close(one_stop.grazing_force(zeta, omega, gap), grazing, 1e-8)
    for printed, kind in ((fold, "fold"), (flip, "period_doubling")):
        if printed:
            assert close(found[kind][0], printed[0], 3e-9)
            assert printed[1] is None or close(found[kind][1], printed[1], 3e-9)


def test_formal_points_are_not_admissible():
    for n, kind in ((2, "period_doubling"), (3, "fold")):
        force, speed = one_stop.special_forces(".05", "1.5", 1, ".7", n)[kind]
        found = [o for o in one_stop.orbits(".05", "1.5", force * (1 + mpf(10) ** -12), 1, ".7", n)
                 if abs(o.speed - speed) < mpf(10) ** -3]
        assert found and not any(o.admissible for o in found)


@pytest.mark.parametrize("case", [(".05", "1.5", ".9", 1, ".7", 1), (".05", "2.5", 2, 1, ".7", 2),
                                  (".1", "2.5", 1, "-.2", ".8", 1), ("0", "2.6", 1, 0, ".8", 1)])
def test_one_stop_orbit_closes_and_its_multipliers_are_those_of_the_map(case):
    zeta, omega, force, gap, r, n = case
    orbit = [o for o in one_stop.orbits(zeta, omega, force, gap, r, n) if o.admissible][-1]
    motion, span = orbit.motion, n * Oscillator(zeta, omega, 1).period
    start = orbit.time + span / 3
    x, v = motion.flow(orbit.time, orbit.gap, -orbit.restitution * orbit.speed, start)
    end, events = one_stop.simulate(motion, orbit.gap, orbit.restitution, start, x, v, start + span)
    assert len(events) == 1
    assert abs(end[0] - x) + abs(end[1] - v) < mpf(10) ** -33
    m = one_stop.differenced_monodromy(motion, orbit.gap, orbit.restitution, (start, x, v), span)
    got = one_stop.roots_of(m[0, 0] + m[1, 1], m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0])
    assert all(abs(a - b) < mpf(10) ** -18 for a, b in zip(got, orbit.multipliers, strict=True))


def test_points_of_the_default_branch():
    low, high = one_stop.grazing_frequencies(".05", ".52", 1)
    assert close(low, digits.DEFAULT_GRAZINGS[0]) and close(high, digits.DEFAULT_GRAZINGS[1])
    flips = zip(digits.DEFAULT_FLIPS, digits.DEFAULT_FLIP_SPEEDS, strict=True)
    for omega, speed in flips:
        w, v = one_stop.special_frequency("period_doubling", ".05", ".52", 1, ".7", 1, omega, speed)
        assert close(w, omega) and close(v, speed)
    w, v = one_stop.special_frequency("fold", ".05", ".52", 1, ".7", 1, digits.DEFAULT_FOLD, digits.DEFAULT_FOLD_SPEED)
    assert close(w, digits.DEFAULT_FOLD) and close(v, digits.DEFAULT_FOLD_SPEED)


@pytest.mark.slow
def test_the_default_branch_has_no_other_admissible_points():
    every = [[row for row in one_stop.special_frequencies(".05", ".52", 1, ".7", n) if row[3]] for n in (1, 2, 3)]
    assert [row[0] for row in every[0]] == ["period_doubling"] * 3 + ["fold"]
    ((kind, omega, *_),) = every[1]  # of the orbits with one impact in two periods
    assert kind == "fold" and close(omega, digits.TWO_PERIOD_FOLD)
    assert not every[2]


def test_resonant_grazing_unfolds_quadratically():
    """Fold and flip curves touch the grazing curve at omega = 2 n wd/k with the printed coefficients."""
    wd = mp.sqrt(1 - mpf(".05") ** 2)
    wc = 2 * wd
    assert close(wc, "1.9974984", 1e-7)
    for kind, side, coefficient in (("fold", -1, "18.79451"), ("period_doubling", 1, "2.452072")):
        d = mpf(10) ** -6
        force, speed = one_stop.special_forces(".05", wc + side * d, 1, ".7", 1)[kind]
        assert speed > 0
        sign = 1 if kind == "fold" else -1
        assert close(sign * (1 - force / one_stop.grazing_force(".05", wc + side * d, 1)) / d**2, coefficient, 2e-5)


@pytest.mark.parametrize("case, fold, pitchfork", [
    ((".1", 2, ".7", 1), (".644767916", "1.140095"), ("3.397988672", "2.426384")),
    ((".02", "1.6", ".8", 1), (".133057546", ".738115"), ("2.098737110", "1.731918")),
    ((".1", 4, ".7", 3), ("1.905451407", ".529949"), ("2.404131140", ".582089"))])
def test_two_stops_fold_and_pitchfork_are_those_printed(case, fold, pitchfork):
    zeta, omega, r, n = case
    found = two_stops.special_forces(zeta, omega, 1, r, n)
    for kind, printed in (("fold", fold), ("branch_point", pitchfork)):
        assert close(found[kind][0], printed[0], 1e-9) and close(found[kind][1], printed[1], 1e-6)
        target = 1 if kind == "fold" else -1
        force = found[kind][0] * (1 + (mpf(10) ** -14 if kind == "fold" else 0))
        assert any(min(abs(m - target) for m in o.half_multipliers) < 1e-5 and o.admissible
                   for o in two_stops.orbits(zeta, omega, force, 1, r, n))


def test_asymmetric_orbit_flips():
    force = two_stops.asymmetric_flip(".1", 4, 1, ".7", 3, digits.ASYMMETRIC_FLIP, digits.ASYMMETRIC_FLIP_ORBIT)
    assert close(force, digits.ASYMMETRIC_FLIP)
    solution, multipliers = two_stops.asymmetric_orbit(".1", 4, force, 1, ".7", 3, digits.ASYMMETRIC_FLIP_ORBIT)
    assert all(close(a, b) for a, b in zip(solution, digits.ASYMMETRIC_FLIP_ORBIT, strict=True))
    assert abs(multipliers[0] + 1) < mpf(10) ** -20


def test_doubled_orbit_and_its_flip():
    motion = Oscillator(".05", "2.5", "12.6")
    times, speeds = one_stop.several_impacts(motion, mpf(1), mpf(".7"), 2, *digits.DOUBLED)
    assert all(close(a, b) for a, b in zip(times + speeds, digits.DOUBLED[0] + digits.DOUBLED[1], strict=True))
    motion = Oscillator(".05", "2.5", mpf(digits.SECOND_FLIP))
    times, speeds = one_stop.several_impacts(motion, mpf(1), mpf(".7"), 2, *digits.SECOND_FLIP_ORBIT)
    assert abs(one_stop.product_multipliers(motion, mpf(1), mpf(".7"), 2, times, speeds)[0] + 1) < 1e-13


def test_grazings_of_the_bilinear_branch():
    found = one_stop.grazing_frequencies(".05", ".3", ".5")
    assert all(close(a, b) for a, b in zip(found, digits.BILINEAR_GRAZINGS, strict=True))


@pytest.mark.parametrize("kind, index", [("fold", 0), ("fold", 1), ("period_doubling", 0), ("period_doubling", 1)])
def test_folds_and_flips_of_the_bilinear_branch(kind, index):
    omegas, orbits = ((digits.BILINEAR_FOLDS, digits.BILINEAR_FOLD_ORBITS) if kind == "fold" else
                      (digits.BILINEAR_FLIPS, digits.BILINEAR_FLIP_ORBITS))
    omega, orbit = bilinear.special_point(kind, ".05", ".3", ".5", 5, orbits[index])
    assert close(omega, omegas[index])
    assert all(close(a, b) for a, b in zip(orbit, orbits[index][1:], strict=True))
    assert bilinear.orbit(".05", omega, ".3", ".5", 5, orbit).admissible


@pytest.mark.slow
@pytest.mark.parametrize("count", [9, 13])
@pytest.mark.parametrize("index", [0, 1])
def test_duffing_folds_do_not_move_with_the_number_of_harmonics(index, count):
    with workdps(20):
        start = digits.DUFFING_FOLDS[index], digits.DUFFING_FOLD_STARTS[index]
        omega, _ = duffing.fold(".05", ".3", 1, 1, *start, count)
    assert close(omega, digits.DUFFING_FOLDS[index])


def test_chain_grazes_where_stored():
    assert close(chain.spring_chain(8, ".3", 1, ".7").grazing_scale(), digits.CHAIN_GRAZING)


@pytest.mark.slow
def test_chain_torus_points():
    with workdps(30):
        found = chain.torus_loads(8, ".3", ".7", [".36805", ".42718"])
        for force, stored, speed in zip(found, digits.CHAIN_TORUS, digits.CHAIN_TORUS_SPEEDS, strict=True):
            orbit = chain.spring_chain(8, ".3", force, ".7").orbits()[-1]
            assert close(force, stored) and close(orbit.speed, speed) and orbit.admissible


def test_ball_multipliers_are_those_of_the_bounce_map():
    """Differences of the exact map (time, take-off velocity) agree with the closed-form trace and determinant."""
    w, a, r, g = mpf(2), mpf(".6"), mpf(".6"), mpf(1)
    orbit = ball.orbits(w, a, r, g)[0]

    def bounce(t, v):
        def above(s):
            return a * mp.cos(w * t) + v * s - g * s**2 / 2 - a * mp.cos(w * (t + s))

        s = mp.findroot(above, 2 * mp.pi / w)
        return t + s - 2 * mp.pi / w, -r * (v - g * s) - (1 + r) * a * w * mp.sin(w * (t + s))

    t, v = bounce(orbit.time, orbit.take_off)
    assert abs(t - orbit.time) + abs(v - orbit.take_off) < mpf(10) ** -35
    h = mpf(10) ** -13
    rows = [[(p - q) / (2 * h) for p, q in zip(bounce(orbit.time + dt, orbit.take_off + dv),
                                               bounce(orbit.time - dt, orbit.take_off - dv), strict=True)]
            for dt, dv in ((h, 0), (0, h))]
    trace, det = rows[0][0] + rows[1][1], rows[0][0] * rows[1][1] - rows[0][1] * rows[1][0]
    got = one_stop.roots_of(trace, det)
    assert all(abs(p - q) < mpf(10) ** -18 for p, q in zip(got, orbit.multipliers, strict=True))
    special = ball.special_amplitudes(w, r, g)
    assert abs(ball.orbits(w, special["period_doubling"], r, g)[0].multipliers[0] + 1) < mpf(10) ** -30


@pytest.mark.parametrize("case", digits.STICKING[2:4])
def test_end_of_chatter_and_release(case):
    check_sticking(case)


@pytest.mark.slow
@pytest.mark.parametrize("case", digits.STICKING)
def test_end_of_chatter_and_release_all(case):
    check_sticking(case)


def check_sticking(case):
    zeta, omega, force, gap, r, begin, end = case
    with workdps(30):
        periods, rest = chatter.sticking_orbit(str(zeta), str(omega), str(force), str(gap), str(r), 6)
    assert periods == 1 and close(rest.begin, begin) and close(rest.end, end)


@pytest.mark.parametrize("t, r, printed", [(-5, ".3", ".3032478"), (-5, ".7", "8.9888637"), (0, ".3", ".0122449"),
                                           (0, ".7", ".3629630")])
def test_chatter_closes_to_second_order(t, r, printed):
    """First-order closure leaves C v^2 with the printed C; the second term leaves O(v^3): both measured."""
    motion, r = Oscillator(".05", ".2", 1), mpf(r)
    with workdps(30):
        errors = []
        for v in (mpf(10) ** -4, mpf(10) ** -5):
            rest, *_ = chatter.flight_and_chatter(motion, 0, r, mpf(t), mpf(0), -r * v, mpf(t) + 30, True)
            first = 2 * r * v / (motion.load(mpf(t))[0] * (1 - r))
            errors.append((t + first - rest.begin, t + chatter.remaining(motion, mpf(0), r, mpf(t), v) - rest.begin, v))
        first, second, v = errors[1]
        assert close(first / v**2, printed, 2e-3)
        order = mp.log10(abs(errors[0][1] / errors[1][1]))
        assert abs(order - 3) < 0.05


@pytest.mark.slow
@pytest.mark.parametrize("restitution", [0.0, 0.3])
def test_two_masses_of_which_one_sticks(restitution):
    release, first, rest, q2, v2, multiplier = digits.TWO_MASS_STICKING[restitution]
    with workdps(30):
        scene = chain_stick.two_mass(str(restitution))
        start = mp.matrix([mpf(".3"), q2, 0, v2])
        orbit = scene.orbit(mpf(release), start, rounds=1)
    assert close(orbit.release, release) and close(orbit.first_impact, first) and close(orbit.rest, rest)
    assert close(orbit.state[1], q2) and close(orbit.state[3], v2)
    assert abs(orbit.multipliers[0] - multiplier) < 1e-9


@pytest.mark.parametrize("psi", ["1e-4", "1e-6", "1e-8"])
def test_square_root_of_the_zero_time_map(psi):
    """A free arc with apex psi beyond the stop ends, at the apex time, at v = -(1 + r) sqrt(2 |A| psi) + O(psi) and
    x - gap = -(1 + 2 r) psi + O(psi^1.5)."""
    motion, r, gap, psi = Oscillator(".05", "1.5", "1.3"), mpf(".7"), mpf(1), mpf(psi)
    apex = -mp.arg(motion.receptance) / motion.omega
    before = apex - motion.period / 8
    start = motion.flow(apex, gap + psi, mpf(0), before)
    (x, v), events = one_stop.simulate(motion, gap, r, before, *start, apex)
    assert len(events) == 1
    acceleration = abs(motion.acceleration(apex, gap, 0))
    assert abs(v + (1 + r) * mp.sqrt(2 * acceleration * psi)) < 20 * psi
    assert abs((x - gap) / psi + 1 + 2 * r) < 60 * mp.sqrt(psi)


@pytest.mark.parametrize("point", [0, 2, 5, pytest.param(1, marks=pytest.mark.slow), pytest.param(3, marks=pytest.mark.slow),
                                   pytest.param(4, marks=pytest.mark.slow), pytest.param(6, marks=pytest.mark.slow),
                                   pytest.param(7, marks=pytest.mark.slow), pytest.param(8, marks=pytest.mark.slow),
                                   pytest.param(9, marks=pytest.mark.slow)])
def test_points_of_the_stiff_bilinear_branch(point):
    kind, omega, contacts = digits.STIFF_POINTS[point]
    found, orbit = bilinear.special_point(kind, ".05", ".3", ".5", 1000, (omega, *contacts))
    assert close(found, omega) and all(close(a, b) for a, b in zip(orbit, contacts, strict=True))


@pytest.mark.parametrize("index", [0, 1])
def test_inner_grazings_of_the_stiff_bilinear_branch(index):
    omega, touch, *contact = digits.STIFF_GRAZINGS[index]
    found, orbit = bilinear.grazing(".05", ".3", ".5", 1000, (omega, touch, *contact))
    assert close(found, omega) and all(close(a, b) for a, b in zip(orbit, (touch, *contact), strict=True))
