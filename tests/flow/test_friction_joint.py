"""Dry frictions whose rows depend on each other let go together: against linear programs over what each of them can hold."""
import numpy as np
import pytest
from scipy.optimize import linprog

import bifurc as bf
from bifurc.elements import Coulomb, HarmonicForce, RigidStop

OMEGA = 0.01
ROWS = {"two masses and their difference": [(1, 0), (0, 1), (1, -1)],
        "four on two masses": [(1, 0), (0, 1), (1, -1), (2, 1)],
        "chain between two walls": [(1, 0, 0), (1, -1, 0), (0, 1, -1), (0, 0, 1)],
        "chain with every mass on the ground": [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, -1, 0), (0, 1, -1)],
        "a second contact on one row": [(1, 0), (0, 1), (1, -1), (-2, 2)]}


def largest(rows, limits, direction):
    """How many times a load along the direction all contacts hold together: a linear program over their forces."""
    equal = np.hstack([np.array(rows, float).T, -np.asarray(direction)[:, None]])
    found = linprog(np.r_[np.zeros(len(rows)), -1.0], A_eq=equal, b_eq=np.zeros(len(direction)),
                    bounds=[*((-limit, limit) for limit in limits), (0.0, None)])
    return -found.fun


def held(rows, slips, statics, speeds, need):
    """By how much forces within the limits of what rests miss what is needed, beside the friction of what slips."""
    rows, slipping, n = np.array(rows, float), np.abs(speeds) > 1e-7, len(need)
    need = need + rows[slipping].T @ (slips[slipping] * np.sign(speeds[slipping]))
    stuck = rows[~slipping]
    found = linprog(np.r_[np.zeros(len(stuck)), np.ones(2 * n)], A_eq=np.hstack([stuck.T, np.eye(n), -np.eye(n)]), b_eq=need,
                    bounds=[*((-limit, limit) for limit in statics[~slipping]), *[(0.0, None)] * (2 * n)])
    return found.fun


@pytest.mark.parametrize("name", ROWS)
@pytest.mark.parametrize("ratio", [1.0, 1.5])
def test_they_let_go_where_the_load_leaves_what_they_hold(name, ratio, rng):
    rows = ROWS[name]
    for _ in range(4):
        n, slips = len(rows[0]), rng.uniform(0.5, 1.5, len(rows))
        direction = rng.normal(size=n)
        load = 2.0 * largest(rows, ratio * slips, direction) * direction
        masses = np.diag(rng.uniform(0.5, 2.0, n))
        system = bf.System(masses, np.zeros((n, n)), np.zeros((n, n)), [
            *(HarmonicForce(part, phase=-0.5 * np.pi, dof=i) for i, part in enumerate(load)),
            *(Coulomb(slip, static_ratio=ratio, row=tuple(row)) for slip, row in zip(slips, rows, strict=True))], omega=OMEGA)
        when = np.arcsin(0.5) / OMEGA
        motion = bf.simulate(system, np.zeros(2 * n), duration=when + 1.0)
        assert motion.success and motion.events[0].kind == "slip" and abs(motion.events[0].time - when) < 1e-9
        assert not motion(np.array([when - 1e-6]))[0].any() and np.abs(motion.final[n:]).max() > 0.0


def test_the_pull_of_three_contacts_is_two_of_their_limits():
    """The masses are pulled apart: each holds by its own friction, 1.5, and by that between them, 1.5: 3 on each."""
    load = 6.0
    system = bf.System(np.eye(2), np.zeros((2, 2)), np.zeros((2, 2)), [
        HarmonicForce(load, phase=-0.5 * np.pi, dof=0), HarmonicForce(-load, phase=-0.5 * np.pi, dof=1),
        Coulomb(1.0, static_ratio=1.5, row=(1, 0)), Coulomb(1.0, static_ratio=1.5, row=(0, 1)),
        Coulomb(1.0, static_ratio=1.5, row=(1, -1))], omega=OMEGA)
    motion = bf.simulate(system, np.zeros(4), duration=np.arcsin(0.5) / OMEGA + 1.0)
    assert abs(load * np.sin(OMEGA * motion.events[0].time) - 3.0) < 1e-12


def shaken(rows, ratio, rng):
    """Masses under loads of random phases; what the test needs of them."""
    n, count = len(rows[0]), len(rows)
    B = rng.normal(size=(n, n))
    M, K, C = np.eye(n) + 0.2 * B @ B.T, np.diag(rng.uniform(0.5, 2.0, n)), 0.05 * np.eye(n)
    slips = rng.uniform(0.1, 0.3, count)
    statics = slips * (1.0 if ratio == 1.0 else rng.uniform(1.05, ratio, count))
    loads, phases, omega = rng.uniform(0.2, 1.2, n), rng.uniform(0.0, 6.0, n), rng.uniform(0.3, 1.2)
    system = bf.System(M, C, K, [*(HarmonicForce(a, phase=p, dof=i) for i, (a, p) in enumerate(zip(loads, phases, strict=True))),
                                 *(Coulomb(slip, static=static, row=tuple(row))
                                   for slip, static, row in zip(slips, statics, rows, strict=True))], omega=omega)
    return system, (M, C, K), slips, statics, lambda t: loads * np.cos(omega * t + phases)


