"""Results are copied and sent to other processes: without what is compiled, and the same to the last bit."""
import copy
import pickle

import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import HarmonicForce, RigidStop

WAYS = [lambda item: pickle.loads(pickle.dumps(item)), copy.copy, copy.deepcopy]


@pytest.fixture(scope="module")
def branch():
    return bf.trace(bf.find_orbit(bf.systems.impact_oscillator()), "omega", bounds=(0.5, 0.75))


@pytest.mark.parametrize("way", WAYS)
def test_orbits_and_equilibria(way):
    orbit = bf.find_orbit(bf.System(1.0, 0.1, 1.0, [HarmonicForce(0.52), RigidStop(1.0, 0.7)], omega=0.9))
    assert orbit.events and orbit.stable is not None  # what is found on the way does not travel
    again = way(orbit)
    assert repr(again) == repr(orbit) and np.array_equal(again.state, orbit.state)
    assert np.array_equal(again.sample(50)[1], orbit.sample(50)[1]) and np.array_equal(again.multipliers, orbit.multipliers)
    belt = bf.systems.belt_oscillator(law="exponential", static=1.0, kinetic=0.5, belt_speed=1.5)
    rest = bf.find_equilibrium(belt)
    assert rest.stable and np.array_equal(way(rest).eigenvalues, rest.eigenvalues)
    cycle = bf.find_orbit(bf.systems.belt_oscillator())
    assert way(cycle).period == cycle.period


@pytest.mark.parametrize("way", WAYS)
def test_branches_go_on_and_their_points_can_be_left(branch, way):
    again = way(branch)
    for name in ("omega", "max_0", "multiplier_0", "stable"):
        assert np.array_equal(again.column(name), branch.column(name))
    assert [(p.kind, p.parameter) for p in again.special_points] == [(p.kind, p.parameter) for p in branch.special_points]
    assert len(bf.switch_branch(again.special_points[0])) == len(bf.switch_branch(branch.special_points[0])) > 0
    assert len(again.extend(bounds=(0.5, 0.8))) > len(branch)
    point = way(branch.special_points[0])
    assert point.grazing.verdict == branch.special_points[0].grazing.verdict


@pytest.mark.parametrize("way", WAYS)
def test_basin_maps_with_their_attractors(way):
    basins = bf.basins_of_attraction(bf.systems.impact_oscillator(omega=1.4), bf.Grid(q0=(-3, 1, 12), v0=(-4, 4, 12)))
    again = way(basins)
    assert np.array_equal(again.labels, basins.labels) and repr(again) == repr(basins)
    assert np.array_equal(again.attractors[0].state, basins.attractors[0].state)


@pytest.mark.parametrize("kind", ["grazing", "fold", "period_doubling"])
def test_curves_in_two_parameters_go_on_elsewhere(kind):
    whole = bf.trace(bf.find_orbit(bf.systems.impact_oscillator()), "omega", bounds=(0.5, 2.0))
    point = next(point for point in whole.special_points if point.kind == kind)
    at = point.parameter
    curve = bf.trace_curve(point, ("omega", "amplitude"), bounds={"omega": (0.8 * at, 1.2 * at), "amplitude": (0.5, 0.55)})
    for way in WAYS:
        again = way(curve)
        assert repr(again) == repr(curve) and np.array_equal(again.column("omega"), curve.column("omega"))
        one, two = (item.extend(bounds=(0.48, 0.57)) for item in (again, curve))
        assert len(one) == len(two) > len(curve) and one.column("omega") == pytest.approx(two.column("omega"), rel=1e-12)


@pytest.mark.parametrize("way", WAYS)
def test_delayed_motions_with_their_past(way):
    system = bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.0)], omega=1.3)
    held = bf.System(1.0, 0.1, 1.0, [HarmonicForce(1.0), bf.elements.DelayedFeedback(0.2, 1.0)], omega=1.3)
    for past in (bf.find_orbit(system), bf.simulate(system, (0.0, 0.0), periods=2)):
        motion = bf.simulate(held, (0.1, 0.0), t0=past.period if past.periodic else past.stop, periods=2, history=past)
        assert np.array_equal(way(motion).sample(40)[1], motion.sample(40)[1])
