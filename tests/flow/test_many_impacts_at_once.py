"""Many impacts at one instant: rows of balls against Newton's sequential impacts in rational arithmetic and closed forms."""
from fractions import Fraction

import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import ConstantForce, HarmonicForce, RigidStop


def row_of(n, *entries):
    return tuple(float(dict(entries).get(i, 0)) for i in range(n))


def contacts_of(n, restitutions, wall=None):
    """Rows and restitutions of touching balls on a line, the last of them at a wall."""
    found = [(row_of(n, (i, 1), (i + 1, -1)), e) for i, e in enumerate(restitutions)]
    return found if wall is None else [*found, (row_of(n, (n - 1, 1)), wall)]


def balls(masses, contacts):
    n = len(masses)
    nothing = np.zeros((n, n))
    return bf.System(np.diag(masses), nothing, nothing, [RigidStop(gap=0.0, restitution=e, row=r) for r, e in contacts])


def sequential(masses, speeds, contacts):
    """Newton's impacts one after the other, the first contact in the order of the elements that closes, in rational arithmetic."""
    m, v = [Fraction(x) for x in masses], [Fraction(x) for x in speeds]
    rows, count = [([Fraction(x) for x in row], Fraction(e)) for row, e in contacts], 0
    while True:
        for row, e in rows:
            w = sum(a * b for a, b in zip(row, v, strict=True))
            if w > 0:
                push = (1 + e) * w / sum(a * a / b for a, b in zip(row, m, strict=True))
                v = [b - push * a / c for a, b, c in zip(row, v, m, strict=True)]
                count += 1
                break
        else:
            return np.array([float(x) for x in v]), count


def thrown(n, k=1):
    return [1.0] * k + [0.0] * (n - k)


rng = np.random.default_rng(43)
FINITE = {
    **{f"{n} elastic": ([1.0] * n, thrown(n), contacts_of(n, [1.0] * (n - 1))) for n in (2, 13, 14, 26)},
    "seven of twenty": ([1.0] * 20, thrown(20, 7), contacts_of(20, [1.0] * 19)),
    "nearly elastic": ([1.0] * 14, thrown(14), contacts_of(14, [0.99] * 13)),
    "other masses": (list(rng.integers(8, 33, 14) / 16.0), thrown(14), contacts_of(14, [1.0] * 13)),
    "other masses, with losses": (list(rng.integers(8, 33, 14) / 16.0), thrown(14), contacts_of(14, [0.875] * 13)),
    "against a wall": ([1.0] * 14, thrown(14), contacts_of(14, [1.0] * 13, wall=1.0)),
    "a heavy ball drives a light one to a wall": ([16.0, 0.0625], [1.0, 0.0], contacts_of(2, [1.0], wall=1.0)),
}


@pytest.mark.parametrize("case", FINITE)
def test_finitely_many_impacts_are_carried_out_each(case):
    masses, speeds, contacts = FINITE[case]
    n = len(masses)
    motion = bf.simulate(balls(masses, contacts), [0.0] * n + speeds, duration=1.0)
    expected, count = sequential(masses, speeds, contacts)
    assert motion.success, motion.message
    assert len(motion.events) == count
    np.testing.assert_allclose(motion.final[n:], expected, rtol=0, atol=1e-13)
    if case.endswith("elastic") and case[0].isdigit():  # the last ball leaves with the speed of the first
        assert motion.final[-1] == 1.0 and not motion.final[n:-1].any()


@pytest.mark.slow
def test_sixty_balls_of_which_twenty_are_thrown():
    """Eight hundred impacts at one instant: as many balls leave as came."""
    motion = bf.simulate(balls([1.0] * 60, contacts_of(60, [1.0] * 59)), [0.0] * 60 + thrown(60, 20), duration=1.0)
    assert motion.success and len(motion.events) == 800
    np.testing.assert_allclose(motion.final[60:], [0.0] * 40 + [1.0] * 20, atol=1e-13)


