"""Masses that stick to each other all the time are one mass; the distance at which they do so labels a family of motions."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.basins.attractors.attractors import resting, same
from bifurc.elements import ConstantForce, Coulomb, HarmonicForce
from bifurc.orbits.shooting.labels import Labels

MASSES, DAMPERS, SPRINGS, FORCE, OMEGA = np.array([1.0, 2.0, 0.5]), np.array([0.1, 0.05, 0.02]), np.array([1.5, 0.7, 1.1]), 0.3, 0.8


def stuck(n=2, pull=0.0, limit=2.0, rows=((1.0, -1.0),), omega=OMEGA):
    """Masses on springs of their own, held together by friction; ``pull`` breaks the symmetry."""
    elements = [HarmonicForce(FORCE, dof=0), *(Coulomb(limit, row=row) for row in rows)]
    elements += [ConstantForce(pull, dof=0)] if pull else []
    return bf.System(*(np.diag(part[:n]) for part in (MASSES, DAMPERS, SPRINGS)), elements, omega=omega)


def of_one(n=2, factors=(1.0, 1.0, 1.0)):
    """The multipliers of the one mass that they are, x_i = factors_i z."""
    f = np.array(factors[:n])**2
    roots = np.roots([MASSES[:n] @ f, DAMPERS[:n] @ f, SPRINGS[:n] @ f])
    return np.exp(roots * 2.0 * np.pi / OMEGA)


@pytest.mark.parametrize("pull", [0.0, 0.2])
def test_their_multipliers_are_those_of_one_mass(pull):
    orbit = bf.find_orbit(stuck(pull=pull))
    assert orbit.success and orbit.stable and orbit.family == [0]
    np.testing.assert_allclose(orbit.multipliers, [*of_one(), 0.0], atol=1e-14)


def test_three_masses_have_two_labels_and_no_other_multiplier():
    orbit = bf.find_orbit(stuck(3, pull=0.2, rows=((1.0, -1.0, 0.0), (1.0, 0.0, -1.0))))
    assert orbit.success and len(orbit.family) == 2
    np.testing.assert_allclose(orbit.labels.values(orbit.state), 0.0, atol=1e-12)
    np.testing.assert_allclose(np.abs(orbit.multipliers), [*np.abs(of_one(3)), 0.0, 0.0], atol=1e-14)


def test_masses_that_are_geared_together():
    orbit = bf.find_orbit(stuck(rows=((-0.5, 1.0),)))
    assert orbit.success
    np.testing.assert_allclose(orbit.multipliers, [*of_one(factors=(1.0, 0.5)), 0.0], atol=1e-14)


def test_the_distances_at_which_they_stick():
    """At a distance q the springs ask friction for k1 k2 q / (k1 + k2), the motion for the amplitude of the rest."""
    (m1, m2), (c1, c2), (k1, k2) = MASSES[:2], DAMPERS[:2], SPRINGS[:2]
    limit = 2.0
    orbit = bf.find_orbit(stuck(limit=limit), closure=1)
    z = FORCE / (k1 + k2 - (m1 + m2) * OMEGA**2 + 1j * OMEGA * (c1 + c2))
    moving = abs(z * (k2 - m2 * OMEGA**2 + 1j * OMEGA * c2))
    (low, high), = orbit.intervals.values()
    np.testing.assert_allclose([low, high], (limit - moving) * (k1 + k2) / (k1 * k2) * np.array([-1.0, 1.0]), rtol=1e-12)
    assert "coordinate 0 - coordinate 1 in [" in orbit.message


@pytest.mark.parametrize("pull", [0.0, 0.2])
def test_a_branch_keeps_their_distance(pull):
    """It has neither flips nor branch points: one mass on a spring has none."""
    branch = bf.trace(bf.find_orbit(stuck(pull=pull, limit=20.0)), "omega", bounds=(0.5, 1.2))
    assert [end.reason.value for end in branch.ends] == ["bound", "bound"] and not len(branch.special_points) and branch.audit.ok
    away = np.array([orbit.labels.values(orbit.state) for orbit in branch.orbits])
    assert np.ptp(away) < 1e-12
    assert branch.column("stable").all()


def test_a_branch_leaves_where_friction_no_longer_holds_them():
    """The force on the contact reaches its limit, of a motion that is known in closed form."""
    from scipy.optimize import brentq
    (m1, m2), (c1, c2), (k1, k2) = MASSES[:2], DAMPERS[:2], SPRINGS[:2]

    def asked(omega):
        z = FORCE / (k1 + k2 - (m1 + m2) * omega**2 + 1j * omega * (c1 + c2))
        return abs(z * (k2 - m2 * omega**2 + 1j * omega * c2)) - 0.5
    branch = bf.trace(bf.find_orbit(stuck(limit=0.5, omega=0.5)), "omega", bounds=(0.5, 0.9), max_steps=60)
    first = next(point for point in branch.special_points if point.kind.value == "slip_onset")
    assert abs(first.parameter - brentq(asked, 0.5, 0.855, xtol=1e-15)) < 1e-9


def test_a_proof_has_their_multipliers():
    pytest.importorskip("flint")
    for pull in (0.0, 0.2):
        proof = bf.find_orbit(stuck(pull=pull)).certify()
        assert proof.proved and proof.stable
        boxes = proof.multipliers
        for value in of_one():
            assert any(abs(complex(*box.mean(axis=1)) - value) < 1e-12 for box in boxes)


def test_all_members_are_one_attractor():
    system = stuck(pull=0.2)
    orbit = bf.find_orbit(system)
    (low, high), = orbit.intervals.values()
    scale = orbit.weights
    others = [bf.find_orbit(system, guess=bf.simulate(system, orbit.labels.moved(orbit.state, [value]), periods=60).final)
              for value in (0.5 * low, 0.7 * high)]
    assert all(other.success and not other.sequence.events for other in others)
    assert np.abs(others[0].state - others[1].state).max() > 0.1
    assert all(same(orbit, other, scale) for other in others)
    members = resting(orbit, orbit.state[None], 0.05, scale)
    for k in (*range(0, len(members), 7), len(members) - 1):
        member = members[k]
        again = bf.simulate(system, member, periods=3)
        np.testing.assert_allclose(again.final, member, atol=1e-12)
        events = [event for event in again.events if event.kind.value != "graze"]
        assert not events or k in (0, len(members) - 1)
        # at the ends friction is at its limit for an instant: what rounding makes of that lasts for the root of it
        assert [event.kind.value for event in events] == ["slip", "stick"] * (len(events) // 2)
        assert all(stick.time - slip.time < 1e-6 for slip, stick in zip(events[::2], events[1::2], strict=True))


def test_rows_that_follow_from_others_are_no_labels_of_their_own():
    rows = np.array([[1.0, -1.0, 0.0, 0.0], [0.0, 2.0, -2.0, 0.0], [1.0, 0.0, -1.0, 0.0], [0.0, 0.0, 0.0, 3.0]])
    labels = Labels.of(rows)
    assert labels.places == (0, 1, 3)
    assert np.linalg.matrix_rank(np.vstack([labels.rows, rows])) == 3
    np.testing.assert_array_equal(labels.rows[:, labels.places], np.eye(3))


def test_a_matrix_that_keeps_labels_is_reduced_to_its_other_eigenvalues(rng):
    labels = Labels.of(rng.normal(size=(2, 6)))
    T = np.vstack([labels.rows, rng.normal(size=(4, 6))])
    others = np.array([0.9, -0.4, 0.3, 0.1])
    M = np.linalg.solve(T, np.block([[np.eye(2), np.zeros((2, 4))], [rng.normal(size=(4, 2)), np.diag(others)]]) @ T)
    np.testing.assert_allclose(np.sort(np.linalg.eigvals(labels.reduced(M)).real), np.sort(others), atol=1e-10)
    gradient = rng.normal(size=6)
    y = labels.moved(rng.normal(size=6), 0.0)
    assert abs(labels.seen(gradient) @ y[labels.rest] - gradient @ y) < 1e-12
