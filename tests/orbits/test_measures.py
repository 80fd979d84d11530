"""What an orbit says of itself against simulations, sums over samples and differences: states, events, measures, multipliers."""
import contextlib
import itertools
import math
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.elements import (
    ConstantForce,
    Coulomb,
    CubicSpring,
    ElasticStator,
    ElasticStop,
    HarmonicForce,
    Jenkins,
    LinearSpring,
    RigidStator,
    RigidStop,
)
from bifurc.orbits import concentric, energy, multipliers
from bifurc.orbits.kinds import OrbitStatus
from bifurc.orbits.shooting import path, sequence
from bifurc.orbits.shooting.equations import Equations
from bifurc.orbits.shooting.sequence import FOREVER, STARTS
from bifurc.orbits.shooting.signature import Signature, coincide, divided, held_guards, repeated, sections, start_orders, translated
from tests.reference.plain import plain

PAIR = bf.System([[1.0, 0.2], [0.2, 1.5]], [[0.4, -0.1], [0.05, 0.5]], [[2.0, -0.7], [-0.6, 1.8]],
                 [HarmonicForce(1.4, phase=0.6), HarmonicForce(0.3, 2, -0.4, dof=1), RigidStop(0.4, 0.6, dof=1), Jenkins(1.2, 0.2)],
                 omega=1.1)
FLIP = bf.systems.impact_oscillator(omega=2.6, amplitude=1.0, gap=0.0, restitution=0.8)
BOTH = bf.systems.two_sided_impact_oscillator(omega=2.0, amplitude=3.0)
BELT = bf.systems.belt_oscillator()


@pytest.fixture(scope="module", params=["pair", "several", "half", "belt", "free"])
def orbit(request):
    """Two masses with memory; several periods; half a period; without a clock; without events."""
    found = {"pair": lambda: bf.find_orbit(PAIR), "several": lambda: bf.find_orbit(FLIP, (-0.3, 0.4), periods=4, transient=0),
             "half": lambda: bf.find_orbit(BOTH), "belt": lambda: bf.find_orbit(BELT),
             "free": lambda: bf.find_orbit(bf.System(PAIR.mass, PAIR.damping, PAIR.stiffness, PAIR.elements[:2], omega=1.1))}
    made = found[request.param]()
    if request.param == "several" and not made.success:
        made = bf.find_orbit(FLIP)
    assert made.success, made.message
    return made


def simulated(orbit, t0=0.0, y0=None, periods=1.0):
    """Return the simulation from the orbit's state at phase 0, or another state."""
    return bf.simulate(orbit.system, orbit.state if y0 is None else y0, duration=periods * orbit.period, t0=t0)


def test_states_and_events_are_those_of_the_simulation(orbit):
    motion = simulated(orbit, periods=1.0)
    t, y = orbit.sample(41)
    assert t == pytest.approx(np.linspace(0.0, orbit.period, 41)) and y[0] == pytest.approx(y[-1], abs=1e-9)
    away = np.array([min((abs(e.time - s) for e in motion.events), default=1.0) for s in t]) > 1e-7
    assert y[away] == pytest.approx(motion(np.minimum(t, motion.stop))[away], abs=1e-8)
    assert y[0] == pytest.approx(orbit.state, abs=1e-12)
    inner = [e for e in motion.events if 1e-7 < e.time < orbit.period - 1e-7]
    known = [e for e in orbit.events if 1e-7 < e.time < orbit.period - 1e-7]
    assert [(e.element, e.kind, e.mode_before, e.mode_after) for e in known] == [
        (e.element, e.kind, e.mode_before, e.mode_after) for e in inner]
    for own, other in zip(known, inner, strict=True):
        assert (own.time, own.speed) == pytest.approx((other.time, other.speed), abs=1e-8)
        n = 2 * orbit.system.n  # memory that follows local values is written where it is left
        assert own.before[:n] == pytest.approx(other.before[:n], abs=1e-8)
        assert own.after[:n] == pytest.approx(other.after[:n], abs=1e-8)
    assert [e.time for e in orbit.events] == sorted(e.time for e in orbit.events)


def test_measures_are_those_of_the_samples(orbit):
    """The trapezoidal rule on pieces between events, in exact times."""
    for dof in range(orbit.system.n):
        total = dict.fromkeys(("mean", "square", 0.0, 1.0, 3.0), 0.0)
        ends = [0.0, *(e.time for e in orbit.events if 1e-9 < e.time < orbit.period - 1e-9), orbit.period]
        unit = orbit.forcing_period if not orbit.autonomous else orbit.period
        top, low = -np.inf, np.inf
        nodes, weights = np.polynomial.legendre.leggauss(40)
        for a, b in zip(ends[:-1], ends[1:], strict=True):
            s = a + 0.5 * (b - a) * (nodes + 1.0)
            q = orbit._states(s / orbit.forcing_period)[:, dof]
            w = 0.5 * (b - a) * weights / orbit.period
            total["square"] += w @ q**2
            for h in (0.0, 1.0, 3.0):
                total[h] += (1.0 if h == 0.0 else 2.0) * (w @ (q * np.exp(-2j * np.pi * h * s / unit)))
            fine = orbit._states(np.linspace(a, b, 400)[:-1] / orbit.forcing_period)[:, dof]
            top, low = max(top, fine.max()), min(low, fine.min())
        size = orbit.maximum(dof) - orbit.minimum(dof)
        assert orbit.rms(dof) == pytest.approx(math.sqrt(total["square"]), rel=1e-10)
        for h in (0.0, 1.0, 3.0):
            assert orbit.harmonic(h, dof) == pytest.approx(complex(total[h]), abs=1e-10 * size)
        assert top <= orbit.maximum(dof) + 1e-12 and orbit.maximum(dof) == pytest.approx(top, abs=2e-4 * size)
        assert low >= orbit.minimum(dof) - 1e-12 and orbit.minimum(dof) == pytest.approx(low, abs=2e-4 * size)


