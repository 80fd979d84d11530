"""Sets of sliders with memory that no drive leaves: against incremental minimisation, one step a turn of the drive."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.compose import scene_of
from bifurc.elements import Driven, HarmonicForce, Iwan, MicroSlip
from bifurc.elements.friction.microslip import chain_stiffness
from bifurc.elements.local import ONE
from bifurc.ensemble.integrator import Integrator


def chain_turns(chain, w, drives):
    """Return memory (n,) after a drive that goes straight from one value to the next: springs' energy and lost work are least.

    The work is that of |w - w before|, with all blocks but the first free; one slider after the other, until none moves.
    """
    n, k, limits = chain.count, chain.contact, np.array(chain.limits)
    K = chain_stiffness(n, chain.spring, chain.closed) + k * np.diag(limits > 0.0)
    free = np.linalg.inv(K[1:, 1:])
    moved = np.zeros((n, n))  # of places by memory
    moved[1:, 1:] = k * free * (limits[1:] > 0.0)
    driven = np.r_[1.0, -free @ K[1:, 0]]
    A = k * (np.eye(n) - moved)  # springs' forces k (x - w) = k driven u - A w
    for u in drives:
        before, w = w.copy(), w.copy()
        for _ in range(4000):
            old = w.copy()
            for i in np.flatnonzero(limits):
                rest = k * driven[i] * u - A[i] @ w + A[i, i] * w[i]  # the force if this one did not move
                force = rest - A[i, i] * before[i]
                w[i] = before[i] + np.sign(force) * max(abs(force) - limits[i], 0.0) / A[i, i]
            if np.abs(w - old).max() < 1e-15:
                break
    return w


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("n", [3, 5, 6])
def test_a_chain_with_any_memory_moves_as_least_energy_says(n, closed, rng):
    for _ in range(6):
        chain = MicroSlip(spring=rng.uniform(1.0, 5.0), contact=1.0, limits=tuple(rng.uniform(0.2, 1.0, n)), closed=closed)
        size, w = rng.uniform(0.3, 2.5), rng.uniform(-1.0, 1.0, n) * np.array(chain.limits)
        w = chain_turns(chain, w, (0.0,))  # within the limits at the start
        motion = bf.simulate(bf.System(1.0, 1.0, 1.0, (Driven(chain, size, phase=-0.5 * np.pi),), omega=1.0), np.r_[0.0, 0.0, w],
                             periods=2)
        assert motion.success
        assert motion.final[2:] == pytest.approx(chain_turns(chain, w, (size, -size, size, -size, 0.0)), rel=0, abs=1e-12)


def oscillator(normal_load=100.0):
    return bf.systems.friction_damped_oscillator(damper="micro", n=5, omega=97.0, normal_load=normal_load)


def test_every_slider_keeps_its_limit_whatever_its_memory_was(rng):
    system = oscillator(150.0)
    damper = system.elements[-1]
    reach = np.array(damper.limits) / damper.stiffnesses
    for _ in range(10):
        q, v = rng.uniform(-1.0, 1.0), rng.uniform(-100.0, 100.0)
        motion = bf.simulate(system, np.r_[q, v, q + 2.0 * rng.uniform(-1.0, 1.0, 5) * reach], periods=2)
        y = motion(np.linspace(0.0, motion.stop, 2001))
        assert np.all(np.abs(y[:, 2:] - y[:, :1]) <= reach * (1.0 + 1e-12))


def test_one_slider_of_a_set_moves_as_alone():
    """Two sliders whose springs are so weak that the mass does not feel them: each follows |w - q| <= limit/stiffness alone."""
    weak = 1e-13
    system = bf.System(1.0, 0.1, 1.0, (HarmonicForce(1.0), Iwan((weak, weak), (0.4 * weak, 1.0 * weak))), omega=0.8)
    start = np.array([0.0, 0.0, 0.2, -0.9])  # the second, with the larger limit, slips first
    motion = bf.simulate(system, start, periods=1)
    q = motion(np.linspace(0.0, motion.stop, 400_001))[:, 0]
    for i, reach in ((2, 0.4), (3, 1.0)):
        w = start[i]
        for value in q:
            w = min(max(w, value - reach), value + reach)
        assert motion.final[i] == pytest.approx(w, rel=0, abs=1e-9)


def test_what_a_drive_leaves_is_in_order(rng):
    """Any path from the virgin state, by incremental minimisation: the usual modes of a start serve."""
    for closed in (False, True):
        chain = MicroSlip(spring=3.0, contact=1.0, limits=tuple(rng.uniform(0.2, 1.0, 5)), closed=closed)
        system = bf.System(1.0, 1.0, 1.0, (Driven(chain, 1.0),), omega=1.0)
        for _ in range(20):
            w = chain_turns(chain, np.zeros(5), rng.uniform(-3.0, 3.0, 6))
            assert scene_of(system).disordered(np.r_[0.0, 0.0, w][None]) == {}


def test_the_image_of_a_word_is_the_word_of_the_image():
    damper = oscillator().elements[-1]
    core = oscillator().core
    for word in ("sssss", "s+s++", "-s---"):
        mode, image = damper.mode(word, core), damper.mode(damper.mirrored_key(word), core)
        assert damper.mirrored_key(damper.mirrored_key(word)) == word
        for g, guard in enumerate(mode.guards):
            other = image.guards[damper.mirrored_guard(word, g)]
            turned = {key: value if key == ONE else -value for key, value in guard.value.terms.items()}
            assert other.value.terms == pytest.approx(turned)


def test_starts_of_a_map_and_guesses_of_orbits_know_it():
    """A guess whose last slider would carry twice its limit, and the same start carried by a map of starts."""
    system = oscillator()
    y = np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 5.0])
    orbit = bf.find_orbit(system, y)
    damper = system.elements[-1]
    assert np.all(np.abs(orbit.state[2:] - orbit.state[0]) <= np.array(damper.limits) / damper.stiffnesses * (1.0 + 1e-12))
    motion = bf.simulate(system, orbit.state, periods=2)
    assert motion.final[:2] == pytest.approx(orbit.state[:2], rel=0, abs=1e-7)
    integrator = Integrator(scene_of(system), 100)
    carried = integrator.propagate(np.array([y, 0.5 * y, np.zeros(7)]), 3)
    for start, end in zip((y, 0.5 * y, np.zeros(7)), carried.ends, strict=True):
        assert end == pytest.approx(bf.simulate(system, start, periods=3).final, rel=0, abs=1e-10)
