"""Hard periodic orbits and branches: at a graze, at simultaneous stops, stiff, undamped, plastic, through zero gap."""
import numpy as np
import pytest
from mpmath import mpf

import bifurc as bf
from bifurc.elements import ElasticStop, HarmonicForce, RigidStop
from tests.reference import bilinear, digits, one_stop
from tests.reference.compare import worst_impact, worst_multiplier
from tests.reference.oscillator import Oscillator


def impact_system(zeta, omega, force, gap, r):
    return bf.systems.impact_oscillator(zeta=zeta, omega=omega, amplitude=force, gap=gap, restitution=r)


def state_at_zero(reference):
    return np.array([float(z) for z in reference.state(0)])


# a graze

@pytest.mark.parametrize("omega", [2.5, 0.8, 1.5])
@pytest.mark.parametrize("depth", [1e-12, 1e-10, 1e-8])
def test_free_orbit_within_a_hair_of_the_stop(omega, depth):
    """Below the grazing load the free orbit is a motion; above it nothing without an impact is."""
    value = float(one_stop.grazing_force(0.05, omega, 1.0))
    for sign in (-1, 1):
        force = value * (1 + sign * depth)
        guess = [float(z) for z in Oscillator(0.05, omega, force).particular(0)]
        orbit = bf.find_orbit(impact_system(0.05, omega, force, 1.0, 0.7), guess, periods=1)
        if sign < 0:
            assert orbit.success and not orbit.events
        elif orbit.success:
            assert orbit.events, "an orbit was passed through the stop"
            assert min(e.speed for e in orbit.events) >= 0.0


@pytest.mark.parametrize("speed", [1e-2, 1e-4, 1e-6, 1e-8])
@pytest.mark.parametrize("omega, n", [(2.5, 1), (0.8, 1), (1.5, 1), (2.5, 2)])
def test_impacts_of_vanishing_speed(omega, n, speed):
    """The branch runs down to any impact speed: speed and multipliers (that grow like 1/v) keep their relative accuracy."""
    motion, r = Oscillator(0.05, omega, 1), mpf(0.7)
    a1, a2, _ = one_stop.coefficients(motion, r, n)

    def force_at(v):
        size = ((1 + (1 + r) * a1 * v) ** 2 + ((1 + (1 + r) * a2) * v / motion.omega) ** 2) ** mpf(0.5)
        return size / abs(motion.receptance)

    start, end = float(force_at(mpf(0.03))), float(force_at(mpf(speed)))
    reference = min((o for o in one_stop.orbits(0.05, omega, start, 1, 0.7, n)), key=lambda o: abs(o.speed - 0.03))
    orbit = bf.find_orbit(impact_system(0.05, omega, start, 1.0, 0.7), state_at_zero(reference), periods=n)
    branch = bf.trace(orbit, "amplitude", bounds=(start, end), direction=1 if end > start else -1)
    last = branch.orbits[0 if branch.column("amplitude")[0] == end else len(branch) - 1]
    assert last.system.parameter("amplitude") == end and last.success
    (impact,) = last.events
    motion = motion.with_(force=end)
    true = min((v for v in one_stop.speeds(motion, 1, r, n)), key=lambda v: abs(v - speed))
    assert abs(impact.speed - float(true)) < 1e-14
    trace, det = one_stop.monodromy(motion, mpf(1), r, n, mpf(impact.speed))
    want = one_stop.roots_of(trace, det)
    assert abs(last.multipliers[0] / complex(want[0]) - 1) < 1e-9


@pytest.mark.parametrize("ratio", [1.2, 2.0, 5.0])
def test_nothing_else_within_1e_6_of_an_elastic_graze(ratio):
    """dp/ds = 0 at an elastic graze and is no fold: the list within 1e-6 is the grazing alone, from either side."""
    for value in digits.BILINEAR_GRAZINGS:
        for start in (value - 1e-6, value + 1e-6):
            system = bf.systems.bilinear_oscillator(zeta=0.05, amplitude=0.3, gap=0.5, stiffness_ratio=ratio, omega=start)
            guess = [float(z) for z in Oscillator(0.05, start, 0.3).particular(0)]
            orbit = bf.find_orbit(system, guess, periods=1)
            branch = bf.trace(orbit, "omega", bounds=(value - 1e-6, value + 1e-6))
            assert [str(p.kind) for p in branch.special_points] == ["grazing"], branch.special_points
            assert abs(branch.special_points[0].parameter - value) < 1e-12