def test_multipliers_are_those_of_the_map(orbit):
    """Differences of simulations over a period, from a phase without event; the multiplier 1 of a shift in time is left out."""
    ends = sorted(e.time for e in orbit.events)
    gaps = np.diff([*ends, ends[0] + orbit.period]) if ends else [orbit.period]
    start = ((ends[int(np.argmax(gaps))] if ends else 0.0) + 0.5 * max(gaps)) % orbit.period
    y, h = orbit._states(np.array([start / orbit.forcing_period]))[0], 3e-6
    n = orbit.system.n
    kept = [c for c in range(2 * n) if not (orbit.system is BELT and orbit.scene.n == 1 and abs(y[1] - 0.3) < 1e-12)]
    if len(kept) < 2 * n:
        pytest.skip("it sticks there")

    def end(d):
        given = np.concatenate([y[:2 * n] + d, y[2 * n:]])
        return simulated(orbit, start, given).final

    M = np.array([(end(d) - end(-d)) / (2.0 * h) for d in h * np.eye(2 * n)]).T[:2 * n]
    found = np.sort_complex(np.linalg.eigvals(M))
    known = [*orbit.multipliers, 1.0] if orbit.autonomous else list(orbit.multipliers)
    known = np.array(sorted(known, key=abs, reverse=True)[:2 * n])
    assert np.sort(np.abs(found)) == pytest.approx(np.sort(np.abs(known)), abs=2e-5 * max(1.0, np.abs(known).max()))
    moduli = np.abs(orbit.multipliers)
    assert (np.diff(moduli) <= 1e-13).all() and orbit.stable is bool(moduli.max() < 1.0)


def test_the_past_of_an_orbit_goes_on_for_ever(orbit):
    before, times = orbit.past(0.3 * orbit.period, 1.7 * orbit.period)
    t = np.array([-1.3, -0.4, 0.2]) * orbit.period
    assert before(t) == pytest.approx(orbit._states(np.mod(t, orbit.period) / orbit.forcing_period), abs=1e-9)
    known = sorted(e.time + k * orbit.period for e in orbit.events for k in (-3, -2, -1, 0, 1))
    assert sorted(times) == pytest.approx([s for s in known if -1.4 * orbit.period < s < 0.3 * orbit.period])
    if not orbit.autonomous:
        assert orbit.sections == pytest.approx(orbit._states(np.arange(orbit.periods)), abs=1e-12)


def test_what_it_is(orbit, tmp_path):
    assert orbit.omega == pytest.approx(2.0 * np.pi / orbit.period) and orbit.admissible and orbit.residual < 1e-11
    assert orbit.status is OrbitStatus.CONVERGED and orbit.message.startswith(OrbitStatus.CONVERGED.sentence)
    assert orbit.parameters == orbit.system.parameters and orbit.periodic and orbit.autonomous is (orbit.system is BELT)
    if not orbit.autonomous:
        assert orbit.period == pytest.approx(orbit.periods * orbit.system.period) and orbit.forcing_period == orbit.system.period
    stable = {True: "stable", False: "unstable", None: "stability unknown"}[orbit.stable]
    assert repr(orbit) == f"PeriodicOrbit({orbit.signature}, {stable}, converged, residual {orbit.residual:.1e})"
    orbit.save(tmp_path / "orbit.npz")
    again = bf.load(tmp_path / "orbit.npz")
    assert again.system == orbit.system and again.signature == orbit.signature and np.array_equal(again.unknowns, orbit.unknowns)
    assert np.array_equal(again.weights, orbit.weights) and again.how == orbit.how and again.period == orbit.period
    assert again.closure == orbit.closure and again.status is orbit.status and np.array_equal(again.state, orbit.state)
    copied = orbit.unknowns
    copied[:] = 7.0
    assert not np.array_equal(orbit.unknowns, copied)
    for n in (1, 2.5, "3"):
        with pytest.raises(ValueError, match=f"sample: n = {n!r} is not allowed; it must be a whole number, at least 2"):
            orbit.sample(n)
    for h in (-1, np.nan, np.inf):
        with pytest.raises(ValueError, match=f"harmonic: h = {h!r} is not allowed; it must be a finite number, at least 0"):
            orbit.harmonic(h)
    with pytest.raises(ValueError, match="h times .* periods must be a whole number"):
        orbit.harmonic(0.3 / orbit.periods)
    for dof in (-1, 0.0):
        with pytest.raises(ValueError, match=f"maximum: dof = {dof} is not allowed; it must be a whole number, at least 0"):
            orbit.maximum(dof)
    with pytest.raises(ValueError, match=f"dof = {orbit.system.n} is not allowed; it must be 0 .. {orbit.system.n - 1}"):
        orbit.maximum(orbit.system.n)
    assert len(orbit.sample(np.int64(2))[0]) == 2 and len(orbit.sample()[0]) == 400


