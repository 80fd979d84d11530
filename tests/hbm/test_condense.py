"""Condensed balances: the solutions of the whole ones, receptances, derivatives against differences, singular linear parts."""
import numpy as np
import pytest

from bifurc import System
from bifurc.elements import BaseMotion, CubicSpring, ElasticStop, HarmonicForce, Jenkins, LinearSpring
from bifurc.elements.driven import Driven
from bifurc.hbm.balance import Balance
from bifurc.hbm.condense import Condensed
from bifurc.hbm.layout import Layout, listed
from bifurc.hbm.status import BalanceStatus, MarchStatus
from bifurc.solve.newton import newton


def chain(elements, damping="modal", n=10, omega=0.3):
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    C = 0.01 * np.eye(n) + 0.02 * K
    if damping == "local":
        C[n // 2, n // 2] += 0.3
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


@pytest.mark.parametrize("contacts", CONTACTS)
@pytest.mark.parametrize("damping", ["modal", "local", "gyroscopic"])
def test_solution_is_that_of_the_whole_balance(damping, contacts):
    elements, count = CONTACTS[contacts]
    # gyroscopic: at 0.3 Newton finds nothing with two contacts, neither here nor for the whole balance
    omega = 0.4 if damping == "gyroscopic" else 0.3
    balance = Balance(chain(elements, damping, omega=omega), Layout(listed(5), 10))
    condensed = Condensed(balance)
    assert condensed.modal is (damping == "modal") and condensed.size == 11 * count
    found = condensed.solve()
    assert found.success
    x = condensed.expand(found.u)
    whole = newton(balance.residual, balance.jacobian, balance.linear_response())
    if not whole.success or np.abs(whole.x - x).max() > 1e-3:  # another path of Newton's, or another motion: from near this one
        whole = newton(balance.residual, balance.jacobian, x * (1.0 + 1e-6))
    assert whole.success
    assert np.abs(x - whole.x).max() <= 1e-12 * np.abs(whole.x).max()
    np.testing.assert_allclose(condensed.restricted(x), found.u, atol=1e-13 * np.abs(x).max())


def test_sampled_contacts_and_orbits_of_two_periods():
    balance = Balance(chain(CONTACTS["two"][0]), Layout(listed(3, 2), 10, 2), 256)
    condensed = Condensed(balance)
    found = condensed.solve()
    assert found.success and np.abs(balance.residual(condensed.expand(found.u))).max() <= 1e-12


@pytest.mark.parametrize("damping", ["modal", "local", "gyroscopic"])
def test_receptance_is_the_inverse_of_the_dynamic_stiffness(damping):
    balance = Balance(chain(CONTACTS["two"][0], damping), Layout(listed(5), 10))
    condensed = Condensed(balance)
    B = condensed.rows
    for k, H in zip(balance.layout.harmonics, condensed.receptance().H, strict=True):
        true = B @ np.linalg.inv(balance.stiffness(k)) @ B.T
        np.testing.assert_allclose(H, true, atol=1e-12 * np.abs(true).max())
    np.testing.assert_allclose(condensed.linear_response(), condensed.restricted(balance.linear_response()), atol=1e-12)


# derivatives

def differences(condensed, u, omega, step=1e-6):
    """Central differences by the unknowns, and by omega."""
    def at(j, h):
        moved = u.copy()
        if j < condensed.size:
            moved[j] += h
            return condensed.residual(moved, omega)
        return condensed.residual(u, omega + h)
    return np.array([(at(j, step) - at(j, -step)) / (2.0 * step) for j in range(condensed.size + 1)]).T


def rough(layout, rng, size=1.0):
    u = size * rng.standard_normal(layout.size).reshape(layout.slots, layout.n) / (1.0 + layout.waves[:, None])**2
    return u.ravel()


@pytest.mark.parametrize("contacts", CONTACTS)
@pytest.mark.parametrize("damping", ["modal", "gyroscopic"])
def test_derivatives_are_those_of_differences(damping, contacts, rng):
    condensed = Condensed(Balance(chain(CONTACTS[contacts][0], damping), Layout(listed(5), 10)))
    u = rough(condensed.layout, rng)
    status, _, wide = condensed.linearised(u, 0.35)
    assert status is MarchStatus.FOLLOWED
    near = differences(condensed, u, 0.35)
    for own, other in ((wide[:, :-1], near[:, :-1]), (wide[:, -1], near[:, -1])):
        np.testing.assert_allclose(own, other, atol=1e-7 * np.abs(other).max())


@pytest.mark.parametrize("element", [BaseMotion(0.7, damper="ground", row=(1.0,) * 9 + (0.5,)), Driven(Jenkins(1.0, 0.2), 0.7)])
def test_derivatives_where_the_load_depends_on_the_frequency(element, rng):
    system = chain([element, Jenkins(1.0, 0.3, dof=6)])
    condensed = Condensed(Balance(system, Layout(listed(3), 10)))
    u = rough(condensed.layout, rng)
    _, f, wide = condensed.linearised(u, 0.35)
    near = differences(condensed, u, 0.35)
    np.testing.assert_allclose(wide, near, atol=1e-7 * np.abs(near).max())
    there = Condensed(Balance(chain([element, Jenkins(1.0, 0.3, dof=6)], omega=0.35), Layout(listed(3), 10)))
    np.testing.assert_allclose(f, there.residual(u), atol=1e-13)


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
    balance = Balance(made(0.5), Layout(listed(5), 2))
    condensed = Condensed(balance)
    assert condensed.receptance().shift.any() and condensed.receptance().regular
    u = rough(condensed.layout, rng, 0.4)
    near = differences(condensed, u, 0.5, 1e-7)  # nearer than where the spring is no longer added
    np.testing.assert_allclose(condensed.linearised(u)[2], near, atol=1e-7 * np.abs(near).max())
    found = condensed.solve()
    assert found.success
    x = condensed.expand(found.u)
    whole = newton(balance.residual, balance.jacobian, x * (1.0 + 1e-6))
    assert whole.success and np.abs(x - whole.x).max() <= 1e-12 * np.abs(x).max()


def test_resonance_that_no_contact_reaches_is_told():
    system = System(np.eye(2), np.zeros((2, 2)), np.diag([1.0, 0.25]),
                    [HarmonicForce(1.0, dof=0), Jenkins(1.0, 0.3, dof=0)], omega=0.5)
    found = Condensed(Balance(system, Layout(listed(3), 2))).solve()
    assert found.status is BalanceStatus.SINGULAR


# refusals

def test_nothing_touched_is_refused():
    with pytest.raises(ValueError, match="linear_response"):
        Condensed(Balance(chain([]), Layout(listed(3), 10)))


def test_repr_and_bad_motion():
    condensed = Condensed(Balance(chain(CONTACTS["slider"][0]), Layout(listed(3), 10)))
    assert repr(condensed) == "Condensed(10 degrees of freedom to 1, 7 unknowns, modal receptance)"
    status, f, _ = condensed.linearised(np.full(7, np.nan))
    assert status is MarchStatus.NOT_FINITE and np.isnan(f).all()
