"""Measures that bound the validity of an event sequence, as the Python that is compiled: durations, speeds, rows, rounding."""
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc.compose.scene import scene_of
from bifurc.orbits.shooting import sequence
from bifurc.orbits.shooting.sequence import FOREVER, SHORT, STARTS, TOGETHER
from bifurc.orbits.shooting.signature import divided, start_orders
from tests.reference.plain import plain

# guards 0 and 1 are stops that throw back, 2 and 3 contacts without an impact
KICK = np.tile(np.array([1, 1, 0, 0]), (3, 1))
SIZE, RATIO = 3, 0.4


def unknowns(times):
    return np.array([[t, 0.4, -0.7] for t in times]).ravel()


def listed(rows, starts=()):
    nodes = np.zeros((len(rows), STARTS + 4), np.int64)
    for node, row in zip(nodes, rows, strict=True):
        node[:len(row)] = row
    for i, q, order in starts:
        nodes[i, STARTS + q] = order
    return nodes


def test_durations_go_round_the_span():
    U = unknowns([0.3, 0.5, 1.1])
    assert [plain(sequence.duration)(U, SIZE, 2.0, i) for i in range(3)] == pytest.approx([1.2, 0.2, 0.6])


@pytest.mark.parametrize("nodes, want", [
    ([(0, 2, 0), (0, 2, 0)], [True, True]),  # contacts without impacts
    ([(0, 0, 0), (0, 2, 0)], [False, True]),  # an impact is measured by its speed; what follows it by its duration
    ([(0, -1, 0), (0, 2, 0)], [False, False]),  # a section; behind a section
    ([(0, 2, 0), (0, 3, 0, TOGETHER)], [True, False]),  # always at the instant of the one before
    ([(0, 0, 1, 0, 1), (1, 2, 0)], [False, False]),  # behind a complete chattering there is a rest
    ([(0, 0, 1, 0, 1), (1, 2, 0, 1)], [False, True]),  # but for a birth
    ([(0, 0, 0, 0, 2), (0, 2, 0)], [False, True]), ([(0, 2, 1, 0, 1), (1, 2, 0)], [True, True])])
def test_durations_that_bound_a_sequence(nodes, want):
    nodes = listed(nodes)
    assert [bool(plain(sequence.lasts)(KICK, nodes, i)) for i in range(len(nodes))] == want


def test_a_short_duration_is_measured_as_a_part_of_a_short_neighbour():
    evened = plain(sequence.evened)
    for lasted, beside in ((0.3, 1e-4), (-0.3, 1e-4), (SHORT, 1e-9)):
        assert evened(lasted, beside) == lasted
    assert evened(1e-3, np.inf) == pytest.approx(1e-3) and evened(1e-3, 5 * SHORT) == pytest.approx(1e-3)
    e = 1e-3  # two that vanish as e and e^2: the second is linear as well
    assert evened(e * e, e) == pytest.approx(e * SHORT) and evened(e, e * e) == pytest.approx(SHORT)
    assert evened(-e * e, e) == pytest.approx(-e * SHORT) and evened(-1e-5, 1e-7) == pytest.approx(-SHORT)


def tables(**changes):
    made = {"kick": KICK, "n_holds": np.zeros(3, np.int64), "n_guards": np.full(3, 4), "flat": np.array([2.0]),
            "ratio": np.full(KICK.shape, RATIO)}
    return SimpleNamespace(**{**made, **changes})


@pytest.mark.parametrize("order, holds, first, second, want", [
    (2, 0, (0, 2, 0), (0, 0, 0), True), (-3, 0, (0, 2, 0), (0, 0, 0), True), (1, 0, (0, 2, 0), (0, 0, 0), False),
    (FOREVER, 0, (0, 2, 0), (0, 0, 0), False), (2, 1, (0, 2, 1), (1, 0, 1), False), (2, 0, (0, 1, 0), (0, 0, 0), False),
    (2, 0, (0, 2, 0), (0, 3, 0), False), (2, 0, (0, 2, 0), (0, 0, 0, 1), False), (2, 0, (0, -1, 0), (0, 0, 0), False)])
def test_impacts_that_may_overtake_what_comes_before_them(order, holds, first, second, want):
    """Behind a contact a guard rises with the square of time; nothing begins to be held, and none of the two is born."""
    nodes = listed([first, second], [(0, 3, order)])
    T = tables(n_holds=np.array([0, holds, 0]))
    assert bool(plain(sequence.overtakes)(T, nodes, 1)) is want