def test_a_row_that_is_met_after_a_flight_passes_the_speeds_on():
    """Five balls fly into fifteen at rest: as many leave at the other end."""
    q = [-1.0] * 5 + [0.0] * 15
    motion = bf.simulate(balls([1.0] * 20, contacts_of(20, [1.0] * 19)), q + thrown(20, 5), duration=3.0)
    assert motion.success and len(motion.events) == 75
    np.testing.assert_allclose(motion.final[20:], [0.0] * 15 + [1.0] * 5, atol=1e-14)


@pytest.mark.parametrize(("masses", "speeds", "restitutions", "wall"), [
    ([1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.05, 0.05], None),
    ([5.0, 1.0, 3.0], [1.0, 0.25, -1.0], [0.05, 0.05], None),
    ([1.0] * 14, thrown(14), [0.0] * 13, None),
    ([1.0] * 14, thrown(14), [0.5] * 13, None),
    ([1.0, 2.0, 0.5] * 8, thrown(24, 2), [0.0] * 23, None),
    ([1.0, 1.0], [1.0, 0.0], [0.1], 0.1),
    ([1.0] * 6, thrown(6), [0.2] * 5, 0.2),
])
def test_infinitely_many_impacts_end_with_one_speed(masses, speeds, restitutions, wall):
    """Little restitution between many: what is left is the common speed of the momentum, or rest at the wall."""
    n = len(masses)
    system = balls(masses, contacts_of(n, restitutions, wall))
    motion = bf.simulate(system, [0.0] * n + speeds, duration=1.0)
    assert motion.success, motion.message
    common = np.dot(masses, speeds) / np.sum(masses) if wall is None else 0.0
    np.testing.assert_allclose(motion.final[n:], common, rtol=0, atol=1e-12)


