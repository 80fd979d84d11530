"""Malformed calls end at once in an error that names the argument or shows the value: none is accepted, none hangs."""
import math

import numpy as np
import pytest

import bifurc as bf
from bifurc import elements as el
from tests.hard.malformed import Case, Served, arguments, cases, close_figures, draw, everything, forms, show, verdict


def wrong_of(seed, count, most=8.0):
    """Return what is wrong with calls drawn at random."""
    return wrong_among(draw(seed, count), most)


def wrong_among(calls, most=8.0):
    """Return what is wrong with malformed calls."""
    wrong = []
    for case, argument, value in calls:
        found, text = verdict(case, argument, value, most)
        if found != "good":
            wrong.append(f"{found}: {case.name}({argument}={show(value):.60}) -> {text:.200}")
    return wrong


@pytest.mark.slow
def test_no_malformed_call_is_confusing_accepted_or_slow():
    """All of them, some fifty thousand: whatever is drawn is among them."""
    assert all(arguments(case)[name] is not None for case in cases() for name in arguments(case))  # new arguments have a kind
    wrong = wrong_among(everything())
    assert not wrong, "\n".join(wrong)


@pytest.mark.slow
def test_valid_calls_take_their_numbers_in_every_form():
    for case in cases():
        for name, value in case.base.items() if "animate" not in case.name else ():  # matplotlib warns of pictures never drawn
            for form in forms(value):
                try:
                    case.function(**{**case.base, name: form})
                except Served:
                    pass
        close_figures()


A = bf.systems.impact_oscillator(omega=1.4)
QUICK = (  # cheap to reach: the rest of the table needs results of every kind
    Case("simulate", bf.simulate, {"system": A, "y0": (0.0, 0.0), "periods": 2}, {"periods": "ratio"}),
    Case("find_orbit", bf.find_orbit, {"system": A, "guess": (0.0, 0.0), "transient": 9}, {}),
    Case("System", bf.System, {"mass": 1.0, "damping": 0.1, "stiffness": 1.0}, {"damping": "matrix"}),
    Case("Section", bf.Section, {"coordinate": "q0"}, {}), Case("HarmonicBalance", bf.HarmonicBalance, {}, {}),
    Case("Grid", bf.Grid, {"q0": (0, 1, 3)}, {"q0": "range"}),
    Case("impact_chain", bf.systems.impact_chain, {}, {"damping": "number"}),
    Case("elements.RigidStop", el.RigidStop, {}, {}), Case("elements.Driven", el.Driven, {"element": el.Jenkins()}, {}),
)


def test_each_argument_refuses_what_it_cannot_mean():
    wrong = [(case.name, argument, show(value), text) for case, argument, value in draw(7, 600, QUICK)
             for found, text in [verdict(case, argument, value)] if found != "good"]
    assert not wrong, "\n".join(map(str, wrong))


@pytest.mark.parametrize("case", QUICK, ids=[case.name for case in QUICK])
def test_numbers_may_be_numpy_numbers_and_arrays_without_axes(case):
    for name, value in case.base.items():
        for form in forms(value):
            case.function(**{**case.base, name: form})


@pytest.mark.parametrize("t0, good", [(0.0, True), (1e6, True), (-1e9, True), (1e12, False), (1e18, False), (-1e18, False)])
def test_a_start_where_floats_do_not_tell_the_phase_is_refused(t0, good):
    """Floats at 1e12 are 1.2e-4 apart, 3e-5 of a period of 4.5; at 1e9 less than a millionth."""
    if good:
        assert bf.simulate(A, (0.0, 0.0), periods=1, t0=t0).success
    else:
        with pytest.raises(ValueError, match="t0 = .*phase"):
            bf.simulate(A, (0.0, 0.0), periods=1, t0=t0)


def test_nothing_is_spread_over_what_has_another_shape():
    for make in (lambda M, K: bf.rayleigh_damping(M, K, 0.1), lambda M, K: bf.modal_damping(M, K, 0.1)):
        with pytest.raises(ValueError, match="K has shape"):
            make(np.eye(3), 5.0)
        with pytest.raises(ValueError, match="K has shape"):
            make(5.0, np.eye(3))


def test_an_atlas_leaves_a_foreign_file_alone(tmp_path):
    foreign = tmp_path / "notes.txt"
    foreign.write_text("not ours")
    with pytest.raises(FileExistsError, match="left alone"):
        bf.atlas(A, "omega", (1.39, 1.41), {"q0": (-1.0, 0.5)}, probes=1, checks=1, samples=4, file=foreign)
    assert foreign.read_text() == "not ours"


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
