"""Starts side by side: against extended precision, against the certified march alone, against simulations; bit by bit."""
import math

import numpy as np
import pytest
from mpmath import mp
from scipy.interpolate import CubicHermiteSpline

import bifurc as bf
from bifurc.basins import Kernel, PeriodMap
from bifurc.compose.scene import scene_of
from bifurc.compose.tables import ORDER
from bifurc.ensemble import scalar
from bifurc.ensemble.batch import driver, packing, several_modes, smooth, writing
from bifurc.ensemble.batch.tables import economised, fourth
from bifurc.ensemble.outcomes import CellState
from tests.basins.second import SectionMap
from tests.reference.oscillator import Oscillator, first_arrival

A = {"zeta": 0.02, "omega": 2.6, "amplitude": 1.0, "gap": 0.0, "restitution": 0.8}
DUFFING = {"zeta": 0.075, "omega": 1.0, "amplitude": 0.3, "alpha": -1.0, "beta": 1.0}
FORCE = bf.elements.HarmonicForce(1.0)


def chain(n, *elements, omega=1.3):
    """A chain of masses with coupled inertia, forced at its first."""
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    M = np.eye(n) + 0.1 * (np.eye(n, k=1) + np.eye(n, k=-1))
    return bf.System(M, 0.05 * K + 0.02 * np.eye(n), K, [bf.elements.HarmonicForce(1.0, dof=0), *elements], omega=omega)


SCENES = {
    "one stop": (bf.systems.impact_oscillator(**A), (-2.5, -3.0), (0.0, 3.0)),
    "slow load, rest on the stop": (bf.systems.impact_oscillator(zeta=0.05, omega=0.3, amplitude=1.0, gap=0.1, restitution=0.6),
                                    (-2.0, -2.0), (0.1, 2.0)),
    "two stops": (bf.systems.two_sided_impact_oscillator(amplitude=3.45), (-1.0, -3.0), (1.0, 3.0)),
    "moving stop": (bf.systems.bouncing_ball(amplitude=1.5), (1.5, -3.0), (6.0, 3.0)),
    "elastic stop": (bf.systems.bilinear_oscillator(omega=1.29), (-2.5, -4.0), (2.5, 4.0)),
    "two elastic stops": (bf.System(1.0, 0.1, 1.0, [FORCE, bf.elements.ElasticStop(0.5, 4.0, damping=0.05),
                                                    bf.elements.ElasticStop(0.6, 9.0, side=-1)], omega=1.1),
                          (-2.0, -2.0), (2.0, 2.0)),
    "release by force": (bf.System(1.0, 0.1, 1.0, [FORCE, bf.elements.ElasticStop(0.5, 4.0, damping=0.5, release="force")],
                                   omega=1.1), (-2.0, -2.0), (2.0, 2.0)),
    "dry friction": (bf.System(1.0, 0.04, 1.0, [FORCE, bf.elements.Coulomb(0.3)], omega=0.4), (-2.0, -2.0), (2.0, 2.0)),
    "static friction on a belt": (bf.System(1.0, 0.04, 1.0, [FORCE, bf.elements.Coulomb(0.3, static_ratio=1.4, belt_speed=0.5)],
                                            omega=0.8), (-2.0, -2.0), (2.0, 2.0)),
    "friction and an elastic stop": (bf.System(1.0, 0.04, 1.0, [FORCE, bf.elements.Coulomb(0.2), bf.elements.ElasticStop(0.5, 6.0)],
                                               omega=1.3), (-2.0, -2.0), (2.0, 2.0)),
    "two masses, one hits, one rubs": (chain(2, bf.elements.RigidStop(0.6, 0.7), bf.elements.Coulomb(0.15, dof=1)),
                                       (-1.0, -1.0, -1.5, -1.5), (0.6, 1.0, 1.5, 1.5)),
    "a slider and an elastic stop": (chain(2, bf.elements.ElasticStop(0.5, 6.0), bf.elements.Coulomb(0.1, dof=1)),
                                     (-1.0, -1.0, -1.5, -1.5), (1.0, 1.0, 1.5, 1.5)),
    "a stop between two masses": (chain(2, bf.elements.RigidStop(0.4, 0.6, row=(-1.0, 1.0)), omega=0.9),
                                  (-0.5, -0.5, -1.0, -1.0), (0.0, -0.1, 1.0, 1.0)),
    "static friction below friction between": (bf.System(np.eye(2), 0.1 * np.eye(2), 0.2 * np.eye(2), [
        bf.elements.HarmonicForce(2.0, dof=1), bf.elements.Coulomb(1.2, row=(1.0, -1.0)),
        bf.elements.Coulomb(1.0, static_ratio=1.5)], omega=0.9), (-1.0, -1.0, -1.5, -1.5), (1.0, 1.0, 1.5, 1.5)),
    "three masses": (chain(3, bf.elements.RigidStop(0.8, 0.7, dof=2)), (-0.8,) * 3 + (-1.0,) * 3, (0.8,) * 3 + (1.0,) * 3),
    "smooth": (bf.systems.duffing_oscillator(**DUFFING), (-2.2, -2.2), (2.2, 2.2)),
}

