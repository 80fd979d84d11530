"""Many random orbits and points: closed forms are contained, nothing false is proved, little is left undecided."""
import numpy as np
import pytest

from bifurc.certify import Verdict, certify_orbit, certify_point
from bifurc.orbits.orbit import PeriodicOrbit
from bifurc.orbits.shooting.signature import Signature, sections
from tests.certify.orbits_made import one_impact, random_cases, system_of
from tests.certify.points_made import folds_and_flips, grazings, moved
from tests.certify.random_scenes import KINDS, orbits
from tests.reference import one_stop

pytest.importorskip("flint")
FULL = pytest.mark.slow


@pytest.mark.parametrize("count", [12, pytest.param(100, marks=FULL)])
def test_folds_and_flips_in_closed_form_lie_in_the_enclosures(count):
    seen = {"fold": 0, "period_doubling": 0}
    for force, point in folds_and_flips(2 * count, 5):
        found = certify_point(point)
        assert found.proved, (point, found.message)
        assert found.parameter[0] <= force <= found.parameter[1]
        assert found.parameter[1] - found.parameter[0] < 1e-12 * max(1.0, float(force))
        seen[str(point.kind)] += 1
        assert not certify_point(moved(point, 1e-5)).proved
    assert min(seen.values()) >= 0.3 * count


@pytest.mark.parametrize("count", [12, pytest.param(100, marks=FULL)])
def test_grazings_in_closed_form_lie_in_the_enclosures(count):
    for force, point in grazings(count, 6):
        found = certify_point(point)
        assert found.proved, (point, found.message)
        assert found.parameter[0] <= force <= found.parameter[1]


def claims(count, seed):
    """Yield false orbits: formal ones that go through the stop, shifted states and times, wrong sequences, wrong systems."""
    rng = np.random.default_rng(seed)
    made = 0
    for zeta, omega, force, gap, r, n in random_cases(10**6, seed):
        for reference in one_stop.orbits(zeta, omega, force, gap, r, n, samples=60):
            system = system_of(zeta, omega, force, gap, r)
            orbit = one_impact(system, reference.time, reference.speed, n, gap)
            if not reference.admissible and float(reference.margin) < -1e-9:
                yield "penetrates", orbit
                made += 1
            if reference.admissible:
                size = float(10.0 ** rng.uniform(-8.0, -2.0))
                place = int(rng.integers(3))
                unknowns = orbit.unknowns
                unknowns[place] += size * (1.0 if place == 0 else orbit.weights[place - 1])
                yield "shifted", PeriodicOrbit(system, orbit.sequence, unknowns, orbit.weights)
                other = system.with_parameters(gap=gap + 10.0 * size * float(orbit.weights[0]))  # beyond 1e-9: what counts as none
                yield "another system", PeriodicOrbit(other, orbit.sequence, orbit.unknowns, orbit.weights)
                sequence = orbit.sequence
                late = PeriodicOrbit(system, Signature(sequence.nodes, sequence.fixed, sequence.span + 1.0), orbit.unknowns,
                                     orbit.weights)
                if float(reference.speed) > 1e-3:
                    yield "wrong period", late
                    made += 1
                motion = reference.motion
                answer = complex(motion.receptance) * force
                if abs(answer) > gap + 1e-6:
                    mode = int(sequence.nodes[0, 0])
                    yield "no event", PeriodicOrbit(system, sections(mode, 1.0), np.array([0.0, answer.real, -omega * answer.imag]),
                                                    orbit.weights)
                    made += 1
                made += 2
            if made >= count:
                return


@pytest.mark.parametrize("count", [60, pytest.param(500, marks=FULL)])
def test_false_orbits_are_not_proved(count):
    kinds: dict = {}
    for kind, orbit in claims(count, 11):
        kinds[kind] = kinds.get(kind, 0) + 1
        assert not certify_orbit(orbit).proved, (kind, orbit.system, orbit.unknowns)
    assert sum(kinds.values()) >= count and len(kinds) == 5, kinds


@pytest.mark.parametrize("count", [12, pytest.param(150, marks=FULL)])
def test_multipliers_that_are_wrong_are_not_contained(count):
    seen = 0
    for zeta, omega, force, gap, r, n in random_cases(10**6, 21):
        for reference in one_stop.orbits(zeta, omega, force, gap, r, n, samples=60):
            if not reference.admissible or float(reference.margin) < 1e-6 or float(reference.speed) < 1e-6:
                continue
            found = certify_orbit(one_impact(system_of(zeta, omega, force, gap, r), reference.time, reference.speed, n, gap))
            assert found.proved, found.message
            (event,) = found.events
            assert event.time[0] <= reference.time <= event.time[1] and event.speed[0] <= reference.speed <= event.speed[1]
            gaps = abs(reference.multipliers[0] - reference.multipliers[1])
            for z in reference.multipliers:
                assert any(re[0] <= z.real <= re[1] and im[0] <= z.imag <= im[1] for re, im in found.multipliers)
                if gaps > 1e-3:
                    assert not found.contains(complex(z) + 1e-6)
            top = float(abs(reference.multipliers[0]))
            assert found.stable is Verdict.of(top < 1.0) or abs(top - 1.0) < 1e-9
            seen += 1
        if seen >= count:
            return


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("count", [12, pytest.param(100, marks=FULL)])
def test_orbits_of_random_scenes_are_proved(kind, count):
    """At most two in a hundred may stay undecided; the verdict on stability is that of the multipliers."""
    left = []
    for orbit in orbits(kind, count, 5):
        found = orbit.certify()
        if not found.proved:
            left.append(found.message)
            continue
        assert found.stable is not Verdict.of(not orbit.stable) or orbit.stable is None
    assert len(left) <= 0.02 * count, left
