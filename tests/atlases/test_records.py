"""Attractors and branches side by side in files: what is written is read, whatever stands beside it."""
import numpy as np

import bifurc as bf
from bifurc.atlases.identity import repeats
from bifurc.atlases.records import packed_branches, unpacked_branches
from bifurc.basins.attractors.records import packed, packed_points, unpacked, unpacked_points
from bifurc.continuation.shooting.problem import orbit_problem


def test_attractors_of_one_place_and_of_many_and_branches_share_one_file():
    systems = [bf.systems.impact_oscillator(omega=omega) for omega in (1.3, 1.4, 1.5)]
    a, b, c = (bf.find_orbit(system, guess=(0.0, 0.0)) for system in systems)
    branch = bf.trace(a, "omega", bounds=(1.29, 1.31), max_steps=3)
    alone, arrays = packed([a, b])
    points, more = packed_points([[a], [], [b, c]] + [[]] * 8 + [[c]])  # two digits: p1 and p11
    branches, most = packed_branches([None, branch])
    everything = arrays | more | most
    assert len(everything) == len(arrays) + len(more) + len(most)

    def states(orbits):
        return [tuple(orbit.state) for orbit in orbits]

    assert states(unpacked(alone, everything)) == states([a, b])
    assert [states(orbits) for orbits in unpacked_points(points, everything)] == [
        states(orbits) for orbits in ([a], [], [b, c], *[[]] * 8, [c])]
    nothing, again = unpacked_branches(branches, everything)
    assert nothing is None and np.array_equal(again.column("omega"), branch.column("omega"))


def test_an_orbit_run_through_several_times_is_no_longer_one():
    """Written out over 2, 3 or 4 of its periods an orbit of one period repeats; one of two periods does not."""
    system = bf.systems.impact_oscillator(omega=2.8, amplitude=1.0, gap=0.0, restitution=0.6, zeta=0.1)
    for periods in (1, 2, 4):
        orbit = bf.find_orbit(system, periods=periods, guess=(-0.7, 0.1))
        assert orbit.success and orbit.periods == periods
        assert not repeats(orbit)
        problem = orbit_problem(orbit, "gap", (-0.1, 0.1))
        for times in (2, 3):
            again, x = problem.repeated(problem.x0, times)
            assert again.solution(x).periods == times * periods and repeats(again.solution(x))
