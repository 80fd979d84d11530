"""Free vibration without damping along its energy, against closed forms, and long arithmetic for the chain with a stop."""
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipk

import bifurc as bf
from bifurc import System
from bifurc import elements as el


def bilinear(E, gap, k):
    """Frequency of x'' + x + k (x - gap)+ = 0."""
    wb = math.sqrt(1.0 + k)
    if 2.0 * E <= gap * gap:
        return 1.0 if gap > 0.0 else wb
    T = 2.0 * (math.pi - math.acos(gap / math.sqrt(2.0 * E))) + 2.0 / wb * math.atan2(wb * math.sqrt(2.0 * E - gap * gap), gap)
    return 2.0 * math.pi / T


@pytest.mark.parametrize("gap, k, E", [(0.5, 4.0, 0.5), (0.0, 4.0, 0.5), (-0.3, 4.0, 0.5), (1.0, 9.0, 3.0), (-1.0, 2.0, 0.7),
                                       (-0.8, 2.0, 0.3), (1.0, 4.0, 0.4), (1.0, 4.0, 0.5 + 1e-9), (0.3, -0.5, 2.0)])
def test_bilinear(gap, k, E):
    system = System(1.0, 0.0, 1.0, [el.ElasticStop(gap, k)])
    x = 0.0 if gap > 0.0 else k * gap / (1.0 + k)
    v = math.sqrt(2.0 * (E - bf.energy(system, (x, 0.0))))
    orbit = bf.find_orbit(system, guess=(x, v))
    assert orbit.success and orbit.energy == pytest.approx(E, rel=1e-14)
    assert orbit.omega == pytest.approx(bilinear(E, gap, k), abs=1e-12)
    assert orbit.multipliers.size == 0 and orbit.stable is None


def test_bilinear_of_any_gap_stiffness_and_energy():
    rng = np.random.default_rng(12)
    cases = [(-0.49394990, 1854.1193, 0.1225), (-4.118822030652432, 300.446247719355, 8.500053815063234)]
    for stiff, size, sign, high in rng.uniform((-2.0, -2.0, -1.0, -3.0), (6.0, 1.0, 1.0, 1.5), (150, 4)):
        k, gap = 10.0**stiff, math.copysign(10.0**size, sign)
        cases.append((gap, k, 10.0**high + (0.5 * k * gap * gap / (1.0 + k) if gap < 0.0 else 0.0)))
    for gap, k, E in cases:
        system = System(1.0, 0.0, 1.0, [el.ElasticStop(gap, k)])
        x = 0.0 if gap > 0.0 else k * gap / (1.0 + k)
        orbit = bf.find_orbit(system, guess=(x, math.sqrt(2.0 * (E - bf.energy(system, (x, 0.0))))))
        # the speed in a stiff contact that is hardly left is what remains of frequency times gap
        left = math.sqrt(max(2.0 * E - gap * gap, 0.0))
        rounding = 2.2e-16 * math.sqrt(1.0 + k) * abs(gap) / left if gap < 0.0 < left else 0.0
        assert orbit.success and orbit.omega == pytest.approx(bilinear(E, gap, k), rel=1e-12 + 8.0 * rounding)


@pytest.mark.parametrize("gap, E", [(0.5, 0.5), (-0.5, 0.5), (0.0, 1.3), (1.0, 7.0), (-0.9, 0.42)])
def test_rigid(gap, E):
    orbit = bf.find_orbit(System(1.0, 0.0, 1.0, [el.RigidStop(gap, 1.0)]), guess=(-math.sqrt(2.0 * E), 0.0))
    assert orbit.omega == pytest.approx(math.pi / (math.pi - math.acos(gap / math.sqrt(2.0 * E))), abs=1e-12)


@pytest.mark.parametrize("beta, A", [(1.0, 1.0), (-0.2, 1.0), (0.5, 3.0)])
def test_duffing(beta, A):
    m = beta * A * A / (2.0 * (1.0 + beta * A * A))
    orbit = bf.find_orbit(System(1.0, 0.0, 1.0, [el.CubicSpring(beta)]), guess=(A, 0.0))
    assert orbit.omega == pytest.approx(math.pi * math.sqrt(1.0 + beta * A * A) / (2.0 * ellipk(m)), abs=1e-11)
    assert orbit.closure == -1  # solved on half the period


