"""Numbers of a system over a parameter: ones that carry the rounding of a user's own arithmetic, and ones with a kink."""
import numpy as np
import pytest

import bifurc as bf
from bifurc import elements as el


def turned(seed):
    """Return a builder of two masses, one of them damped by c2, in coordinates in which nothing is diagonal, made by products, and
    the multiplier of that mass without damping."""
    rng = np.random.default_rng(seed)
    P = np.linalg.qr(rng.normal(size=(2, 2)))[0] @ np.diag(10.0 ** rng.uniform(-0.5, 0.5, 2))
    Q, own, zeta, forced = np.linalg.inv(P), 10.0 ** rng.uniform(-0.5, 0.8), rng.uniform(0.02, 0.2), rng.uniform(0.5, 2.5)

    @bf.systems.builder
    def system(*, c2: float = 0.05, omega: float = forced) -> bf.System:
        M, C, K = Q.T @ Q, Q.T @ np.diag([2.0 * zeta, c2]) @ Q, Q.T @ np.diag([1.0, own**2]) @ Q
        elements = [el.HarmonicForce(1.0, row=tuple(Q[0])), el.Coulomb(0.3, row=tuple(Q[0]))]
        return bf.System(*(0.5 * (A + A.T) for A in (M, C, K)), elements, omega=omega)

    return system, np.exp(2j * np.pi * own / forced)


@pytest.mark.parametrize("seed", [*range(8), 12, 34, 41])  # of the last, some cancel to a millionth
def test_a_torus_is_born_where_one_of_two_uncoupled_masses_loses_its_damping(seed):
    system, multiplier = turned(seed)
    branch = bf.trace(bf.find_orbit(system()), "c2", bounds=(-0.04, 0.09))
    (point,) = branch.special_points
    assert point.kind == "neimark_sacker" and abs(point.parameter) <= point.error < 1e-9
    assert np.abs(point.solution.multipliers - multiplier).min() < 1e-12


def test_numbers_with_a_kink_are_refused():
    @bf.systems.builder
    def system(*, a: float = 0.05, omega: float = 1.3) -> bf.System:
        return bf.System(1.0, 0.1, 1.0 + abs(a), [el.HarmonicForce(1.0)], omega=omega)

    with pytest.raises(ValueError, match="no smooth function of it"):
        bf.trace(bf.find_orbit(system()), "a", bounds=(-0.1, 0.1))


@pytest.mark.parametrize("place", [-0.0371, 0.0123, 0.09])
def test_a_leap_of_numbers_is_named(place):
    @bf.systems.builder
    def system(*, a: float = 0.05, omega: float = 1.3) -> bf.System:
        return bf.System(1.0, 0.1, 1.0 + a + 0.5 * (a > place), [el.HarmonicForce(1.0)], omega=omega)

    with pytest.raises(ValueError, match=rf"they leap at {place:g}, as where"):
        bf.trace(bf.find_orbit(system()), "a", bounds=(-0.1, 0.1))
