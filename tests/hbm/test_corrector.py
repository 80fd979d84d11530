"""The compiled corrector of balances against numpy: points, planes, tangents and determinants."""
import numpy as np
import pytest
from scipy.optimize import root

from bifurc import System
from bifurc.elements import ElasticStop, HarmonicForce, Iwan, Jenkins
from bifurc.hbm import corrector
from bifurc.hbm.balance import Balance
from bifurc.hbm.contacts.common import FOLLOWED, NOT_SETTLED
from bifurc.hbm.contacts.margins import FIELDS, KINDS, MISS, OVERSHOOT
from bifurc.hbm.corrector import Found, Place, bordered, correct, scaled
from bifurc.hbm.layout import Layout
from bifurc.hbm.residual import linearised, order_of
from bifurc.hbm.tables import Series
from bifurc.solve.steprun import MADE, TOLD

LAYOUT = Layout((0, 1, 2, 3), 2)
M, C, K = np.diag([1.0, 1.5]), np.array([[0.2, -0.05], [-0.05, 0.3]]), np.array([[2.0, -0.7], [-0.7, 1.5]])
CONTACTS = {"slider": lambda: (Jenkins(1.5, 0.4, dof=0),), "stop": lambda: (ElasticStop(0.4, 0.8, 0.1, dof=1),),
            "both": lambda: (Jenkins(1.5, 0.4, dof=0), ElasticStop(0.4, 0.6, dof=1))}


class Case:
    """A balance along the amplitude or the frequency of its load, and calls of the corrector."""

    def __init__(self, contacts, name, low, high):
        self.name = name
        self.made = lambda p: System(M, C, K, (HarmonicForce(p if name == "amplitude" else 1.0, dof=0), *CONTACTS[contacts]()),
                                     omega=p if name == "omega" else 1.1)
        self.balance = Balance(self.made(low), LAYOUT)
        self.size = self.balance.size
        nodes = np.cos(np.pi * np.arange(3) / 2.0)  # quadratic in either
        flats = np.array([self.at(0.5 * (low + high) + 0.5 * (high - low) * z).parts.flat for z in nodes])
        places = np.flatnonzero(np.ptp(flats, axis=0) > 0.0)
        self.along = Series(flats[0].copy(), places, np.ascontiguousarray(
            np.polynomial.chebyshev.chebfit(nodes, flats[:, places], 2).T), low, high)
        self.scale = np.append(np.linspace(0.5, 2.0, self.size), 0.7)
        self.found = Found(np.empty(self.size + 1), np.empty(self.size + 1), np.zeros(corrector.INFO), np.zeros((KINDS, FIELDS)))

    def at(self, p):
        return self.balance.at(self.made(p))

    def start(self, p):
        return np.append(self.at(p).linear_response(), p)

    def equations(self, listed=None):
        parts = self.balance.parts
        listed = np.full(len(parts.contacts), -1) if listed is None else listed
        return corrector.Equations(parts.structure, parts.shape.R, self.along, self.balance.grid, listed, self.balance.room,
                                   self.scale)

    def correct(self, start, tangent, fixed, listed=None, near=False):
        return correct(self.equations(listed), Place(start, start, tangent), fixed, self.found, near)

    def wide(self, x, h=1e-6):
        """Derivatives by scaled unknowns: those of the balance, and differences by the parameter."""
        jacobian = self.at(x[-1]).jacobian(x[:-1])
        slope = (self.at(x[-1] + h).residual(x[:-1]) - self.at(x[-1] - h).residual(x[:-1])) / (2.0 * h)
        return np.column_stack([jacobian, slope]) * self.scale


@pytest.fixture(params=[("slider", "amplitude", 0.5, 2.0), ("stop", "omega", 0.8, 1.4), ("both", "omega", 0.9, 1.3)],
                ids=lambda param: f"{param[0]} along {param[1]}")
def case(request):
    return Case(*request.param)


def middle(case):
    return 0.5 * (case.along.low + case.along.high)


def test_a_point_at_a_fixed_parameter_is_that_of_a_general_solver(case):
    p = middle(case)
    start, only = case.start(p), np.append(np.zeros(case.size), 1.0)
    assert case.correct(start, only, True) == corrector.CONVERGED
    x, info = case.found.x, case.found.info
    assert x[-1] == p
    other = root(case.at(p).residual, start[:-1], jac=case.at(p).jacobian, tol=1e-13)
    np.testing.assert_allclose(x[:-1], other.x, atol=1e-9)
    assert np.abs(case.at(p).residual(x[:-1])).max() < 1e-12 and info[corrector.RESIDUAL] < 1e-9
    assert info[corrector.DISTANCE] == pytest.approx(np.linalg.norm((x - start) / case.scale), rel=1e-9)
    assert 1 <= info[corrector.ITERATIONS] <= corrector.MAX_ITERATIONS and info[corrector.CONTRACTION] < 1.0
    again = x.copy()
    assert case.correct(again, only, True) == corrector.CONVERGED and case.found.info[corrector.ITERATIONS] <= 1
    assert case.found.info[corrector.DISTANCE] < 1e-12


