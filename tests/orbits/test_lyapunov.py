"""Lyapunov exponents: through friction, laws, from rest, motions and orbits; their errors."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.compose.writer import kernels
from bifurc.elements import ConstantForce, Coulomb, CubicSpring, HarmonicForce, Jenkins, RigidStop, Stribeck
from bifurc.orbits import lyapunov

CHAOTIC = {"omega": 2.8, "amplitude": 1.0, "gap": 0.0, "restitution": 0.8}


def test_dry_friction_that_sticks_forgets_one_direction():
    """The other one shrinks by .46865052 a period, the multiplier of the orbit."""
    system = bf.systems.dry_friction_oscillator()
    found = bf.lyapunov_exponents(system, periods=80, transient=60)
    np.testing.assert_allclose(found.values[0], np.log(0.46865052) / system.period, rtol=0, atol=1e-8)
    assert found.values[1] == -np.inf and found.errors[1] == 0.0 and found.sum_rule == -np.inf and not found.chaotic


def test_of_an_orbit_from_its_multipliers():
    system = bf.systems.dry_friction_oscillator()
    orbit = bf.find_orbit(system)
    found = bf.lyapunov_exponents(system, orbit)
    np.testing.assert_allclose(found.values[0], np.log(abs(orbit.multipliers[0])) / orbit.period, rtol=1e-14)
    assert found.values[1] == -np.inf and not found.errors.any()
    with pytest.raises(ValueError, match="another system"):
        bf.lyapunov_exponents(system.with_parameters(omega=1.1 * system.omega), orbit)


def test_memory_that_nothing_writes_neither_grows_nor_dies():
    """An elastic slider that never slips keeps its memory: of three exponents one is zero, the others are those of the spring."""
    slider = Jenkins(stiffness=3.0, limit=50.0)
    system = bf.System(1.0, 0.2, 1.0, (HarmonicForce(0.3), slider), omega=1.2)
    found = bf.lyapunov_exponents(system, bf.find_orbit(system))
    np.testing.assert_allclose(found.values, [0.0, -0.1, -0.1], rtol=0, atol=1e-12)


def test_from_rest_and_from_a_motion():
    system = bf.systems.impact_oscillator(omega=1.5, amplitude=0.9)
    motion = bf.simulate(system, (0.0, 0.0), periods=120)
    orbit = bf.find_orbit(system)
    exact = bf.lyapunov_exponents(system, orbit)
    for start in (None, motion):
        found = bf.lyapunov_exponents(system, start, periods=40, transient=400)
        np.testing.assert_allclose(found.values.sum(), exact.values.sum(), rtol=0, atol=1e-7)
        np.testing.assert_allclose(found.values, exact.values, rtol=0, atol=0.05)  # complex multipliers turn: averages wander


def test_errors_are_those_of_independent_pieces():
    """The spread of the exponent over pieces of a chaotic motion is what each piece says of its own error."""
    system = bf.systems.impact_oscillator(**CHAOTIC)
    pieces, y = [], (-0.5, 0.0)
    for _ in range(24):
        pieces.append(bf.lyapunov_exponents(system, y, periods=400, transient=40))
        y = pieces[-1].state
    spread = np.std([piece.values[0] for piece in pieces], ddof=1)
    told = np.median([piece.errors[0] for piece in pieces])
    assert 0.6 < spread / told < 1.6
    for piece in pieces:
        np.testing.assert_allclose(piece.values.sum(), piece.sum_rule, rtol=0, atol=1e-12)


def test_a_law_loses_what_its_dashpot_takes():
    """Duffing: the exponents add up to -c; a falling friction on a belt has one that dies in stick."""
    duffing = bf.System(1.0, 0.2, -1.0, (HarmonicForce(0.3), CubicSpring(1.0)), omega=1.2)
    found = bf.lyapunov_exponents(duffing, (0.1, 0.0), periods=200)
    np.testing.assert_allclose(found.values.sum(), -0.2, rtol=0, atol=1e-12)
    np.testing.assert_allclose(found.sum_rule, -0.2, rtol=0, atol=1e-11)
    belt = bf.System(1.0, 0.05, 1.0, (HarmonicForce(0.3), Stribeck(kinetic=0.5, static=1.0, speed=0.4, belt_speed=0.3)), omega=2.0)
    found = bf.lyapunov_exponents(belt, periods=60, transient=20)
    assert np.isfinite(found.values[0]) and found.values[1] == -np.inf
    orbit = bf.find_orbit(belt, transient=80)
    assert not orbit.success and orbit.signature.startswith("carried")  # the mass on the belt is not at rest


def test_exponents_of_an_orbit_of_several_periods_are_per_forcing_period():
    """Two periods of the excitation: half of the logarithms of the multipliers each."""
    stop = bf.elements.ElasticStop(0.103, 152.0, damping=0.0934)
    system = bf.System(1.0, 0.034, 1.0, [bf.elements.HarmonicForce(0.635), stop], omega=0.66)
    orbit = bf.find_orbit(system)
    assert orbit.periods == 2
    found = bf.lyapunov_exponents(system, orbit)
    np.testing.assert_allclose(found.per_period, np.sort(np.log(np.abs(orbit.multipliers)))[::-1] / 2.0, rtol=1e-12)
    assert found.impacts == 0.0 and found.periods == 2


def test_what_is_held_from_the_beginning_has_the_same_exponents_as_what_comes_to_rest():
    """A mass under its limit of friction stands anywhere (0) and has no speed (-inf), one that rests on its stop has neither;
    beside a mass that sticks the other one has the exponents of its own oscillation, -c / 2."""
    friction = bf.System(1.0, 0.1, 1.0, [HarmonicForce(0.1), Coulomb(1.0)], omega=1.0)
    stop = bf.System(1.0, 0.1, 1.0, [ConstantForce(2.0), HarmonicForce(0.1), RigidStop(0.5, 0.5)], omega=1.0)
    for system, starts, wanted in ((friction, ((0.0, 0.0), (0.0, 0.3)), (0.0, -np.inf)),
                                   (stop, ((0.5, 0.0), (0.2, 0.0)), (-np.inf, -np.inf))):
        for y0 in starts:
            found = bf.lyapunov_exponents(system, y0, periods=80, transient=5)
            np.testing.assert_allclose(found.values, wanted, atol=1e-12)
            assert found.sum_rule == -np.inf and not found.chaotic
    two = bf.System(np.eye(2), 0.1 * np.eye(2), [[2.0, -1.0], [-1.0, 2.0]], [HarmonicForce(0.3), Coulomb(9.0, dof=1)], omega=1.0)
    values = bf.lyapunov_exponents(two, np.zeros(4), periods=400, transient=5).values
    assert values[3] == -np.inf and values[0] == pytest.approx(0.0, abs=1e-4)
    assert values[1:3].sum() == pytest.approx(-0.1, abs=1e-4)


@pytest.mark.parametrize("friction, restitution", [(0.25, 0.6), (0.25, 0.2), (0.0, 0.6)])
def test_impacts_are_counted_whether_or_not_a_direction_dies(friction, restitution):
    """Beside a mass that sticks, and with complete chattering, which counts once: as many a period as a simulation has."""
    elements = [HarmonicForce(1.5), RigidStop(0.4, restitution), *([Coulomb(friction, dof=1)] if friction else [])]
    system = bf.System(np.eye(2), 0.1 * np.eye(2), [[2.0, -0.3], [-0.3, 1.5]], elements, omega=1.1)
    found = bf.lyapunov_exponents(system, (0.0, 0.0, 0.0, 0.0), periods=80, transient=20)
    motion = bf.simulate(system, (0.0, 0.0, 0.0, 0.0), periods=100)
    hits = [event for event in motion.events if event.kind in ("impact", "chatter") and event.time > 20.0 * system.period]
    assert len(hits) > 100 and found.impacts == pytest.approx(len(hits) / 80)
    sticks = any(event.kind in ("stick", "chatter") for event in motion.events)
    assert np.isfinite(found.sum_rule) is not sticks and sticks == (friction > 0.0 or restitution < 0.5)
    assert (found.values[-1] == -np.inf) == sticks


def test_what_lets_go_keeps_its_volumes():
    """Volumes shrink by the damping in flight, from a release on; an impact takes the square of its ratio, a rest everything."""
    zeta, r = 0.05, 0.7
    system = bf.System(1.0, 2.0 * zeta, 1.0, [HarmonicForce(0.8), RigidStop(0.3, r)], omega=0.5)
    scene = scene_of(system)
    for start, kind in (((0.3, 0.0), "release"), ((-1.0, 0.0), "impact")):
        motion = bf.simulate(system, start, duration=4.0)
        first = motion.events[0]
        assert first.kind == kind
        count, begin = sum(event.kind == "impact" for event in motion.events), first.time if kind == "release" else 0.0
        kicks, log = lyapunov._contraction(scene, motion.recorded, motion.stop)
        assert kicks == count and log == pytest.approx(-2.0 * zeta * (4.0 - begin) + count * np.log(r**2), abs=1e-12)
    soft = bf.System(1.0, 2.0 * zeta, 1.0, [HarmonicForce(0.8), RigidStop(0.3, 0.3)], omega=0.5)
    rests = bf.simulate(soft, (-1.0, 0.0), periods=3)
    assert any(event.kind == "chatter" for event in rests.events)
    kicks, log = lyapunov._contraction(scene_of(soft), rests.recorded, rests.stop)
    assert log == -np.inf and kicks == sum(event.kind in ("impact", "chatter") for event in rests.events)


def test_exponents_are_sorted_with_their_own_errors():
    """A mass that creeps home (-.5 and -2 exactly) is listed before one that hits its stop in chaos, and knows nothing of it."""
    system = bf.System(np.eye(2), np.diag([2.5, 0.0]), np.eye(2), [
        bf.elements.HarmonicForce(0.3, dof=0), bf.elements.HarmonicForce(1.0, dof=1),
        bf.elements.RigidStop(gap=0.0, restitution=0.8, dof=1)], omega=2.8)
    found = bf.lyapunov_exponents(system, (0.0, -0.5, 0.0, 0.0), periods=200, transient=100)
    assert found.chaotic and (np.diff(found.values) < 0.0).all()
    assert found.values[2:] == pytest.approx([-0.5, -2.0], abs=1e-9)
    assert found.errors[:2].min() > 10.0 * found.errors[2] and found.errors[:2].min() > 4.0 * found.errors[3]


@pytest.mark.parametrize("unit", [1.0, 1e-4, 1e4])
def test_stated_errors_of_linear_systems_hold_the_decays_of_their_modes(unit):
    """Real parts of eigenvalues.  Two of a pair share one; nothing is random here, and yet an average ends somewhere."""
    apart = []
    for seed in range(25):
        rng = np.random.default_rng(seed)
        n = int(rng.integers(1, 4))
        A = rng.normal(size=(n, n))
        K = (A @ A.T + 0.3 * np.eye(n)) / unit**2
        C = 0.1 * K * unit + 0.05 * np.eye(n) / unit
        system = bf.System(np.eye(n), C, K, [bf.elements.HarmonicForce(1.0)], omega=float(rng.uniform(0.5, 2.0)) / unit)
        exact = np.sort(np.linalg.eigvals(np.block([[np.zeros((n, n)), np.eye(n)], [-K, -C]])).real)[::-1]
        found = bf.lyapunov_exponents(system, periods=400, transient=100)
        apart += list(np.abs(found.values - exact) / found.errors)
    apart = np.array(apart)
    assert apart.max() < 6.0 and (apart < 2.0).mean() > 0.95


@pytest.mark.parametrize("value, error, chaotic", [(0.1, 0.02, True), (0.1, 0.03, False), (-0.1, 0.0, False), (0.0, 0.0, False)])
def test_chaos_is_an_exponent_above_zero_by_four_of_its_errors(value, error, chaotic):
    from bifurc.orbits.lyapunov import LyapunovExponents

    found = LyapunovExponents(np.array([value, -1.0]), np.array([error, 0.1]), np.zeros(2), 0.0, -1.0, np.zeros(2), 10)
    assert found.chaotic is chaotic


@pytest.mark.parametrize("law", [[], [bf.elements.CubicSpring(1e-9)]], ids=["closed form", "law"])
@pytest.mark.parametrize("from_orbit", [True, False])
def test_directions_that_shrink_beyond_rounding_within_a_period_are_not_gone(law, from_orbit):
    """Roots of s^2 + 40 s + 1: the fast one takes e^-502 a period. No direction of a flow without events dies."""
    system = bf.System(1.0, 40.0, 1.0, [bf.elements.HarmonicForce(1.0), *law], omega=0.5)
    found = bf.lyapunov_exponents(system, bf.find_orbit(system) if from_orbit else None, periods=80, transient=10)
    slow, fast = -20.0 + np.sqrt(399.0), -20.0 - np.sqrt(399.0)
    np.testing.assert_allclose(found.values, (slow, fast), rtol=1e-7)
    assert found.sum_rule == pytest.approx(-40.0, rel=1e-9)
    assert (found.errors >= 0.0).all() and found.errors[1] > 0.0


def test_several_faint_directions_are_told_apart():
    C, K = np.array([[30.0, -5.0], [-5.0, 60.0]]), np.array([[2.0, -1.0], [-1.0, 2.0]])
    system = bf.System(np.eye(2), C, K, [bf.elements.HarmonicForce(1.0)], omega=0.3)
    roots = np.sort(np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-K, -C]])).real)[::-1]
    found = bf.lyapunov_exponents(system, bf.find_orbit(system))
    np.testing.assert_allclose(found.values, roots, rtol=1e-6)


def test_faint_directions_of_an_oil_film_have_the_sum_of_its_damping():
    """The divergence of the film's force over its mass, by differences of the force along the motion."""
    system = bf.systems.oil_film_rotor()
    orbit = bf.find_orbit(system)
    found = bf.lyapunov_exponents(system, orbit)
    scene, f = scene_of(system), np.empty(4)

    def rate(t, y, c):
        kernels(scene).field(scene.tables, 0, np.concatenate([y, scene.forcing(np.array([t]))[0]]), f)
        return f[c]

    times, states = orbit.sample(2001)
    divergence = [sum(rate(t, y + step, c) - rate(t, y - step, c) for c, step in enumerate(1e-5 * np.eye(4))) / 2e-5
                  for t, y in zip(times[:-1], states[:-1], strict=True)]
    assert np.isfinite(found.values).all()
    assert found.values.sum() == pytest.approx(np.mean(divergence), rel=1e-6)
    assert found.sum_rule == pytest.approx(np.mean(divergence), rel=1e-6)