def measured(nodes, times, i, speed=0.8, span=1.0, starts=()):
    """Return the measure of a node whose guard, with the gradient (3, 4, 0), has a rate ``speed``; frequency 2."""
    def gradient(T, mode, guard, x, row):
        row[:] = 3.0, 4.0, 0.0
    return plain(sequence.measure, guard_gradient=gradient, field=lambda T, m, x, f: None, forcing_rate=lambda T, x, dw: None,
                 guard_rate=lambda row, f, dw: speed)(tables(), listed(nodes, starts), span, unknowns(times), np.array([0.5, 0.25]),
                                                      i, np.zeros(3), np.zeros(2), np.zeros(1), np.zeros(3))


def test_events_are_measured_by_their_speed_or_their_duration():
    scaled = 0.8 / (2.5 * 2.0)  # 3 * .5 + 4 * .25, times the frequency
    free = [(0, 0, 0), (0, 1, 0)]
    assert measured(free, (0.2, 0.5), 0) == pytest.approx(scaled) == measured(free, (0.2, 0.5), 1)
    assert measured(free, (0.2, 0.2 + 1e-4), 1) == pytest.approx(scaled)  # impacts may follow each other at once
    contact = [(0, 2, 1), (1, 3, 0)]
    assert measured(contact, (0.2, 0.25), 1) == pytest.approx(0.05)  # shorter than the speed is large
    assert measured(contact, (0.2, 0.6), 1) == pytest.approx(scaled)
    assert measured(contact, (0.2, 0.2 + 0.5 * SHORT), 0) == pytest.approx(1.0 - 0.5 * SHORT)  # a short stay follows: no speed
    born = [(0, 2, 1), (1, 3, 0, 1)]
    assert measured(born, (0.2, 0.2 + 0.5 * SHORT), 1, 1e-9) == pytest.approx(0.5 * SHORT)  # its duration alone
    assert measured(born, (0.2, 0.2 + 2.0 * SHORT), 1, 1e-9) == pytest.approx(1e-9 / 5.0)


def test_a_contact_that_an_impact_lets_go_on_where_it_stopped_is_measured_as_a_part_of_its_stay():
    """A slider stops, e later an impact drives it on, and after the square of e it is back where it stopped."""
    rows, e = [(0, 2, 0), (0, 0, 0), (0, 3, 0)], 1e-4
    times = (0.2, 0.2 + e, 0.2 + e + e * e)
    overtaken = [(0, 3, 2)]
    assert measured(rows, times, 1, starts=overtaken) == pytest.approx(e)
    assert measured(rows, times, 2, starts=overtaken) == pytest.approx(e * SHORT, rel=1e-6)
    assert measured(rows, times, 2) == pytest.approx(e * e, rel=1e-6)  # an impact that comes when it comes


def test_of_a_complete_chattering_flights_with_friction_are_measured_by_their_parts():
    train = [(0, 0, 0, 0, 2), (0, 2, 0, 0, 2), (0, 0, 1, 0, 1), (1, 2, 0)]
    times = (0.1, 0.25, 0.3, 0.8)
    flights = [measured(train, times, i) for i in (0, 2)]  # impacts
    assert flights == pytest.approx([0.3 / 0.45, 0.05 / (0.05 + RATIO * 0.15)])
    assert measured([(0, 0, 1, 0, 1), (1, 2, 0)], (0.1, 0.8), 0) == np.inf  # one flight alone
    assert measured(train, times, 1) == pytest.approx(0.05 / 0.2)
    assert measured(train, (0.1, 0.08, 0.3, 0.8), 1) == pytest.approx(-0.02 / 0.24)
    assert measured(train, (0.1, 0.1 + 1e-15, 0.1 + 2e-15, 0.8), 1) == np.inf  # a flight of rounding


# along a step

@pytest.mark.parametrize("clock", [False, True])
@pytest.mark.parametrize("bend, place", [(0.0, None), (0.5, None), (1.05, 0.5)])
def test_an_interval_that_is_empty_inside_a_step_is_seen_between_its_ends(clock, bend, place):
    """Between the second event and the third lies .01 (1 - 4 bend t (1 - t)) along the step: negative inside for bend > 1."""
    nodes, length, scales = listed([(0, 2, 0), (0, 3, 0), (0, 2, 0)]), 0.2, np.array([*[2.0, 1.0, 1.0] * 3, 1.0])

    def at(t):
        x = np.append(unknowns([0.1, 0.3, 0.31]), 7.0)
        x[6] = 0.3 + 0.01 * (1.0 - 4.0 * bend * t * (1.0 - t))
        if clock:
            x[0] = 1.7
        slope = np.zeros(x.size)
        slope[6] = 0.01 * (-4.0 * bend * (1.0 - 2.0 * t)) / scales[6] / length
        return x, slope
    (last, old), (U, tangent) = at(0.0), at(1.0)
    found = plain(sequence.emptied)(KICK, nodes, 0.0 if clock else 1.0, last, old, U, tangent, scales, length)
    assert found == (pytest.approx(place, abs=0.1) if place else -1.0)