# each kind of scene compiles a kernel of its own: of several masses, and of several contacts, some are met in the slow suite
LONG = ("two elastic stops", "a slider and an elastic stop", "static friction below friction between", "three masses")
NAMES = [pytest.param(name, marks=pytest.mark.slow) if name in LONG else name for name in SCENES]


def carried(system, X, periods, alone=False):
    """Carry starts by the written module itself, or by the scalar integrator alone; only those of a clear start."""
    scene, integrator = scene_of(system), PeriodMap(system)._integrator
    kind = packing.kind_of(scene)
    Y, codes, impacts, speeds = X.copy(), np.full(len(X), 6), np.zeros(len(X), np.int64), np.full(len(X), np.inf)
    T, modes = integrator.begin(X)
    kept = modes >= 0
    if alone:
        followers, none = integrator._followers(T), np.zeros(0, np.int64)
        scalar.map_starts(T, followers, none, modes, Y, 2000, periods, codes, impacts, speeds)
    else:
        packing.module_of(kind).propagate(packing.numbers_of(T, kind), modes, Y, 2000, periods, codes, impacts, speeds)
    return Y[kept], codes[kept], impacts[kept], speeds[kept]


def test_one_period_of_problem_a_errs_by_less_than_1e_13():
    """Against 64-bit mantissas: the asked bound on 160 x 160 cells, here on every fourth of both axes."""
    second = SectionMap(A["zeta"], A["omega"], A["amplitude"], A["gap"], A["restitution"], np.longdouble)
    q = -2.5 + (np.arange(0, 160, 4) + 0.5) * 2.5 / 160
    v = -3.0 + (np.arange(0, 160, 4) + 0.5) * 6.0 / 160
    X = np.column_stack([axis.ravel() for axis in np.meshgrid(q, v, indexing="ij")])
    right = np.array(second(*X.T.astype(np.longdouble))[:2], float).T
    images = PeriodMap(bf.systems.impact_oscillator(**A)).apply(X)
    error = np.abs(images.ends - right).max(axis=1)
    assert (images.outcomes == 0).all()
    assert error.max() <= 1e-13 and np.median(error) <= 1e-14


def digits_of_friction(x, v, friction, omega):
    """State after a period of x'' + .04 x' + x = cos(omega t) - friction sign(x') in 40 digits: slip and stick in turn."""
    def zero(motion, low, x, v, high):
        return mp.findroot(lambda s: motion.flow(low, x, v, s)[1], (low, high), solver="anderson")

    motions = {side: Oscillator(0.02, omega, 1, constant=-side * friction) for side in (1, -1)}
    period, t, x, v = motions[1].period, mp.mpf(0), mp.mpf(x), mp.mpf(v)
    side = 1 if v > 0 else -1
    while True:
        motion, low = motions[side], t
        piece = period / 200  # the speed changes its sign at most once in it
        while t < period:
            t = min(low + piece, period)
            if side * motion.flow(low, x, v, t)[1] < 0:
                break
            x, v = motion.flow(low, x, v, t)
            low = t
        else:
            return float(x), float(v)
        stop = zero(motion, low, x, v, t)
        x, v, t = motion.flow(low, x, v, stop)[0], mp.mpf(0), stop
        load = mp.cos(motion.omega * t) - x
        if abs(load) < friction:  # stick until the load leaves the limits
            level = x + friction, x - friction  # of cos(omega t)
            candidates = [(2 * mp.pi * n + sign * mp.acos(c)) / motion.omega for c in level if abs(c) < 1
                          for n in range(3) for sign in (1, -1)]
            t = min([time for time in candidates if time > stop], default=period)
            if t >= period:
                return float(x), 0.0
            load = mp.cos(motion.omega * (t + mp.mpf(10) ** -12)) - x
        side = 1 if load > 0 else -1
        v = side * mp.mpf(10) ** -30


