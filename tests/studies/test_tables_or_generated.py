"""Tables and straight-line source march to the same states; a change of parameters compiles nothing."""
import numpy as np
import pytest

from bifurc.compose.scene import scene_of
from studies import tables_or_generated as study
from studies.common import Setting
from studies.straightline import written


@pytest.fixture(scope="module")
def rows():
    """Return the rows of the small setting."""
    return study.ratios(Setting.SMALL)


def test_same_states(rows):
    """One and two degrees of freedom, general march and period kernel: rounding apart."""
    assert {(row.kernel, row.dofs) for row in rows} == {("general march", 1), ("general march", 2),
                                                           ("period kernel", 1)}
    assert all(row.difference <= 1e-12 for row in rows)


def test_source_with_and_without_literals():
    """The numbers read at run time are the literals; the text has no loop over states and no table."""
    T = scene_of(study.TWO).tables
    text, none = written(T)
    other, numbers = written(T, literal=False)
    assert none.size == 0 and numbers.size > 300
    assert "k[" not in text and "T." not in text and other.count("k[") >= numbers.size


def test_other_scenes_are_refused():
    """Source is written for one stop only."""
    with pytest.raises(ValueError, match="one rigid stop"):
        written(scene_of(study.bf.systems.two_sided_impact_oscillator()).tables)


def test_change_of_parameters_compiles_nothing():
    """The numbers of another system: tables rebuilt by the kernel that is there."""
    rows = study.rebuilds(Setting.SMALL)
    assert [row.dofs for row in rows] == list(study.CHAINS)
    assert all(row.compiled == 0 and row.rebuild > 0.0 for row in rows)


def test_starts_are_clear_of_the_stop(rng):
    """No start lies beyond or on the stop."""
    scene, X, modes = study.starts(study.TWO, 50, rng)
    assert X.shape == (50, 4) and np.all(modes == next(scene.start_modes()))
