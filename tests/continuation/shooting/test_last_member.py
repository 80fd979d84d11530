"""Where a mass that sticks all the time just may: closed form of two masses, of which the second rubs.

While it stands, at a place y, the first one is a linear oscillator: what it pulls the second with has a mean that falls with y, and
an amplitude in proportion to that of the harmonic load.  Both limits are reached at the place where that mean is zero, and at one
amplitude.  Slips beyond, however short, lead to it and are found from it.
"""
import numpy as np
import pytest

import bifurc as bf
from bifurc.elements import ConstantForce, Coulomb, HarmonicForce

NAME = "harmonic_force.amplitude"


def pulled(seed, behind=False):
    """Return a system that slips, the amplitude at which it begins to, and where the mass stands there; with a third mass
    ``behind`` the second, which friction holds all the time at a place of its own."""
    rng = np.random.default_rng(seed)
    k, c, k1, k2 = rng.uniform(0.5, 2.0), rng.uniform(0.02, 0.1), *rng.uniform(0.5, 2.0, 2)
    own, omega, friction, load = rng.uniform(0.02, 0.1), rng.uniform(0.5, 2.5), rng.uniform(0.1, 0.5), rng.uniform(-0.5, 0.5)
    K, C = np.array([[k1 + k, -k], [-k, k2 + k]]), np.array([[own + c, -c], [-c, c]])
    dynamic = K[0, 0] - omega**2 + 1j * omega * C[0, 0]
    onset = friction * abs(dynamic) / abs(k + 1j * omega * c)
    contacts = [HarmonicForce(1.5 * onset), ConstantForce(load), Coulomb(friction, dof=1)]
    if behind:  # it stands at zero, and pulls with nothing but a spring that does not move
        K, C = np.pad(K, ((0, 1), (0, 1))), np.pad(C, ((0, 1), (0, 1)))
        K[1:, 1:] += 0.3 * np.array([[1.0, -1.0], [-1.0, 1.0]])
        contacts.append(Coulomb(50.0, dof=2))
    place = k * load / (K[0, 0] * K[1, 1] - k * k)
    return bf.System(np.diag([1.0, 1.3, 1.0])[:len(K), :len(K)], C, K, contacts, omega=omega), onset, place


@pytest.mark.parametrize(("seed", "behind"), [(0, False), (1, False), (2, False), (3, True), (4, True)])
def test_slips_begin_at_the_last_place_from_both_sides(seed, behind):
    system, onset, place = pulled(seed, behind)
    options = {"bounds": (0.7 * onset, 1.8 * onset), "max_steps": 400}
    slips = bf.trace(bf.find_orbit(system), NAME, **options)
    stands = slips.orbits[int(np.argmin(slips.column(NAME)))]
    assert not stands.sequence.events
    assert stands.unknowns[2] == pytest.approx(place, rel=1e-11, abs=1e-13)
    for branch in (slips, bf.trace(stands, NAME, **options)):
        point, = (point for point in branch.special_points if abs(point.parameter - onset) < 0.01 * onset)
        assert point.kind.value == "slip_onset"
        assert abs(point.parameter - onset) <= point.error < 1e-11 * onset
        assert np.ptp(branch.column(NAME)) == pytest.approx(1.1 * onset) and branch.audit.ok