CHAIN = System(np.eye(2), np.zeros((2, 2)), [[2.0, -1.0], [-1.0, 1.0]], [el.ElasticStop(1.0, 5.0, dof=1)])
MODE = {0.3: (0.633855140326657, 0.652884687101919, 1.0527021489722, -0.851295672521691 + 0.524686266206717j),
        0.6: (0.698291119726815, 0.918719990713214, 1.22813087593356, -0.843582332504289 + 0.536999858738853j),
        2.0: (0.748744010746782, 1.70901518365391, 1.44991918509209, -0.726976409800175 + 0.686662434966446j)}


@pytest.mark.parametrize("E", MODE)
def test_chain_with_a_stop(E):
    orbit = bf.nonlinear_mode(CHAIN, 0, energy=E)
    omega, q1, q2, multiplier = MODE[E]
    assert orbit.omega == pytest.approx(omega, abs=1e-11)
    assert (orbit.maximum(0), orbit.maximum(1)) == pytest.approx((q1, q2), abs=1e-11)
    assert orbit.multipliers == pytest.approx([multiplier, np.conj(multiplier)], abs=1e-9)


def chain_motion(K, gap, k, y0, duration):
    """Return the state (4,) of two unit masses with a stop at the second, by DOP853."""
    def field(t, y, touching):
        a = -K @ y[:2]
        a[1] -= k * (y[1] - gap) if touching else 0.0
        return np.concatenate([y[2:], a])

    def stop(t, y, touching):
        return y[1] - gap

    t, y = 0.0, np.array(y0)
    touching = y[1] > gap or y[1] == gap and y[3] > 0.0
    while True:
        stop.terminal, stop.direction = True, -1 if touching else 1
        part = solve_ivp(field, (t, duration), y, args=(touching,), method="DOP853", rtol=1e-13, atol=1e-14, events=stop,
                         max_step=0.02)
        t, y = part.t[-1], part.y[:, -1]
        if part.status == 0:
            return y
        touching = not touching


@pytest.mark.parametrize("gap, k, coupling, mode, E", [(0.3, 40.0, 0.7, 0, 0.8), (0.2, 60.0, 1.6, 1, 2.0), (1.2, 0.4, 1.0, 0, 4.0)])
def test_other_chains_with_a_stop(gap, k, coupling, mode, E):
    K = np.array([[1.0 + coupling, -coupling], [-coupling, 1.0]])
    orbit = bf.nonlinear_mode(System(np.eye(2), np.zeros((2, 2)), K, [el.ElasticStop(gap, k, dof=1)]), mode, energy=E)
    assert orbit.success and len(orbit.events) >= 2
    y = orbit.state
    stored = 0.5 * (y[2:] @ y[2:] + y[:2] @ K @ y[:2] + k * max(y[1] - gap, 0.0) ** 2)
    assert stored == pytest.approx(E, rel=1e-13)
    assert np.abs(chain_motion(K, gap, k, y, orbit.period) - y).max() < 1e-10
    h, M = 1e-6, np.empty((4, 4))
    y = next(y for y in orbit.sample(7)[1] if abs(y[1] - gap) > 1e-3)  # on the stop the motion bends
    for i in range(4):
        ends = [chain_motion(K, gap, k, y + sign * h * np.eye(4)[i], orbit.period) for sign in (1, -1)]
        M[:, i] = (ends[0] - ends[1]) / (2.0 * h)
    trace = np.trace(M) - 2.0  # the trivial pair is 1, 1
    assert orbit.multipliers.sum().real == pytest.approx(trace, rel=1e-6)


