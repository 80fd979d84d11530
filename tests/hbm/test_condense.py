"""Condensed balances: the solutions of the whole ones, receptances, derivatives against differences, singular linear parts."""
import numpy as np
import pytest

import bifurc as bf
from bifurc import HarmonicBalance, System
from bifurc.elements import BaseMotion, CubicSpring, ElasticStop, HarmonicForce, Jenkins, LinearSpring
from bifurc.elements.driven import Driven
from bifurc.hbm.balance import Balance
from bifurc.hbm.condensation.condensed import Condensed, _driven
from bifurc.hbm.condensation.receptance import BLOCKS, FACTORS, MODES, POLES, Changed
from bifurc.hbm.layout import Layout, listed
from bifurc.hbm.status import BalanceStatus, ContactStatus
from bifurc.orbits.balance.harmonic_orbit import relative_residual


def chain(elements, damping="modal", n=10, omega=0.3):
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    C = 0.01 * np.eye(n) + 0.02 * K
    if damping == "local":
        C[n // 2, n // 2] += 0.3
    if damping == "circulatory":
        C[n // 2, n // 2] += 0.3
        K[0, 2] += 0.1
        K[2, 0] -= 0.1
    if damping == "gyroscopic":
        C[0, 1] += 0.1
        C[1, 0] -= 0.1
    return System(np.diag(np.linspace(1.0, 1.5, n)) if damping == "local" else np.eye(n), C, K,
                  [HarmonicForce(1.0, dof=0), *elements], omega=omega)


def distance(element, i, j, n=10):
    row = np.zeros(n)
    row[i], row[j] = 1.0, -1.0
    return element.with_parameters(row=tuple(row))


CONTACTS = {
    "slider": ([Jenkins(1.0, 0.3, dof=6)], 1),
    "two": ([distance(Jenkins(1.0, 0.2), 3, 4), ElasticStop(gap=0.2, stiffness=3.0, dof=7)], 2),
    "dependent rows": ([Jenkins(1.0, 0.2, dof=3), ElasticStop(gap=0.2, stiffness=3.0, dof=4),
                        distance(Jenkins(0.5, 0.1), 3, 4)], 2),
    "law": ([CubicSpring(0.4, dof=2), Jenkins(1.0, 0.3, dof=6)], 2),
}


METHOD = HarmonicBalance(5, condense=True)
WHOLE = HarmonicBalance(5, condense=False)


def condensed_of(system, H=5, periods=1, samples=0, **options):
    return Condensed(Balance(system, Layout(listed(H, periods), system.n, periods), samples), **options)


@pytest.mark.parametrize("contacts", CONTACTS)
@pytest.mark.parametrize("damping", ["modal", "local", "gyroscopic"])
def test_orbit_is_that_of_the_whole_balance(damping, contacts):
    elements, count = CONTACTS[contacts]
    # gyroscopic: at 0.3 Newton finds nothing with two contacts, neither here nor for the whole balance
    system = chain(elements, damping, omega=0.4 if damping == "gyroscopic" else 0.3)
    orbit = bf.find_orbit(system, method=METHOD)
    assert orbit.success and orbit.residual <= 1e-14
    assert orbit.condensed.size == 11 * count and orbit.condensed.linear.way == (MODES if damping == "modal" else FACTORS)
    assert orbit.how["condensed"].startswith(f"110 unknowns to {11 * count}, those of the {count} of 10 coordinates")
    whole = bf.find_orbit(system, method=WHOLE)
    if not whole.success or np.abs(whole.coefficients - orbit.coefficients).max() > 1e-3:  # another path, or another motion
        whole = bf.find_orbit(system, method=WHOLE, guess=orbit.coefficients * (1.0 + 1e-6))
    assert whole.success and whole.condensed is None and "condensed" not in whole.how
    size = np.abs(whole.coefficients).max()
    assert np.abs(orbit.coefficients - whole.coefficients).max() <= 1e-12 * size
    assert orbit.signature == whole.signature and len(orbit.events) == len(whole.events)
    np.testing.assert_allclose(orbit.multipliers, whole.multipliers, atol=1e-8)
    np.testing.assert_allclose(orbit.error(), whole.error(), rtol=1e-6)  # one step in twice the harmonics, made in fewer unknowns
    np.testing.assert_allclose(orbit.condensed.restricted(whole.coefficients), orbit.condensed.restricted(orbit.coefficients),
                               atol=1e-12 * size)
    assert relative_residual(orbit.balance, orbit.coefficients) <= 1e-14


def test_few_unknowns_are_not_condensed_and_many_are():
    few, many = chain([Jenkins(1.0, 0.3, dof=1)], n=2), chain([Jenkins(1.0, 0.3, dof=6)], n=20)
    assert bf.find_orbit(few, method=HarmonicBalance(7)).condensed is None
    assert bf.find_orbit(many, method=HarmonicBalance(7)).condensed is not None
    everywhere = chain([Jenkins(1.0, 0.3, dof=i) for i in range(6)], n=6)
    assert HarmonicBalance(21).condensed(Balance(everywhere, Layout(listed(21), 6))) is None
    with pytest.raises(ValueError, match="condense = 'yes'"):
        HarmonicBalance(5, condense="yes")


@pytest.mark.parametrize("solver", ["newton", "broyden"])
def test_sampled_contacts_and_orbits_of_two_periods(solver):
    method = HarmonicBalance(3, aft="sampled", samples=256, solver=solver, condense=True)
    orbit = bf.find_orbit(chain(CONTACTS["slider" if solver == "broyden" else "two"][0]), method=method, periods=2)
    assert orbit.success and orbit.condensed is not None and np.abs(orbit.balance.residual(orbit.coefficients)).max() <= 1e-12


def test_load_is_raised_in_steps_where_newton_fails_at_once():
    """From the start that `_raised` uses, the solution at the full load is that of the whole balance; the load is put back."""
    from bifurc.orbits.balance import find as module

    system = chain(CONTACTS["law"][0])
    balance = METHOD.balance(system, METHOD.layout(10))
    condensed = METHOD.condensed(balance)
    u, _, failed = module._raised(condensed, METHOD)
    x, _, whole = module._raised(balance, WHOLE)
    assert failed is None and whole is None and condensed.load == 1.0
    np.testing.assert_allclose(condensed.expand(u), x, atol=1e-12 * np.abs(x).max())


@pytest.mark.parametrize("damping", ["modal", "local", "gyroscopic", "circulatory"])
@pytest.mark.parametrize("sweep", [False, True])
def test_receptance_is_the_inverse_of_the_dynamic_stiffness(damping, sweep):
    condensed = condensed_of(chain(CONTACTS["two"][0], damping), sweep=sweep)
    balance, B = condensed.balance, condensed.rows
    assert condensed.linear.way == (MODES if damping == "modal" else POLES if sweep else FACTORS)
    for k, H in zip(balance.layout.harmonics, condensed.here.linear.H, strict=True):
        true = B @ np.linalg.inv(balance.stiffness(k)) @ B.T
        np.testing.assert_allclose(H, true, atol=1e-12 * np.abs(true).max())
    np.testing.assert_allclose(condensed.linear_response(), condensed.restricted(balance.linear_response()), atol=1e-12)


@pytest.mark.parametrize("gap", [0.0, 1e-13, 1e-9, 1e-6, 1e-3])
def test_critical_damping_has_no_poles_to_sum_but_a_block_of_them(gap):
    """A mass with two equal poles behind a spring that couples nothing: their eigenvectors are one. Nearby they nearly are."""
    K, C = np.diag([1.0, 4.0, 9.0]) + np.zeros((3, 3)), np.diag([0.1, 4.0 * (1.0 + gap), 0.3])
    C[0, 2] = C[2, 0] = 0.05
    system = System(np.eye(3), C, K, [HarmonicForce(1.0), Jenkins(1.0, 0.3, row=(1.0, 1.0, 1.0))], omega=0.7)
    condensed = condensed_of(system, sweep=True)
    assert condensed.linear.way == (POLES if gap > 1e-8 else BLOCKS)
    for omega in (0.7, 1.9, 2.0):
        there = at(condensed, omega)
        for k, H in zip(condensed.whole.harmonics, there.linear.H, strict=True):
            true = condensed.rows @ np.linalg.inv(K - (k * omega)**2 * np.eye(3) + 1j * k * omega * C) @ condensed.rows.T
            np.testing.assert_allclose(H, true, rtol=1e-11)


@pytest.mark.parametrize("n", [4, 12])
@pytest.mark.parametrize("coupling", [0.0, 1e-12, 1e-2])
def test_receptances_and_their_slopes_where_many_poles_coincide(n, coupling):
    """Equal masses with critical damping, all of them with the same two poles, coupled by a gyroscopic term or a dashpot."""
    C = np.diag(np.full(n, 4.0))
    C[0, 1] += 0.05
    C[1, 0] -= 0.05
    C += coupling * (np.eye(n, k=1) + np.eye(n, k=-1))
    B = np.ones(n)
    B[1::2] = 0.3
    system = System(np.eye(n), C, 4.0 * np.eye(n), [HarmonicForce(1.0, dof=n - 1), Jenkins(1.0, 0.3, row=tuple(B))], omega=0.7)
    condensed = condensed_of(system, drives=True, sweep=True)
    assert condensed.linear.way == (POLES if coupling > 1e-6 else BLOCKS)
    for omega in (0.7, 2.0):
        there = at(condensed, omega)
        true = condensed.linear._direct(there.T, there.dT, range(len(condensed.whole.harmonics)), False)
        for own, other in zip(there.linear[:4], true[:4], strict=True):
            np.testing.assert_allclose(own, other, atol=1e-12 * np.abs(other).max())
    load = np.random.default_rng(1).standard_normal((len(condensed.whole.harmonics), n)) * (1.0 + 0.5j)
    shift = np.zeros(len(load))
    for transposed in (False, True):
        q = condensed.linear.motion(there.T, load, shift, False, transposed)
        for k, Z in enumerate(condensed.linear.stiffnesses(there.T, False)):
            np.testing.assert_allclose((Z.T if transposed else Z) @ q[k], load[k], atol=1e-11)


CHANGES = {"mass": ("M", [(2, 2, 0.3)]), "dashpot": ("C", [(1, 1, 0.5)]), "gyroscopic": ("C", [(0, 3, 0.2), (3, 0, -0.2)]),
           "spring": ("K", [(4, 4, 0.7), (4, 5, -0.7), (5, 4, -0.7), (5, 5, 0.7)])}


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("damping", ["modal", "local"])
def test_core_that_changes_in_few_coordinates(damping, change):
    """Receptances, their derivatives by the change with the frequency on the way, and the sign of the mean's stiffness."""
    name, entries = CHANGES[change]
    system = chain(CONTACTS["two"][0], damping)
    changed = np.unique([place for i, j, _ in entries for place in (i, j)])
    condensed = condensed_of(system, drives=True, sweep=True, changed=Changed(changed, ()))
    factors = condensed_of(system, drives=True)

    def moved(amount, omega):
        M, C, K = (np.array(matrix, float) for matrix in (system.mass, system.damping, system.stiffness))
        for i, j, value in entries:
            {"M": M, "C": C, "K": K}[name][i, j] += amount * value
        return condensed.balance.parts.flat_of(System(M, C, K, system.elements, omega=omega))
    for amount, omega in ((0.0, 0.3), (1.0, 0.3), (-0.6, 0.8), (3.0, 1.4)):
        step = 1e-3
        near = [moved(amount + i * step, omega * (1.0 + i * step)) for i in (-2, -1, 1, 2)]
        slope = (near[0] - near[3] + 8.0 * (near[2] - near[1])) / (12.0 * step)
        own, other = (c.point(moved(amount, omega), slope, True).linear for c in (condensed, factors))
        for mine, true in zip(own[:4], other[:4], strict=True):
            np.testing.assert_allclose(mine, true, atol=1e-11 * np.abs(true).max())
        assert own.sign == other.sign and own.regular and not own.shift.any()


@pytest.mark.parametrize("away, asked", [(0.5, []), (1e-2, []), (1e-6, [2]), (-1e-6, [2])])
def test_an_update_that_loses_digits_is_not_made(monkeypatch, away, asked):
    """A spring that brings the second harmonic of an undamped chain to resonance: there alone the core is factorised."""
    n, omega, spring = 10, 0.4, np.zeros(10)
    spring[[4, 5]] = 1.0, -1.0
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    needed = -1.0 / (spring @ np.linalg.solve(K - (2.0 * omega)**2 * np.eye(n), spring))  # det(Z + a g g^T) = 0
    system = System(np.eye(n), np.zeros((n, n)), K, [HarmonicForce(1.0), ElasticStop(gap=0.2, stiffness=3.0, dof=7)], omega=omega)
    condensed = condensed_of(system, drives=True, sweep=True, changed=Changed(np.array([4, 5]), ()))
    moved = System(np.eye(n), np.zeros((n, n)), K + needed * (1.0 + away) * np.outer(spring, spring), system.elements, omega=omega)
    flat, seen = condensed.balance.parts.flat_of(moved), []
    direct = type(condensed.linear)._direct

    def recorded(self, T, dT, which, moved):
        seen.extend(which.tolist())
        return direct(self, T, dT, which, moved)
    monkeypatch.setattr(type(condensed.linear), "_direct", recorded)
    found = condensed.point(flat, np.zeros_like(flat), True).linear
    assert seen == asked
    for k, G in zip((0, 1, 2, 3, 4, 5), found[0], strict=True):
        whole = np.linalg.inv(moved.stiffness - (k * omega)**2 * np.eye(n))
        scale = np.abs(whole).max()
        assert np.abs(G[0, 0] - whole[7, 7]) <= 1e-11 * scale if k != 2 else scale > 1.0


def test_core_that_changes_and_keeps_its_modes():
    """All of the damping and of the stiffness change with one number: only the numbers of the modes are new."""
    system = chain(CONTACTS["two"][0])
    M, C, K = system.mass, system.damping, system.stiffness
    matrices = tuple(np.array([X, weight * X]) for X, weight in ((M, 0.0), (C, 1.0), (K, 1.0)))
    condensed = condensed_of(system, drives=True, changed=Changed(np.arange(10), matrices))
    assert condensed.linear._same_modes
    factors = condensed_of(system, drives=True)
    rng = np.random.default_rng(2)
    load, none = rng.standard_normal((6, 10)) * (1.0 - 0.4j), np.zeros(6)

    def moved(amount, omega):
        return condensed.balance.parts.flat_of(System(M, (1.0 + amount) * C, (1.0 + amount**2) * K, system.elements, omega=omega))
    for amount, omega in ((0.0, 0.3), (1.5, 0.3), (-0.6, 0.8)):
        step = 1e-3
        near = [moved(amount + i * step, omega * (1.0 + i * step)) for i in (-2, -1, 1, 2)]
        slope = (near[0] - near[3] + 8.0 * (near[2] - near[1])) / (12.0 * step)
        mine, true = (c.point(moved(amount, omega), slope, True) for c in (condensed, factors))
        for own, other in zip(mine.linear[:4], true.linear[:4], strict=True):
            np.testing.assert_allclose(own, other, atol=1e-11 * np.abs(other).max())
        assert mine.linear.sign == true.linear.sign
        q, other = (c.linear.motion(point.T, load, none, True) for c, point in ((condensed, mine), (factors, true)))
        np.testing.assert_allclose(q, other, rtol=1e-9)
    bent = np.array([K, np.diag(np.arange(10.0))])
    other = condensed_of(system, changed=Changed(np.arange(10), (*matrices[:2], bent)))
    assert not other.linear._same_modes


def test_a_free_body_has_a_pole_at_zero_and_a_harmonic_on_it_is_held():
    """Two masses joined by a spring, one of them with a dashpot to the ground: its mean is held by the stop alone."""
    system = System(np.diag([1.0, 2.0]), np.diag([0.3, 0.0]), [[1.0, -1.0], [-1.0, 1.0]],
                    [HarmonicForce(1.0, dof=0), CubicSpring(0.5, dof=1), ElasticStop(gap=0.1, stiffness=2.0, dof=1)], omega=0.7)
    condensed = condensed_of(system, sweep=True)
    assert condensed.linear.way == POLES and np.flatnonzero(condensed.here.linear.shift).tolist() == [0]
    factors = condensed_of(system)
    for own, other in zip(condensed.here.linear[:2], factors.here.linear[:2], strict=True):
        np.testing.assert_allclose(own, other, rtol=1e-12, atol=1e-14)
    orbit = bf.find_orbit(system, method=METHOD)
    whole = bf.find_orbit(system, method=WHOLE, guess=orbit.coefficients * (1.0 + 1e-6))
    assert orbit.success and whole.success
    np.testing.assert_allclose(orbit.coefficients, whole.coefficients, atol=1e-12)


@pytest.mark.parametrize("n", [1, 2])
def test_nothing_is_lost_where_every_coordinate_is_touched(n):
    system = chain([Jenkins(1.0, 0.3, dof=i) for i in range(n)], n=n)
    orbit, whole = (bf.find_orbit(system, method=method) for method in (METHOD, WHOLE))
    assert orbit.condensed.layout.n == n
    np.testing.assert_allclose(orbit.coefficients, whole.coefficients, atol=1e-12)


@pytest.mark.parametrize("gyroscopic", [0.0, 0.1])
def test_determinant_of_an_undamped_linear_part(gyroscopic):
    """Its logarithm changes with the frequency like that of the matrices, over the sizes of the modes' factors."""
    K, C = 2.0 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1), np.zeros((4, 4))
    C[0, 1], C[1, 0] = gyroscopic, -gyroscopic
    condensed = condensed_of(System(np.eye(4), C, K, [HarmonicForce(1.0), Jenkins(1.0, 0.3, dof=2)], omega=0.3), 3, sweep=True)
    poles = np.sort(np.linalg.eigvals(np.block([[np.zeros((4, 4)), np.eye(4)], [-K, -C]])).imag)[4:]
    found = []
    for omega in (0.3, 0.37):
        own, true = condensed.linear.log_determinant(at(condensed, omega).T, False), 0.0
        for k in (1, 2, 3):
            w = k * omega
            size = np.log(poles**2 + w * w) if not gyroscopic else 2.0 * np.log(poles + w)  # a pole each, or a pair of them
            true += 2.0 * (np.linalg.slogdet(K - w * w * np.eye(4) + 1j * w * C)[1] - size.sum())
        found.append((own, true))
    assert found[0] == pytest.approx(found[0][::-1], abs=1e-9) and found[1] == pytest.approx(found[1][::-1], abs=1e-9)
    damped = condensed_of(chain(CONTACTS["slider"][0]), 3, sweep=True)
    assert damped.linear.log_determinant(damped.here.T, False) == 0.0


# derivatives

def at(condensed, omega):
    """The point at another frequency, with derivatives by it: differences of numbers that are polynomials up to degree 4."""
    balance, step = condensed.balance, 1e-3 * omega

    def flat(value):
        system = balance.system
        return balance.parts.flat_of(System(system.mass, system.damping, system.stiffness, system.elements, omega=value))
    near = [flat(omega + i * step) for i in (-2, -1, 1, 2)]
    return condensed.point(flat(omega), (near[0] - near[3] + 8.0 * (near[2] - near[1])) / (12.0 * step), False)


def differences(condensed, u, omega, step=1e-6):
    """Central differences by the unknowns, and by omega."""
    def value(j, h):
        moved = u.copy()
        if j < condensed.size:
            moved[j] += h
            return condensed.residual(moved, at(condensed, omega))
        return condensed.residual(u, at(condensed, omega + h))
    return np.array([(value(j, step) - value(j, -step)) / (2.0 * step) for j in range(condensed.size + 1)]).T


def rough(layout, rng, size=1.0, more=0):
    u = size * rng.standard_normal(layout.size).reshape(layout.slots, layout.n) / (1.0 + layout.waves[:, None])**2
    return np.concatenate([u.ravel(), size * rng.standard_normal(more)])


@pytest.mark.parametrize("contacts", CONTACTS)
@pytest.mark.parametrize(("damping", "sweep"), [("modal", True), ("gyroscopic", True), ("gyroscopic", False)])
def test_derivatives_are_those_of_differences(damping, sweep, contacts, rng):
    condensed = condensed_of(chain(CONTACTS[contacts][0], damping), drives=True, sweep=sweep)
    assert condensed.size == condensed.layout.size + 2
    u = rough(condensed.layout, rng, more=2)
    status, _, wide = condensed.linearised(u, at(condensed, 0.35))
    assert status is ContactStatus.FOLLOWED
    near = differences(condensed, u, 0.35)
    for own, other in ((wide[:, :-1], near[:, :-1]), (wide[:, -1], near[:, -1])):
        np.testing.assert_allclose(own, other, atol=1e-7 * np.abs(other).max())


@pytest.mark.parametrize("element", [BaseMotion(0.7, damper="ground", row=(1.0,) * 9 + (0.5,)), Driven(Jenkins(1.0, 0.2), 0.7)])
@pytest.mark.parametrize("damping", ["modal", "local"])
def test_derivatives_where_the_load_depends_on_the_frequency(damping, element, rng):
    system = chain([element, Jenkins(1.0, 0.3, dof=6)], damping)
    condensed = condensed_of(system, 3, sweep=True)
    u = rough(condensed.layout, rng)
    _, f, wide = condensed.linearised(u, at(condensed, 0.35))
    near = differences(condensed, u, 0.35)
    np.testing.assert_allclose(wide, near, atol=1e-7 * np.abs(near).max())
    there = condensed_of(chain([element, Jenkins(1.0, 0.3, dof=6)], damping, omega=0.35), 3)
    np.testing.assert_allclose(f, there.residual(u), atol=1e-13)


@pytest.mark.parametrize("damping", ["modal", "local"])
def test_gradient_of_what_is_recovered(damping, rng):
    condensed = condensed_of(chain(CONTACTS["law"][0], damping), drives=True, sweep=True)
    u, g = rough(condensed.layout, rng, more=2), rng.standard_normal(condensed.whole.size)
    own = condensed.gradient(g, u, at(condensed, 0.35))
    h = 1e-6
    near = [g @ (condensed.expand(u + h * e, at(condensed, 0.35)) - condensed.expand(u - h * e, at(condensed, 0.35))) / (2.0 * h)
            for e in np.eye(condensed.size)]
    near.append(g @ (condensed.expand(u, at(condensed, 0.35 + h)) - condensed.expand(u, at(condensed, 0.35 - h))) / (2.0 * h))
    np.testing.assert_allclose(own, near, atol=1e-7 * np.abs(near).max())


# linear parts that are singular alone

def free(omega):
    """Two masses joined by a spring; only the slider and the stops hold them."""
    return System(np.eye(2), 0.05 * np.array([[1.0, -1.0], [-1.0, 1.0]]), [[1.0, -1.0], [-1.0, 1.0]],
                  [HarmonicForce(1.0, dof=0), CubicSpring(0.5, dof=1), ElasticStop(gap=0.1, stiffness=2.0, dof=1)], omega=omega)


def undamped(omega):
    """A mode at three times the frequency exactly."""
    return System(np.eye(2), np.zeros((2, 2)), np.diag([9.0 * 0.5**2, 2.0]) + np.zeros((2, 2)),
                  [HarmonicForce(0.6, dof=0), CubicSpring(0.5, row=(1.0, -0.5)), LinearSpring(0.0, 0.2, dof=1)], omega=omega)


@pytest.mark.parametrize("made", [free, undamped])
def test_singular_linear_part(made, rng):
    condensed = condensed_of(made(0.5))
    assert condensed.here.linear.shift.any() and condensed.here.linear.regular
    u = rough(condensed.layout, rng, 0.4)
    near = differences(condensed, u, 0.5, 1e-7)  # nearer than where the spring is no longer added
    np.testing.assert_allclose(condensed.linearised(u, at(condensed, 0.5))[2], near, atol=1e-7 * np.abs(near).max())
    orbit = bf.find_orbit(made(0.5), method=METHOD)
    assert orbit.success and orbit.condensed is not None
    x = orbit.coefficients
    whole = bf.find_orbit(made(0.5), method=WHOLE, guess=x * (1.0 + 1e-6))
    assert whole.success and np.abs(x - whole.coefficients).max() <= 1e-12 * np.abs(x).max()


def test_resonance_that_no_contact_reaches_is_told():
    system = System(np.eye(2), np.zeros((2, 2)), np.diag([1.0, 0.25]),
                    [HarmonicForce(1.0, dof=0), Jenkins(1.0, 0.3, dof=0)], omega=0.5)
    assert not condensed_of(system, 3).here.linear.regular
    orbit = bf.find_orbit(system, method=HarmonicBalance(3, condense=True))  # the whole balance says so
    assert orbit.condensed is None and orbit.status is BalanceStatus.SINGULAR


# refusals

def test_nothing_touched_is_refused():
    with pytest.raises(ValueError, match="linear_response"):
        Condensed(Balance(chain([]), Layout(listed(3), 10)))


def test_repr_and_bad_motion():
    condensed = Condensed(Balance(chain(CONTACTS["slider"][0]), Layout(listed(3), 10)))
    assert repr(condensed) == "Condensed(10 degrees of freedom to 1, 7 unknowns, receptance by modes)"
    status, f, _ = condensed.linearised(np.full(7, np.nan))
    assert status is ContactStatus.NOT_FINITE and np.isnan(f).all()


def test_a_branch_where_every_pole_lies_in_a_cluster():
    """Two critically damped pairs that circulatory stiffness couples one way: no pole stands alone; the whole balance agrees."""
    K = np.array([[1.0, 0.5, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 4.0, 0.7], [0.0, 0.0, 0.0, 4.0]])
    elements = bf.elements.HarmonicForce(1.0), bf.elements.ElasticStop(gap=0.05, stiffness=2.0)
    system = bf.System(np.eye(4), np.diag([2.0, 2.0, 4.0, 4.0]), K, elements, omega=0.7)
    ends = []
    for condense in (True, False):
        orbit = bf.find_orbit(system, method=bf.HarmonicBalance(5, condense=condense))
        branch = bf.trace(orbit, "omega", bounds=(0.5, 0.9))
        assert branch.stop_reason == ("bound", "bound")
        ends.append(branch.column("max_0")[[0, -1]])
    np.testing.assert_allclose(ends[0], ends[1], rtol=1e-13)


def test_loads_beside_the_rows_are_driven_once_each():
    """Loads along one line, whatever their phase and size, share an output; what the rows span and a mean need none."""
    rows = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]])
    load = np.zeros((6, 4), complex)
    load[0] = 3.0, 0.0, 5.0, 0.0  # a mean
    load[1] = 0.0, 0.0, 2.0j, 2.0j
    load[2] = 1.0 - 1.0j, 4.0, 0.0, 0.0  # along the rows
    load[3] = 0.0, 0.0, -0.1, -0.1
    load[5] = 1.0, 0.0, 0.0, 1.0
    out, drives = _driven(load, rows, (0, 1, 2, 3, 4, 5))
    assert out.dtype == float and np.array_equal(out[:2], rows) and len(out) == 4
    assert np.abs(out[2]) == pytest.approx([0.0, 0.0, 0.5, 0.5]) and np.abs(out[3]) == pytest.approx([0.5, 0.0, 0.0, 0.5])
    assert drives.tolist() == [[1, 2], [3, 2], [5, 3]]
    load[4] = 0.0, 0.0, 1.0, 1.0j  # two phases: no real direction
    out, drives = _driven(load, rows, (0, 1, 2, 3, 4, 5))
    assert np.iscomplexobj(out) and drives.tolist() == [[1, 2], [3, 2], [4, 3], [5, 4]]
    out, drives = _driven(load[[0, 2]], rows, (0, 2))
    assert np.array_equal(out, rows) and drives.shape == (0, 2)


@pytest.mark.parametrize("phase", [0.0, 0.7])
def test_two_harmonics_of_one_load_away_from_the_contact(phase):
    """The condensed balance is that of the whole system, with loads of two harmonics on a coordinate that no contact touches."""
    loads = [HarmonicForce(0.6, dof=6), HarmonicForce(0.3, 3, phase, dof=6), HarmonicForce(0.2, 2, dof=8)]
    system = chain([*loads, ElasticStop(gap=0.2, stiffness=3.0, dof=1)], omega=0.4)
    small, whole = (bf.find_orbit(system, method=method) for method in (METHOD, WHOLE))
    assert small.success and whole.success and small.condensed.size == 11
    np.testing.assert_allclose(small.coefficients, whole.coefficients, rtol=0, atol=1e-11 * np.abs(whole.coefficients).max())
