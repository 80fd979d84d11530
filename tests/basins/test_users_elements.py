"""Studies of systems with a class and a builder of the user's: the same numbers as of the package's own, and by way of files."""
import numpy as np
import pytest

import bifurc as bf
from bifurc import basins
from bifurc.elements import ElasticStop, HarmonicForce

REGION, AMPLITUDES = {"q0": (-1.0, 1.0), "v0": (-1.0, 1.0)}, [0.5, 0.8]


class OwnStop(ElasticStop):
    """Nothing but another name."""


def system_of(stop):
    return bf.System(1.0, 0.2, 1.3, (stop(0.4, 2.0, label="stop"), HarmonicForce(0.6, label="load")), omega=1.0)


@bf.systems.builder
def own_builder(*, amplitude: float = 0.6, omega: float = 1.0) -> bf.System:
    return system_of(OwnStop).with_parameters(omega=omega, **{"load.amplitude": amplitude})


def grid(cells):
    return basins.Grid(q0=(-1.0, 1.0, cells), v0=(-1.0, 1.0, cells))


STUDIES = {
    "chart": lambda system, name, file: basins.parameter_chart(system, {name: AMPLITUDES, "omega": [0.9, 1.1]}, REGION, starts=2,
                                                               transient=30, file=file).periods,
    "diagram": lambda system, name, file: basins.bifurcation_diagram(system, name, AMPLITUDES, transient=30, keep=4,
                                                                     file=file).points,
    "map": lambda system, name, file: basins.basins_of_attraction(system, grid(4), file=file).labels,
    "cells": lambda system, name, file: basins.cell_mapping(system, grid(6), file=file).labels,
    "sweep": lambda system, name, file: basins.sweep(system, name, AMPLITUDES, REGION, samples=20, file=file).fractions,
}


@pytest.mark.parametrize("study", STUDIES)
def test_a_study_of_the_users_own_parts_is_that_of_the_packages(study, tmp_path):
    wanted = STUDIES[study](system_of(ElasticStop), "load.amplitude", None)
    for system, name in ((system_of(OwnStop), "load.amplitude"), (own_builder(), "amplitude")):
        for file in (None, tmp_path / f"{name}.npz"):
            np.testing.assert_array_equal(STUDIES[study](system, name, file), wanted)