def test_equations_and_their_derivatives(orbit, rng):
    e = orbit.equations
    x = np.append(orbit.unknowns, 0.0)
    assert np.abs(e.residual(x)).max() == orbit.residual and e.size == orbit.unknowns.size
    J, h = e.jacobian(x), 1e-6
    for c in range(e.size):
        d = np.zeros(x.size)
        d[c] = h
        column = (e.residual(x + d) - e.residual(x - d)) / (2.0 * h)
        assert J[:, c] == pytest.approx(column, abs=2e-6 * max(1.0, np.abs(J).max())), c
    tangent = np.zeros(x.size)
    tangent[-1] = 1.0
    moved = x.copy()
    moved[:-1] += 1e-6 * e.scale[:-1] * rng.normal(size=e.size)
    kept = moved.copy()
    status, found, _, info = e.correct(moved, tangent, False)
    assert status == 1 and np.array_equal(moved, kept) and found[-1] == 0.0 and info[0] >= 1
    if not orbit.family:
        assert found[:-1] == pytest.approx(x[:-1], abs=1e-9)
    m = len(e.signature.nodes)
    sizes = np.concatenate([[0.25], 4.0 * orbit.weights]) * math.sqrt(m)
    assert e.scale[:-1] == pytest.approx(np.tile(sizes, m)) and e.scale[-1] == 1.0
    # a perturbation that is multiplied by a multiplier over the period makes the determinant vanish
    if not orbit.autonomous and len(orbit.multipliers):
        for multiplier in orbit.multipliers[np.abs(orbit.multipliers.imag) < 1e-12].real[:1]:
            if orbit.closure == 1 and abs(multiplier) > 1e-3:
                at, beside = (np.linalg.slogdet(e.jacobian(x, mu))[1] for mu in (multiplier, 1.7 * multiplier))
                assert at < beside - 8.0


def test_a_label_of_a_family_is_kept_where_the_orbit_begins(rng):
    """Memory that nothing writes in a period stays as the first node of a guess has it; the others follow it."""
    system = bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.4), ElasticStop(0.3, 5.0), Jenkins(0.5, 40.0)], omega=0.8)
    orbit = bf.find_orbit(system)
    e, (place,) = orbit.equations, orbit.family
    assert orbit.success and len(e.signature.nodes) == 2
    guess = np.append(orbit.unknowns, 0.0)
    guess[:-1] += 1e-3 * e.scale[:-1] * rng.normal(size=e.size)
    tangent = np.zeros(guess.size)
    tangent[-1] = 1.0
    status, found, _, _ = e.correct(guess, tangent, False)
    labels, given = (np.reshape(x[:-1], (2, -1))[:, 1 + place] for x in (found, guess))
    assert status == 1 and abs(given[1] - given[0]) > 1e-4
    np.testing.assert_allclose(labels, given[0], rtol=0, atol=1e-13)


# ---- signatures ----------------------------------------------------------------------------------------------------------------


def test_a_half_orbit_is_written_out_as_its_mirror_image():
    found = bf.find_orbit(BOTH)
    half, U = found.sequence, found.unknowns
    assert half.closure == -1 and half.span == 0.5 and half.text(found.scene) == "rigid_stop.impact / 0.5 T (half)" or \
        half.text(found.scene) == "rigid_stop_2.impact / 0.5 T (half)"
    whole, V = repeated(found.scene, half, U)
    rows = V.reshape(2, 3)
    assert whole.span == 1.0 and whole.closure == 1 and whole.events == 2 and half.events == 1
    assert rows[1].tolist() == pytest.approx([rows[0, 0] + 0.5, -rows[0, 1], -rows[0, 2]])
    first, second = whole.nodes[:, 1]
    assert {first, second} == {0, 1} and (whole.nodes[:, 0] == whole.nodes[0, 0]).all()
    full = bf.find_orbit(BOTH, closure=1)
    assert full.closure == 1 and full.multipliers == pytest.approx(found.multipliers, rel=1e-6)
    assert half.key == Signature(half.nodes.copy(), half.fixed.copy(), 0.5, -1).key != Signature(half.nodes, half.fixed, 0.5).key
    maps = [one.closing(one.labels(found.scene)).tolist() for one in (half, whole)]
    assert maps == [[[-1.0, -1.0]], [[1.0, 1.0]]]
    assert repeated(found.scene, whole, V)[0] is whole


def test_words_for_sequences():
    scene = scene_of(bf.System(1.0, 0.1, 1.0, [HarmonicForce(), RigidStop(0.5, 0.7), ElasticStop(0.5, 2.0, side=-1)], omega=1.0))
    free, rest = scene.index(("always", "free", "free")), scene.index(("always", "rest", "free"))
    touching = scene.index(("always", "free", "contact"))
    hit, begin = scene.guards_of(free, 1)[0], scene.guards_of(free, 2)[0]
    nodes = [[free, hit, free, 0, 0], [free, hit, free, 0, 0], [free, begin, touching, 0, 0],
             [touching, scene.guards_of(touching, 2)[0], free, 0, 0], [free, hit, rest, 0, 1]]
    said = Signature(np.array(nodes), np.zeros(5), 3.0).text(scene)
    assert said == "rigid_stop.impact x2, elastic_stop.contact, elastic_stop.separation, rigid_stop.impact... / 3 T"
    for mode, word in ((free, "free"), (rest, "rest"), (touching, "in contact")):
        assert sections(mode, 2.0).text(scene) == f"{word} / 2 T"
    assert sections(free, 0.5, -1).text(scene) == "free / 0.5 T (half)"
    section = sections(free, 2.0)
    assert section.nodes.tolist() == [[free, -1, free, 0, 0]] and section.events == 0 and section.fixed.tolist() == [0.0]
    belt = scene_of(BELT)
    carried = Signature(np.array([[belt.index(("stick",)), -1, belt.index(("stick",)), 0, 0]]), np.zeros(1), 1.0, clock=2.0)
    assert carried.text(belt) == "carried / T"
    other = Signature(carried.nodes, carried.fixed, 0.0, clock=2.0)
    written, U = other.written_out(np.array([0.7, 1.0, 2.0]))
    assert written.span == 0.7 and U.tolist() == [0.0, 1.0, 2.0] and written.clock == 2.0 and carried.written_out(U)[0] is carried