def test_tangents_and_determinants_are_those_of_the_matrix(case):
    p = middle(case)
    only = np.append(np.zeros(case.size), 1.0)
    assert case.correct(case.start(p), only, True) == corrector.CONVERGED
    signs = []
    for given in (1.0, -1.0):
        x = case.found.x.copy()
        assert case.correct(x, given * only, True) == corrector.CONVERGED
        new, info = case.found.new.copy(), case.found.info.copy()
        wide = case.wide(case.found.x)
        assert np.linalg.norm(new) == pytest.approx(1.0, rel=1e-13) and given * new[-1] > 0.0
        np.testing.assert_allclose(wide @ new, 0.0, atol=1e-6 * np.abs(wide).max())
        rows = wide / np.abs(wide[:, :]).max(axis=1, keepdims=True)
        sign, log = np.linalg.slogdet(np.vstack([rows, new]))
        assert info[corrector.DET_SIGN] == sign and info[corrector.DET_LOG] == pytest.approx(log, abs=1e-4)
        signs.append(sign)
    assert signs[0] == -signs[1]


def test_a_step_along_the_branch_stays_in_its_plane(case):
    p = middle(case)
    only = np.append(np.zeros(case.size), 1.0)
    assert case.correct(case.start(p), only, True) == corrector.CONVERGED
    x, new = case.found.x.copy(), case.found.new.copy()
    for ds in (0.03, -0.05):
        guess = x + ds * case.scale * new
        assert case.correct(guess, new, False) == corrector.CONVERGED
        there, after = case.found.x, case.found.new
        assert new @ ((there - guess) / case.scale) == pytest.approx(0.0, abs=1e-12)
        assert np.abs(case.at(there[-1]).residual(there[:-1])).max() < 1e-12
        assert (there[-1] - p) * ds * new[-1] > 0.0 and after @ new > 0.9
        wide = case.wide(there.copy())
        np.testing.assert_allclose(wide @ after, 0.0, atol=1e-6 * np.abs(wide).max())


@pytest.mark.parametrize("moved", (1e-13, 1e-3, 0.02, 0.2))
def test_a_correction_may_begin_with_the_events_of_a_motion_nearby(case, moved):
    """Point, tangent and margins are those of a correction that looks for all events: from far away, and from the point itself."""
    p = middle(case)
    only = np.append(np.zeros(case.size), 1.0)
    assert case.correct(case.start(p), only, True) == corrector.CONVERGED
    x, new = case.found.x.copy(), case.found.new.copy()
    guess, told = x + moved * case.scale * new, []
    for near in (True, False):
        assert case.correct(x, new, False) == corrector.CONVERGED  # there the contacts are followed last
        assert case.correct(guess, new, False, near=near) == corrector.CONVERGED
        told.append((case.found.x.copy(), case.found.new.copy(), case.found.events.copy()))
    there = told[0][0]
    other = root(lambda y: np.append(case.at(y[-1]).residual(y[:-1]), new @ ((y - guess) / case.scale)), guess, tol=1e-13)
    np.testing.assert_allclose(there, other.x, atol=1e-9)
    assert np.abs(case.at(there[-1]).residual(there[:-1])).max() < 1e-12
    for one, two in zip(*told, strict=True):
        np.testing.assert_allclose(one, two, rtol=1e-9, atol=1e-11)


def test_what_goes_wrong_has_its_code(case):
    p = middle(case)
    only = np.append(np.zeros(case.size), 1.0)
    start = case.start(p)
    assert case.correct(np.full_like(start, np.nan), only, True) == corrector.CONTACTS
    assert case.correct(start, only, True) == corrector.CONVERGED
    x, orders = case.found.x.copy(), order_of(case.balance.room)
    assert case.correct(x, only, True, orders) == corrector.CONVERGED
    assert case.correct(x, only, True, orders + 20) in (corrector.OTHER_ORDER, corrector.NOT_CONVERGED, corrector.CONTACTS)
    row = np.zeros(case.size + 1)
    row[0] = 1e-300  # no plane at all
    assert case.correct(start, 0.0 * row, False) == corrector.SINGULAR