@pytest.mark.parametrize("name", list(ROWS)[:4])
@pytest.mark.parametrize("ratio", [1.0, 1.4, 2.0])
def test_forces_of_a_motion_are_within_all_limits(name, ratio, rng):
    """Where contacts slip their friction is that of slip against the speed; the others can hold the rest within static limits."""
    rows = ROWS[name]
    for _ in range(2):
        system, (M, C, K), slips, statics, load = shaken(rows, ratio, rng)
        motion = bf.simulate(system, np.zeros(2 * system.n), periods=8)
        assert motion.success, motion.message
        times, n, h = np.array([event.time for event in motion.events]), system.n, 1e-6
        for t in rng.uniform(0.1, motion.stop - 0.1, 60):
            if times.size and np.abs(times - t).min() < 1e-5:
                continue
            before, now, after = motion(np.array([t - h, t, t + h]))
            q, v, a = now[:n], now[n:2 * n], (after - before)[n:2 * n] / (2.0 * h)
            assert held(rows, slips, statics, np.array(rows) @ v, M @ a + C @ v + K @ q - load(t)) < 1e-6


@pytest.mark.parametrize("ratio", [1.0, 1.6])
def test_beside_a_stop_friction_on_the_other_mass_and_between_them_add_up(ratio):
    """The first mass is pressed on a stop; the second moves off at the sum of both limits."""
    slips = np.array([0.7, 0.5])
    load = 2.0 * ratio * slips.sum()
    system = bf.System(np.eye(2), np.zeros((2, 2)), np.zeros((2, 2)), [
        HarmonicForce(load, phase=-0.5 * np.pi, dof=1), bf.elements.ConstantForce(50.0, dof=0), RigidStop(0.0, 0.5, dof=0),
        Coulomb(slips[0], static_ratio=ratio, row=(0, 1)), Coulomb(slips[1], static_ratio=ratio, row=(1, -1))], omega=OMEGA)
    when = np.arcsin(0.5) / OMEGA
    motion = bf.simulate(system, np.zeros(4), duration=when + 1.0)
    assert motion.success and [event.kind.value for event in motion.events] == ["slip"]
    assert abs(motion.events[0].time - when) < 1e-9
    assert motion.final[2] == 0.0 and motion.final[3] > 0.0


@pytest.mark.parametrize("ratio", [1.0, 1.2])
def test_too_many_are_refused_by_name(ratio):
    """A chain of ten masses with friction on each and between all neighbours; one between two of them leaves one set of three."""
    n = 10
    ground, between = np.eye(n), np.eye(n)[:-1] - np.eye(n)[1:]

    def chain(rows):
        return bf.System(np.eye(n), 0.1 * np.eye(n), np.eye(n), [
            HarmonicForce(1.0), *(Coulomb(0.1, static_ratio=ratio, row=tuple(row)) for row in rows)], omega=1.0)

    with pytest.raises(ValueError, match="coulomb_19: these frictions depend on each other"):
        bf.simulate(chain([*ground, *between]), np.zeros(2 * n), periods=1)
    assert bf.simulate(chain([*ground, between[7]]), np.zeros(2 * n), duration=0.1).success


@pytest.mark.parametrize(("name", "ratio", "seed"), [
    *(("two masses and their difference", ratio, 1) for ratio in (1.0, 1.4, 2.0)), ("four on two masses", 1.4, 2)])
def test_orbits_with_joint_rest_close(name, ratio, seed):
    """The multipliers are those of the map over a period, differenced."""
    system = shaken(ROWS[name], ratio, np.random.default_rng(seed))[0]
    orbit = bf.find_orbit(system)
    assert orbit.success
    y, h = orbit.sections[0], 1e-6
    np.testing.assert_allclose(bf.simulate(system, y, periods=orbit.periods).final, y, rtol=0, atol=1e-12)
    slopes = np.column_stack([(bf.simulate(system, y + h * e, periods=orbit.periods).final
                               - bf.simulate(system, y - h * e, periods=orbit.periods).final) / (2.0 * h) for e in np.eye(len(y))])
    by_hand = np.sort(np.abs(np.linalg.eigvals(slopes)))[-len(orbit.multipliers):]
    np.testing.assert_allclose(np.sort(np.abs(orbit.multipliers)), by_hand, rtol=0, atol=1e-5)


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_an_impact_takes_a_mass_from_another_to_which_it_stuck(restitution):
    """Both slide as one into the stop of the first: what the inertia of the second takes along is closed form.

    A mode in which the first rests on the stop and sticks to the second would hold the second too; none of that is tried alone.
    """
    M, speed = np.array([[1.0, 0.2], [0.2, 1.0]]), 0.3
    system = bf.System(M, np.zeros((2, 2)), np.zeros((2, 2)), [
        RigidStop(0.01, restitution, dof=0), Coulomb(0.5, static_ratio=1.3, row=(1, -1)), Coulomb(0.1, row=(0, 1))], omega=1.0)
    motion = bf.simulate(system, np.array([0.0, 0.0, speed, speed]), duration=0.06)
    impact = next(event for event in motion.events if event.kind == "impact")
    before, after = impact.before[2], impact.after[2:4]
    along = np.linalg.inv(M)[:, 0]
    np.testing.assert_allclose(after, before - (1.0 + restitution) * before * along / along[0], rtol=0, atol=1e-14)
    assert motion.success and impact.mode_after[:3] == ("rest" if restitution == 0.0 else "free", "slip-", "slip+")
