"""Several stops touched at once: how many branches meet there, and what multipliers they have, against a linear complementarity
problem made with the periodic Green's function of the oscillator."""
import cmath
import itertools
import math
from types import SimpleNamespace

import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.shooting import several
from bifurc.continuation.shooting.several import goes_on, star
from bifurc.continuation.shooting.signature_change import admissible_side
from bifurc.elements import HarmonicForce, RigidStop


def scene(zeta, omega, r, gap=1.0):
    """Return a mass between two stops at one distance, of which the restitution is not the same."""
    touch = gap * abs(1.0 - omega**2 + 2j * zeta * omega)
    return bf.System(1.0, 2.0 * zeta, 1.0, [HarmonicForce(0.95 * touch), RigidStop(gap, r[0]), RigidStop(gap, r[1], side=-1)],
                     omega=omega), touch


def linear(system, omega, zeta):
    """Return the orbit that touches nothing."""
    x = system.parameter("harmonic_force.amplitude") / (1.0 - omega**2 + 2j * zeta * omega)
    return bf.find_orbit(system, (x.real, -omega * x.imag))


def green(zeta, omega, t):
    """Return the displacement (m = k = 1) a time ``t`` after one of the unit impulses that come once a period."""
    pole, period = complex(-zeta, math.sqrt(1.0 - zeta**2)), 2.0 * math.pi / omega
    return (cmath.exp(pole * t) / (1.0 - cmath.exp(pole * period))).imag / pole.imag


def expected(zeta, omega, r):
    """Return {number of impacts at the first stop, at the second: (side of the touch, sign of det(1 - M))} of the orbits beside the
    point at which the linear motion touches both stops.

    Impacts of the speeds v at both ends of the linear motion, half a period apart, move its ends back by H v.
    """
    own, across = green(zeta, omega, 0.0), green(zeta, omega, math.pi / omega)
    H = np.array([[own, -across], [-across, own]]) * (1.0 + np.array(r))
    found = {}
    for hit in itertools.product((0, 1), repeat=2):
        S = [k for k in (0, 1) if hit[k]]
        for side in (1.0, -1.0):
            v = np.zeros(2)
            v[S] = np.linalg.solve(H[np.ix_(S, S)], np.full(len(S), side))
            if (v[S] > 0.0).all() and all((side - H @ v)[k] < 0.0 for k in (0, 1) if not hit[k]):
                found[hit] = side, math.copysign(1.0, np.linalg.det(H[np.ix_(S, S)]))
    return found


CASES = [(0.05, 0.66, (0.85, 0.2)), (0.08, 1.3, (0.5, 0.9)), (0.02, 0.8, (0.3, 0.6)), (0.1, 1.7, (0.7, 0.1)),
         (0.04, 2.2, (0.9, 0.4)), (0.03, 0.37, (0.6, 0.8)), (0.06, 0.45, (0.2, 0.5)), (0.05, 0.54, (0.75, 0.35)),
         (0.02, 2.7, (0.15, 0.65))]


@pytest.mark.parametrize(("zeta", "omega", "r"), CASES)
def test_the_branches_that_meet_where_two_stops_are_touched_at_once(zeta, omega, r):
    """Which of the four orbits there are, on which side of the touch, and how many multipliers beyond +1 they have modulo two."""
    system, touch = scene(zeta, omega, r)
    branch = bf.trace(linear(system, omega, zeta), "harmonic_force.amplitude", bounds=(0.9 * touch, 1.1 * touch), max_steps=40)
    point = branch.special_points.of("grazing")[0]
    assert point.parameter == pytest.approx(touch, rel=1e-11)
    found = {}
    for problem, _, way, index in star(point.problem, SimpleNamespace(x=point.x), admissible_side):
        names = problem.signature.split(" / ")[0].split(", ")
        hit = tuple(names.count(f"{name}.impact") for name in ("rigid_stop", "rigid_stop_2"))
        found[hit] = math.copysign(1.0, way[-1]), index * math.copysign(1.0, way[-1])
    assert found == expected(zeta, omega, r)


@pytest.mark.parametrize(("zeta", "omega", "r"), [case for case in CASES if case[1] < 1.0])
def test_a_branch_through_two_touches_is_the_same_from_everywhere_and_keeps_its_index(zeta, omega, r):
    system, touch = scene(zeta, omega, r)
    bounds = 0.9 * touch, 1.1 * touch
    branch = bf.trace(linear(system, omega, zeta), "harmonic_force.amplitude", bounds=bounds, max_steps=150)
    assert branch.audit.ok
    places = sorted((point.kind, round(point.parameter / touch, 8)) for point in branch.special_points)
    for row in (len(branch) // 3, len(branch) - 3):
        again = bf.trace(branch.orbits[row], "harmonic_force.amplitude", bounds=bounds, max_steps=300)
        assert again.audit.ok
        assert sorted((point.kind, round(point.parameter / touch, 8)) for point in again.special_points) == places


def test_one_touch_is_no_star():
    """Stops at two distances are touched one after the other."""
    system = bf.System(1.0, 0.1, 1.0, [HarmonicForce(0.5), RigidStop(1.0, 0.8), RigidStop(1.1, 0.3, side=-1)], omega=0.66)
    branch = bf.trace(bf.find_orbit(system), "harmonic_force.amplitude", bounds=(0.4, 0.8), max_steps=60)
    point = branch.special_points.of("grazing")[0]
    assert star(point.problem, SimpleNamespace(x=point.x), admissible_side) == []


def test_branches_that_meet_are_put_in_pairs_that_keep_the_index():
    """Of four orbits the first goes on as the first that it can, the other two are one branch."""
    made: list = [SimpleNamespace(scene=None, sequence=SimpleNamespace(name=name)) for name in "abcd"]
    rows = [(problem, None, None, index) for problem, index in zip(made, (-1.0, 1.0, 1.0, -1.0), strict=True)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(several, "cycle", lambda problem: problem.sequence.name)
        pairs = {problem.sequence.name: goes_on(problem, rows)[0].sequence.name for problem in made}
    assert pairs == {"a": "b", "b": "a", "c": "d", "d": "c"}