@pytest.mark.parametrize("gyroscopic", [0.0, 0.3, 0.6])
@pytest.mark.parametrize("mode", [0, 1])
def test_families_begin_with_any_coordinate_in_any_direction(mode, gyroscopic):
    """The coordinate that moves most may be the second, with the first against it or a quarter of a period behind: small motions
    have the frequency of det(K - w^2 M + i w G) = 0, large ones keep their energy and come back in a motion of their own."""
    K, G, gap, k = np.array([[1.0, -0.2], [-0.2, 2.0]]), gyroscopic * np.array([[0.0, -1.0], [1.0, 0.0]]), 0.3, 4.0
    system = System(np.eye(2), G, K, [el.ElasticStop(gap=gap, stiffness=k)])
    b, c = np.trace(K) + gyroscopic**2, np.linalg.det(K)
    squares = np.sort(np.roots([1.0, -b, c]))
    small = bf.nonlinear_mode(system, mode, energy=1e-3)
    assert small.omega == pytest.approx(math.sqrt(squares[mode]), rel=1e-9) and not small.events
    large = bf.nonlinear_mode(system, mode, energy=6.0)
    assert large.success and large.energy == pytest.approx(6.0, rel=1e-12) and large.omega > small.omega
    again = bf.simulate(system, large.state, duration=large.period)
    np.testing.assert_allclose(again.final, large.state, atol=1e-9)


@pytest.mark.parametrize("energy", [0.795, 0.8, *(pytest.param(energy, marks=pytest.mark.slow) for energy in (0.78, 0.805, 0.825))])
def test_a_family_goes_on_where_it_touches_the_stop_twice_at_once(energy):
    # a mode is its own image under reversal of time: contacts beside that at its turning point are born in pairs
    K, gap, k = np.array([[1.7, -0.7], [-0.7, 0.7]]), 0.3, 40.0
    start = bf.nonlinear_mode(System(np.eye(2), np.zeros((2, 2)), K, [el.ElasticStop(gap, k, dof=1)]), 0, energy=energy)
    branch = bf.trace(start, "energy", bounds=(energy, 0.9), direction=1, max_steps=12)
    (graze,) = branch.special_points.of("grazing")
    end = chain_motion(K, gap, k, graze.solution.state, graze.solution.period)
    assert np.abs(end - graze.solution.state).max() < 1e-10
    assert all(abs(point.parameter - graze.parameter) > 1e-6 for point in branch.special_points.of("branch_point"))
    behind = branch.orbits[-1]
    assert len(behind.events) == 6
    assert np.abs(chain_motion(K, gap, k, behind.state, behind.period) - behind.state).max() < 1e-10


def test_rigid_anywhere():
    rng = np.random.default_rng(6)
    for gap, size in zip(rng.uniform(-1, 1, 25), 10.0 ** rng.uniform(-4, 2, 25), strict=True):
        r = math.sqrt(gap * gap + 2.0 * size)
        orbit = bf.find_orbit(System(1.0, 0.0, 1.0, [el.RigidStop(gap, 1.0)]), guess=(-r, 0.0))
        assert orbit.omega == pytest.approx(math.pi / (math.pi - math.acos(gap / r)), rel=1e-12)


def test_duffing_far_faster_than_its_linear_part():
    cases = [(215.3, 3.56), (76.9, 6.41), (0.003, 20.0), (3.0, 0.02), (-1.7, 0.98 / math.sqrt(1.7)), (-0.04, 2.0)]
    for beta, A in cases:
        m = beta * A * A / (2.0 * (1.0 + beta * A * A))
        orbit = bf.find_orbit(System(1.0, 0.0, 1.0, [el.CubicSpring(beta)]), guess=(A, 0.0))
        assert orbit.omega == pytest.approx(math.pi * math.sqrt(1.0 + beta * A * A) / (2.0 * ellipk(m)), rel=1e-10)


