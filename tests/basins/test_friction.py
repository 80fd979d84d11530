"""Starts under friction, rigid and with memory: the kernels against simulations, and what basin maps make of them."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.basins import Kernel, PeriodMap
from bifurc.elements import Coulomb, HarmonicForce, Iwan, Jenkins, RigidStop

DRY = bf.systems.dry_friction_oscillator()
JENKINS = bf.systems.jenkins_oscillator()
CHATTER_FREE = RigidStop(gap=0.6, restitution=0.7)


def forced(omega, *elements):
    return bf.System(1.0, 0.1, 1.0, (HarmonicForce(2.0), *elements), omega=omega)


SCENES = {
    "sticks twice a period": (DRY, Kernel.LANES),
    "load that vanishes": (bf.systems.dry_friction_oscillator(load_amplitude=1.3, load_phase=0.7), Kernel.LANES),
    "friction and a stop": (forced(2.6, Coulomb(0.2), CHATTER_FREE), Kernel.LANES),
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
