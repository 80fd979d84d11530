"""Starts under friction, rigid and with memory: the kernels against simulations, and what basin maps make of them."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.basins import Kernel, PeriodMap
from bifurc.elements import Coulomb, HarmonicForce, Iwan, Jenkins, RigidStop
from bifurc.ensemble.integrator import Integrator

DRY = bf.systems.dry_friction_oscillator()
JENKINS = bf.systems.jenkins_oscillator()
CHATTER_FREE = RigidStop(gap=0.6, restitution=0.7)


def forced(omega, *elements):
    return bf.System(1.0, 0.1, 1.0, (HarmonicForce(2.0), *elements), omega=omega)


SCENES = {
    "sticks twice a period": (DRY, Kernel.BATCH),
    "load that vanishes": (bf.systems.dry_friction_oscillator(load_amplitude=1.3, load_phase=0.7), Kernel.BATCH),
    "friction and a stop": (forced(2.6, Coulomb(0.2), CHATTER_FREE), Kernel.BATCH),
    "one slider": (JENKINS, Kernel.SCALAR),
    "one slider, load that vanishes": (forced(0.8, Jenkins(1.0, 0.5, load_amplitude=1.4)), Kernel.SCALAR),
    "three sliders": (forced(0.8, Iwan((1.0, 0.5, 0.5), (0.3, 0.3, 0.6))), Kernel.SCALAR),
    "slider and stop": (forced(0.8, Jenkins(1.0, 0.5), CHATTER_FREE), Kernel.SCALAR),
}


@pytest.mark.parametrize("name", list(SCENES))
def test_images_are_those_of_simulations(name, rng):
    """Also at rest, on a stop, and with sliders beyond their limits; memory at the section as it follows the motion."""
    system, kernel = SCENES[name]
    period_map = PeriodMap(system, max_events=60)
    assert period_map.kernel == kernel
    X = rng.uniform(-2.0, 2.0, (30, period_map.scene.ns))
    X[:6, 1] = 0.0
    if "stop" in name:
        X[6:10, 0], X[6:8, 1] = CHATTER_FREE.gap, 0.0
    images = period_map.apply(X, 2)
    done = images.outcomes == 0
    assert np.count_nonzero(done) >= 15
    for start, end in zip(X[done], images.ends[done], strict=True):
        np.testing.assert_allclose(end, bf.simulate(system, start, periods=2, max_events=60).final, rtol=0, atol=1e-11)
    once = period_map.apply(X[done], 1).ends
    np.testing.assert_allclose(period_map.apply(once, 1).ends, images.ends[done], rtol=0, atol=1e-11)


def test_a_basin_map_starts_with_relaxed_memory():
    """Over (q, v) sliders start where their springs carry nothing; over w0 they start where the cell says."""
    starts = bf.basins_of_attraction(JENKINS, bf.Grid(q0=(-2, 2, 5), v0=(-2, 2, 4)))
    assert starts.fractions == {0: 1.0, -1: 0.0} and len(starts.attractors) == 1
    orbit = starts.attractors[0]
    assert orbit.stable and [event.kind for event in orbit.events] == ["stick", "slip"] * 2
    named = bf.basins_of_attraction(JENKINS, bf.Grid(q0=(-2, 2, 5), w0=(-2, 2, 4), at={"v0": 0.3}), attractors=starts.attractors)
    assert named.fractions[0] == 1.0
    direct = bf.simulate(JENKINS, [-1.6, 0.3, -1.5], periods=int(named.periods[0, 0])).final
    away = np.linalg.norm((direct - orbit.state) / named.scale)
    assert away <= named.radii[0]


def test_memory_is_a_coordinate_of_a_cell_map():
    """Cells over (q, v, w) are a map; over (q, v) alone they are none, and the message says what is missing."""
    found = bf.cell_mapping(JENKINS, bf.Grid(q0=(-4, 4, 12), v0=(-5, 5, 12), w0=(-4, 4, 12)), periods=8, audit=100)
    assert found.fractions[0] == 1.0 and found.audit.wrong == 0 and len(found.attractors) == 1
    with pytest.raises(ValueError, match="runs over all of q0, v0, w0; missing: w0"):
        bf.cell_mapping(JENKINS, bf.Grid(q0=(-4, 4, 12), v0=(-5, 5, 12)))
    with pytest.raises(ValueError, match="memory w0 .. w0"):
        bf.basins_of_attraction(JENKINS, bf.Grid(q0=(-4, 4, 12), w1=(-5, 5, 12)))


@pytest.mark.parametrize("friction", [Coulomb(0.1), Coulomb(0.1, belt_speed=0.2, friction_negative=0.15, static_ratio=1.2)])
def test_rebounds_turn_friction_round_in_a_batch(friction, rng, monkeypatch):
    """A stop on the row that slides: every rebound turns the friction; the simulation has only those that come to rest there."""
    left, propagate = [], Integrator._propagate
    monkeypatch.setattr(Integrator, "_propagate", lambda self, i, *rest: (left.append(i), propagate(self, i, *rest)))
    system = bf.System(1.0, 0.1, 1.0, (HarmonicForce(1.0), friction, RigidStop(gap=0.2, restitution=0.7)), omega=2.0)
    period_map = PeriodMap(system)
    X = np.column_stack((rng.uniform(-2.0, 0.19, 200), rng.uniform(-1.5, 1.5, 200)))
    images, once = period_map.apply(X, 3), period_map.apply(X, 1)
    assert period_map.kernel == Kernel.BATCH and len(left) <= 4
    done = np.flatnonzero((images.outcomes == 0) & (once.outcomes == 0))
    assert len(done) >= 198
    impacts = 0
    for i in done:
        start = X[i]
        motion = bf.simulate(system, start, periods=3)
        np.testing.assert_allclose(images.ends[i], motion.final, rtol=0, atol=1e-12)
        np.testing.assert_allclose(once.ends[i], bf.simulate(system, start, periods=1).final, rtol=0, atol=1e-12)
        hits = [event for event in motion.events if event.kind == "impact"]
        assert images.impacts[i] == len(hits) + sum(event.kind == "chatter" for event in motion.events)
        for event in hits:
            v, after = event.before[1], event.after[1]
            np.testing.assert_allclose(0.5 * (v * v - after * after), 0.5 * (1.0 - 0.7**2) * v * v, rtol=1e-10, atol=1e-15)
        impacts += len(hits)
    assert impacts > 300


def test_starts_that_slide_with_a_load_on_the_limit_of_stick(rng, monkeypatch):
    """Their mode is the sign of their speed, whatever the guards of stick say: none is left to the simulation."""
    monkeypatch.setattr(Integrator, "_propagate", lambda *_: pytest.fail("left to the simulation"))
    v = np.concatenate((rng.uniform(0.1, 2.0, 20), rng.uniform(-2.0, -0.1, 20)))
    X = np.column_stack((rng.choice([-1.0, 1.0], 40) - 0.2 * v, v))  # x + 2 zeta v is the limit, 1
    images = PeriodMap(DRY).apply(X)
    assert not images.outcomes.any()
    for start, end in zip(X, images.ends, strict=True):
        np.testing.assert_allclose(end, bf.simulate(DRY, start, periods=1).final, rtol=0, atol=1e-12)


def test_labels_of_starts_with_a_load_on_the_limit_of_stick(monkeypatch):
    """On a grid through the limit; at rest there the guards have to say what follows, and the simulation is asked."""
    slow, follow = [], Integrator._follow
    monkeypatch.setattr(Integrator, "_follow", lambda self, i, X, *rest: (slow.append(X[i].copy()), follow(self, i, X, *rest)))
    basins = bf.basins_of_attraction(DRY, bf.Grid(q0=(-1.3, 1.3, 13), v0=(-3.5, 3.5, 7)), workers=1)
    starts = basins.grid.starts(1, 2)
    limit = np.abs(np.abs(starts @ [1.0, 0.2]) - 1.0) < 1e-13
    assert np.count_nonzero(limit & (starts[:, 1] != 0.0)) >= 8
    assert all(start[1] == 0.0 for start in slow)
    for start, label, periods in zip(starts[limit], basins.labels.ravel()[limit], basins.periods.ravel()[limit], strict=True):
        away = np.linalg.norm((bf.simulate(DRY, start, periods=int(periods)).final - basins.attractors[0].state) / basins.scale)
        assert label == 0 and away <= basins.radii[0]