def digits_of_contact(x, v, omega, gap, stiffness):
    """State after a period of x'' + .1 x' + x = .3 cos(omega t) with a spring beyond the gap in 40 digits."""
    apart = Oscillator(0.05, omega, mp.mpf("0.3"))
    contact = apart.with_(stiffness=1 + stiffness, constant=stiffness * mp.mpf(gap))
    t, x, v, gap, surface = mp.mpf(0), mp.mpf(x), mp.mpf(v), mp.mpf(gap), False
    touching = x > gap
    while True:
        motion = contact if touching else apart
        hit = first_arrival(motion, t, x, v, apart.period, gap, side=-1 if touching else 1, from_surface=surface)
        if hit is None:
            return tuple(map(float, motion.flow(t, x, v, apart.period)))
        t, x, v, touching, surface = hit, gap, motion.flow(t, x, v, hit)[1], not touching, True


@pytest.mark.parametrize("name", ["elastic stop", "dry friction"])
def test_one_period_through_modes_errs_by_less_than_1e_13(name, rng):
    """Against 40 digits."""
    if name == "elastic stop":
        system, X = bf.systems.bilinear_oscillator(omega=1.25), rng.uniform((-2.5, -3.0), (2.5, 3.0), (8, 2))
        right = [digits_of_contact(x, v, mp.mpf("1.25"), 0.5, 4) for x, v in X]
    else:
        system, X = SCENES[name][0], rng.uniform(-2.0, 2.0, (8, 2))
        right = [digits_of_friction(x, v, mp.mpf(0.3), mp.mpf(0.4)) for x, v in X]
    images = PeriodMap(system).apply(X)
    assert np.abs(images.ends - right).max() <= 1e-13


@pytest.mark.parametrize("name", [name for name in NAMES if name != "smooth"])
def test_the_batch_step_agrees_with_the_scalar_integrator(name, rng):
    """Same impacts, same states to rounding grown by the flow."""
    system, low, high = SCENES[name]
    X = rng.uniform(low, high, (3000, len(low)))
    fast, slow = carried(system, X, 1), carried(system, X, 1, alone=True)
    np.testing.assert_array_equal(fast[1], slow[1])
    done = fast[1] == 0
    # a start that all but grazes has neighbours on both sides of the graze: rounding may count one touch more
    assert np.count_nonzero(fast[2][done] != slow[2][done]) <= 1
    assert np.quantile(np.abs(fast[0][done] - slow[0][done]).max(axis=1), 0.999) <= 1e-12
    same = done & (fast[2] == slow[2]) & np.isfinite(fast[3])
    np.testing.assert_allclose(fast[3][same], slow[3][same], rtol=0, atol=1e-11)


@pytest.mark.parametrize("name", NAMES)
def test_images_are_those_of_simulations(name, rng):
    system, low, high = SCENES[name]
    X = rng.uniform(low, high, (24, len(low)))
    period_map = PeriodMap(system)
    images = period_map.apply(X, 2)
    assert period_map.kernel == (Kernel.SMOOTH if name == "smooth" else Kernel.BATCH)
    for start, end, code, impacts, least in zip(X, *images, strict=True):
        if code == CellState.OUTSIDE.code:
            continue
        motion = bf.simulate(system, start, periods=2)
        np.testing.assert_allclose(end, motion.final, rtol=0, atol=1e-11 if name != "smooth" else 1e-7)
        met = [event for event in motion.events if event.kind in ("impact", "chatter", "contact")]
        assert impacts == len(met)
        speeds = [0.0 if event.kind == "chatter" else event.speed for event in met]
        assert least == pytest.approx(min(speeds, default=np.inf), abs=1e-10)