def test_orders_of_trivial_zeros():
    """Of a guard just after its own event, from the series of random states that obey the event."""
    scene = scene_of(bf.System(1.0, 0.1, 1.0, [HarmonicForce(0.7), RigidStop(0.5, 0.7), ElasticStop(0.2, 3.0)], omega=1.3))
    free = scene.index(("always", "free", "free"))
    touching = scene.index(("always", "free", "contact"))
    begin, end = scene.guards_of(free, 2)[0], scene.guards_of(touching, 2)[0]
    nodes = divided(scene, np.array([[free, begin, touching, 0, 0], [touching, end, free, 0, 0]]))
    assert nodes[:, 3].tolist() == [1, 1]  # both close on the surface on which they opened
    hit = scene.guards_of(free, 1)[0]
    bounce = divided(scene, np.array([[free, hit, free, 0, 0]]))
    assert bounce[0, 3] == 1 and bounce[0, 5] == hit
    assert divided(scene, np.array([[free, -1, free, 0, 0]]))[0, 3] == 0
    friction = scene_of(bf.System(1.0, 0.1, 1.0, [HarmonicForce(0.7), Coulomb(0.3)], omega=1.3))
    stick, up, down = (friction.index(("always", key)) for key in ("stick", "slip+", "slip-"))
    lets_up = friction.guards_of(stick, 1)[0]
    slip = divided(friction, np.array([[stick, lets_up, up, 0, 0], [up, 0, stick, 0, 0]]))
    assert slip[1, 3] == 2  # speed and acceleration vanish where a slip begins
    turn = divided(friction, np.array([[up, 0, down, 0, 0], [down, 0, up, 0, 0]]))
    assert turn[:, 3].tolist() == [1, 1]
    assert translated(Signature(slip, np.zeros(2), 1.0), friction, friction).nodes is slip


TOGETHER = (
    ((RigidStop(0.5, 0.7), ElasticStop(0.5, 3.0), Coulomb(0.3)), True),  # at rest on one surface, it lies on the other
    ((RigidStop(0.5, 0.0), ElasticStop(0.2, 3.0), Coulomb(0.3, belt_speed=0.4)), False),
    ((RigidStop(0.5, 0.7), Jenkins(2.0, 0.4)), True),
)


@pytest.mark.parametrize(("elements", "some"), TOGETHER)
def test_guards_that_held_rows_keep_at_zero(elements, some, rng):
    """Those that are zero at random states on the surfaces and at the speeds that a mode holds, and no others."""
    scene = scene_of(bf.System(1.0, 0.1, 1.0, [HarmonicForce(0.7), *elements], omega=1.3))
    keys = {"RigidStop": ("free", "rest"), "ElasticStop": ("free", "contact"), "Coulomb": ("stick", "slip+", "slip-"),
            "Jenkins": ("stick", "slip+", "slip-")}
    modes, seen = [], 0
    for choice in itertools.product(*(keys[type(element).__name__] for element in elements)):
        with contextlib.suppress(ValueError, KeyError):  # rows that are held twice are no mode
            modes.append(scene.index(("always", *choice)))
    T = scene.tables
    for mode in modes:
        held = range(int(T.n_holds[mode]))
        rows = np.array([row for k in held for row in (T.H[mode, k], T.S[mode, k])]).reshape(-1, T.A.shape[2])
        states = rng.normal(size=(6, T.A.shape[2]))
        if rows[:, :scene.ns].any():
            states[:, :scene.ns] -= np.linalg.lstsq(rows[:, :scene.ns], rows @ states.T, rcond=None)[0].T
        np.testing.assert_allclose(rows @ states.T, 0.0, atol=1e-12)
        zero = [g for g in range(int(T.n_guards[mode])) if np.abs(states @ T.G[mode, g]).max() < 1e-12]
        assert held_guards(T, mode) == zero
        orders = start_orders(scene, T, mode, -1, mode, 0)
        assert [g for g, order in enumerate(orders) if order == FOREVER] == zero
        seen += len(zero)
    assert (seen > 0) == some


def test_an_event_coincides_with_that_of_an_element_that_waited_on_the_same_row():
    """Of two stops at one place the second is met at the instant of the first; not at another place, not where its mode has
    changed meanwhile, and not behind an impact, which throws back."""
    def scene_with(*elements):
        return scene_of(bf.System(1.0, 0.1, 1.0, [HarmonicForce(0.7), *elements], omega=1.3))

    def together(scene, keys, owner, then, other):
        before, after = scene.index(("always", *keys)), scene.index(("always", *then))
        fired, guard = scene.guards_of(before, owner)[0], scene.guards_of(after, other)[-1]
        return coincide(scene, scene.tables, np.array([before, fired, after, 0, 0]), guard)
    free, first, second = ("free", "free"), ("contact", "free"), ("free", "contact")
    same = scene_with(ElasticStop(0.5, 3.0), ElasticStop(0.5, 7.0))
    assert together(same, free, 1, first, 2) and together(same, free, 2, second, 1)
    assert not together(same, free, 1, first, 1)
    assert not together(same, free, 1, ("contact", "separating"), 2)
    assert not together(scene_with(ElasticStop(0.5, 3.0), ElasticStop(0.6, 7.0)), free, 1, first, 2)
    assert not together(scene_with(ElasticStop(0.5, 3.0), ElasticStop(0.5, 7.0, side=-1)), free, 1, first, 2)
    assert not together(scene_with(RigidStop(0.5, 0.7), ElasticStop(0.5, 7.0)), free, 1, free, 2)


@pytest.mark.parametrize("beta", [0.0, 1.0, 1e6, 1e10])
def test_orders_behind_an_impact_are_the_same_beside_a_stiff_law(beta):
    """A rotor is thrown back with the speed with which it came, however fast a spring law turns it round then."""
    elements = [HarmonicForce(0.7), CubicSpring(beta), RigidStator(restitution=0.7, friction=0.1)]
    scene = scene_of(bf.System(np.eye(2), 0.1 * np.eye(2), np.eye(2), elements, omega=1.3))
    free = scene.index(("always", "always", "free"))
    hit = scene.guards_of(free, 2)[0]
    bounce = divided(scene, np.array([[free, hit, free, 0, 0]]))
    assert bounce[0, 3] == 1 and start_orders(scene, scene.tables, free, hit, free, 0)[hit] == 1