@pytest.mark.parametrize("stop, start, frequency", [
    (el.ElasticStop(1.0, 4.0), (0.5, 0.0), lambda E: bilinear(E, 1.0, 4.0)),
    (el.RigidStop(1.0, 1.0), (0.5, 0.0), lambda E: 1.0 if E <= 0.5 else math.pi / (math.pi - math.acos(1.0 / math.sqrt(2.0 * E)))),
    (el.RigidStop(1.0, 1.0), (-2.0, 0.0), lambda E: 1.0 if E <= 0.5 else math.pi / (math.pi - math.acos(1.0 / math.sqrt(2.0 * E)))),
])
def test_branch_over_energy(stop, start, frequency, tmp_path):
    branch = bf.trace(bf.find_orbit(System(1.0, 0.0, 1.0, [stop]), guess=start), "energy", bounds=(0.01, 5.0))
    (point,) = branch.special_points
    assert point.kind == "grazing" and point.parameter == pytest.approx(0.5, abs=1e-13)
    assert [end.reason for end in branch.ends] == ["bound", "bound"]
    found = branch.column("omega")
    assert found == pytest.approx([frequency(E) for E in branch.column("energy")], abs=1e-12)
    branch.save(tmp_path / "free.npz")
    assert bf.load(tmp_path / "free.npz").column("omega") == pytest.approx(found, abs=1e-14)


@pytest.mark.parametrize("elements, start, ground", [
    ([el.ElasticStop(1.0, 4.0)], (1.5, 0.0), 0.0),
    ([el.ElasticStop(0.0, 4.0)], (0.5, 0.0), 0.0),
    ([el.ElasticStop(-0.37673293462909185, 0.28854120215704243 / 0.12280321005928631)], (0.3, 0.0), None),
    ([el.RigidStop(0.0, 1.0)], (-0.8, 0.0), 0.0),
    ([el.RigidStop(-0.3, 1.0)], (-0.8, 0.0), 0.045),
    ([el.ConstantForce(-1.0), el.RigidStop(0.4, 1.0, side=-1)], (0.7, 0.0), -0.32),
    ([el.CubicSpring(1.0)], (0.5, 0.0), 0.0),
])
def test_a_family_ends_at_its_state_of_rest(elements, start, ground):
    system = System(1.0, 0.0, 1.0, elements)
    if ground is None:
        ground = 0.5 * elements[0].stiffness * elements[0].gap ** 2 / (1.0 + elements[0].stiffness)
    orbit = bf.find_orbit(system, guess=start)
    branch = bf.trace(orbit, "energy", bounds=(ground - 0.1, orbit.energy * 1.5))
    assert [str(end.reason) for end in branch.ends] == ["at_rest", "bound"] and branch.audit.ok
    least = branch.column("energy").min()
    assert 0.0 <= least - ground <= 1e-11 * (orbit.energy - ground) + 1e-15
    assert {point.kind for point in branch.special_points} <= {"grazing"}


@pytest.mark.parametrize("stiffness, elements, start, bounds, saddle, low", [
    (1.0, [el.CubicSpring(-1.0)], (0.4, 0.0), (0.01, 1.0), 0.25, False),
    (-1.0, [el.CubicSpring(1.0)], (1.2, 0.0), (-0.24, 1.0), 0.0, False),
    (-1.0, [el.CubicSpring(1.0)], (1.6, 0.0), (-1.0, 1.0), 0.0, True),
    (1.0, [el.PolynomialSpring(c2=-1.0, c3=0.0)], (0.3, 0.0), (0.01, 1.0), 1.0 / 6.0, False),
    (1.0, [el.ElasticStop(0.5, -2.0)], (0.3, 0.0), (0.01, 1.0), 0.25, False),
])
def test_a_family_ends_at_the_orbit_that_does_not_come_back(stiffness, elements, start, bounds, saddle, low):
    branch = bf.trace(bf.find_orbit(System(1.0, 0.0, stiffness, elements), guess=start), "energy", bounds=bounds)
    assert [str(end.reason) for end in branch.ends] == (["homoclinic", "bound"] if low else ["bound", "homoclinic"])
    energy, omega = branch.column("energy"), branch.column("omega")
    last = energy.min() if low else energy.max()
    assert 0.0 < (last - saddle) * (1.0 if low else -1.0) < 5e-6
    assert omega.min() < 0.4 * omega.max() and {point.kind for point in branch.special_points} <= {"grazing"}


