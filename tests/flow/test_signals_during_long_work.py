"""Long computations of every kind look at signals: a handler runs within a second of its alarm, and may end the work."""
import signal
import time

import numpy as np
import pytest

import bifurc as bf
from bifurc.continuation import deflated_orbits
from bifurc.elements import CubicSpring, HarmonicForce, Jenkins
from bifurc.solve.interrupts import interruptible
from tests.reference.beam import beam

EVERY = 0.05


def sliders(n):
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    return bf.System(np.eye(n), 0.02 * K, K, [HarmonicForce(1.0), *(Jenkins(1.0, 0.5, dof=i) for i in range(n))], omega=0.5)


def two_masses():
    return bf.System(np.eye(2), 1e-3 * np.eye(2), [[2.0, -1.0], [-1.0, 2.0]], [HarmonicForce(0.2), CubicSpring(1.0)], omega=0.7)


def structure():
    M, K, names = beam(250)
    return bf.System.from_matrices(M, None, K, dofs=names)


WORK = {
    "a long sequence of events": lambda: bf.find_orbit(bf.systems.impact_chain(n=24, amplitude=1.0, omega=0.05)).state,
    "a branch of one": lambda: bf.trace(bf.find_orbit(bf.systems.impact_chain(n=70)), "amplitude", (0.44, 0.46),
                                        max_steps=2).column("amplitude"),
    "exponents": lambda: bf.lyapunov_exponents(bf.systems.impact_chain(n=40, amplitude=1.0), periods=256, transient=0).values,
    "labels": lambda: bf.basins_of_attraction(bf.systems.jeffcott_rotor(), bf.Grid(q0=(-1, 1, 8), q1=(-1, 1, 8)), max_periods=60,
                                              workers=1).labels,
    "images of cells": lambda: bf.cell_mapping(two_masses(), bf.Grid(q0=(-1, 1, 4), v0=(-1, 1, 4), q1=(-1, 1, 4), v1=(-1, 1, 4)),
                                               periods=2, audit=9, max_periods=40, workers=1).labels,
    "a balance": lambda: bf.find_orbit(sliders(20), method=bf.HarmonicBalance(21, condense=False)).coefficients,
    "Broyden's method": lambda: bf.find_orbit(sliders(20),
                                               method=bf.HarmonicBalance(31, solver="broyden", condense=False)).residual,
    "a branch of balances": lambda: bf.trace(bf.find_orbit(sliders(16), method=bf.HarmonicBalance(15)), "omega", (0.45, 0.55),
                                             max_steps=3).column("omega"),
    "deflation": lambda: len(deflated_orbits(bf.systems.impact_chain(n=12),
                                             [bf.find_orbit(bf.systems.impact_chain(n=12))], most=2)),
    "a reduction": lambda: structure().reduced(["tip.uy"], 12).reduction.frequencies,
    "a certificate": lambda: bf.find_orbit(bf.systems.impact_chain(n=24)).certify().proved,
    "an atlas": lambda: bf.atlas(bf.systems.impact_oscillator(), "amplitude", (0.5, 0.6), {"q0": (-1, 0.9)}, probes=2,
                                 checks=1, samples=10, workers=1).stable,
}


class Asked(BaseException):
    """Raised by the signal."""


def listened(work, handler, after=EVERY):
    """Do work while an alarm goes off `after` some seconds and ever again; return what it gives."""
    before = signal.signal(signal.SIGALRM, handler)
    signal.setitimer(signal.ITIMER_REAL, after, EVERY)
    try:
        return work()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


@pytest.mark.slow
@pytest.mark.parametrize("name", WORK)
def test_signals_are_heard_during_long_work_which_gives_the_same(name):
    work = WORK[name]
    expected = work()  # compiles
    heard = [time.perf_counter()]
    found = listened(work, lambda *_: heard.append(time.perf_counter()))
    heard.append(time.perf_counter())
    assert np.diff(heard).max() < 1.0
    np.testing.assert_array_equal(found, expected)
    took = heard[-1] - heard[0]

    def ask(*_):
        raise Asked
    for part in (0.1, 0.4):  # and a handler may end it, after which the same work gives the same
        begin = time.perf_counter()
        with pytest.raises(Asked):
            listened(work, ask, part * took)
        assert time.perf_counter() - begin < part * took + 2.0
    np.testing.assert_array_equal(work(), expected)


def test_what_a_long_call_raises_is_raised_and_what_stops_it_is_asked_to():
    def fails(x):
        raise ArithmeticError(x)

    with pytest.raises(ArithmeticError, match="here"):
        interruptible(True, None, fails, "here")
    assert interruptible(True, None, divmod, 7, 4) == interruptible(False, None, divmod, 7, 4) == (1, 3)
    flag = []

    def waits():
        while not flag:
            time.sleep(0.01)

    def ask(*_):
        raise Asked
    with pytest.raises(Asked):
        listened(lambda: interruptible(True, lambda: flag.append(1), waits), ask)
    assert flag