def test_which_values_at_the_start_of_an_interval_are_conditions():
    """Behind an impact, where a row begins to be held, and where the event makes the guard another row; of no surface, of nothing
    that is zero there anyway; of the guard that ends the interval only where it falls first: else it has one zero, at the end."""
    def condition(guard=0, trivial=0, surface=0, kick=0, holds=(0, 0), other=False, listed=0, rate=1.0,
                  row=(1.0, 0.2)):
        def series(T, mode, q, x, a):
            assert (mode, q) == (1, 1)
            a[1] = rate
        nodes = np.zeros((1, STARTS + 2), np.int64)
        nodes[0, :3], nodes[0, STARTS + 1] = (0, guard, 1), trivial
        G = np.array([[[3.0, 0.0], [1.0, 0.2]], [[4.0, 0.0], row]])
        T = SimpleNamespace(LP=np.zeros((1, 1, 2)), kick=np.array([[kick, 0], [0, surface]]),
                            n_holds=np.array(holds), n_guards=np.array([2, 2]),
                            H=np.array([np.eye(2, 3), np.eye(2, 3)[::-1 if other else 1]]), element=np.array([[0, 1], [0, 1]]), G=G)
        return bool(plain(sequence.starts_beyond, guard_series=series)(T, nodes, 0, 1, np.zeros(3), listed, np.zeros(4)))
    assert condition(kick=1) and condition(holds=(0, 1)) and condition(holds=(2, 1)) and condition(holds=(1, 1), other=True)
    assert not condition() and not condition(holds=(1, 1)) and not condition(holds=(1, 0))
    for begins in ({"kick": 1}, {"holds": (0, 1)}, {"row": (1.0, 0.3)}, {"row": (1.0, 0.2 - 1e-9), "holds": (1, 1)}):
        assert not condition(guard=-1, **begins) and not condition(surface=1, **begins)
        assert not condition(trivial=2, **begins) and not condition(trivial=-1, **begins)
        assert condition(listed=1, rate=-0.1, **begins) and not condition(listed=1, rate=0.1, **begins)
        assert condition(listed=0, rate=0.1, **begins)


# ---- along a parameter ---------------------------------------------------------------------------------------------------------


def test_a_path_of_all_modes_reaches_as_far_and_has_those_met_since():
    """Of a scene whose modes are built when they are met; of one without a parameter, too."""
    stops = [RigidStop(0.3 + 0.1 * i, 0.5, dof=i) for i in range(7)]
    K = 2.0 * np.eye(7) - np.eye(7, k=1) - np.eye(7, k=-1)
    chain = bf.System(np.eye(7), 0.1 * np.eye(7), K, [HarmonicForce(0.5), *stops], omega=0.4)
    scene = scene_of(chain)
    known = len(scene.keys)
    along, still = path.parameter_path(scene, chain, "omega", (0.3, 0.7)), path.constant_path(scene, chain)
    assert path.of_all_modes(scene, along) is along and not scene.complete
    scene.expand(0, 2)
    more, other = path.of_all_modes(scene, along), path.of_all_modes(scene, still)
    assert (more.low, more.high, more.name) == (along.low, along.high, "omega")
    assert len(more.tables.n_guards) == len(other.tables.n_guards) == len(scene.keys) == known + 1 and other.name is None
    z = 0.3
    for part in (along, more):
        flat = part.tables.flat.copy()
        flat[part.index] = np.polynomial.chebyshev.chebval(z, part.series.T)
        moved = chain.with_parameters(omega=0.5 * (part.low + part.high) + 0.5 * z * (part.high - part.low))
        assert flat[0] == pytest.approx(moved.omega, rel=1e-14)


def test_numbers_along_a_parameter_are_those_of_the_system():
    system = bf.systems.jeffcott_rotor(contact_damping=0.3)
    linear = bf.systems.moving_frame_impact_oscillator(damper="ground")
    for made, name, bounds in ((linear, "omega", (2.0, 0.5)), (linear, "zeta", (0.1, 0.3)), (PAIR, "omega", (0.9, 1.3)),
                               (system, "nu", (0.9, 1.2))):
        scene = scene_of(made)
        along = path.parameter_path(scene, made, name, bounds)
        assert along.low < min(bounds) and along.high > max(bounds) and along.name == name
        assert along.high - along.low == pytest.approx(1.04 * abs(bounds[1] - bounds[0]))
        for value in np.linspace(*bounds, 5):
            z = (2.0 * value - along.low - along.high) / (along.high - along.low)
            flat = along.tables.flat.copy()
            flat[along.index] = np.polynomial.chebyshev.chebval(z, along.series.T)
            known = scene.flat_of(made.with_parameters(**{name: float(value)}))
            assert flat == pytest.approx(known, rel=1e-13, abs=1e-14)
    scene = scene_of(linear)
    tight = path.parameter_path(scene, linear, "restitution", (0.5, 1.0))  # the pad leaves what is allowed
    assert (tight.low, tight.high) == (0.5, 1.0)
    still = path.constant_path(scene, linear)
    assert still.index.size == 0 and np.array_equal(still.tables.flat, scene.tables.flat) and still.tables is not scene.tables
    with pytest.raises(ValueError, match="restitution = 1.2"):
        path.parameter_path(scene, linear, "restitution", (0.5, 1.2))
    known: dict = {}
    first = path.sampled_over(known, linear, "omega", (0.5, 2.0), scene.flat_of)
    assert path.sampled_over(known, linear.with_parameters(omega=0.7), "omega", (2.0, 0.5), None) is first
    assert len(known) == 1 and path.sampled_over(known, linear, "omega", (0.5, 2.1), scene.flat_of) is not first
    for k in range(20):
        known[k] = None
        path.sampled_over(known, linear, "omega", (0.5, 2.2 + 0.1 * k), scene.flat_of, degrees=(4,)) if k > 17 else None
    with pytest.raises(ValueError, match="are no smooth function of it .no polynomial of degree 8 fits"):
        path.series_over(linear, "omega", (0.5, 2.0), lambda s: np.array([abs(s.parameter("omega") - 1.1)]), degrees=(4, 8))
    with pytest.raises(ValueError, match="no polynomial of degree 64"):
        path.series_over(linear, "omega", (0.5, 2.0), lambda s: np.array([abs(s.parameter("omega") - 1.1)]))