@pytest.mark.parametrize("ds_max", [0.05, 0.2, 1.0])
def test_folds_and_flips_next_to_elastic_grazes(ds_max):
    """A spring 1000 times stiffer: a fold or a flip 4e-7, 7e-7, 1e-9, 4e-8 from each of the four grazes; all are listed."""
    system = bf.systems.bilinear_oscillator(**{**digits.BILINEAR, "stiffness_ratio": digits.STIFF_RATIO}, omega=0.5)
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(0.5, 2.5), ds_max=ds_max)
    want = [(kind, omega) for kind, omega, _ in digits.STIFF_POINTS]
    want += [("grazing", w) for w in digits.BILINEAR_GRAZINGS] + [("grazing", row[0]) for row in digits.STIFF_GRAZINGS]
    got = sorted((p.parameter, str(p.kind), p.error) for p in branch.special_points)
    assert [kind for _, kind, _ in got] == [kind for kind, _ in sorted(want, key=lambda row: row[1])]
    for (parameter, kind, error), (_, value) in zip(got, sorted(want, key=lambda row: row[1]), strict=True):
        assert abs(parameter - value) < 1e-11, (kind, value)
        assert abs(parameter - value) <= error + 4e-16 * value, (kind, value)
    for value, *_ in [(w,) for w in digits.BILINEAR_GRAZINGS] + list(digits.STIFF_GRAZINGS):
        near = [p.kind for p in branch.special_points if abs(p.parameter - value) < 1e-6]
        assert "grazing" in near and len(near) == 2


# several stops

def two_masses(coupling, damper, force=0.9, omega=1.5, r=0.7, gaps=(1.0, 1.0)):
    """Two equal masses, each with its own stop, coupled by a spring and a damper, loaded alike."""
    K = np.array([[1 + coupling, -coupling], [-coupling, 1 + coupling]])
    C = np.array([[0.1 + damper, -damper], [-damper, 0.1 + damper]])
    elements = (HarmonicForce(force, dof=0), HarmonicForce(force, dof=1), RigidStop(gaps[0], r, dof=0),
                RigidStop(gaps[1], r, dof=1))
    return bf.System(np.eye(2), C, K, elements, omega=omega)


def in_phase():
    reference = [o for o in one_stop.orbits(0.05, 1.5, 0.9, 1, 0.7, 1) if o.admissible][-1]
    x, v = (float(z) for z in reference.state(0))
    return reference, (x, x, v, v)


@pytest.mark.parametrize("coupling", [0.0, 0.4, 2.0])
def test_two_stops_hit_at_one_instant(coupling):
    """In phase the masses are one oscillator; out of phase one with the stiffness 1 + 2 kc and the same saltation."""
    reference, start = in_phase()
    orbit = bf.find_orbit(two_masses(coupling, 0.0), start, periods=1)
    assert orbit.success, orbit.message
    assert worst_impact(orbit, [reference.time] * 2, [reference.speed] * 2) < 1e-11
    r, v = reference.restitution, reference.speed
    g = (1 + r) * (reference.motion.load(reference.time)[0] - reference.gap) / v
    e11, e12, e21, e22 = reference.motion.with_(stiffness=1 + 2 * mpf(coupling)).homogeneous(reference.motion.period)
    other = one_stop.roots_of(-r * (e11 + e22) + g * e12, r**2 * (e11 * e22 - e12 * e21))
    assert worst_multiplier(orbit, [*reference.multipliers, *other]) < (1e-11 if coupling else 1e-7)


def test_two_stops_hit_at_one_instant_with_a_coupling_damper():
    """The first impact changes the acceleration of the other mass: the two orders give different derivatives, and the
    orbit says so instead of printing multipliers of one of them."""
    reference, start = in_phase()
    orbit = bf.find_orbit(two_masses(0.4, 0.1), start, periods=1)
    assert worst_impact(orbit, [reference.time] * 2, [reference.speed] * 2) < 1e-11
    assert orbit.stable is None
    assert not np.isfinite(orbit.multipliers).all()
    assert "order" in orbit.message or "unique" in orbit.message or "simultaneous" in orbit.message