@pytest.mark.parametrize("seed", range(12))
def test_energy_never_grows_and_momentum_stays(seed):
    """Any masses, speeds and mixed restitutions: contacts do not close in the end, momentum is that of the start."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 22))
    masses, speeds = rng.uniform(0.3, 3.0, n), rng.normal(size=n)
    contacts = contacts_of(n, rng.choice([1.0, 0.99, 0.5, 0.0], n - 1).tolist())
    motion = bf.simulate(balls(masses, contacts), np.concatenate((np.zeros(n), speeds)), duration=0.5)
    assert motion.success, motion.message
    energies = [0.5 * masses @ y[n:]**2 for event in motion.events for y in (event.before, event.after)]
    assert (np.diff(energies) <= 1e-14 * energies[0]).all()
    v = motion.final[n:]
    assert masses @ v == pytest.approx(masses @ speeds, abs=1e-12)
    assert all(np.dot(r, v) <= 1e-12 for r, _ in contacts)


def test_too_many_impacts_at_once_say_so():
    """More impacts than are allowed: no energy is lost silently."""
    motion = bf.simulate(balls([1.0] * 20, contacts_of(20, [1.0] * 19)), [0.0] * 20 + thrown(20, 10), duration=1.0, max_events=60)
    assert motion.status == "too_many_events" and "at this instant" in motion.message and "max_events" in motion.message
    assert 0.5 * (motion.final[20:]**2).sum() == pytest.approx(5.0, rel=1e-14)


def test_a_pressed_stack_still_comes_to_rest():
    """Flights that rounding hides are none: two masses fall on a wall, one on the other, and rest there."""
    loads = [ConstantForce(1.0), ConstantForce(1.5, dof=1)]
    stops = [RigidStop(gap=0.7, restitution=0.6), RigidStop(gap=0.3, restitution=0.2, row=(-1.0, 1.0))]
    system = bf.System(np.diag([1.0, 1.5]), np.zeros((2, 2)), np.zeros((2, 2)), loads + stops)
    motion = bf.simulate(system, np.zeros(4), duration=20.0)
    assert motion.success and motion.events[-1].mode_after[2:] == ("rest", "rest")
    np.testing.assert_allclose(motion.final, [0.7, 1.0, 0.0, 0.0], atol=1e-14)


WALLS = [(0.5, 0.5), (1.0, 0.7), (0.9, 0.95), (0.0, 1.0)]


@pytest.mark.parametrize("ratio", [1.0, 1.3e10])
@pytest.mark.parametrize("speed", [1.0, -3.0])
@pytest.mark.parametrize("restitutions", WALLS)
def test_a_mass_between_walls_without_a_clearance_comes_to_rest_at_once(restitutions, speed, ratio):
    """Every pair of impacts leaves the product of the restitutions: nothing is left of the speed, at the instant of the start."""
    one, other = restitutions
    walls = [RigidStop(0.0, one, dof=0), RigidStop(0.0, other, side=-1, dof=0)]
    system = bf.System(np.diag([1.0, ratio]), np.zeros((2, 2)), [[1.0, 0.0], [0.0, ratio]], [HarmonicForce(1.0), *walls], omega=1.3)
    motion = bf.simulate(system, [0.0, 0.2, speed, 0.0], duration=10.0)
    y = motion(np.linspace(1e-9, 10.0, 200))
    assert motion.success and not y[:, [0, 2]].any()
    np.testing.assert_allclose(y[:, 1], 0.2 * np.cos(np.linspace(1e-9, 10.0, 200)), rtol=0, atol=1e-13)


@pytest.mark.parametrize("restitutions", WALLS)
def test_a_light_mass_between_walls_of_a_heavy_one_goes_with_it(restitutions):
    """No clearance and no external load: both have the common speed that momentum gives."""
    light = 1.0 / 1.3e10
    one, other = (RigidStop(0.0, e, side=side, row=(-1.0, 1.0)) for e, side in zip(restitutions, (1, -1), strict=True))
    system = bf.System(np.diag([1.0, light]), np.zeros((2, 2)), np.zeros((2, 2)), [one, other])
    motion = bf.simulate(system, [0.0, 0.0, 0.3, 2.0e5], duration=2.0)
    common = (0.3 + 2.0e5 * light) / (1.0 + light)
    np.testing.assert_allclose(motion.final, [2.0 * common, 2.0 * common, common, common], rtol=1e-12)


def test_elastic_walls_without_a_clearance_have_no_end():
    motion = bf.simulate(bf.System(1.0, 0.0, 0.0, [RigidStop(0.0, 1.0), RigidStop(0.0, 1.0, side=-1)]), (0.0, 1.0), duration=1.0)
    assert motion.status == "too_many_events" and "at this instant" in motion.message


def test_walls_that_approach_each_other_catch_a_mass():
    """One moves through where the other stands: the sum of their speeds is no impulse's to take away."""
    walls = [RigidStop(0.0, 0.5, amplitude=0.1, harmonic=1, phase=np.pi / 2.0), RigidStop(0.0, 0.5, side=-1)]
    motion = bf.simulate(bf.System(1.0, 0.0, 0.0, walls, omega=1.0), (0.0, 0.0), duration=1.0)
    assert motion.status in ("inconsistent", "too_many_events")


@pytest.mark.parametrize("restitutions", [(0.24, 0.73), (0.0, 0.9), (0.99, 0.5)])
@pytest.mark.parametrize("light", [1e-3, 1e-5, 1e-9, 1.0 / 1.3e10])
def test_a_heavy_mass_is_stopped_by_a_light_one_at_a_wall(light, restitutions):
    """Each pair of impacts takes some light / heavy of the speed: a billion of them are infinitely many, and all rests at once."""
    system = balls([1.0, light], [((1.0, -1.0), restitutions[0]), ((0.0, 1.0), restitutions[1])])
    motion = bf.simulate(system, [0.0, 0.0, 1.0, 0.0], duration=1.0)
    assert motion.success and np.abs(motion.final).max() < 1e-12


def test_an_elastic_light_mass_returns_a_heavy_one():
    """The same without losses: the heavy mass turns round, after about pi sqrt(heavy/light) impacts (Galperin 2003)."""
    light = 1e-4
    system = balls([1.0, light], [((1.0, -1.0), 1.0), ((0.0, 1.0), 1.0)])
    motion = bf.simulate(system, [0.0, 0.0, 1.0, 0.0], duration=1.0, max_events=500)
    v = motion.final[2:]
    assert motion.success and v @ np.diag([1.0, light]) @ v == pytest.approx(1.0, rel=1e-12) and v[0] < -0.999
    assert len(motion.events) == int(np.pi / np.arctan(np.sqrt(light)))