@pytest.mark.parametrize("place", path.CHECKS)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_number_that_leaves_its_series_at_any_check_to_either_side_is_refused(place, sign):
    """Polynomials of degree 2 beside one that has a bump, which the nodes do not see."""
    system = bf.systems.impact_oscillator()

    def numbers(height):
        def packed(made):
            w = made.parameter("omega")
            z = (w - 1.25) / 0.75
            return np.array([7.0, w, 3.0 * w * w, 2.0 - w + sign * height * (abs(z - place) < 1e-9)])
        return packed
    index, series, low, high = path.series_over(system, "omega", (0.5, 2.0), numbers(0.0), pad=0.0)
    assert index.tolist() == [1, 2, 3] and (low, high) == (0.5, 2.0) and series.shape == (3, 3)
    # w = 1.25 + .75 z, w^2 = 1.5625 + 1.875 z + .5625 z^2, z^2 = (T_0 + T_2) / 2
    assert series == pytest.approx(np.array([[1.25, 0.75, 0.0], [5.53125, 5.625, 0.84375], [0.75, -0.75, 0.0]]), rel=1e-14)
    with pytest.raises(ValueError, match="are no smooth function of it"):
        path.series_over(system, "omega", (0.5, 2.0), numbers(1e-6), pad=0.0)


def test_a_series_is_as_long_as_its_function_asks_for():
    """Of 4 / (4 + z^2), with poles at 2i and -2i, every second coefficient falls by (sqrt 5 - 2)^2."""
    system = bf.systems.impact_oscillator()

    def bell(made):
        z = (made.parameter("omega") - 1.25) / 0.75
        return np.array([1.0 / (1.0 + 0.25 * z * z)])
    index, series, *_ = path.series_over(system, "omega", (0.5, 2.0), bell, pad=0.0)
    ratio = math.sqrt(5.0) - 2.0
    even = series[0, ::2]
    assert index.tolist() == [0] and np.abs(series[0, 1::2]).max() < 1e-14
    assert even[1:6] / even[:5] == pytest.approx([-2.0 * ratio**2] + 4 * [-ratio**2], rel=1e-9)
    with pytest.raises(ValueError, match="no polynomial of degree 8 fits"):
        path.series_over(system, "omega", (0.5, 2.0), bell, pad=0.0, degrees=(4, 8))


def test_motions_with_a_stated_neutral_band():
    for values, told in (([0.5, -0.3], True), ([1.5], False), ([1.0], None), ([1.0 + 0.5e-8], None), ([1.0 + 2e-8], False),
                         ([1.0 - 2e-8], True), ([1j * 0.9], True), ([], True)):
        assert multipliers.attracting(np.array(values, complex)) is told


# ---- energies, turns -----------------------------------------------------------------------------------------------------------


def test_which_systems_keep_their_energy():
    gyro = np.array([[0.0, 0.7], [-0.7, 0.0]])
    springs = [CubicSpring(0.5), ElasticStop(0.2, 3.0, dof=1), RigidStop(0.9, 1.0), LinearSpring(1.0), ConstantForce(0.1)]
    for C, K, parts, keeps in ((gyro, np.eye(2), springs, True), (0.1 * np.eye(2), np.eye(2), springs, False),
                               (0.0 * gyro, np.eye(2) + 0.1 * gyro, [], False), (gyro, np.eye(2), [RigidStop(0.9, 0.9)], False),
                               (gyro, np.eye(2), [LinearSpring(1.0, 0.1)], False)):
        assert energy.conservative(bf.System(np.eye(2), C, K, parts)) is keeps
    assert not energy.conservative(bf.System(1.0, 0.0, 1.0, [HarmonicForce()], omega=1.0))
    assert not energy.conservative(bf.System(1.0, 0.0, 1.0, omega=1.0))
    M, K = np.array([[2.0, 0.3], [0.3, 1.0]]), np.array([[3.0, -1.0], [-1.0, 2.0]])
    system = bf.System(M, gyro, K, springs)
    q, v = np.array([0.4, 0.6]), np.array([-0.3, 0.8])
    stored = 0.125 * 0.4**4 + 1.5 * 0.4**2 + 0.0 + 0.5 * 0.4**2 - 0.1 * 0.4
    assert bf.energy(system, [*q, *v]) == pytest.approx(0.5 * v @ M @ v + 0.5 * q @ K @ q + stored, rel=1e-14)
    with pytest.raises(ValueError, match="is not defined: rigid_stop does not keep it"):
        bf.energy(bf.System(1.0, 0.0, 1.0, [RigidStop(0.9, 0.9)]), (0.0, 0.0))


