"""Multipliers where the sequence of events changes: what the audit may demand there, and tori that hide beside grazes."""
import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation.resimulation import unexplained
from bifurc.continuation.steps import hidden
from bifurc.elements import Coulomb, ElasticStop, HarmonicForce, RigidStop


@pytest.fixture(scope="module")
def symmetric():
    """Return a mass between two equal stops, through the graze of both."""
    system = bf.System(1.0, 0.176, 1.0, [HarmonicForce(0.443), RigidStop(0.862, 0.468), RigidStop(0.862, 0.468, side=-1)],
                       omega=0.652)
    return bf.trace(bf.find_orbit(system), "omega", bounds=(0.4564, 0.8476))


def test_symmetric_orbits_keep_the_index_of_half_a_period(symmetric):
    """The unstable orbit beyond the graze has one multiplier beyond +1 over a period: half a period has it beyond -1."""
    assert [point.kind.value for point in symmetric.special_points] == ["grazing"]
    at = symmetric.special_points[0].s
    after = np.flatnonzero(symmetric.column("s") > at + 0.1)[0]
    assert symmetric.orbits[after].multipliers[0].real > 1.0
    assert symmetric.audit.ok, symmetric.audit.resimulated.unexplained


def test_half_multipliers_are_square_roots(symmetric):
    """Over half a period with the mirror; the free orbit has -exp(-c T / 4) exp(+-i w T / 2) in closed form."""
    orbit = symmetric.orbits[0]
    x = symmetric.x(0)
    half = symmetric.problems[0].half_multipliers(x)
    T = 2.0 * np.pi / x[-1]
    w = np.sqrt(1.0 - 0.088**2)
    exact = -np.exp(-0.088 * T / 2.0) * np.exp(1j * w * T / 2.0 * np.array([1.0, -1.0]))
    np.testing.assert_allclose(np.sort_complex(half), np.sort_complex(exact), rtol=0, atol=1e-13)
    np.testing.assert_allclose(np.sort_complex(half**2), np.sort_complex(orbit.multipliers), rtol=0, atol=1e-13)
    last = len(symmetric) - 2
    half = symmetric.problems[-1].half_multipliers(symmetric.x(last))
    np.testing.assert_allclose(np.sort(half.real**2), np.sort(symmetric.orbits[last].multipliers.real), rtol=1e-9)
    assert half.real.min() < -1.0


def test_a_mismatch_beyond_the_graze_is_still_said(symmetric, monkeypatch):
    """Without half periods the change of the index is not explained, and the audit says so."""
    for problem in symmetric.problems:
        monkeypatch.setattr(type(problem), "half_multipliers", lambda self, x: None)
    assert len(unexplained(symmetric, symmetric._arrays)) == 1


def test_tests_that_begin_at_zero_are_no_pairs():
    """A mass on a belt: at an onset of slip another test leaves zero with the square of the way."""
    system = bf.System(1.0, 0.0228, 1.0, [HarmonicForce(0.468), Coulomb(0.126, belt_speed=0.137)], omega=0.417)
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(0.2919, 0.5421))
    assert branch.unresolved == () and branch.audit.ok
    assert sum(point.kind == "slip_onset" for point in branch.special_points) == 6


def test_pairs_inside_a_step_stay_unresolved():
    """A test that touches zero inside a step to rounding is told."""
    class Touch(bf.continuation.Problem):
        monitors = (bf.continuation.Monitor("user", "touch"),)

        def residual(self, u, p):
            return u - p

        def monitor_values(self, u, p, tangent):
            return np.array([(p - 0.3141592)**2 + 1e-18])

    branch = bf.continuation.trace(Touch(0.0, 0.0), bounds=(-1.0, 1.0))
    assert [kind for kind, _, _ in branch.unresolved] == ["user"]
    assert hidden.AT_END == 1e-3


@pytest.fixture(scope="module")
def train():
    """Return two masses, one with a stop, the other with friction: impacts are born one by one where chattering begins."""
    system = bf.System(np.diag([1.0, 1.37]), [[0.0809, -0.0209], [-0.0209, 0.0809]], [[1.349, -0.349], [-0.349, 1.349]], [
        HarmonicForce(0.943), RigidStop(0.648, 0.423), Coulomb(0.0572, dof=1)], omega=0.597)
    return bf.trace(bf.find_orbit(system), "rigid_stop.restitution", bounds=(0.173, 0.673))


