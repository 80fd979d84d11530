"""Malformed calls end at once in an error that names the argument or shows the value: none is accepted, none hangs."""
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc import elements as el
from tests.hard.malformed import calls, verdict

QUICK = 1  # every malformed call is made in the slow run, each argument once here


def made(every):
    """Return what is wrong with the calls: (name, argument, value, what came of it)."""
    seen, wrong, count = {}, [], 0
    for name, argument, value, call in calls():
        seen[name, argument] = seen.get((name, argument), 0) + 1
        if not every and seen[name, argument] > QUICK:
            continue
        count += 1
        found, text = verdict(argument, value, call)
        if found != "good":
            wrong.append(f"{found}: {name}({argument}={value!r:.60}) -> {text:.200}")
    return wrong, count


def test_each_argument_refuses_what_it_cannot_mean():
    wrong, count = made(False)
    assert not wrong, "\n".join(wrong)
    assert count >= 110


@pytest.mark.slow
def test_no_malformed_call_is_confusing_accepted_or_slow():
    wrong, count = made(True)
    assert not wrong, "\n".join(wrong)
    assert count >= 700


def not_a_number(u, s):
    return u * np.nan


def nan_beyond_one(u, s):
    return math.sqrt(1.0 - u * u)


def test_a_law_that_gives_nan_is_told():
    """One that always does is refused; one that does somewhere ends the motion there, with a sentence, never with NaN."""
    with pytest.raises(ValueError, match="gives NaN wherever it was tried"):
        el.Force(not_a_number)
    system = bf.System(1.0, 0.01, 1.0, [el.HarmonicForce(2.0), el.Force(nan_beyond_one)], omega=1.0)
    motion = bf.simulate(system, (0.1, 0.0), periods=20)
    assert not motion.success and "finite" in motion.message
    for guess in (None, (0.1, 0.0)):
        orbit = bf.find_orbit(system, guess)
        assert not orbit.success and "The simulation ended early" in orbit.message


def test_the_identity_as_a_map_is_a_continuum_of_fixed_points():
    found = bf.cell_mapping(lambda x: x, bf.Grid(q0=(-1, 1, 8)), audit=0)
    assert len(found.attractors) == 0, found


def test_a_grid_beyond_the_memory_is_refused_before_work():
    with pytest.raises(MemoryError, match="is allowed: write at most"):
        bf.basins_of_attraction(bf.systems.impact_oscillator(), bf.Grid(q0=(-1, 1, 10**6), v0=(-1, 1, 10**6)))
