"""Atlases against random starts, on the small setting."""
import pytest

from studies import atlas_audit as study
from studies.common import Setting


@pytest.mark.slow
def test_nothing_is_missed_and_nothing_is_there_twice():
    rows = study.study(Setting.SMALL)
    assert len(rows) == 2 and all(row.seen >= 2 for row in rows)
    assert [row.missed for row in rows] == [(), ()] and [row.twice for row in rows] == [(), ()]
    text = study.report(rows)
    assert "impact oscillator" in text and "nothing_new" in text


def test_what_an_atlas_does_not_hold_is_missed():
    """A row of points that no orbit passes through, on the branch's own period."""
    import bifurc as bf
    case = study.CASES["impact oscillator"]
    atlas = bf.atlas(case.system(), case.parameter, (1.8, 2.0), case.region, probes=2, checks=1, samples=20, periods=1)
    (orbit,) = (orbit for _, orbit in atlas.orbits_at(1.9))
    row = study.np.repeat(orbit.state[None], 40, axis=0)
    scale = study.np.ones(2)
    assert study.knows(atlas, 1.9, row, 1, scale)
    assert not study.knows(atlas, 1.9, row + 0.01, 1, scale)
    assert not study.knows(atlas, 1.9, row, 0, scale)