def test_equations_of_a_given_energy():
    """Residual zero at the motion of that energy, derivatives by differences; the unfolding is a damping."""
    system = bf.System(1.0, 0.0, 1.0, [CubicSpring(1.0), ElasticStop(0.5, 2.0)])
    found = bf.find_orbit(system, (0.9, 0.0), period=5.0)
    assert found.success and found.stable is None and len(found.multipliers) == 0
    E = found.energy
    assert E == pytest.approx(bf.energy(system, found.state), rel=1e-10)
    equations = energy.EnergyEquations(system, found.sequence, found.weights)
    u = np.append(found.unknowns, 0.0)
    assert np.abs(equations.residual(u, E)).max() < 1e-11
    assert equations.residual(u, E + equations.unit)[-1] == pytest.approx(-1.0)
    assert equations.unit == pytest.approx(0.5 * found.weights[1]**2)
    J, h = equations.jacobian(u), 1e-6
    for c in range(u.size):
        d = np.zeros(u.size)
        d[c] = h
        assert J[:, c] == pytest.approx((equations.residual(u + d, E) - equations.residual(u - d, E)) / (2.0 * h), abs=2e-5)
    made = energy.corrected(system, found.sequence, found.unknowns, found.weights, 1.05 * E)
    assert made.success and abs(made.x[-1]) < 1e-9
    assert bf.energy(system, made.x[1:3]) == pytest.approx(1.05 * E, rel=1e-9)
    along = energy.unfolding_path(scene_of(system), system)
    flat = along.tables.flat.copy()
    flat[along.index] = along.series @ [1.0, 0.3]
    damped = scene_of(bf.System(1.0, 0.3 * np.sqrt(3.0), 1.0, system.elements))  # in units of the rate on the stop
    assert flat == pytest.approx(damped.tables.flat, abs=1e-14)


def test_systems_without_a_special_direction():
    turning = (HarmonicForce(0.5, dof=0), HarmonicForce(0.5, dof=1, phase=-0.5 * np.pi))
    stator = ElasticStator(radius=0.5, surface_speed=2.0)
    quarter = np.array([[0.0, -1.0], [1.0, 0.0]])

    def told(*parts, K=None, C=None):
        return concentric.concentric(bf.System(np.eye(2), 0.1 * np.eye(2) if C is None else C, np.eye(2) if K is None else K, parts,
                                               omega=1.0))

    assert told(*turning, stator) and told(turning[0], HarmonicForce(0.5, dof=1, phase=0.5 * np.pi), stator)  # backwards
    assert told(*turning, stator, C=0.1 * np.eye(2) + 0.3 * quarter, K=np.eye(2) + 0.2 * quarter)
    assert not told(*turning, stator, K=np.diag([1.0, 1.1])) and not told(*turning, stator, C=np.diag([0.1, 0.2]))
    assert not told(turning[0], stator) and not told(*turning, stator, ConstantForce(0.1, dof=1))
    assert not told(*turning, ElasticStator(centre_x=0.1)) and not told(*turning, stator, RigidStop(2.0))
    assert not told(*turning, stator, HarmonicForce(0.1, 2)) and not told(*turning)
    assert not told(turning[0], HarmonicForce(0.5 + 1e-9, dof=1, phase=-0.5 * np.pi), stator)
    for unit in (1e-15, 1.0, 1e15):  # of mass: a thousandth apart is apart, the last digits are not
        loads = [HarmonicForce(0.5 * unit, dof=0), HarmonicForce(0.5 * unit, dof=1, phase=-0.5 * np.pi), stator]
        for part, same in ((1e-14, True), (1e-3, False)):
            ends = unit * np.diag([1.0, 1.0 + part])
            for M, K in ((ends, unit * np.eye(2)), (unit * np.eye(2), ends)):
                assert concentric.concentric(bf.System(M, 0.1 * unit * np.eye(2), K, loads, omega=1.0)) is same
    four = bf.systems.rotor_in_casing()
    turn = concentric.generator(four)
    assert turn.tolist() == np.kron(np.eye(2), quarter).tolist() and concentric.concentric(four)
    assert concentric.generator(bf.System(np.eye(3), np.eye(3), np.eye(3), [stator])) is None
    assert not concentric.concentric(bf.systems.jeffcott_rotor()) and concentric.concentric(
        bf.systems.jeffcott_rotor(offset=0.0, gravity=0.0))


# ---- Lyapunov exponents --------------------------------------------------------------------------------------------------------


def test_exponents_of_linear_motions():
    K, C = np.array([[2.0, -0.5], [-0.3, 1.0]]), np.array([[0.3, 0.1], [-0.2, 0.4]])
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-K, -C]])
    for elements, omega, unit in (([HarmonicForce()], 1.3, 2.0 * np.pi / 1.3), ([], None, 2.5)):
        system = bf.System(np.eye(2), C, K, elements, omega=omega)
        found = bf.lyapunov_exponents(system, periods=47, transient=80, batches=5, period=None if omega else unit)
        assert found.periods == 45
        assert found.values == pytest.approx(np.sort(np.linalg.eigvals(A).real)[::-1], abs=5e-3)
        assert found.sum_rule == pytest.approx(-0.7, rel=1e-12) and found.values.sum() == pytest.approx(-0.7, rel=1e-9)
        assert found.per_period == pytest.approx(found.values * unit) and found.impacts == 0.0 and not found.chaotic
        assert found.errors.shape == (4,) and (found.errors >= 0.0).all()
    with pytest.raises(ValueError, match="period = 1.0 is not allowed; the excitation"):
        bf.lyapunov_exponents(FLIP, period=1.0)
    for given, words in (({"batches": 3}, "batches = 3"), ({"periods": 9, "batches": 5}, "periods = 9"),
                         ({"transient": -1}, "transient = -1"), ({"max_events": 0}, "max_events = 0")):
        with pytest.raises(ValueError, match=words):
            bf.lyapunov_exponents(FLIP, **given)
    with pytest.raises(ValueError, match="lyapunov_exponents: period = 0.0"):
        bf.lyapunov_exponents(BELT, period=0.0)