@pytest.mark.parametrize("name", ["one stop", "slow load, rest on the stop", "release by force",
                                  "friction and an elastic stop", "two masses, one hits, one rubs", "smooth"])
def test_the_image_of_a_start_does_not_depend_on_its_company(name, rng):
    """Bit by bit: any order, any number of starts at once, period by period or all together."""
    system, low, high = SCENES[name]
    X = rng.uniform(low, high, (1500, len(low)))
    period_map = PeriodMap(system)
    whole = period_map.apply(X, 3)
    order = rng.permutation(len(X))
    shuffled = period_map.apply(X[order], 3)
    for mine, others in zip(whole, shuffled, strict=True):
        np.testing.assert_array_equal(mine[order], others)
    cut = [period_map.apply(part, 3) for part in np.split(X, [1, 8, 37, 700, 1213])]
    for mine, parts in zip(whole, zip(*cut, strict=True), strict=True):
        np.testing.assert_array_equal(mine, np.concatenate(parts))


@pytest.mark.parametrize(("system", "place"), [
    (bf.systems.impact_oscillator(**A), [-0.9]), (chain(2, bf.elements.RigidStop(0.6, 0.7)), [-0.3, 0.1, -1.0]),
], ids=["one mass", "two masses"])
def test_near_grazes_are_told(system, place):
    """Starts whose first maximum passes the stop by 1e-9, or misses it by as much: the impact is seen or not, never lost."""
    period_map = PeriodMap(system)

    def starts(v):  # the last velocity varies
        return np.column_stack((np.tile(place, (np.size(v), 1)), np.atleast_1d(v)))

    def impacts(v):
        return period_map.apply(starts(v)).impacts

    low, high = -3.0, 3.0
    counts = impacts(np.linspace(low, high, 400))
    jump = int(np.flatnonzero(np.diff(counts))[0])
    low, high = np.linspace(low, high, 400)[[jump, jump + 1]]
    first, last = counts[jump], counts[jump + 1]
    for _ in range(60):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        low, high = (middle, high) if impacts(middle)[0] == first else (low, middle)
    around = low + np.array([-1e-7, -1e-9, -1e-11, 1e-11, 1e-9, 1e-7])
    assert impacts(around).tolist() == [first] * 3 + [last] * 3
    for v, count in zip(around, impacts(around), strict=True):
        motion = bf.simulate(system, starts(v)[0], periods=1)
        assert sum(event.kind in ("impact", "chatter") for event in motion.events) == count


def test_the_bound_on_a_cubic_through_both_ends_holds_and_is_met_by_a_fourth_power(rng):
    """Birkhoff and Priver (1967): a function differs from the cubic with its values and slopes by h^4 / 384 of its fourth
    derivative at most; the cubic of s^4 is 2 h s^3 - h^2 s^2, which is off by h^4 / 16 in the middle."""
    for h in (0.1, 0.6, 2.0):
        power = np.zeros((1, ORDER + 1))
        power[0, 4] = -3.0
        assert fourth(power, h)[0] == pytest.approx(3.0 * h**4 / 16.0, rel=1e-14)
        at, ends = np.linspace(0.0, h, 201), np.array([0.0, h])
        for row in rng.normal(size=(20, ORDER + 1)) / np.cumprod([1.0, *range(1, ORDER + 1)]):
            p = np.polynomial.Polynomial(row)
            cubic = CubicHermiteSpline(ends, p(ends), p.deriv()(ends))
            assert np.abs(cubic(at) - p(at)).max() <= fourth(row[None], h)[0] * (1.0 + 1e-9) + 1e-14