def test_nearly_simultaneous_stops_keep_their_order():
    """Gaps 1e-7 apart: two impacts in the right order; multipliers tend to those of the simultaneous orbit."""
    reference, start = in_phase()
    limit = bf.find_orbit(two_masses(0.4, 0.0), start, periods=1)
    orbit = bf.find_orbit(two_masses(0.4, 0.0, gaps=(1.0, 1.0 + 1e-7)), start, periods=1)
    assert orbit.success and len(orbit.events) == 2
    first, second = orbit.events
    assert first.element != second.element and 0 < second.time - first.time < 1e-6
    assert worst_multiplier(orbit, limit.multipliers) < 1e-5


# stiff, elastic and undamped

def test_spring_stop_1e10_times_stiffer():
    """Contact of 3.14e-5 in a period of 2.5: times and speeds to 1e-11, multipliers to what the times allow."""
    ratio = 1e10
    rigid = one_stop.orbits(0.05, 2.5, 14, 1, 1, 1)[-1]
    guess = (rigid.time, rigid.speed, rigid.time + mpf("3.14159e-5"), -rigid.speed)
    reference = bilinear.orbit(0.05, 2.5, 14, 1, ratio, guess)
    assert float(reference.entry_speed - rigid.speed) == pytest.approx(-6.5e-6, abs=1e-7)
    apart, _ = bilinear.pieces(0.05, 2.5, 14, 1, ratio)
    y = [float(z) for z in apart.flow(reference.exit, mpf(1), reference.exit_speed, apart.period)]
    system = bf.systems.bilinear_oscillator(zeta=0.05, omega=2.5, amplitude=14.0, gap=1.0, stiffness_ratio=ratio)
    orbit = bf.find_orbit(system, y, periods=1)
    assert orbit.success, orbit.message
    entry, exit_ = orbit.events
    assert abs(entry.time - float(reference.entry)) < 1e-11 and abs(exit_.time - float(reference.exit)) < 1e-11
    assert abs(entry.speed - float(reference.entry_speed)) < 1e-10
    assert worst_multiplier(orbit, reference.multipliers) < 1e-6  # rounding of a time turns the contact by 1e5 times that


@pytest.mark.parametrize("r", [1.0, 0.7])
def test_elastic_stops_tend_to_the_rigid_one_like_the_root_of_stiffness(r):
    """Order 1/2 in speed; with the dashpot 2 zc sqrt(k), zc = -ln r / sqrt(pi^2 + ln^2 r), released at zero penetration."""
    rigid = one_stop.orbits(0.05, 2.5, 14, 1, r, 1)[-1]
    zc = -np.log(r) / np.hypot(np.pi, np.log(r)) if r < 1 else 0.0
    start, errors, sizes = state_at_zero(rigid), [], (1e7, 1e8)
    for k in sizes:
        stop = ElasticStop(1.0, k, damping=2 * zc * np.sqrt(k), release="penetration")
        system = bf.System(1.0, 0.1, 1.0, (HarmonicForce(14.0), stop), omega=2.5)
        orbit = bf.find_orbit(system, start, periods=1)
        assert orbit.success, orbit.message
        entry, exit_ = orbit.events
        errors.append((abs(entry.speed - float(rigid.speed)), abs((entry.time + exit_.time) / 2 - float(rigid.time))))
    orders = np.diff(np.log(errors), axis=0)[0] / np.diff(np.log(sizes))
    assert orders[0] == pytest.approx(-0.5, abs=0.01)
    if r == 1.0:  # the contact is symmetric in time: its middle converges without a next term
        assert orders[1] == pytest.approx(-0.5, abs=5e-4)


@pytest.mark.parametrize("zeta, r", [(0.0, 1 - 2.5e-5), (1e-5, 1.0), (1e-6, 0.99999)])
def test_nearly_conservative_orbits(zeta, r):
    """|mu| = 1 - 2.5e-5 is stable, and said to be."""
    reference = [o for o in one_stop.orbits(zeta, 1.5, 0.6, 0.3, r, 1) if o.admissible][-1]
    orbit = bf.find_orbit(impact_system(zeta, 1.5, 0.6, 0.3, r), state_at_zero(reference), periods=1)
    assert orbit.success, orbit.message
    assert worst_impact(orbit, [reference.time], [reference.speed]) < 1e-11
    assert worst_multiplier(orbit, reference.multipliers) < 1e-11
    assert abs(orbit.multipliers[0]) < 1 and orbit.stable is True