@pytest.mark.parametrize("elements", [[el.ElasticStop(-0.2, 41.0)], [el.ConstantForce(-1.3), el.ElasticStop(0.72, 900.0)]])
def test_modes_about_a_state_of_rest_away_from_zero(elements):
    system = System(1.0, 0.0, 1.0, elements)
    rest = bf.find_equilibrium(system)
    orbit = bf.nonlinear_mode(system, energy=bf.energy(system, rest.state) + 3.0)
    kick = (float(rest.state[0]), math.sqrt(6.0))
    motion = bf.simulate(system, kick, duration=orbit.period)
    assert np.abs(motion.final - kick).max() < 1e-11


@pytest.mark.parametrize("wrong", [{"mode": 0.5}, {"mode": True}, {"mode": 1}, {"energy": math.inf}, {"energy": "1"}])
def test_arguments_of_nonlinear_modes(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        bf.nonlinear_mode(System(1.0, 0.0, 1.0), **wrong)


@pytest.mark.parametrize("other", [1.5, 1.35])
def test_internal_resonances_with_a_mode_that_is_not_coupled(other):
    """A mass and its stop beside another of constant frequency: the ratio of the frequencies passes fractions in closed form."""
    system = System(np.eye(2), np.zeros((2, 2)), np.diag([1.0, other**2]), [el.ElasticStop(1.0, 4.0)])
    branch = bf.trace(bf.nonlinear_mode(system, 0, 0.4), "energy", bounds=(0.3, 6.0))
    assert len(branch) < 100
    found = branch.special_points.of("internal_resonance")
    ratios = [other / bilinear(E, 1.0, 4.0) for E in (0.5, 6.0)]
    expected = [(p / q, q) for q in (2, 3, 4, 5) for p in range(1, 10) if math.gcd(p, q) == 1 and ratios[1] < p / q < ratios[0]]
    assert len(found) == len(expected) > 1
    for ratio, q in expected:
        E = brentq(lambda E, level=other / ratio: bilinear(E, 1.0, 4.0) - level, 0.5, 6.0, xtol=1e-14)
        (point,) = [p for p in found if abs(p.parameter - E) < 1e-6]
        assert point.name == f"order {q}" and point.parameter == pytest.approx(E, abs=1e-10)


def test_what_keeps_no_energy():
    damped = System(1.0, 0.1, 1.0, [el.ElasticStop(1.0, 4.0)])
    with pytest.raises(ValueError, match="does not keep its energy"):
        bf.nonlinear_mode(damped)
    with pytest.raises(ValueError, match="energy"):
        bf.energy(System(1.0, 0.0, 1.0, [el.RigidStop(1.0, 0.7)]), (0.0, 0.0))
    with pytest.raises(ValueError, match="no linear modes"):
        bf.nonlinear_mode(System(1.0, 0.0, 1.0, [el.ElasticStop(0.0, 4.0)]))
    with pytest.raises(ValueError, match="above that of rest"):
        bf.nonlinear_mode(System(1.0, 0.0, 1.0), energy=0.0)
    belt = bf.find_orbit(bf.systems.belt_oscillator())
    with pytest.raises(ValueError, match="does not keep its energy"):
        bf.trace(belt, "energy", bounds=(0.1, 1.0))


def test_energy_of_elements():
    y = (0.7, 0.3)
    assert bf.energy(System(1.0, 0.0, 0.0, [el.ConstantForce(2.0)]), y) == pytest.approx(0.045 - 1.4)
    spring = el.PolynomialSpring(0.3, 0.2, -0.1, 0.05)
    force = el.Force(lambda u, s: -u * u * (0.3 + u * (0.2 + u * (-0.1 + u * 0.05))))
    assert bf.energy(System(1.0, 0.0, 1.0, [force]), y) == pytest.approx(bf.energy(System(1.0, 0.0, 1.0, [spring]), y), rel=1e-12)
    assert bf.energy(System(1.0, 0.0, 1.0, [el.LinearSpring(2.0)]), y) == pytest.approx(0.045 + 1.5 * 0.49)