def test_before_every_graze_of_a_train_lies_a_torus(train):
    """The pair of multipliers passes the circle before one of them grows without bound: once for every impact."""
    points = [point for point in train.special_points if point.kind in ("grazing", "neimark_sacker")]
    kinds = [point.kind.value for point in points]
    assert len(kinds) >= 18 and kinds == ["neimark_sacker", "grazing"] * (len(kinds) // 2)
    for point in points[::2]:
        pair = point.solution.multipliers
        pair = pair[np.abs(pair.imag) > 1e-7]
        assert np.abs(np.abs(pair) - 1.0).min() < 1e-6
    assert train.audit.ok, train.audit.resimulated.unexplained


def test_tori_of_a_train_are_the_same_from_both_sides(train):
    """Traced from its last impacts back, the branch has the same tori."""
    row = int(np.argmin(np.abs(train.column("rigid_stop.restitution") - 0.2186)))
    other = bf.trace(train.orbits[row], "rigid_stop.restitution", bounds=(0.173, 0.673))
    here, there = (np.array([point.parameter for point in branch.special_points
                             if point.kind == "neimark_sacker" and point.parameter > 0.2116]) for branch in (train, other))
    np.testing.assert_allclose(here, there, rtol=0, atol=1e-9)


def test_flips_of_long_sequences_are_located():
    """Twenty-five contacts in six periods: none of them is short, their product is; the flip lies where the multipliers of orbits
    beside it pass -1, and the orbit of twelve periods ends on it."""
    system = bf.System(1.0, 0.146, 1.0, [HarmonicForce(0.969), ElasticStop(-0.295, 12.8)], omega=0.448)
    doubled = bf.find_orbit(system)
    assert doubled.periods == 12
    single = bf.find_orbit(system.with_parameters(**{"elastic_stop.gap": -0.2949}), guess=doubled.state, periods=6)
    branch = bf.trace(single, "elastic_stop.gap", bounds=(-0.29505, -0.2948))
    assert [point.kind.value for point in branch.special_points] == ["period_doubling"] and branch.audit.ok
    flip = branch.special_points[0].parameter
    values = []
    for gap in (flip - 1e-6, flip + 1e-6):
        beside = bf.find_orbit(system.with_parameters(**{"elastic_stop.gap": gap}), guess=branch.special_points[0].solution.state,
                               periods=6)
        values.append(beside.multipliers.real.min() + 1.0)
    assert flip - 1e-6 + 2e-6 * values[0] / (values[0] - values[1]) == pytest.approx(flip, abs=1e-9)
    ends = bf.trace(doubled, "elastic_stop.gap", bounds=(-0.2955, -0.2948)).ends
    assert ends[1].reason == "merged" and ends[1].p == pytest.approx(flip, abs=1e-10)


def through_one_period(system, y, step=1e-6):
    """Return the derivative of the state a period later by central differences of simulations."""
    def later(y):
        return bf.simulate(system, y, periods=1)(system.period)

    return np.column_stack([(later(y + d) - later(y - d)) / (2.0 * step) for d in step * np.eye(y.size)])


@pytest.mark.parametrize(("system", "name", "bounds", "flips", "aside"), [
    # two of them between a graze and the row next to it
    (bf.System(1.0, 0.0942, 1.0, [HarmonicForce(1.55), ElasticStop(0.512, 55.6, damping=0.188)], omega=2.79),
     "omega", (1.953, 3.627), (2.00296090, 2.00475026), 2e-4),
    # one just behind the births of impacts, where the largest multiplier begins at infinity
    (bf.System(np.diag([1.0, 0.593]), [[0.1, -0.03], [-0.03, 0.08]], [[1.375, -0.375], [-0.375, 1.375]],
               [HarmonicForce(1.19), RigidStop(0.202, 0.727, row=(1.0, -1.0)), RigidStop(0.612, 0.162, row=(-1.0, 1.0))],
               omega=0.7), "harmonic_force.amplitude", (1.5, 1.78), (1.58875037, 1.75900014), 2e-5),
])
def test_flips_beside_grazes_are_found_from_everywhere(system, name, bounds, flips, aside):
    start = 0.5 * (max(flips) + bounds[1])
    branch = bf.trace(bf.find_orbit(system.with_parameters(**{name: start})), name, bounds=bounds)
    for start in (0, len(branch) // 2, -1):
        again = bf.trace(branch.orbits[start], name, bounds=bounds)
        found = sorted(point.parameter for point in again.special_points.of("period_doubling"))
        assert found == pytest.approx(flips, abs=1e-7) and again.audit.ok
    for flip in flips:  # -1 is passed there
        signs = []
        for p in (flip - aside, flip + aside):
            near = branch.orbits[int(np.argmin(abs(branch.column(name) - p)))]
            orbit = bf.find_orbit(system.with_parameters(**{name: p}), guess=near)
            assert orbit.success
            signs.append(np.sign(np.linalg.det(through_one_period(orbit.system, orbit.state) + np.eye(orbit.state.size))))
        assert signs[0] * signs[1] < 0.0