def test_steps_of_a_run_are_those_that_are_made_alone(case):
    """Points of the branch with their tangents, and for every kind of event how nearly one is missed and how high one rises."""
    only, kinds = np.append(np.zeros(case.size), 1.0), np.arange(KINDS)
    monitored = corrector.monitored.py_func

    def told():
        return [case.found.new[-1], *(monitored(case.found.events, kind, field) for kind in kinds for field in (MISS, OVERSHOOT))]

    points, ds = [], 0.01
    assert case.correct(case.start(middle(case)), only, True) == corrector.CONVERGED
    for _ in range(2):
        log_and_sign = case.found.info[[corrector.DET_LOG, corrector.DET_SIGN]]
        points.append((case.found.x.copy(), case.found.new.copy(), told(), log_and_sign))
        if len(points) == 1:
            guess = case.found.x + ds * case.scale * case.found.new
            assert case.correct(guess, case.found.new.copy(), False) == corrector.CONVERGED
    (x0, t0, v0, d0), (x1, t1, v1, d1) = points
    tests = np.array([v0, v1, np.sign(v1), np.abs(v1), [-1.0, *[1e-9] * (2 * KINDS)]])
    back = np.linalg.norm((x1 - x0) / case.scale)
    run = np.array([ds, 0.05, case.along.low, case.along.high, np.nan, 0.0, 0.0, 0.0, back, *d0, *d1, 0.0])
    rows = np.empty((4, 2 * x1.size + tests.shape[1] + TOLD))
    steps = corrector.Run(np.array([x0, t0]), kinds, run, tests, rows)
    corrector.follow(case.equations(order_of(case.balance.room).copy()), x1, t1, case.found, steps)
    made = int(run[MADE])
    assert made >= 2
    last = x1
    for row in rows[:made]:
        x, tangent, values = np.split(row[:2 * x1.size + tests.shape[1]], [x1.size, 2 * x1.size])
        assert np.abs(case.at(x[-1]).residual(x[:-1])).max() < 1e-12 and (x[-1] - last[-1]) * t1[-1] > 0.0
        assert case.correct(x, tangent, False) == corrector.CONVERGED
        np.testing.assert_allclose(tangent, case.found.new, atol=1e-9)
        np.testing.assert_allclose(values, told(), rtol=1e-7, atol=1e-9)
        last = x


@pytest.mark.parametrize("n", range(1, 11))
def test_rows_by_scaled_unknowns(n, rng):
    row, x, scale, out = rng.standard_normal(n), rng.standard_normal(n), rng.uniform(0.5, 2.0, n), np.empty(n)
    total, top = scaled(row, x, scale, out)
    np.testing.assert_allclose(out, row * scale, rtol=1e-15)
    assert total == pytest.approx(np.abs(row * x).sum(), rel=1e-14) and top == pytest.approx(np.abs(row * scale).max(), rel=1e-15)
    matrix, tangent = rng.standard_normal((n, n)), rng.standard_normal(n)
    kept = matrix[:-1].copy()
    bordered(matrix, tangent, False)
    assert (matrix[-1] == tangent).all()
    bordered(matrix, tangent, True)
    assert (matrix[-1] == np.eye(n)[-1]).all() and (matrix[:-1] == kept).all()


SCENES = {**CONTACTS, "set of sliders": lambda: (Iwan((0.6, 0.5, 0.4), (0.2, 0.3, 0.5), dof=0),)}


@pytest.mark.parametrize("name", SCENES)
def test_events_are_carried_along_to_a_motion_beside(name, rng):
    """The residual with the events of a motion nearby is that in which they are looked for from the start."""
    balance = Balance(System(M, C, K, (HarmonicForce(2.0, dof=0), *SCENES[name]()), omega=1.1), LAYOUT)
    parts, still, compared = balance.parts, np.zeros_like(balance.parts.flat), 0
    reach = np.pi / (16 * LAYOUT.top)

    def at(x, reach):
        balance.room.spectra[:], balance.room.F[:] = 0.0, 0.0
        listed = np.full(len(parts.contacts), -1)
        code = linearised(parts.structure, parts.shape.R, parts.flat, still, x, balance.grid, False, listed, balance.room, reach)
        return code, balance.room.f.copy(), balance.room.counts[:, 0].copy()

    for _ in range(20):
        x = balance.linear_response() * rng.uniform(0.6, 3.0) + 0.05 * rng.normal(size=balance.size)
        near = x + 1e-4 * rng.normal(size=x.size)
        code, wanted, events = at(near, 0.0)
        first, _, before = at(x, 0.0)
        if code != FOLLOWED or first != FOLLOWED or not np.array_equal(events, before):
            continue
        code, found, _ = at(near, reach)
        kept = name == "set of sliders" or (name != "stop" and events.min() == 1)  # memory that no event of the period writes
        assert code == FOLLOWED or kept
        if code == FOLLOWED:
            compared += 1
            assert found == pytest.approx(wanted, abs=1e-12)
            far = x.copy()
            far[LAYOUT.n:] *= -1.0  # half a period away: its events are elsewhere
            if events.max() > 1:
                assert at(far, reach)[0] == NOT_SETTLED
    assert compared > 8
