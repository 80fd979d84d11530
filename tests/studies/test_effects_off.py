"""Absent effects are not in the scene, not in the process and do not change the motion."""
import pytest

from studies import effects_off as study
from studies.common import Setting


def test_scenes_hold_what_they_need():
    """Modes, guards and held rows grow with what is there; nothing is built for what is not."""
    rows = {row.scene: row for row in study.built()}
    free = rows["free"]
    assert (free.modes, free.guards, free.holds, free.laws) == (1, 0, 0, 0)
    assert rows["stop"].modes == 2 and rows["stop"].guards == 1 and rows["stop"].holds == 1
    assert rows["elastic stop"].holds == 0 and rows["two stops"].guards == 2
    assert rows["cubic spring"].laws == 1 and all(row.laws == 0 for row in rows.values() if row.scene != "cubic spring")
    assert free.numbers < rows["elastic stop"].numbers < rows["elastic and rigid stop"].numbers
    assert free.tables < rows["stop"].tables < rows["two stops"].tables


def test_motion_is_that_of_the_plain_loop():
    """Where nothing happens the kernels take exactly the steps of a loop that knows no events."""
    rows = study.costs(Setting.SMALL)
    assert {row.kernel for row in rows} == {"plain loop", "period kernel", "general march"}
    assert all(row.difference <= 1e-13 for row in rows)


def test_jobs_load_what_they_use():
    """`import bifurc` loads neither numba nor matplotlib; an affine scene loads no kernels for laws."""
    found = study.loaded()
    assert not any(found["import bifurc"].values())
    for job in ("simulate, a stop", "orbit, a stop"):
        assert not found[job]["law kernels"] and not found[job]["pictures"] and not found[job]["basins"]
    assert found["simulate, a cubic spring"]["law kernels"]


@pytest.mark.parametrize("name", ["free", "stop"])
def test_report_lists_every_scene(name):
    """Each scene has its line."""
    assert f"\n{name} " in study.report(study.built(), [], {"job": {"numba": False}})