def test_economised_polynomials_of_a_cosine_have_its_values_and_slopes():
    """On the longest substep, where the series cut at the same order errs by 5e-12."""
    h, s = several_modes.TURN, np.linspace(0.0, several_modes.TURN, 101)
    series = np.array([[0.0 if j % 2 else (-1.0) ** (j // 2) / math.factorial(j) for j in range(17)]])
    made = economised(series, h)[0]
    assert made.size == writing.MANY
    np.testing.assert_allclose(np.polynomial.polynomial.polyval(s, made), np.cos(s), rtol=0, atol=4e-16)
    slopes = np.polynomial.polynomial.polyval(s, np.polynomial.polynomial.polyder(made))
    np.testing.assert_allclose(slopes, -np.sin(s), rtol=0, atol=1e-15)


def test_a_complete_chattering_closes_where_the_simulation_closes_it():
    """One that comes to rest while the push turns: it has 63 impacts, of which the last flights cannot be told from rest."""
    system = SCENES["slow load, rest on the stop"][0]
    start = np.array([[0.04665043907952526, 1.1855258203775585]])
    images, motion = PeriodMap(system).apply(start), bf.simulate(system, start[0], periods=1)
    assert images.impacts[0] == sum(event.kind in ("impact", "chatter") for event in motion.events)
    np.testing.assert_allclose(images.ends[0], motion.final, rtol=0, atol=1e-12)


def test_what_ends_a_motion_is_said():
    system = bf.systems.impact_oscillator(zeta=0.05, omega=0.8, amplitude=1.0, gap=0.1, restitution=0.6)
    X = np.column_stack((np.full(60, -0.1), np.linspace(-3.0, 3.0, 60)))
    counts = PeriodMap(system).apply(X).impacts
    assert counts.max() == 3 and counts.min() == 2
    images = PeriodMap(system, max_events=2).apply(np.concatenate((X, [[0.5, 0.0]])))
    assert images.outcomes[-1] == CellState.OUTSIDE.code
    assert (images.outcomes[:-1][counts > 2] == CellState.TOO_MANY_EVENTS.code).all()
    assert (images.outcomes[:-1][counts <= 2] == 0).all()
    growing = bf.System(1.0, -3.0, 1.0, [bf.elements.HarmonicForce(0.1), bf.elements.RigidStop(1.0, 0.7)], omega=1.0)
    images = PeriodMap(growing).apply(np.array([[-1.0, -1.0]]), 400)
    assert images.outcomes[0] == CellState.DIVERGED.code and np.isfinite(images.ends).all()
    softening = PeriodMap(bf.systems.duffing_oscillator(beta=-1.0, amplitude=0.1))
    images = softening.apply(np.array([[0.1, 0.0], [3.0, 3.0]]), 20)
    assert images.outcomes.tolist() == [0, CellState.DIVERGED.code] and np.isfinite(images.ends).all()


@pytest.mark.parametrize(("change", "message"), [
    ({"X": np.zeros((3, 3))}, "must be"), ({"X": np.array([[np.nan, 0.0]])}, "not finite"), ({"periods": 0}, "at least 1"),
])
def test_bad_arguments_are_named(change, message):
    period_map = PeriodMap(bf.systems.impact_oscillator(**A))
    with pytest.raises(ValueError, match=message):
        period_map.apply(**{"X": np.zeros((1, 2)), "periods": 1} | change)


def test_an_autonomous_system_has_no_map_over_periods():
    with pytest.raises(ValueError, match="autonomous"):
        PeriodMap(bf.System(1.0, 0.1, 1.0))


@pytest.mark.parametrize("order", [4, 8])
def test_methods_converge_at_their_order(order, rng):
    scene = scene_of(bf.systems.duffing_oscillator(**DUFFING))
    kind = smooth.kind_of(scene, order)
    X = rng.uniform(-1.5, 1.5, (2000, 2))
    exact = smooth.images(scene, smooth.kind_of(scene), 400, X)
    steps = np.array([56, 72, 96]) * (4 if order == 4 else 1)
    errors = [np.median(np.abs(smooth.images(scene, kind, int(n), X) - exact).max(axis=1)) for n in steps]
    rate = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert abs(rate - order) <= 0.35


def test_the_region_of_a_scene_has_one_length_and_its_velocity_in_any_unit_of_time():
    """Lengths, and velocities of omega times them; with time in another unit only velocities change, by that unit."""
    law = {"zeta": 0.1, "omega": 0.9, "amplitude": 0.3, "alpha": 1.0, "beta": 1.0}
    found = []
    for unit in (1.0, 8.0):
        system = bf.System(1.0, 2.0 * law["zeta"] * unit, law["alpha"] * unit**2, [
            bf.elements.HarmonicForce(law["amplitude"] * unit**2), bf.elements.CubicSpring(law["beta"] * unit**2)],
            omega=law["omega"] * unit)
        scene = scene_of(system)
        found.append(smooth.region(scene, smooth.kind_of(scene)))
        assert found[-1][1] == pytest.approx(law["omega"] * unit * found[-1][0], rel=1e-12)
    np.testing.assert_allclose(found[1], found[0] * [1.0, 8.0], rtol=1e-6)


def test_the_measured_error_is_one(rng):
    """The step count comes with an error that starts of the region have: against seven times as many steps."""
    system = bf.systems.duffing_oscillator(**DUFFING)
    period_map, scene = PeriodMap(system), scene_of(system)
    kind = smooth.kind_of(scene)
    scale = smooth.region(scene, kind)
    X = rng.uniform(-1.0, 1.0, (2000, 2)) * scale
    right = smooth.images(scene, kind, 7 * period_map.steps, X)
    error = np.quantile(np.abs((period_map.apply(X).ends - right) / scale).max(axis=1), 0.99)
    assert 0.0 < period_map.error <= smooth.WISH and error <= 3.0 * smooth.WISH


@pytest.mark.slow
def test_a_law_of_the_user_with_its_own_mass_and_row(rng):
    """Coefficients that are not 1: mass 2, and a row that sees half the coordinate."""
    law = bf.elements.Force(lambda u, s, c, d: -c * u * u * u - d * s * abs(s), site=(0.5,), c=3.0, d=0.2)
    system = bf.System(2.0, 0.1, 1.0, [bf.elements.HarmonicForce(0.7), law], omega=0.9)
    X = rng.uniform(-1.0, 1.0, (6, 2))
    period_map = PeriodMap(system)
    ends = period_map.apply(X, 2).ends
    assert period_map.kernel == Kernel.SMOOTH
    for start, end in zip(X, ends, strict=True):
        np.testing.assert_allclose(end, bf.simulate(system, start, periods=2).final, rtol=0, atol=2e-7)


def test_labels_beside_a_chaotic_attractor_are_right(rng):
    """Duffing at .3: cells that do not come to the orbit in 300 periods of an independent integration are the chaotic ones."""
    system = bf.systems.duffing_oscillator(**DUFFING)
    basins = bf.basins_of_attraction(system, bf.Grid(q0=(-2.2, 2.2, 60), v0=(-2.2, 2.2, 60)), workers=1)
    orbit, chaos = basins.attractors
    np.testing.assert_allclose(orbit.state, [0.6387555305, 1.3415984052], rtol=0, atol=1e-9)
    assert chaos.cover is not None and 0.1 < chaos.exponent < 0.25
    chosen = rng.choice(3600, 800, replace=False)
    x, v = basins.grid.starts(1, 2)[chosen].T
    steps = 200
    h = 2.0 * np.pi / steps
    force = 0.3 * np.cos(np.pi * np.arange(2 * steps + 1) / steps)
    near = np.zeros(len(x), bool)

    def rate(x, v, f):
        return f - 0.15 * v + x - x * x * x

    for _ in range(120):
        for k in range(steps):
            f0, f1, f2 = force[2 * k:2 * k + 3]
            a = rate(x, v, f0)
            b = rate(x + h / 2 * v, v + h / 2 * a, f1)
            c = rate(x + h / 2 * v + h * h / 4 * a, v + h / 2 * b, f1)
            d = rate(x + h * v + h * h / 2 * b, v + h * c, f2)
            x, v = x + h * v + h * h / 6 * (a + b + c), v + h / 6 * (a + 2 * b + 2 * c + d)
        near |= np.hypot(x - orbit.state[0], v - orbit.state[1]) < 1e-3
    np.testing.assert_array_equal(basins.labels.ravel()[chosen] == 0, near)


MOVING_STOP = bf.elements.RigidStop(0.5, 0.7, amplitude=0.4, harmonic=3, phase=0.3)


@pytest.mark.parametrize("elements", [
    (MOVING_STOP, bf.elements.Coulomb(0.1)), (MOVING_STOP,), (bf.elements.ElasticStop(0.2, 9.0),)])
def test_what_is_packed_bounds_the_guards(elements, rng):
    """The cubic through both ends of a substep errs by no more than the packed bound, in any phase of the forcing."""
    scene = scene_of(bf.System(1.0, 0.1, 1.0, [FORCE, *elements], omega=1.3))
    T, kind = scene.tables, packing.kind_of(scene)
    numbers = packing.numbers_of(T, kind).numbers
    h, tightest, t = numbers["h"][0], 0.0, np.linspace(0.0, 1.0, 41)
    for m, guards in enumerate(T.n_guards):
        for g in range(guards):
            packed = numbers["guards"][m, g]
            bound = *packed["bound"], packed["bound_all"]
            states = rng.uniform(-1.0, 1.0, (60, 2)) * rng.choice([1e-3, 1.0, 3.0], (60, 1))
            for y, tau in zip(states, rng.uniform(0.0, 5.0, 60), strict=True):
                a = T.GT[m, g].T @ np.append(y, scene.forcing(np.array([tau]))[0])  # Taylor coefficients of the guard
                p = np.polynomial.Polynomial(a * h ** np.arange(a.size))
                d = p.deriv()
                cubic = (p(0) * (1 + 2 * t) + d(0) * t) * (1 - t)**2 + (p(1) * (3 - 2 * t) + d(1) * (t - 1)) * t**2
                error, allowed = np.abs(p(t) - cubic).max(), bound[0] * abs(y[0]) + bound[1] * abs(y[1]) + bound[2]
                assert error <= allowed + 1e-15
                tightest = max(tightest, error / max(allowed, 1e-300) if allowed > 1e-14 else 0.0)
    assert 0.01 < tightest <= 1.0


@pytest.mark.parametrize(("stops", "most"), [
    ([bf.elements.RigidStop(0.6, 0.8)], 0.03),
    ([bf.elements.RigidStop(0.6, 0.8), bf.elements.RigidStop(0.5, 0.7, side=-1)], 0.15)])
def test_the_batch_step_itself_takes_most_starts_round(stops, most):
    """A step that leaves its starts to the scalar integrator has the right images, too, and takes ten times as long."""
    scene = scene_of(bf.System(1.0, 0.04, 1.0, [FORCE, *stops], omega=1.3))
    kind = packing.kind_of(scene)
    module, given = packing.module_of(kind), packing.numbers_of(scene.tables, kind)
    count, row, many = module.SIZE, module.AT_CAP, given.numbers.size
    free, left = next(m for m in range(many) if scene.tables.n_holds[m] == 0), []
    for _ in range(2):
        W = np.zeros(module.AT_LISTS + 2 * module.AT_STATE * many)
        index = np.zeros(module.AT_IDS + (row + 1) * many, np.uint32)
        W[:count], W[row:row + count] = np.random.default_rng(2).uniform((-0.45, -1.5), (0.55, 1.5), (count, 2)).T
        module.period_step(W, index, count, given, np.full(count, free), -1, module.room(given.T))  # to which any event is too many
        left.append(np.count_nonzero(W[module.AT_FOUND:][:count]))
        given.numbers["guards"]["many"] = 0  # now all is left
    assert left[0] <= most * count and left[1] > 0.5 * count


def test_rows_of_a_batch_begin_on_cache_lines():
    """Whatever the allocator gives: 64 bytes, and as many zeros as were asked for."""
    for count in (1, 7, 1000, 4093):
        room = driver.lined(count)
        assert room.ctypes.data % 64 == 0 and room.shape == (count,) and not room.any()