# rows and rounding

def test_rows_are_measured_in_the_sizes_of_their_states():
    weights, x = np.array([2.0, 0.5]), np.array([0.3, -0.4, 1.0, 0.6, 0.8])
    for row, size in (((1.0, 2.0, 0.5, 0.0, 0.0), 0.0), ((1.0, -2.0, 0.5, 0.0, 1.0), 2.4 / 3.0), ((0.0, 0.0, 5.0, 0.0, 0.0), 0.0)):
        assert plain(sequence.row_value)(np.array(row), x, weights) == pytest.approx(size, abs=1e-15)


def test_a_mode_begins_to_hold_where_it_holds_a_row_more():
    a, b = np.array([0.0, 1.0, 0.5]), np.array([1.0, 0.0, 0.0])
    H = np.zeros((4, 2, 3))
    H[1, 0], H[2, :2], H[3, :2] = a, [a, b], [-2.0 * b, 3.0 * a]
    T = SimpleNamespace(n_holds=np.array([0, 1, 2, 2]), H=H)
    want = {(0, 1): True, (1, 0): False, (1, 1): False, (1, 2): True, (2, 1): False, (2, 3): False, (3, 2): False, (0, 2): True}
    assert {pair: bool(plain(sequence.begins_to_hold)(T, *pair)) for pair in want} == want


def test_a_residual_is_rounding_where_that_of_the_unknowns_makes_it():
    J, U = np.array([[1e6, -2e6], [1.0, 0.0]]), np.array([1.0, 0.5])
    noise = sequence.NOISE * np.abs(J) @ np.abs(U)
    for F, good in ((0.9 * noise, True), (-0.9 * noise, True), (noise * [1.2, 0.0], False), (noise * [0.0, -1.2], False),
                    (np.array([np.nan, 0.0]), False)):
        assert bool(plain(sequence.at_rounding)(F, J, U, 0.0)) is good
    assert plain(sequence.at_rounding)(np.array([0.0, 9e-13]), J, U, 1e-12)


def test_a_plastic_impact_leaves_no_speed_whatever_the_mass_matrix():
    """Behind a plastic impact the guard is zero with its rate: the acceleration is the condition (order 2, its own).  The impulse
    of a full mass matrix leaves 1e-16 of the speed, which made an impact listed twice at one instant a solution."""
    rng = np.random.default_rng(3)
    for n in (2, 3, 4):
        for _ in range(20):
            A = rng.standard_normal((n, n))
            M = A @ A.T + n * np.eye(n)
            row = rng.standard_normal(n)
            system = bf.System(M, 0.02 * M, M + A @ A.T, [bf.elements.HarmonicForce(1.0), bf.elements.RigidStop(0.5, 0.0, row=row)],
                               omega=0.8)
            scene = scene_of(system)
            assert start_orders(scene, scene.tables, 0, 0, 0, 0).tolist() == [-2]
    M = [[2.083867, 0.253397, 0.429311], [0.253397, 1.41939, 0.353046], [0.429311, 0.353046, 1.347601]]
    C = [[0.026702, 0.001796, 0.007111], [0.001796, 0.041724, 0.004733], [0.007111, 0.004733, 0.049018]]
    K = [[1.19004, 0.080045, 0.316917], [0.080045, 1.859542, 0.210918], [0.316917, 0.210918, 2.184643]]
    system = bf.System(M, C, K, [bf.elements.HarmonicForce(1.0245, dof=1), bf.elements.RigidStop(0.5824, 0.0, dof=1, side=-1)],
                       omega=0.8053)
    orbit = bf.find_orbit(system)
    assert orbit.success and len(orbit.events) == 1
    h = 1e-6
    images = [[bf.simulate(system, orbit.state + sign * h * e, periods=1).final for sign in (1, -1)] for e in np.eye(6)]
    differenced = np.linalg.eigvals(np.array([(a - b) / (2 * h) for a, b in images]).T)
    np.testing.assert_allclose(np.sort(np.abs(differenced)), np.sort(np.abs(orbit.multipliers)), atol=1e-6)


def test_a_sequence_of_one_event_has_orders_too():
    """A window of a motion that still settles may hold one event of a slider, which does not come back to its mode."""
    scene = scene_of(bf.System(1.0, 0.05, 1.0, [bf.elements.HarmonicForce(1.0), bf.elements.Jenkins(1.0, 0.3)], omega=0.8))
    slip = [key[1] for key in scene.keys].index("slip+")
    nodes = divided(scene, np.array([[0, 0, slip, 0, 0]]))
    assert nodes.shape == (1, STARTS + scene.tables.G.shape[1]) and nodes[0, :3].tolist() == [0, 0, slip]