def test_conservative_orbit_is_neither_stable_nor_unstable():
    reference = [o for o in one_stop.orbits(0, 1.5, 0.6, 0.3, 1, 1) if o.admissible][-1]
    orbit = bf.find_orbit(impact_system(0.0, 1.5, 0.6, 0.3, 1.0), state_at_zero(reference), periods=1)
    assert orbit.success and orbit.stable is None
    assert np.abs(np.abs(orbit.multipliers) - 1).max() < 1e-12


# along other parameters, through their special values

def follow(zeta, omega, force, gap, r, name, bounds, n=1, steps=6):
    """Trace the upper n-1 orbit in any parameter; compare rows with the closed form."""
    reference = [o for o in one_stop.orbits(zeta, omega, force, gap, r, n) if o.admissible][-1]
    orbit = bf.find_orbit(impact_system(zeta, omega, force, gap, r), state_at_zero(reference), periods=n)
    branch = bf.trace(orbit, name, bounds=bounds)
    values = branch.column(name)
    keys = {"zeta": 0, "omega": 1, "amplitude": 2, "gap": 3, "restitution": 4}
    for i in np.linspace(0, len(branch) - 1, steps).astype(int):
        row = branch.orbits[int(i)]
        if len(row.events) != 1 or row.events[0].kind != "impact" or row.periods != n:
            continue
        case = [zeta, omega, force, gap, r]
        case[keys[name]] = float(values[i])
        motion = Oscillator(*case[:3])
        true = min((v for v in one_stop.speeds(motion, case[3], mpf(case[4]), n)),
                   key=lambda v: abs(v - row.events[0].speed))
        assert abs(row.events[0].speed - float(true)) < 1e-11 * max(1.0, float(true)), (name, case)
    return branch, set(values[[0, -1]].tolist())


def test_through_zero_and_negative_gap():
    branch, ends = follow(0.1, 2.2, 3.0, 0.5, 0.8, "gap", (0.5, -0.6), steps=12)
    assert ends == {0.5, -0.6}
    assert not branch.special_points


def test_from_elastic_to_nearly_plastic():
    branch, ends = follow(0.05, 1.8, 1.0, 0.2, 0.7, "restitution", (0.0, 1.0), steps=12)
    assert ends == {0.0, 1.0}


def test_through_critical_damping():
    """At zeta = 1 the unforced flow is defective."""
    branch, ends = follow(0.6, 2.0, 20.0, 1.0, 0.7, "zeta", (0.6, 1.4), steps=12)
    assert ends == {0.6, 1.4}


def test_through_the_resonance_of_the_undamped_oscillator():
    """K - omega^2 M is singular at omega = 1: the impacting orbit passes it regularly."""
    reference = [o for o in one_stop.orbits(0, 0.9, 1, 1, 0.7, 1) if o.admissible]
    assert reference
    branch, ends = follow(0.0, 0.9, 1.0, 1.0, 0.7, "omega", (0.9, 1.1), steps=9)
    assert ends == {0.9, 1.1}
    omega = branch.column("omega")
    at = int(np.argmin(np.abs(omega - 1.0)))
    assert branch.orbits[at].success


@pytest.mark.parametrize("r", [0.0, 0.3, 0.7])
def test_sticking_orbits_along_the_load(r):
    """Every row of a branch of sticking orbits is superstable and releases where amplitude cos(omega t) = gap."""
    system = impact_system(0.05, 0.4, 1.0, 0.2, r)
    branch = bf.trace(bf.find_orbit(system), "amplitude", bounds=(1.0, 1.3))
    for i in np.linspace(0, len(branch) - 1, 6).astype(int):
        orbit = branch.orbits[int(i)]
        assert orbit.success, orbit.message
        release = [e for e in orbit.events if e.kind == "release"]
        if not release:
            continue
        force = orbit.system.parameter("amplitude")
        assert abs(release[0].time - np.arccos(0.2 / force) / 0.4) < 1e-11
        assert np.abs(orbit.multipliers).max() < 1e-13