def test_exponents_of_impacts_obey_the_sum_rule():
    """Divergence -2 zeta, and r^2 an impact; the number of impacts is that of the simulation."""
    system = bf.systems.impact_oscillator(omega=2.8, amplitude=1.0, gap=0.0, restitution=0.8)
    found = bf.lyapunov_exponents(system, (-0.5, 0.0), periods=60, transient=10, batches=4)
    motion = bf.simulate(system, (-0.5, 0.0), periods=70)
    count = sum(e.kind == "impact" and e.time > 10 * system.period for e in motion.events)
    assert found.impacts == pytest.approx(count / 60) and found.state == pytest.approx(motion.final, abs=1e-4)
    expected = -0.1 + 2.0 * np.log(0.8) * count / (60 * system.period)
    assert found.sum_rule == pytest.approx(expected, rel=1e-10) and found.values.sum() == pytest.approx(expected, rel=1e-6)
    orbit = bf.find_orbit(FLIP)
    own = bf.lyapunov_exponents(FLIP, orbit)
    assert own.values == pytest.approx(np.log(np.abs(orbit.multipliers)) / orbit.period)
    assert own.impacts == pytest.approx(len(orbit.events) / orbit.periods) and (own.errors == 0.0).all()
    with pytest.raises(ValueError, match="the orbit is one of another system"):
        bf.lyapunov_exponents(system, orbit)


# ---- what find_orbit refuses ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("system, given, words", [
    (FLIP, {"period": 1.0}, "period = 1.0 is not allowed; the excitation of .* gives it, say how many in periods="),
    (BELT, {"periods": 2}, "periods = 2 is not allowed; .* has no excitation, say about how long in period="),
    (FLIP, {"periods": 0}, "find_orbit: periods = 0 is not allowed; it must be a whole number, at least 1"),
    (FLIP, {"periods": True}, "periods = True is not allowed"), (FLIP, {"periods": 1.5}, "periods = 1.5 is not allowed"),
    (FLIP, {"closure": 2}, "find_orbit: closure = 2 is not allowed; it must be one of 1, -1$"),
    (FLIP, {"closure": -1}, "closure = -1 is not allowed; .* is not symmetric under y -> -y"),
    (FLIP, {"transient": -1}, "find_orbit: transient = -1"), (FLIP, {"guess": (1.0,)}, "guess has shape"),
    (FLIP, {"guess": (1.0, np.nan)}, "guess = .* must be finite"), ("x", {}, "system = 'x' is not allowed")])
def test_bad_arguments_are_named(system, given, words):
    with pytest.raises(ValueError, match=words):
        bf.find_orbit(system, **given)


def test_equations_by_hand_get_their_orders():
    found = bf.find_orbit(BOTH, closure=1)
    s = found.sequence
    bare = Signature(s.nodes[:, :5], s.fixed, s.span)
    made = Equations(found.scene, path.constant_path(found.scene, BOTH), bare, found.weights)
    assert np.array_equal(made.signature.nodes, divided(found.scene, s.nodes[:, :5]))
    assert np.abs(made.residual(np.append(found.unknowns, 0.0))).max() < 1e-11


def test_events_of_a_balance_pass_with_the_speed_of_its_motion():
    """Contact and separation of an elastic stop: its guard rises with the speed of the mass towards it, and from it, per time."""
    for omega in (0.5, 1.7):
        orbit = bf.find_orbit(bf.systems.bilinear_oscillator(omega=omega, amplitude=1.5), method=bf.HarmonicBalance(15))
        kinds = [str(event.kind) for event in orbit.events]
        assert orbit.success and kinds.count("contact") == kinds.count("separation") >= 1
        for event in orbit.events:
            assert event.speed > 0.0
            assert event.before[1] == pytest.approx(event.speed if event.kind == "contact" else -event.speed, rel=1e-9)


@pytest.mark.parametrize(("first", "third"), [(1.6, 0.7), (2.2, 0.9)])
def test_sliders_that_stuck_together_and_come_back_slip_together(first, third):
    """A load with a dip at its top: both stick, both slip again where they did (Masing), but reach their limits one after the other
    when the load turns round for good. Told together is what has one time, and nothing else."""
    loads = (HarmonicForce(first), HarmonicForce(third, 3, np.pi))
    orbit = bf.find_orbit(bf.System(1.0, 1.5, 1.0, [*loads, Jenkins(2.0, 0.3), Jenkins(1.0, 0.4)], omega=0.3))
    nodes, span = orbit.sequence.nodes, orbit.sequence.span
    times = orbit.unknowns.reshape(len(nodes), -1)[:, 0]
    at_once = np.abs(times - np.roll(times, 1) + span * (np.arange(len(nodes)) == 0)) < 1e-9
    slips = [orbit.scene.event_kind(m, g) == "slip" for m, g in nodes[:, :2].tolist()]
    assert orbit.success and orbit.closure < 0 and np.count_nonzero(at_once & slips) == 1  # in half a period
    np.testing.assert_array_equal(nodes[:, sequence.DIVIDE] == sequence.TOGETHER, at_once)


@pytest.mark.parametrize("noise", [4e-9, np.array([4e-9, 0.0, 0.0])])
def test_numbers_in_which_larger_ones_cancel_are_fitted_to_their_noise(noise):
    """z^2 beside 1e7 is known to 2e-9, z^3 is to rounding; a constant is no part of what changes."""
    def sample(z):
        return np.array([(1e7 + z * z) - 1e7, z**3, 5.0])
    checks = np.array([sample(z) for z in path.CHECKS])
    assert path.fitted(sample, 0.0, 1.0, checks, (4, 8), 0.0) is None
    places, series = path.fitted(sample, 0.0, 1.0, checks, (4, 8), noise)
    assert places.tolist() == [0, 1]
    np.testing.assert_allclose(series[0], np.pad([0.5, 0.0, 0.5], (0, series.shape[1] - 3)), rtol=0, atol=4e-9)
    np.testing.assert_allclose(series[1], np.pad([0.0, 0.75, 0.0, 0.25], (0, series.shape[1] - 4)), rtol=0, atol=1e-15)
    wrong = checks + [[0.0, 1e-6, 0.0]] * len(checks)  # what does not fit stays unfit
    assert path.fitted(sample, 0.0, 1.0, wrong, (4, 8), noise) is None
